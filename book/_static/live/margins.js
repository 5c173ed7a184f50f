"use strict";
/*
 * How far a loop is from instability, certified: margins at a point, and the first break along a
 * ray from (1, 1). No sample decides a number. Each is the smallest value met along a walk of the
 * axis whose every step is certified to hide none that is smaller by more than a part in a
 * thousand; it is nan, "undecided", where the walk takes too long or rounding hides what decides.
 *
 * A step is certified in one of two ways: by the tangents of numerator and denominator, and
 * bounds on what they leave out; or, where the delays turn faster than all else changes, by the
 * disc that L fills over the step whatever the arms' phases are. That disc also tells from which
 * frequency on nothing is smaller.
 */
function armlockMargins(api) {
  const { EPSILON, UNDECIDED, BOUNDARY, make, reduced, at, beside, along, Curve, LOST, chain, Disc, clearFrom,
    vanishes, count, halved } = api;
  // How much smaller than what is shown a number may be, as a share.
  const NEAR = 1e-3;
  // Perturbations up to this, gain factors up to this, steps of one walk and of one count.
  const FARTHEST = 2, LARGEST = [1000, 10], STEPS = 1000000, COUNTED = 4000000, SCOUTED = 100000, TURN = 2 * Math.PI;
  // Of a start on the boundary, crossings up to this share are the start's own.
  const OWN = 1e-10;

  /* Whether |a| > level |b| over a step h, where a0 + a1 x and b0 + b1 x are off by da and db. */
  function exceeds(ar, ai, sr, si, da, br, bi, ur, ui, db, level, h) {
    const l = level * level;
    const p0 = ar * ar + ai * ai - l * (br * br + bi * bi);
    const p1 = 2 * (ar * sr + ai * si - l * (br * ur + bi * ui));
    const p2 = sr * sr + si * si - l * (ur * ur + ui * ui);
    let least = Math.min(p0, p0 + h * (p1 + h * p2));
    const place = -p1 / (2 * p2);
    if (p2 > 0 && place > 0 && place < h) least = p0 - p1 * p1 / (4 * p2);
    const am = Math.max(Math.hypot(ar, ai), Math.hypot(ar + h * sr, ai + h * si));
    const bm = Math.max(Math.hypot(br, bi), Math.hypot(br + h * ur, bi + h * ui));
    return least > da * (2 * am + da) + l * db * (2 * bm + db)
      + 8 * EPSILON * (am * am + l * bm * bm);
  }

  /* What all walks have: the curve F at a point, the denominator, and their values where the walk
   * is. Where both vanish at s = 0, the first step is taken of F / omega and of the rest. */
  class Target {
    constructor(loop, c1, c2) {
      this.loop = loop;
      this.curve = new Curve(loop, at(loop, c1, c2));
      this.disc = new Disc(loop, [c1, c2]);
      this.other = null;
    }

    /* What the walk makes smaller, and of it the margin that is sought. */
    state() { return this.best; }
    least() { return this.state(); }

    /* The disc at infinite frequency: centre and radius. */
    limit() {
      for (const part of this.loop.parts) part.at(1, 0);
      this.disc.look(null);
      return [this.disc.re, this.disc.im, this.disc.radius / this.disc.size];
    }

    place(omega) {
      const { loop: { parts, rest }, curve, other } = this;
      for (const part of parts) part.at(omega);
      curve.join(omega);
      if (other) other.join(omega);
      this.disc.look(omega);
      this.omega = omega;
      this.hidden = omega === 0 && vanishes(curve) && (!other || other.lr === 0 && other.li === 0);
      const values = this.hidden ? [curve.dr, curve.di, 0, 0, curve.mr, curve.mi, 0, 0,
        rest.dr, rest.di, 0, 0] : [curve.vr, curve.vi, curve.dr, curve.di,
        curve.lr, curve.li, curve.mr, curve.mi, rest.vr, rest.vi, rest.dr, rest.di];
      [this.fr, this.fi, this.gr, this.gi, this.nr, this.ni, this.or, this.oi,
        this.rr, this.ri, this.ur, this.ui] = values;
    }

    /* Bounds on what the tangents leave out over a step. */
    over(h) {
      for (const part of this.loop.parts) part.over(h);
      this.curve.reach(h);
      const { rest } = this.loop, left = this.hidden ? 0.5 * h : 0.5 * h * h;
      const error = this.hidden ? 0 : this.curve.error;
      const rounded = this.hidden ? 0 : EPSILON * 4 * rest.relative * rest.b0;
      this.df = left * this.curve.bend + error;
      this.dn = left * this.curve.l2 + error;
      this.dr = left * rest.b2 + rounded;
    }

    /* Look for small values first where free phases of the arms would allow the smallest one: a walk then
     * leaps over what the disc tells. */
    scout() {
      const { disc, loop: { longest } } = this, end = this.end(), apart = 0.5 / longest;
      let least = Infinity, w = 0;
      for (let at = 1000 / longest; at < end && end < Infinity; at *= 1.01) {
        this.place(at);
        const found = this.level(disc.re, disc.im, disc.radius / disc.size);
        if (found < least) [least, w] = [found, at];
      }
      if (least === Infinity) return;
      for (let k = 0; k < SCOUTED && this.least() > (1 + 0.3 * NEAR) * least; k++, w += apart) {
        this.place(w);
        this.visit();
        if (this.away(least) < 0.3 * disc.radius / disc.size) this.probe(w - apart, w + apart);
      }
    }

    /* How far L is from a value. */
    from(x, y) {
      const { nr, ni, rr, ri } = this, square = rr * rr + ri * ri;
      return Math.hypot((nr * rr + ni * ri) / square - x, (ni * rr - nr * ri) / square - y);
    }

    /* Read something of L = N / R at omega: at s = 0 of what is left where both vanish. */
    read(omega, what) {
      this.place(omega);
      return what.call(this);
    }
  }

  /* Walk a target from s = 0 up to where it ends. Whether that was certain all along. */
  function walk(target, most = STEPS) {
    let omega = 0, step = 0.01 / target.loop.longest, end = target.end(), known = target.state();
    target.place(0);
    target.visit();
    for (let steps = 0; omega < end; steps++) {
      if (steps > most || !(end < Infinity)) return false;
      let h = Math.min(2 * step, end - omega);
      for (let tries = 1; !target.safe(h); tries++) {
        if (tries === 3 && target.probe(omega, omega + 4 * h)) tries = 0;
        else h *= 0.5;
        if (tries === 3 || tries === 0) target.place(omega);
        if (h <= 8 * EPSILON * omega || h < 1e-300) return false;
      }
      omega += h;
      step = h;
      target.place(omega);
      target.visit();
      if (target.state() < 0.9 * known) {
        known = target.state();
        end = target.end();
        target.place(omega);
      }
    }
    return true;
  }

  /* Where a function of omega changes its sign between two frequencies. */
  function root(value, low, high) {
    const begins = value(low) < 0, ends = halved(low, high, w => value(w) < 0 !== begins);
    return 0.5 * (ends[0] + ends[1]);
  }

  /* inf |1 + L| */
  class Modulus extends Target {
    constructor(loop, c1, c2) {
      super(loop, c1, c2);
      const [re, im, radius] = this.limit();
      // The limit at high frequency, for all small changes of the delays.
      this.best = Math.hypot(1 + re, im) - radius;
      this.where = Infinity;
    }

    end() {
      const level = (1 - NEAR) * this.best;
      return clearFrom(this.disc, (re, im, radius) => Math.hypot(1 + re, im) - radius >= level);
    }

    now() { return Math.hypot(this.fr, this.fi) / Math.hypot(this.rr, this.ri); }

    visit() {
      const here = this.now();
      if (here < this.best) [this.best, this.where] = [here, this.omega];
    }

    level(re, im, radius) { return Math.hypot(1 + re, im) - radius; }

    away() { return Infinity; }
    probe() { return false; }

    safe(h) {
      this.over(h);
      const { fr, fi, gr, gi, df, rr, ri, ur, ui, dr, best } = this;
      return exceeds(fr, fi, gr, gi, df, rr, ri, ur, ui, dr, (1 - NEAR) * best, h)
        || Math.hypot(1 + this.disc.re, this.disc.im) - this.disc.over(h) >= (1 - NEAR) * best;
    }

    found() {
      this.scout();
      return walk(this) ? this.best : NaN;
    }
  }

  /* Of a disc: the smallest |arg(-L)| where it meets the unit circle, infinity where it does not. */
  function discPhase(re, im, radius) {
    const size = Math.hypot(re, im);
    if (size + radius < 1 || size - radius > 1) return Infinity;
    if (radius - size >= 1) return 0;
    const half = Math.acos(Math.max(-1, Math.min(1,
      (1 + size * size - radius * radius) / (2 * size))));
    return Math.max(0, Math.abs(Math.atan2(-im, -re)) - half);
  }

  /* The smallest |arg(-L)| where |L| = 1; if it is `late`, the smallest arg(-L) / omega, 0 <= arg < 2 pi:
   * the delay that makes L = -1. */
  class Crossover extends Target {
    constructor(loop, c1, c2, late) {
      super(loop, c1, c2);
      const [re, im, radius] = this.limit(), lasts = Math.hypot(re, im) + radius >= 1;
      this.late = late;
      this.best = !late ? discPhase(re, im, radius) : lasts ? 0 : Infinity;
      if (this.best < Infinity) this.where = Infinity;
    }

    level(re, im, radius) { return discPhase(re, im, radius) / (this.late ? this.omega : 1); }

    away(least) {
      const angle = least * (this.late ? this.omega : 1), [x, y] = [-Math.cos(angle), -Math.sin(angle)];
      return this.late ? this.from(x, y) : Math.min(this.from(x, y), this.from(x, -y));
    }

    /* Half of the arc of turns that must not occur, and a value turned so that this arc is around 0. */
    half(omega) { return Math.min(Math.PI, (1 - NEAR) * this.best * (this.late ? 0.5 * omega : 1)); }
    turned(re, im, half) {
      const [c, s] = this.late ? [Math.cos(half), Math.sin(half)] : [1, 0];
      return [c * re + s * im, c * im - s * re];
    }

    end() {
      return clearFrom(this.disc, (re, im, radius) => this.late ? Math.hypot(re, im) + radius < 1
        : discPhase(re, im, radius) >= this.half());
    }

    visit() {}

    excess() { return Math.hypot(this.nr, this.ni) - Math.hypot(this.rr, this.ri); }

    probe(low, high) {
      const excess = w => this.read(w, this.excess), before = this.best;
      if (excess(low) < 0 === excess(high) < 0) return false;
      const w = root(excess, low, high), { nr, ni, rr, ri } = (this.place(w), this);
      const angle = Math.atan2(nr * ri - ni * rr, -(nr * rr + ni * ri));
      const found = this.late ? (angle < 0 ? TURN + angle : angle) / w : Math.abs(angle);
      if (found < before) [this.best, this.where] = [found, w];
      return this.best < before;
    }

    safe(h) {
      this.over(h);
      const { dn, rr, ri, ur, ui, dr, nr, ni, or, oi, best } = this, half = this.half(this.omega + h);
      if (exceeds(nr, ni, or, oi, dn, rr, ri, ur, ui, dr, 1, h)
        || exceeds(rr, ri, ur, ui, dr, nr, ni, or, oi, dn, 1, h)) return true;
      const [pr, pi] = this.turned(nr, ni, half), [qr, qi] = this.turned(or, oi, half);
      const { re, im } = this.disc;
      return best < Infinity && half < Math.PI && exceeds(rr + pr, ri + pi, ur + qr, ui + qi, this.late ? dn + dr : this.df,
        rr, ri, ur, ui, dr, 2 * Math.sin(0.5 * half), h)
        || discPhase(...this.turned(re, im, half), this.disc.over(h)) >= half;
    }

    found() { return this.late && this.best === 0 || (this.scout(), walk(this)) ? this.best : NaN; }
  }

  /* U + k V = 0 for a k of an interval, on the axis. The interval shrinks to what is found. */
  class Pencil extends Target {
    constructor(loop, c1, c2, low, high) {
      super(loop, c1, c2);
      [this.low, this.high] = [low, high];
    }

    /* -U / V where that is real: the k of a root on the axis. */
    k() {
      const { pr, pi, vr, vi } = this;
      return -(pr * vr + pi * vi) / (vr * vr + vi * vi);
    }

    place(omega) {
      super.place(omega);
      [this.pr, this.pi, this.qr, this.qi, this.vr, this.vi, this.wr, this.wi] = this.pair();
    }

    visit() { if (this.omega === 0) this.take(this.k(), 0); }

    cross() { return this.pi * this.vr - this.pr * this.vi; }

    probe(low, high) {
      const cross = w => this.read(w, this.cross), before = this.state();
      // At s = 0 everything is real.
      const begin = low || 1e-6 * high;
      if (cross(begin) < 0 === cross(high) < 0) return false;
      const w = root(cross, begin, high);
      this.take(this.read(w, this.k), w);
      return this.state() < before;
    }

    safe(h) {
      this.over(h);
      const { pr, pi, qr, qi, vr, vi, wr, wi } = this, [dp, dv] = this.left();
      // No k at all is real where the sign of Im(U conj V) stays.
      const g0 = pi * vr - pr * vi, g1 = qi * vr - qr * vi + pi * wr - pr * wi;
      const g2 = qi * wr - qr * wi, last = g0 + h * (g1 + h * g2), place = -g1 / (2 * g2);
      const inner = place > 0 && place < h ? g0 + 0.5 * place * g1 : g0;
      const pm = Math.max(Math.hypot(pr, pi), Math.hypot(pr + h * qr, pi + h * qi));
      const vm = Math.max(Math.hypot(vr, vi), Math.hypot(vr + h * wr, vi + h * wi));
      const slack = dp * vm + dv * pm + dp * dv + 8 * EPSILON * pm * vm;
      if (Math.min(g0, last, inner) > slack || Math.max(g0, last, inner) < -slack) return true;
      // |U + k V| stays larger than what it moves by, for all k of the interval.
      const a = h * Math.hypot(qr, qi) + dp, b = h * Math.hypot(wr, wi) + dv;
      const [low, high] = this.interval();
      const two = vr * vr + vi * vi - b * b, one = pr * vr + pi * vi - a * b;
      const none = pr * pr + pi * pi - a * a, q = k => none + k * (2 * one + k * two);
      const least = two > 0 ? Math.min(high, Math.max(low, -one / two)) : low;
      if (Math.min(q(low), q(high), q(least)) > 1e-14 * (pr * pr + pi * pi)) return true;
      return this.clear(this.disc.re, this.disc.im, this.disc.over(h));
    }

    end() { return clearFrom(this.disc, (re, im, radius) => this.clear(re, im, radius)); }
  }

  /* The gain factors next to one that take a root to the axis: R + k N = 0. */
  class Gains extends Pencil {
    constructor(loop, c1, c2, most) {
      super(loop, c1, c2, 1 / most, most);
      this.most = most;
      const [re, , radius] = this.limit();
      // The neutral root chain bounds them as well.
      this.chain = [0, Infinity];
      for (const edge of [re - radius, re + radius]) {
        const k = -1 / edge;
        if (k > 0 && k < 1) this.chain[0] = Math.max(this.chain[0], k);
        if (k > 1 && k < Infinity) this.chain[1] = Math.min(this.chain[1], k);
      }
      this.base = [Math.max(this.low, this.chain[0] * (1 + NEAR)),
        Math.min(this.high, this.chain[1] * (1 - NEAR))];
      [this.low, this.high] = this.base;
    }

    state() { return this.high / this.low; }
    pair() { return [this.rr, this.ri, this.ur, this.ui, this.nr, this.ni, this.or, this.oi]; }
    left() { return [this.dr, this.dn]; }

    take(k, omega) {
      if (k > this.low && k <= 1) [this.low, this.lowerAt] = [k, omega];
      if (k > 1 && k < this.high) [this.high, this.upperAt] = [k, omega];
    }

    interval() {
      return [Math.min(1, this.low * (1 + NEAR)), Math.max(1, this.high * (1 - NEAR))];
    }

    clear(re, im, radius) {
      const [low, high] = this.interval(), [from, to] = [-1 / low, -1 / high];
      return Math.hypot(re - Math.min(to, Math.max(from, re)), im) > radius;
    }

    least() { return this.high; }
    away(least) { return this.from(-1 / least, 0); }
    level(re, im, radius) {
      const k = 1 / (Math.sqrt(Math.max(0, radius * radius - im * im)) - re);
      return Math.abs(im) < radius && k > 1 ? k : Infinity;
    }

    found() {
      this.scout();
      if (!walk(this)) return [NaN, NaN];
      const { low, high, base, chain, most } = this;
      return [low > base[0] ? low : chain[0] > 1 / most ? chain[0] : 0,
        high < base[1] ? high : chain[1] < most ? chain[1] : Infinity];
    }
  }

  /* The first t at which D has a root on the axis at (1, 1) + t (d1, d2). */
  class Break extends Pencil {
    constructor(loop, d1, d2, low, high) {
      super(loop, 1, 1, low, high);
      this.other = new Curve(loop, along(d1, d2));
      this.direction = [d1, d2];
      this.reach();
    }

    /* The disc is that of the whole ray, as far as it is still looked at. */
    reach() {
      const { loop, high, direction: [d1, d2] } = this;
      this.disc = new Disc(loop, [1, 1], [1 + high * d1, 1 + high * d2]);
    }

    state() { return this.high; }

    pair() {
      const { fr, fi, gr, gi, other } = this;
      if (this.hidden) return [fr, fi, 0, 0, other.mr, other.mi, 0, 0];
      return [fr, fi, gr, gi, other.lr, other.li, other.mr, other.mi];
    }

    over(h) {
      super.over(h);
      this.other.reach(h);
      this.step = h;
    }

    left() {
      const { other } = this;
      const left = 0.5 * this.step * other.l2;
      return [this.df, this.hidden ? left : left * this.step + other.error];
    }

    take(t, omega) { if (t > this.low && t < this.high) [this.high, this.where] = [t, omega]; }
    interval() { return [this.low, Math.max(this.low, this.high * (1 - NEAR))]; }
    clear(re, im, radius) { return Math.hypot(1 + re, im) > radius; }

    end() {
      this.reach();
      return super.end();
    }

    found() { return walk(this) ? this.high : NaN; }
  }

  /* The critical perturbation along a ray from (1, 1), its `size` and the `omega` of the root that crosses:
   * 0 where the loop is not stable next to it, infinity where there is none up to |c - 1| = 2, the limit where
   * the neutral root chain is lost first; nan where that is not certain. Null where the loop is not stable at
   * (1, 1), where it has `begun` unstable roots. */
  function firstBreak(loop, d1, d2, begun = count(loop, 1, 1, { most: COUNTED })) {
    if (d1 === d2) loop = reduced(loop, 1, 1);
    const inside = t => count(loop, 1 + t * d1, 1 + t * d2,
      { most: COUNTED, exact: beside(t * d1, t * d2) });
    // Whether a loop that is on the boundary as far as rounding can tell is stable, nobody can tell.
    if (begun === UNDECIDED || begun === BOUNDARY) return { size: NaN };
    if (begun > 0 || begun < BOUNDARY) return null;
    const share = chain(loop), lost = t => share(1 + t * d1, 1 + t * d2) >= LOST;
    const limit = lost(FARTHEST) ? halved(0, FARTHEST, lost)[1] : Infinity;
    const last = Math.min(FARTHEST, limit * (1 - NEAR));
    const target = new Break(loop, d1, d2, 0, last);
    target.place(0);
    // A root at s = 0 that cancels at (1, 1) may turn into the loop's own next to it.
    if (vanishes(target.curve)) {
      target.low = OWN;
      const next = inside(1e-9);
      if (next === UNDECIDED) return { size: NaN };
      // Not zero where the loop is stable still nearer.
      if (next !== 0) return { size: [1e-10, 1e-11, 1e-12].some(t => inside(t) === 0) ? NaN : 0 };
    }
    const size = target.found(), next = size < last && inside(size * (1 + 1e-6));
    if (size === last) return { size: inside((1 - 2 * NEAR) * last) === 0 ? limit : NaN, omega: Infinity };
    const certain = next && next !== UNDECIDED && inside(size * (1 - NEAR)) === 0;
    return { size: certain ? size : NaN, omega: target.where };
  }

  /* Margins of a stable loop, null of another: gain factors `lower` and `upper` between which it
   * stays stable (0 and infinity where none from 1 / `most` to `most` bounds them), `delay` in s
   * and `phase` in rad, infinity without a crossover, and `modulus`; each nan where it is not certain. The names
   * with `At` have the frequency of each in rad/s: infinity, or none, where it is a limit. */
  function margins(spec, c1, c2, begun = count(make(spec), c1, c2, { most: COUNTED })) {
    const loop = reduced(make(spec), c1, c2);
    let [lower, upper, most, gains] = [NaN, NaN, LARGEST[0], null];
    if (begun !== 0)
      return begun === UNDECIDED || begun === BOUNDARY ? { delay: NaN, lower, upper, most, phase: NaN, modulus: NaN } : null;
    for (most of LARGEST) {
      gains = new Gains(loop, c1, c2, most);
      [lower, upper] = gains.found();
      if (!Number.isNaN(lower)) break;
    }
    // At what was found a root is on the axis. A second opinion from a count inside of it.
    const stable = k => count(make({ ...loop.spec, gain: spec.gain * k }), c1, c2, { most: COUNTED }) === 0;
    if (lower > 0 && !stable(lower * (1 + NEAR))) lower = NaN;
    if (upper < Infinity && !stable(upper * (1 - NEAR))) upper = NaN;
    const [delay, phase] = [true, false].map(late => new Crossover(loop, c1, c2, late)), modulus = new Modulus(loop, c1, c2);
    return { delay: delay.found(), lower, upper, most, phase: phase.found(), modulus: modulus.found(), lowerAt: gains.lowerAt,
      upperAt: gains.upperAt, delayAt: delay.where, phaseAt: phase.where, modulusAt: modulus.where };
  }

  return { firstBreak, margins };
}
