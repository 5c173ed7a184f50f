"""The benchmarks run, on sizes so small that their times mean nothing."""

import pytest

from benchmarks import calls, charts, report
from benchmarks.__main__ import main


def test_a_quick_run_prints_each_topic_and_compares_results(capsys, monkeypatch):
    # A process of its own takes seconds to start.
    monkeypatch.setattr(charts, "alone", lambda function, *arguments: function(*arguments))
    assert main(["--quick", "--only", "charts", "--only", "simulation"]) == 0
    printed = capsys.readouterr().out
    compared = ("none may", "bit by bit", "at most 1e-10")
    assert sum(printed.count(word) for word in compared) == 4 + 1 + 1 + 1
    last = printed.splitlines()[-1]
    assert "All results agree" in last or "requirements met" in last


@pytest.mark.parametrize(
    ("differ", "code", "last"),
    [
        (1, 1, "WRONG RESULTS in 1 comparison(s): counts."),
        # A time that is missed does not fail the run.
        (0, 0, "1 of 2 requirements NOT met: chart."),
    ],
)
def test_wrong_results_fail_the_run(monkeypatch, capsys, differ, code, last):
    def run(*, quick):
        slow = report.at_least("chart", 2.0, 0.5, 1.0)
        return report.Topic("Made up", [slow, report.comparison("counts", differ, 10)])

    monkeypatch.setattr(charts, "run", run)
    assert main(["--quick", "--only", "charts"]) == code
    assert last in capsys.readouterr().out


def test_a_topic_that_fails_costs_no_other(monkeypatch, capsys):
    def run(*, quick):
        raise MemoryError

    monkeypatch.setattr(charts, "run", run)
    monkeypatch.setattr(
        calls, "run", lambda **_: report.Topic("Made up", [report.Row("x", 1.0)])
    )
    assert main(["--only", "charts", "--only", "calls"]) == 1
    printed = capsys.readouterr().out
    assert "Made up" in printed
    assert "WRONG RESULTS in 1 comparison(s): charts ended in an error." in printed
