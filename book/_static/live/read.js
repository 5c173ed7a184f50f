"use strict";
/*
 * Numbers, roots and whole controllers as a reader types or pastes them: the whole text is understood, or
 * it is refused with the place.
 *
 * A text holds statements, as MATLAB, Octave, Julia, Python and Maxima write or print them. What is printed over
 * several lines, fractions and matrices, is first written in one line. All numbers are exact fractions,
 * each with what the rounding of its last printed digit may add, so that a product keeps its factors, a
 * state space its determinant, and a pole at s = 0 its place.
 */
const armlockRead = (function () {
  /* ---------------------------------------------------------------------------- exact numbers */

  const bits = v => v.toString(16).length * 4;

  // What the arithmetic of a text may cost, in bits, so that no text blocks the page: about a second.
  const COST = 1.5e7;
  let spent = 0;
  function spend(cost) {
    if ((spent += cost) > COST) throw Object.assign(new RangeError(""), { costly: true });
  }

  /* Fractions [n, d] of whole numbers, d > 0, in lowest terms. */
  const divisor = (a, b) => { while (b) [a, b] = [b, a % b]; return a < 0n ? -a : a; };
  const fraction = (n, d = 1n) => {
    if (d === 1n) return [n, d];
    spend(Math.min(bits(n), bits(d)));
    const shared = divisor(n, d) * (d < 0n ? -1n : 1n);
    return [n / shared, d / shared];
  };
  const NIL = [0n, 1n];
  const sumOf = ([a, b], [c, d]) => !a ? [c, d] : !c ? [a, b] : b === d ? fraction(a + c, b) : fraction(a * d + c * b, b * d);
  const productOf = ([a, b], [c, d]) => a && c ? fraction(a * c, b * d) : NIL;

  /* The nearest double. */
  function double([n, d]) {
    if (!n) return 0;
    const size = n < 0n ? -n : n, shift = 80 + bits(d) - bits(size);
    const scaled = shift > 0 ? (size << BigInt(shift)) / d : size / (d << BigInt(-shift));
    // The last bit stands for all that was cut off. Two steps, because a power may be too small alone.
    const half = Math.trunc(-shift / 2);
    return (n < 0n ? -1 : 1) * Number(scaled | 1n) * 2 ** half * 2 ** (-shift - half);
  }

  function ofDouble(value) {
    let down = 0n;
    for (; !Number.isInteger(value); value *= 2) down++;
    return fraction(BigInt(value), 1n << down);
  }

  /* Complex numbers: real and imaginary part, and by how much the number may be off. */
  const number = (re, im = NIL, off = 0) => ({ re, im, off });
  const ONE = number([1n, 1n]), ZERO = number(NIL), MINUS = number([-1n, 1n]);
  const sizeOf = ({ re, im }) => Math.hypot(double(re), double(im));
  const isNil = ({ re, im }) => !re[0] && !im[0];
  const plus = (a, b) => number(sumOf(a.re, b.re), sumOf(a.im, b.im), a.off + b.off);
  const negative = a => number([-a.re[0], a.re[1]], [-a.im[0], a.im[1]], a.off);
  const times = (a, b) => (spend(10), number(sumOf(productOf(a.re, b.re), negative({ re: productOf(a.im, b.im), im: NIL }).re),
    sumOf(productOf(a.re, b.im), productOf(a.im, b.re)),
    a.off || b.off ? sizeOf(a) * b.off + sizeOf(b) * a.off + a.off * b.off : 0));
  const over = (a, b) => {
    const { re, im } = b, [n, d] = sumOf(productOf(re, re), productOf(im, im)), part = [d, n], size = sizeOf(b);
    const inverse = number(productOf(re, part), productOf([-im[0], im[1]], part), b.off && b.off / (size * (size - b.off)));
    return times(a, inverse);
  };

  /* ---------------------------------------------------------------------------- polynomials */

  /* Coefficients, the lowest power first. */
  const trimmed = p => { while (p.length && isNil(p.at(-1))) p = p.slice(0, -1); return p; };
  const multiply = (p, q) => {
    const product = Array(p.length + q.length - 1).fill(ZERO);
    p.forEach((a, i) => q.forEach((b, k) => { product[i + k] = plus(product[i + k], times(a, b)); }));
    return product;
  };
  const added = (p, q) => Array.from({ length: Math.max(p.length, q.length) }, (_, k) => plus(p[k] || ZERO, q[k] || ZERO));
  const expanded = all => all.reduce(multiply, [ONE]);
  const S = [ZERO, ONE];

  /* Quotient and remainder. */
  function divide(p, q) {
    const quotient = [];
    for (let rest = trimmed(p); ; rest = trimmed(rest.slice(0, -1))) {
      if (rest.length < q.length) return [trimmed(Array.from(quotient, v => v || ZERO)), rest];
      const share = over(rest.at(-1), q.at(-1)), from = rest.length - q.length;
      quotient[from] = share;
      rest = rest.map((v, k) => k < from ? v : plus(v, negative(times(share, q[k - from]))));
    }
  }

  /* Whether two real polynomials have no common root for certain: they have none if they have none modulo a prime
   * that does not divide what leads them. */
  const PRIME = 2n ** 61n - 1n, residue = v => (v % PRIME + PRIME) % PRIME;
  function reciprocal(v) {
    let found = 1n;
    for (let power = PRIME - 2n; power; power >>= 1n, v = v * v % PRIME) if (power & 1n) found = found * v % PRIME;
    return found;
  }
  function coprime(p, q) {
    if ([...p, ...q].some(({ re: [, d] }) => !residue(d))) return false;
    let [a, b] = [p, q].map(all => all.map(({ re: [n, d] }) => d === 1n ? residue(n) : residue(n) * reciprocal(residue(d)) % PRIME));
    if (!a.at(-1) || !b.at(-1)) return false;
    while (b.length > 1) {
      const inverse = reciprocal(b.at(-1));
      while (a.length >= b.length) {
        const share = a.at(-1) * inverse % PRIME, from = a.length - b.length;
        b.forEach((v, k) => { a[from + k] = residue(a[from + k] - share * v); });
        while (a.length && !a.at(-1)) a.pop();
      }
      [a, b] = [b, a];
    }
    return b.length === 1;
  }

  /* The greatest common divisor of two real polynomials. */
  const shared = (p, q) => {
    if (q.length && coprime(p, q)) return [ONE];
    while (q.length) [p, q] = [q, divide(p, q)[1]];
    return p.map(v => over(v, p.at(-1)));
  };
  const derivative = p => p.slice(1).map((v, k) => times(v, number([BigInt(k + 1), 1n])));

  /* Roots of a polynomial with real coefficients, the highest power first, by Aberth's method.
   * They come in exact pairs. The first guesses lie where the polynomial's Newton polygon has
   * its slopes, so that sizes over many decades do no harm. */
  function rootsOf(coefficients) {
    const from = coefficients.findIndex(c => c !== 0);
    if (from < 0) return [];
    const c = coefficients.slice(from).reverse(), found = [];
    while (c[0] === 0) { c.shift(); found.push([0, 0]); }
    const n = c.length - 1, x = [], y = [];
    for (let low = 0; low < n;) {
      const rise = k => (Math.log(Math.abs(c[k])) - Math.log(Math.abs(c[low]))) / (k - low);
      let high = low + 1;
      while (c[high] === 0) high++;
      for (let k = high + 1; k <= n; k++) if (c[k] !== 0 && rise(k) >= rise(high)) high = k;
      for (let k = low; k < high; k++) {
        const size = Math.exp(-rise(high)), turn = 2 * Math.PI * (k - low) / (high - low) + 0.7 * n;
        x.push(size * Math.cos(turn));
        y.push(size * Math.sin(turn));
      }
      low = high;
    }
    // f' / f at a point; outside of the unit circle from the reversed polynomial, with z = 1 / s:
    // n z - z^2 f' / f.
    const slope = (c, re, im) => {
      const n = c.length - 1, square = re * re + im * im, far = square > 1;
      const [a, b] = far ? [re / square, -im / square] : [re, im];
      let [p, q, dp, dq] = [0, 0, 0, 0];
      for (let k = 0; k <= n; k++) {
        [dp, dq] = [dp * a - dq * b + p, dp * b + dq * a + q];
        [p, q] = [p * a - q * b + c[far ? k : n - k], p * b + q * a];
      }
      const size = p * p + q * q;
      const [u, v] = size ? [(dp * p + dq * q) / size, (dq * p - dp * q) / size] : [Infinity, 0];
      if (!far) return [u, v];
      const zr = a * a - b * b, zi = 2 * a * b;
      return [n * a - (zr * u - zi * v), n * b - (zr * v + zi * u)];
    };
    for (let round = 0, moved = 1; round < 200 && moved > 1e-15; round++) {
      moved = 0;
      for (let i = 0; i < n; i++) {
        let [u, v] = slope(c, x[i], y[i]);
        if (!Number.isFinite(u + v)) continue;
        for (let k = 0; k < n; k++) if (k !== i) {
          const dx = x[i] - x[k], dy = y[i] - y[k], square = dx * dx + dy * dy || 1e-300;
          u -= dx / square;
          v += dy / square;
        }
        const square = u * u + v * v, mx = u / square, my = -v / square;
        if (!Number.isFinite(mx + my)) continue;
        x[i] -= mx;
        y[i] -= my;
        moved = Math.max(moved, Math.hypot(mx, my) / (Math.hypot(x[i], y[i]) || 1));
      }
    }
    const left = x.map((re, k) => [re, y[k]]);
    // The upper one of each pair, the rest real.
    while (left.length) {
      const most = left.reduce((a, b) => Math.abs(b[1]) / Math.hypot(...b)
        > Math.abs(a[1]) / Math.hypot(...a) ? b : a);
      left.splice(left.indexOf(most), 1);
      const gap = r => Math.hypot(r[0] - most[0], r[1] + most[1]);
      const partner = left.length ? left.reduce((a, b) => gap(b) < gap(a) ? b : a) : null;
      if (!partner || Math.abs(most[1]) < 1e-12 * Math.abs(most[0]) || gap(most) < gap(partner)) {
        found.push([most[0], 0]);
      } else {
        left.splice(left.indexOf(partner), 1);
        const re = 0.5 * (most[0] + partner[0]), im = 0.5 * Math.abs(most[1] - partner[1]);
        found.push([re, im], [re, -im]);
      }
    }
    return found;
  }

  /* The roots of a real polynomial, as pairs of doubles. Multiple roots are found exactly, and so is what
   * lies on the imaginary axis. */
  function rootsExactly(p) {
    p = trimmed(p.map(({ re }) => number(re)));
    if (p.length < 2) return [];
    const found = [];
    let common = shared(p, derivative(p)), [rest] = divide(p, common);
    for (let m = 1; rest.length > 1; m++) {
      const next = shared(rest, common), [part] = divide(rest, next);
      for (let k = 0; k < m; k++) found.push(...simpleRoots(part));
      [rest, [common]] = [next, divide(common, next)];
    }
    return found;
  }

  function simpleRoots(p) {
    if (p.length < 2) return [];
    if (p.length === 2) return [[0 - double(over(p[0], p[1]).re), 0]];
    // Roots that come with their opposites: those of a polynomial in s^2.
    const even = p.length % 2 && p.every((v, k) => k % 2 === 0 || isNil(v));
    const mirrored = even ? p : shared(p, p.map((v, k) => k % 2 ? negative(v) : v));
    if (!even && mirrored.length > 1) return [...simpleRoots(mirrored), ...simpleRoots(divide(p, mirrored)[0])];
    if (even) return simpleRoots(p.filter((_, k) => k % 2 === 0)).flatMap(([re, im]) => {
      const size = Math.hypot(re, im);
      if (im) {
        const [a, b] = [Math.sqrt((size + re) / 2), Math.sqrt((size - re) / 2)];
        return im > 0 ? [[a, b], [a, -b]] : [[-a, b], [-a, -b]];
      }
      return re < 0 ? [[0, Math.sqrt(size)], [0, -Math.sqrt(size)]] : [[Math.sqrt(size), 0], [-Math.sqrt(size), 0]];
    });
    if (p.length === 3) {
      const [c, b] = [over(p[0], p[2]).re, over(p[1], p[2]).re], half = fraction(b[0], 2n * b[1]);
      const inner = double(sumOf(productOf(half, half), [-c[0], c[1]])), root = Math.sqrt(Math.abs(inner));
      if (inner < 0) return [[-double(half), root], [-double(half), -root]];
      const far = -double(half) - (double(half) < 0 ? -root : root);
      return [[far, 0], [double(c) / far, 0]];
    }
    // The rounding of the coefficients to doubles is made good by steps of Newton's method.
    const scale = p.reduce((all, { re: [, d] }) => all / divisor(all, d) * d, 1n), whole = p.map(({ re: [n, d] }) => n * (scale / d));
    const slope = whole.slice(1).map((v, k) => v * BigInt(k + 1)), size = Math.max(...whole.map(bits));
    return rootsOf(p.map(v => double(v.re)).reverse()).map(([re, im]) => {
      for (let k = 0; k < 3; k++) {
        spend(1e-3 * p.length ** 2 * size);
        const [dx, dy] = newton(whole, slope, re, im);
        if (!(Math.hypot(dx, dy) < 1e-3 * Math.hypot(re, im))) break;
        [re, im] = [re - dx, im - dy];
      }
      return [re, im];
    });
  }

  /* p / p' at a double, exactly but for the last rounding; coefficients are whole numbers. */
  function newton(p, slope, re, im) {
    const [[a, c], [b, d]] = [re, im].map(ofDouble), unit = c > d ? c : d, [x, y] = [a * (unit / c), b * (unit / d)];
    // Horner's rule, times a power of the unit, which is that of the doubles' last bit.
    const value = q => q.reduceRight(([u, v, power], w) => [u * x - v * y + w * power, u * y + v * x, power * unit], [0n, 0n, 1n]);
    const [u, v] = value(p), [s, t] = value(slope), below = (s * s + t * t) * unit;
    return below ? [double([u * s + v * t, below]), double([v * s - u * t, below])] : [0, 0];
  }

  /* Whether the roots of a real polynomial may cross the imaginary axis, or leave s = 0, within what its
   * coefficients may be off. On the axis its values fill a rectangle, whose sides are real parts, of
   * even powers, and imaginary ones. The frequencies at which a rectangle holds 0 end where a side does. */
  function mayCross(p) {
    if (p.every(({ off }) => off === 0)) return false;
    const part = (odd, read) => p.map(read).filter((_, k) => k % 2 === odd);
    const turned = values => values.map((v, k) => k % 2 ? -v : v);
    const at = (values, u) => values.reduceRight((sum, v) => sum * u + v, 0);
    const sides = [0, 1].map(odd => [turned(part(odd, ({ re }) => double(re))), part(odd, ({ off }) => off)]);
    const holds = ([values, off], u) => Math.abs(at(values, u)) <= at(off, u) * (1 + 1e-9);
    // Of even and of odd polynomials the roots stay on the axis as far as they are apart.
    if (sides.some(([values, off]) => [...values, ...off].every(v => v === 0))) return holds(sides[0], 0);
    return holds(sides[0], 0) || sides.some(([values, off]) => [1, -1].some(sign =>
      rootsExactly(values.map((v, k) => number(ofDouble(v + sign * off[k])))).some(([u, im]) =>
        im === 0 && u > 0 && sides.every(side => holds(side, u)))));
  }

  /* ---------------------------------------------------------------------------- systems */

  /* A system is k prod(zeros) / prod(poles) exp(-s delay). Its factors are polynomials whose leading
   * coefficient is one; they are multiplied out only for a sum. */
  const system = (k, zeros = [], poles = [], delay = NIL) => ({ k, zeros, poles, delay });
  const scalar = value => system(value);
  const LAPLACE = system(ONE, [S]);
  const isScalar = ({ k, zeros, poles, delay }) => k && !zeros.length && !poles.length && !delay[0];
  const inSeries = (a, b) => system(times(a.k, b.k), [...a.zeros, ...b.zeros], [...a.poles, ...b.poles], sumOf(a.delay, b.delay));
  const inverse = a => system(over(ONE, a.k), a.poles, a.zeros, [-a.delay[0], a.delay[1]]);

  function ofPolynomial(p) {
    p = trimmed(p);
    if (!p.length) return scalar(ZERO);
    const zeros = [], k = p.at(-1);
    while (p.length > 1 && isNil(p[0]) && !p[0].off) { zeros.push(S); p = p.slice(1); }
    if (p.length > 1) zeros.push(p.map(v => over(v, k)));
    return system(k, zeros);
  }

  /* The factors of one list that the other does not have, and those that both have. */
  function without(all, others) {
    const name = p => p.map(({ re, im }) => `${re}|${im}`).join(), left = others.map(name), rest = [], both = [];
    for (const p of all) {
      const k = left.indexOf(name(p));
      if (k >= 0) left.splice(k, 1);
      (k < 0 ? rest : both).push(p);
    }
    return [rest, both];
  }

  function inParallel(a, b, refuse) {
    if (isNil(a.k) && !a.k.off) return b;
    if (isNil(b.k) && !b.k.off) return a;
    if (String(a.delay) !== String(b.delay))
      refuse("a sum with different dead times has no zeros, poles, gain and one dead time");
    const [mine, poles] = without(a.poles, b.poles), [yours] = without(b.poles, a.poles);
    const [above, zeros] = without(a.zeros, b.zeros), [beside] = without(b.zeros, a.zeros);
    const scaled = (k, all) => expanded(all).map(v => times(k, v));
    const sum = ofPolynomial(added(scaled(a.k, [...above, ...yours]), scaled(b.k, [...beside, ...mine])));
    return isNil(sum.k) ? sum : inSeries(sum, system(ONE, zeros, [...poles, ...mine, ...yours], a.delay));
  }

  /* det(s I - A) and the adjugate of s I - A, the lowest power first, for a matrix of whole numbers:
   * Faddeev's and Leverrier's recursion, whose divisions leave no remainder. */
  function characteristic(a) {
    const n = a.length, product = (x, y) => x.map(row => y[0].map((_, k) => row.reduce((sum, v, i) => sum + v * y[i][k], 0n)));
    const coefficients = Array(n + 1).fill(1n), adjugate = [];
    let m = a.map((row, i) => row.map((_, k) => BigInt(i === k)));
    for (let k = n - 1; k >= 0; k--) {
      adjugate[k] = m;
      const next = product(a, m), c = -next.reduce((sum, row, i) => sum + row[i], 0n) / BigInt(n - k);
      coefficients[k] = c;
      m = next.map((row, i) => row.map((v, j) => v + (i === j ? c : 0n)));
    }
    return { coefficients, adjugate };
  }

  /* What rounding makes of a coefficient that is meant to be zero, as a share of its terms: the package
   * refuses such a system until it is stated what is meant. */
  const ROUNDED = 2 ** -44, MULTIPLIED = 2 ** -39;
  const hide = (value, off) => { if (!isNil(value) && sizeOf(value) < off) value.off = Math.max(value.off, off); };

  /* A state space of one input and output, exactly: numerator and denominator are determinants. */
  function ofStates(a, b, c, d, refuse) {
    const n = a.length, column = b.flat(), row = c.flat(), [[direct]] = d;
    if (a.some(one => one.length !== n) || column.length !== n || row.length !== n || d.length * d[0].length !== 1)
      refuse(`A, B, C and D must be ${n} by ${n}, ${n} by 1, 1 by ${n} and 1 by 1`);
    for (const v of [...a.flat(), ...column, ...row, direct]) if (v.im[0]) refuse("a state space must be real");
    const scale = [a, b, c].flat(2).reduce((all, { re: [, one] }) => all / divisor(all, one) * one, 1n);
    const whole = ({ re: [p, q] }) => p * (scale / q), level = BigInt(n);
    const first = characteristic(a.map(one => one.map(whole)));
    // The matrix is scaled: s^k has scale^(k - n) of the determinant, and one power more of the adjugate.
    const power = k => k < n ? [1n, scale ** (level - BigInt(k))] : [scale ** BigInt(k - n), 1n];
    const [bs, cs] = [column.map(whole), row.map(whole)], wholes = a.map(one => one.map(whole));
    // How much a coefficient moves if entries may be off: by the adjugates of A and of A - B C.
    const closed = characteristic(wholes.map((one, i) => one.map((v, k) => v * scale - bs[i] * cs[k])));
    const [bd, cd] = [column, row].map(all => all.map(v => double(v.re))), feed = double(direct.re) - 1;
    const along = (all, weight) => all.reduce((sum, v, i) => sum + (v && v * Math.abs(weight(i))), 0);
    const moves = (read, value, at, other) => {
      const entries = weight => a.reduce((sum, one, i) => sum + along(one.map(read), k => weight(k, i)), 0);
      return [entries(at), read(direct) * Math.abs(double(value.re)) + entries((i, j) => feed * at(i, j) + other(i, j))
        + along(row.map(read), i => bd.reduce((sum, w, j) => sum + w * at(i, j), 0))
        + along(column.map(read), j => cd.reduce((sum, w, i) => sum + w * at(i, j), 0))];
    };
    const below = [], above = [];
    for (let k = 0; k <= n; k++) {
      const inner = k < n ? first.adjugate[k] : null;
      const at = inner ? (i, j) => double(productOf([inner[i][j], 1n], power(k + 1))) : () => 0;
      const value = number(productOf([first.coefficients[k], 1n], power(k)));
      let sum = times(direct, value);
      if (inner) {
        const through = cs.reduce((all, v, i) => all + v * inner[i].reduce((part, w, j) => part + w * bs[j], 0n), 0n);
        sum = plus(sum, number(productOf(fraction(through, scale * scale), power(k + 1))));
        // That of A - B C was found of scale^2 (A - B C).
        const other = (i, j) => double(productOf([closed.adjugate[k][i][j], 1n],
          [1n, scale ** (2n * (level - 1n - BigInt(k)))]));
        [value.off, sum.off] = moves(v => v.off, value, at, other);
        if (k === 0) moves(v => ROUNDED * Math.abs(double(v.re)), value, at, other).forEach((off, i) => hide([value, sum][i], off));
      }
      below.push(value);
      above.push(sum);
    }
    return inSeries(ofPolynomial(above), inverse(ofPolynomial(below)));
  }

  /* ---------------------------------------------------------------------------- lines */

  const DIGITS = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
  const SIGNS = { "\u2212": "-", "\u2013": "-", "\u2014": "-", "\u2500": "-", "\u00b7": "*", "\u22c5": "*", "\u00d7": "*",
    "\u03c0": " pi ", "\u00a0": " ", "\u207b": "-" };

  /* A piece of text that knows where in the pasted text each of its characters stood. */
  class Piece {
    constructor(text, at) { [this.text, this.at] = [text, typeof at === "number" ? Array(text.length).fill(at) : at]; }
    slice(from, to = this.text.length) { return new Piece(this.text.slice(from, to), this.at.slice(from, to)); }
    get bare() { return this.text.trim(); }
    get from() { return this.at[this.text.search(/\S/)] ?? this.at[0] ?? 0; }
    /* Without what stands there, the rest in its place. */
    blank(pattern) { return new Piece(this.text.replace(pattern, all => " ".repeat(all.length)), this.at); }
    static join(...parts) {
      return new Piece(parts.map(part => part.text).join(""), parts.flatMap(part => part.at));
    }
  }

  /* The lines of a text, in plain signs and without comments and prompts. */
  function linesOf(text) {
    let raised = false;
    const lines = [[]];
    Array.from(text.replace(/\r\n?/g, "\n").replace(/\t/g, "    ")).forEach((sign, at) => {
      const up = DIGITS.includes(sign) || sign === "\u207b";
      const plain = DIGITS.includes(sign) ? String(DIGITS.indexOf(sign)) : SIGNS[sign] ?? sign;
      if (sign === "\n") lines.push([]);
      else for (const one of up && !raised ? `^${plain}` : plain) lines.at(-1).push([one, at]);
      raised = up;
    });
    return lines.map(line => new Piece(line.map(([sign]) => sign).join(""), line.map(([, at]) => at))
      .blank(/^\s*(>>>?|\.\.\.(?= )|julia>|In \[\d+\]:|Out\[\d+\]:)/).blank(/[%#].*$/));
  }

  const DISCRETE = "it is discrete in time, and the page takes controllers in s";
  // Lines that say nothing about the controller, and lines that say that it is none.
  const REMARK = new RegExp(["<\\w+>(: \\S+)?", "(Inputs|Outputs) \\(1\\): .*", "States \\(\\d+\\): .*",
    "(\\w+\\.)*\\w+\\{Continuous,.*\\}", "Continuous-time .*", "Static gain\\.", "Transfer function '.*' from input .*",
    "From input .* to output .*:", "Model Properties", "dt = (None|0)", "import [\\w., ]+( as \\w+)?",
    "from [\\w.]+ import [\\w*, ]+", "using [\\w, ]+", "clear( all)?;?", "clc;?", "close all;?", "format (long|short)( g)?;?",
    "pkg load control;?", "syms s;?"].map(part => `^(${part})$`).join("|"));
  const WITH = /^with( [A-Z]\w = [-+.\de]+,?)+$/;
  const NOT = [[/^Sampl(e|ing) time\b|^Discrete|\{Discrete\b|^dt\s*=/, DISCRETE],
    [/^(Inputs|Outputs) \(/, "it has several inputs or outputs"]];

  /* Whether a line holds the lines of fractions and nothing that could be something else: the runs of
   * dashes that have something above and below. */
  function rulesOf(lines, k) {
    const near = (step, from, to) => {
      for (let i = k + step; lines[i]; i += step) if (lines[i].bare) return lines[i].text.slice(from, to).trim() !== "";
      return false;
    };
    const { text, bare } = lines[k], found = [];
    for (const { 0: run, index } of text.matchAll(/-+/g)) {
      const alone = bare === run, last = text.slice(index).trim() === run;
      if (run.length > 1 || last) if (alone && k > 0 || near(-1, index, index + run.length) && near(1, index, index + run.length))
        found.push([index, index + run.length]);
    }
    return found;
  }

  /* Several lines of one polynomial as one. Powers may stand on lines of their own, right above the
   * place that they take. */
  function inOneLine(lines, refuse) {
    let whole = null;
    for (let k = 0; k < lines.length; k++) {
      let line = lines[k];
      if (!line.bare) continue;
      if (/^[\d\s]+$/.test(line.text) && lines[k + 1]?.bare) {
        const powers = line, base = lines[++k];
        let from = 0, made = new Piece("", []);
        for (const { 0: digits, index } of powers.text.matchAll(/\d+/g)) {
          const blank = base.text.slice(index, index + digits.length).trim() === "";
          if (!blank || !/[s)]/.test(base.text[index - 1] || ""))
            refuse(powers.at[index], digits, `the power ${digits} stands over no s: its line has moved`);
          made = Piece.join(made, base.slice(from, index), new Piece("^", powers.at[index]), powers.slice(index, index + digits.length));
          from = index + digits.length;
        }
        line = Piece.join(made, base.slice(from));
      }
      if (whole && !/^[-+]\s/.test(line.bare) && !/[-+*]$/.test(whole.bare) && !(/\)$/.test(whole.bare) && /^\(/.test(line.bare)))
        refuse(line.from, line.bare, "this line does not go on with the one above");
      whole = whole ? Piece.join(whole, new Piece(" ", line.from), line) : line;
    }
    return whole;
  }

  /* Fractions that stand over several lines, each in one line. */
  function fractionsInLine(lines, refuse) {
    const done = [], ends = line => !line || /=\s*$/.test(line.text) || line.remark;
    let from = 0;
    for (let k = 0; k < lines.length; k++) {
      const rules = rulesOf(lines, k);
      if (!rules.length) continue;
      let [first, last] = [k, k];
      while (first > from && !ends(lines[first - 1])) first--;
      while (last < lines.length - 1 && !ends(lines[last + 1]) && !/=/.test(lines[last + 1].text)) last++;
      for (let i = first; i <= last; i++) if (i !== k && rulesOf(lines, i).length)
        refuse(lines[i].from, lines[i].bare, "it has more than one line of dashes");
      const label = lines[k].blank(/^\s*\w+:(?= )/), outside = label.text.replace(/-+/g, run => run.length > 1 || rules.length ? "" : run)
        .replace(/^[^=]*=/, "").trim();
      const taken = (lines, [a, b]) => {
        // Where nothing stands beside the dashes, all above and below them is theirs.
        if (rules.length === 1 && !outside) return inOneLine(lines, refuse);
        for (const line of lines) for (const { 0: word, index } of line.text.matchAll(/\S+(?: \S+)*/g))
          if (!rules.some(([a, b]) => index >= a && index + word.length <= b))
            refuse(line.at[index], word, "it stands neither above nor below one line of dashes");
        return inOneLine(lines.map(line => new Piece(" ".repeat(Math.min(a, line.text.length)) + line.text.slice(a, b),
          line.at.slice(0, b))), refuse);
      };
      let made = new Piece("", []), begin = 0;
      for (const [a, b] of rules) {
        const parts = [lines.slice(first, k), lines.slice(k + 1, last + 1)].map(part => taken(part, [a, b]));
        if (parts.some(part => !part)) refuse(lines[k].at[a], "---", "a fraction needs a numerator above its dashes and a denominator below");
        const sign = text => new Piece(text, lines[k].at[a]);
        made = Piece.join(made, label.slice(begin, a), sign("(("), parts[0], sign(")/("), parts[1], sign("))"));
        begin = b;
      }
      done.push(...lines.slice(from, first), Piece.join(made, label.slice(begin)));
      from = last + 1;
      k = last;
    }
    return [...done, ...lines.slice(from)];
  }

  const ENTRY = "[-+]?(\\d+\\.?\\d*|\\.\\d+)(e[-+]?\\d+)?", ROW = new RegExp(`^${ENTRY}(\\s+${ENTRY})*$`, "i");

  /* Matrices that stand over several lines after "name =", with or without names of rows and columns. */
  function matricesInLine(lines, refuse) {
    const done = [];
    for (let k = 0; k < lines.length; k++) {
      const line = lines[k], following = lines.slice(k + 1).find(one => one.bare);
      // The name of a whole state space, above those of its matrices.
      if (/^[A-Za-z]\w* =$/.test(line.bare) && /^(a|b|c|d|\w+\.[abcd]) =$/i.test(following?.bare)) continue;
      done.push(line);
      if (!/^\s*[\w.]+\s*=\s*$/.test(line.text)) continue;
      let i = k + 1, rows = [], columns = null, factor = null;
      const skip = () => { while (lines[i] && !lines[i].bare) i++; };
      skip();
      if (lines[i] && /^[\d.]+e[+-]?\d+\s*\*$/i.test(lines[i].bare)) { factor = lines[i++]; skip(); }
      if (/^[A-Za-z_]\w*(\s+[A-Za-z_]\w*)*$/.test(lines[i]?.bare) && /^\w+\s+[-+.\d]/.test(lines[i + 1]?.bare))
        columns = lines[i++].bare.split(/\s+/).length;
      for (; lines[i]?.bare; i++) {
        const row = columns ? lines[i].blank(/^\s*[A-Za-z_]\w*(?=\s)/) : lines[i];
        if (!ROW.test(row.bare) && !(columns === null && /^[-+.\dijeE\s]+$/.test(row.bare))) break;
        if (columns && row.bare.split(/\s+/).length !== columns) refuse(row.from, row.bare, `its columns are ${columns}`);
        rows.push(row);
      }
      if (!rows.length) continue;
      const sign = text => new Piece(text, rows[0].from), last = done.pop();
      done.push(Piece.join(last, ...factor ? [factor] : [], sign("["), ...rows.flatMap(row => [row, sign(";")]), sign("]")));
      k = i - 1;
    }
    return done;
  }

  /* ---------------------------------------------------------------------------- words */

  const TEX = { "**": "^", "\\frac": "\\frac", "\\dfrac": "\\frac", "\\tfrac": "\\frac", "\\cdot": "*", "\\times": "*" };
  const WORD = new RegExp(["(?<space>[ \\t]+|\\.\\.\\.[^\\n]*\\n|\\\\\\n|\\\\[,;!: ]|\\\\(?:left|right|quad)(?![A-Za-z])|\\$+)", "(?<line>\\n)",
    "(?<digits>(?:\\d+\\.?\\d*|\\.\\d+)(?:[eEdD][-+]?\\d+)?)(?<unit>[ij](?!\\w))?", "(?<name>[A-Za-z_]\\w*(?:\\.[A-Za-z_]\\w*)*)",
    "(?<quoted>'[^'\\n]*'|\"[^\"\\n]*\")", "(?<sign>\\*\\*|\\.[*/^]|[-+*/^()[\\]{},;=:]|\\\\(?:[dt]?frac|cdot|times)(?![A-Za-z]))"].join("|"), "y");

  function wordsOf(piece, refuse) {
    const words = [], { text, at } = piece;
    let gap = false;
    for (WORD.lastIndex = 0; WORD.lastIndex < text.length;) {
      const from = WORD.lastIndex, match = WORD.exec(text);
      if (!match) refuse(at[from], text[from], text[from] === "'" ? "a transpose is not understood" : "this sign is not known");
      const { space, line, digits, unit, name, quoted, sign } = match.groups, place = { at: at[from], text: match[0], gap };
      if (quoted && /^[\w)\]']$/.test(text[from - 1] || "")) refuse(at[from], "'", "a transpose is not understood");
      gap = Boolean(space);
      if (digits) words.push({ ...place, kind: "number", digits: digits.replace(/d/i, "e"), unit: Boolean(unit) });
      else if (name) words.push({ ...place, kind: "name" });
      else if (quoted) words.push({ ...place, kind: "quoted", value: quoted.slice(1, -1) });
      else if (line || sign) words.push({ ...place, kind: line ? "\n" : TEX[sign] || sign.replace(/^\.(?=.)/, "") });
    }
    words.push({ kind: "end", at: at.at(-1) ?? 0, text: "the end", gap: false });
    return words;
  }

  /* Of a number as it is written: significant digits, and the power of ten of the last one. */
  function precision(digits) {
    const [mantissa, power] = digits.toLowerCase().split("e"), [whole, part = ""] = mantissa.split(".");
    return { figures: (whole + part).replace(/^0+/, "").length, decimals: part.length, last: Number(power || 0) - part.length };
  }

  /* ---------------------------------------------------------------------------- statements */

  // Brackets in each other, at most.
  const DEEPEST = 100;
  const MODULES = /^(control|ct|ctl|co|np|numpy|math|cmath|signal|scipy|sp|sympy|matlab|armlock|TransferFunction)$/;
  const IGNORED = /^(name|inputs?|outputs?|states?|inputname|outputname|statename|displayname|notes|display_format|input_prefix|output_prefix|state_prefix|remove_useless_states|dtype)$/i;
  const DEAD = /^(inputdelay|outputdelay|iodelay)$/i;

  /* Reads words one after the other. Values are systems, `{ rows }` of lists and matrices, `{ tuple }`, and
   * `{ word }` of what is none: None, True, a quoted text. */
  class Reader {
    constructor(words, refuse) {
      Object.assign(this, { words, refuse, next: 0, depth: 0, called: false, names: {}, used: new Set(), results: [] });
      const figures = words.filter(word => word.kind === "number").map(word => precision(word.digits).figures);
      // What a program prints has four digits or more, as many at most in all of its numbers. Those of a
      // double are all there.
      const most = Math.max(0, ...figures);
      this.figures = most >= 4 && most < 15 ? most : 0;
    }

    get word() { return this.words[this.next]; }
    is(...kinds) { return kinds.includes(this.word.kind); }
    fail(why, word = this.word) { this.refuse(word.at, word.text.trim() || "the end of the line", why); }
    expect(kind) { if (!this.is(kind)) this.fail(`here should be \u201c${kind}\u201d`); this.next++; }
    lines() { while (this.is("\n")) this.next++; }

    literal(word) {
      const { digits, unit } = word;
      if (/^0\d/.test(digits)) this.fail("no program writes a number so: write decimals with a point", word);
      const { figures, decimals, last } = precision(digits), [mantissa, power = "0"] = digits.toLowerCase().split("e");
      if (Math.abs(Number(power)) > 300) this.fail("this number is too large or too small");
      const whole = BigInt(mantissa.replace(".", "")), down = decimals - Number(power);
      const value = down > 0 ? fraction(whole, 10n ** BigInt(down)) : [whole * 10n ** BigInt(-down), 1n];
      // Half a unit of the last digit; zeros at the end may have been left out.
      const place = Math.min(last, figures ? last + figures - this.figures : last);
      // No program prints a number in exponent form as zero unless it is zero.
      const off = this.figures && (figures || decimals >= 4 && !/e/i.test(digits)) ? 0.5 * 10 ** place : 0;
      return scalar(unit ? number(NIL, value, off) : number(value, NIL, off));
    }

    program() {
      for (;;) {
        while (this.is("\n", ";", ",")) this.next++;
        if (this.is("end")) break;
        this.statement();
        if (!this.is("\n", ";", ",", "end")) this.fail("it is not known what this means here");
      }
      const left = [...this.results, ...Object.keys(this.names).filter(name => !this.used.has(name)).map(name =>
        ({ name, word: this.names[name].word, value: this.names[name].value }))];
      const named = Object.fromEntries(left.map(one => [(one.name || "").split(".").at(-1).toLowerCase(), one]));
      for (const [function_, ...keys] of [["tf", "num", "den"], ["zpk", "z", "p", "k"], ["ss", "a", "b", "c", "d"]])
        if (left.length === keys.length && keys.every(key => named[key]))
          return this.call(left[0].word, function_, keys.map(key => named[key].value), {});
      if (!left.length) this.fail("there is no controller");
      if (left.length > 1) this.fail(`there are several things, and which of them is the controller is not said: ${
        left.slice(0, 5).map(({ name, word }) => name || word.text).join(", ")}${left.length > 5 ? ", \u2026" : ""}`, left[1].word);
      return this.system(left[0].value, left[0].word);
    }

    statement() {
      const { word, words, next } = this, kinds = words.slice(next, next + 5).map(({ kind }) => kind);
      const head = word.kind === "name" && (kinds[1] === "=" ? 2
        : kinds[1] === "(" && words[next + 2].text === "s" && kinds[3] === ")" && kinds[4] === "=" ? 5 : 0);
      if (head) {
        this.next += head;
        this.lines();
        const value = this.list();
        const [, owner, property] = /^(\w+)\.(\w+)$/.exec(word.text) || [];
        if (DEAD.test(property) && this.names[owner]) {
          this.delayed(this.names[owner], property.toLowerCase(), value, word);
          return;
        }
        if (word.text === "s" && value !== LAPLACE) this.fail("s stands for the variable of the transfer function", word);
        if (this.names[word.text]) this.fail(`${word.text} is given twice`, word);
        this.names[word.text] = { value, word };
        if (word.text === "s") this.used.add("s");
      } else this.results.push({ word, value: this.list() });
    }

    /* C.InputDelay = .. of a controller that has a name. */
    delayed(named, property, value, word) {
      const one = this.system(named.value, word), { later = [] } = named;
      if (later.includes(property) || one.delay[0] && !later.length) this.fail("its dead time is given twice", word);
      Object.assign(named, { value: inSeries(one, system(ONE, [], [], this.real(value, word))), later: [...later, property] });
    }

    /* Values with commas between them, without brackets. */
    list() {
      const all = [this.sum(false)];
      while (this.is(",") && !(this.words[this.next + 1].kind === "name" && this.words[this.next + 2].kind === "=")
        && !["\n", "end"].includes(this.words[this.next + 1].kind)) {
        const comma = this.word;
        this.next++;
        all.push(this.sum(false));
        if (!all[0].rows && !all[0].tuple) this.fail("write decimals with a point, and what belongs together in brackets", comma);
      }
      return all.length > 1 ? { tuple: all } : all[0];
    }

    /* Between brackets, `apart`, a space separates: [1 -2] are two numbers, [1 - 2] is one. */
    sum(apart) {
      let value = this.product(apart);
      while (this.is("+", "-") && !(apart && this.word.gap && !this.words[this.next + 1].gap)) {
        const sign = this.word;
        this.next++;
        this.lines();
        value = this.plus(value, this.product(apart), sign);
      }
      return value;
    }

    plus(a, b, sign) {
      [a, b] = [a, b].map(one => this.plain(one, sign));
      if (sign.kind === "-") b = inSeries(scalar(MINUS), b);
      return inParallel(a, b, why => this.fail(why, sign));
    }

    product(apart) {
      let value = this.signed(apart), divided = false;
      for (;;) {
        const { word } = this;
        if (this.is("*", "/")) {
          this.next++;
          this.lines();
          const other = this.signed(apart);
          divided = word.kind === "/";
          value = divided ? this.over(value, other, word) : this.times(value, other, word);
        } else if (this.is("name", "(", "number", "\\frac") && !(apart && word.gap)) {
          // 2 s, s (s + 1), (s + 1) (s + 2)
          if (word.kind === "number") this.fail("a sign is missing before this number");
          if (divided) this.fail("what is divided by can be read in two ways: write * or brackets");
          const before = this.called, other = this.signed(apart);
          // tf(..) tf(..) are two controllers, and not a product.
          if ((before || this.called) && !(isScalar(value) && !before)) this.fail("two things stand side by side: write * for their product", word);
          value = this.times(value, other, word);
        } else return value;
      }
    }

    times(a, b, word) {
      for (const [one, other] of [[a, b], [b, a]]) if (one.rows && isScalar(other))
        return { rows: one.rows.map(row => row.map(v => inSeries(this.plain(v, word), other))) };
      return inSeries(this.plain(a, word), this.plain(b, word));
    }

    over(a, b, word) {
      const below = this.plain(b, word);
      if (isNil(below.k)) this.fail("it is divided by zero", word);
      return inSeries(this.plain(a, word), inverse(below));
    }

    signed(apart) {
      let negative = false, { word } = this;
      for (; this.is("+", "-"); this.next++) negative = negative !== (this.word.kind === "-");
      if (++this.depth > DEEPEST) this.fail(`more than ${DEEPEST} brackets stand in each other`);
      const value = this.power(apart);
      this.depth--;
      return negative ? this.times(scalar(MINUS), value, word) : value;
    }

    power(apart) {
      const { word } = this;
      // Euler's number has one power here: a dead time.
      if (word.text === "e" && !this.names.e && this.words[this.next + 1].kind === "^") {
        this.next += 2;
        if (!this.is("(", "{")) this.fail("write the exponent of e in brackets", word);
        const exponent = this.is("{") ? this.braces() : this.atom(apart);
        return this.call(word, "exp", [exponent], {});
      }
      const base = this.atom(apart);
      if (!this.is("^")) return base;
      this.next++;
      const negative = this.is("-"), sign = this.word;
      if (this.is("+", "-")) this.next++;
      const exponent = this.is("{") ? this.braces() : this.atom(apart), n = isScalar(exponent) && !exponent.k.im[0] ? double(exponent.k.re) : NaN;
      if (!Number.isInteger(n) || Math.abs(n) > 60) this.fail("a power must be a whole number up to 60", sign);
      if (this.is("^")) this.fail("a power of a power can be read in two ways: write brackets");
      const one = this.plain(base, word);
      if ((n < 0) !== negative && n && isNil(one.k)) this.fail("it is divided by zero", word);
      const from = (n < 0) !== negative ? inverse(one) : one;
      return Array(Math.abs(n)).fill(from).reduce(inSeries, scalar(ONE));
    }

    atom(apart) {
      const { word } = this;
      this.next++;
      this.called = false;
      if (word.kind === "number") return this.literal(word);
      if (word.kind === "quoted") return { word: word.value };
      if (word.kind === "(") return this.brackets();
      if (word.kind === "[") return this.matrix(apart !== "inner" && apart);
      if (word.kind === "\\frac") {
        const [above, below] = [this.braces(), this.braces()];
        return this.over(above, below, word);
      }
      if (word.kind === "{" || word.kind === "}") this.fail("this sign is not known", word);
      if (word.kind !== "name") this.fail("here should be a number, s, or what can be calculated", word);
      const parts = word.text.split("."), name = parts.slice(0, -1).every(part => MODULES.test(part)) ? parts.at(-1) : word.text;
      const known = this.names[word.text];
      if (known || name === "s") {
        this.used.add(word.text);
        // C(s) is C; s (s + 1) is a product.
        if (known && known.value !== LAPLACE && this.is("(") && !this.word.gap) {
          if (this.words[this.next + 1].text !== "s" || this.words[this.next + 2].kind !== ")")
            this.fail(`a value of ${word.text} is not understood; for a product write *`);
          this.next += 3;
        } else this.called = Boolean(known?.value.k) && known.value !== LAPLACE && !isScalar(known.value);
        return known ? known.value : LAPLACE;
      }
      if (name === "pi") return scalar(number(ofDouble(Math.PI)));
      if (/^(i|j|im|I|1j)$/.test(name)) return scalar(number(NIL, [1n, 1n]));
      if (/^(None|True|False)$/.test(name)) return { word: name };
      if (!this.is("(")) this.fail(name === "z" ? `${name} is not s: ${DISCRETE}` : `${word.text} is not known`, word);
      this.next++;
      const [all, options] = this.given();
      if (this.is("(")) this.fail(`a value of ${word.text}(..) is not understood; for a product write *`);
      const value = this.call(word, name, all, options);
      this.called = !/^(exp|sqrt|db2mag)$/.test(name);
      return value;
    }

    /* What stands in braces, as in LaTeX. */
    braces() {
      this.expect("{");
      const value = this.sum(false);
      this.expect("}");
      this.called = false;
      return value;
    }

    brackets() {
      const all = [];
      let tuple = false;
      for (;;) {
        this.lines();
        if (this.is(")")) { this.next++; break; }
        all.push(this.sum(false));
        this.lines();
        if (this.is(",")) { tuple = true; this.next++; } else if (!this.is(")")) this.fail("a bracket is not closed here");
      }
      this.called = false;
      return tuple || !all.length ? { tuple: all } : all[0];
    }

    /* Rows of a list or a matrix. A line ends a row, except in an inner list, as numpy prints them. */
    matrix(inner) {
      const rows = [[]];
      for (let comma = true; ; ) {
        if (this.is("]")) { this.next++; break; }
        if (this.is("end")) this.fail("a bracket is not closed");
        if (this.is("\n", ";")) {
          if (!comma && !inner || this.is(";")) rows.push([]);
          this.next++;
        } else if (this.is(",")) {
          const [sign, zero, , digits] = this.words.slice(this.next - 2);
          if (/[-+]/.test(sign.kind) && zero.text === "0" && digits.kind === "number" && !digits.gap) this.fail("write decimals with a point");
          comma = true;
          this.next++;
        } else { rows.at(-1).push(this.sum("apart")); comma = false; }
      }
      const kept = rows.filter(row => row.length), lists = kept.flat();
      // A list of lists is a matrix, and one of one list is that list.
      if (lists.length && lists.every(one => one.rows)) {
        if (lists.length === 1) return lists[0];
        if (lists.every(one => one.rows.length === 1)) return { rows: lists.map(one => one.rows[0]) };
        this.fail("lists in lists are not understood");
      }
      return { rows: kept };
    }

    /* What a function is called with: values, and options as name=value, name: value, or 'name', value. */
    given() {
      const all = [], options = {};
      for (;;) {
        this.lines();
        if (this.is(")")) { this.next++; return [all, options]; }
        const { word } = this, after = this.words[this.next + 1].kind;
        if (word.kind === "name" && (after === "=" || after === ":")) {
          this.next += 2;
          // What only names something may hold any word.
          if (IGNORED.test(word.text) && this.is("name")) this.next++;
          else options[word.text] = { word, value: this.sum(false) };
        } else if (word.kind === "quoted" && after === "," && word.value.length > 1) {
          this.next += 2;
          this.lines();
          options[word.value] = { word, value: this.sum(false) };
        } else all.push(this.sum(false));
        this.lines();
        if (this.is(",")) this.next++; else if (!this.is(")")) this.fail("a bracket is not closed here");
      }
    }

    /* A value as a system; refused where it is a list or a word. */
    plain(value, word) {
      if (value.rows?.length === 1 && value.rows[0].length === 1) return this.plain(value.rows[0][0], word);
      if (!value.k) this.fail(value.word !== undefined ? `\u201c${value.word}\u201d is no number`
        : "a list of numbers is no transfer function", word);
      return value;
    }

    /* The controller: a pair is (num, den), three are (zeros, poles, gain), four a state space. */
    system(value, word) {
      const function_ = value.tuple?.slice(0, 2).every(one => one.rows || one.tuple) && { 2: "tf", 3: "zpk", 4: "ss" }[value.tuple.length];
      return function_ ? this.call(word, function_, value.tuple, {}) : this.plain(value, word);
    }

    constant(value, word) {
      const found = this.plain(value, word);
      if (!isScalar(found)) this.fail("here should be a number", word);
      return found.k;
    }

    real(value, word) {
      const { re, im } = this.constant(value, word);
      if (im[0]) this.fail("here should be a real number", word);
      return re;
    }

    grid(value, word) {
      const rows = value.rows || (value.tuple ? [value.tuple] : [[value]]);
      return rows.map(row => row.map(one => this.constant(one, word)));
    }

    vector(value, word) {
      const rows = this.grid(value, word);
      if (rows.length > 1 && rows.some(row => row.length > 1)) this.fail("here should be one list, not a matrix", word);
      return rows.flat();
    }

    polynomial(value, word) {
      if (value.k && !isScalar(value)) return value;
      const p = trimmed(this.vector(value, word).reverse());
      // A root of polynomials that were multiplied out is rounded by a share of the largest one.
      const largest = p.length > 2 ? Math.max(...rootsExactly(p).map(root => Math.hypot(...root))) : 0;
      for (const number of [1, 2]) {
        const bounds = Array.from({ length: number }, (_, k) => p.length > number && MULTIPLIED * sizeOf(p[number]) * largest ** (number - k));
        if (bounds.every((bound, k) => p[k] && sizeOf(p[k]) < bound)) bounds.forEach((bound, k) => hide(p[k], bound));
      }
      return ofPolynomial(p);
    }

    quotient(above, below, word) {
      if (isNil(below.k)) this.fail("its denominator is zero", word);
      return inSeries(above, inverse(below));
    }

    call(word, name, all, options) {
      const made = this.made(word, name, all, options);
      let delay = NIL;
      for (const [key, { word: place, value }] of Object.entries(options)) {
        if (DEAD.test(key)) delay = sumOf(delay, this.real(value, place));
        else if (/^(dt|ts)$/i.test(key)) this.continuous(value, place);
        else if (/^(variable|var)$/i.test(key)) { if (value.word !== "s") this.fail(DISCRETE, place); }
        else if (/^timeunit$/i.test(key)) {
          if (value.word !== "seconds") this.fail(`its unit of time is ${value.word}, and here it is the second`, place);
        } else if (!IGNORED.test(key)) this.fail(`the option ${key} is not known`, place);
      }
      return delay[0] ? inSeries(made, system(ONE, [], [], delay)) : made;
    }

    /* A sampling time must be none, or zero. */
    continuous(value, word) {
      if (!(value.word === "None" || value.k && isNil(value.k))) this.fail(DISCRETE, word);
    }

    made(word, name, all, options) {
      const last = (count, function_) => {
        if (all.length < count || all.length > count + 1)
          this.fail(`${name} takes ${count} things here, and was given ${all.length}`, word);
        if (all.length > count && all[count] !== LAPLACE) this.continuous(all[count], word);
        return function_();
      };
      const taken = key => {
        const found = options[key]?.value;
        delete options[key];
        return found;
      };
      switch (name.replace(/Continuous$/, "")) {
        case "tf": case "TransferFunction": case "zpk": case "ZerosPolesGain": case "Controller": case "ss": case "StateSpace":
          for (const key of ["zeros", "poles", "gain"]) if (options[key]) all.push(taken(key));
          if (all.length === 1 && all[0].word === "s") return LAPLACE;
          if (all[0]?.word !== undefined) this.fail(all[0].word === "z" ? DISCRETE : "it is not understood", word);
          if (all.length === 1) return this.plain(all[0], word);
          if (/^(tf|Tr)/.test(name)) return last(2, () => this.quotient(this.polynomial(all[0], word), this.polynomial(all[1], word), word));
          if (/^(zpk|Z|Contr)/.test(name)) return last(3, () => {
            const [zeros, poles] = all.slice(0, 2).map(one => this.vector(one, word).map(v =>
              isNil(v) && !v.off ? S : [negative(v), ONE]));
            return system(this.constant(all[2], word), zeros, poles);
          });
          return last(4, () => {
            const [a, b, c, d] = all.map(one => this.grid(one, word));
            if (!a.length) return scalar(this.constant(all[3], word));
            return ofStates(a, b, c, d, why => this.fail(why, word));
          });
        case "array": case "asarray": case "matrix": case "Matrix": case "list": case "tuple": case "float": case "float64":
          return all[0] || this.fail(`${name} holds nothing`, word);
        case "delay": return system(ONE, [], [], this.real(all[0] || { tuple: [] }, word));
        case "exp": {
          const { k, zeros, poles, delay } = this.plain(all[0] || { tuple: [] }, word);
          if (!zeros.length && !poles.length) return scalar(number(ofDouble(Math.exp(double(this.real(all[0], word))))));
          if (poles.length || delay[0] || zeros.length !== 1 || zeros[0] !== S || k.im[0])
            this.fail("a dead time is exp of minus a number times s", word);
          return system(ONE, [], [], [-k.re[0], k.re[1]]);
        }
        case "sqrt": return scalar(number(ofDouble(Math.sqrt(Math.max(0, double(this.real(all[0] || { tuple: [] }, word)))))));
        case "db2mag": return scalar(number(ofDouble(10 ** (double(this.real(all[0] || { tuple: [] }, word)) / 20))));
        case "symbols": case "Symbol": if (all[0]?.word === "s") return LAPLACE; break;
        case "conv": case "convolve": case "polymul":
          return { rows: [all.map(one => this.vector(one, word)).reduce(multiply, [ONE]).map(scalar)] };
        case "poly": return { rows: [expanded(this.vector(all[0] || { tuple: [] }, word).map(v => [negative(v), ONE])).reverse().map(scalar)] };
        case "series": return all.map(one => this.plain(one, word)).reduce(inSeries, scalar(ONE));
        case "parallel": return all.map(one => this.plain(one, word)).reduce((a, b) => inParallel(a, b, why => this.fail(why, word)), scalar(ZERO));
        case "pid": {
          const [kp, ki, kd, filter] = [0, 1, 2, 3].map(k => scalar(all[k] ? this.constant(all[k], word) : ZERO));
          const join = (a, b) => inParallel(a, b, why => this.fail(why, word));
          const below = join(scalar(ONE), inSeries(filter, LAPLACE));
          return [inSeries(ki, inverse(LAPLACE)), inSeries(inSeries(kd, LAPLACE), inverse(below))].reduce(join, kp);
        }
        case "feedback": {
          const [a, b = scalar(ONE)] = all.slice(0, 2).map(one => this.plain(one, word));
          const round = inSeries(a, b), sign = all[2] ? double(this.real(all[2], word)) : -1;
          if (a.delay[0] || b.delay[0]) this.fail("a feedback with a dead time has infinitely many poles", word);
          const sum = inParallel(scalar(ONE), inSeries(scalar(sign < 0 ? ONE : MINUS), round), why => this.fail(why, word));
          if (isNil(sum.k)) this.fail("its denominator is zero", word);
          return system(over(a.k, sum.k), [...a.zeros, ...without(sum.poles, a.poles)[0]], sum.zeros);
        }
      }
      return this.fail(`${word.text}(..) is not known`, word);
    }
  }

  /* ---------------------------------------------------------------------------- the controller */

  /* The real polynomials whose product these factors are: complex ones belong to a conjugate. */
  function realFactors(factors, refuse) {
    const left = factors.map(p => p), found = [], conjugate = p => p.map(({ re, im, off }) => number(re, [-im[0], im[1]], off));
    const name = p => p.map(({ re, im }) => `${re}|${im}`).join();
    while (left.length) {
      const p = left.shift();
      if (p.every(({ im }) => !im[0])) { found.push(p); continue; }
      const partner = left.findIndex(q => name(q) === name(conjugate(p)));
      if (partner < 0) refuse("complex zeros and poles come in pairs, and one lacks its conjugate");
      found.push(multiply(p, left.splice(partner, 1)[0]));
    }
    return found;
  }

  /* The line of a place in a text. */
  const lineOf = (text, at) => Array.from(text.replace(/\r\n?/g, "\n")).slice(0, at).filter(sign => sign === "\n").length + 1;

  /* Bad text, with the name of the field that holds it. Long words of it are cut. */
  const cut = text => text.length > 40 ? `${text.slice(0, 30)}\u2026` : text;
  const wrong = (field, message) => Object.assign(new RangeError(message.replace(/\S+/g, cut)), { field });

  const readerOf = (lines, refuse) => new Reader(wordsOf(Piece.join(...lines.flatMap(line =>
    [line, new Piece("\n", line.at.at(-1) ?? 0)])), refuse), refuse);

  /* The controller that a text holds: zeros and poles in rad/s as pairs, gain, dead time in s, and
   * `doubt`, what the rounding of its printed digits leaves open. */
  function readController(text) {
    const refuse = (at, found, why) => {
      // Only what stands in the text is quoted.
      const word = String(found).trim().slice(0, 30), place = word.startsWith("the end") ? word : `\u201c${word}\u201d`;
      throw wrong("pasted", `This text is not understood: ${why} (line ${lineOf(text, at)}, at ${place}).`);
    };
    if (!text.trim()) refuse(0, "", "it is empty");
    spent = 0;
    try {
      return controllerOf(text, refuse);
    } catch (error) {
      if (!error.costly) throw error;
      return refuse(0, text.trim().split("\n")[0], "it takes too long to work out. Write it as zeros, poles and gain, zpk(z, p, k)");
    }
  }

  function controllerOf(text, refuse) {
    let dead = NIL;
    const lines = linesOf(text).map(line => {
      for (const [pattern, why] of NOT) if (pattern.test(line.bare) && !REMARK.test(line.bare)) refuse(line.from, line.bare, why);
      const held = /^(?:Input|Output|I\/O) delays? \(seconds\): ([\d.e+-]+)$/.exec(line.bare);
      if (held) dead = sumOf(dead, ofDouble(Number(held[1])));
      if (!held && !REMARK.test(line.bare)) return line;
      return Object.assign(new Piece("", []), { remark: true });
    });
    // "with Kp = 2, Ki = 3" below MATLAB's formula of a PID controller: its numbers come first.
    const given = lines.filter(line => WITH.test(line.bare)).map(line => line.blank(/^\s*with/));
    const rest = lines.map(line => WITH.test(line.bare) ? new Piece("", []) : line);
    const found = readerOf([...given, ...matricesInLine(fractionsInLine(rest, refuse), refuse)], refuse).program();
    const none = why => refuse(0, text.trim().split("\n")[0], why);
    if (isNil(found.k)) none("it is zero");
    if (found.k.im[0]) none("its gain is not real");
    const delay = sumOf(found.delay, dead);
    if (delay[0] < 0n) none("its dead time is negative");
    const [zeros, poles] = [found.zeros, found.poles].map(all => realFactors(all, none));
    const loose = [[zeros, "a zero"], [poles, "a pole"]].filter(([all]) => all.some(mayCross)).map(([, name]) => name);
    return { zeros: zeros.flatMap(rootsExactly), poles: poles.flatMap(rootsExactly), gain: double(found.k.re), delay: double(delay),
      doubt: loose.length ? `Rounding, or half a unit of the last printed digit, moves ${loose.join(" and ")} across the imaginary `
        + "axis or off s = 0. Paste more digits, or zeros and poles." : "" };
  }

  /* The numbers of a list as MATLAB or Python print it, as pairs of doubles: [..], array(..), columns, a
   * common factor in front, \u00b1 for a conjugate pair. */
  function numbers(field, text, bad) {
    spent = 0;
    const comma = /[-+]?\d+,\d+/.exec(text);
    if (comma)
      throw wrong(field, `Write decimals with a point, and a space after the comma between two numbers: ${comma[0]} `
        + "could be either.");
    const [, factor = "1", plain] = /^(?:[\s=a-z]*((?:\d+\.?\d*)e[+-]?\d+)\s*\*\s*\n)?([^]*)$/i.exec(text);
    const pairs = plain.replace(/\s*(?:\u00b1|\+\/-)\s*/g, "\u00b1").replace(/([^\s,;[\]]*)\u00b1([^\s,;[\]]+)/g, "$1+$2, $1-$2");
    const refuse = (_, found) => bad(String(found).trim());
    const reader = readerOf(linesOf(`[${pairs}]`), refuse), all = [];
    const take = value => {
      if (value.rows || value.tuple) (value.tuple || value.rows.flat()).forEach(take);
      else all.push(reader.constant(value, reader.words[0]));
    };
    take(reader.matrix.call((reader.next++, reader), false));
    reader.lines();
    if (!reader.is("end")) bad(reader.word.text);
    return all.map(({ re, im }) => [double(re), double(im)].map(v => Number(factor) * v));
  }

  /* Roots, in rad/s. Pairs that were rounded apart become one pair of their mean. */
  function readRoots(field, text, name) {
    const found = numbers(field, text, part => {
      throw wrong(field, `${name} are numbers such as \u22120.1, \u22120.1\u00b12j or -2*pi*0.1; \u201c${part}\u201d is none.`);
    });
    const left = found.filter(([, im]) => im !== 0), paired = found.filter(([, im]) => im === 0);
    while (left.length) {
      const [re, im] = left.shift(), size = Math.hypot(re, im);
      const gaps = left.map(([x, y]) => Math.hypot(x - re, y + im));
      const nearest = gaps.indexOf(Math.min(...gaps)), written = part => `${re}${part < 0 ? "-" : "+"}${Math.abs(part)}j`;
      if (nearest < 0 || gaps[nearest] > 2e-3 * size)
        throw wrong(field, `${name} come in pairs: ${written(im)} lacks ${written(-im)}.`);
      const [[x, y]] = left.splice(nearest, 1);
      const [a, b] = [0.5 * (re + x), 0.5 * Math.abs(im - y)];
      paired.push([a, b], [a, -b]);
    }
    return paired;
  }

  /* One real number; `name` is the field's own. */
  function readNumber(field, text, name) {
    const refuse = () => {
      throw wrong(field, `${name} must be a number, got ${text.trim() ? `\u201c${text.trim()}\u201d` : "nothing"}.`);
    };
    const found = numbers(field, text, refuse);
    if (found.length !== 1 || found[0][1] !== 0) refuse();
    return found[0][0];
  }

  return { readController, readRoots, readNumber, wrong };
})();
