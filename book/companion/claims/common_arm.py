"""Claims of Sec. III.A, the common arm, and the computations they share with the chapter."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, minimize_scalar

from armlock.characteristic import CharacteristicFunction
from armlock.checks import FloatArray
from armlock.loops import CommonArm
from armlock.paper import COMMON_ARM_GAIN, STEP, TAU1, TAU2
from armlock.robustness.rays import first_crossing
from armlock.stability.counts import StabilityChart, stability_chart, unstable_roots
from armlock.stability.dcurve import Branch, d_curve, d_curve_branches, d_curve_line
from armlock.stability.roots import extended_root, rightmost_root
from armlock.stability.semidiscretization import (
    semi_discretization,
    spectral_radius,
    transition_matrix,
)
from book.companion.claims import ledger
from book.companion.claims.ledger import Finding, Verdict, Weight, decide
from book.companion.outline import boundary_radius, outline, perimeter, rays
from book.companion.schemes import pseudospectral_roots, sampled_loop, standard_schemes
from book.companion.shared import shared

claim = partial(ledger.claim, chapter="03_common_arm")

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


def stable_by_magnitude(chart: StabilityChart) -> float:
    """Share of a chart's stable points at which magnitudes alone exclude a crossing.

    There |c1 + c2 exp(j omega (tau1 - tau2))| < |2 + j omega / g| for every omega, whatever
    the phase the two delays have in common.
    """
    row, column = np.nonzero(chart.stable)
    c1, c2 = chart.x[column], chart.y[row]
    excluded = np.abs(c1 + c2) < 2.0
    for omega in np.linspace(0.0, 4.0 * ARM.gain * WINDOW, 561)[1:]:
        common = 2.0 * c1 * c2 * np.cos(omega * (ARM.tau1 - ARM.tau2))
        excluded &= c1**2 + c2**2 + common < 4.0 + (omega / ARM.gain) ** 2
    return float(excluded.mean())


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

    At a cusp both derivatives of the curve vanish, which is to say that D and dD/ds have a
    common root j omega. Solved for the delayed terms, that asks for two increasing phases,
    omega tau1 + atan(omega tau2 / (1/g + 2 tau2) / g) and the same with the arms exchanged,
    to be multiples of pi at one omega.

    Returns
    -------
    two float arrays
        All such frequencies in (0, omega_max), of the one and of the other condition.
    """

    def solve(tau: float, other: float) -> FloatArray:
        def phase(omega: float, turns: int = 0) -> float:
            lag = np.arctan2(omega * other, 1.0 + 2.0 * ARM.gain * other)
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


def sharpest_turn() -> tuple[float, float]:
    """Return the least radius of curvature of the D-curve in the wide window, and its omega.

    The turns of the first branch sharpen towards low frequency, as they grow; the first one
    that lies inside the window is the sharpest.
    """
    omega = np.linspace(1e-3, 2.0, 400_001)
    x, y = d_curve(ARM, omega)
    x1, y1 = np.gradient(x, omega), np.gradient(y, omega)
    bend = x1 * np.gradient(y1, omega) - y1 * np.gradient(x1, omega)
    radius = np.hypot(x1, y1) ** 3 / np.abs(bend)
    # The end on the line, at omega = 0, is no turn.
    inside = (largest_parameter(x, y) < WIDE_WINDOW) & (omega > np.pi / ARM.tau1)
    best = int(np.argmin(np.where(inside, radius, np.inf)))
    return float(radius[best]), float(omega[best])


def curve_jumps() -> FloatArray:
    """Change of the count across the D-curve, at points spread over the window."""
    branches = d_curve_branches(ARM, ARM.gain * np.sqrt(4.0 * WINDOW**2 - 4.0))
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
    present = float(np.exp(-2.0 * ARM.gain * step))
    derived = 0.5 * (1.0 - present)
    printed = 0.5 * (1.0 / present - 1.0)
    plain = ARM.gain * step
    return {
        "derived": sampled_loop(ARM, step, present, (derived, derived)),
        "integral as printed": sampled_loop(ARM, step, present, (printed, printed)),
        "g h c2 as printed": sampled_loop(ARM, step, present, (derived, plain)),
        "both as printed": sampled_loop(ARM, step, present, (printed, plain)),
    }


def excess(system: CharacteristicFunction, x: float, y: float) -> float:
    """Spectral radius of a map less one."""
    return float(np.expm1(rightmost_root(system, x, y).real * system.step))


def balanced_perturbation(system: CharacteristicFunction) -> float:
    """Value of c1 = c2 at which the map has the eigenvalue one."""
    line = d_curve_line(system)
    return line.value / (line.weight_x + line.weight_y)


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


@cache
def errors_of(system: CharacteristicFunction) -> MapErrors:
    """Compare a map's rightmost roots and its boundary with the loop's.

    The roots in extended precision: some agree to all but two digits of a double.
    """
    roots = [
        float(abs(extended_root(system, *p, root) - extended_root(ARM, *p, root)))
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


@cache
def lower_edge_errors() -> FloatArray:
    """Distance along c1 = c2 < 0 of the boundary of order 0 from the exact, over `STEPS`."""
    down = np.full((2, 1), -np.sqrt(0.5))
    exact = boundary_radius(ARM, down)
    maps = (semi_discretization(ARM, step) for step in STEPS)
    return np.array([abs(boundary_radius(m, down) - exact)[0] for m in maps])


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
    for arm in (ARM, CommonArm(ARM.gain, ARM.tau2, ARM.tau1)):
        c1, c2 = printed_d_curve(omega, arm.gain, arm.tau1, arm.tau2)
        a, b1, b2 = arm.parts(1j * omega)
        terms = np.array([a, -c1 * b1, -c2 * b2])
        residual = np.abs(terms.sum(axis=0)) / np.abs(terms).sum(axis=0)
        worst = max(worst, float(residual.max()))
    return Finding(
        decide(worst < 1e-11),
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
        decide(off == 0.0 and (steps == 1).all()),
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
    pinned=(Verdict.IN_PART, 0.0, 0.0),
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
    return Finding(
        decide((jumps == 2).all(), cusps > 0),
        cusps,
        f"cusps for $0 < ω < {OMEGA_SEARCHED:g}$ rad/s",
        f"The count changes by {jumps.max()} across the curve, {shown} branches enter a window "
        f"of half-width {WIDE_WINDOW:g}, and the {turns:.1f} turns of the first around the "
        "origin are the rings. There is no cusp, which would need a double root $jω$; sharp "
        f"turns, down to a radius of {sharpest_turn()[0]:.3f}, may be taken for some.",
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
    exchanged = stability_chart(CommonArm(ARM.gain, TAU2, TAU1), chart.x, chart.y)
    mirrored = int((chart.counts != exchanged.counts.T).sum())
    return Finding(
        decide(TAU1 < TAU2, corrected=mirrored == 0),
        float((exchanged.counts != chart.counts).mean()),
        f"share of the points in a window of half-width {WINDOW:g} whose count depends on the "
        "order",
        f"Exchanging the arms mirrors the chart at $c₁ = c₂$ ({mirrored} points off). Eq. (5a) "
        "holds in both orders, the matrix of Eq. (8) only in that of the text.",
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
    gain = float(np.exp(2.0 * ARM.gain * STEP))
    return Finding(
        decide(
            abs(other) < 1e-9,
            corrected=abs(own) < 1e-9 and abs(package - own_stable) < 1e-11,
        ),
        other,
        f"spectral radius less one at (1, 1), $h = {STEP:g}$ s, as printed (exact: 0)",
        "The exponent needs $t_{i+1} - ν$: as printed it grows, and R is "
        f"{gain:.4f} times too large. With $R_k = c_k (1 - e^{{-2gh}})/2$ for both, as the "
        "matrix of Eq. (8) suggests, the spectral radius at (1, 1) is 1 for every h. Eq. (8) "
        "ends with the sample $i - r₂$, which with the example's delays leaves its column "
        "$R₁$ outside.",
    )


@claim(
    "C6",
    place="below Eq. (8)",
    says="The system (8) is stable if and only if its spectral radius is below one.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
    weight=Weight.DERIVATION,
)
def spectral_radius_decides() -> Finding:
    """Compare dense eigenvalues with the exact count of the map's unstable roots."""
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
    return Finding(
        decide(wrong == 0),
        wrong,
        f"contradictions at {x.size} random points between eigenvalues and winding number",
        f"The number of eigenvalues outside the unit circle, up to {outside.max()}, equals the "
        "winding count. What it says of the loop is claim C12.",
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
        decide(worst < 0.01 * reach and min(orders) > 0.9),
        worst,
        "largest distance along a ray between the boundary of the map and the exact one",
        f"That is {100 * worst / reach:.2f} % of the region's half-length. The rightmost root "
        f"at {POINTS[1]} converges with observed orders {orders[0]:.2f} (order 0) and "
        f"{orders[1]:.2f} (order 1), the boundary with {orders[2]:.2f} and {orders[3]:.2f}.",
    )


@claim(
    "C8",
    place="Sec. III.A, before Eq. (6)",
    says="Semi-discretization guarantees that the whole stable region is covered.",
    pinned=(Verdict.IN_PART, 0.0026588, 1e-6),
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
        decide(lost < 0.01 * total, lost == 0),
        lost / total,
        "share of the stable grid points that the map of order 0, $h = 0.05$ s, calls unstable",
        f"{lost} of {total} stable points of a grid are lost, all at the two round ends, and "
        f"{gained} unstable ones gained: the map errs on the safe side, and leaves out less "
        f"with a smaller h. The map of order 1 calls {wrong} unstable points stable.",
    )


@claim(
    "C9",
    place="Fig. 4(c)",
    says="Near (1, 1) the boundary is the line $c₁ + c₂ = 2$.",
    pinned=(Verdict.REPRODUCED, 0.0171888, 1e-6),
)
def local_boundary() -> Finding:
    """Count on both sides of the line, and find the nearest other curve."""
    (first, *_) = d_curve_branches(ARM, 2.0, points_per_turn=2000)
    omega, distance = nearest_point(first, lambda x, y: np.hypot(x - 1.0, y - 1.0))
    c1 = np.linspace(0.99, 1.01, 201)
    below, above = (unstable_roots(ARM, c1, 2.0 - c1 + d) for d in (-1e-9, 1e-9))
    return Finding(
        decide((below == 0).all() and (above == 1).all()),
        distance,
        "distance from (1, 1) to the nearest D-curve other than the line",
        f"Nearer to (1, 1) there are two regions, with {below[0]} unstable roots below the "
        f"line and {above[0]} above it. The next curve, at $ω = {omega:.4f}$ rad/s, lies on "
        "the unstable side.",
    )


@claim(
    "C10",
    place="Sec. III.A, last paragraph",
    says="The ideal point $c₁ = c₂ = 1$ lies exactly on the boundary.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def ideal_point() -> Finding:
    """Evaluate D at s = 0, and count around the point."""
    at_zero = abs(complex(ARM(0.0, 1.0, 1.0)))
    counts = unstable_roots(ARM, 1.0, 1.0 + np.array([-1e-12, 0.0, 1e-12]))
    others = unstable_roots(ARM.shifted(-1e-4), 1.0, 1.0)
    return Finding(
        decide(at_zero == 0.0 and counts.tolist() == [0, -1, 1] and others == 1),
        at_zero,
        "$|D(0)|$ at (1, 1)",
        f"Changing $c₂$ by 1e-12 gives {counts[0]} or {counts[2]} unstable roots. The root at "
        "$s = 0$ belongs to the differentiated equation and not to the loop, as in the paper's "
        "remark on the single arm (claim S7).",
    )


@claim(
    "C11",
    place="Sec. III.A, before Eq. (6)",
    says="Semi-discretization is more accurate than standard discretisations of delay systems.",
    pinned=(Verdict.WHERE_USED, 0.0, 0.0),
    weight=Weight.DERIVATION,
    printed="Compared with standard discretization methods for time-delay systems, "
    "Semi-Discretization offers higher accuracy",
)
def more_accurate() -> Finding:
    """Compare errors of roots and boundary with other schemes of equal step."""
    errors = scheme_errors()
    own = errors["semi-discretization, order 0"]
    others = {name: e for name, e in errors.items() if not name.startswith("semi")}
    euler = others["explicit Euler"]
    better_root = sum(e.roots[0] < 0.999 * own.roots[0] for e in others.values())
    better_edge = sum(abs(e.boundary) < 0.999 * abs(own.boundary) for e in others.values())
    chebyshev = max(
        float(np.abs(pseudospectral_roots(ARM, *point, round(TAU1 / STEP)) - root).min())
        for point, root in zip(POINTS, exact_roots(), strict=True)
    )
    return Finding(
        decide(better_edge == 0, beyond=better_root == 0),
        float(better_edge),
        f"of {len(others)} standard schemes, how many have a more accurate boundary than order "
        "0, at $h = 0.05$ s",
        f"True of the boundary, for which the paper uses it: off by {abs(own.boundary):.2g}, "
        f"against {abs(euler.boundary):.2g} for explicit Euler. Not of roots: at (0.9, 1.05) "
        f"{better_root} of them do better, and explicit Euler is "
        f"{own.roots[0] / euler.roots[0]:.0f} times as accurate. A Chebyshev discretisation of "
        f"equal size has the rightmost roots to {max(chebyshev, 1e-12):.0e} rad/s, order 0 to "
        f"{own.roots.max():.0e}.",
    )


@claim(
    "C12",
    place="below Eq. (8)",
    says="The spectral radius of the matrix decides the stability of the delayed loop.",
    pinned=(Verdict.IN_PART, 4.416e-6, 1e-8),
    weight=Weight.DERIVATION,
)
def map_and_loop() -> Finding:
    """Look for a point at which the map's verdict is wrong for the loop."""
    exact, along = exact_radius(), rays(RAYS)
    inside = boundary_radius(semi_discretization(ARM, STEP), along)
    ray = int(np.argmax(exact - inside))
    x, y = 0.5 * (exact[ray] + inside[ray]) * along[:, ray]
    radius, count = float(spectral_radius(ARM, x, y, STEP)), int(unstable_roots(ARM, x, y))
    loop, held, _ = charts()
    wrong = float((loop.stable != held.stable).mean())
    return Finding(
        decide(wrong < 0.01, not (radius > 1.0 and count == 0)),
        radius - 1.0,
        f"spectral radius less one at ({x:.3f}, {y:.3f}), a stable point",
        "The paper states it of the discrete system, of which it is true (claim C6), and uses "
        f"it for the loop. With $h = {STEP:g}$ s it is right at all but {100 * wrong:.2g} % of "
        f"the points of a grid, and errs only within {float((exact - inside).max()):.3f} of "
        "the boundary, at the round ends.",
    )


@claim(
    "C13",
    place="Sec. III.A, after the example",
    says="In practice D-subdivision may miss part of the boundary, for it is sampled.",
    pinned=(Verdict.REPRODUCED, 0.0761516, 1e-6),
    weight=Weight.DERIVATION,
    printed="its practical application suffers from numerical implementation, such as the "
    "sampling, numerical precision, finite domain, which may fail to accurately obtain the "
    "complete stability boundary",
)
def d_subdivision_alone() -> Finding:
    """Draw the curve from few samples and from many."""
    last, turn = ARM.gain * np.sqrt(4.0 * WINDOW**2 - 4.0), 2.0 * np.pi / TAU1
    few, many, short = (
        float(np.abs(drawn_radius(n, end) - exact_radius()).max())
        for n, end in ((DRAWN_SAMPLES, last), (20_000, last), (20_000, 5.0))
    )
    return Finding(
        decide(few > 100.0 * many),
        few,
        "largest distance along a ray between the exact boundary and a drawing of the D-curve "
        f"from {DRAWN_SAMPLES} even samples up to {last:.4g} rad/s",
        f"One turn takes {turn:.3g} rad/s, and {DRAWN_SAMPLES} samples are "
        f"{DRAWN_SAMPLES * turn / last:.0f} a turn; with 20 000 the drawing is off by "
        f"{many:.1e}, but by {short:.2g} if it ends at 5 rad/s. D-subdivision itself misses "
        "nothing: crossings lie where $|2 + jω/g| ≤ |c₁| + |c₂|$, and steps bounded by the "
        "curve's bend find them all.",
    )


@claim(
    "C14",
    place="Sec. III.A, last paragraph",
    says="The analytical stability boundary of the common arm is the line $c₁ + c₂ = 2$.",
    pinned=(Verdict.WHERE_USED, 0.40351, 1e-4),
)
def whole_boundary() -> Finding:
    """Measure the stable region and the share of its perimeter that lies on the line."""
    region = outline(exact_radius(720), rays(720))
    left, right = straight_edge()
    share = float(np.sqrt(2.0)) * (right - left) / perimeter(region)
    return Finding(
        decide(left < 1.0 < right, beyond=share > 0.999),
        share,
        "share of the stable region's perimeter that lies on the line",
        f"The line bounds the region for $c₁$ from {left:.3f} to {right:.3f}, which holds the "
        "ideal point. The rest lies on the D-curve: an edge near $c₁ + c₂ = -2$ and two round "
        "ends, each the envelope of many turns.",
    )
