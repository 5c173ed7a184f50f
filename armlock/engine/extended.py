"""Zeros of f + t g on short pieces of the axis, where double precision does not decide.

With A(omega) = f(j omega) g(-j omega), a zero needs Im A = 0, and then t = -Re A / |g|^2.
Taylor coefficients are computed in intervals of many digits (Lemma 19).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import flint
from flint import acb, acb_series, arb, fmpq

from armlock.engine.chain import UndecidedError
from armlock.engine.functions import Function
from armlock.engine.polynomials import exact

# Bits, the Taylor coefficients, and the most pieces that an interval is split into.
_BITS, _TERMS, _MOST_PIECES = 200, 4, 2000
# Halvings after which the frequency of a zero is known.
_HALVINGS = 64


@contextmanager
def _many_digits() -> Iterator[None]:
    before = flint.ctx.prec, flint.ctx.cap
    flint.ctx.prec, flint.ctx.cap = _BITS, _TERMS
    try:
        yield
    finally:
        flint.ctx.prec, flint.ctx.cap = before


class _Product:
    """The function A of f and g."""

    def __init__(self, f: Function, g: Function) -> None:
        space = f.space
        self.delays = [acb(-theta) for theta in space.delays]
        self.polynomials = [[acb(c) for c in p.exact.coeffs()][::-1] for p in space.polynomials]
        self.weights = [
            [
                [acb(w) for w in (s, *row)]
                for s, row in zip(one.steady, one.delayed, strict=True)
            ]
            for one in (f, g)
        ]

    def at(self, omega: arb) -> tuple[Any, Any, Any]:
        """Return the Taylor coefficients of A, and f and g."""
        (f, g), (_, other) = (
            self._values(acb_series([acb(0, way * omega), acb(0, way)], _TERMS))
            for way in (1, -1)
        )
        return f * other, f[0], g[0]

    def _values(self, s: Any) -> list[Any]:
        """Return the series of f and g at s, a series in omega."""
        late = [(s * theta).exp() - 1 for theta in self.delays]
        powers = []
        for coefficients in self.polynomials:
            value = acb_series([0], _TERMS)
            for c in coefficients:
                value = value * s + c
            powers.append(value)
        return [
            sum(
                (
                    p * sum((turned * w for w, turned in zip(row, late, strict=True)), steady)
                    for p, (steady, *row) in zip(powers, weights, strict=True)
                ),
                acb_series([0], _TERMS),
            )
            for weights in self.weights
        ]


def first_on(
    f: Function, g: Function, omega: tuple[float, float], between: tuple[float, float]
) -> tuple[float, float]:
    """Return the smallest t at which f + t g has a zero on a piece of the axis, and where.

    Parameters
    ----------
    f, g : Function
        Of one space.
    omega : tuple of two floats
        The ends of the piece in rad/s.
    between : tuple of two floats
        Limits of t, not negative.

    Returns
    -------
    tuple of two floats
        The upper limit and nan where there is none.

    Raises
    ------
    UndecidedError
        If the digits do not decide it.
    """
    (start, best), where = between, math.nan
    pieces = [(exact(omega[0]), exact(omega[1]))]
    with _many_digits():
        product = _Product(f, g)
        for _ in range(_MOST_PIECES):
            if not pieces:
                return best, where
            a, b = pieces.pop()
            m, r = (a + b) / 2, (b - a) / 2
            around, size, other = product.at(arb(m, r))
            if abs(other) * best < abs(size) or around[0].real > 0:
                continue
            here, *_ = product.at(arb(m))
            h = [abs(here[k].imag) for k in range(3)]
            rest = abs(around[3]).upper()
            if h[0] > h[1] * r + h[2] * r**2 + rest * r**3:
                continue
            if h[1] > 2 * h[2] * r + 3 * rest * r**2:
                t, at = _zero(product, a, b)
                best, where = (t, at) if start < t < best else (best, where)
                continue
            pieces += [(m, b), (a, m)]
    raise UndecidedError(f"{_BITS} bits do not decide at {omega[0]:.6g} rad/s")


def _zero(product: _Product, a: fmpq, b: fmpq) -> tuple[float, float]:
    """Return t at the zero of Im A, which is monotonic between two frequencies; inf if none."""

    def sign(omega: fmpq) -> int:
        value = product.at(arb(omega))[0][0].imag
        return 1 if value > 0 else -1 if value < 0 else 0

    first, last = sign(a), sign(b)
    if not first * last:
        raise UndecidedError(f"{_BITS} bits do not decide at {float(a):.6g} rad/s")
    if first == last:
        return math.inf, math.nan
    for _ in range(_HALVINGS):
        middle = (a + b) / 2
        a, b = (middle, b) if sign(middle) == first else (a, middle)
    value, _, size = product.at(arb(a))
    t = -value[0].real / abs(size) ** 2
    return float(t) if t.is_finite() else math.inf, float(a)
