"""Conceptual diagrams: the constellation, what takes part in arm locking, and its loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import schemdraw
from matplotlib.axes import Axes
from schemdraw import dsp as blocks

from armlock.plotting import BLUE, ORANGE

Point = tuple[float, float]
# Its elements have no types.
dsp: Any = blocks


def _draw(ax: Axes, parts: list[Any], fontsize: float = 11) -> None:
    """Draw elements in axes, whose units are theirs."""
    ax.set_axis_off()
    ax.set_aspect("equal")
    drawing: Any = schemdraw.Drawing(canvas=ax, show=False, unit=1.0, fontsize=fontsize, lw=1.3)
    for part in parts:
        drawing.add(part)
    drawing.draw(show=False)


def _box(at: Point, width: float, height: float, label: str) -> Any:
    """Return a box centred on a point."""
    return (
        dsp.Box(w=width, h=height)
        .anchor("center")
        .at(at)
        .fill("white")
        .label(label, loc="center")
        .zorder(3)
    )


def _path(*points: Point, color: str = "black", style: str = "-", head: bool = True) -> Any:
    """Return the pieces of a line through points, with a head at its end."""
    last = len(points) - 2
    return [
        (dsp.Arrow() if head and k == last else dsp.Line())
        .at(points[k])
        .to(points[k + 1])
        .color(color)
        .linestyle(style)
        for k in range(last + 1)
    ]


def plot_modules(ax: Axes) -> None:
    """Draw the modules of arm locking on the two spacecraft (paper, Figs. 1 and 2a).

    Light is drawn solid and orange, digital signals dashed and blue, and what acts from
    outside black and dotted.

    Parameters
    ----------
    ax : Axes
        An empty drawing area.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from book.companion.diagrams import plot_modules
    >>> ax = Figure().subplots()
    >>> plot_modules(ax)
    >>> len(ax.texts) > 3
    True
    """
    light: dict[str, Any] = {"color": ORANGE}
    digital: dict[str, Any] = {"color": BLUE, "style": "--"}
    parts = [
        _box((3.7, 6.0), 7.2, 4.6, "").color("#999999").zorder(0),
        _box((3.7, -0.4), 7.2, 1.9, "").color("#999999").zorder(0),
        _box((1.8, 7.4), 2.6, 1.2, "arm-locking\ncontroller"),
        _box((5.6, 7.4), 2.6, 1.2, "phase-\nmeter"),
        _box((1.8, 4.6), 2.6, 1.2, "laser"),
        _box((5.6, 4.6), 2.6, 1.2, "optical\nbench"),
        _box((1.8, -0.4), 2.6, 1.2, "laser, phase-\nlocked loop"),
        _box((5.6, -0.4), 2.6, 1.2, "optical\nbench"),
        _box((3.7, -3.2), 5.4, 1.1, "telescope pointing, clocks, ..."),
        *_path((3.1, 4.6), (4.3, 4.6), **light),
        *_path((5.6, 5.2), (5.6, 6.8), **light),
        *_path((5.3, 4.0), (5.3, 0.2), **light),
        *_path((5.9, 0.2), (5.9, 4.0), **light),
        *_path((4.3, -0.15), (3.1, -0.15), **light),
        *_path((3.1, -0.65), (4.3, -0.65), **light),
        *_path((4.3, 7.4), (3.1, 7.4), **digital),
        *_path((1.8, 6.8), (1.8, 5.2), **digital),
        *_path((1.8, -2.65), (1.8, -1.0), style=":"),
        *_path((6.4, -3.2), (9.0, -3.2), (9.0, 7.4), (6.9, 7.4), style=":"),
    ]
    _draw(ax, parts)
    for y, text in ((8.4, "local spacecraft"), (-1.45, "remote spacecraft")):
        side = "bottom" if y > 0 else "top"
        ax.text(3.9, y, text, ha="center", va=side, fontsize=11)
    ax.text(5.1, 2.1, r"out: $\varphi(t)$", ha="right", va="center", fontsize=11)
    back = "back:\n" + r"$c\,\varphi(t-\tau) + n$"
    ax.text(6.1, 2.1, back, ha="left", va="center", fontsize=11)
    ax.set(xlim=(-0.1, 9.3), ylim=(-3.9, 9.1))


def plot_loop(ax: Axes) -> None:
    """Draw the loop with its two perturbed delays as blocks (after the paper's Fig. 2b).

    Parameters
    ----------
    ax : Axes
        An empty drawing area.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from book.companion.diagrams import plot_loop
    >>> ax = Figure().subplots()
    >>> plot_loop(ax)
    >>> len(ax.texts) > 3
    True
    """
    upper, lower = 0.0, -3.2
    parts: list[Any] = [
        *_path((-1.6, 1.6), (-0.05, 1.6)),
        dsp.Sum().anchor("center").at((0.45, 1.6)).fill("white"),
        *_path((0.95, 1.6), (14.4, 1.6)),
        dsp.Dot().at((13.4, 1.6)),
        *_path((13.4, 1.6), (13.4, lower), head=False),
    ]
    for y, k in ((upper, 1), (lower, 2)):
        parts += [
            dsp.Dot().at((13.4, y)) if k == 1 else dsp.Dot(radius=0.02).at((13.4, y)),
            *_path((13.4, y), (8.4, y)),
            dsp.Dot().at((12.9, y)),
            *_path((12.9, y), (12.9, y - 1.6), (12.3, y - 1.6)),
            _box((11.4, y - 1.6), 1.8, 0.9, rf"$e^{{-s\tau_{k}}}$"),
            *_path((10.5, y - 1.6), (9.9, y - 1.6)),
            _box((9.3, y - 1.6), 1.2, 0.9, f"$c_{k}$"),
            *_path((8.7, y - 1.6), (7.9, y - 1.6), (7.9, y - 0.5)),
            dsp.Sum().anchor("center").at((7.9, y)).fill("white"),
            _box((5.7, y), 1.9, 0.9, f"$m_{k}(s)$"),
            *_path((7.4, y), (6.65, y)),
        ]
    middle = 0.5 * (upper + lower)
    parts += [
        *_path((4.75, upper), (4.0, upper), (4.0, middle + 0.5)),
        *_path((4.75, lower), (4.0, lower), (4.0, middle - 0.5)),
        dsp.Sum().anchor("center").at((4.0, middle)).fill("white"),
        *_path((3.5, middle), (2.5, middle)),
        _box((1.6, middle), 1.8, 1.0, "$K(s)$"),
        *_path((0.7, middle), (0.45, middle), (0.45, 1.1)),
    ]
    _draw(ax, parts, fontsize=13)
    for y in (upper, lower):
        ax.text(8.15, y - 0.75, "−", ha="left", va="center", fontsize=13)
    ax.text(-1.8, 2.15, r"laser, $\varphi_0$", ha="left", va="bottom", fontsize=13)
    ax.text(14.4, 1.75, r"$\varphi$", ha="right", va="bottom", fontsize=13)
    ax.text(0.2, 0.75, "−", ha="right", va="center", fontsize=13)
    ax.set(xlim=(-1.9, 14.7), ylim=(-5.6, 2.6))


def plot_constellation(ax: Axes) -> None:
    """Draw three spacecraft, the two arms of the master, the light's way, and the loop.

    Light is drawn solid and orange, signals of the loop dashed and blue.

    Parameters
    ----------
    ax : Axes
        An empty drawing area.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from book.companion.diagrams import plot_constellation
    >>> ax = Figure().subplots()
    >>> plot_constellation(ax)
    >>> len(ax.texts) > 3
    True
    """
    ax.set_axis_off()
    ax.set_aspect("equal")
    master, remote = np.zeros(2), 6.0 * np.array([[-0.5, 0.866], [0.5, 0.866]])
    ax.plot(*remote.T, ":", color="#999999", zorder=0)
    for spacecraft in (master, *remote):
        ax.plot(*spacecraft, "s", color="white", markeredgecolor="black", ms=15, zorder=3)
    ax.text(-0.7, 0.0, "master spacecraft,\nwith the laser", ha="right", va="center")
    for far, number in zip(remote, ("2", "1"), strict=True):
        ax.text(far[0], far[1] + 0.75, f"spacecraft {number}", ha="center", va="center")
    for far, number in zip(remote, ("2", "1"), strict=True):
        along = far / np.hypot(*far)
        aside = 0.14 * np.array([-along[1], along[0]])
        near, end = 0.45 * along, far - 0.45 * along
        for start, stop in ((near + aside, end + aside), (end - aside, near - aside)):
            arrow = {"arrowstyle": "-|>", "color": ORANGE, "shrinkA": 0.0, "shrinkB": 0.0}
            ax.annotate("", stop, start, arrowprops=arrow)
        side = 1.0 if number == "1" else -1.0
        x, y = 0.5 * far
        ax.text(
            x + 0.45 * side, y, f"arm {number}", ha=("right", "left")[side > 0], va="center"
        )
    ax.text(0.0, 3.9, "out and back:\nabout 20 s", ha="center", va="center", color=ORANGE)
    arrow = {"arrowstyle": "-|>", "color": BLUE, "linestyle": "--", "shrinkA": 0.0}
    for start, end in (((0.35, -0.35), (2.6, -1.7)), ((-2.6, -1.7), (-0.35, -0.35))):
        ax.annotate("", end, start, arrowprops=arrow)
    ax.annotate("", (-1.55, -2.3), (1.45, -2.3), arrowprops=arrow)
    box = {"boxstyle": "round,pad=0.3", "facecolor": "white", "edgecolor": BLUE}
    ax.text(2.7, -2.3, "compare with\nreturned light", ha="center", va="center", bbox=box)
    ax.text(-2.7, -2.3, "controller\nsteers laser", ha="center", va="center", bbox=box)
    ax.set(xlim=(-4.6, 4.6), ylim=(-3.2, 6.6))


def plot_growth(axes: Any) -> None:
    """Draw one arm, an interferometer of two arms, and the constellation.

    Parameters
    ----------
    axes : array of Axes, shape (3,)
        Empty drawing areas.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from book.companion.diagrams import plot_growth
    >>> axes = Figure().subplots(3)
    >>> plot_growth(axes)
    >>> [len(ax.texts) > 3 for ax in axes]
    [True, True, True]
    """
    one, two, three = axes
    arrow = {"arrowstyle": "-|>", "color": ORANGE, "shrinkA": 0.0, "shrinkB": 0.0}

    def arm(ax: Axes, start: float, end: float, words: str) -> None:
        gap = 0.28 if end > start else -0.28
        ax.annotate("", (end - gap, 0.12), (start + gap, 0.12), arrowprops=arrow)
        ax.annotate("", (start + gap, -0.12), (end - gap, -0.12), arrowprops=arrow)
        ax.text((start + end) / 2, 0.3, words, ha="center", va="bottom", color=ORANGE)

    for ax, places in (
        (one, {"laser": -3.5, "spacecraft 1": 3.5}),
        (two, {"spacecraft 2": -2.6, "laser": -0.4, "spacecraft 1": 3.5}),
    ):
        ax.set_axis_off()
        ax.set_aspect("equal")
        for name, x in places.items():
            ax.plot(x, 0, "s", color="white", markeredgecolor="black", ms=13, zorder=3)
            ax.text(x, -0.45, name, ha="center", va="top")
        ax.set_xlim(-4.6, 4.6)
    arm(one, -3.5, 3.5, "out and back: about 20 s")
    arm(two, -0.4, 3.5, "longer arm")
    arm(two, -0.4, -2.6, "shorter arm")
    two.text(0.3, -1.2, "the returned beams are compared", ha="center", va="top", color=BLUE)
    one.set_ylim(-1.0, 0.9)
    two.set_ylim(-1.7, 0.9)
    plot_constellation(three)
    for ax, letter in zip(axes, "abc", strict=True):
        ax.text(0.0, 1.0, letter, transform=ax.transAxes, weight="bold", va="top")
