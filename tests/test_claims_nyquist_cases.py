"""The claims on the Nyquist plots: each verdict, and the number that decides it."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import critical_perturbation, margins, unstable_roots
from armlock.roots import RootError, extended_root, pseudospectral_roots
from book.companion.claims import Verdict, check
from book.companion.claims import nyquist_cases as chapter
from tests import independent

DECIDED = {
    "N1": (Verdict.DIFFERS, 0.0145793, 1e-6),
    "N2": (Verdict.REPRODUCED, 0.0, 0.0),
    "N3": (Verdict.REPRODUCED, -1.0, 1e-3),
    "N4": (Verdict.NOT_AS_WRITTEN, 0.5, 1e-9),
    "N5": (Verdict.IN_PART, -0.1441254, 1e-6),
    "N6": (Verdict.IN_PART, 9.87346e-4, 1e-8),
    "N7": (Verdict.REPRODUCED, 0.0, 0.0),
    "N8": (Verdict.NOT_AS_WRITTEN, -1.0, 1e-3),
    "N9": (Verdict.IN_PART, 3134.6589, 1e-3),
    "N10": (Verdict.IN_PART, 0.309175, 1e-4),
    "N11": (Verdict.IN_PART, 4.0, 0.0),
}


@pytest.mark.parametrize("identifier", DECIDED)
def test_verdict_and_deciding_number(identifier):
    verdict, value, tolerance = DECIDED[identifier]
    finding = check(identifier)[identifier]
    assert finding.verdict == verdict
    assert abs(finding.value - value) <= tolerance


def test_panels_by_three_methods():
    table = chapter.panel_counts()
    assert [row.encirclements for row in table] == [0, 1, 0, 1]
    assert [row.winding for row in table] == [-1, 1, -1, 1]
    assert [row.order for row in table] == [0, 1, 1, 2]
    for panel, row in zip(chapter.PANELS, table, strict=True):
        assert row.roots == row.encirclements + row.poles
        assert (row.rightmost.real > 0.0) == (row.roots > 0)
        if row.winding >= 0:
            assert independent.rectangle_count(panel.loop, *panel.point) == row.winding


@pytest.mark.parametrize("index", [0, 2])
def test_slowest_root_of_the_ideal_loops(index):
    panel, row = chapter.PANELS[index], chapter.panel_counts()[index]
    found = []
    for start in pseudospectral_roots(panel.loop, *panel.point, 240)[:12]:
        try:
            root = complex(extended_root(panel.loop, *panel.point, start, digits=20))
        except RootError:
            continue
        # The root s = 0 is one of D alone.
        if abs(root) > 1e-9:
            found.append(root.real)
    assert max(found) == pytest.approx(row.rightmost.real, rel=1e-6)


@pytest.mark.parametrize("c1", [1.001, 1.0001, 1.01])
def test_the_single_arm_gains_a_pair_where_it_crosses_minus_one(c1):
    turn = 2.0 * np.pi / chapter.SINGLE.tau
    value = chapter.first_crossing(chapter.SINGLE, c1, 1.0, near=turn).value[0]
    for share, count in ((1.0 - 1e-6, 1), (1.0 + 1e-6, 3)):
        assert unstable_roots(chapter.at_gain(chapter.SINGLE, -share / value), c1, 1.0) == count


def test_no_gain_makes_the_perturbed_loops_stable():
    for loop, point in (
        (chapter.SINGLE, chapter.SINGLE_POINT),
        (chapter.COMMON, chapter.COMMON_POINT),
        (chapter.DUAL, chapter.DUAL_POINT),
    ):
        for factor in chapter.FACTORS:
            assert unstable_roots(chapter.at_gain(loop, factor), *point) >= 1


def test_threshold_of_the_common_arm_does_not_depend_on_the_gain():
    threshold = chapter.common_threshold()
    omega = np.linspace(0.30, 0.33, 2_000_001)
    for gain in (1e-2, 1.0, 1e3):
        loop = chapter.at_gain(chapter.COMMON, gain)
        for share, crosses in ((1.0 - 1e-4, False), (1.0 + 1e-4, True)):
            response = loop.open_loop(1j * omega, 1.0, 1.0 + share * threshold)
            assert bool((response.imag > 0.0).any()) == crosses


def test_gain_margins_hold_on_both_sides():
    for row in chapter.dual_gain_margins()[::4]:
        # Nearer than that, rounding at a perturbation of 1e-6 makes it a boundary point.
        for share, stable in ((1.0 - 1e-4, True), (1.0 + 1e-4, False)):
            loop = chapter.at_gain(chapter.DUAL, row.factor * share)
            assert (unstable_roots(loop, 1.0, 1.0 + row.size) == 0) == stable


def test_stability_is_lost_across_the_line_and_not_through_a_margin():
    assert critical_perturbation(chapter.DUAL, (0.0, -1.0)) == 0.0
    assert critical_perturbation(chapter.DUAL, (0.0, 1.0)) > 0.01
    assert margins(chapter.DUAL, 1.0, 1.0 + 1e-9).modulus > 0.5


def test_phase_of_a_branch_follows_the_leading_term():
    from armlock import nyquist

    for loop, point, expected in (
        (chapter.SINGLE, (1.001, 1.0), (-0.5, -1.0)),
        (chapter.SINGLE, (0.999, 1.0), (0.5, -1.0)),
        (chapter.DUAL, (1.0, 1.005), (1.0, -2.0)),
    ):
        start, change = chapter.phase_of_branch(nyquist(loop, *point))
        assert np.cos(start - expected[0] * np.pi) == pytest.approx(1.0, abs=1e-3)
        assert change == pytest.approx(expected[1] * np.pi, rel=1e-3)


def test_claims_stand_in_the_register():
    for identifier in DECIDED:
        (entry, _), *_ = list(check(identifier))
        assert entry.chapter == chapter.CHAPTER
        assert entry.place.startswith("Sec. IV.A")


def test_the_lower_gain_margin_starts_at_its_threshold():
    """And holds on both sides: below it, a slow pair of roots is unstable."""
    threshold = chapter.low_gain_threshold()
    assert threshold == pytest.approx(0.00976, rel=1e-3)
    low = chapter.at_gain(chapter.DUAL, 1e-7)
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 - 1e-3)) == 0
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 + 1e-3)) == 2
    last = chapter.dual_gain_margins()[-1]
    assert last.lower == pytest.approx(2.0075e-4, rel=1e-4)
    for share, count in ((1.0 - 1e-4, 2), (1.0 + 1e-4, 0)):
        loop = chapter.at_gain(chapter.DUAL, last.lower * share)
        assert unstable_roots(loop, 1.0, 1.0 + last.size) == count
    assert all(row.lower == 0.0 for row in chapter.dual_gain_margins()[:-1])
