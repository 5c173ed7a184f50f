"""Results that several claims, chapters and tests need, computed once a build or test run."""

from __future__ import annotations

import fcntl
import os
import pickle
from collections.abc import Callable
from functools import update_wrapper
from inspect import signature
from pathlib import Path
from typing import Generic, TypeVar

R = TypeVar("R")


class shared(Generic[R]):  # noqa: N801, a decorator
    """Let all processes of a build or test run share what a function returns.

    The environment variable ARMLOCK_SHARED names their folder. The first process computes the
    result, and the others wait. Without a folder each process keeps its own results, as with
    `functools.cache`.

    Parameters
    ----------
    function : callable
        Its arguments have to be hashable, and the same text for the same value; its result
        is pickled.
    """

    def __init__(self, function: Callable[..., R]) -> None:
        update_wrapper(self, function)
        self._function = function
        self._parameters = signature(function)
        self._found: dict[tuple[object, ...], R] = {}

    def _values(self, *args: object, **kwargs: object) -> tuple[object, ...]:
        """Return the values of all arguments: a default counts as one that is written out."""
        given = self._parameters.bind(*args, **kwargs)
        given.apply_defaults()
        return tuple(given.arguments.values())

    def _file(self, values: tuple[object, ...]) -> Path | None:
        folder = os.environ.get("ARMLOCK_SHARED")
        name = (self._function.__module__, self._function.__name__, *map(str, values))
        return Path(folder, "_".join(name)) if folder else None

    def is_stored(self, *args: object, **kwargs: object) -> bool:
        """Whether a process has stored the result of these arguments."""
        file = self._file(self._values(*args, **kwargs))
        return file is not None and file.exists() and file.stat().st_size > 0

    def __call__(self, *args: object, **kwargs: object) -> R:
        """Return the result, computed here or by another process."""
        values = self._values(*args, **kwargs)
        if values not in self._found:
            file = self._file(values)
            self._found[values] = (
                self._function(*args, **kwargs)
                if file is None
                else self._stored(file, lambda: self._function(*args, **kwargs))
            )
        return self._found[values]

    @staticmethod
    def _stored(file: Path, compute: Callable[[], R]) -> R:
        """Return what a file holds, or compute and store it while the others wait."""
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("a+b") as stream:
            fcntl.flock(stream, fcntl.LOCK_EX)
            stream.seek(0)
            if found := stream.read():
                kept: R = pickle.loads(found)
                return kept
            result = compute()
            stream.write(pickle.dumps(result))
            return result
