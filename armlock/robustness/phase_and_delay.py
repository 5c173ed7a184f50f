"""Gain crossovers, where |L| = 1, and the phase and delay margins that are taken there.

No grid decides: crossovers are zeros of |L|^2 - 1, which the certified walk of
`armlock.axis.contour` finds, on those parts of the axis where free phases would allow a smaller
margin than is known.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from armlock.axis.exponentials import (
    ExponentialSum,
    Piece,
    bound_at,
    curvature_bound,
    evaluate,
    expand,
    rounding_bound,
)
from armlock.axis.rounding import ROUNDING
from armlock.checks import ComplexArray, FloatArray
from armlock.loops import LoopAt
from armlock.robustness import discs
from armlock.robustness.free_phases import (
    arm_weights,
    last_crossover,
    least_at,
    limit_disc,
    limit_margins,
    limit_responses,
    meeting_intervals,
    no_margin,
    polynomial_sum,
    search_outwards,
)
from armlock.stability.bounds import last_larger
from armlock.stability.zeros import axis_zeros, polished

#: Relative accuracy of |L| at a crossover, and of a phase margin that L has at high frequency.
TOLERANCE = 1e-6
# Crossovers that are polished: those with the smallest margins.
_POLISHED = 8
# Parts of a hidden stretch that are looked at: halving takes some fifty to reach rounding.
_PARTS = 1000


def _on_unit_circle(point: LoopAt, omega: FloatArray) -> FloatArray:
    """Move frequencies next to crossovers to where |L|, from its factors, is one."""
    # Far less than the distance between two nulls of an arm.
    longest = 0.01 / point.loop.longest_delay
    reaches = [np.minimum(10.0**power * omega, longest) for power in range(-13, 0)]
    return polished(lambda at: _log_size(point, at), omega, reaches)


def _log_size(point: LoopAt, omega: FloatArray) -> FloatArray:
    """Return ln |L|."""
    return np.asarray(np.log(np.abs(point.response(omega))))


def _crossovers(
    point: LoopAt, squares: ExponentialSum, intervals: npt.ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Frequencies with |L| = 1 on intervals of the axis, and hidden stretches as (start, end).

    `squares` is |N|^2 - |R|^2, with L = N / R.
    """
    zeros = axis_zeros(squares.times_j(), intervals)
    middle, width = zeros.omega[zeros.hidden], zeros.width[zeros.hidden]
    for end in width[middle == 0.0]:
        _require_none_below(point, float(end))
    middle, width = middle[middle > 0.0], width[middle > 0.0]
    # No stretch begins before its interval does.
    starts = np.reshape(intervals, (-1, 2))[:, 0]
    begun = starts[np.searchsorted(starts, middle, side="right") - 1]
    stretches = np.column_stack((np.maximum(middle - width, begun), middle + width))
    omega = zeros.omega[~zeros.hidden & (zeros.omega > 0.0)]
    far = np.abs(_log_size(point, omega)) > TOLERANCE
    moved = _on_unit_circle(point, omega[far])
    lost = moved[np.abs(_log_size(point, moved)) > TOLERANCE]
    if lost.size:
        raise no_margin(point, f"rounding hides where |L| comes to one around {lost[0]} rad/s")
    omega[far] = moved
    return omega, stretches


def _require_none_below(point: LoopAt, omega: float) -> None:
    """Raise if |L| may come to one between zero and a frequency.

    There, up to `LoopAt.leading_radius`, L is one power of s: it does not if it is above one
    and has a pole at s = 0, or is below one and has none, and none if both hold at omega.
    """
    radius, pole = point.leading_radius(), point.poles_at_zero() > 0
    sizes = np.abs(point.response(np.array([min(radius, omega), omega])))
    far = np.abs(np.log(sizes)) > TOLERANCE
    same = (sizes > 1.0).all() or (sizes < 1.0).all()
    if not far.all() or not same or (pole and sizes[0] < 1.0):
        raise no_margin(point, f"rounding hides whether |L| comes to one below {omega} rad/s")


def _share_moved(piece: Piece, start: float, end: float) -> float:
    """Bound |f - f(start)| / |f(start)| from `start` to `end` in a piece, rounding included."""
    value, slope = evaluate(piece, start)
    step = end - start
    moved = abs(slope) * step + 0.5 * bound_at(curvature_bound(piece), piece, end) * step**2
    moved += 2.0 * bound_at(rounding_bound(piece, ROUNDING), piece, end)
    return float(moved / abs(value)) if value else np.inf


def _lags(response: ComplexArray) -> FloatArray:
    """Return by how many rad L may lag before it points to -1, from 0 to 2 pi."""
    return np.asarray(np.mod(np.angle(response) + np.pi, 2.0 * np.pi))


def _hides_less(
    point: LoopAt, stretch: tuple[float, float], phase: float, delay: float
) -> bool:
    """Whether a hidden stretch may hold a crossover with a smaller phase or delay margin.

    With L = N / R, each of N and R is followed from the start of a part of the stretch by its
    tangent and curvature. That bounds |L|, and the part is left out where |L| cannot be one.
    It bounds the argument of L as well: by the arcsines of how far N and R move, as shares of
    what they are at the start. What neither bound decides is halved.
    """
    sums = [one.compiled() for one in (point.numerator(), point.loop.rest_on_boundary())]
    pieces = [expand(one, stretch[0]) for one in sums]
    if not stretch[0] > 0.0 or min(piece.end for piece in pieces) < stretch[1]:
        return True
    parts, looked_at = [stretch], 0
    while parts and looked_at < _PARTS:
        start, end = parts.pop()
        looked_at += 1
        above, below = (_share_moved(piece, start, end) for piece in pieces)
        response = point.response(np.array([start]))
        size, lag = float(np.abs(response[0])), float(_lags(response)[0])
        if below < 1.0 and size * (1.0 + above) < 1.0 - below:
            continue
        if above < 1.0 and size * (1.0 - above) > 1.0 + below:
            continue
        if max(above, below) < 1.0:
            turned = float(np.arcsin(above) + np.arcsin(below))
            near = min(lag, 2.0 * np.pi - lag) - turned
            if near > 0.0 and near >= phase and (lag - turned) / end >= delay:
                continue
        middle = 0.5 * (start + end)
        parts += [(start, middle), (middle, end)]
    return bool(parts)


def _least_lags(point: LoopAt, omega: FloatArray) -> tuple[float, float, float]:
    """Smallest phase margin in rad, smallest delay margin in s, and where the former is taken.

    Of crossovers at given frequencies; inf, inf and nan if there are none.
    """

    def lags(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        lag = _lags(point.response(at))
        # A lag turns L clockwise; a lead may reach -1 sooner.
        return lag, np.minimum(lag, 2.0 * np.pi - lag)

    if not omega.size:
        return np.inf, np.inf, np.nan
    lag, near = lags(omega)
    chosen = np.concatenate((np.argsort(near)[:_POLISHED], np.argsort(lag / omega)[:_POLISHED]))
    at = _on_unit_circle(point, omega[np.unique(chosen)])
    lag, near = lags(at)
    worst = int(np.argmin(near))
    return float(near[worst]), float(np.min(lag / at)), float(at[worst])


def crossovers_end(point: LoopAt, weights: FloatArray, phase: float) -> float:
    """Frequency in rad/s past which no crossover has a smaller phase margin than a number.

    `weights` are those of `arm_weights`.
    """
    last = last_crossover(point.loop, weights)
    return last if np.isfinite(last) else _settled_from(point, phase)


def _settled_from(point: LoopAt, phase: float) -> float:
    """Frequency in rad/s past which a neutral loop has no smaller phase margin than a number.

    Smaller means by more than the share TOLERANCE. Past it the disc of L is so close to its
    limit that what it may hold of the unit circle comes no closer to -1.
    """
    loop, c1, c2 = point
    centre, radius = limit_disc(point)

    def phase_within(slack: float) -> float:
        limit = discs.free_margins_at(complex(centre), radius + slack, np.inf)
        return float(limit[discs.PHASE])

    slack = 1e-3
    while phase_within(slack) < (1.0 - TOLERANCE) * phase and slack > 1e-12:
        slack *= 0.1
    rest, *arms = (p.coefficients for p in loop.polynomials())
    left = [
        polynomial_sum(b, -limit * rest)
        for b, limit in zip(arms, limit_responses(loop), strict=True)
    ]
    for remainder in left:
        # The highest power cancels.
        remainder[rest.size - 1 :] = 0.0
    weights = 1.0 + np.abs([c1, c2])
    return last_larger(rest, (left[0], left[1]), weights / slack)


def phase_and_delay(point: LoopAt, highest: float) -> tuple[float, float, float]:
    """Phase margin in rad, delay margin in s, and the frequency of the former, in rad/s.

    Of crossovers up to the frequency `highest`, which is inf unless phases are free above it.

    A neutral loop may have crossovers without end. Then its delay margin is zero, and its
    phase margin may be that of the disc that L fills at high frequency, `limit_margins`.
    """
    phase, delay, where = np.inf, np.inf, np.nan
    if not np.isfinite(highest):
        limit = limit_margins(point)
        phase, delay = float(limit[discs.PHASE]), float(limit[discs.DELAY])
        where = np.inf if np.isfinite(phase) else np.nan
    end = crossovers_end(point, arm_weights(point), phase)
    above, below = point.numerator(), point.loop.rest_on_boundary()
    squares = above.times_conjugate(above).plus(below.times_conjugate(below).scaled(-1.0))

    def meeting(span: tuple[float, float]) -> FloatArray:
        return meeting_intervals(point, span, levels=(0.0, 0.0, phase, delay))

    def likely(omega: FloatArray) -> FloatArray:
        return least_at(point, omega, slice(discs.PHASE, None))

    per_turn = point.loop.omega_per_turn
    for intervals in search_outwards(per_turn, lambda: min(end, highest), meeting, likely):
        omega, hidden = _crossovers(point, squares, intervals)
        found = _least_lags(point, omega)
        for start, stop in hidden.tolist():
            if _hides_less(point, (start, stop), min(phase, found[0]), min(delay, found[1])):
                raise no_margin(
                    point, f"rounding hides whether |L| comes to one around {start} rad/s"
                )
        if found[0] < phase:
            phase, where = found[0], found[2]
        delay = min(delay, found[1])
    return phase, delay, where
