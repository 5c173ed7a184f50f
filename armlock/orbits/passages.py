"""Passages of a loop in orbit: when is it stable while its sensor divides by a held value.

At time t the loop is frozen: its arms are tau1(t) and tau2(t), its sensor divides by what it
holds. It is counted in phase, at c1 = c2 = 1. The verdict depends on true over held half
difference, and little on anything else. Its edges are certified at one held value and one mean
of the round trips, and taken for all others. They become times at which the half difference
passes a level. These are roots of polynomials, and no hour has to be counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PPoly, make_interp_spline

from armlock import paper
from armlock.checks import FloatArray, positive_number, real_number
from armlock.controllers import Controller
from armlock.loops import Loop, LoopAt, buildable_loop, flight_loop, paper_loop, robust_loop
from armlock.orbits.constellation import Constellation
from armlock.robustness.differences import no_root_crosses
from armlock.robustness.free_phases import count_at
from armlock.robustness.regions import is_stable
from armlock.sensors import dual

#: A loop of two round trips and of the half difference that its sensor holds, all in s.
LoopInOrbit = Callable[[float, float, float], Loop]

#: In s.
DAY = 86400.0
#: In s.
YEAR = 365.25 * DAY
#: A loop is kept for a month with one held value: a twelfth of a year.
MONTH = YEAR / 12.0

# Time between the nodes of a course's spline, in s, and its degree.
_SPACING, _DEGREE = DAY, 5
# An edge is looked for from a ratio of one on, each step larger by the first factor, as far as
# the second.
_TRIED, _FARTHEST = 1.25, 1e5
# Where all phases of the arms are safe above this frequency in rad/s, a count takes less time.
_SAFE_FROM = 4.0 * math.pi


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
    """A smooth function of time as a spline of degree five, whose roots are all found.

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
        number = int((stop - start) / _SPACING) + 2 * (_DEGREE + 1)
        nodes = np.linspace(start, stop, number)
        spline = make_interp_spline(nodes, function(nodes), k=_DEGREE)
        #: The same as polynomials, by stretch.
        self.curve = PPoly.from_spline(spline)

    def __call__(self, t: npt.ArrayLike) -> FloatArray:
        """Evaluate the spline."""
        return np.asarray(self.curve(t))

    def times(
        self, level: float = 0.0, start: float = -np.inf, stop: float = np.inf
    ) -> FloatArray:
        """Return all times at which the function has a value, from start to stop."""
        x = self.curve.x
        first = max(int(np.searchsorted(x, start, "right")) - 1, 0)
        last = max(int(np.searchsorted(x, stop)), first + 1)
        near = PPoly(self.curve.c[:, first:last], x[first : last + 1])
        found = np.unique(near.solve(level, extrapolate=False))
        return np.asarray(found[(found >= start) & (found <= stop)])

    def extremes(self) -> FloatArray:
        """Return the times of all extremes, the ends included."""
        slope = self.curve.derivative()
        return np.unique([self.start, *slope.roots(extrapolate=False), self.stop])

    def largest(self) -> tuple[float, float]:
        """Return the value of largest magnitude, and when it is reached."""
        times = self.extremes()
        values = self(times)
        at = int(np.argmax(np.abs(values)))
        return float(values[at]), float(times[at])

    def alike(self, other: Course) -> FloatArray:
        """Return when another course over the same times is of the same size."""
        both = (
            PPoly(self.curve.c + sign * other.curve.c, self.curve.x) for sign in (-1.0, 1.0)
        )
        return np.concatenate([curve.roots(extrapolate=False) for curve in both])

    def cut(
        self, levels: Iterable[float], start: float, stop: float
    ) -> list[tuple[float, float, float]]:
        """Cut the time from start to stop where the function has one of some values.

        Returns start, stop and the value halfway of each stretch.
        """
        inner = [t for level in levels for t in self.times(level, start, stop).tolist()]
        pairs = pairwise(np.unique([start, *inner, stop]).tolist())
        return [(low, high, float(self(0.5 * (low + high)))) for low, high in pairs]


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
        The loop is certified as stable at one, and at every ratio from low to high. At a ratio
        outside, farther from the edge than `precision`, it could not be: a root crosses the
        axis, or no proof was found that none does. 0 or inf where there is no edge within a
        factor of 1e5, or before the half difference reaches the mean.

    Raises
    ------
    TypeError, ValueError
        If the held value is zero or no number, the mean is not positive, the loop is not stable
        where the held value is the true one, or something in it but its two round trips changes
        with their difference.
    CountError
        If following D takes too many steps, or a number overflows.

    Notes
    -----
    One count at a ratio of one, and from there on `armlock.robustness.differences`. Counts at
    the far ends spare searches in vain; they certify nothing.

    Examples
    --------
    >>> from armlock.orbits.passages import flight, held_range
    >>> low, high = held_range(flight, 0.0325469, 16.65)
    >>> print(f"{low:.7f} {high:.5f}")
    0.0010107 2.32835
    """
    held, mean = real_number("held", held), positive_number("mean", mean)
    width = positive_number("precision", precision)

    def frozen(ratio: float) -> Loop:
        return loop(mean + ratio * held, mean - ratio * held, held)

    def stays(near: float, far: float) -> bool:
        # Where the far end is unstable, the search would be long, and in vain.
        there = true.replace(tau1=mean + far * held, tau2=mean - far * held)
        if count_at(LoopAt(there, 1.0, 1.0), _SAFE_FROM) > 0:
            return False
        return no_root_crosses(true, *sorted((near * held, far * held)))

    true = frozen(1.0)
    if not is_stable(true):
        raise ValueError(f"loop must be stable with a true value held, got held={held}")
    farthest = min(_FARTHEST, mean / abs(held))
    edges = []
    for step, end in ((1.0 / _TRIED, 0.0), (_TRIED, np.inf)):
        inner, outer = 1.0, step
        while 1.0 / _FARTHEST < outer < farthest and stays(inner, outer):
            inner, outer = outer, outer * step
        there = frozen(inner).replace(tau1=true.tau1, tau2=true.tau2)
        for p, q in zip(there.polynomials(), true.polynomials(), strict=True):
            if not np.allclose(p.coefficients, q.coefficients, rtol=1e-12, atol=0.0):
                raise ValueError(
                    "loop must depend on the difference of tau1 and tau2 by its round trips "
                    f"alone, got another sensor or controller at true/held={inner}"
                )
        if not 1.0 / _FARTHEST < outer < farthest:
            edges.append(end)
            continue
        while abs(outer / inner - 1.0) > width:
            middle = float(np.sqrt(inner * outer))
            inner, outer = (middle, outer) if stays(inner, middle) else (inner, middle)
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
    largest, _ = half.largest()
    found = {
        "constant": [Hold(half.start, half.stop, largest)],
        "right sign": [
            Hold(low, high, math.copysign(largest, value))
            for low, high, value in half.cut([0.0], half.start, half.stop)
        ],
    }
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
    return [
        Hold(low, high, held)
        for start, stop, held in holds
        for low, high, true in half.cut(
            [edge * held for edge in edges if np.isfinite(edge)], start, stop
        )
        if not edges[0] < true / held < edges[1]
    ]


def days(stretches: Sequence[Hold]) -> float:
    """Return how long stretches are together, in days."""
    return sum(stop - start for start, stop, _ in stretches) / DAY


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
    times += [one.alike(other) for one, other in combinations(courses, 2)]
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
        stretches = half.cut([floor, -floor], half.start, half.stop)
        ends[master] = [(low, high) for low, high, value in stretches if abs(value) >= floor]
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
