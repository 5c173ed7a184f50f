"""The characteristic root with the largest real part, of loops, maps and systems with delays.

It is found and certified by `armlock.engine.roots`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from armlock.affine import quotient_at
from armlock.engine.functions import common_zeros
from armlock.engine.roots import rightmost_zero
from armlock.stability.counts import at_points
from armlock.systems import System


def rightmost_root(system: System, *values: npt.ArrayLike, **numbers: npt.ArrayLike) -> Any:
    r"""Return the characteristic root with the largest real part.

    Of an open loop it is a root of the closed loop, as `unstable_roots` counts these: a root
    s = 0 of D that numerator and denominator of L cancel is none. ``equation(1 + loop)`` keeps
    that root.

    Parameters
    ----------
    system : System
        The open loop L, for instance `CommonArm()`, an equation, or a map.
    *values, **numbers : array_like of float, optional
        The parameters, as `unstable_roots` takes them.

    Returns
    -------
    complex, or complex array of the broadcast shape
        In rad/s, rounded from extended precision; of a conjugate pair the one with Im >= 0.

    Raises
    ------
    TypeError, ValueError
        As `unstable_roots`, or if D has no root at all there because it is constant.
    RootError
        If no root can be certified within a few seconds; its `estimate` is the best candidate,
        nan if there is none.

    Notes
    -----
    Certified means that no root is counted right of Re s + m. Here m is 1e-11 of |s| or of one
    over the longest delay, whichever is larger. Where so fine a count is not decided, m is 1e-6
    of |Re s| or of one over the longest delay. Roots whose real parts differ by less than the
    first m count as equal, and the one of lowest frequency that was found is returned.

    The sign of a real part smaller than the second m is one that `unstable_roots` confirms.
    Where that count is not decided, the root is refused unless its real part is smaller than
    the first m.

    The real parts on a neutral root chain may tend to a limit that none of them reaches. Where
    no root lies right of it, a root up to m left of the limit is returned. If none is found
    there, the error names the limit. Without a delay the roots are those of a polynomial, and
    nothing is counted.

    For the Hayes equation it is, with the principal branch of Lambert's function,

    .. math::

        s = a + \frac{1}{\tau} W_0 \left( b\, \tau\, e^{-a\tau} \right) .

    Examples
    --------
    >>> from armlock import HayesEquation, rightmost_root
    >>> root = rightmost_root(HayesEquation(tau=1.0), 0.0, -1.0)
    >>> print(f"{root:.10f}")
    -0.3181315052+1.3372357014j
    """
    system, points, shape = at_points(system, values, numbers)
    found = []
    for point in points.tolist():
        n, m = quotient_at(system, point)
        found.append(rightmost_zero(n + m, common_zeros(n, m)))
    return np.array(found, np.complex128).reshape(shape) if shape else found[0]
