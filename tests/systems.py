"""Characteristic functions of many kinds, for tests that should hold for all of them."""

from __future__ import annotations

import numpy as np

from armlock import (
    CommonArm,
    Controller,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    delay,
    equation,
    parameter,
    s,
)
from armlock.sensors import COMMON
from tests.attack_judge import Sketch


def with_roots(*roots):
    """Ascending coefficients of the monic real polynomial with these roots."""
    return np.real(np.poly(roots))[::-1]


def two_delays(rest, b1, b2, tau1, tau2, dead=0.0):
    """R - exp(-s dead) [x B1 exp(-s tau1) + y B2 exp(-s tau2)] = 0, by coefficients."""
    r, p, q = (sum(c * s**k for k, c in enumerate(given)) for given in (rest, b1, b2))
    x, y = parameter("x"), parameter("y")
    return equation(r - (x * p * delay(tau1) + y * q * delay(tau2)) * delay(dead))


RETARDED = {
    "Hayes": HayesEquation(1.0),
    "single arm": SingleArm(1.0, 20.1),
    "common arm": CommonArm(),
    "common arm, close gain": CommonArm(gain=0.05, tau1=3.0, tau2=7.0),
    "dual arm": DualArm(gain=0.3),
    "common arm, dead time": CommonArm(0.4, 3.0, 2.1).replace(delay=0.7),
    "dual arm, dead time": DualArm(0.3, 2.1, 1.7, 1.5).replace(delay=0.4),
    "oscillator": two_delays([2.0, 0.3, 1.0], [1.0], [0.0, 1.0], 1.0, 2.5),
    "unstable oscillator": two_delays([2.0, -0.3, 1.0], [1.0, 0.5], [0.7], 0.4, 1.3),
    "double integrator": two_delays([0.0, 0.0, 1.0], [-0.3, -1.1], [0.2], 0.5, 0.9),
    "roots of A on the axis": two_delays(
        with_roots(1j, -1j, 0.0), [-0.4, 0.1, -0.9], [0.2, 0.3], 0.7, 1.1
    ),
    "third order, unstable A": two_delays(
        with_roots(0.4, -1.0, -2.0), [1.0, 0.2, 0.5], [0.6, -1.0], 1.0, 3.0
    ),
    "fourth order, two roots on the axis twice": two_delays(
        with_roots(2j, -2j, 2j, -2j), [0.5, -3.0, 0.0, 1.0], [1.0, 1.0], 0.3, 0.8
    ),
    "fifth order, mixed": two_delays(
        with_roots(0.1 + 1j, 0.1 - 1j, -1.0, -0.5 + 2j, -0.5 - 2j),
        [1.0, 0.0, -1.0, 0.4],
        [0.5, 1.0, 0.0, 0.0, 0.8],
        2.0,
        1.2,
    ),
    "no first parameter": two_delays([1.0, 1.0], [0.0], [1.0], 1.0, 2.0),
    "no second parameter": two_delays([1.0, 0.2, 1.0], [1.0], [0.0], 1.0, 2.0),
    "no parameter": two_delays(with_roots(0.5, -1.0), [0.0], [0.0], 1.0, 2.0),
    "undelayed first parameter": two_delays([0.5, 0.1, 1.0], [1.0, 1.0], [1.0], 0.0, 1.5),
    "equal delays": two_delays([1.0, 0.5, 1.0], [1.0, 0.2], [0.3, 1.0], 2.0, 2.0),
    "zero of B1 on the axis": two_delays(
        [1.0, 2.0, 3.0, 1.0], [1.0, 0.0, 1.0], [1.0], 1.0, 2.0
    ),
    "zero of B1 at the origin": two_delays([1.0, 2.0, 1.0], [0.0, 1.0], [1.5], 1.0, 2.0),
}

NEUTRAL = {
    "first order": two_delays([1.0, 1.0], [0.5, 1.0], [0.2, -0.5], 1.0, 1.7),
    "integrator": two_delays([0.0, 1.0], [-1.0, 0.8], [0.5], 1.0, 0.6),
    "second order, one neutral term": two_delays(
        [1.0, -0.2, 1.0], [0.3, 0.1], [0.4, 0.0, 1.0], 2.0, 1.0
    ),
    "third order, unstable A": two_delays(
        with_roots(0.3, -1.0, -1.0), [1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.5], 0.8, 1.5
    ),
    "dead time": Loop(Controller([-0.3], [0.2], 0.2), COMMON, 2.0, 1.5, delay=0.6),
}


def sketch_of(loop):
    """The same loop for the judge of `tests.attack`, which shares no code with armlock."""
    k, tau1, tau2 = loop.controller, loop.tau1, loop.tau2
    below = loop.mapping.denominator
    corner = below[1] / below[2] if loop.mapping.name == "dual" else 1.0
    return Sketch(
        k.zeros(),
        k.poles(),
        k.gain,
        loop.mapping.name,
        tau1,
        tau2,
        loop.delay,
        corner,
        tau1 - tau2,
    )
