"""How far a loop is from instability: margins, and the first perturbation that breaks it.

Every minimum is taken over frequencies between which the loop's response is known to be
nearly straight, and every crossing is found with certified steps, so that no grid of the
user's enters a number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly
from scipy.optimize import brentq, minimize_scalar

from armlock.characteristic import ExponentialSum
from armlock.checks import ComplexArray, FloatArray, axis, real_number
from armlock.controllers import Controller
from armlock.loops import Loop, checked_loop
from armlock.nyquist import loop_numerator, reach, resolving_grid
from armlock.rays import Ray
from armlock.stability import (
    BOUNDARY,
    CountError,
    last_crossing,
    sign_changes,
    unstable_roots,
)

# Closer than 1e-6 to the limit of a chain the first crossing is looked for up to so many turns
# of the longest delay, about a tenth of a second.
_TURNS_BELOW_CHAIN = 50_000


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
        \text{disk} &= 2 \inf_\omega \frac{|1 + L|}{|1 - L|}

    with L at s = j omega.

    Attributes
    ----------
    gain_lower, gain_upper : float
        The loop stays stable for every gain factor between the two; 0 and inf where nothing
        between factors of 1e-6 and 1e6 bounds it.
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
        Symmetric disk margin: 2 min |1 + L| / |1 - L|.
    gain_omega, phase_omega, modulus_omega : float
        Where the upper gain margin, the phase margin and the modulus margin are taken, in
        rad/s; nan where there is none.

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


def _require_stable(loop: Loop, c1: float, c2: float) -> None:
    """Raise unless 1 + L has all its zeros in the open left half-plane."""
    count = int(unstable_roots(loop, c1, c2))
    if count != 0:
        raise ValueError(
            f"the loop must be stable at (c1, c2) = ({c1}, {c2}) to have margins, but "
            f"unstable_roots gives {count}"
        )


def _tail_end(loop: Loop, c1: float, c2: float, level: float) -> float:
    """Frequency past which |L| < `level`, or past which a neutral L has settled."""
    end = float(last_crossing(loop, c1, c2))
    if not loop.neutral:
        return max(2.0 * end, reach(loop, c1, c2, level), 10.0 / loop.longest_delay)
    period = 2.0 * np.pi / max(abs(loop.tau1 - loop.tau2), 1e-3 * loop.longest_delay)
    return max(4.0 * end, 4.25 * period)


def _at_infinity(loop: Loop, c1: float, c2: float) -> tuple[float, float]:
    """Infima of |1 + L| and of |1 + L| / |1 - L| as omega goes to infinity."""
    if not loop.neutral:
        return 1.0, 1.0

    _, b1, b2 = loop.highest_coefficients
    open_lead = float(loop.rest[-1])
    # L fills the disk b1 (1 - c1 u) + b2 (1 - c2 v), |u| = |v| = 1, divided by open_lead.
    centre, radius = (b1 + b2) / open_lead, (abs(c1 * b1) + abs(c2 * b2)) / abs(open_lead)
    angles = np.exp(1j * np.linspace(0.0, np.pi, 4001))
    edge = centre + radius * angles
    closest = max(abs(1.0 + centre) - radius, 0.0)
    return closest, float(np.min(np.abs(1.0 + edge) / np.maximum(np.abs(1.0 - edge), 1e-300)))


def _smallest(
    distance: Callable[[FloatArray], FloatArray], grid: FloatArray
) -> tuple[float, float]:
    """Minimum over omega > 0 of a function that the grid resolves; and where."""
    values = distance(grid)
    inner = (values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:])
    candidates = np.flatnonzero(inner) + 1
    candidates = candidates[values[candidates] <= 1.5 * values.min()]
    best = int(np.argmin(values))
    found = [(float(values[best]), float(grid[best]))]
    for k in candidates[np.argsort(values[candidates])][:200]:
        low, width = float(grid[k - 1]), float(grid[k + 1] - grid[k - 1])

        # Over the share of the bracket, because the optimizer's accuracy is relative.
        def along(share: float, low: float = low, width: float = width) -> float:
            return float(distance(np.array([low + share * width]))[0])

        result = minimize_scalar(
            along, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-9}
        )
        found.append((float(result.fun), low + float(result.x) * width))
    return min(found)


def _grid(loop: Loop, c1: float, c2: float) -> FloatArray:
    """Frequencies that resolve 1 + L and 1 - L, up to where the tail cannot matter."""
    plus, below = loop.at(c1, c2), loop.rest_on_boundary()
    minus = below.scaled(2.0).plus(plus.scaled(-1.0))
    for level in (0.9, 0.5, 0.1, 0.01, 0.001):
        grid = resolving_grid((plus, minus, below), _tail_end(loop, c1, c2, level))
        # In place of omega = 0, where L may have a pole.
        grid[0] = 1e-6 * grid[1]
        response = loop.open_loop(1j * grid, c1, c2)
        away, across = np.abs(1.0 + response).min(), _ratio(response).min()
        if loop.neutral or (away <= 1.0 - level and across <= (1.0 - level) / (1.0 + level)):
            break
    return grid


def _ratio(response: ComplexArray) -> FloatArray:
    """Return |1 + L| / |1 - L|."""
    return np.asarray(np.abs(1.0 + response) / np.maximum(np.abs(1.0 - response), 1e-300))


def _modulus(loop: Loop, c1: float, c2: float, grid: FloatArray) -> tuple[float, float]:
    """Smallest |1 + L| and where."""

    def distance(omega: FloatArray) -> FloatArray:
        return np.abs(1.0 + loop.open_loop(1j * omega, c1, c2))

    value, omega = _smallest(distance, grid)
    limit, _ = _at_infinity(loop, c1, c2)
    return (value, omega) if value <= limit else (limit, np.inf)


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
        The infimum over all omega > 0, the limit at high frequency included. For a neutral
        loop that limit is taken over all small changes of the two delays.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or c1 or c2 is not finite and real.
    CountError
        If the chain of a neutral loop is not confined, or gain times delay is too large to
        follow.

    Examples
    --------
    >>> from armlock import modulus_margin, paper_loop
    >>> print(f"{modulus_margin(paper_loop()):.4f}")
    0.6156
    """
    checked_loop(loop)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    _require_confined(loop, c1, c2)
    return _modulus(loop, c1, c2, _grid(loop, c1, c2))[0]


def _require_confined(loop: Loop, c1: float, c2: float) -> None:
    """Raise where a neutral loop's chain of roots is not confined."""
    end = float(last_crossing(loop, c1, c2))
    if np.isnan(end):
        raise CountError(
            f"no margin at (c1, c2) = ({c1}, {c2}): a number overflows", np.array([[c1, c2]])
        )
    if end == np.inf:
        raise CountError(
            f"no margin at (c1, c2) = ({c1}, {c2}): the loop's high-frequency chain of roots "
            f"is not confined to the left half-plane",
            np.array([[c1, c2]]),
        )


def _crossovers(loop: Loop, c1: float, c2: float, end: float) -> FloatArray:
    """Frequencies with |L| = 1, ascending."""
    above = loop_numerator(loop, c1, c2)
    below = loop.rest_on_boundary()
    excess = above.times_conjugate(above).plus(below.times_conjugate(below).scaled(-1.0))
    # sign_changes looks at the imaginary part.
    turned = ExponentialSum(1j * excess.coefficients, excess.phases, 1j * excess.sums)
    omega, jump = sign_changes(turned, end)
    omega = omega[(omega > 0.0) & (jump != 0)]

    def excess_at(u: float) -> float:
        return float(np.log(np.abs(loop.open_loop(1j * np.exp(u), c1, c2))))

    polished = []
    for w in omega:
        low, high = np.log(w) - 1e-6, np.log(w) + 1e-6
        if excess_at(low) * excess_at(high) < 0.0:
            w = np.exp(brentq(excess_at, low, high, xtol=1e-14, rtol=1e-14))
        polished.append(float(w))
    return np.array(polished)


def _scaled(loop: Loop, factor: float) -> Loop:
    """Return the loop with its gain multiplied by a factor."""
    controller = loop.controller
    return Loop(
        Controller(controller.zeros, controller.poles, controller.gain * factor),
        loop.mapping,
        loop.tau1,
        loop.tau2,
    )


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
        The two factors, 0 and inf if unbounded, and where the upper one is taken, in rad/s.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or c1 or c2 is not finite and real, or the loop is not stable
        there.
    CountError
        If gain times delay is too large to follow.

    Notes
    -----
    With a factor k, and L = N / R, a root is at s = j omega where

    .. math::

        R + k N = 0 , \qquad k = -\frac{1}{L} \text{ is real.}

    The chain of a neutral loop bounds the gain, too.

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
    crossing = loop_numerator(loop, c1, c2).times_conjugate(loop.rest_on_boundary())
    lower, upper, where = 0.0, np.inf, np.nan
    floor, limit = _chain_gains(loop, c1, c2) if loop.neutral else (0.0, np.inf)
    # A real root crosses at s = 0.
    start, first = loop_numerator(loop, c1, c2).sums[0].real, float(loop.rest[0])
    at_zero = [-first / start] if start * first < 0.0 else []
    for top in 10.0 ** np.arange(1.0, 7.0):
        factors = np.concatenate((np.geomspace(1e-6, 1.0, 13), np.geomspace(1.0, top, 13)))
        if np.isfinite(limit):
            # Just below the limit of the chain, roots cross at ever higher frequency.
            factors = np.append(factors, limit * np.array([0.99, 1.0 - 1e-4, 1.0 - 1e-6]))
        factors = np.append(factors, floor * np.array([1.01, 1.0 + 1e-4, 1.0 + 1e-6]))
        # Beyond its limits the chain is lost all the same.
        factors = factors[(factors > floor) & (factors < limit)]
        ends = np.array([float(last_crossing(_scaled(loop, k), c1, c2)) for k in factors])
        omega, jump = sign_changes(crossing, float(ends[~np.isposinf(ends)].max()))
        omega = omega[(omega > 0.0) & (jump != 0)]
        value = loop.open_loop(1j * omega, c1, c2).real
        factor = np.concatenate((at_zero, -1.0 / value[value < 0.0]))
        place = np.concatenate((np.zeros(len(at_zero)), omega[value < 0.0]))
        lower = max([floor, *factor[factor < 1.0]])
        if (factor > 1.0).any():
            best = int(np.argmin(np.where(factor > 1.0, factor, np.inf)))
            upper, where = float(factor[best]), float(place[best])
        if limit < upper:
            upper, where = limit, np.inf
        if upper <= top:
            break
    return float(lower), float(upper), where


def _chain_gains(loop: Loop, c1: float, c2: float) -> tuple[float, float]:
    r"""Gain factors around one between which the chain of a neutral loop is confined.

    With r, b1 and b2 the highest coefficients of R, B1 and B2, and a factor k, where

    .. math::

        |r + k (b_1 + b_2)| > k \left( |c_1 b_1| + |c_2 b_2| \right) .
    """
    _, b1, b2 = loop.highest_coefficients
    open_lead = float(loop.rest[-1])
    # Relative to r, so that the left-hand side is |1 + k sum|.
    together, apart = (b1 + b2) / open_lead, (abs(c1 * b1) + abs(c2 * b2)) / abs(open_lead)
    # 1 + k sum = k spread, and -(1 + k sum) = k spread.
    limits = [1.0 / rate for rate in (apart - together, -together - apart) if rate > 0.0]
    lower = max((k for k in limits if k < 1.0), default=0.0)
    return lower, min((k for k in limits if k > 1.0), default=np.inf)


def margins(loop: Loop, c1: float = 1.0, c2: float = 1.0) -> Margins:
    """Compute all margins of a stable loop.

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float, optional
        Multiplicative perturbations.

    Returns
    -------
    Margins

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, c1 or c2 is not finite and real, or the loop is not stable
        there.
    CountError
        If gain times delay is too large to follow.

    Notes
    -----
    Phase and delay margins are taken over the crossovers up to the frequency past which L
    has settled to its limit; a neutral loop has crossovers without end.

    Examples
    --------
    >>> import math
    >>> from armlock import margins, paper_loop
    >>> print(f"{math.degrees(margins(paper_loop()).phase):.1f} degrees")
    36.0 degrees
    """
    checked_loop(loop)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    _require_stable(loop, c1, c2)
    grid = _grid(loop, c1, c2)
    modulus, modulus_omega = _modulus(loop, c1, c2, grid)

    def ratio(omega: FloatArray) -> FloatArray:
        return _ratio(loop.open_loop(1j * omega, c1, c2))

    disk = 2.0 * min(_smallest(ratio, grid)[0], _at_infinity(loop, c1, c2)[1])
    omega = _crossovers(loop, c1, c2, float(grid[-1]))
    phase, delay, phase_omega = np.inf, np.inf, np.nan
    if omega.size:
        lag = np.mod(np.angle(loop.open_loop(1j * omega, c1, c2)) + np.pi, 2.0 * np.pi)
        # A lag turns L clockwise; a lead may reach -1 sooner.
        nearest = np.minimum(lag, 2.0 * np.pi - lag)
        worst = int(np.argmin(nearest))
        phase, phase_omega = float(nearest[worst]), float(omega[worst])
        delay = float(np.min(lag / omega))
    if loop.neutral:
        # With a delay of its own, L enters the chain with all its parts in any phase.
        _, b1, b2 = loop.highest_coefficients
        if abs(b1 + b2) + abs(c1 * b1) + abs(c2 * b2) >= abs(float(loop.rest[-1])):
            delay = 0.0
    lower, upper, gain_omega = gain_interval(loop, c1, c2)
    return Margins(
        lower, upper, phase, delay, modulus, disk, gain_omega, phase_omega, modulus_omega
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
        Smallest eps > 0 such that the loop at (1, 1) + eps (d1, d2) is not stable: a root
        reaches the imaginary axis there, or a neutral loop's high-frequency chain does. 0 if
        it is not stable from the start on, inf if no eps breaks it: that is, if the direction
        has no effect.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, or the direction is not two finite real numbers, has length
        zero, or is so long or short that the result is no ordinary float.
    ValueError
        If the loop is unstable at (1, 1) itself.
    CountError
        If the counts on the two sides of the result contradict it, or gain times delay is too
        large to follow.

    Notes
    -----
    Along the ray D is affine in eps, and a root is at s = j omega where

    .. math::

        \varepsilon = \frac{D(s; 1, 1)}
        {d_1 B_1 e^{-s\tau_1} + d_2 B_2 e^{-s\tau_2}} \text{ is real.}

    These frequencies are found with certified steps, up to ever larger eps: in a direction
    with an effect the delayed terms end up larger than all others, and break the loop.

    Below the limit of a chain roots cross at ever higher frequency. Where the first of them
    crosses closer to the limit than 1e-6 of it, and at more than 50 000 turns of the longest
    delay, the limit is returned instead.

    Examples
    --------
    >>> from armlock import critical_perturbation, paper_loop
    >>> print(f"{critical_perturbation(paper_loop(), (0, -1)):.4e}")
    2.9286e-06
    """
    checked_loop(loop)
    vector = axis("direction", direction)
    if vector.size != 2:
        raise ValueError(f"direction must hold two numbers, got {vector.size}")
    if not vector.any():
        raise ValueError("direction must not have length zero, got (0, 0)")
    start = int(unstable_roots(loop, 1.0, 1.0))
    if start not in (0, BOUNDARY):
        raise ValueError(
            f"the loop must be stable at (1, 1) to lose stability, but unstable_roots gives "
            f"{start} there"
        )
    # Components without effect would hide the size of the others.
    vector = np.where([loop.b1.any(), loop.b2.any()], vector, 0.0)
    if _without_effect(loop, vector):
        return np.inf if start == 0 else 0.0
    # By a power of two, which rounds nothing.
    exponent = int(np.frexp(np.abs(vector).max())[1])
    eps = _critical(loop, start, *(float(part) for part in np.ldexp(vector, -exponent)))
    with np.errstate(over="ignore", under="ignore"):
        found = float(np.ldexp(eps, -exponent))
    if eps != 0.0 and not np.finfo(float).tiny <= found < np.inf:
        raise ValueError(
            f"direction must be of a size for which the result is a float, got "
            f"{tuple(vector.tolist())}: it is {eps} times 2**{-exponent}"
        )
    return found


def _without_effect(loop: Loop, vector: FloatArray) -> bool:
    """Whether D stays what it is along a direction."""
    if loop.tau1 != loop.tau2 or not vector.any():
        return not vector.any()
    share1, share2 = vector / np.abs(vector).max()
    return not poly.polyadd(share1 * loop.b1, share2 * loop.b2).any()


def _critical(loop: Loop, start: int, d1: float, d2: float) -> float:
    """`critical_perturbation` for a direction of ordinary size that acts on the loop."""
    scale = 1.0 / float(np.hypot(d1, d2))
    nearby = scale * 1e-9
    if start == BOUNDARY and int(unstable_roots(loop, 1.0 + nearby * d1, 1.0 + nearby * d2)):
        return 0.0
    ray = Ray(loop, (1.0, 1.0), (d1, d2))
    chain = _chain_limit(loop, d1, d2)
    reaches = scale * 10.0 ** np.array([-8.0, -6.0, -4.0, -2.0, *np.arange(0.0, 150.0)])
    # Just below the limit of the chain, roots cross at ever higher frequency.
    closer = chain * (1.0 - np.array([1e-2, 1e-4, 1e-6, 1e-8, 1e-10]))
    for top in [*reaches[reaches < closer[0]], *closer[np.isfinite(closer)]]:
        turns = ray.end(float(top)) * loop.longest_delay / (2.0 * np.pi)
        if top > closer[2] and turns > _TURNS_BELOW_CHAIN:
            break
        # A boundary at (1, 1) itself, at the lower bound, is not a crossing beyond it.
        found = ray.crossings(float(top), first=True, lowest=1e-15 * scale)
        if found.position.size:
            return _confirmed(loop, d1, d2, float(found.position[0]))
    if np.isfinite(chain):
        return _confirmed(loop, d1, d2, chain)
    # What acts on a loop with delays breaks it once it is large enough.
    raise CountError(
        f"no crossing up to {reaches[-1]} along ({d1}, {d2})", np.array([[d1, d2]])
    )


def _chain_limit(loop: Loop, d1: float, d2: float) -> float:
    """Smallest eps > 0 at which the chain of a neutral loop ceases to be confined."""
    if not loop.neutral:
        return np.inf

    a, b1, b2 = (abs(value) for value in loop.highest_coefficients)

    def spare(eps: float) -> float:
        return a - abs(1.0 + eps * d1) * b1 - abs(1.0 + eps * d2) * b2

    # Piecewise linear and concave: one zero beyond the last kink.
    kinks = [0.0, *(-1.0 / d for d in (d1, d2) if d < 0.0)]
    slope = -(abs(d1) * b1 + abs(d2) * b2)
    candidates = []
    for low, high in zip(sorted(kinks), [*sorted(kinks)[1:], np.inf], strict=True):
        if spare(low) > 0.0 and np.isfinite(high) and spare(high) <= 0.0:
            candidates.append(brentq(spare, low, high, xtol=1e-300, rtol=1e-15))
        elif spare(low) > 0.0 and not np.isfinite(high) and slope < 0.0:
            candidates.append(low - spare(low) / slope)
    return min(candidates, default=np.inf if spare(0.0) > 0.0 else 0.0)


def _confirmed(loop: Loop, d1: float, d2: float, eps: float) -> float:
    """Hold a critical perturbation against counts on its two sides."""
    before = int(unstable_roots(loop, 1.0 + 0.5 * eps * d1, 1.0 + 0.5 * eps * d2))
    if before != 0:
        raise CountError(
            f"stability along ({d1}, {d2}) is lost before {eps}, where no crossing was found",
            np.array([[1.0 + 0.5 * eps * d1, 1.0 + 0.5 * eps * d2]]),
        )
    beyond = 1.0 + 1e-6
    after = int(unstable_roots(loop, 1.0 + beyond * eps * d1, 1.0 + beyond * eps * d2))
    if after == 0:
        raise CountError(
            f"the loop is stable beyond the crossing at {eps} along ({d1}, {d2})",
            np.array([[1.0 + beyond * eps * d1, 1.0 + beyond * eps * d2]]),
        )
    return eps
