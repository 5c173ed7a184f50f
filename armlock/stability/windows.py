"""Windows of one delay: between which lengths of a delay a system keeps its unstable roots.

Roots cross the axis at real roots of one exact polynomial (Lemma 26), so that the list of
lengths at which the number of unstable roots can change is complete.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from math import factorial
from typing import NamedTuple

import flint
import numpy as np
from flint import acb, acb_poly, arb, fmpq, fmpq_mpoly_ctx, fmpq_poly

from armlock.checks import positive_number
from armlock.engine.polynomials import collected, enclosed_roots, exact
from armlock.stability.counts import UNCONFINED, CountError, unstable_roots
from armlock.systems import Delay, Lag, Sum, System, delay_object, exact_number

# Bits of frequencies, to which share exp(-s theta) is known, and most windows.
_BITS, _TOLERANCE, _MOST_WINDOWS = 192, 2.0**-80, 10_000


class Window(NamedTuple):
    """Lengths of a delay, in s, between which the count is the same; the ends are none of them.

    `unstable` is what `unstable_roots` counts: 0 where the system is stable.
    """

    low: float
    high: float
    unstable: int


def stable_delays(
    system: System, z: System, longest: float, **numbers: float
) -> tuple[Window, ...]:
    """Return the windows of one delay, with the number of unstable roots in each.

    Parameters
    ----------
    system : System
        An open loop or an equation in which nothing but `z`, and powers of it, delays.
    z : System
        The delay object, as `armlock.delay` made it; its own length does not matter.
    longest : float
        Up to which length in s.
    **numbers : float, optional
        Values of parameters; the others are nominal.

    Returns
    -------
    tuple of Window
        Ascending and without gaps, from 0 to `longest`. At an end a root is on the imaginary
        axis, and the counts on its two sides may be equal.

    Raises
    ------
    TypeError, ValueError
        If `z` is no delay, if another object delays too, or if there are more than 10 000
        windows. With several delays, count at lengths
        of your choice: ``[unstable_roots(loop(theta)) for theta in lengths]``.
    CountError
        If the count in a window takes too many steps, or two crossings of one factor coincide.

    Notes
    -----
    With D as a polynomial P(s, z), a root s = j omega has abs(z) = 1 and is a root of
    P(-s, 1 / z) too. The resultant of the two, for each irreducible factor of P, is an exact
    polynomial in omega^2 (Lemma 26). The count in a window is a certified one in its middle. A
    neutral system whose chain is not confined has the count -2 for all lengths: one window.

    Examples
    --------
    A pendulum is held by a late measurement of its angle, but not without delay:

    >>> from armlock import delay, equation, s, stable_delays
    >>> z = delay(1.0)
    >>> for window in stable_delays(equation(s**2 - 0.1 * s + 2 - z), z, longest=4.0):
    ...     print(f"{window.low:.4f} to {window.high:.4f} s: {window.unstable}")
    0.0000 to 0.1002 s: 2
    0.1002 to 1.7179 s: 0
    1.7179 to 4.0000 s: 2
    """
    system, longest = System.of(system), positive_number("longest", longest)
    if system.step:
        raise ValueError(
            f"system must be in continuous time, got a map with step {system.step}"
        )
    given = {k: exact_number(k, v) for k, v in system.given((), numbers).items()}
    system, own = system.at(**given), delay_object(z, "z")
    parts = [_by_power(part, own) for part in (system.numerator, system.denominator)]
    d = collected((*parts[0].items(), *parts[1].items()))
    held = [k for k, p in d.items() if p] or [0]
    powers = [d.get(k, fmpq_poly([0])) for k in range(min(held), max(held) + 1)]

    def window(low: float, high: float) -> Window:
        there = _with_length(system, parts, exact(0.5 * (low + high)))
        return Window(low, high, unstable_roots(there))

    # Whether the chain is confined does not depend on the length.
    whole = window(0.0, longest)
    if whole.unstable == UNCONFINED:
        return (whole,)
    with flint.ctx.workprec(_BITS):
        edges = _edges(powers, parts, system.at_zero, exact(longest))
    return tuple(itertools.starmap(window, itertools.pairwise([0.0, *edges, longest])))


def _by_power(part: Sum, own: Delay) -> dict[int, fmpq_poly]:
    """Return the polynomials before the powers of a delay object, or raise."""
    found = {}
    for lag, p in part.before().items():
        powers = dict(lag)
        found[powers.pop(own, 0)] = p
        if powers:
            raise ValueError(
                f"system must be delayed by z alone, got another delay object, of "
                f"{float(next(iter(powers)).theta):g} s: write z in its place, as in "
                "state_space({0: a, z: b}), or count with unstable_roots at given lengths"
            )
    return found


def _with_length(system: System, parts: Sequence[dict[int, fmpq_poly]], theta: fmpq) -> System:
    """Return the system with a delay of another length."""
    one = Delay.new(theta)
    n, m = (Sum({(Lag.of({one: k}), ()): p for k, p in part.items()}) for part in parts)
    return System(n, m, at_zero=system.at_zero)


def _factors(
    powers: Sequence[fmpq_poly],
) -> Iterator[tuple[list[fmpq_poly], fmpq_poly]]:
    """Yield the irreducible factors of P(s, z) that hold z, by powers of z.

    With each, the resultant of P(s, z) and z^K P(-s, 1 / z) as a polynomial of s^2.
    """
    ring = fmpq_mpoly_ctx.get(("s", "z"))
    terms: dict[tuple[int, ...], fmpq] = {
        (i, k): c for k, p in enumerate(powers) for i, c in enumerate(p.coeffs()) if c
    }
    for factor, _ in ring.from_dict(terms).factor()[1]:
        number = factor.degrees()[1]
        if number:
            own = [(int(i), int(k), c) for (i, k), c in factor.to_dict().items()]
            mirror = ring.from_dict({(i, number - k): (-1) ** i * c for i, k, c in own})
            resultant = factor.resultant(mirror, "z").to_dict()
            yield (
                [_polynomial({i: c for i, n, c in own if n == k}) for k in range(number + 1)],
                _polynomial({int(i) // 2: c for (i, _), c in resultant.items()}),
            )


def _polynomial(terms: dict[int, fmpq]) -> fmpq_poly:
    """Return a polynomial by its powers."""
    return fmpq_poly([terms.get(k, 0) for k in range(max(terms, default=0) + 1)])


def _edges(
    powers: Sequence[fmpq_poly],
    parts: Sequence[dict[int, fmpq_poly]],
    at_zero: int | None,
    longest: fmpq,
) -> list[float]:
    """Return the lengths up to the longest at which a root is on the axis, ascending."""
    found = _at_zero(powers, parts, at_zero, arb(longest))
    for factor, eliminated in _factors(powers):
        for root, _ in enclosed_roots(eliminated(fmpq_poly([0, -1]))):
            if root.imag.contains(0) and root.real > 0:
                found += _lengths(factor, root.real.sqrt(), arb(longest))
    found.sort(key=lambda theta: float(theta.mid()))
    return [
        float(theta)
        for k, theta in enumerate(found)
        if not k or not found[k - 1].overlaps(theta)
    ]


def _lengths(powers: Sequence[fmpq_poly], omega: arb, longest: arb) -> list[arb]:
    """Return the lengths at which j omega is a root."""
    found, s = [], acb(0, omega)
    try:
        turns = acb_poly([acb_poly(p)(s) for p in powers]).roots(tol=_TOLERANCE)
    except ValueError:
        raise CountError(
            f"no windows: at {float(omega):.6g} rad/s two crossings coincide", np.empty((1, 0))
        ) from None
    for z in turns:
        if not abs(z).overlaps(arb(1)):
            continue
        # Next to the negative real axis the angle jumps.
        turn, first = 2 * arb.pi(), -z.arg() if z.real > 0 else arb.pi() - (-z).arg()
        first = first if first > 0 else first + turn
        number = int(float((longest * omega - first) / turn)) + 2
        if number > _MOST_WINDOWS:
            raise ValueError(
                f"longest must leave at most {_MOST_WINDOWS} windows, got {float(longest):g}"
            )
        lengths = ((first + k * turn) / omega for k in range(max(number, 0)))
        found += [theta for theta in lengths if theta < longest]
    return found


def _at_zero(
    powers: Sequence[fmpq_poly],
    parts: Sequence[dict[int, fmpq_poly]],
    at_zero: int | None,
    longest: arb,
) -> list[arb]:
    """Return the lengths at which one more root is at s = 0 than those that are left out."""
    if at_zero is None:
        at_zero = min(
            next(k for k in itertools.count() if _coefficient(part, k)) for part in parts
        )
    found = _coefficient(dict(enumerate(powers)), at_zero)
    if found.degree() < 1:
        return []
    real = (root.real for root, _ in enclosed_roots(found) if root.imag.contains(0))
    return [theta for theta in real if theta > 0 and theta < longest]


def _coefficient(part: Mapping[int, fmpq_poly], number: int) -> fmpq_poly:
    """Return the coefficient of s to a power at s = 0, a polynomial in the length."""
    terms = (
        p[number - j] * fmpq_poly([0, -k]) ** j / factorial(j)
        for k, p in part.items()
        for j in range(number + 1)
    )
    return sum(terms, fmpq_poly([0]))
