"""The benchmarks run, on sizes so small that their times mean nothing."""

import importlib
import json
import re

import nbformat
import pytest

from benchmarks import charts, child, loops, notebooks, report
from benchmarks.__main__ import main


def call_here(module, function, environment, **arguments):
    """What `child.call` does, without the seconds that a process takes to start."""
    return getattr(importlib.import_module(module), function)(**arguments)


def test_quick_run_writes_the_report(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(child, "call", call_here)
    topics = ["charts", "loops", "simulation"]
    only = [word for name in topics for word in ("--only", name)]
    assert main(["--quick", *only, "--output", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    written = json.loads((tmp_path / "report.json").read_text())
    rows = [row for name in topics for row in written["topics"][name]["rows"]]
    compared = [row for row in rows if row["correctness"]]
    assert len(compared) == 3 * len(charts.QUICK.gains) + 2 + 2
    assert all(row["met"] for row in compared)
    assert all(row["what"] in printed for row in rows)
    assert written["closing"] in printed
    assert (tmp_path / "chart_growth.png").stat().st_size > 0
    assert "chart_growth.png" in (tmp_path / "report.md").read_text()


@pytest.mark.parametrize(
    ("differ", "code", "last"),
    [
        (1, 1, "WRONG RESULTS in 1 comparison(s): counts."),
        # A time that is missed does not fail the run.
        (0, 0, "1 of 2 requirements NOT met: chart."),
    ],
)
def test_wrong_results_fail_the_run(tmp_path, monkeypatch, capsys, differ, code, last):
    def run(*, quick, folder):
        slow = report.Row("chart", 2.0, 0.5, "at least 1", met=False)
        return report.Topic("Made up", [slow, report.comparison("counts", differ, 10)])

    monkeypatch.setattr(charts, "run", run)
    assert main(["--quick", "--only", "charts", "--output", str(tmp_path)]) == code
    assert last in capsys.readouterr().out


def test_a_topic_that_fails_costs_no_other(tmp_path, monkeypatch, capsys):
    def run(*, quick, folder):
        raise MemoryError

    monkeypatch.setattr(charts, "run", run)
    monkeypatch.setattr(
        loops, "run", lambda **_: report.Topic("Made up", [report.Row("x", 1.0)])
    )
    only = ["--only", "charts", "--only", "loops", "--output", str(tmp_path)]
    assert main(only) == 1
    assert "Made up" in capsys.readouterr().out
    assert {"charts", "loops"} == json.loads((tmp_path / "report.json").read_text())[
        "topics"
    ].keys()


def test_a_failing_notebook_is_named_and_the_memory_is_that_of_its_kernel(tmp_path):
    cell = nbformat.v4.new_code_cell("a = 400_000_000 * b'x'\n1 / 0")
    nbformat.write(nbformat.v4.new_notebook(cells=[cell]), tmp_path / "fails.ipynb")
    topic = notebooks.run(quick=False, folder=tmp_path, notebooks=tmp_path)
    assert [row.met for row in topic.rows] == [False]
    assert any("ZeroDivisionError" in note for note in topic.notes)
    (size,) = re.findall(r"(\d+) MiB <", topic.rows[0].requirement)
    assert 380 < int(size) < 700


def test_exponents_are_fitted():
    series = report.fit_series("x", "side", [1, 2, 4, 8], [1.0, 1.0, 4.0, 16.0])
    assert series.exponent_end == pytest.approx(2.0)
    assert series.exponent == pytest.approx(1.4)
