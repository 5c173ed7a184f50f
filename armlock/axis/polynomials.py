"""Real polynomials of s with their roots: how they are found, and by how much they miss.

Where roots are known they define the polynomial: next to one, coefficients cancel.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mpmath
import numpy as np
from numpy.polynomial import polynomial as poly

from armlock.axis.compiled import njit
from armlock.axis.rounding import EPSILON
from armlock.checks import ComplexArray, FloatArray


def quotients(
    zeros: ComplexArray, poles: ComplexArray, lead: float, s: ComplexArray
) -> ComplexArray:
    """Evaluate `lead` times the product of s - zeros over that of s - poles, at any s."""
    found: ComplexArray = _quotients(zeros, poles, complex(lead), np.ravel(s))
    return found.reshape(s.shape)


@njit(error_model="numpy")
def _quotients(
    zeros: ComplexArray, poles: ComplexArray, lead: complex, s: ComplexArray
) -> ComplexArray:
    found = np.full(s.size, lead)
    for i in range(s.size):
        # In turn, so that the product neither overflows nor underflows on the way.
        for k in range(max(zeros.size, poles.size)):
            if k < zeros.size:
                found[i] *= s[i] - zeros[k]
            if k < poles.size:
                found[i] /= s[i] - poles[k]
    return found


class Polynomial(NamedTuple):
    """A real polynomial of s: its coefficients in ascending powers, and its roots.

    Attributes
    ----------
    coefficients : float array, shape (n + 1,)
        In ascending powers of s.
    roots : complex array, shape (n,)
        They define the polynomial where they are known; else they are found.
    leads : tuple of float
        Of a product the highest coefficients of its factors: their product may overflow.
    missed : float
        By how much the roots miss the polynomial at any s, over its highest coefficient times
        the product of |s| + |root|. Zero where the roots define it.
    """

    coefficients: FloatArray
    roots: ComplexArray
    leads: tuple[float, ...] = ()
    missed: float = 0.0

    def __eq__(self, other: object) -> bool:
        """Whether coefficients and roots are equal."""
        return isinstance(other, Polynomial) and self._numbers() == other._numbers()

    def __hash__(self) -> int:
        """Return a number that equal ones share."""
        return hash(self._numbers())

    def __repr__(self) -> str:
        """List the coefficients."""
        return repr(self.coefficients.tolist())

    def _numbers(self) -> tuple[complex, ...]:
        return *self.coefficients.tolist(), *self.roots.tolist()

    @classmethod
    def of(cls, coefficients: FloatArray, guess: ComplexArray | None = None) -> Polynomial:
        """Return the polynomial with these coefficients, and roots that are found.

        They are a guess, or found in double precision, if that gives the coefficients to a part
        in a million; if not, in extended precision. What they miss is kept, see `missed`.
        """
        found = poly.polyroots(coefficients).astype(np.complex128) if guess is None else guess
        missed = _missed(found, coefficients)
        if missed <= 1e-6:
            return cls(coefficients, found, missed=missed)
        if guess is not None:
            return cls.of(coefficients)
        start = {"asc": True, "roots_init": found.tolist()}
        with mpmath.workdps(60):
            try:
                exact = mpmath.polyroots(
                    coefficients.tolist(), maxsteps=500, extraprec=400, **start
                )
            except mpmath.libmp.NoConvergence:
                raise ValueError(
                    f"no roots of the polynomial {coefficients} are found"
                ) from None
        found = np.array([complex(root) for root in exact])
        return cls(coefficients, found, missed=_missed(found, coefficients))

    def evaluated(self, s: Any) -> tuple[Any, Any]:
        """Value and derivative at s, in numpy's or mpmath's numbers."""
        value, slope = 0.0 * s, 0.0 * s
        if self.missed:
            for coefficient in self.coefficients[::-1].tolist():
                value, slope = value * s + coefficient, slope * s + value
            return value, slope
        value = value + float(self.coefficients[-1])
        for root in self.roots.tolist():
            value, slope = value * (s - root), slope * (s - root) + value
        return value, slope

    def without_zeros(self, number: int) -> Polynomial:
        """Return p(s) / s^number, for as many roots that are exactly zero."""
        others = np.concatenate(
            (self.roots[self.roots == 0.0][number:], self.roots[self.roots != 0.0])
        )
        return Polynomial(self.coefficients[number:], others, self.leads, self.missed)

    def over(self, other: Polynomial, s: ComplexArray) -> ComplexArray:
        """Evaluate p(s) / q(s), factor by factor."""
        lead = float(self.coefficients[-1] / other.coefficients[-1])
        return quotients(self.roots, other.roots, lead, s)

    def times_conjugate(self, other: Polynomial) -> Polynomial:
        """Return p q*, where q*(j omega) is the complex conjugate of q(j omega)."""
        # The coefficients are real: q*(s) = q(-s).
        signs = (-1.0) ** np.arange(other.coefficients.size)
        with np.errstate(over="ignore", invalid="ignore"):
            product = np.convolve(self.coefficients, signs * other.coefficients)
        leads = self.coefficients[-1], signs[-1] * other.coefficients[-1]
        missed = (1.0 + self.missed) * (1.0 + other.missed) - 1.0
        return Polynomial(product, np.concatenate((self.roots, -other.roots)), leads, missed)


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
