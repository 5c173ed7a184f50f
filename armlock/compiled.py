"""How functions are compiled, and where the result is kept.

numba keeps compiled functions beside the package, in the user's folder for such files, or where
NUMBA_CACHE_DIR says. What is different here, for all modules of the package:

- where nothing can be written, the functions are compiled in each process, which warns;
- what cannot be read, or has changed on the disk, is compiled anew;
- a change of any module counts, because a compiled function holds those that it calls;
- a line on the terminal says that something is being compiled, while it lasts;
- a few calls of short functions run in Python, which takes less time than compiling (`soon`).
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba.core import caching

_SOURCES = hashlib.sha256()
for _module in sorted(Path(__file__).parent.glob("*.py")):
    _SOURCES.update(_module.read_bytes())

# How many calls of a function are plain Python, and then no more, if it may be.
_PLAIN_CALLS = 5

# How many functions are being compiled: one, and those that it calls.
_compiling = 0
_warned = False


def njit(
    *, cache: bool, nogil: bool = False, error_model: str = "python"
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function when it is first called with arguments of these types.

    Parameters
    ----------
    cache : bool
        Whether the result is kept for other processes.
    nogil : bool, optional
        Whether other threads run while the function does.
    error_model : str, optional
        What a division by zero does: it raises, or with "numpy" gives inf or nan.

    Returns
    -------
    callable
        The decorator.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(nogil=nogil, error_model=error_model, no_cfunc_wrapper=True)(
            function
        )
        if cache:
            try:
                dispatcher._cache = _Cache(function)
            except RuntimeError:  # no folder can be written
                dispatcher._cache = _NoCache()
        return dispatcher

    return decorate


def soon(function: Any, *, unless: Any = None, **limits: object) -> Callable[..., Any]:
    """Return a compiled function whose first calls are plain Python, unless it is kept.

    Compiling takes some seconds, which many calls should share. Both ways give the same result
    but for rounding.

    Parameters
    ----------
    function : callable
        What `njit` has made.
    unless : object, optional
        A result after which the call is repeated, compiled.
    **limits
        Other values for constants of its module, for Python's slower calls.

    Returns
    -------
    callable
    """
    plain, left = _plain(function, limits), [0 if _is_kept(function) else _PLAIN_CALLS]

    def call(*arguments: Any) -> Any:
        if left[0] > 0:
            left[0] -= 1
            # Python raises where compiled functions go on with inf or nan.
            with np.errstate(all="ignore"), suppress(ArithmeticError):
                result = plain(*arguments)
                if not np.array_equal(result, unless):
                    return result
            # Compiled now, it is the faster way from here on.
            left[0] = 0
        return function(*arguments)

    return call


def _is_kept(function: Any) -> bool:
    """Whether files hold a compiled function that is up to date."""
    cache = getattr(function, "_cache", None)
    return isinstance(cache, _Cache) and bool(cache._cache_file._load_index())


def _plain(function: Any, limits: dict[str, object]) -> Callable[..., Any]:
    """Return a compiled function as plain Python, and those that it calls."""
    original = getattr(function, "py_func", function)
    names = {**original.__globals__, **limits}
    for name in original.__code__.co_names:
        if hasattr(names.get(name), "py_func"):
            names[name] = _plain(names[name], limits)
    return FunctionType(original.__code__, names)


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    """The files of one function."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp(), _SOURCES.hexdigest()
        self._cache_file = _Files(self.cache_path, self._impl.filename_base, stamp)

    def load_overload(self, *arguments: Any) -> Any:
        try:
            found = super().load_overload(*arguments)
        except Exception:  # whatever damaged files lead to
            self.flush()
            found = None
        if found is None:
            _begin()
        return found

    def save_overload(self, *arguments: Any) -> None:
        with suppress(OSError):  # a full disk: the next process compiles again
            super().save_overload(*arguments)
        _end()


class _Files(caching.IndexDataCacheFile):  # type: ignore[misc]
    """Files that end in a digest of what they hold."""

    def _dump(self, content: object) -> bytes:
        data: bytes = super()._dump(content)
        return data + hashlib.sha256(data).digest()

    def _load_data(self, name: str) -> Any:
        written = Path(self._data_path(name)).read_bytes()
        data, digest = written[:-32], written[-32:]
        if hashlib.sha256(data).digest() != digest:
            raise ValueError(f"{name} is damaged")
        return pickle.loads(data)


class _NoCache(caching.NullCache):  # type: ignore[misc]
    """What stands in for files that cannot be written."""

    def load_overload(self, *arguments: Any) -> None:
        global _warned
        if not _warned:
            _warned = True
            print(
                "armlock finds no folder to keep compiled functions in, and compiles them in "
                "each process; NUMBA_CACHE_DIR names one that can be written.",
                file=sys.stderr,
            )
        _begin()

    def save_overload(self, *arguments: Any) -> None:
        _end()


def _begin() -> None:
    global _compiling
    _compiling += 1
    if _compiling == 1 and sys.stderr.isatty():
        print("armlock compiles, once: some seconds ...", end="", file=sys.stderr, flush=True)


def _end() -> None:
    global _compiling
    _compiling -= 1
    if _compiling == 0 and sys.stderr.isatty():
        # Back to the start of the line, and clear it.
        print("\r\033[K", end="", file=sys.stderr, flush=True)
