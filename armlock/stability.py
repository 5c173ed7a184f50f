"""How many characteristic roots are unstable: at points, and over charts.

Points are counted by the argument principle along s = j omega, with certified steps up to
a frequency past which no root can cross. Charts are counted row by row: with y fixed, roots
cross the axis where Im[(A - y B2) / B1] = 0, at x = Re[(A - y B2) / B1]; a crossing upward
adds unstable roots. Each row is checked against an independent count at its far end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock import contour
from armlock.characteristic import CharacteristicFunction, ExponentialSum
from armlock.validation import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    axis,
    broadcast_pair,
)

# How far outside a chart's axes its reference counts lie, in steps of the axis: no round
# number, so that no reference point falls on a line a user would choose.
_OUTSIDE = 0.38196601125


class CountError(RuntimeError):
    """The number of unstable roots could not be decided; `points` says where."""

    def __init__(self, message: str, points: FloatArray) -> None:
        super().__init__(message)
        self.points = points


class _Compiled(NamedTuple):
    """A characteristic function in the form the compiled walks take."""

    parts: ComplexArray
    phases: FloatArray
    roots: ComplexArray
    squares: FloatArray
    omega_end: float


@lru_cache(maxsize=64)
def _compiled(system: CharacteristicFunction) -> _Compiled:
    sums = system.on_boundary()
    size = max(part.coefficients.shape[1] for part in sums)
    phases = np.concatenate([part.phases for part in sums])
    parts = np.zeros((3, phases.size, size), dtype=np.complex128)
    first = 0
    for k, part in enumerate(sums):
        groups, width = part.coefficients.shape
        parts[k, first : first + groups, :width] = part.coefficients
        first += groups
    squares = np.zeros((3, system.degree + 1))
    for k, polynomial in enumerate((system.a, system.b1, system.b2)):
        square = _squared_magnitude(polynomial)
        squares[k, : square.size] = square
    return _Compiled(
        parts,
        phases,
        poly.polyroots(system.a).astype(np.complex128),
        squares,
        np.pi / system.step if system.step else 0.0,
    )


def _squared_magnitude(p: FloatArray) -> FloatArray:
    """Return |p(j omega)|^2 as a polynomial in omega^2, ascending."""
    even, odd = p[0::2].copy(), p[1::2].copy()
    even[1::2] *= -1.0
    odd[1::2] *= -1.0
    square = np.zeros(p.size)
    even_square = np.convolve(even, even)
    square[: even_square.size] += even_square
    if odd.size:
        odd_square = np.convolve(odd, odd)
        square[1 : 1 + odd_square.size] += odd_square
    return square


def _count(system: CharacteristicFunction, x: FloatArray, y: FloatArray) -> IntArray:
    """Count at flat arrays of points; raise where no count can be given."""
    counts: IntArray = contour.count_points(
        *_compiled(system), np.ascontiguousarray(x), np.ascontiguousarray(y)
    )
    for status, reason in (
        (
            contour.UNBOUNDED,
            "the delayed terms are as large as the undelayed one at high frequency, so that "
            "infinitely many roots may be unstable",
        ),
        (contour.DOUBTFUL, "the argument of D does not add up to a whole number of turns"),
    ):
        bad = counts == status
        if bad.any():
            points = np.column_stack((x[bad], y[bad]))
            name1, name2 = system.parameters
            raise CountError(
                f"no count at ({name1}, {name2}) = ({points[0, 0]}, {points[0, 1]}) and "
                f"{len(points) - 1} further points: {reason}",
                points,
            )
    return counts


def unstable_roots(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> IntArray:
    """Count the characteristic roots with positive real part.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    x, y : array_like of float
        The free parameters; they broadcast.

    Returns
    -------
    int array, of the broadcast shape
        Number of unstable roots, multiplicity included. -1 where a root lies on the
        imaginary axis, or nearer to it than rounding can tell. The point is stable, with
        all roots in the open left half-plane, where the count is 0.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, or the two do not broadcast.
    CountError
        If the loop is neutral and its high-frequency chain of roots is not confined, or if
        rounding spoils the count. Nothing is guessed.

    Notes
    -----
    Argument principle on s = j omega, up to the frequency past which
    |A| > |x B1| + |y B2|; each step is bounded by the curvature of D over it.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> unstable_roots(CommonArm(), [0.9, 0.5, 1.0], [1.05, 1.6, 1.0])
    array([ 0,  5, -1])
    """
    name1, name2 = system.parameters
    xs, ys = broadcast_pair(name1, x, name2, y)
    return _count(system, xs.ravel(), ys.ravel()).reshape(xs.shape)


@dataclass(frozen=True, eq=False)
class StabilityChart:
    """Number of unstable roots over a grid of the two free parameters.

    Attributes
    ----------
    system : CharacteristicFunction
        The loop that was charted.
    x, y : float arrays, shapes (n,) and (m,)
        The axes, as given.
    counts : int array, shape (m, n)
        Number of unstable roots, -1 on the boundary.
    counted_singly : bool array, shape (m, n)
        Points so near a crossing that they were counted on their own.
    recounted_rows : int array
        Indices of rows whose crossings did not agree with the independent count at the far
        end, and which were counted point by point instead. Empty unless rounding interferes.
    """

    system: CharacteristicFunction
    x: FloatArray
    y: FloatArray
    counts: IntArray
    counted_singly: BoolArray
    recounted_rows: npt.NDArray[np.intp]

    @property
    def stable(self) -> BoolArray:
        """Where all roots lie in the open left half-plane."""
        return np.asarray(self.counts == 0)


def stability_chart(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> StabilityChart:
    """Count the unstable roots over a grid.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    x, y : array_like of float, one-dimensional
        Axes of the two free parameters, in any order and spacing.

    Returns
    -------
    StabilityChart
        With `.counts` of shape (len(y), len(x)), equal to `unstable_roots` at each point.

    Raises
    ------
    TypeError, ValueError
        If an axis is empty, not one-dimensional, or not finite and real.
    CountError
        As `unstable_roots` does.

    Notes
    -----
    Crossings along each row with their root tendency (D-subdivision). The counts at the two
    ends of all rows come from two columns, those of the columns from four single counts.

    Examples
    --------
    >>> from armlock import CommonArm, stability_chart
    >>> stability_chart(CommonArm(), [0.0, 1.0, 1.5], [0.5, 1.5]).counts
    array([[ 0,  0, -1],
           [ 0,  9, 13]])
    """
    name1, name2 = system.parameters
    xs, ys = axis(name1, x), axis(name2, y)
    order_x, order_y = np.argsort(xs, kind="stable"), np.argsort(ys, kind="stable")
    if not system.b1.any():
        # Without B1 nothing crosses along a row: walk along the columns instead.
        turned = _chart_rows(system.exchanged(), ys[order_y], xs[order_x])
        counts, singly, rows = turned[0].T, turned[1].T, np.empty(0, dtype=np.intp)
    else:
        counts, singly, rows = _chart_rows(system, xs[order_x], ys[order_y])
    place = np.ix_(np.argsort(order_y), np.argsort(order_x))
    return StabilityChart(system, xs, ys, counts[place], singly[place], np.sort(order_y[rows]))


def _chart_rows(
    system: CharacteristicFunction, x: FloatArray, y: FloatArray
) -> tuple[IntArray, BoolArray, npt.NDArray[np.intp]]:
    """Chart ascending axes; return counts, points counted singly, rows counted singly."""
    left, right = _ends(x)
    low, high = _ends(y)
    sides = np.array([left, right])
    if system.b2.any():
        base, at_low = np.array([left, right]), np.array([low, low])
        columns, unsure, tops = _walk(
            system.exchanged(), y, sides, _count(system, base, at_low), low, high
        )
        wrong = (tops != _count(system, sides, np.array([high, high]))) | (tops < 0)
        unsure[wrong] = True
        for k in range(2):
            here = unsure[k]
            columns[k, here] = _count(system, np.full(here.sum(), sides[k]), y[here])
    else:
        columns = np.repeat(_count(system, sides, np.array([low, low]))[:, None], y.size, 1)
    counts, singly, last = _walk(system, x, y, columns[0], left, right)
    failed = (last < 0) | (last != columns[1])
    singly[failed] = True
    rows, across = np.nonzero(singly)
    counts[singly] = _count(system, x[across], y[rows])
    return counts, singly, np.flatnonzero(failed)


def _ends(values: FloatArray) -> tuple[float, float]:
    """Return points just outside an ascending axis."""
    if values.size == 1 or values[0] == values[-1]:
        margin = _OUTSIDE * max(abs(float(values[0])), 1e-3)
        return float(values[0]) - margin, float(values[-1]) + margin
    margin = _OUTSIDE * float(values[-1] - values[0]) / (values.size - 1)
    return float(values[0]) - margin, float(values[-1]) + margin


def _walk(
    system: CharacteristicFunction,
    x: FloatArray,
    y: FloatArray,
    base: IntArray,
    lower: float,
    upper: float,
) -> tuple[IntArray, BoolArray, IntArray]:
    """Fill rows from their crossings, starting with the counts `base` at x = lower."""
    a, b1, b2 = system.on_boundary()
    fixed, varying = a.times_conjugate(b1), b2.times_conjugate(b1)
    joined = _joined(fixed, varying)
    end = np.full(y.size, _compiled(system).omega_end)
    if not system.step:
        squares = _compiled(system).squares
        reach = max(abs(lower), abs(upper))
        for i, value in enumerate(y):
            end[i] = contour.last_crossing_bound(*squares, reach, value)
        if not np.isfinite(end).all():
            # The corners decide which message applies.
            worst = y[~np.isfinite(end)]
            _count(system, np.full(worst.size, reach), worst)
    counts, doubtful, last = contour.fill_rows(
        *joined,
        b1.coefficients,
        # One delay alone does not change the magnitude of B1.
        b1.phases if system.step else np.zeros(1),
        end,
        system.step > 0.0,
        np.ascontiguousarray(y),
        np.ascontiguousarray(base),
        np.ascontiguousarray(x),
        lower,
        upper,
    )
    return counts, doubtful, last


def _joined(
    fixed: ExponentialSum, varying: ExponentialSum
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return two sums over the groups of both, so that they add with a weight."""
    phases = np.concatenate((fixed.phases, varying.phases))
    size = max(fixed.coefficients.shape[1], varying.coefficients.shape[1])
    first = np.zeros((phases.size, size), dtype=np.complex128)
    second = np.zeros_like(first)
    split = fixed.phases.size
    first[:split, : fixed.coefficients.shape[1]] = fixed.coefficients
    second[split:, : varying.coefficients.shape[1]] = varying.coefficients
    return first, second, phases
