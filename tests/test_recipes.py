"""The code of the pages of recipes and of any loop runs, and prints what the pages show."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

BOOK = Path(__file__).parents[1] / "book"


@pytest.mark.parametrize("name", ["any_loop", "recipes"])
def test_a_page_prints_what_it_shows(tmp_path, name):
    page = (BOOK / f"{name}.md").read_text("utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert max(map(len, "\n".join(blocks).splitlines())) <= 77  # what a page has room for
    shown = "".join(re.findall(r"```text\n(.*?)```", page, re.DOTALL))
    (tmp_path / "page.py").write_text("\n\n".join(blocks))
    command = [sys.executable, "-W", "error", "page.py"]
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == shown
