"""Other tools on twenty loops of two arms, and twenty of more delays: right counts and times.

tdcpy and tdscontrol are no dependency of this package; what is not installed is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

import control
import numpy as np
from flint import fmpq

from armlock import CommonArm, DualArm, Loop, delay, transition_matrix, unstable_roots
from armlock.checks import ComplexArray, FloatArray
from benchmarks.measure import timed
from benchmarks.report import Row, Topic

SEED = 28
Point = tuple[Loop, float, float]


@dataclass(frozen=True)
class Case:
    """A loop as x'(t) = sum_k A_k x(t - h_k), in which x_1 alone is delayed."""

    count: Callable[[], Any]
    characteristic: Callable[[ComplexArray], ComplexArray]
    matrices: list[FloatArray]
    delays: list[float]
    point: Point | None = None


def two_arms() -> list[Case]:
    """Draw ten common and ten dual arms, with points of the plane around them."""
    rng = np.random.default_rng(SEED)
    cases = []
    for _ in range(10):
        gain = float(10.0 ** rng.uniform(-1.0, 0.5))
        c = rng.uniform(-2.5, 2.5, 4) * (1.0, 1.0, 0.4, 0.4)
        for loop, c1, c2 in ((CommonArm(gain=gain), *c[:2]), (DualArm(gain=gain), *c[2:])):
            here = loop.at(c1=c1, c2=c2)
            parts = (here.numerator + here.denominator).by_length()
            lead = parts[fmpq(0)].leading_coefficient()
            # Highest powers first, as numpy has them, and without that of the whole.
            order = parts[fmpq(0)].degree()
            rows = [[float(p[k] / lead) for k in range(order, -1, -1)] for p in parts.values()]
            q, *b = np.array(rows)
            count = partial(unstable_roots, loop, c1, c2)
            theta = np.array([float(time) for time in parts])[1:]
            cases.append(_case(count, q, theta, np.array(b)[:, 1:], (loop, c1, c2)))
    return cases


def many_delays() -> list[Case]:
    """Draw twenty loops sum_k b_k exp(-s theta_k) / q with three to six delays."""
    rng = np.random.default_rng(SEED)
    cases = []
    for _ in range(20):
        order, number = int(rng.integers(2, 5)), int(rng.integers(3, 7))
        q: FloatArray = np.poly(-(10.0 ** rng.uniform(-1.0, 0.5, order))).astype(float)
        theta = 10.0 ** rng.uniform(np.log10(0.3), np.log10(20.0), number)
        b = rng.normal(size=(number, order)) * q[1:] * 10.0 ** rng.uniform(-0.5, 2.0) / number
        cases.append(_case(partial(_count, q, theta, b), q, theta, b))
    return cases


def _case(
    count: Callable[[], Any], q: FloatArray, theta: FloatArray, b: FloatArray, *point: Any
) -> Case:
    """Return the case of D = q + sum_k b_k exp(-s theta_k), q monic and of higher degree."""
    return Case(
        count,
        partial(_characteristic, q, theta, b),
        [np.eye(len(q) - 1, k=1) - _first_column(q[1:]), *(-_first_column(p) for p in b)],
        [0.0, *theta.tolist()],
        *point,
    )


def _count(q: FloatArray, theta: FloatArray, b: FloatArray) -> Any:
    terms = zip(theta, b, strict=True)
    return unstable_roots(sum(control.tf(p, q) * delay(h) for h, p in terms))


def _characteristic(q: FloatArray, theta: FloatArray, b: FloatArray, s: Any) -> Any:
    terms = zip(theta, b, strict=True)
    return np.polyval(q, s) + sum(np.polyval(p, s) * np.exp(-s * h) for h, p in terms)


def _first_column(column: FloatArray) -> FloatArray:
    """Return a matrix whose first column is this one."""
    return np.outer(column, np.eye(1, column.size))


def by_tdcpy(case: Case) -> int:
    """Count by tdcpy; its largest eigenvalue problem may have 2 000 rows in place of 600.

    What its own Newton's method has not brought to a root is left out.
    """
    tdcpy: Any = import_module("tdcpy")
    system = tdcpy.RDDE(np.stack(case.matrices, axis=2), np.array(case.delays))
    found, _ = tdcpy.roots(system, 0.0, max_size_evp=2000)
    return int((np.abs(case.characteristic(found)) < 1e-6).sum())


def by_tdscontrol(case: Case) -> int:
    """Count by tdscontrol."""
    tdscontrol: Any = import_module("tdscontrol")
    system = tdscontrol.tds([np.asfortranarray(m) for m in case.matrices], case.delays)
    return len(tdscontrol.roots(system, 0.0))


def by_pade(order: int) -> Callable[[Case], int]:
    """Count the poles of a loop whose delays are Padé approximants, by python-control."""

    def count(case: Case) -> int:
        state, *others = case.matrices
        size = len(state)
        plant = control.ss(state, np.eye(size), np.eye(size), np.zeros((size, size)))
        feedback: Any = control.ss([], [], [], np.zeros((size, size)))
        for matrix, theta in zip(others, case.delays[1:], strict=True):
            lag = control.tf2ss(control.tf(*control.pade(theta, order)))
            first = np.eye(1, size)
            column = control.ss([], [], [], matrix[:, :1])
            feedback += column * lag * control.ss([], [], [], first)
        poles = control.feedback(plant, feedback, sign=1).poles()
        return int((poles.real > 0.0).sum())

    return count


def without_delays(case: Case) -> int:
    """Count eigenvalues as if there were no delays."""
    return int((np.linalg.eigvals(np.sum(case.matrices, axis=0)).real > 0.0).sum())


def by_map(case: Case) -> int:
    """Count eigenvalues outside the unit circle of the semi-discretized map, step 0.1 s."""
    assert case.point is not None
    return int(
        (np.abs(np.linalg.eigvals(transition_matrix(*case.point, step=0.1))) > 1.0).sum()
    )


def by_grid(samples: int) -> Callable[[Case], int]:
    """Count by the argument of D on frequencies that a Nyquist plot would have."""

    def count(case: Case) -> int:
        omega: ComplexArray = (1j * np.geomspace(1e-4, 1e3, samples)).astype(complex)
        value = case.characteristic(omega)
        turned = np.angle(value[1:] / value[:-1]).sum() + np.angle(value[0] / value[0].real)
        return round(len(case.matrices[0]) / 2 - float(turned) / np.pi)

    return count


def run(*, quick: bool) -> Topic:
    """Let every tool that is there count the loops of both tables."""
    tools: dict[str, Callable[[Case], int]] = {
        "this package": lambda case: int(case.count()),
        "poles without the delays": without_delays,
        "python-control, Padé of order 4": by_pade(4),
        "python-control, Padé of order 10": by_pade(10),
        "python-control, Padé of order 30": by_pade(30),
        "eigenvalues of the map, step 0.1 s": by_map,
        "argument on 1 000 frequencies": by_grid(1_000),
        "argument on 10 000 frequencies": by_grid(10_000),
        "argument on 100 000 frequencies": by_grid(100_000),
    }
    for name, by_other in (("tdcpy", by_tdcpy), ("tdscontrol", by_tdscontrol)):
        if find_spec(name):
            tools[f"{name} {version(name)}"] = by_other
    rows, notes = [], []
    for what, all_cases in (("two arms", two_arms()), ("3 to 6 delays", many_delays())):
        cases = all_cases[: 2 if quick else None]
        exact = [int(case.count()) for case in cases]
        notes.append(f"{what}: counts from {min(exact)} to {max(exact)}, seed {SEED}.")
        for name, count in tools.items():
            if count is by_map and cases[0].point is None:
                continue
            measured = [timed(_or_none, count, case) for case in cases]
            right = sum(found == n for (_, found), n in zip(measured, exact, strict=True))
            median = float(np.median([seconds for seconds, _ in measured]))
            rows.append(Row(f"{what}, {name}: {right} of {len(cases)} right", median))
    return Topic("Beside other tools", rows, notes=[*notes, "The time is a median."])


def _or_none(count: Callable[[Case], int], case: Case) -> int | None:
    """Return a count, or None where the tool ends in an error."""
    try:
        return count(case)
    except Exception:  # whatever a tool of somebody else raises
        return None
