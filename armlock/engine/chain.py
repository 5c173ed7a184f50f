"""The neutral chain of products of delay objects: whether it is confined, and where it ends.

At high frequency a function of s is its highest power times A + sum A_k z_k, with one z_k for
each product of delay objects. The neutral chain counts as confined where abs(A) exceeds the sum
of the abs(A_k) (Lemma 14). Of products that share objects this asks for more than is necessary.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol

import numpy as np
from flint import fmpq

from armlock.checks import ComplexArray, FloatArray
from armlock.engine.polynomials import rounded
from armlock.engine.tolerances import UndecidedError

# On the torus a P that is smaller than this share of its coefficients is zero; and where a
# candidate is looked for.
_ROUNDING, _ROUGHLY = 1e-13, 1e-9
# Most cells of the torus that are looked at, some seconds.
_MOST_CELLS = 1_000_000
# The least |P| on the torus is bounded from below by this share of it.
_SHARE = 0.8
# An arc of phases is followed in so many steps, to this share of the coefficients.
_MOST_TURNS, _FINE = 500, 1e-9


class Product(Protocol):
    """A product of delay objects (`armlock.systems.Lag`): pairs of an object and its power."""

    @property
    def time(self) -> fmpq:
        """Its length in s."""

    def __iter__(self) -> Iterator[tuple[Any, int]]:
        """Iterate over the pairs."""

    def __len__(self) -> int:
        """Return the number of pairs."""

    def __hash__(self) -> int:
        """Hash it."""


def own_phases(lags: Iterable[Product]) -> tuple[list[Product], list[Product]]:
    """Return the products whose phase is free, and those that are left.

    The phase of a product with an object of its own is free, whatever all others are. Taken
    out, it may leave others with an object of their own.
    """
    left: list[Product] = [lag for lag in lags if lag]
    free: list[Product] = []
    while True:
        used = Counter(delay for lag in left for delay, _ in lag)
        own = [lag for lag in left if any(used[delay] == 1 for delay, _ in lag)]
        if not own:
            return free, left
        free += own
        left = [lag for lag in left if lag not in own]


def _on_torus(
    powers: FloatArray,
    rows: FloatArray,
    free: float,
    measure: Callable[[ComplexArray], FloatArray],
    share: float,
) -> float:
    """Return a lower bound of a measure - free on the unit torus: `_SHARE` of it, or 0.

    Parameters
    ----------
    powers : float array, shape (1 + K, objects)
        Of delay objects in the undelayed term and in the K products.
    rows : float array, shape (number of P, 1 + K)
        The coefficients of each P.
    free : float
        Size of terms of any phase.
    measure : callable
        Takes the values of all P, shape (n, number of P), and returns shape (n,). It changes
        by no more than the values do, added up.
    share : float
        What is below this share of all coefficients is taken as 0.

    Raises
    ------
    UndecidedError
        If it takes more cells than `_MOST_CELLS`.
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


def _powers(lags: Iterable[Iterable[tuple[Any, int]]]) -> FloatArray:
    """Return the powers of all delay objects in some products, shape (products, objects)."""
    lags = list(lags)
    objects = sorted({d for lag in lags for d, _ in lag}, key=lambda d: d.mark)
    return np.array([[dict(lag).get(d, 0) for d in objects] for lag in lags], np.float64)


def reserve(still: FloatArray, late: FloatArray) -> FloatArray:
    """Return what products of delays leave of undelayed terms, shapes (n,) and (n, K).

    By the sum of magnitudes. The chain is confined where it is positive.
    """
    return np.asarray(np.abs(still) - np.abs(late).sum(-1))


def _loosened(
    lags: Sequence[Product], n: FloatArray, m: FloatArray
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
    return rows[:, kept], _powers([(), *(lags[k - 1] for k in kept[1:])]), size


def arc_reserve(
    lags: Sequence[Product], n: FloatArray, m: FloatArray, angle: float, loose: float = 0.0
) -> float:
    """Bound abs(P_M + exp(j psi) P_N) - loose from below, for all abs(psi) <= angle (Lemma 24).

    Parameters
    ----------
    lags : sequence of Product
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
    lags: Sequence[Product], n: FloatArray, m: FloatArray, loose: float = 0.0
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


def line_limit(f: Sequence[fmpq], g: Sequence[fmpq], start: fmpq, rounding: fmpq) -> float:
    """First t >= start at which the chain of f + t g is not confined; inf where it always is.

    Exactly: what is left of the undelayed term, less a share for rounding, is linear in t
    between the t at which a term vanishes.

    Parameters
    ----------
    f, g : sequence of fmpq, length 1 + K
        The coefficient of the undelayed term, and those of the K products.
    start : fmpq
        Where to begin.
    rounding : fmpq
        The share of the undelayed term that has to be left.
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


def real_part_limit(lags: Sequence[Product], still: float, late: FloatArray) -> float:
    """Limit right of which the chain has no roots; -inf without a chain.

    Unless products share objects, the real parts of the roots tend to it.
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
    return limit
