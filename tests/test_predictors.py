"""Smith predictors of plants with a direct term: L is delayed at high frequency for ever.

The second opinion evaluates L turn by turn of the delay, up to frequencies at which only the
direct terms are left, and these on a circle.
"""

import math

import control
import mpmath
import numpy as np
import pytest

from armlock import (
    UNCONFINED,
    CountError,
    Loop,
    System,
    delay,
    margins,
    parameter,
    s,
    stability_chart,
    unstable_roots,
)
from tests import draws
from tests.dense import dense_margins


def predictor(controller, plant, model, true):
    """The loop of a Smith predictor: the plant as given, with its delay and that assumed."""
    return System.of(controller).feedback(plant - plant * model) * plant * true


def by_turns(controller, plant, theta):
    """Margins of L, turn by turn of the delay up to the turn 1e6."""
    above, below = (np.polymul(a, b) for a, b in zip(controller, plant, strict=True))
    turns = np.union1d(np.arange(60), np.unique(np.geomspace(60, 1e6, 60).astype(int)))
    share = np.concatenate((np.geomspace(1e-9, 1e-3, 400), np.linspace(1e-3, 1, 4000)[1:]))

    def loop(omega):
        s = 1j * omega
        k, z = np.polyval(above, s) / np.polyval(below, s), np.exp(-s * theta)
        return k * z / (1.0 + k * (1.0 - z))

    return dense_margins(loop, 2.0 * np.pi / theta * (turns[:, None] + share).ravel())


def drawn(seed):
    """A stable plant with a direct term, a PI controller and a delay."""
    rng = np.random.default_rng([55, seed])
    order = 1 + seed % 2
    poles = -rng.uniform(0.2, 2.0, order)
    plant = np.poly(-rng.uniform(0.2, 4.0, order)), np.poly(poles)
    direct = rng.choice([0.5, 0.9, 1.1, 1.5, 3.0, 8.0]) * rng.uniform(0.98, 1.02)
    pi = direct * np.array([1.0, rng.uniform(0.1, 1.5)]), np.array([1.0, 0.0])
    return pi, plant, rng.uniform(0.3, 4.0), direct


@pytest.mark.parametrize("seed", range(draws(3, 24)))
def test_smith_predictors_have_their_margins_by_the_identity_of_their_delay(seed):
    pi, plant, theta, direct = drawn(seed)
    process, controller, z = control.tf(*plant), control.tf(*pi), delay(theta)
    loop = predictor(controller, process, z, z)
    assert unstable_roots(loop) == 0
    found = margins(loop)
    upper, lower, phase, late, modulus = by_turns(pi, plant, theta)
    # At high frequency, L = k z / (1 + k - k z) with k = K P at infinity.
    assert found.gain_lower == pytest.approx(lower, rel=1e-6)
    assert found.gain_upper == pytest.approx(min(upper, 2.0 + 1.0 / direct), rel=1e-6)
    assert found.phase == pytest.approx(phase, rel=2e-6)
    assert found.modulus == pytest.approx(modulus, rel=2e-6)
    assert found.delay == pytest.approx(late if direct < 1.0 else 0.0, rel=2e-6)
    # Two delays that are equal by chance are two delays.
    two = predictor(controller, process, z, delay(theta))
    assert unstable_roots(two) == (UNCONFINED if direct >= 1.0 else 0)


@pytest.mark.parametrize("k", [0.3, 0.9, 1.01, 1.5, 2.0, 5.0])
def test_without_dynamics_all_margins_are_those_of_a_circle(k):
    # L = k z / (1 + k - k z) has the magnitude one where k sin(psi / 2) = (1 + k) / 2.
    z = delay(1.3)
    found = margins(predictor(k, System.of(1), z, z))
    assert found.gain_upper == pytest.approx(2.0 + 1.0 / k, rel=1e-9)
    assert found.modulus == pytest.approx((1.0 + k) / (1.0 + 2.0 * k), rel=1e-9)
    if k < 1.0:
        assert (found.phase, found.delay) == (math.inf, math.inf)
    else:
        assert found.phase == pytest.approx(2.0 * math.asin((1.0 + k) / (2.0 * k)), rel=1e-6)
        assert (found.delay, found.phase_omega) == (0.0, math.inf)


@pytest.mark.parametrize("k", [0.9, 1.1, 3.0])
@pytest.mark.parametrize("q", [7, 40])
def test_a_delay_margin_of_zero_is_a_chain_that_any_delay_sets_free(k, q):
    """With x = exp(-s theta / q), and a further delay theta / q, the chain is a polynomial."""
    chain = np.zeros(q + 2)
    chain[0], chain[q], chain[q + 1] = 1.0 + k, -k, k
    largest = 1.0 / np.abs(np.roots(chain[::-1])).min()
    theta = 2.0
    z, plant = delay(theta), (s + 3) / (s + 2)
    loop = predictor(k * (1 + 1 / s), plant, z, z)
    assert (largest > 1.0) == (margins(loop).delay == 0.0)
    counted = unstable_roots(loop * delay(theta / q))
    assert (counted == UNCONFINED) == (largest > 1.0)


def test_two_delays_in_the_plant_turn_independently():
    # With u = z + 0.3 w, L = 2 u / (3.6 - 2 u), of magnitude one where Re u = 0.9.
    z, w = delay(1.0), delay(0.7)
    plant = z + 0.3 * w
    found = margins(2 / (1 + 2 * (1.3 - plant)) * plant)
    assert found.phase == pytest.approx(math.pi - 2.0 * math.acos(0.9 / 1.3), rel=1e-6)
    assert (found.delay, found.phase_omega) == (0.0, math.inf)
    assert found.modulus == pytest.approx(3.6 / 6.2, rel=1e-9)


def test_powers_of_one_delay_do_not_turn_independently():
    # With u = z - z^2 + z^3, of which Re u is 1.32 at most, L = u / (d - u).
    z, x = delay(1.0), np.exp(1j * np.linspace(0.0, np.pi, 2_000_001))
    late, u = z - z**2 + z**3, x - x**2 + x**3
    for d in (2.7, 1.8):
        found, level = margins(late / (d - late)), u / (d - u)
        crossings = np.flatnonzero(np.diff(np.abs(level) < 1.0))
        least = np.abs(np.angle(-level[crossings])).min(initial=np.inf)
        assert found.phase == pytest.approx(least, abs=1e-5)
        assert found.delay == (0.0 if crossings.size else math.inf)
        assert found.modulus == pytest.approx(np.abs(1 + level).min(), rel=1e-6)


def test_a_chart_of_a_predictor_with_two_delays_ends_where_its_chain_does():
    kp, ki = parameter("kp"), parameter("ki")
    z = delay(1.0)
    controller, plant = kp + ki / s, System.of(control.tf([1, 2], [1, 1]))
    for true, confined in ((z, 2.0), (delay(1.0), 1.0)):
        loop = predictor(controller, plant, z, true)
        chart = stability_chart(loop, kp=[0.5, 0.99, 1.01, 1.5], ki=[0.2, 0.5])
        assert ((chart.counts == UNCONFINED) == (np.array(chart.x) > confined)).all()


def test_a_fast_pi_controller_is_answered_as_far_as_doubles_carry_the_phase():
    """PI g (s + 100) / s on an arm of 20 s: L passes from 1e4 g to 0 and back at each turn."""
    pi = control.tf([1e3, 1e5], [1, 0])
    found = margins(Loop(pi, "single", 20.0))
    with mpmath.workdps(40):

        def response(omega):
            p = mpmath.mpc(0, omega)
            return 1000 * (p + 100) / p * (1 - mpmath.exp(-20 * p))

        first = 2 * mpmath.pi / 20
        crossings = [
            mpmath.findroot(lambda w: abs(response(w)) ** 2 - 1, first + off)
            for off in (-1.57e-7, 1.57e-7)
        ]
        least = min(abs(mpmath.arg(-response(w))) for w in crossings)
    assert found.phase == pytest.approx(float(least), rel=1e-6)
    for loop in (
        Loop(10 * pi, "single", 20.0),
        Loop(10 * pi, "dual", 16.65, 24.98),
        Loop(10 * pi, "dual", 24.98, 16.65),
    ):
        assert unstable_roots(loop) == 0
        with pytest.raises(CountError, match=r"rounding does not decide at [\d.e+]+ rad/s"):
            margins(loop)
