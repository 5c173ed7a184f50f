"""The simulation: against other ways to run the same loop.

The requirement: at least as fast as a plain compiled loop of the same arithmetic, and a
hundred times as fast as that loop in Python. Tests hold it against 106 bits.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from armlock import LaserNoise, Loop, PerturbationNoise, paper_loop, simulate
from armlock.checks import FloatArray
from armlock.paper import SAMPLE_RATE, TAU1, TAU2
from armlock.timedomain.discretize import sampled_loop
from benchmarks.report import Row, Topic, timed

PYTHON_RATIO = 100.0
ENSEMBLE_RATIO = 2.5
ACCURACY = 1e-10
DRAWS = 32


@dataclass(frozen=True)
class Sizes:
    """How much is measured, in samples."""

    samples: int = 40_000_000
    python: int = 100_000
    compared: int = 1_000_000
    passes: int = 4


QUICK = Sizes(samples=30_000, python=6_000, compared=30_000, passes=1)


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


def inputs(samples: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    noise = LaserNoise(1).draw(samples)
    c1, c2 = (PerturbationNoise(seed, scale=1e-4).draw(samples) for seed in (2, 3))
    c1 += 1.0
    c2 += 1.0
    return noise, c1, c2


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
    topic.rows += ensemble_rows(loop, noise, c1, c2, sizes.passes)
    compared = slice(0, 4 * sizes.compared)
    output = simulate(loop, noise[compared], c1[compared], c2[compared])
    phi = plain_output(noise[compared], c1[compared], c2[compared], arguments)
    same = float(np.abs(output - phi).max() / np.abs(output).max())
    topic.rows.append(Row(f"simulate and plain loop differ by {same:.1e}", None, None,
                          "at most 1e-10", same <= ACCURACY, correctness=True))  # fmt: skip
    topic.data.update(simulate=ours, plain=theirs, python=slow, difference=same)
    topic.notes += [
        f"[a] Extrapolated from {sizes.python} samples.",
        "simulate and the plain loop each make their output, and are timed in turn after "
        "compiling; the best of "
        f"{sizes.passes} runs each.",
        "[b] The ratio is that to the same runs one by one, on one core, in turn: the median "
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
            timed(function, clock=time.process_time)[0]
            for function in (
                lambda: simulate(loop, *together).size,
                lambda: [simulate(loop, *row).size for row in rows],
            )
        ]
        for _ in range(5 * passes)
    ])  # fmt: skip
    # Processor time, in turn, so that other work on the machine slows down both.
    low, ratio, high = np.quantile(times[:, 1] / times[:, 0], (0.1, 0.5, 0.9))
    return [
        Row(f"ensemble of {DRAWS}, {shape[0]:.3g} samples each [b]", float(times[:, 0].min()),
            float(ratio), f"at least {ENSEMBLE_RATIO:g}", bool(ratio >= ENSEMBLE_RATIO)),
        Row(f"its ratio, from the 10th to the 90th percent: {low:.2f} to {high:.2f}"),
        Row("ensemble and single runs agree", None, None, "bit by bit", same, correctness=True),
    ]  # fmt: skip
