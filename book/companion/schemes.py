"""Standard discretizations of the common arm, to compare semi-discretization with.

With a constant step that divides both delays, each of them is a map that is affine in
(c1, c2), and so a `CharacteristicFunction`: what counts and charts the loop takes it as well.
"""

from __future__ import annotations

import control
import numpy as np
from numpy.polynomial import polynomial as poly

from armlock.characteristic import CharacteristicFunction, checked_system, whole_steps
from armlock.checks import ComplexArray, positive_number, real_number, whole_number
from armlock.loops import CommonArm
from armlock.semidiscretization import semi_discretization

#: Highest order of the Padé approximants; beyond, their coefficients lose their digits.
HIGHEST_ORDER = 60


def _common_arm(loop: object) -> CommonArm:
    if not isinstance(loop, CommonArm):
        raise TypeError(f"loop must be a CommonArm, got {loop!r}")
    return loop


def sampled_loop(
    loop: CommonArm,
    step: float,
    present: float,
    held: tuple[float, float],
    *,
    lead: float = 1.0,
    newer: float = 0.0,
) -> CharacteristicFunction:
    r"""Write a scheme of constant step as a map.

    With the weights p = present, l = lead, n = newer, and w_1, w_2 = held,

    .. math::

        l\, \varphi_{i+1} &= p\, \varphi_i + \sum_{k=1}^{2} c_k
        \left( w_k\, \varphi_{i-r_k} + n\, \varphi_{i-r_k+1} \right) , \\
        r_k &= \tau_k / h .

    Parameters
    ----------
    loop : CommonArm
        The loop that the scheme discretizes.
    step : float
        Sampling step h in s, which divides both delays.
    present : float
        Weight of the present sample.
    held : pair of float
        Weights of the two delayed samples, before c1 and c2.
    lead : float, optional
        Weight of the new sample.
    newer : float, optional
        Weight of the samples that follow the delayed ones.

    Returns
    -------
    CharacteristicFunction
        With free parameters (c1, c2).

    Raises
    ------
    TypeError, ValueError
        If the loop is no common arm, a weight is not finite and real, or the step is not
        positive or does not divide both delays.
    """
    loop = _common_arm(loop)
    present, lead, newer = (
        real_number(name, value)
        for name, value in (("present", present), ("lead", lead), ("newer", newer))
    )
    return CharacteristicFunction(
        (-present, lead),
        (real_number("held[0]", held[0]), newer),
        (real_number("held[1]", held[1]), newer),
        loop.tau1,
        loop.tau2,
        step=positive_number("step", step),
        parameters=loop.parameters,
    )


def standard_schemes(loop: CommonArm, step: float) -> dict[str, CharacteristicFunction]:
    """Return semi-discretization and standard schemes of one step.

    Parameters
    ----------
    loop : CommonArm
        The loop.
    step : float
        Sampling step h in s; it must divide both delays.

    Returns
    -------
    dict of str to CharacteristicFunction
        Maps by name.

    Raises
    ------
    TypeError, ValueError
        If the loop is no common arm, or the step is not positive or does not divide both
        delays.
    """
    gain = _common_arm(loop).gain * positive_number("step", step)
    stages = sum((-2.0 * gain) ** k / f for k, f in enumerate((1.0, 1.0, 2.0, 6.0, 24.0)))
    driven = 0.5 * (1.0 - stages)
    return {
        "semi-discretization, order 0": semi_discretization(loop, step, 0),
        "semi-discretization, order 1": semi_discretization(loop, step, 1),
        "Runge-Kutta 4, delays held": sampled_loop(loop, step, stages, (driven, driven)),
        "trapezoidal rule": sampled_loop(
            loop, step, 1 - gain, (gain / 2, gain / 2), lead=1 + gain, newer=gain / 2
        ),
        "explicit Euler": sampled_loop(loop, step, 1 - 2 * gain, (gain, gain)),
        "implicit Euler": sampled_loop(
            loop, step, 1.0, (0.0, 0.0), lead=1 + 2 * gain, newer=gain
        ),
    }


def map_eigenvalues(system: CharacteristicFunction, x: float, y: float) -> ComplexArray:
    """Eigenvalues of a map, from its companion matrix.

    Parameters
    ----------
    system : CharacteristicFunction
        A map, whose step divides both delays.
    x, y : float
        The free parameters.

    Returns
    -------
    complex array, shape (degree + longest delay / step,)

    Raises
    ------
    TypeError, ValueError
        If x or y is not a finite real number, or the system is no map.
    """
    name1, name2 = checked_system(system).parameters
    x, y = real_number(name1, x), real_number(name2, y)
    if not system.step:
        raise ValueError(f"system must be a map, got {system!r} in continuous time")
    back = [
        whole_steps(name, delay, system.step)
        for name, delay in (("delay1", system.delay1), ("delay2", system.delay2))
    ]
    longest = max(back)
    powers = np.zeros(longest + system.a.size)
    powers[longest:] = system.a
    for value, b, steps in zip((x, y), (system.b1, system.b2), back, strict=True):
        powers[longest - steps : longest - steps + b.size] -= value * b
    return np.asarray(poly.polyroots(powers), dtype=np.complex128)


def pade_poles(loop: CommonArm, x: float, y: float, order: int) -> ComplexArray:
    """Poles of the closed loop with both delays replaced by Padé approximants.

    Parameters
    ----------
    loop : CommonArm
        The loop.
    x, y : float
        c1 and c2.
    order : int
        Order of both approximants, from 1 to 60.

    Returns
    -------
    complex array, shape (2 order + 1,)

    Raises
    ------
    TypeError, ValueError
        If the loop is no common arm, x or y is not a finite real number, or the order is out
        of range.
    """
    loop = _common_arm(loop)
    x, y = real_number("c1", x), real_number("c2", y)
    order = whole_number("order", order, 1, HIGHEST_ORDER)
    arms = [
        control.ss(control.tf(*control.pade(delay, order))) for delay in (loop.tau1, loop.tau2)
    ]
    actuator = control.ss(control.tf([loop.gain], [1.0, 0.0]))
    closed = control.feedback(actuator * (2.0 - x * arms[0] - y * arms[1]), 1.0)
    return np.asarray(closed.poles(), dtype=np.complex128)
