"""The white paper's loop: its open loop to all digits, counts, parts, and published loops."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import (
    Controller,
    Loop,
    equation,
    flight_loop,
    nyquist,
    paper_loop,
    unstable_roots,
)
from armlock.sensors import COMMON


def test_the_open_loop_has_its_digits_over_thirteen_decades(table):
    """Against the printed formulas, evaluated in factors with 40 digits."""
    for row in table("flight_loop.csv"):
        frequency, c1, c2, delay, real, imaginary = map(float, row.values())
        if frequency == 1e5:  # a null, of which rounding of omega tau leaves no digits
            continue
        found = flight_loop(delay=delay)(2j * np.pi * frequency, c1, c2)
        expected = complex(real, imaginary)
        # Next to zero both arms cancel; the phase of an arm is known to rounding of omega tau.
        bound = 1e-12 + 1e-7 * abs(c1 - 1.0) + 3e-14 * frequency
        assert abs(complex(found) / expected - 1.0) < bound, row


def test_counts_of_the_loop_that_flies():
    assert unstable_roots(flight_loop(), [1.0, 1.02], [1.0, 0.98]).tolist() == [0, 2]
    assert nyquist(flight_loop()).encirclements == 0
    # With arm 2 the longer one, the arms change places.
    assert unstable_roots(flight_loop(half_difference=-0.255), 1.0, 1.0) == 0


def test_parallel_branches_are_their_sum():
    one = Controller([-3.0], [0.0, -1e-6], 2.0)
    other = Controller([], [0.0, -2.0 + 1j, -2.0 - 1j], -5.0)
    both = one + other
    # The pole at zero, which both have, is not doubled.
    assert sorted(both.poles(), key=abs) == [0.0, -1e-6, *other.poles()[1:]]
    s = 1j * np.geomspace(1e-9, 1e4, 60)
    np.testing.assert_allclose(both(s), one(s) + other(s), rtol=1e-13)


def test_bad_parallel_branches_are_refused():
    lag = Controller([], [-1.0], 1.0)
    with pytest.raises(ValueError, match="must be proper, got 2 zeros and 1 poles"):
        Loop(lag + Controller([-1.0, -2.0], [-1.0], 1.0), COMMON, 1.0, 1.0)


# Of the public code quickTDI, module TJ_lock.
PI = Controller([-100.0], [0.0], 1e4)
PUBLISHED = {
    "white paper": flight_loop(),
    "Table II": paper_loop(),
    "PI": Loop(PI, "common", 20.1, 19.9),
    "high-gain single arm": Loop(PI, "single", 20.0),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_loops_are_stable_or_at_the_boundary(name):
    loop = PUBLISHED[name]
    assert unstable_roots(loop, 1.0, 1.0) == 0
    # D of the plain PI loops has a root s = 0 at the ideal point, as of every such loop.
    of_d = {"PI": -1, "high-gain single arm": -1}.get(name, 0)
    assert unstable_roots(equation(1 + loop), 1.0, 1.0) == of_d
