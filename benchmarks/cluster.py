"""Sweeps on a Dask cluster: one worker against two, and how much memory they take."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from armlock import LaserNoise, paper_loop, simulate_blocks, sweep
from benchmarks import child, report
from benchmarks.report import Row, Topic, memory_row, timed

SCALING = 1.8
MEMORY = 320 * 2**20
BLOCK = 1 << 16


def largest(task: tuple[int, int]) -> float:
    """Return the largest output of a draw, in blocks: a seed and a number of samples."""
    seed, samples = task
    blocks = LaserNoise(seed, at_rest=True).blocks(samples, BLOCK)
    return max(float(np.abs(part).max()) for part in simulate_blocks(paper_loop(), blocks))


def run(*, quick: bool, folder: Path) -> Topic:
    """Measure how much faster two workers are than one."""
    from distributed import Client

    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    draws, samples = (4, 20_000) if quick else (32, 10_000_000)
    tasks = [(seed, samples) for seed in range(draws)]
    seconds, found, memory = [], [], 0
    for workers in (1, 2):
        with Client(n_workers=workers, threads_per_worker=1, dashboard_address=None) as client:
            # The workers start, and load what is compiled.
            sweep(largest, tasks[:workers], executor=client.get_executor())
            took, results = timed(sweep, largest, tasks, executor=client.get_executor())
            seconds.append(took)
            found.append(results)
            memory = max(memory, *client.run(child.peak_memory).values())
    ratio = seconds[0] / seconds[1]
    enough = report.cores() >= 2
    topic = Topic(f"A Dask cluster: {draws} draws of {samples:.3g} samples")
    topic.rows += [
        Row("one worker", seconds[0]),
        Row("two workers", seconds[1], ratio, f"at least {SCALING:g}" if enough else "",
            ratio >= SCALING if enough else None),
        memory_row("a worker", memory, MEMORY),
        Row("results of both", None, None, "bit by bit", found[0] == found[1],
            correctness=True),
    ]  # fmt: skip
    return topic
