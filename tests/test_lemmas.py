"""Lemmas 6, 15, 17 and 18 of the appendix "The lemmas behind a count", against 50 digits.

They concern differences of delays, families of functions, moved functions, and crossings of the
axis; `test_inclusion` has the other lemmas.
"""

from fractions import Fraction

import numpy as np
import pytest

from armlock.engine import decide, inclusion
from armlock.engine.decide import Family
from armlock.engine.functions import Space, compiled, stacked
from armlock.engine.polynomials import Polynomial
from armlock.engine.tolerances import UNCONFINED
from tests import draws
from tests.test_inclusion import (
    Exact,
    after,
    draw,
    enclosed,
    function_of,
    mp,
    share_of_bound,
    workspace,
)


def test_differences_of_delays_that_are_no_floats():
    # What a difference rounds by may be far larger than what its float rounds by.
    rng, shares = np.random.default_rng(11), []
    for _ in range(draws(80, 800)):
        first = Fraction(10.0 ** rng.uniform(0, 7)) / 3
        apart = Fraction(float(first) * 10.0 ** rng.uniform(-18, -1)) / 7
        middle = 10.0 ** rng.uniform(1, 15) / float(first)
        half = max(10.0 / float(first), 1e-15 * middle)
        if half > middle or float(apart) * half > 0.3:
            continue
        space = Space([Polynomial.of([1])], after([first, first + apart]))
        function = function_of(space, [0], [[1, -1]])
        work = workspace(space.arrays, 1)
        enclosed(function, middle, half, work)
        exact = Exact(function)
        for t in (-1.0, 0.0, 1.0):
            shares.append(share_of_bound(function, exact, middle, half, work, t))
    assert len(shares) > 80
    assert max(shares) <= 1.0
    assert max(shares) > 0.3


def rows_of(rng):
    """Draw the functions of rows f_0 - y f_1 - x f_2."""
    function = draw(rng, 4, delays=2, longest=1.0)
    space = function.space
    shape = function.delayed.shape
    others = [
        function_of(space, rng.normal(size=shape[0]), rng.normal(size=shape)) for _ in range(2)
    ]
    return space, [function, *others]


def crossings_of(functions, y, lower, upper, begin, end):
    """Find the crossings of rows, and the intervals that are not decided."""
    rows = inclusion.Rows(y, lower, upper)
    table, *_ = inclusion.cross(compiled(functions), rows, begin, end, False, 1e-9, 5_000)
    return table[table[:, 5] != 0.0], table[table[:, 5] == 0.0]


def pair(functions, y, omega):
    """Return N = f_0 - y f_1 and M = f_2 at a frequency, in 50 digits."""
    first, other, m = (f(mp.mpc(0, omega)) for f in functions)
    return first - mp.mpf(float(y)) * other, m


def test_each_crossing_is_where_it_is_said_to_be():
    rng = np.random.default_rng(12)
    shares: list[float] = []
    while len(shares) < draws(25, 250):
        space, functions = rows_of(rng)
        size = float(np.median(space.corners))
        y, most = rng.normal(size=3), np.full(3, 30.0)
        table, _ = crossings_of(functions, y, -most, most, 1e-2 * size, 20.0 * size)
        exact = [Exact(f) for f in functions]
        for row, x, spread, omega, width, jump in table[:20]:
            low, high = (mp.mpf(omega) + side * mp.mpf(width) for side in (-1, 1))
            ends = [pair(exact, y[int(row)], w) for w in (low, high)]
            below, above = (mp.sign((n * mp.conj(m)).imag) for n, m in ends)
            assert above == mp.sign(jump) == -below
            for _ in range(60):
                middle = (low + high) / 2
                n, m = pair(exact, y[int(row)], middle)
                past = mp.sign((n * mp.conj(m)).imag) == above
                low, high = (low, middle) if past else (middle, high)
            shares.append(float(abs((n / m).real - mp.mpf(x)) / mp.mpf(spread)))
    assert max(shares) <= 1.0
    assert max(shares) > 1e-3


def test_an_exponential_that_is_not_resolved_leaves_a_crossing_undecided():
    # exp(-1e10 s) - x (1 + 1e-6 s) has zeros at abs(x) near 0.7, but no float resolves them.
    space = Space([Polynomial.of([1]), Polynomial.of([1e6, 1.0])], after([10**10]))
    delayed = function_of(space, [1, 0], [[1], [0]])
    other = function_of(space, [0, Fraction(1, 10**6)], [[0], [0]])
    rows = [delayed, delayed * 0, other]
    one = np.ones(1)
    found, undecided = crossings_of(rows, 0.0 * one, -one, one, 1e6, 1e6 + 5e-7)
    assert not len(found)
    _, x, spread, omega, width, _ = undecided.T
    assert (x - spread < -0.71).all()
    assert (x + spread > 0.71).all()
    assert (omega - width).min() <= 1e6
    assert (omega + width).max() >= 1e6 + 5e-7


@pytest.mark.parametrize("where", ["begins", "ends"])
def test_a_family_is_clear_at_both_ends_of_the_axis(where):
    rng = np.random.default_rng(13)
    least: list[float] = []
    while len(least) < draws(400, 1500):
        first = draw(rng, 4)
        space, shape = first.space, first.delayed.shape
        second = first + function_of(space, 0.3 * rng.normal(size=shape[0]), np.zeros(shape))
        term = function_of(
            space, 10.0 ** rng.uniform(-3, 1) * rng.normal(size=shape[0]), np.zeros(shape)
        )
        units, none = np.eye(3).tolist(), [0.0] * 3
        test = [(1 if k < 2 else 2, units[k], none) for k in range(3)]
        family = Family([first, second, term], [test])
        at = getattr(family, where)(0.0)
        if not 0.0 < at < np.inf:
            continue
        vertices, added = [Exact(first), Exact(second)], Exact(term)
        if where == "begins":
            directions = [f.leading(1e-8).direction for f in (first, second)]
            along = sum(directions) / abs(sum(directions))
        else:
            limit = space.limits(*stacked([first]))[0][0]
            along = np.sign(limit) * 1j**space.degree
        for share in (1.0, 0.3):
            s = mp.mpc(0, at * share if where == "begins" else at / share)
            others = abs(added(s))
            for f in vertices:
                value = f(s)
                turned = (value * mp.conj(mp.mpc(complex(along)))).real
                least.append(float((turned - others) / (abs(value) + others)))
    assert 0.0 < min(least) < 0.1


def test_rounding_does_not_confine_the_zeros_of_a_moved_function():
    # Only delays act on the highest power: zeros of F lie arbitrarily far to the right.
    polynomials = [Polynomial.of([1]), Polynomial.of([0, 1])]
    space = Space(polynomials, after([1, Fraction(11, 10)]))
    rng = np.random.default_rng(14)
    for _ in range(draws(100, 1000)):
        weights = rng.uniform(0.1, 3.0, 2).tolist()
        function = function_of(space, [1, sum(map(Fraction, weights))], [[0, 0], weights])
        moved = function.shifted(rng.uniform(30.0, 40.0))
        assert decide.counts(*moved, most=1000) == UNCONFINED
