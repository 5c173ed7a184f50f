"use strict";
/*
 * What the live pages draw: the chart over (c1, c2) with the D-curve, the Nyquist curve with what
 * happens at -1, Bode's plot, and the loop in time. Plain canvases, because charts of many
 * thousand points have to follow the pointer in every frame.
 */
const armlockDraw = (function () {
  const { TURN, say, scientific, power } = armlockText;
  // The paper's perturbations.
  const SQUARE = 1e-6;

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
      else if (value !== null) made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  }

  function palette() {
    const dark = document.documentElement.dataset.theme === "dark";
    return dark
      ? { dark, text: "#e3e6e9", grid: "#55606a", line: "#56b4e9", mark: "#f0a060", ground: "#12181d",
        stable: [70, 98, 124], few: [150, 84, 40], many: [255, 186, 120], lost: [112, 88, 148],
        unsure: [[18, 24, 29], [96, 104, 112]] }
      : { dark, text: "#222832", grid: "#c9d0d6", line: "#0072b2", mark: "#d55e00", ground: "#ffffff",
        stable: [184, 196, 206], few: [255, 232, 208], many: [209, 85, 34], lost: [147, 132, 160],
        unsure: [[255, 255, 255], [190, 196, 202]] };
  }

  /* A canvas as wide as its place, sharp on every screen, drawn once a frame at most. */
  class Sheet {
    constructor(attributes, shape, draw) {
      this.canvas = element("canvas", attributes);
      this.paint = draw;
      this.shape = shape;
      this.canvas.style.aspectRatio = String(1 / shape);
      new ResizeObserver(() => this.now()).observe(this.canvas);
      new MutationObserver(() => this.now()).observe(document.documentElement,
        { attributes: true, attributeFilter: ["data-theme"] });
    }

    draw() {
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => this.now());
    }

    now() {
      this.waiting = false;
      const wide = this.canvas.clientWidth;
      if (!wide) return;
      const ratio = window.devicePixelRatio || 1, high = Math.round(wide * this.shape);
      if (this.canvas.width !== Math.round(wide * ratio)
        || this.canvas.height !== Math.round(high * ratio)) {
        this.canvas.width = Math.round(wide * ratio);
        this.canvas.height = Math.round(high * ratio);
      }
      const pen = this.canvas.getContext("2d"), colours = palette();
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, wide, high);
      pen.font = "13px sans-serif";
      pen.lineWidth = 1;
      pen.fillStyle = pen.strokeStyle = colours.text;
      this.paint(pen, wide, high, colours);
    }
  }

  function ticks(low, high, most) {
    const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map(k => k * power).find(k => k >= rough);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }

  /* A colour of the frequency, from blue to yellow, as readable in the dark. */
  const RAINBOW = [[68, 60, 150], [50, 110, 170], [30, 150, 140], [110, 195, 90], [235, 200, 40]];
  function shade(t) {
    const x = Math.min(0.9999, Math.max(0, t)) * (RAINBOW.length - 1), k = Math.floor(x);
    return `rgb(${RAINBOW[k].map((v, i) => Math.round(v + (x - k) * (RAINBOW[k + 1][i] - v)))})`;
  }

  function upright(pen, text, x, y) {
    pen.save();
    pen.translate(x, y);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.textBaseline = "top";
    pen.fillText(text, 0, 0);
    pen.restore();
  }

  function ring(pen, x, y, radius, colours) {
    for (const [colour, width] of [[colours.ground, 5], [colours.line, 2]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.beginPath();
      pen.arc(x, y, radius, 0, 7);
      pen.stroke();
    }
    pen.lineWidth = 1;
  }

  /* The chart over (c1, c2). `centre` and `half` say what it shows. */
  class Chart {
    constructor(label, { changed, pointed }) {
      Object.assign(this, { changed, pointed, centre: [1, 1], half: 3, marked: null, broken: null,
        grid: null, picture: null, curve: null, ghost: null, lit: null, stale: false, fingers: new Map() });
      this.sheet = new Sheet({ tabindex: 0, role: "application", "aria-label": `${label} Arrow keys `
        + "move the point, with shift by ten steps, with control the view; plus and minus zoom." }, 1,
        (pen, wide, high, colours) => this.draw(pen, wide, high, colours));
      const canvas = this.canvas = this.sheet.canvas;
      canvas.addEventListener("pointermove", event => this.move(event));
      canvas.addEventListener("pointerdown", event => this.press(event));
      for (const name of ["pointerup", "pointercancel"])
        canvas.addEventListener(name, event => this.lift(event));
      canvas.addEventListener("keydown", event => this.key(event));
      // The wheel scrolls the page; with control it zooms, as on a map.
      canvas.addEventListener("wheel", event => {
        if (!event.ctrlKey && !event.metaKey) return;
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
      this.sheet.draw();
      this.changed();
    }

    zoom(factor, around) {
      const [x, y] = around || this.marked || this.centre;
      const half = this.half * factor;
      this.show([x + (this.centre[0] - x) * factor, y + (this.centre[1] - y) * factor], half);
    }

    clear() {
      this.grid = this.picture = this.curve = this.broken = null;
      this.stale = false;
      this.sheet.draw();
    }

    fill({ counts, n, box }) {
      this.grid = { counts, n, ...box };
      this.picture = null;
      this.stale = false;
      this.sheet.draw();
    }

    /* The counts as a picture. What is not sure is striped. */
    paint(colours) {
      const { counts, n } = this.grid;
      let largest = 1;
      for (const count of counts) if (count > largest) largest = count;
      const picture = element("canvas", { width: n, height: n }), image = new ImageData(n, n);
      // Of each count its colour as one number, the lowest byte first.
      const packed = ([r, g, b]) => 0xff000000 + (Math.round(b) << 16) + (Math.round(g) << 8) + Math.round(r);
      const shades = Array.from({ length: largest + 1 }, (_, count) => packed(count === 0 ? colours.stable
        : colours.few.map((v, m) => v + Math.sqrt(count / largest) * (colours.many[m] - v))));
      const [lost, unsure] = [packed(colours.lost), colours.unsure.map(packed)];
      const pixels = new Uint32Array(image.data.buffer);
      for (let j = 0; j < n; j++) for (let i = 0; i < n; i++) {
        const count = counts[j * n + i];
        pixels[(n - 1 - j) * n + i] = count >= 0 ? shades[count] : count === -2 ? lost
          : unsure[(i + j) * 100 / n % 8 < 4 ? 0 : 1];
      }
      picture.getContext("2d").putImageData(image, 0, 0);
      this.picture = { picture, dark: colours.dark };
    }

    /* [reference, unit] of an axis: where a chart is small, positions are told from there. */
    scale(axis) {
      const centre = this.centre[axis];
      if (this.half > 0.01 * Math.max(1, Math.abs(centre))) return [0, 1];
      const coarse = 10 ** Math.ceil(Math.log10(20 * this.half));
      const reference = Math.abs(centre - 1) < 20 * this.half ? 1
        : +(Math.round(centre / coarse) * coarse).toPrecision(12);
      return [reference, 10 ** Math.floor(Math.log10(Math.abs(centre - reference) + this.half))];
    }

    frame(wide, high) {
      return { left: 58, top: 10, wide: wide - 58 - 12, high: high - 10 - 48 };
    }

    draw(pen, wide, high, colours) {
      const frame = this.frame(wide, high), { x0, x1, y0, y1 } = this.box;
      const px = this.px = x => frame.left + frame.wide * (x - x0) / (x1 - x0);
      const py = this.py = y => frame.top + frame.high * (y1 - y) / (y1 - y0);
      pen.save();
      pen.beginPath();
      pen.rect(frame.left, frame.top, frame.wide, frame.high);
      pen.clip();
      if (this.grid) {
        if (!this.picture || this.picture.dark !== colours.dark) this.paint(colours);
        const { x0: u0, x1: u1, y0: v0, y1: v1 } = this.grid;
        pen.imageSmoothingEnabled = false;
        pen.globalAlpha = this.stale ? 0.35 : 1;
        pen.drawImage(this.picture.picture, px(u0), py(v1), px(u1) - px(u0), py(v0) - py(v1));
        pen.globalAlpha = 1;
      }
      if (this.ghost) this.trace(pen, this.ghost, colours, true);
      if (this.curve) this.trace(pen, this.curve, colours, false);
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
        pen.strokeStyle = colours.ground;
        pen.beginPath();
        pen.arc(px(1 + this.broken), py(1 - this.broken), 5, 0, 7);
        pen.fill();
        pen.stroke();
      }
      if (this.lit) {
        pen.fillStyle = colours.mark;
        pen.strokeStyle = colours.ground;
        pen.beginPath();
        pen.arc(px(this.lit[0]), py(this.lit[1]), 6, 0, 7);
        pen.fill();
        pen.stroke();
      }
      if (this.marked) ring(pen, px(this.marked[0]), py(this.marked[1]), 7, colours);
      pen.restore();
      this.axes(pen, frame, high, colours);
    }

    axes(pen, frame, high, colours) {
      const { x0, x1, y0, y1 } = this.box;
      pen.strokeStyle = pen.fillStyle = colours.text;
      pen.lineWidth = 1;
      pen.strokeRect(frame.left, frame.top, frame.wide, frame.high);
      [[x0, x1], [y0, y1]].forEach(([least, most], axis) => {
        const [from, unit] = this.scale(axis), read = v => (v - from) / unit, write = v => from + v * unit;
        pen.textAlign = axis ? "right" : "center";
        pen.textBaseline = axis ? "middle" : "top";
        for (const v of ticks(read(least), read(most), 5)) {
          const text = say(+v.toPrecision(9), 9);
          if (axis) pen.fillText(text, frame.left - 6, this.py(write(v)));
          else pen.fillText(text, this.px(write(v)), frame.top + frame.high + 6);
        }
        const shown = from ? ` \u2212 ${say(from, 12)}`.replace("\u2212 \u2212", "+ ") : "";
        const name = unit === 1 ? `c${axis + 1}`
          : `${power(Math.round(-Math.log10(unit)))} (c${axis + 1}${shown})`;
        pen.textAlign = "center";
        pen.textBaseline = "bottom";
        if (axis) upright(pen, name, 4, frame.top + frame.high / 2);
        else pen.fillText(name, frame.left + frame.wide / 2, high - 4);
      });
    }

    /* The D-curve, coloured by the frequency; a pinned one is thin and dashed. */
    trace(pen, { curve, line, range }, colours, pinned) {
      const { px, py } = this, [first, last] = range;
      pen.lineWidth = pinned ? 1.2 : 2;
      pen.setLineDash(pinned ? [4, 4] : []);
      pen.strokeStyle = colours.text;
      if (line) {
        const [a, b, c] = line, { x0, x1, y0, y1 } = this.box;
        const ends = Math.abs(b) > Math.abs(a) ? [x0, x1].map(x => [x, 1 + (c - a * (x - 1)) / b])
          : [y0, y1].map(y => [1 + (c - b * (y - 1)) / a, y]);
        pen.beginPath();
        ends.forEach(([x, y], k) => k ? pen.lineTo(px(x), py(y)) : pen.moveTo(px(x), py(y)));
        pen.stroke();
      }
      let bin = -1, down = false;
      pen.beginPath();
      for (let i = 0; i < curve.length; i += 3) {
        if (Number.isNaN(curve[i])) { down = false; continue; }
        const t = Math.log(curve[i + 2] / first) / Math.log(last / first || 2);
        const x = px(curve[i]), y = py(curve[i + 1]), next = pinned ? 0 : Math.floor(24 * t);
        if (next !== bin) {
          if (down) pen.lineTo(x, y);
          pen.stroke();
          pen.beginPath();
          if (!pinned) pen.strokeStyle = shade(t);
          pen.moveTo(x, y);
          bin = next;
        } else if (down) pen.lineTo(x, y); else pen.moveTo(x, y);
        down = true;
      }
      pen.stroke();
      pen.setLineDash([]);
    }

    at(event) {
      const place = this.canvas.getBoundingClientRect();
      const frame = this.frame(place.width, place.height), { x0, x1, y0, y1 } = this.box;
      const x = (event.clientX - place.left - frame.left) / frame.wide;
      const y = 1 - (event.clientY - place.top - frame.top) / frame.high;
      if (x < 0 || x > 1 || y < 0 || y > 1) return null;
      return [x0 + x * (x1 - x0), y0 + y * (y1 - y0)];
    }

    /* Where the fingers are, or the mouse: the middle, and how far two are apart. */
    grip() {
      const all = [...this.fingers.values()], [[x, y]] = all, [u, v] = all[all.length - 1];
      return { x: 0.5 * (x + u), y: 0.5 * (y + v), apart: Math.hypot(u - x, v - y),
        centre: this.centre, half: this.half };
    }

    /* A drag moves the view, and two fingers zoom; a tap sets the point, and a finger on it moves it. */
    press(event) {
      const found = this.at(event);
      if (!found || event.button) return;
      const place = this.canvas.getBoundingClientRect(), mouse = event.pointerType === "mouse";
      this.canvas.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
      this.held = this.grip();
      this.moved = this.fingers.size > 1;
      this.onPoint = !mouse && this.marked && this.fingers.size === 1 && Math.hypot(event.clientX - place.left
        - this.px(this.marked[0]), event.clientY - place.top - this.py(this.marked[1])) < 24;
      if (mouse) this.mark(found);
    }

    move(event) {
      if (!this.fingers.has(event.pointerId) || this.onPoint) {
        const found = this.at(event);
        if (found) this.mark(found);
        return;
      }
      this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
      const now = this.grip(), from = this.held, place = this.canvas.getBoundingClientRect();
      if (!this.moved && Math.hypot(now.x - from.x, now.y - from.y) < 4) return;
      this.moved = true;
      this.canvas.style.cursor = "grabbing";
      const frame = this.frame(place.width, place.height);
      const half = from.apart && now.apart ? from.half * from.apart / now.apart : from.half;
      // What was below the fingers stays there.
      const off = ({ x, y }) => [2 * (x - place.left - frame.left) / frame.wide - 1,
        1 - 2 * (y - place.top - frame.top) / frame.high];
      const [p, q] = [off(from), off(now)];
      this.show(from.centre.map((v, k) => v + p[k] * from.half - q[k] * half), half);
    }

    lift(event) {
      const tapped = this.fingers.delete(event.pointerId) && !this.moved && event.type === "pointerup";
      const found = tapped && this.at(event);
      if (found) this.mark(found);
      this.onPoint = false;
      this.canvas.style.cursor = "";
      if (this.fingers.size) this.held = this.grip();
    }

    mark(point) {
      this.marked = point;
      this.sheet.draw();
      this.pointed(point);
    }

    key(event) {
      const zoom = { "+": 0.5, "=": 0.5, "-": 2 }[event.key];
      if (zoom && !event.ctrlKey && !event.metaKey) {
        event.preventDefault();
        this.zoom(zoom);
        return;
      }
      const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1],
        ArrowDown: [0, -1] }[event.key];
      if (!move) return;
      event.preventDefault();
      const step = this.half / 100 * (event.shiftKey || event.ctrlKey ? 10 : 1);
      if (event.ctrlKey) {
        this.show(this.centre.map((v, k) => v + step * move[k]), this.half);
        return;
      }
      const { x0, x1, y0, y1 } = this.box, [x, y] = this.marked || this.centre;
      this.mark([Math.min(x1, Math.max(x0, x + step * move[0])),
        Math.min(y1, Math.max(y0, y + step * move[1]))]);
    }

    name(point) {
      const text = (v, axis) => {
        const [from, unit] = this.scale(axis);
        return unit === 1 ? say(v, 4)
          : `${say(from, 12)} ${v < from ? "\u2212" : "+"} ${scientific(Math.abs(v - from), 2)}`;
      };
      return `c1 = ${text(point[0], 0)}, c2 = ${text(point[1], 1)}`;
    }
  }

  /* A line through n places. One that is less than a pixel from the one before goes. */
  function curve(pen, n, place) {
    let u = Infinity, v = Infinity;
    pen.beginPath();
    for (let i = 0; i < n; i++) {
      const [x, y] = place(i);
      if (Math.abs(x - u) + Math.abs(y - v) < 0.7 && i < n - 1) continue;
      pen.lineTo(x, y);
      [u, v] = [x, y];
    }
    pen.stroke();
  }

  /* What is pinned is thin and dashed. */
  function ghost(pen, colours, draw) {
    pen.strokeStyle = colours.text;
    pen.setLineDash([4, 4]);
    draw();
    pen.setLineDash([]);
  }

  /* Frequencies in Hz below a plot, and lines at values beside it. */
  function powersBelow(pen, first, last, left, span, y, wide, high) {
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const every = Math.ceil((last - first) / (wide / 60));
    for (let k = Math.ceil(first); k <= last; k += every)
      pen.fillText(power(k), left + span * (k - first) / (last - first), y);
    pen.textBaseline = "bottom";
    pen.fillText("frequency in Hz", left + span / 2, high - 2);
  }

  function lines(pen, values, write, py, left, right, colours) {
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.strokeStyle = colours.grid;
    for (const v of values) {
      pen.beginPath();
      pen.moveTo(left, py(v));
      pen.lineTo(right, py(v));
      pen.stroke();
      pen.fillText(write(v), left - 5, py(v));
    }
  }

  /* Where the sampled |L| passes one: [index, phase in rad], the smallest phases first. */
  function crossovers({ omega, re, im }) {
    const found = [];
    for (let i = 1, before = Math.hypot(re[0], im[0]); i < omega.length; i++) {
      const size = Math.hypot(re[i], im[i]);
      if (before < 1 !== size < 1) {
        const k = Math.abs(size - 1) < Math.abs(before - 1) ? i : i - 1;
        found.push([k, Math.abs(Math.atan2(-im[k], -re[k]))]);
      }
      before = size;
    }
    return found.sort((p, q) => p[1] - q[1]).slice(0, 12);
  }

  const hertz = omega => `${say(omega / TURN)} Hz`;

  /* The Nyquist curve, its distance from 0 on a logarithmic scale: angles stay as they are. The
   * inset shows what is around -1 as it is, with the margin's arc. Returns where a sample is. */
  function drawNyquist([{ omega, re, im }, pinned], lit, pen, wide, high, colours) {
    const n = omega.length, far = v => Math.log10(1 + v);
    let most = 2, nearest = Infinity;
    for (let i = 0; i < n; i++) {
      most = Math.max(most, Math.hypot(re[i], im[i]));
      nearest = Math.min(nearest, Math.hypot(1 + re[i], im[i]));
    }
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
    const bent = (x, y) => {
      const size = Math.sqrt(x * x + y * y) || 1e-300, k = scale * far(Math.min(size, most)) / size;
      return [cx + k * x, cy - k * y];
    };
    const place = i => bent(re[i], im[i]);
    // Both halves, mirrored at an axis, and the pinned loop's.
    const both = (to, axis) => {
      const half = Array.from(re, (x, i) => to(x, im[i]));
      pen.strokeStyle = colours.grid;
      curve(pen, n, i => [half[i][0], 2 * axis - half[i][1]]);
      pen.strokeStyle = colours.line;
      curve(pen, n, i => half[i]);
      if (pinned) ghost(pen, colours, () => curve(pen, pinned.omega.length,
        i => to(pinned.re[i], pinned.im[i])));
    };
    both(bent, cy);
    const cross = (x, y) => {
      pen.strokeStyle = colours.mark;
      pen.lineWidth = 2;
      for (const d of [-1, 1]) {
        pen.beginPath();
        pen.moveTo(x - 5, y - 5 * d);
        pen.lineTo(x + 5, y + 5 * d);
        pen.stroke();
      }
      pen.lineWidth = 1;
    };
    cross(cx - scale * far(1), cy);
    const found = crossovers({ omega, re, im }), [worst] = found;
    // The inset, in the corner: twice as wide as the curve is near, within reason.
    const side = 0.36 * Math.min(wide, high), room = Math.min(1.5, Math.max(3 * nearest, 0.02));
    const zoom = 0.5 * side / room, ix = wide - 0.5 * side - 4, iy = 0.5 * side + 4;
    pen.fillStyle = colours.ground;
    pen.fillRect(ix - 0.5 * side, iy - 0.5 * side, side, side);
    pen.save();
    pen.beginPath();
    pen.rect(ix - 0.5 * side, iy - 0.5 * side, side, side);
    pen.clip();
    const inX = x => ix + zoom * (1 + x), inY = y => iy - zoom * y;
    pen.strokeStyle = colours.grid;
    pen.beginPath();
    pen.arc(inX(0), inY(0), zoom, 0, 7);
    pen.stroke();
    both((x, y) => [inX(x), inY(y)], iy);
    if (worst) {
      const angle = Math.atan2(-im[worst[0]], re[worst[0]]), half = angle > 0 ? Math.PI : -Math.PI;
      pen.strokeStyle = colours.mark;
      pen.lineWidth = 2.5;
      pen.beginPath();
      pen.arc(inX(0), inY(0), zoom, Math.min(angle, half), Math.max(angle, half));
      pen.stroke();
      pen.lineWidth = 1;
    }
    cross(inX(-1), inY(0));
    if (lit !== null) ring(pen, inX(re[lit]), inY(im[lit]), 5, colours);
    pen.restore();
    pen.strokeStyle = pen.fillStyle = colours.text;
    pen.strokeRect(ix - 0.5 * side, iy - 0.5 * side, side, side);
    pen.textAlign = "left";
    pen.textBaseline = "top";
    pen.fillText(`\u22121 \u00b1 ${say(room, 2)}`, ix - 0.5 * side + 4, iy - 0.5 * side + 4);
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    found.forEach(([i], k) => {
      const [x, y] = place(i);
      pen.beginPath();
      pen.arc(x, y, 3, 0, 7);
      pen.fill();
      if (k < 1) pen.fillText(hertz(omega[i]), x + 7, y);
    });
    if (lit !== null) ring(pen, ...place(lit), 6, colours);
    return place;
  }

  function drawBode([now, pinned], lit, pen, wide, high, colours) {
    const read = ({ omega, re, im }) => ({ omega, size: omega.map((_, i) =>
      10 * Math.log10(re[i] * re[i] + im[i] * im[i] + 1e-300)),
    phase: omega.map((_, i) => Math.atan2(im[i], re[i]) * 180 / Math.PI) });
    const shown = [now, pinned].filter(one => one).map(read), [{ omega, size, phase }] = shown;
    const n = omega.length, top = size.reduce((a, b) => Math.max(a, b));
    const low = size.reduce((a, b) => Math.min(a, Math.max(b, top - 160)), top);
    const first = Math.log10(omega[0] / TURN), last = Math.log10(omega[n - 1] / TURN);
    const left = 56, right = 8, room = (high - 62) / 2, span = wide - left - right;
    const at = w => left + span * (Math.log10(w / TURN) - first) / (last - first), px = i => at(omega[i]);
    const panel = (above, part, least, most, name, step) => {
      const py = v => above + room * (most - v) / (most - least);
      lines(pen, step || ticks(least, most, 4), v => say(v), py, left, wide - right, colours);
      upright(pen, name, 2, above + room / 2);
      pen.save();
      pen.beginPath();
      pen.rect(left, above, span, room);
      pen.clip();
      // A phase that passes 180 degrees is drawn anew from the other side.
      const trace = one => {
        pen.beginPath();
        one[part].forEach((v, i) => {
          const on = i && Math.abs(v - one[part][i - 1]) < 300;
          if (on) pen.lineTo(at(one.omega[i]), py(v)); else pen.moveTo(at(one.omega[i]), py(v));
        });
        pen.stroke();
      };
      pen.strokeStyle = colours.line;
      trace(shown[0]);
      if (shown[1]) ghost(pen, colours, () => trace(shown[1]));
      pen.restore();
      return py;
    };
    const of = panel(8, "size", low - 5, top + 5, "|L| in dB");
    const turned = panel(22 + room, "phase", -180, 180, "phase in degrees", [-180, -90, 0, 90, 180]);
    pen.fillStyle = colours.text;
    crossovers(now).forEach(([i], k) => {
      pen.beginPath();
      pen.arc(px(i), of(0), 3, 0, 7);
      pen.fill();
      pen.textAlign = px(i) > wide - 90 ? "right" : "left";
      pen.textBaseline = "bottom";
      if (k < 1) pen.fillText(hertz(omega[i]), px(i) + (px(i) > wide - 90 ? -6 : 6), of(0) - 4);
    });
    if (lit !== null) {
      pen.strokeStyle = colours.mark;
      pen.beginPath();
      pen.moveTo(px(lit), 8);
      pen.lineTo(px(lit), 22 + 2 * room);
      pen.stroke();
      ring(pen, px(lit), of(size[lit]), 5, colours);
      ring(pen, px(lit), turned(phase[lit]), 5, colours);
    }
    powersBelow(pen, first, last, left, span, 26 + 2 * room, wide, high);
    return i => [px(i), null];
  }

  /* The noise that is left, source by source; what time-delay interferometry takes out is dashed. */
  function drawNoise([now, pinned], lit, pen, wide, high, colours) {
    const { omega } = now, n = omega.length, left = 56, right = 8, top = 44, span = wide - left - right;
    const first = Math.log10(omega[0] / TURN), last = Math.log10(omega[n - 1] / TURN);
    const sources = [["laser", "laser", "#d55e00"], ["shot", "shot noise", "#009e73"],
      ["clock", "clocks", "#cc79a7"], ["motion", "motion", colours.dark ? "#56b4e9" : "#0072b2"],
      ["total", "all of it", colours.text]];
    const most = Math.ceil(Math.log10(Math.max(...now.total, ...now.required)));
    const least = Math.max(most - 9, Math.floor(Math.log10(Math.min(...now.total, ...now.clock, ...now.motion))));
    const px = w => left + span * (Math.log10(w / TURN) - first) / (last - first);
    const py = v => top + (high - top - 46) * (most - Math.log10(v + 1e-300)) / (most - least);
    const every = Math.ceil((most - least) / 6), powers = [];
    for (let k = least; k <= most; k += every) powers.push(10 ** k);
    lines(pen, powers, v => power(Math.round(Math.log10(v))), py, left, wide - right, colours);
    upright(pen, "Hz/\u221aHz", 2, top + (high - top) / 2);
    pen.textAlign = "left";
    pen.textBaseline = "top";
    [...sources, ["", "dashed: what TDI takes out", colours.mark]].reduce(([x, y], [, name, colour]) => {
      const long = pen.measureText(name).width + 28;
      const [u, v] = x + long > wide ? [left, y + 18] : [x, y];
      pen.fillStyle = colour;
      pen.fillRect(u, v + 5, 12, 3);
      pen.fillStyle = colours.text;
      pen.fillText(name, u + 16, v);
      return [u + long, v];
    }, [left, 4]);
    pen.save();
    pen.beginPath();
    pen.rect(left, top, span, high - top - 46);
    pen.clip();
    const trace = (found, name) => curve(pen, found.omega.length, i => [px(found.omega[i]), py(found[name][i])]);
    ghost(pen, { text: colours.mark }, () => trace(now, "required"));
    for (const [name, , colour] of sources) {
      pen.strokeStyle = colour;
      pen.lineWidth = name === "total" ? 2 : 1.2;
      trace(now, name);
    }
    pen.lineWidth = 1;
    if (pinned) ghost(pen, colours, () => trace(pinned, "total"));
    pen.restore();
    if (lit !== null) ring(pen, px(omega[lit]), py(now.total[lit]), 5, colours);
    powersBelow(pen, first, last, left, span, high - 42, wide, high);
    return i => [px(omega[i]), null];
  }

  /* The loop in time: the laser's frequency after a step of its own, a round trip a line. The scale
   * is linear around zero and logarithmic beyond, so that step, echo and what is left are seen. */
  function drawTime({ values, step, trip, shown }, pen, wide, high, colours) {
    const left = 56, right = 8, top = 8, below = 46, span = wide - left - right;
    const n = Math.max(2, Math.min(values.length, shown)), whole = values.length;
    let low = 0, most = 0, later = 0;
    for (let i = 0; i < whole; i++) {
      low = Math.min(low, values[i]);
      most = Math.max(most, values[i]);
      if (i > whole / 2) later = Math.max(later, Math.abs(values[i]));
    }
    const largest = Math.max(most, -low), small = Math.min(Math.max(0.3 * later, 1e-6 * largest), largest);
    const bent = v => Math.asinh(v / small), high0 = high - top - below;
    const room = 0.06 * (bent(most) - bent(low)) || 1, first = bent(low) - room, last = bent(most) + room;
    const px = i => left + span * i / (whole - 1);
    const py = v => top + high0 * (last - bent(v)) / (last - first);
    const decades = [0];
    for (let k = Math.ceil(Math.log10(small)); k <= Math.log10(largest); k++)
      decades.push(...[10 ** k, -(10 ** k)].filter(v => v <= most && v >= low));
    lines(pen, decades, v => v ? `${v < 0 ? "\u2212" : ""}${power(Math.round(Math.log10(Math.abs(v))))}` : "0",
      py, left, wide - right, colours);
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const trips = whole * step / trip, every = Math.ceil(trips / (wide / 50));
    for (let k = 0; k <= trips; k += every) {
      const x = left + span * k / trips;
      pen.beginPath();
      pen.moveTo(x, top);
      pen.lineTo(x, top + high0);
      pen.stroke();
      pen.fillText(say(+(k * trip).toPrecision(6), 4), x, top + high0 + 6);
    }
    pen.strokeStyle = colours.line;
    pen.lineWidth = 1.5;
    curve(pen, n, i => [px(i), py(values[i])]);
    pen.fillStyle = colours.mark;
    pen.beginPath();
    pen.arc(px(n - 1), py(values[n - 1]), 4, 0, 7);
    pen.fill();
    pen.fillStyle = colours.text;
    pen.textBaseline = "bottom";
    pen.fillText("time in s, a line each round trip", (left + wide - right) / 2, high - 2);
    upright(pen, "laser's frequency", 2, top + high0 / 2);
  }

  /* A year: half differences above, true and held (dashed), and the critical perturbation below. Days
   * that were counted and are not stable are shaded in both. */
  function drawYear({ values, days, day }, pen, wide, high, colours) {
    const left = 56, right = 8, span = wide - left - right, room = (high - 74) / 2, last = values.length - 1;
    const px = t => left + span * t / last;
    const most = 1.1 * Math.max(...values.flat().map(Math.abs)) * 1e3, above = v => 8 + room * (most - v) / (2 * most);
    pen.fillStyle = colours.mark;
    days.forEach((found, t) => {
      if (found !== null) return;
      // As far as to the days beside it that were counted.
      let from = t - 1, to = t + 1;
      while (from > 0 && days[from] === undefined) from--;
      while (to < last && days[to] === undefined) to++;
      pen.globalAlpha = 0.3;
      for (const y of [8, 26 + room])
        pen.fillRect(px(0.5 * (from + t)), y, px(0.5 * (to + t)) - px(0.5 * (from + t)), room);
      pen.globalAlpha = 1;
      pen.fillRect(px(0.5 * (from + t)), 4, px(0.5 * (to + t)) - px(0.5 * (from + t)), 4);
    });
    pen.fillStyle = colours.text;
    lines(pen, ticks(-most, most, 5), v => say(+v.toPrecision(6)), above, left, wide - right, colours);
    upright(pen, "half difference in ms", 2, 8 + room / 2);
    pen.strokeStyle = colours.line;
    pen.lineWidth = 2;
    curve(pen, values.length, t => [px(t), above(1e3 * values[t][0])]);
    pen.lineWidth = 1;
    ghost(pen, colours, () => curve(pen, values.length, t => [px(t), above(1e3 * values[t][1])]));
    const found = days.map((v, t) => [t, v]).filter(([, v]) => v > 0 && v < Infinity);
    const sizes = found.map(([, v]) => Math.log10(v)), first = Math.floor(Math.min(-1, ...sizes));
    const top = Math.max(first + 1, ...sizes.map(Math.ceil));
    const below = v => 26 + room + room * (top - Math.log10(v)) / (top - first);
    lines(pen, Array.from({ length: top - first + 1 }, (_, k) => 10 ** (first + k)),
      v => power(Math.round(Math.log10(v))), below, left, wide - right, colours);
    upright(pen, "least that breaks it", 2, 26 + 1.5 * room);
    pen.fillStyle = colours.line;
    for (const [t, v] of found) pen.fillRect(px(t) - 1.5, below(v) - 1.5, 3, 3);
    pen.strokeStyle = colours.mark;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(px(day), 4);
    pen.lineTo(px(day), 26 + 2 * room);
    pen.stroke();
    pen.fillStyle = colours.text;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (let t = 0; t <= last; t += 60) pen.fillText(String(t), px(t), 32 + 2 * room);
    pen.textBaseline = "bottom";
    pen.fillText("day", left + span / 2, high - 2);
  }

  return { element, Sheet, Chart, drawNyquist, drawBode, drawNoise, drawTime, drawYear };
})();
