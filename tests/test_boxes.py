"""Boxes of perturbations, and the two loops that keep stable over the paper's box."""

import numpy as np
import pytest

from armlock import BOUNDARY, Loop, buildable_loop, paper_loop, robust_loop
from armlock.controllers import roll_off, table_two
from armlock.paper import PERTURBATION
from armlock.robustness.boxes import box_counts

TURN = 2.0 * np.pi


@pytest.mark.parametrize(("size", "stable"), [(1.4e-6, True), (1.466e-6, False)])
def test_a_box_is_stable_as_far_as_its_worst_corner(size, stable):
    """The limit of the paper's loop along (1, -1) is 1.4643e-6: 0.1 percent more is found."""
    loop = paper_loop()
    counts = box_counts(loop, size)
    assert counts.any() != stable
    assert counts.size > 16 or counts.tolist() == [BOUNDARY]


def test_phases_that_let_a_root_cross_are_not_called_stable():
    """With the dead time of 40 us the disc of all phases holds -1."""
    k = buildable_loop()
    slower = Loop(k.controller, k.mapping, k.tau1, k.tau2, 40e-6)
    assert box_counts(slower, PERTURBATION, TURN * 2.0).tolist() == [BOUNDARY]


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
