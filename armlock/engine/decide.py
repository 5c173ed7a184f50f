"""What is decided on the imaginary axis: counts, and whether a family of functions has a zero.

`count` follows the argument of one function. `Family` states functions of which none may have
a zero, up to a level; `least` finds the largest level at which none has. Both stop where double
precision does not decide: then they say at which frequency.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numba
import numpy as np

from armlock.checks import FloatArray, IntArray
from armlock.engine import inclusion
from armlock.engine.functions import Function, Leading, Space, at, stacked
from armlock.engine.inclusion import DISTANCE, REAL, Question
from armlock.engine.polynomials import rounded

#: What a count is where a root lies on the axis, or rounding does not decide on which side.
BOUNDARY = -1
#: What a count is where infinitely many roots do not stay left of the axis.
UNCONFINED = -2

# Most steps of a count, and of a search; some three seconds each.
_MOST_STEPS = 1_500_000
_MOST_SEARCHED = 2_000_000
# Steps between two looks at the keyboard.
_A_WHILE = np.int64(100_000)
# Steps of a look at likely intervals before a search.
_A_LOOK = np.int64(2_000)
# Points that one thread counts at a time.
_BLOCK = 256
# Undecided intervals after which a search ends.
_FEW = np.int64(16)
# Narrower intervals, as shares of their frequency, are undecided.
_NARROWEST = 1e-14


class UndecidedError(RuntimeError):
    """Double precision, or the steps allowed, did not decide.

    `omega` is where, in rad/s, and `index` of which of many functions.
    """

    def __init__(self, message: str, omega: float, index: int = 0) -> None:
        super().__init__(message)
        self.omega, self.index = omega, index


def in_threads(function: Callable[[slice], Any], size: int, block: int) -> list[Any]:
    """Return what a compiled function makes of the blocks of a range; Ctrl-C ends it."""
    blocks = [slice(first, min(first + block, size)) for first in range(0, size, block)]
    # A single block goes to a thread too: compiled functions do not react to Ctrl-C.
    pool = ThreadPoolExecutor(numba.config.NUMBA_NUM_THREADS)
    try:
        return list(pool.map(function, blocks))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def counts(
    space: Space,
    steady: FloatArray,
    delayed: FloatArray,
    uncertain: FloatArray,
    *,
    leading: Leading | None = None,
    most: int = _MOST_STEPS,
) -> IntArray:
    """Count the zeros with positive real part of n functions (Lemma 13).

    Parameters
    ----------
    space : Space
        Of all functions.
    steady, delayed, uncertain : float arrays, shapes (n, J), (n, J, K) and (n, J)
        Weights S and W, and the error of S.
    leading : Leading, optional
        Of one function, with zeros at s = 0 that are not to count.
    most : int, optional
        Most steps of a count.

    Returns
    -------
    int array, shape (n,)
        BOUNDARY and UNCONFINED included.

    Raises
    ------
    UndecidedError
        If a count takes too many steps.
    """
    n = len(steady)
    # What weights are uncertain by counts as a term of any phase.
    ends = space.confined_from(steady, delayed, uncertain) * (1.0 if space.step else 2.0)
    order, begin = (leading.order, leading.radius) if leading else (0, 0.0)
    found = np.full(n, UNCONFINED, dtype=np.int64)
    here = np.flatnonzero(np.isfinite(ends))
    ends = np.maximum(ends, 2.0 * begin)
    if not here.size:
        return found

    def some(block: slice) -> tuple[Any, ...]:
        k = here[block]
        result: tuple[Any, ...] = inclusion.wind_many(
            space.arrays, steady[k], delayed[k], uncertain[k],
            np.full(k.size, begin), ends[k], most,
        )  # fmt: skip
        return result

    turn, first, last, undecided, steps = map(
        np.concatenate, zip(*in_threads(some, here.size, _BLOCK), strict=True)
    )
    if (steps >= most).any():
        k = int(np.argmax(steps >= most))
        raise UndecidedError(
            f"a count takes more than {most:.0e} steps, up to {undecided[k]:.3g} rad/s",
            float(undecided[k]),
            int(here[k]),
        )
    # At s = 0 all is real; the value found there is off by less than a quarter turn.
    direction = leading.direction if leading else np.sign(first.real)
    still = np.sign(space.limits(steady[here], delayed[here])[0]) * 1j ** (space.degree % 4)
    if space.step:
        # There the function of a map is real.
        still = np.sign(last.real)
    with np.errstate(all="ignore"):
        turn = turn + np.angle(first / direction) - np.angle(last / still)
    # A map counts zeros in the strip |Im s| < pi / step, at whose right end it is constant.
    number = 0.5 * ((0 if space.step else space.degree) - order) - turn / np.pi
    with np.errstate(invalid="ignore"):
        sure = np.isnan(undecided) & (np.abs(number - np.round(number)) < 1e-2)
        found[here] = np.where(sure & (number > -0.5), np.round(number), BOUNDARY)
    return found


def count(function: Function, common: int = 0, *, most: int = _MOST_STEPS) -> int:
    """Count the zeros of a function with positive real part.

    Parameters
    ----------
    function : Function
        With exact weights.
    common : int, optional
        Order of a zero at s = 0 that is not to count.
    most : int, optional
        Most steps.

    Returns
    -------
    int
        BOUNDARY with another zero on the axis, or where rounding does not decide; UNCONFINED.
    """
    leading = function.leading()
    steady, delayed = stacked([function])
    if leading is None or leading.order > common:
        confined = np.isfinite(function.space.confined_from(steady, delayed)[0])
        return BOUNDARY if confined else UNCONFINED
    exact = np.zeros_like(steady)
    begin = leading if leading.order else None
    return int(counts(function.space, steady, delayed, exact, leading=begin, most=most)[0])


@dataclass(frozen=True, eq=False)
class Family:
    """Functions of which none has a zero if one test holds at each frequency.

    Attributes
    ----------
    functions : sequence of Function
        Of one space.
    tests : sequence of tests
        Each a sequence of members (kind, weights, slopes): a vertex (1) or a term of any phase
        (2), the combination of the functions with weights + level slopes. A test holds where
        zero is in no convex combination of the vertices, whatever the terms add.
    arc : tuple of tuples, optional
        One more test: f_0 + exp(j psi) f_1, or f_0 + (cos psi - 1) f_1 + j sin psi f_2 of three
        functions, with psi from a + b omega to c + d omega; (a, b, c, d), and their slopes in
        the level.
    loose : int, optional
        So many functions, the last ones, are terms of any phase in that test.
    """

    functions: Sequence[Function]
    tests: Sequence[Sequence[tuple[int, Sequence[float], Sequence[float]]]]
    arc: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    loose: int = 0

    @property
    def space(self) -> Space:
        """The space of the functions."""
        return self.functions[0].space

    def question(self) -> Question:
        """Return the family as compiled functions take it."""
        shape = len(self.tests), max(map(len, self.tests))
        kind = np.zeros(shape, np.int64)
        weights = np.zeros((*shape, len(self.functions)), np.complex128)
        slopes = np.zeros_like(weights)
        for i, test in enumerate(self.tests):
            for n, member in enumerate(test):
                kind[i, n], weights[i, n], slopes[i, n] = member
        arc = np.zeros((0, 4)) if self.arc is None else np.array(self.arc, np.float64)
        return Question(kind, weights, slopes, arc, self.loose)

    def _members(
        self, test: Sequence[tuple[int, Sequence[float], Sequence[float]]], level: float
    ) -> tuple[list[Function], list[Function]]:
        """Return vertices and terms of a test."""
        found: tuple[list[Function], list[Function]] = [], []
        for kind, weights, slopes in test:
            member = self.functions[0] * 0
            for f, a, b in zip(self.functions, weights, slopes, strict=True):
                member = member + f * (Fraction(a) + Fraction(b) * Fraction(level))
            found[kind - 1].append(member)
        return found

    def begins(self, level: float) -> float:
        """Frequency up to which a test holds by leading terms at s = 0 (Lemma 15), or zero."""
        # Terms that are nearly as large as a vertex ask for a smaller share of all others.
        return self._begins(level, 1e-8) or self._begins(level, 1e-14)

    def _begins(self, level: float, share: float) -> float:
        """Do what `begins` does, where all other terms are at most a share of the leading."""
        best = 0.0
        for test in self.tests:
            vertices, terms = self._members(test, level)
            leads = [f.leading(share) for f in vertices]
            others = [f.leading(share) for f in terms if not f.is_zero]
            known, terms_at_zero = ([lead for lead in some if lead] for some in (leads, others))
            middle = sum(lead.direction for lead in known) / len(leads)
            decided = len(known) == len(leads) and len(terms_at_zero) == len(others)
            if not decided or abs(middle) < 0.5:
                continue
            turned = [(lead.direction * np.conj(middle)).real / abs(middle) for lead in known]
            room, radius = min(turned) - 4.0 * share, min(lead.radius for lead in known)
            if room <= 0.0:
                continue
            for a in known:
                for b in terms_at_zero:
                    ratio = (
                        abs(rounded([b.coefficient / a.coefficient])[0]) * len(others) / room
                    )
                    radius, power = min(radius, b.radius), b.order - a.order
                    if power < 0 or (power == 0 and ratio >= 1.0 - 4.0 * share):
                        radius = 0.0
                    elif power > 0 and ratio:
                        radius = min(radius, (1.0 - 4.0 * share) * ratio ** (-1.0 / power))
            best = max(best, radius)
        return best

    def ends(self, level: float) -> float:
        """Frequency past which a test holds, because one term exceeds all others (Lemma 15)."""
        found = [np.inf]
        for test in self.tests:
            vertices, terms = self._members(test, level)
            steady, delayed = stacked(vertices)
            whole, _ = self.space.limits(steady, delayed)
            if (whole > 0.0).any() and (whole < 0.0).any():
                continue
            size = sum(
                (abs(s - w.sum(1)) + abs(w).sum(1) for s, w in (f.weights for f in terms)),
                np.zeros(steady.shape[1]),
            )
            tops = (self.space.limits(*f.weights) for f in terms)
            top = float(sum(abs(still) + abs(turned).sum() for still, turned in tops))
            ends = self.space.confined_from(steady, delayed, size, top_terms=top)
            found.append(float(ends.max()))
        two = len(self.functions) - self.loose == 2
        if two and self.arc is not None and self.arc[0][3] == self.arc[1][3] == 0.0:
            found.append(self._arc_ends(self.arc[0][2] + level * self.arc[1][2]))
        return min(found)

    def _arc_ends(self, angle: float) -> float:
        """Do what `ends` does for an arc around zero: abs(1 + c exp(j psi)) is monotonic."""
        if angle >= np.pi:
            return np.inf
        (n, m, *free), (wn, wm, *turned) = stacked(self.functions)
        turns = np.exp(1j * np.array([0.0, angle]))[:, None]
        steady = (n - wn.sum(1)) + turns * (m - wm.sum(1))
        parts = np.abs(wn) + np.abs(wm)
        terms = parts.sum(1)
        for s, w in zip(free, turned, strict=True):
            terms = terms + np.abs(s - w.sum(1)) + np.abs(w).sum(1)
        # All that turns, as terms; and what the sum at other angles may have more.
        more = np.abs(n - wn.sum(1)) + np.abs(m - wm.sum(1))
        return float(
            self.space.confined_from(
                steady, np.zeros((2, *parts.shape)), terms, extra=more
            ).max()
        )


def _walk(arguments: tuple[Any, ...], _: slice) -> tuple[Any, ...]:
    """Walk in a thread, so that Ctrl-C reaches the other one."""
    found: tuple[Any, ...] = inclusion.walk(*arguments)
    return found


class _Search:
    """A family, and how it is walked."""

    def __init__(self, family: Family, goal: int) -> None:
        space = family.space
        self.family, self.goal, self.steps = family, goal, 0
        self.fixed = (space.arrays, *stacked(family.functions))
        self.question = family.question()

    def look(
        self, likely: FloatArray, best: float, where: float, start: float, tolerance: float
    ) -> tuple[float, float]:
        """Look for good values in intervals for a few steps; return the best, and where."""
        _, _, best, where, _ = inclusion.walk(
            *self.fixed, self.question, np.ascontiguousarray(likely), self.goal,
            best, where, start, tolerance, _NARROWEST, _A_LOOK, _FEW,
        )  # fmt: skip
        return best, where

    def run(
        self, pending: FloatArray, best: float, where: float, start: float, tolerance: float
    ) -> tuple[float, float, FloatArray]:
        """Walk over intervals, the last first; return the best, where, and what is left."""
        undecided = np.zeros((0, 2))
        while len(pending) and len(undecided) < _FEW:
            arguments = (
                *self.fixed, self.question, np.ascontiguousarray(pending), self.goal,
                best, where, start, tolerance, _NARROWEST, _A_WHILE, _FEW,
            )  # fmt: skip
            [found] = in_threads(partial(_walk, arguments), 1, 1)
            pending, more, best, where, steps = found
            undecided = np.concatenate((undecided, more))
            self.steps += steps
            if self.steps > _MOST_SEARCHED:
                omega = float(pending[-1, 0])
                raise UndecidedError(
                    f"a search takes more than {_MOST_SEARCHED:.0e} steps, at {omega:.3g}"
                    " rad/s",
                    omega,
                )
        return best, where, undecided


def least(
    family: Family,
    goal: int,
    best: float = np.inf,
    where: float = np.nan,
    *,
    start: float = 0.0,
    tolerance: float = 1e-6,
    low: float = 0.0,
    high: float = np.inf,
) -> tuple[float, float]:
    """Find the largest level up to which no function of a family has a zero.

    Parameters
    ----------
    family : Family
        Whose members at a smaller level are among those at a larger one.
    goal : int
        What is looked for, of `armlock.engine.inclusion`.
    best, where : float, optional
        A level that is known to have a zero, and at which frequency; inf, nan.
    start : float, optional
        A level without a zero.
    tolerance : float, optional
        No zero has a level below start + (best - start) (1 - tolerance).
    low, high : float, optional
        The frequencies in rad/s between which zeros count; all by default.

    Returns
    -------
    tuple of two floats
        The level in rad, s or without a unit, and the frequency in rad/s.

    Raises
    ------
    UndecidedError
        If double precision, or the steps allowed, do not decide it.
    """
    search = _Search(family, goal)
    corners, level = family.space.corners, min(best, 1e300)
    floor = low or family.begins(level) or 1e-4 * corners[0]
    end = min(family.ends(level), high)
    ceiling = end if np.isfinite(end) else 1e4 * corners[-1]
    likely = _likely(family, goal, floor, max(ceiling, 2.0 * floor), start)
    best, where = search.look(likely, best, where, start, tolerance)
    if best <= start:
        return best, where
    level = start + (best - start) * (1.0 - tolerance)
    known = np.isfinite(level)
    begin = low or (family.begins(level) if known else floor)
    end = min(family.ends(level), high) if known else end
    if not begin > 0.0:
        raise UndecidedError("the behaviour at s = 0 is not decided", 0.0)
    if not np.isfinite(end):
        raise UndecidedError("the behaviour at high frequency is not decided", np.inf)
    if end <= begin:
        return best, where
    edges = np.geomspace(begin, end, int(200 * np.log10(end / begin)) + 2)
    edges[0], edges[-1] = begin, end
    cover = np.column_stack((edges[:-1], edges[1:]))
    order = np.argsort(np.modf(np.arange(len(cover)) * 0.6180339887498949)[0])
    best, where, left = search.run(cover[order], best, where, start, tolerance)
    if len(left):
        omega = float(left[0, 0])
        raise UndecidedError(f"rounding does not decide at {omega:.6g} rad/s", omega)
    return best, where


def excludes(family: Family, begin: float = 0.0) -> bool:
    """Tell whether no function of a family has a zero on the axis, but perhaps at s = 0.

    Parameters
    ----------
    family : Family
        At its level zero.
    begin : float, optional
        Frequency in rad/s up to which this is known; by default that of leading terms.

    Returns
    -------
    bool
        True is certified. False: there is a zero, or double precision does not decide.

    Raises
    ------
    UndecidedError
        If it takes too many steps.
    """
    begin, end = begin or family.begins(0.0), family.ends(0.0)
    if not (begin > 0.0 and np.isfinite(end)):
        return False
    if end <= begin:
        return True
    # At a distance of zero nothing is nearer, so that nothing is searched.
    nothing = 0.0, np.nan, 0.0, 0.0
    _, _, left = _Search(family, DISTANCE).run(np.array([[begin, end]]), *nothing)
    return not len(left)


def _likely(family: Family, goal: int, low: float, high: float, start: float) -> FloatArray:
    """Intervals of a sample that look best: only what is looked at first depends on them."""
    space = family.space
    grids = [np.geomspace(low, high, 500)]
    if space.longest:
        # One turn of the longest delay at each frequency, and the first hundred turns.
        point = np.arange(16) * (2.0 * np.pi / (16.0 * space.longest))
        grids += [np.add.outer(grids[0], point).ravel(), point[1] * np.arange(1, 1600)]
    for root in set(space.arrays.roots[space.arrays.present].tolist()):
        if root.imag > 0.0:
            off = max(abs(root.real), 1e-9 * root.imag) * np.geomspace(1e-2, 1e3, 24)
            grids += [root.imag - off, root.imag + off]
    omega = np.unique(np.concatenate(grids))
    omega = omega[(omega >= low) & (omega <= high)]
    if omega.size < 3:
        return np.array([[low, high]])
    f, g, *loose = at(family.functions, omega)
    radius = sum((np.abs(r) for r in loose), np.zeros(omega.size))
    crossing, value = inclusion.aims(goal, f, g, radius, omega)
    if goal == DISTANCE or loose:
        k = 1 + np.argsort(value[1:-1])[:8]
        spans = np.column_stack((omega[k - 1], omega[k + 1]))
    else:
        k = np.flatnonzero((crossing[1:] < 0.0) != (crossing[:-1] < 0.0))
        share = crossing[k] / (crossing[k] - crossing[k + 1])
        with np.errstate(invalid="ignore", divide="ignore"):
            if goal == REAL:
                # It may pass through infinity, but one over it does not.
                rough = 1.0 / value[k] + share * (1.0 / value[k + 1] - 1.0 / value[k])
                rough = np.where(rough > 0.0, 1.0 / rough, np.inf)
            else:
                rough = value[k] + share * (value[k + 1] - value[k])
        rough = np.where(rough > start, rough, np.inf)
        k = k[np.argsort(rough)][:60]
        spans = np.column_stack((omega[k], omega[k + 1]))
    # The best last: the last interval is walked first.
    return spans[::-1]
