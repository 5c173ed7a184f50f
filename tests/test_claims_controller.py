"""What the claims on the controller stand on, by other methods."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from armlock import nyquist, rightmost_root
from book.companion.claims import controller as chapter
from tests import independent


def test_there_is_one_unity_gain_frequency():
    for point, c in chapter.POINTS.items():
        at, phase = chapter.unity_gain(point)
        value = complex(chapter.response(at, *c))
        assert abs(value) == pytest.approx(1.0, abs=1e-9)
        assert np.angle(value) == pytest.approx(phase, abs=1e-12)
        levels = abs(chapter.response(np.geomspace(1e-9, 1e-3, 20_001), *c)) > 1.0
        assert np.diff(levels).sum() == 1


@pytest.mark.parametrize("name", ["STAGE_ONE", "LOOP", "PRINTED", "INTEGRATING"])
@pytest.mark.parametrize("point", chapter.POINTS)
def test_rightmost_roots_are_roots_of_the_printed_loop(name, point):
    """1 + L vanishes there, with L from controller and sensor in 80 digits."""
    loop, (_, c2) = getattr(chapter, name), chapter.POINTS[point]
    root = rightmost_root(loop, 1.0, c2)
    count = chapter.counts_of(loop)[point]
    assert nyquist(loop, 1.0, c2).encirclements == count
    assert (root.real > 0.0) == (count > 0)
    with mpmath.workdps(80):
        # A secant through two points near the root, which is then a step of Newton's.
        ends = [mpmath.mpc(root) * (1 + shift) for shift in (-1e-7, 1e-7)]
        left, here, right = (
            independent.exact(loop, s, 1.0, c2) for s in (ends[0], root, ends[1])
        )
        slope = (right - left) / (ends[1] - ends[0])
        assert abs(here / slope) < 1e-9 * abs(root)
