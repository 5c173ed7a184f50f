"""The white paper's loop: counts, a chart, margins, the noise budget, and plain NumPy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from armlock import (
    Loop,
    flight_loop,
    margins,
    noise_budget,
    pulling,
    stability_chart,
    unstable_roots,
)
from armlock.checks import FloatArray
from benchmarks.report import Row, Topic, at_most, timed

#: Past this frequency in rad/s |L| is below one.
LAST = 2.0 * np.pi * 14.8e3
_BLOCK = 1_000_000


def row(what: str, function: Callable[[], object], most: float) -> Row:
    """Time a call, after one that compiles."""
    function()
    return at_most(what, timed(function)[0], most)


def fine_grid(loop: Loop, last: float, points_a_turn: float) -> FloatArray:
    """Return angular frequencies that follow 1 + L.

    So many points in each turn of an arm's phase, times one plus the largest |L| there: beside
    a null of the sensor 1 + L turns within 1 / |L| of that turn.
    """
    omega = np.geomspace(1e-9, last, 20_001)
    first, second = loop.arm_responses(1j * omega)
    largest = np.abs(first + second) + np.abs(first) + np.abs(second)
    turns = np.diff(omega) * loop.tau1 / (2.0 * np.pi)
    steps = points_a_turn * turns * (1.0 + largest[1:])
    number = np.concatenate(([0.0], np.cumsum(20.0 * np.diff(np.log(omega)) + steps)))
    return np.asarray(np.interp(np.arange(0.0, number[-1]), number, omega))


def encirclements(loop: Loop, omega: FloatArray) -> tuple[int, float]:
    """Wind 1 + L up in blocks; return encirclements of -1, and the largest step in rad."""
    angle, largest = 0.0, 0.0
    for start in range(0, omega.size, _BLOCK):
        part = omega[start : start + _BLOCK + 1]
        value = 1.0 + loop.open_loop(1j * part)
        steps = np.angle(value[1:] / value[:-1])
        angle += float(steps.sum())
        largest = max(largest, float(np.abs(steps).max()))
    return round(angle / np.pi), largest


def run(*, quick: bool, folder: Path) -> Topic:
    """Measure the loop of 26 poles over eleven decades of frequency."""
    side, points = (5, 100) if quick else (200, 10_000)
    loop, axis = flight_loop(), np.linspace(0.97, 1.03, side)
    frequency = np.geomspace(1e-7, 1.0, points)
    topic = Topic("The white paper's loop")
    topic.rows += [
        row("count at (1, 1)", lambda: unstable_roots(loop, 1.0, 1.0), 0.5),
        row(f"chart {side} x {side}", lambda: stability_chart(loop, axis, axis), 60.0),
        row("exact margins", lambda: margins(loop), 10.0),
        row(
            "margins, phases free above 10 Hz",
            lambda: margins(loop, free_above=20.0 * np.pi),
            0.05,
        ),
        row("noise budget over seven decades", lambda: noise_budget(loop, frequency), 2.0),
    ]
    times = 86400.0 * np.linspace(0.05, 20.0, points)
    topic.rows.append(Row(f"pulling at {points} times", timed(pulling, loop, times)[0]))
    grid = fine_grid(loop, 1e-3 if quick else LAST, 4.0)
    seconds, (found, largest) = timed(encirclements, loop, grid)
    topic.rows.append(
        Row(
            f"plain NumPy on {grid.size:.2g} points, steps up to {largest:.2f} rad",
            seconds,
            requirement="the same count",
            met=quick or found == int(unstable_roots(loop, 1.0, 1.0)),
            correctness=not quick,
        )
    )
    return topic
