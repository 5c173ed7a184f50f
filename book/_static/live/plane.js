"use strict";
/*
 * The s-plane: poles and zeros of the controller, how often each is there, and roots of the closed loop: the
 * one that crosses the imaginary axis at the critical perturbation, and the rightmost one.
 */
const armlockPlane = (function () {
  const { TURN, say, power } = armlockText, { rings, labelBeside, cross } = armlockDraw;

  /* Each root once, with how often it is there. */
  function counted(roots) {
    const found = new Map();
    for (const root of roots) {
      const name = String(root.map(v => v + 0));
      found.set(name, { root, times: (found.get(name)?.times || 0) + 1 });
    }
    return [...found.values()];
  }

  function diamond(pen, x, y, size) {
    pen.beginPath();
    for (const [dx, dy] of [[0, -size], [size, 0], [0, size], [-size, 0]]) pen.lineTo(x + dx, y + dy);
    pen.fill();
  }

  /* The distance from 0 on a logarithmic scale. `crossing` is the frequency of the root that crosses, in rad/s,
   * and `rightmost` a root, or null. Returns where each is, and what root a place is. */
  function drawRoots({ zeros, poles, unit, range, crossing, rightmost }, pen, wide, high, colours) {
    const cx = wide / 2, cy = high / 2, full = 0.46 * Math.min(wide, high), [least, most] = range;
    const free = v => 0.15 + 0.75 * Math.log(v / least) / Math.log(most / least), share = v => Math.min(Math.max(free(v), 0), 1);
    const place = ([re, im]) => {
      const size = Math.hypot(re, im), k = size ? full * share(size) / size : 0;
      return [cx + k * re, cy - k * im];
    };
    const sizes = [], places = [...zeros, ...poles].map(place), taken = [];
    const every = Math.ceil(Math.log10(most / least) / 5);
    for (let k = Math.ceil(Math.log10(least / unit)); 10 ** k <= 1.01 * most / unit; k += every) sizes.push(10 ** k);
    pen.strokeStyle = colours.grid;
    pen.beginPath();
    pen.moveTo(cx, cy - full);
    pen.lineTo(cx, cy + full);
    pen.moveTo(cx - full, cy);
    pen.lineTo(cx + full, cy);
    pen.stroke();
    if (sizes.length) rings(pen, [cx, cy], sizes, v => full * share(v * unit),
      v => power(Math.round(Math.log10(v))), places, colours)(taken);
    pen.textBaseline = "middle";
    pen.textAlign = "left";
    pen.fillText("Re s", cx + full + 3, cy);
    pen.textAlign = "center";
    pen.fillText("Im s", cx, Math.max(7, cy - full - 8));
    const marks = (roots, colour, draw) => {
      for (const { root, times } of counted(roots)) {
        const [x, y] = place(root);
        pen.lineWidth = 2;
        pen.strokeStyle = colour;
        draw(x, y);
        pen.lineWidth = 1;
        pen.fillStyle = colour;
        // Poles above, zeros below: both may be at one place.
        if (times > 1) pen.fillText(String(times), x, y + (roots === poles ? -14 : 15));
      }
    };
    marks(zeros, colours.line, (x, y) => {
      pen.beginPath();
      pen.arc(x, y, 6, 0, 7);
      pen.stroke();
    });
    marks(poles, colours.mark, (x, y) => cross(pen, x, y));
    pen.fillStyle = colours.text;
    // A root beyond the picture is only named.
    const inside = v => free(v) > 0 && free(v) < 1, words = [];
    if (rightmost && Number.isFinite(rightmost[0] + rightmost[1])) {
      const [re, im] = rightmost;
      if (!inside(Math.hypot(re, im))) words.push(`rightmost root at ${say(re / unit)}`);
      else for (const [x, y] of [place([re, im]), place([re, -im])]) pen.fillRect(x - 4, y - 4, 8, 8);
    }
    if (crossing > 0) {
      const text = `crosses at ${say(crossing / TURN)} Hz`;
      if (!inside(crossing)) words.push(`root that ${text}`);
      else {
        for (const sign of [1, -1]) diamond(pen, ...place([0, sign * crossing]), 7);
        const [x, y] = place([0, crossing]);
        pen.textAlign = "left";
        labelBeside(pen, text, x + 11, y, colours, taken, places);
      }
    }
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    pen.fillText(words.length ? `beyond the picture: ${words.join(", ")}` : "", 4, 16);
    pen.fillText(unit === 1 ? "in rad/s" : "in Hz", 4, high - 4);
    pen.textAlign = "right";
    pen.fillText("closed loop: \u25c6 crosses, \u25a0 rightmost", wide - 4, high - 4);
    return { place, root: (x, y) => {
      const far = Math.hypot(x - cx, y - cy) / full, angle = Math.atan2(cy - y, x - cx);
      const size = least * Math.exp((Math.max(far, 0.05) - 0.15) / 0.75 * Math.log(most / least));
      return [size * Math.cos(angle), size * Math.sin(angle)];
    } };
  }

  return { drawRoots };
})();
