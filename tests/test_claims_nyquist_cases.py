"""What the claims on the Nyquist plots stand on, by other methods."""

from __future__ import annotations

import numpy as np

from armlock import unstable_roots
from book.companion.claims import nyquist_cases as chapter


def test_threshold_of_the_common_arm_does_not_depend_on_the_gain():
    threshold = chapter.common_threshold()
    omega = np.linspace(0.30, 0.33, 400_001)
    for gain in (1e-2, 1.0, 1e3):
        loop = chapter.at_gain(chapter.COMMON, gain)
        for share, crosses in ((1.0 - 1e-4, False), (1.0 + 1e-4, True)):
            response = loop.open_loop(1j * omega, 1.0, 1.0 + share * threshold)
            assert bool((response.imag > 0.0).any()) == crosses


def test_the_lower_gain_margin_starts_at_its_threshold():
    """Beyond it, a slow pair of roots is unstable at low gain."""
    threshold = chapter.low_gain_threshold()
    low = chapter.at_gain(chapter.DUAL, 1e-7)
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 - 1e-3)) == 0
    assert unstable_roots(low, 1.0, 1.0 + threshold * (1.0 + 1e-3)) == 2
