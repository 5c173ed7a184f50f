"use strict";
/*
 * Arm-locking loops in a browser: factors, bounds over a step, certified counts of unstable roots.
 *
 * A loop is D(s) = R + exp(-s delay) [B1 (1 - c1 E1) + B2 (1 - c2 E2)], E1 = exp(-s tau1).
 * Everything is kept as factors and divided by a polynomial Q of R's degree whose roots are
 * negative: F = D / Q. It has the unstable roots of D, no poles beside them, and stays bounded,
 * so that their number is minus the argument that F gathers from s = 0 to j infinity, over pi.
 *
 * One function holds all, so that a page can hand its text to a worker: a page that is opened
 * from disk may load no script into one. So do those of the other files here: margins.js and
 * chart.js take what this one returns.
 */
function armlockLoop() {
  const EPSILON = 2 ** -52;
  const BOUNDARY = -1, UNCONFINED = -2, UNDECIDED = -3;
  // Share of a certified bound that a step may use up, and the most steps of one walk.
  const SAFETY = 0.95, MOST_STEPS = 400000;
  // Samples of the frequency in a radian of the longest delay, in a decade, and at most.
  const A_RADIAN = 12, A_DECADE = 80, MOST_SAMPLES = 60000;
  // The share of its room from which on a chain counts as lost: 1, less what rounding leaves.
  const LOST = 1 - 1e-14;
  const SENSORS = ["single", "common", "difference", "dual", "modified"];
  // Zeros of the modified sensor's sum times the mean delay: the roots of
  // x^6 + 5 pi x^5 + 6.5 (x + 10 pi / 13) (x + 7/5) (x + 11/20) (x + pi / 45)^2.
  const SUM = [[-20.89506391392525, 0], [-0.4209560284110969, 0], [-0.07155303833923905, 0], [-0.06827392782369161, 0],
    [-0.37605817972484534, 1.109269369420754], [-0.37605817972484534, -1.109269369420754]];

  /* gain prod (s - zero_k) / prod (s + below_k), all below_k > 0, as a function of omega.
   *
   * A factor is f = (s - z) / (s + a). On the axis |f'| = |z + a| / |s + a|^2 and
   * |f''| = 2 |z + a| / |s + a|^3 fall with omega, so that their values at the start of a step
   * bound them over the step. */
  class Product {
    constructor(gain, zeros, below) {
      const kept = [];
      const free = [...below];
      // Each zero above the pole that is nearest to it in size: then no factor is large.
      for (const zero of [...zeros].sort((p, q) => Math.hypot(...q) - Math.hypot(...p))) {
        const size = Math.log(Math.hypot(...zero) + 1e-300);
        const far = free.map(a => Math.abs(Math.log(a) - size));
        const a = free.splice(far.indexOf(Math.min(...far)), 1)[0];
        if (zero[1] !== 0 || zero[0] !== -a) kept.push([...zero, a, 1]);
      }
      for (const a of free) kept.push([0, 0, a, 0]);
      const column = read => Float64Array.from(kept, read);
      this.gain = gain;
      this.size = kept.length;
      [this.re, this.im, this.a, this.paired] = [0, 1, 2, 3].map(k => column(row => row[k]));
      this.lead = column(([x, y, a, paired]) => paired ? Math.hypot(x + a, y) : 1);
      this.cap = column(([x, y, a, paired]) =>
        paired ? Math.sqrt(1 + (x * x + y * y) / (a * a)) : 1 / a);
      [this.f0, this.f1, this.f2] = [0, 1, 2].map(() => new Float64Array(kept.length));
      this.relative = kept.length + 1;
    }

    /* Value (vr, vi) and derivative (dr, di) at s = j omega; at s = j / t as a function of t with
     * omega = 1, to look at the far end of the axis: its value and bounds of its first derivative. */
    at(omega, t = 1) {
      let vr = this.gain, vi = 0, dr = 0, di = 0;
      for (let k = 0; k < this.size; k++) {
        const a = this.a[k], q = 1 / (a * t * a * t + omega * omega);
        const ir = a * t * q, ii = -omega * q;
        let fr = t * ir, fi = t * ii, tr = 0, ti = -1;
        if (this.paired[k]) {
          const nr = -this.re[k] * t, ni = omega - this.im[k] * t;
          fr = nr * ir - ni * ii;
          fi = nr * ii + ni * ir;
          tr = -this.im[k];
          ti = this.re[k] + a;
        }
        const sr = ir * ir - ii * ii, si = 2 * ir * ii;
        const gr = tr * sr - ti * si, gi = tr * si + ti * sr;
        [dr, di] = [dr * fr - di * fi + vr * gr - vi * gi, dr * fi + di * fr + vr * gi + vi * gr];
        [vr, vi] = [vr * fr - vi * fi, vr * fi + vi * fr];
        this.f0[k] = Math.sqrt(fr * fr + fi * fi);
        this.f1[k] = this.lead[k] * q;
        this.f2[k] = 2 * this.lead[k] * q * Math.sqrt(q);
      }
      this.vr = vr; this.vi = vi; this.dr = dr; this.di = di;
    }

    /* Bounds b0, b1, b2 of the value and two derivatives over a step h from there. */
    over(h) {
      let b0 = Math.abs(this.gain), b1 = 0, b2 = 0;
      for (let k = 0; k < this.size; k++) {
        const f1 = this.f1[k], f2 = this.f2[k];
        const f0 = Math.min(this.f0[k] + h * f1, Math.max(this.cap[k], this.f0[k]));
        b2 = b2 * f0 + 2 * b1 * f1 + b0 * f2;
        b1 = b1 * f0 + b0 * f1;
        b0 *= f0;
      }
      this.b0 = b0; this.b1 = b1; this.b2 = b2;
    }
  }

  /* Bad input, with the name of the field that holds it. */
  const wrong = (field, message) => Object.assign(new RangeError(message), { field });

  const isZero = ([re, im]) => re === 0 && im === 0;

  function positive(field, name, value) {
    if (!(value > 0 && Number.isFinite(value)))
      throw wrong(field, `${name} must be a positive number, got ${value}`);
    return value;
  }

  /* The sensor of a loop: the arms' weights are m1 = sum + difference and m2 = second sum -
   * difference, each a gain and zeros over the sensor's poles. Kept so, what nearly cancels
   * between the arms does so before it is rounded. */
  function sensorOf(spec, tau1, tau2) {
    const fraction = (gain, zeros = []) => ({ gain, zeros });
    const plain = { second: 1, sum: fraction(1), difference: fraction(0), poles: [] };
    if (spec.sensor === "single") return { ...plain, second: 0 };
    if (spec.sensor === "common") return plain;
    if (spec.sensor === "difference") return { ...plain, sum: fraction(0), difference: fraction(-1) };
    if (!SENSORS.includes(spec.sensor)) throw new RangeError(`unknown sensor ${spec.sensor}`);
    const corner = positive("corner", "the corner", spec.corner);
    if (!Number.isFinite(spec.difference) || spec.difference === 0)
      throw wrong("difference", "the sensor's \u0394\u03c4 must be a number other than "
        + `zero, got ${spec.difference}`);
    if (spec.sensor === "dual")
      return { ...plain, sum: fraction(1, [[0, 0], [-corner, 0]]),
        difference: fraction(corner / spec.difference), poles: [[0, 0], [-corner, 0]] };
    // The white paper's: common arm at low frequency, dual arm in the band.
    const mean = 0.5 * (tau1 + tau2), pb = 5 * Math.PI / mean;
    const pe = 2 * Math.PI / (90 * mean), fast = [7 / (5 * mean), 11 / (20 * mean), pe, pe];
    const real = a => [-a, 0], plusZeros = SUM.map(root => root.map(v => v / mean));
    return { ...plain, poles: [[0, 0], ...[pb, ...fast, corner].map(real)],
      sum: fraction(1, [...plusZeros, real(corner)]),
      difference: fraction(2 * corner / spec.difference,
        [[0, 0], [0, 0], [0, 0], [0, 0], real(pb)]) };
  }

  /* Make a loop. With sigma its roots are those of D less sigma, to count right of a line.
   *
   * spec: sensor, tau1, tau2, delay in s; zeros and poles as pairs [re, im] in rad/s, gain; for
   * the dual sensors corner in rad/s and difference in s. */
  function make(spec, sigma = 0) {
    const tau1 = positive("tau1", "\u03c4\u2081", spec.tau1);
    const tau2 = positive("tau2", "\u03c4\u2082", spec.tau2);
    const delay = spec.delay || 0;
    if (!(delay >= 0 && Number.isFinite(delay)))
      throw wrong("delay", `the dead time must be zero or positive, got ${spec.delay}`);
    if (!Number.isFinite(spec.gain) || spec.gain === 0)
      throw wrong("gain", `the gain must be a number other than zero, got ${spec.gain}`);
    const sensor = sensorOf(spec, tau1, tau2);
    const zeros = [...spec.zeros], poles = [...spec.poles], ends = [...sensor.poles];
    if (zeros.length > poles.length)
      throw wrong("zeros", "the controller must have as many poles as zeros or more, got "
        + `${zeros.length} zeros and ${poles.length} poles`);
    const has = list => list.some(isZero), drop = list => list.splice(list.findIndex(isZero), 1);
    // Zeros and poles at s = 0 cancel. One factor of Q then belongs to the other product.
    while (has(zeros) && has(poles)) { drop(zeros); drop(poles); }
    let lent = 0;
    while (has(zeros) && has(ends)) { drop(zeros); drop(ends); lent++; }
    const shifted = ([re, im]) => [re - sigma, im];
    // Roots of Q: where a pole is stable and real, the pole itself.
    const mirror = ([re, im]) => Math.hypot(re, im) || 1 / Math.max(tau1, tau2);
    const above = [...poles, ...ends].map(shifted), all = above.map(mirror);
    const own = all.slice(0, poles.length), theirs = all.slice(poles.length);
    for (; lent > 0; lent--) theirs.push(...own.splice(own.indexOf(Math.min(...own)), 1));
    const gain = spec.gain * Math.exp(-sigma * delay);
    const part = ({ gain, zeros }) => new Product(gain, zeros.map(shifted), theirs);
    const loop = { spec, sigma, tau1, tau2, delay, second: sensor.second, below: all,
      rest: new Product(1, above, all), common: new Product(gain, zeros.map(shifted), own),
      sum: part(sensor.sum), difference: part(sensor.difference),
      longest: Math.max(tau1, tau2) + delay,
      phase: { omega: NaN, x1: 0, y1: 0, x2: 0, y2: 0, er: 0, ei: 0, fr: 1, fi: 0 } };
    loop.parts = [loop.rest, loop.common, loop.sum, loop.difference];
    loop.scales = [1 / loop.longest,
      ...loop.parts.flatMap(part => [...part.a, ...part.re].map(Math.abs))].filter(a => a > 0);
    return loop;
  }

  /* Whether L is zero at all frequencies: the difference of equal arms. */
  const silent = ({ sensor, tau1, tau2 }, c1, c2) => sensor === "difference" && tau1 === tau2 && c1 === c2;

  /* Where equal arms return the same, the dual sensor has only their sum. Its integrator then cancels and
   * goes. Its corner cancels as well, but s = -corner stays a root of the closed loop: as in the package
   * only common roots at s = 0 are left out. */
  function reduced(loop, c1, c2) {
    const { spec, tau1, tau2, sigma } = loop, corner = [-spec.corner, 0];
    // Roots of R at s = 0 are not the loop's: they go to the left.
    if (silent(spec, c1, c2)) return make({ ...spec, poles: spec.poles.map(p => isZero(p) ? [-1 / tau1, 0] : p) }, sigma);
    if (spec.sensor !== "dual" || tau1 !== tau2 || c1 !== c2) return loop;
    const zeros = [...spec.zeros, corner], poles = [...spec.poles, corner];
    return make({ ...spec, sensor: "common", zeros, poles }, sigma);
  }

  /* The parameters of one point, with what is left of 1 - c and c2 - c1 after cancelling. */
  function at(loop, c1, c2) {
    const { sigma, tau1, tau2 } = loop;
    const g1 = Math.exp(-sigma * tau1), g2 = Math.exp(-sigma * tau2);
    return {
      c1: c1 * g1, c2: c2 * g2,
      left1: (1 - c1) - c1 * Math.expm1(-sigma * tau1),
      left2: (1 - c2) - c2 * Math.expm1(-sigma * tau2),
      between: (c2 - c1) * g1 - c2 * g2 * Math.expm1(-sigma * (tau1 - tau2)),
    };
  }

  /* The parameters at (1 + x, 1 + y), as far from (1, 1) as x and y say without rounding. */
  function beside(x, y) {
    return { c1: 1 + x, c2: 1 + y, left1: -x, left2: -y, between: y - x };
  }

  /* Minus what F loses where (c1, c2) moves by (d1, d2): the same terms, without R. */
  function along(d1, d2) {
    return { c1: d1, c2: d2, left1: -d1, left2: -d2, between: d2 - d1 };
  }

  /* exp(-s tau) - 1 of both arms, so that nothing cancels where omega is small, 1 - exp(-s (tau1 - tau2)),
   * and the dead time's exponential: once for all curves of a loop. */
  function phases({ phase, tau1, tau2, delay }, omega) {
    if (phase.omega === omega) return phase;
    phase.omega = omega;
    const s1 = Math.sin(0.5 * omega * tau1), s2 = Math.sin(0.5 * omega * tau2);
    phase.x1 = -2 * s1 * s1;
    phase.y1 = -2 * s1 * Math.cos(0.5 * omega * tau1);
    phase.x2 = -2 * s2 * s2;
    phase.y2 = -2 * s2 * Math.cos(0.5 * omega * tau2);
    const half = 0.5 * omega * (tau1 - tau2), s = Math.sin(half);
    phase.er = 2 * s * s;
    phase.ei = 2 * s * Math.cos(half);
    if (delay) [phase.fr, phase.fi] = [Math.cos(omega * delay), -Math.sin(omega * delay)];
    return phase;
  }

  /* F along the axis at one point: value and derivative, and bounds over a step. */
  class Curve {
    constructor(loop, point) {
      this.loop = loop;
      this.point = point;
      // What the terms of the parameters are rounded by, in units of EPSILON. They may cancel in `at`.
      const { sigma, tau1, tau2, second } = loop, { c1, c2, left1, left2, between } = point;
      const size = (left, c, tau) => Math.abs(left) + 2 * Math.abs(c) * Math.expm1(Math.abs(sigma * tau));
      this.rsum = size(left1, c1, tau1) + second * size(left2, c2, tau2);
      this.rdifference = size(between, c2, tau1 - tau2);
    }

    at(omega) {
      for (const part of this.loop.parts) part.at(omega);
      this.join(omega);
    }

    /* Put together what the loop's factors are at omega. */
    join(omega) {
      const { rest, common, sum, difference, tau1, tau2, delay, second } = this.loop;
      const { c1, c2, left1, left2, between } = this.point;
      const { x1, y1, x2, y2, er, ei, fr, fi } = phases(this.loop, omega);
      this.omega = omega;
      // d(1 - c E)/d omega = j c tau E
      const p1r = -c1 * tau1 * y1, p1i = c1 * tau1 * (1 + x1);
      const p2r = -c2 * tau2 * y2, p2i = c2 * tau2 * (1 + x2);
      const wr = left1 - c1 * x1 + second * (left2 - c2 * x2);
      const wi = -c1 * y1 - second * c2 * y2;
      const tr = p1r + second * p2r, ti = p1i + second * p2i;
      this.wsum = Math.sqrt(wr * wr + wi * wi);
      // c2 E2 - c1 E1 = (c2 - c1) E1 + c2 E2 (1 - exp(-s (tau1 - tau2)))
      const ur = between * (1 + x1) + c2 * ((1 + x2) * er - y2 * ei);
      const ui = between * y1 + c2 * ((1 + x2) * ei + y2 * er);
      const qr = p1r - p2r, qi = p1i - p2i;
      this.wdifference = Math.sqrt(ur * ur + ui * ui);
      let vr = sum.vr * wr - sum.vi * wi + difference.vr * ur - difference.vi * ui;
      let vi = sum.vr * wi + sum.vi * wr + difference.vr * ui + difference.vi * ur;
      let dr = sum.dr * wr - sum.di * wi + sum.vr * tr - sum.vi * ti
        + difference.dr * ur - difference.di * ui + difference.vr * qr - difference.vi * qi;
      let di = sum.dr * wi + sum.di * wr + sum.vr * ti + sum.vi * tr
        + difference.dr * ui + difference.di * ur + difference.vr * qi + difference.vi * qr;
      [dr, di] = [common.dr * vr - common.di * vi + common.vr * dr - common.vi * di,
        common.dr * vi + common.di * vr + common.vr * di + common.vi * dr];
      [vr, vi] = [common.vr * vr - common.vi * vi, common.vr * vi + common.vi * vr];
      if (delay) {
        [dr, di] = [dr + delay * vi, di - delay * vr];
        [dr, di] = [dr * fr - di * fi, dr * fi + di * fr];
        [vr, vi] = [vr * fr - vi * fi, vr * fi + vi * fr];
      }
      // The open loop is L = (lr + j li) / rest.
      this.lr = vr; this.li = vi;
      this.mr = dr; this.mi = di;
      this.vr = rest.vr + vr; this.vi = rest.vi + vi;
      this.dr = rest.dr + dr; this.di = rest.di + di;
    }

    /* Bounds of |F''| and of the rounding error over a step. */
    over(h) {
      for (const part of this.loop.parts) part.over(h);
      this.reach(h);
    }

    /* The same from bounds of the loop's factors; l0, l1, l2 bound L's numerator. */
    reach(h) {
      const { rest, common, sum, difference, tau1, tau2, delay, second } = this.loop;
      const { c1, c2, between } = this.point;
      const end = this.omega + h, a1 = Math.abs(c1), a2 = Math.abs(c2);
      const w1 = a1 * tau1 + second * a2 * tau2, w0 = this.wsum + h * w1;
      const w2 = a1 * tau1 * tau1 + second * a2 * tau2 * tau2;
      const apart = Math.abs(tau1 - tau2), e = Math.abs(between), x = Math.min(end * apart, 2);
      const u1 = e * tau1 + a2 * (apart + tau2 * x), u0 = this.wdifference + h * u1;
      const u2 = e * tau1 * tau1 + a2 * (apart * apart + 2 * tau2 * apart + tau2 * tau2 * x);
      const i0 = sum.b0 * w0 + difference.b0 * u0;
      let i1 = sum.b1 * w0 + sum.b0 * w1 + difference.b1 * u0 + difference.b0 * u1;
      let i2 = sum.b2 * w0 + 2 * sum.b1 * w1 + sum.b0 * w2
        + difference.b2 * u0 + 2 * difference.b1 * u1 + difference.b0 * u2;
      // A phase is rounded as well, relative to itself.
      const turned = 1 + end * (tau1 + tau2);
      const error = sum.b0 * (sum.relative * w0 + this.rsum + end * w1)
        + difference.b0 * (difference.relative * u0 + (this.rdifference + a2 * x) * turned);
      i2 += delay * (2 * i1 + delay * i0);
      i1 += delay * i0;
      this.l0 = common.b0 * i0;
      this.l1 = common.b1 * i0 + common.b0 * i1;
      this.l2 = common.b2 * i0 + 2 * common.b1 * i1 + common.b0 * i2;
      this.bend = rest.b2 + this.l2;
      const phase = 1 + end * delay;
      this.error = EPSILON * (4 * rest.relative * rest.b0
        + common.b0 * 4 * (error + (common.relative + phase) * i0));
    }
  }

  /* The disc that L fills with free phases of the arms, with c1 and c2 between two points: what
   * they add up to is convex, and so largest at one of the two. */
  class Disc {
    constructor(loop, ...points) {
      this.loop = loop;
      this.points = points.map(([c1, c2]) => [Math.abs(c1), Math.abs(c2)]);
    }

    most(one, two) { return Math.max(...this.points.map(([a1, a2]) => a1 * one + a2 * two)); }

    /* From the loop's factors at omega; at infinity and down from it, omega is null. */
    look(omega) {
      const { rest, common, sum, difference, second, delay } = this.loop;
      const { vr: sr, vi: si } = sum, { vr: tr, vi: ti } = difference;
      let cr = (1 + second) * (common.vr * sr - common.vi * si);
      let ci = (1 + second) * (common.vr * si + common.vi * sr);
      const k = Math.hypot(common.vr, common.vi);
      this.radius = k * this.most(Math.hypot(sr + tr, si + ti),
        Math.hypot(second * sr - tr, second * si - ti));
      this.turning = delay;
      if (delay && omega === null) {
        // So far up the dead time's phase is as free as the arms'.
        this.radius += Math.hypot(cr, ci);
        cr = ci = this.turning = 0;
      } else if (delay) {
        const er = Math.cos(omega * delay), ei = -Math.sin(omega * delay);
        [cr, ci] = [cr * er - ci * ei, cr * ei + ci * er];
      }
      const square = rest.vr * rest.vr + rest.vi * rest.vi;
      this.size = Math.sqrt(square);
      this.re = (cr * rest.vr + ci * rest.vi) / square;
      this.im = (ci * rest.vr - cr * rest.vi) / square;
      this.free = delay !== 0 && omega === null;
    }

    /* Radius of a disc around the same centre that holds those of the whole step. */
    over(h) {
      const { rest, common, sum, difference, second } = this.loop;
      const { b0: s0, b1: s1 } = sum, { b0: t0, b1: t1 } = difference;
      const least = this.size - h * rest.b1, size = Math.hypot(this.re, this.im);
      if (!(least > 0)) return Infinity;
      const centre = (1 + second)
        * (common.b0 * s1 + common.b1 * s0 + this.turning * common.b0 * s0);
      const arms = (this.free ? centre : 0)
        + this.most(common.b0 * (s1 + t1) + common.b1 * (s0 + t0),
          common.b0 * (second * s1 + t1) + common.b1 * (second * s0 + t0));
      const moved = h * ((this.free ? 0 : centre) + size * rest.b1) / least;
      return ((this.radius + h * arms) / least + moved) * (1 + 1e-12) + 1e-12 * (1 + size);
    }
  }

  /* The frequency past which a disc stays clear of what would be smaller; infinity where that
   * is not so at infinity itself. `visit` hears of each place, from infinity down. */
  function clearFrom(disc, clear, visit = () => {}) {
    const { loop: { parts, longest } } = disc;
    for (let t = 0, h = longest, k = 0; ; t += h, h *= 2, k++) {
      for (const part of parts) part.at(1, t);
      disc.look(null);
      visit();
      if (k === 300 || t >= 2 * longest) return 1 / t;
      for (;; h *= 0.5) {
        for (const part of parts) part.over(h);
        if (clear(disc.re, disc.im, disc.over(h))) break;
        if (h < Math.max(0.005 * t, 1e-13 * longest)) return t ? 1 / t : Infinity;
      }
    }
  }
  /* The frequency past which no root crosses the axis, whatever the arms' phases are, and the argument
   * that R (1 + L) gathers from infinity to it with L at the middle of its disc. */
  function tail(loop, c1, c2) {
    const { rest } = loop, disc = new Disc(loop, [c1, c2]), end = { omega: 0, argument: 0, ar: 0, ai: 0 };
    end.omega = clearFrom(disc, (re, im, radius) => Math.hypot(1 + re, im) > radius, () => {
      const ar = rest.vr * (1 + disc.re) - rest.vi * disc.im, ai = rest.vi * (1 + disc.re) + rest.vr * disc.im;
      end.argument += Math.atan2(ai * end.ar - ar * end.ai, ar * end.ar + ai * end.ai);
      [end.ar, end.ai] = [ar, ai];
    });
    return end;
  }

  /* Distance of the tangent from zero over a step. */
  function tangentDistance(vr, vi, dr, di, step) {
    const speed = dr * dr + di * di, approach = -(vr * dr + vi * di);
    const place = approach <= 0 ? 0 : approach >= speed * step ? step : approach / speed;
    return Math.hypot(vr + place * dr, vi + place * di);
  }

  /* Number of unstable roots at (c1, c2); BOUNDARY where one is on the axis as far as rounding
   * can tell, UNCONFINED where the neutral root chain is not confined, UNDECIDED where it would
   * take too many steps.
   *
   * A root at s = 0 is left out where numerator and denominator of L both vanish there: it comes
   * from clearing the denominator, and 1 + L does not have it. F then begins as its derivative
   * does. Whether they vanish is decided by the point as it is given: `exact` may tell it from
   * (1, 1). */
  function count(loop, c1, c2, { most = MOST_STEPS, exact = null } = {}) {
    const point = exact || at(loop, c1, c2);
    if (point.between === 0) loop = reduced(loop, c1, c2);
    if (chain(loop)(point.c1, point.c2) >= LOST) return UNCONFINED;
    const end = tail(loop, point.c1, point.c2), curve = new Curve(loop, point);
    if (end.omega === Infinity) return UNDECIDED;
    let omega = 0, argument = 0, step = end.omega;
    curve.at(0);
    curve.over(0);
    if (Math.hypot(curve.vr, curve.vi) <= curve.error) {
      if (!vanishes(curve)) return BOUNDARY;
      // |F - j omega F'(0)| is at most |F'(0)| omega / 2 there: F turns by 30 degrees at most.
      const slope = Math.hypot(curve.dr, curve.di);
      do step *= 0.5, curve.over(step); while (curve.bend * step > slope && step > 1e-300);
      if (!(slope > 0) || step <= 1e-300) return UNDECIDED;
      const { dr, di } = curve;
      curve.at(omega = step);
      argument = Math.atan2(curve.vi * dr - curve.vr * di, curve.vr * dr + curve.vi * di);
      // A quarter turn around the root, which is left of the path.
      if (!(Math.abs(argument) < 0.6)) return UNDECIDED;
      argument += 0.5 * Math.PI;
    }
    const { rest, parts, longest } = loop, disc = new Disc(loop, [point.c1, point.c2]);
    for (let steps = 0, leap = 0; omega < end.omega; steps++) {
      if (steps > most) return UNDECIDED;
      const { vr, vi, dr, di } = curve;
      // Where 1 + L stays in a disc without 0, whatever the arms' phases are, and R turns by less than 90
      // degrees, both turn along the shorter way.
      if (leap) {
        const h = Math.min(leap, end.omega - omega), { vr: rr, vi: ri } = rest;
        disc.look(omega);
        for (const part of parts) part.over(h);
        if (Math.hypot(1 + disc.re, disc.im) > disc.over(h)) {
          curve.at(omega = h < leap ? end.omega : omega + h);
          const [ur, ui] = [rest.vr * rr + rest.vi * ri, rest.vi * rr - rest.vr * ri];
          const [wr, wi] = [curve.vr * vr + curve.vi * vi, curve.vi * vr - curve.vr * vi];
          argument += Math.atan2(ui, ur) + Math.atan2(wi * ur - wr * ui, wr * ur + wi * ui);
          leap *= 2;
          continue;
        }
      }
      leap = Math.max(0.5 * leap, 1 / longest);
      step = Math.min(4 * step, end.omega - omega);
      for (;;) {
        curve.over(step);
        const apart = 0.5 * curve.bend * step * step + curve.error;
        if (apart <= SAFETY * tangentDistance(vr, vi, dr, di, step)) break;
        step *= 0.5;
        if (step <= 4 * EPSILON * omega || step < 1e-300) return BOUNDARY;
      }
      const following = step === end.omega - omega ? end.omega : omega + step;
      const error = curve.error;
      curve.at(following);
      if (Math.hypot(curve.vr, curve.vi) <= error) return BOUNDARY;
      const tr = vr + step * dr, ti = vi + step * di;
      // Along the tangent, then from its end to the curve: both parts are principal.
      argument += Math.atan2(ti * vr - tr * vi, tr * vr + ti * vi)
        + Math.atan2(curve.vi * tr - curve.vr * ti, curve.vr * tr + curve.vi * ti);
      omega = following;
    }
    // From there on D / A stays around 1.
    const last = Math.atan2(curve.vi * end.ar - curve.vr * end.ai,
      curve.vr * end.ar + curve.vi * end.ai);
    const found = (end.argument + last - argument) / Math.PI;
    const nearest = Math.round(found);
    return Math.abs(found - nearest) < 1e-3 && nearest >= 0 ? nearest + 0 : UNDECIDED;
  }

  /* Whether numerator and denominator of L are both zero at s = 0, where a curve is. */
  function vanishes({ lr, li, loop: { rest } }) {
    return lr === 0 && li === 0 && rest.vr === 0 && rest.vi === 0;
  }

  /* Of the room that a neutral root chain has, the share that it takes at (c1, c2): confined below 1. */
  function chain(loop) {
    const { rest, common, sum, difference, second, delay, parts } = loop;
    for (const part of parts) part.at(1, 0);
    const s = common.vr * sum.vr, t = common.vr * difference.vr, both = (1 + second) * s;
    const room = delay ? Math.abs(rest.vr) - Math.abs(both) : Math.abs(rest.vr + both);
    const b1 = Math.abs(s + t), b2 = Math.abs(second * s - t);
    return (c1, c2) => room > 0 ? (Math.abs(c1) * b1 + Math.abs(c2) * b2) / room : Infinity;
  }

  /* The ends [low, high] to which halving shrinks the stretch in which `after` begins to be true. */
  function halved(low, high, after, apart = 1e-15) {
    for (let k = 0; k < 100 && high - low > apart * Math.max(-low, high); k++) {
      const middle = 0.5 * (low + high);
      if (after(middle)) high = middle; else low = middle;
    }
    return [low, high];
  }

  /* Frequencies close enough to draw and to follow D by: in decades, then in turns. Where these would
   * be too many they are farther apart, down to eight in a turn: then the last ones are missing. */
  function frequencies(loop, top, lowest, most = MOST_SAMPLES) {
    const grow = 10 ** (1 / A_DECADE), found = [], apart = top * loop.longest / most;
    const step = Math.min(Math.max(apart, 1 / A_RADIAN), 0.25 * Math.PI) / loop.longest;
    for (let omega = lowest; omega < top && found.length < most;) {
      found.push(omega);
      omega = Math.min(omega * grow, omega + step);
    }
    return Float64Array.from(found);
  }

  /* Frequencies that show the loop at one point, and the roots near the axis. */
  function around(loop, c1, c2, most) {
    const point = at(loop, c1, c2), end = tail(loop, point.c1, point.c2).omega;
    const top = Math.max(end < Infinity ? 3 * end : 0, 20 / loop.longest);
    return frequencies(loop, top, 0.1 * Math.min(...loop.scales), most);
  }

  /* The largest Re s to which the real parts of a neutral root chain tend, for all small changes of the
   * delays; minus infinity without a chain. Where equal arms act against each other it is not looked for. */
  function chainLimit(spec, c1, c2) {
    const lost = sigma => {
      const loop = make(spec, sigma), point = at(loop, c1, c2);
      return chain(loop)(point.c1, point.c2) >= LOST;
    };
    const { difference, second } = make(spec), apart = spec.tau1 !== spec.tau2;
    const low = -50 / Math.max(spec.tau1, spec.tau2);
    if (!lost(low) || lost(0) || !apart && (difference.gain || second * c1 * c2 < 0)) return -Infinity;
    return halved(low, 0, sigma => !lost(sigma), 1e-9)[0];
  }

  /* The rightmost root at (c1, c2), null where counts right and left of it do not confirm it. Lines
   * Re s = low and high have it between them, by counts; Newton's method looks from one of them, at
   * first from few frequencies. The root at s = 0 that `count` leaves out is not the loop's. Where no
   * root lies right of the chain's limit the limit is given, with an infinite frequency. A loop whose L is zero
   * has the poles other than 0, or no root: minus infinity. */
  function rightmost(spec, c1, c2) {
    if (silent(spec, c1, c2)) {
      const [re, im] = spec.poles.filter(p => !isZero(p)).reduce((p, q) => q[0] > p[0] ? q : p, [-Infinity, 0]);
      return [re, Math.abs(im)];
    }
    const loop = reduced(make(spec), c1, c2), curve = new Curve(loop, at(loop, c1, c2));
    ({ spec } = loop);
    let low = chainLimit(spec, c1, c2), high = Infinity, line = 0, step = 1 / Math.max(spec.tau1, spec.tau2);
    curve.at(0);
    const cleared = vanishes(curve);
    const beyond = sigma => {
      const all = count(make(spec, sigma), c1, c2), number = all - (cleared && sigma < 0 && all > 0);
      if (number > 0) low = Math.max(low, sigma); else if (number === 0) high = Math.min(high, sigma);
      return number;
    };
    if (low > -Infinity && beyond((1 - 1e-4) * low) === 0) return [low, Infinity];
    for (let attempt = 0; attempt < 16; attempt++) {
      if (beyond(line) < 0) return null;
      const found = newton(spec, line, c1, c2, attempt ? MOST_SAMPLES : 6000).find(([re, im]) =>
        re > low && re < high && !(cleared && Math.hypot(re, im) < 1e-9 * loop.scales[0]));
      if (found) {
        const [re] = found, margin = 1e-4 * Math.abs(re), right = beyond(re + margin);
        const left = right === 0 ? beyond(re - margin) : 0;
        if (right < 0 || left < 0) return null;
        if (left > 0) return found;
      }
      line = low === -Infinity ? high - step : high === Infinity ? low + step : 0.5 * (low + high);
      step *= 2;
    }
    return null;
  }

  /* The roots that Newton's method reaches from a line Re s = sigma, the rightmost first. */
  function newton(spec, sigma, c1, c2, most) {
    const loop = make(spec, sigma), omega = around(loop, c1, c2, most);
    const curve = new Curve(loop, at(loop, c1, c2)), seeds = [], found = [];
    // ds = -D / D', where D = F Q with Q' / Q = sum 1 / (s + a)
    const step = ({ vr, vi, dr, di, omega, loop: { below } }) => {
      const square = vr * vr + vi * vi;
      if (!square) return [0, 0];
      let re = (di * vr - dr * vi) / square, im = -(dr * vr + di * vi) / square;
      for (const a of below) {
        re += a / (a * a + omega * omega);
        im -= omega / (a * a + omega * omega);
      }
      return [-re / (re * re + im * im), im / (re * re + im * im)];
    };
    let size = [Infinity, Infinity], last = null;
    for (const w of omega) {
      curve.at(w);
      const move = step(curve), length = Math.hypot(...move);
      if (!last) seeds.push([sigma + move[0], w + move[1], length]);
      else if (size[1] <= size[0] && size[1] <= length) seeds.push(last);
      size = [size[1], length];
      last = [sigma + move[0], w + move[1], length];
    }
    // A short step leads to a root near the line.
    seeds.sort((p, q) => p[2] - q[2]);
    for (let [re, im] of seeds.slice(0, 12)) {
      for (let k = 0; k < 40; k++) {
        const there = make(spec, re), point = new Curve(there, at(there, c1, c2));
        point.at(im);
        const [dx, dy] = step(point);
        re += dx;
        im += dy;
        if (!Number.isFinite(re + im)) break;
        if (Math.hypot(dx, dy) <= 1e-7 * Math.abs(re) + 1e-14 * Math.abs(im)) {
          found.push([re, Math.abs(im) < 1e-9 * Math.abs(re) ? 0 : im]);
          break;
        }
      }
    }
    return found.sort((p, q) => q[0] - p[0]);
  }

  return { EPSILON, BOUNDARY, UNCONFINED, UNDECIDED, make, reduced, at, beside, along, Curve, tail,
    LOST, chain, Disc, clearFrom, tangentDistance, vanishes, count, halved, frequencies, rightmost };
}
