"""How functions are compiled, and where the result is kept.

numba compiles a function when it is first called, and keeps the result in a folder for the next
process. A compiled function holds those that it calls, so that a folder belongs to the source
of one module and of all compiled modules that it imports. Comments and docstrings do not count.
"""

from __future__ import annotations

import ast
import hashlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event

_PACKAGE = Path(__file__).parents[1]


def njit(
    *, cache: bool = True, nogil: bool = False, error_model: str = "python"
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function when it is first called with arguments of these types.

    Parameters
    ----------
    cache : bool, optional
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
        options = {"nogil": nogil, "error_model": error_model, "no_cfunc_wrapper": True}
        folder = _folder(Path(function.__code__.co_filename)) if cache else None
        if folder is None:
            return numba.njit(**options)(function)
        with _numba_keeps_in(folder):
            return numba.njit(cache=True, **options)(function)

    return decorate


@cache
def _folder(source: Path) -> Path | None:
    """Return where the compiled functions of a module are kept, or None if nowhere."""
    name = f"{source.stem}-{_stamp(source)}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    user = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    bases = [Path(chosen)] if chosen else [_PACKAGE / "__pycache__", Path(user)]
    for base in bases:
        folder = base / "armlock-compiled" / name
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            there = folder.stat()
        except OSError:
            continue
        # What others could have written there would be run.
        if there.st_uid == os.getuid() and not there.st_mode & 0o022:
            return folder
    _say_that_nothing_is_kept()
    return None


@cache
def _say_that_nothing_is_kept() -> None:
    """Say so once, on the error stream."""
    print(
        "armlock finds no folder to keep compiled functions in, and compiles them in "
        "each process; NUMBA_CACHE_DIR names one that can be written.",
        file=sys.stderr,
    )


@contextmanager
def _numba_keeps_in(folder: Path) -> Iterator[None]:
    """Let numba choose this folder for what is decorated meanwhile."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before


def _stamp(source: Path) -> str:
    """Return a digest of the code of a module and of all compiled modules that it imports."""
    digest, left, read = hashlib.sha256(), [source], set()
    while left:
        path = left.pop()
        text = path.read_text("utf-8") if path.is_file() and path not in read else ""
        read.add(path)
        if "njit" not in text:
            continue
        tree = ast.parse(text)
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module, *(f"{node.module}.{one.name}" for one in node.names)]
                left += [_PACKAGE.parent / (name.replace(".", "/") + ".py") for name in names]
            body = getattr(node, "body", None)
            if isinstance(body, list):
                # A string that stands alone is a docstring, or does nothing.
                body[:] = [one for one in body if not _is_text(one)]
        digest.update(ast.dump(tree).encode())
    return digest.hexdigest()[:16]


def _is_text(node: ast.AST) -> bool:
    """Whether a statement is a string alone."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


class _Word(event.Listener):  # type: ignore[misc]
    """A line on the terminal while a function of this package is being compiled."""

    _compiling = 0

    def on_start(self, event: Any) -> None:
        """Begin the line, unless the function is part of one that is being compiled."""
        if self._is_ours(event):
            self._compiling += 1
            if self._compiling == 1:
                print("armlock compiles, once ...", end="", file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        """Clear the line."""
        if self._is_ours(event):
            self._compiling -= 1
            if self._compiling == 0:
                # Back to the start of the line, and clear it.
                print("\r\033[K", end="", file=sys.stderr, flush=True)

    def _is_ours(self, event: Any) -> bool:
        module: str = event.data["dispatcher"].py_func.__module__
        return module.startswith("armlock.") and sys.stderr.isatty()


event.register("numba:compile", _Word())
