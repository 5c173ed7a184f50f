"""How far a stable loop is from instability: gain, phase, delay and modulus margins, peak gain.

The functions state a loop or system for the engine, which certifies each number: no smaller
margin and no larger gain exists, to a part in a million (`armlock.engine.margins`).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy.typing as npt

from armlock.checks import positive_number, real_number
from armlock.engine import decide
from armlock.engine.chain import UndecidedError
from armlock.engine.functions import Function, common_zeros
from armlock.engine.margins import (
    Free,
    Margins,
    UnstableError,
    decided_ratio,
    margins_of,
    modulus_of,
    require_stable,
)
from armlock.loops import checked_loop
from armlock.robustness.many import many
from armlock.stability.counts import decided
from armlock.systems import Lag, Sum, System, delay_object
from armlock.tables import Table, as_html, as_text, at, decibels, number

_T = TypeVar("_T")

# Gain factors that are tried for an unstable loop, those next to one first; most steps of each.
_STEPS_OF_A_TRY = 2000
_TRIED = sorted((10.0 ** (k / 4) for k in range(-12, 13)), key=lambda k: max(k, 1.0 / k))


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


def _with_a_gain(n: Function, m: Function) -> Margins:
    """Return the margins, or name a gain factor that makes an unstable loop stable."""
    try:
        return margins_of(n, m)
    except UnstableError as error:
        shared, tried = common_zeros(n, m), 0
        for gain in _TRIED:
            with suppress(UndecidedError):
                count = decide.count(m + n * gain, shared, most=_STEPS_OF_A_TRY)
                tried += 1
                if count == 0:
                    found = f"with a gain factor of {gain:.3g} it is stable"
                    raise ValueError(f"{error}; {found}") from None
        found = f"none of {tried} gain factors from 0.001 to 1000 makes it stable"
        raise ValueError(f"{error}; {found}") from None


@many()
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


@many()
def peak_gain(system: Any, *values: npt.ArrayLike, **numbers: npt.ArrayLike) -> PeakGain:
    r"""Largest gain of a stable system over all frequencies, its H-infinity norm.

    .. math::

        \sup_{\omega > 0} |G(\mathrm{j}\omega)|

    Parameters
    ----------
    system : System
        The system itself, for instance the sensitivity ``1 / (1 + loop)``, or a list of them.
        Of a `Loop` it is the open loop.
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
        try:
            require_stable(d, common_zeros(n, d), "system", "pole")
        except UnstableError as error:
            hint = "of an open loop L take 1 / (1 + L) or L.feedback()"
            raise ValueError(f"{error}; {hint}") from None
        found = decided_ratio(d, n)
    return PeakGain(1.0 / found.value, found.omega)


@many()
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
        and real, or `free_above` is not positive; or the loop is not stable there. The message
        then names a gain factor with which it is, if one was found.
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
        return _certified(_with_a_gain, loop, values, numbers)
    loop = checked_loop(loop, "free_above frees the phases of its arms, which it alone names")
    above = positive_number("free_above", free_above)
    given = {name: real_number(name, x) for name, x in loop.given(values, numbers).items()}
    loose = _with_free_phases(loop.at(**given), loop.arms, above)
    return _certified(partial(margins_of, free=loose), loop, values, numbers)


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
