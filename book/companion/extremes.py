"""Where a curve is highest or lowest, to more than the spacing of the points that show it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from armlock.checks import FloatArray

# Of the points that are higher than their neighbours, so many are refined, the highest first.
_PEAKS = 12


class Extreme(NamedTuple):
    """A largest or smallest value, and where it is."""

    at: float
    value: float


def largest(function: Callable[[Any], Any], points: FloatArray) -> Extreme:
    """Return the largest value of a function between the first and the last of some points.

    The points bracket the peaks, and each peak is then refined to rounding. This is no
    certificate: a peak that lies between two points and is not seen in them is missed.

    Parameters
    ----------
    function : callable
        Of an array, or of one number.
    points : float array, shape (n,)
        Ascending, several to the narrowest peak.

    Returns
    -------
    Extreme

    Examples
    --------
    >>> import numpy as np
    >>> from book.companion.extremes import largest
    >>> print("{:.6f} {:.6f}".format(*largest(np.sin, np.arange(6.0))))
    1.570796 1.000000
    """
    values = np.asarray(function(points), dtype=float)
    padded = np.concatenate(([-np.inf], values, [-np.inf]))
    peaks = np.flatnonzero((values >= padded[:-2]) & (values >= padded[2:]))
    found = []
    for k in peaks[np.argsort(values[peaks])][-_PEAKS:]:
        low, high = points[max(k - 1, 0)], points[min(k + 1, points.size - 1)]
        refined = minimize_scalar(
            lambda x: -float(function(x)),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-9 * (high - low)},
        )
        # The end of the range, where it is the highest, is not reached by the refinement.
        found.append(max((-refined.fun, float(refined.x)), (values[k], float(points[k]))))
    value, at = max(found)
    return Extreme(at, float(value))


def smallest(function: Callable[[Any], Any], points: FloatArray) -> Extreme:
    """Return the smallest value of a function, as `largest` does the largest.

    Parameters
    ----------
    function : callable
        Of an array, or of one number.
    points : float array, shape (n,)
        Ascending, several to the narrowest dip.

    Returns
    -------
    Extreme
    """
    at, value = largest(lambda x: -np.asarray(function(x)), points)
    return Extreme(at, -value)
