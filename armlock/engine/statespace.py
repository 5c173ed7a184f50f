"""State spaces as quotients of polynomials, exactly, and which coefficients may be rounding.

With one input and one output two characteristic polynomials are enough,

    C adj(s - A) B = det(s - A + B C) - det(s - A) .

Rounding of the matrices may have moved a pole or a zero from s = 0. Then its lowest coefficient
is not zero, but smaller than what rounding makes of it. `settled` refuses such a system until
it is stated how many poles and zeros are meant to be at s = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import flint
from flint import fmpq, fmpq_poly

from armlock.checks import whole_number
from armlock.engine.polynomials import Polynomial, exact, polynomial

#: What rounding makes of a coefficient: at most this share of the sizes of what was summed. It
#: covers changes of coordinates, and transfer functions that python-control makes of state
#: spaces that are not badly scaled.
ROUNDED = fmpq(1, 2**39)
# What is counted by each number that may be stated.
_COUNTED = {"integrators": "poles", "zeros": "zeros", "at_zero": "roots"}


class Lowest(NamedTuple):
    """The lowest coefficients of a series at s = 0, and what rounding may make of each."""

    coefficients: Sequence[fmpq]
    bounds: Sequence[fmpq]

    def is_sure(self, k: int) -> bool:
        """Tell whether a coefficient is larger than what rounding makes of it."""
        return bool(self.coefficients[k]) and abs(self.coefficients[k]) >= self.bounds[k]


def settled(
    name: str, number: int | None, series: Sequence[Lowest], *, cleared: int = 0
) -> int:
    """Return how many of the lowest coefficients are meant to be zero, or raise.

    A number that is stated sets so many coefficients to zero, of all series. The next one must
    not be rounding. If zero is stated, it is taken as it is.

    Parameters
    ----------
    name : {"integrators", "zeros", "at_zero"}
        What is stated.
    number : int or None
        How many poles, zeros or roots of an equation are at s = 0; None if it is not stated.
    series : sequence of Lowest
        Of all products of parameters, beginning with what stands before none.
    cleared : int, optional
        How many roots at s = 0 come from clearing denominators, for the text of an error.

    Returns
    -------
    int
        The number that is stated, 0 by default.

    Raises
    ------
    TypeError, ValueError
        If the number is not whole or negative, contradicts the coefficients by more than
        rounding, or rounding hides the next coefficient.
    """
    stated = whole_number(name, 0 if number is None else number, 0)
    size, is_root = len(series[0].coefficients), name == "at_zero"
    sure = [any(one.is_sure(k) for one in series) for k in range(size)]
    zero = [not any(one.coefficients[k] for one in series) for k in range(size)]
    most = sure.index(True) if any(sure) else size
    if stated > most or (number is not None and not is_root and zero[stated]):
        made = f", of which clearing denominators makes {cleared}" if is_root else ""
        raise ValueError(
            f"{name} must be the number of {_COUNTED[name]} at s = 0 but for rounding, got "
            f"{number}: there are {zero.index(False) if False in zero else size} exactly and "
            f"{most} within rounding{made}"
        )
    after = stated
    # An equation with a root at s = 0 that is not left out has the count -1 in any case.
    while not is_root and after < size and zero[after]:
        after += 1
    if number != 0 and after < size and not zero[after]:
        first = series[0]
        if (first.coefficients[after] and not first.is_sure(after)) or not sure[after]:
            calls = "System.of(system, {0}), state_space(..., {0})"
            if is_root:
                calls = "{0} of equation, determinant, return_difference or state_space"
            raise ValueError(
                f"rounding hides whether more than {after} {_COUNTED[name]} are at s = 0: "
                f"state how many, 0 if the numbers hold as they are, "
                f"{calls.format(name + '=0')}; or give its factors, "
                "Controller(zeros, poles, gain)"
            )
    return stated


def of_matrices(
    matrices: Sequence[Any], integrators: int | None, zeros: int | None
) -> tuple[fmpq_poly, fmpq_poly]:
    """Return numerator and denominator of C (s - A)^-1 B + D.

    Parameters
    ----------
    matrices : sequence of four nested lists of float
        A, B, C and D, of shapes (n, n), (n, 1), (1, n) and (1, 1).
    integrators, zeros : int or None
        How many poles and zeros are at s = 0, if they are stated.

    Raises
    ------
    TypeError, ValueError
        As `settled`.
    """
    a, b, c, ((d,),) = matrices
    if not len(a):
        return polynomial([d]), polynomial([1])
    first, column, row, through = _matrix(a), _matrix(b), _matrix(c), exact(d)
    below = fmpq_poly(first.charpoly().coeffs())
    above = (first - column * row).charpoly() - below + through * below
    bounds = _bounds(first, len(a), below)
    moved = _rounding("integrators", integrators, below, bounds)
    # The numerator is the determinant of [[s - A, B], [-C, D]].
    whole = _matrix(bordered(a, [-x for (x,) in b], c[0], -d))
    bounds = _bounds(whole, len(a), above) if above else []
    # What goes through directly stays as it is.
    above, below = above - through * moved, below - moved
    return above - _rounding("zeros", zeros, above, bounds), below


def of_coefficients(
    above: Any, below: Any, integrators: int | None, zeros: int | None
) -> tuple[fmpq_poly, fmpq_poly]:
    """Return a quotient of polynomials that were multiplied out, of floats in ascending powers.

    Raises
    ------
    TypeError, ValueError
        As `settled`.
    """
    above, below = polynomial(above), polynomial(below)
    # The leading coefficient of the one of lower degree may be rounding as well.
    degree = max(above.degree(), below.degree())
    longer = [p for p in (above, below) if p.degree() == degree]
    roots = [abs(root) for p in longer for root in Polynomial.of(p).roots]
    largest = exact(max(roots, default=0.0))
    moved = _rounding("integrators", integrators, below, _bounds_of_product(below, largest))
    zero = _rounding("zeros", zeros, above, _bounds_of_product(above, largest))
    return above - zero, below - moved


def _rounding(name: str, number: int | None, p: fmpq_poly, bounds: Sequence[fmpq]) -> fmpq_poly:
    """Return the lowest terms of a polynomial that are meant to be zero."""
    if not p:
        return p
    c = p.coeffs()
    return fmpq_poly(c[: settled(name, number, [Lowest(c, bounds)])])


def _matrix(rows: Any) -> Any:
    """Return an exact matrix of python-flint, of floats."""
    return flint.fmpq_mat([[exact(value) for value in row] for row in rows])


def bordered(block: Any, column: Any, row: Any, corner: Any) -> list[list[Any]]:
    """Return the rows of a block with a column beside it, a row below it and a corner."""
    return [*([*r, v] for r, v in zip(block, column, strict=True)), [*row, corner]]


def _bounds(matrix: Any, states: int, value: fmpq_poly) -> list[fmpq]:
    """Return what rounding makes of the coefficients of det(s - matrix).

    Here s stands at the first places of the diagonal, one for each state. The derivative by an
    entry is its cofactor. With Y the inverse at a point where the determinant is not zero, and
    d its coefficients around this point, the adjugate is B_k = Y (d_k - B_(k-1)).
    """
    size = range(matrix.nrows())
    unit, places = (
        flint.fmpq_mat(len(size), len(size), [int(i == k < n) for i in size for k in size])
        for n in (len(size), states)
    )
    start = next(k for k in range(len(size) + 1) if value(k))
    inverse, around = (places * start - matrix).inv(), value(fmpq_poly([start, 1]))
    adjugates = [around[0] * inverse]
    for k in range(1, states + 1):
        adjugates.append(inverse * (around[k] * unit - places * adjugates[-1]))
    for first in range(states):
        for k in range(states - 1, first - 1, -1):
            adjugates[k] -= start * adjugates[k + 1]
    pairs = (zip(matrix.entries(), b.transpose().entries(), strict=True) for b in adjugates)
    return [ROUNDED * sum((abs(x * y) for x, y in each), fmpq(0)) for each in pairs]


def _bounds_of_product(p: fmpq_poly, largest: fmpq) -> list[fmpq]:
    """Return what rounding makes of the coefficients of a polynomial multiplied out.

    Where all roots are rounded by the share u of the largest one r, a root at zero leaves
    u r c_1 of c_0. Where c_1 is rounding too, two of them leave u r^2 c_2, and so on.
    """
    bounds = [fmpq(0)]
    for c in map(abs, p.coeffs()[:0:-1]):
        bounds.append(largest * (bounds[-1] if c < bounds[-1] else ROUNDED * c))
    return bounds[::-1]
