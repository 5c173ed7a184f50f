"""One function at many points, on one core, all cores or many machines; stopped and resumed."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import nullcontext
from functools import cache
from typing import Any, TypeVar

from armlock.store import opened

_P = TypeVar("_P")
_R = TypeVar("_R")

#: Most tasks of a sweep. Of more points than this, a task takes several, one after the other.
TASKS = 4096
# How often a log, which cannot take a line back, gets a line of progress, in s.
_BETWEEN_LINES = 60.0


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
        Whether standard error says how far it is: on one line in a terminal and in Jupyter,
        and in a log with a line a minute and one at the end.
    store : path_like, optional
        HDF5 file that takes results as they come. A sweep that was interrupted, and is called
        again, goes on where it was. All results are numbers or arrays of one shape and type;
        with a file they are returned as those of NumPy. It takes the package h5py. Nothing
        else can open the file while the sweep runs.
    about : mapping, optional
        Attributes of the file, such as the names and units of axes, and the seed: numbers,
        text, or lists of them.

    Returns
    -------
    list
        Of the results.

    Raises
    ------
    TypeError
        If `executor` is no executor, for instance a Dask client itself; `function` cannot be
        called; or, with a file, function or points hold what cannot be pickled, a result is no
        number or array of numbers, or not of the type and shape of those before it, or `about`
        holds what HDF5 does not take.
    ValueError
        If the file is that of another sweep, with other points, another function, other
        attributes, or another version of this package; if it is damaged, or no such file, or
        cannot be written; or if another sweep uses it.
    ImportError
        If there is a file to write and no h5py.

    Notes
    -----
    A task is one point, or as many as make `TASKS` tasks of all. A worker holds its task's
    points and results, and what the function takes. An error of the function ends the sweep.

    The file holds the datasets `points` (as numbers, or else as text), `results`, and `done`,
    which is 0 where there is no result, and else the result's checksum: one that is damaged is
    computed again. The file belongs to these points, with their types and last bits, and to
    this function, with all values that it holds and uses. Functions and classes count as what
    they do. Only what is installed counts by its name.

    A pool of processes starts them by `spawn`, because a forked process may hang where the
    parent had threads. They end when the parent is killed. The program that makes one
    starts under ``if __name__ == "__main__":``.

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
    if not callable(function):
        raise TypeError(f"function must be callable, got {function!r}")
    given = list(points)
    kept = None if store is None or not given else opened(store, function, given, about or {})
    with kept or nullcontext() as file:
        found: dict[int, Any] = file.found() if file else {}
        left = [i for i in range(len(given)) if i not in found]
        said = begin = time.monotonic()
        for part, values in _computed(function, given, left, executor):
            found.update(zip(part, file.write(part, values) if file else values, strict=True))
            if progress:
                missing = len(given) - len(found)
                seconds = (time.monotonic() - begin) / (len(left) - missing) * missing
                said = _say(
                    f"{len(found)} of {len(given)}, {seconds:.0f} s left", missing, said
                )
    return [found[i] for i in range(len(given))]


def _say(line: str, missing: int, said: float) -> float:
    """Say how far a sweep is; return when something was said last."""
    now, here = time.monotonic(), type(sys.stderr).__module__
    rewritten = sys.stderr.isatty() or here.startswith("ipykernel")
    if not rewritten and missing and now - said < _BETWEEN_LINES:
        return said
    end = "\r" if rewritten and missing else "\n"
    print(f"{line:<40}" if rewritten else line, end=end, file=sys.stderr, flush=True)
    return now


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
        executor.submit(_several, function, [points[i] for i in part], os.getpid()): part
        for part in parts
    }
    try:
        for future in as_completed(list(running)):
            yield running.pop(future), future.result()
    finally:
        for future in running:
            future.cancel()


def _several(
    function: Callable[[_P], _R], points: list[_P], caller: int | None = None
) -> list[_R]:
    parent = multiprocessing.parent_process()
    if parent is not None and parent.pid == caller:
        _end_with_parent()
    return [function(point) for point in points]


@cache
def _end_with_parent() -> None:
    """End this process when its parent ends: one that is killed leaves its workers behind."""

    def wait() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
