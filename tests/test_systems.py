"""Expressions of delays and parameters: what they mean, and what is refused."""

import copy
import inspect
import pickle
from functools import partial

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armlock
from armlock import (
    BOUNDARY,
    UNCONFINED,
    CommonArm,
    Controller,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    System,
    box_count,
    critical_perturbation,
    d_curve,
    delay,
    equation,
    first_crossing,
    margins,
    modulus_margin,
    paper_loop,
    parameter,
    peak_gain,
    rightmost_root,
    s,
    semi_discretization,
    simulate,
    stability_chart,
    stable_half_differences,
    unstable_roots,
)
from armlock.controllers import integrating_actuator
from armlock.engine.affine import basis
from armlock.engine.polynomials import polynomial
from armlock.engine.values import Quotient
from armlock.paper import TAU1, TAU2
from armlock.sensors import DIFFERENCE, SignalMapping
from tests import dense, draws, independent
from tests.systems import NEUTRAL, RETARDED, two_delays

MAP = semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.5, order=1)
KINDS = [*RETARDED.values(), *NEUTRAL.values(), MAP]
reals = st.floats(-3.0, 3.0)
frequencies = st.builds(complex, st.floats(-1.0, 1.0), st.floats(-5.0, 5.0))

KP, KI = parameter("kp"), parameter("ki")
PLANT = control.tf([1], [2, 1])
C1, C2, C3 = (parameter(name, 1.0) for name in ("c1", "c2", "c3"))


@given(st.sampled_from(KINDS), frequencies, reals, reals)
def test_the_value_of_an_equation_is_that_of_its_terms(system, s, x, y):
    d = system if system.is_equation else equation(1 + system)
    expected = independent.value(d, s, x, y)
    size = float(sum(map(abs, independent.each(d, s, x, y))))
    assert abs(d(s, x, y) - expected) <= 1e-12 * (1.0 + size)


# values, not objects ------------------------------------------------

LOOPS = [
    SingleArm(0.3, 2.0),
    CommonArm(0.5, 2.1, 1.9),
    DualArm(0.5, 2.1, 1.9, 1.3, difference=0.4),
    paper_loop(),
    Loop(Controller([-0.02], [0.0, -0.1 + 1j, -0.1 - 1j], 2.0), DIFFERENCE, 20.1, 19.9),
    Loop(([-0.1], [0.0, -3.0], 2.0), "single", 20.0, delay=20e-6),
    Loop(Controller([], [-1e-3] * 5, 1e-14), "dual", 20.1, 19.9),
]
EXPRESSIONS = [
    HayesEquation(0.7),
    MAP,
    (KP + KI / s) * PLANT * delay(4.0),
    two_delays([1.0, 0.2, 1.0], [1.0], [0.5], 1.0, 2.0),
]


@pytest.mark.parametrize("loop", LOOPS, ids=lambda loop: repr(loop)[:40])
def test_a_loop_is_a_value(loop):
    """Copies are equal to it, what its text makes has its arguments, and none can be set."""
    made = eval(repr(loop), vars(armlock) | {"SignalMapping": SignalMapping})
    copies = copy.deepcopy(loop), pickle.loads(pickle.dumps(loop))
    assert [(again, hash(again)) for again in copies] == [(loop, hash(loop))] * 2
    for again in (made, *copies):
        assert type(again) is type(loop)
        assert again.arguments == loop.arguments
        assert again(0.3j, 0.9, 1.05) == loop(0.3j, 0.9, 1.05)
        assert unstable_roots(again, 0.9, 1.05) == unstable_roots(loop, 0.9, 1.05)
    # The delays of another loop are objects of its own.
    assert made != loop
    for name in loop.arguments:
        with pytest.raises(AttributeError, match=r"loop\.replace"):
            setattr(loop, name, 3.0)


@pytest.mark.parametrize("system", EXPRESSIONS, ids=repr)
def test_an_expression_is_a_value_and_keeps_its_delay_objects(system):
    for again in (copy.deepcopy(system), pickle.loads(pickle.dumps(system))):
        assert (again, hash(again)) == (system, hash(system))
        assert again(0.3j, 0.9, 1.05) == system(0.3j, 0.9, 1.05)
        assert unstable_roots(again, 0.9, 1.05) == unstable_roots(system, 0.9, 1.05)
    assert len(repr(system)) < 500


def test_a_loop_keeps_its_delays_from_process_to_process():
    loop = CommonArm(0.3)
    again = pickle.loads(pickle.dumps(loop))
    assert len((loop * 1 + again * 1).numerator.lags) == len(loop.numerator.lags)
    assert len((loop + CommonArm(0.3)).numerator.lags) == 5


def test_one_thing_is_replaced_and_all_else_stays():
    loop = CommonArm(gain=2.0).replace(delay=20e-6)
    assert loop.replace(delay=0.0).arguments == CommonArm(gain=2.0).arguments != loop.arguments
    assert margins(loop.replace(delay=0.0), 0.9, 0.9).delay > 0.0
    faster = integrating_actuator(3.0)
    assert loop.replace(controller=faster).controller is faster
    with pytest.raises(TypeError, match="unexpected keyword argument 'dead_time'"):
        loop.replace(dead_time=0.0)
    # The sensor keeps the difference that it divides by.
    other = DualArm(tau1=21.0, difference=TAU1 - TAU2)
    assert DualArm().replace(tau1=21.0).arguments == other.arguments
    assert Loop(((), (0.0,), 1.0), "dual", 20.0, 19.0).replace(tau1=30.0).mapping.name == "dual"
    assert Loop(((), (0.0,), 1.0), "single", 20.0).replace(tau1=30.0).tau2 == 30.0
    # Two loops of one L are not one loop: what is simulated are controller and sensor.
    low_pass = SignalMapping([1.0], [0.0], [1.0, 1.0], "low pass")
    one = Loop(((), (0.0, -1.0), 1.0), "single", 20.0)
    other = Loop(((), (0.0,), 1.0), low_pass, 20.0)
    assert one(0.3j) == pytest.approx(other(0.3j), rel=1e-14)
    assert one != other


# parameters ------------------------------------------------


def test_parameters_are_given_by_place_by_name_or_are_nominal():
    loop = DualArm(gain=3.0)
    for made in (loop, loop.replace(delay=1e-3)):
        assert unstable_roots(made, c2=0.999) == unstable_roots(made, 1.0, 0.999)
    assert rightmost_root(paper_loop()) == rightmost_root(paper_loop(), 1.0, 1.0)
    for arguments, name in (({"b": -1.0}, "a"), ({"a": -1.0}, "b")):
        with pytest.raises(TypeError, match=f"^{name} must be given, or have a nominal value"):
            unstable_roots(HayesEquation(), **arguments)
    words = r"must be one of the parameters of the system \(c1, c2\), got 'c3'$"
    for make in (unstable_roots, System.at):
        with pytest.raises(TypeError, match=f"^a keyword {words}"):
            make(loop, c3=1.0)
    with pytest.raises(TypeError, match=f"^a name in start {words}"):
        first_crossing(loop, {"c3": 1.0}, (1.0, 1.0))


def test_no_start_of_a_ray_is_assumed_where_a_parameter_has_no_nominal_value():
    loop = (parameter("kp") + parameter("ki", 0.1) / s) / (s + 1) * delay(1.0)
    for start, way in (({}, (1.0, 0.0)), ({}, {"ki": 1.0}), ({"ki": 0.2}, {"kp": 1.0})):
        with pytest.raises(TypeError, match=r"^kp must be given, or have a nominal value"):
            first_crossing(loop, start, way)
    with pytest.raises(TypeError, match=r"^kp must be given"):
        critical_perturbation(loop, {"ki": 1.0})
    for short in ([], [1.0]):
        with pytest.raises(ValueError, match=r"start .* \{\} as a start is the nominal point"):
            first_crossing(loop, short, {"kp": 1.0})
    found = first_crossing(loop, {"kp": 0.5}, {"kp": 1.0})
    assert found == first_crossing(loop, (0.5, 0.1), (1.0, 0.0))


def test_a_parameter_with_the_name_of_an_argument_is_refused():
    functions = [getattr(armlock, name) for name in armlock.__all__]
    functions += [System.__call__, System.frequency_response, System.affine_in, System.at]
    signatures = [inspect.signature(f).parameters for f in functions if inspect.isfunction(f)]
    by_keyword = inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY
    names = {
        argument.name
        for arguments in signatures
        if "numbers" in arguments or "values" in arguments
        for argument in arguments.values()
        if argument.kind in by_keyword
    }
    assert {"self", "system", "loop", "omega_max", "longest", "z"} <= names
    for name in names:
        with pytest.raises(ValueError, match=f"^name must not be an argument .* '{name}'"):
            parameter(name)


def test_any_other_name_is_put_in_where_parameters_are_multiplied():
    names = "free", "numbers", "values", "name", "direction"
    for name in names:
        product = parameter(name, 2.0) * parameter("gain", 3.0) / s
        assert product(1j, **{name: 5.0}) == 15.0 / 1j
        assert unstable_roots(product, **{name: -5.0}) == 1


def test_two_nominal_values_of_one_parameter_are_refused():
    with pytest.raises(ValueError, match=r"^parameter k must have one nominal value"):
        parameter("k", 1.0) + parameter("k", 2.0)
    assert (parameter("k") + parameter("k", 2.0)).nominal == {"k": 2.0}


def test_what_is_not_affine_in_what_varies_is_counted_or_says_what_to_write():
    g = parameter("g", 1.0)
    loop = g / s * (2 - C1 * delay(20.1) - C2 * delay(19.9))
    gains, c = [0.5, 1.0, 2.0], [0.5, 1.0, 1.4]
    counts = [[unstable_roots(loop, g=one, c1=x) for one in gains] for x in c]
    assert stability_chart(loop, g=gains, c1=c).counts.tolist() == counts
    assert unstable_roots(loop, g=gains, c1=np.array(c)[:, None]).tolist() == counts
    assert len(set(np.ravel(counts))) > 1
    for ask in (critical_perturbation, lambda loop, way: first_crossing(loop, {}, way)):
        message = (
            r"^direction must .*got g, c1: .* make the product a parameter, or count along"
        )
        with pytest.raises(ValueError, match=message):
            ask(loop, {"g": 1.0, "c1": 1.0})
    # With one of them held it is a chart, and single points need nothing.
    chart = stability_chart(loop, c1=[0.5, 1.5], c2=[0.5, 1.6], g=1.0)
    expected = stability_chart(CommonArm(), [0.5, 1.5], [0.5, 1.6])
    np.testing.assert_array_equal(chart.counts, expected.counts)
    assert unstable_roots(loop, g=1.0, c1=0.5, c2=1.6) == 5
    # A gain and its product with c are a chart.
    h = parameter("h")
    single = (g - h * delay(20.1)) / s
    chart = stability_chart(single, g=[0.5, 1.0], h=[0.4, 1.2])
    for i, gain in enumerate((0.5, 1.0)):
        for k, product in enumerate((0.4, 1.2)):
            assert chart.counts[k, i] == unstable_roots(SingleArm(gain), product / gain)


@pytest.mark.parametrize("seed", range(4))
def test_charts_of_any_two_parameters_are_the_counts_at_their_points(seed):
    rng = np.random.default_rng([51, seed])
    three = sum(
        m * (1 - c * delay(tau))
        for m, c, tau in ((0.5, C1, 20.1), (0.3, C2, 19.9), (0.2, C3, 16.6))
    )
    z = delay(1.0)
    k, plant = KP + KI / s, 1 / (s + 1)
    charts = [
        ((KP + KI / s) * PLANT * delay(4.0), "kp", "ki", {}),
        (three / s * delay(0.02), "c1", "c3", {"c2": 0.9}),
        # A Smith predictor, with its parameters in the denominator too.
        (k / (1 + k * (plant - plant * z)) * plant * z, "kp", "ki", {}),
        ((parameter("u") * delay(1.0) + parameter("v") * delay(2.5)) / (s + 1), "u", "v", {}),
        # A derivative: the parameter stands before the highest power.
        ((KP + parameter("kd") * s) * delay(0.5) / (s + 1), "kd", "kp", {}),
        ((KP + parameter("kd") * s) / (s + 1), "kd", "kp", {}),
    ]
    for loop, x, y, held in charts:
        axes = {x: rng.uniform(-2.0, 3.0, 40), y: rng.uniform(-2.0, 3.0, 30)}
        chart = stability_chart(loop, **axes, **held)
        points = dict(zip((x, y), np.meshgrid(*axes.values()), strict=True))
        counts = unstable_roots(loop, **points, **held)  # type: ignore[arg-type]
        np.testing.assert_array_equal(chart.counts, counts)
        for _ in range(5):
            i, j = rng.integers(30), rng.integers(40)
            at = {name: float(v[i, j]) for name, v in points.items()}
            assert chart.counts[i, j] == unstable_roots(loop, **at, **held)


def test_a_third_arm_is_one_more_term_for_every_function():
    arms = [(0.5, C1, delay(20.1)), (0.3, C2, delay(19.9)), (0.2, C3, delay(16.6))]
    loop = 0.4 / s * delay(0.02) * sum(m * (1 - c * z) for m, c, z in arms)
    assert unstable_roots(loop) == 0
    eps = critical_perturbation(loop, {"c1": 1.0, "c3": 1.0})
    around = [unstable_roots(loop, c1=1 + e, c3=1 + e) for e in (0.999 * eps, 1.001 * eps)]
    assert around[0] == 0 < around[1] or eps == 0.0
    edge = first_crossing(loop, {"c3": 0.0}, {"c3": -1.0})
    counts = [
        unstable_roots(loop, c3=-edge.position * share) for share in (1.0 - 1e-6, 1.0 + 1e-6)
    ]
    assert counts[0] < counts[1]
    assert box_count(loop.at(c2=1.0) * (1 - 0.1 / (s + 1)), 1e-9) in (0, BOUNDARY)
    assert margins(loop).modulus > 0.0
    for call in (stable_half_differences, partial(margins, free_above=5.0)):
        with pytest.raises(TypeError, match=r"^loop must be a Loop, .*: .*its arms"):
            call(loop)  # type: ignore[arg-type]
    x, y = d_curve(loop, 0.7, c3=1.0)
    assert abs(1 + loop(0.7j, c1=float(x), c2=float(y))) < 1e-12
    with pytest.raises(TypeError, match="are those of its two arms; counts, charts, margins"):
        simulate(loop, np.zeros(100), sample_rate=1.0)  # type: ignore[arg-type]


def test_what_is_improper_zero_or_too_large_is_called_so():
    for improper in (s, 1 + s * delay(1.0), (s**2 + 1) / (s + 1)):
        with pytest.raises(
            ValueError, match=r"^system must be proper, .* denominator of degree"
        ):
            peak_gain(improper)
    k = Controller([-1.0], [-2.0, 0.0], 3.0)
    assert [unstable_roots(one) for one in (k - k, k * 0, 0 * k)] == [0, 0, 0]
    assert complex((k - k)(1j)) == 0.0
    with pytest.raises(ValueError, match=r"^controller must not be zero"):
        Loop(k - k, "single", 2.0)
    lag = control.tf([1], [1, 1])
    for pair in (control.series(lag, k), control.parallel(k, lag), control.series(k, k)):
        assert isinstance(pair, System)
    assert complex(control.series(lag, k)(1j)) == pytest.approx(complex(lag(1j)) * k(1j))
    with pytest.raises(ValueError, match=r"^system must be at most 1\.8e308 in size"):
        2**1330 * delay(1.0)


def test_what_python_control_asks_for_names_the_call():
    loop = delay(1.0) / (s + 1)
    calls = {
        r"control\.bode_plot\(L\.frequency_response\(omega\)\)": control.bode_plot,
        r"nyquist\(L, omega_max=\.\.\.\)": control.nyquist_plot,
        r"L\(0\)": lambda one: one.dcgain(),
    }
    for message, call in calls.items():
        with pytest.raises(AttributeError, match=message):
            call(loop)
        with pytest.raises(AttributeError, match=message):
            call(paper_loop())
        with pytest.raises(ValueError, match=r"characteristic_roots\(L, right_of"):
            loop.poles()
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        loop.nothing()
    with pytest.raises(ValueError, match=r"write armlock\.characteristic_roots\(L, right_of"):
        loop.poles()
    assert not hasattr(loop, "__array__")
    pair = control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    with pytest.raises(
        ValueError, match=r"return_difference\(plant, \[k1 \* delay\(h\), k2\]\)"
    ):
        pair * delay(0.5)
    with pytest.raises(ValueError, match='see the recipe "A digital controller"'):
        control.tf([1], [1, -0.5], 0.1) * loop


def test_the_package_shows_what_users_call():
    shown = set(dir(armlock))
    assert {"controllers", "sensors", "orbits", "paper", *armlock.__all__} <= shown
    inner = {"engine", "checks", "compiled", "loops", "affine", "stability", "systems"}
    assert not shown & inner
    assert all(hasattr(armlock, name) for name in shown)
    assert callable(armlock.orbits.kepler)


# one meaning ------------------------------------------------


def test_an_equation_is_no_open_loop():
    forced = equation(s**2 + 0.2 * s + 1 - parameter("k", 0.1) * delay(1.0))
    assert unstable_roots(forced) == 0
    with pytest.raises(TypeError, match=r"^loop must be an open loop L, not an equation D = 0"):
        margins(forced)
    with pytest.raises(TypeError, match="an equation D = 0 cannot be combined"):
        forced * 2
    assert repr(forced).startswith("<equation ")
    assert repr(forced).endswith(" = 0, parameters k>")
    assert repr(1 / s).startswith("<open loop ")


# delays have identity ------------------------------------------------


def test_two_arms_of_equal_length_are_two_delays_in_every_form():
    k = Controller([-1.0], [-2.0], 0.2)
    loop = Loop(k, "common", 20.0, 20.0)
    z1, z2 = delay(20.0), delay(20.0)
    written = k * ((1 - C1 * z1) + (1 - C2 * z2))
    for same in (loop, 1 * loop, loop.at(c1=5.0, c2=-4.9), written):
        values = () if "c1" not in same.nominal else (5.0, -4.9)
        assert unstable_roots(same, *values) == UNCONFINED
    one = k * (2 - (C1 + C2) * z1)
    assert unstable_roots(one, 5.0, -4.9) == 0
    # By a small change of one arm roots become unstable.
    assert unstable_roots(Loop(k, "common", 20.0, 20.001), 5.0, -4.9, right_of=1e-4) == -2


def test_a_point_alone_and_in_an_array_agree_on_equal_delays():
    x, y, dead = parameter("x"), parameter("y"), delay(0.3)
    d = 1.3 + 0.93 * s + (0.9 + 0.75 * s) * dead - x * (0.9 + 0.75 * s) * dead
    system = equation(d - y * dead * delay(2.0))
    assert unstable_roots(system, 1.0, 0.5) == unstable_roots(system, [1.0, 1.0], 0.5)[0]
    # With a delay of its own for x, equal by chance, the chain is not confined.
    d = 1.3 + 0.93 * s + (0.9 + 0.75 * s) * (dead - x * delay(0.3))
    own = equation(d - y * dead * delay(2.0))
    assert unstable_roots(own, 1.0, 0.5) == UNCONFINED
    assert unstable_roots(own, [1.0, 0.9], 0.5)[0] == UNCONFINED


def test_powers_of_one_object_take_their_magnitudes_at_high_frequency():
    """The count is -2 where the sum of magnitudes does not show that the chain is confined."""
    rng = np.random.default_rng(5)
    for _ in range(12):
        z = delay(1.0)
        p, q = rng.uniform(-0.7, 0.7, 2)
        d = equation(
            s * (1 + p * z + q * z**2) + rng.uniform(-2.0, 2.0) + rng.uniform(-3.0, 3.0) * z
        )
        count = unstable_roots(d)
        assert (count == UNCONFINED) == (abs(p) + abs(q) >= 1.0)
        if count >= 0:
            assert count == dense.winding(d, 2000.5, 2.0)
            assert rightmost_root(d).real * (1 if count else -1) > 0.0
    # (1 + 0.75 z + 0.5 z^2) has no root in the unit disc, but is not shown to have none.
    neutral = equation(s * (1 + 0.75 * z + 0.5 * z**2) + 0.5)
    assert unstable_roots(neutral) == UNCONFINED
    assert unstable_roots(neutral, right_of=0.17) == 0
    with pytest.raises(armlock.RootError, match=r"0\.16"):
        rightmost_root(neutral)


def test_chains_of_several_objects_raise_no_undocumented_error():
    z1, z2, k = delay(1.0), delay(1.3), parameter("k", 1.0)
    for e in (0.1, 2.0, 0.01, 0.3)[: draws(2, 4)]:
        d = equation(((1 + e) + z1) * ((1 + e) + z1 * z2) * (s + k))
        # (1 + e)^2 + (1 + e) z1 + (1 + e) z1 z2 + z1^2 z2
        confined = (1 + e) ** 2 > 1 + 2 * (1 + e)
        assert unstable_roots(d, k=[1.0, 2.0]).tolist() == ([0, 0] if confined else [-2, -2])
        assert unstable_roots(d) == (0 if confined else UNCONFINED)
        with pytest.raises(armlock.RootError, match="may tend to" if confined else "."):
            rightmost_root(d)


def test_delays_that_are_no_multiples_of_one_object_do_not_cancel():
    with pytest.raises(ValueError, match=r"^the system must be causal"):
        delay(1.0) / delay(0.25)
    z = delay(1.0)
    assert (z * s / z).numerator == s.numerator


# hidden modes, and the basis ------------------------------------------------


def test_what_cancels_at_low_frequency_cancels_in_the_basis():
    """Of the dual sensor it is the sum and the difference of the arms."""
    loop = paper_loop()
    found = [p.degree for p in loop.affine.space.polynomials]
    assert sorted(set(found)) == [5, 7]
    assert len(found) == 3
    chosen = basis([polynomial([1, 2, 1]), polynomial([0, 0, 1]), polynomial([3, 0, 1])])
    assert [p.degree() for p in chosen] == [2, 1, 0]
    # The one of highest order at s = 0 is kept.
    assert chosen[0] == polynomial([0, 0, 1])
    # At 1e-8 rad/s L = N / M keeps its digits.
    above, below = loop.affine_in(()).quotient()
    value, _ = Quotient([above], [below]).roughly(1e-8j, (1.0,))
    assert value == pytest.approx(complex(independent.exact(loop, 1e-8j, 1, 1) - 1), rel=1e-9)


# maps ------------------------------------------------


@pytest.mark.parametrize(
    "loop",
    [
        CommonArm(10.0),
        CommonArm(),
        DualArm(),
        Loop(Controller([], [0.0, -2.0], 1.0), "common", 20.1, 19.9),
    ],
)
@pytest.mark.parametrize("order", [0, 1])
def test_a_map_keeps_its_root_at_one(loop, order):
    made = semi_discretization(loop, 0.1, order)
    assert unstable_roots(made, 1.0, 1.0) == unstable_roots(equation(1 + loop)) == BOUNDARY
    edge = first_crossing(made, (1.0, 1.0), (-1.0, -1.0), 1e-6)
    assert edge.position == np.inf


def test_a_map_is_not_the_equation_of_its_delays():
    q = delay(1.0)
    assert unstable_roots(equation(1 - 1.2 * q, step=1.0)) == 1
    assert unstable_roots(equation(1 - 1.2 * q)) == UNCONFINED
    with pytest.raises(ValueError, match="a map must hold no s"):
        equation(s - 1.2 * q, step=1.0)
    with pytest.raises(ValueError, match="step must divide every delay"):
        equation(1 - 1.2 * q, step=0.3)


# numbers and controllers ------------------------------------------------


def test_arithmetic_is_exact_and_takes_what_engineers_have():
    controller = Controller([-1.0], [0.0], 2.0)
    loop = 2 * System.of(controller) * PLANT * delay(0.5) ** 2 - 0.1 + 0.1
    omega = np.array([0.2j, 3j])
    np.testing.assert_allclose(
        loop(omega), 2 * controller(omega) * PLANT(omega) * np.exp(-omega), rtol=1e-12
    )
    assert control.evalfr(loop, 0.2j) == loop(0.2j)
    assert unstable_roots(PLANT) == 0
    assert margins(control.tf([1], [4, 2])).gain_upper == np.inf
    assert np.isinf((1 / s)(0.0))
    with pytest.raises(TypeError, match="power must be a whole number"):
        s**0.5  # type: ignore[operator]
    np.testing.assert_allclose(((s + 1) ** -2)(omega), (omega + 1) ** -2.0)


# a parameter that is zero before the highest power of s -----------------------


def filtered(nominal=None):
    """A loop whose filter has the time constant T."""
    k, t = parameter("k", 1.0), parameter("T", nominal)
    return k * delay(1.0) / ((t * s + 1) * (s + 1))


def test_what_a_zero_leaves_at_the_highest_power_is_what_is_asked_about():
    loop, there = filtered(), filtered().at(T=0.0)
    assert unstable_roots(loop, T=0.0) == unstable_roots(there) == 0
    # A negative time constant is a fast unstable pole.
    assert unstable_roots(loop, T=[0.0, 1e-9, 0.1, -0.1]).tolist() == [0, 0, 0, 1]
    assert modulus_margin(loop, T=0.0) == modulus_margin(there)
    assert repr(margins(loop, T=0.0)) == repr(margins(there))
    assert rightmost_root(loop, T=0.0) == rightmost_root(there)
    nominal = filtered(0.0)
    assert peak_gain(1 / (1 + nominal)) == peak_gain(1 / (1 + there))
    assert critical_perturbation(nominal, {"k": 1.0}) == critical_perturbation(there, [1.0])
    improper = (parameter("k", 1.0) + parameter("q") * s**2) / (s + 1)
    assert unstable_roots(improper, q=0.0) == 0
    # With k the highest power is only delayed.
    advanced = equation(parameter("k") * s * delay(1.0) + 2)
    assert unstable_roots(advanced, [0.0, 1.0]).tolist() == [0, UNCONFINED]


def test_a_chart_has_the_column_in_which_a_time_constant_is_zero():
    gain, constant = np.linspace(0.0, 8.0, 33), np.arange(-20, 21) / 64
    chart = stability_chart(filtered(), k=gain, T=constant)
    expected = unstable_roots(filtered().at(T=0.0), gain)
    assert set(expected) == {0, 2}
    np.testing.assert_array_equal(chart.counts[20], expected)
