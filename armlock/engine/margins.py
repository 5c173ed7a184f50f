"""Margins of a loop L = N / M, of any two functions of one space.

Each margin is the level up to which no member of a family of functions has a root on the
imaginary axis (`armlock.engine.decide`). The limit at high frequency is known in closed form.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armlock.engine import chain, decide
from armlock.engine.chain import UndecidedError
from armlock.engine.decide import Family, least
from armlock.engine.functions import Function, Space, common_zeros, keeps_sign_up_to, stacked
from armlock.engine.inclusion import DELAY, DISTANCE, EPSILON, PHASE, REAL, TERM, VERTEX
from armlock.engine.polynomials import Polynomial, rounded

# Gain factors up to which a search goes at first, and then goes on. Past the first one it ends
# after so many steps if it has found nothing.
_GAINS = 1e4, 1e8, 1e12, 1e24, 1e48, 1e96, 1e192
_FEW_STEPS, _STEPS_OF_A_PROOF = 20_000, 200_000
# Past this gain, rounding hides whether a neutral root chain is confined.
_CHAIN_KNOWN = 1e12
# So close to the limit of the neutral root chain, as a share, no root is looked for.
_NEXT_TO_THE_CHAIN = 1e-5
# What is left of the undelayed term at high frequency is decided if it is this share of it.
_DECIDED = 256.0 * EPSILON
# Largest delay margin in s: beyond it there is none.
_LARGEST_DELAY = 1e300

# Relative accuracy where phases are free.
_FREE_TOLERANCE = 1e-5
# Where rounding at high frequency decides, a share that may be open.
_LEAST_CERTAIN = 1e-3
# Most delays at high frequency whose phases 0 and pi are tried.
_MOST_SIGNS = 10


class Free(NamedTuple):
    """A loop with terms of any phase above a frequency: L = (centre + arms) / denominator."""

    centre: Function
    denominator: Function
    arms: tuple[Function, ...]
    above: float


def _unit(k: int, number: int) -> tuple[float, ...]:
    """Return the weights of one of so many functions."""
    return tuple(float(i == k) for i in range(number))


def _unequal(number: int) -> list[list[tuple[int, tuple[float, ...], tuple[float, ...]]]]:
    """Return tests: abs(f_0) exceeds abs(f_1) and all other functions, or abs(f_1) does.

    Zero is then not in f_0 + exp(j psi) f_1, whatever the phases of the other functions are.
    """
    zero = (0.0,) * number
    return [
        [(TERM if k != most else VERTEX, _unit(k, number), zero) for k in range(number)]
        for most in (0, 1)
    ]


@dataclass(frozen=True)
class Margins:
    r"""Distances of a stable loop from instability.

    Gain and phase are taken where L is real and negative, and where its magnitude is one:

    .. math::

        \text{gain} &= -1 / L \quad \text{where } \mathrm{Im}\, L = 0 > \mathrm{Re}\, L , \\
        \text{phase} &= \min_{|L| = 1} |\arg(-L)| , \quad -\pi < \arg \le \pi , \\
        \text{delay} &= \min_{|L| = 1} \frac{\arg(-L)}{\omega} ,
        \quad 0 \le \arg < 2\pi , \\
        \text{modulus} &= \inf_\omega |1 + L| ,

    with L at s = j omega.

    Attributes
    ----------
    gain_lower, gain_upper : float
        The loop stays stable for every gain factor between the two; 0 and inf where this is
        proven for all. Where larger factors are not decided, the upper one is the largest that
        was looked at, 1e4 or more, and `gain_omega` is nan; the lower one is then 1e-4 or less.
        nan where the arms' phases are free.
    phase : float
        Smallest turn in rad, lag or lead, at a gain crossover that makes the loop marginal;
        inf without a crossover.
    delay : float
        Smallest additional loop delay in s that makes the loop unstable; inf if none does.
        0 where the loop does not roll off: an arbitrarily small delay then destabilises it
        at high frequency.
    modulus : float
        Smallest |1 + L|.
    gain_omega, phase_omega, modulus_omega : float
        Where the upper gain margin, the phase margin and the modulus margin are taken, in
        rad/s; inf where it is the limit at high frequency, nan where there is none.

    Examples
    --------
    >>> from armlock import margins, paper_loop
    >>> found = margins(paper_loop())
    >>> print(f"stable for gains from {found.gain_lower:.3f} to {found.gain_upper:.2f}")
    stable for gains from 0.195 to 6.61

    As a Series of pandas: ``pd.Series(vars(found))``.
    """

    gain_lower: float
    gain_upper: float
    phase: float
    delay: float
    modulus: float
    gain_omega: float
    phase_omega: float
    modulus_omega: float

    def __repr__(self) -> str:
        """List the margins with their units."""
        units = dict.fromkeys(vars(self), "")
        units |= {name: " rad/s" for name in units if name.endswith("_omega")}
        units |= {"phase": " rad", "delay": " s"}
        shown = (f"{name}={value}{units[name]}" for name, value in vars(self).items())
        return f"Margins({', '.join(shown)})"


def _disc_at_infinity(n: Function, m: Function) -> tuple[float, float]:
    """Centre and radius of the disc that L = N / M fills at infinite frequency.

    M is not delayed at the highest power.
    """
    whole, turned = n.space.limits(*stacked([n, m]))
    return float(whole[0] / whole[1]), float(np.abs(turned[0]).sum() / abs(whole[1]))


def at_zero(f: Function, g: Function) -> float:
    """Return the t at which f + t g loses its leading term at s = 0; nan where none does.

    It may be too large for a float: then it is inf.
    """
    first, other = f.leading(), g.leading()
    if first is None or other is None or first.order != other.order:
        return math.nan
    return float(rounded([-first.coefficient / other.coefficient])[0])


def chain_limit(
    f: Function, g: Function, start: float, rounding: float = 16.0 * EPSILON
) -> float:
    """First t >= start at which the neutral root chain of f + t g is not confined (Lemma 14).

    At least a share `rounding` of the undelayed term has to be left. A map has no such chain.
    """
    if f.space.step:
        return math.inf
    return chain.line_limit(f.space.lags, *f.space.limits(*stacked([f, g])), start, rounding)


def first_zero(
    f: Function, g: Function, most: float, start: float, **options: int
) -> tuple[float, float]:
    """Find the smallest t > start up to `most` at which f + t g has a zero on the axis.

    The options are those of `decide.least`. Returns t and the frequency in rad/s: 0 for a zero
    at s = 0, inf where the neutral root chain is not confined, nan where nothing is found.
    """
    best, where = most, math.nan
    limit = chain_limit(f, g, start)
    if limit <= start:
        return start, math.inf
    if limit < most:
        best, where = start + (limit - start) * (1.0 - _NEXT_TO_THE_CHAIN), math.inf
        best = min(best, chain_limit(f, g, start, _DECIDED))
    zero = at_zero(f, g)
    if start < zero < best:
        best, where = zero, 0.0
    if not g.is_zero:
        hull = [(VERTEX, (1.0, start), (0.0, 0.0)), (VERTEX, (1.0, 0.0), (0.0, 1.0))]
        best, where = least(Family([f, g], [hull]), REAL, best, where, start=start, **options)
    return (limit, where) if where == math.inf else (best, where)


def _shares(d: Function, n: Function, *arms: Function) -> Family:
    """Return D + u N with |u| up to the level, and arms of any phase beside it."""
    number = 2 + len(arms)
    zero = (0.0,) * number
    test = [(VERTEX, _unit(0, number), zero), (TERM, zero, _unit(1, number))]
    test += [(TERM, _unit(k, number), zero) for k in range(2, number)]
    return Family([d, n, *arms], [test], loose=len(arms))


def _limit_of_ratio(d: Function, n: Function) -> tuple[float, float, float]:
    """Least |D / N| at infinite frequency over all phases, where, and what is decided there.

    Where delays act on N too, it is the least one of phases 0 and pi: the search decides
    whether there is a smaller one.
    """
    space = d.space
    whole, turned = space.limits(*stacked([d, n]))
    size = abs(whole[0]) + np.abs(turned[0]).sum()
    # Zero between phases is no limit of a stable D.
    left = float(chain.reserve(space.lags, whole[:1], turned[:1])[0])
    acting = np.flatnonzero(turned.any(axis=0))
    lags, turned = [space.lags[k] for k in acting], turned[:, acting]
    objects = sorted({one for lag in lags for one, _ in lag}, key=lambda one: one.mark)
    if not turned[1].any() and not chain.shared(lags, turned[:1]).any():
        turns = -np.sign(turned[:1]) * np.sign(whole[0])
    elif len(objects) <= _MOST_SIGNS:
        signs = [
            dict(zip(objects, way, strict=True))
            for way in itertools.product((1, -1), repeat=len(objects))
        ]
        turns = np.array(
            [[math.prod(sign[one] ** k for one, k in lag) for lag in lags] for sign in signs]
        )
    else:
        return math.inf, math.nan, 0.0
    above, below = (w + turns @ t for w, t in zip(whole, turned, strict=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.abs(above / below) if left > 0.0 else np.zeros(1)
    ratios = np.where(np.isnan(ratios), np.inf, ratios)
    k = int(np.argmin(ratios))
    if not ratios[k] < math.inf:
        return math.inf, math.nan, 0.0
    decided = 2.0 * _DECIDED * size / abs(above[k]) if ratios[k] else 0.0
    return float(ratios[k]), math.inf, float(decided)


class Ratio(NamedTuple):
    """The least |D / N| over the axis, a bound that is certified, and where in rad/s."""

    value: float
    certified: float
    omega: float


def least_ratio(
    d: Function, n: Function, free: Free | None = None, *, tolerance: float = 1e-6
) -> Ratio:
    """Find the infimum of |D / N| over the axis, one over the peak gain of N / D (Lemma 20).

    Parameters
    ----------
    d, n : Function
        Of one space.
    free : Free, optional
        D and N above a frequency, with terms of D of any phase.
    tolerance : float, optional
        Smaller values are excluded up to this share, or up to what is decided at high
        frequency.

    Returns
    -------
    Ratio
        At inf for the limit at high frequency, at 0 for the limit at s = 0. Infinite where N
        is zero.
    """
    if n.is_zero:
        return Ratio(math.inf, math.inf, math.nan)
    best, where, decided = _limit_of_ratio(d, n)
    tolerance = max(tolerance, decided)
    zero = abs(at_zero(d, n))
    if zero < best:
        best, where = zero, 0.0
    best, where = _over_axis(_shares, d, n, free, DISTANCE, best, where, min(tolerance, 1.0))
    tolerance = max(tolerance, _FREE_TOLERANCE) if free else tolerance
    return Ratio(best, best * max(1.0 - tolerance, 0.0) * (1.0 - 4.0 * EPSILON), where)


def decided_ratio(d: Function, n: Function, free: Free | None = None) -> Ratio:
    """Return the infimum of |D / N|, as `least_ratio`, if it is certified to a thousandth.

    Raises
    ------
    UndecidedError
        If rounding at high frequency leaves room for a smaller one.
    """
    found = least_ratio(d, n, free)
    if found.certified < (1.0 - _LEAST_CERTAIN) * found.value:
        raise UndecidedError("rounding does not decide the limit at high frequency")
    return found


def modulus_of(n: Function, m: Function, free: Free | None = None) -> tuple[float, float]:
    """Smallest |1 + L|, one over the peak gain of the sensitivity M / (M + N), and where."""
    closed = free._replace(centre=free.centre + free.denominator) if free else None
    found = decided_ratio(n + m, m, closed)
    return found.value, found.omega


def _over_axis(
    family: Callable[..., Family],
    n: Function,
    m: Function,
    free: Free | None,
    goal: int,
    best: float,
    where: float,
    tolerance: float = 1e-6,
) -> tuple[float, float]:
    """Find the least level of a family of two functions; above a frequency with free phases."""
    if best > 0.0:
        high, pair = free.above if free else math.inf, family(n, m)
        low = 0.0
        if goal in (PHASE, DELAY) and not pair.begins(0.0):
            # abs(L(0)) is one: leading terms tell on which side of one abs(L) is next to it.
            low = keeps_sign_up_to(n + m, n + m * -1, odd=False)
        best, where = least(pair, goal, best, where, low=low, high=high, tolerance=tolerance)
    if free and best > 0.0:
        other, tolerance = family(*free[:2], *free.arms), max(tolerance, _FREE_TOLERANCE)
        best, where = least(other, goal, best, where, low=free.above, tolerance=tolerance)
    return best, where


def _crossover(
    n: Function,
    m: Function,
    free: Free | None,
    goal: int,
    slope: tuple[float, float, float, float],
    best: float,
    where: float,
) -> tuple[float, float]:
    """Find the least turn or delay that puts L on -1; `slope` says how the arc grows."""

    def family(n: Function, m: Function, *arms: Function) -> Family:
        arc = (0.0, 0.0, 0.0, 0.0), slope
        return Family([n, m, *arms], _unequal(2 + len(arms)), arc, len(arms))

    return _over_axis(family, n, m, free, goal, best, where)


def _phase(n: Function, m: Function, free: Free | None) -> tuple[float, float]:
    """Smallest |arg(-L)| where |L| = 1, and where."""
    centre, radius = _disc_at_infinity(n, m)
    best, where = math.pi, math.nan
    if abs(abs(centre) - radius) <= 1.0 <= abs(centre) + radius:
        cosine = (radius**2 - 1.0 - centre**2) / (2.0 * centre) if centre else 1.0
        best, where = math.acos(min(max(cosine, -1.0), 1.0)), math.inf
    return _crossover(n, m, free, PHASE, (-1.0, 0.0, 1.0, 0.0), best, where)


def _delay(n: Function, m: Function, free: Free | None) -> tuple[float, float]:
    """Smallest arg(-L) / omega where |L| = 1, and where."""
    centre, radius = _disc_at_infinity(n, m)
    if abs(centre) + radius >= 1.0:
        return 0.0, math.inf
    arc = 0.0, 0.0, 0.0, 1.0
    return _crossover(n, m, free, DELAY, arc, _LARGEST_DELAY, math.nan)


def _none_past(f: Function, g: Function) -> float:
    """Frequency past which f + t g has a zero at all t > 0 or at none (Lemma 19).

    It is a bound for a polynomial f; inf if the lemma does not give one.
    """
    if f.delayed.any():
        return math.inf
    polynomials = f.space.polynomials
    used = [j for j, w in enumerate(g.delayed) if g.steady[j] or w.any()]
    own = Space([polynomials[j] for j in used], f.space.lags)
    steady, delayed = g.steady[used], g.delayed[used]
    still = steady - delayed.sum(1)
    # Re(g conj(q)) is not below zero, with q a power of s, from some frequency on.
    n = own.degree
    top = sum(p.lead * a for p, a in zip(own.polynomials, still, strict=True) if p.degree == n)
    start = own.confined_from(*(w.astype(np.float64)[None] for w in (steady, delayed)))[0]
    bounds = [(float(start), Polynomial.of([*[0] * n, top]))]
    if len(used) == 1 and abs(still[0]) >= np.abs(delayed).sum():
        # The bracket of a single polynomial has no negative real part, at any frequency.
        bounds.append((0.0, own.polynomials[0] * Polynomial.of([still[0]])))
    whole = Polynomial.of([])
    for p, weight in zip(polynomials, f.steady, strict=True):
        whole = whole + p * Polynomial.of([weight])
    ends = [math.inf]
    for start, q in bounds:
        real, imaginary = _on_the_axis(whole, q)
        if real.lead >= 0:
            ends.append(max(start, _last(real)))
        if len(used) == 1 and not delayed.any() and imaginary:
            ends.append(_last(imaginary))
    return min(ends)


def _on_the_axis(p: Polynomial, q: Polynomial) -> list[Polynomial]:
    """Return Re(p conj(q)) and Im(p conj(q)) / omega, as polynomials of omega^2."""
    turned = Polynomial.of(c * (-1) ** k for k, c in enumerate(q.exact))
    product = (p * turned).exact
    return [
        Polynomial.of(c * (-1) ** k for k, c in enumerate(product[odd::2])) for odd in (0, 1)
    ]


def _last(p: Polynomial) -> float:
    """Return the square root of the largest positive root, a little more for its rounding."""
    squares = [root.real for root in p.roots if root.imag == 0.0 < root.real]
    return math.sqrt(max(squares, default=0.0)) * (1.0 + 1e-14)


def _no_zero_beyond(f: Function, g: Function, most: float) -> bool:
    """Tell whether f + t g has no zero on the axis for any t from `most` on; True is proven."""
    if at_zero(f, g) > most or chain_limit(f, g, most) < math.inf:
        return False
    hull = [(VERTEX, (1.0, most), (0.0, 0.0)), (VERTEX, (0.0, 1.0), (0.0, 0.0))]
    family = Family([f, g], [hull])
    # Where F conj(G) is not real, no real t makes F + t G zero.
    begin = family.begins(0.0) or keeps_sign_up_to(f, g, odd=True)
    end = _none_past(f, g)
    return end == 0.0 or decide.excludes(family, begin, end, _STEPS_OF_A_PROOF)


def _gain_up(m: Function, n: Function) -> tuple[float, float]:
    """First k > 1 at which M + k N has a zero on the axis, and where.

    inf is proven. If neither is found, k is the largest one that was looked at. The frequency
    is nan for both.
    """
    if m.is_zero or n.is_zero:
        return math.inf, math.nan
    looked_at, neutral = 1.0, n.space.limits(*n.weights)[1].any()
    for most in [gain for gain in _GAINS if gain <= _CHAIN_KNOWN or not neutral]:
        try:
            options = {"patience": _FEW_STEPS} if looked_at > 1.0 else {}
            found, where = first_zero(m, n, most, 1.0, **options)
            if not math.isnan(where):
                return found, where
            looked_at = most
            if _no_zero_beyond(m, n, most):
                return math.inf, math.nan
        except UndecidedError:
            if looked_at == 1.0:
                raise
            break
    return looked_at, math.nan


def gain_range(n: Function, m: Function) -> tuple[float, float, float]:
    """Gain factors around one between which N / M stays stable, and where the upper one is."""
    upper, where = _gain_up(m, n)
    # With t = 1 / k the same.
    lower, _ = _gain_up(n, m)
    return 1.0 / lower, upper, where


def margins_of(n: Function, m: Function, free: Free | None = None) -> Margins:
    """Compute all margins of the loop L = N / M.

    Parameters
    ----------
    n, m : Function
        Numerator and denominator, of one space.
    free : Free, optional
        The same loop with free phases, for all frequencies above one.

    Raises
    ------
    ValueError
        If the closed loop is not stable.
    UndecidedError
        If a margin is not decided.
    """
    require_stable(n + m, common_zeros(n, m))
    lower, upper, gain_omega = (math.nan,) * 3 if free else gain_range(n, m)
    phase, phase_omega = _phase(n, m, free)
    delay, _ = _delay(n, m, free)
    modulus, modulus_omega = modulus_of(n, m, free)
    return Margins(
        gain_lower=lower,
        gain_upper=upper,
        phase=phase if phase_omega == phase_omega else math.inf,
        delay=delay if delay < _LARGEST_DELAY else math.inf,
        modulus=modulus,
        gain_omega=gain_omega,
        phase_omega=phase_omega,
        modulus_omega=modulus_omega,
    )


def require_stable(d: Function, common: int = 0, what: str = "loop") -> None:
    """Raise unless D has no zero with a real part of zero or more, but `common` at s = 0."""
    count = decide.count(d, common)
    if count != 0:
        reasons = {
            decide.BOUNDARY: "a root on the axis",
            decide.UNCONFINED: "no confined chain",
        }
        raise ValueError(
            f"the {what} must be stable, but it has "
            f"{reasons.get(count, f'{count} unstable roots')}"
        )
