"""A loop in time: noise of the laser, simulation of the locked laser, and spectra.

A simulation does not decide stability, because growth may take days. Counts of unstable roots
decide it.
"""

from armlock.timedomain.noise import LaserNoise, PerturbationNoise, ShapedNoise
from armlock.timedomain.responses import impulse_response, step_response
from armlock.timedomain.simulation import (
    DivergenceError,
    Simulation,
    sampled_open_loop,
    simulate,
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
    "impulse_response",
    "sampled_open_loop",
    "simulate",
    "step_response",
]
