"""The loop in time: accuracy, closed form, verdicts, blocks, divergence, bad input."""

import pickle
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.signal import bilinear_zpk, lfilter, zpk2tf

from armlock import (
    CommonArm,
    Controller,
    DivergenceError,
    LaserNoise,
    Loop,
    PerturbationNoise,
    Simulation,
    SingleArm,
    paper_loop,
    rightmost_root,
    sampled_open_loop,
    save_series,
    simulate,
    simulate_blocks,
    unstable_roots,
)
from armlock.sensors import COMMON, SignalMapping
from armlock.timedomain.simulation import BLOCK, LANES, lagrange_delay
from tests import independent

RATE = 200.0


def relative_error(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


def test_accuracy_over_a_million_samples():
    """With c1 and c2 that change."""
    noise = LaserNoise(1).draw(1_200_000)
    c1, c2 = (1.0 + PerturbationNoise(k, scale=1e-4).draw(noise.size) for k in (2, 3))
    expected = independent.locked_paper_loop(noise, c1, c2, RATE)
    assert c1.std() > 1e-7
    assert c2.std() > 1e-7
    found = simulate(paper_loop(), noise, c1, c2)
    assert relative_error(found, expected) < 1e-12
    # Of each sample too, but for those that happen to be near zero.
    assert np.quantile(np.abs(found / expected - 1.0), 0.99) < 1e-11


LOOPS = {
    "neutral": (Loop(Controller([-0.3], [-0.1], 0.2), COMMON, 2.0, 1.5), 10.0),
    "dead time": (Loop(Controller([], [-0.1], 0.2), COMMON, 20.1, 19.9, 0.3), 10.0),
    "dead time between samples": (
        Loop(Controller([-9.0], [-0.1], 0.02), COMMON, 20.13, 19.957, 0.633),
        7.0,
    ),
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
    output = simulate(loop, impulse, c1, c2, rate)
    assert np.abs(output[-2000:]).max() < 1e-13
    omega = 2.0 * np.pi * np.fft.rfftfreq(impulse.size, 1.0 / rate)[:-1]
    # Next to zero, where a factor s of numerator and denominator would give 0 / 0.
    expected = 1.0 / (1.0 + sampled_open_loop(loop, omega[1:], c1, c2, rate))
    assert np.fft.rfft(output)[1:-1] == pytest.approx(expected, rel=1e-9, abs=1e-11)


def test_sampled_loop_tends_to_the_continuous_one():
    loop = paper_loop()
    omega = np.geomspace(1e-4, 2.0 * np.pi, 80)
    exact = loop.open_loop(1j * omega, 1.0, 1.0 - 1e-6)
    closed = [
        np.abs(sampled_open_loop(loop, omega, 1.0, 1.0 - 1e-6, rate) / exact - 1.0).max()
        for rate in (100.0, 200.0)
    ]
    assert closed[1] < 1e-4
    assert closed[0] / closed[1] == pytest.approx(4.0, rel=0.05)
    # Interpolated delays are as good as whole ones at frequencies well below the rate.
    whole = sampled_open_loop(loop, omega, 1.0, 1.0, 200.0)
    between = sampled_open_loop(loop, omega, 1.0, 1.0, 203.0)
    assert np.abs(between / whole - 1.0).max() < 1e-4


@pytest.mark.parametrize("dead", [1, 90])
def test_dead_time_and_moving_arms_against_the_difference_equation(dead):
    """A controller without dynamics; each arm's factor is that of the moment it arrives."""
    (gain, rate), (r1, r2) = (0.2, 20.0), (80, 70)
    loop = Loop(Controller([], [], gain), COMMON, r1 / rate, r2 / rate, dead / rate)
    noise, c1, c2 = np.random.default_rng(6).uniform(-0.9, 0.9, (3, 3000))
    past = max(r1, r2, dead)
    phi, sent = np.zeros((2, past + noise.size))
    for i, n in enumerate(noise):
        k = past + i
        phi[k] = n - sent[k - dead]
        sent[k] = gain * (2.0 * phi[k] - c1[i] * phi[k - r1] - c2[i] * phi[k - r2])
    assert relative_error(simulate(loop, noise, c1, c2, rate), phi[past:]) < 1e-12


def test_delays_that_the_rate_does_not_resolve_are_refused():
    loop = Loop(Controller([], [-0.1], 0.2), COMMON, 20.1, 19.9, 1e-3)
    message = r"sample_rate must be at least 4000\.0 Hz to interpolate delay = 0\.001 s, or a"
    with pytest.raises(ValueError, match=message):
        Simulation(loop, 200.0)
    with pytest.raises(ValueError, match=message):
        sampled_open_loop(loop, 1.0, sample_rate=200.0)
    assert Simulation(loop, 1000.0).advance(np.ones(3)).shape == (3,)
    assert Simulation(loop, 4100.0).advance(np.ones(3)).shape == (3,)


def test_history_acts_like_noise_behind_the_controller():
    """What is in the arms when a run starts comes back, and goes through the controller."""
    loop = Loop(Controller([], [-0.1], 0.2), COMMON, 2.0, 1.5)
    assert Simulation(loop, 10.0).history_samples == 20
    noise, past = np.random.default_rng(1).standard_normal((2, 300))
    late = np.zeros(300)
    late[:20] += 0.9 * past[-20:]
    late[:15] += 0.8 * past[-15:]
    above, below = zpk2tf(*bilinear_zpk([], [-0.1], 0.2, 10.0))
    expected = simulate(loop, noise + lfilter(above, below, late), 0.9, 0.8, 10.0)
    found = simulate(loop, noise, 0.9, 0.8, 10.0, history=past)
    assert found == pytest.approx(expected, rel=1e-11)
    constant = simulate(loop, noise, 0.9, 0.8, 10.0, history=0.5)
    assert np.array_equal(constant, simulate(loop, noise, 0.9, 0.8, 10.0, history=[0.5] * 20))


def test_divergence_is_reported_with_its_time():
    loop = CommonArm(1.0, tau1=1.2, tau2=0.8)
    assert unstable_roots(loop, 1.2, 1.2) == 1
    rate = rightmost_root(loop, 1.2, 1.2).real
    noise = np.zeros(2_000_000)
    noise[0] = 1.0
    with pytest.raises(DivergenceError, match="exceeded all input since t = ") as caught:
        simulate(loop, noise, 1.2, 1.2)
    error = caught.value
    assert np.isfinite(error.output).all()
    assert error.output.size == round(error.detected * RATE)
    began = round(error.time * RATE)
    assert np.abs(error.output[began]) <= 1.0
    assert np.abs(error.output[began + 1 :]).min() > 0.0
    assert np.abs(error.output).max() <= 1e6
    # It takes the limit's 14 e-folds from the one to the other.
    assert error.detected - error.time == pytest.approx(np.log(1e6) / rate, rel=0.02)
    other = pickle.loads(pickle.dumps(error))
    assert (str(other), other.time, other.detected) == (str(error), error.time, error.detected)
    assert np.array_equal(other.output, error.output)


def test_divergence_does_not_depend_on_blocks():
    noise = np.ones(400_000)
    with pytest.raises(DivergenceError) as whole:
        simulate(CommonArm(1.0), noise, 1.2, 1.2)
    run = Simulation(CommonArm(1.0))
    blocks = np.split(noise, 400)
    with pytest.raises(DivergenceError) as parts:
        [run.advance(block, 1.2, 1.2) for block in blocks]
    assert (whole.value.time, whole.value.detected) == (parts.value.time, parts.value.detected)
    assert run.samples == whole.value.output.size
    last = parts.value.output
    assert np.array_equal(last, whole.value.output[run.samples - last.size :])
    with pytest.raises(DivergenceError):
        run.advance(noise[:10])


def test_a_stream_is_read_block_by_block_and_saved_with_the_same_bits(tmp_path):
    """While it is written, what another process sees has another name."""
    rows = np.random.default_rng(1).standard_normal((BLOCK + 5000, 3)) * (1.0, 1e-3, 1e-3)
    noise, c1, c2 = rows.T
    seen = []

    def blocks():
        for a, b in pairwise([0, 1, 2, 2, 4019, 4020, 9000, BLOCK, noise.size]):
            seen.append([path.suffix for path in tmp_path.iterdir()])
            yield noise[a:b], c1[a:b], c2[a:b]

    target = tmp_path / "run.npy"
    assert save_series(target, simulate_blocks(paper_loop(), blocks())) == noise.size
    assert np.array_equal(np.load(target), simulate(paper_loop(), noise, c1, c2))
    assert seen == [[".part"]] * 8
    assert [path.name for path in tmp_path.iterdir()] == ["run.npy"]


def test_an_interrupted_run_leaves_the_file_of_the_last_one(tmp_path):
    def blocks():
        yield np.ones(1000)
        raise KeyboardInterrupt

    target = tmp_path / "run.npy"
    np.save(target, np.arange(3.0))
    with pytest.raises(KeyboardInterrupt):
        save_series(target, simulate_blocks(CommonArm(), blocks(), 10.0))
    assert np.array_equal(np.load(target), np.arange(3.0))


def test_a_share_of_a_sample_is_seen_at_any_rate():
    """A thousandth of a sample in 2 10^7, which is no rounding error."""
    first, weights = lagrange_delay("tau", 20.0 + 1e-9, 1e6)
    assert (first, len(weights)) == (20_000_000 - 3, 8)
    assert sum(k * weight for k, weight in enumerate(weights)) == pytest.approx(3.001)
    # The last digit of 20.1 * 1e5 = 2010000.0000000002 is.
    assert lagrange_delay("tau", 20.1, 1e5) == (2_010_000, (1.0,))


def test_a_refused_block_leaves_the_run_where_it_is():
    noise = np.random.default_rng(2).standard_normal(500)
    whole = simulate(CommonArm(), noise, sample_rate=10.0)
    run = Simulation(CommonArm(), 10.0)
    first = run.advance(noise[:200])
    for bad in ((noise[200:], noise[:10]), (noise[200:], 1.0, np.nan), ([np.inf],), (3.0,)):
        with pytest.raises(ValueError, match=r"^(c1|c2|noise) must"):
            run.advance(*bad)
    assert np.array_equal(np.concatenate([first, run.advance(noise[200:])]), whole)


@pytest.mark.parametrize("draws", [1, LANES // 2 - 1, LANES // 2, 2 * LANES + 3])
@pytest.mark.parametrize("name", sorted(LOOPS))
def test_an_ensemble_is_its_runs_bit_by_bit(name, draws):
    loop, rate = LOOPS[name]
    noise, c1, c2 = np.random.default_rng(4).standard_normal((3, draws, 700))
    c1, c2 = 0.5 + 0.1 * c1, np.asfortranarray(0.5 + 0.1 * c2)
    arguments: dict[str, Any] = {"sample_rate": rate, "history": 0.25, "limit": 1e30}
    found = simulate(loop, noise, c1, c2, **arguments)
    one_by_one = [simulate(loop, *row, **arguments) for row in zip(noise, c1, c2, strict=True)]
    assert np.array_equal(found, one_by_one)
    run = Simulation(loop, rate, history=0.25, limit=1e30, draws=draws)
    parts = [
        run.advance(np.asfortranarray(noise[:, a:b]), c1[:, a:b], c2[:, a:b])
        for a, b in pairwise([0, 1, 400, 700])
    ]
    assert np.array_equal(np.hstack(parts), found)


def test_an_ensemble_stops_with_the_first_run_that_diverges():
    noise = np.ones((LANES + 2, 20_000))
    c1 = np.full_like(noise, 0.5)
    c1[3], c1[LANES] = 3.0, 2.0
    with pytest.raises(DivergenceError) as alone:
        simulate(SingleArm(), noise[3], c1[3], limit=10.0)
    with pytest.raises(DivergenceError) as caught:
        simulate(SingleArm(), noise, c1, limit=10.0)
    assert (caught.value.time, caught.value.detected) == (
        alone.value.time,
        alone.value.detected,
    )
    assert np.array_equal(caught.value.output[3], alone.value.output)
    assert caught.value.output.shape == (len(noise), alone.value.output.size)


def test_an_ensemble_refuses_other_shapes():
    noise = np.ones((3, 50))
    for wrong in ((noise, noise[0]), (noise[:2],), (noise[0],), (noise[None],)):
        with pytest.raises(ValueError, match=r"^(c1|noise) must"):
            Simulation(CommonArm(), 10.0, draws=3).advance(*wrong)
