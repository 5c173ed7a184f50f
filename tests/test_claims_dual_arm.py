"""What the claims on the dual arm stand on."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import DualArm, rightmost_root, unstable_roots
from book.companion.claims import dual_arm as chapter


def test_estimates_approach_the_exact_edges():
    # Near 10 Hz at a high gain, near 5 Hz at a medium one, at any p.
    for gain, periods, corner in ((1e4, 2, 2.5), (300.0, 1, 2.5), (1000.0, 1, 0.5)):
        exact = chapter.edges(gain, corner).corner
        assert chapter.corner_estimate(gain, periods, corner) == pytest.approx(exact, rel=0.02)
    assert chapter.largest_p_estimate() == pytest.approx(chapter.largest_p(1e4), rel=0.02)
    width = chapter.edges(1e4, 250.0).width
    assert chapter.width_estimate(0.9) == pytest.approx(width, rel=2e-3)


@pytest.mark.parametrize("point", [(1.0, 1.012), chapter.SLIVER])
def test_gain_factors_put_a_root_on_the_axis(point):
    for factor in chapter.gain_factors(*point):
        near = [DualArm(10.0 * factor * k) for k in (0.999, 1.001)]
        assert sorted(int(unstable_roots(loop, *point)) for loop in near) == [0, 2]
    if point == chapter.SLIVER:
        assert sum(point) < 2.0
        assert chapter.lost_from(*point) == pytest.approx(10.0 * factor, rel=1e-3)


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


def test_what_a_high_gain_leaves_of_the_strip():
    """Random stable points at g = 10 are kept between two lines, and lost beyond them."""
    rng = np.random.default_rng(4)
    mean, difference = rng.uniform(-1.25, 1.2, 200), rng.uniform(0.0, 0.036, 200)
    c1, c2 = mean - 0.5 * difference, mean + 0.5 * difference
    stable = unstable_roots(DualArm(), c1, c2) == 0
    c1, c2 = c1[stable], c2[stable]
    line = 2.0 - chapter.sensor_weight() * (c2 - c1)
    kept = (c1 + c2 > -2.0) & (c1 + c2 < line)
    assert 20 < kept.sum() < kept.size - 20
    assert (unstable_roots(chapter.high_gain_limit(), c1[kept], c2[kept]) == 0).all()
    far = np.abs(np.abs(c1 + c2) - 2.0) > 0.02
    at_high_gain = unstable_roots(DualArm(1000.0), c1[far], c2[far]) == 0
    np.testing.assert_array_equal(at_high_gain, kept[far])


def test_the_top_of_the_strip_is_where_the_count_changes():
    for gain in (0.3, 10.0, 100.0, 1e4):
        difference, common = (side[50::500] for side in chapter.top_of_strip(gain, low=0.88))
        here = common < 1.2
        for shift, stable in ((-1e-6, True), (1e-6, False)):
            mean, half = (common + shift)[here], 0.5 * difference[here]
            counts = unstable_roots(DualArm(gain), mean - half, mean + half)
            assert ((counts == 0) == stable).all()


def test_above_the_largest_p_the_ideal_loop_is_unstable():
    limit = chapter.largest_p()
    for corner, stable in ((0.99 * limit, True), (1.01 * limit, False)):
        loop = DualArm(5000.0, corner=corner)
        assert (unstable_roots(loop, 1.0, 1.0 + 1e-9) == 0) == stable
        assert (rightmost_root(loop, 1.0, 1.0 + 1e-7).real < 0.0) == stable
    reached = chapter.largest_p(away=1e-6)
    assert chapter.edges(5000.0, reached).corner == pytest.approx(1e-6, rel=1e-3)


def test_strip_is_stable_inside_and_unstable_outside():
    boundary, middle = chapter.strip(10.0, 31), np.array([[0.0], [0.012]])
    assert boundary[1, [0, -1]].tolist() == [0.0, 0.0]
    for share, stable in ((0.5, True), (0.999, True), (1.001, False)):
        mean, difference = middle + share * (boundary - middle)
        counts = unstable_roots(DualArm(), mean - 0.5 * difference, mean + 0.5 * difference)
        assert ((counts == 0) == stable).all()
