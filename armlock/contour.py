"""Compiled walks along the boundary of stability, s = j omega.

The walks take steps that are certified, not chosen. With a bound M on the second derivative
over a step, a function stays within M step^2 / 2 of its tangent. So

- `winding` never steps past the origin on the wrong side, and the argument it adds up is
  exact up to rounding;
- `sign_changes` never steps over two zeros at once, so that none is missed.

Where rounding makes a value indistinguishable from zero, the walks say so.

All functions here work on exponential sums, see `armlock.characteristic.ExponentialSum`:

    f(omega) = sum_k sums_k p_k + sum_g sum_k weights_gk p_k (exp(j omega phase_g) - 1)

with polynomials p_k of s = j omega. Polynomials of low degree are one expansion in powers of
omega. Those of high degree are expanded anew in each *piece* of the axis, from their roots:
over many decades of frequency one expansion would lose its digits.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
from numba import config, njit

from armlock.characteristic import EPSILON, LOW_DEGREE
from armlock.checks import BoolArray, ComplexArray, FloatArray, IntArray

# Rounding errors of one evaluation, in units of EPSILON times the sum of magnitudes.
ROUNDING = 8.0
# The same for the crossings of a chart's row: wider, so that what is a boundary point by
# itself is doubtful there, and counted by itself.
CAUTION = 8.0 * ROUNDING
# Share of a certified bound that a step may use up.
SAFETY = 0.95

# What `count_point` returns where it is no number of roots. The first two mean what
# `armlock.stability.unstable_roots` says; the others become errors there.
BOUNDARY = -1
UNCONFINED = -2
DOUBTFUL = -3
TOO_LONG = -4
UNTRIED = -5

# Most steps of one walk, about ten a turn of the longest delay: some ten seconds.
MOST_STEPS = 50_000_000
# No walk begins that turns the fastest exponential by more radians: it would not end.
MOST_RADIANS = 4.0 * MOST_STEPS
# Most zeros that a walk keeps: about a gigabyte.
MOST_ZEROS = 30_000_000
# Most samples of a grid.
MOST_SAMPLES = 10_000_000
# How many roots of a polynomial, each weighed by reach / (reach + distance), a piece may have
# around it. Then LOW_DEGREE powers hold the polynomial to rounding.
_CROWD = 1.5


@njit(cache=True)
def real_horner(p: FloatArray, u: float) -> float:
    """Value of a real polynomial with ascending coefficients."""
    value = 0.0
    for k in range(p.size - 1, -1, -1):
        value = value * u + p[k]
    return value


@njit(cache=True)
def _from_roots(
    roots: ComplexArray, starts: IntArray, leads: FloatArray, omega: float, reach: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Expand polynomials about j omega, in powers of u = (change of omega) / reach.

    Polynomial k has the highest coefficient leads[k], and its real roots and the upper halves
    of its pairs are roots[starts[k] : starts[k + 1]]. All are divided by one power of two.
    Returns the coefficients and their magnitudes for rounding, shape (k, LOW_DEGREE + 1), and
    bounds on what the higher powers add up to where 0 <= u <= 1.
    """
    size = LOW_DEGREE + 1
    found = np.zeros((leads.size, size), dtype=np.complex128)
    sizes = np.zeros((leads.size, size))
    left_out = np.zeros(leads.size)
    exponents = np.zeros(leads.size, dtype=np.int64)
    largest = -(1 << 60)
    for k in range(leads.size):
        found[k, 0], sizes[k, 0], total = leads[k], abs(leads[k]), abs(leads[k])
        for i in range(starts[k], starts[k + 1]):
            root = roots[i]
            below = 1j * omega - root
            q0, q1, q2 = below, 1j * reach, 0j
            m0, m1, m2 = abs(below), reach, 0.0
            if root.imag != 0.0:
                above = 1j * omega - root.conjugate()
                q0, q1, q2 = below * above, 1j * reach * (below + above), complex(-(reach**2))
                m0, m1 = abs(below) * abs(above), reach * (abs(below) + abs(above))
                m2 = reach * reach
            total *= m0 + m1 + m2
            scale = 1.0
            if total > 1e60 or 0.0 < total < 1e-60:
                exponent = int(np.floor(np.log2(total)))
                exponents[k] += exponent
                scale = 2.0**-exponent
                total *= scale
            for m in range(size - 1, -1, -1):
                new, most = q0 * found[k, m], m0 * sizes[k, m]
                if m > 0:
                    new, most = new + q1 * found[k, m - 1], most + m1 * sizes[k, m - 1]
                if m > 1:
                    new, most = new + q2 * found[k, m - 2], most + m2 * sizes[k, m - 2]
                found[k, m], sizes[k, m] = scale * new, scale * most
        factors = starts[k + 1] - starts[k]
        held = 0.0
        for m in range(size):
            held += sizes[k, m]
            # The products above round, too.
            sizes[k, m] *= 1.0 + 0.5 * factors
        left_out[k] = max(total - held, 0.0) + factors * EPSILON * total
        largest = max(largest, exponents[k])
    for k in range(leads.size):
        scale = 2.0 ** max(exponents[k] - largest, -1000)
        left_out[k] *= scale
        for m in range(size):
            found[k, m] *= scale
            sizes[k, m] *= scale
    return found, sizes, left_out


@njit(cache=True)
def _reach(roots: ComplexArray, starts: IntArray, omega: float, longest: float) -> float:
    """Length of a piece from omega on that the expansion from roots holds.

    Around each polynomial the crowd, the sum of reach / (reach + distance), is concave in the
    reach: Newton's method from below never passes the length at which it is _CROWD.
    """
    shortest = longest
    for k in range(starts.size - 1):
        reach = 0.0
        for _ in range(6):
            crowd, rate = 0.0, 0.0
            for root in roots[starts[k] : starts[k + 1]]:
                for above in (omega - root.imag, omega + root.imag):
                    distance = np.hypot(root.real, above)
                    if distance > 0.0:
                        crowd += reach / (reach + distance)
                        rate += distance / (reach + distance) ** 2
                    if root.imag == 0.0:
                        break
            if rate * (shortest - reach) <= _CROWD - crowd:
                reach = shortest
                break
            reach += (_CROWD - crowd) / rate
        shortest = min(shortest, reach)
    return shortest


@njit(cache=True)
def _shifted(
    whole: ComplexArray, omega: float, reach: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Expand polynomials in omega about another omega; see `_from_roots`."""
    found, sizes = whole.copy(), np.abs(whole)
    for k in range(whole.shape[0]):
        if omega == 0.0 and reach == 1.0:
            break
        for i in range(whole.shape[1] - 1):
            for m in range(whole.shape[1] - 2, i - 1, -1):
                found[k, m] += omega * found[k, m + 1]
                sizes[k, m] += omega * sizes[k, m + 1]
        scale = 1.0
        for m in range(whole.shape[1]):
            found[k, m] *= scale
            sizes[k, m] *= scale
            scale *= reach
    return found, sizes, np.zeros(whole.shape[0])


@njit(cache=True)
def piece(
    polynomials: tuple[Any, ...],
    weights: FloatArray,
    sums: FloatArray,
    omega: float,
    longest: float,
) -> tuple[float, float, ComplexArray, FloatArray]:
    """Expand an exponential sum over the piece of the axis that starts at omega.

    `polynomials` is what `armlock.characteristic.compiled` makes of them; weights, shape
    (groups, k), and sums, shape (k,), are those of the sum. A piece is no longer than
    `longest`; if that is infinite, polynomials of low degree are one piece from zero on.
    Returns `start` and `reach`, with u = (omega - start) / reach from 0 to 1 over the piece;
    the coefficients in powers of u of the sum, then of each group, shape (1 + groups, n); and
    magnitudes for rounding, shape (1 + groups, n + 1), the last one for what is left out.
    """
    whole, roots, starts, leads = polynomials
    start, reach = omega, longest
    if whole.shape[0] == 0:
        reach = _reach(roots, starts, omega, min(longest, 1e300))
        coefficients, magnitudes, left_out = _from_roots(roots, starts, leads, start, reach)
    else:
        if longest == np.inf:
            start, reach = 0.0, 1.0
        coefficients, magnitudes, left_out = _shifted(whole, start, reach)
    number, size = coefficients.shape
    groups = weights.shape[0]
    local = np.zeros((1 + groups, size), dtype=np.complex128)
    sizes = np.zeros((1 + groups, size + 1))
    for g in range(1 + groups):
        for k in range(number):
            weight = sums[k] if g == 0 else weights[g - 1, k]
            if weight != 0.0:
                for m in range(size):
                    local[g, m] += weight * coefficients[k, m]
                    sizes[g, m] += abs(weight) * magnitudes[k, m]
                sizes[g, size] += abs(weight) * left_out[k] / EPSILON
    if reach == 1.0 and start == 0.0:
        return start, reach, local, sizes
    # Powers that rounding hides are not worth their time.
    total = 0.0
    for g in range(1 + groups):
        for m in range(size):
            total += sizes[g, m]
    used, dropped = size, 0.0
    while used > 1:
        for g in range(1 + groups):
            dropped += sizes[g, used - 1]
        if dropped > 1e-3 * EPSILON * total:
            break
        used -= 1
    kept = np.zeros((1 + groups, used + 1))
    shorter = np.zeros((1 + groups, used), dtype=np.complex128)
    for g in range(1 + groups):
        kept[g, used] = sizes[g, size]
        for m in range(size):
            if m < used:
                kept[g, m], shorter[g, m] = sizes[g, m], local[g, m]
            else:
                kept[g, used] += sizes[g, m] / EPSILON
    return start, reach, shorter, kept


@njit(cache=True)
def evaluate(
    start: float, reach: float, local: ComplexArray, phases: FloatArray, omega: float
) -> tuple[complex, complex]:
    """Value and derivative of an exponential sum within a piece.

    Real and imaginary parts apart, since omega is real: this is the innermost loop.
    """
    size = local.shape[1]
    u = (omega - start) / reach
    value_re, value_im, slope_re, slope_im = 0.0, 0.0, 0.0, 0.0
    for k in range(size - 1, -1, -1):
        slope_re = slope_re * u + value_re
        slope_im = slope_im * u + value_im
        value_re = value_re * u + local[0, k].real
        value_im = value_im * u + local[0, k].imag
    slope_re /= reach
    slope_im /= reach
    for g in range(phases.size):
        phase = phases[g]
        if phase == 0.0:
            continue
        p_re, p_im, dp_re, dp_im = 0.0, 0.0, 0.0, 0.0
        for k in range(size - 1, -1, -1):
            dp_re = dp_re * u + p_re
            dp_im = dp_im * u + p_im
            p_re = p_re * u + local[g + 1, k].real
            p_im = p_im * u + local[g + 1, k].imag
        dp_re /= reach
        dp_im /= reach
        half = 0.5 * phase * omega
        sine, cosine = np.sin(half), np.cos(half)
        # exp(j omega phase) - 1, and phase times exp(j omega phase).
        change_re, change_im = -2.0 * sine * sine, 2.0 * sine * cosine
        turn_re, turn_im = phase * (1.0 + change_re), phase * change_im
        value_re += p_re * change_re - p_im * change_im
        value_im += p_re * change_im + p_im * change_re
        slope_re += dp_re * change_re - dp_im * change_im - p_re * turn_im - p_im * turn_re
        slope_im += dp_re * change_im + dp_im * change_re + p_re * turn_re - p_im * turn_im
    return complex(value_re, value_im), complex(slope_re, slope_im)


@njit(cache=True)
def tangent_distance(value: complex, slope: complex, step: float) -> float:
    """Smallest distance from zero of the tangent over a step."""
    speed = slope.real * slope.real + slope.imag * slope.imag
    approach = -(value.real * slope.real + value.imag * slope.imag)
    place = 0.0
    if approach > 0.0:
        place = step if approach >= speed * step else approach / speed
    return abs(value + place * slope)


@njit(cache=True)
def curvature_bound(
    start: float, reach: float, local: ComplexArray, phases: FloatArray
) -> FloatArray:
    """Polynomial in u that bounds the second derivative of an exponential sum in a piece.

    Where a polynomial is differentiated twice, |exp(j omega phase) - 1| is at most
    |phase| (start + reach u), and at most 2.
    """
    groups, size = local.shape
    bound = np.zeros(size)
    for k in range(2, size):
        bound[k - 2] += abs(local[0, k]) * k * (k - 1.0) / reach**2
    for g in range(1, groups):
        phase = abs(phases[g - 1])
        begun = min(phase * start, 2.0)
        for k in range(size):
            magnitude = abs(local[g, k])
            bound[k] += magnitude * phase * phase
            if k >= 1:
                bound[k - 1] += magnitude * phase * (2.0 * k + k * (k - 1.0)) / reach
            if k >= 2:
                bound[k - 2] += magnitude * begun * k * (k - 1.0) / reach**2
    return bound


@njit(cache=True)
def rounding_bound(
    start: float, reach: float, sizes: FloatArray, phases: FloatArray, rounding: float
) -> FloatArray:
    """Polynomial in u that bounds the rounding error of an exponential sum in a piece."""
    groups, size = sizes.shape
    bound = np.zeros(size + 1)
    for k in range(size):
        bound[k] += rounding * EPSILON * sizes[0, k]
        for g in range(1, groups):
            error = rounding * EPSILON * sizes[g, k] * abs(phases[g - 1])
            bound[k] += error * start
            bound[k + 1] += error * reach
    return bound


@njit(cache=True)
def winding(
    polynomials: tuple[Any, ...],
    weights: FloatArray,
    sums: FloatArray,
    phases: FloatArray,
    uncertain: FloatArray,
    omega_end: float,
) -> tuple[float, complex, bool]:
    """Argument gathered by an exponential sum as omega goes from 0 to `omega_end`.

    `uncertain` holds how far the entries of `sums` may be off. Returns the argument, the last
    value up to a positive factor, and whether the sum stays clear of zero. The argument is nan
    where the walk would take more than MOST_STEPS steps.
    """
    steps, argument, omega, step = 0, 0.0, 0.0, omega_end
    value, slope = 0j, 0j
    while omega < omega_end or value == 0j:
        start, reach, local, sizes = piece(polynomials, weights, sums, omega, np.inf)
        end = omega_end if polynomials[0].shape[0] > 0 else min(omega + reach, omega_end)
        bound = curvature_bound(start, reach, local, phases)
        error = rounding_bound(start, reach, sizes, phases, ROUNDING)
        off = piece(polynomials, weights, uncertain, omega, np.inf)[3]
        for k in range(min(off.shape[1], error.size)):
            error[k] += off[0, k]
        value, slope = evaluate(start, reach, local, phases, omega)
        if abs(value) <= real_horner(error, (omega - start) / reach):
            return argument, value, False
        while omega < end:
            steps += 1
            if steps > MOST_STEPS:
                return np.nan, value, True
            step = min(4.0 * step, end - omega)
            while True:
                u = (omega + step - start) / reach
                distance = tangent_distance(value, slope, step)
                # Rounding moves the tangent, too: closer to the origin nothing is certain.
                apart = 0.5 * real_horner(bound, u) * step * step
                if apart + real_horner(error, u) <= SAFETY * distance:
                    break
                step *= 0.5
                if step <= 4.0 * EPSILON * omega or step < 1e-300:
                    return argument, value, False
            following = end if step == end - omega else omega + step
            next_value, next_slope = evaluate(start, reach, local, phases, following)
            if abs(next_value) <= real_horner(error, (following - start) / reach):
                return argument, next_value, False
            # Along the tangent, then from its end to the curve: both parts are principal.
            tangent = value + step * slope
            along = tangent * value.conjugate()
            across = next_value * tangent.conjugate()
            argument += np.arctan2(along.imag, along.real)
            argument += np.arctan2(across.imag, across.real)
            omega, value, slope = following, next_value, next_slope
    return argument, value, True


@njit(cache=True)
def _taylor_signs_positive(q: FloatArray, shift: float) -> bool:
    """Whether all coefficients of q(w + shift) are positive beyond rounding, or zero."""
    p, magnitude = q.copy(), np.abs(q)
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

    A shift of the variable after which all coefficients are positive proves it.
    """
    top = q.size - 1
    while top > 0 and q[top] == 0.0:
        top -= 1
    q = q[: top + 1].copy()
    for value in q:
        if not np.isfinite(value):
            return np.nan
    if _taylor_signs_positive(q, 0.0):
        return 0.0
    if not q[top] > 0.0:
        return np.inf
    upper = 0.0
    for k in range(1, q.size):
        upper = max(upper, 2.0 * (abs(q[top - k]) / q[top]) ** (1.0 / k))
    for _ in range(60):
        if _taylor_signs_positive(q, upper):
            break
        upper *= 2.0
    lower = 0.5 * upper
    while lower > 1e-60 * upper and _taylor_signs_positive(q, lower):
        upper = lower
        lower *= 0.5
    for _ in range(6):
        middle = np.sqrt(lower * upper)
        if _taylor_signs_positive(q, middle):
            upper = middle
        else:
            lower = middle
    return upper


@njit(cache=True)
def last_frequency(
    squares: FloatArray, unit: float, factors: FloatArray, reserve: float
) -> float:
    """Frequency past which |A| exceeds the other terms of D together, so that no root crosses.

    `squares` holds |A|^2 and the squares of the other terms T_i at s = j omega, as polynomials
    in w = (omega / unit)^2; `factors` are f_i >= 0, and `reserve` is the share of A's highest
    power that sum f_i |T_i| leaves: inf is returned where that is not positive.

    By Cauchy and Schwarz (sum f_i |T_i|)^2 <= (sum a_i) (sum f_i^2 |T_i|^2 / a_i) for all
    a_i > 0, with equality where a_i is f_i |T_i|. So |A|^2 less the right-hand side is a
    polynomial in w, and `last_root_bound` applies.
    """
    if not reserve > 0.0:
        return np.inf
    # Far below rounding a factor would only underflow.
    factors = np.where(factors < 1e-100, 0.0, factors)
    top = squares.shape[1] - 1
    lead = np.sqrt(squares[0, top])
    shares = np.zeros(factors.size)
    whole = 0.0
    for i in range(factors.size):
        size = 0.0
        for m in range(top + 1):
            size += abs(squares[i + 1, m])
        shares[i] = factors[i] * np.sqrt(size)
        whole += shares[i]
    together = 0.0
    for i in range(factors.size):
        if whole > 0.0:
            shares[i] *= 0.5 * reserve * lead / whole
        shares[i] += factors[i] * np.sqrt(squares[i + 1, top])
        together += shares[i]
    q = squares[0].copy()
    for i in range(factors.size):
        if shares[i] > 0.0:
            weight = together * factors[i] ** 2 / shares[i]
            for m in range(top + 1):
                q[m] -= weight * squares[i + 1, m]
    return float(np.sqrt(last_root_bound(q)) * unit)


@njit(cache=True)
def _remaining_argument(roots: ComplexArray, omega: float) -> float:
    """Argument that the polynomial with these roots gathers from j omega to infinity."""
    argument = 0.0
    for root in roots:
        angle = np.arctan2(omega - root.imag, -root.real)
        if root.real > 0.0 and angle < 0.0:
            angle += 2.0 * np.pi
        argument += 0.5 * np.pi - angle
    return argument


@njit(cache=True)
def count_point(model: tuple[Any, ...], x: float, y: float, end: float) -> int:
    """Return the number of unstable roots at one point, or a status code below zero.

    By the argument principle: degree / 2 less the argument over pi, gathered from 0 to
    infinity, for polynomials in s; degree less the argument over pi, gathered from 0 to `end`,
    for a map. `end` is the frequency of `last_frequency`, where a map's boundary ends. The
    model is what `armlock.stability` makes of a characteristic function.
    """
    polynomials, weights, sums, reference, phases, undelayed, roots, is_map = model
    if end == np.inf:
        return UNCONFINED
    if np.isnan(end):
        return DOUBTFUL
    if phases.size and end * np.abs(phases).max() > MOST_RADIANS:
        return TOO_LONG
    dx, dy = x - reference[0], y - reference[1]
    here, uncertain, total = np.zeros_like(sums[0]), np.zeros_like(sums[0]), weights[0].copy()
    for k in range(here.size):
        here[k] = sums[0, k] - dx * sums[1, k] - dy * sums[2, k]
        # The parameters are rounded numbers themselves.
        uncertain[k] = EPSILON * (abs(x * sums[1, k]) + abs(y * sums[2, k]))
        for g in range(phases.size):
            total[g, k] -= x * weights[1, g, k] + y * weights[2, g, k]
    argument, value, clear = winding(polynomials, total, here, phases, uncertain, end)
    if not clear:
        return BOUNDARY
    if np.isnan(argument):
        return TOO_LONG
    if is_map:
        count = roots.size - argument / np.pi
    else:
        # From `end` on D / A stays close to 1, and A itself is known by its roots.
        start, reach, local, _ = piece(
            polynomials, np.zeros((0, here.size)), undelayed, end, 1e-3
        )
        a = evaluate(start, reach, local, np.zeros(0), end)[0]
        ratio = value * a.conjugate()
        argument += _remaining_argument(roots, end) - np.arctan2(ratio.imag, ratio.real)
        count = 0.5 * roots.size - argument / np.pi
    nearest = int(np.round(count)) if np.isfinite(count) else -1
    if abs(count - nearest) > 1e-3 or nearest < 0:
        return DOUBTFUL
    return nearest


@njit(cache=True, nogil=True)
def _count_range(
    first: int,
    last: int,
    model: tuple[Any, ...],
    x: FloatArray,
    y: FloatArray,
    ends: FloatArray,
    counts: IntArray,
    stop: BoolArray,
) -> None:
    """Count at points `first` to `last`, until one of them takes too long."""
    for i in range(first, last):
        counts[i] = UNTRIED if stop[0] else count_point(model, x[i], y[i], ends[i])
        if counts[i] == TOO_LONG:
            stop[0] = True


def count_points(
    model: tuple[Any, ...], x: FloatArray, y: FloatArray, ends: FloatArray
) -> IntArray:
    """`count_point` over one-dimensional arrays of the same length, on all cores.

    After the first point that takes too long no further one is tried.
    """
    counts, stop = np.empty(x.size, dtype=np.int64), np.zeros(1, dtype=np.bool_)
    _on_all_cores(_count_range, x.size, model, x, y, ends, counts, stop)
    return counts


def _on_all_cores(function: Callable[..., None], size: int, *arguments: object) -> None:
    """Call function(first, last, ...) for ranges that cover `size`, in a thread each.

    The function is compiled to release the interpreter's lock. Ranges are short, because some
    points or rows take much longer than others.
    """
    cores = config.NUMBA_NUM_THREADS
    if size < 2 or cores < 2:
        function(0, size, *arguments)
        return
    edges = np.unique(np.linspace(0, size, 16 * cores + 1).astype(int))
    with ThreadPoolExecutor(cores) as pool:
        parts = [
            pool.submit(function, int(first), int(last), *arguments)
            for first, last in pairwise(edges)
        ]
        for part in parts:
            part.result()


@njit(cache=True)
def _polish(
    start: float,
    reach: float,
    local: ComplexArray,
    phases: FloatArray,
    bound: FloatArray,
    bracket: tuple[float, float],
    guess: float,
    sign: int,
) -> tuple[float, float]:
    """Zero of the imaginary part in a bracket, by Newton steps kept inside it.

    `sign` is that of the imaginary part at the lower end. Returns the zero, and the slope of
    the imaginary part there.
    """
    lower, upper = bracket
    omega = guess
    slope = 0j
    for _ in range(80):
        value, slope = evaluate(start, reach, local, phases, omega)
        if (value.imag > 0.0) == (sign > 0):
            lower = omega
        else:
            upper = omega
        move = -value.imag / slope.imag if slope.imag != 0.0 else np.inf
        if not (lower <= omega + move <= upper):
            omega = 0.5 * (lower + upper)
            if upper - lower <= 2.0 * EPSILON * upper:
                break
            continue
        omega += move
        # What is left after a Newton step is at most curvature move^2 / (2 slope).
        left = 0.5 * real_horner(bound, (upper - start) / reach) * move * move
        if left <= 2.0 * EPSILON * upper * abs(slope.imag):
            break
    return omega, slope.imag


@njit(cache=True)
def _cubic_zero(step: float, h0: float, dh0: float, h1: float, dh1: float) -> float:
    """Zero, as an offset in (0, step), of the cubic through values and slopes at both ends."""
    t = h0 / (h0 - h1)
    for _ in range(2):
        u = 1.0 - t
        h = (
            (1.0 + 2.0 * t) * u * u * h0
            + t * u * u * step * dh0
            + t * t * (3.0 - 2.0 * t) * h1
            - t * t * u * step * dh1
        )
        dh = (
            6.0 * t * u * (h1 - h0)
            + u * (1.0 - 3.0 * t) * step * dh0
            + t * (3.0 * t - 2.0) * step * dh1
        )
        if dh == 0.0:
            break
        t -= h / dh
    return t * step if 0.0 < t < 1.0 else 0.5 * step


@njit(cache=True)
def _safe_step(h: float, dh: float, curvature: float, error: float) -> float:
    """Step over which a real function has one zero at most.

    Over |dh| / curvature it is monotonic; over the other length it keeps its sign.
    """
    certified = abs(dh) / curvature
    if abs(h) > error:
        toward = dh if h > 0.0 else -dh
        root = np.sqrt(dh * dh + 2.0 * curvature * abs(h))
        certified = max(certified, (toward + root) / curvature)
    return SAFETY * certified


# Columns of what `sign_changes` returns.
OMEGA, JUMP, WIDTH, POSITION, SPREAD = 0, 1, 2, 3, 4


@njit(cache=True)
def _place(
    zeros: FloatArray,
    start: float,
    reach: float,
    local: ComplexArray,
    phases: FloatArray,
    square: ComplexArray,
    square_phases: FloatArray,
    sizes: FloatArray,
) -> None:
    """Fill in POSITION and SPREAD of zeros that lie in one piece."""
    fastest = np.abs(phases).max()
    magnitude = np.zeros(sizes.shape[1])
    for g in range(1, sizes.shape[0]):
        for m in range(sizes.shape[1]):
            magnitude[m] += sizes[g, m]
    for zero in zeros:
        omega = zero[OMEGA]
        value, slope = evaluate(start, reach, local, phases, omega)
        measured, change = evaluate(start, reach, square, square_phases, omega)
        zero[POSITION], zero[SPREAD] = np.nan, 0.0
        if measured.real > 0.0:
            position = value.real / measured.real
            steepness = (abs(slope) + abs(position) * abs(change.real)) / measured.real
            rounding = CAUTION * EPSILON * (1.0 + fastest * omega) / measured.real
            rounding *= real_horner(magnitude, (omega - start) / reach)
            zero[POSITION], zero[SPREAD] = position, 4.0 * steepness * zero[WIDTH] + rounding


@njit(cache=True)
def sign_changes(
    polynomials: tuple[Any, ...],
    function: tuple[Any, ...],
    measure: tuple[Any, ...],
    omega_end: float,
    is_map: bool,
    rounding: float,
) -> tuple[FloatArray, bool]:
    """Zeros in [0, omega_end] of the imaginary part of an exponential sum.

    `function` and `measure` are weights, sums and phases of two exponential sums, the measure
    being positive: |M|^2 for a row x = N / M, whose `function` is N conj(M). Where the
    imaginary part is odd in omega, as it is for a row of a chart, omega = 0 is one of the
    zeros. Returns a row for each zero, and whether these are all (they are not if there are
    more than MOST_ZEROS, or the walk would take more than MOST_STEPS steps). Its columns:

    - OMEGA, polished;
    - JUMP, twice the direction of the sign change (a conjugate pair crosses); once at
      omega = 0 and, for a map, at `omega_end` (a real root crosses); 0 where rounding hides
      whether there is one;
    - WIDTH, how far rounding lets the zero move: for a zero that is not simple, half the
      stretch in which the sign is doubtful;
    - POSITION, the real part over the measure, nan where that vanishes;
    - SPREAD, how far rounding lets the position move.
    """
    weights, sums, phases = function
    zeros = np.empty((64, 5))
    if phases.size and omega_end * np.abs(phases).max() > MOST_RADIANS:
        return zeros[:0], False
    found, steps, sign = 0, 0, 0
    omega, last_clear, step = 0.0, 0.0, omega_end
    doubtful = True
    while omega < omega_end and steps <= MOST_STEPS and found <= MOST_ZEROS:
        start, reach, local, sizes = piece(polynomials, weights, sums, omega, np.inf)
        end = omega_end if polynomials[0].shape[0] > 0 else min(omega + reach, omega_end)
        bound = curvature_bound(start, reach, local, phases)
        if reach == 1.0 and start == 0.0:
            # The coefficients are real or imaginary: only the latter enter the imaginary part.
            for m in range(local.shape[1]):
                sizes[0, m] = abs(local[0, m].imag)
        error = rounding_bound(start, reach, sizes, phases, rounding)
        first = found
        value, slope = evaluate(start, reach, local, phases, omega)
        h, dh = value.imag, slope.imag
        if omega == 0.0:
            if abs(h) > error[0]:
                sign, doubtful = (1 if h > 0.0 else -1), False
            elif abs(dh) > error[1] / reach:
                sign, doubtful = (1 if dh > 0.0 else -1), False
                zeros[0, OMEGA], zeros[0, JUMP], zeros[0, WIDTH] = 0.0, sign, 0.0
                found = 1
        while omega < end and steps <= MOST_STEPS and found <= MOST_ZEROS:
            steps += 1
            step = min(2.0 * step, end - omega)
            curvature = real_horner(bound, (omega + step - start) / reach)
            if curvature > 0.0:
                uncertain = real_horner(error, (omega - start) / reach)
                certified = _safe_step(h, dh, curvature, uncertain)
                if doubtful:
                    # Nothing can be resolved here; leave the stretch, in proportion to it.
                    unresolved = 0.5 * np.sqrt(2.0 * uncertain / curvature)
                    stretch = 0.25 * (omega - last_clear)
                    certified = max(certified, unresolved, stretch, 1e-14 * omega_end)
                step = min(step, certified)
            following = end if step >= end - omega else omega + step
            old_h, old_dh = h, dh
            value, slope = evaluate(start, reach, local, phases, following)
            h, dh = value.imag, slope.imag
            if abs(h) > real_horner(error, (following - start) / reach):
                now = 1 if h > 0.0 else -1
                if now != sign or doubtful:
                    if found == zeros.shape[0]:
                        zeros = np.concatenate((zeros, np.empty_like(zeros)))
                    middle = 0.5 * (last_clear + following)
                    width = 0.5 * (following - last_clear)
                    jump = 0
                    if sign == 0:
                        # At omega = 0 itself the sign was hidden.
                        middle, width, jump = 0.0, following, now
                    elif now != sign:
                        jump = 2 * now
                        if not doubtful:
                            middle = omega + _cubic_zero(
                                following - omega, old_h, old_dh, h, dh
                            )
                        middle, rate = _polish(
                            start, reach, local, phases, bound, (last_clear, following), middle,
                            sign,
                        )  # fmt: skip
                        uncertain = real_horner(error, (middle - start) / reach)
                        if abs(rate) * width > uncertain:
                            width = uncertain / abs(rate)
                    zeros[found, OMEGA] = middle
                    zeros[found, JUMP], zeros[found, WIDTH] = jump, width
                    found += 1
                sign, last_clear, doubtful = now, following, False
            else:
                doubtful = True
            omega = following
        if is_map and omega >= omega_end and sign != 0:
            if found == zeros.shape[0]:
                zeros = np.concatenate((zeros, np.empty_like(zeros)))
            zeros[found, OMEGA] = omega_end
            zeros[found, JUMP], zeros[found, WIDTH] = -sign, 0.0
            found += 1
        if measure[0].shape[0] > 0:
            square = piece(polynomials, measure[0], measure[1], start, np.inf)[2]
            _place(zeros[first:found], start, reach, local, phases, square, measure[2], sizes)
    return zeros[:found], omega >= omega_end


@njit(cache=True)
def _fill_row(
    filled: tuple[Any, ...], model: tuple[Any, ...], rows: tuple[Any, ...], i: int
) -> None:
    """Fill row i of a chart, see `fill_rows`."""
    counts, doubtful, last = filled
    ends, y, deviation, base, x, lower, upper = rows
    polynomials, fixed, varying, fixed_sums, varying_sums, phases, measure, is_map = model
    function = (fixed - y[i] * varying, fixed_sums - deviation[i] * varying_sums, phases)
    zeros, complete = sign_changes(polynomials, function, measure, ends[i], is_map, CAUTION)
    change = np.zeros(x.size + 1, dtype=np.int64)
    total = base[i]
    trusted = complete and base[i] >= 0
    for zero in zeros:
        jump, position, spread = int(zero[JUMP]), zero[POSITION], zero[SPREAD]
        if np.isnan(position):
            continue
        if abs(position - lower[i]) <= spread or abs(position - upper[i]) <= spread:
            trusted = False
        if lower[i] < position < upper[i]:
            total += jump
            change[np.searchsorted(x, position)] += jump
        if position + spread >= x[0] and position - spread <= x[-1]:
            near = np.searchsorted(x, position - spread)
            while near < x.size and x[near] <= position + spread:
                doubtful[i, near] = True
                near += 1
    running = base[i]
    for k in range(x.size):
        running += change[k]
        counts[i, k] = running
    last[i] = total if trusted else DOUBTFUL


@njit(cache=True, nogil=True)
def _fill_range(
    first: int,
    last: int,
    filled: tuple[Any, ...],
    model: tuple[Any, ...],
    rows: tuple[Any, ...],
) -> None:
    for i in range(first, last):
        _fill_row(filled, model, rows, i)


def fill_rows(
    model: tuple[Any, ...],
    ends: FloatArray,
    y: FloatArray,
    deviation: FloatArray,
    base: IntArray,
    x: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
) -> tuple[IntArray, BoolArray, IntArray]:
    """Fill rows of a chart with counts, from the crossings of each row.

    A row is x = N / M. The model holds, in this order: the polynomials; the weights `fixed`
    and `varying`, with N conj(M) = `fixed` - y `varying`, and their sums, the latter to be
    weighted by the deviation of y from the reference; the phases of both; weights, sums and
    phases of |M|^2; and whether it is a map. Row i starts with the count base[i] at
    x = lower[i]. Returns the counts, which of them lie too near a crossing to be trusted, and
    the count at x = upper[i] (DOUBTFUL where a crossing lies too near one of the two ends, or
    there are more than can be found).
    """
    counts = np.empty((y.size, x.size), dtype=np.int64)
    doubtful = np.zeros((y.size, x.size), dtype=np.bool_)
    last = np.empty(y.size, dtype=np.int64)
    rows = ends, y, deviation, base, x, lower, upper
    _on_all_cores(_fill_range, y.size, (counts, doubtful, last), model, rows)
    return counts, doubtful, last


@njit(cache=True)
def resolved_grid(
    polynomials: tuple[Any, ...], function: tuple[Any, ...], omega_end: float, tolerance: float
) -> FloatArray:
    """Frequencies from 0 to `omega_end` between which an exponential sum is nearly straight.

    Over each step it moves by no more than twice `tolerance` times its distance from zero, and
    stays as close to its tangent, or the step is as small as rounding allows. The grid ends
    before `omega_end` if it would take more than MOST_SAMPLES.
    """
    weights, sums, phases = function
    grid = np.empty(1024)
    found, omega, step = 1, 0.0, omega_end
    grid[0] = omega
    while omega < omega_end and found < MOST_SAMPLES:
        start, reach, local, _ = piece(polynomials, weights, sums, omega, np.inf)
        end = omega_end if polynomials[0].shape[0] > 0 else min(omega + reach, omega_end)
        bound = curvature_bound(start, reach, local, phases)
        while omega < end and found < MOST_SAMPLES:
            value, slope = evaluate(start, reach, local, phases, omega)
            step = min(2.0 * step, end - omega)
            smallest = max(1e-13 * omega, 1e-16 * omega_end)
            while True:
                nearest = tangent_distance(value, slope, step)
                u = (omega + step - start) / reach
                left = 0.5 * real_horner(bound, u) * step * step
                moved = 0.5 * step * abs(slope)
                if max(left, moved) <= tolerance * nearest or step <= smallest:
                    break
                step *= 0.5
            omega = end if step >= end - omega else omega + step
            if found == grid.size:
                grid = np.concatenate((grid, np.empty_like(grid)))
            grid[found] = omega
            found += 1
    return grid[:found]
