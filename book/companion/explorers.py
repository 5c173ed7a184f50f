"""Charts to point at: coordinates, number of unstable roots and rightmost root."""

from __future__ import annotations

import base64
import html
import itertools
import json
from typing import Any

import numpy as np
import numpy.typing as npt

from armlock.checks import ComplexArray, even_axis, whole_number
from armlock.roots import RootError, rightmost_root
from armlock.stability import CountError, StabilityChart

_NUMBER = itertools.count(1)


class ChartExplorer:
    """A chart that a reader can point at, as HTML that needs neither network nor kernel.

    Parameters
    ----------
    chart : StabilityChart
        With ascending, evenly spaced axes.
    every : int
        The rightmost root is computed at every so many points along each axis, and the
        nearest is shown.
    name : str
        What the chart shows, for readers who do not see it.

    Attributes
    ----------
    roots : complex array, shape (rows, columns)
        The rightmost roots in rad/s, nan where none could be certified.

    Raises
    ------
    ValueError
        If an axis does not ascend in equal steps, or `every` is not a positive integer.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import CommonArm, stability_chart
    >>> from book.companion.explorers import ChartExplorer
    >>> axis = np.linspace(-3, 3, 7)
    >>> chart = stability_chart(CommonArm(), axis, axis)
    >>> ChartExplorer(chart, every=3, name="Unstable roots")
    Unstable roots: (7, 7) points; open the book to point at it
    """

    def __init__(self, chart: StabilityChart, *, every: int, name: str) -> None:
        # The script finds its place from the ends of the axes.
        even_axis("chart.x", chart.x)
        even_axis("chart.y", chart.y)
        self.chart, self.name = chart, name
        self.every = whole_number("every", every, 1)
        self.roots: ComplexArray = np.array(
            [[_root(chart, x, y) for x in chart.x[::every]] for y in chart.y[::every]]
        )

    def __repr__(self) -> str:
        """Say what it is."""
        return f"{self.name}: {self.chart.counts.shape} points; open the book to point at it"

    def data(self) -> dict[str, Any]:
        """Return what the script reads, arrays as base64 of their bytes."""
        chart = self.chart
        # One byte a point: 255 for boundary points, counts above 250 as 250.
        counts = np.where(chart.counts < 0, 255, np.minimum(chart.counts, 250))
        return {
            "names": chart.system.parameters,
            "x": [float(chart.x[0]), float(chart.x[-1]), chart.x.size],
            "y": [float(chart.y[0]), float(chart.y[-1]), chart.y.size],
            "counts": _encoded(_runs(counts), "<u2"),
            "every": self.every,
            "re": _encoded(self.roots.real, "<f4"),
            "im": _encoded(np.abs(self.roots.imag), "<f4"),
        }

    def _repr_html_(self) -> str:
        """Return the canvas, a line that speaks, and the script."""
        key, label = f"explorer-{next(_NUMBER)}", html.escape(self.name)
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


def _root(chart: StabilityChart, x: float, y: float) -> complex:
    """Return the rightmost root at a point, nan where none can be certified."""
    try:
        return complex(rightmost_root(chart.system, x, y))
    except (RootError, CountError):
        return complex(np.nan, np.nan)


def _runs(values: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return pairs (length, value) of the runs of equal values, broken at the ends of rows."""
    flat = values.ravel()
    rows = np.arange(0, flat.size, values.shape[1])
    starts = np.union1d(np.flatnonzero(np.diff(flat)) + 1, rows)
    return np.stack((np.diff(starts, append=flat.size), flat[starts]), axis=1)


def _encoded(values: npt.NDArray[Any], kind: str) -> str:
    return base64.b64encode(values.astype(kind).tobytes()).decode()


_SCRIPT = """
function (box, data) {
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const [x0, x1, nx] = data.x, [y0, y1, ny] = data.y;
  const counts = new Uint8Array(nx * ny);
  const runs = new Uint16Array(bytes(data.counts));
  for (let i = 0, at = 0; i < runs.length; i += 2) {
    counts.fill(runs[i + 1], at, at + runs[i]); at += runs[i];
  }
  const every = data.every, columns = Math.ceil(nx / every), rows = Math.ceil(ny / every);
  const re = new Float32Array(bytes(data.re)), im = new Float32Array(bytes(data.im));
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
    const label = k => data.names[k] + (near ? ' \\u2212 1' : '');
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
    const i = Math.min(Math.round(ix / every), columns - 1);
    const j = Math.min(Math.round(iy / every), rows - 1), at = j * columns + i;
    text += Number.isNaN(re[at]) ? '; rightmost root not certified'
      : '; rightmost root ' + (Math.abs(re[at]) < 1e-12 ? '0'
      : re[at].toExponential(2).replace('-', '\\u2212'))
      + (im[at] > 0 ? ' \\u00b1 ' + im[at].toPrecision(3) + 'j' : '') + ' rad/s (at '
      + format(value(x0, x1, nx, i * every)) + ', '
      + format(value(y0, y1, ny, j * every)) + ')';
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
