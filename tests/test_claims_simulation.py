"""Verdicts and deciding numbers of the claims of Sec. IV.C, from one run of full size."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import claims, critical_perturbation, paper_loop, rightmost_root
from armlock.claims import Verdict
from armlock.claims import simulation as claimed
from armlock.claims.appendix import perturbation_series
from armlock.paper import DURATION, PERTURBATION, SAMPLE_RATE

EXPECTED = {
    "M1": (Verdict.REPRODUCED, 0.0, 0.0),
    "M2": (Verdict.IN_PART, 9031.8, 1.0),
    "M3": (Verdict.IN_PART, 3.047, 2e-3),
    "M4": (Verdict.IN_PART, 5.126e-4, 1e-6),
    "M5": (Verdict.REPRODUCED, 0.2192, 1e-3),
    "M6": (Verdict.REPRODUCED, 0.9846, 1e-3),
    "M7": (Verdict.OPEN, 3.879e-4, 5e-6),
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
