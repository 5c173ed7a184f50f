"""Single calls for the two loops that take longest, and how long each may take."""

from __future__ import annotations

import math
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
    stability_chart,
    unstable_roots,
)
from benchmarks.measure import in_turn
from benchmarks.report import Topic, at_most

#: Of (c1, c2), towards which stability ends.
DIRECTIONS = ((1.0, -1.0), (0.0, -1.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0))


def run(*, quick: bool) -> Topic:
    """Time calls for the white paper's loop, of 26 poles, and for the paper's."""
    side, points = (5, 100) if quick else (200, 10_000)
    loop, axis = flight_loop(), np.linspace(0.97, 1.03, side)
    frequency, days = np.geomspace(1e-7, 1.0, points), np.linspace(0.05, 20.0, points)
    calls: dict[str, tuple[Callable[[], object], float]] = {
        "count at (1, 1)": (partial(unstable_roots, loop, 1.0, 1.0), 0.5),
        f"chart {side} x {side}": (partial(stability_chart, loop, axis, axis), 60.0),
        "exact margins": (partial(margins, loop), 10.0),
        "margins, phases free above 10 Hz": (
            partial(margins, loop, free_above=20.0 * math.pi),
            0.05,
        ),
        "noise budget over seven decades": (partial(noise_budget, loop, frequency), 2.0),
        f"pulling at {points} times": (partial(pulling, loop, 86400.0 * days), 10.0),
    }
    calls |= {
        f"the paper's loop: critical perturbation along {direction}": (
            partial(critical_perturbation, paper_loop(), direction),
            1.0,
        )
        for direction in DIRECTIONS
    }
    rows = [
        at_most(what, in_turn([call], 1).item(), limit) for what, (call, limit) in calls.items()
    ]
    return Topic("The white paper's loop, and the paper's", rows)
