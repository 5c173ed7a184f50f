"use strict";
/*
 * The open loop along the axis, for pictures: beyond the last crossover and the last margin. Where the
 * delays turn too often to draw every turn, some turns are drawn, those of the margins among them, and
 * the band in which all turns lie.
 */
function armlockCurves(api) {
  const { at, tail, Curve, Disc, clearFrom, frequencies } = api;
  // Turns that are drawn in a decade where not all are, and samples of each.
  const TURNS = [6, 24], SAMPLES = 48;

  /* Arrays omega, re, im; `gap[i]` where the curve is broken before a sample; `dense`, the frequency up to
   * which every turn is drawn; `band` of [omega, centre, radius] beyond it; `at`, which gives [re, im] at
   * any frequency; `cache` for what a picture made of them. `marks` are frequencies that must be drawn. */
  function response(loop, c1, c2, most, marks) {
    const point = at(loop, c1, c2), curve = new Curve(loop, point), { longest } = loop, turn = 2 * Math.PI / longest;
    const disc = new Disc(loop, [point.c1, point.c2]), lowest = Math.min(0.1 * Math.min(...loop.scales), ...marks.map(w => 0.3 * w));
    // From the last crossover on |L| is below one, whatever the arms' phases are.
    const crossed = clearFrom(disc, (re, im, radius) => Math.hypot(re, im) + radius < 0.9);
    const last = [3 * tail(loop, point.c1, point.c2).omega, 2 * crossed, ...marks.map(w => 1.3 * w)].filter(w => w < Infinity);
    const top = Math.max(20 / longest, ...last), dense = Math.min(top, lowest + most / (12 * longest));
    // Margins, and resonances that are narrower than the samples are apart.
    const around = (w, wide) => [-10, -3, -1, -0.3, 0, 0.3, 1, 3, 10].map(k => w + k * wide);
    const narrow = [...marks.map(w => around(w, 1e-4 * w)), ...[...loop.spec.zeros, ...loop.spec.poles].filter(([, im]) => im > 0)
      .map(([re, im]) => around(im, Math.abs(re) || 1e-6 * im))].flat().filter(w => w > lowest && w < dense);
    const omega = [...frequencies(loop, dense, lowest, most), ...narrow].sort((a, b) => a - b), gaps = new Set(), band = [];
    const pieces = marks.filter(w => w > dense).map(w => [w - turn, w + turn, w]), grow = 10 ** (1 / TURNS[most > 5000 ? 1 : 0]);
    for (let w = dense; w < top; w *= grow) if (w * (grow - 1) > turn) pieces.push([w, w + turn, w]);
    pieces.sort((p, q) => p[0] - q[0]);
    for (const [from, to, w] of pieces) {
      const end = omega.at(-1);
      if (to <= end) continue;
      if (from > end) gaps.add(omega.length);
      const samples = Array.from({ length: SAMPLES }, (_, k) => from + (to - from) * k / (SAMPLES - 1));
      omega.push(...[...samples, w].filter(v => v > end).sort((a, b) => a - b));
    }
    const find = w => {
      curve.at(w);
      const { vr, vi } = loop.rest, square = vr * vr + vi * vi, { lr, li } = curve;
      return [(lr * vr + li * vi) / square, (li * vr - lr * vi) / square];
    };
    const [re, im] = [0, 1].map(() => new Float64Array(omega.length));
    omega.forEach((w, i) => { [re[i], im[i]] = find(w); });
    for (let w = dense; w < top; w *= most > 5000 ? 1.03 : 1.3) {
      find(w);
      disc.look(w);
      band.push([w, disc.re, disc.im, disc.radius / disc.size]);
    }
    return { omega: Float64Array.from(omega), re, im, gap: i => gaps.has(i), dense: band.length ? dense : top, top, band, at: find, cache: {} };
  }

  return { response };
}
