"""The paper's loop in 106 bits, by other formulas than the package's.

Numbers are unevaluated sums of two doubles (Dekker, Knuth). Controller and sensor are two
paths, K on the sum of both arms and K E on their difference, each a product of sections that
store their poles in z, which takes the extra digits and no care.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numba import njit

from armlock import paper


def _two(value):
    high = float(value)
    return high, float(value - Fraction(high))


def _path(zeros, poles, gain, rate):
    """Rows: (alpha, beta, h, weight of x, weight of v), each as a pair of doubles."""
    half = Fraction(1) / Fraction(rate) / 2
    rows = []
    for index, pole in enumerate(poles):
        p = Fraction(pole)
        h = half / (1 - p * half)
        alpha = (1 + p * half) / (1 - p * half)
        with_zero = index < len(zeros)
        share = p - Fraction(zeros[index]) if with_zero else Fraction(1)
        rows.append([_two(alpha), _two(h * (1 + alpha)), _two(h), _two(share),
                     _two(Fraction(int(with_zero)))])  # fmt: skip
    feed = Fraction(gain)
    for index, pole in enumerate(poles):
        h = half / (1 - Fraction(pole) * half)
        feed *= 1 + (Fraction(pole) - Fraction(zeros[index])) * h if index < len(zeros) else h
    return np.array(rows), np.array(_two(feed)), np.array(_two(Fraction(gain)))


def paper_paths(rate):
    """Both paths of the paper's loop at a sample rate."""
    stage, zeros = -paper.TABLE_2_STAGE_1_POLE, [-z for z in paper.TABLE_2_ZEROS]
    poles = [-p for p in paper.TABLE_2_POLES]
    corner = Fraction(paper.DUAL_SENSOR_CORNER)
    scale = corner / (Fraction(paper.TAU1) - Fraction(paper.TAU2))
    gain = Fraction(paper.CONTROLLER_GAIN)
    return (
        _path([0.0, 0.0, *zeros], [stage, stage, *poles], gain, rate),
        _path([0.0, *zeros], [stage, *poles, stage, -paper.DUAL_SENSOR_CORNER],
              gain * scale, rate),
    )  # fmt: skip


@njit
def _add(a, b):
    s = a[0] + b[0]
    v = s - a[0]
    e = (a[0] - (s - v)) + (b[0] - v) + a[1] + b[1]
    h = s + e
    return h, e - (h - s)


@njit
def _split(a):
    t = 134217729.0 * a
    h = t - (t - a)
    return h, a - h


@njit
def _mul(a, b):
    p = a[0] * b[0]
    ah, al = _split(a[0])
    bh, bl = _split(b[0])
    e = ((ah * bh - p) + ah * bl + al * bh) + al * bl
    e += a[0] * b[1] + a[1] * b[0]
    h = p + e
    return h, e - (h - p)


@njit
def _div(a, b):
    q = a[0] / b[0]
    r = _add(a, _mul((-q, 0.0), b))
    q2 = r[0] / b[0]
    r = _add(r, _mul((-q2, 0.0), b))
    return _add((q, 0.0), (q2 + r[0] / b[0], 0.0))


@njit
def _at(rows, i, k):
    return rows[i, k, 0], rows[i, k, 1]


@njit
def _through(rows, state, v, move):
    """Run one path; move its state only where asked to."""
    for i in range(rows.shape[0]):
        w = (state[i, 0], state[i, 1])
        x = _add(w, _mul(_at(rows, i, 2), v))
        if move:
            new = _add(_mul(_at(rows, i, 0), w), _mul(_at(rows, i, 1), v))
            state[i, 0], state[i, 1] = new
        v = _add(_mul(_at(rows, i, 4), v), _mul(_at(rows, i, 3), x))
    return v


@njit
def _run(noise, c1, c2, r1, r2, rows1, feed1, gain1, rows2, feed2, gain2):
    n = noise.size
    phi = np.zeros((n, 2))
    s1, s2 = np.zeros((rows1.shape[0], 2)), np.zeros((rows2.shape[0], 2))
    f1, f2 = (feed1[0], feed1[1]), (feed2[0], feed2[1])
    g1, g2 = (gain1[0], gain1[1]), (gain2[0], gain2[1])
    closed = _add((1.0, 0.0), _mul((2.0, 0.0), f1))
    for i in range(n):
        a1 = (phi[i - r1, 0], phi[i - r1, 1]) if i >= r1 else (0.0, 0.0)
        a2 = (phi[i - r2, 0], phi[i - r2, 1]) if i >= r2 else (0.0, 0.0)
        a1 = _mul((c1[i], 0.0), a1)
        a2 = _mul((c2[i], 0.0), a2)
        total = _add(a1, a2)
        apart = _add(a1, (-a2[0], -a2[1]))
        rest = _add(_mul(g1, _through(rows1, s1, (0.0, 0.0), False)),
                    _mul(g2, _through(rows2, s2, (0.0, 0.0), False)))  # fmt: skip
        right = _add(_add((noise[i], 0.0), (-rest[0], -rest[1])),
                     _add(_mul(f1, total), _mul(f2, apart)))  # fmt: skip
        x = _div(right, closed)
        phi[i, 0], phi[i, 1] = x
        _through(rows1, s1, _add(_mul((2.0, 0.0), x), (-total[0], -total[1])), True)
        _through(rows2, s2, (-apart[0], -apart[1]), True)
    return phi[:, 0] + phi[:, 1]


def reference(noise, c1, c2, rate=200.0):
    """Locked laser's noise of the paper's loop, in 106 bits."""
    r1, r2 = round(paper.TAU1 * rate), round(paper.TAU2 * rate)
    one, two = paper_paths(rate)
    return _run(noise, c1, c2, r1, r2, *one, *two)
