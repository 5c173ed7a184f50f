"""The benchmarks run, on sizes so small that their times mean nothing."""

import json

import nbformat
import pytest

from benchmarks import charts, child, notebooks, report
from benchmarks.__main__ import main, topic_names


def test_all_topics_are_found():
    assert {"charts", "notebooks"} <= set(topic_names())


def test_quick_run_writes_the_report(tmp_path, capsys):
    assert main(["--quick", "--only", "charts", "--output", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    written = json.loads((tmp_path / "report.json").read_text())
    rows = written["topics"]["charts"]["rows"]
    compared = [row for row in rows if row["correctness"]]
    assert len(compared) == 3 * len(charts.QUICK.gains)
    assert all(row["met"] for row in compared)
    assert all(row["what"] in printed for row in rows)
    assert written["closing"] in printed
    assert (tmp_path / "chart_growth.png").stat().st_size > 0
    assert "chart_growth.png" in (tmp_path / "report.md").read_text()


def test_wrong_results_fail_the_run(tmp_path, monkeypatch, capsys):
    def run(*, quick, folder):
        return report.Topic("Made up", [charts.comparison("counts", 1, 10)])

    monkeypatch.setattr(charts, "run", run)
    assert main(["--quick", "--only", "charts", "--output", str(tmp_path)]) == 1
    assert "WRONG RESULTS in 1 comparison(s): counts." in capsys.readouterr().out


def test_missed_times_do_not_fail_the_run(tmp_path, monkeypatch, capsys):
    def run(*, quick, folder):
        slow = report.Row("chart", 2.0, 0.5, "at least 1", met=False)
        return report.Topic("Made up", [slow, charts.comparison("counts", 0, 10)])

    monkeypatch.setattr(charts, "run", run)
    assert main(["--quick", "--only", "charts", "--output", str(tmp_path)]) == 0
    assert "1 of 2 requirements NOT met: chart." in capsys.readouterr().out


@pytest.mark.parametrize(("source", "met"), [("1 + 1", True), ("1 / 0", False)])
def test_notebooks_are_timed(tmp_path, source, met):
    cell = nbformat.v4.new_code_cell(source)
    nbformat.write(nbformat.v4.new_notebook(cells=[cell]), tmp_path / "some.ipynb")
    topic = notebooks.run(quick=True, folder=tmp_path, notebooks=tmp_path)
    assert [row.met for row in topic.rows] == [met]
    assert any("ZeroDivisionError" in note for note in topic.notes) is not met


def test_memory_of_a_notebook_is_that_of_its_kernel(tmp_path):
    source = "import numpy as np; a = np.ones(50_000_000)"
    cell = nbformat.v4.new_code_cell(source)
    nbformat.write(nbformat.v4.new_notebook(cells=[cell]), tmp_path / "some.ipynb")
    found = child.call("benchmarks.notebooks", "execute", {}, path=str(tmp_path / "some.ipynb"))
    assert 400e6 < found["memory"] < 700e6


def test_exponents_are_fitted():
    series = report.fit_series("x", "side", [1, 2, 4, 8], [1.0, 1.0, 4.0, 16.0])
    assert series.exponent_end == pytest.approx(2.0)
    assert series.exponent == pytest.approx(1.4)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(2e-6, "2 us"), (0.0123, "12.3 ms"), (59.5, "59.5 s"), (1e3, "1000 s"), (1e5, "1.00e5 s")],
)
def test_durations_are_readable(seconds, text):
    assert report.duration(seconds) == text
