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
from fractions import Fraction
from functools import cached_property
from typing import Any, NoReturn, Self

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.axis.exponentials import EPSILON, LOW_DEGREE, ExponentialSum, Polynomial
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

# Past this an exponential is no float.
_LARGEST_EXPONENT = 700.0
# The free parameters of a loop, the perturbations of its arms: one where there is none.
_PERTURBATIONS = ("c1", "c2")


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
    rest, b1, b2 : sequence of float, or armlock.axis.exponentials.Polynomial
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
    It is a value: it cannot be changed, its arrays are read-only, and two of one type that are
    made from equal arguments are equal. `replace` makes another one. A subclass calls
    `made_from` with its own arguments once it is made.

    The equation is of *retarded* type if all delayed terms are of lower degree than A, and of
    *neutral* type (`neutral` is true) if one of them reaches it. The roots of a neutral
    equation at high frequency form the *neutral root chain*, see `chain_reserve`.

    Examples
    --------
    An oscillator with two delayed forces, x'' + 0.2 x' + x = x1 x(t - 1) + x2 x(t - 2):

    >>> from armlock import CharacteristicFunction, unstable_roots
    >>> a, b1, b2 = [1.0, 0.2, 1.0], [1.0], [1.0]
    >>> forced = CharacteristicFunction(a, b1, b2, tau1=1.0, tau2=2.0)
    >>> unstable_roots(forced, [0.1, -0.5], 0.05)
    array([0, 2])
    """

    rest: FloatArray
    b1: FloatArray
    b2: FloatArray
    a: FloatArray
    c: FloatArray
    tau1: float
    tau2: float
    delay: float
    step: float
    parameters: tuple[str, str]
    reference: tuple[float, float]
    _polynomials: tuple[Polynomial, ...]
    _arguments: dict[str, Any]

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
        named = {"rest": rest, "b1": b1, "b2": b2}
        polynomials = {name: _polynomial(name, p) for name, p in named.items()}
        r, p1, p2 = (p.coefficients for p in polynomials.values())
        pair = axis("reference", reference)
        if pair.size != 2:
            raise ValueError(f"reference must hold two numbers, got {pair.size}")
        x0, y0 = pair.tolist()
        times = {"tau1": tau1, "tau2": tau2, "delay": delay, "step": step}
        times = {name: _not_negative(name, value) for name, value in times.items()}
        if times["step"]:
            for name in ("delay", "tau1", "tau2"):
                whole_steps(name, times[name], times["step"])
        c = poly.polyadd(x0 * p1, y0 * p2)
        if times["delay"]:
            a, c = r, _trimmed("c", np.asarray(c))
        else:
            # Nothing delays C: it is part of A.
            a, c = _trimmed("a", np.asarray(poly.polyadd(r, c))), _trimmed("c", [0.0])
        if not a.any():
            raise ValueError(
                f"A, the term without a delay, must not vanish, got rest={r.tolist()}"
            )
        degree = a.size - 1
        for name, b in (("b1", p1), ("b2", p2), ("c", c)):
            if b.size > a.size:
                raise ValueError(
                    f"{name} must not exceed the degree of A ({degree}), "
                    f"got degree {b.size - 1}: the equation would be of advanced type"
                )
        for name, b, tau in (("b1", p1, times["tau1"]), ("b2", p2, times["tau2"])):
            if tau + times["delay"] == 0.0 and b.size == a.size:
                raise ValueError(
                    f"{name} without a delay must be of lower degree than A ({degree}), "
                    f"or its parameter would change the order of the equation"
                )
        vars(self).update(
            times, rest=r, b1=p1, b2=p2, a=a, c=c, parameters=tuple(parameters),
            reference=(x0, y0), _polynomials=tuple(polynomials.values()),
        )  # fmt: skip
        self.made_from(
            **polynomials, **times, parameters=self.parameters, reference=self.reference
        )

    def made_from(self, **arguments: Any) -> None:
        """Keep the arguments that make this once more, at the end of a class's `__init__`.

        Parameters
        ----------
        **arguments
            Checked, and such that nobody changes them. They become attributes too, but for
            those that there are already.
        """
        vars(self).update({**arguments, **vars(self), "_arguments": arguments})

    def replace(self, **changes: Any) -> Self:
        """Return another one of the same class, made with other values of some arguments.

        Parameters
        ----------
        **changes
            Arguments of the class, by name. All others are as they were given: a signal mapping
            that was given as an object stays as it is when the delays change, one that was
            given by its name is made anew.

        Returns
        -------
        CharacteristicFunction
            Of the same class. `copy.replace` calls this, from Python 3.13 on.

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
        return type(self)(**{**self._arguments, **changes})

    __replace__ = replace

    def plain(self) -> CharacteristicFunction:
        """Return D alone, with the arguments of `CharacteristicFunction`."""
        rest, b1, b2 = self._polynomials
        return CharacteristicFunction(
            rest, b1, b2, self.tau1, self.tau2, delay=self.delay, step=self.step,
            parameters=self.parameters, reference=self.reference,
        )  # fmt: skip

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Refuse changes: results are kept with the system they belong to."""
        raise AttributeError(
            f"a {type(self).__name__} cannot be changed, got {name} = {value!r:.60}: make "
            f"another one with replace({name}=...)"
        )

    def __delattr__(self, name: str) -> NoReturn:
        """Refuse changes."""
        raise AttributeError(f"a {type(self).__name__} cannot be changed, got del {name}")

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take what was pickled or copied; arrays are read-only again."""
        vars(self).update(state)
        for p in self._polynomials:
            _sealed(p)
        for array in (self.rest, self.b1, self.b2, self.a, self.c):
            array.setflags(write=False)

    def _identity(self) -> tuple[Any, ...]:
        """Return what two equal ones have in common, hashable."""
        polynomials = [(*p.coefficients.tolist(), *p.roots.tolist()) for p in self._polynomials]
        times = self.tau1, self.tau2, self.delay, self.step
        return *polynomials, times, self.parameters, self.reference

    def __eq__(self, other: object) -> bool:
        """Whether the other one is of the same class, with equal arguments."""
        if type(other) is not type(self):
            return NotImplemented
        assert isinstance(other, CharacteristicFunction)
        return self._identity() == other._identity()

    @cached_property
    def _hash(self) -> int:
        """Of numbers alone, whose hash is the same in every process: it is pickled along."""
        numbers = self.rest.tolist(), self.b1.tolist(), self.b2.tolist()
        return hash((*map(tuple, numbers), self.tau1, self.tau2, self.delay))

    def __hash__(self) -> int:
        """Return a number that equal ones share."""
        return self._hash

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
        reserve = (a - c - np.abs(x) * b1 - np.abs(y) * b2) / a
        return np.asarray(np.where(np.abs(reserve) <= 16.0 * EPSILON, 0.0, reserve))

    @property
    def longest_delay(self) -> float:
        """The longest time in s by which a term is delayed, dead time included."""
        return self.delay + max(self.tau1, self.tau2)

    @property
    def omega_per_turn(self) -> float:
        """Change of omega, in rad/s, that is one turn of the longest delay; inf without one."""
        return 2.0 * np.pi / self.longest_delay if self.longest_delay else np.inf

    def __repr__(self) -> str:
        """Name the class and its arguments, as they are written to make it again."""
        shown = {
            name: value.coefficients.tolist() if isinstance(value, Polynomial) else value
            for name, value in self._arguments.items()
        }
        listed = ", ".join(f"{name}={value!r}" for name, value in shown.items())
        return f"{type(self).__name__}({listed})"

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
        z = np.exp(s * self.step) if self.step else s
        dead = np.exp(-s * self.delay)
        return (
            np.asarray(poly.polyval(z, self.a) + poly.polyval(z, self.c) * dead),
            np.asarray(poly.polyval(z, self.b1) * np.exp(-s * self.tau1) * dead),
            np.asarray(poly.polyval(z, self.b2) * np.exp(-s * self.tau2) * dead),
        )

    def __call__(
        self, s: npt.ArrayLike, x: npt.ArrayLike | None = None, y: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Evaluate D(s; x, y); the three arguments broadcast. Of a loop x and y default to one.

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers, x or y is not finite and real, or the three do
            not broadcast.
        """
        return np.asarray(self.with_slope(*self._checked(s, x, y))[0])

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
        return (self.b1, self.tau1, x0, x), (self.b2, self.tau2, y0, y)

    def with_slope(self, s: Any, x: Any, y: Any, library: Any = np) -> tuple[Any, Any]:
        """Evaluate D(s; x, y) and its derivative in s, unchecked.

        The functions are those of numpy, or of mpmath for one number in extended precision.
        """
        number = complex if library is np else library.mpc
        z = library.exp(s * self.step) if self.step else s
        dz = self.step * z if self.step else 1.0
        value, slope = 0.0, 0.0
        for p, (_, tau, origin, here) in zip(
            self._polynomials[1:], self.arms(x, y), strict=True
        ):
            b, db = p.with_slope(z, number)
            change = library.expm1(-s * tau)
            arm = (origin - here) - here * change
            value = value + b * arm
            slope = slope + (db * dz - self.delay * b) * arm + b * here * tau * (1.0 + change)
        dead = library.exp(-s * self.delay)
        rest, own = self._polynomials[0].with_slope(z, number)
        return rest + dead * value, own * dz + dead * slope

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
            As a call does.
        """
        return np.asarray(self.with_slope(*self._checked(s, x, y))[1])

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
        _, b1, b2 = self._polynomials
        return self.plain().replace(
            b1=b2,
            b2=b1,
            tau1=self.tau2,
            tau2=self.tau1,
            parameters=self.parameters[::-1],
            reference=self.reference[::-1],
        )

    def polynomials(self) -> tuple[Polynomial, ...]:
        """Return R, B1 and B2 with their roots."""
        return self._polynomials

    @cached_property
    def roots_of_a(self) -> ComplexArray:
        """Roots of A: they enter a count through the argument of A, past the last frequency.

        With a dead time A is R, whose roots are known.
        """
        return self._polynomials[0].roots if self.delay else Polynomial.of(self.a).roots

    def _delayed(self, k: int, lag: float, weight: float = 1.0) -> ExponentialSum:
        """Return `weight` times R, B1 or B2, delayed by a time, at s = j omega.

        For a map each power of z is an exponential, its polynomial is 1. Each coefficient keeps
        a polynomial of its own, so that its rounding is not forgotten.
        """
        factors, polynomials = [np.ones(1)] * 3, self._polynomials
        if self.step:
            factors = [p.coefficients for p in self._polynomials]
            number = sum(p.size for p in factors)
            polynomials = (Polynomial(np.ones(1), np.zeros(0, dtype=np.complex128)),) * number
        ends = np.cumsum([p.size for p in factors])
        place = np.split(np.eye(len(polynomials)), ends[:-1])[k]
        p = weight * factors[k]
        phases = np.asarray(self.step * np.arange(p.size) - lag, dtype=np.float64)
        return ExponentialSum(polynomials, p[:, None] * place, phases, p @ place)

    def on_boundary(self) -> tuple[ExponentialSum, ExponentialSum, ExponentialSum]:
        """Return the three terms of `parts` at s = j omega as exponential sums."""
        x0, y0 = self.reference
        undelayed = self.rest_on_boundary().plus(self._delayed(1, self.delay, x0))
        return (
            undelayed.plus(self._delayed(2, self.delay, y0)),
            self._delayed(1, self.delay + self.tau1),
            self._delayed(2, self.delay + self.tau2),
        )

    def sum_at(self, x: float, y: float) -> ExponentialSum:
        """Return D(j omega; x, y) at one point as an exponential sum."""
        x0, y0 = self.reference
        constant, b1, b2 = self.on_boundary()
        combined = constant.plus(b1.scaled(-x)).plus(b2.scaled(-y))
        # What is left where all exponentials are one, without the digits lost by cancelling.
        left = self.rest_on_boundary().sums + (x0 - x) * b1.sums + (y0 - y) * b2.sums
        return combined._replace(sums=left)

    def deviation(self, x: float, y: float) -> ExponentialSum:
        """Return x B1 exp(-s (delay + tau1)) + y B2 exp(-s (delay + tau2)) at s = j omega.

        That is what D subtracts from its first term.
        """
        _, b1, b2 = self.on_boundary()
        return b1.scaled(x).plus(b2.scaled(y))

    def rest_on_boundary(self) -> ExponentialSum:
        """Return R at s = j omega as an exponential sum."""
        return self._delayed(0, 0.0)


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
                return _with_moved(origin, sigma, late * powers * p.coefficients, p.roots)
            return _with_moved(origin, sigma, late * _taylor(p.coefficients, sigma), p.roots)

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
        self.made_from(origin=origin, sigma=sigma)

    @cached_property
    def roots_of_a(self) -> ComplexArray:
        """Those of the origin, moved: to find them in extended precision takes a second."""
        if self.delay:
            return super().roots_of_a
        return _with_moved(self.origin, self.sigma, self.a, self.origin.roots_of_a).roots


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
    origin: CharacteristicFunction, sigma: float, coefficients: FloatArray, roots: ComplexArray
) -> Polynomial:
    """Return a shifted polynomial from its coefficients, and its roots before the shift."""
    if origin.step:
        return Polynomial(coefficients, roots * np.exp(-sigma * origin.step))
    if coefficients.size > LOW_DEGREE + 1:
        return Polynomial(coefficients, roots - sigma)
    return Polynomial.of(coefficients, roots - sigma)


def _polynomial(name: str, given: Sequence[float] | FloatArray | Polynomial) -> Polynomial:
    """Return a polynomial with trimmed, read-only coefficients, and its roots."""
    if isinstance(given, Polynomial):
        coefficients = _trimmed(name, given.coefficients)
        return _sealed(given._replace(coefficients=coefficients, roots=given.roots.copy()))
    return _sealed(Polynomial.of(_trimmed(name, given)))


def _sealed(p: Polynomial) -> Polynomial:
    """Make the arrays of a polynomial read-only."""
    for array in (p.coefficients, p.roots):
        array.setflags(write=False)
    return p


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
