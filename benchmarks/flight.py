"""The white paper's loop: a count, a chart, and the noise budget."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from armlock import flight_loop, noise_budget, stability_chart, unstable_roots
from benchmarks.report import Row, Topic


def row(what: str, function: Callable[[], object], most: float) -> Row:
    """Time a call, after one that compiles."""
    function()
    start = time.perf_counter()
    function()
    seconds = time.perf_counter() - start
    return Row(what, seconds, requirement=f"at most {most:g} s", met=seconds <= most)


def run(*, quick: bool, folder: Path) -> Topic:
    """Measure the loop of 26 poles over eleven decades of frequency."""
    side, points = (5, 100) if quick else (200, 10_000)
    loop, axis = flight_loop(), np.linspace(0.97, 1.03, side)
    frequency = np.geomspace(1e-7, 1.0, points)
    topic = Topic("The white paper's loop")
    topic.rows += [
        row("count at (1, 1)", lambda: unstable_roots(loop, 1.0, 1.0), 0.5),
        row(f"chart {side} x {side}", lambda: stability_chart(loop, axis, axis), 60.0),
        row("noise budget over seven decades", lambda: noise_budget(loop, frequency), 2.0),
    ]
    return topic
