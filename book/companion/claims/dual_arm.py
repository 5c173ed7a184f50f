"""Claims of Sec. III.B, the dual arm, and what the chapter computes with them.

The stable region is a narrow strip along c1 = c2. It is described by the common perturbation
(c1 + c2) / 2 and the difference c2 - c1, in which its area element is that of (c1, c2).
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from scipy.optimize import bisect, brentq, minimize_scalar

from armlock import plotting
from armlock.characteristic import CharacteristicFunction
from armlock.checks import FloatArray
from armlock.loops import DualArm, Loop
from armlock.paper import (
    CONTROLLER_GAIN,
    DUAL_ARM_GAIN,
    DUAL_SENSOR_CORNER,
    PERTURBATION,
    STEP,
    TAU1,
    TAU2,
)
from armlock.robustness import Crossing, first_crossing, margins
from armlock.stability.counts import unstable_roots
from armlock.stability.dcurve import d_curve, d_curve_line
from armlock.stability.semidiscretization import semi_discretization
from book.companion.claims.ledger import PRINTED, Finding, Verdict, Weight, claim
from book.companion.claims.table1 import FULL_DIFFERENCE, HALF_DIFFERENCE, MEAN_DELAY
from book.companion.figures import svg
from book.companion.shared import shared

#: A fixed window around point A, the same in c1 and c2.
WINDOW = (0.9, 1.1)
#: Gains of the sweep in rad/s, six decades.
GAINS = np.logspace(-1.0, 5.0, 61)
#: First frequency in rad/s at which the round trips differ by a whole period, 5 Hz: 100.5 and
#: 99.5 periods. At twice this, 10 Hz, both are whole numbers of periods.
ONE_PERIOD = 2.0 * np.pi / FULL_DIFFERENCE
TWO_PERIODS = 2.0 * ONE_PERIOD
#: Points of the strip on either side of c1 + c2 = 2.
ABOVE = ((1.0, 1.0 + PERTURBATION), (1.001, 1.002), (1.1, 1.105))
BELOW = ((0.999, 1.0), (0.9, 0.905))
#: Point at which the printed open loop is compared with the derived one.
PRINTED_AT = (1.01, 0.98)
# Edges of the stable region -----------------------------------------------------------------


class Edges(NamedTuple):
    """Where the stable strip ends.

    Attributes
    ----------
    corner : float
        c - 1 at the upper end of the straight edge c1 = c2 = c.
    corner_omega : float
        Frequency in rad/s of the root that crosses there.
    width : float
        c2 - c1 at the far edge, where c1 + c2 = 2 WINDOW[0].
    """

    corner: float
    corner_omega: float
    width: float


def upper_end(
    system: CharacteristicFunction, difference: float, low: float = WINDOW[0], sign: float = 1.0
) -> Crossing:
    """Find where the strip ends along a line of constant c2 - c1.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, or its map.
    difference : float
        c2 - c1.
    low : float, optional
        (c1 + c2) / 2 at the start, from which the position is counted.
    sign : float, optional
        1 to go upwards, -1 to go downwards.
    """
    start = (low - 0.5 * difference, low + 0.5 * difference)
    return first_crossing(system, start, (sign, sign), stop=10.0)


def far_edge(loop: Loop, common: float) -> Crossing:
    """Find the far edge at a given (c1 + c2) / 2; its position is c2 - c1."""
    return first_crossing(loop, (common, common), (-0.5, 0.5), stop=1.0)


@shared
def edges(
    gain: float, corner: float = DUAL_SENSOR_CORNER, difference: float | None = None
) -> Edges:
    """Compute the exact edges for one gain, corner frequency and dtau."""
    loop = DualArm(gain, TAU1, TAU2, corner, difference=difference)
    upper, far = upper_end(loop, 0.0, low=0.5), far_edge(loop, WINDOW[0])
    return Edges(upper.position - 0.5, upper.omega, far.position)


@shared
def top_of_strip(gain: float, low: float = WINDOW[0]) -> tuple[FloatArray, FloatArray]:
    """Trace the far and the upper edge of the strip, from c1 + c2 = 2 low up to 2.4.

    The far edge is a piece of the D-curve, along which the frequency falls upwards. So low an
    upper edge is nearly straight: two of its points give it, within the window to 1e-7.

    Returns
    -------
    difference, common : float arrays, shape (n,)
        c2 - c1, ascending from zero, and the (c1 + c2) / 2 up to which the loop is stable.
    """
    loop, highest = DualArm(gain), 1.2
    c1, c2 = d_curve(loop, far_edge(loop, low).omega * np.linspace(0.8, 1.0, 2001))
    difference = np.linspace(0.0, c2[-1] - c1[-1], 10_001)
    common = np.minimum(np.interp(difference, c2 - c1, 0.5 * (c1 + c2)), highest)
    corner, near = 1.0 + edges(gain).corner, 0.1 * difference[-1]
    if corner < highest:
        slope = (low + upper_end(loop, near, low).position - corner) / near
        common = np.minimum(common, corner + slope * difference)
    return difference, common


def window_area(gain: float) -> float:
    """Area of the part of the stable region in which both parameters are in the window.

    It is computed from `top_of_strip`. Many rays confirm it to a part in 1e5, but it is not
    certified.
    """
    difference, top = top_of_strip(gain)
    low, high = WINDOW
    # Both c1 = common - d / 2 and c2 = common + d / 2 are to be inside.
    length = np.minimum(top, high - 0.5 * difference) - (low + 0.5 * difference)
    return float(np.trapezoid(np.clip(length, 0.0, None), difference))


def strip_picture(gain: float) -> bytes:
    """Draw the stable strip in the window around point A, as SVG: one frame of a slider."""
    low, high = WINDOW
    below = low - 0.03  # outside of the window
    difference, common = (values[::100] for values in top_of_strip(gain, below))
    c1, c2 = common - 0.5 * difference, common + 0.5 * difference
    corner = [below]
    fig = Figure(figsize=(5.0, 4.6))
    ax = fig.subplots()
    ax.fill([*corner, *c1], [*corner, *c2], color=plotting.STABLE, label="stable")
    ax.plot(c1, c2, label="far and upper edge")
    ax.plot([below, c1[0]], [below, c2[0]], label="straight edge")
    ax.plot(1, 1, "ko", fillstyle="none", label="A")
    ax.set(xlim=(low, high), ylim=(low, high), xlabel="$c_1$", ylabel="$c_2$")
    ax.legend(loc="lower right")
    return svg(fig)


@shared
def largest_p(
    gain: float = CONTROLLER_GAIN, difference: float | None = None, away: float = 0.0
) -> float:
    """Corner frequency p in rad/s up to which the upper edge is `away` from (1, 1)."""

    def beyond(log_p: float) -> float:
        # A power, so that the root is not hidden by the scale.
        corner = edges(gain, float(np.exp(log_p)), difference).corner
        return float(np.arcsinh(1e6 * (corner - away)))

    start = np.log(DUAL_SENSOR_CORNER)
    return float(np.exp(brentq(beyond, start, start + np.log(10.0), xtol=1e-7)))


@shared
def gain_at_perturbation() -> float:
    """Gain in rad/s at which the corner is `PERTURBATION` away from (1, 1)."""

    def beyond(log_gain: float) -> float:
        return float(np.log(edges(float(np.exp(log_gain))).corner / PERTURBATION))

    return float(np.exp(brentq(beyond, np.log(1e4), np.log(1e5), xtol=1e-9)))


# The open loop ------------------------------------------------------------------------------


def printed_open_loop(
    omega: npt.ArrayLike, c1: float, c2: float, *, restored: bool = False
) -> Any:
    """Evaluate the dual arm's open loop as printed in Sec. III.B.

    Parameters
    ----------
    omega : array_like of float
        In rad/s.
    c1, c2 : float
        Multiplicative perturbations.
    restored : bool, optional
        Put j before the three omega of the second line that lack it.
    """
    omega = np.asarray(omega, dtype=float)
    s = 1j * omega
    g, p = DUAL_ARM_GAIN, DUAL_SENSOR_CORNER
    first = g / s * (2.0 - c1 * np.exp(-TAU1 * s) - c2 * np.exp(-TAU2 * s))
    w = s if restored else omega
    arms = c1 * np.exp(-TAU1 * w) - c2 * np.exp(-TAU2 * w)
    return first + g * p / (w + p) * arms / (omega**2 * FULL_DIFFERENCE)


def printed_deviation(c1: float, c2: float, *, restored: bool = False) -> tuple[float, float]:
    """Return the printed loop's largest relative deviation, and its frequency in rad/s.

    Searched from 1 mHz to 10 Hz; `restored` as for `printed_open_loop`.
    """

    def off(log_omega: Any) -> Any:
        omega = np.exp(log_omega)
        truth = DualArm()(1j * omega, c1, c2)
        return np.abs(printed_open_loop(omega, c1, c2, restored=restored) / truth - 1.0)

    grid = np.log(2.0 * np.pi * np.logspace(-3.0, 1.0, 40_001))
    best = grid[np.argmax(off(grid))]
    around = best + (grid[1] - grid[0]) * np.array([-1.0, 1.0])
    found = minimize_scalar(lambda x: -float(off(x)), bounds=tuple(around), method="bounded")
    return -float(found.fun), float(np.exp(found.x))


@cache
def gain_factors(c1: float, c2: float) -> tuple[float, float]:
    """Return the gain factors between which the loop stays stable, from g = 10."""
    found = margins(DualArm(), c1, c2)
    return found.gain_lower, found.gain_upper


def middle_corner(system: CharacteristicFunction) -> float:
    """Return (c1 + c2) / 2 - 1 at the upper edge in the strip's middle.

    On the straight edge rounding would decide whether the root z = 1 of a map is unstable.
    """
    return upper_end(system, 0.25 * FULL_DIFFERENCE / MEAN_DELAY).position - 0.1


def sampled_ratio(gain: float, step: float = STEP, order: int = 0) -> float:
    """Return `middle_corner` of the semi-discretized loop over that of the loop."""
    loop = DualArm(gain)
    return middle_corner(semi_discretization(loop, step, order)) / middle_corner(loop)


# Claims -------------------------------------------------------------------------------------


@claim(
    "D1",
    place="Sec. III.B, the open loop",
    says="The open loop is the common arm's plus a weighted difference of the delayed signals.",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.375746, 1e-6),
    weight=Weight.WORDING,
    printed=r"$\frac{gp}{ω+p} \frac{1}{ω^2Δτ} (c_1 e^{-τ_1ω} - c_2 e^{-τ_2ω})$",
)
def open_loop_as_printed() -> Finding:
    """Evaluate the printed formula, with and without the missing j, against Table I."""
    printed, omega = printed_deviation(*PRINTED_AT)
    mended, _ = printed_deviation(*PRINTED_AT, restored=True)
    return Finding(
        {PRINTED: printed < 1e-9, "with j in the three places": mended < 1e-9},
        printed,
        "largest relative deviation from the loop built from Table I at "
        f"$(c₁, c₂) = {PRINTED_AT}$, 1 mHz to 10 Hz",
        "In the second line the j is missing in $ω + p$ and in both exponents. With it the "
        "formula is the dual sensor with the low-pass $p/(s+p)$ and $Δτ = τ₁ - τ₂$, to "
        f"{mended:.0e}. The deviation is largest at {omega / (2.0 * np.pi):.3f} Hz.",
    )


@claim(
    "D3",
    place="Fig. 6",
    says="As $g$ grows, the upper-right edge moves inwards and the straight edge stays.",
    pinned=(Verdict.ONE_READING, -2.0014925, 1e-6),
)
def edges_against_gain() -> Finding:
    """Follow the corner over six decades of gain."""
    corner = np.array([edges(float(gain)).corner for gain in GAINS])
    lines = {d_curve_line(DualArm(float(gain))) for gain in GAINS}
    high = GAINS >= 1e4
    slope = float(np.polyfit(np.log(GAINS[high]), np.log(corner[high]), 1)[0])
    falls = np.diff(corner) < -1e-9 * corner[:-1]
    k = int(np.argmax(falls))

    def stays(log_gain: float) -> float:
        return 0.5 - float(edges(float(np.exp(log_gain))).corner < (1.0 - 1e-9) * corner[0])

    first = float(np.exp(bisect(stays, *np.log(GAINS[k : k + 2]), xtol=1e-3)))
    return Finding(
        {
            "from the gain of Fig. 5 up": bool((falls[GAINS[:-1] >= DUAL_ARM_GAIN]).all())
            and len(lines) == 1,
            "from any gain up": bool(falls.all()),
        },
        slope,
        "exponent with which the distance from (1, 1) to the straight edge's upper end falls "
        "with g, from $10⁴$ rad/s on",
        f"Along $c₁ = c₂$ the upper edge stays at {1 + corner[0]:.3g} for gains up to "
        f"{first:.2g} rad/s. At higher gains it moves inwards at every step of a sweep, to "
        f"{1 + edges(DUAL_ARM_GAIN).corner:.4f} at $g = 10$ and 1 + {corner[-1]:.3g} at "
        f"{GAINS[-1]:.0e} rad/s. The line $c₁ = c₂$ is the same for every g.",
    )


@claim(
    "D4",
    place="Sec. III.B, last paragraph",
    says="The region shrinks because perturbations make the gain margin finite.",
    pinned=(Verdict.ONE_READING, 29.5759064, 1e-6),
    printed="perturbations ... may cause the Nyquist curve ... to cross the negative real axis",
)
def finite_gain_margin() -> Finding:
    """Find every crossing of the negative real axis at stable points on both sides of A."""
    above = [gain_factors(*point)[1] for point in ABOVE]
    below = [gain_factors(*point)[1] for point in BELOW]
    return Finding(
        {
            "perturbations to the upper right, $c₁ + c₂ > 2$": bool(np.isfinite(above).all()),
            "every perturbation": not np.isinf(below).any(),
        },
        above[1],
        f"gain factor at $(c₁, c₂) = {ABOVE[1]}$, from $g = 10$, at which a root reaches the "
        "axis",
        f"At {ABOVE[2]} the factor is {above[2]:.3g}, and at $(1, 1)$ plus {PERTURBATION:g} in "
        f"$c₂$ it is {above[0]:.3g}. At {BELOW[0]} and {BELOW[1]} the curve does not cross the "
        "axis between -1 and 0, and the gain margin is infinite.",
    )


@claim(
    "D5",
    place="Fig. 6, caption",
    says="The upper edge shown is not the exact limit of stability; it was not computed.",
    pinned=(Verdict.OPEN, 1.254005934812, 1e-11),
    weight=Weight.DERIVATION,
)
def exact_upper_edge() -> Finding:
    """Compute the upper edge, verify it, and see what semi-discretization makes of it."""
    exact = edges(DUAL_ARM_GAIN)
    c = 1.0 + exact.corner
    near = c + np.array([-1e-5, 1e-5])
    before, after = unstable_roots(DualArm(), near - 1e-6, near + 1e-6)
    off = sampled_ratio(DUAL_ARM_GAIN) - 1.0
    return Finding(
        {},
        c,
        "$c₁ = c₂$ at the upper end of the straight edge, $g = 10$, exact",
        f"A pair of roots with $ω = {exact.corner_omega:.4f}$ rad/s crosses there: {before} "
        f"roots are unstable 1e-5 below it, and {after} above. Semi-discretization with the "
        f"step of Fig. 4(b) puts the edge {100 * off:.2g} % further from (1, 1).",
        missing="the edge that the figure shows",
    )


@claim(
    "D6",
    place="Sec. III.B, last paragraph",
    says="The stable region shrinks as the gain increases.",
    pinned=(Verdict.ONE_READING, 0.5208170, 1e-6),
    printed="As the gain increases, the stability region gradually shrinks",
)
def shrinking_region() -> Finding:
    """Follow area and far edge, and look for a point that only a high gain makes stable."""
    width = np.array([edges(float(gain)).width for gain in GAINS])
    area = [window_area(gain) for gain in (DUAL_ARM_GAIN, 100.0, 1e3, float(GAINS[-1]))]
    middle = 0.5 * (width[0] + width[-1])
    point = (WINDOW[0] - 0.5 * middle, WINDOW[0] + 0.5 * middle)
    gained = [int(unstable_roots(DualArm(float(g)), *point)) for g in GAINS[[0, -1]]]
    widens = bool((np.diff(width) > 0.0).all()) and gained[1] == 0 < gained[0]
    further = 100.0 * (width[-1] / edges(DUAL_ARM_GAIN).width - 1.0)
    return Finding(
        {
            "its area near (1, 1), from $g = 10$ up": bool((np.diff(area) < 0.0).all()),
            "every edge moves inwards": not widens,
        },
        area[-1] / area[0],
        f"stable area within $[{WINDOW[0]:g}, {WINDOW[1]:g}]^2$, at $g = 10⁵$ over that at "
        "$g = 10$",
        "Most of the region below $c₁ + c₂ = 2$ stays stable at every gain. The far edge, at "
        f"which a slow oscillation sets in, moves outwards by {further:.2f} % of the width "
        f"from $g = 10$ up. The point ({point[0]:.4f}, {point[1]:.4f}) has {gained[0]} "
        f"unstable roots at $g = {GAINS[0]:g}$ and {gained[1]} at the highest gain.",
    )


@claim(
    "D7",
    place="Fig. 6, caption",
    says="The parameters of an arm lock never reach the upper edge.",
    pinned=(Verdict.ONE_READING, 22204.68, 0.01),
    printed="the arm-locking parameters never reach this boundary",
)
def never_reached() -> Finding:
    """Compare the corner's distance with the largest perturbation, over the gain."""
    at_ten, at_controller = edges(DUAL_ARM_GAIN).corner, edges(CONTROLLER_GAIN).corner
    limit, corner = gain_at_perturbation(), largest_p(away=PERTURBATION)
    return Finding(
        {
            "gains of the paper, 10 and 5000 rad/s": min(at_ten, at_controller) > PERTURBATION,
            "any gain": edges(float(GAINS[-1])).corner > PERTURBATION,
        },
        limit,
        "gain g in rad/s from which the upper edge is within the largest perturbation, "
        f"{PERTURBATION:g}, of (1, 1)",
        f"Along $c₁ = c₂$ the upper edge is {at_ten:.3g} away at $g = 10$ and "
        f"{at_controller:.3g} at the controller's $g = {CONTROLLER_GAIN:g}$, "
        f"{at_controller / PERTURBATION:.0f} times the largest perturbation. This "
        f"distance falls as $1/g^2$. At $g = {CONTROLLER_GAIN:g}$ the claim holds for every p "
        f"up to {corner:.2f} rad/s.",
    )


@claim(
    "D8",
    place="Sec. III.B, before Fig. 5",
    says="D-subdivision with semi-discretization carries over to the dual arm.",
    pinned=(Verdict.ONE_READING, 0.0098137, 1e-6),
    weight=Weight.DERIVATION,
    printed="a consistent and comprehensive framework",
)
def sampled_framework() -> Finding:
    """Compare the edge of the map with the exact one, at two gains."""
    at_ten, at_hundred = sampled_ratio(DUAL_ARM_GAIN), sampled_ratio(100.0)
    return Finding(
        {
            "at $g = 10$, the gain of Fig. 5": abs(at_ten - 1.0) < 0.05,
            "at ten times that gain": abs(at_hundred - 1.0) < 0.05,
        },
        at_hundred,
        "distance from A to the upper edge in the strip's middle at $g = 100$, of the map "
        f"($h = {STEP:g}$ s) divided by the exact one",
        f"At $g = 10$ the ratio is {at_ten:.3f}. At $g = 100$ the roots that cross oscillate "
        f"with {ONE_PERIOD / (2 * np.pi):g} and {TWO_PERIODS / (2 * np.pi):g} Hz, and a step "
        f"of {STEP:g} s resolves up to {0.5 / STEP:g} Hz. The step is that of Fig. 4(b), "
        "because the paper gives none for the dual arm.",
    )


@claim(
    "D10",
    place="Sec. III.B, against Table I",
    says="The loop uses the dual sensor of Table I, with $Δτ = τ₁ - τ₂$.",
    pinned=(Verdict.NOT_AS_WRITTEN, 2.0, 1e-9),
    weight=Weight.DERIVATION,
    printed=r"$\frac{p}{1+p} \frac{1}{iωΔτ} P_-(ω)$ in Table I, and $Δτ = (τ₁ - τ₂)$",
    affects=("K5",),
)
def convention_of_difference() -> Finding:
    """Compare the two meanings of dtau: weight of the integral, and edges."""
    whole_mapping, half_mapping = (
        DualArm(difference=d).mapping.weights(1e-3j) for d in (FULL_DIFFERENCE, HALF_DIFFERENCE)
    )
    ratio = float(abs((half_mapping[0] - 1.0) / (whole_mapping[0] - 1.0)))
    one, other = edges(DUAL_ARM_GAIN), edges(DUAL_ARM_GAIN, difference=HALF_DIFFERENCE)
    lines = [d_curve_line(DualArm(difference=d)) for d in (FULL_DIFFERENCE, HALF_DIFFERENCE)]
    return Finding(
        {
            PRINTED: abs(ratio - 1.0) < 1e-6,
            "with two letters": lines[0] == lines[1],
        },
        ratio,
        "weight of the integrated difference in Table I, divided by that of Sec. III.B",
        "Table I needs half the difference of the round trips, as the work that it cites has "
        "it (claims T2 and T3), and Sec. III.B defines the whole. Claims on the dual arm are "
        "tried with both where it matters. The straight edge is the same for both; at "
        f"$g = 10$ it ends at {1 + one.corner:.4f} or {1 + other.corner:.4f}.",
    )
