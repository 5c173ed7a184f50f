"""The simulation: against other ways to run the same loop, and against 106 bits.

The requirement: at least as fast as a plain compiled loop of the same arithmetic, and a
hundred times as fast as that loop in Python; a relative error of at most 1e-10.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import control
import numpy as np
from numba import njit
from scipy.signal import bilinear_zpk, zpk2sos

from armlock import LaserNoise, Loop, PerturbationNoise, paper, paper_loop, simulate
from armlock.checks import FloatArray
from armlock.discretize import sampled_loop
from armlock.paper import SAMPLE_RATE, TAU1, TAU2
from benchmarks import child
from benchmarks.report import Row, Topic
from tests.extended import reference

PYTHON_RATIO = 100.0
ENSEMBLE_RATIO = 2.5
ACCURACY = 1e-10
MEMORY = 2 * 2**30
CHAPTER = 90.0
PADE_ORDER = 10
DRAWS = 32


@dataclass(frozen=True)
class Sizes:
    """How much is measured, in samples."""

    samples: int = 40_000_000
    python: int = 100_000
    pade: int = 100_000
    compared: int = 1_000_000
    passes: int = 4
    chapter: bool = True


QUICK = Sizes(
    samples=30_000, python=6_000, pade=5_000, compared=30_000, passes=1, chapter=False
)


def timed(
    function: Callable[[], Any], clock: Callable[[], float] = time.perf_counter
) -> tuple[float, Any]:
    start = clock()
    result = function()
    return clock() - start, result


def plain(
    noise: FloatArray,
    c1: FloatArray,
    c2: FloatArray,
    r1: int,
    r2: int,
    sensor: FloatArray,
    direct: FloatArray,
    sections: FloatArray,
    gain: float,
    phi: FloatArray,
) -> None:
    """Run the loop as one would write it down: the same sections, sample by sample."""
    w = np.zeros(len(sensor))
    v = np.zeros((len(sections), 2))
    for i in range(noise.size):
        a1 = c1[i] * phi[i - r1] if i >= r1 else 0.0
        a2 = c2[i] * phi[i - r2] if i >= r2 else 0.0
        rest = w[-1]
        for j in range(len(sections)):
            rest += sections[j, 3] * v[j, 0] + sections[j, 4] * v[j, 1]
        x = noise[i] + gain * (direct[0] * a1 + direct[1] * a2 - rest)
        x /= 1.0 + gain * (direct[0] + direct[1])
        phi[i] = x
        y = w[-1]
        before = 0.0
        for j in range(len(sensor)):
            change = before - sensor[j, 0] * y
            before = w[j]
            w[j] += change + sensor[j, 1] * (x - a1) + sensor[j, 2] * (x - a2)
        y += direct[0] * (x - a1) + direct[1] * (x - a2)
        for j in range(len(sections)):
            passed = y + sections[j, 3] * v[j, 0] + sections[j, 4] * v[j, 1]
            change = sections[j, 0] * v[j, 0] - sections[j, 2] * v[j, 1] + y
            v[j, 1] += sections[j, 1] * v[j, 1] + v[j, 0]
            v[j, 0] += change
            y = passed


compiled = njit(plain)


def plain_output(
    noise: FloatArray, c1: FloatArray, c2: FloatArray, arguments: tuple[Any, ...]
) -> FloatArray:
    """Run the plain compiled loop, room for the output included, as `simulate` has it."""
    phi = np.zeros_like(noise)
    compiled(noise, c1, c2, *arguments, phi)
    return phi


def plain_arguments(loop: Loop) -> tuple[Any, ...]:
    sensor, controller = sampled_loop(loop.controller, loop.mapping, SAMPLE_RATE)
    delays = round(TAU1 * SAMPLE_RATE), round(TAU2 * SAMPLE_RATE)
    arrays = (np.array(part) for part in (sensor.states, sensor.direct, controller.sections))
    return (*delays, *arrays, controller.gain)


@njit
def _sections(sos: Any, state: FloatArray, v: float, move: bool) -> float:
    for i in range(sos.shape[0]):
        y = sos[i, 0] * v + state[i, 0]
        if move:
            state[i, 0] = sos[i, 1] * v - sos[i, 4] * y + state[i, 1]
            state[i, 1] = sos[i, 2] * v - sos[i, 5] * y
        v = y
    return v


@njit
def _naive(
    noise: FloatArray, c1: FloatArray, c2: FloatArray, r1: int, r2: int, sos1: Any, sos2: Any
) -> FloatArray:
    phi = np.zeros(noise.size)
    s1, s2 = np.zeros((sos1.shape[0], 2)), np.zeros((sos2.shape[0], 2))
    f1, f2 = 1.0, 1.0
    for i in range(sos1.shape[0]):
        f1 *= sos1[i, 0]
    for i in range(sos2.shape[0]):
        f2 *= sos2[i, 0]
    for i in range(noise.size):
        a1 = c1[i] * phi[i - r1] if i >= r1 else 0.0
        a2 = c2[i] * phi[i - r2] if i >= r2 else 0.0
        rest = _sections(sos1, s1, 0.0, False) + _sections(sos2, s2, 0.0, False)
        right = noise[i] - rest + f1 * (a1 + a2) + f2 * (a1 - a2)
        x = right / (1.0 + 2.0 * f1)
        phi[i] = x
        _sections(sos1, s1, 2.0 * x - a1 - a2, True)
        _sections(sos2, s2, a2 - a1, True)
    return phi


def naive(noise: FloatArray, c1: FloatArray, c2: FloatArray, rate: float = SAMPLE_RATE) -> Any:
    """Return it from second-order sections, as scipy stores them, the loop closed exactly."""
    stage, zeros = -paper.TABLE_2_STAGE_1_POLE, [-z for z in paper.TABLE_2_ZEROS]
    poles = [stage, stage, *(-p for p in paper.TABLE_2_POLES)]
    corner, gain = paper.DUAL_SENSOR_CORNER, paper.CONTROLLER_GAIN
    scale = corner / (TAU1 - TAU2)
    sum_path = zpk2sos(*bilinear_zpk([0.0, 0.0, *zeros], poles, gain, rate))
    apart = zpk2sos(*bilinear_zpk([0.0, *zeros], [*poles, -corner], gain * scale, rate))
    r1, r2 = round(TAU1 * rate), round(TAU2 * rate)
    return _naive(noise, c1, c2, r1, r2, sum_path, apart)


def inputs(samples: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    noise = LaserNoise(1).draw(samples)
    c1, c2 = (PerturbationNoise(seed, scale=1e-4).draw(samples) for seed in (2, 3))
    c1 += 1.0
    c2 += 1.0
    return noise, c1, c2


def pade_loop(loop: Loop) -> Any:
    """Return the closed loop with Pade delays, constant c1 = c2 = 1, in discrete time."""
    arms = [
        1.0 - control.ss(control.tf(*control.pade(tau, PADE_ORDER))) for tau in (TAU1, TAU2)
    ]
    zeros, poles, gain = loop.controller.zeros, loop.controller.poles, loop.controller.gain
    whole = control.ss(control.zpk(np.real(zeros), np.real(poles), gain))
    # One zero at s = 0 cancels the sensor's integrator.
    less = control.ss(control.zpk(np.real(zeros[1:]), np.real(poles), gain))
    p, scale = loop.mapping.denominator[1], loop.mapping.denominator[2]
    low = control.ss(control.tf([loop.mapping.numerator1[0] / scale], [1.0, p / scale]))
    opened = whole * (arms[0] + arms[1]) + less * low * (arms[0] - arms[1])
    return control.c2d(control.feedback(1, opened), 1.0 / SAMPLE_RATE, "tustin")


def chapter_run() -> tuple[float, int]:
    """Run what the chapter of the simulation computes; return seconds and peak memory."""
    from book.companion.claims import check

    start = time.perf_counter()
    check(*(f"M{number}" for number in range(1, 9)))
    return time.perf_counter() - start, child.peak_memory()


def run(*, quick: bool, folder: Path) -> Topic:
    """Measure speed, accuracy and memory of the simulation."""
    sizes = QUICK if quick else Sizes()
    topic = Topic(f"Simulation of the paper's loop, {sizes.samples:.3g} samples")
    topic.data["sizes"] = asdict(sizes)
    loop = paper_loop()
    noise, c1, c2 = inputs(sizes.samples)
    arguments = plain_arguments(loop)
    short = slice(0, 5000)
    simulate(loop, noise[short], c1[short], c2[short])
    plain_output(noise[short], c1[short], c2[short], arguments)
    ours, theirs = [], []
    for _ in range(sizes.passes):
        # No result is kept, so that both find the same memory free.
        ours.append(timed(lambda: simulate(loop, noise, c1, c2).size)[0])
        theirs.append(timed(lambda: plain_output(noise, c1, c2, arguments).size)[0])
    part = slice(0, sizes.python)
    few = noise[part], c1[part], c2[part]
    slow = timed(lambda: plain(*few, *arguments, np.zeros(sizes.python)))[0]
    slow *= sizes.samples / sizes.python
    best, other = min(ours), min(theirs)
    topic.rows += [
        Row("simulate", best),
        Row("plain compiled loop", other, other / best, "at least 1", other >= best),
        Row("plain loop in Python [a]", slow, slow / best, f"at least {PYTHON_RATIO:g}",
            slow / best >= PYTHON_RATIO),
    ]  # fmt: skip
    closed = pade_loop(loop)
    steps = np.arange(sizes.pade) / SAMPLE_RATE
    seconds = timed(lambda: control.forced_response(closed, steps, noise[: sizes.pade]))[0]
    seconds *= sizes.samples / sizes.pade
    topic.rows.append(
        Row(f"python-control, Pade order {PADE_ORDER} [b]", seconds, seconds / best)
    )
    topic.rows += ensemble_rows(loop, noise, c1, c2, sizes.passes)
    topic.rows += accuracy_rows(loop, noise, c1, c2, sizes.compared)
    compared = slice(0, 4 * sizes.compared)
    output = simulate(loop, noise[compared], c1[compared], c2[compared])
    phi = plain_output(noise[compared], c1[compared], c2[compared], arguments)
    same = float(np.abs(output - phi).max() / np.abs(output).max())
    topic.rows.append(Row(f"simulate and plain loop differ by {same:.1e}", None, None,
                          "at most 1e-10", same <= ACCURACY, correctness=True))  # fmt: skip
    topic.data.update(simulate=ours, plain=theirs, python=slow, pade=seconds, difference=same)
    if sizes.chapter:
        seconds, memory = child.call("benchmarks.simulation", "chapter_run", {})
        topic.rows += [
            Row("what the chapter computes, at full size", seconds, None,
                f"at most {CHAPTER:g} s", seconds <= CHAPTER),
            Row(f"its peak memory: {memory / 2**20:.0f} MiB", None, None,
                f"at most {MEMORY / 2**20:.0f} MiB", memory <= MEMORY),
        ]  # fmt: skip
        topic.data.update(chapter=seconds, memory=memory)
    topic.notes += [
        f"[a] Extrapolated from {sizes.python} samples.",
        f"[b] Extrapolated from {sizes.pade} samples. Constant c1 = c2 = 1, for it has no "
        "others; delays by Pade approximants, so that the result is another one.",
        "simulate and the plain loop each make their output, and are timed in turn after "
        "compiling; the best of "
        f"{sizes.passes} runs each.",
        "[c] The ratio is that to the same runs one by one, on one core, in turn: the median "
        f"of {5 * sizes.passes} passes, in processor time.",
    ]
    return topic


def ensemble_rows(
    loop: Loop, noise: FloatArray, c1: FloatArray, c2: FloatArray, passes: int
) -> list[Row]:
    """Compare an ensemble with its runs one by one, in turn, by processor time."""
    shape = min(noise.size // DRAWS, 100_000), DRAWS
    # The same sample of all draws side by side, as `Simulation` would have it.
    together = [part[: shape[0] * DRAWS].reshape(shape).T for part in (noise, c1, c2)]
    singly = [np.ascontiguousarray(part) for part in together]
    rows = list(zip(*singly, strict=True))
    same = np.array_equal(simulate(loop, *together), [simulate(loop, *row) for row in rows])
    times = np.array([
        [
            timed(lambda: simulate(loop, *together).size, time.process_time)[0],
            timed(lambda: [simulate(loop, *row).size for row in rows], time.process_time)[0],
        ]
        for _ in range(5 * passes)
    ])  # fmt: skip
    # Processor time, in turn, so that other work on the machine slows down both.
    low, ratio, high = np.quantile(times[:, 1] / times[:, 0], (0.1, 0.5, 0.9))
    return [
        Row(f"ensemble of {DRAWS}, {shape[0]:.3g} samples each [c]", float(times[:, 0].min()),
            float(ratio), f"at least {ENSEMBLE_RATIO:g}", bool(ratio >= ENSEMBLE_RATIO)),
        Row(f"its ratio, from the 10th to the 90th percent: {low:.2f} to {high:.2f}"),
        Row("ensemble and single runs agree", None, None, "bit by bit", same, correctness=True),
    ]  # fmt: skip


def accuracy_rows(
    loop: Loop, noise: FloatArray, c1: FloatArray, c2: FloatArray, samples: int
) -> list[Row]:
    """Compare with the same loop in 106 bits, c1 and c2 varying."""
    part = slice(0, samples)
    series = noise[part], c1[part], c2[part]
    exact = reference(*series)

    def error(found: FloatArray) -> float:
        return float(np.abs(found - exact).max() / np.abs(exact).max())

    ours, usual = error(simulate(loop, *series)), error(naive(*series))
    return [
        Row(f"relative error over {samples:.3g} samples: {ours:.1e}", None, None,
            f"at most {ACCURACY:g}", ours <= ACCURACY, correctness=True),
        Row(f"that of second-order sections: {usual:.1e}"),
    ]  # fmt: skip
