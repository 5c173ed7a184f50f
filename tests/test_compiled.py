"""Compiled functions: kept where there is room, made anew where their code has changed."""

import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# `draw` compiles two functions, in two modules, one of which calls the other.
DRAW = "from armlock import LaserNoise; print(LaserNoise(1).draw(3).tolist())"
LOADED = (
    "from armlock.timedomain.noise import _shape; print(sum(_shape.stats.cache_hits.values()))"
)


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
    printed, word = run(package, DRAW, **nowhere)
    assert len(printed.split(",")) == 3
    assert word.count("\n") == 1
    assert "NUMBA_CACHE_DIR" in word


def test_what_others_could_have_written_is_not_run(package, tmp_path):
    elsewhere = {"XDG_CACHE_HOME": str(tmp_path)}
    run(package, DRAW, **elsewhere)
    assert not (tmp_path / "armlock-compiled").exists()
    for folder in (package / "__pycache__" / "armlock-compiled").iterdir():
        folder.chmod(0o777)
    run(package, DRAW, **elsewhere)
    assert (tmp_path / "armlock-compiled").exists()


def test_only_a_change_of_what_a_function_uses_compiles_it_anew(package):
    first, _ = run(package, DRAW)
    assert run(package, f"{DRAW}; {LOADED}") == (f"{first}1\n", "")
    # A comment, in a module that the function does not stand in.
    changed = package / "timedomain" / "discretize.py"
    source = changed.read_text()
    changed.write_text(source + "# A comment.\n")
    assert run(package, f"{DRAW}; {LOADED}") == (f"{first}1\n", "")
    # Of the two functions, the one that has changed is part of the other.
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
