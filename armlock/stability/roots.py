"""The characteristic root with the largest real part, of loops, maps and systems with delays.

It is found and certified by `armlock.engine.roots`.
"""

from __future__ import annotations

from typing import overload

import numpy as np
import numpy.typing as npt

from armlock.characteristic import CharacteristicFunction, broadcast_parameters
from armlock.checks import ComplexArray
from armlock.delays import DelaySystem
from armlock.engine.margins import common_zeros
from armlock.engine.roots import RootError, rightmost_zero
from armlock.loops import Loop


@overload
def rightmost_root(
    system: CharacteristicFunction | DelaySystem, x: float | None = None, y: float | None = None
) -> complex: ...


@overload
def rightmost_root(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> ComplexArray: ...


def rightmost_root(
    system: CharacteristicFunction | DelaySystem,
    x: npt.ArrayLike | None = None,
    y: npt.ArrayLike | None = None,
) -> complex | ComplexArray:
    if isinstance(system, DelaySystem):
        if x is not None or y is not None:
            raise TypeError(f"a DelaySystem has no free parameters, got {x!r} and {y!r}")
        n, m = system.functions
        return rightmost_zero(n + m, system.common)
    xs, ys = broadcast_parameters(system, x, y)
    if xs.ndim == 0:
        return _at(system, float(xs), float(ys))
    flat = [_at(system, float(p), float(q)) for p, q in zip(xs.flat, ys.flat, strict=True)]
    return np.array(flat, dtype=np.complex128).reshape(xs.shape)


def _at(system, x, y):
    common = common_zeros(*system.quotient(x, y)) if isinstance(system, Loop) else 0
    return rightmost_zero(system.function(x, y), common)
