"use strict";
/*
 * What noise is left on the locked laser, source by source, at the white paper's levels: the
 * package's `noise_budget`, with the same closed forms.
 *
 * With S = 1 / (1 + L) and Y_k = -K m_k exp(-s delay) S the laser's own noise passes S, and what adds
 * to the signal of arm k passes Y_k.
 */
function armlockNoise(api) {
  const { at, along, Curve, frequencies } = api;
  const TURN = 2 * Math.PI, BEATS = [15e6, -14e6], FIRST = 1e-4, LAST = 1;
  const LASERS = {
    "free-running": f => 3e4 / f,
    "Mach-Zehnder": f => 800 * Math.sqrt(1 + (2.8e-3 / f) ** 4),
    "cavity": f => 30 * Math.sqrt(1 + (3e-3 / f) ** 4),
  };
  const SOURCES = ["laser", "shot", "clock", "motion"];

  /* The budget at frequencies omega in rad/s, by default those of the measuring band. `to` gives it
   * at (c1, c2) within a frame: {omega, laser, shot, clock, motion, total, required} in Hz/sqrt(Hz). */
  function noise(loop, laser, omega = frequencies(loop, TURN * LAST, TURN * FIRST)) {
    const n = omega.length, both = new Curve(loop, at(loop, 0, 0));
    const arms = [along(-1, 0), along(0, -1)].map(point => new Curve(loop, point));
    // Of each frequency: the part of L without echoes, K m_k exp(-s (delay + tau_k)), exp(-s tau_k).
    const parts = Array.from(omega, w => {
      both.at(w);
      const { vr, vi } = loop.rest, square = vr * vr + vi * vi;
      for (const arm of arms) arm.join(w);
      return [...[both, ...arms].flatMap(({ lr, li }) => [(lr * vr + li * vi) / square,
        (li * vr - lr * vi) / square]), ...[loop.tau1, loop.tau2].flatMap(
        tau => [Math.cos(w * tau), -Math.sin(w * tau)])];
    });
    const found = { omega };
    for (const name of [...SOURCES, "total", "required"]) found[name] = new Float64Array(n);
    const to = (c1, c2) => {
      parts.forEach(([br, bi, ur, ui, vr, vi, er, ei, gr, gi], i) => {
        const f = omega[i] / TURN;
        const s = 1 / Math.hypot(1 + br - c1 * ur - c2 * vr, bi - c1 * ui - c2 * vi);
        const y1 = s * Math.hypot(ur, ui), y2 = s * Math.hypot(vr, vi);
        // Y_k less what both share: the echo's phase is taken back.
        const pr = ur * er + ui * ei, pi = ui * er - ur * ei, qr = vr * gr + vi * gi, qi = vi * gr - vr * gi;
        const [one, two] = BEATS, clocks = s * Math.hypot(one * pr + two * qr, one * pi + two * qi);
        const moved = s * Math.hypot(pr + ur + qr + vr, pi + ui + qi + vi);
        found.laser[i] = s * LASERS[laser](f);
        found.shot[i] = TURN * f * Math.SQRT2 * 1e-5 * Math.hypot(y1, y2);
        found.clock[i] = 2.4e-12 / Math.sqrt(f) * Math.hypot(clocks, one * y1, two * y2);
        found.motion[i] = TURN * f * 2.5e-3 / Math.sqrt(1 + (f / 0.3) ** 4)
          * Math.hypot(moved, 2 * y1, 2 * y2);
        found.total[i] = Math.hypot(...SOURCES.map(name => found[name][i]));
        found.required[i] = 300 * (1 + (3e-3 / f) ** 2);
      });
      return found;
    };
    return { to };
  }

  return { noise, LASERS, SOURCES };
}
