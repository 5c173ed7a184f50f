"use strict";
/*
 * The live pages: a form, a chart of the stable region that answers the pointer, plots that follow.
 *
 * A page loads this file. It loads those beside it, each with one job: loop.js counts, margins.js
 * and chart.js certify, read.js reads, text.js writes, draw.js and plane.js draw, export.js writes
 * pictures, desk.js has the workers, and table.js the numbers.
 */
(function () {
  const here = document.currentScript.src;
  const files = ["loop.js", "margins.js", "chart.js", "curves.js", "read.js", "text.js", "draw.js", "plane.js", "export.js", "desk.js", "table.js",
    ...document.querySelector("[data-live=year]") ? ["orbits.js"] : []];
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
  const { TURN, say, duration, time, shortest, exact, written, formula, described, python, address, fromAddress } = armlockText;
  const { readRoots, readController, readNumber } = armlockRead;
  const { element, nearest, Sheet, Chart, drawNyquist, drawBode, drawYear } = armlockDraw;
  const { drawRoots } = armlockPlane, { snapshot } = armlockExport;
  const { Desk } = armlockDesk, { LOST, TOLD, WAYS, UNTOLD, UNBROKEN, weakestOf, weakestText, counted, rootText, partsOf, complete, fill, fillPanel, copied } = armlockTable;
  const api = armlockLoop();
  Object.assign(api, armlockChart(api), armlockCurves(api));

  const hertz = values => values.map(f => [-TURN * f, 0]);
  const real = values => values.map(v => [v, 0]);
  const PAPER = {
    sensor: "dual", tau1: 20.1, tau2: 19.9, delay: 0, corner: TURN * 0.4,
    difference: 0.2, gain: 5000,
    zeros: [[0, 0], [0, 0], ...hertz([1e-8, 5e-6, 5e-6, 5e-6])],
    poles: hertz([1e-6, 1e-6, 1e-6, 5e-5, 4e-4, 5e-5]),
  };
  const ARM = { ...PAPER, zeros: [], poles: [[0, 0]], gain: 1 };
  // As the package has them, `robust_loop()` and `buildable_loop()`.
  const ROBUST = { ...PAPER, zeros: real([0, 0, -2.3247785636564467e-6, ...Array(3).fill(-0.00010524335389525808)]),
    poles: real([-1.5707963267948965e-6, -6.785840131753953e-7, ...Array(4).fill(-0.0007206813547334985)]) };
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
    "Common arm with lead filter": [{ ...ARM, sensor: "common", delay: 0.1,
      zeros: [[-0.02, 0]], poles: [[0, 0], [-0.1, 0]] }, 0, 1.5],
    "The white paper's loop": [FLIGHT, 1, 2e-3],
    "The robust loop": [ROBUST, 1, 6e-6],
    "The buildable loop": [{ ...ROBUST, delay: 12.3e-6, gain: 40508.89142555669,
      zeros: [...ROBUST.zeros, ...real([-0.6974335690969341, -29.34247538452867, -185.3539665617978, -1168.672467135403,
        -7954.512598889356, -97075.21299592461])],
      poles: [...ROBUST.poles, ...real([-0.03707079331235956, -5.15221195188726, -55.98318108697011, -343.0619177720054,
        -2148.8493750554185, -13998.936864396119, -251327.41228718346])] }, 1, 9e-6],
  };
  const SENSORS = [["single", "single arm"], ["common", "common arm"],
    ["difference", "difference of the arms"], ["dual", "dual"], ["modified", "modified dual"]];
  const { UNCONFINED, UNDECIDED } = api;

  /* How much of a chart is undecided, and why. */
  function undecided({ sure, top, end }) {
    const share = 1 - sure, hertz = omega => `${say(omega / TURN)} Hz`;
    return `${share > 0.999 ? "All" : `${say(100 * share, 2)} %`} of the chart is undecided (striped)${end < top
      ? `: there roots may cross the imaginary axis at frequencies up to ${hertz(top)}, and ${end ? `the axis was followed up to ${hertz(end)}`
        : "these are too many to follow"}. A lower gain needs fewer.` : "."}`;
  }

  /* ---------------------------------------------------------------------------- an explorer */

  // The critical perturbations, one job for each direction.
  const BREAKS = WAYS.map((_, k) => `break ${k}`);
  let number = 0;

  /* What all pages have: a chart that answers, plots that follow it, and the loop's numbers. */
  class Live {
    constructor(label) {
      this.id = `live-${++number}`;
      // What answers the pointer waits for nothing else.
      this.near = new Desk(["point"]);
      this.wide = new Desk(["chart", "day"]);
      this.slow = new Desk([...TOLD, ...BREAKS, "day"]);
      // The numbers of a pinned loop; its worker begins with the first one.
      this.beside = null;
      this.out = element("output", { role: "status", "aria-live": "polite" });
      this.note = element("p", { class: "live-note", role: "status" });
      this.numbers = element("table", { class: "live-numbers" });
      // The numbers that stay in sight beside the sliders.
      this.summary = element("div", { class: "live-summary" });
      // For who hears the page: said once all numbers are there.
      this.ready = element("p", { class: "visually-hidden", role: "status" });
      this.chart = new Chart(label, {
        changed: () => { this.redraw(); this.moved(null); },
        pointed: held => { this.tell(true); if (held) this.moved("point"); },
      });
      this.figure = element("figure", { class: "live-chart", "data-check": "hover" },
        element("figcaption", {}, "Number of unstable roots over c1 and c2"), this.chart.canvas, this.out, this.ready);
      // A bound on |S| in dB, to design against.
      this.lit = this.bound = null;
      // The loop as it is, and what was pinned, which stays as it was.
      this.design = this.pinned = null;
      // What a page does besides where the view, the held "point", the "pin" or the "loop" is another.
      this.moved = () => {};
      // What it does where a loop is pinned, or none, and where a number is there.
      this.compared = this.heard = () => {};
      this.plots = [
        this.plot("Nyquist curve of L, compressed beyond 1", drawNyquist, wide => wide),
        this.plot("Bode\u2019s plot of L, and the sensitivity S = 1/(1 + L)", drawBode, wide => 0.9 * wide),
      ];
      this.following = element("p", { class: "live-note", role: "status" });
    }

    get spec() { return this.design?.spec; }
    /* The point that all plots and numbers are of. */
    get point() { return this.chart.marked || [1, 1]; }
    /* The point that a link, the Python lines and a pinned loop are of. */
    get kept() { return this.chart.held || [1, 1]; }
    get name() { return this.chart.marked ? this.chart.name(this.point) : "(1, 1)"; }
    get designs() { return [this.design, this.pinned].filter(one => one); }

    /* A plot over frequencies, on which one can be pointed at. */
    plot(title, draw, height) {
      let place = null, shown = null;
      const sheet = new Sheet({ role: "application", tabindex: 0, "aria-label": `${title}. Arrow keys `
        + "move along the frequencies." }, height, (pen, wide, high, colours) => {
        if (!this.design) return;
        shown = this.designs.map(({ response, told }) => ({ ...response, margins: told.margins, rough: this.rough, bound: this.bound }));
        place = draw(shown, this.lit && nearest(shown[0].omega, this.lit), pen, wide, high, colours);
      });
      for (const name of ["pointermove", "pointerdown"]) sheet.canvas.addEventListener(name, event => {
        if (!this.design || !place) return;
        const { omega } = shown[0], [x, y] = sheet.place(event);
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
        if (!move || !this.design) return;
        event.preventDefault();
        const { omega } = shown[0], from = this.lit ? nearest(omega, this.lit) : omega.length >> 1;
        this.light(omega[Math.min(omega.length - 1, Math.max(0, from + move * (event.shiftKey ? 20 : 1)))]);
      });
      sheet.figure = element("figure", {}, element("figcaption", {}, title), sheet.canvas);
      return sheet;
    }

    /* Light one frequency in all plots, and where the D-curve has it. */
    light(omega) {
      if (omega === this.lit) return;
      this.lit = omega;
      this.chart.lit = null;
      this.following.textContent = this.cut || "";
      if (omega) {
        const { loop, response } = this.design, [x, y] = api.crossing(loop, omega);
        if (Number.isFinite(x + y)) this.chart.lit = [x, y];
        const [re, im] = response.at(omega);
        this.following.textContent = `${say(omega / TURN)} Hz: |L| = ${say(Math.hypot(re, im))}, phase `
          + `${say(Math.atan2(im, re) * 180 / Math.PI)}\u00b0, |S| = ${say(1 / Math.hypot(1 + re, im))}`;
      }
      this.draw();
    }

    draw() {
      this.chart.sheet.draw();
      for (const plot of this.plots) plot.draw();
    }

    /* There is no loop: nothing of the one before stays. */
    none(why) {
      this.near.drop("point");
      this.wide.drop("chart");
      this.counting = false;
      this.slow.drop(...TOLD, ...BREAKS);
      clearTimeout(this.rest);
      this.design = this.lit = null;
      this.chart.clear();
      this.out.textContent = why;
      this.note.textContent = this.following.textContent = this.ready.textContent = "";
      this.numbers.replaceChildren();
      this.summary.replaceChildren();
      this.listed = null;
      this.draw();
    }

    /* Take another loop. While a slider moves, `moving`, pictures are coarser and nothing is asked
     * that takes long. */
    set(spec, moving = false) {
      this.slow.drop(...TOLD, ...BREAKS);
      this.design = { spec, loop: api.make(spec), kept: {}, told: {}, breaks: Array(WAYS.length).fill(undefined), asked: false };
      this.chart.broken = [];
      this.lit = this.chart.lit = null;
      this.redraw(moving);
      this.tell(moving);
    }

    /* The open loop at the point, from few frequencies while the hand moves. */
    respond() {
      const response = this.design.response = this.responseOf(this.design, this.point);
      this.cut = `Every turn of the curves is drawn up to ${say(response.dense / TURN)} Hz${response.band.length
        ? `, and some turns and the band of all turns up to ${say(response.top / TURN)} Hz` : ""}.`;
      if (!this.lit) this.following.textContent = this.cut;
      this.draw();
    }

    responseOf({ loop, told: { margins } }, point) {
      const marks = ["lower", "upper", "delay", "phase", "modulus"].map(name => margins?.[`${name}At`]).filter(w => w > 0 && w < Infinity);
      return api.response(loop, ...point, this.rough ? 1200 : 9000, marks);
    }

    redraw(moving = false) {
      if (!this.spec) return;
      this.chart.stale = true;
      this.chart.curve = this.dcurve(this.design, moving ? 1500 : 20000);
      if (!moving) this.chart.ghost = this.pinned && this.dcurve(this.pinned, 20000);
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
        this.note.textContent = error || (found.sure < 1 && !moving ? `${undecided(found)} ` : "") + "Refining \u2026";
        if (!error) this.chart.fill(found);
        if (spec !== this.spec) {
          // It stays faint, because the loop has moved on.
          this.chart.stale = true;
          this.count(true);
          return;
        }
        if (moving || error) return;
        this.wide.ask("chart", [...input, 400, 3000000], (finer, wrong) => {
          if (!wrong) this.chart.fill(finer);
          this.note.textContent = wrong || (finer.sure < 1 ? undecided(finer) : finer.counts.every(count => count === UNCONFINED)
            ? `The loop is ${LOST} in the whole chart. This is certain.`
            : "Every pixel of the chart is certain. The lines between areas are true to a pixel.");
        });
      });
    }

    dcurve({ loop }, most) {
      const { x0, x1, y0, y1 } = this.chart.box, range = [Infinity, 0];
      const found = api.dcurve(loop, x0, x1, y0, y1, most);
      for (let i = 2; i < found.curve.length; i += 3) {
        if (found.curve[i] < range[0]) range[0] = found.curve[i];
        if (found.curve[i] > range[1]) range[1] = found.curve[i];
      }
      return { ...found, range };
    }

    /* The point is another, or the loop: the plots follow in this frame, the numbers once pointer and
     * sliders rest. What was told of the held point is kept while others are looked at. */
    tell(rough) {
      if (!this.spec) return;
      const { point, design } = this;
      this.rough = rough;
      this.slow.drop(...TOLD);
      design.told = this.chart.hover ? {} : design.kept[point] ||= {};
      this.respond();
      this.write();
      const { told } = design;
      if (told.count === undefined) this.near.ask("point", [this.spec, ...point], (count, error) => {
        if (error) this.out.textContent = error;
        else if (count > UNDECIDED && told === this.design?.told) {
          told.count = count;
          this.write();
        }
      });
      else this.near.drop("point");
      clearTimeout(this.rest);
      this.rest = setTimeout(() => this.settle(), 250);
    }

    write() {
      const { count, root } = this.design.told;
      const parts = [`${this.name}: ${count === undefined ? "counting \u2026" : counted(count)}`];
      if (count >= 0 && Number.isFinite(root?.[0])) parts.push(`rightmost root in rad/s: ${rootText(root)}; it `
        + `${root[0] < 0 ? "decays" : "grows"} by a factor of e in ${duration(1 / Math.abs(root[0]))}`);
      const release = matchMedia("(pointer: coarse)").matches ? "a tap on it releases it" : "Escape or a click on it releases it";
      this.out.textContent = `${parts.join("; ")}.${this.chart.held ? ` Held: ${release}.` : this.chart.hover ? "" : ` ${weakestText(this.design.breaks)}`}`;
      this.list();
    }

    /* Ask for what takes longer. */
    settle() {
      const { point, design } = this, { told } = design;
      if (this.rough) {
        this.rough = false;
        this.respond();
      }
      this.asks(this.slow, design, told, point, kind => {
        const weakest = weakestOf(design.breaks);
        this.chart.broken = design.breaks.flatMap((one, k) => one?.size > 0 && one.size < Infinity
          ? [{ place: WAYS[k].map(v => 1 + v * one.size), weakest: one.size === weakest?.size }] : []);
        this.heard();
        // A margin may lie beyond what is drawn. The plots show no other number.
        if (kind === "margins" && told === this.design?.told) this.respond(); else this.chart.sheet.draw();
        this.write();
      });
    }

    /* Ask a desk for the numbers of a design at a point that are not there yet. */
    asks(desk, design, told, point, heard) {
      for (const kind of TOLD) if (told[kind] === undefined) desk.ask(kind, [design.spec, ...point], (found, error) => {
        told[kind] = error ? UNTOLD[kind] : found;
        heard(kind);
      });
      if (design.asked) return;
      design.asked = true;
      BREAKS.forEach((kind, k) => desk.ask(kind, [design.spec, WAYS[k]], (found, error) => {
        design.breaks[k] = error ? UNBROKEN : found;
        heard(kind);
      }));
    }

    /* The numbers of the loop, and of the pinned one beside it. */
    list() {
      const { designs, design } = this, parts = partsOf(designs, this.name);
      fillPanel(this.summary, design, this.bound);
      const text = JSON.stringify(parts);
      if (text === this.listed) return;
      this.listed = text;
      fill(this.numbers, parts, ["Number", "This loop", `Pinned at ${this.pinned?.at}`].slice(0, 1 + designs.length));
      this.ready.textContent = complete(parts) ? `The table has all numbers at ${this.name}: ${parts[0].slice(1)
        .map(([name, [{ text }]]) => `${name}: ${text}`).join("; ")}.` : "";
    }

    /* What a picture is of. */
    get lines() {
      const one = ({ spec }, title = "") => `${title}${formula(spec)}. ${described(spec)}`;
      return this.design ? [one(this.design), ...this.pinned ? [one(this.pinned, `Dashed, pinned at ${this.pinned.at}: `)] : []] : [];
    }

    /* The table as plain text. */
    copy() { navigator.clipboard.writeText(copied(this.numbers)); }

    /* Pin the loop as it is, or release it: what follows is seen against it. */
    pin() {
      this.compare(this.pinned || !this.design ? null : { spec: this.spec, held: this.chart.held });
      this.moved("pin");
    }

    /* Show a loop at its held point beside the loop, dashed, with its numbers; null for none. */
    compare(given) {
      if (this.beside) this.beside.drop(...TOLD, ...BREAKS);
      this.pinned = null;
      if (given) {
        const { spec, held } = given, point = held || [1, 1], same = this.design && JSON.stringify(spec) === JSON.stringify(this.spec);
        // What is known of it by now is not asked for again.
        const told = { ...same && this.design.kept[point] }, breaks = same ? [...this.design.breaks] : Array(WAYS.length).fill(undefined);
        const pinned = this.pinned = { spec, held, point, told, breaks, loop: api.make(spec), at: held ? this.chart.name(held) : "(1, 1)",
          asked: breaks.every(one => one !== undefined) };
        pinned.response = this.responseOf(pinned, point);
        this.beside ||= new Desk([...TOLD, ...BREAKS]);
        this.asks(this.beside, pinned, told, point, kind => {
          if (kind === "margins") {
            pinned.response = this.responseOf(pinned, point);
            this.draw();
          }
          if (this.design) this.list();
        });
      }
      this.chart.ghost = this.pinned && this.dcurve(this.pinned, 20000);
      this.compared(Boolean(this.pinned));
      this.draw();
      if (this.design) this.list();
    }
  }

  /* ---------------------------------------------------------------------------- controls */

  const button = (text, done) => element("button", { type: "button", onclick: done }, text);
  const buttons = (...all) => element("p", { class: "live-buttons" }, ...all);

  /* A slider. `moved(value, moving)` hears a move in each frame, and the last one with moving = false.
   * `to` sets it, and gives a value past its end twice the room. */
  function slider(id, name, low, high, value, write, moved) {
    let waiting = 0;
    const shown = element("output", { id: `${id}-value` }, write(value));
    const input = element("input", { type: "range", id, min: low, max: high, step: (high - low) / 200,
      "aria-controls": `${id}-value`, oninput: () => {
        shown.textContent = write(Number(input.value));
        waiting ||= requestAnimationFrame(() => {
          waiting = 0;
          moved(Number(input.value), true);
        });
      }, onchange: () => {
        cancelAnimationFrame(waiting);
        waiting = 0;
        moved(Number(input.value), false);
      } });
    input.value = value;
    // Without `for` it would be the label of the output.
    const label = element("label", { class: "live-field", for: id }, element("span", {}, name, " ", shown), input);
    label.to = (at, text = null) => {
      const end = at > high ? 2 * at : high;
      [input.max, input.step] = [end, (end - low) / 200];
      input.value = at;
      shown.textContent = text || write(at);
    };
    return label;
  }

  function choice(id, name, options, changed) {
    const select = element("select", { id, onchange: () => changed(select.value) },
      ...options.map(([value, text]) => element("option", { value }, text)));
    return element("label", { class: "live-field" }, element("span", {}, name), select);
  }

  /* Zoom, download of the pictures, and the ghost, of any explorer. */
  function tools(live, file, sheets, ...more) {
    const pin = element("button", { type: "button", "aria-pressed": "false", onclick: () => live.pin() }, "Pin this loop");
    live.compared = pinned => pin.setAttribute("aria-pressed", String(pinned));
    return buttons(button("Zoom in", () => live.chart.zoom(0.5)), button("Zoom out", () => live.chart.zoom(2)),
      ...more, pin, button("PNG", () => snapshot(sheets, live.lines, live.numbers, blob => {
        const link = element("a", { href: URL.createObjectURL(blob), download: `${file}.png` });
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 1000);
      })));
  }

  // Of the pages where a loop can be pinned.
  const PINNED = " Dashed curves: the pinned loop.";

  function legend(more = "") {
    return element("p", { class: "live-note" }, "Move over the chart for a preview. A click or a tap holds the point. "
      + "On the D-curve a root lies on the imaginary axis, from low frequency (blue) to high (yellow), or is 0 (straight line). "
      + "It is drawn where it bounds the stable region. "
      + "Cross: the ideal point (1, 1). Dots: the critical perturbations along four directions, the smallest one filled. Square, in small charts: "
      + `the paper\u2019s perturbations, up to 10\u207b\u2076.${more}`);
  }

  const figures = (...all) => element("div", { class: "live-two" }, ...all);

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
    place.replaceChildren(form, figures(element("div", {}, live.figure, legend(), live.note), live.numbers));
    live.chart.show([1, 1], 3e-6);
    update();
  }

  /* The chart of a chapter: one of the presets in the window that the page asks for. */
  function chapter(place) {
    const { live: name, centre, half } = place.dataset, live = new Live(`${name}: number of unstable roots over `
      + "c1 and c2.");
    place.replaceChildren(figures(live.figure, live.plots[0].figure), tools(live, name.toLowerCase().replace(/\W+/g, "-"), [live.chart.sheet, ...live.plots]),
      legend(PINNED), live.note, live.plots[1].figure, live.following);
    live.chart.show([Number(centre), Number(centre)], Number(half));
    live.set(PRESETS[name][0]);
  }

  /* Your own loop. */
  function own(place) {
    const live = new Live("Number of unstable roots over c1 and c2.");
    const id = name => `${live.id}-${name}`, fields = {}, errors = {};
    const code = element("pre", { class: "live-code", "aria-label": "Python" });
    const orbit = element("a", {}, "Open this loop in orbit");
    // The unit of the fields, the gain from which its slider goes, the steps that Undo can take back;
    // `quiet` while the page itself changes what it shows; the timer of what is being typed.
    let unit = 1, base = 1, depth = 0, quiet = true, before = null, later = 0, typing = 0;
    // The controller of the pasted text, which stays in its field.
    let pasted = null;
    const understood = element("p", { class: "live-formula" });
    const doubt = element("p", { class: "live-note live-wrong", role: "status" });
    // What the controller stands in: a pasted one stands in the sensor and the arms of the loop before.
    const around = element("p", { class: "live-note live-around" });

    /* The address holds the loop, and its history undoes what was done to it. */
    live.moved = step => {
      if (!live.spec) return;
      const hash = address(live.spec, live.chart, unit, fields.pasted.value, live.bound, live.pinned);
      code.textContent = python(live.spec, live.kept, unit);
      orbit.href = `in_orbit.html${hash}`;
      if (quiet) return;
      // A point or a slider that goes on moving is one step, and so is a text that is being typed; another view is none.
      const further = step && hash !== location.hash && !(step === before && /^(point|typed|slid)/.test(step));
      before = step || before;
      const write = () => {
        history[further ? "pushState" : "replaceState"]({ depth }, "", hash);
      };
      clearTimeout(later);
      if (further) undo.disabled = !++depth;
      if (further) write(); else later = setTimeout(write, 200);
    };
    // What the fields hold and is no loop is in no address: to undo it takes the loop of the address.
    const undo = button("Undo", () => { if (live.spec) history.back(); else open(); });

    /* An error stands at its field. */
    const blame = (name, message) => {
      if (message) fields[name].setAttribute("aria-invalid", "true");
      else fields[name].removeAttribute("aria-invalid");
      errors[name].textContent = message || "";
    };
    const NAMES = { tau1: "\u03c4\u2081", tau2: "\u03c4\u2082", delay: "The dead time", gain: "The gain",
      corner: "The corner p", difference: "\u0394\u03c4" };

    /* The loop that the fields hold; throws an error that names its field. */
    const read = () => {
      const spec = { sensor: fields.sensor.value };
      // A time may have its unit: 12.3 us.
      const UNITS = { s: 1, ms: 1e-3, us: 1e-6, "\u00b5s": 1e-6, "\u03bcs": 1e-6, ns: 1e-9 };
      for (const name of ["tau1", "tau2", "delay", "gain"]) {
        const [, text, timed] = /^(.*?)\s*([mnu\u00b5\u03bc]?s)?$/s.exec(fields[name].value.trim());
        const known = timed && name !== "gain";
        spec[name] = +(readNumber(name, known ? text : fields[name].value, NAMES[name]) * (known ? UNITS[timed] : 1)).toPrecision(known ? 15 : 17);
      }
      if (["dual", "modified"].includes(spec.sensor)) for (const name of ["corner", "difference"])
        spec[name] = readNumber(name, fields[name].value, NAMES[name]) * (name === "corner" ? TURN : 1);
      for (const [name, title] of [["zeros", "Zeros"], ["poles", "Poles"]])
        spec[name] = readRoots(name, fields[name].value, title).map(v => v.map(x => x * unit));
      live.bound = readNumber("bound", fields.bound.value, "The bound");
      api.make(spec);
      return spec;
    };

    /* What is shown is not what the fields hold: it is grey until it is. */
    const old = is => {
      clearTimeout(typing);
      if (is) place.setAttribute("aria-busy", "true"); else place.removeAttribute("aria-busy");
    };

    /* A field is edited: what is shown is old at once. A text that was pasted is taken at once, one that is
     * typed half a second after the last key. While it is typed it may be unfinished, and is not called wrong. */
    const edit = (name, { inputType = "" }) => {
      old(true);
      const whole = /^insertFrom(Paste|Drop)/.test(inputType);
      typing = setTimeout(() => take(name, whole ? {} : { typed: true, step: `typed ${name}` }), whole ? 0 : 500);
    };
    /* The field is left: its text is whole. Further typing in it is another step of the history. */
    const leave = name => {
      if (place.hasAttribute("aria-busy")) take(name, { step: `typed ${name}` });
      before = null;
    };

    /* The controller of a text; none of an empty one. */
    const controller = text => {
      const found = text.trim() ? readController(text) : null;
      if (found && found.zeros.length > found.poles.length) throw armlockRead.wrong("pasted", `This controller has ${found.zeros.length} zeros `
        + `and ${found.poles.length} poles. A controller here has as many poles as zeros or more.`);
      return found;
    };

    /* Take what the fields hold. `edited` is the field that has changed, by a slider or a hand (`dragged`) that
     * may be `moving`, or by text that may be unfinished (`typed`). */
    const take = (edited = null, { moving = false, dragged = false, typed = false, step = "loop" } = {}) => {
      let text = null, problem = null;
      try {
        if (edited === "pasted") text = controller(fields.pasted.value); else read();
      } catch (error) {
        problem = error;
      }
      // An unfinished text stays grey.
      if (typed && problem) return;
      old(false);
      for (const name of Object.keys(errors)) blame(name, "");
      try {
        if (problem) throw problem;
        if (edited === "pasted") pasted = text;
        if (text) {
          // Nothing of the loop before stays.
          live.none("");
          // Its numbers are those of s in rad/s.
          unit = 1;
          fields.unit.value = "1";
          put(pasted);
          // Another loop is seen whole, and at the ideal point.
          Object.assign(live.chart, { centre: [0, 0], half: 3, held: null });
        }
        const spec = read();
        wrong.textContent = "";
        echo(spec);
        if (!dragged) {
          base = Number(fields.gain.value) || 1;
          gain.to(0);
          dead.to(Math.max(least, Math.log10(spec.delay)), time(spec.delay));
          const root = [...spec.zeros, ...spec.poles].map(v => Math.hypot(...v)).filter(v => v);
          range = [Math.min(...root, 1 / spec.tau1), Math.max(...root, 30 / spec.tau1)];
          if (range[1] < 100 * range[0]) range = [range[0] / 10, range[1] * 10];
        }
        if (edited && !["unit", "bound"].includes(edited)) presets.value = "";
        live.set(spec, moving);
        if (!dragged || caught) roots.draw();
        undo.disabled = !depth;
        if (!moving) live.moved(step);
      } catch (error) {
        // What was typed, not what it is in rad/s or s.
        const typed = fields[error.field]?.value;
        if (/, got [-\d.e+]+$/.test(error.message) && typed) error.message = error.message.replace(/got \S+$/, `got ${typed}`);
        // Too few poles are too many zeros: the field that was edited is the one to look at.
        const name = error.field === "zeros" && edited === "poles" ? edited : error.field;
        if (errors[name]) blame(name, error.message);
        if (edited) presets.value = "";
        wrong.textContent = error.message;
        undo.disabled = false;
        live.none("There is no loop to show, because a field has an error.");
        code.textContent = understood.textContent = around.textContent = doubt.textContent = "";
        orbit.removeAttribute("href");
        roots.draw();
      }
    };

    /* What the page has understood, and whether it is still what was pasted. */
    const echo = spec => {
      const order = roots => roots.map(([re, im]) => [re + 0, im + 0]).sort((p, q) => p[0] - q[0] || p[1] - q[1]);
      const parts = ({ zeros, poles, gain, delay }) => JSON.stringify([order(zeros), order(poles), gain, delay]);
      const same = pasted && parts(pasted) === parts(spec);
      understood.textContent = `${formula(spec)}${pasted && !same ? ". It was changed after the text above was pasted." : ""}`;
      doubt.textContent = same ? pasted.doubt : "";
      around.textContent = described(spec);
    };

    const put = spec => {
      for (const name of ["sensor", "tau1", "tau2", "delay", "gain", "difference"])
        if (spec[name] !== undefined) fields[name].value = String(spec[name]);
      if (spec.corner !== undefined) fields.corner.value = shortest(spec.corner, TURN);
      for (const name of ["zeros", "poles"]) fields[name].value = written(spec[name], unit);
      shape();
    };
    const shape = () => {
      const two = ["dual", "modified"].includes(fields.sensor.value);
      for (const name of ["corner", "difference"]) fields[name].closest(".live-field").hidden = !two;
    };
    const field = (name, label, area = false) => {
      fields[name] = element(area ? "textarea" : "input", { id: id(name), spellcheck: "false",
        autocomplete: "off", autocapitalize: "off", rows: area ? 2 : null,
        "aria-describedby": id(`${name}-wrong`), oninput: event => edit(name, event), onchange: () => leave(name) });
      errors[name] = element("span", { id: id(`${name}-wrong`), class: "live-wrong" });
      return element("div", { class: `live-field${area ? " live-wide" : ""}` },
        element("label", { for: id(name) }, label), fields[name], errors[name]);
    };
    const select = (name, title, options, changed) => {
      const made = choice(id(name), title, options, changed);
      fields[name] = made.querySelector("select");
      return made;
    };
    /* Show another loop, with its view. Hertz where their numbers are shorter. */
    const show = ({ spec, centre, half, held = null, unit: given, pasted: text = "", bound = 6 }) => {
      fields.pasted.value = text;
      fields.bound.value = bound;
      pasted = text ? readController(text) : null;
      unit = given || ([1, TURN].map(one => [...spec.zeros, ...spec.poles].map(v => written([v], one)).join("").length).reduce((a, b) => b < a) ? TURN : 1);
      fields.unit.value = unit === 1 ? "1" : "hz";
      put(spec);
      live.none("");
      live.chart.held = held;
      live.chart.show(centre, half);
      take();
    };
    const start = name => {
      const [spec, centre, half] = PRESETS[name];
      presets.value = name;
      show({ spec, centre: [centre, centre], half });
    };

    const preset = choice(id("preset"), "Start from", [["", "\u2014 your own loop \u2014"],
      ...Object.keys(PRESETS).map(name => [name, name])], name => { if (name) start(name); });
    const presets = preset.querySelector("select");
    const gain = slider(id("factor"), "Gain factor:", -2, 2, 0, v => say(10 ** v), (v, moving) => {
      fields.gain.value = exact(+(base * 10 ** v).toPrecision(6));
      take("gain", { moving, dragged: true, step: "slid gain" });
    });
    // The left end is no dead time.
    const least = -7, late = v => v > least ? +(10 ** v).toPrecision(3) : 0;
    const dead = slider(id("dead"), "Dead time:", least, 1, least, v => time(late(v)), (v, moving) => {
      fields.delay.value = time(late(v));
      take("delay", { moving, dragged: true, step: "slid delay" });
    });
    const wrong = element("p", { class: "live-note live-wrong", role: "alert" });
    const paste = field("pasted", "Paste a controller from MATLAB, Python or Julia", true);
    const sensor = select("sensor", "Sensor", SENSORS, () => { shape(); take("sensor"); });
    sensor.classList.add("live-wide");
    const inputs = element("form", { class: "live-form", onsubmit: event => event.preventDefault() },
      sensor, field("gain", "Gain"), field("delay", "Dead time in s"),
      field("tau1", "Delay \u03c4\u2081 in s"), field("tau2", "Delay \u03c4\u2082 in s"),
      field("corner", "Corner p in Hz"), field("difference", "\u0394\u03c4 in s"),
      select("unit", "Unit of roots", [["1", "rad/s"], ["hz", "Hz"]], value => {
        // The loop stays what it is; the fields say it in the other unit.
        const { spec } = live;
        unit = value === "hz" ? TURN : 1;
        if (spec) put(spec);
        take("unit");
      }),
      field("bound", "Bound on |S|, dB"), field("zeros", "Zeros", true), field("poles", "Poles", true));
    fields.pasted.placeholder = "(s + 0.02)/(s^2 + 0.1 s)";

    /* The s-plane: a root follows the pointer, a pair together; a root at 0 stays. */
    let range = [0.01, 1], drawn = null, caught = null;
    const roots = new Sheet({ role: "img", "aria-label": "Roots of the controller in the s-plane. The fields Zeros "
      + "and Poles have them as text." }, wide => 0.8 * wide, (pen, wide, high, colours) => {
      const { spec } = live;
      drawn = spec && drawRoots({ ...spec, unit, range, crossing: weakestOf(live.design.breaks)?.omega, rightmost: live.design.told.root }, pen, wide, high, colours);
    });
    const near = event => {
      if (!drawn) return null;
      const [x, y] = roots.place(event), all = ["zeros", "poles"].flatMap(kind => live.spec[kind].map((root, k) => {
        const [u, v] = drawn.place(root);
        return { kind, k, root, gap: Math.hypot(u - x, v - y) };
      })).filter(({ root, gap }) => gap < 16 && Math.hypot(...root)).sort((p, q) => p.gap - q.gap);
      return all[0] || null;
    };
    const drag = (event, moving) => {
      const { kind, k, root: [re, im], spec } = caught, [x, y] = drawn.root(...roots.place(event));
      const round = v => Number((v / unit).toPrecision(3)) * unit, moved = spec[kind].map(v => v);
      const to = im ? [round(x), round(Math.max(Math.abs(y), 1e-3 * Math.hypot(x, y)))]
        : [Math.sign(x) * round(Math.hypot(x, y)), 0];
      moved[k] = [to[0], Math.sign(im) * to[1]];
      if (im) moved[spec[kind].findIndex(([a, b]) => a === re && b === -im)] = [to[0], -Math.sign(im) * to[1]];
      put({ ...spec, [kind]: moved });
      take(kind, { moving, dragged: moving });
    };
    const on = (name, done) => roots.canvas.addEventListener(name, done);
    on("pointerdown", event => {
      caught = near(event);
      if (!caught) return;
      caught.spec = live.spec;
      roots.canvas.setPointerCapture(event.pointerId);
    });
    on("pointermove", event => {
      if (caught) drag(event, true); else roots.canvas.style.cursor = near(event) ? "grab" : "";
    });
    on("pointerup", event => {
      if (caught) drag(event, false);
      caught = null;
    });
    on("pointercancel", () => { caught = null; });
    on("touchstart", event => { if (caught) event.preventDefault(); });

    const [nyquist, bode] = live.plots, plane = element("figure", { class: "live-plane" },
      element("figcaption", {}, "Poles \u00d7 and zeros \u25cb of the controller"), roots.canvas);
    live.heard = () => roots.draw();
    bode.figure.classList.add("live-bode");
    place.replaceChildren(element("div", { class: "live-own" },
      element("div", { class: "live-main" }, figures(live.figure, plane, nyquist.figure, bode.figure), live.following,
        tools(live, "loop", [live.chart.sheet, roots, nyquist, bode], undo, button("Paper\u2019s square", () => live.chart.show([1, 1], 3e-6)),
          button("Whole", () => live.chart.show([0, 0], 3)), button("Copy numbers", () => live.copy())), live.note, live.numbers),
      element("div", { class: "live-side" }, element("div", { class: "live-top" }, preset, wrong),
        element("div", { class: "live-panel" }, live.summary, gain, dead),
        element("div", { class: "live-paste" }, paste, understood, around, doubt), element("div", { class: "live-fields" }, inputs, legend(`${PINNED} In the s-plane: poles and `
          + "zeros of the controller, which you can drag, the closed-loop root that crosses at the smallest critical perturbation, and the rightmost root. Shaded disc around \u22121 in the Nyquist "
          + "plot, and dashed line in Bode\u2019s plot: the bound on |S|."), element("p", {}, orbit)))),
    element("details", {}, element("summary", {}, "This loop in Python"), code));

    const open = () => {
      quiet = true;
      clearTimeout(later);
      presets.value = "";
      try {
        const given = fromAddress(location.hash);
        if (given) {
          for (const one of [given, given.pinned]) if (one) api.make(one.spec);
          show(given);
          live.compare(given.pinned);
        } else start(Object.keys(PRESETS)[0]);
      } catch (error) {
        old(false);
        live.none("There is no loop to show.");
        shape();
        roots.draw();
        code.textContent = "";
        wrong.textContent = `The address of this page holds no loop: ${error.message.replace(/\.$/, "")}. It was left as it is. Choose `
          + "a loop to start from, or mend the address.";
      }
      quiet = false;
    };
    addEventListener("popstate", ({ state: kept }) => {
      depth = kept?.depth || 0;
      undo.disabled = !depth;
      before = null;
      open();
    });
    undo.disabled = true;
    open();
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
    const LOOPS = { "the paper's": [PAPER, 1.5e-6], "the white paper's": [FLIGHT, 6e-3] };
    const wrong = element("p", { class: "live-note live-wrong", role: "alert" }), MINE = "yours, from the link";
    // "Your own loop" opens this page with its loop in the address.
    try {
      const given = fromAddress(location.hash);
      if (given) {
        api.make(given.spec);
        LOOPS[MINE] = [given.spec, given.half, given.unit];
      }
    } catch (error) {
      wrong.textContent = `The address of this page holds no loop: ${error.message}`;
    }
    const live = new Live("Number of unstable roots over c1 and c2 on this day.");
    const state = { loop: LOOPS[MINE] ? MINE : Object.keys(LOOPS)[0], orbit: Object.keys(armlockOrbits)[0], master: "1",
      hold: HOLDS[0], day: 20 };
    // Of each day that was counted what `day` in desk.js tells.
    let days = [], trips = null, half = null, values = [], finished = 0;
    const back = element("a", {}, "Open the loop of this day in \u201cYour own loop\u201d");
    const words = element("p", { class: "live-note", role: "status" });
    const spec = day => {
      const [tau1, tau2] = trips.map(trip => trip(day));
      return { ...LOOPS[state.loop][0], tau1, tau2, difference: 2 * held(half, state.hold, day) };
    };
    const sheet = new Sheet({ role: "img", "aria-label": "The year: true and assumed half difference, days on "
      + "which the loop is unstable, and the critical perturbation of the arms in opposite directions." }, wide => (innerWidth < 600 ? 1.2 : 1) * wide,
    (pen, ...rest) => drawYear({ values, days, day: state.day }, pen, ...rest));
    for (const name of ["pointerdown", "pointermove"]) sheet.canvas.addEventListener(name, event => {
      const at = (sheet.place(event)[0] - 56) / (sheet.wide - 64);
      if (event.buttons && at >= 0 && at <= 1) { today.to(Math.round(at * YEAR)); move(Math.round(at * YEAR), true); }
    });
    sheet.canvas.addEventListener("pointerup", () => move(state.day, false));

    /* Every sixteenth day first, then those between, by two workers. Each day has its count, and every
     * eighth day its critical perturbation. */
    const count = () => {
      days = Array(YEAR + 1);
      finished = 0;
      const order = [16, 8, 4, 2, 1].flatMap((step, k) => Array.from({ length: Math.ceil((YEAR + 1) / step) },
        (_, i) => i * step).filter(day => !k || day % (2 * step)));
      const next = desk => {
        const day = order.shift();
        if (day !== undefined) desk.ask("day", [spec(day), day % 8 === 0], (found, error) => {
          // A sensor that would divide by zero is no loop, and so not a stable one.
          days[day] = error ? null : found;
          sheet.draw();
          if (++finished > YEAR) summary(); else {
            lost.textContent = `Counting the days: ${finished} of ${YEAR + 1} \u2026`;
            next(desk);
          }
        });
      };
      for (const desk of [live.slow, live.wide]) {
        desk.drop("day");
        next(desk);
      }
    };
    const summary = () => {
      const listed = is => {
        const parts = [];
        for (let day = 0; day <= YEAR; day++) if (is(days[day])) {
          const from = day;
          while (day < YEAR && is(days[day + 1])) day++;
          parts.push(from === day ? `${day}` : `${from} to ${day}`);
        }
        return parts.join(", ");
      };
      const stable = found => typeof found === "number", open = found => found === "undecided", number = days.filter(stable).length;
      lost.textContent = number > YEAR ? `Stable on all ${YEAR + 1} days.` : number ? `Stable on ${number} of ${YEAR + 1} days: ${listed(stable)}.`
        : `Stable on none of ${YEAR + 1} days.`;
      if (days.some(open)) lost.textContent += ` Undecided: ${listed(open)}.`;
      lost.textContent += " The roots are counted once a day. Dots: the critical perturbation along (1, \u22121) or (\u22121, 1), whichever is smaller, every "
        + "eighth day; none where it is undecided, 0, or larger than 2.";
    };
    const lost = element("p", { class: "live-note", role: "status" });
    const move = (day, moving) => {
      state.day = day;
      const now = spec(day), ms = v => `${say(1e3 * v)} ms`;
      if (now.difference) live.set(now, moving);
      else live.none("The sensor would divide by zero: there is no loop on this day.");
      words.textContent = `Day ${Math.round(day)}: round trips ${now.tau1.toFixed(4)} s and ${now.tau2.toFixed(4)} s; `
        + `half difference ${ms(half(day))}, assumed ${ms(now.difference / 2)}.`;
      back.href = `live.html${address({ ...now, difference: now.difference || 1 }, live.chart, LOOPS[state.loop][2] || TURN)}`;
      sheet.draw();
    };
    const update = () => {
      trips = arms(state.orbit, state.master);
      half = t => 0.5 * (trips[0](t) - trips[1](t));
      values = Array.from({ length: YEAR + 1 }, (_, day) => [half(day), held(half, state.hold, day)]);
      lost.textContent = `Counting the days: 0 of ${YEAR + 1} \u2026`;
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
      (v, moving) => move(v, moving));
    today.classList.add("live-wide");
    today.querySelector("input").step = 1;
    const form = element("form", { class: "live-form live-single", onsubmit: event => event.preventDefault() },
      pick("loop", "Loop", Object.keys(LOOPS)), pick("orbit", "Orbit", Object.keys(armlockOrbits)),
      pick("master", "Master spacecraft", Object.keys(ARMS)), pick("hold", "The sensor assumes", HOLDS));
    place.replaceChildren(element("div", { class: "live-own" },
      element("div", { class: "live-main" }, figures(element("figure", {}, element("figcaption", {}, "Solid: the true half "
        + "difference. Dashed: the half difference that the sensor assumes. Shaded: the loop is unstable."), sheet.canvas, lost), live.figure), words, live.note, live.numbers, buttons(back)),
      element("div", { class: "live-side" }, element("div", { class: "live-top" }, form, wrong),
        element("div", { class: "live-panel" }, live.summary, today), element("div", { class: "live-fields" }, legend()))));
    addEventListener("hashchange", () => location.reload());
    update();
  }

  // On a wide screen the book's own column begins closed beside a page that is all live: its button opens it.
  if (innerWidth >= 992 && document.querySelector("[data-live=loop], [data-live=year]"))
    document.querySelector("#pst-primary-sidebar")?.classList.add("pst-sidebar-hidden");
  for (const place of document.querySelectorAll("[data-live]"))
    ({ front, loop: own, year }[place.dataset.live] || chapter)(place);
}
