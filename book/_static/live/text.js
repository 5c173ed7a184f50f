"use strict";
/*
 * Numbers as text, for the live pages. A loop becomes a formula, Python, or the address of the page.
 */
const armlockText = (function () {
  const TURN = 2 * Math.PI, { readRoots, readNumber, wrong } = armlockRead;

  /* ---------------------------------------------------------------------------- out */

  function say(number, digits = 3) {
    if (number === 0) return "0";
    const size = Math.abs(number);
    const text = size < 1e-3 || size >= 1e5 ? scientific(number, digits - 1)
      : String(+number.toPrecision(digits));
    return text.replace(/-/g, "\u2212");
  }

  function scientific(number, digits) {
    const [factor, exponent] = number.toExponential(digits).split("e");
    return `${Number(factor)}\u00a0\u00d7\u00a0${power(Number(exponent))}`;
  }

  function power(exponent) {
    const digits = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
    return `10${String(exponent).replace(/./g, d => d === "-" ? "\u207b" : digits[d])}`;
  }

  /* A time in the unit in which a person would say it. */
  function duration(seconds) {
    for (const [unit, size] of [["years", 31557600], ["days", 86400], ["hours", 3600],
      ["minutes", 60], ["s", 1], ["ms", 1e-3]])
      if (seconds >= 2 * size || unit === "ms") return `${say(seconds / size, 2)} ${unit}`;
    return "";
  }

  /* A short time with its unit. */
  function time(seconds) {
    const [unit, size] = [["s", 1], ["ms", 1e-3], ["\u00b5s", 1e-6], ["ns", 1e-9]].find(([, size]) => seconds >= size) || ["s", 1];
    return `${say(seconds / size)} ${unit}`;
  }

  /* A number in as few characters as hold all its digits. */
  function exact(number) {
    const plain = String(number), scientific = number.toExponential();
    return scientific.length < plain.length ? scientific : plain;
  }

  /* The shortest text of the number that times the unit gives this one. */
  function shortest(number, unit) {
    for (let digits = 1; digits < 17; digits++) {
      const found = Number((number / unit).toPrecision(digits));
      if (found * unit === number) return exact(found);
    }
    return exact(number / unit);
  }

  const root = ([re, im], unit = 1) => im ? `${shortest(re, unit)}${im < 0 ? "-" : "+"}`
    + `${shortest(Math.abs(im), unit)}j` : shortest(re, unit);

  function written(roots, unit = 1) {
    const left = [...roots], parts = [];
    while (left.length) {
      const [re, im] = left.shift();
      const partner = im ? left.findIndex(([x, y]) => x === re && y === -im) : -1;
      if (partner >= 0) left.splice(partner, 1);
      parts.push(partner < 0 ? root([re, im], unit)
        : `${shortest(re, unit)}\u00b1${shortest(Math.abs(im), unit)}j`);
    }
    return parts.join(", ");
  }

  /* ---------------------------------------------------------------------------- a whole loop */

  /* The controller as a formula. */
  function formula({ zeros, poles, gain, delay }) {
    const product = roots => {
      const powers = new Map(), term = (sign, value) => `${value * sign < 0 ? "\u2212" : "+"} ${say(Math.abs(value), 4)}`;
      for (const [re, im] of [...roots].sort((p, q) => Math.hypot(...p) - Math.hypot(...q))) if (im >= 0) {
        const factor = im ? `(s\u00b2${re ? ` ${term(-1, 2 * re)} s` : ""} ${term(1, re * re + im * im)})`
          : re ? `(s ${term(-1, re)})` : "s";
        powers.set(factor, (powers.get(factor) || 0) + 1);
      }
      const factors = [...powers].map(([factor, n]) => n > 1 ? factor + power(n).slice(2) : factor);
      return factors.length > 1 && roots === poles ? `[${factors.join(" ")}]` : factors.join(" ");
    };
    const above = [...gain === 1 && zeros.length ? [] : [say(gain, 6)], ...delay ? [`exp(\u2212${say(delay, 6)} s)`] : [], product(zeros)]
      .filter(part => part).join(" ");
    return `K(s) = ${above}${poles.length ? ` / ${product(poles)}` : ""}`;
  }

  /* What a loop is beside its controller. */
  function described({ sensor, tau1, tau2, delay, corner, difference }) {
    const two = ["dual", "modified"].includes(sensor);
    return `Sensor: ${sensor}${two ? `, with corner ${say(corner / TURN)} Hz and \u0394\u03c4 = ${say(difference, 6)} s` : ""}. Delays ${say(tau1, 8)} s and ${
      say(tau2, 8)} s${delay ? `, dead time ${time(delay)}` : ""}.`;
  }

  /* The lines that make the same loop with the package. */
  function python(spec, [c1, c2], unit) {
    const times = text => unit === 1 || text === "0" ? text : `${text} * hertz`;
    const one = ([re, im]) => times(im && unit !== 1 ? `(${root([re, im], unit)})` : root([re, im], unit));
    const roots = all => `[${all.map(one).join(", ")}]`;
    const corner = () => times(shortest(spec.corner, unit));
    const sensors = {
      dual: () => ["dual", `dual(corner=${corner()}, difference=${spec.difference})`],
      modified: () => ["modified_dual", `modified_dual(\n        mean_delay=`
        + `${Number((0.5 * (spec.tau1 + spec.tau2)).toPrecision(15))}, half_difference=${spec.difference / 2}, corner=${corner()}\n    )`],
    };
    const [name, sensor] = (sensors[spec.sensor] || (() => Array(2).fill(spec.sensor.toUpperCase())))();
    return [`from math import degrees${unit === 1 ? "" : ", pi"}`, "",
      "from armlock import Controller, Loop, critical_perturbation, margins, rightmost_root, unstable_roots", `from armlock.sensors import ${name}`,
      "", ...unit === 1 ? [] : ["hertz = 2 * pi"],
      "controller = Controller(", `    zeros=${roots(spec.zeros)},`, `    poles=${roots(spec.poles)},`,
      `    gain=${spec.gain},`, ")", "loop = Loop(", `    controller, ${sensor},`,
      `    tau1=${spec.tau1}, tau2=${spec.tau2}, delay=${spec.delay},`, ")",
      `count = unstable_roots(loop, ${c1}, ${c2})`, 'print(f"unstable roots: {count}")',
      `print(f"rightmost root: {rightmost_root(loop, ${c1}, ${c2}):.4g} rad/s")`,
      "if count == 0:", `    found = margins(loop, ${c1}, ${c2})`,
      '    print(f"gain factors of a stable loop: {found.gain_lower:.4g} to {found.gain_upper:.4g}")',
      '    print(f"phase margin: {degrees(found.phase):.4g} degrees")', '    print(f"delay margin: {found.delay:.4g} s")',
      '    print(f"smallest |1 + L|: {found.modulus:.4g}")',
      "if unstable_roots(loop, 1, 1) == 0:", "    for direction in [(1, -1), (-1, 1), (1, 1), (-1, -1)]:",
      "        size = critical_perturbation(loop, direction)",
      '        print(f"critical perturbation along {direction}: {size:.4g}")', ""].join("\n");
  }

  const SHORT = { sensor: "s", tau1: "t1", tau2: "t2", delay: "d", gain: "g", corner: "p",
    difference: "dt", zeros: "z", poles: "q" };
  const NEEDED = sensor => ["sensor", "tau1", "tau2", "delay", "gain", "zeros", "poles",
    ...["dual", "modified"].includes(sensor) ? ["corner", "difference"] : []];

  /* A loop and its held point, as an address names them. */
  function named(spec, held) {
    const parts = new URLSearchParams();
    for (const [name, key] of Object.entries(SHORT)) {
      const value = spec[name];
      if (value === undefined || !NEEDED(spec.sensor).includes(name)) continue;
      parts.set(key, Array.isArray(value) ? written(value) : value);
    }
    if (held) parts.set("pt", held.join(","));
    return parts;
  }

  function numbers(parts, key, size) {
    const found = parts.get(key).split(",").map(text => text.trim() ? Number(text) : NaN);
    if (found.length === size && found.every(Number.isFinite)) return found;
    throw wrong(key, `\u201c${key}=${parts.get(key)}\u201d is not ${size} numbers`);
  }

  /* The loop and the held point that parts of an address name. An error says what they lack. */
  function loopOf(parts) {
    const sensor = parts.get("s"), needed = NEEDED(sensor).filter(name => name !== "delay"), spec = { delay: 0 };
    for (const [name, key] of Object.entries(SHORT)) {
      const text = parts.get(key);
      if (text === null && needed.includes(name)) throw wrong(name, `it has no \u201c${key}=\u201d`);
      if (text === null) continue;
      spec[name] = name === "sensor" ? text
        : name === "zeros" || name === "poles" ? readRoots(name, text, name)
          : readNumber(name, text, `\u201c${key}\u201d`);
    }
    return { spec, held: parts.has("pt") ? numbers(parts, "pt", 2) : null };
  }

  /* The address holds all: loop, view, the held point, the unit of the fields, what was pasted, the
   * bound on |S| if it is not 6 dB, and the pinned loop. */
  function address(spec, { centre, half, held }, unit, pasted = "", bound = 6, pinned = null) {
    const parts = named(spec, held);
    parts.set("at", [...centre, half].join(","));
    if (unit !== 1) parts.set("u", "Hz");
    if (pasted) parts.set("k", pasted);
    if (bound !== 6) parts.set("b", bound);
    if (pinned) parts.set("pin", named(pinned.spec, pinned.held));
    return `#${parts}`;
  }

  /* What an address holds; null where it is none of a loop. */
  function fromAddress(hash) {
    if (!hash.includes("=")) return null;
    const parts = new URLSearchParams(hash.slice(1)), [x, y, half] = parts.has("at") ? numbers(parts, "at", 3) : [1, 1, 1];
    const loop = loopOf(parts);
    if (!(half > 0)) throw wrong("at", `its view has no width: ${half}`);
    return { ...loop, centre: [x, y], half, unit: parts.get("u") === "Hz" ? TURN : 1, pasted: parts.get("k") || "",
      bound: parts.has("b") ? numbers(parts, "b", 1)[0] : 6,
      pinned: parts.has("pin") ? loopOf(new URLSearchParams(parts.get("pin"))) : null };
  }

  return { TURN, say, scientific, power, duration, time, exact, shortest, written, formula, described, python, address, fromAddress };
})();
