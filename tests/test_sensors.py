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


def test_exchanging_the_arms_of_the_dual_sensor_changes_the_sign_of_the_difference():
    one = sensors.dual(1.0, 0.2).weights(S)
    other = sensors.dual(1.0, -0.2).weights(S)
    np.testing.assert_allclose(one, other[::-1], rtol=1e-14)


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
