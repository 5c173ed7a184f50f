"""Compiled: the smallest distance of an open loop from -1 over all frequencies, certified.

With L = N / R the walk looks for the smallest |1 + L|, or the smallest |1 + L| / |1 - L|. It
keeps the smallest value found so far, and steps over what cannot hold a smaller one:

- a step of the walk, where the tangents of N and R, and bounds on their second derivatives,
  leave no room for it;
- a whole piece of the axis, where L with free phases of its arms, which fills a disc, stays
  clear of the disc in which a smaller value would have to lie. At high frequency the phases
  turn much faster than anything else changes, and this spares most of the work.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from armlock.checks import ComplexArray, FloatArray
from armlock.compiled import njit
from armlock.contour import MOST_STEPS
from armlock.exponentials import (
    EPSILON,
    ROUNDING,
    curvature_bound,
    evaluate,
    piece,
    quotient,
    real_horner,
    rounding_bound,
    tangent_distance,
)

# Turns of the longest delay in a piece.
_TURNS = 32.0


@njit(cache=True)
def excluded_disc(value: float, symmetric: bool) -> tuple[float, float]:
    """Centre and radius of the disc in which the distance of L from -1 is below a value.

    The distance is |1 + L|, or, if `symmetric`, |1 + L| / |1 - L|, whose level lines are the
    circles of Apollonius.
    """
    if not symmetric:
        return -1.0, value
    square = value * value
    return -(1.0 + square) / (1.0 - square), 2.0 * value / (1.0 - square)


@njit(cache=True)
def _distance(n: complex, r: complex, symmetric: bool) -> float:
    """|1 + L|, or |1 + L| / |1 - L|, of L = n / r."""
    below = abs(r - n) if symmetric else abs(r)
    return abs(r + n) / below if below > 0.0 else np.inf


@njit(cache=True)
def _combined(
    local: ComplexArray, sizes: FloatArray, weights: FloatArray, sums: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Sum polynomials, given as rows 1 to 3, as `armlock.exponentials.piece` does."""
    rows = 1 + weights.shape[0]
    found = np.zeros((rows, local.shape[1]), dtype=np.complex128)
    most = np.zeros((rows, sizes.shape[1]))
    for g in range(rows):
        for k in range(sums.size):
            weight = sums[k] if g == 0 else weights[g - 1, k]
            found[g] += weight * local[k + 1]
            most[g] += abs(weight) * sizes[k + 1]
    return found, most


@njit(cache=True)
def _clear(
    local: ComplexArray,
    sizes: FloatArray,
    start: float,
    reach: float,
    arms: FloatArray,
    dead_time: FloatArray,
    disc: tuple[float, float],
) -> bool:
    """Whether L stays outside a disc over a whole piece, whatever the phases of the arms.

    With centre a and radius r, and `local` rows R, B1 and B2, that is
    |(B1 + B2) exp(-s delay) - a R| > r |R| + |c1 B1| + |c2 B2|.
    """
    centre, radius = disc
    weights = np.array([[0.0, 1.0, 1.0]])
    apart, most = _combined(local, sizes, weights, np.array([-centre, 1.0, 1.0]))
    bound = curvature_bound(start, reach, apart, dead_time)
    error = rounding_bound(start, reach, most, dead_time, ROUNDING)
    value, slope = evaluate(start, reach, apart, dead_time, start)
    if value == 0.0:
        return False
    # |value + slope t| >= |value| (1 + t Re(slope / value)), and alike from above: the linear
    # parts of all terms add up, and what is left is of second order.
    begin = abs(value)
    change = reach * (slope * value.conjugate()).real / begin
    left = 0.5 * real_horner(bound, 1.0) * reach * reach + real_horner(error, 1.0)
    for k, weight in ((1, radius), (2, arms[0]), (3, arms[1])):
        size = abs(local[k, 0])
        if size == 0.0:
            left += weight * np.abs(local[k]).sum()
            continue
        begin -= weight * size
        higher = 0.0
        if local.shape[1] > 1:
            first = local[k, 1] * local[k, 0].conjugate() / size
            change -= weight * first.real
            higher = abs(local[k, 1])
        beyond = np.abs(local[k, 2:]).sum()
        left += weight * (beyond + 0.5 * (higher + beyond) ** 2 / size)
    return bool(min(begin, begin + change) > left)


@njit(cache=True)
def _stays_above(
    over: complex, over_slope: complex, under: complex, under_slope: complex, level: float,
    step: float,
) -> float:  # fmt: skip
    """Bound from below on |over + slope t| - level |under + slope t| for 0 <= t <= step.

    |v + v' t| lies between |v| (1 + t Re(v' / v)) and that plus (|v'| t)^2 / (2 |v|), so that
    what both change by in proportion does not count.
    """
    if over == 0.0 or under == 0.0:
        return -np.inf
    begin = abs(over) - level * abs(under)
    rate = (over_slope * over.conjugate()).real / abs(over)
    rate -= level * (under_slope * under.conjugate()).real / abs(under)
    second = 0.5 * level * (abs(under_slope) * step) ** 2 / abs(under)
    return min(begin, begin + rate * step) - second


@njit(cache=True)
def smallest_distance(
    polynomials: tuple[Any, ...],
    numerator: tuple[Any, ...],
    arms: FloatArray,
    dead_time: FloatArray,
    symmetric: bool,
    omega: float,
    omega_end: float,
    longest_delay: float,
    best: float,
    tolerance: float,
) -> tuple[float, float, float, bool]:
    """Smallest distance of L from -1 from omega to omega_end.

    `polynomials` are R, B1 and B2, `numerator` weights, sums and phases of N, `arms` |c1| and
    |c2|, and `dead_time` the phase rate of the dead time. Only distances below `best` are
    looked for. Returns the smallest one that was met, or `best`; where; the length of the step
    there; and whether the walk came to its end, which it does not if it is too long or rounding
    hides L. No distance is smaller than the result by more than the share `tolerance`.
    """
    weights, sums, phases = numerator
    unit, nothing, none = np.eye(3), np.zeros((0, 3)), np.zeros(0)
    only_r = np.array([1.0, 0.0, 0.0])
    where, width, steps = np.nan, 0.0, 0
    turn = 2.0 * np.pi / longest_delay
    longest = turn
    while omega < omega_end:
        start, reach, local, sizes = piece(
            polynomials, unit, np.zeros(3), omega, min(longest, max(omega_end, turn))
        )
        end = min(omega + reach, omega_end)
        disc = excluded_disc(best * (1.0 - tolerance), symmetric)
        if _clear(local, sizes, start, reach, arms, dead_time, disc):
            omega = end
            longest = 4.0 * reach
            continue
        if reach > 1.01 * _TURNS * turn:
            # Too long to be followed in one piece: where it is clear, and where not?
            longest = 0.25 * reach
            continue
        longest = _TURNS * turn
        n, n_sizes = _combined(local, sizes, weights, sums)
        r, r_sizes = _combined(local, sizes, nothing, only_r)
        n_bound = curvature_bound(start, reach, n, phases)
        r_bound = curvature_bound(start, reach, r, none)
        n_error = rounding_bound(start, reach, n_sizes, phases, ROUNDING)
        r_error = rounding_bound(start, reach, r_sizes, none, ROUNDING)
        value, slope = evaluate(start, reach, n, phases, omega)
        below, change = evaluate(start, reach, r, none, omega)
        step = end - omega
        while omega < end:
            steps += 1
            if steps > MOST_STEPS:
                return best, where, width, False
            step = min(2.0 * step, end - omega)
            while True:
                following = end if step >= end - omega else omega + step
                new_value, new_slope = evaluate(start, reach, n, phases, following)
                new_below, new_change = evaluate(start, reach, r, none, following)
                here = _distance(new_value, new_below, symmetric)
                u = (following - start) / reach
                bent = 0.5 * step * step * real_horner(r_bound, u)
                both = 0.5 * step * step * real_horner(n_bound, u) + bent
                error = real_horner(n_error, u) + real_horner(r_error, u)
                over, over_slope = below + value, change + slope
                under, under_slope, under_bent = below, change, bent
                if symmetric:
                    under, under_slope, under_bent = below - value, change - slope, both
                least = tangent_distance(over, over_slope, step) - both - error
                most = max(abs(under), abs(under + step * under_slope)) + under_bent + error
                level = (1.0 - tolerance) * min(best, here)
                if least >= level * most:
                    break
                if _stays_above(over, over_slope, under, under_slope, level, step) >= (
                    both + level * under_bent + (1.0 + level) * error
                ):
                    break
                step *= 0.5
                if step <= 1e-15 * omega or step < 1e-300:
                    # Rounding hides more: the loop touches -1 here, or nothing is certain.
                    certain = (1.0 + level) * error <= 1e-6 * most
                    return min(best, max(least / most, 0.0)), omega, step, certain
            if here < best:
                best, where, width = here, following, step
            omega, value, slope = following, new_value, new_slope
            below, change = new_below, new_change
    return best, where, width, True


@njit(cache=True)
def _turned(
    local: ComplexArray,
    start: float,
    reach: float,
    dead_time: FloatArray,
    point: float,
    sign: float,
) -> bool:
    """Whether sign Re(M - point) > 0 over a piece, for the centre M of the disc of L.

    With `local` rows R, B1 and B2, M is (B1 + B2) exp(-s delay) / R. Multiplied by |R|^2 it is
    a polynomial, up to the second order of what the dead time turns over the piece.
    """
    below, size = local[1], local.shape[1]
    turn = 1j * dead_time[0] * reach
    centre = (local[2] + local[3]) * np.exp(1j * dead_time[0] * start)
    left = 0.5 * np.abs(centre).sum() * abs(turn) ** 2
    above = np.zeros(size + 1, dtype=np.complex128)
    above[:size] = centre - point * below
    above[1:] += turn * centre
    product = np.zeros(2 * size)
    for k in range(size + 1):
        for m in range(size):
            product[k + m] += sign * (above[k] * below[m].conjugate()).real
    left += 64.0 * EPSILON * np.abs(above).sum()
    left = left * np.abs(below).sum() + np.abs(product[2:]).sum()
    return bool(min(product[0], product[0] + product[1]) > left)


@njit(cache=True)
def meeting_intervals(
    polynomials: tuple[Any, ...],
    arms: FloatArray,
    dead_time: FloatArray,
    near: float,
    far: float,
    omega_end: float,
    longest_delay: float,
) -> FloatArray:
    """Intervals of [0, omega_end], shape (n, 2), outside which L meets no point of a segment.

    `polynomials` are R, B1 and B2, `arms` |c1| and |c2|, and `dead_time` the phase rate of the
    dead time. The segment is that from `far` to `near` on the negative real axis; L, with any
    phases of its arms, fills a disc. This is clear of the segment if it is clear of the
    disc around it, or of the end that is nearest to its centre.
    """
    discs = ((0.5 * (near + far), 0.5 * (near - far)), (near, 0.0), (far, 0.0))
    found = np.empty((64, 2))
    unit, number, omega = np.eye(3), 0, 0.0
    longest = np.inf
    while omega < omega_end:
        shortest = max(_TURNS * 2.0 * np.pi / longest_delay, 3e-3 * omega)
        longest = max(min(longest, omega_end), shortest)
        start, reach, local, sizes = piece(polynomials, unit, np.zeros(3), omega, longest)
        clear = False
        for k in range(3):
            turned = k == 0 or _turned(
                local, start, reach, dead_time, discs[k][0], 1.0 if k == 1 else -1.0
            )
            if turned and _clear(local, sizes, start, reach, arms, dead_time, discs[k]):
                clear = True
                break
        if not clear and reach > 1.01 * shortest:
            longest = 0.25 * reach
            continue
        end = min(omega + reach, omega_end)
        if not clear and number and found[number - 1, 1] == omega:
            found[number - 1, 1] = end
        elif not clear:
            if number == found.shape[0]:
                found = np.concatenate((found, np.empty_like(found)))
            found[number, 0], found[number, 1] = omega, end
            number += 1
        omega = end
        longest = 4.0 * reach
    return found[:number]


#: Places in what `free_margins_at` returns.
MODULUS, RATIO, PHASE, DELAY = 0, 1, 2, 3


@njit(cache=True)
def free_margins_at(centre: complex, radius: float, omega: float) -> FloatArray:
    """Smallest margins of all L in a disc, at one frequency.

    Returns the distance from -1, |1 + L| / |1 - L|, and the phase in rad and the delay in s of
    the disc's share of the unit circle; inf where there is no share.
    """
    found = np.full(4, np.inf)
    modulus = abs(1.0 + centre) - radius
    if modulus <= 0.0:
        return np.zeros(4)
    found[MODULUS] = modulus
    # w = (1 + L) / (1 - L) takes the disc to a disc, or to the outside of one.
    below = abs(1.0 - centre) ** 2 - radius**2
    if below == 0.0:
        found[RATIO] = modulus / (2.0 * radius)
    else:
        image = abs(((1.0 + centre) * (1.0 - centre).conjugate() + radius**2) / below)
        found[RATIO] = abs(image - abs(2.0 * radius / below))
    size = abs(centre)
    if abs(size - 1.0) <= radius:
        half = np.pi
        if size > 0.0:
            half = np.arccos(min(max((1.0 + size**2 - radius**2) / (2.0 * size), -1.0), 1.0))
        angle = np.arctan2(centre.imag, centre.real)
        lag = (angle - half + np.pi) % (2.0 * np.pi)
        lead = (np.pi - angle - half) % (2.0 * np.pi)
        found[PHASE], found[DELAY] = min(lag, lead), lag / omega
    return found


@njit(cache=True)
def _arms(factors: tuple[Any, ...], omega: float) -> ComplexArray:
    """Return B1 / R and B2 / R at s = j omega."""
    roots, starts, leads = factors
    values, poles = np.empty(2, dtype=np.complex128), roots[: starts[1]]
    for k in range(2):
        zeros = roots[starts[k + 1] : starts[k + 2]]
        values[k] = quotient(zeros, poles, complex(leads[k + 1] / leads[0]), 1j * omega)
    return values


@njit(cache=True)
def _logarithms(
    factors: tuple[Any, ...], omega: float
) -> tuple[ComplexArray, FloatArray, float]:
    """How the logarithms of R, B1 and B2 change at s = j omega.

    Returns their derivatives in omega; the sums of 1 / distance^2 over their roots; and the
    distance of the nearest root. Over a step each leaves its tangent by at most step^2 / 2
    times the sum, over 1 - step / nearest, because |log(1 + x) - x| <= |x|^2 / (2 (1 - |x|)).
    """
    roots, starts, _ = factors
    rates, squares, nearest = np.zeros(3, dtype=np.complex128), np.zeros(3), np.inf
    for k in range(3):
        for i in range(starts[k], starts[k + 1]):
            away = 1j * omega - roots[i]
            square = away.real * away.real + away.imag * away.imag
            if square == 0.0:
                return rates, squares, 0.0
            rates[k] += 1j * away.conjugate() / square
            squares[k] += 1.0 / square
            nearest = min(nearest, square)
    return rates, squares, np.sqrt(nearest)


@njit(cache=True)
def free_margins_over(
    factors: tuple[Any, ...], arms: FloatArray, delay: float, omega: FloatArray
) -> FloatArray:
    """Smallest margins of the disc that L fills with free phases, at given frequencies.

    A row of `free_margins_at` for each.
    """
    found = np.empty((omega.size, 4))
    for i, w in enumerate(omega):
        values = _arms(factors, w)
        centre = (values[0] + values[1]) * np.exp(-1j * w * delay)
        radius = arms[0] * abs(values[0]) + arms[1] * abs(values[1])
        found[i] = free_margins_at(centre, radius, w)
    return found


@njit(cache=True)
def free_margins(
    factors: tuple[Any, ...],
    arms: FloatArray,
    delay: float,
    omega: float,
    omega_end: float,
    best: FloatArray,
    tolerance: FloatArray,
) -> tuple[FloatArray, FloatArray, bool]:
    """Smallest margins of the disc that L fills with free phases, from omega to `omega_end`.

    `factors` are the roots of R, B1 and B2, one after the other; where those of each begin; and
    the highest coefficients. `arms` are the sizes of c1 and c2. `best` holds values that are
    known to occur, or inf. Returns the smallest values, where they were met (nan for those of
    `best`), and whether the walk came to its end. None is smaller than the result by more than
    its share `tolerance`.
    """
    best, where = best.copy(), np.full(4, np.nan)
    step = omega_end
    for _ in range(MOST_STEPS // 8):
        values = _arms(factors, omega)
        rates, squares, nearest = _logarithms(factors, omega)
        k = 0 if abs(values[0]) >= abs(values[1]) else 1
        arm, other_arm = arms[k], arms[1 - k]
        first = values[k] * np.exp(-1j * omega * delay)
        ratio = values[1 - k] / values[k]
        centre = first * (1.0 + ratio)
        radius = abs(first) * (arm + other_arm * abs(ratio))
        here = free_margins_at(centre, radius, omega)
        for m in range(4):
            if here[m] < best[m]:
                best[m], where[m] = here[m], omega
        if best[MODULUS] == 0.0:
            # Some phases take L to -1.
            return best, where, True
        # Rates and bounds on second derivatives of what turns the first arm, and of the ratio.
        speed, bend = abs(rates[k + 1] - rates[0] - 1j * delay), squares[k + 1] + squares[0]
        other_speed, other_bend = abs(rates[2 - k] - rates[k + 1]), squares[1] + squares[2]
        step = min(2.0 * step, 0.5 * nearest, omega_end - omega)
        if step <= 1e-15 * omega:
            return best, where, False
        while True:
            end = omega + step
            second = 0.5 * step * step / (1.0 - step / nearest)
            turned = speed * step + bend * second
            bent = other_speed * step + other_bend * second
            # Over the step L is the disc times one factor, that of the first arm without the
            # phases; the second arm adds what it changes otherwise.
            if max(turned, bent) < 0.5:
                factor = np.expm1(turned)
                wide = radius + abs(first) * (1.0 + other_arm) * abs(ratio) * np.expm1(bent)
                # With a factor f, |1 + f L| = |f| |1 / f + L|: what matters is how far f takes
                # L, or -1 if that is less.
                moved = factor * (abs(centre) + wide)
                less = min(moved, factor / (1.0 - factor))
                least = free_margins_at(centre, wide + less, end)
                if moved > factor:
                    near = free_margins_at(centre, wide, end)
                    least[MODULUS] = (1.0 - factor) * near[MODULUS] - factor
                    # As |1 + L| + |1 - L| >= 2, 1 / |1 - L| is at most half of one plus the
                    # ratio.
                    more = 0.5 * factor * (1.0 + near[RATIO])
                    least[RATIO] = (1.0 - factor) * near[RATIO] - more
                    least[RATIO] /= 1.0 + factor + more
                if (least >= (1.0 - tolerance) * best).all():
                    break
                if step <= 1e-12 * omega:
                    # The share of the unit circle of a small disc may begin and end within it.
                    for m in range(4):
                        if least[m] < best[m]:
                            best[m], where[m] = max(least[m], 0.0), omega
                    break
            step *= 0.5
        if end >= omega_end * (1.0 - 1e-15):
            return best, where, True
        omega = end
    return best, where, False
