"""Arguments that make no sense are refused: by name, with the value and the constraint."""

import datetime
import inspect
import itertools
import re
from collections.abc import Callable
from typing import Any

import control
import numpy as np
import pytest

import armlock
from armlock import CommonArm, HayesEquation, SingleArm, equation, first_crossing, paper_loop
from armlock.checks import axis, complex_array, finite_series, real_array
from armlock.controllers import integrating_actuator, roll_off, stage_one, table_two
from armlock.orbits import kepler
from armlock.performance.pulling import largest_pulling
from armlock.sensors import COMMON, SignalMapping, dual
from armlock.timedomain.discretize import warped
from armlock.timedomain.spectra import SpectrumEstimator
from tests.systems import NEUTRAL, two_delays

ARMS = CommonArm()
LASER = armlock.LaserNoise(1, 200.0)
ORBITS = kepler()
SPECTRUM = armlock.amplitude_spectrum(LASER.draw(2000), 200.0)
# Depends on no free parameter at s = 0.
FLAT = two_delays([1.0, 1.0, 1.0], [0.0, 1.0], [0.0, 1.0], 1.0, 2.0)
RUN: dict[str, Any] = {"sample_rate": 10.0, "limit": 1e6}
ARM_PAIR: dict[str, Any] = {"tau1": 20.1, "tau2": 19.9}
LOOP: dict[str, Any] = ARM_PAIR | {"delay": 0.0}
POINT: dict[str, Any] = {"c1": 1.0, "c2": 1.0}
SHAPE: dict[str, Any] = {"zeros": [], "poles": [-1.0], "gain": 1.0}
NOISE: dict[str, Any] = {"seed": 1, "sample_rate": 10.0}

# A call of everything that takes arguments, with sensible ones.
Z = armlock.delay(1.0)
CALLS: dict[Callable[..., object], dict[str, Any]] = {
    HayesEquation: {"tau": 1.0},
    SingleArm: {"gain": 1.0, "tau1": 1.0},
    CommonArm: {"gain": 1.0} | ARM_PAIR,
    armlock.DualArm: {"gain": 1.0, "corner": 2.0, "difference": 0.1} | ARM_PAIR,
    paper_loop: {"corner": 2.0, "controller": table_two(),
                 "difference": 0.1} | LOOP,
    armlock.Loop: {"controller": table_two(), "mapping": COMMON} | LOOP,
    armlock.Controller: SHAPE,
    SignalMapping: {"numerator1": [1.0], "numerator2": [1.0], "denominator": [1.0],
                    "name": "own"},
    dual: {"corner": 1.0, "difference": 0.2},
    integrating_actuator: {"gain": 1.0},
    stage_one: {"gain": 1.0},
    table_two: {"gain": 1.0, "denominator": "table"},
    COMMON.weights: {"s": 1j},
    ARMS: {"s": 1j} | POINT,
    equation(1 + ARMS): {"s": 1j} | POINT,
    armlock.unstable_roots: {"system": ARMS} | POINT,
    armlock.stability_chart: {"system": ARMS, "c1": [1.0], "c2": [1.0]},
    armlock.rightmost_root: {"system": ARMS} | POINT,
    armlock.characteristic_roots: {"system": ARMS, "right_of": 0.1} | POINT,
    armlock.stable_delays: {"system": equation(1 + Z), "z": Z, "longest": 3.0},
    armlock.d_curve: {"system": ARMS, "omega": 1.0},
    armlock.d_curve_line: {"system": ARMS},
    armlock.d_curve_branches: {"system": ARMS, "omega_max": 1.0, "points_per_turn": 24},
    first_crossing: {"system": ARMS, "start": (0.0, 0.0), "direction": (1.0, 1.0), "stop": 1.0},
    armlock.nyquist: {"loop": ARMS, "omega_max": 3.0} | POINT,
    armlock.axis_crossings: {"loop": paper_loop(), "omega_max": 3.0} | POINT,
    armlock.margins: {"loop": ARMS, "c1": 0.9, "c2": 0.9, "free_above": 1.0},
    armlock.modulus_margin: {"loop": ARMS, "c1": 0.9, "c2": 0.9},
    armlock.peak_gain: {"system": ARMS},
    armlock.varying_radius: {"loop": ARMS, "c1": 0.9, "c2": 0.9},
    armlock.critical_perturbation: {"loop": ARMS, "direction": (1.0, 1.0)},
    armlock.spectral_radius: {"system": ARMS, "step": 0.1, "order": 1} | POINT,
    armlock.transition_matrix: {"system": ARMS, "step": 0.1, "order": 1} | POINT,
    armlock.semi_discretization: {"system": ARMS, "step": 0.1, "order": 1},
    armlock.simulate: {"loop": ARMS, "noise": np.ones(9)}
    | POINT | RUN,
    armlock.Simulation: {"loop": ARMS} | RUN,
    armlock.sampled_open_loop: {"loop": ARMS, "omega": 1.0, "sample_rate": 10.0} | POINT,
    armlock.LaserNoise: {"level": 30.0} | NOISE,
    armlock.PerturbationNoise: NOISE | {"cutoff": 1e-3},
    armlock.ShapedNoise: {"seed": 1, "sample_rate": 10.0} | SHAPE,
    LASER.draw: {"samples": 3},
    LASER.asd: {"frequency": 3.0},
    LASER.sampled_asd: {"frequency": 3.0},
    armlock.amplitude_spectrum: {"series": np.ones(2000), "sample_rate": 1.0},
    armlock.flight_loop: {"mean_delay": 33.6, "half_difference": 0.255, "g2": 40.0,
                          "corner": 2.0, "delay": 0.0},
    armlock.transfer: {"loop": ARMS, "source": "arm 1", "s": 1j},
    armlock.noise_budget: {"loop": ARMS, "frequency": [1.0], "laser": LASER.asd, "shot": 1e-5,
                           "clock": 1e-12},
    warped: {"omega": 1.0, "sample_rate": 10.0},
    roll_off: {"first": 1.0, "last": 2.0, "pairs": 3, "slope": 0.5},
    armlock.delay: {"theta": 1.0},
    armlock.parameter: {"name": "k", "nominal": 1.0},
    armlock.determinant: {"matrix": [[2.0]], "at_zero": 0},
    armlock.return_difference: {"plant": [[1.0]], "controllers": [2.0], "at_zero": 0},
    armlock.state_space: {"a": [[-1.0]], "b": [1.0], "c": [1.0], "d": 0.0},
    armlock.box_count: {"loop": paper_loop(), "size": 1e-7},
    armlock.stable_half_differences: {"loop": paper_loop()},
    equation: {"d": 1 + ARMS, "step": 0.0, "at_zero": 0},
    armlock.step_response: {"system": ARMS.feedback(), "timepts": [1.0]},
    armlock.step_info: {"system": ARMS.at(c1=0.5).feedback(), "timepts": [1.0, 9.0]},
    armlock.impulse_response: {"system": ARMS.feedback(), "timepts": [1.0]},
    armlock.Simulation(ARMS, 10.0).advance: {"noise": [1.0]} | POINT,
    LASER.blocks: {"samples": 3, "size": 2},
    SPECTRUM.within: {"low": 0.1, "high": 0.3},
    SpectrumEstimator: {"sample_rate": 1.0},
    SpectrumEstimator(1.0).add: {"series": [1.0]},
    ORBITS.round_trips: {"t": 0.0, "master": 1},
    ORBITS.rates: {"t": 0.0, "master": 1},
    ORBITS.light_time: {"t": 0.0, "receiver": 1, "emitter": 2},
    kepler: {"arm_length": 2.5e9},
    largest_pulling: {"loop": CommonArm(), "common": (1.0, 0.0, 0.0)},
    armlock.pulling: {"loop": CommonArm(), "time": 1e5, "common": (1.0, 0.0, 0.0),
                      "differential": (0.0, 0.0, 0.0)},
}  # fmt: skip
MASKED = np.ma.array([1.0, 2.0], mask=[False, True])
JUNK = {
    "masked": MASKED,
    "text": "no",
    "nan": np.nan,
    "ragged": [[1.0], [1.0, 2.0]],
    "object": object(),
    "date": datetime.date(2035, 1, 1),
    "NumPy's date": np.datetime64("2035-01-01"),
    "NumPy's time span": np.timedelta64(3, "s"),
    "bytes": b"1",
}


@pytest.mark.parametrize(
    "function", CALLS, ids=lambda function: getattr(function, "__qualname__", "instance")
)
def test_what_an_argument_cannot_be_is_refused_by_its_name(function):
    arguments = CALLS[function]
    # Whatever numpy is told to do about values that underflow.
    with np.errstate(all="raise"):
        function(**arguments)
    for name, junk in itertools.product(arguments, JUNK):
        if name != "name":
            with pytest.raises((TypeError, ValueError), match=f"^{name} must "):
                function(**arguments | {name: JUNK[junk]})


def test_what_underflows_is_zero_whatever_numpy_is_told():
    """Far on the right an echo is: exp(-1e5) at times of a millisecond, or s of 1e4 rad/s."""
    loop = paper_loop()
    calls = (
        lambda: armlock.pulling(loop, 1e-3),
        lambda: armlock.transfer(loop, "laser", 1e4),
        lambda: loop(1e4),
        lambda: loop.feedback()(1e4),
        lambda: armlock.sampled_open_loop(loop, 1e-200, sample_rate=200.0),
    )
    for call in calls:
        expected = call()
        with np.errstate(all="raise"):
            assert call() == expected


def test_every_public_function_is_called_above():
    called = {getattr(function, "__name__", "") for function in CALLS}
    public = {name for name in armlock.__all__ if inspect.isfunction(getattr(armlock, name))}
    # They take no number, or have a test of what they refuse beside their own tests.
    elsewhere = {"robust_loop", "buildable_loop"}
    assert public - called == elsewhere


# Beyond that, what each argument must be: one value past the constraint.
WRONG: list[tuple[Callable[..., object], str, Any, str]] = [
    (CommonArm, "gain", 0.0, "be positive, got 0.0"),
    (paper_loop, "delay", np.array([0.1, 0.2]), "be a real number, got array([0.1, 0.2])"),
    (paper_loop, "actuator", "no", "be True or False, got 'no'"),
    (armlock.Controller, "gain", 0.0, "not be zero"),
    (armlock.Controller, "poles", (1j,), "be real or in conjugate pairs"),
    (table_two, "denominator", "x", "be one of 'table', 'printed'; got 'x'"),
    (roll_off, "last", 1.0, "be above first (1.0), got 1.0"),
    (roll_off, "slope", 1.0, "be below one, got 1.0"),
    (armlock.Loop, "controller", control.tf([1.0], [1.0, 1.0], 0.1), "be continuous"),
    (armlock.Loop, "mapping", SignalMapping([0.0], [0.0], [1.0], "none"), "not be zero"),
    (SignalMapping, "denominator", [0.0], "not be zero, got (0.0,)"),
    (dual, "difference", 0.0, "not be zero"),
    (armlock.stability_chart, "c1", [], "hold at least one value, got 0"),
    (armlock.stability_chart, "c2", [[1.0]], "be of dimension 1, got shape (1, 1)"),
    (armlock.d_curve, "system", SingleArm(), "depend on both free parameters"),
    (armlock.d_curve_line, "system", FLAT, "depend on a free parameter at s = 0"),
    (first_crossing, "start", (0.0,), "hold as many numbers as there are parameters"),
    (first_crossing, "direction", (0.0, 0.0), "not have length zero"),
    (armlock.nyquist, "loop", HayesEquation(), "be an open loop L, not an equation D = 0"),
    (armlock.unstable_roots, "c1", None, "be a number, got None"),
    (armlock.axis_crossings, "omega_max", None, "be given"),
    (armlock.spectral_radius, "system", NEUTRAL["dead time"], "be of retarded type"),
    (armlock.spectral_radius, "system", armlock.semi_discretization(ARMS, 0.1), "be in contin"),
    (armlock.transition_matrix, "step", 1e-6, "be of a size that memory holds"),
    (armlock.semi_discretization, "order", 2, "be 0 or 1, got 2"),
    (armlock.semi_discretization, "order", 1.0, "be an integer of at least 0, got 1.0"),
    (armlock.simulate, "noise", [0.0, np.nan], "be finite, got nan at index 1"),
    (armlock.simulate, "c1", np.ones(8), "be a number or have the shape of noise, (9,)"),
    (armlock.sampled_open_loop, "omega", 0.0, "be positive, got 0.0"),
    (armlock.LaserNoise, "seed", -1, "be an integer of at least 0"),
    (armlock.ShapedNoise, "poles", [1j, -1j], "lie in the left half-plane, got "),
    (LASER.draw, "samples", 10**13, "be of a size that memory holds"),
    (LASER.draw, "samples", 10**400, "be of a size that memory holds"),
    (SPECTRUM.within, "high", 0.0, "not lie below low = 0.1, got 0.0"),
    (ORBITS.round_trips, "master", 1.0, "be an integer of at least 1, got 1.0"),
    (ORBITS.rates, "master", 4, "be 1, 2 or 3, got 4"),
    (
        armlock.amplitude_spectrum,
        "series",
        np.ones(1000),
        "hold at least 1024 samples, got 1000",
    ),
    (armlock.flight_loop, "half_difference", 0.0, "not be zero"),
    (armlock.noise_budget, "frequency", [0.0, 1.0], "be positive"),
    (armlock.flight_loop, "half_difference", 33.6, "be below mean_delay"),
    (armlock.pulling, "time", [0.0, 1.0], "be positive"),
    (armlock.pulling, "time", 1e-200, "not be so short or long that its third power"),
    (armlock.pulling, "time", 1e200, "not be so short or long that its third power"),
    (armlock.pulling, "common", (1.0,), "hold nu0, gamma and alpha"),
]


@pytest.mark.parametrize(("function", "name", "value", "constraint"), WRONG)
def test_what_breaks_a_constraint_is_refused_with_it(function, name, value, constraint):
    expected = re.escape(f"{name} must {constraint}")
    with pytest.raises((TypeError, ValueError), match=f"^{expected}"):
        function(**CALLS[function] | {name: value})


@pytest.mark.parametrize("function", [ARMS, armlock.unstable_roots])
def test_arrays_broadcast_to_one_shape_or_are_refused(function):
    points = {"c1": [1.0, 2.0], "c2": [1.0, 2.0, 3.0]}
    with pytest.raises(ValueError, match=r"c1 and c2 must broadcast together, got shapes"):
        function(**CALLS[function] | points)


def test_what_is_checked_is_a_copy_but_for_a_long_series():
    given = np.array([1.0, 2.0])
    for check in (real_array, axis):
        check("x", given)[0] = 7.0
    assert given[0] == 1.0
    assert finite_series("x", given) is given


@pytest.mark.parametrize("given", [MASKED, MASKED[1], [MASKED, MASKED], [1.0, np.ma.masked]])
def test_masked_values_are_not_taken_for_others(given):
    for check in (real_array, complex_array):
        with pytest.raises(TypeError, match=r"^x must hold no masked values"):
            check("x", given)
