"""A delay in samples: Lagrange's polynomial through eight samples gives what lies between."""

from __future__ import annotations

import math

import numpy as np

from armlock.checks import FloatArray, IntArray

# A delay that is closer to a whole number of samples than this counts as whole.
_WHOLE = 1e-6
# Number of samples on either side of a delay that are used.
_SIDE = 4

#: Smallest delays in samples that have a weight, shape (n,), and the weights of these delays
#: and of those that follow one sample apart, shape (n, m). A constant delay has one row.
Weights = tuple[IntArray, FloatArray]


def lagrange_weights(name: str, tau: FloatArray, sample_rate: float) -> Weights:
    r"""Return the weights that delay a series.

    A constant delay of whole samples has one weight. All others, and those of an arm that
    moves, have the weights of Lagrange's polynomial of order m = 7, with x the delay in samples
    less the smallest one:

    .. math::

        \ell_i = \prod_{j \ne i} \frac{x - j}{i - j} , \qquad i, j = 0, \ldots, m .

    Parameters
    ----------
    name : str
        Name of the delay in messages.
    tau : float array, shape () or (n,)
        A constant delay, or those of successive samples, in s.
    sample_rate : float
        In Hz.

    Returns
    -------
    Weights

    Raises
    ------
    ValueError
        If a delay is too short to be interpolated at this sample rate.

    Notes
    -----
    The order is odd and the delay lies between the two middle samples. Then interpolation
    amplifies no frequency, so that it adds no instability.
    """
    samples = np.atleast_1d(tau) * sample_rate
    whole = np.rint(samples)
    if tau.ndim == 0 and whole[0] > 0 and abs(samples[0] - whole[0]) <= _WHOLE:
        return whole.astype(int), np.ones((1, 1))
    first = np.floor(samples).astype(int) - _SIDE + 1
    if first.min() < 1:
        raise ValueError(
            f"{name} must be at least {_SIDE} samples to be interpolated: "
            f"{_SIDE / sample_rate:.9g} s at a sample_rate of {sample_rate:.9g} Hz, got "
            f"{tau.min()} s"
        )
    x, nodes = samples - first, range(2 * _SIDE)
    weights = [math.prod((x - j) / (k - j) for j in nodes if j != k) for k in nodes]
    return first, np.stack(weights, axis=-1)


def reach(weights: Weights) -> int:
    """Return how many samples before a block its delays reach back."""
    first, shares = weights
    return int((first - np.arange(first.size)).max()) + int(shares.shape[1]) - 1
