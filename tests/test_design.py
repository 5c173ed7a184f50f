"""What the search is made of, and what the two loops that it found are said to be.

The chapter on design holds the search to what it should find, and both loops to their boxes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from armlock import (
    BOUNDARY,
    CommonArm,
    Controller,
    Loop,
    buildable_loop,
    critical_perturbation,
    design,
    margins,
    modulus_margin,
    paper_loop,
    robust_loop,
)
from armlock.controllers import roll_off, table_two
from armlock.design import _smallest
from armlock.paper import PERTURBATION
from armlock.robustness.boxes import CORNERS, box_counts

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


def test_what_is_found_has_the_measures_that_it_is_said_to_have():
    """All of them are those of the functions that certify them, not those of the samples."""
    goal = np.array([1e-4, 1e-3]), np.array([100.0, 1000.0])
    bounds = {"modulus": 0.6, "modulus_in_corners": 0.4, "phase": 0.3, "suppression": -3.0}
    found = design(robust_loop(), "critical_perturbation", bounds, goal=goal)
    loop, size = found.loop, np.abs(found.loop.controller(1j * TURN * goal[0]))
    corners = [1.0 + PERTURBATION * np.array(c) for c in CORNERS]
    expected = {
        "critical_perturbation": critical_perturbation(loop, (1.0, -1.0)),
        "modulus": modulus_margin(loop),
        "modulus_in_corners": min(modulus_margin(loop, *c) for c in corners),
        "phase": margins(loop).phase,
        "suppression": 20.0 * np.log10((size / goal[1]).min()),
    }
    assert found.measures == pytest.approx(expected, rel=1e-12)
    assert all(found.measures[name] > bound for name, bound in bounds.items())
    assert found.measures["critical_perturbation"] > critical_perturbation(
        robust_loop(), (1, -1)
    )
    assert not found.counts.any()


def test_a_loop_with_a_dead_time_is_certified_at_all_frequencies():
    start = Loop(([], [-0.1], 0.1), "common", 20.1, 19.9, 1e-3)
    found = design(start, "suppression", {"modulus": 0.25})
    assert found.measures["suppression"] > 0.0
    assert found.measures["modulus"] == modulus_margin(found.loop)


@pytest.mark.parametrize("gain", [3.0, 3000.0])
def test_a_stable_start_is_seen_and_what_is_missed_is_named_with_how_much(gain):
    start = Loop(([], [-0.1], gain), "single", 20.0)
    bounds = {"phase": np.radians(20)}
    if gain == 3.0:
        assert design(start, "suppression", bounds).measures["phase"] > bounds["phase"]
    else:
        with pytest.raises(
            ValueError, match=r"best candidate has phase 0\.\d+ rad in place of 0\.349"
        ):
            design(start, "suppression", bounds)


def test_a_perturbation_above_one_is_made_larger():
    """With K(0) = k the loop is stable up to c1 = 1 + 1 / k: k falls as far as it may."""
    start = Loop(([], [-0.1], 0.003), "single", 20.0)
    found = design(start, "critical_perturbation", {"suppression": -10.0})
    k = found.loop.controller(0.0).real
    assert found.measures["critical_perturbation"] == pytest.approx(1.0 / k, rel=1e-9)
    assert k == pytest.approx(0.03 * 10.0**-0.5, rel=1e-2)


@given(st.integers(1, 4), st.data())
@settings(max_examples=30, deadline=None)
def test_the_search_leaves_its_limits_and_keeps_within_them(size, data):
    """A distance from a place inside, or on a limit; from zero on, where one limit may be."""
    place = np.array(data.draw(st.lists(st.floats(-1.0, 1.0), min_size=size, max_size=size)))
    x = _smallest(lambda x: float(np.abs(x - place).sum() + ((x - place) ** 2).sum()), size)
    assert np.abs(x - place).max() < 0.01
    assert np.abs(x).max() <= 1.0


def test_a_parameter_on_its_upper_limit_is_not_frozen():
    """The first simplex takes it there, the next ones away from it."""
    calls = []

    def cost(x):
        calls.append(x[0])
        return -x[0] if len(calls) < 12 else (x[0] - 0.2) ** 2

    x = _smallest(cost, 1)
    assert calls[10] == 1.0
    assert x[0] == pytest.approx(0.2, abs=1e-3)


RIGHT = Controller((0.0, 0.0), (1.0, -2.0), 0.1)
COMPLEX = Controller((0.0, 0.0), (-1.0 + 1.0j, -1.0 - 1.0j), 0.1)
UNSTABLE = Loop(([], [-0.1], 300.0), "single", 20.0, delay=1.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objective": "beauty"}, "objective must be one of .*'beauty'"),
        ({"constraints": {"modulus": 0.5}}, "objective must not be among constraints"),
        ({"constraints": {"phase": np.nan}}, "phase must be finite"),
        ({"constraints": {"phase": 35}}, "phase must not exceed pi, in rad, got 35"),
        ({"constraints": {"phase": -35}}, "phase must be positive, got -35"),
        ({"constraints": {"beauty": 1.0}}, "constraints must be one of .*'beauty'"),
        ({"structure": paper_loop(controller=RIGHT)}, "structure must have .* none positive"),
        ({"structure": paper_loop(controller=COMPLEX)}, "structure must have .* real zeros"),
        ({"structure": UNSTABLE}, r"structure must be stable at .* is 1336"),
        ({"structure": CommonArm()}, r"stable over the box; .*\[-1\]"),
        ({"goal": ([1e-3, 1e-2], [1.0])}, "goal must hold as many gains as frequencies"),
        ({"goal": ([-1e-3], [1.0])}, "goal must be positive"),
        ({"box": 0.0}, "box must be positive"),
        ({"box": 1e-5}, "structure must be a loop whose stability the samples show"),
    ],
)
def test_what_cannot_be_searched_is_refused(changes, message):
    arguments: dict[str, Any] = {
        "structure": robust_loop(),
        "objective": "modulus",
        "constraints": {},
    }
    with pytest.raises(ValueError, match=message):
        design(**arguments | changes)


def test_an_objective_that_presses_against_the_box_stays_within_it():
    """The best loops lie at its edge; some are stable in its corners and not on the way."""
    found = design(robust_loop(), "suppression", {"phase": np.radians(40.0)})
    assert found.measures["phase"] > np.radians(40.0)
    assert found.measures["suppression"] > 0.0
    assert not found.counts.any()
