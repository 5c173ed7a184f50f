"""Claims of Sec. IV.B, the controller, and the computations they share with the chapter."""

from __future__ import annotations

from functools import cache, partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import bisect, brentq

from armlock.checks import ComplexArray, FloatArray
from armlock.controllers import Controller, stage_one, table_two
from armlock.loops import DualArm, Loop, paper_loop
from armlock.margins import Margins, critical_perturbation, margins, modulus_margin
from armlock.nyquist import AxisCrossings, axis_crossings, nyquist
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
from armlock.roots import rightmost_root
from armlock.stability import StabilityChart, stability_chart, unstable_roots
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
CONTROLLERS = {
    "Stage I": stage_one(),
    "Table II": table_two(),
    "Eq. (11)": table_two(denominator="printed"),
}


# Counts -------------------------------------------------------------------------------------


class Reading(NamedTuple):
    """One reading of the controlled loop at one perturbation, decided three ways.

    Attributes
    ----------
    controller, actuator, point : str, bool, str
        Keys of `CONTROLLERS` and `POINTS`, and whether 1/s is in the loop.
    winding : int
        Unstable roots, by winding number of D.
    encirclements : int
        Clockwise turns of the Nyquist curve around -1.
    rightmost : complex
        Rightmost root in rad/s; of a pair, the upper one.
    """

    controller: str
    actuator: bool
    point: str
    winding: int
    encirclements: int
    rightmost: complex

    @property
    def agree(self) -> bool:
        """Whether the three methods agree."""
        unstable = self.rightmost.real > 0.0
        return self.winding == self.encirclements and unstable == (self.winding > 0)


@cache
def readings() -> tuple[Reading, ...]:
    """Decide every controller, with and without the actuator, at the paper's perturbations."""
    table = []
    for name, controller in CONTROLLERS.items():
        for actuator in (False, True):
            loop = paper_loop(controller=controller, actuator=actuator)
            for point, c in POINTS.items():
                count, turns = int(unstable_roots(loop, *c)), nyquist(loop, *c).encirclements
                root = rightmost_root(loop, *c)
                table.append(Reading(name, actuator, point, count, turns, root))
    return tuple(table)


def counts_of(controller: str, *, actuator: bool = False) -> dict[str, int]:
    """Return the counts of one reading by perturbation; the methods must agree."""
    chosen = [r for r in readings() if r[:2] == (controller, actuator)]
    for reading in chosen:
        if not reading.agree:
            raise RuntimeError(f"the methods disagree: {reading}")
    return {reading.point: reading.winding for reading in chosen}


def rightmost_of(controller: str, point: str, *, actuator: bool = False) -> complex:
    """Return the rightmost root of one reading at one perturbation, in rad/s."""
    return next(r.rightmost for r in readings() if r[:3] == (controller, actuator, point))


# Charts and limits --------------------------------------------------------------------------


@cache
def chart(half_width: float, points: int = 401) -> StabilityChart:
    """Chart the controlled loop over a square around (1, 1)."""
    axis = 1.0 + np.linspace(-half_width, half_width, points)
    return stability_chart(LOOP, axis, axis)


@cache
def first_breaks(number: int = 24) -> tuple[FloatArray, FloatArray]:
    """First perturbation of (1, 1) that breaks the loop, in directions all the way around.

    Returns
    -------
    angle : float array, shape (number,)
        Of the direction (cos, sin) in the (c1, c2) plane, in rad.
    length : float array, shape (number,)
        Length of the perturbation.
    """
    angle = TURN * np.arange(number) / number
    vectors = np.round(np.column_stack((np.cos(angle), np.sin(angle))), 15)
    return angle, np.array([critical_perturbation(LOOP, vector) for vector in vectors])


@cache
def largest_stable_square() -> float:
    """Half-width of the largest square around (1, 1) in which the loop is stable.

    The loop depends almost on c1 - c2 alone, so that the corner along (1, -1) is the first to
    lose stability; a chart makes sure that no other point of the square does before.

    Raises
    ------
    RuntimeError
        If one does.
    """
    limit = critical_perturbation(LOOP, (1.0, -1.0))
    if not chart(0.999 * limit, 101).stable.all():
        raise RuntimeError(f"the square of half-width {limit} is not stable throughout")
    return limit


@cache
def worst_in_box(points: int = 5) -> tuple[float, float, float]:
    """Return c1, c2 and the modulus margin where it is smallest, over a grid of the box."""
    axis = 1.0 + PERTURBATION * np.linspace(-1.0, 1.0, points)
    found = [(modulus_margin(LOOP, x, y), float(x), float(y)) for x in axis for y in axis]
    margin, c1, c2 = min(found)
    return c1, c2, margin


@cache
def all_margins(point: tuple[float, float]) -> Margins:
    """Return all margins of the controlled loop at a point."""
    return margins(LOOP, *point)


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


def free_running(frequency: FloatArray) -> FloatArray:
    """Amplitude spectral density of the free-running laser in Hz/sqrt(Hz), Sec. IV.C."""
    return LASER_NOISE / frequency


def assumed_requirement(frequency: FloatArray) -> FloatArray:
    """Return the usual requirement on a pre-stabilised laser in Hz/sqrt(Hz): an assumption."""
    return 30.0 * np.sqrt(1.0 + (2.8e-3 / frequency) ** 4)


def suppression(frequency: FloatArray) -> FloatArray:
    """Return |1 + L|, by which the loop divides the laser's noise, at c1 = c2 = 1."""
    return np.asarray(np.abs(1.0 + response(frequency)))


def noise_to_spare(frequency: FloatArray) -> FloatArray:
    """Return how many times the locked laser meets `assumed_requirement`, at c1 = c2 = 1."""
    return assumed_requirement(frequency) * suppression(frequency) / free_running(frequency)


def relative_gain(frequency: float) -> complex:
    """Return the controller over its gain, at a frequency in Hz."""
    return complex(table_two()(1j * TURN * frequency)) / CONTROLLER_GAIN


# Claims -------------------------------------------------------------------------------------


@claim(
    "K1",
    place="Sec. IV.B, Stage I",
    says="Two high-pass filters (Stage I of the controller) remove the infinite branch at low "
    "frequency; the loop behaves as O(-s) near zero and is still unstable.",
    pinned=(Verdict.IN_PART, 2.0, 0.0),
)
def stage_one_unstable() -> Finding:
    """Count at the three perturbations; follow L towards s = 0."""
    counts, other = counts_of("Stage I"), counts_of("Stage I", actuator=True)
    order = max(nyquist(STAGE_ONE, *c).pole_order for c in POINTS.values())
    plain = paper_loop(controller=Controller((), (), CONTROLLER_GAIN))
    bare = nyquist(plain, *POINTS["Area 2"]).pole_order
    values = {p: STAGE_ONE.open_loop(np.array([1e-12, 1e-11]), *c) for p, c in POINTS.items()}
    slopes = {p: float(np.log10(abs(last / first))) for p, (first, last) in values.items()}
    linear = abs(slopes["Area 2"] - 1.0) < 0.01 and values["Area 2"][0].real < 0.0
    years = -1.0 / rightmost_of("Stage I", "A").real / 3.156e7
    return Finding(
        decide(bare > order == 0, linear, all(counts.values())),
        counts["Area 2"],
        "unstable roots with Stage I alone at (c₁, c₂) = (1, 1 - 10⁻⁶), without the "
        "integrating actuator 1/s",
        f"The pole of L of order {bare} at s = 0 is gone. At (1, 1 - 10⁻⁶) L behaves as "
        f"-s^{slopes['Area 2']:.2f} near zero, and the loop is unstable; at (1, 1) and (1, 1 + "
        f"10⁻⁶) {counts['A']} and {counts['Area 1']} roots are, though at (1, 1) the slowest "
        f"decay takes {years:.0f} years. With the actuator L is finite at zero, not O(-s), and "
        f"{other['Area 2']}, {other['A']} and {other['Area 1']} roots are unstable at the "
        "three points.",
    )


@claim(
    "K2",
    place="Sec. IV.B, Stage I; Fig. 8(a)",
    says="The phase lead of the two high-pass filters (Stage I of the controller) makes the "
    "Nyquist curve encircle -1 clockwise.",
    pinned=(Verdict.IN_PART, 2.0, 0.0),
)
def stage_one_encircles() -> Finding:
    """Count encirclements at the three perturbations."""
    turns = {point: nyquist(STAGE_ONE, *c).encirclements for point, c in POINTS.items()}
    crossing = low_crossings(STAGE_ONE, "Area 2")
    below = crossing.value < -1.0
    return Finding(
        decide(*(turn > 0 for turn in turns.values())),
        turns["Area 2"],
        "clockwise encirclements of -1 with Stage I alone at (c₁, c₂) = (1, 1 - 10⁻⁶), both "
        "signs of ω",
        "It does for c₂ < c₁: once for each sign of ω, where the curve crosses the negative "
        f"real axis at {crossing.value[below][0]:.4g} "
        f"({crossing.omega[below][0] / TURN * 1e6:.3g} µHz). With the same filters there are "
        f"{turns['A']} and {turns['Area 1']} encirclements at (1, 1) and (1, 1 + 10⁻⁶): what "
        "decides is the sign of c₁ - c₂.",
    )


@claim(
    "K3",
    place="Sec. IV.B, Stage II; Fig. 8(b)",
    says="The lead compensators (Stage II of the controller) add two crossings of the negative "
    "real axis, and the Nyquist curve no longer encloses -1.",
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
        "crossings of the negative real axis added below 1 mHz, at (c₁, c₂) = (1, 1 - 10⁻⁶)",
        f"There are now {here.omega.size}: {places}. The first lies to the right of -1 and the "
        "other two to its left, in opposite directions. At (1, 1 + 10⁻⁶) the number of "
        f"crossings goes from {before['Area 1'].omega.size} to {after['Area 1'].omega.size}, "
        f"at (1, 1) from {before['A'].omega.size} to {after['A'].omega.size}.",
    )


@claim(
    "K4",
    place="Eq. (11) and Table II",
    says="The controller has s + z24 in its denominator (the equation) or s + p24 (the table).",
    pinned=(Verdict.NOT_AS_WRITTEN, 2.0, 0.0),
    affects=("K5", "K10"),
    weight=Weight.WORDING,
)
def which_denominator() -> Finding:
    """Run both."""
    table, printed = counts_of("Table II"), counts_of("Eq. (11)")
    return Finding(
        decide(printed["A"] == 0, corrected=not any(table.values())),
        printed["A"],
        "unstable roots at (1, 1) with the denominator that Eq. (11) prints",
        "As printed, s + z24 cancels the last zero, and p24 of Table II is not used. "
        f"{printed['Area 2']}, {printed['A']} and {printed['Area 1']} roots are then unstable "
        f"at (1, 1 - 10⁻⁶), (1, 1) and (1, 1 + 10⁻⁶), with p24 {table['Area 2']}, {table['A']} "
        f"and {table['Area 1']}: a misprint. All other claims are checked with p24.",
    )


@claim(
    "K5",
    place="Sec. IV.B, below Eq. (11)",
    says="The controlled loop is stable for every perturbation of c₁ and c₂ within ±10⁻⁶.",
    pinned=(Verdict.IN_PART, 1.4643205e-6, 1e-12),
)
def stable_over_the_box() -> Finding:
    """Chart the box, find the largest stable square, and the margins at the worst corner."""
    box = chart(PERTURBATION, 101)
    limit = largest_stable_square()
    c1, c2, modulus = worst_in_box()
    left = all_margins(WORST_CORNER)
    halved = critical_perturbation(paper_loop(difference=0.5 * (TAU1 - TAU2)), (1.0, -1.0))
    printed, integrating = counts_of("Eq. (11)"), counts_of("Table II", actuator=True)
    corner = highest_stable_corner() / TURN
    return Finding(
        decide(
            box.stable.all() and limit > PERTURBATION,
            halved > PERTURBATION,
            not any(printed.values()),
            not any(integrating.values()),
        ),
        limit,
        "half-width of the largest square around (1, 1) in which the loop is stable, for "
        "constant c₁, c₂, in the one reading of the paper in which it holds",
        "It holds with Table II, without the actuator 1/s, and with Δτ = τ₁ - τ₂ in the dual "
        f"sensor: the first break along (1, -1) is at {limit / PERTURBATION:.3f} times the "
        f"square's corner. At the worst point, (1 {c1 - 1.0:+.0e}, 1 {c2 - 1.0:+.0e}), the "
        f"modulus margin is {modulus:.3f}, the phase margin {np.degrees(left.phase):.1f} "
        f"degrees, and the gain may change by factors from {left.gain_lower:.3f} to "
        f"{left.gain_upper:.3f}. It does not hold with half of τ₁ - τ₂, as in the source of "
        f"Table I (the limit is {halved:.3g}); with the actuator, as in Sec. III.B "
        f"({integrating['Area 2']} unstable root at (1, 1 - 10⁻⁶)); with the denominator of "
        f"Eq. (11) ({printed['A']} at (1, 1)); or if the sensor's corner p, which the paper "
        f"does not give, exceeds 2π · {corner:.2f} rad/s.",
    )


@claim(
    "K6",
    place="Sec. IV.B, below Eq. (11)",
    says="The open loop's gain |L| is virtually constant from 0.01 mHz to 1 Hz.",
    pinned=(Verdict.DIFFERS, 2740.7, 1.0),
    affects=("K8", "M3"),
)
def constant_gain() -> Finding:
    """Compute the range of |L| over the band, and over the science band."""
    low, high = gain_range(FLAT_BAND)
    low_science, high_science = gain_range(SCIENCE_BAND)
    tenth, one = (float(abs(response(frequency))) for frequency in (1e-4, 1e-3))
    return Finding(
        decide(high < 2.0 * low),
        high / low,
        "largest over smallest |L| from 0.01 mHz to 1 Hz at c₁ = c₂ = 1",
        f"|L| rises from {low:.3g} at 0.01 mHz over {tenth:.3g} at 0.1 mHz to {one:.4g} at 1 "
        f"mHz. From there on it lies between {low_science:.4g} and {high_science:.4g}, a "
        f"factor {high_science / low_science:.2g}, without nulls: constant within that factor, "
        "two decades later than stated.",
    )


@claim(
    "K7",
    place="Caption of Fig. 9",
    says="Points of Area 1 and of Area 2 are shown, with coordinates.",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.0, 0.0),
    weight=Weight.WORDING,
)
def same_point_twice() -> Finding:
    """Count unstable roots of the uncontrolled dual arm on both sides of the ideal point."""
    area2, area1 = unstable_roots(DualArm(), 1.0, 1.0 + PERTURBATION * np.array([-1.0, 1.0]))
    distinct = area2 > 0 and area1 == 0
    return Finding(
        decide(not distinct, corrected=distinct),
        float(area2),
        "unstable roots of the uncontrolled dual arm (g = 10) at (c₁, c₂) = (1, 1 - 10⁻⁶)",
        "The caption gives (1, 1 - 10⁻⁶) for both areas of the paper's Fig. 5. That point lies "
        f"in the unstable Area 2; its mirror image (1, 1 + 10⁻⁶) has {area1} unstable roots, "
        "lies in the stable Area 1, and is what we take for it.",
    )


@claim(
    "K8",
    place="Sec. IV.B, first paragraph",
    says="The controller acts mainly below 0.1 mHz, so that it does not touch the science band "
    "from 1 mHz to 1 Hz.",
    pinned=(Verdict.IN_PART, 0.194727, 1e-6),
)
def acts_below() -> Finding:
    """Compare C(s) with its gain at 0.1 mHz and in the science band."""
    edge, science = relative_gain(1e-4), relative_gain(1e-3)
    frequency = np.geomspace(1e-5, 1.0, 100_001)
    off = np.abs(table_two()(1j * TURN * frequency) / CONTROLLER_GAIN - 1.0)
    settled = float(frequency[np.flatnonzero(off > 0.5)[-1]])
    return Finding(
        decide(abs(edge - 1.0) < 0.2, abs(abs(science) - 1.0) < 0.1),
        abs(edge),
        "gain |C| of the controller at 0.1 mHz, relative to its gain g at high frequency",
        f"There the controller still takes away {100 * (1 - abs(edge)):.0f} % of the gain and "
        f"turns the phase by {np.degrees(np.angle(edge)):.0f} degrees; C comes within one half "
        f"of g at {settled * 1e3:.2f} mHz only. In the science band its gain is indeed g: "
        f"{100 * (1 - abs(science)):.1f} % are missing at 1 mHz.",
    )


@claim(
    "K9",
    place="Sec. IV.B, Stage I; Table II",
    says="The poles of the high-pass filters (Stage I of the controller) lie below 0.1 mHz.",
    pinned=(Verdict.REPRODUCED, 1e-6, 1e-18),
    weight=Weight.WORDING,
)
def poles_below() -> Finding:
    """Read them off Table II."""
    stage1 = TABLE_2_STAGE_1_POLE / TURN
    stage2 = np.array(TABLE_2_POLES) / TURN
    high = stage2[stage2 > 1e-4]
    return Finding(
        decide(stage1 < 1e-4),
        stage1,
        "frequency in Hz of the double pole of Stage I",
        "True of the two high-pass filters, of which the paper says it. Of the four poles of "
        f"Stage II, {high.size} lies above 0.1 mHz: p23 = 2π · {high.max():.0e} rad/s.",
    )


@claim(
    "K10",
    place="Sec. IV.B, Stage II",
    says="With the lead compensators, the phase at the unity-gain frequency stays below π.",
    pinned=(Verdict.REPRODUCED, 0.869991, 1e-6),
)
def phase_at_unity_gain() -> Finding:
    """Find that frequency at each perturbation, and the phase lead there."""
    unity = [unity_gain(point) for point in POINTS]
    leads = np.array([phase for _, phase in unity])
    shown = ", ".join(f"{lead / np.pi:.3f} π at {1e6 * at:.2f} µHz" for at, lead in unity)
    left = np.degrees(all_margins(WORST_CORNER).phase)
    return Finding(
        decide(leads.min() > 0.0 and leads.max() < np.pi),
        float(leads.max()) / np.pi,
        "largest phase lead at the unity-gain frequency, over π",
        f"With c₁ = 1 the lead is {shown} for c₂ = 1 - 10⁻⁶, 1 and 1 + 10⁻⁶: a phase margin of "
        f"at least {180 - np.degrees(leads.max()):.0f} degrees. At (1 + 10⁻⁶, 1 - 10⁻⁶) "
        f"{left:.0f} remain. It decides nothing alone: where the gain exceeds one, the Nyquist "
        "curve crosses the negative real axis twice more, and lowering the gain can break the "
        "loop as well as raising it.",
    )


@claim(
    "K11",
    place="Sec. IV.B, first paragraph",
    says="A gain of g = 5000 meets the basic requirement on noise suppression.",
    pinned=(Verdict.OPEN, 973.24, 0.01),
)
def basic_requirement() -> Finding:
    """Compute |1 + L|, and hold the residual noise against an assumed requirement."""
    frequency = dense(SUPPRESSION_BAND)
    low, high = SUPPRESSION_BAND
    divided = suppression(frequency)
    spare = noise_to_spare(frequency)
    k = int(spare.argmin())
    science = suppression(dense(SCIENCE_BAND))
    return Finding(
        decide(settled=False),
        float(divided.min()),
        f"smallest noise suppression |1 + L|, with the open loop L, from {1e3 * low:g} mHz to "
        f"{high:g} Hz, at c₁ = c₂ = 1",
        "The paper names no requirement. From 1 mHz on the noise is divided by at least "
        f"{science.min():.4g}. Against 30 √(1 + (2.8 mHz / f)⁴) Hz/√Hz, the usual level of a "
        "pre-stabilised laser with the corner of Eq. (A5), the free-running 30/f Hz/√Hz is "
        f"suppressed with {spare[k]:.3g} times to spare, the least at {frequency[k] * 1e3:.2g} "
        f"mHz. About g = {CONTROLLER_GAIN / spare[k]:.0f} would do for that, but stability at "
        "(1, 1) is lost below g = "
        f"{CONTROLLER_GAIN * all_margins(POINTS['A']).gain_lower:.0f}.",
    )


@claim(
    "K12",
    place="Introduction and Sec. V",
    says="The controller makes the loop robust, with margin for what the modules around it do.",
    pinned=(Verdict.IN_PART, 0.0, 0.0),
)
def robust() -> Finding:
    """Take every margin, that against further delay included."""
    nominal = all_margins(POINTS["A"])
    delays = (1e-6, 5e-3)
    counts = [int(unstable_roots(paper_loop(delay=delay), 1.0, 1.0)) for delay in delays]
    growth = [rightmost_root(paper_loop(delay=delay), 1.0, 1.0).real for delay in delays]
    chain = critical_perturbation(LOOP, (1.0, 1.0))
    return Finding(
        decide(largest_stable_square() > PERTURBATION, not any(counts) and nominal.delay > 0.0),
        nominal.delay,
        "delay margin in s at c₁ = c₂ = 1: the further loop delay that the loop tolerates",
        "Against perturbations of c₁ and c₂ it is, in the reading of claim K5, and at (1, 1) "
        f"the gain may change by factors from {nominal.gain_lower:.3f} to "
        f"{nominal.gain_upper:.2f}. But the open loop does not roll off, and any further delay "
        f"turns its phase by π at some high frequency. With {delays[0] * 1e6:g} µs the fastest "
        f"root grows by a factor e in {1e6 / growth[0]:.2g} µs, with {delays[1] * 1e3:g} ms (a "
        f"sample at 200 Hz) in {1e3 / growth[1]:.2g} ms. A real actuator rolls "
        "off, and has to be part of the model. The neutral root chain needs c₁ + c₂ < 2 + 1/g: "
        f"both may rise by {chain:.4g} only.",
    )


@claim(
    "K13",
    place="Sec. IV.B, Eq. (11) with Sec. III.B",
    says="The controlled open loop is C(s) P_d(s), with the controller C and the dual arm's "
    "P_d of Sec. III.B.",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.0, 0.0),
    affects=("K5", "K10", "M1"),
    weight=Weight.DERIVATION,
)
def which_open_loop() -> Finding:
    """Put the actuator's 1/s of Sec. III into the loop, and leave it out."""
    bare, integrating = counts_of("Table II"), counts_of("Table II", actuator=True)
    root = rightmost_of("Table II", "Area 2", actuator=True)
    return Finding(
        decide(not any(integrating.values()), corrected=not any(bare.values())),
        integrating["Area 2"],
        "unstable roots at (c₁, c₂) = (1, 1 - 10⁻⁶) with P_d as in Sec. III.B",
        "There P_d contains the integrating actuator, g/s. With it the loop has "
        f"{integrating['Area 2']}, {integrating['A']} and {integrating['Area 1']} unstable "
        f"roots at (1, 1 - 10⁻⁶), (1, 1) and (1, 1 + 10⁻⁶), the rightmost at {root.real:.3g} "
        f"rad/s; with the dual sensor of Table I alone, {bare['Area 2']}, {bare['A']} and "
        f"{bare['Area 1']}. The O(-s) after Stage I (claim K1) and stability (claim K5) need "
        "the loop without.",
    )
