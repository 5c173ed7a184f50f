"""What the white paper's claims are computed from, by other ways to the same numbers."""

from __future__ import annotations

import numpy as np

from armlock import LaserNoise, Loop
from armlock.orbits import SPEED_OF_LIGHT, kepler
from armlock.performance.budget import LEVELS
from armlock.performance.transfer import transfer
from book.companion.claims import flight


def test_no_mean_length_of_the_arms_leaves_more_of_the_laser():
    frequency = np.array([0.05, 0.3, 0.9, 1.9, 1.95])
    most = flight.most_laser(flight.LOOP, frequency)
    found = np.zeros(frequency.size)
    for mean in flight.MEAN_DELAY + np.linspace(0.0, 20.0, 2_001):
        loop = Loop(flight.LOOP.controller, flight.LOOP.mapping, mean + 0.255, mean - 0.255)
        left = np.abs(transfer(loop, "laser", 2j * np.pi * frequency))
        found = np.maximum(found, left * LEVELS.free_running / frequency)
    assert (found <= most * (1.0 + 1e-9)).all()
    assert (found > 0.9 * most).all()


def test_errors_of_doppler_estimates_are_those_of_a_fitted_line():
    noise = LaserNoise(seed=1, sample_rate=1.0, level=LEVELS.free_running).draw(2_000_000)
    measured = 2.0 * (noise[34:] - noise[:-34])
    parts = measured[: measured.size // 200 * 200].reshape(-1, 200).T
    slope, start = np.polyfit(np.arange(200.0), parts, 1)
    found = np.std(start + 99.5 * slope), np.std(slope)
    np.testing.assert_allclose(found, flight.doppler_errors("free-running"), rtol=0.05)


def test_arms_of_keplerian_orbits_swing_once_and_thrice_a_year():
    number = 360
    t = 365.25 * 86400.0 * np.arange(number) / number
    arms = 0.5 * SPEED_OF_LIGHT * np.sum(kepler(5e9).round_trips(t), axis=0)
    once, _, thrice = 2.0 * np.abs(np.fft.rfft(arms))[1:4] / number
    shifts = 2.0 * flight.YEARLY * np.array([once, 3.0 * thrice]) / flight.WAVELENGTH
    np.testing.assert_allclose(shifts, flight.orbit_shifts(), rtol=0.01)
