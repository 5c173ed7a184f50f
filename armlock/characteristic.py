"""The characteristic function that every loop of the paper shares.

Whatever the sensor and the controller, clearing denominators of 1 + L(s) leaves

    D(s; x, y) = R + exp(-s delay) [ B1 (x0 - x exp(-s tau1)) + B2 (y0 - y exp(-s tau2)) ]

with real polynomials R, B1, B2 of s: affine in the two free parameters x and y. The dead time
`delay` is zero unless the loop has one. At x = x0 and y = y0, which is (1, 1) for an
arm-locking loop, both parentheses are zero at s = 0. Near that point no large terms cancel.

The semi-discretized loop has the same form with polynomials in z = exp(s step) instead of s.
So both are one class here, and one set of algorithms serves both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.axis.exponentials import LOW_DEGREE, ExponentialSum
from armlock.axis.polynomials import Polynomial
from armlock.axis.rounding import EPSILON
from armlock.checks import (
    ComplexArray,
    FloatArray,
    axis,
    broadcast_pair,
    broadcast_shape,
    complex_array,
    real_array,
    real_number,
    whole_steps,
)
from armlock.engine import polynomials
from armlock.engine.functions import Function, Space

# Past this an exponential is no float.
_LARGEST_EXPONENT = 700.0
# The free parameters of a loop, the perturbations of its arms: one where there is none.
_PERTURBATIONS = ("c1", "c2")


class Terms(NamedTuple):
    """R, and the terms of D = constant - x first - y second."""

    rest: Function
    constant: Function
    first: Function
    second: Function


@dataclass(frozen=True)
class CharacteristicFunction:
    r"""A characteristic function that is affine in two free parameters x and y.

    .. math::

        D(s; x, y) = R + e^{-s\delta} \left[ B_1 \left( x_0 - x\, e^{-s\tau_1} \right)
        + B_2 \left( y_0 - y\, e^{-s\tau_2} \right) \right]

    with polynomials R, B1 and B2 of s, a dead time :math:`\delta` and delays
    :math:`\tau_1, \tau_2`. Sorted by delays it is

    .. math::

        D(s; x, y) = A + C\, e^{-s\delta} - x\, B_1 e^{-s(\delta + \tau_1)}
        - y\, B_2 e^{-s(\delta + \tau_2)} ,

    With a dead time A = R and C = x0 B1 + y0 B2. Without one A = R + x0 B1 + y0 B2 and C = 0.

    Parameters
    ----------
    rest, b1, b2 : sequence of float, or armlock.axis.polynomials.Polynomial
        Coefficients of R, B1 and B2 in ascending powers of s (of z = exp(s step) for a map);
        or polynomials with known roots, which are then kept.
    tau1, tau2 : float
        Delays in s, zero or positive.
    delay : float, optional
        Dead time in s, by which both terms are delayed; zero or positive.
    step : float, optional
        Zero (default) for polynomials in s; the sampling step in s for a map, which must
        divide all delays.
    parameters : pair of str, optional
        Names of the two free parameters, used in messages and on axes.
    reference : pair of float, optional
        The constants (x0, y0); (1, 1) for a loop, where R is the denominator of L.

    Attributes
    ----------
    rest, b1, b2 : armlock.axis.polynomials.Polynomial
        R, B1 and B2 with their coefficients and roots.

    Raises
    ------
    TypeError, ValueError
        If a coefficient is not finite and real, a delay is negative or not a whole number of
        steps, A is zero, or another term has a higher degree than A (an advanced equation has
        no stable region).

    Notes
    -----
    It is a frozen dataclass: `replace`, `dataclasses.replace` and `copy.replace` make another
    one with some arguments changed.

    The equation is of *retarded* type if all delayed terms are of lower degree than A, and of
    *neutral* type (`neutral` is true) if one of them reaches it. The roots of a neutral
    equation at high frequency form the *neutral root chain*, see `chain_reserve`.

    Examples
    --------
    An oscillator with two delayed forces, x'' + 0.2 x' + x = x1 x(t - 1) + x2 x(t - 2). The
    reference is (0, 0), so that R is A:

    >>> from armlock import CharacteristicFunction, unstable_roots
    >>> rest, b1, b2 = [1.0, 0.2, 1.0], [1.0], [1.0]
    >>> forced = CharacteristicFunction(rest, b1, b2, tau1=1.0, tau2=2.0)
    >>> unstable_roots(forced, [0.1, -0.5], 0.05)
    array([0, 2])
    """

    rest: Polynomial
    b1: Polynomial
    b2: Polynomial
    tau1: float
    tau2: float
    delay: float
    step: float
    parameters: tuple[str, str]
    reference: tuple[float, float]

    def __init__(
        self,
        rest: Sequence[float] | FloatArray | Polynomial,
        b1: Sequence[float] | FloatArray | Polynomial,
        b2: Sequence[float] | FloatArray | Polynomial,
        tau1: float,
        tau2: float,
        *,
        delay: float = 0.0,
        step: float = 0.0,
        parameters: tuple[str, str] = ("x", "y"),
        reference: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        polynomials = {"rest": rest, "b1": b1, "b2": b2}
        polynomials = {name: _polynomial(name, p) for name, p in polynomials.items()}
        pair = axis("reference", reference)
        if pair.size != 2:
            raise ValueError(f"reference must hold two numbers, got {pair.size}")
        times = {"tau1": tau1, "tau2": tau2, "delay": delay, "step": step}
        times = {name: _not_negative(name, value) for name, value in times.items()}
        # The fields of a frozen dataclass are set once, here.
        vars(self).update(polynomials, **times)
        vars(self).update(parameters=tuple(parameters), reference=tuple(pair.tolist()))
        self._check()

    def _check(self) -> None:
        """Raise if a delay is no whole number of steps, or a term is too high in degree."""
        if self.step:
            for name in ("delay", "tau1", "tau2"):
                whole_steps(name, getattr(self, name), self.step)
        if not self.a.any():
            raise ValueError(
                f"A, the term without a delay, must not vanish, got rest={self.rest!r}"
            )
        b1, b2 = self.b1.coefficients, self.b2.coefficients
        for name, b in (("b1", b1), ("b2", b2), ("c", self.c)):
            if b.size > self.a.size:
                raise ValueError(
                    f"{name} must not exceed the degree of A ({self.degree}), "
                    f"got degree {b.size - 1}: the equation would be of advanced type"
                )
        for name, b, tau in (("b1", b1, self.tau1), ("b2", b2, self.tau2)):
            if tau + self.delay == 0.0 and b.size == self.a.size:
                raise ValueError(
                    f"{name} without a delay must be of lower degree than A ({self.degree}), "
                    f"or its parameter would change the order of the equation"
                )

    def replace(self, **changes: Any) -> Self:
        """Return another one, made with other values of some arguments.

        Parameters
        ----------
        **changes
            Arguments of the class, by name. All others stay as they are. The sensor of a loop
            stays too when its delays change.

        Returns
        -------
        CharacteristicFunction
            Of the same class.

        Raises
        ------
        TypeError, ValueError
            As the class does.

        Examples
        --------
        >>> from armlock import CommonArm
        >>> CommonArm(delay=20e-6).replace(delay=0.0) == CommonArm()
        True
        """
        return replace(self, **changes)

    def plain(self) -> CharacteristicFunction:
        """Return D alone, with the arguments of `CharacteristicFunction`."""
        return CharacteristicFunction(
            self.rest, self.b1, self.b2, self.tau1, self.tau2, delay=self.delay,
            step=self.step, parameters=self.parameters, reference=self.reference,
        )  # fmt: skip

    def basis(self) -> tuple[list[polynomials.Polynomial], list[list[Fraction]]]:
        """Return polynomials, and their shares in R, B1 and B2, shape (3, polynomials)."""
        given = [p.coefficients for p in self.polynomials()]
        made = [polynomials.Polynomial.of(p) for p in given if p.any()]
        places = np.cumsum([bool(p.any()) for p in given]) - 1
        shares = [
            [Fraction(int(p.any() and k == place)) for k in range(len(made))]
            for p, place in zip(given, places, strict=True)
        ]
        return made, shares

    @cached_property
    def terms(self) -> Terms:
        """R and the terms of D, exactly, as functions of the engine."""
        made, shares = self.basis()
        lags = [Fraction(lag) for lag in (0.0, self.delay, self.tau1, self.tau2)]
        powers = [[(Fraction(1), Fraction(0))]] * 3
        if self.step:
            # Over z^n each power of z is a delay of its own, and the only polynomial is one.
            step = Fraction(self.step)
            lags = [round(lag / step) * step for lag in lags]
            made, shares = [polynomials.Polynomial(Fraction(1), ())], [[Fraction(1)]] * 3
            powers = [
                [(Fraction(c), (self.degree - k) * step) for k, c in enumerate(p.coefficients)]
                for p in self.polynomials()
            ]
        zero, dead, tau1, tau2 = lags
        if self.neutral and tau1 == tau2:
            # Equal arms are two delays for the neutral root chain, which is to stay where it is
            # for all small changes of either.
            tau2 += tau2 / 2**300
        delays = {
            lag + power
            for lag in (zero, dead, dead + tau1, dead + tau2)
            for part in powers
            for _, power in part
        }
        space = Space(made, delays, self.step)

        def delayed(k: int, lag: Fraction) -> Function:
            steady = np.zeros(len(made), object)
            turned = np.zeros((len(made), len(space.delays)), object)
            for j, share in enumerate(shares[k]):
                for weight, power in powers[k]:
                    steady[j] += share * weight
                    if lag + power:
                        turned[j, space.place(lag + power)] += share * weight
            return Function(space, steady, turned)

        (x0, y0), rest = self.reference, delayed(0, zero)
        constant = rest + delayed(1, dead) * x0 + delayed(2, dead) * y0
        return Terms(rest, constant, delayed(1, dead + tau1), delayed(2, dead + tau2))

    def function(self, x: float | Fraction, y: float | Fraction) -> Function:
        """Return D at one point as a function of the engine, exactly."""
        _, constant, first, second = self.terms
        return constant + first * -Fraction(x) + second * -Fraction(y)

    @cached_property
    def c(self) -> FloatArray:
        """Coefficients of C, what the dead time alone delays; zero without a dead time."""
        return _trimmed("c", self._undelayed_arms() if self.delay else [0.0])

    @cached_property
    def a(self) -> FloatArray:
        """Coefficients of A, what nothing delays."""
        rest = self.rest.coefficients
        if not self.delay:
            rest = np.asarray(poly.polyadd(rest, self._undelayed_arms()))
        return _trimmed("a", rest)

    def _undelayed_arms(self) -> FloatArray:
        """Return the coefficients of x0 B1 + y0 B2."""
        x0, y0 = self.reference
        return np.asarray(poly.polyadd(x0 * self.b1.coefficients, y0 * self.b2.coefficients))

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
            for p in (self.a, self.b1.coefficients, self.b2.coefficients, self.c)
        )
        return a, b1, b2, c

    def chain_reserve(self, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        r"""How far the neutral root chain is from reaching the imaginary axis.

        At high frequency D is its highest power of s times

        .. math::

            a + c\, e^{-s\delta} - x\, b_1 e^{-s(\delta + \tau_1)}
            - y\, b_2 e^{-s(\delta + \tau_2)} ,

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

        Raises
        ------
        TypeError, ValueError
            If x or y is not finite and real.
        """
        name1, name2 = self.parameters
        x, y = real_array(name1, x), real_array(name2, y)
        if self.step:
            return np.ones(np.broadcast_shapes(x.shape, y.shape))
        a, b1, b2, c = (abs(value) for value in self.highest_coefficients)
        return left_of(a, c + np.abs(x) * b1 + np.abs(y) * b2)

    @property
    def longest_delay(self) -> float:
        """The longest time in s by which a term is delayed, dead time included."""
        return self.delay + max(self.tau1, self.tau2)

    @property
    def omega_per_turn(self) -> float:
        """Change of omega, in rad/s, that is one turn of the longest delay; inf without one."""
        return 2.0 * np.pi / self.longest_delay if self.longest_delay else np.inf

    def parts(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Evaluate the three terms of D, which is the first less x, y times the others.

        Parameters
        ----------
        s : array_like of complex
            Laplace variable in rad/s, any shape.

        Returns
        -------
        tuple of three complex arrays, shaped like `s`
            A + C exp(-s delay), B1 exp(-s (delay + tau1)) and B2 exp(-s (delay + tau2)).

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
            np.asarray(b1 * np.exp(-s * self.tau1) * dead),
            np.asarray(b2 * np.exp(-s * self.tau2) * dead),
        )

    def characteristic(
        self, s: npt.ArrayLike, x: npt.ArrayLike | None = None, y: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Evaluate D(s; x, y); the three arguments broadcast. Of a loop x and y default to one.

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers, x or y is not finite and real, or the three do
            not broadcast.
        """
        return np.asarray(self._value(*self._checked(s, x, y)))

    def _checked(
        self, s: npt.ArrayLike, x: npt.ArrayLike | None, y: npt.ArrayLike | None
    ) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Return s, x and y as arrays that broadcast, or raise."""
        x, y = given_or_one(self, x, y)
        name1, name2 = self.parameters
        arrays = complex_array("s", s), real_array(name1, x), real_array(name2, y)
        broadcast_shape(("s", name1, name2), arrays)
        return arrays

    def arms(self, x: Any, y: Any) -> tuple[tuple[FloatArray, float, Any, Any], ...]:
        """Return B, the delay, the reference and the parameter of either arm."""
        x0, y0 = self.reference
        return (
            (self.b1.coefficients, self.tau1, x0, x),
            (self.b2.coefficients, self.tau2, y0, y),
        )

    def _evaluated(self, s: Any, library: Any) -> list[tuple[Any, Any]]:
        """Return R, B1 and B2 at s, and their derivatives by z."""
        z = library.exp(s * self.step) if self.step else s
        return [p.evaluated(z) for p in self.polynomials()]

    def _value(self, s: Any, x: Any, y: Any, library: Any = np) -> Any:
        """Evaluate D(s; x, y) unchecked.

        The functions are those of numpy, or of mpmath for one number in extended precision.
        """
        (rest, _), *evaluated = self._evaluated(s, library)
        arms = 0.0
        for (b, _), (_, tau, origin, here) in zip(evaluated, self.arms(x, y), strict=True):
            arms = arms + b * ((origin - here) - here * library.expm1(-s * tau))
        return rest + library.exp(-s * self.delay) * arms

    def derivative(
        self, s: npt.ArrayLike, x: npt.ArrayLike | None = None, y: npt.ArrayLike | None = None
    ) -> ComplexArray:
        r"""Evaluate dD/ds; the three arguments broadcast. Of a loop x and y default to one.

        .. math::

            \frac{\partial D}{\partial s} = R' + e^{-s\delta} \sum_k \left[
            \left( B_k' - \delta B_k \right) \left( x_{0k} - x_k\, e^{-s\tau_k} \right)
            + x_k\, \tau_k B_k e^{-s\tau_k} \right]

        with :math:`(x_1, x_2) = (x, y)`.

        Raises
        ------
        TypeError, ValueError
            As `characteristic` does.
        """
        return np.asarray(self._slope(*self._checked(s, x, y)))

    def _slope(self, s: Any, x: Any, y: Any, library: Any = np) -> Any:
        """Evaluate dD/ds unchecked, as `_value`."""
        dz = self.step * library.exp(s * self.step) if self.step else 1.0
        (_, dr), *evaluated = self._evaluated(s, library)
        arms = 0.0
        for (b, db), (_, tau, origin, here) in zip(evaluated, self.arms(x, y), strict=True):
            change = library.expm1(-s * tau)
            arms = arms + (db * dz - self.delay * b) * ((origin - here) - here * change)
            arms = arms + b * here * tau * (1.0 + change)
        return dr * dz + library.exp(-s * self.delay) * arms

    def shifted(self, sigma: float) -> CharacteristicFunction:
        """Return the function s -> D(s + sigma), whose roots lie `sigma` further left.

        Counting its unstable roots counts the roots of D to the right of Re s = sigma.

        Raises
        ------
        TypeError, ValueError
            If sigma is not finite and real, or so large that exp(sigma delay) is not.
        """
        return _Shifted(self, sigma)

    def exchanged(self) -> CharacteristicFunction:
        """Return the same function with its two free parameters exchanged."""
        return self.plain().replace(
            b1=self.b2,
            b2=self.b1,
            tau1=self.tau2,
            tau2=self.tau1,
            parameters=self.parameters[::-1],
            reference=self.reference[::-1],
        )

    def polynomials(self) -> tuple[Polynomial, ...]:
        """Return R, B1 and B2 with their roots."""
        return self.rest, self.b1, self.b2

    @cached_property
    def roots_of_a(self) -> ComplexArray:
        """Roots of A: they enter a count through the argument of A, past the last frequency.

        With a dead time A is R, whose roots are known.
        """
        return self.rest.roots if self.delay else Polynomial.of(self.a).roots

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
            if rows and len(polynomials) == len(self.polynomials()):
                # A row has products with B1 only: the fewer terms in that the better.
                polynomials, shares = self.polynomials(), np.eye(3)
            share = weight * shares[k]
            return ExponentialSum(polynomials, share[None, :], np.array([-lag]), share)
        factors = [p.coefficients for p in self.polynomials()]
        ends = np.cumsum([p.size for p in factors])
        polynomials = (Polynomial(np.ones(1), np.zeros(0, dtype=np.complex128)),) * ends[-1]
        place = np.split(np.eye(len(polynomials)), ends[:-1])[k]
        p = weight * factors[k]
        phases = np.asarray(self.step * np.arange(p.size) - lag, dtype=np.float64)
        return ExponentialSum(polynomials, p[:, None] * place, phases, p @ place)

    @cached_property
    def _basis(self) -> tuple[tuple[Polynomial, ...], FloatArray]:
        """Polynomials, and the shares of them in R, B1 and B2, shape (3, polynomials)."""
        return self.polynomials(), np.eye(3)

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
            self._delayed(1, self.delay + self.tau1, rows=rows),
            self._delayed(2, self.delay + self.tau2, rows=rows),
        )

    def sum_at(self, x: float, y: float) -> ExponentialSum:
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
        """Return x B1 exp(-s (delay + tau1)) + y B2 exp(-s (delay + tau2)) at s = j omega.

        That is what D subtracts from its first term.
        """
        _, b1, b2 = self.on_boundary()
        return b1.scaled(x).plus(b2.scaled(y))

    def rest_on_boundary(self, *, rows: bool = False) -> ExponentialSum:
        """Return R at s = j omega as an exponential sum, as `on_boundary` does."""
        return self._delayed(0, 0.0, rows=rows)


def left_of(whole: float, others: npt.ArrayLike) -> FloatArray:
    """Share of a positive number that others leave of it, zero where rounding hides its sign.

    Of highest coefficients, and sums of such times parameters: a few products and sums, each of
    which rounds by half an EPSILON, and the coefficients, which are products of a few numbers.
    """
    left = (whole - np.asarray(others, dtype=float)) / whole
    return np.asarray(np.where(np.abs(left) <= 16.0 * EPSILON, 0.0, left))


def checked_system(system: CharacteristicFunction) -> CharacteristicFunction:
    """Return the system, or say what was given in its place."""
    if not isinstance(system, CharacteristicFunction):
        raise TypeError(
            f"system must be a CharacteristicFunction, for instance CommonArm(), got {system!r}"
        )
    return system


def broadcast_parameters(
    system: CharacteristicFunction, x: npt.ArrayLike | None, y: npt.ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Return the two free parameters of a system as finite real arrays of one shape.

    Those of a loop, c1 and c2, are one where they are not given. Others have to be given.
    """
    x, y = given_or_one(checked_system(system), x, y)
    name1, name2 = system.parameters
    return broadcast_pair(name1, x, name2, y)


def given_or_one(
    system: CharacteristicFunction, x: npt.ArrayLike | None, y: npt.ArrayLike | None
) -> tuple[npt.ArrayLike, npt.ArrayLike]:
    """Return both parameters, one for a perturbation that is not given; raise for others."""
    given = []
    for name, value in zip(system.parameters, (x, y), strict=True):
        if value is None and name not in _PERTURBATIONS:
            raise TypeError(
                f"{name} must be given: only c1 and c2 of a loop are one by default"
            )
        given.append(1.0 if value is None else value)
    return given[0], given[1]


class _Shifted(CharacteristicFunction):
    """The function s -> D(s + sigma), see `CharacteristicFunction.shifted`."""

    origin: CharacteristicFunction
    sigma: float

    def __init__(self, origin: CharacteristicFunction, sigma: float) -> None:
        sigma = real_number("sigma", sigma)
        reach = abs(sigma) * max(origin.longest_delay, origin.step * origin.degree)
        if reach > _LARGEST_EXPONENT:
            raise ValueError(
                f"sigma must be at most {_LARGEST_EXPONENT:.0f} over the longest delay in "
                f"magnitude, got {sigma}: its exponential is no float"
            )

        def moved(p: Polynomial, lag: float) -> Polynomial:
            late = np.exp(-sigma * lag)
            if origin.step:
                powers = np.exp(sigma * origin.step * np.arange(p.coefficients.size))
                return _with_moved(origin, sigma, late * powers * p.coefficients, p)
            return _with_moved(origin, sigma, late * _taylor(p.coefficients, sigma), p)

        (x0, y0), (rest, b1, b2) = origin.reference, origin.polynomials()
        super().__init__(
            moved(rest, 0.0),
            moved(b1, origin.delay + origin.tau1),
            moved(b2, origin.delay + origin.tau2),
            origin.tau1,
            origin.tau2,
            delay=origin.delay,
            step=origin.step,
            parameters=origin.parameters,
            # It moves along, so that nothing has to cancel in `rest`.
            reference=(x0 * np.exp(sigma * origin.tau1), y0 * np.exp(sigma * origin.tau2)),
        )
        vars(self).update(origin=origin, sigma=sigma)

    @cached_property
    def roots_of_a(self) -> ComplexArray:
        """Those of the origin, moved: to find them in extended precision takes a second."""
        if self.delay:
            return super().roots_of_a
        guess = Polynomial(self.origin.a, self.origin.roots_of_a, missed=EPSILON)
        return _with_moved(self.origin, self.sigma, self.a, guess).roots


def _taylor(coefficients: FloatArray, sigma: float) -> FloatArray:
    """Return the coefficients of p(s + sigma) in powers of s."""
    # Where D is evaluated from these: exactly, because powers of sigma may cancel.
    number = Fraction if coefficients.size <= LOW_DEGREE + 1 else float
    moved: list[Any] = []
    for value in reversed(coefficients.tolist()):
        # Horner's rule, with s + sigma in place of s.
        left = [number(sigma) * c for c in moved]
        moved = [a + b for a, b in zip([number(value), *moved], [*left, 0], strict=True)]
    return np.array(moved, dtype=np.float64)


def _with_moved(
    origin: CharacteristicFunction, sigma: float, coefficients: FloatArray, before: Polynomial
) -> Polynomial:
    """Return a shifted polynomial from its coefficients, and the one before the shift."""
    if origin.step:
        roots = before.roots * np.exp(-sigma * origin.step)
    else:
        roots = before.roots - sigma
        if before.missed and coefficients.size <= LOW_DEGREE + 1:
            return Polynomial.of(coefficients, roots)
    return before._replace(coefficients=coefficients, roots=roots)


def _polynomial(name: str, given: Sequence[float] | FloatArray | Polynomial) -> Polynomial:
    """Return a polynomial with trimmed coefficients, and its roots."""
    if isinstance(given, Polynomial):
        return given._replace(coefficients=_trimmed(name, given.coefficients))
    return Polynomial.of(_trimmed(name, given))


def _trimmed(name: str, coefficients: Sequence[float] | FloatArray) -> FloatArray:
    """Return trimmed coefficients with at least one entry."""
    return np.array(poly.polytrim(axis(name, coefficients), tol=0.0), dtype=np.float64)


def _not_negative(name: str, value: float) -> float:
    """Return a finite number that is zero or positive."""
    number = real_number(name, value)
    if number < 0.0:
        raise ValueError(f"{name} must not be negative, got {number}")
    return number
