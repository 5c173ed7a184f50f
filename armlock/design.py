"""Controllers found by search, with exact stability as the judge.

A search looks at samples of the frequency axis, a millisecond for each candidate. Nothing of
that is returned: what was found is measured again, by certified margins and by counts over a
whole box of perturbations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from armlock import paper
from armlock.checks import (
    ComplexArray,
    FloatArray,
    IntArray,
    axis,
    one_of,
    positive_array,
    positive_number,
    real_number,
)
from armlock.controllers import Controller
from armlock.loops import Loop, LoopAt, checked_loop
from armlock.robustness.boxes import CORNERS, box_counts
from armlock.robustness.free_phases import last_crossover
from armlock.robustness.margins import critical_perturbation, margins, modulus_margin
from armlock.stability.counts import loop_count

#: What a search can ask for; of each, more is better.
MEASURES = ("suppression", "critical_perturbation", "modulus", "modulus_in_corners", "phase")
# The units of those that have one.
_UNITS = {"suppression": " dB", "phase": " rad"}
# The centre of the box and its corners, as seen from there.
_POINTS = np.vstack((np.zeros(2), CORNERS))
# The corner towards which the critical perturbation is taken: (1, -1).
_ALONG = 1
# The band in Hz of the suppression by default, and the number of its frequencies.
_GOAL_BAND = (1e-4, 1.0, 60)
# The search asks for this share more than each bound, because samples miss a little.
_SPARE = 4e-3
# The search asks for a box larger by this factor: the certificate needs room at the edge.
_WIDER = 1.1
# How many samples a decade has at low frequency, and how many there are above.
_PER_DECADE, _ABOVE = 50, 360
# Cost of a candidate that is not stable, beside costs of the order of one.
_UNSTABLE = 1e3

_Goal = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Design:
    """What a search found.

    Attributes
    ----------
    loop : Loop
        The loop with the controller that was found, `loop.controller`.
    measures : dict of str to float
        The objective and all that was constrained, certified, in the units of `design`.
    counts : int array, shape (n,)
        Certified numbers of unstable roots over the box, see
        `armlock.robustness.boxes.box_counts`: all zero.

    Examples
    --------
    >>> from armlock import Loop, design
    >>> start = Loop(([], [-0.1], 3.0), "single", 20.0)
    >>> found = design(start, "suppression", {"phase": 0.35})
    >>> bool(found.counts.any())
    False
    """

    loop: Loop
    measures: dict[str, float]
    counts: IntArray


def design(
    structure: Loop,
    objective: str,
    constraints: Mapping[str, float],
    *,
    goal: tuple[Sequence[float] | FloatArray, Sequence[float] | FloatArray] | None = None,
    box: float = paper.PERTURBATION,
) -> Design:
    r"""Search for a controller of a given structure, and certify what was found.

    Parameters
    ----------
    structure : Loop
        A loop to start from, with sensor, delays and dead time. Its controller's real zeros and
        poles, and its gain in the middle of the goal's frequencies, are moved by a decade at
        most; equal ones stay equal, those at s = 0 stay there.
    objective : str
        What is to become as large as possible: a key of `constraints`.
    constraints : mapping of str to float
        Lower bounds on the others:

        - "suppression": smallest \|K\| at the frequencies of the goal, over that of the goal,
          in dB; nothing is said about what lies between them
        - "critical_perturbation": the smallest one along (1, -1) that breaks the loop
        - "modulus", "modulus_in_corners": smallest \|1 + L\| at (1, 1), and in the worst corner
          of the box
        - "phase": phase margin at (1, 1), in rad
    goal : tuple of two sequences of floats, optional
        Frequencies in Hz, and the \|K\| that suppression is relative to. By default that of
        the structure, at 60 frequencies from 0.1 mHz to 1 Hz.
    box : float, optional
        Perturbations of either arm for which the loop is to be stable.

    Returns
    -------
    Design

    Raises
    ------
    TypeError, ValueError
        If an argument is not what it is to be; the structure has complex factors, or ones right
        of the imaginary axis, or is not stable; or no candidate met all constraints: the
        message names those that were missed by the best candidate, and by how much.
    CountError
        If rounding spoils a certificate.

    Notes
    -----
    All measures that are returned are certified, as are the counts over the box. The search
    is not, a method of simplices from the start on: nothing says that there is no better
    controller, and from another start it may find one.

    Examples
    --------
    As much suppression as leaves a phase margin of 0.35 rad, or 20 degrees:

    >>> from armlock import Loop, design
    >>> start = Loop(([], [-0.1], 3.0), "single", 20.0)
    >>> found = design(start, "suppression", {"phase": 0.35})
    >>> found.measures["phase"] >= 0.35
    True
    """
    bounds = _checked_bounds(objective, constraints)
    box = positive_number("box", box)
    parameters = _parameters(structure)
    goal = _checked_goal(structure, goal)
    moved = partial(_moved, structure, parameters, np.exp(np.log(goal[0]).mean()))
    samples = _samples(structure)
    sampled = partial(_sampled, samples, goal, box)
    _check_start(structure, sampled(structure))

    def cost(x: FloatArray) -> float:
        found = sampled(moved(x))
        if found is None:
            return _UNSTABLE
        missed = (
            _logarithm(n, b) + _SPARE - _logarithm(n, found[n]) for n, b in bounds.items()
        )
        return 10.0 * sum(max(m, 0.0) for m in missed) - _logarithm(objective, found[objective])

    loop = moved(_smallest(cost, len(parameters) + 1))
    counts = box_counts(loop, box, samples.omega[samples.free])
    if counts.any():
        raise ValueError(
            f"constraints must leave a loop that is stable over the box; the best candidate, "
            f"{loop.controller!r}, has the counts {counts.tolist()} over it"
        )
    measures = {name: _certified(name, loop, goal, box) for name in (objective, *bounds)}
    missed = [
        f"{name} {measures[name]:.6g}{_UNITS.get(name, '')} in place of {bound:.6g}"
        for name, bound in bounds.items()
        if measures[name] < bound
    ]
    if missed:
        raise ValueError(
            f"constraints must be such that all can be met; the best candidate has "
            f"{', and '.join(missed)}"
        )
    return Design(loop, measures, counts)


def _checked_bounds(objective: str, constraints: Mapping[str, float]) -> dict[str, float]:
    if one_of("objective", objective, MEASURES) in constraints:
        raise ValueError(f"objective must not be among constraints, got {objective!r} in both")
    for name in constraints:
        one_of("constraints", name, MEASURES)
    bounds = {
        name: (real_number if name == "suppression" else positive_number)(name, bound)
        for name, bound in constraints.items()
    }
    if bounds.get("phase", 0.0) > math.pi:
        raise ValueError(f"phase must not exceed pi, in rad, got {bounds['phase']}")
    return bounds


def _checked_goal(structure: Loop, goal: tuple[npt.ArrayLike, npt.ArrayLike] | None) -> _Goal:
    if goal is None:
        frequency = np.geomspace(*_GOAL_BAND)
        return frequency, np.abs(structure.controller(2j * np.pi * frequency))
    frequency, size = (positive_array("goal", axis("goal", values)) for values in goal)
    if frequency.shape != size.shape:
        raise ValueError(
            f"goal must hold as many gains as frequencies, got {size.size} and {frequency.size}"
        )
    return frequency, size


def _check_start(structure: Loop, sampled: dict[str, float] | None) -> None:
    """Raise unless the start is stable, and seen to be so."""
    if count := loop_count(structure):
        raise ValueError(
            f"structure must be stable at (c1, c2) = (1, 1), where a search starts; got a loop "
            f"whose count of unstable roots is {count}"
        )
    if sampled is None:
        raise ValueError(
            "structure must be a loop whose stability the samples show on which a search looks "
            "at its candidates, at (c1, c2) = (1, 1) and over the box; they do not"
        )


def _parameters(structure: Loop) -> list[tuple[str, complex]]:
    """Return what moves but the gain: zeros and poles not at s = 0, equal ones as one."""
    k = checked_loop(structure).controller
    if any(r.imag or r.real > 0.0 for r in (*k.zeros, *k.poles)):
        raise ValueError(
            "structure must have a controller with real zeros and poles, none positive; "
            f"got zeros {k.zeros} and poles {k.poles}"
        )
    roots = [("zero", z) for z in k.zeros if z] + [("pole", p) for p in k.poles if p]
    return list(dict.fromkeys(roots))


def _moved(
    structure: Loop, parameters: list[tuple[str, complex]], frequency: float, x: FloatArray
) -> Loop:
    """Return a candidate: parameters, and |K| at a frequency in Hz, moved by x decades."""
    old, (*moves, gain) = structure.controller, 10.0**x
    factors = dict(zip(parameters, moves, strict=True))
    zeros = [z * factors.get(("zero", z), 1.0) for z in old.zeros]
    poles = [p * factors.get(("pole", p), 1.0) for p in old.poles]
    k, middle = Controller(zeros, poles, old.gain), 2j * np.pi * frequency
    k = Controller(zeros, poles, old.gain * float(gain * abs(old(middle) / k(middle))))
    return Loop(k, structure.mapping, structure.tau1, structure.tau2, structure.delay)


class _Samples(NamedTuple):
    """Angular frequencies in rad/s at which candidates are looked at, ascending.

    Up to `low` of them L is taken as it is. Above, the mean phase of the arms turns much faster
    than all else, and L goes around a circle; from `free` on so does the phase between the
    arms, and L fills a disc. L has so many poles at s = 0 as `order` says.
    """

    omega: FloatArray
    low: int
    free: int
    order: int


def _samples(start: Loop) -> _Samples:
    longest, apart = start.longest_delay, abs(start.tau1 - start.tau2)
    at_one = LoopAt(start, 1.0, 1.0)
    lowest, low_end = at_one.leading_radius(), 0.6 / longest
    low = np.geomspace(lowest, low_end, math.ceil(_PER_DECADE * math.log10(low_end / lowest)))
    corners = [abs(r) for r in (*start.controller.zeros, *start.controller.poles)]
    dead = 1.0 / start.delay if start.delay else 0.0
    unity = last_crossover(start, np.ones(2))
    beat = 40.0 / max(apart, 1e-2 * longest)
    top = 30.0 * max([*corners, dead, beat, unity if unity < math.inf else 0.0])
    above = np.geomspace(low_end, top, _ABOVE)
    if apart:
        # The circle is widest where the arms are whole turns apart.
        steps = 2.0 * np.pi / apart * np.arange(1, 241) / 40.0
        above = np.union1d(above, steps[(steps > low_end) & (steps < beat)])
    omega = np.append(low, above)
    free = int(np.searchsorted(omega, beat))
    return _Samples(omega, low.size, free, at_one.poles_at_zero())


def _sampled(samples: _Samples, goal: _Goal, box: float, loop: Loop) -> dict[str, float] | None:
    """Measure a candidate; None if it is not stable as far as the samples tell."""
    omega, low, free, order = samples
    s = 1j * omega
    first, second = loop.arm_responses(s)
    late = np.array([first * np.exp(-s * loop.tau1), second * np.exp(-s * loop.tau2)])
    # Centres and radii of what L fills, with a row for (1, 1) and each corner.
    c = 1.0 + box * _POINTS
    turning = c @ late
    centre, radius = np.tile(first + second, (len(c), 1)), np.abs(turning)
    centre[:, :low] -= turning[:, :low]
    radius[:, :low] = 0.0
    radius[:, free:] = (c @ np.abs(late))[:, free:]
    distance = np.abs(1.0 + centre) - radius
    # Of a stable loop 1 + L turns by a right angle for each pole of L at s = 0, no more.
    phase = np.unwrap(np.angle(1.0 + centre[0]))
    turn = phase[-1] - phase[0] - 0.5 * np.pi * order
    if abs(turn) > 0.5 * np.pi or not (distance[0] > 0.0).all():
        return None
    # On the way to a corner a loop may lose stability, and come to rest off -1 there.
    breaks = [_first_real(ray) for ray in (1.0 + centre[0, :low]) / (CORNERS @ late)[:, :low]]
    if min(breaks) < box * _WIDER:
        return None
    return {
        "suppression": _suppression(loop, goal),
        "critical_perturbation": breaks[_ALONG],
        "modulus": float(distance[0].min()),
        "modulus_in_corners": float(distance[1:].min()),
        "phase": _phase_at_unity_gain(centre[0], radius[0]),
    }


def _phase_at_unity_gain(centre: ComplexArray, radius: FloatArray) -> float:
    """Return the smallest phase margin of circles, or discs, that meet the unit circle.

    Where they are points, a crossing lies between two of them: both count.
    """
    size = np.abs(centre)
    meets = np.abs(size - 1.0) <= radius
    crosses = np.diff(np.sign(size - 1.0)) != 0.0
    meets[1:] |= crosses
    meets[:-1] |= crosses
    size, radius = size[meets], radius[meets]
    cosine = np.clip((1.0 + size**2 - radius**2) / (2.0 * size), -1.0, 1.0)
    half = np.where(radius > 0.0, np.arccos(cosine), 0.0)
    return float((np.abs(np.angle(-centre[meets])) - half).min(initial=np.pi))


def _first_real(values: ComplexArray) -> float:
    """Return the smallest positive value at which a sampled curve crosses the real axis.

    It begins next to omega = 0, where it may cross, too: its values at -omega are conjugate.
    """
    if abs(values[0].imag) < 1e-2 * abs(values[0].real):
        values = np.append(values[0].conj(), values)
    at = np.flatnonzero(values.imag[1:] * values.imag[:-1] < 0.0)
    a, b = values[at], values[at + 1]
    share = a.imag / (a.imag - b.imag)
    found = a.real + share * (b.real - a.real)
    return float(found[found > 0.0].min(initial=math.inf))


def _suppression(loop: Loop, goal: _Goal) -> float:
    """Return the smallest |K| at the frequencies of the goal, over that of the goal, in dB."""
    frequency, wanted = goal
    size = np.abs(loop.controller(2j * np.pi * frequency))
    return float(20.0 * np.log10(np.min(size / wanted)))


def _logarithm(name: str, value: float) -> float:
    """Return a measure as the search compares it: by factors."""
    if name == "suppression":
        return value * math.log(10.0) / 20.0
    return math.log(min(max(value, 1e-30), 1e30))


def _smallest(cost: Callable[[FloatArray], float], size: int) -> FloatArray:
    """Look for the smallest cost from zero on, within -1 and 1; return where."""
    x, limits = np.zeros(size), np.tile((-1.0, 1.0), (size, 1))
    for reach in (0.05, 0.02, 0.005):
        # Where that leaves the limits, scipy turns it back inside.
        simplex = np.vstack((x, x + reach * np.eye(size)))
        options = {"initial_simplex": simplex, "adaptive": True, "maxfev": 150 * size}
        options |= {"xatol": 1e-5, "fatol": 1e-7}
        x = minimize(cost, x, method="Nelder-Mead", bounds=limits, options=options).x
    return x


def _certified(name: str, loop: Loop, goal: _Goal, box: float) -> float:
    """Return a measure of what was found."""
    if name == "suppression":
        return _suppression(loop, goal)
    if name == "critical_perturbation":
        return critical_perturbation(loop, CORNERS[_ALONG])
    if name == "phase":
        return margins(loop).phase
    points = _POINTS[1:] if name == "modulus_in_corners" else _POINTS[:1]
    return min(modulus_margin(loop, *map(float, c)) for c in 1.0 + box * points)
