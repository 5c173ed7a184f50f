"""What is decided on the imaginary axis: counts, and whether a family of functions has a zero.

`count` follows the argument of one function along the axis, and so counts its zeros right of
it. A `Family` is a set of functions that grows with a number, the level: a gain, an angle, a
delay. `least` finds the largest level at which none of them has a zero on the axis, `excludes`
tells whether none has one at the level zero. Where double precision does not decide, a count is
`BOUNDARY`, and a search raises an `UndecidedError` (`armlock.engine.tolerances`).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numba
import numpy as np
from flint import fmpq

from armlock.checks import FloatArray, IntArray
from armlock.compiled import Plain
from armlock.engine import chain, inclusion
from armlock.engine.functions import Function, Leading, Space, compiled, stacked
from armlock.engine.inclusion import DISTANCE, VERTEX, Functions, Question
from armlock.engine.polynomials import exact, rounded
from armlock.engine.tolerances import (
    BOUNDARY,
    FEW_UNDECIDED,
    OFF_A_WHOLE_NUMBER,
    STEPS_OF_A_COUNT,
    STEPS_OF_A_SEARCH,
    UNCONFINED,
    UNDECIDED,
    UndecidedError,
)

# Steps between two looks at the keyboard.
_A_WHILE = 100_000
# Steps in likely intervals before a search.
_A_LOOK = 2_000
# Most steps of a count that is not compiled, about half a second.
_FEW_STEPS = 1_200
_uncompiled = Plain(inclusion, seconds=1.0)
# Points that one thread counts at a time.
_BLOCK = 256


@lru_cache(1)
def _pool(process: int) -> ThreadPoolExecutor:
    """Return the threads of a process: a fork has none of those that it was made with."""
    return ThreadPoolExecutor(numba.config.NUMBA_NUM_THREADS)


def in_threads(function: Callable[[Any], Any], items: Iterable[Any]) -> list[Any]:
    """Return what a compiled function makes of some items; Ctrl-C ends it."""
    # A single item goes to a thread too: compiled functions do not react to Ctrl-C.
    futures = [_pool(os.getpid()).submit(function, item) for item in items]
    try:
        return [future.result() for future in futures]
    except KeyboardInterrupt:
        # What runs on keeps its threads to itself.
        _pool.cache_clear()
        raise
    finally:
        for future in futures:
            future.cancel()


def blocks(size: int, block: int) -> list[slice]:
    """Return the blocks of a range."""
    return [slice(first, min(first + block, size)) for first in range(0, size, block)]


def counts(
    space: Space,
    functions: Functions,
    *,
    leading: Sequence[Leading | None] | None = None,
    most: int = STEPS_OF_A_COUNT,
) -> IntArray:
    """Count the zeros with positive real part of n functions (Lemma 13).

    Parameters
    ----------
    space : Space
        Of all functions.
    functions : Functions
        The n functions, by their weights.
    leading : sequence of n Leading or None, optional
        Of functions with zeros at s = 0 that are not to count.
    most : int, optional
        Most steps of a count.

    Returns
    -------
    int array, shape (n,)
        BOUNDARY, UNCONFINED and UNDECIDED included.
    """
    _, steady, delayed, uncertain = functions
    n = len(steady)
    # The error of the weights is a term of any phase.
    ends = space.confined_from(steady, delayed, uncertain) * (1.0 if space.step else 2.0)
    leads = leading or [None] * n
    order = np.array([lead.order if lead else 0 for lead in leads])
    begin = np.array([lead.radius if lead else 0.0 for lead in leads])
    found = np.full(n, UNCONFINED, dtype=np.int64)
    here = np.flatnonzero(np.isfinite(ends))
    ends = np.maximum(ends, 2.0 * begin)
    if not here.size:
        return found

    def some(block: slice) -> tuple[Any, ...]:
        k = here[block]
        return _wound(_some(functions, k), begin[k], ends[k], most)

    turn, first, last, undecided, steps = map(
        np.concatenate, zip(*in_threads(some, blocks(here.size, _BLOCK)), strict=True)
    )
    # At s = 0 all is real; the value found there is off by less than a quarter turn.
    directions = [
        lead.direction if lead else np.sign(value)
        for lead, value in zip((leads[int(k)] for k in here), first.real, strict=True)
    ]
    still, _ = space.limits(steady[here], delayed[here])
    # There the function of a map is real.
    at_end = np.sign(last.real) if space.step else np.sign(still) * 1j ** (space.degree % 4)
    with np.errstate(all="ignore"):
        turn = turn + np.angle(first / directions) - np.angle(last / at_end)
    # A map counts zeros in the strip |Im s| < pi / step, at whose right end it is constant.
    number = 0.5 * ((0 if space.step else space.degree) - order[here]) - turn / np.pi
    with np.errstate(invalid="ignore"):
        sure = np.isnan(undecided) & (np.abs(number - np.round(number)) < OFF_A_WHOLE_NUMBER)
        found[here] = np.where(sure & (number > -0.5), np.round(number), BOUNDARY)
    found[here[steps >= most]] = UNDECIDED
    return found


def _some(functions: Functions, which: IntArray | slice) -> Functions:
    """Return some of many functions."""
    return Functions(functions.space, *(part[which] for part in functions[1:]))


def _wound(
    functions: Functions, begin: FloatArray, end: FloatArray, most: int
) -> tuple[Any, ...]:
    """Do what `inclusion.wind` does: uncompiled at first, as long as few steps suffice."""
    found: list[tuple[Any, ...]] = []
    if most >= _FEW_STEPS and _uncompiled.serves(inclusion.wind):
        with _uncompiled.instead() as plain:
            for n in range(begin.size):
                k = slice(n, n + 1)
                found.append(plain.wind(_some(functions, k), begin[k], end[k], _FEW_STEPS))
                steps = found[-1][-1]
                if steps >= _FEW_STEPS or not _uncompiled.serves(inclusion.wind):
                    found.pop()
                    break
    # Those that are left are compiled.
    rest = slice(len(found), begin.size)
    if begin[rest].size:
        found.append(inclusion.wind(_some(functions, rest), begin[rest], end[rest], most))
    return tuple(map(np.concatenate, zip(*found, strict=True)))


def count(
    function: Function, common: int = 0, *, right_of: float = 0.0, most: int = STEPS_OF_A_COUNT
) -> int:
    """Count the zeros of a function with a real part above a number.

    Parameters
    ----------
    function : Function
        With exact weights.
    common : int, optional
        Order of a zero at s = 0 that is not to count.
    right_of : float, optional
        That number, in rad/s.
    most : int, optional
        Most steps.

    Returns
    -------
    int
        BOUNDARY with another zero on that line, or where rounding does not decide; UNCONFINED.

    Raises
    ------
    UndecidedError
        If it takes too many steps.
    """
    if right_of:
        found = int(counts(*function.shifted(right_of), most=most)[0])
        if found >= 0:
            found -= common if right_of < 0.0 else 0
    else:
        lowest = function.lowest
        if lowest is None or lowest[0] > common:
            return BOUNDARY if function.confined else UNCONFINED
        begin = function.leading() if lowest[0] else None
        functions = compiled([function])
        found = int(counts(function.space, functions, leading=[begin], most=most)[0])
    if found == UNDECIDED:
        raise UndecidedError(f"a count takes more than {most:.0e} steps")
    return found


@dataclass(frozen=True, eq=False)
class Family:
    """Functions of which none has a zero if one test holds at each frequency.

    For instance M + k N, with gains k from 1 to the level: zero must not be between the
    vertices M + N and M + level N.

    Attributes
    ----------
    functions : sequence of Function
        Of one space.
    tests : sequence of tests
        Each a sequence of members (kind, weights, slopes): a VERTEX, or a TERM of any phase, is
        the combination of the functions with weights + level slopes. A test holds where zero is
        in no convex combination of the vertices, whatever the terms add.
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

    def question(self, goal: int, start: float, tolerance: float) -> Question:
        """Return the family, and what is looked for, as compiled functions take them."""
        shape = len(self.tests), max(map(len, self.tests))
        kind = np.zeros(shape, np.int64)
        weights = np.zeros((*shape, len(self.functions)), np.complex128)
        slopes = np.zeros_like(weights)
        for i, test in enumerate(self.tests):
            for n, member in enumerate(test):
                kind[i, n], weights[i, n], slopes[i, n] = member
        arc = np.array(self.arc or np.zeros((0, 4)), np.float64)
        return Question(kind, weights, slopes, arc, self.loose, goal, start, tolerance)

    def _members(
        self, test: Sequence[tuple[int, Sequence[float], Sequence[float]]], level: float
    ) -> tuple[list[Function], list[Function]]:
        """Return vertices and terms of a test, over its largest weight, which may be 1e300."""
        found: tuple[list[Function], list[Function]] = [], []
        at = exact(level)
        rows = [
            [exact(a) + exact(b) * at for a, b in zip(weights, slopes, strict=True)]
            for _, weights, slopes in test
        ]
        over = max([fmpq(1), *(abs(w) for row in rows for w in row)])
        for (kind, *_), row in zip(test, rows, strict=True):
            member = self.functions[0] * 0
            for f, weight in zip(self.functions, row, strict=True):
                member = member + f * (weight / over)
            found[0 if kind == VERTEX else 1].append(member)
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
            found.append(self._end(vertices, terms))
            if mixed := _together(vertices, terms):
                found.append(self._end(mixed[:1], mixed[1:]))
        if self.arc is not None and len(self.functions) - self.loose == 2:
            (_, _, a, b), (_, _, c, d) = self.arc
            # An arc that grows with omega is the whole circle there.
            found.append(self._arc_ends(np.pi if b or d else min(a + level * c, np.pi)))
        return min(found)

    def _end(self, vertices: list[Function], terms: list[Function]) -> float:
        """Return the frequency past which some vertices exceed some terms, or inf."""
        steady, delayed = stacked(vertices)
        still, _ = self.space.limits(steady, delayed)
        if (still > 0.0).any() and (still < 0.0).any():
            return np.inf
        size = sum((f.sizes for f in terms), np.zeros(steady.shape[1]))
        top = sum(f.size_at_infinity for f in terms)
        return float(self.space.confined_from(steady, delayed, size, top_terms=top).max())

    def _arc_ends(self, angle: float) -> float:
        """Do what `ends` does for f_0 + exp(j psi) f_1 on an arc around zero (Lemma 24)."""
        others = self.functions[1:]
        steady, delayed = stacked(self.functions[:1])
        limits = np.column_stack(self.space.limits(*stacked(self.functions[:2])))
        loose = sum(f.size_at_infinity for f in self.functions[2:])
        reserve = chain.arc_reserve(self.space.lags, limits[1], limits[0], angle, loose)
        more = sum((f.sizes for f in others), np.zeros(steady.shape[1]))
        return float(
            self.space.confined_from(steady, delayed, extra=more, reserve=reserve).max()
        )


def _together(vertices: list[Function], terms: list[Function]) -> list[Function]:
    """Mix one vertex and one term by their highest coefficients (Lemma 20); else none."""
    if not len(vertices) == len(terms) == 1:
        return []
    (vertex,), (term,) = vertices, terms
    _, (v, a) = vertex.space.limits(*stacked([vertex, term]))
    k = int(np.argmax(np.minimum(np.abs(v), np.abs(a)))) if v.size else 0
    if not v.size or not v[k] * a[k]:
        return []
    share = float(a[k] / v[k] if abs(a[k]) < abs(v[k]) else v[k] / a[k])
    if not abs(share) < 1.0 - 1e-9:
        return []
    return [vertex + term * -share, vertex * share + term * -1]


def _searched(
    functions: Functions,
    question: Question,
    pending: FloatArray,
    best: float,
    where: float,
    most: int = STEPS_OF_A_SEARCH,
) -> tuple[float, float, FloatArray]:
    """Walk over intervals, the last first, until none is left, or several are undecided.

    Returns the best value, where, and the intervals that are undecided.

    Raises
    ------
    UndecidedError
        If it takes too many steps.
    """
    steps, undecided = 0, np.zeros((0, 2))
    while len(pending) and len(undecided) < FEW_UNDECIDED:
        walk = partial(inclusion.walk, functions, question, pending, best, where)
        [(pending, more, best, where, taken)] = in_threads(walk, [min(_A_WHILE, most)])
        undecided, steps = np.concatenate((undecided, more)), steps + taken
        if steps > most and len(pending):
            raise UndecidedError(
                f"a search takes more than {most:.0e} steps, at {pending[-1, 0]:.3g} rad/s"
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
    functions, question = compiled(family.functions), family.question(goal, start, tolerance)
    corners, level = family.space.corners, min(best, 1e300)
    floor = low or family.begins(level) or 1e-4 * corners[0]
    end = min(family.ends(level), high)
    ceiling = end if np.isfinite(end) else 1e4 * corners[-1]
    likely = _likely(family.space, functions, question, floor, max(ceiling, 2.0 * floor))
    _, _, best, where, _ = inclusion.walk(functions, question, likely, best, where, _A_LOOK)
    if best <= start:
        return best, where
    level = min(start + (best - start) * (1.0 - tolerance), 1e300)
    begin, end = low or family.begins(level), min(family.ends(level), high)
    if not begin > 0.0:
        raise UndecidedError("the behaviour at s = 0 is not decided")
    if not np.isfinite(end):
        raise UndecidedError("the behaviour at high frequency is not decided")
    if end <= begin:
        return best, where
    edges = np.geomspace(begin, end, int(200 * np.log10(end / begin)) + 2)
    edges[0], edges[-1] = begin, end
    cover = np.column_stack((edges[:-1], edges[1:]))
    order = np.argsort(np.modf(np.arange(len(cover)) * 0.6180339887498949)[0])
    best, where, undecided = _searched(functions, question, cover[order], best, where)
    if len(undecided):
        raise UndecidedError(f"rounding does not decide at {undecided[0, 0]:.6g} rad/s")
    return best, where


def excludes(
    family: Family, begin: float = 0.0, end: float = np.inf, most: int = STEPS_OF_A_SEARCH
) -> bool:
    """Tell whether no function of a family has a zero on the axis, but perhaps at s = 0.

    Parameters
    ----------
    family : Family
        At its level zero.
    begin, end : float, optional
        Frequencies in rad/s up to which this is known, and past which; by default those of
        leading terms, and of the term that exceeds all others.
    most : int, optional
        Most steps.

    Returns
    -------
    bool
        True is certified. False: there is a zero, or double precision does not decide.

    Raises
    ------
    UndecidedError
        If it takes too many steps.
    """
    begin, end = begin or family.begins(0.0), min(family.ends(0.0), end)
    if not (begin > 0.0 and np.isfinite(end)):
        return False
    if end <= begin:
        return True
    # The best distance is zero already, so that the walk only tests.
    question, axis = family.question(DISTANCE, 0.0, 0.0), np.array([[begin, end]])
    *_, undecided = _searched(compiled(family.functions), question, axis, 0.0, np.nan, most)
    return not len(undecided)


def _likely(
    space: Space, functions: Functions, question: Question, low: float, high: float
) -> FloatArray:
    """Intervals of a sample that look best: only what is looked at first depends on them."""
    grids = [np.geomspace(low, high, 500)]
    if space.longest:
        # One turn of the longest delay at each frequency, and the first hundred turns.
        point = np.arange(16) * (2.0 * np.pi / (16.0 * space.longest))
        grids += [np.add.outer(grids[0], point).ravel(), point[1] * np.arange(1, 1600)]
    grids.append(space.around_roots(24))
    omega = np.unique(np.concatenate(grids).clip(low, high))
    crossing, value = inclusion.sample(functions, question, omega)
    rank = np.minimum(value[1:], value[:-1])
    if question.goal != DISTANCE and not question.loose:
        changes = (crossing[1:] < 0.0) != (crossing[:-1] < 0.0)
        highest = np.maximum(value[1:], value[:-1])
        rank = np.where(changes & (rank > question.start), highest, np.inf)
    # The best last: the last interval is walked first.
    k = np.argsort(rank)[59::-1]
    return np.column_stack((omega[k], omega[k + 1]))
