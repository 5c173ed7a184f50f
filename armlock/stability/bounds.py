"""The frequency past which no root can lie on the imaginary axis.

There A exceeds all other terms of D together (`armlock.characteristic.CharacteristicFunction`).
Counts and crossings end there. Margins end where one polynomial exceeds others, `last_larger`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from armlock.axis.compiled import njit
from armlock.axis.exponentials import real_horner
from armlock.characteristic import CharacteristicFunction, broadcast_parameters
from armlock.checks import FloatArray


@njit(cache=True)
def _taylor_signs_positive(q: FloatArray, shift: float, room: FloatArray) -> bool:
    """Whether all coefficients of q(w + shift) are positive beyond rounding, or zero.

    `room`, shape (2, q.size), is overwritten.
    """
    p, magnitude = room
    for k in range(q.size):
        p[k], magnitude[k] = q[k], abs(q[k])
    for i in range(q.size - 1):
        for k in range(q.size - 2, i - 1, -1):
            p[k] += shift * p[k + 1]
            magnitude[k] += shift * magnitude[k + 1]
        if not p[i] >= 1e-13 * magnitude[i]:
            return False
    return bool(p[q.size - 1] >= 0.0)


@njit(cache=True)
def last_root_bound(q: FloatArray) -> float:
    """Bound past which a real polynomial is positive, or zero throughout; inf if there is none.

    It is nan where a coefficient is not finite. A shift of the variable after which all
    coefficients are positive proves it.
    """
    top = q.size - 1
    while top > 0 and q[top] == 0.0:
        top -= 1
    q = q[: top + 1]
    room = np.empty((2, q.size))
    for value in q:
        if not np.isfinite(value):
            return np.nan
    if _taylor_signs_positive(q, 0.0, room):
        return 0.0
    if not q[top] > 0.0:
        return np.inf
    upper = 0.0
    for k in range(1, q.size):
        upper = max(upper, 2.0 * (abs(q[top - k]) / q[top]) ** (1.0 / k))
    for _ in range(60):
        if _taylor_signs_positive(q, upper, room):
            break
        upper *= 2.0
    lower = 0.5 * upper
    while lower > 1e-60 * upper and _taylor_signs_positive(q, lower, room):
        upper = lower
        lower *= 0.5
    for _ in range(6):
        middle = np.sqrt(lower * upper)
        if _taylor_signs_positive(q, middle, room):
            upper = middle
        else:
            lower = middle
    return upper


@njit(cache=True)
def _last_frequency(
    squares: FloatArray, unit: float, factors: FloatArray, reserve: float
) -> float:
    """Frequency past which |A| exceeds the other terms together.

    `squares` holds |A|^2 and the squares of the other terms T_i at s = j omega, as polynomials
    in w = (omega / unit)^2; `factors` are f_i >= 0, and `reserve` is the share of A's highest
    power that sum f_i |T_i| leaves: inf is returned where that is not positive.

    By Cauchy and Schwarz (sum f_i |T_i|)^2 <= (sum a_i) (sum f_i^2 |T_i|^2 / a_i) for all
    a_i > 0, with equality where a_i is f_i |T_i|. So |A|^2 less the right-hand side is a
    polynomial in w, and `last_root_bound` applies.
    """
    if not reserve > 0.0:
        return np.inf
    # Loops, because each array operation takes longer to compile than all of this.
    top = squares.shape[1] - 1
    lead = np.sqrt(squares[0, top])
    factors, shares, whole = factors.copy(), np.zeros(factors.size), 0.0
    for i in range(factors.size):
        if factors[i] < 1e-100:
            # Far below rounding a factor would only underflow.
            factors[i] = 0.0
        size = 0.0
        for m in range(top + 1):
            size += abs(squares[i + 1, m])
        shares[i] = factors[i] * np.sqrt(size)
        whole += shares[i]
    # At first their highest powers, and half of what these leave, by the terms' sizes.
    scale = 0.5 * reserve * lead / whole if whole > 0.0 else 1.0
    for i in range(factors.size):
        shares[i] *= scale
        shares[i] += factors[i] * np.sqrt(squares[i + 1, top])
    bound = _outgrown_from(squares, factors, shares)
    # Then the shares that the terms have at the bound: they give a lower one.
    while 0.0 < bound < np.inf:
        for i in range(factors.size):
            shares[i] = factors[i] * np.sqrt(max(real_horner(squares[i + 1], bound), 0.0))
        nearer = _outgrown_from(squares, factors, shares)
        if not 0.0 <= nearer < 0.9 * bound:
            break
        bound = nearer
    return float(np.sqrt(bound) * unit)


@njit(cache=True)
def _outgrown_from(squares: FloatArray, factors: FloatArray, shares: FloatArray) -> float:
    """Bound in w for `_last_frequency`, with the shares as a_i."""
    together = 0.0
    for share in shares:
        together += share
    q = squares[0].copy()
    for i in range(factors.size):
        for m in range(q.size):
            if shares[i] > 0.0:
                q[m] -= together * factors[i] ** 2 / shares[i] * squares[i + 1, m]
            elif factors[i] > 0.0 and squares[i + 1, m] != 0.0:
                return np.inf
    return float(last_root_bound(q))


def squared_magnitudes(polynomials: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    """Return |p(j omega)|^2 as polynomials in (omega / unit)^2, and the unit in rad/s.

    The first polynomial is of the highest degree. In this unit, a power of two, its lowest and
    highest coefficients are of the same size. All are multiplied by one power of two, so that
    its coefficients lie around one.
    """
    first = polynomials[0]
    degree, used = first.size - 1, np.flatnonzero(first)
    sizes = np.log2(np.abs(first[used]))
    lowest = int(used[0])
    exponent = round((sizes[0] - sizes[-1]) / (degree - lowest)) if degree > lowest else 0
    sizes += exponent * used
    powers = exponent * np.arange(degree + 1) - round(0.5 * (sizes.max() + sizes.min()))
    squares = np.zeros((len(polynomials), degree + 1))
    for row, p in zip(squares, polynomials, strict=True):
        scaled = np.ldexp(p, powers[: p.size])
        # Powers of s two apart have opposite signs at s = j omega.
        even, odd = scaled[0::2].copy(), scaled[1::2].copy()
        even[1::2] *= -1.0
        odd[1::2] *= -1.0
        row[: 2 * even.size - 1] += np.convolve(even, even)
        if odd.size:
            row[1 : 2 * odd.size] += np.convolve(odd, odd)
    return squares, float(np.ldexp(1.0, exponent))


@njit(cache=True)
def _last_frequencies(
    squares: FloatArray, unit: float, x: FloatArray, y: FloatArray, reserve: FloatArray
) -> FloatArray:
    """Return `_last_frequency` at points; the factors are |x|, |y| and one."""
    ends = np.empty(x.size)
    for i in range(x.size):
        factors = np.array([abs(x[i]), abs(y[i]), 1.0])
        ends[i] = _last_frequency(squares, unit, factors, reserve[i])
    return ends


@lru_cache(maxsize=64)
def _squares(system: CharacteristicFunction) -> tuple[FloatArray, float]:
    """Return the `squared_magnitudes` of A, B1, B2 and C."""
    return squared_magnitudes((system.a, system.b1, system.b2, system.c))


def last_frequency(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> FloatArray:
    """Return a frequency past which no root lies on the imaginary axis.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop.
    x, y : array_like of float
        The free parameters; they broadcast.

    Returns
    -------
    float array, of the broadcast shape
        In rad/s, a bound: past it |A| > |C| + |x B1| + |y B2|, also for all smaller |x| and
        |y|. inf where the neutral root chain is not confined to the left half-plane, and nan
        where numbers overflow. Of a map pi / step, where its axis ends.
    """
    xs, ys = broadcast_parameters(system, x, y)
    if system.step:
        return np.full(xs.shape, np.pi / system.step)
    squares, unit = _squares(system)
    reserve = system.chain_reserve(xs, ys)
    ends: FloatArray = _last_frequencies(squares, unit, xs.ravel(), ys.ravel(), reserve.ravel())
    return ends.reshape(xs.shape)


def last_larger(
    first: FloatArray, others: tuple[FloatArray, ...], factors: FloatArray
) -> float:
    """Frequency past which |first| exceeds the sum of factors times |others|, or inf.

    In rad/s, of polynomials at s = j omega.
    """
    size = max(p.size for p in others)
    lead = abs(float(first[-1])) if first.size >= size else 0.0
    if lead == 0.0:
        return np.inf
    tops = [abs(float(p[-1])) if p.size == first.size else 0.0 for p in others]
    reserve = (lead - float(factors @ np.array(tops))) / lead
    squares, unit = squared_magnitudes((first, *others))
    found: float = _last_frequency(squares, unit, factors, reserve)
    return found
