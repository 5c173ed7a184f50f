"""Closed-loop responses, noise budget and pulling, by other ways to the same numbers."""

from __future__ import annotations

import control
import mpmath
import numpy as np
import pytest

from armlock import (
    Controller,
    Loop,
    SingleArm,
    closed_loop,
    flight_loop,
    noise_budget,
    paper_loop,
    published_loops,
    pulling,
    rightmost_root,
    transfer,
)
from armlock.performance.budget import MOTION_CORNER, noise_series, tdi_capability
from armlock.performance.pulling import _complete_up_to, slow_roots
from armlock.sensors import SINGLE, modified_dual

FLIGHT = flight_loop()
DAY = 86400.0


def test_responses_solve_the_loop_equation():
    """phi = phi_L - K [m1 (phi (1 - e1) + n1) + m2 (phi (1 - e2) + n2)], all at once."""
    s = 2j * np.pi * np.geomspace(1e-7, 1e3, 40)
    first, second = FLIGHT.arm_responses(s)
    laser, n1, n2 = 1.0, 0.3, -0.8
    given = {"laser": laser, "common": n1 + n2, "differential": n1 - n2}
    phi = sum(size * transfer(FLIGHT, name, s) for name, size in given.items())
    back = first * (phi * (1.0 - np.exp(-s * FLIGHT.tau1)) + n1)
    back += second * (phi * (1.0 - np.exp(-s * FLIGHT.tau2)) + n2)
    scale = np.abs(phi) + np.abs(first) + np.abs(second)
    assert (np.abs(phi - (laser - back)) < 1e-9 * scale).all()
    arms = [n * transfer(FLIGHT, name, s) for n, name in ((n1, "arm 1"), (n2, "arm 2"))]
    np.testing.assert_allclose(phi, transfer(FLIGHT, "laser", s) + sum(arms), rtol=1e-9)


def test_all_responses_are_one_object_of_python_control():
    response = closed_loop(FLIGHT, [0.01, 0.1])
    assert isinstance(response, control.FrequencyResponseData)
    assert (response.ninputs, response.noutputs) == (5, 1)
    expected = [transfer(FLIGHT, name, 0.1j) for name in response.input_labels]
    np.testing.assert_allclose(response(0.1j)[0], expected, rtol=1e-12)


def test_one_arm_of_high_gain_leaves_the_noise_of_the_arm():
    """Without rate limits the laser repeats what the arm adds, over |1 - exp(-s tau)|."""
    tau, f = 20.0, np.array([1e-3, 3e-3, 0.012])
    budget = noise_budget(Loop(Controller((), (), 1e9), SINGLE, tau, tau), f)
    arm = 2.0 * np.abs(np.sin(np.pi * f * tau))
    w = 2.0 * np.pi * f
    np.testing.assert_allclose(budget.sources["shot"], w * 1e-5 * np.sqrt(2) / arm, rtol=1e-6)
    clock = 15e6 * 2.4e-12 / np.sqrt(f) * np.sqrt(2) / arm
    np.testing.assert_allclose(budget.sources["clock"], clock, rtol=1e-6)
    moved = 2.5e-3 * w / np.sqrt(1 + (f / MOTION_CORNER) ** 4)
    moved *= np.hypot(2.0 * np.cos(np.pi * f * tau), 2.0) / arm
    np.testing.assert_allclose(budget.sources["motion"], moved, rtol=1e-6)
    squares = sum(asd**2 for asd in budget.sources.values())
    np.testing.assert_allclose(budget.total, np.sqrt(squares), rtol=1e-12)


def test_the_budget_is_held_against_a_requirement_and_draws_itself():
    f = np.geomspace(1e-4, 1.0, 30)
    budget = noise_budget(FLIGHT, f)
    np.testing.assert_allclose(budget.factor, tdi_capability(f) / budget.total, rtol=1e-12)
    same = noise_budget(FLIGHT, f, laser=3e4 / f, requirement=tdi_capability(f))
    np.testing.assert_array_equal(same.total, budget.total)
    assert noise_budget(FLIGHT, f, laser="cavity").total[20] < budget.total[20]
    assert len(budget.plot().lines) == len(budget.sources) + 2


def test_a_series_of_no_known_source_is_refused():
    with pytest.raises(ValueError, match="source must be one of laser, shot, clock, motion"):
        noise_series(FLIGHT, "maser", 10, seed=1)
    with pytest.raises(ValueError, match="poles must lie in the left half-plane"):
        noise_series(published_loops()["PI"], "motion", 10, seed=1)


@pytest.mark.parametrize("error", [(1.0, 0.0, 0.0), (0.0, 1e-3, 0.0), (0.0, 0.0, 1e-8)])
def test_both_ways_to_the_pulling_agree(error):
    time = np.array([0.3, 1.0, 4.0, 10.0, 20.0]) * DAY
    none = (0.0, 0.0, 0.0)
    for source, errors in (("common", (error, none)), ("differential", (none, error))):

        def transform(s, source=source):
            nu = error[0] / s + error[1] / s**2 + error[2] / s**3
            return complex(transfer(FLIGHT, source, complex(s))) * nu

        one = pulling(FLIGHT, time, *errors)
        other = [
            float(mpmath.invertlaplace(transform, t, method="talbot", degree=20)) for t in time
        ]
        # Talbot's method does not see the lines near the sensor's nulls.
        most = max(1e-5 * np.abs(other).max(), 3e-5 * error[0])
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=most)


def test_the_roots_of_the_pulling_are_counted():
    """As many as `rightmost_root` and a count in a half-plane find; a gap is noticed."""
    roots, rate = slow_roots(FLIGHT)
    assert rate > 2e-4
    slowest = max(roots, key=lambda root: root.real)
    assert slowest == pytest.approx(rightmost_root(FLIGHT, 1.0, 1.0), rel=1e-6)
    assert _complete_up_to(FLIGHT, np.delete(roots, 2)) < abs(roots[2].real)
    # A root at s = 0 is none of those that are listed, and counts.
    assert slow_roots(SingleArm(gain=100.0, tau=33.4))[1] > 0.0
    # Past the chain of a neutral loop there is no count.
    assert slow_roots(published_loops()["Table II"])[1] < 5e-6


def test_what_an_unstable_loop_does_is_no_pulling():
    turned = Loop(FLIGHT.controller, modified_dual(33.6, -0.255), FLIGHT.tau1, FLIGHT.tau2)
    with pytest.raises(ValueError, match="loop must be stable at c1 = c2 = 1, got 38 unstable"):
        pulling(turned, 1.0)
    # With any dead time its chain reaches the right half-plane.
    with pytest.raises(ValueError, match="got a neutral root chain that is not confined"):
        pulling(paper_loop(delay=1e-6), 1.0)
