"""Random loops of every kind, held against computations that share no code with armlock.

    python -m tests.attack [--loops N] [--seed S] [--first I] [--kinds counts margins ...]
        [--families mixed clusters zero delays]

Loop I of seed S and a family is the same in every run. Each loop of the mixed family is drawn
from all kinds at once: retarded or neutral; up to 12 poles (one in twenty: up to 30) over many
decades, lightly damped pairs far above the delays' frequencies, unstable ones, ones at 0; any
sensor; equal, nearly equal and commensurate delays; c from 1e-6 to 3, at and around (1, 1);
dead times. Clusters are 2 to 8 modes, spaced by 1e-3 to 1e-1, of a Q from 10 to 1e5; zero is
the family of points next to zero parameters. `tests.attack_judge` says what is right. Loops
with three to six delays are drawn and judged by `tests.dense`. Refusals are counted: at
most one in a hundred, within clusters one in five, none later than 5 s.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from armlock import (
    Controller,
    CountError,
    Loop,
    RootError,
    critical_perturbation,
    d_curve,
    equation,
    first_crossing,
    margins,
    modulus_margin,
    rightmost_root,
    stability_chart,
    unstable_roots,
)
from armlock.engine import tolerances
from armlock.engine.decide import Family, excludes
from armlock.engine.tolerances import UNDECIDED
from armlock.sensors import COMMON, DIFFERENCE, SINGLE, dual
from armlock.stability.semidiscretization import semi_discretization
from tests import attack_judge as judge
from tests import dense, independent
from tests.attack_judge import Sketch, UndecidedError, View

#: What a number may be off, relative.
EXACT = 1e-5
#: A refusal later than this, or an answer later than twice this, is a finding, in s.
LATEST = 5.0
NAMES = ("gain_upper", "gain_lower", "phase", "delay", "modulus")
REFUSALS = CountError, RootError, ValueError, ArithmeticError, TimeoutError, SystemError


def to_loop(sketch):
    """The armlock loop of a sketch, or of the terms of its numerator and denominator."""
    if isinstance(sketch, tuple):
        return dense.quotient(*sketch)
    mapping = {"single": SINGLE, "common": COMMON, "difference": DIFFERENCE}.get(sketch.sensor)
    if mapping is None:
        mapping = dual(sketch.corner, sketch.difference)
    controller = Controller(sketch.zeros, sketch.poles, sketch.gain)
    return Loop(controller, mapping, sketch.tau1, sketch.tau2, delay=sketch.delay)


# ---------------------------------------------------------------------------- random loops


def between(rng, low, high):
    return float(10.0 ** rng.uniform(np.log10(low), np.log10(high)))


def roots(rng, count, low, high, unstable):
    """Real roots and pairs, most of them in the left half-plane."""
    found = []
    while len(found) < count:
        size = between(rng, low, high)
        side = 1.0 if rng.random() < unstable else -1.0
        if len(found) + 2 <= count and rng.random() < 0.35:
            damping = between(rng, 1e-4, 1.0) if rng.random() < 0.6 else rng.uniform(0.1, 1.0)
            root = size * complex(side * damping, np.sqrt(max(1.0 - damping**2, 1e-6)))
            found += [root, root.conjugate()]
        else:
            found.append(complex(side * size))
    return found


def draw_delays(rng):
    tau1 = between(rng, 0.1, 40.0)
    kind = rng.choice(["equal", "near", "commensurate", "free", "paper"])
    if kind == "equal":
        return tau1, tau1
    if kind == "near":
        return tau1, tau1 * (1.0 - between(rng, 1e-9, 1e-2))
    if kind == "commensurate":
        return tau1, tau1 * int(rng.integers(1, 6)) / int(rng.integers(1, 6))
    return (20.1, 19.9) if kind == "paper" else (tau1, between(rng, 0.1, 40.0))


def draw_point(rng):
    kind = rng.choice(["one", "close", "closer", "small", "any", "large"])
    if kind == "one":
        return 1.0, 1.0
    if kind == "close":
        return tuple(1.0 + rng.choice([-1, 1]) * between(rng, 1e-9, 1e-2) for _ in range(2))
    if kind == "closer":
        step = rng.choice([-1, 1]) * between(rng, 1e-6, 1e-1)
        return (1.0 + step, 1.0) if rng.random() < 0.5 else (1.0 + step, 1.0 + step)
    if kind == "small":
        return tuple(between(rng, 1e-6, 1.0) for _ in range(2))
    size = 1.3 if kind == "any" else 3.0
    return tuple(float(v) for v in rng.uniform(-size, size, 2))


def turns(sketch):
    """About how many turns of the longest delay lie where |L| is not small."""
    longest = max(sketch.tau1, sketch.tau2)
    highest = max([1.0 / longest, *map(abs, (*sketch.zeros, *sketch.poles))])
    omega = np.geomspace(
        1e-3 / longest, 3.0 * highest if sketch.neutral else 1e9 * highest, 3000
    )
    size = np.zeros(omega.size)
    for z, p, gain, w in sketch.terms():
        jw = 1j * omega[:, None]
        size += np.abs(gain * judge.quotient(jw - z, jw - p)) * np.abs(w).sum()
    return float((np.diff(omega) * (size[1:] > 0.15)).sum() * longest / (2.0 * np.pi))


def draw(rng):
    """A loop of any kind and a point, with a gain that brute force can follow."""
    tau1, tau2 = draw_delays(rng)
    longest = max(tau1, tau2)
    sensor = str(rng.choice(["single", "common", "common", "difference", "dual", "dual"]))
    corner = between(rng, 0.05, 20.0) if rng.random() < 0.7 else 2.0 * np.pi * 0.4
    difference = (tau1 - tau2 or longest) * float(rng.choice([1.0, 0.5]))
    count = int(rng.integers(13, 31)) if rng.random() < 0.05 else int(rng.integers(1, 13))
    span = between(rng, 3.0, 1e5)
    highest = between(rng, 1e-1, 3e4) * (100.0 if rng.random() < 0.02 else 1.0) / longest
    centre = highest / span
    unstable = 0.15 if rng.random() < 0.25 else 0.0
    poles = roots(rng, count, centre / span, centre * span, unstable)
    neutral = rng.random() < 0.4
    zeros_count = count if neutral else int(rng.integers(0, count))
    zeros = roots(rng, zeros_count, centre / span, centre * span, 0.15)
    for k in range(int(rng.integers(1, 3)) if rng.random() < 0.4 else 0):
        if k < count and isinstance(poles[k], complex) and poles[k].imag == 0.0:
            poles[k] = 0j
    for k in range(int(rng.integers(1, 3)) if rng.random() < 0.25 else 0):
        if k < zeros_count and zeros[k].imag == 0.0:
            zeros[k] = 0j
    delay = between(rng, 1e-6, 1.0) if rng.random() < 0.4 else 0.0
    sketch = Sketch(
        tuple(zeros), tuple(poles), 1.0, sensor, tau1, tau2, delay, corner, difference
    )
    point = draw_point(rng)
    sketch = sketch.scaled(between(rng, 0.03, 1.0) if neutral else between(rng, 1e-3, 1e6))
    if not neutral:
        # |K| of ordinary size at a frequency of the delays or of the loop.
        at = between(rng, 0.1, 100.0) / longest if rng.random() < 0.7 else centre
        size = abs(View(sketch, 0.3, -0.2).at(np.array([at]))[0])
        sketch = sketch.scaled(between(rng, 0.01, 30.0) / size)
    sketch = sketch.scaled(-1.0) if rng.random() < 0.15 else sketch
    if sensor == "difference" and tau1 == tau2 and point[0] == point[1]:
        raise UndecidedError("the difference of equal arms is zero")
    sizes = np.abs(View(sketch, *point).at(np.geomspace(1e-60, 1e-9, 52) / longest))
    if ((sizes[1:] > 0.1) & (sizes[1:] > 5.0 * sizes[:-1])).any():
        raise UndecidedError("L ascends to unity gain below what the judge looks at")
    most = between(rng, 10.0, 2000.0)
    for _ in range(60):
        if turns(sketch) < most:
            break
        sketch = sketch.scaled(0.3)
    # Most by far are unstable; less gain makes some of them stable.
    for _ in range(4):
        if rng.random() < 0.2 or judge.count(sketch, *point) == 0:
            break
        sketch = sketch.scaled(0.2)
    return sketch, point


def draw_paper(rng):
    """The paper's loop, its numbers a little moved."""
    from armlock import paper_loop

    k = paper_loop(actuator=bool(rng.random() < 0.3)).controller
    tau1, tau2 = (
        (20.1, 19.9) if rng.random() < 0.5 else (between(rng, 5, 40), between(rng, 5, 40))
    )
    moved = [
        [complex(r * 10.0 ** rng.normal(0.0, 0.05)) for r in rs]
        for rs in (k.zeros(), k.poles())
    ]
    gain = k.gain * between(rng, 0.3, 3.0)
    delay = between(rng, 1e-6, 1e-2) if rng.random() < 0.3 else 0.0
    point = (1.0, 1.0) if rng.random() < 0.5 else tuple(1 + rng.normal(0.0, 3e-7, 2))
    return (
        Sketch(*map(tuple, moved), gain, "dual", tau1, tau2, delay, 2.5, tau1 - tau2),
        (float(point[0]), float(point[1])),
    )


def draw_arm(rng):
    """Single, common or dual arm with an integrator and gains over decades."""
    sensor = str(rng.choice(["single", "common", "dual"]))
    tau1, tau2 = draw_delays(rng)
    gain = between(rng, 1e-3, 1e3) / max(tau1, tau2)
    delay = between(rng, 1e-6, 1.0) if rng.random() < 0.3 else 0.0
    difference = tau1 - tau2 or tau1
    return Sketch((), (0j,), gain, sensor, tau1, tau2, delay, 2.5, difference), draw_point(rng)


def draw_cluster(rng):
    """Lightly damped modes next to one another, as structures and cavities have them."""
    tau1, tau2 = draw_delays(rng)
    sensor = str(rng.choice(["single", "common", "difference", "dual"]))
    number = int(rng.integers(2, 9))
    spacing, quality = between(rng, 1e-3, 1e-1), between(rng, 10.0, 1e5)
    centre = between(rng, 1.0, 300.0) / max(tau1, tau2)

    def modes(places):
        sizes = centre * (1.0 + spacing * (places + 0.1 * rng.normal(size=places.size)))
        damping = 0.5 / quality * 10.0 ** rng.uniform(-0.3, 0.3, places.size)
        upper = sizes * (-damping + 1j * np.sqrt(1.0 - damping**2))
        return [
            complex(root) for pair in zip(upper, upper.conj(), strict=True) for root in pair
        ]

    places = np.arange(number) - 0.5 * (number - 1)
    poles = modes(places)
    # Zeros between the modes, as where force and sensor are at one place.
    zeros = modes(places[1:] - 0.5) if rng.random() < 0.4 else []
    if rng.random() < 0.3:
        poles.append(0j)
    difference = (tau1 - tau2 or tau1) * float(rng.choice([1.0, 0.5]))
    delay = between(rng, 1e-6, 1.0) if rng.random() < 0.3 else 0.0
    sketch = Sketch(tuple(zeros), tuple(poles), 1.0, sensor, tau1, tau2, delay, 2.5, difference)
    point = draw_point(rng)
    if sensor == "difference" and tau1 == tau2 and point[0] == point[1]:
        raise UndecidedError("the difference of equal arms is zero")
    peaks = np.array([abs(pole) for pole in poles if pole])
    largest = np.abs(View(sketch, *point).at(peaks)).max()
    return sketch.scaled(between(rng, 0.03, 30.0) / largest), point


def draw_near_zero(rng):
    """A loop at parameters next to zero; |L| may be one far below all its corners."""
    sketch, _ = draw(rng)
    sizes = [rng.choice([-1, 1]) * between(rng, 1e-12, 1e-3) for _ in range(2)]
    kind = rng.choice(["both", "one", "equal", "close"])
    if kind == "one":
        sizes[1] = float(rng.choice([0.0, 1.0]))
    if kind == "equal":
        sizes[1] = sizes[0]
    if kind == "close":
        sizes = [0.5, 0.5 + sizes[0]]
    if sketch.sensor == "difference" and sketch.tau1 == sketch.tau2 and sizes[0] == sizes[1]:
        raise UndecidedError("the difference of equal arms is zero")
    return sketch, (float(sizes[0]), float(sizes[1]))


FAMILIES = {
    "mixed": (draw, draw, draw, draw, draw_paper, draw_arm),
    "clusters": (draw_cluster,),
    "zero": (draw_near_zero,),
    "delays": (lambda rng: (dense.drawn(rng), None),),
}
#: How many refusals among its calls are too many.
REFUSED = {"mixed": 1e-2, "clusters": 0.2, "zero": 1e-2, "delays": 1e-2}


# ---------------------------------------------------------------------------- what is checked


def _too_late(*_):
    raise TimeoutError


@dataclass
class Tally:
    """Calls, refusals and findings of a run.

    From the command line it is patient: it ends calls that last, and prints what it finds.
    """

    calls: Counter = field(default_factory=Counter)
    refused: list = field(default_factory=list)
    wrong: list = field(default_factory=list)
    skipped: Counter = field(default_factory=Counter)
    controls: Counter = field(default_factory=Counter)
    where: object = None
    worst: dict = field(default_factory=dict)
    patient: bool = hasattr(signal, "setitimer")

    def ask(self, name, function, *arguments):
        """Call armlock; None if it refuses. A late call is made again: it may have compiled."""
        self.calls[name] += 1
        for _ in range(2):
            start, answer, refusal = time.process_time(), None, ""
            if self.patient:
                signal.signal(signal.SIGPROF, _too_late)
                signal.setitimer(signal.ITIMER_PROF, 4.0 * LATEST)
            try:
                answer = function(*arguments)
            except REFUSALS as error:
                refusal = f"{error!r:.300}"
            finally:
                if self.patient:
                    signal.setitimer(signal.ITIMER_PROF, 0.0)
            spent = time.process_time() - start
            if spent <= (LATEST if refusal else 2.0 * LATEST):
                break
        else:
            self.note(name, arguments[1:], refusal or "an answer", f"not after {spent:.1f} s")
        if refusal:
            self.refused.append((name, self.where, arguments[1:], refusal, spent))
            self.say(f"REFUSED {name} at {arguments[1:]}: {refusal:.160} ({spent:.1f} s)")
        return answer

    def note(self, name, arguments, got, expected):
        self.wrong.append((name, self.where, arguments, got, expected))
        self.say(f"WRONG {name} at {arguments}: got {got}, expected {expected}")

    def say(self, line):
        if self.patient:
            print(f"{line}\n   of loop {self.where}", flush=True)

    def near(self, name, arguments, got, expected, unsure=False, upward=False):
        """Compare a number with the judge's, or with its bound on one side."""
        if unsure:
            self.skipped[f"{name}: one-sided"] += 1
            good = (
                got >= expected * (1 - EXACT)
                if upward
                else got <= expected * (1 + EXACT) + 1e-9
            )
        elif np.isfinite(expected) and np.isfinite(got):
            off = abs(got - expected) / max(abs(expected), 1e-4)
            self.worst[name] = max(self.worst.get(name, 0.0), off)
            good = off <= EXACT
        else:
            good = got == expected
        if not good:
            self.note(name, arguments, got, f"{expected!r}{' or beyond' if unsure else ''}")

    def same(self, name, sketch, point, got):
        """Compare a count with the judge's."""
        try:
            expected = judge.count(sketch, *point)
        except UndecidedError:
            expected = -1
        if got == UNDECIDED:
            self.refused.append((name, self.where, point, "undecided", 0.0))
        elif expected == -1 and got >= 0:
            self.skipped[f"{name}: judge undecided"] += 1
        elif got == -1 != expected:
            if expected == -2 or judge.distance(sketch, *point) > 1e-10:
                self.note(name, point, got, expected)
        elif got != expected:
            self.note(name, point, int(got), expected)


def check_counts(tally, rng, sketch, loop, point):
    points = [point, draw_point(rng), draw_point(rng)]
    got = tally.ask("unstable_roots", unstable_roots, loop, *np.array(points).T)
    for here, count in zip(points, [] if got is None else got, strict=False):
        tally.same("unstable_roots", sketch, here, count)


def check_margins(tally, rng, sketch, loop, point):
    number = judge.count(sketch, *point)
    if number in (-1, -2):
        return
    verdict = judge.margins(sketch, *point, stable=number == 0)
    got = tally.ask("modulus_margin", modulus_margin, loop, *point)
    if got is not None:
        tally.near("modulus_margin", point, got, verdict.modulus, "modulus" in verdict.unsure)
    if number != 0:
        return
    found = tally.ask("margins", margins, loop, *point)
    if found is None:
        return
    # The value is met where it is said to be.
    if np.isfinite(found.modulus_omega):
        met = abs(1.0 + complex(View(sketch, *point).at(np.array([found.modulus_omega]))[0]))
        tally.near("margins.modulus, met", point, found.modulus, met)
    for name in judge.NAMES:
        got, expected = getattr(found, name), getattr(verdict, name)
        if name == "gain_upper":
            got, expected = (np.inf if v >= judge.GAINS else v for v in (got, expected))
        if name == "gain_lower":
            got, expected = (0.0 if v < 1.0 / judge.GAINS else v for v in (got, expected))
        # A bound says that the loop is stable up to there, and no more.
        if name == "gain_upper" and found.gain_upper_is_bound:
            expected = min(got, expected)
        if name == "gain_lower" and found.gain_lower_is_bound:
            expected = max(got, expected)
        unsure, upward = name in verdict.unsure, name == "gain_lower"
        tally.near(f"margins.{name}", point, got, expected, unsure, upward)
    low, high = max(found.gain_lower, 1.0 / judge.GAINS), min(found.gain_upper, judge.GAINS)

    def unstable(*factors):
        """Whether the loop is unstable at one of these gain factors; None if that is open."""
        counts = []
        for factor in factors:
            if (
                not 1.0 / judge.GAINS <= factor <= judge.GAINS
                or turns(sketch.scaled(factor)) > 5e4
            ):
                return None
            try:
                counts.append(judge.count(sketch.scaled(factor), *point))
            except UndecidedError:
                tally.skipped["gain interval: judge undecided"] += 1
                return None
        return None if -1 in counts else any(counts)

    interval = f"{found.gain_lower, found.gain_upper}"
    for factor in (low * 1.00001, high * 0.99999, *(low * (high / low) ** rng.random(2))):
        if unstable(factor):
            tally.note("gain interval", (*point, factor), interval, "unstable")
    # Past its end a pair that has crossed may cross back at once.
    ends = (
        (found.gain_lower, -1.0, found.gain_lower_is_bound),
        (found.gain_upper, 1.0, found.gain_upper_is_bound),
    )
    centre, radius = View(sketch, *point).limit()
    for edge, way, is_bound in ends:
        if radius < 1e-7 * abs(centre) and abs(1.0 + edge * centre) < 1e-6:
            continue  # the chain is lost within 1e-7 of here only, nearer than any of `past`
        past = [edge * (1.0 + way * share) for share in (1e-5, 1e-6, 1e-7)]
        if not is_bound and unstable(*past) is False:
            tally.note("gain interval", (*point, edge), interval, "stable past it")


def check_free(tally, rng, sketch, loop, point):
    """Margins with both arms' phases free above a frequency."""
    above = between(rng, 1e-2, 1e3) / max(sketch.tau1, sketch.tau2)
    if judge.count(sketch, *point) != 0:
        return
    verdict = judge.margins(sketch, *point, free_above=above)
    found = tally.ask("margins, free", partial(margins, free_above=above), loop, *point)
    if verdict.modulus <= 0.0:
        # Some phases make it unstable: whatever is said then, no margin may be left.
        if found is not None and found.modulus > 1e-9:
            tally.note("margins.modulus, free", (*point, above), found.modulus, 0.0)
        return
    for name in judge.NAMES[:3] if found is not None else ():
        unsure = name in verdict.unsure
        got, expected = getattr(found, name), getattr(verdict, name)
        tally.near(f"margins.{name}, free", (*point, above), got, expected, unsure)


def check_rays(tally, rng, sketch, loop, point):
    start = np.array(point if rng.random() < 0.5 else draw_point(rng))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    way = (
        np.array([np.cos(angle), np.sin(angle)]) if rng.random() < 0.7 else np.array([1.0, 1.0])
    )
    stop = between(rng, 0.01, 3.0)
    # Parameters that confine the neutral chain lie within a convex set.
    while stop > 1e-9 and not View(sketch, *(start + stop * way)).confined():
        stop *= 0.7
    if stop <= 1e-9 or not View(sketch, *start).confined():
        return
    found = tally.ask("first_crossing", first_crossing, loop, start, way, stop)
    if found is None:
        return
    t = min(found.position, stop)
    # Crossings so near to the limit of the neutral chain are not looked for.
    near = 1e-6 if np.isfinite(found.omega) else 2e-5
    if near * t < 1e-10 * np.hypot(*start):
        tally.skipped["first_crossing: below rounding"] += 1
        return
    shares = np.array([1e-3, *rng.random(3) * (1.0 - near), 1.0 - near, 1.0 + near])
    counts = [judge.count(sketch, *(start + share * t * way)) for share in shares]
    told = [count for count in counts[:-1] if count != -1]
    past = counts[-1] if np.isfinite(found.position) else -1
    if len(set(told)) > 1 or past in told:
        tally.note("first_crossing", (start, way, stop), found, (shares, counts))


def check_critical(tally, rng, sketch, loop, point):
    if judge.count(sketch, 1.0, 1.0) != 0:
        return
    angle = rng.uniform(0.0, 2.0 * np.pi)
    way = np.array([np.cos(angle), np.sin(angle)]) * between(rng, 1e-3, 1e3)
    eps = tally.ask("critical_perturbation", critical_perturbation, loop, way)
    if eps is None:
        return
    if np.isinf(eps):
        # Parameters past 1e9 times those of the start are not looked at.
        farthest = 0.99e9 * np.sqrt(2.0) / np.hypot(*way)
        for share in (*rng.random(3), 1.0):
            counts = judge.count(sketch, *(1.0 + share * farthest * way))
            if counts not in (0, -1):
                tally.note("critical_perturbation", (way, share * farthest), eps, counts)
                return
        return
    # The parameters are numbers next to one, and rounded as these are. The limit of the chain
    # is taken for roots that cross within 1e-5 of it.
    at_limit = judge.count(sketch, *(1.0 + 1.0001 * eps * way)) == -2
    near = max(2e-5 if at_limit else 1e-6, 1e-15 / (eps * np.abs(way).max()))
    if near > 0.1:
        tally.skipped["critical_perturbation: below rounding"] += 1
        return
    for share in (1e-3, *(rng.random(3) * (1.0 - near)), 1.0 - near, 1.0 + near):
        counts = judge.count(sketch, *(1.0 + share * eps * way))
        if counts != -1 and (counts == 0) != (share < 1.0):
            tally.note("critical_perturbation", (way, share), eps, counts)
            return


def check_root(tally, rng, sketch, loop, point):
    number = judge.count(sketch, *point)
    if number == -2:
        return
    # The judge counts the roots of D, with one at s = 0 that cancels in the loop.
    root = tally.ask("rightmost_root", rightmost_root, equation(1 + loop), *point)
    if root is None:
        return
    longest = max(sketch.tau1, sketch.tau2)
    near = 1e-7 * (abs(root) + 1e-3 / longest)
    off = number >= 0 and (root.real > 0.0) != (number > 0)
    if off and abs(root.real) > near:
        tally.note("rightmost_root", point, root, f"count {number}")
        return
    if not np.isfinite(root) or -root.real * longest > 300.0:
        tally.skipped["rightmost_root: far left"] += 1
        return
    right, left = (judge.count(sketch, *point, root.real + d) for d in (near, -near))
    if right > 0 or left == 0:
        tally.note("rightmost_root", point, root, f"{right} right, {left} with it")


def check_chart(tally, rng, sketch, loop, point):
    x = np.array(point)[0] + rng.uniform(-0.3, 0.3, 4) * between(rng, 1e-6, 10.0)
    y = np.array(point)[1] + rng.uniform(-0.3, 0.3, 3) * between(rng, 1e-6, 10.0)
    if max(np.abs(x).max(), np.abs(y).max()) > 4.0:
        return
    chart = tally.ask("stability_chart", stability_chart, loop, x, y)
    single = tally.ask("unstable_roots", unstable_roots, loop, *np.meshgrid(x, y))
    if chart is None or single is None:
        return
    for j, i in np.argwhere(chart.counts != single):
        tally.note("stability_chart", (x[i], y[j]), chart.counts[j, i], single[j, i])
    for _ in range(2):
        i, j = rng.integers(x.size), rng.integers(y.size)
        tally.same("stability_chart", sketch, (x[i], y[j]), chart.counts[j, i])


def check_dcurve(tally, rng, sketch, loop, point):
    if sketch.tau1 == sketch.tau2 or sketch.sensor == "single":
        return
    longest = max(sketch.tau1, sketch.tau2)
    omega = np.array([between(rng, 1e-5, 1e3) for _ in range(8)]) / longest
    found = tally.ask("d_curve", d_curve, loop, omega)
    if found is None:
        return
    for w, x, y in zip(omega, *found, strict=True):
        if not np.isfinite(x + y):
            continue
        view, size, jw = View(sketch, x, y), 1.0, np.array([[1j * w]])
        for z, p, gain, (w1, w2) in view.terms:
            whole = abs(w1) * (1.0 + abs(x)) + abs(w2) * (1.0 + abs(y))
            size += whole * abs(gain * judge.quotient(jw - z, jw - p)[0])
        off = abs(1.0 + view.at(np.array([w]))[0]) / size
        if off > 1e-9:
            tally.note("d_curve", w, (x, y), f"|1 + L| = {off:.1e} of its terms")


def check_maps(tally, rng, sketch, loop, point):
    if sketch.neutral or sketch.delay or len(sketch.poles) > 4:
        return
    parts = int(rng.integers(2, 12))
    step = sketch.tau1 / parts
    if max(abs(p) for p in sketch.poles) * step > 5.0:
        return
    sketch = replace(sketch, tau2=step * int(rng.integers(1, 12)), difference=sketch.difference)
    order = int(rng.integers(2))
    plane = tally.ask("semi_discretization", semi_discretization, to_loop(sketch), step, order)
    if plane is None:
        return
    x, y = rng.uniform(-3.0, 3.0, (2, 4))
    got = tally.ask("map counts", unstable_roots, plane, x, y)
    chart = tally.ask("map chart", stability_chart, plane, x, y)
    if got is None or chart is None:
        return
    for k in range(4):
        found = independent.map_eigenvalues(plane, x[k], y[k])
        size, slow = np.abs(found), np.abs(found - 1.0)
        if np.abs(size - 1.0).min() < 1e-5:
            continue
        expected = int(np.count_nonzero(size > 1.0))
        for name, count in (("map counts", got[k]), ("map chart", chart.counts[k, k])):
            if count == -1 and np.prod(slow[slow < 0.1]) < 1e-10:
                # Together next to z = 1, where rounding hides them.
                tally.skipped[f"{name}: next to z = 1"] += 1
            elif count != expected:
                tally.note(name, (step, order, x[k], y[k]), int(count), expected)


def compared(n, d, ask, controls):
    """Compare N / D with dense grids; return count and what differs. `ask` calls armlock."""
    loop, whole = dense.quotient(n, d), dense.plus(n, d)
    found = ask("unstable_roots", unstable_roots, loop)
    if found is None:
        return -1, []
    try:
        expected = dense.count(whole)
    except dense.UndecidedError:
        expected = -2
    if found or found != expected:
        return found, [] if found == expected else [f"count {found} for {expected}"]
    certified = ask("margins", margins, loop)
    if certified is None:
        return found, []
    wrong = []
    for name, b in zip(NAMES, dense.margins(n, d), strict=True):
        a = getattr(certified, name)
        # Gain factors are looked at from 1e-4 to 1e4.
        if name.startswith("gain"):
            a = np.inf if a >= 1e4 else 0.0 if a <= 1e-4 else a
        too_good = a > b * (1 + 2e-6) if name != "gain_lower" else a < b * (1 - 2e-6)
        if too_good or not (a == b or math.isclose(a, b, rel_tol=1e-5)):
            wrong.append(f"{name} {a} for {b}")
    return found, wrong + too_good_ones(*loop.affine.quotient(), certified, controls)


def is_certified(n, m, name, level):
    """Whether the engine certifies that no less than this level makes N / M marginal."""
    one, other, none, arc = (1.0, 0.0), (0.0, 1.0), (0.0, 0.0), None
    tests = [[(1, one, none), (2, other, none)], [(2, one, none), (1, other, none)]]
    if name == "modulus":
        n, tests = n + m, [[(1, one, none), (2, (0.0, level), none)]]
    elif name in ("gain_upper", "gain_lower"):
        n, m, end = (m, n, level) if name == "gain_upper" else (n, m, 1.0 / level)
        tests = [[(1, (1.0, 1.0), none), (1, (1.0, end), none)]]
    else:
        turns = {"phase": (-level, 0.0, level, 0.0), "delay": (0.0, 0.0, 0.0, level)}
        arc = turns[name], (0.0, 0.0, 0.0, 0.0)
    try:
        return excludes(Family([n, m], tests, arc))
    except tolerances.UndecidedError:
        return False


def too_good_ones(n, m, found, tally):
    """Margins that would be certified although they are better than the true ones by 1e-5.

    How many are not, and how many are that are 3e-5 worse, is counted.
    """
    wrong = []
    for name in NAMES:
        level, way = getattr(found, name), -1.0 if name == "gain_lower" else 1.0
        if not 0.0 < level < np.inf:
            continue
        if name.startswith("gain") and not 1e-4 < level < 1e4:
            # It may be the largest factor that was looked at, and no margin.
            continue
        for what, share in (("too good", 1e-5), ("too small", -3e-5)):
            certified = is_certified(n, m, name, level * (1.0 + way * share))
            tally[f"{what}: {'' if certified else 'not '}certified"] += 1
            if certified and what == "too good":
                wrong.append(f"{name} too good")
    return wrong


def check_controls(tally, rng, sketch, loop, point):
    """No margin that is 1e-5 too good is certified; nearly all that are 3e-5 worse are."""
    if judge.count(sketch, *point) != 0:
        return
    found = tally.ask("margins", margins, loop, *point)
    if found is None:
        return
    quotient = loop.affine.quotient(*point)
    for what in too_good_ones(*quotient, found, tally.controls):
        tally.note("controls", point, what, "no certificate")


def check_delays(tally, rng, sketch, loop, point):
    """Three to six delays: counts, margins and the rightmost root."""
    count, wrong = compared(*sketch, tally.ask, tally.controls)
    for what in wrong:
        tally.note("delays", point, what, "the judge's")
    root = None if count == -2 else tally.ask("rightmost_root", rightmost_root, loop)
    if root is None:
        return
    near = 1e-6 * (1.0 + abs(root))
    right, left = (
        dense.count(dense.shifted(dense.plus(*sketch), sigma))
        for sigma in (root.real + near, root.real - near)
    )
    if right > 0 or left == 0 or (count >= 0 and (root.real > 0.0) != (count > 0)):
        tally.note("rightmost_root", point, root, f"{right} right, {left} with it, {count}")


CHECKS = {
    "counts": (check_counts, 1.0),
    "margins": (check_margins, 1.0),
    "free": (check_free, 0.3),
    "rays": (check_rays, 0.3),
    "critical": (check_critical, 0.5),
    "roots": (check_root, 0.3),
    "charts": (check_chart, 0.3),
    "dcurve": (check_dcurve, 0.3),
    "maps": (check_maps, 0.3),
    "controls": (check_controls, 0.3),
}
#: The checks of loops with more delays.
MORE_DELAYS = {"delays": (check_delays, 1.0)}
KINDS = tuple(CHECKS | MORE_DELAYS)


def attack(seed, loops, kinds=KINDS, tally=None, family="mixed"):
    """Check the loops of these indices of a family; return the tally."""
    tally, place = tally or Tally(), list(FAMILIES).index(family)
    checks = MORE_DELAYS if family == "delays" else CHECKS
    for index in loops:
        rng = np.random.default_rng([seed, index, *((1000 + place,) if place else ())])
        maker = rng.choice(FAMILIES[family])
        try:
            sketch, point = maker(rng)
            loop = to_loop(sketch)
        except (ValueError, UndecidedError):
            tally.skipped["no such loop"] += 1
            continue
        tally.where = (index, sketch)
        tally.calls["loops"] += 1
        for number, (kind, (check, share)) in enumerate(checks.items()):
            own = np.random.default_rng([seed, index, number + 100 * place])
            if kind in kinds and own.random() < share:
                try:
                    check(tally, own, sketch, loop, point)
                except (UndecidedError, dense.UndecidedError):
                    tally.skipped[f"{kind}: judge undecided"] += 1
        if tally.patient and index % 100 == 99:
            print(
                f"... {family} {index + 1}: {len(tally.wrong)} wrong, "
                f"{len(tally.refused)} refused",
                flush=True,
            )
    return tally


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--loops", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="index of the first loop")
    parser.add_argument("--kinds", nargs="*", default=KINDS, choices=KINDS)
    parser.add_argument("--families", nargs="*", default=list(FAMILIES), choices=list(FAMILIES))
    given = parser.parse_args()
    numbers, bad = range(given.first, given.first + given.loops), False
    for family in given.families:
        # The first call of a kind compiles.
        attack(given.seed, numbers[:10], given.kinds, Tally(patient=False), family)
        start = time.perf_counter()
        tally = attack(given.seed, numbers, given.kinds, family=family)
        calls = sum(tally.calls.values()) - tally.calls["loops"]
        print(f"\n{family}, seed {given.seed}, in {time.perf_counter() - start:.0f} s:")
        print(dict(tally.calls))
        print("not decided by the judge:", dict(tally.skipped))
        print("negative controls:", dict(tally.controls))
        print("largest deviations:", {k: f"{v:.1e}" for k, v in tally.worst.items()})
        print("wrong:", len(tally.wrong), dict(Counter(entry[0] for entry in tally.wrong)))
        refused = dict(Counter(entry[0] for entry in tally.refused))
        print("refused:", len(tally.refused), "of", calls, refused, flush=True)
        bad |= bool(tally.wrong) or len(tally.refused) > REFUSED[family] * calls
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
