"""Stability and simulation of laser loops locked to delays of tens of seconds.

The reproducible companion to "Robustness Analysis and Controller Design of Arm-locking
System in Space-based Gravitational Wave Detectors".
"""

from armlock.budget import NoiseBudget, noise_budget
from armlock.characteristic import CharacteristicFunction
from armlock.controllers import Controller
from armlock.dcurve import d_curve, d_curve_branches, d_curve_line
from armlock.design import Design, buildable_loop, design, robust_loop
from armlock.flight import flight_loop, published_loops
from armlock.loops import CommonArm, DualArm, HayesEquation, Loop, SingleArm, paper_loop
from armlock.margins import Margins, critical_perturbation, margins, modulus_margin
from armlock.noise import LaserNoise, PerturbationNoise, ShapedNoise
from armlock.nyquist import (
    AxisCrossings,
    NyquistCurve,
    axis_crossings,
    nyquist,
)
from armlock.pulling import pulling
from armlock.roots import RootError, rightmost_root
from armlock.semidiscretization import semi_discretization, spectral_radius, transition_matrix
from armlock.simulation import (
    DivergenceError,
    Simulation,
    sampled_open_loop,
    save_series,
    simulate,
    simulate_blocks,
)
from armlock.spectra import Spectrum, SpectrumEstimator, amplitude_spectrum
from armlock.stability import (
    BOUNDARY,
    UNCONFINED,
    CountError,
    StabilityChart,
    stability_chart,
    unstable_roots,
)
from armlock.sweep import sweep
from armlock.transfer import closed_loop, transfer

__version__ = "0.1.0"

__all__ = [
    "BOUNDARY",
    "UNCONFINED",
    "AxisCrossings",
    "CharacteristicFunction",
    "CommonArm",
    "Controller",
    "CountError",
    "Design",
    "DivergenceError",
    "DualArm",
    "HayesEquation",
    "LaserNoise",
    "Loop",
    "Margins",
    "NoiseBudget",
    "NyquistCurve",
    "PerturbationNoise",
    "RootError",
    "ShapedNoise",
    "Simulation",
    "SingleArm",
    "Spectrum",
    "SpectrumEstimator",
    "StabilityChart",
    "amplitude_spectrum",
    "axis_crossings",
    "buildable_loop",
    "closed_loop",
    "critical_perturbation",
    "d_curve",
    "d_curve_branches",
    "d_curve_line",
    "design",
    "flight_loop",
    "margins",
    "modulus_margin",
    "noise_budget",
    "nyquist",
    "paper_loop",
    "published_loops",
    "pulling",
    "rightmost_root",
    "robust_loop",
    "sampled_open_loop",
    "save_series",
    "semi_discretization",
    "simulate",
    "simulate_blocks",
    "spectral_radius",
    "stability_chart",
    "sweep",
    "transfer",
    "transition_matrix",
    "unstable_roots",
]
