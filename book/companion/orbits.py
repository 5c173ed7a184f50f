"""What the chapters on orbits need: the three orbits, and what takes long on them."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armlock import DivergenceError, critical_perturbation, rightmost_root, simulate
from armlock.checks import FloatArray
from armlock.orbits import Constellation, kepler, read_table
from armlock.orbits.passages import (
    DAY,
    YEAR,
    Course,
    Hold,
    LoopInOrbit,
    days,
    half_difference,
    held_range,
    loops,
    lost,
    policies,
)
from book.companion.shared import shared

#: Where the ranges of the loops are taken: held half difference and mean delay, in s.
HELD, MEAN = 0.0325469, 16.65
DATA = Path(__file__).parents[1] / "data"
MASTERS = (1, 2, 3)
# Gauss-Legendre points along a part of a passage.
_NODES = 8
#: The ways to hold a value, as `policies` names them.
POLICIES = ("constant", "right sign", "month's start", "month's middle")


@cache
def constellations() -> dict[str, Constellation]:
    """Return Kepler's orbits and ESA's two, by name."""
    tables = {name: read_table(DATA / f"esa_{name}.csv.gz") for name in ("trailing", "leading")}
    return {"Kepler": kepler(), **tables}


def interval(orbit: str) -> tuple[float, float]:
    """Return start and stop in s: one year of Kepler's orbits, ten of ESA's."""
    first = max(constellations()[orbit].span[0], 0.0)
    return first, first + (1 if orbit == "Kepler" else 10) * YEAR


@cache
def half(orbit: str, master: int = 1) -> Course:
    """Return the course of a half difference."""
    return half_difference(constellations()[orbit], master, *interval(orbit))


def telling_times(orbit: str) -> FloatArray:
    """Return times in s to draw the sizes of the half differences at.

    Besides 600 even ones they are all zeros and extremes, and where two masters are alike in
    size: there the largest of the three may be smallest.
    """
    courses = [half(orbit, master) for master in MASTERS]
    found = [np.linspace(*interval(orbit), 600)]
    for course in courses:
        found += [course.times(), course.extremes()]
    found += [one.alike(other) for one, other in combinations(courses, 2)]
    return np.unique(np.concatenate(found))


def largest(orbit: str, master: int = 1) -> float:
    """Return the largest half difference in s, in magnitude."""
    return abs(half(orbit, master).largest()[0])


def taiji_half() -> float:
    """Return the largest half difference in s with Taiji's arms on Kepler's orbits."""
    return abs(half_difference(kepler(3e9), 1, 0.0, YEAR).largest()[0])


def zeros_by_year(orbit: str) -> dict[int, list[int]]:
    """Return how often the half difference passes zero in each year, by master."""
    start, stop = interval(orbit)
    borders = np.arange(start, stop + 1.0, YEAR)
    return {m: np.histogram(half(orbit, m).times(), borders)[0].tolist() for m in MASTERS}


@shared
def ranges() -> dict[str, tuple[float, float]]:
    """Return between which true over held half differences each loop is stable."""
    return {name: held_range(loop, HELD, MEAN) for name, loop in loops().items()}


@shared
def range_at(loop: str, held: float) -> tuple[float, float]:
    """Return the range of one loop at another held value in s, to a ten thousandth."""
    return held_range(loops()[loop], held, MEAN, 1e-4)


@shared
def stable_days() -> dict[tuple[str, int, str, str], float]:
    """Return stable days a year by orbit, master, loop and policy."""
    found = {}
    for orbit in constellations():
        start, stop = interval(orbit)
        for master in MASTERS:
            course = half(orbit, master)
            for policy, holds in policies(course).items():
                for loop, edges in ranges().items():
                    gone = days(lost(course, holds, edges)) * YEAR / (stop - start)
                    found[orbit, master, loop, policy] = 365.25 - gone
    return found


def days_above(orbit: str, level: float, master: int = 1) -> float:
    """Return on how many days a year the half difference is above a level, in magnitude."""
    course = half(orbit, master)
    stretches = course.cut([level, -level], course.start, course.stop)
    above = sum(stop - start for start, stop, value in stretches if abs(value) > level)
    return 365.25 * above / (course.stop - course.start)


def frozen_rate(
    loop: LoopInOrbit, orbits: Constellation, t: float, held: float, master: int = 1
) -> float:
    """Return Re s of the rightmost root of the loop frozen at t, in 1/s."""
    tau1, tau2 = orbits.round_trips(t, master)
    return float(rightmost_root(loop(float(tau1), float(tau2), held), 1.0, 1.0).real)


def growth(
    loop: LoopInOrbit,
    orbits: Constellation,
    half: Course,
    stretch: Hold,
    master: int = 1,
) -> float:
    """Sum up the frozen loop's rate over a stretch: the number of e-folds.

    Where the half difference is zero the rate changes its form, and the sum is split there.
    """
    start, stop, held = stretch
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    total = 0.0
    for low, high, _ in half.cut([0.0], start, stop):
        times = [low + 0.5 * (high - low) * (float(x) + 1.0) for x in nodes]
        rates = [frozen_rate(loop, orbits, t, held, master) for t in times]
        total += 0.5 * (high - low) * float(np.dot(weights, rates))
    return total


class Stretch(NamedTuple):
    """A stretch drawn at random, and what frozen root and simulation say of it.

    Attributes
    ----------
    orbit, master, loop : str, int, str
        Whose.
    start, duration : float
        In s.
    ratio : float
        True over held half difference at the start.
    rate : float
        Mean over the stretch of Re s of the frozen loop's rightmost root, in 1/s.
    simulated : float
        Rate of growth in the simulation, in 1/s.
    """

    orbit: str
    master: int
    loop: str
    start: float
    duration: float
    ratio: float
    rate: float
    simulated: float


def growth_rate(
    orbit: str, master: int, loop: str, start: float, duration: float, held: float
) -> float:
    """Simulate a stretch with moving delays; return the rate of growth in 1/s.

    Noise drives the loop for the first twentieth. The rate is that between the middle third and
    the last one. The delays are polynomials, so that they follow smoothly.
    """
    constellation = constellations()[orbit]
    rate = 10.0 if duration < 2e5 else 1.0

    def delay(arm: int) -> Course:
        def tau(t: FloatArray) -> FloatArray:
            return constellation.round_trips(start + t, master)[arm]

        return Course(tau, -1.0, duration + 1.0)

    arms = [delay(0), delay(1)]
    noise = np.zeros(int(duration * rate))
    noise[: noise.size // 20] = np.random.default_rng(1).standard_normal(noise.size // 20)
    frozen = loops()[loop](float(arms[0](0.0)), float(arms[1](0.0)), held)
    try:
        out = simulate(frozen, noise, sample_rate=rate, tau1=arms[0], tau2=arms[1])
    except DivergenceError as error:
        out = error.output
        duration = out.size / rate
    third = out.size // 3
    late, middle = (np.linalg.norm(part) for part in (out[-third:], out[third : 2 * third]))
    return float(np.log(late / middle) / (duration / 3.0))


@shared
def random_stretches(count: int = 24, seed: int = 29) -> list[Stretch]:
    """Draw stretches on which the frozen rate times the duration exceeds five.

    Orbit, master, time, loop and the ratio of true to held half difference are drawn. A stretch
    lasts eight e-folds of the frozen root at its start, at most two days. It is taken if the
    frozen rates at start, middle and end have one sign, sum up to five e-folds or more, and
    differ by less than a factor of two. Stable loops take weeks to forget: every sixth stretch
    is one of them, of up to twenty days.
    """
    rng, found = np.random.default_rng(seed), list[Stretch]()
    names = list(constellations())
    while len(found) < count:
        orbit, master = names[rng.integers(3)], int(rng.integers(1, 4))
        loop = ("flight", "paper", "robust")[rng.integers(3)]
        low, high = interval(orbit)
        start = float(rng.uniform(low, high - 21 * DAY))
        stable = len(found) % 6 == 5
        ratio = float(rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-1.5, 0.5))
        ratio = float(rng.uniform(0.4, 1.6)) if stable else ratio
        held = float(half(orbit, master)(start)) / ratio
        point = loops()[loop], constellations()[orbit]
        first = frozen_rate(*point, start, held, master)
        duration = min(8.0 / abs(first), (20 if stable else 2) * DAY)
        if duration * abs(first) < 5.0:
            continue
        times = (start + 0.5 * duration, start + duration)
        rates = np.array([first, *(frozen_rate(*point, t, held, master) for t in times)])
        mean = float(rates @ [1.0, 4.0, 1.0]) / 6.0
        alike = (
            np.ptp(np.sign(rates)) == 0.0 and np.abs(rates).max() < 2.0 * np.abs(rates).min()
        )
        if alike and abs(mean) * duration > 5.0:
            grown = growth_rate(orbit, master, loop, start, duration, held)
            found.append(Stretch(orbit, master, loop, start, duration, ratio, mean, grown))
    return found


class Passage(NamedTuple):
    """A time without a stable loop: start and stop in s, and the growth over it in e-folds."""

    start: float
    stop: float
    growth: float


@shared
def kepler_passages(loop: str, policy: str) -> list[Passage]:
    """Return the passages of a year of Kepler's orbits, and how far the frozen loop grows."""
    course, constellation = half("Kepler"), constellations()["Kepler"]
    found: list[Passage] = []
    for part in lost(course, policies(course)[policy], ranges()[loop]):
        grown = growth(loops()[loop], constellation, course, part)
        if found and part.start - found[-1].stop < 1.0:
            grown += found[-1].growth
            found[-1] = Passage(found[-1].start, part.stop, grown)
        else:
            found.append(Passage(part.start, part.stop, grown))
    return found


@shared
def tolerated(size: float) -> float:
    """Return which perturbation along (1, -1) breaks the paper's loop, at a half difference."""
    loop = loops()["paper"](MEAN + size, MEAN - size, size)
    return critical_perturbation(loop, (1.0, -1.0))
