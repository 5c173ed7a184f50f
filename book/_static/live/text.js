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
    return `${factor}\u00a0\u00d7\u00a0${power(Number(exponent))}`;
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

  /* ---------------------------------------------------------------------------- in */

  const TOKEN = /\s*(?:((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)|(pi)|([ij](?![a-z]))|(s(?![a-z]))|(\*\*|[-+*/^()]))/iy;

  /* Polynomials in s have complex coefficients, the lowest power first: [[re, im], ...]. */
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

  /* The value of an expression, as [numerator, denominator]. */
  function parse(text, refuse) {
    const tokens = [], one = [[1, 0]];
    for (TOKEN.lastIndex = 0; TOKEN.lastIndex < text.trimEnd().length;) {
      const match = TOKEN.exec(text);
      if (!match) refuse();
      const [, number, pi, unit, s, sign] = match;
      if (number) tokens.push([[[Number(number), 0]], one]);
      else if (pi) tokens.push([[[Math.PI, 0]], one]);
      else if (unit) tokens.push([[[0, 1]], one]);
      else if (s) tokens.push([[[0, 0], [1, 0]], one]);
      else tokens.push(sign === "**" ? "^" : sign);
    }
    let next = 0;
    const multiply = ([a, b], [c, d]) => [times(a, c), times(b, d)];
    const add = ([a, b], [c, d], sign) => String(b) === String(d) ? [plus(a, c, sign), b]
      : [plus(times(a, d), times(c, b), sign), times(b, d)];
    const atom = () => {
      const token = tokens[next++];
      if (token === "-") return multiply([[[-1, 0]], one], raised());
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
        const [n, left] = constant(atom(), refuse), base = value;
        if (!(Number.isInteger(n) && left === 0 && n >= 0 && n < 100)) refuse();
        value = [one, one];
        for (let k = 0; k < n; k++) value = multiply(value, base);
      }
      return value;
    };
    const product = () => {
      let value = raised();
      for (;;) {
        const token = tokens[next];
        if (token === "*") { next++; value = multiply(value, raised()); }
        else if (token === "/") {
          next++;
          const [above, under] = raised();
          if (above.every(([a, b]) => a === 0 && b === 0)) refuse();
          value = multiply(value, [under, above]);
        } else if (Array.isArray(token) || token === "(") value = multiply(value, raised());
        else return value;
      }
    };
    const sum = () => {
      const sign = tokens[next] === "-" ? -1 : 1;
      if (tokens[next] === "+" || tokens[next] === "-") next++;
      let value = multiply([[[sign, 0]], one], product());
      for (;;) {
        const token = tokens[next];
        if (token !== "+" && token !== "-") return value;
        next++;
        value = add(value, product(), token === "+" ? 1 : -1);
      }
    };
    if (!tokens.length) refuse();
    const value = sum();
    if (next < tokens.length) refuse();
    return value;
  }

  /* A value without s as a finite complex number. */
  function constant([above, under], refuse) {
    const [[a, b]] = above, [[c, d]] = under, size = c * c + d * d;
    const found = d === 0 ? [a / c, b / c] : [(a * c + b * d) / size, (b * c - a * d) / size];
    if (above.length > 1 || under.length > 1 || !found.every(Number.isFinite)) refuse();
    return found;
  }

  /* The real coefficients of a polynomial, the highest power first. The product of a conjugate pair is rounded. */
  function real(polynomial, refuse) {
    if (polynomial.some(([re, im]) => Math.abs(im) > 1e-12 * Math.abs(re))) refuse();
    return polynomial.map(([re]) => re).reverse();
  }

  const plainSigns = text => text.replace(/[\u2212\u2013\u2014\u2500]/g, "-").replace(/\u03c0/g, "pi")
    .replace(/\u00b7/g, "*");

  /* Bad text, with the name of the field that holds it. */
  function wrong(field, message) {
    return Object.assign(new RangeError(message), { field });
  }

  function refuseCommas(field, plain) {
    const comma = /[-+]?\d+,\d+/.exec(plain);
    if (comma)
      throw wrong(field, `Write decimals with a point, and a space after the comma between two numbers: ${comma[0]} `
        + "could be either.");
  }

  /* The elements of a list as MATLAB or Python print it: [..], array(..), columns, a common
   * factor in front. A sign with a space on both sides belongs inside of an element. */
  function elements(field, text) {
    let plain = plainSigns(text).replace(/\+\/-/g, "\u00b1").replace(/(np\.|numpy\.)?array\s*\(\s*\[/g, " ")
      .replace(/\]\s*(,\s*dtype=\w+\s*)?\)/g, " ");
    refuseCommas(field, plain);
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
      for (const one of balanced.includes("\u00b1") ? [balanced.replace("\u00b1", "+"), balanced.replace("\u00b1", "-")]
        : [balanced]) found.push(constant(parse(one.replace(/^\+/, ""), refuse), refuse).map(v => factor * v));
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

  // tf(numerator, denominator, ...), its coefficients as one number or in brackets.
  const CALL = /\b(?:tf|TransferFunction\w*)\s*\(\s*(?:[\w.]*array\()?(\[[^[\]]*\]|[-+\d.e]+)\)?\s*,\s*(?:[\w.]*array\()?(\[[^[\]]*\]|[-+\d.e]+)(.*)/is;

  /* Numerator and denominator of a controller, the highest power first. It is written as a fraction over a
   * line of dashes, as MATLAB and python-control print it, as tf([1 0.02], [1 0.1 0]), or as an expression. */
  function readController(field, text) {
    const refuse = why => {
      throw wrong(field, `This controller is not understood: ${why
        || "write it such as (s + 0.02)/(s^2 + 0.1 s) or tf([1 0.02], [1 0.1 0])"}.`);
    };
    const none = () => refuse();
    const plain = plainSigns(text).replace(/^\s*\w+\s*=(?=\s*\S)/, ""), given = CALL.exec(plain);
    if (/\bdt\s*[=:](?!\s*None)|sample time|discrete|\bz\b/i.test(plain) || /^\)?\s*,\s*\d/.test(given?.[3]))
      refuse("it is discrete in time");
    if (/exp/i.test(plain)) refuse("write its dead time into the field of the dead time");
    if (given) return given.slice(1, 3).map(part => elements(field, part)[0].map(
      entry => constant(parse(entry, none), none)[0]));
    refuseCommas(field, plain);
    // Without headings and remarks, which have words or signs that no polynomial has.
    const parts = plain.split(/\n[ \t]*-+[ \t]*(?=\n)|\s*\/?\s*-{3,}\s*\/?\s*/).map(part => part.split("\n")
      .filter(line => !/[:=<>'[\]]|[a-z]{3,}/i.test(line)).join(" "));
    if (parts.length > 2) refuse("it has more than one line of dashes");
    const values = parts.map(part => parse(part, none));
    const [[above, under], [over, below] = [[[1, 0]], [[1, 0]]]] = values;
    return [times(above, below), times(under, over)].map(part => real(part, none));
  }

  /* One real number; `name` is the field's own. */
  function readNumber(field, text, name) {
    const plain = plainSigns(text.trim());
    refuseCommas(field, plain);
    const refuse = () => {
      throw wrong(field, `${name} must be a number, got ${plain ? `\u201c${plain}\u201d` : "nothing"}.`);
    };
    const [re, im] = constant(parse(plain, refuse), refuse);
    if (im !== 0) refuse();
    return re;
  }

  /* ---------------------------------------------------------------------------- a whole loop */

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
    return [...unit === 1 ? [] : ["from math import pi", ""],
      "from armlock import Controller, Loop, unstable_roots", `from armlock.sensors import ${name}`,
      "", ...unit === 1 ? [] : ["hertz = 2 * pi"],
      "controller = Controller(", `    zeros=${roots(spec.zeros)},`, `    poles=${roots(spec.poles)},`,
      `    gain=${spec.gain},`, ")", "loop = Loop(", `    controller, ${sensor},`,
      `    tau1=${spec.tau1}, tau2=${spec.tau2}, delay=${spec.delay},`, ")",
      `print(unstable_roots(loop, ${c1}, ${c2}))`, ""].join("\n");
  }

  const SHORT = { sensor: "s", tau1: "t1", tau2: "t2", delay: "d", gain: "g", corner: "p",
    difference: "dt", zeros: "z", poles: "q" };
  const NEEDED = sensor => ["sensor", "tau1", "tau2", "delay", "gain", "zeros", "poles",
    ...["dual", "modified"].includes(sensor) ? ["corner", "difference"] : []];

  /* The address holds all: loop, view, the held point and the unit of the fields. */
  function address(spec, { centre, half, held }, unit) {
    const parts = new URLSearchParams();
    for (const [name, key] of Object.entries(SHORT)) {
      const value = spec[name];
      if (value === undefined || !NEEDED(spec.sensor).includes(name)) continue;
      parts.set(key, Array.isArray(value) ? written(value) : value);
    }
    parts.set("at", [...centre, half].join(","));
    if (held) parts.set("pt", held.join(","));
    if (unit !== 1) parts.set("u", "Hz");
    return `#${parts}`;
  }

  /* What an address holds; null where it is none of a loop. An error says what it lacks. */
  function fromAddress(hash) {
    const parts = new URLSearchParams(hash.slice(1)), sensor = parts.get("s");
    if (!hash.includes("=")) return null;
    const needed = NEEDED(sensor).filter(name => name !== "delay"), spec = { delay: 0 };
    for (const [name, key] of Object.entries(SHORT)) {
      const text = parts.get(key);
      if (text === null && needed.includes(name)) throw wrong(name, `it has no \u201c${key}=\u201d`);
      if (text === null) continue;
      spec[name] = name === "sensor" ? text
        : name === "zeros" || name === "poles" ? readRoots(name, text, name)
          : readNumber(name, text, `\u201c${key}\u201d`);
    }
    const numbers = (key, size) => {
      const found = parts.get(key).split(",").map(text => text.trim() ? Number(text) : NaN);
      if (found.length === size && found.every(Number.isFinite)) return found;
      throw wrong(key, `\u201c${key}=${parts.get(key)}\u201d is not ${size} numbers`);
    };
    const [x, y, half] = parts.has("at") ? numbers("at", 3) : [1, 1, 1];
    if (!(half > 0)) throw wrong("at", `its view has no width: ${half}`);
    return { spec, centre: [x, y], half, unit: parts.get("u") === "Hz" ? TURN : 1,
      held: parts.has("pt") ? numbers("pt", 2) : null };
  }

  return { TURN, say, scientific, power, duration, exact, shortest, written, readRoots, readController, readNumber,
    python, address, fromAddress };
})();
