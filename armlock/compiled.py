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
from functools import cached_property
from threading import Timer
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.event import Listener, register
from tqdm import tqdm  # type: ignore[import-untyped]

# After so many seconds compiling says that it does, and work shows its progress.
_PATIENCE, _PATIENCE_OF_WORK = 1.0, 2.0


_lost: list[Exception] = []


def _not_kept(reason: Exception) -> None:
    """Say once that nothing is kept."""
    _lost.append(reason)
    if len(_lost) > 1:
        return
    warnings.warn(
        "compiled functions are not kept for the next process, which will take as long to "
        f"compile them: {reason}",
        RuntimeWarning,
        stacklevel=3,
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

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what has been compiled, or say that it is not kept."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            # The index may already name a file that was compiled from other source.
            with contextlib.suppress(OSError):
                os.unlink(self._cache_file._index_path)
            _not_kept(error)


class _Notice(Listener):  # type: ignore[misc]
    """A line that says, once in a process, what takes so long while numba compiles."""

    depth, said, begun, seconds = 0, False, 0.0, 0.0

    def on_start(self, event: Any) -> None:
        """Begin to wait with the first function; others are compiled on its way."""
        self.depth += 1
        if self.depth == 1:
            self.begun = time.monotonic()
            self.timer = Timer(_PATIENCE, self.say)
            self.timer.daemon = True
            self.timer.start()

    def on_end(self, event: Any) -> None:
        """Wait no longer."""
        self.depth -= 1
        if self.depth == 0:
            self.timer.cancel()
            self.seconds += time.monotonic() - self.begun

    def taken(self) -> float:
        """Return the seconds of compiling since this was asked last."""
        found, self.seconds = self.seconds, 0.0
        return found

    def say(self) -> None:
        """Print the line."""
        # Where progress bars are off, as in the book's notebooks, it is no part of a page.
        if not (self.said or os.environ.get("TQDM_DISABLE")):
            self.said = True
            tqdm.write("armlock: compiling, once for this installation ...", file=sys.stderr)


notice = _Notice()
register("numba:compile", notice)


class Progress(tqdm):  # type: ignore[misc]
    """A progress bar that shows after two seconds of work; compiling is none."""

    def __init__(self, total: int, what: str, unit: str) -> None:
        notice.taken()
        super().__init__(
            total=total, desc=what, unit=unit, delay=_PATIENCE_OF_WORK, leave=False,
            smoothing=0.0,
        )  # fmt: skip

    def update(self, n: float = 1) -> Any:
        """Count work that is done."""
        if not self.disable:
            self.start_t += notice.taken()
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
            _not_kept(error)
        return dispatcher

    return decorate
