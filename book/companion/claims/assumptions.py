"""What the paper leaves open, the value taken, and how much of the results depends on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from armlock.checks import FloatArray
from armlock.controllers import table_two
from armlock.loops import Loop, flight_loop, paper_loop
from armlock.paper import (
    CONTROLLER_GAIN,
    DUAL_SENSOR_CORNER,
    DURATION,
    LASER_NOISE,
    PERTURBATION,
    SAMPLE_RATE,
    TAU1,
    TAU2,
)
from armlock.robustness import critical_perturbation
from armlock.stability.counts import unstable_roots
from armlock.stability.roots import rightmost_root
from armlock.timedomain.noise import LaserNoise, PerturbationNoise
from armlock.timedomain.simulation import sampled_open_loop
from book.companion.claims import flight
from book.companion.claims.controller import (
    SUPPRESSION_BAND,
    highest_stable_corner,
    noise_to_spare,
    suppression,
)
from book.companion.claims.dual_arm import largest_p
from book.companion.claims.ledger import typeset
from book.companion.claims.simulation import (
    DRAWS,
    FREE_RUNNING,
    LOWEST,
    PERTURBATION_SEEDS,
    face_value_rms,
    growing_probability,
    leaving_probability,
    stable_up_to,
)
from book.companion.extremes import largest, smallest

#: The two meanings of dtau, in s: Sec. III.B and the source of Table I.
DIFFERENCES = {"full": TAU1 - TAU2, "half": 0.5 * (TAU1 - TAU2)}


def break_along(loop: Loop, direction: tuple[float, float] = (1.0, -1.0)) -> float:
    """Smallest perturbation of (1, 1) along a direction that makes a loop unstable.

    Returns
    -------
    float
        0 if the loop is unstable at (1, 1) itself.

    Examples
    --------
    >>> from armlock import paper_loop
    >>> from book.companion.claims.assumptions import break_along
    >>> print(f"{break_along(paper_loop()):.4g}")
    1.464e-06
    """
    if unstable_roots(loop, 1.0, 1.0):
        return 0.0
    return critical_perturbation(loop, direction)


class Assumption(NamedTuple):
    """Something the paper leaves open.

    Attributes
    ----------
    name : str
        What it is.
    taken : str
        The value or convention of this book.
    why : str
        Its reason.
    sensitivity : str
        What another choice would change; numbers in it are computed.
    """

    name: str
    taken: str
    why: str
    sensitivity: str


_MAKERS: list[Callable[[], Assumption]] = []


def assumption(make: Callable[[], Assumption]) -> Callable[[], Assumption]:
    """Put the decorated function's assumption on the page, in the order of this file."""
    _MAKERS.append(make)
    return make


@assumption
def _corner() -> Assumption:
    here, limit = break_along(paper_loop()), highest_stable_corner()
    tenth = break_along(paper_loop(0.1 * DUAL_SENSOR_CORNER))
    half, wide = highest_stable_corner(DIFFERENCES["half"]), largest_p()
    return Assumption(
        "p, the corner frequency of the dual sensor",
        f"{DUAL_SENSOR_CORNER:.4g} rad/s ({DUAL_SENSOR_CORNER / (2 * np.pi):.2g} Hz)",
        "The paper gives no value. Ours is the default of the public code quickTDI (module "
        "TJ_lock) for arms of this length.",
        f"The critical perturbation along $(1, -1)$ is {here:.4g}, and with a tenth of p "
        f"it is {tenth:.4g}. Above $p = {limit:.3g}$ rad/s the loop is unstable without any "
        f"perturbation, and with half of Δτ above {half:.3g} rad/s. A dual arm with the "
        f"actuator and a gain of 5000 rad/s reaches (1, 1) only for p below {wide:.3g} rad/s.",
    )


@assumption
def _difference() -> Assumption:
    full, half = (break_along(paper_loop(difference=d)) for d in DIFFERENCES.values())
    return Assumption(
        "Δτ in the dual sensor",
        f"$τ₁ - τ₂ = {DIFFERENCES['full']:.2g}$ s in the loop",
        "Sec. III.B defines this difference. Table I is right only with half of it (claims T2 "
        "and T3).",
        f"The critical perturbation along $(1, -1)$ is {full:.4g} with the whole difference "
        f"and {half:.4g} with half of it. The latter is inside the $±{PERTURBATION:g}$ of the "
        "paper.",
    )


@assumption
def _gain() -> Assumption:
    here, higher = (
        break_along(paper_loop(controller=table_two(factor * CONTROLLER_GAIN)))
        for factor in (1.0, 2.0 * np.pi)
    )
    return Assumption(
        "The unit of g",
        "rad/s with the actuator, a plain number without it",
        "The paper gives a number without unit; $g/s$ is a rate over s in rad/s.",
        r"Were it in Hz, g would be $2\pi$ times larger: the critical perturbation "
        f"along $(1, -1)$ would be {higher:.4g}, not {here:.4g}.",
    )


@assumption
def _history() -> Assumption:
    days = -1.0 / rightmost_root(paper_loop(), 1.0, 1.0 - PERTURBATION).real / 86400.0
    return Assumption(
        "What the loop was doing before $t = 0$",
        "At rest: all signals zero",
        "The paper does not say. A simulation in blocks starts at rest by default.",
        "The loop is linear, so that another history adds a transient. The slowest part of the "
        f"transient falls by a factor e in {days:.3g} days at $(1, 1 - 10⁻⁶)$. The paper's "
        f"simulation takes {DURATION / 86400.0:.3g} days. The choice therefore changes "
        "long-term differences, and no claim on stability depends on it.",
    )


@assumption
def _scale() -> Assumption:
    rms = face_value_rms()
    return Assumption(
        "The scale of η(t)",
        "Both: the appendix's spectrum at face value, and reduced to an r.m.s. of "
        f"{PERTURBATION:g} (System 1)",
        f"The appendix takes a phase noise for η; Sec. IV.A limits η to {PERTURBATION:g}, and "
        "does not say whether that is an r.m.s. or a bound.",
        f"The printed spectrum has an r.m.s. of {rms:.3g}, {rms / PERTURBATION:.3g} times the "
        f"limit. Of random courses reduced to the limit, {100 * leaving_probability():.0f} % "
        f"leave the stable region for a time ($c₁ - c₂$ above {stable_up_to():.3g}). Of those "
        f"reduced to a third of the limit, {100 * leaving_probability(1.0 / 3.0):.1f} % do. "
        "Claims N1 and M2 to M5 cannot be settled without the scale.",
    )


@assumption
def _lowest() -> Assumption:
    total, later, latest, earlier = (
        PerturbationNoise(0, SAMPLE_RATE, cutoff=end).rms
        for end in (LOWEST, 1e-4, 1e-3, 0.1 * LOWEST)
    )
    return Assumption(
        "Where the spectrum of η(t) ends at low frequency",
        f"At {LOWEST:g} Hz, one over the duration; flat below",
        "The printed spectrum rises as $1/f^2$ without end. A run cannot hold slower parts.",
        f"The slowest parts are nearly all of it: the r.m.s. is {total:.2g}. It would be "
        f"{later:.2g} if the spectrum were flat below 0.1 mHz, {latest:.2g} for 1 mHz, and "
        f"{earlier:.2g} for {0.1 * LOWEST:g} Hz. At face value the end decides whether "
        "System 1 diverges (claim M2).",
    )


@assumption
def _laser() -> Assumption:
    cutoff = LaserNoise(0).cutoff
    low = SUPPRESSION_BAND[0]
    change = 1.0 - 1.0 / np.sqrt(1.0 + (cutoff / low) ** 2)
    return Assumption(
        "Where the laser's $30/f$ spectrum ends at low frequency",
        f"At {cutoff:g} Hz; flat below",
        "$1/f$ has an infinite variance. The end lies below all that a run of "
        f"{DURATION / 86400.0:.2g} days resolves.",
        f"At {1e3 * low:g} mHz, where the suppression is measured from, the density is lower "
        f"by {change:.1g} of itself. The slow wandering of input and outputs in the time "
        r"series grows as one over the root of the cut-off: $\sqrt{10}$ times larger for one "
        "ten times lower.",
    )


@assumption
def _seeds() -> Assumption:
    return Assumption(
        "The random numbers of the simulation",
        f"One draw, with seeds {PERTURBATION_SEEDS[0]} and {PERTURBATION_SEEDS[1]} for $c₁$, "
        "$c₂$",
        "The paper shows one draw and gives no seed.",
        f"Of {DRAWS} other draws of System 1, {100 * growing_probability():.2f} % stay outside "
        "the stable region for long enough to grow by a factor e.",
    )


@assumption
def _requirement() -> Assumption:
    frequency = np.geomspace(*SUPPRESSION_BAND, 20_001)
    spare = smallest(noise_to_spare, frequency).value
    free = spare * LASER_NOISE / FREE_RUNNING
    return Assumption(
        "The basic noise requirement that $g = 5000$ meets",
        r"$30\sqrt{1 + (2.8\ \mathrm{mHz}/f)^4}$ Hz/√Hz for the locked laser",
        "The paper names no requirement. Missions of this kind require about this of a laser "
        "before time-delay interferometry.",
        f"The paper's $30/f$ Hz/√Hz meets this requirement {spare:.3g} times over. A "
        f"free-running laser of ${FREE_RUNNING:g}/f$ Hz/√Hz would meet it {free:.2g} times, "
        "and so would miss it.",
    )


@assumption
def _rule() -> Assumption:
    frequency = np.geomspace(*SUPPRESSION_BAND, 20_001)

    def off(f: FloatArray) -> FloatArray:
        omega = 2.0 * np.pi * np.asarray(f)
        sampled = np.abs(1.0 + sampled_open_loop(paper_loop(), omega, sample_rate=SAMPLE_RATE))
        return np.asarray(np.abs(sampled / suppression(f) - 1.0))

    change = largest(off, frequency).value
    return Assumption(
        "How the loop is made discrete",
        f"By the trapezoidal rule at {SAMPLE_RATE:g} Hz; delays exact, in whole samples",
        "The paper names a program and no rule. The trapezoidal rule keeps a stable loop "
        "stable.",
        f"From {1e3 * SUPPRESSION_BAND[0]:g} mHz to {SUPPRESSION_BAND[1]:g} Hz the sampled "
        f"loop's $|1 + L|$ differs from the exact one by at most {100 * change:.2g} %. A run "
        "of this length cannot resolve this difference.",
    )


@assumption
def _flight_sensor() -> Assumption:
    low = 1e6 * flight.lower_unity_gain(flight.LOOP)
    wide = flight.uniform(flight_loop(flight.MEAN_DELAY, corner=2.0 * DUAL_SENSOR_CORNER))
    return Assumption(
        "The gain g₂ of the white paper's controller, and the corner of its sensor E(s)",
        "g₂ = 40, and the corner of the paper's dual sensor, 0.4 Hz",
        f"With g₂ = 40 the lower unity-gain frequency is {low:.2f} µHz, as printed. The corner "
        "is the default of a public program (see p).",
        "The gain at 3 mHz and the upper unity-gain frequency rise with g₂, and agree with the "
        "printed numbers (claims W1 and W2). With twice the corner the smallest phase "
        f"margin is {np.degrees(wide.phase):.1f} degrees (claim W3).",
    )


@assumption
def _flight_arms() -> Assumption:
    others = (flight.MEAN_DELAY, *flight.OTHER_DELAYS)
    found = [flight.uniform(flight_loop(delay)) for delay in others]
    degrees = ", ".join(f"{np.degrees(one.phase):.2f}" for one in found)
    peaks = ", ".join(f"{1.0 / one.modulus:.3f}" for one in found)
    return Assumption(
        "The mean round trip of the white paper's arms",
        f"$2L/c = {flight.MEAN_DELAY:.3f}$ s, from its $L = 5·10⁹$ m",
        "The white paper prints the length, and filters in units of the round trip.",
        f"With {others[0]:.3f}, {others[1]:g} and {others[2]:g} s the smallest phase margin is "
        f"{degrees} degrees, and the largest amplification {peaks}. Only the first is within "
        "the limits of claims W3 and W4.",
    )


@assumption
def _free_phases() -> Assumption:
    later, sooner = (
        np.degrees(flight.uniform(flight.LOOP, start).phase) for start in (10.0, 2.0)
    )
    return Assumption(
        "The frequency above which the phases of the white paper's arms are arbitrary",
        f"{flight.FREE_FROM:g} Hz",
        "The round trips come to differ by up to 0.51 s over the year, five turns at 10 Hz. "
        "The source takes the arms as they are.",
        f"The smallest phase margin is {later:.2f} degrees. With phases that are arbitrary "
        f"above 2 Hz it is {sooner:.2f}, below the 30 degrees of claim W3.",
    )


class Assumptions:
    """All assumptions, computed once, as blocks of text."""

    def __init__(self) -> None:
        self.entries = [make() for make in _MAKERS]

    def __repr__(self) -> str:
        """Return them as text."""
        return "\n".join(f"{e.name}: {e.taken}. {e.sensitivity}" for e in self.entries)

    def _repr_html_(self) -> str:
        """Return a definition list an assumption."""
        return "".join(
            f'<section class="erratum"><p><strong>{typeset(entry.name)}</strong></p><dl>'
            f"<dt>Taken</dt><dd>{typeset(entry.taken)}</dd>"
            f"<dt>Why</dt><dd>{typeset(entry.why)}</dd>"
            f"<dt>What depends on it</dt><dd>{typeset(entry.sensitivity)}</dd></dl></section>"
            for entry in self.entries
        )
