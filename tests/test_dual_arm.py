"""The dual arm against closed forms, and crossings along rays."""

from contextlib import nullcontext

import mpmath
import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    CharacteristicFunction,
    CommonArm,
    Controller,
    CountError,
    DualArm,
    Loop,
    axis_crossings,
    critical_perturbation,
    margins,
    unstable_roots,
)
from armlock.robustness import rays
from armlock.robustness.rays import Ray, first_crossing
from armlock.sensors import COMMON, DIFFERENCE, dual
from tests import independent


def test_a_crossing_that_rounding_hides_is_refused():
    # A sensor with 1 / (tau1 - tau2) = 4e7 1/s: below 7 rad/s a walk sees no sign.
    loop = Loop(([], [0.0], 2.0), dual(2.5, 2.3e-8), 15.977629546, 15.977629523, delay=0.00538)
    start, direction = (1.0000024, 1.0000003518), (1.0, 1.0)
    counts = unstable_roots(loop, *np.transpose([start, np.add(start, 0.2)]))
    assert counts[0] > counts[1]
    ray = Ray(loop, start, direction)
    for find in (ray.crossings, ray.first):
        with pytest.raises(CountError, match="rounding hides some"):
            find(0.2)
    with pytest.raises(CountError, match="rounding hides some"):
        axis_crossings(loop, *start, omega_max=50.0)


def test_a_count_that_cannot_be_told_confirms_no_crossing(monkeypatch):
    ray, stretch = Ray(DualArm(), (0.9, 1.0), (0.0, 1.0)), np.array([[1e-4, 2e-4]])
    nothing = ray.crossings(3e-4)
    assert nothing.position.size == 0
    ray._confirm(nothing, stretch, 3e-4)
    monkeypatch.setattr(rays, "unstable_roots", lambda *_: -1)
    unknown = Ray(DualArm(), (0.9, 1.0), (0.0, 1.0))
    with pytest.raises(CountError, match="are -1 and -1"):
        unknown._confirm(nothing, stretch, 3e-4)


@pytest.mark.parametrize(("told_from", "confirms"), [(1e-11, True), (1e-6, False)])
def test_a_start_on_the_boundary_confirms_what_is_next_to_it(told_from, confirms):
    def count(t):
        return -1 if t < told_from else 0

    ray = Ray(DualArm(), (0.9, 1.0), (0.0, 1.0))
    ray.count = count
    with nullcontext() if confirms else pytest.raises(CountError, match="are -1 and 0"):
        ray._confirm(rays._NONE, np.array([[0.0, 2e-4]]), 3e-4)


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
    assert (found.position, found.change) == (np.inf, 0)
    assert np.isnan(found.omega)


def test_a_lost_chain_is_not_passed_over():
    """1 + 0.3 (2 - x u - y v): stable up to 0.3 (|x| + |y|) = 1.6, and lost from there on."""
    loop = Loop(Controller([], [], 0.3), COMMON, 20.1, 19.9)
    with pytest.raises(ValueError, match=r"^the ray must stay where the neutral root chain"):
        Ray(loop, (0.0, 0.0), (1.0, -1.0)).crossings(3.0)
    for size in (1e-30, 1.0, 1e30):
        found = first_crossing(loop, (0.0, 0.0), (size, -size), 3.0 / size)
        assert size * found.position == pytest.approx(1.6 / 0.6, rel=1e-12)
        assert (found.omega, found.change) == (np.inf, 0)
    assert first_crossing(loop, (6.0, 0.0), (0.0, 1.0), 1.0).position == 0.0
    assert first_crossing(loop, (0.0, 0.0), (1.0, -1.0), 2.5).position == np.inf


# An oscillator with two delayed forces, and one of its crossings, known to rounding.
OSCILLATOR = CharacteristicFunction([1.0, 0.2, 1.0], [1.0], [1.0], 1.0, 2.0)
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
    limit = Ray(loop, (0.1, 0.1), (1.0, 1.0)).chain_limit()
    found = first_crossing(loop, (0.1, 0.1), (1.0, 1.0), limit * (1.0 - 1e-15))
    assert found.position == np.inf


def test_a_first_crossing_may_lie_many_turns_up():
    # The resonance is 1.5e5 turns of the delay up, and damps until x is 4 pi 1.5e5 1e-6.
    resonance = 2.0 * np.pi * 1.5e5
    squared = [resonance**2, 2e-6 * resonance, 1.0]
    system = CharacteristicFunction(squared, [0.0, 1.0], [0.0], 1.0, 1.0)
    found = first_crossing(system, (0.0, 0.0), (1.0, 0.0))
    assert found.position == pytest.approx(2e-6 * resonance, rel=1e-9)


def test_a_factor_before_the_equation_moves_no_crossing():
    plain, scaled = (
        CharacteristicFunction([2.0 * f, 0.3 * f, f], [f], [0.0, f], 1.0, 2.5)
        for f in (1.0, 1e-158)
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
    assert found == expected
    before, after = unstable_roots(loop, 1.0 + found.position * np.array([1 - 1e-6, 1 + 1e-6]))
    assert after - before == found.change
    assert first_crossing(loop, (1.0, 1.0), (0.0, 1.0)).position == np.inf


def test_arms_that_differ_by_rounding_alone_are_refused():
    controller = Controller([-3.0], [-2.0, -0.1, -0.3], 0.1)
    equal, nearly = (Loop(controller, DIFFERENCE, 0.8, 0.8 + x) for x in (0.0, 2.0**-53))
    assert first_crossing(equal, (1.0, 1.0), (1.0, 1.0)).position == np.inf
    with pytest.raises(CountError, match="rounding hides all of the sum"):
        first_crossing(nearly, (1.0, 1.0), (1.0, 1.0))


def test_a_steep_low_pass_far_above_changes_no_crossing():
    """The square of its gain is no float."""
    angles = np.pi * (0.5 + (2.0 * np.arange(16) + 1.0) / 64.0)
    upper = 1e5 * np.exp(1j * angles)
    poles = [0.0, *upper, *upper.conj()]
    loop = Loop(Controller([], poles, 0.2 * 1e160), COMMON, 3.0, 2.1)
    assert tuple(first_crossing(loop, (0.5, 0.5), (1.0, 1.0), 3.0)) == (0.5, 0.0, 1)
    plain = margins(Loop(Controller([], [0.0], 0.2), COMMON, 3.0, 2.1), 0.9, 0.9)
    found = margins(loop, 0.9, 0.9)
    assert found.phase == pytest.approx(plain.phase, rel=1e-3)
    assert found.delay == pytest.approx(plain.delay, rel=1e-3)


@pytest.mark.parametrize("gain", [0.1, 0.3])
def test_where_the_straight_edge_ends_a_root_passes_zero(gain):
    # Along c1 = c2 the root of D at s = 0 is not the loop's; past c1 = c2 = 2 another one is.
    loop = DualArm(gain=gain)
    edge = first_crossing(loop, (0.5, 0.5), (1.0, 1.0), stop=10.0)
    assert edge[1:] == (0.0, 1)
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
    ray = Ray(loop, (1e-11, 1e-11), (-1.0, 1.0))
    before, after = (unstable_roots(loop, *ray.at(t)) for t in (0.0, 1e-18))
    crossings = ray.crossings(1e-18)
    assert crossings.position[crossings.omega == 0.0] == pytest.approx([5e-22], abs=1e-28)
    assert after - before == crossings.change.sum() != 0
