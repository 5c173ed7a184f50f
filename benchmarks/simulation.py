"""The simulation: against other ways to run the same loop.

The requirement: at least as fast as a plain compiled loop of the same arithmetic. Tests hold it
against 106 bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numba import njit

from armlock import LaserNoise, Loop, PerturbationNoise, paper_loop, simulate
from armlock.checks import FloatArray
from armlock.paper import SAMPLE_RATE, TAU1, TAU2
from armlock.timedomain.discretize import sampled_loop
from benchmarks.measure import in_turn
from benchmarks.report import Row, Topic, at_least

# Delays between samples, in s, and their change in s/s: as that of ESA's arms, some samples.
BETWEEN = (TAU1 + 0.4 / SAMPLE_RATE, 6e-8), (TAU2 + 0.3 / SAMPLE_RATE, -5e-8)
ACCURACY = 1e-10

#: The noise and both perturbations.
Inputs = tuple[FloatArray, FloatArray, FloatArray]


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


def plain_output(series: Inputs, arguments: tuple[Any, ...]) -> FloatArray:
    """Run the plain compiled loop, room for the output included, as `simulate` has it."""
    phi = np.zeros_like(series[0])
    compiled(*series, *arguments, phi)
    return phi


def plain_arguments(loop: Loop) -> tuple[Any, ...]:
    sensor, controller = sampled_loop(loop.controller, loop.mapping, SAMPLE_RATE)
    delays = round(TAU1 * SAMPLE_RATE), round(TAU2 * SAMPLE_RATE)
    arrays = (np.array(part) for part in (sensor.states, sensor.direct, controller.sections))
    return (*delays, *arrays, controller.gain)


def inputs(samples: int) -> Inputs:
    noise = LaserNoise(1, SAMPLE_RATE).draw(samples)
    c1, c2 = (
        1.0 + 1e-4 * PerturbationNoise(seed, SAMPLE_RATE).draw(samples) for seed in (2, 3)
    )
    return noise, c1, c2


def part(series: Inputs, samples: int) -> Inputs:
    noise, c1, c2 = series
    return noise[:samples], c1[:samples], c2[:samples]


def plain_rows(loop: Loop, series: Inputs, passes: int) -> list[Row]:
    """Compare `simulate` with the plain loop."""
    arguments = plain_arguments(loop)
    calls = [
        lambda: locked_size(loop, series),
        lambda: plain_output(series, arguments).size,
    ]
    ours, theirs = in_turn(calls, passes).min(axis=0)
    some = part(series, 4_000_000)
    output = simulate(loop, some[0], sample_rate=SAMPLE_RATE, c1=some[1], c2=some[2])
    phi = plain_output(some, arguments)
    differ = float(np.abs(output - phi).max() / np.abs(output).max())
    return [
        Row("simulate", ours),
        at_least("plain compiled loop [a]", theirs, theirs / ours, 1.0),
        Row(f"simulate and plain loop differ by {differ:.1e}", None, None,
            f"at most {ACCURACY:g}", differ <= ACCURACY, correctness=True),
    ]  # fmt: skip


def moving_rows(loop: Loop, series: Inputs) -> list[Row]:
    """Measure arms that move, and constant delays between samples."""
    near = loop.replace(tau1=BETWEEN[0][0], tau2=BETWEEN[1][0])
    moves = [partial(moving, tau=tau, rate=rate) for tau, rate in BETWEEN]
    calls = [partial(locked_size, near, series), partial(locked_size, loop, series, moves)]
    constant, move = in_turn(calls, 1)[0]
    return [
        Row("constant delays between samples", constant),
        Row("arms that move", move, move / constant),
    ]


def moving(t: FloatArray, *, tau: float, rate: float) -> FloatArray:
    """Return a delay that grows at a constant rate."""
    return np.asarray(tau + rate * t)


def locked_size(loop: Loop, series: Inputs, delays: Sequence[Any] = (None, None)) -> int:
    """Run a loop; nothing is kept."""
    noise, c1, c2 = series
    return simulate(
        loop, noise, sample_rate=SAMPLE_RATE, c1=c1, c2=c2, tau1=delays[0], tau2=delays[1]
    ).size


def run(*, quick: bool) -> Topic:
    """Measure speed and accuracy of the simulation."""
    samples, passes = (30_000, 1) if quick else (40_000_000, 4)
    loop, series = paper_loop(), inputs(samples)
    rows = plain_rows(loop, series, passes) + moving_rows(loop, series)
    notes = [f"[a] Both loops make their output; the best of {passes} runs each."]
    return Topic(f"Simulation of the paper's loop, {samples:.3g} samples", rows, notes)
