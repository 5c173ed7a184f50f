"""What TDI leaves, against other ways to it, and the survey of a loop along an orbit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from armlock import Controller, Loop, is_stable
from armlock.orbits import kepler, read_table
from armlock.orbits.__main__ import main
from armlock.orbits.passages import DAY, YEAR, days, lost, policies
from armlock.orbits.survey import outages, survey
from armlock.orbits.tdi import flexing, ranging_residual
from armlock.sensors import dual

KEPLER = kepler()
LIGHT = 299_792_458.0
DATA = Path(__file__).parents[1] / "book" / "data"


def slow(tau1, tau2, held):
    """A loop of two poles, which takes a fraction of the time of the book's."""
    return Loop(Controller([-0.1], [0, 0], 3.0), dual(2.5, 2 * held), tau1, tau2)


def test_a_metre_leaves_what_is_known():
    x1, x2 = ranging_residual(2 * np.pi * 3e-3, 16.6794, 16.6146, 1.0 / LIGHT)
    assert abs(x1 / 1.96108e-11 - 1) < 1e-5
    assert abs(x2 / 1.21063e-11 - 1) < 1e-5
    # The same error in both of two equal arms leaves nothing.
    assert ranging_residual(0.02, 16.0, 16.0, 1e-8, 1e-8)[0] < 1e-24
    with pytest.raises(ValueError, match="must broadcast"):
        ranging_residual([1.0, 2.0], [16.0, 16.1, 16.2], 16.0)


def nested(orbits, t, beams, master):
    lengths = []
    for beam in beams:
        length = 0.0
        for arm in beam:
            length += float(orbits.round_trips(t - length, master)[arm - 1])
        lengths.append(length)
    return lengths[0] - lengths[1]


@pytest.mark.parametrize("master", [1, 2, 3])
def test_flexing_is_the_difference_of_the_beams(master):
    # Near t = 0, where times are exact enough, and on long arms, which flex more.
    long = kepler(1.2e10)
    for t in (1e5, 1.1e6, 3e6):
        first = nested(KEPLER, t, ((1, 2), (2, 1)), master)
        assert abs(flexing(KEPLER, t, 1, master) - first) < 1e-3 * abs(first) + 1e-12
        second = nested(long, t, ((1, 2, 2, 1), (2, 1, 1, 2)), master)
        assert abs(flexing(long, t, 2, master) - second) < 0.02 * abs(second) + 3e-12


def test_flexing_on_keplers_orbits_is_at_most_the_known_one():
    t = np.linspace(0.0, YEAR, 2001)
    sizes = LIGHT * np.abs(flexing(KEPLER, t, 1))
    at = int(np.argmax(sizes))
    top = minimize_scalar(
        lambda x: -LIGHT * abs(float(flexing(KEPLER, x, 1))),
        bounds=(t[max(at - 1, 0)], t[min(at + 1, 2000)]),
        method="bounded",
    )
    assert abs(-top.fun - 65.45) < 0.01
    with pytest.raises(ValueError, match="generation must be 1 or 2, got 3"):
        flexing(KEPLER, 0.0, 3)


def test_a_survey_of_a_year_says_what_is_found_in_it():
    found = survey(slow, KEPLER)
    assert found.years == 1.0
    high = found.edges[1]
    held = 0.25 * found.largest
    for ratio, stable in ((high * (1 - 1e-4), True), (high * (1 + 1e-4), False)):
        off = ratio * held
        assert is_stable(slow(16.65 + off, 16.65 - off, held)) == stable
    for policy, holds in policies(found.half).items():
        assert found.lost[policy] == lost(found.half, holds, found.edges)
    text = str(replace(found, common=found.common._replace(certified=False)))
    kept = 365.25 - days(found.lost["month's middle"])
    assert f"month's middle {kept:19.3f}" in text
    assert f"to {high:.5g} (certified)" in text
    assert "28.005 ms" in text
    assert f"{found.common.time:.4g} s (not certified)" in text
    assert f"{found.differential.time:.4g} s, at 32.55 ms" in text
    # An error of 1 Hz drives the laser until the end, at 1 / (2 half) Hz/s.
    t = np.array([100 * DAY])
    assert abs(found.pulled(t)[0] / (20 * DAY / 2) * found.half(t)[0] - 1) < 0.01
    assert outages(found.lost["month's middle"])[0][0] == 0.0
    assert len(found.plot().axes) == 4


def test_a_survey_refuses_times_and_masters_that_are_none():
    for wrong in ((1e6, 1e6), (0.0, np.nan)):
        with pytest.raises(ValueError, match="stop"):
            survey(slow, KEPLER, *wrong)
    with pytest.raises(ValueError, match="master must be"):
        survey(slow, KEPLER, master=4)


def test_the_verdict_along_esas_orbits_holds_at_random_times():
    """The edges are those at one held value: they must do at every other that occurs."""
    orbits = read_table(DATA / "esa_trailing.csv.gz")
    rng = np.random.default_rng(3)
    start = orbits.span[0] + rng.uniform(0.0, 9.0) * YEAR
    found = survey(slow, orbits, start, start + YEAR, master=2)
    sizes = np.abs(found.half(np.linspace(start, start + YEAR, 2001)))
    assert found.largest == pytest.approx(sizes.max(), rel=1e-4)
    for policy, holds in policies(found.half).items():
        gone = found.lost[policy]
        for t in rng.uniform(start, start + YEAR, 30):
            held = next(held for begin, stop, held in holds if begin <= t <= stop)
            near = min(abs(t - s) for part in gone for s in part[:2])
            if near > 3e3:
                tau1, tau2 = map(float, orbits.round_trips(t, 2))
                stable = is_stable(found.loop(tau1, tau2, held))
                assert stable != any(begin < t < stop for begin, stop, _ in gone)


LOOP = """
from armlock import Controller, Loop
from armlock.sensors import dual

def loop(tau1, tau2, held):
    return Loop(Controller([-0.1], [0, 0], 3.0), dual(2.5, 2 * held), tau1, tau2)
"""


def test_the_command_reads_a_loop_and_an_orbit(tmp_path, capsys):
    mine = tmp_path / "mine.py"
    mine.write_text(LOOP, "utf-8")
    figure = tmp_path / "mine.png"
    arguments = [str(mine), str(DATA / "esa_leading.csv.gz"), "--years", "1", "--start", "700"]
    main([*arguments, "--master", "3", "--plot", str(figure)])
    printed = capsys.readouterr().out
    assert "master 3, 1.00 years" in printed
    assert "month's middle" in printed
    assert figure.stat().st_size > 20_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["flight", "a.oem", "b.oem"], "three OEM files, one a spacecraft; got 2"),
        (["nothing", "kepler"], "LOOP must be a Python file or one of flight, paper"),
        (["flight", "nowhere.csv"], "No such file"),
        (["flight", "kepler", "--years", "-1"], "years must be positive"),
        (["flight", "kepler", "--start", "1e9"], "must ascend within the span"),
    ],
)
def test_the_command_says_what_is_wrong(arguments, message, capsys):
    with pytest.raises(SystemExit):
        main(arguments)
    assert message in capsys.readouterr().err


def test_a_file_must_define_a_loop(tmp_path, capsys):
    mine = tmp_path / "mine.py"
    mine.write_text("loop = 3\n", "utf-8")
    with pytest.raises(SystemExit):
        main([str(mine), "kepler"])
    assert "must define a function loop" in capsys.readouterr().err
    table = tmp_path / "mine.csv"
    table.write_text("# epoch: now\n0,1,2\n", "utf-8")
    with pytest.raises(SystemExit):
        main(["flight", str(table)])
    assert "must say its scale" in capsys.readouterr().err
