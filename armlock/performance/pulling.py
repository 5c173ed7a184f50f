"""How far errors of the Doppler estimates pull the locked laser, over days.

The loop takes an error in the estimated Doppler shift of an arm for a frequency error of the
laser. Its gain at zero frequency is finite, and so the laser follows, slowly. The response is
computed as an inverse Laplace transform.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, axis, positive_array
from armlock.loops import Loop
from armlock.performance.transfer import require_stable, responses

#: Errors of the sum and of the difference of the two arms: nu0, gamma and alpha of each.
Errors = tuple[FloatArray, FloatArray]

# Times of which half and one in eight more are kept: a series that begins at zero.
_SAMPLES = 1 << 20
# The response one period later comes in weakened by exp(-26) = 5e-12. As half of these powers
# of e multiply rounding errors, there are no more.
_DAMPED = 26.0
# Standard deviation, in samples, of the Gaussian that rounds off what is faster.
_SMOOTHED = 3.0
# A series of duration T gives the times from T / 8 to T, to 5e-5 of themselves. Durations are
# powers of 8 s, so that a time has its series whatever other times are asked for.
_RATIO_BITS = 3
# Rounding errors of the response and its transform, relative to the sum of all frequencies.
_ROUNDING = 1e-14
# `largest_pulling` searches these times, from 1 s to twenty days.
_EARLIEST, _LATEST = 1.0, 1728e3


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

    Warns
    -----
    UserWarning
        If the response has decayed below rounding errors at some of the times. Its values there
        are nan.

    Notes
    -----
    The transform is inverted on a line :math:`s = \sigma + \mathrm{j}\omega` to the right of
    all roots, as a sum over equal steps of :math:`\omega`. The result is not certified. Changes
    within less than 5e-5 of the time are smoothed, such as the echo of an undelayed part. A
    value does not depend on the other times that are asked for.

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
    found = np.empty(t.shape)
    # The least power of two that is larger than the time.
    series = -(-np.frexp(t)[1] // _RATIO_BITS)
    for k in np.unique(series):
        asked = series == k
        at, frequency, ends = _series(loop, 2.0 ** (_RATIO_BITS * int(k)), errors)
        found[asked] = np.where(t[asked] > ends, np.nan, np.interp(t[asked], at, frequency))
    if np.isnan(found).any():
        warnings.warn(
            f"the response has decayed below rounding errors at time = "
            f"{t[np.isnan(found)].min():g} s and is nan there", stacklevel=2,
        )  # fmt: skip
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
        The highest sample of series that resolve 2e-6 to 2e-5 of the time. It is not
        certified.
    """
    require_stable(loop)
    errors = _error("common", common), _error("differential", differential)
    peaks = []
    duration = _EARLIEST
    while duration < _LATEST:
        begin, duration = duration, min(duration * 2.0**_RATIO_BITS, _LATEST)
        time, frequency, _ = _series(loop, begin * 2.0**_RATIO_BITS, errors)
        sizes = np.where((time < begin) | (time > duration), 0.0, np.abs(frequency))
        best = int(np.argmax(sizes))
        peaks.append(Peak(float(sizes[best]), float(time[best])))
    return max(peaks)


def _error(name: str, values: Sequence[float]) -> FloatArray:
    """Return nu0, gamma and alpha, or raise."""
    error = axis(name, values)
    if error.size != 3:
        raise ValueError(f"{name} must hold nu0, gamma and alpha, got {error.size} numbers")
    return error


@np.errstate(all="ignore")
def _series(
    loop: Loop, duration: float, errors: Errors
) -> tuple[FloatArray, FloatArray, float]:
    """Return times from zero to past a duration, the frequency of the laser, and a time.

    After this time the frequency is smaller than rounding errors.
    """
    step = 2.0 * duration / _SAMPLES
    shift = _DAMPED / (2.0 * duration)
    omega = 2.0 * np.pi * np.fft.rfftfreq(_SAMPLES, step)
    s = shift + 1j * omega
    found = responses(loop, s, ("common", "differential"))
    total = np.zeros(s.shape, dtype=np.complex128)
    for source, (nu0, gamma, alpha) in zip(("common", "differential"), errors, strict=True):
        total += found[source] * (nu0 / s + gamma / s**2 + alpha / s**3)
    if not np.isfinite(total).all():
        raise ValueError(
            f"time must not be so short or long that its third power overflows, got times next "
            f"to {duration:g} s"
        )
    total *= np.exp(-0.5 * (omega * _SMOOTHED * step) ** 2)
    time: FloatArray = step * np.arange(9 * _SAMPLES // 16, dtype=np.float64)
    growth = np.exp(shift * time)
    frequency = np.fft.irfft(total, _SAMPLES)[: time.size] / step * growth
    rounding = _ROUNDING * np.abs(total).sum() / (_SAMPLES * step) * growth
    above = np.flatnonzero(np.abs(frequency) >= rounding)
    return time, np.asarray(frequency), float(time[above[-1]])
