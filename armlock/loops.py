"""The loops of the paper: controller times signal mapping times delays.

The open loop of every configuration is

    L(s; c1, c2) = K(s) [m1(s) (1 - c1 exp(-s tau1)) + m2(s) (1 - c2 exp(-s tau2))]

with K the controller and actuator and m1, m2 the signal mapping. Clearing the denominators
of 1 + L gives the characteristic function of `armlock.characteristic`. The Hayes equation,
which has no sensor, is one more characteristic function.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock import sensors
from armlock.characteristic import CharacteristicFunction
from armlock.paper import COMMON_ARM_GAIN, TAU1, TAU2
from armlock.sensors import SignalMapping
from armlock.validation import ComplexArray, axis, positive_number


class HayesEquation(CharacteristicFunction):
    """The equation x'(t) = a x(t) + b x(t - tau), with free parameters (a, b).

    Its characteristic function is s - a - b exp(-s tau) (paper, Sec. II, after Eq. 3).

    Parameters
    ----------
    tau : float, optional
        Delay in s.

    Raises
    ------
    TypeError, ValueError
        If `tau` is not a positive finite number.

    Examples
    --------
    >>> from armlock import HayesEquation, unstable_roots
    >>> unstable_roots(HayesEquation(tau=1.0), -1.0, [-2.2, -2.4])
    array([0, 2])
    """

    def __init__(self, tau: float = 1.0) -> None:
        self.tau = positive_number("tau", tau)
        super().__init__((0.0, 1.0), (1.0,), (1.0,), 0.0, self.tau, parameters=("a", "b"))

    def __repr__(self) -> str:
        """Name the class and its delay."""
        return f"HayesEquation(tau={self.tau})"


class Controller(NamedTuple):
    """A rational function K(s), controller times actuator.

    Attributes
    ----------
    numerator, denominator : sequence of float
        Polynomial coefficients in ascending powers of s.
    """

    numerator: Sequence[float]
    denominator: Sequence[float]


def integrating_actuator(gain: float) -> Controller:
    """Return K(s) = gain / s, the controller and actuator of Secs. II and III."""
    return Controller((positive_number("gain", gain),), (0.0, 1.0))


class Loop(CharacteristicFunction):
    """An arm-locking loop, with free parameters (c1, c2).

    Parameters
    ----------
    controller : Controller
        Controller times actuator, K(s).
    mapping : SignalMapping
        The sensor, for instance `armlock.sensors.COMMON`.
    tau1, tau2 : float
        Round-trip delays of the two arms, in s.

    Raises
    ------
    TypeError, ValueError
        If a delay is not a positive finite number, or a polynomial is not finite and real.

    Notes
    -----
    Poles of the sensor at s = 0 cancel against zeros of the controller there, by
    construction.
    """

    def __init__(
        self, controller: Controller, mapping: SignalMapping, tau1: float, tau2: float
    ) -> None:
        self.tau1 = positive_number("tau1", tau1)
        self.tau2 = positive_number("tau2", tau2)
        self.controller = controller
        self.mapping = mapping
        above = axis("controller.numerator", controller.numerator)
        below = axis("controller.denominator", controller.denominator)
        m1 = axis("mapping.numerator1", mapping.numerator1)
        m2 = axis("mapping.numerator2", mapping.numerator2)
        sensor_below = axis("mapping.denominator", mapping.denominator)
        while above.size > 1 and above[0] == 0.0 == sensor_below[0]:
            above, sensor_below = above[1:], sensor_below[1:]
        b1, b2 = np.convolve(above, m1), np.convolve(above, m2)
        self._open_denominator = np.convolve(below, sensor_below)
        both = poly.polyadd(b1, b2)
        a = np.asarray(poly.polyadd(self._open_denominator, both), dtype=np.float64)
        super().__init__(a, b1, b2, self.tau1, self.tau2, parameters=("c1", "c2"))

    def open_loop(
        self, s: npt.ArrayLike, c1: npt.ArrayLike = 1.0, c2: npt.ArrayLike = 1.0
    ) -> ComplexArray:
        """Evaluate the open loop L(s; c1, c2).

        Parameters
        ----------
        s : array_like of complex
            Laplace variable in rad/s.
        c1, c2 : array_like of float, optional
            Multiplicative perturbations, 1 where there are none. All three broadcast.

        Returns
        -------
        complex array, of the broadcast shape
        """
        s = np.asarray(s, dtype=np.complex128)
        c1, c2 = np.asarray(c1, dtype=float), np.asarray(c2, dtype=float)
        # 1 - c exp(-s tau) without cancellation at low frequency.
        arm1 = (1.0 - c1) - c1 * np.expm1(-s * self.tau1)
        arm2 = (1.0 - c2) - c2 * np.expm1(-s * self.tau2)
        above = poly.polyval(s, self.b1) * arm1 + poly.polyval(s, self.b2) * arm2
        result: ComplexArray = above / poly.polyval(s, self._open_denominator)
        return result


class SingleArm(Loop):
    """Single-arm locking with an integrating actuator (paper, Secs. II and IV.A).

    The free parameter c1 is the paper's k2 and the gain its k1; c2 has no effect.

    Parameters
    ----------
    gain : float, optional
        Loop gain in rad/s.
    tau : float, optional
        Round-trip delay in s.

    Raises
    ------
    TypeError, ValueError
        If one of the two is not a positive finite number.
    """

    def __init__(self, gain: float = COMMON_ARM_GAIN, tau: float = TAU1) -> None:
        self.gain = positive_number("gain", gain)
        self.tau = positive_number("tau", tau)
        super().__init__(integrating_actuator(self.gain), sensors.SINGLE, tau, tau)

    def __repr__(self) -> str:
        """Name the class and its arguments."""
        return f"SingleArm(gain={self.gain}, tau={self.tau})"


class CommonArm(Loop):
    """Common-arm locking with an integrating actuator (paper, Eq. 4).

    Its characteristic function is s + 2 g - g c1 exp(-s tau1) - g c2 exp(-s tau2).

    Parameters
    ----------
    gain : float, optional
        Loop gain g in rad/s.
    tau1, tau2 : float, optional
        Round-trip delays in s.

    Raises
    ------
    TypeError, ValueError
        If one of the three is not a positive finite number.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> unstable_roots(CommonArm(gain=10.0), 1.0, 0.999)
    array(0)
    """

    def __init__(
        self, gain: float = COMMON_ARM_GAIN, tau1: float = TAU1, tau2: float = TAU2
    ) -> None:
        self.gain = positive_number("gain", gain)
        super().__init__(integrating_actuator(self.gain), sensors.COMMON, tau1, tau2)

    def __repr__(self) -> str:
        """Name the class and its arguments."""
        return f"CommonArm(gain={self.gain}, tau1={self.tau1}, tau2={self.tau2})"
