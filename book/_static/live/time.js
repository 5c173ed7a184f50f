"use strict";
/*
 * A loop in time, from rest: by how much the laser's frequency is off after a step of its own.
 *
 * The laser v = d - K [m1 (v - c1 v(t - tau1)) + m2 (...)] (t - delay), with d = 1 from t = 0 on.
 * What comes back is known from before, which is the method of steps. Factors of K m1 and K m2 are
 * stepped by the trapezoidal rule, one after the other: poles next to zero lose no digits so. The
 * value of a step is in what both sides of the loop do at that moment; it is solved for.
 */
function armlockTime(api) {
  const { make, tail } = api;

  /* One product of factors (s - z) / (s - p) with complex states. */
  class Filter {
    constructor(gain, zeros, poles, h) {
      const left = [...zeros];
      this.gain = gain;
      this.stages = [...poles].sort((p, q) => Math.hypot(...q) - Math.hypot(...p)).map(p => {
        // The zero that is nearest to the pole in size, so that no stage is large.
        const far = left.map(z => Math.abs(Math.hypot(...z) - Math.hypot(...p)));
        const z = left.length ? left.splice(far.indexOf(Math.min(...far)), 1)[0] : null;
        // x' = p x + b u, y = x + d u
        const b = z ? [p[0] - z[0], p[1] - z[1]] : [1, 0], d = z ? 1 : 0;
        const keep = over([1 + 0.5 * h * p[0], 0.5 * h * p[1]], [1 - 0.5 * h * p[0], -0.5 * h * p[1]]);
        const take = over([0.5 * h * b[0], 0.5 * h * b[1]], [1 - 0.5 * h * p[0], -0.5 * h * p[1]]);
        return { keep, take, d, x: [0, 0], u: [0, 0] };
      });
    }

    /* What it gives for u at the end of a step; with `done` that is taken for what happened. */
    give(u, done) {
      let r = this.gain * u, i = 0;
      for (const stage of this.stages) {
        const { keep, take, d, x, u: before } = stage;
        const sr = r + before[0], si = i + before[1];
        const xr = keep[0] * x[0] - keep[1] * x[1] + take[0] * sr - take[1] * si;
        const xi = keep[0] * x[1] + keep[1] * x[0] + take[0] * si + take[1] * sr;
        if (done) [stage.x, stage.u] = [[xr, xi], [r, i]];
        [r, i] = [xr + d * r, xi + d * i];
      }
      return r;
    }
  }

  function over([a, b], [c, d]) {
    const size = c * c + d * d;
    return [(a * c + b * d) / size, (b * c - a * d) / size];
  }

  /* A step that divides tau1, and the other delays as nearly as may be. */
  function stepOf({ tau1, tau2, delay }, most) {
    const trip = Math.max(tau1, tau2);
    let best = [Infinity, trip / most];
    for (let n = Math.round(0.7 * most); n <= most; n++) {
      const h = trip / n, miss = [tau1, tau2, delay].reduce((sum, t) =>
        sum + Math.abs(t / h - Math.round(t / h)), 0);
      if (miss < best[0] - 1e-9) best = [miss, h];
    }
    return best[1];
  }

  /* {values, step, trip, missed, fast}: v every `step` seconds for some round trips. `missed` is
   * how far a delay is from a whole number of steps; `fast` where the loop is faster than they. */
  function inTime(spec, c1, c2, trips) {
    const loop = make(spec), { tau1, tau2, delay, rest, common, sum, difference, second } = loop;
    // Five steps in a radian of the fastest that may matter, within reason.
    const last = tail(loop, c1, c2, loop.longest)?.omega ?? Infinity, wanted = 5 * last * loop.longest;
    const most = Math.min(4000, Math.max(400, wanted)), fast = wanted > most;
    const h = stepOf(loop, most), trip = Math.max(tau1, tau2), n = Math.ceil(trips * trip / h);
    const listed = part => Array.from(part.re, (re, k) => [re, part.im[k]])
      .filter((_, k) => part.paired[k]);
    // K m = common part / rest: zeros that the factors keep as poles of Q are given back.
    const ends = part => Array.from(part.a, a => [-a, 0]);
    const unpaired = part => Array.from(part.a, (a, k) => part.paired[k] ? null : [-a, 0]).filter(a => a);
    const filters = [[sum, 1, second], [difference, 1, -1]].filter(([part]) => part)
      .map(([part, one, two]) => {
        const above = [...listed(common), ...listed(part), ...ends(rest)];
        const below = [...listed(rest), ...unpaired(rest), ...ends(common), ...ends(part)];
        for (const root of [...above]) {
          const k = below.findIndex(([x, y]) => x === root[0] && y === root[1]);
          if (k >= 0) { below.splice(k, 1); above.splice(above.indexOf(root), 1); }
        }
        return { one, two, filter: new Filter(common.gain * part.gain, above, below, h) };
      });
    const steps = [delay, delay + tau1, delay + tau2].map(t => t / h);
    const values = new Float64Array(n);
    const past = (i, back) => {
      const at = i - back, k = Math.floor(at + 1e-9), share = at - k < 1e-6 ? 0 : at - k;
      if (k < 0) return 0;
      return values[k] + (share ? share * (values[k + 1] - values[k]) : 0);
    };
    const given = (i, now) => {
      const v = steps[0] ? past(i, steps[0]) : now;
      return [v - c1 * past(i, steps[1]), v - c2 * past(i, steps[2])];
    };
    const loopAt = (i, now, done) => {
      const [one, two] = given(i, now);
      return filters.reduce((total, { one: a, two: b, filter }) =>
        total + filter.give(a * one + b * two, done), 0);
    };
    for (let i = 0; i < n; i++) {
      const zero = loopAt(i, 0, false), slope = steps[0] >= 1 ? 0 : loopAt(i, 1, false) - zero;
      values[i] = (1 - zero) / (1 + slope);
      loopAt(i, values[i], true);
      if (!(Math.abs(values[i]) < 1e12)) return { values: values.slice(0, i), step: h, trip, missed: 0, fast };
    }
    const missed = Math.max(...steps.map(k => Math.abs(k - Math.round(k))));
    return { values, step: h, trip, missed, fast };
  }

  return { inTime };
}
