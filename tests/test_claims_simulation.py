"""What the claims of Sec. IV.C stand on, from one run of full size."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import critical_perturbation, paper_loop, rightmost_root
from armlock.paper import PERTURBATION
from book.companion.claims import simulation as claimed


@pytest.fixture(scope="module")
def run():
    return claimed.full_run()


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
