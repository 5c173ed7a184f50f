"""What the chapters on orbits take from their companions: simulations, and pytdi."""

from __future__ import annotations

import numpy as np
import pytest

from armlock.orbits.constellation import SPEED_OF_LIGHT
from armlock.orbits.tdi import flexing, ranging_residual
from book.companion import orbits as along
from book.companion import tdi


def test_frozen_verdicts_are_those_of_simulations_with_moving_delays():
    stretches = along.random_stretches()
    assert len(stretches) >= 20
    assert {one.orbit for one in stretches} == set(along.constellations())
    for one in stretches:
        assert abs(one.rate) * one.duration > 5.0
        assert np.sign(one.rate) == np.sign(one.simulated)
        assert 0.5 < one.simulated / one.rate < 2.0
    assert min(one.rate for one in stretches) < 0.0


def test_days_above_a_level_are_those_of_a_fine_grid():
    t = np.linspace(*along.interval("leading"), 200_001)
    share = np.mean(np.abs(along.half("leading", 2)(t)) > 0.06)
    assert abs(along.days_above("leading", 0.06, 2) - 365.25 * share) < 0.1


@pytest.mark.parametrize("orbit", ["Kepler", "leading"])
def test_pytdi_finds_the_closed_forms(orbit):
    pytest.importorskip("pytdi")
    frequency = 5e-3
    omega, constellation = 2 * np.pi * frequency, along.constellations()[orbit]
    tau = constellation.round_trips(tdi.START)
    closed = ranging_residual(omega, *tau, 1.0 / SPEED_OF_LIGHT)
    assert np.abs(np.divide(tdi.sine(orbit, frequency, 1.0), closed) - 1).max() < 2e-4
    middle = tdi.START + 2500.0
    moving = [omega * abs(float(flexing(constellation, middle, n))) for n in (1, 2)]
    found = np.divide(tdi.sine(orbit, frequency, moving=True), moving)
    assert abs(found[0] - 1) < 2e-4
    assert abs(found[1] - 1) < 1e-2


def test_a_filtered_series_keeps_what_is_slow():
    t = np.arange(40_000) / 40.0
    slow = np.cos(2 * np.pi * 0.05 * t)
    fast = np.cos(2 * np.pi * 2.5 * t)
    kept = tdi.decimated(slow + fast, 10)
    assert np.abs(kept - slow[400 : 40_000 - 400 : 10]).max() < 1e-6
