"""Along a ray of the parameter plane: every crossing of the axis, and the first break.

On a ray (x, y) = start + t (d1, d2) the characteristic function is D0 - t M, with D0 its value
at the start, and M = d1 B1 exp(-s theta1) + d2 B2 exp(-s theta2), with the dead time of both. A
root lies on the imaginary axis where t = D0 / M is real, so that the crossings of a whole ray
are the zeros of Im(D0 conj(M)): one certified walk finds them all. The first of them is looked
for only as far up in frequency as a root can cross before the first one so far; of a loop, only
where free phases let a root cross at all: the first turns, then likely places, then the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache, cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.axis.exponentials import conjugates_without_zeros, merged
from armlock.axis.rounding import EPSILON
from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import ComplexArray, FloatArray, IntArray, axis, positive_number
from armlock.loops import Loop, LoopAt, power_series
from armlock.robustness.free_phases import (
    FIRST_TURNS,
    crossing_intervals,
    free_disc,
    search_outwards,
)
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import BOUNDARY, CountError, unstable_roots
from armlock.stability.zeros import axis_zeros, count_beside, polished

#: Nothing is looked at where the parameters are this many times as large as the start, or as 1.
FARTHEST = 1e9
# Of a start on the boundary, crossings up to this share of `scale` are the start's own.
_NEAR_START = 1e-10
# Next to the limit of the neutral root chain, roots cross at ever higher frequency. They are
# followed up to so many turns of the longest delay, which takes about a tenth of a second.
_TURNS_NEXT_TO_THE_CHAIN = 50_000


class Crossings(NamedTuple):
    """Where roots cross the imaginary axis along a ray.

    Attributes
    ----------
    position : float array, shape (n,)
        Ascending t of the points start + t direction, all of them positive.
    omega : float array, shape (n,)
        Frequency of the crossing root in rad/s; 0, or for a map pi / step, for a real one.
    change : int array, shape (n,)
        By how much the number of unstable roots changes there.
    """

    position: FloatArray
    omega: FloatArray
    change: IntArray


class Crossing(NamedTuple):
    """One crossing as in `Crossings`; (inf, nan, 0) where there is none.

    Where the neutral root chain ceases to be confined first, `position` is that limit, `omega`
    is inf, and `change` is 0.
    """

    position: float
    omega: float
    change: int


_NONE = Crossings(np.empty(0), np.empty(0), np.empty(0, dtype=np.int64))


class Ray:
    """A ray, and the characteristic function along it."""

    def __init__(
        self, system: CharacteristicFunction, start: npt.ArrayLike, direction: npt.ArrayLike
    ) -> None:
        self.system = checked_system(system)
        self.start, self.direction = axis("start", start), axis("direction", direction)
        for name, value in (("start", self.start), ("direction", self.direction)):
            if value.size != 2:
                raise ValueError(f"{name} must hold two numbers, got {value.size}")
        if not self.direction.any():
            raise ValueError("direction must not have length zero, got (0, 0)")
        #: The t at which the point has moved by |start|, or by one if that is more.
        self.scale = max(1.0, float(np.hypot(*self.start))) / float(np.hypot(*self.direction))
        #: Count the unstable roots at a point of the ray, given its t; kept, because a search
        #: and who asks for it confirm at the same points.
        self.count: Callable[[float], int] = cache(self._count)
        #: D0 conj(M) and |M|^2 at s = j omega, over the power of omega that both have.
        self.product, self.square = conjugates_without_zeros(
            system.deviation(*self.direction), system.sum_at(*self.start)
        )

    def at(self, t: float) -> tuple[float, float]:
        """Return the point start + t direction."""
        x, y = self.start + t * self.direction
        return float(x), float(y)

    def end(self, t: float) -> float:
        """Frequency in rad/s past which no root crosses between 0 and t.

        The terms with x and y are convex along the ray, and thus largest at one of its ends.
        inf where the neutral root chain is not confined.
        """
        points = np.array([self.at(0.0), self.at(t)])
        end = float(last_frequency(self.system, *points.T).max())
        if np.isnan(end):
            raise CountError(f"no crossings up to t = {t}: a number overflows", points[1:])
        return end

    def chain_limit(self) -> float:
        """Smallest t >= 0 at which the neutral root chain is not confined, or inf.

        The reserve of the chain is linear in t, except where x or y changes its sign.
        """

        def reserve(t: float) -> float:
            return float(self.system.chain_reserve(*self.at(t)))

        if reserve(0.0) <= 0.0:
            return 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            signs_change = -self.start / self.direction
        edges = [0.0, *sorted(t for t in signs_change.tolist() if 0.0 < t < np.inf)]
        last = 2.0 * max(self.scale, edges[-1])
        for low, high in pairwise([*edges, last]):
            at_low, at_high = reserve(low), reserve(high)
            # From the last sign on it descends for ever, or stays what it is.
            if at_high <= 0.0 or (high == last and at_high < at_low):
                return float(low + (high - low) * at_low / (at_low - at_high))
        return np.inf

    def acts(self) -> bool:
        """Whether D changes along the ray."""
        system, (d1, d2) = self.system, self.direction
        moved1, moved2 = d1 * system.b1.coefficients, d2 * system.b2.coefficients
        if system.tau1 != system.tau2:
            return bool(moved1.any() or moved2.any())
        return bool(poly.polyadd(moved1, moved2).any())

    def quotient(self, omega: npt.ArrayLike) -> ComplexArray:
        """D0 / M at s = j omega, shaped like `omega`; nan where M vanishes."""
        system, s = self.system, 1j * np.asarray(omega, dtype=float)
        (x, y), (x0, y0), (d1, d2) = self.start, system.reference, self.direction
        z = np.exp(s * system.step) if system.step else s
        rest, b1, b2 = (p.evaluated(z)[0] for p in system.polynomials())
        return1, return2 = np.exp(-s * system.tau1), np.exp(-s * system.tau2)
        dead, later = np.exp(-s * system.delay), np.expm1(-s * (system.tau2 - system.tau1))

        def added(
            w1: float, w2: float, u1: ComplexArray, u2: ComplexArray, between: ComplexArray
        ) -> ComplexArray:
            """w1 B1 u1 + w2 B2 u2, in the one of two ways that has the smaller terms.

            `between` is u2 - u1, the sum of both polynomials is made from their coefficients.
            """
            both = poly.polyadd(w1 * system.b1.coefficients, w2 * system.b2.coefficients)
            size = poly.polyval(np.abs(z), np.abs(both)) * np.abs(u1)
            separate = np.abs(w1 * b1 * u1) + np.abs(w2 * b2 * u2)
            together = poly.polyval(z, both) * u1 + w2 * b2 * between
            cancel = size + np.abs(w2 * b2 * between) < separate
            return np.asarray(np.where(cancel, together, w1 * b1 * u1 + w2 * b2 * u2))

        arm1 = (x0 - x) - x * np.expm1(-s * system.tau1)
        arm2 = (y0 - y) - y * np.expm1(-s * system.tau2)
        between = (y0 - x0) - ((y - x) + y * later) * return1
        value = rest + dead * added(1.0, 1.0, arm1, arm2, between)
        effect = dead * added(d1, d2, return1, return2, return1 * later)
        acts = effect != 0.0
        result: ComplexArray = np.where(acts, value / np.where(acts, effect, 1.0), np.nan)
        if isinstance(system, Loop) and (s == 0.0).any():
            # There the terms may cancel to rounding, next to c1 = c2 for instance.
            here, change = self._terms_at_zero
            result[s == 0.0] = float(-here[0] / change[0]) if change[0] else np.nan
        return result

    def crossings(self, stop: float) -> Crossings:
        """Find all crossings with 0 < t <= stop."""
        end = self.end(stop)
        if end == np.inf:
            raise ValueError(
                f"the ray must stay where the neutral root chain is confined, but "
                f"{self.system!r} loses it before t = {stop}"
            )
        if not self.acts():
            return _NONE
        found, hidden = self._crossings([(0.0, end)], stop)
        known = self.through_zero(stop)
        if known.position.size:
            order = np.argsort(np.append(found.position, known.position), kind="stable")
            pairs = zip(found, known, strict=True)
            found = Crossings(*(np.concatenate(pair)[order] for pair in pairs))
        self._confirm(found, hidden, stop)
        return found

    def _crossings(
        self, intervals: npt.ArrayLike, stop: float, *, first: bool = False
    ) -> tuple[Crossings, FloatArray]:
        """Find crossings on intervals of the axis, and where rounding may hide others.

        All of them up to `stop`, or the first and what ties with it. The places are ranges of t
        that hidden stretches may cross, of shape (n, 2).
        """
        zeros = axis_zeros(self.product, intervals, self.square, is_map=self.system.step > 0.0)
        lower, upper = zeros.position - zeros.spread, zeros.position + zeros.spread
        # Where M vanishes, its product with D0 does, but D0 / M is large and not real: no root
        # is there. Elsewhere D0 / M need not be quite real, because omega is not yet polished.
        q = self.quotient(zeros.omega)
        real = np.abs(q.imag) <= np.abs(q.real) + self.scale
        # In a stretch around such a place anything may be.
        hidden = zeros.hidden | (~real & np.isfinite(zeros.spread))
        lower, upper = (
            np.where(np.isnan(lower), -np.inf, lower),
            np.where(np.isnan(upper), np.inf, upper),
        )
        met = hidden & (upper > 0.0) & (lower <= stop)
        ranges = np.column_stack((lower, upper))[met].clip(0.0, stop)
        omega, change, width = zeros.omega[~hidden], zeros.jump[~hidden], zeros.width[~hidden]
        # Only those in reach are worth polishing.
        rough = np.where(real, q.real, np.inf)[~hidden]
        rest = np.flatnonzero((rough > 0.0) & (rough <= stop * (1.0 + 1e-6)))
        rest, found = rest[np.argsort(rough[rest], kind="stable")], _NONE
        while rest.size and not found.position.size:
            many = rest.size
            if first:
                many = int((rough[rest] <= rough[rest[0]] * (1.0 + 1e-6)).sum())
            some = rest[:many]
            found = self._polished(omega[some], change[some], width[some], stop)
            rest = rest[many:]
        return found, ranges

    def _polished(
        self, omega: FloatArray, change: IntArray, width: FloatArray, stop: float
    ) -> Crossings:
        """Polish frequencies; return the crossings up to `stop`, but for the start's own."""
        # What rounding lets them move, of both ways to evaluate D0 / M, and no more: the next
        # zero may be close.
        reaches = [np.maximum(share * width, 4.0 * EPSILON * omega) for share in (2.0, 16.0)]
        omega = polished(lambda w: self.quotient(w).imag, omega, reaches)
        position = self.quotient(omega).real
        lowest = 0.0
        if ((position > 0.0) & (position <= _NEAR_START * self.scale)).any():
            # The start itself may be on the axis, up to rounding.
            begins_on_boundary = unstable_roots(self.system, *self.start) == BOUNDARY
            lowest = _NEAR_START * self.scale if begins_on_boundary else 0.0
        kept = np.flatnonzero((position > lowest) & (position <= stop))
        kept = kept[np.argsort(position[kept], kind="stable")]
        return Crossings(position[kept], omega[kept], change[kept])

    def _hides(self, stop: float, why: str) -> CountError:
        return CountError(
            f"no crossings up to t = {stop}: rounding hides some, {why}",
            np.array([self.at(stop)]),
        )

    def _count(self, t: float) -> int:
        """Count the unstable roots at a point of the ray, of a loop those of the closed loop.

        There the point is not rounded: what cancels along the ray does so at it.
        """
        if not isinstance(self.system, Loop):
            return int(unstable_roots(self.system, *self.at(t)))
        begin, way = self.start.tolist(), self.direction.tolist()
        c1, c2 = (
            Fraction(a) + Fraction(t) * Fraction(d) for a, d in zip(begin, way, strict=True)
        )
        return int(unstable_roots(self.system, c1, c2))

    @cached_property
    def _terms_at_zero(self) -> tuple[list[Fraction], list[Fraction]]:
        """p_k and q_k of D(s; t) = sum_k (p_k + t q_k) s^k, up to one past the first of R."""
        number = int(np.flatnonzero(self.system.rest.coefficients)[0]) + 2
        begin = [Fraction(value) for value in self.start.tolist()]
        end = [a + Fraction(d) for a, d in zip(begin, self.direction.tolist(), strict=True)]
        here, there = (
            [
                sum(pair, Fraction(0))
                for pair in zip(*power_series(self.system, x, y, number), strict=True)
            ]
            for x, y in (begin, end)
        )
        return here, [b - a for a, b in zip(here, there, strict=True)]

    def from_zero(self) -> int:
        """Where a root of a loop goes next to the start that cancels at s = 0 there.

        D is t q_0 + p_k s^k to first order, with p_k the first that is not zero. So one root
        goes right where q_0 and p_k have opposite signs, and 1 is returned. -1: the only one
        goes left. 0: none leaves, or it takes more than these two terms to say.
        """
        if not isinstance(self.system, Loop):
            return 0
        here, change = self._terms_at_zero
        order = next((k for k, p in enumerate(here) if p), 0)
        if order == 0 or change[0] == 0:
            return 0
        return 1 if here[order] * change[0] < 0 else (-1 if order == 1 else 0)

    def through_zero(self, stop: float) -> Crossings:
        """Find where, up to `stop`, a root of the loop passes s = 0 though s cancels all along.

        Of D(s; t) = sum_k (p_k + t q_k) s^k the first terms vanish for all t, and with them the
        walk's D0 / M at s = 0. The loop's own root passes where the first that is left does,
        at t = -p_k / q_k. With r = p_(k+1) + t q_(k+1) it goes right there if q_k / r < 0.
        """
        if not isinstance(self.system, Loop):
            return _NONE
        here, change = self._terms_at_zero
        pairs = enumerate(zip(here[:-1], change, strict=False))
        cancelled = next((k for k, pair in pairs if any(pair)), 0)
        p, q = here[cancelled], change[cancelled]
        if cancelled == 0 or q == 0 or not 0 < -p / q <= stop:
            return _NONE
        t, following = float(-p / q), here[cancelled + 1] - p / q * change[cancelled + 1]
        if following:
            return Crossings(
                np.array([t]), np.zeros(1), np.array([1 if q * following < 0 else -1])
            )
        # Two roots or more pass: counts tell.
        (_, before), (_, after) = (self.count_beside(t, side, 1e-9) for side in (-1, 1))
        if min(before, after) < 0:
            raise self._hides(t, "where roots pass s = 0")
        if before == after:
            return _NONE
        return Crossings(np.array([t]), np.zeros(1), np.array([after - before]))

    def count_beside(self, t: float, side: int, nearest: float) -> tuple[float, int]:
        """`count_beside` of the ray's counts."""
        return count_beside(self.count, t, side, nearest, self.scale)

    def _count_at_start(self) -> tuple[float, int]:
        """Count at the start; of one on the boundary, past the crossings that are its own."""
        t = _NEAR_START * self.scale if self.count(0.0) == BOUNDARY else 0.0
        return t, self.count(t)

    def _confirm(self, found: Crossings, hidden: FloatArray, stop: float) -> None:
        """Raise unless counts say that nothing crosses where rounding hides it.

        On both sides of each range of t that hidden stretches may cross, the counts differ by
        what was found in between, or a crossing is hidden there.
        """
        for low, high in merged(hidden):
            before = self.count_beside(low, -1, 0.0) if low else self._count_at_start()
            after = self.count_beside(high, -1 if high >= stop else 1, 0.0)
            between = (found.position > before[0]) & (found.position <= after[0])
            told = min(before[1], after[1]) >= 0
            if not told or after[1] - before[1] != found.change[between].sum():
                raise self._hides(
                    stop,
                    f"for the counts at t = {before[0]} and {after[0]} are {before[1]} and "
                    f"{after[1]}",
                )

    def first(self, stop: float) -> Crossing:
        """Find the first crossing up to `stop`, or the limit of the neutral root chain."""
        chain = self.chain_limit()
        if chain == 0.0:
            return Crossing(0.0, np.inf, 0)
        best = Crossing(chain, np.inf, 0) if chain <= stop else Crossing(np.inf, np.nan, 0)
        if not self.acts():
            return best
        known = self.through_zero(min(stop, best.position))
        if known.position.size:
            best = Crossing(*(values[0].item() for values in known))
        hidden, per_turn = [np.empty((0, 2))], self.system.omega_per_turn

        def reach() -> float:
            return min(best.position, stop)

        def end() -> float:
            """Frequency past which no root crosses earlier."""
            if reach() < chain * (1.0 - 1e-10):
                return self.end(reach())
            # Roots are followed up to where they cross a part in a million before the limit,
            # and beyond for so many turns at most. Past that the limit is taken for them.
            near, nearest = (self.end(chain * (1.0 - share)) for share in (1e-6, 1e-10))
            return max(near, min(nearest, _TURNS_NEXT_TO_THE_CHAIN * per_turn))

        if isinstance(self.system, Loop):
            parts = self._where_free_phases_cross(self.system, end, reach)
        else:
            # The boundary of a map ends at one frequency: a single walk sees all of it.
            parts = _outwards(np.inf if self.system.step else per_turn, end)
        for intervals in parts:
            found, doubtful = self._crossings(intervals, reach(), first=True)
            hidden.append(doubtful)
            if found.position.size:
                best = Crossing(*(values[0].item() for values in found))
        before = (1.0 - 1e-6) * reach()
        ranges = np.concatenate(hidden)
        self._confirm(_NONE, ranges[ranges[:, 0] < before].clip(0.0, before), before)
        return best

    def _where_free_phases_cross(
        self, loop: Loop, end: Callable[[], float], reach: Callable[[], float]
    ) -> Iterator[FloatArray]:
        """Yield where phases of the arms and parameters up to `reach` let a root cross."""

        def meeting(span: tuple[float, float]) -> FloatArray:
            c1, c2 = np.abs([self.at(0.0), self.at(reach())]).max(axis=0)
            return crossing_intervals(LoopAt(loop, c1, c2), span)

        def likely(omega: FloatArray) -> FloatArray:
            centre, radius = free_disc(LoopAt(loop, *self.at(0.0)), omega)
            d1, d2 = map(float, self.direction)
            growth = free_disc(LoopAt(loop, d1, d2), omega)[1]
            # The t at which the disc of free phases first holds -1.
            return omega[[np.argmin((np.abs(1.0 + centre) - radius) / growth)]]

        return search_outwards(loop.omega_per_turn, end, meeting, likely)


def _outwards(per_turn: float, end: Callable[[], float]) -> Iterator[FloatArray]:
    """Yield parts of the axis up to `end`, each three times as long as all before it."""
    walked = 0.0
    while (last := end()) > walked:
        following = min(last, max(4.0 * walked, FIRST_TURNS * per_turn))
        yield np.array([[walked, following]])
        walked = following


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
        The loop.
    start, direction : array_like of two floats
        The ray start + t direction in the plane of the free parameters.
    stop : float, optional
        Largest t that is looked at; by default one at which the parameters are 1e9 times as
        large as the start, or as one.

    Returns
    -------
    Crossing
        The one of smallest t > 0. A root that lies on the axis at the start itself counts as
        a crossing only where it comes back to it. Of a start on the boundary, crossings closer
        than a part in 1e10 are taken for its own.

    Raises
    ------
    TypeError, ValueError
        If start or direction is not two finite real numbers, the direction has length zero, or
        stop is not positive.
    CountError
        If a number overflows, gain times delay is too large to follow, or counts show that
        rounding hides a crossing.

    Notes
    -----
    Walks go as far up in frequency as a root can cross before the first one so far. As t comes
    near the limit of the neutral root chain, roots cross at ever higher frequency. The limit
    is returned in place of a root that crosses closer to it than a part in a million and at
    more than 50 000 turns of the longest delay. It may be in place of one closer than a part
    in 1e10.

    Examples
    --------
    >>> from armlock import DualArm
    >>> from armlock.robustness.rays import first_crossing
    >>> edge = first_crossing(DualArm(gain=10.0), (1.0, 1.0), (1.0, 1.0), stop=3.0)
    >>> print(f"{edge.position:.6f} {edge.omega:.4f} {edge.change}")
    0.254006 3.7746 2
    """
    ray = Ray(system, start, direction)
    return ray.first(FARTHEST * ray.scale if stop is None else positive_number("stop", stop))


__all__ = [
    "Crossing",
    "Crossings",
    "first_crossing",
]
