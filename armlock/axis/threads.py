"""How compiled functions run in threads, so that an interrupt ends them, and on all cores.

Compiled functions hear no interrupt. Those here release the interpreter's lock, and end early
once the last of their arguments, the array `stop`, is set.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
from numba import config

from armlock.checks import BoolArray

# Most steps of one walk: some three seconds. A turn of the longest delay takes about ten, but
# where slow terms are followed alone. No plain int, for which numba would compile walks twice.
MOST_STEPS = np.int64(10_000_000)
# Steps that a walk may take before it is left to another thread: about a tenth of a second.
_FEW_STEPS = 300_000


def interruptible(
    walk: Callable[..., Any], *arguments: Any, most: int = int(MOST_STEPS)
) -> Any:
    """Return what a compiled walk does, and let an interrupt end it.

    Compiled functions hear no interrupt. A short walk is over before that matters. A long one
    is begun anew in another thread: this one only waits, and tells it to stop.

    Parameters
    ----------
    walk : callable
        A function that releases the interpreter's lock. Its last two arguments are the most
        steps, and an array whose entry stops it; the last of what it returns is whether it came
        to its end.
    *arguments
        All others.
    most : int, optional
        The most steps.
    """
    stop = np.zeros(1, dtype=np.bool_)
    try:
        found = walk(*arguments, min(most, _FEW_STEPS), stop)
    except SystemError as error:
        # What numba makes of an interrupt that it meets while it packs its results.
        cause: BaseException = error
        while isinstance(cause, SystemError) and cause.__cause__ is not None:
            cause = cause.__cause__
        raise cause from None
    if found[-1] or most <= _FEW_STEPS:
        return found
    with ThreadPoolExecutor(1) as pool:
        longer = pool.submit(walk, *arguments, most, stop)
        try:
            return longer.result()
        finally:
            stop[0] = True


def on_all_cores(
    function: Callable[..., None], size: int, *arguments: object, stop: BoolArray
) -> None:
    """Call function(first, last, ...) for ranges that cover `size`, in a thread each.

    The function is compiled to release the interpreter's lock. Ranges are short, because some
    points or rows take much longer than others. An interrupt is heard at once, since this
    thread only waits; the others end because the last argument, `stop`, is set.
    """
    cores = config.NUMBA_NUM_THREADS
    edges = np.unique(np.linspace(0, size, 16 * cores + 1).astype(int)).tolist()
    ranges = list(pairwise(edges))[::-1]

    def work() -> None:
        """Take the next range until there is none: a list gives each to one thread."""
        while ranges:
            try:
                first, last = ranges.pop()
            except IndexError:
                return
            function(first, last, *arguments, stop)

    pool = ThreadPoolExecutor(cores)
    try:
        for thread in [pool.submit(work) for _ in range(cores)]:
            thread.result()
    except BaseException:
        ranges.clear()
        stop[0] = True
        raise
    finally:
        pool.shutdown(wait=False)
