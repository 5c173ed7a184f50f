"""Results that several claims, chapters and tests need, computed once a build or test run."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache, update_wrapper
from typing import Any, Generic, TypeVar

from joblib import Memory

R = TypeVar("R")


class shared(Generic[R]):  # noqa: N801, a decorator
    """Let all processes of a build or test run share what a function returns.

    The environment variable ARMLOCK_SHARED names the folder of `joblib.Memory`. Without it each
    process keeps its own results.

    Parameters
    ----------
    function : callable
        Its arguments have to be hashable, and its result is pickled.
    """

    def __init__(self, function: Callable[..., R]) -> None:
        update_wrapper(self, function)
        stored = Memory(os.environ.get("ARMLOCK_SHARED"), verbose=0).cache(function)
        self.is_stored: Callable[..., bool] = stored.check_call_in_cache
        self._kept = cache(stored)

    def __call__(self, *args: Any, **kwargs: Any) -> R:
        """Return the result, computed here or by another process."""
        result: R = self._kept(*args, **kwargs)
        return result
