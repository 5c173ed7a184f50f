"""Boxes of perturbations, and the two loops that keep stable over the paper's box."""

import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    UNCONFINED,
    CommonArm,
    Controller,
    DualArm,
    Loop,
    box_count,
    buildable_loop,
    paper_loop,
    robust_loop,
    unstable_roots,
)
from armlock.controllers import roll_off, table_two
from armlock.sensors import COMMON
from tests.attack import between, draw, to_loop
from tests.attack_judge import UndecidedError

TURN = 2.0 * np.pi
CORNERS = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]


@pytest.mark.parametrize(
    ("size", "count"), [(1.46432e-6, 0), (1.46433e-6, BOUNDARY), (1e-4, UNCONFINED)]
)
def test_a_box_is_stable_as_far_as_its_worst_corner(size, count):
    """The paper's loop: up to 1.46432051e-6 along (1, -1); its chain is lost at 1e-4."""
    assert box_count(paper_loop(), size) == count


def test_a_box_around_unstable_points_has_their_count():
    loop = Loop(Controller([], [1.0, -2.0], 0.1), COMMON, 2.0, 1.5)
    assert box_count(loop, 1e-3) == unstable_roots(loop) > 0


@pytest.mark.parametrize("loop", [CommonArm(), DualArm()])
def test_where_a_pole_at_zero_cancels_a_real_root_crosses_in_every_box(loop):
    """At s = 0, where leading terms of opposite corners are opposed."""
    assert box_count(loop, 1e-12) == BOUNDARY


def test_points_of_boxes_have_the_count_of_the_box():
    rng, found = np.random.default_rng(3), set()
    for index in range(40):
        try:
            loop = to_loop(draw(np.random.default_rng([5, index]))[0])
        except UndecidedError:
            continue
        size = between(rng, 1e-6, 1e-1)
        count = box_count(loop, size)
        points = 1.0 + size * np.append(rng.uniform(-1.0, 1.0, (6, 2)), CORNERS, axis=0)
        counts = unstable_roots(loop, *points.T)
        assert count < 0 or (counts == count).all()
        assert (counts >= 0).all() or count < 0
        found.add(count)
    assert found >= {BOUNDARY, UNCONFINED, 0, 2}


def test_the_robust_loop_keeps_the_papers_suppression():
    frequency = np.geomspace(1e-4, 1.0, 200_001)
    s = 1j * TURN * frequency
    change = 20.0 * np.log10(np.abs(robust_loop().controller(s) / table_two()(s)))
    assert change.min() > -0.05


def test_the_buildable_loop_has_its_gain_and_rolls_off():
    loop, band = buildable_loop(), 1j * TURN * np.geomspace(1e-4, 1e-2, 2001)
    assert (np.abs(loop.controller(band)) > 0.5 * np.abs(table_two()(band))).all()
    # The largest |L| that any phases of the arms give, from 15 kHz on.
    first, second = loop.arm_responses(1j * TURN * np.geomspace(15e3, 1e6, 2001))
    assert (np.abs(first + second) + np.abs(first) + np.abs(second) < 1.0).all()


def test_a_roll_off_has_its_slope_and_the_phase_that_goes_with_it():
    frequency = np.geomspace(1.0, 100.0, 201)
    k = roll_off(1e-2, 1e4, 6)(1j * TURN * frequency)
    slope = np.polyfit(np.log(frequency), np.log(np.abs(k)), 1)[0]
    assert slope == pytest.approx(-2.0 / 3.0, abs=0.02)
    assert np.degrees(np.angle(k)) == pytest.approx(-60.0, abs=3.0)
    assert abs(complex(roll_off(1e-2, 1e4, 6)(0.0))) == pytest.approx(1.0, rel=1e-12)
