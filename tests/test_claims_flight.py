"""What chapter 10 computes the white paper's claims from, by other ways to the same numbers."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.constants import speed_of_light

from armlock import LaserNoise, flight_loop
from armlock.orbits import SPEED_OF_LIGHT, kepler
from armlock.performance import budget
from book.companion.ledger import Ledger

CHAPTER = Path(__file__).parents[1] / "notebooks" / "10_flight.ipynb"
MEAN_DELAY = 2.0 * 5e9 / speed_of_light
F = np.concatenate((np.geomspace(1e-6, 1e-4, 2000), np.arange(1e-4, 3, 5e-6)))
YEARLY = 2.0 * np.pi / (365.25 * 86400.0)


@pytest.fixture(scope="module")
def chapter():
    """Return the functions that the chapter defines, without its runs."""
    given = {"np": np, "flight_loop": flight_loop, "mean_delay": MEAN_DELAY, "f": F}
    given |= {"tdi_capability": budget.tdi_capability, "free_running": budget.free_running}
    given["yearly"] = YEARLY
    for cell in json.loads(CHAPTER.read_text("utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            tree = ast.parse("".join(cell["source"]))
            tree.body = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
            exec(compile(tree, "chapter", "exec"), given)
    return given


def test_no_mean_length_of_the_arms_leaves_more_of_the_laser(chapter):
    frequency = np.array([0.05, 0.3, 0.9, 1.9, 1.95])
    least = chapter["spare"](0.255)(frequency)
    s = 2j * np.pi * frequency
    mean = MEAN_DELAY + np.linspace(0.0, 20.0, 2_001)[:, None]
    first, second = flight_loop(MEAN_DELAY, delay=0.0).arm_responses(s)
    back1, back2 = (np.exp(-s * (mean + half)) for half in (0.255, -0.255))
    left = 1.0 / np.abs(1.0 + first * (1.0 - back1) + second * (1.0 - back2))
    noise = left * budget.free_running(frequency)
    found = (budget.tdi_capability(frequency) / noise).min(axis=0)
    assert (found >= least * (1.0 - 1e-9)).all()
    assert (found < least / 0.9).all()


def test_errors_of_doppler_estimates_are_those_of_a_fitted_line(chapter):
    level = float(budget.free_running(np.array(1.0)))
    noise = LaserNoise(seed=1, sample_rate=1.0, level=level).draw(2_000_000)
    measured = 2.0 * (noise[34:] - noise[:-34])
    parts = measured[: measured.size // 200 * 200].reshape(-1, 200).T
    slope, start = np.polyfit(np.arange(200.0), parts, 1)
    found = np.std(start + 99.5 * slope), np.std(slope)
    chapter["yearly"] = 1.0  # the orbit limits nothing
    shift, rate, _ = chapter["doppler_errors"](budget.free_running)
    np.testing.assert_allclose(found, (shift, rate), rtol=0.05)


def test_arms_of_keplerian_orbits_swing_once_and_thrice_a_year():
    number = 360
    t = 365.25 * 86400.0 * np.arange(number) / number
    arms = 0.5 * SPEED_OF_LIGHT * np.sum(kepler(5e9).round_trips(t), axis=0)
    once, _, thrice = 2.0 * np.abs(np.fft.rfft(arms))[1:4] / number
    shifts = 2.0 * YEARLY * np.array([once, 3.0 * thrice]) / 1064e-9
    given = Ledger()["W8"].numbers
    np.testing.assert_allclose(shifts, (1e6 * given["once"], 1e6 * given["thrice"]), rtol=0.01)
