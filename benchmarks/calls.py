"""Single calls for the two loops that take longest, and how long each may take."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from functools import partial

import numpy as np

from armlock import (
    critical_perturbation,
    flight_loop,
    margins,
    noise_budget,
    paper_loop,
    pulling,
    rightmost_root,
    stability_chart,
    unstable_roots,
)
from benchmarks.measure import alone, in_turn, timed
from benchmarks.report import Topic, at_most


def first_calls() -> float:
    """Time a count, a chart and margins, as the first calls of a process."""
    loop, axis = paper_loop(), 1.0 + 5e-6 * np.linspace(-1.0, 1.0, 100)
    return timed(
        lambda: (unstable_roots(loop), stability_chart(loop, axis, axis), margins(loop))
    )[0]


def run(*, quick: bool) -> Topic:
    """Time calls for the white paper's loop, of 26 poles, and for the paper's."""
    side, points = (5, 100) if quick else (200, 10_000)
    loop, axis = flight_loop(), np.linspace(0.97, 1.03, side)
    frequency, days = np.geomspace(1e-7, 1.0, points), np.linspace(0.05, 20.0, points)
    calls: dict[str, tuple[Callable[[], object], float]] = {
        "count at (1, 1)": (partial(unstable_roots, loop, 1.0, 1.0), 0.5),
        f"chart {side} x {side}": (partial(stability_chart, loop, axis, axis), 60.0),
        "exact margins": (partial(margins, loop), 0.5),
        "exact margins with dead time": (partial(margins, flight_loop(delay=1e-5)), 1.0),
        "margins, phases free above 10 Hz": (
            partial(margins, loop, free_above=20.0 * math.pi),
            0.05,
        ),
        "noise budget over seven decades": (partial(noise_budget, loop, frequency), 2.0),
        f"pulling at {points} times": (partial(pulling, loop, 86400.0 * days), 10.0),
    }
    paper = paper_loop()
    calls |= {
        "the paper's loop: margins": (partial(margins, paper), 0.5),
        "the paper's loop: rightmost root": (partial(rightmost_root, paper), 1.0),
        "the paper's loop: critical perturbation along (0, -1)": (
            partial(critical_perturbation, paper, (0.0, -1.0)),
            0.5,
        ),
    }
    rows = [
        at_most(what, in_turn([call], 1).item(), limit) for what, (call, limit) in calls.items()
    ]
    if not quick:
        with tempfile.TemporaryDirectory() as cache:
            first = alone(first_calls, NUMBA_CACHE_DIR=cache)
        rows.append(at_most("first count, chart and margins of an installation", first, 15.0))
    return Topic("The white paper's loop, and the paper's", rows)
