"""Perturbations that a loop withstands: along a ray, over a box, and of its arms.

On a ray start + t direction the characteristic function is f + t g, over a box a convex
combination of those at its corners. `armlock.engine` finds the first t at which f + t g has a
zero on the imaginary axis, and tells whether no function of a box has one.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from flint import fmpq

from armlock.checks import (
    FloatArray,
    finite_series,
    positive_number,
    real_number,
    whole_steps,
)
from armlock.engine import decide
from armlock.engine.affine import Affine, NotAffineError
from armlock.engine.decide import Family
from armlock.engine.functions import Function, common_zeros
from armlock.engine.inclusion import TERM, VERTEX
from armlock.engine.polynomials import collected, exact, polynomial, rounded
from armlock.engine.tolerances import BOUNDARY, EPSILON, UNCONFINED
from armlock.loops import Loop, checked_loop
from armlock.robustness.margins import first_zero
from armlock.stability.counts import CountError, decided, unstable_roots
from armlock.systems import NOW, Delay, Lag, Sum, System, delay_object
from armlock.tables import Table, as_html, as_text, at, number

#: Numbers in the order of the parameters, or by name.
Point = Sequence[float] | FloatArray | Mapping[str, float]

# Nothing is looked at where the parameters are this many times as large as the start, or as 1.
_FARTHEST = 1e9
# Delays are moved up to this share of their mean, in steps down to that share of their start.
_FARTHEST_SHARE, _FINEST_STEP = 0.99, 1e-8
# Of a start on the boundary, crossings up to this share of its size, or of 1, are its own.
_NEXT_TO_START = fmpq(1, 10**10)
# The parameter of a ray.
_U = System(Sum.of(polynomial([1]), NOW, "u"), Sum.of(polynomial([1])), {"u": 0.0})


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

    def _table(self) -> Table:
        """Show the t of the crossing, and its frequency."""
        return Table("First crossing", [(f"t = {number(self.position)}", at(self.omega))])

    __repr__, _repr_html_ = as_text, as_html  # type: ignore[misc]


def _named(system: System, name: str, given: Any) -> dict[str, float]:
    """Return numbers by the names of parameters; by default those of the others are nominal."""
    if isinstance(given, Mapping):
        system.check_names(f"a name in {name}", given)
        return {k: real_number(k, v) for k, v in given.items()}
    flat = finite_series(name, given)
    if flat.size != len(system.parameters):
        raise ValueError(
            f"{name} must hold as many numbers as there are parameters, {system.parameters}, "
            f"got {flat.size}; {{}} as a start is the nominal point"
        )
    return dict(zip(system.parameters, flat.tolist(), strict=True))


class _Ray:
    """N and M along a ray, affine in u, with t = u scale."""

    def __init__(self, system: System, start: Point, direction: Point) -> None:
        self.system = system = System.of(system)
        way = _named(system, "direction", direction)
        if not any(way.values()):
            raise ValueError("direction must not have length zero")
        begin = system.given((), _named(system, "start", start))
        #: The names of the parameters, the start, and the direction in all of them.
        self.start = np.array([real_number(k, v) for k, v in begin.items()])
        self.way = np.array([way.get(name, 0.0) for name in begin])
        #: The t at which the point has moved by |start|, or by one if that is more.
        self.scale = max(1.0, float(np.hypot.reduce(self.start))) / float(
            np.hypot.reduce(self.way)
        )
        line = {k: System.of(begin[k]) + way[k] * _U for k in way}
        along = self._along(system.at(**{**begin, **line}), way)
        (self.n, dn), (self.m, dm) = along.n, along.m
        self.dn, self.dm = dn * self.scale, dm * self.scale
        self.f, self.g = self.n + self.m, self.dn + self.dm

    @staticmethod
    def _along(system: System, way: dict[str, float]) -> Affine:
        """Return a system, affine in the parameter of the ray, or say what is multiplied."""
        try:
            return system.affine_in(("u",))
        except NotAffineError:
            raise NotAffineError(
                "direction must change parameters that are not multiplied with each other or "
                f"with themselves, got {', '.join(way)}: change one of them, make the product "
                "a parameter, or count along the way: unstable_roots takes arrays of all"
            ) from None

    def point(self, u: float) -> FloatArray:
        """Return the parameters at a point of the ray."""
        return self.start + u * self.scale * self.way

    def count(self, u: float | fmpq) -> int:
        """Count the unstable roots of the closed loop at a point of the ray, exactly given."""
        n, m = self.n + self.dn * u, self.m + self.dm * u
        return decide.count(n + m, common_zeros(n, m))

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

    def begin(self) -> fmpq:
        """Return the u from which the ray is searched.

        Zero, so that nothing is skipped, unless the start has roots on the axis off s = 0, or
        leading terms leave two there.
        """
        here = self.f.leading()
        is_clear = here is not None and decide.count(self.f, here.order) != BOUNDARY
        if is_clear and self.leaving() >= 0:
            return fmpq(0)
        return _NEXT_TO_START

    def first(self, begin: fmpq, stop: float) -> Crossing:
        """Find the first crossing between two u, at its u."""
        f, nearest = self.f + self.g * begin, Crossing(stop - float(begin), np.nan)
        if step := self.system.step:
            # The axis of a map ends where D is real.
            here, change = (_at_the_end(function) for function in (f, self.g))
            at = float(rounded([-here / change])[0]) if change else np.nan
            if 0.0 < at < nearest.position:
                nearest = Crossing(at, np.pi / step)
        found = Crossing(*first_zero(f, self.g, nearest.position, 0.0))
        if np.isnan(found.omega):
            found = nearest
        if np.isnan(found.omega):
            return Crossing(np.inf, np.nan)
        return Crossing(float(begin) + found.position, found.omega)


def _at_the_end(function: Function) -> fmpq:
    """Return a function of a map at the end of its axis, s = j pi / step, exactly."""
    step = function.space.step
    terms = (
        p[0] * (-1) ** whole_steps("delay", float(theta), step)
        for theta, p in function.by_delay
    )
    return sum(terms, fmpq(0))


def first_crossing(
    system: System, start: Point, direction: Point, stop: float | None = None
) -> Crossing:
    """Find where a root first reaches the imaginary axis along a ray.

    Parameters
    ----------
    system : System
        The open loop, an equation, or a map.
    start : sequence of float, or dict by name
        Where the ray start + t direction begins: a number for each parameter, in the order of
        their first use. By name, the others are nominal, so that ``{}`` is the nominal point.
        A parameter without a nominal value has to be given.
    direction : sequence of float, or dict by name
        In which the parameters change. By name, the others stay where they start.
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
        If start or direction does not hold a finite real number for each parameter, the
        direction has length zero, the system is not affine along the ray, or stop is not
        positive.
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
    >>> from armlock import DualArm, first_crossing
    >>> edge = first_crossing(DualArm(gain=10.0), (1.0, 1.0), (1.0, 1.0), stop=3.0)
    >>> print(f"{edge.position:.6f} {edge.omega:.4f}")
    0.254006 3.7746
    """
    ray = _Ray(system, start, direction)
    stop = _FARTHEST if stop is None else positive_number("stop", stop) / ray.scale
    with decided("not decided", ray.start):
        u, omega = ray.first(ray.begin(), stop)
    return Crossing(u * ray.scale, omega)


def critical_perturbation(loop: System, direction: Point) -> float:
    r"""Return the smallest perturbation in a direction that breaks the loop.

    Parameters
    ----------
    loop : System
        The open loop, for instance `CommonArm()`, or an equation.
    direction : sequence of float, or dict by name
        How the parameters change from their nominal values, which are (1, 1) for a `Loop`:
        taken as given and not normalised.

    Returns
    -------
    float
        Smallest eps > 0 such that the count of the loop's unstable roots at the nominal
        values + eps direction is not zero: a root reaches the imaginary axis there, or the
        neutral root chain does. 0 if the loop is not stable next to the nominal values, inf if
        no eps breaks it, up to parameters of 1e9. What is excluded below it, `first_crossing`
        says.

    Raises
    ------
    TypeError, ValueError
        If the direction does not hold finite real numbers of parameters or has length zero, a
        parameter has no nominal value, the loop is not affine along the ray, or unstable at
        the nominal values themselves. A boundary point is allowed there.
    CountError
        If rounding, or the steps allowed, do not decide it, or the count half way to the result
        contradicts it. So far away as 1e8 a count may take too many steps: `first_crossing`
        with a `stop` then tells what happens up to there.

    See Also
    --------
    armlock.first_crossing : from other points, and with the frequency.

    Notes
    -----
    Along the ray D is affine in eps, and a root is at s = j omega where

    .. math::

        \varepsilon = -\frac{D}{\sum_k d_k\, \partial D / \partial x_k} \text{ is real.}

    Examples
    --------
    >>> from armlock import critical_perturbation, paper_loop
    >>> print(f"{critical_perturbation(paper_loop(), (0, -1)):.4e}")
    2.9286e-06
    """
    ray = _Ray(System.of(loop, "loop"), {}, direction)
    with decided("not decided", ray.start):
        at_start = ray.count(0.0)
        if at_start > 0 or at_start == UNCONFINED:
            raise ValueError(
                f"the loop must be stable at its nominal parameters to lose stability, but "
                f"unstable_roots gives {at_start}"
            )
        if ray.leaving() > 0:
            return 0.0
        begin = ray.begin()
        if begin and ray.count(begin) > 0:
            return 0.0
        u, _ = ray.first(begin, _FARTHEST)
        # Roots that are on the axis at the start may stay there.
        half = 0.5 * min(u, _FARTHEST)
        on_the_way = ray.count(half)
    if on_the_way != 0:
        raise CountError(
            f"the first crossing along {tuple(ray.way.tolist())} lies at {u * ray.scale}, but "
            f"half way there the count is {on_the_way}", ray.point(half)[None],
        )  # fmt: skip
    return u * ray.scale


def box_count(loop: System, size: float) -> int:
    r"""Count the unstable roots that all points of a box of parameters share.

    Parameters
    ----------
    loop : System
        The open loop, for instance `CommonArm()`, or an equation.
    size : float
        The box is that of all parameters that differ from their nominal value, which is (1, 1)
        for a `Loop`, by at most this. ``loop.at(c2=1.0)`` holds one of them.

    Returns
    -------
    int
        The number at all points of the box, certified. `BOUNDARY` where a root lies on the
        imaginary axis, or comes close to it, somewhere in the box; `UNCONFINED` where the
        neutral root chain is not confined somewhere, or not known to be.

    Raises
    ------
    TypeError, ValueError
        If the size is not positive, a parameter has no nominal value, or the loop is not affine
        in all of them together.
    CountError
        If it takes too many steps.

    Notes
    -----
    D is affine in the parameters, so that over a box its values at one frequency are the convex
    hull of those at the corners. Where no such hull on the whole axis holds zero, no root
    crosses the axis within the box, and all its points have the count of the centre. A pole of
    L at s = 0 that cancels at the centre makes a real root cross at s = 0 in every box.

    Examples
    --------
    >>> from armlock import box_count, paper_loop, robust_loop
    >>> [box_count(loop, 1e-6) for loop in (robust_loop(), paper_loop())]
    [0, 0]
    >>> box_count(paper_loop(), 1.5e-6)
    -1
    """
    system = System.of(loop, "loop")
    half = positive_number("size", size)
    point = [real_number(k, v) for k, v in system.given((), {}).items()]
    n, m = system.affine.quotient(*point)
    centre, terms = n + m, system.affine.terms[1:]
    corners = itertools.product((-half, half), repeat=len(terms))
    zero = (0.0,) * (1 + len(terms))
    family = Family([centre, *terms], [[(VERTEX, (1.0, *corner), zero) for corner in corners]])
    with decided("not decided", np.array(point)):
        if not np.isfinite(family.ends(0.0)):
            return UNCONFINED
        if not decide.excludes(family):
            return BOUNDARY
        return decide.count(centre, common_zeros(n, m))


def _by_powers(d: Sum, objects: tuple[Delay, Delay]) -> dict[tuple[int, ...], Sum]:
    """Sort the terms of a sum by the powers of some delay objects, which are taken out."""
    return collected(
        (
            tuple(dict(lag).get(one, 0) for one in objects),
            Sum.of(p, Lag(pair for pair in lag if pair[0] not in objects), *names),
        )
        for (lag, names), p in d.terms.items()
    )


def stable_half_differences(loop: Loop) -> tuple[float, float]:
    r"""Return half differences of the two arms between which a loop is stable.

    Parameters
    ----------
    loop : Loop
        For instance `paper_loop()`, at c1 = c2 = 1. Sensor, controller and the mean of the two
        delays stay.

    Returns
    -------
    low, high : float
        In s, within 0.99 times the mean of the delays. The loop is proven to be stable at
        every (tau1 - tau2) / 2 from low to high. A part in 10^8 further nothing is proven.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or not stable as it is.
    CountError
        If it takes too many steps.

    Notes
    -----
    Steps away from the loop are halved until no root crosses the imaginary axis on the way.
    With the mean T and half the difference x, on the axis,

    .. math::

        D &= D_0 + e^{-sT} \left[ D_+ \cos \psi - \mathrm{j} D_- \sin \psi \right] , \\
        \psi &= \omega x , \quad D_\pm = D_1 \pm D_2 ,

    where the delays stand before D_1 and D_2, so that at each frequency only the phase psi is
    open, on an arc. A term with the product of both does not depend on x.

    Examples
    --------
    The sensor of this loop divides by its own half difference of 0.1 s:

    >>> from armlock import paper_loop, stable_half_differences
    >>> low, high = stable_half_differences(paper_loop())
    >>> print(f"{low:.4f} s to {high:.4f} s")
    0.0202 s to 0.2454 s
    """
    loop = checked_loop(loop, "its arms are the two delays that grow apart")
    one, other = (delay_object(arm, "arm") for arm in loop.arms)
    mean = 0.5 * (float(one.theta) + float(other.theta))
    start = 0.5 * (float(one.theta) - float(other.theta))
    here = loop.at(**loop.nominal)
    at_start = unstable_roots(here)
    if at_start != 0:
        raise ValueError(f"loop must be stable as it is, but unstable_roots gives {at_start}")
    finest = _FINEST_STEP * (abs(start) or mean)
    arms = _Arms(here, (one, other), mean)
    edges = []
    for end in (-_FARTHEST_SHARE * mean, _FARTHEST_SHARE * mean):
        edge, step = start, end - start
        while edge != end and abs(step) > finest:
            x = edge + step
            if unstable_roots(arms.moved(here, x)) == 0 and arms.no_root_crosses(
                *sorted((edge, x))
            ):
                edge = x
            else:
                step *= 0.5
        edges.append(edge)
    return edges[0], edges[1]


class _Arms:
    """A system with two delays mean + x and mean - x, affine in each of them."""

    def __init__(self, here: System, arms: tuple[Delay, Delay], mean: float) -> None:
        self.arms, self.mean = arms, mean
        self.d = here.numerator + here.denominator
        self.point = np.array(list(here.nominal.values()))
        parts = _by_powers(self.d, arms)
        if set(parts) - {(0, 0), (1, 0), (0, 1), (1, 1)}:
            raise ValueError(f"D must be affine in each of the two delays, got {here!r}")
        d0, d1, d2, d12 = (parts.get(k, Sum({})) for k in ((0, 0), (1, 0), (0, 1), (1, 1)))
        leads = [self.function(part).leading() for part in (d1, d2) if part]
        # Up to the first power of s that delays act on, coefficients of D are affine in x.
        self.most_order = 1 + min((lead.order for lead in leads if lead), default=0)
        middle = Sum.of(polynomial([1]), Lag.after(exact(mean)))
        both, apart = (d1 + d2) * middle, (d1 + -d2) * middle
        names = [Sum.of(polynomial([1]), NOW, name) for name in ("both", "apart")]
        whole = d0 + d12 * middle * middle + both * names[0] + apart * names[1]
        nominal = {"both": 1.0, "apart": 0.0}
        rest, plus, minus = System(whole, Sum({}), nominal).affine.terms
        self.functions = [rest + plus, plus, minus * -1]

    def moved(self, system: System, x: float) -> System:
        """Return a system with its own two delays moved."""
        lengths = exact(self.mean + x), exact(self.mean - x)
        delays = dict(zip(self.arms, map(Delay.new, lengths), strict=True))

        def of(part: Sum) -> Sum:
            return Sum(
                {
                    (Lag.of({delays.get(k, k): n for k, n in lag}), names): p
                    for (lag, names), p in part.terms.items()
                }
            )

        return System(of(system.numerator), of(system.denominator))

    def function(self, part: Sum, x: float = 0.0) -> Function:
        """Return a sum with the two delays moved."""
        return self.moved(System(part, Sum({})), x).affine.n[0]

    def no_root_crosses(self, low: float, high: float) -> bool:
        """Tell whether no root crosses the axis in between; False decides nothing."""
        # What the mean, its sums with half differences and phases are rounded by.
        low, high = low - 8.0 * EPSILON * self.mean, high + 8.0 * EPSILON * self.mean
        ends = [self.function(self.d, x) for x in (low, high)]
        a, b = (end.leading() for end in ends)
        if a is None or b is None or not (a.order == b.order <= self.most_order):
            return False
        if a.direction != b.direction:
            return False
        longest = max(ends, key=lambda f: f.space.longest)
        begin = longest.radius(a.order, min(abs(a.coefficient), abs(b.coefficient)), 0.25)
        # Past some frequency any phases may do.
        free = (VERTEX, (1.0, -1.0, 0.0)), (TERM, (0.0, 0.5, 0.5)), (TERM, (0.0, 0.5, -0.5))
        test = [(*member, (0.0, 0.0, 0.0)) for member in free]
        arc = (0.0, low, 0.0, high), (0.0, 0.0, 0.0, 0.0)
        with decided("not decided", self.point):
            return decide.excludes(Family(self.functions, [test], arc), begin)
