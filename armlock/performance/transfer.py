"""The closed loop from each of its inputs to the locked laser.

An input is the laser's own noise, or an error in what is measured on an arm. Noise budget and
laser pulling are made from these responses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from armlock.checks import ComplexArray, axis, one_of, positive_array, real_number
from armlock.loops import Loop, checked_loop

if TYPE_CHECKING:
    import control

#: The inputs of a loop: the laser, both arms, and the sum and difference of the arms.
INPUTS = ("laser", "arm 1", "arm 2", "common", "differential")


def transfer(
    loop: Loop,
    source: str,
    s: npt.ArrayLike,
    c1: npt.ArrayLike = 1.0,
    c2: npt.ArrayLike = 1.0,
) -> ComplexArray:
    r"""Evaluate the response of the locked laser to one of the inputs.

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
        The input: S, Y_1, Y_2, Y_+ or Y_-.
    s : array_like of complex
        Laplace variable in rad/s.
    c1, c2 : array_like of float, optional
        Multiplicative perturbations. All three broadcast.

    Returns
    -------
    complex array, of the broadcast shape
        From phase to phase, or from frequency to frequency.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, there is no such input, or s, c1 or c2 is refused by
        `Loop.open_loop`, for instance s at a pole of the open loop.

    Examples
    --------
    >>> from armlock import flight_loop, transfer
    >>> print(f"{abs(transfer(flight_loop(), 'laser', 2j * 3.141592653589793 * 3e-3)):.2e}")
    1.13e-05
    """
    return responses(loop, s, c1, c2)[one_of("source", source, INPUTS)]


def responses(
    loop: Loop, s: npt.ArrayLike, c1: npt.ArrayLike = 1.0, c2: npt.ArrayLike = 1.0
) -> dict[str, ComplexArray]:
    """Evaluate the responses to all inputs at once, as `transfer` gives them one by one.

    Parameters
    ----------
    loop, s, c1, c2
        As for `transfer`.

    Returns
    -------
    dict of str to complex array, of the broadcast shape
    """
    sensitivity = 1.0 / (1.0 + checked_loop(loop).open_loop(s, c1, c2))
    first, second = loop.arm_responses(s)
    errors = {
        "arm 1": first,
        "arm 2": second,
        "common": 0.5 * (first + second),
        "differential": 0.5 * (first - second),
    }
    found = {name: np.asarray(-error * sensitivity) for name, error in errors.items()}
    return {"laser": np.asarray(sensitivity), **found}


def closed_loop(
    loop: Loop, omega: npt.ArrayLike, c1: float = 1.0, c2: float = 1.0
) -> control.FrequencyResponseData:
    """Return the responses to all inputs as one python-control object, with exact delays.

    Parameters
    ----------
    loop : Loop
        The loop.
    omega : array_like of float, one-dimensional
        Angular frequencies in rad/s, positive.
    c1, c2 : float, optional
        Multiplicative perturbations.

    Returns
    -------
    control.FrequencyResponseData
        With one output, "locked laser", and the inputs of `transfer`.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, omega is not positive and one-dimensional, or c1 or c2 is not
        finite and real.

    Examples
    --------
    >>> from armlock import closed_loop, flight_loop
    >>> response = closed_loop(flight_loop(), [0.01, 0.1])
    >>> response.input_labels
    ['laser', 'arm 1', 'arm 2', 'common', 'differential']
    """
    import control

    omega = axis("omega", np.atleast_1d(positive_array("omega", omega)))
    found = responses(loop, 1j * omega, real_number("c1", c1), real_number("c2", c2))
    return control.frd(
        np.array([[*found.values()]]), omega, inputs=list(INPUTS), outputs=["locked laser"]
    )
