"""Where the imaginary part of an exponential sum vanishes along the axis, and where it may.

The walk is that of `armlock.axis.contour`, where it also stands what a hidden stretch is, and
what each caller does with it. Most ask a count beside the parameters that it may stand for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import elementwise

from armlock.axis import contour
from armlock.axis.exponentials import ExponentialSum, without_unused
from armlock.axis.rounding import ROUNDING
from armlock.axis.threads import MOST_STEPS, interruptible
from armlock.checks import BoolArray, FloatArray, IntArray
from armlock.stability.counts import BOUNDARY, CountError

# A count that cannot be told at a point is looked for beside it, up to this share of t.
_FARTHEST_BESIDE = 1e-3
_NO_POINTS = np.empty((0, 2))


class AxisZeros(NamedTuple):
    """Zeros of an imaginary part along the axis, and hidden stretches, ascending by interval.

    Columns of `armlock.axis.contour.imaginary_zeros`.

    Attributes
    ----------
    omega, width : float array, shape (n,)
        Where, in rad/s, and how far rounding lets it move or a stretch reaches to either side.
    jump : int array, shape (n,)
        Twice the sign of the change; once at an end of the axis.
    hidden : bool array, shape (n,)
        Whether it is a hidden stretch.
    position, spread : float array, shape (n,)
        The real part over the measure, and how far from it that may be within the width;
        without a measure the real part and the size of the slope.
    """

    omega: FloatArray
    jump: IntArray
    width: FloatArray
    hidden: BoolArray
    position: FloatArray
    spread: FloatArray


def axis_zeros(
    whole: ExponentialSum,
    intervals: npt.ArrayLike,
    measure: ExponentialSum | None = None,
    *,
    is_map: bool = False,
) -> AxisZeros:
    """Zeros of the imaginary part of an exponential sum on intervals of the axis.

    The intervals have shape (n, 2), in rad/s; a map has one, up to pi / step. The measure is a
    positive sum of the same polynomials.

    Raises
    ------
    CountError
        If the walk takes too many steps, a number overflows, or the sum vanishes to rounding.
    """
    sums = without_unused(whole) if measure is None else without_unused(whole, measure)
    if not sums[0].polynomials:
        raise CountError("no crossings: rounding hides all of the sum that crosses", _NO_POINTS)
    summed = [one.compiled() for one in sums]
    under = None if measure is None else summed[1]
    parts = [np.empty((0, 6))]
    for start, end in np.reshape(intervals, (-1, 2)):
        if not np.isfinite(end):
            raise CountError(
                f"no crossings up to omega = {end}: a number overflows", _NO_POINTS
            )
        zeros, complete = interruptible(
            contour.imaginary_zeros, summed[0], under, start, end, is_map, ROUNDING
        )
        if not complete:
            raise CountError(
                f"no crossings up to omega = {end} rad/s: more than {MOST_STEPS:.0e} "
                f"steps, because gain times delay is too large",
                _NO_POINTS,
            )
        parts.append(zeros)
    zeros = np.concatenate(parts)
    return AxisZeros(
        zeros[:, contour.OMEGA],
        zeros[:, contour.JUMP].astype(np.int64),
        zeros[:, contour.WIDTH],
        zeros[:, contour.HIDDEN] > 0.0,
        zeros[:, contour.POSITION],
        zeros[:, contour.SPREAD],
    )


def polished(
    function: Callable[[FloatArray], FloatArray],
    omega: FloatArray,
    reaches: Iterable[FloatArray],
) -> FloatArray:
    """Zeros of a function next to those that `axis_zeros` found on the expanded sums.

    The reaches are half-widths in rad/s, ascending. Each zero is looked for within the first of
    them over which the sign changes. Where there is none, it stays as `axis_zeros` left it.
    """
    omega, left = omega.copy(), np.arange(omega.size)
    for reach in reaches:
        if not left.size:
            break
        low, high = omega[left] - reach[left], omega[left] + reach[left]
        enclosed = function(low) * function(high) < 0.0
        if enclosed.any():
            ends, exact = (low[enclosed], high[enclosed]), {"xatol": 0.0, "xrtol": 1e-15}
            found = elementwise.find_root(function, ends, tolerances=exact)
            omega[left[enclosed]] = found.x
        left = left[~enclosed]
    return omega


def count_beside(
    count: Callable[[float], int], t: float, side: int, nearest: float, scale: float = 1.0
) -> tuple[float, int]:
    """Count the unstable roots next to a parameter t on which the loop depends.

    At t times 1 + side `nearest`, and as long as that cannot be told farther away, up to a
    thousandth. At t = 0, past which alone there is something, at shares of `scale`. Returns the
    place and the count, that may still be below zero: then it is no confirmation.
    """
    place, found = t, BOUNDARY
    for share in (nearest, *np.geomspace(max(nearest, 1e-9), _FARTHEST_BESIDE, 4)):
        place = float(t * (1.0 + side * share) if t else share * scale)
        found = count(place)
        if found != BOUNDARY:
            break
    return place, found
