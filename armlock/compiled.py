"""How functions run: compiled by numba, or, where that takes less time, as plain Python.

numba compiles a function when it is first called, which takes seconds, and keeps the result for
the next process beside the source, in the user's cache, or in the folder that NUMBA_CACHE_DIR
names. `make clean` removes those beside the source. Where they cannot be kept (nothing can be
written, or the disk is full), each process compiles for itself, and says so once.

A compiled function is called through numba's *dispatcher*, which also holds the function as it
was written. So a call that is over after a few steps need not wait for the compiler: `Plain`
copies a module, with every function as it was written. A step takes some thousand times as
long, and last digits may differ, so only whole numbers are taken from it.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from functools import cache, cached_property
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache
from tqdm import tqdm  # type: ignore[import-untyped]


@cache
def _compiling() -> None:
    """Say, once in a process, what takes so long."""
    # Where progress bars are off, as in the book's notebooks, the line is no part of a page.
    if not os.environ.get("TQDM_DISABLE"):
        print("armlock: compiling, once for this installation ...", file=sys.stderr)


@cache
def _not_kept() -> None:
    """Say, once in a process, that the next one compiles again."""
    warnings.warn(
        "compiled functions are not kept, so that the next process compiles them again: "
        "NUMBA_CACHE_DIR may name a folder that can be written",
        RuntimeWarning,
        stacklevel=2,
    )


class _Kept(FunctionCache):  # type: ignore[misc]
    """The cache of a function; a full disk ends no call, for which numba has no setting."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        # Numbers of other modules are literals in compiled code: they are part of its source.
        given = function.__globals__.items()
        numbers = [(name, value) for name, value in given if isinstance(value, float | int)]
        self._cache_file._source_stamp = self._cache_file._source_stamp, numbers

    @property
    def exists(self) -> bool:
        """Whether an earlier process has kept something, perhaps of other source."""
        return os.path.exists(self._cache_file._index_path)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what has been kept, or None and say that it is compiled now."""
        found = super().load_overload(sig, target_context)
        if found is None:
            _compiling()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what has been compiled, or say that it is not kept."""
        try:
            super().save_overload(sig, data)
        except OSError:
            # The index may already name a file that was compiled from other source.
            with contextlib.suppress(OSError):
                os.unlink(self._cache_file._index_path)
            _not_kept()


class Progress(tqdm):  # type: ignore[misc]
    """A progress bar, whose clock starts with the first work done: compiling comes before."""

    def __init__(self, total: int, what: str, unit: str) -> None:
        super().__init__(
            total=total, desc=what, unit=unit, delay=2.0, leave=False, smoothing=0.0
        )

    def update(self, n: float = 1) -> Any:
        """Count work that is done."""
        if not (self.n or self.disable):
            self.start_t, self.initial = time.time(), n
        return super().update(n)


class Plain:
    """The functions of a module as they are written, which call one another uncompiled.

    Parameters
    ----------
    module : module
        The module.
    seconds : float
        How long this process may take in them, instead of compiling.
    """

    def __init__(self, module: ModuleType, seconds: float) -> None:
        self._module, self._left = module, seconds

    @cached_property
    def functions(self) -> SimpleNamespace:
        """The functions, and all other names of the module."""
        copied = dict(vars(self._module))
        for name, value in vars(self._module).items():
            written = getattr(value, "py_func", value)
            own = getattr(written, "__module__", None) == self._module.__name__
            if own and isinstance(written, FunctionType):
                copied[name] = FunctionType(
                    written.__code__, copied, name, written.__defaults__, written.__closure__
                )
        return SimpleNamespace(**copied)

    def serves(self, compiled: Any) -> bool:
        """Whether a function would have to be compiled, and there is time left."""
        compiles = not getattr(compiled, "signatures", True)
        return compiles and self._left > 0.0 and not getattr(compiled._cache, "exists", False)

    @contextlib.contextmanager
    def instead(self) -> Iterator[SimpleNamespace]:
        """Give the functions, take the time, and leave the block where they fail.

        Numbers that are no numpy numbers raise where compiled functions give inf or nan.
        """
        begun = time.thread_time()
        try:
            with contextlib.suppress(ArithmeticError), np.errstate(all="ignore"):
                yield self.functions
        finally:
            self._left -= time.thread_time() - begun


def njit(
    *,
    inner: bool = False,
    inlined: bool = False,
    allocates: bool = True,
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function when it is first called with arguments of these types.

    Other threads run while the function does. A division by zero gives inf or nan.

    Parameters
    ----------
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
        "nogil": True,
        "error_model": "numpy",
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": inner,
        "inline": "always" if inlined else "never",
        "_nrt": allocates,
    }

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**options)(function)
        try:
            dispatcher._cache = _Kept(function)
        except RuntimeError:
            _not_kept()
        return dispatcher

    return decorate
