"""Real crossings: where N - x M has a zero on the imaginary axis, with x real; all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numba
import numpy as np

from armlock.checks import BoolArray, FloatArray, IntArray
from armlock.engine import inclusion
from armlock.engine.decide import blocks, in_threads
from armlock.engine.functions import Function, compiled
from armlock.engine.tolerances import STEPS_OF_ROWS

# The steps of a row are estimated from so many pieces of the axis, each of so many turns of the
# longest delay.
_PIECES, _TURNS = 300, 4


class Crossings(NamedTuple):
    """Zeros on the axis, and intervals of the axis in which rounding hides them.

    Attributes
    ----------
    row : int array, shape (n,)
        Of which row.
    x, spread : float arrays, shape (n,)
        Where the zero is, and how far from it at most.
    omega, width : float arrays, shape (n,)
        Its frequency in rad/s, and how far from it at most.
    jump : int array, shape (n,)
        By how many the zeros on the right increase with x. 0: an undecided interval, which may
        hold any number of zeros.
    unfinished : bool array, shape (rows,)
        Which rows take too many steps.
    """

    row: IntArray
    x: FloatArray
    spread: FloatArray
    omega: FloatArray
    width: FloatArray
    jump: IntArray
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
    most: int = STEPS_OF_ROWS,
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
    most : int, optional
        Steps for the rows of one block.
    """
    three, step = compiled(functions), functions[0].space.step
    # Rows of one block share intervals, and those that end at different x share few.
    alike = (lower == lower[0]).all() and (upper == upper[0]).all()
    block = -(-y.size // (4 * numba.config.NUMBA_NUM_THREADS)) if alike else 4

    def some(k: slice) -> tuple[Any, ...]:
        last = float(end[k].max())
        is_map = bool(step) and last >= np.pi / step
        rows = inclusion.Rows(y[k], lower[k], upper[k])
        table, unfinished, _ = inclusion.cross(three, rows, begin, last, is_map, fine, most)
        table[:, 0] += k.start
        return table, unfinished

    table, unfinished = map(
        np.concatenate, zip(*in_threads(some, blocks(y.size, block)), strict=True)
    )
    row, x, spread, omega, width, jump = table.T
    return Crossings(
        row.astype(np.int64), x, spread, omega, width, jump.astype(np.int64), unfinished
    )


def takes_more(
    functions: Sequence[Function],
    lower: float,
    upper: float,
    begin: float,
    end: float,
    most: int,
) -> bool:
    """Estimate whether a row with y = 0 takes more than so many steps.

    The steps on short pieces of the axis stand for those on all of it. Where the axis has few
    turns of the longest delay nothing is estimated.
    """
    pieces = (end - begin) * functions[0].space.longest / (2.0 * np.pi * _TURNS)
    if pieces < 100.0 * _PIECES:
        return False
    three, row = compiled(functions), inclusion.Rows(*np.array([[0.0], [lower], [upper]]))
    piece, allowed, taken = (end - begin) / pieces, int(most * _PIECES / pieces), 0
    for low in begin + (end - begin) * (np.arange(_PIECES) + 0.5) / _PIECES:
        steps = inclusion.cross(three, row, low, low + piece, False, 0.0, 1 + allowed)[2]
        # A piece of one step lies in a longer interval of one step.
        taken += steps if steps > 1 else 0
        if taken > allowed:
            return True
    return False
