"""The neutral chain of products of delay objects: whether it is confined, and where it ends.

At high frequency a function of s is its highest power times A + sum A_k z_k, with one z_k for
each product of delay objects. The neutral chain counts as confined where abs(A) exceeds the sum
of the abs(A_k) (Lemma 14). Of products that share objects this asks for more than is necessary.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Protocol

import numpy as np
from flint import fmpq

from armlock.checks import FloatArray
from armlock.engine.polynomials import rounded
from armlock.engine.tolerances import UndecidedError


class Product(Protocol):
    """A product of delay objects (`armlock.systems.Lag`): pairs of an object and its power."""

    @property
    def time(self) -> fmpq:
        """Its length in s."""

    def __iter__(self) -> Iterator[tuple[Any, int]]:
        """Iterate over the pairs."""


def share_objects(lags: Iterable[Product]) -> bool:
    """Tell whether the phases of some products depend on one another.

    The phase of a product with an object of its own is free, whatever all others are. Taken
    out, it may leave others with an object of their own.
    """
    left = [lag for lag in lags if lag]
    while left:
        used = Counter(delay for lag in left for delay, _ in lag)
        kept = [lag for lag in left if all(used[delay] > 1 for delay, _ in lag)]
        if len(kept) == len(left):
            return True
        left = kept
    return False


def reserve(still: FloatArray, late: FloatArray) -> FloatArray:
    """Return what products of delays leave of undelayed terms, shapes (n,) and (n, K).

    By the sum of magnitudes. The chain is confined where it is positive.
    """
    return np.asarray(np.abs(still) - np.abs(late).sum(-1))


def _of_arc(n: FloatArray, m: FloatArray, loose: float) -> tuple[float, float, float]:
    """Return three numbers of which an arc depends.

    Of the undelayed terms the difference of their magnitudes, and the root of their product, 0
    if they have two signs; and the size of all other terms.
    """
    f, g = abs(float(n[0])), abs(float(m[0]))
    product = math.sqrt(f) * math.sqrt(g) if (n[0] > 0.0) == (m[0] > 0.0) else 0.0
    return abs(g - f), product, float(np.abs(n[1:]).sum() + np.abs(m[1:]).sum()) + loose


def arc_reserve(n: FloatArray, m: FloatArray, angle: float, loose: float = 0.0) -> float:
    """Bound abs(P_M + exp(j psi) P_N) - loose from below, for all abs(psi) <= angle (Lemma 24).

    By the sum of magnitudes.

    Parameters
    ----------
    n, m : float arrays, shape (1 + K,)
        The coefficients of two P: that of the undelayed term, and those of the K products.
    angle : float
        In rad, at most pi.
    loose : float, optional
        Size of further terms of any phase.
    """
    apart, product, size = _of_arc(n, m, loose)
    # Terms of two signs add up to least without a turn.
    return math.hypot(apart, 2.0 * product * math.sin(0.5 * (math.pi - angle))) - size


def arc_limit(
    lags: Sequence[Product], n: FloatArray, m: FloatArray, loose: float = 0.0
) -> float:
    """Return the largest angle up to which `arc_reserve` is positive, or inf.

    It has to be positive at the angle zero.

    Raises
    ------
    UndecidedError
        If products share objects, and magnitudes do not exclude an angle.
    """
    apart, product, size = _of_arc(n, m, loose)
    if apart > size:
        return math.inf
    sine = 0.5 * math.sqrt(size - apart) * math.sqrt(size + apart)
    angle = math.pi - 2.0 * math.asin(sine / product) if sine < product else 0.0
    acting = [lag for row in (n, m) for lag, c in zip(lags, row[1:], strict=True) if c]
    if share_objects(acting):
        raise UndecidedError(
            f"the turn at high frequency is not found, from {angle:.6g} rad on"
        )
    return angle


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
