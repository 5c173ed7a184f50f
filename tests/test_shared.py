"""What one process of a build computes, the others read."""

from __future__ import annotations

import numpy as np

from book.companion.shared import shared


def counted(calls):
    def squares(*numbers, power=2):
        calls.append((numbers, power))
        return np.array(numbers) ** power

    return squares


def test_a_second_process_reads_what_the_first_has_found(monkeypatch, tmp_path):
    monkeypatch.setenv("ARMLOCK_SHARED", str(tmp_path / "shared"))
    calls: list[object] = []
    # Decorated twice: each has a memory of its own, as two processes have.
    first, second = shared(counted(calls)), shared(counted(calls))
    assert not second.is_stored(1.0, 3.0)
    for function in (first, second, first):
        assert function(1.0, 3.0).tolist() == [1.0, 9.0]
        assert function(1.0, 3.0, power=3).tolist() == [1.0, 27.0]
    assert calls == [((1.0, 3.0), 2), ((1.0, 3.0), 3)]
    assert second.is_stored(1.0, 3.0)


def test_without_a_build_each_process_computes(monkeypatch):
    monkeypatch.delenv("ARMLOCK_SHARED", raising=False)
    calls: list[object] = []
    first, second = shared(counted(calls)), shared(counted(calls))
    assert first(2.0) is first(2.0)
    assert second(2.0) == first(2.0)
    assert len(calls) == 2
