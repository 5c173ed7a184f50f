"""What -1, -2 and -3 mean as a count, and every tolerance behind them.

A number of roots is certified, or the count is one of these three. A margin, a radius or a root
is certified, or an `UndecidedError` says why not. Each line below says what its number decides.

A bound of rounding errors is no tolerance. It is proved, and stands in the function that its
lemma names (the book's appendix "The lemmas behind a count").
"""

from __future__ import annotations

#: What a count is where a root lies on the axis, or rounding does not decide on which side.
BOUNDARY = -1
#: What a count is where infinitely many roots do not stay left of the axis.
UNCONFINED = -2
#: What a count among many is that takes too many steps; alone it raises an `UndecidedError`.
UNDECIDED = -3


class UndecidedError(RuntimeError):
    """Double precision, or the steps allowed, did not decide."""


#: The distance from 1 to the next float.
EPSILON = 2.0**-52

# ---------------------------------------------------------------- -1: on the axis, or undecided

#: An interval of the axis that is narrower than this share of its frequency is not halved.
NARROWEST = 4.0 * EPSILON
#: Nor is one that ends below this frequency in rad/s.
LOWEST = 1e-290
#: A number of roots, found from angles, may be off a whole number by this.
OFF_A_WHOLE_NUMBER = 1e-2
#: A search ends after so many undecided intervals.
FEW_UNDECIDED = 16
#: The rows of a chart end after so many of them, on average. Rounding hides much of the axis
#: where N is nearly a multiple of M.
MANY_UNDECIDED = 4096
#: Rounding hides D(0) at a point of a chart that is at most this share of its terms: the point
#: is counted with exact weights.
HIDDEN_AT_ZERO = 8.0 * EPSILON

# -------------------------------------------------------------- -2: the chain at high frequency

#: The chain is confined if the undelayed term exceeds the others by this share of all.
CONFINED = 16.0 * EPSILON
#: The end of the axis needs an excess of this share of all.
CONFINED_TO_THE_END = 64.0 * EPSILON
#: A margin needs this share of the undelayed term to be left.
CONFINED_IN_A_MARGIN = 256.0 * EPSILON
#: What such a margin leaves undecided next to the limit of the chain, as a share of that limit,
#: is the limit.
NEXT_TO_THE_LIMIT = 1e-6
# How finely the turn of L at high frequency is searched stands in `chain.py`, with the search.

# ------------------------------------------------------------------------ -3: too many steps

#: Most steps of a count, and of a search: up to ten seconds each. What only tries something
#: (`robustness/margins.py`, `stability/roots.py`) takes fewer.
STEPS_OF_A_COUNT, STEPS_OF_A_SEARCH = 1_500_000, 2_000_000
#: Most steps for some rows of a chart: some ten seconds.
STEPS_OF_ROWS = 3_000_000
