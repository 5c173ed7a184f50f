"""What is right about N / D: winding numbers, and dense grids refined between their points.

N and D are sums of p(s) exp(-s theta), dictionaries of theta to descending coefficients. None
of these computations shares code with armlock.
"""

from __future__ import annotations

import itertools
import math

import control
import numpy as np
from scipy.optimize import minimize_scalar

from armlock import delay


class UndecidedError(RuntimeError):
    """What is right is not known."""


def value(p, s):
    """Value of a sum at s."""
    s = np.asarray(s, complex)
    return sum(np.polyval(c, s) * np.exp(-s * theta) for theta, c in p.items())


def plus(*sums):
    """Add sums."""
    found: dict[float, np.ndarray] = {}
    for theta, c in itertools.chain.from_iterable(p.items() for p in sums):
        found[theta] = np.polyadd(found.get(theta, [0.0]), c)
    return found


def shifted(p, sigma):
    """Return the sum at s + sigma."""
    moved = np.poly1d([1.0, sigma])
    return {t: np.exp(-sigma * t) * np.poly1d(c)(moved).c for t, c in p.items()}


def quotient(n, d):
    """N / D as a user would make it, with one delay object for each length."""
    late = {theta: delay(theta) for theta in {*n, *d}}
    above, below = (
        sum(control.tf(c, [1.0]) * late[theta] for theta, c in p.items()) for p in (n, d)
    )
    return above / below


def tops(p, degree):
    """Coefficients of the power `degree`: the undelayed one, and those of the delays."""
    found = {t: c[-degree - 1] if len(c) > degree else 0.0 for t, c in p.items()}
    return found.pop(0.0, 0.0), {theta: c for theta, c in found.items() if c}


# ---------------------------------------------------------------------------- zeros


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
        found = f(here)
        for _ in range(60):
            assert found.all(), "a zero lies on the contour"
            turn = np.angle(found[1:] / found[:-1])
            wide = np.flatnonzero(np.abs(turn) > 0.7)
            if not wide.size:
                break
            middle = 0.5 * (here[wide] + here[wide + 1])
            here = np.insert(here, wide + 1, middle)
            found = np.insert(found, wide + 1, f(middle))
        assert not wide.size, "a zero lies on the contour"
        turned += turn.sum()
    count = turned / np.pi
    assert abs(count - round(count)) < 1e-6
    return round(count)


def count(d, at_zero=0):
    """Zeros of a sum right of the imaginary axis; so many at s = 0 are divided out."""
    still = np.trim_zeros(np.atleast_1d(d.get(0.0, 0.0)), "f")
    # Past this radius the highest undelayed power exceeds all else.
    bound = np.abs(still) * np.where(np.arange(still.size), -1.0, 1.0)
    for theta, c in d.items():
        bound = np.polysub(bound, np.abs(np.poly1d(c).c) if theta else [0.0])
    if bound.size > still.size or bound[0] <= 0.0:
        raise UndecidedError("a chain may hold infinitely many")
    radius = 1.0
    while np.polyval(bound, radius) <= 0.0:
        radius *= 2.0
    tiny = 1e-6 * radius if at_zero else 0.0
    return winding(lambda s: value(d, s) / s**at_zero, radius, max(d) + 1.0, tiny=tiny)


# ---------------------------------------------------------------------------- the axis


def least(f, omega, known):
    """Smallest value of f next to the lowest of its local minima on a grid."""
    inside = np.flatnonzero((known[1:-1] <= known[:-2]) & (known[1:-1] <= known[2:])) + 1
    near = inside[np.argsort(known[inside])[:50]]
    low, high = omega[near - 1], omega[near + 1]
    share = (math.sqrt(5.0) - 1.0) / 2.0
    for _ in range(60):
        a, b = high - share * (high - low), low + share * (high - low)
        left = f(a) < f(b)
        low, high = np.where(left, low, a), np.where(left, b, high)
    return min(known.min(), f(low).min(initial=np.inf))


def dense_margins(loop, omega):
    """Gain up and down, phase, delay and modulus of L on a grid, refined between its points."""
    known = loop(omega)

    def where(function):
        """Return where a real function of L changes its sign."""
        y = function(known)
        k = np.flatnonzero((y[1:] < 0.0) != (y[:-1] < 0.0))
        low, high, sign = omega[k], omega[k + 1], y[k] < 0.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            same = (function(loop(middle)) < 0.0) == sign
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        return 0.5 * (low + high)

    real = loop(where(np.imag))
    # An imaginary part that jumps through a pole is no crossing of the real axis.
    gains = -1.0 / real.real[(real.real < 0.0) & (np.abs(real) < 1e6)]
    crossover = where(lambda v: np.abs(v) - 1.0)
    turned = np.angle(-loop(crossover))
    return (
        gains[gains > 1.0].min(initial=np.inf),
        gains[gains < 1.0].max(initial=0.0),
        np.abs(turned).min(initial=np.inf),
        (np.mod(turned, 2.0 * np.pi) / crossover).min(initial=np.inf),
        least(lambda w: np.abs(1.0 + loop(w)), omega, np.abs(1.0 + known)),
    )


def margins(n, d):
    """Gain up, gain down, phase, delay and modulus, with those at s = 0 and at infinity.

    Delays act on N alone at the highest power: the chain's limit is known.
    """

    def loop(omega):
        return value(n, 1j * omega) / value(d, 1j * omega)

    still, late = tops(plus(n, d), max(map(len, d.values())) - 1)
    delayed = sum(map(abs, late.values()))
    omega = np.union1d(np.linspace(5e-3, 400.0, 80_000), np.geomspace(1e-4, 1e4, 400_000))
    up, down, phase, dead, modulus = dense_margins(loop, omega)
    at_zero = complex(loop(1e-9))
    # L(0) is real; with a pole at s = 0 it is none of the values that limit a gain.
    ends = [-1.0 / at_zero.real] if abs(at_zero.imag) < 1e-3 * abs(at_zero) else []
    ends += [still / delayed] if delayed else []
    up = min([up, *(k for k in ends if k > 1.0)])
    down = max([down, *(k for k in ends if 0.0 < k < 1.0)])
    modulus = min(modulus, abs(1.0 + at_zero), 1.0 - delayed / still)
    # Gain factors past 1e4 are not looked at.
    return up if up < 1e4 else np.inf, down if down > 1e-4 else 0.0, phase, dead, modulus


def peak(n, d):
    """Largest |N / D|: a dense grid, its best points refined, and both limits."""
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

    def loss(omega):
        return np.abs(value(d, 1j * omega) / value(n, 1j * omega))

    return max(1.0 / least(loss, omega, loss(omega)), peak_at_infinity(n, d))


def peak_at_infinity(n, d):
    """Largest |N / D| of the highest powers, over phases of all delays on a grid, refined."""
    degree = max(np.trim_zeros(np.atleast_1d(c), "f").size for c in d.values()) - 1
    (above, late), (below, later) = tops(n, degree), tops(d, degree)
    delays = sorted({*late, *later})
    rows = np.array([[p.get(theta, 0.0) for theta in delays] for p in (late, later)])

    def ratio(phases):
        a, b = np.exp(1j * np.asarray(phases)) @ rows.T + [above, below]
        return abs(a / b)

    grid = 2 * np.pi * np.arange(24) / 24
    where = np.array(max(itertools.product(grid, repeat=len(delays)), key=ratio))
    for k in np.tile(np.arange(len(delays)), 40):

        def along(x, k=k):
            return -ratio(np.where(np.arange(len(delays)) == k, x, where))

        found = minimize_scalar(
            along,
            bounds=(where[k] - 0.3, where[k] + 0.3),
            method="bounded",
            options={"xatol": 1e-12},
        )
        where[k] = found.x if -found.fun > ratio(where) else where[k]
    return ratio(where)


# ---------------------------------------------------------------------------- draws


def drawn(rng):
    """Draw N and D of an open loop with three to six delays."""
    degree, number = int(rng.integers(1, 5)), int(rng.integers(3, 7))
    thetas = 10.0 ** rng.uniform(-1.5, 1.0, number)
    if rng.random() < 0.2:
        thetas[1] = thetas[0] * (1.0 + 1e-4)
    if rng.random() < 0.2:
        thetas[2] = 2.0 * thetas[0]
    kind = rng.choice(["dead time", "inside", "neutral"], p=[0.4, 0.35, 0.25])
    poles = -(10.0 ** rng.uniform(-1.0, 1.0, degree)) * np.where(
        rng.random(degree) < 0.1, -1, 1
    )
    if rng.random() < 0.25:
        poles[0] = 0.0
    n: dict[float, np.ndarray] = {}
    d = {0.0: np.poly(poles)}
    size = 10.0 ** rng.uniform(-1.5, 1.0) * max(abs(np.prod(poles)), 0.1) / number
    for k, theta in enumerate(thetas.tolist()):
        top = degree if kind == "neutral" else int(rng.integers(0, degree))
        p = rng.normal(size=top + 1) * size
        if top == degree:
            p[0] = rng.uniform(-1.2, 1.2) / number
        (d if kind == "inside" and k >= number // 2 else n)[theta] = p
    return n, d


def drawn_closed(rng):
    """Draw N and D of a transfer function that has a peak, if it is stable."""
    kind = str(rng.choice(["sensitivity", "complementary", "delays", "resonance", "slow"]))
    if kind == "resonance":
        size, damping = 10.0 ** rng.uniform(-2, 2), 10.0 ** rng.uniform(-5, -1)
        d = {0.0: np.array([1.0, 2 * damping * size, size * size])}
        theta = rng.uniform(0.1, 3.0) / size
        return {0.0: size * np.array([1.0, size]), theta: rng.uniform(-1, 1) * d[0.0][1:]}, d
    if kind in ("sensitivity", "complementary"):
        # An arm loop: one pole and one zero, or an integrator, and two arms.
        tau1, tau2 = rng.uniform(0.5, 3.0, 2)
        gain, corner = 10.0 ** rng.uniform(-2, 1), 10.0 ** rng.uniform(-2, 1)
        c1, c2 = rng.uniform(0.3, 1.0, 2)
        top = gain * np.array([1.0, 10.0 ** rng.uniform(-1, 1) * corner])
        top = top[:1] if rng.random() < 0.5 else 0.1 * top
        m, arms = (
            {0.0: np.array([1.0, corner])},
            {0.0: 2 * top, tau1: -c1 * top, tau2: -c2 * top},
        )
        return m if kind == "sensitivity" else arms, plus(m, arms)
    if kind == "slow":
        # The largest gain is that at s = 0, or that at high frequency.
        a, b = (np.array([1.0, x]) for x in 10.0 ** rng.uniform(-2, 2, 2))
        n = {0.0: a, float(rng.uniform(0.1, 2)): rng.uniform(0, 1) * a}
        return n, {0.0: b, 1.0: rng.uniform(-0.5, 0) * b}
    number = int(rng.integers(2, 5))
    d = {0.0: np.poly(-(10.0 ** rng.uniform(-1, 1, 3)))}
    n = {0.0: np.poly(-(10.0 ** rng.uniform(-1, 1, 2))) * 10.0 ** rng.uniform(-1, 1)}
    for _ in range(number):
        theta = float(rng.uniform(0.1, 5.0))
        d[theta] = 0.2 * rng.normal(size=3) * d[0.0][1:] / number
        n[theta] = rng.normal(size=2)
    return n, d
