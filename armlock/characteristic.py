"""The characteristic function that every loop of the paper shares.

Whatever the sensor and the controller, clearing denominators of 1 + L(s) leaves

    D(s; x, y) = R + exp(-s delay) [ B1 (x0 - x exp(-s delay1)) + B2 (y0 - y exp(-s delay2)) ]

with real polynomials R, B1, B2 of s: affine in the two free parameters x and y. The dead time
`delay` is zero unless the loop has one. At x = x0 and y = y0, which is (1, 1) for an
arm-locking loop, both parentheses are zero at s = 0. Near that point no large terms cancel.

The semi-discretized loop has the same form with polynomials in z = exp(s step) instead of s.
So both are one class here, and one set of algorithms serves both.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.axis.exponentials import EPSILON, LOW_DEGREE, ExponentialSum, Polynomial
from armlock.checks import (
    ComplexArray,
    FloatArray,
    as_written,
    axis,
    broadcast_shape,
    complex_array,
    real_array,
    real_number,
    whole_steps,
)

# Past this an exponential is no float.
_LARGEST_EXPONENT = 700.0


class CharacteristicFunction:
    r"""A characteristic function that is affine in two free parameters x and y.

    .. math::

        D(s; x, y) = R + e^{-s\delta} \left[ B_1 \left( x_0 - x\, e^{-s\theta_1} \right)
        + B_2 \left( y_0 - y\, e^{-s\theta_2} \right) \right]

    with polynomials R, B1 and B2 of s, a dead time :math:`\delta` and delays
    :math:`\theta_1, \theta_2`. Sorted by delays it is

    .. math::

        D(s; x, y) = A + C\, e^{-s\delta} - x\, B_1 e^{-s(\delta + \theta_1)}
        - y\, B_2 e^{-s(\delta + \theta_2)} ,

    With a dead time A = R and C = x0 B1 + y0 B2. Without one A = R + x0 B1 + y0 B2 and C = 0.

    Parameters
    ----------
    rest, b1, b2 : sequence of float, or armlock.axis.exponentials.Polynomial
        Coefficients of R, B1 and B2 in ascending powers of s (of z = exp(s step) for a map);
        or polynomials with known roots, which are then kept.
    delay1, delay2 : float
        Delays in s, zero or positive.
    delay : float, optional
        Dead time in s, zero or positive.
    step : float, optional
        Zero (default) for polynomials in s; the sampling step in s for a map, which must
        divide all delays.
    parameters : pair of str, optional
        Names of the two free parameters, used in messages and on axes.
    reference : pair of float, optional
        The constants (x0, y0); (1, 1) for a loop, where R is the denominator of L.

    Attributes
    ----------
    a, c : float array
        The coefficients of A and C above; c is zero without a dead time.

    Raises
    ------
    TypeError, ValueError
        If a coefficient is not finite and real, a delay is negative or not a whole number of
        steps, A is zero, or another term has a higher degree than A (an advanced equation has
        no stable region).

    Notes
    -----
    It cannot be changed once it is made, because results are kept with it; its arrays are
    read-only.

    The equation is of *retarded* type if all delayed terms are of lower degree than A, and of
    *neutral* type (`neutral` is true) if one of them reaches it. The roots of a neutral
    equation at high frequency form the *neutral root chain*, see `chain_reserve`.

    Examples
    --------
    An oscillator with two delayed forces, x'' + 0.2 x' + x = x1 x(t - 1) + x2 x(t - 2):

    >>> from armlock import CharacteristicFunction, unstable_roots
    >>> a, b1, b2 = [1.0, 0.2, 1.0], [1.0], [1.0]
    >>> forced = CharacteristicFunction(a, b1, b2, delay1=1.0, delay2=2.0)
    >>> unstable_roots(forced, [0.1, -0.5], 0.05)
    array([0, 2])
    """

    def __init__(
        self,
        rest: Sequence[float] | FloatArray | Polynomial,
        b1: Sequence[float] | FloatArray | Polynomial,
        b2: Sequence[float] | FloatArray | Polynomial,
        delay1: float,
        delay2: float,
        *,
        delay: float = 0.0,
        step: float = 0.0,
        parameters: tuple[str, str] = ("x", "y"),
        reference: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self._polynomials = tuple(
            _polynomial(name, p) for name, p in (("rest", rest), ("b1", b1), ("b2", b2))
        )
        self.rest, self.b1, self.b2 = (p.coefficients for p in self._polynomials)
        pair = axis("reference", reference)
        if pair.size != 2:
            raise ValueError(f"reference must hold two numbers, got {pair.size}")
        self.reference = (float(pair[0]), float(pair[1]))
        self.delay = _not_negative("delay", delay)
        self.delay1 = _not_negative("delay1", delay1)
        self.delay2 = _not_negative("delay2", delay2)
        self.step = _not_negative("step", step)
        if self.step:
            for name in ("delay", "delay1", "delay2"):
                whole_steps(name, getattr(self, name), self.step)
        self.parameters = parameters
        c = poly.polyadd(self.reference[0] * self.b1, self.reference[1] * self.b2)
        if self.delay == 0.0:
            self.a = _trimmed("a", np.asarray(poly.polyadd(self.rest, c)))
            self.c = _trimmed("c", [0.0])
        else:
            self.a, self.c = self.rest, _trimmed("c", np.asarray(c))
        if not self.a.any():
            raise ValueError(
                f"A, the term without a delay, must not vanish, got rest={self.rest.tolist()}"
            )
        for name, b in (("b1", self.b1), ("b2", self.b2), ("c", self.c)):
            if b.size > self.a.size:
                raise ValueError(
                    f"{name} must not exceed the degree of A ({self.degree}), "
                    f"got degree {b.size - 1}: the equation would be of advanced type"
                )
        for name, b, lag in (("b1", self.b1, self.delay1), ("b2", self.b2, self.delay2)):
            if lag + self.delay == 0.0 and b.size == self.a.size:
                raise ValueError(
                    f"{name} without a delay must be of lower degree than A ({self.degree}), "
                    f"or its parameter would change the order of the equation"
                )
        self._sealed = True

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse changes: results are kept with the system they belong to."""
        if "_sealed" in self.__dict__:
            raise AttributeError(
                f"a {type(self).__name__} cannot be changed, got {name} = {value!r:.60}: make "
                f"a new one instead (a subclass sets its attributes before super().__init__)"
            )
        super().__setattr__(name, value)

    @property
    def degree(self) -> int:
        """Degree of A, the order of the equation."""
        return int(self.a.size - 1)

    @property
    def neutral(self) -> bool:
        """Whether a delayed term is of the same order as A."""
        return not self.step and any(self.highest_coefficients[1:])

    @property
    def highest_coefficients(self) -> tuple[float, float, float, float]:
        """Coefficients of the highest power of A in A, B1, B2 and C."""
        a, b1, b2, c = (
            float(p[-1]) if p.size == self.a.size else 0.0
            for p in (self.a, self.b1, self.b2, self.c)
        )
        return a, b1, b2, c

    def chain_reserve(self, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        r"""How far the neutral root chain is from reaching the imaginary axis.

        At high frequency D is its highest power of s times

        .. math::

            a + c\, e^{-s\delta} - x\, b_1 e^{-s(\delta + \theta_1)}
            - y\, b_2 e^{-s(\delta + \theta_2)} ,

        with the highest coefficients of A, C, B1 and B2. The roots of this sum repeat along
        the imaginary axis for ever: they are the neutral root chain. The chain stays in the
        left half-plane, for these delays and for all small changes of them, where

        .. math::

            |a| > |c| + |x\, b_1| + |y\, b_2| .

        Parameters
        ----------
        x, y : array_like of float
            The free parameters; they broadcast.

        Returns
        -------
        float array, of the broadcast shape
            Left less right side over |a|, and zero where rounding hides the sign. Negative or
            zero: the chain is not confined to the left half-plane. One for a retarded
            equation and for a map, which has no such chain.
        """
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        if self.step:
            return np.ones(np.broadcast_shapes(x.shape, y.shape))
        a, b1, b2, c = (abs(value) for value in self.highest_coefficients)
        reserve = (a - c - np.abs(x) * b1 - np.abs(y) * b2) / a
        return np.asarray(np.where(np.abs(reserve) <= 16.0 * EPSILON, 0.0, reserve))

    @property
    def longest_delay(self) -> float:
        """The longest time in s by which a term is delayed, dead time included."""
        return self.delay + max(self.delay1, self.delay2)

    @property
    def omega_per_turn(self) -> float:
        """Change of omega, in rad/s, that is one turn of the longest delay; inf without one."""
        return 2.0 * np.pi / self.longest_delay if self.longest_delay else np.inf

    def __repr__(self) -> str:
        """Name the class and its arguments, as they are written to make it again."""
        return as_written(self)

    def parts(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Evaluate the three terms of D, which is the first less x, y times the others.

        Parameters
        ----------
        s : array_like of complex
            Laplace variable in rad/s, any shape.

        Returns
        -------
        tuple of three complex arrays, shaped like `s`
            A + C exp(-s delay), B1 exp(-s (delay + delay1)) and B2 exp(-s (delay + delay2)).

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers.
        """
        s = complex_array("s", s)
        (rest, _), (b1, _), (b2, _) = self._evaluated(s, np)
        dead, (x0, y0) = np.exp(-s * self.delay), self.reference
        return (
            np.asarray(rest + (x0 * b1 + y0 * b2) * dead),
            np.asarray(b1 * np.exp(-s * self.delay1) * dead),
            np.asarray(b2 * np.exp(-s * self.delay2) * dead),
        )

    def __call__(self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike) -> ComplexArray:
        """Evaluate D(s; x, y); the three arguments broadcast.

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers, x or y is not finite and real, or the three do
            not broadcast.
        """
        return np.asarray(self._value(*self._checked(s, x, y)))

    def _checked(
        self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike
    ) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Return s, x and y as arrays that broadcast, or raise."""
        name1, name2 = self.parameters
        arrays = complex_array("s", s), real_array(name1, x), real_array(name2, y)
        broadcast_shape(("s", name1, name2), arrays)
        return arrays

    def _evaluated(self, s: Any, library: Any) -> list[tuple[Any, Any]]:
        """Return R, B1 and B2 at s, and their derivatives by z."""
        z = library.exp(s * self.step) if self.step else s
        return [p.evaluated(z) for p in self._polynomials]

    def _value(self, s: Any, x: Any, y: Any, library: Any = np) -> Any:
        """Evaluate D(s; x, y) unchecked.

        The functions are those of numpy, or of mpmath for one number in extended precision.
        """
        (rest, _), *arms = self._evaluated(s, library)
        delays, whole = (self.delay1, self.delay2), 0.0
        for (b, _), delay, origin, here in zip(
            arms, delays, self.reference, (x, y), strict=True
        ):
            whole = whole + b * ((origin - here) - here * library.expm1(-s * delay))
        return rest + library.exp(-s * self.delay) * whole

    def derivative(self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike) -> ComplexArray:
        r"""Evaluate dD/ds; the three arguments broadcast.

        .. math::

            \frac{\partial D}{\partial s} = R' + e^{-s\delta} \sum_k \left[
            \left( B_k' - \delta B_k \right) \left( x_{0k} - x_k\, e^{-s\theta_k} \right)
            + x_k\, \theta_k B_k e^{-s\theta_k} \right]

        with :math:`(x_1, x_2) = (x, y)`.

        Raises
        ------
        TypeError, ValueError
            As a call does.
        """
        return np.asarray(self._slope(*self._checked(s, x, y)))

    def _slope(self, s: Any, x: Any, y: Any, library: Any = np) -> Any:
        """Evaluate dD/ds unchecked, as `_value`."""
        dz = self.step * library.exp(s * self.step) if self.step else 1.0
        (_, slope), *arms = self._evaluated(s, library)
        delays, whole = (self.delay1, self.delay2), 0.0
        for (b, change), delay, origin, here in zip(
            arms, delays, self.reference, (x, y), strict=True
        ):
            late = library.expm1(-s * delay)
            whole = whole + (change * dz - self.delay * b) * ((origin - here) - here * late)
            whole = whole + b * here * delay * (1.0 + late)
        return slope * dz + library.exp(-s * self.delay) * whole

    def shifted(self, sigma: float) -> CharacteristicFunction:
        """Return the function s -> D(s + sigma), whose roots lie `sigma` further left.

        Counting its unstable roots counts the roots of D to the right of Re s = sigma.

        Raises
        ------
        TypeError, ValueError
            If sigma is not finite and real, or so large that exp(sigma delay) is not.
        """
        sigma = real_number("sigma", sigma)
        reach = abs(sigma) * max(self.longest_delay, self.step * self.degree)
        if reach > _LARGEST_EXPONENT:
            raise ValueError(
                f"sigma must be at most {_LARGEST_EXPONENT:.0f} over the longest delay in "
                f"magnitude, got {sigma}: its exponential is no float"
            )

        def with_moved(p: Polynomial, coefficients: FloatArray) -> Polynomial:
            """Return a shifted polynomial of these coefficients."""
            if self.step:
                return p._replace(
                    coefficients=coefficients, roots=p.roots * np.exp(-sigma * self.step)
                )
            if p.missed and coefficients.size <= LOW_DEGREE + 1:
                return Polynomial.of(coefficients, p.roots - sigma)
            return p._replace(coefficients=coefficients, roots=p.roots - sigma)

        def move(p: Polynomial, delay: float) -> Polynomial:
            late, size = np.exp(-sigma * delay), p.coefficients.size
            if self.step:
                moved = np.exp(sigma * self.step * np.arange(size)) * p.coefficients
            else:
                # Where D is evaluated from these: exactly, because powers of sigma may cancel.
                number = Fraction if size <= LOW_DEGREE + 1 else float
                exact: list[Any] = []
                for value in reversed(p.coefficients.tolist()):
                    # Horner's rule, with s + sigma in place of s.
                    left = [number(sigma) * c for c in exact]
                    pairs = zip([number(value), *exact], [*left, 0], strict=True)
                    exact = [a + b for a, b in pairs]
                moved = np.array(exact, dtype=np.float64)
            return with_moved(p, late * moved)

        x0, y0 = self.reference
        rest, b1, b2 = self._polynomials
        found = self.changed(
            rest=move(rest, 0.0),
            b1=move(b1, self.delay + self.delay1),
            b2=move(b2, self.delay + self.delay2),
            # It moves along, so that nothing has to cancel in `rest`.
            reference=(x0 * np.exp(sigma * self.delay1), y0 * np.exp(sigma * self.delay2)),
        )
        if found.a is not found.rest:
            # Not found again: in extended precision that takes a second.
            guess = Polynomial(self.a, self.roots_of_a, missed=1e-6)
            vars(found)["roots_of_a"] = with_moved(guess, found.a).roots
        return found

    def exchanged(self) -> CharacteristicFunction:
        """Return the same function with its two free parameters exchanged."""
        _, b1, b2 = self._polynomials
        return self.changed(
            b1=b2,
            b2=b1,
            delay1=self.delay2,
            delay2=self.delay1,
            parameters=self.parameters[::-1],
            reference=self.reference[::-1],
        )

    def changed(self, **changes: Any) -> CharacteristicFunction:
        """Return a copy with other values of some arguments.

        Parameters
        ----------
        **changes
            Arguments of `CharacteristicFunction`, by name.

        Returns
        -------
        CharacteristicFunction
            A plain one, of a loop too.

        Raises
        ------
        TypeError, ValueError
            As `CharacteristicFunction` does.
        """
        own = vars(self) | dict(zip(("rest", "b1", "b2"), self._polynomials, strict=True))
        names = inspect.signature(CharacteristicFunction).parameters
        return CharacteristicFunction(**{name: own[name] for name in names} | changes)

    def polynomials(self) -> tuple[Polynomial, ...]:
        """Return R, B1 and B2 with their roots."""
        return self._polynomials

    @cached_property
    def roots_of_a(self) -> ComplexArray:
        """Roots of A: they enter a count through the argument of A, past the last frequency."""
        rest = self._polynomials[0]
        return rest.roots if self.a is self.rest else Polynomial.of(self.a).roots

    def _delayed(
        self, k: int, lag: float, weight: float = 1.0, *, rows: bool = False
    ) -> ExponentialSum:
        """Return `weight` times R, B1 or B2, delayed by a time, at s = j omega.

        In the polynomials of `_basis`. For a map each power of z is an exponential, its
        polynomial is 1. Each coefficient keeps a polynomial of its own, so that its rounding is
        not forgotten.
        """
        if not self.step:
            polynomials, shares = self._basis
            if rows and len(polynomials) == len(self._polynomials):
                # A row has products with B1 only: the fewer terms in that the better.
                polynomials, shares = self._polynomials, np.eye(3)
            share = weight * shares[k]
            return ExponentialSum(polynomials, share[None, :], np.array([-lag]), share)
        factors = [p.coefficients for p in self._polynomials]
        ends = np.cumsum([p.size for p in factors])
        polynomials = (Polynomial(np.ones(1), np.zeros(0, dtype=np.complex128)),) * ends[-1]
        place = np.split(np.eye(len(polynomials)), ends[:-1])[k]
        p = weight * factors[k]
        phases = np.asarray(self.step * np.arange(p.size) - lag, dtype=np.float64)
        return ExponentialSum(polynomials, p[:, None] * place, phases, p @ place)

    @cached_property
    def _basis(self) -> tuple[tuple[Polynomial, ...], FloatArray]:
        """Polynomials, and the shares of them in R, B1 and B2, shape (3, polynomials)."""
        return self._polynomials, np.eye(3)

    def on_boundary(
        self, *, rows: bool = False
    ) -> tuple[ExponentialSum, ExponentialSum, ExponentialSum]:
        """Return the three terms of `parts` at s = j omega as exponential sums.

        With `rows` in the polynomials that suit the rows of a chart.
        """
        x0, y0 = self.reference
        undelayed = self.rest_on_boundary(rows=rows).plus(
            self._delayed(1, self.delay, x0, rows=rows)
        )
        return (
            undelayed.plus(self._delayed(2, self.delay, y0, rows=rows)),
            self._delayed(1, self.delay + self.delay1, rows=rows),
            self._delayed(2, self.delay + self.delay2, rows=rows),
        )

    def at(self, x: float, y: float) -> ExponentialSum:
        """Return D(j omega; x, y) at one point as an exponential sum."""
        x0, y0 = self.reference
        constant, b1, b2 = self.on_boundary()
        combined = constant.plus(b1.scaled(-x)).plus(b2.scaled(-y))
        # What is left where all exponentials are one, without the digits lost by cancelling.
        # Of two ways to add up, the one with the smaller terms.
        near, far = (x0 - x) * b1.sums, (y0 - y) * b2.sums
        all_near, all_far = x0 * b1.sums + y0 * b2.sums, x * b1.sums + y * b2.sums
        smaller = np.abs(all_near) + np.abs(all_far) < np.abs(near) + np.abs(far)
        left = np.where(smaller, all_near - all_far, near + far)
        return combined._replace(sums=self.rest_on_boundary().sums + left)

    def deviation(self, x: float, y: float) -> ExponentialSum:
        """Return x B1 exp(-s (delay + delay1)) + y B2 exp(-s (delay + delay2)) at s = j omega.

        That is what D subtracts from its first term.
        """
        _, b1, b2 = self.on_boundary()
        return b1.scaled(x).plus(b2.scaled(y))

    def rest_on_boundary(self, *, rows: bool = False) -> ExponentialSum:
        """Return R at s = j omega as an exponential sum, as `on_boundary` does."""
        return self._delayed(0, 0.0, rows=rows)


def checked_system(system: CharacteristicFunction) -> CharacteristicFunction:
    """Return the system, or say what was given in its place."""
    if not isinstance(system, CharacteristicFunction):
        raise TypeError(
            f"system must be a CharacteristicFunction, for instance CommonArm(), got {system!r}"
        )
    return system


def _polynomial(name: str, given: Sequence[float] | FloatArray | Polynomial) -> Polynomial:
    """Return a polynomial with trimmed, read-only coefficients, and its roots."""
    if isinstance(given, Polynomial):
        return given._replace(coefficients=_trimmed(name, given.coefficients))
    return Polynomial.of(_trimmed(name, given))


def _trimmed(name: str, coefficients: Sequence[float] | FloatArray) -> FloatArray:
    """Return trimmed, read-only coefficients with at least one entry."""
    values = axis(name, coefficients)
    trimmed = np.array(poly.polytrim(values, tol=0.0), dtype=np.float64)
    trimmed.setflags(write=False)
    return trimmed


def _not_negative(name: str, value: float) -> float:
    """Return a finite number that is zero or positive."""
    number = real_number(name, value)
    if number < 0.0:
        raise ValueError(f"{name} must not be negative, got {number}")
    return number
