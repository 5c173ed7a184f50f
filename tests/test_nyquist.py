"""Encirclements, crossings and responses, against counts, brute force and many digits."""

from __future__ import annotations

import importlib

import mpmath
import numpy as np
import pytest

from armlock import (
    CommonArm,
    CountError,
    DualArm,
    Loop,
    SingleArm,
    axis_crossings,
    nyquist,
    paper_loop,
    unstable_roots,
)
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual
from armlock.stability.counts import loop_count
from armlock.stability.nyquist import open_loop_poles
from tests import independent
from tests.attack import roots

# The package has a function of the same name.
module = importlib.import_module("armlock.stability.nyquist")

# Loop, (c1, c2), unstable poles of L.
CASES = {
    "single arm, ideal": (SingleArm(), (1.0, 1.0), 0),
    "single arm, unstable": (SingleArm(), (1.001, 1.0), 0),
    # Down to 5e-8 rad/s L looks like a constant of 2010.
    "single arm, large gain": (SingleArm(100.0, 20.1), (1.0 + 1e-6, 1.0), 0),
    "common arm, many roots": (CommonArm(), (1.3, 1.1), 0),
    "common arm, a rounding away": (CommonArm(), (1.0, 1.0 + 1e-13), 0),
    "dual arm, ideal": (DualArm(), (1.0, 1.0), 0),
    "dual arm, Area 2": (DualArm(), (1.0, 0.995), 0),
    "dual arm, Area 1": (DualArm(), (1.0, 1.005), 0),
    "triple integrator": (
        Loop(((-0.1, -0.1), (0, 0, 0), 1.0), COMMON, 2.0, 1.5),
        (1.0, 1.01),
        0,
    ),
    "one unstable pole": (Loop(((), (0.5,), 2.0), SINGLE, 2.0, 1.5), (0.9, 1.0), 1),
    "fast unstable pair": (
        Loop(((), (0.1 + 50j, 0.1 - 50j), 1.0), SINGLE, 2, 1.5),
        (0.9, 1),
        2,
    ),
    "unstable pole and integrator": (
        Loop(((-1, -1), (0.0, 0.3, -5.0), 4.0), COMMON, 0.3, 0.2),
        (0.2, 0.1),
        1,
    ),
    "neutral, unstable pole": (Loop(((-3,), (1.0,), 0.2), COMMON, 2.0, 1.5), (0.9, 0.8), 1),
    "neutral, constant": (Loop(((), (), 5.0), DIFFERENCE, 2.0, 1.5), (0.05, 0.1), 0),
}
# Poles so near to the axis that L turns within a millionth of its frequency.
for real, gain in ((-1e-6, 1e-4), (1e-6, 1e-7), (-1e-9, 1e-7), (1e-9, 1e-11)):
    CASES[f"resonance at {real:+g}, gain {gain:g}"] = (
        Loop(((), (real + 3j, real - 3j), gain), SINGLE, 2.0, 1.5),
        (0.9, 1.0),
        2 * (real > 0),
    )


@pytest.mark.parametrize("name", CASES)
def test_encirclements_and_open_loop_poles_give_the_closed_loop_roots(name):
    loop, (c1, c2), poles = CASES[name]
    curve = nyquist(loop, c1, c2)
    assert curve.open_loop_poles == open_loop_poles(loop) == poles
    assert curve.closed_loop_roots == curve.encirclements + poles
    # On the boundary D has a root s = 0 that 1 + L has not.
    assert max(int(unstable_roots(loop, c1, c2)), 0) == curve.closed_loop_roots
    turns = np.abs(np.angle((1 + curve.response[1:]) / (1 + curve.response[:-1])))
    assert turns.max() <= 1.0


@pytest.mark.parametrize("seed", range(20))
def test_random_controllers_agree_with_a_rectangle_of_another_kind(seed):
    rng = np.random.default_rng(seed)
    order = int(rng.integers(1, 5))
    zeros, poles = (roots(rng, n, 0.03, 6.0, 0.3) for n in (int(rng.integers(0, order)), order))
    mapping = [SINGLE, COMMON, DIFFERENCE, dual(2.0, 0.5)][seed % 4]
    loop = Loop((zeros, poles, 10.0 ** rng.uniform(-2.0, 0.5)), mapping, 2.0, 1.5)
    point = rng.normal(1.0, 0.3, 2)
    expected = independent.rectangle_count(loop, *point)
    assert nyquist(loop, *point).closed_loop_roots == expected


@pytest.mark.parametrize("seed", range(40))
def test_roots_that_cancel_at_zero_hide_no_other(seed):
    rng = np.random.default_rng(seed)
    integrators = 1 + seed % 3
    order = int(rng.integers(0, 4))
    zeros, poles = (roots(rng, n, 0.03, 6.0, 0.2) for n in (order, order))
    controller = (zeros, [*poles, *[0.0] * integrators], 10.0 ** rng.uniform(-2.0, 0.5))
    c = float(rng.choice([1.0, rng.integers(-8, 9) / 4.0]))
    mapping, point, cancelled = [
        (SINGLE, (1.0, c), 1),
        (COMMON, (c, 2.0 - c), 1),
        (DIFFERENCE, (c, c), 1),
        (dual(2.0, 0.5), (c, c), 1),
        # Here the first derivative of the numerator vanishes, too.
        (COMMON, (-6.0, 8.0), min(integrators, 2)),
    ][seed % 5]
    loop = Loop(controller, mapping, 2.0, 1.5, delay=float(rng.choice([0.0, 0.3])))
    if mapping is DIFFERENCE and c == 0.0:
        cancelled = integrators
    assert unstable_roots(loop, *point) == -1
    expected = independent.rectangle_count(loop, *point, at_zero=cancelled)
    assert loop_count(loop, *point) == expected
    assert nyquist(loop, *point).closed_loop_roots == expected


def test_a_loop_of_minus_one_at_zero_stays_a_boundary_point():
    # L(0) = -gain tau.
    for gain, count in ((-0.5, -1), (-0.5 * (1.0 + 1e-6), 1), (-0.5 * (1.0 - 1e-6), 0)):
        loop = Loop(((), (0.0,), gain), SINGLE, 2.0, 2.0)
        assert loop_count(loop, 1.0, 1.0) == count


def test_a_resonance_between_the_samples_is_refused_not_guessed(monkeypatch):
    loop, (c1, c2), _ = CASES["resonance at -1e-06, gain 0.0001"]
    assert nyquist(loop, c1, c2).closed_loop_roots == 2

    def even(loop, c1, c2, end):
        return np.linspace(0.0, end, 300)

    monkeypatch.setattr(module, "_resolving_grid", even)
    with pytest.raises(CountError, match=r"passes through -1|against 2 roots"):
        nyquist(loop, c1, c2)


def test_a_forgotten_unstable_pole_is_noticed(monkeypatch):
    loop, (c1, c2), _ = CASES["one unstable pole"]
    monkeypatch.setattr(module, "open_loop_poles", lambda _: 0)
    with pytest.raises(CountError, match=r"no Nyquist count at \(c1, c2\) = "):
        nyquist(loop, c1, c2)


# --------------------------------------------------------------------------- bad input
@pytest.mark.parametrize("pole", [2j, 1e-3j, 50j])
def test_poles_on_the_axis_are_refused_with_the_reason_and_counted_elsewhere(pole):
    loop = Loop(((-1.0,), (pole, -pole, -1.0), 0.3), SINGLE, 2.0, 1.5)
    with pytest.raises(ValueError, match=r"no pole on the imaginary axis except at s = 0, got"):
        nyquist(loop, 0.9, 1.0)
    assert unstable_roots(loop, 0.9, 1.0) == independent.rectangle_count(loop, 0.9, 1.0)


def test_an_unconfined_chain_is_refused():
    with pytest.raises(CountError, match="high-frequency chain of roots is not confined"):
        nyquist(Loop(((), (), 5.0), SINGLE, 2.0, 1.5), 1.3, 1.0)


@pytest.mark.parametrize(("mapping", "gain"), [(SINGLE, -1.0), (COMMON, -0.5)])
def test_a_loop_that_is_not_well_posed_is_refused(mapping, gain):
    with pytest.raises(ValueError, match="not well posed"):
        Loop(((-1.0,), (-3.0,), gain), mapping, 2.0, 1.5)


# --------------------------------------------------------------------------- responses
@pytest.mark.parametrize(
    "loop",
    [SingleArm(), CommonArm(), DualArm(), paper_loop(), paper_loop(actuator=True)],
    ids=["single", "common", "dual", "controlled", "controlled, actuator"],
)
@pytest.mark.parametrize("c2", [1.0, 1.0 - 1e-6])
def test_a_tenth_of_a_nanohertz_is_as_exact_as_a_hertz(loop, c2):
    frequency = np.array([1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.04, 0.26, 1.0])
    omega = 2.0 * np.pi * frequency
    value = loop.open_loop(1j * omega, 1.0, c2)
    with mpmath.workdps(50):
        expected = [complex(independent.exact(loop, 1j * w, 1.0, c2) - 1) for w in omega]
    np.testing.assert_array_less(np.abs(value / expected - 1.0), 1e-12)


# --------------------------------------------------------------------------- crossings
@pytest.mark.parametrize(
    ("loop", "c1", "c2", "end"),
    [
        (SingleArm(), 1.001, 1.0, 20.0),
        (CommonArm(), 1.0, 1.001, 130.0),
        (CommonArm(), 1.2, 1.1, 20.0),
        (DualArm(), 1.01, 1.02, 40.0),
        (paper_loop(), 1.0, 1.0 - 1e-6, 2.0),
    ],
)
def test_no_crossing_is_missed_and_none_is_invented(loop, c1, c2, end):
    crossings = axis_crossings(loop, c1, c2, omega_max=end)
    omega = np.concatenate((np.geomspace(1e-9, 0.02, 40_000), np.linspace(0.02, end, 900_000)))
    imaginary = np.imag(loop.open_loop(1j * omega, c1, c2))
    places = np.flatnonzero(imaginary[1:] * imaginary[:-1] < 0.0)
    middle = 0.5 * (omega[places] + omega[places + 1])
    step = omega[places + 1] - omega[places]
    negative = np.real(loop.open_loop(1j * middle, c1, c2)) < 0.0
    assert crossings.omega.size == negative.sum() > 0
    assert (np.abs(crossings.omega - middle[negative]) <= step[negative]).all()
    value = loop.open_loop(1j * crossings.omega, c1, c2)
    assert (np.abs(value.imag) <= 1e-9 * (np.abs(value) + np.abs(1e-3 / crossings.omega))).all()
    np.testing.assert_array_equal(value.real, crossings.value)


@pytest.mark.parametrize("loop", [SingleArm(), CommonArm(), DualArm()])
def test_the_ideal_loops_cross_nowhere(loop):
    assert axis_crossings(loop, 1.0, 1.0).omega.size == 0


@pytest.mark.parametrize(
    ("loop", "c1", "order"),
    [
        (SingleArm(), 1.0, 0),
        (SingleArm(), 1.0 + 4.5e-16, 1),
        (SingleArm(), 1.0 - 1e-12, 1),
        (SingleArm(), 0.5, 1),
        # Tiny corners of a controller do not hide it.
        (Loop(((-1e-8, -1e-8), (0.0, 0.0, -1.0), 1.0), SINGLE, 2.0, 1.5), 0.5, 2),
    ],
)
def test_the_pole_at_zero_cancels_only_where_it_does(loop, c1, order):
    assert nyquist(loop, c1).pole_order == order


def test_a_curve_that_takes_too_many_samples_is_refused():
    with pytest.raises(CountError, match="gain times delay is too large"):
        nyquist(CommonArm(1e9), 1.2, 1.05)


def test_crossings_are_none_of_a_weak_loop_and_refused_where_l_has_no_value():
    weak = Loop(((), (-1.0,), 1e-5), SINGLE, 2.0, 1.5)
    assert axis_crossings(weak).omega.size == 0
    resonant = Loop(((-1.0,), (2j, -2j, -1.0), 0.3), SINGLE, 2.0, 1.5)
    with pytest.raises(ValueError, match="no pole on the imaginary axis except at s = 0"):
        axis_crossings(resonant)
    with pytest.raises(ValueError, match=r"^omega_max must be of a size that memory holds"):
        nyquist(CommonArm(), omega_max=1e9)
