"""Compiled functions run where they cannot be kept, too, and say so once."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
MODULE = """
from armlock.compiled import njit

@njit()
def times(x):
    return {} * x

@njit()
def more(x):
    return x + 1

print(times(3), more(3))
"""
FULL = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
NOT_KEPT = r"RuntimeWarning: compiled functions are not kept for the next process, .*: {}\n"


def printed(folder, factor=2, *, full=False, **more):
    """Compile two functions in a process, and return what it prints and warns of.

    A limit on the size of files stands for a full disk.
    """
    (folder / "times.py").write_text(MODULE.format(factor), "utf-8")
    done = subprocess.run(
        [sys.executable, "-B", "-c", full * FULL + "import times"],
        env={**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(folder), **more},
        cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout, done.stderr


def said_once(text, reason):
    """Tell whether a text consists of the one warning, and the line that Python shows."""
    return text.count("Warning") == 1 and re.search(NOT_KEPT.format(reason), text)


def test_where_nothing_can_be_written_each_process_compiles(tmp_path):
    for folder in ("__pycache__", "none"):
        (tmp_path / folder).touch()
    out, err = printed(
        tmp_path, HOME="/dev/null", XDG_CACHE_HOME="/dev/null", NUMBA_CACHE_DIR=""
    )
    assert out == "6 4\n"
    assert said_once(err, "cannot cache function .*")


def test_a_full_disk_or_a_damaged_cache_ends_no_call(tmp_path):
    assert printed(tmp_path) == ("6 4\n", "")
    # The index fits onto the disk, and what has been compiled does not: what was compiled from
    # the source before stays there.
    out, err = printed(tmp_path, factor=5, full=True)
    assert out == "15 4\n"
    assert said_once(err, r"\[Errno 27\] File too large")
    assert printed(tmp_path, factor=5) == ("15 4\n", "")
    for file in tmp_path.glob("**/*.nb[ic]"):
        os.truncate(file, file.stat().st_size // 2)
    out, err = printed(tmp_path, factor=5)
    assert out == "15 4\n"
    assert said_once(err, ".*")
