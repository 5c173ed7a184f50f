"""From walks along the axis to counts, at points and along the rows of a chart; compiled.

The walks are those of `armlock.axis.contour`. What is counted is in a form that compiled
functions take: `PointModel` for points, `RowModel` for rows.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numba import config

from armlock.axis.compiled import njit
from armlock.axis.contour import (
    CAUTION,
    JUMP,
    MOST_RADIANS,
    POSITION,
    SPREAD,
    angle_between,
    argument_at,
    imaginary_zeros,
    winding,
)
from armlock.axis.exponentials import EPSILON, CompiledSum
from armlock.checks import BoolArray, ComplexArray, FloatArray, IntArray

# What `count_point` returns where it is no number of roots.
# `armlock.stability.counts.unstable_roots` returns the first two as well, and makes errors of
# DOUBTFUL and TOO_LONG.
#
# A root lies on the axis: `winding` meets a value within its rounding error, or can certify no
# step.
BOUNDARY = -1
# The neutral root chain is not confined: `armlock.stability.bounds.last_frequency` is infinite.
UNCONFINED = -2
# D and the roots of A contradict each other, or the count is below zero. Of a row of a chart:
# its points are to be counted one by one.
DOUBTFUL = -3
# The walk takes too many steps.
TOO_LONG = -4
# A point after one that took too long.
UNTRIED = -5


class PointModel(NamedTuple):
    """A characteristic function as `count_point` takes it.

    Attributes
    ----------
    constant : CompiledSum
        The first term of `CharacteristicFunction.parts`, over the exponentials of all three.
        Its sums are those of R: where all exponentials are one, D is R less x - x0 and y - y0
        times the two others, so that nothing cancels there.
    weights, sums : float arrays, shapes (2, groups, k) and (2, k)
        Of the two other terms.
    reference : tuple of two floats
        The parameters (x0, y0).
    sign : float
        That of the highest coefficient of A, 1 or -1.
    roots : complex array
        The roots of A.
    is_map : bool
        Whether the polynomials are those of a map.
    start, begun : float
        The frequency in rad/s from which D is followed, and its argument there in rad: what it
        has gathered since s = 0, and half pi for each root at s = 0 that does not count.
    """

    constant: CompiledSum
    weights: FloatArray
    sums: FloatArray
    reference: tuple[float, float]
    sign: float
    roots: ComplexArray
    is_map: bool
    start: float
    begun: float


class RowModel(NamedTuple):
    """The crossings x = N / M of a chart's rows, as `fill_rows` takes them.

    D = N - x M, with M = B1 exp(-s (delay + tau1)), and all other terms in N.

    Attributes
    ----------
    fixed : CompiledSum
        N conj(M) at y = 0, but the sums are those at y = y0.
    weights, sums : float arrays, shapes (groups, k) and (k,)
        Of what N conj(M) loses with y, over the same exponentials.
    measure : CompiledSum
        |M|^2.
    reference : float
        The parameter y0.
    is_map : bool
        Whether the polynomials are those of a map.
    """

    fixed: CompiledSum
    weights: FloatArray
    sums: FloatArray
    measure: CompiledSum
    reference: float
    is_map: bool


class Rows(NamedTuple):
    """The rows of a chart: entry i of each array but `x` belongs to row i.

    Attributes
    ----------
    ends : float array, shape (m,)
        Frequencies in rad/s past which nothing crosses.
    y : float array, shape (m,)
        The parameter y.
    base : int array, shape (m,)
        The counts at x = lower.
    x : float array, shape (n,)
        The parameter x, ascending.
    lower, upper : float arrays, shape (m,)
        Where rows begin and end.
    """

    ends: FloatArray
    y: FloatArray
    base: IntArray
    x: FloatArray
    lower: FloatArray
    upper: FloatArray


@njit(cache=True)
def count_point(model: PointModel, x: float, y: float, end: float) -> int:
    """Return the number of unstable roots at one point, or a status code below zero.

    By the argument principle. Without unstable roots the argument of D gathers, from 0 to
    infinity, half pi for each root of A, and that of a map, from 0 to pi / step, pi for each.
    Each unstable root takes away pi. `end` is what `armlock.stability.bounds.last_frequency`
    gives. Past it no root crosses, or it is inf, because the neutral root chain is not
    confined; for a map it is pi / step.
    """
    constant, b1, b2 = model.constant, model.sums[0], model.sums[1]
    if end == np.inf:
        return UNCONFINED
    for phase in constant.phases:
        if end * abs(phase) > MOST_RADIANS:
            return TOO_LONG
    dx, dy = x - model.reference[0], y - model.reference[1]
    sums, uncertain = constant.sums.copy(), np.empty_like(constant.sums)
    weights = constant.weights.copy()
    for k in range(sums.size):
        sums[k] -= dx * b1[k] + dy * b2[k]
        # The parameters are rounded numbers themselves.
        uncertain[k] = EPSILON * (abs(x * b1[k]) + abs(y * b2[k]))
        for g in range(weights.shape[0]):
            weights[g, k] -= x * model.weights[0, g, k] + y * model.weights[1, g, k]
    whole = CompiledSum(constant.polynomials, weights, sums, constant.phases)
    argument, value, clear = winding(whole, uncertain, model.start, end)
    if not clear:
        return BOUNDARY
    if np.isnan(argument):
        return TOO_LONG
    final = np.pi * model.roots.size
    if not model.is_map:
        # What the argument of D is at `end`. Past it |D / A - 1| < 1: the argument of D / A is
        # within a quarter turn, and goes back to zero, and that of A is known from its roots.
        final = argument_at(model.roots, end)
        apart = angle_between(value, model.sign * np.exp(1j * final))
        if abs(apart) > 0.51 * np.pi:
            # More than rounding explains: the roots of A are not those of A.
            return DOUBTFUL
        final += apart
    count = (final - model.begun - argument) / np.pi
    # It is a whole number but for rounding, because D is real at both ends of the axis.
    return int(np.floor(count + 0.5)) if -0.5 < count < np.inf else DOUBTFUL


# So few points or rows are left to one core: threads take half a millisecond to begin.
_FEW = 16


@njit(cache=True, nogil=True)
def _count_range(
    first: int,
    last: int,
    model: PointModel,
    x: FloatArray,
    y: FloatArray,
    ends: FloatArray,
    counts: IntArray,
    stop: BoolArray,
) -> None:
    """Count at points `first` to `last`, until one of them takes too long."""
    for i in range(first, last):
        counts[i] = UNTRIED if stop[0] else count_point(model, x[i], y[i], ends[i])
        if counts[i] == TOO_LONG:
            stop[0] = True


def count_points(model: PointModel, x: FloatArray, y: FloatArray, ends: FloatArray) -> IntArray:
    """`count_point` over one-dimensional arrays of the same length, on all cores.

    After the first point that takes too long no further one is tried.
    """
    if x.size == 1:
        return np.array([count_point(model, x[0], y[0], ends[0])])
    counts, stop = np.empty(x.size, dtype=np.int64), np.zeros(1, dtype=np.bool_)
    _on_all_cores(_count_range, x.size, model, x, y, ends, counts, stop)
    return counts


def _on_all_cores(function: Callable[..., None], size: int, *arguments: object) -> None:
    """Call function(first, last, ...) for ranges that cover `size`, in a thread each.

    The function is compiled to release the interpreter's lock. Ranges are short, because some
    points or rows take much longer than others.
    """
    cores = config.NUMBA_NUM_THREADS
    if size < _FEW or cores < 2:
        function(0, size, *arguments)
        return
    edges = np.unique(np.linspace(0, size, 16 * cores + 1).astype(int)).tolist()
    ranges = iter(list(pairwise(edges)))

    def work() -> None:
        """Take the next range until there is none: an iterator gives each to one thread."""
        for first, last in ranges:
            function(first, last, *arguments)

    with ThreadPoolExecutor(cores) as pool:
        for thread in [pool.submit(work) for _ in range(cores)]:
            thread.result()


@njit(cache=True)
def _fill_row(
    filled: tuple[IntArray, BoolArray, IntArray], model: RowModel, rows: Rows, i: int
) -> None:
    """Fill row i of a chart, see `fill_rows`."""
    counts, doubtful, last = filled
    x, lower, upper = rows.x, rows.lower[i], rows.upper[i]
    fixed, y = model.fixed, rows.y[i]
    weights = fixed.weights - y * model.weights
    sums = fixed.sums - (y - model.reference) * model.sums
    crossing = CompiledSum(fixed.polynomials, weights, sums, fixed.phases)
    zeros, complete = imaginary_zeros(
        crossing, model.measure, 0.0, rows.ends[i], model.is_map, CAUTION
    )
    change = np.zeros(x.size + 1, dtype=np.int64)
    total = running = rows.base[i]
    for zero in zeros:
        jump, position, spread = int(zero[JUMP]), zero[POSITION], zero[SPREAD]
        if np.isnan(position):
            continue
        if lower < position < upper:
            total += jump
            change[np.searchsorted(x, position)] += jump
        if position + spread >= x[0] and position - spread <= x[-1]:
            near = np.searchsorted(x, position - spread)
            while near < x.size and x[near] <= position + spread:
                doubtful[i, near] = True
                near += 1
    for k in range(x.size):
        running += change[k]
        counts[i, k] = running
    last[i] = total if complete and rows.base[i] >= 0 else DOUBTFUL


@njit(cache=True, nogil=True)
def _fill_range(
    first: int,
    last: int,
    filled: tuple[IntArray, BoolArray, IntArray],
    model: RowModel,
    rows: Rows,
) -> None:
    for i in range(first, last):
        _fill_row(filled, model, rows, i)


def fill_rows(model: RowModel, rows: Rows) -> tuple[IntArray, BoolArray, IntArray]:
    """Fill rows of a chart with counts, from the crossings of each row.

    Returns the counts, which of them lie too near a crossing to be trusted, and the count at
    the end of each row. That is DOUBTFUL, and the row's counts mean nothing, where `base` is
    below zero, or the walk was given up.
    """
    shape = rows.y.size, rows.x.size
    filled = (
        np.empty(shape, dtype=np.int64),
        np.zeros(shape, dtype=np.bool_),
        np.empty(shape[0], dtype=np.int64),
    )
    _on_all_cores(_fill_range, shape[0], filled, model, rows)
    return filled
