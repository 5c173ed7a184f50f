"""Systems with delays and named parameters, exact: one description of every loop.

    L(s) = N(s) / M(s) ,   N, M = sums of  polynomial(s) * exp(-s theta) * parameters

Numbers, controllers, systems of python-control, `delay(theta)` and `parameter("kp")` are
combined with ``+ - * / **`` and `feedback`. All coefficients and delays are fractions. An
expression is the open loop L: the roots that are counted are those of 1 + L = 0. `equation`
makes D = 0 instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import chain
from math import factorial
from typing import TYPE_CHECKING, Any, ClassVar, Self
from uuid import uuid4
from weakref import WeakValueDictionary

import numpy as np
import numpy.typing as npt
from flint import fmpq, fmpq_poly

from armlock.checks import (
    ComplexArray,
    FloatArray,
    broadcast_shape,
    complex_array,
    not_negative,
    real_array,
    real_number,
    whole_number,
    whole_steps,
)
from armlock.engine import statespace
from armlock.engine.affine import Affine, NotAffineError, present
from armlock.engine.functions import Function
from armlock.engine.polynomials import (
    Polynomial,
    collected,
    exact,
    of_roots,
    order,
    polynomial,
    series,
)
from armlock.engine.statespace import ROUNDED, Lowest, settled
from armlock.typeset import fraction, written

if TYPE_CHECKING:
    import control

_ONE, _S = fmpq_poly([1]), fmpq_poly([0, 1])
# Arguments of the functions that take values of parameters by name.
_TAKEN = frozenset(
    ("self", "system", "loop", "s", "squeeze", "omega", "omega_max", "points_per_turn",
     "free_above", "right_of", "step", "order", "z", "longest")
)  # fmt: skip
# Coefficients at s = 0 that are looked at for a limit there.
_TERMS = 16
# What to write where python-control, or its user, asks a system for something.
_INSTEAD = {
    "plot_phase": "control.bode_plot(L.frequency_response(omega))",
    "dt": "armlock.nyquist(L, omega_max=...).plot()",
    "response": "armlock.nyquist(L, omega_max=...).plot()",
    "dcgain": "L(0)",
}
# Longest text of a system.
_LONGEST_TEXT = 400
# A longer text of a system without delays and parameters is that of its factors.
_LONGEST_RATIONAL = 60


class Delay:
    """A delay object: theta in s, and the mark by which it differs from all others.

    Two objects are two delays even if they are equally long: a small change of one of them
    alone is a small change of the loop. The mark is the same in other processes, and there is
    one object of each in a process: it is compared by identity, which is fast.
    """

    __slots__ = "__weakref__", "mark", "theta"
    _known: ClassVar[WeakValueDictionary[tuple[str, str], Delay]] = WeakValueDictionary()

    theta: fmpq
    mark: str

    def __new__(cls, theta: fmpq, mark: str) -> Delay:
        """Return the object of this length and mark."""
        found = cls._known.get((str(theta), mark))
        if found is None:
            found = cls._known[str(theta), mark] = super().__new__(cls)
            found.theta, found.mark = theta, mark
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle length and mark."""
        return Delay, (self.theta, self.mark)

    @classmethod
    def new(cls, theta: fmpq) -> Delay:
        """Return an object that is none other."""
        return cls(theta, uuid4().hex)


class Lag(tuple[tuple[Delay, int], ...]):
    """A product of delay objects: pairs of an object and its power, sorted."""

    @classmethod
    def of(cls, powers: Mapping[Delay, int]) -> Self:
        """Return the product of objects to these powers."""
        pairs = [(delay, n) for delay, n in powers.items() if n]
        if len(pairs) > 1:
            pairs.sort(key=lambda pair: (pair[0].theta, pair[0].mark))
        return cls(pairs)

    @classmethod
    def after(cls, theta: fmpq) -> Self:
        """Return the one object that all products of this length may share."""
        return cls([(Delay(theta, ""), 1)] if theta else [])

    def times(self, other: Lag) -> Lag:
        """Return the product of two."""
        if not (self and other):
            return self or other
        return Lag.of(collected((*self, *other)))

    @cached_property
    def time(self) -> fmpq:
        """The delay of the product, in s."""
        return sum((delay.theta * n for delay, n in self), fmpq(0))

    @property
    def merged(self) -> Self:
        """One object in place of this product, the same for all products of its length."""
        return self.after(self.time)


#: The product of no delays.
NOW = Lag()


#: A product of delays, and the names of the parameters that are multiplied.
Key = tuple[Lag, tuple[str, ...]]
#: What stands before each product of delays and parameters.
Terms = dict[Key, fmpq_poly]


class Sum:
    """A sum of polynomials of s times delays and parameters: {(lag, names): polynomial}.

    Where terms were put together, it keeps the sizes that they had before: the magnitudes of
    coefficients, by products of parameters, without delays. Of a coefficient that is much
    smaller rounding may be all that is left.
    """

    def __init__(self, terms: Mapping[Key, fmpq_poly], sizes: Terms | None = None) -> None:
        self.terms = {key: p for key, p in terms.items() if p}
        self._sizes = sizes

    @classmethod
    def of(cls, p: fmpq_poly, lag: Lag = NOW, *names: str) -> Sum:
        """Return a sum of one term."""
        return cls({(lag, tuple(sorted(names))): p})

    def __add__(self, other: Sum) -> Sum:
        """Return the sum."""
        found = collected((*self.terms.items(), *other.terms.items()))
        if len(found) == len(self.terms) + len(other.terms) and self._plain(other):
            return Sum(found)
        return Sum(found, collected((*self.sizes.items(), *other.sizes.items())))

    def __mul__(self, other: Sum) -> Sum:
        """Return the product."""
        found = _times(self.terms, other.terms)
        if len(found) == len(self.terms) * len(other.terms) and self._plain(other):
            return Sum(found)
        return Sum(found, _times(self.sizes, other.sizes))

    def _plain(self, other: Sum) -> bool:
        """Tell whether no terms of two sums were put together."""
        return self._sizes is None and other._sizes is None

    @property
    def sizes(self) -> Terms:
        """The sizes that its terms had before they were put together."""
        if self._sizes is None:
            self._sizes = collected(
                ((NOW, names), fmpq_poly([abs(c) for c in p.coeffs()]))
                for (_, names), p in self.terms.items()
            )
        return self._sizes

    def __neg__(self) -> Sum:
        """Return the negative."""
        return Sum({key: -p for key, p in self.terms.items()}, self._sizes)

    def __bool__(self) -> bool:
        """Whether it is not zero."""
        return bool(self.terms)

    def __eq__(self, other: object) -> bool:
        """Whether all terms are equal."""
        return isinstance(other, Sum) and self.terms == other.terms

    def __hash__(self) -> int:
        """Hash the terms."""
        return hash(frozenset((key, tuple(p.coeffs())) for key, p in self.terms.items()))

    def put(self, values: Mapping[str, Sum]) -> Sum:
        """Put sums in place of parameters."""
        if not values:
            return self
        terms = _put(self.terms, {name: value.terms for name, value in values.items()})
        return Sum(
            terms, _put(self.sizes, {name: value.sizes for name, value in values.items()})
        )

    def before(self, *names: str) -> dict[Lag, fmpq_poly]:
        """Return what stands before a product of parameters, by delays."""
        return {lag: p for (lag, given), p in self.terms.items() if given == names}

    def over(self, power: int, early: Lag = NOW) -> Sum:
        """Divide by a power of s that all terms hold, and multiply by a product of delays.

        Powers of the product are negative, so that all terms become earlier.
        """
        divisor = _S**power
        sizes = self._sizes and {key: p // divisor for key, p in self._sizes.items()}
        terms = {(lag.times(early), a): p // divisor for (lag, a), p in self.terms.items()}
        return Sum(terms, sizes)

    def lowest(self, number: int) -> list[Lowest]:
        """Return the lowest coefficients at s = 0, and what rounding may make of them.

        One for each product of parameters, beginning with what stands before none.
        """
        longest = max((lag.time for lag in self.lags), default=fmpq(0))
        growth = [ROUNDED * longest**k / factorial(k) for k in range(number)]
        found = []
        for (_, names), size in sorted(self.sizes.items()):
            bounds = [
                sum((size[i] * growth[k - i] for i in range(k + 1)), fmpq(0))
                for k in range(number)
            ]
            found.append(Lowest(self.series(number, names), bounds))
        return found

    def without(self, stated: int) -> Sum:
        """Return the sum with zeros for the lowest coefficients at s = 0."""
        if not stated:
            return self
        return self + -Sum({key: fmpq_poly(self.series(stated, key[1])) for key in self.sizes})

    def whole(self) -> fmpq_poly:
        """Return the sum of all polynomials: what is left at s = 0."""
        return sum(self.terms.values(), fmpq_poly([0]))

    @property
    def degree(self) -> int:
        """Highest power of s."""
        return max((p.degree() for p in self.terms.values()), default=0)

    @property
    def lags(self) -> set[Lag]:
        """All products of delays."""
        return {lag for lag, _ in self.terms}

    def series(self, number: int, names: tuple[str, ...] = ()) -> list[fmpq]:
        """Return the first coefficients at s = 0 of what stands before parameters, exactly."""
        return series(((lag.time, p) for lag, p in self.before(*names).items()), number)

    def order(self) -> int:
        """Return the order of the zero at s = 0 that it has for all values of parameters."""
        kinds = {names for _, names in self.terms}
        return min((order(self.series(_TERMS, names)) for names in kinds), default=_TERMS)

    def by_length(self, *names: str) -> dict[fmpq, fmpq_poly]:
        """Return what stands before a product of parameters, by lengths in ascending order."""
        found = collected((lag.time, p) for lag, p in self.before(*names).items())
        return {time: p for time, p in sorted(found.items()) if p}


def _times(first: Terms, second: Terms) -> Terms:
    """Multiply the terms of two sums."""
    return collected(
        ((t.times(u), tuple(sorted(a + b))), p * q)
        for (t, a), p in first.items()
        for (u, b), q in second.items()
    )


def _put(terms: Terms, values: Mapping[str, Terms]) -> Terms:
    """Put terms in place of parameters."""
    found: Terms = {}
    for (lag, names), p in terms.items():
        term = {(lag, tuple(a for a in names if a not in values)): p}
        for name in names:
            term = _times(term, values[name]) if name in values else term
        found = collected((*found.items(), *term.items()))
    return found


_UNITY = Sum.of(_ONE)


class System:
    r"""A system with one input and one output, any number of delays, and named parameters.

    .. math::

        L(s) = \frac{N(s)}{M(s)} , \qquad
        N, M = \sum_k p_k(s)\, e^{-s\theta_k} \prod_i x_{ki}

    Write ``control.tf([1], [2, 1]) * delay(0.5)`` to make one. Systems are combined with
    ``+ - * / **`` and `feedback`. A system is the open loop: unstable roots, margins and charts
    are those of 1 + L = 0. ``closed.feedback()`` of a closed loop would close it again. The
    equation D = 0 is made by `equation`.

    Where python-control's own operator comes first and does not know delays, as in
    ``plant / system`` or ``plant.feedback(system)``, write ``System.of(plant)`` for ``plant``.

    Attributes
    ----------
    numerator, denominator : Sum
        N and M. An equation has no denominator.
    nominal : dict of str to float or None
        The parameters in the order of their first use, with their nominal values.
    step : float
        Zero, or the step in s of a map (`equation`).
    at_zero : int or None
        How many roots at s = 0 are stated and left out (`equation`). None for open loops, of
        which the roots at s = 0 that N and M have in common are left out.

    Notes
    -----
    A common power of s is cancelled in N and M, so a root at s = 0 that both have is not a root
    of the loop. No other common factor is cancelled: a hidden unstable mode counts. Where two
    systems are added, equal denominators (up to a number) are those of one system, and are kept
    once; different ones are multiplied.

    Examples
    --------
    A Smith predictor, in a loop whose true delay is 1.2 s in place of 1 s:

    >>> import control
    >>> from armlock import System, delay
    >>> plant, pi = control.tf([1], [2, 1]), control.tf([4, 2], [1, 0])
    >>> predictor = System.of(pi).feedback(plant - plant * delay(1))
    >>> loop = predictor * plant * delay(1.2)
    >>> print(f"{abs(loop(1j)):.4f}")
    0.7052
    """

    # numpy leaves arithmetic with such an object to it.
    __array_ufunc__ = None

    numerator: Sum
    denominator: Sum
    nominal: dict[str, float | None]
    step: float
    at_zero: int | None
    #: What stands for the system as text, if it was made of factors.
    shown = ""

    def __init__(
        self,
        numerator: Sum,
        denominator: Sum,
        nominal: Mapping[str, float | None] | None = None,
        step: float = 0.0,
        at_zero: int | None = None,
    ) -> None:
        if at_zero is None and not denominator:
            at_zero = 0
        self.numerator, self.denominator = _reduced(numerator, denominator, at_zero is None)
        self.nominal, self.step, self.at_zero = dict(nominal or {}), step, at_zero

    @classmethod
    def of(
        cls,
        system: Any,
        name: str = "system",
        *,
        integrators: int | None = None,
        zeros: int | None = None,
    ) -> System:
        """Return a system given as one, by its factors, by python-control, or as a number.

        Parameters
        ----------
        system : System, python-control system, (zeros, poles, gain), or real number
            A transfer function or state space must be continuous in time, with one input and
            one output.
        name : str, optional
            What an error calls it.
        integrators : int, optional
            How many poles of a python-control system are zero. It is needed where rounding may
            have moved such poles.
        zeros : int, optional
            The same for its zeros, for instance 1 for a high-pass filter, or for an integrator
            that the input does not reach.

        Raises
        ------
        TypeError, ValueError
            If it is none of these, is not finite, is in discrete time, has several inputs or
            outputs, if rounding hides whether a pole or zero is at s = 0, or if the
            coefficients contradict `integrators` or `zeros` by more than rounding.

        Notes
        -----
        Coefficients and matrices are taken as the binary numbers that they are, exactly.

        Rounding leaves some 1e-17 in place of a coefficient that is meant to be zero, for
        instance of a state space in other coordinates, or of polynomials that were multiplied
        out. A system whose lowest coefficient is as small is refused until `integrators` and
        `zeros` say what is meant. What is stated is set to zero: a true pole at 1e-9 rad/s is
        then lost. The next coefficient is asked in the same way. With ``integrators=0`` the
        coefficients are taken as they are.

        A transfer function made of a state space in badly scaled coordinates (of a condition of
        a hundred or more) may hold more rounding than that, and poles that are all at s = 0
        have nothing to be compared with: give the state space itself, or the factors.

        python-control multiplies all factors out, those of `control.zpk` too. It turns
        ``control.zpk([], [-1e-3] * 5, 1)`` into five complex poles around -1e-3. Write
        ``Controller([], [-1e-3] * 5, 1)`` instead.

        Examples
        --------
        >>> import control
        >>> from armlock import System
        >>> System.of(control.tf([2.0, 1.0], [1.0, 0.5, 0.0])).poles()
        array([-0.5+0.j,  0. +0.j])
        """
        is_number = isinstance(system, fmpq | Fraction | float | int | np.number | np.ndarray)
        is_triple = isinstance(system, tuple) and len(system) == 3
        is_exact = isinstance(system, System) or is_number or is_triple
        if is_exact and (integrators, zeros) != (None, None):
            raise TypeError(
                "integrators and zeros are for a state space or transfer function of "
                f"python-control, got {system!r:.200}"
            )
        if isinstance(system, System):
            return system
        if is_triple:
            return Controller(*system)
        if is_number:
            return System(Sum.of(fmpq_poly([exact_number(name, system)])), _UNITY)
        above, below = _by_control(name, system, integrators, zeros)
        return System(Sum.of(above), Sum.of(below))

    @property
    def is_equation(self) -> bool:
        """Whether it is an equation D = 0, and no open loop."""
        return not self.denominator

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of their first use."""
        return tuple(self.nominal)

    def cancelled(self) -> int:
        """Return the order of the zero at s = 0 of N and M, for all values of parameters."""
        n, m = self.numerator, self.denominator
        return min(n.order(), m.order()) if m and not m.whole()[0] else 0

    @property
    def longest_delay(self) -> float:
        """The longest time in s by which a term is delayed."""
        lags = self.numerator.lags | self.denominator.lags
        return float(max((lag.time for lag in lags), default=fmpq(0)))

    def __add__(self, other: Any) -> System:
        """Return the two in parallel; denominators that are equal up to a number are one."""
        return _combined(_parallel, self, other)

    __radd__ = __add__

    def __neg__(self) -> System:
        """Return the negative."""
        return _combined(lambda n, m: (-n, m), self)

    def __sub__(self, other: Any) -> System:
        """Return the difference."""
        return self + -System.of(other)

    def __rsub__(self, other: Any) -> System:
        """Return the difference."""
        return System.of(other) - self

    def __mul__(self, other: Any) -> System:
        """Return the two in series; common factors stay."""
        return _combined(lambda n, m, p, q: (n * p, m * q), self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> System:
        """Return the quotient; common factors stay."""
        return _combined(lambda n, m, p, q: (n * q, m * p), self, other)

    def __rtruediv__(self, other: Any) -> System:
        """Return the quotient."""
        return System.of(other) / self

    def __pow__(self, power: int) -> System:
        """Return a whole power; a delay's power is as long as so many of this one delay."""
        if isinstance(power, bool) or not isinstance(power, int | np.integer):
            raise TypeError(f"power must be a whole number, got {power!r}")
        found, base = System.of(1), self if power >= 0 else 1 / self
        left = abs(int(power))
        while left:
            found = found * base if left % 2 else found
            left //= 2
            base = base * base if left else base
        return found

    def feedback(self, other: Any = 1, sign: float = -1) -> System:
        """Return the closed loop, with negative feedback by default.

        Parameters
        ----------
        other : system, optional
            In the feedback path, as `of` takes it.
        sign : float, optional
            Factor of the feedback path, -1 by default.
        """
        back = Sum.of(polynomial([-real_number("sign", sign)]))
        return _combined(lambda n, m, p, q: (n * q, m * q + back * n * p), self, other)

    def at(self, **values: Any) -> System:
        """Return the system with numbers, or systems without a denominator, for parameters.

        Parameters
        ----------
        **values
            By name of the parameter.
        """
        self.check_names("a keyword", values)
        put, names = {}, {k: v for k, v in self.nominal.items() if k not in values}
        for name, value in values.items():
            given = System.of(value, name)
            if given.denominator.terms != _UNITY.terms:
                raise ValueError(f"{name} must have no denominator, got {given!r}")
            put[name], names = given.numerator, names | given.nominal
        above, below = (part.put(put) for part in (self.numerator, self.denominator))
        return System(above, below, names, self.step, self.at_zero)

    def opened(self, name: str) -> System:
        """Return the open loop that a parameter closes, with all else as it is.

        D = 0, of a loop 1 + L = 0, is affine in the parameter x: D = D_0 + x D_1. The open loop
        is x D_1 / D_0, whose margins are those of the factor x.

        Parameters
        ----------
        name : str
            Of the parameter.
        """
        self.check_names("name", [name])
        parts = Sum({}), Sum({}), Sum({})
        for (lag, names), p in (self.numerator + self.denominator).terms.items():
            parts[min(names.count(name), 2)].terms[lag, names] = p
        if parts[2] or not parts[0]:
            raise ValueError(
                f"name must be a parameter in which D is affine, and not zero without it, "
                f"got {name!r}"
            )
        found = System(parts[1], parts[0], self.nominal, at_zero=self.at_zero)
        if self.at_zero is not None and found.cancelled() > self.at_zero:
            raise ValueError(
                f"at_zero must be stated for an equation that has {found.cancelled()} roots at "
                f"s = 0 for all values of {name}, got at_zero={self.at_zero}"
            )
        return found

    def given(self, values: Iterable[Any], numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Return a value of each parameter, by place, by name, or nominal; raise otherwise."""
        found, values = dict(self.nominal), tuple(values)
        if len(values) > len(found):
            raise TypeError(
                f"{len(values)} values are given for the parameters {self.parameters}; what is "
                f"no parameter is given by name"
            )
        self.check_names("a keyword", numbers)
        for name, value in [*zip(found, values, strict=False), *numbers.items()]:
            if value is None:
                raise TypeError(
                    f"{name} must be a number, got None: leave it out if it is nominal"
                )
            found[name] = value
        for name, value in found.items():
            if value is None:
                raise TypeError(
                    f"{name} must be given, or have a nominal value, as "
                    f"parameter({name!r}, 1.0) has"
                )
        return found

    def check_names(self, argument: str, names: Iterable[Any]) -> None:
        """Raise unless an argument names parameters of the system."""
        for name in names:
            if name not in self.parameters:
                raise TypeError(
                    f"{argument} must be one of the parameters of the system "
                    f"({', '.join(self.parameters) or 'it has none'}), got {name!r:.80}"
                )

    def __call__(
        self, s: npt.ArrayLike, *values: Any, squeeze: Any = None, **numbers: Any
    ) -> ComplexArray:
        """Evaluate at s in rad/s, of any shape; of an equation D.

        At s = 0 it is the limit.

        Parameters
        ----------
        s : array_like of complex
            Laplace variable.
        *values, **numbers : array_like of float, optional
            The parameters; nominal ones by default. All broadcast.
        squeeze : optional
            Without effect; ``control.evalfr`` passes it.
        """
        given, s = self.given(values, numbers), complex_array("s", s)
        arrays = {
            k: np.array(float(v)) if isinstance(v, fmpq | Fraction) else real_array(k, v)
            for k, v in given.items()
        }
        shape = broadcast_shape(("s", *arrays), (s, *arrays.values()))
        point = [np.broadcast_to(v, shape) if v.ndim else float(v) for v in arrays.values()]
        return self.values(np.broadcast_to(s, shape), point)[0]

    def values(
        self, s: ComplexArray, point: Sequence[float | FloatArray]
    ) -> tuple[ComplexArray, FloatArray]:
        """Evaluate at s, and bound rounding errors, see `armlock.engine.values`.

        Parameters
        ----------
        s : complex array, any shape
            In rad/s.
        point : sequence of float, or of float arrays, shaped like `s`
            The parameters.
        """
        flat = s.ravel()
        xs = [x.ravel() if isinstance(x, np.ndarray) else x for x in point]
        try:
            found, errors = self.affine.values(flat, xs)
        except NotAffineError:
            # Numbers are put in first, for all s of one point at once.
            found, errors = np.empty(flat.shape, np.complex128), np.empty(flat.shape)
            rows = np.column_stack([np.broadcast_to(x, flat.shape) for x in xs])
            points, which = np.unique(rows, axis=0, return_inverse=True)
            for k, row in enumerate(points.tolist()):
                here = which.ravel() == k
                affine = self.affine_in((), **dict(zip(self.parameters, row, strict=True)))
                found[here], errors[here] = affine.values(flat[here], ())
        return found.reshape(s.shape), errors.reshape(s.shape)

    @cached_property
    def affine(self) -> Affine:
        """N and M as functions of the engine, affine in all parameters.

        Raises
        ------
        NotAffineError
            If they are not affine in all of them together.
        """
        return self.affine_in(self.parameters)

    def affine_in(self, free: Sequence[str], /, **numbers: Any) -> Affine:
        """Return N and M as functions of the engine, affine in the parameters that vary.

        Parameters
        ----------
        free : sequence of str
            The parameters that vary.
        **numbers : real numbers, optional
            Values of the others, which are nominal by default.

        Raises
        ------
        NotAffineError
            If two parameters that vary are multiplied, or one by itself.
        TypeError, ValueError
            If another parameter has no value, or one that is not finite and real.
        """
        origin = tuple(self.nominal.get(name) or 0.0 for name in free)
        given = self.given((), {**dict.fromkeys(free, 0.0), **numbers})
        put = {k: Sum.of(polynomial([v])) for k, v in given.items() if k not in free}
        sums = self.numerator.put(put), self.denominator.put(put)
        for _, names in [key for part in sums for key in part.terms]:
            if len(names) > 1:
                raise NotAffineError(
                    f"the system must be affine in {' and '.join(dict.fromkeys(names))} "
                    f"together, but holds {' * '.join(names)}: give a number for one of them, "
                    "or make the product a parameter"
                )
        n, m = ([part.before(), *map(part.before, free)] for part in sums)
        return Affine(n, m, tuple(free), origin, self.step, self.at_zero)

    def functions(
        self, values: Iterable[Any] = (), numbers: Mapping[str, Any] | None = None
    ) -> tuple[Function, Function]:
        """Return N and M at given values of the parameters, exactly.

        Raises
        ------
        TypeError, ValueError
            If a parameter has no value, or one that is not finite and real.
        """
        given = self.given(values, numbers or {})
        point = {k: exact_number(k, v) for k, v in given.items()}
        try:
            return present(*self.affine.quotient(*point.values()))
        except NotAffineError:
            return self.affine_in((), **point).quotient()

    def open_functions(
        self, values: Iterable[Any], numbers: Mapping[str, Any], name: str = "loop"
    ) -> tuple[Function, Function, FloatArray]:
        """Return N and M of an open loop L = N / M, and the values of its parameters.

        Parameters
        ----------
        values, numbers
            Values of the parameters, by place and by name.
        name : str, optional
            What an error calls the system.

        Raises
        ------
        TypeError, ValueError
            If the system is an equation, which has no open loop, or as `functions`.
        """
        if self.is_equation:
            raise TypeError(
                f"{name} must be an open loop L, not an equation D = 0, got {self!r}: "
                "`System.opened` gives the open loop of a parameter"
            )
        given = {k: real_number(k, v) for k, v in self.given(values, numbers).items()}
        return *self.functions(given.values()), np.array(list(given.values()))

    @property
    def gain(self) -> float:
        """Factor in front of (s - zeros) / (s - poles)."""
        above, below = self.rational("gain")
        return float(above.leading_coefficient() / below.leading_coefficient())

    @property
    def is_rational(self) -> bool:
        """Whether it is an open loop without delays and parameters."""
        return not (self.parameters or self.longest_delay or self.is_equation)

    def rational(self, name: str = "system") -> tuple[fmpq_poly, fmpq_poly]:
        """Return numerator and denominator of a system without delays and parameters.

        Parameters
        ----------
        name : str, optional
            What an error calls it.

        Raises
        ------
        ValueError
            If the system has a delay or a parameter, or is an equation.
        """
        if not self.is_rational:
            raise ValueError(f"{name} must hold no delay and no parameter, got {self!r:.200}")
        return self.numerator.whole(), self.denominator.whole()

    def __eq__(self, other: object) -> bool:
        """Whether both are the same expression: the same coefficients and delay objects."""
        return isinstance(other, System) and self._content() == other._content()

    def __hash__(self) -> int:
        """Hash the expression."""
        return hash((self.numerator, self.denominator))

    def _content(self) -> tuple[Any, ...]:
        return self.numerator, self.denominator, self.nominal, self.step, self.at_zero

    def __getstate__(self) -> dict[str, Any]:
        """Return what makes the system, without what is made of it."""
        made = {
            k for k in vars(self) if isinstance(getattr(type(self), k, None), cached_property)
        }
        return {k: v for k, v in vars(self).items() if k not in made}

    def __str__(self) -> str:
        """Return numerator and denominator, or the equation, as one writes them."""
        above = written(self.numerator.terms)
        if self.is_equation:
            return f"{above} = 0"
        below = written(self.denominator.terms)
        return above if below == "1" else f"[{above}] / [{below}]"

    def __repr__(self) -> str:
        """Return a short text: the factors as given, or an open loop, or an equation."""
        if self.shown:
            return self.shown
        text = str(self)
        if len(text) > _LONGEST_RATIONAL and self.is_rational:
            zeros, poles = (tuple(roots.tolist()) for roots in (self.zeros(), self.poles()))
            return f"Controller(zeros={zeros}, poles={poles}, gain={self.gain})"
        if len(text) > _LONGEST_TEXT:
            terms = " over ".join(
                f"{len(part.terms)} terms of degree {part.degree}"
                for part in (self.numerator, self.denominator)
                if part
            )
            text = f"{terms}{' = 0' if self.is_equation else ''}"
        named = f", parameters {', '.join(self.parameters)}" if self.parameters else ""
        stated = f", without {self.at_zero} roots at s = 0" if self.at_zero else ""
        what = "equation" if self.is_equation else "open loop"
        return f"<{what} {text}{named}{stated}>"

    def __getattr__(self, name: str) -> Any:
        """Say what to write for a name of python-control that a system has not."""
        hint = _INSTEAD.get(name)
        what = f"; write {hint} for a system L with delays" if hint else ""
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{what}")

    def poles(self) -> ComplexArray:
        """Return the poles of a system without delays, in rad/s, as python-control has them.

        Those of its loop are ``characteristic_roots(system, right_of=...)``.

        Raises
        ------
        TypeError, ValueError
            If the system has delays, or is an equation, or a parameter has no nominal value.
        """
        return self._zeros_and_poles[1].copy()

    def zeros(self) -> ComplexArray:
        """Return the zeros of a system without delays, in rad/s, as python-control has them.

        Raises
        ------
        TypeError, ValueError
            As `poles`.
        """
        return self._zeros_and_poles[0].copy()

    @cached_property
    def _zeros_and_poles(self) -> tuple[ComplexArray, ComplexArray]:
        """Zeros and poles with nominal parameters."""
        if self.is_equation or self.longest_delay:
            raise ValueError(
                f"zeros and poles are those of a system without delays, got {self!r:.200}: "
                "write armlock.characteristic_roots(L, right_of=...), which has the roots of "
                "an equation, or of the closed loop of L"
            )
        above, below = self.at(**self.given((), {})).rational()
        zeros, poles = (np.array(Polynomial.of(p).roots, np.complex128) for p in (above, below))
        return zeros, poles

    def isdtime(self, strict: bool = False) -> bool:
        """Whether time is discrete: it is not. So python-control's plots take the system."""
        return False

    def update_names(self, **names: Any) -> None:
        """Keep no names of signals, so that ``control.series`` takes the system."""
        return

    def frequency_response(
        self, omega: npt.ArrayLike, squeeze: bool | None = None, **numbers: Any
    ) -> control.FrequencyResponseData:
        """Return the response as python-control's plots and functions take it.

        Parameters
        ----------
        omega : array_like of float
            In rad/s. Choose them dense enough for the delays: exp(-j omega theta) turns once in
            2 pi / theta.
        squeeze : bool, optional
            As in python-control.
        **numbers : real numbers, optional
            Values of the parameters.

        Returns
        -------
        control.FrequencyResponseData
        """
        import control

        omega = np.atleast_1d(real_array("omega", omega))
        return control.FrequencyResponseData(
            self(1j * omega, **numbers), omega, squeeze=squeeze, return_magphase=True,
            sysname="system with delays", plot_type="bode",
        )  # fmt: skip


def _combined(combine: Callable[..., tuple[Sum, Sum]], *systems: Any) -> System:
    """Return what becomes of open loops, from all their numerators and denominators in turn."""
    given = [System.of(system) for system in systems]
    names = names_of(given)
    parts = ((system.numerator, system.denominator) for system in given)
    above, below = combine(*chain.from_iterable(parts))
    if not below:
        raise ZeroDivisionError("the denominator of a system must not be zero")
    return System(above, below, names)


def names_of(systems: Iterable[System]) -> dict[str, float | None]:
    """Return the parameters of open loops, with one nominal value each, or raise."""
    names: dict[str, float | None] = {}
    for system in systems:
        if system.is_equation:
            raise TypeError(
                f"an equation D = 0 cannot be combined with a system, got {system!r}"
            )
        for name, value in system.nominal.items():
            known = names.setdefault(name, value)
            if value is not None and known not in (None, value):
                raise ValueError(
                    f"parameter {name} must have one nominal value, got {known} and {value}"
                )
            names[name] = value if known is None else known
    return names


def _parallel(n: Sum, m: Sum, p: Sum, q: Sum) -> tuple[Sum, Sum]:
    """Return numerator and denominator of a sum."""
    ratio = proportion(m, q)
    if ratio:
        return n + p * Sum.of(fmpq_poly([ratio])), m
    return n * q + p * m, m * q


def exact_number(name: str, value: Any) -> fmpq:
    """Return a finite real number, or a fraction, as the fraction that it is, or raise."""
    is_fraction = isinstance(value, fmpq | Fraction)
    return exact(value if is_fraction else real_number(name, value))


def proportion(first: Sum, second: Sum) -> fmpq | None:
    """Return the number by which the second sum is multiplied to be the first, or None."""
    if first.terms.keys() != second.terms.keys():
        return None
    key = next(iter(first.terms))
    ratio = first.terms[key].leading_coefficient() / second.terms[key].leading_coefficient()
    return ratio if all(p == second.terms[k] * ratio for k, p in first.terms.items()) else None


def _reduced(n: Sum, m: Sum, powers: bool) -> tuple[Sum, Sum]:
    """Divide out the delay objects that all terms hold, and if asked a common power of s.

    Raise if all terms of M, or of an equation, are still delayed.
    """
    terms = [*n.terms.items(), *m.terms.items()]
    if not terms:
        raise ValueError("an equation must not be zero everywhere")
    undelayed = [lag for (lag, _), _ in terms if not lag]
    held = set() if undelayed else {d for (lag, _), _ in terms for d, _ in lag}
    early = Lag.of({d: -min(dict(lag).get(d, 0) for (lag, _), _ in terms) for d in held})
    if NOW not in {lag.times(early) for lag, _ in (m or n).terms}:
        raise ValueError(
            "the system must be causal: every term of its denominator is delayed by "
            f"{' and '.join(sorted({fraction(lag.time) for lag, _ in (m or n).terms}))} s"
        )
    power = 0
    if powers and not [p for _, p in terms if p[0]]:
        power = min([order(p.coeffs()) for _, p in terms])
    if not early and not power:
        return n, m
    return n.over(power, early), m.over(power, early)


def Controller(zeros: Sequence[complex], poles: Sequence[complex], gain: float) -> System:
    r"""Return a rational function K(s), given by its factors.

    .. math::

        K(s) = g\, \frac{\prod_i (s - z_i)}{\prod_i (s - p_i)}

    Parameters
    ----------
    zeros, poles : sequence of complex
        :math:`z_i` and :math:`p_i` in rad/s; complex ones in conjugate pairs.
    gain : float
        Factor :math:`g` in front, not zero.

    Raises
    ------
    TypeError, ValueError
        If a value is not finite, complex ones do not come in conjugate pairs, or the gain
        is zero.

    Examples
    --------
    >>> from armlock import Controller
    >>> lag = Controller(zeros=[-2.0], poles=[-1.0], gain=3.0)
    >>> complex(lag(0.0))
    (6+0j)
    """
    above, below = _factors("zeros", zeros), _factors("poles", poles)
    gain = real_number("gain", gain)
    if gain == 0.0:
        raise ValueError("gain must not be zero: there would be no loop")
    found = System(Sum.of(of_roots(above) * exact(gain)), Sum.of(of_roots(below)))
    found.shown = f"Controller(zeros={above}, poles={below}, gain={gain})"
    return found


def _factors(name: str, values: Sequence[complex]) -> tuple[complex, ...]:
    """Return finite roots as a tuple, complex ones checked to come in pairs."""
    roots = np.atleast_1d(complex_array(name, values))
    if roots.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {roots.shape}")
    if roots.imag.any():
        upper = np.sort_complex(roots[roots.imag > 0.0])
        lower = np.sort_complex(roots[roots.imag < 0.0].conj())
        if upper.size != lower.size or (np.abs(upper - lower) > 1e-12 * np.abs(lower)).any():
            raise ValueError(f"{name} must be real or in conjugate pairs, got {values!r}")
    return tuple(roots.tolist())


def _by_control(
    name: str, system: Any, integrators: int | None, zeros: int | None
) -> tuple[fmpq_poly, fmpq_poly]:
    """Return numerator and denominator of a system of python-control, or raise."""
    import control

    if not isinstance(system, control.TransferFunction | control.StateSpace):
        raise TypeError(
            f"{name} must be a System, a number, a triple (zeros, poles, gain), or a transfer "
            f"function or state space of python-control, got {system!r:.200}"
        )
    if not system.issiso():
        raise ValueError(
            f"{name} must have one input and one output, got {system.ninputs} and "
            f"{system.noutputs}: return_difference(plant, [k1 * delay(h), k2]) takes a plant "
            "of several, with the delays in its controllers"
        )
    check_continuous(name, system)
    if isinstance(system, control.StateSpace):
        matrices = (real_array(name, getattr(system, letter)).tolist() for letter in "ABCD")
        return statespace.of_matrices([*matrices], integrators, zeros)
    above, below = (real_array(name, p[0][0])[::-1].tolist() for p in (system.num, system.den))
    return statespace.of_coefficients(above, below, integrators, zeros)


def check_continuous(name: str, system: Any) -> None:
    """Raise if a system of python-control is in discrete time."""
    if system.isdtime(strict=True):
        raise ValueError(
            f"{name} must be continuous in time, got sampling time {system.dt}: give the "
            "continuous system from which it was sampled; for a controller that is born "
            'discrete see the recipe "A digital controller"'
        )


def delay(theta: float | Fraction) -> System:
    r"""Return a pure delay, :math:`e^{-s\theta}`: one delay object.

    Used twice, the object is one delay. Two calls make two delays, even of equal length: a
    small change of one of them alone is then a small change of the loop.

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
    given: Any = theta
    if isinstance(given, System):
        raise TypeError(
            f"theta must be a number, got {given!r}: no system is affine in a delay, so count "
            "for one delay after the other, "
            "[unstable_roots(k * plant * delay(t), k=gains) for t in delays]"
        )
    value = exact_number("theta", theta)
    if value < 0:
        raise ValueError(f"theta must not be negative, got {theta}")
    lag = Lag.of({Delay.new(value): 1}) if value else NOW
    return System(Sum.of(_ONE, lag), _UNITY)


def lag_of(late: System) -> Lag:
    """Return the delay of a system that `delay` made, which may be none."""
    (((lag, _), _),) = late.numerator.terms.items()
    return lag


def delay_object(system: System, name: str) -> Delay:
    """Return the object of a system that is one delay, or raise."""
    terms = system.numerator.terms if isinstance(system, System) else {}
    if len(terms) == 1 and system.denominator == _UNITY:
        (((lag, names), p),) = terms.items()
        if len(lag) == 1 and lag[0][1] == 1 and not names and p == _ONE:
            return lag[0][0]
    raise TypeError(f"{name} must be what delay(theta) returns, got {system!r:.200}")


def parameter(name: str, nominal: float | None = None) -> System:
    """Return a named real parameter, for charts and for values that are given later.

    Parameters
    ----------
    name : str
        A name of Python that is no argument of a function of this package.
    nominal : float, optional
        Its value where none is given.

    Raises
    ------
    TypeError, ValueError
        If the name is none, or taken, or the value is not finite and real.

    Examples
    --------
    >>> from armlock import delay, parameter, s, unstable_roots
    >>> kp, ki = parameter("kp"), parameter("ki")
    >>> loop = (kp + ki / s) * delay(1.0) / (s + 1)
    >>> loop
    <open loop [ki exp(-1 s) + s kp exp(-1 s)] / [s^2 + s], parameters kp, ki>
    >>> unstable_roots(loop, kp=1.0, ki=[0.5, 3.0])
    array([0, 2])
    """
    if not isinstance(name, str) or not name.isidentifier():
        raise ValueError(f"name must be a name of Python, got {name!r}")
    if name in _TAKEN:
        raise ValueError(
            f"name must not be an argument of a function, got {name!r}: write for instance "
            f"{name + '_'!r}"
        )
    value = None if nominal is None else real_number("nominal", nominal)
    return System(Sum.of(_ONE, NOW, name), _UNITY, {name: value})


#: The Laplace variable s.
s = System(Sum.of(_S), _UNITY)


def equation(d: Any, step: float = 0.0, *, at_zero: int | None = None) -> System:
    r"""Return the equation D(s) = 0, whose own roots are counted.

    Parameters
    ----------
    d : System
        D. Its denominator is cleared: the roots are those of its numerator. ``equation(1 + L)``
        has the roots of the loop L, and those that cancel at s = 0.
    step : float, optional
        The step in s of a map. D is then a sum of numbers times powers of ``delay(step)``.
    at_zero : int, optional
        How many roots are at s = 0, for all values of the parameters, and left out: those that
        cancel, and one that is meant to be there, such as the agreement of a network. By
        default no root is left out.

    Returns
    -------
    System
        Not taken where an open loop is meant, for instance by `margins`.

    Raises
    ------
    TypeError, ValueError
        If D is zero or an equation already, all of it is delayed, it has not as many roots at
        s = 0 as stated, or a map holds s, or delays that are no multiples of its step.

    Examples
    --------
    An oscillator with a delayed force, x'' + 0.2 x' + x = k x(t - 1):

    >>> from armlock import delay, equation, parameter, s, unstable_roots
    >>> k = parameter("k")
    >>> forced = equation(s**2 + 0.2 * s + 1 - k * delay(1.0))
    >>> unstable_roots(forced, [0.1, -0.5])
    array([0, 2])

    A moving average is no pole, but 1 - exp(-s) is zero at s = 0:

    >>> average = (1 - delay(1.0)) / s
    >>> unstable_roots(equation(s + 2 * average, at_zero=1))
    0
    """
    system = System.of(d, "d")
    if system.is_equation:
        raise TypeError(f"d must be no equation yet, got {system!r}")
    above, step = system.numerator, not_negative("step", step)
    if step:
        for lag in above.lags:
            whole_steps("delay", float(lag.time), step)
        if above.degree:
            raise ValueError("a map must hold no s: its terms are numbers times delays")
    return equation_of(above, system.nominal, at_zero, system.cancelled(), step)


def equation_of(
    d: Sum,
    nominal: Mapping[str, float | None],
    at_zero: int | None = None,
    cleared: int = 0,
    step: float = 0.0,
) -> System:
    """Return D = 0 without the roots at s = 0 that are stated, or raise.

    Where rounding hides whether D(0) is zero, it has to be stated. So many roots at s = 0 come
    from clearing denominators.
    """
    if not d:
        raise ValueError("an equation must not be zero everywhere")
    series = d.lowest(whole_number("at_zero", 0 if at_zero is None else at_zero, 0) + 1)
    stated = settled("at_zero", at_zero, series, cleared=cleared)
    return System(d.without(stated), Sum({}), nominal, step, stated)
