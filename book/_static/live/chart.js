"use strict";
/*
 * Charts of the number of unstable roots over (c1, c2), each pixel certain or marked, and the
 * D-curve, on which roots cross the axis.
 *
 * Along a row D = N - y O - x M with fixed y. A root is on the axis where h = Im((N - y O) conj M)
 * is zero, at x = Re((N - y O) / M), and crosses to the right with growing x where h ascends. The
 * axis is cut until every interval is certain for every row: it holds no zero of h, or one whose
 * place is known to a pixel, or only such whose x lies outside of the chart. What is left at the
 * smallest intervals is marked as undecided. Rows begin with counts that follow from one certified
 * count, along one column, in the same way.
 */
function armlockChart(api) {
  const { BOUNDARY, UNCONFINED, UNDECIDED, at, along, Curve, tail, LOST, chain, Disc, tangentDistance,
    count, halved } = api;
  // Samples in a radian of the longest delay, in a decade; halvings of an interval.
  const A_RADIAN = 6, A_DECADE = 24, DEEPEST = 14;
  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

  /* N, O and M along the axis, for rows (swap = false) or columns, as functions of c - 1. */
  class Lines {
    constructor(loop, swap) {
      [this.loop, this.swap] = [loop, swap];
      this.base = new Curve(loop, at(loop, 1, 1));
      const [m, o] = swap ? [[0, 1], [1, 0]] : [[1, 0], [0, 1]];
      this.m = new Curve(loop, along(...m));
      this.o = new Curve(loop, along(...o));
      this.evaluated = 0;
    }

    /* [omega, h0, h1, g0, g1, |M|, N, O, N, O] with h = h0 - e h1 and x = g0 - e g1. */
    sample(omega) {
      const { base, m, o } = this;
      this.evaluated++;
      base.at(omega);
      m.join(omega);
      o.join(omega);
      const nr = base.vr, ni = base.vi, mr = -m.lr, mi = -m.li, or = -o.lr, oi = -o.li;
      const square = mr * mr + mi * mi;
      return [omega, ni * mr - nr * mi, oi * mr - or * mi, (nr * mr + ni * mi) / square,
        (or * mr + oi * mi) / square, Math.sqrt(square), nr, or, ni, oi];
    }

    /* Bounds over an interval from where the last sample is. */
    over(h) {
      const { base, m, o, loop: { rest } } = this;
      base.over(h);
      m.reach(h);
      o.reach(h);
      const n0 = rest.b0 + base.l0, n1 = rest.b1 + base.l1, n2 = base.bend;
      return { n1, n2, error: base.error, m0: m.l0, o0: o.l0, m1: m.l1, m2: m.l2, o1: o.l1, o2: o.l2,
        k0: n2 * m.l0 + 2 * n1 * m.l1 + n0 * m.l2, k1: o.l2 * m.l0 + 2 * o.l1 * m.l1 + o.l0 * m.l2 };
    }

    /* The crossing of one line between two samples, by halving. */
    placed(e, from, to) {
      const below = sample => sample[1] - e * sample[2] < 0, begins = below(from);
      const place = this.sample(halved(from[0], to[0], w => below(this.sample(w)) !== begins)[1]);
      return place[3] - e * place[4];
    }
  }

  /* Calls found(j, x, jump, off) for each crossing of lines e[j] with x between low and high, where
   * x is known to +- off; and lost(j, from, to) where it is not certain what crosses. Returns the
   * frequency that it came to: `end`, unless that took too many samples. */
  function crossings(lines, e, low, high, pixel, end, samples, found, lost) {
    const least = Math.min(...e), most = Math.max(...e), far = Math.max(Math.abs(low), Math.abs(high));
    const largest = Math.max(Math.abs(least), Math.abs(most)), { longest } = lines.loop;
    const start = 0.1 / longest, grow = 10 ** (1 / A_DECADE) - 1;
    // Whatever the arms' phases are, at no point of the chart L = -1.
    const corner = [[low, high], [least, most]].map(ends => Math.max(...ends.map(v => Math.abs(1 + v))));
    const disc = new Disc(lines.loop, lines.swap ? corner.reverse() : corner);
    const clear = h => (disc.look(omega), Math.hypot(1 + disc.re, disc.im) > disc.over(h));
    const outside = (p, bounds, h) => {
      // |N| > far |M| + largest |O|, first by the tangent of N: the longer steps.
      const { vr, vi, dr, di } = lines.base;
      const left = 0.5 * bounds.n2 * h * h + bounds.error
        + far * Math.min(bounds.m0, p[5] + h * bounds.m1)
        + largest * Math.min(bounds.o0, Math.hypot(p[7], p[9]) + h * bounds.o1);
      return 0.99 * tangentDistance(vr, vi, dr, di, h) > left;
    };
    const out = [];
    /* What crosses on an interval, for all lines; whether that is certain. */
    const read = (p, q, bounds, final) => {
      out.length = 0;
      const h = q[0] - p[0], first = p[0] === 0;
      // How x, and its deviation from a chord, change over the interval at most.
      const size = p[5] - h * bounds.m1;
      const nOf = Math.hypot(p[6], p[8]) + largest * Math.hypot(p[7], p[9]);
      const x0 = size > 0 ? (nOf + h * (bounds.n1 + largest * bounds.o1)) / size : Infinity;
      const x1 = size > 0 ? (bounds.n1 + largest * bounds.o1 + x0 * bounds.m1) / size : Infinity;
      const x2 = size > 0
        ? (bounds.n2 + largest * bounds.o2 + 2 * x1 * bounds.m1 + x0 * bounds.m2) / size : Infinity;
      for (let j = 0; j < e.length; j++) {
        const a = p[1] - e[j] * p[2], b = q[1] - e[j] * q[2];
        const curved = (bounds.k0 + Math.abs(e[j]) * bounds.k1) * h * h;
        if (first ? Math.abs(b) > curved
          : a < 0 === b < 0 && Math.max(8 * Math.min(Math.abs(a), Math.abs(b)), Math.abs(b - a)) > curved) continue;
        const xa = p[3] - e[j] * p[4], xb = q[3] - e[j] * q[4];
        const from = Math.max(Math.min(xa, xb) - h * x1, -1e300);
        const to = Math.min(Math.max(xa, xb) + h * x1, 1e300);
        if (from > high || to < low) continue;
        const crosses = !first && a < 0 !== b < 0, one = crosses && Math.abs(b - a) > curved;
        const share = a / (a - b);
        const off = 0.125 * h * h * x2 + (one ? h * x1 * 0.125 * curved / Math.abs(b - a) : 0);
        if (one && off < 0.5 * pixel) out.push([j, xa + share * (xb - xa), b > a ? 2 : -2, off]);
        // Several crossings within a pixel: only what they add up to is seen.
        else if (to - from < pixel) {
          if (crosses) out.push([j, 0.5 * (from + to), b > a ? 2 : -2, 0.5 * (to - from)]);
        } else if (final) {
          lost(j, from, to);
          if (crosses) out.push([j, clamp(0.5 * (from + to), low, high), b > a ? 2 : -2, to - from]);
        } else return false;
      }
      return true;
    };
    const zero = lines.sample(0);
    let p = zero, omega = 0, before = 0, leap = 0;
    while (omega < end && lines.evaluated < samples) {
      // Where nothing crosses in the chart for long, in steps as long as that is certain.
      const long = Math.min(leap, end - omega);
      if (before && (outside(p, lines.over(long), long) || clear(long))) {
        p = lines.sample(omega += long);
        leap *= 2;
        continue;
      }
      leap = Math.max(0.5 * leap, 1 / (A_RADIAN * longest));
      let h = Math.min(end - omega, before ? Math.max(Math.min(grow * omega, 1 / (A_RADIAN * longest), 2 * before),
        1e-3 * start) : start);
      for (let depth = 0; ; depth++) {
        const bounds = lines.over(h), final = depth >= (before ? DEEPEST : 3 * DEEPEST);
        const skip = outside(p, bounds, h), q = lines.sample(omega + h);
        if (skip || read(p, q, bounds, final)) {
          if (!before && Number.isFinite(zero[3]) && zero[5] > 0)
            // A real root at s = 0, by what h is after it.
            for (let j = 0; j < e.length; j++)
              found(j, zero[3] - e[j] * zero[4], Math.sign(q[1] - e[j] * q[2]), 0, zero, zero);
          if (!skip) for (const [j, x, jump, off] of out) found(j, x, jump, off, p, q);
          before = depth ? 0.5 * h : h;
          [p, omega] = [q, q[0]];
          break;
        }
        h *= 0.5;
        lines.base.at(omega);
        lines.m.join(omega);
        lines.o.join(omega);
      }
      // A crossing that was placed has moved the factors away.
      if (lines.base.omega !== omega) lines.sample(omega);
    }
    return omega;
  }

  /* Counts over a grid, and where they are undecided: UNDECIDED. Roots may cross up to the frequency `top`;
   * up to `end` the axis was followed, with at most `samples`. */
  function chart(loop, x0, x1, nx, y0, y1, ny, samples = 3000000) {
    const counts = new Int16Array(nx * ny).fill(UNCONFINED);
    const px = (x1 - x0) / (nx - 1), py = (y1 - y0) / (ny - 1);
    const share = chain(loop);
    // The point that is confined if any is, off every line that a reader would choose.
    let bx, by, base = UNDECIDED;
    for (let k = 0; k < 5 && (k === 0 || base === BOUNDARY); k++) {
      bx = clamp(0, x0, x1) + (x1 > 0 ? 1 : -1) * (0.381966 + k) * px;
      by = clamp(0, y0, y1) + (y1 > 0 ? 1 : -1) * (0.276393 + k) * py;
      base = count(loop, bx, by, { most: samples });
    }
    const most = [Math.max(Math.abs(x0), Math.abs(x1), Math.abs(bx)),
      Math.max(Math.abs(y0), Math.abs(y1), Math.abs(by))];
    // Next to the limit of the chain, roots cross at ever higher frequency: 2 % of the way to it are left out.
    const limit = 0.98 + 0.02 * share(...[[x0, x1], [y0, y1]].map(ends => Math.abs(clamp(0, ...ends))));
    const reach = share(...most) < 1 ? 1 : limit / share(...most);
    const endOf = part => tail(loop, part * most[0], part * most[1]).omega;
    let top = endOf(reach), end = top;
    // Where no chain is confined at this point, none is in the whole chart: that is certain.
    if (base < 0) return base === UNCONFINED ? { counts, sure: 1 } : { counts: counts.fill(UNDECIDED), sure: 0, top, end: 0 };
    const starts = new Int32Array(ny).fill(base), doubtful = new Uint8Array(ny);
    if (loop.second || loop.difference.gain) {
      const change = new Int32Array(ny + 1), lines = new Lines(loop, true);
      let total = base;
      const came = crossings(lines, [bx - 1], Math.min(y0, by) - 1, Math.max(y1, by) - 1, py, end, samples,
        (_, rough, jump, off, p, q) => {
          const y = p === q ? rough : lines.placed(bx - 1, p, q);
          if (y < by - 1) total -= jump;
          const k = (y - (y0 - 1)) / py, near = Math.round(k);
          if (k <= ny) change[clamp(Math.ceil(k), 0, ny)] += jump;
          if (Math.abs(k - near) < 1e-6 && near >= 0 && near < ny) doubtful[near] = 1;
        },
        (_, from, to) => {
          for (let j = 0; j < ny; j++)
            if (j * py + y0 - 1 > from - py && j * py + y0 - 1 < to + py) doubtful[j] = 1;
        });
      for (let j = 0; j < ny; j++) starts[j] = total += change[j];
      end = Math.min(end, came);
    }
    // Changes of the count, and of how much is doubtful, at each pixel of each row.
    const wide = nx + 1, change = new Int32Array(wide * ny), marks = new Int32Array(wide * ny);
    const lines = new Lines(loop, false), rows = Float64Array.from({ length: ny }, (_, j) => y0 - 1 + j * py);
    const mark = (j, from, to) => {
      const first = clamp(Math.floor((from - x0 + 1) / px), 0, nx);
      const last = clamp(Math.ceil((to - x0 + 1) / px) + 1, 0, nx);
      marks[j * wide + first]++;
      marks[j * wide + last]--;
    };
    const came = crossings(lines, rows, Math.min(x0, bx) - 1, Math.max(x1, bx) - 1, px, end, samples,
      (j, rough, jump, off, p, q) => {
        // What is next to the begin decides where a whole row starts.
        const close = p !== q && Math.abs(rough - bx + 1) < 4 * px + 2 * off;
        const x = close ? lines.placed(rows[j], p, q) : rough;
        if (x < bx - 1) starts[j] -= jump;
        const k = Math.ceil((x - x0 + 1) / px);
        if (k <= nx) change[j * wide + Math.max(k, 0)] += jump;
      }, mark);
    end = Math.min(end, came);
    // Where roots may cross at higher frequency than was looked at.
    let seen = reach;
    for (let k = 0; k < 40 && seen > 1e-3 && endOf(seen) > end; k++) seen *= 0.95;
    if (endOf(seen) > end * (1 + 1e-9)) seen = 0;
    let sure = 0;
    for (let j = 0; j < ny; j++) {
      const y = y0 + j * py;
      for (let i = 0, total = starts[j], doubts = 0; i < nx; i++) {
        const x = x0 + i * px, taken = share(x, y);
        total += change[j * wide + i];
        doubts += marks[j * wide + i];
        const beyond = seen < reach && Math.max(Math.abs(x) / most[0], Math.abs(y) / most[1]) > seen
          || reach < 1 && taken > limit;
        counts[j * nx + i] = taken >= LOST ? UNCONFINED
          : beyond || doubts || doubtful[j] || total < 0 ? UNDECIDED : Math.min(total, 30000);
        sure += counts[j * nx + i] !== UNDECIDED;
      }
    }
    return { counts, sure: sure / (nx * ny), top, end };
  }

  /* Where a root is on the axis at s = j omega: [c1, c2, omega]. */
  function crossing(loop, omega, lines = new Lines(loop, false)) {
    const { base, m, o } = lines;
    lines.sample(omega);
    const nr = base.vr, ni = base.vi, cross = m.lr * o.li - m.li * o.lr;
    return [1 - (nr * o.li - ni * o.lr) / cross, 1 - (m.lr * ni - m.li * nr) / cross, omega];
  }

  /* The D-curve in a window: [c1, c2, omega, ...], nan between parts, and the line of s = 0 as
   * [a, b, c] with a (c1 - 1) + b (c2 - 1) = c, or null. For a picture: cut to a few pixels. */
  function dcurve(loop, x0, x1, y0, y1, most = 20000) {
    const lines = new Lines(loop, false), found = [], spot = omega => crossing(loop, omega, lines);
    const wide = x1 - x0, high = y1 - y0, { longest } = loop;
    const seen = ([x, y], [u, v], room) => Math.max(x, u) > x0 - room * wide
      && Math.min(x, u) < x1 + room * wide && Math.max(y, v) > y0 - room * high
      && Math.min(y, v) < y1 + room * high;
    // Far from the window it is followed where it may pass: within half a chord of the chord.
    const put = (p, q, depth) => {
      const long = Math.max(Math.abs(q[0] - p[0]) / wide, Math.abs(q[1] - p[1]) / high);
      if (depth < 40 && long > 0.01 && lines.evaluated < most && seen(p, q, 0.5 * long + 0.1)) {
        const middle = spot(0.5 * (p[2] + q[2]));
        put(p, middle, depth + 1);
        put(middle, q, depth + 1);
      } else if (long < 0.5 && seen(p, q, 0.05)) {
        found.push(...q);
      } else if (found.length && !Number.isNaN(found[found.length - 1])) {
        found.push(NaN, NaN, NaN);
      }
    };
    const corner = [Math.max(Math.abs(x0), Math.abs(x1)), Math.max(Math.abs(y0), Math.abs(y1))];
    const end = Math.min(tail(loop, ...corner).omega, 400 * 2 * Math.PI / longest);
    const lowest = 1e-2 * Math.min(...loop.scales);
    let p = spot(lowest);
    for (let omega = lowest; omega < end && lines.evaluated < most;) {
      omega = Math.min(omega * 10 ** (1 / 40), omega + 1 / (4 * longest));
      const q = spot(omega);
      put(p, q, 0);
      p = q;
    }
    lines.sample(0);
    const { base, m, o } = lines, line = [-m.lr, -o.lr, base.vr];
    return { curve: Float64Array.from(found), line: line[0] || line[1] ? line : null };
  }

  return { chart, crossing, dcurve };
}
