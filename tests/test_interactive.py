import base64
import json
import re

import numpy as np
import pytest

from armlock import CommonArm, rightmost_root, stability_chart
from armlock.interactive import RootGrid, chart_explorer


@pytest.fixture
def chart():
    return stability_chart(CommonArm(), np.linspace(-6, 6, 61), np.linspace(-5, 5, 41))


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_counts_survive_the_packing(chart):
    runs = numbers(chart_explorer(chart).data()["counts"], "<u2").reshape(-1, 2)
    unpacked = np.repeat(runs[:, 1], runs[:, 0]).reshape(chart.counts.shape)
    np.testing.assert_array_equal(unpacked, np.where(chart.counts < 0, 255, chart.counts))


def test_long_runs_are_split():
    axis = np.linspace(0.0, 0.1, 300)
    chart = stability_chart(CommonArm(), axis, axis)
    runs = numbers(chart_explorer(chart).data()["counts"], "<u2").reshape(-1, 2)
    assert runs[:, 0].astype(int).sum() == 90_000
    assert (runs[:, 1] == 0).all()


def test_roots_are_those_of_the_loop(chart):
    grid = RootGrid(CommonArm(), np.linspace(-1, 1, 3), np.linspace(-1, 2, 2))
    data = chart_explorer(chart, grid).data()["root"]
    found = numbers(data["re"], "<f4").reshape(2, 3)
    assert found[1, 2] == pytest.approx(rightmost_root(CommonArm(), 1.0, 2.0).real, rel=1e-6)


def test_the_page_is_complete_small_and_speaks(chart):
    text = chart_explorer(chart, name="A <chart>")._repr_html_()
    assert "http" not in text
    assert 'aria-live="polite"' in text
    assert "A &lt;chart&gt;" in text
    assert len(text) < 100_000
    data = re.search(r"\),(\{.*\})\);</script>", text, re.S)
    assert data
    assert json.loads(data[1])["x"] == [-6.0, 6.0, 61]


def test_two_charts_on_a_page_have_their_own_names(chart):
    first, second = (chart_explorer(chart)._repr_html_() for _ in range(2))
    names = [re.findall(r'id="([^"]+)"', text) for text in (first, second)]
    assert not set(names[0]) & set(names[1])
