"""Systems with any number of delays, for loops of your own, as python-control writes them.

    L(s) = N(s) / M(s) ,   N, M = sums of real polynomials of s, each times exp(-s theta)

All coefficients and delays are kept exactly, as fractions. `DelaySystem.functions` hands both
sums to the engine, which counts zeros and certifies margins.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.checks import ComplexArray, WithDelays, complex_array, real_array, real_number
from armlock.controllers import Controller, check_system
from armlock.engine.functions import Function, Space
from armlock.engine.polynomials import Polynomial

if TYPE_CHECKING:
    import control

_Coefficients = tuple[Fraction, ...]


@dataclass(frozen=True)
class QuasiPolynomial:
    """A sum of real polynomials of s, each times exp(-s theta).

    Attributes
    ----------
    terms : tuple of (Fraction, tuple of Fraction)
        Delays in s, ascending, and coefficients in ascending powers of s.
    """

    terms: tuple[tuple[Fraction, _Coefficients], ...]

    @classmethod
    def of(cls, terms: Iterable[tuple[Fraction, Any]]) -> QuasiPolynomial:
        """Return the sum of terms, of which several may have one delay."""
        found: dict[Fraction, Any] = {}
        for theta, coefficients in terms:
            found[theta] = poly.polyadd(found.get(theta, [Fraction(0)]), coefficients)
        return cls(tuple((theta, tuple(p)) for theta, p in sorted(found.items()) if p.any()))

    def __add__(self, other: QuasiPolynomial) -> QuasiPolynomial:
        """Return the sum."""
        return QuasiPolynomial.of(self.terms + other.terms)

    def __neg__(self) -> QuasiPolynomial:
        """Return the negative."""
        return QuasiPolynomial(tuple((t, tuple(-c for c in p)) for t, p in self.terms))

    def __mul__(self, other: QuasiPolynomial) -> QuasiPolynomial:
        """Return the product."""
        return QuasiPolynomial.of(
            (t + u, poly.polymul(p, q)) for t, p in self.terms for u, q in other.terms
        )

    def __str__(self) -> str:
        """Return the sum as one writes it, in descending powers."""
        shown = []
        for theta, p in self.terms:
            powers = [
                f"{float(c):+.6g}" + ("", " s", f" s^{k}")[min(k, 2)]
                for k, c in enumerate(p)
                if c
            ]
            turned = f" exp(-{float(theta):.6g} s)" if theta else ""
            shown.append(f"({' '.join(powers[::-1]).removeprefix('+')}){turned}")
        return " + ".join(shown) or "0"

    @cached_property
    def parts(self) -> tuple[tuple[Fraction, _Coefficients], ...]:
        """The sum of all polynomials, and those that are delayed, before exp(-s theta) - 1.

        So no large terms cancel at low frequency.
        """
        whole = QuasiPolynomial.of((Fraction(0), p) for _, p in self.terms).terms
        return whole + tuple((theta, p) for theta, p in self.terms if theta)

    def __call__(self, s: ComplexArray) -> ComplexArray:
        """Evaluate at s."""
        found = np.zeros_like(s)
        for theta, coefficients in self.parts:
            value = poly.polyval(s, [float(c) for c in coefficients])
            found += value * np.expm1(-s * float(theta)) if theta else value
        return found

    def shifted(self, sigma: float) -> QuasiPolynomial:
        """Return the function of s + sigma; its exponentials are rounded."""
        return QuasiPolynomial.of(
            (theta, Fraction(float(np.exp(-sigma * float(theta)))) * moved(p, sigma))
            for theta, p in self.terms
        )


def moved(coefficients: _Coefficients, sigma: float) -> Any:
    """Return the coefficients of p(s + sigma), exactly."""
    found = np.array([Fraction(0)])
    for value in reversed(coefficients):
        found = poly.polyadd(poly.polymul(found, [Fraction(sigma), Fraction(1)]), [value])
    return found


def functions(*sums: QuasiPolynomial) -> list[Function]:
    """Return quasi-polynomials as functions of the engine, all of one space.

    Polynomials that are multiples of each other are one polynomial of the space.
    """
    basis: dict[_Coefficients, int] = {}
    placed = []
    for item in sums:
        for theta, p in item.parts:
            monic = tuple(value / p[-1] for value in p)
            placed.append((item, theta, basis.setdefault(monic, len(basis)), p[-1]))
    space = Space([Polynomial.of(p) for p in basis], [theta for _, theta, *_ in placed])
    found = []
    for item in sums:
        steady = np.zeros(len(basis), object)
        delayed = np.zeros((len(basis), len(space.delays)), object)
        for owner, theta, j, weight in placed:
            if owner is item and theta:
                delayed[j, space.place(theta)] += weight
            elif owner is item:
                steady[j] += weight
        found.append(space.function(list(steady), list(delayed)))
    return found


_ONE = QuasiPolynomial(((Fraction(0), (Fraction(1),)),))


@dataclass(frozen=True)
class DelaySystem(WithDelays):
    r"""A system with one input, one output and any number of delays.

    .. math::

        L(s) = \frac{N(s)}{M(s)} , \qquad
        N, M = \sum_k p_k(s)\, e^{-s\theta_k} , \quad \theta_k \ge 0

    Write ``control.tf([1], [2, 1]) * delay(0.5)`` to make one. Systems are combined with
    ``+ - * /`` and `feedback`, and ``L(s)`` is the value at s. python-control's systems know no
    delays: to divide one by a `DelaySystem`, or to close it with one, write
    ``DelaySystem.of(plant)`` in its place.

    Parameters
    ----------
    numerator, denominator : QuasiPolynomial
        N and M.

    Raises
    ------
    ZeroDivisionError, ValueError
        If the denominator is zero, or all of it is delayed more than the numerator: such a
        system would answer before it is asked.

    Notes
    -----
    A power of s that N and M have in common is divided out, and a root at s = 0 that both have
    is no root of the loop. Other common factors stay, and their roots count.

    Examples
    --------
    A Smith predictor, in a loop whose true delay is 1.2 s in place of 1 s:

    >>> import control
    >>> from armlock import delay
    >>> plant, pi = control.tf([1], [2, 1]), control.tf([4, 2], [1, 0])
    >>> predictor = DelaySystem.of(pi).feedback(plant - plant * delay(1))
    >>> loop = predictor * plant * delay(1.2)
    >>> print(f"{abs(loop(1j)):.4f}")
    0.7052
    """

    numerator: QuasiPolynomial
    denominator: QuasiPolynomial

    # numpy leaves arithmetic with such an object to it.
    __array_ufunc__ = None
    _instead: ClassVar[str] = (
        "combine systems with + - * /; for plots write system.frequency_response(omega), for "
        "a closed loop DelaySystem.of(plant).feedback(back), for a quotient "
        "DelaySystem.of(plant) / system, "
        "for responses armlock.step_response(system, timepts), for margins "
        "armlock.margins(loop), for poles armlock.rightmost_root(loop)"
    )
    _taken_by: ClassVar[tuple[str, ...]] = (
        "__add__", "__sub__", "__mul__", "frequency_response", "_determine_omega_vector",
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Divide out a common delay and a common power of s, exactly."""
        for name, given in (("numerator", self.numerator), ("denominator", self.denominator)):
            if not isinstance(given, QuasiPolynomial):
                raise TypeError(
                    f"{name} must be a QuasiPolynomial, got {given!r:.200}: to delay a system "
                    "of python-control write plant * delay(theta)"
                )
        n, m = self.numerator.terms, self.denominator.terms
        if not m:
            raise ZeroDivisionError("denominator must not be zero")
        early = min(theta for theta, _ in n + m)
        power = min(next(k for k, c in enumerate(p) if c) for _, p in n + m)
        if m[0][0] > early:
            raise ValueError(
                "denominator must have a term that is delayed no more than the numerator, got "
                f"delays from {float(m[0][0])} s and from {float(early)} s"
            )
        for name, terms in (("numerator", n), ("denominator", m)):
            kept = tuple((theta - early, p[power:]) for theta, p in terms)
            object.__setattr__(self, name, QuasiPolynomial(kept))

    @classmethod
    def of(cls, system: Any) -> DelaySystem:
        """Return a system given as one, a number, a controller, or by python-control.

        Parameters
        ----------
        system : DelaySystem, real number, Controller, or python-control system
            A transfer function or state space must be continuous in time, with one input and
            one output. Use a `Controller` for many or repeated factors: python-control
            multiplies them out.

        Raises
        ------
        TypeError, ValueError
            If it is none of these, or not finite.
        """
        if isinstance(system, cls):
            return system
        zero = Fraction(0)
        if isinstance(system, Fraction | float | int | np.number | np.ndarray):
            value = system if isinstance(system, Fraction) else real_number("system", system)
            return cls(QuasiPolynomial.of([(zero, [Fraction(value)])]), _ONE)
        if isinstance(system, Controller):
            n = Polynomial.of_roots(system.zeros, system.gain)
            m = Polynomial.of_roots(system.poles)
            return cls(QuasiPolynomial(((zero, n.exact),)), QuasiPolynomial(((zero, m.exact),)))
        import control

        check_system("system", system, "a DelaySystem, a number, a Controller")
        if isinstance(system, control.StateSpace):
            # A controller is not zero, a system may be.
            zero_everywhere = not (system.B.any() or system.D.any())
            return cls.of(0.0 if zero_everywhere else Controller.of(system))
        above, below = (
            [Fraction(c) for c in real_array("system", p[0][0])[::-1].tolist()]
            for p in (system.num, system.den)
        )
        return cls(QuasiPolynomial.of([(zero, above)]), QuasiPolynomial.of([(zero, below)]))

    def __str__(self) -> str:
        """Return numerator and denominator as one writes them."""
        return f"[{self.numerator}] / [{self.denominator}]"

    def __add__(self, other: Any) -> DelaySystem:
        """Return the two in parallel; an equal denominator is kept."""
        other = DelaySystem.of(other)
        n, m = self.numerator, self.denominator
        if m == other.denominator:
            return DelaySystem(n + other.numerator, m)
        return DelaySystem(n * other.denominator + other.numerator * m, m * other.denominator)

    __radd__ = __add__

    def __neg__(self) -> DelaySystem:
        """Return the negative."""
        return DelaySystem(-self.numerator, self.denominator)

    def __sub__(self, other: Any) -> DelaySystem:
        """Return the difference."""
        return self + -DelaySystem.of(other)

    def __rsub__(self, other: Any) -> DelaySystem:
        """Return the difference."""
        return DelaySystem.of(other) - self

    def __mul__(self, other: Any) -> DelaySystem:
        """Return the two in series; common factors stay."""
        other = DelaySystem.of(other)
        return DelaySystem(
            self.numerator * other.numerator, self.denominator * other.denominator
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> DelaySystem:
        """Return the quotient; common factors stay."""
        other = DelaySystem.of(other)
        return DelaySystem(
            self.numerator * other.denominator, self.denominator * other.numerator
        )

    def __rtruediv__(self, other: Any) -> DelaySystem:
        """Return the quotient."""
        return DelaySystem.of(other) / self

    def feedback(self, other: Any = 1, sign: float = -1) -> DelaySystem:
        """Return the closed loop, with negative feedback by default.

        Parameters
        ----------
        other : system, optional
            In the feedback path, as `of` takes it.
        sign : float, optional
            Of the feedback.
        """
        other = DelaySystem.of(other)
        back = DelaySystem.of(-sign).numerator
        m = self.denominator * other.denominator + back * self.numerator * other.numerator
        return DelaySystem(self.numerator * other.denominator, m)

    def __call__(self, s: npt.ArrayLike) -> ComplexArray:
        """Evaluate at s in rad/s, of any shape."""
        s = complex_array("s", s)
        with np.errstate(divide="ignore", invalid="ignore"):
            value: ComplexArray = self.numerator(s) / self.denominator(s)
        return value

    @cached_property
    def functions(self) -> tuple[Function, Function]:
        """N and M as functions of the engine, of one space."""
        n, m = functions(self.numerator, self.denominator)
        return n, m

    @cached_property
    def common(self) -> int:
        """Order of the zero at s = 0 that N and M have in common."""
        return min(lead.order for f in self.functions if (lead := f.leading()))

    def isdtime(self, strict: bool = False) -> bool:
        """Whether time is discrete: it is not. So python-control's plots take the system."""
        return False

    def frequency_response(
        self, omega: npt.ArrayLike, squeeze: bool | None = None
    ) -> control.FrequencyResponseData:
        """Return the response as python-control's plots and functions take it.

        Parameters
        ----------
        omega : array_like of float
            In rad/s. Choose them dense enough for the delays: exp(-j omega theta) turns once in
            2 pi / theta.
        squeeze : bool, optional
            As in python-control.

        Returns
        -------
        control.FrequencyResponseData
        """
        import control

        omega = np.atleast_1d(real_array("omega", omega))
        return control.FrequencyResponseData(
            self(1j * omega), omega, squeeze=squeeze, return_magphase=True,
            sysname="system with delays", plot_type="bode",
        )  # fmt: skip


def delay(theta: float | Fraction) -> DelaySystem:
    r"""Return a pure delay, :math:`e^{-s\theta}`.

    Parameters
    ----------
    theta : float or Fraction
        In s, not negative.

    Raises
    ------
    TypeError, ValueError
        If it is not finite and real, or negative.

    Examples
    --------
    >>> import control
    >>> from armlock import delay
    >>> loop = control.tf([1], [1, 1]) * delay(0.5)
    >>> print(f"{loop(2j):.4f}")
    -0.2285-0.3844j
    """
    exact = theta if isinstance(theta, Fraction) else Fraction(real_number("theta", theta))
    if exact < 0:
        raise ValueError(f"theta must not be negative, got {theta}")
    return DelaySystem(QuasiPolynomial(((exact, (Fraction(1),)),)), _ONE)
