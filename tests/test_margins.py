"""Margins and the first perturbation that breaks a loop, against counts and brute force."""

from __future__ import annotations

import sys

import mpmath
import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    UNCONFINED,
    CommonArm,
    Controller,
    CountError,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    critical_perturbation,
    margins,
    modulus_margin,
    paper_loop,
    unstable_roots,
)
from armlock.margins import gain_interval
from armlock.sensors import COMMON, DIFFERENCE, SINGLE
from tests import independent

E = 1e-6
STABLE = {
    "single arm": (SingleArm(), (0.999, 1.0)),
    "single arm, negative": (SingleArm(0.05, 20.1), (-1.5, 1.0)),
    "common arm": (CommonArm(), (1.0, 0.999)),
    "dual arm": (DualArm(), (1.0, 1.005)),
    "dual arm, low gain": (DualArm(gain=0.3), (1.01, 1.02)),
    "controlled": (paper_loop(), (1.0, 1.0)),
    "controlled, corner of the box": (paper_loop(), (1.0 + E, 1.0 - E)),
    "controlled, above": (paper_loop(), (1.0, 1.0 + 1e-4)),
    "oscillator": (Loop(((), (-0.1 + 1j, -0.1 - 1j), 0.9), SINGLE, 2.0, 1.5), (0.5, 1.0)),
    "resonance": (Loop(((-1,), (-1e-6 + 3j, -1e-6 - 3j), 1e-7), SINGLE, 2, 1.5), (0.9, 1.0)),
    "weak": (Loop(((), (-1.0,), 1e-3), SINGLE, 2.0, 1.5), (0.9, 1.0)),
    "unstable pole": (Loop(((-2.0,), (0.2, -3.0), 1.5), COMMON, 0.3, 0.2), (0.1, 0.2)),
    "dead time": (Loop(((), (0.0,), 3.0), COMMON, 20.1, 19.9, delay=0.03), (1.0, 0.999)),
    "neutral": (Loop(((-3.0,), (-1.0,), 0.2), COMMON, 2.0, 1.5), (0.9, 1.0)),
    "neutral, opposed": (Loop(((-3.0,), (-1.0,), 0.2), DIFFERENCE, 2.0, 1.5), (0.9, 1.0)),
}


def scaled(loop, factor):
    k = loop.controller
    changed = Controller(k.zeros, k.poles, k.gain * factor)
    return Loop(changed, loop.mapping, loop.tau1, loop.tau2, delay=loop.delay)


def dense(loop, c1, c2, end):
    """|1 + L| and 2 |1 + L| / |1 - L| over many frequencies, and the frequencies."""
    omega = np.concatenate((np.geomspace(1e-9, end, 400_000), np.linspace(1e-4, end, 600_000)))
    omega = np.concatenate((omega, 3.0 + np.linspace(-2e-5, 2e-5, 100_001)))
    response = loop.open_loop(1j * omega, c1, c2)
    away = np.abs(1.0 + response)
    return omega, away, 2.0 * away / np.abs(1.0 - response)


@pytest.mark.parametrize("name", STABLE)
def test_modulus_and_disk_margin_against_brute_force(name):
    loop, (c1, c2) = STABLE[name]
    found = margins(loop, c1, c2)
    _, away, disk = dense(loop, c1, c2, 40.0 if loop.longest_delay > 5.0 else 200.0)
    # Brute force can only be above; its spacing keeps it close.
    assert found.modulus <= away.min() * (1.0 + 1e-9)
    assert found.disk <= disk.min() * (1.0 + 1e-9)
    if not loop.neutral:
        # A neutral loop's limit is taken over small changes of the delays as well.
        assert found.modulus == pytest.approx(away.min(), rel=1e-3)
        assert found.disk == pytest.approx(disk.min(), rel=1e-3)
        if np.isfinite(found.modulus_omega):
            there = abs(1.0 + loop.open_loop(1j * found.modulus_omega, c1, c2))
            assert there == pytest.approx(found.modulus, rel=1e-9)
    assert modulus_margin(loop, c1, c2) == pytest.approx(found.modulus, rel=1e-9)


def test_the_limit_of_a_neutral_loop_is_that_of_its_chain():
    # Without dynamics, L = 0.3 (1 - c u): nearest to -1 where u = 1.
    loop = Loop(((), (), 0.3), SINGLE, 2.0, 1.5)
    assert modulus_margin(loop, 1.5) == pytest.approx(1.3 - 0.45, rel=1e-9)
    ratio = margins(loop, 1.5).disk
    assert ratio == pytest.approx(2.0 * 0.85 / 1.15, rel=1e-6)
    # With both arms and 2 g > 1 the disc around 2 g, of radius 2 g c, meets the unit circle.
    centre, radius = 1.8, 1.8 * 0.99
    found = margins(Loop(((), (), 0.9), COMMON, 2.2, 9.9), 0.99, 0.99)
    meets = np.arccos((1.0 + centre**2 - radius**2) / (2.0 * centre))
    assert found.phase == pytest.approx(np.pi - meets, rel=1e-6)
    assert found.delay == 0.0


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


@pytest.mark.parametrize("name", STABLE)
def test_gain_margins_hold_on_both_sides(name):
    loop, (c1, c2) = STABLE[name]
    found = margins(loop, c1, c2)
    assert 0.0 <= found.gain_lower < 1.0 < found.gain_upper
    for factor, inside in ((found.gain_lower, 1.0 + E), (found.gain_upper, 1.0 - E)):
        if 0.0 < factor < np.inf:
            assert unstable_roots(scaled(loop, factor * inside), c1, c2) == 0
            assert unstable_roots(scaled(loop, factor * (2.0 - inside)), c1, c2) != 0
    # Nothing in between breaks the loop.
    low = max(found.gain_lower, 1e-3) * (1.0 + E)
    high = min(found.gain_upper, 1e2) * (1.0 - E)
    for factor in np.geomspace(low, high, 25):
        assert unstable_roots(scaled(loop, factor), c1, c2) == 0


@pytest.mark.parametrize(
    "name", ["single arm", "common arm", "dual arm", "controlled", "controlled, above"]
)
def test_phase_margin_is_the_angle_to_minus_one_at_unit_gain(name):
    loop, (c1, c2) = STABLE[name]
    found = margins(loop, c1, c2)
    value = complex(loop.open_loop(1j * found.phase_omega, c1, c2))
    assert abs(value) == pytest.approx(1.0, rel=1e-9)
    assert abs(abs(np.angle(-value)) - found.phase) < 1e-9
    omega = np.geomspace(1e-9, 40.0, 2_000_001)
    response = loop.open_loop(1j * omega, c1, c2)
    size = np.abs(response)
    crossing = np.flatnonzero((size[1:] - 1.0) * (size[:-1] - 1.0) < 0.0)
    angles = np.abs(np.angle(-response[crossing]))
    assert found.phase == pytest.approx(angles.min(), abs=2e-3)


@pytest.mark.parametrize(
    "name", ["single arm", "common arm", "dual arm, low gain", "oscillator"]
)
def test_delay_margin_by_adding_the_delay(name):
    """With a delay d in L the count at s = j omega: sampled contour, refined by halving."""
    loop, (c1, c2) = STABLE[name]
    found = margins(loop, c1, c2)

    def count(extra):
        radius = 60.0 * max(1.0, abs(loop.controller.gain))

        def value(s):
            above = loop.open_loop(s, c1, c2) * np.exp(-s * extra)
            return np.polyval(loop.rest[::-1], s) * (1.0 + above)

        up = np.concatenate((np.geomspace(1e-7, 1e-3, 200), np.linspace(1e-3, radius, 4000)))
        side = np.linspace(0.0, 1.0, 400)
        s = np.concatenate(
            (1j * up, radius * (1j + side[1:]), radius * (1.0 + 1j * (1.0 - side[1:])))
        )
        d = value(s)
        for _ in range(60):
            turn = np.angle(d[1:] / d[:-1])
            wide = np.flatnonzero(np.abs(turn) > 0.5)
            if wide.size == 0:
                break
            middle = 0.5 * (s[wide] + s[wide + 1])
            s, d = np.insert(s, wide + 1, middle), np.insert(d, wide + 1, value(middle))
        return round(-turn.sum() / np.pi)

    assert np.isfinite(found.delay)
    assert count(0.0) == 0
    assert count(found.delay * (1.0 - 1e-3)) == 0
    assert count(found.delay * (1.0 + 1e-3)) >= 1


def test_roots_cross_before_the_limit_of_the_chain():
    """The gain margin of the controlled loop above (1, 1), where a root comes first."""
    loop, point = paper_loop(), (1.0, 1.0 + 1e-4)
    found = margins(loop, *point)
    chain = 1.0 / (5000.0 * 1e-4)
    assert found.gain_upper < 0.999 * chain
    assert unstable_roots(scaled(loop, 0.999 * chain), *point) > 0


def test_a_real_root_bounds_the_gain_from_below():
    """An unstable pole needs gain: the root crosses at s = 0."""
    loop, (c1, c2) = STABLE["unstable pole"]
    at_zero = float(loop.open_loop(0.0, c1, c2).real)
    assert margins(loop, c1, c2).gain_lower == pytest.approx(-1.0 / at_zero, rel=1e-12)


@pytest.mark.parametrize("delay", [1e-1, 1e-3, 1e-5])
def test_any_delay_breaks_the_controlled_loop(delay):
    """Its chain 1 + k exp(-s d) (2 - c1 e1 - c2 e2) has roots in the right half-plane.

    With k = 5000 the bracket is below 1 / k in size almost nowhere, so there is a root near
    s = (log k |bracket| + j pi (2 n + 1)) / d: found by Newton from there, for the whole
    loop, at a frequency past its dynamics.
    """
    loop = paper_loop()
    assert margins(loop).delay == 0.0
    start = int(2000.0 * delay / (2.0 * np.pi)) + 1
    found = []
    for n in range(start, start + 20):
        s = complex(np.log(5000.0), np.pi * (2 * n + 1)) / delay

        def value(z):
            return 1.0 + complex(loop.open_loop(z)) * np.exp(-z * delay)

        for _ in range(80):
            step = 1e-6 * abs(s)
            slope = (value(s + step) - value(s - step)) / (2.0 * step)
            move = value(s) / slope
            s -= move
            if abs(move) < 1e-10 * abs(s):
                break
        if abs(value(s)) < 1e-6:
            found.append(s.real)
    assert max(found) > 0.0


def test_a_weak_neutral_loop_stands_some_delay():
    loop, (c1, c2) = STABLE["neutral"]
    assert margins(loop, c1, c2).delay > 0.0


# ---------------------------------------------------------- the first perturbation that breaks
DIRECTIONS = [(np.cos(angle), np.sin(angle)) for angle in np.pi * (np.arange(12) / 6.0 + 0.05)]


def edges(loop, direction, start, stop):
    """Last stable and first unstable distance from (1, 1), by bisection on counts alone.

    In between, counts report boundary points: roots nearer to the axis than rounding.
    """

    def count(eps):
        return int(unstable_roots(loop, 1.0 + eps * direction[0], 1.0 + eps * direction[1]))

    assert count(start) == 0
    assert count(stop) not in (0, BOUNDARY)
    found = []
    for stays in ((0,), (0, BOUNDARY)):
        low, high = start, stop
        while high / low > 1.0 + 1e-10:
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if count(middle) in stays else (low, middle)
        found.append(float(np.sqrt(low * high)))
    return found


def exact(loop, direction, omega, eps):
    """Frequency and eps at which j omega is a root of 1 + L, with forty digits."""
    with mpmath.workdps(40):
        k, m = loop.controller, loop.mapping
        d1, d2 = (mpmath.mpf(float(d)) for d in direction)

        def value(w, e):
            s = mpmath.mpc(0, w)
            whole = mpmath.mpf(k.gain)
            for zero in k.zeros:
                whole *= s - mpmath.mpc(zero)
            for pole in k.poles:
                whole /= s - mpmath.mpc(pole)
            n1, n2, below = (
                sum(mpmath.mpf(c) * s**i for i, c in enumerate(p))
                for p in (m.numerator1, m.numerator2, m.denominator)
            )
            arm1 = 1 - (1 + e * d1) * mpmath.exp(-s * mpmath.mpf(loop.tau1))
            arm2 = 1 - (1 + e * d2) * mpmath.exp(-s * mpmath.mpf(loop.tau2))
            return 1 + whole * (n1 * arm1 + n2 * arm2) / below

        def parts(w, e):
            z = value(w, e)
            return [mpmath.re(z), mpmath.im(z)]

        found = mpmath.findroot(parts, (mpmath.mpf(omega), mpmath.mpf(eps)), tol=1e-24)
        return float(found[0]), float(found[1])


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_critical_perturbation_against_bisection(direction):
    loop = paper_loop()
    eps = critical_perturbation(loop, direction)
    tries = np.geomspace(1e-8, eps, 60)[:-1]
    scan = unstable_roots(loop, 1.0 + tries * direction[0], 1.0 + tries * direction[1])
    assert (scan == 0).all()
    stable, unstable = edges(loop, direction, 0.9 * eps, 1.1 * eps)
    assert stable * (1.0 - 1e-9) <= eps <= unstable * (1.0 + 1e-9)
    assert unstable / stable - 1.0 < 2e-7
    # Where the counts are not as sharp, forty digits are.
    point = 1.0 + eps * np.array(direction)
    omega = np.concatenate(
        (np.geomspace(1e-7, 60.0, 200_001), 62.831853072 + np.linspace(-1e-8, 1e-8, 20_001))
    )
    near = float(omega[np.argmin(np.abs(1.0 + loop.open_loop(1j * omega, *point)))])
    where, truth = exact(loop, direction, near, eps)
    assert abs(where / near - 1.0) < 1e-3
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
    assert 0.0 < eps < np.inf
    stable, unstable = edges(loop, direction, 0.99 * eps, 1.01 * eps)
    assert stable == pytest.approx(eps, rel=1e-9)
    assert unstable == pytest.approx(eps, rel=1e-9)


@pytest.mark.parametrize(
    ("loop", "direction"),
    [
        (SingleArm(), (1.0, 0.0)),
        (CommonArm(), (1.0, 0.0)),
        (CommonArm(), (1.0, -0.5)),
        (DualArm(), (0.0, -1.0)),
        (DualArm(), (1.0, 1.0)),
    ],
)
def test_nothing_is_left_where_the_direction_leads_out_or_along(loop, direction):
    assert critical_perturbation(loop, direction) == 0.0


def test_the_direction_is_taken_as_given():
    one, ten = (critical_perturbation(paper_loop(), (0.0, -k)) for k in (1.0, 10.0))
    assert one == pytest.approx(10.0 * ten, rel=1e-12)


def test_a_direction_that_does_nothing_never_breaks_the_loop():
    loop = Loop(((), (-1.0,), 0.3), SINGLE, 2.0, 1.5)
    assert critical_perturbation(loop, (0.0, 1.0)) == np.inf


@pytest.mark.parametrize(
    ("direction", "error", "message"),
    [
        ((0.0, 0.0), ValueError, r"direction must not have length zero, got \(0, 0\)"),
        ((1.0,), ValueError, "direction must hold two numbers, got 1"),
        ((1.0, 2.0, 3.0), ValueError, "direction must hold two numbers, got 3"),
        ((np.nan, 1.0), ValueError, "direction must be finite"),
        ((1j, 1.0), TypeError, "direction must hold real numbers"),
        ("up", TypeError, "direction must hold real numbers"),
    ],
)
def test_directions_that_are_none(direction, error, message):
    with pytest.raises(error, match=message):
        critical_perturbation(paper_loop(), direction)


def test_an_unstable_loop_has_no_margins_and_nothing_to_lose():
    loop = Loop(((), (0.5, -1.0), 0.1), SINGLE, 2.0, 1.5)
    assert independent.rectangle_count(loop, 1.0, 1.0) == unstable_roots(loop, 1.0, 1.0) == 1
    with pytest.raises(ValueError, match="must be stable at"):
        margins(loop)
    with pytest.raises(ValueError, match=r"^start must be stable to lose stability"):
        critical_perturbation(loop, (1.0, 0.0))


def test_an_unconfined_chain_has_no_margin():
    with pytest.raises(CountError, match="not confined to the left half-plane"):
        modulus_margin(Loop(((), (), 5.0), SINGLE, 2.0, 1.5), 1.3, 1.0)


@pytest.mark.parametrize("gain", [1e-5, 1e-7, 1e-8])
def test_a_weak_loop_breaks_far_away(gain):
    # s + 1 + k (1 - c1 e1) has the real root 0 where k c1 = 1 + k.
    one = Loop(((), (-1.0,), gain), SINGLE, 20.0, 20.0)
    assert critical_perturbation(one, (1.0, 0.0)) == pytest.approx(1.0 / gain, rel=1e-9)
    both = Loop(((), (-1.0,), gain), COMMON, 20.0, 19.0)
    eps = critical_perturbation(both, (1.0, 0.0))
    assert eps == pytest.approx(1.0 / gain, rel=1e-9)
    assert unstable_roots(both, 1.0 + 0.999 * eps, 1.0) == 0
    assert unstable_roots(both, 1.0 + 1.001 * eps, 1.0) > 0


def test_the_length_of_the_direction_scales_the_result():
    expected = critical_perturbation(paper_loop(), (0.5, -1.0))
    for size in (1e-8, 1e8):
        found = critical_perturbation(paper_loop(), (0.5 * size, -size))
        assert found == pytest.approx(expected / size, rel=1e-9)


def test_what_does_not_break_within_parameters_of_a_billion_is_said_not_to():
    loop = Loop(((), (-1.0,), 1e-12), COMMON, 20.0, 19.0)
    assert critical_perturbation(loop, (1.0, 0.0)) == np.inf


def test_opposite_perturbations_of_equal_delays_cancel():
    loop = Loop(((), (-1.0,), 0.3), COMMON, 20.0, 20.0)
    assert critical_perturbation(loop, (1.0, -1.0)) == np.inf
    # On the boundary from the start, and along it.
    assert critical_perturbation(CommonArm(1.0, 20.0, 20.0), (1.0, -1.0)) == 0.0


def test_roots_that_cross_just_below_the_limit_of_the_chain_come_first():
    loop = paper_loop(0.19514549562262062 / 0.16687092308813156, 14.207314169676076, 14.04)
    for direction in [(0.2, 1.04), (1.0, 1.0), (0.3, 1.0)]:
        eps = critical_perturbation(loop, direction)
        tries = eps * (1.0 - np.array([1e-5, 1e-6, 3e-7]))
        counts = unstable_roots(loop, 1.0 + tries * direction[0], 1.0 + tries * direction[1])
        assert (counts <= 0).all()
        assert counts[0] == 0


def test_a_negative_gain_has_the_limit_of_its_chain():
    """1 - 0.2 k (2 - u - v) with |u|, |v| <= 1 vanishes first at k = 1 / 0.8."""
    loop = Loop(Controller([], [], -0.2), COMMON, 20.1, 19.9)
    lower, upper, omega = gain_interval(loop, 1.0, 1.0)
    assert upper == pytest.approx(1.25, rel=1e-12)
    assert (lower, omega) == (0.0, np.inf)
    assert unstable_roots(scaled(loop, 1.2499), 1.0, 1.0) == 0
    assert unstable_roots(scaled(loop, 1.2501), 1.0, 1.0) == UNCONFINED


def test_a_large_negative_gain_is_bounded_from_below():
    """1 - 5 k (2 - 0.1 u - 0.1 v) has no zero where 9 k > 1, and has some just below."""
    loop = Loop(Controller([], [], -5.0), COMMON, 20.1, 19.9)
    lower, upper, _ = gain_interval(loop, 0.1, 0.1)
    assert lower == pytest.approx(1.0 / 9.0, rel=1e-12)
    assert upper == np.inf
    for factor, expected in ((0.112, 0), (1.0, 0), (100.0, 0), (0.11, UNCONFINED)):
        assert unstable_roots(scaled(loop, factor), 0.1, 0.1) == expected


@pytest.mark.parametrize("wrong", [HayesEquation(), "loop", None, CommonArm, paper_loop, 3.0])
@pytest.mark.parametrize(
    "function",
    [
        margins,
        modulus_margin,
        lambda loop: critical_perturbation(loop, (1.0, 0.0)),
        lambda loop: gain_interval(loop, 1.0, 1.0),
    ],
)
def test_what_is_no_loop_has_no_margins(function, wrong):
    with pytest.raises(TypeError, match=r"^loop must be a Loop, for instance CommonArm\(\), "):
        function(wrong)


def test_unity_gain_far_above_the_delays_is_no_reason_to_refuse():
    # Certified by branch and bound on an even grid of 4e7 cells.
    loop = Loop(((), (0.0,), np.pi * 14.7e3), COMMON, 33.6, 33.1)
    assert modulus_margin(loop, 0.999, 0.999) == pytest.approx(0.044711663436, rel=1e-6)


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


@pytest.mark.parametrize("factor", [0.3, 1.0, 3.0, 30.0])
def test_a_count_up_to_free_phases_is_that_of_all_frequencies(factor):
    """Above it no phases let a root cross, so that what lies below decides."""
    module = sys.modules["armlock.margins"]
    found = []
    for loop, (c1, c2) in STABLE.values():
        changed = scaled(loop, factor)
        for omega in np.geomspace(1e-2, 1e2, 9):
            if module._no_phases_cross(changed, c1, c2, omega):
                count = module._count_below(changed, c1, c2, omega)
                assert count == unstable_roots(changed, c1, c2)
                found.append(count)
    assert len(found) > 10
    assert factor < 30.0 or max(found) > 0
