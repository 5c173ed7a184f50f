"""The loop in time: accuracy, closed form, verdicts, blocks, divergence, bad input."""

import copy
import pickle
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from armlock import (
    CommonArm,
    Controller,
    DivergenceError,
    LaserNoise,
    Loop,
    PerturbationNoise,
    Simulation,
    paper_loop,
    rightmost_root,
    sampled_open_loop,
    simulate,
    unstable_roots,
)
from armlock.sensors import COMMON, SINGLE, SignalMapping
from armlock.timedomain.interpolation import lagrange_weights
from tests import independent

RATE = 200.0


def relative_error(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


def test_accuracy_over_a_million_samples():
    """With c1 and c2 that change."""
    noise = LaserNoise(1, RATE).draw(1_200_000)
    c1, c2 = (1.0 + 1e-4 * PerturbationNoise(k, RATE).draw(noise.size) for k in (2, 3))
    expected = independent.locked_paper_loop(noise, c1, c2, RATE)
    assert c1.std() > 1e-7
    assert c2.std() > 1e-7
    found = simulate(paper_loop(), noise, sample_rate=RATE, c1=c1, c2=c2)
    assert relative_error(found, expected) < 1e-12
    # Of each sample too, but for those that happen to be near zero.
    assert np.quantile(np.abs(found / expected - 1.0), 0.99) < 1e-11


LOOPS = {
    "neutral": (Loop(Controller([-0.3], [-0.1], 0.2), COMMON, 2.0, 1.5), 10.0),
    "between samples": (Loop(Controller([-9.0], [-0.1], 0.02), COMMON, 20.13, 19.957), 7.0),
    "complex and repeated": (
        Loop(
            Controller([-1 + 2j, -1 - 2j, -3], [-0.5, -0.5, -0.3 + 0.4j, -0.3 - 0.4j], 0.002),
            SignalMapping((1.0, 2.0, 1.5), (1.0, 0.0, -1.0), (1.0, 2.0, 1.0), "made up"),
            5.1,
            4.27,
        ),
        20.0,
    ),
}


@pytest.mark.parametrize("name", LOOPS)
def test_impulse_response_is_the_closed_form(name):
    loop, rate = LOOPS[name]
    c1, c2 = 0.8, -0.6
    impulse = np.zeros(1 << 14)
    impulse[0] = 1.0
    output = simulate(loop, impulse, c1=c1, c2=c2, sample_rate=rate)
    assert np.abs(output[-2000:]).max() < 1e-13
    omega = 2.0 * np.pi * np.fft.rfftfreq(impulse.size, 1.0 / rate)[:-1]
    # Next to zero, where a factor s of numerator and denominator would give 0 / 0.
    expected = 1.0 / (1.0 + sampled_open_loop(loop, omega[1:], c1=c1, c2=c2, sample_rate=rate))
    assert np.fft.rfft(output)[1:-1] == pytest.approx(expected, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("arm", [1, 2])
def test_noise_of_an_arm_is_answered_as_the_closed_form_says(name, arm):
    loop, rate = LOOPS[name]
    impulse = np.zeros(1 << 14)
    impulse[0] = 1.0
    none = np.zeros(impulse.size)
    given: Any = {"c1": 0.8, "c2": -0.6, f"arm{arm}": impulse}
    output = simulate(loop, none, sample_rate=rate, **given)
    omega = 2.0 * np.pi * np.fft.rfftfreq(impulse.size, 1.0 / rate)[1:-1]
    opened = sampled_open_loop(loop, omega, c1=0.8, c2=-0.6, sample_rate=rate)
    s = 2j * rate * np.tan(0.5 * omega / rate)
    expected = -loop.controller(s) * loop.mapping.weights(s)[arm - 1] / (1.0 + opened)
    assert np.fft.rfft(output)[1:-1] == pytest.approx(expected, rel=1e-8, abs=1e-11)


def test_sampled_loop_tends_to_the_continuous_one():
    loop = paper_loop()
    omega = np.geomspace(1e-4, 2.0 * np.pi, 80)
    exact = loop(1j * omega, 1.0, 1.0 - 1e-6)
    closed = [
        np.abs(
            sampled_open_loop(loop, omega, c2=1.0 - 1e-6, sample_rate=rate) / exact - 1.0
        ).max()
        for rate in (100.0, 200.0)
    ]
    assert closed[1] < 1e-4
    assert closed[0] / closed[1] == pytest.approx(4.0, rel=0.05)
    # Interpolated delays are as good as whole ones at frequencies well below the rate.
    whole = sampled_open_loop(loop, omega, sample_rate=RATE)
    between = sampled_open_loop(loop, omega, sample_rate=203.0)
    assert np.abs(between / whole - 1.0).max() < 1e-4


def test_divergence_is_reported_with_its_time():
    loop = CommonArm(1.0, tau1=1.2, tau2=0.8)
    assert unstable_roots(loop, 1.2, 1.2) == 1
    rate = rightmost_root(loop, 1.2, 1.2).real
    noise = np.zeros(2_000_000)
    noise[0] = 1.0
    with pytest.raises(DivergenceError, match="exceeded all input since t = ") as caught:
        simulate(loop, noise, sample_rate=RATE, c1=1.2, c2=1.2)
    error = caught.value
    assert np.isfinite(error.output).all()
    began = round(error.time * RATE)
    assert np.abs(error.output[began]) <= 1.0
    assert np.abs(error.output[began + 1 :]).min() > 0.0
    assert 1e5 < np.abs(error.output[-1]) <= 1e6
    # It takes the limit's 14 e-folds from the one to the other.
    took = error.output.size / RATE - error.time
    assert took == pytest.approx(np.log(1e6) / rate, rel=0.02)
    other = pickle.loads(pickle.dumps(error))
    assert (str(other), other.time) == (str(error), error.time)
    assert np.array_equal(other.output, error.output)


def test_divergence_does_not_depend_on_blocks():
    noise = np.ones(400_000)
    with pytest.raises(DivergenceError) as whole:
        simulate(CommonArm(1.0), noise, sample_rate=RATE, c1=1.2, c2=1.2)
    run = Simulation(CommonArm(1.0), RATE)
    blocks = np.split(noise, 400)
    with pytest.raises(DivergenceError) as parts:
        [run.advance(block, c1=1.2, c2=1.2) for block in blocks]
    assert str(whole.value) == str(parts.value)
    assert run.samples == whole.value.output.size
    last = parts.value.output
    assert np.array_equal(last, whole.value.output[run.samples - last.size :])
    with pytest.raises(DivergenceError):
        run.advance(noise[:10])


def test_blocks_and_a_saved_state_give_the_same_bits():
    """With arms that move, over more samples than are computed together."""
    noise = np.random.default_rng(1).standard_normal(70_000)
    loop = Loop(Controller([], [-0.1], 0.02), COMMON, 20.1, 19.9)
    arms: dict[str, Any] = {
        "tau1": lambda t: 20.13 + 1e-5 * t,
        "tau2": lambda t: 19.957 - 1e-5 * t,
    }
    whole = simulate(loop, noise, c1=0.9, sample_rate=10.0, **arms)
    run, parts = Simulation(loop, 10.0, **arms), []
    for a, b in pairwise([0, 3, 500, 500, noise.size]):
        run = copy.deepcopy(run)
        parts.append(run.advance(noise[a:b], c1=0.9))
        copy.deepcopy(run).advance(noise[:9])
    assert np.array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("slope", [0.9, 0.5, 1e-3, 0.0, -0.02])
@pytest.mark.parametrize("start", [5.0, 5.1, 4.95, 5.13])
def test_blocks_of_any_size_give_the_same_bits(start, slope):
    """Blocks of one sample too, in which a delay that moves may be whole samples."""
    rng = np.random.default_rng(5)
    noise = rng.standard_normal(1000)
    loop = Loop(Controller([], [-0.1], 0.02), COMMON, 20.1, 19.9)
    arms: dict[str, Any] = {"tau1": lambda t: start + slope * t}
    whole = simulate(loop, noise, sample_rate=10.0, **arms)
    run, ends = Simulation(loop, 10.0, **arms), np.cumsum(rng.choice([1, 1, 1, 2, 50], 1000))
    parts = [run.advance(part) for part in np.split(noise, ends)]
    assert np.array_equal(np.concatenate(parts), whole)


def test_a_refused_delay_leaves_the_run_where_it_is():
    """Arm 1, which shrinks, is accepted before arm 2 is refused."""
    loop, right = Loop(Controller([], [-0.1], 0.02), COMMON, 20.1, 19.9), [False]
    noise = np.random.default_rng(8).standard_normal(100)
    run = Simulation(
        loop, 10.0,
        tau1=lambda t: 20.0 - 0.5 * t,
        tau2=lambda t: 20.0 + 0.1 * t if right[0] else 20.0 + 2.0 * t,
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"^tau2\(t\) must grow"):
        run.advance(noise)
    right[0] = True
    assert run.advance(noise).shape == noise.shape
    assert run.samples == 100


@pytest.mark.parametrize(
    "call",
    [
        lambda: simulate(CommonArm(), np.ones(100)),  # type: ignore[call-arg]
        lambda: Simulation(CommonArm()),  # type: ignore[call-arg]
        lambda: sampled_open_loop(CommonArm(), 1.0),  # type: ignore[call-arg]
        lambda: LaserNoise(1),  # type: ignore[call-arg]
        lambda: PerturbationNoise(1),  # type: ignore[call-arg]
    ],
)
def test_a_series_has_no_sample_rate_unless_it_is_given(call):
    with pytest.raises(TypeError, match="sample_rate"):
        call()


def test_numbers_after_the_noise_have_names():
    """The third one could be c1, and 20 for c1 diverges."""
    with pytest.raises(TypeError, match="positional argument"):
        simulate(CommonArm(), np.ones(100), 20.0, sample_rate=RATE)  # type: ignore[misc]


def test_a_dead_time_is_refused_with_the_phase_that_it_has():
    loop = paper_loop(delay=20e-6)
    message = (
        r"^loop must have no dead time .* got delay = 2e-05 s; loop\.replace\(delay=0\.0\) "
        r"neglects it, .* by 0\.00126 rad at 10 Hz, the highest"
    )
    for call in (simulate, sampled_open_loop):
        with pytest.raises(ValueError, match=message):
            call(loop, [1.0], sample_rate=20.0)
    without, at = loop.replace(delay=0.0), 2j * np.pi * 10.0
    turned = np.angle(without(at) / loop(at))
    assert turned == pytest.approx(0.00126, abs=5e-6)


def test_what_memory_cannot_hold_is_refused():
    with pytest.raises(ValueError, match=r"^sample_rate must be of a size that memory holds"):
        simulate(CommonArm(), np.ones(9), sample_rate=1e9)


def test_a_share_of_a_sample_is_seen_at_any_rate():
    """A thousandth of a sample in 2 10^7, which is no rounding error."""
    first, weights = lagrange_weights("tau", np.array(20.0 + 1e-9), 1e6)
    assert (first[0], weights.shape) == (20_000_000 - 3, (1, 8))
    assert weights[0] @ np.arange(8) == pytest.approx(3.001)
    # The last digit of 20.1 * 1e5 = 2010000.0000000002 is.
    first, weights = lagrange_weights("tau", np.array(20.1), 1e5)
    assert (first.tolist(), weights.tolist()) == ([2_010_000], [[1.0]])


def test_a_refused_block_leaves_the_run_where_it_is():
    noise = np.random.default_rng(2).standard_normal(500)
    whole = simulate(CommonArm(), noise, sample_rate=10.0)
    run = Simulation(CommonArm(), 10.0)
    first = run.advance(noise[:200])
    wrong: list[dict[str, Any]] = [
        {"c1": noise[:10]}, {"c2": np.nan}, {"noise": [np.inf]}, {"noise": 3.0},
    ]  # fmt: skip
    for bad in wrong:
        with pytest.raises(ValueError, match=r"^(c1|c2|noise) must"):
            run.advance(**{"noise": noise[200:], **bad})
    assert np.array_equal(np.concatenate([first, run.advance(noise[200:])]), whole)


# Arms that move: by shares of a sample, and over many samples.
MOVES: dict[str, Any] = {
    "tau1": lambda t: 20.13 + 1e-3 * t + 0.02 * np.sin(0.3 * t),
    "tau2": lambda t: 19.957 - 2e-3 * t,
}


def test_moving_arms_against_plain_python():
    """An integrating controller with a zero, by the trapezoidal rule, and eight samples."""
    rate, (gain, zero, pole) = 10.0, (0.02, -0.5, -0.1)
    loop = Loop(Controller([zero], [pole], gain), COMMON, 20.0, 19.0)
    noise, c1, c2 = np.random.default_rng(6).uniform(-0.9, 0.9, (3, 2000))
    delays = {name: move(np.arange(noise.size) / rate) for name, move in MOVES.items()}
    past = 300
    phi = np.zeros(past + noise.size)
    # K = gain + residue / (s - pole), its state by the trapezoidal rule.
    residue, half = gain * (pole - zero), 0.5 / rate
    state = before = 0.0
    for n, given in enumerate(noise):
        now, light = past + n, 0.0
        for c, tau in ((c1, delays["tau1"]), (c2, delays["tau2"])):
            at = now - tau[n] * rate
            nodes = np.arange(int(at) - 3, int(at) + 5)
            light += c[n] * BarycentricInterpolator(nodes - int(at), phi[nodes])(at - int(at))
        # state = (state (1 + half pole) + half (before + u)) / (1 - half pole), and
        # u = 2 phi - light.
        carried = (state * (1.0 + half * pole) + half * before) / (1.0 - half * pole)
        share = gain + residue * half / (1.0 - half * pole)
        phi[now] = (given - residue * carried + share * light) / (1.0 + 2.0 * share)
        before = 2.0 * phi[now] - light
        state = carried + half * before / (1.0 - half * pole)
    found = simulate(loop, noise, c1=c1, c2=c2, sample_rate=rate, **MOVES)
    assert relative_error(found, phi[past:]) < 1e-12


def test_a_moving_delay_that_stands_still_is_a_constant_one():
    """Bit by bit where it is whole samples; otherwise up to rounding."""
    noise = np.random.default_rng(7).standard_normal(3000)
    for delay, accuracy in ((2.0, 0.0), (2.03, 1e-14)):
        loop = Loop(Controller([], [-0.1], 0.2), COMMON, delay, 1.97)
        constant = simulate(loop, noise, c1=0.9, c2=0.8, sample_rate=20.0)
        still = simulate(
            loop, noise, c1=0.9, c2=0.8, sample_rate=20.0,
            tau1=lambda t: np.full(t.size, delay),  # noqa: B023
        )  # fmt: skip
        assert relative_error(still, constant) <= accuracy


def test_a_delay_may_outgrow_what_the_run_began_with():
    """It grows by a tenth, and reaches back to what the run has computed itself."""
    rate, loop = 1000.0, Loop(Controller([], [], 0.2), SINGLE, 2.0, 2.0)
    noise = np.random.default_rng(4).standard_normal(200_000)
    found = simulate(loop, noise, c1=0.5, sample_rate=rate, tau1=lambda t: 2.0 + 0.1 * t)
    t = np.arange(noise.size) / rate
    at = (t - (2.0 + 0.1 * t)) * rate
    known, whole = at > 4.0, np.floor(at).astype(int)
    nodes = np.arange(-3, 5)
    weights = [
        np.prod([(at - whole - j) / (k - j) for j in nodes if j != k], axis=0) for k in nodes
    ]
    light = sum(w * found[whole + k] for w, k in zip(weights, nodes, strict=True))
    expected = (noise + 0.2 * 0.5 * light) / 1.2
    assert relative_error(found[known], expected[known]) < 1e-11


@pytest.mark.parametrize(
    ("tau", "message"),
    [
        (lambda t: 2.0 - 0.5 * t, r"tau1\(t\) must be at least 4 samples .*: 0.2 s"),
        (
            lambda t: 2.0 + 1.1 * t,
            r"tau1\(t\) must grow by less than 1 s a second, got",
        ),
        (lambda t: t[:-1], r"tau1\(t\) must have the shape of t, \(100,\), got \(99,\)"),
        (lambda t: np.where(t < 1.0, 2.0, np.nan), r"tau1\(t\) must be finite, got nan .* 20"),
        (2.6, r"tau1 must be a function of the time in s, got 2.6; loop.replace\(tau1"),
    ],
)
def test_a_delay_that_cannot_be_is_refused(tau, message):
    loop = Loop(Controller([], [-0.1], 0.2), SINGLE, 2.0, 2.0)
    with pytest.raises((TypeError, ValueError), match=f"^{message}"):
        simulate(loop, np.ones(100), sample_rate=20.0, tau1=tau)


def test_constant_factors_give_the_same_on_a_phase_and_on_its_frequency():
    # Numbers and delays of whole samples: cumsum and diff commute with the recursion.
    rate, loop = 10.0, paper_loop()
    frequency = np.random.default_rng(4).normal(size=20_000)
    run: Any = {"c1": 1.0, "c2": 1.0 - 1e-6, "sample_rate": rate, "limit": 1e30}
    of_frequency = simulate(loop, frequency, **run)
    phase = simulate(loop, np.cumsum(frequency) / rate, **run)
    of_phase = np.diff(phase, prepend=0.0) * rate
    assert np.allclose(of_phase, of_frequency, rtol=0, atol=1e-11 * np.abs(of_frequency).max())
    # Factors that vary do not.
    wander = 1.0 + 1e-3 * np.sin(np.arange(frequency.size) / 50.0)
    of_frequency = simulate(loop, frequency, **run | {"c1": wander})
    phase = simulate(loop, np.cumsum(frequency) / rate, **run | {"c1": wander})
    of_phase = np.diff(phase, prepend=0.0) * rate
    assert np.abs(of_phase - of_frequency).max() > 1e-3 * np.abs(of_frequency).max()
