"""What the claims on the Nyquist plots stand on, by other methods."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import nyquist, unstable_roots
from armlock.roots import RootError, extended_root
from book.companion.claims import nyquist_cases as chapter
from book.companion.schemes import pseudospectral_roots
from tests import independent


def test_panels_by_three_methods():
    expected = ((0, 0, -1), (1, 1, 1), (0, 1, -1), (1, 2, 1))
    for panel, (turns, order, count) in zip(chapter.PANELS, expected, strict=True):
        curve = nyquist(panel.loop, *panel.point)
        root = chapter.rightmost_of_loop(panel.loop, *panel.point)
        assert (curve.encirclements, curve.pole_order) == (turns, order)
        assert curve.closed_loop_roots == turns + curve.open_loop_poles
        assert (root.real > 0.0) == (curve.closed_loop_roots > 0)
        assert unstable_roots(panel.loop, *panel.point) == count
        if count >= 0:
            assert independent.rectangle_count(panel.loop, *panel.point) == count


@pytest.mark.parametrize("index", [0, 2])
def test_slowest_root_of_the_ideal_loops(index):
    panel = chapter.PANELS[index]
    found = []
    for start in pseudospectral_roots(panel.loop, *panel.point, 240)[:12]:
        try:
            root = complex(extended_root(panel.loop, *panel.point, start, digits=20))
        except RootError:
            continue
        # The root s = 0 is one of D alone.
        if abs(root) > 1e-9:
            found.append(root.real)
    slowest = chapter.rightmost_of_loop(panel.loop, *panel.point)
    assert max(found) == pytest.approx(slowest.real, rel=1e-6)


@pytest.mark.parametrize("c1", [1.001, 1.0001, 1.01])
def test_the_single_arm_gains_a_pair_where_it_crosses_minus_one(c1):
    turn = 2.0 * np.pi / chapter.SINGLE.tau
    value = chapter.crossing_near(chapter.SINGLE, c1, 1.0, turn).value[0]
    for share, count in ((1.0 - 1e-6, 1), (1.0 + 1e-6, 3)):
        assert unstable_roots(chapter.at_gain(chapter.SINGLE, -share / value), c1, 1.0) == count


def test_threshold_of_the_common_arm_does_not_depend_on_the_gain():
    threshold = chapter.common_threshold()
    omega = np.linspace(0.30, 0.33, 2_000_001)
    for gain in (1e-2, 1.0, 1e3):
        loop = chapter.at_gain(chapter.COMMON, gain)
        for share, crosses in ((1.0 - 1e-4, False), (1.0 + 1e-4, True)):
            response = loop.open_loop(1j * omega, 1.0, 1.0 + share * threshold)
            assert bool((response.imag > 0.0).any()) == crosses


def test_phase_of_a_branch_follows_the_leading_term():
    for loop, point, expected in (
        (chapter.SINGLE, (1.001, 1.0), (-0.5, -1.0)),
        (chapter.SINGLE, (0.999, 1.0), (0.5, -1.0)),
        (chapter.DUAL, (1.0, 1.005), (1.0, -2.0)),
    ):
        start, change = chapter.phase_of_branch(nyquist(loop, *point))
        assert np.cos(start - expected[0] * np.pi) == pytest.approx(1.0, abs=1e-3)
        assert change == pytest.approx(expected[1] * np.pi, rel=1e-3)


def test_the_lower_gain_margin_starts_at_its_threshold():
    """Beyond it, a slow pair of roots is unstable at low gain."""
    threshold = chapter.low_gain_threshold()
    assert threshold == pytest.approx(0.00976, rel=1e-3)
    low = chapter.at_gain(chapter.DUAL, 1e-7)
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 - 1e-3)) == 0
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 + 1e-3)) == 2
