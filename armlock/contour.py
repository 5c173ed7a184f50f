"""Compiled walks along the stability boundary s = j omega.

Both walks take steps that are certified, not chosen: with a bound M on the second
derivative over a step, the function stays within M step^2 / 2 of its tangent. So

- `winding` never steps past the origin on the wrong side, and the argument it adds up is
  exact up to rounding;
- `sign_changes` never steps over two zeros at once, so that none is missed.

Where rounding makes a value indistinguishable from zero, the walks say so.

All functions here work on exponential sums sum_g P_g(omega) exp(j omega phase_g), see
`armlock.characteristic.ExponentialSum`. They are evaluated as
sum_g P_g + sum_g P_g (exp(j omega phase_g) - 1) with the first sum given, which keeps its
relative accuracy where the undelayed parts cancel, as they do at (c1, c2) = (1, 1) and low
frequency.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numba import njit, prange

from armlock.checks import BoolArray, ComplexArray, FloatArray, IntArray

EPSILON = 2.0**-52
# Rounding errors of one evaluation, in units of EPSILON times the sum of magnitudes.
ROUNDING = 8.0
# The same for the crossings of a chart's row: wider, so that what is a boundary point by
# itself is doubtful there, and counted by itself.
CAUTION = 8.0 * ROUNDING
# Share of a certified bound that a step may use up.
SAFETY = 0.95

# Status codes of `count_points`, below every count.
BOUNDARY = -1
UNCONFINED = -2
DOUBTFUL = -3
TOO_LONG = -4
UNTRIED = -5

# Most steps of one walk, about ten a turn of the longest delay: some ten seconds.
MOST_STEPS = 50_000_000
# Most zeros and samples that a walk keeps: about a gigabyte.
MOST_ZEROS = 30_000_000
MOST_SAMPLES = 10_000_000
# Products below this have lost digits, and are about to vanish.
_TINY = 1e-280

# Whether this process was forked: GNU OpenMP ends a forked process that starts its threads
# again, so that the loops over points and rows run on one core there.
_forked = False


def _note_fork() -> None:
    global _forked
    _forked = True


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)


@njit(cache=True, inline="always")
def _real_horner(p: FloatArray, omega: float) -> float:
    value = 0.0
    for k in range(p.size - 1, -1, -1):
        value = value * omega + p[k]
    return value


@njit(cache=True)
def _evaluate(
    coefficients: ComplexArray, sums: ComplexArray, phases: FloatArray, omega: float
) -> tuple[complex, complex]:
    """Value and derivative of an exponential sum; `sums` holds the sum over its groups.

    Real and imaginary parts apart, since omega is real: this is the innermost loop.
    """
    size = sums.size
    value_re, value_im, slope_re, slope_im = 0.0, 0.0, 0.0, 0.0
    for k in range(size - 1, -1, -1):
        slope_re = slope_re * omega + value_re
        slope_im = slope_im * omega + value_im
        value_re = value_re * omega + sums[k].real
        value_im = value_im * omega + sums[k].imag
    for g in range(phases.size):
        phase = phases[g]
        if phase == 0.0:
            continue
        p_re, p_im, dp_re, dp_im = 0.0, 0.0, 0.0, 0.0
        for k in range(size - 1, -1, -1):
            dp_re = dp_re * omega + p_re
            dp_im = dp_im * omega + p_im
            p_re = p_re * omega + coefficients[g, k].real
            p_im = p_im * omega + coefficients[g, k].imag
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
def _tangent_distance(value: complex, slope: complex, step: float) -> float:
    """Smallest distance from zero of the tangent over a step."""
    speed = slope.real * slope.real + slope.imag * slope.imag
    approach = -(value.real * slope.real + value.imag * slope.imag)
    place = 0.0
    if approach > 0.0:
        place = step if approach >= speed * step else approach / speed
    return abs(value + place * slope)


@njit(cache=True)
def _curvature_bound(
    coefficients: ComplexArray, sums: ComplexArray, phases: FloatArray
) -> FloatArray:
    """Polynomial in omega that bounds the second derivative of an exponential sum.

    Where the polynomials are differentiated twice, |exp(j omega phase) - 1| is at most
    omega |phase|, once at most |phase|.
    """
    groups, size = coefficients.shape
    bound = np.zeros(size)
    for k in range(2, size):
        bound[k - 2] += abs(sums[k]) * k * (k - 1.0)
    for g in range(groups):
        phase = abs(phases[g])
        for k in range(size):
            magnitude = abs(coefficients[g, k])
            bound[k] += magnitude * phase * phase
            if k >= 1:
                bound[k - 1] += magnitude * phase * (2.0 * k + k * (k - 1.0))
    return bound


@njit(cache=True)
def winding(
    coefficients: ComplexArray,
    sums: ComplexArray,
    phases: FloatArray,
    noise: FloatArray,
    omega_end: float,
) -> tuple[float, complex, bool]:
    """Argument gathered by an exponential sum as omega goes from 0 to `omega_end`.

    Returns the argument, the last value, and whether the sum stays clear of zero.
    `noise` is the polynomial in omega that bounds its rounding error. The argument is nan
    where the walk would take more than MOST_STEPS steps.
    """
    steps = 0
    bound = _curvature_bound(coefficients, sums, phases)
    omega = 0.0
    value, slope = _evaluate(coefficients, sums, phases, omega)
    argument = 0.0
    step = omega_end
    if abs(value) <= _real_horner(noise, 0.0):
        return argument, value, False
    while omega < omega_end:
        steps += 1
        if steps > MOST_STEPS:
            return np.nan, value, True
        step = min(4.0 * step, omega_end - omega)
        while True:
            distance = _tangent_distance(value, slope, step)
            # Rounding moves the tangent, too: closer to the origin nothing is certain.
            apart = 0.5 * _real_horner(bound, omega + step) * step * step
            if apart + _real_horner(noise, omega + step) <= SAFETY * distance:
                break
            step *= 0.5
            if step <= 4.0 * EPSILON * omega or step < 1e-300:
                return argument, value, False
        following = omega_end if step == omega_end - omega else omega + step
        next_value, next_slope = _evaluate(coefficients, sums, phases, following)
        if abs(next_value) <= _real_horner(noise, following):
            return argument, next_value, False
        # Along the tangent, then from its end to the curve: both parts are principal values.
        tangent = value + step * slope
        along = tangent * value.conjugate()
        across = next_value * tangent.conjugate()
        argument += np.arctan2(along.imag, along.real) + np.arctan2(across.imag, across.real)
        omega, value, slope = following, next_value, next_slope
    return argument, value, True


@njit(cache=True)
def _taylor_signs_positive(q: FloatArray, shift: float) -> bool:
    """Whether all coefficients of q(w + shift) are positive beyond rounding, or zero."""
    size = q.size
    p = q.copy()
    magnitude = np.abs(q)
    for i in range(size - 1):
        for k in range(size - 2, i - 1, -1):
            p[k] += shift * p[k + 1]
            magnitude[k] += shift * magnitude[k + 1]
    return bool(np.all(p >= 1e-13 * magnitude))


@njit(cache=True)
def last_crossing_bound(
    squares: FloatArray, leads: FloatArray, unit: float, x: float, y: float
) -> float:
    """Frequency past which |A| > |x B1| + |y B2|, so that no root can cross; inf if none.

    It is nan where a number overflows or underflows. `squares` holds |A|^2, |B1|^2 and
    |B2|^2 at s = j omega as polynomials in w = (omega / unit)^2, and `leads` the magnitudes
    of the highest coefficients of A, B1 and B2. With G = |A|^2 - |x B1|^2 - |y B2|^2 the
    inequality is G > 0 and Q = G^2 - 4 |x B1|^2 |y B2|^2 > 0. A shift of w after which every
    coefficient of Q is positive proves that Q has no root beyond it (Budan), and then G keeps
    its sign.
    """
    first, second = abs(x) * leads[1], abs(y) * leads[2]
    spare = leads[0] - first - second
    if not np.isfinite(spare):
        return np.nan
    if spare <= 16.0 * EPSILON * leads[0]:
        return np.inf
    size = squares.shape[1]
    g, b1, b2 = squares[0].copy(), x * x * squares[1], y * y * squares[2]
    for i in range(size):
        # What vanishes next to a number of ordinary size does not matter.
        largest = max(abs(squares[0, i]), abs(b1[i]), abs(b2[i]))
        lost = (x != 0.0 and squares[1, i] != 0.0 and abs(b1[i]) < _TINY) or (
            y != 0.0 and squares[2, i] != 0.0 and abs(b2[i]) < _TINY
        )
        if lost and largest < _TINY:
            return np.nan
        g[i] -= b1[i] + b2[i]
    size_of_g = np.abs(squares[0]) + np.abs(b1) + np.abs(b2)
    q, magnitude = np.zeros(2 * size - 1), np.zeros(2 * size - 1)
    acts = np.zeros(2 * size - 1, dtype=np.bool_)
    for i in range(size):
        for k in range(size):
            q[i + k] += g[i] * g[k] - 4.0 * b1[i] * b2[k]
            magnitude[i + k] += size_of_g[i] * size_of_g[k]
            if size_of_g[i] > 0.0 and size_of_g[k] > 0.0:
                acts[i + k] = True
    if not np.isfinite(q).all() or (acts & (magnitude < _TINY)).any():
        return np.nan
    # Without the digits that the sum above has lost near the limit of the chain.
    share = q[2 * size - 2] / magnitude[2 * size - 2]
    if share < 1e-3:
        scale = squares[0, size - 1] ** 0.5 / leads[0]
        lead = spare * scale * (leads[0] + first + second) * scale
        lead *= (leads[0] + first - second) * scale * (leads[0] - first + second) * scale
        q[2 * size - 2] = lead
    lead = q[2 * size - 2]
    if not lead > 0.0:
        return np.nan
    if _taylor_signs_positive(q, 0.0):
        return 0.0
    upper = 0.0
    for k in range(1, q.size):
        upper = max(upper, 2.0 * (abs(q[q.size - 1 - k]) / lead) ** (1.0 / k))
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
    return float(np.sqrt(upper) * unit)


@njit(cache=True)
def _needs_too_long(coefficients: ComplexArray, phases: FloatArray, omega_end: float) -> bool:
    """Whether a walk over an exponential sum takes more than MOST_STEPS steps.

    With S the sum of the delayed terms' magnitudes, and as long as the undelayed one is no
    larger, the sum is at most 2 S, and half its second derivative grows to the mean of
    phase^2, weighted by the terms, times S: no step is longer than 2 over its square root.
    """
    fastest = np.abs(phases).max()
    omega = 2.0 * MOST_STEPS / fastest if fastest > 0.0 else np.inf
    while omega < omega_end:
        undelayed, total, weighted = 0j, 0.0, 0.0
        for g in range(phases.size):
            value = 0j
            for k in range(coefficients.shape[1] - 1, -1, -1):
                value = value * omega + coefficients[g, k]
            if phases[g] == 0.0:
                undelayed += value
            else:
                total += abs(value)
                weighted += abs(value) * (phases[g] / fastest) ** 2
        if not np.isfinite(weighted):
            return True
        if abs(undelayed) > total:
            return False
        if omega * fastest * np.sqrt(weighted / total) > 2.0 * MOST_STEPS:
            return True
        omega *= 4.0
    return False


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
def count_point(model: tuple[Any, ...], x: float, y: float) -> int:
    """Return the number of unstable roots at one point, or a status code below zero.

    By the argument principle: degree / 2 less the argument over pi, gathered from 0 to
    infinity, for a polynomial in s (`omega_end` is zero); degree less the argument over pi,
    gathered from 0 to `omega_end`, for a map, whose boundary ends there. The model is what
    `armlock.stability` makes of a characteristic function.
    """
    parts, sums, reference, phases, roots, squares, leads, unit, omega_end = model
    coefficients = parts[0] - x * parts[1] - y * parts[2]
    if not np.isfinite(coefficients).all():
        return DOUBTFUL
    size = coefficients.shape[1]
    dx, dy = x - reference[0], y - reference[1]
    undelayed = sums[0] - dx * sums[1] - dy * sums[2]
    noise = np.zeros(size + 1)
    for k in range(size):
        b1, b2 = abs(sums[1, k]), abs(sums[2, k])
        noise[k] += EPSILON * ROUNDING * (abs(sums[0, k]) + abs(dx) * b1 + abs(dy) * b2)
        # The parameters themselves are rounded numbers.
        noise[k] += EPSILON * (abs(x) * b1 + abs(y) * b2)
        for g in range(phases.size):
            magnitude = abs(coefficients[g, k] * phases[g])
            noise[k + 1] += EPSILON * ROUNDING * magnitude
    is_map = omega_end > 0.0
    end = omega_end
    if not is_map:
        end = last_crossing_bound(squares, leads, unit, x, y)
        if end == np.inf:
            return UNCONFINED
        if np.isnan(end):
            return DOUBTFUL
        if _needs_too_long(coefficients, phases, end):
            return TOO_LONG
    argument, value, clear = winding(coefficients, undelayed, phases, noise, end)
    if not clear:
        return BOUNDARY
    if np.isnan(argument):
        return TOO_LONG
    if is_map:
        count = roots.size - argument / np.pi
    else:
        a = 0j
        for k in range(size - 1, -1, -1):
            a = a * end + parts[0, 0, k]
        if a == 0.0:
            return DOUBTFUL
        ratio = value / a
        # D / A winds no further past `end`; A itself does, in closed form.
        argument += _remaining_argument(roots, end) - np.arctan2(ratio.imag, ratio.real)
        count = 0.5 * roots.size - argument / np.pi
    nearest = int(np.round(count)) if np.isfinite(count) else -1
    if abs(count - nearest) > 1e-3 or nearest < 0:
        return DOUBTFUL
    return nearest


@njit(cache=True)
def _count_into(
    counts: IntArray, i: int, model: tuple[Any, ...], x: float, y: float, stop: BoolArray
) -> None:
    """Count at point i, unless a walk elsewhere has proved too long."""
    counts[i] = UNTRIED if stop[0] else count_point(model, x, y)
    if counts[i] == TOO_LONG:
        stop[0] = True


@njit(cache=True, parallel=True)
def _count_on_all_cores(model: tuple[Any, ...], x: FloatArray, y: FloatArray) -> IntArray:
    counts, stop = np.empty(x.size, dtype=np.int64), np.zeros(1, dtype=np.bool_)
    for i in prange(x.size):
        _count_into(counts, i, model, x[i], y[i], stop)
    return counts


@njit(cache=True)
def _count_on_one_core(model: tuple[Any, ...], x: FloatArray, y: FloatArray) -> IntArray:
    counts, stop = np.empty(x.size, dtype=np.int64), np.zeros(1, dtype=np.bool_)
    for i in range(x.size):
        _count_into(counts, i, model, x[i], y[i], stop)
    return counts


def count_points(model: tuple[Any, ...], x: FloatArray, y: FloatArray) -> IntArray:
    """`count_point` over one-dimensional arrays x and y of the same length.

    After the first point that takes too long no further one is tried.
    """
    count = _count_on_one_core if _forked else _count_on_all_cores
    counts: IntArray = count(model, x, y)
    return counts


@njit(cache=True)
def _polish(
    coefficients: ComplexArray,
    sums: ComplexArray,
    phases: FloatArray,
    bound: FloatArray,
    lower: float,
    upper: float,
    start: float,
    sign_lower: int,
) -> tuple[float, complex, complex]:
    """Zero of the imaginary part in a bracket, by Newton steps kept inside it.

    Returns the zero, and value and slope there.
    """
    omega = start
    value, slope = 0j, 0j
    for _ in range(80):
        value, slope = _evaluate(coefficients, sums, phases, omega)
        if (value.imag > 0.0) == (sign_lower > 0):
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
        left = 0.5 * _real_horner(bound, upper) * move * move
        if left <= 2.0 * EPSILON * upper * abs(slope.imag):
            value += slope * move
            break
    return omega, value, slope


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
def sign_changes(
    coefficients: ComplexArray,
    phases: FloatArray,
    sums: ComplexArray,
    omega_end: float,
    is_map: bool,
    rounding: float = ROUNDING,
) -> tuple[FloatArray, IntArray, FloatArray, FloatArray, FloatArray, bool]:
    """Zeros in [0, omega_end] of the imaginary part of an exponential sum.

    Where the imaginary part is odd in omega, as it is for a row of a chart, omega = 0 is one
    of them. Returns five arrays, an entry a zero, and whether they are all (they are not if
    there are more than MOST_ZEROS, or the walk would take more than MOST_STEPS steps):

    - `omega`, polished;
    - `jump`, twice the direction of the sign change (a conjugate pair crosses); once at
      omega = 0 and, for a map, at `omega_end` (a real root crosses); 0 where rounding hides
      whether there is one;
    - `width`, how far rounding lets the zero move: for a zero that is not simple, half the
      stretch in which the sign is doubtful;
    - `value` and `slope`, the real part there and the magnitude of its slope.
    """
    groups, size = coefficients.shape
    noise = np.zeros(size + 1)
    for k in range(size):
        noise[k] += abs(sums[k].imag) * (rounding * EPSILON)
        for g in range(groups):
            noise[k + 1] += abs(coefficients[g, k] * phases[g]) * (rounding * EPSILON)
    bound = _curvature_bound(coefficients, sums, phases)

    zeros = np.empty((64, 4))
    jumps = np.empty(64, dtype=np.int64)
    found = 0

    omega = 0.0
    value, slope = _evaluate(coefficients, sums, phases, 0.0)
    at_zero = value.real
    h, dh = value.imag, slope.imag
    sign = 0
    if abs(h) > noise[0]:
        sign = 1 if h > 0.0 else -1
    elif abs(dh) > noise[1]:
        sign = 1 if dh > 0.0 else -1
        zeros[0, 0], zeros[0, 1], zeros[0, 2], zeros[0, 3] = 0.0, 0.0, at_zero, abs(slope)
        jumps[0] = sign
        found = 1
    doubtful = sign == 0
    last_clear = 0.0
    step = omega_end
    steps = 0
    while omega < omega_end:
        steps += 1
        if steps > MOST_STEPS or found > MOST_ZEROS:
            break
        step = min(2.0 * step, omega_end - omega)
        curvature = _real_horner(bound, omega + step)
        if curvature > 0.0:
            # Monotonic over the first, of one sign over the second: one zero at most.
            certified = abs(dh) / curvature
            error = _real_horner(noise, omega)
            if abs(h) > error:
                toward = dh if h > 0.0 else -dh
                root = np.sqrt(dh * dh + 2.0 * curvature * abs(h))
                certified = max(certified, (toward + root) / curvature)
            certified *= SAFETY
            if doubtful:
                # Nothing can be resolved here; leave the stretch, in proportion to it.
                unresolved = 0.5 * np.sqrt(2.0 * error / curvature)
                stretch = 0.25 * (omega - last_clear)
                certified = max(certified, unresolved, stretch, 1e-14 * omega_end)
            step = min(step, certified)
        following = omega_end if step >= omega_end - omega else omega + step
        old_h, old_dh = h, dh
        value, slope = _evaluate(coefficients, sums, phases, following)
        h, dh = value.imag, slope.imag
        if abs(h) > _real_horner(noise, following):
            now = 1 if h > 0.0 else -1
            if now != sign or doubtful:
                if found == jumps.size:
                    zeros = np.concatenate((zeros, np.empty_like(zeros)))
                    jumps = np.concatenate((jumps, np.empty_like(jumps)))
                middle = 0.5 * (last_clear + following)
                width = 0.5 * (following - last_clear)
                if sign == 0:
                    jumps[found] = now
                    middle, width = 0.0, following
                    there, rate = complex(at_zero), slope
                elif now != sign:
                    jumps[found] = 2 * now
                    if not doubtful:
                        middle = omega + _cubic_zero(following - omega, old_h, old_dh, h, dh)
                    middle, there, rate = _polish(
                        coefficients, sums, phases, bound, last_clear, following, middle, sign
                    )
                    error = _real_horner(noise, middle)
                    if abs(rate.imag) * width > error:
                        width = error / abs(rate.imag)
                else:
                    jumps[found] = 0
                    there, rate = _evaluate(coefficients, sums, phases, middle)
                zeros[found, 0], zeros[found, 1] = middle, width
                zeros[found, 2], zeros[found, 3] = there.real, abs(rate)
                found += 1
            sign = now
            last_clear = following
            doubtful = False
        else:
            doubtful = True
        omega = following
    if is_map and sign != 0:
        if found == jumps.size:
            zeros = np.concatenate((zeros, np.empty_like(zeros)))
            jumps = np.concatenate((jumps, np.empty_like(jumps)))
        zeros[found, 0], zeros[found, 1] = omega_end, 0.0
        zeros[found, 2], zeros[found, 3] = value.real, abs(slope)
        jumps[found] = -sign
        found += 1
    zeros = zeros[:found]
    complete = omega >= omega_end
    return zeros[:, 0], jumps[:found], zeros[:, 1], zeros[:, 2], zeros[:, 3], complete


@njit(cache=True)
def _squared(
    norm: FloatArray, omega: float, omega_end: float, is_map: bool
) -> tuple[float, float]:
    """Value and slope of |M|^2, given as a polynomial or, for a map, a cosine series."""
    value, slope = 0.0, 0.0
    if is_map:
        for k in range(norm.size):
            rate = k * np.pi / omega_end
            value += norm[k] * np.cos(rate * omega)
            slope -= norm[k] * rate * np.sin(rate * omega)
    else:
        for k in range(norm.size - 1, -1, -1):
            slope = slope * omega + value
            value = value * omega + norm[k]
    return value, slope


@njit(cache=True)
def _fill_row(
    filled: tuple[Any, ...], model: tuple[Any, ...], rows: tuple[Any, ...], i: int
) -> None:
    """Fill row i of a chart, see `fill_rows`."""
    counts, doubtful, last = filled
    ends, y, deviation, base, x, lower, upper = rows
    fixed, varying, fixed_sums, varying_sums, phases, norm, is_map = model
    fastest = np.abs(phases).max()
    coefficients = fixed - y[i] * varying
    magnitude = np.zeros(coefficients.shape[1])
    for g in range(phases.size):
        magnitude += np.abs(coefficients[g])
    omegas, jumps, widths, values, slopes, complete = sign_changes(
        coefficients,
        phases,
        fixed_sums - deviation[i] * varying_sums,
        ends[i],
        is_map,
        CAUTION,
    )
    change = np.zeros(x.size + 1, dtype=np.int64)
    total = base[i]
    trusted = complete and base[i] >= 0
    for k in range(omegas.size):
        omega = omegas[k]
        square, change_of_square = _squared(norm, omega, ends[i], is_map)
        if square <= 0.0:
            continue
        position = values[k] / square
        steepness = (slopes[k] + abs(position) * abs(change_of_square)) / square
        rounding = CAUTION * EPSILON * (1.0 + fastest * omega) / square
        spread = 4.0 * steepness * widths[k] + rounding * _real_horner(magnitude, omega)
        if abs(position - lower[i]) <= spread or abs(position - upper[i]) <= spread:
            trusted = False
        if lower[i] < position < upper[i]:
            total += jumps[k]
            change[np.searchsorted(x, position)] += jumps[k]
        if position + spread >= x[0] and position - spread <= x[-1]:
            near = np.searchsorted(x, position - spread)
            while near < x.size and x[near] <= position + spread:
                doubtful[i, near] = True
                near += 1
    running = base[i]
    for k in range(x.size):
        running += change[k]
        counts[i, k] = running
    last[i] = total if trusted else BOUNDARY


@njit(cache=True, parallel=True)
def _fill_on_all_cores(
    filled: tuple[Any, ...], model: tuple[Any, ...], rows: tuple[Any, ...]
) -> None:
    for i in prange(rows[0].size):
        _fill_row(filled, model, rows, i)


@njit(cache=True)
def _fill_on_one_core(
    filled: tuple[Any, ...], model: tuple[Any, ...], rows: tuple[Any, ...]
) -> None:
    for i in range(rows[0].size):
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

    A row is x = N / M. The model holds, in this order: `fixed` and `varying`, with
    N conj(M) = `fixed` - y `varying`; their sums over the groups, to be weighted by the
    deviation of y from the reference; the phase rates; |M|^2 as real coefficients, of powers
    of omega, or, for a map, of cosines of multiples of pi omega / omega_end; and whether it
    is a map. Row i starts with the count base[i] at x = lower[i]. Returns the counts, which
    of them lie too near a crossing to be trusted, and the count at x = upper[i] (-1 where a
    crossing lies too near one of the two ends, or there are more than can be found).
    """
    counts = np.empty((y.size, x.size), dtype=np.int64)
    doubtful = np.zeros((y.size, x.size), dtype=np.bool_)
    last = np.empty(y.size, dtype=np.int64)
    fill = _fill_on_one_core if _forked else _fill_on_all_cores
    fill((counts, doubtful, last), model, (ends, y, deviation, base, x, lower, upper))
    return counts, doubtful, last


@njit(cache=True)
def resolved_grid(
    coefficients: ComplexArray,
    phases: FloatArray,
    sums: ComplexArray,
    omega_end: float,
    tolerance: float,
) -> FloatArray:
    """Frequencies from 0 to `omega_end` between which the sum is nearly straight.

    Over each step it stays within `tolerance` times the tangent's distance from zero of its
    tangent, or the step is as small as rounding allows. The grid ends before `omega_end` if
    it would take more than MOST_SAMPLES.
    """
    bound = _curvature_bound(coefficients, sums, phases)
    grid = np.empty(1024)
    found = 1
    omega = 0.0
    grid[0] = omega
    step = omega_end
    while omega < omega_end and found < MOST_SAMPLES:
        value, slope = _evaluate(coefficients, sums, phases, omega)
        step = min(2.0 * step, omega_end - omega)
        smallest = max(1e-13 * omega, 1e-16 * omega_end)
        while True:
            nearest = _tangent_distance(value, slope, step)
            left = 0.5 * _real_horner(bound, omega + step) * step * step
            if left <= tolerance * nearest or step <= smallest:
                break
            step *= 0.5
        omega = omega_end if step >= omega_end - omega else omega + step
        if found == grid.size:
            grid = np.concatenate((grid, np.empty_like(grid)))
        grid[found] = omega
        found += 1
    return grid[:found]
