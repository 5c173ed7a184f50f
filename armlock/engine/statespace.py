"""State spaces as quotients of polynomials, exactly, and which poles may be meant to be zero.

With one input and one output two characteristic polynomials are enough,

    C adj(s - A) B = det(s - A + B C) - det(s - A) .

Where rounding of the matrices may have moved a pole or a zero from s = 0, the quotient is *in
doubt*: it comes with bounds of its lowest coefficients. A system that is made of it keeps as
its `others` what it is for the values -bound, 0 and +bound. A count has to be the same for all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple, TypeVar

import flint
from flint import fmpq, fmpq_poly

from armlock.checks import whole_number
from armlock.engine.polynomials import Polynomial, exact

_System = TypeVar("_System", bound=Any)

#: What rounding makes of a determinant: at most this share of sum |a_ij cofactor_ij|. It covers
#: all changes of coordinates that were drawn, of two to five states.
ROUNDED = fmpq(512, 2**53)
#: So many poles may be in doubt.
MOST_IN_DOUBT = 2


class Quotient(NamedTuple):
    """Numerator and denominator, and bounds of their lowest coefficients that are in doubt.

    A bound is what rounding may make of a coefficient that is meant to be zero; it is zero
    where the coefficient is.
    """

    above: Polynomial
    below: Polynomial
    below_bounds: tuple[fmpq, ...] = ()
    above_bounds: tuple[fmpq, ...] = ()

    def stated(self, integrators: int | None, zeros: int | None) -> Quotient:
        """Return the quotient with so many poles and zeros at s = 0, or raise.

        None leaves them in doubt.
        """
        above, below, below_bounds, above_bounds = self
        if integrators is not None:
            number = _stated("integrators", integrators, below, below_bounds)
            above, below = _with_lowest(above, below, [fmpq(0)] * number)
            below_bounds = ()
        if zeros is not None:
            number = _stated("zeros", zeros, above, above_bounds)
            above = Polynomial.of(above.exact - fmpq_poly(above.exact.coeffs()[:number]))
            above_bounds = ()
        return Quotient(above, below, below_bounds, above_bounds)

    def others(self) -> Iterator[tuple[Polynomial, Polynomial]]:
        """Return what else may be meant; nothing if nothing is in doubt."""
        if not any((*self.below_bounds, *self.above_bounds)):
            return
        for lowest in _around(self.below_bounds):
            other, changed = _with_lowest(self.above, self.below, lowest)
            for lowest_above in _around(self.above_bounds):
                moved = [new - self.above.exact[k] for k, new in enumerate(lowest_above)]
                above = Polynomial.of(other.exact + fmpq_poly(moved))
                if above:
                    yield above, changed


def with_others(make: Callable[..., _System], *systems: Any) -> _System:
    """Return what a function makes of systems, and as its `others` what it makes of theirs."""
    found = make(*systems)
    if any(system.others for system in systems):
        chosen = product(*(system.others or (system,) for system in systems))
        others = dict.fromkeys(make(*some) for some in chosen)
        object.__setattr__(found, "others", tuple(others))
    return found


def _around(bounds: Sequence[fmpq]) -> Iterator[tuple[fmpq, ...]]:
    """Return the values of coefficients that may be meant to be zero."""
    return product(*((-bound, fmpq(0), bound) if bound else (bound,) for bound in bounds))


def _stated(name: str, given: int, p: Polynomial, bounds: Sequence[fmpq]) -> int:
    """Return how many roots at s = 0 are stated, or raise if p has no such coefficients."""
    number = whole_number(name, given, 0)
    lowest = p.exact.coeffs()[:number]
    small = [not c or (k < len(bounds) and bounds[k]) for k, c in enumerate(lowest)]
    if not all(small) or not p.exact[number]:
        what = {"integrators": "poles", "zeros": "zeros"}[name]
        raise ValueError(
            f"{name} must be the number of {what} that are zero but for rounding, got {given} "
            f"for coefficients {p!r:.200}"
        )
    return number


def _with_lowest(
    above: Polynomial, below: Polynomial, lowest: Sequence[fmpq]
) -> tuple[Polynomial, Polynomial]:
    """Return the quotient with other lowest coefficients of the denominator.

    What goes through directly stays as it is.
    """
    through = above.lead / below.lead if above.degree == below.degree else fmpq(0)
    change = fmpq_poly([new - below.exact[k] for k, new in enumerate(lowest)])
    return Polynomial.of(above.exact + through * change), Polynomial.of(below.exact + change)


def of_matrices(a: Any, b: Any, c: Any, d: Any) -> Quotient:
    """Return C (s - A)^-1 B + D of matrices of floats."""
    if not len(a):
        return Quotient(Polynomial.of(d[0]), Polynomial.of([1]))
    first, column, row = _matrix(a), _matrix(b), _matrix(c)
    below = first.charpoly()
    above = (first - column * row).charpoly() - below + exact(d[0][0]) * below
    above = Polynomial.of(above)
    return Quotient(
        above, Polynomial.of(below), _doubts(a), _doubts_of_zeros(a, b, c, d[0][0], above)
    )


def of_coefficients(above: Any, below: Any) -> Quotient:
    """Return a quotient of polynomials that were multiplied out, in ascending powers."""
    denominator = Polynomial.of(below)
    return Quotient(Polynomial.of(above), denominator, _doubts_of_roots(denominator))


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


def _doubts(a: Any) -> tuple[fmpq, ...]:
    """Return what rounding of A may make of the lowest coefficients of det(s - A).

    Of at most two, as long as each is below its bound. The derivative of det(s - A) by
    an entry of A is a cofactor of s - A.
    """
    if not len(a):
        return ()
    matrix = _matrix(a)
    return _in_doubt(*_cofactors(matrix), matrix)


def doubt(rows: Any, sizes: Any) -> fmpq:
    """Return what rounding may make of a determinant, or zero if the determinant is larger.

    Sizes are those of the entries, where these are sums.
    """
    matrix = _matrix(rows)
    value = matrix.det()
    found = _in_doubt([value], [matrix.inv() * value], _matrix(sizes)) if value else ()
    return found[0] if found else fmpq(0)


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


def _doubts_of_zeros(a: Any, b: Any, c: Any, d: float, above: Polynomial) -> tuple[fmpq, ...]:
    """Return what rounding may make of the lowest coefficients of the numerator.

    It is the determinant of [[s - A, B], [-C, D]], whose adjugate is interpolated.
    """
    if not (len(a) and above):
        return ()
    n = len(a)
    turned, column, row = [[-x for x in row] for row in a], [x for (x,) in b], c[0]
    matrix = _matrix(bordered(turned, column, [-x for x in row], d))
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


def _doubts_of_roots(below: Polynomial) -> tuple[fmpq, ...]:
    """Return bounds for a denominator that was multiplied out from rounded poles.

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
