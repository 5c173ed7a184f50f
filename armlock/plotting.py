"""Figures: one style, charts with labelled regions, curves cut at their poles, downloads."""

from __future__ import annotations

import base64
import html
import io
import os
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from PIL import Image
from scipy import ndimage

from armlock.dsubdivision import Branch, Line
from armlock.nyquist import NyquistCurve
from armlock.stability import StabilityChart
from armlock.validation import even_axis, positive_number, real_number, whole_number

BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER, BLACK = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#56B4E9",
    "#E69F00",
    "#000000",
)
#: Fill of the stable region.
STABLE = "#B8C4CE"


def use_style() -> None:
    """Use the book's matplotlib style from here on."""
    plt.style.use(Path(__file__).with_name("armlock.mplstyle"))


def plot_stable_region(ax: Axes, chart: StabilityChart, color: str = STABLE) -> None:
    """Shade the stable region of a chart and label the axes.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    chart : StabilityChart
        With ascending, evenly spaced axes.
    color : str, optional
        Fill of the region.

    Raises
    ------
    TypeError, ValueError
        If there is no chart, or its axes do not ascend in equal steps.
    """
    _checked_chart(chart)
    _image(ax, chart, np.where(chart.stable, 1.0, np.nan), ListedColormap([color]))


def plot_counts(ax: Axes, chart: StabilityChart, largest: int = 12) -> None:
    """Colour a chart by its number of unstable roots, the stable region apart.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    chart : StabilityChart
        With ascending, evenly spaced axes.
    largest : int, optional
        Counts above this share one colour.

    Raises
    ------
    TypeError, ValueError
        If there is no chart, its axes do not ascend in equal steps, or `largest` is not a
        positive integer.
    """
    largest = whole_number("largest", largest, 1)
    _checked_chart(chart)
    shades = plt.get_cmap("Oranges")(np.linspace(0.08, 0.75, largest))
    colors = ListedColormap([STABLE, *shades])
    values = np.where(chart.counts < 0, np.nan, np.minimum(chart.counts, largest))
    _image(ax, chart, values, colors, 0.0, float(largest))


def _checked_chart(chart: object) -> StabilityChart:
    """Return a chart that a picture shows as it is."""
    if not isinstance(chart, StabilityChart):
        raise TypeError(f"chart must be a StabilityChart, got {chart!r}")
    even_axis("chart.x", chart.x)
    even_axis("chart.y", chart.y)
    return chart


def _image(
    ax: Axes,
    chart: StabilityChart,
    values: npt.NDArray[np.float64],
    colors: ListedColormap,
    low: float | None = None,
    high: float | None = None,
) -> None:
    """Draw a grid of values, cells centred on the axes' points."""
    half_x = 0.5 * (chart.x[-1] - chart.x[0]) / (chart.x.size - 1)
    half_y = 0.5 * (chart.y[-1] - chart.y[0]) / (chart.y.size - 1)
    ax.imshow(
        values,
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        cmap=colors,
        vmin=low,
        vmax=high,
        extent=(
            chart.x[0] - half_x,
            chart.x[-1] + half_x,
            chart.y[0] - half_y,
            chart.y[-1] + half_y,
        ),
    )
    label_parameters(ax, chart.system.parameters)


def label_parameters(ax: Axes, parameters: tuple[str, str]) -> None:
    """Label both axes with the names of the free parameters."""
    ax.set_xlabel(_as_math(parameters[0]))
    ax.set_ylabel(_as_math(parameters[1]))


def _as_math(name: str) -> str:
    """Set a parameter's name as TeX, its digits as subscript."""
    letter = name.rstrip("0123456789")
    digits = name[len(letter) :]
    return f"${letter}_{{{digits}}}$" if digits else f"${letter}$"


def label_regions(ax: Axes, chart: StabilityChart, smallest: float = 0.002) -> None:
    """Write the number of unstable roots into each region of a chart.

    Parameters
    ----------
    ax : Axes
        Where to write.
    chart : StabilityChart
        Any chart.
    smallest : float, optional
        Regions below this share of the chart, from 0 to 1, stay without a label.
    """
    if not 0.0 <= real_number("smallest", smallest) <= 1.0:
        raise ValueError(f"smallest must lie between 0 and 1, got {smallest}")
    for count in np.unique(chart.counts[chart.counts >= 0]):
        regions, number = ndimage.label(chart.counts == count)
        for index in range(1, number + 1):
            region = np.pad(regions == index, 1)
            if region.sum() < smallest * chart.counts.size:
                continue
            depth = ndimage.distance_transform_edt(region)
            row, column = np.unravel_index(np.argmax(depth), depth.shape)
            ax.text(
                chart.x[column - 1],
                chart.y[row - 1],
                str(count),
                ha="center",
                va="center",
                fontsize=8,
                bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8},
            )


def plot_branches(
    ax: Axes,
    branches: Sequence[Branch],
    *,
    color: str = BLUE,
    linewidth: float = 0.8,
    label: str | None = None,
    rasterized: bool = True,
) -> None:
    """Draw the branches of a D-curve, none joined to the next."""
    for index, branch in enumerate(branches):
        ax.plot(
            branch.x,
            branch.y,
            color=color,
            linestyle="-",
            linewidth=linewidth,
            label=label if index == 0 else None,
            rasterized=rasterized,
        )


def plot_line(
    ax: Axes,
    line: Line,
    *,
    color: str = ORANGE,
    linestyle: str = "--",
    label: str | None = None,
) -> None:
    """Draw the straight line of omega = 0 across the axes, keeping their limits."""
    normal = np.array([line.weight_x, line.weight_y])
    foot = line.value * normal / (normal @ normal)
    along = foot + np.array([line.weight_y, -line.weight_x])
    ax.axline(
        (float(foot[0]), float(foot[1])),
        (float(along[0]), float(along[1])),
        color=color,
        linestyle=linestyle,
        label=label,
    )


def plot_nyquist(
    ax: Axes,
    curve: NyquistCurve,
    *,
    unit: float | None = 0.01,
    outer: float = 1e6,
    arrows: Sequence[float] = (),
) -> None:
    """Draw a Nyquist curve, both signs of omega, with -1 and the infinite branch.

    Parameters
    ----------
    ax : Axes
        Where to draw. In the compressed plane its axes are replaced by circles of |L|.
    curve : NyquistCurve
        From `nyquist` with `omega_max`, so that its samples are close.
    unit : float, optional
        L is drawn at log10(1 + |L| / unit) from the origin, in its own direction: linear
        within about `unit`, logarithmic beyond. None keeps the plain complex plane.
    outer : float, optional
        Circle of the compressed plane that stands for infinity: the infinite branch runs
        along it.
    arrows : sequence of float, optional
        Frequencies in rad/s at which an arrow points in the direction of rising omega.

    Raises
    ------
    TypeError, ValueError
        If there is no curve, `unit` or `outer` is not positive, or an arrow lies beyond the
        curve's frequencies.
    """
    if not isinstance(curve, NyquistCurve):
        raise TypeError(f"curve must be a NyquistCurve, got {curve!r}")
    if unit is not None:
        unit = positive_number("unit", unit)
    outer = positive_number("outer", outer)
    forward, omega = curve.response, curve.omega
    for frequency in arrows:
        if not 0.0 < real_number("arrows", frequency) <= omega[-2]:
            raise ValueError(
                f"arrows must lie above 0 and up to {omega[-2]} rad/s, the curve's last sample "
                f"but one, got {frequency}"
            )
    if unit is not None:
        if curve.indentation.size:
            # On to the branch, in the direction in which the curve leaves for it.
            far = outer * forward[:1] / np.abs(forward[:1])
            forward, omega = np.concatenate((far, forward)), np.concatenate(([0.0], omega))
        inside = np.abs(forward) <= outer * (1.0 + 1e-9)
        forward = np.where(inside, forward, outer * forward / np.abs(forward))
    for values, width, label in (
        (forward, 1.5, r"$\omega > 0$"),
        (forward.conj(), 0.7, r"$\omega < 0$"),
    ):
        drawn = values if unit is None else _compressed(values, unit)
        ax.plot(drawn.real, drawn.imag, color=BLUE, linestyle="-", linewidth=width, label=label)
    for frequency in arrows:
        index = int(np.searchsorted(omega, frequency))
        ends = forward[[index, index + 1]]
        _arrow(ax, ends if unit is None else _compressed(ends, unit), BLUE)
    if unit is None:
        ax.axhline(0.0, color="black", linewidth=0.6)
        ax.axvline(0.0, color="black", linewidth=0.6)
        ax.plot(-1.0, 0.0, "+", color="black", markersize=10, markeredgewidth=1.8)
        ax.set(xlabel="Re $L$ [1]", ylabel="Im $L$ [1]")
        return
    if curve.indentation.size:
        half = np.unwrap(np.angle(curve.indentation_response))
        radius = float(np.log10(1.0 + outer / unit))
        for angles in (-half[::-1], half):
            arc = radius * np.exp(1j * angles)
            ax.plot(
                arc.real,
                arc.imag,
                color=ORANGE,
                linestyle="--",
                label=r"infinite branch, $\omega = 0$" if angles is half else "_",
            )
            middle = arc.size // 2
            _arrow(ax, arc[[middle, middle + 1]], ORANGE)
    _circles(ax, unit, outer)


def _compressed(values: npt.NDArray[np.complex128], unit: float) -> npt.NDArray[np.complex128]:
    """Move values radially, to log10(1 + |value| / unit) from the origin."""
    size = np.abs(values)
    # log1p(x) / x tends to one at the origin.
    share = np.divide(np.log1p(size / unit), size, where=size > 0.0, out=np.ones_like(size))
    return np.asarray(values * share / np.log(10.0))


def _arrow(ax: Axes, ends: npt.NDArray[np.complex128], color: str) -> None:
    """Draw an arrow head at the second of two points, seen from the first."""
    start, stop = ((float(z.real), float(z.imag)) for z in ends)
    arrow = {"arrowstyle": "-|>", "color": color, "mutation_scale": 13, "shrinkB": 0}
    ax.annotate("", stop, start, arrowprops=arrow)


def _circles(ax: Axes, unit: float, outer: float) -> None:
    """Draw circles of |L|, the two axes and -1 in the compressed plane."""
    ax.set_axis_off()
    ax.set_aspect("equal")
    turn = np.exp(2j * np.pi * np.linspace(0.0, 1.0, 181))
    decades = np.arange(0, np.log10(outer) + 1e-9, 2.0)
    for decade in decades:
        radius = float(np.log10(1.0 + 10.0**decade / unit))
        last = decade == decades[-1]
        circle = radius * turn
        ax.plot(circle.real, circle.imag, "-", color="0.8", linewidth=0.6, zorder=0)
        text = r"$\infty$" if last else f"$10^{{{decade:.0f}}}$" if decade else "1"
        place = radius * np.exp(0.25j * np.pi)
        ax.text(
            float(place.real),
            float(place.imag),
            text,
            fontsize=8,
            color="0.35",
            ha="center",
            va="center",
            bbox={"fc": "white", "ec": "none", "pad": 0.8},
            zorder=6,
        )
    reach = 1.06 * radius
    ax.plot([-reach, reach], [0.0, 0.0], "-", color="0.6", linewidth=0.6, zorder=0)
    ax.plot([0.0, 0.0], [-reach, reach], "-", color="0.6", linewidth=0.6, zorder=0)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach))
    point = -float(np.log10(1.0 + 1.0 / unit))
    ax.plot(point, 0.0, "+", color="black", markersize=10, markeredgewidth=1.8, zorder=5)


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
    pixels = BytesIO()
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
