"""The characteristic function that every loop of the paper shares.

Whatever the sensor and the controller, clearing denominators of 1 + L(s) leaves

    D(s; x, y) = A(s) - x B1(s) exp(-s delay1) - y B2(s) exp(-s delay2)

with real polynomials A, B1, B2: affine in the two free parameters. The
semi-discretized loop has the same form with polynomials in z = exp(s step)
instead of s, so that both are one class here and one set of algorithms above.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.validation import ComplexArray, FloatArray, axis, positive_number, real_number


class ExponentialSum(NamedTuple):
    """A function sum_g P_g(omega) exp(j omega phase_g) on the stability boundary.

    Attributes
    ----------
    coefficients : complex array, shape (groups, degree + 1)
        Polynomials in omega, ascending powers.
    phases : float array, shape (groups,)
        Phase rates, in s.
    """

    coefficients: ComplexArray
    phases: FloatArray

    def times_conjugate(self, other: ExponentialSum) -> ExponentialSum:
        """Return this sum times the complex conjugate of `other`, at real omega."""
        rows, phases = [], []
        for p, phase in zip(self.coefficients, self.phases, strict=True):
            for q, other_phase in zip(other.coefficients, other.phases, strict=True):
                rows.append(np.convolve(p, q.conj()))
                phases.append(phase - other_phase)
        return ExponentialSum(np.array(rows), np.array(phases))


class CharacteristicFunction:
    """D(s; x, y) = A - x B1 exp(-s delay1) - y B2 exp(-s delay2).

    Parameters
    ----------
    a, b1, b2 : sequence of float
        Polynomial coefficients in ascending powers of s (of z = exp(s step) for a map).
    delay1, delay2 : float
        Delays in s, zero or positive.
    step : float, optional
        Zero (default) for polynomials in s; the sampling step in s for a map.
    parameters : pair of str, optional
        Names of the two free parameters, used in messages and on axes.

    Raises
    ------
    TypeError, ValueError
        If a coefficient is not finite and real, a delay is negative, A is zero, or B1 or
        B2 has a higher degree than A (an advanced equation has no stable region).

    Notes
    -----
    The loop is of *retarded* type if B1 and B2 are of lower degree than A, and of *neutral*
    type (`neutral` is true) if one of them reaches it.
    """

    def __init__(
        self,
        a: Sequence[float] | FloatArray,
        b1: Sequence[float] | FloatArray,
        b2: Sequence[float] | FloatArray,
        delay1: float,
        delay2: float,
        *,
        step: float = 0.0,
        parameters: tuple[str, str] = ("x", "y"),
    ) -> None:
        self.a = _polynomial("a", a)
        self.b1 = _polynomial("b1", b1)
        self.b2 = _polynomial("b2", b2)
        self.delay1 = _delay("delay1", delay1)
        self.delay2 = _delay("delay2", delay2)
        self.step = 0.0 if step == 0.0 else positive_number("step", step)
        self.parameters = parameters
        if not self.a.any():
            raise ValueError("a must not be the zero polynomial")
        for name, b in (("b1", self.b1), ("b2", self.b2)):
            if b.size > self.a.size:
                raise ValueError(
                    f"{name} must not exceed the degree of a ({self.degree}), "
                    f"got degree {b.size - 1}: the equation would be of advanced type"
                )

    @property
    def degree(self) -> int:
        """Degree of A, the order of the equation."""
        return int(self.a.size - 1)

    @property
    def neutral(self) -> bool:
        """Whether a delayed term is of the same order as A."""
        return any(
            b.size == self.a.size and delay > 0.0
            for b, delay in ((self.b1, self.delay1), (self.b2, self.delay2))
        )

    @property
    def longest_delay(self) -> float:
        """The longer of the two delays, in s."""
        return max(self.delay1, self.delay2)

    def __repr__(self) -> str:
        """Name the class and its three polynomials."""
        return (
            f"{type(self).__name__}(a={self.a.tolist()}, b1={self.b1.tolist()}, "
            f"b2={self.b2.tolist()}, delay1={self.delay1}, delay2={self.delay2})"
        )

    def parts(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Evaluate A, B1 exp(-s delay1) and B2 exp(-s delay2).

        Parameters
        ----------
        s : array_like of complex
            Laplace variable in rad/s, any shape.

        Returns
        -------
        tuple of three complex arrays, shaped like `s`
        """
        s = np.asarray(s, dtype=np.complex128)
        z = np.exp(s * self.step) if self.step else s
        return (
            np.asarray(poly.polyval(z, self.a), dtype=np.complex128),
            np.asarray(poly.polyval(z, self.b1) * np.exp(-s * self.delay1)),
            np.asarray(poly.polyval(z, self.b2) * np.exp(-s * self.delay2)),
        )

    def __call__(self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike) -> ComplexArray:
        """Evaluate D(s; x, y); the three arguments broadcast."""
        a, b1, b2 = self.parts(s)
        result: ComplexArray = a - np.asarray(x) * b1 - np.asarray(y) * b2
        return result

    def derivative(self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike) -> ComplexArray:
        """Evaluate dD/ds; the three arguments broadcast."""
        s = np.asarray(s, dtype=np.complex128)
        z = np.exp(s * self.step) if self.step else s
        dz = self.step * z if self.step else np.ones_like(s)

        def term(p: FloatArray, delay: float) -> ComplexArray:
            slope = poly.polyval(z, poly.polyder(p)) * dz - delay * poly.polyval(z, p)
            return np.asarray(slope * np.exp(-s * delay), dtype=np.complex128)

        result: ComplexArray = (
            term(self.a, 0.0)
            - np.asarray(x) * term(self.b1, self.delay1)
            - np.asarray(y) * term(self.b2, self.delay2)
        )
        return result

    def shifted(self, sigma: float) -> CharacteristicFunction:
        """Return the function s -> D(s + sigma), whose roots lie `sigma` further left.

        Counting its unstable roots counts the roots of D to the right of Re s = sigma.
        """
        sigma = real_number("sigma", sigma)

        def move(p: FloatArray, delay: float) -> FloatArray:
            if self.step:
                moved = p * np.exp(sigma * self.step * np.arange(p.size))
            else:
                moved = _taylor_shift(p, sigma)
            return np.asarray(moved * np.exp(-sigma * delay))

        return CharacteristicFunction(
            move(self.a, 0.0),
            move(self.b1, self.delay1),
            move(self.b2, self.delay2),
            self.delay1,
            self.delay2,
            step=self.step,
            parameters=self.parameters,
        )

    def exchanged(self) -> CharacteristicFunction:
        """Return the same function with its two free parameters exchanged."""
        return CharacteristicFunction(
            self.a,
            self.b2,
            self.b1,
            self.delay2,
            self.delay1,
            step=self.step,
            parameters=self.parameters[::-1],
        )

    def on_boundary(self) -> tuple[ExponentialSum, ExponentialSum, ExponentialSum]:
        """Return A, B1 and B2 (with their delays) at s = j omega as exponential sums."""

        def convert(p: FloatArray, delay: float) -> ExponentialSum:
            if self.step:
                rates = np.asarray(self.step * np.arange(p.size) - delay, dtype=np.float64)
                return ExponentialSum(p[:, None].astype(np.complex128), rates)
            powers = 1j ** (np.arange(p.size) % 4)
            # Each coefficient is kept exactly real or exactly imaginary.
            powers = np.round(powers.real) + 1j * np.round(powers.imag)
            return ExponentialSum((p * powers)[None, :], np.array([-delay]))

        return (
            convert(self.a, 0.0),
            convert(self.b1, self.delay1),
            convert(self.b2, self.delay2),
        )


def _taylor_shift(p: FloatArray, sigma: float) -> FloatArray:
    """Return the coefficients of p(s + sigma) by repeated synthetic division."""
    shifted = p.copy()
    for i in range(shifted.size - 1):
        for k in range(shifted.size - 2, i - 1, -1):
            shifted[k] += sigma * shifted[k + 1]
    return shifted


def _polynomial(name: str, coefficients: Sequence[float] | FloatArray) -> FloatArray:
    """Return trimmed, read-only coefficients with at least one entry."""
    values = axis(name, coefficients)
    trimmed = np.array(poly.polytrim(values, tol=0.0), dtype=np.float64)
    trimmed.setflags(write=False)
    return trimmed


def _delay(name: str, value: float) -> float:
    """Return a finite delay that is zero or positive."""
    delay = real_number(name, value)
    if delay < 0.0:
        raise ValueError(f"{name} must not be negative, got {delay}")
    return delay


__all__ = ["CharacteristicFunction", "ExponentialSum"]
