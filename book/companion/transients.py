"""How the locked laser answers an error soon after it begins, where residues do not serve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armlock.checks import FloatArray
from armlock.loops import Loop
from armlock.performance.transfer import transfer

# Times at which an answer is computed; half of them are kept.
_SAMPLES = 1 << 20
# Factors of e by which what comes around from the period before is weakened.
_DAMPED = 20.0


class Answer(NamedTuple):
    """Frequency of the locked laser in Hz over time in s."""

    time: FloatArray
    frequency: FloatArray

    def largest(self, earliest: float) -> tuple[float, float]:
        """Return when its magnitude is largest from a time on, and that."""
        later = self.time >= earliest
        best = int(np.abs(self.frequency[later]).argmax())
        return float(self.time[later][best]), float(np.abs(self.frequency[later][best]))


def answer(
    loop: Loop,
    source: str,
    duration: float,
    error: tuple[float, float, float] = (1.0, 0.0, 0.0),
) -> Answer:
    r"""Compute the laser's answer to an error that begins at time zero.

    By the inverse Laplace transform along a line :math:`s = \sigma + j\omega` to the right of
    all roots, as a sum over equal steps of :math:`\omega`,

    .. math::

        \nu(t) = \frac{e^{\sigma t}}{2\pi} \int Y(s)
        \left( \frac{\nu_0}{s} + \frac{\gamma}{s^2} + \frac{\alpha}{s^3} \right)
        e^{j\omega t}\, \mathrm{d}\omega .

    It needs no roots, and so holds for neutral loops and soon after the error begins. A
    Gaussian over three samples keeps a jump from overshooting.

    Parameters
    ----------
    loop : Loop
        The loop, stable at c1 = c2 = 1.
    source : {"common", "differential"}
        Whether the sum or the difference of the two arms' errors is meant.
    duration : float
        In s. Times are spaced by two millionths of it.
    error : tuple of three floats, optional
        nu0 in Hz, gamma in Hz/s and alpha in Hz/s^2.

    Returns
    -------
    Answer
    """
    step = 2.0 * duration / _SAMPLES
    shift = _DAMPED / (2.0 * duration)
    frequency = np.fft.rfftfreq(_SAMPLES, step)
    s = shift + 2j * np.pi * frequency
    given = error[0] / s + error[1] / s**2 + error[2] / s**3
    smooth = np.exp(-0.5 * (2.0 * np.pi * frequency * 3.0 * step) ** 2)
    time: FloatArray = step * np.arange(_SAMPLES // 2, dtype=np.float64)
    found = np.fft.irfft(transfer(loop, source, s) * given * smooth, _SAMPLES) / step
    return Answer(time, np.asarray(found[: time.size] * np.exp(shift * time), np.float64))


def largest_answer(
    loop: Loop, source: str, error: tuple[float, float, float] = (1.0, 0.0, 0.0)
) -> tuple[float, float]:
    """Return when the laser's answer is largest, and its size.

    Between one second and twenty days after the error begins: over the first hour in steps of
    milliseconds, then in steps of seconds.

    Parameters
    ----------
    loop, source, error
        As for `answer`.

    Returns
    -------
    time, size : float
        In s and in Hz.
    """
    found = [answer(loop, source, end, error).largest(1.0) for end in (3600.0, 1728e3)]
    return max(found, key=lambda one: one[1])
