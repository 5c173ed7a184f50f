import pickle
import time
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.special import lambertw

from armlock import (
    CharacteristicFunction,
    CommonArm,
    DualArm,
    HayesEquation,
    Loop,
    RootError,
    SingleArm,
    paper_loop,
    rightmost_root,
    unstable_roots,
)
from armlock.loops import flight_loop
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual
from armlock.stability.roots import extended_root
from book.companion.schemes import pseudospectral_roots
from tests import independent
from tests.systems import RETARDED

gains = st.floats(0.05, 3.0)
delays = st.floats(0.2, 5.0)
reals = st.floats(-3.0, 3.0)
PAPER = paper_loop(actuator=True).controller
# Twenty-six poles over four decades.
MANY = -np.geomspace(1e-5, 4e-2, 26)


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


@given(gains, delays, delays, reals, reals)
def test_root_is_a_zero_and_the_rightmost_of_an_independent_spectrum(gain, tau1, tau2, c1, c2):
    system = CommonArm(gain, tau1, tau2)
    assume(min(abs(c1), abs(c2)) > 0.05)
    # Delayed terms that cancel leave no spectrum to collocate.
    assume(tau1 != tau2 or abs(c1 + c2) > 0.05)
    root = rightmost_root(system, c1, c2)
    assert (root.real > 0.0) == (unstable_roots(system, c1, c2) > 0)
    parts = np.abs(system.parts(root)) * [1.0, abs(c1), abs(c2)]
    assert abs(independent.value(system, root, c1, c2)) <= 1e-12 * (parts.sum() + abs(root))
    others = independent.generator_eigenvalues(system, c1, c2, 70)
    assert others.real.max() == pytest.approx(root.real, abs=1e-6 * (1.0 + abs(root)))


@pytest.mark.parametrize("name", [n for n in RETARDED if n != "no parameter"])
def test_other_loops_agree_with_count_and_independent_spectrum(name):
    system = RETARDED[name]
    for x, y in [(0.4, -0.3), (-1.2, 0.8), (1.9, 1.1)]:
        root = rightmost_root(system, x, y)
        nodes = 40 if system.longest_delay < 5.0 else 100
        others = independent.generator_eigenvalues(system, x, y, nodes)
        assert others.real.max() == pytest.approx(root.real, abs=1e-7 * (1.0 + abs(root)))
        assert (root.real > 0.0) == (unstable_roots(system, x, y) > 0)


DEADBEAT = CharacteristicFunction([0.0, 1.0], [1.0], [0.0], 1.0, 1.0, step=1.0)
OSCILLATOR = CharacteristicFunction([1.0, 0.0, 1.0], [1.0, 1.0], [1.0], 0.0, 0.0)
LOST = CharacteristicFunction(
    [-0.3585, -0.0848, -0.4575, -2.4528, 0.02115],
    [0.1308, 0.238, -0.497, 0.172, 0.10785],
    [-0.884, -1.101, 0.238, -0.477, 0.5011],
    8.848,
    3.975,
)
# Loop, point, root, and how far off it may be.
CLOSED: dict[str, tuple[Any, tuple[float, float], complex, float]] = {
    "at zero": (CommonArm(), (1.0, 1.0), 0.0, 1e-15),
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
        np.roots(LOST.a[::-1]).real.max(),
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
for gain, delay in ((1.0, 0.5), (1.0, 1.7), (0.2, 3.0)):
    root = lambertw(-gain * delay) / delay
    loop = SingleArm(gain, 20.0, delay=delay)
    CLOSED[f"an integrator with a dead time of {delay} s"] = loop, (0.0, 0.0), root, 1e-14


@pytest.mark.parametrize("name", CLOSED)
def test_roots_in_closed_form(name):
    system, point, root, off = CLOSED[name]
    assert abs(rightmost_root(system, *point) - complex(root.real, abs(root.imag))) <= off


def test_near_the_ideal_point_the_root_follows_its_expansion():
    # D = s (1 + g (tau1 + tau2)) - g d to first order, with d = c1 + c2 - 2.
    for gain in (1.0, 100.0):
        for d in (-1e-6, -1e-9, 1e-9, 1e-6):
            root = rightmost_root(CommonArm(gain=gain), 1.0 + d, 1.0)
            expected = gain * ((1.0 + d) - 1.0) / (1.0 + gain * 40.0)
            assert root.real == pytest.approx(expected, rel=2e-4, abs=1e-17)


def test_results_broadcast_and_scalars_stay_scalars():
    roots = rightmost_root(HayesEquation(), [[-1.0], [-2.0]], [-1.5, 0.5, 1.5])
    assert roots.shape == (2, 3)
    assert roots.dtype == complex
    assert roots[1, 0] == rightmost_root(HayesEquation(), -2.0, -1.5)
    assert type(rightmost_root(HayesEquation(), -1.0, -1.0)) is complex


def test_pseudospectral_roots_converge_to_lambert():
    expected = independent.hayes_roots(0.3, -2.0, branches=6)
    expected = expected[np.argsort(-expected.real)][:6]
    approximations = pseudospectral_roots(HayesEquation(), 0.3, -2.0, 60)
    for root in expected:
        assert abs(approximations - root).min() < 1e-9


def test_an_extended_root_is_lambert_to_all_its_digits():
    with mpmath.workdps(60):
        for branch in (0, 1, 2):
            exact = mpmath.lambertw(mpmath.mpf(-3.0), branch)
            found = extended_root(HayesEquation(), 0.0, -3.0, complex(exact), digits=50)
            assert abs(found - exact) < mpmath.mpf(10) ** -44


def test_a_start_far_from_every_extended_root_is_refused():
    with pytest.raises(RootError, match="not close enough"):
        extended_root(HayesEquation(), 0.0, -0.2, -300.0)


def test_a_root_that_cannot_be_certified_is_refused_at_once():
    # A chain of some 1e20 roots comes closer to its end than any walk.
    begun = time.process_time()
    with pytest.raises(RootError, match=r"^no rightmost root could be certified") as caught:
        rightmost_root(HayesEquation(), 0.0, 1e20)
    assert time.process_time() - begun < 5.0
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is RootError
    assert str(again) == str(caught.value)


def test_a_map_without_memory_has_no_root():
    with pytest.raises(ValueError, match=r"^x and y must leave a loop with roots, got \(0.0"):
        rightmost_root(DEADBEAT, 0.0, 0.0)


def test_a_dead_time_sets_the_growth_of_a_neutral_loop():
    # At high frequency 1 + L is 1 + 2 K exp(-s delay), so that |exp(s delay)| tends to 2 K.
    loop = paper_loop(delay=1e-3)
    high = 2.0 * loop.controller.gain
    assert rightmost_root(loop, 1.0, 1.0).real == pytest.approx(np.log(high) / 1e-3, rel=1e-6)


def test_a_root_next_to_zero_is_that_of_the_factored_loop():
    loop = paper_loop(actuator=True)
    with mpmath.workdps(60):
        exact = complex(
            mpmath.findroot(lambda s: independent.exact(loop, s, 1.0, 1.0), -7.1e-9)
        )
    for found in (
        rightmost_root(loop, 1.0, 1.0),
        complex(extended_root(loop, 1.0, 1.0, -7e-9)),
    ):
        assert abs(found - exact) < 1e-9 * abs(exact)


@pytest.mark.parametrize(
    ("loop", "point"),
    [
        # A flight loop, which a walk follows for half a million turns.
        (flight_loop(delay=1e-6), (1.0, 1.0)),
        # Slower than the delays by five decades, and unstable.
        (paper_loop(actuator=True, delay=1e-6), (1.000015, 1.00001)),
        # The roots tend to the limit of the chain, and none of them reaches it.
        (
            Loop((PAPER.zeros, PAPER.poles[:-1], 1e4), dual(2.5, 20.016), 30.013, 9.997),
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
    assert unstable_roots(loop.shifted(root.real + margin), *point) == 0
    with mpmath.workdps(40):
        exact = extended_root(loop, point[0], point[1], root, digits=20)
        assert abs(exact - root) <= 1e-12 * abs(root)


def test_a_root_at_zero_is_zero_from_any_start():
    # At c1 = c2 the sensor's integral has its root at s = 0.
    random = np.random.default_rng(0)
    loop = DualArm()
    for size in 10.0 ** random.uniform(-16.0, -6.0, 20):
        assert extended_root(loop, 1.0, 1.0, size * complex(*random.normal(size=2))) == 0.0
    assert rightmost_root(loop, 1.0, 1.0) == 0.0


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


@pytest.mark.parametrize("seed", [3, 8, 10])
def test_next_to_a_cluster_of_modes_it_is_answered_or_refused_in_time(seed):
    loop, begun = modes(seed), time.thread_time()
    try:
        root = rightmost_root(loop)
    except RootError:
        root = None
    assert time.thread_time() - begun < 10.0
    if root is not None:
        for margin, least, most in ((1e-6, 0, 0), (-1e-6, 1, 2)):
            shifted = loop.shifted(root.real + margin * max(abs(root.real), 0.05))
            assert least <= unstable_roots(shifted, 1.0, 1.0) <= most
        with mpmath.workdps(60):
            value, slope = (
                mpmath.diff(lambda s: independent.exact(loop, s, 1.0, 1.0), root, n)
                for n in (0, 1)
            )
        assert abs(value / slope) < 1e-12 * abs(root)


def test_next_to_a_cluster_a_root_is_that_of_the_factors():
    # Expanded, the coefficients are another loop's.
    loop = modes(13)
    root = rightmost_root(loop)
    with mpmath.workdps(60):
        exact = mpmath.findroot(lambda s: independent.exact(loop, s, 1.0, 1.0), root)
        assert abs(complex(exact) - root) < 1e-13 * abs(root)
