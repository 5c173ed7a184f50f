import copy
import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armlock
from armlock import (
    CommonArm,
    Controller,
    DelayEquation,
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
from armlock.controllers import integrating_actuator
from armlock.paper import TAU1, TAU2
from armlock.sensors import DIFFERENCE, SignalMapping
from tests import independent
from tests.systems import NEUTRAL, RETARDED

MAP = semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.5, order=1)
SYSTEMS = [*RETARDED.values(), *NEUTRAL.values(), MAP]
reals = st.floats(-3.0, 3.0)
frequencies = st.builds(complex, st.floats(-1.0, 1.0), st.floats(-5.0, 5.0))


@given(st.sampled_from(SYSTEMS), frequencies, reals, reals)
def test_value_is_the_definition(system, s, x, y):
    found, expected = system.characteristic(s, x, y), independent.value(system, s, x, y)
    assert abs(found - expected) <= 1e-13 * (1.0 + independent.size(system, s, x, y))


def test_a_parameter_that_would_change_the_order_is_refused():
    with pytest.raises(ValueError, match=r"^b1 without a delay must be of lower degree than A"):
        DelayEquation([1.0, 1.0], [0.0, 1.0], [1.0], 0.0, 1.0)
    with pytest.raises(ValueError, match=r"^b1 without a delay must be of lower degree than A"):
        DelayEquation([0.5, 1.0], [0.0, 1.0], [0.0], 0.0, 0.0, step=1.0)


SYSTEMS_OF_ALL_KINDS = [
    HayesEquation(0.7),
    SingleArm(0.3, 2.0),
    CommonArm(0.5, 2.1, 1.9),
    DualArm(0.5, 2.1, 1.9, 1.3, difference=0.4),
    paper_loop(),
    Loop(Controller([-0.02], [0.0, -0.1 + 1j, -0.1 - 1j], 2.0), DIFFERENCE, 20.1, 19.9),
    semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.5),
    Loop(([-0.1], [0.0, -3.0], 2.0), "single", 20.0, delay=20e-6),
    Loop(Controller([], [-1e-3] * 5, 1e-14), "dual", 20.1, 19.9),
    Loop(Controller([], [0.0], 1.0), "single", tau1=20.0),
    DelayEquation([1.0, 0.2, 1.0], [1.0], [0.5], 1.0, 2.0, parameters=("k", "d")),
]


@pytest.mark.parametrize("system", SYSTEMS_OF_ALL_KINDS, ids=lambda system: repr(system)[:40])
def test_a_system_is_a_value(system):
    """Its representation and copies are equal to it, and no field can be changed."""
    made = eval(repr(system), vars(armlock) | {"SignalMapping": SignalMapping})
    for again in (made, copy.deepcopy(system), pickle.loads(pickle.dumps(system))):
        assert type(again) is type(system)
        assert (again, hash(again)) == (system, hash(system))
        assert again.characteristic(0.3j, 0.9, 1.05) == system.characteristic(0.3j, 0.9, 1.05)
        assert unstable_roots(again, 0.9, 1.05) == unstable_roots(system, 0.9, 1.05)
    for field in dataclasses.fields(system):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(system, field.name, 3.0)


def test_one_thing_is_replaced_and_all_else_stays():
    loop = CommonArm(gain=2.0, delay=20e-6)
    assert loop.replace(delay=0.0) == CommonArm(gain=2.0) != loop
    assert margins(loop.replace(delay=0.0), 0.9, 0.9).delay > 0.0
    faster = integrating_actuator(3.0)
    again = loop.replace(controller=faster)
    assert dataclasses.replace(loop, controller=faster) == again != loop
    if hasattr(copy, "replace"):
        assert copy.replace(loop, tau1=3.0) == loop.replace(tau1=3.0)
    with pytest.raises(TypeError, match="unexpected keyword argument 'dead_time'"):
        loop.replace(dead_time=0.0)
    # The sensor keeps the difference that it divides by.
    assert DualArm().replace(tau1=21.0) == DualArm(tau1=21.0, difference=TAU1 - TAU2)
    assert Loop(((), (0.0,), 1.0), "dual", 20.0, 19.0).replace(tau1=30.0).mapping.name == "dual"
    assert Loop(((), (0.0,), 1.0), "single", 20.0).replace(tau1=30.0).tau2 == 30.0
    # Polynomials keep roots that are known.
    plain = paper_loop().plain()
    assert plain.replace(tau1=21.0).rest.roots == plain.rest.roots
    # Two loops of one D are not one loop: what is simulated are controller and sensor.
    low_pass = SignalMapping([1.0], [0.0], [1.0, 1.0], "low pass")
    one = Loop(((), (0.0, -1.0), 1.0), "single", 20.0)
    other = Loop(((), (0.0,), 1.0), low_pass, 20.0)
    np.testing.assert_array_equal(one.rest.coefficients, other.rest.coefficients)
    assert one != other


def test_the_perturbations_of_a_loop_are_one_by_default():
    loop = DualArm(gain=3.0)
    for made in (loop, loop.replace(delay=1e-3)):
        assert unstable_roots(made, c2=0.999) == unstable_roots(made, 1.0, 0.999)
        assert made.characteristic(0.1j) == made.characteristic(0.1j, 1.0, 1.0)
    assert rightmost_root(paper_loop()) == rightmost_root(paper_loop(), 1.0, 1.0)
    for name, arguments in (("a", {"c2": -1.0}), ("b", {"c1": -1.0})):
        with pytest.raises(TypeError, match=f"^{name} must be given"):
            unstable_roots(HayesEquation(), **arguments)
