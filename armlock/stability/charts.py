"""Charts: how many characteristic roots are unstable over a grid of the two parameters.

With D = F + x G, charts are counted row by row: with y fixed, roots cross the axis where
Im(F / G) = 0, at x = -Re(F / G). Each row starts from a count just outside of the chart, and is
checked against an independent count at its other end. Points next to a crossing, rows that do
not add up, and small charts are counted one by one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import fmpq

from armlock.checks import BoolArray, FloatArray, IntArray, axis, check_memory, real_number
from armlock.compiled import Progress
from armlock.engine import chain
from armlock.engine.affine import Affine, NotAffineError
from armlock.engine.functions import Function, stacked
from armlock.engine.polynomials import exact, rounded
from armlock.engine.tolerances import BOUNDARY, EPSILON, HIDDEN_AT_ZERO, UNCONFINED
from armlock.stability.counts import count_points, unstable_roots
from armlock.stability.crossings import crossings
from armlock.systems import System
from armlock.tables import Shown, Table, spread

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
# Charts of so many points are counted point by point. Others are filled by so many rows at
# first, and then by as many as have this many crossings, or points.
_FEW, _ROWS, _MANY_CROSSINGS, _MANY_POINTS = 1024, 8, 2_000_000, 1_000_000


@dataclass(frozen=True, eq=False, repr=False)
class StabilityChart(Shown):
    """Number of unstable roots over a grid of the two free parameters.

    Attributes
    ----------
    system : System
        The loop that was charted.
    x, y : float arrays, shapes (n,) and (m,)
        The axes, as given.
    counts : int array, shape (m, n)
        As `unstable_roots` at each point: number of unstable roots, or -1, -2 or -3.
    parameters : pair of str
        What the axes are.

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

    system: System
    x: FloatArray
    y: FloatArray
    counts: IntArray
    parameters: tuple[str, str]

    def _table(self) -> Table:
        """Show the axes, and the shares of what was counted."""
        axes = zip(self.parameters, (self.x, self.y), strict=True)
        rows = [(name, spread(values)) for name, values in axes]
        kinds = {
            "stable": self.stable,
            "unstable": self.counts > 0,
            "-1, -2 or -3": self.counts < 0,
        }
        share = "{} points, {:.3g} %"
        for what, is_so in kinds.items():
            if is_so.any():
                rows.append((what, share.format(is_so.sum(), 100.0 * is_so.mean())))
        return Table("Stability chart", rows)

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
    system: System, *axes: npt.ArrayLike, **axes_and_numbers: npt.ArrayLike
) -> StabilityChart:
    r"""Count the unstable roots over a grid.

    Parameters
    ----------
    system : System
        The open loop, for instance `CommonArm()`, or an equation. Where the two parameters are
        multiplied, rows are counted one by one, which takes longer.
    *axes : array_like of float, one-dimensional
        Axes of the first two parameters, in any order and spacing, such as c1 and c2.
    **axes_and_numbers : array_like of float
        Axes of two parameters by name, in the order x, y; and numbers for other parameters,
        which are nominal by default.

    Returns
    -------
    StabilityChart
        With `.counts` of shape (len(y), len(x)): at each point the number that `unstable_roots`
        gives.

    Raises
    ------
    TypeError, ValueError
        If there are not two axes, an axis is empty, not one-dimensional, or not finite and
        real, or the chart does not fit into the memory.

    Notes
    -----
    D-subdivision along each row. With y fixed, a root is at s = j omega where

    .. math::

        x = -\frac{F}{G} , \qquad \mathrm{Im}\, \frac{F}{G} = 0 , \qquad D = F + x\, G .

    Past it, towards larger x, a conjugate pair has become unstable if Im(F / G) descends with
    omega there, and stable if it ascends; at omega = 0 one root. Of a retarded system the
    counts at the two ends of all rows come from two columns, and those of the columns from four
    single counts; of a neutral one each end is counted. A chart that takes longer shows its
    progress.

    Examples
    --------
    >>> from armlock import CommonArm, stability_chart
    >>> stability_chart(CommonArm(), [0.0, 1.0, 1.5], [0.5, 1.5]).counts
    array([[ 0,  0,  0],
           [ 0,  9, 13]])

    Over the two gains of a controller:

    >>> from armlock import delay, parameter, s
    >>> loop = (parameter("kp") + parameter("ki") / s) * delay(1.0) / (s + 1)
    >>> stability_chart(loop, kp=[0.5, 1.0, 3.0], ki=[0.5, 1.5]).stable
    array([[ True,  True, False],
           [ True,  True, False]])
    """
    system = System.of(system)
    (name1, xs), (name2, ys), numbers = _axes(system, axes, axes_and_numbers)
    check_memory(f"{name1} and {name2}", (ys.size, xs.size), _BYTES_A_POINT)
    try:
        affine = system.affine_in((name1, name2), **numbers)
    except NotAffineError:
        counts = _by_rows(system, {name1: xs}, {name2: ys}, numbers)
        return StabilityChart(system, xs, ys, counts, (name1, name2))
    order_x, order_y = np.argsort(xs, kind="stable"), np.argsort(ys, kind="stable")
    if affine.terms[1].is_zero:
        # Nothing crosses along a row: walk along the columns instead.
        affine = system.affine_in((name2, name1), **numbers)
        counts = _chart(affine, ys[order_y], xs[order_x]).T
    else:
        counts = _chart(affine, xs[order_x], ys[order_y])
    if (np.diff(order_x) != 1).any() or (np.diff(order_y) != 1).any():
        counts = counts[np.ix_(np.argsort(order_y), np.argsort(order_x))]
    return StabilityChart(system, xs, ys, counts, (name1, name2))


def _axes(
    system: System, axes: tuple[npt.ArrayLike, ...], named: dict[str, npt.ArrayLike]
) -> tuple[tuple[str, FloatArray], tuple[str, FloatArray], dict[str, float]]:
    """Return the two axes with their names, and the numbers."""
    given = system.given(axes, {**dict.fromkeys(system.parameters, 0.0), **named})
    numbers = {k: real_number(k, v) for k, v in named.items() if isinstance(v, Real)}
    placed = [*system.parameters[: len(axes)], *(k for k in named if k not in numbers)]
    chosen = list(zip(placed, [*axes, *(named[k] for k in placed[len(axes) :])], strict=True))
    if len(chosen) != 2:
        raise TypeError(
            f"two axes must be given, of the parameters {tuple(given)}, got {len(chosen)}"
        )
    first, second = ((name, axis(name, value)) for name, value in chosen)
    return first, second, numbers


def _by_rows(
    system: System, x: dict[str, FloatArray], y: dict[str, FloatArray], held: dict[str, float]
) -> IntArray:
    """Count row by row: with the second parameter held, the first one is not multiplied."""
    ((name, values),) = y.items()
    with Progress(values.size, "chart", " rows") as progress:
        rows = []
        for value in values:
            given: dict[str, Any] = {**x, name: value, **held}
            rows.append(unstable_roots(system, **given))
            progress.update()
    return np.array(rows)


def _counted(affine: Affine, x: FloatArray, y: FloatArray) -> IntArray:
    """Count at points one by one."""
    return count_points(affine, np.column_stack((x, y)))


def _chart(affine: Affine, x: FloatArray, y: FloatArray) -> IntArray:
    """Return the counts of a chart with ascending axes."""
    with Progress(x.size * y.size, "chart", " points") as progress:
        rows = _Rows.of(affine, float(x[x.size // 2]), float(y[y.size // 2]))
        if x.size * y.size <= _FEW or not rows.plain:
            across, up = _points(x, y)
            found = np.empty(across.size, np.int64)
            for k in (slice(at, at + _FEW) for at in range(0, across.size, _FEW)):
                found[k] = _counted(affine, across[k], up[k])
                progress.update(found[k].size)
            return found.reshape(y.size, x.size)
        return _filled(affine, rows, x, y, progress)


def _points(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points of a grid, row by row."""
    across, up = np.meshgrid(x, y)
    return across.ravel(), up.ravel()


def _filled(
    affine: Affine, rows: _Rows, x: FloatArray, y: FloatArray, progress: Progress
) -> IntArray:
    """Return the counts of a chart, row by row; doubtful points are counted one by one."""
    sides, levels = _ends(x, _OUTSIDE[0]), _ends(y, _OUTSIDE[1])
    # The confined points are a convex set, because the reserve of the chain is concave.
    everywhere = bool(rows.confined(*_points(sides, levels)).all())
    if everywhere:
        ends = _between_columns(affine, rows, y, sides, levels)
    else:
        ends = _between_own_ends(affine, rows, x, y, sides)
    found, start, number = np.empty((y.size, x.size), np.int64), 0, _ROWS
    while start < y.size:
        k = slice(start, start + number)
        some, doubtful, size = rows.filled(x, y[k], ends.of(k))
        if not everywhere:
            confined = rows.confined(*_points(x, y[k])).reshape(some.shape)
            some[~confined], doubtful = UNCONFINED, doubtful & confined
        # Few entries are found many times as fast in a flat array.
        row, column = np.divmod(np.flatnonzero(doubtful), x.size)
        some[row, column] = _counted(affine, x[column], y[k][row])
        found[k] = some
        progress.update(some.size)
        start += number
        number = max(_ROWS, int(number * min(_MANY_CROSSINGS / max(size, 1), 64.0)))
        number = min(number, max(_MANY_POINTS // x.size, 1))
    return found


class _Ends(NamedTuple):
    """Where rows begin and end, and the counts there; negative where a row cannot begin."""

    lower: FloatArray
    upper: FloatArray
    base: IntArray
    top: IntArray

    def of(self, rows: slice | BoolArray) -> _Ends:
        """Return those of some rows."""
        return _Ends(self.lower[rows], self.upper[rows], self.base[rows], self.top[rows])


def _counted_ends(affine: Affine, rows: _Rows, x: FloatArray, y: FloatArray) -> IntArray:
    """Count at ends of rows, which do not begin where D has a root at s = 0."""
    found = _counted(affine, x, y)
    found[rows.at_zero(x, y)] = BOUNDARY
    return found


def _between_columns(
    affine: Affine, rows: _Rows, y: FloatArray, sides: FloatArray, levels: FloatArray
) -> _Ends:
    """Let all rows end at two columns, which are filled from counts at four corners."""
    corners = _counted_ends(affine, rows, *_points(sides, levels)).reshape(2, 2)
    if rows.second.is_zero:
        columns = np.repeat(corners[0, :, None], y.size, axis=1)
    else:
        low, high = (np.full(2, level) for level in levels)
        columns, doubtful, _ = rows.exchanged().filled(y, sides, _Ends(low, high, *corners))
        side, row = np.nonzero(doubtful)
        columns[side, row] = _counted_ends(affine, rows, sides[side], y[row])
    lower, upper = (np.full(y.size, side) for side in sides)
    return _Ends(lower, upper, *columns)


def _between_own_ends(
    affine: Affine, rows: _Rows, x: FloatArray, y: FloatArray, sides: FloatArray
) -> _Ends:
    """Let rows end half-way between their last confined point and the limit of the chain."""
    lower, upper = (np.full(y.size, side) for side in sides)
    inside = np.array(
        [np.abs(x[rows.confined(x, np.full(x.size, v))]).max(initial=0.0) for v in y]
    )
    weight = rows.first.size_at_infinity
    if weight > 0.0:
        ends_at = inside + 0.5 * rows.reserve(inside, y) / weight
        lower, upper = np.maximum(lower, -ends_at), np.minimum(upper, ends_at)
    counted = (_counted_ends(affine, rows, side, y) for side in (lower, upper))
    return _Ends(lower, upper, *counted)


def _ends(values: FloatArray, outside: float) -> FloatArray:
    """Return the two places just outside of an ascending axis at which rows begin and end."""
    first, last = float(values[0]), float(values[-1])
    step = (last - first) / (values.size - 1) if last > first else max(abs(first), 1e-3)
    return np.array([first - outside * step, last + outside * step])


@dataclass(frozen=True)
class _Rows:
    """D = constant + x first + y second, exactly `at_centre` at the point `centre`.

    At s = 0 it is d[0] + x d[1] + y d[2], and M of the loop m[0] + x m[1] + y m[2].
    """

    constant: Function
    at_centre: Function
    first: Function
    second: Function
    centre: tuple[float, float]
    d: tuple[fmpq, ...]
    m: tuple[fmpq, ...]
    is_equation: bool

    @classmethod
    def of(cls, affine: Affine, x: float, y: float) -> _Rows:
        """Return D of two parameters, and its value at a centre."""
        constant, first, second = affine.terms
        d, m = (tuple(f.series(1)[0] for f in p) for p in (affine.terms, affine.m))
        there = affine.function(x, y)
        return cls(constant, there, first, second, (x, y), d, m, affine.m_is_zero)

    def exchanged(self) -> _Rows:
        """Return D with x and y exchanged."""
        d, m = ((constant, second, first) for constant, first, second in (self.d, self.m))
        return replace(
            self, first=self.second, second=self.first, centre=self.centre[::-1], d=d, m=m
        )

    @property
    def plain(self) -> bool:
        """Whether the highest power has an undelayed term, and none with a parameter."""
        space = self.first.space
        still, _ = space.limits(*stacked([self.constant, self.first, self.second]))
        return bool(space.step) or bool(still[0] and not still[1:].any())

    def _limits(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the limits of D at infinity at points, shapes (n,) and (n, K)."""
        still, late = self.first.space.limits(
            *stacked([self.constant, self.first, self.second])
        )
        shares = np.column_stack((np.ones(x.size), x, y))
        return shares @ still, shares @ late

    def confined(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Tell where the chain is confined."""
        return self.first.space.confined(*self._limits(x, y))

    def reserve(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Tell by how much the chain is confined."""
        return chain.reserve(*self._limits(x, y))

    def at_zero(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Tell where rounding hides the sign of D(0)."""
        # Of many fast poles the product is no float.
        sizes = rounded([v / (max(map(abs, self.d)) or 1) for v in self.d])
        sums = np.column_stack((np.ones(x.size), x, y)) * sizes
        return np.asarray(np.abs(sums.sum(axis=1)) <= HIDDEN_AT_ZERO * np.abs(sums).sum(axis=1))

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
        self, x: FloatArray, y: FloatArray, ends: _Ends
    ) -> tuple[IntArray, BoolArray, int]:
        """Fill rows from their crossings; return counts, which are doubtful, and crossings."""
        known = (ends.base >= 0) & (ends.top >= 0)
        if not known.all():
            # A row without a count at its ends, such as one with a root at s = 0 all along.
            counts, size = np.zeros((y.size, x.size), np.int64), 0
            doubtful = np.ones(counts.shape, np.bool_)
            if known.any():
                counts[known], doubtful[known], size = self.filled(x, y[known], ends.of(known))
            return counts, doubtful, size
        x0, y0 = self.centre
        lower, upper, base, top = ends
        found = crossings(
            (self.at_centre, self.second * -1, self.first * -1),
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
        doubted = found.unfinished | (counts[:, -1] != top)
        doubtful = np.repeat(doubted[:, None], x.size, axis=1)
        # Centre and crossing are rounded, and so is their sum.
        rounding = 4.0 * EPSILON * (abs(x0) + np.abs(found.x))
        off = found.spread + rounding
        from_k, to_k = np.searchsorted(x, at - off), np.searchsorted(x, at + off, side="right")
        exactly = inside & (found.omega == 0.0) & (found.jump != 0)
        for i in np.flatnonzero(from_k < to_k):
            k, here = found.row[i], slice(from_k[i], to_k[i])
            if exactly[i]:
                by = int(found.jump[i])
                left = counts[k, here] - by * (x[here] >= at[i])
                counts[k, here] = self._past_zero(x[here], float(y[k]), by, left)
            else:
                doubtful[k, here] = True
        return counts[:, :-1], doubtful, at.size

    def _past_zero(self, x: FloatArray, y: float, jump: int, left: IntArray) -> IntArray:
        """Count beside a crossing at s = 0 from the counts left of it; D(0) is known exactly.

        On the crossing D has a simple root s = 0. It does not count if N and M have it too.
        """
        found, up = left.copy(), exact(y)
        d, m = (p[0] + p[2] * up for p in (self.d, self.m))
        for k, value in enumerate(map(exact, x.tolist())):
            past = d / self.d[1] + value
            if past > 0:
                found[k] += jump
            elif past == 0:
                cancels = not self.is_equation and m + self.m[1] * value == 0
                found[k] = left[k] + min(jump, 0) if cancels else BOUNDARY
        return found
