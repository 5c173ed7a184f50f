"""Claims of the LISA Frequency Control White Paper, on the loop that could fly."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
from scipy.optimize import brentq

from armlock.budget import FREE_RUNNING, NoiseBudget, noise_budget
from armlock.checks import FloatArray
from armlock.flight import flight_loop
from armlock.infimum import MODULUS, PHASE, free_margins_at
from armlock.loops import Loop, SingleArm
from armlock.noise import LaserNoise
from armlock.pulling import pulling
from armlock.sensors import modified_dual
from armlock.stability import unstable_roots
from book.companion.claims import ledger
from book.companion.claims.ledger import Finding, Verdict, decide

stability = partial(ledger.claim, chapter="08a_flight")
noise = partial(ledger.claim, chapter="08b_noise_and_pulling")
TURN = 2.0 * np.pi
DAY = 86400.0

#: Actuator, phasemeter and transponder, in s; pre-stabilisation adds the last once more.
TRANSPONDER = 1.0 / (TURN * 30e3)
DEAD_TIME = 5e-6 + 2e-6 + TRANSPONDER
LOOP = flight_loop()
DELAYED = flight_loop(delay=DEAD_TIME)
PRESTABILISED = flight_loop(delay=DEAD_TIME + TRANSPONDER)
#: Where both arms are in phase again: the first null of the sensor, in Hz.
NULL = 1.0 / 0.51
#: Half differences of the round trips in s, from the largest down to a microsecond.
MISMATCHES = np.geomspace(0.255, 1e-6, 40)


def _crossing(loop: Loop, low: float, high: float) -> float:
    """Return a frequency in Hz between two others at which |L| is one."""

    def level(u: float) -> float:
        return float(np.log(np.abs(loop.open_loop(1j * TURN * np.exp(u)))))

    return float(np.exp(brentq(level, np.log(low), np.log(high), xtol=1e-14)))


def highest_unity_gain(loop: Loop) -> float:
    """Return the frequency in Hz past which |L| is below one for all phases of the arms."""

    def level(u: float) -> float:
        first, second = loop.arm_responses(1j * TURN * np.exp(u))
        return float(np.log(abs(first + second) + abs(first) + abs(second)))

    return float(np.exp(brentq(level, np.log(1e3), np.log(1e6), xtol=1e-14)))


def phase_margin(loop: Loop, frequency: float) -> float:
    """Return how far L is from the negative real axis at a frequency, in degrees."""
    return 180.0 - abs(float(np.degrees(np.angle(loop.open_loop(1j * TURN * frequency)))))


def crossing_at_the_null(loop: Loop) -> float:
    """Return the unity-gain frequency in Hz on the lower flank of the sensor's null."""
    frequency = np.linspace(NULL - 0.02, NULL, 40_001)
    above = np.abs(loop.open_loop(1j * TURN * frequency)) > 1.0
    at = np.flatnonzero(above[:-1] != above[1:])
    found = [_crossing(loop, frequency[k], frequency[k + 1]) for k in at]
    return min(found, key=lambda f: phase_margin(loop, f))


def free_margins(loop: Loop, frequency: FloatArray) -> FloatArray:
    """Return modulus margin and phase margin in degrees over all phases of both arms.

    At each frequency in closed form; shape (2, n).
    """
    first, second = loop.arm_responses(1j * TURN * frequency)
    spread = np.abs(first) + np.abs(second)
    rows = zip(first + second, spread, TURN * frequency, strict=True)
    found = np.array([free_margins_at(complex(c), r, w) for c, r, w in rows])
    return np.array([found[:, MODULUS], np.degrees(found[:, PHASE])])


@cache
def budget(laser: str = "free-running") -> NoiseBudget:
    """Return the noise budget from 0.1 mHz to 2 Hz, with many points to an echo."""
    low, high = np.geomspace(1e-4, 0.03, 500), np.arange(0.03, 2.0, 1.0 / 33.6 / 60.0)
    return noise_budget(LOOP, np.concatenate((low, high)), laser=laser)


def density(source: str) -> Callable[[FloatArray], FloatArray]:
    """Return the density of one source at the locked laser as a function of frequency in Hz.

    As `Spectrum.expected` takes it: from zero on, where the drawn noise of the laser is flat.
    """

    def asd(frequency: FloatArray) -> FloatArray:
        f = np.maximum(frequency.ravel(), 1e-9)
        found = noise_budget(LOOP, f, laser=LaserNoise(seed=0, level=FREE_RUNNING).asd(f))
        return found.sources[source].reshape(frequency.shape)

    return asd


@cache
def step_response() -> tuple[FloatArray, FloatArray]:
    """Return time in s and the laser's answer in Hz to a step of 1 Hz of the sum of errors."""
    time = np.linspace(0.02, 20.0, 1000) * DAY
    return time, pulling(LOOP, time)


@stability(
    "W1",
    place="White paper, Sec. 3",
    says="Unity gain is at 4.8 µHz and at 14.7 kHz.",
    pinned=(Verdict.REPRODUCED, 4.80878e-6, 1e-10),
)
def unity_gain() -> Finding:
    """Solve |L| = 1 below, and for the arms' phases of the largest |L| above."""
    low, high = _crossing(LOOP, 1e-6, 1e-5), highest_unity_gain(LOOP)
    return Finding(
        decide(abs(low / 4.8e-6 - 1.0) < 0.01, abs(high / 14.7e3 - 1.0) < 0.01),
        low,
        "lower unity-gain frequency in Hz",
        f"The lower one also fixes g₂, which is not printed: 40 is taken. For the phases of "
        f"the arms at which |L| is largest, the upper one is {high / 1e3:.2f} kHz.",
    )


@stability(
    "W2",
    place="White paper, Sec. 3",
    says="The gain at 3 mHz is 87 000.",
    pinned=(Verdict.REPRODUCED, 88639.3, 1.0),
)
def gain_in_the_band() -> Finding:
    """Evaluate |L| at 3 mHz."""
    gain = abs(complex(LOOP.open_loop(1j * TURN * 3e-3)))
    return Finding(
        decide(abs(gain / 87e3 - 1.0) < 0.03),
        gain,
        "|L| at 3 mHz, with g₂ = 40",
        f"The printed gain is met with g₂ = {40.0 * 87e3 / gain:.2f}.",
    )


@stability(
    "W3",
    place="White paper, Sec. 3",
    says="The phase margin is above 30 degrees at every unity-gain frequency.",
    pinned=(Verdict.IN_PART, 28.64095, 1e-3),
)
def phase_margins() -> Finding:
    """Take the margin at the lower crossing, at the sensor's null, and over all phases."""
    low = phase_margin(LOOP, _crossing(LOOP, 1e-6, 1e-5))
    null = crossing_at_the_null(LOOP)
    here, late = phase_margin(LOOP, null), phase_margin(DELAYED, crossing_at_the_null(DELAYED))
    above = np.geomspace(10.0, 14e3, 4001)
    free = float(free_margins(DELAYED, above)[1].min())
    faster = flight_loop(corner=TURN * 0.8)
    other = phase_margin(faster, crossing_at_the_null(faster))
    return Finding(
        decide(low > 30.0, here > 30.0, free > 30.0),
        here,
        f"phase margin in degrees at the crossing of {null:.4f} Hz, beside the null where both "
        "arms are in phase again",
        f"It is {low:.1f} degrees at the lower unity gain, but {here:.2f} at the null, and "
        f"{late:.2f} with the dead time. From 10 Hz up the smallest over all phases of both "
        f"arms is {free:.1f} degrees, dead time included, as a sample of frequencies has it. "
        "E(s) is not printed: with a corner of 0.8 instead of 0.4 Hz the margin at the null is "
        f"{other:.1f} degrees.",
    )


@stability(
    "W4",
    place="White paper, Sec. 3",
    says="Noise is amplified by less than 2 at the nulls, and by 5 near 15 kHz.",
    pinned=(Verdict.IN_PART, 2.0961, 1e-3),
)
def amplification() -> Finding:
    """Take |1 / (1 + L)| beside the null, and over all phases of the arms above it."""
    near = np.linspace(NULL - 0.02, NULL, 40_001)
    at_null = float(np.max(1.0 / np.abs(1.0 + LOOP.open_loop(1j * TURN * near))))
    above = np.geomspace(5e3, 1e5, 8001)
    loops = LOOP, DELAYED, PRESTABILISED
    peaks = [free_margins(loop, above)[0] for loop in loops]
    high = [1.0 / float(peak.min()) for peak in peaks]
    where = [float(above[np.argmin(peak)]) / 1e3 for peak in peaks]
    at = [1.0 / float(free_margins(loop, np.array([15e3]))[0, 0]) for loop in loops]
    return Finding(
        decide(at_null < 2.0, min(at) < 5.0 < max(at)),
        at_null,
        f"largest |1 / (1 + L)| beside the null at {NULL:.2f} Hz",
        "Above 5 kHz the amplification over all phases of the arms hangs on the dead time. At "
        f"15 kHz it is {at[0]:.2f} without one, {at[1]:.2f} with 12.3 µs, and {at[2]:.2f} "
        f"with that of pre-stabilisation; the peaks of the last two are {high[1]:.2f} at "
        f"{where[1]:.1f} kHz and {high[2]:.2f} at {where[2]:.1f} kHz.",
    )


@stability(
    "W5",
    place="White paper, Sec. 3",
    says="The loop is stable for every smaller mismatch of the arms.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def smaller_mismatch() -> Finding:
    """Count at forty mismatches down to two microseconds, and with the other sign of H₋."""
    counts = [int(unstable_roots(flight_loop(half_difference=h), 1, 1)) for h in MISMATCHES]
    turned = Loop(LOOP.controller, modified_dual(33.6, -0.255), LOOP.tau1, LOOP.tau2)
    others = int(unstable_roots(turned, 1, 1))
    last = next((h for h, n in zip(MISMATCHES, counts, strict=True) if n), None)
    smallest = f"it breaks at 2 Δτ = {2 * last:.2g} s" if last else "none of them is unstable"
    return Finding(
        decide(not any(counts)),
        float(sum(n != 0 for n in counts)),
        f"of {len(counts)} mismatches 2 Δτ from {2 * MISMATCHES[0]:.2f} s to "
        f"{2 * MISMATCHES[-1]:.0e} s at which the loop is not stable",
        f"Each count is certified, what lies between two is not; {smallest}. The sensor "
        f"follows the mismatch. With the other sign of H₋ {others} roots are "
        "unstable at the largest one.",
    )


@noise(
    "W6",
    place="White paper, Sec. 3",
    says="With a free-running laser the noise is a factor of 5 below the TDI capability at 3 "
    "mHz, and below it over the whole science band.",
    pinned=(Verdict.REPRODUCED, 5.317, 0.01),
)
def below_the_capability() -> Finding:
    """Compute the noise budget from 0.1 mHz to 2 Hz."""
    found = budget()
    at = noise_budget(LOOP, [3e-3])
    share = float(at.sources["laser"][0] / at.sources["clock"][0])
    science = found.frequency <= 1.0
    least, worst = found.factor[science].min(), found.frequency[found.factor.argmin()]
    return Finding(
        decide(5.0 <= at.factor[0] < 6.0, least > 1.0),
        float(at.factor[0]),
        "capability over noise at 3 mHz",
        f"From 0.1 mHz to 1 Hz the noise is at least a factor of {least:.2f} below. Above, "
        f"narrow lines exceed the capability, {1.0 / found.factor.min():.0f} times at "
        f"{worst:.2f} Hz, beside the null of the sensor. What the laser leaves is "
        f"{share:.0f} times the clocks' noise at 3 mHz.",
    )


@noise(
    "W7",
    place="White paper, Sec. 3",
    says="A single arm is pulled by ν c / (2 L) a second: an error of 100 kHz makes 1 GHz in "
    "four days.",
    pinned=(Verdict.REPRODUCED, 1.0345e9, 2e6),
)
def single_arm() -> Finding:
    """Pull a single arm of 33.4 s by 100 kHz for four days."""
    error = (1e5, 0.0, 0.0)
    pulled = abs(float(pulling(SingleArm(100.0, 33.4), 4.0 * DAY, error, error)))
    return Finding(
        decide(abs(pulled / 1e9 - 1.0) < 0.05),
        pulled,
        "pulling in Hz after four days",
        f"The rate is 100 kHz / 33.4 s = {1e5 / 33.4:.0f} Hz/s, whatever the gain.",
    )


def _scaled(figure: float) -> tuple[float, str]:
    """Return the largest answer to 1 Hz, and the step in kHz that makes a printed figure."""
    _, answer = step_response()
    peak = float(np.abs(answer).max())
    return peak, f"{figure / peak / 1e3:.3g} kHz"


@noise(
    "W8",
    place="White paper, Sec. 3",
    says="In steady state the laser is pulled by less than 8 MHz, peak to peak.",
    pinned=(Verdict.OPEN, 454.4, 0.5),
)
def steady_state() -> Finding:
    """Compute the largest answer to a step; the source does not give the errors."""
    peak, step = _scaled(8e6)
    return Finding(
        decide(settled=False),
        peak,
        "Hz of the laser for each Hz of a step in the sum of the two arms' errors",
        f"The errors in steady state are not given. A step of {step} would pull by 8 MHz; a "
        "constant error is forgotten within days, since L vanishes at zero frequency.",
    )


@noise(
    "W9",
    place="White paper, Sec. 3",
    says="At acquisition the laser is pulled by 460, 90 and 4 MHz: free-running, Mach-Zehnder, "
    "Fabry-Perot.",
    pinned=(Verdict.OPEN, 454.4, 0.5),
)
def acquisition() -> Finding:
    """Compute which steps would make the printed figures."""
    peak, _ = _scaled(1.0)
    steps = ", ".join(_scaled(figure)[1] for figure in (460e6, 90e6, 4e6))
    return Finding(
        decide(settled=False),
        peak,
        "Hz of the laser for each Hz of a step in the sum of the two arms' errors",
        f"The errors left after averaging for 200 s are not given. Steps of {steps} would make "
        "the three figures, in proportion; rates and curvatures of the errors add to that.",
    )
