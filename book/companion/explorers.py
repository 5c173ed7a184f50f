"""Charts to point at: coordinates, number of unstable roots and rightmost root."""

from __future__ import annotations

import base64
import html
import itertools
import json
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import even_axis
from armlock.roots import RootError, rightmost_root
from armlock.stability import CountError, StabilityChart

_NUMBER = itertools.count(1)


class RootGrid:
    """Rightmost roots on a coarse grid.

    Parameters
    ----------
    system : CharacteristicFunction
        In continuous time.
    x, y : array_like of float, one-dimensional
        Values of the two free parameters, ascending in equal steps.

    Raises
    ------
    TypeError, ValueError
        If an axis is not finite and real, empty, or does not ascend in equal steps.

    Attributes
    ----------
    x, y : float array
        The two axes.
    roots : complex array, shape (y.size, x.size)
        nan where no root could be certified.

    Examples
    --------
    >>> from armlock import CommonArm
    >>> from book.companion.explorers import RootGrid
    >>> grid = RootGrid(CommonArm(), [0.9, 1.1], [1.0])
    >>> (grid.roots.real > 0).tolist()
    [[False, True]]
    """

    def __init__(
        self, system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
    ) -> None:
        name1, name2 = checked_system(system).parameters
        self.x, self.y = even_axis(name1, x, least=1), even_axis(name2, y, least=1)
        self.roots = np.full((self.y.size, self.x.size), np.nan, dtype=np.complex128)
        for row, column in np.ndindex(self.roots.shape):
            try:
                root = rightmost_root(system, float(self.x[column]), float(self.y[row]))
            except (RootError, CountError):
                continue
            self.roots[row, column] = complex(root)

    def __repr__(self) -> str:
        """Say how many roots there are, and how many of them were certified."""
        found = int(np.isfinite(self.roots).sum())
        return f"RootGrid({self.x.size} by {self.y.size} points, {found} roots certified)"


class ChartExplorer:
    """A chart that tells what is under the pointer; see `chart_explorer`."""

    def __init__(
        self, chart: StabilityChart, rightmost: RootGrid | None, units: Sequence[str], name: str
    ) -> None:
        if not isinstance(chart, StabilityChart):
            raise TypeError(f"chart must be a StabilityChart, got {chart!r}")
        if rightmost is not None and not isinstance(rightmost, RootGrid):
            raise TypeError(f"rightmost must be a RootGrid, got {rightmost!r}")
        # The script finds its place from the ends of the axes.
        for kind, grid in (("chart", chart), ("rightmost", rightmost)):
            if grid is not None:
                even_axis(f"{kind}.x", grid.x)
                even_axis(f"{kind}.y", grid.y)
        if isinstance(units, str) or len(units) != 2:
            raise ValueError(f"units must be two texts, got {units!r}")
        self.chart = chart
        self.rightmost = rightmost
        self.units = tuple(units)
        self.name = name

    def __repr__(self) -> str:
        """Say what it is."""
        return f"{self.name}: {self.chart.counts.shape} points; open the book to point at it"

    def data(self) -> dict[str, Any]:
        """Return what the script reads, arrays as base64 of their bytes."""
        chart = self.chart
        # One byte a point: 255 for boundary points, counts above 250 as 250.
        counts = np.where(chart.counts < 0, 255, np.minimum(chart.counts, 250))
        found: dict[str, Any] = {
            "names": chart.system.parameters,
            "units": self.units,
            "x": [float(chart.x[0]), float(chart.x[-1]), int(chart.x.size)],
            "y": [float(chart.y[0]), float(chart.y[-1]), int(chart.y.size)],
            "counts": _runs(counts.astype(np.uint8)),
        }
        grid = self.rightmost
        if grid is not None:
            found["root"] = {
                "x": [float(grid.x[0]), float(grid.x[-1]), int(grid.x.size)],
                "y": [float(grid.y[0]), float(grid.y[-1]), int(grid.y.size)],
                "re": _floats(grid.roots.real),
                "im": _floats(np.abs(grid.roots.imag)),
            }
        return found

    def _repr_html_(self) -> str:
        """Return the canvas, a line that speaks, and the script."""
        key = f"explorer-{zlib.crc32(self.name.encode()):08x}-{next(_NUMBER)}"
        label = html.escape(self.name, quote=True)
        data = json.dumps(self.data(), separators=(",", ":"))
        return (
            f'<div class="explorer" id="{key}" data-check="hover">'
            f'<canvas width="560" height="440" tabindex="0" role="application" '
            f'aria-label="{label}. Arrow keys move the point, with shift by ten steps." '
            f'aria-describedby="{key}-at"></canvas>'
            f'<output id="{key}-at" role="status" aria-live="polite">Point at the chart, touch '
            "it, or move with the arrow keys.</output></div>"
            f"<script>({_SCRIPT})(document.getElementById('{key}'),{data});</script>"
        )


def chart_explorer(
    chart: StabilityChart,
    rightmost: RootGrid | None = None,
    *,
    name: str = "Number of unstable roots",
    units: Sequence[str] = ("", ""),
) -> ChartExplorer:
    """Return a chart that a reader can point at, for a notebook.

    Parameters
    ----------
    chart : StabilityChart
        With ascending, evenly spaced axes.
    rightmost : RootGrid, optional
        Rightmost roots on a grid, usually a coarser one; the nearest is shown.
    name : str, optional
        What the chart shows, for readers who do not see it.
    units : pair of str, optional
        Units of the two parameters.

    Returns
    -------
    ChartExplorer
        Self-contained HTML: needs no network and no running kernel.

    Raises
    ------
    TypeError, ValueError
        If there is no chart, an axis does not ascend in equal steps, or there are not two
        units.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import CommonArm, stability_chart
    >>> from book.companion.explorers import chart_explorer
    >>> axis = np.linspace(-3, 3, 7)
    >>> chart_explorer(stability_chart(CommonArm(), axis, axis))
    Number of unstable roots: (7, 7) points; open the book to point at it
    """
    return ChartExplorer(chart, rightmost, units, name)


def _floats(values: npt.NDArray[np.float64]) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode()


def _runs(values: npt.NDArray[np.uint8]) -> str:
    """Return the array row by row as pairs (run length in 16 bits, value), little endian."""
    flat = values.ravel()
    starts = np.concatenate(([0], np.flatnonzero(np.diff(flat)) + 1))
    lengths = np.diff(np.concatenate((starts, [flat.size])))
    pairs = [
        (min(65535, int(rest)), int(flat[start]))
        for start, length in zip(starts, lengths, strict=True)
        for rest in range(int(length), 0, -65535)
    ]
    return base64.b64encode(np.array(pairs, dtype="<u2").tobytes()).decode()


_SCRIPT = """
function (box, data) {
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const [x0, x1, nx] = data.x, [y0, y1, ny] = data.y;
  const counts = new Uint8Array(nx * ny);
  const runs = new Uint16Array(bytes(data.counts));
  for (let i = 0, at = 0; i < runs.length; i += 2) {
    counts.fill(runs[i + 1], at, at + runs[i]); at += runs[i];
  }
  const root = data.root;
  const re = root && new Float32Array(bytes(root.re));
  const im = root && new Float32Array(bytes(root.im));
  const canvas = box.querySelector('canvas'), out = box.querySelector('output');
  const pen = canvas.getContext('2d');
  const left = 62, bottom = 46, top = 8, right = 14;
  const wide = canvas.width - left - right, high = canvas.height - top - bottom;
  let ix = Math.round((nx - 1) / 2), iy = Math.round((ny - 1) / 2), shown = false;
  const picture = document.createElement('canvas');
  picture.width = nx; picture.height = ny;
  const image = new ImageData(nx, ny);
  let largest = 1;
  for (const c of counts) if (c < 250 && c > largest) largest = c;
  for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++) {
    const c = counts[j * nx + i], at = 4 * ((ny - 1 - j) * nx + i);
    const t = Math.sqrt(Math.min(c, largest) / largest);
    const colour = c === 0 ? [184, 196, 206] : c === 255 ? [0, 0, 0]
      : [255 - 46 * t, 240 - 155 * t, 224 - 190 * t];
    image.data.set([...colour, 255], at);
  }
  picture.getContext('2d').putImageData(image, 0, 0);
  const value = (a, b, n, i) => a + (b - a) * i / (n - 1);
  const step = Math.min((x1 - x0) / (nx - 1), (y1 - y0) / (ny - 1));
  const wanted = Math.max(2, Math.min(9, 1 - Math.floor(Math.log10(step))));
  const format = v => {
    if (Math.max(Math.abs(x1 - 1), Math.abs(x0 - 1)) < 0.01)
      return '1 ' + (v < 1 ? '\\u2212 ' : '+ ') + Math.abs(v - 1).toExponential(2);
    return v.toFixed(wanted);
  };
  function draw() {
    const style = getComputedStyle(box);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(picture, left, top, wide, high);
    pen.fillStyle = pen.strokeStyle = style.color;
    pen.font = '13px sans-serif';
    const near = Math.max(Math.abs(x1 - 1), Math.abs(x0 - 1)) < 0.01;
    const tick = v => near ? (v - 1 === 0 ? '0' : (v - 1).toExponential(1).replace('.0e', 'e'))
      : String(+v.toPrecision(3));
    for (let k = 0; k < 5; k++) {
      pen.textAlign = 'center'; pen.textBaseline = 'top';
      pen.fillText(tick(value(x0, x1, 5, k)), left + wide * k / 4, top + high + 6);
      pen.textAlign = 'right'; pen.textBaseline = 'middle';
      pen.fillText(tick(value(y0, y1, 5, k)), left - 6, top + high * (1 - k / 4));
    }
    const label = k => data.names[k] + (near ? ' \\u2212 1' : '')
      + (data.units[k] ? ' [' + data.units[k] + ']' : '');
    pen.textAlign = 'center'; pen.textBaseline = 'bottom';
    pen.fillText(label(0), left + wide / 2, canvas.height - 2);
    pen.save(); pen.translate(12, top + high / 2); pen.rotate(-Math.PI / 2);
    pen.fillText(label(1), 0, 4); pen.restore();
    if (!shown) return;
    const x = left + wide * (ix + 0.5) / nx, y = top + high * (1 - (iy + 0.5) / ny);
    for (const [colour, width] of [['#fff', 5], ['#0072b2', 2]]) {
      pen.strokeStyle = colour; pen.lineWidth = width;
      pen.beginPath(); pen.arc(x, y, 7, 0, 7); pen.stroke();
    }
  }
  function tell() {
    shown = true;
    const x = value(x0, x1, nx, ix), y = value(y0, y1, ny, iy);
    const c = counts[iy * nx + ix];
    let text = data.names[0] + ' = ' + format(x) + ', ' + data.names[1] + ' = ' + format(y)
      + ': ' + (c === 0 ? 'stable' : c === 255 ? 'on the boundary'
      : c + ' unstable root' + (c > 1 ? 's' : ''));
    if (root) {
      const place = (v, [a, b, n]) =>
        Math.max(0, Math.min(n - 1, Math.round((v - a) / (b - a) * (n - 1))));
      const i = place(x, root.x), j = place(y, root.y), at = j * root.x[2] + i;
      text += Number.isNaN(re[at]) ? '; rightmost root not certified'
        : '; rightmost root ' + (Math.abs(re[at]) < 1e-12 ? '0'
        : re[at].toExponential(2).replace('-', '\\u2212'))
        + (im[at] > 0 ? ' \\u00b1 ' + im[at].toPrecision(3) + 'j' : '') + ' rad/s (at '
        + format(value(...root.x, i)) + ', ' + format(value(...root.y, j)) + ')';
    }
    out.textContent = text;
    draw();
  }
  function point(event) {
    const frame = canvas.getBoundingClientRect(), scale = canvas.width / frame.width;
    const x = ((event.clientX - frame.left - canvas.clientLeft) * scale - left) / wide;
    const y = ((event.clientY - frame.top - canvas.clientTop) * scale - top) / high;
    if (x < 0 || x > 1 || y < 0 || y > 1) return;
    ix = Math.min(nx - 1, Math.floor(x * nx));
    iy = Math.min(ny - 1, Math.floor((1 - y) * ny));
    tell();
  }
  canvas.addEventListener('pointermove', point);
  canvas.addEventListener('pointerdown', point);
  canvas.addEventListener('keydown', event => {
    const move = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1],
      ArrowDown: [0, -1]}[event.key];
    if (!move) return;
    event.preventDefault();
    const far = event.shiftKey ? 10 : 1;
    ix = Math.max(0, Math.min(nx - 1, ix + far * move[0]));
    iy = Math.max(0, Math.min(ny - 1, iy + far * move[1]));
    tell();
  });
  new MutationObserver(draw).observe(document.documentElement,
    {attributes: true, attributeFilter: ['data-theme']});
  draw();
}
"""
