"""Second opinions: the same quantities by other routes, sharing no code with armlock.

Only the terms of N + M are read from a system, by `terms`, the factors of a loop, and the
numbers of the paper.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
from flint import fmpq, fmpq_poly
from numba import njit
from scipy.linalg import block_diag
from scipy.special import lambertw

from armlock import paper
from tests import dense


def terms(system, x, y):
    """Coefficients in ascending powers of s, exactly, and delay of all terms of D = N + M."""
    values = dict(zip(system.parameters, (x, y), strict=False))
    found: dict[Fraction, list[Fraction]] = {}
    for part in (system.numerator, system.denominator):
        for (lag, names), whole in part.terms.items():
            p = [Fraction(str(c)) for c in whole.coeffs()]
            delay = sum((Fraction(str(one.theta)) * power for one, power in lag), Fraction(0))
            factor = math.prod(Fraction(float(values[name])) for name in names)
            known = found.setdefault(delay, [Fraction(0)] * len(p))
            known += [Fraction(0)] * (len(p) - len(known))
            for k, value in enumerate(p):
                known[k] += factor * value
    return found


def value(system, s, x, y):
    """D(s; x, y), spelled out."""
    return dense.value(floats(system, x, y), s)


def count(system, x, y, at_zero=0):
    """Unstable roots of D(s; x, y); as many at s = 0 as `at_zero` says are divided out."""
    return dense.count(floats(system, x, y), at_zero)


def floats(system, x, y):
    """The terms of D as `tests.dense` takes them."""
    found = terms(system, x, y).items()
    return {float(t): np.array([float(v) for v in p[::-1]]) for t, p in found}


def each(system, s, x, y):
    """The terms of D(s; x, y) in mpmath's precision."""
    s = mpmath.mpc(s)
    return [
        mpmath.exp(-s * mpmath.mpf(t.numerator) / t.denominator)
        * sum(mpmath.mpf(v.numerator) / v.denominator * s**k for k, v in enumerate(p))
        for t, p in terms(system, x, y).items()
    ]


def exact(system, s, x, y):
    """D(s; x, y) in mpmath's precision; of a loop 1 + L, from its controller and sensor."""
    if not hasattr(system, "controller"):
        return mpmath.fsum(each(system, s, x, y))
    s, k, m = mpmath.mpc(s), system.controller, system.mapping
    gain = k.gain * mpmath.fprod(s - mpmath.mpc(zero) for zero in k.zeros())
    gain /= mpmath.fprod(s - mpmath.mpc(pole) for pole in k.poles())
    first, second, below = (
        mpmath.polyval(list(p), s, asc=True)
        for p in (m.numerator1, m.numerator2, m.denominator)
    )
    arms = first * (1 - x * mpmath.exp(-s * system.tau1))
    arms += second * (1 - y * mpmath.exp(-s * system.tau2))
    return 1 + mpmath.exp(-s * system.delay) * gain * arms / below


def hayes_roots(a, b, tau=1.0, branches=60):
    """All roots of s = a + b exp(-s tau) near the origin, from the branches of Lambert W."""
    if b == 0.0:
        return np.array([complex(a)])
    k = np.arange(-branches, branches + 1)
    return a + lambertw(b * tau * np.exp(-a * tau), k) / tau


def hayes_count(a, b, tau=1.0):
    """Number of roots of the Hayes equation in the right half-plane."""
    return int(np.count_nonzero(hayes_roots(a, b, tau).real > 0.0))


def map_eigenvalues(system, x, y):
    """Roots of z^r D for a map, r the longest delay in steps; exact, as they may be close."""
    steps = {round(t / system.step): p[0] for t, p in terms(system, x, y).items()}
    polynomial = fmpq_poly([0])
    for back, value in steps.items():
        power = [0] * (max(steps) - back)
        polynomial += fmpq_poly([*power, fmpq(value.numerator, value.denominator)])
    roots: Any = polynomial.complex_roots()
    found = [root for root, number in roots for _ in range(number)]
    return np.array([complex(float(root.real), float(root.imag)) for root in found])


def series(zeros, poles, gain):
    """A, B, C and D of the sections (s - z) / (s - p) or 1 / (s - p), one after the other."""
    n = len(poles)
    rows, signal = np.zeros((n, n + 1)), np.append(np.zeros(n), gain)  # of states and input
    for i, pole in enumerate(poles):
        rows[i] = signal
        rows[i, i] += pole
        signal = signal * (i < len(zeros))
        signal[i] = pole - zeros[i] if i < len(zeros) else 1.0
    return rows[:, :n], rows[:, n:], signal[:n], signal[n]


def locked_paper_loop(noise, c1, c2, rate):
    """Locked laser's noise of the paper's loop, by one state for all filters.

    Sum and difference of the arms drive two paths, K and K E, by the trapezoidal rule. The
    state is moved by its changes, so that slow poles lose no digits: over a million samples, a
    recursion in 106 bits gave the same to 1e-14.
    """
    stage, corner = -paper.TABLE_2_STAGE_1_POLE, paper.DUAL_SENSOR_CORNER
    zeros, poles = [-z for z in paper.TABLE_2_ZEROS], [-p for p in paper.TABLE_2_POLES]
    gain, scale = paper.CONTROLLER_GAIN, corner / (paper.TAU1 - paper.TAU2)
    (a1, b1, read1, direct1), (a2, b2, read2, direct2) = (
        series([0.0, 0.0, *zeros], [stage, stage, *poles], gain),
        series([0.0, *zeros], [stage, *poles, stage, -corner], gain * scale),
    )
    a, readout = block_diag(a1, a2), np.append(read1, read2)
    solved = np.linalg.inv(np.eye(len(a)) - 0.5 / rate * a)
    change, entry = a @ solved / rate, 0.5 / rate * solved @ block_diag(b1, b2)
    feed = readout @ entry + [direct1, direct2]
    delays = round(paper.TAU1 * rate), round(paper.TAU2 * rate)
    return _run(noise, c1, c2, *delays, change, entry, readout, feed)


@njit(cache=True)
def _run(noise, c1, c2, r1, r2, change, entry, readout, feed):
    phi, state, arms = np.zeros(noise.size), np.zeros(readout.size), np.zeros(2)
    for i in range(noise.size):
        back1 = c1[i] * phi[i - r1] if i >= r1 else 0.0
        back2 = c2[i] * phi[i - r2] if i >= r2 else 0.0
        arms[0], arms[1] = -back1 - back2, back2 - back1
        phi[i] = (noise[i] - readout @ state - feed @ arms) / (1.0 + 2.0 * feed[0])
        arms[0] += 2.0 * phi[i]
        half = entry @ arms
        state += change @ (state + half) + 2.0 * half
    return phi
