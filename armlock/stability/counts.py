"""How many characteristic roots are unstable, at points of the parameter plane.

By the argument principle along s = j omega (`armlock.engine.decide.counts`), up to a frequency
past which no root can cross. Points are counted with rounded weights and a bound of their
error. A point that this leaves undecided is counted again with exact weights, from which the
behaviour at s = 0 is known. What -1, -2 and -3 mean, and the tolerances behind them, stands in
`armlock.engine.tolerances`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
import numpy.typing as npt

from armlock.checks import (
    BoolArray,
    FloatArray,
    IntArray,
    broadcast_shape,
    check_memory,
    real_array,
    real_number,
)
from armlock.engine import decide
from armlock.engine.affine import Affine, NotAffineError, present
from armlock.engine.functions import Function, check_sizes, common_zeros, stacked
from armlock.engine.inclusion import Functions
from armlock.engine.tolerances import BOUNDARY, EPSILON, UNCONFINED, UNDECIDED, UndecidedError
from armlock.systems import System

__all__ = ["BOUNDARY", "UNCONFINED", "UNDECIDED", "CountError", "unstable_roots"]

# Points whose weights are in memory at a time.
_AT_A_TIME = 1 << 16
# What a count is until exact weights decide it.
_EXACTLY = -4
# Past this an exponential is no float.
_LARGEST_EXPONENT = 700.0


class CountError(RuntimeError):
    """The number of unstable roots could not be decided.

    Attributes
    ----------
    points : float array, shape (n, k)
        Where, in the order of the parameters.

    Examples
    --------
    >>> from armlock import CommonArm, CountError, unstable_roots
    >>> try:
    ...     unstable_roots(CommonArm(gain=1e10).replace(delay=0.001), 0.5, 0.5)
    ... except CountError as error:
    ...     print("undecided at", error.points)
    undecided at [[0.5 0.5]]
    """

    def __init__(self, message: str, points: FloatArray) -> None:
        super().__init__(message)
        self.points = points

    def __reduce__(self) -> tuple[type[CountError], tuple[str, FloatArray]]:
        """Pickle the points along, so that the error passes from process to process."""
        return type(self), (str(self), self.points)


def place(point: FloatArray) -> str:
    """Return " at (1.0, 1.0)", or nothing without parameters."""
    return f" at {tuple(point.tolist())}" if point.size else ""


@contextmanager
def decided(what: str, point: FloatArray) -> Iterator[None]:
    """Raise a `CountError` where the engine does not decide at a point, shape (k,)."""
    try:
        yield
    except UndecidedError as error:
        raise CountError(f"{what}{place(point)}: {error}", point[None]) from None


def count_exactly(n: Function, m: Function, right_of: float = 0.0) -> int:
    """Count the roots of N + M = 0, of a loop those of the closed loop."""
    function = n + m
    # No root cancels where D has none at s = 0.
    cancelled = 0 if function.series(1)[0] else common_zeros(n, m)
    if abs(right_of) * function.space.longest > _LARGEST_EXPONENT:
        raise ValueError(
            f"right_of must be at most {_LARGEST_EXPONENT:.0f} over the longest delay in "
            f"magnitude, got {right_of}: its exponential is no float"
        )
    return decide.count(function, cancelled, right_of=right_of)


def count_points(affine: Affine, points: FloatArray) -> IntArray:
    """Count at points of the parameters that vary, shape (n, k), as `unstable_roots` does."""
    found, space = np.full(len(points), UNCONFINED), affine.space
    for start in range(0, len(points), _AT_A_TIME):
        functions = _rounded(affine, points[start : start + _AT_A_TIME])
        limits = space.limits(functions.steady, functions.delayed)
        confined = np.flatnonzero(space.confined(*limits))
        chosen = Functions(functions.space, *(v[confined] for v in functions[1:]))
        counted = decide.counts(space, chosen)
        # What rounded weights do not confine, or leave on the axis, exact ones may decide.
        unsure = np.isin(counted, (UNCONFINED, BOUNDARY))
        found[start + confined] = np.where(unsure, _EXACTLY, counted)
        here = np.flatnonzero(found[start : start + _AT_A_TIME] == UNCONFINED)
        found[start + here[_degree_falls(affine, points[start + here])]] = _EXACTLY
    for i in np.flatnonzero(found == _EXACTLY):
        try:
            found[i] = count_exactly(*present(*affine.quotient(*points[i].tolist())))
        except UndecidedError:
            found[i] = UNDECIDED
    return found


def _degree_falls(affine: Affine, points: FloatArray) -> BoolArray:
    """Tell at which points rounding hides whether N and M have the degree of their space."""
    shares, falls = np.column_stack((np.ones(len(points)), points)), np.ones(len(points), bool)
    for part in (affine.n, affine.m):
        limits = np.column_stack(affine.space.limits(*stacked(part)))
        off = (2.0 + len(part)) * EPSILON * (np.abs(shares) @ np.abs(limits))
        falls &= (np.abs(shares @ limits) <= off).all(axis=1)
    return falls


def _rounded(affine: Affine, points: FloatArray) -> Functions:
    """Return D at points with rounded weights and a bound of their error."""
    # Differences from the origin: next to it, where a loop is used, nothing cancels.
    terms = [affine.function(*affine.origin), *affine.terms[1:]]
    steady, delayed = stacked(terms)
    shares = np.column_stack((np.ones(len(points)), points - np.array(affine.origin)))
    # A share, a weight, their product and the sums round by half an EPSILON each. The factors
    # exp(-s theta) - 1 of delayed weights are at most two.
    with np.errstate(over="ignore", invalid="ignore"):
        sizes = np.abs(shares) @ (np.abs(steady) + 2.0 * np.abs(delayed).sum(axis=-1))
        moved = check_sizes(shares @ steady, np.tensordot(shares, delayed, axes=1))
    return Functions(
        affine.space.arrays,
        *moved,
        (2.0 + len(terms)) * EPSILON * sizes,
    )


def unstable_roots(
    system: System,
    *values: npt.ArrayLike,
    right_of: float = 0.0,
    **numbers: npt.ArrayLike,
) -> Any:
    r"""Count the characteristic roots with positive real part.

    Parameters
    ----------
    system : System
        The open loop L, for instance `CommonArm()`, or an equation D = 0 (`equation`). A closed
        loop in place of L would be closed again.
    *values, **numbers : array_like of float, optional
        The parameters, in the order of their first use or by name, such as c1 and c2 of a
        `Loop`; they broadcast. Those that are not given are nominal, 1 for c1 and c2. Where
        those that are arrays are multiplied, the points are counted one by one.
    right_of : float, optional
        Count the roots with a larger real part than this, in rad/s.

    Returns
    -------
    int, or int array of the broadcast shape
        Number of unstable roots, multiplicity included. The point is stable, with all roots
        in the open left half-plane, where it is 0. `BOUNDARY` (-1) where a root lies on the
        imaginary axis, or nearer to it than rounding can tell. Of a loop these are the roots
        of the closed loop: a root s = 0 of D that cancels in L does not count.
        ``equation(1 + loop)`` counts the roots of D. -1 says that D(j omega) at some omega is
        below some 10 EPSILON (n + omega tau) of the sum of its terms' sizes, with the degrees
        of N and M together as n and the longest delay as tau. This is 4e-10 of the parameters
        where a root crosses at 1e4 rad/s, with 20 s, and no terms cancel. `UNCONFINED`
        (-2) where the neutral root chain is not shown to be confined to the left half-plane: at
        the highest power of s, delayed terms are together as large as what is not delayed, up
        to rounding of about 1e-14. An arbitrarily small change of one delay object can then
        make infinitely many roots unstable; only where several products share one object, the
        chain may be confined all the same. Such a loop has no margins. `UNDECIDED` (-3) at a
        point among several that takes too many steps.

    Raises
    ------
    TypeError, ValueError
        If a number is not finite and real, a parameter is missing or unknown, or the values do
        not broadcast or fit into memory.
    CountError
        If the count at a single point takes too many steps. Nothing is guessed.

    Notes
    -----
    By the argument principle. With n the degree of D,

    .. math::

        N = \frac{n}{2} - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega < \infty} D(\mathrm{j}\omega) ,

    which holds for retarded loops, and for neutral ones whose root chain is confined.

    For a map of step h the boundary ends at pi / h, and

    .. math::

        N = n - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega \le \pi / h} D(\mathrm{j}\omega) .

    The argument is followed up to a frequency past which the highest power of s exceeds all
    else (Lemma 12).

    Examples
    --------
    >>> from armlock import CommonArm, equation, unstable_roots
    >>> unstable_roots(CommonArm(), [0.9, 0.5, 1.0], [1.05, 1.6, 1.0])
    array([0, 5, 0])

    At (1, 1) the pole of L at s = 0 cancels. D keeps a root there:

    >>> unstable_roots(equation(1 + CommonArm()))
    -1
    """
    right_of = real_number("right_of", right_of)
    system, points, shape = at_points(system, values, numbers)
    if len(points) > 1 and right_of == 0.0:
        with suppress(NotAffineError):
            return count_points(*_over(system, points)).reshape(shape)
    found = np.empty(len(points), np.int64)
    for i, point in enumerate(points):
        try:
            found[i] = count_exactly(*system.functions(point.tolist()), right_of)
        except UndecidedError as error:
            if len(points) == 1:
                raise CountError(f"no count{place(point)}: {error}", points) from None
            found[i] = UNDECIDED
    return found.reshape(shape) if shape else int(found[0])


def _over(system: System, points: FloatArray) -> tuple[Affine, FloatArray]:
    """Return a system, affine in the parameters that vary, and the points of these."""
    with suppress(NotAffineError):
        return system.affine, points
    varies = (points != points[0]).any(axis=0)
    names = np.array(system.parameters)
    held = dict(zip(names[~varies].tolist(), points[0, ~varies].tolist(), strict=True))
    return system.affine_in(names[varies].tolist(), **held), points[:, varies]


def at_points(
    system: System, values: tuple[npt.ArrayLike, ...], numbers: dict[str, npt.ArrayLike]
) -> tuple[System, FloatArray, tuple[int, ...]]:
    """Return the system, points of its parameters, shape (n, k), and the shape of results."""
    system = System.of(system)
    given = {k: real_array(k, v) for k, v in system.given(values, numbers).items()}
    shape = broadcast_shape(tuple(given), tuple(given.values()))
    check_memory(" and ".join(given) or "values", shape, 64)
    columns = [np.broadcast_to(x, shape).ravel() for x in given.values()]
    return system, np.column_stack(columns or [np.empty((1, 0))]), shape


def require_stable(
    d: Function, common: int = 0, what: str = "loop", zero: str = "root"
) -> None:
    """Raise unless D has no zero with a real part of zero or more, but `common` at s = 0."""
    count = decide.count(d, common)
    if count != 0:
        reasons = {
            BOUNDARY: f"a {zero} on the imaginary axis",
            UNCONFINED: "no confined chain: small delay changes may make it unstable",
            1: f"1 unstable {zero}",
        }
        found = reasons.get(count, f"{count} unstable {zero}s")
        raise ValueError(f"{what} must be stable, but it has {found}")
