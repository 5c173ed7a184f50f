"""The estimator against known densities: level, scatter, leakage, lines, blocks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from armlock import SpectrumEstimator, amplitude_spectrum
from armlock.timedomain.spectra import SEGMENT


def test_estimates_scatter_as_the_averages_say():
    """Many short series of white noise: a relative deviation of 1 / (2 sqrt(averages))."""
    random = np.random.default_rng(11)
    found = [amplitude_spectrum(random.standard_normal(20_000), 2.0) for _ in range(120)]
    power = np.array([one.asd**2 for one in found])
    assert np.mean(power) == pytest.approx(1.0, rel=0.01)
    expected = 1.0 / np.sqrt(found[0].averages)
    assert np.mean(np.std(power, axis=0) / expected) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("power", [1, 2])
def test_steep_spectra_do_not_leak(power):
    """Noise falling as 1/f and 1/f^2 (in amplitude) over five decades, the latter summed."""
    rate = 20.0
    series = np.random.default_rng(power).standard_normal(2_000_000)
    for _ in range(power):
        series = np.cumsum(series)
    found = amplitude_spectrum(series, rate)

    def truth(f):
        turn = 2.0 * np.sin(np.pi * np.maximum(np.minimum(f, rate - f), 1e-9) / rate)
        return np.sqrt(2.0 / rate) / turn**power

    fast = found.averages > 100.0
    assert np.abs(found.asd / found.expected(truth) - 1.0)[fast].max() < 0.2
    assert found.asd[0] / found.asd[-1] > 2e3**power


def test_decimation_keeps_a_line_and_adds_none():
    """A sine shows at its frequency with its power, and nowhere else."""
    rate, f0 = 200.0, 0.61
    t = np.arange(4_000_000) / rate
    found = amplitude_spectrum(np.sin(2 * np.pi * f0 * t), rate)
    width = found.resolution * found.bins
    near = np.abs(found.frequency - f0) < 0.6 * width + 8 * found.resolution
    power = np.sum(found.asd[near] ** 2 * width[near])
    assert power == pytest.approx(0.5, rel=0.05)
    assert found.asd[~near].max() < 1e-5 * found.asd.max()


def test_the_expectation_of_a_linear_density_is_exact():
    found = amplitude_spectrum(np.random.default_rng(1).standard_normal(20_000), 50.0)
    # In bins squared: the spread of the window's response, by Parseval, and that of the bins.
    window = np.kaiser(SEGMENT + 1, 20.0)
    spread = np.sum((SEGMENT * np.diff(window) / (2.0 * np.pi)) ** 2) / np.sum(window**2)
    power = (found.frequency / found.resolution) ** 2 + (found.bins**2 - 1) / 12.0 + spread
    expected = found.resolution * np.sqrt(power)
    np.testing.assert_allclose(found.expected(lambda f: f), expected, rtol=1e-6)


def test_a_constant_has_no_density():
    found = amplitude_spectrum(np.full(200_000, 0.1), 10.0)
    assert found.asd.max() <= 1e-14


@pytest.mark.parametrize("samples", [1024, 11_372, 11_373, 20_000, 400_000])
def test_bands_leave_no_gap(samples):
    """Where a slower rate takes over, its last bin ends within half a bin of the next one."""
    found = amplitude_spectrum(np.random.default_rng(1).standard_normal(samples), 50.0)
    half = 0.5 * found.bins * found.resolution
    overlap = ((found.frequency + half)[:-1] - (found.frequency - half)[1:]) / found.resolution[
        1:
    ]
    assert (overlap > -1e-6).all()
    assert (overlap < 0.5).all()
    slower = found.resolution[0] / found.resolution[-1]
    assert slower == {1024: 1.0, 11_372: 0.25, 11_373: 0.25, 20_000: 1 / 16}.get(
        samples, 1 / 256
    )


@given(st.lists(st.sampled_from([0, 1, 2, 3, 255, 256, 257, 1023, 1500]), max_size=14))
@settings(max_examples=15)
def test_any_partition_gives_the_same_estimate(sizes):
    series = np.random.default_rng(1).standard_normal(sum(sizes) + 1100)
    estimator = SpectrumEstimator(3.0)
    for block in np.split(series, np.cumsum(sizes)):
        estimator.add(block)
    whole, parts = amplitude_spectrum(series, 3.0), estimator.spectrum()
    held = sum(level.waiting.size + level.unfiltered.size for level in estimator._rates)
    assert held < 2 * SEGMENT * len(estimator._rates)
    np.testing.assert_allclose(parts.asd, whole.asd, rtol=1e-12)
    assert np.array_equal(parts.averages, whole.averages)


def test_a_part_of_a_spectrum_lies_between_two_frequencies():
    found = amplitude_spectrum(np.random.default_rng(1).standard_normal(5000), 2.0)
    part = found.within(0.1, 0.5)
    inside = (found.frequency >= 0.1) & (found.frequency <= 0.5)
    assert np.array_equal(part.asd, found.asd[inside])
    assert np.array_equal(part.bins, found.bins[inside])
    assert found.within(2.0, 3.0).asd.size == 0
    with pytest.raises(ValueError, match=r"^high must not lie below low = 1\.0, got 0\.1"):
        found.within(1.0, 0.1)


def test_tiny_samples_count_as_zero_whatever_numpy_raises():
    series = 1e-200 * np.random.default_rng(1).standard_normal(2048)
    with np.errstate(all="raise"):
        assert (amplitude_spectrum(series, 10.0).asd == 0.0).all()
