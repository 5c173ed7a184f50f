"""Many loops and many points at once, with the reason where one has no result."""

from __future__ import annotations

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
from armlock.tables import Shown, Table, spread

_Function = TypeVar("_Function", bound=Callable[..., Any])


@dataclass(frozen=True, eq=False, repr=False)
class Many(Shown):
    """Results of a list of loops, or of arrays of parameters.

    Each number of a single result is an array here, such as ``found.modulus`` of margins, and
    ``found.value`` where a single result is a number. It is nan where there is no result.

    Attributes
    ----------
    results : object array
        The single results, and None where there is none.
    reasons : object array of str
        Why there is none, of the same shape; empty where there is one.

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

    results: npt.NDArray[np.object_]
    reasons: npt.NDArray[np.object_]

    def __getattr__(self, name: str) -> FloatArray:
        """Return a number of all results."""
        if name.startswith("_") or name in ("results", "reasons"):
            raise AttributeError(f"'Many' object has no attribute {name!r}")
        single = (one if name == "value" else getattr(one, name) for one in self._found())
        found = np.full(self.results.shape, np.nan)
        found[self.reasons == ""] = np.fromiter(single, float)
        return found

    def _found(self) -> list[Any]:
        """Return the single results that there are."""
        return [one for one in self.results.flat if one is not None]

    def _table(self) -> Table:
        """Show how many results there are, between which numbers, and a reason."""
        found = self._found()
        rows = [("results", f"{len(found)} of {self.results.size}")]
        if found:
            one: Any = {"value": found[0]} if isinstance(found[0], float) else found[0]
            one = one if isinstance(one, dict) else getattr(one, "_asdict", lambda: vars(one))()
            for name in (name for name, value in one.items() if isinstance(value, float)):
                values = getattr(self, name)
                rows.append((name, spread(values[~np.isnan(values)])))
        rows += [("no result", str(reason)[:80]) for reason in self.reasons.flat if reason][:1]
        return Table("Many loops or points", rows)


def many(*, points: bool = True) -> Callable[[_Function], _Function]:
    """Let a function take a list of systems and, with `points`, arrays of parameters."""

    def decorate(function: _Function) -> _Function:
        name = next(iter(signature(function).parameters))

        @wraps(function)
        def call(*values: Any, **numbers: Any) -> Any:
            first, *values_left = values or (numbers.pop(name, None),)
            return each(first, values_left, numbers)

        def each(first: Any, values: list[Any], numbers: dict[str, Any]) -> Any:
            loops = first if isinstance(first, list) else [first]
            given: dict[Any, Any] = dict(enumerate(values)) | numbers
            arrays = _arrays(name, loops, given) if points else {}
            if loops is not first and not any(one.ndim for one in arrays.values()):
                return function(first, *values, **numbers)
            which = np.arange(len(loops)) if loops is first else np.array(0)
            names = ("the list of loops", *map(str, arrays))
            shape = broadcast_shape(names, (which, *arrays.values()))
            every: Any = np.broadcast_arrays(which, *arrays.values(), np.empty(shape))
            results, reasons = np.full(shape, None, object), np.full(shape, "", object)
            with Progress(results.size, function.__name__, " points") as progress:
                for k in np.ndindex(shape):
                    point = given | {
                        place: float(one[k])
                        for place, one in zip(arrays, every[1:], strict=False)
                    }
                    here = [point.pop(i) for i in range(len(values))]
                    try:
                        results[k] = function(loops[every[0][k]], *here, **point)
                    except (ValueError, CountError) as error:
                        reasons[k] = str(error)
                    progress.update()
            return Many(results, reasons)

        return cast("_Function", call)

    return decorate


def _arrays(name: str, loops: list[Any], given: dict[Any, Any]) -> dict[Any, FloatArray]:
    """Return what is given as a list or an array, by name or place, or raise."""
    names = System.of(loops[0], name).parameters if loops else ()
    return {
        place: real_array(names[place] if place in range(len(names)) else str(place), value)
        for place, value in given.items()
        if isinstance(value, list | tuple | np.ndarray)
    }
