"""Controllers: three forms of one thing, and what they refuse."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy.signal

from armlock import Controller, Loop, unstable_roots
from armlock.controllers import integrating_actuator, stage_one, stage_two, table_two
from armlock.paper import TABLE_2_POLES, TABLE_2_STAGE_1_POLE, TABLE_2_ZEROS
from armlock.sensors import COMMON, dual

S = np.array([1e-9j, 1e-5j, 0.3 + 0.2j, -0.1 + 2j, 1.5])


@pytest.mark.parametrize(
    ("zeros", "poles", "gain"),
    [
        ((), (0.0,), 0.4),
        ((-0.02,), (0.0, -0.1), 1.0),
        ((0.0, -3.0), (-1.0 + 2j, -1.0 - 2j), 2.5),
        ((-0.5 + 1j, -0.5 - 1j), (0.0, 0.3, -4.0), -0.7),
        ((), (), 5.0),
    ],
)
def test_three_forms_give_one_loop(zeros, poles, gain):
    above = gain * np.atleast_1d(np.poly(zeros)).real
    below = np.atleast_1d(np.poly(poles)).real
    forms = [
        (zeros, poles, gain),
        Controller(zeros, poles, gain),
        control.tf(above, below),
        control.zpk(zeros, poles, gain),
    ]
    loops = [Loop(form, COMMON, 2.1, 1.9) for form in forms]
    x, y = np.meshgrid([0.5, 0.9, 1.2], [0.3, 0.95, 1.1])
    expected = loops[0].open_loop(S[2:], 0.9, 1.1)
    for loop in loops:
        np.testing.assert_allclose(loop.open_loop(S[2:], 0.9, 1.1), expected, rtol=1e-12)
        np.testing.assert_array_equal(
            unstable_roots(loop, x, y), unstable_roots(loops[0], x, y)
        )


def test_a_numerator_of_python_control_may_start_with_zeros():
    padded = control.TransferFunction([0.0, 0.0, 3.0], [1.0, 2.0, 0.0])
    made = Controller.of(padded)
    assert made.zeros == ()
    np.testing.assert_allclose(made(S), 3.0 / (S * (S + 2.0)), rtol=1e-13)


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ("lag", TypeError, "controller must be a Controller, a control.TransferFunction or"),
        (3.0, TypeError, "got float"),
        (((), (0.0,)), TypeError, "got tuple"),
        (control.tf([1.0], [1.0, 1.0], 0.1), ValueError, "continuous in time, got sampling"),
        (control.tf([0.0], [1.0, 1.0]), ValueError, "controller must not be zero"),
        (((), (0.0,), 0.0), ValueError, "gain must not be zero"),
        (((), (0.0,), np.nan), ValueError, "gain must be finite"),
        (((), (1j,), 1.0), ValueError, "poles must be real or in conjugate pairs"),
        (((1 + 1j, 1 - 2j), (0.0, 0.0), 1.0), ValueError, "zeros must be real or in conj"),
        (((True,), (0.0,), 1.0), TypeError, "zeros must hold numbers, got dtype bool"),
        ((None, (0.0,), 1.0), TypeError, "zeros must hold numbers, got dtype object"),
        (("abc", (0.0,), 1.0), TypeError, "zeros must hold numbers, got dtype <U3"),
        ((((1.0,), (1.0, 2.0)), (), 1.0), ValueError, "zeros must be a rectangular array"),
        (
            ((), ((0.0,),), 1.0),
            ValueError,
            r"poles must be one-dimensional, got shape \(1, 1\)",
        ),
        (
            scipy.signal.TransferFunction([1.0], [1.0, 1.0]),
            TypeError,
            "got TransferFunctionCon",
        ),
        (((np.inf,), (0.0,), 1.0), ValueError, "zeros must be finite, got inf at index 0"),
    ],
)
def test_what_is_no_controller_is_refused(given, error, message):
    with pytest.raises(error, match=message):
        Loop(given, COMMON, 2.1, 1.9)


def test_several_channels_are_refused():
    with pytest.raises(ValueError, match="one input and one output, got 2 and 1"):
        Controller.of(control.TransferFunction([[[1.0], [1.0]]], [[[1.0, 1.0], [1.0, 1.0]]]))


def test_series_connection_multiplies():
    first, second = Controller([-2.0], [-1.0], 3.0), integrating_actuator(0.5)
    np.testing.assert_allclose((first * second)(S), first(S) * second(S), rtol=1e-14)
    with pytest.raises(TypeError):
        first * 2.0  # type: ignore[operator]


def test_table_two_is_the_product_of_its_factors():
    s = S
    value = 5000.0 * s**2 / (s + TABLE_2_STAGE_1_POLE) ** 2
    for zero, pole in zip(TABLE_2_ZEROS, TABLE_2_POLES, strict=True):
        value = value * (s + zero) / (s + pole)
    np.testing.assert_allclose(table_two()(s), value, rtol=1e-13)
    np.testing.assert_allclose((stage_one() * stage_two())(s), value, rtol=1e-13)


def test_the_printed_denominator_cancels_a_zero():
    table, printed = stage_two(), stage_two(denominator="printed")
    ratio = (S + TABLE_2_ZEROS[-1]) / (S + TABLE_2_POLES[-1])
    np.testing.assert_allclose(table(S), printed(S) * ratio, rtol=1e-13)
    with pytest.raises(ValueError, match="denominator must be 'table' or 'printed', got 'x'"):
        table_two(denominator="x")


@pytest.mark.parametrize("make", [integrating_actuator, stage_one, table_two])
@pytest.mark.parametrize("gain", [0.0, -1.0, np.inf])
def test_gains_must_be_positive(make, gain):
    with pytest.raises(ValueError, match=r"^gain must be (positive|finite), got"):
        make(gain)


def test_poles_at_zero_that_cancel_leave_no_root_there():
    loop = Loop(stage_one(), dual(2.0, 0.2), 20.1, 19.9)
    assert abs(loop(0.0, 1.0, 1.0)) > 0.0
    assert unstable_roots(loop, 1.0, 1.0) == 0
