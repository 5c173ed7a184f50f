"""Compiled walks along the boundary of stability, s = j omega.

The walks take steps that are certified, not chosen. With a bound M on the second derivative
over a step, a function stays within M step^2 / 2 of its tangent. So

- `winding` never steps past the origin on the wrong side, and the argument it adds up is
  exact up to rounding;
- `imaginary_zeros` never steps over two zeros at once, so that none is missed.

Where the sum is no larger than the bound on its rounding error, `winding` stops: that makes a
point a boundary point. Where only its imaginary part is no larger, `imaginary_zeros` gives a
zero with a jump of 0. The tolerance in the bound is `armlock.axis.exponentials.ROUNDING`.

All functions here work on exponential sums, piece by piece, see `armlock.axis.exponentials`.
"""

from __future__ import annotations

import numpy as np

from armlock.axis.compiled import njit
from armlock.axis.exponentials import (
    EPSILON,
    ROUNDING,
    CompiledSum,
    Piece,
    bound_at,
    curvature_bound,
    curvature_from_zero,
    evaluate,
    expand,
    rounding_bound,
    tangent_distance,
)
from armlock.checks import ComplexArray, FloatArray

# ROUNDING along a chart's row. It is larger, so that a point that may be a boundary point is
# doubtful there, and counted on its own.
CAUTION = 8.0 * ROUNDING
# Share of a certified bound that a step may use up.
SAFETY = 0.95

# Turns of the longest delay after which `winding` tries again to follow the slow terms alone.
_BLOCK = 32.0
# Most steps of one walk: some three seconds. A turn of the longest delay takes about ten, but
# where slow terms are followed alone.
MOST_STEPS = 10_000_000
# A walk over which the fastest exponential turns by more radians than this is not begun.
MOST_RADIANS = 20.0 * MOST_STEPS
# Most samples of a grid.
MOST_SAMPLES = 10_000_000


@njit(cache=True)
def _follow(
    piece: Piece,
    bound: FloatArray,
    error: FloatArray,
    omega: float,
    end: float,
    step: float,
    shortest: float,
) -> tuple[float, float, float, int]:
    """Argument gathered by an exponential sum from omega to `end`, within one piece.

    `bound` and `error` are polynomials in u that bound the second derivative and how far the
    values may be off. Returns the argument, the frequency up to which it is certain, the last
    step, and the number of steps. It is not certain up to `end` where that takes a step below
    `shortest`, or where the sum is within its error.
    """
    argument, steps = 0.0, 0
    value, slope = evaluate(piece, omega)
    if abs(value) <= bound_at(error, piece, omega):
        return argument, omega, step, steps
    while omega < end and steps <= MOST_STEPS:
        steps += 1
        step = min(4.0 * step, end - omega)
        while True:
            distance = tangent_distance(value, slope, step)
            # Rounding moves the tangent, too: closer to the origin nothing is certain.
            apart = 0.5 * bound_at(bound, piece, omega + step) * step * step
            if apart + bound_at(error, piece, omega + step) <= SAFETY * distance:
                break
            step *= 0.5
            if step <= max(shortest, 4.0 * EPSILON * omega) or step < 1e-300:
                return argument, omega, step, steps
        following = end if step == end - omega else omega + step
        next_value, next_slope = evaluate(piece, following)
        if abs(next_value) <= bound_at(error, piece, following):
            return argument, omega, step, steps
        # Along the tangent, then from its end to the curve: both parts are principal.
        tangent = value + step * slope
        argument += angle_between(tangent, value) + angle_between(next_value, tangent)
        omega, value, slope = following, next_value, next_slope
    return argument, omega, step, steps


@njit(cache=True)
def angle_between(value: complex, other: complex) -> float:
    """Principal argument of value / other."""
    ratio = value * other.conjugate()
    return float(np.arctan2(ratio.imag, ratio.real))


@njit(cache=True)
def _slow_terms(piece: Piece) -> tuple[Piece, FloatArray]:
    """Split the terms that turn fast off an exponential sum, within one piece.

    Fast are exponentials of at least a tenth of the longest delay. Returns what is left, and a
    polynomial in u that bounds what the fast terms add up to.
    """
    fastest = np.abs(piece.phases).max()
    slow, magnitudes, rates = piece.local.copy(), piece.sizes.copy(), piece.phases.copy()
    fast = np.zeros(slow.shape[1])
    for g in range(rates.size):
        if abs(rates[g]) >= 0.1 * fastest:
            slow[0] -= slow[g + 1]
            magnitudes[0] += magnitudes[g + 1]
            fast += np.abs(slow[g + 1])
            slow[g + 1], magnitudes[g + 1], rates[g] = 0.0, 0.0, 0.0
    return Piece(piece.start, piece.end, piece.per_reach, slow, magnitudes, rates), fast


@njit(cache=True)
def winding(
    whole: CompiledSum, uncertain: FloatArray, omega: float, omega_end: float
) -> tuple[float, complex, bool]:
    """Argument gathered by an exponential sum from omega to `omega_end`.

    Where the terms that turn slowly exceed the others together, the sum's argument stays within
    a quarter of a turn of theirs, and only theirs is followed: in long steps, however fast the
    others turn.

    `uncertain` holds how far the entries of `sums` may be off. Returns the argument, the last
    value up to a positive factor, and whether the sum stays clear of zero. The argument is nan
    where the walk would take more than MOST_STEPS steps.
    """
    phases = whole.phases
    steps, argument, step = 0, 0.0, omega_end
    value = 0j
    block = np.inf
    if phases.size and phases.any():
        block = _BLOCK * 2.0 * np.pi / np.abs(phases).max()
    while True:
        piece = expand(whole, omega, uncertain)
        end = min(piece.end, omega_end)
        bound, error = curvature_bound(piece), rounding_bound(piece, ROUNDING)
        value = evaluate(piece, omega)[0]
        if abs(value) <= bound_at(error, piece, omega):
            return argument, value, False
        many = end - omega > 2.0 * block
        if many:
            slow, fast = _slow_terms(piece)
            slow_bound, slow_error = curvature_bound(slow), rounding_bound(slow, ROUNDING)
            for k in range(fast.size):
                slow_error[k] += fast[k]
        while omega < end:
            if many and end - omega > block:
                turned, following, _, more = _follow(
                    slow, slow_bound, slow_error, omega, end, end - omega, block
                )
                steps += more + 1
                if following > omega:
                    argument -= angle_between(value, evaluate(slow, omega)[0])
                    value = evaluate(piece, following)[0]
                    argument += turned + angle_between(value, evaluate(slow, following)[0])
                    omega = following
            until = min(end, omega + block)
            turned, following, step, more = _follow(
                piece, bound, error, omega, until, step, 0.0
            )
            steps += more
            if steps > MOST_STEPS:
                return np.nan, value, True
            value = evaluate(piece, following)[0]
            argument += turned
            if following < until:
                return argument, value, False
            omega = following
        if omega >= omega_end:
            return argument, value, True


@njit(cache=True)
def argument_at(roots: ComplexArray, omega: float) -> float:
    """Argument at j omega of the polynomial with these roots, up to the sign of its lead.

    No root may lie on the axis. As omega grows, each root's share tends to half pi.
    """
    argument = 0.0
    for root in roots:
        angle = np.arctan2(omega - root.imag, -root.real)
        if root.real > 0.0 and angle < 0.0:
            angle += 2.0 * np.pi
        argument += angle
    return argument


@njit(cache=True)
def _polish(
    piece: Piece, bound: FloatArray, bracket: tuple[float, float], guess: float, sign: int
) -> tuple[float, complex, complex]:
    """Zero of the imaginary part in a bracket, by Newton steps kept inside it.

    `sign` is that of the imaginary part at the lower end. Returns the zero, and value and slope
    of the sum there.
    """
    lower, upper = bracket
    omega = guess
    value, slope = 0j, 0j
    for _ in range(80):
        value, slope = evaluate(piece, omega)
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
        left = 0.5 * bound_at(bound, piece, upper) * move * move
        if left <= 2.0 * EPSILON * upper * abs(slope.imag):
            value += slope * move
            break
    return omega, value, slope


@njit(cache=True)
def _zero_between(
    low: float, high: float, h: tuple[float, float], dh: tuple[float, float]
) -> float:
    """Estimate a zero from values and slopes at both ends: the cubic omega(h), at h = 0."""
    (h0, h1), (dh0, dh1) = h, dh
    t = h0 / (h0 - h1)
    if dh0 != 0.0 and dh1 != 0.0:
        omega = low * (1.0 + 2.0 * t) * (1.0 - t) ** 2 + high * t * t * (3.0 - 2.0 * t)
        omega += (h1 - h0) * t * (1.0 - t) * ((1.0 - t) / dh0 - t / dh1)
        if low < omega < high:
            return omega
    return low + (high - low) * t


@njit(cache=True)
def _safe_step(h: float, dh: float, curvature: float, error: float) -> float:
    """Step over which a real function has one zero at most.

    Over |dh| / curvature it is monotonic. It keeps its sign up to the zero of
    |h| + toward t - curvature t^2 / 2.
    """
    certified = abs(dh) / curvature
    if abs(h) > error:
        toward = dh if h > 0.0 else -dh
        root = np.sqrt(dh * dh + 2.0 * curvature * abs(h))
        certified = max(certified, (toward + root) / curvature)
    return SAFETY * certified


# Columns of what `imaginary_zeros` returns.
OMEGA, JUMP, WIDTH, POSITION, SPREAD = 0, 1, 2, 3, 4


@njit(cache=True)
def _with_zero(
    zeros: FloatArray,
    found: int,
    omega: float,
    jump: int,
    width: float,
    value: complex,
    slope: complex,
) -> FloatArray:
    """Return `zeros` with one more in row `found`, a longer array if it is full.

    The value of the sum and its slope take the place of position and spread.
    """
    if found == zeros.shape[0]:
        zeros = np.concatenate((zeros, np.empty_like(zeros)))
    zeros[found, OMEGA], zeros[found, JUMP], zeros[found, WIDTH] = omega, jump, width
    zeros[found, POSITION], zeros[found, SPREAD] = value.real, abs(slope)
    return zeros


@njit(cache=True)
def _place(zeros: FloatArray, piece: Piece, square: Piece) -> None:
    """Turn value and slope of zeros in one piece into POSITION and SPREAD.

    `square` is the measure, expanded from the same polynomials at the same start: it has the
    same powers and the same scale.
    """
    fastest, magnitude = np.abs(piece.phases).max(), piece.sizes[1:].sum(axis=0)
    for zero in zeros:
        omega = max(zero[OMEGA], piece.start)
        measured, change = evaluate(square, omega)
        part, slope = zero[POSITION], zero[SPREAD]
        zero[POSITION], zero[SPREAD] = np.nan, 0.0
        if measured.real > 0.0:
            position = part / measured.real
            steepness = (slope + abs(position) * abs(change.real)) / measured.real
            rounding = CAUTION * EPSILON * (1.0 + fastest * omega) / measured.real
            rounding *= bound_at(magnitude, piece, omega)
            zero[POSITION], zero[SPREAD] = position, 4.0 * steepness * zero[WIDTH] + rounding


@njit(cache=True)
def _imaginary_bounds(
    piece: Piece, rounding: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds on the imaginary part in a piece, as polynomials in u.

    On its second derivative, next to omega = 0 and everywhere; and on its rounding error.
    """
    start, end, per_reach, local, sizes, phases = piece
    local, sizes = local.copy(), sizes.copy()
    for m in range(local.shape[1]):
        if end == np.inf and local[0, m].imag == 0.0:
            # In powers of omega the coefficients are real or imaginary.
            sizes[0, m] = 0.0
        local[0, m] = local[0, m].imag
    imaginary = Piece(start, end, per_reach, local, sizes, phases)
    everywhere = curvature_bound(imaginary)
    near = curvature_from_zero(piece) if start == 0.0 else everywhere
    return near, everywhere, rounding_bound(imaginary, rounding)


@njit(cache=True)
def imaginary_zeros(
    whole: CompiledSum,
    measure: CompiledSum | None,
    omega_start: float,
    omega_end: float,
    is_map: bool,
    rounding: float,
) -> tuple[FloatArray, bool]:
    """Zeros in [omega_start, omega_end] of the imaginary part of an exponential sum.

    For a row x = N / M of a chart the sum is N conj(M), and `measure` is |M|^2. Where the
    imaginary part is odd in omega, as it is there, omega = 0 is one of the zeros. Of a map
    `omega_end` is pi / step. Returns a row for each zero, and whether these are all (they are
    not if the walk would take more than MOST_STEPS steps). Its columns:

    - OMEGA, polished;
    - JUMP, 2 or -2, the direction of the sign change, where a conjugate pair crosses; 1 or -1
      where a real root does: at omega = 0, and at the `omega_end` of a map; 0 where rounding
      hides whether there is a sign change, or the sign at another end of the walk;
    - WIDTH, how far rounding lets the zero move: for a zero that is not simple, half the
      stretch in which the sign is doubtful, and all of it at `omega_start` and `omega_end`;
    - POSITION, the real part over the measure, nan where that vanishes;
    - SPREAD, how far rounding lets the position move.

    Without a measure the last two are the real part and the size of the slope.
    """
    phases = whole.phases
    zeros, found = np.empty((64, 5)), 0
    fastest = np.abs(phases).max() if phases.size else 0.0
    if (omega_end - omega_start) * fastest > MOST_RADIANS:
        return zeros[:0], False
    omega, last_clear, step = omega_start, omega_start, omega_end
    steps, sign, doubtful = 0, 0, True
    crawled, patience, caution = 0, 1000, 1.0
    while omega < omega_end and steps <= MOST_STEPS:
        piece, first = expand(whole, omega), found
        start, end = piece.start, min(piece.end, omega_end)
        near, everywhere, error = _imaginary_bounds(piece, rounding)
        value, slope = evaluate(piece, omega)
        if omega == omega_start:
            if abs(value.imag) > bound_at(error, piece, omega):
                sign, doubtful = (1 if value.imag > 0.0 else -1), False
            elif omega == 0.0 and abs(slope.imag) > error[1] * piece.per_reach:
                sign, doubtful = (1 if slope.imag > 0.0 else -1), False
                zeros = _with_zero(zeros, found, 0.0, sign, 0.0, value, slope)
                found += 1
        while omega < end and steps <= MOST_STEPS:
            steps += 1
            step = min(2.0 * step, end - omega)
            bound = near if fastest * (omega + step) < 1.0 else everywhere
            curvature = bound_at(bound, piece, omega + step)
            if curvature > 0.0:
                uncertain = bound_at(error, piece, omega)
                certified = _safe_step(value.imag, slope.imag, curvature, uncertain)
                if doubtful:
                    # Nothing can be resolved here; leave the stretch, in proportion to it.
                    unresolved = 0.5 * np.sqrt(2.0 * uncertain / curvature)
                    stretch = 0.25 * (omega - last_clear)
                    certified = max(certified, unresolved, stretch, 1e-14 * omega_end)
                step = min(step, certified)
                # Where terms cancel nearly to rounding, steps may become tiny. Then the error
                # is taken for larger, until the sign is clear again.
                short = step < 1e-6 * omega and fastest * step < 1e-6
                crawled = crawled + 1 if short and not doubtful else 0
                if crawled > patience:
                    caution, patience = 1e3, 50
            following = end if step >= end - omega else omega + step
            old_value, old_slope = value, slope
            value, slope = evaluate(piece, following)
            doubt = caution * bound_at(error, piece, following)
            if abs(value.imag) <= doubt:
                omega, doubtful = following, True
                continue
            now, caution = 1 if value.imag > 0.0 else -1, 1.0
            if now != sign or doubtful:
                jump, width = now - sign, 0.5 * (following - last_clear)
                at = last_clear + width
                if sign != 0 and now != sign and last_clear >= start:
                    if not doubtful:
                        h, dh = (old_value.imag, value.imag), (old_slope.imag, slope.imag)
                        at = _zero_between(omega, following, h, dh)
                    at, there, rate = _polish(piece, bound, (last_clear, following), at, sign)
                    uncertain = bound_at(error, piece, at)
                    if abs(rate.imag) * width > uncertain:
                        width = uncertain / abs(rate.imag)
                else:
                    there, rate = evaluate(piece, max(at, start))
                    if sign == 0:
                        # At the start itself the sign was hidden.
                        at, width = omega_start, 2.0 * width
                        there = evaluate(piece, max(at, start))[0]
                        jump = now if omega_start == 0.0 else 0
                zeros = _with_zero(zeros, found, at, jump, width, there, rate)
                found += 1
            omega, last_clear, sign, doubtful = following, following, now, False
        if omega >= omega_end and (is_map or doubtful):
            jump, width = (-sign if is_map else 0), omega_end - last_clear if doubtful else 0.0
            zeros = _with_zero(zeros, found, omega_end, jump, width, value, slope)
            found += 1
        if found > first and measure is not None:
            _place(zeros[first:found], piece, expand(measure, start))
    return zeros[:found], omega >= omega_end


@njit(cache=True)
def resolved_grid(
    whole: CompiledSum, omega_end: float, tolerance: float, most: int
) -> FloatArray:
    """Frequencies from 0 to `omega_end` between which an exponential sum changes little.

    Over each step its tangent moves by no more than twice `tolerance` times its distance from
    zero, and the sum leaves the tangent by no more than once that, or the step is as small as
    rounding allows. The grid ends before `omega_end` if it would take more than `most`.
    """
    grid, found, omega, step = np.empty(1024), 1, 0.0, omega_end
    grid[0] = omega
    while omega < omega_end and found < most:
        piece = expand(whole, omega)
        end, bound = min(piece.end, omega_end), curvature_bound(piece)
        while omega < end and found < most:
            value, slope = evaluate(piece, omega)
            step = min(2.0 * step, end - omega)
            smallest = max(1e-13 * omega, 1e-16 * omega_end)
            while True:
                nearest = tangent_distance(value, slope, step)
                left = 0.5 * bound_at(bound, piece, omega + step) * step * step
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
