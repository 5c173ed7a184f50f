"""Claims of Sec. III.A, the common arm, and the computations they share with the chapter."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import mpmath
import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, minimize_scalar

from armlock.characteristic import CharacteristicFunction
from armlock.checks import FloatArray
from armlock.loops import CommonArm, DualArm
from armlock.paper import COMMON_ARM_GAIN, STEP, TAU1, TAU2
from armlock.robustness import first_crossing
from armlock.stability.charts import StabilityChart, stability_chart
from armlock.stability.counts import unstable_roots
from armlock.stability.dcurve import Branch, d_curve, d_curve_branches, d_curve_line
from armlock.stability.roots import rightmost_root
from armlock.stability.semidiscretization import (
    semi_discretization,
    spectral_radius,
    transition_matrix,
)
from book.companion.claims.ledger import PRINTED, Finding, Verdict, Weight, claim
from book.companion.extremes import smallest
from book.companion.outline import boundary_radius, outline, perimeter, rays
from book.companion.schemes import pseudospectral_roots, sampled_loop, standard_schemes
from book.companion.shared import shared

#: Half-width of a window that holds the whole stable region, and of one that shows branches.
WINDOW = 7.0
WIDE_WINDOW = 20.0
#: Steps in s over which errors are followed; each divides both delays.
STEPS = (0.1, 0.05, 0.025, 0.0125)
#: Directions in which boundaries are compared.
RAYS = 60
#: Points at which roots are compared: slow and real, slow and oscillating, and one near the
#: round end of the stable region, where the critical roots are fast.
POINTS = ((0.9, 1.05), (-0.5, -0.8), (5.5, -5.2))
#: Samples of a drawing of the D-curve, some twenty a turn.
DRAWN_SAMPLES = 1000
#: Highest frequency in rad/s up to which the D-curve is searched for cusps.
OMEGA_SEARCHED = 60.0

ARM = CommonArm(COMMON_ARM_GAIN, TAU1, TAU2)


# The stable region --------------------------------------------------------------------------


@shared
def exact_radius(number: int = RAYS) -> FloatArray:
    """Return the boundary's distance from the origin along `rays(number)`."""
    return boundary_radius(ARM, rays(number))


@shared
def charts(points: int = 401) -> tuple[StabilityChart, StabilityChart, StabilityChart]:
    """Chart the whole stable region: of the loop, and of the maps of order 0 and 1."""
    axis = np.linspace(-WINDOW, WINDOW, points)
    held, linear = (semi_discretization(ARM, STEP, order) for order in (0, 1))
    exact, *maps = (stability_chart(system, axis, axis) for system in (ARM, held, linear))
    return exact, maps[0], maps[1]


def straight_edge() -> tuple[float, float]:
    """Return c1 at both ends of the part of c1 + c2 = 2 that bounds the stable region."""
    left, right = (
        first_crossing(ARM, (1.0, 1.0 - 1e-9), (sign, -sign), stop=WINDOW).position
        for sign in (-1.0, 1.0)
    )
    return 1.0 - left, 1.0 + right


# The D-curve -------------------------------------------------------------------------------


def printed_d_curve(
    omega: FloatArray, gain: float = COMMON_ARM_GAIN, tau1: float = TAU1, tau2: float = TAU2
) -> tuple[FloatArray, FloatArray]:
    """Eq. (5a) as the paper prints it."""
    below = np.sin(omega * (tau2 - tau1))
    c1 = (2.0 * np.sin(omega * tau2) + omega / gain * np.cos(omega * tau2)) / below
    c2 = (-2.0 * np.sin(omega * tau1) - omega / gain * np.cos(omega * tau1)) / below
    return c1, c2


def nearest_point(
    branch: Branch, distance: Callable[[FloatArray, FloatArray], FloatArray]
) -> tuple[float, float]:
    """Return the frequency at which a branch has its least `distance(x, y)`, and that."""
    best = int(np.argmin(distance(branch.x, branch.y)))
    around = branch.omega[[max(best - 1, 0), min(best + 1, branch.omega.size - 1)]]
    found = minimize_scalar(
        lambda omega: float(distance(*d_curve(ARM, omega))),
        bounds=tuple(around),
        method="bounded",
        options={"xatol": 1e-12},
    )
    return float(found.x), float(found.fun)


def largest_parameter(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return max(|x|, |y|)."""
    return np.maximum(np.abs(x), np.abs(y))


def cusp_conditions(omega_max: float = OMEGA_SEARCHED) -> tuple[FloatArray, FloatArray]:
    """Frequencies at which each of the two conditions for a cusp holds.

    At a cusp both derivatives of the curve vanish: D and dD/ds have a common root j omega.
    Solved for the delayed terms, this means that two increasing phases are multiples of pi at
    one omega: omega tau1 + atan(omega tau2 / (1/g + 2 tau2) / g), and the same with the arms
    exchanged.

    Returns
    -------
    two float arrays
        All such frequencies in (0, omega_max), of the one and of the other condition.
    """

    def solve(tau: float, other: float) -> FloatArray:
        def phase(omega: float, turns: int = 0) -> float:
            lag = np.arctan2(omega * other, 1.0 + 2.0 * ARM.controller.gain * other)
            return float(omega * tau + lag - np.pi * turns)

        turns = range(1, int(phase(omega_max) / np.pi) + 1)
        return np.array([brentq(phase, 0.0, omega_max, args=(k,), xtol=1e-13) for k in turns])

    return solve(ARM.tau1, ARM.tau2), solve(ARM.tau2, ARM.tau1)


def nearest_to_a_cusp() -> tuple[float, float]:
    """Return the least distance between the two `cusp_conditions`, and the first's omega."""
    one, other = cusp_conditions()
    apart = np.abs(one[:, None] - other).min(axis=1)
    return float(apart.min()), float(one[apart.argmin()])


def turns_around_origin(branch: Branch) -> float:
    """Return how many times a branch runs around the origin."""
    angle = np.unwrap(np.arctan2(branch.y, branch.x))
    return abs(float(angle[-1] - angle[0])) / (2.0 * np.pi)


@cache
def drawn_radius(samples: int, omega_max: float) -> FloatArray:
    """Measure the stable region as a drawing has it, along `rays(RAYS)`.

    The drawing joins evenly spread samples of the D-curve, (0, omega_max], by straight lines,
    branch by branch, and adds the line c1 + c2 = 2.
    """
    omega = np.linspace(0.0, omega_max, samples + 1)[1:]
    x, y = d_curve(ARM, omega)
    branch = np.floor(omega * abs(ARM.tau1 - ARM.tau2) / np.pi)
    joined = branch[:-1] == branch[1:]
    found = []
    for c1, c2 in rays(RAYS).T:
        aside, ahead = x * c2 - y * c1, x * c1 + y * c2
        k = np.flatnonzero((aside[:-1] * aside[1:] < 0.0) & joined)
        share = aside[k] / (aside[k] - aside[k + 1])
        reach = ahead[k] + share * (ahead[k + 1] - ahead[k])
        line = 2.0 / (c1 + c2) if c1 + c2 > 0.0 else np.inf
        found.append(min([line, *reach[reach > 0.0]]))
    return np.array(found)


def turn_radius(loop: CharacteristicFunction, omega: npt.ArrayLike) -> FloatArray:
    """Return the radius of curvature of a loop's D-curve, from five points 1e-4 rad/s apart."""
    step = 1e-4
    at = np.asarray(omega) + step * np.arange(-2, 3).reshape(-1, *np.ones(np.ndim(omega), int))
    curve = np.array(d_curve(loop, at))
    x1, y1 = np.tensordot(curve, np.array([1, -8, 0, 8, -1]) / (12 * step), (1, 0))
    x2, y2 = np.tensordot(curve, np.array([-1, 16, -30, 16, -1]) / (12 * step**2), (1, 0))
    return np.asarray(np.hypot(x1, y1) ** 3 / np.abs(x1 * y2 - y1 * x2))


@cache
def sharpest_turn(loop: CharacteristicFunction = ARM) -> tuple[float, float]:
    """Return the least radius of curvature of the D-curve in the wide window, and its omega.

    The turns of the first branch sharpen towards low frequency, as they grow; the first one
    that lies inside the window is the sharpest.
    """

    def radius(omega: FloatArray) -> FloatArray:
        inside = largest_parameter(*d_curve(loop, omega)) < WIDE_WINDOW
        return np.where(inside, turn_radius(loop, omega), np.inf)

    # The end on the line, at omega = 0, is no turn.
    found = smallest(radius, np.linspace(0.8 * np.pi / TAU1, 2.0, 40_001))
    return found.value, found.at


def curve_jumps() -> FloatArray:
    """Change of the count across the D-curve, at points spread over the window."""
    branches = d_curve_branches(ARM, ARM.controller.gain * np.sqrt(4.0 * WINDOW**2 - 4.0))
    omega, x, y = (np.concatenate(parts) for parts in zip(*branches, strict=True))
    inside = largest_parameter(x, y) < WINDOW
    ahead, behind = (np.array(d_curve(ARM, omega[inside] + d)) for d in (1e-6, -1e-6))
    along = ahead - behind
    normal = 1e-9 * np.stack((-along[1], along[0])) / np.hypot(*along)
    here = np.stack((x[inside], y[inside]))
    left, right = (unstable_roots(ARM, *(here + s * normal)) for s in (1, -1))
    return np.asarray(np.abs(left - right))


# Maps --------------------------------------------------------------------------------------


def printed_maps(step: float = STEP) -> dict[str, CharacteristicFunction]:
    """Eqs. (7) and (8) in the readings that their printed forms allow.

    Derived: both delayed samples have the weight c (1 - exp(-2 g h)) / 2. The printed
    integral has (exp(2 g h) - 1) / 2 instead, and Eq. (7) weighs the second one with g h.
    """
    present = float(np.exp(-2.0 * ARM.controller.gain * step))
    derived = 0.5 * (1.0 - present)
    printed = 0.5 * (1.0 / present - 1.0)
    plain = ARM.controller.gain * step
    return {
        "derived": sampled_loop(ARM, step, present, (derived, derived)),
        "integral as printed": sampled_loop(ARM, step, present, (printed, printed)),
        "g h c2 as printed": sampled_loop(ARM, step, present, (derived, plain)),
        "both as printed": sampled_loop(ARM, step, present, (printed, plain)),
    }


def excess(system: CharacteristicFunction, x: float, y: float) -> float:
    """Spectral radius of a map minus one."""
    return float(np.expm1(rightmost_root(system, x, y).real * system.step))


class MapErrors(NamedTuple):
    """Errors of a map against the exact loop.

    Attributes
    ----------
    roots : float array, shape (3,)
        Distance in rad/s of log(mu) / h from the rightmost root at each of `POINTS`.
    boundary : float
        Largest distance of the boundary along a ray, signed: positive outside the exact one.
    """

    roots: FloatArray
    boundary: float


@cache
def exact_roots() -> tuple[complex, ...]:
    """Return the rightmost roots of the delay equation at `POINTS`."""
    return tuple(complex(rightmost_root(ARM, *point)) for point in POINTS)


def extended_root(
    system: CharacteristicFunction, point: tuple[float, float], start: complex
) -> mpmath.mpc:
    """Follow Newton's method from a start to a root, in 60 digits."""
    at = system.function(*point).exact_value_and_slope
    with mpmath.workdps(60):
        return mpmath.findroot(
            lambda s: at(s)[0], start, solver="newton", df=lambda s: at(s)[1]
        )


@cache
def errors_of(system: CharacteristicFunction) -> MapErrors:
    """Compare a map's rightmost roots and its boundary with the loop's.

    The roots in extended precision: some agree to all but two digits of a double.
    """
    roots = [
        float(abs(extended_root(system, p, root) - extended_root(ARM, p, root)))
        for p, root in zip(POINTS, exact_roots(), strict=True)
    ]
    shift = boundary_radius(system, rays(RAYS)) - exact_radius()
    return MapErrors(np.array(roots), float(shift[np.argmax(np.abs(shift))]))


@shared
def scheme_errors(step: float = STEP) -> dict[str, MapErrors]:
    """Errors of all `standard_schemes` of one step."""
    return {name: errors_of(system) for name, system in standard_schemes(ARM, step).items()}


def log_slope(x: npt.ArrayLike, y: npt.ArrayLike) -> float:
    """Slope of log(y) against log(x), by least squares: an observed order."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


@shared
def convergence(order: int) -> tuple[FloatArray, FloatArray]:
    """Errors of semi-discretization over `STEPS`.

    Returns
    -------
    root : float array, shape (len(STEPS),)
        Error of the rightmost root at POINTS[1], in rad/s.
    boundary : float array, shape (len(STEPS),)
        Largest distance of the boundary along a ray.
    """
    found = [errors_of(semi_discretization(ARM, step, order)) for step in STEPS]
    return np.array([e.roots[1] for e in found]), np.array([abs(e.boundary) for e in found])


# Claims ------------------------------------------------------------------------------------


@claim(
    "C1",
    place="Eq. (5a)",
    says="The two parametric equations give the parameters at which $jω$ is a root.",
    pinned=(Verdict.REPRODUCED, 0.0, 1e-11),
    weight=Weight.DERIVATION,
)
def parametric_curve() -> Finding:
    """Put Eq. (5a), line by line, into the characteristic equation, in either order."""
    omega = np.linspace(0.001, 30.0, 20_001)
    worst = 0.0
    for arm in (ARM, CommonArm(ARM.controller.gain, ARM.tau2, ARM.tau1)):
        c1, c2 = printed_d_curve(omega, arm.controller.gain, arm.tau1, arm.tau2)
        s, gain = 1j * omega, arm.controller.gain
        sizes = np.abs(s + 2.0 * gain) + gain * (np.abs(c1) + np.abs(c2))
        residual = np.abs(arm.characteristic(s, c1, c2)) / sizes
        worst = max(worst, float(residual.max()))
    return Finding(
        {"": worst < 1e-11},
        worst,
        "largest $|D(jω)|$ over the sum of its terms' magnitudes",
        f"Both lines hold with their signs as printed, at {omega.size} frequencies up to "
        f"{omega[-1]:g} rad/s and for either order of the arms.",
    )


@claim(
    "C2",
    place="Eq. (5b)",
    says="At $ω = 0$ the boundary is the straight line $c₁ + c₂ = 2$.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
    weight=Weight.DERIVATION,
)
def straight_line() -> Finding:
    """Compare the line with D(0) = 0, for several gains, and count across it."""
    gains = (0.1, 1.0, 10.0, 5000.0)
    lines = np.array([d_curve_line(CommonArm(gain, TAU1, TAU2)) for gain in gains])
    off = float(np.abs(lines - (1.0, 1.0, 2.0)).max())
    c1 = np.linspace(-12.0, 14.0, 53)
    below, above = (unstable_roots(ARM, c1, 2.0 - c1 + d) for d in (-1e-9, 1e-9))
    steps = np.abs(above - below)
    return Finding(
        {"": off == 0.0 and bool((steps == 1).all())},
        off,
        "distance of the coefficients of $D(0) = 0$ from (1, 1, 2)",
        "$D(0) = g (2 - c₁ - c₂)$, whatever the gain. Across the line, at "
        f"{c1.size} places, the number of unstable roots changes by {steps.max()}: one real "
        "root passes through zero.",
    )


@claim(
    "C3",
    place="Fig. 4(a) and the text below Eq. (5b)",
    says="The D-curves, with branches, cusps and rings, separate regions of different counts.",
    pinned=(Verdict.IN_PART, 5.6957e-4, 1e-8),
    weight=Weight.DERIVATION,
    printed="a more complex geometry, including multiple branches, cusps, and ring-like "
    "structures",
)
def shape_of_the_curve() -> Finding:
    """Count branches, turns and cusps, and count unstable roots on both sides."""
    branches = d_curve_branches(ARM, OMEGA_SEARCHED, points_per_turn=200)
    reached = [nearest_point(branch, largest_parameter)[1] for branch in branches]
    shown, turns = sum(r < WIDE_WINDOW for r in reached), turns_around_origin(branches[0])
    cusps = int(nearest_to_a_cusp()[0] < 1e-10)
    jumps = curve_jumps()
    radius, _ = sharpest_turn(DualArm())
    return Finding(
        {
            "": {
                "regions of different counts": bool((jumps == 2).all()),
                "branches": shown > 1,
                "rings": turns > 1,
                "cusps": cusps > 0,
            }
        },
        radius,
        "radius of the sharpest turn of the dual arm's D-curve at $g = 10$ (the text names the "
        "dual arm, too); a cusp has the radius zero",
        f"For the common arm the count changes by {jumps.max()} across the curve, {shown} "
        f"branches enter a window of half-width {WIDE_WINDOW:g}, and the first one runs "
        f"{turns:.1f} times around the origin. Its sharpest turn there has a radius of "
        f"{sharpest_turn()[0]:.3f}. A cusp needs a double root $jω$, and none exists up to "
        f"{OMEGA_SEARCHED:g} rad/s.",
    )


@claim(
    "C4",
    place="Sec. III.A, first paragraph and the example of Fig. 4(a)",
    says="Delay 1 is the shorter one (text); it is the longer one (example).",
    pinned=(Verdict.NOT_AS_WRITTEN, 0.10536, 1e-4),
    affects=("C5", "D1"),
    weight=Weight.WORDING,
    printed="$τ₁ < τ₂$, and then $τ₁ = 20.1$, $τ₂ = 19.9$",
)
def order_of_the_delays() -> Finding:
    """Compare the charts of both orders."""
    chart = charts()[0]
    exchanged = stability_chart(CommonArm(ARM.controller.gain, TAU2, TAU1), chart.x, chart.y)
    mirrored = int((chart.counts != exchanged.counts.T).sum())
    return Finding(
        {PRINTED: TAU1 < TAU2, "with the arms exchanged in the text": mirrored == 0},
        float((exchanged.counts != chart.counts).mean()),
        f"share of the points in a window of half-width {WINDOW:g} whose count depends on the "
        "order",
        f"Exchanging the arms mirrors the chart at $c₁ = c₂$: {mirrored} points deviate. Eq. "
        "(5a) holds in both orders, and the matrix of Eq. (8) only in that of the text.",
    )


@claim(
    "C5",
    place="Eq. (7), the integral below it, and Eq. (8)",
    says="The recurrence weighs the delayed samples with an integral $R$ and with $g h c₂$.",
    pinned=(Verdict.NOT_AS_WRITTEN, 1.82965e-4, 1e-8),
    weight=Weight.DERIVATION,
    printed=r"$R = \int_{t_i}^{t_{i+1}} g c_k e^{-2g(t_i - ν)} dν$ and "
    r"$P φ_{t_i} + R φ(t_{i-r_1}) + g h c_2 φ(t_{i-r_2})$",
)
def recurrence() -> Finding:
    """Run the printed and the derived recurrence at (1, 1)."""
    readings = printed_maps()
    own, other = (excess(readings[k], 1.0, 1.0) for k in ("derived", "both as printed"))
    own_stable = excess(readings["derived"], 0.9, 1.05)
    package = float(spectral_radius(ARM, 0.9, 1.05, STEP)) - 1.0
    gain = float(np.exp(2.0 * ARM.controller.gain * STEP))
    return Finding(
        {
            PRINTED: abs(other) < 1e-9,
            "with $R_k = c_k (1 - e^{-2gh})/2$ for both arms": abs(own) < 1e-9
            and abs(package - own_stable) < 1e-11,
        },
        other,
        f"spectral radius minus one at (1, 1), $h = {STEP:g}$ s, as printed (exact: 0)",
        "The exponent needs $t_{i+1} - ν$. As printed the exponential grows, and R is "
        f"{gain:.4f} times too large. With the corrected weights, which the matrix of Eq. (8) "
        "suggests, the spectral radius at (1, 1) is 1 for every h.",
    )


@claim(
    "C6",
    place="below Eq. (8)",
    also={"C12": "Fig. 4(b)"},
    says="The system is stable if and only if the spectral radius of its matrix is below one.",
    pinned=(Verdict.ONE_READING, 4.416e-6, 1e-8),
    weight=Weight.DERIVATION,
)
def spectral_radius_decides() -> Finding:
    """Compare eigenvalues with counts: of the map, and of the loop near its boundary."""
    step = 2.0 * STEP
    x, y = np.random.default_rng(7).uniform(-WINDOW, WINDOW, (2, 16))
    counts = unstable_roots(semi_discretization(ARM, step), x, y)
    sizes = np.array(
        [
            np.abs(np.linalg.eigvals(transition_matrix(ARM, *p, step)))
            for p in zip(x, y, strict=True)
        ]
    )
    outside, below = (sizes > 1.0).sum(axis=1), sizes.max(axis=1) < 1.0
    wrong = int((counts != outside).sum() + (below != (counts == 0)).sum())
    exact, along = exact_radius(), rays(RAYS)
    inside = boundary_radius(semi_discretization(ARM, STEP), along)
    ray = int(np.argmax(exact - inside))
    c1, c2 = 0.5 * (exact[ray] + inside[ray]) * along[:, ray]
    radius, count = float(spectral_radius(ARM, c1, c2, STEP)), int(unstable_roots(ARM, c1, c2))
    return Finding(
        {
            "the discrete system (8)": wrong == 0,
            "the loop, with $h = 0.05$ s": not (radius > 1.0 and count == 0),
        },
        radius - 1.0,
        f"spectral radius minus one, $h = {STEP:g}$ s, at ({c1:.3f}, {c2:.3f}), where the "
        "loop is stable",
        f"At {x.size} random points the number of eigenvalues outside the unit circle, up to "
        f"{outside.max()}, equals the number of unstable roots of the discrete system. For the "
        f"loop the matrix errs within {float((exact - inside).max()):.3f} of the boundary, at "
        "the round ends of the region.",
    )


@claim(
    "C7",
    place="Fig. 4(b)",
    says="With $h = 0.05$ s, semi-discretization gives the stable region and its boundary.",
    pinned=(Verdict.REPRODUCED, 0.02800, 5e-5),
    weight=Weight.DERIVATION,
)
def region_at_the_step() -> Finding:
    """Measure how far the boundary is off at the paper's step, and how this falls with h."""
    roots, shifts = zip(*(convergence(order) for order in (0, 1)), strict=True)
    orders = [log_slope(STEPS, errors) for errors in (*roots, *shifts)]
    reach = float(exact_radius().max())
    worst = float(shifts[0][STEPS.index(STEP)])
    return Finding(
        {"": worst < 0.01 * reach and min(orders) > 0.9},
        worst,
        "largest distance along a ray between the boundary of the map and the exact one",
        f"This is {100 * worst / reach:.2f} % of the half-length of the region; a figure shows "
        "no more than 1 %. The rightmost root "
        f"at {POINTS[1]} converges with observed orders {orders[0]:.2f} (order 0) and "
        f"{orders[1]:.2f} (order 1), the boundary with {orders[2]:.2f} and {orders[3]:.2f}.",
    )


@claim(
    "C8",
    place="Sec. III.A, before Eq. (6)",
    says="Semi-discretization guarantees that the whole stable region is covered.",
    pinned=(Verdict.ONE_READING, 0.0026588, 1e-6),
    weight=Weight.DERIVATION,
    printed="Semi-Discretization guarantees that the entire stability region is covered",
)
def covers_the_region() -> Finding:
    """Compare the charts of map and loop point by point."""
    exact, held, linear = charts()
    lost, gained = (
        int((one.stable & ~other.stable).sum()) for one, other in ((exact, held), (held, exact))
    )
    wrong = int((linear.stable & ~exact.stable).sum())
    total = int(exact.stable.sum())
    return Finding(
        {
            "for ever smaller steps h": log_slope(STEPS, convergence(0)[1]) > 0.9,
            "with the step of Fig. 4(b)": lost == 0,
        },
        lost / total,
        "share of the stable grid points that the map of order 0, $h = 0.05$ s, calls unstable",
        f"Of the {total} stable points of a grid {lost} are missed, all at the two round ends; "
        "the distance falls with h. The map of order 0 calls "
        f"{gained} unstable points stable, and that of order 1 {wrong}.",
    )


@claim(
    "C9",
    place="Fig. 4(c)",
    also={"C14": "Sec. III.A, last paragraph"},
    says="The stability boundary of the common arm is the line $c₁ + c₂ = 2$.",
    pinned=(Verdict.ONE_READING, 0.40351, 1e-4),
)
def local_boundary() -> Finding:
    """Count on both sides of the line, and find the nearest other curve."""
    (first, *_) = d_curve_branches(ARM, 2.0, points_per_turn=2000)
    omega, distance = nearest_point(first, lambda x, y: np.hypot(x - 1.0, y - 1.0))
    c1 = np.linspace(0.99, 1.01, 201)
    below, above = (unstable_roots(ARM, c1, 2.0 - c1 + d) for d in (-1e-9, 1e-9))
    region = outline(exact_radius(720), rays(720))
    left, right = straight_edge()
    share = float(np.sqrt(2.0)) * (right - left) / perimeter(region)
    return Finding(
        {
            "near (1, 1)": bool((below == 0).all() and (above == 1).all()),
            "the whole boundary": share > 0.999,
        },
        share,
        "share of the perimeter of the stable region that lies on the line",
        f"The line bounds the region for $c₁$ from {left:.3f} to {right:.3f}, and the D-curve "
        f"bounds the rest. The D-curve comes no nearer to (1, 1) than {distance:.4f}, on the "
        f"unstable side, at $ω = {omega:.4f}$ rad/s.",
    )


@claim(
    "C11",
    place="Sec. III.A, before Eq. (6)",
    says="Semi-discretization is more accurate than standard discretisations of delay systems.",
    pinned=(Verdict.DIFFERS, 1642.75, 0.05),
    weight=Weight.DERIVATION,
    printed="Compared with standard discretization methods for time-delay systems, "
    "Semi-Discretization offers higher accuracy",
)
def more_accurate() -> Finding:
    """Compare errors of rightmost roots with those of other schemes of equal step."""
    errors = scheme_errors()
    others = {name: e for name, e in errors.items() if not name.startswith("semi")}

    def best(order: int) -> bool:
        own = errors[f"semi-discretization, order {order}"].roots
        return all((own < e.roots).all() for e in others.values())

    ratio = float(
        errors["semi-discretization, order 0"].roots[0] / others["explicit Euler"].roots[0]
    )
    chebyshev = max(
        float(np.abs(pseudospectral_roots(ARM, *point, round(TAU1 / STEP)) - root).min())
        for point, root in zip(POINTS, exact_roots(), strict=True)
    )
    return Finding(
        {"order 0, the paper's": best(0), "order 1": best(1)},
        ratio,
        "error of the rightmost root at (0.9, 1.05), $h = 0.05$ s, of order 0 over that of the "
        "explicit Euler method",
        "The accuracy meant is that of the roots, because the paper's next sentence calls the "
        f"boundary less precise (claim C15). At each of {len(POINTS)} points some of "
        f"{len(others)} other schemes of equal step are more accurate. A Chebyshev "
        f"discretisation of equal size has all roots to {max(chebyshev, 1e-12):.0e} rad/s.",
    )


@claim(
    "C15",
    place="Sec. III.A, before Eq. (6)",
    says="Semi-discretization represents the stability boundary less precisely.",
    pinned=(Verdict.ONE_READING, 0.02800, 5e-5),
    weight=Weight.DERIVATION,
    printed="However, its representation of the stability boundary is often less precise",
)
def less_precise() -> Finding:
    """Compare its boundary with the exact curve, and with those of other schemes."""
    errors = scheme_errors()
    own = abs(errors["semi-discretization, order 0"].boundary)
    others = [abs(e.boundary) for name, e in errors.items() if not name.startswith("semi")]
    # Schemes whose boundaries agree to three digits are equally precise.
    return Finding(
        {
            "than D-subdivision": own > 1e-6,
            "than standard discretisations": min(others) < 0.999 * own,
        },
        own,
        "largest distance along a ray between the boundary of order 0, $h = 0.05$ s, and the "
        "exact one, which the D-curve gives",
        f"The boundaries of {len(others)} other schemes of equal step are off by "
        f"{min(others):.2g} to {max(others):.2g}.",
    )


@claim(
    "C13",
    place="Sec. III.A, after the example",
    says="In practice D-subdivision may miss part of the boundary, because it is sampled.",
    pinned=(Verdict.REPRODUCED, 0.0761516, 1e-6),
    weight=Weight.DERIVATION,
    printed="its practical application suffers from numerical implementation, such as the "
    "sampling, numerical precision, finite domain, which may fail to accurately obtain the "
    "complete stability boundary",
)
def d_subdivision_alone() -> Finding:
    """Draw the curve from few samples and from many."""
    last, turn = ARM.controller.gain * np.sqrt(4.0 * WINDOW**2 - 4.0), 2.0 * np.pi / TAU1
    few, many, short = (
        float(np.abs(drawn_radius(n, end) - exact_radius()).max())
        for n, end in ((DRAWN_SAMPLES, last), (20_000, last), (20_000, 5.0))
    )
    return Finding(
        {"": few > 100.0 * many},
        few,
        "largest distance along a ray between the exact boundary and a drawing of the D-curve "
        f"from {DRAWN_SAMPLES} even samples up to {last:.4g} rad/s",
        f"One turn takes {turn:.3g} rad/s, and {DRAWN_SAMPLES} samples are "
        f"{DRAWN_SAMPLES * turn / last:.0f} a turn; with 20 000 the drawing is off by "
        f"{many:.1e}, but by {short:.2g} if it ends at 5 rad/s. Exact counts need no drawing: "
        "crossings lie where $|2 + jω/g| ≤ |c₁| + |c₂|$, and certified intervals find all of "
        "them.",
    )
