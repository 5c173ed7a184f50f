"""Passages of a loop in orbit: when is it stable while its sensor divides by a held value.

At time t the loop is frozen: its arms are tau1(t) and tau2(t), its sensor divides by what it
holds. It is counted in phase, at c1 = c2 = 1. The verdict depends on true over held half
difference, and next to nothing else: its edges, from counts, become times at which the half
difference passes a level. These are roots of polynomials, and no hour has to be counted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Chebyshev, chebyshev

from armlock import paper
from armlock.checks import BoolArray, FloatArray, positive_number, real_number
from armlock.controllers import Controller
from armlock.design import buildable_loop, robust_loop
from armlock.loops import Loop, flight_loop, paper_loop
from armlock.orbits.constellation import Constellation
from armlock.sensors import dual
from armlock.stability.counts import unstable_roots
from armlock.stability.roots import rightmost_root

#: A loop of two round trips and of the half difference that its sensor holds, all in s.
LoopInOrbit = Callable[[float, float, float], Loop]

DAY = 86400.0
YEAR = 365.25 * DAY
#: A loop is kept for a month with one held value: a twelfth of a year.
MONTH = YEAR / 12.0

# Longest stretch of a course that one polynomial describes, in s, and its degree.
_STRETCH, _DEGREE = 10.0 * DAY, 16
# Ratios are tried in such steps away from one, up to the last, until a count is not zero.
_TRIED, _FARTHEST = 1.25, 1e5
# Gauss-Legendre points along a part of a passage.
_POINTS = 8


def flight(tau1: float, tau2: float, held: float) -> Loop:
    """Return the white paper's loop, `flight_loop`, on these arms."""
    loop = flight_loop(0.5 * (tau1 + tau2), held)
    return Loop(loop.controller, loop.mapping, tau1, tau2, loop.delay)


def on_dual(controller: Controller, delay: float = 0.0) -> LoopInOrbit:
    """Return loops of a controller on the paper's dual sensor; held is half its dtau."""

    def loop(tau1: float, tau2: float, held: float) -> Loop:
        sensor = dual(paper.DUAL_SENSOR_CORNER, 2.0 * held)
        return Loop(controller, sensor, tau1, tau2, delay)

    return loop


def loops() -> dict[str, LoopInOrbit]:
    """Return the book's four loops, by name: flight, paper, robust and buildable."""
    others = {"paper": paper_loop(), "robust": robust_loop(), "buildable": buildable_loop()}
    return {"flight": flight} | {
        name: on_dual(loop.controller, loop.delay) for name, loop in others.items()
    }


class Course:
    """A smooth function of time, as polynomials whose roots are all found.

    Parameters
    ----------
    function : callable
        Takes a float array of times in s.
    start, stop : float
        First and last time.
    """

    def __init__(
        self, function: Callable[[FloatArray], FloatArray], start: float, stop: float
    ) -> None:
        self.start, self.stop = start, stop
        self.borders = np.linspace(start, stop, int(np.ceil((stop - start) / _STRETCH)) + 1)
        #: Coefficients of Chebyshev polynomials, by stretch.
        self.series: FloatArray = np.array(
            [
                Chebyshev.interpolate(function, _DEGREE, domain=[low, high]).coef
                for low, high in pairwise(self.borders)
            ],
            dtype=np.float64,
        )

    def __call__(self, t: npt.ArrayLike) -> FloatArray:
        """Evaluate the polynomials."""
        t = np.asarray(t, dtype=float)
        k = np.clip(np.searchsorted(self.borders, t) - 1, 0, len(self.series) - 1)
        low, high = self.borders[k], self.borders[k + 1]
        x = (2.0 * t - low - high) / (high - low)
        return np.asarray(
            chebyshev.chebval(x, np.moveaxis(self.series[k], -1, 0), tensor=False)
        )

    def times(
        self, level: float = 0.0, start: float = -np.inf, stop: float = np.inf
    ) -> FloatArray:
        """Return all times at which the function has a value, from start to stop."""
        series = self.series.copy()
        series[:, 0] -= level
        near = (self.borders[1:] >= start) & (self.borders[:-1] <= stop)
        found = self.roots(series, near)
        return found[(found >= start) & (found <= stop)]

    def extremes(self) -> FloatArray:
        """Return the times of all extremes, the ends included."""
        slopes = np.asarray(chebyshev.chebder(self.series, axis=1), dtype=np.float64)
        return np.unique([self.start, *self.roots(slopes).tolist(), self.stop])

    def roots(self, series: FloatArray, near: BoolArray | bool = True) -> FloatArray:
        """Return the times at which polynomials on these stretches are zero, ascending."""
        found: list[float] = []
        # Elsewhere the constant term exceeds all others.
        possible = np.abs(series[:, 0]) <= np.abs(series[:, 1:]).sum(axis=1)
        for k in np.flatnonzero(possible & near):
            roots = chebyshev.chebroots(series[k])
            x = roots.real[(np.abs(roots.imag) < 1e-8) & (np.abs(roots.real) <= 1.0)]
            low, high = self.borders[k : k + 2]
            found += (low + 0.5 * (high - low) * (x + 1.0)).tolist()
        return np.array(sorted(found))


def half_difference(orbits: Constellation, master: int, start: float, stop: float) -> Course:
    """Return the course of (tau1 - tau2) / 2 in s."""

    def half(t: FloatArray) -> FloatArray:
        tau1, tau2 = orbits.round_trips(t, master)
        return 0.5 * (tau1 - tau2)

    return Course(half, start, stop)


def held_range(
    loop: LoopInOrbit, held: float, mean: float, precision: float = 1e-7
) -> tuple[float, float]:
    """Find between which true over held half differences a frozen loop is stable.

    Parameters
    ----------
    loop : callable
        The loop, see `LoopInOrbit`.
    held : float
        The held half difference in s.
    mean : float
        Mean of the round trips in s.
    precision : float, optional
        Relative width within which an edge is enclosed.

    Returns
    -------
    low, high : float
        The edges around one. On their inner side a certified count is zero, on their outer
        side it is not. In between ratios were counted in steps of a quarter: that the loop is
        stable at all of them is not certified. 0 or inf where no edge was found within a
        factor of 1e5, or before the half difference reaches the mean.

    Raises
    ------
    TypeError, ValueError
        If the held value is zero or no number, the mean is not positive, or the loop is not
        stable where the held value is the true one.

    Examples
    --------
    >>> from armlock.orbits.passages import flight, held_range
    >>> low, high = held_range(flight, 0.0325469, 16.65)
    >>> print(f"{low:.7f} {high:.5f}")
    0.0010107 2.32835
    """
    held, mean = real_number("held", held), positive_number("mean", mean)
    width = positive_number("precision", precision)

    def stable(ratio: float) -> bool:
        half = ratio * held
        return int(unstable_roots(loop(mean + half, mean - half, held), 1.0, 1.0)) == 0

    if not stable(1.0):
        raise ValueError(f"loop must be stable with a true value held, got held={held}")
    edges = []
    for step, end in ((1.0 / _TRIED, 0.0), (_TRIED, np.inf)):
        inner, outer = 1.0, step
        while 1.0 / _FARTHEST < outer < min(_FARTHEST, mean / abs(held)) and stable(outer):
            inner, outer = outer, outer * step
        if not 1.0 / _FARTHEST < outer < min(_FARTHEST, mean / abs(held)):
            edges.append(end)
            continue
        while abs(outer / inner - 1.0) > width:
            middle = float(np.sqrt(inner * outer))
            inner, outer = (middle, outer) if stable(middle) else (inner, middle)
        edges.append(inner)
    return edges[0], edges[1]


class Hold(NamedTuple):
    """What the sensor divides by for a while: start and stop in s, and the held value in s."""

    start: float
    stop: float
    held: float


def policies(half: Course) -> dict[str, list[Hold]]:
    """Return what is held when, by policy.

    Parameters
    ----------
    half : Course
        Of the half difference.

    Returns
    -------
    dict of str to list of Hold
        - "constant": the value of largest magnitude, all the time
        - "right sign": that magnitude, with the sign of the true value
        - "month's start", "month's middle": for each month the value at that time
    """
    extremes = half.extremes()
    values = half(extremes)
    largest = float(values[np.argmax(np.abs(values))])
    zeros = [half.start, *half.times().tolist(), half.stop]
    found = {"constant": [Hold(half.start, half.stop, largest)], "right sign": []}
    for start, stop in pairwise(zeros):
        size = np.copysign(largest, half(0.5 * (start + stop)))
        found["right sign"].append(Hold(start, stop, float(size)))
    months = int(np.ceil((half.stop - half.start) / MONTH * (1.0 - 1e-12)))
    for name, share in (("month's start", 0.0), ("month's middle", 0.5)):
        starts = half.start + MONTH * np.arange(months)
        stops = np.minimum(starts + MONTH, half.stop)
        held = half(starts + share * (stops - starts))
        found[name] = [Hold(*map(float, row)) for row in zip(starts, stops, held, strict=True)]
    return found


def lost(half: Course, holds: Sequence[Hold], edges: tuple[float, float]) -> list[Hold]:
    """Return the stretches on which the frozen loop is unstable.

    Parameters
    ----------
    half : Course
        Of the half difference.
    holds : sequence of Hold
        What the sensor holds.
    edges : tuple of two floats
        True over held, as `held_range` finds them.

    Returns
    -------
    list of Hold
        In the order of time; of one stretch across two holds two parts.
    """
    found = []
    for start, stop, held in holds:
        levels = [edge * held for edge in edges if np.isfinite(edge)]
        inner = np.concatenate([half.times(level, start, stop) for level in levels])
        for low, high in pairwise(np.unique([start, *inner.tolist(), stop]).tolist()):
            if not edges[0] < float(half(0.5 * (low + high))) / held < edges[1]:
                found.append(Hold(low, high, held))
    return found


def days(stretches: Sequence[Hold]) -> float:
    """Return how long stretches are together, in days."""
    return sum(stop - start for start, stop, _ in stretches) / DAY


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
    inner = half.times(0.0, start, stop).tolist()
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    total = 0.0
    for low, high in pairwise([start, *inner, stop]):
        times = [low + 0.5 * (high - low) * (float(x) + 1.0) for x in nodes]
        rates = [frozen_rate(loop, orbits, t, held, master) for t in times]
        total += 0.5 * (high - low) * float(np.dot(weights, rates))
    return total


def largest_half(halves: Mapping[int, Course]) -> tuple[float, float]:
    """Find how small the largest of the masters' half differences becomes, and when.

    Parameters
    ----------
    halves : mapping of int to Course
        By master.

    Returns
    -------
    size, time : float
        In s.
    """
    courses = list(halves.values())
    times = [course.extremes() for course in courses]
    # Two of them are alike in size where their sum or difference is zero.
    for k, one in enumerate(courses):
        for other in courses[k + 1 :]:
            for sign in (-1.0, 1.0):
                times.append(one.roots(one.series + sign * other.series))
    t = np.unique(np.concatenate(times))
    largest = np.max([np.abs(course(t)) for course in courses], axis=0)
    at = int(np.argmin(largest))
    return float(largest[at]), float(t[at])


def switches(halves: Mapping[int, Course], floor: float) -> list[tuple[float, int]]:
    """Return when to take which master so that its half difference never is below a floor.

    Parameters
    ----------
    halves : mapping of int to Course
        By master.
    floor : float
        In s, at most what `largest_half` finds.

    Returns
    -------
    list of (time, master)
        As few as possible: each master is kept as long as it is allowed, and the one that is
        then allowed for longest is next. The first entry is the start.

    Raises
    ------
    ValueError
        If at some time all half differences are below the floor.
    """
    floor = positive_number("floor", floor)
    ends: dict[int, list[tuple[float, float]]] = {}
    for master, half in halves.items():
        times = np.unique(np.concatenate((half.times(floor), half.times(-floor))))
        stretches = pairwise([half.start, *times.tolist(), half.stop])
        ends[master] = [
            pair for pair in stretches if abs(float(half(0.5 * sum(pair)))) >= floor
        ]
    now, stop = next((half.start, half.stop) for half in halves.values())
    found: list[tuple[float, int]] = []
    while now < stop:
        reach, master = max(
            (high, master)
            for master, pairs in ends.items()
            for low, high in [*pairs, (-np.inf, -np.inf)]
            if low <= now + 1e-3
        )
        if reach <= now:
            raise ValueError(
                f"floor must be at most the largest half difference at every time, got {floor} "
                f"s, above all at t = {now} s"
            )
        found.append((now, master))
        now = reach
    return found


__all__ = [
    "Course",
    "Hold",
    "LoopInOrbit",
    "days",
    "flight",
    "frozen_rate",
    "growth",
    "half_difference",
    "held_range",
    "largest_half",
    "loops",
    "lost",
    "on_dual",
    "policies",
    "switches",
]
