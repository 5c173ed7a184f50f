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


def split(system, x, y):
    """What nothing delays, and coefficients and delay of each other term, as floats."""
    found = {float(t): np.array([float(v) for v in p]) for t, p in terms(system, x, y).items()}
    return np.trim_zeros(found.pop(0.0, np.zeros(1)), "b"), [(p, t) for t, p in found.items()]


def value(system, s, x, y):
    """D(s; x, y), spelled out."""
    s, (a, delayed) = np.asarray(s, dtype=complex), split(system, x, y)
    return sum(np.polyval(b[::-1], s) * np.exp(-s * t) for b, t in [(a, 0.0), *delayed])


def size(system, s, x, y):
    """Sum of the magnitudes of the terms of D(s; x, y)."""
    s, (a, delayed) = complex(s), split(system, x, y)
    return sum(abs(np.polyval(b[::-1], s) * np.exp(-s * t)) for b, t in [(a, 0.0), *delayed])


def exact(system, s, x, y):
    """D(s; x, y) in mpmath's precision; of a loop 1 + L, from its controller and sensor."""
    s = mpmath.mpc(s)
    if not hasattr(system, "controller"):
        return sum(
            mpmath.exp(-s * mpmath.mpf(t.numerator) / t.denominator)
            * sum(mpmath.mpf(v.numerator) / v.denominator * s**k for k, v in enumerate(p))
            for t, p in terms(system, x, y).items()
        )
    k, m = system.controller, system.mapping
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


def radius_of_unstable_roots(undelayed, delayed):
    """Radius past which |A| exceeds the delayed terms in the right half-plane."""
    bound = -np.abs(undelayed)
    bound[-1] = abs(undelayed[-1])
    for b, _ in delayed:
        bound[: b.size] -= np.abs(b)
    if bound[-1] <= 0.0:
        raise ValueError("unstable roots are not confined")
    radius = 1.0
    while np.polyval(bound[::-1], radius) <= 0.0:
        radius *= 2.0
    return radius


def winding(f, top, longest, right=None, tiny=0.0):
    """Zeros of f, real on the real axis, right of the imaginary axis and within a rectangle.

    Half of its contour: from the real axis up at `right` to `top`, back to the imaginary axis
    and down it, around s = 0 at a distance `tiny`. Steps resolve the longest delay; they are
    halved until the argument moves by less than 0.7 in each.
    """
    right = right or top
    low = tiny or 1e-9 * top
    down = np.union1d(np.arange(low, top, 0.3 / longest), np.geomspace(low, top, 400))[::-1]
    path = [right + 1j * np.linspace(0.0, top, 4000), np.linspace(right, 0.0, 4000) + 1j * top]
    path += [1j * down, tiny * np.exp(1j * np.linspace(np.pi / 2, 0.0, 200)) if tiny else [0.0]]
    s = np.concatenate(path)
    turned = 0.0
    for first in range(0, s.size - 1, 200_000):
        here = s[first : first + 200_001]
        value = f(here)
        for _ in range(60):
            assert value.all(), "a zero lies on the contour"
            turn = np.angle(value[1:] / value[:-1])
            wide = np.flatnonzero(np.abs(turn) > 0.7)
            if not wide.size:
                break
            middle = 0.5 * (here[wide] + here[wide + 1])
            here = np.insert(here, wide + 1, middle)
            value = np.insert(value, wide + 1, f(middle))
        assert not wide.size, "a zero lies on the contour"
        turned += turn.sum()
    count = turned / np.pi
    assert abs(count - round(count)) < 1e-6
    return round(count)


def count(system, x, y, at_zero=0):
    """Unstable roots of D(s; x, y); as many at s = 0 as `at_zero` says are divided out."""
    undelayed, delayed = split(system, x, y)
    radius = radius_of_unstable_roots(undelayed, delayed)

    def f(s):
        d = sum(np.polyval(b[::-1], s) * np.exp(-s * t) for b, t in delayed)
        return (np.polyval(undelayed[::-1], s) + d) / s**at_zero

    longest = max((t for _, t in delayed), default=0.0) + 1.0
    return winding(f, radius, longest, tiny=1e-6 * radius if at_zero else 0.0)


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


@njit
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
