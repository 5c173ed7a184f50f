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
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import ComplexArray, FloatArray, IntArray, axis, positive_number
from armlock.loops import Loop, LoopAt
from armlock.robustness.free_phases import (
    FIRST_TURNS,
    crossing_intervals,
    free_disc,
    search_outwards,
)
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import (
    BOUNDARY,
    CountError,
    polished,
    sign_changes,
    unstable_roots,
)

#: Nothing is looked at where the parameters are this many times as large as the start, or as 1.
FARTHEST = 1e9
# Of a start on the boundary, crossings up to this share of it are the start's own.
_OWN = 1e-10
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
        #: The t at which the distance from the start is the start's from zero, or one.
        self.scale = max(1.0, float(np.hypot(*self.start))) / float(np.hypot(*self.direction))
        #: D0 conj(M) at s = j omega.
        self.product = system.sum_at(*self.start).times_conjugate(
            system.deviation(*self.direction)
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
            left, right = reserve(low), reserve(high)
            # From the last sign on it descends for ever, or stays what it is.
            if right <= 0.0 or (high == last and right < left):
                return float(low + (high - low) * left / (left - right))
        return np.inf

    def acts(self) -> bool:
        """Whether D changes along the ray."""
        system, (d1, d2) = self.system, self.direction
        if system.tau1 != system.tau2:
            return bool((d1 * system.b1).any() or (d2 * system.b2).any())
        return bool(poly.polyadd(d1 * system.b1, d2 * system.b2).any())

    def quotient(self, omega: npt.ArrayLike) -> ComplexArray:
        """D0 / M at s = j omega, shaped like `omega`; nan where M vanishes."""
        system, s = self.system, 1j * np.asarray(omega, dtype=float)
        z = np.exp(s * system.step) if system.step else s
        p1, p2 = self.direction[0] * system.b1, self.direction[1] * system.b2
        effect = np.asarray(poly.polyval(z, poly.polyadd(p1, p2)), dtype=np.complex128)
        effect = effect + poly.polyval(z, p1) * np.expm1(-s * system.tau1)
        effect = effect + poly.polyval(z, p2) * np.expm1(-s * system.tau2)
        effect = effect * np.exp(-s * system.delay)
        value = system(s, *self.start)
        acts = effect != 0.0
        result: ComplexArray = np.where(acts, value / np.where(acts, effect, 1.0), np.nan)
        return result

    def crossings(self, stop: float, intervals: npt.ArrayLike | None = None) -> Crossings:
        """Find all crossings with 0 < t <= stop.

        With `intervals` of the axis, in rad/s and of shape (n, 2), only those whose frequency
        lies in them, and no counts confirm that rounding hides none.
        """
        end = self.end(stop)
        if end == np.inf:
            raise ValueError(
                f"the ray must stay where the neutral root chain is confined, but "
                f"{self.system!r} loses it before t = {stop}"
            )
        if not self.acts():
            return _NONE
        parts = [(0.0, end)] if intervals is None else np.minimum(intervals, end)
        found, hidden = self._crossings(parts, stop)
        if hidden and intervals is None:
            self._confirm(stop, int(found.change.sum()))
        return found

    def _crossings(
        self, intervals: npt.ArrayLike, stop: float, *, first: bool = False
    ) -> tuple[Crossings, bool]:
        """Find crossings on intervals of the axis; return whether rounding may hide some.

        All of them up to `stop`, or the first and what ties with it.
        """
        omega, change, width = sign_changes(
            self.product, intervals, is_map=self.system.step > 0.0
        )
        # Stretches in which rounding hides the sign, on the way or from omega = 0 on.
        hidden = bool(((change == 0) | ((omega == 0.0) & (width > 0.0))).any())
        omega, change = omega[change != 0], change[change != 0]
        # Only those in reach are worth polishing. Where M vanishes, its product with D0 does,
        # but D0 / M is large and not real: no root is there. Elsewhere D0 / M need not be quite
        # real, because omega is not yet polished.
        q = self.quotient(omega)
        rough = np.where(np.abs(q.imag) <= np.abs(q.real) + self.scale, q.real, np.inf)
        left = np.flatnonzero((rough > 0.0) & (rough <= stop * (1.0 + 1e-6)))
        left, found = left[np.argsort(rough[left], kind="stable")], _NONE
        while left.size and not found.position.size:
            many = left.size
            if first:
                many = int((rough[left] <= rough[left[0]] * (1.0 + 1e-6)).sum())
            found = self._polished(omega[left[:many]], change[left[:many]], stop)
            left = left[many:]
        return found, hidden

    def _polished(self, omega: FloatArray, change: IntArray, stop: float) -> Crossings:
        """Polish frequencies; return the crossings up to `stop`, but for the start's own."""
        # Far less than the distance between two zeros.
        reach = np.minimum(1e-7 * omega, 1e-3 * self.system.omega_per_turn)
        omega = polished(lambda w: self.quotient(w).imag, omega, (reach,))
        position = self.quotient(omega).real
        lowest = 1e-15 * self.scale
        if (position[position > lowest] <= _OWN * self.scale).any():
            # The start itself may be on the axis, up to rounding.
            own = unstable_roots(self.system, *self.start) == BOUNDARY
            lowest = _OWN * self.scale if own else lowest
        kept = np.flatnonzero((position > lowest) & (position <= stop))
        kept = kept[np.argsort(position[kept], kind="stable")]
        return Crossings(position[kept], omega[kept], change[kept])

    def _confirm(self, stop: float, change: int) -> None:
        """Raise if counts at both ends contradict a change of the number of unstable roots.

        Counts that cannot be told say nothing.
        """
        counts = unstable_roots(self.system, *np.transpose([self.at(0.0), self.at(stop)]))
        if counts.min() >= 0 and counts[1] - counts[0] != change:
            raise CountError(
                f"no crossings up to t = {stop}: rounding hides some, for the counts at both "
                f"ends are {counts[0]} and {counts[1]}",
                np.array([self.at(stop)]),
            )

    def first(self, stop: float) -> Crossing:
        """Find the first crossing up to `stop`, or the limit of the neutral root chain."""
        chain = self.chain_limit()
        if chain == 0.0:
            return Crossing(0.0, np.inf, 0)
        best = Crossing(chain, np.inf, 0) if chain <= stop else Crossing(np.inf, np.nan, 0)
        if not self.acts():
            return best
        hidden, per_turn = False, self.system.omega_per_turn

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
            hidden |= doubtful
            if found.position.size:
                best = Crossing(*(values[0].item() for values in found))
        if hidden:
            self._confirm((1.0 - 1e-6) * reach(), 0)
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
