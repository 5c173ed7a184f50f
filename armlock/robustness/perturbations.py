"""Perturbations that a loop withstands: along a ray, over a box, and of its arms.

On a ray start + t direction the characteristic function is f + t g, over a box a convex
combination of those at its corners. `armlock.engine` finds the first t at which f + t g has a
zero on the imaginary axis, and tells whether no function of a box has one.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import axis, positive_number, real_number
from armlock.engine import decide
from armlock.engine.decide import BOUNDARY, UNCONFINED, Family
from armlock.engine.functions import Function, common_zeros
from armlock.engine.inclusion import EPSILON, TERM, VERTEX
from armlock.engine.margins import first_zero
from armlock.loops import Loop, checked_loop
from armlock.stability.counts import CountError, decided, require_certain

# Nothing is looked at where the parameters are this many times as large as the start, or as 1.
_FARTHEST = 1e9
# Of a start on the boundary, crossings up to this share of its size, or of 1, are its own.
_NEXT_TO_START = Fraction(1, 10**10)


class Crossing(NamedTuple):
    """Where a root first reaches the imaginary axis; (inf, nan) where none does.

    Attributes
    ----------
    position : float
        The t of the point start + t direction.
    omega : float
        Frequency of the root in rad/s; 0, or for a map pi / step, for a real one. inf at the
        limit of the neutral root chain.
    """

    position: float
    omega: float


class _Ray:
    """D along a ray, f + u g with t = u scale."""

    def __init__(
        self, system: CharacteristicFunction, start: npt.ArrayLike, direction: npt.ArrayLike
    ) -> None:
        self.system = checked_system(system)
        begin, way = axis("start", start), axis("direction", direction)
        for name, value in (("start", begin), ("direction", way)):
            if value.size != 2:
                raise ValueError(f"{name} must hold two numbers, got {value.size}")
        if not way.any():
            raise ValueError("direction must not have length zero, got (0, 0)")
        #: The t at which the point has moved by |start|, or by one if that is more.
        self.scale = max(1.0, float(np.hypot(*begin))) / float(np.hypot(*way))
        self.start, (d1, d2) = begin.tolist(), way.tolist()
        require_certain(system, *self.start)
        _, _, first, second = system.terms
        self.f = system.function(*self.start)
        self.g = (first * -d1 + second * -d2) * self.scale

    def count(self, u: float | Fraction) -> int:
        """Count the unstable roots of the closed loop at a point of the ray, exactly given."""
        d, below = self.f + self.g * u, self.system.terms.rest
        return decide.count(d, common_zeros(d + below * -1, below))

    def leaving(self) -> int:
        """Tell where roots of the start at s = 0 go, by the leading terms of f and g.

        With p s^k and q s^m, d = k - m roots leave as s^d = -u q / p. Returns 1 if one of them
        goes right, 0 if none does, and -1 if two stay on the axis as far as these terms tell.
        """
        here, change = self.f.leading(), self.g.leading()
        if here is None or change is None or here.order <= change.order:
            return 0
        number = here.order - change.order
        opposed = (here.coefficient > 0) != (change.coefficient > 0)
        return 1 if opposed or number > 2 else 1 - int(number)

    def begin(self) -> Fraction:
        """Return the u from which the ray is searched.

        Zero, so that nothing is skipped, unless the start has roots on the axis off s = 0, or
        leading terms leave two there.
        """
        here = self.f.leading()
        is_clear = here is not None and decide.count(self.f, here.order) != BOUNDARY
        if is_clear and self.leaving() >= 0:
            return Fraction(0)
        return _NEXT_TO_START

    def first(self, begin: Fraction, stop: float) -> Crossing:
        """Find the first crossing between two u, at its u."""
        f, nearest = self.f + self.g * begin, Crossing(stop - float(begin), np.nan)
        if step := self.system.step:
            # The axis of a map ends where D is real.
            here, change = (_at_the_end(function) for function in (f, self.g))
            if change and 0 < -here / change < nearest.position:
                nearest = Crossing(float(-here / change), np.pi / step)
        found = Crossing(*first_zero(f, self.g, nearest.position, 0.0))
        if np.isnan(found.omega):
            found = nearest
        if np.isnan(found.omega):
            return Crossing(np.inf, np.nan)
        return Crossing(float(begin) + found.position, found.omega)


def _at_the_end(function: Function) -> Fraction:
    """Return a function of a map at the end of its axis, s = j pi / step, exactly."""
    step = Fraction(function.space.step)
    turns = [(-1) ** int(theta / step) - 1 for theta in function.space.delays]
    return Fraction(function.steady.sum() + (function.delayed @ turns).sum())


def first_crossing(
    system: CharacteristicFunction,
    start: npt.ArrayLike,
    direction: npt.ArrayLike,
    stop: float | None = None,
) -> Crossing:
    """Find where a root first reaches the imaginary axis along a ray.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, or a map.
    start, direction : array_like of two floats
        The ray start + t direction in the plane of the free parameters.
    stop : float, optional
        Largest t that is looked at; by default one at which the parameters are 1e9 times as
        large as the start, or as one.

    Returns
    -------
    Crossing
        The one of smallest t > 0. A smaller one by more than a part in a million is excluded.

    Raises
    ------
    TypeError, ValueError
        If start or direction is not two finite real numbers, the direction has length zero, or
        stop is not positive.
    CountError
        If rounding, or the steps allowed, do not decide it.

    Notes
    -----
    A root at s = 0 of the start itself is no crossing: leading terms tell, exactly, how it
    leaves. With other roots on the axis at the start, or two that leading terms leave there,
    the search begins at a share of 1e-10 of the start, or of 1: crossings up to there are the
    start's own. At the limit of the neutral root chain, roots cross at ever higher frequency:
    the limit is returned in place of those that cross within a part in 1e5 of it.

    Examples
    --------
    >>> from armlock import DualArm
    >>> from armlock.robustness import first_crossing
    >>> edge = first_crossing(DualArm(gain=10.0), (1.0, 1.0), (1.0, 1.0), stop=3.0)
    >>> print(f"{edge.position:.6f} {edge.omega:.4f}")
    0.254006 3.7746
    """
    ray = _Ray(system, start, direction)
    stop = _FARTHEST if stop is None else positive_number("stop", stop) / ray.scale
    with decided("not decided", np.array([ray.start])):
        u, omega = ray.first(ray.begin(), stop)
    return Crossing(u * ray.scale, omega)


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
        eps (d1, d2) is not zero: a root reaches the imaginary axis there, or the neutral root
        chain does. 0 if the loop is not stable next to (1, 1), inf if no eps breaks it, up to
        parameters of 1e9. What is excluded below it, `first_crossing` says.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, the direction is not two finite real numbers or has length
        zero, or the loop is unstable at (1, 1) itself. A boundary point is allowed there.
    CountError
        If rounding, or the steps allowed, do not decide it, or the counts on the two sides of
        the result contradict it.

    See Also
    --------
    armlock.robustness.first_crossing : from other points, and with the frequency.

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
    ray = _Ray(checked_loop(loop), (1.0, 1.0), direction)
    with decided("not decided", np.ones((1, 2))):
        at_start = ray.count(0.0)
        if at_start > 0 or at_start == UNCONFINED:
            raise ValueError(
                f"the loop must be stable at (c1, c2) = (1, 1) to lose stability, but "
                f"unstable_roots gives {at_start}"
            )
        if ray.leaving() > 0:
            return 0.0
        begin = ray.begin()
        if begin and ray.count(begin) > 0:
            return 0.0
        u, omega = ray.first(begin, _FARTHEST)
        counts = [ray.count(0.5 * min(u, _FARTHEST))]
        # So close to the result, rounding may hide on which side of the boundary a point is;
        # and next to the limit of the chain, roots cross that are not looked for.
        shares = (1e-4, 1e-3) if omega == np.inf else (1e-6, 1e-5, 1e-4, 1e-3)
        for share in shares if u < np.inf else ():
            counts[1:] = [ray.count(u * (1.0 + way * share)) for way in (-1.0, 1.0)]
            if BOUNDARY not in counts[1:]:
                break
    eps = u * ray.scale
    if any(counts[:2]) or counts[2:] in ([0], [BOUNDARY]):
        way = axis("direction", direction)
        raise CountError(
            f"the first crossing along {tuple(way.tolist())} lies at {eps}, but counts on the "
            f"way there and past it contradict it: {counts}",
            1.0 + np.array([min(u, _FARTHEST) * ray.scale * way]),
        )
    return eps


def box_count(loop: Loop, size: float) -> int:
    r"""Count the unstable roots that all points of a box of perturbations share.

    Parameters
    ----------
    loop : Loop
        The loop.
    size : float
        The box is that of all |c1 - 1| <= size and |c2 - 1| <= size.

    Returns
    -------
    int
        The number at all points of the box, certified. `BOUNDARY` where a root lies on the
        imaginary axis, or comes close to it, somewhere in the box; `UNCONFINED` where the
        neutral root chain is not confined somewhere.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or the size is not positive.
    CountError
        If it takes too many steps.

    Notes
    -----
    D is affine in c1 and c2, so that over a box its values at one frequency are the convex hull
    of those at the four corners. Where no such hull on the whole axis holds zero, no root
    crosses the axis within the box, and all its points have the count of (1, 1). A pole of L at
    s = 0 that cancels at (1, 1) makes a real root cross at s = 0 in every box.

    Examples
    --------
    >>> from armlock import paper_loop, robust_loop
    >>> from armlock.robustness import box_count
    >>> [box_count(loop, 1e-6) for loop in (robust_loop(), paper_loop())]
    [0, 0]
    >>> box_count(paper_loop(), 1.5e-6)
    -1
    """
    size = positive_number("size", size)
    require_certain(checked_loop(loop))
    centre, terms = checked_loop(loop).function(1.0, 1.0), loop.terms
    signs = [(a, b) for a in (-size, size) for b in (-size, size)]
    corners = [(VERTEX, (1.0, a, b), (0.0, 0.0, 0.0)) for a, b in signs]
    family = Family([centre, terms.first, terms.second], [corners])
    with decided("not decided", np.ones((1, 2))):
        if not np.isfinite(family.ends(0.0)):
            return UNCONFINED
        return decide.count(centre) if decide.excludes(family) else BOUNDARY


def no_root_crosses(loop: Loop, low: float, high: float) -> bool:
    r"""Tell whether no root crosses the imaginary axis while two round trips grow apart.

    Parameters
    ----------
    loop : Loop
        The loop, at c1 = c2 = 1. Sensor, controller and the mean of the round trips stay.
    low, high : float
        Half differences (tau1 - tau2) / 2 in s, ascending.

    Returns
    -------
    bool
        True is certified: the number of unstable roots is the same for all half differences
        from low to high, and none lies on the axis but at s = 0. False decides nothing.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or the half differences do not ascend, or leave a round trip no
        longer than zero.
    CountError
        If it takes too many steps.

    Notes
    -----
    With the mean T and half the difference x, on the axis,

    .. math::

        D &= R + e^{-s\delta} \left[ S \left( 1 - e^{-sT} \cos \psi \right)
        + \mathrm{j} Q\, e^{-sT} \sin \psi \right] , \\
        \psi &= \omega x , \quad S = B_1 + B_2 , \quad Q = B_1 - B_2 ,

    so that at each frequency only the phase psi is open, on an arc.

    Examples
    --------
    As stable between a third of the held half difference of 0.1 s and twice it as at 0.1 s:

    >>> from armlock import paper_loop
    >>> from armlock.robustness import no_root_crosses
    >>> no_root_crosses(paper_loop(), 0.03, 0.2)
    True
    """
    mean = 0.5 * (checked_loop(loop).tau1 + loop.tau2)
    low, high = real_number("low", low), real_number("high", high)
    if not -mean < low <= high < mean:
        raise ValueError(
            f"low and high must ascend between -{mean} and {mean} s, the mean of the round "
            f"trips, got {low} and {high}"
        )
    # What the mean, its sums with half differences and phases are rounded by.
    low, high = low - 8.0 * EPSILON * mean, high + 8.0 * EPSILON * mean

    def between(tau1: float, tau2: float) -> Loop:
        return Loop(loop.controller, loop.mapping, tau1, tau2, loop.delay)

    terms = between(mean, mean).terms
    ends = [between(mean + x, mean - x).function(1.0, 1.0).leading() for x in (low, high)]
    arms = [lead.order for f in (terms.first, terms.second) if (lead := f.leading())]
    a, b = ends
    # Up to the first power of s that delays act on, coefficients of D are affine in x.
    if a is None or b is None or not (a.order == b.order <= 1 + min(arms)):
        return False
    if a.direction != b.direction:
        return False
    longest = between(mean + high, mean - low).function(1.0, 1.0)
    begin = longest.radius(a.order, min(abs(a.coefficient), abs(b.coefficient)), 0.25)
    # Past some frequency any phases may do.
    free = (VERTEX, (1.0, -1.0, 0.0)), (TERM, (0.0, 0.5, 0.5)), (TERM, (0.0, 0.5, -0.5))
    test = [(*member, (0.0, 0.0, 0.0)) for member in free]
    both, apart = (terms.first + terms.second) * -1, terms.first + terms.second * -1
    functions = [terms.constant + both, both, apart]
    arc = (0.0, low, 0.0, high), (0.0, 0.0, 0.0, 0.0)
    with decided("not decided", np.ones((1, 2))):
        return decide.excludes(Family(functions, [test], arc), begin)
