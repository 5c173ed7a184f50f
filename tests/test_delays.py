"""Systems with any number of delays, as people who know python-control make them."""

from __future__ import annotations

import math
from fractions import Fraction

import control
import matplotlib.pyplot as plt
import mpmath
import numpy as np
import pytest

from armlock import (
    CommonArm,
    Controller,
    System,
    buildable_loop,
    delay,
    flight_loop,
    impulse_response,
    margins,
    paper_loop,
    parameter,
    step_info,
    step_response,
    unstable_roots,
)
from armlock import s as laplace

S = control.tf("s")
PLANT, PI = control.tf([1], [2, 1]), control.tf([4, 2.2], [1, 0])


def test_a_plant_times_a_delay():
    for plant in (PLANT, control.ss(PLANT), control.zpk([], [-0.5], 0.5)):
        for loop in (plant * delay(0.5), delay(0.5) * plant):
            assert loop(2j) == pytest.approx(np.exp(-1j) / (4j + 1), rel=1e-12)
    loop = np.float64(2.0) * PI * PLANT * delay(0.5) - 1
    assert loop(2j) == pytest.approx(2 * PI(2j) * PLANT(2j) * np.exp(-1j) - 1, rel=1e-12)
    assert (3 - delay(1.0))(0.0) == 2.0
    assert (1 / (PLANT * delay(0.0)))(1.0) == 3.0
    assert "exp(-0.5 s)" in str(PLANT * delay(0.5))


def test_feedback_is_negative_and_takes_delays_on_the_way_back():
    closed = (PI * PLANT * delay(0.5)).feedback(delay(0.1))
    forward, back = PI(1j) * PLANT(1j) * np.exp(-0.5j), np.exp(-0.1j)
    assert closed(1j) == pytest.approx(forward / (1 + forward * back), rel=1e-12)
    positive = (PLANT * delay(0.5)).feedback(sign=1)
    assert positive(1j) == pytest.approx(
        PLANT(1j) * np.exp(-0.5j) / (1 - PLANT(1j) * np.exp(-0.5j)), rel=1e-12
    )


def test_a_bode_plot():
    loop, omega = PI * PLANT * delay(0.5), np.geomspace(0.01, 10.0, 200)
    response = control.frequency_response(loop, omega)
    assert response.frdata[0, 0] == pytest.approx(loop(1j * omega), rel=1e-12)
    assert control.bode_plot(response) is not None
    plt.close("all")
    assert control.margin(response)[1] == pytest.approx(
        math.degrees(margins(loop).phase), rel=1e-3
    )


@pytest.mark.parametrize(
    "guess",
    [
        lambda system: control.feedback(PLANT, system),
        lambda system: PLANT / system,
        lambda system: control.frd([1.0, 2.0], [0.1, 1.0]) * system,
    ],
)
def test_where_the_operator_of_python_control_comes_first_its_error_stands(guess):
    with pytest.raises((TypeError, AttributeError)):
        guess(PLANT * delay(0.5))
    # What to write instead.
    assert System.of(PLANT).feedback(PLANT * delay(0.5))(0.0) == 0.5
    assert (System.of(PLANT) / (1 + PLANT * delay(0.5)))(0.0) == 0.5


@pytest.mark.parametrize(
    ("system", "word"),
    [
        (control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2))), "one input"),
        (control.tf([1], [1, 0.5], 0.1), "continuous in time"),
        ("plant", "got 'plant'"),
        (1j, "System, a number"),
        (math.nan, "finite"),
    ],
)
def test_what_is_no_such_system_is_refused_with_a_word(system, word):
    with pytest.raises((TypeError, ValueError), match=word):
        delay(1.0) * system
    with pytest.raises((TypeError, ValueError), match=word):
        System.of(system)


def test_a_system_that_answers_before_it_is_asked_is_refused():
    with pytest.raises(ValueError, match="must be causal"):
        1 / delay(1.0)
    with pytest.raises(ValueError, match="theta must not be negative, got -1"):
        delay(-1.0)
    with pytest.raises(ZeroDivisionError):
        delay(1.0) / 0


def test_common_factors():
    # (1 - exp(-s)) / s has no pole at s = 0, and a power of s in both is divided out.
    average = (1 - delay(1.0)) / control.tf([1, 0], [1])
    assert unstable_roots(average) == 0
    assert (S * average / S).numerator == average.numerator
    assert unstable_roots(control.tf([1, 0], [1, 0]) * delay(1.0) * 0.5) == 0
    # An unstable factor stays, because the state behind it grows.
    hidden = control.tf([1, -1], [1, 2]) * delay(0.1) * control.tf([1], [1, -1])
    assert unstable_roots(hidden) == 1


def test_what_is_advanced_or_next_to_it_is_unconfined():
    assert unstable_roots(S * delay(1.0)) == -2
    assert unstable_roots(1.001 * delay(1.0)) == -2
    assert unstable_roots(0.999 * delay(1.0)) == 0


def steps(gain, time, derivative=0):
    """Response of gain exp(-s) / s under feedback, by the method of steps."""
    return np.array([
        sum(
            (-1) ** k * gain ** (k + 1) * (t - k - 1) ** (k + 1 - derivative)
            / math.factorial(k + 1 - derivative)
            for k in range(30)
            if t >= k + 1
        )
        for t in time
    ])  # fmt: skip


@pytest.mark.parametrize("gain", [0.3, 1.0, 3.0])
def test_responses_are_those_of_the_method_of_steps(gain):
    closed = (control.tf([gain], [1, 0]) * delay(1.0)).feedback()
    time = np.linspace(0.0, 12.0, 481)
    for respond, derivative in ((step_response, 0), (impulse_response, 1)):
        expected = steps(gain, time, derivative)
        found = respond(closed, time)
        assert isinstance(found, control.TimeResponseData)
        assert np.abs(found.outputs - expected).max() < 1e-6 * np.abs(expected).max()
    t, y = step_response(closed, 12.0)
    assert (t[0], t[-1], t.shape, y.shape) == (0.0, 12.0, (1001,), (1001,))


def test_a_response_without_a_delay_is_that_of_python_control():
    plant = control.tf([1, 3], [1, 0.4, 4])
    time = np.linspace(0.0, 20.0, 801)
    for ours, theirs in (
        (step_response, control.step_response),
        (impulse_response, control.impulse_response),
    ):
        expected = theirs(plant, time).outputs
        assert np.abs(ours(plant, time).outputs - expected).max() < 1e-6


def test_jumps_of_a_neutral_loop_are_not_smeared():
    # 0.5 exp(-s) fed back: 0.5, -0.25, 0.125, ... from t = 1, 2, 3, ...
    closed = (0.5 * delay(1.0)).feedback()
    time = np.array([0.999999, 1.0, 1.999999, 2.0, 2.999999, 3.0])
    expected = [0.0, 0.5, 0.5, 0.25, 0.25, 0.375]
    assert step_response(closed, time).outputs == pytest.approx(expected, abs=1e-6)
    with pytest.warns(UserWarning, match="impulses at t = 1, 2, 3 s"):
        impulse_response(closed, 3.5)


# Loops whose corners are far above one over the last time, which comes before the first echo.
STIFF = {"flight": (flight_loop(), 0.1), "buildable": (buildable_loop(), 1.0)}


@pytest.mark.parametrize("name", STIFF)
def test_responses_over_many_decades_are_those_of_talbots_method(name):
    """Before the first echo the arms return nothing, and only the dead time is left."""
    loop, last = STIFF[name]

    def polynomial(ascending, s):
        return sum(a * s**i for i, a in enumerate(ascending))

    def transform(s):
        k, m = loop.controller, loop.mapping
        above = polynomial(m.numerator1, s) + polynomial(m.numerator2, s)
        value = k.gain * mpmath.fprod(s - z for z in k.zeros()) * above
        below = mpmath.fprod(s - p for p in k.poles()) * polynomial(m.denominator, s)
        value *= mpmath.exp(-loop.delay * s) / below
        return value / (1 + value) / s

    time = np.linspace(0.0, last, 1001)
    found = step_response(loop.feedback(), time).outputs
    for i in (10, 300, 1000):
        expected = float(mpmath.invertlaplace(transform, time[i], method="talbot", degree=40))
        assert found[i] == pytest.approx(expected, abs=1e-9)
    # The value at a time does not depend on the others.
    some = [10, 300, 600]
    alone = step_response(loop.feedback(), time[some]).outputs
    assert np.abs(alone - found[some]).max() < 1e-9


def test_one_time_and_many_have_one_response():
    """At jumps, on either side of them, and between them."""
    response = paper_loop().feedback()
    time = np.array([0.1, 15.0, 19.9, 20.05, 20.1, 40.0, 50.0])
    together = step_response(response, time).outputs
    alone = [step_response(response, [t]).outputs[0] for t in time]
    assert np.abs(alone - together).max() < 1e-9


def test_a_response_may_be_a_billion_times_longer_than_its_time_constant():
    before = np.seterr(all="raise")
    try:
        lag = control.tf([1], [1e-9, 1]) * delay(1.0)
        found = step_response(lag, [1.0, 1.0 + 1e-9, 2.0, 1e3]).outputs
        assert found == pytest.approx([0.0, 1.0 - np.exp(-1.0), 1.0, 1.0], abs=1e-6)
        decayed = step_response(control.tf([1, 0], [1, 1]) * delay(0.5), 1e4).outputs
        assert abs(decayed[-1]) < 1e-9
    finally:
        np.seterr(**before)


def test_a_response_that_is_too_long_says_how_long_it_may_be(monkeypatch):
    for most in ("inversion._MOST", "responses._MOST_JUMPS"):
        monkeypatch.setattr(f"armlock.timedomain.{most}", 600)
    integrator = control.tf([30.0], [1, 0])
    for system in (
        (integrator * (1 - 0.9 * delay(1.0))).feedback(),
        (0.5 * delay(1.0) + 0.1 * delay(1.1)).feedback() * control.tf([1], [1, 1]),
        control.tf([1], [1, -3]) * delay(1.0),
    ):
        with pytest.raises(ValueError, match=r"timepts must end by .* s, until when") as error:
            step_response(system, 3e3)
        until = float(str(error.value).split()[4])
        assert until > 0.5
        assert np.isfinite(step_response(system, until).outputs).all()
        with pytest.raises(ValueError, match="timepts must end by"):
            step_response(system, 2.0 * until)


def test_a_response_that_is_none_is_refused():
    with pytest.raises(ValueError, match="no more zeros than poles"):
        step_response(S * S * delay(1.0), 10.0)
    with pytest.warns(UserWarning, match="impulses at t = 1 s"):
        found = step_response(S * delay(1.0), 10.0).outputs
    assert np.abs(found).max() < 1e-7
    with pytest.raises(ValueError, match="timepts must ascend"):
        step_response(delay(1.0), [1.0, 0.5])


def test_many_factors_are_kept_by_a_controller():
    controller = Controller([-1e-3] * 2, [-1e-6] * 3 + [-2 + 3j, -2 - 3j], 5.0)
    loop = System.of(controller) * delay(Fraction(1, 3))
    s = 1j * np.geomspace(1e-7, 10.0, 30)
    assert loop(s) == pytest.approx(controller(s) * np.exp(-s / 3), rel=1e-9)


def test_a_response_is_drawn_by_python_control():
    found = step_response(control.tf([1], [1, 1]) * delay(1.0), 3.0)
    axes = found.plot().axes
    assert axes.shape == (1, 1)
    np.testing.assert_array_equal(axes[0, 0].lines[0].get_ydata(), found.outputs)


def test_many_fast_poles_overflow_neither_in_values_nor_in_print():
    lag = System.of(control.tf([1e9], [1.0, 1e9]))
    system = math.prod([lag] * 40) * delay(1e-9)
    s = np.array([0.0, 1e9j, 2e9j])
    assert system(s) == pytest.approx((1.0 + s / 1e9) ** -40.0 * np.exp(-1e-9 * s), rel=1e-12)
    with pytest.raises(ValueError, match=r"coefficients below 1e\+300"):
        unstable_roots(system)
    assert "s^39" in str(system)
    assert "1.00000e+360" in str(system)


def test_a_dead_time_before_a_growing_response_costs_no_digits():
    unstable = control.tf([1], [1, -1]) * delay(30.0)
    found = step_response(unstable, [10.0, 30.0, 31.0, 35.0]).outputs
    assert found == pytest.approx([0.0, 0.0, np.expm1(1.0), np.expm1(5.0)], abs=2e-4)
    ramp = step_response(control.tf([1], [1, 0, 0]) * delay(10.0), [10.0, 10.01]).outputs
    assert ramp == pytest.approx([0.0, 5e-5], abs=1e-10)
    low_pass = control.tf([1], [1, 1]) * delay(10.0)
    assert low_pass(5.0) == pytest.approx(np.exp(-50.0) / 6.0, rel=1e-12)


def test_at_zero_a_system_has_its_limit():
    block = (1 - delay(0.1)) / S
    assert block(0) == pytest.approx(0.1, rel=1e-15)
    assert block([0.0, 1j])[0] == pytest.approx(0.1, rel=1e-15)
    closed = (2 * (1 - delay(1.0)) / (S * (S + 1))).feedback()
    assert closed(0) == pytest.approx(2.0 / 3.0, rel=1e-15)
    response = closed.frequency_response([0.0, 1.0])
    assert response.frdata[0, 0, 0] == pytest.approx(2.0 / 3.0)
    assert CommonArm(gain=2.0)(0) == pytest.approx(80.0, rel=1e-14)
    assert CommonArm(gain=2.0)([0.0, 1j])[0] == pytest.approx(80.0, rel=1e-14)
    assert np.isinf(CommonArm()(0, 0.9))


def test_terms_that_cancel_cost_no_digits():
    """Down to the lowest frequencies, and with parameters: against 400 digits."""
    k = parameter("k", 1.0)
    kernels = [(1 - delay(theta)) / (Fraction(theta) * laplace) for theta in (1.0, 1e-3)]
    systems = {
        "powers": lambda s, f: f(s, 1) ** 6,
        "differences": lambda s, f: (1 - f(s, 1)) ** 2 / s**2,
        "scales": lambda s, f: (1 - f(s, 1)) ** 2 * (1 - f(s, 0)) ** 2 / s**4,
    }
    made = {
        "powers": kernels[0] ** 6,
        "differences": (1 - kernels[0]) ** 2 / laplace**2,
        "scales": ((1 - kernels[0]) * (1 - kernels[1]) / laplace**2) ** 2,
    }
    omega = np.geomspace(1e-9, 30.0, 40)

    def kernel(s, which):
        theta = mpmath.mpf(1.0 if which else 1e-3)
        return (1 - mpmath.exp(-s * theta)) / (s * theta)

    for name, formula in systems.items():
        with mpmath.workdps(400):
            expected = [complex(formula(mpmath.mpc(0.0, w), kernel)) for w in omega]
        found = made[name](1j * omega)
        assert found == pytest.approx(np.array(expected), rel=2e-12), name
        doubled = (k * made[name])(1j * omega, np.full(omega.size, 2.0))
        assert doubled == pytest.approx(2.0 * found, rel=2e-12), name
    # Two objects of one length cancel everywhere.
    assert (delay(1.0) * delay(1.0) - delay(2.0))(0.3 + 1j) == 0.0


def test_the_numbers_of_a_step_are_relative_to_the_final_value_of_the_system():
    """Of a mode of two poles, in closed form, and at times that end before it has settled."""
    damping = 0.3
    mode = 2.5 / (laplace**2 + 2.0 * damping * laplace + 1.0) * delay(1.0)
    fast = np.sqrt(1.0 - damping**2)
    overshoot = 100.0 * np.exp(-np.pi * damping / fast)
    for end in (6.0, 60.0):
        info = step_info(mode, np.linspace(0.0, end, 6001))
        assert info["Overshoot"] == pytest.approx(overshoot, rel=1e-4)
        assert info["PeakTime"] == pytest.approx(1.0 + np.pi / fast, abs=end / 6000)
        assert info["SteadyStateValue"] == 2.5
        assert np.isnan(info["SettlingTime"]) == (end == 6.0)
    assert step_info(mode, 60.0, SettlingTimeThreshold=0.5)["SettlingTime"] < 5.0
    for system, word in ((1 / laplace, "be stable"), (laplace / (laplace + 1), "final value")):
        with pytest.raises(ValueError, match=f"^system must .*{word}"):
            step_info(system, 9.0)
