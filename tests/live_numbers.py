"""Every number that the live pages show, held against the package's, for loops drawn anew.

    python -m tests.live_numbers [--loops N] [--seed S]

Loops have any sensor, up to eight poles and a dead time, are neutral or retarded, slow ones
and the pages' own presets among them; most are made stable by less gain, since only a stable
loop has margins. The engine, `book/_static/live/`, runs in Chromium. A number may differ by the
part in a thousand that the page says; what the page says it cannot tell is counted.
"""

from __future__ import annotations

import argparse
import itertools
import math
import secrets
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from armlock import CountError, critical_perturbation, margins, rightmost_root, unstable_roots
from tests import attack_judge as judge
from tests.attack import between, draw_arm, draw_delays, draw_paper, draw_point, roots, to_loop
from tests.attack_judge import Sketch, View

LIVE = Path(__file__).parents[1] / "book" / "_static" / "live"
#: The engine's files. Each function takes what those before it return.
ENGINE = ("loop.js", "margins.js", "chart.js", "curves.js")
LOAD = """() => {
    window.live = armlockLoop();
    Object.assign(live, armlockMargins(live), armlockChart(live), armlockCurves(live));
}"""
#: What a count in a browser is where it is no number of roots, as `loop.js` has it.
BOUNDARY, UNCONFINED, UNDECIDED = -1, -2, -3
#: What a number may differ by, relative; `margins.js` has it as NEAR. Next to a limit of the
#: chain both sides take the limit for roots that cross closer to it.
NEAR = 1.001e-3
DIRECTIONS = ((1, -1), (1, 1), (-1, -1))
#: The unstable roots of the closed loop, as the page counts them: where numerator and
#: denominator of L share a root at s = 0 it is left out.
closed_loop_count = unstable_roots
#: All that the page shows of a loop at a point. JSON has no infinity and no nan.
ASK = """cases => cases.map(([spec, c1, c2]) => {
    const loop = live.make(spec), say = v => typeof v === 'number' ? String(v) : v;
    const found = live.margins(spec, c1, c2);
    const root = live.rightmost(spec, c1, c2);
    return {
        count: live.count(loop, c1, c2), root,
        breaks: [[1, -1], [1, 1], [-1, -1]].map(([x, y]) => {
            const broken = live.firstBreak(loop, x, y);
            return broken && say(broken.size);
        }),
        margins: found && Object.fromEntries(
            Object.entries(found).map(([name, value]) => [name, say(value)])),
    };
})"""


def open_engine(chromium):
    """A page with the engine and nothing else."""
    page = chromium.new_page()
    for name in ENGINE:
        page.add_script_tag(content=(LIVE / name).read_text())
    page.evaluate(LOAD)
    return page


def described(sketch):
    """The description of a loop that `loop.js` takes."""
    found = asdict(sketch)
    for name in ("zeros", "poles"):
        found[name] = [[complex(root).real, complex(root).imag] for root in found[name]]
    return found


def draw_any(rng):
    """A loop of any sensor and up to eight poles, and a point."""
    tau1, tau2 = draw_delays(rng)
    longest = max(tau1, tau2)
    low, high = 1e-4 / longest, 30.0 / longest
    count, neutral = int(rng.integers(1, 9)), rng.random() < 0.4
    poles = roots(rng, count, low, high, 0.15 if rng.random() < 0.3 else 0.0)
    zeros = roots(rng, count if neutral else int(rng.integers(0, count)), low, high, 0.15)
    for found in (zeros, poles):
        if found and found[0].imag == 0.0 and rng.random() < 0.3:
            found[0] = 0j
    sketch = Sketch(
        tuple(zeros), tuple(poles), 1.0,
        str(rng.choice(["single", "common", "difference", "dual"])), tau1, tau2,
        between(rng, 1e-3, 1.0) if rng.random() < 0.3 else 0.0,
        between(rng, 0.05, 20.0), tau1 - tau2 or longest,
    )  # fmt: skip
    size = 1.0
    if not neutral:
        at = between(rng, 0.1, 30.0) / longest
        size = abs(View(sketch, 0.3, -0.2).at(np.array([at]))[0])
    sign = -1.0 if rng.random() < 0.15 else 1.0
    return sketch.scaled(sign * between(rng, 0.01, 3.0) / size), draw_point(rng)


def draw_preset(rng):
    """One of the pages' own loops, its gain a little moved, at a point of its chart."""
    common = Sketch((), (0j,), 1.0, "common", 20.1, 19.9, 0.0, 0.8 * math.pi, 0.2)
    lead = replace(common, zeros=(-0.02,), poles=(0j, -0.1), delay=0.1)
    chosen = (
        (common, 0.0, 3.0),
        (replace(common, sensor="single"), 0.0, 3.0),
        (replace(common, sensor="dual", gain=10.0), 1.0, 0.3),
        (lead, 0.0, 1.5),
    )
    sketch, centre, half = chosen[int(rng.integers(len(chosen)))]
    point = (1.0, 1.0)
    if rng.random() < 0.8:
        x, y = centre + half * rng.uniform(-1.0, 1.0, 2)
        point = (float(x), float(y))
    return sketch.scaled(between(rng, 0.3, 3.0)), point


#: The share of each kind.
KINDS = {draw_any: 0.55, draw_preset: 0.2, draw_arm: 0.2, draw_paper: 0.05}


def draw(rng):
    """A loop and a point, its gain lowered until it is stable, as a rule."""
    kinds = list(KINDS)
    sketch, point = kinds[int(rng.choice(len(kinds), p=list(KINDS.values())))](rng)
    if 0.0 in sketch.poles and len(sketch.poles) > 5:
        # With a dead time the paper's loop and its actuator have tens of thousands of roots.
        sketch = replace(sketch, delay=0.0)
    for _ in range(5):
        try:
            if rng.random() < 0.1 or closed_loop_count(to_loop(sketch), *point) == 0:
                break
        except CountError:
            pass
        sketch = sketch.scaled(0.3)
    return sketch, point


class Comparison:
    """What agreed, what differed, and what one of the two could not tell."""

    def __init__(self):
        self.asked, self.unsure, self.refused = Counter(), Counter(), Counter()
        self.wrong, self.judged = [], []
        self.worst = Counter()

    def number(self, name, case, hers, ours, verdict=None):
        """Hers is the page's number as text, ours the package's.

        Where they differ, `verdict` asks a third one: one that shares no code with the two, or
        the package's counts.
        """
        self.asked[name] += 1
        hers = float(hers)
        if math.isnan(hers):
            self.unsure[name] += 1
            return
        if math.isfinite(hers) and math.isfinite(ours):
            off = abs(hers - ours) / max(abs(ours), 1e-300) if hers != ours else 0.0
            self.worst[name] = max(self.worst[name], off)
            good = off <= NEAR
        else:
            good = hers == ours
        if good:
            return
        third = verdict() if verdict else math.nan
        agrees = hers == third or abs(hers - third) <= NEAR * abs(third)
        (self.judged if agrees else self.wrong).append((name, case, hers, ours))

    def package(self, name, function, *arguments):
        """Ask the package; None where it refuses."""
        try:
            return function(*arguments)
        except (CountError, ValueError, RuntimeError) as error:
            self.refused[name] += 1
            return error

    def one_has_none(self, name, case, hers, ours):
        """Whether nothing can be compared: an unstable loop has no such number, in both."""
        if isinstance(ours, Exception):
            unstable = isinstance(ours, ValueError) and "must be stable" in str(ours)
            shown = hers.values() if isinstance(hers, dict) else [hers]
            if unstable and not {None, "nan"} & {str(v).lower() if v else v for v in shown}:
                self.wrong.append((name, case, hers, ours))
            return True
        # A perturbation of 0 says as well that the loop is not stable next to (1, 1).
        if hers is None and ours != 0.0:
            self.wrong.append((name, case, hers, ours))
        return hers is None

    def compare(self, sketch, point, page):
        """Hold all that the page says of a loop against the package."""
        loop, case = to_loop(sketch), (sketch, point)
        count = self.package("count", closed_loop_count, loop, *point)
        if not isinstance(count, Exception):
            self.asked["count"] += 1
            if page["count"] == UNDECIDED or (page["count"] == BOUNDARY != count):
                self.unsure["count"] += 1
            elif count not in (page["count"], BOUNDARY):
                self.wrong.append(("count", case, page["count"], int(count)))
        if page["count"] >= 0:
            root = self.package("root", rightmost_root, loop, *point)
            # Where the package gives the root at s = 0 of the denominator, none is compared.
            if not isinstance(root, Exception) and complex(root) != 0.0:
                hers, frequency = page["root"] or (math.nan, 0.0)
                ours, longest = complex(root).real, max(sketch.tau1, sketch.tau2)
                # At the limit of a chain the package gives a root up to this far left of it.
                near = 1e-6 * max(abs(ours), 1.0 / longest)
                if math.isinf(frequency) and 0.0 <= hers - ours <= near:
                    ours = hers
                self.number("root", case, hers, ours)
        for direction, hers in zip(DIRECTIONS, page["breaks"], strict=True):
            ours = self.package("break", critical_perturbation, loop, direction)
            if self.one_has_none(f"break {direction}", case, hers, ours):
                continue

            def lost_earlier(first=float(hers), ours=ours, direction=direction):
                # The package's own counts say that the loop is lost at the smaller one.
                near = [
                    1.0 + first * share * np.array(direction) for share in (1 - NEAR, 1 + NEAR)
                ]
                inside, outside = (closed_loop_count(loop, *point) for point in near)
                return first if first < ours and inside == 0 < outside else math.nan

            # The page looks no farther than 2, and where it says 0 this is at most 1e-12.
            ours = math.inf if ours > 2.0 else 0.0 if hers == "0" and ours <= 1e-12 else ours
            self.number(f"break {direction}", case, hers, ours, lost_earlier)
        ours = self.package("margins", margins, loop, *point)
        hers = page["margins"]
        if self.one_has_none("margins", case, hers, ours):
            return
        most = float(hers["most"])

        def told(name, key, value, *, clip=lambda value: value):
            def verdict():
                return clip(getattr(judge.margins(sketch, *point, stable=True), key))

            self.number(name, case, hers[name], clip(value), verdict)

        told(
            "upper",
            "gain_upper",
            ours.gain_upper,
            clip=lambda value: value if value <= most else math.inf,
        )
        told(
            "lower",
            "gain_lower",
            ours.gain_lower,
            clip=lambda value: value if value >= 1.0 / most else 0.0,
        )
        told("delay", "delay", ours.delay)
        told("phase", "phase", ours.phase)
        told("modulus", "modulus", ours.modulus)


def compare(page, cases):
    """Compare loops at their points, a few at a time."""
    found = Comparison()
    while drawn := list(itertools.islice(cases, 20)):
        said = page.evaluate(ASK, [[described(s), *map(float, p)] for s, p in drawn])
        for (sketch, point), one in zip(drawn, said, strict=True):
            found.compare(sketch, point, one)
    return found


def main():
    """Compare as many loops as the command line asks for."""
    from tools import check_browser

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--loops", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=secrets.randbits(32))
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    rng = np.random.default_rng(given.seed)
    with check_browser.browser() as chromium:
        found = compare(open_engine(chromium), (draw(rng) for _ in range(given.loops)))
    for name, case, hers, ours in found.wrong:
        print(f"WRONG {name}: page {hers}, package {ours}\n   {case}")
    for name, case, hers, ours in found.judged:
        print(f"THE PACKAGE IS WRONG {name}: {ours}, but the page is right: {hers}\n   {case}")
    for name, asked in found.asked.items():
        print(
            f"{name}: {asked} numbers, {found.unsure[name] / asked:.2%} undecided, worst "
            f"{found.worst[name]:.1e}"
        )
    print(f"{len(found.wrong)} differ; the package refused {dict(found.refused)}")
    return 1 if found.wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
