import base64
import json
import re

import numpy as np
import pytest

from armlock import CommonArm, rightmost_root, stability_chart
from book.companion.explorers import RootGrid, chart_explorer


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


def test_a_chart_with_uneven_axes_is_refused():
    """The script would find another point than the one that is shown."""
    even = np.linspace(-1, 1, 5)
    for bad in (np.geomspace(0.1, 1.0, 5), even[::-1], [0.5]):
        with pytest.raises(ValueError, match=r"^chart\.x must "):
            chart_explorer(stability_chart(CommonArm(), bad, even))
        with pytest.raises(ValueError, match=r"^chart\.y must "):
            chart_explorer(stability_chart(CommonArm(), even, bad))
    with pytest.raises(ValueError, match=r"^c1 must ascend in equal steps"):
        RootGrid(CommonArm(), [0.0, 1.0, 3.0], [1.0])
    with pytest.raises(ValueError, match=r"^c2 must be finite, got nan"):
        RootGrid(CommonArm(), [1.0], [np.nan])


def test_what_is_no_chart_is_refused(chart):
    with pytest.raises(TypeError, match=r"^chart must be a StabilityChart, got 3"):
        chart_explorer(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^rightmost must be a RootGrid, got array"):
        chart_explorer(chart, np.ones(3))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^rightmost\.y must hold at least 2 values, got 1"):
        chart_explorer(chart, RootGrid(CommonArm(), [0.9, 1.0], [1.0]))
    with pytest.raises(ValueError, match=r"^units must be two texts, got 'rad'"):
        chart_explorer(chart, units="rad")
    with pytest.raises(ValueError, match=r"^units must be two texts, got \('1',\)"):
        chart_explorer(chart, units=("1",))


def test_a_grid_says_how_many_roots_it_has():
    grid = RootGrid(CommonArm(), [0.9, 1.1], [1.0])
    assert repr(grid) == "RootGrid(2 by 1 points, 2 roots certified)"
