"""Claims of Sec. III.B, the dual arm: D1 to D10, and what the chapter computes with them.

The stable region is a narrow strip along c1 = c2. It is described by the common perturbation
(c1 + c2) / 2 and the difference c2 - c1, in which its area element is that of (c1, c2).
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, minimize_scalar

from armlock.characteristic import CharacteristicFunction
from armlock.checks import FloatArray
from armlock.loops import DualArm
from armlock.paper import (
    CONTROLLER_GAIN,
    DUAL_ARM_GAIN,
    DUAL_SENSOR_CORNER,
    PERTURBATION,
    STEP,
    TAU1,
    TAU2,
)
from armlock.robustness.gains import gain_interval
from armlock.robustness.rays import Crossing, first_crossing
from armlock.stability.counts import BOUNDARY, stability_chart, unstable_roots
from armlock.stability.dcurve import d_curve, d_curve_line
from armlock.stability.roots import rightmost_root
from armlock.stability.semidiscretization import semi_discretization
from book.companion.claims import ledger
from book.companion.claims.common_arm import log_slope
from book.companion.claims.ledger import Finding, Verdict, Weight, decide
from book.companion.claims.table1 import FULL_DIFFERENCE, HALF_DIFFERENCE, MEAN_DELAY
from book.companion.shared import shared

claim = partial(ledger.claim, chapter="04_dual_arm")

#: A fixed window around point A, the same in c1 and c2.
WINDOW = (0.9, 1.1)
#: Gains of the sweep in rad/s, six decades.
GAINS = np.logspace(-1.0, 5.0, 61)
#: First frequency in rad/s at which the round trips differ by a whole period, 5 Hz: 100.5 and
#: 99.5 periods. At twice this, 10 Hz, both are whole numbers of periods.
ONE_PERIOD = 2.0 * np.pi / FULL_DIFFERENCE
TWO_PERIODS = 2.0 * ONE_PERIOD
#: Points of the strip on either side of c1 + c2 = 2, and one of the sliver below that line
#: which a high gain takes as well.
ABOVE = ((1.0, 1.0 + PERTURBATION), (1.001, 1.002), (1.1, 1.105))
SLIVER = (0.99198, 1.00798)
BELOW = ((0.999, 1.0), (0.9, 0.905))
#: Point at which the printed open loop is compared with the derived one.
PRINTED_AT = (1.01, 0.98)
#: Points of both kinds at which every verdict is taken twice.
POINTS = ((0.95, 0.955), (1.0, 1.005), (1.0, 0.995), (1.0, 1.03), (1.2, 1.21), (1.3, 1.31))


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


def far_edge(loop: DualArm, common: float) -> Crossing:
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


def corner_sweep(gain: float, corners: FloatArray, difference: float | None = None) -> Edges:
    """Sweep `edges` over corner frequencies in rad/s, each field an array."""
    return Edges(*np.transpose([edges(gain, float(p), difference) for p in corners]))


def corner_estimate(
    gain: npt.ArrayLike, periods: int, corner: float = DUAL_SENSOR_CORNER
) -> Any:
    """Estimate the upper end of the straight edge at high gain, as c - 1.

    Parameters
    ----------
    gain : array_like of float
        In rad/s.
    periods : int
        The delay difference in periods: 1 near 5 Hz, where the delayed signals come back with
        the wrong sign and the frequency is off by half a turn of the mean delay; 2 near 10 Hz.
    corner : float, optional
        p in rad/s.
    """
    omega = periods * ONE_PERIOD
    off = 0.0 if periods % 2 == 0 else 0.5 * np.pi * FULL_DIFFERENCE / MEAN_DELAY
    share = corner**2 / (corner**2 + omega**2)
    detuned = 0.5 * off**2 - share * off / (2.0 * np.pi * periods)
    return omega**2 / (8.0 * np.asarray(gain) ** 2) + detuned


def sensor_weight(periods: int = 2) -> float:
    """Return -Re E at 5 Hz times `periods`: the sensor weighs the arms 1 + E and 1 - E."""
    p, omega = DUAL_SENSOR_CORNER, periods * ONE_PERIOD
    return float(p / ((p**2 + omega**2) * FULL_DIFFERENCE))


def lost_from(c1: float, c2: float) -> float:
    """Estimate the gain in rad/s that takes a point of the upper strip; inf for none.

    The estimate is `corner_estimate` with the weights 1 + E and 1 - E of the two arms, which
    differ for the sensor's integral; near 5 Hz or at 10 Hz, whichever is the lower.
    """
    excess = 0.5 * (c1 + c2) - 1.0
    gains = [np.inf]
    for periods in (1, 2):
        left = excess + 0.5 * sensor_weight(periods) * (c2 - c1)
        left -= corner_estimate(np.inf, periods)
        if left > 0.0:
            gains.append(periods * ONE_PERIOD / np.sqrt(8.0 * left))
    return float(min(gains))


@cache
def high_gain_limit() -> CharacteristicFunction:
    """Return D / g of the dual arm for g to infinity.

    It is neutral. Where it has no root on the axis past some frequency, no gain has, because
    |2 + j omega / g| is least at infinite gain.
    """
    one, two = DualArm(1.0), DualArm(2.0)
    a = two.a - one.a  # D is affine in the gain, and B1 and B2 are proportional to it
    return CharacteristicFunction(a, one.b1, one.b2, TAU1, TAU2, parameters=one.parameters)


def limit_end(difference: float) -> float:
    """Return c1 + c2 at the upper edge for an infinite gain, at a given c2 - c1."""
    return 2.0 * (WINDOW[0] + upper_end(high_gain_limit(), difference).position)


def width_estimate(common: npt.ArrayLike) -> Any:
    """Estimate c2 - c1 at the far edge, for a high gain and frequencies far below p.

    Parameters
    ----------
    common : array_like of float
        (c1 + c2) / 2.
    """
    # 2 exp(j x) = c + j d / (x ratio), with x = omega times the mean delay.
    cosine = 0.5 * np.asarray(common, dtype=float)
    ratio = FULL_DIFFERENCE / MEAN_DELAY
    return 2.0 * ratio * np.arccos(cosine) * np.sqrt(1.0 - cosine**2)


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


@shared
def strip(gain: float, number: int = 61) -> FloatArray:
    """Trace the boundary of the strip but for its straight edge.

    Returns
    -------
    float array, shape (2, 3 number)
        (c1 + c2) / 2 and c2 - c1, from the lower end of the straight edge along the lower,
        the far and the upper edge to its upper end.
    """
    loop = DualArm(gain)
    lowest = -0.5 - upper_end(loop, 0.0, low=-0.5, sign=-1.0).position
    low, high = 0.96 * lowest, WINDOW[0]  # from these lines every ray leaves by an end

    def end(start: float, sign: float) -> FloatArray:
        difference = far_edge(loop, start).position * np.linspace(0.0, 1.0 - 1e-6, number)
        reach = [upper_end(loop, d, start, sign).position for d in difference]
        return np.array([start + sign * np.array(reach), difference])

    middle = np.linspace(low, high, number)
    between = np.array([middle, [far_edge(loop, common).position for common in middle]])
    return np.concatenate((end(low, -1.0), between, end(high, 1.0)[:, ::-1]), axis=1)


def window_area(gain: float) -> float:
    """Area of the part of the stable region in which both parameters are in the window.

    From `top_of_strip`, and so to a part in 1e5, as many rays confirm; it is not certified.
    """
    difference, top = top_of_strip(gain)
    low, high = WINDOW
    # Both c1 = common - d / 2 and c2 = common + d / 2 are to be inside.
    length = np.minimum(top, high - 0.5 * difference) - (low + 0.5 * difference)
    return float(np.trapezoid(np.clip(length, 0.0, None), difference))


@shared
def chart_area(gain: float, points: int = 401) -> float:
    """Area as `window_area` has it, from a chart of counts: a second opinion."""
    axis = np.linspace(*WINDOW, points)
    # Cells centred on the points, half of them outside the window at its edges.
    weight = np.full(points, axis[1] - axis[0])
    weight[[0, -1]] *= 0.5
    counts = stability_chart(DualArm(gain), axis, axis).counts
    # Half of a cell that the straight edge cuts is stable.
    inside = np.where(counts == BOUNDARY, 0.5 * (axis[:, None] + axis < 2.0), counts == 0)
    return float(weight @ inside @ weight)


@cache
def area_excess() -> tuple[FloatArray, FloatArray]:
    """Return gains, and the area in the window beyond what is left at the highest gain."""
    gains = np.logspace(1.7, 2.5, 5)
    least = window_area(float(GAINS[-1]))
    return gains, np.array([window_area(float(gain)) - least for gain in gains])


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


def largest_p_estimate() -> float:
    """Estimate `largest_p` at infinite gain: where `corner_estimate` near 5 Hz is zero."""
    share = 0.5 * np.pi**2 * FULL_DIFFERENCE / MEAN_DELAY
    return float(ONE_PERIOD * np.sqrt(share / (1.0 - share)))


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
        truth = DualArm().open_loop(1j * omega, c1, c2)
        return np.abs(printed_open_loop(omega, c1, c2, restored=restored) / truth - 1.0)

    grid = np.log(2.0 * np.pi * np.logspace(-3.0, 1.0, 40_001))
    best = grid[np.argmax(off(grid))]
    around = best + (grid[1] - grid[0]) * np.array([-1.0, 1.0])
    found = minimize_scalar(lambda x: -float(off(x)), bounds=tuple(around), method="bounded")
    return -float(found.fun), float(np.exp(found.x))


@shared
def stable_both_ways() -> tuple[tuple[int, float], ...]:
    """Count and real part of the rightmost root in 1/s at each of `POINTS`."""
    loop = DualArm()
    found = []
    for point in POINTS:
        root = complex(np.asarray(rightmost_root(loop, *point)))
        found.append((int(unstable_roots(loop, *point)), root.real))
    return tuple(found)


@cache
def gain_factors(c1: float, c2: float) -> tuple[float, float]:
    """Return the gain factors between which the loop stays stable, from g = 10."""
    return gain_interval(DualArm(), c1, c2)[:2]


def sliver() -> dict[str, object]:
    """Return what the chapter tells of the sliver between the edge and c1 + c2 = 2."""
    (c1, c2), weight = SLIVER, sensor_weight()
    return {
        "weight": weight,
        "at": SLIVER,
        "sum": c1 + c2,
        "gain": 10.0 * gain_factors(c1, c2)[1],
        "estimate": lost_from(c1, c2),
        "most": weight * far_edge(DualArm(), 1.0).position,
        "off": abs((2.0 - limit_end(c2 - c1)) / (weight * (c2 - c1)) - 1.0),
    }


def middle_corner(system: CharacteristicFunction) -> float:
    """Return (c1 + c2) / 2 - 1 at the upper edge in the strip's middle.

    On the straight edge the root z = 1 of a map is known to rounding only.
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
        decide(printed < 1e-9, corrected=mended < 1e-9),
        printed,
        "largest relative deviation from the loop built from Table I at "
        f"$(c₁, c₂) = {PRINTED_AT}$, 1 mHz to 10 Hz",
        f"It is largest at {omega / (2.0 * np.pi):.3f} Hz. Three times a j is missing in the "
        "second line: in $ω + p$ and in both exponents. With them the formula is the dual "
        f"sensor with the low-pass $p/(s+p)$ and $Δτ = τ₁ - τ₂$, to {mended:.0e}.",
    )


@claim(
    "D2",
    place="Fig. 5",
    says="At $g = 10$ the stable region (Area 1) has the ideal point A = (1, 1) on its edge.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def chart_at_gain_ten() -> Finding:
    """Locate A against D(0) = 0, and take verdicts on both sides by two methods."""
    loop = DualArm()
    line = d_curve_line(loop)
    off = abs(line.weight_x + line.weight_y - line.value)
    sides = unstable_roots(loop, 1.0, 1.0 + PERTURBATION * np.array([-1.0, 0.0, 1.0]))
    agree = all((count == 0) == (rate < 0.0) for count, rate in stable_both_ways())
    found = edges(DUAL_ARM_GAIN)
    return Finding(
        decide(off == 0.0 and sides.tolist() == [1, BOUNDARY, 0] and agree),
        off,
        "distance of (1, 1) from the straight edge",
        "The straight edge is $c₁ = c₂$, from $D(0) = g p (c₂ - c₁)$, and the stable side is "
        f"$c₂ > c₁$, arm 1 being the longer: {PERTURBATION:g} to either side of A there are "
        f"{sides[0]} and {sides[2]} unstable roots. Area 1 is a strip {found.width:.4f} wide "
        f"in $c₂ - c₁$ that ends at $c₁ = c₂ = {1.0 + found.corner:.4f}$.",
    )


@claim(
    "D3",
    place="Fig. 6",
    says="As $g$ grows, the upper-right edge moves inwards and the straight edge stays.",
    pinned=(Verdict.REPRODUCED, -2.0014925, 1e-6),
)
def edges_against_gain() -> Finding:
    """Follow the corner over six decades of gain."""
    corner = np.array([edges(float(gain)).corner for gain in GAINS])
    lines = {d_curve_line(DualArm(float(gain))) for gain in GAINS}
    high = GAINS >= 1e4
    slope = log_slope(GAINS[high], corner[high])
    return Finding(
        decide((np.diff(corner) < 0.0).all() and len(lines) == 1),
        slope,
        "exponent with which the distance from (1, 1) to the straight edge's upper end falls "
        "with g, from $10⁴$ rad/s on",
        f"Along $c₁ = c₂$ the upper edge moves from {1 + corner[0]:.3f} at $g = {GAINS[0]:g}$ "
        f"through {1 + edges(DUAL_ARM_GAIN).corner:.4f} at $g = 10$ to 1 + {corner[-1]:.3g} at "
        "the highest gain, at every step inwards. The line $c₁ = c₂$ is the same for every g.",
    )


@claim(
    "D4",
    place="Sec. III.B, last paragraph",
    says="The region shrinks because perturbations make the gain margin finite.",
    pinned=(Verdict.WHERE_USED, 29.5759064, 1e-6),
    printed="perturbations ... may cause the Nyquist curve ... to cross the negative real axis",
)
def finite_gain_margin() -> Finding:
    """Find every crossing of the negative real axis at stable points on both sides of A."""
    above = [gain_factors(*point)[1] for point in ABOVE]
    below = [gain_factors(*point)[1] for point in BELOW]
    return Finding(
        decide(np.isfinite(above).all(), beyond=not np.isinf(below).all()),
        above[1],
        f"gain factor at $(c₁, c₂) = {ABOVE[1]}$, from $g = 10$, at which a root reaches the "
        "axis",
        "True of the upper right, where the paper sees the region become smaller: at "
        f"{ABOVE[2]} the factor is {above[2]:.3g}, at $(1, 1)$ plus {PERTURBATION:g} in $c₂$ "
        f"{above[0]:.3g}. Where $c₁ + c₂$ is below 2, at {BELOW[0]} and {BELOW[1]}, the curve "
        "does not cross the axis between -1 and 0, and the gain margin is infinite.",
    )


@claim(
    "D5",
    place="Fig. 6, caption",
    says="The upper edge shown is not the exact limit of stability; it was not computed.",
    pinned=(Verdict.REPRODUCED, 1.254005934812, 1e-11),
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
        decide(before == 0 and after == 2 and abs(off) > 1e-4),
        c,
        "$c₁ = c₂$ at the upper end of the straight edge, $g = 10$, exact",
        f"A pair with $ω = {exact.corner_omega:.4f}$ rad/s crosses there: {before} unstable "
        f"roots 1e-5 below, {after} above. Semi-discretization with the step of the common-arm "
        f"figure puts the edge {100 * off:.2g} % further from (1, 1).",
    )


@claim(
    "D6",
    place="Sec. III.B, last paragraph",
    says="The stable region shrinks as the gain increases.",
    pinned=(Verdict.IN_PART, 0.5208170, 1e-6),
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
    return Finding(
        decide((np.diff(area) < 0.0).all(), not widens),
        area[-1] / area[0],
        f"stable area within $[{WINDOW[0]:g}, {WINDOW[1]:g}]^2$, at $g = 10⁵$ over that at "
        "$g = 10$",
        "The area falls, but not to zero: most of what lies below $c₁ + c₂ = 2$ stays at every "
        "gain. And the far edge, where a slow oscillation is lost, moves outwards: "
        f"({point[0]:.4f}, {point[1]:.4f}) has {gained[0]} unstable roots at "
        f"$g = {GAINS[0]:g}$ and {gained[1]} at the highest gain.",
    )


@claim(
    "D7",
    place="Fig. 6, caption",
    says="The parameters of an arm lock never reach the upper edge.",
    pinned=(Verdict.WHERE_USED, 22204.68, 0.01),
    printed="the arm-locking parameters never reach this boundary",
)
def never_reached() -> Finding:
    """Compare the corner's distance with the largest perturbation, over the gain."""
    at_ten, at_controller = edges(DUAL_ARM_GAIN).corner, edges(CONTROLLER_GAIN).corner
    limit, corner = gain_at_perturbation(), largest_p(away=PERTURBATION)
    return Finding(
        decide(
            min(at_ten, at_controller) > PERTURBATION,
            beyond=edges(float(GAINS[-1])).corner >= PERTURBATION,
        ),
        limit,
        "gain g in rad/s from which the upper edge is within the largest perturbation, "
        f"{PERTURBATION:g}, of (1, 1)",
        f"Along $c₁ = c₂$ the upper edge is {at_ten:.3g} away at $g = 10$ and "
        f"{at_controller:.3g} at the controller's $g = {CONTROLLER_GAIN:g}$, "
        f"{at_controller / PERTURBATION:.0f} times the largest perturbation. The distance "
        "falls as $1/g^2$. It also depends on p, which is not given: at "
        f"$g = {CONTROLLER_GAIN:g}$ the claim stands for every p up to {corner:.2f} rad/s.",
    )


@claim(
    "D8",
    place="Sec. III.B, before Fig. 5",
    says="D-subdivision with semi-discretization carries over to the dual arm.",
    pinned=(Verdict.WHERE_USED, 0.0098137, 1e-6),
    weight=Weight.DERIVATION,
    printed="a consistent and comprehensive framework",
)
def sampled_framework() -> Finding:
    """Compare the edge of the map with the exact one, at two gains."""
    at_ten, at_hundred = sampled_ratio(DUAL_ARM_GAIN), sampled_ratio(100.0)
    return Finding(
        decide(abs(at_ten - 1.0) < 0.05, beyond=abs(at_hundred - 1.0) < 0.05),
        at_hundred,
        f"distance from A to the upper edge in the strip's middle, map ($h = {STEP:g}$ s) over "
        "exact, $g = 100$",
        f"At $g = 10$, the only gain that the paper names here, the ratio is {at_ten:.3f} and "
        f"the chart is right. At $g = 100$ the roots that cross oscillate with "
        f"{ONE_PERIOD / (2 * np.pi):g} and {TWO_PERIODS / (2 * np.pi):g} Hz, and a step of "
        f"{STEP:g} s resolves up to {0.5 / STEP:g} Hz; the paper gives no step for the dual "
        "arm.",
    )


@claim(
    "D9",
    place="Sec. III.B, below the open loop",
    says="$p$ is the corner frequency; no value is given.",
    pinned=(Verdict.OPEN, 7.249457, 1e-5),
)
def unknown_corner_frequency() -> Finding:
    """Vary p by factors of four, and find the p at which A leaves the edge."""
    p = DUAL_SENSOR_CORNER
    low, here, high = (edges(DUAL_ARM_GAIN, factor * p) for factor in (0.25, 1.0, 4.0))
    limit = largest_p()
    return Finding(
        decide(settled=abs(high.corner / low.corner - 1.0) < 0.01),
        limit,
        "p in rad/s above which, at $g = 5000$, the region no longer reaches (1, 1)",
        f"With p four times lower than ours ({p:.3f} rad/s), ours, and four times higher, the "
        f"straight edge ends at {1 + low.corner:.3f}, {1 + here.corner:.3f} and "
        f"{1 + high.corner:.3f} for $g = 10$. The straight line does not depend on p. Whether "
        "A is on the edge of the region does, at high gain: above the limit a pair near 5 Hz "
        "is unstable there.",
    )


@claim(
    "D10",
    place="Sec. III.B, against Table I",
    says="The loop uses the dual sensor of Table I, with $Δτ = τ₁ - τ₂$.",
    pinned=(Verdict.NOT_AS_WRITTEN, 2.0, 1e-9),
    weight=Weight.DERIVATION,
    printed="where $Δτ = (τ₁ - τ₂)$",
    same_as="T2",
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
        decide(abs(ratio - 1.0) < 1e-6, corrected=lines[0] == lines[1]),
        ratio,
        "weight of the integrated difference in Table I over that of Sec. III.B",
        "Table I is right for half the difference of the round trips (claims T2 and T3); the "
        "loop takes the whole one, as it says, and so do we. The straight edge is the same for "
        f"both; at $g = 10$ it ends at {1 + one.corner:.4f} or {1 + other.corner:.4f}.",
    )
