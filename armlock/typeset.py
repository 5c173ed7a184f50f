"""Sums of polynomials, delays and parameters as one writes them."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from typing import Any

from flint import fmpq, fmpq_poly


def written(terms: Mapping[Any, fmpq_poly]) -> str:
    """Return the terms of a sum, {(lag, names): polynomial}, as one writes them."""
    shown = []
    for (lag, names), p in sorted(
        terms.items(), key=lambda term: (term[0][0].time, term[0][1])
    ):
        factors = [*names]
        if lag:
            factors.append(f"exp(-{fraction(lag.time)} s)")
        power = _powers(p)
        several = sum(map(bool, p.coeffs())) > 1 and (factors or len(terms) > 1)
        if factors and power in ("1", "-1"):
            shown.append(power[:-1] + " ".join(factors))
        else:
            shown.append(" ".join([f"({power})" if several else power, *factors]))
    return " + ".join(shown).replace("+ -", "- ") or "0"


def fraction(value: fmpq) -> str:
    """Return a fraction, which may be no float, with six digits."""
    try:
        if value == 0 or abs(float(value)) > 1e-300:
            return f"{float(value):.6g}"
    except OverflowError:
        pass
    return f"{Decimal(int(value.p)) / int(value.q):.5e}"


def _powers(p: fmpq_poly) -> str:
    """Return a polynomial as text, in descending powers."""
    shown = []
    for k, c in reversed(list(enumerate(p.coeffs()))):
        if c:
            digits, symbol = fraction(c), ("", "s", f"s^{k}")[min(k, 2)]
            if symbol and digits in ("1", "-1"):
                digits = digits[:-1]
            shown.append(f"{digits} {symbol}".strip() if digits != "-" else f"-{symbol}")
    return " + ".join(shown).replace("+ -", "- ")
