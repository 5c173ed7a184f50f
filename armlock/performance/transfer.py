"""The closed loop from each of its inputs to the locked laser.

An input is the laser's own noise, or an error in what is measured on an arm. Noise budget and
laser pulling are computed from these responses.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from armlock.checks import ComplexArray, complex_array, one_of
from armlock.engine.functions import common_zeros
from armlock.loops import Loop, checked_loop
from armlock.stability.counts import decided, require_stable


def transfer(
    loop: Loop,
    source: str,
    s: npt.ArrayLike,
) -> ComplexArray:
    r"""Evaluate the response of the locked laser to one of the inputs, at c1 = c2 = 1.

    With the controller K and the sensor's weights m1 and m2

    .. math::

        S &= \frac{1}{1 + L} , \qquad
        Y_k = -K m_k e^{-s\delta}\, S , \\
        Y_+ &= \tfrac12 (Y_1 + Y_2) , \qquad Y_- = \tfrac12 (Y_1 - Y_2)

    for the laser, for what adds to the signal of arm k, and for the sum and the difference of
    what adds to the two.

    Parameters
    ----------
    loop : Loop
        The loop.
    source : {"laser", "arm 1", "arm 2", "common", "differential"}
        The input: `S`, `Y_1`, `Y_2`, `Y_+` or `Y_-`.
    s : array_like of complex
        Laplace variable in rad/s.

    Returns
    -------
    complex array, shaped like `s`
        From phase to phase, or from frequency to frequency.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, there is no such input, or s is not finite.

    Examples
    --------
    >>> from armlock import flight_loop, transfer
    >>> print(f"{abs(transfer(flight_loop(), 'laser', 2j * 3.141592653589793 * 3e-3)):.2e}")
    1.13e-05
    """
    one_of("source", source, ("laser", *checked_loop(loop).paths))
    s = complex_array("s", s)
    # The closed system takes more bits than the open loop does, and has its limits at poles.
    with np.errstate(all="ignore"):
        found = np.asarray(1.0 / (1.0 + loop(s)))
        if source != "laser":
            found = np.asarray(-loop.paths[source](s) * found)
    at_poles = ~np.isfinite(found)
    if at_poles.any():
        found[at_poles] = loop.response(source)(s[at_poles])
    return found


def require_stable_loop(loop: Loop) -> None:
    """Raise unless a loop is stable: the response of an unstable one looks like another."""
    n, m, point = checked_loop(loop).open_functions((1.0, 1.0), {})
    with decided("no response", point):
        require_stable(n + m, common_zeros(n, m))
