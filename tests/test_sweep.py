"""Sweeps: any executor, the same bits; a file that an interrupted sweep goes on with."""

import math
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from armlock import CommonArm, LaserNoise, simulate, stability_chart, sweep
from armlock.sweep import TASKS

ROOT = Path(__file__).parents[1]
ABOUT = {"axes": ["c1", "c2"], "units": ["1", "1"], "seed": 3}


def draw(seed):
    """The locked laser of one draw: what a worker has to do the same, bit by bit."""
    return simulate(CommonArm(), LaserNoise(seed, 10.0).draw(500), sample_rate=10.0)


def size(point):
    return math.hypot(*point)


def fails_at_three(point):
    if point == 3:
        raise ArithmeticError("three")
    return point


@pytest.fixture(scope="module")
def processes():
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        yield executor


def test_any_executor_gives_the_serial_results(processes):
    expected = [draw(seed) for seed in range(6)]
    with ThreadPoolExecutor(2) as threads:
        for executor in (None, threads, processes):
            found = sweep(draw, iter(range(6)), executor=executor)
            assert np.array_equal(found, expected)


@pytest.mark.parametrize("count", [0, 1, TASKS, TASKS + 1, 3 * TASKS - 1])
def test_tasks_of_several_points_keep_the_order(count):
    with ThreadPoolExecutor(2) as executor:
        found = sweep(str, range(count), executor=executor)
    assert found == [str(i) for i in range(count)]


def test_an_error_of_the_function_ends_the_sweep(processes):
    for executor in (None, processes):
        with pytest.raises(ArithmeticError, match="three"):
            sweep(fails_at_three, range(6), executor=executor)
    with pytest.raises(TypeError, match=r"executor must be .*get_executor"):
        sweep(draw, range(3), executor=2)  # type: ignore[arg-type]


def test_progress_is_shown(capsys, monkeypatch):
    sweep(str, range(3), progress=True)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == "3 of 3, 0 s left\n"
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    sweep(str, range(3), progress=True)
    rewritten = capsys.readouterr().err
    assert re.findall(r"(\d) of 3.*?([\r\n])", rewritten) == [
        *zip("123", "\r\r\n", strict=True)
    ]


def test_a_file_holds_results_points_and_what_they_are(tmp_path, processes):
    h5py = pytest.importorskip("h5py")
    path, points = tmp_path / "sizes.h5", [(3.0, 4.0), (5.0, 12.0), (8.0, 15.0)]
    found = sweep(size, points, executor=processes, store=path, about=ABOUT)
    assert found == [5.0, 13.0, 17.0]
    with h5py.File(path) as file:
        assert np.array_equal(file["points"], points)
        assert np.array_equal(file["results"], found)
        assert file["done"][...].all()
        assert list(file.attrs["axes"]) == ABOUT["axes"]
        assert file.attrs["seed"] == 3
    # Nothing is computed again, and nothing is mixed with another sweep.
    assert sweep(size, points, store=path, about=ABOUT) == found
    for name, function, others, about in (
        ("about", size, points, {**ABOUT, "seed": 4}),
        ("points", size, points[:2], ABOUT),
        ("function", partial(math.dist, (0.0, 0.0)), points, ABOUT),
    ):
        with pytest.raises(ValueError, match=f"store must be .* another {name}"):
            sweep(function, others, store=path, about=about)
    assert [file.name for file in tmp_path.iterdir()] == ["sizes.h5"]


KILLED = """
import os, signal, sys
import numpy as np
from armlock import sweep

def function(point):
    if point == 5 and sys.argv[2] == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    print(point, flush=True)
    return np.full(3, point / 7)

print(sum(sum(sweep(function, range(9), store=sys.argv[1]))).hex())
"""


def test_a_killed_sweep_goes_on_where_it_was(tmp_path):
    """All that was computed before the process was killed is in the file."""
    pytest.importorskip("h5py")

    def run(*arguments):
        command = [sys.executable, "-c", KILLED, *map(str, arguments)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout.split()

    assert run(tmp_path / "a.h5", "die") == (-signal.SIGKILL, list("01234"))
    code, printed = run(tmp_path / "a.h5", "live")
    assert (code, printed[:-1]) == (0, list("5678"))
    each = sum(point / 7 for point in range(9))
    assert printed[-1] == float(each + each + each).hex()


def test_points_that_are_no_numbers_are_kept_as_text(tmp_path):
    pytest.importorskip("h5py")
    loops = [CommonArm(gain) for gain in (0.1, 0.2)]
    path = tmp_path / "loops.h5"
    assert sweep(_rate, loops, store=path) == [0.1, 0.2]
    with pytest.raises(ValueError, match="another points"):
        sweep(_rate, loops[::-1], store=path)


def _rate(loop):
    return loop.controller.gain


def test_a_chart_by_tiles_is_the_chart(processes):
    x, y = np.linspace(3.0, -3.0, 41), np.linspace(-3.0, 3.0, 300)
    whole = stability_chart(CommonArm(), x, y)
    tiled = stability_chart(CommonArm(), x, y, executor=processes)
    assert np.array_equal(tiled.counts, whole.counts)


PARENT = """
import multiprocessing, os, signal, sys, time
from concurrent.futures import ProcessPoolExecutor
from armlock import sweep

def function(point):
    with open(sys.argv[1], "a") as file:
        file.write(f"{os.getpid()}\\n")
    time.sleep(0.2)
    return point

if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        sweep(function, range(10_000), executor=executor)
"""


def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    script, told = tmp_path / "parent.py", tmp_path / "told"
    script.write_text(PARENT)
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen([sys.executable, script, told], env=env) as parent:
        workers: set[str] = set()
        until = time.monotonic() + 60.0
        while len(workers) < 2 and time.monotonic() < until:
            time.sleep(0.1)
            workers = set(told.read_text().split()) if told.exists() else set()
        parent.kill()
    assert len(workers) == 2
    until = time.monotonic() + 10.0
    while any(Path("/proc", worker).exists() for worker in workers):
        assert time.monotonic() < until
        time.sleep(0.1)
