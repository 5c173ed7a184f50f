"use strict";
/*
 * Numbers as text, for the live pages: what a reader types or pastes becomes roots, polynomials and
 * numbers, or an error in the field's words; numbers become text; a loop becomes Python, or the
 * address of the page.
 */
const armlockText = (function () {
  const TURN = 2 * Math.PI;

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
    return `${factor} \u00d7 ${power(Number(exponent))}`;
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

  /* A number in as few characters as hold all its digits. */
  function exact(number) {
    const plain = String(number), scientific = number.toExponential();
    return scientific.length < plain.length ? scientific : plain;
  }

  const root = ([re, im]) => im ? `${exact(re)}${im < 0 ? "-" : "+"}${exact(Math.abs(im))}j` : exact(re);

  function written(roots) {
    const left = [...roots], parts = [];
    while (left.length) {
      const [re, im] = left.shift();
      const partner = im ? left.findIndex(([x, y]) => x === re && y === -im) : -1;
      if (partner >= 0) {
        left.splice(partner, 1);
        parts.push(`${exact(re)}\u00b1${exact(Math.abs(im))}j`);
      } else {
        parts.push(root([re, im]));
      }
    }
    return parts.join(", ");
  }

  const list = numbers => numbers.map(exact).join(", ");

  /* ---------------------------------------------------------------------------- in */

  const TOKEN = /\s*(?:((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)|(pi)|([ij](?![a-z]))|(s(?![a-z]))|(\*\*|[-+*/^()\u00b1]))/iy;

  /* Values of an expression are polynomials in s with complex coefficients, the lowest power
   * first: [[re, im], ...]. Two values where there is a plus-minus. */
  function parse(text, refuse) {
    const tokens = [];
    for (TOKEN.lastIndex = 0; TOKEN.lastIndex < text.trimEnd().length;) {
      const match = TOKEN.exec(text);
      if (!match) refuse();
      const [, number, pi, unit, s, sign] = match;
      if (number) tokens.push([[Number(number), 0]]);
      else if (pi) tokens.push([[Math.PI, 0]]);
      else if (unit) tokens.push([[0, 1]]);
      else if (s) tokens.push([[0, 0], [1, 0]]);
      else tokens.push(sign === "**" ? "^" : sign);
    }
    let next = 0, second = null;
    const times = (p, q) => {
      const product = Array.from({ length: p.length + q.length - 1 }, () => [0, 0]);
      p.forEach(([a, b], i) => q.forEach(([c, d], k) => {
        product[i + k][0] += a * c - b * d;
        product[i + k][1] += a * d + b * c;
      }));
      return product;
    };
    const plus = (p, q, sign) => Array.from({ length: Math.max(p.length, q.length) }, (_, k) =>
      [0, 1].map(m => (p[k]?.[m] || 0) + sign * (q[k]?.[m] || 0)));
    const atom = () => {
      const token = tokens[next++];
      if (token === "-") return times([[-1, 0]], raised());
      if (token === "(") {
        const value = sum();
        if (tokens[next++] !== ")") refuse();
        return value;
      }
      if (!Array.isArray(token)) refuse();
      return token;
    };
    const raised = () => {
      let value = atom();
      if (tokens[next] === "^") {
        next++;
        const by = atom();
        const n = by.length === 1 && by[0][1] === 0 ? by[0][0] : NaN;
        if (!(Number.isInteger(n) && n >= 0 && n < 100)) refuse();
        const base = value;
        value = [[1, 0]];
        for (let k = 0; k < n; k++) value = times(value, base);
      }
      return value;
    };
    const product = () => {
      let value = raised();
      for (;;) {
        const token = tokens[next];
        if (token === "*") { next++; value = times(value, raised()); }
        else if (token === "/") {
          next++;
          const by = raised(), [a, b] = by[0], size = a * a + b * b;
          if (by.length > 1 || !size) refuse();
          value = times(value, [[a / size, -b / size]]);
        } else if (Array.isArray(token) || token === "(") value = times(value, raised());
        else return value;
      }
    };
    const sum = () => {
      let sign = 1;
      while (tokens[next] === "+" || tokens[next] === "-") if (tokens[next++] === "-") sign = -sign;
      let value = tokens[next] === "\u00b1" ? [[0, 0]] : plus([[0, 0]], product(), sign);
      for (;;) {
        const token = tokens[next];
        if (token === "+" || token === "-") {
          next++;
          value = plus(value, product(), token === "+" ? 1 : -1);
        } else if (token === "\u00b1" && !second) {
          next++;
          const part = product();
          second = plus(value, part, -1);
          value = plus(value, part, 1);
        } else return value;
      }
    };
    if (!tokens.length) refuse();
    const value = sum();
    if (next < tokens.length) refuse();
    return second ? [value, second] : [value];
  }

  /* Bad text, with the name of the field that holds it. */
  function wrong(field, message) {
    return Object.assign(new RangeError(message), { field });
  }

  /* The elements of a list as MATLAB or Python print it: [..], array(..), columns, a common
   * factor in front. A sign with a space on both sides belongs inside of an element. */
  function elements(field, text) {
    let plain = text.replace(/\u2212/g, "-").replace(/[\u03c0]/g, "pi").replace(/\u00b7/g, "*")
      .replace(/\+\/-/g, "\u00b1").replace(/(np\.|numpy\.)?array\s*\(\s*\[/g, " ")
      .replace(/\]\s*(,\s*dtype=\w+\s*)?\)/g, " ");
    const comma = /[-+]?\d+,\d+/.exec(plain);
    if (comma)
      throw wrong(field, `Write decimals with a point, and a space after the comma between two `
        + `numbers: ${comma[0]} could be either.`);
    let factor = 1;
    const scale = /^[\s=a-z]*((?:\d+\.?\d*)e[+-]?\d+)\s*\*\s*\n/i.exec(plain);
    if (scale) [factor, plain] = [Number(scale[1]), plain.slice(scale[0].length)];
    plain = plain.replace(/[[\]{}]/g, " ").replace(/[ \t]*([*/^\u00b1])[ \t]*/g, "$1")
      .replace(/[ \t]+([+-])[ \t]+/g, "$1").replace(/\(\s+/g, "(").replace(/\s+\)/g, ")");
    return [plain.split(/[,;\s]+/).filter(part => part && !/^\(*\)*$/.test(part)), factor];
  }

  const SUCH = "such as \u22120.1, \u22120.1\u00b12j or -2*pi*0.1";

  /* Roots, in rad/s. Pairs that were rounded apart become one pair of their mean. */
  function readRoots(field, text, name) {
    const [parts, factor] = elements(field, text), found = [];
    for (const part of parts) {
      const extra = part.split("(").length - part.split(")").length;
      const balanced = extra > 0 ? part.replace("(", "") : extra < 0 ? part.replace(/\)$/, "") : part;
      const refuse = () => { throw wrong(field, `${name} are numbers ${SUCH}; \u201c${part}\u201d is none.`); };
      for (const value of parse(balanced, refuse)) {
        if (value.length > 1) refuse();
        found.push(value[0].map(v => factor * v));
      }
    }
    const left = found.filter(([, im]) => im !== 0), paired = found.filter(([, im]) => im === 0);
    while (left.length) {
      const [re, im] = left.shift(), size = Math.hypot(re, im);
      const gaps = left.map(([x, y]) => Math.hypot(x - re, y + im));
      const nearest = gaps.indexOf(Math.min(...gaps));
      if (nearest < 0 || gaps[nearest] > 2e-3 * size)
        throw wrong(field, `${name} come in pairs: ${root([re, im])} lacks ${root([re, -im])}.`);
      const [[x, y]] = left.splice(nearest, 1);
      const [a, b] = [0.5 * (re + x), 0.5 * Math.abs(im - y)];
      paired.push([a, b], [a, -b]);
    }
    return paired;
  }

  /* Real coefficients, the highest power first: a list, or a polynomial in s. */
  function readPolynomial(field, text, name) {
    const refuse = () => {
      throw wrong(field, `${name} is a list of coefficients, the highest power first, or a polynomial `
        + `such as s^2 + 0.1 s; \u201c${text.trim() || "nothing"}\u201d is none.`);
    };
    if (/(?<![a-z])s(?![a-z])/i.test(text)) {
      const plain = text.replace(/\u2212/g, "-").replace(/\u03c0/g, "pi").replace(/\u00b7/g, "*");
      const comma = /\d+,\d+/.exec(plain);
      if (comma) throw wrong(field, `Write decimals with a point, not as in ${comma[0]}.`);
      const [value, second] = parse(plain, refuse);
      if (second || value.some(([, im]) => im !== 0)) refuse();
      return value.map(([re]) => re).reverse();
    }
    const [parts, factor] = elements(field, text);
    if (!parts.length) refuse();
    return parts.map(part => {
      const [value, second] = parse(part, refuse);
      if (second || value.length > 1 || value[0][1] !== 0) refuse();
      return factor * value[0][0];
    });
  }

  /* One real number; `name` is the field's own. */
  function readNumber(field, text, name) {
    const plain = text.trim().replace(/\u2212/g, "-").replace(/\u03c0/g, "pi");
    if (/\d,\d/.test(plain)) throw wrong(field, `Write ${name} with a decimal point, not as ${plain}.`);
    const refuse = () => {
      throw wrong(field, `${name} must be a number, got ${plain ? `\u201c${plain}\u201d` : "nothing"}.`);
    };
    const [value, second] = parse(plain, refuse);
    if (second || value.length > 1 || value[0][1] !== 0 || !Number.isFinite(value[0][0])) refuse();
    return value[0][0];
  }

  /* ---------------------------------------------------------------------------- a whole loop */

  /* The lines that make the same loop with the package. */
  function python(spec, [c1, c2]) {
    const roots = all => `[${all.map(root).join(", ")}]`, low = p => `[${list([...p].reverse())}]`;
    const sensors = {
      dual: () => ["dual", `dual(corner=${spec.corner}, difference=${spec.difference})`],
      modified: () => ["modified_dual", `modified_dual(\n        mean_delay=`
        + `${(spec.tau1 + spec.tau2) / 2}, half_difference=${spec.difference / 2}, corner=${spec.corner}\n    )`],
      own: () => ["SignalMapping", `SignalMapping(\n        ${low(spec.m1)}, ${low(spec.m2)}, `
        + `${low(spec.below)}\n    )`],
    };
    const [name, sensor] = (sensors[spec.sensor] || (() => Array(2).fill(spec.sensor.toUpperCase())))();
    return ["from armlock import Controller, Loop, unstable_roots", `from armlock.sensors import ${name}`,
      "", "controller = Controller(", `    zeros=${roots(spec.zeros)},`, `    poles=${roots(spec.poles)},`,
      `    gain=${spec.gain},`, ")", "loop = Loop(", `    controller, ${sensor},`,
      `    tau1=${spec.tau1}, tau2=${spec.tau2}, delay=${spec.delay},`, ")",
      `print(unstable_roots(loop, ${c1}, ${c2}))`, ""].join("\n");
  }

  const SHORT = { sensor: "s", tau1: "t1", tau2: "t2", delay: "d", gain: "g", corner: "p",
    difference: "dt", zeros: "z", poles: "q", m1: "m1", m2: "m2", below: "mb" };

  /* The address holds all: loop, view, the marked point and the unit of the fields. */
  function address(spec, { centre, half, marked }, unit) {
    const parts = new URLSearchParams();
    for (const [name, key] of Object.entries(SHORT)) {
      const value = spec[name];
      if (value === undefined) continue;
      parts.set(key, name === "zeros" || name === "poles" ? written(value)
        : Array.isArray(value) ? list(value) : value);
    }
    parts.set("at", [...centre, half].join(","));
    if (marked) parts.set("pt", marked.join(","));
    if (unit !== 1) parts.set("u", "Hz");
    return `#${parts}`;
  }

  function fromAddress(hash) {
    const parts = new URLSearchParams(hash.slice(1));
    if (!parts.has("s")) return null;
    const spec = {};
    for (const [name, key] of Object.entries(SHORT)) {
      const text = parts.get(key);
      if (text === null) continue;
      spec[name] = name === "sensor" ? text
        : name === "zeros" || name === "poles" ? readRoots(name, text, name)
          : ["m1", "m2", "below"].includes(name) ? readPolynomial(name, text, name) : Number(text);
    }
    const numbers = (key, other) => (parts.get(key) || other).split(",").map(Number);
    const [x, y, half] = numbers("at", "1,1,1");
    if (![x, y].every(Number.isFinite) || !(half > 0)) throw wrong("at", "its view is no view");
    const marked = parts.has("pt") ? numbers("pt", "") : null;
    return { spec, centre: [x, y], half, unit: parts.get("u") === "Hz" ? TURN : 1,
      marked: marked && marked.length === 2 && marked.every(Number.isFinite) ? marked : null };
  }

  return { TURN, say, scientific, power, duration, exact, written, list, readRoots, readPolynomial,
    readNumber, python, address, fromAddress };
})();
