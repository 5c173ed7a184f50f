"""How far a loop is from instability: margins, and the first perturbation that breaks it.

No grid enters a number. Distances from -1 come from `armlock.robustness.distances`, phase and
delay margins from `armlock.robustness.crossovers`, the gain interval from
`armlock.robustness.gains`. Each walk ends at a frequency past which nothing smaller is
possible. At high frequency the limit is known in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, positive_number
from armlock.loops import Loop, LoopAt, checked_loop
from armlock.robustness import discs
from armlock.robustness.crossovers import crossovers_end, phase_and_delay
from armlock.robustness.distances import smallest_distances
from armlock.robustness.free_phases import (
    arms_of,
    limit_margins,
    no_margin,
    no_smaller_from,
    require_stable,
)
from armlock.robustness.gains import gain_interval_of_stable
from armlock.robustness.rays import FARTHEST, Ray
from armlock.stability.counts import BOUNDARY, UNCONFINED, CountError, loop_count

# Relative accuracy with free phases, in the order of
# `armlock.robustness.discs.free_margins_at`. The disk margin may be flat over decades of
# frequency, where a finer one would take too long.
_FREE_TOLERANCES = np.array([1e-5, 1e-4, 1e-5, 1e-5])


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
    (modulus, _), _ = smallest_distances(LoopAt.of(loop, c1, c2), disk=False)
    return float(modulus)


def _free_margins(
    point: LoopAt, lowest: float, known: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Margins over all phases of the two arms, from a frequency on, and where they are met.

    In the order of `armlock.robustness.discs.free_margins_at`; only those below `known` are
    looked for. A coarse sample gives values that occur. The certified walk then steps over what
    cannot hold smaller ones.
    """
    limit, weights = limit_margins(point), np.abs(point[1:])
    end = crossovers_end(point, weights, float(limit[discs.PHASE]))
    end = max(end, 2.0 * lowest)
    arms = arms_of(point, free=True)
    # The smallest distances may lie past the last crossover, where L turns most.
    omega = np.geomspace(lowest, 10.0 * end, 300)
    sampled = discs.free_margins_over(arms, omega)
    nearest, least = omega[np.argmin(sampled, axis=0)], sampled.min(axis=0)
    known = np.minimum(limit, known)
    best, where = np.minimum(known, least), np.where(least < known, nearest, np.inf)
    # Past it no distance is smaller, either.
    end = max(end, no_smaller_from(point.loop, weights, (1.0 - _FREE_TOLERANCES) * best))
    smaller, places, complete = discs.free_margins(arms, lowest, end, best, _FREE_TOLERANCES)
    if not complete:
        why = "take too many steps, or meet a root on the imaginary axis"
        raise no_margin(point, f"free phases from {lowest} rad/s on {why}")
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
        If gain times delay is too large to follow, or rounding hides what decides; with free
        phases also if a root of the controller or the sensor lies on the imaginary axis above
        that frequency.

    Notes
    -----
    Stable are the zeros of 1 + L. A root at s = 0 that D has because numerator and denominator
    of L cancel, as at the ideal point of a loop with an integrator, is none of them.

    Phase and delay margins are taken over all crossovers. A neutral loop may have crossovers
    without end; they then approach those of the disc below, and the phase margin is certified
    to a part in a million.

    With free phases, L fills a disc: with the sensor's weights m1 and m2

    .. math::

        \left| L - K e^{-s\delta} (m_1 + m_2) \right|
        \le |K| \left( |c_1 m_1| + |c_2 m_2| \right) .

    The distances from -1 of this disc, and of its share of the unit circle, are known in
    closed form at each frequency; their minima over frequency are certified to 1e-5, the disk
    margin to 1e-4. Where the disc only touches the unit circle, phase and delay may be those
    of a disc that is larger by a part in 1e9. A disc that holds -1 has margins of zero. A gain
    interval is not given: the edge of such a disc may run along the real axis.
    With equal weights m and c1 = c2 = 1 the disc has the centre 2 K m exp(-s delay), and a
    radius of the same magnitude: it stays clear of -1, for arms of any lengths, where
    Re [K m exp(-s delay)] > -1/4.

    Examples
    --------
    >>> import math
    >>> from armlock import margins, paper_loop
    >>> print(f"{math.degrees(margins(paper_loop()).phase):.1f} degrees")
    36.0 degrees
    """
    point = LoopAt.of(loop, c1, c2)
    highest = np.inf if free_above is None else positive_number("free_above", free_above)
    require_stable(point, highest)
    (modulus, ratio), (modulus_omega, _) = smallest_distances(point, disk=True, highest=highest)
    phase, delay, phase_omega = phase_and_delay(point, highest)
    if free_above is None:
        lower, upper, gain_omega = gain_interval_of_stable(point)
    else:
        lower, upper, gain_omega = np.nan, np.nan, np.nan
        known = np.array([modulus, ratio, phase, delay])
        free, where = _free_margins(point, highest, known)
        if free[discs.MODULUS] < modulus:
            modulus, modulus_omega = free[discs.MODULUS], where[discs.MODULUS]
        if free[discs.PHASE] < phase:
            phase, phase_omega = free[discs.PHASE], where[discs.PHASE]
        ratio, delay = min(ratio, free[discs.RATIO]), min(delay, free[discs.DELAY])
    return Margins(
        gain_lower=lower,
        gain_upper=upper,
        phase=float(phase),
        delay=float(delay),
        modulus=float(modulus),
        disk=2.0 * float(ratio),
        gain_omega=gain_omega,
        phase_omega=float(phase_omega),
        modulus_omega=float(modulus_omega),
    )


def critical_perturbation(loop: Loop, direction: npt.ArrayLike) -> float:
    r"""Return the smallest perturbation of (1, 1) in a direction that breaks the loop.

    Parameters
    ----------
    loop : Loop
        The loop.
    direction : array_like of two floats
        (d1, d2), taken as given and not normalised.

    Returns
    -------
    float
        Smallest eps > 0 such that the count of the loop's unstable roots at (1, 1) +
        eps (d1, d2), `armlock.stability.counts.loop_count`, is not zero: a root reaches the
        imaginary axis there, or the neutral root chain does. 0 if the loop is not stable next
        to (1, 1), inf if no eps breaks it, up to parameters of 1e9. How near to the limit of
        the chain roots are followed, `armlock.robustness.rays.first_crossing` says.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, the direction is not two finite real numbers or has length
        zero, or the loop is unstable at (1, 1) itself. A boundary point is allowed there.
    CountError
        If the counts on the two sides of the result contradict it, or gain times delay is too
        large to follow.

    See Also
    --------
    armlock.robustness.rays.first_crossing : from other points, and with the frequency.

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

    def count(t: float) -> int:
        """Count at a point of the ray, not rounded: what cancels along it does so there."""
        c1, c2 = (1 + Fraction(t) * Fraction(d) for d in ray.direction.tolist())
        return loop_count(loop, c1, c2)

    at_start = count(0.0)
    if at_start > 0 or at_start == UNCONFINED:
        raise ValueError(
            f"the loop must be stable at (c1, c2) = (1, 1) to lose stability, but "
            f"loop_count gives {at_start}"
        )
    # From there a root at s = 0 that cancels at (1, 1) may turn into the loop's own.
    may_leave_zero = at_start != 0 or LoopAt(loop, 1.0, 1.0).at_zero()[0] > 0
    if may_leave_zero and count(1e-9 * ray.scale) != 0:
        return 0.0
    farthest = FARTHEST * ray.scale
    eps = ray.first(farthest).position
    if eps < np.inf:
        # So close to the result, rounding may hide on which side of the boundary a point is.
        counts = [count(share * eps) for share in (0.5, 1.0 - 1e-6, 1.0 + 1e-6)]
        agree = counts[0] == 0 and counts[1] in (0, BOUNDARY) and counts[2] != 0
    else:
        counts = [count(0.5 * farthest)] if ray.acts() else []
        agree = not any(counts)
    if not agree:
        raise CountError(
            f"the first crossing along {tuple(ray.direction.tolist())} lies at {eps}, but "
            f"counts on the way there and past it contradict it: {counts}",
            np.array([ray.at(min(eps, farthest))]),
        )
    return eps
