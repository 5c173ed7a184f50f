"""Systems as functions of the engine, affine in the parameters that vary.

    N + M = D = D_0 + x_1 D_1 + ... + x_k D_k

Charts, rays and D-curves are made of the D_i, margins of N and M at a point. Terms that cancel
at low frequency cancel exactly, in the polynomials that all functions are sums of.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from flint import fmpq, fmpq_poly

from armlock.checks import FloatArray, real_number
from armlock.engine.chain import Lag
from armlock.engine.functions import Function, Space
from armlock.engine.polynomials import Polynomial, collected, exact, order, polynomial
from armlock.systems import Sum, System, exact_number


class NotAffineError(ValueError):
    """A system is not affine in the parameters that vary."""


def _monic(p: fmpq_poly) -> fmpq_poly:
    return p / p.leading_coefficient()


def basis(vectors: Iterable[fmpq_poly]) -> list[fmpq_poly]:
    """Return monic polynomials of distinct degrees that span some.

    One of highest degree is kept, and its multiples are taken from the others of this degree:
    no two of them cancel at high frequency, as a confined neutral chain needs. It is the one of
    highest order at s = 0, so that no order decreases. Of the paper's dual sensor these are
    exactly the sum and the difference of the arms.
    """
    left, found = [_monic(p) for p in vectors if p], []
    while left:
        left.sort(key=lambda p: (-p.degree(), -order(p.coeffs())))
        pivot = left[0]
        found.append(pivot)
        rest = (p - p[pivot.degree()] * pivot for p in left[1:])
        left = list({str(p): p for p in (_monic(p) for p in rest if p)}.values())
    return found


def _weights(chosen: Sequence[fmpq_poly], p: fmpq_poly) -> list[fmpq]:
    """Return p as a sum of weights times a basis, exactly."""
    found = []
    for b in chosen:
        found.append(p[b.degree()])
        p = p - p[b.degree()] * b
    if p:
        raise AssertionError("a polynomial lies outside of its basis")
    return found


def _total(part: Mapping[Lag, fmpq_poly]) -> fmpq_poly:
    """Return what is left of a sum without its delays."""
    return sum(part.values(), fmpq_poly([0]))


def functions(
    groups: Sequence[Sequence[Mapping[Lag, fmpq_poly]]],
    step: float = 0.0,
    at_zero: int | None = None,
) -> Any:
    """Return sums of polynomials times delays as functions of one space, group by group.

    Each group has a basis of its own, so that nothing is taken from one for another. Delays of
    equal length are one where no delay acts on the highest power, so that there is no chain
    which would tell them apart.
    """
    groups = _told_apart(groups)
    bases = [
        basis(p for part in group for p in (_total(part), *part.values())) for group in groups
    ]
    union = list({str(p): p for some in bases for p in some}.values()) or [fmpq_poly([1])]
    names = {str(p): k for k, p in enumerate(union)}
    lags = {lag for group in groups for part in group for lag in part}
    space = Space([Polynomial.of(p) for p in union], lags, step, at_zero)
    column = {lag: k for k, lag in enumerate(space.lags, 1)}
    found = []
    for group, chosen in zip(groups, bases, strict=True):
        places = [names[str(p)] for p in chosen]
        for part in group:
            weights = np.full((len(union), 1 + len(column)), fmpq(0), object)
            weights[places, 0] = _weights(chosen, _total(part))
            for lag, p in part.items():
                if lag in column:
                    weights[places, column[lag]] = _weights(chosen, p)
            found.append(Function(space, weights[:, 0], weights[:, 1:]))
    return found


def _told_apart(groups: Any) -> Any:
    """Return sums by delay objects, or by lengths if no delay acts on the highest power."""
    terms = [term for group in groups for part in group for term in part.items()]
    top = max((p.degree() for _, p in terms), default=0)
    times = {lag.time for lag, _ in terms}
    if len(times) == len({lag for lag, _ in terms}) or any(
        lag.time and p.degree() == top for lag, p in terms
    ):
        return groups
    return [
        [collected((Lag.after(lag.time), p) for lag, p in part.items()) for part in group]
        for group in groups
    ]


class Affine:
    """N and M of a system as functions of the engine, affine in some parameters.

    Parameters
    ----------
    system : System
        The system; of an equation D is N, and M is zero.
    free : sequence of str, optional
        The parameters that vary.
    **numbers : real numbers, optional
        Values of the others, which are nominal by default.

    Attributes
    ----------
    free : tuple of str
        The parameters that vary.
    origin : tuple of float
        Their nominal values, or 0: next to them nothing cancels.
    n, m : list of Function
        What stands before 1 and before the parameters.

    Raises
    ------
    NotAffineError
        If two parameters that vary are multiplied, or one by itself.
    """

    def __init__(self, system: System, free: Sequence[str] = (), **numbers: Any) -> None:
        self.free, self.step = tuple(free), system.step
        self.origin = tuple(system.nominal.get(name) or 0.0 for name in free)
        given = system.given((), {**dict.fromkeys(free, 0.0), **numbers})
        values = {k: Sum.of(polynomial([v])) for k, v in given.items() if k not in free}
        sums = [part.put(values) for part in (system.numerator, system.denominator)]
        for _, names in (key for part in sums for key in part.terms):
            if len(names) > 1:
                raise NotAffineError(
                    f"the system must be affine in {' and '.join(dict.fromkeys(names))} "
                    f"together, but holds {' * '.join(names)}: give a number for one of them, "
                    "or make the product a parameter"
                )
        monomials = [(), *((name,) for name in free)]
        groups = []
        for part in sums:
            parts = [part.before(*names) for names in monomials]
            # What is left at the nominal values, where a loop is used, is one more sum.
            shares = zip(parts, map(exact, (1, *self.origin)), strict=True)
            there = collected((lag, p * x) for some, x in shares for lag, p in some.items())
            groups.append([there, *parts])
        made, size = functions(groups, system.step, system.at_zero), 2 + len(free)
        self.n: list[Function] = made[1:size]
        self.m: list[Function] = made[size + 1 :]

    @classmethod
    def of(cls, system: Any) -> Affine:
        """Return a system, affine in all of its parameters; made once for each system.

        Raises
        ------
        NotAffineError
            If it is not affine in all of them together.
        """
        system = System.of(system)
        if "_affine" not in system.__dict__:
            system.__dict__["_affine"] = cls(system, system.parameters)
        found: Affine = system.__dict__["_affine"]
        return found

    @property
    def space(self) -> Space:
        """The space of all functions."""
        return self.n[0].space

    @cached_property
    def m_is_zero(self) -> bool:
        """Whether it is an equation, so that nothing cancels."""
        return all(f.is_zero for f in self.m)

    @cached_property
    def terms(self) -> list[Function]:
        """D before 1 and before the parameters."""
        return [a + b for a, b in zip(self.n, self.m, strict=True)]

    def quotient(self, *point: float | fmpq) -> tuple[Function, Function]:
        """Return N and M at a point, exactly."""
        return _mixed(self.n, point), _mixed(self.m, point)

    def function(self, *point: float | fmpq) -> Function:
        """Return D at a point, exactly."""
        return _mixed(self.terms, point)


def _mixed(terms: Sequence[Function], point: Sequence[float | fmpq]) -> Function:
    found = terms[0]
    for term, x in zip(terms[1:], point, strict=True):
        found = found + term * x
    return found


def present(n: Function, m: Function) -> tuple[Function, Function]:
    """Return N and M at a point by the polynomials that they hold there.

    Where the highest power of s has a parameter that is zero, what is left has a lower degree.
    """
    space, (one, other) = n.space, ((f.steady != 0) | f.delayed.any(axis=1) for f in (n, m))
    kept = np.flatnonzero(one | other)
    if not kept.size or max(space.polynomials[j].degree for j in kept) == space.degree:
        return n, m
    left = [space.polynomials[j] for j in kept]
    own = Space(left, space.lags, space.step, space.at_zero)
    return Function(own, n.steady[kept], n.delayed[kept]), Function(
        own, m.steady[kept], m.delayed[kept]
    )


def quotient_at(
    system: Any, values: Iterable[Any] = (), numbers: Mapping[str, Any] | None = None
) -> tuple[Function, Function]:
    """Return N and M of a system at given values of its parameters, exactly."""
    system = System.of(system)
    given = {k: exact_number(k, v) for k, v in system.given(values, numbers or {}).items()}
    try:
        return present(*Affine.of(system).quotient(*given.values()))
    except NotAffineError:
        return Affine(system, (), **given).quotient()


def open_quotient(
    loop: Any, values: Iterable[Any], numbers: Mapping[str, Any], name: str = "loop"
) -> tuple[Function, Function, FloatArray]:
    """Return N and M of an open loop L = N / M, and the point of its parameters.

    An equation D = 0 is refused: it has no open loop.
    """
    system = System.of(loop, name)
    if system.is_equation:
        raise TypeError(
            f"{name} must be an open loop L, not an equation D = 0, got {system!r}: "
            "`System.opened` gives the open loop of a parameter"
        )
    given = {k: real_number(k, v) for k, v in system.given(values, numbers).items()}
    return *quotient_at(system, given.values()), np.array(list(given.values()))
