"""The dual arm against closed forms, and crossings along rays."""

import mpmath
import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    CommonArm,
    Controller,
    DualArm,
    Loop,
    critical_perturbation,
    first_crossing,
    margins,
    unstable_roots,
)
from armlock.engine import decide
from armlock.sensors import COMMON, DIFFERENCE, dual
from tests import independent
from tests.systems import two_delays


def around(loop, start, direction, position, near=1e-6):
    """Count the unstable roots before and past a crossing."""
    points = start + position * np.outer([1.0 - near, 1.0 + near], direction)
    return [decide.count(loop.affine.function(*point)) for point in points]


def test_a_crossing_below_what_a_walk_in_polynomials_of_each_arm_sees_is_found():
    # A sensor with 1 / (tau1 - tau2) = 4e7 1/s, whose terms cancel below 7 rad/s.
    loop = Loop(([], [0.0], 2.0), dual(2.5, 2.3e-8), 15.977629546, 15.977629523, delay=0.00538)
    start, direction = np.array([1.0000024, 1.0000003518]), np.array([1.0, 1.0])
    found = first_crossing(loop, start, direction, 0.2)
    before, after = around(loop, start, direction, found.position)
    assert decide.count(loop.affine.function(*start)) == before > after >= 0


@pytest.mark.parametrize("zeros", [(), (-0.5,)])
def test_with_equal_delays_only_the_chain_ends_what_no_parameter_changes(zeros):
    """Along (1, -1), however far."""
    loop = Loop((zeros, (-1.0,), 0.2), COMMON, 20.0, 20.0)
    far = np.array([0.5, 2.0, 100.0, 1e4])
    stable = unstable_roots(loop, 1.0 + far, 1.0 - far) == 0
    assert (stable == (far < critical_perturbation(loop, (1.0, -1.0)))).all()
    assert stable[0]
    assert stable[-1] != bool(zeros)


def test_first_crossing_says_where_there_is_none():
    found = first_crossing(CommonArm(), (0.0, 0.0), (1.0, 1.0), 0.9)
    assert found.position == np.inf
    assert np.isnan(found.omega)


def test_a_lost_chain_is_not_passed_over():
    """1 + 0.3 (2 - x u - y v): stable up to 0.3 (|x| + |y|) = 1.6, and lost from there on."""
    loop = Loop(Controller([], [], 0.3), COMMON, 20.1, 19.9)
    for size in (1e-30, 1.0, 1e30):
        found = first_crossing(loop, (0.0, 0.0), (size, -size), 3.0 / size)
        assert size * found.position == pytest.approx(1.6 / 0.6, rel=1e-12)
        assert found.omega == np.inf
    assert first_crossing(loop, (6.0, 0.0), (0.0, 1.0), 1.0).position == 0.0
    assert first_crossing(loop, (0.0, 0.0), (1.0, -1.0), 2.5).position == np.inf


# An oscillator with two delayed forces, and one of its crossings, known to rounding.
OSCILLATOR = two_delays([1.0, 0.2, 1.0], [1.0], [1.0], 1.0, 2.0)
BOUNDARY_POINT = (-0.40709479644622093, 0.185983667443698)


@pytest.mark.parametrize("stop", [0.2, 1.0, None])
def test_a_ray_from_the_boundary_meets_the_next_crossing(stop):
    direction = np.array([-0.967681471724209, 1.6784190387621596])
    assert unstable_roots(OSCILLATOR, *BOUNDARY_POINT) == BOUNDARY
    found = first_crossing(OSCILLATOR, BOUNDARY_POINT, direction, stop)
    around = np.outer([0.5, 1.0 - 1e-6, 1.0 + 1e-6], found.position * direction)
    counts = unstable_roots(OSCILLATOR, *(BOUNDARY_POINT + around).T)
    assert counts.tolist() == [0, 0, 2]


def test_a_ray_may_end_where_rounding_has_the_chain_at_its_limit():
    loop = Loop(Controller([-1.0], [-2.0], 0.2), COMMON, 1.0, 0.7)
    limit = first_crossing(loop, (0.1, 0.1), (1.0, 1.0)).position
    found = first_crossing(loop, (0.1, 0.1), (1.0, 1.0), limit * (1.0 - 1e-15))
    assert found.position == np.inf


def test_a_first_crossing_may_lie_many_turns_up():
    # The resonance is 1.5e5 turns of the delay up, and damps until x is 4 pi 1.5e5 1e-6.
    resonance = 2.0 * np.pi * 1.5e5
    squared = [resonance**2, 2e-6 * resonance, 1.0]
    system = two_delays(squared, [0.0, 1.0], [0.0], 1.0, 1.0)
    found = first_crossing(system, (0.0, 0.0), (1.0, 0.0))
    assert found.position == pytest.approx(2e-6 * resonance, rel=1e-9)


def test_a_factor_before_the_equation_moves_no_crossing():
    plain, scaled = (
        two_delays([2.0 * f, 0.3 * f, f], [f], [0.0, f], 1.0, 2.5) for f in (1.0, 1e-158)
    )
    for direction in ((1.0, 0.5), (-1.0, 1.0)):
        found, expected = (
            first_crossing(system, (0.0, 0.0), direction) for system in (scaled, plain)
        )
        assert found == pytest.approx(expected, rel=1e-12)


def test_an_arm_that_is_not_used_changes_no_crossing():
    """The polynomial zero stands for it, also where s cancels along the ray."""
    loop = Loop(Controller([0.0, 0.0], [-1.0, -2.0, -3.0], 30.0), "single", 20.1)
    ways = (1.0, 2.0), (1.0, 0.0)
    found, expected = (first_crossing(loop, (1.0, 1.0), way) for way in ways)
    assert found == pytest.approx(expected, rel=1e-12)
    before, after = around(loop, (1.0, 1.0), (1.0, 0.0), found.position)
    assert 0 <= before != after >= 0
    assert first_crossing(loop, (1.0, 1.0), (0.0, 1.0)).position == np.inf


@pytest.mark.parametrize("apart", [0.0, 2.0**-53])
def test_arms_that_differ_by_rounding_alone_break_no_loop_together(apart):
    """The difference of both cancels but for a part in 1e16, and parameters end at 1e9."""
    loop = Loop(Controller([-3.0], [-2.0, -0.1, -0.3], 0.1), DIFFERENCE, 0.8, 0.8 + apart)
    assert first_crossing(loop, (1.0, 1.0), (1.0, 1.0)).position == np.inf


def test_a_steep_low_pass_far_above_changes_no_crossing():
    """The square of its gain is no float."""
    angles = np.pi * (0.5 + (2.0 * np.arange(16) + 1.0) / 64.0)
    upper = 1e5 * np.exp(1j * angles)
    poles = [0.0, *upper, *upper.conj()]
    loop = Loop(Controller([], poles, 0.2 * 1e160), COMMON, 3.0, 2.1)
    assert tuple(first_crossing(loop, (0.5, 0.5), (1.0, 1.0), 3.0)) == (0.5, 0.0)
    plain = margins(Loop(Controller([], [0.0], 0.2), COMMON, 3.0, 2.1), 0.9, 0.9)
    found = margins(loop, 0.9, 0.9)
    assert found.phase == pytest.approx(plain.phase, rel=1e-3)
    assert found.delay == pytest.approx(plain.delay, rel=1e-3)


@pytest.mark.parametrize("gain", [0.1, 0.3])
def test_where_the_straight_edge_ends_a_root_passes_zero(gain):
    # Along c1 = c2 the root of D at s = 0 is not the loop's; past c1 = c2 = 2 another one is.
    loop = DualArm(gain=gain)
    edge = first_crossing(loop, (0.5, 0.5), (1.0, 1.0), stop=10.0)
    assert edge.omega == 0.0
    assert abs(edge.position - 1.5) < 1e-12
    c = np.array([1.999, 2.001])
    assert unstable_roots(loop, c - 1e-6, c + 1e-6).tolist() == [0, 2]


def test_a_crossing_keeps_its_digits_where_both_arms_cancel_through_a_resonance():
    # K is 5e10 at the crossing, and the arms differ by a part in 4e6 of a turn.
    poles = [-4.6e-8 + 2.5e-4j, -4.6e-8 - 2.5e-4j]
    loop = Loop(Controller([-1e-3], poles, 1e5), DIFFERENCE, 0.1325, 0.1320, delay=0.115)
    crossing = first_crossing(loop, (5e-8, 5e-8), (1.0, 1.0), stop=1e-2)

    def parts(omega, t):
        c = mpmath.mpf(5e-8) + t
        value = independent.exact(loop, mpmath.mpc(0, omega), c, c)
        return value.real, value.imag

    with mpmath.workdps(50):
        _, exact = mpmath.findroot(parts, (crossing.omega, crossing.position))
    assert crossing.position == pytest.approx(float(exact), rel=1e-11)


def test_a_crossing_nearer_than_rounding_of_one_is_found_next_to_zero_parameters():
    # R is 1e-21 at s = 0, so that a root passes there at t = 5e-22.
    loop = Loop(Controller([], [-1e-7] * 3, 1.0), DIFFERENCE, 5.0, 4.0)
    found = first_crossing(loop, (1e-11, 1e-11), (-1.0, 1.0), 1e-18)
    assert found.position == pytest.approx(5e-22, abs=1e-28)
    assert found.omega == 0.0
