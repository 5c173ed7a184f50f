"""Semi-discretization: the delayed signal sampled, everything else exact.

Over a step h the delayed signal is held (order 0, as in the paper) or interpolated linearly
(order 1); the equation between the samples is solved exactly. What is left is a linear map
of the samples, stable when the spectral radius of its transition matrix is below one.

The map is an equation like the loop's own, affine in the same parameters, on the unit circle
instead of the imaginary axis, so that `unstable_roots`, `stability_chart` and `d_curve` take it
as they take the loop.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from flint import arb, arb_mat, arb_poly, ctx, fmpq, fmpq_mat, fmpq_poly

from armlock.checks import (
    FloatArray,
    check_memory,
    positive_number,
    real_number,
    whole_number,
    whole_steps,
)
from armlock.engine.polynomials import collected, exact
from armlock.stability.counts import at_points
from armlock.stability.roots import rightmost_root
from armlock.systems import NOW, Delay, Lag, Sum, System

# Bits of a map's coefficients.
_BITS = 400


def _continuous(system: Any) -> System:
    """Return a system that is no map and whose roots are all those of D, or raise."""
    found = System.of(system)
    if found.step:
        raise ValueError(f"system must be in continuous time, got a map with step {found.step}")
    return found


def _at_point(system: Any, values: Any, numbers: Any) -> Sum:
    """Return D at given parameters."""
    system = _continuous(system)
    given = {k: real_number(k, v) for k, v in system.given(values, numbers).items()}
    here = system.at(**given)
    found: Sum = here.numerator + here.denominator
    return found


def _observer(a: fmpq_poly, delayed: list[fmpq_poly]) -> tuple[Any, list[Any]]:
    """Return F, and the column G_k of each delayed polynomial, which are of lower degree."""
    powers, lead = range(a.degree() - 1, -1, -1), a.leading_coefficient()
    state = fmpq_mat(len(powers), len(powers))
    for i, k in enumerate(powers):
        state[i, 0] = -a[k] / lead
        if k:
            state[i, i + 1] = fmpq(1)
    columns = [fmpq_mat([[p[k] / lead] for k in powers]) for p in delayed]
    return state, columns


def _steps(lag: Lag, step: float) -> int:
    """Return how many steps a product of delays is long; each of its objects is so many."""
    return sum(n * whole_steps("delay", float(d.theta), step) for d, n in lag)


def _checked(step: float | None, order: int) -> float:
    """Return the step, or raise."""
    if whole_number("order", order, 0) > 1:
        raise ValueError(f"order must be 0 or 1, got {order!r}")
    return positive_number("step", step)


def _retarded(parts: dict[Any, fmpq_poly], size: int) -> None:
    """Raise unless all delayed terms are of lower degree than what nothing delays."""
    if any(p.degree() >= size for p in parts.values()):
        raise ValueError(
            "system must be of retarded type: a neutral loop feeds back the delayed signal "
            "itself, which semi-discretization does not smooth"
        )


def _realized(
    system: Any, values: Any, numbers: Any, step: float
) -> tuple[Any, list[Any], list[int]]:
    """Return F, the columns of delayed terms, and how many steps each of these is delayed."""
    # A delay whose parameter is zero keeps its place.
    whole = System.of(system)
    parts = dict.fromkeys(whole.numerator.lags | whole.denominator.lags, fmpq_poly([0]))
    parts |= _at_point(system, values, numbers).before()
    parts = dict(sorted(parts.items(), key=lambda part: part[0].time))
    undelayed = parts.pop(NOW, fmpq_poly([0]))
    _retarded(parts, undelayed.degree())
    found = collected((_steps(lag, step), -p) for lag, p in parts.items())
    return *_observer(undelayed, list(found.values())), list(found)


def _sampled(
    state: Any, delayed: list[Any], step: float, order: int
) -> tuple[Any, list[tuple[Any, Any]]]:
    """Return exp(F h) and, per delayed term, the columns of its older and newer sample.

    In balls of many bits: slow poles lie next to each other at z = 1, where rounded
    coefficients would scatter them.
    """
    states, h = state.nrows(), exact(step)
    flow, columns = (arb_mat(state) * arb(h)).exp(), []
    for column in delayed:
        # exp of this block matrix holds the integrals of exp(F u) G and of u exp(F u) G.
        block = fmpq_mat(states + 2, states + 2)
        for i in range(states):
            for k in range(states):
                block[i, k] = state[i, k]
            block[i, states] = column[i, 0]
        block[states, states + 1] = 1 / h
        integrals = (arb_mat(block) * arb(h)).exp()
        held, ramp = (
            arb_mat([[integrals[i, k]] for i in range(states)]) for k in (states, states + 1)
        )
        columns.append((held, held * 0) if order == 0 else (held - ramp, ramp))
    return flow, columns


def _map(
    state: Any, delayed: list[Any], step: float, order: int
) -> tuple[fmpq_poly, list[fmpq_poly]]:
    """Return A and the B_k of `semi_discretization`, polynomials of z.

    For a column v, the first row of adj(z - M) times v is det(z - M + v e_1) - det(z - M).
    """
    flow, columns = _sampled(state, delayed, step, order)
    states, whole = state.nrows(), flow.charpoly()

    def first_of_adjugate(column: Any) -> Any:
        moved = arb_mat(flow)
        for i in range(states):
            moved[i, 0] -= column[i, 0]
        return moved.charpoly() - whole

    z = arb_poly([0, 1])
    parts = [first_of_adjugate(v) + z * first_of_adjugate(w) for v, w in columns]
    return _middle(whole), [_middle(p) for p in parts]


def _middle(p: Any) -> fmpq_poly:
    """Return the middle of a polynomial in balls, exactly."""
    pairs = (c.mid().man_exp() for c in p.coeffs())
    return fmpq_poly([fmpq(m) * fmpq(2) ** int(e) for m, e in pairs])


def transition_matrix(
    system: System,
    *values: float,
    step: float,
    order: int = 0,
    **numbers: float,
) -> FloatArray:
    r"""Build the transition matrix of the semi-discretized loop.

    Parameters
    ----------
    system : System
        A retarded loop, for instance `CommonArm()`, or an equation.
    *values, **numbers : float, optional
        The parameters, in the order of their first use or by name; nominal ones by default.
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
        If a parameter is not a finite real number, the step does not divide a delay, the order
        is not 0 or 1, the loop is neutral, or the matrix does not fit into the memory.

    Notes
    -----
    In observer form the loop is z' = F z + sum_k G_k xi(t - theta_k), where xi is the first
    state. What is not delayed is part of F. With :math:`\theta_k = r_k h`, a step is

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
    step = _checked(step, order)
    state, delayed, steps = _realized(system, values, numbers, step)
    states, longest = state.nrows(), max(steps, default=0)
    # The matrix, and what its eigenvalues take.
    check_memory("step", (states + longest,) * 2, 24)
    with ctx.workprec(_BITS):
        flow, columns = _sampled(state, delayed, step, order)
    matrix = np.zeros((states + longest, states + longest))
    matrix[:states, :states] = np.array(flow.tolist(), np.float64)
    # The present sample is the first state, older ones stand behind the states.
    place = [0, *range(states, states + longest)]
    for back, (older, newer) in zip(steps, columns, strict=True):
        matrix[:states, place[back]] += np.array(older.tolist(), np.float64)[:, 0]
        matrix[:states, place[back - 1]] += np.array(newer.tolist(), np.float64)[:, 0]
    # A step later each sample is one step older.
    matrix[place[1:], place[:-1]] = 1.0
    return matrix


def spectral_radius(
    system: System,
    *values: npt.ArrayLike,
    step: float,
    order: int = 0,
    **numbers: npt.ArrayLike,
) -> FloatArray:
    r"""Spectral radius of the semi-discretized loop, certified.

    .. math::

        \rho(\Phi) = \max_i |\lambda_i(\Phi)|

    of the transition matrix.

    Parameters
    ----------
    system : System
        A retarded loop, for instance `CommonArm()`, or an equation.
    *values, **numbers : array_like of float, optional
        The parameters, as `unstable_roots` takes them.
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
        As `unstable_roots`, and if the step does not divide a delay, the order is not 0 or 1,
        or the loop is neutral.
    RootError
        If the rightmost root of the map is not certified, see `rightmost_root`.

    Notes
    -----
    It is exp(h Re s) of the rightmost root s of the map, see `semi_discretization`, whose
    coefficients are known to some 100 digits.

    Examples
    --------
    >>> from armlock import HayesEquation, spectral_radius
    >>> print(round(float(spectral_radius(HayesEquation(), -1, -1, step=0.1, order=1)), 12))
    0.941189374167
    """
    system, points, shape = at_points(system, values, numbers)
    h = _checked(step, order)
    maps = (semi_discretization(_fixed(system, point), h, order) for point in points.tolist())
    return np.exp([h * rightmost_root(one).real for one in maps]).reshape(shape)


def _fixed(system: System, point: list[float]) -> System:
    """Return the equation of a system at a point."""
    return System(_at_point(system, point, {}), Sum({}), {})


def semi_discretization(
    system: System, step: float, order: int = 0, **numbers: float
) -> System:
    r"""Equation of the semi-discretized loop, affine in the same parameters as the loop.

    Parameters
    ----------
    system : System
        A retarded loop, or an equation, in which all parameters stand before delayed signals.
    step : float
        Sampling step h in s; it must divide all delays.
    order : {0, 1}, optional
        As for `transition_matrix`.
    **numbers : float, optional
        Values of parameters; all others stay.

    Returns
    -------
    System
        The equation of the map, in powers of the one delay exp(-s h); its unstable roots are
        the eigenvalues of the transition matrix outside the unit circle.

    Raises
    ------
    ValueError
        As `transition_matrix`, and if a parameter stands before an undelayed signal: it then
        enters through exp(F h) and the map is not affine in it.

    Notes
    -----
    With F and the G_k of `transition_matrix`, the latter without their parameters x_k, the
    delays :math:`\theta_k = r_k h`, and :math:`z = e^{s h}`

    .. math::

        D &= \det \left( z - e^{F h} \right) - \sum_k x_k\, B_k z^{-r_k} , \\
        B_k &= \left[ \mathrm{adj} \left( z - e^{F h} \right)
        \left( V_k + z\, W_k \right) \right]_1 ,

    where the older and the newer sample enter with the columns

    .. math::

        V_k &= \int_0^h e^{F (h - u)}\, G_k\, \mathrm{d}u - W_k , \\
        W_k &= \int_0^h e^{F (h - u)}\, G_k\, \frac{u}{h}\, \mathrm{d}u

    to order 1. To order 0 the newer sample does not enter, W_k = 0. At z = 1 the map is a
    multiple of D(0) of the loop. The coefficients, of some 100 digits, are such that this holds
    exactly: a root at s = 0 stays a root at z = 1.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> from armlock.stability.semidiscretization import semi_discretization
    >>> unstable_roots(semi_discretization(CommonArm(), step=0.05), [0.9, 0.5], [1.05, 1.6])
    array([0, 5])
    """
    step, system = _checked(step, order), _continuous(system)
    system, at_zero = system.at(**numbers), system.at_zero
    if (at_zero or 0) > 1:
        raise ValueError(f"at_zero must be 0 or 1: a map keeps one root there, got {at_zero}")
    d = (system.numerator + system.denominator).terms
    for lag, names in d:
        if names and not lag:
            raise ValueError(
                f"the parameter {names[0]} of {system!r} stands before an undelayed signal, so "
                "that the map is not affine in it; use transition_matrix or spectral_radius at "
                "single points"
            )
    undelayed = d.get((NOW, ()), fmpq_poly([0]))
    size, late = undelayed.degree(), {key: -p for key, p in d.items() if key[0]}
    _retarded(late, size)
    steps = [_steps(lag, step) for lag, _ in late]
    state, columns = _observer(undelayed, list(late.values()))
    with ctx.workprec(_BITS):
        above, below = _map(state, columns, step, order)
    maps = [above, *below]
    at_rest = [undelayed[0], *(p[0] for p in late.values())]
    maps = _with_root_at_one(maps, at_rest)
    q, found = Delay.new(exact(step)), Sum({})
    for (names, back), p, sign in zip(
        [((), 0), *((names, back) for (_, names), back in zip(late, steps, strict=True))],
        maps, (1, *[-1] * len(late)), strict=True,
    ):  # fmt: skip
        for k, value in enumerate(p.coeffs()):
            lag = Lag.of({q: size - k + back})
            found = found + Sum.of(fmpq_poly([sign * value]), lag, *names)
    return System(found, Sum({}), system.nominal, step, at_zero)


def _with_root_at_one(maps: list[fmpq_poly], at_rest: list[fmpq]) -> list[fmpq_poly]:
    """Change lowest coefficients, by rounding errors, so that all are one multiple at z = 1."""
    sums = [p(fmpq(1)) for p in maps]
    largest = max(range(len(maps)), key=lambda k: abs(at_rest[k]))
    share = sums[largest] / at_rest[largest] if at_rest[largest] else fmpq(0)
    return [
        p + fmpq_poly([share * value - total])
        for p, value, total in zip(maps, at_rest, sums, strict=True)
    ]
