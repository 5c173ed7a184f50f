"""Compiled functions: kept where there is room, made anew where their code has changed."""

import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import armlock.axis.compiled  # noqa: F401  it listens to numba

ROOT = Path(__file__).parents[1]
# `draw` compiles two functions, in two modules, one of which calls the other.
DRAW = "from armlock import LaserNoise; print(LaserNoise(1).draw(3).tolist())"
LOADED = (
    "from armlock.timedomain.noise import _shape; print(sum(_shape.stats.cache_hits.values()))"
)


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


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """A copy of the package that has run once; what it printed, and a terminal showed."""
    folder = tmp_path_factory.mktemp("here")
    package, ours, theirs = folder / "armlock", *pty.openpty()
    shutil.copytree(ROOT / "armlock", package, ignore=shutil.ignore_patterns("__pycache__"))
    printed, _ = run(package, DRAW, stderr=theirs, XDG_CACHE_HOME=str(folder / "elsewhere"))
    os.close(theirs)
    return package, printed, os.read(ours, 1000).decode()


@pytest.fixture
def package(first, tmp_path):
    """A copy of that package, where it has not run."""
    return Path(shutil.copytree(first[0], tmp_path / "here" / "armlock"))


def test_a_terminal_says_that_something_is_compiled(first):
    assert first[2].startswith("armlock compiles, once")
    assert first[2].endswith("\r\033[K")


def test_where_nothing_can_be_written_it_works_all_the_same(package):
    shutil.rmtree(package / "__pycache__")
    (package / "__pycache__").write_text("in the way")
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null"}
    printed, word = run(package, DRAW, **nowhere)
    assert len(printed.split(",")) == 3
    assert word.count("\n") == 1
    assert "NUMBA_CACHE_DIR" in word


def test_what_others_could_have_written_is_not_run(first, package, tmp_path):
    assert not (first[0].parent / "elsewhere" / "armlock-compiled").exists()
    for folder in (package / "__pycache__" / "armlock-compiled").iterdir():
        folder.chmod(0o777)
    run(package, DRAW, XDG_CACHE_HOME=str(tmp_path))
    assert (tmp_path / "armlock-compiled").exists()


def test_only_a_change_of_what_a_function_uses_compiles_it_anew(first):
    package, printed, _ = first
    # A comment, in a module that the function does not stand in.
    changed = package / "timedomain" / "discretize.py"
    source = changed.read_text()
    changed.write_text(source + "# A comment.\n")
    assert run(package, f"{DRAW}; {LOADED}") == (f"{printed}1\n", "")
    # Of the two functions, the one that has changed is part of the other.
    changed.write_text(source.replace("y = v + (t1 * w1 + t2 * w2)", "y = v"))
    assert source != changed.read_text()
    assert run(package, DRAW)[0] != printed
    changed.write_text(source)


def test_a_function_without_a_module_compiles_beside_the_package():
    def double(x):
        return 2.0 * x

    # As of one that was made from text.
    double.__module__ = None  # type: ignore[assignment]
    assert numba.njit(double)(1.5) == 3.0
