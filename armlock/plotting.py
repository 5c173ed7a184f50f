"""Figures: one style, charts with labelled regions, curves cut at their poles, downloads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from scipy import ndimage

from armlock.checks import even_axis, positive_number, real_number, whole_number
from armlock.dcurve import Branch, Line
from armlock.nyquist import NyquistCurve
from armlock.stability import StabilityChart

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
