"""Many loops and many points at once, with the reason where one has no result."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, broadcast_shape, real_array
from armlock.compiled import Progress
from armlock.stability.counts import CountError
from armlock.systems import System
from armlock.tables import Shown, Table

_Function = TypeVar("_Function", bound=Callable[..., Any])


@dataclass(frozen=True, eq=False, repr=False)
class Many(Shown):
    """Results of a list of loops, or of arrays of parameters.

    Each number of a single result is an array here, such as ``found.modulus`` of margins, and
    ``found.value`` where a single result is a number. It is nan where there is no result.

    Attributes
    ----------
    results : object array
        The single results, and the error where there is none.

    Examples
    --------
    >>> from armlock import CommonArm, margins
    >>> found = margins([CommonArm(gain) for gain in (0.1, 1.0)], 0.9, [[0.9], [1.2]])
    >>> found.phase_degrees.round(1)
    array([[43.6, 26.4],
           [ nan,  nan]])
    >>> found.reasons[1, 0][:44]
    'loop must be stable, but it has 1 unstable r'
    """

    results: npt.NDArray[Any]

    @property
    def reasons(self) -> Any:
        """Why there is no result: text of the shape of `results`, empty where there is one."""
        return self._each(lambda one: str(one) if isinstance(one, Exception) else "", object)

    def _each(self, of: Callable[[Any], Any], kind: type) -> Any:
        return np.vectorize(of, otypes=[kind])(self.results)

    def __getattr__(self, name: str) -> FloatArray:
        """Return a number of all results."""
        if name.startswith("_") or name == "results":
            raise AttributeError(f"'Many' object has no attribute {name!r}")

        def number(one: Any) -> float:
            failed = isinstance(one, Exception)
            return np.nan if failed else one if name == "value" else getattr(one, name)

        found: FloatArray = self._each(number, float)
        return found

    def _table(self) -> Table:
        """Show how many results there are, and why the first one is missing."""
        missing = [reason for reason in self.reasons.flat if reason]
        rows = [("results", f"{self.results.size - len(missing)} of {self.results.size}")]
        rows += [("no result", reason[:80]) for reason in missing[:1]]
        return Table("Many loops or points", rows)


def many(function: _Function) -> _Function:
    """Let a function take a list of systems and arrays of parameters."""
    name = next(iter(signature(function).parameters))

    @wraps(function)
    def call(*values: Any, **numbers: Any) -> Any:
        first, rest = values[0] if values else numbers.pop(name, None), values[1:]
        loops = first if isinstance(first, list) else [first]
        given: dict[Any, Any] = dict(enumerate(rest)) | numbers
        names = dict(enumerate(System.of(loops[0], name).parameters if loops else ()))
        arrays = {
            place: real_array(names.get(place, str(place)), value)
            for place, value in given.items()
            if isinstance(value, list | tuple | np.ndarray)
        }
        if loops is not first and not any(one.ndim for one in arrays.values()):
            return function(first, *rest, **numbers)
        which = np.arange(len(loops)) if loops is first else np.array(0)
        every = which, *arrays.values()
        shape = broadcast_shape(("the list of loops", *map(str, arrays)), every)

        def single(loop: int, *point: float) -> Any:
            here = given | dict(zip(arrays, map(float, point), strict=True))
            placed = [here.pop(i) for i in range(len(rest))]
            try:
                return function(loops[loop], *placed, **here)
            except (ValueError, CountError) as error:
                return error
            finally:
                progress.update()

        with Progress(math.prod(shape), function.__name__, " points") as progress:
            return Many(np.frompyfunc(single, len(every), 1)(*every))

    return cast("_Function", call)
