"""State spaces as quotients of polynomials, exactly, and which poles may be meant to be zero.

With one input and one output two characteristic polynomials are enough,

    C adj(s - A) B = det(s - A + B C) - det(s - A) .
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

import flint

from armlock.engine.polynomials import Polynomial, exact, fractions

#: What rounding makes of a determinant: at most this share of sum |a_ij cofactor_ij|. It covers
#: all changes of coordinates that were drawn, of two to five states.
ROUNDED = Fraction(512, 2**53)
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
    return Polynomial.of(above.coeffs()), Polynomial.of(below.coeffs())


def _cofactors(matrix: Any) -> tuple[tuple[Fraction, ...], list[Any]]:
    """Return the coefficients of det(s - A), and those of the adjugate of s - A.

    By the recursion of Faddeev and Leverrier, P_(k-1) = A P_k + c_k.
    """
    coefficients = fractions(matrix.charpoly())
    n = len(coefficients) - 1
    unit = flint.fmpq_mat(n, n, [int(i == k) for i in range(n) for k in range(n)])
    found = [unit]
    for c in coefficients[n - 1 : 0 : -1]:
        found.append(matrix * found[-1] + exact(c) * unit)
    return coefficients, found[::-1]


def _magnitude(terms: Iterable[Any]) -> Fraction:
    """Return the sum of magnitudes of numbers of python-flint."""
    return sum((Fraction(int(abs(t.p)), int(t.q)) for t in terms), Fraction(0))


def doubts(a: Any, sizes: Any = None) -> tuple[Fraction, ...]:
    """Return what rounding of A may make of the lowest coefficients of det(s - A).

    Of as many as may all be meant to be zero, and at most two. The derivative of det(s - A) by
    an entry of A is a cofactor of s - A. Sizes are those of the entries, where these are sums.
    """
    if not len(a):
        return ()
    matrix = _matrix(a)
    weights = matrix if sizes is None else _matrix(sizes)
    found: list[Fraction] = []
    for c, adjugate in zip(*_cofactors(matrix), strict=False):
        pairs = zip(weights.entries(), adjugate.transpose().entries(), strict=True)
        bound = ROUNDED * _magnitude(x * y for x, y in pairs)
        if len(found) == MOST_IN_DOUBT or (c and abs(c) >= bound):
            break
        found.append(bound if c else Fraction(0))
    return tuple(found) if any(found) else ()


def without_hidden(a: Any, b: Any, c: Any, above: Polynomial, number: int) -> Polynomial:
    """Return a numerator of which so many lowest coefficients, if small, are zero.

    Poles at s = 0 that the input does not reach, or the output does not see, cancel there.
    """
    matrix, column, row = (_matrix(m) for m in (a, b, c))
    lowest = []
    for value, adjugate in zip(above.exact[:number], _cofactors(matrix)[1], strict=False):
        weights = (column * row).transpose().entries()
        pairs = zip(weights, adjugate.entries(), strict=True)
        if abs(value) > ROUNDED * _magnitude(x * y for x, y in pairs):
            break
        lowest.append(-value)
    return above + Polynomial.of(lowest)


def doubts_of_roots(below: Polynomial) -> tuple[Fraction, ...]:
    """Return the same for a denominator that was multiplied out from rounded poles.

    Poles are rounded by a share of the largest one, which python-control does to state spaces.
    """
    largest = Fraction(max(map(abs, below.roots), default=0.0))
    for number in range(1, min(MOST_IN_DOUBT, below.degree) + 1):
        lead = abs(below.exact[number])
        bounds = [ROUNDED * lead * largest ** (number - k) for k in range(number)]
        sizes = list(map(abs, below.exact[:number]))
        if any(sizes) and all(x < y or not x for x, y in zip(sizes, bounds, strict=True)):
            return tuple(y if x else Fraction(0) for x, y in zip(sizes, bounds, strict=True))
    return ()


def with_lowest(
    above: Polynomial, below: Polynomial, lowest: Sequence[Fraction]
) -> tuple[Polynomial, Polynomial]:
    """Return the quotient with other lowest coefficients of the denominator.

    What goes through directly stays as it is.
    """
    through = above.lead / below.lead if above.degree == below.degree else Fraction(0)
    changes = [new - old for new, old in zip(lowest, below.exact, strict=False)]
    other = above + Polynomial.of(through * change for change in changes)
    return other, below + Polynomial.of(changes)
