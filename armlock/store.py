"""The file of a sweep: what was computed where, told from what any other sweep computes."""

from __future__ import annotations

import dis
import hashlib
import io
import os
import pickle
import sys
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from importlib import import_module
from importlib.metadata import packages_distributions, version
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

# Codes of the dtypes that are kept: what h5py has an equivalent of, without padding.
_KEPT = "?bhilqBHILQefdFD"
# What makes a piece of bytecode, without its name and its place in a file.
_OF_CODE = (
    *("co_code", "co_names", "co_varnames", "co_cellvars", "co_freevars", "co_flags"),
    *("co_argcount", "co_posonlyargcount", "co_kwonlyargcount", "co_exceptiontable"),
)
# Where a function that is compiled, or keeps its results, has the one that it is made from.
_INNER = ("py_func", "__wrapped__")


@contextmanager
def opened(
    place: str | os.PathLike[str],
    function: Callable[..., Any],
    points: Sequence[Any],
    about: Mapping[str, Any],
) -> Iterator[Store]:
    """Open the file of a sweep, or begin it; nothing else can open it meanwhile."""
    path = Path(place)
    parts = {"function": function, "points": points, "about": sorted(about.items())}
    identity = {name: _digest(name, part) for name, part in parts.items()}
    h5py = import_module("h5py")
    # It gets its name with its first result: a file of that name is never half begun.
    begun, beginning = path.exists(), path.with_name(path.name + ".part")
    with _naming(path):
        file = h5py.File(path, "r+") if begun else h5py.File(beginning, "w")
    try:
        with file:
            store = Store(path, file, {**identity, "armlock": version("armlock")})
            if not begun:
                store.describe(points, about)
            yield store
    finally:
        if not begun:
            beginning.unlink(missing_ok=True)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Let what HDF5 raises name the argument and the file."""
    try:
        yield
    except BlockingIOError as error:
        raise ValueError(
            f"store must not be in use: another sweep, or program, has {path} open"
        ) from error
    except Exception as error:
        raise ValueError(
            f"store must be the whole file of a sweep, or a new one; {path} is not: {error}"
        ) from error


class Store:
    """An open file of a sweep.

    It holds `results`, and in `done` 0 where there is none, or else the checksum of the result.
    With the first result it has its full size, and then no change of structure, so that a
    process that is killed leaves it in order.
    """

    def __init__(self, path: Path, file: Any, identity: Mapping[str, str]) -> None:
        self._path, self._file, self._identity = path, file, identity

    def describe(self, points: Sequence[Any], about: Mapping[str, Any]) -> None:
        """Write all but the results."""
        numbers, text = _numbers(points), [ascii(point) for point in points]
        with _naming(self._path):
            self._file["points"] = np.array(text, dtype="S") if numbers is None else numbers
            self._file["done"] = np.zeros(len(points), dtype=np.uint64)
        for name, value in about.items():
            try:
                self._file.attrs[name] = value
            except (TypeError, ValueError) as error:
                raise TypeError(
                    f"about must hold numbers, text or lists of them, by name; got {value!r} "
                    f"for {name!r}: {error}"
                ) from error

    def found(self) -> dict[int, Any]:
        """Return the results that are there, less damaged ones; raise if they are others'."""
        with _naming(self._path):
            if self._file.filename != os.fspath(self._path):  # there is none yet
                return {}
            values, done = self._file["results"], self._file["done"][...]
            identity, values = dict(values.attrs), values[...]
            there = np.flatnonzero(done).tolist()
            found = {i: values[i] for i in there if _checksum(values[i]) == done[i]}
        for name, value in self._identity.items():
            if identity.get(name) != value:
                raise ValueError(
                    f"store must be the file of this very sweep, or a new one; {self._path} "
                    f"has another {name}"
                )
        return found

    def write(self, part: Sequence[int], values: Sequence[Any]) -> list[Any]:
        """Write the results of some points, which ascend; return them as numbers of NumPy."""
        arrays = [_numbers(value) for value in values]
        if "results" not in self._file and arrays[0] is not None:
            self._begin(arrays[0])
        kept = self._file.get("results")
        for i, value, array in zip(part, values, arrays, strict=True):
            if array is None or (array.dtype, array.shape) != (kept.dtype, kept.shape[1:]):
                raise TypeError(
                    f"function must return numbers, or arrays of them, of one type and shape, "
                    f"to have them in a file; got {value!r} at point {i}"
                    + (f" after {kept.dtype} of shape {kept.shape[1:]}" if kept else "")
                )
        with _naming(self._path):
            kept[list(part)] = arrays
            self._file["done"][list(part)] = [_checksum(array) for array in arrays]
            self._file.flush()
        return [array[()] for array in arrays if array is not None]

    def _begin(self, first: npt.NDArray[Any]) -> None:
        """Give the file its full size, and then its name."""
        with _naming(self._path):
            if self._path.exists():
                raise BlockingIOError
            size = len(self._file["done"])
            self._file["results"] = np.zeros((size, *first.shape), first.dtype)
            self._file["results"].attrs.update(self._identity)
            self._file.flush()
            os.replace(self._file.filename, self._path)


def _numbers(value: Any) -> npt.NDArray[Any] | None:
    """Return what a file can keep as an array, and None of all else."""
    with suppress(TypeError, ValueError):
        array = np.asarray(value)
        if array.dtype.char in _KEPT and not isinstance(value, np.ma.MaskedArray):
            return array
    return None


def _checksum(value: Any) -> int:
    """Return a checksum of the bytes and the type of a result; it is not 0."""
    kind = np.asarray(value).dtype.str.encode()
    return zlib.crc32(np.asarray(value).tobytes(), zlib.crc32(kind)) | 1 << 32


def _digest(name: str, thing: Any) -> str:
    """Return a digest of what a thing holds and computes, the same in every process.

    Functions and classes count as what they do, as bytecode with all that it refers to; those
    that are installed, or come with Python, count by their names.
    """
    written = io.BytesIO()
    try:
        _Content(written, protocol=5).dump(thing)
    except Exception as error:
        raise TypeError(
            f"{name} must hold only what can be pickled, for a file to tell it from others; "
            f"got {thing!r:.200}: {error}"
        ) from error
    return hashlib.sha256(written.getbuffer()).hexdigest()


class _Content(pickle.Pickler):
    """Writes what things compute and hold; nobody reads it to make them again."""

    def reducer_override(self, thing: Any) -> Any:
        """Return how a thing is written: as a list, and then what it holds."""
        held = self._held(thing)
        return NotImplemented if held is None else (list, (), held)

    def _held(self, thing: Any) -> Any:
        """Return what a thing holds, or None if it is written as always."""
        if isinstance(thing, ModuleType):
            return thing.__name__
        if isinstance(thing, CodeType):
            constants = [_ordered(value) for value in thing.co_consts]
            return repr([getattr(thing, name) for name in _OF_CODE]), constants
        if isinstance(thing, property | classmethod | staticmethod | cached_property):
            return [getattr(thing, name, None) for name in ("fget", "__func__", "func")]
        if isinstance(thing, FunctionType):
            return None if _has_a_name(thing) else _function(thing)
        if isinstance(thing, type):
            return None if _has_a_name(thing) else _class(thing)
        state = getattr(thing, "__dict__", {})
        inner = next((state[name] for name in _INNER if name in state), None)
        if isinstance(inner, FunctionType):
            return inner.__qualname__ if _has_a_name(inner) else inner
        # What is computed when it is first asked for says nothing more.
        every = [item for kind in type(thing).__mro__ for item in vars(kind).items()]
        cached = {name for name, value in every if isinstance(value, cached_property)}
        held = [(name, value) for name, value in state.items() if name not in cached]
        return (type(thing), held) if cached else None


@cache
def _installed() -> set[str]:
    """Return the names of all packages and modules that are installed, or built in."""
    return {"armlock", *sys.stdlib_module_names, *packages_distributions()}


def _has_a_name(thing: FunctionType | type) -> bool:
    """Whether a function or class is known by the name under which it can be imported."""
    package = str(thing.__module__).partition(".")[0]
    return package in _installed() and "<" not in thing.__qualname__


def _function(thing: FunctionType) -> tuple[Any, ...]:
    """Return what a function is made of, and the globals that it uses."""
    names = sorted(_looked_up(thing.__code__) & thing.__globals__.keys())
    used = [(name, _ordered(thing.__globals__[name])) for name in names]
    cells = [_ordered(cell.cell_contents) for cell in thing.__closure__ or ()]
    return thing.__code__, used, cells, thing.__defaults__, thing.__kwdefaults__


def _class(thing: type) -> tuple[Any, ...]:
    """Return what a class is made of, less what Python adds to each."""
    inside = [
        (name, value)
        for name, value in vars(thing).items()
        if isinstance(value, FunctionType) or not name.startswith("__")
    ]
    return thing.__qualname__, thing.__bases__, inside


def _looked_up(code: CodeType) -> set[str]:
    """Return the names that bytecode, and what is defined in it, looks up outside."""
    instructions = dis.get_instructions(code)
    names = {i.argval for i in instructions if i.opname in ("LOAD_GLOBAL", "LOAD_NAME")}
    inner = [value for value in code.co_consts if isinstance(value, CodeType)]
    return names.union(*map(_looked_up, inner))


def _ordered(value: Any) -> Any:
    """Return a set as a list in an order that does not differ between processes."""
    return sorted(value, key=repr) if isinstance(value, set | frozenset) else value
