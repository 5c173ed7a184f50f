"""The loops of the paper: controller times signal mapping times delays.

The open loop of every configuration is

    L(s; c1, c2) = K exp(-s delay) [m1 (1 - c1 exp(-s tau1)) + m2 (1 - c2 exp(-s tau2))],

the product of the controller and actuator K, a dead time, and the signal of the two arms in
the signal mapping m1, m2. Clearing the denominators of 1 + L gives the characteristic function
of `armlock.characteristic`. The Hayes equation, which has no sensor, is one more.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import factorial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armlock import paper, sensors
from armlock.axis.exponentials import ExponentialSum, Polynomial
from armlock.characteristic import CharacteristicFunction
from armlock.checks import (
    ComplexArray,
    FloatArray,
    complex_array,
    positive_number,
    real_number,
    true_or_false,
)
from armlock.controllers import Controller, integrating_actuator, table_two, white_paper
from armlock.sensors import COMMON, SINGLE, SignalMapping, modified_dual


class HayesEquation(CharacteristicFunction):
    r"""The equation x'(t) = a x(t) + b x(t - tau), with free parameters (a, b).

    Its characteristic function is (paper, Sec. II, after Eq. 3)

    .. math::

        D(s; a, b) = s - a - b\, e^{-s\tau} .

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

    tau: float

    def __init__(self, tau: float = 1.0) -> None:
        tau = positive_number("tau", tau)
        super().__init__((0.0, 1.0), (1.0,), (1.0,), 0.0, tau, parameters=("a", "b"))
        self.made_from(tau=tau)


class Loop(CharacteristicFunction):
    r"""An arm-locking loop, with free parameters (c1, c2).

    Of a controller K and a signal mapping with weights m1 and m2, its open loop and its
    characteristic function are

    .. math::

        L(s) &= K e^{-s\delta} \left[ m_1 \left( 1 - c_1 e^{-s\tau_1} \right)
        + m_2 \left( 1 - c_2 e^{-s\tau_2} \right) \right] , \\
        D(s) &= R \left( 1 + L \right) , \qquad B_k = R K m_k ,

    where R, a polynomial, is the common denominator of L, and :math:`\delta` its dead time.

    Parameters
    ----------
    controller : Controller, python-control system, or (zeros, poles, gain)
        Controller times actuator, K(s), see `armlock.Controller.of`.
    mapping : SignalMapping or str
        The sensor: an object, for instance `armlock.sensors.COMMON`, or a name ("single",
        "common", "difference", "dual", "modified dual"), see `armlock.sensors.named`.
    tau1, tau2 : float
        Round-trip delays of the two arms, in s. A mapping without arm 2, such as "single",
        needs no tau2.
    delay : float, optional
        Dead time of the loop in s (actuator, phasemeter, transponder), zero or positive.

    Raises
    ------
    TypeError, ValueError
        If tau1 or tau2 is not a positive finite number, `delay` is negative, a polynomial is
        not finite and real, the open loop has more zeros than poles, or 1 + L vanishes at high
        frequency.

    Attributes
    ----------
    controller : Controller
        K(s).
    mapping : SignalMapping
        The weights m1 and m2.

    Notes
    -----
    Poles at s = 0 that controller, sensor or actuator cancel against zeros there drop out
    here, by construction, so that they leave no root at s = 0 in D.

    Examples
    --------
    A loop of one's own: a common-arm sensor, an integrator and a lead filter.

    >>> from armlock import Controller, Loop, unstable_roots
    >>> loop = Loop(Controller([-0.02], [0.0, -0.1], 1.0), "common", tau1=20.1, tau2=19.9)
    >>> unstable_roots(loop, [0.999, 1.001], 1.0)
    array([0, 1])

    The same with a dead time:

    >>> unstable_roots(loop.replace(delay=20e-6), 0.999)
    array(0)
    """

    controller: Controller
    mapping: SignalMapping

    def __init__(
        self,
        controller: Any,
        mapping: SignalMapping | str,
        tau1: float,
        tau2: float | None = None,
        delay: float = 0.0,
    ) -> None:
        tau1 = positive_number("tau1", tau1)
        delay = real_number("delay", delay)
        k, m, tau2 = Controller.of(controller), *_mapping_and_tau2(mapping, tau1, tau2)
        rest = np.convolve(k.denominator, m.denominator)
        arms = [np.convolve(k.numerator, p) for p in (m.numerator1, m.numerator2)]
        for name, b in zip(("m1", "m2"), arms, strict=True):
            if b.any() and b.size > rest.size:
                raise ValueError(
                    f"controller times signal mapping {name} must be proper, got "
                    f"{b.size - 1} zeros and {rest.size - 1} poles"
                )
        # The highest power of R (1 + L).
        highest = rest[-1] + sum(b[-1] for b in arms if b.size == rest.size)
        if not delay and abs(highest) <= 1e-12 * abs(rest[-1]):
            raise ValueError(
                f"the loop is not well posed: 1 + K (m1 + m2) must not vanish at high "
                f"frequency, got {highest / rest[-1]}"
            )
        # As many poles at s = 0 as all three have zeros there.
        common = min(int(np.flatnonzero(p)[0]) for p in (rest, *arms) if p.any())
        rest, b1, b2 = (p[common:] if p.any() else p for p in (rest, *arms))
        super().__init__(
            _factored(rest, k.poles, m.denominator),
            _factored(b1, k.zeros, m.numerator1),
            _factored(b2, k.zeros, m.numerator2),
            tau1,
            tau2,
            delay=delay,
            parameters=("c1", "c2"),
            reference=(1.0, 1.0),
        )
        vars(self).update(controller=k, mapping=m)
        given = mapping if isinstance(mapping, str) else m
        delays = {"tau1": tau1} | ({"tau2": tau2} if any(m.numerator2) else {})
        self.made_from(controller=k, mapping=given, **delays, delay=delay)

    def _identity(self) -> tuple[Any, ...]:
        """Return what two equal loops have in common: controller and mapping too."""
        return *super()._identity(), self.controller, self.mapping

    def arm_responses(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Evaluate K m1 exp(-s delay) and K m2 exp(-s delay), factor by factor.

        Parameters
        ----------
        s : array_like of complex
            Laplace variable in rad/s, any shape.

        Returns
        -------
        tuple of two complex arrays, shaped like `s`

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers, or holds a pole of K, m1 or m2.
        """
        s = complex_array("s", s)
        rest, b1, b2 = self.polynomials()
        for pole in set(rest.roots.tolist()):
            if (s == pole).any():
                raise ValueError(
                    f"s must not be a pole of the open loop, got {pole}: a limit there is not "
                    f"computed"
                )
        dead = np.exp(-s * self.delay)
        return b1.over(rest, s) * dead, b2.over(rest, s) * dead

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

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers, or holds a pole of K, m1 or m2, c1 or c2 is not
            finite and real, or the three do not broadcast.
        """
        s, c1, c2 = self._checked(s, c1, c2)
        first, second = self.arm_responses(s)
        result: ComplexArray = first * ((1.0 - c1) - c1 * np.expm1(-s * self.tau1))
        return result + second * ((1.0 - c2) - c2 * np.expm1(-s * self.tau2))


def _mapping_and_tau2(
    mapping: SignalMapping | str, tau1: float, tau2: float | None
) -> tuple[SignalMapping, float]:
    """Return the signal mapping as an object, and tau2: tau1 where there is no arm 2."""
    if not isinstance(mapping, SignalMapping | str):
        raise TypeError(
            f"mapping must be a SignalMapping, for instance armlock.sensors.COMMON, or a name "
            f"such as 'common', got {mapping!r}"
        )
    if mapping == "single" or (
        isinstance(mapping, SignalMapping) and not any(mapping.numerator2)
    ):
        tau2 = tau1
    if tau2 is None:
        raise TypeError(f"tau2 must be given: the signal mapping {mapping!r} has two arms")
    tau2 = positive_number("tau2", tau2)
    if isinstance(mapping, str):
        return sensors.named(mapping, tau1, tau2), tau2
    if not any(mapping.numerator1) and not any(mapping.numerator2):
        raise ValueError("mapping must not be zero: there would be no loop")
    return mapping, tau2


def _actuated(
    gain: float | None, default: float, controller: Any
) -> tuple[Controller, dict[str, Any]]:
    """Return K, gain / s or what stands in its place, and the argument that makes it."""
    if controller is None:
        gain = positive_number("gain", default if gain is None else gain)
        return integrating_actuator(gain), {"gain": gain}
    if gain is not None:
        raise ValueError(
            f"gain must be None where a controller takes the place of gain / s, got {gain}"
        )
    own = Controller.of(controller)
    return own, {"controller": own}


def _factored(
    product: FloatArray, roots: tuple[complex, ...], other: Sequence[float]
) -> Polynomial:
    """Return the product of two polynomials with the roots of both.

    Roots at s = 0 may have cancelled: as many are left as the degree says.
    """
    found = np.concatenate((roots, Polynomial.of(np.asarray(other, dtype=float)).roots))
    found = found[found != 0.0]
    at_zero = np.zeros(max(product.size - 1 - found.size, 0))
    every = np.concatenate((found, at_zero)).astype(np.complex128)
    return Polynomial(product, every, factored=product.size == every.size + 1)


def checked_loop(loop: Loop) -> Loop:
    """Return the loop, or say what was given in its place."""
    if not isinstance(loop, Loop):
        raise TypeError(f"loop must be a Loop, for instance CommonArm(), got {loop!r:.200}")
    return loop


def power_series(
    system: CharacteristicFunction, x: float | Fraction, y: float | Fraction, number: int
) -> tuple[list[Fraction], list[Fraction]]:
    """Return the first coefficients of R and of D - R in ascending powers of s, exactly."""
    rest = [Fraction(value) for value in system.rest.tolist()[:number]]
    rest += [Fraction(0)] * (number - len(rest))
    numerator, dead = [Fraction(0)] * number, -Fraction(system.delay)
    arms = (system.b1, system.tau1, x), (system.b2, system.tau2, y)
    for (b, delay, parameter), origin in zip(arms, system.reference, strict=True):
        late, here, there = dead - Fraction(delay), Fraction(parameter), Fraction(origin)
        for i, value in enumerate(b.tolist()[:number]):
            for j in range(number - i if value else 0):
                turn = there * dead**j - here * late**j
                numerator[i + j] += Fraction(value) * turn / factorial(j)
    return rest, numerator


class LoopAt(NamedTuple):
    """A loop at one pair of perturbations, L = N / R.

    Attributes
    ----------
    loop : Loop
        The loop.
    c1, c2 : float
        Multiplicative perturbations.
    """

    loop: Loop
    c1: float
    c2: float

    @classmethod
    def of(cls, loop: Loop, c1: float, c2: float) -> LoopAt:
        """Check a loop and its perturbations."""
        return cls(checked_loop(loop), real_number("c1", c1), real_number("c2", c2))

    def response(self, omega: npt.ArrayLike) -> ComplexArray:
        """Evaluate L(j omega), with omega in rad/s."""
        return self.loop.open_loop(1j * np.asarray(omega), self.c1, self.c2)

    def numerator(self) -> ExponentialSum:
        """Return N at s = j omega as an exponential sum."""
        return self.loop.sum_at(self.c1, self.c2).plus(
            self.loop.rest_on_boundary().scaled(-1.0)
        )

    def at_zero(self) -> tuple[int, Fraction, Fraction]:
        """Return how many factors s cancel in L = N / R, and N and R at s = 0 without them.

        Exact for the coefficients, delays and parameters as they are given.
        """
        loop, c1, c2 = self
        rest, numerator = power_series(loop, c1, c2, int(np.flatnonzero(loop.rest)[0]) + 1)
        pairs = enumerate(zip(numerator, rest, strict=True))
        return next((k, above, below) for k, (above, below) in pairs if above or below)

    def poles_at_zero(self) -> int:
        """Order of the pole of L at s = 0 once numerator and denominator have cancelled."""
        return int(np.flatnonzero(self.loop.rest)[0]) - self.at_zero()[0]

    def leading_radius(self) -> float:
        """Radius around s = 0 within which L is as simple as it gets, or the last one tried.

        With a pole of order n at s = 0, L s^n is constant to a part in 1000, and |L| is above
        1000. Without one L changes by less than a thousandth of |1 + L|.
        """
        loop, order = self.loop, self.poles_at_zero()
        sizes = np.abs(np.concatenate([p.roots for p in loop.polynomials()]))
        radius = 1e-3 * float(sizes[sizes > 0.0].min(initial=1.0 / loop.longest_delay))
        for _ in range(40):
            near, nearer = loop.open_loop([radius, 0.5 * radius], self.c1, self.c2)
            if order:
                settled = abs(nearer / near - 2.0**order) < 1e-3 and abs(near) > 1e3
            else:
                settled = abs(nearer - near) < 1e-3 * abs(1.0 + near)
            if settled:
                break
            radius *= 0.1
        return radius


class SingleArm(Loop):
    r"""Single-arm locking with an integrating actuator (paper, Secs. II and IV.A).

    .. math::

        L(s) &= \frac{g}{s} \left( 1 - c_1 e^{-s\tau} \right) , \\
        D(s) &= s + g - g\, c_1 e^{-s\tau} .

    The free parameter c1 is the paper's k2 and the gain its k1; c2 has no effect.

    Parameters
    ----------
    gain : float, optional
        Loop gain g in rad/s, 1 by default.
    tau : float, optional
        Round-trip delay in s.
    delay : float, optional
        Dead time in s, see `Loop`.
    controller : Controller, python-control system, or (zeros, poles, gain), optional
        K(s) in place of g / s, see `armlock.Controller.of`. The loop then has no gain.

    Raises
    ------
    TypeError, ValueError
        If gain or tau is not a positive finite number, there are both gain and controller, or
        as `Loop` does.

    Examples
    --------
    >>> from armlock import SingleArm, unstable_roots
    >>> unstable_roots(SingleArm(gain=1.0, tau=20.1), [0.99, 1.0, 1.01], 0.0)
    array([ 0, -1,  1])
    """

    gain: float
    tau: float

    def __init__(
        self,
        gain: float | None = None,
        tau: float = paper.TAU1,
        delay: float = 0.0,
        *,
        controller: Any = None,
    ) -> None:
        k, made = _actuated(gain, paper.COMMON_ARM_GAIN, controller)
        tau = positive_number("tau", tau)
        super().__init__(k, sensors.SINGLE, tau, delay=delay)
        self.made_from(**made, tau=tau, delay=self.delay)


class CommonArm(Loop):
    r"""Common-arm locking with an integrating actuator (paper, Eq. 4).

    .. math::

        L(s) &= \frac{g}{s}
        \left( 2 - c_1 e^{-s\tau_1} - c_2 e^{-s\tau_2} \right) , \\
        D(s) &= s + 2 g - g\, c_1 e^{-s\tau_1} - g\, c_2 e^{-s\tau_2} .

    Parameters
    ----------
    gain : float, optional
        Loop gain g in rad/s, 1 by default.
    tau1, tau2 : float, optional
        Round-trip delays in s.
    delay : float, optional
        Dead time in s, see `Loop`.
    controller : Controller, python-control system, or (zeros, poles, gain), optional
        K(s) in place of g / s, see `armlock.Controller.of`. The loop then has no gain.

    Raises
    ------
    TypeError, ValueError
        If gain or a delay is not a positive finite number, there are both gain and controller,
        or as `Loop` does.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> unstable_roots(CommonArm(gain=10.0), 1.0, 0.999)
    array(0)
    """

    gain: float

    def __init__(
        self,
        gain: float | None = None,
        tau1: float = paper.TAU1,
        tau2: float = paper.TAU2,
        delay: float = 0.0,
        *,
        controller: Any = None,
    ) -> None:
        k, made = _actuated(gain, paper.COMMON_ARM_GAIN, controller)
        super().__init__(k, sensors.COMMON, tau1, tau2, delay)
        self.made_from(**made, tau1=self.tau1, tau2=self.tau2, delay=self.delay)


class DualArm(Loop):
    r"""Dual-arm locking with an integrating actuator (paper, Sec. III.B).

    .. math::

        L(s) &= \frac{g}{s} \left[ (1 + E) \left( 1 - c_1 e^{-s\tau_1} \right) \right. \\
        &\quad + \left. (1 - E) \left( 1 - c_2 e^{-s\tau_2} \right) \right] , \\
        E(s) &= \frac{p}{(s + p)\, s\, \Delta\tau} .

    Parameters
    ----------
    gain : float, optional
        Loop gain g in rad/s, 10 by default.
    tau1, tau2 : float, optional
        Round-trip delays in s; they must differ, unless `difference` is given.
    corner : float, optional
        Corner frequency p of the sensor in rad/s. The paper gives none.
    difference : float, optional
        The dtau that scales the sensor's integral, in s: tau1 - tau2 by default, as in
        Sec. III.B. The source of Table I takes half of it.
    delay : float, optional
        Dead time in s, see `Loop`.
    controller : Controller, python-control system, or (zeros, poles, gain), optional
        K(s) in place of g / s, see `armlock.Controller.of`. The loop then has no gain.

    Raises
    ------
    TypeError, ValueError
        If gain, corner or a delay is not a positive finite number, the dtau is zero, there are
        both gain and controller, or as `Loop` does.

    Notes
    -----
    With the actuator's pole at s = 0 the sensor's integral makes L of order 1/s^2 there, and

    .. math::

        D(0) = g\, p\, (c_2 - c_1) .

    On the line c1 = c2 one of the two poles of L at s = 0 cancels: the root s = 0 that D has
    there is a hidden mode, not a zero of 1 + L. A count is reported as a boundary point all
    the same, for the mode does not decay.

    Examples
    --------
    >>> from armlock import DualArm, unstable_roots
    >>> unstable_roots(DualArm(gain=10.0), [1.0, 1.0, 1.0], [0.995, 1.0, 1.001])
    array([ 1, -1,  0])
    """

    gain: float
    corner: float
    difference: float

    def __init__(
        self,
        gain: float | None = None,
        tau1: float = paper.TAU1,
        tau2: float = paper.TAU2,
        corner: float = paper.DUAL_SENSOR_CORNER,
        *,
        difference: float | None = None,
        delay: float = 0.0,
        controller: Any = None,
    ) -> None:
        k, made = _actuated(gain, paper.DUAL_ARM_GAIN, controller)
        between = _delay_difference(tau1, tau2, difference)
        mapping = sensors.dual(corner, between)
        super().__init__(k, mapping, tau1, tau2, delay)
        vars(self).update(difference=between)
        # The dtau as it was given: by default it follows the delays.
        self.made_from(
            **made, tau1=self.tau1, tau2=self.tau2, corner=float(corner),
            difference=None if difference is None else between, delay=self.delay,
        )  # fmt: skip


def paper_loop(
    corner: float = paper.DUAL_SENSOR_CORNER,
    tau1: float = paper.TAU1,
    tau2: float = paper.TAU2,
    *,
    controller: Any = None,
    actuator: bool = False,
    difference: float | None = None,
    delay: float = 0.0,
) -> Loop:
    r"""Return the loop of the paper's Sec. IV: the controller of Table II on the dual sensor.

    With C the controller, or C / s where the actuator is in the loop, it is

    .. math::

        L(s) &= C \left[ (1 + E) \left( 1 - c_1 e^{-s\tau_1} \right) \right. \\
        &\quad + \left. (1 - E) \left( 1 - c_2 e^{-s\tau_2} \right) \right] , \\
        E(s) &= \frac{p}{(s + p)\, s\, \Delta\tau} .

    Parameters
    ----------
    corner : float, optional
        Corner frequency p of the sensor in rad/s. The paper gives none.
    tau1, tau2 : float, optional
        Round-trip delays in s; they must differ, unless `difference` is given.
    controller : Controller, python-control system, or (zeros, poles, gain), optional
        Table II by default; `armlock.controllers` has its stages and the printed variant.
    actuator : bool, optional
        Whether the integrating actuator 1/s of Secs. II and III is in the loop. Without it,
        the default, the paper's claims on the controller come true.
    difference : float, optional
        The dtau of the sensor in s, tau1 - tau2 by default.
    delay : float, optional
        Dead time in s, see `Loop`.

    Returns
    -------
    Loop
        Of neutral type without the actuator, of retarded type with it.

    Raises
    ------
    TypeError, ValueError
        If corner or a delay is not a positive finite number, or the dtau is zero.

    Examples
    --------
    >>> from armlock import paper_loop, unstable_roots
    >>> unstable_roots(paper_loop(), 1.0, [1.0, 1.0 - 1e-6])
    array([0, 0])
    """
    chosen = table_two() if controller is None else Controller.of(controller)
    if true_or_false("actuator", actuator):
        chosen = chosen * integrating_actuator()
    mapping = sensors.dual(corner, _delay_difference(tau1, tau2, difference))
    return Loop(chosen, mapping, tau1, tau2, delay)


def _delay_difference(tau1: float, tau2: float, difference: float | None) -> float:
    """Return the dtau of the dual sensor, tau1 - tau2 unless it is given."""
    if difference is not None:
        return real_number("difference", difference)
    return sensors.delay_difference(tau1, tau2)


def flight_loop(
    mean_delay: float = 33.6,
    half_difference: float = 0.255,
    g2: float = 40.0,
    corner: float = paper.DUAL_SENSOR_CORNER,
    delay: float = 0.0,
) -> Loop:
    r"""Return the loop of the LISA Frequency Control White Paper, arm 1 the longer.

    The controller `armlock.controllers.white_paper` on the sensor
    `armlock.sensors.modified_dual`:

    .. math::

        L(s) = \tfrac12\, G^*(s)\, P_M(s)\, e^{-s\delta}

    Parameters
    ----------
    mean_delay : float, optional
        Mean round-trip delay in s.
    half_difference : float, optional
        Half the difference of the round-trip delays in s, below the mean in magnitude. If it
        is negative, arm 2 is the longer one.
    g2 : float, optional
        Gain of the controller, which the source does not print.
    corner : float, optional
        Corner of the difference arm's filter in rad/s, which the source does not print.
    delay : float, optional
        Dead time in s. The source has 5 us for the actuator, 2 us for the phasemeter, and
        1 / (2 pi 30 kHz) for the transponder, 12.3 us in all.

    Returns
    -------
    Loop

    Raises
    ------
    TypeError, ValueError
        If a number is not finite; the mean delay, g2 or the corner is not positive; the half
        difference is zero or not below the mean; or the dead time is negative.

    References
    ----------
    LISA Frequency Control White Paper (2009), Sec. 3; K. McKenzie, R. E. Spero and
    D. A. Shaddock, Phys. Rev. D 80, 102003 (2009).

    Examples
    --------
    >>> from armlock import flight_loop, unstable_roots
    >>> unstable_roots(flight_loop(), [1.0, 1.02], [1.0, 0.98])
    array([0, 2])
    """
    mapping = modified_dual(mean_delay, half_difference, corner)
    if abs(half_difference) >= mean_delay:
        raise ValueError(
            f"half_difference must be below mean_delay ({mean_delay}), got {half_difference}"
        )
    controller = white_paper(0.5 * positive_number("g2", g2))
    tau1, tau2 = mean_delay + half_difference, mean_delay - half_difference
    return Loop(controller, mapping, tau1, tau2, delay)


def published_loops() -> dict[str, Loop]:
    """Return the published loops by name, without a dead time.

    Returns
    -------
    dict of str to Loop
        - "white paper": `flight_loop()`, from the LISA Frequency Control White Paper (2009),
          Sec. 3; g2 and the sensor's corner are assumed
        - "Table II": `paper_loop()`, from Table II of Y. Shao, X. Zhao, L. Ma and M. Xin; the
          sensor's corner is assumed
        - "PI": gain 1e4, integral below 100 rad/s and arms of 20.1 s and 19.9 s, from the
          public code quickTDI, module TJ_lock
        - "high-gain single arm": the same controller on an arm of 20 s

    Examples
    --------
    >>> from armlock import published_loops
    >>> for name, loop in published_loops().items():
    ...     print(f"{name}: {loop.mapping.name}")
    white paper: modified dual
    Table II: dual
    PI: common
    high-gain single arm: single
    """
    proportional_integral = Controller((-100.0,), (0.0,), 1e4)
    return {
        "white paper": flight_loop(),
        "Table II": paper_loop(),
        "PI": Loop(proportional_integral, COMMON, 20.1, 19.9),
        "high-gain single arm": Loop(proportional_integral, SINGLE, 20.0, 20.0),
    }
