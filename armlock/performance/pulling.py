"""How far errors of the Doppler estimates pull the locked laser, over days.

An error in the estimated Doppler shift of an arm is a frequency that the loop takes for the
laser's own. Suppression at zero frequency is finite, and so the laser follows, slowly.

`pulling` adds up residues and certifies them, so it refuses times at which the arms' echoes
still count. `pulled_series` is an inverse Laplace transform. It holds for all times and for
neutral loops, and is not certified.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

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
# Times at which a series is computed; half of them are kept.
_SAMPLES = 1 << 20
# By so many factors of e what comes around from the period before is weakened in it.
_DAMPED = 20.0
# So many samples are the standard deviation of its Gaussian.
_SMOOTHED = 3.0
# The largest pulling is looked for from so many s on, over ten round trips, an hour, 20 days.
_EARLIEST, _SPANS = 1.0, (10.0, 3600.0, 1728e3)


class Peak(NamedTuple):
    """The largest pulling: its size in Hz, how many s after the error began, and its standing.

    `certified` tells whether the size is that of `pulling` at this time. That no other time has
    a larger one comes from samples, and is never certified.
    """

    size: float
    time: float
    certified: bool


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
    confirms. What is left out decays faster, by 1e4 or more up to the earliest time. For times
    soon after the error begins there is `pulled_series`.

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
    # In steps, so that roots are found once for times that differ little.
    rate = 2.0 ** (0.25 * math.ceil(4.0 * math.log2(_DECAYED / float(t.min(initial=np.inf)))))
    total = np.zeros(t.shape)
    given = {"common": common, "differential": differential}
    errors = {source: _error(source, values) for source, values in given.items()}
    for source, error in errors.items():
        if error.any():
            roots = slow_roots(loop, rate)
            # No root that is not among them lies closer to s = 0.
            nearest = float(np.abs(roots).min(initial=rate))
            total += _residues(loop, t, roots, nearest, source, error)
    return total


def pulled_series(
    loop: Loop, source: str, duration: float, error: Sequence[float] = (1.0, 0.0, 0.0)
) -> tuple[FloatArray, FloatArray]:
    r"""Compute the laser's answer to an error from its beginning on, as a series.

    By the inverse Laplace transform along a line :math:`s = \sigma + j\omega` to the right of
    all roots, as a sum over equal steps of :math:`\omega`,

    .. math::

        \nu(t) = \frac{e^{\sigma t}}{2\pi} \int Y(s)
        \left( \frac{\nu_0}{s} + \frac{\gamma}{s^2} + \frac{\alpha}{s^3} \right)
        e^{j\omega t}\, \mathrm{d}\omega .

    Parameters
    ----------
    loop : Loop
        The loop, stable at c1 = c2 = 1, which is not checked. It may be neutral.
    source : {"common", "differential"}
        Whether the sum or the difference of the two arms' errors is meant.
    duration : float
        In s.
    error : sequence of three floats, optional
        nu0 in Hz, gamma in Hz/s and alpha in Hz/s^2.

    Returns
    -------
    time, frequency : float arrays, shape (524288,)
        In s, from zero on, and in Hz.

    Notes
    -----
    Not certified. It errs in two ways. A Gaussian of three samples, six millionths of the
    duration, rounds off what is faster. What the answer does at t + 2 duration comes in
    weakened by exp(-20) = 2e-9.
    """
    step = 2.0 * positive_number("duration", duration) / _SAMPLES
    shift = _DAMPED / (2.0 * duration)
    omega = 2.0 * np.pi * np.fft.rfftfreq(_SAMPLES, step)
    s = np.asarray(shift + 1j * omega, dtype=np.complex128)
    smooth = np.exp(-0.5 * (omega * _SMOOTHED * step) ** 2)
    over = transfer(loop, source, s) * _input(_error("error", error), s) * smooth
    time: FloatArray = step * np.arange(_SAMPLES // 2, dtype=np.float64)
    found = np.fft.irfft(over, _SAMPLES)[: time.size] / step
    return time, np.asarray(found * np.exp(shift * time), np.float64)


def largest_pulling(loop: Loop, source: str, error: Sequence[float] = (1.0, 0.0, 0.0)) -> Peak:
    """Find the largest pulling between one second and twenty days after an error begins.

    Parameters
    ----------
    loop, source, error
        As for `pulled_series`.

    Returns
    -------
    Peak
        The highest sample of three series. They resolve less than a millisecond over the first
        ten round trips, 20 ms over an hour, and 10 s later. At a time at which `pulling`
        certifies its sum the size is taken from there.
    """
    spans = _SPANS[0] * checked_loop(loop).longest_delay, *_SPANS[1:]
    size, at = 0.0, _EARLIEST
    for span in spans:
        time, frequency = pulled_series(loop, source, max(span, 2.0 * _EARLIEST), error)
        sizes = np.where(time < _EARLIEST, 0.0, np.abs(frequency))
        best = int(np.argmax(sizes))
        size, at = max((size, at), (float(sizes[best]), float(time[best])))
    none = (0.0, 0.0, 0.0)
    both = (error, none) if source == "common" else (none, error)
    try:
        return Peak(abs(float(pulling(loop, at, *both))), at, True)
    except CountError:
        return Peak(size, at, False)


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
    4
    """
    checked_loop(loop)
    last = RootError("", 0.0)
    for line in -positive_number("rate", rate) * _ASIDE ** np.arange(2.0):
        try:
            return roots_right_of(loop, 1.0, 1.0, float(line))
        except RootError as error:
            last = error
    raise CountError(
        f"no pulling from {_DECAYED / rate:.3g} s on: {last}", np.array([[1.0, 1.0]])
    )


def _circle(nearest: float) -> ComplexArray:
    """Return points around s = 0, inside of the nearest root."""
    radius = 0.3 * nearest
    return np.asarray(radius * np.exp(2j * np.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE))


def _slope(loop: Loop, s: ComplexArray) -> ComplexArray:
    """Return dL/ds at roots of the loop: there D / R = 1 + L is zero, and so is D."""
    rest, _ = loop.polynomials()[0].evaluated(s)
    return np.asarray(loop.derivative(s) / rest)


def _input(error: FloatArray, s: ComplexArray) -> ComplexArray:
    """Return the Laplace transform of nu0 + gamma t + alpha t^2 / 2."""
    return np.asarray(error[0] / s + error[1] / s**2 + error[2] / s**3)


def _residues(
    loop: Loop,
    t: FloatArray,
    roots: ComplexArray,
    nearest: float,
    source: str,
    error: FloatArray,
) -> FloatArray:
    """Add up the residues of Y(s) nu(s) exp(s t) at s = 0 and at the loop's own roots."""
    first, second = loop.arm_responses(roots)
    over = 0.5 * (first + second if source == "common" else first - second)
    residue = -over / _slope(loop, roots) * _input(error, roots)
    # Laurent coefficients at s = 0.
    circle = _circle(nearest)
    radius = abs(circle[0])
    around = transfer(loop, source, circle) * _input(error, circle)
    laurent = np.array([(around * circle**k).mean().real for k in range(1, _ORDER + 1)])
    size = np.abs(around).max() * radius ** np.arange(1, _ORDER + 1)
    laurent[np.abs(laurent) < 1e-10 * size] = 0.0
    total = sum(c * t**k / math.factorial(k) for k, c in enumerate(laurent))
    pairs = np.where(roots.imag > 0.0, 2.0, 1.0) * residue
    decays = np.exp(t[..., None] * roots)
    return np.asarray(total + (decays @ pairs).real)
