"""The loops of the paper: controller times signal mapping times delays.

The open loop of every configuration is

    L(s; c1, c2) = K exp(-s delay) [m1 (1 - c1 exp(-s tau1)) + m2 (1 - c2 exp(-s tau2))],

the product of the controller and actuator K, a dead time, and the signal of the two arms in
the signal mapping m1, m2. A `Loop` is a record of these parts, which simulation, noise budget
and pulling read. It is also the expression L in c1 and c2, which all other functions take like
any other `armlock.systems.System`. The Hayes equation has no sensor: it is an equation D = 0.
"""

from __future__ import annotations

from functools import cached_property
from numbers import Real
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from armlock import paper, sensors
from armlock.checks import (
    ComplexArray,
    not_negative,
    one_of,
    positive_number,
    true_or_false,
)
from armlock.controllers import integrating_actuator, table_two, white_paper
from armlock.sensors import COMMON, SINGLE, SignalMapping, modified_dual
from armlock.systems import NOW, Controller, Sum, System, equation, lag_of, parameter
from armlock.systems import delay as pure_delay
from armlock.systems import s as laplace
from armlock.tables import Table, as_html, number


def HayesEquation(tau: float = 1.0) -> System:
    r"""Return the equation x'(t) = a x(t) + b x(t - tau), with free parameters (a, b).

    Its characteristic function is (paper, Sec. II, after Eq. 3)

    .. math::

        D(s; a, b) = s - a - b\, e^{-s\tau} .

    Parameters
    ----------
    tau : float, optional
        Delay in s.

    Returns
    -------
    System
        An equation.

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
    late = pure_delay(positive_number("tau", tau))
    return equation(laplace - parameter("a") - parameter("b") * late)


class Loop(System):
    r"""An arm-locking loop, with free parameters (c1, c2).

    With a controller K and a signal mapping with weights m1 and m2, the open loop is

    .. math::

        L(s) = K e^{-s\delta} \left[ m_1 \left( 1 - c_1 e^{-s\tau_1} \right)
        + m_2 \left( 1 - c_2 e^{-s\tau_2} \right) \right] .

    It is a `System` and is combined like one: ``loop * filter``, ``loop.feedback()``. A loop
    with a third arm is written as an expression, see the last example.

    Parameters
    ----------
    controller : System, python-control system, or (zeros, poles, gain)
        Controller times actuator, K(s), see `armlock.System.of`.
    mapping : SignalMapping or str
        The sensor: an object, for instance `armlock.sensors.COMMON`, or a name ("single",
        "common", "difference", "dual", "modified dual"), see `armlock.sensors.NAMED`.
    tau1, tau2 : float
        Round-trip delays of the two arms, in s. A mapping without arm 2, such as "single",
        needs no tau2.
    delay : float, optional
        Dead time of the loop in s (actuator, phasemeter, transponder), zero or positive.

    Raises
    ------
    TypeError, ValueError
        If tau1 or tau2 is not a positive finite number, `delay` is negative, the controller is
        zero or holds a delay or a parameter, K m1 or K m2 has more zeros than poles, or 1 + L
        vanishes at high frequency.

    Attributes
    ----------
    controller : System
        K(s).
    mapping : SignalMapping
        The weights m1 and m2.
    arms : pair of System
        The two delays, which are two even if they are equally long.

    Notes
    -----
    A pole of controller, sensor or actuator at s = 0 that a zero cancels is removed by
    construction. It leaves no root of 1 + L at s = 0.

    Examples
    --------
    A loop of one's own: a common-arm sensor, an integrator and a lead filter.

    >>> from armlock import Controller, Loop, unstable_roots
    >>> loop = Loop(Controller([-0.02], [0.0, -0.1], 1.0), "common", tau1=20.1, tau2=19.9)
    >>> unstable_roots(loop, [0.999, 1.001], 1.0)
    array([0, 1])

    The same with a dead time:

    >>> unstable_roots(loop.replace(delay=20e-6), 0.999)
    0

    A third arm is a term of the sum, with a parameter of its own:

    >>> from armlock import delay, parameter, s
    >>> c1, c2, c3 = parameter("c1", 1.0), parameter("c2", 1.0), parameter("c3", 1.0)
    >>> mean = (3 - c1 * delay(20.1) - c2 * delay(19.9) - c3 * delay(20.0)) / 3
    >>> unstable_roots(mean / s, c3=[0.999, 1.001])
    array([0, 1])
    """

    controller: System
    mapping: SignalMapping
    tau1: float
    tau2: float
    delay: float
    arms: tuple[System, System]

    def __init__(
        self,
        controller: Any,
        mapping: SignalMapping | str,
        tau1: float,
        tau2: float | None = None,
        *,
        delay: float = 0.0,
    ) -> None:
        k = System.of(controller, "controller")
        sensor, tau1, tau2 = _mapping_and_delays(mapping, tau1, tau2)
        delay, arms = not_negative("delay", delay), (pure_delay(tau1), pure_delay(tau2))
        vars(self).update(
            controller=k, mapping=sensor, tau1=tau1, tau2=tau2, delay=delay, arms=arms
        )
        if not k.numerator:
            raise ValueError("controller must not be zero: there would be no loop")
        zeros, poles = k.rational("controller")
        m1, m2, below = sensor.polynomials
        first, second, rest = zeros * m1, zeros * m2, poles * below
        for name, weighed in (("m1", first), ("m2", second)):
            if weighed.degree() > rest.degree():
                raise ValueError(
                    f"controller times signal mapping {name} must be proper, got "
                    f"{weighed.degree()} zeros and {rest.degree()} poles"
                )
        highest = 1.0 + float((first + second)[rest.degree()] / rest.leading_coefficient())
        if not delay and abs(highest) <= 1e-12:
            raise ValueError(
                f"the loop is not well posed: 1 + K (m1 + m2) must not vanish at high "
                f"frequency, got {highest}"
            )
        now = lag_of(pure_delay(delay)) if delay else NOW
        one, other = [now.times(lag_of(arm)) for arm in arms]
        terms = {(now, ()): first + second, (one, ("c1",)): -first, (other, ("c2",)): -second}
        super().__init__(Sum(terms), Sum.of(rest), {"c1": 1.0, "c2": 1.0})

    def _table(self) -> Table:
        """Show the arguments, and no coefficients."""
        k = self.controller
        factors = f"{k.zeros().size} zeros and {k.poles().size} poles, gain {number(k.gain)}"
        rows = [("controller", factors), ("sensor", self.mapping.name)]
        rows += [(name, number(getattr(self, name), "s")) for name in ("tau1", "tau2", "delay")]
        return Table("Arm-locking loop with parameters c1 and c2", rows)

    _repr_html_ = as_html

    def __setattr__(self, name: str, value: Any) -> None:
        """Raise where an argument would change without the loop."""
        if name in vars(self):
            raise AttributeError(
                f"{name} of a loop cannot be set: write loop.replace({name}=...)"
            )
        super().__setattr__(name, value)

    def __repr__(self) -> str:
        """List the arguments."""
        return f"Loop({', '.join(f'{k}={v!r}' for k, v in self.arguments.items())})"

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments that make the loop, by name."""
        names = "controller", "mapping", "tau1", "tau2", "delay"
        return {name: getattr(self, name) for name in names}

    def replace(self, **changes: Any) -> Self:
        """Return another one, made with other values of some arguments.

        Parameters
        ----------
        **changes
            Arguments of the class, by name. All others stay as they are. The sensor stays too
            when its delays change. The delays of the other loop are objects of its own.

        Returns
        -------
        Loop

        Raises
        ------
        TypeError, ValueError
            As the class does.

        Examples
        --------
        >>> from armlock import CommonArm
        >>> CommonArm().replace(delay=20e-6).delay
        2e-05
        """
        return type(self)(**{**self.arguments, **changes})

    @cached_property
    def paths(self) -> dict[str, System]:
        """The paths from the signals of the arms to the laser, with the loop open.

        They are K m1 exp(-s delay) for "arm 1" and K m2 exp(-s delay) for "arm 2", half of
        their sum for "common", and half of their difference for "differential".
        """
        first, second = self.mapping.systems
        weights = first, second, (first + second) / 2, (first - second) / 2
        late = self.controller * pure_delay(self.delay)
        names = "arm 1", "arm 2", "common", "differential"
        return {name: late * weight for name, weight in zip(names, weights, strict=True)}

    def response(self, source: str) -> System:
        """Return the closed loop from an input to the locked laser, see `armlock.transfer`.

        Parameters
        ----------
        source : {"laser", "arm 1", "arm 2", "common", "differential"}
            The input.

        Raises
        ------
        TypeError, ValueError
            If there is no such input.
        """
        return self._closed[one_of("source", source, tuple(self._closed))]

    @cached_property
    def _closed(self) -> dict[str, System]:
        whole = 1 + self
        return {"laser": 1 / whole, **{k: -path / whole for k, path in self.paths.items()}}

    def arm_responses(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Evaluate K m1 exp(-s delay) and K m2 exp(-s delay) at s in rad/s, any shape."""
        return self.paths["arm 1"](s), self.paths["arm 2"](s)


def _mapping_and_delays(
    mapping: SignalMapping | str, tau1: float, tau2: float | None
) -> tuple[SignalMapping, float, float]:
    """Return the signal mapping as an object, and both delays: tau1 where there is no arm 2."""
    if not isinstance(mapping, SignalMapping | str):
        raise TypeError(
            "mapping must be a SignalMapping or a name, as in Loop(controller, 'single', tau1) "
            "or Loop(controller, 'common', tau1, tau2); with more arms write "
            f"controller * (m1 * (1 - c1 * delay(tau1)) + ...), got {mapping!r:.200}"
        )
    tau1 = positive_number("tau1", tau1)
    if isinstance(mapping, str):
        one_of("mapping", mapping, sensors.NAMED)
    if mapping == "single" or (
        isinstance(mapping, SignalMapping) and not any(mapping.numerator2)
    ):
        tau2 = tau1
    if tau2 is None:
        raise TypeError(f"tau2 must be given: the signal mapping {mapping!r} has two arms")
    tau2 = positive_number("tau2", tau2)
    if isinstance(mapping, str):
        return sensors.NAMED[mapping](tau1, tau2), tau1, tau2
    if not any(mapping.numerator1) and not any(mapping.numerator2):
        raise ValueError("mapping must not be zero: there would be no loop")
    return mapping, tau1, tau2


def _gain(gain: object, sensor: str) -> float:
    """Return a positive gain, or say what to write with a controller in its place."""
    if isinstance(gain, Real):
        return positive_number("gain", gain)
    raise TypeError(
        f"gain must be a real number, got {gain!r:.200}; with a controller of your own write "
        f'Loop(controller, "{sensor}", ...)'
    )


_SAMPLED = (
    "a simulation samples the factors of its controller, and noise and Doppler errors are "
    "those of its two arms; counts, charts, margins and step responses take any other system, "
    "with three arms too"
)


def checked_loop(loop: Any, reason: str = _SAMPLED) -> Loop:
    """Return the loop, or say what was given in its place, and why it must be a loop."""
    if not isinstance(loop, Loop):
        raise TypeError(
            f"loop must be a Loop, for instance CommonArm(): {reason}, got {loop!r:.200}"
        )
    return loop


def SingleArm(
    gain: float = 1.0,
    tau1: float = paper.TAU1,
) -> Loop:
    r"""Return single-arm locking with an integrating actuator (paper, Secs. II and IV.A).

    .. math::

        L(s) &= \frac{g}{s} \left( 1 - c_1 e^{-s\tau_1} \right) , \\
        D(s) &= s + g - g\, c_1 e^{-s\tau_1} .

    The free parameter c1 is the paper's k2 and the gain its k1; c2 has no effect.

    Parameters
    ----------
    gain : float, optional
        Loop gain g in rad/s, 1 by default.
    tau1 : float, optional
        Round-trip delay in s.

    Returns
    -------
    Loop

    Raises
    ------
    TypeError, ValueError
        If gain or tau1 is not a positive finite number, or as `Loop` does.

    Examples
    --------
    >>> from armlock import SingleArm, unstable_roots
    >>> unstable_roots(SingleArm(gain=1.0, tau1=20.1), [0.99, 1.0, 1.01], 0.0)
    array([0, 0, 1])
    """
    return Loop(integrating_actuator(_gain(gain, "single")), SINGLE, tau1)


def CommonArm(
    gain: float = 1.0,
    tau1: float = paper.TAU1,
    tau2: float = paper.TAU2,
) -> Loop:
    r"""Return common-arm locking with an integrating actuator (paper, Eq. 4).

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

    Returns
    -------
    Loop

    Raises
    ------
    TypeError, ValueError
        If gain or a delay is not a positive finite number, or as `Loop` does.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> unstable_roots(CommonArm(gain=10.0), 1.0, 0.999)
    0
    """
    return Loop(integrating_actuator(_gain(gain, "common")), COMMON, tau1, tau2)


def DualArm(
    gain: float = 10.0,
    tau1: float = paper.TAU1,
    tau2: float = paper.TAU2,
    corner: float = paper.DUAL_SENSOR_CORNER,
    *,
    difference: float | None = None,
) -> Loop:
    r"""Return dual-arm locking with an integrating actuator (paper, Sec. III.B).

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

    Returns
    -------
    Loop

    Raises
    ------
    TypeError, ValueError
        If gain, corner or a delay is not a positive finite number, the dtau is zero,
        or as `Loop` does.

    Notes
    -----
    With the actuator's pole at s = 0 the sensor's integral makes L of order 1/s^2 there, and

    .. math::

        D(0) = g\, p\, (c_2 - c_1) .

    On the line c1 = c2 one of the two poles of L at s = 0 cancels: the root s = 0 that D has
    there is a hidden mode of the actuator, not a zero of 1 + L.

    Examples
    --------
    >>> from armlock import DualArm, unstable_roots
    >>> unstable_roots(DualArm(gain=10.0), [1.0, 1.0, 1.0], [0.995, 1.0, 1.001])
    array([1, 0, 0])
    """
    mapping = sensors.dual(corner, tau1 - tau2 if difference is None else difference)
    return Loop(integrating_actuator(_gain(gain, "dual")), mapping, tau1, tau2)


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
    controller : System, python-control system, or (zeros, poles, gain), optional
        Table II by default; `armlock.controllers` has its stages and the printed variant.
    actuator : bool, optional
        Whether the integrating actuator 1/s of Secs. II and III is in the loop. Without it,
        the default, the paper's claims on the controller hold.
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
        If corner, tau1 or tau2 is not a positive finite number, the dtau is zero, or as `Loop`
        does.

    Examples
    --------
    >>> from armlock import paper_loop, unstable_roots
    >>> unstable_roots(paper_loop(), 1.0, [1.0, 1.0 - 1e-6])
    array([0, 0])
    """
    chosen = table_two() if controller is None else System.of(controller, "controller")
    if true_or_false("actuator", actuator):
        chosen = chosen * integrating_actuator()
    mapping = sensors.dual(corner, tau1 - tau2 if difference is None else difference)
    return Loop(chosen, mapping, tau1, tau2, delay=delay)


def flight_loop(
    mean_delay: float = 33.6,
    half_difference: float = 0.255,
    g2: float = 40.0,
    corner: float = paper.DUAL_SENSOR_CORNER,
    *,
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
        1 / (2 pi 30 kHz) for the transponder, 12.3 us in all. A transponder acts on the
        returned light alone: to put its dead time here is the source's model, and leaves out
        the shape of its response (chapter 15 of the book).

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
    tau1, tau2 = mean_delay + half_difference, mean_delay - half_difference
    controller = white_paper(0.5 * positive_number("g2", g2))
    return Loop(controller, mapping, tau1, tau2, delay=delay)


def _at_hertz(*corners: float) -> list[float]:
    """Return zeros or poles with corners in Hz."""
    return [-2.0 * np.pi * f for f in corners]


def robust_loop() -> Loop:
    r"""Return a loop of the paper's structure that tolerates nearly three times as much.

    The controller has the two high-pass factors, the four lead-lag factors and the gain of
    Table II, on the paper's sensor and delays:

    .. math::

        C(s) = g\, \frac{s}{s + p_1}\, \frac{s}{s + p_2}\, \frac{s + z_1}{s + p_3}
        \left( \frac{s + z_2}{s + p_3} \right)^3

    with p1, p2, z1, z2 and p3 at 0.25, 0.108, 0.37, 16.75 and 114.7 microhertz. From
    0.1 mHz to 1 Hz its gain is at most 0.05 dB below the gain of Table II. A search found the
    controller; a better one may exist.

    Returns
    -------
    Loop

    Examples
    --------
    >>> from armlock import critical_perturbation, paper_loop, robust_loop
    >>> for loop in (paper_loop(), robust_loop()):
    ...     print(f"{critical_perturbation(loop, (1, -1)):.3e}")
    1.464e-06
    4.375e-06
    """
    # What a search found, rounded; chapter 11 finds one like it from round numbers.
    zeros = _at_hertz(0.37e-6, *[16.75e-6] * 3)
    poles = _at_hertz(0.25e-6, 0.108e-6, *[114.7e-6] * 4)
    return paper_loop(controller=((0.0, 0.0, *zeros), poles, paper.CONTROLLER_GAIN))


def buildable_loop() -> Loop:
    r"""Return a loop that rolls off, with a dead time, stable over the paper's box.

    The controller is that of `robust_loop` with seven poles and six zeros above 6 mHz, in
    alternating order. Its gain falls with about the power 2/3 of the frequency, and its phase
    by about sixty degrees. Sensor and delays are the paper's; the dead time is 12.3
    microseconds. A search found the controller; a better one may exist.

    Returns
    -------
    Loop
        Of retarded type.

    Examples
    --------
    >>> from armlock import buildable_loop, unstable_roots
    >>> loop = buildable_loop()
    >>> unstable_roots(loop, 1.0 + 1e-6, 1.0 - 1e-6)
    0
    """
    # What a search found, rounded.
    zeros = _at_hertz(0.111, 4.67, 29.5, 186.0, 1266.0, 15450.0)
    poles = _at_hertz(0.0059, 0.82, 8.91, 54.6, 342.0, 2228.0, 40e3)
    # A gain of one at low frequency.
    gain = abs(float(np.prod(poles) / np.prod(zeros)))
    controller = robust_loop().controller * Controller(zeros, poles, gain)
    return paper_loop(controller=controller, delay=12.3e-6)
