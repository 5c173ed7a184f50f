"""Verdicts and deciding numbers of the claims of Sec. IV.C, from one run of full size."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import critical_perturbation, paper_loop, rightmost_root
from armlock.noise import PerturbationNoise
from armlock.paper import DURATION, PERTURBATION, SAMPLE_RATE
from armlock.roots import extended_root
from armlock.simulation import LIMIT
from book.companion import claims
from book.companion.claims import Verdict
from book.companion.claims import simulation as claimed
from book.companion.claims.appendix import perturbation_series

EXPECTED = {
    "M1": (Verdict.REPRODUCED, 0.0, 0.0),
    "M2": (Verdict.IN_PART, 9031.8, 1.0),
    "M3": (Verdict.IN_PART, 2.98832, 1e-5),
    "M4": (Verdict.IN_PART, 5.0068e-4, 1e-6),
    "M5": (Verdict.REPRODUCED, 0.2192, 1e-3),
    "M6": (Verdict.REPRODUCED, 0.05787, 1e-4),
    "M7": (Verdict.NOT_AS_WRITTEN, 3.879e-4, 5e-6),
    "M8": (Verdict.REPRODUCED, 0.0, 0.03),
}


@pytest.mark.parametrize("identifier", EXPECTED)
def test_verdict_and_number(identifier):
    finding = claims.check(identifier)[identifier]
    verdict, value, tolerance = EXPECTED[identifier]
    assert finding.verdict is verdict
    assert abs(finding.value - value) <= tolerance
    assert finding.note
    assert finding.quantity


def test_the_run_has_the_papers_size():
    run = claimed.full_run()
    assert run.time.size == DURATION
    assert run.noise.series.size * SAMPLE_RATE == 40_000_000
    assert claimed.full_run() is run


@pytest.mark.parametrize(
    ("name", "point"), [("system 2", claimed.STRONG), ("ideal", claimed.IDEAL)]
)
def test_suppression_agrees_with_theory(name, point):
    found = claimed.suppression(name, point)
    assert found.frequency[0] < 1.2e-4
    assert found.frequency[-1] > 0.9
    inside = (found.lower < found.expected) & (found.upper > found.expected)
    assert inside.mean() >= 0.95
    assert np.abs(found.measured / found.expected - 1.0)[found.frequency > 1e-3].max() < 0.02


def test_stability_is_lost_where_the_frozen_loop_loses_it():
    """Only sizes whose c1 - c2 leaves the stable region grow, and the more the longer."""
    edge = critical_perturbation(paper_loop(), (0.0, -1.0))
    exponents = [claimed.exponent(size) for size in claimed.SIZES]
    grown = [claimed._grown(size) for size in claimed.SIZES]
    for size, power in zip(claimed.SIZES, exponents, strict=True):
        assert (power > 0.0) == (claimed.difference(size).max() > edge)
    assert exponents == sorted(exponents)
    assert grown == sorted(grown) or grown[-1] > 1e5
    assert grown[0] == pytest.approx(1.0, abs=0.1)
    assert grown[3] > 1e4
    diverged = [claimed.full_run().traces[claimed.size_name(s)].diverged for s in claimed.SIZES]
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
    quiet, empty, filled = (start.spectrum for start in claimed.starts())
    fast, slow = quiet.frequency > 4.0, quiet.frequency < 1.0
    assert np.median(filled.asd[fast] / quiet.asd[fast]) > 30.0
    assert np.abs(filled.asd / quiet.asd - 1.0)[slow].max() < 0.05
    assert np.abs(empty.asd / quiet.asd - 1.0)[slow].max() < 0.05


def test_the_appendix_shows_the_same_series():
    assert np.array_equal(perturbation_series().eta, claimed.full_run().perturbations)


def test_the_perturbations_are_as_large_as_the_series_drawn():
    """Their spectrum goes on below the cut-off, so that they exceed the band's r.m.s."""
    sizes = claimed.drawn_sizes()
    assert sizes.rms == pytest.approx([1.581e-6, 1.066e-6], abs=1e-9)
    assert sizes.peak == pytest.approx([2.653e-6, 2.374e-6], abs=1e-9)
    # The whole spectrum level^2 f0^4 / (f^2 + fc^2)^2, against its part above fc as printed.
    excess = np.sqrt(0.25 * np.pi / (1.0 / 3.0))
    assert claimed.drawn_differences().std() / np.sqrt(2.0) == pytest.approx(
        excess * PERTURBATION, rel=0.02
    )


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


def test_probabilities_grow_with_the_size():
    sizes = (0.1, 0.5, 1.0, 3.0, 30.0)
    leaving = [claimed.leaving_probability(size) for size in sizes]
    growing = [claimed.growing_probability(size) for size in sizes]
    assert leaving == sorted(leaving)
    assert growing == sorted(growing)
    assert leaving[0] == 0.0
    assert leaving[2] == pytest.approx(0.39, abs=0.02)
    assert growing[2] < 0.02
    assert all(g <= p for g, p in zip(growing, leaving, strict=True))


def test_the_reduction_keeps_its_share_of_the_draws():
    for share in (0.5, 0.9):
        size = claimed.face_value_rms() / PERTURBATION / claimed.reduction_quantile(share)
        assert claimed.leaving_probability(size) == pytest.approx(1.0 - share, abs=1e-3)


def test_the_cutoff_decides_at_face_value():
    traces = claimed.full_run().traces
    low, high = (traces[claimed.cutoff_name(cutoff)] for cutoff in (1e-4, 1e-3))
    assert high.diverged is None
    assert np.abs(high.series).max() < 2.0 * np.abs(traces["ideal"].series).max()
    assert low.diverged == pytest.approx(8757.0, abs=1.0)


def test_equal_perturbations_are_lost_through_the_chain():
    """Their difference is zero; the roots at high frequency grow as `chain_exponent` has it."""
    trace = claimed.full_run().traces[claimed.ALIKE]
    assert trace.diverged == pytest.approx(38057.0, abs=1.0)
    assert claimed.chain_exponent(trace.series.size) > np.log(LIMIT)
    # The rate of the chain at constant c1 = c2, by Newton's method near a multiple of 10 Hz.
    loop, c = paper_loop(), 1.02
    expected = np.log(c / (1.0 + 0.5 / 5000.0)) / 20.0
    root = extended_root(loop, c, c, complex(expected, 2.0 * np.pi * 80.0))
    assert root.real == pytest.approx(expected, rel=1e-3)


def test_the_closed_loop_parts_near_unity_gain():
    found = claimed.parting()
    loop = paper_loop()
    for at, points in ((found.at, found.ratio), (found.phase_at, None)):
        s = 2j * np.pi * at
        ratio = (1.0 + loop.open_loop(s)) / (1.0 + loop.open_loop(s, *claimed.STRONG))
        if points is None:
            assert abs(np.angle(ratio)) == pytest.approx(found.phase, rel=1e-3)
        else:
            assert abs(ratio) == pytest.approx(points, rel=1e-3)
        assert at < 1e-5
