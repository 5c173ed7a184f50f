"""Stability and simulation of laser loops that are locked to long delays (arm locking).

A loop has a controller, a sensor, the round-trip times ``tau1`` and ``tau2`` of its two arms,
and two free parameters: the factors c1 and c2 of the arms, which are ideally 1. Counts and
margins are certified: a number is right, or the function says that it is not decided.

The calls that matter most:

- ``Loop(controller, "common", tau1=20.1, tau2=19.9)`` is a loop of your own. `paper_loop` and
  `flight_loop` are published ones.
- ``unstable_roots(loop, c1, c2)`` counts the roots with positive real part. 0 means stable,
  -1 a root on the imaginary axis, -2 unstable roots at arbitrarily high frequency, -3 that a
  point among others takes too many steps.
- ``stability_chart(loop, c1, c2)`` counts on a grid; ``chart.plot()`` draws the chart.
- ``margins(loop, c1, c2)`` finds the gain, phase, delay and modulus margins of a stable loop.
- ``critical_perturbation(loop, direction)`` is the distance from (1, 1) to instability.
- ``varying_radius(loop)`` is how far c1 and c2 may vary in time; ``peak_gain(system)`` is the
  largest gain of a stable system. Both, and margins, take lists of loops and arrays too.
- ``rightmost_root(loop, c1, c2)`` is the root that decays slowest or grows fastest;
  ``characteristic_roots(loop, c1, c2, right_of=-0.1)`` are all roots right of a line.
- ``stable_delays(system, z, longest=10.0)`` are the windows of one delay, with their counts.
- ``control.tf([1], [10, 1]) * delay(3.0)`` is a system with a dead time. Systems are combined
  with ``+ - * / **`` and `feedback`, with any number of delays and of parameters such as
  ``parameter("kp")``; every function above takes them. `equation` stands for D = 0.
- ``nyquist(loop, omega_max=10.0)`` is the Nyquist curve with its encirclements of -1.
- ``simulate(loop, noise, sample_rate=200.0)`` is the frequency noise of the locked laser, in
  Hz, from that of the free laser, such as ``LaserNoise(1, sample_rate=200.0).draw(20_000)``.
- ``amplitude_spectrum(series, sample_rate)`` estimates an amplitude spectral density.
- ``noise_budget(loop, frequency)`` is the noise of the locked laser, source by source, from a
  free laser of 30 kHz/sqrt(Hz) at 1 Hz if no other is given.

Angular frequencies are in rad/s, frequencies in Hz, and delays in s. The first chart and
the first margins of an installation compile what they need, which takes some 20 s.
``help(armlock.margins)`` describes one function. The modules `armlock.controllers`,
`armlock.sensors`, `armlock.orbits` and `armlock.paper` hold controllers, sensors, real arms
and the numbers of the paper.

This package is the companion to "Robustness Analysis and Controller Design of Arm-locking
System in Space-based Gravitational Wave Detectors".
"""

from typing import Any

from armlock import controllers as controllers
from armlock import paper as paper
from armlock import sensors as sensors
from armlock.loops import (
    CommonArm,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    buildable_loop,
    flight_loop,
    paper_loop,
    robust_loop,
)
from armlock.matrices import determinant, return_difference, state_space
from armlock.performance.budget import NoiseBudget, noise_budget
from armlock.performance.pulling import pulling
from armlock.performance.transfer import transfer
from armlock.robustness import (
    Many,
    Margins,
    box_count,
    critical_perturbation,
    first_crossing,
    margins,
    modulus_margin,
    peak_gain,
    stable_half_differences,
    varying_radius,
)
from armlock.stability.charts import StabilityChart, stability_chart
from armlock.stability.counts import (
    BOUNDARY,
    UNCONFINED,
    UNDECIDED,
    CountError,
    unstable_roots,
)
from armlock.stability.dcurve import d_curve, d_curve_branches, d_curve_line
from armlock.stability.nyquist import AxisCrossings, NyquistCurve, axis_crossings, nyquist
from armlock.stability.roots import (
    CharacteristicRoots,
    RootError,
    characteristic_roots,
    rightmost_root,
)
from armlock.stability.semidiscretization import (
    semi_discretization,
    spectral_radius,
    transition_matrix,
)
from armlock.stability.windows import stable_delays
from armlock.systems import Controller, System, delay, equation, parameter, s
from armlock.timedomain.noise import LaserNoise, PerturbationNoise, ShapedNoise
from armlock.timedomain.responses import impulse_response, step_info, step_response
from armlock.timedomain.simulation import (
    DivergenceError,
    Simulation,
    sampled_open_loop,
    simulate,
)
from armlock.timedomain.spectra import Spectrum, SpectrumEstimator, amplitude_spectrum

__version__ = "0.1.0"


def __dir__() -> list[str]:
    """List what users call, and no inner modules."""
    return [*__all__, "__version__", "controllers", "orbits", "paper", "sensors"]


def __getattr__(name: str) -> Any:
    """Import the orbits when they are asked for: SciPy's splines take half a second."""
    if name == "orbits":
        import importlib

        return importlib.import_module("armlock.orbits")
    raise AttributeError(f"module 'armlock' has no attribute {name!r}")


__all__ = [
    "BOUNDARY",
    "UNCONFINED",
    "UNDECIDED",
    "AxisCrossings",
    "CharacteristicRoots",
    "CommonArm",
    "Controller",
    "CountError",
    "DivergenceError",
    "DualArm",
    "HayesEquation",
    "LaserNoise",
    "Loop",
    "Many",
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
    "System",
    "amplitude_spectrum",
    "axis_crossings",
    "box_count",
    "buildable_loop",
    "characteristic_roots",
    "critical_perturbation",
    "d_curve",
    "d_curve_branches",
    "d_curve_line",
    "delay",
    "determinant",
    "equation",
    "first_crossing",
    "flight_loop",
    "impulse_response",
    "margins",
    "modulus_margin",
    "noise_budget",
    "nyquist",
    "paper_loop",
    "parameter",
    "peak_gain",
    "pulling",
    "return_difference",
    "rightmost_root",
    "robust_loop",
    "s",
    "sampled_open_loop",
    "semi_discretization",
    "simulate",
    "spectral_radius",
    "stability_chart",
    "stable_delays",
    "stable_half_differences",
    "state_space",
    "step_info",
    "step_response",
    "transfer",
    "transition_matrix",
    "unstable_roots",
    "varying_radius",
]
