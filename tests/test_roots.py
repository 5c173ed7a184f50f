import contextlib
import pickle
import time
from fractions import Fraction
from typing import Any

import control
import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.special import lambertw

from armlock import (
    BOUNDARY,
    CommonArm,
    CountError,
    DualArm,
    HayesEquation,
    Loop,
    RootError,
    SingleArm,
    System,
    characteristic_roots,
    delay,
    equation,
    first_crossing,
    paper_loop,
    parameter,
    rightmost_root,
    s,
    semi_discretization,
    state_space,
    transition_matrix,
    unstable_roots,
)
from armlock.loops import flight_loop
from armlock.paper import DUAL_SENSOR_CORNER
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual
from tests import draws, independent
from tests.systems import two_delays

PAPER = paper_loop(actuator=True).controller
# Twenty-six poles over four decades.
MANY = -np.geomspace(1e-5, 4e-2, 26)


def newton_step(loop, root, *point):
    """How far Newton's method would move a root, from the factors of the loop."""
    value, slope = (
        mpmath.diff(lambda s: independent.exact(loop, s, *point), root, n) for n in (0, 1)
    )
    return abs(value / slope)


def test_acceptance_roots_of_the_hayes_equation(table):
    for row in table("hayes_roots.csv"):
        root = rightmost_root(HayesEquation(), float(row["a"]), float(row["b"]))
        for text, found in (
            (row["rightmost_real"], root.real),
            (row["rightmost_imag"], root.imag),
        ):
            digits = len(text.partition(".")[2])
            assert round(found, digits) == float(text)


def test_acceptance_roots_of_the_common_arm(table):
    for row in table("common_arm_roots.csv"):
        root = rightmost_root(CommonArm(), float(row["c1"]), float(row["c2"]))
        assert root.real == pytest.approx(float(row["rightmost_real"]), abs=1e-12)
        assert root.imag == pytest.approx(float(row["rightmost_imag"]), abs=1e-12)


@given(st.floats(-6.0, 3.0), st.floats(-8.0, 8.0), st.floats(0.1, 10.0))
def test_hayes_root_is_the_principal_branch_of_lambert(a, b, tau):
    assume(abs(b * tau * np.exp(1.0 - a) + 1.0) > 1e-3)  # away from the double root
    assume(abs(b) > 1e-3)
    root = rightmost_root(HayesEquation(tau), a / tau, b / tau)
    roots = independent.hayes_roots(a / tau, b / tau, tau, branches=30)
    expected = roots[np.argmax(roots.real)]
    assert root.real == pytest.approx(expected.real, rel=1e-9, abs=1e-9 / tau)
    assert root.imag == pytest.approx(abs(expected.imag), rel=1e-9, abs=1e-7 / tau)


DEADBEAT = equation(1 - parameter("x") * (q := delay(1.0)) * q + 0 * parameter("y"), step=1.0)
OSCILLATOR = two_delays([1.0, 0.0, 1.0], [1.0, 1.0], [1.0], 0.0, 0.0)
LOST = two_delays(
    [-0.3585, -0.0848, -0.4575, -2.4528, 0.02115],
    [0.1308, 0.238, -0.497, 0.172, 0.10785],
    [-0.884, -1.101, 0.238, -0.477, 0.5011],
    8.848,
    3.975,
)
# Loop, point, root, and how far off it may be.
CLOSED: dict[str, tuple[Any, tuple[float, float], complex, float]] = {
    "at zero": (equation(1 + CommonArm()), (1.0, 1.0), 0.0, 1e-15),
    "on the axis": (HayesEquation(), (0.0, -np.pi / 2), 0.5j * np.pi, 1e-12),
    "double": (HayesEquation(), (0.0, -np.exp(-1.0)), -1.0, 1e-5),
    "without delays": (OSCILLATOR, (-1.0, 0.3), -0.5 + 1j * np.sqrt(1.45), 1e-12),
    "without delayed signal": (CommonArm(1000.0), (0.0, 0.0), -2000.0, 0.0),
    "terms of equal delay that cancel": (CommonArm(20.0, 3.0, 3.0), (1.25, -1.25), -40.0, 0.0),
    # s + 2 + exp(-s / 4) = 0
    "a longer delay without effect": (
        CommonArm(1.0, 0.25, 4.0),
        (-1.0, 0.0),
        -2.0 + 4.0 * lambertw(-np.exp(0.5) / 4.0),
        1e-12,
    ),
    "of a map": (DEADBEAT, (0.25, 0.0), np.log(0.5), 1e-15),
    # Its chain is lost, but confined left of the real root, which is that of A alone.
    "so far right that delayed terms vanish": (
        LOST,
        (2.14, -0.5827),
        np.roots(independent.floats(LOST, 0.0, 0.0)[0.0]).real.max(),
        1e-10,
    ),
    # The arms have died out there: s = 2 K exp(-s delay).
    "where only the dead time acts": (
        Loop(([], [0.0], -5000.0), COMMON, 5.9, 5.9, delay=7e-6),
        (1.0, 0.9),
        lambertw(1e4 * 7e-6) / 7e-6,
        1e-8,
    ),
}
# s + g exp(-s delay) = 0
for gain, dead in ((1.0, 0.5), (1.0, 1.7), (0.2, 3.0)):
    root = lambertw(-gain * dead) / dead
    loop = SingleArm(gain, 20.0).replace(delay=dead)
    CLOSED[f"an integrator with a dead time of {dead} s"] = loop, (0.0, 0.0), root, 1e-14


@pytest.mark.parametrize("name", CLOSED)
def test_roots_in_closed_form(name):
    system, point, root, off = CLOSED[name]
    assert abs(rightmost_root(system, *point) - complex(root.real, abs(root.imag))) <= off


def test_results_broadcast_and_scalars_stay_scalars():
    roots = rightmost_root(HayesEquation(), [[-1.0], [-2.0]], [-1.5, 0.5, 1.5])
    assert roots.shape == (2, 3)
    assert roots.dtype == complex
    assert roots[1, 0] == rightmost_root(HayesEquation(), -2.0, -1.5)
    assert type(rightmost_root(HayesEquation(), -1.0, -1.0)) is complex


def test_a_root_that_cannot_be_certified_is_refused_at_once():
    # A chain of some 1e20 roots comes closer to its end than any walk.
    begun = time.process_time()
    with pytest.raises(RootError, match=r"^no rightmost root could be certified") as caught:
        rightmost_root(HayesEquation(), 0.0, 1e20)
    # What is compiled on the way counts too.
    assert time.process_time() - begun < 30.0
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is RootError
    assert str(again) == str(caught.value)


def test_a_neutral_loop_whose_roots_tend_to_the_limit_of_the_chain_is_refused_soon():
    # The four delays have no common period, so that no root comes close to the limit.
    delays = np.sqrt([0.1, 2.0, 3.0, 10.0])
    loop = sum(control.tf([0.2, 1.0], [1.0, 5.0]) * delay(theta) for theta in delays)
    limit = brentq(lambda x: 0.2 * np.exp(-x * delays).sum() - 1.0, -5.0, 5.0)
    begun = time.process_time()
    with pytest.raises(RootError, match="neutral root chains may tend to") as error:
        rightmost_root(loop)
    assert time.process_time() - begun < 10.0
    named = float(str(error.value).split("Re s = ")[1].split(",")[0])
    assert named == pytest.approx(limit, rel=1e-5)
    assert error.value.estimate.real < limit


def test_roots_ever_further_right_are_refused_at_once():
    """The undelayed term of the highest power is zero, but rounding leaves 1e-17 of it."""
    third, eleventh = (Fraction(1, n) * delay(t) for n, t in ((3, 0.1), (11, 0.3)))
    advanced = equation(s + 1 + s**2 * (third + eleventh))
    begun = time.process_time()
    with pytest.raises(RootError, match="what is undelayed at the highest power"):
        rightmost_root(advanced)
    assert time.process_time() - begun < 5.0


@pytest.mark.parametrize("h", [1.0, 2.0, 0.135177512, 0.13517751289353663])
def test_cubes_of_an_average_have_the_root_of_their_unit_of_time(h):
    """These were no numbers, or more of them than fit into the memory."""
    average = (1 - delay(h)) / (s * h)
    unit = (1 - delay(1.0)) / s
    scaled = h * rightmost_root(0.1 * average**3)
    assert scaled == pytest.approx(rightmost_root(0.1 * unit**3), rel=1e-9)


def test_a_map_without_memory_has_no_root():
    with pytest.raises(ValueError, match=r"^the parameters must leave a loop with roots"):
        rightmost_root(DEADBEAT, 0.0, 0.0)


def test_a_delay_of_a_map_is_its_number_of_steps_whatever_rounding_leaves():
    # As floats, 0.3 is less than three times 0.1.
    back, x = delay(0.1), parameter("x")
    for third in (delay(0.3), back**3):
        found = characteristic_roots(
            equation(1 - 0.1 * back - 0.5 * third, 0.1), right_of=-30.0
        ).values
        expected = np.log(np.roots([1.0, -0.1, 0.0, -0.5]).astype(complex)) / 0.1
        assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), rel=1e-9)
        # With x = -1 both terms are opposed to 1 at s = j pi / step.
        opposed = first_crossing(equation(1 - x * (back + third) / 2, 0.1), [0.0], [-1.0])
        assert opposed == pytest.approx((1.0, 10.0 * np.pi), rel=1e-9)


def test_a_dead_time_sets_the_growth_of_a_neutral_loop():
    # At high frequency 1 + L is 1 + 2 K exp(-s delay), so that |exp(s delay)| tends to 2 K.
    # Next to the longest delay the first dead time takes 2e7 times less.
    for late in (1e-6, 1e-3):
        loop = paper_loop(delay=late)
        high = 2.0 * loop.controller.gain
        found = rightmost_root(loop, 1.0, 1.0).real
        assert found == pytest.approx(np.log(high) / late, rel=1e-6)


def test_a_root_next_to_zero_is_that_of_the_factored_loop():
    loop = paper_loop(actuator=True)
    with mpmath.workdps(60):
        exact = complex(
            mpmath.findroot(lambda s: independent.exact(loop, s, 1.0, 1.0), -7.1e-9)
        )
    assert abs(rightmost_root(loop, 1.0, 1.0) - exact) < 1e-14 * abs(exact)


@pytest.mark.parametrize(
    ("loop", "point"),
    [
        # A flight loop, which a walk follows for half a million turns.
        (flight_loop(delay=1e-6), (1.0, 1.0)),
        # Slower than the delays by five decades, and unstable.
        (paper_loop(actuator=True, delay=1e-6), (1.000015, 1.00001)),
        # The roots tend to the limit of the chain, and none of them reaches it.
        (
            Loop((PAPER.zeros(), PAPER.poles()[:-1], 1e4), dual(2.5, 20.016), 30.013, 9.997),
            (1.0, 1.0),
        ),
        # Far up the chain, to the right of slow ones.
        (DualArm(gain=5000.0), (0.99, 1.0)),
        (DualArm(gain=5000.0), (1.00005, 1.000051)),
        (paper_loop(), (1.0 - 1e-6, 1.0)),
        # In extended precision each line took a second once.
        (Loop((MANY[1:] * 1.5, MANY, 1e-3), COMMON, 20.1, 19.9), (1.00002, 0.9996)),
    ],
)
def test_roots_far_slower_than_the_delays_or_far_up_are_certified(loop, point):
    begun = time.process_time()
    root = rightmost_root(loop, *point)
    assert time.process_time() - begun < 5.0
    margin = 1.001e-6 * max(abs(root.real), 1.0 / loop.longest_delay)
    assert unstable_roots(loop, *point, right_of=root.real + margin) == 0
    with mpmath.workdps(60):
        off = newton_step(loop, root, *point)
        assert off <= 1e-12 * abs(root)


def test_a_root_that_cancels_in_the_loop_is_none_of_its_roots():
    # At c1 = c2 the sensor's integral has its root at s = 0.
    assert rightmost_root(equation(1 + DualArm()), 1.0, 1.0) == 0.0
    loop = DualArm()
    root = rightmost_root(loop, 1.0, 1.0)
    assert unstable_roots(loop, 1.0, 1.0) == 0
    assert root.real < 0.0
    # L is a loop with the same delays, made in another way.
    s, p = control.tf([1, 0], [1]), DUAL_SENSOR_CORNER
    first, second = (1 - delay(tau) for tau in (loop.tau1, loop.tau2))
    integral = control.tf([p], [1, p]) / s / (loop.tau1 - loop.tau2)
    same = loop.controller.gain / s * (first + second + integral * (first - second))
    assert rightmost_root(same) == pytest.approx(root, rel=1e-9)


@pytest.mark.parametrize("poles", [[1j, -1j] * 2, [-2.0] * 2, [-0.5] * 3, [-1.0] * 4])
def test_a_multiple_root_is_found(poles):
    # The numerator is zero, so that the poles are the roots.
    loop = Loop(([], poles, 1.0), DIFFERENCE, 2.0, 2.0)
    root = complex(poles[0])
    assert abs(rightmost_root(loop, 0.4, 0.4) - root) < 1e-15
    assert rightmost_root(loop, 0.4, 0.4).real == root.real


def test_a_multiple_root_with_rounded_coefficients_is_a_cluster():
    # (s + 0.1)^4: four roots about 1e-5 from one another are those of the floats.
    p = [1.0, 0.4, 0.06, 0.004, 0.0001]
    root = rightmost_root(System.of(control.tf(p, [1.0, 2.0, 1.0, 4.0, 3.0])) - 1)
    with mpmath.workdps(60):
        exact = mpmath.polyroots(p[::-1], maxsteps=500, extraprec=500, asc=True)
        assert abs(root - max(exact, key=lambda s: s.real)) < 1e-15


def test_a_double_real_root_of_a_loop_with_delays():
    # 1 + L = (s + 1)^2 (s + 2 + exp(-s) / 10) / (s + 2)^3, with other roots further left.
    square = System.of(control.tf([1, 2, 1], [1]))
    loop = square * (control.tf([1, 2], [1]) + 0.1 * delay(1.0)) / control.tf([1, 2], [1]) - 1
    assert abs(rightmost_root(loop) - -1.0) < 1e-12


@pytest.mark.parametrize("gap", [-2e-15, -1e-15, 1e-15, 2e-15])
@pytest.mark.parametrize("c", [1e-10, 0.077])
def test_a_slow_root_is_on_the_side_that_the_count_says_or_refused(c, gap):
    """The expanded coefficients, rounded, would have some of them on the other side of zero."""
    loop = Loop(([-2.6], [-0.2, -0.5], -5e-3), dual(1.75, 2.2e-7), 2.0, 2.0 - 4.4e-7)
    point = c, c * (1.0 + gap)
    with contextlib.suppress(RootError):
        assert (rightmost_root(loop, *point).real > 0.0) == (unstable_roots(loop, *point) > 0)


def test_a_slow_pair_is_on_the_side_that_the_count_says_or_refused():
    modes = [
        -16.295411135280883 + 29.126440582678686j,
        -16.295411135280883 - 29.126440582678686j,
    ]
    controller = [-1.4457176246553571, -413.0038904912396], [0.0, *modes], 2.11001973771314e-11
    sensor = dual(2.5132741228718345, 1.3851322124835974e-06)
    delays = 3.317495130470978, 3.317492360206553, 0.00016504573441033512
    loop = Loop(controller, sensor, *delays[:2], delay=delays[2])
    point = 0.0029713867158988505, 0.0029713867158988475
    assert unstable_roots(loop, *point) == 1
    with contextlib.suppress(RootError):
        assert rightmost_root(loop, *point).real > 0.0


def modes(seed):
    """A loop with a cluster of lightly damped modes, next to which D is lost to rounding."""
    random = np.random.default_rng(seed)
    number, quality = int(random.integers(2, 9)), 10.0 ** random.uniform(1, 5)
    spacing, lowest = 10.0 ** random.uniform(-3, -1), 10.0 ** random.uniform(-1, 1.5)
    at = lowest * (1.0 + 0.5 * spacing * np.arange(2 * number - 1))
    both = np.array([1j, -1j])[:, None] * at - 0.5 * at / quality
    zeros, poles = both[:, 1::2].ravel(), both[:, ::2].ravel()
    mapping = [SINGLE, COMMON, DIFFERENCE, dual(2.0, 0.5)][int(random.integers(4))]
    return Loop((zeros, poles, 10.0 ** random.uniform(-3, 1)), mapping, 20.0, 19.0)


# Of the last one the expanded coefficients are another loop's.
@pytest.mark.parametrize("seed", [3, 8, 10, 13])
def test_next_to_a_cluster_of_modes_it_is_answered_or_refused_in_time(seed):
    loop, begun = modes(seed), time.thread_time()
    try:
        root = rightmost_root(loop)
    except RootError:
        root = None
    assert time.thread_time() - begun < 10.0
    assert root is not None or seed != 13
    if root is not None:
        for margin, least, most in ((1e-6, 0, 0), (-1e-6, 1, 2)):
            line = root.real + margin * max(abs(root.real), 0.05)
            assert least <= unstable_roots(loop, right_of=line) <= most
        with mpmath.workdps(60):
            assert newton_step(loop, root, 1.0, 1.0) < 1e-13 * abs(root)


@pytest.mark.parametrize("system", [CommonArm(), HayesEquation(tau=1.0)])
@pytest.mark.parametrize("ask", [unstable_roots, rightmost_root])
def test_coefficients_whose_sums_are_no_floats_are_refused(system, ask):
    for c1 in (0.9, [0.9, 0.5]):
        with np.errstate(all="raise"), pytest.raises(ValueError, match=r"below 1e\+300"):
            ask(system, c1, 1e308)


# all roots right of a line ------------------------------------------------------------------


def collocated(parts, number=70):
    """Roots of x' = sum of A_k x(t - h_k), from Chebyshev's collocation of its generator."""
    longest, size = max(parts), len(parts[0])
    node = np.cos(np.pi * np.arange(number + 1) / number)
    weight = np.r_[2.0, np.ones(number - 1), 2.0] * (-1.0) ** np.arange(number + 1)
    apart = np.subtract.outer(node, node) + np.eye(number + 1)
    slope = np.outer(weight, 1.0 / weight) / apart
    slope -= np.diag(slope.sum(axis=1))
    whole = np.kron(2.0 / longest * slope, np.eye(size))
    whole[:size] = 0.0
    for h, matrix in parts.items():
        at = 1.0 - 2.0 * h / longest
        # Lagrange's polynomials at the delay, by barycentric weights.
        off = at - node
        hit = np.abs(off) < 1e-14
        share = hit.astype(float) if hit.any() else (1.0 / weight / off)
        share = share / share.sum()
        whole[:size] += np.kron(share, matrix)
    return np.linalg.eigvals(whole)


@pytest.mark.parametrize("seed", range(draws(4, 36)))
def test_all_roots_right_of_a_line_are_those_of_a_collocation(seed):
    rng = np.random.default_rng([68, seed])
    size = int(rng.integers(1, 5))
    a = {h: rng.normal(size=(size, size)) for h in (0.0, *rng.uniform(0.2, 2.0, 2).round(3))}
    expected = collocated(a)
    expected = expected[np.argsort(-expected.real)]
    # A line between two roots, not too far left for the collocation.
    gaps = -np.diff(expected.real[:25])
    k = int(np.argmax(gaps[8:])) + 8
    line = float(expected.real[k] - 0.5 * gaps[k])
    system = state_space({h: m.tolist() for h, m in a.items()})
    found = characteristic_roots(system, right_of=line)
    assert len(found) == k + 1
    assert (np.diff(found.values.real) <= 0.0).all()
    assert found.values[0] == rightmost_root(system)
    for root in expected[: k + 1]:
        assert np.abs(found.values - root).min() < 1e-6 * (1.0 + abs(root))


def test_the_chain_of_an_arm_is_that_of_lambert_and_none_is_missing():
    found = characteristic_roots(HayesEquation(), 0.0, -1.2, right_of=-3.0)
    expected = independent.hayes_roots(0.0, -1.2, branches=6)
    expected = expected[expected.real > -3.0]
    assert len(found) == len(expected) == 8
    for root in expected:
        assert np.abs(found.values - root).min() < 1e-13
    assert found.values == pytest.approx(np.conj(found.values.reshape(4, 2)[:, ::-1]).ravel())
    assert found.time_constant[0] == pytest.approx(-1.0 / found.values[0].real)
    assert "8 roots right of Re s = -3" in str(found)
    ax = found.plot()
    assert len(np.asarray(ax.lines[0].get_ydata())) == 8


def test_hundreds_of_roots_of_a_flight_loop_are_all_listed():
    begun = time.process_time()
    loop = flight_loop()
    found = characteristic_roots(loop, right_of=-1e-3)
    assert time.process_time() - begun < 20.0
    assert len(found) == unstable_roots(loop, right_of=-1e-3) == 623
    assert found.values[0] == rightmost_root(loop)
    # The line of fewer roots, too.
    line = 0.5 * (found.values[100].real + found.values[103].real)
    fewer = characteristic_roots(loop, right_of=line)
    np.testing.assert_array_equal(fewer.values, found.values[: len(fewer)])


def test_thousands_of_roots_are_listed_in_seconds():
    begun, tau = time.process_time(), 6e3
    found = characteristic_roots(HayesEquation(tau), 0.0, -4.0, right_of=-1e-6)
    assert time.process_time() - begun < 20.0
    expected = independent.hayes_roots(0.0, -4.0, tau, branches=4000)
    assert len(found) == (expected.real > -1e-6).sum() == 7686


@pytest.mark.parametrize("number", [2, 3, 5])
def test_a_multiple_root_stands_in_the_list_as_often_as_it_is_one(number):
    multiple = (s + 1) ** number * (s + 2 + 0.1 * delay(1.0))
    found = characteristic_roots(equation(multiple), right_of=-1.9)
    assert found.values == pytest.approx([-1.0] * number, rel=1e-12)
    assert (found.radius < 1e-9).all()


def test_a_double_root_on_the_axis_that_rounding_splits_is_listed():
    """3 pi j, twice, but for the rounding of pi: NEP-PACK's `dep_double`."""
    pi = np.pi
    d = 8.0 + 5.0 * pi
    a1, a2 = 0.4 * (65 * pi + 32) / d, 9 * pi**2 * (13 + 5 * pi) / d
    b1, b2 = (260 * pi + 128 + 225 * pi**2) / (10 * d), 45 * pi**2 / d
    a3, b3 = 64.8 * pi**2 * (5 * pi + 4) / d, 8.1 * pi**2 * (40 * pi + 32 + 25 * pi**2) / d
    late = (b1 * s**2 + b2 * s + b3) * delay(1.0)
    double = equation(s**3 + a1 * s**2 + a2 * s + a3 + late)
    assert unstable_roots(double) == BOUNDARY
    found = characteristic_roots(double, right_of=-0.02).values
    assert found.size == unstable_roots(double, right_of=-0.02) == 8
    near = np.abs(found - 3j * pi) < 1e-6
    assert near.sum() == 2


def test_lightly_damped_modes_and_slow_poles_are_told_apart():
    plant = 1
    for omega in 0.05 * (1.0 + 1e-3 * np.arange(4)):
        plant = plant * control.tf([omega**2], [1.0, 2e-6 * omega, omega**2])
    modes = 1e-10 * System.of(plant) * delay(3.0)
    slow = 0.5 * delay(3.0) / (1 + s / 5e-6) ** 5
    for loop, number, off in ((modes, 8, 1e-3), (slow, 5, 1.5e-5)):
        line = rightmost_root(loop).real - off
        found = characteristic_roots(loop, right_of=line).values
        assert found.size == unstable_roots(loop, right_of=line) == number
        with mpmath.workdps(60):
            for root in found:
                value, next_to = (
                    independent.exact(loop, root * (1 + e), 1, 1) for e in (0, 1e-9)
                )
                # A step of Newton's method is far shorter than the way to another root.
                assert abs(value / (next_to - value)) * 1e-9 < 1e-8


def test_roots_without_a_delay_and_those_of_a_map():
    plain = equation((s + 1) ** 2 * (s + 3) * (s**2 + 2 * s + 5))
    found = characteristic_roots(plain, right_of=-2.0)
    assert found.values.tolist() == [-1.0, -1.0, -1 + 2j, -1 - 2j]
    sampled = semi_discretization(CommonArm(1.0, 2.0, 1.0), 0.1)
    matrix = transition_matrix(CommonArm(1.0, 2.0, 1.0), 0.5, 0.9, step=0.1)
    expected = np.linalg.eigvals(matrix)
    found = characteristic_roots(sampled, 0.5, 0.9, right_of=-5.0)
    expected = expected[np.abs(expected) > np.exp(-0.5)]
    assert len(found) == expected.size
    for z in np.exp(0.1 * found.values):
        assert np.abs(expected - z).min() < 1e-9


def test_what_is_no_list_of_roots_is_refused_with_its_reason():
    with pytest.raises(ValueError, match=r"^right_of must lie right of the limit"):
        characteristic_roots(paper_loop(), right_of=-1e-4)
    with pytest.raises(ValueError, match=r"^right_of must leave at most 10000 roots"):
        characteristic_roots(HayesEquation(tau=1e4), 0.0, -4.0, right_of=-1e-5)
    with pytest.raises(CountError, match="lies on the line Re s = 0"):
        characteristic_roots(HayesEquation(), 0.0, -np.pi / 2, right_of=0.0)
    with pytest.raises(ValueError, match=r"^parameters must be numbers"):
        characteristic_roots(HayesEquation(), [0.0, 1.0], -1.0, right_of=0.0)
    assert len(characteristic_roots(CommonArm(), right_of=0.0)) == 0


def test_a_root_that_lies_on_the_line_is_answered_by_another_line():
    tenth = equation((s + Fraction(1, 10)) * (s + 2 + 0.1 * delay(1.0)))
    # As floats, -0.1 and -1 / 10 differ by 6e-18.
    with pytest.raises((CountError, RootError), match="choose another right_of"):
        characteristic_roots(tenth, right_of=-0.1)
    assert characteristic_roots(tenth, right_of=-0.11).values == pytest.approx([-0.1])


@pytest.mark.parametrize("number", [1, 2])
def test_a_root_at_zero_is_exact_and_listed(number):
    others = s + 1 + 0.5 * delay(1.0)
    rest = characteristic_roots(equation(others), right_of=-2.5).values
    found = characteristic_roots(equation(s**number * others), right_of=-2.5).values
    assert found[:number].tolist() == [0.0] * number
    np.testing.assert_allclose(found[number:], rest, rtol=1e-12)
    assert rightmost_root(equation(s**number * others)) == 0.0
