"""Quasi-polynomials with any number of delays, as vectors over common polynomials and delays.

A function of a space is

    F(s) = sum_j p_j(s) [S_j + sum_k W_jk (exp(-s theta_k) - 1)]

with exact weights S and W. Its behaviour at s = 0 is decided here, exactly, and so is the end
of the imaginary axis: a frequency past which one term exceeds all others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import factorial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import acb, acb_poly, arb, fmpq, fmpq_poly

from armlock.checks import BoolArray, ComplexArray, FloatArray
from armlock.engine import chain, inclusion
from armlock.engine.inclusion import Arrays
from armlock.engine.polynomials import (
    Polynomial,
    exact,
    order,
    polynomial,
    rounded,
    series,
)
from armlock.engine.tolerances import CONFINED, CONFINED_TO_THE_END, EPSILON

Exact = npt.NDArray[np.object_]
# Most coefficients of a series at s = 0 of which one has to differ from zero.
_MOST_TERMS = 16
# Largest weight.
_LARGEST = 1e300
# A moved polynomial may be missed by this share, see `Polynomial.missed`.
_MOST_MISSED = 1e-12


class Leading(NamedTuple):
    """The leading term c s^k of a function at s = 0.

    Attributes
    ----------
    order : int
        The power k.
    coefficient : fmpq
        The coefficient c.
    radius : float
        Up to this abs(s), all other terms together are at most a share of it (Lemma 11).
    """

    order: int
    coefficient: fmpq
    radius: float

    @property
    def direction(self) -> complex:
        """Direction of c s^k for s = j omega, omega > 0."""
        turn: complex = (1.0, 1j, -1.0, -1j)[self.order % 4]
        return turn if self.coefficient > 0 else -turn


class Space:
    """Polynomials and delays that functions are made of.

    Parameters
    ----------
    polynomials : sequence of Polynomial
        Not zero.
    lags : iterable of Product
        Products of delay objects, each of them once. Those of length zero do not count.
    step : float, optional
        Sampling step in s of which all delays are multiples, if the functions are those of a
        map. They repeat along the axis, which then ends at pi / step.
    at_zero : int, optional
        How many zeros at s = 0 of N + M are stated and left out. By default these are the ones
        that N and M have in common.
    """

    def __init__(
        self,
        polynomials: Sequence[Polynomial],
        lags: Iterable[chain.Product],
        step: float = 0.0,
        at_zero: int | None = None,
    ) -> None:
        self.polynomials = tuple(polynomials)
        self.step, self.at_zero = step, at_zero
        #: Products of delay objects, by their length, one for each column of W.
        self.lags = tuple(
            sorted(
                {lag for lag in lags if lag.time},
                key=lambda lag: (lag.time, [(d.mark, n) for d, n in lag]),
            )
        )
        self.delays = tuple(lag.time for lag in self.lags)
        self.degree = max(p.degree for p in self.polynomials)
        self.longest = float(max(self.delays, default=fmpq(0)))
        unit = 1.0 / self.longest if self.longest else 1.0
        whole = next(p for p in self.polynomials if p.degree == self.degree)
        scale = np.array([abs(root) or unit for root in whole.roots])
        logs = np.log(scale).tolist()
        shape = len(self.polynomials), self.degree
        roots, present = np.zeros(shape, np.complex128), np.zeros(shape, np.bool_)
        computed = np.zeros(shape, np.bool_)
        for j, p in enumerate(self.polynomials):
            left = list(range(self.degree))
            for i, root in sorted(enumerate(p.roots), key=lambda pair: -abs(pair[1])):
                size = math.log(abs(root) or unit)
                k = min(left, key=lambda k: abs(logs[k] - size))
                left.remove(k)
                roots[j, k], present[j, k], computed[j, k] = root, True, i in p.computed
        self.arrays = Arrays(
            roots,
            present,
            computed,
            scale,
            np.array([float(p.lead) for p in self.polynomials]),
            np.array([p.missed for p in self.polynomials]),
            np.array([float(theta) for theta in self.delays]),
            np.array([float(theta - exact(float(theta))) for theta in self.delays]),
        )
        #: Highest coefficients, 0 of polynomials of lower degree, shape (J,).
        self.lead = np.where(present.all(axis=1), self.arrays.lead, 0.0)
        sizes = np.abs(roots[present])
        #: Sizes of roots and of one over the longest delay, ascending, in rad/s.
        self.corners = np.unique(np.append(sizes[sizes > 0.0], unit))
        self.sums = np.abs(roots).sum(axis=1)

    def around_roots(self, number: int = 200) -> FloatArray:
        """Frequencies around complex roots, closest where a function changes most.

        So many on each side, from a hundredth of the distance of a root from the axis to 1000
        times it.
        """
        roots = np.unique(self.arrays.roots[self.arrays.present])
        roots = roots[roots.imag > 0.0]
        near = np.maximum(np.abs(roots.real), 1e-9 * roots.imag)
        off = np.multiply.outer(np.geomspace(1e-2, 1e3, number), near)
        return np.concatenate((roots.imag - off, roots.imag + off)).ravel()

    def limits(self, steady: Any, delayed: FloatArray) -> tuple[Any, FloatArray]:
        """Of functions over s^degree at infinity: what nothing delays, and what delays do.

        The weights have shapes (..., J) and (..., J, K), the results (...) and (..., K).
        """
        whole = (steady - delayed.sum(-1)) @ self.lead
        return whole, np.einsum("...jk,j->...k", delayed, self.lead)

    def radius(
        self,
        weights: Sequence[Sequence[FloatArray]],
        orders: Sequence[int],
        logs: Sequence[float],
        share: float,
    ) -> FloatArray:
        """Radii up to which all terms of higher power are at most a share of a leading one.

        By Cauchy's bound of all coefficients, on circles of several radii (Lemma 11).

        Parameters
        ----------
        weights : sequence of pairs of float arrays, shapes (n, J) and (n, J, K)
            Of n functions; or of two times n, whose products are meant.
        orders, logs : sequences, length n
            The power of the leading term, and the logarithm of its coefficient.
        share : float
            That share.
        """
        rho = np.geomspace(1e-4, 10.0, 24) * self.corners[0]
        arrays = self.arrays
        with np.errstate(divide="ignore", over="ignore"):
            distances = np.log(np.abs(arrays.roots)[..., None] + rho)
            sizes = np.where(arrays.present[..., None], distances, 0.0).sum(1)
            sizes = sizes + np.log(np.abs(arrays.lead) * (1.0 + arrays.missed))[:, None]
            turned = np.expm1(np.multiply.outer(arrays.delays, rho))
            most = sum(
                np.logaddexp.reduce(
                    sizes + np.log(np.abs(s)[..., None] + np.abs(w) @ turned), axis=1
                )
                for s, w in weights
            )
        ratio = np.log(0.9 * share) + np.array(logs)[:, None]
        ratio = ratio + np.multiply.outer(np.array(orders), np.log(rho)) - most
        shares = np.exp(np.minimum(ratio, -np.log(10.0)))
        found: FloatArray = (shares * rho).max(axis=1) * (1.0 - 1e-9)
        return found

    def confined(self, still: FloatArray, late: FloatArray) -> BoolArray:
        """Tell of which functions the neutral chain is confined, by their limits, shape (n,).

        By more than rounding; a map has no such chain.
        """
        if self.step:
            return np.ones(len(still), np.bool_)
        sizes = np.abs(still) + np.abs(late).sum(-1)
        found: BoolArray = chain.reserve(still, late) > CONFINED * sizes
        return found

    def confined_from(
        self,
        steady: FloatArray | ComplexArray,
        delayed: FloatArray,
        terms: float | FloatArray = 0.0,
        *,
        extra: float | FloatArray = 0.0,
        top_terms: float | FloatArray | None = None,
        reserve: float | FloatArray | None = None,
    ) -> FloatArray:
        """Frequency past which, for Re s >= 0, the highest power exceeds all else (Lemma 12).

        Parameters
        ----------
        steady, delayed : float arrays, shapes (n, J) and (n, J, K)
            Weights of n functions.
        terms : float array, shape (n, J) or one that broadcasts, optional
            Sizes of further terms of any phase, as weights of the polynomials.
        extra : float array, shape (n, J) or one that broadcasts, optional
            Sizes of weights that leave the limit at infinity as it is.
        top_terms : float or float array, shape (n,), optional
            Size of the terms over s^degree at infinity; that of their weights by default.
            Polynomials that cancel there make it less.
        reserve : float or float array, shape (n,), optional
            A lower bound of the function over s^degree at infinity; that of `chain.reserve` by
            default.

        Returns
        -------
        float array, shape (n,)
            In rad/s; inf where it does not at infinity. The end of the axis of a map.
        """
        if self.step:
            return np.full(len(steady), np.pi / self.step)
        gap = np.array([self.degree - p.degree for p in self.polynomials])
        lead, size = np.abs(self.lead), np.abs(self.arrays.lead)
        whole, parts = steady - delayed.sum(-1), np.abs(delayed).sum(-1)
        terms = np.broadcast_to(np.abs(terms), whole.shape)
        parts = parts + terms + np.abs(extra)
        still, turned = self.limits(steady, delayed)
        if reserve is None:
            reserve = chain.reserve(still, turned)
        with np.errstate(under="ignore"):
            rounding = CONFINED_TO_THE_END * ((np.abs(whole) + parts) @ lead)
        room = reserve - (terms @ lead if top_terms is None else top_terms) - rounding
        found = np.full(len(steady), np.inf)
        left = np.flatnonzero(room > 0.0)
        omega = self.corners[-1]
        for _ in range(300):
            if not left.size:
                break
            grown = np.expm1(np.minimum(self.sums / omega, 50.0))
            grown += self.arrays.missed * (1.0 + grown)
            with np.errstate(under="ignore", over="ignore"):
                share = size * float(omega) ** -gap.astype(float)
            off = np.where(gap == 0, share * grown, share * (1.0 + grown))
            spent = (np.abs(whole[left]) + parts[left]) @ off
            done = room[left] > spent
            found[left[done]] = omega
            left = left[~done]
            omega *= 2.0
        return found


@dataclass(frozen=True, eq=False)
class Function:
    """A function of a space, by its weights S, shape (J,), and W, shape (J, K)."""

    space: Space
    steady: Exact
    delayed: Exact

    def __add__(self, other: Function) -> Function:
        """Return the sum."""
        return Function(self.space, self.steady + other.steady, self.delayed + other.delayed)

    def __mul__(self, factor: float | fmpq) -> Function:
        """Return a multiple."""
        factor = exact(factor)
        return Function(self.space, self.steady * factor, self.delayed * factor)

    @cached_property
    def weights(self) -> tuple[FloatArray, FloatArray]:
        """S and W, rounded."""
        steady, delayed = self.steady, self.delayed
        return check_sizes(rounded(steady), rounded(delayed.ravel()).reshape(delayed.shape))

    @property
    def sizes(self) -> FloatArray:
        """Largest sizes of the weights, whatever the phases of exponentials, shape (J,)."""
        steady, delayed = self.weights
        sizes: FloatArray = np.abs(steady - delayed.sum(1)) + np.abs(delayed).sum(1)
        return sizes

    @cached_property
    def limits(self) -> tuple[fmpq, ...]:
        """Over s^degree at infinity: what nothing delays, and what delays do, exactly."""
        lead = [p.lead if p.degree == self.space.degree else 0 for p in self.space.polynomials]
        still, late = self.steady - self.delayed.sum(axis=1), self.delayed.T
        return tuple(
            sum((a * w for a, w in zip(lead, row, strict=True)), fmpq(0))
            for row in (still, *late)
        )

    @property
    def size_at_infinity(self) -> float:
        """Largest size of the function over s^degree at infinity, whatever these phases."""
        still, turned = self.space.limits(*self.weights)
        return float(abs(still) + np.abs(turned).sum())

    @property
    def confined(self) -> bool:
        """Whether its neutral chain is confined, by more than rounding."""
        still, late = self.space.limits(*(part[None] for part in self.weights))
        return bool(self.space.confined(still, late)[0])

    @property
    def is_zero(self) -> bool:
        """Whether the function is zero everywhere."""
        return not (self.steady.any() or self.delayed.any())

    @cached_property
    def by_delay(self) -> list[tuple[fmpq, fmpq_poly]]:
        """The function as polynomials times exp(-s theta): pairs of theta and polynomial."""
        now = self.steady - self.delayed.sum(axis=1)
        columns = [(fmpq(0), now), *zip(self.space.delays, self.delayed.T, strict=True)]
        found = []
        for theta, weights in columns:
            pairs = zip(self.space.polynomials, weights, strict=True)
            p = sum((p.exact * w for p, w in pairs if w), fmpq_poly([0]))
            if p:
                found.append((theta, p))
        return found

    def series(self, number: int) -> list[fmpq]:
        """First coefficients of the Taylor series at s = 0, exactly."""
        return series(self.by_delay, number)

    @cached_property
    def lowest(self) -> tuple[int, fmpq] | None:
        """Power and coefficient of the leading term at s = 0.

        None of a function whose first 16 coefficients are zero.
        """
        for number in (1, 2, _MOST_TERMS):
            c = self.series(number)
            if any(c):
                return order(c), c[order(c)]
        return None

    def leading(self, share: float = 0.25) -> Leading | None:
        """Leading term at s = 0, if it is known, and where all others are at most a share."""
        if self.lowest is None:
            return None
        k, c = self.lowest
        return Leading(k, c, self.radius(k, abs(c), share))

    def radius(
        self, order: int, coefficient: fmpq, share: float, other: Function | None = None
    ) -> float:
        """Radius up to which all terms of higher power are at most a share of this term.

        By Cauchy's bound of all coefficients, on circles of several radii (Lemma 11); of the
        product with another function, if there is one.
        """
        weights = [[part[None] for part in f.weights] for f in (self, other) if f]
        return float(self.space.radius(weights, [order], [log(coefficient)], share)[0])

    def with_slope(self) -> tuple[Function, Function]:
        """Return the function and its derivative, in one space."""
        own, delays = self.space, np.array(self.space.delays, object)
        slopes = [p.exact.derivative() for p in own.polynomials]
        space = Space([*own.polynomials, *map(Polynomial.of, slopes)], own.lags)
        steady, delayed = self.steady, self.delayed
        late = -delayed * delays
        return (
            Function(space, np.append(steady, 0 * steady), np.vstack((delayed, 0 * delayed))),
            Function(space, np.append(late.sum(1), steady), np.vstack((late, delayed))),
        )

    def taylor(self, s: acb, number: int) -> list[acb]:
        """First Taylor coefficients at a ball, with the bits of python-flint's context."""
        found = acb_poly([0])
        for theta, p in self.by_delay:
            late, turn = arb(-theta), (-s * theta).exp()
            turns = acb_poly([turn * late**k / factorial(k) for k in range(number)])
            found += acb_poly(p)(acb_poly([s, 1])) * turns
        return [found[k] for k in range(number)]

    def shifted(self, sigma: float) -> tuple[Space, inclusion.Functions]:
        """Return the function s -> F(s + sigma): its space, and its weights.

        What exponentials and weights round by is part of the error of S (Lemma 17).
        """
        polynomials = []
        for p in self.space.polynomials:
            roots = np.array(p.roots) - sigma
            missed = p.missed
            if missed:
                # What computed roots miss was measured by their distance from s = 0.
                k = list(p.computed)
                with np.errstate(divide="ignore", invalid="ignore"):
                    sizes = (np.abs(np.array(p.roots)[k]) + abs(sigma)) / np.abs(roots[k])
                sizes[np.isnan(sizes)] = 1.0
                missed *= float(np.maximum(sizes, 1.0).prod())
            moved = p.exact(polynomial([sigma, 1]))
            # Next to a root that was computed, the roots are computed again.
            polynomials.append(
                Polynomial.of(moved)
                if missed > _MOST_MISSED
                else Polynomial(moved, tuple(roots.tolist()), p.computed, missed)
            )
        space = Space(polynomials, self.space.lags, self.space.step)
        steady, delayed = self.weights
        change = np.expm1(-sigma * space.arrays.delays)
        turned = delayed * (1.0 + change)
        grown = np.abs(change) + (1.0 + change) * (1.0 + abs(sigma) * space.arrays.delays)
        sizes = np.abs(steady) + np.abs(delayed) @ grown
        parts = steady + delayed @ change, turned, (8.0 + change.size) * EPSILON * sizes
        return space, inclusion.Functions(space.arrays, *(part[None] for part in parts))


def common_zeros(n: Function, m: Function) -> int:
    """How many zeros of N + M at s = 0 are left out: those in common, or those stated."""
    if n.space.at_zero is not None:
        return n.space.at_zero
    return min((f.lowest[0] for f in (n, m) if f.lowest), default=0)


def keeps_sign_up_to(f: Function, g: Function, *, odd: bool) -> float:
    """Frequency up to which the real part of F conj(G), or the imaginary one, keeps its sign.

    It is the even or the odd part of F(s) G(-s) on the axis (Lemma 19). Zero if the leading
    term of that part is not known.
    """
    one, other = f.series(_MOST_TERMS), g.series(_MOST_TERMS)
    for k in range(odd, _MOST_TERMS, 2):
        product = sum(one[k - i] * other[i] * (-1) ** i for i in range(k + 1))
        if product:
            return f.radius(k, abs(product), 0.5, g)
    return 0.0


def limit_at_zero(n: Function, m: Function) -> float:
    """Limit of N / M at s = 0; inf at a pole, nan where the first 16 coefficients are zero."""
    pairs = zip(n.series(_MOST_TERMS), m.series(_MOST_TERMS), strict=True)
    above, below = next((pair for pair in pairs if any(pair)), (None, None))
    if above is None or below is None:
        return np.nan
    return float(rounded([above / below])[0]) if below else np.inf


def log(value: fmpq) -> float:
    """Natural logarithm of a positive fraction, of which a float may overflow."""
    return math.log(int(value.p)) - math.log(int(value.q))


def check_sizes(steady: FloatArray, delayed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return weights of which sums do not overflow, or raise."""
    if max(np.abs(x).max(initial=0.0) for x in (steady, delayed)) > _LARGEST:
        raise ValueError(
            f"the loop must have coefficients below {_LARGEST:g}: choose another unit of time"
        )
    return steady, delayed


def stacked(functions: Sequence[Function]) -> tuple[FloatArray, FloatArray]:
    """Return rounded weights of functions, shapes (functions, J) and (functions, J, K)."""
    s, w = zip(*(f.weights for f in functions), strict=True)
    return np.array(s), np.array(w)


def compiled(functions: Sequence[Function]) -> inclusion.Functions:
    """Return functions of one space, with rounded weights, as compiled functions take them."""
    steady, delayed = stacked(functions)
    return inclusion.Functions(
        functions[0].space.arrays, steady, delayed, np.zeros_like(steady)
    )


def at(functions: Sequence[Function], omega: npt.ArrayLike) -> ComplexArray:
    """Evaluate functions at frequencies, all times one positive number at each frequency."""
    flat = np.ravel(np.asarray(omega, np.float64))
    found: ComplexArray = inclusion.values(compiled(functions), flat)
    return found.reshape(len(functions), *np.shape(omega))
