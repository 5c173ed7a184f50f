"""Sampled filters and sensors: response, slow and fast poles, hidden modes, covariance."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

from armlock import Controller
from armlock.controllers import table_two
from armlock.sensors import SignalMapping, dual
from armlock.timedomain.discretize import (
    sampled_filter,
    sampled_loop,
    stationary_root,
    through,
    warped,
)
from tests.systems import with_roots

RATE = 200.0
OMEGA = np.geomspace(1e-3, 0.9 * np.pi * RATE, 25)


def filter_response(sampled, omega, rate=RATE):
    change = np.expm1(1j * omega / rate)
    value = np.full(change.shape, sampled.gain, dtype=complex)
    for r1, r2, k, t1, t2 in sampled.sections:
        value *= 1.0 + (t1 * (change - r2) + t2) / ((change - r1) * (change - r2) + k)
    return value


def sensor_response(sampled, omega, rate=RATE):
    """Solve the states' equations, for each of both inputs."""
    rows = np.array(sampled.states)
    matrix = np.eye(len(rows), k=-1)
    matrix[:, -1] -= rows[:, 0]
    values = []
    for change in np.expm1(1j * omega / rate):
        states = np.linalg.solve(change * np.eye(len(rows)) - matrix, rows[:, 1:])
        values.append(states[-1] + sampled.direct)
    return np.array(values).T


def continuous(zeros, poles, gain, mapping, s):
    both = mapping.weights(s)
    return [Controller(zeros, poles, gain)(s) * weight for weight in both]


# Over three decades, as the filters of a sensor with several frequency bands.
CORNERS = -np.array([2e-3, 2e-3, 1.6e-2, 4e-2, 0.3, 0.5, 2.5])

CASES: dict[str, tuple[Any, Any, float, Any]] = {
    "repeated": ((-1.0, -1.0), (-0.3, -0.3, -0.3), 2.0, ((1.0,), (1.0, 2.0), (1.0, 2.0, 1.0))),
    "complex": ((-1 + 2j, -1 - 2j, -3), (-0.1, -0.2 + 1j, -0.2 - 1j), 3.0,
                ((1.0, 2.0, 1.5), (1.0, 0.0, -1.0), (2.0, 1.4, 1.0))),
    "poles in pairs, zeros not": ((-0.1, -2.0, -30.0), (-1 + 9j, -1 - 9j, -0.2 + 1j, -0.2 - 1j),
                                  1.0, ((1.0,), (1.0,), (1.0,))),
    "improper controller": ((-1.0, -2.0), (-3.0,), 0.7,
                            ((1.0,), (2.0, 1.0), (1.0, 1.0, 1.0))),
    "no states": ((), (), 5.0, ((1.0,), (2.0,), (4.0,))),
    "unequal degrees": ((), (0.0,), 2.0, ((1.0,), (0.0,), (1.0,))),
    "many corners": ((0.0,), (-5e-6,), 2.0,
                     [with_roots(*np.multiply(CORNERS, share)) for share in (0.6, 1.4, 1.0)]),
    "the paper's": (table_two().zeros(), table_two().poles(), 1e4,
                    [getattr(dual(2.5, 0.2), name)
                     for name in ("numerator1", "numerator2", "denominator")]),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_response_is_the_continuous_one_at_the_warped_frequency(name):
    zeros, poles, gain, (first, second, below) = CASES[name]
    mapping = SignalMapping(first, second, below, "made up")
    sensor, controller = sampled_loop(Controller(zeros, poles, gain), mapping, RATE)
    found = filter_response(controller, OMEGA) * sensor_response(sensor, OMEGA)
    expected = continuous(zeros, poles, gain, mapping, 1j * warped(OMEGA, RATE))
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-12 * np.abs(other).max())


def test_poles_and_zeros_over_twelve_decades():
    """Twenty-six of them, at the rate that a loop with unity gain at 15 kHz needs."""
    rate = 4e6
    poles = -2.0 * np.pi * np.geomspace(1e-6, 1e6, 26)
    controller = Controller([*(1.7 * poles)], [*poles], 3.0)
    omega = np.geomspace(1e-6, 1e6, 60)
    found = filter_response(sampled_filter([*(1.7 * poles)], [*poles], 3.0, rate), omega, rate)
    expected = controller(1j * warped(omega, rate))
    assert np.abs(found / expected - 1.0).max() < 1e-12


@pytest.mark.parametrize(
    ("zeros", "poles", "polynomials", "number"),
    [
        ((0.0,), (-1.0,), ((1.0,), (1.0,), (0.0, 1.0)), 1),
        ((), (0.0,), ((0.0, 1.0), (0.0, 2.0), (1.0,)), 0),
        ((), (), ((0.0, 1.0), (0.0, 1.0), (0.0, 1.0, 1.0)), 1),
    ],
)
def test_poles_at_zero_that_zeros_cancel_leave_no_state(zeros, poles, polynomials, number):
    first, second, below = polynomials
    mapping = SignalMapping(first, second, below, "made up")
    sensor, controller = sampled_loop(Controller(zeros, poles, 1.0), mapping, RATE)
    states = [row for row in sensor.states if any(row)]
    assert len(states) + controller.order == number


def test_filters_that_have_no_samples_are_refused():
    with pytest.raises(ValueError, match="more zeros than poles: 2 and 1"):
        sampled_filter((-1.0, -2.0), (-3.0,), 1.0, RATE)


@pytest.mark.parametrize(
    ("zeros", "poles"),
    [
        ((), (-2.0, -0.3, -0.01)),
        ((-1 + 2j, -1 - 2j), (-0.4, -0.4)),
        ((-3.0,), (-0.2 + 4j, -0.2 - 4j, -1.0, -5.0)),
    ],
)
def test_stationary_states_have_the_covariance_of_white_noise(zeros, poles):
    sampled = sampled_filter(zeros, poles, 1.0, 10.0)
    root = stationary_root(sampled)
    n = 2 * len(sampled.sections)
    columns = []
    for unit in np.eye(n):
        state = unit.copy()
        through(sampled.sections, state, 0.0)
        columns.append(state)
    drive = np.zeros(n)
    through(sampled.sections, drive, 1.0)
    order = sampled.order
    matrix, drive = np.array(columns).T[:order, :order], drive[:order]
    expected = solve_discrete_lyapunov(matrix, np.outer(drive, drive))
    assert np.array_equal(root, np.tril(root))
    assert root @ root.T == pytest.approx(expected, rel=1e-9)
