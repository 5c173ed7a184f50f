"""What results show, as text and in a notebook."""

import pickle
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

from armlock import (
    CommonArm,
    DualArm,
    LaserNoise,
    Simulation,
    amplitude_spectrum,
    axis_crossings,
    characteristic_roots,
    d_curve_branches,
    delay,
    first_crossing,
    flight_loop,
    margins,
    noise_budget,
    nyquist,
    paper_loop,
    peak_gain,
    s,
    stability_chart,
    varying_radius,
)
from armlock.orbits import kepler

LOOP = 2 * (12 * s + 1) / (12 * s) / (10 * s + 1) * delay(4.0)
AXIS = np.linspace(-3.0, 3.0, 31)
SHOWN: dict[str, tuple[Callable[[], Any], list[str]]] = {
    "margins": (lambda: margins(LOOP), ["dB", "degrees", "rad/s", "delay"]),
    "bound": (lambda: margins(DualArm()), ["at least 1e+06"]),
    "chart": (lambda: stability_chart(CommonArm(), AXIS, AXIS), ["31 from -3 to 3", "stable"]),
    "nyquist": (lambda: nyquist(LOOP, omega_max=2.0), ["turns around -1", "rad/s"]),
    "crossings": (lambda: axis_crossings(paper_loop(), omega_max=1.0), ["3 crossings"]),
    "budget": (lambda: noise_budget(flight_loop(), [1e-3, 1.0]), ["free laser", "3e+04"]),
    "spectrum": (lambda: amplitude_spectrum(np.ones(4096) * AXIS[0], 1.0), ["bands"]),
    "peak": (lambda: peak_gain(LOOP.feedback()), ["dB", "rad/s"]),
    "radius": (lambda: varying_radius(paper_loop()), ["1.32136e-06", "rad/s"]),
    "crossing": (lambda: first_crossing(DualArm(), (1, 1), (1, 1), 3.0), ["t = 0.254"]),
    "branch": (lambda: d_curve_branches(CommonArm(), 1.0)[0], ["omega", "rad/s"]),
    "roots": (
        lambda: characteristic_roots(LOOP, right_of=-0.8),
        ["7 roots", "0.308825 rad/s", "damping", "13.025 s"],
    ),
    "many": (lambda: margins([LOOP, 3 * LOOP]), ["1 of 2", "loop must be stable"]),
    "orbits": (kepler, ["from day"]),
    "noise": (lambda: LaserNoise(1, 10.0), ["10 Hz", "30 per sqrt(Hz)"]),
    "simulation": (lambda: Simulation(CommonArm(), 10.0), ["0 samples"]),
}


class Cells(HTMLParser):
    """The text of a page, whose elements all end."""

    def __init__(self, page):
        super().__init__()
        self.open, self.text = [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.mark.parametrize("name", SHOWN)
def test_a_result_is_a_short_table(name):
    make, parts = SHOWN[name]
    found = make()
    text, page = repr(found), Cells(found._repr_html_())
    assert not page.open
    assert all(part in text and part in " ".join(page.text) for part in parts)
    assert len(text.splitlines()) <= 12
    assert max(map(len, text.splitlines())) <= 100
    assert "array(" not in text
    assert "object at" not in text


def test_a_loop_shows_its_arguments():
    loop = paper_loop()
    assert "20.1 s" in loop._repr_html_()


def test_units_of_margins():
    found = margins(LOOP)
    assert found.phase_degrees == pytest.approx(np.degrees(found.phase))
    assert 10.0 ** (found.gain_upper_db / 20.0) == pytest.approx(found.gain_upper)
    assert found.gain_lower_db == -np.inf
    assert pickle.loads(pickle.dumps(found)) == found


def test_pictures_name_what_they_show():

    def names(ax):
        return [one.get_text() for one in ax.get_legend().get_texts()]

    chart = stability_chart(CommonArm(), AXIS, AXIS)
    assert names(chart.plot(plt.figure().subplots())) == ["stable", "1", "12 or more"]
    assert chart.plot(plt.figure().subplots(), labels=True).get_legend() is None
    budget = noise_budget(flight_loop(), [1e-3, 1e-2])
    shown = names(budget.plot(plt.figure().subplots()))
    assert set(shown) == {*budget.sources, "total", "required"}
    series = np.random.default_rng(1).normal(size=4096)
    spectrum = amplitude_spectrum(series, 1.0)
    line = spectrum.plot(plt.figure().subplots(), label="white").lines[0]
    assert np.array_equal(line.get_ydata(), spectrum.asd)
    # An integrator leaves for infinity, and the picture shows the neighbourhood of -1.
    found, axes = margins(LOOP), plt.figure().subplots()
    nyquist(LOOP, omega_max=2.0).plot(axes, margins=found)
    assert axes.get_ylim() == (-3.0, 3.0)
    labels = names(axes)
    assert f"phase {found.phase_degrees:.3g}°" in labels
    marked = next(one for one in axes.lines if one.get_label() == labels[-1])
    there = complex(*np.asarray(marked.get_data(), float).ravel())
    assert abs(1.0 + there) == pytest.approx(found.modulus, rel=1e-3)
    plt.close("all")
