"""Controllers found by search, with exact stability as the judge."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from armlock import paper
from armlock.controllers import Controller
from armlock.loops import Loop, paper_loop

#: Dead time in s of actuator, phasemeter and transponder in the white paper.
FLIGHT_DELAY: Final = 12.3e-6

# What searches found, rounded, in Hz; the tests find them again.
_ROBUST_POLES = (0.25e-6, 0.108e-6)
_ROBUST_LEADS = ((0.37e-6, 1), (16.8e-6, 3)), ((114.9e-6, 4),)
_ROLL_OFF_ZEROS = (0.111, 4.67, 29.5, 186.0, 1266.0, 15450.0)
_ROLL_OFF_POLES = (0.0059, 0.82, 8.91, 54.6, 342.0, 2228.0, 40e3)


def _robust_controller() -> Controller:
    zeros, poles = (
        tuple(-2.0 * math.pi * f for f, count in factors for _ in range(count))
        for factors in _ROBUST_LEADS
    )
    high_pass = tuple(-2.0 * math.pi * f for f in _ROBUST_POLES)
    return Controller((0.0, 0.0, *zeros), (*high_pass, *poles), paper.CONTROLLER_GAIN)


def robust_loop() -> Loop:
    r"""Return a loop of the paper's structure that withstands three times its perturbations.

    The controller has the two high-pass factors, the four lead-lag factors and the gain of
    Table II, on the paper's sensor and delays:

    .. math::

        C(s) = g\, \frac{s}{s + p_1}\, \frac{s}{s + p_2}\, \frac{s + z_1}{s + p_3}
        \left( \frac{s + z_2}{s + p_3} \right)^3

    with p1, p2, z1, z2 and p3 at 0.25, 0.108, 0.37, 16.8 and 114.9 microhertz. Nowhere from
    0.1 mHz to 1 Hz is its gain more than 0.05 dB below that of Table II. It was found by a
    search; no proof says that there is none better.

    Returns
    -------
    Loop

    Examples
    --------
    >>> from armlock import critical_perturbation, paper_loop, robust_loop
    >>> for loop in (paper_loop(), robust_loop()):
    ...     print(f"{critical_perturbation(loop, (1, -1)):.3e}")
    1.464e-06
    4.428e-06
    """
    return paper_loop(controller=_robust_controller())


def buildable_loop() -> Loop:
    r"""Return a loop that rolls off, with a dead time, and stable for the paper's perturbations.

    The controller of `robust_loop` with six zeros and seven poles from 6 mHz on, which take
    turns. So the gain falls by two thirds of a power of the frequency, and the phase by about
    sixty degrees. Sensor and delays are the paper's; the dead time is 12.3 microseconds.
    It was found by a search; no proof says that there is none better.

    Returns
    -------
    Loop
        Of retarded type.

    Examples
    --------
    >>> from armlock import buildable_loop, unstable_roots
    >>> loop = buildable_loop()
    >>> int(unstable_roots(loop, 1.0 + 1e-6, 1.0 - 1e-6))
    0
    """
    zeros, poles = (
        tuple(-2.0 * math.pi * f for f in corners)
        for corners in (_ROLL_OFF_ZEROS, _ROLL_OFF_POLES)
    )
    # A gain of one at low frequency.
    gain = abs(float(np.prod(poles) / np.prod(zeros)))
    controller = _robust_controller() * Controller(zeros, poles, gain)
    return paper_loop(controller=controller, delay=FLIGHT_DELAY)
