"""What L can be at all phases of the arms: a disc, and the count and the limits it decides.

With free phases L fills a disc, around the sum of the responses to the two arms
(`armlock.robustness.discs`). Where that stays off a target, such as -1 or the unit circle, L
does at all those phases. So it tells which parts of the axis need no walk, and its limit at
high frequency is that of L.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import zip_longest

import numpy as np
from numpy.polynomial import polynomial as poly

from armlock.axis import contour
from armlock.checks import ComplexArray, FloatArray, IntArray
from armlock.loops import Loop, LoopAt
from armlock.robustness import discs
from armlock.stability.bounds import last_larger
from armlock.stability.counts import CountError, loop_count, walk_begins

# A distance of L from -1 below it is as good as none.
_TOUCHING = 1e-6
#: A search begins with so many turns of the longest delay.
FIRST_TURNS = 1e3
# Then it looks at so many on either side of a likely place, and so many times more when it has
# to look again.
_TURNS_AROUND, _WIDER = 300.0, 30.0


def polynomial_sum(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the sum of two polynomials."""
    return np.asarray(poly.polyadd(p, q), dtype=np.float64)


def limit_responses(loop: Loop) -> tuple[float, float]:
    """Return the responses to both arms at high frequency, dead time left out."""
    first, second = (
        float(b[-1] / loop.rest[-1]) if b.size == loop.rest.size else 0.0
        for b in (loop.b1, loop.b2)
    )
    return first, second


def limit_disc(point: LoopAt) -> tuple[float, float]:
    """Centre and radius of the disc that L fills at high frequency, all phases being free."""
    first, second = limit_responses(point.loop)
    radius = abs(point.c1 * first) + abs(point.c2 * second)
    if point.loop.delay:
        return 0.0, abs(first + second) + radius
    return first + second, radius


def free_disc(point: LoopAt, omega: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Centres and radii of the discs that L fills at frequencies, both arms' phases free.

    `armlock.robustness.discs` has the same, with the phase between the arms where it is known.
    """
    first, second = point.loop.arm_responses(1j * omega)
    return first + second, np.abs(point.c1 * first) + np.abs(point.c2 * second)


def limit_margins(point: LoopAt) -> FloatArray:
    """Margins of the disc that L fills at high frequency.

    In the order of `discs.free_margins_at`: modulus, ratio, phase in rad, delay in s.

    Raises
    ------
    CountError
        If the disc holds -1: the neutral root chain is not confined.
    """
    centre, radius = limit_disc(point)
    found: FloatArray = discs.free_margins_at(complex(centre), radius, np.inf)
    if not found[discs.MODULUS] > 0.0:
        raise unconfined(point)
    if abs(centre) + radius >= 1.0:
        # L does not roll off: any delay more destabilises it at high frequency.
        found[discs.DELAY] = 0.0
    return found


def unconfined(point: LoopAt) -> CountError:
    """Return the error of a loop that has no margins, because its chain is not confined."""
    return no_margin(point, "the neutral root chain is not confined to the left half-plane")


def no_margin(point: LoopAt, why: str) -> CountError:
    """Return the error of a margin that cannot be certified."""
    _, c1, c2 = point
    return CountError(f"no margin at (c1, c2) = ({c1}, {c2}): {why}", np.array([[c1, c2]]))


def arm_weights(point: LoopAt) -> FloatArray:
    """Return the weights of |B1| and |B2| in a bound on what the delayed terms add up to.

    They are |c1| and |c2|. Arms of equal delay with B2 = ratio B1 act as one: the weights are
    |c1 + ratio c2| and 0.
    """
    loop, c1, c2 = point
    if loop.tau1 == loop.tau2 and loop.b1.any():
        ratio = float(loop.b2[-1] / loop.b1[-1])
        if np.array_equal(loop.b2, ratio * loop.b1):
            return np.array([abs(c1 + c2 * ratio), 0.0])
    return np.array([abs(c1), abs(c2)])


def clear_from(loop: Loop, weights: FloatArray, centre: float, radius: float) -> float:
    """Frequency in rad/s past which L, at all phases, stays outside a disc; inf if it does not.

    The centre is real and not zero, `weights` are those of `arm_weights`. Past the frequency
    |B1 + B2 - centre R| exceeds radius |R| + |c1 B1| + |c2 B2|. With a dead time B1 + B2 may
    have any phase, too: then |centre R| has to exceed that and |B1 + B2|.
    """
    first, c = -centre * loop.rest, polynomial_sum(loop.b1, loop.b2)
    others, factors = (loop.rest, loop.b1, loop.b2), [radius, *weights]
    if loop.delay:
        return last_larger(first, (*others, c), np.array([*factors, 1.0]))
    return last_larger(polynomial_sum(first, c), others, np.array(factors))


def last_crossover(loop: Loop, weights: FloatArray, gain: float = 1.0) -> float:
    """Frequency in rad/s past which `gain` times |L| is below one at all phases, or inf.

    `weights` are those of `arm_weights`.
    """
    c = polynomial_sum(loop.b1, loop.b2)
    return last_larger(loop.rest, (c, loop.b1, loop.b2), gain * np.array([1.0, *weights]))


def no_smaller_from(loop: Loop, weights: FloatArray, levels: FloatArray) -> float:
    """Frequency past which neither |1 + L| nor |1 + L| / |1 - L| is below its level, or inf."""
    return max(
        clear_from(loop, weights, *discs.excluded_disc(levels[m], m))
        for m in (discs.MODULUS, discs.RATIO)
    )


@lru_cache(maxsize=64)
def _factors(loop: Loop) -> tuple[ComplexArray, IntArray, FloatArray]:
    """Return the roots, powers and leads of `armlock.robustness.discs.Arms`."""
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
    up = [(root, n) for root, n in kept if max(n) > 0]
    down = [(root, n) for root, n in kept if max(n) <= 0]
    # In turn, so that no product overflows.
    kept = [one for pair in zip_longest(up, down) for one in pair if one is not None]
    return (
        np.array([root for root, _ in kept], dtype=np.complex128),
        np.array([n for _, n in kept], dtype=np.int64).reshape(-1, 2).T.copy(),
        leads,
    )


def arms_of(point: LoopAt, *, free: bool = False) -> discs.Arms:
    """Return the arms of a loop. If `free`, both phases are free at all frequencies."""
    loop, c1, c2 = point
    apart = np.nan if free else loop.tau2 - loop.tau1
    return discs.Arms(*_factors(loop), float(c1), float(c2), apart, loop.delay)


def meeting_intervals(
    point: LoopAt,
    span: tuple[float, float],
    *,
    segment: tuple[float, ...] = (),
    levels: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    free: bool = False,
) -> FloatArray:
    """Intervals, in rad/s and of shape (n, 2), on which L may meet a target at some phases.

    Intervals of a span of the axis. The target is that of
    `armlock.robustness.discs.intervals_not_clear`. With `free`, as for `arms_of`, they hold for
    all smaller |c1| and |c2|, too.
    """
    found: FloatArray = discs.intervals_not_clear(
        arms_of(point, free=free),
        np.array(segment),
        np.array(levels),
        span,
        point.loop.omega_per_turn,
    )
    return found


def crossing_intervals(point: LoopAt, span: tuple[float, float]) -> FloatArray:
    """Intervals of a span outside which no phases, and no smaller |c1|, |c2|, take L to -1."""
    levels = (_TOUCHING, 0.0, 0.0, 0.0)
    return meeting_intervals(point, span, levels=levels, free=True)


def least_at(point: LoopAt, omega: FloatArray, margins: slice) -> FloatArray:
    """Return at which of some frequencies each of some margins of the disc is smallest."""
    found: FloatArray = discs.free_margins_over(arms_of(point), omega)
    nearest: FloatArray = omega[np.argmin(found[:, margins], axis=0)]
    return nearest


def search_outwards(
    per_turn: float,
    end: Callable[[], float],
    meeting: Callable[[tuple[float, float]], FloatArray],
    likely: Callable[[FloatArray], FloatArray],
) -> Iterator[FloatArray]:
    """Yield intervals of the axis to look at, the most promising first, until none is left.

    First come the first turns of the delays. Then, as long as far more is left, what lies
    around likely places, each time further around. Last comes the rest. After each the caller
    keeps the best that it has found, on which the three functions depend.

    Parameters
    ----------
    per_turn : float
        The change of omega, in rad/s, that is one turn of the delays.
    end : callable
        Frequency in rad/s past which nothing better than the best can be.
    meeting : callable
        The intervals of a span on which something better can be.
    likely : callable
        Of an array of frequencies, those next to which the best are likely.

    Yields
    ------
    float array, shape (n, 2)
        In rad/s.
    """
    first, around = min(end(), FIRST_TURNS * per_turn), _TURNS_AROUND
    yield meeting((0.0, first))
    while (last := end()) > first:
        intervals = meeting((first, last))
        many = float(np.diff(intervals).sum()) > 10.0 * around * per_turn
        if many:
            number = 2 + 400 // len(intervals)
            places = np.concatenate(
                [np.geomspace(low, high, number) for low, high in intervals]
            )
            at, reach = np.unique(likely(places)), around * per_turn
            spans = np.column_stack((at - reach, at + reach)).clip(first, last)
            intervals = np.concatenate([meeting((low, high)) for low, high in spans])
            around *= _WIDER
        yield intervals
        if not many:
            break


def clear_above(point: LoopAt, free_above: float) -> bool:
    """Whether no phases above a frequency take L to -1, for parameters of up to these sizes."""
    end = clear_from(point.loop, np.abs(point[1:]), -1.0, 0.0)
    if not np.isfinite(end):
        return False
    if end <= free_above:
        return True
    least = np.array([_TOUCHING, 0.0, 0.0, 0.0])
    nearest, _, complete = discs.free_margins(
        arms_of(point, free=True), free_above, end, least, np.zeros(4)
    )
    return bool(complete) and nearest[discs.MODULUS] == _TOUCHING


def count_at(point: LoopAt, free_above: float) -> int:
    """Count the unstable roots as `loop_count` does.

    It takes less time where no phases above the frequency `free_above`, in rad/s, matter.
    """
    if np.isfinite(free_above) and clear_above(point, free_above):
        count = _count_below(point, free_above)
        if count is not None:
            return count
    return loop_count(*point)


def _count_below(point: LoopAt, omega: float) -> int | None:
    """Count the unstable roots of a loop that no phases of the arms let cross past omega.

    D(s; c1, c2) is compared with D at a thousandth of c1 and c2, which takes little time. Past
    omega their ratio stays off the negative real axis, so that its argument goes back to zero
    from what it is at omega. The counts differ by what it gathers in all, over pi. None where
    rounding hides one of the two.
    """
    # Not zero: there L has other poles at s = 0, which a walk does not begin with.
    loop, c1, c2 = point
    low = LoopAt(loop, 1e-3 * c1, 1e-3 * c2)
    arguments, values = [], []
    for at in (point, low):
        begin, whole = walk_begins(*at), at.loop.sum_at(at.c1, at.c2)
        if begin is None or begin[0] >= omega:
            return None
        none = np.zeros(whole.sums.size)
        argument, value, clear = contour.winding(whole.compiled(), none, begin[0], omega)
        if not clear or np.isnan(argument):
            return None
        arguments.append(begin[1] + argument)
        values.append(value)
    turned = arguments[0] - arguments[1] - contour.angle_between(values[0], values[1])
    below = loop_count(*low)
    count = below - turned / math.pi
    return round(count) if below >= 0 and abs(count - round(count)) < 1e-3 else None


def require_stable(point: LoopAt, free_above: float = np.inf) -> None:
    """Raise unless all zeros of 1 + L lie in the open left half-plane."""
    count = count_at(point, free_above)
    if count != 0:
        raise ValueError(
            f"the loop must be stable at (c1, c2) = {point[1:]} to have margins, but "
            f"loop_count gives {count}"
        )
