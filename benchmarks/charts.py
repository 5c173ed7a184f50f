"""Charts of the common arm: against dense eigenvalues, against single counts, growth.

The requirement: a chart of 1000 x 1000 points over [-3, 3]^2 takes at most a millionth of
what dense eigenvalues take, point by point, with counts that agree with independent ones.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.figure import Figure

import armlock
from armlock import CommonArm, StabilityChart, stability_chart, unstable_roots
from armlock.checks import FloatArray
from armlock.stability.semidiscretization import semi_discretization, transition_matrix
from benchmarks import child
from benchmarks.report import (
    Row,
    Series,
    Topic,
    comparison,
    fit_series,
    memory_row,
    timed,
)

REACH = 3.0
STEP = 0.05
RATIO = 1e6
MEMORY = 2**30
# The arms differ by this much, in s, where the growth with the delay is measured.
DIFFERENCE = 0.2
# Eigenvalues nearer to the unit circle than this do not tell on which side they are.
DOUBTFUL = 1e-9
SEED = 20


@dataclass(frozen=True)
class Sizes:
    """How much is measured."""

    gains: tuple[float, ...] = (1.0, 10.0)
    side: int = 1000
    points: int = 2000
    dense_points: int = 10
    passes: int = 3
    growth_side: tuple[int, ...] = (125, 250, 500, 1000, 2000)
    growth_gain: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
    growth_delay: tuple[float, ...] = (2.5, 5.0, 10.0, 20.0, 40.0, 80.0, 160.0)
    growth_chart: int = 1000
    rounds: int = 4
    seconds_each: float = 0.2
    fresh_compile: bool = True


QUICK = Sizes(
    gains=(1.0,),
    side=20,
    points=30,
    dense_points=1,
    passes=1,
    growth_side=(8, 16, 32),
    growth_gain=(0.5, 1.0, 2.0),
    growth_delay=(10.0, 20.0, 40.0),
    growth_chart=16,
    rounds=1,
    seconds_each=0.0,
    fresh_compile=False,
)


def axis(side: int) -> FloatArray:
    return np.linspace(-REACH, REACH, side)


def chart_of(gain: float, side: int) -> StabilityChart:
    """Chart a loop made for this call, so that nothing is kept from the call before."""
    return stability_chart(CommonArm(gain), axis(side), axis(side))


def random_square(points: int) -> FloatArray:
    """Return random points of the square, shape (points, 2)."""
    return np.random.default_rng(SEED).uniform(-REACH, REACH, (points, 2))


# Run in processes of their own ---------------------------------------------------------


def chart_alone(gain: float, side: int) -> dict[str, float]:
    """Time the first chart of this process, and its peak memory; then a second one."""
    first, _ = timed(chart_of, gain, side)
    second, _ = timed(chart_of, gain, side)
    return {"first": first, "second": second, "memory": child.peak_memory()}


def side_by_side(gain: float, side: int, points: int, passes: int) -> dict[str, Any]:
    """Time chart and dense eigenvalues in turn, so that both see the same machine."""
    chart_of(gain, side)
    system = CommonArm(gain)
    charts: list[float] = []
    dense: list[list[float]] = []
    sizes = []
    for x, y in random_square(points):
        matrix = transition_matrix(system, x, y, STEP)
        dense.append([])
        for _ in range(passes):
            charts.append(timed(chart_of, gain, side)[0])
            seconds, values = timed(np.linalg.eigvals, matrix)
            dense[-1].append(seconds)
        sizes.append(np.abs(values))
    return {
        "charts": charts,
        "dense": dense,
        "outside": [int((size > 1.0).sum()) for size in sizes],
        "doubtful": [bool((np.abs(size - 1.0) < DOUBTFUL).any()) for size in sizes],
        "order": values.size,
    }


# The table -----------------------------------------------------------------------------


def speed_rows(topic: Topic, gain: float, sizes: Sizes) -> None:
    """Compare a chart with dense eigenvalues, and their count of the unstable ones."""
    both = child.call(
        "benchmarks.charts",
        "side_by_side",
        child.ONE_THREAD,
        gain=gain,
        side=sizes.side,
        points=sizes.dense_points,
        passes=sizes.passes,
    )
    topic.data[f"g = {gain:g}"] = both
    chart, size = min(both["charts"]), sizes.side**2
    # Of the best time at each point.
    dense = float(np.mean([min(at_point) for at_point in both["dense"]])) * size
    g, order = f"g = {gain:g}:", both["order"]
    topic.rows += [
        Row(f"{g} chart {sizes.side} x {sizes.side}, best of {len(both['charts'])}", chart),
        Row(
            f"{g} dense {order} x {order} at {size:,} points [a]",
            dense,
            dense / chart,
            f"at least {RATIO:,.0f}",
            dense / chart >= RATIO,
        ),
    ]
    where = random_square(sizes.dense_points)
    mapped = unstable_roots(semi_discretization(CommonArm(gain), STEP), *where.T)
    clear = ~np.array(both["doubtful"])
    differ = int((mapped != np.array(both["outside"]))[clear].sum())
    topic.rows.append(
        comparison(
            f"{g} count of the map against its dense eigenvalues [b]", differ, int(clear.sum())
        )
    )


def count_rows(topic: Topic, gain: float, sizes: Sizes) -> None:
    """Compare a chart with counts at single points, by the argument principle."""
    side, system, values = sizes.side, CommonArm(gain), axis(sizes.side)
    chart = chart_of(gain, side)
    places = {
        "random points": np.random.default_rng(SEED).integers(0, side, (2, sizes.points)),
        "both ends of all rows": np.stack(
            (np.tile([0, side - 1], side), np.repeat(np.arange(side), 2))
        ),
    }
    for where, (columns, rows) in places.items():
        seconds, counts = timed(unstable_roots, system, values[columns], values[rows])
        differ = int((counts != chart.counts[rows, columns]).sum())
        what = f"g = {gain:g}: chart against single counts [c], {where}"
        topic.rows.append(comparison(what, differ, rows.size, seconds))


def process_rows(topic: Topic, sizes: Sizes) -> None:
    """Measure memory, and the first call with and without compiled code on disk."""
    side, name = sizes.side, "benchmarks.charts"
    for gain in sizes.gains:
        warm = child.call(name, "chart_alone", {}, gain=gain, side=side)
        what = f"g = {gain:g}: chart {side} x {side}"
        topic.rows.append(memory_row(what, warm["memory"], MEMORY))
    topic.rows.append(Row("first chart of a process, compiled code on disk", warm["first"]))
    if sizes.fresh_compile:
        with tempfile.TemporaryDirectory() as cache:
            environment = {"NUMBA_CACHE_DIR": cache}
            cold = child.call(name, "chart_alone", environment, gain=sizes.gains[0], side=side)
        compiling = cold["first"] - cold["second"]
        topic.rows.append(Row("compiling, once after installation", compiling))


# Growth --------------------------------------------------------------------------------


def best_times(cases: list[tuple[CommonArm, int]], sizes: Sizes) -> list[float]:
    """Return the best time of each case: a system and the side of its grid.

    They are timed in turn, round by round, so that a busy spell does not spoil one case.
    """
    times: list[list[float]] = [[] for _ in cases]
    for _ in range(sizes.rounds):
        for (system, side), of_case in zip(cases, times, strict=True):
            values, stop = axis(side), time.perf_counter() + sizes.seconds_each
            while True:
                of_case.append(timed(stability_chart, system, values, values)[0])
                if time.perf_counter() >= stop:
                    break
    return [min(of_case) for of_case in times]


def growth(sizes: Sizes) -> list[Series]:
    """Measure how the time of a chart grows with grid side, gain and delay."""
    side, half = sizes.growth_chart, 0.5 * DIFFERENCE
    named: list[tuple[str, str, tuple[float, ...], list[tuple[CommonArm, int]]]] = []
    for g in sizes.gains:
        sides = [(CommonArm(g), n) for n in sizes.growth_side]
        named.append((f"g = {g:g}", "grid side", sizes.growth_side, sides))
    gains = [(CommonArm(g), side) for g in sizes.growth_gain]
    named.append((f"{side} x {side}", "gain [rad/s]", sizes.growth_gain, gains))
    for g in sizes.gains:
        arms = [(CommonArm(g, t + half, t - half), side) for t in sizes.growth_delay]
        what = f"{side} x {side}, g = {g:g}"
        named.append((what, "mean delay [s]", sizes.growth_delay, arms))
    best = iter(best_times([case for *_, cases in named for case in cases], sizes))
    return [
        fit_series(what, variable, values, [next(best) for _ in values])
        for what, variable, values, _ in named
    ]


def plot_growth(series: list[Series], path: Path) -> None:
    """Draw each growth series with its measured points and the line of its last exponent."""
    with style.context(Path(armlock.__file__).with_name("armlock.mplstyle")):
        variables = list(dict.fromkeys(one.variable for one in series))
        figure = Figure(figsize=(3.6 * len(variables), 3.6))
        panels = figure.subplots(1, len(variables), sharey=True, squeeze=False)[0]
        for panel, variable in zip(panels, variables, strict=True):
            for k, one in enumerate(s for s in series if s.variable == variable):
                x, t = np.array(one.values[-3:]), np.array(one.seconds[-3:])
                fit = np.exp(
                    np.log(t).mean() + one.exponent_end * (np.log(x) - np.log(x).mean())
                )
                label = f"{one.what} (line: exponent {one.exponent_end:.2f})"
                panel.loglog(
                    one.values,
                    one.seconds,
                    color=f"C{k}",
                    marker="os^"[k % 3],
                    linestyle=":",
                )
                panel.loglog(x, fit, color=f"C{k}", linestyle="-", label=label)
                panel.set_xticks(one.values, [f"{value:g}" for value in one.values])
            panel.xaxis.minorticks_off()
            panel.set_xlabel(variable)
            panel.legend(loc="upper left", fontsize=7)
        panels[0].set_ylabel("best time of a chart [s]")
        # Room for the legends.
        panels[0].set_ylim(top=4.0 * max(max(one.seconds) for one in series))
        figure.savefig(path)


def run(*, quick: bool, folder: Path) -> Topic:
    """Measure everything about charts; the figure goes into `folder`."""
    sizes = QUICK if quick else Sizes()
    topic = Topic(f"Common arm, chart over [-{REACH:g}, {REACH:g}]^2")
    topic.data["sizes"] = asdict(sizes)
    process_rows(topic, sizes)
    for gain in sizes.gains:
        speed_rows(topic, gain, sizes)
        count_rows(topic, gain, sizes)
    topic.series = growth(sizes)
    plot_growth(topic.series, folder / "chart_growth.png")
    topic.figures.append("chart_growth.png")
    topic.notes += [
        f"[a] Extrapolated from {sizes.dense_points} random points: the best of {sizes.passes} "
        f"runs at each, on one thread; building the matrix does not count.",
        f"[b] The map is the semi-discretization of order 0 with a step of {STEP} s; the dense "
        f"reference is numpy.linalg.eigvals of its transition matrix.",
        "[c] Argument principle, point by point: another method than the chart's crossings.",
        "Charts use all cores. They are timed in turn with the dense eigenvalues on one "
        "thread, so that both see the same machine; compiling is timed apart.",
        f"Growth: exponents are slopes of log time over log variable, over all values and over "
        f"the three largest; small charts wait for fixed costs. Delays are the mean +- "
        f"{0.5 * DIFFERENCE:g} s; side and delay grow at both gains.",
    ]
    return topic
