"""How far errors of the Doppler estimates pull the locked laser, over days.

The loop takes an error in the estimated Doppler shift of an arm for a frequency error of the
laser. Its gain at zero frequency is finite, and so the laser follows, slowly. The response is
computed as an inverse Laplace transform.
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.checks import ComplexArray, FloatArray, finite_series, positive_array
from armlock.loops import Loop
from armlock.performance.transfer import require_stable_loop

_SOURCES = "common", "differential"
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
    """The largest pulling: its size in Hz, and how many s after the error began it occurs.

    Two floats, or two arrays for several errors.
    """

    size: Any
    time: Any


def pulling(
    loop: Loop,
    time: npt.ArrayLike,
    *,
    common: npt.ArrayLike = (1.0, 0.0, 0.0),
    differential: npt.ArrayLike = (0.0, 0.0, 0.0),
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
    common, differential : array_like of float, shape (3,) or (n, 3), optional
        nu0 in Hz, gamma in Hz/s and alpha in Hz/s^2 of the sum and of the difference of the two
        arms' errors. An error of arm 1 alone is the same in both. Several errors, one in each
        row, take hardly longer than one.

    Returns
    -------
    float array, shaped like `time`, or (n, ...) for several errors
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
    require_stable_loop(loop)
    t = positive_array("time", time)
    errors = _errors(common, differential)
    found = np.empty((*errors.shape[:-2], *t.shape))
    # The least power of two that is larger than the time.
    series = -(-np.frexp(t)[1] // _RATIO_BITS)
    for k in np.unique(series):
        asked = series == k
        response = _Response(loop, 2.0 ** (_RATIO_BITS * int(k)))
        for error in np.ndindex(errors.shape[:-2]):
            frequency, ends = response.to(errors[error])
            value = np.interp(t[asked], response.time, frequency)
            found[(*error, asked)] = np.where(t[asked] > ends, np.nan, value)
    gone = np.isnan(found).any(axis=tuple(range(errors.ndim - 2)))
    if gone.any():
        warnings.warn(
            f"the response has decayed below rounding errors at time = {t[gone].min():g} s and "
            "is nan there", stacklevel=2,
        )  # fmt: skip
    return found


def largest_pulling(
    loop: Loop,
    *,
    common: npt.ArrayLike = (0.0, 0.0, 0.0),
    differential: npt.ArrayLike = (0.0, 0.0, 0.0),
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
    require_stable_loop(loop)
    errors = _errors(common, differential)
    size, at = np.zeros(errors.shape[:-2]), np.zeros(errors.shape[:-2])
    duration = _EARLIEST
    while duration < _LATEST:
        begin, duration = duration, min(duration * 2.0**_RATIO_BITS, _LATEST)
        response = _Response(loop, begin * 2.0**_RATIO_BITS)
        outside = (response.time < begin) | (response.time > duration)
        for error in np.ndindex(size.shape):
            frequency = np.where(outside, 0.0, np.abs(response.to(errors[error])[0]))
            best = int(np.argmax(frequency))
            if frequency[best] > size[error]:
                size[error], at[error] = frequency[best], response.time[best]
    return Peak(*((size, at) if size.ndim else (float(size), float(at))))


def _errors(common: npt.ArrayLike, differential: npt.ArrayLike) -> FloatArray:
    """Return nu0, gamma and alpha of both, shape (2, 3) or (n, 2, 3), or raise."""
    found = (
        finite_series("common", common, 1, 2),
        finite_series("differential", differential, 1, 2),
    )
    for name, error in zip(_SOURCES, found, strict=True):
        if error.shape[-1] != 3:
            raise ValueError(
                f"{name} must hold nu0, gamma and alpha, or rows of them, got shape "
                f"{error.shape}"
            )
    return np.stack(np.broadcast_arrays(*found), axis=-2)


class _Response:
    """The responses of a loop to both errors, from time zero to past a duration."""

    @np.errstate(all="ignore")
    def __init__(self, loop: Loop, duration: float) -> None:
        self.paths, self.duration = loop.paths, duration
        self.step, self.shift = 2.0 * duration / _SAMPLES, _DAMPED / (2.0 * duration)
        self.time: FloatArray = self.step * np.arange(9 * _SAMPLES // 16, dtype=np.float64)
        self.growth = np.exp(self.shift * self.time)
        omega = 2.0 * np.pi * np.fft.rfftfreq(_SAMPLES, self.step)
        self.s = self.shift + 1j * omega
        self._require_finite(self.s[[0, -1]] ** -3)
        smooth = np.exp(-0.5 * (omega * _SMOOTHED * self.step) ** 2)
        # The closed loop is one system too, but takes more bits where the arms cancel.
        self.closed = -smooth / (1.0 + loop(self.s))
        self.found: dict[str, ComplexArray] = {}

    def of(self, source: str) -> ComplexArray:
        """Return the response to one of the errors, which is computed when it is asked for."""
        if source not in self.found:
            self.found[source] = self.closed * self.paths[source](self.s)
        return self.found[source]

    @np.errstate(all="ignore")
    def to(self, errors: FloatArray) -> tuple[FloatArray, float]:
        """Return the frequency of the laser, and after which time it is below rounding."""
        total = np.zeros(self.s.shape, dtype=np.complex128)
        for source, error in zip(_SOURCES, errors.tolist(), strict=True):
            # Few errors hold all three terms, and each takes as long as the transform.
            terms = [x / self.s**k for k, x in enumerate(error, 1) if x]
            if terms:
                total += self.of(source) * sum(terms)
        self._require_finite(total)
        frequency = np.fft.irfft(total, _SAMPLES)[: self.time.size] / self.step * self.growth
        rounding = _ROUNDING * np.abs(total).sum() / (_SAMPLES * self.step) * self.growth
        above = np.flatnonzero(np.abs(frequency) >= rounding)
        return np.asarray(frequency), float(self.time[above[-1]])

    def _require_finite(self, values: npt.NDArray[Any]) -> None:
        if not np.isfinite(values).all():
            raise ValueError(
                "time must not be so short or long that its third power overflows, got times "
                f"next to {self.duration:g} s"
            )
