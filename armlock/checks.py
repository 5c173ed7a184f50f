"""Checks of arguments, all with one form of message: name, value, constraint."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from decimal import Decimal
from numbers import Real
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

# Kinds of dtype that are numbers; a timedelta64 counts as one among NumPy's own classes.
_REAL = "iuf"


def _array(name: str, value: object) -> npt.NDArray[Any]:
    """Return `value` as an array, or say that nested lists differ in length."""
    if isinstance(value, np.ma.MaskedArray):
        raise TypeError(f"{name} must be an ordinary array, got a masked array")
    try:
        array = np.asarray(value)
    except ValueError:
        raise ValueError(f"{name} must be a rectangular array, got {value!r}") from None
    if array.dtype.kind in "iufc" and _holds_a_switch(value):
        raise TypeError(f"{name} must hold numbers, got True or False among its values")
    if array.dtype == object and array.size and all(map(_is_exact_number, array.flat)):
        # Fractions, decimals and integers of any length.
        try:
            return array.astype(np.float64)
        except (OverflowError, ValueError):
            raise ValueError(
                f"{name} must be finite and within the range of a float, got {value!r:.60}"
            ) from None
    return array


def _is_exact_number(value: object) -> bool:
    return isinstance(value, Real | Decimal) and not isinstance(value, bool | np.bool_)


def _holds_a_switch(value: object) -> bool:
    """Whether a list holds True or False, which NumPy would take for 1 and 0."""
    if isinstance(value, list | tuple):
        return any(map(_holds_a_switch, value))
    return isinstance(value, bool | np.bool_)


def real_number(name: str, value: object) -> float:
    """Return `value` as a float, or say why it is not a finite real number."""
    array = _array(name, value)
    if np.iscomplexobj(array):
        raise TypeError(f"{name} must be real, got the complex value {value!r}")
    if array.ndim != 0 or array.dtype.kind not in _REAL:
        raise TypeError(f"{name} must be a real number, got {value!r}")
    with np.errstate(over="ignore"):
        number = float(array)
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite, got {number}")
    return number


def positive_number(name: str, value: object) -> float:
    """Return `value` as a finite float above zero, or raise."""
    number = real_number(name, value)
    if number <= 0.0:
        raise ValueError(f"{name} must be positive, got {number}")
    return number


def whole_number(name: str, value: object, lowest: int, highest: int | None = None) -> int:
    """Return a Python or NumPy integer between two bounds, ends included, or raise."""
    end = "on" if highest is None else f"to {highest}"
    if (
        isinstance(value, bool)
        or not isinstance(value, int | np.integer)
        or np.asarray(value).dtype.kind == "m"
        or value < lowest
        or (highest is not None and value > highest)
    ):
        raise ValueError(f"{name} must be an integer from {lowest} {end}, got {value!r}")
    return int(value)


def true_or_false(name: str, value: object) -> bool:
    """Return True or False, or say what was given in its place."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def _floats(name: str, value: object, *, copy: bool) -> FloatArray:
    """Return `value` as a float array of any shape, finite or not, or raise."""
    array = _array(name, value)
    if np.iscomplexobj(array):
        raise TypeError(f"{name} must be real, got complex values (dtype {array.dtype})")
    if array.dtype.kind not in _REAL:
        raise TypeError(f"{name} must hold real numbers, got dtype {array.dtype}")
    with np.errstate(over="ignore"):
        return array.astype(np.float64, copy=copy)


def _require_finite(name: str, array: npt.NDArray[Any]) -> None:
    """Raise where a value is infinite or nan."""
    finite = np.isfinite(array)
    if not finite.all():
        first = array[~finite].ravel()[0]
        raise ValueError(f"{name} must be finite, got {first} among its {array.size} values")


def real_array(name: str, value: object) -> FloatArray:
    """Return `value` as a finite float array of any shape, or raise."""
    array = _floats(name, value, copy=True)
    _require_finite(name, array)
    return array


def complex_array(name: str, value: object) -> ComplexArray:
    """Return `value` as a finite complex array of any shape, or raise."""
    array = _array(name, value)
    if array.dtype.kind not in _REAL + "c":
        raise TypeError(f"{name} must hold numbers, got dtype {array.dtype}")
    with np.errstate(over="ignore"):
        array = np.asarray(array, dtype=np.complex128)
    _require_finite(name, array)
    return array


def finite_series(name: str, value: object) -> FloatArray:
    """Return a one-dimensional array of finite floats; no copy where it is one already."""
    array = _floats(name, value, copy=False)
    if array.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {array.shape}")
    # In parts, so that long series are not doubled in memory.
    for first in range(0, array.size, 1 << 20):
        finite = np.isfinite(array[first : first + (1 << 20)])
        if not finite.all():
            at = first + int(np.argmin(finite))
            raise ValueError(f"{name} must be finite, got {array[at]} at sample {at}")
    return array


def check_memory(name: str, shape: tuple[int, ...], bytes_each: int) -> None:
    """Raise if so many values would take more than half of the machine's memory."""
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        memory = 8 << 30
    needed = math.prod(shape) * bytes_each
    if needed > memory // 2:
        times = " x ".join(str(size) for size in shape)
        raise ValueError(
            f"{name} must be of a size that memory holds, got {times} points: about "
            f"{needed / 2**30:.3g} GiB, with {memory / 2**30:.3g} GiB in the machine"
        )


def broadcast_shape(
    names: tuple[str, ...], arrays: tuple[npt.NDArray[Any], ...]
) -> tuple[int, ...]:
    """Return the shape that arrays broadcast to, or name all shapes and raise."""
    shapes = [array.shape for array in arrays]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ValueError(
            f"{_listed(names)} must broadcast together, got shapes {_listed(shapes)}"
        ) from None


def _listed(items: Sequence[object]) -> str:
    """Return words joined by commas and an and."""
    words = [str(item) for item in items]
    return ", ".join(words[:-1]) + " and " + words[-1]


def broadcast_pair(
    name1: str, value1: object, name2: str, value2: object
) -> tuple[FloatArray, FloatArray]:
    """Return two finite real arrays of one shape, or name both shapes and raise."""
    first, second = real_array(name1, value1), real_array(name2, value2)
    shape = broadcast_shape((name1, name2), (first, second))
    check_memory(f"{name1} and {name2}", shape, 48)
    # Copies, because broadcast views are not to be written to.
    return np.broadcast_to(first, shape).copy(), np.broadcast_to(second, shape).copy()


def axis(name: str, value: object) -> FloatArray:
    """Return a non-empty one-dimensional finite float array, or raise."""
    array = real_array(name, value)
    if array.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {array.shape}")
    if array.size == 0:
        raise ValueError(f"{name} must hold at least one value, got an empty array")
    return array


def even_axis(name: str, value: object, least: int = 2) -> FloatArray:
    """Return an axis whose values ascend in equal steps, or raise."""
    values = axis(name, value)
    if values.size < least:
        raise ValueError(f"{name} must hold at least {least} values, got {values.size}")
    if values.size > 1:
        steps = np.diff(values)
        # Close to the ideal point, rounding is a visible share of a step.
        if not (np.abs(steps - steps.mean()) < 1e-2 * steps.mean()).all():
            raise ValueError(
                f"{name} must ascend in equal steps, got steps from {steps.min()} to "
                f"{steps.max()}"
            )
    return values
