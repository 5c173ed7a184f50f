"""Certified counts over a whole box of perturbations around (1, 1).

The box is covered with smaller ones of a known count.
"""

from __future__ import annotations

import math

import numpy as np

from armlock.axis.contour import winding
from armlock.axis.threads import interruptible
from armlock.checks import IntArray, positive_number
from armlock.loops import Loop, LoopAt, checked_loop
from armlock.robustness.free_phases import clear_above, count_at
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import BOUNDARY, CountError

#: Corners of a box as seen from its centre, each next to the one before.
CORNERS = np.array(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
# How often a box is cut in four before it is given up.
_CUTS = 8
# Most steps of all walks together: some five seconds.
_ALL_STEPS = 5e6


def box_counts(loop: Loop, size: float, free_above: float | None = None) -> IntArray:
    r"""Count the unstable roots over a whole box of perturbations.

    Parameters
    ----------
    loop : Loop
        The loop.
    size : float
        The box is that of all |c1 - 1| <= size and |c2 - 1| <= size.
    free_above : float, optional
        Angular frequency in rad/s above which both arms' phases are taken as free, to spare the
        time of a loop that rolls off late.

    Returns
    -------
    int array, shape (n,)
        Certified numbers of unstable roots in the n smaller boxes into which it was cut, each
        that of all points of one. `BOUNDARY` alone where no cut was fine enough: a root lies on
        the imaginary axis, or comes close to it, somewhere in the box; or where some phases
        above `free_above` let a root cross.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or the size or `free_above` is not positive.
    CountError
        As `unstable_roots` does, or if the smaller boxes take too many steps.

    Notes
    -----
    From the centre of a box of half its width r to any of its points, D changes by no more than
    r (|B1| + |B2|). Where a certified walk along the imaginary axis finds |D| larger than
    this, no root crosses the axis within the box, and all its points have one count. Otherwise
    it is cut in four, eight times at most. The smaller boxes meet, so that the count at (1, 1)
    is that of all.

    Examples
    --------
    >>> from armlock import paper_loop, robust_loop
    >>> from armlock.robustness.boxes import box_counts
    >>> [bool(box_counts(loop, 1e-6).any()) for loop in (robust_loop(), paper_loop())]
    [False, False]
    >>> box_counts(paper_loop(), 1.5e-6).tolist()
    [-1]
    """
    checked_loop(loop)
    size = positive_number("size", size)
    highest = _end_of_walks(loop, size, free_above)
    if highest is None:
        return np.array([BOUNDARY])
    left, clear, walked = [(1.0, 1.0, size)], 0, 0
    while left:
        c1, c2, half = left.pop()
        is_clear, steps = _stays_clear(loop, c1, c2, half, highest)
        walked += steps
        if walked > _ALL_STEPS:
            raise CountError(
                f"no counts over a box of size {size}: its parts take more than "
                f"{_ALL_STEPS:.0e} steps, because gain times delay is too large",
                np.array([[c1, c2]]),
            )
        if is_clear:
            clear += 1
        elif half < 1.5 * size * 0.5**_CUTS:
            return np.array([BOUNDARY])
        else:
            half *= 0.5
            left += [(c1 + half * d1, c2 + half * d2, half) for d1, d2 in CORNERS]
    return np.full(clear, count_at(LoopAt(loop, 1.0, 1.0), highest))


def _end_of_walks(loop: Loop, size: float, free_above: float | None) -> float | None:
    """Frequency up to which roots may cross in a box; None if some phases let one beyond."""
    if free_above is None:
        return math.inf
    highest = positive_number("free_above", free_above)
    return highest if clear_above(LoopAt(loop, 1.0 + size, 1.0 + size), highest) else None


def _stays_clear(
    loop: Loop, c1: float, c2: float, half: float, highest: float
) -> tuple[bool, int]:
    """Whether no point of a box has a root on the imaginary axis, as far as one walk tells.

    And how many steps that takes.
    """
    end = min(float(last_frequency(loop, abs(c1) + half, abs(c2) + half)), highest)
    if not np.isfinite(end):
        return False, 0
    whole, (_, b1, b2) = loop.sum_at(c1, c2), loop.on_boundary()
    # The centre is a rounded number itself.
    uncertain = (half + 1e-15) * (np.abs(b1.sums) + np.abs(b2.sums))
    followed = whole.compiled()._replace(uncertain=uncertain)
    _, _, clear, steps, _ = interruptible(winding, followed, 0.0, end)
    return bool(clear), steps
