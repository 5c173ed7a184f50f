"""How far a loop is from instability: margins, and the first perturbation that breaks it.

No grid enters a number. Distances from -1 come from the certified walk of `armlock.infimum`,
crossings from that of `armlock.contour`. Each walk ends at a frequency past which nothing
smaller, or no crossing, is possible; at high frequency the limit is known in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import zip_longest
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly
from scipy.optimize import elementwise, minimize_scalar

from armlock import contour, infimum
from armlock.bounds import last_larger, last_root_bound
from armlock.checks import (
    ComplexArray,
    FloatArray,
    IntArray,
    positive_number,
    real_number,
)
from armlock.exponentials import ExponentialSum
from armlock.loops import Loop, checked_loop
from armlock.nyquist import leading_radius, loop_numerator
from armlock.rays import Ray, first_break
from armlock.stability import (
    CountError,
    polished,
    sign_changes,
    unstable_roots,
)

#: Relative accuracy of the certificate for modulus and disk margins.
TOLERANCE = 1e-6
# The same with free phases, in the order of `armlock.infimum.free_margins_at`. The disk margin
# may be flat over decades of frequency, where a finer one would take too long.
_FREE_TOLERANCES = np.array([1e-5, 1e-4, 1e-5, 1e-5])
#: Gain factors up to this, and down to one over it, are looked at.
LARGEST_GAIN = 1e6
# Share of its limits up to which the neutral root chain lets gain factors be looked at.
_NEXT_TO_THE_CHAIN = 1e-5
# Turns of the longest delay that a walk along the axis can take.
_MOST_TURNS = 1.5e6
# Crossovers that are polished: those with the smallest margins.
_POLISHED = 8


@dataclass(frozen=True)
class Margins:
    r"""Distances of a stable loop from instability.

    Gain and phase are taken where L is real and negative, and where its magnitude is one:

    .. math::

        \text{gain} &= -1 / L \quad \text{where } \mathrm{Im}\, L = 0 > \mathrm{Re}\, L , \\
        \text{phase} &= \min_{|L| = 1} |\arg(-L)| , \quad -\pi < \arg \le \pi , \\
        \text{delay} &= \min_{|L| = 1} \frac{\arg(-L)}{\omega} ,
        \quad 0 \le \arg < 2\pi , \\
        \text{modulus} &= \inf_\omega |1 + L| , \\
        \text{disk} &= 2 \min \left( 1, \inf_\omega \frac{|1 + L|}{|1 - L|} \right)

    with L at s = j omega.

    Attributes
    ----------
    gain_lower, gain_upper : float
        The loop stays stable for every gain factor between the two; 0 and inf where nothing
        between factors of 1e-6 and 1e6 bounds it; nan where the arms' phases are free.
    phase : float
        Smallest turn in rad, lag or lead, at a gain crossover that makes the loop marginal;
        inf without a crossover.
    delay : float
        Smallest additional loop delay in s that makes the loop unstable; inf if none does.
        0 where the loop does not roll off: an arbitrarily small delay then destabilises it
        at high frequency.
    modulus : float
        Smallest |1 + L|.
    disk : float
        Symmetric disk margin: 2 min |1 + L| / |1 - L|. At most 2, where no gain factor and no
        turn up to 90 degrees makes the loop unstable.
    gain_omega, phase_omega, modulus_omega : float
        Where the upper gain margin, the phase margin and the modulus margin are taken, in
        rad/s; inf where it is the limit at high frequency, nan where there is none.

    Examples
    --------
    >>> from armlock import margins, paper_loop
    >>> found = margins(paper_loop())
    >>> print(f"stable for gains from {found.gain_lower:.3f} to {found.gain_upper:.2f}")
    stable for gains from 0.195 to 6.61
    """

    gain_lower: float
    gain_upper: float
    phase: float
    delay: float
    modulus: float
    disk: float
    gain_omega: float
    phase_omega: float
    modulus_omega: float


def _plus(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the sum of two polynomials."""
    return np.asarray(poly.polyadd(p, q), dtype=np.float64)


def _limit_disc(loop: Loop, c1: float, c2: float) -> tuple[float, float]:
    """Centre and radius of the disc that L fills at high frequency.

    It is that of all phases that small changes of the delays can make.
    """
    r = float(loop.rest[-1])
    b1, b2 = (float(b[-1]) if b.size == loop.rest.size else 0.0 for b in (loop.b1, loop.b2))
    arms = (abs(c1 * b1) + abs(c2 * b2)) / abs(r)
    if loop.delay:
        return 0.0, abs(b1 + b2) / abs(r) + arms
    return (b1 + b2) / r, arms


def _limit(loop: Loop, c1: float, c2: float) -> FloatArray:
    """Margins of the disc that L fills at high frequency, see `infimum.free_margins_at`.

    Raises
    ------
    CountError
        If it holds -1: the neutral root chain is not confined.
    """
    centre, radius = _limit_disc(loop, c1, c2)
    found: FloatArray = infimum.free_margins_at(complex(centre), radius, np.inf)
    if not found[infimum.MODULUS] > 0.0:
        raise _unconfined(c1, c2)
    if abs(centre) + radius >= 1.0:
        # L does not roll off: any delay more destabilises it at high frequency.
        found[infimum.DELAY] = 0.0
    return found


def _arm_weights(loop: Loop, c1: float, c2: float) -> FloatArray:
    """Return |c1| and |c2|; arms of the same delay and response count together, as one."""
    if loop.tau1 == loop.tau2 and loop.b1.any():
        ratio = float(loop.b2[-1] / loop.b1[-1])
        if np.array_equal(loop.b2, ratio * loop.b1):
            return np.array([abs(c1 + c2 * ratio), 0.0])
    return np.array([abs(c1), abs(c2)])


def _clear_from(loop: Loop, arms: FloatArray, centre: float, radius: float) -> float:
    """Frequency past which L stays outside a disc around a negative centre; inf if it does not.

    `arms` are |c1| and |c2|, or what they count for. Past it |B1 + B2 - centre R| exceeds
    radius |R| + |c1 B1| + |c2 B2|; with a dead time B1 + B2 turns, and stands on the other
    side.
    """
    c = _plus(loop.b1, loop.b2)
    factors = [radius, *arms, 0.0]
    first = -centre * loop.rest
    if loop.delay:
        factors[3] = 1.0
    else:
        first = _plus(first, c)
    others = (loop.rest, loop.b1, loop.b2, c)
    return last_larger(first, others, np.array(factors))


def last_crossover(loop: Loop, arms: FloatArray, gain: float = 1.0) -> float:
    """Frequency past which `gain` times |L| is below one at all phases; inf if there is none.

    `arms` are |c1| and |c2|, or what they count for.
    """
    c = _plus(loop.b1, loop.b2)
    return last_larger(loop.rest, (c, loop.b1, loop.b2), gain * np.array([1.0, *arms]))


@lru_cache(maxsize=64)
def _factors(loop: Loop) -> tuple[ComplexArray, IntArray, FloatArray]:
    """Return the responses to the two arms as `armlock.infimum` takes them.

    The roots of their factors, the powers of these in both, shape (2, roots), and the highest
    coefficients.
    """
    rest, *arms = loop.polynomials()
    leads = np.array([float(p.coefficients[-1] / rest.coefficients[-1]) for p in arms])
    powers: dict[complex, list[int]] = {}
    for k in range(2):
        # A response of zero takes part in nothing; as the other one's multiple it costs least.
        zeros = arms[k if leads[k] else 1 - k].roots
        for roots, change in ((zeros, 1), (rest.roots, -1)):
            for root in roots:
                powers.setdefault(complex(root), [0, 0])[k] += change
    kept = [(root, n) for root, n in powers.items() if any(n)]
    up = [entry for entry in kept if entry[1][0] > 0 or entry[1][1] > 0]
    down = [entry for entry in kept if entry not in up]
    # In turn, so that no product overflows.
    kept = [one for pair in zip_longest(up, down) for one in pair if one is not None]
    return (
        np.array([root for root, _ in kept], dtype=np.complex128),
        np.array([n for _, n in kept], dtype=np.int64).reshape(-1, 2).T.copy(),
        leads,
    )


def _arms(loop: Loop, c1: float, c2: float, *, free: bool = False) -> FloatArray:
    """Return what `armlock.infimum` needs of the arms beside their responses.

    If `free`, both phases are free at all frequencies.
    """
    return np.array([c1, c2, np.nan if free else loop.tau2 - loop.tau1, loop.delay])


def _meeting(
    loop: Loop,
    c1: float,
    c2: float,
    span: tuple[float, float],
    *,
    segment: tuple[float, ...] = (),
    levels: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
) -> FloatArray:
    """Intervals of a span of the axis outside which free phases keep L off a target.

    The target is that of `armlock.infimum.meeting_intervals`.
    """
    found: FloatArray = infimum.meeting_intervals(
        _factors(loop),
        _arms(loop, c1, c2),
        np.array(segment),
        np.array(levels),
        span,
        loop.longest_delay,
    )
    return found


def _around(omega: FloatArray, reach: float, span: tuple[float, float]) -> FloatArray:
    """Intervals around frequencies, cut to a span of the axis."""
    return np.column_stack((omega - reach, omega + reach)).clip(*span)


def _smallest(
    loop: Loop, c1: float, c2: float, *, disk: bool, highest: float = np.inf
) -> tuple[FloatArray, FloatArray]:
    """Smallest |1 + L| up to `highest`, and |1 + L| / |1 - L| if `disk`; and where.

    That is inf where it is the limit.
    """
    best = _limit(loop, c1, c2)[:2]
    best[infimum.RATIO] = min(best[infimum.RATIO], 1.0) if disk else 0.0
    where = np.full(2, np.inf)
    together = _arm_weights(loop, c1, c2)

    def end() -> float:
        """Frequency past which nothing is smaller, or `highest`."""
        discs = [
            infimum.excluded_disc(value * (1.0 - TOLERANCE), m == infimum.RATIO)
            for m, value in enumerate(best)
        ]
        return min(max(_clear_from(loop, together, *disc) for disc in discs), highest)

    if not np.isfinite(end()):
        raise _unconfined(c1, c2)

    def improve(omega: FloatArray) -> None:
        """Take the smallest distances at given frequencies if they are smaller."""
        response = loop.open_loop(1j * omega, c1, c2)
        with np.errstate(divide="ignore"):
            distances = np.abs(1.0 + response) / [np.ones(omega.size), np.abs(1.0 - response)]
        for m, nearest in enumerate(np.argmin(distances, axis=1)):
            if distances[m, nearest] < best[m]:
                best[m], where[m] = distances[m, nearest], omega[nearest]

    # Below it L is a single power of s, up to a part in ten million; or, if it is large there
    # and no positive power, it is large below.
    radius = leading_radius(loop, c1, c2)
    lowest, higher = 1e-4 * radius, 1e-2 * radius
    size = abs(complex(loop.open_loop(1j * higher, c1, c2)))
    if size > 1e7 and abs(complex(loop.open_loop(1j * lowest, c1, c2))) > 0.9 * size:
        lowest = higher
    improve(np.array([lowest]))
    numerator = loop_numerator(loop, c1, c2)
    weights = numerator.weights, numerator.sums, numerator.phases
    polynomials = numerator.compiled()
    factors, arms = _factors(loop), _arms(loop, c1, c2)
    # First the first turns of the delays: what they leave of the axis to be walked is less.
    start, turn = lowest, 2.0 * np.pi / loop.longest_delay
    for stop in (max(1e3 * turn, 2.0 * lowest), np.inf):
        last = min(stop, end())
        if last <= start:
            break
        if start == lowest:
            # Next to the limit a walk takes short steps, unless it knows of a smaller value.
            improve(np.geomspace(start, last, 2000))
        else:
            # Small distances are likely where the disc of free phases comes closest.
            omega = np.geomspace(start, last, 400)
            free = infimum.free_margins_over(factors, arms, omega)
            for at in omega[np.argmin(free[:, :2], axis=0)]:
                improve(np.linspace(at, min(at + 100.0 * turn, last), 2001))
            last = max(start, end())
        found, places, complete = infimum.smallest_distances(
            polynomials,
            weights,
            factors,
            arms,
            start,
            last,
            loop.longest_delay,
            best,
            TOLERANCE,
        )
        if not complete:
            raise CountError(
                f"no margin at (c1, c2) = ({c1}, {c2}): rounding hides L, or following it "
                f"takes more than {contour.MOST_STEPS:.0e} steps",
                np.array([[c1, c2]]),
            )
        best, where = found, np.where(np.isnan(places), where, places)
        start = last
    return best, where


def modulus_margin(loop: Loop, c1: float = 1.0, c2: float = 1.0) -> float:
    r"""Smallest distance of the Nyquist curve from -1, min over omega of |1 + L|.

    .. math::

        \inf_{\omega > 0} |1 + L(\mathrm{j}\omega; c_1, c_2)|

    It is one over the peak of the sensitivity.

    Parameters
    ----------
    loop : Loop
        The loop, stable or not.
    c1, c2 : float, optional
        Multiplicative perturbations.

    Returns
    -------
    float
        The infimum over all omega > 0, the limit at high frequency included, to a part in a
        million, or 1e-6 where rounding hides more. For a neutral loop that limit is taken over
        all small changes of the delays.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or c1 or c2 is not finite and real.
    CountError
        If the neutral root chain is not confined, or gain times delay is too large to follow.

    Examples
    --------
    >>> from armlock import modulus_margin, paper_loop
    >>> print(f"{modulus_margin(paper_loop()):.4f}")
    0.6156
    """
    checked_loop(loop)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    (modulus, _), _ = _smallest(loop, c1, c2, disk=False)
    return float(modulus)


def _unconfined(c1: float, c2: float) -> CountError:
    return CountError(
        f"no margin at (c1, c2) = ({c1}, {c2}): the neutral root chain is not confined to the "
        f"left half-plane",
        np.array([[c1, c2]]),
    )


def _require_stable(loop: Loop, c1: float, c2: float, free_above: float = np.inf) -> None:
    """Raise unless 1 + L has all its zeros in the open left half-plane."""
    count = count_at(loop, c1, c2, free_above)
    if count != 0:
        raise ValueError(
            f"the loop must be stable at (c1, c2) = ({c1}, {c2}) to have margins, but "
            f"unstable_roots gives {count}"
        )


def clear_above(loop: Loop, c1: float, c2: float, free_above: float) -> bool:
    """Whether no phases above a frequency take L to -1, for parameters of up to these sizes."""
    end = _clear_from(loop, np.abs([c1, c2]), -1.0, 0.0)
    if not np.isfinite(end):
        return False
    if end <= free_above:
        return True
    # Looked for are distances that are as good as none.
    least = np.array([TOLERANCE, 0.0, 0.0, 0.0])
    nearest, _, complete = infimum.free_margins(
        _factors(loop), _arms(loop, c1, c2, free=True), free_above, end, least, np.zeros(4)
    )
    return bool(complete) and nearest[infimum.MODULUS] == TOLERANCE


def count_at(loop: Loop, c1: float, c2: float, free_above: float) -> int:
    """Count the unstable roots; in less time where no phases above a frequency matter."""
    count = None
    if np.isfinite(free_above) and clear_above(loop, c1, c2, free_above):
        count = _count_below(loop, c1, c2, free_above)
    return int(unstable_roots(loop, c1, c2)) if count is None else count


def _count_below(loop: Loop, c1: float, c2: float, omega: float) -> int | None:
    """Count the unstable roots of a loop that no phases of the arms let cross past omega.

    Past it, and far out right of the axis, D(s; c1, c2) over its value at much smaller
    parameters stays in the right half-plane: what its argument gathers there only takes back
    what it is at omega. So the two counts differ by what the arguments gather up to omega, less
    that. None where rounding hides these.
    """
    # Not zero: sensors with an integrator have a root at s = 0 there.
    low1, low2 = 1e-3 * c1, 1e-3 * c2
    parts = [loop.at(c1, c2), loop.at(low1, low2)]
    arguments, values = [], []
    for whole in parts:
        argument, value, clear = contour.winding(
            whole.compiled(),
            whole.weights,
            whole.sums,
            whole.phases,
            np.zeros(whole.sums.size),
            omega,
        )
        if not clear or np.isnan(argument):
            return None
        arguments.append(argument)
        values.append(value)
    ratio = values[0] * values[1].conjugate()
    turned = arguments[0] - arguments[1] - math.atan2(ratio.imag, ratio.real)
    below = int(unstable_roots(loop, low1, low2))
    count = below - turned / math.pi
    return round(count) if below >= 0 and abs(count - round(count)) < 1e-3 else None


def _zeros(whole: ExponentialSum, intervals: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Zeros of the imaginary part on intervals of the axis, and where rounding may hide some.

    Of each stretch that hides some, its two ends and its middle, in a column.
    """
    parts: list[tuple[npt.NDArray[Any], ...]] = [(np.empty(0),) * 3]
    for start, end in np.reshape(intervals, (-1, 2)):
        parts.append(sign_changes(whole, float(end), start=float(start)))
    omega, jump, width = (np.concatenate(part) for part in zip(*parts, strict=True))
    hidden = jump == 0
    stretches = omega[hidden] + np.outer((-1.0, 0.0, 1.0), width[hidden])
    return omega[~hidden & (omega > 0.0)], stretches[:, stretches[0] > 0.0]


def _on_unit_circle(loop: Loop, c1: float, c2: float, omega: FloatArray) -> FloatArray:
    """Move frequencies next to crossovers to where |L|, from its factors, is one."""
    # Not past the next null of an arm.
    span = np.minimum(0.01 / loop.longest_delay, 0.5 * omega)
    reaches = [np.minimum(10.0**power * omega, span) for power in range(-13, 0)]
    return polished(lambda at: _level(loop, c1, c2, at), omega, reaches)


def _level(loop: Loop, c1: float, c2: float, omega: FloatArray) -> FloatArray:
    return np.asarray(np.log(np.abs(loop.open_loop(1j * omega, c1, c2))))


def _crossovers(
    loop: Loop, c1: float, c2: float, intervals: npt.ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Frequencies with |L| = 1 on intervals of the axis, and where rounding hides if it is."""
    above, below = loop_numerator(loop, c1, c2), loop.rest_on_boundary()
    squares = above.times_conjugate(above).plus(below.times_conjugate(below).scaled(-1.0))
    omega, hidden = _zeros(squares.turned(), intervals)
    far = np.abs(_level(loop, c1, c2, omega)) > TOLERANCE
    moved = _on_unit_circle(loop, c1, c2, omega[far])
    lost = moved[np.abs(_level(loop, c1, c2, moved)) > TOLERANCE]
    if lost.size:
        raise CountError(
            f"no margin at (c1, c2) = ({c1}, {c2}): rounding hides where |L| comes to one "
            f"around {lost[0]} rad/s",
            np.array([[c1, c2]]),
        )
    omega[far] = moved
    return omega, hidden


def _phase_and_delay(
    loop: Loop, c1: float, c2: float, highest: float
) -> tuple[float, float, float]:
    """Phase margin, delay margin, and the frequency of the former, up to `highest`.

    A neutral loop may have crossovers without end. Then its delay margin is zero, and its
    phase margin may be that of the disc that L fills at high frequency.

    First come crossovers that are likely to have the smallest margins: those of the first
    turns of the delays, and those next to where free phases would have them. The others are
    looked for only where free phases would allow smaller ones.
    """
    phase, delay, where = np.inf, np.inf, np.nan
    end = last_crossover(loop, _arm_weights(loop, c1, c2))
    if not np.isfinite(highest):
        limit = _limit(loop, c1, c2)
        phase, delay = float(limit[infimum.PHASE]), float(limit[infimum.DELAY])
        where = np.inf if delay == 0.0 else np.nan
        if not np.isfinite(end):
            end = _settled_from(loop, c1, c2, phase)
    end, turn = min(end, highest), 2.0 * np.pi / loop.longest_delay
    first = min(end, 1e3 * turn)
    intervals = np.array([[0.0, first]])
    if end > first:
        omega = np.geomspace(first, end, 400)
        free = infimum.free_margins_over(_factors(loop), _arms(loop, c1, c2), omega)
        nearest = omega[np.argmin(free[:, [infimum.PHASE, infimum.DELAY]], axis=0)]
        likely = _around(nearest, 300.0 * turn, (first, end))
        intervals = np.concatenate((intervals, likely))
    for last in (False, True):
        omega, hidden = _crossovers(loop, c1, c2, intervals)
        found = _least_lags(loop, c1, c2, omega)
        perhaps = _least_lags(loop, c1, c2, hidden.ravel())
        if perhaps[0] < min(phase, found[0]) or perhaps[1] < min(delay, found[1]):
            raise CountError(
                f"no margin at (c1, c2) = ({c1}, {c2}): rounding hides whether |L| comes to "
                f"one around {perhaps[2]} rad/s",
                np.array([[c1, c2]]),
            )
        if found[0] < phase:
            phase, where = found[0], found[2]
        delay = min(delay, found[1])
        if last or end == first:
            break
        levels = 0.0, 0.0, phase, delay
        intervals = _meeting(loop, c1, c2, (first, end), levels=levels)
    return phase, delay, where


def _least_lags(
    loop: Loop, c1: float, c2: float, omega: FloatArray
) -> tuple[float, float, float]:
    """Smallest phase and delay margins at crossovers, and where the former is taken."""

    def lags(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        lag = np.mod(np.angle(loop.open_loop(1j * at, c1, c2)) + np.pi, 2.0 * np.pi)
        # A lag turns L clockwise; a lead may reach -1 sooner.
        return lag, np.minimum(lag, 2.0 * np.pi - lag)

    if not omega.size:
        return np.inf, np.inf, np.nan
    lag, nearest = lags(omega)
    chosen = np.concatenate(
        (np.argsort(nearest)[:_POLISHED], np.argsort(lag / omega)[:_POLISHED])
    )
    at = _on_unit_circle(loop, c1, c2, omega[np.unique(chosen)])
    lag, nearest = lags(at)
    worst = int(np.argmin(nearest))
    return float(nearest[worst]), float(np.min(lag / at)), float(at[worst])


def _settled_from(loop: Loop, c1: float, c2: float, phase: float) -> float:
    """Frequency past which no phase margin of a neutral loop is below a number.

    Past it the disc of L is so close to its limit that what it may hold of the unit circle
    does not come closer to -1, by more than the share TOLERANCE.
    """
    centre, radius = _limit_disc(loop, c1, c2)

    def nearby(near: float) -> float:
        limit = infimum.free_margins_at(complex(centre), radius + near, np.inf)
        return float(limit[infimum.PHASE])

    near = 1e-3
    while nearby(near) < (1.0 - TOLERANCE) * phase and near > 1e-12:
        near *= 0.1
    shares = [
        float(b[-1] / loop.rest[-1]) if b.size == loop.rest.size else 0.0
        for b in (loop.b1, loop.b2)
    ]
    left = [
        _plus(b, -share * loop.rest)
        for b, share in zip((loop.b1, loop.b2), shares, strict=True)
    ]
    for remainder in left:
        # The highest power cancels.
        remainder[loop.rest.size - 1 :] = 0.0
    weights = 1.0 + np.abs([c1, c2])
    return last_larger(loop.rest, (left[0], left[1]), weights / near)


def _chain_gains(loop: Loop, c1: float, c2: float) -> tuple[float, float]:
    """Gain factors around one between which the neutral root chain is confined.

    A factor k multiplies the disc of L at high frequency; the chain is confined while that
    stays clear of -1.
    """
    centre, radius = _limit_disc(loop, c1, c2)
    limits = [-1.0 / end for end in (centre - radius, centre + radius) if end < 0.0]
    lower = max((k for k in limits if k < 1.0), default=0.0)
    return lower, min((k for k in limits if k > 1.0), default=np.inf)


def _no_crossing_from(loop: Loop, c1: float, c2: float, low: float, high: float) -> float:
    r"""Frequency past which no gain factor from `low` to `high` takes a root across the axis.

    With t = 1 / k from 1 / high to 1 / low, and S = |c1 B1| + |c2 B2|, the square of
    |t R + C| - S must stay positive. \|t R + C\|^2 is convex in t. If it ascends at the lower
    end of the interval, it is smallest there; if it descends at the upper end, there.
    """
    c, arms = _plus(loop.b1, loop.b2), _arm_weights(loop, c1, c2)
    found = [last_crossover(loop, arms, high)]
    if not loop.delay:
        for t, sign in ((1.0 / high, 1.0), (1.0 / low, -1.0)):
            ascends = math.sqrt(last_root_bound(_ascent(loop.rest, c, t, sign)))
            first = _plus(t * loop.rest, c)
            found.append(max(ascends, last_larger(first, (loop.b1, loop.b2), arms)))
    return min(found)


def _ascent(rest: FloatArray, c: FloatArray, t: float, sign: float) -> FloatArray:
    """Half the slope of |t R + C|^2 in t, times a sign, as a polynomial in omega^2."""
    whole = _plus(t * rest, c)
    product = np.convolve(whole, rest * (-1.0) ** np.arange(rest.size))[::2]
    return np.asarray(sign * product * (-1.0) ** np.arange(product.size))


def _gains(loop: Loop, c1: float, c2: float, omega: FloatArray) -> FloatArray:
    """Gain factors that take a root to the axis at frequencies."""
    with np.errstate(divide="ignore"):
        return np.asarray(-1.0 / loop.open_loop(1j * omega, c1, c2).real)


def _real_within(loop: Loop, c1: float, c2: float, stretches: FloatArray) -> FloatArray:
    """Where L, from its factors, is real within stretches in which rounding hides it."""

    def imaginary(omega: FloatArray) -> FloatArray:
        return np.asarray(loop.open_loop(1j * omega, c1, c2).imag)

    lower, upper = stretches[:-1].ravel(), stretches[1:].ravel()
    changes = imaginary(lower) * imaginary(upper) < 0.0
    return np.asarray(elementwise.find_root(imaginary, (lower[changes], upper[changes])).x)


def _free_gains(loop: Loop, c1: float, c2: float, omega: FloatArray) -> FloatArray:
    """Gain factors next to one, below and above, for some phases; shape (omega, 2).

    They belong to the ends of what the disc of L covers of the negative real axis.
    """
    first, second = loop.arm_responses(1j * omega)
    centre, spread = first + second, np.abs(c1 * first) + np.abs(c2 * second)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.sqrt(spread**2 - centre.imag**2)
        factors = -1.0 / np.column_stack((centre.real + half, centre.real - half))
    lower = np.where((factors > 0.0) & (factors < 1.0), factors, 0.0).max(axis=1)
    upper = np.where(factors > 1.0, factors, np.inf).min(axis=1)
    return np.column_stack((lower, upper))


def _gains_around_one(
    loop: Loop, c1: float, c2: float, least: float, most: float
) -> tuple[float, float, float]:
    """Gain factors next to one that take a root to the axis, and where the upper one does.

    `least` and `most` where there are none between them. As for phases, likely ones come first.
    """
    turn = 2.0 * np.pi / loop.longest_delay
    arms = _arm_weights(loop, c1, c2)

    def end(lower: float, upper: float) -> float:
        """Frequency past which no factor between the two takes a root to the axis."""
        clear = max(
            _clear_from(loop, arms, -0.5 * (1.0 / k + 1.0), 0.5 * abs(1.0 - 1.0 / k))
            for k in (lower, upper)
        )
        return min(clear, _no_crossing_from(loop, c1, c2, lower, upper))

    def meeting(lower: float, upper: float, span: tuple[float, float]) -> FloatArray:
        return _meeting(loop, c1, c2, span, segment=(-1.0 / upper, -1.0 / lower))

    crossing = loop_numerator(loop, c1, c2).times_conjugate(loop.rest_on_boundary())
    lower, upper, where = least, most, np.nan
    first = min(end(lower, upper), 1e3 * turn)
    intervals, wide, complete = meeting(lower, upper, (0.0, first)), 300.0, False
    while True:
        omega, hidden = _zeros(crossing, intervals)
        omega = np.concatenate((omega, _real_within(loop, c1, c2, hidden)))
        factor = _gains(loop, c1, c2, omega)
        below = factor[(factor >= lower) & (factor <= 1.0)]
        lower = float(below.max(initial=lower))
        above = np.flatnonzero((factor > 1.0) & (factor <= upper))
        if above.size:
            nearest = above[np.argmin(factor[above])]
            upper, where = float(factor[nearest]), float(omega[nearest])
        last = end(lower, upper)
        if complete or last <= first:
            return lower, upper, where
        intervals = meeting(lower, upper, (first, last))
        complete = float(np.diff(intervals).sum()) < _MOST_TURNS * turn or wide > _MOST_TURNS
        if not complete:
            # Too many turns: around where free phases would have the nearest gains.
            omega = np.geomspace(first, last, 400)
            free = _free_gains(loop, c1, c2, omega)
            at = omega[[np.argmax(free[:, 0]), np.argmin(free[:, 1])]]
            intervals = _around(at, wide * turn, (first, last))
            wide *= 30.0


def gain_interval(loop: Loop, c1: float, c2: float) -> tuple[float, float, float]:
    r"""Find the gain factors around one between which a stable loop stays stable.

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float
        Multiplicative perturbations, at which the loop is stable.

    Returns
    -------
    lower, upper, omega : float
        The two factors, and where the upper one is taken, in rad/s; 0, inf and nan where
        nothing between factors of 1e-6 and 1e6 bounds them.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or c1 or c2 is not finite and real, or the loop is not stable
        there.
    CountError
        If gain times delay is too large to follow, or rounding hides what decides.

    Notes
    -----
    With a factor k, and L = N / R, a root is at s = j omega where

    .. math::

        R + k N = 0 , \qquad k = -\frac{1}{L} \text{ is real.}

    The neutral root chain bounds the gain, too. Just inside its limits roots cross at ever
    higher frequency: a factor that lies within 1e-5 of a limit may be given as the limit.

    Examples
    --------
    >>> from armlock import DualArm
    >>> from armlock.margins import gain_interval
    >>> lower, upper, omega = gain_interval(DualArm(), 1.001, 1.002)
    >>> print(f"{upper:.2f}")
    29.58
    """
    checked_loop(loop)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    _require_stable(loop, c1, c2)
    return _gain_interval(loop, c1, c2)


def _gain_interval(loop: Loop, c1: float, c2: float) -> tuple[float, float, float]:
    """Do what `gain_interval` does for a loop that is known to be stable."""
    floor, limit = _chain_gains(loop, c1, c2)
    # Just inside the limits of the chain, roots cross at ever higher frequency.
    least = max(floor * (1.0 + _NEXT_TO_THE_CHAIN), 1.0 / LARGEST_GAIN)
    most = min(limit * (1.0 - _NEXT_TO_THE_CHAIN), LARGEST_GAIN)
    least, most = min(least, 1.0), max(most, 1.0)
    lower, upper, where = _gains_around_one(loop, c1, c2, least, most)
    if lower == least:
        lower = floor if floor >= 1.0 / LARGEST_GAIN else 0.0
    if upper == most:
        upper, where = (limit, np.inf) if limit <= LARGEST_GAIN else (np.inf, np.nan)
    # A real root crosses at s = 0.
    start, first = float(loop.b1[0] * (1.0 - c1) + loop.b2[0] * (1.0 - c2)), float(loop.rest[0])
    if start * first < 0.0:
        at_zero = -first / start
        lower = max(lower, at_zero) if at_zero < 1.0 else lower
        if 1.0 < at_zero < upper:
            upper, where = at_zero, 0.0
    return lower, upper, where


def _free_margins(
    loop: Loop, c1: float, c2: float, lowest: float, known: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Margins over all phases of the two arms, from a frequency on, and where they are met.

    In the order of `armlock.infimum.free_margins_at`; only those below `known` are looked for.
    A coarse sample gives values that occur. The certified walk then steps over what cannot hold
    smaller ones.
    """
    arms = np.abs([c1, c2])
    limit = _limit(loop, c1, c2)
    # Past it nothing has a phase.
    end = last_crossover(loop, arms)
    if not np.isfinite(end):
        end = _settled_from(loop, c1, c2, float(limit[infimum.PHASE]))
    end = max(end, 2.0 * lowest)

    factors, free = _factors(loop), _arms(loop, c1, c2, free=True)

    def at(u: npt.ArrayLike) -> FloatArray:
        omega = np.exp(np.atleast_1d(np.asarray(u, dtype=float)))
        return np.asarray(infimum.free_margins_over(factors, free, omega))

    # The smallest distances may lie past the last crossover, where L turns most.
    u = np.linspace(math.log(lowest), math.log(10.0 * end), 300)
    sampled = at(u)
    best, where = np.minimum(limit, known), np.full(limit.size, np.inf)
    for k in range(best.size):
        nearest = int(np.argmin(sampled[:, k]))
        if not sampled[nearest, k] < best[k]:
            continue
        best[k], where[k] = sampled[nearest, k], math.exp(u[nearest])
        sides = u[max(nearest - 1, 0)], u[min(nearest + 1, u.size - 1)]
        lower = minimize_scalar(lambda v, k=k: at(v)[0, k], bounds=sides, method="bounded")
        if lower.fun < best[k]:
            best[k], where[k] = float(lower.fun), math.exp(float(lower.x))
    # Past it L stays clear of where smaller values would be.
    for k, symmetric in ((infimum.MODULUS, False), (infimum.RATIO, True)):
        level = best[k] * (1.0 - TOLERANCE)
        end = max(end, _clear_from(loop, arms, *infimum.excluded_disc(level, symmetric)))
    smaller, places, complete = infimum.free_margins(
        factors, free, lowest, end, best, _FREE_TOLERANCES
    )
    if not complete:
        raise CountError(
            f"no margins for free phases at (c1, c2) = ({c1}, {c2}) from {lowest} rad/s on",
            np.array([[c1, c2]]),
        )
    return smaller, np.where(np.isnan(places), where, places)


def margins(
    loop: Loop, c1: float = 1.0, c2: float = 1.0, free_above: float | None = None
) -> Margins:
    r"""Compute all margins of a stable loop.

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float, optional
        Multiplicative perturbations.
    free_above : float, optional
        Angular frequency in rad/s above which the phases of both arms are taken as free, as
        they are once the arms have drifted by a fraction of the modulation's wavelength: the
        margins then hold for all of them. By default the phases are those of the delays, at
        all frequencies.

    Returns
    -------
    Margins

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, c1 or c2 is not finite and real, `free_above` is not positive,
        or the loop is not stable there.
    CountError
        If gain times delay is too large to follow, or rounding hides what decides.

    Notes
    -----
    Phase and delay margins are taken over all crossovers. A neutral loop may have crossovers
    without end; they then approach those of the disc below, and the phase margin is certified
    to a part in a million.

    With free phases, L fills a disc: with the sensor's weights m1 and m2

    .. math::

        \left| L - K e^{-s\delta} (m_1 + m_2) \right|
        \le |K| \left( |c_1 m_1| + |c_2 m_2| \right) .

    The distances from -1 of this disc, and of its share of the unit circle, are known in closed
    form at each frequency; their minima over frequency are certified to 1e-5, the disk margin
    to 1e-4. A disc that holds -1 has margins of zero. A gain interval is not
    given: the edge of such a disc may run along the real axis.
    With equal weights m and c1 = c2 = 1 the disc is that around K m exp(-s delay) times two
    whose edge runs through the origin: it stays clear of -1, for arms of any lengths, where
    Re [K m exp(-s delay)] > -1/4.

    Examples
    --------
    >>> import math
    >>> from armlock import margins, paper_loop
    >>> print(f"{math.degrees(margins(paper_loop()).phase):.1f} degrees")
    36.0 degrees
    """
    checked_loop(loop)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    highest = np.inf if free_above is None else positive_number("free_above", free_above)
    _require_stable(loop, c1, c2, highest)
    (modulus, ratio), (modulus_omega, _) = _smallest(loop, c1, c2, disk=True, highest=highest)
    phase, delay, phase_omega = _phase_and_delay(loop, c1, c2, highest)
    if free_above is None:
        lower, upper, gain_omega = _gain_interval(loop, c1, c2)
    else:
        lower, upper, gain_omega = np.nan, np.nan, np.nan
        known = np.array([modulus, ratio, phase, delay])
        free, where = _free_margins(loop, c1, c2, highest, known)
        if free[infimum.MODULUS] < modulus:
            modulus, modulus_omega = free[infimum.MODULUS], where[infimum.MODULUS]
        if free[infimum.PHASE] < phase:
            phase, phase_omega = free[infimum.PHASE], where[infimum.PHASE]
        ratio, delay = min(ratio, free[infimum.RATIO]), min(delay, free[infimum.DELAY])
    numbers = lower, upper, phase, delay, modulus, 2.0 * ratio
    places = gain_omega, phase_omega, modulus_omega
    return Margins(*(float(value) for value in (*numbers, *places)))


def critical_perturbation(
    loop: Loop, direction: npt.ArrayLike, free_above: float | None = None
) -> float:
    r"""Return the smallest perturbation of (1, 1) in a direction that breaks the loop.

    Parameters
    ----------
    loop : Loop
        The loop.
    direction : array_like of two floats
        (d1, d2), taken as given and not normalised.
    free_above : float, optional
        Angular frequency in rad/s up to which a first crossing is looked for, to spare the time
        of a loop that rolls off late. It is the result if no phases of the arms let a root
        cross above it for so small a perturbation; otherwise all frequencies are walked.

    Returns
    -------
    float
        Smallest eps > 0 such that `unstable_roots` at (1, 1) + eps (d1, d2) is not zero: a
        root reaches the imaginary axis there, or the neutral root chain does. 0 if it is not
        stable next to (1, 1), inf if no eps breaks it, up to parameters of 1e9.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, the direction is not two finite real numbers or has length
        zero, the loop is unstable at (1, 1) itself, or `free_above` is not positive.
    CountError
        If the counts on the two sides of the result contradict it, or gain times delay is too
        large to follow.

    See Also
    --------
    armlock.rays.first_break : from other points, and with the frequency.

    Notes
    -----
    Along the ray D is affine in eps, and a root is at s = j omega where

    .. math::

        \varepsilon = \frac{D(s; 1, 1)\, e^{s\delta}}
        {d_1 B_1 e^{-s\tau_1} + d_2 B_2 e^{-s\tau_2}} \text{ is real.}

    Examples
    --------
    >>> from armlock import critical_perturbation, paper_loop
    >>> print(f"{critical_perturbation(paper_loop(), (0, -1)):.4e}")
    2.9286e-06
    """
    ray = Ray(checked_loop(loop), (1.0, 1.0), direction)
    if free_above is not None:
        highest = positive_number("free_above", free_above)
        stop = min(ray.scale, 0.5 * ray.chain_limit())
        at = ray.crossings(stop, first=True, highest=highest).position
        if at.size and count_at(loop, 1.0, 1.0, highest) == 0:
            c1, c2 = 1.0 + float(at[0]) * np.abs(ray.direction)
            if clear_above(loop, c1, c2, highest):
                return float(at[0])
    return first_break(loop, ray.start, ray.direction).position
