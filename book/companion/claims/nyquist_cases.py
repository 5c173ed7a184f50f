"""Claims of Sec. IV.A, the Nyquist plots; its N7 is a place of claim Z1."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.optimize import minimize_scalar

from armlock.controllers import integrating_actuator
from armlock.engine.margins import Margins
from armlock.loops import CommonArm, DualArm, Loop, SingleArm
from armlock.paper import (
    DURATION,
    PERTURBATION,
    PHASE_NOISE_LEVEL,
    SAMPLE_RATE,
    TAU1,
    TAU2,
)
from armlock.robustness.margins import margins
from armlock.stability.nyquist import AxisCrossings, NyquistCurve, axis_crossings, nyquist
from armlock.stability.roots import rightmost_root
from armlock.timedomain.noise import PerturbationNoise
from book.companion.claims.ledger import PRINTED, Finding, Verdict, Weight, claim
from book.companion.extremes import smallest

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


def at_gain(loop: Loop, factor: float) -> Loop:
    """Return one of the section's loops with its gain times a factor."""
    return loop.replace(controller=integrating_actuator(factor * loop.controller.gain))


def fewest_roots(loop: Loop, c1: float, c2: float) -> int:
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


@claim(
    "N1",
    place="Sec. IV.A, first paragraph",
    also={"A3": "Appendix, Eq. (A5)"},
    says="The perturbations are no larger than $10⁻⁶$, by the reasons of the appendix.",
    pinned=(Verdict.OPEN, 22375.1, 0.1),
    printed="their magnitude is limited to $10⁻⁶$, with the rationale for this choice ... in "
    "the Appendix",
)
def size_of_perturbations() -> Finding:
    """Integrate the appendix's spectrum over the simulated band."""
    low = 1.0 / DURATION
    rms = PerturbationNoise(0, SAMPLE_RATE, cutoff=low).rms
    flat = (PERTURBATION / PHASE_NOISE_LEVEL) ** 2
    return Finding(
        {
            "the spectrum as printed": rms <= PERTURBATION,
            "four orders and more below it": 1e-4 * rms <= 3.0 * PERTURBATION,
        },
        rms / PERTURBATION,
        "r.m.s. of what is drawn from the spectrum of Eq. (A5), in units of $10⁻⁶$",
        'The appendix says that η has to be "one or several orders of magnitude smaller" than '
        f"this spectrum, and names no number. As printed the r.m.s. is {rms:.4f}, if the "
        f"spectrum is flat below {low:g} Hz, one over the duration. Even where it is flat, a "
        f"band of {1e3 * flat:.1f} mHz has an r.m.s. of $10⁻⁶$.",
        missing="the factor before the spectrum, and where the spectrum ends",
    )


@claim(
    "N2",
    place="Sec. IV.A, Fig. 7a",
    says="At $c₁ = 1$ the single arm's curve is tangent at the origin, with no gain limit.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def single_arm_ideal() -> Finding:
    """Look at the curve around 2 pi / tau, for crossings, and at counts over all gains."""
    turn = 2.0 * np.pi / SINGLE.tau1
    before, at, after = SINGLE(1j * turn * np.array([1.0 - 1e-5, 1.0, 1.0 + 1e-5]))
    tangent = abs(at) < 1e-9 and abs(np.angle(after - before)) < 1e-4
    crossings = axis_crossings(SINGLE).omega.size
    highest = max(nyquist(at_gain(SINGLE, k)).closed_loop_roots for k in FACTORS)
    return Finding(
        {"": {"tangent": tangent, "infinite gain margin": crossings == 0 and highest == 0}},
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
        {"": starts_as_the_single_arm(curve)},
        change / np.pi,
        r"change of the phase from $ω = 0^-$ to $0^+$, in units of $\pi$",
        rf"The phase turns clockwise from ${start / np.pi:.2f} \pi$ to "
        rf"${(start + change) / np.pi:.2f} \pi$, the direction of $+\pi/2$. By the paper's "
        "words the contour passes the pole at $s = 0$ on its right, with "
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
    s, c1 = 2j * np.pi / SINGLE.tau1, SINGLE_POINT[0]
    value = complex(SINGLE(s, c1))
    without = value * s / SINGLE.controller.gain
    return Finding(
        {
            PRINTED: abs(value - (1.0 - c1)) < 1e-9,
            "without the factor $g/s$": abs(without - (1.0 - c1)) < 1e-9,
        },
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
    turn = 2.0 * np.pi / SINGLE.tau1
    found = crossing_near(SINGLE, *SINGLE_POINT, turn)
    omega, value = float(found.omega[0]), float(found.value[0])
    closed = -SINGLE.controller.gain * np.sqrt(c1 * c1 - 1.0) / omega
    factor = -1.0 / value
    below, above = (
        nyquist(at_gain(SINGLE, factor * k), *SINGLE_POINT).closed_loop_roots
        for k in (1.0 - 1e-6, 1.0 + 1e-6)
    )
    fewest = fewest_roots(SINGLE, *SINGLE_POINT)
    return Finding(
        {
            "": {
                "a crossing of the negative real axis": abs(value / closed - 1.0) < 1e-9
                and above == below + 2,
                "a gain margin, with stable gains below it": fewest == 0,
            }
        },
        value,
        f"the open loop where its curve first crosses the negative real axis, at $c₁ = {c1:g}$",
        rf"At $ω = {omega:.5f}$ rad/s, in closed form $-g\sqrt{{c_1^2 - 1}}/ω$; at "
        f"{factor:.3f} times the gain the number of unstable roots goes from {below} to "
        f"{above}. At every gain at least {fewest} root is unstable, so that no stable loop "
        "has this margin.",
    )


@claim(
    "N6",
    place="Sec. IV.A, on the common arm",
    says="The common arm behaves alike: its curve is tangent to the origin, an infinite branch "
    "makes it unstable, and the curve crosses the negative real axis.",
    pinned=(Verdict.IN_PART, 9.87346e-4, 1e-8),
    printed="the Nyquist curve is also tangent to the origin",
)
def common_arm_alike() -> Finding:
    """Measure how far the ideal curve misses the origin, and what the crossing needs."""
    near = 4.0 * np.pi / (TAU1 + TAU2)
    around = np.linspace(0.99 * near, 1.01 * near, 201)
    miss = smallest(lambda omega: np.abs(COMMON(1j * omega)), around).value
    curve = nyquist(COMMON, *COMMON_POINT)
    threshold = common_threshold()
    below, above = (
        crossing_near(COMMON, 1.0, 1.0 + threshold * k, near).omega.size
        for k in (1.0 - 1e-6, 1.0 + 1e-6)
    )
    return Finding(
        {
            "": {
                "unstable by its branch": starts_as_the_single_arm(curve),
                "tangent to the origin": miss < 1e-9,
                "a crossing at (1, 1.001)": below == 0 < above and threshold < 1e-3,
            }
        },
        threshold,
        r"smallest $c₂ - 1$ at which the curve crosses the negative real axis near $2\pi$ over "
        "the mean delay",
        "Below 10 Hz the round trips are never both whole numbers of periods. The ideal curve "
        f"passes the origin at a distance of {miss:.1e}, and a perturbation of "
        f"{PERTURBATION:g} does not move it across the negative real axis.",
    )


@claim(
    "N8",
    place="Sec. IV.A, Fig. 7d",
    says="At (1, 0.995) the dual arm is unstable; its branch turns counter-clockwise.",
    pinned=(Verdict.IN_PART, -1.0, 1e-3),
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
    leading = DUAL.controller.gain * (c2 - c1) / (TAU1 - TAU2)
    size = complex(DUAL(radius, c1, c2)) * radius**2
    growth = rightmost_root(DUAL, c1, c2).real
    of_order_two = curve.pole_order == 2 and abs(size / leading - 1.0) < 1e-2
    clockwise = abs(turns + 1.0) < 1e-3
    return Finding(
        {
            "": {
                "unstable": curve.closed_loop_roots == 1,
                "$O(1/s^2)$": of_order_two,
                "counter-clockwise": not clockwise,
            }
        },
        turns,
        "turns of the infinite branch around the origin, counter-clockwise positive",
        f"The loop grows by a factor e in {1.0 / growth:.0f} s, and near $s = 0$ the open loop "
        f"is ${leading:.3g}/s^2$. The turn is clockwise for a contour that passes $s = 0$ on "
        "its right, as in the paper's words on the single arm (claim N3). It is "
        "counter-clockwise for a contour around the left half-plane.",
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
    factor = np.array([margins(DUAL, 1.0, 1.0 + float(e)).gain_upper for e in SIZES])
    falls = bool(np.isfinite(factor).all() and (np.diff(factor) < 0.0).all())
    bounded = axis_crossings(DUAL).omega.size > 0
    fewest = fewest_roots(DUAL, *DUAL_POINT)
    return Finding(
        {
            "": {
                "falling with the perturbation, on the stable side": falls,
                "finite at (1, 1)": bounded,
                "a margin at (1, 0.995)": fewest == 0,
            }
        },
        float(factor[0]),
        f"gain factor up to which the dual arm stays stable at (1, 1 + {SIZES[0]:g}), $g = "
        f"{DUAL.controller.gain:g}$ rad/s",
        f"On the stable side the margin falls to {factor[-1]:.1f} at (1, 1 + {SIZES[-1]:g}). "
        "At (1, 1) the curve does not cross the negative real axis. At the paper's (1, "
        f"{DUAL_POINT[1]:g}) at least {fewest} root is unstable at every gain.",
    )


@claim(
    "N10",
    place="Sec. IV.A, end of the paragraph on the dual arm",
    says="Even small deviations of $c₁$ and $c₂$ can change the margins strongly.",
    pinned=(Verdict.ONE_READING, 139.6103, 1e-3),
    printed="even small deviations ... may significantly alter the stability margins",
)
def margins_near_ideal() -> Finding:
    """Compare gain, modulus and phase margin on the stable side, near (1, 1) and far."""
    found = small_margins()
    phases = np.degrees([result.phase for result in found])
    rate = rightmost_root(DUAL, 1.0, 1.0 - PERTURBATION).real
    fall = found[0].gain_upper / found[-1].gain_upper
    return Finding(
        {
            "the gain margin, of which the paragraph speaks": rate > 0.0 and fall > 10.0,
            "the modulus margin and the phase margin": modulus_change() > 0.1
            or bool(np.ptp(phases) > 10.0),
        },
        fall,
        f"factor by which the gain margin falls from (1, 1 + {SMALL[0]:g}) to (1, 1 + "
        f"{SMALL[-1]:g})",
        f"The modulus margin is {found[0].modulus:.2f} within {100.0 * modulus_change():.1f} "
        f"%, and the phase margin is between {phases.min():.1f} and {phases.max():.1f} "
        f"degrees. At $(1, 1 - 10⁻⁶)$ a root is unstable and grows by a factor e in "
        f"{1.0 / rate / 86400.0:.1f} days.",
    )


@claim(
    "N11",
    place="Sec. IV.A, on the single and the common arm",
    says="It is the infinite branch at $ω = 0$ that causes the instability.",
    pinned=(Verdict.ONE_READING, 4.0, 0.0),
)
def branch_decides() -> Finding:
    """Look for stable loops with an infinite branch, and at the side it is on."""
    curves = [nyquist(SINGLE, c1) for c1 in (1.001, 0.999, 0.5)]
    curves += [nyquist(COMMON, *c) for c in ((1.0, 1.001), (1.0, 0.999), (0.7, 0.8))]
    unstable = [curve.closed_loop_roots > 0 for curve in curves]
    leftward = [curve.indentation_response[0].real < 0.0 for curve in curves]
    stable = unstable.count(False)
    return Finding(
        {
            "$c₁ > 1$, or $c₁ + c₂ > 2$, as in the paper": leftward == unstable,
            "every perturbation": stable == 0,
        },
        stable,
        f"stable ones among {len(curves)} perturbed single and common arms, all with an "
        "infinite branch",
        "In the case of the paper the branch goes around -1 through the left half-plane. "
        "Otherwise it goes through the right half-plane and does not encircle -1.",
    )
