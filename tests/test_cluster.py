"""Sweeps on a Dask cluster of two processes."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armlock import LaserNoise, paper_loop, simulate

ROOT = Path(__file__).parents[1]
#: The lines of the book's page, piece by piece.
PAGE = re.findall(r"```python\n(.*?)```", (ROOT / "book/cluster.md").read_text(), re.DOTALL)
distributed = pytest.importorskip("distributed")

# Dask warns of ports that are taken and of workers that restart: neither is a failure here.
pytestmark = pytest.mark.filterwarnings("default")


def test_the_lines_of_the_page_run(tmp_path):
    """As a script, whose workers import it again."""
    pytest.importorskip("h5py")
    (tmp_path / "page.py").write_text(PAGE[0].replace("200)", "6)"))
    done = subprocess.run(
        [sys.executable, "page.py"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert re.fullmatch(r"between \d+\.\d+ and \d+\.\d+\n", done.stdout)
    assert "6 of 6" in done.stderr


def test_the_full_draws_of_the_page_are_single_runs():
    function = PAGE[1].partition("\n\n\nfound")[0].replace("2000", "2").replace("20_000", "500")
    names: dict[str, Any] = {"np": np}
    exec(function, names)
    loop = paper_loop()
    for k, peak in enumerate(names["largest"](7)[:3]):
        single = simulate(loop, LaserNoise(7 + k, at_rest=True).draw(1000))
        assert peak == np.abs(single).max()
