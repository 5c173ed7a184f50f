"""How many characteristic roots are unstable: at points, and over charts.

Points are counted by the argument principle along s = j omega, with certified steps up to
a frequency past which no root can cross. With D = N - x M, charts are counted row by row: with
y fixed, roots cross the axis where Im(N / M) = 0, at x = Re(N / M). Where Im(N / M) ascends
with omega, they become unstable towards larger x. Each row starts from a count just outside of
the chart, and is checked against an independent one at its far end.

The walks are those of `armlock.axis.contour`. What makes a point a boundary point stands there,
in `winding`: D is no larger somewhere on the axis than its rounding error, or no step of the
walk can be certified. To that error the one of x and y contributes
(`armlock.axis.counting.count_point`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import elementwise

from armlock.axis import contour, counting
from armlock.axis.counting import PointModel, RowModel, Rows
from armlock.axis.exponentials import (
    ROUNDING,
    ExponentialSum,
    aligned,
    evaluate,
    expand,
    without_unused,
)
from armlock.characteristic import CharacteristicFunction, broadcast_parameters, checked_system
from armlock.checks import (
    BoolArray,
    FloatArray,
    IntArray,
    axis,
    check_memory,
    real_number,
)
from armlock.loops import power_series
from armlock.stability.bounds import last_frequency
from armlock.sweep import sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: What a count is where a root lies on the boundary of stability: -1.
BOUNDARY = counting.BOUNDARY
#: What a count is where infinitely many roots do not stay left of the boundary: -2.
UNCONFINED = counting.UNCONFINED

# How far outside a chart's axes its reference counts lie, in steps of the axis: no round
# numbers, and not the same for both axes, so that no reference point falls on a line that a
# user would choose, or on one along which a square chart has its diagonal.
_OUTSIDE = (0.38196601125, 0.27639320225)

# Memory that a chart takes for each point: counts, flags, and a copy of them.
_BYTES_A_POINT = 32
# Most tiles, of whole rows, into which a chart is cut for an executor.
_TILES = 64
_NO_POINTS = np.empty((0, 2))
# What becomes an error, and the reason that it gives.
_WHY_NOT = {
    counting.TOO_LONG: f"following D takes more than {contour.MOST_STEPS:.0e} steps, because "
    "the gain, with these parameters, times the delay is too large",
    counting.DOUBTFUL: "the argument of D does not add up",
}


class CountError(RuntimeError):
    """The number of unstable roots could not be decided.

    Attributes
    ----------
    points : float array, shape (n, 2)
        Where.

    Examples
    --------
    >>> from armlock import CommonArm, CountError, unstable_roots
    >>> try:
    ...     count = int(unstable_roots(CommonArm(), 0.9, 1.05))
    ... except CountError as error:
    ...     print("undecided at", error.points)
    >>> count
    0
    """

    def __init__(self, message: str, points: FloatArray) -> None:
        super().__init__(message)
        self.points = points

    def __reduce__(self) -> tuple[type[CountError], tuple[str, FloatArray]]:
        """Pickle the points along, so that the error passes from process to process."""
        return type(self), (str(self), self.points)


@lru_cache(maxsize=64)
def _point_model(system: CharacteristicFunction) -> PointModel:
    """Return a system in the form in which points are counted."""
    constant, b1, b2 = system.on_boundary()
    at_reference = constant._replace(sums=system.rest_on_boundary().sums)
    constant, b1, b2 = aligned(at_reference, b1, b2)
    return PointModel(
        constant=constant.compiled(),
        weights=np.array([b1.weights, b2.weights]),
        sums=np.array([b1.sums, b2.sums]),
        reference=system.reference,
        sign=float(np.sign(system.a[-1])),
        roots=system.roots_of_a,
        is_map=system.step > 0.0,
        start=0.0,
        begun=0.0,
    )


def sign_changes(
    whole: ExponentialSum, intervals: npt.ArrayLike, *, is_map: bool = False
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Zeros of the imaginary part of an exponential sum, jumps and widths.

    On intervals of the axis, shape (n, 2). As `armlock.axis.contour.imaginary_zeros`: the jump
    is 0 where rounding hides whether there is one, within the width.

    Raises
    ------
    CountError
        If there are too many of them, or a number overflows.
    """
    summed = without_unused(whole)[0].compiled()
    parts = [np.empty((0, 5))]
    for start, end in np.reshape(intervals, (-1, 2)):
        if not np.isfinite(end):
            raise CountError(
                f"no crossings up to omega = {end}: a number overflows", _NO_POINTS
            )
        zeros, complete = contour.imaginary_zeros(summed, None, start, end, is_map, ROUNDING)
        if not complete:
            raise CountError(
                f"no crossings up to omega = {end} rad/s: more than {contour.MOST_STEPS:.0e} "
                f"steps, because gain times delay is too large",
                _NO_POINTS,
            )
        parts.append(zeros)
    zeros = np.concatenate(parts)
    jump = zeros[:, contour.JUMP].astype(np.int64)
    return zeros[:, contour.OMEGA], jump, zeros[:, contour.WIDTH]


def polished(
    function: Callable[[FloatArray], FloatArray],
    omega: FloatArray,
    reaches: Iterable[FloatArray],
) -> FloatArray:
    """Zeros of a function next to those that `sign_changes` found on the expanded sums.

    Each is looked for within the first of the reaches around it over which the sign changes,
    and stays as it is where there is none.
    """
    omega, left = omega.copy(), np.arange(omega.size)
    for reach in reaches:
        if not left.size:
            break
        low, high = omega[left] - reach[left], omega[left] + reach[left]
        enclosed = function(low) * function(high) < 0.0
        if enclosed.any():
            ends, exact = (low[enclosed], high[enclosed]), {"xatol": 0.0, "xrtol": 1e-15}
            found = elementwise.find_root(function, ends, tolerances=exact)
            omega[left[enclosed]] = found.x
        left = left[~enclosed]
    return omega


def _count(
    system: CharacteristicFunction,
    x: FloatArray,
    y: FloatArray,
    begin: tuple[float, float] = (0.0, 0.0),
) -> IntArray:
    """Count at flat arrays of points; raise where rounding spoils it.

    `begin` is what `walk_begins` returns, or where D is followed from s = 0.
    """
    ends = last_frequency(system, x, y)
    if np.isnan(ends).any():
        points = np.column_stack((x, y))[np.isnan(ends)]
        raise CountError(f"no count at {tuple(points[0].tolist())}: a number overflows", points)
    model = _point_model(system)._replace(start=begin[0], begun=begin[1])
    counts: IntArray = counting.count_points(model, x, y, np.maximum(ends, 2.0 * begin[0]))
    name1, name2 = system.parameters
    for status, why in _WHY_NOT.items():
        if (counts == status).any():
            points = np.column_stack((x, y))[counts == status]
            at = f"({name1}, {name2}) = ({points[0, 0]}, {points[0, 1]})"
            more = f" and {len(points) - 1} further points" if len(points) > 1 else ""
            raise CountError(f"no count at {at}{more}: {why}", points)
    return counts


def unstable_roots(
    system: CharacteristicFunction,
    x: npt.ArrayLike | None = None,
    y: npt.ArrayLike | None = None,
) -> IntArray:
    r"""Count the characteristic roots with positive real part.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    x, y : array_like of float, optional
        The free parameters; they broadcast. Those of a loop, c1 and c2, are one if they are not
        given; others have to be.

    Returns
    -------
    int array, of the broadcast shape
        Number of unstable roots, multiplicity included. The point is stable, with all roots
        in the open left half-plane, where it is 0. `BOUNDARY` (-1) where a root lies on the
        imaginary axis, or nearer to it than rounding can tell. The rounding of the phase
        omega tau is the largest: a point within some 8 EPSILON omega tau of the boundary,
        relative to its parameters, may be given as -1 (4e-10 where a root crosses at 1e4 rad/s,
        with 20 s). `UNCONFINED` (-2) where the neutral root chain is not confined to the left
        half-plane (`CharacteristicFunction.chain_reserve` is not positive): an arbitrarily
        small change of the delays can then make infinitely many roots unstable.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, or the two do not broadcast.
    CountError
        If rounding spoils the count, it takes too many steps, or a number overflows. Nothing is
        guessed.

    Notes
    -----
    By the argument principle. With n the degree of A,

    .. math::

        N = \frac{n}{2} - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega < \infty} D(\mathrm{j}\omega; x, y) ,

    which holds for retarded loops, and for neutral ones whose root chain is confined.

    For a map of step h the boundary ends at pi / h, and

    .. math::

        N = n - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega \le \pi / h} D(\mathrm{j}\omega; x, y) .

    The argument is followed up to the frequency past which |A| > |C| + |x B1| + |y B2|;
    each step is bounded by the curvature of D over it.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> unstable_roots(CommonArm(), [0.9, 0.5, 1.0], [1.05, 1.6, 1.0])
    array([ 0,  5, -1])
    """
    xs, ys = broadcast_parameters(system, x, y)
    return _count(system, xs.ravel(), ys.ravel()).reshape(xs.shape)


def walk_begins(
    loop: CharacteristicFunction, c1: float | Fraction, c2: float | Fraction
) -> tuple[float, float] | None:
    r"""Where a walk along D begins if the roots at s = 0 that cancel in L are not to count.

    Returns a frequency in rad/s, and the argument of D there, in rad; zeros where none cancels,
    and None where L(0) = -1, or rounding hides what it is.

    With D - R = N, k factors s cancel where N and R both have them, and D / s^k begins with
    d_k. From the series of D up to any power J,

    .. math::

        \left| \frac{D}{d_k s^k} - 1 \right| \le
        \sum_{k < j \le J} \left| \frac{d_j}{d_k} \right| \omega^{j - k}
        + \left| \frac{M}{d_k} \right| T^{J + 1} \omega^{J + 1 - k} ,

    with T the longest delay and M a bound on |N| up to 1 / T, where all coefficients count as
    positive. No term exceeds 2^-(j - k) / 2 up to the frequency that is returned, and the sum
    is at most 1/2: D / s^k has no root on that part of the axis, and turns by 30 degrees at
    most.
    """
    number = loop.degree + 21
    rest, numerator = power_series(loop, c1, c2, number)
    both = enumerate(zip(rest, numerator, strict=True))
    shared = next((k for k, pair in both if any(pair)), 0)
    if shared == 0:
        return 0.0, 0.0
    series = [r + n for r, n in zip(rest, numerator, strict=True)]
    first, longest = series[shared], loop.longest_delay
    if first == 0:
        return None
    unit = Fraction(longest)
    past = sum(
        abs(Fraction(value)) / unit**i * (abs(Fraction(origin)) + abs(Fraction(c)))
        for b, c, origin in zip((loop.b1, loop.b2), (c1, c2), loop.reference, strict=True)
        for i, value in enumerate(b.tolist())
    )
    # Below 1 / T an exponential's terms add up to less than e in all.
    series.append(3 * past * unit**number)
    logs = [
        (_log(first) - _log(2 * value)) / (j - shared)
        for j, value in enumerate(series)
        if j > shared and value
    ]
    start = 0.5 * min(math.exp(min([*logs, 700.0])), 1.0 / longest)
    value = evaluate(expand(loop.sum_at(float(c1), float(c2)).compiled(), start), start)[0]
    turn = contour.angle_between(value, (1.0 if first > 0 else -1.0) * 1j**shared)
    # More than the bound: rounding hides D there, or its coefficients are not those in use.
    return (start, 0.5 * math.pi * shared + turn) if abs(turn) < 0.6 else None


def _log(value: Fraction) -> float:
    """Natural logarithm of the size of a fraction, of which a float may be too large."""
    return math.log(abs(value.numerator)) - math.log(value.denominator)


def loop_count(loop: CharacteristicFunction, c1: float | Fraction, c2: float | Fraction) -> int:
    r"""Count the zeros of 1 + L with positive real part, at one point.

    Where numerator and denominator of L cancel a factor s, D = R (1 + L) has a root at s = 0
    that comes from clearing the denominator R, and is not the loop's. `unstable_roots` counts
    -1 there, however many roots are unstable; here that root is taken out, exactly. This is
    so at (1, 1) for every loop with an integrator.

    Parameters
    ----------
    loop : CharacteristicFunction
        The loop, for instance `CommonArm()`, or what `changed` makes of one.
    c1, c2 : float or Fraction
        Multiplicative perturbations. Whether anything cancels is decided for these numbers and
        the loop's own, without rounding.

    Returns
    -------
    int
        As `unstable_roots`, which it is where nothing cancels. `BOUNDARY` (-1) remains where
        1 + L itself is zero on the axis, or so close to it that rounding hides what it is.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no loop, or c1 or c2 is not finite and real.
    CountError
        As `unstable_roots` does.

    Notes
    -----
    With k such factors, the walk along D / s^k starts at a small frequency. Up to there a bound
    on its Taylor series shows that it has no root, and how far it has turned.

    Examples
    --------
    >>> from armlock import SingleArm, unstable_roots
    >>> from armlock.stability.counts import loop_count
    >>> loop = SingleArm(gain=50.0, tau=10.0, delay=0.05)
    >>> int(unstable_roots(loop, 1.0, 1.0)), loop_count(loop, 1.0, 1.0)
    (-1, 166)
    """
    if checked_system(loop).step or loop.reference != (1.0, 1.0):
        raise TypeError(f"loop must be a Loop, for instance CommonArm(), got {loop!r:.200}")
    c1, c2 = (
        c if isinstance(c, Fraction) else real_number(name, c)
        for name, c in (("c1", c1), ("c2", c2))
    )
    x, y = np.array([float(c1)]), np.array([float(c2)])
    count = int(_count(loop, x, y)[0])
    if count != BOUNDARY:
        return count
    begin = walk_begins(loop, c1, c2)
    if begin is None or begin[0] == 0.0:
        return BOUNDARY
    return int(_count(loop, x, y, begin)[0])


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
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    executor: Executor | None = None,
) -> StabilityChart:
    r"""Count the unstable roots over a grid.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    x, y : array_like of float, one-dimensional
        Axes of the two free parameters, in any order and spacing.
    executor : concurrent.futures.Executor, optional
        What computes the rows, in tiles, as for `armlock.sweep`; the same chart.

    Returns
    -------
    StabilityChart
        With `.counts` of shape (len(y), len(x)), equal to `unstable_roots` at each point.

    Raises
    ------
    TypeError, ValueError
        If an axis is empty, not one-dimensional, or not finite and real, or the chart does not
        fit into the memory.
    CountError
        As `unstable_roots` does.

    Notes
    -----
    D-subdivision along each row. With y fixed, a root is at s = j omega where

    .. math::

        x = \frac{N}{M} , \qquad \mathrm{Im}\, \frac{N}{M} = 0 , \qquad
        N = A + C\, e^{-s\delta} - y\, B_2\, e^{-s(\delta + \theta_2)} , \quad
        M = B_1\, e^{-s(\delta + \theta_1)} .

    Past it, towards larger x, a conjugate pair has become unstable if Im(N / M) ascends with
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
    xs, ys = axis(name1, x), axis(name2, y)
    check_memory(f"{name1} and {name2}", (ys.size, xs.size), _BYTES_A_POINT)
    if executor is not None:
        tiles = np.array_split(ys, min(ys.size, _TILES))
        charts = sweep(partial(stability_chart, system, xs), tiles, executor=executor)
        return StabilityChart(system, xs, ys, np.vstack([chart.counts for chart in charts]))
    order_x, order_y = np.argsort(xs, kind="stable"), np.argsort(ys, kind="stable")
    if system.b1.any():
        counts = _chart_rows(system, xs[order_x], ys[order_y])
    else:
        # Without B1 nothing crosses along a row: walk along the columns instead.
        counts = _chart_rows(system.exchanged(), ys[order_y], xs[order_x]).T
    if (np.diff(order_x) != 1).any() or (np.diff(order_y) != 1).any():
        counts = counts[np.ix_(np.argsort(order_y), np.argsort(order_x))]
    return StabilityChart(system, xs, ys, counts)


def _chart_rows(system: CharacteristicFunction, x: FloatArray, y: FloatArray) -> IntArray:
    """Return the counts of a chart with ascending axes."""
    left, right = _ends(x, _OUTSIDE[0])
    low, high = _ends(y, _OUTSIDE[1])
    lower, upper = np.full(y.size, left), np.full(y.size, right)
    if system.neutral:
        # Rows end half-way between their last confined point and the limit of the chain.
        confined = system.chain_reserve(x, y[:, None]) > 0.0
        inside = np.where(confined, np.abs(x), 0.0).max(axis=1)
        b1 = abs(system.highest_coefficients[1] / system.highest_coefficients[0])
        if b1 > 0.0:
            ends_at = inside + 0.5 * system.chain_reserve(inside, y) / b1
            lower, upper = np.maximum(lower, -ends_at), np.minimum(upper, ends_at)
        base, top = _count(system, lower, y), _count(system, upper, y)
    elif system.b2.any():
        sides = np.array([left, right])
        at_low, at_high = (_count(system, sides, np.full(2, at)) for at in (low, high))
        columns, unsure, reached = _fill(
            system.exchanged(), y, sides, at_low, np.full(2, low), np.full(2, high)
        )
        unsure[(reached != at_high) | (reached < 0)] = True
        for k in range(2):
            here = unsure[k]
            columns[k, here] = _count(system, np.full(here.sum(), sides[k]), y[here])
        base, top = columns
    else:
        corners = _count(system, np.array([left, right]), np.full(2, low))
        base, top = np.repeat(corners[:, None], y.size, axis=1)
    counts, singly, reached = _fill(system, x, y, base, lower, upper)
    # Next to a crossing, and in rows whose crossings do not add up to the count at their end.
    singly[(reached < 0) | (reached != top)] = True
    if system.neutral:
        singly &= confined
        counts[~confined] = UNCONFINED
    rows, across = np.nonzero(singly)
    counts[rows, across] = _count(system, x[across], y[rows])
    return counts


def _ends(values: FloatArray, outside: float) -> tuple[float, float]:
    """Return the two places just outside of an ascending axis at which rows begin and end."""
    span = float(values[-1] - values[0])
    margin = outside * (span / (values.size - 1) if span else max(abs(float(values[0])), 1e-3))
    return float(values[0]) - margin, float(values[-1]) + margin


def _fill(
    system: CharacteristicFunction,
    x: FloatArray,
    y: FloatArray,
    base: IntArray,
    lower: FloatArray,
    upper: FloatArray,
) -> tuple[IntArray, BoolArray, IntArray]:
    """Fill rows from their crossings, starting with the counts `base` at x = lower."""
    constant, b1, b2 = system.on_boundary()
    x0, y0 = system.reference
    # Where all exponentials are one, N = A + C - y B2 is R + x0 B1 at y = y0, exactly.
    at_reference = constant._replace(sums=system.rest_on_boundary().sums + x0 * b1.sums)
    fixed, varying, square = without_unused(
        at_reference.times_conjugate(b1), b2.times_conjugate(b1), b1.times_conjugate(b1)
    )
    ends = last_frequency(system, np.maximum(np.abs(lower), np.abs(upper)), y)
    # A row that is nowhere confined has nothing to count.
    ends = np.where(np.isfinite(ends), ends, 0.0)
    fixed, varying = aligned(fixed, varying)
    model = RowModel(
        fixed=fixed.compiled(),
        weights=varying.weights,
        sums=varying.sums,
        measure=square.compiled(),
        reference=y0,
        is_map=system.step > 0.0,
    )
    rows = Rows(ends, y, np.ascontiguousarray(base), x, lower, upper)
    return counting.fill_rows(model, rows)
