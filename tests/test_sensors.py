from typing import Any

import numpy as np
import pytest

from armlock import sensors

OMEGA = np.array([0.01, 0.3, 2.0])
S = 1j * OMEGA
TAU1, TAU2 = 20.1, 19.9


def test_single_sensor_is_a_sine_of_the_one_way_delay():
    # 2 j sin(tau w) exp(-j w tau) with the one-way delay tau, half the round trip.
    one_way = TAU1 / 2.0
    expected = 2j * np.sin(one_way * OMEGA) * np.exp(-1j * OMEGA * one_way)
    np.testing.assert_allclose(sensors.SINGLE.response(S, TAU1, TAU2), expected, rtol=1e-12)


def test_common_sensor_holds_mean_and_difference_of_the_delays():
    mean, half = (TAU1 + TAU2) / 2.0, (TAU1 - TAU2) / 2.0
    expected = 2.0 * (1.0 - np.cos(half * OMEGA) * np.exp(-1j * OMEGA * mean))
    np.testing.assert_allclose(sensors.COMMON.response(S, TAU1, TAU2), expected, rtol=1e-12)


def test_difference_sensor_is_positive_exponential_of_the_longer_arm():
    expected = np.exp(-S * TAU1) - np.exp(-S * TAU2)
    np.testing.assert_allclose(
        sensors.DIFFERENCE.response(S, TAU1, TAU2), expected, rtol=1e-10, atol=1e-14
    )


def test_dual_sensor_is_common_plus_integrated_difference():
    p, dtau = 2.5, TAU1 - TAU2
    common = sensors.COMMON.response(S, TAU1, TAU2)
    difference = sensors.DIFFERENCE.response(S, TAU1, TAU2)
    expected = common - p / ((S + p) * S * dtau) * difference
    np.testing.assert_allclose(
        sensors.dual(p, dtau).response(S, TAU1, TAU2), expected, rtol=1e-10
    )


def test_dual_sensor_has_no_null_below_the_first_of_the_common_arm():
    omega = 2.0 * np.pi / 20.0
    dual = sensors.dual(2.5, TAU1 - TAU2)
    common = abs(sensors.COMMON.response(1j * omega, TAU1, TAU2))
    assert abs(dual.response(1j * omega, TAU1, TAU2)) > 10.0 * common


def test_perturbations_enter_arm_by_arm():
    response = sensors.COMMON.response(S, TAU1, TAU2, c1=0.5, c2=0.0)
    np.testing.assert_allclose(response, 2.0 - 0.5 * np.exp(-S * TAU1), rtol=1e-14)


def test_weights_have_the_shape_of_the_frequency():
    m1, m2 = sensors.dual(1.0, 0.2).weights(np.ones((2, 3)))
    assert m1.shape == m2.shape == (2, 3)
    np.testing.assert_allclose(m1 + m2, 2.0)


@pytest.mark.parametrize("value", [0.0, -0.2, np.nan, np.inf])
def test_the_corner_of_the_dual_sensor_must_be_positive(value):
    with pytest.raises(ValueError, match=rf"^corner must be (positive|finite), got {value}$"):
        sensors.dual(value, 0.2)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_the_difference_of_the_dual_sensor_must_be_finite_and_not_zero(value):
    with pytest.raises(ValueError, match=r"^difference must (be finite|not be zero)"):
        sensors.dual(1.0, value)


def test_exchanging_the_arms_of_the_dual_sensor_changes_the_sign_of_the_difference():
    one = sensors.dual(1.0, 0.2).weights(S)
    other = sensors.dual(1.0, -0.2).weights(S)
    np.testing.assert_allclose(one, other[::-1], rtol=1e-14)


@pytest.mark.parametrize("name", ["tau1", "tau2"])
def test_delays_of_a_response_must_be_positive(name):
    arguments = {"tau1": 1.0, "tau2": 2.0, name: 0.0}
    with pytest.raises(ValueError, match=f"^{name} must be positive, got 0.0$"):
        sensors.COMMON.response(1j, **arguments)


def test_a_mapping_keeps_what_it_was_given():
    weights = [1.0, 2.0]
    array: Any = np.array([1.0])
    mapping = sensors.SignalMapping(weights, array, [1.0, 0.5, 0.0], "own")
    weights[0] = 50.0
    assert mapping.numerator1 == (1.0, 2.0)
    assert mapping.denominator == (1.0, 0.5)
    assert eval(repr(mapping), {"SignalMapping": sensors.SignalMapping}) == mapping
    with pytest.raises(AttributeError, match="cannot assign"):
        mapping.numerator1 = (3.0,)  # type: ignore[misc]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (
            ([1.0], [1.0], [0.0], "own"),
            ValueError,
            r"^denominator must not be zero, got \(0\.0,\)",
        ),
        (([1.0], [], [1.0], "own"), ValueError, "^numerator2 must hold at least one value"),
        (("abc", [1.0], [1.0], "own"), TypeError, "^numerator1 must hold real numbers"),
        (([np.nan], [1.0], [1.0], "own"), ValueError, "^numerator1 must be finite, got nan"),
        (([1.0], [1.0], [1.0], 3), TypeError, "^name must be a string, got 3"),
    ],
)
def test_what_is_no_mapping_is_named(arguments, error, message):
    with pytest.raises(error, match=message):
        sensors.SignalMapping(*arguments)


def test_a_response_broadcasts_and_checks_its_perturbations():
    c1 = np.array([[0.5], [0.9]])
    response = sensors.COMMON.response(S, TAU1, TAU2, c1=c1)
    assert response.shape == (2, 3)
    expected = sensors.COMMON.response(S, TAU1, TAU2, c1=0.9)
    np.testing.assert_array_equal(response[1], expected)
    with pytest.raises(ValueError, match=r"^c1 must be finite, got nan"):
        sensors.COMMON.response(S, TAU1, TAU2, c1=np.nan)
    with pytest.raises(TypeError, match=r"^s must hold numbers"):
        sensors.COMMON.weights("s")
