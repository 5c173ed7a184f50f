"""How far a loop is from instability: in gain, phase, delay, distance and perturbations.

Each margin comes from a certified search of the axis and is confirmed by counts of roots; what
cannot be certified is refused.
"""

from armlock.engine.margins import Margins
from armlock.robustness.margins import margins, modulus_margin
from armlock.robustness.perturbations import (
    Crossing,
    box_count,
    critical_perturbation,
    first_crossing,
    no_root_crosses,
)

__all__ = [
    "Crossing",
    "Margins",
    "box_count",
    "critical_perturbation",
    "first_crossing",
    "margins",
    "modulus_margin",
    "no_root_crosses",
]
