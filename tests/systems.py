"""Characteristic functions of many kinds, for tests that should hold for all of them."""

from __future__ import annotations

import numpy as np

from armlock import (
    CommonArm,
    Controller,
    DelayEquation,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
)
from armlock.sensors import COMMON
from tests.attack_judge import Sketch


def with_roots(*roots):
    """Ascending coefficients of the monic real polynomial with these roots."""
    return np.real(np.poly(roots))[::-1]


RETARDED = {
    "Hayes": HayesEquation(1.0),
    "single arm": SingleArm(1.0, 20.1),
    "common arm": CommonArm(),
    "common arm, close gain": CommonArm(gain=0.05, tau1=3.0, tau2=7.0),
    "dual arm": DualArm(gain=0.3),
    "common arm, dead time": CommonArm(0.4, 3.0, 2.1, delay=0.7),
    "dual arm, dead time": DualArm(0.3, 2.1, 1.7, 1.5, delay=0.4),
    "oscillator": DelayEquation([2.0, 0.3, 1.0], [1.0], [0.0, 1.0], 1.0, 2.5),
    "unstable oscillator": DelayEquation([2.0, -0.3, 1.0], [1.0, 0.5], [0.7], 0.4, 1.3),
    "double integrator": DelayEquation([0.0, 0.0, 1.0], [-0.3, -1.1], [0.2], 0.5, 0.9),
    "roots of A on the axis": DelayEquation(
        with_roots(1j, -1j, 0.0), [-0.4, 0.1, -0.9], [0.2, 0.3], 0.7, 1.1
    ),
    "third order, unstable A": DelayEquation(
        with_roots(0.4, -1.0, -2.0), [1.0, 0.2, 0.5], [0.6, -1.0], 1.0, 3.0
    ),
    "fourth order, two roots on the axis twice": DelayEquation(
        with_roots(2j, -2j, 2j, -2j), [0.5, -3.0, 0.0, 1.0], [1.0, 1.0], 0.3, 0.8
    ),
    "fifth order, mixed": DelayEquation(
        with_roots(0.1 + 1j, 0.1 - 1j, -1.0, -0.5 + 2j, -0.5 - 2j),
        [1.0, 0.0, -1.0, 0.4],
        [0.5, 1.0, 0.0, 0.0, 0.8],
        2.0,
        1.2,
    ),
    "no first parameter": DelayEquation([1.0, 1.0], [0.0], [1.0], 1.0, 2.0),
    "no second parameter": DelayEquation([1.0, 0.2, 1.0], [1.0], [0.0], 1.0, 2.0),
    "no parameter": DelayEquation(with_roots(0.5, -1.0), [0.0], [0.0], 1.0, 2.0),
    "undelayed first parameter": DelayEquation([0.5, 0.1, 1.0], [1.0, 1.0], [1.0], 0.0, 1.5),
    "equal delays": DelayEquation([1.0, 0.5, 1.0], [1.0, 0.2], [0.3, 1.0], 2.0, 2.0),
    "zero of B1 on the axis": DelayEquation(
        [1.0, 2.0, 3.0, 1.0], [1.0, 0.0, 1.0], [1.0], 1.0, 2.0
    ),
    "zero of B1 at the origin": DelayEquation([1.0, 2.0, 1.0], [0.0, 1.0], [1.5], 1.0, 2.0),
}

NEUTRAL = {
    "first order": DelayEquation([1.0, 1.0], [0.5, 1.0], [0.2, -0.5], 1.0, 1.7),
    "integrator": DelayEquation([0.0, 1.0], [-1.0, 0.8], [0.5], 1.0, 0.6),
    "second order, one neutral term": DelayEquation(
        [1.0, -0.2, 1.0], [0.3, 0.1], [0.4, 0.0, 1.0], 2.0, 1.0
    ),
    "third order, unstable A": DelayEquation(
        with_roots(0.3, -1.0, -1.0), [1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.5], 0.8, 1.5
    ),
    "dead time": Loop(Controller([-0.3], [0.2], 0.2), COMMON, 2.0, 1.5, 0.6),
}


def sketch_of(loop):
    """The same loop for the judge of `tests.attack`, which shares no code with armlock."""
    k, tau1, tau2 = loop.controller, loop.tau1, loop.tau2
    below = loop.mapping.denominator
    corner = below[1] / below[2] if loop.mapping.name == "dual" else 1.0
    return Sketch(
        k.zeros, k.poles, k.gain, loop.mapping.name, tau1, tau2, loop.delay, corner, tau1 - tau2
    )
