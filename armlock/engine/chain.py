"""The neutral chain: the one place that decides whether it is confined, and where it ends.

At high frequency a function of s is its highest power times

    P(z_1 .. z_m) ,   z_k = exp(-s theta_k) ,

a polynomial with one variable for each delay object. Where P vanishes, roots repeat along the
imaginary axis for ever: the neutral chain. It stays left of the axis, for these delays and all
small changes of them, if and only if P has no zero in the closed unit polydisc (Lemma 14).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple, Self
from uuid import uuid4

import flint
import numpy as np
from flint import arb, fmpq, fmpq_poly

from armlock.checks import BoolArray, ComplexArray, FloatArray
from armlock.engine.polynomials import collected, enclosed_roots, exact, rounded

# On the torus a P that is smaller than this share of its coefficients is zero; and where a
# candidate is looked for.
_ROUNDING, _ROUGHLY = 1e-13, 1e-9
# Most cells of the torus that are looked at, some seconds.
_MOST_CELLS = 1_000_000
# The least |P| on the torus is bounded from below by this share of it.
_SHARE = 0.8
# A chain is followed along a line of parameters to this share of the largest |P|.
_FINE = 1e-9
# Most steps along such a line; and along an arc of phases.
_MOST_STEPS, _MOST_TURNS = 2000, 500
# Past this point of a line there is no limit.
_FARTHEST = 1e150
# Bits in which P of one delay object is bounded.
_BITS = 200


class UndecidedError(RuntimeError):
    """Double precision, or the steps allowed, did not decide."""


class Delay(NamedTuple):
    """A delay object: theta in s, and the mark by which it differs from all others.

    Two objects are two delays even if they are equally long: a small change of one of them
    alone is a small change of the loop. The mark is the same in other processes. With a growth
    x it stands for exp(x) times the delay.
    """

    theta: fmpq
    mark: str
    growth: fmpq = fmpq(0)

    @classmethod
    def new(cls, theta: fmpq) -> Self:
        """Return an object that is none other."""
        return cls(theta, uuid4().hex)

    def __hash__(self) -> int:
        """Hash the mark alone: python-flint's fractions take long."""
        return hash(self.mark)


class Lag(tuple[tuple[Delay, int], ...]):
    """A product of delay objects: pairs of an object and its power, sorted."""

    @classmethod
    def of(cls, powers: Mapping[Delay, int]) -> Self:
        """Return the product of objects to these powers."""
        return cls(sorted((delay, n) for delay, n in powers.items() if n))

    @classmethod
    def after(cls, theta: fmpq, mark: str = "") -> Self:
        """Return one object of a length, by default the one that all of this length share."""
        return cls([(Delay(theta, mark), 1)] if theta else [])

    def times(self, other: Lag) -> Lag:
        """Return the product of two."""
        if not (self and other):
            return self or other
        return Lag.of(collected((*self, *other)))

    @cached_property
    def time(self) -> fmpq:
        """The delay of the product, in s."""
        return sum((delay.theta * n for delay, n in self), fmpq(0))

    @cached_property
    def growth(self) -> fmpq:
        """The x of the factor exp(x) before the delay."""
        return sum((delay.growth * n for delay, n in self), fmpq(0))

    @property
    def plain(self) -> Lag:
        """The product without that factor."""
        return Lag.of(collected((Delay(one.theta, one.mark), n) for one, n in self))


#: The product of no delays.
NOW = Lag()


def own_phases(lags: Iterable[Lag]) -> tuple[list[Lag], list[Lag]]:
    """Return the products whose phase is free, and those that are left.

    The phase of a product with an object of its own is free, whatever all others are. Taken
    out, it may leave others with an object of their own.
    """
    left, free = [lag for lag in lags if lag], list[Lag]()
    while True:
        used = Counter(delay for lag in left for delay, _ in lag)
        own = [lag for lag in left if any(used[delay] == 1 for delay, _ in lag)]
        if not own:
            return free, left
        free += own
        left = [lag for lag in left if lag not in own]


def _in_disc(p: fmpq_poly) -> bool:
    """Tell whether a polynomial has a zero in the closed unit disc, or next to it."""
    if p.degree() < 1:
        return not p
    return any(not abs(z) > 1 for z, _ in enclosed_roots(p))


def _on_circle(coefficients: Sequence[fmpq]) -> float:
    """Return a lower bound of |P| on the unit circle, but for rounding the least value.

    Its square is a polynomial in the cosine of the angle.
    """
    square, t, before = fmpq_poly([0]), fmpq_poly([1]), fmpq_poly([0, 1])
    number = len(coefficients)
    for k in range(number):
        products = (coefficients[i] * coefficients[i + k] for i in range(number - k))
        square += t * sum(products, fmpq(0)) * (2 if k else 1)
        t, before = fmpq_poly([0, 2]) * t - before, t
    slope = square.derivative()
    found = enclosed_roots(slope) if slope.degree() > 0 else []
    at = [z.real for z, _ in found if z.imag.contains(0) and not abs(z.real) > 1]
    values = [
        sum((arb(c) * x**k for k, c in enumerate(square.coeffs())), arb(0))
        for x in (*at, arb(1), arb(-1))
    ]
    return math.sqrt(max(min(float(v.lower()) for v in values), 0.0))


def _on_torus(
    powers: FloatArray,
    rows: FloatArray,
    free: float,
    measure: Callable[[ComplexArray], FloatArray],
    share: float = _ROUNDING,
) -> float:
    """Return a lower bound of a measure - free on the unit torus: `_SHARE` of it, or 0.

    It is 0 up to a share of all coefficients. The measure of some P, one for each row of
    coefficients, changes by no more than they do.
    """
    number, slope = powers.shape[1], np.abs(rows).sum(0) @ np.abs(powers)
    rounding, least = (part * float(np.abs(rows).sum()) for part in (_ROUNDING, share))
    centre, half = np.full((1, number), np.pi), np.full(number, np.pi)
    lowest, kept = np.inf, np.inf
    if not number:
        return float(measure(rows.sum(axis=1)[None])[0]) - free
    while len(centre):
        value = measure(np.exp(-1j * (centre @ powers.T)) @ rows.T) - free
        lowest = min(lowest, float(value.min()))
        # A cell of this value has to pass by its share, less rounding.
        if lowest <= max(least, 8.0 * rounding):
            return 0.0
        bound = value - slope @ half - rounding
        done = bound >= _SHARE * lowest
        kept, centre = min(kept, float(bound[done].min(initial=np.inf))), centre[~done]
        k = np.arange(number) == np.argmax(slope * half)
        half = np.where(k, 0.5 * half, half)
        centre = np.concatenate((centre - half * k, centre + half * k))
        if len(centre) > _MOST_CELLS:
            raise UndecidedError(f"less than {lowest:.1e} is left at high frequency")
    return kept


def _powers(lags: Iterable[Lag]) -> FloatArray:
    """Return the powers of all delay objects in some products, shape (products, objects)."""
    lags = list(lags)
    objects = sorted({d for lag in lags for d, _ in lag})
    return np.array([[dict(lag).get(d, 0) for d in objects] for lag in lags], np.float64)


@lru_cache(maxsize=4096)
def _least(lags: tuple[Lag, ...], coefficients: tuple[float, ...], free: float) -> float:
    """Return a lower bound of |P| - free on the closed polydisc; 0 where P has a zero there."""
    powers = _powers(lags)
    # With all variables equal, P has no zero in the disc. The torus is left (Strintzis).
    diagonal = fmpq_poly([0])
    for total, c in zip(powers.sum(1), coefficients, strict=True):
        diagonal += exact(c) * fmpq_poly([0, 1]) ** int(total)
    before, flint.ctx.prec = flint.ctx.prec, _BITS
    try:
        if _in_disc(diagonal):
            return 0.0
        if powers.shape[1] == 1:
            # Squares of large numbers would overflow.
            size = max(map(abs, coefficients))
            return size * _on_circle((diagonal / exact(size)).coeffs()) - free
    finally:
        flint.ctx.prec = before
    return _on_torus(powers, np.array([coefficients]), free, lambda p: np.abs(p[:, 0]))


def reserve(lags: Sequence[Lag], still: FloatArray, late: FloatArray) -> FloatArray:
    """Bound |P| from below on the closed unit polydisc: what all else decides from.

    Parameters
    ----------
    lags : sequence of Lag
        The K products of delay objects.
    still, late : float arrays, shapes (n,) and (n, K)
        The coefficients of P that nothing delays, and those of the products, of n functions.

    Returns
    -------
    float array, shape (n,)
        Exact for products with an object of their own (the sum of magnitudes) and for one
        object; a bound for others. Zero or negative where the chain is not confined.
    """
    sizes = np.abs(late)
    found: FloatArray = np.abs(still) - sizes.sum(-1)
    for i in np.flatnonzero(shared(lags, late)):
        here = [lag for lag, c in zip(lags, late[i], strict=True) if c]
        free, left = own_phases(here)
        places = [lags.index(lag) for lag in left]
        loose = float(sum(sizes[i, lags.index(lag)] for lag in free))
        coefficients = float(still[i]), *late[i, places].tolist()
        found[i] = _least((NOW, *left), coefficients, loose) if still[i] else -loose
    return found


def shared(lags: Sequence[Lag], late: FloatArray) -> BoolArray:
    """Tell of which functions the sum of magnitudes is not the rule, shape (n,)."""
    acts = late != 0.0
    found: BoolArray = np.zeros(len(late), np.bool_)
    if own_phases([lag for lag, a in zip(lags, acts.any(0), strict=True) if a])[1]:
        kinds, which = np.unique(acts, axis=0, return_inverse=True)
        odd = [
            bool(own_phases([lag for lag, a in zip(lags, kind, strict=True) if a])[1])
            for kind in kinds
        ]
        found = np.array(odd)[which.ravel()]
    return found


def turned(lags: Sequence[Lag], still: float, late: FloatArray, omega: float) -> float:
    """Argument of P over that of its undelayed term, at s = j omega, followed from z = 0.

    Along a radius of the polydisc, in which P has no zero.
    """
    if not shared(lags, late[None]).any():
        return 0.0
    acting = [(lag, c) for lag, c in zip(lags, late.tolist(), strict=True) if c]
    c = np.array([v for _, v in acting]) / still
    degrees = np.array([sum(n for _, n in lag) for lag, _ in acting])
    phases = (exact(omega) * lag.time / exact(2.0 * math.pi) for lag, _ in acting)
    z = np.exp([-1j * float((x - x.floor()) * exact(2.0 * math.pi)) for x in phases])
    least = float(reserve(lags, np.array([still]), late[None])[0]) / abs(still)
    r = np.linspace(0.0, 1.0, 8 + int(4.0 * np.abs(c) @ degrees / least))[:, None]
    return float(np.unwrap(np.angle(1.0 + (r**degrees * z) @ c))[-1])


def hull_reserve(lags: Sequence[Lag], still: FloatArray, late: FloatArray) -> float:
    """Bound |P| from below for all P between n of them, shapes (n,) and (n, K).

    Of two, step by step along the line between them; of more, by what they differ from their
    mean.
    """
    rows = np.column_stack((still, late))
    if len(rows) != 2:
        middle = rows.mean(axis=0)
        apart = float(np.abs(rows - middle).sum(axis=1).max())
        return float(reserve(lags, middle[:1], middle[None, 1:])[0]) - apart
    slope, t, least = float(np.abs(rows[1] - rows[0]).sum()), 0.0, math.inf
    for _ in range(_MOST_STEPS):
        v = rows[0] + t * (rows[1] - rows[0])
        here = float(reserve(lags, v[:1], v[None, 1:])[0])
        least = min(least, 0.5 * here)
        if least <= _FINE * float(np.abs(v).sum()):
            return 0.0
        if t >= 1.0:
            return least
        t = min(t + 0.5 * here / slope, 1.0) if slope else 1.0
    return 0.0


def _loosened(
    lags: Sequence[Lag], n: FloatArray, m: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Take products of free phase out of two P: what is left, its powers, and their size.

    The coefficients are those of N and M, in two rows. A product that stands in both has no
    phase that is free.
    """
    rows = np.array([n, m])
    acting = [(lag, k) for k, lag in enumerate(lags, 1)]
    own, left = own_phases(lag for lag, k in acting for c in rows[:, k] if c)
    kept = [0, *(k for lag, k in acting if lag in left)]
    size = sum(float(np.abs(rows[:, k]).sum()) for lag, k in acting if lag in own)
    return rows[:, kept], _powers([NOW, *(lags[k - 1] for k in kept[1:])]), size


def arc_reserve(
    lags: Sequence[Lag], n: FloatArray, m: FloatArray, angle: float, loose: float = 0.0
) -> float:
    """Bound abs(P_M + exp(j psi) P_N) - loose from below, for all abs(psi) <= angle (Lemma 24).

    Parameters
    ----------
    lags : sequence of Lag
        The K products.
    n, m : float arrays, shape (1 + K,)
        The coefficients of two P: that of the undelayed term, and those of the products.
    angle : float
        In rad, at most pi: there it is the least difference of both magnitudes.
    loose : float, optional
        Size of further terms of any phase.

    Returns
    -------
    float
        Zero or negative where the sum vanishes for one of these psi, on the unit torus.
    """
    rows, powers, size = _loosened(lags, n, m)
    sign = np.sign(np.subtract(*np.abs(rows.sum(axis=1))))

    def measure(p: ComplexArray) -> FloatArray:
        f, g = p.T
        if angle >= math.pi:
            return np.asarray(sign * (np.abs(f) - np.abs(g)))
        # The psi at which both are opposed, or the end of the arc that is next to it.
        psi = np.clip(np.angle(-g * f.conj()), -angle, angle)
        return np.asarray(np.abs(g + np.exp(1j * psi) * f))

    share = _ROUNDING if angle >= math.pi else _ROUGHLY
    return _on_torus(powers, rows, loose + size, measure, share)


def arc_limit(
    lags: Sequence[Lag], n: FloatArray, m: FloatArray, loose: float = 0.0
) -> tuple[float, bool]:
    """Largest angle up to which `arc_reserve` is positive, and whether it is found.

    Otherwise the angle is a lower bound. It is inf where the two P differ in magnitude.
    """
    if arc_reserve(lags, n, m, math.pi, loose) > 0.0:
        return math.inf, True
    rows, powers, size = _loosened(lags, n, m)
    size += loose
    if not powers.any():
        f, g = rows[:, 0]
        cosine = (size**2 - f**2 - g**2) / (2.0 * f * g) if f * g else 1.0
        return math.acos(min(max(cosine, -1.0), 1.0)), True
    whole, slope, angle = float(np.abs(rows).sum()), float(np.abs(rows[0]).sum()), 0.0
    for _ in range(_MOST_TURNS):
        row = np.exp(1j * angle) * rows[:1] + rows[1:]
        here = _on_torus(powers, row, size, lambda p: np.abs(p[:, 0]), _ROUGHLY)
        if here <= _FINE * whole:
            return angle, True
        # The sum changes by no more than the slope.
        angle += here / slope
    return angle, False


def line_limit(
    lags: Sequence[Lag],
    f: Sequence[fmpq],
    g: Sequence[fmpq],
    start: float,
    rounding: float,
) -> float:
    """First t >= start at which the chain of f + t g is not confined; inf where it always is.

    Parameters
    ----------
    lags : sequence of Lag
        The K products.
    f, g : sequence of fmpq, length 1 + K
        The coefficients of P: that of the undelayed term, and those of the products.
    start : float
        Where to begin.
    rounding : float
        The share of the undelayed term that has to be left.
    """
    a, b = (np.array(v, np.float64) for v in (f, g))
    if not shared(lags, (np.abs(a[1:]) + np.abs(b[1:]))[None]).any():
        return _plain_line_limit(f, g, exact(start), exact(rounding))
    t, slope = start, float(np.abs(b).sum())
    for _ in range(_MOST_STEPS):
        v = a + t * b
        left = float(reserve(lags, v[:1], v[None, 1:])[0]) - rounding * abs(v[0])
        if left <= _FINE * float(np.abs(v).sum()):
            return t
        if not slope or t > _FARTHEST:
            return math.inf
        # |P| changes by no more than the slope.
        t += left / slope
    raise UndecidedError(f"the limit of the neutral chain is not found, from t = {t:.6g} on")


def _plain_line_limit(
    f: Sequence[fmpq], g: Sequence[fmpq], start: fmpq, rounding: fmpq
) -> float:
    """Do what `line_limit` does, exactly, where the sum of magnitudes is the rule (Lemma 14).

    What is left of the undelayed term is linear in t between the t at which a term vanishes.
    """
    breaks = {-a / b for a, b in zip(f, g, strict=True) if b}

    def left(t: fmpq) -> fmpq:
        still, *late = (abs(a + b * t) for a, b in zip(f, g, strict=True))
        return still - sum(late) - rounding * still

    ends = [start, *sorted(t for t in breaks if t > start)]
    for low, high in zip(ends, [*ends[1:], None], strict=True):
        at_low = left(low)
        if at_low <= 0:
            return float(low)
        inside = high or low + 1
        slope = (left(inside) - at_low) / (inside - low)
        if slope < 0 and (high is None or low - at_low / slope <= high):
            return float(rounded([low - at_low / slope])[0])
    return math.inf


def real_part_limit(lags: Sequence[Lag], still: float, late: FloatArray) -> float:
    """Limit to which the real parts of the chain's roots tend from the left; -inf without one.

    Right of it P(z exp(-sigma theta)) has no zero in the polydisc.
    """
    acting = [(lag, abs(c)) for lag, c in zip(lags, late.tolist(), strict=True) if c]
    if not acting:
        return -math.inf
    if still == 0.0:
        return math.inf
    delays = np.array([float(lag.time) for lag, _ in acting])
    sizes, limit = np.array([size for _, size in acting]) / abs(still), 0.0
    # The logarithm of the sum is convex, so that Newton's method leads to its only zero.
    for _ in range(30):
        logs = np.log(sizes) - delays * limit
        whole = np.logaddexp.reduce(logs)
        limit += float(whole / (np.exp(logs - whole) @ delays))
    if not shared(lags, late[None]).any():
        return limit
    times = np.array([float(lag.time) for lag in lags])

    def confined(sigma: float) -> bool:
        weights = late * np.exp(-sigma * times)
        return bool(reserve(lags, np.array([still]), weights[None])[0] > 0.0)

    # The sum of magnitudes is an upper bound, and the limit is found by halving.
    high, width = limit, 1.0 / float(delays.max())
    low = high - width
    while confined(low) and high - low < 1e3 * width:
        low -= high - low
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if confined(middle) else (middle, high)
    return high
