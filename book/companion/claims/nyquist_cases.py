"""Claims of Sec. IV.A, the Nyquist plots: N1 to N11."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from armlock.controllers import Controller
from armlock.loops import CommonArm, DualArm, Loop, SingleArm
from armlock.margins import gain_interval, margins
from armlock.noise import band_rms
from armlock.nyquist import AxisCrossings, NyquistCurve, axis_crossings, nyquist
from armlock.paper import (
    DUAL_SENSOR_CORNER,
    DURATION,
    PERTURBATION,
    PHASE_NOISE_CORNER,
    PHASE_NOISE_LEVEL,
    SAMPLE_RATE,
    TAU1,
    TAU2,
)
from armlock.roots import rightmost_root
from armlock.stability import unstable_roots
from book.companion.claims.ledger import Finding, Verdict, claim

CHAPTER = "05_nyquist"

#: The loops of the section, at the gains of the paper's charts.
SINGLE, COMMON, DUAL = SingleArm(), CommonArm(), DualArm()
#: The perturbed single arm and dual arm of the paper's Fig. 7, and the common arm alike.
SINGLE_POINT = (1.001, 1.0)
COMMON_POINT = (1.0, 1.001)
DUAL_POINT = (1.0, 0.995)
#: Gain factors at which a verdict is tried, over seven decades.
FACTORS = np.logspace(-4.0, 3.0, 15)


class Panel(NamedTuple):
    """One panel of the paper's Fig. 7: what is drawn, and the loop and point behind it."""

    name: str
    loop: Loop
    point: tuple[float, float]


#: The four panels, in the paper's order.
PANELS = (
    Panel("a  single arm, $c_1 = 1$", SINGLE, (1.0, 1.0)),
    Panel("b  single arm, $c_1 = 1.001$", SINGLE, SINGLE_POINT),
    Panel("c  dual arm, (1, 1)", DUAL, (1.0, 1.0)),
    Panel("d  dual arm, (1, 0.995)", DUAL, DUAL_POINT),
)


class PanelCount(NamedTuple):
    """Count of a panel: encirclements N, open-loop poles P, roots Z = N + P and two checks.

    `winding` is the independent count of D, -1 on the boundary; `rightmost` the rightmost
    root of 1 + L in rad/s; `order` the order of the pole of L at s = 0.
    """

    encirclements: int
    poles: int
    roots: int
    winding: int
    rightmost: complex
    order: int


@cache
def panel_counts() -> tuple[PanelCount, ...]:
    """Count each panel of the paper's Fig. 7 twice, and find its rightmost root."""
    found = []
    for panel in PANELS:
        curve = nyquist(panel.loop, *panel.point)
        found.append(
            PanelCount(
                curve.encirclements,
                curve.open_loop_poles,
                curve.closed_loop_roots,
                int(unstable_roots(panel.loop, *panel.point)),
                rightmost_of_loop(panel.loop, *panel.point),
                curve.pole_order,
            )
        )
    return tuple(found)


def rightmost_of_loop(loop: Loop, c1: float, c2: float) -> complex:
    """Return the rightmost root of 1 + L, leaving out a root s = 0 that only D has.

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float
        The point.
    """
    root = complex(np.asarray(rightmost_root(loop, c1, c2)))
    if root != 0.0:
        return root
    # Right of Re s = -sigma there are the root s = 0 and what is looked for.
    low, high = 1e-9, 1.0
    while high / low > 1.0 + 1e-9:
        middle = float(np.sqrt(low * high))
        count = int(unstable_roots(loop.shifted(-middle), c1, c2))
        low, high = (middle, high) if count == 1 else (low, middle)
    return complex(-low)


def phase_of_branch(curve: NyquistCurve) -> tuple[float, float]:
    """Return the phase of L at omega = 0- and its change to omega = 0+, in rad.

    Parameters
    ----------
    curve : NyquistCurve
        With a pole at s = 0, passed on its right.
    """
    arc = curve.indentation_response
    half = float(np.angle(arc[1:] / arc[:-1]).sum())
    return float(np.angle(arc[-1].conj())), 2.0 * half


def first_crossing(loop: Loop, c1: float, c2: float, near: float) -> AxisCrossings:
    """Return the crossings of the negative real axis within 10 % of a frequency in rad/s."""
    found = axis_crossings(loop, c1, c2, omega_max=1.1 * near)
    kept = found.omega > 0.9 * near
    return AxisCrossings(found.omega[kept], found.value[kept])


def furthest_crossing(
    loop: Loop, c1: float, c2: float, omega_max: float
) -> tuple[float, float]:
    """Return (omega, L) of the crossing furthest out; (nan, 0) if there is none."""
    found = axis_crossings(loop, c1, c2, omega_max=omega_max)
    if found.omega.size == 0:
        return float("nan"), 0.0
    index = int(np.argmin(found.value))
    return float(found.omega[index]), float(found.value[index])


def at_gain(loop: Loop, factor: float) -> Loop:
    """Return the loop with its gain times a factor."""
    k = loop.controller
    return Loop(
        Controller(k.zeros, k.poles, k.gain * factor), loop.mapping, loop.tau1, loop.tau2
    )


def low_gain_threshold() -> float:
    """Smallest c2 - 1 from which on the dual arm also has a lower gain margin, at c1 = 1.

    At low gain 1 + L has the roots of s^2 + g (a s + b) with the first terms b / s^2 + a / s
    of the loop per gain; they are stable as long as a is positive.
    """
    spread = TAU1 - TAU2
    return 1.0 / (1.0 + TAU2 / spread + 1.0 / (DUAL_SENSOR_CORNER * spread))


def fewest_roots(loop: Loop, c1: float, c2: float) -> int:
    """Return the smallest number of unstable roots of 1 + L over all gains tried."""
    return min(nyquist(at_gain(loop, factor), c1, c2).closed_loop_roots for factor in FACTORS)


def common_threshold() -> float:
    """Smallest c2 - 1 at which the common arm crosses near 2 pi over the mean delay.

    Im L = 0 reads cos(omega tau1) + c2 cos(omega tau2) = 2, at any gain.
    """
    near = 4.0 * np.pi / (TAU1 + TAU2)

    def needed(omega: float) -> float:
        return float((2.0 - np.cos(omega * TAU1)) / np.cos(omega * TAU2) - 1.0)

    found = minimize_scalar(
        needed, bounds=(0.95 * near, 1.05 * near), method="bounded", options={"xatol": 1e-12}
    )
    return float(found.fun)


class GainMargin(NamedTuple):
    """Gain margins of the dual arm at (1, 1 + size), and where the upper one is taken."""

    size: float
    factor: float
    omega: float
    lower: float


@cache
def dual_gain_margins(start: float = 1e-6, stop: float = 1e-2) -> tuple[GainMargin, ...]:
    """Return the gain margins on the stable side, three sizes a decade."""
    number = 1 + round(3 * np.log10(stop / start))
    found = []
    for size in np.geomspace(start, stop, number):
        lower, upper, omega = gain_interval(DUAL, 1.0, 1.0 + float(size))
        found.append(GainMargin(float(size), upper, omega, lower))
    return tuple(found)


@claim(
    "N1",
    place="Sec. IV.A, first paragraph",
    says="The perturbations are no larger than 10⁻⁶, for which the appendix gives the reason.",
    chapter=CHAPTER,
    pinned=(Verdict.DIFFERS, 0.0145793, 1e-6),
    affects=("N10", "K5"),
)
def size_of_perturbations() -> Finding:
    """Integrate the appendix's spectrum over the simulated band."""
    low, high = 1.0 / DURATION, 0.5 * SAMPLE_RATE

    def density(log_frequency: float) -> float:
        f = float(np.exp(log_frequency))
        return PHASE_NOISE_LEVEL**2 * (1.0 + (PHASE_NOISE_CORNER / f) ** 4) * f

    power = quad(density, np.log(low), np.log(high), epsabs=0.0, epsrel=1e-10, limit=500)[0]
    rms = float(np.sqrt(power))
    agrees = abs(rms / band_rms(low, high) - 1.0) < 1e-8
    band = (PERTURBATION / PHASE_NOISE_LEVEL) ** 2
    verdict = Verdict.DIFFERS if rms > 10.0 * PERTURBATION else Verdict.REPRODUCED
    return Finding(
        verdict if agrees else Verdict.OPEN,
        rms,
        f"r.m.s. of the appendix's spectrum from {low:g} Hz to {high:g} Hz",
        f"That is {rms / PERTURBATION:.0f} times 10⁻⁶. Even where the spectrum is flat, at "
        f"{PHASE_NOISE_LEVEL:g}/√Hz, a band of {1e3 * band:.1f} mHz is enough for 10⁻⁶. So "
        "10⁻⁶ is an assumption, and the appendix does not support it. The Nyquist plots do not "
        "depend on it: they have perturbations of a thousandth. Claim A3 has the same from the "
        "side of the appendix.",
    )


@claim(
    "N2",
    place="Sec. IV.A, Fig. 7a",
    says="At c₁ = 1 the single arm's Nyquist curve is tangent at the origin, and its gain "
    "margin is infinite.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def single_arm_ideal() -> Finding:
    """Look at the curve around 2 pi / tau, for crossings, and at counts over all gains."""
    turn = 2.0 * np.pi / SINGLE.tau
    offsets = np.array([-1e-5, 1e-5]) * turn
    before, after = SINGLE.open_loop(1j * (turn + offsets))
    direction = after - before
    slope = abs(float(np.angle(direction)))
    omega = np.linspace(1e-4, 60.0 * turn, 600_001)
    highest = float(np.max(SINGLE.open_loop(1j * omega).imag))
    crossings = axis_crossings(SINGLE).omega.size
    roots = [nyquist(at_gain(SINGLE, k)).closed_loop_roots for k in FACTORS]
    at_origin = abs(complex(SINGLE.open_loop(1j * turn)))
    tangent = slope < 1e-4 and at_origin < 1e-9 and highest < 1e-12
    infinite = crossings == 0 and not any(roots)
    return Finding(
        Verdict.REPRODUCED if tangent and infinite else Verdict.DIFFERS,
        crossings,
        "crossings of the negative real axis",
        "At every multiple of 2π/τ the curve passes through the origin, horizontally, from "
        "left to right, and nowhere comes above the real axis for ω > 0. What it is tangent "
        "to is the real axis. With the open loop L, 1 + L has no unstable root at any of "
        f"{FACTORS.size} gains from {FACTORS[0]:g} to {FACTORS[-1]:g} rad/s.",
    )


@claim(
    "N3",
    place="Sec. IV.A, Fig. 7b",
    says="For c₁ slightly above 1 there is an infinite branch at ω = 0, along which the phase "
    "goes from -π/2 at ω = 0⁻ to π/2 at ω = 0⁺ around the left half-plane.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, -1.0, 1e-3),
)
def single_arm_branch() -> Finding:
    """Follow the phase of L along the indentation, on both sides of c1 = 1."""
    curve = nyquist(SINGLE, *SINGLE_POINT)
    start, change = phase_of_branch(curve)
    left = float(curve.indentation_response[0].real) < 0.0
    other = nyquist(SINGLE, 2.0 - SINGLE_POINT[0])
    other_start, other_change = phase_of_branch(other)
    right = float(other.indentation_response[0].real) > 0.0
    as_said = abs(start + 0.5 * np.pi) < 1e-3 and abs(change + np.pi) < 1e-3 and left
    return Finding(
        Verdict.REPRODUCED if as_said and curve.encirclements == 1 else Verdict.DIFFERS,
        change / np.pi,
        "change of the phase from ω = 0⁻ to 0⁺, in units of π",
        f"From {start / np.pi:.2f} π down to {(start + change) / np.pi:.2f} π, which is the "
        "same direction as +π/2: clockwise through the negative real axis, if the contour "
        f"passes the pole at s = 0 on its right. That gives {curve.encirclements} "
        f"encirclement of -1 and {curve.closed_loop_roots} unstable root. At c₁ = "
        f"{2.0 - SINGLE_POINT[0]:g} there is such a branch as well, from "
        f"{other_start / np.pi:.2f} π by {other_change / np.pi:.0f} π through the "
        f"{'right' if right else 'left'} half-plane, with {other.encirclements} encirclements.",
    )


@claim(
    "N4",
    place="Sec. IV.A, after Fig. 7b",
    says="For c₁ > 1 the open loop at ω = 2π/τ is 1 - c₁, a negative number.",
    chapter=CHAPTER,
    pinned=(Verdict.NOT_AS_WRITTEN, 0.5, 1e-9),
    affects=("N5", "N6"),
)
def value_at_full_turn() -> Finding:
    """Evaluate the loop with and without the integrating actuator at 2 pi / tau."""
    turn = 2.0 * np.pi / SINGLE.tau
    c1 = SINGLE_POINT[0]
    value = complex(SINGLE.open_loop(1j * turn, c1))
    plain = Loop(Controller((), (), 1.0), SINGLE.mapping, SINGLE.tau, SINGLE.tau)
    without = complex(plain.open_loop(1j * turn, c1))
    phase = float(np.angle(value))
    imaginary = abs(phase - 0.5 * np.pi) < 1e-6
    as_printed = abs(without - (1.0 - c1)) < 1e-9
    if abs(value - (1.0 - c1)) < 1e-9:
        verdict = Verdict.REPRODUCED
    else:
        verdict = Verdict.NOT_AS_WRITTEN if imaginary and as_printed else Verdict.DIFFERS
    return Finding(
        verdict,
        phase / np.pi,
        "phase of the open loop at 2π/τ, in units of π",
        f"With the factor g/s that the paper's P_s has, the open loop is {value.imag:.3g}j at "
        f"c₁ = {c1:g}: on the positive imaginary axis. {without.real:.3g} is the value of "
        "1 - c₁ exp(-jωτ) alone, without g/s.",
    )


@claim(
    "N5",
    place="Sec. IV.A, after Fig. 7b",
    says="For c₁ > 1 the curve no longer meets the real axis at the origin but on its negative "
    "half, so that the gain margin is finite and depends on the perturbation.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, -0.1441254, 1e-6),
)
def single_arm_crossing() -> Finding:
    """Find the crossing, compare it with its closed form, and count over all gains."""
    c1 = SINGLE_POINT[0]
    turn = 2.0 * np.pi / SINGLE.tau
    found = first_crossing(SINGLE, *SINGLE_POINT, near=turn)
    omega, value = float(found.omega[0]), float(found.value[0])
    closed = -SINGLE.gain * np.sqrt(c1 * c1 - 1.0) / omega
    factor = -1.0 / value
    sides = [
        nyquist(at_gain(SINGLE, factor * k), *SINGLE_POINT).closed_loop_roots
        for k in (1.0 - 1e-6, 1.0 + 1e-6)
    ]
    fewest = fewest_roots(SINGLE, *SINGLE_POINT)
    moved = abs(value / closed - 1.0) < 1e-9
    if not moved:
        verdict = Verdict.DIFFERS
    else:
        verdict = Verdict.IN_PART if fewest > 0 else Verdict.REPRODUCED
    return Finding(
        verdict,
        value,
        f"the open loop where its curve first crosses the negative real axis, at c₁ = {c1:g}",
        f"At ω = {omega:.5f} rad/s, {100.0 * (1.0 - omega / turn):.2f} % below 2π/τ; in "
        f"closed form -g√(c₁² - 1)/ω. A gain {factor:.3f} times higher puts it on -1, and the "
        f"number of unstable roots goes from {sides[0]} to {sides[1]}. But this is no margin: "
        f"at every gain there is at least {fewest} unstable root, and no gain makes the loop "
        "stable. What moves with the perturbation is the gain at which a further pair becomes "
        "unstable.",
    )


@claim(
    "N6",
    place="Sec. IV.A, on the common arm",
    says="The common arm behaves alike: its curve is tangent at the origin, the infinite "
    "branch makes it unstable, and a crossing of the negative real axis reduces the gain "
    "margin.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 9.87346e-4, 1e-8),
)
def common_arm_alike() -> Finding:
    """Measure how far the ideal curve misses the origin, and what the crossing needs."""
    near = 4.0 * np.pi / (TAU1 + TAU2)
    omega = np.linspace(0.99 * near, 1.01 * near, 200_001)
    miss = float(np.abs(COMMON.open_loop(1j * omega)).min())
    curve = nyquist(COMMON, *COMMON_POINT)
    start, change = phase_of_branch(curve)
    alike = abs(start + 0.5 * np.pi) < 1e-3 and abs(change + np.pi) < 1e-3
    threshold = common_threshold()
    sides = [
        first_crossing(COMMON, 1.0, 1.0 + threshold * k, near).omega.size
        for k in (1.0 - 1e-6, 1.0 + 1e-6)
    ]
    small = furthest_crossing(COMMON, 1.0, 1.0 + PERTURBATION, 100.0)
    fewest = fewest_roots(COMMON, *COMMON_POINT)
    branch = alike and curve.encirclements == 1
    exact = branch and miss < 1e-9 and threshold < PERTURBATION
    sound = branch and sides[0] == 0 and sides[1] > 0
    in_part = Verdict.IN_PART if sound else Verdict.DIFFERS
    return Finding(
        Verdict.REPRODUCED if exact else in_part,
        threshold,
        "c₂ - 1 from which on the curve crosses the negative real axis near 2π over the mean "
        "delay",
        f"The branch is as in the single arm, with {curve.encirclements} encirclement at (1, "
        f"{COMMON_POINT[1]:g}). But the two delays never complete a turn together: the ideal "
        f"curve passes below the origin at a distance of {miss:.1e} (g = {COMMON.gain:g} "
        "rad/s), and a smaller perturbation leaves it on that side. At (1, 1 + 10⁻⁶) the "
        f"first crossing is at {small[0]:.2f} rad/s, where the open loop is {small[1]:.2e}. "
        f"At (1, {COMMON_POINT[1]:g}) there is at least {fewest} unstable root at every gain, "
        "as in the single arm.",
    )


@claim(
    "N7",
    place="Sec. IV.A, Fig. 7c",
    says="Without perturbations the dual arm stands precisely on the boundary of stability.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def dual_arm_ideal() -> Finding:
    """Count at (1, 1) and on both sides of it; find the root of 1 + L."""
    sides = [int(unstable_roots(DUAL, 1.0, 1.0 + k * PERTURBATION)) for k in (1, 0, -1)]
    curve = nyquist(DUAL)
    root = rightmost_of_loop(DUAL, 1.0, 1.0)
    fits = sides == [0, -1, 1] and curve.closed_loop_roots == 0
    return Finding(
        Verdict.REPRODUCED if fits else Verdict.DIFFERS,
        curve.closed_loop_roots,
        "zeros of 1 + L in the right half-plane at (1, 1), with the open loop L",
        f"{sides[0]} unstable roots at (1, 1 + 10⁻⁶), {sides[2]} at (1, 1 - 10⁻⁶), and "
        "between the two the characteristic function D has a root s = 0. That root belongs to "
        "the sensor's integral, not to 1 + L: L has a simple pole at s = 0 there, order "
        f"{curve.pole_order}, its curve does not encircle -1, and the slowest root of 1 + L "
        f"is at {root.real:.3g}/s.",
    )


@claim(
    "N8",
    place="Sec. IV.A, Fig. 7d",
    says="At (1, 0.995) the dual arm is unstable: its open loop is of order 1/s² near s = 0, "
    "and the infinite branch encircles the origin once, counter-clockwise, as ω passes zero.",
    chapter=CHAPTER,
    pinned=(Verdict.NOT_AS_WRITTEN, -1.0, 1e-3),
    affects=("D4", "N11"),
)
def dual_arm_branch() -> Finding:
    """Follow the phase of L along the indentation, right and left of the pole."""
    c1, c2 = DUAL_POINT
    curve = nyquist(DUAL, c1, c2)
    _, change = phase_of_branch(curve)
    turns = change / (2.0 * np.pi)
    radius = float(np.abs(curve.indentation[0]))
    leading = DUAL.gain * (c2 - c1) / (TAU1 - TAU2)
    size = complex(DUAL.open_loop(radius, c1, c2)) * radius**2
    # The other way around the pole, with the two poles inside.
    around = radius * np.exp(1j * np.linspace(-0.5 * np.pi, -1.5 * np.pi, 401))
    value = DUAL.open_loop(around, c1, c2)
    other = float(np.angle(value[1:] / value[:-1]).sum()) / (2.0 * np.pi)
    inside = curve.closed_loop_roots - curve.pole_order
    order = curve.pole_order == 2 and abs(size / leading - 1.0) < 1e-2
    unstable = curve.closed_loop_roots == 1 and order
    if not unstable or abs(abs(turns) - 1.0) > 1e-3:
        verdict = Verdict.DIFFERS
    else:
        verdict = Verdict.REPRODUCED if turns > 0 else Verdict.NOT_AS_WRITTEN
    return Finding(
        verdict,
        turns,
        "turns of the infinite branch around the origin, counter-clockwise positive",
        f"Unstable, with {curve.closed_loop_roots} root at "
        f"{rightmost_of_loop(DUAL, c1, c2).real:.4g}/s, and near s = 0 the open loop is "
        f"{leading:.3g}/s². One turn, but clockwise, when the contour passes s = 0 on the "
        "right, as the paper has it for the single arm: N = 1 encirclement of -1, P = 0 "
        "open-loop poles and Z = N + P = 1 root in the right half-plane. Counter-clockwise it "
        f"is only for a contour that passes on the left ({other:+.0f} turn); then the double "
        f"pole lies inside, P = {curve.pole_order}, N = {inside}, and Z = "
        f"{inside + curve.pole_order} again. Counter-clockwise with P = 0 would mean a "
        "negative number of roots.",
    )


@claim(
    "N9",
    place="Sec. IV.A, on the dual arm",
    says="The dual arm has only a finite gain margin, which shrinks as the perturbation grows.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 3134.6589, 1e-3),
)
def dual_arm_gain_margin() -> Finding:
    """Compute the margin on the stable side, and look for one at the paper's points."""
    table = dual_gain_margins()
    factor = np.array([row.factor for row in table])
    size = np.array([row.size for row in table])
    falls = bool((np.diff(factor) < 0.0).all()) and bool(np.isfinite(factor).all())
    slow = size < 3e-5
    exponent = float(np.polyfit(np.log(size[slow]), np.log(factor[slow]), 1)[0])
    ideal = [nyquist(at_gain(DUAL, k)).closed_loop_roots for k in FACTORS]
    bounded = axis_crossings(DUAL).omega.size > 0 or any(ideal)
    lowered = gain_interval(DUAL, 1.0 - 1e-3, 1.0)[1]
    fewest = fewest_roots(DUAL, *DUAL_POINT)
    everywhere = bounded and np.isfinite(lowered) and fewest == 0
    if not falls:
        verdict = Verdict.DIFFERS
    else:
        verdict = Verdict.REPRODUCED if everywhere else Verdict.IN_PART
    return Finding(
        verdict,
        float(factor[0]),
        f"gain factor up to which the dual arm stays stable at (1, 1 + {size[0]:g}), g = "
        f"{DUAL.gain:g} rad/s",
        f"On the stable side with c₁ + c₂ > 2 it is so: {factor[0]:.0f} at (1, 1 + "
        f"{size[0]:g}), {factor[-1]:.1f} at (1, 1 + {size[-1]:g}), at first falling as the "
        f"perturbation to the power {exponent:.2f}. From (1, 1 + {low_gain_threshold():.2g}) "
        f"on there is a lower limit as well, a factor {table[-1].lower:.1e} at (1, 1 + "
        f"{size[-1]:g}). At (1, 1) the Nyquist curve crosses the negative real axis nowhere, "
        "and at "
        + (
            "some gains there are unstable roots"
            if any(ideal)
            else "no gain tried there is an unstable root"
        )
        + f". At (0.999, 1) the margin is {_number(lowered)}: perturbations that weaken the "
        f"arms give no crossing. At the paper's (1, {DUAL_POINT[1]:g}) there is no margin to "
        f"speak of: at least {fewest} unstable root at every gain.",
    )


def _number(value: float) -> str:
    """Write a factor, or that it is infinite."""
    return f"{value:.4g}" if np.isfinite(value) else "infinite"


@claim(
    "N10",
    place="Sec. IV.A, end of the paragraph on the dual arm",
    says="Even small deviations of c₁ and c₂ can change the stability margins significantly.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 0.309175, 1e-4),
)
def margins_near_ideal() -> Finding:
    """Compare modulus and phase margin on the stable side, near (1, 1) and further off."""
    sizes = (PERTURBATION, 1e-5, 1e-4, 5e-3)
    found = [margins(DUAL, 1.0, 1.0 + size) for size in sizes]
    change = max(abs(other.modulus / found[0].modulus - 1.0) for other in found)
    phases = np.degrees([result.phase for result in found])
    rate = rightmost_of_loop(DUAL, 1.0, 1.0 - PERTURBATION).real
    count = int(unstable_roots(DUAL, 1.0, 1.0 - PERTURBATION))
    gains = found[0].gain_upper / found[-1].gain_upper
    if count == 0:
        verdict = Verdict.DIFFERS
    else:
        verdict = Verdict.IN_PART if change < 0.05 else Verdict.REPRODUCED
    return Finding(
        verdict,
        100.0 * change,
        f"change of the modulus margin in % from (1, 1 + {sizes[0]:g}) to (1, 1 + "
        f"{sizes[-1]:g})",
        f"To the side c₁ > c₂, 10⁻⁶ is enough for {count} unstable root, which grows by a "
        f"factor e in {1.0 / rate / 86400.0:.1f} days. To the other side the upper gain margin "
        f"falls {gains:.0f}-fold, but from thousands; the modulus margin stays at "
        f"{found[0].modulus:.2f} and the phase margin between {phases.min():.1f} and "
        f"{phases.max():.1f} degrees. The margins do not announce the boundary: it is crossed "
        "at s = 0, where the open loop is infinite.",
    )


@claim(
    "N11",
    place="Sec. IV.A, on the single and the common arm",
    says="It is the infinite branch at ω = 0 that causes the instability.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 4.0, 0.0),
)
def branch_decides() -> Finding:
    """Look for stable loops with an infinite branch, and at the side it is on."""
    table: list[tuple[bool, bool]] = []
    for loop, points in (
        (SINGLE, ((1.001, 1.0), (0.999, 1.0), (0.5, 1.0))),
        (COMMON, ((1.0, 1.001), (1.0, 0.999), (0.7, 0.8))),
    ):
        for c1, c2 in points:
            curve = nyquist(loop, c1, c2)
            leftward = float(curve.indentation_response[0].real) < 0.0
            table.append((leftward, curve.closed_loop_roots > 0))
    matches = all(left == unstable for left, unstable in table)
    stable = sum(not unstable for _, unstable in table)
    if not matches:
        verdict = Verdict.DIFFERS
    else:
        verdict = Verdict.IN_PART if stable else Verdict.REPRODUCED
    return Finding(
        verdict,
        stable,
        f"stable ones among {len(table)} perturbed single and common arms, all with an "
        "infinite branch",
        "Every perturbed loop with an integrator has an infinite branch. What decides is its "
        "side: through the left half-plane for c₁ > 1 (c₁ + c₂ > 2), around -1, and through "
        "the right half-plane otherwise, where it is harmless.",
    )


__all__ = [
    "COMMON",
    "COMMON_POINT",
    "DUAL",
    "DUAL_POINT",
    "FACTORS",
    "PANELS",
    "SINGLE",
    "SINGLE_POINT",
    "at_gain",
    "common_threshold",
    "dual_gain_margins",
    "fewest_roots",
    "first_crossing",
    "furthest_crossing",
    "panel_counts",
    "phase_of_branch",
    "rightmost_of_loop",
]
