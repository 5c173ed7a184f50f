"""Shaped noise: density, start, blocks, seeds."""

import pickle
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from armlock import LaserNoise, PerturbationNoise, ShapedNoise, paper
from armlock.noise import band_rms, sample_count
from armlock.spectra import SpectrumEstimator

SOURCES: dict[str, Any] = {
    "laser": lambda seed, **more: LaserNoise(seed, **more),
    "laser at rest": lambda seed, **more: LaserNoise(seed, at_rest=True, **more),
    "perturbation": lambda seed, **more: PerturbationNoise(seed, **more),
    "own filter": lambda seed, **more: ShapedNoise(
        (-1.0,), (-3 + 9j, -3 - 9j), 4.0, seed=seed, **more
    ),
}


@pytest.mark.parametrize("name", SOURCES)
def test_blocks_do_not_matter(name):
    whole = SOURCES[name](7).draw(2000)
    source = SOURCES[name](7)
    parts = np.concatenate([source.draw(n) for n in (1, 0, 700, 1299)])
    assert np.array_equal(whole, parts)
    assert np.array_equal(whole, np.concatenate(list(SOURCES[name](7).blocks(2000, 333))))
    assert not np.array_equal(whole, SOURCES[name](8).draw(2000))


@pytest.mark.parametrize("name", ["laser", "perturbation"])
def test_density_is_the_prescribed_one(name):
    """Over five decades, within the statistical error of four million samples."""
    source = SOURCES[name](21)
    estimator = SpectrumEstimator(200.0)
    for block in source.blocks(4_000_000):
        estimator.add(block)
    found = estimator.spectrum()
    ratio = (found.asd / found.expected(source.sampled_asd)) ** 2
    pull = (ratio - 1.0) * np.sqrt(0.5 * found.degrees)
    assert np.abs(pull).max() < 4.5
    assert 0.7 < pull.std() < 1.3
    assert found.frequency[-1] / found.frequency[0] > 1e4
    # At high frequency the error is below a part in a thousand, which settles the formula.
    fast = found.frequency > 30.0
    assert np.abs(ratio[fast] - 1.0).max() < 0.004
    # And against the formula as printed, below the last tenth of the band.
    ratio = (found.asd / found.expected(source.asd)) ** 2
    pull = (ratio - 1.0) * np.sqrt(0.5 * found.degrees)
    assert np.abs(pull)[found.frequency < 80.0].max() < 4.5


def test_sampled_density_follows_the_formula():
    frequency = np.concatenate((np.geomspace(1e-7, 1.0, 300), np.linspace(1.0, 95.0, 3000)))
    largest = LaserNoise(1, cutoff=2.0)
    for source, error in (
        (LaserNoise(1), 1.3e-3), (largest, 1.3e-3), (PerturbationNoise(1), 1e-8),
    ):  # fmt: skip
        assert np.abs(source.sampled_asd(frequency) / source.asd(frequency) - 1.0).max() < error


FREQUENCIES: list[tuple[Any, type[Exception], str]] = [
    (-1.0, ValueError, r"frequency must not be negative.*, got -1\.0$"),
    ([1.0, np.nan], ValueError, "frequency must be finite, got nan"),
    (np.inf, ValueError, "frequency must be finite, got inf"),
    ("a", TypeError, "frequency must hold real numbers"),
    (1j, TypeError, "frequency must be real"),
    (True, TypeError, "frequency must hold real numbers, got dtype bool"),
    (None, TypeError, "frequency must hold real numbers, got dtype object"),
    (np.ma.masked_array([1.0], [True]), TypeError, "frequency must be an ordinary array"),
]


@pytest.mark.parametrize("name", SOURCES)
@pytest.mark.parametrize(("frequency", "error", "message"), FREQUENCIES)
def test_densities_are_for_frequencies_that_make_sense(name, frequency, error, message):
    source = SOURCES[name](1, sample_rate=10.0)
    for density in (source.asd, source.sampled_asd):
        with pytest.raises(error, match=message):
            density(frequency)


@pytest.mark.parametrize("name", SOURCES)
def test_sampled_densities_end_at_half_the_rate(name):
    source = SOURCES[name](1, sample_rate=10.0)
    message = r"frequency must not be negative and at most 5\.0 Hz, half the .* got 5\.001$"
    with pytest.raises(ValueError, match=message):
        source.sampled_asd([1.0, 5.001, 9.0])
    assert source.asd([9.0, 5e3]).shape == (2,)
    # Both ends belong to the band, up to rounding, and are no jump.
    ends = source.sampled_asd([0.0, 1e-12, 5.0 - 1e-9, 5.0, np.nextafter(5.0, 6.0)])
    assert ends[0] == pytest.approx(ends[1], rel=1e-9) == pytest.approx(source.asd(0.0))
    scale = source.sampled_asd(1.0)
    assert ends[3] / scale == pytest.approx(ends[2] / scale, abs=1e-8)
    assert ends[4] == pytest.approx(ends[3], rel=1e-12, abs=1e-12 * scale)


@pytest.mark.parametrize("pole", [1.0, 0.0, 1e-12])
@pytest.mark.parametrize("at_rest", [False, True])
def test_unstable_filters_have_no_density(pole, at_rest):
    message = r"poles must lie in the left half-plane, got "
    with pytest.raises(ValueError, match=message):
        ShapedNoise([], [-1.0, pole], 1.0, seed=1, at_rest=at_rest)
    with pytest.raises(ValueError, match=message):
        ShapedNoise([], [0.0 + 1j, -1j], 1.0, seed=1, at_rest=at_rest)


def test_filters_that_cannot_be_drawn_are_refused():
    with pytest.raises(ValueError, match="must be proper, got more zeros than poles"):
        ShapedNoise([-1.0], [], 1.0, seed=1)
    with pytest.raises(ValueError, match=r"gain must not be zero, got 0\.0"):
        ShapedNoise([], [-1.0], 0.0, seed=1)
    with pytest.raises(ValueError, match="must leave a variance that floats can hold"):
        PerturbationNoise(1, cutoff=1e-20)
    with pytest.raises(ValueError, match="must leave a variance that floats can hold"):
        ShapedNoise([], [-1.0], 1e300, seed=1)
    assert np.isfinite(PerturbationNoise(1, cutoff=1e-20, at_rest=True).draw(10)).all()
    with pytest.raises(TypeError, match="at_rest must be True or False, got 'no'"):
        LaserNoise(1, at_rest="no")  # type: ignore[arg-type]


@given(
    st.sampled_from(sorted(SOURCES)),
    st.lists(st.sampled_from([0, 1, 2, 3, 11, 24, 25, 100]), max_size=10),
)
def test_any_partition_gives_the_same_bits(name, sizes):
    whole = SOURCES[name](3).draw(np.int64(sum(sizes)))
    source = SOURCES[name](3)
    parts = [source.draw(size) for size in sizes]
    assert [part.size for part in parts] == sizes
    assert np.array_equal(np.concatenate([np.empty(0), *parts]), whole)


def test_a_filter_without_poles_leaves_white_noise():
    source = ShapedNoise([], [], -2.0, seed=1, sample_rate=50.0)
    found = source.draw(200_000)
    white = np.random.default_rng(1).standard_normal(found.size)
    # One-sided, over half the rate: the variance is 2^2 times 25.
    assert found == pytest.approx(-10.0 * white, rel=1e-14)
    assert source.sampled_asd([0.0, 25.0]).tolist() == [2.0, 2.0]


def test_a_copied_noise_goes_on_by_itself():
    for make in SOURCES.values():
        source = make(5)
        source.draw(37)
        other = pickle.loads(pickle.dumps(source))
        assert np.array_equal(other.draw(50), source.draw(50))


def test_noises_say_what_they_are():
    """As the call that makes the same one again."""
    sources = (
        LaserNoise(3, 20.0, level=2.0, cutoff=1e-4, at_rest=True),
        PerturbationNoise(np.int64(4), scale=0.5),  # type: ignore[arg-type]
        ShapedNoise([-1], [-3 + 9j, -3 - 9j], 4, seed=5, sample_rate=50),
    )
    for source in sources:
        again = eval(repr(source))
        assert type(again) is type(source)
        assert repr(again) == repr(source)
        assert np.array_equal(again.draw(50), source.draw(50))
    assert repr(sources[0]) == (
        "LaserNoise(seed=3, sample_rate=20.0, at_rest=True, level=2.0, cutoff=0.0001)"
    )


def test_formulas_of_the_paper():
    frequency = np.geomspace(1e-3, 50.0, 50)
    laser = LaserNoise(1, cutoff=1e-9)
    assert laser.asd(frequency) == pytest.approx(30.0 / frequency, rel=1e-9)
    eta = PerturbationNoise(1, cutoff=1e-9, scale=2.0)
    printed = 2.0 * 3.6e-5 * np.sqrt(1.0 + (2.8e-3 / frequency) ** 4)
    assert eta.asd(frequency) == pytest.approx(printed, rel=1e-9)


def test_spectrum_factors_exactly():
    omega = np.geomspace(1e-6, 1e3, 60)
    corner = 2.0 * np.pi * paper.PHASE_NOISE_CORNER
    s = 1j * omega
    factor = s**2 + np.sqrt(2.0) * corner * s + corner**2
    assert np.abs(factor) ** 2 == pytest.approx(omega**4 + corner**4, rel=1e-12)


@pytest.mark.parametrize("name", ["laser", "perturbation"])
def test_variance_is_stationary_from_the_start(name):
    start = np.array([SOURCES[name](seed, sample_rate=2.0, cutoff=1e-3).draw(2)[1]
                      for seed in range(800)])  # fmt: skip
    source = SOURCES[name](99, sample_rate=2.0, cutoff=1e-3)
    later = source.draw(2_000_000).std()
    assert start.std() == pytest.approx(later, rel=0.12)


def test_at_rest_starts_at_zero():
    quiet = LaserNoise(4, at_rest=True).draw(200)
    full = LaserNoise(4).draw(200)
    assert np.abs(quiet).max() < 100.0
    assert np.abs(full).min() > 100.0


def test_band_rms_is_the_integral():
    def power(f):
        return (3.6e-5) ** 2 * (1.0 + (2.8e-3 / f) ** 4)

    edges = np.geomspace(5e-6, 100.0, 40)
    total = sum(quad(power, a, b)[0] for a, b in pairwise(edges))
    assert band_rms(5e-6, 100.0) == pytest.approx(np.sqrt(total), rel=1e-6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: LaserNoise(-1), "seed must be"),
        (
            lambda: LaserNoise(1.5),  # type: ignore[arg-type]
            "seed must be",
        ),
        (lambda: LaserNoise(True), "seed must be"),
        (lambda: LaserNoise(1, 0.0), "sample_rate must be positive"),
        (lambda: LaserNoise(1, cutoff=-1.0), "cutoff must be positive"),
        (lambda: PerturbationNoise(1, scale=np.nan), "scale must be finite"),
        (lambda: LaserNoise(1).draw(-1), "samples must be"),
        (
            lambda: LaserNoise(1).draw(1.5),  # type: ignore[arg-type]
            "samples must be an integer from 0 on, got 1.5",
        ),
        (lambda: LaserNoise(1).draw(True), "samples must be an integer from 0 on, got True"),
        (lambda: LaserNoise(1).blocks(10, 0), "size must be an integer from 1 on, got 0"),
        (lambda: LaserNoise(1, cutoff=3.0), r"cutoff must be at most 2\.0 Hz.* got 3\.0"),
        (lambda: LaserNoise(1, 1e-5), r"cutoff must be at most 1\.0\S* Hz"),
        (
            lambda: sample_count(1e308),
            r"duration must be a finite number of samples, got 1e\+308",
        ),
        (lambda: band_rms(1.0, 0.5), "high must exceed"),
        (lambda: band_rms(1e-300, 0.5), "low must be at least 1e-100 Hz"),
        (lambda: sample_count(-200_000.0), "duration must be positive"),
        (lambda: sample_count(1e-9), "duration must be at least one sample"),
        (lambda: sample_count(1.0, -200.0), "sample_rate must be positive"),
    ],
)
def test_bad_arguments(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_paper_size():
    assert sample_count(paper.DURATION, paper.SAMPLE_RATE) == 40_000_000
