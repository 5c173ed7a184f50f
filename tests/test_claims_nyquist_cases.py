"""What the claims on the Nyquist plots stand on, by other methods."""

from __future__ import annotations

from armlock import unstable_roots
from book.companion.claims import nyquist_cases as chapter


def test_the_lower_gain_margin_starts_at_its_threshold():
    """Beyond it, a slow pair of roots is unstable at low gain."""
    threshold = chapter.low_gain_threshold()
    low = chapter.at_gain(chapter.DUAL, 1e-7)
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 - 1e-3)) == 0
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 + 1e-3)) == 2
