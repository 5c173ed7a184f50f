"""Whole ranges of differences of the round trips, against counts."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import Controller, Loop, paper_loop, unstable_roots
from armlock.robustness import no_root_crosses
from armlock.sensors import COMMON, dual, modified_dual


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


def test_an_unstable_window_inside_a_range_is_found():
    low, high = 1.737, 5.436
    assert stable_at(WINDOW, [low, high]) == [True, True]
    assert not all(stable_at(WINDOW, np.linspace(low, high, 20)))
    assert not no_root_crosses(WINDOW, low, high)


def drawn(rng):
    """Return a loop, and two half differences."""
    mean = 10 ** rng.uniform(-1, 1.3)
    held = mean * 10 ** rng.uniform(-2.5, -0.3)
    sensors = COMMON, dual(10 ** rng.uniform(-1, 1), 2 * held), modified_dual(mean, held)
    number = rng.integers(1, 5)
    poles, zeros = (-(10 ** rng.uniform(-4, 2, number - k)) for k in (0, rng.integers(2)))
    if rng.random() < 0.3:
        poles[0] = 0.0
    controller = Controller(zeros, poles, 10 ** rng.uniform(-1, 1.7))
    delay = rng.choice([0.0, mean * 10 ** rng.uniform(-4, -1)])
    loop = Loop(controller, sensors[rng.integers(3)], mean + held, mean - held, delay)
    return loop, np.sort(np.minimum(held * rng.uniform(0, 3, 2), 0.99 * mean))


def test_what_is_certified_is_stable_at_random_differences():
    rng = np.random.default_rng(7)
    found = []
    for _ in range(25):
        loop, (low, high) = drawn(rng)
        counted = all(stable_at(loop, [low, high, *rng.uniform(low, high, 8)]))
        certified = stable_at(loop, [low])[0] and no_root_crosses(loop, low, high)
        assert counted or not certified
        found.append((counted, certified))
    # Next to all loops are decided, both ways.
    assert sum(counted != certified for counted, certified in found) <= 2
    assert 3 < sum(certified for _, certified in found) < 22


def test_differences_ascend_and_leave_round_trips():
    for low, high in ((0.2, 0.1), (-20.0, 0.1), (0.1, np.nan)):
        with pytest.raises(ValueError, match="high"):
            no_root_crosses(paper_loop(), low, high)
