import numpy as np
import pytest

from armlock import (
    CommonArm,
    DualArm,
    Loop,
    SingleArm,
    paper_loop,
)
from armlock.controllers import integrating_actuator
from armlock.paper import DUAL_SENSOR_CORNER
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, SignalMapping, dual, modified_dual

MODIFIED = modified_dual(0.5 * (33.855 + 33.345), 0.5 * (33.855 - 33.345))
S = np.array([0.01j, 0.3 + 0.2j, -0.1 + 2j, 1.5])


def test_single_and_common_arm_are_the_equations_of_the_paper():
    g, tau1, tau2, c1, c2 = 0.7, 2.1, 1.9, 0.9, 1.2
    late1, late2 = g * c1 * np.exp(-S * tau1), g * c2 * np.exp(-S * tau2)
    np.testing.assert_allclose(SingleArm(g, tau1)(S, c1, 5.0), S + g - late1, rtol=1e-13)
    common = S + 2.0 * g - late1 - late2
    np.testing.assert_allclose(CommonArm(g, tau1, tau2)(S, c1, c2), common, rtol=1e-13)


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


K = ((-0.02,), (0.0, -0.1), 1.0)


def test_a_loop_of_ones_own_as_one_guesses_it():
    """Sensors by name, no tau2 without an arm 2, the paper's arms with another controller."""
    pairs = [
        (SingleArm(controller=K, tau=20.0, delay=20e-6), Loop(K, SINGLE, 20.0, 20.0, 20e-6)),
        (CommonArm(controller=K), Loop(K, "common", 20.1, 19.9)),
        (DualArm(controller=K), Loop(K, "dual", 20.1, 19.9)),
        (Loop(K, dual(DUAL_SENSOR_CORNER, 20.1 - 19.9), 20.1, 19.9), DualArm(controller=K)),
        (Loop(K, "single", tau1=20.0), Loop(K, SINGLE, 20.0, 19.0)),
        (Loop(K, "difference", 20.1, 19.9), Loop(K, DIFFERENCE, 20.1, 19.9)),
        (Loop(K, "modified dual", 33.855, 33.345), Loop(K, MODIFIED, 33.855, 33.345)),
    ]
    for one, other in pairs:
        assert one.plain() == other.plain()
        assert one.controller == other.controller


def test_what_is_missing_or_doubled_is_named():
    with pytest.raises(TypeError, match=r"^tau2 must be given: the signal mapping 'common'"):
        Loop(K, "common", tau1=20.0)
    with pytest.raises(ValueError, match=r"^mapping must be .* 'modified dual'; got 'triple'"):
        Loop(K, "triple", 20.1, 19.9)
    with pytest.raises(ValueError, match=r"^gain must be None where a controller takes"):
        CommonArm().replace(controller=K)
    assert CommonArm().replace(gain=None, controller=K) == CommonArm(controller=K)
    with pytest.raises(ValueError, match=r"^s must not be a pole of the open loop, got 0j"):
        CommonArm().open_loop([1j, 0.0])
