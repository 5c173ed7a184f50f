"""Claims of Sec. IV.B, the controller, and the computations they share with the chapter."""

from __future__ import annotations

from functools import cache, partial

import numpy as np
from scipy.optimize import bisect, brentq

from armlock.checks import ComplexArray, FloatArray
from armlock.controllers import Controller, stage_one, table_two
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
from armlock.robustness.margins import critical_perturbation, margins, modulus_margin
from armlock.stability.counts import stability_chart, unstable_roots
from armlock.stability.nyquist import AxisCrossings, axis_crossings, nyquist
from armlock.stability.roots import rightmost_root
from book.companion.claims import ledger
from book.companion.claims.ledger import Finding, Verdict, Weight, decide

claim = partial(ledger.claim, chapter="06_controller")
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

LOOP = paper_loop()
STAGE_ONE = paper_loop(controller=stage_one())
PRINTED = paper_loop(controller=table_two(denominator="printed"))
INTEGRATING = paper_loop(actuator=True)


# Counts -------------------------------------------------------------------------------------


def counts_of(loop: Loop) -> dict[str, int]:
    """Return the counts of a loop at the paper's perturbations, by name."""
    return {point: int(unstable_roots(loop, *c)) for point, c in POINTS.items()}


# Charts and limits --------------------------------------------------------------------------


@cache
def worst_in_box(points: int = 5) -> tuple[float, float, float]:
    """Return c1, c2 and the modulus margin where it is smallest, over a grid of the box."""
    axis = 1.0 + PERTURBATION * np.linspace(-1.0, 1.0, points)
    found = [(modulus_margin(LOOP, x, y), float(x), float(y)) for x in axis for y in axis]
    margin, c1, c2 = min(found)
    return c1, c2, margin


@cache
def highest_stable_corner(difference: float | None = None) -> float:
    """Highest corner frequency p in rad/s up to which the loop is stable at (1, 1).

    Parameters
    ----------
    difference : float, optional
        The sensor's dtau in s; tau1 - tau2 by default.
    """

    def unstable(corner: float) -> float:
        return int(unstable_roots(paper_loop(corner, difference=difference), 1.0, 1.0)) - 0.5

    low, high = DUAL_SENSOR_CORNER, 100.0 * DUAL_SENSOR_CORNER
    return float(bisect(unstable, low, high, xtol=1e-6))


# Responses ----------------------------------------------------------------------------------


def low_crossings(loop: Loop, point: str) -> AxisCrossings:
    """Crossings of the negative real axis below `LOW_FREQUENCY`, at one of `POINTS`."""
    return axis_crossings(loop, *POINTS[point], omega_max=TURN * LOW_FREQUENCY)


def response(frequency: FloatArray | float, c1: float = 1.0, c2: float = 1.0) -> ComplexArray:
    """Return L of the controlled loop at frequencies in Hz."""
    return LOOP.open_loop(1j * TURN * frequency, c1, c2)


def dense(band: tuple[float, float]) -> FloatArray:
    """Frequencies in Hz, log-spaced at first, then many to a turn of the delays."""
    turn = 1.0 / TAU1
    low = np.geomspace(band[0], max(band[0], turn), 20_001)
    return np.concatenate((low, np.arange(turn, band[1], turn / 400.0), [band[1]]))


def gain_range(band: tuple[float, float]) -> tuple[float, float]:
    """Return the smallest and largest |L| in a band in Hz at c1 = c2 = 1."""
    size = np.abs(response(dense(band)))
    return float(size.min()), float(size.max())


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
    pinned=(Verdict.WHERE_USED, 2.0, 0.0),
    printed="the system remains unstable at this time. Near zero frequency, the open-loop "
    "system ... behaves approximated as $O(-s)$",
)
def stage_one_unstable() -> Finding:
    """Count at the three perturbations; follow L towards s = 0."""
    counts = counts_of(STAGE_ONE)
    order = max(nyquist(STAGE_ONE, *c).pole_order for c in POINTS.values())
    plain = paper_loop(controller=Controller((), (), CONTROLLER_GAIN))
    bare = nyquist(plain, *POINTS["Area 2"]).pole_order
    first, last = STAGE_ONE.open_loop(np.array([1e-12, 1e-11]), *POINTS["Area 2"])
    slope = float(np.log10(abs(last / first)))
    days = 1.0 / rightmost_root(STAGE_ONE, *POINTS["Area 2"]).real / 86400.0
    linear = abs(slope - 1.0) < 0.01 and first.real < 0.0
    return Finding(
        decide(bare > order == 0, linear, counts["Area 2"] > 0, beyond=all(counts.values())),
        counts["Area 2"],
        "unstable roots with Stage I alone at $(1, 1 - 10⁻⁶)$, without the actuator $1/s$",
        f"The pole of L of order {bare} at $s = 0$ is gone. At $(1, 1 - 10⁻⁶)$, which Stage II "
        f"is for, L behaves as $-s$ and the loop grows by a factor e in {days:.1f} days. At "
        f"$(1, 1)$ and $(1, 1 + 10⁻⁶)$ it has {counts['A']} and {counts['Area 1']} unstable "
        "roots.",
    )


@claim(
    "K2",
    place="Sec. IV.B, Stage I; Fig. 8(a)",
    says="The phase lead of Stage I makes the Nyquist curve encircle -1 clockwise.",
    pinned=(Verdict.WHERE_USED, 2.0, 0.0),
)
def stage_one_encircles() -> Finding:
    """Count encirclements at the three perturbations."""
    turns = {point: nyquist(STAGE_ONE, *c).encirclements for point, c in POINTS.items()}
    crossing = low_crossings(STAGE_ONE, "Area 2")
    below = crossing.value < -1.0
    return Finding(
        decide(turns["Area 2"] > 0, beyond=all(turn > 0 for turn in turns.values())),
        turns["Area 2"],
        "clockwise encirclements of -1 with Stage I alone at $(1, 1 - 10⁻⁶)$, both signs of ω",
        "It does for $c₂ < c₁$: once for each sign of ω, where the curve crosses the negative "
        f"real axis at {crossing.value[below][0]:.4g}. There are {turns['A']} and "
        f"{turns['Area 1']} encirclements at $(1, 1)$ and $(1, 1 + 10⁻⁶)$.",
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
        decide(added["Area 2"] == added["Area 1"] == 2, not any(turns)),
        added["Area 2"],
        "crossings of the negative real axis added below 1 mHz, at $(1, 1 - 10⁻⁶)$",
        f"There are now {here.omega.size}: {places}. The first lies to the right of -1 and the "
        "other two to its left, in opposite directions.",
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
    table, printed = counts_of(LOOP), counts_of(PRINTED)
    days = 1.0 / rightmost_root(PRINTED, *POINTS["A"]).real / 86400.0
    return Finding(
        decide(printed["A"] == 0, corrected=not any(table.values())),
        printed["A"],
        "unstable roots at (1, 1) with the denominator that Eq. (11) prints",
        "As printed, $s + z₂₄$ cancels the last zero, $p₂₄$ of Table II is not used, and the "
        f"loop grows by a factor e in {days:.0f} days. With $p₂₄$ it is stable at all three "
        "points of the paper's Bode plot: a misprint.",
    )


@claim(
    "K5",
    place="Sec. IV.B, below Eq. (11)",
    says="The controlled loop is stable for every perturbation within $±10⁻⁶$.",
    pinned=(Verdict.REPRODUCED, 1.4643205e-6, 1e-12),
    printed=r"the designed controller $C(s)$ ensures system stability for perturbations within "
    r"$\pm 10^{-6}$",
)
def stable_over_the_box() -> Finding:
    """Chart the box, find the largest stable square, and the same with half of dtau."""
    limit = critical_perturbation(LOOP, (1.0, -1.0))
    # The corner along (1, -1) is the first to lose stability if all before it is stable.
    axis = 1.0 + 0.999 * limit * np.linspace(-1.0, 1.0, 101)
    stable = stability_chart(LOOP, axis, axis).stable
    half = critical_perturbation(paper_loop(difference=0.5 * (TAU1 - TAU2)), (1.0, -1.0))
    corner = highest_stable_corner()
    return Finding(
        decide(stable.all() and limit > PERTURBATION),
        limit,
        "half-width of the largest square around (1, 1) in which the loop is stable, for "
        "constant $c₁$, $c₂$",
        "This is with the poles of Table II, without the actuator $1/s$ (claims K4 and K13), "
        f"and stands for every p up to {corner:.2f} rad/s. The paper defines $Δτ = τ₁ - τ₂$ "
        f"for this loop; with half of it, as in Table I, the limit would be {half:.3g}. At the "
        f"worst point of the box the modulus margin is {worst_in_box()[2]:.3f}.",
    )


@claim(
    "K6",
    place="Sec. IV.B, below Eq. (11)",
    says="Under perturbations $|L|$ is virtually constant from 0.01 mHz to 1 Hz.",
    pinned=(Verdict.REPRODUCED, 0.33611, 1e-4),
    printed="the gain magnitude is virtually constant over the 0.01 mHz-1 Hz frequency range",
)
def constant_gain() -> Finding:
    """Compare |L| at the perturbations of the Bode plot, and over the band."""
    frequency = dense(FLAT_BAND)
    ideal = np.abs(response(frequency))
    corners = [WORST_CORNER, WORST_CORNER[::-1]]
    shown, most = (
        max(float(np.abs(abs(response(frequency, *c)) / ideal - 1.0).max()) for c in points)
        for points in (POINTS.values(), corners)
    )
    low, high = gain_range(FLAT_BAND)
    low_science, high_science = gain_range(SCIENCE_BAND)
    return Finding(
        decide(most < 0.05),
        100.0 * shown,
        "largest change of $|L|$ in % from 0.01 mHz to 1 Hz, over the perturbations of the "
        "Bode plot",
        f"At the corners of the box along (1, -1) it is {100 * most:.1f} %. Read as flat in "
        f"frequency, the claim would fail: $|L|$ rises {high / low:.0f}-fold over that band, "
        f"and is between {low_science:.0f} and {high_science:.0f} from 1 mHz on.",
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
        decide(not distinct, corrected=distinct),
        float(area2),
        "unstable roots of the uncontrolled dual arm ($g = 10$) at $(1, 1 - 10⁻⁶)$",
        f"That point lies in the unstable Area 2. Its mirror image $(1, 1 + 10⁻⁶)$ has {area1} "
        "unstable roots, lies in Area 1, and is what we take for it.",
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
        decide(abs(edge - 1.0) < 0.2, abs(abs(science) - 1.0) < 0.1),
        abs(edge),
        "gain $|C|$ of the controller at 0.1 mHz, relative to its gain g at high frequency",
        f"There the controller still takes away {100 * (1 - abs(edge)):.0f} % of the gain and "
        f"turns the phase by {np.degrees(np.angle(edge)):.0f} degrees. The science band is "
        f"spared as it says: {100 * (1 - abs(science)):.1f} % of g are missing at 1 mHz.",
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
        decide(stage1 < 1e-4),
        stage1,
        "frequency in Hz of the double pole of Stage I",
        "True of the two high-pass filters, of which the paper says it. Of Stage II one pole "
        f"lies higher, at {1e3 * highest:.1g} mHz.",
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
        decide(leads.min() > 0.0 and leads.max() < np.pi),
        float(leads.max()) / np.pi,
        r"largest phase lead at the unity-gain frequency, over $\pi$",
        f"With $c₁ = 1$ that is at {1e6 * at.min():.2f} to {1e6 * at.max():.2f} µHz, "
        f"with a phase margin of at least {180 - np.degrees(leads.max()):.0f} degrees; at "
        f"$(1 + 10⁻⁶, 1 - 10⁻⁶)$ {left:.0f} remain. It decides nothing alone, since lowering "
        "the gain can break this loop as well as raising it.",
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
    divided, spare = suppression(frequency), noise_to_spare(frequency)
    k = int(spare.argmin())
    return Finding(
        decide(settled=False),
        float(divided.min()),
        f"smallest noise suppression $|1 + L|$ from {1e3 * low:g} mHz to {high:g} Hz, at "
        "$c₁ = c₂ = 1$",
        r"The paper names no requirement. Against $30\sqrt{1 + (2.8\ \mathrm{mHz}/f)^4}$ "
        "Hz/√Hz, usual for a pre-stabilised laser, the free-running $30/f$ Hz/√Hz is "
        f"suppressed with {spare[k]:.3g} times to spare, the least at {frequency[k] * 1e3:.2g} "
        "mHz.",
    )


@claim(
    "K12",
    place="Abstract and Sec. V",
    says="The controller makes the loop robust against the perturbations.",
    pinned=(Verdict.REPRODUCED, 0.19818, 1e-5),
)
def robust() -> Finding:
    """Take the modulus margin over the box of perturbations."""
    c1, c2, modulus = worst_in_box()
    left = margins(LOOP, *WORST_CORNER)
    return Finding(
        decide(critical_perturbation(LOOP, (1.0, -1.0)) > PERTURBATION and modulus > 0.0),
        modulus,
        "smallest modulus margin, $|1 + L|$, over a grid of the box of perturbations",
        f"It is met at $(1 {c1 - 1.0:+.0e}, 1 {c2 - 1.0:+.0e})$, where the phase margin is "
        f"{np.degrees(left.phase):.1f} degrees and the gain may change by factors from "
        f"{left.gain_lower:.3f} to {left.gain_upper:.3f}. Margins against other changes, of "
        "the delay for instance, are claim K14.",
    )


@claim(
    "K13",
    place="Sec. IV.B, Eq. (11) with Sec. III.B",
    says="The controlled open loop is $C(s) P_d(s)$, with $P_d$ of Sec. III.B.",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.0, 0.0),
    affects=("K1", "K5", "K10", "M1"),
    weight=Weight.DERIVATION,
    printed=r"the dual arm-locking systems $C(s)P_d(s)$, and in Sec. III.B "
    r"$P_d(jω) =$ $\frac{g}{jω}(2 - c_1 e^{-τ_1jω} - c_2 e^{-τ_2jω})$ $+ \dots$",
)
def which_open_loop() -> Finding:
    """Put the actuator's 1/s of Sec. III into the loop, and leave it out."""
    bare, integrating = counts_of(LOOP), counts_of(INTEGRATING)
    root = rightmost_root(INTEGRATING, *POINTS["Area 2"])
    return Finding(
        decide(not any(integrating.values()), corrected=not any(bare.values())),
        integrating["Area 2"],
        "unstable roots at $(1, 1 - 10⁻⁶)$ with $P_d$ as in Sec. III.B",
        "There $P_d$ contains the integrating actuator and the gain, $g/s$; with it the loop "
        f"grows by a factor e in {1.0 / root.real / 86400.0:.2g} days. With the dual sensor of "
        "Table I alone it is stable. The $O(-s)$ after Stage I (claim K1) and stability (claim "
        "K5) need the loop without.",
    )


@claim(
    "K14",
    place="Introduction, last paragraph but two",
    says="The loop has stability margins for what the modules around it do.",
    pinned=(Verdict.IN_PART, 0.0, 0.0),
    printed="crucial to be designed with adequate stability margins to tolerate parameter "
    "perturbations arising from inter-module interactions",
)
def margins_left() -> Finding:
    """Take the margins at (1, 1), that against further delay included."""
    nominal = margins(LOOP)
    delay = 5e-3
    growth = rightmost_root(paper_loop(delay=delay), 1.0, 1.0).real
    return Finding(
        decide(nominal.gain_lower < 1.0 < nominal.gain_upper, nominal.delay > 0.0),
        nominal.delay,
        "delay margin in s at $c₁ = c₂ = 1$: the further loop delay that the loop tolerates",
        f"The gain may change by factors from {nominal.gain_lower:.3f} to "
        f"{nominal.gain_upper:.2f}. The paper does not speak of delays; but the open loop does "
        "not roll off, and any further delay makes it unstable at high frequency. A delay δ "
        rf"grows by a factor e in about $δ/\ln(2g) = δ/{np.log(2.0 * CONTROLLER_GAIN):.1f}$, "
        f"with {1e3 * delay:g} ms (a sample at 200 Hz) in {1e3 / growth:.2g} ms.",
    )
