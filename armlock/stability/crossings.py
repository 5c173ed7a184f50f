"""Real crossings: where N - x M has a zero on the imaginary axis, with x real; all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numba
import numpy as np

from armlock.checks import BoolArray, FloatArray
from armlock.engine import decide, inclusion
from armlock.engine.functions import Function, stacked
from armlock.engine.inclusion import Crossed

# Most steps for some rows: some ten seconds.
_MOST_STEPS = 3_000_000


class Undecided(NamedTuple):
    """Intervals of the axis in which rounding hides crossings, and where these may be.

    Attributes
    ----------
    row : int array, shape (n,)
        Of which row.
    least, most : float array, shape (n,)
        Between which x.
    low, high : float array, shape (n,)
        Between which frequencies in rad/s.
    """

    row: FloatArray
    least: FloatArray
    most: FloatArray
    low: FloatArray
    high: FloatArray


class Crossings(NamedTuple):
    """Crossings, intervals that are undecided, and rows that take too many steps."""

    found: Crossed
    undecided: Undecided
    unfinished: BoolArray


def crossings(
    functions: Sequence[Function],
    y: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    end: FloatArray,
    *,
    begin: float = 0.0,
    fine: float = 0.0,
) -> Crossings:
    """Find where rows f_0 - y f_1 - x f_2 have zeros on the imaginary axis.

    Parameters
    ----------
    functions : sequence of three Function
        Of one space.
    y, lower, upper : float arrays, shape (n,)
        The rows, and between which x; between infinite ones all zeros of Im(N conj M).
    end : float array, shape (n,)
        Frequency in rad/s up to which crossings are looked for; pi / step of a map.
    begin : float, optional
        From which on; zero for the axis with s = 0, where one root crosses alone.
    fine : float, optional
        How exact x has to be.
    """
    space, rows = functions[0].space, stacked(functions)
    # Rows of one block share intervals, and those that end at different x share few.
    alike = (lower == lower[0]).all() and (upper == upper[0]).all()
    block = -(-y.size // (4 * numba.config.NUMBA_NUM_THREADS)) if alike else 4

    def some(k: slice) -> tuple[Any, ...]:
        last = float(end[k].max())
        is_map = bool(space.step) and last >= np.pi / space.step
        result: tuple[Any, ...] = inclusion.cross(
            space.arrays, *rows, y[k], lower[k], upper[k], begin, last, is_map, fine,
            _MOST_STEPS,
        )  # fmt: skip
        for table in result[:2]:
            table[:, 0] += k.start
        return result

    found, undecided, unfinished = map(
        np.concatenate, zip(*decide.in_threads(some, y.size, block), strict=True)
    )
    row, x, spread, omega, width, jump = found.T
    return Crossings(
        Crossed(row.astype(np.int64), x, spread, omega, width, jump.astype(np.int64)),
        Undecided(undecided[:, 0].astype(np.int64), *undecided.T[1:]),
        unfinished,
    )
