"""Controllers found by search, with exact stability as the judge.

A search judges its candidates on samples of the frequency axis, in a millisecond each. What it
found is then judged again, by certified margins, and by two certificates of stability over a
whole box of perturbations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
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
    IntArray,
    axis,
    positive_array,
    positive_number,
    real_number,
    whole_number,
)
from armlock.controllers import Controller
from armlock.loops import Loop, checked_loop, paper_loop
from armlock.robustness.boxes import CORNERS, box_counts, edge_crossings
from armlock.robustness.free_phases import last_crossover
from armlock.robustness.margins import Margins, critical_perturbation, margins
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
    "phase in the box": True,
    "dead time": True,
    "unity gain": False,
    "pulling": False,
}
# The centre of the box and its corners, as seen from there.
_POINTS = np.vstack((np.zeros(2), CORNERS))
# Along which the critical perturbation is taken.
_DIRECTION = (1.0, -1.0)
# The band in Hz of the suppression by default, and the number of its frequencies.
_GOAL_BAND = (1e-4, 1.0, 60)
# The certified margin behind a measure.
_MARGINS = {"modulus": "modulus", "phase": "phase", "dead time": "delay"}
# How far a search may move a parameter either way.
_DECADES = 1.0
# Bounds are searched for with so much to spare: samples miss a little, and the certified bound
# on the unity gain lies some parts in a thousand above it.
_SPARE = 4e-3
# Cost of a candidate that is not stable, beside costs of the order of one.
_UNSTABLE = 1e3


def _at_hertz(*corners: float) -> list[float]:
    """Return zeros or poles with corners in Hz."""
    return [-2.0 * math.pi * f for f in corners]


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
    # What a search found, rounded; the chapter on design finds one like it from round numbers.
    zeros = _at_hertz(0.37e-6, *[16.75e-6] * 3)
    poles = _at_hertz(0.25e-6, 0.108e-6, *[114.7e-6] * 4)
    return paper_loop(controller=((0.0, 0.0, *zeros), poles, paper.CONTROLLER_GAIN))


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
    # What a search found, rounded; the chapter on design finds one like it.
    zeros = _at_hertz(0.111, 4.67, 29.5, 186.0, 1266.0, 15450.0)
    poles = _at_hertz(0.0059, 0.82, 8.91, 54.6, 342.0, 2228.0, 40e3)
    # A gain of one at low frequency.
    gain = abs(float(np.prod(poles) / np.prod(zeros)))
    controller = robust_loop().controller * Controller(zeros, poles, gain)
    return paper_loop(controller=controller, delay=12.3e-6)


@dataclass(frozen=True, eq=False)
class Design:
    """What a search found.

    Attributes
    ----------
    loop : Loop
        The loop with the controller that was found.
    measures : dict of str to float
        The objective and all that was constrained, in the units of `design`.
    counts : int array, shape (n,)
        Certified numbers of unstable roots over the box, see `box_counts`.
    crossings : int
        Roots that cross the imaginary axis on the way around the box along its edges, by
        certified walks. What takes a root of the inner box there has to pass an edge.
    evaluations : int
        Candidates that were judged.

    Examples
    --------
    >>> from armlock import design, robust_loop
    >>> found = design(robust_loop(), "modulus", {"suppression": -0.1}, generations=0)
    >>> found.counts.tolist(), found.crossings
    ([0], 0)
    """

    loop: Loop
    measures: dict[str, float]
    counts: IntArray
    crossings: int
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
        free_above: float | None,
        free_gain: bool,
    ) -> None:
        self.start, self.box, self.free_gain = start, box, free_gain
        self.goal = 2j * np.pi * goal[0], goal[1]
        # Equal zeros are one parameter, and so are equal poles.
        zeros, self.zeros_of = _distinct(start.controller.zeros)
        poles, self.poles_of = _distinct(start.controller.poles)
        corners = np.concatenate((zeros, poles))
        self.poles_of += zeros.size
        # With a free gain, the size of K in the middle of the goal is the last parameter.
        self.middle = 1j * np.exp(np.log(self.goal[0].imag).mean())
        size = [abs(start.controller(self.middle))] if free_gain else []
        self.x = np.log10(np.append(corners, size))
        self.omega, self.low, self.ring = _samples(start, corners.tolist(), free_above)
        self.s = s = 1j * self.omega
        dead = np.exp(-s * start.delay)
        self.m = [weight * dead for weight in start.mapping.weights(s)]
        self.delayed = np.exp(-s * start.tau1), np.exp(-s * start.tau2)

    def controller(self, x: FloatArray) -> Controller:
        """Return the controller of a candidate."""
        old, values = self.start.controller, 10.0**x
        zeros = [0.0] * old.zeros.count(0.0) + (-values[self.zeros_of]).tolist()
        poles = [0.0] * old.poles.count(0.0) + (-values[self.poles_of]).tolist()
        gain = old.gain
        if self.free_gain:
            one = Controller(zeros, poles, math.copysign(1.0, gain))
            gain = one.gain * float(values[-1] / abs(one(self.middle)))
        return Controller(zeros, poles, gain)

    def loop(self, x: FloatArray) -> Loop:
        """Return the loop of a candidate."""
        old = self.start
        return Loop(self.controller(x), old.mapping, old.tau1, old.tau2, old.delay)

    def __call__(self, x: FloatArray) -> dict[str, float] | None:
        """Measure a candidate; None if it is not stable as far as the samples tell."""
        k = self.controller(x)
        response = k(self.s)
        first, second = (response * m for m in self.m)
        late = first * self.delayed[0], second * self.delayed[1]
        centre, radius = self._discs(first, second, late)
        distance = np.abs(1.0 + centre) - radius
        # Of a stable loop 1 + L turns by a right angle for each pole of L at s = 0, no more.
        phase = np.unwrap(np.angle(1.0 + centre[0]))
        expected = 0.5 * np.pi * int(np.flatnonzero(self.start.rest)[0])
        if abs(phase[-1] - phase[0] - expected) > 0.5 * np.pi or not (distance[0] > 0.0).all():
            return None
        along = _DIRECTION[0] * late[0] + _DIRECTION[1] * late[1]
        n = self.low
        goal, wanted = self.goal
        return {
            "suppression": float(20.0 * np.log10(np.min(np.abs(k(goal)) / wanted))),
            "critical perturbation": _first_real((1.0 + centre[0, :n]) / along[:n]),
            "modulus": float(distance[0].min()),
            "modulus in the box": float(distance.min()),
            "pulling": float((0.5 * np.abs(first - second) / distance[0]).max()),
            **self._at_unity_gain(centre, radius),
        }

    def _discs(
        self, first: ComplexArray, second: ComplexArray, late: tuple[ComplexArray, ComplexArray]
    ) -> tuple[ComplexArray, FloatArray]:
        """Centres and radii of what L fills, with a row for (1, 1) and each corner."""
        n = self.low
        both, spread = first + second, np.abs(first) + np.abs(second)
        centre = np.tile(both, (len(_POINTS), 1))
        centre[:, :n] -= late[0][:n] + late[1][:n]
        centre[:, :n] -= self.box * (_POINTS @ np.array([late[0][:n], late[1][:n]]))
        radius = np.zeros(centre.shape)
        radius[:, n:] = np.abs(late[0] + late[1])[n:]
        radius[:, n + self.ring :] = spread[n + self.ring :]
        radius[1:, n:] += self.box * spread[n:]
        return centre, radius

    def _at_unity_gain(self, centre: ComplexArray, radius: FloatArray) -> dict[str, float]:
        """Measures that are taken where L may have a magnitude of one."""
        n, size = self.low, np.abs(centre)
        crosses = np.abs(size - 1.0) <= radius
        # On both sides, for the worse of the two.
        changes = np.diff(np.sign(size[:, :n] - 1.0), axis=1) != 0.0
        crosses[:, : n - 1] |= changes
        crosses[:, 1:n] |= changes
        with np.errstate(invalid="ignore", divide="ignore"):
            cosine = (1.0 + size**2 - radius**2) / (2.0 * size)
        half = np.where(radius > 0.0, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0)
        lag = np.mod(np.angle(-centre), 2.0 * np.pi)
        near = np.minimum(lag, 2.0 * np.pi - lag) - half
        # From the last sample at which |L| may exceed one it falls to the one after it.
        most = np.log(size[0] + radius[0])
        last, rolls_off = int(np.flatnonzero(most >= 0.0).max(initial=0)), most[-1] < 0.0
        falls = slice(last, last + 2)
        unity = np.exp(np.interp(0.0, -most[falls], np.log(self.omega[falls])))
        delay = ((lag - half) / self.omega)[0, crosses[0]].min(initial=math.inf)
        return {
            "phase": float(near[0, crosses[0]].min(initial=np.pi)),
            "phase in the box": float(near[crosses].min(initial=np.pi)),
            "dead time": float(delay) if rolls_off else 0.0,
            "unity gain": float(unity) / (2.0 * np.pi) if rolls_off else math.inf,
        }


def _distinct(roots: Sequence[complex]) -> tuple[FloatArray, IntArray]:
    """Return the sizes that roots other than zero have, and which of them each one has."""
    return np.unique([abs(root) for root in roots if root], return_inverse=True)


def _samples(
    start: Loop, corners: list[float], free_above: float | None
) -> tuple[FloatArray, int, int]:
    """Frequencies at which candidates are judged: low ones, those of the circle, free ones.

    How many are low, and how many of the circle, is returned with them.
    """
    longest, apart = start.longest_delay, abs(start.tau1 - start.tau2)
    low_end = 0.6 / longest
    top = 30.0 * max([*corners, 1.0 / start.delay if start.delay else 0.0, 10.0 * low_end])
    ring_end = free_above or 40.0 / max(apart, 1e-2 * longest)
    low = np.geomspace(1e-3 * min([*corners, low_end]), low_end, 320)
    ring = np.geomspace(low_end, ring_end, 200)
    if apart:
        # The circle is widest where the arms are whole turns apart.
        steps = 2.0 * np.pi / apart * np.arange(1, 241) / 40.0
        ring = np.union1d(ring, steps[(steps > low_end) & (steps < ring_end)])
    free = np.geomspace(ring_end, max(top, 2.0 * ring_end), 160)
    omega = np.concatenate((low, ring, free if free_above else []))
    return omega, low.size, ring.size


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
    free_above: float | None = None,
    free_gain: bool = False,
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
        poles are moved by a decade at most; equal ones stay equal, those at s = 0 stay there.
    objective : str
        What is to become as good as possible: a key of `constraints`.
    constraints : mapping of str to float
        Bounds on the others:

        - "suppression": smallest |K| over the goal, in dB
        - "critical perturbation": along (1, -1)
        - "modulus", "modulus in the box": modulus margin at (1, 1), and in the worst corner
        - "phase", "phase in the box": phase margin at (1, 1), and in the worst corner, in rad
        - "dead time": the smallest additional one that makes the loop unstable, in s
        - "unity gain": highest frequency with |L| = 1 at any phase of the arms, in Hz; from
          above
        - "pulling": largest |Y_-|, from a difference of the arms' errors to the laser; from
          above
    goal : tuple of two sequences of floats, optional
        Frequencies in Hz, and the |K| that suppression is relative to. By default that of
        the structure, at 60 frequencies from 0.1 mHz to 1 Hz.
    box : float, optional
        Perturbations of either arm for which the loop is to be stable.
    free_above : float, optional
        As for `armlock.robustness.margins`; in rad/s. A loop that rolls off takes it: its
        certificates then need not follow every turn of the arms' phases.
    free_gain : bool, optional
        Whether the gain is a parameter, too.
    generations : int, optional
        Of the global search, differential evolution; 0 for the local one from the start alone.
    seed : int, optional
        Of all that is random.
    executor : concurrent.futures.Executor, optional
        What judges the candidates, see `armlock.sweep`; the result is the same.
    progress : bool, optional
        Whether a line is printed for each generation.

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
    The measures are certified, but for pulling, which is taken from samples. Unity gain is a
    certified bound from above. Stability over the box is shown twice. `box_counts` covers it
    with smaller boxes of a known count. And no root crosses the axis along the edges of the
    box, up to `free_above`; beyond it no phases of the arms let one. The points where a
    root lies on the axis form curves that leave the box, and would cross an edge.
    Nothing says that there is no better controller.

    Examples
    --------
    >>> from armlock import design, robust_loop
    >>> found = design(robust_loop(), "modulus", {"suppression": -0.1}, generations=0)
    >>> found.measures["modulus"] > 0.707
    True
    """
    bounds = _checked_bounds(objective, constraints)
    if free_above is not None:
        free_above = positive_number("free_above", free_above)
    _check_structure(structure)
    box = positive_number("box", box)
    goal = _checked_goal(structure, goal)
    judge = _Judge(structure, goal, box, free_above, free_gain)
    ends = judge.omega[[0, -1]] / (2.0 * np.pi)
    if goal[0].min() < ends[0] or goal[0].max() > ends[1]:
        raise ValueError(
            f"goal must lie between {ends[0]:.3g} Hz and {ends[1]:.3g} Hz, which the samples "
            f"resolve; got {goal[0].min()} to {goal[0].max()}"
        )
    generations = whole_number("generations", generations, 0)
    cost = partial(_cost, judge=judge, objective=objective, constraints=bounds)
    x, evaluations = judge.x, 0
    limits = np.column_stack((x - _DECADES, x + _DECADES))
    if generations:
        found = differential_evolution(
            cost,
            limits,
            maxiter=generations,
            popsize=8,
            rng=seed,
            x0=x,
            polish=False,
            updating="deferred",
            workers=partial(sweep, executor=executor),
            disp=progress,
        )
        x, evaluations = found.x, int(found.nfev)
    x, more = _local(cost, x, limits)
    sampled = judge(x)
    if sampled is None:
        raise ValueError(
            "constraints must be such that a stable loop is among the candidates; none was met"
        )
    _require(bounds, sampled)
    loop = judge.loop(x)
    counts = box_counts(loop, box, free_above)
    crossings = edge_crossings(loop, box, free_above)
    if counts.any() or crossings:
        raise ValueError(
            f"constraints must leave a loop that is stable over the box, but the counts of the "
            f"best candidate are {counts.tolist()}, and {crossings} roots cross on its edges"
        )
    points = [margins(loop, c1, c2, free_above) for c1, c2 in 1.0 + box * _POINTS]
    measures = {
        name: _certified(name, loop, free_above, sampled[name], points)
        for name in (objective, *bounds)
    }
    _require(bounds, measures)
    return Design(loop, measures, counts, crossings, evaluations + more)


def _checked_bounds(objective: str, constraints: Mapping[str, float]) -> dict[str, float]:
    for name in (objective, *constraints):
        if name not in MEASURES:
            raise ValueError(f"a measure must be one of {', '.join(MEASURES)}; got {name!r}")
    if objective in constraints:
        raise ValueError(f"objective must not be among constraints, got {objective!r} in both")
    return {name: real_number(name, bound) for name, bound in constraints.items()}


def _check_structure(structure: Loop) -> None:
    k = checked_loop(structure).controller
    if any(r.imag or r.real > 0.0 for r in (*k.zeros, *k.poles)):
        raise ValueError(
            "structure must have a controller with real zeros and poles, none positive; "
            f"got zeros {k.zeros} and poles {k.poles}"
        )


def _checked_goal(
    structure: Loop, goal: tuple[npt.ArrayLike, npt.ArrayLike] | None
) -> tuple[FloatArray, FloatArray]:
    if goal is None:
        frequency = np.geomspace(*_GOAL_BAND)
        return frequency, np.abs(structure.controller(2j * np.pi * frequency))
    frequency, size = (positive_array("goal", axis("goal", values)) for values in goal)
    if frequency.shape != size.shape:
        raise ValueError(
            f"goal must hold as many gains as frequencies, got {size.size} and {frequency.size}"
        )
    return frequency, size


def _local(
    cost: Callable[[FloatArray], float], x: FloatArray, limits: FloatArray
) -> tuple[FloatArray, int]:
    """Minimise a cost with ever smaller simplices; return where, and the number of calls."""
    evaluations = 0
    for size in (0.05, 0.02, 0.005):
        simplex = np.clip(np.vstack((x, x + size * np.eye(x.size))), *limits.T)
        options: dict[str, Any] = {"initial_simplex": simplex, "adaptive": True}
        options |= {"maxfev": 150 * x.size, "xatol": 1e-5, "fatol": 1e-7}
        found = minimize(cost, x, method="Nelder-Mead", bounds=limits, options=options)
        x, evaluations = found.x, evaluations + int(found.nfev)
    return x, evaluations


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
    loop: Loop,
    free_above: float | None,
    sampled: float,
    points: Sequence[Margins],
) -> float:
    """Return a measure of a loop; `points` are its margins at (1, 1) and in the corners."""
    if name == "critical perturbation":
        return critical_perturbation(loop, _DIRECTION)
    if name == "unity gain":
        return last_crossover(loop, np.ones(2)) / (2.0 * math.pi)
    plain = name.removesuffix(" in the box")
    if plain not in _MARGINS:
        return sampled
    values = [float(getattr(point, _MARGINS[plain])) for point in points]
    return values[0] if name == plain else min(values)
