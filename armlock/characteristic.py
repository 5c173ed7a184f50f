"""The characteristic function that every loop of the paper shares.

Whatever the sensor and the controller, clearing denominators of 1 + L(s) leaves

    D(s; x, y) = A(s) - x B1(s) exp(-s delay1) - y B2(s) exp(-s delay2)

with real polynomials A, B1, B2: affine in the two free parameters. It is kept as what it is
at a reference point plus the deviation from there, because near the ideal point (1, 1) of an
arm-locking loop A, B1 and B2 are many orders of magnitude larger than what remains of them.

The semi-discretized loop has the same form with polynomials in z = exp(s step)
instead of s, so that both are one class here and one set of algorithms above.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.checks import (
    ComplexArray,
    FloatArray,
    axis,
    broadcast_shape,
    complex_array,
    positive_number,
    real_array,
    real_number,
)

# Past this an exponential is no float.
_LARGEST_EXPONENT = 700.0


class ExponentialSum(NamedTuple):
    r"""A function sum_g P_g(omega) exp(j omega phase_g) on the stability boundary.

    With phase rates :math:`\alpha_g` it is

    .. math::

        f(\omega) &= \sum_g P_g(\omega)\, e^{\mathrm{j}\omega\alpha_g} \\
        &= \sum_g P_g(\omega)
        + \sum_g P_g(\omega) \left( e^{\mathrm{j}\omega\alpha_g} - 1 \right) ,

    and the second form is the one that is evaluated.

    Attributes
    ----------
    coefficients : complex array, shape (groups, degree + 1)
        Polynomials in omega, ascending powers.
    phases : float array, shape (groups,)
        Phase rates, in s.
    sums : complex array, shape (degree + 1,)
        The sum of all P_g. It is carried along, and not summed up, because the P_g may
        cancel to many digits.
    """

    coefficients: ComplexArray
    phases: FloatArray
    sums: ComplexArray

    def times_conjugate(self, other: ExponentialSum) -> ExponentialSum:
        """Return this sum times the complex conjugate of `other`, at real omega."""
        sums = np.convolve(self.sums, other.sums.conj())
        size = max(self.coefficients.shape[1] + other.coefficients.shape[1] - 1, sums.size)
        rows: dict[float, ComplexArray] = {}
        for p, phase in zip(self.coefficients, self.phases, strict=True):
            for q, other_phase in zip(other.coefficients, other.phases, strict=True):
                product = np.convolve(p, q.conj())
                row = rows.setdefault(phase - other_phase, np.zeros(size, dtype=np.complex128))
                row[: product.size] += product
        return ExponentialSum(
            np.array(list(rows.values())),
            np.array(list(rows)),
            np.pad(sums, (0, size - sums.size)),
        )

    def at(self, omega: FloatArray) -> ComplexArray:
        """Evaluate the sum at real frequencies in rad/s; shaped like `omega`."""
        omega = np.asarray(omega, dtype=np.float64)
        value = poly.polyval(omega, self.sums)
        for p, phase in zip(self.coefficients, self.phases, strict=True):
            if phase:
                value = value + poly.polyval(omega, p) * np.expm1(1j * omega * phase)
        return np.asarray(value, dtype=np.complex128)

    def scaled(self, weight: float) -> ExponentialSum:
        """Return this sum times a number."""
        return ExponentialSum(weight * self.coefficients, self.phases, weight * self.sums)

    def plus(self, other: ExponentialSum) -> ExponentialSum:
        """Return this sum plus another one, over the groups of both."""
        size = max(
            self.sums.size,
            other.sums.size,
            self.coefficients.shape[1],
            other.coefficients.shape[1],
        )

        def padded(p: ComplexArray) -> ComplexArray:
            return np.pad(p, [(0, 0)] * (p.ndim - 1) + [(0, size - p.shape[-1])])

        return ExponentialSum(
            np.concatenate((padded(self.coefficients), padded(other.coefficients))),
            np.concatenate((self.phases, other.phases)),
            padded(self.sums) + padded(other.sums),
        )


class CharacteristicFunction:
    r"""D(s; x, y) = A - x B1 exp(-s delay1) - y B2 exp(-s delay2).

    It is kept as its value R at a reference point, and the deviation from there:

    .. math::

        D(s; x, y) &= A - x\, B_1 e^{-s\theta_1} - y\, B_2 e^{-s\theta_2} \\
        &= R + B_1 \left( x_0 - x\, e^{-s\theta_1} \right) \\
        &\quad + B_2 \left( y_0 - y\, e^{-s\theta_2} \right) , \\
        A &= R + x_0 B_1 + y_0 B_2 ,

    with polynomials A, B1, B2 and R of s, and delays :math:`\theta_1, \theta_2`.

    Parameters
    ----------
    rest, b1, b2 : sequence of float
        Polynomial coefficients in ascending powers of s (of z = exp(s step) for a map).
        With the reference at (0, 0), `rest` is A itself.
    delay1, delay2 : float
        Delays in s, zero or positive.
    step : float, optional
        Zero (default) for polynomials in s; the sampling step in s for a map, which must
        divide both delays.
    parameters : pair of str, optional
        Names of the two free parameters, used in messages and on axes.
    reference : pair of float, optional
        The point (x0, y0) at which D is `rest` when both delays are left out, so that
        A = rest + x0 B1 + y0 B2. For a loop it is (1, 1), and `rest` the denominator of L.

    Raises
    ------
    TypeError, ValueError
        If a coefficient is not finite and real, a delay is negative or not a whole number of
        steps, A is zero, or B1 or B2 has a higher degree than A (an advanced equation has no
        stable region).

    Notes
    -----
    It cannot be changed once it is made, because results are kept with it; its arrays are
    read-only.

    The loop is of *retarded* type if B1 and B2 are of lower degree than A, and of *neutral*
    type (`neutral` is true) if one of them reaches it.

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
        at_reference = poly.polyadd(self.reference[0] * self.b1, self.reference[1] * self.b2)
        self.a = _polynomial("a", np.asarray(poly.polyadd(self.rest, at_reference)))
        self.delay1 = _delay("delay1", delay1)
        self.delay2 = _delay("delay2", delay2)
        self.step = _step(step)
        if self.step:
            for name, delay in (("delay1", self.delay1), ("delay2", self.delay2)):
                whole_steps(name, delay, self.step)
        self.parameters = _names(parameters)
        if not self.a.any():
            raise ValueError(
                f"A = rest + {self.reference[0]} B1 + {self.reference[1]} B2 must not vanish, "
                f"got rest={self.rest.tolist()}"
            )
        for name, b in (("b1", self.b1), ("b2", self.b2)):
            if b.size > self.a.size:
                raise ValueError(
                    f"{name} must not exceed the degree of A ({self.degree}), "
                    f"got degree {b.size - 1}: the equation would be of advanced type"
                )
        for name, b, delay in (("b1", self.b1, self.delay1), ("b2", self.b2, self.delay2)):
            if delay == 0.0 and b.size == self.a.size > 1 and not self.step:
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

    def __delattr__(self, name: str) -> None:
        """Refuse changes."""
        raise AttributeError(f"a {type(self).__name__} cannot be changed, got del {name}")

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take the attributes of a copied or pickled system; its arrays stay read-only."""
        self.__dict__.update(state)
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

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
    def highest_coefficients(self) -> tuple[float, float, float]:
        """Coefficients of the highest power of A in A, B1 and B2."""

        def highest(p: FloatArray) -> float:
            return float(p[-1]) if p.size == self.a.size else 0.0

        return highest(self.a), highest(self.b1), highest(self.b2)

    @property
    def longest_delay(self) -> float:
        """The longer of the two delays, in s."""
        return max(self.delay1, self.delay2)

    def __repr__(self) -> str:
        """Name the class and its arguments, as they are written to make it again."""
        shown = [
            f"{name}={np.asarray(getattr(self, name)).tolist()}"
            for name in ("rest", "b1", "b2", "delay1", "delay2")
        ]
        defaults = {"step": 0.0, "parameters": ("x", "y"), "reference": (0.0, 0.0)}
        for name, default in defaults.items():
            if getattr(self, name) != default:
                shown.append(f"{name}={getattr(self, name)!r}")
        return f"{type(self).__name__}({', '.join(shown)})"

    def parts(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Evaluate A, B1 exp(-s delay1) and B2 exp(-s delay2).

        Parameters
        ----------
        s : array_like of complex
            Laplace variable in rad/s, any shape.

        Returns
        -------
        tuple of three complex arrays, shaped like `s`

        Raises
        ------
        TypeError, ValueError
            If s does not hold finite numbers.
        """
        s = complex_array("s", s)
        z = np.exp(s * self.step) if self.step else s
        return (
            np.asarray(poly.polyval(z, self.a), dtype=np.complex128),
            np.asarray(poly.polyval(z, self.b1) * np.exp(-s * self.delay1)),
            np.asarray(poly.polyval(z, self.b2) * np.exp(-s * self.delay2)),
        )

    def values_up_to_a_factor(
        self, z: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Evaluate `rest`, B1 and B2 as polynomials, up to a factor that all three share.

        A root does not depend on the factor, so that a subclass may divide by what rounding
        would spoil.

        Parameters
        ----------
        z : complex array
            The frequency s, or exp(s step) for a map.

        Returns
        -------
        tuple of three complex arrays, shaped like `z`
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
        result: ComplexArray = poly.polyval(z, self.rest) + b1 * arm1 + b2 * arm2
        return result

    def derivative(self, s: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike) -> ComplexArray:
        r"""Evaluate dD/ds; the three arguments broadcast.

        .. math::

            \frac{\partial D}{\partial s} &= A'
            - x \left( B_1' - \theta_1 B_1 \right) e^{-s\theta_1} \\
            &\quad - y \left( B_2' - \theta_2 B_2 \right) e^{-s\theta_2}

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
            p: FloatArray, delay: float, start: float, here: float | FloatArray
        ) -> ComplexArray:
            arm = (start - here) - here * np.expm1(-s * delay)
            change = here * delay * np.exp(-s * delay)
            slope = poly.polyval(z, poly.polyder(p)) * dz
            return np.asarray(slope * arm + poly.polyval(z, p) * change)

        result: ComplexArray = (
            poly.polyval(z, poly.polyder(self.rest)) * dz
            + term(self.b1, self.delay1, self.reference[0], x)
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
            return _taylor_shift(p, sigma)

        # The reference moves along, so that nothing has to cancel in `rest`.
        return CharacteristicFunction(
            move(self.rest),
            np.exp(-sigma * self.delay1) * move(self.b1),
            np.exp(-sigma * self.delay2) * move(self.b2),
            self.delay1,
            self.delay2,
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
            step=self.step,
            parameters=self.parameters[::-1],
            reference=self.reference[::-1],
        )

    def on_boundary(self) -> tuple[ExponentialSum, ExponentialSum, ExponentialSum]:
        """Return A, B1 and B2 (with their delays) at s = j omega as exponential sums."""
        return (
            self._sum(self.a, 0.0),
            self._sum(self.b1, self.delay1),
            self._sum(self.b2, self.delay2),
        )

    def at(self, x: float, y: float) -> ExponentialSum:
        """Return D(j omega; x, y) at one point as an exponential sum."""
        _, b1, b2 = self.on_boundary()
        # Delays left out, `deviation` is what the point adds to `rest`.
        deviation = b1.scaled(self.reference[0] - x).plus(b2.scaled(self.reference[1] - y))
        combined = self._sum(self.a, 0.0).plus(b1.scaled(-x)).plus(b2.scaled(-y))
        return combined._replace(sums=self.rest_on_boundary().plus(deviation).sums)

    def deviation(self, x: float, y: float) -> ExponentialSum:
        """Return x B1 exp(-s delay1) + y B2 exp(-s delay2) at s = j omega."""
        _, b1, b2 = self.on_boundary()
        return b1.scaled(x).plus(b2.scaled(y))

    def rest_on_boundary(self) -> ExponentialSum:
        """Return `rest` at s = j omega as an exponential sum."""
        return self._sum(self.rest, 0.0)

    def _sum(self, p: FloatArray, delay: float) -> ExponentialSum:
        """Return p exp(-s delay) at s = j omega as an exponential sum."""
        if self.step:
            rates = np.asarray(self.step * np.arange(p.size) - delay, dtype=np.float64)
            terms = p[:, None].astype(np.complex128)
            return ExponentialSum(terms, rates, terms.sum(axis=0))
        powers = 1j ** (np.arange(p.size) % 4)
        # Each coefficient is kept exactly real or exactly imaginary.
        powers = np.round(powers.real) + 1j * np.round(powers.imag)
        return ExponentialSum((p * powers)[None, :], np.array([-delay]), p * powers)


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


def _names(value: tuple[str, str]) -> tuple[str, str]:
    """Return the names of the two parameters, or raise."""
    names = tuple(value) if isinstance(value, tuple | list) else (value,)
    if len(names) != 2 or not all(isinstance(name, str) for name in names):
        raise TypeError(f"parameters must be a pair of names, got {value!r}")
    return names[0], names[1]


def _step(value: float) -> float:
    """Return a finite step that is zero or positive."""
    step = real_number("step", value)
    return 0.0 if step == 0.0 else positive_number("step", step)


def _delay(name: str, value: float) -> float:
    """Return a finite delay that is zero or positive."""
    delay = real_number(name, value)
    if delay < 0.0:
        raise ValueError(f"{name} must not be negative, got {delay}")
    return delay


__all__ = ["CharacteristicFunction", "ExponentialSum", "checked_system", "whole_steps"]
