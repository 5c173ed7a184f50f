"""Claims of Sec. II, the single arm: S1 to S12."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import lambertw

from armlock.checks import FloatArray, positive_number, real_number
from armlock.dcurve import d_curve, d_curve_line
from armlock.loops import HayesEquation, SingleArm
from armlock.paper import PERTURBATION, TAU1
from armlock.roots import rightmost_root
from armlock.semidiscretization import spectral_radius
from armlock.stability import stability_chart, unstable_roots
from book.companion.claims.ledger import Finding, Verdict, claim

CHAPTER = "02_hayes"

#: Nominal gain of Sec. II in rad/s (k1 = 1 + n with n = 0).
NOMINAL_GAIN = 1.0
#: Gains times delay at which the claims are tried, over seven decades.
GAIN_DELAYS = np.logspace(-3.0, 4.0, 29)
# Agreement to rounding of a few operations.
_EXACT = 1e-12


def parameters(gain: npt.ArrayLike, k2: npt.ArrayLike) -> tuple[Any, Any]:
    """Return (a, b) = (-k1, k1 k2), the point of the Hayes chart (paper, after Eq. 3)."""
    gain = np.asarray(gain, dtype=float)
    return -gain, gain * np.asarray(k2, dtype=float)


def lambert_root(
    a: npt.ArrayLike, b: npt.ArrayLike, tau: float, branch: npt.ArrayLike = 0
) -> Any:
    """Roots of s = a + b exp(-s tau) in closed form, s = a + W_k(b tau exp(-a tau)) / tau.

    Parameters
    ----------
    a, b : array_like of float
        The free parameters; they broadcast.
    tau : float
        Delay in s.
    branch : array_like of int, optional
        Branch k of the Lambert W function; 0 is the rightmost root. It broadcasts too.

    Returns
    -------
    complex array, of the broadcast shape, in rad/s
    """
    tau = positive_number("tau", tau)
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return a + lambertw(b * tau * np.exp(-a * tau), branch) / tau


def lower_edge(a: float, tau: float) -> float:
    """Lower edge of the stable region of the Hayes equation, at a given a.

    Parameters
    ----------
    a : float
        Below 1 / tau, in 1/s.
    tau : float
        Delay in s.

    Returns
    -------
    float
        The b of the D-curve's first branch, b = -theta / (tau sin(theta)) with
        theta cot(theta) = a tau and 0 < theta < pi. The point is stable for
        b between this and -a.

    Raises
    ------
    ValueError
        If a tau is not below one: there is no stable b.
    """
    tau = positive_number("tau", tau)
    product = real_number("a", a) * tau
    if product >= 1.0:
        raise ValueError(f"a must be below 1 / tau = {1.0 / tau}, got {a}")

    def condition(theta: float) -> float:
        return float(np.sinc(theta / np.pi) * product - np.cos(theta))

    theta = brentq(condition, 0.0, np.pi, xtol=1e-15, rtol=1e-15)
    return float(-1.0 / (tau * np.sinc(theta / np.pi)))


def lowest_stable_k2(gain: float, tau: float) -> float:
    """Lowest k2 of the stable single arm, for a positive gain k1 in rad/s and tau in s.

    The stable values are those between this one, below -1 at every gain, and 1.
    """
    gain = positive_number("gain", gain)
    return lower_edge(-gain, tau) / gain


def highest_stable_gain(k2: float, tau: float) -> float:
    """Gain k1 in rad/s up to which the single arm is stable; inf for -1 <= k2 < 1.

    For k2 < -1 it is theta / (tau sqrt(k2^2 - 1)) with cos(theta) = 1 / k2; zero from
    k2 = 1 on.
    """
    tau = positive_number("tau", tau)
    k2 = real_number("k2", k2)
    if k2 >= 1.0:
        return 0.0
    if k2 >= -1.0:
        return float("inf")
    return float(np.arccos(1.0 / k2) / (tau * np.sqrt(k2 * k2 - 1.0)))


def _test_points() -> npt.NDArray[np.complex128]:
    """Return a few dozen points of the right half-plane, the same every time."""
    rng = np.random.default_rng(3)
    return rng.uniform(0.05, 1.0, 40) + 1j * rng.uniform(-3.0, 3.0, 40)


@claim(
    "S1",
    place="Sec. II, Eqs. (2) and (3)",
    says="With an integrating actuator and a plain gain, differentiating Eq. (2) gives the "
    "delay equation (3).",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 1e-8),
)
def differentiated_equation() -> Finding:
    """Put phi = exp(s t) into both equations, the integral of (2) done by quadrature."""
    k1, k2 = 1.3, 0.9
    hayes = HayesEquation(TAU1)
    worst, points = 0.0, _test_points()
    for s in points:

        def integrand(theta: float, part: str, s: complex = s) -> float:
            response = np.exp(-s * theta) * (1.0 - k2 * np.exp(-s * TAU1))
            return float(getattr(response, part))

        end = 40.0 / s.real
        integral = sum(
            unit * quad(integrand, 0.0, end, args=(part,), limit=2000, epsabs=1e-12)[0]
            for part, unit in (("real", 1.0), ("imag", 1j))
        )
        left = s * (1.0 + k1 * integral)
        right = complex(hayes(s, *parameters(k1, k2)))
        worst = max(worst, abs(left - right) / abs(right))
    return Finding(
        Verdict.REPRODUCED if worst < 1e-8 else Verdict.DIFFERS,
        float(worst),
        "largest relative difference between s times Eq. (2) and Eq. (3)",
        f"Both equations were given exp(st), at {points.size} values of s with Re s > 0, and "
        "the integral of Eq. (2) was done numerically. Eq. (3) leaves out the derivative of "
        "the free-running phase on the right, which does not matter for stability.",
    )


@claim(
    "S2",
    place="Sec. II, after Eq. (3)",
    says="Eq. (3) is the Hayes equation with a = -k₁ and b = k₁k₂, so that k₂ = -b/a.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 1e-10),
)
def hayes_correspondence() -> Finding:
    """Compare characteristic functions, and roots in three ways."""
    points = _test_points()
    worst = 0.0
    pairs = ((0.5, 0.9), (1.0, 0.3), (1.0, 1.2), (2.0, -0.7))
    for k1, k2 in pairs:
        loop, hayes = SingleArm(k1, TAU1), HayesEquation(TAU1)
        a, b = parameters(k1, k2)
        direct = loop(points, k2, 0.0)
        worst = max(worst, float(np.abs(hayes(points, a, b) / direct - 1.0).max()))
        root = complex(np.asarray(rightmost_root(loop, k2, 0.0)))
        for other in (rightmost_root(hayes, a, b), lambert_root(a, b, TAU1)):
            # Of a conjugate pair either one.
            near = min(abs(other - root), abs(np.conj(other) - root))
            worst = max(worst, float(near / abs(root)))
        worst = max(worst, float(abs(-b / a - k2)))
    return Finding(
        Verdict.REPRODUCED if worst < 1e-10 else Verdict.DIFFERS,
        worst,
        "largest relative difference of characteristic functions and rightmost roots",
        f"Compared for {len(pairs)} pairs (k₁, k₂): the loop as controller times sensor, the "
        "Hayes equation, and the rightmost root in closed form (Lambert W).",
    )


def _counts_across(gain_delay: float, width: float) -> list[int]:
    """Count the unstable roots at k2 = 1 - width, 1 and 1 + width, for tau = 1."""
    k2 = np.array([1.0 - width, 1.0, 1.0 + width])
    return [int(n) for n in unstable_roots(HayesEquation(1.0), *parameters(gain_delay, k2))]


@claim(
    "S3",
    place="Sec. II, after Eq. (3)",
    says="k₂ = 1, no perturbation, lies exactly on the stability boundary, whatever k₁ is.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def ideal_line() -> Finding:
    """Count on both sides of k2 = 1, for positive gains and for negative ones."""
    positive = [_counts_across(product, PERTURBATION) for product in GAIN_DELAYS]
    held = all(below == 0 and at == -1 and above >= 1 for below, at, above in positive)
    signs = all(
        np.sign(lambert_root(*parameters(product, 1.0 + change), 1.0).real) == np.sign(change)
        for product in GAIN_DELAYS[GAIN_DELAYS < 500.0]
        for change in (-PERTURBATION, PERTURBATION)
    )
    mirrored, beyond = _counts_across(-0.5, 1e-3), _counts_across(-2.0, 1e-3)
    line = d_curve_line(HayesEquation(1.0))
    a, b = parameters(GAIN_DELAYS, 1.0)
    distance = float(np.abs(line.weight_x * a + line.weight_y * b - line.value).max())
    return Finding(
        Verdict.REPRODUCED if held and signs and distance == 0.0 else Verdict.DIFFERS,
        distance,
        "largest distance of (-k₁, k₁) from the line a + b = 0",
        f"For every gain tried, k₁τ from {GAIN_DELAYS[0]:g} to {GAIN_DELAYS[-1]:g}, there is "
        f"no unstable root at k₂ = 1 - {PERTURBATION:g} and at least one at "
        f"1 + {PERTURBATION:g} ({positive[-1][-1]} at the highest gain), by count and by "
        "Lambert W. It takes a positive gain, as the paper's k₁ = 1 + n is. At k₁τ = -0.5 the "
        f"sides are exchanged ({mirrored[0]} unstable root below k₂ = 1, {mirrored[2]} above), "
        f"and at k₁τ = -2 neither side is stable ({beyond[0]} and {beyond[2]} unstable roots).",
    )


@claim(
    "S4",
    place="Sec. II, after Eq. (3)",
    says="For k₂ > 1 the loop is unstable.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 1.0, 0.0),
)
def above_one() -> Finding:
    """Count above k2 = 1, and see the real root that D(0) < 0 < D(infinity) forces."""
    k2 = 1.0 + np.logspace(-9.0, 1.0, 41)
    gains = GAIN_DELAYS[:, None]
    counts = unstable_roots(HayesEquation(1.0), *parameters(gains, k2))
    moderate = gains[gains[:, 0] < 500.0]
    real = lambert_root(*parameters(moderate, k2), 1.0).real
    least = int(counts.min())
    rate = float(lambert_root(*parameters(NOMINAL_GAIN, 1.0 + PERTURBATION), TAU1).real)
    first_order = NOMINAL_GAIN * PERTURBATION / (1.0 + NOMINAL_GAIN * TAU1)
    return Finding(
        Verdict.REPRODUCED if least >= 1 and bool((real > 0.0).all()) else Verdict.DIFFERS,
        least,
        "fewest unstable roots over a grid of k₂ > 1 and k₁ > 0",
        f"Counted at {counts.size} points with k₂ - 1 from {k2[0] - 1:.0e} to "
        f"{k2[-1] - 1:.0f}, "
        "and confirmed by Lambert W. The characteristic function s + k₁ - k₁k₂ exp(-sτ) is "
        "k₁(1 - k₂) < 0 at s = 0 and grows to infinity, which forces a positive real root at "
        f"every gain. Near 1 it is slow: at k₂ = 1 + {PERTURBATION:g}, k₁ = {NOMINAL_GAIN:g}/s "
        f"and τ = {TAU1} s it grows at {rate:.3g}/s, as k₁(k₂ - 1)/(1 + k₁τ) = "
        f"{first_order:.3g}/s says.",
    )


@claim(
    "S5",
    place="Sec. II, after Eq. (3)",
    says="For k₂ < 1 the loop is stable.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, -1.011031041661212, 1e-12),
)
def below_one() -> Finding:
    """Find the lower limit of k2 from the Hayes boundary and count on both sides of it."""
    limit = lowest_stable_k2(NOMINAL_GAIN, TAU1)
    limits = np.array([lowest_stable_k2(product, 1.0) for product in GAIN_DELAYS])
    hayes = HayesEquation(1.0)
    inside = unstable_roots(hayes, *parameters(GAIN_DELAYS, limits * (1.0 - 1e-9)))
    outside = unstable_roots(hayes, *parameters(GAIN_DELAYS, limits * (1.0 + 1e-9)))
    k2 = np.linspace(-1.0, 1.0, 201)[:-1]
    between = unstable_roots(hayes, *parameters(GAIN_DELAYS[:, None], k2))
    moderate = GAIN_DELAYS[:, None][GAIN_DELAYS < 500.0]
    decays = bool((lambert_root(*parameters(moderate, k2), 1.0).real < 0.0).all())
    sound = (
        bool((inside == 0).all())
        and bool((outside == 2).all())
        and bool((between == 0).all())
        and decays
    )
    small, large = lowest_stable_k2(0.1, 1.0), lowest_stable_k2(1000.0, 1.0)
    if np.isfinite(limit):
        verdict = Verdict.IN_PART if sound else Verdict.DIFFERS
    else:
        verdict = Verdict.REPRODUCED
    return Finding(
        verdict,
        limit,
        f"lowest stable k₂ at k₁ = {NOMINAL_GAIN:g}/s, τ = {TAU1} s",
        "Stable for -1 ≤ k₂ < 1 at every gain, perturbations of any realistic size included, "
        "but not for every k₂ < 1: below 1/cos θ, where θ cot θ = -k₁τ and π/2 < θ < π, a pair "
        f"of roots is unstable. That limit is {small:.4g} at k₁τ = 0.1 and rises towards -1 "
        f"with the gain ({large:.8f} at k₁τ = 1000).",
    )


@claim(
    "S6",
    place="Sec. II, after Eq. (3)",
    says="Lowering k₂ below 1 turns the line of the loop counter-clockwise into the stable "
    "region.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, np.degrees(np.pi / 4 - np.arctan(0.5)), 1e-9),
)
def turning_line() -> Finding:
    """Measure the angle of the half line (-k1, k1 k2) as k2 falls, and count along it."""
    k2 = np.linspace(1.0, 0.0, 101)
    a, b = parameters(1.0, k2)
    angle = np.degrees(np.unwrap(np.arctan2(b, a)))
    turned = float(np.interp(0.5, k2[::-1], (angle - angle[0])[::-1]))
    gains = GAIN_DELAYS[:, None]
    into = unstable_roots(HayesEquation(1.0), *parameters(gains, k2[1:]))
    other_half = unstable_roots(HayesEquation(1.0), *parameters(-gains, k2[1:]))
    ccw = bool((np.diff(angle) > 0.0).all())
    return Finding(
        Verdict.REPRODUCED if ccw and bool((into == 0).all()) else Verdict.DIFFERS,
        turned,
        "degrees by which the half line turns from k₂ = 1 to 0.5, counter-clockwise positive",
        f"The half line of positive gains, a < 0, turns from {angle[0]:.0f}° at k₂ = 1 to "
        f"{angle[-1]:.0f}° at k₂ = 0 and lies in the stable region all the way. The other half "
        f"of the line, a > 0, turns out of it: at least {int(other_half.min())} unstable root "
        "on all of it.",
    )


def _roots_near_zero(function: Any, radius: float) -> int:
    """Return zeros less poles of a function inside |s| = radius, by its winding."""
    s = radius * np.exp(2j * np.pi * np.linspace(0.0, 1.0, 4097))
    turns = np.unwrap(np.angle(function(s)))
    return round(float(turns[-1] - turns[0]) / (2.0 * np.pi))


@claim(
    "S7",
    place="Sec. II, Remark",
    says="Eq. (3) has an additional root at s = 0 that Eq. (2) does not have, because it was "
    "differentiated.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 1.0 + TAU1, 1e-6),
)
def additional_root() -> Finding:
    """Compare the roots of s (1 + L) with those of 1 + L, on and off k2 = 1."""
    loop = SingleArm(NOMINAL_GAIN, TAU1)
    extra = {}
    for k2 in (0.9, 1.0, 1.1):

        def undifferentiated(s: Any, k2: float = k2) -> Any:
            return 1.0 + loop.open_loop(s, k2)

        def differentiated(s: Any, k2: float = k2) -> Any:
            return loop(s, k2, 0.0)

        # L has a simple pole at zero where its integrand does not vanish there.
        pole = abs(loop.open_loop(1e-12, k2)) > 1e6
        radius = 0.02
        roots_of_loop = _roots_near_zero(undifferentiated, radius) + int(pole)
        extra[k2] = _roots_near_zero(differentiated, radius) - roots_of_loop
    at_zero = float(np.real(1.0 + loop.open_loop(1e-12, 1.0)))
    nearby = 1.0 - PERTURBATION
    root = complex(np.asarray(rightmost_root(loop, nearby, 0.0)))
    residual = abs(complex(1.0 + loop.open_loop(root, nearby)))
    if set(extra.values()) == {1}:
        verdict = Verdict.REPRODUCED
    else:
        verdict = Verdict.IN_PART if extra[1.0] == 1 else Verdict.DIFFERS
    return Finding(
        verdict,
        at_zero,
        f"1 + L(0) at k₂ = 1, k₁ = {NOMINAL_GAIN:g}/s, τ = {TAU1} s: not zero",
        f"True at k₂ = 1 only. There s(1 + L), with L the open loop of Eq. (2), has "
        f"{extra[1.0]} root more than 1 + L, whose value at zero is 1 + k₁τ. For every other "
        "k₂ the open loop has a pole at s = 0, which the factor s cancels, and no root is "
        f"added (difference {extra[0.9]} at k₂ = 0.9, {extra[1.1]} at 1.1). So the root near "
        f"zero at k₂ = 1 - {PERTURBATION:g}, "
        f"s = {root.real:.3g}/s, is one of the loop itself: |1 + L| = {residual:.1g}.",
    )


@claim(
    "S8",
    place="Sec. II, after Eq. (2); caption of Fig. 2",
    says="n is the additive noise of Eq. (1), and also the deviation of the gain, k₁ = 1 + n.",
    chapter=CHAPTER,
    pinned=(Verdict.NOT_AS_WRITTEN, 0.434699287, 1e-8),
    affects=("S9",),
)
def symbols() -> Finding:
    """Take n as a gain and follow the slowest root; take it as a signal and run the loop."""
    n, k2 = 0.1, 0.9
    rates = [
        float(lambert_root(*parameters(gain, k2), TAU1).real)
        for gain in (NOMINAL_GAIN, NOMINAL_GAIN + n)
    ]
    as_gain = rates[1] / rates[0] - 1.0
    as_signal = _separation(NOMINAL_GAIN, k2, n) / _separation(NOMINAL_GAIN, k2, 0.0) - 1.0
    distinct = abs(as_signal) < 1e-9 < abs(as_gain)
    return Finding(
        Verdict.NOT_AS_WRITTEN if distinct else Verdict.REPRODUCED,
        100.0 * as_gain,
        f"change, in %, of the slowest root's rate by n = {n:g} in k₁, at k₂ = {k2:g} and τ = "
        f"{TAU1} s",
        "Two quantities share one letter. As a part of k₁, n moves the roots: the slowest one "
        f"decays at {-rates[0]:.4g}/s without it and at {-rates[1]:.4g}/s with it. As the "
        "additive noise of Eq. (1) it is an input of the loop and moves no root: k₂ is 1 + η, "
        "k₁ stays as it is, and two runs from different starts, both with n, come together as "
        f"two without it do (to {_bound(abs(as_signal)):.0e}, twenty round trips simulated). "
        "The caption of Fig. 2 calls the multiplicative disturbance δ and the additive one η, "
        "the text η and n. And k₁ is a rate: its nominal 1 has the unit rad/s. We take k₁ as "
        "any positive gain, and k₂ = 1 + η.",
    )


def _bound(rounding: float) -> float:
    """Return a power of ten above an error of rounding, which differs from run to run."""
    return float(10.0 ** np.ceil(np.log10(max(rounding, 1e-12))))


def _separation(gain: float, k2: float, n: float) -> float:
    """Return how far two runs of the loop are apart after twenty round trips.

    One starts from phi = 1, the other from 0; to both, the arm adds n. Between samples the
    delayed signal is held, and the equation solved exactly.
    """
    steps = 200
    flow = np.exp(-gain * TAU1 / steps)
    runs = []
    for start in (1.0, 0.0):
        phi = np.full(21 * steps + 1, start)
        for i in range(steps, phi.size - 1):
            phi[i + 1] = flow * phi[i] + (1.0 - flow) * (k2 * phi[i - steps] + n)
        runs.append(phi[-1])
    return float(runs[0] - runs[1])


@claim(
    "S9",
    place="Sec. II, after Eq. (3)",
    says="Stability is decided mainly by the multiplicative perturbation; changes of k₁ do not "
    "affect it directly.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 2.0 * np.pi / 3.0 / np.sqrt(3.0), 1e-12),
)
def gain_matters() -> Finding:
    """Look for a k2 at which the verdict depends on the gain."""
    k2 = np.array([-3.0, -2.0, -1.5, -1.1, -1.0, -0.5, 0.0, 0.5, 0.9, 1.1, 1.5, 2.0])
    stable = unstable_roots(HayesEquation(1.0), *parameters(GAIN_DELAYS[:, None], k2)) == 0
    depends = stable.any(axis=0) & ~stable.all(axis=0)
    limit = highest_stable_gain(-2.0, 1.0)
    sides = unstable_roots(
        HayesEquation(1.0), *parameters(limit * np.array([1.0 - 1e-9, 1.0 + 1e-9]), -2.0)
    )
    as_expected = bool((depends == (k2 < -1.0)).all()) and sides.tolist() == [0, 2]
    if not depends.any():
        verdict = Verdict.REPRODUCED
    else:
        verdict = Verdict.IN_PART if as_expected else Verdict.DIFFERS
    return Finding(
        verdict,
        limit,
        "k₁τ up to which the loop is stable at k₂ = -2",
        "For k₂ ≥ -1, so for every perturbation the paper considers, the sign of k₂ - 1 "
        f"decides alone: over k₁τ from {GAIN_DELAYS[0]:g} to {GAIN_DELAYS[-1]:g} the verdict "
        "never changes. For k₂ < -1 the gain decides: stable up to k₁τ = θ/√(k₂² - 1) with "
        f"cos θ = 1/k₂, confirmed by counts on both sides ({sides[0]} and {sides[1]}). The "
        "gain also sets how fast perturbations grow or decay.",
    )


@claim(
    "S10",
    place="Sec. II, Remark",
    says="The additional root does not affect stability: the line k₂ = 1 bounds the region "
    "analytically without a root of the loop on the imaginary axis.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, -0.0020258541171, 1e-12),
)
def ideal_loop_is_stable() -> Finding:
    """Find the rightmost root of 1 + L at k2 = 1, and count those to its right."""
    a, b = parameters(NOMINAL_GAIN, 1.0)
    zero = complex(lambert_root(a, b, TAU1))
    following = complex(lambert_root(a, b, TAU1, branch=1))
    loop = SingleArm(NOMINAL_GAIN, TAU1)
    margin = 0.01 * abs(following.real)
    right_of = [
        int(unstable_roots(loop.shifted(following.real + side * margin), 1.0, 0.0))
        for side in (1.0, -1.0)
    ]
    in_loop = abs(complex(1.0 + loop.open_loop(following))) < 1e-9
    sound = abs(zero) < _EXACT and right_of == [1, 3] and in_loop and following.real < 0.0
    return Finding(
        Verdict.REPRODUCED if sound else Verdict.DIFFERS,
        following.real,
        f"real part in 1/s of the loop's rightmost roots at k₂ = 1 (k₁ = {NOMINAL_GAIN:g}/s, "
        f"τ = {TAU1} s)",
        f"These are s = {following.real:.4g} ± {following.imag:.4g}j in rad/s, by Lambert W, "
        f"and the count agrees: right of them Eq. (3) has {right_of[0]} root, the one at s = "
        "0, which Eq. (2) has not. So the loop of Eq. (2) is stable at k₂ = 1, the last stable "
        "point on the way up: above, a root of the loop comes out of s = 0. Eq. (3) is stable "
        "only below 1; the root it keeps at s = 0 is a constant offset, the integrator's "
        "memory of how the loop was started.",
    )


@claim(
    "S11",
    place="Fig. 3 and its caption",
    says="The red line of slope -1 through the origin is the ideal condition, and the boundary "
    "of the stable region.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 1.0, 1e-6),
)
def end_of_line() -> Finding:
    """Follow b = -a into a > 0, and find where the region below it ends."""
    hayes = HayesEquation(1.0)
    below = 1e-9

    def stable(a: float) -> bool:
        return int(unstable_roots(hayes, a, -a - below * (1.0 + abs(a)))) == 0

    inside, outside = 0.5, 2.0
    if stable(outside) or not stable(inside):
        inside = outside = float("nan")
    while outside - inside > 1e-10:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if stable(middle) else (inside, middle)
    x, y = d_curve(hayes, 1e-6)
    corner = bool(abs(x - 1.0) < 1e-9) and bool(abs(y + 1.0) < 1e-9)
    beyond = int(unstable_roots(hayes, 1.5, -1.5 - 1e-3))
    matches = corner and abs(inside - 1.0) < 1e-3
    return Finding(
        Verdict.IN_PART if matches else Verdict.DIFFERS,
        inside,
        "aτ at which the line stops bounding the stable region, by bisection",
        "The line bounds the region from a = -∞ to the corner at (1, -1)/τ, where the D-curve "
        f"meets it, and not beyond: at aτ = 1.5 there are {beyond} unstable roots just below "
        "it. Only its half a < 0 belongs to loops with positive gain, so the arm never reaches "
        "that end.",
    )


@claim(
    "S12",
    place="Sec. III.A, after Eq. (5)",
    says="For a single arm D-subdivision yields the whole stable region directly.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def closed_form_region() -> Finding:
    """Compare the closed form's region with a chart, and a sample with two other methods."""
    hayes = HayesEquation(1.0)
    a, b = np.linspace(-10.0, 2.0, 241), np.linspace(-12.0, 11.0, 231)
    chart = stability_chart(hayes, a, b)
    lower = np.array([lower_edge(value, 1.0) if value < 1.0 else np.inf for value in a])
    predicted = (lower < b[:, None]) & (b[:, None] < -a)
    on_edge = chart.counts < 0
    wrong = int(((chart.counts == 0) != predicted)[~on_edge].sum())
    agreeing, tried = _three_verdicts(60)
    return Finding(
        Verdict.REPRODUCED if wrong == 0 and agreeing == tried else Verdict.DIFFERS,
        wrong,
        f"points of a chart of {chart.counts.size} where region and count disagree",
        "The region lies between the line b = -a and the first branch of the D-curve, "
        "a = ω cot ωτ, b = -ω / sin ωτ for 0 < ωτ < π; the other branches only separate "
        f"unstable from unstable. At {tried} random points the count, Lambert W and the "
        f"semi-discretized map agree in {agreeing} verdicts.",
    )


def _three_verdicts(number: int) -> tuple[int, int]:
    """Return at how many random points three methods agree, and how many were tried."""
    rng = np.random.default_rng(11)
    a, b = rng.uniform(-4.0, 1.5, number), rng.uniform(-5.0, 4.0, number)
    rate: FloatArray = lambert_root(a, b, 1.0).real
    # The map's own error at this step; nearer to the boundary it cannot decide.
    a, b, rate = (values[np.abs(rate) > 0.02] for values in (a, b, rate))
    counted = unstable_roots(HayesEquation(1.0), a, b) == 0
    mapped = spectral_radius(HayesEquation(1.0), a, b, step=0.02, order=1) < 1.0
    same = (counted == (rate < 0.0)) & (counted == mapped)
    return int(same.sum()), int(same.size)


__all__ = [
    "GAIN_DELAYS",
    "NOMINAL_GAIN",
    "highest_stable_gain",
    "lambert_root",
    "lower_edge",
    "lowest_stable_k2",
    "parameters",
]
