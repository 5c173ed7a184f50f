"""How far a stable loop is from instability: gain, phase, delay and modulus margins.

`margins` and `modulus_margin` state a loop for the engine, which certifies each margin: no
smaller one exists, to a part in a million (`armlock.engine.margins`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from armlock.checks import positive_number, real_number
from armlock.delays import DelaySystem
from armlock.engine.decide import UndecidedError
from armlock.engine.functions import Function
from armlock.engine.margins import Margins, margins_of, modulus_of
from armlock.loops import Loop, LoopAt, checked_loop
from armlock.robustness.free_phases import no_margin
from armlock.robustness.rays import FARTHEST, Ray
from armlock.stability.counts import BOUNDARY, UNCONFINED, CountError

_T = TypeVar("_T")

# So close to (1, 1), relative, a loop is as stable as next to it.
_NEXT_TO_START = 1e-9


def _certified(
    compute: Callable[[Function, Function], _T], loop: Loop | DelaySystem, c1: float, c2: float
) -> _T:
    """Return what the engine makes of numerator and denominator of a loop."""
    if isinstance(loop, DelaySystem):
        if (c1, c2) != (1.0, 1.0):
            raise TypeError(f"a DelaySystem has no free parameters, got c1 = {c1}, c2 = {c2}")
        n, m = loop.functions
    else:
        n, m = checked_loop(loop).quotient(real_number("c1", c1), real_number("c2", c2))
    try:
        return compute(n, m)
    except UndecidedError as error:
        raise CountError(f"no margin: {error}", np.array([[c1, c2]])) from None


def modulus_margin(loop: Loop | DelaySystem, c1: float = 1.0, c2: float = 1.0) -> float:
    r"""Smallest distance of the Nyquist curve from -1, min over omega of |1 + L|.

    .. math::

        \inf_{\omega > 0} |1 + L(\mathrm{j}\omega; c_1, c_2)|

    It is one over the peak of the sensitivity.

    Parameters
    ----------
    loop : Loop or DelaySystem
        The loop, stable or not.
    c1, c2 : float, optional
        Multiplicative perturbations of a `Loop`.

    Returns
    -------
    float
        The infimum over all omega > 0, the limit at high frequency included, to a part in a
        million. For a neutral loop that limit is taken over all small changes of the delays: it
        is 0 where the neutral root chain is not confined.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no loop, or c1 or c2 is not finite and real.
    CountError
        If double precision, or the steps allowed, do not decide it.

    Examples
    --------
    >>> from armlock import modulus_margin, paper_loop
    >>> print(f"{modulus_margin(paper_loop()):.4f}")
    0.6156
    """
    return _certified(lambda n, m: modulus_of(n, m)[0], loop, c1, c2)


def margins(
    loop: Loop | DelaySystem,
    c1: float = 1.0,
    c2: float = 1.0,
    *,
    free_above: float | None = None,
) -> Margins:
    r"""Compute all margins of a stable loop.

    Parameters
    ----------
    loop : Loop or DelaySystem
        The loop.
    c1, c2 : float, optional
        Multiplicative perturbations of a `Loop`.
    free_above : float, optional
        Angular frequency in rad/s above which the phases of both arms are taken as free, as
        they are once the arms have drifted by a fraction of the modulation's wavelength: the
        margins then hold for all of them. By default the phases are those of the delays, at
        all frequencies.

    Returns
    -------
    Margins

    Raises
    ------
    TypeError, ValueError
        If `loop` is no loop, c1 or c2 is not finite and real, `free_above` is not positive, or
        the loop is not stable there.
    CountError
        If double precision, or the steps allowed, do not decide a margin.

    Notes
    -----
    Stable means that all roots of the closed loop lie in the left half-plane. A root at s = 0
    that numerator and denominator of L have in common is none of them.

    Phase and delay margins are taken over all crossovers. A neutral loop may have infinitely
    many crossovers, which approach those of its limit at high frequency.

    With free phases, L fills a disc: with the sensor's weights m1 and m2

    .. math::

        \left| L - K e^{-s\delta} (m_1 + m_2) \right|
        \le |K| \left( |c_1 m_1| + |c_2 m_2| \right) .

    The distances from -1 of this disc, and of its share of the unit circle, are known in
    closed form at each frequency; their minima over frequency are certified to 1e-5. A disc
    that holds -1 has margins of zero. A gain interval is not given: the edge of such a disc may
    run along the real axis.
    With equal weights m and c1 = c2 = 1 the disc has the centre 2 K m exp(-s delay), and a
    radius of the same magnitude: it stays clear of -1, for arms of any lengths, where
    Re [K m exp(-s delay)] > -1/4.

    Examples
    --------
    >>> import math
    >>> from armlock import margins, paper_loop
    >>> print(f"{math.degrees(margins(paper_loop()).phase):.1f} degrees")
    36.0 degrees
    """
    if free_above is None:
        return _certified(margins_of, loop, c1, c2)
    above = positive_number("free_above", free_above)
    if isinstance(loop, DelaySystem):
        raise TypeError(f"free_above is for a Loop and its arms, got {free_above}")
    free = checked_loop(loop).with_free_phases(
        real_number("c1", c1), real_number("c2", c2), above
    )
    return _certified(partial(margins_of, free=free), loop, c1, c2)


def critical_perturbation(loop: Loop, direction: npt.ArrayLike) -> float:
    r"""Return the smallest perturbation of (1, 1) in a direction that breaks the loop.

    Parameters
    ----------
    loop : Loop
        The loop.
    direction : array_like of two floats
        (d1, d2), taken as given and not normalised.

    Returns
    -------
    float
        Smallest eps > 0 such that the count of the loop's unstable roots at (1, 1) +
        eps (d1, d2), `armlock.stability.counts.loop_count`, is not zero: a root reaches the
        imaginary axis there, or the neutral root chain does. 0 if the loop is not stable next
        to (1, 1), inf if no eps breaks it, up to parameters of 1e9. How near to the limit of
        the chain roots are followed, `armlock.robustness.rays.first_crossing` says.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, the direction is not two finite real numbers or has length
        zero, or the loop is unstable at (1, 1) itself. A boundary point is allowed there.
    CountError
        If the counts next to (1, 1) cannot be told, or those on the two sides of the result
        contradict it, or gain times delay is too large to follow.

    See Also
    --------
    armlock.robustness.rays.first_crossing : from other points, and with the frequency.

    Notes
    -----
    Along the ray D is affine in eps, and a root is at s = j omega where

    .. math::

        \varepsilon = \frac{D(s; 1, 1)\, e^{s\delta}}
        {d_1 B_1 e^{-s\tau_1} + d_2 B_2 e^{-s\tau_2}} \text{ is real.}

    Examples
    --------
    >>> from armlock import critical_perturbation, paper_loop
    >>> print(f"{critical_perturbation(paper_loop(), (0, -1)):.4e}")
    2.9286e-06
    """
    ray = Ray(checked_loop(loop), (1.0, 1.0), direction)
    at_start = ray.count(0.0)
    if at_start > 0 or at_start == UNCONFINED:
        raise ValueError(
            f"the loop must be stable at (c1, c2) = (1, 1) to lose stability, but "
            f"loop_count gives {at_start}"
        )
    # From there a root at s = 0 that cancels at (1, 1) may turn into the loop's own.
    may_leave_zero = at_start != 0 or LoopAt(loop, 1.0, 1.0).at_zero()[0] > 0
    where_to = ray.from_zero() if may_leave_zero else 0
    if where_to > 0:
        return 0.0
    if may_leave_zero and not (where_to < 0 and at_start == 0):
        nearest, count = ray.count_beside(0.0, 1, _NEXT_TO_START)
        if count == BOUNDARY:
            where = ray.at(nearest)
            why = f"the counts next to (1, 1), up to {where}, cannot be told"
            raise no_margin(LoopAt(loop, *where), why)
        if count != 0 and nearest == _NEXT_TO_START * ray.scale:
            return 0.0
    farthest = FARTHEST * ray.scale
    eps = ray.first(farthest).position
    if eps < np.inf:
        # So close to the result, rounding may hide on which side of the boundary a point is:
        # then a count farther away tells.
        beside = [ray.count_beside(eps, side, 1e-6)[1] for side in (-1, 1)]
        counts = [ray.count(0.5 * eps), *beside]
        agree = counts[:2] == [0, 0] and counts[2] not in (0, BOUNDARY)
    else:
        counts = [ray.count(0.5 * farthest)] if ray.acts() else []
        agree = not any(counts)
    if not agree:
        raise CountError(
            f"the first crossing along {tuple(ray.direction.tolist())} lies at {eps}, but "
            f"counts on the way there and past it contradict it: {counts}",
            np.array([ray.at(min(eps, farthest))]),
        )
    return eps
