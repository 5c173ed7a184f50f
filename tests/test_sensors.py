import numpy as np
import pytest

from armlock import Controller, Loop, sensors

OMEGA = np.array([0.01, 0.3, 2.0])
S = 1j * OMEGA
TAU1, TAU2 = 20.1, 19.9


MEAN, HALF = (TAU1 + TAU2) / 2.0, (TAU1 - TAU2) / 2.0
COMMON = 2.0 * (1.0 - np.cos(HALF * OMEGA) * np.exp(-1j * OMEGA * MEAN))
# Positive exponential of the longer arm.
DIFFERENCE = np.exp(-S * TAU1) - np.exp(-S * TAU2)
CASES = {
    # 2 j sin(tau w) exp(-j w tau) with the one-way delay tau, half the round trip.
    "single": (
        sensors.SINGLE,
        2j * np.sin(0.5 * TAU1 * OMEGA) * np.exp(-0.5j * OMEGA * TAU1),
    ),
    "common": (sensors.COMMON, COMMON),
    "difference": (sensors.DIFFERENCE, DIFFERENCE),
    "dual": (
        sensors.dual(2.5, TAU1 - TAU2),
        COMMON - 2.5 / ((S + 2.5) * S * (TAU1 - TAU2)) * DIFFERENCE,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_responses_are_those_of_table_one(name):
    sensor, expected = CASES[name]
    found = Loop(Controller((), (), 1.0), sensor, TAU1, TAU2)(S)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)


def test_exchanging_the_arms_of_the_dual_sensor_changes_the_sign_of_the_difference():
    one = sensors.dual(1.0, 0.2).weights(S)
    other = sensors.dual(1.0, -0.2).weights(S)
    np.testing.assert_allclose(one, other[::-1], rtol=1e-14)
