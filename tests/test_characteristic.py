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
    margins,
    paper_loop,
    rightmost_root,
    semi_discretization,
    unstable_roots,
)
from armlock.sensors import DIFFERENCE, SignalMapping
from armlock.stability import last_frequency
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
    SingleArm(controller=([-0.1], [0.0, -3.0], 2.0), tau=20.0, delay=20e-6),
    Loop(Controller([], [-1e-3] * 5, 1e-14), "dual", 20.1, 19.9),
    Loop(Controller([], [0.0], 1.0), "single", tau1=20.0),
    CharacteristicFunction([1.0, 0.2, 1.0], [1.0], [0.5], 1.0, 2.0, parameters=("k", "d")),
]


@pytest.mark.parametrize("system", SYSTEMS_OF_ALL_KINDS, ids=lambda system: repr(system)[:40])
def test_a_system_is_a_value(system):
    """Its representation and copies are equal to it, and none can be changed."""
    hash(system)  # which is pickled along
    made = eval(repr(system), vars(armlock) | {"SignalMapping": SignalMapping})
    copies = made, copy.deepcopy(system), pickle.loads(pickle.dumps(system)), system.replace()
    for again in copies:
        assert type(again) is type(system)
        assert repr(again) == repr(system)
        assert (again, hash(again)) == (system, hash(system))
        assert not again.rest.flags.writeable
        assert not again.polynomials()[0].roots.flags.writeable
        assert again(0.1 + 0.3j, 0.9, 1.05) == system(0.1 + 0.3j, 0.9, 1.05)
        assert unstable_roots(again, 0.9, 1.05) == unstable_roots(system, 0.9, 1.05)
        for name in (*vars(system), "anything"):
            with pytest.raises(AttributeError, match=rf"cannot be changed, got {name} = 3\.0"):
                setattr(again, name, 3.0)


def test_one_thing_is_replaced_and_all_else_stays():
    loop = CommonArm(gain=2.0, delay=20e-6)
    assert loop.replace(delay=0.0) == CommonArm(gain=2.0) != loop
    assert margins(loop.replace(delay=0.0), 0.9, 0.9).delay > 0.0
    assert hash(loop.replace(gain=3.0)) != hash(loop)
    if hasattr(copy, "replace"):
        assert copy.replace(loop, gain=3.0) == loop.replace(gain=3.0)
    with pytest.raises(TypeError, match="unexpected keyword argument 'dead_time'"):
        loop.replace(dead_time=0.0)
    # By default the sensor's dtau follows the delays; one that is given does not.
    assert DualArm().replace(tau1=21.0) == DualArm(tau1=21.0)
    assert DualArm(difference=0.4).replace(tau1=21.0).difference == 0.4
    assert Loop(((), (0.0,), 1.0), "single", 20.0).replace(tau1=30.0).tau2 == 30.0
    # Two loops of one D are not one loop: what is simulated are controller and sensor.
    low_pass = SignalMapping([1.0], [0.0], [1.0, 1.0], "low pass")
    one = Loop(((), (0.0, -1.0), 1.0), "single", 20.0)
    other = Loop(((), (0.0,), 1.0), low_pass, 20.0)
    assert (one.rest == other.rest).all()
    assert one != other
    assert one.plain() == other.plain()


def test_results_are_kept_for_equal_loops():
    kept = last_frequency.__globals__["_squares"]
    last_frequency(CommonArm(gain=0.123), 0.9, 0.9)
    before = kept.cache_info().misses
    last_frequency(CommonArm(gain=0.123), 0.8, 0.9)
    assert kept.cache_info().misses == before


def test_the_perturbations_of_a_loop_are_one_by_default():
    loop = DualArm(gain=3.0)
    for made in (loop, loop.replace(delay=1e-3), loop.shifted(-1e-3), loop.exchanged()):
        assert unstable_roots(made, y=0.999) == unstable_roots(made, 1.0, 0.999)
        assert made(0.1j) == made(0.1j, 1.0, 1.0)
    assert rightmost_root(paper_loop()) == rightmost_root(paper_loop(), 1.0, 1.0)
    for name, arguments in (("a", {"y": -1.0}), ("b", {"x": -1.0})):
        with pytest.raises(TypeError, match=f"^{name} must be given"):
            unstable_roots(HayesEquation(), **arguments)
