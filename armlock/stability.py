"""How many characteristic roots are unstable: at points, and over charts.

Points are counted by the argument principle along s = j omega, with certified steps up to
a frequency past which no root can cross. Charts are counted row by row: with y fixed, roots
cross the axis where Im[(A - y B2) / B1] = 0, at x = Re[(A - y B2) / B1]; a crossing upward
adds unstable roots. Each row is checked against an independent count at its far end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock import contour
from armlock.characteristic import CharacteristicFunction, ExponentialSum, checked_system
from armlock.checks import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    axis,
    broadcast_pair,
    check_memory,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: What a count is where a root lies on the boundary of stability: -1.
BOUNDARY = contour.BOUNDARY
#: What a count is where infinitely many roots do not stay left of the boundary: -2.
UNCONFINED = contour.UNCONFINED

# How far outside a chart's axes its reference counts lie, in steps of the axis: no round
# numbers, and not the same for both axes, so that no reference point falls on a line that a
# user would choose, or on one along which a square chart has its diagonal.
_OUTSIDE = (0.38196601125, 0.27639320225)

# Memory that a chart takes for each point: counts, flags, and a copy of them.
_BYTES_A_POINT = 32
_NO_POINTS = np.empty((0, 2))


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


class _Balanced(NamedTuple):
    """A characteristic function with coefficients of ordinary size, and weights of x and y.

    Its value at (weight_x x, weight_y y) is that of the one it was made of, up to a factor.
    """

    system: CharacteristicFunction
    weight_x: float
    weight_y: float

    def x(self, values: FloatArray) -> FloatArray:
        """Return values of x in its parameter, nan where they leave the doubles."""
        return _weighted(values, self.weight_x)

    def y(self, values: FloatArray) -> FloatArray:
        """Return values of y in its parameter, nan where they leave the doubles."""
        return _weighted(values, self.weight_y)


def _weighted(values: FloatArray, weight: float) -> FloatArray:
    with np.errstate(over="ignore", under="ignore"):
        found = values * weight
        kept = np.isfinite(found) & (found / weight == values)
    return np.where(kept, found, np.nan)


@lru_cache(maxsize=64)
def _balanced(system: CharacteristicFunction) -> _Balanced:
    """Scale A, B1 and B2 by powers of two, which rounds nothing; what is ordinary stays."""
    names = ("rest", "b1", "b2")
    polynomials = (system.rest, system.b1, system.b2)
    own = (system.a, system.b1, system.b2)
    shifts = [-int(np.frexp(np.abs(p).max())[1]) for p in own]
    with np.errstate(over="ignore", under="ignore"):
        scaled = [np.ldexp(p, k) for p, k in zip(polynomials, shifts, strict=True)]
        weights = [float(np.ldexp(1.0, shifts[0] - k)) for k in shifts[1:]]
        reference = [x * w for x, w in zip(system.reference, weights, strict=True)]
        whole = np.ldexp(system.a, shifts[0])
    exact = all(
        np.array_equal(np.ldexp(q, -k), p)
        for p, q, k in zip(
            (*polynomials, system.a), (*scaled, whole), (*shifts, shifts[0]), strict=True
        )
    ) and all(0.0 < w < np.inf for w in weights)
    if not exact or max(map(abs, shifts)) < 100:
        return _Balanced(system, 1.0, 1.0)
    balanced = CharacteristicFunction(
        **dict(zip(names, scaled, strict=True)),
        delay1=system.delay1,
        delay2=system.delay2,
        step=system.step,
        parameters=system.parameters,
        reference=(reference[0], reference[1]),
    )
    return _Balanced(balanced, *weights)


class _Compiled(NamedTuple):
    """A characteristic function in the form the compiled walks take.

    `squares` holds |A|^2, |B1|^2 and |B2|^2 as polynomials in (omega / unit)^2, `leads` the
    magnitudes of the coefficients of the highest power.
    """

    parts: ComplexArray
    sums: ComplexArray
    reference: FloatArray
    phases: FloatArray
    roots: ComplexArray
    squares: FloatArray
    leads: FloatArray
    unit: float
    omega_end: float


@lru_cache(maxsize=64)
def _compiled(system: CharacteristicFunction) -> _Compiled:
    pieces = system.on_boundary()
    size = max(piece.sums.size for piece in pieces)
    phases = np.concatenate([piece.phases for piece in pieces])
    parts = np.zeros((3, phases.size, size), dtype=np.complex128)
    sums = np.zeros((3, size), dtype=np.complex128)
    first = 0
    for k, piece in enumerate(pieces):
        groups, width = piece.coefficients.shape
        parts[k, first : first + groups, :width] = piece.coefficients
        sums[k, :width] = piece.sums
        first += groups
    rest = system.rest_on_boundary().sums
    sums[0] = 0.0
    sums[0, : rest.size] = rest
    return _Compiled(
        parts,
        sums,
        np.array(system.reference),
        phases,
        _certain_roots(system.a),
        *squares_and_leads(system.a, system.b1, system.b2),
        np.pi / system.step if system.step else 0.0,
    )


def _certain_roots(p: FloatArray) -> ComplexArray:
    """Roots of a polynomial, or nan where they do not multiply out to it.

    Of coefficients that differ by many orders of magnitude the eigenvalues of the companion
    matrix may be anything.
    """
    nothing = np.full(p.size - 1, np.nan, dtype=np.complex128)
    with np.errstate(all="ignore"):
        try:
            roots = poly.polyroots(p).astype(np.complex128)
        except np.linalg.LinAlgError:
            return nothing
        for _ in range(3):
            value, slope = poly.polyval(roots, p), poly.polyval(roots, poly.polyder(p))
            poor = np.abs(value) > 1e-6 * poly.polyval(np.abs(roots), np.abs(p))
            roots = np.where(poor, roots - value / slope, roots)
        product, magnitude = np.array([p[-1]], dtype=np.complex128), np.abs(p[-1:])
        for root in roots[np.argsort(np.abs(roots))]:
            product = np.convolve(product, [-root, 1.0])
            magnitude = np.convolve(magnitude, [abs(root), 1.0])
        agrees = np.abs(product - p) <= 1e-6 * magnitude
    return roots if agrees.all() else nothing


def squares_and_leads(
    a: FloatArray, b1: FloatArray, b2: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return |A|^2, |B1|^2, |B2|^2 in units of frequency, their leads, and the unit.

    In this unit, a power of two in rad/s, the lowest and the highest coefficient of A are of
    the same size, which leaves its powers most room.
    """
    degree = a.size - 1
    lowest = int(np.flatnonzero(a)[0])
    turn = np.log2(abs(a[lowest])) - np.log2(abs(a[degree]))
    exponent = round(turn / (degree - lowest)) if degree > lowest else 0
    squares, leads = np.zeros((3, degree + 1)), np.zeros(3)
    with np.errstate(over="ignore", under="ignore"):
        powers = exponent * np.arange(degree + 1) - round(0.5 * exponent * (degree + lowest))
        for k, polynomial in enumerate((a, b1, b2)):
            scaled = np.ldexp(polynomial, powers[: polynomial.size])
            square = squared_magnitude(scaled)
            # Rounded to nothing, and nothing else there: no bound comes of it.
            gone = (polynomial != 0.0) & (scaled * scaled < np.finfo(float).tiny)
            squares[k, : square.size] = np.where(gone, np.nan, square)
            leads[k] = abs(polynomial[degree]) if polynomial.size > degree else 0.0
    return squares, leads, float(np.ldexp(1.0, exponent))


def _constant_confined(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> BoolArray:
    """Whether the chain of an equation of order zero is confined to the left half-plane.

    Without a delay a term adds to A, with its sign.
    """
    undelayed, delayed = np.array(system.a[0]), np.zeros(())
    for b, delay, here in ((system.b1, system.delay1, x), (system.b2, system.delay2, y)):
        term = np.asarray(here) * b[0]
        if delay:
            delayed = delayed + np.abs(term)
        else:
            undelayed = undelayed - term
    return np.asarray(np.abs(undelayed) > delayed)


def _of_order_zero(system: CharacteristicFunction) -> bool:
    return system.degree == 0 and not system.step


def squared_magnitude(p: FloatArray) -> FloatArray:
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


def last_crossing(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> FloatArray:
    """Frequency past which no root can cross the imaginary axis.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop.
    x, y : array_like of float
        The free parameters; they broadcast.

    Returns
    -------
    float array, of the broadcast shape
        In rad/s: past it |A| > |x B1| + |y B2|, also for all smaller |x| and |y|. inf where a
        neutral loop's high-frequency chain of roots is not confined to the left half-plane.
    """
    name1, name2 = checked_system(system).parameters
    xs, ys = broadcast_pair(name1, x, name2, y)
    if system.step:
        return np.full(xs.shape, np.pi / system.step)
    if _of_order_zero(system):
        return np.where(_constant_confined(system, xs, ys), 0.0, np.inf)
    balanced = _balanced(system)
    compiled = _compiled(balanced.system)
    ends = [
        contour.last_crossing_bound(
            compiled.squares, compiled.leads, compiled.unit, float(p), float(q)
        )
        for p, q in zip(balanced.x(xs).flat, balanced.y(ys).flat, strict=True)
    ]
    return np.array(ends, dtype=np.float64).reshape(xs.shape)


def sign_changes(
    whole: ExponentialSum, end: float, *, is_map: bool = False
) -> tuple[FloatArray, IntArray]:
    """Zeros in [0, end] of the imaginary part of an exponential sum, and their jumps.

    As `armlock.contour.sign_changes`: the jump is 0 where rounding hides whether there is one.

    Raises
    ------
    CountError
        If there are too many of them, or a number overflows.
    """
    if not np.isfinite(end):
        raise CountError(f"no crossings up to omega = {end}: a number overflows", _NO_POINTS)
    omega, jump, *_, complete = contour.sign_changes(*whole, end, is_map)
    if not complete:
        raise CountError(
            f"no crossings up to omega = {end} rad/s: more than {contour.MOST_STEPS:.0e} steps "
            f"or {contour.MOST_ZEROS:.0e} crossings, because gain times delay is too large",
            _NO_POINTS,
        )
    return omega, jump


def _count(system: CharacteristicFunction, x: FloatArray, y: FloatArray) -> IntArray:
    """Count at flat arrays of points; raise where rounding spoils it."""
    if _of_order_zero(system):
        return np.where(_constant_confined(system, x, y), 0, UNCONFINED).astype(np.int64)
    balanced = _balanced(system)
    model = tuple(_compiled(balanced.system))
    counts = contour.count_points(model, balanced.x(x), balanced.y(y))
    bad = (counts == contour.DOUBTFUL) | (counts == contour.TOO_LONG)
    if bad.any():
        points = np.column_stack((x[bad], y[bad]))
        name1, name2 = system.parameters
        if (counts == contour.TOO_LONG).any():
            raise CountError(
                f"no count at ({name1}, {name2}) = ({points[0, 0]}, {points[0, 1]}): following "
                f"D takes more than {contour.MOST_STEPS:.0e} steps, because the gain, with "
                f"these parameters, times the delay is too large",
                points,
            )
        raise CountError(
            f"no count at ({name1}, {name2}) = ({points[0, 0]}, {points[0, 1]}) and "
            f"{len(points) - 1} further points: the argument of D does not add up to a whole "
            f"number of turns",
            points,
        )
    return counts


def unstable_roots(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> IntArray:
    r"""Count the characteristic roots with positive real part.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    x, y : array_like of float
        The free parameters; they broadcast.

    Returns
    -------
    int array, of the broadcast shape
        Number of unstable roots, multiplicity included. The point is stable, with all roots
        in the open left half-plane, where it is 0. `BOUNDARY` (-1) where a root lies on the
        imaginary axis, or nearer to it than rounding can tell. `UNCONFINED` (-2) where a
        neutral loop has |x b1| + |y b2| >= |a| in its highest powers: there the chain of
        roots at high frequency reaches the right half-plane, at the latest after an
        arbitrarily small change of the delays, and no finite count would tell.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, or the two do not broadcast.
    CountError
        If rounding spoils the count. Nothing is guessed.

    Notes
    -----
    By the argument principle. With n the degree of A,

    .. math::

        N = \frac{n}{2} - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega < \infty} D(\mathrm{j}\omega; x, y) ,

    which holds for retarded loops, and for neutral ones whose coefficients of the highest
    power of s satisfy

    .. math::

        |x\, b_1| + |y\, b_2| < |a| .

    For a map of step h the boundary ends at pi / h, and

    .. math::

        N = n - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega \le \pi / h} D(\mathrm{j}\omega; x, y) .

    The argument is followed up to the frequency past which |A| > |x B1| + |y B2|; each
    step is bounded by the curvature of D over it.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> unstable_roots(CommonArm(), [0.9, 0.5, 1.0], [1.05, 1.6, 1.0])
    array([ 0,  5, -1])
    """
    name1, name2 = checked_system(system).parameters
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
        As `unstable_roots`: number of unstable roots, or -1 or -2.
    counted_singly : bool array, shape (m, n)
        Points so near a crossing that they were counted on their own.
    recounted_rows : int array
        Indices of rows whose crossings did not agree with the independent count at the far
        end, and which were counted point by point instead. Empty unless rounding interferes.

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
    counted_singly: BoolArray
    recounted_rows: npt.NDArray[np.intp]

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
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> StabilityChart:
    r"""Count the unstable roots over a grid.

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
    D-subdivision along each row. With y fixed, a root is at s = j omega where

    .. math::

        x = q , \qquad \mathrm{Im}\, q = 0 , \qquad
        q = \frac{A - y\, B_2\, e^{-s\theta_2}}{B_1\, e^{-s\theta_1}} .

    Past it, towards larger x, a conjugate pair has become unstable if Im q ascends with omega
    there, and stable if it descends; at omega = 0 one root. The counts at the two
    ends of all rows come from two columns, those of the columns from four single counts.

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
    if _of_order_zero(system):
        grid = np.where(_constant_confined(system, xs, ys[:, None]), 0, UNCONFINED)
        singly = np.zeros(grid.shape, dtype=np.bool_)
        none = np.empty(0, dtype=np.intp)
        return StabilityChart(system, xs, ys, grid.astype(np.int64), singly, none)
    order_x, order_y = np.argsort(xs, kind="stable"), np.argsort(ys, kind="stable")
    if not system.b1.any():
        # Without B1 nothing crosses along a row: walk along the columns instead.
        turned = _chart_rows(system.exchanged(), ys[order_y], xs[order_x])
        counts, singly, rows = turned[0].T, turned[1].T, np.empty(0, dtype=np.intp)
    else:
        counts, singly, rows = _chart_rows(system, xs[order_x], ys[order_y])
    if (np.diff(order_x) != 1).any() or (np.diff(order_y) != 1).any():
        place = np.ix_(np.argsort(order_y), np.argsort(order_x))
        counts, singly = counts[place], singly[place]
    return StabilityChart(system, xs, ys, counts, singly, np.sort(order_y[rows]))


def _chart_rows(
    system: CharacteristicFunction, x: FloatArray, y: FloatArray
) -> tuple[IntArray, BoolArray, npt.NDArray[np.intp]]:
    """Chart ascending axes; return counts, points counted singly, rows counted singly."""
    left, right = _ends(x, _OUTSIDE[0])
    low, high = _ends(y, _OUTSIDE[1])
    lower, upper = np.full(y.size, left), np.full(y.size, right)
    confined = np.ones((y.size, x.size), dtype=np.bool_)
    if system.neutral:
        limit = _confined_up_to(system, y)
        confined = np.abs(x) < limit[:, None]
        # Rows end half-way between their last confined point and the limit.
        inside = np.where(confined, np.abs(x), 0.0).max(axis=1)
        ends_at = np.where(np.isfinite(limit), 0.5 * (inside + limit), np.inf)
        lower, upper = np.maximum(lower, -ends_at), np.minimum(upper, ends_at)
        base, top = _count(system, lower, y), _count(system, upper, y)
    elif system.b2.any():
        sides = np.array([left, right])
        at_low, at_high = (_count(system, sides, np.full(2, level)) for level in (low, high))
        columns, unsure, reached = _walk(
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
    counts, singly, reached = _walk(system, x, y, base, lower, upper)
    failed = ((reached < 0) | (reached != top)) & confined.any(axis=1)
    singly[failed] = True
    singly &= confined
    rows, across = np.nonzero(singly)
    counts[singly] = _count(system, x[across], y[rows])
    counts[~confined] = UNCONFINED
    return counts, singly, np.flatnonzero(failed)


def _confined_up_to(system: CharacteristicFunction, y: FloatArray) -> FloatArray:
    """Return the |x| from which on the chain of a neutral loop is not confined."""
    a, b1, b2 = (abs(value) for value in system.highest_coefficients)
    left = np.maximum(a - np.abs(y) * b2, 0.0)
    if b1 == 0.0:
        return np.where(left > 0.0, np.inf, 0.0)
    return np.asarray(left / b1)


def _ends(values: FloatArray, outside: float) -> tuple[float, float]:
    """Return points just outside an ascending axis."""
    span = float(values[-1] - values[0])
    margin = outside * (span / (values.size - 1) if span else max(abs(float(values[0])), 1e-3))
    return float(values[0]) - margin, float(values[-1]) + margin


def _walk(
    system: CharacteristicFunction,
    x: FloatArray,
    y: FloatArray,
    base: IntArray,
    lower: FloatArray,
    upper: FloatArray,
) -> tuple[IntArray, BoolArray, IntArray]:
    """Fill rows from their crossings, starting with the counts `base` at x = lower."""
    balanced = _balanced(system)
    system, y = balanced.system, balanced.y(y)
    x, lower, upper = (balanced.x(values) for values in (x, lower, upper))
    a, b1, b2 = system.on_boundary()
    rest = system.rest_on_boundary()
    # Delays left out, N = A - y B2 is rest + x0 B1 at the reference, exactly.
    at_reference = rest.plus(b1.scaled(system.reference[0])).sums
    fixed = a._replace(sums=at_reference).times_conjugate(b1)
    varying = b2.times_conjugate(b1)
    # Both over the groups of both, so that they add with a weight.
    varying_only = fixed.scaled(0.0).plus(varying)
    fixed = fixed.plus(varying.scaled(0.0))
    if system.step:
        norm = np.correlate(system.b1, system.b1, "full")[system.b1.size - 1 :]
        norm[1:] *= 2.0
    else:
        square = squared_magnitude(system.b1)
        norm = np.zeros(2 * square.size - 1)
        norm[0::2] = square
    ends = last_crossing(system, np.maximum(np.abs(lower), np.abs(upper)), y)
    # A row that is nowhere confined has nothing to count.
    ends = np.where(np.isfinite(ends), ends, 0.0)
    model = (
        fixed.coefficients,
        varying_only.coefficients,
        fixed.sums,
        varying_only.sums,
        fixed.phases,
        norm,
        system.step > 0.0,
    )
    deviation = y - system.reference[1]
    filled = contour.fill_rows(
        model, ends, y, deviation, np.ascontiguousarray(base), x, lower, upper
    )
    filled[1][:, np.isnan(x)] = True
    return filled
