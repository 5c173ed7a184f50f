"""What the search is made of, and what the two loops that it found are said to be.

The chapter on design holds the search to what it should find, and both loops to their boxes.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    UNCONFINED,
    Controller,
    Loop,
    buildable_loop,
    design,
    margins,
    paper_loop,
    robust_loop,
)
from armlock.controllers import roll_off, table_two
from armlock.paper import PERTURBATION
from armlock.robustness.boxes import box_counts, edge_crossings
from tests import attack_judge as judge
from tests.systems import sketch_of

TURN = 2.0 * np.pi


@pytest.mark.parametrize(("size", "stable"), [(1.4e-6, True), (1.466e-6, False)])
def test_a_box_is_stable_as_far_as_its_worst_corner(size, stable):
    """The limit of the paper's loop along (1, -1) is 1.4643e-6: 0.1 percent more is found."""
    loop = paper_loop()
    counts = box_counts(loop, size)
    assert counts.any() != stable
    assert counts.size > 16 or counts.tolist() == [BOUNDARY]
    assert edge_crossings(loop, size) == (0 if stable else 2)


def test_phases_that_let_a_root_cross_are_not_called_stable():
    """With the dead time of 40 us the disc of all phases holds -1."""
    k = buildable_loop()
    slower = Loop(k.controller, k.mapping, k.tau1, k.tau2, 40e-6)
    assert edge_crossings(slower, PERTURBATION, TURN * 2.0) == UNCONFINED
    assert box_counts(slower, PERTURBATION, TURN * 2.0).tolist() == [BOUNDARY]


def test_the_robust_loop_keeps_the_papers_suppression():
    frequency = np.geomspace(1e-4, 1.0, 200_001)
    s = 1j * TURN * frequency
    change = 20.0 * np.log10(np.abs(robust_loop().controller(s) / table_two()(s)))
    assert change.min() > -0.05


@pytest.mark.parametrize("way", [(0, 0), (1, -1), (-1, 1)])
def test_margins_over_the_box_are_those_of_branch_and_bound(way):
    """The loops depend almost on c1 - c2 alone."""
    c1, c2 = 1.0 + PERTURBATION * np.array(way)
    for make, above in ((robust_loop, np.inf), (buildable_loop, TURN * 2.0)):
        verdict = judge.margins(sketch_of(make()), c1, c2, free_above=above)
        found = margins(make(), c1, c2, None if above == np.inf else above)
        for name in judge.NAMES[:4]:
            expected = getattr(verdict, name)
            assert getattr(found, name) == pytest.approx(expected, rel=1e-5), name


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


def test_the_executor_does_not_change_what_is_found():
    search = partial(
        design, robust_loop(), "critical perturbation", {"modulus": 0.6}, generations=1, seed=3
    )
    alone = search()
    with ThreadPoolExecutor(2) as executor:
        shared = search(executor=executor)
    assert alone.controller == shared.controller
    assert alone.measures == shared.measures


def test_contradictory_constraints_say_which_was_missed_and_by_how_much():
    with pytest.raises(ValueError, match=r"modulus 0\.\d+ in place of 1\.5"):
        design(robust_loop(), "suppression", {"modulus": 1.5}, generations=0)


RIGHT = Controller((0.0, 0.0), (1.0, -2.0), 0.1)
COMPLEX = Controller((0.0, 0.0), (-1.0 + 1.0j, -1.0 - 1.0j), 0.1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objective": "beauty"}, "a measure must be one of .*'beauty'"),
        ({"constraints": {"modulus": 0.5}}, "objective must not be among constraints"),
        ({"constraints": {"phase": np.nan}}, "phase must be finite"),
        ({"structure": paper_loop(controller=RIGHT)}, "structure must have .* none positive"),
        ({"structure": paper_loop(controller=COMPLEX)}, "structure must have .* real zeros"),
        ({"goal": ([1e-30], [1.0])}, "goal must lie between"),
        ({"goal": ([1e-3, 1e-2], [1.0])}, "goal must hold as many gains as frequencies"),
    ],
)
def test_what_cannot_be_searched_is_refused(changes, message):
    arguments = {"structure": robust_loop(), "objective": "modulus", "constraints": {}}
    with pytest.raises(ValueError, match=message):
        design(**{**arguments, **changes})
