"use strict";
/*
 * Arm-locking loops in a browser: certified counts of unstable roots, charts, margins.
 *
 * A loop is D(s) = R + exp(-s delay) [B1 (1 - c1 E1) + B2 (1 - c2 E2)], E1 = exp(-s tau1).
 * Everything is kept as factors and divided by a polynomial Q of R's degree whose roots are
 * negative: F = D / Q. It has the unstable roots of D, no poles beside them, and stays bounded,
 * so that their number is minus the argument that F gathers from s = 0 to j infinity, over pi.
 *
 * One function holds all, so that a page can hand its text to a worker: a page that is opened
 * from disk may load no script into one.
 */
function armlockLoop() {
  const EPSILON = 2 ** -52;
  const BOUNDARY = -1, UNCONFINED = -2, UNSURE = -3;
  // Share of a certified bound that a step may use up, and the most steps of one walk.
  const SAFETY = 0.95, MOST_STEPS = 400000;
  // Samples of the frequency in a radian of the longest delay, in a decade, and at most.
  const A_RADIAN = 12, A_DECADE = 80, MOST_SAMPLES = 60000;

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

    /* Value (vr, vi) and derivative (dr, di) at s = j omega. */
    at(omega) {
      let vr = this.gain, vi = 0, dr = 0, di = 0;
      for (let k = 0; k < this.size; k++) {
        const a = this.a[k], q = 1 / (a * a + omega * omega);
        const ir = a * q, ii = -omega * q;
        let fr = ir, fi = ii, tr = 0, ti = -1;
        if (this.paired[k]) {
          const nr = -this.re[k], ni = omega - this.im[k];
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

    /* The same at s = j / t as a function of t, to look at the far end of the axis. */
    far(t) {
      let vr = this.gain, vi = 0;
      for (let k = 0; k < this.size; k++) {
        const at = this.a[k] * t, q = 1 / (1 + at * at);
        const ir = at * q, ii = -q;
        let fr = t * ir, fi = t * ii;
        if (this.paired[k]) {
          const nr = -this.re[k] * t, ni = 1 - this.im[k] * t;
          fr = nr * ir - ni * ii;
          fi = nr * ii + ni * ir;
        }
        [vr, vi] = [vr * fr - vi * fi, vr * fi + vi * fr];
        this.f0[k] = Math.sqrt(fr * fr + fi * fi);
        this.f1[k] = this.lead[k] * q;
        this.f2[k] = 0;
      }
      this.vr = vr; this.vi = vi;
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

  function positive(name, value) {
    if (!(value > 0 && Number.isFinite(value)))
      throw new RangeError(`${name} must be a positive number, got ${value}`);
    return value;
  }

  function checkedRoots(name, roots) {
    const left = [];
    for (const [re, im] of roots) {
      if (!Number.isFinite(re) || !Number.isFinite(im))
        throw new RangeError(`${name} must be finite numbers`);
      if (im === 0) continue;
      const partner = left.findIndex(([x, y]) => x === re && y === -im);
      if (partner < 0) left.push([re, im]); else left.splice(partner, 1);
    }
    if (left.length)
      throw new RangeError(`${name} must be real or in conjugate pairs, got ${left[0][0]} `
        + `${left[0][1] < 0 ? "-" : "+"} ${Math.abs(left[0][1])}j alone`);
    return roots;
  }

  /* Make a loop. With sigma its roots are those of D less sigma, to count right of a line.
   *
   * spec: sensor ("single", "common", "difference", "dual"), tau1, tau2, delay in s; zeros and
   * poles as pairs [re, im] in rad/s, gain; for the dual sensor corner in rad/s and
   * difference in s. */
  function make(spec, sigma = 0) {
    const tau1 = positive("tau1", spec.tau1), tau2 = positive("tau2", spec.tau2);
    const delay = spec.delay || 0;
    if (!(delay >= 0 && Number.isFinite(delay)))
      throw new RangeError(`dead time must be zero or positive, got ${spec.delay}`);
    if (!Number.isFinite(spec.gain) || spec.gain === 0)
      throw new RangeError(`gain must be a number other than zero, got ${spec.gain}`);
    const zeros = [...checkedRoots("zeros", spec.zeros)];
    const poles = [...checkedRoots("poles", spec.poles)];
    if (zeros.length > poles.length)
      throw new RangeError(`the controller must have as many poles as zeros or more, got `
        + `${zeros.length} zeros and ${poles.length} poles`);
    const isZero = ([re, im]) => re === 0 && im === 0;
    while (zeros.some(isZero) && poles.some(isZero)) {
      zeros.splice(zeros.findIndex(isZero), 1);
      poles.splice(poles.findIndex(isZero), 1);
    }
    const shifted = ([re, im]) => [re - sigma, im];
    // Roots of Q: where a pole is stable and real, the pole itself.
    const mirror = ([re, im]) => Math.hypot(re, im) || 1 / Math.max(tau1, tau2);
    const moved = poles.map(shifted);
    const below = moved.map(mirror);
    const gain = spec.gain * Math.exp(-sigma * delay);
    const loop = { spec, sigma, tau1, tau2, delay, second: spec.sensor === "single" ? 0 : 1,
      sum: null, difference: null };
    if (spec.sensor === "dual") {
      const corner = positive("corner", spec.corner);
      if (!Number.isFinite(spec.difference) || spec.difference === 0)
        throw new RangeError("the sensor's dtau must be a number other than zero, "
          + `got ${spec.difference}`);
      const low = shifted([0, 0]), high = shifted([-corner, 0]);
      const above = [...moved, high], all = [...below, mirror(high)];
      let own, rest = [...below];
      if (zeros.some(isZero)) {
        // The sensor's pole at 0 cancels against a zero of the controller.
        zeros.splice(zeros.findIndex(isZero), 1);
        own = rest.splice(rest.indexOf(Math.min(...rest)), 1)[0];
      } else {
        own = mirror(low);
        above.push(low);
        all.push(own);
      }
      const ends = [own, mirror(high)];
      loop.rest = new Product(1, above, all);
      loop.common = new Product(gain, zeros.map(shifted), rest);
      loop.sum = new Product(1, [low, high], ends);
      loop.difference = new Product(corner / spec.difference, [], ends);
    } else if (["single", "common", "difference"].includes(spec.sensor)) {
      loop.rest = new Product(1, moved, below);
      loop.common = new Product(gain, zeros.map(shifted), below);
      if (spec.sensor === "difference") loop.difference = new Product(-1, [], []);
      else loop.sum = new Product(1, [], []);
    } else {
      throw new RangeError(`unknown sensor ${spec.sensor}`);
    }
    loop.parts = [loop.rest, loop.common, loop.sum, loop.difference].filter(part => part);
    loop.scales = [1 / (Math.max(tau1, tau2) + delay),
      ...loop.parts.flatMap(part => [...part.a, ...part.re].map(Math.abs))].filter(a => a > 0);
    return loop;
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

  /* F along the axis at one point: value and derivative, and bounds over a step. */
  class Curve {
    constructor(loop, point) {
      this.loop = loop;
      this.point = point;
    }

    at(omega) {
      const { rest, common, sum, difference, tau1, tau2, delay, second, parts } = this.loop;
      const { c1, c2, left1, left2, between } = this.point;
      this.omega = omega;
      for (const part of parts) part.at(omega);
      const s1 = Math.sin(0.5 * omega * tau1), k1 = Math.cos(0.5 * omega * tau1);
      const s2 = Math.sin(0.5 * omega * tau2), k2 = Math.cos(0.5 * omega * tau2);
      // E - 1, so that nothing cancels where omega is small.
      const x1 = -2 * s1 * s1, y1 = -2 * s1 * k1, x2 = -2 * s2 * s2, y2 = -2 * s2 * k2;
      let vr = 0, vi = 0, dr = 0, di = 0;
      // d(1 - c E)/d omega = j c tau E
      const p1r = -c1 * tau1 * y1, p1i = c1 * tau1 * (1 + x1);
      const p2r = -c2 * tau2 * y2, p2i = c2 * tau2 * (1 + x2);
      if (sum) {
        const wr = left1 - c1 * x1 + second * (left2 - c2 * x2);
        const wi = -c1 * y1 - second * c2 * y2;
        const tr = p1r + second * p2r, ti = p1i + second * p2i;
        vr = sum.vr * wr - sum.vi * wi;
        vi = sum.vr * wi + sum.vi * wr;
        dr = sum.dr * wr - sum.di * wi + sum.vr * tr - sum.vi * ti;
        di = sum.dr * wi + sum.di * wr + sum.vr * ti + sum.vi * tr;
        this.wsum = Math.sqrt(wr * wr + wi * wi);
      }
      if (difference) {
        // c2 E2 - c1 E1 = (c2 - c1) E1 + c2 E2 (1 - exp(-s (tau1 - tau2)))
        const half = 0.5 * omega * (tau1 - tau2);
        const sh = Math.sin(half), ch = Math.cos(half);
        const er = 2 * sh * sh, ei = 2 * sh * ch;
        const wr = between * (1 + x1) + c2 * ((1 + x2) * er - y2 * ei);
        const wi = between * y1 + c2 * ((1 + x2) * ei + y2 * er);
        const tr = p1r - p2r, ti = p1i - p2i;
        vr += difference.vr * wr - difference.vi * wi;
        vi += difference.vr * wi + difference.vi * wr;
        dr += difference.dr * wr - difference.di * wi + difference.vr * tr - difference.vi * ti;
        di += difference.dr * wi + difference.di * wr + difference.vr * ti + difference.vi * tr;
        this.wdifference = Math.sqrt(wr * wr + wi * wi);
      }
      [dr, di] = [common.dr * vr - common.di * vi + common.vr * dr - common.vi * di,
        common.dr * vi + common.di * vr + common.vr * di + common.vi * dr];
      [vr, vi] = [common.vr * vr - common.vi * vi, common.vr * vi + common.vi * vr];
      if (delay) {
        const er = Math.cos(omega * delay), ei = -Math.sin(omega * delay);
        [dr, di] = [dr + delay * vi, di - delay * vr];
        [dr, di] = [dr * er - di * ei, dr * ei + di * er];
        [vr, vi] = [vr * er - vi * ei, vr * ei + vi * er];
      }
      // The open loop is L = (lr + j li) / rest.
      this.lr = vr; this.li = vi;
      this.vr = rest.vr + vr; this.vi = rest.vi + vi;
      this.dr = rest.dr + dr; this.di = rest.di + di;
    }

    /* Bounds of |F''| and of the rounding error over a step. */
    over(h) {
      const { rest, common, sum, difference, tau1, tau2, delay, second, parts } = this.loop;
      const { c1, c2, between } = this.point;
      const end = this.omega + h, a1 = Math.abs(c1), a2 = Math.abs(c2);
      for (const part of parts) part.over(h);
      let i0 = 0, i1 = 0, i2 = 0, error = 0;
      // The parameters are rounded numbers themselves, and so are the phases.
      const rounded = a1 * (1 + end * tau1) + a2 * (1 + end * tau2);
      if (sum) {
        const w1 = a1 * tau1 + second * a2 * tau2;
        const w2 = a1 * tau1 * tau1 + second * a2 * tau2 * tau2;
        const w0 = this.wsum + h * w1;
        i0 = sum.b0 * w0;
        i1 = sum.b1 * w0 + sum.b0 * w1;
        i2 = sum.b2 * w0 + 2 * sum.b1 * w1 + sum.b0 * w2;
        error = sum.b0 * (sum.relative * w0 + rounded);
      }
      if (difference) {
        const apart = Math.abs(tau1 - tau2), e = Math.abs(between);
        const x = Math.min(end * apart, 2);
        const w1 = e * tau1 + a2 * (apart + tau2 * x);
        const w2 = e * tau1 * tau1 + a2 * (apart * apart + 2 * tau2 * apart + tau2 * tau2 * x);
        const w0 = this.wdifference + h * w1;
        i0 += difference.b0 * w0;
        i1 += difference.b1 * w0 + difference.b0 * w1;
        i2 += difference.b2 * w0 + 2 * difference.b1 * w1 + difference.b0 * w2;
        error += difference.b0 * (difference.relative * w0 + rounded);
      }
      i2 += delay * (2 * i1 + delay * i0);
      i1 += delay * i0;
      this.bend = rest.b2 + common.b2 * i0 + 2 * common.b1 * i1 + common.b0 * i2;
      const phase = 1 + end * delay;
      this.error = EPSILON * (4 * rest.relative * rest.b0
        + common.b0 * 4 * (error + (common.relative + phase) * i0));
    }
  }

  /* Look at A = R + B1 + B2 (with a dead time: R) from omega = infinity down, as long as
   * |A| > |C| + |c1 B1| + |c2 B2| is certain: no root crosses there. Returns the frequency, and
   * the argument that A gathers from infinity to it; null where the chain is not confined. */
  function tail(loop, c1, c2, longest) {
    const { rest, common, sum, difference, second, delay, parts } = loop;
    const a1 = Math.abs(c1), a2 = Math.abs(c2);
    const look = t => {
      for (const part of parts) part.far(t);
      const sr = sum ? sum.vr : 0, si = sum ? sum.vi : 0;
      const tr = difference ? difference.vr : 0, ti = difference ? difference.vi : 0;
      const k = Math.hypot(common.vr, common.vi);
      const cr = (1 + second) * (common.vr * sr - common.vi * si);
      const ci = (1 + second) * (common.vr * si + common.vi * sr);
      const ar = delay ? rest.vr : rest.vr + cr, ai = delay ? rest.vi : rest.vi + ci;
      const others = a1 * k * Math.hypot(sr + tr, si + ti)
        + a2 * k * Math.hypot(second * sr - tr, second * si - ti)
        + (delay ? Math.hypot(cr, ci) : 0);
      return { ar, ai, reserve: Math.hypot(ar, ai) - others, others };
    };
    const rate = h => {
      for (const part of parts) part.over(h);
      const s0 = sum ? sum.b0 : 0, s1 = sum ? sum.b1 : 0;
      const t0 = difference ? difference.b0 : 0, t1 = difference ? difference.b1 : 0;
      const both = (1 + second) * (common.b0 * s1 + common.b1 * s0);
      const arms = common.b0 * ((a1 + second * a2) * s1 + (a1 + a2) * t1)
        + common.b1 * ((a1 + second * a2) * s0 + (a1 + a2) * t0);
      return rest.b1 + both + arms;
    };
    let here = look(0), t = 0, argument = 0;
    const size = Math.hypot(here.ar, here.ai);
    if (!(here.reserve > 16 * EPSILON * size)) return null;
    for (let i = 0; i < 400; i++) {
      let h = SAFETY * here.reserve / rate(0);
      if (!(h < 1e300)) h = 1e300;
      while (rate(h) * h > SAFETY * here.reserve) h *= 0.5;
      const next = look(t + h);
      // Rounding must not decide.
      if (!(next.reserve > 1e-12 * (next.others + size))) break;
      argument += Math.atan2(next.ai * here.ar - next.ar * here.ai,
        next.ar * here.ar + next.ai * here.ai);
      t += h;
      here = next;
      if (h < 0.003 * t || longest > 0 && t > 2 * longest) break;
    }
    return { omega: 1 / t, argument, ar: here.ar, ai: here.ai };
  }

  /* Distance of the tangent from zero over a step. */
  function tangentDistance(vr, vi, dr, di, step) {
    const speed = dr * dr + di * di, approach = -(vr * dr + vi * di);
    const place = approach <= 0 ? 0 : approach >= speed * step ? step : approach / speed;
    return Math.hypot(vr + place * dr, vi + place * di);
  }

  /* Number of unstable roots at (c1, c2); BOUNDARY where one is on the axis as far as rounding
   * can tell, UNCONFINED where the neutral root chain is not confined, UNSURE where it would
   * take too many steps. */
  function count(loop, c1, c2) {
    if (!Number.isFinite(c1) || !Number.isFinite(c2))
      throw new RangeError(`c1 and c2 must be finite numbers, got ${c1} and ${c2}`);
    const point = at(loop, c1, c2);
    const end = tail(loop, point.c1, point.c2, Math.max(loop.tau1, loop.tau2) + loop.delay);
    if (!end) return UNCONFINED;
    const curve = new Curve(loop, point);
    let omega = 0, argument = 0, step = end.omega;
    curve.at(0);
    curve.over(0);
    if (Math.hypot(curve.vr, curve.vi) <= curve.error) return BOUNDARY;
    for (let steps = 0; omega < end.omega; steps++) {
      if (steps > MOST_STEPS) return UNSURE;
      const { vr, vi, dr, di } = curve;
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
    return Math.abs(found - nearest) < 1e-3 && nearest >= 0 ? nearest + 0 : UNSURE;
  }

  /* [a, b1, b2]: the neutral root chain is confined where |c1| b1 + |c2| b2 < a. */
  function chainLeads(loop) {
    const { rest, common, sum, difference, second, delay, parts } = loop;
    for (const part of parts) part.far(0);
    const s = common.vr * (sum ? sum.vr : 0), t = common.vr * (difference ? difference.vr : 0);
    const both = (1 + second) * s;
    return [delay ? Math.abs(rest.vr) - Math.abs(both) : Math.abs(rest.vr + both),
      Math.abs(s + t), Math.abs(second * s - t)];
  }


  /* Frequencies close enough to draw and to follow D by: in decades, then in turns. */
  function frequencies(loop, top, lowest) {
    const grow = 10 ** (1 / A_DECADE);
    const step = 1 / (A_RADIAN * (Math.max(loop.tau1, loop.tau2) + loop.delay));
    const found = [];
    for (let omega = lowest; omega < top && found.length < MOST_SAMPLES;) {
      found.push(omega);
      omega = Math.min(omega * grow, omega + step);
    }
    return Float64Array.from(found);
  }

  /* The three terms of D(j omega) = F - dx M1 - dy M2 around (c1, c2) = (1, 1). */
  function terms(loop, curve, omega) {
    const { common, sum, difference, second, tau1, tau2, delay } = loop;
    curve.at(omega);
    const sr = sum ? sum.vr : 0, si = sum ? sum.vi : 0;
    const tr = difference ? difference.vr : 0, ti = difference ? difference.vi : 0;
    const arm = (r, i, tau) => {
      const er = Math.cos(omega * (tau + delay)), ei = -Math.sin(omega * (tau + delay));
      const br = common.vr * r - common.vi * i, bi = common.vr * i + common.vi * r;
      return [br * er - bi * ei, br * ei + bi * er];
    };
    return [curve.vr, curve.vi, ...arm(sr + tr, si + ti, tau1),
      ...arm(second * sr - tr, second * si - ti, tau2)];
  }

  /* Those terms at sampled frequencies, for |c1|, |c2| up to the given ones. */
  function scan(loop, c1, c2, window) {
    const longest = Math.max(loop.tau1, loop.tau2) + loop.delay;
    const leads = chainLeads(loop), lost = c1 * leads[1] + c2 * leads[2];
    // Next to the limit of the chain, roots cross at ever higher frequency.
    const reach = lost < leads[0] ? 1 : 0.98 * leads[0] / lost;
    const end = tail(loop, reach * c1, reach * c2, longest);
    const lowest = 1e-3 * Math.min(...loop.scales) * Math.min(1, window);
    const omega = frequencies(loop, end ? 1.01 * end.omega : lowest, lowest);
    const curve = new Curve(loop, at(loop, 1, 1));
    const all = Array.from(omega, w => terms(loop, curve, w));
    return { loop, curve, omega, all, reach,
      complete: Boolean(end) && omega.length < MOST_SAMPLES };
  }

  /* D along parallel lines: N - e O - x M with M = a1 M1 + a2 M2, where O belongs to the
   * other parameter. A root is on the axis where h = h0 - e h1 is zero, at x = g0 - e g1. */
  function family(from, a1, a2) {
    const values = (w, [nr, ni, r1, i1, r2, i2]) => {
      const mr = a1 * r1 + a2 * r2, mi = a1 * i1 + a2 * i2, square = mr * mr + mi * mi;
      const or = a1 * r2 + a2 * r1, oi = a1 * i2 + a2 * i1;
      return [w, ni * mr - nr * mi, oi * mr - or * mi,
        (nr * mr + ni * mi) / square, (or * mr + oi * mi) / square];
    };
    const { loop, curve, omega, all } = from;
    const rows = all.map((found, i) => values(omega[i], found));
    const exactly = w => values(w, terms(loop, curve, w));
    // At s = 0 a real root crosses, at a finite x unless M vanishes there.
    const zero = exactly(0);
    return { rows, exactly, zero: Number.isFinite(zero[3]) ? zero : null };
  }

  /* Samples between those of a family, where a crossing may come between low and high for a
   * line e0 <= e <= e1, until it is known to some pixels. Returns columns. */
  function refined(lines, e0, e1, low, high, pixel) {
    const kept = [];
    const between = (p, q, depth) => {
      const below = (p[1] - e0 * p[2] < 0) + (p[1] - e1 * p[2] < 0)
        + (q[1] - e0 * q[2] < 0) + (q[1] - e1 * q[2] < 0);
      const pa = p[3] - e0 * p[4], pb = p[3] - e1 * p[4];
      const qa = q[3] - e0 * q[4], qb = q[3] - e1 * q[4];
      const wide = Math.max(Math.abs(qa - pa), Math.abs(qb - pb));
      if (below > 0 && below < 4 && depth < 50 && wide > 4 * pixel
          && Math.max(pa, pb, qa, qb) + 0.5 * wide > low
          && Math.min(pa, pb, qa, qb) - 0.5 * wide < high) {
        const middle = lines.exactly(0.5 * (p[0] + q[0]));
        between(p, middle, depth + 1);
        between(middle, q, depth + 1);
      } else {
        kept.push(q);
      }
    };
    const { rows } = lines;
    if (rows.length) kept.push(rows[0]);
    for (let i = 1; i < rows.length; i++) between(rows[i - 1], rows[i], 0);
    const columns = [0, 1, 2, 3, 4].map(k => Float64Array.from(kept, row => row[k]));
    return { ...lines, columns };
  }

  /* Calls found(x, change, i) with the change of the count towards larger x at every crossing
   * of a line, i the sample after it. Crossings between two samples that cancel each other are
   * not seen. */
  function crossings(lines, e, found) {
    const [, h0, h1, g0, g1] = lines.columns;
    let h = h0[0] - e * h1[0];
    if (lines.zero && h0.length) found(lines.zero[3] - e * lines.zero[4], Math.sign(h), 0);
    for (let i = 1; i < h0.length; i++) {
      const g = h0[i] - e * h1[i];
      if (h < 0 !== g < 0) {
        const p = g0[i - 1] - e * g1[i - 1], q = g0[i] - e * g1[i];
        found(p + (q - p) * h / (h - g), g > h ? 2 : -2, i);
      }
      h = g;
    }
  }

  /* The crossing before sample i of a line: chords, kept off the ends, and halvings. */
  function placed(lines, i, e = 0) {
    const [omega, h0, h1] = lines.columns;
    if (i === 0) return lines.zero[3] - e * lines.zero[4];
    let [a, ha, b, hb, x] = [omega[i - 1], h0[i - 1] - e * h1[i - 1],
      omega[i], h0[i] - e * h1[i], NaN];
    for (let k = 0; k < 60 && b - a > 1e-15 * b; k++) {
      const share = k % 3 === 2 ? 0.5 : clamp(ha / (ha - hb), 0.01, 0.99), w = a + (b - a) * share;
      const row = lines.exactly(w), h = row[1] - e * row[2];
      x = row[3] - e * row[4];
      if (h === 0) break;
      if (h < 0 === ha < 0) [a, ha] = [w, h]; else [b, hb] = [w, h];
    }
    return x;
  }

  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

  /* Counts over a grid. They start from one certified count, and follow the crossings of
   * sampled frequencies along one column and then along each row. */
  function chart(loop, x0, x1, nx, y0, y1, ny) {
    const counts = new Int16Array(nx * ny).fill(UNCONFINED);
    const px = (x1 - x0) / (nx - 1), py = (y1 - y0) / (ny - 1);
    const largest = (a, b) => Math.max(Math.abs(a), Math.abs(b));
    const from = scan(loop, largest(x0, x1), largest(y0, y1), largest(x1 - x0, y1 - y0));
    // The point that is confined if any is, off every line that a reader would choose.
    let bx, by, base = UNSURE;
    for (let k = 0; k < 5 && (base === UNSURE || base === BOUNDARY); k++) {
      bx = clamp(0, x0, x1) + (x1 > 0 ? 1 : -1) * (0.381966 + k) * px;
      by = clamp(0, y0, y1) + (y1 > 0 ? 1 : -1) * (0.276393 + k) * py;
      base = count(loop, bx, by);
    }
    if (base < 0) return { counts: counts.fill(base), complete: base === UNCONFINED, from };
    const ends = (low, step, n, begin) =>
      [Math.min(low, begin), Math.max(low + (n - 1) * step, begin), step];
    const walk = (lines, e, low, step, n, begin, reach, write) => {
      const change = new Int32Array(n + 1);
      let total = 0;
      crossings(lines, e, (sampled, jump, i) => {
        // What is within reach of the begin decides where a whole line starts.
        const exact = Math.abs(sampled - begin) < reach ? placed(lines, i, e) : NaN;
        const x = Number.isFinite(exact) ? exact : sampled;
        if (x < begin) total -= jump;
        const k = Math.ceil((x - low) / step);
        if (k <= n) change[Math.max(k, 0)] += jump;
      });
      for (let i = 0; i < n; i++) write(i, total += change[i]);
    };
    const starts = new Int32Array(ny).fill(base);
    if (loop.second || loop.difference)
      walk(refined(family(from, 0, 1), bx - 1, bx - 1, ...ends(y0 - 1, py, ny, by - 1)),
        bx - 1, y0 - 1, py, ny, by - 1, Infinity, (j, extra) => { starts[j] = base + extra; });
    const rows = refined(family(from, 1, 0), y0 - 1, y1 - 1, ...ends(x0 - 1, px, nx, bx - 1));
    const leads = chainLeads(loop);
    for (let j = 0; j < ny; j++) {
      const y = y0 + j * py;
      walk(rows, y - 1, x0 - 1, px, nx, bx - 1, 8 * px, (i, extra) => {
        const x = x0 + i * px;
        const share = (Math.abs(x) * leads[1] + Math.abs(y) * leads[2]) / leads[0];
        const n = starts[j] + extra;
        counts[j * nx + i] = share >= 1 - 1e-14 ? UNCONFINED
          : share > 0.98 && from.reach < 1 || n < 0 ? UNSURE : Math.min(n, 30000);
      });
    }
    return { counts, complete: from.complete, from };
  }

  /* The critical perturbation along a ray from (1, 1), from sampled frequencies, then counted for
   * certain on both sides: nan where that fails, infinity where there is none up to |c - 1| = 2.
   * Where the chain is lost first, its limit. */
  function firstBreak(loop, d1, d2) {
    const inside = t => count(loop, 1 + t * d1, 1 + t * d2);
    const begun = count(loop, 1, 1);
    if (begun > 0 || begun < BOUNDARY || begun === BOUNDARY && inside(1e-9) !== 0) return 0;
    const [a, b1, b2] = chainLeads(loop);
    const lost = t => Math.abs(1 + t * d1) * b1 + Math.abs(1 + t * d2) * b2 >= a;
    let [confined, limit] = [0, lost(2) ? 2 : Infinity];
    for (let k = 0; k < 100 && limit < Infinity; k++) {
      const middle = 0.5 * (confined + limit);
      if (lost(middle)) limit = middle; else confined = middle;
    }
    for (const wanted of [1e-5, 1e-2, 2]) {
      const stop = Math.min(wanted, 0.98 * limit);
      const from = scan(loop, 1 + stop * Math.abs(d1), 1 + stop * Math.abs(d2), stop);
      const lines = refined(family(from, d1, d2), 0, 0, 0, stop, 1e-3 * stop);
      let first = Infinity, sample = 0;
      crossings(lines, 0, (x, change, i) => {
        if (x > 1e-14 && x < first) [first, sample] = [x, i];
      });
      if (first <= stop) first = placed(lines, sample);
      if (first <= stop)
        return inside(first * (1 - 1e-6)) === 0 && inside(first * (1 + 1e-6)) !== 0 ? first : NaN;
      if (inside(stop) !== 0) return NaN;
    }
    return limit === Infinity || inside(0.999 * limit) === 0 ? limit : NaN;
  }

  /* Frequencies that show the loop at one point, and the roots near the axis. */
  function around(loop, c1, c2) {
    const longest = Math.max(loop.tau1, loop.tau2) + loop.delay;
    const end = tail(loop, c1, c2, longest);
    const top = Math.max(end ? 3 * end.omega : 0, 20 / longest);
    return frequencies(loop, top, 1e-2 * Math.min(...loop.scales));
  }

  /* The open loop at sampled frequencies: columns omega, Re L, Im L. */
  function response(loop, c1, c2) {
    const omega = around(loop, c1, c2);
    const curve = new Curve(loop, at(loop, c1, c2));
    const re = new Float64Array(omega.length), im = new Float64Array(omega.length);
    for (let i = 0; i < omega.length; i++) [re[i], im[i]] = openLoop(curve, omega[i]);
    return { omega, re, im, curve };
  }

  function openLoop(curve, omega) {
    curve.at(omega);
    const { vr, vi } = curve.loop.rest, square = vr * vr + vi * vi;
    return [(curve.lr * vr + curve.li * vi) / square, (curve.li * vr - curve.lr * vi) / square];
  }

  /* Margins of a stable loop. The gains are counted for certain on both sides (nan where that
   * fails); modulus and phase come from sampled frequencies, polished. */
  function margins(spec, c1, c2) {
    const loop = make(spec), { omega, re, im, curve } = response(loop, c1, c2);
    const zero = (read, a, b) => {
      let low = read(a) < 0;
      for (let k = 0; k < 60 && b - a > 1e-14 * b; k++) {
        const w = 0.5 * (a + b);
        if (read(w) < 0 === low) a = w; else b = w;
      }
      return 0.5 * (a + b);
    };
    const imaginary = w => openLoop(curve, w)[1];
    const excess = w => Math.hypot(...openLoop(curve, w)) - 1;
    const apart = w => { const [x, y] = openLoop(curve, w); return Math.hypot(1 + x, y); };
    const distance = re.map((x, i) => Math.hypot(1 + x, im[i]));
    let lower = 0, upper = Infinity, phase = Infinity, modulus = distance[0];
    for (let i = 1; i < omega.length; i++) {
      if (im[i - 1] < 0 !== im[i] < 0 && (re[i] < 0 || re[i - 1] < 0)) {
        const factor = -1 / openLoop(curve, zero(imaginary, omega[i - 1], omega[i]))[0];
        if (factor > 1) upper = Math.min(upper, factor);
        else if (factor > 0) lower = Math.max(lower, factor);
      }
      const before = Math.hypot(re[i - 1], im[i - 1]), after = Math.hypot(re[i], im[i]);
      if (before < 1 !== after < 1) {
        const [x, y] = openLoop(curve, zero(excess, omega[i - 1], omega[i]));
        phase = Math.min(phase, Math.abs(Math.atan2(-y, -x)));
      }
      modulus = Math.min(modulus, distance[i]);
      if (distance[i] < 2 * modulus && distance[i] <= distance[i - 1]
          && distance[i] <= distance[i + 1]) {
        // The smallest value between the neighbours, by golden sections.
        let a = omega[i - 1], b = omega[i + 1];
        for (let k = 0; k < 30; k++) {
          const p = a + 0.381966 * (b - a), q = b - 0.381966 * (b - a);
          if (apart(p) < apart(q)) b = q; else a = p;
        }
        modulus = Math.min(modulus, apart(0.5 * (a + b)));
      }
    }
    const scaled = factor => count(make({ ...spec, gain: spec.gain * factor }), c1, c2);
    const sides = (factor, inside, outside) =>
      scaled(factor * inside) === 0 && scaled(factor * outside) !== 0 ? factor : NaN;
    if (upper < Infinity) upper = sides(upper, 1 - 1e-6, 1 + 1e-6);
    else if (scaled(1000) !== 0) upper = NaN;
    if (lower > 0) lower = sides(lower, 1 + 1e-6, 1 - 1e-6);
    else if (scaled(0.001) !== 0) lower = NaN;
    return { lower, upper, phase, modulus };
  }

  /* The rightmost root at (c1, c2): Newton's method from along the axis, and counts right and
   * left of what it finds. Null where the counts do not confirm it. */
  function rightmost(spec, c1, c2) {
    let line = 0;
    for (let attempt = 0; attempt < 4; attempt++) {
      const found = newton(spec, line, c1, c2);
      if (!found) return null;
      const [re, im] = found, margin = 1e-4 * Math.abs(re);
      const beyond = count(make(spec, re + margin), c1, c2);
      if (beyond === 0) return count(make(spec, re - margin), c1, c2) > 0 ? [re, im] : null;
      if (beyond < 0) return null;
      line = re + 10 * margin;
    }
    return null;
  }

  /* The rightmost of the roots that Newton's method reaches from a line Re s = sigma. */
  function newton(spec, sigma, c1, c2) {
    const loop = make(spec, sigma), omega = around(loop, c1, c2);
    const curve = new Curve(loop, at(loop, c1, c2)), seeds = [];
    // ds = -D / D' with D' = dD/d(j omega)
    const step = from => {
      const square = from.dr * from.dr + from.di * from.di;
      return [(from.vi * from.dr - from.vr * from.di) / square,
        -(from.vr * from.dr + from.vi * from.di) / square];
    };
    let size = [Infinity, Infinity], last = null;
    for (const w of omega) {
      curve.at(w);
      const move = step(curve), length = Math.hypot(...move);
      if (!last) seeds.push([sigma + move[0], w + move[1]]);
      else if (size[1] <= size[0] && size[1] <= length) seeds.push(last);
      size = [size[1], length];
      last = [sigma + move[0], w + move[1]];
    }
    seeds.sort((p, q) => q[0] - p[0]);
    let best = null;
    for (let [re, im] of seeds.slice(0, 12)) {
      for (let k = 0; k < 40; k++) {
        const there = make(spec, re), point = new Curve(there, at(there, c1, c2));
        point.at(im);
        const [dx, dy] = step(point);
        re += dx;
        im += dy;
        if (!Number.isFinite(re + im)) break;
        if (Math.hypot(dx, dy) <= 1e-7 * Math.abs(re) + 1e-14 * Math.abs(im)) {
          if (!best || re > best[0]) best = [re, Math.abs(im) < 1e-9 * Math.abs(re) ? 0 : im];
          break;
        }
      }
    }
    return best;
  }

  return { BOUNDARY, UNCONFINED, UNSURE, make, count, chart, firstBreak, response, margins,
    rightmost };
}
