import base64
import json
import re

import numpy as np
import pytest

from armlock import CommonArm, RootError, rightmost_root, stability_chart
from book.companion import explorers
from book.companion.explorers import ChartExplorer


@pytest.fixture(scope="module")
def chart():
    return stability_chart(CommonArm(), np.linspace(-6, 6, 61), np.linspace(-5, 5, 41))


@pytest.fixture(scope="module")
def explorer(chart):
    return ChartExplorer(chart, every=30, name="A <chart>")


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_counts_survive_the_packing(chart, explorer):
    runs = numbers(explorer.data()["counts"], "<u2").reshape(-1, 2)
    unpacked = np.repeat(runs[:, 1], runs[:, 0]).reshape(chart.counts.shape)
    np.testing.assert_array_equal(unpacked, np.where(chart.counts < 0, 255, chart.counts))


def test_roots_are_those_of_the_loop_at_every_so_many_points(explorer):
    data = explorer.data()
    found = numbers(data["re"], "<f4").reshape(2, 3)
    for (row, column), point in {(0, 1): (0.0, -5.0), (1, 2): (6.0, 2.5)}.items():
        root = rightmost_root(CommonArm(), *point)
        assert found[row, column] == pytest.approx(root.real, rel=1e-6)


def test_a_root_that_is_not_certified_is_not_shown(chart, monkeypatch):
    def refuse(*point):
        raise RootError("no", 0j)

    monkeypatch.setattr(explorers, "rightmost_root", refuse)
    assert np.isnan(ChartExplorer(chart, every=60, name="A").roots).all()


def test_the_page_is_complete_small_and_speaks(explorer):
    text = explorer._repr_html_()
    assert "http" not in text
    assert 'aria-live="polite"' in text
    assert "A &lt;chart&gt;" in text
    assert len(text) < 100_000
    data = re.search(r"\),(\{.*\})\);</script>", text, re.S)
    assert data
    assert json.loads(data[1])["x"] == [-6.0, 6.0, 61]


def test_two_charts_on_a_page_have_their_own_names(explorer):
    names = [re.findall(r'id="([^"]+)"', explorer._repr_html_()) for _ in range(2)]
    assert not set(names[0]) & set(names[1])


def test_a_chart_with_uneven_axes_is_refused():
    """The script would find another point than the one that is shown."""
    even = np.linspace(-1, 1, 5)
    for bad in (np.geomspace(0.1, 1.0, 5), even[::-1], [0.5]):
        with pytest.raises(ValueError, match=r"^chart\.x must "):
            ChartExplorer(stability_chart(CommonArm(), bad, even), every=2, name="A")
        with pytest.raises(ValueError, match=r"^chart\.y must "):
            ChartExplorer(stability_chart(CommonArm(), even, bad), every=2, name="A")
