"""How functions run: compiled by numba, or, where that takes less time, as plain Python.

numba compiles a function when it is first called, which takes seconds, and keeps the result for
the next process beside the source, in the user's cache, or in the folder that NUMBA_CACHE_DIR
names. `make clean` removes those beside the source. Where they cannot be kept (nothing can be
written, the disk is full) or not be read, each process compiles for itself, and says so once.

A compiled function is called through numba's *dispatcher*, which also holds the function as it
was written. So a call that is over after a few steps need not wait for the compiler: `Plain`
copies a module, with every function as it was written. A step takes some thousand times as
long, and last digits may differ, so only whole numbers are taken from it.

While numba compiles, Python does not collect reference cycles, because it would search the many
objects of the compiler again and again; and LLVM optimises at its level 1, because higher
levels take longer and gain little here. Both are settings of the whole process, and are
restored; numba's own lock keeps other threads from compiling meanwhile.
"""

from __future__ import annotations

import contextlib
import gc
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from functools import cached_property, partial
from pickle import UnpicklingError
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache, NullCache
from numba.core.compiler_lock import global_compiler_lock
from tqdm import tqdm  # type: ignore[import-untyped]

# How a cache fails: the folder, or a file that was cut short.
_FAILURES = OSError, EOFError, UnpicklingError
# After so many seconds compiling says that it does.
_PATIENCE = 1.0


class _Lost(NullCache):  # type: ignore[misc]
    """No cache: it says why when the first function has been compiled."""

    # Of the process.
    said = False
    exists = False

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

    @property
    def exists(self) -> bool:
        """Whether an earlier process has kept something, perhaps of other source."""
        return os.path.exists(self._cache_file._index_path)

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


class _Notice(threading.Timer):
    """A line that says, once in a process, what takes so long."""

    said = False

    def __init__(self) -> None:
        super().__init__(_PATIENCE, self._say)
        self.daemon = True

    def _say(self) -> None:
        # Where progress bars are off, as in the book's notebooks, it is no part of a page.
        if not (_Notice.said or os.environ.get("TQDM_DISABLE")):
            _Notice.said = True
            tqdm.write("armlock: compiling, once for this installation ...", file=sys.stderr)


@contextlib.contextmanager
def _compiling() -> Iterator[None]:
    """Compile in less time, and say so if it takes long."""
    with global_compiler_lock:
        level, collects, notice = numba.config.OPT, gc.isenabled(), _Notice()
        gc.disable()
        numba.config.OPT = min(level, type(level)(1))
        notice.start()
        try:
            yield
        finally:
            notice.cancel()
            numba.config.OPT = level
            if collects:
                gc.enable()


def _compile(compiler: Callable[[Any], Any], signature: Any) -> Any:
    with _compiling():
        return compiler(signature)


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
        compiles = not getattr(compiled, "signatures", True) and not compiled._cache.exists
        return compiles and self._left > 0.0

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
            dispatcher._cache = _Lost(error)
        if not inner and not numba.config.DISABLE_JIT:
            dispatcher.compile = partial(_compile, dispatcher.compile)
        return dispatcher

    return decorate
