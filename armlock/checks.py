"""Checks of arguments, all with one form of message: name, constraint, value."""

from __future__ import annotations

import math
import os
from collections.abc import Collection
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

# Kinds of dtype that are real numbers: integers, unsigned integers and floats.
_REAL = "iuf"
# Of the machine's memory, the share that one request may take.
_MEMORY_SHARE = 0.5
# How far a delay may be from a whole number of steps: as a share of the delay, and of a step.
_OFF_A_DELAY, _OFF_A_STEP = 1e-9, 1e-3


def real_number(name: str, value: object) -> float:
    """Return `value` as a float, or say why it is not a finite real number."""
    if type(value) is float and math.isfinite(value):
        return value
    array = _numbers(name, value, _REAL)
    if array.ndim != 0:
        raise TypeError(f"{name} must be a real number, got {value!r}")
    return float(array)


def positive_number(name: str, value: object) -> float:
    """Return `value` as a finite float above zero, or raise."""
    number = real_number(name, value)
    if number <= 0.0:
        raise ValueError(f"{name} must be positive, got {number}")
    return number


def not_negative(name: str, value: object) -> float:
    """Return `value` as a finite float that is zero or positive, or raise."""
    number = real_number(name, value)
    if number < 0.0:
        raise ValueError(f"{name} must not be negative, got {number}")
    return number


def whole_number(name: str, value: object, lowest: int) -> int:
    """Return a Python or NumPy integer that is no smaller than a bound, or raise."""
    # A time span of NumPy is one of its integers.
    if (
        isinstance(value, bool | np.timedelta64)
        or not isinstance(value, int | np.integer)
        or value < lowest
    ):
        raise ValueError(f"{name} must be an integer of at least {lowest}, got {value!r}")
    return int(value)


def true_or_false(name: str, value: object) -> bool:
    """Return a Python or NumPy truth value, or raise."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def one_of(name: str, value: object, allowed: Collection[str]) -> str:
    """Return a text that is one of those allowed, or raise."""
    if not isinstance(value, str) or value not in allowed:
        options = ", ".join(map(repr, allowed))
        raise ValueError(f"{name} must be one of {options}; got {value!r}")
    return value


def whole_steps(name: str, delay: float, step: float) -> int:
    """Return delay / step, or raise if it is not a whole number (apart from rounding)."""
    steps = delay / step
    allowed = min(_OFF_A_DELAY * steps, _OFF_A_STEP)
    if not steps < 1e15 or abs(steps - round(steps)) > allowed:
        raise ValueError(
            f"step must divide every delay, got step={step} for {name}={delay} "
            f"({steps:g} steps)"
        )
    return round(steps)


def real_array(name: str, value: object) -> FloatArray:
    """Return a copy of `value` as a finite float array of any shape, or raise."""
    return _numbers(name, value, _REAL).astype(np.float64)


def positive_array(name: str, value: object) -> FloatArray:
    """Return a copy of `value` as a finite float array above zero, of any shape, or raise."""
    array = real_array(name, value)
    if (array <= 0.0).any():
        raise ValueError(f"{name} must be positive, got {array.min()} among its values")
    return array


def complex_array(name: str, value: object) -> ComplexArray:
    """Return `value` as a finite complex array of any shape, or raise."""
    return _numbers(name, value, _REAL + "c").astype(np.complex128, copy=False)


def axis(name: str, value: object) -> FloatArray:
    """Return a copy of `value` as a one-dimensional finite float array, or raise."""
    array = finite_series(name, value)
    if array.size == 0:
        raise ValueError(f"{name} must hold at least one value, got 0")
    return array.copy()


def finite_series(name: str, value: object, *dimensions: int) -> FloatArray:
    """Return a finite float array of one dimension, or of those given; it is not copied."""
    array = _numbers(name, value, _REAL).astype(np.float64, copy=False)
    allowed = dimensions or (1,)
    if array.ndim not in allowed:
        many = " or ".join(map(str, allowed))
        raise ValueError(f"{name} must be of dimension {many}, got shape {array.shape}")
    return array


def broadcast_shape(
    names: tuple[str, ...], arrays: tuple[npt.NDArray[Any], ...]
) -> tuple[int, ...]:
    """Return the shape that arrays broadcast to, or name all shapes and raise."""
    shapes = [array.shape for array in arrays]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        listed = " and ".join(map(str, shapes))
        raise ValueError(
            f"{' and '.join(names)} must broadcast together, got shapes {listed}"
        ) from None


def check_memory(name: str, shape: tuple[int, ...], bytes_each: int) -> None:
    """Raise if so many values would take more than a share of the machine's memory."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    # Python's integers may be larger than any float.
    needed = math.prod(float(min(size, 10**300)) for size in shape) * bytes_each
    if needed > _MEMORY_SHARE * memory:
        times = " x ".join(str(size) for size in shape)
        raise ValueError(
            f"{name} must be of a size that memory holds, got {times} points: about "
            f"{needed / 2**30:.3g} GiB, with {memory / 2**30:.3g} GiB in the machine"
        )


def _numbers(name: str, value: object, kinds: str) -> npt.NDArray[Any]:
    """Return `value` as an array of finite numbers of some kinds of dtype, or raise."""
    parts = (value, *value) if isinstance(value, list | tuple) else (value,)
    if any(map(np.ma.isMaskedArray, parts)):
        raise TypeError(
            f"{name} must hold no masked values, got a masked array: take its compressed() or "
            f"filled() values"
        )
    try:
        array = np.asarray(value)
    except ValueError:
        raise ValueError(f"{name} must be a rectangular array, got {value!r}") from None
    if array.dtype.kind not in kinds:
        what = "real numbers" if kinds == _REAL else "numbers"
        if isinstance(value, int):
            raise ValueError(f"{name} must be at most 1.8e308 in size, got a larger number")
        is_object = array.dtype.kind == "O" and array.size
        got = f"a {type(array.flat[0]).__name__}" if is_object else f"dtype {array.dtype}"
        raise TypeError(f"{name} must hold {what}, got {got}")
    finite = np.isfinite(array)
    if not finite.all():
        first = tuple(int(at) for at in np.argwhere(~finite)[0])
        place = f" at index {', '.join(map(str, first))}" if first else ""
        raise ValueError(f"{name} must be finite, got {array[first]}{place}")
    return array
