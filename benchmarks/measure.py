"""How time and memory are measured."""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from armlock.checks import FloatArray


def timed(
    function: Callable[..., Any],
    *arguments: Any,
    clock: Callable[[], float] = time.perf_counter,
    **options: Any,
) -> tuple[float, Any]:
    """Return how long a call took in s, and what it returned."""
    start = clock()
    result = function(*arguments, **options)
    return clock() - start, result


def in_turn(
    calls: Sequence[Callable[[], object]],
    passes: int,
    clock: Callable[[], float] = time.perf_counter,
) -> FloatArray:
    """Return the times of calls in s, a row for each pass.

    They are timed in turn, so that a busy spell does not spoil one of them, after a pass that
    compiles. No result is kept, so that all find the same memory free.
    """
    for call in calls:
        call()
    return np.array([[timed(call, clock=clock)[0] for call in calls] for _ in range(passes)])


def alone(function: Callable[..., Any], *arguments: Any, **environment: str) -> Any:
    """Call a function of a module in a new process, with more environment variables."""
    with patch.dict(os.environ, environment), ProcessPoolExecutor(1, get_context("spawn")) as p:
        return p.submit(function, *arguments).result()


def peak_memory() -> int:
    """Return the most resident memory this process has had, in bytes."""
    status = Path("/proc/self/status")
    if status.exists():
        # On Linux getrusage counts in what the parent had when it started this process.
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def load() -> float:
    """Return how many processes have wanted a core, on average over the last minute."""
    return round(os.getloadavg()[0], 2)


def cores() -> int:
    """Return the number of cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
