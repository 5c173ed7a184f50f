"""How many roots are unstable, where they are, and which parameters put one on the axis.

Counts, and the charts made of them, are certified: what rounding hides is -1, and a neutral
root chain that is not confined is -2.
"""

from armlock.engine.roots import RootError
from armlock.stability.charts import StabilityChart, stability_chart
from armlock.stability.counts import BOUNDARY, UNCONFINED, CountError, unstable_roots
from armlock.stability.dcurve import d_curve, d_curve_branches, d_curve_line
from armlock.stability.nyquist import AxisCrossings, NyquistCurve, axis_crossings, nyquist
from armlock.stability.roots import rightmost_root
from armlock.stability.semidiscretization import (
    semi_discretization,
    spectral_radius,
    transition_matrix,
)

__all__ = [
    "BOUNDARY",
    "UNCONFINED",
    "AxisCrossings",
    "CountError",
    "NyquistCurve",
    "RootError",
    "StabilityChart",
    "axis_crossings",
    "d_curve",
    "d_curve_branches",
    "d_curve_line",
    "nyquist",
    "rightmost_root",
    "semi_discretization",
    "spectral_radius",
    "stability_chart",
    "transition_matrix",
    "unstable_roots",
]
