"""Along a ray of the parameter plane: every crossing of the axis; and sweeps of any result.

On a ray (x, y) = start + t direction the characteristic function is D0 - t M, with D0 its
value at the start. A root lies on the imaginary axis where t = D0 / M is real, so that the
crossings of a whole ray are the zeros of Im(D0 conj(M)): one certified walk finds them all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly
from scipy.optimize import brentq

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import ComplexArray, FloatArray, IntArray, axis, positive_number
from armlock.stability import CountError, last_crossing, sign_changes

P = TypeVar("P")
R = TypeVar("R", bound=tuple[Any, ...])

# How much longer, in frequency, each further walk is than the one before.
_LONGER = 4.0
# Halvings by which the end of a walk is placed on its ray.
_HALVINGS = 40
# The same into several parts.
_DIVISIONS, _PARTS = 10, 16
# Delay in s that stands in for none.
_SHORTEST = 1e-12


class Crossings(NamedTuple):
    """Where roots cross the imaginary axis along a ray.

    Attributes
    ----------
    position : float array, shape (n,)
        Ascending t of the points start + t direction, all of them positive.
    omega : float array, shape (n,)
        Frequency of the crossing root in rad/s; 0 for a real one.
    change : int array, shape (n,)
        By how much the number of unstable roots changes there.
    """

    position: FloatArray
    omega: FloatArray
    change: IntArray


class Crossing(NamedTuple):
    """One crossing as in `Crossings`; (inf, nan, 0) where there is none."""

    position: float
    omega: float
    change: int


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
        self.start_end = float(last_crossing(system, *self.start))
        pull = system.deviation(*self.direction)
        self.family = system.at(*self.start).times_conjugate(pull)

    def end(self, t: float) -> float:
        """Frequency past which no root crosses between 0 and t.

        |x B1| + |y B2| is convex along the ray, and thus largest at one of the two ends.
        """
        return float(self.ends(np.array([t]))[0])

    def ends(self, t: FloatArray) -> FloatArray:
        """`end` at several t."""
        points = self.start + t[:, None] * self.direction
        return np.asarray(np.maximum(self.start_end, last_crossing(self.system, *points.T)))

    def unconfined(self, stop: float) -> ValueError:
        """Return the error for a ray on which a neutral loop's chain is lost."""
        return ValueError(
            f"the ray must stay where the high-frequency chain of roots is confined, but "
            f"{self.system!r} loses it before t = {stop}"
        )

    def quotient(self, omega: npt.ArrayLike) -> ComplexArray:
        """D0 / M at s = j omega, shaped like `omega`; nan where the direction does not act."""
        system, s = self.system, 1j * np.asarray(omega, dtype=float)
        z = np.exp(s * system.step) if system.step else s
        p1, p2 = self.direction[0] * system.b1, self.direction[1] * system.b2
        pull = np.asarray(poly.polyval(z, poly.polyadd(p1, p2)), dtype=np.complex128)
        pull = pull + poly.polyval(z, p1) * np.expm1(-s * system.delay1)
        pull = pull + poly.polyval(z, p2) * np.expm1(-s * system.delay2)
        value = system(s, *self.start)
        acts = pull != 0.0
        result: ComplexArray = np.where(acts, value / np.where(acts, pull, 1.0), np.nan)
        return result

    def polished(self, omega: float) -> float:
        """Return a zero of Im(D0 / M) near one that was found on the expanded sums."""

        def excess(w: float) -> float:
            return float(self.quotient(w).imag)

        low, high = omega * (1.0 - 1e-7), omega * (1.0 + 1e-7)
        if low < high and excess(low) * excess(high) < 0.0:
            return float(brentq(excess, low, high, xtol=1e-300, rtol=1e-15))
        return omega

    def crossings(self, stop: float, *, first: bool = False, lowest: float = 0.0) -> Crossings:
        """Find crossings with `lowest` < t <= stop: all, or the first and what ties with it."""
        end = self.end(stop)
        if end == np.inf:
            raise self.unconfined(stop)
        if np.isnan(end):
            raise CountError(
                f"no crossings up to t = {stop}: a number overflows",
                np.array([self.start + stop * self.direction]),
            )
        omega, change = sign_changes(self.family, end, is_map=self.system.step > 0.0)
        omega, change = omega[change != 0], change[change != 0]
        # Only those in reach are worth polishing.
        rough = self.quotient(omega).real
        near = (rough > lowest) & (rough <= stop * (1.0 + 1e-6))
        if first and near.any():
            near &= rough <= rough[near].min() * (1.0 + 1e-6)
        omega = np.array([self.polished(float(w)) for w in omega[near]])
        change = change[near]
        position = self.quotient(omega).real
        kept = np.flatnonzero((position > lowest) & (position <= stop))
        kept = kept[np.argsort(position[kept], kind="stable")]
        return Crossings(position[kept], omega[kept], change[kept])


def ray_crossings(
    system: CharacteristicFunction,
    start: npt.ArrayLike,
    direction: npt.ArrayLike,
    stop: float,
) -> Crossings:
    r"""Find every crossing of the imaginary axis along a ray.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop.
    start, direction : array_like of two floats
        The ray start + t direction in the plane of the free parameters.
    stop : float
        Largest t.

    Returns
    -------
    Crossings
        With the number of unstable roots at the start, its `change` adds up to the number
        anywhere on the ray.

    Raises
    ------
    TypeError, ValueError
        If start or direction is not two finite real numbers, the direction has length zero,
        stop is not positive, or a neutral loop's chain of roots is lost on the way.
    CountError
        If a number overflows, or gain times delay is too large to follow.

    Notes
    -----
    With D0 the characteristic function at the start, and (d1, d2) the direction, a root is
    at s = j omega where

    .. math::

        t = \frac{D_0}{d_1 B_1 e^{-s\theta_1} + d_2 B_2 e^{-s\theta_2}} \text{ is real.}

    A root that lies at s = 0 along the whole ray crosses nowhere and is not reported.

    Examples
    --------
    >>> from armlock import CommonArm
    >>> from armlock.rays import ray_crossings
    >>> found = ray_crossings(CommonArm(), (0.0, 0.0), (0.2, 0.4), 3.4)
    >>> found.position.round(4), found.omega.round(4), found.change
    (array([3.3333, 3.3738]), array([0.    , 0.3071]), array([1, 2]))
    """
    return Ray(system, start, direction).crossings(positive_number("stop", stop))


def first_crossing(
    system: CharacteristicFunction,
    start: npt.ArrayLike,
    direction: npt.ArrayLike,
    stop: float,
) -> Crossing:
    """Find the first crossing of the imaginary axis along a ray.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop.
    start, direction : array_like of two floats
        The ray start + t direction in the plane of the free parameters.
    stop : float
        Largest t that is looked at.

    Returns
    -------
    Crossing
        The one of smallest t > 0.

    Raises
    ------
    TypeError, ValueError
        As `ray_crossings` does; the loss of a neutral loop's chain only if no root crosses
        before it.
    CountError
        If a number overflows, or gain times delay is too large to follow.

    Notes
    -----
    The frequencies that have to be searched grow with t. They are searched in portions, each
    up to the t before which no higher frequency can cross, so that a near crossing is found
    at once, however far `stop` is.

    Examples
    --------
    >>> from armlock import DualArm
    >>> from armlock.rays import first_crossing
    >>> edge = first_crossing(DualArm(gain=10.0), (1.0, 1.0), (1.0, 1.0), stop=3.0)
    >>> print(f"{edge.position:.6f} {edge.omega:.4f} {edge.change}")
    0.254006 3.7746 2
    """
    ray, stop = Ray(system, start, direction), positive_number("stop", stop)
    limit = ray.start_end
    if limit == np.inf:
        raise ray.unconfined(0.0)
    within = _confined_until(ray, stop)
    limit = _LONGER * limit if limit > 0.0 else 1.0 / max(system.longest_delay, _SHORTEST)
    last = 0.0
    while last < within:
        top = _reach(ray, limit, within)
        if top > last:
            found = ray.crossings(top, first=True)
            if found.position.size:
                return Crossing(
                    float(found.position[0]), float(found.omega[0]), int(found.change[0])
                )
            last = top
        limit *= _LONGER
    if within < stop:
        raise ray.unconfined(stop)
    return Crossing(np.inf, np.nan, 0)


def _confined_until(ray: Ray, stop: float) -> float:
    """Return a t up to which a neutral loop's chain is confined, close to the largest."""
    if ray.end(stop) != np.inf:
        return stop
    low, high = 0.0, stop
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if ray.end(middle) == np.inf else (middle, high)
    # Closer to the limit roots cross at ever higher frequency.
    return low * (1.0 - 1e-6)


def _reach(ray: Ray, limit: float, stop: float) -> float:
    """Return a t up to which no root crosses at a frequency above `limit`.

    It is within 1e-6 of the largest: what is left belongs to the next portion.
    """
    if ray.end(stop) <= limit:
        return stop
    low, high = 0.0, stop
    if ray.start_end > limit:
        return 0.0
    # Several at once, because a call costs as much as a dozen bounds.
    shares = np.arange(1, _PARTS) / _PARTS
    for _ in range(_DIVISIONS):
        tried = low + (high - low) * shares
        good = ray.ends(tried) <= limit
        number = int(np.argmin(good)) if not good.all() else good.size
        if number < good.size:
            high = float(tried[number])
        if number > 0:
            low = float(tried[number - 1])
        if high - low <= 1e-6 * low:
            break
    return low


def sweep(
    result: Callable[[P], R],
    points: Iterable[P],
    *,
    mapper: Callable[[Callable[[P], R], Iterable[P]], Iterable[R]] = map,
) -> R:
    """Evaluate a function at many points and gather its results field by field.

    Parameters
    ----------
    result : callable
        A plain function of one point that returns a named tuple of numbers.
    points : iterable
        Its arguments: gains, corner frequencies, pairs of either.
    mapper : callable, optional
        Applies a function to every point, in order, as the built-in `map` does. A pool's or
        an engine's map spreads a long sweep over processes or machines; `result` must then be
        a function that can be pickled.

        A pool of processes is best made with the start method "spawn" or "forkserver", which
        every system has. In a forked process the loops over points and rows run on one core,
        because the threads of a process do not survive a fork.

    Returns
    -------
    named tuple
        Of the same kind, each field an array over the points.

    Raises
    ------
    ValueError
        If there are no points.

    Examples
    --------
    >>> from armlock import CommonArm
    >>> from armlock.rays import first_crossing, sweep
    >>> def upper_edge(gain):
    ...     return first_crossing(CommonArm(gain), (0.0, 0.0), (1.0, 1.0), stop=3.0)
    >>> sweep(upper_edge, [1.0, 10.0]).position
    array([1., 1.])

    Over two processes. They import what they call, so that it stands in a module: here in
    this one. In a script the pool stands under `if __name__ == "__main__":`.

    >>> from functools import partial
    >>> from multiprocessing import get_context
    >>> edge = partial(first_crossing, start=(0.0, 0.0), direction=(1.0, 1.0), stop=3.0)
    >>> with get_context("spawn").Pool(2) as pool:
    ...     found = sweep(edge, [CommonArm(1.0), CommonArm(10.0)], mapper=pool.map)
    >>> found.position
    array([1., 1.])
    """
    found = list(mapper(result, points))
    if not found:
        raise ValueError("points must not be empty")
    return type(found[0])(*(np.array(column) for column in zip(*found, strict=True)))


__all__ = ["Crossing", "Crossings", "first_crossing", "ray_crossings", "sweep"]
