"""Values of quotients of functions at any s, in double precision.

    F(s) = sum_j p_j(s) [S_j + sum_k W_jk (exp(-s theta_k) - 1)]

No polynomial is multiplied out: each is the product of its factors, and factors that all p_j of
a sum have stand in front of the sum. So nothing cancels but the terms of a sum. Where they
cancel to more than some digits, the value is computed again with python-flint's balls, of as
many bits as it takes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import reduce
from itertools import zip_longest
from operator import and_
from typing import Any

import flint
import numpy as np
from flint import acb, fmpq

from armlock.checks import ComplexArray, FloatArray
from armlock.engine.functions import Function, Space, limit_at_zero
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
_ROUNDING = 4.0 * EPSILON


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
        self.delays, self.tails = space.arrays.delays[:, None], space.arrays.tails[:, None]
        self.above, self.below = _Sum(n, scale), _Sum(m, scale) if m else None
        over = self.below.common if self.below else Counter()
        # Factors that N and M share are left out.
        zeros, poles = self.above.common - over, over - self.above.common
        self.factors = _Factors(zeros, poles, space)

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
        found, errors = np.empty(s.shape, np.complex128), np.empty(s.shape)
        # Far on the right exp(-s theta) is small: it is summed itself, and not less one.
        far = s.real * self.delays[:1].sum() > 1.0
        for part in (far, ~far):
            places = np.flatnonzero(part)
            for first in range(0, places.size, _BLOCK):
                k = places[first : first + _BLOCK]
                xs = [x[k] if isinstance(x, np.ndarray) else x for x in numbers]
                found[k], errors[k] = self._some(s[k], xs, part is far)
        if self.below:
            errors[s == 0.0] = np.nan
        for i in np.flatnonzero(np.isnan(errors)):
            found[i] = _in_balls(complex(s[i]), *exactly(int(i)), bool(self.below))
            errors[i] = EPSILON * abs(found[i])
        return found, errors

    @np.errstate(all="ignore")
    def _some(
        self, s: ComplexArray, numbers: Sequence[Any], far: bool
    ) -> tuple[ComplexArray, FloatArray]:
        """Return some values, and their errors: nan where balls are needed."""
        turns = turned(s, self.delays, self.tails, far)
        sizes = np.abs(turns)
        top, off = self.above.at(s, numbers, turns, sizes, far)
        front, more = self.factors.at(s)
        value, off = front * top, off + more
        if self.below:
            bottom, more = self.below.at(s, numbers, turns, sizes, far)
            value, off = value / bottom, off + more
        return value, np.where(off <= _MAY_LOSE, _ROUNDING * off * np.abs(value), np.nan)


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

    def at(self, s: ComplexArray) -> tuple[Any, Any]:
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
            off = off + abs(root) / np.abs(s - root)
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
                [
                    (i, *rounded([s, s - w.sum()]).tolist(),
                     [(k, x) for k, x in enumerate(rounded(w).tolist()) if x])
                    for i, (s, w) in enumerate(acting[j]) if s or w.any()
                ],
            )
            for j, own in zip(places, roots, strict=True)
        ]  # fmt: skip

    def at(
        self,
        s: ComplexArray,
        numbers: Sequence[Any],
        turns: ComplexArray,
        sizes: FloatArray,
        far: bool,
    ) -> tuple[Any, Any]:
        """Return the sum without its common factors, and the size of its terms over it."""
        value, size = 0.0, 0.0
        for lead, factors, rows in self.terms:
            total, most = 0.0, 0.0
            for i, steady, still, late in rows:
                x = numbers[i]
                if isinstance(x, float) and not x:
                    continue
                here, largest = still if far else steady, abs(still if far else steady)
                for k, weight in late:
                    here = here + weight * turns[k]
                    largest = largest + abs(weight) * sizes[k]
                total, most = total + x * here, most + np.abs(x) * largest
            p, off = factors.at(s)
            p = lead * p
            value, size = value + p * total, size + np.abs(p) * (1.0 + off) * most
        return value, size / np.abs(value)


def turned(s: ComplexArray, theta: Any, tail: Any, far: bool) -> ComplexArray:
    """Return exp(-s theta), less one unless far, with the digits that s * theta is short of.

    Many turns of a delay are rounded by more than the exponential is: Dekker's product.
    """
    product = theta * s
    high = _SPLIT * theta - (_SPLIT * theta - theta)
    s_high = _SPLIT * s - (_SPLIT * s - s)
    low, s_low = theta - high, s - s_high
    rest = ((high * s_high - product) + high * s_low + low * s_high) + low * s_low
    rest += tail * s
    turn: ComplexArray = np.exp(-product) if far else np.expm1(-product)
    turn -= rest * (turn if far else 1.0 + turn)
    return turn


def _in_balls(s: complex, n: Function, m: Function, divided: bool) -> complex:
    """Return N / M at one s with as many bits as the terms cancel; inf at a pole."""
    if s == 0.0 and divided:
        return complex(limit_at_zero(n, m))
    bits, at = _FEWEST_BITS, acb(s.real, s.imag)
    while True:
        with flint.ctx.workprec(bits):
            above, below = n.in_ball(at), m.in_ball(at) if divided else acb(1)
            found = above / below
        if above == 0 or found.rel_accuracy_bits() > _ENOUGH_BITS:
            return complex(found)
        if bits > _MOST_BITS:
            return complex(found) if not below.contains(0) else complex(np.inf)
        bits *= 2
