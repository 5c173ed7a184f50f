"""Signal mappings of Table I: how a sensor combines the signals of the two arms.

Arm k returns the signal phi(t) - c_k phi(t - tau_k). A signal mapping weighs the two with
rational functions m1(s) and m2(s), so that the sensor's response is

    P(s) = m1(s) (1 - c1 exp(-s tau1)) + m2(s) (1 - c2 exp(-s tau2)).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.validation import ComplexArray, positive_number, real_number


class SignalMapping(NamedTuple):
    r"""Weights m1 = numerator1 / denominator and m2 = numerator2 / denominator.

    The response of the sensor is

    .. math::

        P(s) = m_1 \left( 1 - c_1 e^{-s\tau_1} \right)
        + m_2 \left( 1 - c_2 e^{-s\tau_2} \right) .

    Attributes
    ----------
    numerator1, numerator2, denominator : sequence of float
        Polynomial coefficients in ascending powers of s.
    name : str
        What the configuration is called.
    """

    numerator1: Sequence[float]
    numerator2: Sequence[float]
    denominator: Sequence[float]
    name: str

    def weights(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Evaluate (m1, m2) at complex s, in rad/s; both are shaped like `s`."""
        s = np.asarray(s, dtype=np.complex128)
        below: ComplexArray = poly.polyval(s, np.asarray(self.denominator, dtype=float))
        return (
            poly.polyval(s, np.asarray(self.numerator1, dtype=float)) / below,
            poly.polyval(s, np.asarray(self.numerator2, dtype=float)) / below,
        )

    def response(
        self,
        s: npt.ArrayLike,
        tau1: float,
        tau2: float,
        c1: float = 1.0,
        c2: float = 1.0,
    ) -> ComplexArray:
        """Evaluate the sensor's response P(s).

        Parameters
        ----------
        s : array_like of complex
            Laplace variable in rad/s.
        tau1, tau2 : float
            Round-trip delays in s.
        c1, c2 : float, optional
            Multiplicative perturbations of the two arms, 1 where there are none.

        Returns
        -------
        complex array, shaped like `s`
        """
        tau1, tau2 = positive_number("tau1", tau1), positive_number("tau2", tau2)
        s = np.asarray(s, dtype=np.complex128)
        m1, m2 = self.weights(s)
        response: ComplexArray = m1 * (1.0 - c1 * np.exp(-s * tau1))
        response += m2 * (1.0 - c2 * np.exp(-s * tau2))
        return response


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
#: Arm 2 minus arm 1, so that arm 1 is the longer one where the response is P_- of Table I.
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
    ValueError
        If the corner is not positive and finite, or the difference is zero.
    """
    p = positive_number("corner", corner)
    dtau = real_number("difference", difference)
    if dtau == 0.0:
        raise ValueError("difference must not be zero: the dual sensor divides by it")
    below = (0.0, p * dtau, dtau)
    return SignalMapping((p, p * dtau, dtau), (-p, p * dtau, dtau), below, "dual")
