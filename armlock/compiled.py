"""How functions are compiled: by numba, which keeps the result for the next process.

numba keeps compiled functions beside the source, in the user's cache, or in the folder that
NUMBA_CACHE_DIR names. `make clean` removes those beside the source. Where they cannot be kept
(nothing can be written, the disk is full) or not be read, each process compiles for itself, and
says so once.
"""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Callable
from pickle import UnpicklingError
from typing import Any

import numba
from numba.core.caching import FunctionCache, NullCache

# How a cache fails: the folder, or a file that was cut short.
_FAILURES = OSError, EOFError, UnpicklingError


class _Lost(NullCache):  # type: ignore[misc]
    """No cache: it says why when the first function has been compiled."""

    # Of the process.
    said = False

    def __init__(self, reason: Exception) -> None:
        self._reason = reason

    def save_overload(self, sig: Any, data: Any) -> None:
        """Say once that nothing is kept."""
        if not _Lost.said:
            _Lost.said = True
            warnings.warn(
                "compiled functions are not kept for the next process, which will take as long "
                f"to compile them: {self._reason}",
                RuntimeWarning,
                stacklevel=2,
            )


class _Kept(FunctionCache):  # type: ignore[misc]
    """The cache of a function, whose failures do not end the call."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what an earlier process has compiled, if there is such and it can be read."""
        try:
            return super().load_overload(sig, target_context)
        except _FAILURES as error:
            self._forget(error, sig)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what has been compiled, or say that it is not kept."""
        try:
            super().save_overload(sig, data)
        except _FAILURES as error:
            self._forget(error, sig)

    def _forget(self, error: Exception, sig: Any) -> None:
        """Remove the index, which may name a file that was compiled from other source."""
        with contextlib.suppress(OSError):
            os.unlink(self._cache_file._index_path)
        _Lost(error).save_overload(sig, None)


def njit(
    *,
    nogil: bool = False,
    error_model: str = "python",
    inner: bool = False,
    inlined: bool = False,
    allocates: bool = True,
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function when it is first called with arguments of these types.

    Parameters
    ----------
    nogil : bool, optional
        Whether other threads run while the function does.
    error_model : str, optional
        What a division by zero does: it raises, or with "numpy" gives inf or nan.
    inner : bool, optional
        Whether only compiled functions call it. Then it compiles in less time.
    inlined : bool, optional
        Whether it becomes part of the functions that call it. numba passes each array of an
        argument as eight numbers, which takes longer than a short function runs.
    allocates : bool, optional
        Whether it makes or returns arrays. If not, numba does not count references to arrays,
        which takes as long as a short loop.

    Returns
    -------
    callable
        The decorator.
    """
    options = {
        "nogil": nogil,
        "error_model": error_model,
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": inner,
        "inline": "always" if inlined else "never",
        "_nrt": allocates,
    }

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**options)(function)
        try:
            dispatcher._cache = _Kept(function)
        except RuntimeError as error:
            dispatcher._cache = _Lost(error)
        return dispatcher

    return decorate
