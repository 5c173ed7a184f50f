"""Loops with three to six delays, against winding numbers and margins on a dense grid."""

from __future__ import annotations

import math

import control
import numpy as np

from armlock import delay, margins, unstable_roots
from armlock.engine import decide
from armlock.engine.tolerances import UndecidedError
from tests import attack_judge, independent

NAMES = ("gain_upper", "gain_lower", "phase", "delay", "modulus")


class Judge:
    """Loops by their terms (theta, coefficients), on grids of its own."""

    def __init__(self, numerator, denominator):
        self.numerator, self.denominator = numerator, denominator
        self.degree = max(len(p) - 1 for _, p in numerator + denominator)

    @staticmethod
    def _sum(terms, s):
        return sum(np.polyval(p, s) * np.exp(-s * theta) for theta, p in terms)

    def loop(self, omega):
        s = 1j * omega
        return self._sum(self.numerator, s) / self._sum(self.denominator, s)

    def limit(self):
        """What nothing delays of D over s^degree, and the sizes of what delays do."""
        tops = [
            (theta, p[0])
            for theta, p in self.numerator + self.denominator
            if len(p) == self.degree + 1
        ]
        still = sum(top for theta, top in tops if not theta)
        return still, sum(abs(top) for theta, top in tops if theta)

    def d(self, s):
        """D = N + M."""
        return self._sum(self.numerator + self.denominator, s)

    def count(self):
        terms = self.numerator + self.denominator
        size = self.degree + 1
        still = np.sum([np.pad(p, (size - len(p), 0)) for t, p in terms if not t], axis=0)
        delayed = [(np.asarray(p)[::-1], t) for t, p in terms if t]
        highest, moved = self.limit()
        if abs(highest) <= moved:
            raise attack_judge.UndecidedError  # a chain may hold infinitely many
        top = independent.radius_of_unstable_roots(still[::-1], delayed)
        return independent.winding(self.d, top, max(t for t, _ in terms))

    def margins(self):
        """Gain up, gain down, phase, delay and modulus, with those at s = 0 and at infinity.

        Delays act on the numerator alone at the highest power: the chain's limit is known.
        """
        still, delayed = self.limit()
        omega = np.union1d(np.linspace(5e-3, 400.0, 80_000), np.geomspace(1e-4, 1e4, 400_000))
        up, down, phase, late, modulus = dense_margins(self.loop, omega)
        at_zero = complex(self.loop(1e-9))
        # L(0) is real; with a pole at s = 0 it is none of the values that limit a gain.
        ends = [-1.0 / at_zero.real] if abs(at_zero.imag) < 1e-3 * abs(at_zero) else []
        ends += [still / delayed] if delayed else []
        up = min([up, *(k for k in ends if k > 1.0)])
        down = max([down, *(k for k in ends if 0.0 < k < 1.0)])
        modulus = min(modulus, abs(1.0 + at_zero), 1.0 - delayed / still)
        # Gain factors past 1e4 are not looked at.
        return up if up < 1e4 else np.inf, down if down > 1e-4 else 0.0, phase, late, modulus


def dense_margins(loop, omega):
    """Gain up and down, phase, delay and modulus of L on a grid, refined between its points."""
    value = loop(omega)

    def where(function):
        """Return where a real function of L changes its sign."""
        y = function(value)
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
    near = np.argsort(np.abs(1.0 + value))[:50]
    low, high = omega[np.maximum(near - 1, 0)], omega[np.minimum(near + 1, omega.size - 1)]
    share = (math.sqrt(5.0) - 1.0) / 2.0
    for _ in range(60):
        a, b = high - share * (high - low), low + share * (high - low)
        left = np.abs(1.0 + loop(a)) < np.abs(1.0 + loop(b))
        low, high = np.where(left, low, a), np.where(left, b, high)
    return (
        gains[gains > 1.0].min(initial=np.inf),
        gains[gains < 1.0].max(initial=0.0),
        np.abs(turned).min(initial=np.inf),
        (np.mod(turned, 2.0 * np.pi) / crossover).min(initial=np.inf),
        np.abs(1.0 + loop(low)).min(),
    )


def drawn(rng):
    """Draw a loop with three to six delays, and its judge."""
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
    still = np.poly(poles)
    numerator: list[tuple[float, np.ndarray]] = []
    denominator = [(0.0, still)]
    size = 10.0 ** rng.uniform(-1.5, 1.0) * max(abs(np.prod(poles)), 0.1) / number
    for k, theta in enumerate(thetas):
        top = degree if kind == "neutral" else int(rng.integers(0, degree))
        p = rng.normal(size=top + 1) * size
        if top == degree:
            p[0] = rng.uniform(-1.2, 1.2) / number
        to = denominator if kind == "inside" and k >= number // 2 else numerator
        to.append((float(theta), p))
    return numerator, denominator


def system(terms):
    """The sum of terms, made as a user would."""
    return sum(control.tf(p, [1.0]) * delay(theta) for theta, p in terms)


def shifted(terms, sigma):
    """The sum of terms at s + sigma."""
    moved = np.poly1d([1.0, sigma])
    return [(theta, np.exp(-sigma * theta) * np.poly1d(p)(moved).c) for theta, p in terms]


def compared(
    numerator,
    denominator,
    ask=lambda _, call, *arguments: call(*arguments),
    controls=None,
):
    """Compare one loop; return count and what differs. `ask` calls armlock."""
    judge = Judge(numerator, denominator)
    loop = system(numerator) / system(denominator)
    still, delayed = judge.limit()
    found = ask("unstable_roots", unstable_roots, loop)
    if found is None:
        return -1, []
    found = int(found)
    if abs(still) <= delayed:
        return found, [] if found == -2 else [f"count {found} for -2"]
    expected = judge.count()
    if found != expected:
        return found, [f"count {found} for {expected}"]
    if found:
        return found, []
    certified = ask("margins", margins, loop)
    if certified is None:
        return found, []
    wrong = []
    for name, b in zip(NAMES, judge.margins(), strict=True):
        a = getattr(certified, name)
        # The judge looks at gain factors from 1e-4 to 1e4.
        if name.startswith("gain"):
            a = np.inf if a >= 1e4 else 0.0 if a <= 1e-4 else a
        too_good = a > b * (1 + 2e-6) if name != "gain_lower" else a < b * (1 - 2e-6)
        equal = a == b or math.isclose(a, b, rel_tol=1e-5)
        if too_good or not equal:
            wrong.append(f"{name} {a} for {b}")
    n, m = loop.affine.quotient()
    return found, wrong + too_good_ones(n, m, certified, controls)


def is_certified(n, m, name, level):
    """Whether the engine certifies that no less than this level makes N / M marginal."""
    one, other, none, arc = (1.0, 0.0), (0.0, 1.0), (0.0, 0.0), None
    tests = [[(1, one, none), (2, other, none)], [(2, one, none), (1, other, none)]]
    if name == "modulus":
        n, tests = n + m, [[(1, one, none), (2, (0.0, level), none)]]
    elif name in ("gain_upper", "gain_lower"):
        n, m, end = (m, n, level) if name == "gain_upper" else (n, m, 1.0 / level)
        tests = [[(1, (1.0, 1.0), none), (1, (1.0, end), none)]]
    else:
        turns = {"phase": (-level, 0.0, level, 0.0), "delay": (0.0, 0.0, 0.0, level)}
        arc = turns[name], (0.0, 0.0, 0.0, 0.0)
    try:
        return decide.excludes(decide.Family([n, m], tests, arc))
    except UndecidedError:
        return False


def too_good_ones(n, m, found, tally=None):
    """Margins that would be certified although they are better than the true ones by 1e-5.

    How many are not, and how many are that are 3e-5 worse, is counted.
    """
    wrong = []
    for name in NAMES:
        level, way = getattr(found, name), -1.0 if name == "gain_lower" else 1.0
        if not 0.0 < level < np.inf:
            continue
        if name.startswith("gain") and not 1e-4 < level < 1e4:
            # It may be the largest factor that was looked at, and no margin.
            continue
        for what, share in (("too good", 1e-5), ("too small", -3e-5)):
            certified = is_certified(n, m, name, level * (1.0 + way * share))
            if tally is not None:
                tally[f"{what}: {'' if certified else 'not '}certified"] += 1
            if certified and what == "too good":
                wrong.append(f"{name} too good")
    return wrong
