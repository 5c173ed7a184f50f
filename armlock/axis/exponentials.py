"""Polynomials times exponentials on the imaginary axis, with bounds on all that is uncertain.

D, its terms and their products are such sums at s = j omega, see `ExponentialSum`. Polynomials
of low degree are one expansion in powers of omega, but where that cancels: next to a cluster of
lightly damped roots. There, and of high degree everywhere, they are expanded anew in each
*piece* of the axis, from their roots.

Within a piece a sum has a value and a derivative, a bound on its second derivative, and one on
its rounding error. The walks along the axis need no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.axis.compiled import njit
from armlock.axis.polynomials import Polynomial
from armlock.axis.rounding import EPSILON, ROUNDING
from armlock.checks import ComplexArray, FloatArray, IntArray

#: Most powers of an expansion. Beyond this degree a polynomial is evaluated from its roots.
LOW_DEGREE = 20
# Where a polynomial is smaller than the product of omega + |root| by more than this factor, it
# is evaluated from its roots: up to here rounding takes four of its sixteen digits.
_CANCELLED = 1e4
# Roots within this share of the axis are looked at for that. Other roots cancel by less than a
# factor of 20 each. That many of them do so at one frequency is rare, and costs time alone.
_LIGHT = 0.1
# How many roots of a polynomial, each weighed by reach / (reach + distance), a piece may have
# around it. Roots exactly at its start are not counted. Then LOW_DEGREE powers hold the
# polynomial to rounding.
_CROWD = 1.5


def _cancellation(roots: ComplexArray, omega: FloatArray) -> FloatArray:
    """Return log of the product of (omega + |root|) / |j omega - root| at frequencies."""
    with np.errstate(divide="ignore"):
        ratios = (omega[:, None] + np.abs(roots)) / np.abs(1j * omega[:, None] - roots)
        return np.asarray(np.log(ratios).sum(axis=1))


def merged(ranges: FloatArray) -> list[tuple[float, float]]:
    """Intervals of shape (n, 2), ascending, with those that overlap made one."""
    found: list[tuple[float, float]] = []
    for low, high in sorted(map(tuple, ranges.tolist())):
        if found and low <= found[-1][1]:
            found[-1] = found[-1][0], max(high, found[-1][1])
        else:
            found.append((low, high))
    return found


def _crowded(polynomials: Sequence[Polynomial]) -> FloatArray:
    """Intervals of the axis on which a polynomial's expansion about s = 0 cancels.

    Ascending, in rad/s, of shape (n, 2). They are found from the cancellation at the light
    roots, where it is largest, and at distances from these that are halved again and again. No
    bound depends on them: both expansions know their rounding.
    """
    known = [p.roots for p in polynomials]
    every = np.concatenate([np.empty(0, dtype=np.complex128), *known])
    light = (every.imag > 0.0) & (np.abs(every.real) < _LIGHT * np.abs(every))
    peaks = np.unique(every.imag[light])
    shares = np.concatenate(([0.0], 0.5 ** np.arange(50, 0, -1)))
    found: list[tuple[float, float]] = []
    for roots in known if peaks.size else ():
        for peak in peaks[_cancellation(roots, peaks) > np.log(_CANCELLED)]:
            reach = 0.0
            for side in (-1.0, 1.0):
                far = _cancellation(roots, peak * (1.0 + side * shares)) > np.log(_CANCELLED)
                reach = max(reach, 2.0 * shares[far].max())
            found.append((peak * max(1.0 - reach, 0.0), peak * (1.0 + reach)))
    return np.reshape(merged(np.reshape(found, (-1, 2))), (-1, 2))


def _gathered(
    weights: Sequence[npt.NDArray[Any]], phases: Sequence[float]
) -> tuple[npt.NDArray[Any], FloatArray]:
    """Add up the weights of equal phases; those that only rounding tells apart are equal."""
    every = np.array(phases)
    order = np.argsort(every, kind="stable")
    first = np.diff(every[order], prepend=-np.inf) > 4.0 * EPSILON * np.abs(every).max()
    groups = np.cumsum(first) - 1
    gathered = np.zeros((groups[-1] + 1, weights[0].size), dtype=weights[0].dtype)
    np.add.at(gathered, groups, np.array(weights)[order])
    return gathered, every[order][first]


class ExponentialSum(NamedTuple):
    r"""A function of s = j omega: polynomials times exponentials, added up.

    With polynomials p_k and phase rates :math:`\alpha_g` it is

    .. math::

        f(\omega) &= \sum_g \sum_k w_{gk}\, p_k\, e^{\mathrm{j}\omega\alpha_g} \\
        &= \sum_k W_k\, p_k
        + \sum_g \sum_k w_{gk}\, p_k \left( e^{\mathrm{j}\omega\alpha_g} - 1 \right) ,

    and the second form is the one that is evaluated.

    Attributes
    ----------
    polynomials : tuple of Polynomial
        The p_k.
    weights : float or complex array, shape (groups, polynomials)
        The w_gk.
    phases : float array, shape (groups,)
        Phase rates, in s.
    sums : float or complex array, shape (polynomials,)
        The W_k, the sums of the weights over all groups. They are carried along, and not
        summed up, because the weights may cancel to many digits.
    """

    polynomials: tuple[Polynomial, ...]
    weights: npt.NDArray[Any]
    phases: FloatArray
    sums: npt.NDArray[Any]

    def times_conjugate(self, other: ExponentialSum) -> ExponentialSum:
        """Return this sum times the complex conjugate of `other`, at real omega."""
        products = tuple(
            p.times_conjugate(q) for p in self.polynomials for q in other.polynomials
        )
        pairs = [
            (np.outer(w, v).ravel(), phase - other_phase)
            for w, phase in zip(self.weights, self.phases, strict=True)
            for v, other_phase in zip(other.weights, other.phases, strict=True)
        ]
        weights, phases = _gathered(*zip(*pairs, strict=True))
        sums = np.outer(self.sums, other.sums).ravel()
        return ExponentialSum(products, weights, phases, sums)

    def scaled(self, weight: float) -> ExponentialSum:
        """Return this sum times a number."""
        return self._replace(weights=weight * self.weights, sums=weight * self.sums)

    def plus(self, other: ExponentialSum) -> ExponentialSum:
        """Return this sum plus another one of the same polynomials."""
        weights, phases = _gathered(
            (*self.weights, *other.weights), (*self.phases, *other.phases)
        )
        return ExponentialSum(self.polynomials, weights, phases, self.sums + other.sums)

    def times_j(self) -> ExponentialSum:
        """Return this sum times j, whose imaginary part is the real part of this one."""
        return ExponentialSum(self.polynomials, 1j * self.weights, self.phases, 1j * self.sums)

    def compiled(self) -> CompiledSum:
        """Return the sum as compiled functions take it."""
        degree = max(p.coefficients.size for p in self.polynomials) - 1
        whole = np.zeros((len(self.polynomials), degree + 1), dtype=np.complex128)
        # Powers of j, so that each coefficient stays exactly real or exactly imaginary.
        turns = np.array([1.0, 1.0j, -1.0, -1.0j])[np.arange(degree + 1) % 4]
        with np.errstate(invalid="ignore"):
            for row, p in zip(whole, self.polynomials, strict=True):
                size = p.coefficients.size
                row.real[:size] = p.coefficients * turns.real[:size]
                row.imag[:size] = p.coefficients * turns.imag[:size]
        leads = [np.frexp(p.leads or p.coefficients[-1:]) for p in self.polynomials]
        direct = degree <= LOW_DEGREE and _in_range(whole)
        polynomials = CompiledPolynomials(
            whole if direct else whole[:0],
            _crowded(self.polynomials) if direct else np.empty((0, 2)),
            np.concatenate([p.roots for p in self.polynomials]),
            np.cumsum([0, *(p.roots.size for p in self.polynomials)]),
            np.array([mantissas.prod() for mantissas, _ in leads]),
            np.array([int(exponents.sum()) for _, exponents in leads]),
            np.array([p.missed for p in self.polynomials]),
        )
        certain = np.zeros(self.sums.size)
        return CompiledSum(polynomials, self.weights, self.sums, self.phases, certain)


class CompiledPolynomials(NamedTuple):
    """Some polynomials as compiled functions take them.

    Attributes
    ----------
    coefficients : complex array, shape (k, degree + 1)
        In powers of omega. It has no rows if a degree exceeds `LOW_DEGREE` or products would
        leave the range of floats. Then the roots are used.
    crowded : float array, shape (n, 2)
        Ascending intervals of the axis, in rad/s, on which the roots are used all the same.
    roots : complex array
        Those of all polynomials, one polynomial after the other.
    starts : int array, shape (k + 1,)
        The index of each polynomial's first root, and the number of all roots.
    leads, exponents : float and int array, shape (k,)
        Highest coefficients, over powers of two; and the exponents of these.
    missed : float array, shape (k,)
        As for `Polynomial`.
    """

    coefficients: ComplexArray
    crowded: FloatArray
    roots: ComplexArray
    starts: IntArray
    leads: FloatArray
    exponents: IntArray
    missed: FloatArray


class CompiledSum(NamedTuple):
    """An exponential sum as compiled functions take it.

    Attributes
    ----------
    polynomials : CompiledPolynomials
        The polynomials.
    weights, sums, phases : arrays
        Those of `ExponentialSum`.
    uncertain : float array, shape (polynomials,)
        How far the entries of `sums` may be off. A parameter that is off by d moves the whole
        sum by at most d times its polynomial's magnitude: so `weights` need none.
    """

    polynomials: CompiledPolynomials
    weights: npt.NDArray[Any]
    sums: npt.NDArray[Any]
    phases: FloatArray
    uncertain: FloatArray


def aligned(*sums: ExponentialSum) -> tuple[ExponentialSum, ...]:
    """Give sums of the same polynomials the same phases. Missing ones get a weight of zero."""
    nothing = reduce(ExponentialSum.plus, [whole.scaled(0.0) for whole in sums])
    return tuple(nothing.plus(whole) for whole in sums)


def _in_range(values: ComplexArray) -> bool:
    """Whether products of four such values are floats, zeros left out."""
    sizes = np.abs(values[values != 0.0])
    return bool(((sizes > 1e-70) & (sizes < 1e70)).all())


def conjugates_without_zeros(
    whole: ExponentialSum, *others: ExponentialSum
) -> tuple[ExponentialSum, ...]:
    """Return `others` times the conjugate of M / omega^2m, and |M|^2 / omega^2m.

    M is `whole`, and 2m as many roots as its polynomials have at s = 0, up to an odd one. The
    signs of the imaginary parts and the quotients N / M = N conj(M) / |M|^2 are those without
    the division; but next to s = 0 M vanishes to a high order, and rounding would hide both.
    """
    # An arm that the sensor does not use has the polynomial zero.
    there = np.array([p.coefficients.any() for p in whole.polynomials])
    used = np.flatnonzero(there & (np.any(whole.weights, axis=0) | (whole.sums != 0.0)))
    zeros = [int((whole.polynomials[k].roots == 0.0).sum()) for k in used]
    m = min(zeros, default=0) // 2
    if m == 0:
        return *(one.times_conjugate(whole) for one in others), whole.times_conjugate(whole)
    number = len(whole.polynomials)
    short = [whole.polynomials[k].without_zeros(2 * m) for k in used]
    half = [whole.polynomials[k].without_zeros(m) for k in used]
    polynomials = (*whole.polynomials, *short, *half)

    def placed(one: ExponentialSum, at: IntArray, factor: float, to: int) -> ExponentialSum:
        weights = np.zeros((one.phases.size, len(polynomials)))
        sums = np.zeros(len(polynomials))
        weights[:, to : to + at.size] = factor * one.weights[:, at]
        sums[to : to + at.size] = factor * one.sums[at]
        return ExponentialSum(polynomials, weights, one.phases, sums)

    every = np.arange(number)
    # (j omega)^2m is (-1)^m omega^2m, and s^m times its conjugate is omega^2m.
    divided = placed(whole, used, (-1.0) ** m, number)
    root = placed(whole, used, 1.0, number + used.size)
    products = (placed(one, every, 1.0, 0).times_conjugate(divided) for one in others)
    return *products, root.times_conjugate(root)


def without_unused(*sums: ExponentialSum) -> tuple[ExponentialSum, ...]:
    """Return sums of the same polynomials without those that have no weight in any of them."""
    used = np.any([np.any(s.weights, axis=0) | (s.sums != 0.0) for s in sums], axis=0)
    polynomials = tuple(p for p, kept in zip(sums[0].polynomials, used, strict=True) if kept)
    # Not s.weights[:, used]: its rows would lie the other way, for which all is compiled again.
    return tuple(
        ExponentialSum(polynomials, s.weights.compress(used, axis=1), s.phases, s.sums[used])
        for s in sums
    )


@njit()
def with_smaller_terms(a: float, b: float, c: float, d: float) -> float:
    """Return a + b or c + d, two ways to add up one number: the one that cancels less."""
    return a + b if abs(a) + abs(b) < abs(c) + abs(d) else c + d


@njit()
def real_horner(p: FloatArray, u: float) -> float:
    """Value of a real polynomial with ascending coefficients."""
    value = 0.0
    for k in range(p.size - 1, -1, -1):
        value = value * u + p[k]
    return value


@njit()
def _from_roots(
    polynomials: CompiledPolynomials, omega: float, reach: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Expand polynomials about j omega, in powers of u = (change of omega) / reach.

    All are divided by one power of two, so that the largest is about one. Returns the
    coefficients and their magnitudes, shape (k, LOW_DEGREE + 1), and bounds on what the higher
    powers add up to where 0 <= u <= 1. The magnitudes count the roots, since each
    multiplication rounds, and hold what the roots miss.
    """
    _, _, roots, starts, leads, exponents, missed = polynomials
    size, exponents = LOW_DEGREE + 1, exponents.copy()
    found = np.zeros((leads.size, size), dtype=np.complex128)
    sizes = np.zeros((leads.size, size))
    left_out = np.zeros(leads.size)
    largest = -(1 << 60)
    for k in range(leads.size):
        found[k, 0], sizes[k, 0], total = leads[k], abs(leads[k]), abs(leads[k])
        degree, off = 0, missed[k] * abs(leads[k])
        for root in roots[starts[k] : starts[k + 1]]:
            away = 1j * omega - root
            distance = abs(away)
            total *= distance + reach
            scale = 1.0
            if total > 1e60 or 0.0 < total < 1e-60:
                exponent = int(np.floor(np.log2(total)))
                exponents[k] += exponent
                scale = 2.0**-exponent
                total *= scale
            degree, off = degree + 1, scale * off * (omega + reach + abs(root))
            for m in range(min(degree, size - 1), 0, -1):
                found[k, m] = scale * (away * found[k, m] + 1j * reach * found[k, m - 1])
                sizes[k, m] = scale * (distance * sizes[k, m] + reach * sizes[k, m - 1])
            found[k, 0] *= scale * away
            sizes[k, 0] *= scale * distance
        # Of a low degree no power is left out.
        if degree >= size:
            left_out[k] = max(total - sizes[k].sum(), 0.0) + degree * EPSILON * total
        # Each root multiplies twice and adds, in complex numbers: four EPSILON.
        sizes[k] *= 1.0 + 0.5 * degree
        sizes[k, 0] += off / (ROUNDING * EPSILON)
        if total > 0.0:
            largest = max(largest, exponents[k] + int(np.floor(np.log2(total))))
    for k in range(leads.size):
        scale = 2.0 ** min(max(exponents[k] - largest, -1000), 1000)
        found[k] *= scale
        sizes[k] *= scale
        left_out[k] *= scale
    return found, sizes, left_out


@njit()
def _reach(roots: ComplexArray, starts: IntArray, omega: float) -> float:
    """How far from omega the expansion of `_from_roots` is accurate, at most 1e300.

    Around each polynomial the crowd, the sum of reach / (reach + distance), is concave in the
    reach: Newton's method from below never passes the length at which it is _CROWD.
    """
    distances = np.abs(1j * omega - roots)
    shortest = 1e300
    for k in range(starts.size - 1):
        reach = 0.0
        for _ in range(6):
            crowd, rate = 0.0, 0.0
            for distance in distances[starts[k] : starts[k + 1]]:
                if distance > 0.0:
                    crowd += reach / (reach + distance)
                    rate += distance / (reach + distance) ** 2
            if rate * (shortest - reach) <= _CROWD - crowd:
                reach = shortest
                break
            reach += (_CROWD - crowd) / rate
        shortest = min(shortest, reach)
    return shortest


class Piece(NamedTuple):
    """An exponential sum over a piece of the axis, in powers of u = (omega - start) per_reach.

    Where polynomials of low degree are evaluated from coefficients, a piece starts at omega = 0
    and u = omega. In any other piece u goes from 0 to at most 1.

    Attributes
    ----------
    start, end : float
        In rad/s: where u is zero, and up to where it holds.
    per_reach : float
        In s/rad.
    local : complex array, shape (1 + groups, n)
        The coefficients of the sum, then of each group.
    sizes : float array, shape (1 + groups, n + 1)
        Magnitudes for rounding. The last column bounds the powers that are left out, over
        EPSILON: `rounding_bound` multiplies all by EPSILON and more.
    phases : float array, shape (groups,)
        Those of the sum.
    direct : bool
        Whether it is made from coefficients in powers of omega: these are real or imaginary.
    """

    start: float
    end: float
    per_reach: float
    local: ComplexArray
    sizes: FloatArray
    phases: FloatArray
    direct: bool


@njit()
def expand(whole: CompiledSum, omega: float) -> Piece:
    """Return an exponential sum over the piece of the axis that holds omega.

    One that is expanded from roots starts there, one from coefficients at zero. The magnitudes
    contain what is uncertain in the sum.
    """
    polynomials, weights, sums, phases, uncertain = whole
    coefficients = polynomials.coefficients
    expanded, piece_end = coefficients.shape[0] == 0, np.inf
    for low, high in polynomials.crowded:
        if omega < high:
            expanded = omega >= low
            piece_end = high if expanded else low
            break
    reach = 1.0
    magnitudes = (0.75 + 0.25 * coefficients.shape[1]) * np.abs(coefficients)
    left_out = np.zeros(coefficients.shape[0])
    if expanded:
        # Next to a root of high order on the axis it would be no step at all.
        reach = max(_reach(polynomials.roots, polynomials.starts, omega), 4.0 * EPSILON * omega)
        reach = min(reach, piece_end - omega)
        piece_end = min(omega + reach, piece_end)
        coefficients, magnitudes, left_out = _from_roots(polynomials, omega, reach)
    number, size = coefficients.shape
    groups = weights.shape[0]
    local = np.zeros((1 + groups, size), dtype=np.complex128)
    sizes = np.zeros((1 + groups, size + 1))
    for g in range(1 + groups):
        for k in range(number):
            weight = sums[k] if g == 0 else weights[g - 1, k]
            unknown = uncertain[k] if g == 0 else 0.0
            # What is unknown moves the sum by that share of a polynomial's value, and rounds.
            magnitude, moved = abs(weight) + unknown, unknown / (ROUNDING * EPSILON)
            if magnitude != 0.0:
                for m in range(size):
                    local[g, m] += weight * coefficients[k, m]
                    sizes[g, m] += magnitude * magnitudes[k, m]
                    if moved > 0.0:
                        sizes[g, m] += moved * abs(coefficients[k, m])
                sizes[g, size] += (magnitude / EPSILON + moved) * left_out[k]
    if not expanded:
        return Piece(0.0, piece_end, 1.0, local, sizes, phases, True)
    # Powers that rounding hides are not worth their time.
    powers = sizes[:, :size].sum(axis=0)
    used, dropped, hidden = size, powers[size - 1], 1e-3 * EPSILON * powers.sum()
    while used > 1 and dropped <= hidden:
        used -= 1
        dropped += powers[used - 1]
    sizes[:, used] = sizes[:, size] + sizes[:, used:size].sum(axis=1) / EPSILON
    local, sizes = local[:, :used].copy(), sizes[:, : used + 1].copy()
    return Piece(omega, piece_end, 1.0 / reach, local, sizes, phases, False)


@njit()
def evaluate(piece: Piece, omega: float) -> tuple[complex, complex]:
    """Value and derivative of an exponential sum within a piece.

    Real and imaginary parts apart, since omega is real: this is the innermost loop.
    """
    local, phases = piece.local, piece.phases
    size = local.shape[1]
    per_reach = piece.per_reach
    u = (omega - piece.start) * per_reach
    value_re, value_im, slope_re, slope_im = 0.0, 0.0, 0.0, 0.0
    for k in range(size - 1, -1, -1):
        slope_re = slope_re * u + value_re
        slope_im = slope_im * u + value_im
        value_re = value_re * u + local[0, k].real
        value_im = value_im * u + local[0, k].imag
    slope_re *= per_reach
    slope_im *= per_reach
    for g in range(phases.size):
        phase = phases[g]
        if phase == 0.0:
            continue
        p_re, p_im, dp_re, dp_im = 0.0, 0.0, 0.0, 0.0
        for k in range(size - 1, -1, -1):
            dp_re = dp_re * u + p_re
            dp_im = dp_im * u + p_im
            p_re = p_re * u + local[g + 1, k].real
            p_im = p_im * u + local[g + 1, k].imag
        dp_re *= per_reach
        dp_im *= per_reach
        half = 0.5 * phase * omega
        sine, cosine = np.sin(half), np.cos(half)
        # exp(j omega phase) - 1, and phase times exp(j omega phase).
        change_re, change_im = -2.0 * sine * sine, 2.0 * sine * cosine
        turn_re, turn_im = phase * (1.0 + change_re), phase * change_im
        value_re += p_re * change_re - p_im * change_im
        value_im += p_re * change_im + p_im * change_re
        slope_re += dp_re * change_re - dp_im * change_im - p_re * turn_im - p_im * turn_re
        slope_im += dp_re * change_im + dp_im * change_re + p_re * turn_re - p_im * turn_im
    return complex(value_re, value_im), complex(slope_re, slope_im)


@njit()
def tangent_distance(value: complex, slope: complex, step: float) -> float:
    """Smallest distance from zero of the tangent over a step."""
    speed = slope.real * slope.real + slope.imag * slope.imag
    approach = -(value.real * slope.real + value.imag * slope.imag)
    place = 0.0
    if approach > 0.0:
        place = step if approach >= speed * step else approach / speed
    return abs(value + place * slope)


@njit()
def bound_at(bound: FloatArray, piece: Piece, omega: float) -> float:
    """Value of a bound that is a polynomial in u."""
    return float(real_horner(bound, (omega - piece.start) * piece.per_reach))


@njit()
def rounding_bound(piece: Piece, rounding: float) -> FloatArray:
    """Polynomial in u that bounds the rounding error of an exponential sum in a piece.

    A group counts with |phase| omega. This bounds |exp(j omega phase) - 1|, and by as much the
    rounding of the angle omega phase moves it. No coefficient is negative.
    """
    sizes = piece.sizes
    groups, size = sizes.shape
    bound = np.zeros(size + 1)
    for k in range(size):
        bound[k] += rounding * EPSILON * sizes[0, k]
        for g in range(1, groups):
            error = rounding * EPSILON * sizes[g, k] * abs(piece.phases[g - 1])
            bound[k] += error * piece.start
            bound[k + 1] += error / piece.per_reach
    return bound


@njit()
def curvature_bound(piece: Piece) -> FloatArray:
    """Polynomial in u that bounds the second derivative of an exponential sum in a piece.

    None of its coefficients is negative: its value at the end of a step bounds the whole step.
    Where a polynomial is differentiated twice, |exp(j omega phase) - 1| is at most
    min(|phase| start, 2) + |phase| reach u.
    """
    per_reach, local, phases = piece.per_reach, piece.local, piece.phases
    groups, size = local.shape
    bound = np.zeros(size)
    for k in range(2, size):
        bound[k - 2] += abs(local[0, k]) * k * (k - 1.0) * per_reach**2
    for g in range(1, groups):
        phase = abs(phases[g - 1])
        begun = min(phase * piece.start, 2.0)
        for k in range(size):
            magnitude = abs(local[g, k])
            bound[k] += magnitude * phase * phase
            if k >= 1:
                bound[k - 1] += magnitude * phase * (2.0 * k + k * (k - 1.0)) * per_reach
            if k >= 2:
                bound[k - 2] += magnitude * begun * k * (k - 1.0) * per_reach**2
    return bound


@njit()
def curvature_from_zero(piece: Piece) -> FloatArray:
    """Bound the second derivative of an imaginary part, in a piece that starts at omega = 0.

    A polynomial in u. With c = a + j b, Im[c (exp(j x) - 1)] = a sin x + b (cos x - 1), where
    |sin x| <= x and 1 - cos x <= x^2 / 2: next to zero, where the real part may be larger by
    orders of magnitude, this bound vanishes with the imaginary part.
    """
    per_reach, local = piece.per_reach, piece.local
    groups, size = local.shape
    bound = np.zeros(size + 2)
    for k in range(2, size):
        bound[k - 2] += abs(local[0, k].imag) * k * (k - 1.0)
    for g in range(1, groups):
        turn = abs(piece.phases[g - 1]) / per_reach
        for k in range(size):
            a, b = abs(local[g, k].real), abs(local[g, k].imag)
            if k >= 1:
                bound[k - 1] += a * turn * k * (k + 1.0)
            bound[k + 1] += a * turn**3
            bound[k] += b * turn**2 * (0.5 * k * (k - 1.0) + 2.0 * k + 1.0)
    return bound * per_reach**2
