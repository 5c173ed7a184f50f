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
from itertools import zip_longest
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

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
from armlock.engine.functions import Function, Space
from armlock.engine.inclusion import EPSILON
from armlock.engine.polynomials import Polynomial, rounded

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
    rest, b1, b2 : sequence of float, or armlock.engine.polynomials.Polynomial
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
    rest, b1, b2 : armlock.engine.polynomials.Polynomial
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
        for name, degree in (
            ("b1", self.b1.degree),
            ("b2", self.b2.degree),
            ("c", self.c.size - 1),
        ):
            if degree > self.degree:
                raise ValueError(
                    f"{name} must not exceed the degree of A ({self.degree}), "
                    f"got degree {degree}: the equation would be of advanced type"
                )
        for name, b, tau in (("b1", self.b1, self.tau1), ("b2", self.b2, self.tau2)):
            if tau + self.delay == 0.0 and b and b.degree == self.degree:
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

    def basis(self) -> tuple[list[Polynomial], list[list[Fraction]]]:
        """Return polynomials, and their shares in R, B1 and B2, shape (3, polynomials)."""
        given = self.polynomials()
        places = np.cumsum([bool(p) for p in given]) - 1
        made = [p for p in given if p]
        shares = [
            [Fraction(int(bool(p) and k == place)) for k in range(len(made))]
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
            made, shares = [Polynomial(Fraction(1), ())], [[Fraction(1)]] * 3
            powers = [
                [(c, (self.degree - k) * step) for k, c in enumerate(p.exact)]
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

    def cancelled(self, x: float | Fraction, y: float | Fraction) -> int:
        """Order of the root at s = 0 that D has and the system has not: 0, but for a loop."""
        return 0

    @cached_property
    def c(self) -> FloatArray:
        """Coefficients of C, what the dead time alone delays; zero without a dead time."""
        return _trimmed(self._at_reference() if self.delay else [])

    @cached_property
    def a(self) -> FloatArray:
        """Coefficients of A, what nothing delays."""
        return _trimmed(_sum(self.rest.exact, [] if self.delay else self._at_reference()))

    def _at_reference(self) -> list[Fraction]:
        """Return the coefficients of x0 B1 + y0 B2, exactly."""
        x0, y0 = (Fraction(value) for value in self.reference)
        return _sum([x0 * c for c in self.b1.exact], [y0 * c for c in self.b2.exact])

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
        (rest, _), (b1, _), (b2, _) = self._evaluated(s)
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
        s, x, y = self._checked(s, x, y)
        (rest, _), (b1, _), (b2, _) = self._evaluated(s)
        x0, y0 = self.reference
        arms = b1 * ((x0 - x) - x * np.expm1(-s * self.tau1))
        arms = arms + b2 * ((y0 - y) - y * np.expm1(-s * self.tau2))
        return np.asarray(rest + np.exp(-s * self.delay) * arms)

    def _checked(
        self, s: npt.ArrayLike, x: npt.ArrayLike | None, y: npt.ArrayLike | None
    ) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Return s, x and y as arrays that broadcast, or raise."""
        x, y = given_or_one(self, x, y)
        name1, name2 = self.parameters
        arrays = complex_array("s", s), real_array(name1, x), real_array(name2, y)
        broadcast_shape(("s", name1, name2), arrays)
        return arrays

    def _evaluated(self, s: ComplexArray) -> list[tuple[ComplexArray, ComplexArray]]:
        """Return R, B1 and B2 at s, and their derivatives by s or, for a map, by z."""
        z = np.exp(s * self.step) if self.step else s
        return [p.evaluated(z) for p in self.polynomials()]

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
        s, x, y = self._checked(s, x, y)
        dz = self.step * np.exp(s * self.step) if self.step else 1.0
        (_, dr), *evaluated = self._evaluated(s)
        arms = np.zeros_like(dr)
        pairs = zip((x, y), self.reference, (self.tau1, self.tau2), strict=True)
        for (b, db), (here, origin, tau) in zip(evaluated, pairs, strict=True):
            change = np.expm1(-s * tau)
            arms = arms + (db * dz - self.delay * b) * ((origin - here) - here * change)
            arms = arms + b * here * tau * (1.0 + change)
        return np.asarray(dr * dz + np.exp(-s * self.delay) * arms)

    def polynomials(self) -> tuple[Polynomial, ...]:
        """Return R, B1 and B2 with their roots."""
        return self.rest, self.b1, self.b2


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
    system: CharacteristicFunction,
    x: npt.ArrayLike | Fraction | None,
    y: npt.ArrayLike | Fraction | None,
) -> tuple[FloatArray, FloatArray]:
    """Return the two free parameters of a system as finite real arrays of one shape.

    Those of a loop, c1 and c2, are one where they are not given. Others have to be given. A
    Fraction stays one, in an array of a single point.
    """
    x, y = given_or_one(checked_system(system), x, y)
    name1, name2 = system.parameters
    if isinstance(x, Fraction) or isinstance(y, Fraction):
        pair = [
            value if isinstance(value, Fraction) else real_number(name, value)
            for name, value in zip(system.parameters, (x, y), strict=True)
        ]
        return np.array(pair[0], dtype=object), np.array(pair[1], dtype=object)
    return broadcast_pair(name1, x, name2, y)


def given_or_one(system: CharacteristicFunction, x: Any, y: Any) -> tuple[Any, Any]:
    """Return both parameters, one for a perturbation that is not given; raise for others."""
    given = []
    for name, value in zip(system.parameters, (x, y), strict=True):
        if value is None and name not in _PERTURBATIONS:
            raise TypeError(
                f"{name} must be given: only c1 and c2 of a loop are one by default"
            )
        given.append(1.0 if value is None else value)
    return given[0], given[1]


def _polynomial(name: str, given: Sequence[float] | FloatArray | Polynomial) -> Polynomial:
    """Return a polynomial with trimmed coefficients, and its roots."""
    return given if isinstance(given, Polynomial) else Polynomial.of(axis(name, given).tolist())


def _sum(p: Sequence[Fraction], q: Sequence[Fraction]) -> list[Fraction]:
    """Add two polynomials in ascending powers."""
    return [a + b for a, b in zip_longest(p, q, fillvalue=Fraction(0))]


def _trimmed(coefficients: Sequence[Fraction]) -> FloatArray:
    """Return coefficients without zeros in front of the highest power, rounded."""
    size = max((k + 1 for k, value in enumerate(coefficients) if value), default=1)
    return rounded([*coefficients, Fraction(0)][:size])


def _not_negative(name: str, value: float) -> float:
    """Return a finite number that is zero or positive."""
    number = real_number(name, value)
    if number < 0.0:
        raise ValueError(f"{name} must not be negative, got {number}")
    return number
