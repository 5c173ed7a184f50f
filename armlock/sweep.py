"""One function at many points, on one core, all cores or many machines; stopped and resumed."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from functools import partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

_P = TypeVar("_P")
_R = TypeVar("_R")

#: Most tasks of a sweep. Of more points than this, a task takes several, one after the other.
TASKS = 4096


def sweep(
    function: Callable[[_P], _R],
    points: Iterable[_P],
    *,
    executor: Executor | None = None,
    progress: bool = False,
    store: str | os.PathLike[str] | None = None,
    about: Mapping[str, Any] | None = None,
) -> list[_R]:
    """Call a function at each point, and return the results in the order of the points.

    Parameters
    ----------
    function : callable
        Of one point. Processes and machines get it by pickling: it stands in a module, or is
        a `functools.partial` of one that does. What is random in it comes from its point, for
        instance a seed.
    points : iterable
        Where it is called.
    executor : concurrent.futures.Executor, optional
        What calls it: of processes, of threads, or `client.get_executor()` of a Dask client.
        Without one, the calls are made here, one by one. The results are the same, bit by
        bit, on processors of one kind.
    progress : bool, optional
        Whether a line on standard error says how far it is.
    store : path_like, optional
        HDF5 file that takes results as they come. A sweep that was interrupted, and is called
        again, goes on where it was. All results are numbers or arrays of one shape and type;
        with a file they are returned as those of NumPy. It takes the package h5py.
    about : mapping, optional
        Attributes of the file, such as the names and units of axes, and the seed.

    Returns
    -------
    list
        Of the results.

    Raises
    ------
    TypeError
        If `executor` is no executor, for instance a Dask client itself.
    ValueError
        If the file is that of another sweep: of other points, function, attributes, or
        version of this package.
    ImportError
        If there is a file to write and no h5py.

    Notes
    -----
    A task is one point, or as many as make `TASKS` tasks of all. A worker holds its task's
    points and results, and what the function takes. An error of the function ends the sweep.

    The file holds the datasets `points` (as numbers, or else as text), `results`, and `done`,
    which is true where there is a result. The attributes `function` and `armlock`, the version,
    join those given. It has its full size from the first result on, and then no change of
    structure, so that a process that is killed leaves a file in order.

    A pool of processes starts them by `spawn`, because a forked process may hang where the
    parent had threads. The program that makes one starts under ``if __name__ == "__main__":``.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from functools import partial
    >>> from armlock import CommonArm, critical_perturbation, sweep
    >>> critical = partial(critical_perturbation, CommonArm())
    >>> directions = [(-1.0, -1.0), (-1.0, -0.5), (1.0, -1.0)]
    >>> with ThreadPoolExecutor(2) as executor:
    ...     found = sweep(critical, directions, executor=executor)
    >>> found == [critical(direction) for direction in directions]
    True

    With processes, `executor` is a ``ProcessPoolExecutor`` whose ``mp_context`` is
    ``multiprocessing.get_context("spawn")``.
    """
    if executor is not None and not isinstance(executor, Executor):
        raise TypeError(
            f"executor must be a concurrent.futures.Executor, which client.get_executor() of a "
            f"Dask client is, got {executor!r}"
        )
    given = list(points)
    results: dict[int, _R] = {}
    left: Sequence[int] = range(len(given))
    kept = None
    if store is not None and given:
        kept = _Kept(Path(store), given, {"function": _name(function), **(about or {})})
        left = kept.missing()
    begin = time.monotonic()
    for part, values in _computed(function, given, left, executor):
        results.update(zip(part, values, strict=True))
        if kept is not None:
            kept.write(part, values)
        if progress:
            done = len(results)
            seconds = (time.monotonic() - begin) / done * (len(left) - done)
            line = f"\r{done + len(given) - len(left)} of {len(given)}, {seconds:.0f} s left   "
            print(line, end="\n" if done == len(left) else "", file=sys.stderr, flush=True)
    return [results[i] for i in range(len(given))] if kept is None else kept.results()


def _computed(
    function: Callable[[_P], _R],
    points: Sequence[_P],
    left: Sequence[int],
    executor: Executor | None,
) -> Iterator[tuple[Sequence[int], list[_R]]]:
    """Yield the results at `left` as they come: which points, and what came."""
    size = -(-len(left) // TASKS)
    parts = [left[at : at + size] for at in range(0, len(left), max(size, 1))]
    if executor is None:
        for part in parts:
            yield part, _several(function, [points[i] for i in part])
        return
    running = {
        executor.submit(_several, function, [points[i] for i in part]): part for part in parts
    }
    try:
        for future in as_completed(list(running)):
            yield running.pop(future), future.result()
    finally:
        for future in running:
            future.cancel()


def _several(function: Callable[[_P], _R], points: list[_P]) -> list[_R]:
    return [function(point) for point in points]


def _name(function: Callable[..., Any]) -> str:
    """Return what a function is called, in every process the same."""
    if isinstance(function, partial):
        return f"{_name(function.func)} of {function.args} {function.keywords}"
    return f"{function.__module__}.{getattr(function, '__qualname__', repr(function))}"


class _Kept:
    """The file of a sweep."""

    def __init__(self, path: Path, points: Sequence[Any], about: dict[str, Any]) -> None:
        self._h5py = import_module("h5py")
        self._path = path
        self._about = {**about, "armlock": version("armlock")}
        try:
            self._points = np.asarray(points, dtype=np.float64)
        except (TypeError, ValueError):  # other things than numbers
            self._points = np.array([repr(point) for point in points], dtype="S")

    def missing(self) -> Sequence[int]:
        """Return the points without a result; raise if the file belongs to another sweep."""
        if not self._path.exists():
            return range(len(self._points))
        with self._h5py.File(self._path) as file:
            found = {**file.attrs, "points": file["points"][...]}
            for name, value in {**self._about, "points": self._points}.items():
                if name not in found or not np.array_equal(found[name], value):
                    raise ValueError(
                        f"store must be the file of this very sweep, or of none; {self._path} "
                        f"has another {name}"
                    )
            return [int(i) for i in np.flatnonzero(~file["done"][...])]

    def write(self, part: Sequence[int], values: Sequence[Any]) -> None:
        """Write the results of some points, which ascend."""
        if not self._path.exists():
            self._create(np.asarray(values[0]))
        with self._h5py.File(self._path, "r+") as file:
            file["results"][list(part)] = values
            # What is said to be done is in the file before.
            file.flush()
            file["done"][list(part)] = True

    def results(self) -> list[Any]:
        with self._h5py.File(self._path) as file:
            return list(file["results"][...])

    def _create(self, first: np.ndarray[Any, Any]) -> None:
        """Make the file at its full size, complete from the moment at which it has its name."""
        count = len(self._points)
        temporary = self._path.with_name(self._path.name + ".part")
        with self._h5py.File(temporary, "w") as file:
            file.attrs.update(self._about)
            file["points"] = self._points
            file["done"] = np.zeros(count, dtype=bool)
            file["results"] = np.zeros((count, *first.shape), first.dtype)
        temporary.replace(self._path)
