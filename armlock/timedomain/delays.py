"""Delays in samples: constant ones, and those of arms that move.

A delay between two samples is interpolated by Lagrange's polynomial through eight samples. For
a delay that moves the weights are computed anew in each sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, finite_series, positive_number
from armlock.compiled import njit

#: A constant delay in samples: phi(t - tau) = sum_k weights[k] phi[n - first - k].
Delay = tuple[int, tuple[float, ...]]
#: A constant delay, or a series of the delay in samples.
AnyDelay = Delay | FloatArray
#: What the caller gives for tau1 and tau2: a number, a series, or a function of the time in s.
GivenDelay = npt.ArrayLike | Callable[[FloatArray], npt.ArrayLike]
# A delay that is closer to a whole number of samples than this counts as whole.
_WHOLE = 1e-6
# Number of samples on either side of a delay that are used; `between` writes them out.
_SIDE = 4
# For `between`: 1 / prod (k - j) over all nodes j except k.
_SCALES = tuple(
    1.0 / math.prod(k - j for j in range(2 * _SIDE) if j != k) for k in range(_SIDE, 2 * _SIDE)
)
# Change of a round trip in s per s, 1 - (1 - v1 / c) (1 - v2 / c) with the speeds v1 and v2 at
# which the two ends move apart: it lies between these bounds below the speed of light.
_SLOWEST, _FASTEST = -3.0, 1.0


def lagrange_delay(name: str, tau: float, sample_rate: float) -> Delay:
    r"""Return the weights that delay a series by a constant time.

    A delay of whole samples has one weight. Otherwise they are those of Lagrange's polynomial
    of order m = 7, with x the delay in samples less `first`:

    .. math::

        \ell_i = \prod_{j \ne i} \frac{x - j}{i - j} , \qquad i, j = 0, \ldots, m .

    Parameters
    ----------
    name : str
        Name of the delay in messages.
    tau : float
        Delay in s, positive.
    sample_rate : float
        In Hz.

    Returns
    -------
    first : int
        Smallest delay in samples that has a weight.
    weights : tuple of float
        Weights of this delay and of those that follow, one sample apart.

    Raises
    ------
    ValueError
        If the delay is too short to be interpolated at this sample rate.

    Notes
    -----
    The order is odd and the delay lies between the two middle samples. Then interpolation
    amplifies no frequency, so that it adds no instability.
    """
    samples = tau * sample_rate
    whole = round(samples)
    if whole > 0 and abs(samples - whole) <= _WHOLE:
        return whole, (1.0,)
    first = math.floor(samples) - _SIDE + 1
    if first < 1:
        raise ValueError(
            f"sample_rate must be at least {_SIDE / tau:.9g} Hz to interpolate {name} = {tau} "
            f"s, or a multiple of {1.0 / tau:.9g} Hz, got {sample_rate:.9g}"
        )
    x = samples - first
    nodes = range(2 * _SIDE)
    weights = [math.prod((x - j) / (k - j) for j in nodes if j != k) for k in nodes]
    return first, tuple(weights)


def arm_delay(name: str, given: GivenDelay, time: FloatArray, sample_rate: float) -> AnyDelay:
    """Return the delay of an arm over a block of samples.

    Parameters
    ----------
    name : str
        Name of the delay in messages.
    given : float, array_like of the shape of `time`, or callable
        The delay in s; a callable is called with `time`.
    time : float array, shape (n,)
        Time of the samples in s.
    sample_rate : float
        In Hz.

    Returns
    -------
    tuple or float array, shape (n,)
        Weights of a constant delay, or the delay in samples.

    Raises
    ------
    TypeError, ValueError
        If a delay is not finite and positive or has another shape. If a delay that moves is
        shorter than four samples, or changes faster than light allows.
    """
    if callable(given):
        name, given = f"{name}(t)", given(time)
    tau = finite_series(name, given, 0, 1)
    if not tau.ndim:
        return lagrange_delay(name, positive_number(name, float(tau)), sample_rate)
    if tau.shape != time.shape:
        raise ValueError(
            f"{name} must be a number or have the shape of noise, {time.shape}; got {tau.shape}"
        )
    samples = tau * sample_rate
    change = np.diff(samples, prepend=samples[:1])
    too_fast = (change <= _SLOWEST) | (change >= _FASTEST)
    for wrong, constraint in (
        (too_fast, f"change by more than {_SLOWEST:g} and less than {_FASTEST:g} s a second"),
        (samples < _SIDE, f"be at least {_SIDE / sample_rate} s where it is not constant"),
    ):
        if wrong.any():
            i = int(np.argmax(wrong))
            raise ValueError(f"{name} must {constraint}, got {tau[i]} s at t = {time[i]:.9g} s")
    return samples


def reach(delay: AnyDelay) -> int:
    """Return how many samples a delay reaches back at its first sample.

    A delay that moves grows by less than one sample per sample, so that no later sample needs
    anything older.
    """
    if isinstance(delay, tuple):
        first, weights = delay
        return first + len(weights) - 1
    return int(delay[0]) + _SIDE


def longest(delay: AnyDelay) -> int:
    """Return how many samples a delay reaches back at most."""
    return reach(delay) if isinstance(delay, tuple) else int(delay.max()) + _SIDE


@njit()
def delayed(signal: FloatArray, now: int, delay: AnyDelay, i: int) -> float:
    """Return a signal as it was one delay before row `now`; i is the sample of the delay."""
    if isinstance(delay, tuple):  # decided when it is compiled
        first, weights = delay
        value = 0.0
        for k in range(len(weights)):
            value += weights[k] * signal[np.uintp(now - first - k)]
        return value
    whole = np.floor(delay[i])
    return float(between(signal, now - int(whole), delay[i] - whole - 0.5))


@njit()
def between(signal: FloatArray, middle: int, u: float) -> float:
    """Return a signal between two rows, at middle - 1/2 - u with abs(u) <= 1/2.

    This is Lagrange's polynomial as in `lagrange_delay`, its nodes taken by twos. With u
    counted from the middle and q(i) = u^2 - i^2 for i = 1/2, 3/2, ..., the nodes at h and -h
    contribute

        prod_{i != h} q(i) scale(h) ((u + h) y(h) - (u - h) y(-h)) .

    At a node the result is that sample, bit by bit.
    """
    square, value = u * u, 0.0
    q1, q2, q3, q4 = square - 0.25, square - 2.25, square - 6.25, square - 12.25
    near, far = q1 * q2, q3 * q4
    products = q2 * far, q1 * far, near * q4, near * q3
    for k in range(4):
        h = k + 0.5
        later = signal[np.uintp(middle + k)]
        earlier = signal[np.uintp(middle - 1 - k)]
        value += (products[k] * _SCALES[k]) * ((u + h) * earlier - (u - h) * later)
    return value
