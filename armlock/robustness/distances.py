"""The smallest distance of an open loop from -1 over all frequencies, certified.

With L = N / R these are the smallest |1 + L| and |1 + L| / |1 - L|. A compiled walk keeps the
smallest values found so far. Its steps are certified where the tangents of N and R, and bounds
on their second derivatives, leave no room for smaller ones. It is taken on those parts of the
axis where free phases would allow one.
"""

from __future__ import annotations

import numpy as np

from armlock.axis import contour
from armlock.axis.compiled import njit
from armlock.axis.exponentials import (
    ROUNDING,
    CompiledSum,
    Piece,
    bound_at,
    curvature_bound,
    evaluate,
    expand,
    rounding_bound,
    tangent_distance,
)
from armlock.checks import FloatArray
from armlock.loops import LoopAt
from armlock.robustness import discs
from armlock.robustness.free_phases import (
    FIRST_TURNS,
    arm_weights,
    least_at,
    limit_margins,
    meeting_intervals,
    no_margin,
    no_smaller_from,
    search_outwards,
    unconfined,
)

#: Relative accuracy of the smallest distances, and so of modulus and disk margins.
TOLERANCE = 1e-6


@njit(cache=True)
def _distance(n: complex, r: complex, m: int) -> float:
    """|1 + L|, or |1 + L| / |1 - L| where m is RATIO, of L = n / r."""
    below = abs(r - n) if m == discs.RATIO else abs(r)
    return abs(r + n) / below if below > 0.0 else np.inf


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
def _downhill(
    n: Piece, r: Piece, m: int, omega: float, step: float, end: float
) -> tuple[float, float]:
    """Follow a distance of L = N / R from -1 down to a minimum next to omega, within one piece.

    Returns the distance, and where.
    """
    least, shortest = np.inf, 1e-9 * step
    at = omega
    while step > shortest:
        if n.start <= at <= end:
            here = _distance(evaluate(n, at)[0], evaluate(r, at)[0], m)
            if here < least:
                omega, least = at, here
                at = omega + step
                continue
        # First on the one side, then on the other, then closer.
        if at > omega:
            at = omega - step
        else:
            step *= 0.5
            at = omega + step
    return least, omega


@njit(cache=True)
def _walk(
    numerator: CompiledSum,
    denominator: CompiledSum,
    omega: float,
    omega_end: float,
    best: FloatArray,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, bool]:
    """Smallest |1 + L|, and |1 + L| / |1 - L|, from omega to omega_end.

    `numerator` is N and `denominator` R, of the same polynomials. `best` holds a value of each
    that occurs: the walk looks for smaller ones, and passes over an entry of zero. Returns the
    smallest ones; where they are, nan for those of `best`; and whether the walk came to its
    end, which it does not if it is too long or rounding hides L. None is smaller than the
    result by more than the share `tolerance` and twice what rounding may move R + N by. A walk
    ends where that exceeds 1e-6 |R|, or 1e-6 |R - N| for the second one.
    """
    best, where, here, steps = best.copy(), np.full(2, np.nan), np.zeros(2), 0
    while omega < omega_end:
        # Both pieces are the same: their polynomials are.
        n, r = expand(numerator, omega), expand(denominator, omega)
        end = min(n.end, omega_end)
        n_bound, r_bound = curvature_bound(n), curvature_bound(r)
        n_error, r_error = rounding_bound(n, ROUNDING), rounding_bound(r, ROUNDING)
        (value, slope), (below, change) = evaluate(n, omega), evaluate(r, omega)
        step = end - omega
        while omega < end:
            steps += 1
            if steps > contour.MOST_STEPS:
                return best, where, False
            step = min(2.0 * step, end - omega)
            while True:
                following = end if step >= end - omega else omega + step
                new_value, new_slope = evaluate(n, following)
                new_below, new_change = evaluate(r, following)
                bent = 0.5 * step * step * bound_at(r_bound, r, following)
                both = 0.5 * step * step * bound_at(n_bound, n, following) + bent
                error = bound_at(n_error, n, following) + bound_at(r_error, r, following)
                over, over_slope = below + value, change + slope
                least = tangent_distance(over, over_slope, step) - both - error
                certain = True
                for m in range(2):
                    if best[m] == 0.0:
                        continue
                    here[m] = _distance(new_value, new_below, m)
                    under, under_slope, under_bent = below, change, bent
                    if m == discs.RATIO:
                        under, under_slope, under_bent = below - value, change - slope, both
                    most = max(abs(under), abs(under + step * under_slope))
                    most += under_bent + error
                    level = (1.0 - tolerance) * min(best[m], here[m])
                    # By so much rounding may move what was met already: no step avoids that.
                    unknown = (1.0 + level) * error
                    allowed = 2.0 * unknown if unknown <= 1e-6 * most else 0.0
                    if least + allowed >= level * most:
                        continue
                    apart = _stays_above(over, over_slope, under, under_slope, level, step)
                    if apart + allowed < both + level * under_bent + unknown:
                        certain = False
                        break
                if certain:
                    break
                if step <= 1e-15 * omega or step < 1e-300:
                    return best, where, False
                step *= 0.5
            for m in range(2):
                if here[m] < best[m]:
                    best[m], where[m] = _downhill(n, r, m, following, step, end)
            omega, value, slope = following, new_value, new_slope
            below, change = new_below, new_change
    return best, where, True


def smallest_distances(
    point: LoopAt, *, disk: bool, highest: float = np.inf
) -> tuple[FloatArray, FloatArray]:
    """Smallest |1 + L| and |1 + L| / |1 - L| up to a frequency, the limit included; and where.

    `highest` and the places are in rad/s, a place is inf for the limit at high frequency. The
    second distance is one if no smaller one occurs, and zero unless `disk` asks for it.
    """
    loop, weights = point.loop, arm_weights(point)
    best = limit_margins(point)[:2]
    best[discs.RATIO] = min(best[discs.RATIO], 1.0) if disk else 0.0
    where = np.full(2, np.inf)

    def end() -> float:
        """Frequency past which nothing is smaller, or `highest`."""
        return min(no_smaller_from(loop, weights, (1.0 - TOLERANCE) * best), highest)

    def improve(omega: FloatArray) -> None:
        """Take the smallest distances at given frequencies if they are smaller."""
        response = point.response(omega)
        with np.errstate(divide="ignore"):
            distances = np.abs(1.0 + response) / [np.ones(omega.size), np.abs(1.0 - response)]
        for m, nearest in enumerate(np.argmin(distances, axis=1)):
            if distances[m, nearest] < best[m]:
                best[m], where[m] = distances[m, nearest], omega[nearest]

    def meeting(span: tuple[float, float]) -> FloatArray:
        modulus, ratio = (1.0 - TOLERANCE) * best
        return meeting_intervals(point, span, levels=(modulus, ratio, 0.0, 0.0))

    def likely(omega: FloatArray) -> FloatArray:
        return least_at(point, omega, slice(discs.PHASE))

    if not np.isfinite(end()):
        raise unconfined(point)
    parts = point.numerator().compiled(), loop.rest_on_boundary().compiled()
    lowest = _constant_up_to(point)
    # Next to the limit a walk takes short steps, unless it knows of a smaller value.
    first = FIRST_TURNS * loop.omega_per_turn
    improve(np.geomspace(lowest, max(min(first, end()), lowest), 2000))
    for intervals in search_outwards(loop.omega_per_turn, end, meeting, likely):
        for low, high in np.maximum(intervals, lowest).tolist():
            improve(np.linspace(low, high, 2 + 2000 // len(intervals)))
            # What that has found narrows them.
            for start, stop in meeting((low, high)):
                found, places, complete = _walk(*parts, start, stop, best, TOLERANCE)
                if not complete:
                    why = f"following it takes more than {contour.MOST_STEPS:.0e} steps"
                    raise no_margin(point, f"rounding hides L, or {why}")
                best, where = found, np.where(np.isnan(places), where, places)
    return best, where


def _constant_up_to(point: LoopAt) -> float:
    """Frequency in rad/s up to which no margin is taken.

    There |1 + L| changes by less than a part in ten million, or |L| is above 1e7.
    """
    radius = point.leading_radius()
    lowest, higher = 1e-4 * radius, 1e-2 * radius
    size = abs(complex(point.response(higher)))
    if size > 1e7 and abs(complex(point.response(lowest))) > 0.9 * size:
        return higher
    return lowest
