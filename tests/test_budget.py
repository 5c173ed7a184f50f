"""Closed-loop responses, noise budget and pulling, by other ways to the same numbers."""

from __future__ import annotations

import matplotlib.pyplot as plt
import mpmath
import numpy as np
import pytest

from armlock import (
    Controller,
    CountError,
    DualArm,
    Loop,
    SingleArm,
    flight_loop,
    noise_budget,
    paper_loop,
    published_loops,
    pulling,
    rightmost_root,
    transfer,
    unstable_roots,
)
from armlock.performance.budget import LEVELS, SOURCES, noise_series, tdi_capability
from armlock.performance.pulling import slow_roots
from armlock.sensors import SINGLE, modified_dual
from armlock.stability.counts import loop_count
from tests import independent

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


def test_one_arm_of_high_gain_leaves_the_noise_of_the_arm():
    """Without rate limits the laser repeats what the arm adds, over |1 - exp(-s tau)|."""
    tau, f = 20.0, np.array([1e-3, 3e-3, 0.012])
    budget = noise_budget(Loop(Controller((), (), 1e9), SINGLE, tau, tau), f)
    arm = 2.0 * np.abs(np.sin(np.pi * f * tau))
    w = 2.0 * np.pi * f
    np.testing.assert_allclose(budget.sources["shot"], w * 1e-5 * np.sqrt(2) / arm, rtol=1e-6)
    clock = 15e6 * 2.4e-12 / np.sqrt(f) * np.sqrt(2) / arm
    np.testing.assert_allclose(budget.sources["clock"], clock, rtol=1e-6)
    moved = 2.5e-3 * w / np.sqrt(1 + (f / LEVELS.motion_corner) ** 4)
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


def test_sources_of_ones_own_join_or_replace_the_others():
    f = np.geomspace(1e-4, 1.0, 30)
    known = noise_budget(FLIGHT, f, c1=1.01, c2=0.99)
    w = 2.0 * np.pi * f
    shot = np.sqrt(2.0) * LEVELS.shot * w
    mine = np.array([3.0 + f, np.zeros(30)])
    found = noise_budget(
        FLIGHT, f, c1=1.01, c2=0.99, sources={"shot": 10.0 * shot, "mine": mine}
    )
    np.testing.assert_allclose(found.sources["shot"], 10.0 * known.sources["shot"], rtol=1e-12)
    arm = np.abs(transfer(FLIGHT, "arm 1", 1j * w, 1.01, 0.99))
    np.testing.assert_allclose(found.sources["mine"], arm * (3.0 + f), rtol=1e-12)
    lines = found.plot(plt.figure().add_subplot(), alpha=0.5).lines
    assert [line.get_label() for line in lines[:5]] == [*SOURCES, "mine"]
    assert lines[0].get_alpha() == 0.5
    with pytest.raises(AttributeError):
        LEVELS.shot = 1.0  # type: ignore[misc]
    for sources, why in (
        ({"laser": 1.0}, r"^sources must not hold 'laser'"),
        ({"mine": [1.0, 2.0]}, r"^sources\['mine'\] must be one number or hold one a freq"),
        ({"mine": -1.0}, r"^sources\['mine'\] must not be negative, got -1.0"),
    ):
        with pytest.raises(ValueError, match=why):
            noise_budget(FLIGHT, f, sources=sources)


def test_a_series_of_no_known_source_is_refused():
    with pytest.raises(
        ValueError, match="source must be one of 'laser', 'shot', 'clock', 'motion'"
    ):
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


def test_the_roots_of_the_pulling_are_as_many_as_are_counted():
    roots = slow_roots(FLIGHT, 3e-4)
    assert unstable_roots(FLIGHT.shifted(-3e-4), 1.0, 1.0) == (1 + (roots.imag > 0.0)).sum()
    assert roots[np.argmax(roots.real)] == pytest.approx(rightmost_root(FLIGHT), rel=1e-6)
    # A root at s = 0 is none of those that are listed, and counts.
    arm = SingleArm(gain=100.0, tau=33.4)
    roots = slow_roots(arm, 1e-3)
    assert unstable_roots(arm.shifted(-1e-3), 1.0, 1.0) == 1 + (1 + (roots.imag > 0.0)).sum()
    # Not all are found where one is forgotten, and past the chain there is no count.
    with pytest.raises(CountError, match=r"^no pulling from 1e\+05 s on: .* cannot be told"):
        slow_roots(published_loops()["Table II"], np.log(1e4) / 1e5)


def steps_answer(poles, gain, tau, end, each):
    """The answer to a step of 1 Hz on a single arm, by the method of steps, to fourth order.

    K, the gain over the product of s - poles, in companion form, is driven by
    y = phi(t) - phi(t - tau) + 1, with phi = -K y. Runge and Kutta's steps divide the delay:
    between them the past is interpolated by a cubic.
    """
    below, order, h = np.real(np.poly(poles)), len(poles), tau / each
    matrix = np.diag(np.ones(order - 1), -1)
    matrix[0] = -below[1:]
    out = gain * np.eye(order)[-1]
    # The past before the step stands in front.
    x, steps = np.zeros(order), round(end / h)
    phi = np.zeros(each + 2 + steps + 1)

    def slope(x, late):
        rate = matrix @ x
        rate[0] += 1.0 - out @ x - late
        return rate

    for k in range(steps):
        begun, middle = phi[k + 2], np.array([-1.0, 9.0, 9.0, -1.0]) @ phi[k + 1 : k + 5] / 16.0
        a = slope(x, begun)
        b = slope(x + 0.5 * h * a, middle)
        c = slope(x + 0.5 * h * b, middle)
        d = slope(x + h * c, phi[k + 3])
        x = x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        phi[each + 2 + k + 1] = -out @ x
    return phi[each + 2 :]


@pytest.mark.parametrize("seed", range(6))
def test_pulling_is_what_the_method_of_steps_gives(seed):
    rng = np.random.default_rng(seed)
    tau, damping = 3.0, float(rng.uniform(0.05, 0.6))
    fast = float(rng.uniform(0.5, 3.0))
    poles = [
        [-float(rng.uniform(0.1, 2.0)), -fast],
        # A resonance, and an integrator, whose error the laser follows for ever.
        [-damping * fast + 1j * fast, -damping * fast - 1j * fast],
        [0.0, -fast],
    ][seed % 3]
    gain = float(10.0 ** rng.uniform(-2.0, -0.5)) * fast
    while loop_count(loop := Loop(([], poles, gain), SINGLE, tau, tau), 1.0, 1.0):
        gain *= 0.5
    phi = steps_answer(poles, gain, tau, 40.0 * tau, 60)
    at = np.array([12.0, 13.35, 20.0, 31.0, 39.0]) * tau
    found = pulling(loop, at, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    expected = np.interp(at, np.arange(phi.size) * tau / 60, phi)
    np.testing.assert_allclose(found, expected, rtol=2e-4, atol=2e-5 * np.abs(phi).max())


def test_a_resonance_far_above_the_delays_is_summed_up():
    # Two roots next to it decay slower than all others but one.
    loop = Loop(([], [-1e-3 + 400j, -1e-3 - 400j, -1.0], 1e-2), SINGLE, 20.0, 20.0)
    found = float(pulling(loop, 600.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    root = rightmost_root(loop)
    assert abs(root.imag) == pytest.approx(400.0, rel=1e-3)
    s = mpmath.mpc(root)
    with mpmath.workdps(30):
        slope = complex(mpmath.diff(lambda z: independent.exact(loop, z, 1.0, 1.0), s))
    first, second = loop.arm_responses(root)
    ring = 2.0 * (-0.5 * (first - second) / slope / root * np.exp(600.0 * root)).real
    steady = complex(transfer(loop, "differential", 1e-12j)).real
    assert found == pytest.approx(steady + ring, rel=1e-9)


def test_unstable_roots_behind_the_one_at_zero_are_no_pulling():
    with pytest.raises(ValueError, match="got 36 unstable roots"):
        pulling(DualArm(gain=10.0, delay=1.0), 1000.0)


def test_times_at_which_too_many_roots_have_not_decayed_are_refused():
    with pytest.raises(CountError, match=r"^no pulling from 0\.\d+ s on: the roots right of"):
        pulling(SingleArm(0.1, 20.0), 1.0)


def test_what_an_unstable_loop_does_is_no_pulling():
    turned = Loop(FLIGHT.controller, modified_dual(33.6, -0.255), FLIGHT.tau1, FLIGHT.tau2)
    with pytest.raises(ValueError, match="loop must be stable at c1 = c2 = 1, got 38 unstable"):
        pulling(turned, 1.0)
    # With any dead time its chain reaches the right half-plane.
    with pytest.raises(ValueError, match="got a neutral root chain that is not confined"):
        pulling(paper_loop(delay=1e-6), 1.0)
