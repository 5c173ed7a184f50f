"""Real polynomials of s, with their roots; exact numbers are those of python-flint."""

from __future__ import annotations

import copyreg
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from math import factorial
from operator import mul
from typing import Any, TypeVar

import flint
import numpy as np
from flint import fmpq, fmpq_poly

from armlock.checks import FloatArray
from armlock.engine.tolerances import EPSILON

_Key = TypeVar("_Key")
_Term = TypeVar("_Term", bound=Any)

# Bits to which roots are found; lightly damped pairs keep the digits of their damping.
_BITS = 128

# python-flint pickles its fractions, but not its polynomials.
copyreg.pickle(fmpq_poly, lambda p: (fmpq_poly, (p.coeffs(),)))


@dataclass(frozen=True)
class Polynomial:
    """A real polynomial of s, exactly.

    Attributes
    ----------
    exact : fmpq_poly
        The polynomial of python-flint.
    roots : tuple of complex
        In conjugate pairs.
    computed : frozenset of int
        Places of the roots that are rounded; the others are exact.
    missed : float
        By how much the polynomial that has the computed roots is missed at any s, over the
        product of abs(s) + abs(root) of these roots.
    """

    exact: fmpq_poly
    roots: tuple[complex, ...]
    computed: frozenset[int] = frozenset()
    missed: float = 0.0

    @classmethod
    def of(cls, coefficients: fmpq_poly | Iterable[Any]) -> Polynomial:
        """Return the polynomial with these coefficients, ascending; zero has degree 0."""
        return _factored(tuple(polynomial(coefficients).coeffs()))

    def __bool__(self) -> bool:
        """Whether it is not zero."""
        return bool(self.exact)

    def __repr__(self) -> str:
        """List the coefficients, rounded."""
        return repr(rounded(self.exact.coeffs()).tolist())

    @cached_property
    def lead(self) -> fmpq:
        """The highest coefficient."""
        return self.exact.leading_coefficient() if self.exact else fmpq(0)

    @property
    def degree(self) -> int:
        """The degree."""
        return len(self.roots)


@lru_cache(1 << 12)
def _factored(coefficients: tuple[fmpq, ...]) -> Polynomial:
    """Find the roots, once for all loops that differ in delays and parameters alone."""
    p = fmpq_poly(list(coefficients))
    if not p:
        return Polynomial(p, ())
    left, known, computed = p / p.leading_coefficient(), [], []
    for root, number in _roots(left):
        rest, missed = divmod(left, _factor(root) ** number)
        pair = [root, root.conjugate()] if root.imag else [root]
        if missed:
            computed += pair * number
        else:
            left = rest
            known += pair * number
    places = range(len(known), len(known) + len(computed))
    # Each of them is rounded by half an EPSILON.
    return Polynomial(p, (*known, *computed), frozenset(places), 0.51 * EPSILON * len(computed))


def exact(value: Any) -> fmpq:
    """Return a number as a fraction of python-flint; a float is the binary number it is."""
    return value if isinstance(value, fmpq) else fmpq(*value.as_integer_ratio())


def polynomial(coefficients: fmpq_poly | Iterable[Any]) -> fmpq_poly:
    """Return the polynomial of python-flint with these coefficients, ascending."""
    if isinstance(coefficients, fmpq_poly):
        return coefficients
    return fmpq_poly([exact(c) for c in coefficients])


def collected(terms: Iterable[tuple[_Key, _Term]]) -> dict[_Key, _Term]:
    """Return terms by their keys, those of one key added."""
    found: dict[_Key, _Term] = {}
    for key, term in terms:
        found[key] = found[key] + term if key in found else term
    return found


def order(coefficients: Sequence[Any]) -> int:
    """Return the place of the first coefficient that is not zero, or their number."""
    for k, c in enumerate(coefficients):
        if c:
            return k
    return len(coefficients)


def on_axis(p: fmpq_poly, q: fmpq_poly) -> fmpq_poly:
    """Return Re(p conj(q)) at s = j omega as a polynomial of omega^2."""
    product = p * q(polynomial([0, -1]))
    return fmpq_poly([(-1) ** k * c for k, c in enumerate(product.coeffs()[::2])])


def series(parts: Iterable[tuple[fmpq, fmpq_poly]], number: int) -> list[fmpq]:
    """Return the first coefficients at s = 0 of a sum of polynomials times exp(-s theta)."""
    whole = fmpq_poly([0])
    for theta, p in parts:
        whole += p * fmpq_poly([(-theta) ** k / factorial(k) for k in range(number)])
    return [whole[k] for k in range(number)]


def of_roots(roots: Iterable[complex]) -> fmpq_poly:
    """Return the monic polynomial with these roots, which come in conjugate pairs."""
    return reduce(mul, (_factor(root) for root in roots if root.imag >= 0.0), fmpq_poly([1]))


def _factor(root: complex) -> Any:
    """Return s - root, or for a complex root the product with its conjugate."""
    a, b = exact(root.real), exact(root.imag)
    return fmpq_poly([a * a + b * b, -2 * a, 1] if b else [-a, 1])


def enclosed_roots(p: fmpq_poly) -> Any:
    """Return the roots and their multiplicities, each root in a ball that holds it alone."""
    return p.complex_roots()


def _roots(p: fmpq_poly) -> list[tuple[complex, int]]:
    """Return the roots with Im s >= 0 and their multiplicities, rounded, and certified."""
    with flint.ctx.workprec(_BITS):
        found = enclosed_roots(p)
    # What rounding may leave of the real part of an undamped pair is none.
    rounded = [
        (complex(0.0 if z.real.contains(0) else float(z.real), float(z.imag)), number)
        for z, number in found
    ]
    return [(root, number) for root, number in rounded if root.imag >= 0.0]


def rounded(coefficients: Iterable[fmpq]) -> FloatArray:
    """Return fractions as floats; inf where one overflows."""
    found = []
    for value in coefficients:
        try:
            found.append(float(value))
        except OverflowError:
            found.append(np.inf if value > 0 else -np.inf)
    return np.array(found)
