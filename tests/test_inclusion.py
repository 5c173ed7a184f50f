"""The lemmas of the appendix "The lemmas behind a count", against values in 50 digits.

Each bound of the engine is compared with the exact error on spaces, intervals and points that
are drawn at random. A bound must hold everywhere, and must be nearly reached somewhere: a test
that stays far below its bound would not notice a smaller one.
"""

from fractions import Fraction

import mpmath
import numba
import numpy as np
import pytest

from armlock.engine import inclusion
from armlock.engine.functions import Function, Space, compiled
from armlock.engine.polynomials import Polynomial, exact, of_roots, rounded
from armlock.engine.tolerances import EPSILON
from armlock.systems import Lag
from tests import draws

mp = mpmath.mp.clone()
mp.dps = 50


def number(value):
    """Return a fraction or a float in 50 digits."""
    value = Fraction(value if isinstance(value, float) else str(value))
    return mp.mpf(value.numerator) / value.denominator


def polynomial_at(coefficients, x):
    """Evaluate a polynomial, coefficients ascending, in 50 digits."""
    value = mp.mpf(0)
    for c in coefficients[::-1]:
        value = value * x + (mp.mpc(complex(c)) if isinstance(c, complex) else c)
    return value


def draw_polynomial(rng, degree):
    """Draw roots over decades, weakly damped pairs among them; some have to be computed."""
    size = 10.0 ** rng.uniform(-2, 2)
    roots: list[complex] = []
    while len(roots) < degree:
        near = size * 10.0 ** rng.normal(0, 0.4)
        if degree - len(roots) > 1 and rng.random() < 0.6:
            damping = rng.choice([0.0, 10.0 ** rng.uniform(-8, 0)])
            pair = near * complex(-damping, np.sqrt(1.0 - damping**2))
            roots += [pair, pair.conjugate()]
        else:
            roots.append(complex(rng.choice([-1.0, 1.0, 0.0]) * near))
    p = Polynomial.of(of_roots(roots) * exact(rng.normal()))
    return Polynomial.of(rounded(p.exact.coeffs())) if rng.random() < 0.4 else p


def draw(rng, most=6, delays=4, longest=2.0):
    """Draw a function with up to three polynomials."""
    polynomials = [
        draw_polynomial(rng, rng.integers(most + 1)) for _ in range(rng.integers(1, 4))
    ]
    lags = [Fraction(10.0 ** rng.uniform(-2, longest)) for _ in range(rng.integers(delays + 1))]
    if len(lags) > 1 and rng.random() < 0.5:
        lags[1] = lags[0] * (1 + Fraction(10.0 ** rng.uniform(-18, -1)))
    space = Space(polynomials, after(lags))
    shape = len(polynomials), len(lags)
    steady = rng.normal(size=shape[0]) * 10.0 ** rng.uniform(-1, 2, shape[0])
    delayed = rng.normal(size=shape) * 10.0 ** rng.uniform(-1, 2, shape)
    return function_of(space, [Fraction(v) / 3 for v in steady], delayed)


def after(delays):
    """Delays of these lengths, as a space takes them."""
    return [Lag.after(exact(theta)) for theta in delays]


def function_of(space, steady, delayed):
    """The function of a space with weights S, shape (J,), and W, shape (J, K)."""
    shape = len(space.polynomials), len(space.delays)
    s, w = (
        np.array([exact(v) for v in np.ravel(np.array(part, object))], object)
        for part in (steady, delayed)
    )
    return Function(space, s, w.reshape(shape))


class Exact:
    """A function in 50 digits."""

    def __init__(self, function: Function) -> None:
        space = function.space
        self.polynomials = [[number(c) for c in p.exact] for p in space.polynomials]
        self.delays = [number(theta) for theta in space.delays]
        self.steady = [number(v) for v in function.steady]
        self.delayed = [[number(v) for v in row] for row in function.delayed]

    def __call__(self, s):
        turns = [mp.expm1(-s * theta) for theta in self.delays]
        return mp.fsum(
            polynomial_at(p, s) * (steady + mp.fdot(row, turns))
            for p, steady, row in zip(self.polynomials, self.steady, self.delayed, strict=True)
        )


@numba.njit
def workspace(space, functions):
    return inclusion.workspace(space, functions)


@numba.njit
def members(kind, functions):
    return inclusion.members(kind, functions)


@numba.njit
def enclose(functions, middle, half, work):
    inclusion.enclose(functions, middle, half, work)


@numba.njit
def phase_of(theta, tail, omega):
    return inclusion._phase(theta, tail, omega)


@numba.njit
def holds(weights, along, gamma, work, room):
    """Whether members with these weights exclude zero."""
    for n in range(weights.shape[0]):
        room.weights[:] = weights[n]
        inclusion.mix(work, room, n)
    room.along[:] = along
    return inclusion._holds(room, gamma)


def enclosed(function, middle, half, work):
    """Enclose a function on an interval."""
    enclose(compiled([function]), middle, half, work)


def divisor(work):
    """By what all polynomials were divided on the last piece, over a power of 1e150."""
    by = mp.fprod(mp.mpf(float(f)) for f in work.factor)
    return by * mp.mpf(1e150) ** -int(work.shift.max())


def share_of_bound(function, exact, middle, half, work, t):
    """Exact error of an enclosure at a point of its interval, over its bound."""
    omega, t = mp.mpf(middle) + mp.mpf(half) * mp.mpf(t), mp.mpf(t)
    centre = polynomial_at(work.f[0, 0], t)
    for term, theta in zip(work.f[0, 1:], exact.delays, strict=True):
        if term.any():
            centre += polynomial_at(term, t) * mp.expj(-omega * theta)
    off = abs(exact(mp.mpc(0, omega)) * divisor(work) - centre)
    return float(off / mp.mpf(float(work.rest[0])))


def test_enclosures_hold_on_intervals_and_on_parts_of_them():
    rng, shares = np.random.default_rng(1), []
    for trial in range(draws(16, 200)):
        # Exponentials of very long delays are fast on intervals where rounding prevails.
        function = draw(rng, longest=9.0 if trial % 3 == 0 else 2.0)
        exact, space = Exact(function), function.space
        work = workspace(space.arrays, 1)
        for _ in range(2):
            middle = float(rng.choice(space.corners)) * 10.0 ** rng.uniform(-1, 1)
            half = middle * 10.0 ** rng.uniform(-6, 0)
            for _ in range(4):
                enclosed(function, middle, half, work)
                for t in (-1.0, rng.uniform(-1, 1), 1.0):
                    shares.append(share_of_bound(function, exact, middle, half, work, t))
                # A part of it, down to one that needs an expansion of its own.
                t = rng.uniform(-0.9, 0.9)
                middle += half * t
                half *= (1.0 - abs(t)) * 10.0 ** rng.uniform(-3, 0)
    assert max(shares) <= 1.0
    assert max(shares) > 0.99


def test_a_factor_of_each_power_reaches_the_remainder():
    # (s - z)^4 has a constant fourth derivative: its remainder is the bound.
    for roots in ([-1e-3] * 4, [-1e-3] * 3 + [-1.0], [-2.0] * 7):
        function = function_of(Space([Polynomial.of(of_roots(roots))], []), [1], [[]])
        work = workspace(function.space.arrays, 1)
        enclosed(function, 1.0, 0.3, work)
        assert share_of_bound(function, Exact(function), 1.0, 0.3, work, 1.0) <= 1.0
    # A part of a long piece keeps its remainder, here with an exponential on the part.
    space = Space([Polynomial.of(of_roots([-1.0] * 4))], after([1]))
    function = function_of(space, [0], [[1]])
    exact, work = Exact(function), workspace(function.space.arrays, 1)
    for middle, half in ((1.0, 0.5), (1.4, 0.1), (1.45, 0.05)):
        enclosed(function, middle, half, work)
        for t in (-1.0, 0.0, 1.0):
            assert share_of_bound(function, exact, middle, half, work, t) <= 1.0


@pytest.mark.parametrize("kind", ["polynomial", "cancelling", "any"])
def test_rounding_at_a_frequency(kind):
    rng, shares = np.random.default_rng(2), []
    for _ in range(draws(250, 1000)):
        if kind == "polynomial":
            function = draw(rng, 10, delays=0)
        else:
            function = draw(rng, 0 if kind == "cancelling" else 6)
        space = function.space
        omega = 10.0 ** rng.uniform(-3, 3)
        if kind == "cancelling" and len(space.delays) > 1:
            # Weights of which the brackets vanish but for rounding.
            turns = np.expm1(-1j * omega * space.arrays.delays)
            rows = np.array([np.append(1.0, turns.real), np.append(0.0, turns.imag)])
            kept = np.linalg.svd(rows)[2][2:].T
            chosen = [kept @ rng.normal(size=kept.shape[1]) for _ in space.polynomials]
            function = function_of(space, [v[0] for v in chosen], [v[1:] for v in chosen])
        work = workspace(space.arrays, 1)
        enclosed(function, omega, 0.0, work)
        shares.append(share_of_bound(function, Exact(function), omega, 0.0, work, 0.0))
    assert max(shares) <= 1.0
    # Factor by factor the bound allows what no sum of so few roundings reaches.
    assert max(shares) > (0.1 if kind == "cancelling" else 0.03)


def test_phase_of_an_exponential():
    rng, shares = np.random.default_rng(3), []
    for _ in range(draws(500, 5000)):
        theta = Fraction(10.0 ** rng.uniform(-3, 3)) / 3
        omega = 10.0 ** rng.uniform(-8, 7)
        near = float(theta)
        phase, slip = phase_of(near, float(theta - Fraction(near)), omega)
        exact = number(theta) * mp.mpf(omega)
        turn = abs(mp.expj(exact) - 1)
        off = abs(mp.expj(mp.mpf(phase) - exact) - 1) + 1.5 * EPSILON * turn
        shares.append(float(off / slip))
    assert max(shares) <= 1.0
    assert max(shares) > 0.9


def test_computed_roots_miss_a_polynomial_by_no_more_than_stated():
    rng, shares = np.random.default_rng(4), []
    for trial in range(draws(1000, 5000)):
        degree = rng.integers(1, 9)
        near = np.poly(-rng.uniform(0.9, 1.1, degree))[::-1]
        coefficients = near if trial % 2 else rng.normal(size=degree + 1)
        p = Polynomial.of([Fraction(c) / (k + 10) for k, c in enumerate(coefficients)])
        found, size = [number(p.lead)], [abs(number(p.lead))]
        for root in p.roots:
            z = mp.mpc(root)
            found = [a - z * b for a, b in zip([0, *found], [*found, 0], strict=True)]
            size = [a + abs(z) * b for a, b in zip([0, *size], [*size, 0], strict=True)]
        off = [abs(a - number(c)) / b for a, c, b in zip(found, p.exact, size, strict=True)]
        # Roots that are floats are known exactly, and nothing is missed.
        assert p.missed or max(off) < 1e-45
        shares.append(float(max(off) / p.missed) if p.missed else 0.0)
    assert max(shares) <= 1.0
    assert max(shares) > 0.9


def test_leading_term_up_to_its_radius():
    rng, shares = np.random.default_rng(5), []
    for _ in range(draws(25, 300)):
        function = draw(rng)
        for share in (0.25, 1e-8):
            order, coefficient, radius = function.leading(share)
            for angle in rng.uniform(0, np.pi, 2):
                s = radius * mp.expj(mp.mpf(angle))
                leading = number(coefficient) * s**order
                off = abs(Exact(function)(s) / leading - 1)
                shares.append(float(off / share))
    assert max(shares) <= 1.0
    assert max(shares) > 0.01


def test_beyond_the_end_of_the_axis_the_leading_power_prevails():
    rng, least = np.random.default_rng(6), np.inf
    for _ in range(draws(60, 600)):
        function = draw(rng, 4)
        space = function.space
        steady, delayed = (v[None] for v in function.weights)
        end = float(space.confined_from(steady, delayed)[0])
        limit = float(space.limits(steady, delayed)[0][0])
        if np.isfinite(end):
            for angle in (0.0, rng.uniform(0, np.pi / 2), np.pi / 2):
                s = end * rng.choice([1.0, 3.0]) * mp.expj(mp.mpf(angle))
                value = Exact(function)(s) / (limit * s**space.degree)
                least = min(least, float(value.real))
    assert 0.0 < least < 0.9


@pytest.mark.parametrize("shares", [False, True])
def test_zero_is_excluded_only_where_all_members_stay_on_one_side(shares):
    rng, margins = np.random.default_rng(7), []
    for _ in range(draws(50, 500)):
        function = draw(rng, 4)
        space = function.space
        other = function_of(
            space, rng.normal(size=len(space.polynomials)), 0 * function.delayed
        )
        work = workspace(space.arrays, 2)
        room = members(np.array([1, 1, 2]), compiled([function, other]))
        middle = float(rng.choice(space.corners)) * 10.0 ** rng.uniform(-1, 1)
        half = middle * 10.0 ** rng.uniform(-4, -0.3)
        enclose(compiled([function, other]), middle, half, work)
        along = work.f[0, 0] / abs(work.f[0, 0, 0])
        along[1:] *= rng.uniform(-1, 1, 3)
        gamma = abs(along[0]) - np.abs(along[1:]).sum()
        if shares and gamma <= 0.0:
            continue
        size = abs(work.f[0, 0, 0] / work.f[1, 0, 0])
        # The largest level at which the hull of two vertices excludes zero, with a term.
        level, step = 0.0, 0.5
        for _ in range(30):
            shifts = np.array([0.0, 0.3j, 1.0]) * (level + step) * size
            weights = np.column_stack(([1.0, 1.0, 0.0], shifts))
            level += step * holds(weights, along, gamma if shares else 0.0, work, room)
            step *= 0.5
        if level == 0.0:
            continue
        exact, added, by = Exact(function), Exact(other), divisor(work)
        for t in (-1.0, rng.uniform(-1, 1), 1.0):
            s = mp.mpc(0, mp.mpf(middle) + mp.mpf(half) * t)
            g = polynomial_at(along if shares else along[:1], t)
            f, a = exact(s) * by / g, added(s) * by * mp.mpf(level * size) / g
            for vertex in (f, f + 0.3j * a):
                margins.append(float((vertex.real - abs(a)) / (abs(f) + abs(a))))
    assert len(margins) > 50
    assert 0.0 <= min(margins) < 1e-3


def test_a_function_moved_along_the_real_axis():
    rng, shares = np.random.default_rng(8), []
    for _ in range(draws(150, 1500)):
        function = draw(rng, 3)
        if not function.space.delays:
            continue
        sigma = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-2, 2.7) / function.space.longest
        space, functions = function.shifted(float(sigma))
        omega = 10.0 ** rng.uniform(-2, 1) / max(function.space.longest, 1.0)
        if rng.random() < 0.5:
            # Next to a root, where a small error of the root is a large one of its factor.
            omega = np.abs(space.arrays.roots.imag).max(initial=0.0) * (1.0 + 1e-12) or omega
        work = workspace(space.arrays, 1)
        enclose(functions, float(omega), 0.0, work)
        exact = Exact(function)(mp.mpc(float(sigma), omega)) * divisor(work)
        off = abs(exact - mp.mpc(complex(work.f[0, 0, 0])))
        shares.append(float(off / mp.mpf(float(work.rest[0]))))
    assert max(shares) <= 1.0
    assert max(shares) > 0.02


def test_delays_that_are_equal_but_for_rounding():
    lags = [Fraction(1000), Fraction(1000) + Fraction(3, 10**14)]
    function = function_of(Space([Polynomial.of([1])], after(lags)), [0], [[1, -1]])
    work = workspace(function.space.arrays, 1)
    enclosed(function, 1e7, 1e6, work)
    for t in (-1.0, 1.0):
        assert share_of_bound(function, Exact(function), 1e7, 1e6, work, t) <= 1.0
