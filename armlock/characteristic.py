"""The characteristic function that every loop of the paper shares.

Whatever the sensor and the controller, clearing denominators of 1 + L(s) leaves

    D(s; x, y) = R + exp(-s delay) [ B1 (x0 - x exp(-s tau1)) + B2 (y0 - y exp(-s tau2)) ]

with real polynomials R, B1, B2 of s: affine in the two free parameters x and y. The dead time
`delay` is zero unless the loop has one. At x = x0 and y = y0, which is (1, 1) for an
arm-locking loop, both parentheses are zero at s = 0. Near that point no large terms cancel.

The semi-discretized loop has the same form with polynomials in z = exp(s step) instead of s.
So one set of algorithms serves both.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.checks import (
    ComplexArray,
    FloatArray,
    axis,
    broadcast_pair,
    broadcast_shape,
    complex_array,
    not_negative,
    real_array,
    whole_steps,
)
from armlock.controllers import with_others
from armlock.delays import Term, functions
from armlock.engine.functions import Function
from armlock.engine.inclusion import EPSILON
from armlock.engine.polynomials import Polynomial, rounded

_ZERO = Fraction(0)
# The free parameters of a loop, the perturbations of its arms: one where there is none.
_PERTURBATIONS = ("c1", "c2")


class Terms(NamedTuple):
    """R, and the terms of D = constant - x first - y second."""

    rest: Function
    constant: Function
    first: Function
    second: Function


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

    This is the base of `Loop` and of `DelayEquation`, which are frozen dataclasses.

    Attributes
    ----------
    rest, b1, b2 : armlock.engine.polynomials.Polynomial
        R, B1 and B2 with their coefficients and roots.
    tau1, tau2, delay : float
        The delays and the dead time in s.
    step : float
        Zero for polynomials in s; the sampling step in s of a map.
    parameters : pair of str
        Names of the two free parameters.
    reference : pair of float
        The constants (x0, y0).

    Notes
    -----
    The equation is of *retarded* type if all delayed terms are of lower degree than A, and of
    *neutral* type (`neutral` is true) if one of them has the degree of A. The roots of a
    neutral equation at high frequency form the *neutral root chain*, see `neutral_margin`.

    Examples
    --------
    >>> from armlock import CommonArm
    >>> print(f"{CommonArm().characteristic(0.1j, 0.9, 1.05):.4f}")
    2.8101+1.8737j
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
    #: The same for other values of poles that may be meant to be zero; usually none.
    others: tuple[CharacteristicFunction, ...] = ()

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
        return replace(self, **changes)  # type: ignore[type-var]

    def plain(self) -> DelayEquation:
        """Return D alone, with the arguments of `DelayEquation`."""
        return with_others(
            lambda one: DelayEquation(
                one.rest, one.b1, one.b2, one.tau1, one.tau2, delay=one.delay,
                step=one.step, parameters=one.parameters, reference=one.reference,
            ),
            self,
        )  # fmt: skip

    def polynomials(self) -> tuple[Polynomial, Polynomial, Polynomial]:
        """Return R, B1 and B2 with their roots."""
        return self.rest, self.b1, self.b2

    def parts(self) -> tuple[list[Term], list[Term], list[Term]]:
        """Return R, B1 and B2 as sums of terms; delays stand for powers of z in a map."""
        one, zero = Fraction(1), Fraction(0)
        if not self.step:
            r, b1, b2 = ([(one, p, zero)] for p in self.polynomials())
            return r, b1, b2
        # Over z^n each power of z is a delay of its own, and the only polynomial is one.
        step, unit = Fraction(self.step), Polynomial(one, ())
        r, b1, b2 = (
            [(c, unit, (self.degree - k) * step) for k, c in enumerate(p.exact)]
            for p in self.polynomials()
        )
        return r, b1, b2

    @cached_property
    def terms(self) -> Terms:
        """R and the terms of D, exactly, as functions of the engine."""
        rest, b1, b2 = self.parts()
        dead, tau1, tau2 = (Fraction(lag) for lag in (self.delay, self.tau1, self.tau2))
        if self.step:
            step = Fraction(self.step)
            dead, tau1, tau2 = (round(lag / step) * step for lag in (dead, tau1, tau2))
        if self.neutral and tau1 == tau2:
            # Equal arms are two delays for the neutral root chain, which is to stay where it is
            # for all small changes of either.
            tau2 += tau2 / 2**300
        x0, y0 = self.reference
        constant = [*late(rest), *late(b1, dead, x0), *late(b2, dead, y0)]
        first, second = late(b1, dead + tau1), late(b2, dead + tau2)
        return Terms(*functions(late(rest), constant, first, second, step=self.step))

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
        return rounded(self._at_reference() if self.delay else [_ZERO])

    @cached_property
    def a(self) -> FloatArray:
        """Coefficients of A, what nothing delays."""
        other = [_ZERO] if self.delay else self._at_reference()
        return rounded(poly.polyadd(self.rest.exact, other))

    def _at_reference(self) -> Any:
        """Return the coefficients of x0 B1 + y0 B2, exactly."""
        pairs = zip(self.reference, (self.b1, self.b2), strict=True)
        return poly.polyadd(*(Fraction(origin) * np.array(b.exact) for origin, b in pairs))

    @property
    def degree(self) -> int:
        """Degree of A, the order of the equation."""
        return int(self.a.size - 1)

    @property
    def neutral(self) -> bool:
        """Whether a delayed term is of the same order as A."""
        return not self.step and any(self._highest()[1:])

    def _highest(self) -> list[float]:
        """Magnitudes of the coefficients of the highest power of A in A, C, B1 and B2."""
        sums = self.a, self.c, self.b1.coefficients, self.b2.coefficients
        return [abs(float(p[-1])) if p.size == self.a.size else 0.0 for p in sums]

    def neutral_margin(self, c1: npt.ArrayLike, c2: npt.ArrayLike) -> FloatArray:
        r"""How far the neutral root chain is from reaching the imaginary axis.

        At high frequency D is its highest power of s times

        .. math::

            a + c\, e^{-s\delta} - c_1\, b_1 e^{-s(\delta + \tau_1)}
            - c_2\, b_2 e^{-s(\delta + \tau_2)} ,

        with the highest coefficients of A, C, B1 and B2. The roots of this sum repeat along
        the imaginary axis for ever: they are the neutral root chain. The chain stays in the
        left half-plane, for these delays and for all small changes of them, where

        .. math::

            |a| > |c| + |c_1\, b_1| + |c_2\, b_2| .

        Parameters
        ----------
        c1, c2 : array_like of float
            The free parameters; they broadcast.

        Returns
        -------
        float array, of the broadcast shape
            Left side minus right side, divided by |a|; zero where rounding hides the sign. If
            it is negative or zero, the chain is not confined to the left half-plane. It is one
            for a retarded equation and for a map, which have no such chain.

        Raises
        ------
        TypeError, ValueError
            If c1 or c2 is not finite and real.
        """
        name1, name2 = self.parameters
        c1, c2 = real_array(name1, c1), real_array(name2, c2)
        if self.step:
            return np.ones(np.broadcast_shapes(c1.shape, c2.shape))
        a, c, b1, b2 = self._highest()
        left = (a - (c + np.abs(c1) * b1 + np.abs(c2) * b2)) / a
        # A few products and sums round by half an EPSILON each, and so do the coefficients.
        return np.asarray(np.where(np.abs(left) <= 16.0 * EPSILON, 0.0, left))

    @property
    def longest_delay(self) -> float:
        """The longest time in s by which a term is delayed, dead time included."""
        return self.delay + max(self.tau1, self.tau2)

    def characteristic(
        self, s: npt.ArrayLike, c1: npt.ArrayLike | None = None, c2: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Evaluate D(s; c1, c2); all broadcast. Of a loop c1 and c2 are one by default.

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers, c1 or c2 is not finite and real, or the three do
            not broadcast.
        """
        s, x, y = self._checked(s, c1, c2)
        z = np.exp(s * self.step) if self.step else s
        (value, _), *weights = (p.evaluated(z) for p in self.polynomials())
        dead = np.exp(-s * self.delay)
        arms = zip((x, y), self.reference, (self.tau1, self.tau2), strict=True)
        for (b, _), (here, origin, tau) in zip(weights, arms, strict=True):
            value = value + dead * b * ((origin - here) - here * np.expm1(-s * tau))
        return np.asarray(value)

    def _checked(
        self, s: npt.ArrayLike, x: npt.ArrayLike | None, y: npt.ArrayLike | None
    ) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Return s, x and y as arrays that broadcast, or raise."""
        x, y = given_or_one(self, x, y)
        name1, name2 = self.parameters
        arrays = complex_array("s", s), real_array(name1, x), real_array(name2, y)
        broadcast_shape(("s", name1, name2), arrays)
        return arrays


@dataclass(frozen=True)
class DelayEquation(CharacteristicFunction):
    r"""An equation with two delays and two free parameters x and y, by its polynomials.

    Parameters
    ----------
    rest, b1, b2 : sequence of float, or armlock.engine.polynomials.Polynomial
        Coefficients of R, B1 and B2 of the `CharacteristicFunction` in ascending powers of s
        (of z = exp(s step) for a map); or polynomials with known roots, which are then kept.
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

    Raises
    ------
    TypeError, ValueError
        If a coefficient is not finite and real, a delay is negative or not a whole number of
        steps, A is zero, or another term has a higher degree than A (an advanced equation has
        no stable region).

    Examples
    --------
    An oscillator with two delayed forces, x'' + 0.2 x' + x = x1 x(t - 1) + x2 x(t - 2). The
    reference is (0, 0), so that R is A:

    >>> from armlock import DelayEquation, unstable_roots
    >>> rest, b1, b2 = [1.0, 0.2, 1.0], [1.0], [1.0]
    >>> forced = DelayEquation(rest, b1, b2, tau1=1.0, tau2=2.0)
    >>> unstable_roots(forced, [0.1, -0.5], 0.05)
    array([0, 2])
    """

    # Polynomials once they are checked.
    rest: Any
    b1: Any
    b2: Any
    tau1: float
    tau2: float
    _: KW_ONLY
    delay: float = 0.0
    step: float = 0.0
    parameters: tuple[str, str] = ("x", "y")
    reference: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the arguments, and keep them in one form."""
        kept: dict[str, Any] = {}
        for name in ("rest", "b1", "b2"):
            p = getattr(self, name)
            known = isinstance(p, Polynomial)
            kept[name] = p if known else Polynomial.of(axis(name, p).tolist())
        for name in ("tau1", "tau2", "delay", "step"):
            kept[name] = not_negative(name, getattr(self, name))
        pair = axis("reference", self.reference)
        if pair.size != 2:
            raise ValueError(f"reference must hold two numbers, got {pair.size}")
        kept |= {"parameters": tuple(self.parameters), "reference": tuple(pair.tolist())}
        for name, value in kept.items():
            object.__setattr__(self, name, value)
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
        for name, b, tau in (("b1", self.b1, self.tau1), ("b2", self.b2, self.tau2)):
            if b.degree > self.degree:
                raise ValueError(
                    f"{name} must not exceed the degree of A ({self.degree}), "
                    f"got degree {b.degree}: the equation would be of advanced type"
                )
            if tau + self.delay == 0.0 and b and b.degree == self.degree:
                raise ValueError(
                    f"{name} without a delay must be of lower degree than A ({self.degree}), "
                    f"or its parameter would change the order of the equation"
                )


def late(part: list[Term], theta: Fraction = _ZERO, factor: float = 1.0) -> list[Term]:
    """Return a sum of terms times exp(-s theta) and a factor."""
    found = [(weight * Fraction(factor), p, lag + theta) for weight, p, lag in part]
    return [(weight, p, _ZERO) for weight, p, _ in found] + [term for term in found if term[2]]


def checked_system(system: CharacteristicFunction) -> CharacteristicFunction:
    """Return the system, or say what was given in its place."""
    if not isinstance(system, CharacteristicFunction):
        raise TypeError(
            "system must be a CharacteristicFunction, for instance CommonArm(), or, for counts "
            "and the rightmost root, a DelaySystem, as DelaySystem.of(system), got "
            f"{system!r:.200}"
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
