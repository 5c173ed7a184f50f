"""How results are drawn: the book's style, charts, D-curves and Nyquist curves.

Results draw themselves, as `chart.plot()` does, by the functions here, and import this module
when they are first drawn: a result is Any here, so that nothing is imported in a circle.
python-control draws `loop.frequency_response(omega)`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from matplotlib.projections.polar import PolarAxes

from armlock.checks import ComplexArray, FloatArray

#: Colours of the figures, which the colour-blind tell apart too (Okabe and Ito): the first
#: ones of the colour cycle in armlock.mplstyle.
BLUE, ORANGE, GREEN = "#0072B2", "#D55E00", "#009E73"
#: Fill of the stable region.
STABLE = "#B8C4CE"
# A count is written into a region whose deepest point is at least so far from its edges, as a
# share of the chart's points along its shorter axis.
_ROOM = 0.025
#: Of a compressed Nyquist plot: the circle |L| that stands for infinity, and that up to which
#: the scale is linear.
INFINITY, LINEAR = 1e6, 0.01


def use_style() -> None:
    """Use the book's style for all matplotlib figures that follow."""
    plt.style.use(Path(__file__).with_name("armlock.mplstyle"))


# Charts and D-curves ------------------------------------------------------------------------


def plot_chart(
    chart: Any,
    ax: Axes | None = None,
    *,
    counts: bool = True,
    largest: int = 12,
    labels: bool = False,
    legend: bool | None = None,
    **style: Any,
) -> Axes:
    """Colour a chart by its number of unstable roots, the stable region apart.

    Parameters
    ----------
    chart : StabilityChart
        Points with a root on the boundary stay white. The axes of the figure are linear.
    ax : Axes, optional
        Where to draw; matplotlib's current axes by default.
    counts : bool, optional
        False shades the stable region alone.
    largest : int, optional
        Counts above this share one colour.
    labels : bool, optional
        Write the count into each region that has room for it.
    legend : bool, optional
        Say what the colours are; by default where no counts are written.
    **style
        As `matplotlib.axes.Axes.pcolorfast` takes it, for instance `cmap`.

    Returns
    -------
    Axes

    Raises
    ------
    ValueError
        If an axis holds one value only.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import CommonArm, stability_chart
    >>> axis = np.linspace(-3, 3, 61)
    >>> ax = stability_chart(CommonArm(), axis, axis).plot(labels=True)
    >>> ax.texts[0].get_text()
    '0'
    """
    ax = plt.gca() if ax is None else ax
    unstable = plt.get_cmap("Oranges")(np.linspace(0.08, 0.75, largest))
    style = {"cmap": ListedColormap([STABLE, *unstable]), "vmin": 0, "vmax": largest, **style}
    shown = chart.counts if counts else np.where(chart.stable, 0, -1)
    shown = np.where(shown >= 0, np.minimum(shown, largest), np.nan)
    ax.pcolorfast(_edges("chart.x", chart.x), _edges("chart.y", chart.y), shown, **style)
    label_parameters(ax, chart.parameters)
    if labels:
        _label_regions(ax, chart)
    if not labels if legend is None else legend:
        tops = {"stable": STABLE, "1": unstable[0], f"{largest} or more": unstable[-1]}
        patches = [Patch(facecolor=color, label=name) for name, color in tops.items()]
        patches = patches if counts else patches[:1]
        title = "unstable roots" if counts else None
        ax.legend(handles=patches, title=title, fontsize=10, title_fontsize=10)
    return ax


def _edges(name: str, axis: FloatArray) -> FloatArray:
    """Return the edges of cells around the points of an axis."""
    if axis.size == 1:
        raise ValueError(f"{name} must hold at least two values to be drawn, got {axis}")
    inner = 0.5 * (axis[1:] + axis[:-1])
    return np.concatenate(([2.0 * axis[0] - inner[0]], inner, [2.0 * axis[-1] - inner[-1]]))


def _label_regions(ax: Axes, chart: Any) -> None:
    """Write the count into each region, at its point that is farthest from the edges."""
    from scipy import ndimage  # half a second, which most figures need not wait for

    room = _ROOM * min(chart.counts.shape)
    for count in np.unique(chart.counts[chart.counts >= 0]):
        depth = ndimage.distance_transform_edt(np.pad(chart.counts == count, 1))
        if depth.max() < room:
            continue
        regions, number = ndimage.label(depth)
        for row, column in ndimage.maximum_position(depth, regions, range(1, number + 1)):
            if depth[row, column] >= room:
                box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8}
                x, y = chart.x[column - 1], chart.y[row - 1]
                ax.text(x, y, str(count), ha="center", va="center", fontsize=10, bbox=box)


def label_parameters(ax: Axes, parameters: tuple[str, str]) -> None:
    """Label both axes with the names of two parameters, of one letter as symbols."""
    x, y = map(_written, parameters)
    ax.set(xlabel=x, ylabel=y)


def _written(name: str) -> str:
    """Return a name as it is shown: one letter as a symbol, with digits as its subscript."""
    symbol = re.fullmatch(r"([^\W\d_])(\d*)", name)
    if symbol is None:
        return name.replace("_", " ")
    letter, digits = symbol.groups()
    return f"${letter}_{{{digits}}}$" if digits else f"${letter}$"


def plot_branches(branches: Sequence[Any], ax: Axes | None = None, **style: Any) -> Axes:
    """Draw the branches of a D-curve, as `d_curve_branches` returns them, none joined.

    The style is that of `matplotlib.axes.Axes.plot`; a legend names the first branch.
    """
    ax = plt.gca() if ax is None else ax
    style = {"color": BLUE, "linewidth": 0.8, "rasterized": True, **style}
    for branch in branches:
        ax.plot(branch.x, branch.y, **style)
        style["label"] = None
    return ax


def plot_line(line: Any, ax: Axes | None = None, **style: Any) -> Axes:
    """Draw the line of omega = 0, from `d_curve_line`, across the axes and their limits.

    The style is that of `matplotlib.axes.Axes.axline`.
    """
    ax = plt.gca() if ax is None else ax
    normal = np.array([line.weight_x, line.weight_y])
    foot = line.value * normal / (normal @ normal)
    along = foot + np.array([line.weight_y, -line.weight_x])
    ax.axline(tuple(foot), tuple(along), **{"color": ORANGE, "linestyle": "--", **style})
    return ax


# Roots --------------------------------------------------------------------------------------


def plot_roots(roots: Any, ax: Axes | None = None, **style: Any) -> Axes:
    """Draw characteristic roots, their line, and the region right of it.

    The region is shaded: it holds no other roots. The style is that of
    `matplotlib.axes.Axes.plot`.
    """
    ax = plt.gca() if ax is None else ax
    ax.plot(
        roots.values.real,
        roots.values.imag,
        **{"color": BLUE, "linestyle": "none", "marker": "x", **style},
    )
    right = max(ax.get_xlim()[1], 0.0)
    ax.axvspan(roots.right_of, right, color=STABLE, alpha=0.3, linewidth=0.0)
    ax.axvline(roots.right_of, color=ORANGE, linewidth=0.8)
    ax.axvline(0.0, color="black", linewidth=0.6)
    ax.set(xlabel="real part of $s$ (rad/s)", ylabel="imaginary part of $s$ (rad/s)")
    ax.set_xlim(right=right)
    return ax


# Nyquist curves -----------------------------------------------------------------------------


def plot_nyquist(
    curve: Any,
    ax: Axes | None = None,
    *,
    arrows: Iterable[float] = (),
    margins: Any = None,
    **style: Any,
) -> Axes:
    """Draw a Nyquist curve, both signs of omega, with -1 and the infinite branch.

    Parameters
    ----------
    curve : NyquistCurve
        From `nyquist` with `omega_max`, so that its samples are close.
    ax : Axes, optional
        Where to draw; matplotlib's current axes by default. Plain axes without data show the
        neighbourhood of -1, and never the infinite branch. Polar axes show the
        whole curve: the angle is that of L, and the distance from the origin is linear up to
        0.01 and logarithmic beyond, up to a circle that stands for infinity.
    arrows : iterable of float, optional
        Frequencies in rad/s at which an arrow points in the direction of rising omega; past
        the end of the curve it stands there.
    margins : Margins, optional
        Of the same loop: marked where they are taken, with the unit circle.
    **style
        As `matplotlib.axes.Axes.plot` takes it.

    Returns
    -------
    Axes

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> from armlock import SingleArm, nyquist
    >>> ax = nyquist(SingleArm(), omega_max=1.0).plot(plt.figure().subplots())
    >>> ax.get_xlabel()
    'real part of $L$'
    """
    ax = plt.gca() if ax is None else ax
    compressed = isinstance(ax, PolarAxes)
    if not compressed and not ax.has_data() and ax.get_autoscale_on():
        ax.set(xlim=(-3.0, 3.0), ylim=(-3.0, 3.0))
    forward, omega = curve.response, curve.omega
    if compressed and curve.indentation.size:
        # On to the infinite branch, in the direction in which the curve leaves for it.
        far = INFINITY * forward[:1] / np.abs(forward[:1])
        forward, omega = np.append(far, forward), np.append(0.0, omega)
    for half, width, sign in ((forward, 1.5, ">"), (forward.conj(), 0.7, "<")):
        shown = {"color": BLUE, "linewidth": width, "label": rf"$\omega {sign} 0$", **style}
        ax.plot(*_coordinates(ax, half), **shown)
    for frequency in arrows:
        index = min(int(np.searchsorted(omega, frequency)), omega.size - 2)
        _arrow(ax, forward[index : index + 2], BLUE)
    if margins is not None:
        _mark(ax, curve, margins)
    minus_one = _coordinates(ax, np.array([-1.0 + 0.0j]))
    ax.plot(*minus_one, "+", color="black", markersize=10, markeredgewidth=1.8, zorder=5)
    if isinstance(ax, PolarAxes):
        _infinite_branch(ax, curve)
        ax.spines["polar"].set(edgecolor="0.8", linewidth=0.6, zorder=0)
        ax.set_rscale("asinh", linear_width=LINEAR)
        ax.set_rlim(0.0, INFINITY)
        # No label at the circle through -1, where it would hide the curve.
        ax.set_rgrids(
            [1.0, 1e2, 1e4, INFINITY], ["", "$10^2$", "$10^4$", r"$\infty$"], angle=27
        )
        ax.set_thetagrids([0.0, 90.0, 180.0, 270.0], [])
    else:
        ax.axhline(0.0, color="black", linewidth=0.6)
        ax.axvline(0.0, color="black", linewidth=0.6)
        ax.set(xlabel="real part of $L$", ylabel="imaginary part of $L$")
    return ax


def _coordinates(ax: Axes, values: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return where complex values lie in axes; in polar ones no further out than infinity."""
    if isinstance(ax, PolarAxes):
        return np.angle(values), np.minimum(np.abs(values), INFINITY)
    return values.real, values.imag


def _arrow(ax: Axes, values: ComplexArray, color: str) -> None:
    """Draw an arrow head at the second of two values, seen from the first."""
    start, stop = np.transpose(_coordinates(ax, values))
    arrow = {"arrowstyle": "-|>", "color": color, "mutation_scale": 13, "shrinkB": 0}
    ax.annotate("", stop, start, arrowprops=arrow)


def _mark(ax: Axes, curve: Any, margins: Any) -> None:
    """Mark where a loop's margins are taken."""
    circle = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 400))
    ax.plot(*_coordinates(ax, circle), color="0.6", linewidth=0.8, linestyle=":")
    marks = {
        f"gain {margins.gain_upper:.3g}": (margins.gain_omega, "o"),
        f"phase {margins.phase_degrees:.3g}°": (margins.phase_omega, "s"),
        f"modulus {margins.modulus:.3g}": (margins.modulus_omega, "^"),
    }
    for label, (omega, marker) in marks.items():
        if curve.omega[0] <= omega <= curve.omega[-1]:
            there = np.array([np.interp(omega, curve.omega, curve.response)])
            ax.plot(*_coordinates(ax, there), marker, color=ORANGE, label=label)
    ax.legend(fontsize=10)


def _infinite_branch(ax: Axes, curve: Any) -> None:
    """Draw the image of the indentation around s = 0, if there is one, at infinity."""
    half = INFINITY * curve.indentation_response / np.abs(curve.indentation_response)
    label = r"infinite branch, $\omega = 0$"
    for arc, name in ((half[::-1].conj(), "_"), (half, label)):
        if arc.size:
            ax.plot(
                *_coordinates(ax, arc), color=ORANGE, linestyle="--", label=name, clip_on=False
            )
            _arrow(ax, arc[arc.size // 2 :][:2], ORANGE)
