"""What the claims on the dual arm stand on."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import DualArm, unstable_roots
from book.companion.claims import dual_arm as chapter


def test_estimates_approach_the_exact_edges():
    # Near 10 Hz at a high gain, near 5 Hz at a medium one, at any p.
    for gain, periods, corner in ((1e4, 2, 2.5), (300.0, 1, 2.5), (1000.0, 1, 0.5)):
        exact = chapter.edges(gain, corner).corner
        assert chapter.corner_estimate(gain, periods, corner) == pytest.approx(exact, rel=0.02)
    assert chapter.largest_p_estimate() == pytest.approx(chapter.largest_p(1e4), rel=0.02)
    width = chapter.edges(1e4, 250.0).width
    assert chapter.width_estimate(0.9) == pytest.approx(width, rel=2e-3)
    gain = 10.0 * chapter.gain_factors(*chapter.SLIVER)[1]
    assert chapter.lost_from(*chapter.SLIVER) == pytest.approx(gain, rel=1e-3)


@pytest.mark.parametrize("difference", [1e-4, 0.004, 0.016])
def test_edge_for_infinite_gain(difference):
    """From a walk along the axis, from the two weights at 10 Hz, and by counts."""
    end = chapter.limit_end(difference)
    assert 2.0 - end == pytest.approx(chapter.sensor_weight() * difference, rel=1e-6)
    for gap, stable in ((1e-3, True), (-1e-3, False)):
        mean = 0.5 * end - gap * (1.0 - 0.5 * end)
        point = mean - 0.5 * difference, mean + 0.5 * difference
        assert (unstable_roots(chapter.high_gain_limit(), *point) == 0) == stable
        assert np.isinf(chapter.lost_from(*point)) == stable


def test_strip_is_stable_inside_and_unstable_outside():
    boundary, middle = chapter.strip(10.0, 31), np.array([[0.0], [0.012]])
    assert boundary[1, [0, -1]].tolist() == [0.0, 0.0]
    for share, stable in ((0.5, True), (0.999, True), (1.001, False)):
        mean, difference = middle + share * (boundary - middle)
        counts = unstable_roots(DualArm(), mean - 0.5 * difference, mean + 0.5 * difference)
        assert ((counts == 0) == stable).all()
