"""What the paper leaves open, the value taken, and how much of the results depends on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from armlock.checks import FloatArray
from armlock.controllers import table_two
from armlock.loops import Loop, paper_loop
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
from armlock.robustness.margins import critical_perturbation, modulus_margin
from armlock.stability.counts import unstable_roots
from armlock.stability.roots import rightmost_root
from armlock.timedomain.noise import LaserNoise, band_rms
from armlock.timedomain.simulation import sampled_open_loop
from book.companion.claims.controller import (
    SUPPRESSION_BAND,
    highest_stable_corner,
    noise_to_spare,
    suppression,
)
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
from book.companion.shared import shared

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


@shared
def over_corners(points: int = 31) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Follow the controlled loop over two decades of p, for both meanings of dtau.

    Parameters
    ----------
    points : int, optional
        Number of corner frequencies on a logarithmic grid; more are put where the loop is
        about to become unstable.

    Returns
    -------
    corners : float array, shape (n,)
        Corner frequency p in rad/s, rising.
    columns : dict of str to float array
        For "full" and "half": critical perturbation along (1, -1), 0 where the loop is
        unstable at (1, 1); under "full margin" and "half margin" min |1 + L|, nan there.
    """
    grid = DUAL_SENSOR_CORNER * np.logspace(-1.0, 1.0, points)
    close = 1.0 - np.append(np.linspace(0.24, 0.02, 12), [1e-3, -1e-3])
    near = [highest_stable_corner(difference) * close for difference in DIFFERENCES.values()]
    corners = np.unique(np.concatenate((grid, *near)))
    columns: dict[str, FloatArray] = {}
    for name, difference in DIFFERENCES.items():
        loops = [paper_loop(float(p), difference=difference) for p in corners]
        breaks = [break_along(loop) for loop in loops]
        left = [
            modulus_margin(k) if at else np.nan for k, at in zip(loops, breaks, strict=True)
        ]
        columns |= {name: np.array(breaks), f"{name} margin": np.array(left)}
    return corners, columns


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
    half = highest_stable_corner(DIFFERENCES["half"])
    return Assumption(
        "p, the corner frequency of the dual sensor",
        f"{DUAL_SENSOR_CORNER:.4g} rad/s ({DUAL_SENSOR_CORNER / (2 * np.pi):.2g} Hz)",
        "The paper gives none. It is the default of the public code quickTDI (module TJ_lock), "
        "with arms of this length. Verdicts name the range of p for which they stand.",
        f"The critical perturbation along $(1, -1)$ is {here:.4g}, and with a tenth of p "
        f"it is {tenth:.4g}. But from $p = {limit:.3g}$ rad/s on the loop is unstable without "
        f"any perturbation, and with half of Δτ from {half:.3g} rad/s on.",
    )


@assumption
def _difference() -> Assumption:
    full, half = (break_along(paper_loop(difference=d)) for d in DIFFERENCES.values())
    return Assumption(
        "Δτ in the dual sensor",
        f"$τ₁ - τ₂ = {DIFFERENCES['full']:.2g}$ s in the loop",
        "Sec. III.B defines it so. Table I is right only with half of it (claims T2 and T3).",
        f"The critical perturbation along $(1, -1)$ is {full:.4g} with the whole difference "
        f"and {half:.4g} with half of it, which is inside the $±{PERTURBATION:g}$ of the "
        "paper.",
    )


@assumption
def _actuator() -> Assumption:
    return Assumption(
        "The integrating actuator $1/s$ in the controlled loop",
        "Absent in Sec. IV, present in Secs. II and III",
        "What the paper says of its controller fits only a loop without it.",
        "With it the controlled loop is unstable at the point that the paper simulates (claim "
        "K13).",
    )


@assumption
def _denominator() -> Assumption:
    return Assumption(
        "The last factor of the controller's denominator",
        "$s + p₂₄$, from Table II",
        "Eq. (11) prints $s + z₂₄$, which cancels a zero and leaves $p₂₄$ without use.",
        "With $s + z₂₄$ the loop is unstable at (1, 1) (claim K4).",
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
def _order() -> Assumption:
    return Assumption(
        "Which arm is the longer",
        f"Arm 1: $τ₁ = {TAU1}$ s, $τ₂ = {TAU2}$ s",
        "The example and Fig. 4 have it so; the text of Sec. III.A says $τ₁ < τ₂$ (claim C4).",
        "Exchanging the arms exchanges $c₁$ and $c₂$. The box of perturbations is "
        "symmetric, and the verdict on it the same.",
    )


@assumption
def _history() -> Assumption:
    days = -1.0 / rightmost_root(paper_loop(), 1.0, 1.0 - PERTURBATION).real / 86400.0
    return Assumption(
        "What the loop was doing before $t = 0$",
        "At rest: all signals zero",
        "The paper says nothing. It is what a simulation in blocks starts from by default.",
        "The loop is linear: another history adds a transient that dies away by itself. Its "
        f"slowest part falls by a factor e in {days:.3g} days at $(1, 1 - 10⁻⁶)$, against the "
        f"{DURATION / 86400.0:.3g} days of the paper's simulation. So the choice shows in any "
        "long-term difference, and decides no claim on stability.",
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
        f"leave the stable region for a time ($c₁ - c₂$ above {stable_up_to():.3g}); reduced "
        f"to a third of it, {100 * leaving_probability(1.0 / 3.0):.1f} %. Claims M2 to M4 "
        "stay open for it.",
    )


@assumption
def _lowest() -> Assumption:
    total, later, latest, earlier = (
        band_rms(low, 0.5 * SAMPLE_RATE) for low in (LOWEST, 1e-4, 1e-3, 0.1 * LOWEST)
    )
    return Assumption(
        "Where the spectrum of η(t) ends at low frequency",
        f"At {LOWEST:g} Hz, one over the duration; flat below",
        "The printed spectrum rises as $1/f^2$ without end. A run cannot hold slower parts.",
        f"The slowest parts are nearly all of it: the r.m.s. is {total:.2g}, {later:.2g} from "
        f"0.1 mHz on, {latest:.2g} from 1 mHz on, and {earlier:.2g} if it ended ten times "
        "lower. At face value the end decides whether System 1 is lost (claim M2).",
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
        f"Of {DRAWS} other draws of System 1, {100 * growing_probability():.1f} % stay outside "
        "the stable region for long enough to grow by a factor e.",
    )


@assumption
def _requirement() -> Assumption:
    frequency = np.geomspace(*SUPPRESSION_BAND, 20_001)
    spare = float(np.min(noise_to_spare(frequency)))
    free = spare * LASER_NOISE / FREE_RUNNING
    return Assumption(
        "The basic noise requirement that $g = 5000$ meets",
        r"$30\sqrt{1 + (2.8\ \mathrm{mHz}/f)^4}$ Hz/√Hz for the locked laser",
        "The paper names none. Missions of this kind ask about that of a laser before "
        "time-delay interferometry.",
        f"The paper's $30/f$ Hz/√Hz meets it {spare:.3g} times over. A free-running laser of "
        f"${FREE_RUNNING:g}/f$ Hz/√Hz would have {free:.2g} times what it needs, and so miss "
        "it.",
    )


@assumption
def _rule() -> Assumption:
    frequency = np.geomspace(*SUPPRESSION_BAND, 20_001)
    omega = 2.0 * np.pi * frequency
    sampled = np.abs(1.0 + sampled_open_loop(paper_loop(), omega, sample_rate=SAMPLE_RATE))
    change = float(np.max(np.abs(sampled / suppression(frequency) - 1.0)))
    return Assumption(
        "How the loop is made discrete",
        f"By the trapezoidal rule at {SAMPLE_RATE:g} Hz; delays exact, in whole samples",
        "The paper names a program, but no rule. This one keeps a stable loop stable.",
        f"From {1e3 * SUPPRESSION_BAND[0]:g} mHz to {SUPPRESSION_BAND[1]:g} Hz the sampled "
        f"loop's $|1 + L|$ is within {100 * change:.2g} % of the exact one, far less than what "
        "a run of this length can tell.",
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
