"""Claims of Sec. IV.B, the controller, and the computations they share with the chapter."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import mpmath
import numpy as np

from armlock.checks import ComplexArray, FloatArray, positive_number
from armlock.controllers import Controller, stage_one, table_two
from armlock.loops import Loop, paper_loop
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
from armlock.roots import RootError, extended_root, pseudospectral_roots
from armlock.stability import StabilityChart, stability_chart, unstable_roots
from book.companion.claims.ledger import Finding, Verdict, claim

CHAPTER = "06_controller"
TURN = 2.0 * np.pi

#: The three perturbations of the paper's Bode plot, as its text means them (claim K7).
POINTS = {
    "Area 2": (1.0, 1.0 - PERTURBATION),
    "A": (1.0, 1.0),
    "Area 1": (1.0, 1.0 + PERTURBATION),
}
#: The corner of the box of perturbations that comes nearest to instability.
WORST_CORNER = (1.0 + PERTURBATION, 1.0 - PERTURBATION)
#: Up to here in rad/s roots are found from an expansion of the delays, in such units.
NEAR_ZERO = 1e-3
EXPANSION_SCALE = 1e-6
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


def slow_roots(loop: Loop, c1: float, c2: float, degree: int = 60) -> ComplexArray:
    """Characteristic roots of low frequency, by another method than winding.

    Eigenvalues of the loop's Chebyshev discretization, each followed by Newton's method to a
    root of the exact characteristic function. Next to zero rounding hides the eigenvalues, and
    `expanded_roots` takes their place.

    Returns
    -------
    complex array
        Distinct roots in rad/s, rightmost first. Roots of magnitude up to about
        degree / delay are resolved; those of the high-frequency chain are not among them.
    """
    found = list(expanded_roots(loop, c1, c2))
    for start in pseudospectral_roots(loop, c1, c2, degree)[:16]:
        if abs(start) < NEAR_ZERO:
            continue
        try:
            root = complex(extended_root(loop, c1, c2, start, digits=20))
        except RootError:
            continue
        if all(abs(root - r) > 1e-9 * abs(r) for r in found):
            found.append(root)
    return np.array(sorted(found, key=lambda r: -r.real))


def expanded_roots(loop: Loop, c1: float, c2: float, order: int = 8) -> list[complex]:
    """Roots of D with its delays expanded in powers of s, nearer to zero than `NEAR_ZERO`.

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float
        The point.
    order : int, optional
        Last power of a delay times s. With the default what is left out is below rounding.

    Returns
    -------
    list of complex
        In rad/s, to rounding; found in extended precision, because of D only the difference
        of terms many orders larger remains.
    """
    with mpmath.workdps(60):
        size = max(loop.rest.size, loop.b1.size, loop.b2.size) + order
        total = [mpmath.mpf(0)] * size
        for coefficients, delay, origin, here in (
            (loop.rest, 0.0, 1.0, 0.0),
            (loop.b1, loop.delay1, loop.reference[0], c1),
            (loop.b2, loop.delay2, loop.reference[1], c2),
        ):
            for k in range(order + 1):
                part = (origin if k == 0 else 0) - here * (
                    (-mpmath.mpf(delay)) ** k / mpmath.factorial(k)
                )
                for m, b in enumerate(coefficients.tolist()):
                    total[m + k] += b * part
        # In units of the controller's frequencies, for which doubles serve as starts.
        scaled = [float(b * mpmath.mpf(EXPANSION_SCALE) ** m) for m, b in enumerate(total)]
        found = []
        for start in np.polynomial.polynomial.polyroots(scaled) * EXPANSION_SCALE:
            if abs(start) > NEAR_ZERO:
                continue
            root = mpmath.mpc(complex(start))
            for _ in range(8):
                value, slope = mpmath.polyval(total, root, derivative=True, asc=True)
                root -= value / slope if slope else 0
            found.append(complex(root))
    return found


class Reading(NamedTuple):
    """One reading of the controlled loop at one perturbation, counted three ways.

    Attributes
    ----------
    controller, actuator, point : str, bool, str
        Keys of `CONTROLLERS` and `POINTS`, and whether 1/s is in the loop.
    winding : int
        Unstable roots, by winding number of D.
    encirclements : int
        Clockwise turns of the Nyquist curve around -1.
    rightmost : complex
        Rightmost of the polished slow roots, in rad/s; of a pair, the upper one.
    found : int
        How many of them lie in the right half-plane.
    """

    controller: str
    actuator: bool
    point: str
    winding: int
    encirclements: int
    rightmost: complex
    found: int


@cache
def readings() -> tuple[Reading, ...]:
    """Decide every controller, with and without the actuator, at the paper's perturbations."""
    table = []
    for name, controller in CONTROLLERS.items():
        for actuator in (False, True):
            loop = paper_loop(controller=controller, actuator=actuator)
            for point, (c1, c2) in POINTS.items():
                roots = slow_roots(loop, c1, c2)
                table.append(
                    Reading(
                        name,
                        actuator,
                        point,
                        int(unstable_roots(loop, c1, c2)),
                        nyquist(loop, c1, c2).encirclements,
                        complex(roots[0].real, abs(roots[0].imag)),
                        int((roots.real > 0.0).sum()),
                    )
                )
    return tuple(table)


def counts_of(controller: str, *, actuator: bool = False) -> dict[str, int]:
    """Return the counts of one reading by perturbation; the methods must agree."""
    chosen = [r for r in readings() if r.controller == controller and r.actuator == actuator]
    for r in chosen:
        if not r.winding == r.encirclements == r.found:
            raise RuntimeError(f"the methods disagree: {r}")
    return {r.point: r.winding for r in chosen}


# Charts and limits --------------------------------------------------------------------------


@cache
def chart(half_width: float, points: int = 401) -> StabilityChart:
    """Chart the controlled loop over a square around (1, 1)."""
    axis = 1.0 + np.linspace(-half_width, half_width, points)
    return stability_chart(LOOP, axis, axis)


@cache
def first_perturbation(number: int = 24) -> tuple[FloatArray, FloatArray]:
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
def box_limit() -> float:
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
def highest_corner(difference: float | None = None) -> float:
    """Highest corner frequency p in rad/s at which the loop is stable at (1, 1).

    By bisection from the assumed one up.

    Parameters
    ----------
    difference : float, optional
        The sensor's dtau in s; tau1 - tau2 by default.
    """
    low, high = DUAL_SENSOR_CORNER, 100.0 * DUAL_SENSOR_CORNER
    for _ in range(24):
        middle = float(np.sqrt(low * high))
        if unstable_roots(paper_loop(middle, difference=difference), 1.0, 1.0) == 0:
            low = middle
        else:
            high = middle
    return low


def delayed_root(delay: float) -> complex:
    """Root that a further delay in the loop moves to the right half-plane, at (1, 1).

    Near a frequency at which both arms have a null, L = g taubar 2 (s - j omega); a delay
    that turns its phase by pi there takes the root across.

    Parameters
    ----------
    delay : float
        Further delay of the loop in s.

    Returns
    -------
    complex
        Root of 1 + L exp(-s delay) in rad/s, by Newton's method.

    Raises
    ------
    RuntimeError
        If the method does not converge.
    """
    delay = positive_number("delay", delay)
    null = TURN / abs(0.5 * (TAU1 - TAU2))
    omega = null * max(1, round(np.pi / delay / null))
    s = 1j * omega - np.exp(1j * omega * delay) / (CONTROLLER_GAIN * (TAU1 + TAU2))

    def value(at: complex) -> complex:
        return 1.0 + complex(LOOP.open_loop(at)) * complex(np.exp(-at * delay))

    step = 1e-7
    for _ in range(40):
        slope = (value(s + step) - value(s - step)) / (2.0 * step)
        move = value(s) / slope
        s -= move
        if abs(move) <= 1e-12 * abs(s.real):
            break
    if abs(value(s) / slope) > 1e-4 * abs(s.real):
        raise RuntimeError(f"no root found for a delay of {delay} s: stopped at {s}")
    return complex(s)


# Responses ----------------------------------------------------------------------------------


def low_crossings(loop: Loop, point: str) -> AxisCrossings:
    """Crossings of the negative real axis below `LOW_FREQUENCY`, at one of `POINTS`."""
    return axis_crossings(loop, *POINTS[point], omega_max=TURN * LOW_FREQUENCY)


def extremes(
    band: tuple[float, float], c1: float = 1.0, c2: float = 1.0
) -> tuple[float, float]:
    """Return the smallest and largest |L| in a band in Hz, over a dense grid."""
    size = np.abs(response(_dense(band), c1, c2))
    return float(size.min()), float(size.max())


def response(frequency: FloatArray, c1: float = 1.0, c2: float = 1.0) -> ComplexArray:
    """Return L of the controlled loop at frequencies in Hz."""
    return LOOP.open_loop(1j * TURN * frequency, c1, c2)


def _dense(band: tuple[float, float]) -> FloatArray:
    """Frequencies in Hz, log-spaced at first, then many to a turn of the delays."""
    turn = 1.0 / TAU1
    low = np.geomspace(band[0], max(band[0], turn), 20_001)
    return np.concatenate((low, np.arange(turn, band[1], turn / 400.0), [band[1]]))


def unity_gain(point: str) -> tuple[float, float]:
    """Return the unity-gain frequency in Hz below `LOW_FREQUENCY`, and the phase there.

    The phase in rad, between -pi and pi: that of the high-pass filters is a lead.
    """
    frequency = np.geomspace(1e-9, LOW_FREQUENCY, 20_001)
    values = np.log(np.abs(response(frequency, *POINTS[point])))
    places = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    if places.size != 1:
        raise RuntimeError(f"expected one unity-gain frequency, found {places.size}")
    k = int(places[0])
    low, high = np.log(frequency[k : k + 2])
    for _ in range(60):
        middle = 0.5 * (low + high)
        inside = np.log(abs(response(np.array([np.exp(middle)]), *POINTS[point])[0]))
        low, high = (middle, high) if inside * values[k] > 0.0 else (low, middle)
    at = float(np.exp(low))
    return at, float(np.angle(response(np.array([at]), *POINTS[point])[0]))


def free_running(frequency: FloatArray) -> FloatArray:
    """Amplitude spectral density of the free-running laser in Hz/sqrt(Hz), Sec. IV.C."""
    return LASER_NOISE / frequency


def assumed_requirement(frequency: FloatArray) -> FloatArray:
    """Return the usual requirement on a pre-stabilised laser in Hz/sqrt(Hz): an assumption."""
    return 30.0 * np.sqrt(1.0 + (2.8e-3 / frequency) ** 4)


def suppression(frequency: FloatArray, c1: float = 1.0, c2: float = 1.0) -> FloatArray:
    """Return |1 + L|, by which the controlled loop divides the laser's noise."""
    return np.asarray(np.abs(1.0 + response(frequency, c1, c2)))


def noise_to_spare(frequency: FloatArray) -> FloatArray:
    """Return how many times the locked laser meets `assumed_requirement`, at c1 = c2 = 1."""
    return assumed_requirement(frequency) * suppression(frequency) / free_running(frequency)


def shape(frequency: float) -> complex:
    """Return the controller over its gain, at a frequency in Hz."""
    return complex(table_two()(1j * TURN * frequency)) / CONTROLLER_GAIN


# Claims -------------------------------------------------------------------------------------


@claim(
    "K1",
    place="Sec. IV.B, Stage I",
    says="Two high-pass filters (Stage I of the controller) remove the infinite branch at low "
    "frequency; the loop behaves as O(-s) near zero and is still unstable.",
    chapter=CHAPTER,
)
def stage_one_unstable() -> Finding:
    """Count at the three perturbations; follow L towards s = 0."""
    counts = counts_of("Stage I")
    order = {p: nyquist(STAGE_ONE, *c).pole_order for p, c in POINTS.items()}
    bare = nyquist(
        paper_loop(controller=Controller((), (), CONTROLLER_GAIN)), *POINTS["Area 2"]
    ).pole_order
    steps = np.array([1e-12, 1e-11])
    slopes = {}
    for point, c in POINTS.items():
        size = np.abs(STAGE_ONE.open_loop(steps, *c))
        slopes[point] = float(np.log10(size[1] / size[0]))
    at = POINTS["Area 2"]
    sign = float(STAGE_ONE.open_loop(steps[0], *at).real)
    removed = bare > 0 and max(order.values()) == 0
    linear = abs(slopes["Area 2"] - 1.0) < 0.01 and sign < 0.0
    other = counts_of("Stage I", actuator=True)
    rates = {r.point: r.rightmost for r in readings() if r[:2] == ("Stage I", False)}
    if removed and linear and all(counts.values()):
        verdict = Verdict.REPRODUCED
    else:
        verdict = (
            Verdict.IN_PART
            if removed and linear and any(counts.values())
            else (Verdict.DIFFERS)
        )
    return Finding(
        verdict,
        counts["Area 2"],
        "unstable roots with Stage I alone at (c₁, c₂) = (1, 1 - 10⁻⁶), without the "
        "integrating actuator 1/s",
        f"The pole of the open loop L of order {bare} at s = 0 is gone. At (1, 1 - 10⁻⁶) L "
        f"behaves as {'-' if sign < 0 else '+'}s^{slopes['Area 2']:.2f} near zero, as the "
        f"paper says, and the loop is unstable. At (1, 1) L is of order s^{slopes['A']:.2f} "
        f"and at (1, 1 + 10⁻⁶) its sign is the other one: there {counts['A']} and "
        f"{counts['Area 1']} roots are unstable. At (1, 1) the slowest decay takes "
        f"{-1 / rates['A'].real / 3.156e7:.0f} years, so this loop is as good as on the "
        f"boundary. With the actuator there are {other['Area 2']}, {other['A']} and "
        f"{other['Area 1']} unstable roots at (1, 1 - 10⁻⁶), (1, 1) and (1, 1 + 10⁻⁶), and L "
        "is finite at zero, not O(-s): these words of the paper need the loop without 1/s.",
    )


@claim(
    "K2",
    place="Sec. IV.B, Stage I; Fig. 8(a)",
    says="The phase lead of the two high-pass filters (Stage I of the controller) makes the "
    "Nyquist curve encircle -1 clockwise.",
    chapter=CHAPTER,
)
def stage_one_encircles() -> Finding:
    """Count encirclements at the three perturbations."""
    turns = {point: nyquist(STAGE_ONE, *c).encirclements for point, c in POINTS.items()}
    crossing = low_crossings(STAGE_ONE, "Area 2")
    below = crossing.value < -1.0
    if all(turn > 0 for turn in turns.values()):
        verdict = Verdict.REPRODUCED
    else:
        verdict = Verdict.IN_PART if turns["Area 2"] > 0 else Verdict.DIFFERS
    return Finding(
        verdict,
        turns["Area 2"],
        "clockwise encirclements of -1 with Stage I alone at (c₁, c₂) = (1, 1 - 10⁻⁶), both "
        "signs of ω",
        "It does for c₂ < c₁: once for each sign of ω, where the curve crosses the negative "
        f"real axis at {crossing.value[below][0]:.4g} "
        f"({crossing.omega[below][0] / TURN * 1e6:.3g} µHz). The filters and their phase lead "
        f"are the same at (1, 1) and (1, 1 + 10⁻⁶), but there are {turns['A']} and "
        f"{turns['Area 1']} encirclements: what decides is the sign of c₁ - c₂.",
    )


@claim(
    "K3",
    place="Sec. IV.B, Stage II; Fig. 8(b)",
    says="The lead compensators (Stage II of the controller) add two crossings of the negative "
    "real axis, and the Nyquist curve no longer encloses -1.",
    chapter=CHAPTER,
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
    right = added["Area 2"] == added["Area 1"] == 2 and not any(turns)
    return Finding(
        Verdict.REPRODUCED if right else Verdict.IN_PART if not any(turns) else Verdict.DIFFERS,
        added["Area 2"],
        "crossings of the negative real axis added below 1 mHz, at (c₁, c₂) = (1, 1 - 10⁻⁶)",
        f"There are now {here.omega.size}: {places}. The first lies to the right of -1 and the "
        "other two to its left, in opposite directions, so -1 is not enclosed "
        f"({', '.join(map(str, turns))} encirclements at (1, 1 - 10⁻⁶), (1, 1) and (1, 1 + "
        f"10⁻⁶)). At (1, 1 + 10⁻⁶) the number of crossings goes from "
        f"{before['Area 1'].omega.size} to {after['Area 1'].omega.size}, at (1, 1) from "
        f"{before['A'].omega.size} to {after['A'].omega.size}.",
    )


@claim(
    "K4",
    place="Eq. (11) and Table II",
    says="The controller has s + z24 in its denominator (the equation) or s + p24 (the table).",
    chapter=CHAPTER,
)
def which_denominator() -> Finding:
    """Run both."""
    table, printed = counts_of("Table II"), counts_of("Eq. (11)")
    root = next(r.rightmost for r in readings() if r[:3] == ("Eq. (11)", False, "A"))
    slip = not any(table.values()) and printed["A"] > 0
    return Finding(
        Verdict.NOT_AS_WRITTEN if slip else Verdict.OPEN,
        printed["A"],
        "unstable roots at (1, 1) with the denominator that Eq. (11) prints",
        "As printed, s + z24 cancels the last zero, and p24 of Table II is not used. The loop "
        f"then has {printed['Area 2']}, {printed['A']} and {printed['Area 1']} unstable roots "
        "at (c₁, c₂) = (1, 1 - 10⁻⁶), (1, 1) and (1, 1 + 10⁻⁶); the rightmost at (1, 1) is "
        f"{root.real:.3g} ± {abs(root.imag):.3g}j rad/s. With p24 they are "
        f"{table['Area 2']}, {table['A']} and {table['Area 1']}. The equation has a misprint; "
        "all other claims on the controller are checked with p24.",
    )


@claim(
    "K5",
    place="Sec. IV.B, below Eq. (11)",
    says="The controlled loop is stable for every perturbation of c₁ and c₂ within ±10⁻⁶.",
    chapter=CHAPTER,
)
def stable_over_the_box() -> Finding:
    """Chart the box, find the largest stable square, and the margins at the worst corner."""
    box = chart(PERTURBATION, 101)
    bad = int((~box.stable).sum())
    limit = box_limit()
    c1, c2, modulus = worst_in_box()
    left = all_margins(WORST_CORNER)
    half = paper_loop(difference=0.5 * (TAU1 - TAU2))
    halved = critical_perturbation(half, (1.0, -1.0))
    printed, integrating = counts_of("Eq. (11)"), counts_of("Table II", actuator=True)
    corner = highest_corner() / TURN
    holds = bad == 0 and limit > PERTURBATION
    always = halved > PERTURBATION and not any((*printed.values(), *integrating.values()))
    in_part = Verdict.IN_PART if holds else Verdict.DIFFERS
    return Finding(
        Verdict.REPRODUCED if holds and always else in_part,
        limit,
        "half-width of the largest square around (1, 1) in which the loop is stable, for "
        "constant c₁, c₂, in the one reading of the paper in which it holds",
        "It holds for the controller of Table II, without the actuator 1/s, and with Δτ = τ₁ "
        f"- τ₂ in the dual sensor: all {box.x.size} x {box.y.size} points of a grid over the "
        "square are stable, and the first perturbation along (1, -1) that breaks the loop is "
        f"{limit / PERTURBATION:.3f} times the square's corner. The worst point is (1 "
        f"{c1 - 1.0:+.0e}, 1 {c2 - 1.0:+.0e}): the open loop L comes as near to -1 as "
        f"{modulus:.3f} there, over all frequencies, against {modulus_margin(LOOP):.3f} at "
        f"(1, 1); the phase margin is {np.degrees(left.phase):.1f} degrees, and the gain may "
        f"change by factors from {left.gain_lower:.3f} to {left.gain_upper:.3f}. It does not "
        "hold with half of τ₁ - τ₂ in the sensor, the Δτ of the source of Table I, where the "
        f"limit is {halved:.3g}; nor with the actuator, as Sec. III.B has the loop "
        f"({integrating['Area 2']} unstable root at (1, 1 - 10⁻⁶)); nor with the denominator "
        f"that Eq. (11) prints ({printed['A']} at (1, 1)); nor if the sensor's corner "
        f"frequency p, which the paper does not give, exceeds 2π · {corner:.2f} rad/s.",
    )


@claim(
    "K6",
    place="Sec. IV.B, below Eq. (11)",
    says="The open loop's gain |L| is virtually constant from 0.01 mHz to 1 Hz.",
    chapter=CHAPTER,
)
def constant_gain() -> Finding:
    """Compute the range of |L| over the band, and over the science band."""
    low, high = extremes(FLAT_BAND)
    low_science, high_science = extremes(SCIENCE_BAND)
    spread = high / low
    return Finding(
        Verdict.REPRODUCED if spread < 2.0 else Verdict.DIFFERS,
        spread,
        "largest over smallest |L| from 0.01 mHz to 1 Hz at c₁ = c₂ = 1",
        f"|L| rises from {low:.3g} at 0.01 mHz over {abs(response(np.array([1e-4]))[0]):.3g} "
        f"at 0.1 mHz to {abs(response(np.array([1e-3]))[0]):.4g} at 1 mHz; from there to 1 Hz "
        f"it lies between {low_science:.4g} and {high_science:.4g}, a factor "
        f"{high_science / low_science:.2g}, without nulls: where the sum of the arms has one, "
        "the integrated difference fills it. Constant within that factor holds from about 1 "
        "mHz, two decades later than stated.",
    )


@claim(
    "K7",
    place="Caption of Fig. 9",
    says="Points of Area 1 and of Area 2 are shown, with coordinates.",
    chapter=CHAPTER,
)
def same_point_twice() -> Finding:
    """Count unstable roots of the uncontrolled dual arm on both sides of the ideal point."""
    from armlock.loops import DualArm

    sides = unstable_roots(DualArm(), 1.0, np.array([1.0 - PERTURBATION, 1.0 + PERTURBATION]))
    distinct = sides[0] > 0 and sides[1] == 0
    return Finding(
        Verdict.NOT_AS_WRITTEN if distinct else Verdict.OPEN,
        float(sides[0]),
        "unstable roots of the uncontrolled dual arm (g = 10) at (c₁, c₂) = (1, 1 - 10⁻⁶)",
        "The caption gives (1, 1 - 10⁻⁶) for both areas of the paper's Fig. 5. That point lies "
        f"in the unstable Area 2; its mirror image (1, 1 + 10⁻⁶) has {sides[1]} unstable roots "
        "and lies in the stable Area 1, and is what we take for it.",
    )


@claim(
    "K8",
    place="Sec. IV.B, first paragraph",
    says="The controller acts mainly below 0.1 mHz, so that it does not touch the science band "
    "from 1 mHz to 1 Hz.",
    chapter=CHAPTER,
)
def acts_below() -> Finding:
    """Compare C(s) with its gain at 0.1 mHz and in the science band."""
    edge, science = shape(1e-4), shape(1e-3)
    frequency = np.geomspace(1e-5, 1.0, 100_001)
    off = np.abs(table_two()(1j * TURN * frequency) / CONTROLLER_GAIN - 1.0)
    settled = float(frequency[np.flatnonzero(off > 0.5)[-1]])
    if abs(edge - 1.0) < 0.2:
        verdict = Verdict.REPRODUCED
    else:
        verdict = Verdict.IN_PART if abs(abs(science) - 1.0) < 0.1 else Verdict.DIFFERS
    return Finding(
        verdict,
        abs(edge),
        "gain |C| of the controller at 0.1 mHz, relative to its gain g at high frequency",
        f"There the controller still takes away {100 * (1 - abs(edge)):.0f} % of the gain and "
        f"turns the phase by {np.degrees(np.angle(edge)):.0f} degrees; C comes within one half "
        f"of g at {settled * 1e3:.2f} mHz only. In the science band its gain is indeed g: "
        f"{100 * (1 - abs(science)):.1f} % are missing at 1 mHz, with "
        f"{np.degrees(np.angle(science)):.0f} degrees of lead.",
    )


@claim(
    "K9",
    place="Sec. IV.B, Stage I; Table II",
    says="The poles of the high-pass filters (Stage I of the controller) lie below 0.1 mHz.",
    chapter=CHAPTER,
)
def poles_below() -> Finding:
    """Read them off Table II."""
    stage1 = TABLE_2_STAGE_1_POLE / TURN
    stage2 = np.array(TABLE_2_POLES) / TURN
    high = stage2[stage2 > 1e-4]
    return Finding(
        Verdict.REPRODUCED if stage1 < 1e-4 else Verdict.DIFFERS,
        stage1,
        "frequency in Hz of the double pole of Stage I",
        "True of the two high-pass filters, of which the paper says it. Of the four poles of "
        f"Stage II, {high.size} lies above 0.1 mHz: p23 = 2π · {high.max():.0e} rad/s.",
    )


@claim(
    "K10",
    place="Sec. IV.B, Stage II",
    says="With the lead compensators, the phase at the unity-gain frequency stays below π.",
    chapter=CHAPTER,
)
def phase_at_unity_gain() -> Finding:
    """Find that frequency at each perturbation, and the phase lead there."""

    def shown(c2: float) -> str:
        return f"c₂ = 1 {'-' if c2 < 1.0 else '+'} 10⁻⁶" if c2 != 1.0 else "c₂ = 1"

    found = {point: unity_gain(point) for point in POINTS}
    lead = {point: phase for point, (_, phase) in found.items()}
    worst = max(lead.values())
    right = min(lead.values()) > 0.0 and worst < np.pi
    return Finding(
        Verdict.REPRODUCED if right else Verdict.DIFFERS,
        worst / np.pi,
        "largest phase lead at the unity-gain frequency, over π",
        "With c₁ = 1 the lead is "
        + ", ".join(
            f"{phase / np.pi:.3f} π at {at * 1e6:.2f} µHz for {shown(c[1])}"
            for (at, phase), c in zip(found.values(), POINTS.values(), strict=True)
        )
        + ". Below π means a phase margin of "
        + ", ".join(f"{180 - np.degrees(phase):.0f}" for phase in lead.values())
        + " degrees; at (1 + 10⁻⁶, 1 - 10⁻⁶), the worst of the perturbations considered, "
        f"{np.degrees(all_margins(WORST_CORNER).phase):.0f} remain. It decides nothing alone: "
        "where the gain exceeds one, the Nyquist curve crosses the negative real axis twice "
        "more, and lowering the gain can break the loop as well as raising it.",
    )


@claim(
    "K11",
    place="Sec. IV.B, first paragraph",
    says="A gain of g = 5000 meets the basic requirement on noise suppression.",
    chapter=CHAPTER,
)
def basic_requirement() -> Finding:
    """Compute |1 + L|, and hold the residual noise against an assumed requirement."""
    frequency = _dense(SUPPRESSION_BAND)
    low, high = SUPPRESSION_BAND
    divided = suppression(frequency)
    spare = noise_to_spare(frequency)
    k = int(spare.argmin())
    science = suppression(_dense(SCIENCE_BAND))
    return Finding(
        Verdict.OPEN,
        float(divided.min()),
        f"smallest noise suppression |1 + L|, with the open loop L, from {1e3 * low:g} mHz to "
        f"{high:g} Hz, at c₁ = c₂ = 1",
        "The paper names no requirement. In that band, which is the one of its simulation, the "
        f"loop divides the laser's noise by at least {divided.min():.4g} (at "
        f"{frequency[divided.argmin()] * 1e3:.2g} mHz), from 1 mHz on by at least "
        f"{science.min():.4g}. In the same band we hold it against 30 √(1 + (2.8 mHz / f)⁴) "
        "Hz/√Hz: the level is that of a pre-stabilised laser of LISA, the corner that of Eq. "
        "(A5), and both are an assumption. The free-running 30/f Hz/√Hz is suppressed with "
        f"{spare[k]:.3g} times to spare, the least at {frequency[k] * 1e3:.2g} mHz. About g = "
        f"{CONTROLLER_GAIN / spare[k]:.0f} would do for that, but not for stability, which at "
        "(1, 1) is lost below g = "
        f"{CONTROLLER_GAIN * all_margins(POINTS['A']).gain_lower:.0f}.",
    )


@claim(
    "K12",
    place="Introduction and Sec. V",
    says="The controller makes the loop robust, with margin for what the modules around it do.",
    chapter=CHAPTER,
)
def robust() -> Finding:
    """Take every margin, that against further delay included."""
    nominal = all_margins(POINTS["A"])
    delays = (1e-6, 5e-3)
    roots = [delayed_root(delay) for delay in delays]
    chain = critical_perturbation(LOOP, (1.0, 1.0))
    fragile = nominal.delay == 0.0 and min(root.real for root in roots) > 0.0
    return Finding(
        Verdict.IN_PART if fragile else Verdict.REPRODUCED,
        nominal.delay,
        "delay margin in s at c₁ = c₂ = 1: the further loop delay that the loop tolerates",
        "Against perturbations of c₁ and c₂ it is, in the reading of claim K5, and at (1, 1) "
        f"the gain may change by factors from {nominal.gain_lower:.3f} to "
        f"{nominal.gain_upper:.2f}. But the open loop does not roll off, the loop is of "
        "neutral type, and any further delay, however small, turns its phase by π at some "
        f"high frequency and destabilises it. A delay of {delays[0] * 1e6:g} µs puts a root "
        f"at {roots[0].real:.3g} + {roots[0].imag:.4g}j rad/s, one of {delays[1] * 1e3:g} ms "
        f"(a sample at 200 Hz) at {roots[1].real:.3g} + {roots[1].imag:.4g}j; the growth is "
        f"slow, by a factor e in {1 / roots[1].real / 86400:.2f} days. A real actuator rolls "
        "off, and has to be part of the model. In the same way the chain of roots at high "
        f"frequency needs c₁ + c₂ < 2 + 1/g: both may rise by {chain:.4g} only.",
    )


@claim(
    "K13",
    place="Sec. IV.B, Eq. (11) with Sec. III.B",
    says="The controlled open loop is C(s) P_d(s), with the controller C and the dual arm's "
    "P_d of Sec. III.B.",
    chapter=CHAPTER,
)
def which_open_loop() -> Finding:
    """Put the actuator's 1/s of Sec. III into the loop, and leave it out."""
    bare, integrating = counts_of("Table II"), counts_of("Table II", actuator=True)
    root = next(r.rightmost for r in readings() if r[:3] == ("Table II", True, "Area 2"))
    slip = not any(bare.values()) and any(integrating.values())
    return Finding(
        Verdict.NOT_AS_WRITTEN if slip else Verdict.OPEN,
        integrating["Area 2"],
        "unstable roots at (c₁, c₂) = (1, 1 - 10⁻⁶) with P_d as in Sec. III.B",
        "There P_d contains the gain and the integrating actuator, g/s. With the 1/s in it "
        f"the controlled loop has {integrating['Area 2']}, {integrating['A']} and "
        f"{integrating['Area 1']} unstable roots at (1, 1 - 10⁻⁶), (1, 1) and (1, 1 + 10⁻⁶), "
        f"the rightmost at {root.real:.3g} rad/s; with the dual sensor of Table I alone, "
        f"{bare['Area 2']}, {bare['A']} and {bare['Area 1']}. The O(1/s²) of Sec. IV.A has "
        "the 1/s in it, and two high-pass filters would make a constant of it; the O(-s) that "
        "the paper finds after Stage I (claim K1) and stability (claim K5) both need the loop "
        "without.",
    )
