"""Other tools on the same twenty loops: how many they count rightly, and how long it takes.

tdcpy and tdscontrol are no dependency of this package; what is not installed is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

import control
import numpy as np

from armlock import CommonArm, DualArm, Loop, transition_matrix, unstable_roots
from armlock.checks import FloatArray
from armlock.stability.semidiscretization import realize
from benchmarks.report import Row, Topic, timed

SEED = 28
Point = tuple[Loop, float, float]


def twenty_loops() -> list[Point]:
    """Draw ten common and ten dual arms, with points of the plane around them."""
    rng = np.random.default_rng(SEED)
    points: list[Point] = []
    for _ in range(10):
        gain = float(10.0 ** rng.uniform(-1.0, 0.5))
        common, dual = CommonArm(gain=gain), DualArm(gain=gain)
        c1, c2, d1, d2 = rng.uniform(-2.5, 2.5, 4)
        points += [(common, float(c1), float(c2)), (dual, float(0.4 * d1), float(0.4 * d2))]
    return points


def delay_equation(point: Point) -> tuple[list[FloatArray], list[float]]:
    """Return the matrices of x'(t) = sum_k A_k x(t - h_k), and the h_k."""
    state, delayed = realize(*point)
    matrices, delays = [state], [0.0]
    for term in delayed:
        matrix = np.zeros_like(state)
        matrix[:, 0] = term.column
        matrices.append(matrix)
        delays.append(term.delay)
    return matrices, delays


def by_tdcpy(point: Point) -> int:
    """Count by tdcpy; its largest eigenvalue problem may have 2 000 rows in place of 600.

    What its own Newton's method has not brought to a root is left out.
    """
    tdcpy: Any = import_module("tdcpy")
    matrices, delays = delay_equation(point)
    system = tdcpy.RDDE(np.stack(matrices, axis=2), np.array(delays))
    found, _ = tdcpy.roots(system, 0.0, max_size_evp=2000)
    return int((np.abs(point[0](found, *point[1:])) < 1e-6).sum())


def by_tdscontrol(point: Point) -> int:
    """Count by tdscontrol."""
    tdscontrol: Any = import_module("tdscontrol")
    matrices, delays = delay_equation(point)
    system = tdscontrol.tds([np.asfortranarray(m) for m in matrices], delays)
    return len(tdscontrol.roots(system, 0.0))


def by_pade(order: int) -> Callable[[Point], int]:
    """Count the poles of a loop whose delays are Padé approximants, by python-control."""

    def count(point: Point) -> int:
        (state, *others), (_, *delays) = delay_equation(point)
        size = len(state)
        plant = control.ss(state, np.eye(size), np.eye(size), np.zeros((size, size)))
        feedback: Any = control.ss([], [], [], np.zeros((size, size)))
        for matrix, delay in zip(others, delays, strict=True):
            lag = control.tf2ss(control.tf(*control.pade(delay, order)))
            first = np.eye(1, size)
            column = control.ss([], [], [], matrix[:, :1])
            feedback += column * lag * control.ss([], [], [], first)
        poles = control.feedback(plant, feedback, sign=1).poles()
        return int((poles.real > 0.0).sum())

    return count


def by_map(point: Point) -> int:
    """Count eigenvalues outside the unit circle of the semi-discretized map, step 0.1 s."""
    loop, c1, c2 = point
    return int((np.abs(np.linalg.eigvals(transition_matrix(loop, c1, c2, 0.1))) > 1.0).sum())


def by_grid(samples: int) -> Callable[[Point], int]:
    """Count by the argument of D on frequencies that a Nyquist plot would have."""

    def count(point: Point) -> int:
        loop, c1, c2 = point
        omega = np.geomspace(1e-4, 1e3, samples)
        value = loop(1j * omega, c1, c2)
        turned = np.angle(value[1:] / value[:-1]).sum() + np.angle(value[0] / value[0].real)
        return round(loop.degree / 2 - turned / np.pi)

    return count


def run(*, quick: bool, folder: Path) -> Topic:
    """Let every tool that is there count the loops."""
    points = twenty_loops()[: 2 if quick else None]
    exact = [int(unstable_roots(*point)) for point in points]
    tools: dict[str, Callable[[Point], int]] = {
        "this package": lambda point: int(unstable_roots(*point)),
        "python-control, Padé of order 10": by_pade(10),
        "python-control, Padé of order 30": by_pade(30),
        "eigenvalues of the map, step 0.1 s": by_map,
        "argument on 1 000 frequencies": by_grid(1_000),
        "argument on 100 000 frequencies": by_grid(100_000),
    }
    for name, count in {"tdcpy": by_tdcpy, "tdscontrol": by_tdscontrol}.items():
        try:
            import_module(name)
        except ImportError:
            continue
        tools[f"{name} {version(name)}"] = count
    rows = []
    for name, count in tools.items():
        seconds, right = [], 0
        for point, expected in zip(points, exact, strict=True):
            time, found = timed(_or_none, count, point)
            seconds.append(time)
            right += found == expected
        median = float(np.median(seconds))
        rows.append(Row(f"{name}: {right} of {len(points)} right", median))
    note = f"Counts from {min(exact)} to {max(exact)}, seed {SEED}; the time is a median."
    return Topic("Beside other tools", rows, notes=[note])


def _or_none(count: Callable[[Point], int], point: Point) -> int | None:
    """Return a count, or None where the tool ends in an error."""
    try:
        return count(point)
    except Exception:  # whatever a tool of somebody else raises
        return None
