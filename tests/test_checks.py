import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from armlock import (
    CharacteristicFunction,
    CommonArm,
    Controller,
    HayesEquation,
    SingleArm,
    d_curve,
    d_curve_branches,
    rightmost_root,
    semi_discretization,
    spectral_radius,
    stability_chart,
    transition_matrix,
    unstable_roots,
)
from armlock.checks import (
    axis,
    broadcast_pair,
    check_memory,
    complex_array,
    even_axis,
    finite_series,
    positive_number,
    real_array,
    real_number,
    true_or_false,
    whole_number,
)

# What is wrong with a number and with an array: the value, the error, and what it says after
# the argument's name.
NUMBERS: list[tuple[Any, type[Exception], str]] = [
    (True, TypeError, "must be a real number, got True"),
    ("1", TypeError, "must be a real number, got '1'"),
    (None, TypeError, "must be a real number, got None"),
    ([1.0], TypeError, "must be a real number, got [1.0]"),
    (1 + 0j, TypeError, "must be a real number, got (1+0j)"),
    ([[1.0], [1.0, 2.0]], ValueError, "must be a rectangular array, got [[1.0], [1.0, 2.0]]"),
    (np.inf, ValueError, "must be finite, got inf"),
]
ARRAYS: list[tuple[Any, type[Exception], str]] = [
    ([True, False], TypeError, "must hold real numbers, got dtype bool"),
    (["1.0"], TypeError, "must hold real numbers, got dtype <U3"),
    ([None, 1.0], TypeError, "must hold real numbers, got dtype object"),
    ([0.5, 1j], TypeError, "must hold real numbers, got dtype complex128"),
    ([[1.0], [1.0, 2.0]], ValueError, "must be a rectangular array, got [[1.0], [1.0, 2.0]]"),
    ([0.0, np.nan, 1.0], ValueError, "must be finite, got nan at index 1"),
]


def exactly(name, message):
    return f"^{re.escape(f'{name} {message}')}$"


@pytest.mark.parametrize(("value", "error", "message"), NUMBERS)
def test_what_is_no_number_is_refused_by_name(value, error, message):
    for check in (real_number, positive_number):
        with pytest.raises(error, match=exactly("x", message)):
            check("x", value)


@pytest.mark.parametrize(("value", "error", "message"), ARRAYS)
def test_what_is_no_array_of_numbers_is_refused_by_name(value, error, message):
    for check in (real_array, axis, finite_series):
        with pytest.raises(error, match=exactly("x", message)):
            check("x", value)
    if 1j not in value:
        with pytest.raises(error, match=exactly("x", message.replace("real ", ""))):
            complex_array("x", value)


def test_the_checks_return_floats_in_arrays_of_their_own():
    given = np.array([1.0, 2.0])
    for check in (real_array, axis):
        check("x", given)[0] = 7.0
    assert given[0] == 1.0
    assert finite_series("x", given) is given
    assert type(real_number("x", np.int64(3))) is float
    assert type(positive_number("x", np.array(2))) is float
    assert axis("x", range(3)).tolist() == [0.0, 1.0, 2.0]
    assert complex_array("x", 1)[()] == 1 + 0j
    assert finite_series("x", []).size == 0


@pytest.mark.parametrize("value", [True, 1.0, 0, 6, "3", None])
def test_whole_numbers_are_python_or_numpy_integers(value):
    message = exactly("n", f"must be an integer from 1 to 5, got {value!r}")
    with pytest.raises(ValueError, match=message):
        whole_number("n", value, 1, 5)
    assert type(whole_number("n", np.uint8(3), 1)) is int
    with pytest.raises(ValueError, match=r"^n must be an integer from 1 on, got 0$"):
        whole_number("n", 0, 1)


def test_a_word_is_not_taken_for_true():
    with pytest.raises(TypeError, match=r"^x must be True or False, got 'no'$"):
        true_or_false("x", "no")
    assert true_or_false("x", np.True_) is True


def test_an_axis_has_one_dimension_and_values():
    with pytest.raises(ValueError, match=r"^x must be one-dimensional, got shape \(2, 2\)$"):
        axis("x", np.eye(2))
    with pytest.raises(ValueError, match=r"^x must hold at least one value, got 0$"):
        axis("x", [])


def test_an_even_axis_ascends_in_equal_steps():
    assert even_axis("x", 1.0 + np.linspace(-1e-9, 1e-9, 200)).size == 200
    assert even_axis("x", [3], least=1).tolist() == [3.0]
    for values in ([1.0, 0.0, -1.0], [0.0, 1.0, 1.0], [0.0, 1.0, 10.0], [2.0, 2.0]):
        with pytest.raises(ValueError, match=r"^x must ascend in equal steps, got steps from "):
            even_axis("x", values)
    with pytest.raises(ValueError, match=r"^x must hold at least 2 values, got 1$"):
        even_axis("x", [1.0])


def test_arrays_broadcast_to_one_shape_or_are_refused():
    first, second = broadcast_pair("x", [[1], [2]], "y", [1, 2, 3])
    assert first.shape == second.shape == (2, 3)
    with pytest.raises(
        ValueError, match=r"^x and y must broadcast together, got shapes \(2,\) and \(3,\)$"
    ):
        broadcast_pair("x", [1.0, 2.0], "y", [1.0, 2.0, 3.0])


def test_what_memory_does_not_hold_is_refused():
    check_memory("x", (1000, 1000), 8)
    message = r"^x must be of a size that memory holds, got 10000000 x 10000000 points: about "
    with pytest.raises(ValueError, match=message):
        check_memory("x", (10_000_000, 10_000_000), 8)


ARMS = CommonArm()
NEUTRAL = CharacteristicFunction([1.0, 1.0], [0.0, 0.3], [0.1], 1.0, 2.0)
# Each argument of the package's functions is checked under its own name.
REFUSED: list[tuple[Callable[..., object], tuple[Any, ...], str]] = [
    (CommonArm, (0.0,), "gain must be positive, got 0.0"),
    (CommonArm, (1.0, -1.0), "tau1 must be positive, got -1.0"),
    (CommonArm, (1.0, 1.0, "1"), "tau2 must be a real number, got '1'"),
    (HayesEquation, (np.nan,), "tau must be finite, got nan"),
    (SingleArm, (-1.0,), "gain must be positive, got -1.0"),
    (SingleArm, (1.0, 0.0), "tau must be positive, got 0.0"),
    (Controller, ((), (0.0,), "1"), "gain must be a real number, got '1'"),
    (ARMS, ("j", 1.0, 1.0), "s must hold numbers, got dtype <U1"),
    (unstable_roots, (ARMS, np.nan, 1), "c1 must be finite, got nan"),
    (unstable_roots, (ARMS, 1, None), "c2 must hold real numbers, got dtype object"),
    (unstable_roots, (HayesEquation(), 1j, 1), "a must hold real numbers, got dtype complex"),
    (unstable_roots, (ARMS, [1, 2], [1, 2, 3]), "c1 and c2 must broadcast together"),
    (rightmost_root, (ARMS, np.inf, 1), "c1 must be finite, got inf"),
    (rightmost_root, (ARMS, 1, True), "c2 must hold real numbers, got dtype bool"),
    (rightmost_root, (ARMS, [1, 2], [1, 2, 3]), "c1 and c2 must broadcast together"),
    (stability_chart, (ARMS, [], [1]), "c1 must hold at least one value, got 0"),
    (stability_chart, (ARMS, [1], 1), "c2 must be one-dimensional, got shape ()"),
    (d_curve, (ARMS, ["1"]), "omega must hold real numbers, got dtype <U1"),
    (d_curve, (SingleArm(), 1), "system must depend on both free parameters"),
    (d_curve, (CommonArm(1, 20, 20), 1), "delay1 and delay2 must differ, got 20.0"),
    (d_curve_branches, (ARMS, 0), "omega_max must be positive, got 0.0"),
    (spectral_radius, (ARMS, 1, [1, np.nan], 0.1), "c2 must be finite, got nan at index 1"),
    (spectral_radius, (ARMS, [1, 2], [1, 2, 3], 0.1), "c1 and c2 must broadcast together"),
    (spectral_radius, (ARMS, 1, 1, 0.2), "step must divide every delay, got step=0.2"),
    (spectral_radius, (ARMS, 1, 1, 0.1, 2), "order must be an integer from 0 to 1, got 2"),
    (spectral_radius, (NEUTRAL, 0, 0, 0.1), "system must be of retarded type"),
    (transition_matrix, (ARMS, 1, [1], 0.1), "c2 must be a real number, got [1]"),
    (transition_matrix, (ARMS, 1, 1, 30), "step must divide every delay"),
    (semi_discretization, (ARMS, 0), "step must be positive, got 0.0"),
    (semi_discretization, (ARMS, 0.1, True), "order must be an integer from 0 to 1, got True"),
]


@pytest.mark.parametrize(("call", "arguments", "message"), REFUSED)
def test_an_argument_is_refused_by_its_name(call, arguments, message):
    with pytest.raises((TypeError, ValueError), match=f"^{re.escape(message)}"):
        call(*arguments)
