"""The controlled loop of Sec. IV: counts near and far, by methods that share no step."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from armlock import (
    critical_perturbation,
    d_curve_line,
    nyquist,
    paper_loop,
    rightmost_root,
    stability_chart,
    unstable_roots,
)
from armlock.controllers import table_two
from armlock.roots import RootError, extended_root
from book.companion.schemes import pseudospectral_roots
from tests import independent

LOOP = paper_loop()
E = 1e-6
BOX = [(1.0 + x * E, 1.0 + y * E) for x in (-1, 0, 1) for y in (-1, 0, 1)]
FAR = [(0.9, 0.95), (0.95, 0.9), (0.5, 1.2), (0.3, 0.4), (1.2, 0.5), (-0.4, 0.9), (1.3, -0.6)]


def roots_right(loop, c1, c2, degree):
    """Distinct roots in the right half-plane, polished from a discretization."""
    found: list[complex] = []
    for start in pseudospectral_roots(loop, c1, c2, degree):
        if start.real < -1e-3:
            continue
        try:
            root = complex(extended_root(loop, c1, c2, start, digits=20))
        except RootError:
            continue
        if root.real > 0.0:
            found += [root] * all(abs(root - r) > 1e-9 * abs(r) for r in found)
    return found


@pytest.mark.parametrize(("c1", "c2"), BOX)
def test_the_box_is_stable_by_three_methods(c1, c2):
    assert unstable_roots(LOOP, c1, c2) == 0
    assert nyquist(LOOP, c1, c2).encirclements == 0
    assert roots_right(LOOP, c1, c2, 60) == []


@pytest.mark.parametrize(("c1", "c2"), [(1.0, 1.0), (1.0 + E, 1.0 - E), (1.0, 1.0 - E)])
def test_rightmost_root_is_slow_and_certified(c1, c2):
    root = complex(rightmost_root(LOOP, c1, c2))
    assert -4e-6 < root.real < -2e-6
    assert unstable_roots(LOOP.shifted(root.real * (1.0 - 1e-6)), c1, c2) == 0
    assert unstable_roots(LOOP.shifted(root.real * (1.0 + 1e-6)), c1, c2) >= 1


@pytest.mark.parametrize(("c1", "c2"), FAR)
def test_far_outside_the_box_the_methods_agree(c1, c2):
    count = int(unstable_roots(LOOP, c1, c2))
    assert nyquist(LOOP, c1, c2).closed_loop_roots == count
    assert len(roots_right(LOOP, c1, c2, 120)) == count


@pytest.mark.parametrize("denominator", ["table", "printed"])
@pytest.mark.parametrize("actuator", [False, True])
@pytest.mark.parametrize("shift", [-1, 0, 1])
def test_both_readings_and_both_denominators(denominator, actuator, shift):
    loop = paper_loop(controller=table_two(denominator=denominator), actuator=actuator)
    expected = {
        ("table", False): (0, 0, 0),
        ("table", True): (1, 0, 0),
        ("printed", False): (2, 2, 0),
        ("printed", True): (1, 0, 0),
    }[denominator, actuator][shift + 1]
    c2 = 1.0 + shift * E
    assert unstable_roots(loop, 1.0, c2) == expected
    assert nyquist(loop, 1.0, c2).encirclements == expected
    assert len(roots_right(loop, 1.0, c2, 60)) == expected


def test_no_root_at_zero_at_the_ideal_point():
    """The sensor's pole at s = 0 meets zeros of the controller, and they cancel."""
    with pytest.raises(ValueError, match="depend on a free parameter at s = 0"):
        d_curve_line(LOOP)
    assert abs(LOOP(0.0, 1.0, 1.0)) > 0.0
    assert nyquist(LOOP).pole_order == 0


def test_large_chart_is_consistent():
    """400 x 400: no row recounted, and the edge where the critical perturbation has it."""
    x = 1.0 + np.linspace(-5e-6, 5e-6, 400)
    chart = stability_chart(LOOP, x, x)
    assert chart.recounted_rows.size == 0
    assert set(np.unique(chart.counts)) == {0, 2}
    ahead = x[None, :] - x[:, None]
    edge = 2.0 * critical_perturbation(LOOP, (1, -1))
    np.testing.assert_array_equal(chart.stable, ahead < edge)


def reference_crossing(direction, start):
    """Solve 1 + L(j omega) = 0 for omega and eps, with 40 digits and the factored loop."""
    with mpmath.workdps(40):

        def equation(omega, eps):
            point = (1 + eps * d for d in direction)
            value = independent.exact(LOOP, mpmath.mpc(0, omega), *point)
            return value.real, value.imag

        omega, eps = mpmath.findroot(equation, start, tol=1e-60)
        return float(omega), float(eps)


@pytest.mark.parametrize("direction", [(1, -1), (0, -1), (1, 0), (2, 1), (0.3, -0.8)])
def test_critical_perturbation_to_nine_digits(direction):
    found = critical_perturbation(LOOP, direction)
    omega, eps = reference_crossing(direction, (2e-5, found))
    assert omega > 0.0
    assert found == pytest.approx(eps, rel=1e-9)


def test_first_perturbation_along_the_diagonal_is_the_chain():
    assert critical_perturbation(LOOP, (1, 1)) == pytest.approx(1e-4, rel=1e-9)
