"""Compiled functions: kept where there is room, made anew where what is kept is no good."""

import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from armlock.compiled import soon

ROOT = Path(__file__).parents[1]
# `draw` compiles two functions, in two modules, one of which calls the other.
DRAW = "from armlock import LaserNoise; print(LaserNoise(1).draw(3).tolist())"
LOADED = "from armlock.noise import _shape; print(sum(_shape.stats.cache_hits.values()))"
# A long walk, close to the ideal point.
COUNT = "from armlock import *; print(unstable_roots(paper_loop(), 1, 1 - 1e-6))"


@pytest.fixture
def package(tmp_path):
    """A copy of the package that has never run."""
    target = tmp_path / "here" / "armlock"
    shutil.copytree(ROOT / "armlock", target, ignore=shutil.ignore_patterns("__pycache__"))
    return target


def run(package, code, stderr=subprocess.PIPE, **settings):
    environment = os.environ | {"PYTHONPATH": str(package.parent), **settings}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-B", "-c", code],
        env=environment,
        cwd=package.parent,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
        check=True,
    )
    return done.stdout, done.stderr


def test_where_nothing_can_be_written_it_works_all_the_same(package):
    (package / "__pycache__").write_text("in the way")
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null"}
    assert run(package, COUNT, **nowhere) == ("0\n", "")
    printed, word = run(package, DRAW, **nowhere)
    assert len(printed.split(",")) == 3
    assert word.count("\n") == 1
    assert "NUMBA_CACHE_DIR" in word


def test_what_is_damaged_or_out_of_date_is_compiled_anew(package):
    first, _ = run(package, DRAW)
    assert run(package, f"{DRAW}; {LOADED}") == (f"{first}1\n", "")
    kept = package / "__pycache__"
    for pattern, damage in (
        ("*.nbc", lambda data: data[:-1500] + bytes(700) + data[-800:]),
        ("*.nbi", lambda data: data[: len(data) // 2]),
    ):
        for file in kept.glob(pattern):
            file.write_bytes(damage(file.read_bytes()))
        assert run(package, f"{DRAW}; {LOADED}") == (f"{first}0\n", "")
    assert run(package, f"{DRAW}; {LOADED}") == (f"{first}1\n", "")
    # Of the two functions, the one that has changed is part of the other.
    changed = package / "discretize.py"
    source = changed.read_text()
    changed.write_text(source.replace("y = v + (t1 * w1 + t2 * w2)", "y = v"))
    assert source != changed.read_text()
    assert run(package, DRAW)[0] != first


def test_a_terminal_says_that_something_is_compiled(package):
    ours, theirs = pty.openpty()
    run(package, DRAW, stderr=theirs)
    os.close(theirs)
    shown = os.read(ours, 1000).decode()
    assert shown.startswith("armlock compiles, once")
    assert shown.endswith("\r\033[K")


def test_the_first_calls_are_plain_python():
    """Until there have been some, or one is too long."""
    compiled = []

    def function(x: int) -> int | None:
        return x if x < LIMIT else None

    class Other:
        py_func = staticmethod(function)

        def __call__(self, x: int) -> int:
            compiled.append(x)
            return x

    for calls, left in (((1, 2, 3, 4, 5, 6), [6]), ((1, 20, 3), [20, 3])):
        compiled.clear()
        call = soon(Other(), LIMIT=10)
        assert tuple(call(x) for x in calls) == calls
        assert compiled == left


LIMIT = 2
