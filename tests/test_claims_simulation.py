"""What the claims of Sec. IV.C say of the start of a run."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import paper_loop, rightmost_root
from armlock.paper import PERTURBATION
from book.companion.claims import simulation as claimed


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
