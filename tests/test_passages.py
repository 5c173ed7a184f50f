"""Stable days, passages and switches of loops in orbit, against counts and brute force."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from armlock import rightmost_root, unstable_roots
from armlock.orbits import kepler
from armlock.orbits.passages import (
    DAY,
    YEAR,
    Course,
    Hold,
    days,
    frozen_rate,
    growth,
    half_difference,
    held_range,
    largest_half,
    loops,
    lost,
    policies,
    switches,
)

KEPLER, MEAN, HELD = kepler(), 16.65, 0.0325469
LOOPS = loops()
EDGES = {name: held_range(LOOPS[name], HELD, MEAN) for name in ("flight", "paper", "robust")}
HALVES = {master: half_difference(KEPLER, master, 0.0, YEAR) for master in (1, 2, 3)}
HALF = HALVES[1]


def stable(name, ratio, held=HELD, mean=MEAN):
    loop = LOOPS[name](mean + ratio * held, mean - ratio * held, held)
    return int(unstable_roots(loop, 1.0, 1.0)) == 0


def test_a_course_finds_all_zeros_and_extremes():
    course = Course(lambda t: np.cos(2 * np.pi * t / YEAR) + 0.3, 0.0, 2 * YEAR)
    zero = np.arccos(-0.3) / (2 * np.pi) * YEAR
    assert np.allclose(course.times(), [zero, YEAR - zero, YEAR + zero, 2 * YEAR - zero])
    assert np.allclose(course.times(0.0, YEAR, 1.5 * YEAR), [YEAR + zero])
    assert course.times(1.4).size == 0
    off = course.extremes()[:, None] - 0.5 * YEAR * np.arange(5)
    assert np.abs(off).min(axis=0).max() < 1.0
    assert np.abs(off).min(axis=1).max() < 1.0
    t = np.linspace(0.0, YEAR, 100)
    tau1, tau2 = KEPLER.round_trips(t)
    assert np.abs(HALF(t) - 0.5 * (tau1 - tau2)).max() < 1e-12
    assert np.abs(HALF.times() - [8.332, 182.6285454 * DAY]).max() < 5e-3


def test_the_range_of_the_flight_loop_is_the_known_one():
    low, high = EDGES["flight"]
    assert abs(low / 0.0010107 - 1.0) < 1e-4
    assert abs(high - 2.32835) < 1e-5


@pytest.mark.parametrize("name", EDGES)
def test_an_edge_has_a_count_of_zero_inside_only(name):
    low, high = EDGES[name]
    assert stable(name, low * (1 + 1e-6))
    assert not stable(name, low * (1 - 1e-6))
    assert stable(name, high * (1 - 1e-6))
    assert not stable(name, high * (1 + 1e-6))
    # The edges depend little on the held value.
    assert not stable(name, 0.99 * low, held=0.01)
    assert stable(name, 1.01 * low, held=0.1)


def test_a_range_begins_where_the_true_value_is_held():
    def wrong(tau1, tau2, held):
        return LOOPS["flight"](tau1, tau2, -held)

    with pytest.raises(ValueError, match="stable with a true value held"):
        held_range(wrong, HELD, MEAN)
    with pytest.raises(ValueError, match="half_difference must not be zero"):
        held_range(LOOPS["flight"], 0.0, MEAN)


def test_stable_days_of_kepler_are_the_known_ones():
    holds = policies(HALF)
    for name, expected in (("flight", 365.196), ("paper", 353.191)):
        found = 365.25 - days(lost(HALF, holds["month's middle"], EDGES[name]))
        assert abs(found - expected) < 1e-3
    # A constant is of the wrong sign for half a year.
    assert 365.25 - days(lost(HALF, holds["constant"], EDGES["flight"])) < 182.63
    assert 365.25 - days(lost(HALF, holds["right sign"], EDGES["flight"])) > 365.0


@pytest.mark.parametrize("name", EDGES)
@pytest.mark.parametrize(
    "policy", ["constant", "right sign", "month's start", "month's middle"]
)
def test_lost_stretches_agree_with_counts_at_random_times(name, policy):
    holds = policies(HALF)[policy]
    gone = lost(HALF, holds, EDGES[name])
    rng = np.random.default_rng(8)
    near = [s + side * 3e3 for part in gone for s in part[:2] for side in (-1.0, 1.0)]
    times = np.concatenate((rng.uniform(0.0, YEAR, 40), near))
    for t in times[(times > 0.0) & (times < YEAR)]:
        held = next(held for start, stop, held in holds if start <= t <= stop)
        edge = min(abs(t - s) for part in gone for s in part[:2])
        if edge > 2e3:
            tau1, tau2 = map(float, KEPLER.round_trips(t))
            count = int(unstable_roots(LOOPS[name](tau1, tau2, held), 1.0, 1.0))
            assert (count != 0) == any(start < t < stop for start, stop, _ in gone)


def test_growth_is_the_integral_of_the_frozen_rate():
    held = float(HALF(170 * DAY))
    stretch = Hold(178 * DAY, 181 * DAY, held)
    times = np.linspace(stretch.start, stretch.stop, 25)
    rates = [frozen_rate(LOOPS["paper"], KEPLER, float(t), held) for t in times]
    expected = np.trapezoid(rates, times)
    assert abs(growth(LOOPS["paper"], KEPLER, HALF, stretch) / expected - 1.0) < 1e-2
    tau1, tau2 = map(float, KEPLER.round_trips(times[3]))
    assert rightmost_root(LOOPS["paper"](tau1, tau2, held), 1.0, 1.0).real == rates[3]


def test_the_largest_half_difference_is_that_of_a_fine_grid():
    size, time = largest_half(HALVES)
    t = np.linspace(0.0, YEAR, 40_001)
    grid = np.max([np.abs(half(t)) for half in HALVES.values()], axis=0)
    assert size <= grid.min() < size + 1e-5
    assert abs(max(abs(float(half(time))) for half in HALVES.values()) - size) < 1e-12


def test_switches_keep_the_half_difference_above_the_floor():
    size, _ = largest_half(HALVES)
    for share in (0.3, 0.999):
        plan = switches(HALVES, share * size)
        times = [t for t, _ in plan] + [YEAR]
        for (start, master), stop in zip(plan, times[1:], strict=True):
            t = np.linspace(start, stop, 500)
            assert np.abs(HALVES[master](t)).min() > share * size * (1 - 1e-6)
        assert all(a != b for (_, a), (_, b) in pairwise(plan))
    with pytest.raises(ValueError, match="floor must be at most"):
        switches(HALVES, 1.01 * size)
    with pytest.raises(ValueError, match="floor must be positive"):
        switches(HALVES, 0.0)
