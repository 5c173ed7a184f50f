"""Whether a loop stays stable while the difference of its two round trips changes.

With the mean T and half the difference x, S = B1 + B2, Q = B1 - B2 and phi = omega x,

    D = R + exp(-s delay) [ S (1 - exp(-s T) cos phi) + j Q exp(-s T) sin phi ]

on the axis. Rectangles of omega and x cover all of it. In each D is shown not to be zero, by
one of three bounds over the rectangle. The first takes all of D. The second leaves the mean
open: no exp(-s T) of magnitude one lets D vanish where

    q(phi) = |R|^2 + 2 Re(S exp(-s delay) R*) + a sin^2 phi + b sin 2 phi > 0 ,

with a = |S|^2 - |Q|^2 and b = Im(S Q*). The third leaves phi open too: the least that the
last two terms can be is a / 2 - sqrt(a^2 / 4 + b^2). Where no bound does, it is halved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial as poly
from scipy.linalg import hankel
from scipy.special import comb

from armlock.axis.rounding import EPSILON
from armlock.checks import BoolArray, ComplexArray, FloatArray, real_number
from armlock.loops import Loop, checked_loop
from armlock.stability.bounds import last_frequency

# Rectangles at the start, how many are looked at, and how narrow they become, at most. Where
# one of this share of omega is not clear yet, a root is on the axis but for rounding.
_STRIPS, _RECTANGLES, _NARROWEST = 200, 1_000_000, 1e-12
# What a sum of some ten terms rounds by, of their magnitudes.
_RELATIVE_ROUNDING = 32.0 * EPSILON


class _Parts(NamedTuple):
    """Coefficients of R, S and Q, the mean of the round trips and the dead time in s."""

    polynomials: tuple[FloatArray, ...]
    mean: float
    delay: float


def no_root_crosses(loop: Loop, low: float, high: float) -> bool:
    """Tell whether no root crosses the imaginary axis while two round trips grow apart.

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

    Examples
    --------
    As stable between a third of the held half difference of 0.1 s and twice it as at 0.1 s:

    >>> from armlock import paper_loop
    >>> from armlock.robustness.differences import no_root_crosses
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
    rest, b1, b2 = (p.coefficients for p in loop.polynomials())
    common, opposed = (
        np.asarray(p, np.float64) for p in (poly.polyadd(b1, b2), poly.polysub(b1, b2))
    )
    parts = _Parts((rest, common, opposed), mean, loop.delay)
    # No root lies on the axis past the one frequency, or up to the other but at s = 0.
    start, end = _leading_up_to(parts, low, high), float(last_frequency(loop, 1.0, 1.0))
    if not (start > 0.0 and end < np.inf):
        return False
    return start >= end or _covered(parts, (start, end), (low, high))


def _leading_up_to(parts: _Parts, low: float, high: float) -> float:
    """Return a frequency up to which the lowest power of s in D exceeds all others, or zero.

    Of a delayed polynomial that is R times s mean, or s x, but for less than (omega longest)^2.
    """
    size = max(p.size for p in parts.polynomials) + 1
    rest, common, opposed = (
        np.pad(p, (ahead, size - ahead - p.size))
        for p, ahead in zip(parts.polynomials, (0, 1, 1), strict=True)
    )
    delayed = np.abs(common) + np.abs(opposed)
    first = np.flatnonzero(np.abs(rest) + delayed)[0]
    at_ends = [(rest + common * parts.mean + opposed * x)[first] for x in (low, high)]
    lead = min(np.abs(at_ends)) if at_ends[0] * at_ends[1] > 0.0 else 0.0
    longest = parts.mean + parts.delay + max(abs(low), abs(high))
    rest, delayed = np.abs(rest[first:]), delayed[first:]
    for omega in 0.5 ** np.arange(200) / longest:
        powers = omega ** np.arange(rest.size)
        others = (rest + longest * delayed)[1:] @ powers[1:]
        if others + longest**2 * omega * (delayed @ powers) < 0.5 * lead:
            return float(omega)
    return 0.0


def _covered(parts: _Parts, span: tuple[float, float], range_of_x: tuple[float, float]) -> bool:
    """Whether D is shown to be nowhere zero for all omega and x of two intervals."""
    borders = np.geomspace(*span, _STRIPS + 1)
    ends = np.broadcast_to(np.reshape(range_of_x, (2, 1)), (2, _STRIPS))
    undecided = np.stack((borders[:-1], borders[1:], *ends))
    seen = 0
    while seen < _RECTANGLES:
        seen += undecided.shape[1]
        omega, x = undecided[:2].mean(axis=0), undecided[2:].mean(axis=0)
        half = 0.5 * np.diff(undecided[:2], axis=0)[0]
        room = 0.5 * np.diff(undecided[2:], axis=0)[0]
        open_ = ~_clear(parts, omega, half, x, room)
        undecided = undecided[:, open_]
        if undecided.size == 0:
            return True
        if (half < _NARROWEST * omega)[open_].any():
            return False
        # Halve what is larger of its own magnitude, or once phases turn little what turns more.
        turn = half * (parts.mean + parts.delay)
        tall = np.where(
            turn < 1.0, omega * room > turn, room / (np.abs(x) + room) > half / omega
        )[open_]
        lower, upper = undecided.copy(), undecided.copy()
        lower[1] = np.where(tall, undecided[1], omega[open_])
        upper[0] = np.where(tall, undecided[0], omega[open_])
        lower[3] = np.where(tall, x[open_], undecided[3])
        upper[2] = np.where(tall, x[open_], undecided[2])
        undecided = np.hstack((lower, upper))
    return False


def _clear(
    parts: _Parts, omega: FloatArray, half: FloatArray, x: FloatArray, room: FloatArray
) -> BoolArray:
    """Whether D is shown to be nowhere zero, of rectangles by centre and half widths."""
    # What the centres and phases round by is added to the widths.
    half, room = half + 4.0 * EPSILON * omega, room + 4.0 * EPSILON * np.abs(x)
    s = np.asarray(1j * omega, dtype=np.complex128)
    with np.errstate(over="ignore", invalid="ignore"):
        values, offs = zip(*(_with_change(p, s, half) for p in parts.polynomials), strict=True)
        (rest, common, opposed), (off_r, off_s, off_q) = values, offs
        # The largest that they become, and by what the phases change.
        most_r, most_s, most_q = (abs(v) + off for v, off in zip(values, offs, strict=True))
        turn = omega * room + half * (np.abs(x) + room)
        dead, far = (np.minimum(half * t, 2.0) for t in (parts.delay, parts.delay + parts.mean))
        cosine, sine = np.cos(omega * x), np.sin(omega * x)
        late, mean = np.exp(-s * parts.delay), np.exp(-s * parts.mean)

        # All of D.
        returned = 1.0 - mean * cosine
        d = rest + late * (common * returned + 1j * opposed * mean * sine)
        size = np.abs(sine)
        change = off_r + off_s * np.abs(returned) + off_q * size
        change += most_s * (dead + far * np.abs(cosine) + turn * (size + turn))
        change += most_q * (far * size + turn)
        clear = np.abs(d) > change + _RELATIVE_ROUNDING * (most_r + most_s + most_q * size)

        # The mean open, and then the phase too.
        a, b = np.abs(common) ** 2 - np.abs(opposed) ** 2, (common * opposed.conj()).imag
        off_a = 2.0 * (most_s * off_s + most_q * off_q)
        off_a += _RELATIVE_ROUNDING * (most_s**2 + most_q**2)
        off_b = most_s * off_q + most_q * off_s + _RELATIVE_ROUNDING * most_s * most_q
        least = np.abs(rest) ** 2 + 2.0 * (common * late * rest.conj()).real
        off = (most_r + most_s) * off_r + most_r * (off_s + most_s * dead)
        least -= 2.0 * off + _RELATIVE_ROUNDING * most_r * (most_r + most_s)
        known = sine**2 * (a - off_a) + 2.0 * (cosine * sine * b - size * off_b)
        known -= turn * (2.0 * size + turn) * (np.abs(a) + off_a)
        known -= 2.0 * turn * (np.abs(b) + off_b)
        unknown = 0.5 * (a - off_a) - np.hypot(0.5 * (a - off_a), np.abs(b) + off_b)
        return np.asarray(clear | (least + np.maximum(known, unknown) > 0.0))


def _with_change(
    p: FloatArray, s: ComplexArray, half: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Return a polynomial at s, and what it may be off by within half a width, and rounding."""
    orders = np.arange(p.size)[:, None]
    # Not by @, whose threads wait for each other on a machine that is in use.
    # Taylor's coefficients at s are those of p, shifted, times binomials.
    taylor = np.einsum("kj,jm->km", hankel(p) * comb(orders + orders.T, orders), s**orders)
    change = (np.abs(taylor[1:]) * half ** orders[1:]).sum(axis=0)
    # The coefficients are products of a few numbers; the derivatives share their rounding.
    magnitude = np.abs(p) @ (np.abs(s) + half) ** orders
    return taylor[0], change + 4.0 * p.size * EPSILON * magnitude


__all__ = ["no_root_crosses"]
