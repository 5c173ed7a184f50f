r"""Rational functions of s in samples, written so that slow poles keep all their digits.

The discretization is the trapezoidal rule, s -> (2 / T) (z - 1) / (z + 1), known as
Tustin's or the bilinear map. It takes the left half-plane into the unit disc and s = 0 to
z = 1, so that it adds no instability and keeps behaviour at rest; and the frequency response
at omega is the continuous one at (2 / T) tan(omega T / 2), see `warped`. It is implicit:
the present output depends on the present input.

At 200 Hz a pole at 1e-6 rad/s lies 1e-8 from z = 1, and a number close to one cannot hold it
well. So all is written in the change gamma = z - 1 from one sample to the next (the delta
operator). A pole or zero p becomes gamma = T p / (1 - T p / 2), which is as precise as p, and
a zero at infinity becomes gamma = -2. From these factors filters are built in sections of two
poles and two zeros (`SampledFilter`). The sensor, whose polynomials are given expanded, is one
section of its own with two inputs (`SampledSensor`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.checks import ComplexArray, FloatArray, positive_number, real_array
from armlock.compiled import njit
from armlock.sensors import SignalMapping
from armlock.systems import System

#: Rows of numbers, in the form that lets the compiler unroll loops over them.
Rows = tuple[tuple[float, ...], ...]


# A section whose pole and zero at z = 0 cancel, for a filter without poles.
_NO_SECTION = (-1.0, -1.0, 0.0, 0.0, 0.0)


class SampledFilter(NamedTuple):
    r"""A chain of sections of second order, times a gain.

    With the change :math:`\gamma = z - 1`, a section from v to y is

    .. math::

        \gamma w_1 &= r_1 w_1 - k w_2 + v , \\
        \gamma w_2 &= r_2 w_2 + w_1 , \\
        y &= v + t_1 w_1 + t_2 w_2 .

    Two real poles are r1 and r2, with k = 0; a complex pair is r1 +- j sqrt(k), with r1 = r2.

    Attributes
    ----------
    gain : float
        The factor, which is also the share of the present input in the present output.
    sections : tuple of tuples
        Rows (r1, r2, k, t1, t2), one at least.
    order : int
        Number of poles. If it is less than twice the number of sections, the last states
        are not read.
    """

    gain: float
    sections: Rows
    order: int


class SampledSensor(NamedTuple):
    r"""A proper rational function with two inputs, in observer form.

    With the states :math:`w_0` to :math:`w_m`, and :math:`w_{-1} = 0`

    .. math::

        \gamma w_i &= w_{i-1} - q_i w_m + b_{i,1} u_1 + b_{i,2} u_2 , \\
        v &= w_m + d_1 u_1 + d_2 u_2 .

    Attributes
    ----------
    states : tuple of tuples
        Rows (q, b1, b2), one at least. The q are the coefficients of the denominator.
    direct : tuple of float
        The shares (d1, d2) of the present inputs in the present output.
    """

    states: Rows
    direct: tuple[float, float]


def warped(omega: npt.ArrayLike, sample_rate: float) -> FloatArray:
    r"""Frequency at which a continuous system responds as the sampled one does at `omega`.

    With the sampling step T it is

    .. math::

        \Omega = \frac{2}{T} \tan \frac{\omega T}{2} .

    Parameters
    ----------
    omega : array_like of float
        In rad/s. At pi times the sample rate the result is infinite but for rounding, and past
        it that of the frequency it is an alias of.
    sample_rate : float
        In Hz.

    Returns
    -------
    float array, shaped like `omega`
        In rad/s.

    Raises
    ------
    TypeError, ValueError
        If a frequency is not finite and real, or the sample rate not positive.
    """
    rate = positive_number("sample_rate", sample_rate)
    return np.asarray(2.0 * rate * np.tan(0.5 * real_array("omega", omega) / rate))


def sampled_filter(
    zeros: Sequence[complex], poles: Sequence[complex], gain: float, sample_rate: float
) -> SampledFilter:
    r"""Apply the trapezoidal rule to zeros, poles and gain.

    With h half the sampling step T, each pole or zero p becomes

    .. math::

        \gamma = \frac{T p}{1 - h p} ,

    the zeros at infinity become -2, and the gain is multiplied by 1 - h z for each zero z, by
    1 / (1 - h p) for each pole p, and by h for each zero at infinity.

    Parameters
    ----------
    zeros, poles : sequence of complex
        In rad/s, no more zeros than poles.
    gain : float
        Factor in front.
    sample_rate : float
        In Hz.

    Returns
    -------
    SampledFilter

    Raises
    ------
    ValueError
        If there are more zeros than poles.

    Notes
    -----
    Poles are paired with neighbours in magnitude, the larger one first. In this order t1 and
    t2 are differences and products of differences that lose no digits, however far poles and
    zeros lie apart.
    """
    z: ComplexArray = np.array(zeros, dtype=complex)
    p: ComplexArray = np.array(poles, dtype=complex)
    if z.size > p.size:
        raise ValueError(
            f"controller must be proper, got more zeros than poles: {z.size} and {p.size}"
        )
    half = 0.5 / positive_number("sample_rate", sample_rate)
    at_infinity = p.size - z.size
    factors = np.append(1.0 - half * z, np.full(at_infinity, half)) / (1.0 - half * p)
    finite = 2.0 * half * z / (1.0 - half * z)
    above = _pairs([*finite, *[-2.0 + 0j] * at_infinity])
    below = _pairs([*(2.0 * half * p / (1.0 - half * p))])
    sections = tuple(
        (r1, r2, k, (r1 - a1) + (r2 - a2), (r2 - a1) * (r2 - a2) + (b - k))
        for (r1, r2, k), (a1, a2, b) in zip(below, above, strict=True)
    )
    whole = gain * float(np.prod(factors).real)
    return SampledFilter(whole, sections or (_NO_SECTION,), p.size)


def _pairs(roots: list[complex]) -> Rows:
    """Return roots by twos as (gamma - r1) (gamma - r2) + k, rows (r1, r2, k).

    Larger pairs come first. A last real root that is left over is joined by -1.
    """
    upper = [root for root in roots if root.imag > 0.0]
    pairs = [(float(root.real), float(root.real), float(root.imag) ** 2) for root in upper]
    real = sorted((float(r.real) for r in roots if r.imag == 0.0), key=abs, reverse=True)
    pairs += [(r1, r2, 0.0) for r1, r2 in zip(real[::2], real[1::2], strict=False)]
    pairs.sort(key=lambda pair: math.hypot(pair[0], math.sqrt(pair[2])), reverse=True)
    last = [(real[-1], -1.0, 0.0)] if len(real) % 2 else []
    return tuple(pairs + last)


@njit()
def through(sections: Rows, state: FloatArray, v: float) -> float:
    """Return what the sections of a filter, without its gain, make of a sample.

    `state` holds two values for each section, and moves on to the next sample.
    """
    for j in range(len(sections)):
        r1, r2, k, t1, t2 = sections[j]
        w1, w2 = state[2 * j], state[2 * j + 1]
        y = v + (t1 * w1 + t2 * w2)
        state[2 * j] = w1 + (r1 * w1 - k * w2 + v)
        state[2 * j + 1] = w2 + (r2 * w2 + w1)
        v = y
    return v


def readout(sampled: SampledFilter) -> FloatArray:
    """Return by how much each state adds to the output, the gain left out: shape (order,)."""
    shares = [share for *_, t1, t2 in sampled.sections for share in (t1, t2)]
    return np.array(shares[: sampled.order])


@lru_cache
def stationary_root(sampled: SampledFilter) -> FloatArray:
    """Return a square root of the covariance of a filter's states under white noise.

    Parameters
    ----------
    sampled : SampledFilter
        With stable poles.

    Returns
    -------
    float array, shape (order, order)
        A lower triangular R: the states' covariance is R R^T where the input's variance is
        one. It is not finite where the covariance overflows.
    """
    n = 2 * len(sampled.sections)
    change, drive, shares = np.zeros((n, n)), np.zeros(n), readout(sampled)
    for j, (r1, r2, k, _, _) in enumerate(sampled.sections):
        here, drive[2 * j] = slice(2 * j, 2 * j + 2), 1.0
        # A section takes in what all those before it put out.
        change[2 * j, : 2 * j] = shares[: 2 * j]
        change[here, here] = [[r1, -k], [1.0, r2]]
    change, drive = change[: sampled.order, : sampled.order], drive[: sampled.order]
    # The root after 1, 2, 4, ... samples from rest, until none of the states then is left. How
    # much the states change in so many samples is kept without the one that they are multiplied
    # by, in which a slow pole would be lost.
    root = np.zeros((sampled.order, sampled.order))
    root[:, :1] = drive[:, None]
    with np.errstate(all="ignore"):
        while (carried := np.eye(sampled.order) + change).any() and np.isfinite(root).all():
            # Of the sum of two covariances.
            upper = np.linalg.qr(np.hstack((root, carried @ root)).T).R
            root = (upper * np.where(np.diag(upper) < 0.0, -1.0, 1.0)[:, None]).T
            change = 2.0 * change + change @ change
    # It is kept for other series.
    root.flags.writeable = False
    return root


def sampled_sensor(
    numerators: Sequence[FloatArray], denominator: FloatArray, sample_rate: float
) -> SampledSensor:
    r"""Apply the trapezoidal rule to a proper function given by polynomials.

    A polynomial of degree up to m, multiplied by the same power of 2 + gamma for all, becomes

    .. math::

        \sum_i n_i s^i \to \sum_i n_i \left( \frac{2 \gamma}{T} \right)^i
        \left( 2 + \gamma \right)^{m - i} .

    Parameters
    ----------
    numerators : two float arrays
        Coefficients in ascending powers of s.
    denominator : float array
        Likewise; its degree m is not exceeded by the numerators'.
    sample_rate : float
        In Hz.

    Returns
    -------
    SampledSensor
    """
    order = denominator.size - 1
    slope = np.array([0.0, 2.0 * sample_rate])

    def changed(polynomial: FloatArray) -> FloatArray:
        """Return the coefficients in powers of gamma, `order` + 1 of them."""
        total = np.zeros(order + 1)
        for i, coefficient in enumerate(polynomial):
            bent = poly.polymul(poly.polypow(slope, i), poly.polypow([2.0, 1.0], order - i))
            total[: bent.size] += coefficient * bent
        return total

    below = changed(denominator)
    above = np.array([changed(numerator) for numerator in numerators]).T
    direct = above[-1] / below[-1]
    drive = (above[:-1] - below[:-1, None] * direct) / below[-1]
    rows = np.column_stack((below[:-1] / below[-1], drive)).tolist()
    states = tuple((q, b1, b2) for q, b1, b2 in rows)
    return SampledSensor(states or ((0.0, 0.0, 0.0),), (float(direct[0]), float(direct[1])))


def sampled_loop(
    controller: System, mapping: SignalMapping, sample_rate: float
) -> tuple[SampledSensor, SampledFilter]:
    """Return sensor and controller in samples, one behind the other.

    Poles at s = 0, of sensor or controller, drop out against zeros there of the other or the
    same: a hidden state would not decay. Then the sensor or the controller may have more zeros
    than poles, and takes slow factors of the other.

    Parameters
    ----------
    controller : System
        Controller and actuator.
    mapping : SignalMapping
        The sensor; its product with the controller is proper.
    sample_rate : float
        In Hz.

    Returns
    -------
    tuple of SampledSensor and SampledFilter
    """
    zeros, poles = list(controller.zeros()), list(controller.poles())
    numerators = [np.array(n) for n in (mapping.numerator1, mapping.numerator2)]
    denominator = np.array(mapping.denominator)
    while (0.0 in zeros or not any(n[0] for n in numerators)) and (
        0.0 in poles or denominator[0] == 0.0
    ):
        if 0.0 in zeros:
            zeros.remove(0.0)
        else:
            numerators = [np.append(n[1:], 0.0) for n in numerators]
        if 0.0 in poles:
            poles.remove(0.0)
        else:
            denominator = denominator[1:]
    numerators = [poly.polytrim(n, tol=0.0) for n in numerators]
    while True:
        if len(zeros) > len(poles):
            factor = _slowest(zeros)
            numerators = [poly.polymul(n, factor) for n in numerators]
        elif max(n.size for n in numerators) > denominator.size:
            denominator = poly.polymul(denominator, _slowest(poles))
        else:
            break
    filtered = sampled_filter(zeros, poles, controller.gain, sample_rate)
    return sampled_sensor(numerators, denominator, sample_rate), filtered


def _slowest(roots: list[complex]) -> FloatArray:
    """Take the smallest root, or pair, out of a list; return its polynomial."""
    root = min(roots, key=abs)
    roots.remove(root)
    if root.imag == 0.0:
        return np.array([-root.real, 1.0])
    roots.remove(min(roots, key=lambda other: abs(other - root.conjugate())))
    return np.array([abs(root) ** 2, -2.0 * root.real, 1.0])
