"""Is a loop stable over a whole box of perturbations around (1, 1)? Two certificates.

One covers the box with smaller ones of a known count. The other looks for roots that cross the
axis along its edges: what takes a root across inside has to pass one of them.
"""

from __future__ import annotations

import math

import numpy as np

from armlock.axis.contour import winding
from armlock.checks import IntArray, positive_number
from armlock.loops import Loop, LoopAt, checked_loop
from armlock.robustness.free_phases import clear_above, count_at
from armlock.robustness.rays import Ray
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import BOUNDARY, UNCONFINED

#: Corners of a box as seen from its centre, each next to the one before.
CORNERS = np.array(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
# How often a box is cut in four before it is given up.
_CUTS = 6


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
        As `unstable_roots` does.

    Notes
    -----
    From the centre of a box of half its width r to any of its points, D changes by no more than
    r (|B1| + |B2|). Where a certified walk along the imaginary axis finds |D| larger than
    this, no root crosses the axis within the box, and all its points have one count. Otherwise
    it is cut in four, six times at most. The smaller boxes meet, so that the count at (1, 1) is
    that of all.

    Examples
    --------
    >>> from armlock import paper_loop, robust_loop
    >>> from armlock.robustness.boxes import box_counts
    >>> [box_counts(loop, 1e-6).tolist() for loop in (robust_loop(), paper_loop())]
    [[0], [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]]
    >>> box_counts(paper_loop(), 1.5e-6).tolist()
    [-1]
    """
    checked_loop(loop)
    size = positive_number("size", size)
    highest = _end_of_walks(loop, size, free_above)
    if highest is None:
        return np.array([BOUNDARY])
    left, clear = [(1.0, 1.0, size)], 0
    while left:
        c1, c2, half = left.pop()
        if _stays_clear(loop, c1, c2, half, highest):
            clear += 1
        elif half < 1.5 * size * 0.5**_CUTS:
            return np.array([BOUNDARY])
        else:
            half *= 0.5
            left += [(c1 + half * d1, c2 + half * d2, half) for d1, d2 in CORNERS]
    return np.full(clear, count_at(LoopAt(loop, 1.0, 1.0), highest))


def edge_crossings(loop: Loop, size: float, free_above: float | None = None) -> int:
    r"""Count the roots that cross the imaginary axis along the edges of a box.

    Parameters
    ----------
    loop : Loop
        The loop.
    size : float
        The box is that of all |c1 - 1| <= size and |c2 - 1| <= size.
    free_above : float, optional
        Angular frequency in rad/s above which both arms' phases are taken as free.

    Returns
    -------
    int
        Number of crossings, or `UNCONFINED` if some phases above `free_above` let a root cross
        for a perturbation of the box. With 0, and no unstable root at one point of the box, all
        of it is stable.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`; the size or `free_above` is not positive; or the neutral root
        chain is not confined over the box.
    CountError
        If gain times delay is too large to follow.

    Notes
    -----
    The perturbations with a root at s = j omega solve D(j omega) = 0, two real equations. They
    lie on curves that go with omega; where the equations depend on one another the curve goes
    to infinity, or is a line. So a curve that enters the box has to cross one of its edges.

    Examples
    --------
    >>> from armlock import paper_loop
    >>> from armlock.robustness.boxes import edge_crossings
    >>> [edge_crossings(paper_loop(), size) for size in (1e-6, 1.5e-6)]
    [0, 2]
    """
    checked_loop(loop)
    size = positive_number("size", size)
    highest = _end_of_walks(loop, size, free_above)
    if highest is None:
        return UNCONFINED
    intervals = [(0.0, highest)] if math.isfinite(highest) else None
    corners = 1.0 + size * CORNERS
    edges = np.roll(corners, -1, axis=0) - corners
    return sum(
        Ray(loop, corner, edge).crossings(1.0, intervals=intervals).position.size
        for corner, edge in zip(corners, edges, strict=True)
    )


def _end_of_walks(loop: Loop, size: float, free_above: float | None) -> float | None:
    """Frequency up to which roots may cross in a box; None if some phases let one beyond."""
    if free_above is None:
        return math.inf
    highest = positive_number("free_above", free_above)
    return highest if clear_above(LoopAt(loop, 1.0 + size, 1.0 + size), highest) else None


def _stays_clear(loop: Loop, c1: float, c2: float, half: float, highest: float) -> bool:
    """Whether no point of a box has a root on the imaginary axis, as far as one walk tells."""
    end = min(float(last_frequency(loop, abs(c1) + half, abs(c2) + half)), highest)
    if not np.isfinite(end):
        return False
    whole, (_, b1, b2) = loop.sum_at(c1, c2), loop.on_boundary()
    # The centre is a rounded number itself.
    uncertain = (half + 1e-15) * (np.abs(b1.sums) + np.abs(b2.sums))
    argument, _, clear = winding(whole.compiled(), uncertain, 0.0, end)
    return bool(clear) and not math.isnan(argument)
