"""Several loops at once: determinants of matrices of systems, and state spaces with delays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import prod
from typing import Any

import numpy as np

from armlock.checks import real_array, whole_number
from armlock.engine.polynomials import exact, order, polynomial
from armlock.engine.statespace import bordered, settled
from armlock.systems import (
    Sum,
    System,
    check_continuous,
    delay,
    delay_object,
    equation_of,
    names_of,
    proportion,
)

# Most terms that a determinant may multiply, about a minute.
_MOST_PRODUCTS = 4_000_000
_ONE = Sum.of(polynomial([1]))


def determinant(matrix: Any, *, at_zero: int | None = None) -> System:
    """Return the equation det = 0 of a square matrix of systems.

    Parameters
    ----------
    matrix : sequence of rows
        Of systems as `System.of` takes them, numbers included.
    at_zero : int, optional
        How many roots at s = 0 are left out, as of `equation`.

    Returns
    -------
    System
        An equation, for `unstable_roots` and `rightmost_root`. `System.opened` makes the open
        loop of one of its parameters, for `margins`.

    Raises
    ------
    TypeError, ValueError
        If the matrix is not square, an entry is no system, or the determinant is zero, or takes
        more than a minute: full matrices have at most some 14 rows with one delay, 10 with
        three.

    Notes
    -----
    Each entry is a system of its own, and all of its modes count, hidden ones too: a row is
    multiplied by its denominators. Entries of a row that are one transfer function, up to a
    number, are one system. A root at s = 0 of a row counts too. Only where an entry has a zero
    there in both its numerator and denominator, a power of s that the row has is divided out.

    Examples
    --------
    Two tanks that feed each other, one of them after 2 s:

    >>> from armlock import delay, determinant, rightmost_root, s
    >>> tanks = determinant([[s + 1, -0.5 * delay(2.0)], [-1, s + 0.2]])
    >>> print(f"{rightmost_root(tanks):.4f}")
    0.1357+0.0000j
    """
    d, nominal, _, zeros = _whole(matrix)
    return equation_of(d, nominal, at_zero, zeros)


def return_difference(plant: Any, controllers: Any, *, at_zero: int | None = None) -> System:
    """Return the equation det(1 + P C) = 0 of several loops, with negative feedback.

    Parameters
    ----------
    plant : matrix of systems, tuple, or state space of python-control
        P, with a row for each output; or (A, B, C) or (A, B, C, D) as `state_space` takes them.
    controllers : sequence
        The controller of each loop, or the matrix C with a row for each input of the plant.
    at_zero : int, optional
        How many roots at s = 0 are left out, as of `equation`.

    Returns
    -------
    System
        An equation, as of `determinant`. Each entry of P and of C is one system.

    Raises
    ------
    TypeError, ValueError
        As `determinant`, if shapes do not fit, if products have more zeros than poles, or if
        the loops have no solution at high frequency (they are not well posed).

    Examples
    --------
    The margins of the first loop of two, with the second one closed:

    >>> import control
    >>> from armlock import delay, margins, parameter, return_difference
    >>> def lag(gain, time, dead):
    ...     return control.tf([gain], [time, 1]) * delay(dead)
    >>> plant = [[lag(2, 10, 1), lag(1, 8, 3)], [lag(1, 9, 2), lag(3, 12, 1)]]
    >>> k1, pi = parameter("k1", 1.0), control.tf([5, 1], [10, 0])
    >>> loops = return_difference(plant, [k1 * pi, pi])
    >>> print(f"{margins(loops.opened('k1')).gain_upper:.4f}")
    15.2507
    """
    a, b, c, d = _parts(plant)
    k = _array("controllers", controllers)
    k = np.diag(k[:, 0]) if k.shape[1] == 1 else k
    (outputs, inputs), n = d.shape, len(a)
    if k.shape != (inputs, outputs):
        raise ValueError(
            f"controllers must be {inputs} x {outputs}, as the plant is {outputs} x {inputs}, "
            f"got shape {k.shape}"
        )
    whole, nominal, poles, zeros = _whole(
        np.block(
            [
                [a, np.zeros((n, outputs), object), -b],
                [-c, np.eye(outputs, dtype=object), -d],
                [np.zeros((inputs, n), object), k, np.eye(inputs, dtype=object)],
            ]
        )
    )
    states = n + poles
    if whole.degree > states:
        raise ValueError(
            "plant and controllers must not have more zeros than poles: the determinant has "
            f"s^{whole.degree} with {states} states; give the controllers a filter"
        )
    if all(lag or p.degree() < states for (lag, _), p in whole.terms.items()):
        raise ValueError(
            "the loops must be well posed: at high frequency what nothing delays has a "
            "determinant of zero"
        )
    return equation_of(whole, nominal, at_zero, zeros)


def state_space(
    a: Any,
    b: Any = None,
    c: Any = None,
    d: Any = 0.0,
    *,
    integrators: int | None = None,
    zeros: int | None = None,
    at_zero: int | None = None,
) -> System:
    """Return a state space with delays, x' = sum of A_k x(t - h_k) + b u, y = c x + d u.

    Parameters
    ----------
    a : mapping of delays to matrices, shape (n, n); or one matrix
        ``{0: A_0, 1.5: A_1}``. A delay is a number in s, or what `delay` returns.
    b, c : array_like of float, shape (n,), optional
        Without them the equation of the poles is returned.
    d : float, or array_like of one, optional
        What goes through directly.
    integrators, zeros : int, optional
        How many poles and zeros of the transfer function are at s = 0, where rounding of the
        matrices hides it. A pole at s = 0 that `b` does not reach is a zero too.
    at_zero : int, optional
        How many poles at s = 0 the equation leaves out, as of `equation`.

    Returns
    -------
    System
        The transfer function from u to y, exactly, with the hidden modes; or an equation.

    Raises
    ------
    TypeError, ValueError
        If a number is not finite, shapes do not fit, a delay is negative, rounding does not
        hide as many integrators or zeros, or there are too many states, see `determinant`.
        `return_difference` takes several inputs and outputs.

    Examples
    --------
    >>> from armlock import rightmost_root, state_space
    >>> poles = state_space({0: [[0, 1], [-1, -0.2]], 1.0: [[0, 0], [-0.5, 0]]})
    >>> print(f"{rightmost_root(poles):.4f}")
    0.0853+1.1086j
    """
    if (b is None) != (c is None):
        raise TypeError("b and c must be given both, or none of them")
    rows = _states(a)
    below = _determinant(rows)
    if b is None:
        if (integrators, zeros) != (None, None):
            raise TypeError("integrators and zeros are for b and c: state at_zero without them")
        return equation_of(below, {}, at_zero)
    if at_zero is not None:
        raise TypeError(f"at_zero must not be given with b and c, got {at_zero}")
    column, row, direct = (real_array(*pair).ravel() for pair in (("b", b), ("c", c), ("d", d)))
    if (len(column), len(row), len(direct)) != (len(rows), len(rows), 1):
        raise ValueError(
            f"b and c must have {len(rows)} numbers, and d one, got {len(column)}, "
            f"{len(row)} and {len(direct)}: several inputs or outputs are for "
            "return_difference"
        )
    moved, through = _rounding("integrators", integrators, below), _number(exact(direct[0]))
    above = _determinant(bordered(rows, map(_number, -column), map(_number, row), through)) + -(
        through * moved
    )
    return System(above + -_rounding("zeros", zeros, above), below + -moved)


def _rounding(name: str, number: int | None, d: Sum) -> Sum:
    """Return the lowest coefficients of a determinant that are meant to be zero."""
    if not d:
        return d
    series = d.lowest(whole_number(name, 0 if number is None else number, 0) + 2)
    stated = settled(name, number, series)
    return Sum.of(polynomial(series[0].coefficients[:stated]))


def _number(value: Any) -> Sum:
    return Sum.of(polynomial([value]))


def _parts(plant: Any) -> tuple[Any, ...]:
    """Return A with s on its diagonal, B, C and D; without states for a matrix of systems."""
    if hasattr(plant, "isdtime") and hasattr(plant, "A"):
        check_continuous("plant", plant)
        plant = plant.A, plant.B, plant.C, plant.D
    if not (isinstance(plant, tuple) and len(plant) in (3, 4)):
        d = _array("plant", plant)
        none = [np.zeros(shape, object) for shape in ((0, 0), (0, d.shape[1]), (d.shape[0], 0))]
        return *none, d
    a, b, c, *d = plant
    rows = _states(a)
    b, c = (np.atleast_2d(real_array(*pair)) for pair in (("B", b), ("C", c)))
    b = b.reshape(len(rows), -1)
    d = real_array("D", d[0]) if d else np.zeros((len(c), b.shape[1]))
    states = [[System(p, _ONE) for p in row] for row in rows]
    return tuple(np.array(part, object) for part in (states, b, c, d))


def _array(name: str, matrix: Any) -> Any:
    """Return systems as an array; those of a sequence as one column."""
    if isinstance(matrix, np.ndarray) and matrix.dtype != object:
        matrix = real_array(name, matrix).tolist()
    if not isinstance(matrix, list | tuple | np.ndarray):
        raise TypeError(f"{name} must be a list of rows of systems, got {matrix!r:.200}")
    listed = [row if isinstance(row, list | tuple | np.ndarray) else [row] for row in matrix]
    if len({len(row) for row in listed}) != 1:
        raise ValueError(f"{name} must have rows of one length, got {matrix!r:.200}")
    return np.array([[System.of(entry, name) for entry in row] for row in listed], object)


def _states(a: Any) -> list[list[Sum]]:
    """Return s - A_0 - A_1 exp(-s h_1) - ..."""
    given = a if isinstance(a, Mapping) else {0.0: a}
    parts = {h: real_array("a", part) for h, part in given.items()}
    shapes = {part.shape for part in parts.values()}
    shape = shapes.pop()
    if shapes or len(shape) != 2 or shape[0] != shape[1]:
        raise ValueError(f"a must hold square matrices of one size, got {[shape, *shapes]}")
    n = len(next(iter(parts.values())))
    found = [[Sum.of(polynomial([0, int(i == k)])) for k in range(n)] for i in range(n)]
    for h, part in parts.items():
        if isinstance(h, System):
            delay_object(h, "a key of a")
        late = (h if isinstance(h, System) else delay(h)).numerator
        for i, k in zip(*np.nonzero(part), strict=True):
            found[i][k] = found[i][k] + late * _number(-exact(part[i, k]))
    return found


def _whole(matrix: Any) -> tuple[Sum, dict[str, float | None], int, int]:
    """Return the determinant of a matrix whose rows are cleared of denominators.

    With it come the parameters, the degree of these denominators, and how many of the roots at
    s = 0 they make.
    """
    rows = _array("matrix", matrix)
    size, columns = rows.shape
    if size != columns:
        raise ValueError(f"matrix must be square, got {size} x {columns}")
    cleared, poles, zeros = zip(*map(_cleared, rows), strict=True)
    return _determinant(cleared), names_of(rows.ravel()), sum(poles), sum(zeros)


def _cleared(row: Sequence[System]) -> tuple[list[Sum], int, int]:
    """Return a row times its denominators, their degree, and what zeros at s = 0 that makes.

    Where numerator and denominator of an entry are both zero at s = 0, so is the row times the
    denominator. A power of s that all terms of the row hold is divided out then.
    """
    kinds: list[System] = []
    places = []
    for entry in row:
        alike = (k for k, kind in enumerate(kinds) if _proportional(entry, kind))
        places.append(next(alike, len(kinds)))
        if places[-1] == len(kinds):
            kinds.append(entry)
    cleared = []
    for entry, place in zip(row, places, strict=True):
        factor = proportion(kinds[place].denominator, entry.denominator)
        others = (kind.denominator for k, kind in enumerate(kinds) if k != place)
        cleared.append(prod(others, start=entry.numerator * Sum.of(polynomial([factor]))))
    poles = sum(kind.denominator.degree for kind in kinds)
    zeros = sum(kind.cancelled() for kind in kinds)
    powers = [order(p.coeffs()) for entry in cleared for p in entry.terms.values()]
    power = min([zeros, *powers])
    if power:
        cleared = [entry.over(power) for entry in cleared]
    return cleared, poles - power, zeros - power


def _proportional(one: System, other: System) -> bool:
    """Tell whether two systems are one transfer function, up to a number."""
    n, p = one.numerator, other.numerator
    alike = proportion(n, p) if n and p else n == p
    return bool(alike) and proportion(one.denominator, other.denominator) is not None


def _determinant(rows: Sequence[Sequence[Sum]]) -> Sum:
    """Return a determinant by minors of its first rows, without divisions."""
    minors, products = {0: _ONE}, 0
    for row in rows:
        found: dict[int, Sum] = {}
        both = [(j, (entry, -entry)) for j, entry in enumerate(row) if entry]
        for columns, minor in minors.items():
            for j, signed in both:
                if not columns >> j & 1:
                    entry = signed[(columns >> j).bit_count() % 2]
                    products += len(minor.terms) * len(entry.terms)
                    term = minor * entry
                    key = columns | 1 << j
                    found[key] = found[key] + term if key in found else term
            if products > _MOST_PRODUCTS:
                raise ValueError(
                    "matrix must have a determinant that takes less than a minute, got one of "
                    f"{len(rows)} rows: put rows together, or leave states out"
                )
        minors = found
    return minors.get((1 << len(rows)) - 1, Sum({}))
