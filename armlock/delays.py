"""Systems with any number of delays, for loops of your own, as python-control writes them.

    L(s) = N(s) / M(s) ,   N, M = sums of real polynomials of s, each times exp(-s theta)

All coefficients and delays are kept exactly, as fractions. `DelaySystem.functions` hands both
sums to the engine, which counts zeros and certifies margins. A `Loop` is combined in the same
way; `DelaySystem.of` gives its open loop.
"""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.checks import ComplexArray, complex_array, real_array, real_number
from armlock.controllers import Controller, check_system, rational, with_others
from armlock.engine.functions import Function, Space, limit_at_zero
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
                f"{_printable(c):+.6g}" + ("", " s", f" s^{k}")[min(k, 2)]
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

    def __iter__(self) -> Iterator[Term]:
        """Return the terms as `functions` takes them, of monic polynomials."""
        for theta, p in self.parts:
            yield p[-1], _polynomial(tuple(value / p[-1] for value in p)), theta

    def at(self, s: ComplexArray, unit: Fraction, size: Fraction) -> ComplexArray:
        """Evaluate at s, over a size, by coefficients of powers of s / unit."""
        first = next((float(theta) for theta, _ in self.terms if theta), 0.0)
        # Far on the right exponentials vanish beside one.
        far = s.real * first > 1.0
        found = np.zeros_like(s)
        for here, terms, turn in ((~far, self.parts, np.expm1), (far, self.terms, np.exp)):
            at = s[here]
            for theta, coefficients in terms:
                scaled = [float(c * unit**k / size) for k, c in enumerate(coefficients)]
                value = poly.polyval(at / float(unit), scaled)
                found[here] += value * turn(-at * float(theta)) if theta else value
        return found

    def shifted(self, sigma: float) -> QuasiPolynomial:
        """Return the function of s + sigma; its exponentials are rounded."""
        return QuasiPolynomial.of(
            (theta, Fraction(float(np.exp(-sigma * float(theta)))) * moved(p, sigma))
            for theta, p in self.terms
        )


def _printable(value: Fraction) -> float | Decimal:
    """Return a number that prints as the fraction does, which may be no float."""
    if 1e-300 < abs(value) < 1e300:
        return float(value)
    return Decimal(value.numerator) / value.denominator


def moved(coefficients: _Coefficients, sigma: float) -> Any:
    """Return the coefficients of p(s + sigma), exactly."""
    found = np.array([Fraction(0)])
    for value in reversed(coefficients):
        found = poly.polyadd(poly.polymul(found, [Fraction(sigma), Fraction(1)]), [value])
    return found


#: A weight, a polynomial of s, and a delay in s.
Term = tuple[Fraction, Polynomial, Fraction]


def functions(*sums: Iterable[Term], step: float = 0.0) -> list[Function]:
    """Return sums of terms as functions of the engine, all of one space.

    A term without a delay is weight p(s), and one with a delay theta is
    weight p(s) (exp(-s theta) - 1).
    """
    given = [[term for term in terms if term[1]] for terms in sums]
    basis = list(dict.fromkeys(p for terms in given for _, p, _ in terms))
    space = Space(basis, [theta for terms in given for *_, theta in terms], step)
    found = []
    for terms in given:
        steady = np.zeros(len(basis), object)
        delayed = np.zeros((len(basis), len(space.delays)), object)
        for weight, p, theta in terms:
            if theta:
                delayed[basis.index(p), space.delays.index(theta)] += weight
            else:
                steady[basis.index(p)] += weight
        found.append(Function(space, steady, delayed))
    return found


@lru_cache
def _polynomial(coefficients: _Coefficients) -> Polynomial:
    """Return a polynomial, with roots that are computed once."""
    return Polynomial.of(coefficients)


_ONE = QuasiPolynomial(((Fraction(0), (Fraction(1),)),))


class WithDelays(ABC):
    """What all systems with delays have: arithmetic, feedback and a frequency response.

    Functions of python-control refuse them with advice, because its systems have no delays.
    Each of these functions asks for an attribute, or asks `isinstance`, which asks for
    `__class__`. Its plots need only the response.

    Examples
    --------
    >>> import control
    >>> from armlock import SingleArm
    >>> filtered = SingleArm() * control.tf([1], [0.1, 1])
    >>> print(filtered.feedback())
    [(1) + (-1) exp(-20.1 s)] / [(0.1 s^2 +1 s +1) + (-1) exp(-20.1 s)]
    """

    _instead: ClassVar[str]
    # Functions and operators of python-control that take such a system all the same.
    _taken_by = (
        "__add__", "__sub__", "__mul__", "frequency_response", "_determine_omega_vector",
    )  # fmt: skip
    # numpy leaves arithmetic with such an object to it.
    __array_ufunc__ = None

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Say what to write in place of an attribute that is missing."""
            raise AttributeError(
                f"{type(self).__name__!r} object has no attribute {name!r}: {self._instead}",
                name=name,
                obj=self,
            )

        @property
        def __class__(self) -> type:
            """Return the class, or say what to write in place of a call of python-control."""
            caller = sys._getframe(1)
            module = caller.f_globals.get("__name__", "")
            if module.startswith("control.") and caller.f_code.co_name not in self._taken_by:
                raise TypeError(f"python-control's systems have no delays: {self._instead}")
            return type(self)

    def __add__(self, other: Any) -> DelaySystem:
        """Return the two in parallel; denominators that are equal up to a factor are one."""
        return _combined(_parallel, self, other)

    __radd__ = __add__

    def __neg__(self) -> DelaySystem:
        """Return the negative."""
        return _combined(lambda n, m: (-n, m), self)

    def __sub__(self, other: Any) -> DelaySystem:
        """Return the difference."""
        return self + -DelaySystem.of(other)

    def __rsub__(self, other: Any) -> DelaySystem:
        """Return the difference."""
        return DelaySystem.of(other) - self

    def __mul__(self, other: Any) -> DelaySystem:
        """Return the two in series; common factors stay."""
        return _combined(lambda n, m, p, q: (n * p, m * q), self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> DelaySystem:
        """Return the quotient; common factors stay."""
        return _combined(lambda n, m, p, q: (n * q, m * p), self, other)

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
            Factor of the feedback path, -1 by default.
        """
        back = DelaySystem.of(-sign).numerator
        return _combined(lambda n, m, p, q: (n * q, m * q + back * n * p), self, other)

    @abstractmethod
    def __call__(self, s: npt.ArrayLike) -> ComplexArray:
        """Evaluate at s in rad/s."""

    @abstractmethod
    def open_loop(self) -> DelaySystem:
        """Return the system as numerator and denominator."""

    def update_names(self, **names: Any) -> None:
        """Keep no names of signals, so that ``control.series`` takes the system."""
        return

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


def _combined(combine: Callable[..., Any], *systems: Any) -> DelaySystem:
    """Return what becomes of systems, from all their numerators and denominators in turn."""

    def make(*some: DelaySystem) -> DelaySystem:
        parts = ((system.numerator, system.denominator) for system in some)
        return DelaySystem(*combine(*chain.from_iterable(parts)))

    return with_others(make, *map(DelaySystem.of, systems))


def _parallel(
    n: QuasiPolynomial, m: QuasiPolynomial, p: QuasiPolynomial, q: QuasiPolynomial
) -> tuple[QuasiPolynomial, QuasiPolynomial]:
    """Return numerator and denominator of a sum."""
    ratio = m.terms[-1][1][-1] / q.terms[-1][1][-1]
    factor = QuasiPolynomial.of([(Fraction(0), [ratio])])
    return (n + p * factor, m) if m == q * factor else (n * q + p * m, m * q)


@dataclass(frozen=True)
class DelaySystem(WithDelays):
    r"""A system with one input, one output and any number of delays.

    .. math::

        L(s) = \frac{N(s)}{M(s)} , \qquad
        N, M = \sum_k p_k(s)\, e^{-s\theta_k} , \quad \theta_k \ge 0

    Write ``control.tf([1], [2, 1]) * delay(0.5)`` to make one. Systems are combined with
    ``+ - * /`` and `feedback`, and ``L(s)`` is the value at s. The systems of python-control
    have no delays. To divide such a system by a `DelaySystem`, or to close it with a
    `DelaySystem`, write ``DelaySystem.of(plant)`` instead of ``plant``.

    Parameters
    ----------
    numerator, denominator : QuasiPolynomial
        N and M.

    Raises
    ------
    ZeroDivisionError, ValueError
        If the denominator is zero, or all of it is delayed more than the numerator: such a
        system is not causal.

    Notes
    -----
    A common power of s is cancelled in N and M, so a root at s = 0 that both have is not a root
    of the loop. Other common factors are not cancelled, and their roots count.

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
    #: The same system for other values of poles that may be meant to be zero; usually none.
    others: tuple[DelaySystem, ...] = field(default=(), compare=False, repr=False)

    _instead = (
        "combine systems with + - * /; for plots write "
        "control.bode_plot(system.frequency_response(omega)) or "
        "armlock.nyquist(system, omega_max=omega_max).plot(), for a closed loop "
        "DelaySystem.of(plant).feedback(back), for a quotient DelaySystem.of(plant) / system, "
        "for responses armlock.step_response(system, timepts), for the DC gain system(0), for "
        "margins armlock.margins(loop), for poles armlock.rightmost_root(loop)"
    )

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
        system : DelaySystem, Loop, real number, Controller, or python-control system
            Of a `Loop` it is the open loop at c1 = c2 = 1. A transfer function or state space
            must be continuous in time, with one input and one output. Use a `Controller` for
            many or repeated factors: python-control multiplies them out.

        Raises
        ------
        TypeError, ValueError
            If it is none of these, or not finite.
        """
        if isinstance(system, WithDelays):
            return system.open_loop()
        zero = Fraction(0)
        if isinstance(system, Fraction | float | int | np.number | np.ndarray):
            value = system if isinstance(system, Fraction) else real_number("system", system)
            return cls(QuasiPolynomial.of([(zero, [Fraction(value)])]), _ONE)
        if not isinstance(system, Controller):
            check_system("system", system, "a DelaySystem, a number, a Controller")
        return with_others(
            lambda k: cls(
                QuasiPolynomial.of([(zero, k.numerator.exact)]),
                QuasiPolynomial.of([(zero, k.denominator.exact)]),
            ),
            rational(system),
        )

    def open_loop(self) -> DelaySystem:
        """Return the system itself."""
        return self

    def __str__(self) -> str:
        """Return numerator and denominator as one writes them."""
        return f"[{self.numerator}] / [{self.denominator}]"

    def __call__(self, s: npt.ArrayLike) -> ComplexArray:
        """Evaluate at s in rad/s, of any shape; at s = 0 the limit."""
        s = complex_array("s", s)
        # In a unit as large as the roots of M: powers of many fast poles would overflow.
        _, p = max(self.denominator.terms, key=lambda term: len(term[1]))
        ratio = abs(next(c for c in p if c) / p[-1])
        bits = ratio.numerator.bit_length() - ratio.denominator.bit_length()
        unit = Fraction(2) ** (bits // max(len(p) - 1, 1))
        size = abs(p[-1]) * unit ** (len(p) - 1)
        with np.errstate(all="ignore"):
            n, m = (f.at(s, unit, size) for f in (self.numerator, self.denominator))
            value: ComplexArray = n / m
        undefined = (s == 0.0) & ~np.isfinite(value)
        if undefined.any() and np.isfinite(limit := limit_at_zero(*self.functions)):
            value = np.where(undefined, limit, value)
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
