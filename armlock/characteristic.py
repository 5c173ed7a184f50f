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

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.checks import (
    ComplexArray,
    FloatArray,
    as_written,
    axis,
    broadcast_shape,
    complex_array,
    real_array,
    real_number,
)
from armlock.exponentials import EPSILON, ExponentialSum, Polynomial

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
    rest, b1, b2 : sequence of float
        Coefficients of R, B1 and B2 in ascending powers of s (of z = exp(s step) for a map).
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
        rest: Sequence[float] | FloatArray,
        b1: Sequence[float] | FloatArray,
        b2: Sequence[float] | FloatArray,
        delay1: float,
        delay2: float,
        *,
        delay: float = 0.0,
        step: float = 0.0,
        parameters: tuple[str, str] = ("x", "y"),
        reference: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.rest = _polynomial("rest", rest)
        self.b1 = _polynomial("b1", b1)
        self.b2 = _polynomial("b2", b2)
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
            self.a = _polynomial("a", np.asarray(poly.polyadd(self.rest, c)))
            self.c = _polynomial("c", [0.0])
        else:
            self.a, self.c = self.rest, _polynomial("c", np.asarray(c))
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
            if lag + self.delay == 0.0 and b.size == self.a.size and not self.step:
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
        if self.step:
            return False
        return any(b.size == self.a.size for b in (self.b1, self.b2, self.c))

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
            Left less right side over \|a\|, and zero where rounding hides the sign. Negative or
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
        z = np.exp(s * self.step) if self.step else s
        dead = np.exp(-s * self.delay)
        return (
            np.asarray(poly.polyval(z, self.a) + poly.polyval(z, self.c) * dead),
            np.asarray(poly.polyval(z, self.b1) * np.exp(-s * self.delay1) * dead),
            np.asarray(poly.polyval(z, self.b2) * np.exp(-s * self.delay2) * dead),
        )

    def proportional_values(
        self, z: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Evaluate R, B1 and B2 up to a factor that all three share.

        A root does not depend on the factor, so that a subclass may divide by what rounding
        would spoil.
        """
        rest, b1, b2 = (
            np.asarray(poly.polyval(z, p), dtype=np.complex128)
            for p in (self.rest, self.b1, self.b2)
        )
        return rest, b1, b2

    def __call__(self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike) -> ComplexArray:
        """Evaluate D(s; x, y); the three arguments broadcast.

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers, x or y is not finite and real, or the three do
            not broadcast.
        """
        return self._value(*self._checked(s, x, y))

    def _checked(
        self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike
    ) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Return s, x and y as arrays that broadcast, or raise."""
        name1, name2 = self.parameters
        arrays = complex_array("s", s), real_array(name1, x), real_array(name2, y)
        broadcast_shape(("s", name1, name2), arrays)
        return arrays

    def _value(
        self, s: ComplexArray, x: float | FloatArray, y: float | FloatArray
    ) -> ComplexArray:
        """Evaluate D(s; x, y) unchecked."""
        z = np.exp(s * self.step) if self.step else s
        b1, b2 = poly.polyval(z, self.b1), poly.polyval(z, self.b2)
        arm1 = (self.reference[0] - x) - x * np.expm1(-s * self.delay1)
        arm2 = (self.reference[1] - y) - y * np.expm1(-s * self.delay2)
        dead = np.exp(-s * self.delay)
        result: ComplexArray = poly.polyval(z, self.rest) + dead * (b1 * arm1 + b2 * arm2)
        return result

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
        return self._slope(*self._checked(s, x, y))

    def _slope(
        self, s: ComplexArray, x: float | FloatArray, y: float | FloatArray
    ) -> ComplexArray:
        """Evaluate dD/ds unchecked."""
        z = np.exp(s * self.step) if self.step else s
        dz = self.step * z if self.step else np.ones_like(s)

        def term(
            p: FloatArray, lag: float, start: float, here: float | FloatArray
        ) -> ComplexArray:
            arm = (start - here) - here * np.expm1(-s * lag)
            value = poly.polyval(z, p)
            slope = poly.polyval(z, poly.polyder(p)) * dz - self.delay * value
            return np.asarray(slope * arm + value * here * lag * np.exp(-s * lag))

        result: ComplexArray = poly.polyval(z, poly.polyder(self.rest)) * dz + np.exp(
            -s * self.delay
        ) * (
            term(self.b1, self.delay1, self.reference[0], x)
            + term(self.b2, self.delay2, self.reference[1], y)
        )
        return result

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

        def move(p: FloatArray) -> FloatArray:
            if self.step:
                return np.asarray(p * np.exp(sigma * self.step * np.arange(p.size)))
            return np.asarray(poly.Polynomial(p)(poly.Polynomial([sigma, 1.0])).coef)

        # The reference moves along, so that nothing has to cancel in `rest`.
        dead = np.exp(-sigma * self.delay)
        return CharacteristicFunction(
            move(self.rest),
            dead * np.exp(-sigma * self.delay1) * move(self.b1),
            dead * np.exp(-sigma * self.delay2) * move(self.b2),
            self.delay1,
            self.delay2,
            delay=self.delay,
            step=self.step,
            parameters=self.parameters,
            reference=(
                self.reference[0] * float(np.exp(sigma * self.delay1)),
                self.reference[1] * float(np.exp(sigma * self.delay2)),
            ),
        )

    def exchanged(self) -> CharacteristicFunction:
        """Return the same function with its two free parameters exchanged."""
        return CharacteristicFunction(
            self.rest,
            self.b2,
            self.b1,
            self.delay2,
            self.delay1,
            delay=self.delay,
            step=self.step,
            parameters=self.parameters[::-1],
            reference=self.reference[::-1],
        )

    def polynomials(self) -> tuple[Polynomial, Polynomial, Polynomial]:
        """Return R, B1 and B2 with their roots."""
        return Polynomial.of(self.rest), Polynomial.of(self.b1), Polynomial.of(self.b2)

    def on_boundary(self) -> tuple[ExponentialSum, ExponentialSum, ExponentialSum]:
        """Return the three terms of `parts` at s = j omega as exponential sums."""
        x0, y0 = self.reference
        lags = self.delay + self.delay1, self.delay + self.delay2
        if self.step:
            return self._of_map(lags)
        polynomials = self.polynomials()
        return (
            ExponentialSum(
                polynomials,
                np.array([[1.0, 0.0, 0.0], [0.0, x0, y0]]),
                np.array([0.0, -self.delay]),
                np.array([1.0, x0, y0]),
            ),
            ExponentialSum(
                polynomials,
                np.array([[0.0, 1.0, 0.0]]),
                np.array([-lags[0]]),
                np.array([0.0, 1.0, 0.0]),
            ),
            ExponentialSum(
                polynomials,
                np.array([[0.0, 0.0, 1.0]]),
                np.array([-lags[1]]),
                np.array([0.0, 0.0, 1.0]),
            ),
        )

    def _of_map(
        self, lags: tuple[float, float]
    ) -> tuple[ExponentialSum, ExponentialSum, ExponentialSum]:
        """`on_boundary` of a map: each power of z is an exponential, its polynomial is 1.

        Each coefficient keeps a polynomial of its own, so that its rounding is not forgotten.
        """
        parts = self.rest, self.b1, self.b2
        sizes = [p.size for p in parts]
        ones = (Polynomial(np.ones(1), np.zeros(0, dtype=np.complex128)),) * sum(sizes)
        places = np.split(np.eye(len(ones)), np.cumsum(sizes)[:-1])

        def term(k: int, lag: float, weight: float = 1.0) -> ExponentialSum:
            p = weight * parts[k]
            phases = np.asarray(self.step * np.arange(p.size) - lag, dtype=np.float64)
            return ExponentialSum(ones, p[:, None] * places[k], phases, p @ places[k])

        x0, y0 = self.reference
        first = term(0, 0.0).plus(term(1, self.delay, x0)).plus(term(2, self.delay, y0))
        return first, term(1, lags[0]), term(2, lags[1])

    def at(self, x: float, y: float) -> ExponentialSum:
        """Return D(j omega; x, y) at one point as an exponential sum."""
        x0, y0 = self.reference
        constant, b1, b2 = self.on_boundary()
        combined = constant.plus(b1.scaled(-x)).plus(b2.scaled(-y))
        # What is left where all exponentials are one, without the digits lost by cancelling.
        left = self.rest_on_boundary().sums + (x0 - x) * b1.sums + (y0 - y) * b2.sums
        return combined._replace(sums=left)

    def deviation(self, x: float, y: float) -> ExponentialSum:
        """Return x B1 exp(-s (delay + delay1)) + y B2 exp(-s (delay + delay2)) at s = j omega.

        That is what D subtracts from its first term.
        """
        _, b1, b2 = self.on_boundary()
        return b1.scaled(x).plus(b2.scaled(y))

    def rest_on_boundary(self) -> ExponentialSum:
        """Return `rest` at s = j omega as an exponential sum."""
        constant, _, _ = self.on_boundary()
        if self.step:
            size = self.rest.size
            return constant._replace(
                weights=constant.weights[:size],
                phases=constant.phases[:size],
                sums=np.concatenate((self.rest, np.zeros(constant.sums.size - size))),
            )
        only = np.array([1.0, 0.0, 0.0])
        return constant._replace(weights=only[None, :], phases=np.zeros(1), sums=only)


def whole_steps(name: str, delay: float, step: float) -> int:
    """Return delay / step, or raise if it is not a whole number but for rounding."""
    steps = delay / step
    # Within a part in 1e9 of the delay, and always within a thousandth of a step.
    if not steps < 1e15 or abs(steps - round(steps)) > min(1e-9 * steps, 1e-3):
        raise ValueError(
            f"step must divide every delay, got step={step} for {name}={delay} "
            f"({steps:g} steps)"
        )
    return round(steps)


def checked_system(system: CharacteristicFunction) -> CharacteristicFunction:
    """Return the system, or say what was given in its place."""
    if not isinstance(system, CharacteristicFunction):
        raise TypeError(
            f"system must be a CharacteristicFunction, for instance CommonArm(), got {system!r}"
        )
    return system


def _polynomial(name: str, coefficients: Sequence[float] | FloatArray) -> FloatArray:
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
