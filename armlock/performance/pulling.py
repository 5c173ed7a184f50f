"""How far errors of the Doppler estimates pull the locked laser, over days.

An error in the estimated Doppler shift of an arm is a frequency that the loop takes for the
laser's own. Suppression at zero frequency is finite, and so the laser follows, slowly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from armlock.checks import ComplexArray, FloatArray, axis, positive_array, positive_number
from armlock.loops import Loop, checked_loop
from armlock.performance.transfer import transfer
from armlock.stability.counts import UNCONFINED, CountError, loop_count
from armlock.stability.roots import RootError, roots_right_of

# What is left out has decayed by so many powers of e at the earliest time: to 1e-4.
_DECAYED = math.log(1e4)
# So much further left a line is tried once more, where a root lies on the first.
_ASIDE = 1.03
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
    CountError
        If roots that decay slower than 9.2 over the earliest time cannot all be found: there
        are too many, as soon after the error begins, or of a neutral loop whose echoes decay
        slower.

    Notes
    -----
    It adds up residues at s = 0 and at all roots that `slow_roots` finds and a certified count
    confirms. What is left out decays faster, by 1e4 or more up to the earliest time. Soon after
    the error begins nothing is left out but by other ways. One that shares nothing with this
    one but the transfer function is Talbot's: `mpmath.invertlaplace` of
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
    count = loop_count(loop, 1.0, 1.0)
    if count != 0:
        chain = "a neutral root chain that is not confined"
        found = chain if count == UNCONFINED else f"{count} unstable roots"
        raise ValueError(f"loop must be stable at c1 = c2 = 1, got {found}")
    rate, total = _DECAYED / float(t.min(initial=np.inf)), np.zeros(t.shape)
    given = {"common": common, "differential": differential}
    errors = {source: _error(source, values) for source, values in given.items()}
    for source, error in errors.items():
        if error.any():
            total += _residues(loop, t, rate, source, error)
    return total


def _error(name: str, values: Sequence[float]) -> FloatArray:
    """Return nu0, gamma and alpha, or raise."""
    error = axis(name, values)
    if error.size != 3:
        raise ValueError(f"{name} must hold nu0, gamma and alpha, got {error.size} numbers")
    return error


@lru_cache(maxsize=16)
def slow_roots(loop: Loop, rate: float) -> ComplexArray:
    """Find all roots of a loop that decay slower than a rate, as many as a count says.

    Parameters
    ----------
    loop : Loop
        The loop, at c1 = c2 = 1.
    rate : float
        In rad/s.

    Returns
    -------
    complex array, shape (n,)
        With Re s > -rate, in rad/s, ascending in magnitude, of pairs those with Im s > 0;
        without those at s = 0.

    Raises
    ------
    CountError
        If they cannot all be found.

    Examples
    --------
    >>> from armlock import flight_loop
    >>> from armlock.performance.pulling import slow_roots
    >>> len(slow_roots(flight_loop(), 1e-4))
    9
    """
    checked_loop(loop)
    last = RootError("", 0.0)
    for line in -positive_number("rate", rate) * _ASIDE ** np.arange(2.0):
        try:
            return roots_right_of(loop, 1.0, 1.0, float(line))
        except RootError as error:
            last = error
    raise CountError(f"no pulling from {_DECAYED / rate:.3g} s on: {last}", np.array([[1.0, 1.0]]))


def _circle(roots: ComplexArray, rate: float) -> ComplexArray:
    """Return points around s = 0, inside of the smallest root."""
    radius = 0.3 * float(np.abs(roots).min(initial=rate))
    return np.asarray(radius * np.exp(2j * np.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE))


def _slope(loop: Loop, s: ComplexArray) -> ComplexArray:
    """Return dL/ds at roots of the loop: there D / R = 1 + L is zero, and so is D."""
    rest, _ = loop.polynomials()[0].with_slope(s)
    return np.asarray(loop.derivative(s) / rest)


def _input(error: FloatArray, s: ComplexArray) -> ComplexArray:
    """Return the Laplace transform of nu0 + gamma t + alpha t^2 / 2."""
    return np.asarray(error[0] / s + error[1] / s**2 + error[2] / s**3)


def _residues(
    loop: Loop, t: FloatArray, rate: float, source: str, error: FloatArray
) -> FloatArray:
    """Add up the residues of Y(s) nu(s) exp(s t) at s = 0 and at the loop's own roots."""
    roots = slow_roots(loop, rate)
    first, second = loop.arm_responses(roots)
    over = 0.5 * (first + second if source == "common" else first - second)
    residue = -over / _slope(loop, roots) * _input(error, roots)
    # Laurent coefficients at s = 0.
    circle = _circle(roots, rate)
    radius = abs(circle[0])
    around = transfer(loop, source, circle) * _input(error, circle)
    laurent = np.array([(around * circle**k).mean().real for k in range(1, _ORDER + 1)])
    size = np.abs(around).max() * radius ** np.arange(1, _ORDER + 1)
    laurent[np.abs(laurent) < 1e-10 * size] = 0.0
    total = sum(c * t**k / math.factorial(k) for k, c in enumerate(laurent))
    pairs = np.where(roots.imag > 0.0, 2.0, 1.0) * residue
    decays = np.exp(t[..., None] * roots)
    return np.asarray(total + (decays @ pairs).real)
