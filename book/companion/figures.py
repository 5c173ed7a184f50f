"""Figures for the book: their data to download, and numbers for the prose."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping
from itertools import groupby, zip_longest
from string import ascii_lowercase
from typing import SupportsFloat

import numpy as np
import numpy.typing as npt
from IPython.core.interactiveshell import InteractiveShell
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

# Longer curves are thinned for the tables, and charts along both axes.
_MOST_POINTS = 1000
_MOST_CELLS = 50
# Digits after the second in a path of an SVG, which would be a tenth of its size.
_PATH, _DIGITS = re.compile(rb' d="[^"]*"'), re.compile(rb"(\.\d\d)\d+")


def _plain(label: str) -> str:
    """Return an axis label without the marks of its typesetting."""
    return re.sub(r"[$\\{}]|mathrm", "", label)


def _kept(curves: list[npt.NDArray[np.float64]]) -> npt.NDArray[np.intp]:
    """Return which points of curves over the same places a table holds.

    Longer curves are cut into stretches, and of each stretch the lowest and the highest point
    of each curve are kept: a null or a peak may be one point wide.
    """
    size = curves[0].size
    if size <= _MOST_POINTS:
        return np.arange(size)
    ends = [0, size - 1]
    for stretch in np.array_split(np.arange(size), _MOST_POINTS // (2 * len(curves))):
        for y in curves:
            there = y[stretch]
            ends += [
                stretch[np.where(np.isnan(there), sign * np.inf, sign * there).argmin()]
                for sign in (1.0, -1.0)
                if not np.isnan(there).all()
            ]
    return np.unique(ends)


def drawn(figure: Figure) -> dict[str, npt.NDArray[np.float64]]:
    """Return the data that a figure shows, as columns of a table.

    Parameters
    ----------
    figure : Figure
        Its columns are named after the panel (a, b, ... where there are several), the label
        of the curve, and the label of the axis.

    Returns
    -------
    dict of str to array
        Of each curve its two coordinates, a first one that several curves share being given
        once; of each filled area its outline; of each chart a row a point. Lines across the
        whole panel and single marks are left out.
    """
    columns: dict[str, npt.NDArray[np.float64]] = {}
    # Drawings, colour bars and polar axes, whose distances are compressed, are left out.
    panels = [
        ax
        for ax in figure.axes
        if ax.axison and ax.get_label() != "<colorbar>" and ax.name != "polar"
    ]
    for letter, ax in zip(ascii_lowercase, panels, strict=False):
        panel = f"{letter}: " if len(panels) > 1 else ""
        below = [other.get_xlabel() for other in ax.get_shared_x_axes().get_siblings(ax)]
        across = _plain(ax.get_xlabel() or max(below)) or "x"
        up = _plain(ax.get_ylabel()) or "y"
        curves: list[tuple[str, npt.NDArray[np.float64], npt.NDArray[np.float64]]] = []
        for number, artist in enumerate([*ax.lines, *ax.collections], 1):
            if artist.get_transform() != ax.transData:
                continue
            label = str(artist.get_label())
            # Matplotlib's own labels begin with an underscore.
            name = panel + ("" if label.startswith("_") else _plain(label))
            if name == panel or any(name == other for other, *_ in curves):
                name = f"{name}{number}"
            if isinstance(artist, Line2D):
                x, y = np.array(artist.get_data(orig=False), dtype=np.float64)
            elif isinstance(artist, Collection):
                outline = [np.empty((0, 2)), *(path.vertices for path in artist.get_paths())]
                x, y = np.concatenate(outline).T
            else:
                continue
            if x.size > 1:
                curves.append((name, x, y))
        # Curves that follow each other over the same places share a column for them.
        for _, same in groupby(curves, key=lambda curve: curve[1].tobytes()):
            name, x, _ = (group := list(same))[0]
            kept = _kept([y for *_, y in group])
            columns[f"{name}, {across}"] = x[kept]
            columns |= {f"{name}, {up}": y[kept] for name, _, y in group}
        for image in ax.images:
            values: npt.NDArray[np.float64] = np.ma.filled(
                np.ma.asarray(image.get_array()), np.nan
            )
            left, right, low, high = image.get_extent()
            rows, cells = (np.arange(0, n, -(-n // _MOST_CELLS)) for n in values.shape)
            x = left + (right - left) * (cells + 0.5) / values.shape[1]
            y = low + (high - low) * (rows + 0.5) / values.shape[0]
            places = np.meshgrid(x, y)
            columns[f"{panel}chart, {across}"], columns[f"{panel}chart, {up}"] = places
            columns[f"{panel}chart, colour"] = values[np.ix_(rows, cells)]
    return {name: np.ravel(column) for name, column in columns.items()}


def _numbers(name: str, value: object) -> Iterator[tuple[str, object]]:
    """Yield what a value holds, each part under a name of its own."""
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, Mapping):
        parts = list(value.items())
    elif isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim):
        parts = list(enumerate(value))
    else:
        yield name, float(value) if isinstance(value, SupportsFloat) else value
        return
    for key, part in parts:
        yield from _numbers(f"{name}_{key}", part)


def glue(**values: object) -> None:
    """Make numbers and pictures available to the chapter's prose, under their names.

    Parameters
    ----------
    **values : object
        What the prose and the alternative texts refer to: numbers, and what has a picture.
        Of a sequence, a mapping or a named tuple called `edge` the parts are called `edge_0`,
        or `edge_` and the key.
    """
    from myst_nb import glue as glue_one

    for name, value in values.items():
        for part, number in _numbers(name, value):
            glue_one(part, number, display=False)


def as_csv(figure: Figure) -> str:
    """Return the data that a figure shows as the text of a table, empty where it has none."""
    columns = drawn(figure)
    if not columns:
        return ""
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(columns)
    written = ([f"{value:.9g}" for value in column] for column in columns.values())
    table.writerows(zip_longest(*written, fillvalue=""))
    return stream.getvalue()


def load_ipython_extension(shell: InteractiveShell) -> None:
    """Let each figure that a notebook shows carry its data and an SVG, for the build."""

    def files(figure: Figure, **_: object) -> dict[str, str]:
        table = as_csv(figure)
        return {"image/svg+xml": svg(figure).decode()} | ({"text/csv": table} if table else {})

    assert shell.display_formatter is not None
    shell.display_formatter.mimebundle_formatter.for_type(Figure, files)


def svg(figure: Figure) -> bytes:
    """Return a figure as SVG, with coordinates to a hundredth of a point."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    return _PATH.sub(lambda path: _DIGITS.sub(rb"\1", path[0]), buffer.getvalue())
