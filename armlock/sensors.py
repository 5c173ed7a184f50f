"""Signal mappings of Table I: how a sensor combines the signals of the two arms.

Arm k returns the signal phi(t) - c_k phi(t - tau_k). A sensor is known by its signal mapping:
the rational functions m1(s) and m2(s) by which it weighs the two, so that its response is

    P(s) = m1(s) (1 - c1 exp(-s tau1)) + m2(s) (1 - c2 exp(-s tau2)).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from flint import fmpq_poly
from numpy.polynomial import polynomial as poly

from armlock import paper
from armlock.checks import (
    ComplexArray,
    axis,
    positive_number,
    real_number,
)
from armlock.engine.polynomials import polynomial
from armlock.systems import Sum, System


@dataclass(frozen=True)
class SignalMapping:
    r"""Weights m1 = numerator1 / denominator and m2 = numerator2 / denominator.

    The response of the sensor is

    .. math::

        P(s) = m_1 \left( 1 - c_1 e^{-s\tau_1} \right)
        + m_2 \left( 1 - c_2 e^{-s\tau_2} \right) .

    Parameters
    ----------
    numerator1, numerator2, denominator : sequence of float
        Polynomial coefficients in ascending powers of s. They are kept as tuples, without
        zeros in front of the highest power.
    name : str
        What the configuration is called.

    Raises
    ------
    TypeError, ValueError
        If a coefficient is not finite and real, or the denominator is zero.

    Examples
    --------
    Arm 1 seen through a low-pass filter of 1 rad/s, arm 2 as it is:

    >>> from armlock.sensors import SignalMapping
    >>> mapping = SignalMapping([1.0], [1.0, 1.0], [1.0, 1.0], "filtered")
    >>> m1, m2 = mapping.weights(1j)
    >>> print(f"{abs(m1):.4f} {abs(m2):.4f}")
    0.7071 1.0000
    """

    numerator1: Sequence[float]
    numerator2: Sequence[float]
    denominator: Sequence[float]
    name: str

    def __post_init__(self) -> None:
        """Check the polynomials, and keep them where nobody changes them."""
        for field in fields(self)[:3]:
            values = axis(field.name, getattr(self, field.name)).tolist()
            while len(values) > 1 and not values[-1]:
                values.pop()
            object.__setattr__(self, field.name, tuple(values))
        if not any(self.denominator):
            raise ValueError(f"denominator must not be zero, got {self.denominator}")

    @property
    def polynomials(self) -> tuple[fmpq_poly, fmpq_poly, fmpq_poly]:
        """Both numerators and the denominator, exactly."""
        first, second = polynomial(self.numerator1), polynomial(self.numerator2)
        return first, second, polynomial(self.denominator)

    @property
    def systems(self) -> tuple[System, System]:
        """The weights m1 and m2 as systems."""
        first, second, below = map(Sum.of, self.polynomials)
        return System(first, below), System(second, below)

    def weights(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Evaluate (m1, m2) at complex s in rad/s, of any shape; both are shaped like `s`."""
        first, second = self.systems
        return first(s), second(s)


#: One arm alone.
#:
#: .. math::
#:
#:     P_s(s) = 1 - c_1 e^{-s\tau_1}
SINGLE = SignalMapping((1.0,), (0.0,), (1.0,), "single")
#: The sum of both arms.
#:
#: .. math::
#:
#:     P_+(s) = 2 - c_1 e^{-s\tau_1} - c_2 e^{-s\tau_2}
COMMON = SignalMapping((1.0,), (1.0,), (1.0,), "common")
#: Arm 2 minus arm 1. Arm 1 is the longer one where the response is :math:`P_-` of Table I.
#:
#: .. math::
#:
#:     P_-(s) = c_1 e^{-s\tau_1} - c_2 e^{-s\tau_2}
DIFFERENCE = SignalMapping((-1.0,), (1.0,), (1.0,), "difference")


def dual(corner: float, difference: float) -> SignalMapping:
    r"""Return the dual sensor: common arm, and difference arm integrated below its corner.

    .. math::

        P_d(s) &= P_+(s) - E(s)\, P_-(s) \\
        &= (1 + E) \left( 1 - c_1 e^{-s\tau_1} \right) \\
        &\quad + (1 - E) \left( 1 - c_2 e^{-s\tau_2} \right) , \\
        E(s) &= \frac{p}{(s + p)\, s\, \Delta\tau}

    Parameters
    ----------
    corner : float
        Corner frequency p in rad/s.
    difference : float
        The delay difference dtau in s that scales the integral: tau1 - tau2 in the paper's
        Sec. III.B, half of it in the source of its Table I.

    Returns
    -------
    SignalMapping
        With the weights m1 = 1 + E and m2 = 1 - E.

    Raises
    ------
    TypeError, ValueError
        If the corner is not positive and finite, or the difference is zero.
    """
    p = positive_number("corner", corner)
    dtau = real_number("difference", difference)
    if dtau == 0.0:
        raise ValueError("difference must not be zero: the dual sensor divides by it")
    below = (0.0, p * dtau, dtau)
    return SignalMapping((p, p * dtau, dtau), (-p, p * dtau, dtau), below, "dual")


def modified_dual(
    mean_delay: float, half_difference: float, corner: float = paper.DUAL_SENSOR_CORNER
) -> SignalMapping:
    r"""Return the modified dual sensor: common arm at low frequency, dual arm in the band.

    .. math::

        P_M &= H_+ P_+ - H_- P_- , \quad m_1 = H_+ + H_- , \quad m_2 = H_+ - H_- , \\
        H_+ &= F_C + F_D , \quad H_- = \frac{\omega_0}{s + \omega_0}\,
        \frac{F_D}{s\, \Delta\tau} , \\
        F_C &= \frac{p_b}{z_b\, \bar\tau}\, \frac{s + z_b}{s\, (s + p_b)} , \quad
        F_D = \frac{s^4}{(s + p_c)(s + p_d)(s + p_e)^2}

    with the mean delay :math:`\bar\tau`, half the delays' difference :math:`\Delta\tau`,
    :math:`z_b = 2\pi \cdot 5 / (13 \bar\tau)`,
    :math:`p_b = 2\pi \cdot 5 / (2 \bar\tau)`, :math:`p_c = 7 / (5 \bar\tau)`,
    :math:`p_d = 11 / (20 \bar\tau)` and :math:`p_e = 2\pi / (90 \bar\tau)`.

    Parameters
    ----------
    mean_delay : float
        Mean round-trip delay of the two arms in s.
    half_difference : float
        Half the difference of the round-trip delays, (tau1 - tau2) / 2, in s; negative where
        arm 2 is the longer one.
    corner : float, optional
        Corner :math:`\omega_0` of the difference arm's filter in rad/s. The source prints none;
        the default is that of a public arm-locking code.

    Returns
    -------
    SignalMapping

    Raises
    ------
    TypeError, ValueError
        If the mean delay or the corner is not positive and finite, or the half difference is
        zero: the sensor divides by it.

    References
    ----------
    LISA Frequency Control White Paper (2009), Sec. 3; K. McKenzie, R. E. Spero and
    D. A. Shaddock, Phys. Rev. D 80, 102003 (2009).
    """
    mean = positive_number("mean_delay", mean_delay)
    half = real_number("half_difference", half_difference)
    if half == 0.0:
        raise ValueError(
            "half_difference must not be zero: the modified dual sensor divides by it"
        )
    return _modified_dual(mean, half, positive_number("corner", corner))


@lru_cache
def _modified_dual(mean: float, half: float, w0: float) -> SignalMapping:
    """Multiply the sensor's polynomials out: loops of one sensor are made by the thousand."""
    zb, pb = 2.0 * np.pi * 5.0 / (13.0 * mean), 2.0 * np.pi * 5.0 / (2.0 * mean)
    pc, pd, pe = 7.0 / (5.0 * mean), 11.0 / (20.0 * mean), 2.0 * np.pi / (90.0 * mean)
    s = poly.Polynomial([0.0, 1.0])
    slow, fast = s * (s + pb), (s + pc) * (s + pd) * (s + pe) ** 2
    plus = (pb / (zb * mean) * (s + zb) * fast + s**4 * slow) * (s + w0)
    minus = w0 / half * s**3 * slow
    below = slow * fast * (s + w0)
    first, second = plus + minus, plus - minus
    return SignalMapping(
        first.coef.tolist(), second.coef.tolist(), below.coef.tolist(), "modified dual"
    )


#: The signal mappings that `Loop` takes by name, made of the delays tau1 and tau2 in s. The
#: corner of the dual ones is `armlock.paper.DUAL_SENSOR_CORNER`, an assumption, and the
#: difference of "dual" is tau1 - tau2.
NAMED: dict[str, Callable[[float, float], SignalMapping]] = {
    "single": lambda tau1, tau2: SINGLE,
    "common": lambda tau1, tau2: COMMON,
    "difference": lambda tau1, tau2: DIFFERENCE,
    "dual": lambda tau1, tau2: dual(paper.DUAL_SENSOR_CORNER, tau1 - tau2),
    "modified dual": lambda tau1, tau2: modified_dual(0.5 * (tau1 + tau2), 0.5 * (tau1 - tau2)),
}
