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

import importlib
from types import ModuleType as _Module

from armlock import controllers as controllers
from armlock import paper as paper
from armlock import sensors as sensors
from armlock.loops import CommonArm as CommonArm
from armlock.loops import DualArm as DualArm
from armlock.loops import HayesEquation as HayesEquation
from armlock.loops import Loop as Loop
from armlock.loops import SingleArm as SingleArm
from armlock.loops import buildable_loop as buildable_loop
from armlock.loops import flight_loop as flight_loop
from armlock.loops import paper_loop as paper_loop
from armlock.loops import robust_loop as robust_loop
from armlock.matrices import determinant as determinant
from armlock.matrices import return_difference as return_difference
from armlock.matrices import state_space as state_space
from armlock.performance.budget import NoiseBudget as NoiseBudget
from armlock.performance.budget import noise_budget as noise_budget
from armlock.performance.pulling import pulling as pulling
from armlock.performance.transfer import transfer as transfer
from armlock.robustness.many import Many as Many
from armlock.robustness.margins import Margins as Margins
from armlock.robustness.margins import margins as margins
from armlock.robustness.margins import modulus_margin as modulus_margin
from armlock.robustness.margins import peak_gain as peak_gain
from armlock.robustness.perturbations import box_count as box_count
from armlock.robustness.perturbations import critical_perturbation as critical_perturbation
from armlock.robustness.perturbations import first_crossing as first_crossing
from armlock.robustness.perturbations import stable_half_differences as stable_half_differences
from armlock.robustness.varying import varying_radius as varying_radius
from armlock.stability.charts import StabilityChart as StabilityChart
from armlock.stability.charts import stability_chart as stability_chart
from armlock.stability.counts import BOUNDARY as BOUNDARY
from armlock.stability.counts import UNCONFINED as UNCONFINED
from armlock.stability.counts import UNDECIDED as UNDECIDED
from armlock.stability.counts import CountError as CountError
from armlock.stability.counts import unstable_roots as unstable_roots
from armlock.stability.dcurve import d_curve as d_curve
from armlock.stability.dcurve import d_curve_branches as d_curve_branches
from armlock.stability.dcurve import d_curve_line as d_curve_line
from armlock.stability.nyquist import AxisCrossings as AxisCrossings
from armlock.stability.nyquist import NyquistCurve as NyquistCurve
from armlock.stability.nyquist import axis_crossings as axis_crossings
from armlock.stability.nyquist import nyquist as nyquist
from armlock.stability.roots import CharacteristicRoots as CharacteristicRoots
from armlock.stability.roots import RootError as RootError
from armlock.stability.roots import characteristic_roots as characteristic_roots
from armlock.stability.roots import rightmost_root as rightmost_root
from armlock.stability.semidiscretization import semi_discretization as semi_discretization
from armlock.stability.semidiscretization import spectral_radius as spectral_radius
from armlock.stability.semidiscretization import transition_matrix as transition_matrix
from armlock.stability.windows import stable_delays as stable_delays
from armlock.systems import Controller as Controller
from armlock.systems import System as System
from armlock.systems import delay as delay
from armlock.systems import equation as equation
from armlock.systems import parameter as parameter
from armlock.systems import s as s
from armlock.timedomain.noise import LaserNoise as LaserNoise
from armlock.timedomain.noise import PerturbationNoise as PerturbationNoise
from armlock.timedomain.noise import ShapedNoise as ShapedNoise
from armlock.timedomain.responses import impulse_response as impulse_response
from armlock.timedomain.responses import step_info as step_info
from armlock.timedomain.responses import step_response as step_response
from armlock.timedomain.simulation import DivergenceError as DivergenceError
from armlock.timedomain.simulation import Simulation as Simulation
from armlock.timedomain.simulation import sampled_open_loop as sampled_open_loop
from armlock.timedomain.simulation import simulate as simulate
from armlock.timedomain.spectra import Spectrum as Spectrum
from armlock.timedomain.spectra import SpectrumEstimator as SpectrumEstimator
from armlock.timedomain.spectra import amplitude_spectrum as amplitude_spectrum

__version__ = "0.1.0"
__all__ = [
    name
    for name, value in globals().items()
    if not name.startswith("_") and not isinstance(value, _Module)
]


def __dir__() -> list[str]:
    """List what users call, and no inner modules."""
    return [*__all__, "__version__", "controllers", "orbits", "paper", "sensors"]


def __getattr__(name: str) -> _Module:
    """Import the orbits when they are asked for: SciPy's splines take half a second."""
    if name == "orbits":
        return importlib.import_module("armlock.orbits")
    raise AttributeError(f"module 'armlock' has no attribute {name!r}")
