"""Controllers found by search, with exact stability as the judge.

A search judges its candidates on samples of the frequency axis, in some tenths of a
millisecond each. What it found is then judged again, by the certified counts and margins.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import differential_evolution, minimize

from armlock import paper
from armlock.checks import (
    ComplexArray,
    FloatArray,
    axis,
    positive_array,
    positive_number,
    real_number,
    whole_number,
)
from armlock.controllers import Controller
from armlock.loops import Loop, checked_loop, paper_loop
from armlock.margins import critical_perturbation, margins, modulus_margin
from armlock.rays import ray_crossings
from armlock.stability import unstable_roots
from armlock.sweep import sweep

if TYPE_CHECKING:
    import control

#: What a search can ask for, and whether more of it is better.
MEASURES: Final = {
    "suppression": True,
    "critical perturbation": True,
    "modulus": True,
    "modulus in the box": True,
    "phase": True,
    "dead time": True,
    "unity gain": False,
    "pulling": False,
}
# Directions from (1, 1) to the corners of the box.
_CORNERS = ((1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0))
# Bounds are searched for with so much to spare, for samples miss a little.
_SPARE = 2e-3
# Cost of a candidate that is not stable, beside costs of the order of one.
_UNSTABLE = 1e3

#: Dead time in s of actuator, phasemeter and transponder in the white paper.
FLIGHT_DELAY: Final = 12.3e-6

# What searches found, rounded, in Hz. `design` finds one like the first from round numbers, and
# refines the second, which a search outside of this module began.
_ROBUST_POLES = (0.25e-6, 0.108e-6)
_ROBUST_LEADS = ((0.37e-6, 1), (16.75e-6, 3)), ((114.7e-6, 4),)
_ROLL_OFF_ZEROS = (0.111, 4.67, 29.5, 186.0, 1266.0, 15450.0)
_ROLL_OFF_POLES = (0.0059, 0.82, 8.91, 54.6, 342.0, 2228.0, 40e3)


def _robust_controller() -> Controller:
    zeros, poles = (
        tuple(-2.0 * math.pi * f for f, count in factors for _ in range(count))
        for factors in _ROBUST_LEADS
    )
    high_pass = tuple(-2.0 * math.pi * f for f in _ROBUST_POLES)
    return Controller((0.0, 0.0, *zeros), (*high_pass, *poles), paper.CONTROLLER_GAIN)


def robust_loop() -> Loop:
    r"""Return a loop of the paper's structure that withstands nearly three times as much.

    The controller has the two high-pass factors, the four lead-lag factors and the gain of
    Table II, on the paper's sensor and delays:

    .. math::

        C(s) = g\, \frac{s}{s + p_1}\, \frac{s}{s + p_2}\, \frac{s + z_1}{s + p_3}
        \left( \frac{s + z_2}{s + p_3} \right)^3

    with p1, p2, z1, z2 and p3 at 0.25, 0.108, 0.37, 16.75 and 114.7 microhertz. Nowhere from
    0.1 mHz to 1 Hz is its gain more than 0.05 dB below that of Table II. It was found by a
    search; no proof says that there is none better.

    Returns
    -------
    Loop

    Examples
    --------
    >>> from armlock import critical_perturbation, paper_loop, robust_loop
    >>> for loop in (paper_loop(), robust_loop()):
    ...     print(f"{critical_perturbation(loop, (1, -1)):.3e}")
    1.464e-06
    4.375e-06
    """
    return paper_loop(controller=_robust_controller())


def buildable_loop() -> Loop:
    r"""Return a loop that rolls off, with a dead time, stable over the paper's box.

    The controller of `robust_loop` with six zeros and seven poles from 6 mHz on, which take
    turns. So the gain falls by two thirds of a power of the frequency, and the phase by about
    sixty degrees. Sensor and delays are the paper's; the dead time is 12.3 microseconds.
    It was found by a search; no proof says that there is none better.

    Returns
    -------
    Loop
        Of retarded type.

    Examples
    --------
    >>> from armlock import buildable_loop, unstable_roots
    >>> loop = buildable_loop()
    >>> int(unstable_roots(loop, 1.0 + 1e-6, 1.0 - 1e-6))
    0
    """
    zeros, poles = (
        tuple(-2.0 * math.pi * f for f in corners)
        for corners in (_ROLL_OFF_ZEROS, _ROLL_OFF_POLES)
    )
    # A gain of one at low frequency.
    gain = abs(float(np.prod(poles) / np.prod(zeros)))
    controller = _robust_controller() * Controller(zeros, poles, gain)
    return paper_loop(controller=controller, delay=FLIGHT_DELAY)


@dataclass(frozen=True, eq=False)
class Design:
    """What a search found.

    Attributes
    ----------
    loop : Loop
        The loop with the controller that was found.
    measures : dict of str to float
        The objective and all that was constrained, in the units of `design`.
    counts : int array, shape (5,)
        Certified numbers of unstable roots at (1, 1) and in the corners of the box.
    crossings : int
        Roots that cross the imaginary axis on the way from (1, 1) to the corners, by certified
        walks along the rays.
    start : float
        The objective at the start, by samples; nan if the start is not stable.
    evaluations : int
        Candidates that were judged.

    Examples
    --------
    >>> from armlock import design, robust_loop
    >>> found = design(robust_loop(), "modulus", {"suppression": -0.1}, generations=0)
    >>> found.counts.tolist(), found.crossings
    ([0, 0, 0, 0, 0], 0)
    """

    loop: Loop
    measures: dict[str, float]
    counts: npt.NDArray[np.int64]
    crossings: int
    start: float
    evaluations: int

    @property
    def controller(self) -> Controller:
        """The controller that was found."""
        return self.loop.controller

    @property
    def transfer_function(self) -> control.TransferFunction:
        """The controller as a python-control system."""
        import control

        k = self.controller
        return control.zpk(k.zeros, k.poles, k.gain)


class _Judge:
    """Measures of candidates, on samples of the frequency axis.

    Below a tenth of a turn of the arms L is sampled as it is. Above, the mean phase of the arms
    turns much faster than all else, and L goes around a circle; above `free_above` it fills a
    disc.
    """

    def __init__(
        self,
        start: Loop,
        goal: tuple[FloatArray, FloatArray],
        box: float,
        direction: tuple[float, float],
        free_above: float | None,
        free_gain: bool,
    ) -> None:
        self.start, self.box, self.direction = start, box, direction
        k = start.controller
        self.factors = [
            [(r.real, roots.count(r)) for r in sorted(set(roots), key=abs) if r]
            for roots in (k.zeros, k.poles)
        ]
        self.at_zero = k.zeros.count(0.0) - k.poles.count(0.0)
        self.goal = 1j * 2.0 * np.pi * goal[0], goal[1]
        self.free_gain = free_gain
        # With a free gain, the size of K in the middle of the goal is the parameter.
        self.middle = 1j * math.exp(float(np.log(self.goal[0].imag).mean()))
        corners = [-value for group in self.factors for value, _ in group]
        own = [math.log10(value) for value in corners]
        size = [math.log10(abs(complex(k(self.middle))))] if free_gain else []
        self.x = np.array([*own, *size])

        longest, apart = start.longest_delay, abs(start.tau1 - start.tau2)
        switch = 0.6 / longest
        top = 30.0 * max([*corners, 1.0 / start.delay if start.delay else 0.0, 10.0 * switch])
        ring_end = free_above or 40.0 / max(apart, 1e-2 * longest)
        low = np.geomspace(1e-3 * min([*corners, switch]), switch, 320)
        ring = np.geomspace(switch, ring_end, 200)
        if apart:
            # The circle is widest where the arms are whole turns apart.
            steps = 2.0 * np.pi / apart * np.arange(1, 241) / 40.0
            ring = np.union1d(ring, steps[(steps > switch) & (steps < ring_end)])
        free = np.geomspace(ring_end, max(top, 2.0 * ring_end), 160)
        self.omega = np.concatenate((low, ring, free if free_above else []))
        self.s, self.low, self.ring = 1j * self.omega, low.size, low.size + ring.size
        self.m = start.mapping.weights(self.s)
        self.dead = np.exp(-self.s * start.delay)
        self.turn = np.exp(-self.s * start.tau1), np.exp(-self.s * start.tau2)

    def controller(self, x: FloatArray) -> Controller:
        """Return the controller of a candidate."""
        found: list[list[float]] = [[], []]
        k = 0
        for own, group in zip(found, self.factors, strict=True):
            for _, count in group:
                own.extend([-(10.0 ** float(x[k]))] * count)
                k += 1
        zeros = [0.0] * max(self.at_zero, 0) + found[0]
        poles = [0.0] * max(-self.at_zero, 0) + found[1]
        gain = self.start.controller.gain
        if self.free_gain:
            one = Controller(zeros, poles, 1.0)
            gain = math.copysign(10.0 ** float(x[-1]) / abs(complex(one(self.middle))), gain)
        return Controller(zeros, poles, gain)

    def loop(self, x: FloatArray) -> Loop:
        """Return the loop of a candidate."""
        old = self.start
        return Loop(self.controller(x), old.mapping, old.tau1, old.tau2, old.delay)

    def __call__(self, x: FloatArray) -> dict[str, float] | None:
        """Measure a candidate; None if it is not stable as far as the samples tell."""
        k = self.controller(x)
        first, second = (k(self.s) * self.dead * m for m in self.m)
        n, centre = self.low, first + second
        away = 1.0 + first * (1.0 - self.turn[0]) + second * (1.0 - self.turn[1])
        spread = np.abs(first) + np.abs(second)
        radius = np.abs(first * self.turn[0] + second * self.turn[1])
        radius[self.ring :] = spread[self.ring :]
        radius[:n] = 0.0
        middle = np.where(np.arange(centre.size) < n, away - 1.0, centre)
        distance = np.abs(1.0 + middle) - radius
        phase = np.unwrap(np.angle(1.0 + middle))
        poles = int(np.flatnonzero(self.start.rest)[0])
        expected = 0.5 * np.pi * poles
        if abs(phase[-1] - phase[0] - expected) > 0.5 * np.pi or not (distance > 0.0).all():
            return None
        changed = [d * turn for d, turn in zip((first, second), self.turn, strict=True)]
        corners = [
            np.abs(away - self.box * (d1 * changed[0] + d2 * changed[1]))[:n]
            for d1, d2 in _CORNERS
        ]
        along = self.direction[0] * changed[0] + self.direction[1] * changed[1]
        lag = np.mod(np.angle(-middle), 2.0 * np.pi)
        size = np.abs(middle)
        crosses = np.abs(size - 1.0) <= radius
        crosses[: n - 1] |= np.diff(np.sign(size[:n] - 1.0)) != 0.0
        with np.errstate(invalid="ignore", divide="ignore"):
            cosine = (1.0 + size**2 - radius**2) / (2.0 * size)
        half = np.where(radius > 0.0, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0)
        near = np.minimum(lag, 2.0 * np.pi - lag) - half
        largest = np.where(np.arange(size.size) < n, size, np.abs(centre) + radius)
        above = np.flatnonzero(largest >= 1.0)
        neutral = bool(above.size) and above[-1] == size.size - 1
        beside = (distance - self.box * spread)[n:]
        return {
            "suppression": float(
                20.0 * np.log10(np.min(np.abs(k(self.goal[0])) / self.goal[1]))
            ),
            "critical perturbation": _first_real(away[:n] / along[:n]),
            "modulus": float(distance.min()),
            "modulus in the box": float(min(np.min(corners), beside.min())),
            "phase": float(near[crosses].min(initial=np.pi)),
            "dead time": 0.0
            if neutral
            else float(((lag - half) / self.omega)[crosses].min(initial=np.inf)),
            "unity gain": math.inf
            if neutral
            else float(self.omega[above[-1]] / (2.0 * np.pi))
            if above.size
            else 0.0,
            "pulling": float((0.5 * np.abs(first - second) / distance).max()),
        }


def _first_real(values: ComplexArray) -> float:
    """Return the smallest positive value at which a sampled curve crosses the real axis."""
    at = np.flatnonzero(values.imag[1:] * values.imag[:-1] < 0.0)
    a, b = values[at], values[at + 1]
    share = a.imag / (a.imag - b.imag)
    found = a.real + share * (b.real - a.real)
    return float(found[found > 0.0].min(initial=1.0))


def _missing(name: str, value: float, bound: float, spare: float = 0.0) -> float:
    """By how much a measure misses its bound, as a share of it; negative if it does not."""
    scale = max(abs(bound), 0.05 if name == "suppression" else 1e-12)
    short = (bound - value) if MEASURES[name] else (value - bound)
    return short / scale + spare


def _cost(
    x: FloatArray, judge: _Judge, objective: str, constraints: Mapping[str, float]
) -> float:
    """Return what the search minimises; misses of constraints cost most."""
    found = judge(x)
    if found is None:
        return _UNSTABLE
    value = found[objective]
    if objective != "suppression":
        value = math.log(min(max(value, 1e-30), 1e30))
    else:
        value *= math.log(10.0) / 20.0
    missed = sum(max(_missing(n, found[n], b, _SPARE), 0.0) for n, b in constraints.items())
    return 30.0 * missed - (value if MEASURES[objective] else -value)


def design(
    structure: Loop,
    objective: str,
    constraints: Mapping[str, float],
    *,
    goal: tuple[Sequence[float] | FloatArray, Sequence[float] | FloatArray] | None = None,
    box: float = paper.PERTURBATION,
    direction: tuple[float, float] = (1.0, -1.0),
    free_above: float | None = None,
    free_gain: bool = False,
    decades: float = 1.0,
    generations: int = 60,
    seed: int = 0,
    executor: Executor | None = None,
    progress: bool = False,
) -> Design:
    r"""Search for a controller of a given structure, and certify what was found.

    Parameters
    ----------
    structure : Loop
        A loop to start from, with sensor, delays and dead time. Its controller's real zeros and
        poles are moved; equal ones stay equal, those at s = 0 stay there.
    objective : str
        What is to become as good as possible: a key of `constraints`.
    constraints : mapping of str to float
        Bounds on the others:

        - "suppression": smallest \|K\| over the goal, in dB
        - "critical perturbation": along `direction`
        - "modulus", "modulus in the box": modulus margin at (1, 1), and in the worst corner
        - "phase": phase margin at (1, 1), in rad
        - "dead time": the smallest additional one that makes the loop unstable, in s
        - "unity gain": highest frequency with \|L\| = 1 at any phase of the arms, in Hz; from
          above
        - "pulling": largest \|Y_-\|, from a difference of the arms' errors to the laser; from
          above
    goal : tuple of two sequences of floats, optional
        Frequencies in Hz, and the \|K\| that suppression is relative to. By default that of
        the structure, at 60 frequencies from 0.1 mHz to 1 Hz.
    box : float, optional
        Perturbations of either arm for which the loop is to be stable.
    direction : tuple of two floats, optional
        Of the critical perturbation.
    free_above : float, optional
        As for `armlock.margins`; in rad/s.
    free_gain : bool, optional
        Whether the gain is a parameter, too.
    decades : float, optional
        How far a parameter may move either way.
    generations : int, optional
        Of the global search, differential evolution; 0 for the local one from the start alone.
    seed : int, optional
        Of all that is random.
    executor : concurrent.futures.Executor, optional
        What judges the candidates, see `armlock.sweep`; the result is the same.
    progress : bool, optional
        Whether a line is printed for each tenth generation.

    Returns
    -------
    Design

    Raises
    ------
    TypeError, ValueError
        If an argument is not what it is to be; the structure has complex factors, or ones right
        of the imaginary axis; or no candidate met all constraints: the message names those that
        were missed by the best candidate, and by how much.
    CountError
        If rounding spoils a certificate.

    Notes
    -----
    The measures are certified, with three exceptions that are taken from samples: unity gain,
    pulling, and the dead time where the arms' phases are free.
    The count is made at the centre of the box, at its corners, and on the rays between them;
    the rest of the box is not counted. Nothing says that there is no better controller.

    Examples
    --------
    >>> from armlock import design, robust_loop
    >>> found = design(robust_loop(), "modulus", {"suppression": -0.1}, generations=0)
    >>> found.measures["modulus"] > 0.707
    True
    """
    checked_loop(structure)
    for name in (objective, *constraints):
        if name not in MEASURES:
            raise ValueError(f"a measure must be one of {', '.join(MEASURES)}; got {name!r}")
    if objective in constraints:
        raise ValueError(f"objective must not be among constraints, got {objective!r} in both")
    bounds = {name: real_number(name, bound) for name, bound in constraints.items()}
    k = structure.controller
    if any(r.imag or r.real > 0.0 for r in (*k.zeros, *k.poles)):
        raise ValueError(
            "structure must have a controller with real zeros and poles, none positive; "
            f"got zeros {k.zeros} and poles {k.poles}"
        )
    if not any(k.zeros) and not any(k.poles) and not free_gain:
        raise ValueError("structure must have a zero or pole to move, or free_gain be True")
    if goal is None:
        frequency = np.geomspace(1e-4, 1.0, 60)
        size = np.abs(k(2j * np.pi * frequency))
    else:
        frequency = positive_array("goal", axis("goal", goal[0]))
        size = positive_array("goal", axis("goal", goal[1]))
        if frequency.shape != size.shape:
            raise ValueError(
                f"goal must hold as many gains as frequencies, got {size.size} and "
                f"{frequency.size}"
            )
    box = positive_number("box", box)
    reach = positive_number("decades", decades)
    generations = whole_number("generations", generations, 0)
    if free_above is not None:
        free_above = positive_number("free_above", free_above)
    judge = _Judge(structure, (frequency, size), box, direction, free_above, bool(free_gain))
    lowest, highest = judge.omega[0] / (2.0 * np.pi), judge.omega[-1] / (2.0 * np.pi)
    if frequency.min() < lowest or frequency.max() > highest:
        raise ValueError(
            f"goal must lie between {lowest:.3g} Hz and {highest:.3g} Hz, which the samples "
            f"resolve; got {frequency.min()} to {frequency.max()}"
        )
    cost = partial(_cost, judge=judge, objective=objective, constraints=bounds)
    x, evaluations = judge.x, 0
    if generations:
        done = 0

        def report(intermediate_result: Any) -> None:
            nonlocal done
            done += 1
            if progress and done % 10 == 0:
                print(f"generation {done} of {generations}: {intermediate_result.fun:.4f}")

        found = differential_evolution(
            cost,
            [(v - reach, v + reach) for v in judge.x],
            maxiter=generations,
            popsize=8,
            rng=seed,
            x0=judge.x,
            polish=False,
            updating="deferred",
            workers=partial(sweep, executor=executor),
            callback=report,
        )
        x, evaluations = found.x, int(found.nfev)
    for size_of_simplex in (0.05, 0.02, 0.005):
        simplex = np.vstack((x, x + size_of_simplex * np.eye(x.size)))
        found = minimize(
            cost,
            x,
            method="Nelder-Mead",
            bounds=[(v - reach, v + reach) for v in judge.x],
            options={
                "initial_simplex": np.clip(simplex, judge.x - reach, judge.x + reach),
                "adaptive": True,
                "maxfev": 150 * x.size,
                "xatol": 1e-5,
                "fatol": 1e-7,
            },
        )
        evaluations += int(found.nfev)
        if found.fun <= cost(x):
            x = found.x
    sampled = judge(x)
    if sampled is None:
        raise ValueError(
            "constraints must be such that a stable loop is among the candidates; none was met"
        )
    _require(bounds, sampled)
    loop = judge.loop(x)
    at = 1.0 + box * np.array(((0.0, 0.0), *_CORNERS))
    counts = unstable_roots(loop, *at.T)
    crossings = sum(
        ray_crossings(loop, (1.0, 1.0), corner, box).position.size for corner in _CORNERS
    )
    if counts.any() or crossings:
        raise ValueError(
            f"constraints must leave a loop that is stable over the box, but the counts of the "
            f"best candidate are {counts.tolist()}, and {crossings} roots cross on the way"
        )
    measures = {
        name: _certified(name, judge, loop, sampled, free_above)
        for name in (objective, *bounds)
    }
    _require(bounds, measures)
    first = judge(judge.x)
    begin = math.nan if first is None else first[objective]
    return Design(loop, measures, counts, crossings, begin, evaluations)


def _require(bounds: Mapping[str, float], found: Mapping[str, float]) -> None:
    """Raise if a bound is missed, and say by how much."""
    missed = [
        f"{name} {found[name]:.6g} in place of {bound:.6g}"
        for name, bound in bounds.items()
        if _missing(name, found[name], bound) > 0.0
    ]
    if missed:
        raise ValueError(
            f"constraints must be such that all can be met; the best candidate has "
            f"{', and '.join(missed)}"
        )


def _certified(
    name: str,
    judge: _Judge,
    loop: Loop,
    sampled: Mapping[str, float],
    free_above: float | None,
) -> float:
    """Return a measure of a loop that was found, by the certified methods where they apply."""
    if name == "critical perturbation":
        return critical_perturbation(loop, judge.direction)
    if name in ("modulus", "modulus in the box"):
        points = [(1.0, 1.0)]
        if name == "modulus in the box":
            points += [(1.0 + judge.box * d1, 1.0 + judge.box * d2) for d1, d2 in _CORNERS]
        if free_above is None:
            return min(modulus_margin(loop, *point) for point in points)
        return min(margins(loop, *point, free_above=free_above).modulus for point in points)
    if name == "phase" or (name == "dead time" and free_above is None):
        found = margins(loop, free_above=free_above)
        return found.phase if name == "phase" else found.delay
    return sampled[name]
