"""A rational function of s as a state space in samples, kept exact until the last rounding.

Poles at 1e-6 rad/s lie 1e-8 from z = 1 at 200 Hz, where polynomials in z say nothing any
more. So the factors are kept: a cascade of first-order sections (second-order ones for
complex pairs only), between which the inputs enter, is put together in rational numbers,
made discrete in rational numbers, and rounded once. What is rounded are the *changes* from
one sample to the next, of the size of pole times step, and not numbers close to one.

The discretization is the trapezoidal rule, s -> (2 / T) (z - 1) / (z + 1), known as
Tustin's or the bilinear map. It takes the left half-plane into the unit disc and s = 0 to
z = 1, so that it adds no instability and keeps behaviour at rest; and the frequency response
at omega is the continuous one at (2 / T) tan(omega T / 2), see `warped`. It is implicit:
the present output depends on the present input.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, positive_number, real_array

#: Numbers in the form that compiled functions keep in registers.
Row = tuple[float, ...]

# A signal as a linear form: coefficients of the states so far, and of the inputs.
_Form = tuple[list[Fraction], list[Fraction]]


class SampledSystem(NamedTuple):
    """State space w[n+1] = w[n] + change w[n] + drive u[n], y = output w + direct u.

    Attributes
    ----------
    change : float array, shape (states, states)
        Block lower triangular.
    drive : float array, shape (states, inputs)
        How the inputs enter.
    output : float array, shape (states,)
        How the states make the output.
    direct : float array, shape (inputs,)
        The share of the present input in the present output.
    """

    change: FloatArray
    drive: FloatArray
    output: FloatArray
    direct: FloatArray


class RealSystem(NamedTuple):
    """State space x' = A x + B u, y = C x + D u, in rational numbers."""

    A: list[list[Fraction]]
    B: list[list[Fraction]]
    C: list[Fraction]
    D: list[Fraction]

    def as_floats(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the four matrices, rounded."""
        n, inputs = len(self.A), len(self.D)
        return (
            np.array(self.A, dtype=float).reshape(n, n),
            np.array(self.B, dtype=float).reshape(n, inputs),
            np.array(self.C, dtype=float),
            np.array(self.D, dtype=float),
        )


def floats(values: FloatArray) -> Row:
    """Return an array's values, row by row, as a flat tuple."""
    return tuple(float(value) for value in values.flat)


def checked_frequency(name: str, value: npt.ArrayLike, highest: float, unit: str) -> FloatArray:
    """Return frequencies from zero up to a highest one, which rounding may exceed.

    Parameters
    ----------
    name : str
        What messages call them.
    value : array_like of float
        The frequencies.
    highest : float
        The last one that makes sense; it may be infinite.
    unit : str
        Of both, for messages.

    Returns
    -------
    float array, shaped like `value`

    Raises
    ------
    TypeError, ValueError
        If one is not real and finite, negative, or too high.
    """
    frequency = real_array(name, value)
    for wrong in frequency[(frequency < 0.0) | (frequency > highest * (1.0 + 1e-12))]:
        end = (
            ""
            if math.isinf(highest)
            else f" and at most {highest} {unit}, half the sample rate"
        )
        raise ValueError(f"{name} must not be negative{end}, got {wrong}")
    return np.asarray(np.minimum(frequency, highest))


def warped(omega: npt.ArrayLike, sample_rate: float) -> FloatArray:
    r"""Frequency at which a continuous system responds as the sampled one does at `omega`.

    With the sampling step T it is

    .. math::

        \Omega = \frac{2}{T} \tan \frac{\omega T}{2} .

    Parameters
    ----------
    omega : array_like of float
        In rad/s, from zero up to pi times the sample rate, where the result is infinite but
        for rounding.
    sample_rate : float
        In Hz.

    Returns
    -------
    float array, shaped like `omega`
        In rad/s.

    Raises
    ------
    TypeError, ValueError
        If a frequency is not finite and real, negative, or above half the sample rate.
    """
    rate = positive_number("sample_rate", sample_rate)
    omega = checked_frequency("omega", omega, math.pi * rate, "rad/s")
    # Rounding must not carry the tangent beyond its pole.
    return np.asarray(2.0 * rate * np.tan(np.minimum(0.5 * omega / rate, 0.5 * math.pi)))


class _Cascade:
    """A chain of sections, the inputs entering between them."""

    def __init__(self, inputs: int) -> None:
        self.inputs = inputs
        self.A: list[list[Fraction]] = []
        self.B: list[list[Fraction]] = []

    def nothing(self) -> _Form:
        return [Fraction(0)] * len(self.A), [Fraction(0)] * self.inputs

    def state(self, index: int) -> _Form:
        states, inputs = self.nothing()
        states[index] = Fraction(1)
        return states, inputs

    def mixed(self, *terms: tuple[Fraction, _Form]) -> _Form:
        """Return a sum of signals, each with its weight."""
        states, inputs = self.nothing()
        for weight, (some, entering) in terms:
            for k, value in enumerate(some):
                states[k] += weight * value
            for k, value in enumerate(entering):
                inputs[k] += weight * value
        return states, inputs

    def add(self, *rates: _Form) -> None:
        """Append states with these derivatives, given over the enlarged state."""
        self.A += [list(states) for states, _ in rates]
        self.B += [list(inputs) for _, inputs in rates]
        for row in self.A:
            row += [Fraction(0)] * (len(self.A) - len(row))

    def low_pass(self, factor: complex, carry: _Form, slope: list[Fraction]) -> _Form:
        """Append 1 / (s - p), or 1 / |s - p|^2 for a pair, driven by `carry`.

        For a pair the inputs may enter multiplied by s - Re p too, with weights `slope`.
        """
        sigma, omega = Fraction(factor.real), Fraction(factor.imag)
        new = len(self.A)
        if omega == 0:
            self.add(self._widened(carry, {new: sigma}))
            return self.state(new)
        # x1 = (s - sigma) v / q and x2 = v / q: two equal sections where omega vanishes.
        self.add(
            self._widened(carry, {new: sigma, new + 1: -omega * omega}),
            self._widened(([], slope), {new: Fraction(1), new + 1: sigma}),
        )
        return self.state(new + 1)

    def _widened(self, form: _Form, extra: dict[int, Fraction]) -> _Form:
        states = form[0] + [Fraction(0)] * (max(extra) + 1 - len(form[0]))
        for index, value in extra.items():
            states[index] += value
        return states, list(form[1])


def _quadratic(factor: complex) -> list[Fraction]:
    """Return s - p, or |s - p|^2 for a complex one, ascending."""
    sigma, omega = Fraction(factor.real), Fraction(factor.imag)
    if omega == 0:
        return [-sigma, Fraction(1)]
    return [sigma * sigma + omega * omega, -2 * sigma, Fraction(1)]


def _divided(p: list[Fraction], q: list[Fraction]) -> tuple[list[Fraction], list[Fraction]]:
    """Return quotient and remainder of polynomials, the divisor with leading coefficient 1."""
    remainder, degree = list(p), len(q) - 1
    quotient = [Fraction(0)] * max(len(p) - degree, 0)
    for k in range(len(quotient) - 1, -1, -1):
        quotient[k] = remainder[k + degree]
        for i, value in enumerate(q):
            remainder[k + i] -= quotient[k] * value
    remainder = remainder[:degree]
    return quotient, remainder + [Fraction(0)] * (degree - len(remainder))


def _times(p: list[Fraction], q: list[Fraction]) -> list[Fraction]:
    product = [Fraction(0)] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for k, b in enumerate(q):
            product[i + k] += a * b
    return product


def _single(roots: Sequence[complex]) -> list[complex]:
    """Return real roots and the upper one of each pair, largest magnitude first."""
    chosen = [complex(root) for root in roots if complex(root).imag >= 0.0]
    return sorted(chosen, key=abs, reverse=True)


def _order(roots: Sequence[complex]) -> int:
    return sum(2 if root.imag else 1 for root in roots)


def real_system(
    zeros: Sequence[complex],
    poles: Sequence[complex],
    gain: float,
    numerators: Sequence[Sequence[float]] = ((1.0,),),
    denominator: Sequence[float] = (1.0,),
) -> RealSystem:
    r"""Realize gain prod(s - zeros) / prod(s - poles) times numerators over denominator.

    From input k to the output that is, with the numerators n_k and the denominator d,

    .. math::

        g\, \frac{\prod_i (s - z_i)}{\prod_i (s - p_i)}\, \frac{n_k(s)}{d(s)} .

    Parameters
    ----------
    zeros, poles : sequence of complex
        In rad/s; complex ones in conjugate pairs.
    gain : float
        Factor in front.
    numerators : sequence of polynomials
        One for each input, ascending powers of s.
    denominator : sequence of float
        Shared by all inputs, ascending powers of s.

    Returns
    -------
    RealSystem
        Of one output. Factors s that all numerators share with the denominators drop out.

    Raises
    ------
    ValueError
        If there are more zeros than poles.

    Notes
    -----
    Polynomials are divided by the factors of the denominator one after the other; what
    remains is the weight with which an input enters between two sections. Nothing is
    expanded in partial fractions, and poles may repeat.
    """
    above = [[Fraction(float(c)) for c in numerator] for numerator in numerators]
    below = np.trim_zeros(np.asarray(denominator, dtype=float), "b")
    scale = Fraction(float(gain)) / Fraction(float(below[-1]))
    at_zero = int(np.flatnonzero(below)[0])
    left_zeros = _single(list(zeros))
    left_poles = _single(poles)
    roots = _single(list(np.roots(below[at_zero:][::-1]))) + [0j] * at_zero
    for shared in (roots, left_poles):
        while 0j in shared:
            if 0j in left_zeros:
                left_zeros.remove(0j)
            elif all(p[0] == 0 for p in above):
                above = [p[1:] or [Fraction(0)] for p in above]
            else:
                break
            shared.remove(0j)
    above = [[scale * c for c in p] for p in above]
    # Poles of the controller join the sensor's until its part is proper; zeros do so where
    # the controller's own poles leave no room for them.
    taken: list[complex] = []
    while True:
        degree = max((k for p in above for k, c in enumerate(p) if c), default=0)
        by_size = sorted(left_poles, key=lambda pole: (pole.imag == 0.0, -abs(pole)))
        while _order(roots) + _order(taken) < degree and by_size:
            taken.append(by_size.pop())
            left_poles.remove(taken[-1])
        pairs = [zero for zero in left_zeros if zero.imag]
        single = [zero for zero in left_zeros if not zero.imag]
        if len(pairs) > sum(1 for pole in left_poles if pole.imag):
            zero = pairs[-1]
        elif _order(left_zeros) > _order(left_poles):
            zero = (single or pairs)[-1]
        else:
            break
        left_zeros.remove(zero)
        above = [_times(p, _quadratic(zero)) for p in above]
    factors = roots + taken
    return _assembled(above, factors, left_zeros, left_poles)


def _assembled(
    above: list[list[Fraction]],
    factors: list[complex],
    zeros: list[complex],
    poles: list[complex],
) -> RealSystem:
    """Chain the sections: those of `factors` with the inputs between, then zeros over poles."""
    inputs = len(above)
    chain = _Cascade(inputs)
    carry = chain.nothing()
    for factor in factors:
        q = _quadratic(factor)
        parts = [_divided(p, q) for p in above]
        above = [quotient for quotient, _ in parts]
        rests = [rest for _, rest in parts]
        slope = [rest[1] if len(rest) > 1 else Fraction(0) for rest in rests]
        sigma = Fraction(factor.real)
        entering = [rest[0] + sigma * c for rest, c in zip(rests, slope, strict=True)]
        if len(q) == 2:
            entering = [rest[0] for rest in rests]
        driven = chain.mixed((Fraction(1), carry), (Fraction(1), ([], entering)))
        carry = chain.low_pass(factor, driven, slope)
    if any(c for p in above for c in p[1:]):
        raise ValueError("the system must be proper, got more zeros than poles")
    direct = [p[0] if p else Fraction(0) for p in above]
    carry = chain.mixed((Fraction(1), carry), (Fraction(1), ([], direct)))
    for pole in poles:
        carry = _section(chain, carry, pole, zeros)
    return RealSystem(chain.A, chain.B, carry[0], carry[1])


def _section(chain: _Cascade, carry: _Form, pole: complex, zeros: list[complex]) -> _Form:
    """Append one section of the controller, with as many of the zeros as it has room for."""
    room = _order([pole])
    above = [Fraction(1)]
    # The nearest zeros, so that a section changes little; pairs first, for they need pairs.
    for zero in sorted(zeros, key=lambda root: (root.imag == 0.0, abs(root - pole))):
        if len(above) - 1 + _order([zero]) <= room:
            above = _times(above, _quadratic(zero))
            zeros.remove(zero)
    whole, rest = _divided(above, _quadratic(pole))
    new = len(chain.A)
    low = chain.low_pass(pole, carry, [Fraction(0)] * chain.inputs)
    terms = [(whole[0] if whole else Fraction(0), carry)]
    if room == 1:
        terms.append((rest[0], low))
    else:
        sigma = Fraction(pole.real)
        terms += [(rest[1], chain.state(new)), (rest[0] + sigma * rest[1], low)]
    return chain.mixed(*terms)


def _solved(matrix: list[list[Fraction]], right: list[list[Fraction]]) -> list[list[Fraction]]:
    """Solve matrix X = right exactly, by elimination."""
    n = len(matrix)
    rows = [list(a) + list(b) for a, b in zip(matrix, right, strict=True)]
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k]), None)
        if pivot is None:
            raise ValueError("sample_rate meets a pole at twice its value in rad/s")
        rows[k], rows[pivot] = rows[pivot], rows[k]
        head = rows[k][k]
        rows[k] = [value / head for value in rows[k]]
        for i in range(n):
            if i != k and rows[i][k]:
                weight = rows[i][k]
                rows[i] = [a - weight * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[n:] for row in rows]


def sample(system: RealSystem, sample_rate: float) -> SampledSystem:
    r"""Apply the trapezoidal rule.

    With the step T and

    .. math::

        Q = \left( I - \tfrac{T}{2} A \right)^{-1}

    the result has

    .. math::

        \text{change} &= T A\, Q , & \text{drive} &= T\, Q B , \\
        \text{output} &= C\, Q , & \text{direct} &= D + \tfrac{T}{2}\, C\, Q B .

    Parameters
    ----------
    system : RealSystem
        In continuous time.
    sample_rate : float
        In Hz.

    Returns
    -------
    SampledSystem
        Its state is w[n] = (I - A T / 2) x[n] - B u[n] T / 2.
    """
    step = 1 / Fraction(positive_number("sample_rate", sample_rate))
    A, B, C, D = system
    n, inputs = len(A), len(D)
    unit = [[Fraction(int(i == k)) for k in range(n)] for i in range(n)]
    implicit = [[unit[i][k] - step / 2 * A[i][k] for k in range(n)] for i in range(n)]
    # R = (I - A T / 2)^-1, and R B next to it.
    solved = _solved(implicit, [unit[i] + B[i] for i in range(n)])
    R = [row[:n] for row in solved]
    RB = [row[n:] for row in solved]
    change = [
        [step * sum((A[i][m] * R[m][k] for m in range(n)), Fraction(0)) for k in range(n)]
        for i in range(n)
    ]
    drive = [[step * value for value in row] for row in RB]
    output = [sum((C[m] * R[m][k] for m in range(n)), Fraction(0)) for k in range(n)]
    direct = [
        D[k] + step / 2 * sum((C[m] * RB[m][k] for m in range(n)), Fraction(0))
        for k in range(inputs)
    ]
    return SampledSystem(
        np.array(change, dtype=float).reshape(n, n),
        np.array(drive, dtype=float).reshape(n, inputs),
        np.array(output, dtype=float),
        np.array(direct, dtype=float),
    )
