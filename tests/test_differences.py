"""Whole ranges of differences of the round trips, against counts."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import Controller, Loop, stable_half_differences, unstable_roots
from armlock.sensors import COMMON, dual, modified_dual
from tests import draws


def stable_at(loop, halves):
    mean = 0.5 * (loop.tau1 + loop.tau2)
    return [unstable_roots(loop.replace(tau1=mean + x, tau2=mean - x)) == 0 for x in halves]


# Stable at both ends of the range, and not in its middle.
WINDOW = Loop(
    Controller([-8.869, -0.27852], [-1.1331e-4, -8.0668e-4], 0.37974),
    dual(0.14950848923819066, 2 * 2.17709),
    11.32828 + 2.17709,
    11.32828 - 2.17709,
)


def test_a_range_ends_before_an_unstable_window():
    """From either side of the window the range reaches its edge, and not across."""
    for held, side in ((1.737, 1), (5.436, 0)):
        mean = 11.32828
        loop = WINDOW.replace(tau1=mean + held, tau2=mean - held)
        edge = stable_half_differences(loop)[side]
        assert 1.737 < edge < 5.436
        outwards = edge + (1e-6 if side else -1e-6)
        assert stable_at(loop, [held, edge, outwards]) == [True, True, False]


def drawn(rng):
    """Return a loop."""
    mean = 10 ** rng.uniform(-1, 1.3)
    held = mean * 10 ** rng.uniform(-2.5, -0.3)
    sensors = COMMON, dual(10 ** rng.uniform(-1, 1), 2 * held), modified_dual(mean, held)
    number = rng.integers(1, 5)
    poles, zeros = (-(10 ** rng.uniform(-4, 2, number - k)) for k in (0, rng.integers(2)))
    if rng.random() < 0.3:
        poles[0] = 0.0
    controller = Controller(zeros, poles, 10 ** rng.uniform(-1, 1.7))
    delay = rng.choice([0.0, mean * 10 ** rng.uniform(-4, -1)])
    return Loop(controller, sensors[rng.integers(3)], mean + held, mean - held, delay=delay)


def test_a_range_is_stable_at_random_differences_and_ends_where_a_root_crosses():
    rng = np.random.default_rng(7)
    ends = []
    for _ in range(draws(9, 60)):
        loop = drawn(rng)
        if unstable_roots(loop) != 0:
            with pytest.raises(ValueError, match="stable as it is"):
                stable_half_differences(loop)
            continue
        mean = 0.5 * (loop.tau1 + loop.tau2)
        low, high = stable_half_differences(loop)
        assert all(stable_at(loop, [low, high, *rng.uniform(low, high, 8)]))
        for end, outwards in ((low, -1e-6 * mean), (high, 1e-6 * mean)):
            if abs(end) < 0.98 * mean:
                ends.append(stable_at(loop, [end + outwards])[0])
    # Next to all ranges end where counts do.
    assert len(ends) > 2
    assert sum(ends) <= 1
