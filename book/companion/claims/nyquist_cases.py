"""Claims of Sec. IV.A, the Nyquist plots: N1 to N11."""

from __future__ import annotations

from functools import cache, partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import bisect, minimize_scalar

from armlock.loops import CommonArm, DualArm, Loop, SingleArm
from armlock.paper import (
    DUAL_SENSOR_CORNER,
    DURATION,
    PERTURBATION,
    PHASE_NOISE_LEVEL,
    SAMPLE_RATE,
    TAU1,
    TAU2,
)
from armlock.robustness.gains import gain_interval
from armlock.robustness.margins import Margins, margins
from armlock.stability.counts import BOUNDARY, unstable_roots
from armlock.stability.nyquist import AxisCrossings, NyquistCurve, axis_crossings, nyquist
from armlock.stability.roots import rightmost_root
from armlock.timedomain.noise import band_rms
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
#: Sizes at which all its margins are compared: up to that of the paper's example.
SMALL = (PERTURBATION, 1e-5, 1e-4, 5e-3)


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


@cache
def small_margins() -> list[Margins]:
    """Return the dual arm's margins at (1, 1 + size), its stable side, for each of `SMALL`."""
    return [margins(DUAL, 1.0, 1.0 + size) for size in SMALL]


def modulus_change() -> float:
    """Return the largest relative change of the modulus margin over `SMALL`."""
    first, *others = (found.modulus for found in small_margins())
    return max(abs(other / first - 1.0) for other in others)


def low_gain_threshold() -> float:
    """Smallest c2 - 1 from which on the dual arm also has a lower gain margin, at c1 = 1.

    At low gain 1 + L has the roots of s^2 + g (a s + b) with the first terms b / s^2 + a / s
    of the loop per gain; they are stable as long as a is positive.
    """
    spread = TAU1 - TAU2
    return 1.0 / (1.0 + TAU2 / spread + 1.0 / (DUAL_SENSOR_CORNER * spread))


@claim(
    "N1",
    place="Sec. IV.A, first paragraph",
    says="The perturbations are no larger than $10⁻⁶$, by the reasons of the appendix.",
    pinned=(Verdict.DIFFERS, 0.0145793, 1e-6),
    affects=("K5", "M2"),
    printed="their magnitude is limited to $10⁻⁶$, with the rationale for this choice ... in "
    "the Appendix",
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
        f"That is {rms / PERTURBATION:.0f} times $10⁻⁶$; even where the spectrum is flat, a "
        f'band of {1e3 * flat:.1f} mHz is enough for $10⁻⁶$. The appendix ends with an η "one '
        'or several orders of magnitude smaller": '
        f"{np.log10(rms / PERTURBATION):.1f} orders would do, but it does not say how many, "
        "and takes the spectrum unreduced. So $10⁻⁶$ is an assumption.",
    )


@claim(
    "N2",
    place="Sec. IV.A, Fig. 7a",
    says="At $c₁ = 1$ the single arm's curve is tangent at the origin, with no gain limit.",
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
        r"At every multiple of $2\pi/τ$ the curve passes through the origin, along the real "
        f"axis. $1 + L$ has no unstable root at any gain from {FACTORS[0]:g} to "
        f"{FACTORS[-1]:g} rad/s.",
    )


@claim(
    "N3",
    place="Sec. IV.A, Fig. 7b",
    says="For $c₁$ above 1 an infinite branch at $ω = 0$ goes around the left half-plane.",
    pinned=(Verdict.REPRODUCED, -1.0, 1e-3),
    weight=Weight.DERIVATION,
)
def single_arm_branch() -> Finding:
    """Follow the phase of L along the indentation."""
    curve = nyquist(SINGLE, *SINGLE_POINT)
    start, change = phase_of_branch(curve)
    return Finding(
        decide(starts_as_the_single_arm(curve)),
        change / np.pi,
        r"change of the phase from $ω = 0^-$ to $0^+$, in units of $\pi$",
        rf"From ${start / np.pi:.2f} \pi$ clockwise to ${(start + change) / np.pi:.2f} \pi$, "
        r"the direction of $+\pi/2$, if the contour passes the pole at $s = 0$ on its right: "
        f"{curve.encirclements} encirclement of -1.",
    )


@claim(
    "N4",
    place="Sec. IV.A, after Fig. 7b",
    says=r"For $c₁ > 1$ the open loop at $ω = 2\pi/τ$ is $1 - c₁$, a negative number.",
    pinned=(Verdict.NOT_AS_WRITTEN, 0.5, 1e-9),
    affects=("N5", "N6"),
    weight=Weight.WORDING,
    printed=r"$P_s(2\pi/τ) = 1 - c_1 < 0$",
)
def value_at_full_turn() -> Finding:
    """Evaluate the loop with and without the integrating actuator at 2 pi / tau."""
    s, c1 = 2j * np.pi / SINGLE.tau, SINGLE_POINT[0]
    value = complex(SINGLE.open_loop(s, c1))
    without = value * s / SINGLE.gain
    return Finding(
        decide(abs(value - (1.0 - c1)) < 1e-9, corrected=abs(without - (1.0 - c1)) < 1e-9),
        float(np.angle(value)) / np.pi,
        r"phase of the open loop at $2\pi/τ$, in units of $\pi$",
        f"With the factor $g/s$ that the paper's $P_s$ has, the open loop is {value.imag:.3g}j "
        f"at $c₁ = {c1:g}$, on the positive imaginary axis. $1 - c₁$ is the value of "
        "$1 - c₁ e^{-jωτ}$ alone.",
    )


@claim(
    "N5",
    place="Sec. IV.A, after Fig. 7b",
    says="For $c₁ > 1$ the curve crosses the negative real axis: the gain margin is finite.",
    pinned=(Verdict.IN_PART, -0.1441254, 1e-6),
    printed="the gain margin is no longer infinite and becomes dependent on the magnitude of "
    "the perturbation",
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
        f"the open loop where its curve first crosses the negative real axis, at $c₁ = {c1:g}$",
        rf"At $ω = {omega:.5f}$ rad/s, in closed form $-g\sqrt{{c_1^2 - 1}}/ω$; at "
        f"{factor:.3f} times the gain the number of unstable roots goes from {below} to "
        f"{above}. But at every gain there is at least {fewest} unstable root, so this is no "
        "margin of a stable loop.",
    )


@claim(
    "N6",
    place="Sec. IV.A, on the common arm",
    says="The common arm is alike: tangent, unstable by its branch, with a crossing.",
    pinned=(Verdict.IN_PART, 9.87346e-4, 1e-8),
    printed="the Nyquist curve is also tangent to the origin",
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
    alike = starts_as_the_single_arm(curve) and below == 0 < above
    return Finding(
        decide(alike, miss < 1e-9, threshold < PERTURBATION),
        threshold,
        r"$c₂ - 1$ from which on the curve crosses the negative real axis near $2\pi$ over the "
        "mean delay",
        "The branch is as in the single arm. But the two delays never complete a turn "
        f"together: the ideal curve passes below the origin at a distance of {miss:.1e}, and a "
        f"perturbation of {PERTURBATION:g} leaves it on that side.",
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
        "zeros of $1 + L$ in the right half-plane at (1, 1), with the open loop L",
        f"{above} unstable roots at $(1, 1 + 10⁻⁶)$, {below} at $(1, 1 - 10⁻⁶)$. The root "
        "$s = 0$ between the two is one of the sensor's integral, not of $1 + L$, whose "
        f"slowest root is at {root.real:.3g}/s.",
    )


@claim(
    "N8",
    place="Sec. IV.A, Fig. 7d",
    says="At (1, 0.995) the dual arm is unstable; its branch turns counter-clockwise.",
    pinned=(Verdict.NOT_AS_WRITTEN, -1.0, 1e-3),
    weight=Weight.DERIVATION,
    printed="$P_d(s) ∼ O(1/s^2)$ ... an infinite branch that encircles the origin once in the "
    "counterclockwise direction",
)
def dual_arm_branch() -> Finding:
    """Follow the phase of L along the indentation, on the right of the pole."""
    c1, c2 = DUAL_POINT
    curve = nyquist(DUAL, c1, c2)
    turns = phase_of_branch(curve)[1] / (2.0 * np.pi)
    radius = float(np.abs(curve.indentation[0]))
    leading = DUAL.gain * (c2 - c1) / (TAU1 - TAU2)
    size = complex(DUAL.open_loop(radius, c1, c2)) * radius**2
    growth = rightmost_of_loop(DUAL, c1, c2).real
    of_order_two = curve.pole_order == 2 and abs(size / leading - 1.0) < 1e-2
    clockwise = abs(turns + 1.0) < 1e-3
    return Finding(
        decide(curve.closed_loop_roots == 1, of_order_two, not clockwise, corrected=clockwise),
        turns,
        "turns of the infinite branch around the origin, counter-clockwise positive",
        f"Unstable, growing by a factor e in {1.0 / growth:.0f} s, and near $s = 0$ the open "
        f"loop is ${leading:.3g}/s^2$. But the turn is clockwise when the contour passes "
        "$s = 0$ on the right, as the paper has it for the single arm. It is counter-clockwise "
        "for a contour on the left, with the double pole inside.",
    )


@claim(
    "N9",
    place="Sec. IV.A, on the dual arm",
    says="The dual arm has only a finite gain margin, which shrinks with the perturbation.",
    pinned=(Verdict.IN_PART, 3134.6589, 1e-3),
    printed="only a finite gain margin, which decreases with increasing perturbation amplitude",
)
def dual_arm_gain_margin() -> Finding:
    """Compute the margin on the stable side, and look for one at the paper's points."""
    factor = np.array([gain_interval(DUAL, 1.0, 1.0 + float(e))[1] for e in SIZES])
    falls = bool(np.isfinite(factor).all() and (np.diff(factor) < 0.0).all())
    bounded = axis_crossings(DUAL).omega.size > 0
    fewest = fewest_roots(DUAL, *DUAL_POINT)
    return Finding(
        decide(falls, bounded, fewest == 0),
        float(factor[0]),
        f"gain factor up to which the dual arm stays stable at (1, 1 + {SIZES[0]:g}), $g = "
        f"{DUAL.gain:g}$ rad/s",
        f"On the stable side it is so, down to {factor[-1]:.1f} at (1, 1 + {SIZES[-1]:g}). At "
        "(1, 1) the curve crosses the negative real axis nowhere, and the margin is infinite. "
        f"At the paper's (1, {DUAL_POINT[1]:g}) at least {fewest} root is unstable at every "
        "gain.",
    )


@claim(
    "N10",
    place="Sec. IV.A, end of the paragraph on the dual arm",
    says="Even small deviations of $c₁$ and $c₂$ can change the stability margins much.",
    pinned=(Verdict.REPRODUCED, 139.6103, 1e-3),
    printed="even small deviations ... may significantly alter the stability margins",
)
def margins_near_ideal() -> Finding:
    """Compare gain, modulus and phase margin on the stable side, near (1, 1) and far."""
    found = small_margins()
    phases = np.degrees([result.phase for result in found])
    rate = rightmost_of_loop(DUAL, 1.0, 1.0 - PERTURBATION).real
    fall = found[0].gain_upper / found[-1].gain_upper
    return Finding(
        decide(rate > 0.0 and fall > 10.0),
        fall,
        f"factor by which the gain margin falls from (1, 1 + {SMALL[0]:g}) to (1, 1 + "
        f"{SMALL[-1]:g})",
        "The gain margin is the one that the paragraph speaks of; to the other side $10⁻⁶$ is "
        "enough for an unstable root, which grows by a factor e in "
        f"{1.0 / rate / 86400.0:.1f} days. The two other margins hardly change: the modulus "
        f"margin is {found[0].modulus:.2f} within {100.0 * modulus_change():.1f} %, and the "
        f"phase margin between {phases.min():.1f} and {phases.max():.1f} degrees.",
    )


@claim(
    "N11",
    place="Sec. IV.A, on the single and the common arm",
    says="It is the infinite branch at $ω = 0$ that causes the instability.",
    pinned=(Verdict.WHERE_USED, 4.0, 0.0),
)
def branch_decides() -> Finding:
    """Look for stable loops with an infinite branch, and at the side it is on."""
    curves = [nyquist(SINGLE, c1) for c1 in (1.001, 0.999, 0.5)]
    curves += [nyquist(COMMON, *c) for c in ((1.0, 1.001), (1.0, 0.999), (0.7, 0.8))]
    unstable = [curve.closed_loop_roots > 0 for curve in curves]
    leftward = [curve.indentation_response[0].real < 0.0 for curve in curves]
    stable = unstable.count(False)
    return Finding(
        decide(leftward == unstable, beyond=stable == 0),
        stable,
        f"stable ones among {len(curves)} perturbed single and common arms, all with an "
        "infinite branch",
        "True for $c₁ > 1$ ($c₁ + c₂ > 2$), the case of the paper, where the branch goes "
        "around -1 through the left half-plane. Otherwise it goes through the right "
        "half-plane, where it is harmless.",
    )
