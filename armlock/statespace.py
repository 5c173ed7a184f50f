"""State space of a delay equation, in which a single signal is delayed.

D xi = 0 reads A xi = x B1 xi(t - delay1) + y B2 xi(t - delay2). In observer form that is

    z'(t) = F z(t) + x G1 xi(t - delay1) + y G2 xi(t - delay2)
    xi(t) = z_1(t) + x d1 xi(t - delay1) + y d2 xi(t - delay2)

with as many states as D has degree, and d1 = d2 = 0 for retarded equations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import FloatArray, real_number


class DelayedTerm(NamedTuple):
    """One delayed term at given parameters: delay, input column and direct share."""

    delay: float
    column: FloatArray
    direct: float


class Realization(NamedTuple):
    """State matrix F, shape (n, n), and the delayed terms, free parameters included."""

    state: FloatArray
    delayed: tuple[DelayedTerm, ...]


def realize(system: CharacteristicFunction, x: float, y: float) -> Realization:
    r"""Return the observer form of `system` at (x, y).

    .. math::

        \dot z(t) &= F z(t) + \sum_k G_k\, \xi(t - \theta_k) , \\
        \xi(t) &= z_1(t) + \sum_k d_k\, \xi(t - \theta_k)

    Parameters
    ----------
    system : CharacteristicFunction
        With polynomials in s.
    x, y : float
        The free parameters.

    Returns
    -------
    Realization
        Terms without delay are part of the state matrix.

    Raises
    ------
    TypeError, ValueError
        If x or y is not a finite real number, the system is a map, or the terms without delay
        cancel the highest power, so that no state form exists.
    """
    name1, name2 = checked_system(system).parameters
    x, y = real_number(name1, x), real_number(name2, y)
    if system.step:
        raise ValueError(
            f"system must be in continuous time, got a map with step {system.step}"
        )
    undelayed = system.a.copy()
    terms = []
    for parameter, b, delay in (
        (x, system.b1, system.delay1),
        (y, system.b2, system.delay2),
    ):
        padded = np.zeros_like(undelayed)
        padded[: b.size] = parameter * b
        if delay == 0.0:
            undelayed -= padded
        else:
            terms.append((delay, padded))
    lead = undelayed[-1]
    if lead == 0.0:
        raise ValueError(
            f"the loop {system!r} is not well posed at ({x}, {y}): its highest power cancels"
        )
    # Descending powers below the highest one, as the observer form lists them.
    below = undelayed[-2::-1] / lead
    state = np.diag(np.ones(system.degree - 1), 1) if system.degree else np.zeros((0, 0))
    if system.degree:
        state[:, 0] = -below
    delayed = []
    for delay, b in terms:
        direct = float(b[-1] / lead)
        delayed.append(DelayedTerm(delay, b[-2::-1] / lead - direct * below, direct))
    return Realization(state, tuple(delayed))
