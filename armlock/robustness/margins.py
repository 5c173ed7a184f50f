"""How far a stable loop is from instability: gain, phase, delay and modulus margins, peak gain.

Each margin is the level up to which no member of a family of functions has a root on the
imaginary axis (`armlock.engine.decide`): of M + k N with gain factors k, of M + exp(j psi) N
with phases psi, and so on. The limit at high frequency is known in closed form. So each number
is certified: no smaller margin and no larger gain exists, to a part in a million.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
from flint import fmpq, fmpq_poly

from armlock.checks import positive_number, real_number
from armlock.engine import chain, decide
from armlock.engine.decide import Family, least
from armlock.engine.functions import Function, common_zeros, keeps_sign_up_to, stacked
from armlock.engine.inclusion import DELAY, DISTANCE, PHASE, REAL, TERM, VERTEX
from armlock.engine.polynomials import Polynomial, exact, on_axis, rounded
from armlock.engine.tolerances import (
    CONFINED_IN_A_MARGIN,
    EPSILON,
    NEXT_TO_THE_LIMIT,
    UndecidedError,
)
from armlock.loops import checked_loop
from armlock.robustness.many import many
from armlock.stability.counts import decided, require_stable
from armlock.systems import Lag, Sum, System, delay_object
from armlock.tables import Shown, Table, as_html, as_text, at, decibels, number

_T = TypeVar("_T")

# Gain factors up to which is searched, the next one where doubles do not decide the last one;
# and most steps of a proof that no gain is too large.
_GAINS, _STEPS_OF_A_PROOF = (1e6, 1e4, 1e2), 200_000
# So close to the limit of the neutral root chain, as a share, no root is looked for.
_NEXT_TO_THE_CHAIN = 1e-5
# Largest delay margin in s: beyond it there is none.
_LARGEST_DELAY = 1e300

# Relative accuracy where phases are free.
_FREE_TOLERANCE = 1e-5
# Where rounding at high frequency decides, a share that may be open.
_LEAST_CERTAIN = 1e-3
# Most delays at high frequency whose phases 0 and pi are tried.
_MOST_SIGNS = 10


@dataclass(frozen=True, repr=False)
class Margins(Shown):
    r"""Distances of a stable loop from instability.

    Gain and phase are taken where L is real and negative, and where its magnitude is one:

    .. math::

        \text{gain} &= -1 / L \quad \text{where } \mathrm{Im}\, L = 0 > \mathrm{Re}\, L , \\
        \text{phase} &= \min_{|L| = 1} |\arg(-L)| , \quad -\pi < \arg \le \pi , \\
        \text{delay} &= \min_{|L| = 1} \frac{\arg(-L)}{\omega} ,
        \quad 0 \le \arg < 2\pi , \\
        \text{modulus} &= \inf_\omega |1 + L| ,

    with L at s = j omega and omega > 0. So 1 / (s + 1), whose magnitude is one at s = 0 alone,
    has no crossover.

    Attributes
    ----------
    gain_lower, gain_upper : float
        The loop stays stable for every gain factor between the two; 0 and inf where this is
        proven for all. nan where the arms' phases are free.
    phase : float
        Smallest turn in rad, lag or lead, at a gain crossover that makes the loop marginal;
        inf without a crossover.
    delay : float
        Smallest additional loop delay in s that makes the loop unstable; inf if none does.
        0 where the loop does not roll off: an arbitrarily small delay then destabilises it
        at high frequency.
    modulus : float
        Smallest |1 + L|.
    gain_lower_is_bound, gain_upper_is_bound : bool
        Whether the search, which goes up to 1e6 at most, has found no margin up to that factor:
        factors beyond it are not decided.
    gain_omega, phase_omega, modulus_omega : float
        Where the upper gain margin, the phase margin and the modulus margin are taken, in
        rad/s; inf where it is the limit at high frequency, nan where there is none.

    Examples
    --------
    >>> from armlock import margins, paper_loop
    >>> found = margins(paper_loop())
    >>> print(f"stable for gains from {found.gain_lower:.3f} to {found.gain_upper:.2f}")
    stable for gains from 0.195 to 6.61
    >>> print(f"{found.gain_upper_db:.1f} dB, {found.phase_degrees:.1f} degrees")
    16.4 dB, 36.0 degrees

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
    gain_lower_is_bound: bool = False
    gain_upper_is_bound: bool = False

    @property
    def phase_degrees(self) -> float:
        """The phase margin in degrees."""
        return math.degrees(self.phase)

    @property
    def gain_lower_db(self) -> float:
        """The lower gain margin in dB; -inf where the loop is stable down to a gain of 0."""
        return float(decibels(self.gain_lower))

    @property
    def gain_upper_db(self) -> float:
        """The upper gain margin in dB."""
        return float(decibels(self.gain_upper))

    def _table(self) -> Table:
        """Show each margin in both of its units, and where it is taken."""
        least = "at most " if self.gain_lower_is_bound else ""
        most = "at least " if self.gain_upper_is_bound else ""
        gain = f"{least}{number(self.gain_lower)} to {most}{number(self.gain_upper)}"
        db = f"{self.gain_lower_db:.4g} to {self.gain_upper_db:.4g} dB"
        degrees = f"{self.phase_degrees:.4g} degrees"
        rows = [
            ("gain", gain, db, at(self.gain_omega)),
            ("phase", number(self.phase, "rad"), degrees, at(self.phase_omega)),
            ("delay", number(self.delay, "s")),
            ("modulus", number(self.modulus), "", at(self.modulus_omega)),
        ]
        return Table("Margins", rows)


@many
def modulus_margin(loop: Any, *values: npt.ArrayLike, **numbers: npt.ArrayLike) -> Any:
    r"""Smallest distance of the Nyquist curve from -1, min over omega of |1 + L|.

    .. math::

        \inf_{\omega > 0} |1 + L(\mathrm{j}\omega; c_1, c_2)|

    It is one over the peak gain of the sensitivity 1 / (1 + L), see `peak_gain`.

    Parameters
    ----------
    loop : System
        The open loop L, whose closed loop is stable or not. A closed loop in place of L would
        be closed again. A list of loops is taken too.
    *values, **numbers : float or array_like, optional
        The parameters, in the order of their first use or by name; nominal ones by default.
        Lists of loops and arrays broadcast.

    Returns
    -------
    float, or `Many` with the attribute `value` of lists and arrays
        The infimum over all omega > 0, the limit at high frequency included, to a part in a
        million (a thousandth where rounding at high frequency allows no more). For a neutral
        loop that limit is taken over all small changes of the delays: it is 0 where the neutral
        root chain is not confined.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no open loop, or a parameter is not finite and real.
    CountError
        If double precision, or the steps allowed, do not decide it.

    Examples
    --------
    >>> from armlock import modulus_margin, paper_loop
    >>> print(f"{modulus_margin(paper_loop()):.4f}")
    0.6156
    """
    return _certified(lambda n, m: modulus_of(n, m)[0], loop, values, numbers)


class PeakGain(NamedTuple):
    """The largest gain of a system, and where it is in rad/s: 0 and inf stand for limits."""

    gain: float
    omega: float

    def _table(self) -> Table:
        """Show the gain as a factor and in dB, and where it is."""
        gain = number(self.gain), f"{decibels(self.gain):.4g} dB"
        return Table("Peak gain", [(*gain, at(self.omega))])

    __repr__, _repr_html_ = as_text, as_html  # type: ignore[misc]


@many
def peak_gain(system: Any, *values: npt.ArrayLike, **numbers: npt.ArrayLike) -> PeakGain:
    r"""Largest gain of a stable system over all frequencies, its H-infinity norm.

    .. math::

        \sup_{\omega > 0} |G(\mathrm{j}\omega)|

    Parameters
    ----------
    system : System
        The system itself, for instance the sensitivity ``1 / (1 + loop)``, or a list of them.
        Of a `Loop` it is the open loop, which an integrator makes unstable.
    *values, **numbers : float or array_like, optional
        The parameters, in the order of their first use or by name; nominal ones by default.
        Lists of systems and arrays broadcast.

    Returns
    -------
    PeakGain, or `Many` of lists and arrays
        The gain, which no frequency exceeds by more than a part in a million (a thousandth
        where rounding at high frequency allows no more), and where it is in rad/s: 0 where it
        is the limit at s = 0, inf where it is the limit at high frequency, nan for a system
        that is zero. The limit at high frequency is taken over all small changes of the delays.

    Raises
    ------
    TypeError, ValueError
        If `system` is no system, is improper, so that its gain grows without limit, or has a
        pole on the imaginary axis or right of it, as an open loop with an integrator has.
    CountError
        If double precision, or the steps allowed, do not decide it. It is raised too where
        several delays act on the highest powers of both numerator and denominator, in different
        proportions, and the largest gain is a limit at high frequency.

    See Also
    --------
    armlock.modulus_margin : one over the peak gain of the sensitivity.

    Notes
    -----
    ``control.norm(system, inf)`` is the same for systems without delays.

    Examples
    --------
    >>> from armlock import paper_loop, peak_gain
    >>> loop = paper_loop()
    >>> gain, omega = peak_gain(1 / (1 + loop))
    >>> print(f"{gain:.4f} at {omega:.3e} rad/s")
    1.6246 at 2.291e-05 rad/s
    """
    given = System.of(system, "system")
    n, d, point = given.open_functions(values, numbers, "system")
    held = given.at(**dict(zip(given.parameters, point.tolist(), strict=True)))
    if held.numerator.degree > held.denominator.degree:
        raise ValueError(
            "system must be proper, or its gain grows without limit, got a numerator of degree "
            f"{held.numerator.degree} and a denominator of degree {held.denominator.degree}"
        )
    with decided("no peak gain", point):
        require_stable(d, common_zeros(n, d), "system", "pole")
        found = least_ratio(d, n)
    return PeakGain(1.0 / found.value, found.omega)


@many
def margins(
    loop: Any,
    *values: npt.ArrayLike,
    free_above: float | None = None,
    **numbers: npt.ArrayLike,
) -> Margins:
    r"""Compute all margins of a stable loop.

    Parameters
    ----------
    loop : System
        The open loop L, for instance `CommonArm()`; the margins are those of its closed loop,
        1 + L = 0. A closed loop in place of L would be closed again. A list of loops is taken
        too.
    *values : float or array_like, optional
        The parameters, in the order of their first use; nominal ones by default. Lists of loops
        and arrays broadcast.
    free_above : float, optional
        Angular frequency in rad/s above which the phases of the arms of a `Loop` are taken as
        free, as they are once the arms have drifted by a fraction of the modulation's
        wavelength: the margins then hold for all of them. By default the phases are those of
        the delays, at all frequencies.
    **numbers : float or array_like, optional
        Parameters by name.

    Returns
    -------
    Margins, or `Many` of lists and arrays

    Raises
    ------
    TypeError, ValueError
        If `loop` is no open loop, or no `Loop` where phases are free, a parameter is not finite
        and real, or `free_above` is not positive; or the loop is not stable there.
    CountError
        If double precision, or the steps allowed, do not decide a margin.

    Notes
    -----
    Stable means that all roots of the closed loop lie in the left half-plane. A root at s = 0
    that numerator and denominator of L have in common is none of them.

    Phase and delay margins are taken over all crossovers. A neutral loop may have infinitely
    many crossovers, which approach those of its limit at high frequency.

    With free phases, L fills a disc: with the sensor's weights m1 and m2

    .. math::

        \left| L - K e^{-s\delta} (m_1 + m_2) \right|
        \le |K| \left( |c_1 m_1| + |c_2 m_2| \right) .

    The distances from -1 of this disc, and of its share of the unit circle, are known in
    closed form at each frequency; their minima over frequency are certified to 1e-5. A disc
    that holds -1 has margins of zero. A gain interval is not given: the edge of such a disc may
    run along the real axis.
    With equal weights m and c1 = c2 = 1 the disc has the centre 2 K m exp(-s delay), and a
    radius of the same magnitude: it stays clear of -1, for arms of any lengths, where
    Re [K m exp(-s delay)] > -1/4.

    Examples
    --------
    >>> import math
    >>> from armlock import margins, paper_loop
    >>> print(f"{math.degrees(margins(paper_loop()).phase):.1f} degrees")
    36.0 degrees

    Of several loops or points; where one is not stable, `Many.reasons` says so:

    >>> from armlock import SingleArm
    >>> margins(SingleArm(), [0.8, 0.9, 1.1]).modulus.round(4)
    array([0.606 , 0.4435,    nan])
    """
    if free_above is None:
        return _certified(margins_of, loop, values, numbers)
    loop = checked_loop(loop, "free_above frees the phases of its arms, which it alone names")
    above = positive_number("free_above", free_above)
    given = {name: real_number(name, x) for name, x in loop.given(values, numbers).items()}
    loose = _with_free_phases(loop.at(**given), loop.arms, above)
    return _certified(partial(margins_of, free=loose), loop, values, numbers)


# How margins are found -----------------------------------------------------------------------


def _certified(
    compute: Callable[[Function, Function], _T],
    loop: System,
    values: tuple[npt.ArrayLike, ...],
    numbers: dict[str, npt.ArrayLike],
) -> _T:
    """Return what the engine makes of numerator and denominator of a loop."""
    n, m, point = System.of(loop, "loop").open_functions(values, numbers)
    with decided("no margin", point):
        return compute(n, m)


class Free(NamedTuple):
    """A loop with terms of any phase above a frequency: L = (centre + arms) / denominator."""

    centre: Function
    denominator: Function
    arms: tuple[Function, ...]
    above: float


def _with_free_phases(system: System, arms: tuple[System, System], above: float) -> Free:
    """Return L with free phases of both arms above a frequency, for the engine."""
    free = {delay_object(one, "arm") for one in arms}
    # Terms with the same powers of these delays turn together.
    given = system.numerator
    kinds = {lag: tuple(pair for pair in lag if pair[0] in free) for lag in given.lags}
    names = {kind: f"arm{k}" for k, kind in enumerate(dict.fromkeys(kinds.values())) if kind}
    above_line = Sum({})
    for (lag, _), p in given.terms.items():
        own = Lag(pair for pair in lag if pair[0] not in free)
        arm = (names[kinds[lag]],) if kinds[lag] else ()
        above_line = above_line + Sum.of(p, own, *arm)
    turned = dict.fromkeys(names.values(), 0.0)
    affine = System(above_line, system.denominator, turned).affine
    discs = tuple(f for f in affine.n[1:] if not f.is_zero)
    return Free(affine.n[0], affine.m[0], discs, above)


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


def at_zero(f: Function, g: Function) -> float:
    """Return the t at which f + t g loses its leading term at s = 0; nan where none does.

    It may be too large for a float: then it is inf.
    """
    first, other = f.leading(), g.leading()
    if first is None or other is None or first.order != other.order:
        return math.nan
    return float(rounded([-first.coefficient / other.coefficient])[0])


def chain_limit(f: Function, g: Function, start: float, rounding: float = 0.0) -> float:
    """First t >= start at which the neutral root chain of f + t g is not confined (Lemma 14).

    At least a share `rounding` of the undelayed term has to be left. A map has no such chain.
    """
    if f.space.step:
        return math.inf
    return chain.line_limit(f.limits, g.limits, exact(start), exact(rounding))


def first_zero(
    f: Function, g: Function, most: float, start: float, high: float = math.inf
) -> tuple[float, float]:
    """Find the smallest t > start up to `most` at which f + t g has a zero on the axis.

    Past the frequency `high` there is none. Returns t and the frequency in rad/s: 0 for a zero
    at s = 0, inf where the neutral root chain is not shown to be confined, nan where nothing is
    found.

    Raises
    ------
    UndecidedError
        If it is not decided, for instance where rounding hides whether the chain is confined.
    """
    best, where = most, math.nan
    limit, decided = chain_limit(f, g, start), math.inf
    if limit <= start:
        return start, math.inf
    if limit < most:
        best, where = start + (limit - start) * (1.0 - _NEXT_TO_THE_CHAIN), math.inf
    if high == math.inf:
        decided = chain_limit(f, g, start, CONFINED_IN_A_MARGIN)
    if decided < best:
        best, near = decided, decided >= limit * (1.0 - NEXT_TO_THE_LIMIT)
        where = where if near else math.nan
    zero = at_zero(f, g)
    if start < zero < best:
        best, where = zero, 0.0
    if not g.is_zero:
        hull = [(VERTEX, (1.0, start), (0.0, 0.0)), (VERTEX, (1.0, 0.0), (0.0, 1.0))]
        best, where = least(Family([f, g], [hull]), REAL, best, where, start=start, high=high)
    if math.isnan(where) and decided < most * (1.0 - NEXT_TO_THE_LIMIT):
        raise UndecidedError(f"rounding hides whether the chain is confined from {decided} on")
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
    left = float(chain.reserve(whole[:1], turned[:1])[0])
    acting = np.flatnonzero(turned.any(axis=0))
    lags, turned = [space.lags[k] for k in acting], turned[:, acting]
    objects = sorted({one for lag in lags for one, _ in lag}, key=lambda one: one.mark)
    # Of shared objects the sum of magnitudes is no limit.
    shared = bool(chain.own_phases(lag for lag, c in zip(lags, turned[0], strict=True) if c)[1])
    if left <= 0.0 and shared:
        return math.inf, math.nan, 0.0
    if not turned[1].any() and not shared:
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
    decided = 2.0 * CONFINED_IN_A_MARGIN * size / abs(above[k]) if ratios[k] else 0.0
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

    Raises
    ------
    UndecidedError
        If rounding at high frequency leaves room for one that is smaller by a thousandth.
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
    certified = best * max(1.0 - tolerance, 0.0) * (1.0 - 4.0 * EPSILON)
    if certified < (1.0 - _LEAST_CERTAIN) * best:
        raise UndecidedError("rounding does not decide the limit at high frequency")
    return Ratio(best, certified, where)


def modulus_of(n: Function, m: Function, free: Free | None = None) -> tuple[float, float]:
    """Smallest |1 + L|, one over the peak gain of the sensitivity M / (M + N), and where."""
    closed = free._replace(centre=free.centre + free.denominator) if free else None
    found = least_ratio(n + m, m, closed)
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


def _turn_at_infinity(n: Function, m: Function, free: Free | None) -> tuple[float, bool]:
    """Smallest abs(arg(-L)) where abs(L) is one at infinite frequency; inf where it never is.

    Over all phases of the delay objects there (Lemma 24); and whether it is no lower bound.
    """
    arms: tuple[Function, ...] = ()
    if free:
        n, m, arms, _ = free
    of_n, of_m = np.column_stack(n.space.limits(*stacked([n, m])))
    loose = sum(f.size_at_infinity for f in arms)
    return chain.arc_limit(n.space.lags, of_n, of_m, loose)


def _phase(
    n: Function, m: Function, free: Free | None, turn: float, is_found: bool
) -> tuple[float, float]:
    """Smallest |arg(-L)| where |L| = 1, and where; `turn` is the one at infinity."""
    best, where = (turn, math.inf) if turn < math.inf else (math.pi, math.nan)
    best, where = _crossover(n, m, free, PHASE, (-1.0, 0.0, 1.0, 0.0), best, where)
    if where == math.inf and not is_found:
        raise UndecidedError(f"the turn at high frequency is not found, from {turn:.6g} rad on")
    return best, where


def _delay(n: Function, m: Function, free: Free | None, turn: float) -> tuple[float, float]:
    """Smallest arg(-L) / omega where |L| = 1, and where; `turn` is the one at infinity."""
    # abs(L) is below one at infinite frequency if it is so for one phase, and never one.
    at_one, open_at_one = (abs(sum(f.limits, fmpq(0))) for f in (n, m))
    if at_one >= open_at_one or turn < math.inf:
        return 0.0, math.inf
    arc = 0.0, 0.0, 0.0, 1.0
    return _crossover(n, m, free, DELAY, arc, _LARGEST_DELAY, math.nan)


def _returns_end(m: Function, n: Function, least: float) -> float:
    """Frequency past which N + u M is not zero for any u > `least`, at any phases (Lemma 19).

    Where it is zero for one of these u, it is zero for all. inf if the lemma gives none, or if
    M has delays.
    """
    if m.delayed.any():
        return math.inf
    polynomials, still = n.space.polynomials, n.steady - n.delayed.sum(axis=1)
    parts = (
        sum(
            (w * p.exact for w, p in zip(f, polynomials, strict=True)),
            fmpq_poly([0]),
        )
        for f in (still, m.steady, *n.delayed.T)
    )
    own, other, *late = parts
    late = [p for p in late if p]
    # As large as the delayed terms are next to each other at high frequency.
    corner, degree = exact(n.space.corners[-1]), max((p.degree() for p in late), default=0)
    shares = [abs(p.leading_coefficient()) * corner ** (p.degree() - degree) for p in late]
    sizes = (on_axis(p, p) / share for p, share in zip(late, shares, strict=True))
    a = on_axis(own, own) - sum(shares, fmpq(0)) * sum(sizes, fmpq_poly([0]))
    b, c, u = on_axis(own, other), on_axis(other, other), exact(least)
    # a + 2 b u + c u^2 bounds what is left of abs(N + u M)^2.
    ends = [
        max(map(_positive_past, parts))
        for parts in ((b, a + 2 * b * u + c * u**2), (a, a * c - b * b))
    ]
    return min(ends if a * c != b * b else ends[:1])


def _positive_past(p: fmpq_poly) -> float:
    """Return the omega past which a polynomial of omega^2 is not negative, or inf."""
    if p and p.leading_coefficient() < 0:
        return math.inf
    squares = [z.real for z in Polynomial.of(p).roots if z.imag == 0.0 < z.real]
    return math.sqrt(max(squares, default=0.0)) * (1.0 + 1e-14)


def _no_zero_beyond(f: Function, g: Function, most: float, end: float) -> bool:
    """Tell whether f + t g has no zero on the axis for any t from `most` on; True is proven.

    Past the frequency `end` there is none. False where doubles do not decide.
    """
    if at_zero(f, g) > most or chain_limit(f, g, most) < math.inf:
        return False
    hull = [(VERTEX, (1.0, most), (0.0, 0.0)), (VERTEX, (0.0, 1.0), (0.0, 0.0))]
    family = Family([f, g], [hull])
    # Where F conj(G) is not real, no real t makes F + t G zero.
    begin = family.begins(0.0) or keeps_sign_up_to(f, g, odd=True)
    with suppress(UndecidedError):
        return end == 0.0 or decide.excludes(family, begin, end, _STEPS_OF_A_PROOF)
    return False


class GainLimit(NamedTuple):
    """First t > 1 at which f + t g has a zero on the axis, and where in rad/s.

    `is_bound` says that t is the largest one that was looked at, and that no zero was found.
    """

    t: float
    omega: float = math.nan
    is_bound: bool = False


def _gain_limit(f: Function, g: Function, end: Callable[[float], float]) -> GainLimit:
    """Search as far as doubles decide; where nothing is found, try to prove that nothing is.

    `end` returns the frequency past which f + t g is not zero for any t up to a given one.
    """
    if f.is_zero or g.is_zero:
        return GainLimit(math.inf)
    for most in _GAINS:
        # A search leaves a share of 1e-6.
        further = most * (1.0 + 1e-5)
        try:
            found, where = first_zero(f, g, further, 1.0, end(further))
        except UndecidedError:
            if most == _GAINS[-1]:
                raise
            continue
        if where == math.inf and _shares_objects(f, g):
            return GainLimit(found, is_bound=True)
        if not math.isnan(where):
            return GainLimit(found, where)
        if _no_zero_beyond(f, g, most, end(math.inf)):
            return GainLimit(math.inf)
        break
    return GainLimit(most, is_bound=True)


def _shares_objects(f: Function, g: Function) -> bool:
    """Tell whether the sum of magnitudes asks for more than f + t g needs at high frequency."""
    pairs = zip(f.space.lags, f.limits[1:], g.limits[1:], strict=True)
    return bool(chain.own_phases(lag for lag, a, b in pairs if a or b)[1])


def gain_limits(n: Function, m: Function) -> tuple[GainLimit, GainLimit]:
    """Return limits of the gain k of k N / M: of 1 / k from one up, and of k from one up."""
    return (
        _gain_limit(n, m, lambda t: _returns_end(m, n, 1.0)),
        _gain_limit(m, n, lambda t: _returns_end(m, n, 1.0 / t)),
    )


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
    below, above = [GainLimit(math.nan)] * 2 if free else gain_limits(n, m)
    turn, is_found = _turn_at_infinity(n, m, free)
    phase, phase_omega = _phase(n, m, free, turn, is_found)
    delay, _ = _delay(n, m, free, turn)
    modulus, modulus_omega = modulus_of(n, m, free)
    return Margins(
        gain_lower=1.0 / below.t,
        gain_upper=above.t,
        phase=phase if phase_omega == phase_omega else math.inf,
        delay=delay if delay < _LARGEST_DELAY else math.inf,
        modulus=modulus,
        gain_omega=above.omega,
        phase_omega=phase_omega,
        modulus_omega=modulus_omega,
        gain_lower_is_bound=below.is_bound,
        gain_upper_is_bound=above.is_bound,
    )
