"""Compiled walks along the boundary of stability, s = j omega.

The walks take steps that are certified, not chosen. With a bound M on the second derivative
over a step, a function stays within M step^2 / 2 of its tangent. So

- `winding` never steps past the origin on the wrong side, and the argument it adds up is
  exact up to rounding;
- `imaginary_zeros` never steps over two zeros at once, so that none is missed.

Where the sum is no larger than the bound on its rounding error, `winding` stops: that makes a
point a boundary point. Where only its imaginary part is no larger, `imaginary_zeros` cannot
tell its sign over a stretch of the axis. The tolerance in the bound is
`armlock.axis.rounding.ROUNDING`.

A *hidden stretch* is one in which nothing proves that the imaginary part has one zero, or none:
it may hold any number of them, whatever the signs at its two ends are. Nobody may take it for a
zero. Who asks, and what each does with it:

- rows of charts (`armlock.axis.counting`) count points one by one whose parameter it may cross;
- phase and delay margins (`armlock.robustness.phase_and_delay`) refuse where L in it would have
  a smaller margin than the best one;
- crossings of the negative real axis (`armlock.stability.nyquist`) refuse where L in it may be
  below -1e-3, and pass over it where L may be closer to zero;
- D-curves (`armlock.stability.dcurve`) are cut at its middle: their points do not depend on it.

A count that cannot be told (-1) confirms nothing: who asks for one looks beside it, up to a
thousandth away (`armlock.stability.zeros.count_beside`), and refuses where that does not help.

All functions here work on exponential sums, piece by piece, see `armlock.axis.exponentials`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armlock.axis.compiled import njit
from armlock.axis.exponentials import (
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
from armlock.axis.rounding import CAUTION, EPSILON, ROUNDING
from armlock.axis.threads import MOST_STEPS
from armlock.checks import BoolArray, ComplexArray, FloatArray

# Share of a certified bound that a step may use up.
_SAFETY = 0.95

# Turns of the longest delay after which `winding` tries again to follow the slow terms alone.
_BLOCK = 32.0
# A walk over which the fastest exponential turns by more radians than this is not begun.
MOST_RADIANS = 20.0 * MOST_STEPS
# Most samples of a grid.
MOST_SAMPLES = 10_000_000

# A zero walk crawls where steps are shorter than this share of omega, and of a radian of the
# fastest exponential: a zero at a place of its own takes far less than a thousand such steps.
# After so many the error is taken for larger, so that the next steps are longer by the root of
# that factor. Where that happened once, it is not waited for so long again.
_SHORT, _PATIENCE, _LESS_PATIENCE, _MORE_CAUTION = 1e-6, 1000, 50, 1e3
# In a stretch without a sign steps grow in proportion to it, and are no shorter than this share
# of the whole axis.
_BLIND_GROWTH, _SHORTEST_BLIND = 0.25, 1e-14


@njit()
def _follow(
    piece: Piece,
    bound: FloatArray,
    error: FloatArray,
    omega: float,
    end: float,
    step: float,
    shortest: float,
    most: int,
) -> tuple[float, float, float, int]:
    """Argument gathered by an exponential sum from omega to `end`, within one piece.

    `bound` and `error` are polynomials in u that bound the second derivative and how far the
    values may be off. Returns the argument, the frequency up to which it is certain, the last
    step, and the number of steps. It is not certain up to `end` where that takes a step below
    `shortest` or more than `most` steps, or where the sum is within its error.
    """
    argument, steps = 0.0, 0
    value, slope = evaluate(piece, omega)
    if abs(value) <= bound_at(error, piece, omega):
        return argument, omega, step, steps
    while omega < end and steps <= most:
        steps += 1
        step = min(4.0 * step, end - omega)
        while True:
            distance = tangent_distance(value, slope, step)
            # Rounding moves the tangent, too: closer to the origin nothing is certain.
            departure = 0.5 * bound_at(bound, piece, omega + step) * step * step
            if departure + bound_at(error, piece, omega + step) <= _SAFETY * distance:
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


@njit()
def angle_between(value: complex, other: complex) -> float:
    """Principal argument of value / other."""
    ratio = value * other.conjugate()
    return float(np.arctan2(ratio.imag, ratio.real))


@njit()
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
    start, end, per_reach, _, _, _, direct = piece
    return Piece(start, end, per_reach, slow, magnitudes, rates, direct), fast


@njit(nogil=True)
def winding(
    whole: CompiledSum,
    omega: float,
    omega_end: float,
    most: int,
    stop: BoolArray,
) -> tuple[float, complex, bool, int, bool]:
    """Argument gathered by an exponential sum from omega to `omega_end`.

    Where the terms that turn slowly exceed the others together, the sum's argument stays within
    a quarter of a turn of theirs, and only theirs is followed: in long steps, however fast the
    others turn.

    Returns the argument, the last value up to a positive factor, whether the sum stays clear of
    zero, the number of steps, and whether that is told: not where there would be more than
    `most` steps, or `stop` is set.
    """
    phases = whole.phases
    steps, argument, step = 0, 0.0, omega_end
    value = 0j
    block = np.inf
    if phases.size and phases.any():
        block = _BLOCK * 2.0 * np.pi / np.abs(phases).max()
    while True:
        piece = expand(whole, omega)
        end = min(piece.end, omega_end)
        bound, error = curvature_bound(piece), rounding_bound(piece, ROUNDING)
        value = evaluate(piece, omega)[0]
        if abs(value) <= bound_at(error, piece, omega):
            return argument, value, False, steps, True
        many = end - omega > 2.0 * block
        if many:
            slow, fast = _slow_terms(piece)
            slow_bound, slow_error = curvature_bound(slow), rounding_bound(slow, ROUNDING)
            for k in range(fast.size):
                slow_error[k] += fast[k]
        while omega < end:
            if many and end - omega > block:
                gained, following, _, more = _follow(
                    slow, slow_bound, slow_error, omega, end, end - omega, block, most
                )
                steps += more + 1
                if following > omega:
                    argument -= angle_between(value, evaluate(slow, omega)[0])
                    value = evaluate(piece, following)[0]
                    argument += gained + angle_between(value, evaluate(slow, following)[0])
                    omega = following
            until = min(end, omega + block)
            gained, following, step, more = _follow(
                piece, bound, error, omega, until, step, 0.0, most
            )
            steps += more
            if steps > most or stop[0]:
                return argument, value, False, steps, False
            value = evaluate(piece, following)[0]
            argument += gained
            if following < until:
                return argument, value, False, steps, True
            omega = following
        if omega >= omega_end:
            return argument, value, True, steps, True


@njit()
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


@njit()
def _polish(
    piece: Piece, bound: FloatArray, bracket: tuple[float, float], guess: float, sign: int
) -> tuple[float, tuple[complex, complex]]:
    """Zero of the imaginary part in a bracket, by Newton steps kept inside it.

    `sign` is that of the imaginary part at the lower end. Returns the zero, and value and slope
    of the sum there.
    """
    lower, upper = bracket
    omega, value, slope = guess, 0j, 0j
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
        departure = 0.5 * bound_at(bound, piece, upper) * move * move
        if departure <= 2.0 * EPSILON * upper * abs(slope.imag):
            value += slope * move
            break
    return omega, (value, slope)


@njit()
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


@njit()
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
    return _SAFETY * certified


# Columns of what `imaginary_zeros` returns.
OMEGA, JUMP, WIDTH, HIDDEN, POSITION, SPREAD = 0, 1, 2, 3, 4, 5


@njit()
def _with_zero(
    zeros: FloatArray,
    found: int,
    row: tuple[float, int, float, bool],
    at: tuple[complex, complex],
) -> FloatArray:
    """Return `zeros` with one more in row `found`, a longer array if it is full.

    Of the row these are OMEGA, JUMP, WIDTH and HIDDEN. The value of the sum and its slope take
    the place of position and spread.
    """
    if found == zeros.shape[0]:
        zeros = np.concatenate((zeros, np.empty_like(zeros)))
    zeros[found, OMEGA], zeros[found, JUMP], zeros[found, WIDTH], zeros[found, HIDDEN] = row
    zeros[found, POSITION], zeros[found, SPREAD] = at[0].real, abs(at[1])
    return zeros


@njit()
def _place(zeros: FloatArray, piece: Piece, square: Piece, entered: float) -> None:
    """Turn value and slope of zeros in one piece, from `entered` on, into POSITION and SPREAD.

    `square` is the measure, expanded from the same polynomials at the same start: it has the
    same powers and the same scale. Over its width each of the two leaves its tangent by no more
    than its bound on the second derivative allows.
    """
    fastest = np.abs(piece.phases).max()
    magnitude, square_magnitude = piece.sizes.sum(axis=0), square.sizes.sum(axis=0)
    bound, square_bound = curvature_bound(piece), curvature_bound(square)
    for zero in zeros:
        width, part, slope = zero[WIDTH], zero[POSITION], zero[SPREAD]
        zero[POSITION], zero[SPREAD] = np.nan, 0.0
        omega = max(zero[OMEGA], entered)
        measured, change = evaluate(square, omega)
        if not measured.real > 0.0:
            continue
        position, last = part / measured.real, omega + width
        moved = slope * width + 0.5 * bound_at(bound, piece, last) * width * width
        shrunk = abs(change.real) * width
        shrunk += 0.5 * bound_at(square_bound, square, last) * width * width
        # Whole magnitudes, because the parameters in the weights are rounded numbers, too.
        share = CAUTION * EPSILON * (1.0 + fastest * omega)
        rounding = share * bound_at(magnitude, piece, last)
        shrunk += share * bound_at(square_magnitude, square, last)
        least = measured.real - shrunk
        zero[POSITION], zero[SPREAD] = position, np.inf
        if least > 0.0 and omega == zero[OMEGA]:
            zero[SPREAD] = (moved + abs(position) * shrunk + rounding) / least


@njit()
def _is_monotonic(
    piece: Piece, bound: FloatArray, error: FloatArray, omega: float, width: float
) -> bool:
    """Whether the imaginary part ascends, or descends, throughout omega +- width.

    Its slope is bounded by that at omega and the curvature. Rounding moves a slope by no more
    than the bound on the value's changes, and by what the phases turn that: doubled, because
    these two are of the same size.
    """
    slope = evaluate(piece, omega)[1]
    last = omega + width
    rate, turn = 0.0, (last - piece.start) * piece.per_reach
    for k in range(error.size - 1, 0, -1):
        rate = rate * turn + k * error[k]
    fastest = np.abs(piece.phases).max() if piece.phases.size else 0.0
    rounding = 2.0 * (rate * piece.per_reach + fastest * bound_at(error, piece, last))
    return bool(abs(slope.imag) > bound_at(bound, piece, last) * width + rounding)


@njit()
def _imaginary_bounds(
    piece: Piece, rounding: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds on the imaginary part in a piece, as polynomials in u.

    On its second derivative, next to omega = 0 and everywhere; and on its rounding error.
    """
    start, end, per_reach, local, sizes, phases, direct = piece
    local, sizes = local.copy(), sizes.copy()
    for m in range(local.shape[1]):
        if direct and local[0, m].imag == 0.0:
            # It is exactly zero.
            sizes[0, m] = 0.0
        local[0, m] = local[0, m].imag
    imaginary = Piece(start, end, per_reach, local, sizes, phases, direct)
    everywhere = curvature_bound(imaginary)
    near = curvature_from_zero(piece) if start == 0.0 else everywhere
    return near, everywhere, rounding_bound(imaginary, rounding)


class _Known(NamedTuple):
    """What a walk knows of the sign of an imaginary part.

    Attributes
    ----------
    until : float
        The frequency up to which it is known; where the walk begins as long as it is not.
    sign : int
        1 or -1 there, 0 as long as it is not known.
    hidden : bool
        Whether rounding has hidden it since.
    """

    until: float
    sign: int
    hidden: bool


@njit()
def _begins(
    piece: Piece, error: FloatArray, omega: float, value: complex, slope: complex
) -> tuple[_Known, bool]:
    """Return what is known where a walk begins, and whether omega = 0 is a zero there."""
    if abs(value.imag) > bound_at(error, piece, omega):
        return _Known(omega, 1 if value.imag > 0.0 else -1, False), False
    if omega == 0.0 and abs(slope.imag) > error[1] * piece.per_reach:
        return _Known(omega, 1 if slope.imag > 0.0 else -1, False), True
    return _Known(omega, 0, True), False


@njit()
def _imaginary_step(
    at: tuple[float, complex, complex],
    step: float,
    curvature: float,
    uncertain: float,
    blind: float,
) -> float:
    """Longest certified step, at most `step`, from a frequency with this value and slope.

    Where the sign is hidden, `blind` is a step that leaves that stretch, and zero elsewhere:
    there nothing can be resolved.
    """
    if not curvature > 0.0:
        return step
    _, value, slope = at
    certified = _safe_step(value.imag, slope.imag, curvature, uncertain)
    if blind > 0.0:
        certified = max(certified, blind, 0.5 * np.sqrt(2.0 * uncertain / curvature))
    return float(min(step, certified))


@njit()
def _passed(
    piece: Piece,
    bounds: tuple[FloatArray, FloatArray],
    entered: float,
    known: _Known,
    before: tuple[float, complex, complex],
    after: tuple[float, complex, complex],
) -> tuple[tuple[float, int, float, bool], tuple[complex, complex]]:
    """Return what lies between where the sign was known last and where it is known again.

    As `_with_zero` takes it: a zero, a hidden stretch, or nothing, where the jump is 0 and it
    is not hidden. `bounds` are those on the second derivative and on rounding. `before` and
    `after` are a step's frequencies, with value and slope; the sign is known after it. It may
    have been hidden since before `entered`, where the piece was: then nothing bounds the slope
    all the way, and several zeros may lie there.
    """
    bound, error = bounds
    following, now = after[0], 1 if after[1].imag > 0.0 else -1
    half = 0.5 * (following - known.until)
    middle = known.until + half
    if known.sign == 0:
        jump = now if known.until == 0.0 else 0
        at = max(known.until, entered)
        return (known.until, jump, 2.0 * half, True), evaluate(piece, at)
    jump, single = now - known.sign, not known.hidden
    if known.hidden and known.until >= entered:
        single = _is_monotonic(piece, bound, error, middle, half)
    if not single or jump == 0:
        return (middle, jump, half, not single), evaluate(piece, max(middle, entered))
    if not known.hidden:
        h, dh = (before[1].imag, after[1].imag), (before[2].imag, after[2].imag)
        middle = _zero_between(before[0], following, h, dh)
    at, there = _polish(piece, bound, (known.until, following), middle, known.sign)
    rate, uncertain = abs(there[1].imag), bound_at(error, piece, at)
    if rate * half > uncertain:
        half = uncertain / rate
    return (at, jump, half, False), there


@njit()
def _ends(
    piece: Piece,
    bounds: tuple[FloatArray, FloatArray],
    entered: float,
    known: _Known,
    omega: float,
    is_map: bool,
) -> tuple[float, int, float, bool]:
    """Return what lies between where the sign was known last and the end of a walk.

    At the end of its axis the imaginary part of a map is zero.
    """
    width, single = 0.0, True
    if known.hidden:
        width, single = omega - known.until, False
        if is_map and known.sign != 0 and known.until >= entered:
            single = _is_monotonic(piece, bounds[0], bounds[1], omega, width)
    return omega, -known.sign if is_map else 0, width, not single


@njit(nogil=True)
def imaginary_zeros(
    whole: CompiledSum,
    measure: CompiledSum | None,
    omega_start: float,
    omega_end: float,
    is_map: bool,
    rounding: float,
    most: int,
    stop: BoolArray,
) -> tuple[FloatArray, bool]:
    """Zeros in [omega_start, omega_end] of the imaginary part of an exponential sum.

    For a row x = N / M of a chart the sum is N conj(M), and `measure` is |M|^2. Where the
    imaginary part is odd in omega, as it is there, omega = 0 is one of the zeros. Of a map
    `omega_end` is pi / step. Returns a row for each zero and each hidden stretch, and whether
    these are all: they are not if the walk would take more than `most` steps, or turn by more
    than MOST_RADIANS, or `stop` is set.
    Its columns:

    - OMEGA, polished; of a hidden stretch its middle, or `omega_start` or `omega_end` where it
      begins or ends there;
    - JUMP, 2 or -2, the direction of the sign change, where a conjugate pair crosses; 1 or -1
      where a real root does: at omega = 0, and at the `omega_end` of a map. Of a hidden stretch
      the jump that its zeros add up to, 0 where the sign at an end of the walk is hidden;
    - WIDTH, how far rounding lets the zero move, or a hidden stretch reaches to either side;
    - HIDDEN, 1 for a hidden stretch, else 0;
    - POSITION, the real part over the measure, nan where that vanishes;
    - SPREAD, how far from it the position may be within the width; inf where that cannot be
      told.

    Without a measure the last two are the real part and the size of the slope.
    """
    phases = whole.phases
    zeros, found = np.empty((64, 6)), 0
    fastest = np.abs(phases).max() if phases.size else 0.0
    if (omega_end - omega_start) * fastest > MOST_RADIANS:
        return zeros[:0], False
    omega, step, steps = omega_start, omega_end, 0
    known = _Known(omega, 0, True)
    crawled, patience, caution = 0, _PATIENCE, 1.0
    while omega < omega_end and steps <= most and not stop[0]:
        piece, first, entered = expand(whole, omega), found, omega
        end = min(piece.end, omega_end)
        near, everywhere, error = _imaginary_bounds(piece, rounding)
        value, slope = evaluate(piece, omega)
        uncertain = bound_at(error, piece, omega)
        if omega == omega_start:
            known, is_zero = _begins(piece, error, omega, value, slope)
            if is_zero:
                row = (omega, known.sign, 0.0, False)
                zeros = _with_zero(zeros, found, row, (value, slope))
                found += 1
        while omega < end and steps <= most and not stop[0]:
            steps += 1
            step, blind = min(2.0 * step, end - omega), 0.0
            next_to_zero = fastest * (omega + step) < 1.0
            # Apart: to give one of two arrays a name in each step takes longer than the bound.
            if next_to_zero:
                curvature = bound_at(near, piece, omega + step)
            else:
                curvature = bound_at(everywhere, piece, omega + step)
            if known.hidden:
                blind = max(_BLIND_GROWTH * (omega - known.until), _SHORTEST_BLIND * omega_end)
            before = (omega, value, slope)
            step = _imaginary_step(before, step, curvature, uncertain, blind)
            # Where terms cancel nearly to rounding, steps may become tiny. Then the error is
            # taken for larger, until the sign is clear again.
            short = step < _SHORT * omega and fastest * step < _SHORT
            crawled = crawled + 1 if short and not known.hidden else 0
            if crawled > patience:
                caution, patience = _MORE_CAUTION, _LESS_PATIENCE
            omega = end if step >= end - omega else omega + step
            value, slope = evaluate(piece, omega)
            uncertain = bound_at(error, piece, omega)
            if abs(value.imag) <= caution * uncertain:
                known = _Known(known.until, known.sign, True)
                continue
            now, caution = 1 if value.imag > 0.0 else -1, 1.0
            if now != known.sign or known.hidden:
                after = (omega, value, slope)
                bounds = (near if next_to_zero else everywhere, error)
                row, there = _passed(piece, bounds, entered, known, before, after)
                if row[JUMP] != 0 or row[HIDDEN]:
                    zeros = _with_zero(zeros, found, row, there)
                    found += 1
            known = _Known(omega, now, False)
        if omega >= omega_end and (is_map or known.hidden):
            row = _ends(piece, (everywhere, error), entered, known, omega_end, is_map)
            zeros = _with_zero(zeros, found, row, (value, slope))
            found += 1
        if found > first and measure is not None:
            _place(zeros[first:found], piece, expand(measure, entered), entered)
    return zeros[:found], omega >= omega_end


@njit(nogil=True)
def resolved_grid(
    whole: CompiledSum, omega_end: float, tolerance: float, most: int, stop: BoolArray
) -> tuple[FloatArray, bool]:
    """Frequencies from 0 to `omega_end` between which an exponential sum changes little.

    Over each step its tangent moves by no more than twice `tolerance` times its distance from
    zero, and the sum leaves the tangent by no more than once that, or the step is as small as
    rounding allows. Returns them, and whether they reach `omega_end`, which they do not if it
    takes more than `most` of them, or `stop` is set.
    """
    grid, found, omega, step = np.empty(1024), 1, 0.0, omega_end
    grid[0] = omega
    while omega < omega_end and found < most and not stop[0]:
        piece = expand(whole, omega)
        end, bound = min(piece.end, omega_end), curvature_bound(piece)
        while omega < end and found < most and not stop[0]:
            value, slope = evaluate(piece, omega)
            step = min(2.0 * step, end - omega)
            smallest = max(1e-13 * omega, 1e-16 * omega_end)
            while True:
                nearest = tangent_distance(value, slope, step)
                departure = 0.5 * bound_at(bound, piece, omega + step) * step * step
                moved = 0.5 * step * abs(slope)
                if max(departure, moved) <= tolerance * nearest or step <= smallest:
                    break
                step *= 0.5
            omega = end if step >= end - omega else omega + step
            if found == grid.size:
                grid = np.concatenate((grid, np.empty_like(grid)))
            grid[found] = omega
            found += 1
    return grid[:found], omega >= omega_end
