"""State spaces as quotients of polynomials, exactly, and which coefficients may be rounding.

With one input and one output two characteristic polynomials are enough,

    C adj(s - A) B = det(s - A + B C) - det(s - A) .

Rounding of the matrices may have moved a pole or a zero from s = 0. Then its lowest coefficient
is not zero, but smaller than what rounding makes of it. `settled` refuses such a system until
it is stated how many poles and zeros are meant to be at s = 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import flint
from flint import fmpq, fmpq_poly

from armlock.checks import whole_number
from armlock.engine.polynomials import Polynomial, exact, polynomial

#: What rounding makes of a determinant: at most this share of sum |a_ij cofactor_ij|. It covers
#: all changes of coordinates that were drawn, of two to five states.
ROUNDED = fmpq(512, 2**53)
#: What rounding makes of a root of a polynomial that was multiplied out: this share of the
#: largest root. python-control makes as much of state spaces in coordinates of some condition.
MULTIPLIED = fmpq(1, 2**39)
# Bounds are computed of so many of the lowest coefficients of a polynomial.
_ASKED = 3
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
    size = len(series[0].coefficients)
    sure = [any(one.is_sure(k) for one in series) for k in range(size)]
    zero = [not any(one.coefficients[k] for one in series) for k in range(size)]
    most = sure.index(True) if any(sure) else size
    is_root = name == "at_zero"
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
            raise ValueError(
                f"rounding hides whether more than {after} {_COUNTED[name]} are at s = 0: "
                "state how many are meant, 0 if the numbers hold as they are, by "
                "System.of(system, integrators=0, zeros=0), state_space(..., "
                "integrators=0, zeros=0), or at_zero=0 of an equation, determinant or "
                "return_difference; or give its factors, Controller(zeros, poles, gain)"
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
    coefficients, adjugates = _cofactors(first)
    below = fmpq_poly(coefficients)
    above = (first - column * row).charpoly() - below + through * below
    bounds = _bounds(below, adjugates, first), _bounds_of_zeros(a, b, c, d, above)
    return _quotient(above, below, through, (integrators, zeros), bounds)


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
    through = above[below.degree()] / below.leading_coefficient()
    bounds = _bounds_of_product(Polynomial.of(below)), _bounds_of_product(Polynomial.of(above))
    return _quotient(above, below, through, (integrators, zeros), bounds)


def _quotient(
    above: fmpq_poly,
    below: fmpq_poly,
    through: fmpq,
    numbers: tuple[int | None, int | None],
    bounds: tuple[Sequence[fmpq], Sequence[fmpq]],
) -> tuple[fmpq_poly, fmpq_poly]:
    """Return numerator and denominator with as many poles and zeros at s = 0 as are stated."""
    moved = _rounding("integrators", numbers[0], below, bounds[0])
    # What goes through directly stays as it is.
    above, below = above - through * moved, below - moved
    return above - _rounding("zeros", numbers[1], above, bounds[1]), below


def _rounding(name: str, number: int | None, p: fmpq_poly, bounds: Sequence[fmpq]) -> fmpq_poly:
    """Return the lowest terms of a polynomial that are meant to be zero."""
    if not p:
        return p
    c = p.coeffs()
    lowest = Lowest(c, [*bounds, *[fmpq(0)] * len(c)])
    return fmpq_poly(c[: settled(name, number, [lowest])])


def _matrix(rows: Any) -> Any:
    """Return an exact matrix of python-flint, of floats."""
    return flint.fmpq_mat([[exact(value) for value in row] for row in rows])


def bordered(block: Any, column: Any, row: Any, corner: Any) -> list[list[Any]]:
    """Return the rows of a block with a column beside it, a row below it and a corner."""
    return [*([*r, v] for r, v in zip(block, column, strict=True)), [*row, corner]]


def _cofactors(matrix: Any) -> tuple[list[fmpq], list[Any]]:
    """Return the coefficients of det(s - A), and those of the adjugate of s - A.

    By the recursion of Faddeev and Leverrier, P_(k-1) = A P_k + c_k.
    """
    coefficients = matrix.charpoly().coeffs()
    n = len(coefficients) - 1
    unit = flint.fmpq_mat(n, n, [int(i == k) for i in range(n) for k in range(n)])
    found = [unit]
    for c in coefficients[n - 1 : 0 : -1]:
        found.append(matrix * found[-1] + c * unit)
    return coefficients, found[::-1]


def _bounds(value: fmpq_poly, adjugates: Iterable[Any], weights: Any) -> list[fmpq]:
    """Return what rounding makes of the lowest coefficients of a determinant.

    The derivative by an entry is its cofactor. The last one is larger than rounding.
    """
    found: list[fmpq] = []
    for k, adjugate in enumerate(adjugates):
        pairs = zip(weights.entries(), adjugate.transpose().entries(), strict=True)
        found.append(ROUNDED * sum((abs(x * y) for x, y in pairs), fmpq(0)))
        if value[k] and abs(value[k]) >= found[k]:
            break
    return found


def _bounds_of_zeros(a: Any, b: Any, c: Any, d: float, value: fmpq_poly) -> list[fmpq]:
    """Return what rounding may make of the lowest coefficients of the numerator.

    It is the determinant of [[s - A, B], [-C, D]], whose adjugate is interpolated.
    """
    if not value:
        return []
    n = len(a)
    turned, column, row = [[-x for x in row] for row in a], [x for (x,) in b], c[0]
    matrix = _matrix(bordered(turned, column, [-x for x in row], d))
    size = range(n + 1)
    unit = flint.fmpq_mat(n + 1, n + 1, [int(i == k < n) for i in size for k in size])
    points = [k for k in range(1, 2 * n + 2) if value(k)][: n + 1]
    inverse = flint.fmpq_mat(n + 1, n + 1, [k**i for k in points for i in size]).inv()
    known = [(unit * k + matrix).inv() * value(k) for k in points]
    adjugates = (
        sum((m * inverse[i, j] for j, m in enumerate(known)), 0 * matrix) for i in size
    )
    return _bounds(value, adjugates, matrix)


def _bounds_of_product(given: Polynomial) -> list[fmpq]:
    """Return what rounding makes of the lowest coefficients of a polynomial multiplied out.

    Its roots are rounded by a share of the largest one, which python-control does to state
    spaces. A bound is zero where so many roots are not next to s = 0.
    """
    p, largest = given.exact, exact(max(map(abs, given.roots), default=0.0))
    found = []
    for first in range(_ASKED):
        bounds = [fmpq(0)]
        for number in range(first + 1, min(first + _ASKED, p.degree() + 1)):
            lead = MULTIPLIED * abs(p[number])
            bounds = [lead * largest ** (number - k) for k in range(first, number)]
            if all(abs(p[k]) < x for k, x in enumerate(bounds, first)):
                break
            bounds = [fmpq(0)]
        found.append(bounds[0])
    return found
