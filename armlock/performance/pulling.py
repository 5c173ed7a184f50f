"""How far errors of the Doppler estimates pull the locked laser, over days.

An error in the estimated Doppler shift of an arm is a frequency that the loop takes for the
laser's own. Suppression at zero frequency is finite, and so the laser follows, slowly.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from armlock.checks import ComplexArray, FloatArray, axis, positive_array
from armlock.loops import Loop, checked_loop
from armlock.performance.transfer import transfer
from armlock.stability.counts import BOUNDARY, UNCONFINED, CountError, unstable_roots

# Multiples of 2 pi / tau, in rad/s, up to which roots are taken.
_LINES = 600
# Points on the circle around s = 0 from which the Laurent coefficients there are taken.
_CIRCLE = 64
# Highest order of a pole at s = 0.
_ORDER = 8


def pulling(
    loop: Loop,
    time: npt.ArrayLike,
    common: Sequence[float] = (1.0, 0.0, 0.0),
    differential: Sequence[float] = (0.0, 0.0, 0.0),
) -> FloatArray:
    r"""Compute how a stable loop's laser follows Doppler errors that begin at time zero.

    .. math::

        \nu(t) &= y_+ * \nu_+ + y_- * \nu_- , \\
        \nu_\pm(t) &= \nu_0 + \gamma t + \tfrac12 \alpha t^2 \quad (t \ge 0)

    with the responses :math:`Y_\pm` of `armlock.performance.transfer` to the sum :math:`\nu_+`
    and the difference :math:`\nu_-` of the two arms' errors.

    Parameters
    ----------
    loop : Loop
        The loop, stable at c1 = c2 = 1, or with roots at s = 0 only besides stable ones.
    time : array_like of float
        In s, positive, any shape.
    common, differential : sequence of three floats, optional
        nu0 in Hz, gamma in Hz/s and alpha in Hz/s^2 of the sum and of the difference of the two
        arms' errors. An error of arm 1 alone is the same in both.

    Returns
    -------
    float array, shaped like `time`
        Frequency of the locked laser in Hz, without what it would do unlocked.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop` or unstable, a time is not positive, or an error does not hold
        three finite numbers.

    Notes
    -----
    It adds up residues at the roots of `slow_roots`, which tells how far these are certified
    to be all: what is left out decays faster than its `rate`. Another way, which shares nothing
    with this one but the transfer function, is Talbot's: `mpmath.invertlaplace` of
    `transfer(loop, "common", s) / s`. It leaves out what the arms' echoes add beyond some 8/t.

    Examples
    --------
    >>> from armlock import flight_loop, pulling
    >>> day = 86400.0
    >>> print(f"{pulling(flight_loop(), 4 * day, common=(1e3, 0.0, 0.0)) / 1e6:.3f} MHz")
    0.074 MHz
    """
    checked_loop(loop)
    t = positive_array("time", time)
    count = int(unstable_roots(loop, 1.0, 1.0))
    if count not in (0, BOUNDARY):
        chain = "a neutral root chain that is not confined"
        found = chain if count == UNCONFINED else f"{count} unstable roots"
        raise ValueError(f"loop must be stable at c1 = c2 = 1, got {found}")
    total = np.zeros(t.shape)
    given = {"common": common, "differential": differential}
    errors = {source: _error(source, values) for source, values in given.items()}
    for source, error in errors.items():
        if error.any():
            total += _residues(loop, t, source, error)
    return total


def _error(name: str, values: Sequence[float]) -> FloatArray:
    """Return nu0, gamma and alpha, or raise."""
    error = axis(name, values)
    if error.size != 3:
        raise ValueError(f"{name} must hold nu0, gamma and alpha, got {error.size} numbers")
    return error


def slow_roots(loop: Loop) -> tuple[ComplexArray, float]:
    """Find the roots up to a multiple of 2 pi / tau, and count whether they are complete.

    Parameters
    ----------
    loop : Loop
        The loop, at c1 = c2 = 1.

    Returns
    -------
    roots : complex array, shape (n,)
        In rad/s, ascending in magnitude, of pairs those with Im s > 0; without those at s = 0.
    rate : float
        No other root has Re s > -rate, in rad/s: a certified count. 0 if that is not known.

    Examples
    --------
    >>> from armlock import flight_loop
    >>> from armlock.performance.pulling import slow_roots
    >>> roots, rate = slow_roots(flight_loop())
    >>> print(f"{len(roots)} roots, all that decay slower than in {1 / rate:.0f} s")
    572 roots, all that decay slower than in 2716 s
    """
    roots = _found(checked_loop(loop))
    return roots, _complete_up_to(loop, roots)


@lru_cache(maxsize=16)
def _found(loop: Loop) -> ComplexArray:
    """Find roots up to `_LINES` times 2 pi / tau, by Newton's method from many points.

    Slow ones may be anywhere; the others lie near multiples of 2 pi / tau.
    """
    tau = loop.longest_delay
    slow = np.outer(np.geomspace(1e-6, 4.0, 60) / tau, np.exp(1j * np.linspace(1.6, np.pi, 8)))
    lines = 2j * np.pi / tau * np.arange(0.75, _LINES, 0.25)
    found, last_step = _newton(loop, np.concatenate((slow.ravel(), lines)))
    found = found[(last_step < 1e-9) & (found.real < 0.0) & (np.abs(found) > 1e-7 / tau)]
    found = np.where(np.abs(found.imag) < 1e-9 * np.abs(found), found.real, found)
    found = found.real + 1j * np.abs(found.imag)
    kept: list[complex] = []
    for root in found[np.argsort(np.abs(found))]:
        if all(abs(root - other) > 1e-7 * abs(root) for other in kept):
            kept.append(complex(root))
    return np.array(kept, dtype=np.complex128)


def _complete_up_to(loop: Loop, roots: ComplexArray) -> float:
    """Return the rate up to which a certified count finds no other roots, or 0."""
    circle = loop(_circle(loop, roots), 1.0, 1.0)
    at_zero = round(np.angle(np.roll(circle, -1) / circle).sum() / (2.0 * np.pi))
    decays = np.unique(-roots.real)
    rates = np.sqrt(decays[:-1] * decays[1:])
    # Of faster ones there are too many, far up the axis.
    rates = rates[rates < 0.02 / loop.longest_delay]

    def incomplete(rate: float) -> bool:
        """Say whether other roots have Re s > -rate, or no count is certain."""
        slower = roots[-roots.real < rate]
        expected = at_zero + np.where(slower.imag > 0.0, 2, 1).sum()
        try:
            return bool(unstable_roots(loop.shifted(-rate), 1.0, 1.0) != expected)
        except CountError:
            return True

    first = bisect_left(rates, True, key=incomplete)
    return float(rates[first - 1]) if first else 0.0


def _circle(loop: Loop, roots: ComplexArray) -> ComplexArray:
    """Return points around s = 0, inside of the smallest root."""
    radius = 0.3 * float(np.abs(roots).min(initial=1e-3 / loop.longest_delay))
    return np.asarray(radius * np.exp(2j * np.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE))


def _slope(loop: Loop, s: ComplexArray) -> ComplexArray:
    """Return dL/ds as a central difference."""
    near = 1e-5 * np.minimum(np.abs(s), 1.0 / loop.longest_delay)
    return (loop.open_loop(s + near) - loop.open_loop(s - near)) / (2.0 * near)


def _newton(loop: Loop, s: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Follow 1 + L to zeros; return them, and the last steps' relative lengths."""
    tau = loop.longest_delay
    with np.errstate(all="ignore"):
        for _ in range(50):
            step = (1.0 + loop.open_loop(s)) / _slope(loop, s)
            longest = 0.05 * np.minimum(np.abs(s), 1.0 / tau)
            moved = s - step * np.minimum(1.0, longest / np.abs(step))
            # Where the method has gone astray, 1 + L is no number.
            s = np.where(np.isfinite(moved), moved, s)
    return s, np.abs(step / s)


def _input(error: FloatArray, s: ComplexArray) -> ComplexArray:
    """Return the Laplace transform of nu0 + gamma t + alpha t^2 / 2."""
    return np.asarray(error[0] / s + error[1] / s**2 + error[2] / s**3)


def _residues(loop: Loop, t: FloatArray, source: str, error: FloatArray) -> FloatArray:
    """Add up the residues of Y(s) nu(s) exp(s t) at s = 0 and at the loop's own roots."""
    roots = _found(loop)
    first, second = loop.arm_responses(roots)
    over = 0.5 * (first + second if source == "common" else first - second)
    residue = -over / _slope(loop, roots) * _input(error, roots)
    # Laurent coefficients at s = 0.
    circle = _circle(loop, roots)
    radius = abs(circle[0])
    around = transfer(loop, source, circle) * _input(error, circle)
    laurent = np.array([(around * circle**k).mean().real for k in range(1, _ORDER + 1)])
    size = np.abs(around).max() * radius ** np.arange(1, _ORDER + 1)
    laurent[np.abs(laurent) < 1e-10 * size] = 0.0
    total = sum(c * t**k / math.factorial(k) for k, c in enumerate(laurent))
    pairs = np.where(roots.imag > 0.0, 2.0, 1.0) * residue
    decays = np.exp(t[..., None] * roots)
    return np.asarray(total + (decays @ pairs).real)
