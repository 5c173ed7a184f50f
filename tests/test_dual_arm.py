"""The dual arm against closed forms, and crossings along rays."""

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
    critical_perturbation,
    d_curve_line,
    margins,
    unstable_roots,
)
from armlock.robustness.rays import Ray, first_crossing
from armlock.sensors import COMMON, dual
from book.companion.claims import dual_arm


@pytest.mark.parametrize("gain", [0.1, 10.0, 1e4])
@pytest.mark.parametrize("options", [{}, {"corner": 0.7}, {"difference": 0.1}])
def test_straight_edge_is_where_both_perturbations_are_equal(gain, options):
    loop = DualArm(gain, **options)
    assert d_curve_line(loop) == (1.0, -1.0, 0.0)
    c = np.array([-0.5, 0.2, 0.9, 1.0])
    np.testing.assert_array_equal(unstable_roots(loop, c, c), BOUNDARY)
    np.testing.assert_array_equal(unstable_roots(loop, c, c + 1e-9), 0)
    np.testing.assert_array_equal(unstable_roots(loop, c, c - 1e-9), 1)


@pytest.mark.parametrize("gain", [1.0, 10.0, 300.0])
def test_edges_are_where_the_count_changes(gain):
    loop, found = DualArm(gain), dual_arm.edges(gain)
    c = 1.0 + found.corner * np.array([1.0 - 1e-4, 1.0 + 1e-4])
    assert unstable_roots(loop, c, c + 1e-9).tolist() == [0, 2]
    d = found.width * np.array([1.0 - 1e-6, 1.0 + 1e-6])
    assert unstable_roots(loop, 0.9 - d / 2, 0.9 + d / 2).tolist() == [0, 2]


def test_crossings_along_a_ray_add_up_to_the_counts():
    loop = DualArm()
    start, direction = np.array([0.8, 1.2]), np.array([0.35, -0.4])
    crossings = Ray(loop, start, direction).crossings(1.0)
    assert (np.diff(crossings.position) >= 0.0).all()
    t = np.linspace(0.013, 0.99, 40)
    expected = int(unstable_roots(loop, *start)) + np.array(
        [crossings.change[crossings.position < here].sum() for here in t]
    )
    along = start[:, None] + t * direction[:, None]
    np.testing.assert_array_equal(unstable_roots(loop, *along), expected)
    first = first_crossing(loop, start, direction, 1.0)
    assert first.position == pytest.approx(crossings.position[0], rel=1e-12)


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
