"""How far errors of the Doppler estimates pull the locked laser, over days.

The loop takes an error in the estimated Doppler shift of an arm for a frequency error of the
laser. Its gain at zero frequency is finite, and so the laser follows, slowly. The response is
computed as an inverse Laplace transform.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, axis, positive_array
from armlock.loops import Loop
from armlock.performance.transfer import require_stable, responses

#: Errors of the sum and of the difference of the two arms: nu0, gamma and alpha of each.
Errors = tuple[FloatArray, FloatArray]

# Times at which a series is computed; the first half of them is kept.
_SAMPLES = 1 << 20
# The response one period later comes in weakened by exp(-20) = 2e-9.
_DAMPED = 20.0
# Standard deviation, in samples, of the Gaussian that rounds off what is faster.
_SMOOTHED = 3.0
# A series of duration T gives the times from T / 64 to T, to 4e-4 of themselves.
_RATIO = 64.0
# `largest_pulling` searches these times, from 1 s to twenty days.
_EARLIEST, _ROUND_TRIPS, _SPANS = 1.0, 10.0, (3600.0, 1728e3)


class Peak(NamedTuple):
    """The largest pulling: its size in Hz, and how many s after the error began it occurs."""

    size: float
    time: float


def pulling(
    loop: Loop,
    time: npt.ArrayLike,
    *,
    common: Sequence[float] = (1.0, 0.0, 0.0),
    differential: Sequence[float] = (0.0, 0.0, 0.0),
) -> FloatArray:
    r"""Compute how the locked laser follows Doppler errors that begin at time zero.

    .. math::

        \nu(t) &= y_+ * \nu_+ + y_- * \nu_- , \\
        \nu_\pm(t) &= \nu_0 + \gamma t + \tfrac12 \alpha t^2 \quad (t \ge 0)

    with the responses :math:`Y_\pm` of `armlock.transfer` to the sum :math:`\nu_+` and the
    difference :math:`\nu_-` of the two arms' errors.

    Parameters
    ----------
    loop : Loop
        The loop, stable at c1 = c2 = 1.
    time : array_like of float
        In s, positive, any shape.
    common, differential : sequence of three floats, optional
        nu0 in Hz, gamma in Hz/s and alpha in Hz/s^2 of the sum and of the difference of the two
        arms' errors. An error of arm 1 alone is the same in both.

    Returns
    -------
    float array, shaped like `time`
        Frequency of the locked laser in Hz, without the noise of the laser.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop` or not stable, a time is not positive, or an error does not hold
        three finite numbers.

    Notes
    -----
    The transform is inverted on a line :math:`s = \sigma + \mathrm{j}\omega` to the right of
    all roots, as a sum over equal steps of :math:`\omega`. The result is not certified. Changes
    within less than 4e-4 of the time are smoothed, such as the echo of an undelayed part. Of
    an error that grows like :math:`t^2`, up to 5e-3 of the result may depend on the latest time
    that is asked for.

    Examples
    --------
    >>> from armlock import flight_loop, pulling
    >>> day = 86400.0
    >>> print(f"{pulling(flight_loop(), 4 * day, common=(1e3, 0.0, 0.0)) / 1e6:.3f} MHz")
    0.074 MHz
    """
    require_stable(loop)
    t = positive_array("time", time)
    errors = _error("common", common), _error("differential", differential)
    found, last = np.empty(t.shape), float(t.max(initial=0.0))
    step = np.floor(np.log(last / t) / np.log(_RATIO))
    for k in np.unique(step):
        at, frequency = _series(loop, last / _RATIO**k, errors)
        found[step == k] = np.interp(t[step == k], at, frequency)
    return found


def largest_pulling(
    loop: Loop,
    *,
    common: Sequence[float] = (0.0, 0.0, 0.0),
    differential: Sequence[float] = (0.0, 0.0, 0.0),
) -> Peak:
    """Find the largest pulling between one second and twenty days after an error begins.

    Parameters
    ----------
    loop, common, differential
        As for `pulling`; without an error by default.

    Returns
    -------
    Peak
        The highest sample of three series, which resolve 1 ms over the first ten round trips,
        20 ms over an hour, and 10 s later. It is not certified.
    """
    require_stable(loop)
    errors = _error("common", common), _error("differential", differential)
    size, at = 0.0, _EARLIEST
    for span in (max(_ROUND_TRIPS * loop.longest_delay, 2.0 * _EARLIEST), *_SPANS):
        time, frequency = _series(loop, span, errors)
        sizes = np.where(time < _EARLIEST, 0.0, np.abs(frequency))
        best = int(np.argmax(sizes))
        size, at = max((size, at), (float(sizes[best]), float(time[best])))
    return Peak(size, at)


def _error(name: str, values: Sequence[float]) -> FloatArray:
    """Return nu0, gamma and alpha, or raise."""
    error = axis(name, values)
    if error.size != 3:
        raise ValueError(f"{name} must hold nu0, gamma and alpha, got {error.size} numbers")
    return error


def _series(loop: Loop, duration: float, errors: Errors) -> tuple[FloatArray, FloatArray]:
    """Return times, beginning with zero, and the frequency of the laser at these times."""
    step = 2.0 * duration / _SAMPLES
    shift = _DAMPED / (2.0 * duration)
    omega = 2.0 * np.pi * np.fft.rfftfreq(_SAMPLES, step)
    s = shift + 1j * omega
    found = responses(loop, s)
    total = np.zeros(s.shape, dtype=np.complex128)
    for source, (nu0, gamma, alpha) in zip(("common", "differential"), errors, strict=True):
        total += found[source] * (nu0 / s + gamma / s**2 + alpha / s**3)
    total *= np.exp(-0.5 * (omega * _SMOOTHED * step) ** 2)
    time: FloatArray = step * np.arange(_SAMPLES // 2, dtype=np.float64)
    frequency = np.fft.irfft(total, _SAMPLES)[: time.size] / step
    return time, np.asarray(frequency * np.exp(shift * time))
