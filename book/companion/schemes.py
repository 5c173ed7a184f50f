"""Standard discretizations, to compare semi-discretization with.

With a constant step that divides both delays, each of them is a map that is affine in
(c1, c2), and so a `CharacteristicFunction`: what counts and charts the loop takes it as well.
Chebyshev polynomials over the longest delay approximate many roots at once, of any loop.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BarycentricInterpolator

from armlock.characteristic import CharacteristicFunction, DelayEquation
from armlock.checks import ComplexArray
from armlock.loops import Loop
from armlock.stability.semidiscretization import realize, semi_discretization


def sampled_loop(
    loop: Loop,
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
    loop : Loop
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
    """
    return DelayEquation(
        (-present, lead),
        (held[0], newer),
        (held[1], newer),
        loop.tau1,
        loop.tau2,
        step=step,
        parameters=loop.parameters,
    )


def standard_schemes(loop: Loop, step: float) -> dict[str, CharacteristicFunction]:
    """Return the maps of semi-discretization and of standard schemes, by name.

    Parameters
    ----------
    loop : Loop
        The loop.
    step : float
        Sampling step h in s, which divides both delays.
    """
    gain = loop.controller.gain * step
    # Runge-Kutta's polynomial for exp(-2 g h), the delayed signals constant over the step.
    stages = sum((-2.0 * gain) ** k / f for k, f in enumerate((1.0, 1.0, 2.0, 6.0, 24.0)))
    driven = 0.5 * (1.0 - stages)
    half = 0.5 * gain
    return {
        "semi-discretization, order 0": semi_discretization(loop, step, 0),
        "semi-discretization, order 1": semi_discretization(loop, step, 1),
        "Runge-Kutta 4, delays held": sampled_loop(loop, step, stages, (driven, driven)),
        "trapezoidal rule": sampled_loop(
            loop, step, 1.0 - gain, (half, half), lead=1.0 + gain, newer=half
        ),
        "explicit Euler": sampled_loop(loop, step, 1.0 - 2.0 * gain, (gain, gain)),
        "implicit Euler": sampled_loop(
            loop, step, 1.0, (0.0, 0.0), lead=1.0 + 2.0 * gain, newer=gain
        ),
    }


def pseudospectral_roots(
    system: CharacteristicFunction, x: float, y: float, degree: int
) -> ComplexArray:
    """Approximate the characteristic roots of smallest magnitude, rightmost first.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, in continuous time.
    x, y : float
        The free parameters.
    degree : int
        Degree of the Chebyshev polynomial on the interval of the longest delay. Roots of
        magnitude up to about degree / delay are resolved.

    Returns
    -------
    complex array, shape (degree + order of the equation,)
        Eigenvalues in descending order of real part: approximations, some of them spurious.
    """
    state, terms = realize(system, x, y)
    states = len(state)
    # A term without effect would only add spurious eigenvalues.
    delayed = [term for term in terms if term.column.any() or term.direct != 0.0]
    longest = max((term.delay for term in delayed), default=0.0)
    if longest == 0.0:
        eigenvalues = np.linalg.eigvals(state).astype(np.complex128)
        return eigenvalues[np.argsort(-eigenvalues.real)]
    # Chebyshev points from the present back to the longest delay.
    history = 0.5 * longest * (np.cos(np.pi * np.arange(degree + 1) / degree) - 1.0)
    interpolate = BarycentricInterpolator(history, np.eye(degree + 1))
    difference = interpolate.derivative(history)
    rows = [interpolate(-term.delay) for term in delayed]
    # xi(0) in terms of the states and the history behind it.
    direct = sum((t.direct * row for t, row in zip(delayed, rows, strict=True)))
    present = np.zeros(states + degree)
    present[:1] = 1.0 if states else 0.0
    present[states:] += np.asarray(direct)[1:]
    present /= 1.0 - np.asarray(direct)[0]
    matrix = np.zeros((states + degree, states + degree))
    matrix[:states, :states] = state
    for term, row in zip(delayed, rows, strict=True):
        signal = row[0] * present
        signal[states:] += row[1:]
        matrix[:states] += np.outer(term.column, signal)
    matrix[states:] = np.outer(difference[1:, 0], present)
    matrix[states:, states:] += difference[1:, 1:]
    eigenvalues = np.linalg.eigvals(matrix).astype(np.complex128)
    return eigenvalues[np.argsort(-eigenvalues.real)]
