"""Compiled: the disc that L fills at a frequency when the phases of the arms are free.

Whatever these phases are, L lies in that disc. (At low frequency the phase between the two
arms is taken as it is, and only their common one is free.) Bounds on how the parts of the disc
change certify that it stays off a target over a step of the axis. So `intervals_not_clear`
tells which parts of the axis need a walk. At high frequency, where the phases turn much faster
than anything else changes, this spares most of the work. `free_margins` finds the smallest
margins of the disc.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armlock.axis.compiled import njit
from armlock.axis.contour import MOST_STEPS
from armlock.axis.exponentials import EPSILON
from armlock.checks import ComplexArray, FloatArray, IntArray

# Turns of the longest delay after which the disc is tried again where it did not help.
_TURNS = 32.0
# The shortest step of `free_margins`, over omega.
_SHORTEST = 1e-12
# Where the disc may touch the unit circle it is taken for larger by this share. Roots closer to
# the axis than this, over omega, are not passed.
_GROWN = 1e-9

#: Places of the four margins in what `free_margins_at` returns, and in levels.
MODULUS, RATIO, PHASE, DELAY = 0, 1, 2, 3


@njit(cache=True)
def excluded_disc(value: float, m: int) -> tuple[float, float]:
    """Centre and radius of the disc in which the distance of L from -1 is below a value.

    The distance is |1 + L| where m is MODULUS, and |1 + L| / |1 - L| where it is RATIO. Level
    lines of the latter are the circles of Apollonius.
    """
    if m == MODULUS:
        return -1.0, value
    square = value * value
    return -(1.0 + square) / (1.0 - square), 2.0 * value / (1.0 - square)


class Arms(NamedTuple):
    """The responses F1 and F2 to the two arms, and what else decides the disc.

    Attributes
    ----------
    roots : complex array, shape (n,)
        Those of all factors of F1 and F2.
    powers : int array, shape (2, n)
        The power of each factor in F1 and in F2.
    leads : float array, shape (2,)
        The highest coefficients of F1 and F2.
    c1, c2 : float
        The perturbations. Where phases are free, only their magnitudes matter.
    apart : float
        tau2 - tau1 in s; nan where both phases are free at all frequencies.
    delay : float
        The dead time in s.
    """

    roots: ComplexArray
    powers: IntArray
    leads: FloatArray
    c1: float
    c2: float
    apart: float
    delay: float


class _Disc(NamedTuple):
    """What L fills at one frequency with free phases, and how it changes with omega.

    F is the larger one of the responses to the two arms, G the other one.

    Attributes
    ----------
    larger, other : complex
        F, and G / F.
    rate, bend : complex, float
        The rate at which log F changes, and a bound on its second derivative.
    other_rate, other_bend : complex, float
        The same two for log(G / F).
    held : complex
        The larger one's c; of free phases its magnitude.
    swung : complex
        c G / F of the other one, with the phase between the two; of free phases its magnitude.
    swing : complex
        The rate at which log(swung) changes.
    nearest : float
        The distance of the nearest root, up to which the bounds hold: within a step they are
        divided by 1 - step / nearest, because |log(1 + x) - x| <= |x|^2 / (2 (1 - |x|)). Where
        it is zero, the factor of that root is left out, and the disc is not that of L.
    """

    larger: complex
    other: complex
    rate: complex
    bend: float
    other_rate: complex
    other_bend: float
    held: complex
    swung: complex
    swing: complex
    nearest: float


class _Ahead(NamedTuple):
    """How the parts of a disc change over a step, which ends before the nearest root.

    Attributes
    ----------
    slope : float
        Of the radius over |F|, bounded from above.
    own : float
        How far F at the end over F at the start, or its inverse, may be from first order.
    left : float
        How far G / F, and the radius over |F|, may be from first order, together.
    turned : float
        How much log F changes at most, in magnitude and phase.
    changed : float
        How much G / F changes at most.
    """

    slope: float
    own: float
    left: float
    turned: float
    changed: float


@njit(cache=True)
def _disc(arms: Arms, omega: float) -> _Disc:
    """Return the disc that L fills at s = j omega, and how it changes with omega.

    L = F1 + F2 - c1 F1 exp(-s tau1) - c2 F2 exp(-s tau2), dead time included in F1 and F2. With
    the phases free it fills a disc around F1 + F2. Below omega |tau2 - tau1| = 1 the phase
    between the two arms is taken as it is; only their common one is free then.
    """
    roots, powers = arms.roots, arms.powers
    value1, value2 = complex(arms.leads[0]), complex(arms.leads[1])
    rate1, rate2, nearest = 0j, 0j, np.inf
    bend1, bend2, bend = 0.0, 0.0, 0.0
    for i in range(roots.size):
        away = 1j * omega - roots[i]
        square = away.real * away.real + away.imag * away.imag
        if square == 0.0:
            nearest = 0.0
            continue
        n1, n2 = powers[0, i], powers[1, i]
        # Powers alternate, so that the products neither overflow nor underflow on the way.
        for _ in range(n1):
            value1 *= away
        for _ in range(-n1):
            value1 /= away
        for _ in range(n2):
            value2 *= away
        for _ in range(-n2):
            value2 /= away
        rate = 1j * away.conjugate() / square
        rate1, rate2 = rate1 + n1 * rate, rate2 + n2 * rate
        bend1, bend2 = bend1 + abs(n1) / square, bend2 + abs(n2) / square
        bend += abs(n2 - n1) / square
        nearest = min(nearest, square)
    c1, c2, apart = arms.c1, arms.c2, arms.apart
    if abs(value1) < abs(value2):
        value1, value2, rate1, rate2 = value2, value1, rate2, rate1
        bend1, c1, c2, apart = bend2, c2, c1, -apart
    dead, other = np.exp(-1j * omega * arms.delay), value2 / value1 if value2 != 0.0 else 0j
    between = rate2 - rate1 if value2 != 0.0 else 0j
    held, swung, swing = complex(abs(c1)), complex(abs(c2 * other)), complex(between.real)
    if abs(apart) * omega < 1.0:
        held, swung = complex(c1), c2 * other * np.exp(-1j * omega * apart)
        swing = between - 1j * apart
    return _Disc(
        value1 * dead, other, rate1 - 1j * arms.delay, bend1, between, bend,
        held, swung, swing, np.sqrt(nearest),
    )  # fmt: skip


@njit(cache=True)
def _centre_and_radius(disc: _Disc) -> tuple[complex, float]:
    return disc.larger * (1.0 + disc.other), abs(disc.larger) * abs(disc.held + disc.swung)


@njit(cache=True)
def _rounding(disc: _Disc) -> float:
    """Bound on the rounding error of centre and radius, whose terms may cancel."""
    terms = 1.0 + abs(disc.other) + abs(disc.held) + abs(disc.swung)
    return float(64.0 * EPSILON * abs(disc.larger) * terms)


@njit(cache=True)
def _beyond_first_order(rate: complex, bend: float, step: float) -> float:
    """Bound on |exp(z) - 1 - rate step|, where |z - rate step| <= bend."""
    size = abs(rate) * step + bend
    return float(bend + 0.5 * size * size * np.exp(size))


@njit(cache=True)
def _ahead(disc: _Disc, step: float) -> _Ahead:
    """How the parts of a disc change over a step."""
    second = 0.5 * step * step / (1.0 - step / disc.nearest)
    # Up to higher orders |held + swung| is convex, and below its chord.
    there = disc.held + disc.swung + disc.swung * disc.swing * step
    slope = (abs(there) - abs(disc.held + disc.swung)) / step
    bend, other_bend = disc.bend * second, disc.other_bend * second
    own = _beyond_first_order(disc.rate, bend, step)
    left = abs(disc.other) * _beyond_first_order(disc.other_rate, other_bend, step)
    left += abs(disc.swung) * _beyond_first_order(disc.swing, other_bend, step)
    changed = abs(disc.other) * np.expm1(abs(disc.other_rate) * step + other_bend)
    return _Ahead(slope, own, left, abs(disc.rate) * step + bend, changed)


@njit(cache=True)
def _clear(disc: _Disc, ahead: _Ahead, step: float, target: complex, radius: float) -> bool:
    """Whether L stays outside a disc around `target` over a step, whatever the free phases.

    L and the disc around `target` are both divided by F(omega + t) / F(omega). To first order
    only G / F then moves the disc of L, and the other disc moves with 1 / F. What is beyond
    first order is subtracted from their distance. Besides,
    |v + v' t| is at least |v| (1 + t Re(v' / v)).
    """
    size = abs(disc.larger)
    centre, spread = _centre_and_radius(disc)
    away = centre - target
    distance = abs(away)
    if distance == 0.0:
        return False
    begin = distance - spread - radius
    change = disc.larger * disc.other * disc.other_rate + target * disc.rate
    total = (change * away.conjugate()).real / distance - size * ahead.slope
    total += radius * disc.rate.real
    beyond = (abs(target) + radius) * ahead.own + size * ahead.left
    rounding = _rounding(disc) + 64.0 * EPSILON * (abs(target) + radius)
    return bool(min(begin, begin + total * step) > beyond + rounding)


@njit(cache=True)
def _nothing_smaller(disc: _Disc, omega: float, step: float, levels: FloatArray) -> bool:
    """Whether no margin is below its level over a step, whatever the free phases.

    Levels of zero are not looked at.
    """
    ahead = _ahead(disc, step)
    for m in (MODULUS, RATIO):
        point, radius = excluded_disc(levels[m], m)
        if levels[m] > 0.0 and not _clear(disc, ahead, step, complex(point), radius):
            return False
    if levels[PHASE] <= 0.0 and levels[DELAY] <= 0.0:
        return True
    # There is no gain crossover if the disc stays outside the unit circle, or inside.
    if _clear(disc, ahead, step, 0j, 1.0):
        return True
    centre, spread = _centre_and_radius(disc)
    grown = ahead.changed + max(ahead.slope * step, 0.0) + ahead.left
    if (abs(centre) + spread + abs(disc.larger) * grown) * np.exp(ahead.turned) < 1.0:
        return True
    lead = min(levels[PHASE], np.pi)
    lag = max(lead, levels[DELAY] * (omega + step))
    if lead + lag >= 2.0 * np.pi:
        return False
    # What the disc covers of the circle is an arc around the direction of its centre. It may
    # come to the arc that holds smaller margins over an end of that, or by turning there.
    for end in (-np.exp(-1j * lead), -np.exp(1j * lag)):
        if not _clear(disc, ahead, step, end, 0.0):
            return False
    if ahead.changed >= abs(1.0 + disc.other):
        return False
    own = np.arctan2(-centre.imag, -centre.real) % (2.0 * np.pi)
    turned = ahead.turned + np.arcsin(ahead.changed / abs(1.0 + disc.other))
    return bool(min(own - lag, 2.0 * np.pi - lead - own) > turned)


@njit(cache=True)
def _on_one_side(disc: _Disc, ahead: _Ahead, step: float) -> bool:
    """Whether L stays on one side of the real axis over a step, whatever the free phases.

    Both are divided by F(omega + t) / F(omega). The axis then turns by minus the phase that F
    gains.
    """
    size = abs(disc.larger)
    centre, spread = _centre_and_radius(disc)
    normal = 1j if centre.imag > 0.0 else -1j
    begin = abs(centre.imag) - spread
    change = disc.larger * disc.other * disc.other_rate + 1j * centre * disc.rate.imag
    total = (change * normal.conjugate()).real - size * ahead.slope
    beyond = abs(centre) * ahead.own + size * (ahead.left + ahead.changed * ahead.turned)
    return bool(min(begin, begin + total * step) > beyond + _rounding(disc))


@njit(cache=True)
def _misses_segment(disc: _Disc, step: float, near: float, far: float) -> bool:
    """Whether L stays off a segment of the negative real axis, whatever the free phases.

    It does if it stays off the axis, off the disc around the segment, or off the end that is
    nearest to its centre.
    """
    ahead = _ahead(disc, step)
    if _on_one_side(disc, ahead, step):
        return True
    if _clear(disc, ahead, step, complex(0.5 * (near + far)), 0.5 * (near - far)):
        return True
    centre = _centre_and_radius(disc)[0]
    moved = abs(centre) * np.expm1(ahead.turned)
    moved += abs(disc.larger) * ahead.changed * np.exp(ahead.turned)
    if centre.real - moved > near:
        return bool(_clear(disc, ahead, step, complex(near), 0.0))
    if centre.real + moved < far:
        return bool(_clear(disc, ahead, step, complex(far), 0.0))
    return False


@njit(cache=True)
def intervals_not_clear(
    arms: Arms,
    segment: FloatArray,
    levels: FloatArray,
    span: tuple[float, float],
    per_turn: float,
) -> FloatArray:
    """Intervals, shape (n, 2), of a span of the axis outside which L stays off a target.

    The target is a segment of the negative real axis, given by its nearer and its farther end;
    or, where that is empty, all that has margins below `levels`.
    """
    found, number = np.empty((64, 2)), 0
    omega, omega_end = span
    step = omega_end
    while omega < omega_end:
        # Next to zero whole turns are too long.
        shortest = max(min(_TURNS * per_turn, 0.03 * omega), 3e-4 * omega, 1e-3 * per_turn)
        disc = _disc(arms, omega)
        step = min(4.0 * step, 0.5 * disc.nearest, omega_end - omega)
        clear = False
        while step > shortest and not clear:
            if segment.size:
                clear = _misses_segment(disc, step, segment[0], segment[1])
            else:
                clear = _nothing_smaller(disc, omega, step, levels)
            if not clear:
                step *= 0.5
        step = step if clear else shortest
        end = min(omega + step, omega_end)
        if not clear and number and found[number - 1, 1] == omega:
            found[number - 1, 1] = end
        elif not clear:
            if number == found.shape[0]:
                found = np.concatenate((found, np.empty_like(found)))
            found[number, 0], found[number, 1] = omega, end
            number += 1
        omega = end
    return found[:number]


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
    # w = (1 + L) / (1 - L) takes the disc to another one, or to the outside of one. In both
    # cases this is the distance of the image from zero.
    under = abs((1.0 + centre) * (1.0 - centre).conjugate() + radius**2) + 2.0 * radius
    if under > 0.0:
        found[RATIO] = modulus * (abs(1.0 + centre) + radius) / under
    size = abs(centre)
    if abs(size - 1.0) <= radius:
        # The centre is not zero: a disc around it that meets the circle holds -1.
        half = np.arccos(min(max((1.0 + size**2 - radius**2) / (2.0 * size), -1.0), 1.0))
        angle = np.arctan2(centre.imag, centre.real)
        lag = (angle - half + np.pi) % (2.0 * np.pi)
        lead = (np.pi - angle - half) % (2.0 * np.pi)
        found[PHASE], found[DELAY] = min(lag, lead), lag / omega
    return found


@njit(cache=True)
def free_margins_over(arms: Arms, omega: FloatArray) -> FloatArray:
    """Smallest margins of the disc that L fills with free phases, at given frequencies.

    A row of `free_margins_at` for each; inf at a root.
    """
    found = np.full((omega.size, 4), np.inf)
    for i, w in enumerate(omega):
        disc = _disc(arms, w)
        if disc.nearest > 0.0:
            centre, radius = _centre_and_radius(disc)
            found[i] = free_margins_at(centre, radius, w)
    return found


@njit(cache=True)
def _longest_step(disc: _Disc, omega: float, step: float, levels: FloatArray) -> float:
    """Longest of step, step / 2, ... over which no margin is below its level, or 0."""
    while step > _SHORTEST * omega:
        if _nothing_smaller(disc, omega, step, levels):
            return step
        step *= 0.5
    return 0.0


@njit(cache=True)
def _keep_smaller(best: FloatArray, where: FloatArray, here: FloatArray, omega: float) -> bool:
    """Put margins that are smaller than `best` into it, and omega into `where`; if any is."""
    smaller = False
    for m in range(4):
        if here[m] < best[m]:
            best[m], where[m], smaller = here[m], omega, True
    return smaller


@njit(cache=True)
def free_margins(
    arms: Arms, omega: float, omega_end: float, best: FloatArray, tolerance: FloatArray
) -> tuple[FloatArray, FloatArray, bool]:
    """Smallest margins of the disc that L fills with free phases, from omega to `omega_end`.

    `best` holds values that are known to occur, or inf. Returns the smallest values, where they
    were met (nan for those of `best`), and whether the walk came to its end, which it does not
    if it is too long, or a root lies on the axis. None is smaller than the result by more than
    its share `tolerance`. Where the disc only touches the unit circle, phase and delay may be
    those of a disc that is larger by a part in 1e9.
    """
    best, where = best.copy(), np.full(4, np.nan)
    step = omega_end
    for _ in range(MOST_STEPS // 8):
        disc = _disc(arms, omega)
        if disc.nearest <= _GROWN * omega:
            break
        centre, radius = _centre_and_radius(disc)
        here = free_margins_at(centre, radius, omega)
        falls = _keep_smaller(best, where, here, omega) or (where > omega).any()
        if best[MODULUS] == 0.0:
            # Some phases take L to -1.
            return best, where, True
        step = min(2.0 * step, 0.5 * disc.nearest, omega_end - omega)
        while falls and step > _SHORTEST * omega:
            # On the way down steps would get ever shorter without a look ahead.
            if _nothing_smaller(disc, omega, step, (1.0 - tolerance) * best):
                break
            here = free_margins_over(arms, np.array([omega + step]))[0]
            _keep_smaller(best, where, here, omega + step)
            step *= 0.5
        step = _longest_step(disc, omega, step, (1.0 - tolerance) * best)
        if step == 0.0:
            # The disc may touch the unit circle next to here. It then covers a short arc of it,
            # and a little later a longer one.
            here = free_margins_at(centre, radius + _GROWN * (abs(centre) + radius), omega)
            here[MODULUS], here[RATIO] = np.inf, np.inf
            _keep_smaller(best, where, here, omega)
            step = min(_GROWN * omega, 0.5 * disc.nearest)
            step = _longest_step(disc, omega, step, (1.0 - tolerance) * best)
        if step == 0.0:
            # Over the shortest step only the distances are left to be certified.
            step, levels = _SHORTEST * omega, (1.0 - tolerance) * best
            levels[PHASE], levels[DELAY] = 0.0, 0.0
            if not _nothing_smaller(disc, omega, step, levels):
                break
        if omega + step >= omega_end * (1.0 - 1e-15):
            return best, where, True
        omega += step
    return best, where, False
