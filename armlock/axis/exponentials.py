"""Polynomials times exponentials on the imaginary axis, with bounds on all that is uncertain.

D, its terms and their products are exponential sums at s = j omega,

    f(omega) = sum_k sums_k p_k + sum_g sum_k weights_gk p_k (exp(j omega phase_g) - 1)

with polynomials p_k of s. Polynomials of low degree are one expansion in powers of omega.
Those of high degree are expanded anew in each *piece* of the axis, from their roots: over many
decades of frequency one expansion would lose its digits.

Within a piece a sum has a value and a derivative, a bound on its second derivative, and a
bound on its rounding error. The walks along the axis need no more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, NamedTuple

import mpmath
import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.axis.compiled import njit
from armlock.checks import ComplexArray, FloatArray, IntArray

EPSILON = 2.0**-52
#: Up to this degree a polynomial is evaluated from its coefficients, beyond from its roots.
LOW_DEGREE = 20
# The rounding error of a value is at most ROUNDING EPSILON times the sum of magnitudes. Where D
# is no larger on the axis, a point is a boundary point, and its count -1.
ROUNDING = 8.0
# How many roots of a polynomial, each weighed by reach / (reach + distance), a piece may have
# around it. Roots exactly at its start are not counted. Then LOW_DEGREE powers hold the
# polynomial to rounding.
_CROWD = 1.5


def quotients(
    zeros: ComplexArray, poles: ComplexArray, lead: float, s: ComplexArray
) -> ComplexArray:
    """Evaluate `lead` times the product of s - zeros over that of s - poles, at any s."""
    found: ComplexArray = _quotients(zeros, poles, complex(lead), np.ravel(s))
    return found.reshape(s.shape)


@njit(cache=True, error_model="numpy")
def _quotients(
    zeros: ComplexArray, poles: ComplexArray, lead: complex, s: ComplexArray
) -> ComplexArray:
    found = np.full(s.size, lead)
    for i in range(s.size):
        # In turn, so that the product neither overflows nor underflows on the way.
        for k in range(max(zeros.size, poles.size)):
            if k < zeros.size:
                found[i] *= s[i] - zeros[k]
            if k < poles.size:
                found[i] /= s[i] - poles[k]
    return found


class Polynomial(NamedTuple):
    """A real polynomial of s: its coefficients in ascending powers, and its roots.

    A product also has the highest coefficients of its factors: their product may be no float.
    `factored` says which of coefficients and roots were computed from the other: the roots, or,
    of a product of known factors, the coefficients. Next to a cluster of roots the two differ.
    """

    coefficients: FloatArray
    roots: ComplexArray
    leads: tuple[float, ...] = ()
    factored: bool = False

    @classmethod
    def of(cls, coefficients: FloatArray, known: ComplexArray | None = None) -> Polynomial:
        """Return the polynomial with these coefficients, and these roots if they are known.

        Known roots are kept if they give these coefficients to a part in a million. If not,
        roots are found in double precision, and if those fail the test, in extended precision.
        """
        if known is not None and _are_roots(known, coefficients):
            return cls(coefficients, known)
        roots = poly.polyroots(coefficients).astype(np.complex128)
        if _are_roots(roots, coefficients):
            return cls(coefficients, roots)
        start = {"asc": True, "roots_init": roots.tolist()}
        with mpmath.workdps(60):
            try:
                found = mpmath.polyroots(
                    coefficients.tolist(), maxsteps=500, extraprec=400, **start
                )
            except mpmath.libmp.NoConvergence:
                raise ValueError(
                    f"no roots of the polynomial {coefficients} are found"
                ) from None
        return cls(coefficients, np.array([complex(root) for root in found]))

    def with_slope(self, z: Any, number: Callable[[complex], Any] = complex) -> tuple[Any, Any]:
        """Evaluate p and its derivative from what is exact, as another kind of number."""
        if not self.factored:
            p = self.coefficients
            return poly.polyval(z, p), poly.polyval(z, poly.polyder(p))
        value, slope = 0.0 * z + float(self.coefficients[-1]), 0.0 * z
        for root in self.roots.tolist():
            away = z - number(root)
            value, slope = value * away, slope * away + value
        return value, slope

    def over(self, other: Polynomial, s: ComplexArray) -> ComplexArray:
        """Evaluate p(s) / q(s), factor by factor."""
        lead = float(self.coefficients[-1] / other.coefficients[-1])
        return quotients(self.roots, other.roots, lead, s)

    def times_conjugate(self, other: Polynomial) -> Polynomial:
        """Return p q*, where q*(j omega) is the complex conjugate of q(j omega)."""
        # The coefficients are real: q*(s) = q(-s).
        signs = (-1.0) ** np.arange(other.coefficients.size)
        with np.errstate(over="ignore", invalid="ignore"):
            product = np.convolve(self.coefficients, signs * other.coefficients)
        leads = self.coefficients[-1], signs[-1] * other.coefficients[-1]
        return Polynomial(product, np.concatenate((self.roots, -other.roots)), leads)


def _are_roots(roots: ComplexArray, coefficients: FloatArray) -> bool:
    """Whether a polynomial of these roots has these coefficients, to a part in a million."""
    product = np.array(coefficients[-1:], dtype=np.complex128)
    magnitude = np.abs(coefficients[-1:])
    for root in roots[np.argsort(np.abs(roots))]:
        product = np.convolve(product, [-root, 1.0])
        magnitude = np.convolve(magnitude, [abs(root), 1.0])
    return bool((np.abs(product - coefficients) <= 1e-6 * magnitude).all())


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

    def turned(self) -> ExponentialSum:
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
        polynomials = CompiledPolynomials(
            whole if degree <= LOW_DEGREE and _in_range(whole) else whole[:0],
            np.concatenate([p.roots for p in self.polynomials]),
            np.cumsum([0, *(p.roots.size for p in self.polynomials)]),
            np.array([mantissas.prod() for mantissas, _ in leads]),
            np.array([int(exponents.sum()) for _, exponents in leads]),
        )
        return CompiledSum(polynomials, self.weights, self.sums, self.phases)


class CompiledPolynomials(NamedTuple):
    """Some polynomials as compiled functions take them.

    Attributes
    ----------
    coefficients : complex array, shape (k, degree + 1)
        In powers of omega. It has no rows if a degree exceeds `LOW_DEGREE` or products would
        leave the range of floats. Then the roots are used.
    roots : complex array
        Those of all polynomials, one polynomial after the other.
    starts : int array, shape (k + 1,)
        The index of each polynomial's first root, and the number of all roots.
    leads, exponents : float and int array, shape (k,)
        Highest coefficients, over powers of two; and the exponents of these.
    """

    coefficients: ComplexArray
    roots: ComplexArray
    starts: IntArray
    leads: FloatArray
    exponents: IntArray


class CompiledSum(NamedTuple):
    """An exponential sum as compiled functions take it.

    Attributes
    ----------
    polynomials : CompiledPolynomials
        The polynomials.
    weights, sums, phases : arrays
        Those of `ExponentialSum`.
    """

    polynomials: CompiledPolynomials
    weights: npt.NDArray[Any]
    sums: npt.NDArray[Any]
    phases: FloatArray


def aligned(*sums: ExponentialSum) -> tuple[ExponentialSum, ...]:
    """Give sums of the same polynomials the same phases. Missing ones get a weight of zero."""
    nothing = reduce(ExponentialSum.plus, [whole.scaled(0.0) for whole in sums])
    return tuple(nothing.plus(whole) for whole in sums)


def _in_range(values: ComplexArray) -> bool:
    """Whether products of four such values are floats, zeros left out."""
    sizes = np.abs(values[values != 0.0])
    return bool(((sizes > 1e-70) & (sizes < 1e70)).all())


def without_unused(*sums: ExponentialSum) -> tuple[ExponentialSum, ...]:
    """Return sums of the same polynomials without those that have no weight in any of them."""
    used = np.any([np.any(s.weights, axis=0) | (s.sums != 0.0) for s in sums], axis=0)
    polynomials = tuple(p for p, kept in zip(sums[0].polynomials, used, strict=True) if kept)
    # Not s.weights[:, used]: its rows would lie the other way, for which all is compiled again.
    return tuple(
        ExponentialSum(polynomials, s.weights.compress(used, axis=1), s.phases, s.sums[used])
        for s in sums
    )


@njit(cache=True)
def real_horner(p: FloatArray, u: float) -> float:
    """Value of a real polynomial with ascending coefficients."""
    value = 0.0
    for k in range(p.size - 1, -1, -1):
        value = value * u + p[k]
    return value


@njit(cache=True)
def _from_roots(
    polynomials: CompiledPolynomials, omega: float, reach: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Expand polynomials about j omega, in powers of u = (change of omega) / reach.

    All are divided by one power of two, so that the largest is about one. Returns the
    coefficients and their magnitudes, shape (k, LOW_DEGREE + 1), and bounds on what the higher
    powers add up to where 0 <= u <= 1. The magnitudes count the roots, since each
    multiplication rounds.
    """
    _, roots, starts, leads, exponents = polynomials
    size, exponents = LOW_DEGREE + 1, exponents.copy()
    found = np.zeros((leads.size, size), dtype=np.complex128)
    sizes = np.zeros((leads.size, size))
    left_out = np.zeros(leads.size)
    largest = -(1 << 60)
    for k in range(leads.size):
        found[k, 0], sizes[k, 0], total = leads[k], abs(leads[k]), abs(leads[k])
        degree = 0
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
            degree += 1
            for m in range(min(degree, size - 1), 0, -1):
                found[k, m] = scale * (away * found[k, m] + 1j * reach * found[k, m - 1])
                sizes[k, m] = scale * (distance * sizes[k, m] + reach * sizes[k, m - 1])
            found[k, 0] *= scale * away
            sizes[k, 0] *= scale * distance
        left_out[k] = max(total - sizes[k].sum(), 0.0) + degree * EPSILON * total
        sizes[k] *= 1.0 + 0.5 * degree
        if total > 0.0:
            largest = max(largest, exponents[k] + int(np.floor(np.log2(total))))
    for k in range(leads.size):
        scale = 2.0 ** min(max(exponents[k] - largest, -1000), 1000)
        found[k] *= scale
        sizes[k] *= scale
        left_out[k] *= scale
    return found, sizes, left_out


@njit(cache=True)
def _reach(roots: ComplexArray, starts: IntArray, omega: float) -> float:
    """How far from omega the expansion of `_from_roots` is accurate, at most 1e300.

    Around each polynomial the crowd, the sum of reach / (reach + distance), is concave in the
    reach: Newton's method from below never passes the length at which it is _CROWD.
    """
    shortest = 1e300
    for k in range(starts.size - 1):
        reach = 0.0
        for _ in range(6):
            crowd, rate = 0.0, 0.0
            for root in roots[starts[k] : starts[k + 1]]:
                distance = abs(1j * omega - root)
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

    Of polynomials of low degree the whole axis is one piece, with u = omega. In any other piece
    u goes from 0 to 1, and `per_reach` is one over its length.

    Attributes
    ----------
    start, end : float
        In rad/s.
    per_reach : float
        In s/rad.
    local : complex array, shape (1 + groups, n)
        The coefficients of the sum, then of each group.
    sizes : float array, shape (1 + groups, n + 1)
        Magnitudes for rounding. The last column bounds the powers that are left out, over
        EPSILON: `rounding_bound` multiplies all by EPSILON and more.
    phases : float array, shape (groups,)
        Those of the sum.
    """

    start: float
    end: float
    per_reach: float
    local: ComplexArray
    sizes: FloatArray
    phases: FloatArray


@njit(cache=True)
def expand(whole: CompiledSum, omega: float, uncertain: FloatArray | None = None) -> Piece:
    """Expand an exponential sum over the piece of the axis that starts at omega.

    `uncertain` holds how far the entries of `sums` may be off. The magnitudes contain it.
    """
    polynomials, weights, sums, phases = whole
    coefficients = polynomials.coefficients
    reach, expanded = 1.0, coefficients.shape[0] == 0
    magnitudes, left_out = np.abs(coefficients), np.zeros(coefficients.shape[0])
    if expanded:
        # Next to a root of high order on the axis it would be no step at all.
        reach = max(_reach(polynomials.roots, polynomials.starts, omega), 4.0 * EPSILON * omega)
        coefficients, magnitudes, left_out = _from_roots(polynomials, omega, reach)
    number, size = coefficients.shape
    groups = weights.shape[0]
    local = np.zeros((1 + groups, size), dtype=np.complex128)
    sizes = np.zeros((1 + groups, size + 1))
    for g in range(1 + groups):
        for k in range(number):
            weight = sums[k] if g == 0 else weights[g - 1, k]
            magnitude = abs(weight)
            if g == 0 and uncertain is not None:
                magnitude += uncertain[k] / (ROUNDING * EPSILON)
            if magnitude != 0.0:
                for m in range(size):
                    local[g, m] += weight * coefficients[k, m]
                    sizes[g, m] += magnitude * magnitudes[k, m]
                sizes[g, size] += magnitude * left_out[k] / EPSILON
    if not expanded:
        return Piece(0.0, np.inf, 1.0, local, sizes, phases)
    # Powers that rounding hides are not worth their time.
    powers = sizes[:, :size].sum(axis=0)
    used, dropped, hidden = size, powers[size - 1], 1e-3 * EPSILON * powers.sum()
    while used > 1 and dropped <= hidden:
        used -= 1
        dropped += powers[used - 1]
    sizes[:, used] = sizes[:, size] + sizes[:, used:size].sum(axis=1) / EPSILON
    local, sizes = local[:, :used].copy(), sizes[:, : used + 1].copy()
    return Piece(omega, omega + reach, 1.0 / reach, local, sizes, phases)


@njit(cache=True)
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


@njit(cache=True)
def tangent_distance(value: complex, slope: complex, step: float) -> float:
    """Smallest distance from zero of the tangent over a step."""
    speed = slope.real * slope.real + slope.imag * slope.imag
    approach = -(value.real * slope.real + value.imag * slope.imag)
    place = 0.0
    if approach > 0.0:
        place = step if approach >= speed * step else approach / speed
    return abs(value + place * slope)


@njit(cache=True)
def bound_at(bound: FloatArray, piece: Piece, omega: float) -> float:
    """Value of a bound that is a polynomial in u."""
    return float(real_horner(bound, (omega - piece.start) * piece.per_reach))


@njit(cache=True)
def curvature_bound(piece: Piece) -> FloatArray:
    """Polynomial in u that bounds the second derivative of an exponential sum in a piece.

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


@njit(cache=True)
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


@njit(cache=True)
def rounding_bound(piece: Piece, rounding: float) -> FloatArray:
    """Polynomial in u that bounds the rounding error of an exponential sum in a piece.

    A group counts with |phase| omega, which bounds |exp(j omega phase) - 1|.
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
