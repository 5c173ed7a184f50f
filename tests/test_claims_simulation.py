"""What the claims of Sec. IV.C stand on, from one run of full size."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import critical_perturbation, paper_loop, rightmost_root
from armlock.noise import PerturbationNoise
from armlock.paper import DURATION, PERTURBATION
from armlock.roots import extended_root
from armlock.simulation import LIMIT
from book.companion.claims import simulation as claimed


@pytest.fixture(scope="module")
def run():
    return claimed.full_run()


def test_the_run_has_the_papers_size(run):
    assert run.time.size == DURATION
    assert claimed.full_run() is run


def test_a_shorter_run_is_the_start_of_the_full_one(run):
    short = claimed.full_run(duration=1000.0)
    assert short.time.size == 1000
    assert np.array_equal(short.perturbations, run.perturbations[:, :1000])
    for name, trace in short.traces.items():
        assert np.allclose(trace.series, run.traces[name].series[:1000], rtol=1e-9), name


def test_another_seed_gives_another_run():
    one, other = (claimed.full_run(duration=10.0, seed=seed) for seed in (1, 7))
    assert not np.allclose(one.perturbations, other.perturbations)
    assert not np.allclose(one.traces["ideal"].series, other.traces["ideal"].series)


def test_the_ensembles_first_draw_is_the_run(run):
    drawn, length = claimed.ensemble(duration=2000.0), 2000
    assert drawn.series.shape == (claimed.ENSEMBLE, length)
    assert np.array_equal(drawn.series[0], run.traces["system 1"].series[:length])
    assert np.array_equal(drawn.difference[0], run.difference()[:length:100])
    for size, largest in drawn.largest.items():
        trace = run.traces[claimed.size_name(size)].series[:length]
        assert largest[0] == np.abs(trace).max()
    assert len(np.unique(drawn.difference)) == drawn.difference.size


def test_stability_is_lost_where_the_frozen_loop_loses_it(run):
    """Only sizes whose c1 - c2 leaves the stable region grow, and the more the longer."""
    edge = critical_perturbation(paper_loop(), (0.0, -1.0))
    exponents = [claimed.exponent(run, size) for size in claimed.SIZES]
    grown = [run.growth(size) for size in claimed.SIZES]
    for size, power in zip(claimed.SIZES, exponents, strict=True):
        assert (power > 0.0) == (run.difference(size).max() > edge)
    assert exponents == sorted(exponents)
    assert grown == sorted(grown) or grown[-1] > 1e5
    assert grown[0] == pytest.approx(1.0, abs=0.1)
    assert grown[3] > 1e4
    diverged = [run.traces[claimed.size_name(s)].diverged for s in claimed.SIZES]
    assert [time is not None for time in diverged] == [power > 20.0 for power in exponents]


def test_growth_rate_is_the_rightmost_root():
    for gap in (5e-6, 7e-5, 2e-3):
        root = complex(rightmost_root(paper_loop(), 1.0, 1.0 - gap)).real
        assert claimed.growth_rate(np.array([gap]))[0] == pytest.approx(root, rel=0.05)
    assert claimed.growth_rate(np.array([PERTURBATION, -1e-3])).tolist() == [0.0, 0.0]


def test_chain_decays_within_the_length_of_the_run():
    """The slowest high-frequency root of the loop at (1, 1) has this time constant."""
    root = complex(rightmost_root(paper_loop(), 1.0, 1.0 + PERTURBATION))
    assert root.imag > 60.0
    assert claimed.chain_decay() == pytest.approx(-1.0 / root.real, rel=0.02)


def test_filled_arms_stay_visible_where_the_chain_is_slow():
    quiet, empty, filled = claimed.starts().values()
    fast, slow = quiet.frequency > 4.0, quiet.frequency < 1.0
    assert np.median(filled.asd[fast] / quiet.asd[fast]) > 30.0
    assert np.abs(filled.asd / quiet.asd - 1.0)[slow].max() < 0.05
    assert np.abs(empty.asd / quiet.asd - 1.0)[slow].max() < 0.05


def test_the_perturbations_exceed_the_rms_of_the_band():
    """Their spectrum goes on below the cut-off."""
    # The whole spectrum level^2 f0^4 / (f^2 + fc^2)^2, against its part above fc as printed.
    excess = np.sqrt(0.25 * np.pi / (1.0 / 3.0))
    drawn = claimed.drawn_differences().std() / np.sqrt(2.0)
    assert drawn == pytest.approx(excess * PERTURBATION, rel=0.02)


def test_random_draws_against_draws_from_the_spectrum():
    """Another generator, by the sum of cosines of the prescribed density, agrees."""
    random = np.random.default_rng(7)
    length, step, draws = 1 << 14, 100.0, 600
    frequency = np.fft.rfftfreq(length, step)
    asd = PerturbationNoise(1, cutoff=claimed.LOWEST).asd(frequency)
    # One-sided density to amplitudes of numpy's transform.
    weight = asd * np.sqrt(length / (2.0 * step)) * (PERTURBATION / claimed.face_value_rms())
    parts = random.standard_normal((2, 2, draws, frequency.size)) * np.sqrt(0.5)
    series = np.fft.irfft(weight * (parts[0] + 1j * parts[1]), length)
    widest = (series[0] - series[1])[:, : int(DURATION / step)].max(axis=1)
    edge = critical_perturbation(paper_loop(), (0.0, -1.0))
    for size in (0.7, 1.0, 2.0):
        share = float((size * widest > edge).mean())
        assert claimed.leaving_probability(size) == pytest.approx(share, abs=0.07)


def test_equal_perturbations_are_lost_through_the_chain(run):
    """Their difference is zero; the roots at high frequency grow as `chain_exponent` has it."""
    trace = run.traces[claimed.ALIKE]
    assert trace.diverged == pytest.approx(38778.3, abs=1.0)
    assert claimed.chain_exponent(run, trace.series.size) > np.log(LIMIT)
    # The rate of the chain at constant c1 = c2, by Newton's method near a multiple of 10 Hz.
    loop, c = paper_loop(), 1.02
    expected = np.log(c / (1.0 + 0.5 / 5000.0)) / 20.0
    root = extended_root(loop, c, c, complex(expected, 2.0 * np.pi * 80.0))
    assert root.real == pytest.approx(expected, rel=1e-3)


def test_the_sensitivity_changes_near_unity_gain():
    found, loop = claimed.sensitivity_change(), paper_loop()
    s = 2j * np.pi * np.geomspace(1e-8, 1e-3, 4001)
    ratio = (1.0 + loop.open_loop(s)) / (1.0 + loop.open_loop(s, *claimed.STRONG))
    assert abs(ratio).max() == pytest.approx(found["ratio"], rel=1e-3)
    assert abs(np.angle(ratio)).max() == pytest.approx(found["phase"], rel=1e-3)
    assert found["at"] < 1e-5
