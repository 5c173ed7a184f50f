"""Dual arm and controlled loop: charts, the critical perturbation, memory.

The requirements: a 1000 x 1000 chart of the dual arm at g = 10 over [0.9, 1.1]^2 takes at
most twice the common arm's time per crossing found; a 400 x 400 chart of the controlled loop
over +-5e-6 takes at most 10 s; `critical_perturbation` takes at most 1 s; none needs
1 GiB.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from armlock import (
    CharacteristicFunction,
    CommonArm,
    DualArm,
    StabilityChart,
    critical_perturbation,
    paper_loop,
    stability_chart,
    unstable_roots,
)
from armlock.checks import FloatArray
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import sign_changes
from benchmarks import child
from benchmarks.charts import MEMORY
from benchmarks.report import Row, Topic, at_most, comparison, memory_row, timed

GAIN = 10.0
SECONDS_CHART = 10.0
SECONDS_CRITICAL = 1.0
RATIO = 2.0
DIRECTIONS = ((1.0, -1.0), (0.0, -1.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0))
SEED = 21


@dataclass(frozen=True)
class Sizes:
    """How much is measured."""

    side: int = 1000
    controlled: int = 400
    points: int = 2000
    runs: int = 7


QUICK = Sizes(side=20, controlled=20, points=30, runs=1)


def window(half_width: float, side: int) -> FloatArray:
    return 1.0 + np.linspace(-half_width, half_width, side)


def chart_of(name: str, side: int) -> StabilityChart:
    """Chart a loop made for this call: "common", "dual" or "controlled"."""
    if name == "controlled":
        return stability_chart(paper_loop(), window(5e-6, side), window(5e-6, side))
    loop = CommonArm(GAIN) if name == "common" else DualArm(GAIN)
    return stability_chart(loop, window(0.1, side), window(0.1, side))


def crossings_found(system: CharacteristicFunction, y: FloatArray, right: float) -> int:
    """How many frequencies a chart with rows y finds at which a root may cross in a row."""
    a, b1, b2 = system.on_boundary()
    rest = system.rest_on_boundary()
    at_reference = rest.plus(b1.scaled(system.reference[0])).sums
    fixed = a._replace(sums=at_reference).times_conjugate(b1)
    varying = b2.times_conjugate(b1)
    total = 0
    for level in y:
        # Delays left out, only the deviation from the reference remains.
        sums = fixed.plus(varying.scaled(system.reference[1] - level)).sums
        row = fixed.plus(varying.scaled(-level))
        end = float(last_frequency(system, right, level))
        total += sign_changes(row._replace(sums=sums), [(0.0, end)])[0].size
    return total


def alone(name: str, side: int) -> dict[str, float]:
    """Chart once to compile, then again; return the time and the peak memory."""
    chart_of(name, side)
    seconds, _ = timed(chart_of, name, side)
    return {"seconds": seconds, "memory": child.peak_memory()}


def chart_rows(topic: Topic, sizes: Sizes) -> None:
    """Compare the dual arm's chart with the common arm's, and check its counts."""
    side = sizes.side
    y = window(0.1, side)
    times: dict[str, list[float]] = {"common": [], "dual": []}
    for name in times:
        chart_of(name, side)
    # In turn, so that a busy spell does not spoil one of them.
    for _ in range(sizes.runs):
        for name, of_name in times.items():
            of_name.append(timed(chart_of, name, side)[0])
    found = {
        "common": crossings_found(CommonArm(GAIN), y, y[-1]),
        "dual": crossings_found(DualArm(GAIN), y, y[-1]),
    }
    best = {name: min(of_name) for name, of_name in times.items()}
    each = {name: best[name] / found[name] for name in best}
    what = f"arm, g = {GAIN:g}: chart {side} x {side} over [0.9, 1.1]^2"
    topic.rows += [Row(f"{name} {what}", seconds) for name, seconds in best.items()]
    quotient = each["dual"] / each["common"]
    topic.rows.append(
        Row(
            "the same, time per crossing found [a]: dual over common arm",
            requirement=f"{quotient:.2f} <= {RATIO:g}",
            met=quotient <= RATIO,
        )
    )
    for name, system, count in (
        ("dual", DualArm(GAIN), side),
        ("controlled", paper_loop(), sizes.controlled),
    ):
        chart = chart_of(name, count)
        rows, columns = np.random.default_rng(SEED).integers(0, count, (2, sizes.points))
        single = unstable_roots(system, chart.x[columns], chart.y[rows])
        differ = int((single != chart.counts[rows, columns]).sum())
        topic.rows.append(
            comparison(f"{name}: chart against single counts [b]", differ, sizes.points)
        )
    topic.data["charts"] = {"times": times, "crossings": found}


def critical_rows(topic: Topic, sizes: Sizes) -> None:
    """Time `critical_perturbation`."""
    times = {
        direction: min(
            timed(critical_perturbation, paper_loop(), direction)[0] for _ in range(sizes.runs)
        )
        for direction in DIRECTIONS
    }
    where = max(times, key=lambda direction: times[direction])
    what = f"critical_perturbation, slowest of {len(DIRECTIONS)} directions {where}"
    topic.rows.append(at_most(what, times[where], SECONDS_CRITICAL))


def run(*, quick: bool, folder: Path) -> Topic:
    """Measure charts and limits of the dual arm and of the controlled loop."""
    sizes = QUICK if quick else Sizes()
    topic = Topic("Dual arm and controlled loop")
    topic.data["sizes"] = asdict(sizes)
    chart_rows(topic, sizes)
    for name, side in (("dual", sizes.side), ("controlled", sizes.controlled)):
        measured = child.call("benchmarks.loops", "alone", {}, name=name, side=side)
        what = f"{name}: chart {side} x {side}"
        if name == "controlled":
            topic.rows.append(
                at_most(f"{what} over 1 +- 5e-6", measured["seconds"], SECONDS_CHART)
            )
        topic.rows.append(memory_row(what, measured["memory"], MEMORY))
    critical_rows(topic, sizes)
    topic.notes += [
        f"[a] Best of {sizes.runs} runs in turn; crossings are the frequencies at which a root "
        "may cross somewhere in a row of the chart.",
        f"[b] Argument principle at {sizes.points} random points of the grid.",
    ]
    return topic
