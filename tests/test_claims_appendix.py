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


def test_error_to_first_order():
    phase = np.linspace(0.0, 10.0, 500)
    first = 0.5 * appendix.ETA * np.sin(2.0 * phase)
    assert appendix.phase_error(phase) == pytest.approx(first, abs=10.0 * appendix.ETA**2)


def test_slope_at_zero_is_the_limit_of_the_error():
    for mismatch in (appendix.MISMATCH, (0.02, -0.05)):
        eta, phase = mismatch[1] - mismatch[0], 1e-5
        ratio = float(appendix.phase_error(phase, mismatch)) / (eta * phase)
        assert abs(ratio - 1.0) == pytest.approx(appendix.slope_error(mismatch), rel=1e-3)


def test_the_error_vanishes_on_average():
    """Also for unequal channels far beyond the first order, and not by a sum over a grid."""
    for mismatch in (appendix.MISMATCH, (0.02, -0.05)):
        eta = abs(mismatch[1] - mismatch[0])
        assert abs(appendix.mean_over_turn(mismatch)) < 1e-13 * eta
        # A quarter turn alone has a mean of eta / pi, to first order.
        quarter = quad(appendix.phase_error, 0.0, 0.5 * np.pi, args=(mismatch,))[0]
        assert abs(quarter) == pytest.approx(0.5 * eta, rel=2.0 * eta + 1e-5)


def test_phase_of_the_laser_is_the_integral_of_its_frequency():
    """By integration of the density on a logarithmic axis."""

    def density(log_frequency):
        f = np.exp(log_frequency)
        # phi = integral of 2 pi nu dt: in rad, 2 pi / (2 pi f) times that of the frequency.
        return (2.0 * np.pi / (2.0 * np.pi * f) * 30.0 / f) ** 2 * f

    power = quad(density, np.log(5e-6), np.log(100.0), epsabs=0.0, epsrel=1e-11, limit=400)[0]
    assert appendix.laser_phase_rms() == pytest.approx(np.sqrt(power), rel=1e-9)


@pytest.mark.parametrize("frequency", [0.0, 1e-4, 1e-2, 0.1, 0.3, 1.0])
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
