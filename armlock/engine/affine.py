"""Sums of polynomials times delays as functions of one space, affine in parameters.

    N + M = D = D_0 + x_1 D_1 + ... + x_k D_k

Charts, rays and D-curves are made of the D_i, margins of N and M at a point. Terms that cancel
at low frequency cancel exactly, in the polynomials that all functions are sums of.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from flint import fmpq, fmpq_poly

from armlock.checks import ComplexArray, FloatArray
from armlock.engine.chain import Product
from armlock.engine.functions import Function, Space
from armlock.engine.polynomials import Polynomial, collected, exact, order
from armlock.engine.values import Quotient

#: A sum: polynomials by the products of delays that they are multiplied by.
Part = Mapping[Any, fmpq_poly]


class NotAffineError(ValueError):
    """A system is not affine in the parameters that vary."""


def basis(vectors: Iterable[fmpq_poly]) -> list[fmpq_poly]:
    """Return monic polynomials of distinct degrees that span some.

    One of highest degree is kept, and its multiples are taken from the others of this degree:
    no two of them cancel at high frequency, as a confined neutral chain needs. It is the one of
    highest order at s = 0, so that no order decreases. Of the paper's dual sensor these are
    exactly the sum and the difference of the arms.
    """
    by_degree: dict[int, list[fmpq_poly]] = {}
    for p in vectors:
        if p:
            by_degree.setdefault(p.degree(), []).append(p)
    found = []
    while by_degree:
        top = max(by_degree)
        highest = by_degree.pop(top)
        orders = [order(p.coeffs()) for p in highest]
        pivot = highest[orders.index(max(orders))]
        pivot = pivot / pivot[top]
        found.append(pivot)
        for p in highest:
            left = p - p[top] * pivot
            if left:
                by_degree.setdefault(left.degree(), []).append(left)
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


def functions(
    groups: Sequence[Sequence[Part]],
    step: float = 0.0,
    at_zero: int | None = None,
) -> list[Function]:
    """Return sums of polynomials times delays as functions of one space, group by group.

    Each group has a basis of its own, so that nothing is taken from one for another. Delays of
    equal length are one where no delay acts on the highest power, so that there is no chain
    which would tell them apart.
    """
    if _delays_are_lengths(list(chain(*groups))):
        groups = [
            [collected((lag.merged, p) for lag, p in part.items()) for part in group]
            for group in groups
        ]
    union: list[fmpq_poly] = []
    lags: set[Product] = set()
    rows = []
    for group in groups:
        # What stands before delays, and what is left of each sum at s = 0.
        wholes = [sum(part.values(), fmpq_poly([0])) for part in group]
        chosen = basis(chain(wholes, *[part.values() for part in group]))
        union += [p for p in chosen if p not in union]
        places = [union.index(p) for p in chosen]
        rows += [(places, chosen, part) for part in group]
        lags.update(*group)
    space = Space([Polynomial.of(p) for p in union or [fmpq_poly([1])]], lags, step, at_zero)
    column = {lag: k for k, lag in enumerate(space.lags, 1)}
    found = []
    for places, chosen, part in rows:
        weights = np.full((len(space.polynomials), 1 + len(column)), fmpq(0), object)
        for lag, p in part.items():
            before = _weights(chosen, p)
            weights[places, 0] += before
            if lag in column:
                weights[places, column[lag]] = before
        found.append(Function(space, weights[:, 0], weights[:, 1:]))
    return found


def _delays_are_lengths(parts: Sequence[Part]) -> bool:
    """Tell whether equally long delays differ in no way, as none acts on the highest power."""
    lags = set().union(*parts)
    if len({lag.time for lag in lags}) == len(lags):
        return False
    terms = [(lag.time, p.degree()) for part in parts for lag, p in part.items()]
    late = max((degree for time, degree in terms if time), default=-1)
    return late < max((degree for time, degree in terms if not time), default=-1)


class Affine:
    """N and M as functions of one space, affine in some parameters.

    Parameters
    ----------
    n, m : sequences of parts
        What stands before 1 and before the parameters. Of an equation D is N, and M is zero.
    free : tuple of str
        The parameters.
    origin : tuple of float
        Their nominal values, or 0: next to them nothing cancels.
    step, at_zero
        As of `Space`.

    Attributes
    ----------
    n, m : list of Function
        What stands before 1 and before the parameters.
    """

    def __init__(
        self,
        n: Sequence[Part],
        m: Sequence[Part],
        free: tuple[str, ...],
        origin: tuple[float, ...],
        step: float,
        at_zero: int | None,
    ) -> None:
        self.free, self.origin, self.step = free, origin, step
        groups, shares = [], [exact(x) for x in (1, *origin)]
        for parts in (n, m):
            # What is left at the nominal values, where a loop is used, is one more sum.
            pairs = zip(parts, shares, strict=True)
            there = collected([(lag, p * x) for part, x in pairs for lag, p in part.items()])
            groups.append([there, *parts])
        made = functions(groups, step, at_zero)
        (n0, *self.n), (m0, *self.m) = made[: len(made) // 2], made[len(made) // 2 :]
        self._there = n0, m0

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

    @cached_property
    def _values(self) -> Quotient:
        n, m = (
            [there, *parts[1:]]
            for there, parts in zip(self._there, (self.n, self.m), strict=True)
        )
        return Quotient(n, () if self.m_is_zero else m)

    def values(
        self, s: ComplexArray, point: Sequence[float | FloatArray]
    ) -> tuple[ComplexArray, FloatArray]:
        """Evaluate N / M, or D, at s and values of the parameters, and bound the errors."""
        off = [x - x0 for x, x0 in zip(point, self.origin, strict=True)]

        def exactly(k: int) -> tuple[Function, Function]:
            here = (float(x[k]) if isinstance(x, np.ndarray) else x for x in point)
            return self.quotient(*here)

        return self._values.at(s, (1.0, *off), exactly)

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
    if not kept.size or space.lead[kept].any():
        return n, m
    left = [space.polynomials[j] for j in kept]
    own = Space(left, space.lags, space.step, space.at_zero)
    return Function(own, n.steady[kept], n.delayed[kept]), Function(
        own, m.steady[kept], m.delayed[kept]
    )
