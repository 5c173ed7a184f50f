"""How far a loop is from instability: in gain, phase, delay, distance and perturbations.

Each margin comes from a certified search of the axis and is confirmed by counts of roots; what
cannot be certified is refused.
"""

from armlock.robustness.boxes import box_counts, edge_crossings
from armlock.robustness.gains import gain_interval
from armlock.robustness.margins import Margins, critical_perturbation, margins, modulus_margin
from armlock.robustness.rays import Crossing, Crossings, Ray, first_crossing

__all__ = [
    "Crossing",
    "Crossings",
    "Margins",
    "Ray",
    "box_counts",
    "critical_perturbation",
    "edge_crossings",
    "first_crossing",
    "gain_interval",
    "margins",
    "modulus_margin",
]
