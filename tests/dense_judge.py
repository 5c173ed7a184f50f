"""Loops with three to six delays, against an argument and margins on a dense grid."""

from __future__ import annotations

import math

import control
import numpy as np

from armlock import delay, margins, unstable_roots
from armlock.affine import Affine
from armlock.engine import decide
from armlock.engine.chain import UndecidedError


class Judge:
    """Loops by their terms (theta, coefficients), on grids of its own."""

    def __init__(self, numerator, denominator):
        self.numerator, self.denominator = numerator, denominator
        self.degree = max(len(p) - 1 for _, p in numerator + denominator)

    @staticmethod
    def _sum(terms, omega):
        s = 1j * omega
        return sum(np.polyval(p, s) * np.exp(-s * theta) for theta, p in terms)

    def loop(self, omega):
        return self._sum(self.numerator, omega) / self._sum(self.denominator, omega)

    def bounded(self, omega):
        """D over (s + 1)^degree."""
        terms = self.numerator + self.denominator
        return self._sum(terms, omega) / (1j * omega + 1.0) ** self.degree

    def limit(self):
        """What nothing delays of D over s^degree, and the sizes of what delays do."""
        tops = [
            (theta, p[0])
            for theta, p in self.numerator + self.denominator
            if len(p) == self.degree + 1
        ]
        still = sum(top for theta, top in tops if not theta)
        return still, sum(abs(top) for theta, top in tops if theta)

    def grid(self, f):
        """Frequencies between which a function turns by no more than 0.2 rad."""
        omega = np.unique(
            np.concatenate((np.linspace(0.0, 400.0, 80_001), np.geomspace(1e-4, 1e4, 4000)))
        )
        for _ in range(40):
            value = f(omega)
            wide = np.abs(np.angle(value[1:] / value[:-1])) > 0.2
            if not wide.any():
                break
            omega = np.insert(
                omega, np.flatnonzero(wide) + 1, 0.5 * (omega[1:] + omega[:-1])[wide]
            )
        return omega

    def count(self):
        value = self.bounded(self.grid(self.bounded))
        turned = np.angle(value[1:] / value[:-1]).sum()
        turned -= np.angle(value[-1] / self.limit()[0])
        found = -turned / np.pi
        assert abs(found - round(found)) < 1e-3
        return round(found)

    def margins(self):
        """Gain up, gain down, phase, delay and modulus; golden sections and bisections.

        Delays act on the numerator alone at the highest power: the chain's limit is known.
        """
        still, delayed = self.limit()
        omega = np.unique(
            np.concatenate((self.grid(self.bounded), np.geomspace(1e-3, 3e3, 400_000)))
        )
        omega = omega[omega > 0.0]
        value = self.loop(omega)

        def zeros(f):
            y = f(value)
            k = np.flatnonzero((y[1:] < 0.0) != (y[:-1] < 0.0))
            low, high, sign = omega[k], omega[k + 1], y[k] < 0.0
            for _ in range(60):
                middle = 0.5 * (low + high)
                same = (f(self.loop(middle)) < 0.0) == sign
                low, high = np.where(same, middle, low), np.where(same, high, middle)
            return 0.5 * (low + high)

        w = zeros(lambda v: v.imag)
        # L(0) is real; with a pole at s = 0 it is none of them.
        at_zero = self.loop(1e-9)
        k = (
            -1.0
            / np.append(
                self.loop(w), at_zero if abs(at_zero.imag) < 1e-3 * abs(at_zero) else np.inf
            ).real
        )
        k = np.append(k, still / delayed if delayed else np.inf)
        # Gain factors past 1e4 are not looked at.
        k = k[(k > 1e-4) & (k < 1e4)]
        w = zeros(lambda v: np.abs(v) - 1.0)
        angle = np.angle(-self.loop(w))
        near = np.argsort(np.abs(1.0 + value))[:50]
        low, high = omega[np.maximum(near - 1, 0)], omega[np.minimum(near + 1, omega.size - 1)]
        share = (math.sqrt(5.0) - 1.0) / 2.0
        for _ in range(60):
            a, b = high - share * (high - low), low + share * (high - low)
            left = np.abs(1.0 + self.loop(a)) < np.abs(1.0 + self.loop(b))
            low, high = np.where(left, low, a), np.where(left, b, high)
        ends = abs(1.0 + self.loop(1e-9)), 1.0 - delayed / still
        return np.array([
            k[k > 1.0].min(initial=np.inf),
            k[(k < 1.0) & (k > 0.0)].max(initial=0.0),
            np.abs(angle).min(initial=np.inf),
            ((angle % (2.0 * np.pi)) / w).min(initial=np.inf),
            min(np.abs(1.0 + self.loop(low)).min(), *ends),
        ])  # fmt: skip


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
    ours = np.array([
        certified.gain_upper, certified.gain_lower, certified.phase,
        certified.delay, certified.modulus,
    ])  # fmt: skip
    dense = judge.margins()
    wrong = []
    for name, a, b in zip(
        ("up", "down", "phase", "delay", "modulus"), ours, dense, strict=True
    ):
        # The judge looks at gain factors from 1e-4 to 1e4.
        a = np.inf if name == "up" and a >= 1e4 else 0.0 if name == "down" and a <= 1e-4 else a
        too_good = a > b * (1 + 2e-6) if name != "down" else a < b * (1 - 2e-6)
        equal = a == b or math.isclose(a, b, rel_tol=1e-5)
        if too_good or not equal:
            wrong.append(f"{name} {a} for {b}")
    n, m = Affine.of(loop).quotient()
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
    for name in ("gain_upper", "gain_lower", "phase", "delay", "modulus"):
        level, way = getattr(found, name), -1.0 if name == "gain_lower" else 1.0
        if not 0.0 < level < np.inf:
            continue
        if name in ("gain_upper", "gain_lower") and not 1e-4 < level < 1e4:
            # It may be the largest factor that was looked at, and no margin.
            continue
        for what, share in (("too good", 1e-5), ("too small", -3e-5)):
            certified = is_certified(n, m, name, level * (1.0 + way * share))
            if tally is not None:
                tally[f"{what}: {'' if certified else 'not '}certified"] += 1
            if certified and what == "too good":
                wrong.append(f"{name} too good")
    return wrong
