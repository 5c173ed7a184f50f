"""Real polynomials of s, from their coefficients, with their roots."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import zip_longest
from typing import Any

import mpmath
import numpy as np
from numpy.polynomial import polynomial as poly

from armlock.checks import ComplexArray, FloatArray
from armlock.engine.inclusion import EPSILON


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
        """Return the polynomial with these coefficients, ascending; zero has degree 0.

        Raises
        ------
        ValueError
            If its roots are not found.
        """
        exact = [Fraction(value) for value in coefficients]
        while exact and exact[-1] == 0:
            exact.pop()
        if not exact:
            return cls(Fraction(0), ())
        at_zero = next(k for k, value in enumerate(exact) if value)
        scaled, scale = _scaled(exact[at_zero:])
        other = np.array([float(value) for value in scaled])
        roots = _roots(other)
        if not roots.size:
            return cls(exact[-1], (0j,) * at_zero)
        return cls(
            exact[-1],
            (0j,) * at_zero + tuple((scale * roots).tolist()),
            frozenset(range(at_zero, at_zero + roots.size)),
            (tuple(value / exact[-1] for value in exact[at_zero:]),),
            _missed(roots, other),
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

    def over_powers(self, number: int) -> Polynomial:
        """Return p(s) / s^number, for as many roots at s = 0."""
        gone = [k for k, root in enumerate(self.roots) if root == 0j][:number]
        left = [k for k in range(len(self.roots)) if k not in gone]
        computed = frozenset(i for i, k in enumerate(left) if k in self.computed)
        return replace(self, roots=tuple(self.roots[k] for k in left), computed=computed)

    @cached_property
    def exact(self) -> tuple[Fraction, ...]:
        """Coefficients in ascending powers of s, exactly."""
        found = [self.lead]
        for k, root in enumerate(self.roots):
            a, b = Fraction(root.real), Fraction(root.imag)
            if k not in self.computed and b == 0:
                found = _product(found, [-a, Fraction(1)])
            elif k not in self.computed and b > 0:
                found = _product(found, [a * a + b * b, -2 * a, Fraction(1)])
        for factor in self.factors:
            found = _product(found, factor)
        return tuple(found)

    @cached_property
    def coefficients(self) -> FloatArray:
        """Coefficients in ascending powers of s, rounded; inf where a number overflows."""
        return rounded(self.exact)

    def shifted(self, sigma: float) -> Polynomial:
        """Return p(s + sigma), from its coefficients."""
        moved: list[Fraction] = []
        for value in reversed(self.exact):
            # Horner's rule, with s + sigma in place of s.
            moved = _product(moved, [Fraction(sigma), Fraction(1)]) if moved else [Fraction(0)]
            moved[0] += value
        return Polynomial.of(moved)

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


def _product(p: Sequence[Fraction], q: Sequence[Fraction]) -> list[Fraction]:
    """Multiply two polynomials in ascending powers."""
    found = [Fraction(0)] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for k, b in enumerate(q):
            found[i + k] += a * b
    return found


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


def _scaled(exact: Sequence[Fraction]) -> tuple[Sequence[Fraction], float]:
    """Return a polynomial in s / scale, so that its coefficients are floats."""
    sizes = np.abs(rounded(exact))
    if all(
        1e-250 < size < 1e250 or not value for value, size in zip(exact, sizes, strict=True)
    ):
        return exact, 1.0
    n = len(exact) - 1
    ratio = abs(exact[0] / exact[-1])
    power = (ratio.numerator.bit_length() - ratio.denominator.bit_length()) // max(n, 1)
    # A power of two changes no digits.
    scale = Fraction(2) ** power
    return [v * scale ** (k - n) / exact[-1] for k, v in enumerate(exact)], float(scale)


def _roots(coefficients: FloatArray) -> ComplexArray:
    """Return roots of a polynomial with p(0) != 0, in extended precision where it is needed."""
    found = poly.polyroots(coefficients).astype(np.complex128)
    if found.size == 0 or _missed(found, coefficients) <= 1e-6:
        return found
    with mpmath.workdps(60):
        try:
            exact = mpmath.polyroots(
                coefficients.tolist(),
                maxsteps=500,
                extraprec=400,
                asc=True,
                roots_init=found.tolist(),
            )
        except mpmath.libmp.NoConvergence:
            raise ValueError(f"no roots of the polynomial {coefficients} are found") from None
    return np.array([complex(root) for root in exact])


def _missed(roots: ComplexArray, coefficients: FloatArray) -> float:
    """By how much roots miss the polynomial with these coefficients, see Lemma 5.

    A power of s that is off by no more than this share of what the magnitudes of the roots give
    is off by no more than it at any s. The product itself rounds, two EPSILON a root.
    """
    product = np.array(coefficients[-1:], dtype=np.complex128)
    magnitude = np.abs(coefficients[-1:])
    for root in roots[np.argsort(np.abs(roots))]:
        product = np.convolve(product, [-root, 1.0])
        magnitude = np.convolve(magnitude, [abs(root), 1.0])
    off = np.abs(product - coefficients)
    if not (off <= magnitude).all():
        return np.inf
    shares = off[magnitude > 0.0] / magnitude[magnitude > 0.0]
    return float(shares.max(initial=0.0)) + 2.0 * EPSILON * roots.size
