"""Compiled functions run where they cannot be kept, too, and say so once."""

import os
import shutil
import subprocess
import sys
from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from armlock import CommonArm, DualArm, compiled, unstable_roots
from armlock.compiled import Plain, Progress
from armlock.engine import decide, inclusion

MODULE = """
from compiled import njit
from factor import FACTOR

@njit()
def times(x):
    return FACTOR * x

@njit()
def more(x):
    return x + 1

print(times(3), more(3), getattr(times._cache, "exists", False))
"""
FULL = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
NOT_KEPT = "RuntimeWarning: compiled functions are not kept, "


def printed(folder, factor=2, *, full=False, **more):
    """Compile two functions in a process, and return what it prints and warns of.

    The module `compiled` stands alone there, because to import the package takes seconds. A
    limit on the size of files stands for a full disk. The line that says so when something is
    compiled is switched off with the progress bars.
    """
    (folder / "times.py").write_text(MODULE, "utf-8")
    (folder / "factor.py").write_text(f"FACTOR = {factor}\n", "utf-8")
    shutil.copy(compiled.__file__, folder)
    done = subprocess.run(
        [sys.executable, "-B", "-c", full * FULL + "import times"],
        env={
            **os.environ, "NUMBA_CACHE_DIR": str(folder),
            "TQDM_DISABLE": "1", **more,
        },
        cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout, done.stderr


def test_where_nothing_can_be_written_each_process_compiles(tmp_path):
    for folder in ("__pycache__", "none"):
        (tmp_path / folder).touch()
    out, err = printed(
        tmp_path, HOME="/dev/null", XDG_CACHE_HOME="/dev/null", NUMBA_CACHE_DIR=""
    )
    assert out == "6 4 False\n"
    assert err.count("Warning") == err.count(NOT_KEPT) == 1


def test_compiling_says_once_what_takes_long_and_a_full_disk_ends_no_call(tmp_path):
    line = "armlock: compiling, once for this installation ...\n"
    assert printed(tmp_path, TQDM_DISABLE="") == ("6 4 True\n", line)
    assert printed(tmp_path, TQDM_DISABLE="") == ("6 4 True\n", "")
    # The index fits onto the disk, and what has been compiled does not: what was compiled with
    # the other factor stays there.
    out, err = printed(tmp_path, factor=5, full=True)
    assert out == "15 4 False\n"
    assert err.count("Warning") == err.count(NOT_KEPT) == 1
    assert printed(tmp_path, factor=5) == ("15 4 True\n", "")


def test_walks_count_the_same_uncompiled(monkeypatch):
    rng = np.random.default_rng(1)
    points = rng.uniform(-2.0, 2.0, (12, 2))
    loops = [CommonArm(g).replace(delay=d) for g, d in ((0.3, 0.0), (1.0, 0.1))] + [
        DualArm(0.5)
    ]
    expected = [[int(unstable_roots(loop, *at)) for at in points] for loop in loops]
    used = Plain(inclusion, 600.0)
    monkeypatch.setattr(used, "serves", lambda entry: True)
    monkeypatch.setattr(decide, "_uncompiled", used)
    # No compiled function is left to fall back on, once the plain ones are copied.
    assert used.functions
    monkeypatch.setattr(inclusion, "wind", None)
    assert [[int(unstable_roots(loop, *at)) for at in points] for loop in loops] == expected


def test_plain_python_serves_where_nothing_is_compiled_and_time_is_left(monkeypatch):
    class Entry:
        signatures: ClassVar = []
        _cache = SimpleNamespace(exists=False)

    assert Plain(inclusion, 1.0).serves(Entry)
    assert not Plain(inclusion, 0.0).serves(Entry)
    monkeypatch.setattr(Entry._cache, "exists", True)
    assert not Plain(inclusion, 1.0).serves(Entry)
    monkeypatch.setattr(Entry._cache, "exists", False)
    monkeypatch.setattr(Entry, "signatures", ["int64()"])
    assert not Plain(inclusion, 1.0).serves(Entry)


def test_what_plain_python_cannot_count_is_compiled(monkeypatch):
    used, tried = Plain(inclusion, 600.0), []

    def wind(*arguments):
        tried.append(arguments)
        raise ZeroDivisionError

    used.functions.wind = wind
    monkeypatch.setattr(used, "serves", lambda entry: True)
    monkeypatch.setattr(decide, "_uncompiled", used)
    assert unstable_roots(CommonArm(), 1.5, 1.5) > 0
    assert tried


def test_the_clock_of_a_progress_bar_starts_after_compiling():
    with Progress(10, "work", " points") as bar:
        bar.start_t -= 50.0
        bar.update(4)
        bar.start_t -= 10.0
        bar.update(5)
        shown = bar.format_dict
        assert 10.0 <= shown["elapsed"] < 15.0
        assert shown["n"] - shown["initial"] == 5
