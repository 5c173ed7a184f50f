"""What the claims on the dual arm stand on."""

from __future__ import annotations

import pytest

from book.companion.claims import dual_arm as chapter


def test_estimates_approach_the_exact_edges():
    # Near 10 Hz at a high gain, near 5 Hz at a medium one, at any p.
    for gain, periods, corner in ((1e4, 2, 2.5), (300.0, 1, 2.5), (1000.0, 1, 0.5)):
        exact = chapter.edges(gain, corner).corner
        assert chapter.corner_estimate(gain, periods, corner) == pytest.approx(exact, rel=0.02)
    width = chapter.edges(1e4, 250.0).width
    assert chapter.width_estimate(0.9) == pytest.approx(width, rel=2e-3)
