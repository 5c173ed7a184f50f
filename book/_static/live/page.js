"use strict";
/*
 * The live pages: a form, a chart of the stable region that answers the pointer, plots that follow.
 *
 * A page loads this file. It loads those beside it, each with one job: loop.js counts, margins.js
 * and chart.js certify, time.js steps, noise.js weighs noise, text.js reads and writes, draw.js draws. What takes long
 * runs in workers, which are made of the functions' own text: a page that is opened from disk may
 * load no script into one.
 */
(function () {
  const here = document.currentScript.src;
  const files = ["loop.js", "margins.js", "chart.js", "time.js", "noise.js", "text.js",
    "draw.js", ...document.querySelector("[data-live=year]") ? ["orbits.js"] : []];
  const missing = files.filter(name =>
    !Array.from(document.scripts).some(script => script.src.endsWith(`/live/${name}`)));
  Promise.all(missing.map(name => new Promise((done, failed) => {
    const script = document.createElement("script");
    // In the order of the list.
    script.async = false;
    script.onload = done;
    script.onerror = () => failed(new Error(`${name} is missing beside page.js`));
    script.src = new URL(name, here).href;
    document.head.append(script);
  }))).then(() => {
    if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", armlockPages);
    else armlockPages();
  });
})();

function armlockPages() {
  const { TURN, say, duration, written, list, readRoots, readPolynomial, readNumber, python, address,
    fromAddress, exact } = armlockText;
  const { element, Sheet, Chart, drawNyquist, drawBode, drawNoise, drawTime, drawYear }
    = armlockDraw;
  const api = armlockLoop();
  Object.assign(api, armlockChart(api), armlockNoise(api));

  const hertz = values => values.map(f => [-TURN * f, 0]);
  const real = values => values.map(v => [v, 0]);
  const PAPER = {
    sensor: "dual", tau1: 20.1, tau2: 19.9, delay: 0, corner: TURN * 0.4,
    difference: 0.2, gain: 5000,
    zeros: [[0, 0], [0, 0], ...hertz([1e-8, 5e-6, 5e-6, 5e-6])],
    poles: hertz([1e-6, 1e-6, 1e-6, 5e-5, 4e-4, 5e-5]),
  };
  const ARM = { ...PAPER, zeros: [], poles: [[0, 0]], gain: 1 };
  // As the package has it, `flight_loop()`: the zeros of the sum of ten terms are computed there.
  const FLIGHT = { sensor: "modified", tau1: 33.855, tau2: 33.345, delay: 0, corner: TURN * 0.4,
    difference: 0.51, gain: 83425.53428423413,
    zeros: [...real([0, 0, 0, 0]), ...hertz(Array(5).fill(36.6e-6)), ...real([-909686.7705117954,
      -79277.49256135186, -9812.456529020996, -852.8835173889007, -86.46434550283912,
      -2.0732204903372633, -0.1640373233692247]),
      [-4.11185038643452, -2.2259179668023865], [-4.11185038643452, 2.2259179668023865]],
    poles: hertz([8e-7, 8e-7, 8e-7, 2.1e-4, ...Array(5).fill(1.85e-4), 3e-3, 0.238,
      0.03, 0.3, 3, 30, 300, 3e3, 3e4, 3e5]) };
  const PRESETS = {
    "The paper's controlled loop": [PAPER, 1, 3e-6],
    "Common arm": [{ ...ARM, sensor: "common" }, 0, 3],
    "Dual arm": [{ ...ARM, gain: 10 }, 1, 0.3],
    "Single arm": [{ ...ARM, sensor: "single" }, 0, 3],
    "Common arm with a lead filter and a dead time": [{ ...ARM, sensor: "common", delay: 0.1,
      zeros: [[-0.02, 0]], poles: [[0, 0], [-0.1, 0]] }, 0, 1.5],
    "The white paper's loop (modified dual)": [FLIGHT, 1, 2e-3],
  };
  const SENSORS = [["single", "single arm"], ["common", "common arm"],
    ["difference", "difference of the arms"], ["dual", "dual"], ["modified", "modified dual"],
    ["own", "one of your own"]];
  const WORDS = { [-1]: "on the boundary", [-3]: "not sure",
    [-2]: "not stable: the high-frequency chain of roots is not confined" };

  function counted(count) {
    return count === 0 ? "stable" : count > 0
      ? `${count} unstable root${count > 1 ? "s" : ""}` : WORDS[count];
  }

  /* ---------------------------------------------------------------------------- workers */

  /* Runs in a worker: `api` is what the engine's files give. */
  function tasks(api) {
    const look = {
      chart: (spec, x0, x1, y0, y1, n, samples) => ({ n, box: { x0, x1, y0, y1 },
        ...api.chart(api.make(spec), x0, x1, n, y0, y1, n, samples) }),
      point: (spec, c1, c2) => api.count(api.make(spec), c1, c2),
      // With ten times the steps, for who waits.
      count: (spec, c1, c2) => api.count(api.make(spec), c1, c2, { most: 4000000 }),
      root: (spec, c1, c2) => api.rightmost(spec, c1, c2),
      breaks: spec => [[1, -1], [-1, 1], [1, 1], [-1, -1]].map(
        ([x, y]) => api.firstBreak(api.make(spec), x, y)),
      margins: (spec, c1, c2) => api.margins(spec, c1, c2),
      // Of one day of a year: the least that breaks the loop, the arms perturbed against each other.
      day: spec => {
        const found = [1, -1].map(way => api.firstBreak(api.make(spec), way, -way));
        return found.includes(null) ? null : Math.min(...found);
      },
      time: (spec, c1, c2, trips) => api.inTime(spec, c1, c2, trips),
    };
    return ({ data: { kind, version, input } }) => {
      let result = null, error = null;
      try { result = look[kind.split(" ")[0]](...input); } catch (problem) { error = problem.message; }
      postMessage({ kind, version, result, error }, result?.counts ? [result.counts.buffer] : []);
    };
  }

  /* Asks a worker one thing at a time, the most urgent first; of each kind only the last. */
  class Desk {
    constructor(order) {
      const text = `const api = (${armlockLoop})();
        for (const more of [${armlockMargins}, ${armlockChart}, ${armlockTime}])
          Object.assign(api, more(api));
        onmessage = (${tasks})(api);`;
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

  /* ---------------------------------------------------------------------------- an explorer */

  // What the table has of a loop, in the order in which it is found, and what it says where it is not.
  const TOLD = ["count", "root", "breaks", "margins"];
  const UNTOLD = { count: -3, root: null, breaks: [NaN, NaN, NaN, NaN],
    margins: { lower: NaN, upper: NaN, phase: NaN, modulus: NaN } };
  const UNSTABLE = "none: not stable";
  const SOURCES = { laser: "laser", shot: "shot noise", clock: "clocks", motion: "spacecraft's motion",
    total: "all of it" };
  const HINT = "Point at the chart, touch it, or move with the arrow keys. Drag to move the "
    + "view; two fingers zoom.";
  let number = 0;

  /* Whether a loop is stable at its point, but for a hidden root at s = 0; undefined as long as that is
   * not known. */
  function stable({ told: { count, margins } }) {
    if (count > 0 || count === -2 || margins === null) return false;
    return count === 0 || margins ? true : undefined;
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

  /* What all pages have: a chart that answers, plots that follow it, and the loop's numbers. */
  class Live {
    constructor(label) {
      this.id = `live-${++number}`;
      // What answers the pointer waits for nothing else.
      this.near = new Desk(["point", "root"]);
      this.wide = new Desk(["chart"]);
      this.slow = new Desk(["time", ...TOLD, ...TOLD.map(kind => `${kind} of the pinned`), "day"]);
      this.out = element("output", { role: "status", "aria-live": "polite" });
      this.note = element("p", { class: "live-note", role: "status" });
      this.numbers = element("table", { class: "live-numbers" });
      // For who hears the page: said once all numbers are there.
      this.ready = element("p", { class: "visually-hidden", role: "status" });
      this.chart = new Chart(label, { changed: () => this.redraw(),
        pointed: point => this.tell(point) });
      this.figure = element("div", { class: "live-chart", "data-check": "hover" },
        this.chart.canvas, this.out, this.ready);
      this.lit = null;
      // The loop as it is, and the one that was pinned.
      this.design = this.pinned = null;
      // What a page does besides when loop or point are others.
      this.told = () => {};
      const pair = read => () => this.design && [this.design, this.pinned].map(one => one && read(one));
      this.plots = [
        ["Nyquist curve of L at the point, distances from 0 on a logarithmic scale; inset: around -1, "
          + "with the arc of the smallest phase at a crossover.", drawNyquist, pair(one => one.response)],
        ["Magnitude and phase of L at the point against frequency.", drawBode, pair(one => one.response)],
      ].map(plot => this.plot(...plot));
      this.following = element("p", { class: "live-note", role: "status" });
      this.forget();
    }

    get spec() { return this.design?.spec; }

    /* One more plot: the noise that is left. */
    budget(laser) {
      this.laser = laser;
      this.plots.push(this.plot("Noise left on the locked laser at the point, source by source, against "
        + "frequency.", drawNoise, () => {
        const found = [this.design, this.pinned].map(one => one && this.noise(one));
        return found[0] && found;
      }));
    }

    /* The noise of a design in the band; none once it is known not to be stable. */
    noise(design) {
      if (stable(design) === false) return null;
      if (design.laser !== this.laser)
        [design.laser, design.weighed] = [this.laser, api.noise(design.loop, this.laser)];
      return design.weighed.to(...this.shown);
    }

    /* A plot over frequencies, on which one can be pointed at. `read` gives what it draws. */
    plot(label, draw, read) {
      let place = null, shown = null;
      const sheet = new Sheet({ role: "application", tabindex: 0, "aria-label": `${label} Arrow keys `
        + "move along the frequencies." }, 0.85, (pen, wide, high, colours) => {
        shown = read();
        pen.textAlign = "center";
        if (this.design && !shown) pen.fillText("not stable at the point", wide / 2, high / 2);
        if (shown) place = draw(shown, this.lit && nearest(shown[0].omega, this.lit), pen, wide, high, colours);
      });
      for (const name of ["pointermove", "pointerdown"]) sheet.canvas.addEventListener(name, event => {
        if (!shown || !place) return;
        const box = sheet.canvas.getBoundingClientRect(), { omega } = shown[0];
        const x = event.clientX - box.left, y = event.clientY - box.top;
        let best = Infinity, found = null;
        for (let i = 0; i < omega.length; i++) {
          const [u, v] = place(i), gap = Math.abs(u - x) + (v === null ? 0 : Math.abs(v - y));
          if (gap < best) [best, found] = [gap, omega[i]];
        }
        this.light(found);
      });
      sheet.canvas.addEventListener("pointerleave", event => {
        // A finger that was lifted has left what it pointed at lit.
        if (event.pointerType !== "touch") this.light(null);
      });
      sheet.canvas.addEventListener("keydown", event => {
        const move = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
        if (!move || !shown) return;
        event.preventDefault();
        const { omega } = shown[0], from = this.lit ? nearest(omega, this.lit) : omega.length >> 1;
        this.light(omega[Math.min(omega.length - 1, Math.max(0, from + move * (event.shiftKey ? 20 : 1)))]);
      });
      return sheet;
    }

    /* Light one frequency in all plots, and where the D-curve has it. */
    light(omega) {
      if (omega === this.lit) return;
      this.lit = omega;
      this.chart.lit = null;
      this.following.textContent = "";
      if (omega) {
        const { loop, response } = this.design, [x, y] = api.crossing(loop, omega);
        if (Number.isFinite(x + y)) this.chart.lit = [x, y];
        const i = nearest(response.omega, omega), re = response.re[i], im = response.im[i];
        this.following.textContent = `${say(omega / TURN)} Hz: |L| = ${say(Math.hypot(re, im))}, `
          + `phase ${say(Math.atan2(im, re) * 180 / Math.PI)}\u00b0`;
      }
      this.chart.sheet.draw();
      for (const plot of this.plots) plot.draw();
      if (this.laser) this.list();
    }

    /* Nobody has pointed at a place yet. */
    forget() {
      this.chart.marked = null;
      this.shown = [1, 1];
    }

    /* What was asked of a loop is asked no more. */
    drop(one, kinds = TOLD) {
      this.slow.drop(...kinds.map(kind => this.named(one, kind)));
    }

    named(one, kind) { return one === this.pinned ? `${kind} of the pinned` : kind; }

    /* There is no loop: nothing of the one before stays. */
    none(why) {
      this.near.drop("point", "root");
      this.wide.drop("chart");
      this.counting = false;
      this.slow.drop("time");
      this.drop(this.design);
      clearTimeout(this.rest);
      this.design = this.lit = null;
      this.chart.clear();
      this.out.textContent = why;
      this.note.textContent = this.following.textContent = this.ready.textContent = "";
      this.numbers.replaceChildren();
      for (const plot of this.plots) plot.draw();
    }

    /* Take another loop. While a slider moves, `moving`, pictures are coarser and nothing is asked
     * that takes long. */
    set(spec, moving = false) {
      this.near.drop("point", "root");
      this.slow.drop("time");
      this.drop(this.design);
      this.design = { spec, loop: api.make(spec), told: {} };
      this.chart.broken = null;
      this.lit = this.chart.lit = null;
      this.design.responded = api.response(this.design.loop, ...this.most(), moving ? 2500 : 9000);
      this.follow(this.shown);
      this.list();
      this.redraw(moving);
      if (this.chart.marked) this.tell(this.chart.marked);
      else {
        this.out.textContent = HINT;
        this.wait();
      }
      this.told();
    }

    /* Parameters as large as the view has them: their response shows the most. */
    most() {
      const { x0, x1, y0, y1 } = this.chart.box;
      return [[x0, x1], [y0, y1]].map(pair => Math.max(...pair.map(Math.abs), 1));
    }

    /* The responses at a point, in this frame. */
    follow(point) {
      for (const one of [this.design, this.pinned]) if (one) one.response = one.responded.to(...point);
      for (const plot of this.plots) plot.draw();
    }

    redraw(moving = false) {
      if (!this.spec) return;
      this.chart.stale = true;
      this.chart.curve = this.dcurve(moving ? 3000 : 20000);
      this.chart.sheet.draw();
      // A chart that is being counted while a slider moves is waited for: dropped at each frame, none
      // would ever be drawn.
      if (!(moving && this.counting)) this.count(moving);
    }

    /* Ask for the chart: a coarse one, and unless a slider moves a finer one after it. */
    count(moving) {
      const { spec } = this, { x0, x1, y0, y1 } = this.chart.box, input = [spec, x0, x1, y0, y1];
      this.counting = true;
      this.wide.ask("chart", [...input, 100, 60000], (found, error) => {
        this.counting = false;
        this.note.textContent = error || "Refining \u2026";
        if (!error) this.chart.fill(found);
        if (spec !== this.spec) {
          // It stays faint, because the loop has moved on.
          this.chart.stale = true;
          this.count(true);
          return;
        }
        if (moving || error) return;
        this.wide.ask("chart", [...input, 400, 3000000], finer => {
          this.chart.fill(finer);
          const share = 1 - finer.sure;
          this.note.textContent = share === 0
            ? "Every pixel of the chart is certain, lines between areas to a pixel."
            : `${share > 0.999 ? "All" : `${say(100 * share, 2)} %`} of the chart is not sure, and striped; `
              + "the rest is certain, lines between areas to a pixel.";
        });
      });
    }

    dcurve(most) {
      const { x0, x1, y0, y1 } = this.chart.box, range = [Infinity, 0];
      const found = api.dcurve(this.design.loop, x0, x1, y0, y1, most);
      for (let i = 2; i < found.curve.length; i += 3) {
        if (found.curve[i] < range[0]) range[0] = found.curve[i];
        if (found.curve[i] > range[1]) range[1] = found.curve[i];
      }
      return { ...found, range };
    }

    tell(point) {
      if (!this.spec) return;
      const name = this.chart.name(point);
      this.near.drop("root");
      clearTimeout(this.asked);
      this.shown = point;
      // What is told of a point is not told of another; the critical perturbation stays.
      for (const one of [this.design, this.pinned]) if (one) {
        this.drop(one, TOLD.filter(kind => kind !== "breaks"));
        one.told = { breaks: one.told.breaks };
      }
      this.follow(point);
      this.out.textContent = `${name}: counting \u2026`;
      if (!this.empty) this.list();
      this.near.ask("point", [this.spec, ...point], (count, error) => {
        this.out.textContent = error || `${name}: ${counted(count)}`;
        if (count > -3) this.design.told.count = count;
        // What is left of the noise is drawn of stable loops only.
        if (this.laser && count) this.plots.at(-1).draw();
        if (!error && count >= 0) this.asked = setTimeout(() => this.root(point, this.out.textContent), 60);
      });
      this.wait();
      this.told();
    }

    root(point, before) {
      this.near.ask("root", [this.spec, ...point], root => {
        if (!root || this.out.textContent !== before) return;
        const im = root[1] ? ` \u00b1 ${say(Math.abs(root[1]))}j` : "";
        const rate = root[0] < 0 ? "decays" : "grows";
        this.out.textContent = `${before}; rightmost root ${say(root[0])}${im} rad/s: ${rate} by e in `
          + `${duration(1 / Math.abs(root[0]))}`;
      });
    }

    /* Ask for what takes longer once pointer and sliders rest. */
    wait() {
      clearTimeout(this.rest);
      this.rest = setTimeout(() => this.settle(this.shown), 250);
    }

    settle(point) {
      this.list();
      for (const one of [this.design, this.pinned]) for (const kind of one ? TOLD : []) {
        if (one.told[kind] !== undefined || kind === "breaks" && one.breaking) continue;
        one.breaking ||= kind === "breaks";
        const input = kind === "breaks" ? [one.spec] : [one.spec, ...point];
        this.slow.ask(this.named(one, kind), input, (found, error) => {
          one.told[kind] = error ? UNTOLD[kind] : found;
          if (kind === "breaks" && one === this.design) this.chart.broken = one.told.breaks[0];
          if (kind === "count" && one === this.design && this.out.textContent.endsWith(WORDS[-3]))
            this.out.textContent = `${this.chart.name(point)}: ${counted(one.told.count)}`;
          for (const plot of this.plots) plot.draw();
          this.chart.sheet.draw();
          this.list();
        });
      }
    }

    /* The numbers of the loop, and of the pinned one beside it. */
    list() {
      if (!this.numbers.isConnected) return;
      this.empty = !this.design || this.design.told.count === undefined;
      const designs = [this.design, this.pinned].filter(one => one), wait = "\u2026";
      const where = this.chart.marked ? this.chart.name(this.shown) : "(1, 1)";
      const or = (value, special, words) => Number.isNaN(value) ? "not sure"
        : value === special ? words : say(value);
      const broken = value => value === null ? "not stable at (1, 1)"
        : value === 0 ? "0: the least breaks it" : or(value, Infinity, "none up to 2");
      const of = (kind, read) => designs.map(({ told }) => told[kind] === undefined ? wait : read(told[kind]));
      const margin = read => of("margins", found => found ? read(found) : UNSTABLE);
      const degrees = value => `${say(value * 180 / Math.PI)}\u00b0`;
      const parts = [
        ["Critical perturbation from (1, 1)", ["along (1, \u22121)", of("breaks", b => broken(b[0]))],
          ["along (\u22121, 1)", of("breaks", b => broken(b[1]))],
          ["along (1, 1)", of("breaks", b => broken(b[2]))],
          ["along (\u22121, \u22121)", of("breaks", b => broken(b[3]))]],
        [`At ${where}`, ["Unstable roots", of("count", n => n >= 0 ? String(n) : WORDS[n])],
          ["Rightmost root: real part in rad/s", designs.map(({ told: { count, root } }) =>
            count < 0 ? "none" : root === undefined ? wait : root ? say(root[0]) : "not sure")],
          ["Smallest gain factor that keeps it stable", margin(m => or(m.lower, 0, `none above 1/${m.most}`))],
          ["Largest gain factor", margin(m => or(m.upper, Infinity, `none up to ${m.most}`))],
          ["Phase margin", margin(({ phase }) => phase < Infinity ? degrees(phase)
            : Number.isNaN(phase) ? "not sure" : "no crossover")],
          ["Smallest |1 + L|", margin(m => or(m.modulus))]],
      ];
      if (this.laser) {
        const omega = this.lit || TURN * 3e-3;
        const left = designs.map(({ loop }) => api.noise(loop, this.laser, [omega]).to(...this.shown));
        const level = name => designs.map((one, k) => ({ true: say(left[k][name][0]), false: UNSTABLE,
          undefined: wait })[stable(one)]);
        parts.push([`Noise left at ${say(omega / TURN)} Hz, in Hz/\u221aHz`,
          ...[...api.SOURCES, "total"].map(name => [SOURCES[name], level(name)]),
          ["what TDI takes out", designs.map(() => say(300 * (1 + (TURN * 3e-3 / omega) ** 2)))]]);
      }
      const cell = (tag, attributes, text) => element(tag, attributes, text);
      this.numbers.replaceChildren(element("thead", {}, element("tr", {},
        ...["Number", "This loop", "Pinned"].slice(0, 1 + designs.length)
          .map(text => cell("th", { scope: "col" }, text)))),
      ...parts.map(([title, ...rows]) => element("tbody", {},
        element("tr", {}, cell("th", { scope: "rowgroup", colspan: 1 + designs.length }, title)),
        ...rows.map(([name, values]) => element("tr", {}, cell("th", { scope: "row" }, name),
          ...values.map(value => cell("td", {}, value)))))));
      const done = designs.length && designs.every(({ told }) => TOLD.every(kind => told[kind] !== undefined));
      this.ready.textContent = done ? `The table has all numbers at ${where}: ${parts[1].slice(1)
        .map(([name, [value]]) => `${name}: ${value}`).join("; ")}.` : "";
    }

    /* Pin the design as it is: what follows is seen against it, in all plots and numbers. */
    pin() {
      if (this.pinned) this.drop(this.pinned);
      this.pinned = this.pinned || !this.design ? null : { ...this.design, told: { ...this.design.told },
        breaking: Boolean(this.design.told.breaks), responded: api.response(this.design.loop, ...this.most()) };
      this.chart.ghost = this.pinned && this.chart.curve;
      this.follow(this.shown);
      this.list();
      this.wait();
      return Boolean(this.pinned);
    }
  }

  /* ---------------------------------------------------------------------------- controls */

  const button = (text, done) => element("button", { type: "button", onclick: done }, text);

  /* A slider. `moved(value, moving)` hears every move, and the last one with moving = false. */
  function slider(id, name, low, high, value, write, moved) {
    const shown = element("output", { id: `${id}-value` }, write(value));
    const input = element("input", { type: "range", id, min: low, max: high, step: (high - low) / 200,
      "aria-controls": `${id}-value`, oninput: () => {
        shown.textContent = write(Number(input.value));
        moved(Number(input.value), true);
      }, onchange: () => moved(Number(input.value), false) });
    input.value = value;
    const label = element("label", { class: "live-field" }, element("span", {}, name, " ", shown), input);
    label.to = at => {
      if (at > Number(input.max)) [input.max, input.step] = [at, at / 200];
      input.value = at;
      shown.textContent = write(at);
    };
    return label;
  }

  function choice(id, name, options, changed) {
    const select = element("select", { id, onchange: () => changed(select.value) },
      ...options.map(([value, text]) => element("option", { value }, text)));
    return element("label", { class: "live-field" }, element("span", {}, name), select);
  }

  function save(name, blob) {
    const link = element("a", { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  /* Zoom, download, and the ghost, of any explorer. */
  function tools(live, file) {
    const counts = () => {
      if (!live.chart.grid) return;
      const { counts, n, x0, x1, y0, y1 } = live.chart.grid;
      const at = (low, high, i) => low + (high - low) * i / (n - 1);
      const rows = Array.from(counts, (count, k) =>
        `${at(x0, x1, k % n)},${at(y0, y1, Math.floor(k / n))},${count}\n`);
      save(`${file}.csv`, new Blob(["c1 [1],c2 [1],unstable roots [1]\n", ...rows]));
    };
    const pin = element("button", { type: "button", "aria-pressed": "false", onclick: () => {
      pin.setAttribute("aria-pressed", String(live.pin()));
    } }, "Pin this loop");
    return element("p", { class: "live-buttons" },
      button("Zoom in", () => live.chart.zoom(0.5)), button("Zoom out", () => live.chart.zoom(2)),
      pin, button("Download CSV", counts),
      button("Download PNG", () => live.chart.canvas.toBlob(blob => save(`${file}.png`, blob))));
  }

  function legend(half) {
    const colour = (text, name) =>
      element("span", { class: "live-key" }, element("i", { class: name }), text);
    const found = element("p", { class: "live-note" }, colour("stable", "live-stable"),
      colour("unstable, stronger with more roots", "live-unstable"),
      colour("unstable at arbitrarily high frequency", "live-lost"),
      colour("not sure", "live-unsure"), "curve: a root on the imaginary axis, from low frequency (blue) to high "
      + "(yellow); + the ideal point (1, 1)");
    if (half < 1e-4)
      found.append("; square: the paper\u2019s perturbations; dot: first to break along (1, \u22121)");
    return found;
  }

  const plots = live => element("div", { class: "live-plots" },
    ...live.plots.map(plot => plot.canvas));

  /* The loop in time at the point, played so that a person can follow. */
  function inTime(live) {
    const TRIPS = 12, still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    let run = null, playing = 0;
    const words = element("p", { class: "live-note", role: "status" });
    const sheet = new Sheet({ role: "img", "aria-label": "The laser's frequency in time, from rest." },
      0.4, (pen, wide, high, colours) => { if (run) drawTime(run, pen, wide, high, colours); });
    sheet.canvas.hidden = true;
    const play = () => {
      if (!live.spec) return;
      const [c1, c2] = live.shown, name = live.chart.marked ? live.chart.name(live.shown) : "(1, 1)";
      words.textContent = "Stepping \u2026";
      live.slow.ask("time", [live.spec, c1, c2, TRIPS], (found, error) => {
        cancelAnimationFrame(playing);
        if (error || !found.values.length) {
          words.textContent = error || "The first step already is too large to show.";
          return;
        }
        run = { ...found, shown: still ? Infinity : 2 };
        sheet.canvas.hidden = false;
        const { step, trip, missed, values } = found, last = Math.abs(values[values.length - 1]);
        words.textContent = `At ${name}: a step of the laser by 1 at t = 0, silence for ${say(trip)} s, then `
          + `what the arms send back. After ${TRIPS} round trips it is off by ${say(last)}. Steps of `
          + `${say(1000 * step)} ms${missed > 1e-6 ? "; delays between two steps are interpolated" : ""}`
          + `${found.fast ? "; the loop reacts faster than these steps, so that fast ringing is not to be "
            + "trusted" : ""}.`;
        const begun = performance.now(), whole = values.length;
        const frame = now => {
          // A round trip a second.
          run.shown = 2 + (now - begun) / 1000 * trip / step;
          sheet.draw();
          if (run.shown < whole) playing = requestAnimationFrame(frame);
        };
        if (still) sheet.draw(); else playing = requestAnimationFrame(frame);
      });
    };
    return element("div", { class: "live-time" },
      element("p", { class: "live-buttons" }, button("Watch it lock, or not", play)), sheet.canvas, words);
  }

  /* ---------------------------------------------------------------------------- pages */

  /* The controlled loop of the paper, with what it leaves open as switches. */
  function front(place) {
    const live = new Live("Stability of the paper's controlled loop near (1, 1).");
    const state = { half: false, actuator: false, printed: false, corner: 0.4, delay: 0 };
    const update = moving => {
      const poles = [...PAPER.poles], zeros = [...PAPER.zeros];
      if (state.printed) { zeros.pop(); poles.pop(); }
      if (state.actuator) poles.push([0, 0]);
      live.set({ ...PAPER, zeros, poles, corner: TURN * state.corner, delay: state.delay,
        difference: (state.half ? 0.5 : 1) * PAPER.difference }, moving);
    };
    const flag = (key, name, off, on) => choice(`${live.id}-${key}`, name, [["", off], ["1", on]],
      value => { state[key] = Boolean(value); update(); });
    const form = element("form", { class: "live-form", onsubmit: event => event.preventDefault() },
      flag("half", "Delay difference of the sensor", "\u03c4\u2081 \u2212 \u03c4\u2082", "half of it"),
      flag("actuator", "Actuator 1/s", "left out", "in the loop"),
      flag("printed", "Last pole of the controller", "p24 (Table II)", "z24 (as Eq. 11 prints it)"),
      slider(`${live.id}-corner`, "Corner p of the sensor:", -2, 1, Math.log10(0.4),
        v => `${say(10 ** v)} Hz`, (v, moving) => { state.corner = 10 ** v; update(moving); }),
      slider(`${live.id}-delay`, "Dead time:", 0, 10, 0, v => `${say(v)} ms`,
        (v, moving) => { state.delay = 1e-3 * v; update(moving); }));
    place.replaceChildren(form, element("div", { class: "live-pair" },
      element("div", {}, live.figure, legend(3e-6)),
      element("div", {}, live.numbers, live.note)));
    live.chart.show([1, 1], 3e-6);
    update();
  }

  /* The chart of a chapter: one of the presets in the window that the page asks for. */
  function chapter(place) {
    const { live: name, centre, half } = place.dataset;
    const live = new Live(`${name}: number of unstable roots over c1 and c2.`);
    place.replaceChildren(element("div", { class: "live-one" }, live.figure, legend(half),
      tools(live, name.toLowerCase().replace(/\W+/g, "-")), live.note), plots(live), live.following);
    live.chart.show([Number(centre), Number(centre)], Number(half));
    live.set(PRESETS[name][0]);
  }

  /* Your own loop. */
  function own(place) {
    const live = new Live("Number of unstable roots over c1 and c2.");
    const id = name => `${live.id}-${name}`;
    const fields = {}, errors = {};
    const code = element("pre", { class: "live-code", "aria-label": "Python" });
    let unit = 1, base = 1, chosen = null;

    const settle = live.settle.bind(live);
    live.settle = point => {
      settle(point);
      remember();
    };
    live.told = () => { code.textContent = python(live.spec, live.shown); };
    const remember = () => {
      if (live.spec) history.replaceState(null, "", address(live.spec, live.chart, unit));
    };
    const redraw = live.redraw.bind(live);
    live.redraw = moving => { redraw(moving); if (!moving) remember(); };

    /* An error stands at its field. */
    const blame = (name, message) => {
      const field = fields[name];
      if (!field) return;
      if (message) field.setAttribute("aria-invalid", "true"); else field.removeAttribute("aria-invalid");
      errors[name].textContent = message || "";
    };
    const NAMES = { tau1: "\u03c4\u2081", tau2: "\u03c4\u2082", delay: "The dead time", gain: "The gain",
      corner: "The corner", difference: "\u0394\u03c4" };
    const scaled = { corner: () => unit, zeros: () => unit, poles: () => unit };

    /* The loop that the fields hold; throws an error that names its field. */
    const held = () => {
      const spec = { sensor: fields.sensor.value };
      for (const name of ["tau1", "tau2", "delay"])
        spec[name] = readNumber(name, fields[name].value, NAMES[name]);
      const two = ["dual", "modified"].includes(spec.sensor);
      for (const name of ["corner", "difference"]) {
        const text = fields[name].value;
        if (two) spec[name] = readNumber(name, text, NAMES[name]) * (scaled[name]?.() ?? 1);
      }
      if (spec.sensor === "own") for (const name of ["m1", "m2", "below"])
        spec[name] = readPolynomial(name, fields[name].value, "It");
      if (fields.form.value === "roots") {
        spec.gain = readNumber("gain", fields.gain.value, NAMES.gain);
        for (const [name, title] of [["zeros", "Zeros"], ["poles", "Poles"]])
          spec[name] = readRoots(name, fields[name].value, title).map(v => v.map(x => x * unit));
      } else {
        const [above, below] = ["above", "under"].map(name => readPolynomial(name, fields[name].value, "It"));
        const lead = [above, below].map(p => p.find(v => v !== 0));
        if (!lead[0]) throw Object.assign(new RangeError("It must not be zero."), { field: "above" });
        if (!lead[1]) throw Object.assign(new RangeError("It must not be zero."), { field: "under" });
        [spec.gain, spec.zeros, spec.poles] = [lead[0] / lead[1], api.rootsOf(above), api.rootsOf(below)];
      }
      api.make(spec);
      return spec;
    };

    const take = (moving = false, dragged = false) => {
      for (const name of Object.keys(errors)) blame(name, "");
      try {
        const spec = held();
        wrong.textContent = "";
        follow(spec, dragged);
        live.set(spec, moving);
      } catch (error) {
        const name = fields[error.field] ? error.field
          : { zeros: "above", poles: "under" }[error.field] || "sensor";
        blame(name, error.message);
        wrong.textContent = error.message;
        live.none("There is no loop to show: a field above holds none.");
      }
    };
    /* Sliders and "Start from" follow what is there. */
    const follow = (spec, dragged) => {
      if (!dragged) {
        base = spec.gain;
        gain.to(0);
        dead.to(spec.delay);
      }
      const changed = chosen !== null && !same(spec, PRESETS[chosen][0]);
      state.textContent = chosen === null ? "from a link" : changed ? "changed" : "";
      reset.hidden = !changed;
    };
    const same = (a, b) => {
      const plain = spec => JSON.stringify([spec.sensor, spec.tau1, spec.tau2, spec.delay, spec.gain,
        written(spec.zeros), written(spec.poles), ...["dual", "modified"].includes(spec.sensor)
          ? [spec.corner, spec.difference] : []]);
      return plain(a) === plain(b);
    };

    const put = spec => {
      fields.form.value = "roots";
      for (const name of ["sensor", "tau1", "tau2", "delay", "gain", "difference"])
        if (spec[name] !== undefined) fields[name].value = String(spec[name]);
      if (spec.corner !== undefined) fields.corner.value = String(spec.corner / unit);
      for (const name of ["zeros", "poles"])
        fields[name].value = written(spec[name].map(v => v.map(x => x / unit)));
      for (const name of ["m1", "m2", "below"]) if (spec[name]) fields[name].value = list(spec[name]);
      shape();
    };
    const shape = () => {
      const sensor = fields.sensor.value, roots = fields.form.value === "roots";
      const shown = { corner: ["dual", "modified"].includes(sensor), m1: sensor === "own",
        zeros: roots, above: !roots };
      Object.assign(shown, { difference: shown.corner, m2: shown.m1, below: shown.m1, poles: roots,
        gain: roots, under: !roots });
      for (const [name, on] of Object.entries(shown)) fields[name].closest(".live-field").hidden = !on;
      gain.hidden = !roots;
    };
    const field = (name, label, { area = false, value = "", wide = area } = {}) => {
      fields[name] = element(area ? "textarea" : "input", { id: id(name), spellcheck: "false",
        autocomplete: "off", autocapitalize: "off", rows: area ? 2 : null,
        "aria-describedby": id(`${name}-wrong`), onchange: () => take() });
      fields[name].value = value;
      errors[name] = element("span", { id: id(`${name}-wrong`), class: "live-wrong" });
      return element("div", { class: `live-field${wide ? " live-wide" : ""}` },
        element("label", { for: id(name) }, label), fields[name], errors[name]);
    };
    const start = name => {
      const [spec, centre, half] = PRESETS[chosen = name];
      put(spec);
      live.none("");
      live.forget();
      live.chart.show([centre, centre], half);
      take();
    };

    const state = element("span", { class: "live-state", role: "status" });
    const reset = button("Reset", () => start(chosen));
    reset.hidden = true;
    const preset = choice(id("preset"), "Start from", Object.keys(PRESETS).map(name => [name, name]), start);
    const starts = element("div", { class: "live-start" }, preset, state, reset);
    const select = (name, title, options, changed) => {
      const made = choice(id(name), title, options, changed);
      fields[name] = made.querySelector("select");
      errors[name] = element("span", { id: id(`${name}-wrong`), class: "live-wrong" });
      fields[name].setAttribute("aria-describedby", id(`${name}-wrong`));
      made.append(errors[name]);
      return made;
    };
    const units = choice(id("unit"), "Unit of zeros, poles and corner", [["1", "rad/s"], ["hz", "Hz"]],
      value => {
        // The loop stays what it is; the fields say it in the other unit.
        const spec = live.spec;
        unit = value === "hz" ? TURN : 1;
        if (spec && fields.form.value === "roots") put(spec);
        take();
      });
    const gain = slider(id("factor"), "Drag the gain: times", -2, 2, 0, v => say(10 ** v), (v, moving) => {
      fields.gain.value = exact(+(base * 10 ** v).toPrecision(6));
      take(moving, true);
    });
    const dead = slider(id("dead"), "Drag the dead time:", 0, 1, 0, v => `${say(v)} s`, (v, moving) => {
      fields.delay.value = String(v);
      take(moving, true);
    });
    const wrong = element("p", { class: "live-note live-wrong", role: "alert" });
    const form = element("form", { class: "live-form", onsubmit: event => event.preventDefault() },
      gain, dead,
      select("sensor", "Sensor", SENSORS, () => { shape(); take(); }),
      field("tau1", "Delay \u03c4\u2081 in s"), field("tau2", "Delay \u03c4\u2082 in s"),
      field("delay", "Dead time in s"), field("corner", "Sensor\u2019s corner"),
      field("difference", "Sensor\u2019s \u0394\u03c4 in s"),
      field("m1", "Weight m1: numerator", { value: "1", wide: true }),
      field("m2", "Weight m2: numerator", { value: "1", wide: true }),
      field("below", "Their denominator", { value: "1", wide: true }),
      select("form", "Controller given by", [["roots", "zeros and poles"],
        ["fraction", "numerator and denominator"]], () => { shape(); take(); }),
      field("gain", "Gain"), units,
      field("zeros", "Zeros", { area: true }), field("poles", "Poles", { area: true }),
      field("above", "Numerator, highest power first, or in s", { area: true, value: "1" }),
      field("under", "Denominator", { area: true, value: "s" }));
    const laser = choice(id("laser"), "Laser before it is locked", Object.keys(api.LASERS).map(name =>
      [name, name]), value => {
      live.laser = value;
      for (const plot of live.plots) plot.draw();
      live.list();
    });
    live.budget("free-running");
    const view = tools(live, "loop");
    view.append(button("Paper\u2019s square", () => live.chart.show([1, 1], 3e-6)),
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
    place.replaceChildren(element("div", { class: "live-own" },
      element("div", { class: "live-main" }, live.figure, view, legend(1), live.note),
      element("div", { class: "live-side" }, starts, wrong, form)),
      live.numbers, laser, plots(live), live.following, inTime(live), element("p", { class: "live-buttons" }, copied), code);

    const open = () => {
      try {
        const given = fromAddress(location.hash);
        if (!given) return false;
        chosen = null;
        unit = given.unit;
        units.querySelector("select").value = unit === 1 ? "1" : "hz";
        put(given.spec);
        live.none("");
        live.forget();
        if (given.marked) live.chart.marked = live.shown = given.marked;
        live.chart.show(given.centre, given.half);
        take();
        return true;
      } catch (error) {
        wrong.textContent = `This address holds no loop: ${error.message}`;
        return false;
      }
    };
    window.addEventListener("hashchange", open);
    if (!open()) start(Object.keys(PRESETS)[0]);
  }

  /* A year in orbit: the arms, what the sensor holds, and where the loop stands each day. */
  const ARMS = { 1: [0, 2], 2: [1, 0], 3: [2, 1] }, STEP = 5, YEAR = 365, MONTH = 365.25 / 12;
  const HOLDS = ["largest, all year", "largest, right sign", "a month's start",
    "a month's middle"];

  /* Both round trips in s, as [t => tau1, t => tau2] with t in days: cubics through four entries. */
  function arms(orbit, master) {
    return ARMS[master].map(arm => t => {
      const v = armlockOrbits[orbit][arm], k = Math.min(v.length - 4, Math.max(0, Math.floor(t / STEP)));
      const x = t / STEP - k, [a, b, c, d] = v.slice(k, k + 4);
      return 16.5 + 1e-6 * (b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 4 * c - d
        + x * (3 * (b - c) + d - a))));
    });
  }

  function held(half, hold, t) {
    if (hold === HOLDS[2]) return half(MONTH * Math.floor(t / MONTH));
    if (hold === HOLDS[3]) return half(Math.min(YEAR, MONTH * (Math.floor(t / MONTH) + 0.5)));
    let largest = 0;
    for (let day = 0; day <= YEAR; day++) if (Math.abs(half(day)) > Math.abs(largest)) largest = half(day);
    return hold === HOLDS[0] || half(t) < 0 === largest < 0 ? largest : -largest;
  }

  function year(place) {
    const LOOPS = { "the white paper's": [FLIGHT, 6e-3], "the paper's": [PAPER, 1.5e-6] };
    const live = new Live("Number of unstable roots over c1 and c2 on this day.");
    const state = { loop: Object.keys(LOOPS)[0], orbit: Object.keys(armlockOrbits)[0], master: "1",
      hold: HOLDS[0], day: 20 };
    // Of each day that was counted: where the loop breaks, null where it is not stable.
    let days = [], trips = null, half = null, values = [];
    const words = element("p", { class: "live-note", role: "status" });
    const spec = day => {
      const [tau1, tau2] = trips.map(trip => trip(day));
      return { ...LOOPS[state.loop][0], tau1, tau2, difference: 2 * held(half, state.hold, day) };
    };
    const sheet = new Sheet({ role: "img", "aria-label": "The year: true and held half difference, days on "
      + "which the loop is not stable, and the least perturbation against each other that breaks it." }, innerWidth < 600 ? 1.2 : 0.55,
    (pen, ...rest) => drawYear({ values, days, day: state.day }, pen, ...rest));
    for (const name of ["pointerdown", "pointermove"]) sheet.canvas.addEventListener(name, event => {
      const box = sheet.canvas.getBoundingClientRect(), at = (event.clientX - box.left - 56) / (box.width - 64);
      if (event.buttons && at >= 0 && at <= 1) { today.to(Math.round(at * YEAR)); move(Math.round(at * YEAR), true); }
    });
    sheet.canvas.addEventListener("pointerup", () => move(state.day, false));

    /* Every sixteenth day first, then those between. */
    const count = () => {
      days = Array(YEAR + 1);
      const order = [16, 8, 4, 2, 1].flatMap((step, k) => Array.from({ length: Math.ceil((YEAR + 1) / step) },
        (_, i) => i * step).filter(day => !k || day % (2 * step)));
      const next = () => {
        const day = order.shift();
        if (day === undefined) { summary(); return; }
        live.slow.ask("day", [spec(day)], (found, error) => {
          // A sensor that would divide by zero is no loop, and so not a stable one.
          days[day] = error ? null : found;
          sheet.draw();
          next();
        });
      };
      live.slow.drop("day");
      next();
    };
    const summary = () => {
      const parts = [];
      for (let day = 0; day <= YEAR; day++) if (days[day] === null) {
        const from = day;
        while (days[day + 1] === null) day++;
        parts.push(from === day ? `${day}` : `${from} to ${day}`);
      }
      lost.textContent = parts.length ? `Not stable on days ${parts.join(", ")}.`
        : "Stable on every day of the year.";
      lost.textContent += " Counted once a day: what is shorter is not seen. No dot: not sure, or none up to 2.";
    };
    const lost = element("p", { class: "live-note", role: "status" });
    const move = (day, moving) => {
      state.day = day;
      const now = spec(day), ms = v => `${say(1e3 * v)} ms`;
      if (now.difference) live.set(now, moving);
      else live.none("The sensor would divide by zero: there is no loop on this day.");
      words.textContent = `Day ${Math.round(day)}: round trips ${now.tau1.toFixed(4)} s and ${now.tau2.toFixed(4)} s; `
        + `half difference ${ms(half(day))}, held ${ms(now.difference / 2)}.`;
      sheet.draw();
    };
    const update = () => {
      trips = arms(state.orbit, state.master);
      half = t => 0.5 * (trips[0](t) - trips[1](t));
      values = Array.from({ length: YEAR + 1 }, (_, day) => [half(day), held(half, state.hold, day)]);
      lost.textContent = "Counting the days \u2026";
      live.chart.show([1, 1], LOOPS[state.loop][1]);
      move(state.day, false);
      count();
    };
    const pick = (key, name, options) => {
      const label = choice(`${live.id}-${key}`, name, options.map(text => [text, text]), value => {
        state[key] = value;
        update();
      });
      label.querySelector("select").value = state[key];
      return label;
    };
    const today = slider(`${live.id}-day`, "Day", 0, YEAR, state.day, v => String(Math.round(v)),
      (v, moving) => { stop(); move(v, moving); });
    today.querySelector("input").step = 1;
    // Who wants no motion goes on by a week at a time.
    let playing = 0;
    const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
    const stop = () => {
      cancelAnimationFrame(playing);
      if (playing) move(state.day, false);
      playing = 0;
      play.textContent = still() ? "A week on" : "Play the year";
    };
    const play = button("", () => {
      if (playing) { stop(); return; }
      const from = state.day >= YEAR ? 0 : state.day, begun = performance.now();
      if (still()) {
        const day = Math.min(YEAR, from + 7);
        today.to(day);
        move(day, false);
        return;
      }
      play.textContent = "Pause";
      const frame = now => {
        const day = Math.min(YEAR, from + 15 * (now - begun) / 1000);
        today.to(day);
        move(day, true);
        if (day < YEAR) playing = requestAnimationFrame(frame); else stop();
      };
      playing = requestAnimationFrame(frame);
    });
    stop();
    const form = element("form", { class: "live-form", onsubmit: event => event.preventDefault() },
      pick("loop", "Loop", Object.keys(LOOPS)), pick("orbit", "Orbit", Object.keys(armlockOrbits)),
      pick("master", "Master", Object.keys(ARMS)), pick("hold", "The sensor holds", HOLDS));
    place.replaceChildren(form, element("div", { class: "live-day" }, today, play),
      sheet.canvas, words, lost, element("div", { class: "live-pair" },
        element("div", {}, live.figure, legend(1), live.note), element("div", {}, live.numbers)));
    update();
  }

  for (const place of document.querySelectorAll("[data-live]"))
    ({ front, loop: own, year }[place.dataset.live] || chapter)(place);
}
