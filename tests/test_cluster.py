"""Sweeps on a Dask cluster of two processes."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armlock import LaserNoise, paper_loop, simulate, sweep
from tests.test_sweep import draw

ROOT = Path(__file__).parents[1]
#: The lines of the book's page, piece by piece.
PAGE = re.findall(r"```python\n(.*?)```", (ROOT / "book/cluster.md").read_text(), re.DOTALL)
distributed = pytest.importorskip("distributed")

# Dask warns of ports that are taken and of workers that restart: neither is a failure here.
pytestmark = pytest.mark.filterwarnings("default")


def draw_or_die(task):
    """Kill the process that computes one of the tasks, the first time."""
    seed, place = task
    if seed == 3 and not Path(place).exists():
        Path(place).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return draw(seed)


def test_a_worker_that_is_killed_costs_no_result(tmp_path):
    place = tmp_path / "killed"
    tasks = [(seed, str(place)) for seed in range(12)]
    with distributed.Client(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as client:
        found = sweep(draw_or_die, tasks, executor=client.get_executor())
    assert place.exists()
    assert np.array_equal(found, [draw(seed) for seed in range(12)])


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
