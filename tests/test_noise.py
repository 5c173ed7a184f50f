"""Shaped noise: density, start, blocks, seeds."""

from typing import Any

import flint
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from armlock import LaserNoise, PerturbationNoise, ShapedNoise
from armlock.timedomain.discretize import sampled_filter, stationary_root
from armlock.timedomain.spectra import SpectrumEstimator
from tests import draws
from tests.test_in_time import ends_when_interrupted

SOURCES: dict[str, Any] = {
    "laser": lambda seed, rate=200.0: LaserNoise(seed, rate),
    "laser at rest": lambda seed, rate=200.0: LaserNoise(seed, rate, at_rest=True),
    "perturbation": lambda seed, rate=200.0: PerturbationNoise(seed, rate),
    "own filter": lambda seed, rate=200.0: ShapedNoise(
        (-1.0,), (-3 + 9j, -3 - 9j), 4.0, seed=seed, sample_rate=rate
    ),
}


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
    blocks = list(SOURCES[name](3).blocks(whole.size, 33))
    assert np.array_equal(np.concatenate([np.empty(0), *blocks]), whole)
    assert not whole.size or not np.array_equal(whole, SOURCES[name](8).draw(whole.size))


@pytest.mark.parametrize("name", ["laser", "perturbation"])
def test_density_is_the_prescribed_one(name):
    """Over five decades, within the statistical error of four million samples."""
    source = SOURCES[name](21)
    estimator = SpectrumEstimator(200.0)
    for block in source.blocks(4_000_000):
        estimator.add(block)
    found = estimator.spectrum()
    ratio = (found.asd / found.expected(source.sampled_asd)) ** 2
    deviation = (ratio - 1.0) * np.sqrt(found.averages)
    assert np.abs(deviation).max() < 4.5
    assert 0.7 < deviation.std() < 1.3
    assert found.frequency[-1] / found.frequency[0] > 1e4
    # At high frequency the error is below a part in a thousand, which settles the formula.
    fast = found.frequency > 30.0
    assert np.abs(ratio[fast] - 1.0).max() < 0.004
    # And against the formula as printed, where the docstring promises it.
    ratio = (found.asd / found.expected(source.asd)) ** 2
    deviation = (ratio - 1.0) * np.sqrt(found.averages)
    assert np.abs(deviation)[found.frequency < 20.0].max() < 4.5


@pytest.mark.parametrize(
    ("share", "error"), [(0.005, 1e-7), (0.1, 2e-4), (0.25, 7e-3), (0.4999, 1.6e-2)]
)
def test_the_laser_is_as_close_to_the_formula_as_the_docstring_says(share, error):
    for rate in (200.0, 7.0):
        source = LaserNoise(1, rate)
        frequency = (
            np.append(np.geomspace(1e-9, 1e-3, 50), np.linspace(1e-3, share, 500)) * rate
        )
        ratio = source.sampled_asd(frequency) / source.asd(frequency)
        assert np.abs(ratio - 1.0).max() < error


def test_the_perturbations_follow_the_formula_up_to_the_end():
    frequency = np.geomspace(1e-7, 95.0, 300)
    source = PerturbationNoise(1, 200.0)
    assert source.sampled_asd(frequency) == pytest.approx(source.asd(frequency), rel=1e-8)


def test_a_series_starts_in_the_middle_of_its_course():
    """Covariance of the first samples, over many seeds, is that of samples much later."""

    def source(seed):
        poles = [-1 + 9j, -1 - 9j, -4.0]
        return ShapedNoise([-5.0], poles, 1.0, seed=seed, sample_rate=10.0)

    first = np.array([source(seed).draw(4) for seed in range(draws(1000, 3000))])
    later = source(5000).draw(2_000_000)
    expected = [float(np.mean(later[: later.size - k] * later[k:])) for k in range(4)]
    found = [np.mean(first[:, 0] * first[:, k]) for k in range(4)]
    assert found == pytest.approx(expected, abs=0.1 * expected[0])


@pytest.mark.parametrize("cutoff", [1e-6, 1e-15, 1e-100])
def test_a_low_cutoff_leaves_a_series_with_its_rms(cutoff):
    """Below half the rate, and in closed form but for what the rate cuts off."""

    def source(seed):
        corner = 2.0 * np.pi * cutoff
        return ShapedNoise([], [-corner], 1.0, seed=seed, sample_rate=200.0)

    found = source(1)
    # The density 1 / |s + corner| has the variance 1 / (4 corner).
    assert found.rms == pytest.approx(np.sqrt(0.25 / (2.0 * np.pi * cutoff)), rel=1e-8)
    assert np.isfinite(found.draw(10)).all()
    assert np.std([source(seed).draw(1)[0] for seed in range(500)]) == (
        pytest.approx(found.rms, rel=0.1)
    )


def test_a_filter_over_many_decades_starts_in_the_middle_of_its_course():
    """The covariance, against sums over a sample's responses in many digits."""
    rng = np.random.default_rng(11)
    for _ in range(12):
        poles = list(-(10.0 ** rng.uniform(-6.0, 3.0, int(rng.integers(1, 5)))))
        size = 10.0 ** rng.uniform(-6.0, 3.0)
        poles += [size * complex(-0.1, 1.0), size * complex(-0.1, -1.0)]
        zeros = -(10.0 ** rng.uniform(-6.0, 3.0, len(poles) - 1))
        sampled = sampled_filter(zeros.tolist(), poles, 1.0, 200.0)
        expected = covariance(sampled)
        root = stationary_root(sampled)
        size = np.sqrt(np.diag(expected))
        off = (root @ root.T - expected) / np.outer(size, size)
        assert np.abs(off).max() < 1e-9


def covariance(sampled):
    """Covariance of the states under white noise, in 600 digits: the sum of 2^80 samples."""
    n, order = 2 * len(sampled.sections), sampled.order
    with flint.ctx.workprec(2000):
        change, drive = flint.arb_mat(n, n), flint.arb_mat(n, 1)
        shares = [flint.arb(t) for *_, t1, t2 in sampled.sections for t in (t1, t2)]
        for i, (r1, r2, k, _, _) in enumerate(sampled.sections):
            for j in range(2 * i):
                change[2 * i, j] = shares[j]
            change[2 * i, 2 * i], change[2 * i, 2 * i + 1] = r1, -flint.arb(k)
            change[2 * i + 1, 2 * i], change[2 * i + 1, 2 * i + 1] = 1, r2
            drive[2 * i, 0] = 1
        # An odd last section has one state.
        change, drive = (
            flint.arb_mat([row[: min(order, m.ncols())] for row in m.tolist()[:order]])
            for m in (change, drive)
        )
        total, one = drive * drive.transpose(), flint.arb_mat(order, order, 1)
        for _ in range(80):
            carried = one + change
            total += carried * total * carried.transpose()
            change = 2 * change + change * change
        return np.array([[float(x) for x in row] for row in total.tolist()])


def test_noise_without_a_finite_rms_is_refused():
    message = r"^noise must have a finite r\.m\.s\., got poles \(\(-3e-323"
    with pytest.raises(ValueError, match=message):
        ShapedNoise([], [-3e-323], 1.0, seed=1, sample_rate=200.0)


def test_an_interrupt_is_heard_while_noise_is_drawn():
    source = LaserNoise(1, 200.0)
    source.draw(1)
    assert ends_when_interrupted(lambda: source.draw(1 << 28)) < 1.0


def test_a_filter_without_poles_leaves_white_noise():
    source = ShapedNoise([], [], -2.0, seed=1, sample_rate=50.0)
    found = source.draw(200_000)
    white = np.random.default_rng(1).standard_normal(found.size)
    # One-sided, over half the rate: the variance is 2^2 times 25.
    np.testing.assert_allclose(found, -10.0 * white, rtol=1e-14, strict=True)
    assert source.sampled_asd([0.0, 25.0]).tolist() == [2.0, 2.0]


def test_formulas_of_the_paper():
    frequency = np.geomspace(1e-3, 50.0, 50)
    laser = LaserNoise(1, 200.0)
    assert laser.asd(frequency) == pytest.approx(30.0 / frequency, rel=1e-6)
    eta = PerturbationNoise(1, 200.0, cutoff=1e-9)
    printed = 3.6e-5 * np.sqrt(1.0 + (2.8e-3 / frequency) ** 4)
    assert eta.asd(frequency) == pytest.approx(printed, rel=1e-9)


def test_at_rest_starts_at_zero():
    quiet = LaserNoise(4, 200.0, at_rest=True).draw(200)
    full = LaserNoise(4, 200.0).draw(200)
    assert np.abs(quiet).max() < 100.0
    assert np.abs(full).min() > 100.0


def test_what_cannot_be_a_block_or_a_flag_is_refused_before_anything_is_drawn():
    source = LaserNoise(1, 200.0)
    for name, arguments in (
        ("size", (10, -1)), ("size", (10, 0)), ("samples", (-1,)), ("samples", (1.5,)),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=f"^{name} must be an integer"):
            source.blocks(*arguments)
    assert np.array_equal(source.draw(3), LaserNoise(1, 200.0).draw(3))
    with pytest.raises(TypeError, match=r"^at_rest must be True or False"):
        LaserNoise(1, 200.0, at_rest="no")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["perturbation", "own filter"])
def test_rms_is_that_of_what_is_drawn(name):
    source = SOURCES[name](5, 10.0)
    frequency = np.geomspace(1e-11, 0.499999 * source.sample_rate, 200_001)
    variance = np.trapezoid(source.sampled_asd(frequency) ** 2 * frequency, np.log(frequency))
    assert source.rms == pytest.approx(np.sqrt(variance), rel=1e-4)
    seeds = range(draws(1000, 4000))
    quick = [SOURCES[name](seed, 10.0).draw(1)[0] for seed in seeds]
    assert np.std(quick) == pytest.approx(source.rms, rel=0.05)


def test_rms_of_the_perturbations_has_the_closed_form_of_the_docstring():
    """A spectrum that ends sharply at the cut-off would have sqrt(3 pi / 4) less."""
    level, corner, cutoff = 3.6e-5, 2.8e-3, 5e-6
    variance = level**2 * (100.0 + np.pi * corner**4 / (4.0 * cutoff**3))
    assert PerturbationNoise(1, 200.0, cutoff=cutoff).rms == pytest.approx(
        np.sqrt(variance), rel=1e-9
    )
