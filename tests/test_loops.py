import numpy as np
import pytest

from armlock import (
    CommonArm,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    paper_loop,
)
from armlock.controllers import integrating_actuator
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, SignalMapping, dual

S = np.array([0.01j, 0.3 + 0.2j, -0.1 + 2j, 1.5])


def test_single_arm_is_the_hayes_equation_of_the_paper():
    # a = -k1 and b = k1 k2, with k1 the gain and k2 the perturbation.
    k1, k2, tau = 0.8, 0.95, 3.0
    arm = SingleArm(gain=k1, tau=tau)
    np.testing.assert_allclose(
        arm(S, k2, 0.0), HayesEquation(tau)(S, -k1, k1 * k2), rtol=1e-13, atol=1e-15
    )
    np.testing.assert_array_equal(arm(S, k2, 0.0), arm(S, k2, 5.0))


def test_common_arm_is_equation_four_of_the_paper():
    g, tau1, tau2, c1, c2 = 0.7, 2.1, 1.9, 0.9, 1.2
    expected = S + 2 * g - g * c1 * np.exp(-S * tau1) - g * c2 * np.exp(-S * tau2)
    np.testing.assert_allclose(CommonArm(g, tau1, tau2)(S, c1, c2), expected, rtol=1e-13)


@pytest.mark.parametrize("mapping", [SINGLE, COMMON, dual(2.0, 0.2)], ids=lambda m: m.name)
def test_open_loop_is_controller_times_sensor(mapping):
    loop = Loop(integrating_actuator(0.4), mapping, 20.1, 19.9)
    m1, m2 = mapping.weights(S)
    sensor = m1 * (1.0 - 0.9 * np.exp(-S * 20.1)) + m2 * (1.0 - 1.1 * np.exp(-S * 19.9))
    expected = 0.4 / S * sensor
    scale = np.abs(0.4 / S) * (1.0 + np.exp(-20.1 * S.real))
    assert (np.abs(loop.open_loop(S, 0.9, 1.1) - expected) <= 1e-12 * (1.0 + scale * 30)).all()


@pytest.mark.parametrize("mapping", [SINGLE, COMMON, DIFFERENCE, dual(2.0, 0.2)])
def test_characteristic_function_vanishes_where_the_return_difference_does(mapping):
    loop = Loop(integrating_actuator(0.4), mapping, 2.1, 1.9)
    ratio = loop(S, 0.9, 1.1) / (1.0 + loop.open_loop(S, 0.9, 1.1))
    denominator = S * np.polyval(list(mapping.denominator)[::-1], S)
    np.testing.assert_allclose(ratio, denominator, rtol=1e-11)


def test_equal_delays_are_refused_by_the_dual_arm():
    with pytest.raises(ValueError, match=r"^tau1 and tau2 must differ, got 20\.0 for both"):
        DualArm(tau1=20.0, tau2=20.0)


def test_polynomials_of_different_length_share_their_zeros_at_zero():
    # s / s in arm 1, nothing in arm 2: the same as a gain in arm 1 alone.
    cancelled = SignalMapping((0.0, 1.0), (0.0,), (0.0, 1.0), "cancelled")
    one, other = (
        Loop(((), (-1.0,), 0.5), mapping, 2.0, 1.5) for mapping in (cancelled, SINGLE)
    )
    for name in ("rest", "b1", "b2"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_zeros_in_front_of_a_denominator_do_not_make_a_loop_proper():
    padded = SignalMapping((0.0, 1.0), (0.0,), (1.0, 0.0), "padded")
    with pytest.raises(ValueError, match=r"m1 must be proper, got 1 zeros and 0 poles"):
        Loop(((), (), 1.0), padded, 2.0, 1.5)


def test_a_controller_given_as_a_triple_takes_the_actuator():
    one = paper_loop(controller=((), (-1.0,), 2.0), actuator=True)
    other = paper_loop(controller=((), (-1.0, 0.0), 2.0))
    np.testing.assert_array_equal(one.open_loop(S), other.open_loop(S))
