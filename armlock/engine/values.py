"""Values of quotients of functions at any s, in double precision.

    F(s) = sum_j p_j(s) [S_j + sum_k W_jk (exp(-s theta_k) - 1)]

No polynomial is multiplied out: each is the product of its factors, and factors that all p_j of
a sum have stand in front of the sum. So nothing cancels but the terms of a sum. Where they
cancel to more than some digits, the value is computed again with python-flint's balls, of as
many bits as it takes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import reduce
from itertools import zip_longest
from operator import and_
from typing import Any

import flint
import numpy as np
from flint import acb, fmpq

from armlock.checks import ComplexArray, FloatArray
from armlock.engine.functions import Exact, Function, Space, limit_at_zero
from armlock.engine.polynomials import rounded
from armlock.engine.tolerances import EPSILON

# So many values at once stay in a processor's cache, which takes half the time.
_BLOCK = 1 << 13
# Where the terms of a sum are larger than the sum by this factor, it is computed with balls: of
# so many bits at first, and at most, until so many of them are known.
_MAY_LOSE, _FEWEST_BITS, _MOST_BITS, _ENOUGH_BITS = 2.0**11, 128, 1 << 14, 60
# Factor that splits a number in two halves.
_SPLIT = 2.0**27 + 1.0
# Rounding errors of a sum, over the size of its terms.
ROUNDING = 4.0 * EPSILON


class Quotient:
    """N / M, or N where there is no M, as sums of functions of one space times numbers.

    Parameters
    ----------
    n, m : sequences of Function
        What stands before the same numbers in N and in M; no m for N alone.
    """

    def __init__(self, n: Sequence[Function], m: Sequence[Function] = ()) -> None:
        # Weights over the largest of M: those of many fast poles would overflow.
        sizes = [abs(x) for f in m for x in (*f.steady, *f.delayed.ravel())]
        scale = max(sizes, default=fmpq(0)) or fmpq(1)
        space = n[0].space
        self.delays, self.tails = (
            x.tolist() for x in (space.arrays.delays, space.arrays.tails)
        )
        self.above, self.below = _Sum(n, scale), _Sum(m, scale) if m else None
        over = self.below.common if self.below else Counter()
        # Factors that N and M share are left out.
        zeros, poles = self.above.common - over, over - self.above.common
        self.factors = _Factors(zeros, poles, space)

    @np.errstate(all="ignore")
    def at(
        self,
        s: ComplexArray,
        numbers: Sequence[Any],
        exactly: Callable[[int], tuple[Function, Function]],
    ) -> tuple[ComplexArray, FloatArray]:
        """Evaluate, and bound what rounding makes of the values.

        Parameters
        ----------
        s : complex array, shape (size,)
            In rad/s. At s = 0 the limit of a quotient is returned.
        numbers : sequence of float, or of float arrays of shape (size,)
            One for each function.
        exactly : callable
            What returns N and M at one of these s as functions.

        Returns
        -------
        values : complex array, shape (size,)
            inf at a pole.
        errors : float array, shape (size,)
            Of the values.
        """
        found, off = np.empty(s.shape, np.complex128), np.full(s.shape, np.nan)
        if s.size == 1:
            # Python's own numbers are much faster than arrays; they raise at a pole.
            xs = [x.item() if isinstance(x, np.ndarray) else x for x in numbers]
            with suppress(ArithmeticError):
                found[0], off[0] = self.roughly(s.item(), xs)
        else:
            for first in range(0, s.size, _BLOCK):
                k = slice(first, first + _BLOCK)
                xs = [x[k] if isinstance(x, np.ndarray) else x for x in numbers]
                found[k], off[k] = self.roughly(s[k], xs)
        if self.below:
            off[s == 0.0] = np.nan
        errors = ROUNDING * off * np.abs(found)
        for i in np.flatnonzero(~(np.isfinite(found) & (off <= _MAY_LOSE))):
            found[i] = _in_balls(complex(s[i]), *exactly(int(i)), bool(self.below))
            errors[i] = EPSILON * abs(found[i])
        return found, errors

    def roughly(self, s: Any, numbers: Sequence[Any]) -> tuple[Any, Any]:
        """Return values, and how many times their size rounding errors are, in `ROUNDING`.

        Of one complex number with numbers, or of an array.
        """
        turns = [turned(s, *delay) for delay in zip(self.delays, self.tails, strict=True)]
        sizes = [abs(turn) for turn in turns]
        top, off = self.above.at(s, numbers, turns, sizes)
        front, more = self.factors.at(s)
        value, off = front * top, off + more
        if self.below:
            bottom, more = self.below.at(s, numbers, turns, sizes)
            value, off = value / bottom, off + more
        return value, off


class _Factors:
    """A product of factors s - zero over that of factors s - pole."""

    def __init__(self, zeros: Counter[complex], poles: Counter[complex], space: Space) -> None:
        self.pairs = [
            tuple(root if root is None or root.imag else root.real for root in pair)
            for pair in zip_longest(zeros.elements(), poles.elements())
        ]
        #: Those of the roots that are rounded.
        self.rounded = [
            root
            for root in (zeros + poles).elements()
            if any(root == p.roots[k] for p in space.polynomials for k in p.computed)
        ]
        self.number = (zeros + poles).total()

    def at(self, s: Any) -> tuple[Any, Any]:
        """Return the product at some s, and what rounding makes of it, in its own size."""
        found: Any = 1.0
        # In turn, so that the product neither overflows nor underflows on the way.
        for zero, pole in self.pairs:
            if zero is not None:
                found = found * (s - zero)
            if pole is not None:
                found = found / (s - pole)
        off: Any = self.number
        for root in self.rounded:
            off = off + abs(root) / abs(s - root)
        return found, off


class _Sum:
    """A sum of functions times numbers, over a scale, sorted by polynomials."""

    def __init__(self, functions: Sequence[Function], scale: fmpq) -> None:
        space = functions[0].space
        acting = [
            [(f.steady[j] / scale, f.delayed[j] / scale) for f in functions]
            for j in range(len(space.polynomials))
        ]
        places = [j for j, rows in enumerate(acting) if any(s or w.any() for s, w in rows)]
        roots = [Counter(space.polynomials[j].roots) for j in places]
        #: Roots of the factors that all polynomials have.
        self.common: Counter[complex] = reduce(and_, roots, roots[0] if roots else Counter())
        #: For each polynomial its lead, the other factors, and the weights of each function.
        self.terms = [
            (
                float(space.polynomials[j].lead),
                _Factors(own - self.common, Counter(), space),
                [_row(i, *row) for i, row in enumerate(acting[j]) if row[0] or row[1].any()],
            )
            for j, own in zip(places, roots, strict=True)
        ]

    def at(
        self, s: Any, numbers: Sequence[Any], turns: Sequence[Any], sizes: Sequence[Any]
    ) -> tuple[Any, Any]:
        """Return the sum without its common factors, and the size of its terms over it."""
        if not self.terms:
            return 0.0 * s, 0.0
        value, size = 0.0 * s, 0.0
        for lead, factors, rows in self.terms:
            total, most = 0.0, 0.0
            for i, steady, late in rows:
                x = numbers[i]
                if isinstance(x, float) and not x:
                    continue
                here, largest = steady, abs(steady)
                for k, weight in late:
                    here = here + weight * turns[k]
                    largest = largest + abs(weight) * sizes[k]
                total, most = total + x * here, most + abs(x) * largest
            p, off = factors.at(s)
            p = lead * p
            value, size = value + p * total, size + abs(p) * (1.0 + off) * most
        return value, size / abs(value)


def _row(i: int, s: fmpq, w: Exact) -> tuple[int, float, list[tuple[int, float]]]:
    """Return the weights of one function at one polynomial, rounded; of W what is not zero."""
    steady, *late = rounded((s, *w)).tolist()
    return i, steady, [(k, x) for k, x in enumerate(late) if x]


def newton(function: Function) -> Quotient:
    """Return F / F', the step of Newton's method."""
    return Quotient(*([f] for f in function.with_slope()))


def turned(s: Any, theta: float, tail: float) -> Any:
    """Return exp(-s theta) - 1 of a number or an array."""
    product, rest = times(s, theta, tail)
    turn = np.expm1(-product) if isinstance(product, np.ndarray) else _expm1(-product)
    return turn - rest * (1.0 + turn)


def times(s: Any, theta: float, tail: float) -> tuple[Any, Any]:
    """Return s * theta, and what it is short of, of a delay and what that is short of.

    Many turns of a delay are rounded by more than the exponential is: Dekker's product.
    """
    product = theta * s
    high = _SPLIT * theta - (_SPLIT * theta - theta)
    s_high = _SPLIT * s - (_SPLIT * s - s)
    low, s_low = theta - high, s - s_high
    rest = ((high * s_high - product) + high * s_low + low * s_high) + low * s_low
    return product, rest + tail * s


def _expm1(z: complex) -> complex:
    """Return exp(z) - 1, as numpy does."""
    half = math.sin(0.5 * z.imag)
    real = math.expm1(z.real) * math.cos(z.imag) - 2.0 * half * half
    return complex(real, math.exp(z.real) * math.sin(z.imag))


def _in_balls(s: complex, n: Function, m: Function, divided: bool) -> complex:
    """Return N / M at one s with as many bits as the terms cancel; inf at a pole."""
    if s == 0.0 and divided:
        return complex(limit_at_zero(n, m))
    bits, at = _FEWEST_BITS, acb(s.real, s.imag)
    while True:
        with flint.ctx.workprec(bits):
            above, below = n.taylor(at, 1)[0], m.taylor(at, 1)[0] if divided else acb(1)
            found = above / below
        if above == 0 or found.rel_accuracy_bits() > _ENOUGH_BITS:
            return complex(found)
        if bits > _MOST_BITS:
            return complex(found) if not below.contains(0) else complex(np.inf)
        bits *= 2
