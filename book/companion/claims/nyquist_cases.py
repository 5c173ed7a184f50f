"""Claims of Sec. IV.A, the Nyquist plots: N1 to N11."""

from __future__ import annotations

from functools import cache, partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import bisect, minimize_scalar

from armlock.checks import FloatArray
from armlock.loops import CommonArm, DualArm, Loop, SingleArm
from armlock.margins import gain_interval, margins
from armlock.noise import band_rms
from armlock.nyquist import AxisCrossings, NyquistCurve, axis_crossings, nyquist
from armlock.paper import (
    DUAL_SENSOR_CORNER,
    DURATION,
    PERTURBATION,
    PHASE_NOISE_LEVEL,
    SAMPLE_RATE,
    TAU1,
    TAU2,
)
from armlock.roots import rightmost_root
from armlock.stability import BOUNDARY, unstable_roots
from book.companion.claims import ledger
from book.companion.claims.ledger import Finding, Verdict, Weight, decide

claim = partial(ledger.claim, chapter="05_nyquist")
Arm = SingleArm | CommonArm | DualArm

#: The loops of the section, at the gains of the paper's charts.
SINGLE, COMMON, DUAL = SingleArm(), CommonArm(), DualArm()
#: The perturbed single arm and dual arm of the paper's Fig. 7, and the common arm alike.
SINGLE_POINT = (1.001, 1.0)
COMMON_POINT = (1.0, 1.001)
DUAL_POINT = (1.0, 0.995)
#: Gain factors at which a verdict is tried, over seven decades.
FACTORS = np.logspace(-4.0, 3.0, 15)
#: Sizes of a perturbation at which the dual arm's gain margins are computed.
SIZES = np.geomspace(1e-6, 1e-2, 13)


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


def rightmost_of_loop(loop: Loop, c1: float, c2: float) -> complex:
    """Return the rightmost root of 1 + L in rad/s, leaving out a root s = 0 that only D has."""
    if unstable_roots(loop, c1, c2) != BOUNDARY:
        return rightmost_root(loop, c1, c2)

    def others(exponent: float) -> float:
        # Roots right of Re s = -10^exponent, besides s = 0.
        return int(unstable_roots(loop.shifted(-(10.0**exponent)), c1, c2)) - 1.5

    return complex(-(10.0 ** bisect(others, -9.0, -1.0)))


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


def starts_as_the_single_arm(curve: NyquistCurve) -> bool:
    """Tell whether the branch goes from -pi/2 clockwise by pi, and around -1."""
    start, change = phase_of_branch(curve)
    turns = abs(start + 0.5 * np.pi) < 1e-3 and abs(change + np.pi) < 1e-3
    return turns and curve.encirclements == 1


def crossing_near(loop: Loop, c1: float, c2: float, omega: float) -> AxisCrossings:
    """Return the crossings of the negative real axis within 10 % of a frequency in rad/s."""
    found = axis_crossings(loop, c1, c2, omega_max=1.1 * omega)
    kept = found.omega > 0.9 * omega
    return AxisCrossings(found.omega[kept], found.value[kept])


def outermost_crossing(
    loop: Loop, c1: float, c2: float, omega_max: float
) -> tuple[float, float]:
    """Return (omega, L) of the crossing of the negative real axis that is furthest out."""
    found = axis_crossings(loop, c1, c2, omega_max=omega_max)
    k = int(np.argmin(found.value))
    return float(found.omega[k]), float(found.value[k])


def at_gain(loop: Arm, factor: float) -> Arm:
    """Return one of the section's loops with its gain times a factor."""
    return type(loop)(loop.gain * factor)


def fewest_roots(loop: Arm, c1: float, c2: float) -> int:
    """Return the smallest number of unstable roots of 1 + L over all gains tried."""
    return min(nyquist(at_gain(loop, k), c1, c2).closed_loop_roots for k in FACTORS)


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


def low_gain_threshold() -> float:
    """Smallest c2 - 1 from which on the dual arm also has a lower gain margin, at c1 = 1.

    At low gain 1 + L has the roots of s^2 + g (a s + b) with the first terms b / s^2 + a / s
    of the loop per gain; they are stable as long as a is positive.
    """
    spread = TAU1 - TAU2
    return 1.0 / (1.0 + TAU2 / spread + 1.0 / (DUAL_SENSOR_CORNER * spread))


@cache
def dual_gains() -> FloatArray:
    """Return the lower and upper gain margin of the dual arm at (1, 1 + size), a row a size."""
    return np.array([gain_interval(DUAL, 1.0, 1.0 + float(size))[:2] for size in SIZES])


@claim(
    "N1",
    place="Sec. IV.A, first paragraph",
    says="The perturbations are no larger than 10⁻⁶, for which the appendix gives the reason.",
    pinned=(Verdict.DIFFERS, 0.0145793, 1e-6),
    affects=("N10", "K5"),
)
def size_of_perturbations() -> Finding:
    """Integrate the appendix's spectrum over the simulated band."""
    low, high = 1.0 / DURATION, 0.5 * SAMPLE_RATE
    rms = band_rms(low, high)
    flat = (PERTURBATION / PHASE_NOISE_LEVEL) ** 2
    return Finding(
        decide(rms <= PERTURBATION),
        rms,
        f"r.m.s. of the appendix's spectrum from {low:g} Hz to {high:g} Hz",
        f"That is {rms / PERTURBATION:.0f} times 10⁻⁶. Even where the spectrum is flat, at "
        f"{PHASE_NOISE_LEVEL:g}/√Hz, a band of {1e3 * flat:.1f} mHz is enough for 10⁻⁶, which "
        "therefore is an assumption. The Nyquist plots do not depend on it: they have "
        "perturbations of a thousandth.",
    )


@claim(
    "N2",
    place="Sec. IV.A, Fig. 7a",
    says="At c₁ = 1 the single arm's Nyquist curve is tangent at the origin, and its gain "
    "margin is infinite.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def single_arm_ideal() -> Finding:
    """Look at the curve around 2 pi / tau, for crossings, and at counts over all gains."""
    turn = 2.0 * np.pi / SINGLE.tau
    before, at, after = SINGLE.open_loop(1j * turn * np.array([1.0 - 1e-5, 1.0, 1.0 + 1e-5]))
    tangent = abs(at) < 1e-9 and abs(np.angle(after - before)) < 1e-4
    crossings = axis_crossings(SINGLE).omega.size
    highest = max(nyquist(at_gain(SINGLE, k)).closed_loop_roots for k in FACTORS)
    return Finding(
        decide(tangent, crossings == 0 and highest == 0),
        crossings,
        "crossings of the negative real axis",
        "At every multiple of 2π/τ the curve passes through the origin, horizontally; what it "
        "is tangent to is the real axis. 1 + L, with the open loop L, has no unstable root at "
        f"any of {FACTORS.size} gains from {FACTORS[0]:g} to {FACTORS[-1]:g} rad/s.",
    )


@claim(
    "N3",
    place="Sec. IV.A, Fig. 7b",
    says="For c₁ slightly above 1 there is an infinite branch at ω = 0, along which the phase "
    "goes from -π/2 at ω = 0⁻ to π/2 at ω = 0⁺ around the left half-plane.",
    pinned=(Verdict.REPRODUCED, -1.0, 1e-3),
    weight=Weight.DERIVATION,
)
def single_arm_branch() -> Finding:
    """Follow the phase of L along the indentation, on both sides of c1 = 1."""
    curve, other = nyquist(SINGLE, *SINGLE_POINT), nyquist(SINGLE, 2.0 - SINGLE_POINT[0])
    start, change = phase_of_branch(curve)
    other_start, other_change = phase_of_branch(other)
    return Finding(
        decide(starts_as_the_single_arm(curve)),
        change / np.pi,
        "change of the phase from ω = 0⁻ to 0⁺, in units of π",
        f"From {start / np.pi:.2f} π clockwise to {(start + change) / np.pi:.2f} π, the "
        "direction of +π/2, if the contour passes the pole at s = 0 on its right: "
        f"{curve.encirclements} encirclement of -1. At c₁ = {2.0 - SINGLE_POINT[0]:g} there is "
        f"such a branch as well, from {other_start / np.pi:.2f} π by "
        f"{other_change / np.pi:.0f} π through the right half-plane, with "
        f"{other.encirclements} encirclements.",
    )


@claim(
    "N4",
    place="Sec. IV.A, after Fig. 7b",
    says="For c₁ > 1 the open loop at ω = 2π/τ is 1 - c₁, a negative number.",
    pinned=(Verdict.NOT_AS_WRITTEN, 0.5, 1e-9),
    affects=("N5", "N6"),
    weight=Weight.WORDING,
)
def value_at_full_turn() -> Finding:
    """Evaluate the loop with and without the integrating actuator at 2 pi / tau."""
    s, c1 = 2j * np.pi / SINGLE.tau, SINGLE_POINT[0]
    value = complex(SINGLE.open_loop(s, c1))
    without = value * s / SINGLE.gain
    phase = float(np.angle(value))
    return Finding(
        decide(abs(value - (1.0 - c1)) < 1e-9, corrected=abs(without - (1.0 - c1)) < 1e-9),
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
    pinned=(Verdict.IN_PART, -0.1441254, 1e-6),
)
def single_arm_crossing() -> Finding:
    """Find the crossing, compare it with its closed form, and count over all gains."""
    c1 = SINGLE_POINT[0]
    turn = 2.0 * np.pi / SINGLE.tau
    found = crossing_near(SINGLE, *SINGLE_POINT, turn)
    omega, value = float(found.omega[0]), float(found.value[0])
    closed = -SINGLE.gain * np.sqrt(c1 * c1 - 1.0) / omega
    factor = -1.0 / value
    below, above = (
        nyquist(at_gain(SINGLE, factor * k), *SINGLE_POINT).closed_loop_roots
        for k in (1.0 - 1e-6, 1.0 + 1e-6)
    )
    fewest = fewest_roots(SINGLE, *SINGLE_POINT)
    return Finding(
        decide(abs(value / closed - 1.0) < 1e-9 and above == below + 2, fewest == 0),
        value,
        f"the open loop where its curve first crosses the negative real axis, at c₁ = {c1:g}",
        f"At ω = {omega:.5f} rad/s, {100.0 * (1.0 - omega / turn):.2f} % below 2π/τ; in "
        f"closed form -g√(c₁² - 1)/ω. At {factor:.3f} times the gain it reaches -1, and the "
        f"number of unstable roots goes from {below} to {above}. But no gain makes the loop "
        f"stable: at every one there is at least {fewest} unstable root, so this is no margin.",
    )


@claim(
    "N6",
    place="Sec. IV.A, on the common arm",
    says="The common arm behaves alike: its curve is tangent at the origin, the infinite "
    "branch makes it unstable, and a crossing of the negative real axis reduces the gain "
    "margin.",
    pinned=(Verdict.IN_PART, 9.87346e-4, 1e-8),
)
def common_arm_alike() -> Finding:
    """Measure how far the ideal curve misses the origin, and what the crossing needs."""
    near = 4.0 * np.pi / (TAU1 + TAU2)
    omega = np.linspace(0.99 * near, 1.01 * near, 200_001)
    miss = float(np.abs(COMMON.open_loop(1j * omega)).min())
    curve = nyquist(COMMON, *COMMON_POINT)
    threshold = common_threshold()
    below, above = (
        crossing_near(COMMON, 1.0, 1.0 + threshold * k, near).omega.size
        for k in (1.0 - 1e-6, 1.0 + 1e-6)
    )
    small = outermost_crossing(COMMON, 1.0, 1.0 + PERTURBATION, 100.0)
    fewest = fewest_roots(COMMON, *COMMON_POINT)
    alike = starts_as_the_single_arm(curve) and below == 0 < above
    return Finding(
        decide(alike, miss < 1e-9, threshold < PERTURBATION),
        threshold,
        "c₂ - 1 from which on the curve crosses the negative real axis near 2π over the mean "
        "delay",
        "The branch is as in the single arm. But the two delays never complete a turn "
        f"together: the ideal curve passes below the origin at a distance of {miss:.1e} (g = "
        f"{COMMON.gain:g} rad/s), and a smaller perturbation leaves it on that side. At (1, 1 "
        f"+ 10⁻⁶) the outermost crossing is at {small[0]:.2f} rad/s, where the open loop is "
        f"{small[1]:.2e}. At least {fewest} root is unstable at every gain.",
    )


@claim(
    "N7",
    place="Sec. IV.A, Fig. 7c",
    says="Without perturbations the dual arm stands precisely on the boundary of stability.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def dual_arm_ideal() -> Finding:
    """Count at (1, 1) and on both sides of it; find the root of 1 + L."""
    above, at, below = unstable_roots(DUAL, 1.0, 1.0 + PERTURBATION * np.array([1, 0, -1]))
    curve = nyquist(DUAL)
    root = rightmost_of_loop(DUAL, 1.0, 1.0)
    return Finding(
        decide((above, at, below) == (0, -1, 1) and curve.closed_loop_roots == 0),
        curve.closed_loop_roots,
        "zeros of 1 + L in the right half-plane at (1, 1), with the open loop L",
        f"{above} unstable roots at (1, 1 + 10⁻⁶), {below} at (1, 1 - 10⁻⁶), and between the "
        "two the characteristic function D has a root s = 0. It is one of the sensor's "
        f"integral, not of 1 + L, whose slowest root is at {root.real:.3g}/s.",
    )


@claim(
    "N8",
    place="Sec. IV.A, Fig. 7d",
    says="At (1, 0.995) the dual arm is unstable: its open loop is of order 1/s² near s = 0, "
    "and the infinite branch encircles the origin once, counter-clockwise, as ω passes zero.",
    pinned=(Verdict.NOT_AS_WRITTEN, -1.0, 1e-3),
    affects=("D4", "N11"),
    weight=Weight.DERIVATION,
)
def dual_arm_branch() -> Finding:
    """Follow the phase of L along the indentation, right and left of the pole."""
    c1, c2 = DUAL_POINT
    curve = nyquist(DUAL, c1, c2)
    turns = phase_of_branch(curve)[1] / (2.0 * np.pi)
    radius = float(np.abs(curve.indentation[0]))
    leading = DUAL.gain * (c2 - c1) / (TAU1 - TAU2)
    size = complex(DUAL.open_loop(radius, c1, c2)) * radius**2
    # The other way around the pole, with the two poles inside.
    around = radius * np.exp(1j * np.linspace(-0.5 * np.pi, -1.5 * np.pi, 401))
    value = DUAL.open_loop(around, c1, c2)
    other = float(np.angle(value[1:] / value[:-1]).sum()) / (2.0 * np.pi)
    inside = curve.closed_loop_roots - curve.pole_order
    unstable = curve.closed_loop_roots == 1
    of_order_two = curve.pole_order == 2 and abs(size / leading - 1.0) < 1e-2
    clockwise = abs(turns + 1.0) < 1e-3
    return Finding(
        decide(unstable, of_order_two, not clockwise, corrected=clockwise),
        turns,
        "turns of the infinite branch around the origin, counter-clockwise positive",
        f"Unstable, with a root at {rightmost_of_loop(DUAL, c1, c2).real:.4g}/s, and near s = "
        f"0 the open loop is {leading:.3g}/s². But the turn is clockwise when the contour "
        "passes s = 0 on the right, as for the single arm: N = 1, P = 0 and Z = N + P = 1. It "
        f"is counter-clockwise only for a contour on the left ({other:+.0f} turn), with the "
        f"double pole inside: P = {curve.pole_order}, N = {inside}.",
    )


@claim(
    "N9",
    place="Sec. IV.A, on the dual arm",
    says="The dual arm has only a finite gain margin, which shrinks as the perturbation grows.",
    pinned=(Verdict.IN_PART, 3134.6589, 1e-3),
)
def dual_arm_gain_margin() -> Finding:
    """Compute the margin on the stable side, and look for one at the paper's points."""
    factor = dual_gains()[:, 1]
    slow = SIZES < 3e-5
    exponent = float(np.polyfit(np.log(SIZES[slow]), np.log(factor[slow]), 1)[0])
    falls = bool(np.isfinite(factor).all() and (np.diff(factor) < 0.0).all())
    bounded = axis_crossings(DUAL).omega.size > 0
    lowered = gain_interval(DUAL, 1.0 - 1e-3, 1.0)[1]
    fewest = fewest_roots(DUAL, *DUAL_POINT)
    return Finding(
        decide(falls, bounded, np.isfinite(lowered), fewest == 0),
        float(factor[0]),
        f"gain factor up to which the dual arm stays stable at (1, 1 + {SIZES[0]:g}), g = "
        f"{DUAL.gain:g} rad/s",
        f"On the stable side it is so: {factor[-1]:.1f} at (1, 1 + {SIZES[-1]:g}), at first as "
        f"the perturbation to the power {exponent:.2f}. From (1, 1 + "
        f"{low_gain_threshold():.2g}) on there is a lower limit as well. At (1, 1) and (0.999, "
        "1) the Nyquist curve crosses the negative real axis nowhere, and the margin is "
        f"infinite. At the paper's (1, {DUAL_POINT[1]:g}) at least {fewest} root is unstable "
        "at every gain.",
    )


@claim(
    "N10",
    place="Sec. IV.A, end of the paragraph on the dual arm",
    says="Even small deviations of c₁ and c₂ can change the stability margins significantly.",
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
    return Finding(
        decide(count > 0, change > 0.05),
        100.0 * change,
        f"change of the modulus margin in % from (1, 1 + {sizes[0]:g}) to (1, 1 + "
        f"{sizes[-1]:g})",
        f"To the side c₁ > c₂, 10⁻⁶ is enough for {count} unstable root, which grows by a "
        f"factor e in {1.0 / rate / 86400.0:.1f} days. To the other side the upper gain margin "
        f"falls {gains:.0f}-fold, from thousands; the modulus margin stays at "
        f"{found[0].modulus:.2f}, the phase margin between {phases.min():.1f} and "
        f"{phases.max():.1f} degrees. They do not announce the boundary, which is crossed at s "
        "= 0.",
    )


@claim(
    "N11",
    place="Sec. IV.A, on the single and the common arm",
    says="It is the infinite branch at ω = 0 that causes the instability.",
    pinned=(Verdict.IN_PART, 4.0, 0.0),
)
def branch_decides() -> Finding:
    """Look for stable loops with an infinite branch, and at the side it is on."""
    curves = [nyquist(SINGLE, c1) for c1 in (1.001, 0.999, 0.5)]
    curves += [nyquist(COMMON, *c) for c in ((1.0, 1.001), (1.0, 0.999), (0.7, 0.8))]
    unstable = [curve.closed_loop_roots > 0 for curve in curves]
    leftward = [curve.indentation_response[0].real < 0.0 for curve in curves]
    stable = unstable.count(False)
    return Finding(
        decide(leftward == unstable, stable == 0),
        stable,
        f"stable ones among {len(curves)} perturbed single and common arms, all with an "
        "infinite branch",
        "Every perturbed loop with an integrator has an infinite branch. What decides is its "
        "side: through the left half-plane for c₁ > 1 (c₁ + c₂ > 2), around -1, and through "
        "the right half-plane otherwise, where it is harmless.",
    )
