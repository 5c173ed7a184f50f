"""Margins and counts of a loop by branch and bound, sharing no code with armlock.

A loop is held as factors. On a cell of frequencies of centre m and half-width h its open loop
is enclosed: L(m + t) = L0 + L1 t + e with |e| <= R for |t| <= h. The remainder R comes of the
second derivative of log K (a sum over zeros and poles, each bounded by its distance less h)
and of the exponentials (delay squared). A second enclosure leaves the phases of both arms
free: a disc, which needs no resolution of the delays. A cell is left out only if one of the two
shows that nothing on it can be below the smallest value found so far, less a part in 1e6;
every other one is cut in eight. So the smallest value found is the infimum to 1e-6, whatever
the function does between samples. Past the highest corner a disc bounds all that follows.
Rounding belongs to the remainder R.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize.elementwise import find_root

TOL = 1e-6
MOST_CELLS = 40_000
# Cells that are looked at together.
CHUNK = 20_000
# Of a product of factors, relative.
EPS = 1e-15
GAINS = 1e4
NAMES = ("modulus", "phase", "delay", "gain_upper", "gain_lower")


#: 1/0 is inf, and 0/0 is looked at.
quiet = np.errstate(all="ignore")


class UndecidedError(RuntimeError):
    """The cells did not suffice."""


@dataclass(frozen=True)
class Sketch:
    """A loop in factors: K of zeros, poles and gain; a sensor; delays; a dead time."""

    zeros: tuple
    poles: tuple
    gain: float
    sensor: str
    tau1: float
    tau2: float
    delay: float = 0.0
    corner: float = 1.0
    difference: float = 1.0

    def scaled(self, factor):
        return replace(self, gain=self.gain * factor)

    def terms(self):
        """Zeros, poles, gain and a1, a2 of terms W (a1 (1 - c1 e1) + a2 (1 - c2 e2)) of L."""
        z, p = (np.array(sorted(r, key=abs), complex) for r in (self.zeros, self.poles))
        common = np.count_nonzero(z == 0.0), np.count_nonzero(p == 0.0)
        z0, p0 = (k - min(common) for k in common)
        z = np.concatenate((np.zeros(z0), z[z != 0.0]))
        p = np.concatenate((np.zeros(p0), p[p != 0.0]))
        weights = {
            "single": (1.0, 0.0),
            "common": (1.0, 1.0),
            "difference": (-1.0, 1.0),
            "dual": (1.0, 1.0),
        }
        found = [(z, p, self.gain, weights[self.sensor])]
        if self.sensor == "dual":
            ze, pe = (z[1:], p) if z0 else (z, np.append(0.0, p))
            pe = np.array(sorted(np.append(pe, -self.corner), key=abs))
            gain = self.gain * self.corner / self.difference
            found.append((ze, pe, gain, (1.0, -1.0)))
        return found

    def open_poles(self):
        """Roots of the common denominator R of L."""
        p = list(self.poles)
        if self.sensor == "dual":
            p += [0.0, -self.corner]
        for z in self.zeros:
            if z == 0.0 and 0.0 in p:
                p.remove(0.0)
        return np.array(p, complex)

    @property
    def neutral(self):
        return len(self.zeros) == len(self.poles)


def quotient(above, below):
    """Product over the last axis of one array over that of another, factor by factor."""
    size = max(above.shape[1], below.shape[1])
    above, below = (
        np.concatenate((d, np.ones((d.shape[0], size - d.shape[1]))), axis=1)
        for d in (above, below)
    )
    return np.prod(above / below, axis=1)


@dataclass
class View:
    """L(sigma + j omega; c1, c2), its enclosures and its ends."""

    sketch: Sketch
    c1: float
    c2: float
    sigma: float = 0.0
    terms: list = field(init=False)

    def __post_init__(self):
        s, sigma = self.sketch, self.sigma
        decay = np.exp(-sigma * s.delay)
        self.terms = [(z - sigma, p - sigma, g * decay, w) for z, p, g, w in s.terms()]
        self.tau = np.array([s.tau1, s.tau2])
        given = np.array([self.c1, self.c2])
        self.c = given * np.exp(-sigma * self.tau)
        self.miss = (1.0 - given) - given * np.expm1(-sigma * self.tau)
        corners = [1.0 / s.tau1, 1.0 / s.tau2]
        if s.tau1 != s.tau2 and s.sensor != "single":
            corners.append(1.0 / abs(s.tau1 - s.tau2))
        for z, p, _, w in self.terms:
            corners += [abs(v) for v in (*z, *p) if v != 0.0]
            start = abs(self.start(*w))
            pull = np.dot(np.abs(w), np.abs(self.c) * self.tau)
            if start and pull:
                corners.append(start / pull)
        self.corners = np.array(corners)
        self.low = 1e-8 * float(self.corners.min())
        for _ in range(60):
            one, two = np.abs(self.at(self.low * np.array([1.0, 0.5])))
            rises, falls = two > 1.4 * one, two < 0.7 * one
            far = one > 1e3 * GAINS if rises else one < 1e-3 / GAINS
            if far or not (rises or falls):
                break
            self.low *= 0.1
        # L there is a single power of s to some 1e-8: constant, or far above or below 1.
        self.power = int(np.round(np.log2(two / one))) if one else 0

    def start(self, w1, w2):
        """Weights times 1 - c_k exp(-sigma tau_k), summed."""
        if w1 != -w2 or self.sigma:
            return w1 * self.miss[0] + w2 * self.miss[1]
        return w1 * (self.c2 - self.c1)

    def parts(self, omega):
        """Of each term of L its W exp(-s delay), and the arms' share a1 (...) + a2 (...)."""
        s, jw = self.sketch, 1j * omega[:, None]
        back1, back2 = (-np.expm1(-1j * omega * t) for t in self.tau)
        apart = np.exp(-1j * omega * s.tau2) * -np.expm1(-1j * omega * (s.tau1 - s.tau2))
        for z, p, gain, (w1, w2) in self.terms:
            a1, a2 = w1 * self.c[0], w2 * self.c[1]
            # (1 - c1 e1) - (1 - c2 e2) keeps its digits where the two are close.
            arms = (a1 + a2) * back1 - a2 * apart if w1 == -w2 else a1 * back1 + a2 * back2
            dead = np.exp(-1j * omega * s.delay)
            yield gain * quotient(jw - z, jw - p) * dead, self.start(w1, w2) + arms

    @quiet
    def at(self, omega):
        """L at real frequencies."""
        return sum(value * arms for value, arms in self.parts(omega))

    @quiet
    def enclose(self, m, h):
        """L0, L1, R; and a disc with both arms' phases free: centre and radius."""
        s = self.sketch
        jm, b = 1j * m[:, None], m + h
        value = slope = 0j
        rest = np.zeros(m.size)
        late = [np.exp(-1j * m * t) for t in self.tau]
        arms = [np.zeros(m.size, complex), np.zeros(m.size, complex)]
        free_rest = np.zeros(m.size)
        hh = h[:, None]
        for (z, p, gain, (w1, w2)), (v, p0) in zip(self.terms, self.parts(m), strict=True):
            dz, dp = jm - z, jm - p
            log_slope = (1j / dz).sum(1) - (1j / dp).sum(1) - 1j * s.delay
            az, ap = np.abs(dz), np.abs(dp)
            near = (1.0 / np.maximum(az - hh, 0.0) ** 2).sum(1)
            near = near + (1.0 / np.maximum(ap - hh, 0.0) ** 2).sum(1)
            bend = np.where(h > 0.0, 0.5 * h * h * near, 0.0)
            x = np.abs(log_slope) * h + bend
            e = bend + 0.5 * x * x * np.exp(np.minimum(x, 700.0))
            a1, a2 = w1 * self.c[0], w2 * self.c[1]
            start = self.start(w1, w2)
            curve = abs(a1) * s.tau1**2 + abs(a2) * s.tau2**2
            if w1 == -w2:
                far = np.minimum(2.0, b * abs(s.tau1 - s.tau2))
                curve = abs(a1 * s.tau1**2 + a2 * s.tau2**2) + abs(a2) * s.tau2**2 * far
            p1 = 1j * (a1 * s.tau1 * late[0] + a2 * s.tau2 * late[1])
            rp = 0.5 * h * h * curve
            ap0, ap1, al, av = np.abs(p0), np.abs(p1), np.abs(log_slope), np.abs(v)
            value = value + v * p0
            slope = slope + v * (p1 + log_slope * p0)
            # Phases are rounded as their arguments are.
            rounding = EPS * (ap0 + abs(start) + (abs(a1) + abs(a2)) * b * self.tau.max())
            rest = rest + av * (
                al * ap1 * h * h + (ap0 + ap1 * h) * e + (1.0 + al * h) * rp + e * rp
            )
            rest = rest + np.where(h > 0.0, av * rounding, 0.0)
            arms[0] += w1 * v
            arms[1] += w2 * v
            whole = abs(w1) + abs(w2) + abs(a1) + abs(a2)
            # |W / W(m) - 1| on the cell, or how large W is at all.
            moved = np.minimum(x * np.exp(np.minimum(x, 700.0)), np.inf)
            largest = quotient(az + hh, ap - hh)
            largest = np.where((ap > hh).all(1), abs(gain) * largest, np.inf)
            free_rest += np.where(h > 0.0, np.minimum(av * moved, largest + av) * whole, 0.0)
        radius = np.abs(arms[0] * self.c[0]) + np.abs(arms[1] * self.c[1]) + free_rest
        rest = np.where(np.isnan(rest), np.inf, rest)
        radius = np.where(np.isnan(radius), np.inf, radius)
        return value, slope, rest, arms[0] + arms[1], radius

    def limit(self):
        """Centre and radius of the disc of L at infinity, which a dead time turns around 0."""
        z, p, gain, (w1, w2) = self.terms[0]
        if z.size != p.size:
            return 0.0, 0.0
        centre = gain * (w1 + w2)
        radius = abs(gain) * (abs(w1 * self.c[0]) + abs(w2 * self.c[1]))
        return (0.0, abs(centre) + radius) if self.sketch.delay else (centre, radius)

    def tail(self, omega):
        """Centre and radius of a disc that holds L at all frequencies past `omega`."""
        centre, radius = self.limit()
        for k, (z, p, gain, (w1, w2)) in enumerate(self.terms):
            whole = abs(w1) + abs(w2) + abs(w1 * self.c[0]) + abs(w2 * self.c[1])
            if omega <= 1.01 * np.abs(p).max(initial=0.0):
                return 0.0, np.inf
            grown = np.sum(np.log1p(np.abs(z) / omega)) - np.sum(np.log1p(-np.abs(p) / omega))
            if k == 0 and z.size == p.size:
                radius += abs(gain) * np.expm1(grown) * whole
            else:
                radius += abs(gain) * np.exp(grown + (z.size - p.size) * np.log(omega)) * whole
        return centre, radius

    def confined(self):
        """Whether the neutral root chain stays left, dead time and delays a little changed."""
        centre, radius = self.limit()
        return abs(1.0 + centre) > radius

    def cells(self, high, free_above=np.inf):
        """Cells from `low` to `high`, ten a decade and one for each corner."""
        if not 0.0 < self.low < high < 1e300 * self.low:
            raise UndecidedError("no range of frequencies")
        count = int(np.ceil(10 * np.log10(high / self.low))) + 1
        edges = np.geomspace(self.low, high, count)
        inner = self.corners[(self.corners > self.low) & (self.corners < high)]
        edges = np.concatenate((edges, 0.99 * inner, 1.01 * inner))
        if self.low < free_above < high:
            edges = np.append(edges, free_above)
        edges = np.unique(edges)
        return edges[:-1], edges[1:]


def cut(a, b):
    share = np.arange(9) / 8
    edges = a[:, None] + (b - a)[:, None] * share
    edges[:, -1] = b
    return edges[:, :-1].ravel(), edges[:, 1:].ravel()


def to_segment(point, value, slope, h):
    """Distance of a point to the segment value + slope t, |t| <= h; and the nearest t."""
    speed = np.abs(slope) ** 2
    away = point - value
    t = np.where(speed > 0.0, (away * np.conj(slope)).real / speed, 0.0)
    t = np.clip(t, -h, h)
    return np.abs(away - slope * t), t


@quiet
def count(sketch, c1, c2, sigma=0.0):
    """Roots of D right of Re s = sigma; -1 on the line (to rounding), -2 unconfined.

    N = n/2 - (turn of arg D) / pi, with arg D = arg R + arg(1 + L); the turn of 1 + L over a
    cell whose enclosure leaves out -1 is the angle between its ends.
    """
    view = View(sketch, c1, c2, sigma)
    if sketch.neutral and not view.confined():
        return -2
    poles = sketch.open_poles() - sigma
    # D is R at s = 0 to a power: with one left over, a root lies there.
    if np.count_nonzero(poles == 0.0) > max(view.power, 0):
        return -1
    high = 10.0 * float(view.corners.max())
    goal = 1.0 + view.limit()[0]
    while True:
        centre, radius = view.tail(high)
        if abs(1.0 + centre) > radius:
            break
        high *= 4.0
        if high > 1e40:
            raise UndecidedError("no end")
    if high * view.tau.max() > 1e13:
        raise UndecidedError("phases are rounded")
    a, b = view.cells(high)
    turn, used = 0.0, 0
    ends = 1.0 + view.at(np.array([a[0], b[-1]]))
    while a.size:
        used += a.size
        if used > MOST_CELLS:
            raise UndecidedError("count")
        m, h = 0.5 * (a + b), 0.5 * (b - a)
        value, slope, rest, centre, radius = view.enclose(m, h)
        clear = to_segment(-1.0, value, slope, h)[0] > rest
        clear |= np.abs(1.0 + centre) > radius
        one, two = 1.0 + view.at(a[clear]), 1.0 + view.at(b[clear])
        turn += float(np.angle(two / one).sum())
        a, b = a[~clear], b[~clear]
        if a.size and ((b - a) < 1e-13 * b).any():
            return -1
        a, b = cut(a, b)
    turn += float(np.angle(goal / ends[1]))
    # arg R from the lowest frequency to infinity, factor by factor.
    first = 1j * view.low - poles
    turn += float(sum(np.angle(1j / d) for d in first))
    # From omega = 0, where D is real, to the lowest frequency.
    phase = float(np.angle(ends[0]) + np.angle(first).sum())
    start = np.pi * round(phase / np.pi)
    if abs(phase - start) > 1e-3:
        return -1
    turn += phase - start
    number = 0.5 * poles.size - turn / np.pi
    if abs(number - round(number)) > 1e-3:
        raise UndecidedError(f"count {number}")
    return round(number)


def distance(sketch, c1, c2):
    """Smallest |1 + L|, or that over the size of its terms: how near a root is to the axis."""
    view = View(sketch, c1, c2)
    omega = np.geomspace(view.low, 1e2 * view.corners.max(), 20001)
    value, _, _, centre, radius = view.enclose(omega, 0.0 * omega)
    shares = np.abs(1.0 + value) / (1.0 + np.abs(centre) + radius)
    return min(float(shares.min()), margins(sketch, c1, c2, stable=False).modulus)


@dataclass
class Verdict:
    """The infima, and those of which cells ran out: bounds on one side only."""

    modulus: float = np.inf
    phase: float = np.inf
    delay: float = np.inf
    gain_upper: float = np.inf
    gain_lower: float = 0.0
    unsure: tuple = ()


def lag(value):
    return np.mod(np.angle(-value), 2.0 * np.pi)


def to_arc(value, turn):
    """Distance to the arc -exp(j psi), 0 <= psi <= turn, of the unit circle."""
    ends = np.minimum(np.abs(value + 1.0), np.abs(value + np.exp(1j * turn)))
    return np.where(lag(value) <= turn, np.abs(np.abs(value) - 1.0), ends)


def zeros_of(view, a, b, excess):
    """Zeros of `excess(L)` in cells at whose ends its sign differs."""
    return find_root(lambda omega: excess(view.at(omega)), (a, b)).x


@quiet
def margins(sketch, c1, c2, stable=True, free_above=np.inf):
    """All margins; of a loop that is not stable the modulus only.

    Above `free_above`, in rad/s, both arms' phases are free: L fills a disc. Gains are not
    looked at then.
    """
    used = 0
    asked = 1 if not stable else 3 if np.isfinite(free_above) else len(NAMES)
    view = View(sketch, c1, c2)
    # The limits, first.
    centre, radius = view.limit()
    best = Verdict(abs(1.0 + centre) - radius)
    # Gain factors at which the neutral root chain is lost.
    lost = [1.0 / r for r in (radius - centre, -centre - radius) if r > 0.0]
    best.gain_lower = max([k for k in lost if k < 1.0], default=0.0)
    best.gain_upper = min([k for k in lost if k > 1.0], default=np.inf)
    if abs(centre) + radius >= 1.0:
        best.delay = 0.0
        if centre > 0.0 and centre - radius <= 1.0:
            cosine = (radius**2 - 1.0 - centre**2) / (2.0 * centre)
            best.phase = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
    first = view.at(np.array([view.low]))
    best.modulus = min(best.modulus, float(np.abs(1.0 + first[0])))

    def limit_gain(value):
        """Take in a value of L on the negative real axis."""
        k = -1.0 / float(value.real)
        if k > 1.0:
            best.gain_upper = min(best.gain_upper, k)
        else:
            best.gain_lower = max(best.gain_lower, k)

    if view.power == 0 and first[0].real < 0.0:
        limit_gain(first[0])

    def kept(value, slope, rest, h, a, b):
        """For each margin, the cells on which a smaller one may lie."""
        away, _ = to_segment(-1.0, value, slope, h)
        keep = np.zeros((len(NAMES), value.size), dtype=bool)
        keep[0] = away <= best.modulus * (1.0 - TOL) + rest
        spread = np.abs(slope) * h + rest
        turn = np.where(best.phase < np.pi, best.phase * (1.0 - TOL), np.pi) * np.ones(
            value.size
        )
        keep[1] = to_arc(value * np.exp(1j * turn), 2.0 * turn) <= spread
        turn = np.minimum(best.delay * (1.0 - TOL) * b, 2.0 * np.pi)
        keep[2] = (to_arc(value, turn) <= spread) & (turn > 0.0)
        real = np.abs(value.imag) <= np.abs(slope.imag) * h + rest
        half = np.abs(slope.real) * h + rest
        smallest, largest = value.real - half, value.real + half
        top = min(best.gain_upper * (1.0 - TOL), GAINS * 1.01)
        bottom = max(best.gain_lower * (1.0 + TOL), 0.99 / GAINS)
        keep[3] = real & (largest > -1.0) & (smallest < -1.0 / top) & (top > 1.0)
        keep[4] = real & (smallest < -1.0) & (largest > -1.0 / bottom) & (bottom < 1.0)
        keep[asked:] = False
        return keep

    def improve(omega):
        # Past there phases are rounded away: L's values are none.
        value = view.at(omega[omega * view.tau.max() * EPS < 1e-8])
        best.modulus = min(best.modulus, float(np.abs(1.0 + value).min(initial=np.inf)))

    def cross(a, b):
        """Crossovers in cells whose ends differ, the most promising of them."""
        at_a, at_b = view.at(a), view.at(b)
        over = np.flatnonzero((np.abs(at_a) > 1.0) != (np.abs(at_b) > 1.0))
        if over.size:
            turn = lag(0.5 * (at_a[over] + at_b[over]))
            some = np.argsort(np.minimum(turn, 2.0 * np.pi - turn))[:9]
            some = over[np.union1d(some, np.argsort(turn / b[over])[:9])]
            omega = zeros_of(view, a[some], b[some], lambda v: np.log(np.abs(v)))
            value = view.at(omega)
            omega, turns = (q[np.abs(np.abs(value) - 1.0) < 1e-10] for q in (omega, lag(value)))
            for turn, place in zip(turns, omega, strict=True):
                best.phase = min(best.phase, float(min(turn, 2.0 * np.pi - turn)))
                best.delay = min(best.delay, float(turn / place))
        over = np.flatnonzero((at_a.imag > 0.0) != (at_b.imag > 0.0))
        middle = 0.5 * (at_a[over] + at_b[over]).real
        some = over[np.argsort(np.abs(middle + 1.0))[:12]]
        if some.size:
            omega = zeros_of(view, a[some], b[some], lambda v: v.imag / np.abs(v))
            value = view.at(omega)
            for met in value[(np.abs(value.imag) < 1e-10 * np.abs(value)) & (value.real < 0.0)]:
                limit_gain(met)

    def done(undecided):
        best.unsure = tuple(
            name for name, is_open in zip(NAMES, undecided, strict=True) if is_open
        )
        return best

    def examine(a, b):
        """Leave out cells on which nothing smaller can lie; return the others, cut."""
        nonlocal used
        used += a.size
        m, h = 0.5 * (a + b), 0.5 * (b - a)
        value, slope, rest, middle, radius = view.enclose(m, h)
        free = a >= free_above
        improve(np.clip(m + to_segment(-1.0, value, slope, h)[1], a, b)[~free])
        improve(m[~free])
        if stable:
            cross(a[~free], b[~free])
        keep = kept(value, slope, rest, h, a, b) | free
        if free.any():
            centre, size = view.enclose(m[free], 0.0 * m[free])[3:]
            improve_free(best, m[free], centre, size, stable)
        keep &= kept(middle, 0.0 * m, radius, h, a, b)
        if used > MOST_CELLS / 2:
            # Nulls of L ask for ever larger gains: leave the cells to the others.
            opened[3:] |= keep[3:].any(axis=1)
            keep[3:] = False
        # As close as floats are: what is open there stays open.
        fine = (b - a) < 3e-14 * b
        rows = keep[:, fine].any(axis=1)
        some = keep.any(axis=0) & ~fine
        return rows, keep[:, some].any(axis=1), *cut(a[some], b[some])

    low, high = view.low, 10.0 * float(view.corners.max())
    high = max(high, 2.0 * free_above) if np.isfinite(free_above) else high
    a, b = view.cells(high, free_above)
    opened = np.zeros(len(NAMES), dtype=bool)

    def past(high):
        """For each margin, whether a smaller one may lie past a frequency."""
        centre, radius = view.tail(high)
        one, end = np.array([1.0]), np.array([np.inf])
        return kept(centre * one + 0j, 0j * one, radius * one, 0.0 * one, high * one, end)[:, 0]

    while True:
        pending = [(np.ones(len(NAMES), dtype=bool), a, b)]
        while pending:
            rows, a, b = pending.pop()
            if a.size > CHUNK:
                pending.append((rows, a[CHUNK:], b[CHUNK:]))
            fine, rows, a, b = examine(a[:CHUNK], b[:CHUNK])
            opened |= fine
            if a.size:
                pending.append((rows, a, b))
            if used > MOST_CELLS:
                left = [entry[0] for entry in pending]
                return done(np.any([opened, past(high), *left], axis=0))
        keep = past(high)
        if not keep.any():
            return done(opened)
        low, high = high, 4.0 * high
        if high > 1e30 * view.corners.max():
            return done(opened | keep)
        a, b = np.array([low]), np.array([high])


def improve_free(best, omega, centre, radius, stable):
    """Take in what the discs of L hold, with both arms' phases free."""
    best.modulus = min(
        best.modulus, float(np.maximum(np.abs(1.0 + centre) - radius, 0.0).min())
    )
    if not stable:
        return
    cosine = (1.0 + np.abs(centre) ** 2 - radius**2) / (2.0 * np.abs(centre))
    met = cosine <= 1.0
    half = np.arccos(np.clip(cosine[met], -1.0, 1.0))
    turn, omega = lag(centre[met]), omega[met]
    nearest = np.maximum(np.minimum(turn, 2.0 * np.pi - turn) - half, 0.0)
    best.phase = min(best.phase, float(nearest.min(initial=np.inf)))
    first = np.where((turn > half) & (turn + half < 2.0 * np.pi), turn - half, 0.0)
    best.delay = min(best.delay, float((first / omega).min(initial=np.inf)))
