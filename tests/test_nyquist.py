"""Encirclements, crossings and responses, against counts, brute force and many digits."""

from __future__ import annotations

import time

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from armlock import (
    CommonArm,
    CountError,
    DualArm,
    Loop,
    SingleArm,
    System,
    axis_crossings,
    delay,
    equation,
    flight_loop,
    nyquist,
    paper_loop,
    s,
    unstable_roots,
)
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual
from tests import draws, independent
from tests.attack import roots

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
    "controlled, corner of its box": (paper_loop(), (1.0 + 1e-6, 1.0 - 1e-6), 0),
    "controlled, far away": (paper_loop(), (1.3, -0.6), 0),
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
    assert curve.open_loop_poles == poles
    assert curve.closed_loop_roots == curve.encirclements + poles
    # On the boundary D has a root s = 0 that 1 + L has not.
    assert max(unstable_roots(loop, c1, c2), 0) == curve.closed_loop_roots


@pytest.mark.parametrize("seed", range(draws(15, 120)))
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
    assert unstable_roots(equation(1 + loop), *point) == -1
    expected = independent.count(loop, point[0], point[1], at_zero=cancelled)
    assert unstable_roots(loop, *point) == expected
    assert nyquist(loop, *point).closed_loop_roots == expected


def test_a_loop_of_minus_one_at_zero_stays_a_boundary_point():
    # L(0) = -gain tau.
    for gain, count in ((-0.5, -1), (-0.5 * (1.0 + 1e-6), 1), (-0.5 * (1.0 - 1e-6), 0)):
        loop = Loop(((), (0.0,), gain), SINGLE, 2.0, 2.0)
        assert unstable_roots(loop) == count


@pytest.mark.parametrize(
    "name", ["single arm, unstable", "common arm, many roots", "one unstable pole"]
)
def test_the_curve_turns_around_minus_one_as_often_as_the_counts_say(name):
    """Where L falls to zero, the turns of the samples are those of the whole contour."""
    loop, point, _ = CASES[name]
    curve = nyquist(loop, *point, omega_max=1e4)
    path = np.concatenate((curve.indentation_response, curve.response))
    turned = np.angle((1.0 + path[1:]) / (1.0 + path[:-1])).sum()
    assert -turned / np.pi == pytest.approx(curve.encirclements, abs=0.01)


# --------------------------------------------------------------------------- bad input
@pytest.mark.parametrize("pole", [2j, 1e-3j, 50j])
def test_poles_on_the_axis_are_refused_with_the_reason_and_counted_elsewhere(pole):
    loop = Loop(((-1.0,), (pole, -pole, -1.0), 0.3), SINGLE, 2.0, 1.5)
    with pytest.raises(ValueError, match=r"no pole on the imaginary axis except at s = 0, got"):
        nyquist(loop, 0.9, 1.0)
    assert unstable_roots(loop, 0.9, 1.0) == independent.count(loop, 0.9, 1.0)


def test_an_unconfined_chain_is_refused():
    with pytest.raises(CountError, match="high-frequency chain of roots is not confined"):
        nyquist(Loop(((), (), 5.0), SINGLE, 2.0, 1.5), 1.3, 1.0)


@pytest.mark.parametrize(("mapping", "gain"), [(SINGLE, -1.0), (COMMON, -0.5)])
def test_a_loop_that_is_not_well_posed_is_refused(mapping, gain):
    with pytest.raises(ValueError, match="not well posed"):
        Loop(((-1.0,), (-3.0,), gain), mapping, 2.0, 1.5)


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
    imaginary = np.imag(loop(1j * omega, c1, c2))
    places = np.flatnonzero(imaginary[1:] * imaginary[:-1] < 0.0)
    middle = 0.5 * (omega[places] + omega[places + 1])
    step = omega[places + 1] - omega[places]
    negative = np.real(loop(1j * middle, c1, c2)) < 0.0
    assert crossings.omega.size == negative.sum() > 0
    assert (np.abs(crossings.omega - middle[negative]) <= step[negative]).all()
    value = loop(1j * crossings.omega, c1, c2)
    assert (np.abs(value.imag) <= 1e-9 * (np.abs(value) + np.abs(1e-3 / crossings.omega))).all()
    np.testing.assert_allclose(value.real, crossings.value, rtol=1e-9)


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
        # Here it meets zeros of the controller.
        (paper_loop(), 1.0, 0),
        # Tiny corners of a controller do not hide it.
        (Loop(((-1e-8, -1e-8), (0.0, 0.0, -1.0), 1.0), SINGLE, 2.0, 1.5), 0.5, 2),
    ],
)
def test_the_pole_at_zero_cancels_only_where_it_does(loop, c1, order):
    assert nyquist(loop, c1).pole_order == order


def test_a_count_that_takes_too_many_steps_is_refused():
    with pytest.raises(CountError, match="takes more than"):
        nyquist(CommonArm(1e9), 1.2, 1.05)


def test_crossings_are_none_of_a_weak_loop():
    weak = Loop(((), (-1.0,), 1e-5), SINGLE, 2.0, 1.5)
    assert axis_crossings(weak).omega.size == 0


def test_a_curve_through_zero_does_not_cross_the_negative_axis_there():
    """Both arms vanish at multiples of 62.83 rad/s: there L is rounding of either sign."""
    crossings = axis_crossings(paper_loop(), omega_max=1e4)
    assert crossings.omega.size == 3
    assert (crossings.value < -0.1).all()


def test_a_steep_curve_crosses_once_in_each_turn():
    """In each turn |L| falls from 2e4 to 1 and rises again within some 1e-4 rad/s."""
    loop = Loop(((-1.0,), (-3.0,), 1e4), SINGLE, 2.0, 1.5)
    crossings = axis_crossings(loop, 1.0001, omega_max=60.0)
    turns = np.pi * np.arange(1, 20)
    exact = [
        brentq(lambda w: loop(1j * w, 1.0001).imag, w, w + 1e-4, xtol=1e-14) for w in turns
    ]
    np.testing.assert_allclose(crossings.omega, exact, rtol=1e-13)
    np.testing.assert_allclose(
        crossings.value, loop(1j * np.array(exact), 1.0001).real, rtol=1e-8
    )


def test_a_pole_on_the_axis_is_no_crossing():
    loop = Loop(((), (2j, -2j, -1.0), 8.0), SINGLE, 2.0, 2.0)
    crossings = axis_crossings(loop, 1.5, omega_max=20.0)
    omega = np.linspace(1e-4, 20.0, 1_000_001)
    value = loop(1j * omega[omega != 2.0], 1.5)
    change = (value.imag[1:] * value.imag[:-1] < 0.0) & (abs(value[1:]) < 1e3)
    assert crossings.omega.size == (change & (value.real[1:] < 0.0)).sum() > 0
    assert (abs(crossings.omega - 2.0) > 1e-3).all()


def test_a_system_with_three_delays_has_a_curve_and_crossings():
    import control

    # A Smith predictor that takes 1.2 s for 1 s.
    plant, pi = control.tf([1], [2, 1]), control.tf([4, 2], [1, 0])
    predictor = System.of(pi).feedback(plant - plant * delay(1))
    loop = predictor * plant * delay(1.2)
    curve = nyquist(loop)
    assert (curve.pole_order, curve.open_loop_poles) == (1, 0)
    assert curve.closed_loop_roots == unstable_roots(loop)
    np.testing.assert_allclose(curve.response, loop(1j * curve.omega), rtol=1e-9)
    crossings = axis_crossings(loop)
    omega = np.linspace(1e-3, 1.001 * crossings.omega[-1], 1_000_001)
    value = loop(1j * omega)
    change = (value.imag[1:] * value.imag[:-1] < 0.0) & (value.real[1:] < -1e-3)
    assert crossings.omega.size == change.sum() > 0
    with pytest.raises(TypeError, match="1 values are given for the parameters"):
        nyquist(loop, 2.0)


def test_a_picture_takes_fewer_than_a_million_samples():
    loop = flight_loop()
    begun = time.thread_time()
    plain, far = nyquist(loop), nyquist(CommonArm(), omega_max=1e9)
    assert time.thread_time() - begun < 20.0
    assert plain.closed_loop_roots == far.closed_loop_roots == 0
    for curve, drawn in ((plain, loop), (far, CommonArm())):
        assert curve.omega.size < 1e6
        some = curve.omega[::997]
        # The phase omega tau of the reference is rounded.
        allowed = 1e-9 + 1e-15 * some * drawn.longest_delay
        assert (abs(curve.response[::997] / drawn(1j * some) - 1.0) < allowed).all()
        assert (np.diff(curve.omega) > 0.0).all()
    assert far.omega[-1] == 1e9


def test_a_picture_shows_a_resonance_between_its_even_samples():
    import control

    loop = (control.tf([0.1], [1, 0.2]) + control.tf([1.8e-3, 0], [1, 6e-4, 9])) * delay(1.0)
    curve = nyquist(loop)
    omega = 3.0 + np.linspace(-2e-3, 2e-3, 2001)
    assert abs(curve.response).max() == pytest.approx(abs(loop(1j * omega)).max(), rel=1e-3)
    turns = np.unwrap(
        np.angle(1.0 + np.concatenate((curve.response[::-1].conj(), curve.response)))
    )
    assert round((turns[0] - turns[-1]) / (2.0 * np.pi)) == curve.encirclements == 2


@pytest.mark.parametrize("below", [[1, 1, 1, 1], [1, 3, 4, 12], [1, 0.5, 9, 4.5]])
def test_undamped_pairs_that_were_multiplied_out_stay_on_the_axis(below):
    """P does not follow the sign of what rounding leaves of their damping."""
    given = control.tf([0.3, 1.0], below)
    for loop in (Loop(given, "single", 1.3), System.of(given) * (1 - 0.9 * delay(1.3))):
        with pytest.raises(ValueError, match="no pole on the imaginary axis except at s = 0"):
            nyquist(loop)


def test_a_curve_is_computed_when_it_is_read(monkeypatch):
    def refused(*_, **__):
        raise AssertionError("the curve was computed")

    with monkeypatch.context() as patched:
        patched.setattr(System, "__call__", refused)
        curve = nyquist(paper_loop())
        assert curve.encirclements == 0
        with pytest.raises(AssertionError, match="was computed"):
            _ = curve.response
    expected = paper_loop()(1j * curve.omega)
    np.testing.assert_allclose(curve.response, expected, rtol=1e-12, strict=True)


def test_a_curve_of_terms_that_cancel_has_all_digits():
    lag = (1 - (1 - delay(1.0)) / s) / s
    curve = nyquist(0.5 * (2 * lag) ** 3)
    assert curve.response[0] == pytest.approx(0.5, rel=1e-2)
    assert np.abs(np.diff(curve.response[:1000])).max() < 0.1


@pytest.mark.parametrize(
    ("loop", "omega_max", "lower"),
    [
        (System.of(2e5) / s * delay(15e-6) * (1 - delay(16.7)), None, 2.0),
        # None crosses up to 1e5 rad/s, where 15 us turn by a quarter.
        (Loop(((-100.0,), (0.0,), 1e4), COMMON, 16.7, 16.65, delay=15e-6), 1e6, 1.1e5),
    ],
)
def test_too_many_crossings_are_refused_at_once(loop, omega_max, lower):
    begin = time.process_time()
    with pytest.raises(CountError, match=r"steps up to .* rad/s, give a lower omega_max"):
        axis_crossings(loop, omega_max=omega_max)
    assert time.process_time() - begin < 1.0
    assert axis_crossings(loop, omega_max=lower).omega.size > 3
