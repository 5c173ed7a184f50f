"""How many characteristic roots are unstable, at points of the parameter plane.

By the argument principle along s = j omega (`armlock.engine.decide.counts`), up to a frequency
past which no root can cross. Points are counted with rounded weights and a bound of their
error. A point that this leaves undecided is counted again with exact weights. Among many
points those where rounding hides the sign of D(0) are `BOUNDARY`: exact ones take 2 ms each.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import numpy.typing as npt

from armlock.characteristic import CharacteristicFunction, broadcast_parameters
from armlock.checks import FloatArray, IntArray, real_number
from armlock.delays import DelaySystem
from armlock.engine import decide
from armlock.engine.decide import BOUNDARY, UNCONFINED, UndecidedError
from armlock.engine.functions import Function, stacked
from armlock.engine.inclusion import EPSILON, Functions
from armlock.engine.polynomials import rounded
from armlock.loops import Loop

__all__ = ["BOUNDARY", "UNCONFINED", "CountError", "unstable_roots"]

# Points whose weights are in memory at a time.
_AT_A_TIME = 1 << 16
# Past this an exponential is no float.
_LARGEST_EXPONENT = 700.0


class CountError(RuntimeError):
    """The number of unstable roots could not be decided.

    Attributes
    ----------
    points : float array, shape (n, 2)
        Where.

    Examples
    --------
    >>> from armlock import CommonArm, CountError, unstable_roots
    >>> try:
    ...     unstable_roots(CommonArm(gain=1e10, delay=0.001), 0.5, 0.5)
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


@contextmanager
def decided(what: str, points: FloatArray) -> Iterator[None]:
    """Raise a `CountError` where the engine does not decide at one of some points."""
    try:
        yield
    except UndecidedError as error:
        at = points[error.index : error.index + 1]
        where = "".join(f" at {tuple(point)}" for point in at.tolist())
        raise CountError(f"{what}{where}: {error}", at) from None


def _count_exactly(system: CharacteristicFunction, x: float, y: float, right_of: float) -> int:
    """Count the roots at one point, of a Loop those of the closed loop."""
    function = system.function(x, y)
    # No root cancels where D has none at s = 0.
    common = 0 if function.series(1)[0] else system.cancelled(x, y)
    with decided("no count", np.array([[x, y]])):
        return _count(function, common, right_of)


def _count(function: Function, common: int, right_of: float) -> int:
    """Count the zeros right of a line, without `common` zeros at s = 0."""
    if abs(right_of) * function.space.longest > _LARGEST_EXPONENT:
        raise ValueError(
            f"right_of must be at most {_LARGEST_EXPONENT:.0f} over the longest delay in "
            f"magnitude, got {right_of}: its exponential is no float"
        )
    return decide.count(function, common, right_of=right_of)


def count_points(system: CharacteristicFunction, x: FloatArray, y: FloatArray) -> IntArray:
    """Count at flat arrays of points, as `unstable_roots` does."""
    x0, y0 = system.reference
    # Differences from the reference: next to it, where a loop is used, nothing cancels.
    terms = system.function(x0, y0), system.terms.first, system.terms.second
    (steady, delayed), space = stacked(terms), terms[0].space
    shares = np.stack((np.ones_like(x), x0 - x, y0 - y), axis=-1)
    # On a line D has a root at s = 0. A loop may have none there.
    on_line = np.zeros(x.size, np.bool_)
    if not isinstance(system, Loop):
        at_zero = [term.series(1)[0] for term in terms]
        # Of many fast poles the product is no float.
        sums = shares * rounded([value / (max(map(abs, at_zero)) or 1) for value in at_zero])
        on_line = np.abs(sums.sum(axis=1)) <= 8.0 * EPSILON * np.abs(sums).sum(axis=1)
    confined = system.neutral_margin(x, y) > 0.0
    found = np.where(confined, BOUNDARY, UNCONFINED)
    left = np.flatnonzero(confined & ~on_line)
    for start in range(0, left.size, _AT_A_TIME):
        some = left[start : start + _AT_A_TIME]
        # A share, a weight, their product and two sums round by half an EPSILON each. The
        # factors exp(-s theta) - 1 of delayed weights are at most two.
        sizes = np.abs(shares[some]) @ (np.abs(steady) + 2.0 * np.abs(delayed).sum(axis=-1))
        weights = shares[some] @ steady, np.tensordot(shares[some], delayed, axes=1)
        functions = Functions(space.arrays, *weights, 4.0 * EPSILON * sizes)
        with decided("no count", np.column_stack((x[some], y[some]))):
            found[some] = decide.counts(space, functions)
    for i in left[found[left] == BOUNDARY]:
        found[i] = _count_exactly(system, float(x[i]), float(y[i]), 0.0)
    return found


def unstable_roots(
    system: CharacteristicFunction | DelaySystem,
    c1: npt.ArrayLike | None = None,
    c2: npt.ArrayLike | None = None,
    *,
    right_of: float = 0.0,
) -> IntArray:
    r"""Count the characteristic roots with positive real part.

    Parameters
    ----------
    system : CharacteristicFunction or DelaySystem
        The loop, for instance `CommonArm()`; of a `DelaySystem` L the closed loop 1 + L.
    c1, c2 : array_like of float, optional
        The two free parameters; they broadcast. Those of a loop are one if they are not given.
        Others, such as a and b of `HayesEquation`, have to be given. A `DelaySystem` has none.
    right_of : float, optional
        Count the roots with a larger real part than this, in rad/s.

    Returns
    -------
    int array, of the broadcast shape
        Number of unstable roots, multiplicity included. The point is stable, with all roots
        in the open left half-plane, where it is 0. `BOUNDARY` (-1) where a root lies on the
        imaginary axis, or nearer to it than rounding can tell. Of a `Loop` these are the roots
        of the closed loop: a root s = 0 of D that cancels in L does not count. ``loop.plain()``
        counts the roots of D. The rounding of the phase omega tau is the largest: a point
        within some 8 EPSILON omega tau of the boundary, relative to its parameters, may be
        given as -1 (4e-10 where a root crosses at 1e4 rad/s, with 20 s). `UNCONFINED` (-2)
        where the neutral root chain is not confined to the left half-plane
        (`CharacteristicFunction.neutral_margin` is not positive): an arbitrarily small change
        of the delays can then make infinitely many roots unstable. A chain that is confined by
        no more than rounding, about 1e-14, counts as not confined, and such a loop has no
        margins.

    Raises
    ------
    TypeError, ValueError
        If a number is not finite and real, or c1 and c2 do not broadcast or fit into memory.
    CountError
        If a count takes too many steps, or depends on a pole that may be meant to be zero, see
        `Controller.of`. Nothing is guessed.

    Notes
    -----
    By the argument principle. With n the degree of A,

    .. math::

        N = \frac{n}{2} - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega < \infty} D(\mathrm{j}\omega; c_1, c_2) ,

    which holds for retarded loops, and for neutral ones whose root chain is confined.

    For a map of step h the boundary ends at pi / h, and

    .. math::

        N = n - \frac{1}{\pi}\,
        \Delta\!\arg_{0 \le \omega \le \pi / h} D(\mathrm{j}\omega; c_1, c_2) .

    The argument is followed up to the frequency past which |A| > |C| + |c1 B1| + |c2 B2|.

    Examples
    --------
    >>> from armlock import CommonArm, unstable_roots
    >>> unstable_roots(CommonArm(), [0.9, 0.5, 1.0], [1.05, 1.6, 1.0])
    array([0, 5, 0])

    At (1, 1) the pole of L at s = 0 cancels. D keeps a root there:

    >>> int(unstable_roots(CommonArm().plain(), 1.0, 1.0))
    -1
    """
    right_of = real_number("right_of", right_of)
    if isinstance(system, DelaySystem):
        if c1 is not None or c2 is not None:
            raise TypeError(f"a DelaySystem has no free parameters, got {c1!r} and {c2!r}")
        n, m = system.functions
        with decided("no count", np.empty((0, 2))):
            found = np.array(_count(n + m, system.common, right_of))
        points = np.empty((0, 2))
    else:
        xs, ys = broadcast_parameters(system, c1, c2)
        points = np.column_stack((xs.ravel(), ys.ravel()))
        if xs.size > 1 and right_of == 0.0:
            found = count_points(system, *points.T)
        else:
            found = np.array(
                [_count_exactly(system, a, b, right_of) for a, b in points.tolist()]
            )
        found = found.astype(np.int64).reshape(xs.shape)
    for other in system.others:
        differ = unstable_roots(other, c1, c2, right_of=right_of) != found
        if differ.any():
            raise in_doubt(points[differ.ravel()] if points.size else points)
    return found


def in_doubt(points: FloatArray) -> CountError:
    """Return the error of a count that depends on what is meant by a pole next to zero."""
    return CountError(
        "no count: it depends on whether a pole of a state space is zero, which rounding of "
        "its matrix does not decide; in place of the state space write "
        "Controller.of(state_space, integrators=1), or 2, or 0 if no pole is meant to be zero",
        points,
    )


def require_certain(
    system: CharacteristicFunction | DelaySystem,
    c1: npt.ArrayLike | None = None,
    c2: npt.ArrayLike | None = None,
) -> None:
    """Raise a `CountError` where poles that may be meant to be zero change the count."""
    if system.others:
        unstable_roots(system, *(() if isinstance(system, DelaySystem) else (c1, c2)))
