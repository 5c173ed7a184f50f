"""Margins and the first perturbation that breaks a loop, against counts and brute force."""

from __future__ import annotations

import pickle
import re
from typing import Any

import control
import mpmath
import numpy as np
import pytest
from flint import fmpq
from scipy.optimize import brentq

from armlock import (
    BOUNDARY,
    CommonArm,
    Controller,
    CountError,
    DualArm,
    Loop,
    SingleArm,
    System,
    critical_perturbation,
    delay,
    equation,
    margins,
    modulus_margin,
    paper_loop,
    parameter,
    peak_gain,
    s,
    stability_chart,
    unstable_roots,
    varying_radius,
)
from armlock.engine import chain, polynomials
from armlock.engine.decide import count
from armlock.engine.functions import common_zeros
from armlock.engine.polynomials import Polynomial, of_roots
from armlock.robustness import perturbations
from armlock.robustness.margins import gain_limits
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual
from armlock.systems import Delay, Lag
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
        Loop(((-1.0,), (-2.0,), 0.2), dual(3.0, 0.5), 2.0, 1.5, delay=0.1),
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
    # L = 0.3 (1.5 - 1e-8 j / (0.2 omega)) up to far above where it is one.
    "pole that cancels": (Loop(((), (), 0.3), dual(2.5, 0.2), 20.1, 19.9), (0.5, 0.5 + 1e-8)),
    "just below one": (Loop(((), (), 1.0 - 1e-9), SINGLE, 2.0, 1.5), (0.0, 1.0)),
    # L = 4 - 2 exp(-2 s) is nearest to -1 at 2, and never of magnitude one.
    "circle": (Loop(((), (), 4.0), SINGLE, 2.0, 1.5), (0.5, 1.0)),
    # L falls from 2 to 1, where it comes nearest to -1.
    "fall to one": (Loop(((-2.0,), (-1.0,), 1.0), SINGLE, 2.0, 1.5), (0.0, 1.0)),
    # A real root would cross at 1e9, but a pair has done so at some 4e5.
    "triple lag": (Loop(((), (-1.0, -1.0, -1.0), 1e-5), SINGLE, 2.0, 1.5), (1.0001, 1.0)),
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
    assert found.gain_omega == np.inf or name != "neutral, dual arm"
    if np.isfinite(found.gain_omega):
        value = complex(loop(1j * found.gain_omega, *point))
        assert found.gain_upper * value == pytest.approx(-1.0, rel=1e-6)
    if np.isfinite(found.phase_omega):
        value = complex(loop(1j * found.phase_omega, *point))
        assert abs(value) == pytest.approx(1.0, rel=1e-9)
        assert abs(np.angle(-value)) == pytest.approx(found.phase, abs=1e-9)


#: Where the phase of exp(-s) / (s + 1) is pi.
TURN = brentq(lambda w: w + np.arctan(w) - np.pi, 1.0, 3.0, xtol=1e-14)
LAG, RESONANT = control.tf([1], [1, 1]) * delay(1.0), System.of(control.tf([4], [1, 2, 4]))
LATE, TRIPLE = control.tf([1], [1, 0]) * delay(0.5), System.of(control.tf([1], [1, 3, 3, 1]))
LEAD = control.tf([2, 1], [1, 2, 1]) * delay(1.0)
NONE, PROVEN, BOUND = ("phase", "delay"), ("gain_upper",), 1e6
# What turns without end next to the unit circle, and is as good as -1 once in each turn.
ALL_PASS = Loop(Controller([1.0], [-1.0], 1.0 - 1e-9), SINGLE, 1.0, 1.0, delay=0.5)
UNDAMPED = Loop(([-0.5], [1j, -1j], 0.5), SINGLE, 0.1, 0.1, delay=0.1)
# Loop, which margins are infinite, and numbers of others.
KNOWN: list[tuple[Any, tuple[str, ...], dict[str, float]]] = [
    (ALL_PASS.at(c1=0.0), NONE, {"modulus": 1e-9}),
    # A crossing through infinity is none; the numbers are those of a dense sample.
    (UNDAMPED.at(c1=0.0), (), {"gain_upper": 30.6199055, "modulus": 0.898115012}),
    (UNDAMPED.at(c1=0.0), (), {"phase": 1.074094917, "delay": 0.824321425}),
    # s = 0 is met where -gain tau, which is L(0), is -1.
    (Loop(((), (0.0,), -0.02), SINGLE, 20.0, 20.0), (), {"gain_upper": 2.5, "gain_omega": 0.0}),
    # Stable for every gain (Re P is not negative), and what is left of the search is nothing.
    (Loop(([-100.0], [0.0], 1e4), COMMON, 16.6825, 16.6175), PROVEN, {"phase": 1.03125690}),
    (LATE, (), {"gain_upper": np.pi, "phase": np.pi / 2 - 0.5, "delay": np.pi / 2 - 0.5}),
    # A crossover that is only touched at s = 0 is none.
    (LAG, NONE, {"gain_upper": np.hypot(TURN, 1.0), "modulus": 0.5444437}),
    (LEAD, (), {"gain_upper": 1.2944593, "phase": 1.0477053, "delay": 0.7408395}),
    (RESONANT, PROVEN, {"phase": np.pi / 2, "delay": np.pi / 4, "modulus": 0.7546517}),
    # A gain margin is searched for up to a million. (s + 1)^3 + k: k = 8.
    (1e-3 * LAG, NONE, {"gain_upper": 1e3 * np.hypot(TURN, 1.0)}),
    (3e-6 * LAG, NONE, {"gain_upper": np.hypot(TURN, 1.0) / 3e-6}),
    (1e-5 * TRIPLE, NONE, {"gain_upper": 8e5}),
    (1e-9 * TRIPLE, NONE, {"gain_upper": BOUND}),
    (Loop(Controller([], [-1.0], 0.2), dual(2.5, 0.2), 20.1, 19.9), (), {"gain_upper": BOUND}),
    (DualArm(), (), {"gain_upper": BOUND}),
    # It is infinite only if that is proven.
    (SingleArm(), PROVEN, {}),
    (CommonArm(gain=10.0), PROVEN, {}),
    (System.of(control.tf([1], [1, 0.1, 0])), PROVEN, {}),
    (DualArm().at(c1=0.999, c2=1.0), PROVEN, {}),
    (0.5 * (1 - delay(3.0)), PROVEN, {}),
    # The sum of both arms never has a negative real part, and a PI controller lags by less than
    # a quarter of a turn: no gain is too large, although the neutral chain is lost to rounding.
    (Loop(Controller([-0.1], [0.0], 10.0), COMMON, 20.1, 19.9), PROVEN, {}),
    (Loop(Controller([-0.03], [0.0], 100.0), COMMON, 20.1, 19.9), PROVEN, {}),
]


@pytest.mark.parametrize(("loop", "infinite", "numbers"), KNOWN)
def test_margins_that_are_known(loop, infinite, numbers):
    found = margins(loop)
    expected = dict.fromkeys(infinite, np.inf) | numbers
    told = {name: getattr(found, name) for name in expected}
    assert told == pytest.approx(expected, rel=1e-6)
    is_bound = numbers.get("gain_upper") == BOUND
    assert found.gain_upper_is_bound == is_bound == ("to at least 1e+06" in repr(found))


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
    away = np.abs(1.0 + loop(1j * omega, *(1.0 + eps * direction)))
    near = float(omega[np.argmin(away)])
    where, truth = exact(loop, direction, near, eps)
    assert where == pytest.approx(near, rel=1e-3)
    assert eps == pytest.approx(truth, rel=1e-9)


@pytest.mark.parametrize(
    ("loop", "direction"),
    [
        (SingleArm(), (-1.0, 0.0)),
        (SingleArm(gain=3.0, tau1=2.0), (-2.0, 5.0)),
        (CommonArm(), (-1.0, 0.3)),
        (CommonArm(), (-1.0, -1.0)),
        (CommonArm(gain=0.1), (-0.2, -1.0)),
        (DualArm(), (0.0, 1.0)),
        (DualArm(), (-1.0, 0.2)),
        (DualArm(gain=0.5), (1.0, 1.1)),
    ],
)
def test_critical_perturbation_from_the_boundary_inwards(loop, direction):
    assert unstable_roots(equation(1 + loop), 1.0, 1.0) == BOUNDARY
    eps = critical_perturbation(loop, direction)
    shares = [*np.geomspace(1e-5, 0.99, 20), 1.0 - 1e-9, 1.0 + 1e-9]
    counts = unstable_roots(loop, *(1.0 + eps * np.outer(direction, shares)))
    assert (counts[:-1] == 0).all()
    assert counts[-1] > 0


def weak(gain, sensor):
    return Loop(((), (-1.0,), gain), sensor, 20.0, 19.0)


BREAKS = [
    # Out of the stable region at once, the last by a rounding of the direction.
    (SingleArm(), (1.0, 0.0), 0.0),
    (CommonArm(), (1.0, -0.5), 0.0),
    (DualArm(), (0.0, -1.0), 0.0),
    (CommonArm(), (1.0, np.nextafter(-1.0, 0.0)), 0.0),
    # s + 1 + k (1 - c1 e1) has the real root 0 where k c1 = 1 + k.
    (weak(1e-5, COMMON), (1.0, 0.0), 1e5),
    (weak(1e-8, SINGLE), (1.0, 0.0), 1e8),
    (weak(1e-8, COMMON), (1.0, 0.0), 1e8),
    # Not within parameters of a billion; an arm that the sensor does not see.
    (weak(1e-12, COMMON), (1.0, 0.0), np.inf),
    (weak(1e-5, SINGLE), (0.0, 1.0), np.inf),
    # No pair comes to the axis of a common arm with equal arms: only c1 + c2 acts.
    (CommonArm(1.0, 20.0, 20.0), (1.0, -1.0), np.inf),
    # The chain, at 1 / (5000 1e-4).
    (paper_loop(), (1.0, 1.0), 1e-4),
]


@pytest.mark.parametrize(("loop", "direction", "eps"), BREAKS)
def test_critical_perturbation_where_it_is_known(loop, direction, eps):
    assert critical_perturbation(loop, direction) == pytest.approx(eps, rel=1e-9)


def test_a_direction_that_leads_in_by_a_rounding_does_not_lead_out():
    """The root that leaves s = 0 goes left, by 1e-16 rad/s; another root crosses first."""
    inwards, along = (
        critical_perturbation(CommonArm(), (1.0, d2)) for d2 in (np.nextafter(-1.0, -2.0), -1.0)
    )
    assert inwards == pytest.approx(along, rel=1e-9)


@pytest.mark.parametrize("size", [1.0, 0.3])
def test_along_the_line_on_which_the_root_at_zero_cancels_another_root_is_first(size):
    for loop, direction in ((CommonArm(), (size, -size)), (DualArm(), (size, size))):
        eps = critical_perturbation(loop, direction)
        found = []
        for share in (1e-6, 0.5, 1.0 - 1e-9, 1.0 + 1e-9):
            point = [
                1 + polynomials.exact(share * eps) * polynomials.exact(d) for d in direction
            ]
            n, m = loop.affine.quotient(*point)
            found.append(count(n + m, common_zeros(n, m)))
        assert found == [0, 0, 0, 2]


@pytest.mark.parametrize(
    "loop",
    [
        SingleArm(),
        SingleArm(0.5, 3.0).replace(delay=0.7),
        CommonArm(),
        CommonArm(0.05),
        DualArm(),
    ],
)
def test_the_ideal_point_has_the_margins_that_its_neighbours_tend_to(loop):
    # Next to it, inside, a slow real root leaves all as it is at higher frequency.
    ideal, near = margins(loop), margins(loop, 1.0 - 2e-9, 1.0 - 1e-9)
    for name in ("gain_upper", "phase", "delay", "modulus", "modulus_omega"):
        # Near returns of unequally weighted arms limit the gain at the ideal point alone.
        if name != "gain_upper" or loop.mapping.name != "dual":
            assert getattr(ideal, name) == pytest.approx(getattr(near, name), rel=1e-5), name


@pytest.mark.parametrize(
    "loop", [SingleArm(50.0, 10.0).replace(delay=0.05), DualArm(gain=10.0).replace(delay=1.0)]
)
def test_roots_behind_the_one_at_zero_are_not_passed_over(loop):
    assert unstable_roots(equation(1 + loop), 1.0, 1.0) == BOUNDARY
    assert unstable_roots(loop) > 0
    with pytest.raises(ValueError, match=r"must be stable, but it has \d+ unstable roots"):
        margins(loop)
    with pytest.raises(ValueError, match=r"to lose stability, but unstable_roots gives \d"):
        critical_perturbation(loop, (-1.0, -1.0))


def test_a_count_that_contradicts_the_first_break_is_refused(monkeypatch):
    monkeypatch.setattr(perturbations, "first_zero", lambda *_: (4e-6, 1.0))
    with pytest.raises(CountError, match=r"half way there the count is \d+"):
        critical_perturbation(paper_loop(), (1.0, -1.0))


@pytest.mark.parametrize("seed", range(8))
def test_gains_of_nearly_equal_arms_at_a_resonance_are_those_of_one_delay(seed):
    """The difference of equal arms is L = K (c1 - c2) exp(-s tau): its phase only descends.

    Where it is an odd number of half turns, L is real and negative.
    """
    rng = np.random.default_rng(seed)
    tau, quality = 10.0 ** rng.uniform([-1.0, 2.0], [1.5, 5.5])
    size, apart = 10.0 ** rng.uniform(-1.0, 2.0) / tau, 10.0 ** rng.uniform(-9.0, -6.0)
    pole = size * complex(-0.5 / quality, np.sqrt(1.0 - 0.25 / quality**2))
    c1, c2 = 1.0, 1.0 + float(rng.choice([-1, 1])) * apart
    gain = size**2 * 10.0 ** rng.uniform(-3.0, -0.5) / quality / apart

    def phase(omega):
        turned = np.angle(1j * omega - pole) + np.angle(1j * omega - pole.conjugate())
        return (0.0 if c1 > c2 else np.pi) - omega * tau - turned

    end = 3.0 * size + 20.0 * np.pi / tau
    turns = np.arange(np.ceil((phase(end) / np.pi - 1.0) / 2.0), 1.0)
    at = [
        brentq(lambda w, t=t: phase(w) - np.pi * (2.0 * t + 1.0), 1e-12 * size, end)
        for t in turns
        if phase(1e-12 * size) > np.pi * (2.0 * t + 1.0)
    ]
    s = 1j * np.array([*at, *([0.0] if c1 < c2 else [])])
    factors = np.abs((s - pole) * (s - pole.conjugate())) / abs(gain * (c1 - c2))
    loop = Loop(Controller([], [pole, pole.conjugate()], gain), DIFFERENCE, tau, tau)
    assert margins(loop, c1, c2).gain_upper == pytest.approx(factors.min(), rel=1e-6)


@pytest.mark.parametrize("gain", [1.0 - 1e-9, 1.0 - 1e-12])
def test_an_all_pass_just_below_unity_gain_is_stable_up_to_unity_gain(gain):
    # |L| is `gain` everywhere, and its phase takes all values.
    all_pass = Controller([1.0], [-1.0], gain)
    loop = Loop(all_pass, SINGLE, 1.0, 1.0, delay=0.5)
    assert unstable_roots(loop, 0.0) == 0
    lower, upper = gain_limits(*loop.affine.quotient(0.0, 1.0))
    assert (lower.t, upper.omega) == (np.inf, np.inf)
    assert upper.t == pytest.approx(1.0 / gain, rel=1e-14)


@pytest.mark.parametrize("lowest", [0.5, 1.0, 1.5])
def test_free_phases_do_not_step_over_a_root_on_the_axis(lowest):
    notch = ((1j, -1j), (-0.25 + 0.97j, -0.25 - 0.97j, -1.0, -1.0), 0.9)
    loop = Loop(notch, SINGLE, 2.0, 1.5)
    below, above = np.linspace(1e-6, lowest, 100_001), np.linspace(lowest, 20.0, 400_001)
    k = loop.controller(1j * above)
    least = min(
        np.abs(1.0 + loop(1j * below, 0.1, 0.0)).min(),
        (np.abs(1.0 + k) - 0.1 * np.abs(k)).min(),
    )
    found = margins(loop, 0.1, 0.0, free_above=lowest).modulus
    assert found == pytest.approx(least, rel=2e-5)


def test_an_unconfined_chain_has_no_distance():
    assert modulus_margin(Loop(((), (), 5.0), SINGLE, 2.0, 1.5), 1.3, 1.0) == 0.0


def test_roots_that_cross_just_below_the_limit_of_the_chain_come_first():
    loop = paper_loop(0.19514549562262062 / 0.16687092308813156, 14.207314169676076, 14.04)
    for direction in [(0.2, 1.04), (1.0, 1.0), (0.3, 1.0)]:
        eps = critical_perturbation(loop, direction)
        tries = eps * (1.0 - np.array([1e-3, 1e-4, 2e-5]))
        counts = unstable_roots(loop, 1.0 + tries * direction[0], 1.0 + tries * direction[1])
        assert (counts <= 0).all()
        assert counts[0] == 0


def test_a_gain_margin_at_millions_of_rad_per_s_is_at_a_crossing():
    """One step of a float turns 20 s by 1e-8 rad there, and L is small: it changes by 1e-3."""
    zeros, poles = [0.0, 0.0, -7e-8, *[-2.8e-5] * 2, -2.9e-5], [*[-6.4e-6] * 2, -6.9e-6]
    poles += [-3e-4, -2.5e-3, -3.5e-4]
    loop = Loop((zeros, poles, 3850.0), dual(2.5, 20.1 - 19.9), 20.1, 19.9)
    found = margins(loop, 1.000000018, 1.00000052)
    with mpmath.workdps(30):
        step = found.gain_omega * mpmath.mpf(2.0) ** -50

        def open_loop(omega):
            s = mpmath.mpc(0, omega)
            gain = 3850 * mpmath.fprod(s - z for z in zeros)
            gain /= mpmath.fprod(s - p for p in poles)
            e = mpmath.mpf(2.5) / ((s + 2.5) * s * mpmath.mpf(20.1 - 19.9))
            arm1 = 1 - mpmath.mpf(1.000000018) * mpmath.exp(-s * mpmath.mpf(20.1))
            arm2 = 1 - mpmath.mpf(1.00000052) * mpmath.exp(-s * mpmath.mpf(19.9))
            return gain * ((1 + e) * arm1 + (1 - e) * arm2)

        ends = found.gain_omega - step, found.gain_omega + step
        omega = mpmath.findroot(lambda w: open_loop(w).imag, ends, solver="anderson", tol=1e-40)
        assert found.gain_upper == pytest.approx(float(-1 / open_loop(omega).real), rel=1e-6)


@pytest.mark.parametrize(("gain", "damping"), [(1e-3, 1e-2), (1e-3, 1e-3), (1e-2, 1e-2)])
def test_free_phases_of_a_difference_fill_a_disc_around_zero(gain, damping):
    """Of radius 2 |K|. At a resonance it may hold -1: the walk comes there in few steps."""
    resonant = Controller([-1.0], [complex(-damping, 6.3), complex(-damping, -6.3)], gain)
    found = margins(Loop(resonant, DIFFERENCE, 2.8, 2.2), free_above=0.3)
    largest = 2.0 * np.abs(resonant(1j * np.linspace(6.2, 6.4, 200_001))).max()
    assert found.modulus == pytest.approx(max(1.0 - largest, 0.0), rel=1e-5)


def test_a_difference_of_nearly_equal_delays_that_is_small_everywhere_is_answered():
    loop = Loop(Controller([], [-1.0], 1.0), DIFFERENCE, 10.0, 10.0 * (1.0 - 1e-8))
    found = margins(loop)
    assert found.modulus == pytest.approx(1.0, abs=1e-6)
    assert found.phase == np.inf
    # There the phases of both arms differ by 6e-4, which is what is left of |L| / 20.
    found = margins(20.0 * loop)
    with mpmath.workdps(30):
        s = mpmath.mpc(0, found.gain_omega)
        arms = [mpmath.exp(-s * mpmath.mpf(theta)) for theta in (loop.tau1, loop.tau2)]
        response = (arms[0] - arms[1]) / (s + 1)
    assert found.gain_upper * 20.0 * complex(response) == pytest.approx(-1.0, rel=1e-6)


@pytest.mark.parametrize("size", [1e-9, 1e9])
def test_forty_poles_do_not_overflow(size):
    # The product of the poles is 1e360, or one over it: no float.
    poles = [-size * (1.0 + 0.01 * k) for k in range(40)]
    zeros = [-0.3 * size * (1.0 + 0.01 * k) for k in range(39)]
    slow = Loop(Controller(zeros, poles, 1e-3 * size), SINGLE, 20.0)
    assert unstable_roots(slow, 0.5) == 0
    weak = Loop(Controller([], poles, 0.1), SINGLE, 20.0)
    # |L| is far below one, or far above it up to 40 times the poles, where L turns ten times.
    assert unstable_roots(weak, 0.5) == (0 if size > 1.0 else 20)
    by_sums = System.of(weak.controller) * (1 - 0.5 * delay(20.0))
    assert unstable_roots(by_sums) == unstable_roots(weak, 0.5)
    assert stability_chart(weak, [0.5], [0.0]).counts == unstable_roots(weak, 0.5)
    if size > 1.0:
        assert margins(weak, 0.5).modulus == pytest.approx(1.0, rel=1e-6)


def arms_over(polynomial, gains, lags, size):
    """A sum of delays over a polynomial, all coefficients times the size."""
    constants = [System.of(control.tf([size * gain], [1.0])) for gain in gains]
    arms = sum(gain * delay(lag) for gain, lag in zip(constants, lags, strict=True))
    return arms / control.tf([size * value for value in polynomial], [1.0])


@pytest.mark.parametrize("size", [1e-200, 1e-163, 1e-159, 1e160, 1e200])
@pytest.mark.parametrize(
    ("polynomial", "gains", "lags"),
    [
        ([1.954, 2.491, 1.356], [2.084, 2.805, 2.3], [6.05, 35.065, 0.273]),
        ([2.409, 1.982, 0.755], [-1.657, -1.783, 2.345], [3.295, 27.96, 0.448]),
        ([1.0, 3.0, 1.0], [3.0, 1.0], [0.5, 5.0]),
    ],
)
def test_the_size_of_all_coefficients_changes_no_number(polynomial, gains, lags, size):
    plain, tiny = (arms_over(polynomial, gains, lags, k) for k in (1.0, size))
    assert unstable_roots(tiny) == unstable_roots(plain)
    assert modulus_margin(tiny) == pytest.approx(modulus_margin(plain), rel=1e-9)
    if unstable_roots(plain) == 0:
        assert list(vars(margins(tiny)).values()) == pytest.approx(
            list(vars(margins(plain)).values()), rel=1e-6
        )


@pytest.mark.parametrize("size", [1e-20, 1e20])
def test_coefficients_that_are_no_floats_keep_their_roots(size):
    # The lowest of them is 1e-367 or 1e433.
    poles = -size * 1.5 ** np.arange(20)
    found = Polynomial.of(of_roots(poles))
    assert np.sort(np.real(found.roots)) == pytest.approx(np.sort(poles), rel=1e-6)


def test_slow_poles_that_were_multiplied_out_have_their_margins_through_every_door():
    """Eight of them, as coefficients: numpy's roots lie one percent off theirs."""
    below = np.poly([-1e-6] * 8)
    given = control.tf([0.5e-48], below)
    loop = Loop(given, "single", tau1=20.1)
    by_sums = System.of(given) * (1 - 0.2 * delay(20.1))
    for found in (margins(loop, 0.2), margins(by_sums)):
        assert found.gain_upper == pytest.approx(4.709964, rel=1e-6)
    # Three equal slow zeros, of which numpy's roots are a thousandth off.
    above = np.poly([-3.14159e-5] * 3)
    slow = control.tf(0.3 * above, np.poly([-1e-6] * 3 + [-2.0]))
    factors = Controller([-3.14159e-5] * 3, [-1e-6] * 3 + [-2.0], 0.3)
    found, expected = (margins(System.of(k) * delay(0.5)) for k in (slow, factors))
    assert found.gain_upper == pytest.approx(expected.gain_upper, rel=1e-6)
    assert found.modulus == pytest.approx(expected.modulus, rel=1e-6)


@pytest.mark.parametrize("gain", [10.0, 100.0])
def test_near_returns_of_two_arms_limit_the_gain(gain):
    """At 2 pi 10 Hz both arms return at once, and L / gain crosses the axis at some -4e-8."""
    loop = DualArm(gain=gain)
    found = margins(loop)
    with mpmath.workdps(50):
        tau1, tau2 = mpmath.mpf(20.1), mpmath.mpf(19.9)
        corner = mpmath.mpf(loop.mapping.denominator[1] / loop.mapping.denominator[2])

        def value(omega):
            s = mpmath.mpc(0, omega)
            e = corner / ((s + corner) * s * mpmath.mpf("0.2"))
            a, b = 1 - mpmath.exp(-s * tau1), 1 - mpmath.exp(-s * tau2)
            return gain / s * ((1 + e) * a + (1 - e) * b)

        omega = mpmath.findroot(lambda w: value(w).imag * 1e20, 62.83185300823605)
        truth = -1 / value(omega).real
    assert found.gain_upper_is_bound
    assert 1e4 <= found.gain_upper < truth


def test_a_gain_up_to_which_shared_objects_are_shown_to_be_confined_is_a_bound():
    """s (1 + k (0.6 z + 0.3 z^2)): the sum of magnitudes is one at k = 1 / 0.9."""
    z = delay(1.0)
    loop = (0.6 * z + 0.3 * z**2) * (s + 1) / (s + 2)
    _, above = gain_limits(*loop.affine.quotient())
    assert above.t == pytest.approx(1.0 / 0.9, rel=1e-12)
    assert above.is_bound
    # The chain is lost where both roots of 1 + k (0.6 z + 0.3 z^2) are on the unit circle.
    assert (np.abs(np.roots([0.3, 0.6, 1.0 / 2.0])) > 1.0).all()


def test_a_limit_that_is_not_found_does_not_hide_a_smaller_phase_margin(monkeypatch):
    z = delay(2.0)
    u, k = 0.8 * z - 0.6 * z**2, (s + 1.1) / (s + 1)
    loop = u * k / (1.0 - u * k)
    expected = margins(loop).phase
    monkeypatch.setattr(chain, "_MOST_CELLS", 30)
    assert margins(loop).phase == pytest.approx(expected, rel=1e-9)


def test_the_reserve_of_an_arc_bounds_all_its_turns():
    one, other = Delay(fmpq(2), "a"), Delay(fmpq(3), "b")
    lags = [Lag.of(powers) for powers in ({one: 1}, {one: 2}, {one: 1, other: 1}, {other: 1})]
    f, g = np.array([[1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.8, 0.6, 0.0, 0.0]])
    assert chain.arc_limit(lags, g, f)[0] == pytest.approx(np.arccos(0.6), rel=1e-8)
    # At half a turn alone the least |P| is 0.4.
    assert chain.arc_reserve(lags, g, f, 3.0) == 0.0
    rng = np.random.default_rng(7)
    turn = np.exp(-1j * np.linspace(0.0, 2.0 * np.pi, 181))
    z, w = turn[:, None, None], turn[None, :, None]
    products = [1.0, z, z**2, z * w, w]
    for acting in ([1, 1, 1, 1, 1], [1, 1, 1, 0, 0], [1, 0, 0, 1, 1], [1, 0, 0, 0, 1]):
        f, g = rng.uniform(-1.0, 1.0, (2, 5)) * acting
        f[0] = 9.0
        angle = rng.uniform(0.2, np.pi)
        psi = np.linspace(-angle, angle, 121)
        p = sum((a + np.exp(1j * psi) * b) * c for a, b, c in zip(f, g, products, strict=True))
        least = np.abs(p).min()
        assert 0.75 * least - 0.1 < chain.arc_reserve(lags, g, f, angle) <= least


def test_lists_and_arrays_have_the_results_of_each_and_the_reasons_of_those_without():
    loops = [SingleArm(0.5), CommonArm(0.1), CommonArm(0.1).replace(delay=2.0)]
    c = np.array([0.5, 0.9, 1.3])
    found: Any = margins(loops, c[:, None], c2=0.8)
    assert found.modulus.shape == (3, 3)
    for (i, k), modulus in np.ndenumerate(found.modulus):
        if reason := found.reasons[i, k]:
            assert np.isnan(modulus)
            with pytest.raises(ValueError, match=re.escape(reason)):
                margins(loops[k], c[i], c2=0.8)
        else:
            single = margins(loops[k], c[i], c2=0.8)
            assert (modulus, found.results[i, k]) == (single.modulus, single)
    assert 0 < np.isnan(found.modulus).sum() < 9
    k = parameter("k")
    peaks: Any = peak_gain([k / 3 / (s + 1), k / (s + 2)], k=[3.0, 5.0])
    assert peaks.gain.tolist() == pytest.approx([1.0, 2.5])
    assert peak_gain(k / (s + 2), k=3.0).gain == pytest.approx(1.5)
    assert modulus_margin(SingleArm(), [0.5, 0.9]).value[1] == modulus_margin(SingleArm(), 0.9)
    radii: Any = varying_radius([SingleArm(), CommonArm()], 0.9, 0.8)
    assert radii.radius[1] == varying_radius(CommonArm(), 0.9, 0.8).radius
    again = pickle.loads(pickle.dumps(found))
    assert np.array_equal(again.phase, found.phase, equal_nan=True)
    assert "results" in repr(found)
    assert "of 9" in found._repr_html_()
    with pytest.raises(ValueError, match=r"^c1 must be finite, got nan at index 1"):
        margins(SingleArm(), [0.5, np.nan])
    with pytest.raises(ValueError, match="must broadcast together"):
        margins(loops, [0.5, 0.6])
    with pytest.raises(AttributeError, match="nothing"):
        found.nothing()
