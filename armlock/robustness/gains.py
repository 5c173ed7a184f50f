"""The gain factors between which a stable loop stays stable.

A factor takes a root to the imaginary axis where L is real and negative there. Such places are
zeros of Im L, which the certified walk of `armlock.axis.contour` finds, on those parts of the
axis where free phases would allow a factor closer to one than is known.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import elementwise

from armlock.checks import FloatArray
from armlock.loops import Loop, LoopAt
from armlock.robustness.crossovers import axis_zeros
from armlock.robustness.free_phases import (
    arm_weights,
    clear_from,
    free_disc,
    last_crossover,
    limit_disc,
    meeting_intervals,
    no_margin,
    polynomial_sum,
    require_stable,
    search_outwards,
)
from armlock.stability.bounds import last_larger, last_root_bound
from armlock.stability.counts import loop_count

#: Gain factors up to this, and down to one over it, are looked at.
LARGEST_GAIN = 1e6
# So close to the limits of the neutral root chain, as a share, no gain factors are looked for.
_NEXT_TO_THE_CHAIN = 1e-5


def _chain_gains(point: LoopAt) -> tuple[float, float]:
    """Gain factors around one between which the neutral root chain is confined.

    A factor k multiplies the disc of L at high frequency; the chain is confined while that
    stays clear of -1.
    """
    centre, radius = limit_disc(point)
    limits = [-1.0 / end for end in (centre - radius, centre + radius) if end < 0.0]
    lower = max((k for k in limits if k < 1.0), default=0.0)
    return lower, min((k for k in limits if k > 1.0), default=np.inf)


def _no_crossing_from(point: LoopAt, low: float, high: float) -> float:
    """Frequency in rad/s past which no gain factor of a range takes a root across the axis.

    With t = 1 / k from 1 / high to 1 / low, and C = B1 + B2, |t R + C| must exceed
    |c1 B1| + |c2 B2|. Its square is convex in t. If it ascends at the lower end of the
    interval, it is smallest there; if it descends at the upper end, there.
    """
    loop, weights = point.loop, arm_weights(point)
    c = polynomial_sum(loop.b1, loop.b2)
    found = [last_crossover(loop, weights, high)]
    if not loop.delay:
        for t, sign in ((1.0 / high, 1.0), (1.0 / low, -1.0)):
            ascends = math.sqrt(last_root_bound(_ascent(loop.rest, c, t, sign)))
            first = polynomial_sum(t * loop.rest, c)
            found.append(max(ascends, last_larger(first, (loop.b1, loop.b2), weights)))
    return min(found)


def _ascent(rest: FloatArray, c: FloatArray, t: float, sign: float) -> FloatArray:
    """Half the slope of |t R + C|^2 in t, times a sign, in ascending powers of omega^2."""
    whole = polynomial_sum(t * rest, c)
    product = np.convolve(whole, rest * (-1.0) ** np.arange(rest.size))[::2]
    return np.asarray(sign * product * (-1.0) ** np.arange(product.size))


def _gains(point: LoopAt, omega: FloatArray) -> FloatArray:
    """Gain factors that take a root to the axis at frequencies."""
    with np.errstate(divide="ignore"):
        return np.asarray(-1.0 / point.response(omega).real)


def _real_within(point: LoopAt, stretches: FloatArray) -> FloatArray:
    """Where L, from its factors, is real within stretches that may hide it, in rad/s."""

    def imaginary(omega: FloatArray) -> FloatArray:
        return np.asarray(point.response(omega).imag)

    lower, upper = stretches[:-1].ravel(), stretches[1:].ravel()
    changes = imaginary(lower) * imaginary(upper) < 0.0
    return np.asarray(elementwise.find_root(imaginary, (lower[changes], upper[changes])).x)


def _free_gains(point: LoopAt, omega: FloatArray) -> FloatArray:
    """Gain factors next to one, below and above, for some phases; shape (omega, 2).

    They belong to the ends of what the disc of L covers of the negative real axis.
    """
    centre, radius = free_disc(point, omega)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.sqrt(radius**2 - centre.imag**2)
        factors = -1.0 / np.column_stack((centre.real + half, centre.real - half))
    lower = np.where((factors > 0.0) & (factors < 1.0), factors, 0.0).max(axis=1)
    upper = np.where(factors > 1.0, factors, np.inf).min(axis=1)
    return np.column_stack((lower, upper))


def _gains_around_one(point: LoopAt, least: float, most: float) -> tuple[float, float, float]:
    """Gain factors next to one that take a root to the axis, and where the upper one does.

    The frequency is in rad/s; `least`, `most` and nan where there are none between these two.
    """
    loop, weights = point.loop, arm_weights(point)
    crossing = point.numerator().times_conjugate(loop.rest_on_boundary())
    lower, upper, where = least, most, np.nan
    hidden: list[FloatArray] = []

    def end() -> float:
        """Frequency past which no factor between the two takes a root to the axis."""
        clear = max(
            clear_from(loop, weights, -0.5 * (1.0 / k + 1.0), 0.5 * abs(1.0 - 1.0 / k))
            for k in (lower, upper)
        )
        return min(clear, _no_crossing_from(point, lower, upper))

    def meeting(span: tuple[float, float]) -> FloatArray:
        return meeting_intervals(point, span, segment=(-1.0 / upper, -1.0 / lower))

    def likely(omega: FloatArray) -> FloatArray:
        free = _free_gains(point, omega)
        return omega[[np.argmax(free[:, 0]), np.argmin(free[:, 1])]]

    for intervals in search_outwards(loop.omega_per_turn, end, meeting, likely):
        omega, stretches = axis_zeros(crossing, intervals)
        omega = np.concatenate((omega, _real_within(point, stretches)))
        hidden.append(_gains(point, stretches.ravel()))
        factor = _gains(point, omega)
        below = factor[(factor >= lower) & (factor <= 1.0)]
        lower = float(below.max(initial=lower))
        above = np.flatnonzero((factor > 1.0) & (factor <= upper))
        if above.size:
            nearest = above[np.argmin(factor[above])]
            upper, where = float(factor[nearest]), float(omega[nearest])
    hidden_gains = np.concatenate(hidden)
    if ((hidden_gains > lower) & (hidden_gains < upper)).any():
        _require_stable_inside(point, lower, upper)
    return lower, upper, where


def _require_stable_inside(point: LoopAt, lower: float, upper: float) -> None:
    """Raise if a count just inside two gain factors says that the loop is unstable there."""
    loop, c1, c2 = point
    rest = loop.polynomials()[0]
    for factor in (lower * (1.0 + 1e-6), upper * (1.0 - 1e-6)):
        scaled = rest._replace(coefficients=rest.coefficients / factor)
        count = loop_count(loop.plain().replace(rest=scaled), c1, c2)
        if count > 0:
            at = f"the count at {factor} times the gain is {count}"
            raise no_margin(point, f"rounding hides a crossing, for {at}")


def gain_interval(loop: Loop, c1: float = 1.0, c2: float = 1.0) -> tuple[float, float, float]:
    r"""Find the gain factors around one between which a stable loop stays stable.

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float
        Multiplicative perturbations, at which the loop is stable.

    Returns
    -------
    lower, upper, omega : float
        The two factors, and where the upper one is taken, in rad/s: 0 for a real root, inf for
        the limit of the neutral root chain. 0, inf and nan where nothing between factors of
        1e-6 and 1e6 bounds them.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or c1 or c2 is not finite and real, or the loop is not stable
        there.
    CountError
        If gain times delay is too large to follow, or rounding hides what decides.

    Notes
    -----
    With a factor k, and L = N / R, a root is at s = j omega where

    .. math::

        R + k N = 0 , \qquad k = -\frac{1}{L} \text{ is real.}

    The neutral root chain bounds the gain, too. Just inside its limits roots cross at ever
    higher frequency: a factor that lies within 1e-5 of a limit may be given as the limit.

    All sign changes of Im L are found, but for short stretches in which rounding hides its
    sign, at most a part in ten million of the frequency as a rule. There L is looked at in
    three places, from its factors. Where it could give a factor between the two, they are
    refused if a count just inside one of them says that the loop is unstable.

    Examples
    --------
    >>> from armlock import DualArm
    >>> from armlock.robustness.gains import gain_interval
    >>> lower, upper, omega = gain_interval(DualArm(), 1.001, 1.002)
    >>> print(f"{upper:.2f}")
    29.58
    """
    point = LoopAt.of(loop, c1, c2)
    require_stable(point)
    return gain_interval_of_stable(point)


def gain_interval_of_stable(point: LoopAt) -> tuple[float, float, float]:
    """Do what `gain_interval` does for a loop that is known to be stable."""
    floor, limit = _chain_gains(point)
    # Just inside the limits of the chain, roots cross at ever higher frequency.
    least = max(floor * (1.0 + _NEXT_TO_THE_CHAIN), 1.0 / LARGEST_GAIN)
    most = min(limit * (1.0 - _NEXT_TO_THE_CHAIN), LARGEST_GAIN)
    least, most = min(least, 1.0), max(most, 1.0)
    lower, upper, where = _gains_around_one(point, least, most)
    if lower == least:
        lower = floor if floor >= 1.0 / LARGEST_GAIN else 0.0
    if upper == most:
        upper, where = (limit, np.inf) if limit <= LARGEST_GAIN else (np.inf, np.nan)
    # At s = 0, where L is `above` over `below`, a real root crosses.
    _, above, below = point.at_zero()
    at_zero = float(-below / above) if above else np.inf
    if max(lower, 1.0 / LARGEST_GAIN) < at_zero < 1.0:
        lower = at_zero
    elif 1.0 < at_zero < min(upper, LARGEST_GAIN):
        upper, where = at_zero, 0.0
    return lower, upper, where


__all__ = [
    "LARGEST_GAIN",
    "gain_interval",
]
