"""Claims of Sec. IV.B, the controller, and the computations they share with the chapter."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
from scipy.optimize import brentq

from armlock.checks import ComplexArray, FloatArray
from armlock.controllers import Controller, stage_one, table_two, white_paper
from armlock.loops import DualArm, Loop, paper_loop
from armlock.paper import (
    CONTROLLER_GAIN,
    DUAL_SENSOR_CORNER,
    LASER_NOISE,
    PERTURBATION,
    TABLE_2_POLES,
    TABLE_2_STAGE_1_POLE,
    TAU1,
    TAU2,
)
from armlock.performance.pulling import largest_pulling
from armlock.robustness import box_count, critical_perturbation, margins
from armlock.stability.counts import unstable_roots
from armlock.stability.nyquist import AxisCrossings, axis_crossings, nyquist
from armlock.stability.roots import rightmost_root
from book.companion.claims.ledger import PRINTED, Finding, Verdict, Weight, claim
from book.companion.extremes import largest, smallest

TURN = 2.0 * np.pi

#: The three perturbations of the paper's Bode plot, as its text means them (claim K7).
POINTS = {
    "Area 2": (1.0, 1.0 - PERTURBATION),
    "A": (1.0, 1.0),
    "Area 1": (1.0, 1.0 + PERTURBATION),
}
#: The corner of the box of perturbations that comes nearest to instability.
WORST_CORNER = (1.0 + PERTURBATION, 1.0 - PERTURBATION)
#: Up to here in Hz the controller shapes the loop; the delays act from about 1/tau on.
LOW_FREQUENCY = 1e-3
#: The band in Hz in which the paper's Sec. IV.B wants |L| constant, and the science band.
FLAT_BAND = (1e-5, 1.0)
SCIENCE_BAND = (1e-3, 1.0)
#: The band in Hz of the paper's simulation.
SUPPRESSION_BAND = (1e-4, 1.0)

#: The readings of a claim on Stage I, which does not say for which perturbation it is meant.
READINGS = {
    "at $(1, 1 - 10⁻⁶)$": "Area 2",
    "at (1, 1)": "A",
    "at $(1, 1 + 10⁻⁶)$": "Area 1",
}

LOOP = paper_loop()
STAGE_ONE = paper_loop(controller=stage_one())
PRINTED_LOOP = paper_loop(controller=table_two(denominator="printed"))
INTEGRATING = paper_loop(actuator=True)


# Counts -------------------------------------------------------------------------------------


def counts_of(loop: Loop) -> dict[str, int]:
    """Return the counts of a loop at the paper's perturbations, by name."""
    return {point: int(unstable_roots(loop, *c)) for point, c in POINTS.items()}


# Charts and limits --------------------------------------------------------------------------


def nearest_in_box(frequency: FloatArray) -> FloatArray:
    """Return the smallest |1 + L| at frequencies in Hz over the whole box of perturbations.

    1 + L is affine in both perturbations, so over the box it fills a parallelogram. Where that
    does not hold zero (claim K5), its distance from zero is that of the nearest edge.
    """
    s = 1j * TURN * np.asarray(frequency)
    first, second = LOOP.arm_responses(s)
    arms = first * np.exp(-s * TAU1), second * np.exp(-s * TAU2)
    middle, least = 1.0 + LOOP(s), np.full(s.shape, np.inf)
    for (fixed, moved), side in product((arms, arms[::-1]), (PERTURBATION, -PERTURBATION)):
        edge = middle - side * fixed
        along = (edge * moved.conj()).real / np.abs(moved) ** 2
        along = np.clip(along, -PERTURBATION, PERTURBATION)
        least = np.minimum(least, np.abs(edge - along * moved))
    return least


@cache
def worst_in_box() -> float:
    """Return the smallest modulus margin over the box, refined over frequency.

    Above 20 Hz the controller is its gain and the sensor's E real and small, so that Re L is
    hardly below zero there.
    """
    return smallest(nearest_in_box, dense((1e-9, 20.0))).value


@cache
def stable_corners(difference: float | None = None) -> tuple[float, float]:
    """Return between which corner frequencies p in rad/s the loop is stable at (1, 1).

    With E = p / ((s + p) s dtau) the open loop is L = Q + R p / (s + p), so that a root is on
    the axis where p = -s (1 + Q) / (1 + Q + R) is real. The edges are those on either side of
    the assumed corner. They are refined from `dense` points.

    Parameters
    ----------
    difference : float, optional
        The sensor's dtau in s; tau1 - tau2 by default.
    """
    apart = TAU1 - TAU2 if difference is None else difference

    def corner(frequency: FloatArray | float) -> ComplexArray:
        s = 1j * TURN * np.asarray(frequency)
        first, second, gain = np.exp(-s * TAU1), np.exp(-s * TAU2), table_two()(s)
        common = 1.0 + gain * (2.0 - first - second)
        return np.asarray(-s * common / (common + gain * (second - first) / (s * apart)))

    points = dense((1e-9, 20.0))
    turned = corner(points).imag
    found = [
        corner(brentq(lambda f: float(corner(f).imag), *points[k : k + 2], xtol=1e-18))
        for k in np.flatnonzero(turned[:-1] * turned[1:] < 0.0)
    ]
    # A change of sign at a pole of p is none of an edge.
    edges = [float(p.real) for p in found if abs(p.imag) < 1e-6 * p.real]
    return (
        max(p for p in edges if p < DUAL_SENSOR_CORNER),
        min(p for p in edges if p > DUAL_SENSOR_CORNER),
    )


def highest_stable_corner(difference: float | None = None) -> float:
    """Return the upper of `stable_corners`."""
    return stable_corners(difference)[1]


# Responses ----------------------------------------------------------------------------------


def low_crossings(loop: Loop, point: str) -> AxisCrossings:
    """Crossings of the negative real axis below `LOW_FREQUENCY`, at one of `POINTS`."""
    return axis_crossings(loop, *POINTS[point], omega_max=TURN * LOW_FREQUENCY)


def response(frequency: FloatArray | float, c1: float = 1.0, c2: float = 1.0) -> ComplexArray:
    """Return L of the controlled loop at frequencies in Hz."""
    return LOOP(1j * TURN * frequency, c1, c2)


def dense(band: tuple[float, float]) -> FloatArray:
    """Frequencies in Hz, log-spaced at first, then many to a turn of the delays."""
    turn = 1.0 / TAU1
    low = np.geomspace(band[0], max(band[0], turn), 20_001)
    return np.concatenate((low, np.arange(turn, band[1], turn / 400.0), [band[1]]))


def gain_range(band: tuple[float, float]) -> tuple[float, float]:
    """Return the smallest and largest |L| in a band in Hz at c1 = c2 = 1."""

    def size(frequency: FloatArray) -> FloatArray:
        return np.asarray(np.abs(response(frequency)))

    return smallest(size, dense(band)).value, largest(size, dense(band)).value


def unity_gain(point: str) -> tuple[float, float]:
    """Return the unity-gain frequency in Hz below `LOW_FREQUENCY`, and the phase there.

    The phase in rad, between -pi and pi: that of the high-pass filters is a lead.
    """

    def level(log_frequency: float) -> float:
        return float(np.log(np.abs(response(np.exp(log_frequency), *POINTS[point]))))

    at = float(np.exp(brentq(level, np.log(1e-9), np.log(LOW_FREQUENCY))))
    return at, float(np.angle(response(at, *POINTS[point])))


def suppression(frequency: FloatArray) -> FloatArray:
    """Return |1 + L|, by which the loop divides the laser's noise, at c1 = c2 = 1."""
    return np.asarray(np.abs(1.0 + response(frequency)))


def noise_to_spare(frequency: FloatArray) -> FloatArray:
    """Return how many times the locked laser meets an assumed requirement, at c1 = c2 = 1.

    The requirement is the usual one on a pre-stabilised laser; frequencies in Hz.
    """
    required = 30.0 * np.sqrt(1.0 + (2.8e-3 / frequency) ** 4)
    return np.asarray(required * suppression(frequency) / (LASER_NOISE / frequency))


def relative_gain(frequency: float) -> complex:
    """Return the controller over its gain, at a frequency in Hz."""
    return complex(table_two()(1j * TURN * frequency)) / CONTROLLER_GAIN


# Claims -------------------------------------------------------------------------------------


@claim(
    "K1",
    place="Sec. IV.B, Stage I",
    says="Stage I removes the infinite branch; near zero $L = O(-s)$, still unstable.",
    pinned=(Verdict.ONE_READING, 2.0, 0.0),
    printed="the system remains unstable at this time. Near zero frequency, the open-loop "
    "system ... behaves approximated as $O(-s)$",
)
def stage_one_unstable() -> Finding:
    """Count at the three perturbations; follow L towards s = 0."""
    counts = counts_of(STAGE_ONE)
    order = max(nyquist(STAGE_ONE, *c).pole_order for c in POINTS.values())
    plain = paper_loop(controller=Controller((), (), CONTROLLER_GAIN))
    bare = nyquist(plain, *POINTS["Area 2"]).pole_order
    first, last = STAGE_ONE(np.array([1e-12, 1e-11]), *POINTS["Area 2"])
    slope = float(np.log10(abs(last / first)))
    days = 1.0 / rightmost_root(STAGE_ONE, *POINTS["Area 2"]).real / 86400.0
    linear = abs(slope - 1.0) < 0.01 and first.real < 0.0
    return Finding(
        {
            label: {
                "no infinite branch": bare > order == 0,
                "$O(-s)$": linear,
                "unstable": counts[point] > 0,
            }
            for label, point in READINGS.items()
        },
        counts["Area 2"],
        "unstable roots with Stage I alone at $(1, 1 - 10⁻⁶)$, without the actuator $1/s$",
        f"Stage I removes the pole of L of order {bare} at $s = 0$. At $(1, 1 - 10⁻⁶)$ L "
        f"behaves as $-s$ near zero, and the loop grows by a factor e in {days:.1f} days. The "
        "$O(-s)$ needs a loop without the actuator (claim K13).",
    )


@claim(
    "K2",
    place="Sec. IV.B, Stage I; Fig. 8(a)",
    says="The phase lead of Stage I makes the Nyquist curve encircle -1 clockwise.",
    pinned=(Verdict.ONE_READING, 2.0, 0.0),
)
def stage_one_encircles() -> Finding:
    """Count encirclements at the three perturbations."""
    turns = {point: nyquist(STAGE_ONE, *c).encirclements for point, c in POINTS.items()}
    crossing = low_crossings(STAGE_ONE, "Area 2")
    below = crossing.value < -1.0
    return Finding(
        {label: turns[point] > 0 for label, point in READINGS.items()},
        turns["Area 2"],
        "clockwise encirclements of -1 with Stage I alone at $(1, 1 - 10⁻⁶)$, both signs of ω",
        "The curve encircles -1 once for each sign of ω if $c₂ < c₁$. It crosses the negative "
        f"real axis at {crossing.value[below][0]:.4g}.",
    )


@claim(
    "K3",
    place="Sec. IV.B, Stage II; Fig. 8(b)",
    says="Stage II adds two crossings of the negative real axis; -1 is no longer enclosed.",
    pinned=(Verdict.REPRODUCED, 2.0, 0.0),
)
def stage_two_crossings() -> Finding:
    """Count the crossings before and after, and the encirclements."""
    before = {p: low_crossings(STAGE_ONE, p) for p in POINTS}
    after = {p: low_crossings(LOOP, p) for p in POINTS}
    added = {p: after[p].omega.size - before[p].omega.size for p in POINTS}
    turns = [nyquist(LOOP, *c).encirclements for c in POINTS.values()]
    here = after["Area 2"]
    places = ", ".join(
        f"{v:.3g} at {w / TURN * 1e6:.3g} µHz"
        for w, v in zip(here.omega, here.value, strict=True)
    )
    return Finding(
        {
            "": {
                "two more crossings": added["Area 2"] == added["Area 1"] == 2,
                "no encirclement": not any(turns),
            }
        },
        added["Area 2"],
        "crossings of the negative real axis added below 1 mHz, at $(1, 1 - 10⁻⁶)$",
        f"There are now {here.omega.size} crossings: {places}. The first lies to the right of "
        "-1. The other two lie to its left and have opposite directions.",
    )


@claim(
    "K4",
    place="Eq. (11) and Table II",
    says="The denominator has $s + z₂₄$ (the equation) or $s + p₂₄$ (the table).",
    pinned=(Verdict.NOT_AS_WRITTEN, 2.0, 0.0),
    affects=("K5", "K10"),
    weight=Weight.WORDING,
    printed=r"$\frac{(s+z_{21})(s+z_{22})(s+z_{23})(s+z_{24})}"
    r"{(s+p_{21})(s+p_{22})(s+p_{23})(s+z_{24})}$",
)
def which_denominator() -> Finding:
    """Run both."""
    table, printed = counts_of(LOOP), counts_of(PRINTED_LOOP)
    days = 1.0 / rightmost_root(PRINTED_LOOP, *POINTS["A"]).real / 86400.0
    return Finding(
        {PRINTED: printed["A"] == 0, "with $s + p₂₄$, as in Table II": not any(table.values())},
        printed["A"],
        "unstable roots at (1, 1) with the denominator that Eq. (11) prints",
        "As printed, $s + z₂₄$ cancels the last zero, and $p₂₄$ of Table II is not used. The "
        f"loop then grows by a factor e in {days:.0f} days. With $p₂₄$ it is stable at all "
        "three points of the paper's Bode plot.",
    )


@claim(
    "K5",
    place="Sec. IV.B, below Eq. (11)",
    also={"K12": "Abstract and Sec. V"},
    says="The controlled loop is stable for every perturbation within $±10⁻⁶$.",
    pinned=(Verdict.ONE_READING, 1.4643205e-6, 1e-12),
    printed=r"the designed controller $C(s)$ ensures system stability for perturbations within "
    r"$\pm 10^{-6}$",
)
def stable_over_the_box() -> Finding:
    """Try the corners in all eight readings; find and certify the largest stable square."""
    readings = {}
    for actuator, factor, part in product((False, True), ("table", "printed"), (1.0, 0.5)):
        loop = paper_loop(
            controller=table_two(denominator=factor),
            difference=part * (TAU1 - TAU2),
            actuator=actuator,
        )
        name = (
            f"{'with' if actuator else 'no'} actuator, "
            f"{'$s + p₂₄$' if factor == 'table' else '$s + z₂₄$'}, "
            f"{'whole' if part == 1.0 else 'half of'} Δτ"
        )
        corners = [unstable_roots(loop, *c) for c in (WORST_CORNER, WORST_CORNER[::-1])]
        readings[name] = not any(corners)
    limit = critical_perturbation(LOOP, (1.0, -1.0))
    # The corner along (1, -1) is the first to lose stability if all before it is stable.
    certified = box_count(LOOP, 0.99 * limit) == 0
    readings["no actuator, $s + p₂₄$, whole Δτ"] &= certified and limit > PERTURBATION
    half = critical_perturbation(paper_loop(difference=0.5 * (TAU1 - TAU2)), (1.0, -1.0))
    slowest, fastest = stable_corners()
    return Finding(
        readings,
        limit,
        "half-width of the largest square around (1, 1) in which the loop is stable, for "
        "constant $c₁$, $c₂$",
        f"With half of Δτ the limit would be {half:.3g}. The verdict stands for p from "
        f"{slowest:.1e} to {fastest:.2f} rad/s, and p is not printed. At the worst point of "
        f"the box the modulus margin is {worst_in_box():.3f}.",
    )


@claim(
    "K6",
    place="Sec. IV.B, below Eq. (11)",
    says="$|L|$ is virtually constant from 0.01 mHz to 1 Hz.",
    pinned=(Verdict.DIFFERS, 2740.66, 0.01),
    printed="the gain magnitude is virtually constant over the 0.01 mHz-1 Hz frequency range",
)
def constant_gain() -> Finding:
    """Compare |L| at the perturbations of the Bode plot, and over the band."""
    frequency, corners = dense(FLAT_BAND), [WORST_CORNER, WORST_CORNER[::-1]]

    def change(point: tuple[float, float]) -> float:
        def off(f: FloatArray) -> FloatArray:
            return np.asarray(np.abs(np.abs(response(f, *point) / response(f)) - 1.0))

        return largest(off, frequency).value

    shown = max(change(point) for point in POINTS.values())
    most = max(change(point) for point in corners)
    low, high = gain_range(FLAT_BAND)
    low_science, high_science = gain_range(SCIENCE_BAND)
    return Finding(
        {"": high < 2.0 * low},
        high / low,
        "largest $|L|$ over the smallest, from 0.01 mHz to 1 Hz at $c₁ = c₂ = 1$",
        f"Above 1 mHz $|L|$ still varies between {low_science:.0f} and {high_science:.0f}. The "
        f"perturbations of the Bode plot change $|L|$ by {100 * shown:.2f} % at most, and "
        f"those at the corners of the box by {100 * most:.1f} %; but the sentence speaks of "
        "the frequency.",
    )


@claim(
    "K7",
    place="Caption of Fig. 9",
    says="Points of Area 1 and of Area 2 are shown, with coordinates.",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.0, 0.0),
    weight=Weight.WORDING,
    printed="The red line represents the perturbed parameter $(c_1,c_2)=(1,1-10^{-6})$ in "
    "Area2 ... The green line represents the perturbed parameter $(c_1,c_2)=(1,1-10^{-6})$ "
    "in Area1",
)
def same_point_twice() -> Finding:
    """Count unstable roots of the uncontrolled dual arm on both sides of the ideal point."""
    area2, area1 = unstable_roots(DualArm(), 1.0, 1.0 + PERTURBATION * np.array([-1.0, 1.0]))
    distinct = area2 > 0 and area1 == 0
    return Finding(
        {PRINTED: not distinct, "with $(1, 1 + 10⁻⁶)$ in Area 1": distinct},
        float(area2),
        "unstable roots of the uncontrolled dual arm ($g = 10$) at $(1, 1 - 10⁻⁶)$",
        f"That point lies in the unstable Area 2. Its mirror image $(1, 1 + 10⁻⁶)$ has {area1} "
        "unstable roots and lies in Area 1.",
    )


@claim(
    "K8",
    place="Sec. IV.B, first paragraph",
    says="The controller acts primarily below 0.1 mHz and spares 1 mHz to 1 Hz.",
    pinned=(Verdict.IN_PART, 0.194727, 1e-6),
    printed="designed to act primarily below $10^{-4}$ Hz",
)
def acts_below() -> Finding:
    """Compare C(s) with its gain at 0.1 mHz and in the science band."""
    edge, science = relative_gain(1e-4), relative_gain(1e-3)
    return Finding(
        {
            "": {
                "little action at 0.1 mHz": abs(edge - 1.0) < 0.2,
                "none in the science band": abs(abs(science) - 1.0) < 0.1,
            }
        },
        abs(edge),
        "gain $|C|$ of the controller at 0.1 mHz, relative to its gain g at high frequency",
        f"At 0.1 mHz the controller still reduces the gain by {100 * (1 - abs(edge)):.0f} % "
        f"and turns the phase by {np.degrees(np.angle(edge)):.0f} degrees. At 1 mHz it reduces "
        f"the gain by {100 * (1 - abs(science)):.1f} %.",
    )


@claim(
    "K9",
    place="Sec. IV.B, Stage I; Table II",
    says="The poles of the high-pass filters (Stage I) lie below 0.1 mHz.",
    pinned=(Verdict.REPRODUCED, 1e-6, 1e-18),
    weight=Weight.WORDING,
)
def poles_below() -> Finding:
    """Read them off Table II."""
    stage1 = TABLE_2_STAGE_1_POLE / TURN
    highest = max(TABLE_2_POLES) / TURN
    return Finding(
        {"": stage1 < 1e-4},
        stage1,
        "frequency in Hz of the double pole of Stage I",
        f"One pole of Stage II, of which the sentence does not speak, is at "
        f"{1e3 * highest:.1g} mHz.",
    )


@claim(
    "K10",
    place="Sec. IV.B, Stage II",
    says=r"With Stage II the phase at the unity-gain frequency stays below $\pi$.",
    pinned=(Verdict.REPRODUCED, 0.869991, 1e-6),
)
def phase_at_unity_gain() -> Finding:
    """Find that frequency at each perturbation, and the phase lead there."""
    unity = [unity_gain(point) for point in POINTS]
    at, leads = np.array(unity).T
    left = np.degrees(margins(LOOP, *WORST_CORNER).phase)
    return Finding(
        {"": bool(leads.min() > 0.0 and leads.max() < np.pi)},
        float(leads.max()) / np.pi,
        r"largest phase lead at the unity-gain frequency, over $\pi$",
        f"For the perturbations of the Bode plot the frequency is {1e6 * at.min():.2f} to "
        f"{1e6 * at.max():.2f} µHz, and the phase margin is at least "
        f"{180 - np.degrees(leads.max()):.0f} degrees. At $(1 + 10⁻⁶, 1 - 10⁻⁶)$ the phase "
        f"margin is {left:.0f} degrees.",
    )


@claim(
    "K11",
    place="Sec. IV.B, first paragraph",
    says="A gain of $g = 5000$ meets the basic requirement on noise suppression.",
    pinned=(Verdict.OPEN, 973.24, 0.01),
    printed="set to 5000 to meet the basic noise suppression requirements",
)
def basic_requirement() -> Finding:
    """Compute |1 + L|, and hold the residual noise against an assumed requirement."""
    frequency = dense(SUPPRESSION_BAND)
    low, high = SUPPRESSION_BAND
    divided, spare = smallest(suppression, frequency), smallest(noise_to_spare, frequency)
    return Finding(
        {},
        divided.value,
        f"smallest noise suppression $|1 + L|$ from {1e3 * low:g} mHz to {high:g} Hz, at "
        "$c₁ = c₂ = 1$",
        r"A usual requirement on a pre-stabilised laser is $30\sqrt{1 + (2.8\ \mathrm{mHz}"
        r"/f)^4}$ Hz/√Hz. The paper's laser of $30/f$ Hz/√Hz, itself stabilised already, would "
        f"meet it {spare.value:.3g} times over when locked, least at {1e3 * spare.at:.2g} mHz.",
        missing="the requirement",
    )


@claim(
    "K13",
    place="Sec. IV.B, Eq. (11) with Sec. III.B",
    says="The controlled open loop is $C(s) P_d(s)$, with $P_d$ of Sec. III.B.",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.0, 0.0),
    affects=("K1", "K5", "K10", "M1"),
    printed=r"the dual arm-locking systems $C(s)P_d(s)$, and in Sec. III.B "
    r"$P_d(jω) =$ $\frac{g}{jω}(2 - c_1 e^{-τ_1jω} - c_2 e^{-τ_2jω})$ $+ \dots$",
)
def which_open_loop() -> Finding:
    """Put the actuator's 1/s of Sec. III into the loop, and leave it out."""
    half = counts_of(paper_loop(difference=0.5 * (TAU1 - TAU2)))
    bare, integrating = [*counts_of(LOOP).values(), *half.values()], counts_of(INTEGRATING)
    root = rightmost_root(INTEGRATING, *POINTS["Area 2"])
    return Finding(
        {
            PRINTED: not any(integrating.values()),
            "with the dual sensor of Table I alone": not any(bare),
        },
        integrating["Area 2"],
        "unstable roots at $(1, 1 - 10⁻⁶)$ with $P_d$ as in Sec. III.B",
        "In Sec. III.B $P_d$ contains the integrating actuator and the gain, $g/s$. With them "
        f"the loop grows by a factor e in {1.0 / root.real / 86400.0:.2g} days. Without them "
        "it is stable at all three points of the Bode plot, with either meaning of Δτ.",
    )


@claim(
    "K15",
    place="Caption of Fig. 8",
    says="With and without Stage I the Nyquist curve is the same at high frequency.",
    pinned=(Verdict.REPRODUCED, 2.0000e-4, 1e-7),
    weight=Weight.DERIVATION,
)
def overlap() -> Finding:
    """Find the frequency from which on the high-pass filters are 1 within a per cent."""

    def off(log_frequency: float) -> float:
        filters = stage_one()(1j * TURN * np.exp(log_frequency)) / CONTROLLER_GAIN
        return float(np.abs(filters - 1.0)) - 0.01

    start = float(np.exp(brentq(off, np.log(1e-6), np.log(1.0))))
    return Finding(
        {"": start < SCIENCE_BAND[0]},
        start,
        "frequency in Hz from which on the two curves agree within 1 %",
        "The filters deviate from 1 by twice their pole over $jω$, for every sensor and "
        "perturbation. The caption calls the filter $G_H$, the text and Eq. (11) $G_L$.",
    )


@claim(
    "K16",
    place="Sec. V",
    says="The controller is similar in form to those that suppress Doppler pulling.",
    pinned=(Verdict.REPRODUCED, 2.0, 0.0),
    weight=Weight.DERIVATION,
)
def like_anti_pulling() -> Finding:
    """Compare the high-pass filters with those of the white paper, and pull the loop."""
    here, there = stage_one(), white_paper(1.0)
    zeros = [sum(abs(z) == 0.0 for z in one.zeros) for one in (here, there)]
    slowest = [min(abs(p) for p in one.poles) for one in (here, there)]
    ratio = float(slowest[0] / slowest[1])
    peak = largest_pulling(LOOP, differential=(1.0, 0.0, 0.0))
    return Finding(
        {"": {"zeros at $s = 0$": min(zeros) >= 2, "poles": 0.5 < ratio < 2.0}},
        float(zeros[0]),
        f"zeros of Stage I at $s = 0$, where the white paper's controller has {zeros[1]}",
        f"The pole of Stage I is {ratio:.3g} times the lowest pole of the white paper's "
        "controller. The form is similar and the effect is not, because the paper's sensor "
        f"integrates the difference of the arms: an error of 1 Hz in it pulls the laser by "
        f"{peak.size:.2g} Hz within {peak.time / 86400.0:.1f} days.",
    )
