"""Stability and simulation of laser loops locked to delays of tens of seconds.

The reproducible companion to "Robustness Analysis and Controller Design of Arm-locking
System in Space-based Gravitational Wave Detectors".
"""

from armlock.characteristic import CharacteristicFunction
from armlock.controllers import Controller
from armlock.design import Design, buildable_loop, design, robust_loop
from armlock.loops import (
    CommonArm,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    flight_loop,
    paper_loop,
    published_loops,
)
from armlock.performance import NoiseBudget, closed_loop, noise_budget, pulling, transfer
from armlock.robustness import Margins, critical_perturbation, margins, modulus_margin
from armlock.stability import (
    BOUNDARY,
    UNCONFINED,
    AxisCrossings,
    CountError,
    NyquistCurve,
    RootError,
    StabilityChart,
    axis_crossings,
    d_curve,
    d_curve_branches,
    d_curve_line,
    nyquist,
    rightmost_root,
    semi_discretization,
    spectral_radius,
    stability_chart,
    transition_matrix,
    unstable_roots,
)
from armlock.sweep import sweep
from armlock.timedomain import (
    DivergenceError,
    LaserNoise,
    PerturbationNoise,
    ShapedNoise,
    Simulation,
    Spectrum,
    SpectrumEstimator,
    amplitude_spectrum,
    sampled_open_loop,
    save_series,
    simulate,
    simulate_blocks,
)

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
