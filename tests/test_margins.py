"""Margins and the first perturbation that breaks a loop, against counts and brute force."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    CommonArm,
    Controller,
    CountError,
    DualArm,
    Loop,
    SingleArm,
    critical_perturbation,
    flight_loop,
    margins,
    modulus_margin,
    paper_loop,
    unstable_roots,
)
from armlock.loops import LoopAt
from armlock.robustness import free_phases, gains
from armlock.robustness.gains import gain_interval
from armlock.robustness.rays import first_crossing
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual
from armlock.stability.counts import loop_count
from tests import independent
from tests.attack import Tally, check_margins, to_loop
from tests.systems import sketch_of

E = 1e-6
STABLE = {
    "single arm": (SingleArm(), (0.999, 1.0)),
    "single arm, negative": (SingleArm(0.05, 20.1), (-1.5, 1.0)),
    "common arm": (CommonArm(), (1.0, 0.999)),
    "dual arm": (DualArm(), (1.0, 1.005)),
    "dual arm, low gain": (DualArm(gain=0.3), (1.01, 1.02)),
    "controlled": (paper_loop(), (1.0, 1.0)),
    "controlled, corner of the box": (paper_loop(), (1.0 + E, 1.0 - E)),
    # Roots cross before the chain is lost, at 1 / (5000 1e-4).
    "controlled, above": (paper_loop(), (1.0, 1.0 + 1e-4)),
    "oscillator": (Loop(((), (-0.1 + 1j, -0.1 - 1j), 0.9), SINGLE, 2.0, 1.5), (0.5, 1.0)),
    "resonance": (Loop(((-1,), (-1e-6 + 3j, -1e-6 - 3j), 1e-7), SINGLE, 2, 1.5), (0.9, 1.0)),
    # A real root crosses at s = 0 where k 699 gain = 1, with k = 1.43.
    "weak": (Loop(((), (-1.0,), 1e-3), SINGLE, 2.0, 1.5), (700.0, 1.0)),
    # It needs gain: with less, a real root crosses at s = 0.
    "unstable pole": (Loop(((-2.0,), (0.2, -3.0), 1.5), COMMON, 0.3, 0.2), (0.1, 0.2)),
    "dead time": (Loop(((), (0.0,), 3.0), COMMON, 20.1, 19.9, delay=0.03), (1.0, 0.999)),
    "neutral": (Loop(((-3.0,), (-1.0,), 0.2), COMMON, 2.0, 1.5), (0.9, 1.0)),
    "neutral, single arm": (Loop(((-30.0,), (-1.0,), 0.6), SINGLE, 2.0, 1.5), (0.7, 1.0)),
    "neutral, opposed": (Loop(((-3.0,), (-1.0,), 0.2), DIFFERENCE, 2.0, 1.5), (0.9, 1.0)),
    # L is the limit of a quotient whose denominator does not begin with one.
    "neutral, dual arm": (
        Loop(((-1.0,), (-2.0,), 0.2), dual(3.0, 0.5), 2.0, 1.5, 0.1),
        (0.9, 1.0),
    ),
    "without dynamics": (Loop(((), (), 0.3), SINGLE, 2.0, 1.5), (1.5, 1.0)),
    # The disc that L fills at high frequency meets the unit circle.
    "without dynamics, both arms": (Loop(((), (), 0.9), COMMON, 2.2, 9.9), (0.99, 0.99)),
    "negative gain": (Loop(((), (), -0.2), COMMON, 20.1, 19.9), (1.0, 1.0)),
    # The peak that limits the gain lies past a thousand turns of the delay.
    "far peak": (
        Loop(
            (
                (0.0, -106.0, 112.0, -3.2 + 396j, -3.2 - 396j),
                (0.1 + 3j, 0.1 - 3j, -0.5 + 50j, -0.5 - 50j, -200 + 2e4j, -200 - 2e4j),
                -112.0,
            ),
            SINGLE,
            2.0,
            1.5,
        ),
        (0.01, 1.0),
    ),
    # 1 - 5 k (2 - 0.1 u - 0.1 v) has no zero where 9 k > 1, and has some just below.
    "large negative gain": (Loop(((), (), -5.0), COMMON, 20.1, 19.9), (0.1, 0.1)),
}


@pytest.mark.parametrize("name", STABLE)
def test_margins_are_those_of_branch_and_bound(name):
    """All six, and counts on both sides of the gain margins."""
    (loop, point), tally = STABLE[name], Tally(patient=False, where=name)
    found, sketch = margins(loop, *point), sketch_of(loop)
    with np.errstate(all="ignore"):
        check_margins(tally, np.random.default_rng(1), sketch, loop, point)
    assert tally.calls["margins"] == 1
    assert (tally.wrong, tally.refused) == ([], [])
    for factor, inside in ((found.gain_lower, 1.0 + E), (found.gain_upper, 1.0 - E)):
        if 0.0 < factor < np.inf:
            near = [to_loop(sketch.scaled(factor * k)) for k in (inside, 2.0 - inside)]
            assert [unstable_roots(k, *point) == 0 for k in near] == [True, False]
    # Gain and phase are met where they are said to be taken.
    if np.isfinite(found.gain_omega):
        value = complex(loop.open_loop(1j * found.gain_omega, *point))
        assert found.gain_upper * value == pytest.approx(-1.0, rel=1e-6)
    if np.isfinite(found.phase_omega):
        value = complex(loop.open_loop(1j * found.phase_omega, *point))
        assert abs(value) == pytest.approx(1.0, rel=1e-9)
        assert abs(np.angle(-value)) == pytest.approx(found.phase, abs=1e-9)


def test_the_limit_of_the_chain_limits_the_gain():
    # |L| tends to 0.4 + 0.2 (0.9 + 1), and is there at no frequency.
    loop, point = STABLE["neutral, dual arm"]
    found = margins(loop, *point)
    assert found.gain_upper == pytest.approx(1.0 / 0.78, rel=1e-12)
    assert found.gain_omega == np.inf


def test_the_factors_of_a_loop_show_where_it_is_real():
    """This is looked at where rounding hides the sign of Im L in sums of exponentials."""
    loop, (c1, c2) = STABLE["oscillator"]
    omega = margins(loop, c1, c2).gain_omega
    stretch = omega + 1e-6 * np.array([[-2.0], [0.5], [1.0]])
    assert gains._real_within(LoopAt(loop, c1, c2), stretch) == pytest.approx(
        [omega], rel=1e-12
    )


@pytest.mark.parametrize("direction", [(0, -1), (1, 0), (0, 1), (-1, 0), (1, -1)])
def test_the_modulus_margin_vanishes_where_the_loop_breaks(direction):
    """A root next to the axis makes a dip of |1 + L| that hides between samples."""
    loop = paper_loop()
    eps = critical_perturbation(loop, direction)
    margin = [
        modulus_margin(loop, *(1.0 + eps * (1.0 - gap) * np.array(direction)))
        for gap in (1e-4, 1e-5)
    ]
    assert margin[1] < 0.05
    assert margin[1] == pytest.approx(0.1 * margin[0], rel=0.01)


# ---------------------------------------------------------- the first perturbation that breaks
def exact(loop, direction, omega, eps):
    """Frequency and eps at which j omega is a root of 1 + L, with forty digits."""

    def parts(w, e):
        point = (1 + e * mpmath.mpf(float(d)) for d in direction)
        value = independent.exact(loop, mpmath.mpc(0, w), *point)
        return value.real, value.imag

    with mpmath.workdps(40):
        return map(float, mpmath.findroot(parts, (omega, eps), tol=1e-24))


@pytest.mark.parametrize("angle", np.pi * (np.arange(12) / 6.0 + 0.05))
def test_critical_perturbation_to_nine_digits(angle):
    """Stable on the way, and there a root on the axis."""
    loop, direction = paper_loop(), np.array([np.cos(angle), np.sin(angle)])
    eps = critical_perturbation(loop, direction)
    tries = np.append(np.geomspace(1e-8, eps, 60)[:-1], eps * (1.0 - 2e-7))
    assert (unstable_roots(loop, *(1.0 + tries * direction[:, None])) == 0).all()
    omega = np.concatenate(
        (np.geomspace(1e-7, 60.0, 200_001), 62.831853072 + np.linspace(-1e-8, 1e-8, 20_001))
    )
    away = np.abs(1.0 + loop.open_loop(1j * omega, *(1.0 + eps * direction)))
    near = float(omega[np.argmin(away)])
    where, truth = exact(loop, direction, near, eps)
    assert where == pytest.approx(near, rel=1e-3)
    assert eps == pytest.approx(truth, rel=1e-9)


@pytest.mark.parametrize(
    ("loop", "direction"),
    [
        (SingleArm(), (-1.0, 0.0)),
        (SingleArm(gain=3.0, tau=2.0), (-2.0, 5.0)),
        (CommonArm(), (-1.0, 0.3)),
        (CommonArm(), (-1.0, -1.0)),
        (CommonArm(gain=0.1), (-0.2, -1.0)),
        (DualArm(), (0.0, 1.0)),
        (DualArm(), (-1.0, 0.2)),
        (DualArm(gain=0.5), (1.0, 1.1)),
    ],
)
def test_critical_perturbation_from_the_boundary_inwards(loop, direction):
    assert unstable_roots(loop, 1.0, 1.0) == BOUNDARY
    eps = critical_perturbation(loop, direction)
    shares = [*np.geomspace(1e-5, 0.99, 20), 1.0 - 1e-9, 1.0 + 1e-9]
    counts = unstable_roots(loop, *(1.0 + eps * np.outer(direction, shares)))
    assert (counts[:-1] == 0).all()
    assert counts[-1] > 0


@pytest.mark.parametrize(
    ("loop", "direction"),
    [
        (SingleArm(), (1.0, 0.0)),
        (CommonArm(), (1.0, 0.0)),
        (CommonArm(), (1.0, -0.5)),
        (DualArm(), (0.0, -1.0)),
        # Out of its way along the boundary by a rounding of the direction.
        (CommonArm(), (1.0, np.nextafter(-1.0, 0.0))),
    ],
)
def test_nothing_is_left_where_the_direction_leads_out(loop, direction):
    assert critical_perturbation(loop, direction) == 0.0


@pytest.mark.parametrize("size", [1.0, 0.3])
def test_along_the_line_on_which_the_root_at_zero_cancels_another_root_is_first(size):
    # No pair comes to the axis of a common arm with equal arms: only c1 + c2 acts.
    assert critical_perturbation(CommonArm(1.0, 20.0, 20.0), (size, -size)) == np.inf
    for loop, direction in ((CommonArm(), (size, -size)), (DualArm(), (size, size))):
        eps = critical_perturbation(loop, direction)
        found = [
            loop_count(loop, *(1 + Fraction(share * eps) * Fraction(d) for d in direction))
            for share in (1e-6, 0.5, 1.0 - 1e-9, 1.0 + 1e-9)
        ]
        assert found == [0, 0, 0, 2]


@pytest.mark.parametrize(
    "loop", [SingleArm(), SingleArm(0.5, 3.0, 0.7), CommonArm(), CommonArm(0.05), DualArm()]
)
def test_the_ideal_point_has_the_margins_that_its_neighbours_tend_to(loop):
    # Next to it, inside, a slow real root leaves all as it is at higher frequency.
    ideal, near = margins(loop), margins(loop, 1.0 - 2e-9, 1.0 - 1e-9)
    for name in ("gain_upper", "phase", "delay", "modulus", "disk", "modulus_omega"):
        assert getattr(ideal, name) == pytest.approx(getattr(near, name), rel=1e-5), name


def test_a_gain_that_takes_a_real_root_to_zero_is_that_of_the_finite_open_loop():
    # L(0) = -gain tau with a positive feedback: s = 0 is met where that is -1.
    loop = Loop(((), (0.0,), -0.02), SINGLE, 20.0, 20.0)
    assert gain_interval(loop, 1.0, 1.0) == (0.0, 2.5, 0.0)


@pytest.mark.parametrize("loop", [SingleArm(50.0, 10.0, 0.05), DualArm(gain=10.0, delay=1.0)])
def test_roots_behind_the_one_at_zero_are_not_passed_over(loop):
    assert unstable_roots(loop, 1.0, 1.0) == BOUNDARY
    with pytest.raises(ValueError, match=r"must be stable at .* but loop_count gives \d"):
        margins(loop)
    with pytest.raises(ValueError, match=r"to lose stability, but loop_count gives \d"):
        critical_perturbation(loop, (-1.0, -1.0))


@pytest.mark.parametrize(
    ("mapping", "gain", "direction"),
    [
        (SINGLE, 0.3, (0.0, 1.0)),  # an arm that the sensor does not see
        (COMMON, 1e-12, (1.0, 0.0)),  # not within parameters of a billion
    ],
)
def test_what_never_breaks_is_said_not_to(mapping, gain, direction):
    loop = Loop(((), (-1.0,), gain), mapping, 20.0, 19.0)
    assert critical_perturbation(loop, direction) == np.inf


def test_the_length_of_the_direction_scales_the_result():
    expected = critical_perturbation(paper_loop(), (0.5, -1.0))
    for size in (1e-8, 10.0, 1e8):
        found = critical_perturbation(paper_loop(), (0.5 * size, -size))
        assert found == pytest.approx(expected / size, rel=1e-9)


@pytest.mark.parametrize("direction", [(0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, -1.0)])
def test_a_dead_time_far_below_the_crossing_period_changes_little(direction):
    """With it the chain ends at 1e5 rad/s only; these crossings lie below 30 rad/s."""
    plain = critical_perturbation(flight_loop(), direction)
    found = critical_perturbation(flight_loop(delay=1e-6), direction)
    assert found != plain
    assert found == pytest.approx(plain, rel=1e-7)


def test_counts_contradict_gains_between_which_the_loop_is_not_stable():
    """As they do where rounding hides a crossing."""
    point = LoopAt(paper_loop(), 1.0, 1.0)
    lower, upper, _ = gains.gain_interval(*point)
    gains._require_stable_inside(point, lower, upper)
    for low, high in ((0.99 * lower, upper), (lower, 1.01 * upper)):
        with pytest.raises(CountError, match="rounding hides a crossing"):
            gains._require_stable_inside(point, low, high)


@pytest.mark.parametrize("name", STABLE)
@pytest.mark.parametrize("direction", [(1.0, 0.3), (-1.0, 0.7), (0.4, -1.0)])
def test_free_phases_pass_over_no_first_crossing(name, direction):
    """As a plain characteristic function a loop is walked without them."""
    loop, point = STABLE[name]
    found, expected = (
        first_crossing(system, point, direction, 5.0) for system in (loop, loop.plain())
    )
    assert found == pytest.approx(expected, rel=1e-9, nan_ok=True)


def test_what_l_fills_may_have_one_on_its_edge():
    # L = 4 - 4 c exp(-2 s) is nearest to -1 at 4 - 4 c, and comes to 1 for c = 0.75 only.
    constant = Loop(((), (), 4.0), SINGLE, 2.0, 1.5)
    for c1, nearest, phase, place in ((0.75, 2.0, np.pi, np.inf), (0.5, 3.0, np.inf, np.nan)):
        found = margins(constant, c1)
        assert found.modulus == pytest.approx(nearest, rel=1e-12)
        assert (found.disk, found.phase, found.delay) == (2.0, phase, 0.0)
        np.testing.assert_equal(found.phase_omega, place)
    # L falls from 2 to 1, where |1 - L| vanishes.
    lag = Loop(((-2.0,), (-1.0,), 1.0), SINGLE, 2.0, 1.5)
    assert margins(lag, 0.0).modulus == pytest.approx(2.0, rel=1e-6)
    assert margins(lag, 0.0).disk == 2.0


def test_gain_factors_past_a_million_are_not_told():
    # A real root would cross at 1e11, but a pair has done so at some 4e7.
    weak = Loop(((), (-1.0, -1.0, -1.0), 1e-7), SINGLE, 2.0, 1.5)
    assert gain_interval(weak, 1.0001, 1.0)[:2] == (0.0, np.inf)


@pytest.mark.parametrize("lowest", [0.5, 1.0])
def test_free_phases_do_not_step_over_a_root_on_the_axis(lowest):
    notch = ((1j, -1j), (-0.25 + 0.97j, -0.25 - 0.97j, -1.0, -1.0), 0.9)
    loop = Loop(notch, SINGLE, 2.0, 1.5)
    with pytest.raises(CountError, match="a root on the imaginary axis"):
        margins(loop, 0.1, 0.0, free_above=lowest)
    assert margins(loop, 0.1, 0.0, free_above=1.5).modulus > 0.0


def test_an_unstable_loop_has_no_margins_and_nothing_to_lose():
    loop = Loop(((), (0.5, -1.0), 0.1), SINGLE, 2.0, 1.5)
    with pytest.raises(ValueError, match="must be stable at"):
        margins(loop)
    with pytest.raises(ValueError, match=r"^the loop must be stable at .* = \(1, 1\) to lose"):
        critical_perturbation(loop, (1.0, 0.0))


def test_an_unconfined_chain_has_no_margin():
    with pytest.raises(CountError, match="not confined to the left half-plane"):
        modulus_margin(Loop(((), (), 5.0), SINGLE, 2.0, 1.5), 1.3, 1.0)


@pytest.mark.parametrize("gain", [1e-5, 1e-7, 1e-8])
def test_a_weak_loop_breaks_far_away(gain):
    # s + 1 + k (1 - c1 e1) has the real root 0 where k c1 = 1 + k.
    for mapping, tau2 in ((SINGLE, 20.0), (COMMON, 19.0)):
        loop = Loop(((), (-1.0,), gain), mapping, 20.0, tau2)
        assert critical_perturbation(loop, (1.0, 0.0)) == pytest.approx(1.0 / gain, rel=1e-9)


def test_roots_that_cross_just_below_the_limit_of_the_chain_come_first():
    loop = paper_loop(0.19514549562262062 / 0.16687092308813156, 14.207314169676076, 14.04)
    for direction in [(0.2, 1.04), (1.0, 1.0), (0.3, 1.0)]:
        eps = critical_perturbation(loop, direction)
        tries = eps * (1.0 - np.array([1e-5, 1e-6, 3e-7]))
        counts = unstable_roots(loop, 1.0 + tries * direction[0], 1.0 + tries * direction[1])
        assert (counts <= 0).all()
        assert counts[0] == 0


@pytest.mark.parametrize("lowest", [1e-2, 1.0])
def test_free_phases_of_a_common_arm_have_margins_in_closed_form(lowest):
    # L fills a disc around -j a of radius c a, with a = 2 gain / omega: it comes closest to -1
    # at a = c / sqrt(1 - c^2), and its share of the unit circle at a = 1 / sqrt(1 - c^2).
    c = 0.999
    nearest = np.sqrt(1.0 - c * c)
    loop = Loop(((), (0.0,), np.pi * 14.7e3), COMMON, 33.6, 33.1)
    found = margins(loop, c, c, lowest)
    assert found.modulus == pytest.approx(nearest, rel=1e-5)
    assert found.phase == pytest.approx(np.arcsin(nearest), rel=1e-5)
    assert found.modulus_omega == pytest.approx(2.0 * np.pi * 14.7e3 * nearest / c, rel=1e-2)
    assert np.isnan([found.gain_lower, found.gain_upper, found.gain_omega]).all()


def test_a_dead_time_with_free_phases_takes_the_phase_it_should():
    # With c = 0 the disc is the point K exp(-s delay): phase and delay margin are textbook's.
    loop = Loop(((), (0.0,), 3.0), SINGLE, 2.0, 1.0, delay=0.1)
    found = margins(loop, 0.0, 0.0, 0.01)
    assert found.phase == pytest.approx(0.5 * np.pi - 0.3, rel=1e-5)
    assert found.delay == pytest.approx((0.5 * np.pi - 0.3) / 3.0, rel=1e-5)


def test_arms_of_equal_delay_have_free_phases_of_their_own():
    loop = Loop(((), (-60.0 + 60j, -60.0 - 60j), 1000.0), COMMON, 2.0, 2.0)
    # The smallest distance lies past twenty times this frequency.
    c1, c2, above = 0.7, -0.9, 4.2
    omega = np.geomspace(above, 1e4, 200_001)
    first, second = loop.arm_responses(1j * omega)
    away = np.abs(1.0 + first + second) - np.abs(c1 * first) - np.abs(c2 * second)
    found = margins(loop, c1, c2, above)
    assert found.modulus == pytest.approx(away.min(), rel=1e-4)
    assert found.modulus_omega == pytest.approx(omega[away.argmin()], rel=1e-3)


@pytest.mark.parametrize(("gain", "damping"), [(1e-3, 1e-2), (1e-3, 1e-3), (1e-2, 1e-2)])
def test_free_phases_of_a_difference_fill_a_disc_around_zero(gain, damping):
    """Of radius 2 |K|. At a resonance it may hold -1: the walk comes there in few steps."""
    resonant = Controller([-1.0], [complex(-damping, 6.3), complex(-damping, -6.3)], gain)
    found = margins(Loop(resonant, DIFFERENCE, 2.8, 2.2), free_above=0.3)
    largest = 2.0 * np.abs(resonant(1j * np.linspace(6.2, 6.4, 200_001))).max()
    assert found.modulus == pytest.approx(max(1.0 - largest, 0.0), rel=1e-5)


@pytest.mark.parametrize("factor", [0.3, 1.0, 3.0, 30.0])
def test_a_count_up_to_free_phases_is_that_of_all_frequencies(factor):
    """Above it no phases let a root cross, so that what lies below decides."""
    found = []
    for loop, (c1, c2) in STABLE.values():
        changed = to_loop(sketch_of(loop).scaled(factor))
        for omega in np.geomspace(1e-2, 1e2, 9):
            point = LoopAt(changed, c1, c2)
            if free_phases.clear_above(point, omega):
                expected = int(unstable_roots(changed, c1, c2))
                assert free_phases._count_below(point, omega) == expected
                found.append(expected)
    assert len(found) > 10
    assert factor < 30.0 or max(found) > 0
