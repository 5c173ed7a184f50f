"""Claims of Sec. II, the single arm; its S3 is a place of claim Z1."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad
from scipy.optimize import bisect, brentq
from scipy.special import lambertw

from armlock.checks import ComplexArray, IntArray
from armlock.controllers import Controller, integrating_actuator, stage_one, table_two
from armlock.loops import HayesEquation, Loop, SingleArm, paper_loop
from armlock.paper import CONTROLLER_GAIN, PERTURBATION, TAU1
from armlock.robustness import critical_perturbation, margins
from armlock.sensors import SINGLE
from armlock.stability.charts import stability_chart
from armlock.stability.counts import unstable_roots
from armlock.stability.dcurve import d_curve
from armlock.stability.roots import rightmost_root
from book.companion.claims.ledger import PRINTED, Finding, Verdict, Weight, claim

#: Nominal gain of Sec. II in rad/s (k1 = 1 + n with n = 0).
NOMINAL_GAIN = 1.0
#: Gains times delay at which the claims are tried, over seven decades.
GAIN_DELAYS = np.logspace(-3.0, 4.0, 29)
#: Those of them at which exp(k1 tau), in the argument of Lambert W, does not overflow.
MODERATE = GAIN_DELAYS[GAIN_DELAYS < 500.0]
#: The equation in units of the delay.
HAYES = HayesEquation(1.0)


# Closed forms -------------------------------------------------------------------------------


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
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return a + lambertw(b * tau * np.exp(-a * tau), branch) / tau


def lowest_stable_b(a: float, tau: float) -> float:
    """Lower edge of the stable region of the Hayes equation, at a given a < 1 / tau.

    It is the b of the D-curve's first branch, b = -theta / (tau sin(theta)) with
    theta cot(theta) = a tau and 0 < theta < pi. Points are stable for b between it and -a.
    """

    def condition(theta: float) -> float:
        return float(np.sinc(theta / np.pi) * a * tau - np.cos(theta))

    theta = brentq(condition, 0.0, np.pi, xtol=1e-15, rtol=1e-15)
    return float(-1.0 / (tau * np.sinc(theta / np.pi)))


def lowest_stable_k2(gain: float, tau: float) -> float:
    """Lowest k2 of the stable single arm, for a positive gain k1 in rad/s and tau in s.

    The stable values are those between this one, below -1 at every gain, and 1.
    """
    return lowest_stable_b(-gain, tau) / gain


def highest_stable_gain(k2: float, tau: float) -> float:
    """Gain k1 in rad/s up to which the single arm is stable, for k2 < -1.

    It is theta / (tau sqrt(k2^2 - 1)) with cos(theta) = 1 / k2.
    """
    return float(np.arccos(1.0 / k2) / (tau * np.sqrt(k2 * k2 - 1.0)))


def _counts(gain: npt.ArrayLike, k2: npt.ArrayLike) -> IntArray:
    """Count unstable roots at gains in units of 1 / tau."""
    return unstable_roots(HAYES, *parameters(gain, k2))


def _test_points() -> ComplexArray:
    """Return a few dozen points of the right half-plane, the same every time."""
    rng = np.random.default_rng(3)
    return rng.uniform(0.05, 1.0, 40) + 1j * rng.uniform(-3.0, 3.0, 40)


# Claims -------------------------------------------------------------------------------------


@claim(
    "S1",
    place="Sec. II, Eqs. (2) and (3)",
    says="With an integrating actuator and a gain, differentiating Eq. (2) gives Eq. (3).",
    pinned=(Verdict.NOT_AS_WRITTEN, 0.0, 1e-8),
    weight=Weight.DERIVATION,
    printed=r"$φ(t) + k_1 \int h_c(θ) h_a(θ) (φ(t-θ) - k_2 φ(t-τ-θ)) dθ$",
)
def differentiated_equation() -> Finding:
    """Put phi = exp(s t) into both equations, the integral of (2) done by quadrature."""
    k1, k2 = 1.3, 0.9
    worst, product, points = 0.0, 0.0, _test_points()
    for s in points:

        def integrand(theta: float, s: complex = s) -> complex:
            return complex(np.exp(-s * theta) * (1.0 - k2 * np.exp(-s * TAU1)))

        end = 40.0 / s.real
        integral, _ = quad(integrand, 0.0, end, limit=2000, epsabs=1e-12, complex_func=True)
        left = s * (1.0 + k1 * integral)
        right = complex(HayesEquation(TAU1).characteristic(s, *parameters(k1, k2)))
        worst = max(worst, abs(left - right) / abs(right))
        # The product of the gain's impulse at zero and the actuator's step is that impulse.
        printed = s * (1.0 + k1 * (1.0 - k2 * np.exp(-s * TAU1)))
        product = max(product, abs(printed - right) / abs(right))
    return Finding(
        {PRINTED: product < 1e-8, "with the convolution of $h_c$ and $h_a$": worst < 1e-8},
        float(worst),
        "largest relative difference between s times Eq. (2) and Eq. (3)",
        "Controller and actuator act one after the other, so that their impulse responses are "
        f"convolved. Both equations were tried with $e^{{st}}$ at {points.size} values of s in "
        "the right half-plane. Eq. (3) omits the derivative of the free-running phase on its "
        "right side, which does not affect stability.",
    )


@claim(
    "S2",
    place="Sec. II, after Eq. (3)",
    says="Eq. (3) is the Hayes equation with $a = -k₁$ and $b = k₁k₂$.",
    pinned=(Verdict.REPRODUCED, 0.0, 1e-10),
    weight=Weight.DERIVATION,
)
def hayes_correspondence() -> Finding:
    """Compare characteristic functions, and roots in three ways."""
    points, hayes = _test_points(), HayesEquation(TAU1)
    off = []
    pairs = ((0.5, 0.9), (1.0, 0.3), (1.0, 1.2), (2.0, -0.7))
    for k1, k2 in pairs:
        loop, (a, b) = SingleArm(k1, TAU1), parameters(k1, k2)
        of_hayes = hayes.characteristic(points, a, b)
        of_loop = loop.characteristic(points, k2, 0.0)
        off += [*np.abs(of_hayes / of_loop - 1.0), abs(-b / a - k2)]
        root = complex(rightmost_root(loop, k2, 0.0))
        for other in (rightmost_root(hayes, a, b), lambert_root(a, b, TAU1)):
            # Of a conjugate pair either one.
            off.append(min(abs(other - root), abs(np.conj(other) - root)) / abs(root))
    return Finding(
        {"": max(off) < 1e-10},
        float(max(off)),
        "largest relative difference of characteristic functions and rightmost roots",
        f"Compared for {len(pairs)} pairs $(k₁, k₂)$: the loop as controller times sensor, the "
        "Hayes equation, and the rightmost root in closed form (Lambert W).",
    )


@claim(
    "S4",
    place="Sec. II, after Eq. (3)",
    says="For $k₂ > 1$ the loop is unstable.",
    pinned=(Verdict.REPRODUCED, 1.0, 0.0),
)
def above_one() -> Finding:
    """Count above k2 = 1, and see the real root that D(0) < 0 < D(infinity) forces."""
    k2 = 1.0 + np.logspace(-9.0, 1.0, 41)
    counts = _counts(GAIN_DELAYS[:, None], k2)
    real = lambert_root(*parameters(MODERATE[:, None], k2), 1.0).real
    rate = float(lambert_root(*parameters(NOMINAL_GAIN, 1.0 + PERTURBATION), TAU1).real)
    return Finding(
        {"": bool(counts.min() >= 1 and (real > 0.0).all())},
        int(counts.min()),
        "fewest unstable roots over a grid of $k₂ > 1$ and $k₁ > 0$",
        "$D(s) = s + k₁ - k₁k₂ e^{-sτ}$ is negative at $s = 0$ and grows to infinity, which "
        "forces a positive real root at every gain. Near 1 it is slow: at $k₂ = 1$ plus "
        f"{PERTURBATION:g}, $k₁ = {NOMINAL_GAIN:g}$/s and $τ = {TAU1}$ s the loop grows by a "
        f"factor e in {1.0 / rate / 86400.0:.0f} days.",
    )


@claim(
    "S5",
    place="Sec. II, after Eq. (3)",
    says="For $k₂ < 1$ the loop is stable.",
    pinned=(Verdict.ONE_READING, -1.011031041661212, 1e-12),
)
def below_one() -> Finding:
    """Find the lower limit of k2 from the Hayes boundary and count on both sides of it."""
    limit = lowest_stable_k2(NOMINAL_GAIN, TAU1)
    limits = np.array([lowest_stable_k2(product, 1.0) for product in GAIN_DELAYS])
    inside, outside = (_counts(GAIN_DELAYS, limits * (1.0 + side)) for side in (-1e-9, 1e-9))
    k2 = np.linspace(-1.0, 1.0, 201)[:-1]
    between = _counts(GAIN_DELAYS[:, None], k2)
    rates = lambert_root(*parameters(MODERATE[:, None], k2), 1.0).real
    down_to_limit = not inside.any() and not between.any() and (rates < 0.0).all()
    return Finding(
        {
            "$k₂$ near 1, down to -1": bool(down_to_limit and (outside == 2).all()),
            "every $k₂ < 1$": not outside.any(),
        },
        limit,
        f"lowest stable $k₂$ at $k₁ = {NOMINAL_GAIN:g}$/s, $τ = {TAU1}$ s",
        r"A pair of roots is unstable below $k₂ = 1/cos θ$, where $θ cot θ = -k₁τ$ and $\pi/2 "
        r"< θ < \pi$. This limit is below -1 at every gain, far from any realistic "
        "perturbation.",
    )


@claim(
    "S6",
    place="Sec. II, after Eq. (3)",
    says="Lowering $k₂$ turns the loop's line counter-clockwise into the stable region.",
    pinned=(Verdict.REPRODUCED, np.degrees(np.pi / 4 - np.arctan(0.5)), 1e-9),
    weight=Weight.DERIVATION,
)
def turning_line() -> Finding:
    """Measure the angle of the half line (-k1, k1 k2) as k2 falls, and count along it."""
    k2 = np.linspace(1.0, 0.0, 101)
    a, b = parameters(1.0, k2)
    angle = np.degrees(np.unwrap(np.arctan2(b, a)))
    turned = float(np.interp(0.5, k2[::-1], (angle - angle[0])[::-1]))
    into = _counts(GAIN_DELAYS[:, None], k2[1:])
    return Finding(
        {"": bool((np.diff(angle) > 0.0).all() and not into.any())},
        turned,
        "degrees by which the half line turns from $k₂ = 1$ to 0.5, counter-clockwise positive",
        f"The half line of positive gains, $a < 0$, turns from {angle[0]:.0f}° at $k₂ = 1$ to "
        f"{angle[-1]:.0f}° at $k₂ = 0$ and lies in the stable region all the way.",
    )


@claim(
    "S7",
    place="Sec. II, Remark",
    says="Eq. (3), being differentiated, has a root at $s = 0$ that Eq. (2) does not have.",
    pinned=(Verdict.ONE_READING, 1.0 + TAU1, 1e-6),
    weight=Weight.DERIVATION,
    printed="The differentiation step introduces an additional root at $s = 0$",
)
def additional_root() -> Finding:
    """Compare the roots of s (1 + L) with those of 1 + L, on and off k2 = 1."""
    loop = SingleArm(NOMINAL_GAIN, TAU1)
    s = 0.02 * np.exp(2j * np.pi * np.linspace(0.0, 1.0, 4097))
    extra = {}
    for k2 in (0.9, 1.0, 1.1):
        # L has a simple pole at zero where its integrand does not vanish there.
        pole = int(abs(loop(1e-12, k2)) > 1e6)
        roots_of_loop = _winding(1.0 + loop(s, k2)) + pole
        extra[k2] = _winding(loop.characteristic(s, k2, 0.0)) - roots_of_loop
    return Finding(
        {"at $k₂ = 1$": extra[1.0] == 1, "at every $k₂$": extra[0.9] == extra[1.1] == 1},
        float(np.real(1.0 + loop(1e-12, 1.0))),
        f"$1 + L(0)$ at $k₂ = 1$, $k₁ = {NOMINAL_GAIN:g}$/s, $τ = {TAU1}$ s: not zero",
        f"At $k₂ = 1$ the function $s(1 + L)$ of Eq. (3) has {extra[1.0]} root more than "
        "$1 + L$ of Eq. (2). At every other $k₂$ the open loop L has a pole at $s = 0$, which "
        "the factor s cancels, and no root is added.",
    )


def _winding(values: ComplexArray) -> int:
    """Return how often values along a circle go around zero: zeros less poles inside."""
    angle = np.unwrap(np.angle(values))
    return round(float(angle[-1] - angle[0]) / (2.0 * np.pi))


@claim(
    "S8",
    place="Sec. II, after Eq. (2); caption of Fig. 2",
    says="$n$ is the additive noise of Eq. (1), and also the deviation of the gain.",
    pinned=(Verdict.NOT_AS_WRITTEN, 0.434699287, 1e-8),
    weight=Weight.WORDING,
    printed="$(1+η(t))X(t) + n(t)$, and then $k₁ = 1 + n$, $k₂ = 1 + η$",
)
def symbols() -> Finding:
    """Take n as a gain and follow the slowest root, which no additive input moves."""
    n, k2 = 0.1, 0.9
    before, after = (
        float(lambert_root(*parameters(gain, k2), TAU1).real)
        for gain in (NOMINAL_GAIN, NOMINAL_GAIN + n)
    )
    change = after / before - 1.0
    return Finding(
        {PRINTED: change == 0.0, "with two letters": change != 0.0},
        100.0 * change,
        f"change, in %, of the slowest root's rate by $n = {n:g}$ in $k₁$, at $k₂ = {k2:g}$ "
        f"and $τ = {TAU1}$ s",
        "Two quantities share one letter. As a part of the gain $k₁$, n moves the roots; as an "
        "additive input of the loop it moves none. The caption of Fig. 2 moreover uses δ for "
        "the multiplicative disturbance and η for the additive one.",
    )


@claim(
    "S9",
    place="Sec. II, after Eq. (3)",
    says="The multiplicative perturbation decides stability; $k₁$ does not affect it directly.",
    pinned=(Verdict.ONE_READING, 2.0 * np.pi / 3.0 / np.sqrt(3.0), 1e-12),
)
def gain_matters() -> Finding:
    """Look for a k2 at which the verdict depends on the gain."""
    k2 = np.array([-3.0, -2.0, -1.5, -1.1, -1.0, -0.5, 0.0, 0.5, 0.9, 1.1, 1.5, 2.0])
    stable = _counts(GAIN_DELAYS[:, None], k2) == 0
    depends = stable.any(axis=0) & ~stable.all(axis=0)
    limit = highest_stable_gain(-2.0, 1.0)
    sides = _counts(limit * np.array([1.0 - 1e-9, 1.0 + 1e-9]), -2.0)
    below_minus_one = (depends == (k2 < -1.0)).all() and sides.tolist() == [0, 2]
    return Finding(
        {"$k₂$ near 1, down to -1": bool(below_minus_one), "every $k₂$": not depends.any()},
        limit,
        "$k₁τ$ up to which the loop is stable at $k₂ = -2$",
        "For $k₂ ≥ -1$ the sign of $k₂ - 1$ alone decides, for all gains tried, $k₁τ$ from "
        f"{GAIN_DELAYS[0]:g} to {GAIN_DELAYS[-1]:g}. For $k₂ < -1$ the loop is stable up to "
        r"$k₁τ = θ/\sqrt{k_2^2 - 1}$ with $cos θ = 1/k₂$.",
    )


@claim(
    "S10",
    place="Sec. II, Remark",
    says="The additional root does not affect stability; no root of the loop is on the axis.",
    pinned=(Verdict.REPRODUCED, -0.0020258541171, 1e-12),
    printed="This root is marginally stable, which does not affect the stability of the system",
)
def ideal_loop_is_stable() -> Finding:
    """Find the rightmost root of 1 + L at k2 = 1, and count those to its right."""
    point = parameters(NOMINAL_GAIN, 1.0)
    zero, following = (complex(lambert_root(*point, TAU1, branch)) for branch in (0, 1))
    loop = SingleArm(NOMINAL_GAIN, TAU1)
    right_of = [
        int(unstable_roots(loop, right_of=following.real * factor)) for factor in (0.99, 1.01)
    ]
    of_loop = abs(complex(1.0 + loop(following))) < 1e-9
    return Finding(
        {"": abs(zero) < 1e-12 and right_of == [0, 2] and of_loop and following.real < 0.0},
        following.real,
        f"real part in 1/s of the loop's rightmost roots at $k₂ = 1$ ($k₁ = {NOMINAL_GAIN:g}$"
        f"/s, $τ = {TAU1}$ s)",
        "The loop of Eq. (2) is stable at $k₂ = 1$, and unstable at any larger $k₂$. The root "
        "of Eq. (3) at $s = 0$ is a constant offset that the integrator keeps from the start.",
    )


@claim(
    "S11",
    place="Fig. 3 and its caption",
    says="The line of slope -1 through the origin bounds the stable region.",
    pinned=(Verdict.ONE_READING, 1.0, 1e-6),
    weight=Weight.DERIVATION,
)
def end_of_line() -> Finding:
    """Follow b = -a into a > 0, and find where the region below it ends."""

    def stable(a: float) -> float:
        return 0.5 - float(unstable_roots(HAYES, a, -a - 1e-9 * (1.0 + abs(a))) > 0)

    end = bisect(stable, 0.5, 2.0, xtol=1e-10)
    corner = np.allclose(d_curve(HAYES, 1e-6), (1.0, -1.0), rtol=0.0, atol=1e-9)
    beyond = int(unstable_roots(HAYES, 1.5, -1.5 - 1e-3))
    return Finding(
        {
            "positive gains, $a < 0$": corner and abs(end - 1.0) < 1e-3,
            "the whole line": beyond == 0,
        },
        end,
        "aτ at which the line stops bounding the stable region, by bisection",
        "The line bounds the region from $a = -∞$ to the corner at $(1, -1)/τ$, where the "
        "D-curve meets it. An arm with a positive gain has $a < 0$ and never reaches the "
        "corner.",
    )


@claim(
    "S12",
    place="Sec. III.A, after Eq. (5)",
    says="For a single arm D-subdivision yields the whole stable region directly.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
    weight=Weight.DERIVATION,
)
def closed_form_region() -> Finding:
    """Compare the closed form's region with a chart of counts."""
    a, b = np.linspace(-10.0, 2.0, 241), np.linspace(-12.0, 11.0, 231)
    chart = stability_chart(HAYES, a, b)
    lower = np.array([lowest_stable_b(value, 1.0) if value < 1.0 else np.inf for value in a])
    predicted = (lower < b[:, None]) & (b[:, None] < -a)
    wrong = int(((chart.counts == 0) != predicted)[chart.counts >= 0].sum())
    return Finding(
        {"": wrong == 0},
        wrong,
        f"points of a chart of {chart.counts.size} where region and count disagree",
        "The region lies between the line $b = -a$ and the first branch of the D-curve, "
        r"$a = ω cot ωτ$, $b = -ω / sin ωτ$ for $0 < ωτ < \pi$. The other branches only "
        "separate unstable from unstable.",
    )


@claim(
    "S13",
    place="Sec. II, before Eq. (3)",
    says="A linear controller does not alter the essentials of the single arm.",
    pinned=(Verdict.ONE_READING, 3.0, 0.0),
    printed="the use of a linear controller does not alter its essential characteristics",
)
def linear_controller() -> Finding:
    """Count on both sides of k2 = 1 with other controllers, the actuator in the loop."""
    controllers = {
        "gain": Controller((), (), 1.0),
        "proportional and integral": Controller((-0.01,), (0.0,), 1.0),
        "lead": Controller((-0.01,), (-1.0,), 100.0),
        "lag": Controller((-0.01,), (-0.001,), 1.0),
        "low pass": Controller((), (-0.5,), 0.5),
        "Stage I": stage_one(),
        "Table II": table_two(),
    }
    sides = 1.0 + PERTURBATION * np.array([-1.0, 0.0, 1.0])
    alters = []
    for name, controller in controllers.items():
        loop = Loop(controller * integrating_actuator(), SINGLE, TAU1, TAU1)
        # Of D, which has a root s = 0 at the ideal point.
        inside, edge, outside = unstable_roots(loop.plain(), sides, 0.0)
        if not (inside == 0 and edge == -1 and outside > 0):
            alters.append(name)
    return Finding(
        {
            "a gain, with integral, lead or lag part": not {
                "gain",
                "proportional and integral",
                "lead",
                "lag",
            }
            & set(alters),
            "any linear controller": not alters,
        },
        len(alters),
        f"of {len(controllers)} linear controllers before the actuator, those with which "
        "$k₂ = 1$ is not the edge of stability",
        f"The exceptions are {', '.join(alters[:-1])} and {alters[-1]}. A low pass delays the "
        "phase and makes the arm unstable on both sides of $k₂ = 1$. Zeros at $s = 0$ move the "
        "edge away from $k₂ = 1$, which is what the controller of Sec. IV uses.",
    )


@claim(
    "S14",
    place="Sec. II, first paragraph",
    says="Multiplicative perturbations are drifts of the controller's gain.",
    pinned=(Verdict.ONE_READING, 5.498e5, 1e2),
    weight=Weight.DERIVATION,
    printed="the multiplicative ones correspond to gain drifts of the arm-locking controller",
)
def gain_drift() -> Finding:
    """Let the controlled loop drift in gain, and compare with a drift of c1 and c2."""
    loop = paper_loop()
    found = margins(loop)
    gain = min(1.0 - found.gain_lower, found.gain_upper - 1.0)
    arms = critical_perturbation(loop, (1.0, -1.0))
    drifted = paper_loop(controller=table_two((1.0 + gain) * CONTROLLER_GAIN))
    same = abs(complex(drifted(0.1j) / loop(0.1j)) - 1.0 - gain)
    return Finding(
        {
            "a perturbation of the controller's output": same < 1e-12,
            "a perturbation of the returned phase, $c₁$ or $c₂$": gain < 10.0 * arms,
        },
        gain / arms,
        "relative drift of the gain that the controlled loop tolerates, over that of $c₁$ and "
        "$c₂$",
        "A drift of the gain changes $k₁$, which does not decide stability (claim S9). The "
        "factors $c₁$ and $c₂$, which the paper goes on to study, multiply the returned phase "
        f"alone. The gain may fall by {100.0 * gain:.0f} %, but $c₁$ and $c₂$ together may not "
        f"be off by {arms:.2g}.",
    )
