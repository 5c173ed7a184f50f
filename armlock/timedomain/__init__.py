"""What a loop does in time: from a series of noise to the locked laser, and its spectrum.

The sampled loop has an exact prediction of its own; it says nothing certain about stability.
"""

from armlock.timedomain.noise import LaserNoise, PerturbationNoise, ShapedNoise, band_rms
from armlock.timedomain.simulation import (
    DivergenceError,
    Simulation,
    sampled_open_loop,
    save_series,
    simulate,
    simulate_blocks,
)
from armlock.timedomain.spectra import Spectrum, SpectrumEstimator, amplitude_spectrum

__all__ = [
    "DivergenceError",
    "LaserNoise",
    "PerturbationNoise",
    "ShapedNoise",
    "Simulation",
    "Spectrum",
    "SpectrumEstimator",
    "amplitude_spectrum",
    "band_rms",
    "sampled_open_loop",
    "save_series",
    "simulate",
    "simulate_blocks",
]
