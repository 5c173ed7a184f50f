import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armlock
from armlock import (
    CharacteristicFunction,
    CommonArm,
    Controller,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    paper_loop,
    semi_discretization,
    unstable_roots,
)
from armlock.sensors import DIFFERENCE, SignalMapping
from tests import independent
from tests.systems import NEUTRAL, RETARDED

SYSTEMS = [*RETARDED.values(), *NEUTRAL.values()]
reals = st.floats(-3.0, 3.0)
frequencies = st.builds(complex, st.floats(-1.0, 1.0), st.floats(-5.0, 5.0))


@given(st.sampled_from(SYSTEMS), frequencies, reals, reals)
def test_value_is_the_definition(system, s, x, y):
    a, b1, b2 = system.parts(s)
    scale = abs(a) + abs(x * b1) + abs(y * b2)
    assert abs(system(s, x, y) - independent.value(system, s, x, y)) <= 1e-13 * (1.0 + scale)
    assert abs(system(s, x, y) - (a - x * b1 - y * b2)) <= 1e-13 * (1.0 + scale)


@given(st.sampled_from(SYSTEMS), frequencies, reals, reals)
def test_derivative_agrees_with_a_central_difference(system, s, x, y):
    step = 1e-5
    difference = (system(s + step, x, y) - system(s - step, x, y)) / (2.0 * step)
    scale = sum(abs(part) for part in system.parts(s)) * (1.0 + system.longest_delay) ** 3
    assert abs(system.derivative(s, x, y) - difference) <= 1e-8 * (scale + 10.0)


@given(st.sampled_from(SYSTEMS), frequencies, reals, reals, st.floats(-0.5, 0.5))
def test_shifting_moves_the_argument(system, s, x, y, sigma):
    scale = sum(abs(part) for part in system.parts(s + sigma)) * (1.0 + abs(x) + abs(y))
    moved = system.shifted(sigma)(s, x, y)
    assert abs(moved - system(s + sigma, x, y)) <= 1e-12 * (1.0 + scale)


@given(st.sampled_from(SYSTEMS), frequencies, reals, reals)
def test_exchanging_swaps_the_parameters(system, s, x, y):
    exchanged = system.exchanged()
    assert exchanged(s, y, x) == pytest.approx(system(s, x, y), rel=1e-12, abs=1e-12)
    assert exchanged.parameters == system.parameters[::-1]


def test_a_map_shifts_and_differentiates_like_a_loop():
    system = semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.5, order=1)
    s, step = 0.1 + 0.7j, 1e-6
    assert system.shifted(0.2)(s, 0.4, 0.3) == pytest.approx(system(s + 0.2, 0.4, 0.3))
    difference = (system(s + step, 0.4, 0.3) - system(s - step, 0.4, 0.3)) / (2.0 * step)
    assert system.derivative(s, 0.4, 0.3) == pytest.approx(difference, rel=1e-8)


@pytest.mark.parametrize("system", SYSTEMS, ids=repr)
def test_exponential_sums_are_the_parts_on_the_axis(system):
    omega = np.array([0.0, 0.3, 1.7, 11.0])
    for term, part in zip(system.on_boundary(), system.parts(1j * omega), strict=True):
        value = sum(
            weight * np.polyval(p.coefficients[::-1], 1j * omega) * np.exp(1j * phase * omega)
            for row, phase in zip(term.weights, term.phases, strict=True)
            for weight, p in zip(row, term.polynomials, strict=True)
        )
        np.testing.assert_allclose(value, part, rtol=1e-12, atol=1e-12)


def test_near_the_ideal_point_little_is_lost_to_cancellation():
    # D(s; 1, 1) / s tends to 1 + g (tau1 + tau2) as s goes to zero.
    s = 1e-13
    assert CommonArm(gain=100.0)(s, 1.0, 1.0) / s == pytest.approx(4001.0, rel=1e-9)


SYSTEMS_OF_ALL_KINDS = [
    HayesEquation(0.7),
    SingleArm(0.3, 2.0),
    CommonArm(0.5, 2.1, 1.9),
    DualArm(0.5, 2.1, 1.9, 1.3, difference=0.4),
    paper_loop(),
    Loop(Controller([-0.02], [0.0, -0.1 + 1j, -0.1 - 1j], 2.0), DIFFERENCE, 20.1, 19.9),
    semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.5),
    CommonArm().exchanged(),
    CharacteristicFunction([1.0, 0.2, 1.0], [1.0], [0.5], 1.0, 2.0, parameters=("k", "d")),
]


@pytest.mark.parametrize("system", SYSTEMS_OF_ALL_KINDS, ids=lambda system: repr(system)[:40])
class TestSystemsAreValues:
    def test_a_representation_makes_the_same_system_again(self, system):
        again = eval(repr(system), vars(armlock) | {"SignalMapping": SignalMapping})
        assert type(again) is type(system)
        assert repr(again) == repr(system)
        s = 0.1 + 0.3j
        assert again(s, 0.9, 1.05) == system(s, 0.9, 1.05)
        assert again.step == system.step
        assert again.parameters == system.parameters

    def test_attributes_cannot_be_changed(self, system):
        for name in (*vars(system), "anything"):
            with pytest.raises(AttributeError, match=rf"cannot be changed, got {name} = 3\.0"):
                setattr(system, name, 3.0)

    def test_copies_count_the_same_and_cannot_be_changed(self, system):
        for again in (copy.deepcopy(system), pickle.loads(pickle.dumps(system))):
            assert unstable_roots(again, 0.9, 1.05) == unstable_roots(system, 0.9, 1.05)
            assert repr(again) == repr(system)
            with pytest.raises(AttributeError, match="cannot be changed"):
                again.delay1 = 3.0


def test_a_list_given_for_a_polynomial_may_change_afterwards():
    b1 = [0.1, 0.0]
    reused = np.array([1.0, 1.0])
    system = CharacteristicFunction(reused, b1, [0.1], 1.0, 2.0)
    b1[0], reused[0] = 50.0, -3.0
    assert system.b1.tolist() == [0.1]
    assert system.rest.tolist() == [1.0, 1.0]
