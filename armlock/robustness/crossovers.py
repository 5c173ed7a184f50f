"""Gain crossovers, where |L| = 1, and the phase and delay margins that are taken there.

No grid decides: crossovers are zeros of |L|^2 - 1, which the certified walk of
`armlock.axis.contour` finds, on those parts of the axis where free phases would allow a smaller
margin than is known.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from armlock.axis.exponentials import ExponentialSum
from armlock.checks import FloatArray
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
from armlock.stability.counts import polished, sign_changes

#: Relative accuracy of |L| at a crossover, and of a phase margin that L has at high frequency.
TOLERANCE = 1e-6
# Crossovers that are polished: those with the smallest margins.
_POLISHED = 8


def axis_zeros(
    whole: ExponentialSum, intervals: npt.ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Zeros of the imaginary part at omega > 0, and stretches there that may hide some.

    On intervals of the axis, in rad/s. The stretches have shape (3, n): the lower ends, the
    middles, the upper ends. A stretch that begins at omega = 0, where L is one power of s, is
    left out.
    """
    omega, jump, width = sign_changes(whole, intervals)
    hidden = jump == 0
    stretches = omega[hidden] + np.outer((-1.0, 0.0, 1.0), width[hidden])
    stretches = np.maximum(stretches, 1e-3 * omega[hidden])[:, stretches[0] != 0.0]
    return omega[~hidden & (omega > 0.0)], stretches


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
    """Frequencies with |L| = 1 on intervals of the axis, and stretches that may hide some.

    As `axis_zeros` returns them. `squares` is |N|^2 - |R|^2, with L = N / R.
    """
    omega, hidden = axis_zeros(squares.turned(), intervals)
    far = np.abs(_log_size(point, omega)) > TOLERANCE
    moved = _on_unit_circle(point, omega[far])
    lost = moved[np.abs(_log_size(point, moved)) > TOLERANCE]
    if lost.size:
        raise no_margin(point, f"rounding hides where |L| comes to one around {lost[0]} rad/s")
    omega[far] = moved
    return omega, hidden


def _least_lags(point: LoopAt, omega: FloatArray) -> tuple[float, float, float]:
    """Smallest phase margin in rad, smallest delay margin in s, and where the former is taken.

    Of crossovers at given frequencies; inf, inf and nan if there are none.
    """

    def lags(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        lag = np.mod(np.angle(point.response(at)) + np.pi, 2.0 * np.pi)
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
    left = [
        polynomial_sum(b, -limit * loop.rest)
        for b, limit in zip((loop.b1, loop.b2), limit_responses(loop), strict=True)
    ]
    for remainder in left:
        # The highest power cancels.
        remainder[loop.rest.size - 1 :] = 0.0
    weights = 1.0 + np.abs([c1, c2])
    return last_larger(loop.rest, (left[0], left[1]), weights / slack)


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
        perhaps = _least_lags(point, hidden.ravel())
        if perhaps[0] < min(phase, found[0]) or perhaps[1] < min(delay, found[1]):
            raise no_margin(
                point, f"rounding hides whether |L| comes to one around {perhaps[2]} rad/s"
            )
        if found[0] < phase:
            phase, where = found[0], found[2]
        delay = min(delay, found[1])
    return phase, delay, where
