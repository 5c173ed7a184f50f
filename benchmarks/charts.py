"""Charts: their time and memory, and their counts against independent ones.

The requirements: a chart of the common arm, 1000 x 1000 points over [-3, 3]^2, takes at most
a millionth of what dense eigenvalues take, point by point; a 400 x 400 chart of the controlled
loop over 1 +- 5e-6 takes at most 10 s; none needs 1 GiB; and counts agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from armlock import (
    CommonArm,
    DualArm,
    Loop,
    StabilityChart,
    paper_loop,
    semi_discretization,
    stability_chart,
    transition_matrix,
    unstable_roots,
)
from benchmarks.measure import alone, in_turn, peak_memory, timed
from benchmarks.report import Row, Topic, at_least, at_most, comparison, memory_row

STEP = 0.05
RATIO = 1e6
MEMORY = 2**30
# Eigenvalues nearer to the unit circle than this do not tell on which side they are.
DOUBTFUL = 1e-9
SEED = 20


class Case(NamedTuple):
    """A loop, the square of its chart, points on a side, and a limit of its time in s."""

    make: Callable[[], Loop]
    middle: float
    reach: float
    side: int
    limit: float = math.inf


CASES = {
    "common arm, g = 1": Case(partial(CommonArm, 1.0), 0.0, 3.0, 1000),
    "common arm, g = 10": Case(partial(CommonArm, 10.0), 0.0, 3.0, 1000),
    "dual arm, g = 10": Case(partial(DualArm, 10.0), 1.0, 0.1, 1000),
    "controlled loop": Case(paper_loop, 1.0, 5e-6, 400, 10.0),
}
#: Those that are compared with dense eigenvalues.
COMMON = list(CASES)[:2]


def chart(name: str, side: int) -> StabilityChart:
    """Chart a loop made for this call, so that nothing is kept from the call before."""
    case = CASES[name]
    axis = case.middle + case.reach * np.linspace(-1.0, 1.0, side)
    return stability_chart(case.make(), axis, axis)


def chart_alone(name: str, side: int) -> tuple[float, float, int]:
    """Return the times of the first two charts of this process, and its peak memory."""
    first, second = (timed(chart, name, side)[0] for _ in range(2))
    return first, second, peak_memory()


def chart_rows(name: str, side: int, points: int) -> list[Row]:
    """Measure a chart in a process of its own, and compare it with counts at single points."""
    first, second, memory = alone(chart_alone, name, side)
    found = chart(name, side)
    rows, columns = np.random.default_rng(SEED).integers(0, side, (2, points))
    # A chart is that of D, with its root at s = 0.
    where = found.x[columns], found.y[rows]
    seconds, counts = timed(unstable_roots, found.system, *where)
    differ = int((counts != found.counts[rows, columns]).sum())
    what, limit = f"{name}: chart {side} x {side}", CASES[name].limit
    return [
        Row(f"{what}, first one of a process", first),
        at_most(what, second, limit) if limit < math.inf else Row(what, second),
        memory_row(what, memory, MEMORY),
        comparison(f"{name}: chart against single counts [a]", differ, points, seconds),
    ]


def dense_rows(name: str, side: int, points: int, passes: int) -> list[Row]:
    """Compare a chart with dense eigenvalues, and the count of the map with theirs."""
    system, reach = CASES[name].make(), CASES[name].reach
    where = np.random.default_rng(SEED).uniform(-reach, reach, (points, 2))
    matrices = [transition_matrix(system, x, y, step=STEP) for x, y in where]
    calls: list[Callable[[], object]] = [partial(chart, name, side)]
    calls += [partial(np.linalg.eigvals, matrix) for matrix in matrices]
    best, *each = in_turn(calls, passes).min(axis=0)
    dense = float(np.mean(each)) * side**2
    sizes = np.abs(np.linalg.eigvals(np.array(matrices)))
    clear = (np.abs(sizes - 1.0) > DOUBTFUL).all(axis=1)
    mapped = unstable_roots(semi_discretization(system, STEP), *where.T)
    differ = int((mapped != (sizes > 1.0).sum(axis=1))[clear].sum())
    order = len(matrices[0])
    return [
        at_least(
            f"{name}: dense {order} x {order}, all points [b]", dense, dense / best, RATIO
        ),
        comparison(f"{name}: count of the map against them [c]", differ, int(clear.sum())),
    ]


def run(*, quick: bool) -> Topic:
    """Measure everything about charts."""
    points, dense, passes = (30, 1, 1) if quick else (2000, 10, 3)
    rows = []
    for name, case in CASES.items():
        side = 20 if quick else case.side
        rows += chart_rows(name, side, points)
        if name in COMMON:
            rows += dense_rows(name, side, dense, passes)
    notes = [
        "[a] Argument principle, point by point: another method than the chart's crossings.",
        f"[b] Extrapolated from {dense} random points: the best of {passes} runs at each, on "
        f"one thread, in turn with the chart, which uses all cores; the matrices are there.",
        f"[c] The map is the semi-discretization of order 0 with a step of {STEP} s; the dense "
        f"reference is numpy.linalg.eigvals of its transition matrix.",
    ]
    return Topic("Charts", rows, notes)
