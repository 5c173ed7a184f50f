"""Whether a loop is stable, and over which region of any two parameters.

To count hundreds of thousands of unstable roots takes long, and one of them suffices. So some
frequencies are tried first. One at which the argument of D falls faster than that of a stable D
can is a proof. Where none is found, nothing is decided, and the roots are counted.

Notes
-----
Why such a frequency is a proof. Let T be the longest delay, let the neutral root chain be
confined, and let D have no root right of the imaginary axis. Then

    B(s) = exp(-s T) D(-s) / D(s)

is analytic there, and bounded, because no exponential in its numerator grows and no other term
of D exceeds the highest power of A. On the axis |B| = 1, so |B| <= 1 right of it: there |B|
falls, seen from the axis, and by Cauchy and Riemann its argument -omega T - 2 arg D(j omega)
does not rise along the axis. So stability needs, at every frequency,

    d/domega arg D(j omega) = Re D'(j omega) / D(j omega) >= -T / 2 .

Loops of a row that differ by their gain alone are stable together: from one that is, the
gain interval tells which others are. Where it ends the roots cross, at a frequency that proves
those beyond unstable.
"""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable, Hashable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.axis.rounding import EPSILON
from armlock.characteristic import CharacteristicFunction, broadcast_parameters
from armlock.checks import BoolArray, FloatArray, IntArray, axis, real_number
from armlock.loops import Loop, LoopAt, checked_loop
from armlock.robustness.gains import LARGEST_GAIN, gain_interval_of_stable
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import BOUNDARY, CountError, loop_count, unstable_roots
from armlock.sweep import sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# How many frequencies are tried, and how often each moves towards the root that it sees.
_TRIALS, _MOVES = 128, 2
# To this share of the magnitudes they are added from, the terms of D are taken as known: roots
# of polynomials give the coefficients back to it.
_KNOWN = 1e-6
# Gain factors this share inside of a gain interval are taken from it: its ends are rounded, and
# near the limits of the neutral root chain known to a part in 1e5.
_INSIDE = 2e-5


def _fall(
    system: CharacteristicFunction, x: float, y: float, omega: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Re D' / D at j omega, what it may be off by, and Im D / D' there.

    With f = D / R it is Re (R' / R + f' / f). The error is inf where f is not known.
    """
    s = np.asarray(1j * omega, dtype=np.complex128)
    rest, *polynomials = system.polynomials()

    def logarithmic(roots: npt.NDArray[np.complex128]) -> tuple[Any, Any]:
        """Return the sum of 1 / (s - root) over roots, and that of its magnitudes."""
        terms = 1.0 / (s[:, None] - roots)
        return terms.sum(axis=1), np.abs(terms).sum(axis=1)

    below, below_size = logarithmic(rest.roots)
    f, slope = np.ones_like(s), np.zeros_like(s)
    f_size, slope_size = np.ones_like(omega), np.zeros_like(omega)
    dead = np.exp(-s * system.delay)
    for p, (_, tau, origin, here) in zip(polynomials, system.arms(x, y), strict=True):
        if not p.coefficients.any():
            continue
        factor, late = p.over(rest, s) * dead, here * np.exp(-s * tau)
        above, above_size = logarithmic(p.roots)
        rate, weight = above - below - system.delay, abs(origin) + abs(here)
        f += factor * (origin - late)
        slope += factor * (rate * (origin - late) + tau * late)
        f_size += np.abs(factor) * weight
        rates = above_size + below_size + system.delay
        slope_size += np.abs(factor) * (rates * weight + tau * abs(here))
    relative = _KNOWN + 16.0 * EPSILON * omega * system.longest_delay
    ratio, room = slope / f, np.abs(f) - relative * f_size
    error = relative * (slope_size + np.abs(ratio) * f_size) / room + relative * below_size
    error[~(room > 0.0)] = np.inf
    whole = below + ratio
    return whole.real, error, (1.0 / whole).imag


def proves_instability(
    system: CharacteristicFunction, x: float, y: float, likely: float = np.nan
) -> bool:
    """Whether a frequency is found that proves a root right of the imaginary axis.

    A likely one, in rad/s, is tried too. False decides nothing.
    """
    end = float(last_frequency(system, x, y))
    rest = system.polynomials()[0]
    if system.step or not 0.0 < end < np.inf or not rest.coefficients.any():
        return False
    sizes = np.abs(np.concatenate([p.roots for p in system.polynomials()]))
    lowest = 0.1 * min(sizes[sizes > 0.0].min(initial=np.inf), system.omega_per_turn, end)
    omega, most = np.geomspace(lowest, end, _TRIALS), -0.5 * system.longest_delay
    if 0.0 < likely < end:
        omega = np.append(omega, likely)
    with np.errstate(all="ignore"):
        for _ in range(_MOVES + 1):
            fall, error, move = _fall(system, x, y, omega)
            if (fall + error < most).any():
                return True
            # Newton's step, along the axis.
            omega = np.abs(omega - move)
            omega = omega[np.isfinite(omega) & (omega > 0.0)]
    return False


def _verdicts(
    system: CharacteristicFunction, x: FloatArray, y: FloatArray, likely: float = np.nan
) -> IntArray:
    """Return 0 where a system is stable, 1 where it is not, or a count below zero.

    At flat arrays of points; `likely` as for `proves_instability`. What cancels in L at s = 0
    is no root of a loop.
    """
    verdicts = np.ones(x.size, dtype=np.int64)
    confined = system.chain_reserve(x, y) > 0.0
    proved = [
        bool(ok) and proves_instability(system, float(p), float(q), likely)
        for ok, p, q in zip(confined, x, y, strict=True)
    ]
    left = np.flatnonzero(~np.array(proved, dtype=bool))
    if left.size:
        verdicts[left] = np.minimum(unstable_roots(system, x[left], y[left]), 1)
    if isinstance(system, Loop):
        for i in np.flatnonzero(verdicts == BOUNDARY):
            verdicts[i] = min(loop_count(system, float(x[i]), float(y[i])), 1)
    return verdicts


def is_stable(
    system: CharacteristicFunction,
    x: npt.ArrayLike | None = None,
    y: npt.ArrayLike | None = None,
) -> BoolArray:
    r"""Tell whether all roots lie in the open left half-plane.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    x, y : array_like of float, optional
        The free parameters; they broadcast. Those of a loop, c1 and c2, are one if they are not
        given; others have to be.

    Returns
    -------
    bool array, of the broadcast shape
        Certified. False where a root is unstable, where one lies on the imaginary axis or so
        near to it that rounding hides on which side, and where the neutral root chain is not
        confined. A root at s = 0 that comes from clearing the denominator of L is not the
        loop's, and does not count.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, or the two do not broadcast.
    CountError
        As `unstable_roots` does, where no instability is proved before.

    Notes
    -----
    With T the longest delay, stability needs at every frequency

    .. math::

        \frac{\mathrm{d}}{\mathrm{d}\omega} \arg D(\mathrm{j}\omega)
        = \mathrm{Re}\, \frac{D'(\mathrm{j}\omega)}{D(\mathrm{j}\omega)} \ge -\frac{T}{2} .

    A few hundred frequencies are tried for one at which this fails. Where none is found, the
    roots are counted.

    Examples
    --------
    >>> from armlock import flight_loop, is_stable
    >>> [bool(is_stable(flight_loop(delay=delay))) for delay in (12.3e-6, 123e-6)]
    [True, False]
    """
    xs, ys = broadcast_parameters(system, x, y)
    return np.asarray(_verdicts(system, xs.ravel(), ys.ravel()) == 0).reshape(xs.shape)


@dataclass(frozen=True, eq=False)
class StabilityRegion:
    """Where a loop is stable, over a grid of any two of its parameters.

    Attributes
    ----------
    parameters : tuple of two str
        Names of the two.
    x, y : float arrays, shapes (n,) and (m,)
        The axes, as given.
    verdicts : int array, shape (m, n)
        0 where the loop is stable, 1 where at least one root is unstable. -1 and -2 where that
        is not decided: a root on the imaginary axis for all that rounding tells, or a count
        that would take too many steps; and a neutral root chain that is not confined.

    Examples
    --------
    >>> from armlock import SingleArm, stability_region
    >>> def make(gain, delay):
    ...     return SingleArm(gain, tau=20.0, delay=delay)
    >>> region = stability_region(make, [1.0, 10.0], [0.01, 0.5], c1=0.9)
    >>> region.parameters, region.stable.tolist()
    (('gain', 'delay'), [[True, True], [True, False]])

    As an array of xarray: ``xr.DataArray(region.stable, [("delay", region.y), ("gain",
    region.x)])``.
    """

    parameters: tuple[str, str]
    x: FloatArray
    y: FloatArray
    verdicts: IntArray

    @property
    def stable(self) -> BoolArray:
        """Where the loop is stable."""
        return np.asarray(self.verdicts == 0)

    @property
    def decided(self) -> BoolArray:
        """Where it is certain whether the loop is stable."""
        return np.asarray(self.verdicts >= 0)

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Shade the stable region; what is not decided stays white.

        An axis whose values have equal ratios is drawn logarithmic.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        **style
            As `matplotlib.axes.Axes.pcolormesh` takes it.

        Returns
        -------
        matplotlib Axes
        """
        from armlock.plotting import plot_counts

        return plot_counts(self.x, self.y, self.verdicts, self.parameters, ax, 1, **style)


def stability_region(
    make_loop: Callable[[float, float], Loop],
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    c1: float = 1.0,
    c2: float = 1.0,
    executor: Executor | None = None,
) -> StabilityRegion:
    """Tell where a loop is stable, over a grid of any two parameters.

    Parameters
    ----------
    make_loop : callable
        Of two numbers, which returns a `Loop`. Its first two arguments name the axes.
    x, y : array_like of float, one-dimensional
        Values of the first and of the second argument.
    c1, c2 : float, optional
        Multiplicative perturbations.
    executor : concurrent.futures.Executor, optional
        What computes the rows, as for `armlock.sweep`. For processes `make_loop` stands in a
        module, or is a `functools.partial` of one that does.

    Returns
    -------
    StabilityRegion

    Raises
    ------
    TypeError, ValueError
        If an axis is empty, not one-dimensional, or not finite and real, or `make_loop` returns
        no `Loop`. What `make_loop` raises itself is not caught.

    Notes
    -----
    Each point is decided as by `is_stable`; where one argument is a gain, many at once, so that
    200 x 200 points of `flight_loop` take two minutes. For c1 and c2 themselves
    `stability_chart` is much faster.

    Examples
    --------
    The arms' half difference, which the sensor holds at 0.255 s, against its true value:

    >>> from armlock import Loop, stability_region
    >>> from armlock.controllers import white_paper
    >>> from armlock.sensors import modified_dual
    >>> def held(true, held):
    ...     sensor = modified_dual(33.6, held)
    ...     return Loop(white_paper(20.0), sensor, 33.6 + true, 33.6 - true)
    >>> stability_region(held, [-0.255, 0.255], [-0.255, 0.255]).stable
    array([[ True, False],
           [False,  True]])
    """
    if not callable(make_loop):
        raise TypeError(f"make_loop must be a function of two numbers, got {make_loop!r}")
    names = [
        name
        for name, parameter in inspect.signature(make_loop).parameters.items()
        if parameter.kind in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD)
    ]
    if len(names) < 2:
        raise TypeError(f"make_loop must take two arguments, got {make_loop!r}")
    xs, ys = axis(names[0], x), axis(names[1], y)
    at = real_number("c1", c1), real_number("c2", c2)
    # Along the gain, if one of the two is one.
    ends = [checked_loop(make_loop(float(xs[0]), y)) for y in (float(ys[0]), float(ys[-1]))]
    if _but_for_gain(ends[0]) == _but_for_gain(ends[1]):
        row = partial(_row, partial(_exchanged, make_loop), ys, at)
        columns = sweep(row, xs.tolist(), executor=executor)
        verdicts = np.array(columns, dtype=np.int64).T
    else:
        row = partial(_row, make_loop, xs, at)
        rows = sweep(row, ys.tolist(), executor=executor)
        verdicts = np.array(rows, dtype=np.int64)
    return StabilityRegion((names[0], names[1]), xs, ys, verdicts)


def _exchanged(make_loop: Callable[[float, float], Loop], y: float, x: float) -> Loop:
    """Call a function with its two arguments exchanged."""
    return make_loop(x, y)


class _StableGains(NamedTuple):
    """Between which gains a loop is stable; at which frequency in rad/s that ends above."""

    lower: float
    upper: float
    omega: float


def _stable_gains(loop: Loop, at: tuple[float, float]) -> _StableGains:
    """Return the gains, of one sign, around that of a stable loop."""
    lower, upper, omega = gain_interval_of_stable(LoopAt(loop, *at))
    gain = abs(loop.controller.gain)
    lower, upper = max(lower, 1.0 / LARGEST_GAIN), min(upper, LARGEST_GAIN)
    return _StableGains(gain * lower * (1.0 + _INSIDE), gain * upper * (1.0 - _INSIDE), omega)


def _but_for_gain(loop: Loop) -> Hashable:
    """Return what loops have in common that differ by the size of the gain alone."""
    k = loop.controller
    return k.zeros, k.poles, k.gain > 0.0, loop.mapping, loop.tau1, loop.tau2, loop.delay


def _row(
    make_loop: Callable[[float, float], Loop], xs: FloatArray, at: tuple[float, float], y: float
) -> IntArray:
    """Return the verdicts along a row; what is too long to count is undecided."""
    loops = [checked_loop(make_loop(x, y)) for x in xs.tolist()]
    alike = [_but_for_gain(loop) for loop in loops]
    many, known = Counter(alike), dict[Hashable, _StableGains]()
    row = np.full(xs.size, BOUNDARY)
    for i, (loop, kind) in enumerate(zip(loops, alike, strict=True)):
        found = known.get(kind, _StableGains(np.inf, np.inf, np.nan))
        if found.lower < abs(loop.controller.gain) < found.upper:
            row[i] = 0
            continue
        try:
            row[i] = _verdicts(loop, np.array(at[:1]), np.array(at[1:]), found.omega)[0]
            if row[i] == 0 and many[kind] > 1:
                known[kind] = _stable_gains(loop, at)
        except CountError:
            continue
    return row
