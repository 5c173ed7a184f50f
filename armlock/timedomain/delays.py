"""Delays in samples: constant ones, and arms that move.

A delay that is no whole number of samples is interpolated, with the weights of
`lagrange_delay`; those of a delay that moves follow it sample by sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from armlock.axis.compiled import njit
from armlock.checks import FloatArray, finite_series
from armlock.loops import Loop

#: A constant delay in samples, phi(t - tau) = sum_k weights[k] phi[n - first - k].
Delay = tuple[int, tuple[float, ...]]
#: A delay that moves, in samples: a row for each sample, a column for each run, or for all.
MovingDelay = FloatArray
#: What the caller gives for tau1 and tau2: a number, a series, or a function of the time in s.
GivenDelay = npt.ArrayLike | Callable[[FloatArray], npt.ArrayLike]
# Delays closer to whole samples than this, in samples, are whole.
_WHOLE = 1e-6
# Interpolated are so many samples on either side of a delay; `between` writes them out.
_SIDE = 4
# Factors of a pair of samples, see `between`: 1 / prod (k - j) over all nodes j but k.
_SCALES = tuple(
    1.0 / math.prod(k - j for j in range(2 * _SIDE) if j != k) for k in range(_SIDE, 2 * _SIDE)
)
# A round trip is 1 - (1 - v1 / c) (1 - v2 / c) longer a second, where the ends part at speeds
# v1 and v2: between these, whatever moves slower than light.
_SLOWEST, _FASTEST = -3.0, 1.0


def lagrange_delay(name: str, tau: float, sample_rate: float) -> Delay:
    r"""Return the weights of a delay, a single one where it is whole samples.

    Otherwise they are those of Lagrange's polynomial of order m = 7,

    .. math::

        \ell_i = \prod_{j \ne i} \frac{x - j}{i - j} , \qquad i, j = 0, \ldots, m ,

    with x the delay in samples, less `first`.

    Parameters
    ----------
    name : str
        What messages call it.
    tau : float
        Delay in s, zero included.
    sample_rate : float
        In Hz.

    Returns
    -------
    first : int
        The smallest delay in samples that has a weight.
    weights : tuple of float
        Of this delay, and of those that follow sample by sample.

    Raises
    ------
    ValueError
        If the delay is too short for the sample rate.

    Notes
    -----
    With an odd order and the delay between the two middle samples, no frequency is amplified,
    so that interpolation adds no instability of its own.
    """
    samples = tau * sample_rate
    whole = round(samples)
    first = math.floor(samples) - _SIDE + 1
    if tau == 0.0 or (whole > 0 and abs(samples - whole) <= _WHOLE):
        return whole, (1.0,)
    if first < 1:
        raise ValueError(
            f"sample_rate must be at least {_SIDE / tau:.9g} Hz to interpolate {name} = {tau} "
            f"s, or a multiple of {1.0 / tau:.9g} Hz, got {sample_rate:.9g}"
        )
    x = samples - first
    nodes = range(2 * _SIDE)
    weights = [math.prod((x - j) / (k - j) for j in nodes if j != k) for k in nodes]
    return first, tuple(weights)


def sampled_delays(loop: Loop, sample_rate: float) -> tuple[Delay, ...]:
    """Return the delays of both arms and the dead time, or say why they have no samples."""
    arms = [lagrange_delay(name, getattr(loop, name), sample_rate) for name in ("tau1", "tau2")]
    try:
        return (*arms, lagrange_delay("delay", loop.delay, sample_rate))
    except ValueError as error:
        phase = math.pi * sample_rate * loop.delay
        raise ValueError(
            f"{error}; loop.replace(delay=0.0) neglects the dead time, which changes the phase "
            f"of L by {phase:.3g} rad at {0.5 * sample_rate:g} Hz, the highest frequency "
            f"simulated, and by less below"
        ) from None


def reach(delay: Delay | MovingDelay) -> int:
    """Return how many samples a delay reaches back, at most."""
    if isinstance(delay, tuple):
        first, weights = delay
        return first + len(weights) - 1
    return int(delay.max()) + _SIDE


@njit()
def delayed(signal: FloatArray, row: int, column: int, delay: Delay) -> float:
    """Return a column of a signal as it was a constant delay before a row."""
    first, weights = delay
    value = 0.0
    for k in range(len(weights)):
        value += weights[k] * signal[np.uintp(row - first - k), column]
    return value


@njit()
def between(signal: FloatArray, middle: int, column: int, u: float) -> float:
    """Return a column of a signal between two rows, at middle - 1/2 - u with abs(u) <= 1/2.

    Lagrange's polynomial, as in `lagrange_delay`, its nodes taken by twos: with u counted from
    the middle, those at h and -h contribute, of q(i) = u^2 - i^2 for i = 1/2, 3/2, ...

        prod_{i != h} q(i) scale(h) ((u + h) y(h) - (u - h) y(-h)) .

    At a node it is that sample, bit by bit.
    """
    square, value = u * u, 0.0
    q1, q2, q3, q4 = square - 0.25, square - 2.25, square - 6.25, square - 12.25
    near, far = q1 * q2, q3 * q4
    products = q2 * far, q1 * far, near * q4, near * q3
    for k in range(4):
        h = k + 0.5
        later = signal[np.uintp(middle + k), column]
        earlier = signal[np.uintp(middle - 1 - k), column]
        value += (products[k] * _SCALES[k]) * ((u + h) * earlier - (u - h) * later)
    return value


@dataclass
class Arm:
    """The delay of one arm during a call: a number, a series, or a function of time.

    `begin` is the number of the call's first sample in the run, `last` the last delay so far.
    """

    name: str
    given: float | FloatArray | Callable[[FloatArray], npt.ArrayLike]
    rate: float
    begin: int
    last: FloatArray | None = None

    def during(self, noise: FloatArray, number: int, known: int) -> Delay | MovingDelay:
        """Return the delay during a block, in samples.

        `noise` is that of the block, `number` that of its first sample in the run, and so many
        samples are `known` before it.
        """
        begins = (number - known) / self.rate
        not_known = f"not reach back past the history, which begins at t = {begins:.9g} s"
        if isinstance(self.given, float):
            delay = lagrange_delay(self.name, self.given, self.rate)
            if reach(delay) > known:
                raise self._refusal(not_known, self.given, number)
            return delay
        if callable(self.given):
            tau = self._called(self.given, number, noise)
        else:
            tau = self.given[number - self.begin :][: len(noise)]
        # Behind the last sample of the block before, in few arrays: new memory takes time.
        rows = np.empty((len(tau) + 1, tau.shape[1]))
        samples = np.multiply(tau, self.rate, out=rows[1:])
        rows[0] = samples[0] if self.last is None else self.last
        self.last = samples[-1].copy()
        change = np.diff(rows, axis=0)
        if change.min() <= _SLOWEST or change.max() >= _FASTEST:
            constraint = (
                f"change by more than {_SLOWEST:g} and less than {_FASTEST:g} s a second, as "
                f"round trips do at less than the speed of light"
            )
            wrong = (change <= _SLOWEST) | (change >= _FASTEST)
        elif samples.min() < _SIDE:
            constraint = f"be at least {_SIDE / self.rate} s where it is not constant"
            wrong = samples < _SIDE
        elif reach(samples[:1]) > known:
            # No later sample reaches further back.
            constraint = not_known
            wrong = samples[:1] == samples[0].max()
        else:
            return samples
        i, w = np.argwhere(wrong)[0]
        raise self._refusal(constraint, tau[i, w], number + i)

    def _refusal(self, constraint: str, tau: float, number: int) -> ValueError:
        """Say what a delay must do that is `tau` at a sample of the run."""
        at = number / self.rate
        return ValueError(f"{self.name} must {constraint}, got {tau} s at t = {at:.9g} s")

    def _called(
        self,
        function: Callable[[FloatArray], npt.ArrayLike],
        number: int,
        noise: FloatArray,
    ) -> FloatArray:
        """Return what a function of time gives, in rows."""
        time = np.arange(number, number + len(noise), dtype=np.float64)
        time /= self.rate
        name = f"{self.name}(t), for t from {time[0]:.9g} s on,"
        tau = finite_series(name, function(time), 0, 1, 2)
        if tau.shape not in ((), time.shape, noise.T.shape):
            raise ValueError(
                f"{name} must be a number or have the shape of t, {time.shape}; got {tau.shape}"
            )
        return np.atleast_2d(tau if tau.ndim else np.full(time.shape, tau)).T
