"""How results are shown: a short table, as text and in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt


class Table(NamedTuple):
    """What a result shows: a title, and rows of cells, of which the first names the row."""

    title: str
    rows: Sequence[tuple[str, ...]]


def as_text(result: Any) -> str:
    """Show a result with a method `_table` as text, of one line if it has one row."""
    title, rows = result._table()
    if len(rows) == 1:
        return f"{title}: {' '.join(filter(None, rows[0]))}"
    columns = max(map(len, rows), default=0)
    cells = [(*row, *[""] * (columns - len(row))) for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = ("  ".join(map(str.ljust, row, widths)).rstrip() for row in cells)
    return "\n".join((title, *(f"  {line}" for line in lines)))


def as_html(result: Any) -> str:
    """Show a result with a method `_table` as a table, in the colours of the page."""
    title, rows = result._table()
    lines = []
    for first, *others in rows:
        cells = "".join(f'<td style="text-align: left">{escape(cell)}</td>' for cell in others)
        lines.append(f'<tr><th style="text-align: left">{escape(first)}</th>{cells}</tr>')
    style = "caption-side: top; text-align: left; white-space: nowrap"
    caption = f'<caption style="{style}">{escape(title)}</caption>'
    return f"<table>{caption}<tbody>{''.join(lines)}</tbody></table>"


class Shown:
    """A result that shows the table that its method `_table` returns."""

    __repr__, _repr_html_ = as_text, as_html


def number(value: float, unit: str = "") -> str:
    """Return a number of six digits with its unit."""
    return f"{value:.6g} {unit}".rstrip()


def at(omega: float) -> str:
    """Return where something is taken, in rad/s; nothing where it is nowhere."""
    if np.isnan(omega):
        return ""
    return "at high frequency" if np.isinf(omega) else f"at {number(omega, 'rad/s')}"


def spread(values: npt.ArrayLike, unit: str = "") -> str:
    """Return how many values there are, and between which numbers."""
    array = np.asarray(values)
    if not array.size:
        return "none"
    return f"{array.size} from {number(array.min())} to {number(array.max(), unit)}"


def decibels(factor: npt.ArrayLike) -> Any:
    """Return a factor in dB."""
    with np.errstate(divide="ignore"):
        return 20.0 * np.log10(factor)
