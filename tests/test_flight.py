"""The white paper's loop against its formulas in extended precision, and published numbers."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from armlock import (
    Controller,
    Loop,
    critical_perturbation,
    flight_loop,
    nyquist,
    published_loops,
    stability_chart,
    unstable_roots,
)
from armlock.sensors import COMMON, modified_dual

DELAYS = (33.6 + 0.255, 33.6 - 0.255)
PARALLEL = ["1.3e-3", "3.7e-3", "4.2e-3", "16e-3", "30e-3", "69e-3", "0.11", "0.33", "0.70"]


def formulas(s, mean=33.6, half=0.255, g2=40.0, corner=2.0 * np.pi * 0.4):
    """G* / 2, H+ and H-, as they are printed."""
    turn = 2 * mpmath.pi
    mean, half, g2, corner = map(mpmath.mpf, (mean, half, g2, corner))
    zb, pb, pe = turn * 5 / (13 * mean), turn * 5 / (2 * mean), turn / (90 * mean)
    slow = (1 / mean) * (pb / zb) * (s + zb) / (s * (s + pb))
    fast = s**4 / ((s + 7 / (5 * mean)) * (s + 11 / (20 * mean)) * (s + pe) ** 2)
    minus = corner / (s + corner) * fast / (s * half)
    p1, p2, z3, p3, p41, p42 = (
        turn * mpmath.mpf(f) for f in ["0.8e-6", "210e-6", "36.6e-6", "185e-6", "3e-3", "0.238"]
    )
    lead = ((p3 / z3) * (s + z3) / (s + p3)) ** 5
    branches = p41 * p42 / ((s + p41) * (s + p42)) + sum(
        mpmath.mpf(g) / (s + turn * 3 * mpmath.mpf(10) ** (k - 4))
        for k, g in enumerate(PARALLEL, 1)
    )
    star = (s / (s + p1)) ** 3 * g2 * s / (s + p2) * lead * branches
    return star / 2, slow + fast, minus


@pytest.mark.parametrize("delay", [0.0, 12.305e-6])
def test_the_loop_in_factors_keeps_its_digits_over_thirteen_decades(delay):
    loop = flight_loop(delay=delay)
    with mpmath.workdps(40):
        for omega in np.geomspace(1e-7, 1e6, 120):
            s = mpmath.mpc(0, omega)
            half_star, plus, minus = formulas(s)
            late = mpmath.exp(-s * mpmath.mpf(delay))
            expected = [half_star * (plus + minus) * late, half_star * (plus - minus) * late]
            found = loop.arm_responses(1j * omega)
            for one, other in zip(found, expected, strict=True):
                assert abs(complex(one) / complex(other) - 1.0) < 5e-13


@pytest.mark.parametrize(
    ("frequency", "c", "expected"),
    [
        # Open loop to sixteen digits, evaluated in factors with 40 digits.
        (1e-7, (1.0, 1.0), 3.710652259521175e-5 - 1.407805926085626e-5j),
        (3e-3, (1.0, 1.0), None),
        (1.7, (1.0, 1.0), None),
    ],
)
def test_the_open_loop_is_that_of_the_formulas(frequency, c, expected):
    loop = flight_loop()
    with mpmath.workdps(40):
        s = mpmath.mpc(0, 2.0 * np.pi * frequency)
        half_star, plus, minus = formulas(s)
        late1, late2 = (ck * mpmath.exp(-s * tau) for ck, tau in zip(c, DELAYS, strict=True))
        value = complex(
            half_star * ((plus + minus) * (1 - late1) + (plus - minus) * (1 - late2))
        )
    found = complex(loop.open_loop(2j * np.pi * frequency, *c))
    # An arm's phase is known to rounding of omega tau.
    assert abs(found / value - 1.0) < 1e-12
    assert expected is None or abs(found / expected - 1.0) < 1e-11


def test_counts_of_the_loop_that_flies():
    assert unstable_roots(flight_loop(), [1.0, 1.02], [1.0, 0.98]).tolist() == [0, 2]
    assert nyquist(flight_loop()).encirclements == 0


def test_with_the_other_sign_of_the_difference_arm_it_is_unstable():
    right, turned = modified_dual(33.6, 0.255), modified_dual(33.6, -0.255)
    assert right.numerator1 == turned.numerator2
    assert unstable_roots(Loop(flight_loop().controller, turned, 33.855, 33.345), 1, 1) == 38
    # With arm 2 the longer one the sign is right again: the arms have changed places.
    assert unstable_roots(flight_loop(half_difference=-0.255), 1, 1) == 0


def test_a_chart_agrees_with_single_counts():
    axis = np.linspace(0.97, 1.03, 7)
    chart = stability_chart(flight_loop(), axis, axis)
    assert (chart.counts == unstable_roots(flight_loop(), *np.meshgrid(axis, axis))).all()
    edge = critical_perturbation(flight_loop(), (1, -1))
    assert unstable_roots(flight_loop(), 1 + 0.999 * edge, 1 - 0.999 * edge) == 0
    assert unstable_roots(flight_loop(), 1 + 1.001 * edge, 1 - 1.001 * edge) > 0


def test_parallel_branches_are_their_sum():
    one = Controller([-3.0], [0.0, -1e-6], 2.0)
    other = Controller([], [0.0, -2.0 + 1j, -2.0 - 1j], -5.0)
    both = one + other
    # The pole at zero, which both have, is not doubled.
    assert sorted(both.poles, key=abs) == [0.0, -1e-6, *other.poles[1:]]
    s = 1j * np.geomspace(1e-9, 1e4, 60)
    np.testing.assert_allclose(both(s), one(s) + other(s), rtol=1e-13)


def test_bad_parallel_branches_are_refused():
    lag = Controller([], [-1.0], 1.0)
    with pytest.raises(ValueError, match="gain must not be zero"):
        lag + Controller([], [-1.0], -1.0)
    with pytest.raises(ValueError, match="must be proper, got 2 zeros and 1 poles"):
        Loop(lag + Controller([-1.0, -2.0], [-1.0], 1.0), COMMON, 1.0, 1.0)


@pytest.mark.parametrize("name", published_loops())
def test_published_loops_have_a_source(name):
    loop, source = published_loops()[name]
    assert source
    # The plain PI loops sit on the boundary at the ideal point, as every such loop does.
    assert unstable_roots(loop, 1.0, 1.0) == {"PI": -1, "high-gain single arm": -1}.get(name, 0)
