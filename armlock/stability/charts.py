"""Charts: how many characteristic roots are unstable over a grid of the two parameters.

With D = N - x M, charts are counted row by row: with y fixed, roots cross the axis where
Im(N / M) = 0, at x = Re(N / M). Each row starts from a count just outside of the chart, and is
checked against an independent count at its other end. Points next to a crossing, and rows that
do not add up, are counted one by one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import BoolArray, FloatArray, IntArray, axis, check_memory
from armlock.engine.decide import BOUNDARY, UNCONFINED
from armlock.engine.functions import Function
from armlock.engine.inclusion import EPSILON
from armlock.stability.counts import count_points
from armlock.stability.crossings import crossings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# How far outside a chart's axes its reference counts lie, in steps of the axis: no round
# numbers, and not the same for both axes, so that no reference point falls on a line that a
# user would choose, or on one along which a square chart has its diagonal.
_OUTSIDE = (0.38196601125, 0.27639320225)

# Memory that a chart takes for each point: counts, flags, and a copy of them.
_BYTES_A_POINT = 32
# How exact a crossing has to be, in steps of the axis.
_FINE = 1e-4


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
        As `unstable_roots`: number of unstable roots, or -1 or -2.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import HayesEquation, stability_chart
    >>> chart = stability_chart(HayesEquation(), np.linspace(-2, 1, 4), np.linspace(-1, 1, 3))
    >>> chart.counts.shape
    (3, 4)
    >>> chart.stable[1]
    array([ True,  True, False, False])
    """

    system: CharacteristicFunction
    x: FloatArray
    y: FloatArray
    counts: IntArray

    @property
    def stable(self) -> BoolArray:
        """Where all roots lie in the open left half-plane."""
        return np.asarray(self.counts == 0)

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Colour the chart by its counts, the stable region apart.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        **options
            As `armlock.plotting.plot_chart` takes them.

        Returns
        -------
        matplotlib Axes
        """
        from armlock.plotting import plot_chart

        return plot_chart(self, ax, **options)


def stability_chart(
    system: CharacteristicFunction,
    c1: npt.ArrayLike,
    c2: npt.ArrayLike,
) -> StabilityChart:
    r"""Count the unstable roots over a grid.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    c1, c2 : array_like of float, one-dimensional
        Axes of the two free parameters, in any order and spacing.

    Returns
    -------
    StabilityChart
        With `.counts` of shape (len(c2), len(c1)): at each point the count of D, which is -1 on
        the line D(0) = 0.

    Raises
    ------
    TypeError, ValueError
        If an axis is empty, not one-dimensional, or not finite and real, or the chart does not
        fit into the memory.
    CountError
        As `unstable_roots` does.

    Notes
    -----
    D-subdivision along each row. With c2 fixed, a root is at s = j omega where

    .. math::

        c_1 = \frac{N}{M} , \qquad \mathrm{Im}\, \frac{N}{M} = 0 , \qquad
        N = A + C\, e^{-s\delta} - c_2\, B_2\, e^{-s(\delta + \theta_2)} , \quad
        M = B_1\, e^{-s(\delta + \theta_1)} .

    Past it, towards larger c1, a conjugate pair has become unstable if Im(N / M) ascends with
    omega there, and stable if it descends; at omega = 0 one root. Of a retarded system the
    counts at the two ends of all rows come from two columns, and those of the columns from four
    single counts; of a neutral one each end is counted.

    Examples
    --------
    >>> from armlock import CommonArm, stability_chart
    >>> stability_chart(CommonArm(), [0.0, 1.0, 1.5], [0.5, 1.5]).counts
    array([[ 0,  0, -1],
           [ 0,  9, 13]])
    """
    name1, name2 = checked_system(system).parameters
    xs, ys = axis(name1, c1), axis(name2, c2)
    check_memory(f"{name1} and {name2}", (ys.size, xs.size), _BYTES_A_POINT)
    order_x, order_y = np.argsort(xs, kind="stable"), np.argsort(ys, kind="stable")
    if system.terms.first.is_zero:
        # Nothing crosses along a row: walk along the columns instead.
        counts = _chart_rows(system, ys[order_y], xs[order_x], swapped=True).T
    else:
        counts = _chart_rows(system, xs[order_x], ys[order_y], swapped=False)
    for other in system.others:
        # Rounding does not decide where a pole that may be zero changes the count.
        differ = stability_chart(other, xs[order_x], ys[order_y]).counts != counts
        counts[differ] = BOUNDARY
    if (np.diff(order_x) != 1).any() or (np.diff(order_y) != 1).any():
        counts = counts[np.ix_(np.argsort(order_y), np.argsort(order_x))]
    return StabilityChart(system, xs, ys, counts)


def _chart_rows(
    system: CharacteristicFunction, x: FloatArray, y: FloatArray, swapped: bool
) -> IntArray:
    """Return the counts of a chart with ascending axes, of D or with x and y exchanged."""

    def count(x: FloatArray, y: FloatArray) -> IntArray:
        """Count D, with its root at s = 0."""
        return count_points(plain, *((y, x) if swapped else (x, y)))

    def reserve(x: FloatArray, y: FloatArray) -> FloatArray:
        return system.neutral_margin(*((y, x) if swapped else (x, y)))

    plain, (_, _, first, second) = system.plain(), system.terms
    centre = float(x[x.size // 2]), float(y[y.size // 2])
    at_centre = system.function(*(centre[::-1] if swapped else centre))
    if swapped:
        first, second = second, first
    left, right = _ends(x, _OUTSIDE[0])
    low, high = _ends(y, _OUTSIDE[1])
    lower, upper = np.full(y.size, left), np.full(y.size, right)
    rows = _Rows(system.terms.constant, at_centre, first, second, centre)
    confined = reserve(x, y[:, None]) > 0.0
    if not (reserve(np.array([left, right]), np.array([[low], [high]])) > 0.0).all():
        # Rows end half-way between their last confined point and the limit of the chain.
        inside = np.where(confined, np.abs(x), 0.0).max(axis=1)
        whole, _ = first.space.limits(*rows.constant.weights)
        weight = first.size_at_infinity / abs(float(whole))
        if weight > 0.0:
            ends_at = inside + 0.5 * reserve(inside, y) / weight
            lower, upper = np.maximum(lower, -ends_at), np.minimum(upper, ends_at)
        base, top = count(lower, y), count(upper, y)
    elif second.is_zero:
        corners = count(np.array([left, right]), np.full(2, low))
        base, top = np.repeat(corners[:, None], y.size, axis=1)
    else:
        sides = np.array([left, right])
        at_low, at_high = (count(sides, np.full(2, at)) for at in (low, high))
        columns, doubtful = rows.exchanged().filled(
            y, sides, np.full(2, low), np.full(2, high), at_low, at_high
        )
        for k in range(2):
            here = doubtful[k]
            columns[k, here] = count(np.full(here.sum(), sides[k]), y[here])
        base, top = columns
    counts, doubtful = rows.filled(x, y, lower, upper, base, top)
    doubtful &= confined
    counts[~confined] = UNCONFINED
    # Few entries are found many times as fast in a flat array.
    row, column = np.divmod(np.flatnonzero(doubtful), x.size)
    counts[row, column] = count(x[column], y[row])
    return counts


def _ends(values: FloatArray, outside: float) -> tuple[float, float]:
    """Return the two places just outside of an ascending axis at which rows begin and end."""
    span = float(values[-1] - values[0])
    margin = outside * (span / (values.size - 1) if span else max(abs(float(values[0])), 1e-3))
    return float(values[0]) - margin, float(values[-1]) + margin


@dataclass(frozen=True)
class _Rows:
    """D = constant - x first - y second, exactly `at_centre` at the point `centre`."""

    constant: Function
    at_centre: Function
    first: Function
    second: Function
    centre: tuple[float, float]

    def exchanged(self) -> _Rows:
        """Return D with x and y exchanged."""
        return _Rows(self.constant, self.at_centre, self.second, self.first, self.centre[::-1])

    def confined_from(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Frequency past which the constant exceeds x first and y second together."""
        steady, delayed = (
            np.broadcast_to(w, (x.size, *w.shape)) for w in self.constant.weights
        )
        sizes, top = np.zeros(steady.shape), np.zeros(x.size)
        for term, parameter in ((self.first, x), (self.second, y)):
            sizes += np.multiply.outer(np.abs(parameter), term.sizes)
            top += np.abs(parameter) * term.size_at_infinity
        found = self.first.space.confined_from(steady, delayed, sizes, top_terms=top)
        # A row that is nowhere confined has nothing to count.
        return np.where(np.isfinite(found), found, self.first.space.corners[0])

    def filled(
        self,
        x: FloatArray,
        y: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        base: IntArray,
        top: IntArray,
    ) -> tuple[IntArray, BoolArray]:
        """Fill rows from their crossings; return counts, and which of them are doubtful.

        The counts at x = lower and at x = upper are `base` and `top`.
        """
        x0, y0 = self.centre
        found = crossings(
            (self.at_centre, self.second, self.first),
            y - y0,
            lower - x0,
            upper - x0,
            self.confined_from(np.maximum(np.abs(lower), np.abs(upper)), y),
            fine=_FINE * float((upper - lower).max()) / x.size,
        )
        at = x0 + found.x
        inside = (lower[found.row] < at) & (at < upper[found.row])
        row, jump = found.row[inside], found.jump[inside]
        change = np.zeros((y.size, x.size + 1), dtype=np.int64)
        np.add.at(change, (row, np.searchsorted(x, at[inside])), jump)
        counts = base[:, None] + np.cumsum(change, axis=1)
        doubted = found.unfinished | (base < 0) | (counts[:, -1] != top)
        doubtful = np.repeat(doubted[:, None], x.size, axis=1)
        # Centre and crossing are rounded, and so is their sum.
        rounding = 4.0 * EPSILON * (abs(x0) + np.abs(found.x))
        off = found.spread + rounding
        from_k, to_k = np.searchsorted(x, at - off), np.searchsorted(x, at + off, side="right")
        for i in np.flatnonzero(from_k < to_k):
            doubtful[found.row[i], from_k[i] : to_k[i]] = True
        return counts[:, :-1], doubtful
