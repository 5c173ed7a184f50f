"""What the claims of the appendix stand on, by other methods."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from book.companion.claims import appendix


@pytest.mark.parametrize("phase", [-1.5, -0.1, 0.3, 1.2, 7.0, 20.0])
def test_phase_error_is_that_of_the_arctangent(phase):
    mismatch = (0.02, -0.05)
    measured = phase + float(appendix.phase_error(phase, mismatch))
    assert np.tan(measured) == pytest.approx((0.95 / 1.02) * np.tan(phase), rel=1e-9)
    assert abs(measured - phase) < 0.5 * np.pi


@pytest.mark.parametrize("frequency", [0.0, 1e-2, 0.3, 1.0])
def test_convolution_against_adaptive_integration(frequency):
    phase, eta = appendix.sources()

    def two_sided(source, f):
        f = min(abs((f + 2.0) % 4.0 - 2.0), 1.99999)
        return 0.5 * float(source.sampled_asd(f)) ** 2

    def product(x):
        return two_sided(phase, x) * two_sided(eta, frequency - x)

    centres = {0.0, 0.3, -0.3, frequency, frequency - 0.3, frequency + 0.3}
    near = {c + d for c in centres for d in (0.0, 1e-4, -1e-4, 1e-3, -1e-3, 0.01, -0.01)}
    edges = sorted({-2.0, 2.0} | {e for e in near if -2.0 < e < 2.0})
    total = sum(
        quad(product, a, b, epsabs=0.0, epsrel=1e-8, limit=200)[0] for a, b in pairwise(edges)
    )
    assert appendix.convolved_density(np.array([frequency]))[0] == pytest.approx(
        np.sqrt(2.0 * total), rel=1e-5
    )
