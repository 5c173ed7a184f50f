"""Figures for the book: their files and data to download, and pictures behind a slider."""

from __future__ import annotations

import base64
import csv
import html
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from PIL import Image

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
    """
    x, y = np.meshgrid(chart.x[::every], chart.y[::every])
    names = [f"{p} [{u}]" for p, u in zip(chart.system.parameters, units, strict=True)]
    counts = chart.counts[::every, ::every]
    return {
        names[0]: x.ravel(),
        names[1]: y.ravel(),
        "unstable roots [1]": counts.ravel().astype(float),
    }


@dataclass(frozen=True, repr=False)
class Downloads:
    """Links to a figure's files, shown below it in the book."""

    name: str
    files: Sequence[str]

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
    """
    if not os.environ.get("ARMLOCK_FIGURES"):
        return Downloads(name, [])
    stem = Path(os.environ["ARMLOCK_FIGURES"]) / name
    stem.parent.mkdir(parents=True, exist_ok=True)
    if columns:
        with stem.with_suffix(".csv").open("w", newline="") as stream:
            table = csv.writer(stream, lineterminator="\n")
            table.writerow(columns)
            written = ([form % value for value in np.ravel(c)] for c in columns.values())
            table.writerows(zip_longest(*written, fillvalue=""))
    # A palette of 128 colours is all a figure needs, at a third of the size.
    pixels = io.BytesIO()
    figure.savefig(pixels, format="png")
    image = Image.open(pixels).convert("RGB").quantize(128, dither=Image.Dither.NONE)
    image.save(stem.with_suffix(".png"), optimize=True)
    figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})
    endings = ("csv", "png", "svg") if columns else ("png", "svg")
    return Downloads(name, [f"{name}.{ending}" for ending in endings])


# Shows the picture that the slider stands at, and says its label.
_SLIDE = """(box => {
  const labels = box.dataset.labels.split("|"), pictures = box.querySelectorAll("img");
  const range = box.querySelector("input"), text = box.querySelector("output");
  const show = () => {
    const k = Number(range.value);
    pictures.forEach((picture, i) => { picture.hidden = i !== k; });
    text.textContent = labels[k];
    range.setAttribute("aria-valuetext", labels[k]);
  };
  range.addEventListener("input", show);
  show();  // a browser may have kept the slider's place
})"""


@dataclass(frozen=True, repr=False)
class FrameSlider:
    """Pictures of a sweep behind a slider, as HTML that needs neither network nor library.

    Attributes
    ----------
    frames : sequence of bytes
        The pictures as SVG, see `svg`.
    labels : sequence of str
        What the slider says at each frame, plain text without a vertical bar.
    name : str
        Identifier, unique in the book; links can end in it.
    slider : str
        Name of the slider, for instance "Gain".
    alt : str
        What the pictures show, for those who do not see them.
    start : int
        Frame shown at first, and where scripts do not run.
    """

    frames: Sequence[bytes]
    labels: Sequence[str]
    name: str
    slider: str
    alt: str
    start: int

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
            f'<script>{_SLIDE}(document.getElementById("{name}"));</script></div>'
        )


def svg(figure: Figure) -> bytes:
    """Return a figure as SVG, and close it."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    plt.close(figure)
    return buffer.getvalue()
