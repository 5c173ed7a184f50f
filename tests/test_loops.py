import control
import mpmath
import numpy as np
import pytest

from armlock import (
    CommonArm,
    Controller,
    DualArm,
    Loop,
    SingleArm,
    System,
    equation,
    margins,
    paper_loop,
    unstable_roots,
)
from armlock.controllers import integrating_actuator
from armlock.engine.functions import at
from armlock.paper import DUAL_SENSOR_CORNER
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, SignalMapping, dual, modified_dual
from tests import independent

MODIFIED = modified_dual(0.5 * (33.855 + 33.345), 0.5 * (33.855 - 33.345))
S = np.array([0.01j, 0.3 + 0.2j, -0.1 + 2j, 1.5])


def test_single_and_common_arm_are_the_equations_of_the_paper():
    g, tau1, tau2, c1, c2 = 0.7, 2.1, 1.9, 0.9, 1.2
    late1, late2 = g * c1 * np.exp(-S * tau1), g * c2 * np.exp(-S * tau2)
    single = equation(1 + SingleArm(g, tau1))(S, c1, 5.0)
    np.testing.assert_allclose(single, S + g - late1, rtol=1e-13)
    common = S + 2.0 * g - late1 - late2
    found = equation(1 + CommonArm(g, tau1, tau2))(S, c1, c2)
    np.testing.assert_allclose(found, common, rtol=1e-13)


@pytest.mark.parametrize("mapping", [SINGLE, COMMON, DIFFERENCE, dual(2.0, 0.2)])
def test_characteristic_function_vanishes_where_the_return_difference_does(mapping):
    loop = Loop(integrating_actuator(0.4), mapping, 2.1, 1.9)
    ratio = equation(1 + loop)(S, 0.9, 1.1) / (1.0 + loop(S, 0.9, 1.1))
    denominator = S * np.polyval(list(mapping.denominator)[::-1], S)
    np.testing.assert_allclose(ratio, denominator, rtol=1e-11)


def test_equal_delays_are_refused_by_the_dual_arm():
    with pytest.raises(ValueError, match=r"^difference must not be zero"):
        DualArm(tau1=20.0, tau2=20.0)


def test_polynomials_of_different_length_share_their_zeros_at_zero():
    # s / s in arm 1, nothing in arm 2: the same as a gain in arm 1 alone.
    cancelled = SignalMapping((0.0, 1.0), (0.0,), (0.0, 1.0), "cancelled")
    one, other = (
        Loop(((), (-1.0,), 0.5), mapping, 2.0, 1.5) for mapping in (cancelled, SINGLE)
    )
    np.testing.assert_array_equal(one(S, 0.9), other(S, 0.9))
    assert [p.degree for p in (one.numerator, one.denominator)] == [0, 1]


def test_zeros_in_front_of_a_denominator_do_not_make_a_loop_proper():
    padded = SignalMapping((0.0, 1.0), (0.0,), (1.0, 0.0), "padded")
    with pytest.raises(ValueError, match=r"m1 must be proper, got 1 zeros and 0 poles"):
        Loop(((), (), 1.0), padded, 2.0, 1.5)


def test_a_controller_given_as_a_triple_takes_the_actuator():
    one = paper_loop(controller=((), (-1.0,), 2.0), actuator=True)
    other = paper_loop(controller=((), (-1.0, 0.0), 2.0))
    np.testing.assert_array_equal(one(S), other(S))


K = ((-0.02,), (0.0, -0.1), 1.0)


def test_a_loop_of_ones_own_as_one_guesses_it():
    """Sensors by name, and no tau2 without an arm 2."""
    pairs = [
        (Loop(K, "single", 20.0, delay=20e-6), Loop(K, SINGLE, 20.0, 20.0, delay=20e-6)),
        (SingleArm(tau1=20.0).replace(tau1=19.0), Loop(((), (0.0,), 1.0), SINGLE, 19.0)),
        (Loop(K, "common", 20.1, 19.9), Loop(K, COMMON, 20.1, 19.9)),
        (Loop(K, "dual", 20.1, 19.9), Loop(K, dual(DUAL_SENSOR_CORNER, 0.2), 20.1, 19.9)),
        (Loop(K, "single", tau1=20.0), Loop(K, SINGLE, 20.0, 19.0)),
        (Loop(K, "difference", 20.1, 19.9), Loop(K, DIFFERENCE, 20.1, 19.9)),
        (Loop(K, "modified dual", 33.855, 33.345), Loop(K, MODIFIED, 33.855, 33.345)),
    ]
    for one, other in pairs:
        assert one.controller == other.controller
        np.testing.assert_allclose(one(S, 0.9, 1.1), other(S, 0.9, 1.1), rtol=1e-12)


PLANT = control.tf([1.0], [1.0, 1.0])


def test_a_loop_is_combined_as_any_system_with_delays():
    s = np.array([0.3j, 1.0 + 2j])
    for loop in (CommonArm().replace(delay=1e-3), Loop(K, "dual", 20.1, 19.9)):
        pairs = [
            (loop * PLANT, loop(s) * PLANT(s)),
            (PLANT * loop, loop(s) * PLANT(s)),
            (control.series(loop, PLANT), loop(s) * PLANT(s)),
            (control.parallel(PLANT, loop), loop(s) + PLANT(s)),
            (2.0 * loop - 1, 2.0 * loop(s) - 1.0),
            (1 / (1 + loop), 1.0 / (1.0 + loop(s))),
            (loop.feedback(), loop(s) / (1.0 + loop(s))),
            (control.feedback(loop, PLANT), loop(s) / (1.0 + PLANT(s) * loop(s))),
            (loop.at(c1=0.9, c2=1.2), loop(s, 0.9, 1.2)),
        ]
        for system, expected in pairs:
            np.testing.assert_allclose(system(s), expected, rtol=1e-10)
        same = System.of(loop)
        assert unstable_roots(same) == unstable_roots(loop) == 0
        assert margins(same).phase == pytest.approx(margins(loop).phase, rel=1e-6)
        np.testing.assert_array_equal(loop.frequency_response([0.3])(0.3j), loop(0.3j))


@pytest.mark.parametrize("arm", [SingleArm, CommonArm, DualArm])
@pytest.mark.parametrize("controller", [Controller(*K), K, PLANT])
def test_a_controller_in_place_of_a_gain_is_told_what_to_write(arm, controller):
    with pytest.raises(TypeError, match=r"(?s)^gain must .* write Loop\(controller, "):
        arm(controller, 20.0)


def test_what_is_missing_is_named():
    with pytest.raises(TypeError, match=r"^mapping must be .* as in Loop\(controller, 's"):
        Loop(K, 20.0, 20.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^tau2 must be given: the signal mapping 'common'"):
        Loop(K, "common", tau1=20.0)
    with pytest.raises(TypeError, match=r"positional arguments but 6 were given"):
        Loop(K, "common", 16.7, 16.5, 16.1)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match=r"^mapping must be .* 'modified dual'; got 'triple'"):
        Loop(K, "triple", tau1=20.0)
    assert np.isinf(DualArm()([1j, 0.0])).tolist() == [False, True]


def test_next_to_equal_parameters_the_response_keeps_its_digits():
    """There the integrated difference of the dual arm is small beside the two signals."""
    c1, c2, omega = 0.5, 0.5 + 2.0**-38, 1e-14
    loop = DualArm(gain=1.0, corner=0.7)
    with mpmath.workdps(50):
        expected = complex(independent.exact(loop, mpmath.mpc(0, omega), c1, c2) - 1)
    above, below = at(loop.affine.quotient(c1, c2), [omega])
    assert (above / below)[0] == pytest.approx(expected, rel=1e-12)
