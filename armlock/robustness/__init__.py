"""How far a loop is from instability: in gain, phase, delay, distance and perturbations.

Each margin comes from a certified search of the axis and is confirmed by counts of roots; what
cannot be certified is refused.
"""

from armlock.robustness.many import Many
from armlock.robustness.margins import Margins, PeakGain, margins, modulus_margin, peak_gain
from armlock.robustness.perturbations import (
    Crossing,
    box_count,
    critical_perturbation,
    first_crossing,
    stable_half_differences,
)
from armlock.robustness.varying import VaryingRadius, varying_radius

__all__ = [
    "Crossing",
    "Many",
    "Margins",
    "PeakGain",
    "VaryingRadius",
    "box_count",
    "critical_perturbation",
    "first_crossing",
    "margins",
    "modulus_margin",
    "peak_gain",
    "stable_half_differences",
    "varying_radius",
]
