"""Claims of the abstract and of Table I: Z1, T1 to T6."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.constants import speed_of_light

from armlock import sensors
from armlock.checks import FloatArray
from armlock.controllers import Controller
from armlock.dcurve import d_curve_line
from armlock.loops import CommonArm, DualArm, Loop, SingleArm
from armlock.paper import (
    CONTROLLER_GAIN,
    DUAL_ARM_GAIN,
    DUAL_SENSOR_CORNER,
    PERTURBATION,
    TAIJI_ARM_LENGTH,
    TAU1,
    TAU2,
)
from armlock.roots import rightmost_root
from armlock.stability import unstable_roots
from book.companion.claims import ledger
from book.companion.claims.ledger import Finding, Verdict, Weight, decide

claim = partial(ledger.claim, chapter="01_opening")

#: The paper's own difference of the delays (Sec. III.B), and half of it, in s.
FULL_DIFFERENCE = TAU1 - TAU2
HALF_DIFFERENCE = FULL_DIFFERENCE / 2.0
#: Mean of the two round-trip times, in s.
MEAN_DELAY = (TAU1 + TAU2) / 2.0
#: Frequencies at which the rows of Table I are compared, in rad/s: 0.1 mHz to 1 Hz.
OMEGA = 2.0 * np.pi * np.logspace(-4.0, 0.0, 4001)
#: First null of the common arm, in rad/s.
NULL = 2.0 * np.pi / MEAN_DELAY
#: The configurations with integrating actuator, at the gains of the paper's charts.
LOOPS: dict[str, Loop] = {"single": SingleArm(), "common": CommonArm(), "dual": DualArm()}
#: How each leaves its stable region in (c1, c2) when one arm is perturbed.
OUTWARD = {"single": (1.0, 0.0), "common": (0.0, 1.0), "dual": (0.0, -1.0)}

# Agreement to rounding: two orders above the error of one evaluation.
_EXACT = 1e-13


# The ideal point ----------------------------------------------------------------------------


def perturbed(name: str, size: npt.ArrayLike) -> tuple[Any, Any]:
    """Return (c1, c2) at a distance `size` from (1, 1), positive towards instability."""
    size = np.asarray(size)
    return 1.0 + size * OUTWARD[name][0], 1.0 + size * OUTWARD[name][1]


def growth_beside_ideal(name: str, size: npt.ArrayLike) -> FloatArray:
    """Return the real part of the rightmost root, in 1/s, `size` away from (1, 1)."""
    return np.real(np.asarray(rightmost_root(LOOPS[name], *perturbed(name, size))))


def _readings(gain: float) -> list[tuple[str, float, Loop]]:
    """Return name, p and loop of the configurations, the dual arm's for each p and dtau."""
    return [
        ("single", 0.0, SingleArm(gain=gain)),
        ("common", 0.0, CommonArm(gain=gain)),
        *(
            ("dual", corner, DualArm(gain, corner=corner, difference=difference))
            for corner in DUAL_SENSOR_CORNER * np.array([0.25, 1.0, 4.0])
            for difference in (FULL_DIFFERENCE, HALF_DIFFERENCE)
        ),
    ]


def _on_edge(name: str, loop: Loop) -> bool:
    """Whether (1, 1) is on the line of s = 0, with a stable side and an unstable one."""
    line = d_curve_line(loop)
    sizes = np.array([-PERTURBATION, 0.0, PERTURBATION])
    inside, edge, outside = unstable_roots(loop, *perturbed(name, sizes))
    on_line = line.weight_x + line.weight_y == line.value
    return bool(on_line and inside == 0 and edge == -1 and outside >= 1)


@claim(
    "Z1",
    place="Sec. I, second contribution; Sec. V",
    says="Without perturbations the single, the common and the dual arm all sit on the "
    "boundary of their stable region, which makes them sensitive to multiplicative "
    "perturbations.",
    pinned=(Verdict.IN_PART, 2.0, 0.0),
)
def ideal_point_on_boundary() -> Finding:
    """Locate (1, 1) against the omega = 0 line, and count the roots on both sides of it."""
    gains = (0.1, 1.0, 10.0, 100.0, CONTROLLER_GAIN)
    tried = [(*reading, gain) for gain in gains for reading in _readings(gain)]
    off = [(name, p, gain) for name, p, loop, gain in tried if not _on_edge(name, loop)]
    names = {name for name, *_ in off}
    # Right of this line only the root at s = 0 is left, and that one 1 + L does not have.
    strip = 1e-5
    right = {int(unstable_roots(loop.shifted(-strip), 1.0, 1.0)) for loop in LOOPS.values()}
    least = min(abs(complex(1.0 + loop.open_loop(1e-8))) for loop in LOOPS.values())
    days = {
        name: 1.0 / float(growth_beside_ideal(name, PERTURBATION)) / 86400.0 for name in LOOPS
    }
    # Without 1/s, single and common arm have nothing but a neutral root chain.
    g, chain = DUAL_ARM_GAIN, DUAL_ARM_GAIN * (2.0 + PERTURBATION) / (1.0 + 2.0 * DUAL_ARM_GAIN)
    plain = Loop(Controller((), (), g), LOOPS["dual"].mapping, TAU1, TAU2)
    lost = int(unstable_roots(plain, *perturbed("dual", PERTURBATION)))
    return Finding(
        decide(names <= {"dual"}, names <= {"single", "common"}),
        len(off),
        f"of {len(tried)} combinations of sensor, gain, p and Δτ, those in which (1, 1) is "
        "not on the edge of the stable region",
        "True of the single and the common arm at every gain tried, from "
        f"{gains[0]:g} to {gains[-1]:g} rad/s: a perturbation of {PERTURBATION:g} to one side "
        "leaves no unstable root, and to the other side one or more. True of the dual arm as "
        f"well, with p = {DUAL_SENSOR_CORNER:.2f} rad/s, our assumption, or four times lower, "
        "and with Δτ the whole or half the difference of the delays. But at the controller's "
        f"gain, g = {_in_words(gain for *_, gain in off)} rad/s, it is not with p = "
        f"{_in_words(p for _, p, _ in off)} rad/s: there (1, 1) is outside (claim D9 has the "
        "limit). On the edge is not the same as sensitive: at the gains of the paper's charts, "
        f"a perturbation of {PERTURBATION:g} grows by a factor e in {days['single']:.0f} days "
        f"(single), {days['common']:.0f} days (common) and {days['dual']:.1f} days (dual). At "
        f"(1, 1) itself D has {_in_words(right)} root right of Re s = -{strip:g}/s, at s = 0; "
        "it comes from clearing the denominator of 1 + L, L being the open loop, and |1 + L| "
        f"at least {least:.2g} there. This is for the integrating actuator of Secs. II and "
        f"III. Without its 1/s, at gain {g:g}, the same perturbation leaves the stable region "
        f"only in the dual arm ({lost} unstable root). The single and the common arm then have "
        "nothing but a neutral root chain, which shrinks in each round trip by a factor of at "
        f"most {chain:.2f}.",
    )


def _in_words(values: Any) -> str:
    """Return the different values of a list, in words."""
    return " or ".join(f"{value:.4g}" for value in sorted(set(values)))


# The rows of Table I ------------------------------------------------------------------------


def printed_common(omega: npt.ArrayLike, difference: float, mean: float) -> Any:
    """Evaluate the second row of Table I as printed, at omega in rad/s."""
    omega = np.asarray(omega)
    return 2.0 * (1.0 - np.cos(difference * omega) * np.exp(-1j * omega * mean))


def printed_difference(omega: npt.ArrayLike, difference: float, mean: float) -> Any:
    """Evaluate the third row of Table I as printed, at omega in rad/s."""
    omega = np.asarray(omega)
    return -2j * np.sin(difference * omega) * np.exp(-1j * omega * mean)


def dual_response(
    omega: npt.ArrayLike, corner: float, difference: float, *, printed: bool = False
) -> Any:
    """Evaluate the fourth row of Table I with the two arms' true sum and difference.

    Parameters
    ----------
    omega : array_like of float
        Frequencies in rad/s.
    corner : float
        The sensor's p.
    difference : float
        The delay difference in the denominator, in s.
    printed : bool, optional
        Take the factor p / (1 + p) of the table for the low-pass p / (s + p).

    Returns
    -------
    complex array, shaped like `omega`
    """
    s = 1j * np.asarray(omega)
    factor = corner / ((1.0 if printed else s) + corner)
    common = sensors.COMMON.response(s, TAU1, TAU2)
    return common - factor / (s * difference) * sensors.DIFFERENCE.response(s, TAU1, TAU2)


def _largest(values: Any) -> float:
    return float(np.abs(values).max())


@claim(
    "T1",
    place="Table I, first row",
    says="The single arm responds with 2i sin(τω) exp(-iωτ).",
    pinned=(Verdict.REPRODUCED, 0.0, 1e-12),
    weight=Weight.DERIVATION,
)
def single_row() -> Finding:
    """Compare with 1 - exp(-s round trip) for both meanings of tau."""
    truth = sensors.SINGLE.response(1j * OMEGA, TAU1, TAU1)
    one_way, round_trip = (
        _largest(2j * np.sin(tau * OMEGA) * np.exp(-1j * OMEGA * tau) - truth)
        for tau in (TAU1 / 2.0, TAU1)
    )
    return Finding(
        decide(one_way < _EXACT),
        one_way,
        "largest deviation from 1 - exp(-iωτ₁), 0.1 mHz to 1 Hz",
        "Exact if the two-index τ of the table is the time for one way. With the round-trip "
        f"time, which τ is in the rest of the paper, it is off by up to {round_trip:.3g}.",
    )


@claim(
    "T2",
    place="Table I, second row",
    says="The common arm responds with 2 (1 - cos(Δτ ω) exp(-iω τ̄)).",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.0, 1e-6),
    affects=("T4", "K5"),
    printed="$P₊(ω) = 2(1 - cos(Δτ ω) e^{-iω\\bar{τ}})$",
    weight=Weight.DERIVATION,
)
def common_row() -> Finding:
    """Compare with 2 - e1 - e2 for both meanings of the difference and of the mean."""
    truth = sensors.COMMON.response(1j * OMEGA, TAU1, TAU2)
    full = _largest(printed_common(OMEGA, FULL_DIFFERENCE, MEAN_DELAY) - truth)
    half = _largest(printed_common(OMEGA, HALF_DIFFERENCE, MEAN_DELAY) - truth)
    one_way = _largest(printed_common(OMEGA, HALF_DIFFERENCE, MEAN_DELAY / 2.0) - truth)
    return Finding(
        decide(full < _EXACT, corrected=half < _EXACT),
        full,
        "largest deviation from 2 - exp(-iωτ₁) - exp(-iωτ₂) up to 1 Hz, with Δτ = τ₁ - τ₂",
        f"Exact (to {half:.1g}) if Δτ is half the difference of the round trips and τ̄ their "
        "mean. The only Δτ the paper defines, in Sec. III.B, is the full difference. With "
        "one-way times throughout, as the first row has them, Δτ is their full difference but "
        f"τ̄ must be their sum: with their mean the deviation is up to {one_way:.3g}.",
    )


@claim(
    "T3",
    place="Table I, third row",
    says="The difference arm responds with -2i sin(Δτ ω) exp(-iω τ̄).",
    pinned=(Verdict.NOT_AS_WRITTEN, 2.0, 1e-6),
    affects=("T2", "T4"),
    weight=Weight.DERIVATION,
    same_as="T2",
)
def difference_row() -> Finding:
    """Compare with both signs of the difference of the arms, for both meanings of dtau."""
    arm2_less_arm1 = sensors.DIFFERENCE.response(1j * OMEGA, TAU1, TAU2)
    half = printed_difference(OMEGA, HALF_DIFFERENCE, MEAN_DELAY)
    full = printed_difference(OMEGA, FULL_DIFFERENCE, MEAN_DELAY)
    exact, opposite = _largest(half - arm2_less_arm1), _largest(half + arm2_less_arm1)
    ratio = float(np.abs(full[0] / arm2_less_arm1[0]))
    return Finding(
        decide(abs(ratio - 1.0) < 1e-6, corrected=exact < _EXACT),
        ratio,
        "printed response over the true one at 0.1 mHz, with Δτ = τ₁ - τ₂",
        "Δτ must be half the difference of the round trips, as in the common arm's row; then "
        f"the row is exact (to {exact:.0e}). It is arm 2 less arm 1, arm 1 being the longer: "
        f"arm 1 less arm 2 has the opposite sign and is up to {opposite:.3g} away.",
    )


@claim(
    "T4",
    place="Table I, fourth row",
    says="The dual arm responds with P₊ - p/(1+p) · 1/(iωΔτ) · P₋, where P₊ and P₋ are the "
    "responses of the common and the difference arm.",
    pinned=(Verdict.NOT_AS_WRITTEN, 0.7210738, 1e-6),
    affects=("Z1", "D1", "D2"),
    weight=Weight.WORDING,
)
def dual_row() -> Finding:
    """Evaluate the sensor at the common arm's first null, where P_- has to fill in."""
    p, hertz = DUAL_SENSOR_CORNER, DUAL_SENSOR_CORNER / (2.0 * np.pi)
    # p in rad/s or in Hz is another response as printed, but the same sensor.
    unit = abs(
        dual_response(NULL, p, HALF_DIFFERENCE, printed=True)
        / dual_response(NULL, hertz, HALF_DIFFERENCE, printed=True)
    )
    once, lower, higher = (
        abs(
            dual_response(NULL, k * p, HALF_DIFFERENCE, printed=True)
            / dual_response(NULL, k * p, HALF_DIFFERENCE)
        )
        for k in (1.0, 0.25, 4.0)
    )
    below = OMEGA[2.0 * np.pi * 0.1 >= OMEGA]
    sizes = [np.abs(dual_response(below, p, d)) for d in (HALF_DIFFERENCE, FULL_DIFFERENCE)]
    flat, uneven = (float(size.max() / size.min()) for size in sizes)
    return Finding(
        decide(abs(unit - 1.0) < 1e-3, corrected=flat < 0.5 * uneven),
        once,
        "printed response over that with the low-pass p/(s+p), at the common arm's null near "
        f"{1e3 / MEAN_DELAY:.0f} mHz",
        f"As printed, p in rad/s is added to a plain number: taking p = {p:.3g} rad/s or its "
        f"{hertz:.1g} Hz changes the sensor there by a factor {unit:.2f}. With the low-pass "
        "p/(s+p) and Δτ half the difference of the round trips, |P| is even to a factor "
        f"{flat:.2f} below 0.1 Hz; with the full difference of Sec. III.B it varies by a "
        f"factor {uneven:.2f}. The paper gives no p, and {hertz:.1g} Hz is our assumption. "
        f"With it the printed response is {once:.2f} of the mended one at that null; with p "
        f"four times lower or higher it would be {lower:.2f} or {higher:.2f}.",
    )


@claim(
    "T5",
    place="Table I, fifth row",
    says="The modified dual arm responds with P₊ H₊ - P₋ H₋, where P₊ and P₋ are the responses "
    "of the common and the difference arm.",
    pinned=(Verdict.OPEN, 2011.602, 1e-3),
    weight=Weight.DERIVATION,
)
def modified_dual_row() -> Finding:
    """Show that the row says nothing before H_+ and H_- are given."""
    common = abs(sensors.COMMON.response(1j * NULL, TAU1, TAU2))
    half, full = (
        float(abs(dual_response(NULL, DUAL_SENSOR_CORNER, difference)) / common)
        for difference in (HALF_DIFFERENCE, FULL_DIFFERENCE)
    )
    return Finding(
        decide(True, settled=abs(half - 1.0) < 1e-6),
        half,
        "ratio of two responses that the row allows, near "
        f"{1e3 / MEAN_DELAY:.0f} mHz, where the common arm is nearly blind",
        "H₊ and H₋ are not given in the paper. (H₊, H₋) = (1, 0) makes the common arm of the "
        "row and (1, p/((s+p) sΔτ)) the dual arm. At that null the two differ by a factor "
        f"{half:.0f} with Δτ half the difference of the round trips, which Table I needs, and "
        f"by {full:.0f} with the whole difference; p = {DUAL_SENSOR_CORNER:.2f} rad/s is our "
        "assumption.",
    )


@claim(
    "T6",
    place="Sec. III.A, example",
    says="Round trips of 20.1 s and 19.9 s are those of Taiji's arms.",
    pinned=(Verdict.REPRODUCED, 0.0691807, 1e-7),
)
def round_trips() -> Finding:
    """Turn the delays into arm lengths."""
    lengths = np.array([TAU1, TAU2]) * speed_of_light / 2.0
    off = 100.0 * (lengths / TAIJI_ARM_LENGTH - 1.0)
    return Finding(
        decide((np.abs(off) < 1.0).all()),
        float(abs(off.mean())),
        "mean arm length against three million kilometres, deviation in %",
        f"Light takes {2.0 * TAIJI_ARM_LENGTH / speed_of_light:.3f} s for a round trip of such "
        f"an arm. The two delays are arms of {lengths[0] / 1e9:.3f} and {lengths[1] / 1e9:.3f} "
        f"million kilometres, {off[0]:+.2f} % and {off[1]:+.2f} % off. As one-way times they "
        "would be arms twice as long.",
    )
