import numpy as np
import pytest

from armlock import (
    CommonArm,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    paper_loop,
    unstable_roots,
)
from armlock.controllers import integrating_actuator
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual

S = np.array([0.01j, 0.3 + 0.2j, -0.1 + 2j, 1.5])


def test_hayes_equation_is_written_out():
    expected = S - 0.7 + 1.3 * np.exp(-S * 2.0)
    np.testing.assert_allclose(HayesEquation(2.0)(S, 0.7, -1.3), expected, rtol=1e-14)


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
    expected = 0.4 / S * mapping.response(S, 20.1, 19.9, 0.9, 1.1)
    scale = np.abs(0.4 / S) * (1.0 + np.exp(-20.1 * S.real))
    assert (np.abs(loop.open_loop(S, 0.9, 1.1) - expected) <= 1e-12 * (1.0 + scale * 30)).all()


@pytest.mark.parametrize("mapping", [SINGLE, COMMON, DIFFERENCE, dual(2.0, 0.2)])
def test_characteristic_function_vanishes_where_the_return_difference_does(mapping):
    loop = Loop(integrating_actuator(0.4), mapping, 2.1, 1.9)
    ratio = loop(S, 0.9, 1.1) / (1.0 + loop.open_loop(S, 0.9, 1.1))
    denominator = S * np.polyval(list(mapping.denominator)[::-1], S)
    np.testing.assert_allclose(ratio, denominator, rtol=1e-11)


def test_open_loop_defaults_to_no_perturbation():
    loop = CommonArm()
    np.testing.assert_array_equal(loop.open_loop(S), loop.open_loop(S, 1.0, 1.0))


def test_dual_arm_at_zero_frequency_depends_on_the_difference_alone():
    loop = DualArm(gain=2.0, corner=0.5)
    values = loop(0.0, [1.0, 1.2, 0.9], [1.0, 1.2, 1.0]).real
    assert values[0] == pytest.approx(0.0, abs=1e-15)
    assert values[1] == pytest.approx(0.0, abs=1e-15)
    assert values[2] != pytest.approx(0.0, abs=1e-3)


def test_defaults_are_the_numbers_of_the_paper():
    loop = CommonArm()
    assert (loop.gain, loop.tau1, loop.tau2) == (1.0, 20.1, 19.9)
    assert loop.parameters == ("c1", "c2")
    assert HayesEquation().tau == 1.0
    assert HayesEquation().parameters == ("a", "b")


def test_representations_name_the_arguments():
    assert repr(HayesEquation(2.0)) == "HayesEquation(tau=2.0)"
    assert repr(SingleArm(1.0, 2.0)) == "SingleArm(gain=1.0, tau=2.0)"
    assert repr(CommonArm()) == "CommonArm(gain=1.0, tau1=20.1, tau2=19.9)"


def test_equal_delays_are_fine_where_only_roots_are_counted():
    assert unstable_roots(CommonArm(tau1=20.0, tau2=20.0), 0.9, 0.9) == 0
    assert unstable_roots(CommonArm(tau1=20.0, tau2=20.0), 1.5, 0.51) > 0


def test_equal_delays_are_refused_by_the_dual_arm():
    with pytest.raises(ValueError, match=r"^tau1 and tau2 must differ, got 20\.0 for both"):
        DualArm(tau1=20.0, tau2=20.0)


@pytest.mark.parametrize("value", ["no", 1, None, "integrating"])
def test_the_actuator_is_there_or_not(value):
    with pytest.raises(TypeError, match=rf"^actuator must be True or False, got {value!r}$"):
        paper_loop(actuator=value)
    assert paper_loop(actuator=False).neutral
    assert not paper_loop(actuator=np.True_).neutral  # type: ignore[arg-type]
