"""Real polynomials of s, with their roots, and the numbers of python-flint."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from itertools import zip_longest
from operator import mul
from typing import Any

import flint
import mpmath
import numpy as np

from armlock.checks import ComplexArray, FloatArray
from armlock.engine.inclusion import EPSILON

# Bits to which roots are found; lightly damped pairs keep the digits of their damping.
_BITS = 128


@dataclass(frozen=True)
class Polynomial:
    """A real polynomial of s, exactly.

    Attributes
    ----------
    lead : Fraction
        The highest coefficient.
    roots : tuple of complex
        In conjugate pairs. They define the polynomial, or were computed.
    computed : frozenset of int
        Places of the roots that were computed; the others are exact.
    factors : tuple of tuple of Fraction
        The monic polynomials of which the computed roots are those, ascending.
    missed : float
        By how much the polynomial that has the computed roots is missed at any s, over the
        product of abs(s) + abs(root) of these roots.
    """

    lead: Fraction
    roots: tuple[complex, ...]
    computed: frozenset[int] = frozenset()
    factors: tuple[tuple[Fraction, ...], ...] = ()
    missed: float = 0.0

    @classmethod
    def of(cls, coefficients: Iterable[Any]) -> Polynomial:
        """Return the polynomial with these coefficients, ascending; zero has degree 0."""
        left = polynomial(coefficients)
        if not left:
            return cls(Fraction(0), ())
        lead, known, computed = left.leading_coefficient(), [], []
        left /= lead
        for root, number in _roots(left):
            factor = _factor(root) ** number
            pair = [root, root.conjugate()] if root.imag else [root]
            if left % factor:
                computed += pair * number
            else:
                left //= factor
                known += pair * number
        return cls(
            fraction(lead),
            (*known, *computed),
            frozenset(range(len(known), len(known) + len(computed))),
            (fractions(left),) if computed else (),
            # Each of them is rounded by half an EPSILON.
            0.51 * EPSILON * len(computed),
        )

    @classmethod
    def of_roots(cls, roots: Iterable[complex], lead: float = 1.0) -> Polynomial:
        """Return the polynomial with these roots, which come in conjugate pairs."""
        return cls(Fraction(lead), tuple(complex(root) for root in roots))

    def __mul__(self, other: Polynomial) -> Polynomial:
        """Return the product, with the roots of both."""
        if not (self and other):
            return Polynomial(Fraction(0), ())
        moved = frozenset(len(self.roots) + k for k in other.computed)
        return Polynomial(
            self.lead * other.lead,
            self.roots + other.roots,
            self.computed | moved,
            self.factors + other.factors,
            (1.0 + self.missed) * (1.0 + other.missed) - 1.0,
        )

    def __add__(self, other: Polynomial) -> Polynomial:
        """Return the sum."""
        return Polynomial.of((polynomial(self.exact) + polynomial(other.exact)).coeffs())

    def __bool__(self) -> bool:
        """Whether it is not zero."""
        return self.lead != 0

    def __repr__(self) -> str:
        """List the coefficients."""
        return repr(self.coefficients.tolist())

    @property
    def degree(self) -> int:
        """The degree."""
        return len(self.roots)

    @property
    def order(self) -> int:
        """Order of the root at s = 0."""
        return self.roots.count(0j)

    @cached_property
    def exact(self) -> tuple[Fraction, ...]:
        """Coefficients in ascending powers of s, exactly."""
        given = [root for k, root in enumerate(self.roots) if k not in self.computed]
        known = [_factor(root) for root in given if root.imag >= 0.0]
        found = reduce(mul, map(polynomial, self.factors), polynomial([self.lead]))
        return fractions(reduce(mul, known, found)) or (Fraction(0),)

    @cached_property
    def coefficients(self) -> FloatArray:
        """Coefficients in ascending powers of s, rounded; inf where a number overflows."""
        return rounded(self.exact)

    def shifted(self, sigma: float) -> Polynomial:
        """Return p(s + sigma), from its coefficients."""
        return Polynomial.of(polynomial(self.exact)(polynomial([sigma, 1])).coeffs())

    def over(self, other: Polynomial, s: ComplexArray) -> ComplexArray:
        """Evaluate p(s) / q(s), factor by factor."""
        return quotients(self.roots, other.roots, float(self.lead / other.lead), s)

    def evaluated(self, s: Any) -> tuple[Any, Any]:
        """Value and derivative at s, in numpy's or mpmath's numbers."""
        value, slope = 0.0 * s + _in(s, self.lead), 0.0 * s
        for k, root in enumerate(self.roots):
            if k not in self.computed:
                value, slope = value * (s - root), slope * (s - root) + value
        for factor in self.factors:
            p, dp = 0.0 * s, 0.0 * s
            for c in reversed(factor):
                p, dp = p * s + _in(s, c), dp * s + p
            value, slope = value * p, slope * p + value * dp
        return value, slope


@np.errstate(under="ignore")
def quotients(
    zeros: Sequence[complex], poles: Sequence[complex], lead: float, s: ComplexArray
) -> ComplexArray:
    """Evaluate `lead` times the product of s - zeros over that of s - poles, at any s."""
    found = np.full(s.shape, complex(lead))
    with np.errstate(divide="ignore", invalid="ignore"):
        # In turn, so that the product neither overflows nor underflows on the way.
        for zero, pole in zip_longest(zeros, poles):
            if zero is not None:
                found *= s - zero
            if pole is not None:
                found /= s - pole
    return found


def exact(value: Any) -> flint.fmpq:
    """Return a number as a fraction of python-flint; a float is the binary number it is."""
    if isinstance(value, flint.fmpq):
        return value
    return flint.fmpq(*Fraction(value).as_integer_ratio())


def polynomial(coefficients: Iterable[Any]) -> flint.fmpq_poly:
    """Return the polynomial of python-flint with these coefficients, ascending."""
    return flint.fmpq_poly([exact(c) for c in coefficients])


def fraction(value: flint.fmpq) -> Fraction:
    """Return a fraction of python-flint as one of Python, which has a hash and is pickled."""
    return Fraction(int(value.p), int(value.q))


def fractions(p: flint.fmpq_poly) -> tuple[Fraction, ...]:
    """Return the coefficients of a polynomial of python-flint, ascending."""
    return tuple(fraction(c) for c in p.coeffs())


def on_axis(p: flint.fmpq_poly, q: flint.fmpq_poly) -> flint.fmpq_poly:
    """Return Re(p conj(q)) at s = j omega as a polynomial of omega^2."""
    product = p * q(polynomial([0, -1]))
    return flint.fmpq_poly([(-1) ** k * c for k, c in enumerate(product.coeffs()[::2])])


def _factor(root: complex) -> Any:
    """Return s - root, or for a complex root the product with its conjugate."""
    a, b = Fraction(root.real), Fraction(root.imag)
    return polynomial([a * a + b * b, -2 * a, 1] if b else [-a, 1])


def _roots(p: Any) -> list[tuple[complex, int]]:
    """Return the roots with Im s >= 0 and their multiplicities, rounded, and certified."""
    with flint.ctx.workprec(_BITS):
        found = p.complex_roots()
    # What rounding may leave of the real part of an undamped pair is none.
    rounded = [
        (complex(0.0 if z.real.contains(0) else float(z.real), float(z.imag)), number)
        for z, number in found
    ]
    return [(root, number) for root, number in rounded if root.imag >= 0.0]


def rounded(coefficients: Iterable[Fraction]) -> FloatArray:
    """Return fractions as floats; inf where one overflows."""
    found = []
    for value in coefficients:
        try:
            found.append(float(value))
        except OverflowError:
            found.append(np.inf if value > 0 else -np.inf)
    return np.array(found)


def _in(s: Any, value: Fraction) -> Any:
    """Return a fraction in the numbers of s."""
    if isinstance(s, mpmath.ctx_mp_python.mpnumeric):
        return mpmath.mpf(value.numerator) / value.denominator
    return float(value)
