"""How far something long has come, said where somebody watches, and nowhere else."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# For so many s nothing is said; after that the line is written anew so often, in s.
_SHORT, _EVERY = 5.0, 0.5


@contextmanager
def progress(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """Yield a function that is told how much of a total is done.

    After some seconds it keeps a line on the error stream up to date, which is gone at the
    end. Log files, builds and worker processes get nothing.

    Parameters
    ----------
    what : str
        What takes so long, for the line.
    total : int
        How much there is to do.

    Yields
    ------
    callable
        It takes what is done, of `total`.
    """
    begin = shown = time.monotonic()
    watched, length = is_watched(), 0

    def say(done: int) -> None:
        nonlocal shown, length
        now = time.monotonic()
        if watched and done and now - begin > _SHORT and now - shown > _EVERY:
            share = min(done / total, 1.0)
            left = (now - begin) * (1.0 / share - 1.0)
            line = f"{what}: {share:.0%}, {left:.0f} s left"
            print(f"\r{line:{length}}", end="", file=sys.stderr, flush=True)
            shown, length = now, len(line)

    try:
        yield say
    finally:
        if length:
            print(f"\r{'':{length}}\r", end="", file=sys.stderr, flush=True)


def is_watched() -> bool:
    """Whether somebody sees the error stream grow: on a terminal, or in Jupyter.

    A notebook that is run by a build has a kernel, but no server that names its session; and
    the line belongs to the process and thread that the user waits for.
    """
    in_jupyter = "ipykernel" in sys.modules and "JPY_SESSION_NAME" in os.environ
    in_front = threading.current_thread() is threading.main_thread()
    is_worker = multiprocessing.parent_process() is not None
    return in_front and not is_worker and (in_jupyter or sys.stderr.isatty())
