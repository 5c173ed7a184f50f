import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from armlock import (
    CharacteristicFunction,
    CommonArm,
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
    positive_number,
    real_array,
    real_number,
    true_or_false,
    whole_number,
)

CONSTRUCTORS = {
    "gain": lambda value: CommonArm(gain=value),
    "tau1": lambda value: CommonArm(tau1=value),
    "tau2": lambda value: CommonArm(tau2=value),
    "tau": lambda value: HayesEquation(tau=value),
    "gain of a single arm": lambda value: SingleArm(gain=value),
    "tau of a single arm": lambda value: SingleArm(tau=value),
    "step": lambda value: spectral_radius(CommonArm(), 1.0, 1.0, value),
    "step of a map": lambda value: semi_discretization(CommonArm(), value),
    "omega_max": lambda value: d_curve_branches(CommonArm(), value),
}

NOT_REAL = [True, np.True_, "1", b"1", None, [1.0], np.array([1.0, 2.0])]


@pytest.mark.parametrize("name", CONSTRUCTORS)
@pytest.mark.parametrize("value", [0.0, -1.0, -1e-300])
def test_what_must_be_positive_is_named_with_its_value(name, value):
    message = f"^{name.split()[0]} must be positive, got {value}$"
    with pytest.raises(ValueError, match=message):
        CONSTRUCTORS[name](value)


@pytest.mark.parametrize("name", CONSTRUCTORS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_must_be_finite_is_named_with_its_value(name, value):
    with pytest.raises(ValueError, match=f"^{name.split()[0]} must be finite, got {value}$"):
        CONSTRUCTORS[name](value)


@pytest.mark.parametrize("name", CONSTRUCTORS)
@pytest.mark.parametrize("value", NOT_REAL, ids=repr)
def test_what_must_be_a_number_is_named_with_its_value(name, value):
    message = f"^{name.split()[0]} must be a real number, got {re.escape(repr(value))}$"
    with pytest.raises(TypeError, match=message):
        CONSTRUCTORS[name](value)


@pytest.mark.parametrize("name", CONSTRUCTORS)
def test_a_complex_number_is_refused_even_with_imaginary_part_zero(name):
    message = rf"^{name.split()[0]} must be real, got the complex value \(1\+0j\)$"
    with pytest.raises(TypeError, match=message):
        CONSTRUCTORS[name](1.0 + 0.0j)


EVALUATIONS = {
    "c1 of unstable_roots": lambda value: unstable_roots(CommonArm(), value, 1.0),
    "c2 of unstable_roots": lambda value: unstable_roots(CommonArm(), 1.0, value),
    "c1 of rightmost_root": lambda value: rightmost_root(CommonArm(), value, 1.0),
    "c2 of rightmost_root": lambda value: rightmost_root(CommonArm(), 1.0, value),
    "c1 of spectral_radius": lambda value: spectral_radius(CommonArm(), value, 1.0, 0.1),
    "c2 of spectral_radius": lambda value: spectral_radius(CommonArm(), 1.0, value, 0.1),
    "c1 of stability_chart": lambda value: stability_chart(CommonArm(), value, [1.0]),
    "c2 of stability_chart": lambda value: stability_chart(CommonArm(), [1.0], value),
    "a of unstable_roots": lambda value: unstable_roots(HayesEquation(), value, 1.0),
    "omega of d_curve": lambda value: d_curve(CommonArm(), value),
}


@pytest.mark.parametrize("name", EVALUATIONS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_arrays_must_be_finite(name, bad):
    message = f"^{name.split()[0]} must be finite, got {bad} among its 3 values$"
    with pytest.raises(ValueError, match=message):
        EVALUATIONS[name]([0.0, bad, 1.0])


@pytest.mark.parametrize("name", EVALUATIONS)
def test_arrays_must_be_real(name):
    message = rf"^{name.split()[0]} must be real, got complex values \(dtype complex128\)$"
    with pytest.raises(TypeError, match=message):
        EVALUATIONS[name]([0.5 + 0j, 1j])


@pytest.mark.parametrize("name", EVALUATIONS)
@pytest.mark.parametrize(
    ("value", "dtype"),
    [([True, False], "bool"), (["1.0"], "<U3"), (None, "object"), ([None, 1.0], "object")],
)
def test_arrays_must_hold_numbers(name, value, dtype):
    message = f"^{name.split()[0]} must hold real numbers, got dtype {dtype}$"
    with pytest.raises(TypeError, match=message):
        EVALUATIONS[name](value)


@pytest.mark.parametrize("name", EVALUATIONS)
def test_ragged_lists_are_refused_by_name(name):
    with pytest.raises(ValueError, match=f"^{name.split()[0]} must be a rectangular array"):
        EVALUATIONS[name]([[1.0], [1.0, 2.0]])


@pytest.mark.parametrize("function", [unstable_roots, rightmost_root])
def test_shapes_that_do_not_broadcast_are_both_named(function):
    message = r"^c1 and c2 must broadcast together, got shapes \(2,\) and \(3,\)$"
    with pytest.raises(ValueError, match=message):
        function(CommonArm(), [1.0, 2.0], [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match=r"^a and b must broadcast together"):
        function(HayesEquation(), np.zeros((2, 2)), np.zeros(3))


def test_shapes_that_do_not_broadcast_are_named_by_spectral_radius():
    message = r"^c1 and c2 must broadcast together, got shapes \(2,\) and \(3,\)$"
    with pytest.raises(ValueError, match=message):
        spectral_radius(CommonArm(), [1.0, 2.0], [1.0, 2.0, 3.0], 0.1)


@pytest.mark.parametrize("empty", [[], np.empty(0), ()])
def test_an_empty_grid_is_refused(empty):
    with pytest.raises(ValueError, match=r"^c1 must hold at least one value, got an empty"):
        stability_chart(CommonArm(), empty, [1.0])
    with pytest.raises(ValueError, match=r"^c2 must hold at least one value, got an empty"):
        stability_chart(CommonArm(), [1.0], empty)


def test_axes_of_a_chart_must_be_one_dimensional():
    with pytest.raises(ValueError, match=r"^c1 must be one-dimensional, got shape \(2, 2\)$"):
        stability_chart(CommonArm(), np.eye(2), [1.0])
    with pytest.raises(ValueError, match=r"^c2 must be one-dimensional, got shape \(\)$"):
        stability_chart(CommonArm(), [1.0], 1.0)


def test_equal_delays_are_refused_where_the_theory_needs_a_difference():
    arms = CommonArm(tau1=20.0, tau2=20.0)
    for function in (d_curve, d_curve_branches):
        with pytest.raises(ValueError, match=r"^delay1 and delay2 must differ, got 20\.0"):
            function(arms, 1.0)


def test_a_parameter_without_effect_leaves_no_d_curve():
    with pytest.raises(ValueError, match=r"SingleArm\(.*\) does not depend on c2"):
        d_curve(SingleArm(), 1.0)


@pytest.mark.parametrize("function", [spectral_radius, transition_matrix])
def test_a_step_must_divide_both_delays(function):
    message = r"^step must divide every delay, got step=0\.2 for delay1=20\.1 \(100\.5 steps\)$"
    with pytest.raises(ValueError, match=message):
        function(CommonArm(), 1.0, 1.0, 0.2)
    with pytest.raises(ValueError, match=r"got step=30\.0 for delay1=20\.1"):
        function(CommonArm(), 1.0, 1.0, 30.0)
    with pytest.raises(ValueError, match=r"got step=0\.1 for delay2=19\.95"):
        function(CommonArm(tau2=19.95), 1.0, 1.0, 0.1)


@pytest.mark.parametrize("order", [2, -1, 0.5, "0", None, True, [0, 1]])
def test_the_order_must_be_zero_or_one(order):
    message = f"^order must be 0 or 1, got {re.escape(repr(order))}$"
    for function in (spectral_radius, transition_matrix):
        with pytest.raises(ValueError, match=message):
            function(CommonArm(), 1.0, 1.0, 0.1, order)
    with pytest.raises(ValueError, match=message):
        semi_discretization(CommonArm(), 0.1, order)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_transition_matrix_needs_finite_parameters(value):
    with pytest.raises(ValueError, match=f"^c1 must be finite, got {value}$"):
        transition_matrix(CommonArm(), value, 1.0, 0.1)
    with pytest.raises(ValueError, match=f"^c2 must be finite, got {value}$"):
        transition_matrix(CommonArm(), 1.0, value, 0.1)


@pytest.mark.parametrize("value", ["1", None, True, [1.0]])
def test_a_transition_matrix_needs_single_numbers(value):
    with pytest.raises(TypeError, match=r"^c2 must be a real number, got "):
        transition_matrix(CommonArm(), 1.0, value, 0.1)


def test_semi_discretization_is_for_retarded_loops_in_continuous_time():
    neutral = CharacteristicFunction([1.0, 1.0], [0.0, 0.3], [0.1], 1.0, 2.0)
    with pytest.raises(ValueError, match=r"^system must be of retarded type"):
        spectral_radius(neutral, 0.1, 0.1, 0.1)
    sampled = semi_discretization(CommonArm(), 0.1)
    message = r"^system must be in continuous time, got a map with step 0\.1$"
    with pytest.raises(ValueError, match=message):
        spectral_radius(sampled, 0.1, 0.1, 0.1)
    with pytest.raises(ValueError, match=message):
        rightmost_root(sampled, 0.1, 0.1)


def test_a_map_needs_both_parameters_before_a_delay():
    with pytest.raises(ValueError, match=r"^the free parameter a of HayesEquation\(tau=1\.0\)"):
        semi_discretization(HayesEquation(), 0.1)


def test_the_checks_return_plain_floats():
    assert real_number("x", np.float32(0.5)) == 0.5
    assert type(real_number("x", np.int64(3))) is float
    assert type(positive_number("x", np.array(2))) is float
    assert real_array("x", [1, 2]).dtype == np.float64
    assert axis("x", range(3)).tolist() == [0.0, 1.0, 2.0]


def test_broadcasting_gives_one_shape():
    first, second = broadcast_pair("x", [[1], [2]], "y", [1, 2, 3])
    assert first.shape == second.shape == (2, 3)


def test_a_number_too_large_for_a_float_is_refused_by_name():
    with pytest.raises((TypeError, ValueError), match=r"^gain must be"):
        CommonArm(gain=10**400)
    with pytest.raises((TypeError, ValueError), match=r"^c1 must"):
        unstable_roots(CommonArm(), 10**400, 1.0)


def test_durations_and_masked_arrays_are_not_numbers():
    with pytest.raises(TypeError, match=r"^x must hold real numbers, got dtype timedelta64"):
        real_array("x", np.array([1, 2], dtype="m8[s]"))
    with pytest.raises(TypeError, match=r"^x must be a real number, got np.timedelta64"):
        real_number("x", np.timedelta64(3, "s"))
    masked = np.ma.masked_array([1.0, 2.0], mask=[True, False])
    for check in (real_array, real_number, axis):
        with pytest.raises(
            TypeError, match=r"^x must be an ordinary array, got a masked array$"
        ):
            check("x", masked)


@pytest.mark.parametrize("value", [True, 1.0, 0, 6, "3", None, np.timedelta64(3, "s")])
def test_whole_numbers_are_python_or_numpy_integers(value):
    message = rf"^n must be an integer from 1 to 5, got {re.escape(repr(value))}$"
    with pytest.raises(ValueError, match=message):
        whole_number("n", value, 1, 5)
    assert type(whole_number("n", np.uint8(3), 1)) is int
    with pytest.raises(ValueError, match=r"^n must be an integer from 1 on, got 0$"):
        whole_number("n", 0, 1)


@pytest.mark.parametrize("value", ["no", 1, None, np.array([True])])
def test_a_switch_is_true_or_false(value):
    with pytest.raises(
        TypeError, match=rf"^x must be True or False, got {re.escape(repr(value))}$"
    ):
        true_or_false("x", value)
    assert true_or_false("x", np.True_) is True


def test_an_even_axis_ascends_in_equal_steps():
    assert even_axis("x", 1.0 + np.linspace(-1e-9, 1e-9, 200)).size == 200
    assert even_axis("x", [3], least=1).tolist() == [3.0]
    for values in ([1.0, 0.0, -1.0], [0.0, 1.0, 1.0], [0.0, 1.0, 10.0], [2.0, 2.0]):
        with pytest.raises(ValueError, match=r"^x must ascend in equal steps, got steps from "):
            even_axis("x", values)
    with pytest.raises(ValueError, match=r"^x must hold at least 2 values, got 1$"):
        even_axis("x", [1.0])


@pytest.mark.parametrize("value", [Fraction(1, 2), Decimal("0.5"), np.float32(0.5)])
def test_exact_numbers_are_numbers(value):
    assert real_number("x", value) == 0.5
    assert real_array("x", [value, 1]).tolist() == [0.5, 1.0]
    assert complex_array("x", value)[()] == 0.5
    assert CommonArm(gain=value).gain == 0.5


def test_an_integer_of_any_length_is_a_number():
    assert real_number("x", 10**30) == 1e30
    assert real_array("x", [10**30, 1]).tolist() == [1e30, 1.0]
    with pytest.raises(ValueError, match=r"^x must be finite and within the range of a float"):
        real_number("x", 10**400)
    with pytest.raises(ValueError, match=r"^x must be finite, got inf$"):
        real_number("x", np.longdouble("1e400"))
    with pytest.raises(ValueError, match=r"^x must be finite, got nan$"):
        real_number("x", Decimal("nan"))


@pytest.mark.parametrize("value", [[True, 1.0], [1.0, np.False_], [[1.0], [True]], (2, True)])
def test_true_and_false_do_not_hide_among_numbers(value):
    for check in (real_array, complex_array):
        with pytest.raises(TypeError, match=r"^x must hold numbers, got True or False among"):
            check("x", value)


def test_masked_arrays_are_refused_wherever_an_array_enters():
    masked = np.ma.masked_array([0.9, 99.0], mask=[False, True])
    for name, function in EVALUATIONS.items():
        with pytest.raises(TypeError, match=f"^{name.split()[0]} must be an ordinary array"):
            function(masked)
    with pytest.raises(TypeError, match=r"^s must be an ordinary array"):
        CommonArm()(masked, 1.0, 1.0)


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        ("1", TypeError, "^s must hold numbers, got dtype <U1$"),
        (None, TypeError, "^s must hold numbers, got dtype object$"),
        (True, TypeError, "^s must hold numbers, got dtype bool$"),
        (
            np.timedelta64(3, "s"),
            TypeError,
            r"^s must hold numbers, got dtype timedelta64\[s\]$",
        ),
        (np.datetime64("2020"), TypeError, r"^s must hold numbers, got dtype datetime64\[Y\]$"),
        ([1.0, complex("nan")], ValueError, r"^s must be finite, got \(nan\+0j\) among its 2"),
        ([[1.0], [1.0, 2.0]], ValueError, "^s must be a rectangular array"),
    ],
)
def test_complex_arrays_hold_finite_numbers(value, error, message):
    with pytest.raises(error, match=message):
        complex_array("s", value)


def test_dates_are_not_numbers():
    for check in (real_number, real_array):
        with pytest.raises(
            TypeError, match=r"^x must (be a real number|hold real numbers), got"
        ):
            check("x", np.datetime64("2020-01-01"))


def test_what_memory_does_not_hold_is_refused():
    check_memory("x", (1000, 1000), 8)
    with pytest.raises(
        ValueError, match=r"^x must be of a size that memory holds, got 10000000 x"
    ):
        check_memory("x", (10_000_000, 10_000_000), 8)
