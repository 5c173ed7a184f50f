"""What one process of a build computes, the others read."""

from __future__ import annotations

from pathlib import Path

from book.companion.shared import shared


def squares(log, *numbers, power=2):
    with Path(log).open("a") as stream:
        stream.write(".")
    return [number**power for number in numbers]


def test_a_second_process_reads_what_the_first_has_found(monkeypatch, tmp_path):
    monkeypatch.setenv("ARMLOCK_SHARED", str(tmp_path / "shared"))
    log = tmp_path / "log"
    # Decorated twice: each has a memory of its own, as two processes have.
    first, second = shared(squares), shared(squares)
    assert not second.is_stored(log, 1.0, 3.0)
    for function in (first, second, first):
        assert function(log, 1.0, 3.0) == [1.0, 9.0]
        assert function(log, 1.0, 3.0, power=3) == [1.0, 27.0]
    assert log.read_text() == ".."
    assert second.is_stored(log, 1.0, 3.0)


def test_without_a_build_each_process_computes(monkeypatch, tmp_path):
    monkeypatch.delenv("ARMLOCK_SHARED", raising=False)
    log = tmp_path / "log"
    first, second = shared(squares), shared(squares)
    assert first(log, 2.0) is first(log, 2.0)
    assert second(log, 2.0) == first(log, 2.0)
    assert log.read_text() == ".."
    assert not second.is_stored(log, 2.0)
