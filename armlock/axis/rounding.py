"""How far rounding may move a value of D on the axis: where |D| is no larger, a count is -1.

`armlock.axis.exponentials.rounding_bound` makes a bound of these tolerances for a piece of the
axis, and the walks of `armlock.axis.contour` hold each value against it. Modules that compare
by other means state their tolerance beside the comparison.
"""

EPSILON = 2.0**-52
#: The rounding error of a value is at most ROUNDING EPSILON times the sum of magnitudes. A
#: point for which |D| comes no higher than that somewhere on the axis is a boundary point, with
#: the count -1. An operation rounds by half an EPSILON: the phase of an exponential and its
#: sine add 3 EPSILON, the products with it 3, weights and sums 2. What grows with the degree n
#: is in the magnitudes, which are multiplied by 1 + n / 4. That adds 2 n: n for the
#: coefficients (n factors, a product and a sum each), and n for Horner's rule.
ROUNDING = 8.0
#: In place of ROUNDING along a chart's row. It is larger, so that a point that may be a
#: boundary point is doubtful there, and counted on its own.
CAUTION = 8.0 * ROUNDING
