"use strict";
/*
 * What the live pages draw: the chart over (c1, c2) with the D-curve, the Nyquist curve, Bode's plot, and
 * a year. Plain canvases, because charts of many thousand points have to follow
 * the pointer in every frame.
 */
const armlockDraw = (function () {
  const { TURN, say, scientific, power } = armlockText, { UNCONFINED } = armlockLoop();
  // The paper's perturbations.
  const SQUARE = 1e-6;
  // While the page is printed, the pictures are sharp and on white.
  let printing = false;

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
    const dark = document.documentElement.dataset.theme === "dark" && !printing;
    return dark
      ? { dark, text: "#e3e6e9", grid: "#55606a", line: "#56b4e9", other: "#3ecf9c", mark: "#f0a060", ground: "#12181d",
        stable: [70, 80, 90], few: [150, 84, 40], many: [255, 186, 120], lost: [112, 88, 148],
        unsure: [[18, 24, 29], [96, 104, 112]] }
      : { dark, text: "#222832", grid: "#c9d0d6", line: "#0072b2", other: "#00755a", mark: "#d55e00", ground: "#ffffff",
        stable: [184, 196, 206], few: [255, 232, 208], many: [209, 85, 34], lost: [147, 132, 160],
        unsure: [[255, 255, 255], [190, 196, 202]] };
  }

  /* The place in an ascending array that is nearest to a value. */
  function nearest(values, value) {
    let low = 0, high = values.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (values[middle] < value) low = middle; else high = middle;
    }
    return value - values[low] < values[high] - value ? low : high;
  }

  /* A canvas as wide as its place, sharp on every screen and on paper, drawn once a frame at most.
   * `height` says how high it is for its width. */
  class Sheet {
    constructor(attributes, height, draw) {
      this.canvas = element("canvas", attributes);
      this.paint = draw;
      this.wide = this.high = 0;
      // Its size is asked for once, not in each frame: that would lay out the page anew.
      new ResizeObserver(() => {
        // On paper it keeps its shape.
        if (printing) return;
        const wide = this.canvas.clientWidth, high = Math.round(height(wide));
        // The height that it was given here is no change.
        if (wide === this.wide && high === this.high) return;
        [this.wide, this.high] = [wide, high];
        this.canvas.style.aspectRatio = `${this.wide} / ${this.high}`;
        this.now();
      }).observe(this.canvas);
      new MutationObserver(() => this.now()).observe(document.documentElement,
        { attributes: true, attributeFilter: ["data-theme"] });
      for (const name of ["beforeprint", "afterprint"]) addEventListener(name, () => {
        printing = name === "beforeprint";
        this.now();
      });
    }

    draw() {
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => this.now());
    }

    now() {
      this.waiting = false;
      if (this.wide) this.render(this.canvas, printing ? 4 : window.devicePixelRatio || 1);
    }

    /* Where on the canvas the pointer is. */
    place({ clientX, clientY }) {
      const { left, top } = this.canvas.getBoundingClientRect();
      return [clientX - left, clientY - top];
    }

    render(canvas, ratio) {
      const { wide, high } = this;
      const size = [wide, high].map(v => Math.round(v * ratio));
      if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
      const pen = canvas.getContext("2d"), colours = palette();
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, wide, high);
      pen.fillStyle = colours.ground;
      if (printing) pen.fillRect(0, 0, wide, high);
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

  function dot(pen, x, y, radius, colour, edge = null) {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 7);
    pen.fill();
    if (!edge) return;
    pen.strokeStyle = edge;
    pen.stroke();
  }

  /* A cross as of a pole. */
  function cross(pen, x, y) {
    pen.beginPath();
    for (const d of [-5, 5]) {
      pen.moveTo(x - 5, y - d);
      pen.lineTo(x + 5, y + d);
    }
    pen.stroke();
  }

  /* The chart over (c1, c2). `centre` and `half` say what it shows. The pointer's place is a preview;
   * a click or a tap holds the point, and Escape or another click on it releases it. */
  class Chart {
    constructor(label, { changed, pointed }) {
      Object.assign(this, { changed, pointed, centre: [1, 1], half: 3, held: null, hover: null, broken: [],
        grid: null, picture: null, curve: null, ghost: null, lit: null, stale: false, fingers: new Map() });
      this.sheet = new Sheet({ tabindex: 0, role: "application", "aria-label": `${label} Arrow keys `
        + "move the point, with shift by ten steps; plus and minus zoom; Escape releases the point." }, wide => wide + 40,
        (pen, wide, high, colours) => this.draw(pen, wide, high, colours));
      const canvas = this.canvas = this.sheet.canvas;
      canvas.addEventListener("pointermove", event => this.move(event));
      canvas.addEventListener("pointerdown", event => this.press(event));
      for (const name of ["pointerup", "pointercancel"])
        canvas.addEventListener(name, event => this.lift(event));
      canvas.addEventListener("pointerleave", () => this.preview(null));
      canvas.addEventListener("keydown", event => this.key(event));
      // From wherever the reader is by now: at a slider, say.
      addEventListener("keydown", event => { if (event.key === "Escape" && this.held) this.hold(null); });
      // A vertical swipe scrolls the page (touch-action), but neither a pinch nor the held point.
      canvas.addEventListener("touchstart", event => {
        if (event.touches.length > 1 || this.onPoint) event.preventDefault();
      }, { passive: false });
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

    get marked() { return this.held || this.hover; }

    show(centre, half) {
      this.centre = centre;
      this.half = Math.min(Math.max(half, 1e-12), 1e3);
      this.sheet.draw();
      this.changed();
    }

    zoom(factor, around) {
      const [x, y] = around || this.held || this.centre;
      const half = this.half * factor;
      this.show([x + (this.centre[0] - x) * factor, y + (this.centre[1] - y) * factor], half);
    }

    clear() {
      this.grid = this.picture = this.curve = null;
      this.broken = [];
      this.stale = false;
      this.sheet.draw();
    }

    fill({ counts, n, box }) {
      this.grid = { counts, n, ...box };
      this.picture = null;
      this.stale = false;
      this.sheet.draw();
    }

    /* The counts as a picture. What is undecided is striped. */
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
        pixels[(n - 1 - j) * n + i] = count >= 0 ? shades[count] : count === UNCONFINED ? lost
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

    get frame() {
      const size = this.sheet.wide - 58 - 12;
      return { left: 58, top: 10, wide: size, high: size };
    }

    draw(pen, wide, high, colours) {
      const { frame } = this, { x0, x1, y0, y1 } = this.box;
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
      // Its turns may fill the plane, and the regions show through.
      if (this.ghost) ghost(pen, colours.text, () => this.trace(pen, this.ghost, colours, true), 0.3);
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
      for (const { place: [x, y], weakest } of this.broken)
        dot(pen, px(x), py(y), weakest ? 5 : 4, weakest ? colours.text : colours.ground, weakest ? colours.ground : colours.text);
      if (this.lit) dot(pen, px(this.lit[0]), py(this.lit[1]), 6, colours.mark, colours.ground);
      if (this.marked) ring(pen, px(this.marked[0]), py(this.marked[1]), this.held ? 8 : 5, colours);
      if (this.held) dot(pen, px(this.held[0]), py(this.held[1]), 3, colours.line);
      pen.restore();
      this.axes(pen, frame, colours);
      this.keys(pen, wide, frame.top + frame.high + 56, colours);
    }

    axes(pen, frame, colours) {
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
        else pen.fillText(name, frame.left + frame.wide / 2, frame.top + frame.high + 42);
      });
    }

    /* What the colours mean, so that a print and a file say it as well. */
    keys(pen, wide, y, { stable, few, many, lost, unsure, text }) {
      let x = 6;
      pen.font = "12px sans-serif";
      pen.textAlign = "left";
      pen.textBaseline = "middle";
      for (const [name, shades] of [["stable", [stable]], ["unstable, few to many roots", [few, many]],
        ["unstable at high frequency", [lost]], ["undecided", [...unsure, ...unsure]],
        [`D-curve at the edge${this.curve?.range[1] ? `, ${[...new Set(this.curve.range.map(w => say(w / TURN, 2)))].join(" to ")} Hz` : ""}`, RAINBOW]]) {
        const long = pen.measureText(name).width + 34, half = shades === RAINBOW ? 1.5 : 5;
        if (x + long > wide) [x, y] = [6, y + 17];
        shades.forEach((shade, k) => {
          pen.fillStyle = `rgb(${shade})`;
          pen.fillRect(x + 15 * k / shades.length, y - half, 15 / shades.length, 2 * half);
        });
        pen.fillStyle = text;
        pen.fillText(name, x + 20, y);
        x += long;
      }
    }

    /* Whether the stable region ends at a place, as far as pixels can tell; any place while there is no chart. */
    bounds(x, y) {
      if (!this.grid || this.stale) return true;
      const { counts, n, x0, x1, y0, y1 } = this.grid, i = Math.round((x - x0) / (x1 - x0) * (n - 1));
      const j = Math.round((y - y0) / (y1 - y0) * (n - 1));
      let [stable, other] = [false, false];
      for (let k = Math.max(0, i - 1); k <= Math.min(n - 1, i + 1); k++)
        for (let m = Math.max(0, j - 1); m <= Math.min(n - 1, j + 1); m++)
          if (counts[m * n + k] === 0) stable = true; else other = true;
      return stable && other;
    }

    /* The D-curve where it bounds the stable region, coloured by the frequency; all of a pinned one. */
    trace(pen, { curve, line, range }, colours, pinned) {
      const { px, py } = this, [first, last] = range;
      pen.lineWidth = 1.2;
      pen.strokeStyle = colours.text;
      if (line) {
        const [a, b, c] = line, { x0, x1, y0, y1 } = this.box;
        const ends = Math.abs(b) > Math.abs(a) ? [x0, x1].map(x => [x, 1 + (c - a * (x - 1)) / b])
          : [y0, y1].map(y => [1 + (c - b * (y - 1)) / a, y]);
        const at = share => [0, 1].map(k => ends[0][k] + share * (ends[1][k] - ends[0][k]));
        pen.beginPath();
        for (let k = 0; k < 400; k++) {
          const [from, middle, to] = [0, 0.5, 1].map(part => at((k + part) / 400));
          if (!pinned && !this.bounds(...middle)) continue;
          pen.moveTo(px(from[0]), py(from[1]));
          pen.lineTo(px(to[0]), py(to[1]));
        }
        pen.stroke();
      }
      let bin = -1, down = false;
      pen.beginPath();
      for (let i = 0; i < curve.length; i += 3) {
        if (Number.isNaN(curve[i]) || !pinned && !this.bounds(curve[i], curve[i + 1])) { down = false; continue; }
        const t = Math.log(curve[i + 2] / first) / (Math.log(last / first) || 1);
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
    }

    at(event) {
      const { frame } = this, { x0, x1, y0, y1 } = this.box, [u, v] = this.sheet.place(event);
      const x = (u - frame.left) / frame.wide, y = 1 - (v - frame.top) / frame.high;
      if (x < 0 || x > 1 || y < 0 || y > 1) return null;
      return [x0 + x * (x1 - x0), y0 + y * (y1 - y0)];
    }

    /* Where the fingers are, or the mouse: the middle, and how far two are apart. */
    grip() {
      const all = [...this.fingers.values()], [[x, y]] = all, [u, v] = all[all.length - 1];
      return { x: 0.5 * (x + u), y: 0.5 * (y + v), apart: Math.hypot(u - x, v - y),
        centre: this.centre, half: this.half };
    }

    /* A drag moves the view, two fingers zoom, and what begins on the held point moves it. */
    press(event) {
      if (!this.at(event) || event.button) return;
      const [x, y] = this.sheet.place(event);
      this.canvas.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, [x, y]);
      this.gripped = this.begun = this.grip();
      this.moved = this.fingers.size > 1;
      this.onPoint = this.held && !this.moved
        && Math.hypot(x - this.px(this.held[0]), y - this.py(this.held[1])) < (event.pointerType === "mouse" ? 10 : 24);
    }

    move(event) {
      if (!this.fingers.has(event.pointerId)) {
        this.preview(this.at(event));
        return;
      }
      this.fingers.set(event.pointerId, this.sheet.place(event));
      const now = this.grip(), { frame } = this;
      if (!this.moved) {
        // A finger that may go on to scroll the page does not move the view yet.
        const across = Math.abs(now.x - this.gripped.x), down = Math.abs(now.y - this.gripped.y), swipe = event.pointerType === "touch" && !this.onPoint;
        if (swipe ? across < 16 || across < down : Math.hypot(across, down) < 4) return;
        if (swipe) this.gripped = now;
      }
      const from = this.gripped;
      this.moved = true;
      if (this.onPoint) {
        const found = this.at(event);
        if (found) this.hold(found);
        return;
      }
      this.canvas.style.cursor = "grabbing";
      const half = from.apart && now.apart ? from.half * from.apart / now.apart : from.half;
      // What was below the fingers stays there.
      const off = ({ x, y }) => [2 * (x - frame.left) / frame.wide - 1, 1 - 2 * (y - frame.top) / frame.high];
      const [p, q] = [off(from), off(now)];
      this.show(from.centre.map((v, k) => v + p[k] * from.half - q[k] * half), half);
    }

    lift(event) {
      const tapped = this.fingers.delete(event.pointerId) && !this.moved && event.type === "pointerup";
      const found = tapped && this.at(event);
      // The browser has taken the finger to scroll with: the view stays as it was.
      if (event.type === "pointercancel" && this.moved && !this.onPoint) this.show(this.begun.centre, this.begun.half);
      if (found) this.hold(this.onPoint ? null : found);
      this.onPoint = false;
      this.canvas.style.cursor = "";
      if (this.fingers.size) this.gripped = this.grip();
    }

    preview(point) {
      if (this.held || this.hover === point) return;
      this.hover = point;
      this.sheet.draw();
      this.pointed();
    }

    hold(point) {
      [this.held, this.hover] = [point, null];
      this.sheet.draw();
      this.pointed(true);
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
      const step = this.half / 100 * (event.shiftKey ? 10 : 1);
      const found = (this.held || this.centre).map((v, k) => v + step * move[k]);
      // The view follows a point that leaves it.
      const off = found.map((v, k) => v - Math.min(Math.max(v, this.centre[k] - this.half), this.centre[k] + this.half));
      if (off.some(v => v)) this.show(this.centre.map((v, k) => v + off[k]), this.half);
      this.hold(found);
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
    let u = Infinity, v = Infinity, down = false;
    pen.beginPath();
    for (let i = 0; i < n; i++) {
      const [x, y] = place(i);
      if (Number.isNaN(x)) { [u, v, down] = [Infinity, Infinity, false]; continue; }
      if (Math.abs(x - u) + Math.abs(y - v) < 0.7 && i < n - 1) continue;
      if (down) pen.lineTo(x, y); else pen.moveTo(x, y);
      [u, v, down] = [x, y, true];
    }
    pen.stroke();
  }

  /* What is pinned is dashed, and a paler curve of its colour. */
  function ghost(pen, colour, draw, alpha = 0.65) {
    pen.strokeStyle = colour;
    pen.globalAlpha = alpha;
    pen.setLineDash([4, 4]);
    draw();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  /* Lines at values beside a plot. */
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

  /* Text near (x, y), where it covers none of the labels `taken` and the fewest of the places of curves. */
  function labelBeside(pen, text, x, y, colours, taken, places) {
    const long = pen.measureText(text).width, left = x - { left: 0, center: 0.5, right: 1 }[pen.textAlign] * long;
    const below = v => places.filter(([a, b]) => a > left && a < left + long && Math.abs(b - v) < 9).length
      + (v < 9 || taken.some(([a, b, c]) => left < b && left + long > a && Math.abs(v - c) < 15) ? 1e6 : 0);
    const [[, found]] = [0, -15, 15, -30, 30].map(d => [below(y + d), y + d]).sort(([a], [b]) => a - b);
    taken.push([left, left + long, found]);
    // Over a curve it stays readable.
    pen.lineJoin = "round";
    pen.lineWidth = 4;
    pen.strokeStyle = colours.ground;
    pen.strokeText(text, x, found);
    pen.lineWidth = 1;
    pen.fillText(text, x, found);
  }

  const degrees = angle => `${say(angle * 180 / Math.PI)}\u00b0`;
  const decibels = size => 20 * Math.log10(size + 1e-300);

  /* Rings of distances from the middle, with their labels where the fewest of the places lie. */
  function rings(pen, [cx, cy], sizes, radius, write, places, colours) {
    const crowd = new Array(16).fill(0), outer = 0.3 * radius(sizes.at(-1));
    for (const [x, y] of places) if (Math.hypot(x - cx, y - cy) > outer)
      crowd[Math.floor((Math.atan2(y - cy, x - cx) / TURN + 1) * 16) % 16]++;
    const angle = (crowd.indexOf(Math.min(...crowd)) + 0.5) * TURN / 16;
    pen.strokeStyle = colours.grid;
    for (const size of sizes) {
      pen.beginPath();
      pen.arc(cx, cy, radius(size), 0, 7);
      pen.stroke();
    }
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    return taken => {
      let last = 0;
      for (const size of sizes) if (radius(size) > last + 28) {
        last = radius(size);
        labelBeside(pen, write(size), cx + last * Math.cos(angle), cy + last * Math.sin(angle), colours, taken, []);
      }
    };
  }

  /* The Nyquist curve. Its distance from 0 is linear up to 1, so that the unit circle and what is in it
   * are seen as they are, and a logarithm of the logarithm beyond; angles stay. Returns where a sample
   * is. */
  function drawNyquist([now, pinned], lit, pen, wide, high, colours) {
    const { omega, re, im, margins } = now, cx = wide / 2, cy = high / 2, full = 0.47 * Math.min(wide, high);
    let most = 10;
    for (let i = 0; i < omega.length; i++) most = Math.max(most, Math.hypot(re[i], im[i]));
    most = Math.min(most, 1e6);
    const bend = v => v <= 1 ? v : 1 + Math.log1p(Math.log(Math.min(v, most)));
    const radius = v => full * bend(v) / bend(most);
    const bent = (x, y) => {
      const size = Math.hypot(x, y) || 1e-300, k = radius(size) / size;
      return [cx + k * x, cy - k * y];
    };
    // Between two samples that are far apart in the picture the curve is followed, not cut short.
    const path = one => {
      const key = [full, most, one.rough].join();
      if (one.cache.key === key) return one.cache.path;
      let [u, v] = bent(one.re[0], one.im[0]), from = one.omega[0], left = one.rough ? 400 : 100000;
      const found = [[u, v]], go = (x, y, to, depth) => {
        // At two places, none of them the middle: a detour may cross its own chord.
        if (Math.abs(x - u) + Math.abs(y - v) > 8 && depth < 24) for (const share of [0.4, 0.75]) {
          const between = from + share * (to - from), [a, b] = left-- > 0 ? bent(...one.at(between)) : [];
          if (Math.hypot(a - u - share * (x - u), b - v - share * (y - v)) > 2) {
            go(a, b, between, depth + 1);
            go(x, y, to, depth + 1);
            return;
          }
        }
        found.push([x, y]);
        [u, v, from] = [x, y, to];
      };
      for (let i = 1; i < one.omega.length; i++) {
        const [x, y] = bent(one.re[i], one.im[i]);
        if (one.gap(i)) {
          found.push([NaN, NaN], [x, y]);
          [u, v, from] = [x, y, one.omega[i]];
        } else if (Math.abs(x - u) + Math.abs(y - v) > 0.7) go(x, y, one.omega[i], 0);
      }
      [one.cache.key, one.cache.path] = [key, found];
      return found;
    };
    const half = path(now), other = pinned && path(pinned), sizes = [1];
    while (10 * sizes.at(-1) <= most) sizes.push(10 * sizes.at(-1));
    pen.strokeStyle = colours.text;
    pen.globalAlpha = 0.6;
    pen.beginPath();
    pen.arc(cx, cy, radius(1), 0, 7);
    pen.stroke();
    pen.globalAlpha = 1;
    sizes.shift();
    const places = half.flatMap(([x, y]) => [[x, y], [x, 2 * cy - y]]);
    const named = rings(pen, [cx, cy], sizes, radius, size => power(Math.round(Math.log10(size))), places, colours);
    if (now.bound) {
      // Here |S| is above its bound.
      pen.fillStyle = colours.mark;
      pen.globalAlpha = 0.25;
      pen.beginPath();
      for (let k = 0; k < 90; k++)
        pen.lineTo(...bent(Math.cos(TURN * k / 90) / 10 ** (now.bound / 20) - 1, Math.sin(TURN * k / 90) / 10 ** (now.bound / 20)));
      pen.fill();
      pen.globalAlpha = 1;
      pen.fillStyle = colours.text;
    }
    pen.strokeStyle = colours.grid;
    curve(pen, half.length, i => [half[i][0], 2 * cy - half[i][1]]);
    pen.strokeStyle = colours.line;
    curve(pen, half.length, i => half[i]);
    if (other) ghost(pen, colours.line, () => curve(pen, other.length, i => other[i]));
    const taken = [];
    named(taken);
    pen.strokeStyle = colours.mark;
    pen.lineWidth = 2;
    const x = cx - radius(1);
    cross(pen, x, cy);
    if (margins?.phaseAt > 0 && margins.phase > 0) {
      const [a, b] = now.at(margins.phaseAt), angle = Math.atan2(-b, a), to = angle > 0 ? Math.PI : -Math.PI;
      pen.lineWidth = 3;
      pen.beginPath();
      pen.arc(cx, cy, radius(1), Math.min(angle, to), Math.max(angle, to));
      pen.stroke();
      // To the left of the imaginary axis, which an integrator's curve follows.
      pen.textAlign = "right";
      labelBeside(pen, `${degrees(margins.phase)} at ${say(margins.phaseAt / TURN)} Hz`, cx - 6, cy + (b < 0 ? 1 : -1)
        * (radius(1) + 14), colours, taken, places);
    }
    pen.lineWidth = 1;
    if (lit !== null) ring(pen, ...bent(re[lit], im[lit]), 6, colours);
    return i => bent(re[i], im[i]);
  }

  /* |L| and |S| above, the phase of L below, with the margins where the certified walk met them. */
  function drawBode([now, pinned], lit, pen, wide, high, colours) {
    const of = ({ omega, re, im, gap }) => ({ omega, gap, size: omega.map((_, i) => decibels(Math.hypot(re[i], im[i]))),
      left: omega.map((_, i) => -decibels(Math.hypot(1 + re[i], im[i]))),
      phase: omega.map((_, i) => Math.atan2(im[i], re[i]) * 180 / Math.PI) });
    const shown = [now, pinned].filter(one => one).map(of), [{ omega, size, left: rest, phase }] = shown;
    const margins = now.margins || {}, n = omega.length, faint = -50;
    // What is too small to matter at both ends of the axis is left out.
    const marked = Math.max(...["lower", "upper", "phase", "delay", "modulus"].map(name => margins[`${name}At`]).filter(w => w < Infinity), 0);
    const from = Math.max(0, size.findIndex(v => v > faint));
    const to = Math.min(n - 1, Math.max(size.findLastIndex(v => v > faint), marked ? nearest(omega, 1.2 * marked) : 0));
    const first = Math.log10(omega[from] / TURN), last = Math.log10(omega[to > from ? to : n - 1] / TURN);
    const top = size.reduce((a, b) => Math.max(a, b), rest.reduce((a, b) => Math.max(a, b), now.bound || 0));
    const low = Math.max(-top - 10, Math.min(faint, rest.reduce((a, b) => Math.min(a, b))));
    const left = 56, right = 8, room = (high - 62) / 2, span = wide - left - right;
    const px = w => left + span * (Math.log10(w / TURN) - first) / (last - first);
    for (const one of shown) one.at = one.omega.map(px);
    const inside = w => w > 0 && px(w) >= left && px(w) <= wide - right;
    const panel = (above, parts, least, most, name, step) => {
      const py = v => above + room * (most - v) / (most - least);
      lines(pen, step || ticks(least, most, 5), v => say(v), py, left, wide - right, colours);
      upright(pen, name, 2, above + room / 2);
      pen.save();
      pen.beginPath();
      pen.rect(left, above, span, room);
      pen.clip();
      // A phase that passes 180 degrees is drawn anew from the other side.
      const trace = (one, part) => {
        pen.beginPath();
        one[part].forEach((v, i) => {
          const on = i && !one.gap(i) && Math.abs(v - one[part][i - 1]) < 300;
          if (on) pen.lineTo(one.at[i], py(v)); else pen.moveTo(one.at[i], py(v));
        });
        pen.stroke();
      };
      for (const [part, colour] of parts) {
        // The band that all turns fill.
        pen.fillStyle = colour;
        pen.globalAlpha = 0.25;
        pen.beginPath();
        const edge = sign => now.band.map(([w, re, im, radius]) => {
          const centre = Math.hypot(part === "left" ? 1 + re : re, im), value = decibels(Math.max(0, centre + sign * radius));
          return [px(w), py(Math.max(-1e4, part === "left" ? -value : value))];
        });
        if (part !== "phase" && now.band.length) for (const [x, y] of [...edge(1), ...edge(-1).reverse()]) pen.lineTo(x, y);
        pen.fill();
        pen.globalAlpha = 1;
        if (shown[1]) ghost(pen, colour, () => trace(shown[1], part));
        pen.strokeStyle = colour;
        trace(shown[0], part);
      }
      pen.restore();
      return py;
    };
    const gain = panel(8, [["left", colours.other], ["size", colours.line]], low, top + 5, "dB");
    const turned = panel(22 + room, [["phase", colours.line]], -180, 180, "phase in \u00b0", [-180, -90, 0, 90, 180]);
    const taken = [], places = [];
    for (let i = 0; i < n; i += Math.ceil(n / 600)) for (const [py, part] of [[gain, size], [gain, rest], [turned, phase]])
      places.push([shown[0].at[i], py(part[i])]);
    // From the curve to where the loop would be on the limit.
    const margin = (w, a, b, text) => {
      if (!inside(w)) return;
      const x = px(w), close = x > wide - 110;
      pen.strokeStyle = colours.mark;
      pen.lineWidth = 3;
      pen.beginPath();
      pen.moveTo(x, a);
      pen.lineTo(x, b);
      pen.stroke();
      dot(pen, x, a, 3, colours.mark);
      pen.fillStyle = colours.text;
      pen.textAlign = close ? "right" : "left";
      pen.textBaseline = "middle";
      labelBeside(pen, text, x + (close ? -7 : 7), Math.min(0.5 * (a + b), 2 * room - (a > room + 22 ? 8 : room + 8)), colours, taken, places);
    };
    for (const name of ["lower", "upper"]) if (margins[`${name}At`] > 0)
      margin(margins[`${name}At`], gain(-decibels(margins[name])), gain(0), `gain \u00d7 ${say(margins[name])}`);
    if (margins.phaseAt > 0) {
      const [a, b] = now.at(margins.phaseAt), edge = b < 0 ? -180 : 180;
      margin(margins.phaseAt, turned(edge - Math.sign(edge) * margins.phase * 180 / Math.PI), turned(edge),
        degrees(margins.phase));
    }
    if (margins.modulus > 0 && margins.modulusAt > 0) {
      const y = gain(-decibels(margins.modulus));
      margin(margins.modulusAt, y, y, `|S| \u2264 ${say(-decibels(margins.modulus))} dB`);
    }
    // The bound on |S|, and what is above it.
    if (now.bound) {
      ghost(pen, colours.text, () => curve(pen, 2, k => [left + k * span, gain(now.bound)]), 1);
      pen.textAlign = "right";
      labelBeside(pen, "bound", left + 0.7 * span, gain(now.bound) - 9, colours, taken, places);
      pen.strokeStyle = colours.mark;
      pen.lineWidth = 3;
      curve(pen, n, i => i >= from && i <= to && rest[i] > now.bound ? [shown[0].at[i], gain(rest[i])] : [NaN, NaN]);
      pen.lineWidth = 1;
    }
    // The names stand at the curves.
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    for (const [name, part, colour, at] of [["|L|", size, colours.line, 0.03], ["|S|", rest, colours.other, 0.4]]) {
      const i = nearest(omega, TURN * 10 ** (first + at * (last - first)));
      pen.fillStyle = colour;
      labelBeside(pen, name, px(omega[i]), Math.min(Math.max(gain(part[i]) - 10, 15), 2 + room), colours, taken, places);
    }
    pen.fillStyle = colours.text;
    if (lit !== null) {
      const x = px(omega[lit]);
      pen.strokeStyle = colours.mark;
      pen.beginPath();
      pen.moveTo(x, 8);
      pen.lineTo(x, 22 + 2 * room);
      pen.stroke();
      for (const y of [gain(size[lit]), gain(rest[lit]), turned(phase[lit])]) ring(pen, x, y, 4, colours);
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (let k = Math.ceil(first); k <= last; k += Math.ceil(60 * (last - first) / wide))
      pen.fillText(power(k), px(TURN * 10 ** k), 26 + 2 * room);
    pen.textBaseline = "bottom";
    pen.fillText("frequency in Hz", left + span / 2, high - 2);
    return i => [px(omega[i]), null];
  }

  /* A year: half differences above, true and assumed (dashed), and the critical perturbation below.
   * Days that were counted and are not stable are shaded in both. */
  function drawYear({ values, days, day }, pen, wide, high, colours) {
    const left = 56, right = 8, span = wide - left - right, room = (high - 74) / 2, last = values.length - 1;
    const px = t => left + span * t / last;
    const most = 1.1 * Math.max(...values.flat().map(Math.abs)) * 1e3, above = v => 8 + room * (most - v) / (2 * most);
    pen.fillStyle = colours.mark;
    for (let t = 0; t <= last; t++) if (days[t] === null) {
      // Half a day to each side: what lies beside it may not be counted yet.
      const from = px(Math.max(0, t - 0.5));
      while (days[t + 1] === null) t++;
      const long = px(Math.min(last, t + 0.5)) - from;
      pen.globalAlpha = 0.3;
      for (const y of [8, 26 + room]) pen.fillRect(from, y, long, room);
      pen.globalAlpha = 1;
      pen.fillRect(from, 4, long, 4);
    }
    pen.fillStyle = colours.text;
    lines(pen, ticks(-most, most, 5), v => say(+v.toPrecision(6)), above, left, wide - right, colours);
    upright(pen, "half difference in ms", 2, 8 + room / 2);
    pen.strokeStyle = colours.line;
    pen.lineWidth = 2;
    curve(pen, values.length, t => [px(t), above(1e3 * values[t][0])]);
    pen.lineWidth = 1;
    ghost(pen, colours.text, () => curve(pen, values.length, t => [px(t), above(1e3 * values[t][1])]), 1);
    const found = days.map((v, t) => [t, v]).filter(([, v]) => v > 0 && v < Infinity);
    // The paper's perturbation is always in sight.
    const sizes = found.map(([, v]) => Math.log10(v)), first = Math.floor(Math.min(-7, ...sizes));
    const top = Math.max(first + 1, ...sizes.map(Math.ceil));
    const below = v => 26 + room + room * (top - Math.log10(v)) / (top - first);
    lines(pen, Array.from({ length: Math.floor(top - first) + 1 }, (_, k) => 10 ** (first + k)),
      v => power(Math.round(Math.log10(v))), below, left, wide - right, colours);
    upright(pen, "critical, along \u00b1(1, \u22121)", 2, 26 + 1.5 * room);
    ghost(pen, colours.text, () => curve(pen, 2, k => [left + k * span, below(SQUARE)]));
    pen.textAlign = "right";
    pen.textBaseline = "bottom";
    pen.fillText(`the paper\u2019s ${power(-6)}`, wide - right - 4, below(SQUARE) - 2);
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

  return { element, nearest, palette, Sheet, Chart, rings, labelBeside, cross, drawNyquist, drawBode, drawYear };
})();
