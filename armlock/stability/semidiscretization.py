"""Semi-discretization: the delayed signal sampled, everything else exact.

Over a step h the delayed signal is held (order 0, as in the paper) or interpolated linearly
(order 1); the equation between the samples is solved exactly. What is left is a linear map
of the samples, stable when the spectral radius of its transition matrix is below one.

The characteristic function of the map has the same affine form as that of the loop, on the
unit circle instead of the imaginary axis, so that `unstable_roots`, `stability_chart` and
`d_curve` take it as they take the loop.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import mpmath
import numpy as np
import numpy.typing as npt

from armlock.characteristic import (
    CharacteristicFunction,
    DelayEquation,
    broadcast_parameters,
    checked_system,
    given_or_one,
)
from armlock.checks import (
    FloatArray,
    check_memory,
    positive_number,
    real_number,
    whole_number,
    whole_steps,
)
from armlock.controllers import with_others
from armlock.engine.roots import RootError

# Digits of a map's coefficients.
_DIGITS = 100
# Bits of Schur's test, at first and at most.
_BITS, _MOST_BITS = 800, 25600
# A spectral radius is found to this share of itself. Below the least one it counts as zero.
_SHARE, _LEAST = 2.0**-54, 1e-300


class DelayedTerm(NamedTuple):
    """One delayed term at given parameters: delay, input column and direct share."""

    delay: float
    column: FloatArray
    direct: float


def realize(
    system: CharacteristicFunction, x: float | None, y: float | None
) -> tuple[FloatArray, list[DelayedTerm]]:
    r"""Return a state space of `system` at (x, y), in which a single signal is delayed.

    With C and A as in `armlock.characteristic.CharacteristicFunction`, D xi = 0 reads

    .. math::

        A\, \xi = -C\, \xi(t - \delta) + x\, B_1\, \xi(t - \delta - \tau_1)
        + y\, B_2\, \xi(t - \delta - \tau_2) .

    In observer form, with as many states as D has degree and a term k for each delay, that is

    .. math::

        \dot z(t) &= F z(t) + \sum_k G_k\, \xi(t - \tau_k) , \\
        \xi(t) &= z_1(t) + \sum_k d_k\, \xi(t - \tau_k) .

    Parameters
    ----------
    system : CharacteristicFunction
        With polynomials in s.
    x, y : float
        The free parameters.

    Returns
    -------
    state : float array, shape (n, n)
        The matrix F. Terms without delay are part of it.
    delayed : list of DelayedTerm
        The others, free parameters included; d_k = 0 for retarded equations.

    Raises
    ------
    TypeError, ValueError
        If x or y is not a finite real number, or the system is a map.
    """
    name1, name2 = checked_system(system).parameters
    given1, given2 = given_or_one(system, x, y)
    x, y = real_number(name1, given1), real_number(name2, given2)
    if system.step:
        raise ValueError(
            f"system must be in continuous time, got a map with step {system.step}"
        )
    undelayed = system.a.copy()
    terms = []
    for weight, b, delay in (
        (-1.0, system.c, system.delay),
        (x, system.b1.coefficients, system.delay + system.tau1),
        (y, system.b2.coefficients, system.delay + system.tau2),
    ):
        padded = np.zeros_like(undelayed)
        padded[: b.size] = weight * b
        if delay == 0.0:
            undelayed -= padded
        else:
            terms.append((delay, padded))
    # Descending powers below the highest one, as the observer form lists them.
    lead = undelayed[-1]
    below = undelayed[-2::-1] / lead
    state = np.diag(np.ones(system.degree - 1), 1)
    state[:, 0] = -below
    delayed = []
    for delay, b in terms:
        direct = float(b[-1] / lead)
        delayed.append(DelayedTerm(delay, b[-2::-1] / lead - direct * below, direct))
    return state, delayed


def _checked(system: CharacteristicFunction, step: float | None, order: int) -> float:
    """Return the step, or raise for what cannot be semi-discretized."""
    step = positive_number("step", step)
    if whole_number("order", order, 0) > 1:
        raise ValueError(f"order must be 0 or 1, got {order!r}")
    if checked_system(system).neutral:
        raise ValueError(
            "system must be of retarded type: a neutral loop feeds back the delayed signal "
            "itself, which semi-discretization does not smooth"
        )
    for name in ("delay", "tau1", "tau2"):
        whole_steps(name, getattr(system, name), step)
    return step


def _sampled(
    state: FloatArray, delayed: list[DelayedTerm], step: float, order: int
) -> tuple[Any, list[tuple[Any, Any]]]:
    """Return exp(F h) and, per delayed term, the columns of its older and newer sample.

    In extended precision: slow poles lie next to each other at z = 1, where rounded
    coefficients would scatter them.
    """
    states, h = len(state), mpmath.mpf(step)
    flow, columns = mpmath.expm(mpmath.matrix(state.tolist()) * h), []
    for term in delayed:
        # exp of this block matrix holds the integrals of exp(F u) G and of u exp(F u) G.
        block = mpmath.zeros(states + 2)
        block[:states, :states] = mpmath.matrix(state.tolist())
        block[:states, states] = mpmath.matrix(term.column.tolist())
        block[states, states + 1] = 1 / h
        integrals = mpmath.expm(block * h)
        held, ramp = integrals[:states, states], integrals[:states, states + 1]
        columns.append((held, 0 * held) if order == 0 else (held - ramp, ramp))
    return flow, columns


def _map(
    state: FloatArray, delayed: list[DelayedTerm], step: float, order: int
) -> tuple[list[Any], list[list[Any]]]:
    """Return A and the B_k of `semi_discretization` in ascending powers of z.

    By the recursion of Faddeev and LeVerrier for the adjugate of z - exp(F h).
    """
    flow, columns = _sampled(state, delayed, step, order)
    states = len(state)
    a, b = [mpmath.mpf(1)], [[mpmath.mpf(0)] * (states + 1) for _ in columns]
    power = mpmath.eye(states)
    for k in range(1, states + 1):
        for numerator, (older, newer) in zip(b, columns, strict=True):
            numerator[states - k] += (power[0, :] * older)[0]
            numerator[states - k + 1] += (power[0, :] * newer)[0]
        power = flow * power
        a.append(-sum(power[i, i] for i in range(states)) / k)
        power += a[-1] * mpmath.eye(states)
    return a[::-1], b


def transition_matrix(
    system: CharacteristicFunction,
    c1: float | None = None,
    c2: float | None = None,
    step: float | None = None,
    order: int = 0,
) -> FloatArray:
    r"""Build the transition matrix of the semi-discretized loop.

    Parameters
    ----------
    system : CharacteristicFunction
        A retarded loop, for instance `CommonArm()`.
    c1, c2 : float, optional
        The two free parameters. Those of a loop are one if they are not given.
    step : float
        Sampling step h in s; it must divide all delays.
    order : {0, 1}, optional
        0 holds the delayed sample xi(t_{i-r}) over the step, as the paper does; 1
        interpolates linearly to the next one.

    Returns
    -------
    float array, shape (n + r, n + r)
        For the states at t_i and the r = longest delay / h samples before t_i; n is the
        order of the equation.

    Raises
    ------
    TypeError, ValueError
        If c1 or c2 is not a finite real number, the step does not divide a delay, the order is
        not 0 or 1, the loop is neutral, or the matrix does not fit into the memory.

    Notes
    -----
    In state space the loop is z' = F z + sum_k G_k xi(t - theta_k), where xi is the first
    state, G_1 contains c1 and G_2 contains c2. What is not delayed is part of F (`realize`).
    With :math:`\theta_k = r_k h`, a step is

    .. math::

        z_{i+1} = e^{F h} z_i
        + \sum_k \int_0^h e^{F (h - u)}\, G_k\, \hat\xi_k(u)\, \mathrm{d}u

    where the delayed signal is replaced, to order 0 and 1, by

    .. math::

        \hat\xi_k(u) &= \xi_{i-r_k} , \\
        \hat\xi_k(u) &= \left( 1 - \frac{u}{h} \right) \xi_{i-r_k}
        + \frac{u}{h}\, \xi_{i-r_k+1} .

    The matrix takes :math:`(z_i, \xi_{i-1}, \ldots, \xi_{i-r})` to the same a step later.

    Of the common arm, order 0 makes Eq. (8) of the paper in its corrected form; see Insperger
    and Stepan, ch. 3:

    .. math::

        \varphi_{i+1} &= e^{-2 g h} \varphi_i \\
        &\quad + \frac{1 - e^{-2 g h}}{2}
        \left( c_1 \varphi_{i-r_1} + c_2 \varphi_{i-r_2} \right)

    Examples
    --------
    One state and ten samples of its past; without the delayed term the state decays by
    exp(-h) a step.

    >>> from armlock import HayesEquation, transition_matrix
    >>> matrix = transition_matrix(HayesEquation(tau=1.0), -1.0, 0.0, step=0.1)
    >>> matrix.shape
    (11, 11)
    >>> print(f"{matrix[0, 0]:.6f}")
    0.904837
    """
    step = _checked(system, step, order)
    # The matrix, and what its eigenvalues take.
    check_memory("step", (system.degree + round(system.longest_delay / step),) * 2, 24)
    state, delayed = realize(system, c1, c2)
    with mpmath.workdps(_DIGITS):
        flow, columns = _sampled(state, delayed, step, order)
    states = len(state)
    steps = [whole_steps("delay", term.delay, step) for term in delayed]
    longest = max(steps, default=0)
    matrix = np.zeros((states + longest, states + longest))
    matrix[:states, :states] = np.array(flow.tolist(), np.float64)
    # The present sample is the first state, older ones stand behind the states.
    place = [0, *range(states, states + longest)]
    for back, (older, newer) in zip(steps, columns, strict=True):
        matrix[:states, place[back]] += np.array(list(older), np.float64)
        matrix[:states, place[back - 1]] += np.array(list(newer), np.float64)
    # A step later each sample is one step older.
    matrix[place[1:], place[:-1]] = 1.0
    return matrix


def spectral_radius(
    system: CharacteristicFunction,
    c1: npt.ArrayLike | None = None,
    c2: npt.ArrayLike | None = None,
    step: float | None = None,
    order: int = 0,
) -> FloatArray:
    r"""Spectral radius of the semi-discretized loop, certified.

    .. math::

        \rho(\Phi) = \max_i |\lambda_i(\Phi)|

    of the transition matrix.

    Parameters
    ----------
    system : CharacteristicFunction
        A retarded loop, for instance `CommonArm()` or `HayesEquation()`.
    c1, c2 : array_like of float, optional
        The two free parameters; they broadcast. Those of a loop are one if they are not given.
        Others, such as a and b of `HayesEquation`, have to be given.
    step : float
        Sampling step h in s; it must divide all delays.
    order : {0, 1}, optional
        As for `transition_matrix`.

    Returns
    -------
    float array, of the broadcast shape
        Below one where the map is stable.

    Raises
    ------
    TypeError, ValueError
        If c1 or c2 is not finite and real or the two do not broadcast, if the step does not
        divide a delay, if the order is not 0 or 1, or if the loop is neutral.
    RootError
        If Schur's test is not decided.

    Notes
    -----
    Schur's test tells whether all roots of the characteristic polynomial lie within a circle.
    The coefficients have 100 digits, and the rounding of the test is bounded. The spectral
    radius lies between a circle that passes the test and one that does not, found by halving
    an interval.

    Examples
    --------
    >>> from armlock import HayesEquation, spectral_radius
    >>> print(round(float(spectral_radius(HayesEquation(), -1, -1, step=0.1, order=1)), 12))
    0.941189374167
    """
    xs, ys = broadcast_parameters(system, c1, c2)
    h = _checked(system, step, order)
    radii = [_radius(system, p, q, h, order) for p, q in zip(xs.flat, ys.flat, strict=True)]
    return np.array(radii, np.float64).reshape(xs.shape)


def _radius(
    system: CharacteristicFunction, x: float, y: float, step: float, order: int
) -> float:
    """Return the spectral radius at one point."""
    state, delayed = realize(system, x, y)
    with mpmath.workdps(_DIGITS):
        a, b = _map(state, delayed, step, order)
        longest = max((whole_steps("delay", term.delay, step) for term in delayed), default=0)
        powers = [mpmath.mpf(0)] * longest + a
        for term, numerator in zip(delayed, b, strict=True):
            late = longest - whole_steps("delay", term.delay, step)
            for k, value in enumerate(numerator):
                powers[late + k] -= value
        # Halving leads to no circle of radius one, on which a root often lies.
        low, high = mpmath.mpf(0), mpmath.mpf(3) / 2
        while not _within(powers, high):
            low, high = high, 2 * high
        while high - low > _SHARE * high and high > _LEAST:
            middle = (low + high) / 2
            low, high = (low, middle) if _within(powers, middle) else (middle, high)
        return float(high)


def _within(powers: list[Any], radius: Any) -> bool:
    """Whether all roots of a polynomial lie within a radius."""
    bits = _BITS
    while (found := _schur(powers, radius, bits)) is None:
        bits *= 2
        if bits > _MOST_BITS:
            raise RootError(
                f"it is not decided whether a root exceeds {radius}", complex(radius)
            )
    return found


def _schur(powers: list[Any], radius: Any, bits: int) -> bool | None:
    """Test step by step whether all roots lie within a radius; None if it is not decided.

    In whole multiples of 2^-bits, with a bound of what they are off by.
    """
    with mpmath.workprec(bits):
        scaled = [value * radius**k for k, value in enumerate(powers)]
        largest = max(map(abs, scaled))
        p = np.array([int(mpmath.ldexp(v / largest, bits)) for v in scaled], dtype=object)
    off = 8 * len(p)
    while len(p) > 1:
        lead, last = abs(p[-1]) - off, abs(p[0]) + off
        if last >= lead:
            return False if last - lead > 4 * off else None
        share, wrong = (p[0] << bits) // p[-1], (2 * off << bits) // lead + 1
        off = 2 * off + (wrong * (abs(p).max() + off) >> bits) + 3
        p = p[1:] - (p[-2::-1] * share >> bits)
    return True


def semi_discretization(
    system: CharacteristicFunction, step: float, order: int = 0
) -> CharacteristicFunction:
    r"""Characteristic function of the semi-discretized loop, affine like the loop's own.

    Parameters
    ----------
    system : CharacteristicFunction
        A retarded loop in which both free parameters stand before a delayed signal.
    step : float
        Sampling step h in s; it must divide all delays.
    order : {0, 1}, optional
        As for `transition_matrix`.

    Returns
    -------
    CharacteristicFunction
        With polynomials in exp(s h); its unstable roots are the eigenvalues of the
        transition matrix outside the unit circle.

    Raises
    ------
    ValueError
        As `transition_matrix`, and if a free parameter stands before an undelayed signal:
        it then enters through exp(F h) and the map is not affine in it.

    Notes
    -----
    With F and the G_k of `transition_matrix`, the latter for x = y = 1, the delays
    :math:`\theta_k = r_k h`, and :math:`z = e^{s h}`

    .. math::

        D &= \det \left( z - e^{F h} \right)
        - x\, B_1 z^{-r_1} - y\, B_2 z^{-r_2} , \\
        B_k &= \left[ \mathrm{adj} \left( z - e^{F h} \right)
        \left( V_k + z\, W_k \right) \right]_1 ,

    where the older and the newer sample enter with the columns

    .. math::

        V_k &= \int_0^h e^{F (h - u)}\, G_k\, \mathrm{d}u - W_k , \\
        W_k &= \int_0^h e^{F (h - u)}\, G_k\, \frac{u}{h}\, \mathrm{d}u

    to order 1. To order 0 the newer sample does not enter, W_k = 0.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> from armlock.stability.semidiscretization import semi_discretization
    >>> unstable_roots(semi_discretization(CommonArm(), step=0.05), [0.9, 0.5], [1.05, 1.6])
    array([0, 5])
    """
    step = _checked(system, step, order)
    for name, delay in zip(system.parameters, (system.tau1, system.tau2), strict=True):
        if system.delay + delay == 0.0:
            raise ValueError(
                f"the free parameter {name} of {system!r} stands before an undelayed signal, "
                f"so that the map is not affine in it; use transition_matrix or "
                f"spectral_radius at single points"
            )
    return with_others(partial(_equation, step=step, order=order), system)


def _equation(system: CharacteristicFunction, step: float, order: int) -> DelayEquation:
    """Return the map of a system that was checked."""
    with mpmath.workdps(_DIGITS):
        a, b = _map(*realize(system, 1.0, 1.0), step, order)
    # Those before x and y; with a dead time there is a third one, x0 B1 + y0 B2.
    a, b1, b2 = ([float(value) for value in p] for p in (a, *b[-2:]))
    return DelayEquation(
        a, b1, b2, system.tau1, system.tau2, delay=system.delay, step=step,
        parameters=system.parameters,
        # Without a dead time x0 B1 + y0 B2 is a part of the flow.
        reference=system.reference if system.delay else (0.0, 0.0),
    )  # fmt: skip
