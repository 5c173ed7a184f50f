"""The code of chapters 13 and 14 and of the page on orbits, against other ways to results."""

from __future__ import annotations

import contextlib
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from armlock import (
    Controller,
    DivergenceError,
    Loop,
    rightmost_root,
    simulate,
    stable_half_differences,
    unstable_roots,
)
from armlock.orbits import SPEED_OF_LIGHT, Constellation, from_table, kepler
from armlock.sensors import dual
from tests import draws

ROOT = Path(__file__).parents[1]
DAY = 86400.0
RULES = (None, 0.0, 0.5)


@pytest.fixture(scope="module")
def chapter():
    """Return the names that cells of both chapters define."""
    source: dict[str, str] = {}
    for notebook in ("13_orbits", "14_tdi"):
        cells = json.loads((ROOT / "notebooks" / f"{notebook}.ipynb").read_text("utf-8"))
        source |= {cell["id"]: "".join(cell["source"]) for cell in cells["cells"]}
    names: dict[str, Any] = {}
    parts = ("read", "curves", "largest", "table", "loops", "range", "days", "unstable-times")
    for part in parts:
        exec(source[f"orbits-{part}"], names)
    for part in ("imports", "formulas"):
        exec(source[f"tdi-{part}"], names)
    return names


@pytest.fixture(scope="module")
def weak(chapter):
    """A loop of small gain, and its range: it is stable for some ratios of the wrong sign."""
    mean, h = chapter["mean"], chapter["h"]
    loop = Loop(Controller([], [-0.1], 1.0), dual(2.5, 2 * h), mean + h, mean - h)
    return loop, [edge / h for edge in stable_half_differences(loop)]


def at_ratio(chapter, loop, ratio):
    mean, h = chapter["mean"], chapter["h"]
    return loop.replace(tau1=mean + ratio * h, tau2=mean - ratio * h)


def round_trips(chapter, case, days):
    name, master = case
    return chapter["orbits"][name].round_trips(days * DAY, master)


def test_a_range_reaches_ratios_of_the_wrong_sign(chapter, weak):
    loop, (low, high) = weak
    # At s = 0 the sensor's response is x/h, the controller's 10: 1 + L = 0 at -0.1.
    assert abs(low + 0.1) < 1e-5
    for ratio in np.random.default_rng(4).uniform(low, high, draws(6, 20)):
        assert unstable_roots(at_ratio(chapter, loop, ratio), 1.0, 1.0) == 0
    for ratio in (low - 1e-4, high + 1e-4):
        assert unstable_roots(at_ratio(chapter, loop, ratio), 1.0, 1.0) != 0


def test_a_range_ends_at_the_first_unstable_window(chapter):
    """With 0.15 s assumed the paper's loop has windows, with stable ratios behind them."""
    mean, h = chapter["mean"], 0.15
    loop = chapter["frozen"]("paper", mean + h, mean - h, h)
    high = stable_half_differences(loop)[1] / h
    assert 1.85 < high < 1.95
    for ratio, stable in ((2.0889, False), (2.4, True)):
        there = loop.replace(tau1=mean + ratio * h, tau2=mean - ratio * h)
        assert (unstable_roots(there, 1.0, 1.0) == 0) == stable


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("name", ["paper", "weak"])
def test_stable_times_agree_with_counts_at_random_times(chapter, weak, name, rule):
    """The edges are those at one assumed value: they must do at every other that occurs."""
    case = "trailing", 2
    x, edges = chapter["half"][case], weak[1] if name == "weak" else chapter["ranges"][name]
    r = chapter["ratio"](x, rule)
    start, stop = chapter["unstable_times"](r, *edges)
    for t in np.random.default_rng(8).uniform(x.x[0], x.x[-1], draws(25, 200)):
        tau1, tau2 = map(float, round_trips(chapter, case, t))
        h = float(x(t) / r(t))
        if min(abs(float(r(t)) / edge - 1.0) for edge in edges) < 1e-3:
            continue
        if name == "weak":
            loop = Loop(weak[0].controller, dual(2.5, 2 * h), tau1, tau2)
        else:
            loop = chapter["frozen"](name, tau1, tau2, h)
        unstable = bool(((start <= t) & (t <= stop)).any())
        assert (unstable_roots(loop, 1.0, 1.0) != 0) == unstable


def test_days_of_the_wrong_sign_count_where_the_loop_is_stable(chapter, weak):
    x = chapter["half"]["Kepler", 1]
    found = chapter["stable_days"](chapter["ratio"](x), *weak[1])
    t = np.linspace(x.x[0], x.x[-1], 200_001)
    share = np.mean(chapter["ratio"](x)(t) > -0.1)
    assert abs(found - 365.25 * share) < 0.01
    # They would be 182.6 from a ratio of 0 on.
    assert found > 190


def nested(orbits, t, beams):
    lengths = []
    for beam in beams:
        length = 0.0
        for arm in beam:
            length += float(orbits.round_trips(t - length)[arm - 1])
        lengths.append(length)
    return lengths[0] - lengths[1]


def test_moving_arms_make_the_beams_differ_as_the_formula_says(chapter):
    # Near t = 0, where times are exact enough, and on long arms, which move more.
    for orbit in (chapter["orbits"]["Kepler"], kepler(1.2e10)):
        for t in (1e5, 1.1e6, 3e6):
            found = chapter["moving"](orbit, t)
            beams = nested(orbit, t, ((1, 2), (2, 1)))
            assert abs(found - beams) < 2e-3 * abs(beams) + 1e-12


def test_a_metre_leaves_what_is_known(chapter):
    found = chapter["ranging"](2 * np.pi * 3e-3, 16.6794, 16.6146, 1.0 / SPEED_OF_LIGHT)
    assert np.allclose(found, (1.96108e-11, 1.21063e-11), rtol=1e-5)


def drawn(chapter, count):
    """Yield stretches on which the frozen rate times the duration exceeds five.

    Case, time, loop and ratio are drawn at random. A stretch lasts eight e-folds of the frozen
    root at its start, at most two days. It is taken if the frozen rates at start, middle and
    end have one sign and differ by less than a factor of two. Every sixth one is stable, and
    may last twenty days.
    """
    rng, found = np.random.default_rng(29), 0
    while found < count:
        case = chapter["cases"][rng.integers(9)]
        name = ("flight", "paper", "robust")[rng.integers(3)]
        x = chapter["half"][case]
        start = float(rng.uniform(x.x[0], x.x[-1] - 21))
        stable = found % 6 == 5
        ratio = float(rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-1.5, 0.5))
        h = float(x(start)) / (float(rng.uniform(0.4, 1.6)) if stable else ratio)

        def loop(seconds, case=case, name=name, start=start, h=h):
            trips = map(float, round_trips(chapter, case, start + seconds / DAY))
            return chapter["frozen"](name, *trips, h)

        first = rightmost_root(loop(0.0)).real
        duration = min(8.0 / abs(first), (20 if stable else 2) * DAY)
        rates = np.array([rightmost_root(loop(s * duration)).real for s in (0.0, 0.5, 1.0)])
        mean = float(rates @ [1.0, 4.0, 1.0]) / 6.0
        sizes = np.abs(rates)
        alike = np.ptp(np.sign(rates)) == 0.0 and sizes.max() < 2.0 * sizes.min()
        if alike and abs(mean) * duration > 5.0:
            found += 1
            yield case, loop(0.0), start, duration, mean


def simulated_rate(chapter, case, loop, start, duration):
    """Return the rate of growth in 1/s between the middle third and the last one."""
    rate = 10.0 if duration < 2e5 else 1.0
    t = np.linspace(0.0, duration, 100)
    one, two = (CubicSpline(t, arm) for arm in round_trips(chapter, case, start + t / DAY))
    noise = np.zeros(int(duration * rate))
    noise[: noise.size // 20] = np.random.default_rng(1).standard_normal(noise.size // 20)
    try:
        out = simulate(loop, noise, sample_rate=rate, tau1=one, tau2=two)
    except DivergenceError as error:
        out = error.output
        duration = out.size / rate
    third = out.size // 3
    late, middle = (np.linalg.norm(part) for part in (out[-third:], out[third : 2 * third]))
    return float(np.log(late / middle) / (duration / 3.0))


def test_frozen_rates_are_those_of_simulations_with_moving_delays(chapter):
    rates = []
    for case, loop, start, duration, rate in drawn(chapter, draws(6, 36)):
        grown = simulated_rate(chapter, case, loop, start, duration)
        assert 0.5 < grown / rate < 2.0
        rates.append(rate)
    assert min(rates) < 0.0 < max(rates)


PAGE = (ROOT / "book" / "in_orbit.md").read_text("utf-8")
*BLOCKS, LISAORBITS, OEM = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def page(**changes):
    """Run the code of the page, with other text for some of it; return names and output."""
    code = "\n".join(BLOCKS)
    for old, new in changes.items():
        assert code.count(f"\n{old} = ") == 1
        code = re.sub(rf"\n{old} = .*", f"\n{old} = {new}", code)
    names: dict[str, Any] = {"Controller": Controller}
    with contextlib.redirect_stdout(io.StringIO()) as out:
        exec(code, names)
    return names, out.getvalue()


def test_the_page_prints_what_it_shows():
    _, printed = page()
    assert f"```text\n{printed}```" in PAGE


def test_orbits_of_lisaorbits_are_read_as_the_page_shows():
    pytest.importorskip("lisaorbits")
    names: dict[str, Any] = {"np": np}
    exec(LISAORBITS, names)
    t = np.linspace(1e3, 3e7, 50)
    off = np.subtract(names["orbit"].round_trips(t), kepler().round_trips(t))
    assert np.abs(off).max() < 1e-10


OEM_HEADER = """CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2026-01-01T00:00:00
ORIGINATOR = US
META_START
OBJECT_NAME = LISA
OBJECT_ID = 1
CENTER_NAME = SUN
REF_FRAME = EME2000
TIME_SYSTEM = TCB
START_TIME = {}
STOP_TIME = {}
META_STOP
"""


def test_files_of_oem_are_read_as_the_page_shows(tmp_path, monkeypatch):
    """In two segments, with other borders for each of the files."""
    pytest.importorskip("oem")
    monkeypatch.chdir(tmp_path)
    t = np.arange(0.0, 60 * DAY, DAY)
    epochs = np.datetime64("2035-01-01T00:00:29") + (t * 1e9).astype("timedelta64[ns]")
    for k, path in enumerate(kepler()._paths):
        states = np.hstack((path(t, 0), path(t, 1))) / 1e3
        lines = [
            " ".join([str(epoch), *(f"{value:.17g}" for value in state)])
            for epoch, state in zip(epochs, states, strict=True)
        ]
        border = 10 * (k + 1)
        parts = (epochs[: border + 1], lines[: border + 1]), (epochs[border:], lines[border:])
        first, second = (
            "\n".join([OEM_HEADER.format(of[0], of[-1]), *rows, ""]) for of, rows in parts
        )
        whole = first + second[second.index("META_START") :]
        Path(f"lisa{k + 1}.oem").write_text(whole, "utf-8")
    names: dict[str, Any] = {"np": np, "from_table": from_table}
    exec(OEM, names)
    orbit: Constellation = names["orbit"]
    when = np.linspace(*orbit.span, 200)
    off = np.subtract(orbit.round_trips(when, 2), kepler().round_trips(when, 2))
    assert np.abs(off).max() < 5e-11


def test_the_page_gives_the_range_and_the_days_of_the_chapter(chapter, weak):
    names, printed = page(controller="Controller([], [-0.1], 1.0)")
    assert abs(names["low"] - weak[1][0]) < 1e-5
    x = chapter["half"]["Kepler", 1]
    days = chapter["stable_days"](chapter["ratio"](x), *weak[1])
    assert f"constant        {days:7.2f} stable days" in printed
