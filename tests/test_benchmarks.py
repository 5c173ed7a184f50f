"""The benchmarks run, on sizes so small that their times mean nothing."""

import json
import re

import nbformat
import pytest

from benchmarks import charts, notebooks, report
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


def test_notebooks_are_timed_and_their_memory_is_that_of_the_kernel(tmp_path):
    for name, source in (("fails", "1 / 0"), ("large", "a = 400_000_000 * b'x'")):
        cell = nbformat.v4.new_code_cell(source)
        nbformat.write(nbformat.v4.new_notebook(cells=[cell]), tmp_path / f"{name}.ipynb")
    topic = notebooks.run(quick=False, folder=tmp_path, notebooks=tmp_path)
    assert [row.met for row in topic.rows] == [False, True]
    assert any("ZeroDivisionError" in note for note in topic.notes)
    sizes = [float(re.findall(r"(\d+) MiB <", row.requirement)[0]) for row in topic.rows]
    assert sizes[0] < 380.0 < sizes[1] < 700.0


def test_exponents_are_fitted():
    series = report.fit_series("x", "side", [1, 2, 4, 8], [1.0, 1.0, 4.0, 16.0])
    assert series.exponent_end == pytest.approx(2.0)
    assert series.exponent == pytest.approx(1.4)
