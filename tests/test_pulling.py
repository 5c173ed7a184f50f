"""Pulling by an inverse Laplace transform, held against closed forms and against itself."""

import numpy as np
import pytest
from scipy import signal

from armlock import (
    Controller,
    Loop,
    SingleArm,
    paper_loop,
    pulling,
    rightmost_root,
)
from armlock.performance.pulling import largest_pulling
from armlock.sensors import SINGLE, dual
from tests import draws

STEP = (1.0, 0.0, 0.0)


def test_before_the_light_comes_back_the_loop_has_no_delay():
    """Then Y of a single arm is -g / (s + g), and half of that for the sum."""
    time = np.geomspace(1e-3, 19.0, 40).reshape(4, 10)
    found = pulling(SingleArm(0.5, 20.0), time, common=STEP)
    np.testing.assert_allclose(found, -0.5 * (1.0 - np.exp(-0.5 * time)), rtol=1e-3)


@pytest.mark.parametrize(
    "controller",
    [
        Controller([], [-0.05 + 1j, -0.05 - 1j], 0.02),  # a resonance
        Controller([-0.01, -1.0], [-0.001, -10.0], 0.2),  # a lag and a lead
    ],
)
def test_before_the_light_comes_back_a_loop_without_an_integrator_follows_its_controller(
    controller,
):
    """Then Y of a single arm is -K / (1 + K), and half of that for the sum."""
    time = np.linspace(0.0, 32.0, 65)
    above = controller.gain * np.poly(controller.zeros())
    below = np.polyadd(np.poly(controller.poles()), above)
    _, expected = signal.step((above.real, below.real), T=time)
    found = pulling(Loop(controller, SINGLE, 33.0, 33.0), time[1:], common=STEP)
    np.testing.assert_allclose(found, -0.5 * expected[1:], rtol=2e-3, atol=1e-6)


def test_errors_add_up():
    loop, time = paper_loop(), np.array([5e3, 1e4])
    one = pulling(loop, time, common=(1.0, 0.1, 0.0))
    other = pulling(loop, time, common=(0.0, 0.0, 0.0), differential=(0.0, 0.0, 1e-3))
    both = pulling(loop, time, common=(1.0, 0.1, 0.0), differential=(0.0, 0.0, 1e-3))
    np.testing.assert_allclose(both, one + other, rtol=1e-12)


def test_several_errors_are_pulled_as_each_of_them_alone():
    loop, time, errors = paper_loop(), np.array([5e3, 1e4]), np.eye(3)
    found = pulling(loop, time, common=errors, differential=STEP)
    peaks = largest_pulling(loop, common=errors)
    assert found.shape == (3, 2)
    for k, error in enumerate(errors):
        assert (found[k] == pulling(loop, time, common=error, differential=STEP)).all()
    for k in range(draws(1, 3)):
        assert (peaks.size[k], peaks.time[k]) == largest_pulling(loop, common=errors[k])


def test_the_largest_pulling_is_not_exceeded_at_other_times():
    simple = Loop(Controller([-0.1], [0, 0], 3.0), dual(2.5, 0.065), 16.68, 16.615)
    for loop, source in ((simple, "common"), (paper_loop(), "differential")):
        peak = largest_pulling(loop, **{source: STEP})
        error = {"common": (0.0, 0.0, 0.0), source: STEP}
        time = np.append(np.geomspace(1.0, 1.7e6, 4001), peak.time)
        *found, at_peak = pulling(loop, time, **error)
        assert np.abs(found).max() < peak.size * (1 + 1e-4)
        assert abs(at_peak) == peak.size


def test_a_peak_next_to_an_echo_is_not_rounded_off():
    """Undelayed, the paper's loop answers at once and jumps with each echo."""
    loop = paper_loop(tau1=16.68, tau2=16.62)
    peak = largest_pulling(loop, common=STEP)
    found = pulling(loop, np.linspace(1.0, 70.0, 200_000), common=STEP)
    assert abs(np.abs(found).max() / peak.size - 1) < 5e-3


def test_a_value_does_not_depend_on_the_other_times():
    """Next to a power of 8 s a time has one of two series, which are computed apart."""
    loop, border, errors = paper_loop(), 8.0**6, [STEP, (0.0, 0.0, 1e-9)]
    time = [border * (1 - 1e-12), border, 3.0, 345_600.0]
    found = pulling(loop, time, common=errors)
    alone = [pulling(loop, t, common=errors) for t in time]
    np.testing.assert_array_equal(found, np.transpose(alone), strict=True)
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=1e-4)


def test_what_has_decayed_below_rounding_is_no_number():
    """Until then it decays as the rightmost root does."""
    loop = Loop(Controller([0.0], [-0.05, -1e-3], 0.01), SINGLE, 20.0)
    root = rightmost_root(loop)
    assert root.imag == 0.0
    time = np.array([2e3, 5e3, 1e4, 1.5e4, 2.5e4, 3.5e4])
    with pytest.warns(UserWarning, match="decayed below rounding errors at time = 25000 s"):
        found = pulling(loop, time, common=STEP)
    assert np.isnan(found).tolist() == 4 * [False] + 2 * [True]
    slope = np.diff(np.log(np.abs(found[:4]))) / np.diff(time[:4])
    assert slope == pytest.approx(root.real, rel=1e-6)
