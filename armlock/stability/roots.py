"""The characteristic root with the largest real part, of loops, maps and systems with delays.

It is found and certified by `armlock.engine.roots`.
"""

from __future__ import annotations

from typing import overload

import numpy as np
import numpy.typing as npt

from armlock.characteristic import CharacteristicFunction, broadcast_parameters
from armlock.checks import ComplexArray
from armlock.delays import DelaySystem
from armlock.engine.roots import rightmost_zero
from armlock.stability.counts import require_certain


@overload
def rightmost_root(
    system: CharacteristicFunction | DelaySystem,
    c1: float | None = None,
    c2: float | None = None,
) -> complex: ...


@overload
def rightmost_root(
    system: CharacteristicFunction, c1: npt.ArrayLike, c2: npt.ArrayLike
) -> ComplexArray: ...


def rightmost_root(
    system: CharacteristicFunction | DelaySystem,
    c1: npt.ArrayLike | None = None,
    c2: npt.ArrayLike | None = None,
) -> complex | ComplexArray:
    r"""Return the characteristic root with the largest real part.

    Of a `Loop` it is a root of the closed loop, as `unstable_roots` counts these: a root s = 0
    of D that numerator and denominator of L cancel is none. ``loop.plain()`` keeps that root.

    Parameters
    ----------
    system : CharacteristicFunction or DelaySystem
        The loop, for instance `CommonArm()`, or a map; of a `DelaySystem` L the closed loop.
    c1, c2 : array_like of float, optional
        The two free parameters; they broadcast. Those of a loop are one if they are not given.
        Others, such as a and b of `HayesEquation`, have to be given.

    Returns
    -------
    complex, or complex array of the broadcast shape
        In rad/s, rounded from extended precision; of a conjugate pair the one with Im >= 0.

    Raises
    ------
    TypeError, ValueError
        If c1 or c2 is not finite and real, the two do not broadcast, or D has no root at all
        there because it is constant.
    CountError
        If a pole that may be meant to be zero changes the count, see `unstable_roots`.
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
    if isinstance(system, DelaySystem):
        require_certain(system)
        if c1 is not None or c2 is not None:
            raise TypeError(f"a DelaySystem has no free parameters, got {c1!r} and {c2!r}")
        n, m = system.functions
        return rightmost_zero(n + m, system.common)
    xs, ys = broadcast_parameters(system, c1, c2)
    require_certain(system, xs, ys)
    if xs.ndim == 0:
        return _at(system, float(xs), float(ys))
    flat = [_at(system, float(p), float(q)) for p, q in zip(xs.flat, ys.flat, strict=True)]
    return np.array(flat, dtype=np.complex128).reshape(xs.shape)


def _at(system: CharacteristicFunction, x: float, y: float) -> complex:
    """Return the rightmost root at one point."""
    return rightmost_zero(system.function(x, y), system.cancelled(x, y))
