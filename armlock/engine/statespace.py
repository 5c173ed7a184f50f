"""State spaces as quotients of polynomials, exactly, and which poles may be meant to be zero.

With one input and one output two characteristic polynomials are enough,

    C adj(s - A) B = det(s - A + B C) - det(s - A) .
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import flint
from flint import fmpq, fmpq_poly

from armlock.engine.polynomials import Polynomial, exact

#: What rounding makes of a determinant: at most this share of sum |a_ij cofactor_ij|. It covers
#: all changes of coordinates that were drawn, of two to five states.
ROUNDED = fmpq(512, 2**53)
#: So many poles may be in doubt.
MOST_IN_DOUBT = 2


def _matrix(rows: Any) -> Any:
    """Return an exact matrix of python-flint, of floats."""
    return flint.fmpq_mat([[exact(value) for value in row] for row in rows])


def quotient(a: Any, b: Any, c: Any, d: float) -> tuple[Polynomial, Polynomial]:
    """Return numerator and denominator of C (s - A)^-1 B + D, from matrices of floats."""
    if not len(a):
        return Polynomial.of([d]), Polynomial.of([1])
    a, b, c = _matrix(a), _matrix(b), _matrix(c)
    below = a.charpoly()
    above = (a - b * c).charpoly() - below + exact(d) * below
    return Polynomial.of(above), Polynomial.of(below)


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


def doubts(a: Any, sizes: Any = None) -> tuple[fmpq, ...]:
    """Return what rounding of A may make of the lowest coefficients of det(s - A).

    Of as many as may all be meant to be zero, and at most two. The derivative of det(s - A) by
    an entry of A is a cofactor of s - A. Sizes are those of the entries, where these are sums.
    """
    if not len(a):
        return ()
    matrix = _matrix(a)
    return _in_doubt(*_cofactors(matrix), matrix if sizes is None else _matrix(sizes))


def _in_doubt(
    coefficients: Iterable[fmpq], adjugates: Iterable[Any], weights: Any
) -> tuple[fmpq, ...]:
    """Return bounds of the lowest coefficients of a determinant, from its cofactors."""
    found: list[fmpq] = []
    for c, adjugate in zip(coefficients, adjugates, strict=False):
        pairs = zip(weights.entries(), adjugate.transpose().entries(), strict=True)
        bound = ROUNDED * sum((abs(x * y) for x, y in pairs), fmpq(0))
        if len(found) == MOST_IN_DOUBT or (c and abs(c) >= bound):
            break
        found.append(bound if c else fmpq(0))
    return tuple(found) if any(found) else ()


def doubts_of_zeros(a: Any, b: Any, c: Any, d: float, above: Polynomial) -> tuple[fmpq, ...]:
    """Return what rounding may make of the lowest coefficients of the numerator.

    It is the determinant of [[s - A, B], [-C, D]], whose adjugate is interpolated.
    """
    if not (len(a) and above):
        return ()
    n = len(a)
    rows = [[-x for x in row] + list(last) for row, last in zip(a, b, strict=True)]
    matrix = _matrix([*rows, [*(-x for x in c[0]), d]])
    size = range(n + 1)
    unit = flint.fmpq_mat(n + 1, n + 1, [int(i == k < n) for i in size for k in size])
    value = above.exact
    points = [k for k in range(1, 2 * n + 2) if value(k)][: n + 1]
    inverse = flint.fmpq_mat(n + 1, n + 1, [k**i for k in points for i in size]).inv()
    known = [(unit * k + matrix).inv() * value(k) for k in points]
    adjugates = (
        sum((m * inverse[i, j] for j, m in enumerate(known)), 0 * matrix)
        for i in range(MOST_IN_DOUBT)
    )
    return _in_doubt(value.coeffs(), adjugates, matrix)


def doubts_of_roots(below: Polynomial) -> tuple[fmpq, ...]:
    """Return the same for a denominator that was multiplied out from rounded poles.

    Poles are rounded by a share of the largest one, which python-control does to state spaces.
    """
    largest = exact(max(map(abs, below.roots), default=0.0))
    for number in range(1, min(MOST_IN_DOUBT, below.degree) + 1):
        lead = abs(below.exact[number])
        bounds = [ROUNDED * lead * largest ** (number - k) for k in range(number)]
        sizes = [abs(below.exact[k]) for k in range(number)]
        if any(sizes) and all(x < y or not x for x, y in zip(sizes, bounds, strict=True)):
            return tuple(y if x else fmpq(0) for x, y in zip(sizes, bounds, strict=True))
    return ()


def with_lowest(
    above: Polynomial, below: Polynomial, lowest: Sequence[fmpq]
) -> tuple[Polynomial, Polynomial]:
    """Return the quotient with other lowest coefficients of the denominator.

    What goes through directly stays as it is.
    """
    through = above.lead / below.lead if above.degree == below.degree else fmpq(0)
    change = fmpq_poly([new - below.exact[k] for k, new in enumerate(lowest)])
    return Polynomial.of(above.exact + through * change), Polynomial.of(below.exact + change)
