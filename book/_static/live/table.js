"use strict";
/*
 * The numbers of a loop as words: each is written once, for the table, for the panel that stays in sight, and
 * for a text that is copied.
 */
const armlockTable = (function () {
  const { TURN, say, time } = armlockText, { element } = armlockDraw;
  const { BOUNDARY, UNCONFINED, UNDECIDED } = armlockLoop(), { TOO_MANY } = armlockDesk;
  const LOST = "unstable at arbitrarily high frequency";
  const WORDS = { [BOUNDARY]: "a root on the imaginary axis", [UNCONFINED]: LOST, [UNDECIDED]: "undecided",
    [TOO_MANY]: "undecided: too many roots to count" };
  const SHORT = { ...WORDS, [UNCONFINED]: "infinitely many", [BOUNDARY]: "one on the axis", [TOO_MANY]: "too many to count" };
  // What is asked for of a loop at its point, and of a loop from (1, 1).
  const TOLD = ["count", "margins", "root"];
  const WAYS = [[1, -1], [-1, 1], [1, 1], [-1, -1]], named = way => `(${way.join(", ").replace(/-/g, "\u2212")})`;
  const UNTOLD = { count: UNDECIDED, root: null, margins: { delay: NaN, lower: NaN, upper: NaN, phase: NaN, modulus: NaN } };
  const UNBROKEN = { size: NaN };
  const MARGINS = ["Delay margin", "Unstable roots", "Phase margin in degrees", "Smallest gain factor of a stable loop",
    "Largest gain factor of a stable loop", "Smallest |1 + L|"];
  const PANEL = ["Delay margin", "Unstable roots", "Phase margin", "Gain factor from", "Factor up to", "Smallest |1 + L|"];

  const WAIT = { text: "\u2026", waits: true };
  const plain = (text, short = text) => ({ text, short });

  function counted(count) {
    return count === 0 ? "stable" : count > 0 ? `${count} unstable root${count > 1 ? "s" : ""}` : WORDS[count];
  }

  function rootText([re, im]) {
    if (re === -Infinity) return "none: L is zero";
    return `${say(re)}${im === Infinity ? ", the limit at high frequency" : im ? ` \u00b1 ${say(Math.abs(im))}j` : ""}`;
  }

  /* A number that a walk of the axis has met at `omega`; `none` is the value that stands for none. */
  function met(value, omega, none, words, { write = say, unit = "" } = {}) {
    if (Number.isNaN(value)) return plain("undecided");
    if (value === none) return plain(...words);
    const text = write(value), far = omega === Infinity;
    return { text: `${text}${omega > 0 && !far ? ` at ${say(omega / TURN)}\u00a0Hz` : far ? ", in the limit of high frequency" : ""}`,
      short: `${text}${unit}${far ? ", in the limit" : ""}` };
  }

  /* The six numbers at a point, in the order of MARGINS. */
  function marginsOf({ told: { count, margins } }) {
    const counts = count === undefined ? WAIT : count >= 0 ? plain(String(count)) : plain(WORDS[count], SHORT[count]);
    const of = read => margins === undefined ? WAIT : margins ? read(margins) : plain("none: unstable", "\u2013");
    return [of(m => met(m.delay, m.delayAt, Infinity, ["no crossover"], { write: time })), counts,
      of(m => met(m.phase * 180 / Math.PI, m.phaseAt, Infinity, ["no crossover"], { unit: "\u00b0" })),
      of(m => met(m.lower, m.lowerAt, 0, [`none above 1/${m.most}`, `below 1/${m.most}`])),
      of(m => met(m.upper, m.upperAt, Infinity, [`none up to ${m.most}`, `above ${m.most}`])),
      of(m => met(m.modulus, m.modulusAt, Infinity, [""]))];
  }

  function rightmost({ told: { count, root } }) {
    return count < 0 ? plain(WORDS[count]) : root === undefined ? WAIT : plain(root ? rootText(root) : "undecided");
  }

  /* The smallest critical perturbation of the directions, once all are known: `way`, `size` and `omega`. */
  function weakestOf(breaks) {
    if (!breaks.every(one => one?.size >= 0)) return null;
    const size = Math.min(...breaks.map(one => one.size)), k = breaks.findIndex(one => one.size === size);
    return { way: WAYS[k], ...breaks[k] };
  }

  /* The same in a sentence. */
  function weakestText(breaks) {
    const found = weakestOf(breaks);
    if (!found) return "";
    const { size, omega, way } = found;
    if (size === Infinity) return "None of the four directions of the table has a critical perturbation up to 2.";
    if (size === 0) return `No perturbation along ${named(way)} is tolerated.`;
    return `The smallest of the four critical perturbations is ${say(size)} along ${named(way)}${omega === Infinity ? ", in the limit of high frequency"
      : omega ? `, where a root crosses at ${say(omega / TURN)}\u00a0Hz` : ", where a root is at s = 0"}.`;
  }

  /* The critical perturbations, each with the frequency of the root that crosses there. */
  function breaksOf({ breaks }) {
    const weakest = weakestOf(breaks);
    return WAYS.map((_, k) => {
      const found = breaks[k];
      if (found === undefined) return WAIT;
      if (found === null) return plain("unstable at (1, 1)");
      const { size, omega } = found;
      if (size === 0) return plain("0: none is tolerated");
      const cell = met(size, omega, Infinity, ["none up to 2"]);
      if (omega === 0 && size < Infinity) cell.text += " at s\u00a0=\u00a00";
      if (size === weakest?.size && size < Infinity) cell.text += " (smallest)";
      return cell;
    });
  }

  /* All numbers of some designs side by side: [title, [name, cells], ...] of each part. */
  function partsOf(designs, name) {
    const [margins, breaks] = [marginsOf, breaksOf].map(read => designs.map(read));
    const rows = (names, columns) => names.map((title, k) => [title, columns.map(column => column[k])]);
    return [
      [`At ${name}`, ...rows(MARGINS, margins), ["Rightmost root in rad/s", designs.map(rightmost)]],
      ["Critical perturbation from (1, 1): |c1 \u2212 1| = |c2 \u2212 1|, and the frequency of the root that crosses",
        ...rows(WAYS.map(way => `along ${named(way)}`), breaks)],
    ];
  }

  const complete = parts => parts.every(([, ...rows]) => rows.every(([, cells]) => cells.every(cell => !cell.waits)));

  /* Fill a table; `heads` name its columns. */
  function fill(table, parts, heads) {
    table.replaceChildren(element("thead", {}, element("tr", {}, ...heads.map(text => element("th", { scope: "col" }, text)))),
      ...parts.map(([title, ...rows]) => element("tbody", {},
        element("tr", {}, element("th", { scope: "rowgroup", colspan: heads.length }, title)),
        ...rows.map(([name, cells]) => element("tr", {}, element("th", { scope: "row" }, name),
          ...cells.map(({ text }) => element("td", {}, text)))))));
  }

  /* What stays in sight: one that is asked for anew stays, faint. `bound` in dB is one on |S|. */
  function fillPanel(panel, design, bound) {
    const cells = marginsOf(design), beyond = bound && design.told.margins?.modulus < 10 ** (-bound / 20);
    if (!panel.children.length) panel.append(...PANEL.map(name =>
      element("p", {}, element("span", {}, name), element("strong", {}))));
    cells.forEach(({ text, short, waits }, k) => {
      const place = panel.children[k].lastChild, over = k === 5 && beyond;
      place.classList.toggle("live-old", Boolean(waits));
      if (waits) return;
      place.textContent = over ? `${short} (> ${say(bound)} dB)` : short;
      place.title = over ? `${text}: |S| is above its bound of ${say(bound)} dB` : text;
      place.classList.toggle("live-wrong", Boolean(over));
    });
  }

  /* A table as plain text. */
  const copied = table => Array.from(table.rows, row => Array.from(row.cells, cell => cell.textContent).join("\t")).join("\n");

  return { LOST, TOLD, WAYS, UNTOLD, UNBROKEN, weakestOf, weakestText, counted, rootText, partsOf, complete, fill, fillPanel, copied };
})();
