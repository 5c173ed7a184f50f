"""Values at any s: against many digits, at poles, and next to where terms cancel."""

import numpy as np
import pytest
from flint import acb, ctx

from armlock import (
    CommonArm,
    Controller,
    DualArm,
    buildable_loop,
    delay,
    flight_loop,
    paper_loop,
    parameter,
    s,
)
from armlock.engine import values

LOOPS = [CommonArm(), DualArm(0.5), paper_loop(), flight_loop(), buildable_loop()]


def exact(system, at, *point):
    """N / M with 2000 bits, without the factors."""
    n, m = system.functions(point)
    before, ctx.prec = ctx.prec, 2000
    try:
        z = acb(at.real, at.imag)
        return complex(n.taylor(z, 1)[0] / m.taylor(z, 1)[0])
    finally:
        ctx.prec = before


@pytest.mark.parametrize("loop", LOOPS, ids=range(5))
def test_a_value_is_right_within_the_bound_that_comes_with_it(loop):
    rng = np.random.default_rng(1)
    z = 1j * 10.0 ** rng.uniform(-7, 5, 300) + 0.05 * rng.normal(size=300)
    c1 = 1.0 + rng.choice([0.0, 1e-12, 1e-3, 1.0], 300) * rng.normal(size=300)
    found, errors = loop.values(z, [c1, 1.0])
    for at, x, value, error in zip(z.tolist(), c1.tolist(), found, errors, strict=True):
        assert abs(value - exact(loop, at, x, 1.0)) <= error


def test_where_terms_cancel_balls_are_taken(monkeypatch):
    average = (1 - delay(1.0)) / s
    system, at = (1 - average) ** 2 / s**2, 1e-6j
    assert complex(system(at)) == pytest.approx(exact(system, at), rel=1e-14)
    monkeypatch.setattr(values, "_MAY_LOSE", np.inf)
    assert abs(complex(system(at)) / exact(system, at) - 1.0) > 1e-6


def test_a_pole_is_infinite_and_what_cancels_has_its_limit():
    loop = Controller([-1.0], [0.0, -2.0], 3.0)
    assert np.isinf(loop([0.0, -2.0, 1.0])).tolist() == [True, True, False]
    assert CommonArm()(0.0) == pytest.approx(40.0)
    assert ((s - 1) / ((s - 1) * (s + 1)))(1.0) == pytest.approx(0.5)
    nothing = 1 / (s + 1) - 1 / (s + 1)
    assert nothing(3j) == 0.0
    assert nothing([1j, 3j]).tolist() == (delay(1.0) * parameter("k"))([1j, 3j], 0.0).tolist()


def test_products_of_parameters_are_put_in_first():
    a, b = parameter("a"), parameter("b")
    system = a * b * delay(0.3) / (s + a)
    z, x, y = np.array([1j, 2j, 3j]), np.array([1.0, 2.0, 1.0]), 0.5
    expected = x * y * np.exp(-0.3 * z) / (z + x)
    assert system(z, x, y) == pytest.approx(expected, rel=1e-14)
    assert system(z[0], 1.0, 0.5) == pytest.approx(expected[0], rel=1e-14)


@pytest.mark.parametrize("loop", LOOPS, ids=range(5))
def test_a_step_of_newtons_method_is_the_function_over_its_derivative(loop):
    n, m = loop.functions((1.0, 0.9))
    step = values.newton(n + m)
    z = np.array([0.01 + 0.3j, -0.02 + 2e-3j])
    for at, found in zip(z.tolist(), step.roughly(z, (1.0,))[0], strict=True):
        value, slope = (n + m).taylor(acb(at.real, at.imag), 2)
        assert found == pytest.approx(complex(value / slope), rel=1e-9)
        assert step.roughly(at, (1.0,))[0] == pytest.approx(found, rel=1e-12)
