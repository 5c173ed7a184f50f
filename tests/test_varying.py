"""Peak gains and radii of varying perturbations, against independent answers."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from flint import fmpq, fmpq_poly
from scipy.linalg import expm

from armlock import (
    CommonArm,
    Controller,
    CountError,
    DualArm,
    Loop,
    SingleArm,
    System,
    buildable_loop,
    critical_perturbation,
    delay,
    flight_loop,
    modulus_margin,
    paper,
    paper_loop,
    parameter,
    peak_gain,
    robust_loop,
    s,
    simulate,
    unstable_roots,
    varying_radius,
)
from armlock.engine import decide
from armlock.engine.decide import Family
from armlock.engine.inclusion import TERM, VERTEX
from armlock.robustness.varying import spectral_factor
from armlock.sensors import SignalMapping
from tests import dense

# Found by others with a dense grid.
PUBLISHED = {
    "paper": (paper_loop, 1.3213607e-6, 2.46134e-5, (1, -1), 1.4643205e-6),
    "robust": (robust_loop, 2.5710454e-6, 4.59564e-5, (1, -1), 4.3751e-6),
    "buildable": (buildable_loop, 2.5752707e-6, 4.59531e-5, (1, -1), 4.4004e-6),
    "flight": (flight_loop, 5.5963872e-4, 2.56846e-5, (1, 1), 5.5979e-4),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_radii_of_the_loops_of_the_book(name):
    make, radius, omega, direction, constant = PUBLISHED[name]
    found = varying_radius(make())
    assert found.radius == pytest.approx(radius, rel=1e-6)
    assert found.omega == pytest.approx(omega, rel=1e-4)
    assert found.constant == pytest.approx(constant, rel=2e-5)
    assert found.constant == pytest.approx(critical_perturbation(make(), direction), rel=1e-6)
    assert found.scalings == (1.0, 1.0)


def test_the_radius_with_half_the_difference():
    found = varying_radius(paper_loop(difference=0.5 * (paper.TAU1 - paper.TAU2)))
    assert found.radius == pytest.approx(5.9495e-7, rel=1e-5)
    assert found.constant == pytest.approx(6.3262e-7, rel=1e-5)


def test_peak_gains_against_a_dense_search():
    rng, number, places = np.random.default_rng(21), 0, set()
    while number < 12:
        n, d = dense.drawn_closed(rng)
        try:
            found = peak_gain(dense.quotient(n, d))
        except ValueError:
            continue
        number += 1
        assert found.gain == pytest.approx(dense.peak(n, d), rel=2e-6)
        places.add(found.omega if found.omega in (0.0, math.inf) else "between")
        if 0.0 < found.omega < math.inf:
            at = abs(dense.value(n, 1j * found.omega) / dense.value(d, 1j * found.omega))
            assert at == pytest.approx(found.gain, rel=1e-7)
    assert places == {0.0, math.inf, "between"}


def test_no_level_that_is_too_good_is_certified():
    rng, number = np.random.default_rng(22), 0
    while number < 12:
        system = dense.quotient(*dense.drawn_closed(rng))
        n, d = system.affine.quotient()
        if decide.count(d) != 0:
            continue
        number += 1
        level = 1.0 / peak_gain(system).gain
        for share, holds in ((1.0 - 1e-5, True), (1.0 + 1e-4, False)):
            test = [(VERTEX, (1.0, 0.0), (0.0, 0.0)), (TERM, (0.0, level * share), (0.0, 0.0))]
            assert decide.excludes(Family([d, n], [test])) == holds


def test_peak_gains_that_are_known():
    # Of a resonance with the damping z, 1 / (2 z sqrt(1 - z^2)); a delay changes no gain.
    z = 1e-5
    found = peak_gain(control.tf([1.0], [1.0, 2.0 * z, 1.0]) * delay(0.3))
    assert found.gain == pytest.approx(0.5 / (z * math.sqrt(1.0 - z * z)), rel=1e-9)
    assert found.omega == pytest.approx(math.sqrt(1.0 - 2.0 * z * z), rel=1e-9)
    assert peak_gain(control.tf([2.0], [3.0, 1.0])) == (2.0, 0.0)
    assert peak_gain(control.tf([1.0, 0.0], [4.0, 1.0])) == (0.25, math.inf)
    # Both numerator and denominator are delayed at high frequency.
    high = (1 + 0.2 * delay(3.0)) / (1 - 0.5 * delay(1.0)) * control.tf([1.0, 0.0], [1.0, 1.0])
    assert peak_gain(high).gain == pytest.approx(2.4, rel=1e-12)
    assert peak_gain(high).omega == math.inf
    assert peak_gain(3.0).gain == 3.0
    assert peak_gain(0.0).gain == 0.0


@pytest.mark.parametrize("make", [paper_loop, robust_loop, buildable_loop, flight_loop])
def test_modulus_and_peak_gain_of_the_loops(make):
    loop = make()
    assert modulus_margin(loop) == pytest.approx(1.0 / peak_gain(1 / (1 + loop)).gain, rel=1e-6)
    # The other peak of control: |T| <= 1 + |S|, and |S| <= 1 + |T|.
    closed = peak_gain(loop.feedback()).gain
    assert abs(closed - 1.0 / modulus_margin(loop)) < 1.0


def test_what_is_refused_says_why():
    unstable = 1 / (1 + CommonArm().at(c1=1.1, c2=1.0))
    with pytest.raises(ValueError, match=r"^system must be stable, .* 5 unstable poles"):
        peak_gain(unstable)
    for axis in (1 / s, 1 / (s**2 + 4), 3 * delay(0.1) / (s * (s + 1))):
        with pytest.raises(ValueError, match="it has a pole on the imaginary axis"):
            peak_gain(axis)
    with pytest.raises(ValueError, match="it has 1 unstable pole"):
        peak_gain(1 / (s - 1))
    with pytest.raises(ValueError, match="loop must be stable, but it has 5 unstable roots"):
        varying_radius(CommonArm(), 1.1)
    with pytest.raises(ValueError, match="no confined chain"):
        varying_radius(Loop(((), (), 5.0), "single", 2.0), 1.3)


def test_loops_that_any_constant_perturbation_breaks_have_the_radius_zero():
    for loop in (SingleArm(), CommonArm(), DualArm()):
        found = varying_radius(loop)
        assert (found.radius, found.constant, found.omega) == (0.0, 0.0, 0.0)
        assert critical_perturbation(loop, (1.0, 1.0)) == 0.0 or isinstance(
            loop.mapping, object
        )


def test_radii_that_are_known():
    # An integrator with one arm is stable up to c = 1, where a root crosses at s = 0.
    found = varying_radius(SingleArm(), 0.9)
    assert found.radius == pytest.approx(0.1, rel=1e-6)
    assert found.constant == pytest.approx(0.1, rel=1e-9)
    # Without dynamics |1 + g (1 - c z)| is least at z = 1: the chain decides.
    found = varying_radius(Loop(((), (), 5.0), "single", 2.0))
    assert found.radius == pytest.approx(0.2, rel=1e-6)
    # Arms of unequal weight: the least radius over the phases is 1 / (|G_1| + |G_2|) with the
    # best d, and 1 / sqrt(2 (|G_1|^2 + |G_2|^2)) with d = 1.
    unequal = SignalMapping([4.0], [1.0], [1.0], name="unequal")
    found = varying_radius(Loop(((), (), 0.1), unequal, 2.0, 1.5))
    assert found.radius == pytest.approx((1.5 - 0.5) / 0.5, rel=1e-6)
    assert found.scalings == pytest.approx([1.0, 0.5], rel=1e-3)


def test_two_equal_arms_of_a_neutral_loop_stay_two():
    # At high frequency 1 + 0.4 - 0.2 (c1 + c2) is left, and no frequency has less.
    loop = Loop(Controller([0.0], [-1.0], 0.2), "common", 20.0, 20.0)
    found = varying_radius(loop)
    assert (found.radius, found.constant) == pytest.approx((2.5, 2.5), rel=1e-6)


def test_an_expression_does_not_say_where_a_factor_acts():
    """The same transfer function, with a factor behind or before the filter."""
    c1, c2 = parameter("c1", 1.0), parameter("c2", 1.0)
    filtered = System.of(control.tf([100], [1, 1]))
    alike = 0.5 * (c1 * filtered + c2 * filtered) * delay(1e-6)
    for expression in (alike, paper_loop() * 1, paper_loop().at(c1=1.0), 0.5 * delay(1.0)):
        message = r"^loop must be a Loop.* not commute .*loop\.replace.*1 / peak_gain\(G\)"
        with pytest.raises(TypeError, match=message):
            varying_radius(expression)
    # If both stood before the filter, S F / 2 would be added twice.
    gain = peak_gain(0.5 * filtered / (1 + filtered * delay(1e-6))).gain
    assert 1.0 / (2.0 * gain) == pytest.approx(1.01, rel=1e-4)

    def growth(e1, e2, period):
        """Growth per s with c1 behind the filter and c2 before it, switched together."""
        halves = [
            expm(0.5 * period * np.array([[-1 - 50 * a, -50], [-50 * a * b, -1 - 50 * b]]))
            for a, b in ((1 + e1, 1 + e2), (1 - e1, 1 - e2))
        ]
        return np.log(np.abs(np.linalg.eigvals(halves[0] @ halves[1])).max()) / period

    assert growth(0.25, 0.25, 1e-3) == pytest.approx(0.54, abs=0.01)
    assert growth(0.25, -0.25, 1e-3) < 0.0


def test_a_factor_of_one_signal_has_the_radius_of_one_over_a_peak_gain():
    """k(t) (x(t) - x(t - tau)) on one mode, whose switching a run in time confirms."""
    mode, z, k = 1 / (s**2 + 0.4 * s + 1), delay(2.0), 0.05
    radius = 1.0 / peak_gain((1 - z) * mode / (1 + k * (1 - z) * mode)).gain
    rate, rng = 100.0, np.random.default_rng(27)
    t = np.arange(int(200 * rate)) / rate

    def left(share, turn):
        """Size in the second half over that in the first, switched at twice a frequency."""
        back = np.zeros((t.size, 2))
        back[0] = 1.0, 0.0
        for i in range(1, t.size):
            x, v = back[i - 1]
            late = back[i - 201, 0] if i > 200 else 0.0
            factor = k + share * radius * np.sign(np.sin(turn * t[i]))
            v += (-0.4 * v - x - factor * (x - late)) / rate
            back[i] = x + v / rate, v
        half = t.size // 2
        return np.abs(back[half:, 0]).max() / np.abs(back[:half, 0]).max()

    assert max(left(0.99, turn) for turn in (0.0, *rng.uniform(1.0, 3.0, 4))) < 1.0


def test_a_radius_is_that_of_a_dense_search():
    rng, scalings = np.random.default_rng(23), []
    for loop in drawn_loops(rng, 10):
        found = varying_radius(loop)
        omega = np.unique(
            np.concatenate((np.geomspace(1e-5, 1e3, 10_000), np.arange(1, 10_000) * 8e-3))
        )
        s = 1j * omega
        first, second = loop.arm_responses(s)
        sensitivity = 1.0 / (1.0 + loop(s))
        g1, g2 = (np.abs(g * sensitivity) ** 2 for g in (first, second))
        d2 = np.geomspace(1e-2, 1e2, 501)
        costs = [(1 + d) * (g1 + g2 / d).max() for d in d2]
        assert found.radius == pytest.approx(1.0 / math.sqrt(min(costs)), rel=1e-3)
        assert found.radius <= found.constant * (1.0 + 1e-6)
        scalings.append(found.scalings[1])
    assert np.ptp(scalings) > 0.1


def drawn_loops(rng, number):
    """Draw stable loops whose arms have unequal weights."""
    found: list[Loop] = []
    while len(found) < number:
        weights = rng.uniform(0.3, 1.0), rng.uniform(0.3, 1.0)
        mapping = SignalMapping([weights[0]], [weights[1]], [1.0], name="drawn")
        zero, pole = -(10.0 ** rng.uniform(-1, 1, 2))
        gain, tau = 10.0 ** rng.uniform(-1, 1), rng.uniform(0.5, 2.0, 2)
        if rng.random() < 0.5:
            controller = Controller([zero], [pole, -3.0 * abs(pole)], gain)
        else:
            controller = Controller([zero], [pole], 0.1 * gain)
        loop = Loop(controller, mapping, *tau)
        if unstable_roots(loop) == 0:
            found.append(loop)
    return found


def growth(loop, r, omega, rng, patterns):
    """Largest growth of the output over varying c that switch between 1 - r and 1 + r."""
    rate, worst = 40.0, 0.0
    timepts = np.arange(int(160.0 * rate)) / rate
    noise = np.where(timepts < 2.0, rng.normal(size=timepts.size), 0.0)
    for k in range(patterns):
        # Periods about that at which the radius is taken, also twice and half of it.
        turn = omega * rng.choice([0.5, 1.0, 2.0]) * rng.uniform(0.9, 1.1) * timepts
        phases, duty = rng.uniform(0, 2 * np.pi, 2), rng.uniform(-0.7, 0.7)
        signs = [np.where(np.sin(turn + phase) > duty, 1.0, -1.0) for phase in phases]
        if k < 4:
            # All four that are constant.
            signs = [
                np.full(timepts.size, sign) for sign in (1.0 - k // 2 * 2, 1.0 - k % 2 * 2)
            ]
        out = simulate(
            loop, noise, c1=1 + r * signs[0], c2=1 + r * signs[1], sample_rate=rate, limit=1e30
        )
        quarter = out.size // 4
        early, late = np.sum(out[quarter : 2 * quarter] ** 2), np.sum(out[-quarter:] ** 2)
        worst = max(worst, late / early if early > 1e-200 else 0.0)
    return worst


def test_no_switching_within_the_radius_makes_a_loop_grow():
    rng, grown = np.random.default_rng(24), 0
    for loop in drawn_loops(rng, 10):
        found = varying_radius(loop)
        omega = found.omega if 0.0 < found.omega < 20.0 else 1.0
        assert growth(loop, 0.99 * found.radius, omega, rng, 12) < 1.0
        # The same search does see growth, where constant perturbations break the loop.
        grown += growth(loop, 1.2 * found.constant, omega, rng, 4) > 1.0
    assert grown >= 9


def square(coefficients, x):
    """Square of the magnitude of a polynomial at omega^2 = x, exactly."""
    even, odd = (
        sum((-1) ** i * c * x**i for i, c in enumerate(coefficients[first::2]))
        for first in (0, 1)
    )
    return even**2 + x * odd**2


def test_a_spectral_factor_is_no_smaller_than_what_it_stands_for():
    rng = np.random.default_rng(25)
    for _ in range(20):
        common = [0, 0, 1] if rng.random() < 0.5 else [1]
        parts = [
            fmpq_poly([fmpq(int(c), 7) for c in rng.integers(-50, 50, 5)]) * fmpq_poly(common)
            for _ in range(2)
        ]
        weights = [fmpq(1), fmpq(int(rng.integers(1, 9)), 3)]
        exact = spectral_factor(parts, weights).exact.coeffs()
        for x in [fmpq(int(v), 64) for v in rng.integers(0, 10_000, 20)]:
            needed = sum(w * square(p.coeffs(), x) for p, w in zip(parts, weights, strict=True))
            assert needed <= square(exact, x) <= needed * (1 + fmpq(1, 10**12))
        f = np.array([float(c) for c in exact])
        s = 1j * np.geomspace(1e-3, 1e3, 500)
        squares = sum(
            float(w) * np.abs(np.polyval([float(c) for c in p.coeffs()][::-1], s)) ** 2
            for p, w in zip(parts, weights, strict=True)
        )
        assert np.abs(np.polyval(f[::-1], s)) ** 2 == pytest.approx(squares, rel=1e-9)


def test_a_spectral_factor_with_a_common_zero_on_the_axis():
    # 1 + s^2 divides both: so it does the factor, exactly.
    both = fmpq_poly([1, 0, 1])
    f = spectral_factor([both * fmpq_poly([1, 2]), both], [fmpq(1)] * 2)
    assert np.polyval([float(c) for c in f.exact][::-1], 1j) == pytest.approx(0.0, abs=1e-15)


def test_no_constant_perturbation_that_was_looked_at_breaks_the_loop():
    weak = Loop(1e-10 * control.tf([1.0], [1.0, 1.0]), "single", 1.0)
    found = varying_radius(weak)
    assert found.radius == pytest.approx(1e10, rel=1e-5)
    assert found.constant == math.inf


def test_a_peak_that_rounding_does_not_certify_is_no_number():
    # At a gain of 1e13 nothing is proved about 1 + g (1 - z) next to its zero.
    assert peak_gain(1 / (1 + 1e5 * (1 - delay(1.0)))).gain == pytest.approx(1.0, rel=1e-6)
    steep = Loop(((), (), 1e13), "single", 1.0)
    for ask in (lambda loop: peak_gain(1 / (1 + loop)), modulus_margin, varying_radius):
        with pytest.raises(CountError, match="rounding does not decide"):
            ask(steep)


@pytest.mark.parametrize(
    ("make", "largest"), [(paper_loop, 9995.5), (buildable_loop, 0.584), (flight_loop, 0.273)]
)
def test_a_phase_lock_is_a_perturbation_that_grows_with_frequency(make, largest):
    # c_k = T of a lock with a bandwidth of 30 kHz: sum |G_k| |T - 1| on a dense grid.
    loop = make()

    def share(f):
        s = 2j * np.pi * f
        weights = np.abs(loop.arm_responses(s)).sum(axis=0)
        return weights / np.abs(1 + loop(s)) * np.abs(s / (s + 2.0 * np.pi * 3e4))

    assert share(np.geomspace(10.0, 1e6, 500_000)).max() == pytest.approx(largest, rel=1e-2)
    if make is paper_loop:
        # At a null 1 + L is 1, and the weights are the gain twice.
        assert share(np.array([20.0])) == pytest.approx(1e4 * 20.0 / 3e4, rel=1e-5)


def test_a_limit_that_is_not_decided_is_not_a_number():
    # Two delays act in different proportions, and the largest gain is at no sign of either.
    n, d = {0.0: [1.0], 1.0: [0.5], 1.37: [-0.4]}, {0.0: [1.0], 1.0: [0.3], 1.37: [0.2]}
    with pytest.raises(CountError, match="no peak gain: the behaviour at high frequency"):
        peak_gain(dense.quotient(n, d))
