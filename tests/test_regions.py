"""Stable or not: proofs of instability against counts, and charts of any two parameters."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from armlock import (
    CharacteristicFunction,
    CommonArm,
    CountError,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    flight_loop,
    is_stable,
    semi_discretization,
    stability_region,
    unstable_roots,
)
from armlock.robustness.regions import proves_instability
from tests.systems import NEUTRAL, RETARDED

SYSTEMS = [*RETARDED.values(), *NEUTRAL.values(), *(s.shifted(0.01) for s in RETARDED.values())]
reals = st.floats(-3.0, 3.0)


@given(st.sampled_from(SYSTEMS), reals, reals)
def test_a_proof_agrees_with_the_count(system, x, y):
    count = int(unstable_roots(system, x, y))
    if count != -2 and proves_instability(system, x, y):
        assert count > 0
    if count != -1:
        assert bool(is_stable(system, x, y)) == (count == 0)


def test_random_loops_are_judged_as_they_are_counted():
    """Of 150 loops: no stable one is called unstable, and most unstable ones are proved so."""
    draw, proved, unstable = np.random.default_rng(1), 0, 0
    for _ in range(150):
        number = draw.integers(0, 4)
        zeros = -(10.0 ** draw.uniform(-4, 2, number)) * draw.choice([1, 1, 1, -1], number)
        poles = -(10.0 ** draw.uniform(-4, 2, number + 1)) * draw.choice([1, 1, 0], number + 1)
        mapping = draw.choice(["single", "common", "difference", "dual"])
        tau1, tau2, c1, c2 = *draw.uniform(0.5, 20.0, 2), *draw.uniform(-0.5, 1.5, 2)
        gain, delay = 10.0 ** draw.uniform(-2, 2), draw.choice([0.0, 1e-3, 0.3])
        loop = Loop((zeros, poles, gain), str(mapping), tau1, tau2, delay)
        count = int(unstable_roots(loop, c1, c2))
        found = proves_instability(loop, c1, c2)
        assert count > 0 or not found
        unstable, proved = unstable + (count > 0), proved + found
    assert unstable > 50
    assert proved > 0.6 * unstable


@pytest.mark.parametrize("delay", [1e-5, 1e-4, 1e-3])
def test_a_loop_of_too_many_unstable_roots_is_decided(delay):
    loop = flight_loop(g2=400.0, delay=delay)
    assert not is_stable(loop)
    with pytest.raises(CountError, match="steps"):
        unstable_roots(loop)


def test_what_cancels_at_zero_is_no_root_of_a_loop():
    assert is_stable(SingleArm())
    assert is_stable(DualArm(), [1.0, 1.0], [1.0, 0.995]).tolist() == [True, False]
    assert not is_stable(SingleArm().plain())
    assert not is_stable(DualArm(delay=1.0))


def test_maps_and_chains_are_judged_as_they_are_counted():
    system = semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.5)
    assert is_stable(system, [0.9, 1.2], [0.9, 1.2]).tolist() == [True, False]
    assert not is_stable(NEUTRAL["integrator"], 5.0, 5.0)
    # Without any delay D is a polynomial, here (s - 1) (s + 3) or (s + 1) (s + 3).
    for constant, stable in ((-3.0, False), (3.0, True)):
        middle = 2.0 if constant < 0.0 else 4.0
        plain = CharacteristicFunction([constant, middle, 1.0], [1.0], [1.0], 0.0, 0.0)
        assert is_stable(plain, 0.0, 0.0) == stable
    with pytest.raises(TypeError, match=r"^a must be given"):
        is_stable(HayesEquation())


def make(gain: float, dead_time: float) -> Loop:
    return SingleArm(gain, tau=20.0, delay=dead_time)


def test_a_region_is_what_each_point_is():
    gain, dead_time = [0.5, 3.0, 30.0], [0.0, 0.1, 2.0]
    region = stability_region(make, gain, dead_time, c1=0.9)
    expected = [[is_stable(make(g, t), 0.9) for g in gain] for t in dead_time]
    np.testing.assert_array_equal(region.stable, expected)
    assert region.decided.all()
    with ThreadPoolExecutor(2) as executor:
        again = stability_region(make, gain, dead_time, c1=0.9, executor=executor)
    np.testing.assert_array_equal(again.verdicts, region.verdicts)
    ax = region.plot(plt.figure().add_subplot(), cmap="viridis")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("gain", "dead time")
    assert ax.collections[0].cmap.name == "viridis"


def neutral(gain: float, pole: float) -> Loop:
    """Negative gains, and gains past the limit of the neutral root chain, occur."""
    return Loop(([-0.3], [-pole], gain), "common", 2.0, 1.5)


def conditional(gain: float, zero: float) -> Loop:
    """Stable between two gains: a double integrator beyond one of its zeros."""
    return Loop(([-zero, -zero], [0.0, 0.0, -5.0], gain), "single", 1.0, delay=0.02)


def called_backwards(family: Any, other: float, gain: float) -> Loop:
    made: Loop = family(gain, other)
    return made


@pytest.mark.parametrize(
    ("family", "gain", "other"),
    [
        (make, np.geomspace(0.1, 300.0, 25), [0.0, 0.01, 0.1]),
        (neutral, np.linspace(-1.0, 1.0, 24), [0.01, 0.1, 1.0]),
        (conditional, np.geomspace(1e-3, 1e3, 25), [0.05, 0.5, 3.0]),
    ],
)
def test_gains_decided_together_are_those_decided_one_by_one(family, gain, other):
    for c1 in (0.3, 0.9):
        found = stability_region(family, gain, other, c1=c1)
        expected = [[is_stable(family(g, value), c1) for g in gain] for value in other]
        np.testing.assert_array_equal(found.stable, expected)
        assert 0 < found.stable.sum() < found.stable.size
        again = stability_region(partial(called_backwards, family), other, gain, c1=c1)
        np.testing.assert_array_equal(again.verdicts, found.verdicts.T)


def test_what_takes_too_long_is_not_drawn_as_decided():
    region = stability_region(make, [1.0, 1e8], [0.0, 5e-9], c1=0.5)
    assert region.verdicts.tolist() == [[0, 0], [0, -1]]
    (image,) = region.plot(plt.figure().add_subplot()).images
    drawn: Any = np.ma.asarray(image.get_array())
    assert np.ma.getmaskarray(drawn).tolist() == [[False, False], [False, True]]


def test_a_function_that_makes_no_loop_is_refused():
    hayes: Any = lambda gain, tau: HayesEquation(tau)  # noqa: E731
    nothing: Any = lambda: SingleArm()  # noqa: E731
    with pytest.raises(TypeError, match=r"^loop must be a Loop"):
        stability_region(hayes, [1.0], [1.0])
    with pytest.raises(TypeError, match=r"^make_loop must take two arguments"):
        stability_region(nothing, [1.0], [1.0])
    with pytest.raises(TypeError, match=r"^make_loop must take two arguments"):
        stability_region(partial(make, dead_time=0.0), [1.0], [1.0])
