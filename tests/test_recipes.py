"""The code of the pages of recipes and of any loop runs, block after block."""

import os
import re
import subprocess
import sys
from pathlib import Path

BOOK = Path(__file__).parents[1] / "book"
PAGE = BOOK / "recipes.md"


def test_the_recipes_run_and_print_what_a_reader_expects(tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    (tmp_path / "recipes.py").write_text("\n\n".join(blocks))
    command = [sys.executable, "-W", "error", "recipes.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == "[0 0 1]"
    assert lines[1].split()[0] == "0.5"
    assert "nan" in lines[5]
    assert lines[6] == "True"


def test_any_loop_prints_what_its_page_shows(tmp_path):
    page = (BOOK / "any_loop.md").read_text("utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    shown = "".join(re.findall(r"```text\n(.*?)```", page, re.DOTALL))
    (tmp_path / "any_loop.py").write_text("\n\n".join(blocks))
    command = [sys.executable, "any_loop.py"]
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == shown
