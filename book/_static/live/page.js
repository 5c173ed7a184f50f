"use strict";
/*
 * The live pages: a form, a chart of the stable region that answers the pointer, plots.
 *
 * All mathematics is in loop.js and runs in one worker. A page that is opened from disk may not
 * load a worker's script, so that the worker is made of the functions' own text.
 */
(function () {
  const TURN = 2 * Math.PI;
  const hertz = values => values.map(f => [-TURN * f, 0]);
  const PAPER = {
    sensor: "dual", tau1: 20.1, tau2: 19.9, delay: 0, corner: TURN * 0.4,
    difference: 0.2, gain: 5000,
    zeros: [[0, 0], [0, 0], ...hertz([1e-8, 5e-6, 5e-6, 5e-6])],
    poles: hertz([1e-6, 1e-6, 1e-6, 5e-5, 4e-4, 5e-5]),
  };
  const ARM = { ...PAPER, zeros: [], poles: [[0, 0]], gain: 1 };
  const PRESETS = {
    "The paper's controlled loop": [PAPER, 1, 3e-6],
    "Common arm": [{ ...ARM, sensor: "common" }, 0, 3],
    "Dual arm": [{ ...ARM, gain: 10 }, 1, 0.3],
    "Single arm": [{ ...ARM, sensor: "single" }, 0, 3],
    "Common arm with a lead filter and a dead time": [{ ...ARM, sensor: "common", delay: 0.1,
      zeros: [[-0.02, 0]], poles: [[0, 0], [-0.1, 0]] }, 0, 1.5],
  };
  const SQUARE = 1e-6;
  const WORDS = { [-1]: "on the boundary", [-2]: "not stable: the high-frequency chain of roots is not confined",
    [-3]: "not sure" };

  function say(number, digits = 3) {
    if (number === 0) return "0";
    const size = Math.abs(number);
    const text = size < 1e-3 || size >= 1e5 ? scientific(number, digits - 1)
      : String(+number.toPrecision(digits));
    return text.replace(/-/g, "\u2212");
  }

  function scientific(number, digits) {
    const [factor, exponent] = number.toExponential(digits).split("e");
    return `${factor} \u00d7 ${power(Number(exponent))}`;
  }

  function power(exponent) {
    const digits = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
    return `10${String(exponent).replace(/./g, d => d === "-" ? "\u207b" : digits[d])}`;
  }

  function counted(count) {
    return count === 0 ? "stable" : count > 0
      ? `${count} unstable root${count > 1 ? "s" : ""}` : WORDS[count];
  }

  /* ---------------------------------------------------------------------------- worker */

  /* Runs in the worker: `api` is what loop.js gives. */
  function tasks(api) {
    const look = {
      chart: (spec, x0, x1, y0, y1, n) => {
        const { counts, complete } = api.chart(api.make(spec), x0, x1, n, y0, y1, n);
        return { counts, complete, n };
      },
      point: (spec, c1, c2) => api.count(api.make(spec), c1, c2),
      root: (spec, c1, c2) => api.rightmost(spec, c1, c2),
      breaks: spec => [[1, -1], [1, 1], [-1, -1]].map(
        ([x, y]) => api.firstBreak(api.make(spec), x, y)),
      margins: (spec, c1, c2) => api.count(api.make(spec), c1, c2) === 0
        ? api.margins(spec, c1, c2) : null,
      plots: (spec, c1, c2) => {
        const { omega, re, im } = api.response(api.make(spec), c1, c2);
        // Forty turns of the longest delay are what a picture can hold.
        const last = 40 * 2 * Math.PI / (Math.max(spec.tau1, spec.tau2) + spec.delay);
        const n = omega.findIndex(w => w > last);
        return [omega, re, im].map(values => values.slice(0, n < 0 ? values.length : n));
      },
      // Counts at points of a chart, each for certain.
      check: (spec, points) => points.map(([x, y]) => api.count(api.make(spec), x, y)),
    };
    return ({ data: { kind, version, input } }) => {
      let result = null, error = null;
      try { result = look[kind](...input); } catch (problem) { error = problem.message; }
      postMessage({ kind, version, result, error });
    };
  }

  /* Asks the worker one thing at a time, the most urgent first; of each kind only the last. */
  class Desk {
    constructor(order) {
      const text = `onmessage = (${tasks})((${armlockLoop})());`;
      this.worker = new Worker(URL.createObjectURL(new Blob([text], { type: "text/javascript" })));
      this.worker.onmessage = ({ data }) => {
        const { kind, version, result, error } = data, { heard } = this.running;
        this.running = null;
        if (version === this.versions[kind]) heard(result, error);
        this.next();
      };
      this.order = order;
      this.versions = {};
      this.waiting = {};
      this.running = null;
    }

    ask(kind, input, heard) {
      this.versions[kind] = (this.versions[kind] || 0) + 1;
      this.waiting[kind] = { kind, version: this.versions[kind], input, heard };
      this.next();
    }

    drop(...kinds) {
      for (const kind of kinds) {
        delete this.waiting[kind];
        this.versions[kind] = (this.versions[kind] || 0) + 1;
      }
    }

    next() {
      const kind = this.order.find(name => this.waiting[name]);
      if (this.running || !kind) return;
      this.running = this.waiting[kind];
      delete this.waiting[kind];
      const { version, input } = this.running;
      this.worker.postMessage({ kind, version, input });
    }
  }

  /* ---------------------------------------------------------------------------- drawing */

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
      else if (value !== null) made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  }

  /* A canvas as wide as its place, sharp on every screen. */
  class Sheet {
    constructor(attributes, shape, draw) {
      this.canvas = element("canvas", attributes);
      this.shape = shape;
      this.draw = () => {
        const wide = this.canvas.clientWidth;
        if (!wide) return;
        const ratio = window.devicePixelRatio || 1, high = Math.round(wide * shape);
        this.canvas.width = wide * ratio;
        this.canvas.height = high * ratio;
        const pen = this.canvas.getContext("2d");
        pen.setTransform(ratio, 0, 0, ratio, 0, 0);
        const style = getComputedStyle(this.canvas);
        pen.font = "13px sans-serif";
        pen.fillStyle = pen.strokeStyle = style.color;
        const dark = document.documentElement.dataset.theme === "dark";
        draw(pen, wide, high, { dark, text: style.color, grid: dark ? "#55606a" : "#c9d0d6",
          line: dark ? "#56b4e9" : "#0072b2", mark: dark ? "#f0a060" : "#d55e00" });
      };
      this.canvas.style.aspectRatio = String(1 / shape);
      new ResizeObserver(this.draw).observe(this.canvas);
      new MutationObserver(this.draw).observe(document.documentElement,
        { attributes: true, attributeFilter: ["data-theme"] });
    }
  }

  function ticks(low, high, most) {
    const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map(k => k * power).find(k => k >= rough);
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
    return found;
  }

  const COLOURS = { [-1]: [0, 0, 0], [-2]: [147, 132, 160], [-3]: [255, 255, 255] };

  /* The chart over (c1, c2). `centre` and `half` say what it shows; it is drawn and named in
   * units of a power of ten from (1, 1) where it is small. */
  class Chart {
    constructor(label, changed, pointed) {
      this.changed = changed;
      this.pointed = pointed;
      this.centre = [1, 1];
      this.half = 3;
      this.marked = null;
      this.broken = null;
      this.picture = null;
      this.sheet = new Sheet({ tabindex: 0, role: "application", "aria-label": `${label} Arrow keys `
        + "move the point, with shift by ten steps; plus and minus zoom." }, 1,
        (pen, wide, high, colours) => this.draw(pen, wide, high, colours));
      const canvas = this.canvas = this.sheet.canvas;
      canvas.addEventListener("pointermove", event => this.point(event, false));
      canvas.addEventListener("pointerdown", event => this.point(event, true));
      canvas.addEventListener("keydown", event => this.key(event));
      canvas.addEventListener("wheel", event => {
        event.preventDefault();
        this.zoom(event.deltaY > 0 ? 1.5 : 1 / 1.5, this.at(event));
      }, { passive: false });
    }

    get box() {
      return { x0: this.centre[0] - this.half, x1: this.centre[0] + this.half,
        y0: this.centre[1] - this.half, y1: this.centre[1] + this.half };
    }

    show(centre, half) {
      this.centre = centre;
      this.half = Math.min(Math.max(half, 1e-12), 1e3);
      this.picture = null;
      this.sheet.draw();
      this.changed();
    }

    zoom(factor, around) {
      const [x, y] = around || this.marked || this.centre;
      const half = this.half * factor;
      this.show([x + (this.centre[0] - x) * factor, y + (this.centre[1] - y) * factor], half);
    }

    fill({ counts, n }) {
      let largest = 1;
      for (const count of counts) if (count > largest) largest = count;
      const picture = element("canvas", { width: n, height: n }), image = new ImageData(n, n);
      for (let j = 0; j < n; j++) for (let i = 0; i < n; i++) {
        const count = counts[j * n + i], t = Math.sqrt(count / largest);
        const colour = count < 0 ? COLOURS[count] : count === 0 ? [184, 196, 206]
          : [255 - 46 * t, 240 - 155 * t, 224 - 190 * t];
        image.data.set([...colour, 255], 4 * ((n - 1 - j) * n + i));
      }
      picture.getContext("2d").putImageData(image, 0, 0);
      this.picture = picture;
      this.grid = { counts, n, ...this.box };
      this.sheet.draw();
    }

    /* The chart's own count at a point: of the nearest grid point, and of all around it. */
    around(c1, c2) {
      const { counts, n, x0, x1, y0, y1 } = this.grid;
      const i = Math.round((c1 - x0) / (x1 - x0) * (n - 1));
      const j = Math.round((c2 - y0) / (y1 - y0) * (n - 1));
      const found = [];
      for (let b = Math.max(j - 1, 0); b <= Math.min(j + 1, n - 1); b++)
        for (let a = Math.max(i - 1, 0); a <= Math.min(i + 1, n - 1); a++)
          found.push(counts[b * n + a]);
      return found;
    }

    get unit() {
      const { x0, x1, y0, y1 } = this.box;
      const far = Math.max(...[x0, x1, y0, y1].map(v => Math.abs(v - 1)));
      return far < 0.01 ? 10 ** Math.floor(Math.log10(far)) : 0;
    }

    frame(wide, high) {
      return { left: 58, top: 10, wide: wide - 58 - 12, high: high - 10 - 48 };
    }

    draw(pen, wide, high, colours) {
      const frame = this.frame(wide, high), { x0, x1, y0, y1 } = this.box, unit = this.unit;
      const px = x => frame.left + frame.wide * (x - x0) / (x1 - x0);
      const py = y => frame.top + frame.high * (y1 - y) / (y1 - y0);
      pen.imageSmoothingEnabled = false;
      // In dark mode as armlock.css turns the figures.
      if (colours.dark) pen.filter = "invert(0.93) hue-rotate(180deg)";
      if (this.picture)
        pen.drawImage(this.picture, frame.left, frame.top, frame.wide, frame.high);
      pen.filter = "none";
      const read = v => unit ? (v - 1) / unit : v, write = v => unit ? 1 + v * unit : v;
      pen.strokeStyle = colours.text;
      pen.strokeRect(frame.left, frame.top, frame.wide, frame.high);
      pen.textAlign = "center";
      pen.textBaseline = "top";
      for (const v of ticks(read(x0), read(x1), 6))
        pen.fillText(say(+v.toPrecision(6), 6), px(write(v)), frame.top + frame.high + 6);
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      for (const v of ticks(read(y0), read(y1), 6))
        pen.fillText(say(+v.toPrecision(6), 6), frame.left - 6, py(write(v)));
      const name = k => unit ? `${power(Math.round(-Math.log10(unit)))} (c${k} \u2212 1)` : `c${k}`;
      pen.textAlign = "center";
      pen.textBaseline = "bottom";
      pen.fillText(name(1), frame.left + frame.wide / 2, high - 4);
      pen.save();
      pen.translate(4, frame.top + frame.high / 2);
      pen.rotate(-Math.PI / 2);
      pen.textBaseline = "top";
      pen.fillText(name(2), 0, 0);
      pen.restore();
      pen.save();
      pen.beginPath();
      pen.rect(frame.left, frame.top, frame.wide, frame.high);
      pen.clip();
      if (this.half < 1e-4) {
        pen.strokeStyle = colours.line;
        pen.lineWidth = 2;
        pen.strokeRect(px(1 - SQUARE), py(1 + SQUARE), px(1 + SQUARE) - px(1 - SQUARE),
          py(1 - SQUARE) - py(1 + SQUARE));
      }
      // The ideal point.
      pen.strokeStyle = colours.text;
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const [dx, dy] of [[7, 0], [0, 7]]) {
        pen.moveTo(px(1) - dx, py(1) - dy);
        pen.lineTo(px(1) + dx, py(1) + dy);
      }
      pen.stroke();
      if (this.broken > 0 && this.broken < Infinity) {
        pen.fillStyle = colours.text;
        pen.strokeStyle = colours.dark ? "#000" : "#fff";
        pen.beginPath();
        pen.arc(px(1 + this.broken), py(1 - this.broken), 5, 0, 7);
        pen.fill();
        pen.stroke();
      }
      if (this.marked) for (const [colour, width] of [["#fff", 5], ["#0072b2", 2]]) {
        pen.strokeStyle = colour;
        pen.lineWidth = width;
        pen.beginPath();
        pen.arc(px(this.marked[0]), py(this.marked[1]), 7, 0, 7);
        pen.stroke();
      }
      pen.restore();
    }

    at(event) {
      const place = this.canvas.getBoundingClientRect();
      const frame = this.frame(place.width, place.height), { x0, x1, y0, y1 } = this.box;
      const x = (event.clientX - place.left - frame.left) / frame.wide;
      const y = 1 - (event.clientY - place.top - frame.top) / frame.high;
      if (x < 0 || x > 1 || y < 0 || y > 1) return null;
      return [x0 + x * (x1 - x0), y0 + y * (y1 - y0)];
    }

    point(event, firmly) {
      const found = this.at(event);
      if (found) this.mark(found, firmly);
    }

    mark(point, firmly) {
      this.marked = point;
      this.sheet.draw();
      this.pointed(point, firmly);
    }

    key(event) {
      const zoom = { "+": 0.5, "=": 0.5, "-": 2 }[event.key];
      if (zoom) {
        event.preventDefault();
        this.zoom(zoom);
        return;
      }
      const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1],
        ArrowDown: [0, -1] }[event.key];
      if (!move) return;
      event.preventDefault();
      const step = this.half / 100 * (event.shiftKey ? 10 : 1), { x0, x1, y0, y1 } = this.box;
      const [x, y] = this.marked || this.centre;
      this.mark([Math.min(x1, Math.max(x0, x + step * move[0])),
        Math.min(y1, Math.max(y0, y + step * move[1]))], true);
    }

    name([x, y]) {
      const text = v => this.unit
      ? `1 ${v < 1 ? "\u2212" : "+"} ${scientific(Math.abs(v - 1), 2)}` : say(v, 4);
      return `c1 = ${text(x)}, c2 = ${text(y)}`;
    }
  }

  function curve(pen, n, x, y) {
    pen.beginPath();
    for (let i = 0; i < n; i++) if (i) pen.lineTo(x(i), y(i)); else pen.moveTo(x(i), y(i));
    pen.stroke();
  }

  /* The Nyquist curve, its distance from 0 on a logarithmic scale: angles stay as they are. */
  function drawNyquist([omega, re, im], pen, wide, high, colours) {
    const n = omega.length;
    const far = v => Math.log10(1 + v);
    let most = 2;
    for (let i = 0; i < n; i++) most = Math.max(most, Math.hypot(re[i], im[i]));
    most = Math.min(most, 1e6);
    const scale = 0.46 * Math.min(wide, high) / far(most), cx = wide / 2, cy = high / 2;
    pen.strokeStyle = colours.grid;
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    for (let size = 1; size <= most; size *= 10) {
      pen.beginPath();
      pen.arc(cx, cy, scale * far(size), 0, 7);
      pen.stroke();
      pen.fillText(power(Math.round(Math.log10(size))), cx + 3, cy - scale * far(size));
    }
    const place = (i, sign) => {
      const size = Math.hypot(re[i], im[i]) || 1e-300, k = scale * far(Math.min(size, most)) / size;
      return [cx + k * re[i], cy - sign * k * im[i]];
    };
    for (const sign of [-1, 1]) {
      pen.strokeStyle = sign > 0 ? colours.line : colours.grid;
      curve(pen, n, i => place(i, sign)[0], i => place(i, sign)[1]);
    }
    pen.strokeStyle = colours.mark;
    pen.lineWidth = 2;
    const x = cx - scale * far(1);
    for (const d of [-1, 1]) {
      pen.beginPath();
      pen.moveTo(x - 5, cy - 5 * d);
      pen.lineTo(x + 5, cy + 5 * d);
      pen.stroke();
    }
  }

  function drawBode([omega, re, im], pen, wide, high, colours) {
    const n = omega.length, size = [], phase = [];
    for (let i = 0; i < n; i++) {
      size.push(20 * Math.log10(Math.hypot(re[i], im[i]) + 1e-300));
      phase.push(Math.atan2(im[i], re[i]) * 180 / Math.PI);
    }
    const first = Math.log10(omega[0] / TURN), last = Math.log10(omega[n - 1] / TURN);
    const left = 56, right = 8, room = (high - 62) / 2;
    const px = i => left + (wide - left - right) * (Math.log10(omega[i] / TURN) - first) / (last - first);
    const panel = (top, values, low, most, name, step) => {
      const py = v => top + room * (most - v) / (most - low);
      pen.strokeStyle = colours.grid;
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      for (const v of step || ticks(low, most, 4)) {
        pen.beginPath();
        pen.moveTo(left, py(v));
        pen.lineTo(wide - right, py(v));
        pen.stroke();
        pen.fillText(say(v), left - 5, py(v));
      }
      pen.save();
      pen.translate(2, top + room / 2);
      pen.rotate(-Math.PI / 2);
      pen.textAlign = "center";
      pen.textBaseline = "top";
      pen.fillText(name, 0, 0);
      pen.restore();
      pen.save();
      pen.beginPath();
      pen.rect(left, top, wide - left - right, room);
      pen.clip();
      pen.strokeStyle = colours.line;
      // A phase that passes 180 degrees is drawn anew from the other side.
      pen.beginPath();
      for (let i = 0; i < n; i++) {
        const on = i && Math.abs(values[i] - values[i - 1]) < 300;
        if (on) pen.lineTo(px(i), py(values[i])); else pen.moveTo(px(i), py(values[i]));
      }
      pen.stroke();
      pen.restore();
    };
    let top = -Infinity;
    for (const v of size) top = Math.max(top, v);
    const low = size.reduce((a, v) => Math.min(a, Math.max(v, top - 160)), top);
    panel(8, size, low - 5, top + 5, "|L| in dB");
    panel(22 + room, phase, -180, 180, "phase in degrees", [-180, -90, 0, 90, 180]);
    pen.fillStyle = colours.text;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const every = Math.ceil((last - first) / (wide / 60));
    for (let k = Math.ceil(first); k <= last; k += every) {
      const x = left + (wide - left - right) * (k - first) / (last - first);
      pen.fillText(power(k), x, 26 + 2 * room);
    }
    pen.textBaseline = "bottom";
    pen.fillText("frequency in Hz", (left + wide - right) / 2, high - 2);
  }

  /* ---------------------------------------------------------------------------- state */

  /* A number in as few characters as hold all its digits. */
  function exact(number) {
    const plain = String(number), scientific = number.toExponential();
    return scientific.length < plain.length ? scientific : plain;
  }

  function written(roots) {
    const left = [...roots], parts = [];
    while (left.length) {
      const [re, im] = left.shift();
      const partner = im ? left.findIndex(([x, y]) => x === re && y === -im) : -1;
      if (partner >= 0) {
        left.splice(partner, 1);
        parts.push(`${exact(re)}\u00b1${exact(Math.abs(im))}j`);
      } else {
        parts.push(im ? `${exact(re)}${im < 0 ? "-" : "+"}${exact(Math.abs(im))}j` : exact(re));
      }
    }
    return parts.join(", ");
  }

  const NUMBER = "[+-]?(?:\\d+\\.?\\d*|\\.\\d+)(?:e[+-]?\\d+)?";
  const REAL = new RegExp(`^${NUMBER}$`, "i");
  const COMPLEX = new RegExp(`^(${NUMBER})?([+-]|\u00b1)((?:\\d+\\.?\\d*|\\.\\d+)(?:e[+-]?\\d+)?)[ij]$`, "i");

  function read(name, text) {
    const found = [];
    for (const part of text.replace(/\u2212/g, "-").split(/[,;\s]+/).filter(p => p)) {
      const match = COMPLEX.exec(part);
      if (match) {
        const re = Number(match[1] || 0), im = Number(match[3]);
        if (match[2] !== "-") found.push([re, im]);
        if (match[2] !== "+") found.push([re, -im]);
      } else if (REAL.test(part)) {
        found.push([Number(part), 0]);
      } else {
        throw new RangeError(`${name} must be numbers such as -0.1 or -0.1\u00b12j, got ${part}`);
      }
    }
    return found;
  }

  /* The lines that make the same loop with the package. */
  function python(spec, [c1, c2]) {
    const root = ([re, im]) =>
      im ? `${exact(re)}${im < 0 ? "-" : "+"}${exact(Math.abs(im))}j` : exact(re);
    const list = roots => `[${roots.map(root).join(", ")}]`;
    const dual = spec.sensor === "dual";
    const sensor = dual ? `dual(corner=${spec.corner}, difference=${spec.difference})`
      : spec.sensor.toUpperCase();
    return `from armlock import Controller, Loop, unstable_roots
from armlock.sensors import ${dual ? "dual" : sensor}

controller = Controller(
    zeros=${list(spec.zeros)},
    poles=${list(spec.poles)},
    gain=${spec.gain},
)
loop = Loop(
    controller, ${sensor},
    tau1=${spec.tau1}, tau2=${spec.tau2}, delay=${spec.delay},
)
print(unstable_roots(loop, ${c1}, ${c2}))
`;
  }

  const SHORT = { sensor: "s", tau1: "t1", tau2: "t2", delay: "d", gain: "g", corner: "p",
    difference: "dt", zeros: "z", poles: "q" };

  function address(spec, chart) {
    const parts = new URLSearchParams();
    for (const [name, key] of Object.entries(SHORT))
      parts.set(key, Array.isArray(spec[name]) ? written(spec[name]) : spec[name]);
    parts.set("at", [...chart.centre, chart.half].join(","));
    return `#${parts}`;
  }

  function fromAddress(hash) {
    const parts = new URLSearchParams(hash.slice(1));
    if (!parts.has("s")) return null;
    const spec = {};
    for (const [name, key] of Object.entries(SHORT)) {
      const text = parts.get(key) ?? "";
      spec[name] = name === "sensor" ? text
        : name === "zeros" || name === "poles" ? read(name, text) : Number(text);
    }
    const [x, y, half] = (parts.get("at") || "1,1,1").split(",").map(Number);
    return [spec, [x, y], half];
  }

  /* ---------------------------------------------------------------------------- pages */

  let number = 0;

  /* What both pages have: a chart that answers, and the numbers of the loop. */
  class Live {
    constructor(label) {
      this.id = `live-${++number}`;
      this.desk = new Desk(["point", "chart", "root", "breaks", "margins", "plots", "check"]);
      this.out = element("output", { role: "status", "aria-live": "polite" });
      this.note = element("p", { class: "live-note" });
      this.numbers = element("dl", { class: "live-numbers" });
      this.chart = new Chart(label, () => this.redraw(), point => this.tell(point));
      this.figure = element("div", { class: "live-chart", "data-check": "hover" },
        this.chart.canvas, this.out);
      this.forget();
    }

    /* Nobody has pointed at a place yet. */
    forget() {
      this.chart.marked = null;
      this.shown = [1, 1];
      this.out.textContent = "Point at the chart, touch it, or move with the arrow keys.";
    }

    /* Take another loop. */
    set(spec) {
      this.spec = spec;
      this.chart.broken = null;
      this.desk.drop("point", "root", "margins", "plots", "check");
      this.redraw();
      this.desk.ask("breaks", [spec], found => {
        this.breaks = found;
        this.chart.broken = found ? found[0] : null;
        this.chart.sheet.draw();
        this.list();
      });
      this.settle(this.shown, 0);
      if (this.chart.marked) this.tell(this.chart.marked);
    }

    redraw() {
      if (!this.spec) return;
      const { x0, x1, y0, y1 } = this.chart.box;
      this.desk.drop("check");
      const input = [this.spec, x0, x1, y0, y1];
      this.desk.ask("chart", [...input, 200], (found, error) => {
        if (error) { this.note.textContent = error; return; }
        this.chart.fill(found);
        this.note.textContent = "Refining \u2026";
        this.desk.ask("chart", [...input, 400], finer => {
          this.chart.fill(finer);
          this.verify(finer.complete);
        });
      });
    }

    /* Count some points of the chart for certain, and say how they compare. */
    verify(complete) {
      const { x0, x1, y0, y1 } = this.chart.box, points = [];
      for (let k = 1; k <= 24; k++)
        points.push([x0 + (x1 - x0) * (0.7548776662 * k % 1), y0 + (y1 - y0) * (0.5698402910 * k % 1)]);
      this.desk.ask("check", [this.spec, points], found => {
        let same = 0, sure = 0;
        found.forEach((count, k) => {
          if (count === -3) return;
          sure++;
          const around = this.chart.around(...points[k]);
          same += count >= Math.min(...around) && count <= Math.max(...around);
        });
        this.note.textContent = `The chart is drawn from sampled frequencies. ${sure} of its points `
          + `were counted for certain: ${same === sure ? "all agree" : `${sure - same} differ`}.`
          + (complete ? "" : " Crossings at still higher frequencies are left out.");
      });
    }

    tell(point) {
      const name = this.chart.name(point);
      this.out.textContent = `${name}: counting \u2026`;
      this.desk.drop("root");
      this.desk.ask("point", [this.spec, ...point], (count, error) => {
        this.out.textContent = error || `${name}: ${counted(count)}`;
        if (error) return;
        clearTimeout(this.rest);
        this.rest = setTimeout(() => this.settle(point, count), 200);
      });
    }

    /* Once the pointer rests: what takes longer. */
    settle(point, count) {
      this.shown = point;
      if (count >= 0 && this.chart.marked) {
        const before = this.out.textContent;
        this.desk.ask("root", [this.spec, ...point], root => {
          if (!root || this.out.textContent !== before) return;
          const im = root[1] ? ` \u00b1 ${say(Math.abs(root[1]))}j` : "";
          this.out.textContent = `${before}; rightmost root ${say(root[0])}${im} rad/s`;
        });
      }
      this.desk.ask("margins", [this.spec, ...point], found => {
        this.margins = found;
        this.list();
      });
    }

    list() {
      const rows = [];
      const part = value => Number.isNaN(value) ? "not sure" : value === 0 ? "none"
        : value === Infinity ? "more than 2" : say(value, 4);
      if (this.breaks) {
        const [minus, plus, down] = this.breaks;
        rows.push(["Critical perturbation from (1, 1)", ""], ["along (1, \u22121)", part(minus)],
          ["along (1, 1)", part(plus)], ["along (\u22121, \u22121)", part(down)]);
      }
      const m = this.margins;
      const where = this.chart.marked ? this.chart.name(this.shown) : "(1, 1)";
      const limit = (value, none) =>
        Number.isNaN(value) ? "not sure" : value === none ? "none found" : say(value, 4);
      if (m !== undefined) rows.push([`At ${where}`, m ? "" : "no margins: not stable"]);
      if (m) rows.push(["Smallest gain factor that keeps it stable", limit(m.lower, 0)],
        ["Largest", limit(m.upper, Infinity)],
        ["Phase margin (sampled)",
          m.phase === Infinity ? "no crossover" : `${say(m.phase * 180 / Math.PI)}\u00b0`],
        ["Smallest |1 + L| (sampled)", say(m.modulus)]);
      this.numbers.replaceChildren(...rows.map(([name, value]) =>
        element("div", {}, element("dt", {}, name), element("dd", {}, value))));
    }
  }

  function slider(id, name, low, high, value, write, moved) {
    const shown = element("output", { id: `${id}-value` }, write(value));
    const input = element("input", { type: "range", id, min: low, max: high, step: (high - low) / 200,
      "aria-controls": `${id}-value`, oninput: () => {
        shown.textContent = write(Number(input.value));
        moved(Number(input.value));
      } });
    input.value = value;
    return element("label", { class: "live-field" }, element("span", {}, name, " ", shown), input);
  }

  function choice(id, name, options, changed) {
    const select = element("select", { id, onchange: () => changed(select.value) },
      ...options.map(([value, text]) => element("option", { value }, text)));
    return element("label", { class: "live-field" }, element("span", {}, name), select);
  }

  /* The controlled loop of the paper, with what it leaves open as switches. */
  function front(place) {
    const live = new Live("Stability of the paper's controlled loop near (1, 1).");
    const state = { half: false, actuator: false, printed: false, corner: 0.4, delay: 0 };
    const update = () => {
      const poles = [...PAPER.poles], zeros = [...PAPER.zeros];
      if (state.printed) { zeros.pop(); poles.pop(); }
      if (state.actuator) poles.push([0, 0]);
      live.set({ ...PAPER, zeros, poles, corner: TURN * state.corner, delay: state.delay,
        difference: (state.half ? 0.5 : 1) * PAPER.difference });
    };
    const flag = (key, name, off, on) => choice(`${live.id}-${key}`, name, [["", off], ["1", on]],
      value => { state[key] = Boolean(value); update(); });
    const form = element("form", { class: "live-form", onsubmit: event => event.preventDefault() },
      flag("half", "Delay difference of the sensor", "\u03c4\u2081 \u2212 \u03c4\u2082", "half of it"),
      flag("actuator", "Actuator 1/s", "left out", "in the loop"),
      flag("printed", "Last pole of the controller", "p24 (Table II)", "z24 (as Eq. 11 prints it)"),
      slider(`${live.id}-corner`, "Corner p of the sensor:", -2, 1, Math.log10(0.4),
        v => `${say(10 ** v)} Hz`, v => { state.corner = 10 ** v; update(); }),
      slider(`${live.id}-delay`, "Dead time:", 0, 10, 0, v => `${say(v)} ms`,
        v => { state.delay = 1e-3 * v; update(); }));
    place.replaceChildren(form, element("div", { class: "live-pair" }, live.figure,
      element("div", {}, live.numbers, live.note)));
    live.chart.show([1, 1], 3e-6);
    update();
  }

  function save(name, blob) {
    const link = element("a", { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  /* The chart of a chapter: one of the presets in the window that the page asks for. */
  function chapter(place) {
    const { live: name, centre, half } = place.dataset;
    const live = new Live(`${name}: number of unstable roots over c1 and c2.`);
    const colour = (text, shown) =>
      element("span", { class: "live-key" }, element("i", { style: `background: ${shown}` }), text);
    const legend = element("p", { class: "live-note" }, colour("stable", "rgb(184,196,206)"),
      colour("unstable, stronger with more roots", "rgb(232,163,129)"), "+ the ideal point (1, 1)");
    if (half < 1e-4)
      legend.append("; square: the paper\u2019s perturbations; dot: first to break along (1, \u22121)");
    const button = (text, done) => element("button", { type: "button", onclick: done }, text);
    const file = name.toLowerCase().replace(/\W+/g, "-");
    const counts = () => {
      const { counts, n, x0, x1, y0, y1 } = live.chart.grid;
      const at = (low, high, i) => low + (high - low) * i / (n - 1);
      const rows = Array.from(counts, (count, k) =>
        `${at(x0, x1, k % n)},${at(y0, y1, Math.floor(k / n))},${count}\n`);
      save(`${file}.csv`, new Blob(["c1 [1],c2 [1],unstable roots [1]\n", ...rows]));
    };
    const tools = element("p", { class: "live-buttons" },
      button("Zoom in", () => live.chart.zoom(0.5)), button("Zoom out", () => live.chart.zoom(2)),
      button("Download CSV", counts),
      button("Download PNG", () => live.chart.canvas.toBlob(blob => save(`${file}.png`, blob))));
    place.replaceChildren(element("div", { class: "live-one" }, live.figure, legend, tools, live.note));
    live.chart.show([Number(centre), Number(centre)], Number(half));
    live.set(PRESETS[name][0]);
  }

  /* Your own loop. */
  function own(place) {
    const live = new Live("Number of unstable roots over c1 and c2.");
    const id = name => `${live.id}-${name}`;
    const fields = {};
    const wrong = element("p", { class: "live-wrong", role: "alert" });
    const code = element("pre", { class: "live-code", "aria-label": "Python" });
    let response = null, factor = 1;
    const picture = (draw, label) => new Sheet({ role: "img", "aria-label": label }, 0.85,
      (pen, wide, high, colours) => { if (response) draw(response, pen, wide, high, colours); });
    const nyquist = picture(drawNyquist, "Nyquist curve of L at the point, distances from 0 on a "
      + "logarithmic scale, -1 marked");
    const bode = picture(drawBode, "Magnitude and phase of L at the point against frequency");

    const settle = live.settle.bind(live);
    live.settle = (point, count) => {
      settle(point, count);
      code.textContent = python(live.spec, point);
      live.desk.ask("plots", [live.spec, ...point], found => {
        response = found;
        nyquist.draw();
        bode.draw();
      });
    };
    const remember = () => history.replaceState(null, "", address(live.spec, live.chart));
    const redraw = live.redraw.bind(live);
    live.redraw = () => { redraw(); if (live.spec) remember(); };

    const take = () => {
      try {
        const spec = { sensor: fields.sensor.value };
        for (const name of ["tau1", "tau2", "delay", "gain", "corner", "difference"]) {
          const text = fields[name].value.trim().replace(/\u2212/g, "-");
          if (!REAL.test(text)) throw new RangeError(`${name} must be a number, got ${text || "nothing"}`);
          spec[name] = Number(text);
        }
        for (const name of ["zeros", "poles"]) spec[name] = read(name, fields[name].value);
        armlockLoop().make(spec);
        wrong.textContent = "";
        live.set(spec);
      } catch (error) {
        wrong.textContent = error.message;
      }
    };
    const put = spec => {
      for (const name of Object.keys(SHORT))
        fields[name].value = Array.isArray(spec[name]) ? written(spec[name]) : String(spec[name]);
      fields.gain.dataset.base = spec.gain;
      shape();
    };
    const shape = () => {
      for (const name of ["corner", "difference"])
        fields[name].closest("label").hidden = fields.sensor.value !== "dual";
    };
    const field = (name, label, tag = "input") => {
      fields[name] = element(tag, { id: id(name), spellcheck: "false", autocomplete: "off",
        inputmode: tag === "input" ? "text" : null, rows: tag === "textarea" ? 2 : null,
        onchange: () => { fields.gain.dataset.base = fields.gain.value; take(); } });
      return element("label", { class: `live-field${tag === "textarea" ? " live-wide" : ""}` },
        element("span", {}, label), fields[name]);
    };
    const preset = choice(id("preset"), "Start from", Object.keys(PRESETS).map(name => [name, name]),
      name => {
        const [spec, centre, half] = PRESETS[name];
        put(spec);
        live.forget();
        live.spec = null;
        live.chart.show([centre, centre], half);
        take();
      });
    const sensor = choice(id("sensor"), "Sensor", [["single", "single arm"], ["common", "common arm"],
      ["difference", "difference of the arms"], ["dual", "dual"]], () => { shape(); take(); });
    fields.sensor = sensor.querySelector("select");
    preset.classList.add("live-wide");
    const form = element("form", { class: "live-form", onsubmit: event => event.preventDefault() },
      preset, sensor, field("tau1", "Delay \u03c4\u2081 in s"), field("tau2", "Delay \u03c4\u2082 in s"),
      field("delay", "Dead time in s"), field("gain", "Gain"),
      field("corner", "Sensor's corner p in rad/s"), field("difference", "Sensor's \u0394\u03c4 in s"),
      field("zeros", "Zeros in rad/s, such as \u22120.1 or \u22120.1\u00b12j", "textarea"),
      field("poles", "Poles in rad/s", "textarea"),
      slider(id("factor"), "Drag the gain: times", -2, 2, 0, v => say(10 ** v), v => {
        factor = 10 ** v;
        fields.gain.value = String(+(Number(fields.gain.dataset.base) * factor).toPrecision(6));
        take();
      }),
      slider(id("dead"), "Drag the dead time:", 0, 1, 0, v => `${say(v)} s`, v => {
        fields.delay.value = String(v);
        take();
      }));
    const button = (text, done) => element("button", { type: "button", onclick: done }, text);
    const view = element("p", { class: "live-buttons" },
      button("Zoom in", () => live.chart.zoom(0.5)), button("Zoom out", () => live.chart.zoom(2)),
      button("Paper's square", () => live.chart.show([1, 1], 3e-6)),
      button("Whole", () => live.chart.show([0, 0], 3)));
    const copied = button("Copy as Python", async () => {
      try {
        await navigator.clipboard.writeText(code.textContent);
        copied.textContent = "Copied";
      } catch {
        // A browser may refuse the clipboard to a page from disk: the lines are there to mark.
        getSelection().selectAllChildren(code);
        copied.textContent = "Marked: copy it with Ctrl+C";
      }
      setTimeout(() => { copied.textContent = "Copy as Python"; }, 3000);
    });
    place.replaceChildren(form, wrong, element("div", { class: "live-pair" },
      element("div", {}, live.figure, view), element("div", {}, live.numbers, live.note)),
      element("div", { class: "live-plots" }, nyquist.canvas, bode.canvas),
      element("p", { class: "live-buttons" }, copied), code);

    const open = () => {
      try {
        const given = fromAddress(location.hash);
        if (!given) return false;
        put(given[0]);
        live.spec = null;
        live.chart.show(given[1], given[2]);
        take();
        return true;
      } catch (error) {
        wrong.textContent = `This address holds no loop: ${error.message}`;
        return false;
      }
    };
    window.addEventListener("hashchange", open);
    if (!open()) preset.querySelector("select").dispatchEvent(new Event("change"));
  }

  function start() {
    for (const place of document.querySelectorAll("[data-live]"))
      ({ front, loop: own }[place.dataset.live] || chapter)(place);
  }
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
  else start();
})();
