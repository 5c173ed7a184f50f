import copy
import pickle

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

MAP = semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.5, order=1)
SYSTEMS = [*RETARDED.values(), *NEUTRAL.values(), MAP]
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


def test_a_parameter_that_would_change_the_order_is_refused():
    with pytest.raises(ValueError, match=r"^b1 without a delay must be of lower degree than A"):
        CharacteristicFunction([1.0, 1.0], [0.0, 1.0], [1.0], 0.0, 1.0)
    with pytest.raises(ValueError, match=r"^b1 without a delay must be of lower degree than A"):
        CharacteristicFunction([0.5, 1.0], [0.0, 1.0], [0.0], 0.0, 0.0, step=1.0)


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
def test_a_system_is_a_value(system):
    """Its representation and copies are the same system, and none can be changed."""
    made = eval(repr(system), vars(armlock) | {"SignalMapping": SignalMapping})
    for again in (made, copy.deepcopy(system), pickle.loads(pickle.dumps(system))):
        assert type(again) is type(system)
        assert repr(again) == repr(system)
        assert again(0.1 + 0.3j, 0.9, 1.05) == system(0.1 + 0.3j, 0.9, 1.05)
        assert unstable_roots(again, 0.9, 1.05) == unstable_roots(system, 0.9, 1.05)
        for name in (*vars(system), "anything"):
            with pytest.raises(AttributeError, match=rf"cannot be changed, got {name} = 3\.0"):
                setattr(again, name, 3.0)
