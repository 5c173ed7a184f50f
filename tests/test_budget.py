"""Closed-loop responses, noise budget and pulling, by other ways to the same numbers."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import mpmath
import numpy as np
import pytest

from armlock import (
    Controller,
    DualArm,
    LaserNoise,
    Loop,
    SingleArm,
    flight_loop,
    noise_budget,
    paper_loop,
    pulling,
    transfer,
    unstable_roots,
)
from armlock.performance.budget import LEVELS, tdi_capability
from armlock.performance.pulling import largest_pulling
from armlock.sensors import SINGLE, modified_dual
from tests import draws, independent

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
    laser = np.abs(transfer(FLIGHT, "laser", 2j * np.pi * f)) * 3e4 / f
    np.testing.assert_allclose(budget.sources["laser"], laser, rtol=1e-12)
    _, ax = plt.subplots()
    assert len(budget.plot(ax).lines) == len(budget.sources) + 2
    plt.close()


def test_the_budget_takes_other_levels_and_names_its_own():
    f = np.geomspace(1e-3, 1.0, 20)
    usual = noise_budget(FLIGHT, f)
    assert usual.free == pytest.approx(3e4 / f, rel=1e-12)
    assert "30 kHz/sqrt(Hz) at 1 Hz" in (noise_budget.__doc__ or "")
    laser = LaserNoise(1, 200.0)
    other = noise_budget(FLIGHT, f, laser=laser.asd, shot=3e-5, clock=1.2e-12)
    shares: dict[str, Any] = {"laser": laser.asd(f) * f / 3e4, "shot": 3.0, "clock": 0.5}
    for name, share in shares.items():
        assert other.sources[name] == pytest.approx(share * usual.sources[name], rel=1e-12)
    assert np.array_equal(other.sources["motion"], usual.sources["motion"])
    by_function = noise_budget(FLIGHT, f, laser=lambda x: 30.0 / x)
    assert by_function.sources["laser"] == pytest.approx(other.sources["laser"], rel=1e-6)
    wrong: list[Any] = [
        lambda x: -1.0 / x, lambda _: 1.0, lambda x: np.nan * x, lambda x: x[:1],
    ]  # fmt: skip
    for one in wrong:
        with pytest.raises(ValueError, match=r"^laser\(frequency\) must "):
            noise_budget(FLIGHT, f, laser=one)


def test_unstable_loops_have_no_noise_budget():
    """Their responses at s = j omega look like those of a stable loop."""
    with pytest.raises(ValueError, match=r"^loop must be stable, but it has 36 unstable roots"):
        noise_budget(DualArm(gain=10.0).replace(delay=1.0), [1e-3])
    # A root at s = 0 that cancels in L is not the loop's.
    assert noise_budget(SingleArm(1.0), [1e-3]).total[0] > 0.0


@pytest.mark.parametrize(
    ("source", "error"),
    [
        ("common", (1.0, 0.0, 0.0)),
        ("differential", (0.0, 1e-3, 0.0)),
        ("common", (0.0, 0.0, 1e-8)),
        ("differential", (1.0, 0.0, 0.0)),
    ],
)
def test_both_ways_to_the_pulling_agree(source, error):
    # Later the response to a step of the difference is smaller than rounding errors.
    time = np.array([0.3, 4.0, 10.0 if source == "differential" else 20.0]) * DAY

    def transform(s):
        nu = error[0] / s + error[1] / s**2 + error[2] / s**3
        return complex(transfer(FLIGHT, source, complex(s))) * nu

    errors = {"common": (0.0, 0.0, 0.0), "differential": (0.0, 0.0, 0.0), source: error}
    one = pulling(FLIGHT, time, **errors)
    other = [
        float(mpmath.invertlaplace(transform, t, method="talbot", degree=20)) for t in time
    ]
    # Talbot's method does not see the lines near the sensor's nulls.
    most = max(1e-4 * np.abs(other).max(), 3e-5 * error[0])
    np.testing.assert_allclose(one, other, rtol=1e-5, atol=most)


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


@pytest.mark.parametrize("seed", range(draws(3, 30)))
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
    while unstable_roots(loop := Loop(([], poles, gain), SINGLE, tau, tau)):
        gain *= 0.5
    phi = steps_answer(poles, gain, tau, 40.0 * tau, 60)
    # Within the first round trip too.
    at = np.array([0.3, 0.8, 12.0, 13.35, 20.0, 31.0, 39.0]) * tau
    found = pulling(loop, at, common=(1.0, 0.0, 0.0), differential=(1.0, 0.0, 0.0))
    expected = np.interp(at, np.arange(phi.size) * tau / 60, phi)
    np.testing.assert_allclose(found, expected, rtol=2e-4, atol=2e-5 * np.abs(phi).max())


def test_what_an_unstable_loop_does_is_no_pulling():
    turned = Loop(FLIGHT.controller, modified_dual(33.6, -0.255), FLIGHT.tau1, FLIGHT.tau2)
    with pytest.raises(ValueError, match=r"^loop must be stable, but it has 38 unstable roots"):
        pulling(turned, 1.0)
    # With any dead time its neutral root chain is not confined.
    with pytest.raises(ValueError, match=r"^loop must be stable, but it has no confined chain"):
        largest_pulling(paper_loop(delay=1e-6), common=(1.0, 0.0, 0.0))


@pytest.mark.parametrize("omega", [1e-6, 1e-3])
def test_arms_that_cancel_at_low_frequency_leave_their_digits(omega):
    k, m = FLIGHT.controller, FLIGHT.mapping
    with mpmath.workdps(50):
        s = mpmath.mpc(0, omega)
        gain = k.gain * mpmath.fprod(s - mpmath.mpc(zero) for zero in k.zeros())
        gain /= mpmath.fprod(s - mpmath.mpc(pole) for pole in k.poles())
        one, two, below = (
            mpmath.polyval(list(p), s, asc=True)
            for p in (m.numerator1, m.numerator2, m.denominator)
        )
        factor = -gain * mpmath.exp(-s * FLIGHT.delay) / independent.exact(FLIGHT, s, 1, 1)
        common, differential = (
            complex(factor * v / (2 * below)) for v in (one + two, one - two)
        )
    assert transfer(FLIGHT, "common", 1j * omega) == pytest.approx(common, rel=1e-7, abs=0)
    found = transfer(FLIGHT, "differential", 1j * omega)
    assert found == pytest.approx(differential, rel=1e-7, abs=0)


@pytest.mark.parametrize("loop", [FLIGHT, DualArm(), SingleArm()], ids=range(3))
@pytest.mark.parametrize("source", ["laser", "arm 1", "arm 2", "common", "differential"])
def test_a_response_is_that_of_the_closed_loop_also_at_poles_of_the_open_one(loop, source):
    at = np.concatenate(([0.0], 1j * np.geomspace(1e-9, 1e3, 50), [-0.01 + 0.3j]))
    found = transfer(loop, source, at)
    assert found == pytest.approx(loop.response(source)(at), rel=1e-12)
