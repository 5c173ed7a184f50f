"""Results that several claims, chapters and tests need, computed once a build."""

from __future__ import annotations

import fcntl
import os
import pickle
from collections.abc import Callable
from functools import cache, wraps
from inspect import signature
from pathlib import Path
from typing import TypeVar

R = TypeVar("R")


def folder_of_the_build() -> Path | None:
    """Return the folder of shared results, beside that of the figures; none without a build."""
    figures = os.environ.get("ARMLOCK_FIGURES")
    return Path(figures).with_suffix(".shared") if figures else None


def shared(function: Callable[..., R]) -> Callable[..., R]:
    """Let all processes of a build share what a function returns.

    The first process computes it, and the others wait. Without a build each process keeps its
    own results, as with `functools.cache`.

    Parameters
    ----------
    function : callable
        Its arguments have to be hashable, and the same text for the same value; its result
        is pickled.

    Returns
    -------
    callable
    """
    parameters = signature(function)

    @cache
    @wraps(function)
    def call(*args: object, **kwargs: object) -> R:
        folder = folder_of_the_build()
        if folder is None:
            return function(*args, **kwargs)
        folder.mkdir(parents=True, exist_ok=True)
        # A default counts as one that is written out.
        given = parameters.bind(*args, **kwargs)
        given.apply_defaults()
        values = "_".join(map(str, given.arguments.values()))
        with (folder / f"{function.__name__}_{values}").open("a+b") as stream:
            fcntl.flock(stream, fcntl.LOCK_EX)
            stream.seek(0)
            if found := stream.read():
                kept: R = pickle.loads(found)
                return kept
            result = function(*args, **kwargs)
            stream.write(pickle.dumps(result))
            return result

    return call
