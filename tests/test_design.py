"""The two loops that were found: certified, and again from their numbers on plain grids.

The chapter on design holds the search to what it should find.
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
    critical_perturbation,
    design,
    margins,
    paper_loop,
    robust_loop,
)
from armlock.design import (
    box_counts,
    edge_crossings,
    roll_off,
)
from armlock.paper import PERTURBATION
from tests import attack_judge as judge
from tests.systems import sketch_of

TURN = 2.0 * np.pi
CORNER = TURN * 0.4
DIFFERENCE = 0.2
DELAYS = (20.1, 19.9)
LOOPS = {"robust": robust_loop, "buildable": buildable_loop}


def gain(frequency, *, rolls_off=False):
    """The controllers, spelled out; corners in Hz."""
    f = 1j * np.asarray(frequency)
    k = 5000.0 * f**2 / (f + 0.25e-6) / (f + 0.108e-6)
    k = k * (f + 0.37e-6) * (f + 16.75e-6) ** 3 / (f + 114.7e-6) ** 4
    if rolls_off:
        for zero in (0.111, 4.67, 29.5, 186.0, 1266.0, 15450.0):
            k = k * (1.0 + f / zero)
        for pole in (0.0059, 0.82, 8.91, 54.6, 342.0, 2228.0, 40e3):
            k = k / (1.0 + f / pole)
        k = k * np.exp(-TURN * f * 12.3e-6)
    return k


def arms(frequency, **options):
    """K m1 and K m2 of the dual sensor."""
    s = 1j * TURN * np.asarray(frequency)
    e = CORNER / ((s + CORNER) * s * DIFFERENCE)
    k = gain(frequency, **options)
    return k * (1.0 + e), k * (1.0 - e)


def response(frequency, c1=1.0, c2=1.0, **options):
    s = 1j * TURN * np.asarray(frequency)
    first, second = arms(frequency, **options)
    return first * (1.0 - c1 * np.exp(-s * DELAYS[0])) + second * (
        1.0 - c2 * np.exp(-s * DELAYS[1])
    )


def table_two_gain(frequency):
    f = 1j * np.asarray(frequency)
    k = 5000.0 * (f / (f + 1e-6)) ** 2 * (f + 1e-8) * (f + 5e-6) ** 3
    return k / ((f + 1e-6) * (f + 5e-5) ** 2 * (f + 4e-4))


@pytest.mark.parametrize("name", LOOPS)
def test_the_loops_are_what_their_numbers_say(name):
    loop, options = LOOPS[name](), {"rolls_off": name == "buildable"}
    assert (loop.tau1, loop.tau2, loop.mapping) == (*DELAYS, paper_loop().mapping)
    assert loop.delay == (12.3e-6 if name == "buildable" else 0.0)
    frequency = np.geomspace(1e-8, 1.0, 60)
    found = loop.open_loop(1j * TURN * frequency, 1.0 + 1e-6, 1.0 - 1e-6)
    expected = response(frequency, 1.0 + 1e-6, 1.0 - 1e-6, **options)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize("name", LOOPS)
def test_every_point_of_the_box_is_stable(name):
    loop, options = LOOPS[name](), {"rolls_off": name == "buildable"}
    free = TURN * 2.0 if options["rolls_off"] else None
    assert box_counts(loop, PERTURBATION).tolist() == [0]
    assert box_counts(loop, PERTURBATION, free).tolist() == [0]
    assert edge_crossings(loop, PERTURBATION, free) == 0
    # No perturbation of the box can take 1 + L to zero, whatever the phases of the arms:
    # |1 + L| exceeds what it can add. Above 5 mHz L goes around a circle, once each 20 s.
    low = np.geomspace(1e-10, 5e-3, 200_001)
    away = np.abs(1.0 + response(low, **options))
    assert (away > 2.0 * PERTURBATION * np.abs(arms(low, **options)).sum(axis=0)).all()
    high = np.geomspace(5e-3, 1e6, 200_001)
    first, second = arms(high, **options)
    radius = np.abs(first + second * np.exp(1j * TURN * high * DIFFERENCE))
    added = PERTURBATION * (np.abs(first) + np.abs(second))
    assert (np.abs(1.0 + first + second) - radius > added).all()


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


def test_the_critical_perturbation_of_the_robust_loop_on_a_plain_grid():
    """The smallest eps at which 1 + L along (1, -1) vanishes."""
    frequency = np.geomspace(1e-9, 1e-3, 400_001)
    plain = response(frequency)
    slope = (response(frequency, 1.0 + 1e-3, 1.0 - 1e-3) - plain) / 1e-3
    eps = -(1.0 + plain) / slope
    at = eps.real[np.flatnonzero(np.diff(np.sign(eps.imag)))]
    limit = critical_perturbation(robust_loop(), (1.0, -1.0))
    assert at[at > 0.0].min() == pytest.approx(limit, rel=1e-4)


def test_the_robust_loop_keeps_the_papers_suppression():
    frequency = np.geomspace(1e-4, 1.0, 200_001)
    change = 20.0 * np.log10(np.abs(gain(frequency) / table_two_gain(frequency)))
    assert change.min() > -0.05


@pytest.mark.parametrize("way", [(0, 0), (1, -1), (-1, 1)])
def test_margins_over_the_box_are_those_of_branch_and_bound(way):
    """The loops depend almost on c1 - c2 alone."""
    c1, c2 = 1.0 + PERTURBATION * np.array(way)
    for make, above in ((robust_loop, np.inf), (buildable_loop, TURN * 2.0)):
        with np.errstate(all="ignore"):
            verdict = judge.margins(sketch_of(make()), c1, c2, free_above=above)
        found = margins(make(), c1, c2, None if above == np.inf else above)
        for name in judge.NAMES[:4]:
            expected = getattr(verdict, name)
            assert getattr(found, name) == pytest.approx(expected, rel=1e-5), name


def test_the_buildable_loop_has_its_gain_and_rolls_off():
    band = np.geomspace(1e-4, 1e-2, 2001)
    assert (np.abs(gain(band, rolls_off=True)) > 0.5 * np.abs(table_two_gain(band))).all()
    assert abs(gain(1.0, rolls_off=True)) > 150.0
    # The largest |L| that any phases of the arms give, from 15 kHz on.
    first, second = arms(np.geomspace(15e3, 1e6, 2001), rolls_off=True)
    assert (np.abs(first + second) + np.abs(first) + np.abs(second) < 1.0).all()


def test_a_roll_off_has_its_slope_and_the_phase_that_goes_with_it():
    frequency = np.geomspace(1.0, 100.0, 201)
    k = roll_off(1e-2, 1e4, 6)(1j * TURN * frequency)
    slope = np.polyfit(np.log(frequency), np.log(np.abs(k)), 1)[0]
    assert slope == pytest.approx(-2.0 / 3.0, abs=0.02)
    assert np.degrees(np.angle(k)) == pytest.approx(-60.0, abs=3.0)
    assert abs(complex(roll_off(1e-2, 1e4, 6)(0.0))) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1.0, 1.0, 3), "last must be above first"),
        ((1.0, 2.0, 3, 1.0), "slope must be below one"),
    ],
)
def test_a_roll_off_that_is_none_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        roll_off(*arguments)


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
