"""The claims on the dual arm: each verdict, and the number that decides it."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import DualArm, rightmost_root, unstable_roots
from armlock.claims import Verdict, check
from armlock.claims import dual_arm as chapter

DECIDED = {
    "D1": (Verdict.NOT_AS_WRITTEN, 1.375733, 1e-5),
    "D2": (Verdict.REPRODUCED, 0.0, 0.0),
    "D3": (Verdict.REPRODUCED, -2.0014925, 1e-6),
    "D4": (Verdict.IN_PART, 29.5759064, 1e-6),
    "D5": (Verdict.REPRODUCED, 1.254005934812, 1e-11),
    "D6": (Verdict.IN_PART, 0.5206778, 1e-6),
    "D7": (Verdict.REPRODUCED, 22204.68, 0.01),
    "D8": (Verdict.IN_PART, 0.0098137, 1e-6),
    "D9": (Verdict.OPEN, 7.249457, 1e-5),
    "D10": (Verdict.NOT_AS_WRITTEN, 2.0, 1e-9),
}


@pytest.mark.parametrize("identifier", DECIDED)
def test_verdict_and_deciding_number(identifier):
    verdict, value, tolerance = DECIDED[identifier]
    finding = check(identifier)[identifier]
    assert finding.verdict == verdict
    assert abs(finding.value - value) <= tolerance


def test_each_missing_j_matters_and_the_sign_does_too():
    omega = 2.0 * np.pi * np.logspace(-3.0, 1.0, 101)
    truth = DualArm().open_loop(1j * omega, 1.01, 0.98)
    mended = chapter.printed_open_loop(omega, 1.01, 0.98, restored=True)
    np.testing.assert_allclose(mended, truth, rtol=1e-12)
    for wrong in (
        chapter.printed_open_loop(omega, 1.01, 0.98),
        chapter.printed_open_loop(omega, 1.01, 0.98, restored=True, sign=-1.0),
    ):
        assert np.abs(wrong / truth - 1.0).max() > 0.5


def test_estimates_approach_the_exact_edges():
    # Near 10 Hz at the highest gain, near 5 Hz at a medium one, at any p.
    for gain, periods, corner in ((1e5, 2, 2.5), (300.0, 1, 2.5), (1000.0, 1, 0.5)):
        exact = chapter.edges(gain, corner).corner
        assert chapter.corner_estimate(gain, periods, corner) == pytest.approx(exact, rel=0.02)
    assert chapter.corner_limit() == pytest.approx(chapter.highest_corner(1e5), rel=0.02)
    half = chapter.edges(1e4, 250.0, 0.1).width, chapter.edges(1e4, 250.0).width
    assert chapter.width_estimate(0.9, 2.0) == pytest.approx(half[0], rel=2e-3)
    assert chapter.width_estimate(0.9) == pytest.approx(half[1], rel=2e-3)


def test_area_agrees_with_a_chart_of_counts():
    for gain in (10.0, 1000.0):
        assert chapter.chart_area(gain) == pytest.approx(chapter.window_area(gain), rel=0.01)


def test_gain_factors_put_a_root_on_the_axis():
    lower, upper = chapter.gain_factors(1.0, 1.012)
    assert lower > 0.0
    for factor in (lower, upper):
        counts = [
            int(unstable_roots(DualArm(10.0 * factor * near), 1.0, 1.012))
            for near in (0.999, 1.001)
        ]
        assert sorted(counts) == [0, 2]


def test_infinite_gain_margin_below_and_finite_above():
    assert np.isinf(chapter.gain_factors(0.999, 1.0)[1])
    for gain in (1e2, 1e4, 1e6):
        assert unstable_roots(DualArm(gain), 0.999, 1.0) == 0
    assert unstable_roots(DualArm(1e4), 1.001, 1.002) > 0


def test_above_the_highest_corner_the_ideal_loop_is_unstable():
    limit = chapter.highest_corner()
    for corner, stable in ((0.99 * limit, True), (1.01 * limit, False)):
        loop = DualArm(5000.0, corner=corner)
        assert (unstable_roots(loop, 1.0, 1.0 + 1e-9) == 0) == stable
        assert (rightmost_root(loop, 1.0, 1.0 + 1e-7).real < 0.0) == stable


def test_strip_is_stable_inside_and_unstable_outside():
    common, width = chapter.strip(10.0, 31)
    for share, stable in ((0.5, True), (0.999, True), (1.001, False)):
        counts = unstable_roots(
            DualArm(), common - 0.5 * share * width, common + 0.5 * share * width
        )
        assert ((counts == 0) == stable).all()
