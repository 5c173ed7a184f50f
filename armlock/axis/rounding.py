"""How far rounding may move a value of D on the axis: no further off, a point counts as -1.

The tolerances stand here, and the bound that they make for a piece of the axis. `winding` and
`imaginary_zeros` in `armlock.axis.contour` hold each value against it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armlock.axis.compiled import njit
from armlock.checks import FloatArray

if TYPE_CHECKING:
    from armlock.axis.exponentials import Piece

EPSILON = 2.0**-52
#: The rounding error of a value is at most ROUNDING EPSILON times the sum of magnitudes. A
#: point for which |D| comes no higher than that somewhere on the axis is a boundary point, with
#: the count -1. In units of EPSILON, one half for each operation: three for the phase of an
#: exponential and its sine, three for the products with it, two for weights and sums. What
#: grows with the degree n is in the magnitudes, which are multiplied by 1 + n / 4. That adds
#: 2 n: n for the coefficients (n factors, a product and a sum each), and n for Horner's rule.
ROUNDING = 8.0
#: In place of ROUNDING along a chart's row. It is larger, so that a point that may be a
#: boundary point is doubtful there, and counted on its own.
CAUTION = 8.0 * ROUNDING


@njit(cache=True)
def rounding_bound(piece: Piece, rounding: float) -> FloatArray:
    """Polynomial in u that bounds the rounding error of an exponential sum in a piece.

    A group counts with |phase| omega, which bounds |exp(j omega phase) - 1|.
    """
    sizes = piece.sizes
    groups, size = sizes.shape
    bound = np.zeros(size + 1)
    for k in range(size):
        bound[k] += rounding * EPSILON * sizes[0, k]
        for g in range(1, groups):
            error = rounding * EPSILON * sizes[g, k] * abs(piece.phases[g - 1])
            bound[k] += error * piece.start
            bound[k + 1] += error / piece.per_reach
    return bound
