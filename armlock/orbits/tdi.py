r"""What time-delay interferometry leaves of the master's phase, in closed form.

All lasers follow the master's phase p: its own returns are eta_12 = D_12 D_21 p - p and
eta_13 = D_13 D_31 p - p, and the far spacecraft have none. With a = exp(-j omega tau1),
b = exp(-j omega tau2), and hats on what is made with the estimated round trips,

    X1 / p = (a - a^)(1 - b) - (b - b^)(1 - a),    X2 = (1 - a b) X1,

the second to first order in the errors. With moving arms and exact ranging, X1 is omega times
the difference between going arm 1 first and arm 2 first, tau1' tau2 - tau2' tau1.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, broadcast_shape, real_array
from armlock.orbits.constellation import Constellation

# The change of rates is taken over so many s to either side.
_HOUR = 3600.0


def ranging_residual(
    omega: npt.ArrayLike,
    tau1: npt.ArrayLike,
    tau2: npt.ArrayLike,
    error1: npt.ArrayLike = 0.0,
    error2: npt.ArrayLike = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Return |X1 / p| and |X2 / p| for estimates of constant round trips that are off.

    Parameters
    ----------
    omega : array_like of float
        Angular frequency in rad/s.
    tau1, tau2 : array_like of float
        Round trips in s.
    error1, error2 : array_like of float, optional
        What the estimates are too large by, in s. All five broadcast.

    Returns
    -------
    x1, x2 : float arrays, of the broadcast shape

    Raises
    ------
    TypeError, ValueError
        If an argument is not finite and real, or they do not broadcast.

    Examples
    --------
    One metre at 3 mHz:

    >>> from armlock.orbits.tdi import ranging_residual
    >>> x1, x2 = ranging_residual(0.006 * 3.141592653589793, 16.6794, 16.6146, 1 / 299792458)
    >>> print(f"{x1:.5e} {x2:.5e}")
    1.96108e-11 1.21063e-11
    """
    names = ("omega", "tau1", "tau2", "error1", "error2")
    values = zip(names, (omega, tau1, tau2, error1, error2), strict=True)
    arrays = tuple(real_array(name, value) for name, value in values)
    broadcast_shape(names, arrays)
    omega, tau1, tau2, error1, error2 = arrays
    # No digits are lost where a phase is small: 1 - a, 1 - b, and then a - a^, b - b^.
    one_less_a, one_less_b = -np.expm1(-1j * omega * tau1), -np.expm1(-1j * omega * tau2)
    error_a = -np.exp(-1j * omega * tau1) * np.expm1(-1j * omega * error1)
    error_b = -np.exp(-1j * omega * tau2) * np.expm1(-1j * omega * error2)
    x1 = error_a * one_less_b - error_b * one_less_a
    return np.abs(x1), np.abs(x1 * np.expm1(-1j * omega * (tau1 + tau2)))


def flexing(
    orbits: Constellation, t: npt.ArrayLike, generation: int, master: int = 1
) -> FloatArray:
    r"""Return by how much the two beams of X1 or X2 differ in length, with exact ranging.

    With dots for derivatives, to leading order

    .. math::

        \Delta_1 = \dot\tau_1 \tau_2 - \dot\tau_2 \tau_1 , \qquad
        \Delta_2 = (\tau_1 + \tau_2)\, \dot\Delta_1
        = (\tau_1 + \tau_2) (\ddot\tau_1 \tau_2 - \ddot\tau_2 \tau_1) .

    Parameters
    ----------
    orbits : Constellation
        Where the spacecraft are.
    t : array_like of float
        When both beams are back, in s; any shape; an hour within the orbits' span.
    generation : {1, 2}
        Of X1 or X2.
    master : {1, 2, 3}, optional
        The spacecraft with the laser.

    Returns
    -------
    float array, shaped like `t`
        In s; times omega it is |X / p|.

    Raises
    ------
    TypeError, ValueError
        If the generation is not 1 or 2, or t or the master is refused by the orbits.

    Examples
    --------
    >>> from armlock.orbits import kepler
    >>> from armlock.orbits.tdi import flexing
    >>> metres = 299792458 * flexing(kepler(), 100 * 86400.0, 1)
    >>> print(f"{metres:.2f}")
    -8.75
    """
    if generation not in (1, 2):
        raise ValueError(f"generation must be 1 or 2, got {generation!r}")
    t = real_array("t", t)
    tau1, tau2 = orbits.round_trips(t, master)
    rate1, rate2 = orbits.rates(t, master)
    if generation == 2:
        before, after = (orbits.rates(t + step, master) for step in (-_HOUR, _HOUR))
        rate1, rate2 = (
            0.5 * (tau1 + tau2) * (later - earlier) / _HOUR
            for earlier, later in zip(before, after, strict=True)
        )
    return np.asarray(rate1 * tau2 - rate2 * tau1)
