"""Figures for the book: their files and data to download, and pictures behind a slider."""

from __future__ import annotations

import base64
import html
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from PIL import Image

from armlock.checks import whole_number
from armlock.plotting import BLUE
from armlock.stability import StabilityChart


def chart_columns(
    chart: StabilityChart, *, every: int = 1, units: tuple[str, str] = ("1", "1")
) -> dict[str, npt.NDArray[np.float64]]:
    """Return a chart as columns for `publish`, a row a point.

    Parameters
    ----------
    chart : StabilityChart
        Any chart.
    every : int, optional
        Take every so many points along each axis.
    units : pair of str, optional
        Units of the two free parameters.

    Returns
    -------
    dict of str to array
        The two free parameters and the number of unstable roots.

    Raises
    ------
    ValueError
        If `every` is not a positive integer.
    """
    every = whole_number("every", every, 1)
    x, y = np.meshgrid(chart.x[::every], chart.y[::every])
    names = [f"{p} [{u}]" for p, u in zip(chart.system.parameters, units, strict=True)]
    counts = chart.counts[::every, ::every]
    return {
        names[0]: x.ravel(),
        names[1]: y.ravel(),
        "unstable roots [1]": counts.ravel().astype(float),
    }


class Downloads:
    """Links to a figure's files, shown below it in the book."""

    def __init__(self, name: str, files: Sequence[str]) -> None:
        self.name = name
        self.files = files

    def __repr__(self) -> str:
        """Name the files."""
        return f"{self.name}: {', '.join(self.files) or 'files are written by make book'}"

    def _repr_html_(self) -> str:
        """Return links relative to a page one folder below the book's root."""
        if not self.files:
            return f"<p>The files of <code>{self.name}</code> are written by the book.</p>"
        links = " · ".join(
            f'<a href="../figures/{file}" download>{file.rsplit(".", 1)[1].upper()}</a>'
            for file in self.files
        )
        return f'<p class="figure-downloads">Download this figure: {links}</p>'


def publish(
    figure: Figure, name: str, columns: Mapping[str, npt.ArrayLike], *, form: str = "%.7g"
) -> Downloads:
    """Write a figure as PNG and SVG and its data as CSV, and link to them.

    Parameters
    ----------
    figure : Figure
        The figure.
    name : str
        Stem of the files, unique in the book.
    columns : mapping of str to array_like
        Columns of the CSV, named with their units, for instance "omega [rad/s]". Shorter
        columns are padded with empty fields. Empty for a drawing, which has no data.
    form : str, optional
        Format of the numbers.

    Returns
    -------
    Downloads
        Shows links in a notebook. The files go to the folder named by the environment
        variable ARMLOCK_FIGURES, which the book's build sets; without it none are written.

    Raises
    ------
    ValueError
        If the name is empty or holds a folder.
    """
    if not name or Path(name).name != name:
        raise ValueError(f"name must be the stem of a file, without a folder, got {name!r}")
    folder = os.environ.get("ARMLOCK_FIGURES")
    if not folder:
        return Downloads(name, [])
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    arrays = [np.ravel(np.asarray(column)) for column in columns.values()]
    length = max((array.size for array in arrays), default=0)
    # A name may hold a comma, and is quoted then.
    lines = [",".join(f'"{head}"' if "," in head else head for head in columns)]
    lines += [
        ",".join(form % array[i] if i < array.size else "" for array in arrays)
        for i in range(length)
    ]
    if columns:
        (target / f"{name}.csv").write_text("\n".join(lines) + "\n")
    # A palette of 128 colours is all a figure needs, at a third of the size.
    pixels = io.BytesIO()
    figure.savefig(pixels, format="png")
    image = Image.open(pixels).convert("RGB").quantize(128, dither=Image.Dither.NONE)
    image.save(target / f"{name}.png", optimize=True)
    figure.savefig(target / f"{name}.svg", metadata={"Date": None})
    endings = ("csv", "png", "svg") if columns else ("png", "svg")
    return Downloads(name, [f"{name}.{ending}" for ending in endings])


class FrameSlider:
    """Pictures of a sweep behind a slider, as HTML that needs neither network nor library.

    Parameters
    ----------
    frames : sequence of bytes
        The pictures as SVG, see `svg`.
    labels : sequence of str
        What the slider says at each frame, plain text.
    name : str
        Identifier, unique in the book; links can end in it.
    slider : str
        Name of the slider, for instance "Gain".
    alt : str
        What the pictures show, for those who do not see them.
    start : int, optional
        Frame shown at first, and where scripts do not run.

    Raises
    ------
    ValueError
        If there are no frames, not as many labels, or no frame `start`.
    """

    def __init__(
        self,
        frames: Sequence[bytes],
        labels: Sequence[str],
        *,
        name: str,
        slider: str,
        alt: str,
        start: int = 0,
    ) -> None:
        if not frames or len(frames) != len(labels):
            raise ValueError(
                f"frames and labels must be as many, at least one, got {len(frames)} and "
                f"{len(labels)}"
            )
        if not 0 <= start < len(frames):
            raise ValueError(f"start must be a frame from 0 to {len(frames) - 1}, got {start}")
        self.frames, self.labels, self.start = list(frames), list(labels), start
        self.name, self.slider, self.alt = name, slider, alt

    def __repr__(self) -> str:
        """Say how many frames there are."""
        return f"FrameSlider({self.name!r}, {len(self.frames)} frames)"

    def _repr_html_(self) -> str:
        """Return pictures, slider and the few lines of script that join them."""
        name, current = html.escape(self.name), html.escape(self.labels[self.start])
        pictures = "".join(
            f'<img src="data:image/svg+xml;base64,{base64.b64encode(frame).decode()}" '
            f'alt="{html.escape(f"{self.alt} {label}")}" style="width: 100%; height: auto"'
            f"{'' if index == self.start else ' hidden'}>"
            for index, (frame, label) in enumerate(zip(self.frames, self.labels, strict=True))
        )
        labels = html.escape("|".join(self.labels))
        return (
            f'<div id="{name}" class="frame-slider" data-labels="{labels}" '
            f'style="margin: 1rem auto; max-width: 34rem">{pictures}'
            f'<p><label for="{name}-range">{html.escape(self.slider)}: '
            f'<output for="{name}-range">{current}</output></label>'
            f'<input id="{name}-range" type="range" min="0" max="{len(self.frames) - 1}" '
            f'step="1" value="{self.start}" aria-valuetext="{current}" '
            f'style="width: 100%; min-height: 2rem; accent-color: {BLUE}"></p>'
            "<script>(() => {"
            f'const box = document.getElementById("{name}");'
            'const labels = box.dataset.labels.split("|");'
            'const pictures = box.querySelectorAll("img");'
            'const range = box.querySelector("input"), text = box.querySelector("output");'
            "const show = () => { const k = Number(range.value);"
            "pictures.forEach((picture, i) => { picture.hidden = i !== k; });"
            'text.textContent = labels[k]; range.setAttribute("aria-valuetext", labels[k]); };'
            'range.addEventListener("input", show); show();'
            "})();</script></div>"
        )


def svg(figure: Figure) -> bytes:
    """Return a figure as SVG, and close it."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    plt.close(figure)
    return buffer.getvalue()
