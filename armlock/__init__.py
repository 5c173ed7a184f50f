"""Stability and simulation of laser loops locked to delays of tens of seconds.

The reproducible companion to "Robustness Analysis and Controller Design of Arm-locking
System in Space-based Gravitational Wave Detectors".
"""

from armlock.characteristic import CharacteristicFunction
from armlock.controllers import Controller
from armlock.design import Design, design
from armlock.loops import (
    CommonArm,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    buildable_loop,
    flight_loop,
    paper_loop,
    published_loops,
    robust_loop,
)
from armlock.performance import NoiseBudget, noise_budget, pulling, transfer
from armlock.robustness import (
    Margins,
    StabilityRegion,
    critical_perturbation,
    is_stable,
    margins,
    modulus_margin,
    stability_region,
)
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
    simulate,
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
    "StabilityRegion",
    "amplitude_spectrum",
    "axis_crossings",
    "buildable_loop",
    "critical_perturbation",
    "d_curve",
    "d_curve_branches",
    "d_curve_line",
    "design",
    "flight_loop",
    "is_stable",
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
    "semi_discretization",
    "simulate",
    "spectral_radius",
    "stability_chart",
    "stability_region",
    "sweep",
    "transfer",
    "transition_matrix",
    "unstable_roots",
]
