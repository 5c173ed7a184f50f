"""Published loops, ready to use: the white paper's, which could fly, and others beside it."""

from __future__ import annotations

from armlock import paper
from armlock.checks import positive_number
from armlock.controllers import Controller, white_paper
from armlock.loops import Loop, paper_loop
from armlock.sensors import COMMON, SINGLE, modified_dual


def flight_loop(
    mean_delay: float = 33.6,
    half_difference: float = 0.255,
    g2: float = 40.0,
    corner: float = paper.DUAL_SENSOR_CORNER,
    delay: float = 0.0,
) -> Loop:
    r"""Return the loop of the LISA Frequency Control White Paper, arm 1 the longer.

    The controller `armlock.controllers.white_paper` on the sensor
    `armlock.sensors.modified_dual`:

    .. math::

        L(s) = \tfrac12\, G^*(s)\, P_M(s)\, e^{-s\delta}

    Parameters
    ----------
    mean_delay : float, optional
        Mean round-trip delay in s.
    half_difference : float, optional
        Half the difference of the round-trip delays in s, below the mean in magnitude. If it
        is negative, arm 2 is the longer one.
    g2 : float, optional
        Gain of the controller, which the source does not print.
    corner : float, optional
        Corner of the difference arm's filter in rad/s, which the source does not print.
    delay : float, optional
        Dead time in s. The source has 5 us for the actuator, 2 us for the phasemeter, and
        1 / (2 pi 30 kHz) for the transponder, 12.3 us in all.

    Returns
    -------
    Loop

    Raises
    ------
    TypeError, ValueError
        If a number is not finite; the mean delay, g2 or the corner is not positive; the half
        difference is zero or not below the mean; or the dead time is negative.

    References
    ----------
    LISA Frequency Control White Paper (2009), Sec. 3; K. McKenzie, R. E. Spero and
    D. A. Shaddock, Phys. Rev. D 80, 102003 (2009).

    Examples
    --------
    >>> from armlock import flight_loop, unstable_roots
    >>> unstable_roots(flight_loop(), [1.0, 1.02], [1.0, 0.98])
    array([0, 2])
    """
    mapping = modified_dual(mean_delay, half_difference, corner)
    if abs(half_difference) >= mean_delay:
        raise ValueError(
            f"half_difference must be below mean_delay ({mean_delay}), got {half_difference}"
        )
    controller = white_paper(0.5 * positive_number("g2", g2))
    tau1, tau2 = mean_delay + half_difference, mean_delay - half_difference
    return Loop(controller, mapping, tau1, tau2, delay)


def published_loops() -> dict[str, Loop]:
    """Return the published loops by name, without a dead time.

    Returns
    -------
    dict of str to Loop
        - "white paper": `flight_loop()`, from the LISA Frequency Control White Paper (2009),
          Sec. 3; g2 and the sensor's corner are assumed
        - "Table II": `paper_loop()`, from Table II of Y. Shao, X. Zhao, L. Ma and M. Xin; the
          sensor's corner is assumed
        - "PI": gain 1e4, integral below 100 rad/s and arms of 20.1 s and 19.9 s, from the
          public code quickTDI, module TJ_lock
        - "high-gain single arm": the same controller on an arm of 20 s

    Examples
    --------
    >>> from armlock import published_loops
    >>> for name, loop in published_loops().items():
    ...     print(f"{name}: {loop.mapping.name}")
    white paper: modified dual
    Table II: dual
    PI: common
    high-gain single arm: single
    """
    proportional_integral = Controller((-100.0,), (0.0,), 1e4)
    return {
        "white paper": flight_loop(),
        "Table II": paper_loop(),
        "PI": Loop(proportional_integral, COMMON, 20.1, 19.9),
        "high-gain single arm": Loop(proportional_integral, SINGLE, 20.0, 20.0),
    }
