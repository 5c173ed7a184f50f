"""State space of a delay equation, in which a single signal is delayed.

With C and A as in `armlock.characteristic.CharacteristicFunction`, D xi = 0 reads

    A xi = -C xi(t - delay) + x B1 xi(t - delay - delay1) + y B2 xi(t - delay - delay2).

In observer form, with a delayed term k for each of the three, that is

    z'(t) = F z(t) + sum_k G_k xi(t - theta_k)
    xi(t) = z_1(t) + sum_k d_k xi(t - theta_k)

with as many states as D has degree, and d_k = 0 for retarded equations.
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
        If x or y is not a finite real number, or the system is a map.
    """
    name1, name2 = checked_system(system).parameters
    x, y = real_number(name1, x), real_number(name2, y)
    if system.step:
        raise ValueError(
            f"system must be in continuous time, got a map with step {system.step}"
        )
    undelayed = system.a.copy()
    terms = []
    for weight, b, delay in (
        (-1.0, system.c, system.delay),
        (x, system.b1, system.delay + system.delay1),
        (y, system.b2, system.delay + system.delay2),
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
    return Realization(state, tuple(delayed))
