"""Systems drawn at random, and their peak gains by a dense search of its own."""

from __future__ import annotations

import itertools

import control
import numpy as np
from scipy.optimize import minimize_scalar

from armlock import delay


def pair(p, omega):
    """Sum of p_k(s) exp(-s theta_k) on the axis; p maps theta to descending coefficients."""
    s = 1j * np.asarray(omega, float)
    return sum(np.polyval(c, s) * np.exp(-s * theta) for theta, c in p.items())


def system_of(n, d):
    """Return N / D as the package takes it, with one delay object for each length."""
    late = {theta: delay(theta) for theta in {*n, *d}}
    top = [control.tf(c, [1.0]) * late[theta] for theta, c in n.items()]
    below = [control.tf(c, [1.0]) * late[theta] for theta, c in d.items()]
    return sum(top[1:], top[0]) / sum(below[1:], below[0])


def plus(p, q):
    """Add two such sums."""
    found = {theta: np.array(c, float) for theta, c in p.items()}
    for theta, c in q.items():
        found[theta] = np.polyadd(found.get(theta, [0.0]), c)
    return found


def draw(rng):
    """Draw N and D, and what kind they are of."""
    kind = str(rng.choice(["sensitivity", "complementary", "delays", "resonance", "slow"]))
    if kind == "resonance":
        size, damping = 10.0 ** rng.uniform(-2, 2), 10.0 ** rng.uniform(-5, -1)
        d = {0.0: np.array([1.0, 2 * damping * size, size * size])}
        theta = rng.uniform(0.1, 3.0) / size
        n = {0.0: size * np.array([1.0, size]), theta: rng.uniform(-1, 1) * d[0.0][1:]}
        return kind, n, d
    if kind in ("sensitivity", "complementary"):
        # An arm loop: one pole and one zero, or an integrator, and two arms.
        tau1, tau2 = rng.uniform(0.5, 3.0, 2)
        gain, corner = 10.0 ** rng.uniform(-2, 1), 10.0 ** rng.uniform(-2, 1)
        c1, c2 = rng.uniform(0.3, 1.0, 2)
        top = gain * np.array([1.0, 10.0 ** rng.uniform(-1, 1) * corner])
        top = top[:1] if rng.random() < 0.5 else 0.1 * top
        m = {0.0: np.array([1.0, corner])}
        arms = plus({0.0: 2 * top}, {tau1: -c1 * top, tau2: -c2 * top})
        return kind, m if kind == "sensitivity" else arms, plus(m, arms)
    if kind == "slow":
        # The largest gain is that at s = 0, or that at high frequency.
        a, b = 10.0 ** rng.uniform(-2, 2, 2)
        n = {
            0.0: np.array([1.0, a]),
            float(rng.uniform(0.1, 2)): rng.uniform(0, 1) * np.array([1.0, a]),
        }
        return (
            kind,
            n,
            {0.0: np.array([1.0, b]), 1.0: rng.uniform(-0.5, 0) * np.array([1.0, b])},
        )
    number = int(rng.integers(2, 5))
    roots = -(10.0 ** rng.uniform(-1, 1, 3))
    d = {0.0: np.poly(roots)}
    n = {0.0: np.poly(-(10.0 ** rng.uniform(-1, 1, 2))) * 10.0 ** rng.uniform(-1, 1)}
    for _ in range(number):
        theta = float(rng.uniform(0.1, 5.0))
        d[theta] = 0.2 * rng.normal(size=3) * d[0.0][1:] / number
        n[theta] = rng.normal(size=2)
    return kind, n, d


def dense_peak(n, d):
    """Largest |N / D|: a dense grid, its best points refined, and both limits."""

    def gain(omega):
        return np.abs(pair(n, omega) / pair(d, omega))

    longest = max(1.0, *n, *d)
    roots = np.concatenate([np.roots(c) for c in (*n.values(), *d.values())] + [[1.0]])
    sizes = np.abs(roots[roots != 0.0])
    grid = [np.geomspace(1e-7 * sizes.min(), 1e4 * sizes.max(), 20_000)]
    grid += [np.arange(1, 100_000) * 0.05 / longest]
    for root in roots[roots.imag > 0.0]:
        off = np.geomspace(1e-3, 1e4, 2_000) * max(abs(root.real), 1e-12 * abs(root))
        grid += [root.imag - off, root.imag + off]
    omega = np.unique(np.concatenate(grid))
    omega = omega[omega > 0.0]
    value = gain(omega)
    inside = np.flatnonzero((value[1:-1] >= value[:-2]) & (value[1:-1] >= value[2:])) + 1
    best = value.max()
    for k in inside[np.argsort(value[inside])[-30:]]:
        found = minimize_scalar(
            lambda w: -gain(w), bounds=(omega[k - 1], omega[k + 1]), method="bounded",
            options={"xatol": 1e-14 * omega[k]},
        )  # fmt: skip
        best = max(best, -found.fun)
    return max(best, limit_at_infinity(n, d))


def limit_at_infinity(n, d):
    """Largest |N / D| of the highest powers, over phases of all delays on a grid, refined."""
    degree = max(np.trim_zeros(np.atleast_1d(c), "f").size for c in d.values())
    top = [
        {theta: c[-degree] if len(c) >= degree else 0.0 for theta, c in p.items()}
        for p in (n, d)
    ]
    delays = sorted({theta for p in top for theta, v in p.items() if v and theta})
    grid = 2 * np.pi * np.arange(24) / 24
    best, where = 0.0, np.zeros(len(delays))

    def ratio(phases):
        z = dict(zip(delays, np.exp(1j * np.asarray(phases)), strict=True)) | {0.0: 1.0}
        a, b = (sum(v * z.get(theta, 1.0) for theta, v in p.items() if v) for p in top)
        return abs(a / b)

    for phases in itertools.product(grid, repeat=len(delays)):
        value = ratio(phases)
        best, where = (value, np.array(phases)) if value > best else (best, where)
    for _ in range(40):
        for k in range(len(delays)):

            def along(x, k=k):
                moved = where.copy()
                moved[k] = x
                return -ratio(moved)

            found = minimize_scalar(
                along,
                bounds=(where[k] - 0.3, where[k] + 0.3),
                method="bounded",
                options={"xatol": 1e-12},
            )
            if -found.fun > best:
                best, where[k] = -found.fun, found.x
    return best
