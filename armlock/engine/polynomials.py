"""Real polynomials of s, from their coefficients, with their roots."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
from numpy.polynomial import polynomial as poly

from armlock.checks import ComplexArray, FloatArray
from armlock.engine.inclusion import EPSILON

#: Number of lowest coefficients that are kept exactly.
LOWEST = 16


@dataclass(frozen=True)
class Polynomial:
    """A real polynomial of s.

    Attributes
    ----------
    lead : float
        The highest coefficient.
    roots : tuple of complex
        In conjugate pairs. They define the polynomial, or were computed.
    lowest : tuple of Fraction
        The lowest coefficients, up to 16 of them, exactly.
    computed : frozenset of int
        Places of the roots that were computed; the others are exact.
    factors : tuple of tuple of Fraction
        The monic polynomials of which the computed roots are those, ascending.
    missed : float
        By how much the polynomial that has the computed roots is missed at any s, over the
        product of abs(s) + abs(root) of these roots.
    rounded : bool
        Whether all roots are rounded, by half an EPSILON of their size each.
    """

    lead: float
    roots: tuple[complex, ...]
    lowest: tuple[Fraction, ...]
    computed: frozenset[int] = frozenset()
    factors: tuple[tuple[Fraction, ...], ...] = ()
    missed: float = 0.0
    rounded: bool = False

    @classmethod
    def of(cls, coefficients: Iterable[Any]) -> Polynomial:
        """Return the polynomial with these coefficients, ascending; zero has none.

        Raises
        ------
        ValueError
            If its roots are not found.
        """
        exact = [Fraction(value) for value in coefficients]
        while exact and exact[-1] == 0:
            exact.pop()
        if not exact:
            return cls(0.0, (), ())
        at_zero = next(k for k, value in enumerate(exact) if value)
        other = np.array([float(value) for value in exact[at_zero:]])
        roots = _roots(other)
        missed = _missed(roots, other) if roots.size else 0.0
        return cls(
            float(exact[-1]),
            (0j,) * at_zero + tuple(roots.tolist()),
            tuple(exact[:LOWEST]),
            frozenset(range(at_zero, at_zero + roots.size)),
            (tuple(value / exact[-1] for value in exact[at_zero:]),) if roots.size else (),
            missed,
        )

    @property
    def degree(self) -> int:
        """The degree; 0 of zero."""
        return len(self.roots)

    @cached_property
    def coefficients(self) -> FloatArray:
        """Coefficients in ascending powers of s."""
        if len(self.lowest) == len(self.roots) + 1:
            return np.array([float(value) for value in self.lowest])
        found = np.array([complex(self.lead)])
        for root in sorted(self.roots, key=abs):
            found = np.convolve(found, [-root, 1.0])
        return np.array(found.real if self else [0.0], dtype=np.float64)

    def evaluated(self, s: Any) -> tuple[Any, Any]:
        """Value and derivative at s, in numpy's or mpmath's numbers."""
        value, slope = 0.0 * s + self.lead, 0.0 * s
        for k, root in enumerate(self.roots):
            if k not in self.computed:
                value, slope = value * (s - root), slope * (s - root) + value
        for factor in self.factors:
            p, dp = 0.0 * s, 0.0 * s
            for c in reversed(factor):
                p, dp = p * s + _in(s, c), dp * s + p
            value, slope = value * p, slope * p + value * dp
        return value, slope


def _in(s: Any, value: Fraction) -> Any:
    """Return a fraction in the numbers of s."""
    if isinstance(s, mpmath.ctx_mp_python.mpnumeric):
        return mpmath.mpf(value.numerator) / value.denominator
    return float(value)


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
    """By how much roots miss the polynomial with these coefficients, see `Polynomial.missed`.

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
