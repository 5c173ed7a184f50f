"""A line that says how far something is: on a terminal, in Jupyter, and nowhere else."""

import io
import multiprocessing
import sys
import threading

import pytest

from armlock import progress as module
from armlock.progress import is_watched, progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture(autouse=True)
def no_wait(monkeypatch):
    monkeypatch.setattr(module, "_SHORT", -1.0)
    monkeypatch.setattr(module, "_EVERY", -1.0)


def told(stream, monkeypatch):
    monkeypatch.setattr(sys, "stderr", stream)
    with progress("spectrum", 10) as say:
        for done in (0, 5, 12):
            say(done)
    return stream.getvalue()


def test_a_terminal_sees_a_line_that_is_gone_at_the_end(monkeypatch):
    written = told(Terminal(), monkeypatch)
    *lines, blank, rest = written.split("\r")
    assert lines == ["", "spectrum: 50%, 0 s left", "spectrum: 100%, 0 s left"]
    assert (blank.strip(), rest) == ("", "")
    assert len(blank) >= len(lines[-1])


def test_nobody_else_is_told(monkeypatch):
    assert told(io.StringIO(), monkeypatch) == ""
    monkeypatch.setattr(module, "_SHORT", 5.0)
    assert told(Terminal(), monkeypatch) == ""


def test_a_notebook_is_watched_if_a_server_opened_it(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    monkeypatch.setitem(sys.modules, "ipykernel", sys)
    monkeypatch.delenv("JPY_SESSION_NAME", raising=False)
    assert not is_watched()
    monkeypatch.setenv("JPY_SESSION_NAME", "09_simulation.ipynb")
    assert is_watched()
    # A worker process that it starts inherits the name, but is no kernel.
    monkeypatch.delitem(sys.modules, "ipykernel")
    assert not is_watched()


def test_worker_threads_and_processes_say_nothing(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    found = []
    thread = threading.Thread(target=lambda: found.append(is_watched()))
    thread.start()
    thread.join()
    assert (found, is_watched()) == ([False], True)
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: "the one that is watched")
    assert not is_watched()
