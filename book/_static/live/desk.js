"use strict";
/*
 * What takes long, in workers: one thing at a time, and nothing of a loop that was left.
 *
 * A worker is made of the functions' own text, because a page that is opened from disk may load no script
 * into one.
 */
const armlockDesk = (function () {
  // Instead of a count that would take too many steps: it is not begun.
  const TOO_MANY = -4;
  // How long what was left may go on, in ms: a slider leaves a loop in each frame.
  const PATIENCE = 300;

  /* Runs in a worker: `api` is what the engine's files give. */
  function tasks(api, TOO_MANY) {
    const { UNCONFINED, UNDECIDED, make, tail, at, Disc } = api;
    // Steps of a count for a reader who waits, and for one who moves the pointer.
    const MOST = 4000000, QUICK = 400000, A_RADIAN = 1.2;

    /* About how many steps a count takes at least. It takes more than one in each radian of the longest delay
     * where the disc that L fills with free phases holds -1. This only refuses: it decides no number. */
    function steps(loop, c1, c2) {
      const point = at(loop, c1, c2), end = tail(loop, point.c1, point.c2).omega, disc = new Disc(loop, [point.c1, point.c2]);
      let sum = 0;
      for (let w = 1e-3 / loop.longest; w < end && end < Infinity; w *= 1.02) {
        for (const part of loop.parts) part.at(w);
        disc.look(w);
        if (Math.hypot(1 + disc.re, disc.im) <= disc.radius / disc.size) sum += (Math.min(end, 1.02 * w) - w) * loop.longest;
      }
      return A_RADIAN * sum;
    }

    /* Counts are kept: those at (1, 1) are asked for by every direction. */
    const known = new Map();
    function counted(spec, c1, c2, most = MOST) {
      const name = JSON.stringify([spec, c1, c2, most]);
      if (known.size > 50) known.clear();
      if (!known.has(name)) known.set(name, steps(api.reduced(make(spec), c1, c2), c1, c2) > most ? TOO_MANY
        : api.count(make(spec), c1, c2, { most }));
      return known.get(name);
    }
    const begun = (...all) => Math.max(UNDECIDED, counted(...all));
    const first = (spec, way) => api.firstBreak(make(spec), ...way, begun(spec, 1, 1));

    const look = {
      chart: (spec, x0, x1, y0, y1, n, samples) => ({ n, box: { x0, x1, y0, y1 },
        ...api.chart(make(spec), x0, x1, n, y0, y1, n, samples) }),
      point: (spec, c1, c2) => counted(spec, c1, c2, QUICK),
      count: counted,
      root: (spec, c1, c2) => counted(spec, c1, c2) < 0 ? null : api.rightmost(spec, c1, c2),
      break: first,
      margins: (spec, c1, c2) => api.margins(spec, c1, c2, begun(spec, c1, c2)),
      // Of one day of a year: the critical perturbation of the arms in opposite directions if it is asked for, nan if
      // not; null where the loop is unstable, and a word where that is undecided.
      day: (spec, whole) => {
        const count = counted(spec, 1, 1);
        if (count) return count > 0 || count === UNCONFINED ? null : "undecided";
        return whole ? Math.min(...[[1, -1], [-1, 1]].map(way => first(spec, way).size)) : NaN;
      },
    };
    return ({ data: { kind, input } }) => {
      let result = null, error = null;
      // "break 2 beside" is a break.
      try { result = look[kind.split(" ")[0]](...input); } catch (problem) { error = problem.message; }
      postMessage({ result, error }, result?.counts ? [result.counts.buffer] : []);
    };
  }

  /* Asks a worker one thing at a time, the most urgent first; of each kind only the last. What is no
   * longer asked for is ended with its worker. */
  class Desk {
    constructor(order) {
      const text = `const api = (${armlockLoop})();
        for (const more of [${armlockMargins}, ${armlockChart}]) Object.assign(api, more(api));
        onmessage = (${tasks})(api, ${TOO_MANY});`;
      Object.assign(this, { order, last: {}, waiting: {}, running: null, ending: 0,
        script: URL.createObjectURL(new Blob([text], { type: "text/javascript" })) });
      this.begin();
    }

    begin() {
      this.running = null;
      this.worker = new Worker(this.script);
      this.worker.onmessage = ({ data }) => {
        const { running } = this;
        this.running = null;
        clearTimeout(this.ending);
        this.ending = 0;
        if (this.last[running.kind] === running) running.heard(data.result, data.error);
        this.next();
      };
    }

    ask(kind, input, heard) {
      this.last[kind] = this.waiting[kind] = { kind, input, heard };
      this.leave();
      this.next();
    }

    drop(...kinds) {
      for (const kind of kinds) {
        delete this.waiting[kind];
        delete this.last[kind];
      }
      this.leave();
    }

    /* End what runs if nobody waits for it. */
    leave() {
      const { running } = this;
      if (!running || this.last[running.kind] === running) return;
      this.ending ||= setTimeout(() => {
        this.ending = 0;
        this.worker.terminate();
        this.begin();
        this.next();
      }, PATIENCE);
    }

    next() {
      const kind = this.order.find(name => this.waiting[name]);
      if (this.running || !kind) return;
      this.running = this.waiting[kind];
      delete this.waiting[kind];
      this.worker.postMessage({ kind, input: this.running.input });
    }
  }

  return { TOO_MANY, Desk };
})();
