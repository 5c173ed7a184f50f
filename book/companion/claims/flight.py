"""Claims of the LISA Frequency Control White Paper, on the loop that could fly."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.constants import speed_of_light
from scipy.optimize import brentq

from armlock.checks import FloatArray
from armlock.engine.margins import Margins
from armlock.loops import Loop, SingleArm, flight_loop
from armlock.performance.budget import (
    LASERS,
    LEVELS,
    free_running,
    noise_budget,
    tdi_capability,
)
from armlock.performance.pulling import largest_pulling, pulling
from armlock.performance.transfer import transfer
from armlock.robustness import critical_perturbation, margins
from armlock.sensors import modified_dual
from armlock.stability.counts import unstable_roots
from book.companion.claims.ledger import Finding, Verdict, claim
from book.companion.extremes import smallest
from book.companion.shared import shared

TURN = 2.0 * np.pi
DAY = 86400.0

#: Actuator, phasemeter and transponder, in s; pre-stabilisation adds the last once more.
TRANSPONDER = 1.0 / (TURN * 30e3)
DEAD_TIME = 5e-6 + 2e-6 + TRANSPONDER
#: Mean round trip in s of the source's arms of five million kilometres: 33.356 s.
MEAN_DELAY = 2.0 * 5e9 / speed_of_light
#: Others that are tried: as rounded elsewhere, and of arms that are 0.7 % longer.
OTHER_DELAYS = (33.4, 33.6)
LOOP = flight_loop(MEAN_DELAY)
LONG_ARM = SingleArm(100.0, MEAN_DELAY)
DELAYED = flight_loop(MEAN_DELAY, delay=DEAD_TIME)
PRESTABILISED = flight_loop(MEAN_DELAY, delay=DEAD_TIME + TRANSPONDER)
#: Frequency in Hz from which on the arms' phases are taken as free.
FREE_FROM = 10.0
#: Half differences of the round trips in s, from the largest down to a tenth of a microsecond.
MISMATCHES = np.geomspace(0.255, 1e-7, 30)
WAVELENGTH, ASTRONOMICAL_UNIT = 1064e-9, 149_597_870_700.0
LASER_FREQUENCY = speed_of_light / WAVELENGTH
#: Amplitude in Hz, assumed for acquisition, of the sum of both arms' shifts; a year in rad/s.
DOPPLER, YEARLY = 15e6, TURN / (365.25 * DAY)


def _crossing(loop: Loop, low: float, high: float) -> float:
    """Return a frequency in Hz between two others at which |L| is one."""

    def level(u: float) -> float:
        return float(np.log(np.abs(loop(1j * TURN * np.exp(u)))))

    return float(np.exp(brentq(level, np.log(low), np.log(high), xtol=1e-14)))


def lower_unity_gain(loop: Loop) -> float:
    """Return the unity-gain frequency in Hz near 5 uHz."""
    return _crossing(loop, 1e-6, 1e-5)


def highest_unity_gain(loop: Loop) -> float:
    """Return the frequency in Hz past which |L| is below one for all phases of the arms."""

    def level(u: float) -> float:
        first, second = loop.arm_responses(1j * TURN * np.exp(u))
        return float(np.log(abs(first + second) + abs(first) + abs(second)))

    return float(np.exp(brentq(level, np.log(1e3), np.log(1e6), xtol=1e-14)))


@cache
def uniform(loop: Loop, free_from: float = FREE_FROM) -> Margins:
    """Return the margins for all phases of the arms above a frequency in Hz, certified."""
    return margins(loop, free_above=TURN * free_from)


def free_margins(loop: Loop, frequency: FloatArray) -> FloatArray:
    """Return modulus margin and phase margin in degrees over all phases of both arms.

    At each frequency in closed form; shape (2, n). L fills a disc, which covers the unit circle
    up to half an angle on both sides of its centre.
    """
    first, second = loop.arm_responses(1j * TURN * frequency)
    centre, radius = first + second, np.abs(first) + np.abs(second)
    size = np.abs(centre)
    cosine = (1.0 + size**2 - radius**2) / (2.0 * size)
    half = np.arccos(np.clip(cosine, -1.0, 1.0))
    phase = np.maximum(np.abs(np.angle(-centre)) - half, 0.0)
    phase = np.where(radius <= np.abs(size - 1.0), np.inf, phase)
    phase = np.where(radius >= size + 1.0, 0.0, phase)
    return np.array([np.maximum(np.abs(1.0 + centre) - radius, 0.0), np.degrees(phase)])


def most_laser(loop: Loop, frequency: FloatArray) -> FloatArray:
    """Return what is left of a free-running laser in Hz/sqrt(Hz), at most.

    The maximum is over all mean lengths of the arms, at their true difference. L then runs
    around a circle, so the narrow lines at the nulls need not be resolved.
    """
    s = 1j * TURN * frequency
    first, second = loop.arm_responses(s)
    turned = np.exp(0.5 * s * (loop.tau1 - loop.tau2))
    radius = np.abs(first / turned + second * turned)
    nearest = np.abs(np.abs(1.0 + first + second) - radius)
    return np.asarray(free_running(frequency) / nearest)


@shared
def largest_answers() -> FloatArray:
    """Return the laser's largest answer to an error of the sum of 1 Hz, 1 Hz/s and 1 Hz/s^2."""
    errors = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    return np.array([largest_pulling(LOOP, common=error).size for error in errors])


def doppler_errors(laser: str, averaging: float = 200.0) -> tuple[float, float]:
    """Return standard deviations in Hz and Hz/s of Doppler shift and rate as first measured.

    A straight line is fitted to the frequency of the sum of both arms, in `averaging` seconds.
    The laser's own noise above 1 uHz disturbs the fit.
    """
    f = np.concatenate((np.geomspace(1e-6, 1e-4, 2000), np.arange(1e-4, 3.0, 5e-6)))
    x = np.pi * f * averaging
    mean = np.sinc(f * averaging)
    slope = 6.0 * (np.sin(x) - x * np.cos(x)) / (x**2 * averaging)
    both_arms = 4.0 * np.sin(np.pi * f * MEAN_DELAY) * LASERS[laser](f)
    rms = [np.sqrt(np.trapezoid((both_arms * w) ** 2, f)) for w in (mean, slope)]
    return float(rms[0]), float(rms[1])


def orbit_shifts() -> tuple[float, float]:
    """Return amplitudes in Hz of the sum of both arms' shifts, once and three times a year.

    On Keplerian orbits of eccentricity e and inclination sqrt(3) e, an arm of length L swings
    by 15 e L / 32 once and by e L / 32 three times a year, the latter together with all others.
    """
    length = 5e9
    swing = length**2 / (2.0 * np.sqrt(3.0) * ASTRONOMICAL_UNIT) / 32.0
    rate = 2.0 * YEARLY * swing / WAVELENGTH
    return 15.0 * rate, 2.0 * 3.0 * rate


@cache
def acquisition_pulling(laser: str, averaging: float = 200.0) -> float:
    """Return the pulling in Hz at acquisition, as the sum of three largest answers.

    The errors of shift and rate are those of `doppler_errors`. The orbit gives the curvature,
    and the rate where its rate is smaller.
    """
    shift, rate = doppler_errors(laser, averaging)
    of_orbit = DOPPLER * YEARLY, DOPPLER * YEARLY**2
    return float(largest_answers() @ (shift, min(rate, of_orbit[0]), of_orbit[1]))


@claim(
    "W1",
    place="White paper, Sec. 3",
    says="Unity gain is at 4.8 µHz and at 14.7 kHz.",
    pinned=(Verdict.IN_PART, 14700.0, 5.0),
)
def unity_gain() -> Finding:
    """Solve |L| = 1 below, and for the arms' phases of the largest |L| above."""
    others = (lower_unity_gain(flight_loop(MEAN_DELAY, g2=g2)) for g2 in (20.0, 80.0))
    same = [abs(other / 4.8e-6 - 1.0) < 0.01 for other in others]
    low, high = lower_unity_gain(LOOP), highest_unity_gain(LOOP)
    return Finding(
        {
            "": {
                "14.7 kHz": abs(high / 14.7e3 - 1.0) < 0.01,
                "4.8 µHz, for half and twice g₂": all(same),
            }
        },
        high,
        "upper unity-gain frequency in Hz, for the phases of the arms at which |L| is largest",
        f"With g₂ = 40 the lower one is {1e6 * low:.2f} µHz. It tests nothing, because it was "
        "used to find the gain g₂, which is not printed.",
    )


@claim(
    "W2",
    place="White paper, Sec. 3",
    says="The gain at 3 mHz is 87 000.",
    pinned=(Verdict.REPRODUCED, 88501.8, 1.0),
)
def gain_in_the_band() -> Finding:
    """Evaluate |L| at 3 mHz."""
    gain = abs(complex(LOOP(1j * TURN * 3e-3)))
    return Finding(
        {"": abs(gain / 87e3 - 1.0) < 0.03},
        gain,
        "|L| at 3 mHz, with g₂ = 40",
        f"A value of g₂ = {40.0 * 87e3 / gain:.2f} would give the printed gain.",
    )


@claim(
    "W3",
    place="White paper, Sec. 3",
    says="The phase margin is above 30 degrees at every unity-gain frequency.",
    pinned=(Verdict.OPEN, 30.33617, 1e-3),
)
def phase_margins() -> Finding:
    """Take the smallest margin over all crossings, and for all phases of the arms."""
    lowest = complex(LOOP(1j * TURN * _crossing(LOOP, 1e-6, 1e-5)))
    low = 180.0 - abs(float(np.degrees(np.angle(lowest))))
    faster = flight_loop(MEAN_DELAY, corner=TURN * 0.8)
    longer = [flight_loop(delay) for delay in OTHER_DELAYS]
    here, late, other, *more = (
        np.degrees(uniform(one).phase) for one in (LOOP, DELAYED, faster, *longer)
    )
    sooner = float(np.degrees(uniform(LOOP, 2.0).phase))
    null = uniform(LOOP).phase_omega / TURN
    return Finding(
        {
            "a corner of E(s) of 0.4 Hz": low > 30.0 and bool(here > 30.0),
            "0.8 Hz": bool(other > 30.0),
            "0.4 Hz, with 12.3 µs of dead time": bool(late > 30.0),
        },
        float(here),
        f"smallest phase margin in degrees, at {null:.4f} Hz, beside the null where both arms "
        "are in phase again",
        f"The number is certified for all phases of the two arms above {FREE_FROM:g} Hz, with "
        f"$2L/c = {MEAN_DELAY:.3f}$ s and a corner of 0.4 Hz. With a corner of 0.8 Hz it is "
        f"{other:.1f} degrees, with the dead time {late:.2f}, and with phases that are free "
        f"above 2 Hz {sooner:.2f}. With mean round trips of 33.4 s and 33.6 s it is "
        f"{more[0]:.2f} and {more[1]:.2f} degrees.",
        missing="E(s) and the dead time",
    )


@claim(
    "W4",
    place="White paper, Sec. 3",
    says="Noise is amplified by less than 2 at the nulls, and by 5 near 15 kHz.",
    pinned=(Verdict.OPEN, 1.97686, 1e-4),
)
def amplification() -> Finding:
    """Take one over the modulus margin, and the disc of all phases at 15 kHz."""
    loops = LOOP, DELAYED, PRESTABILISED
    peaks = [1.0 / uniform(loop).modulus for loop in loops]
    where = [uniform(loop).modulus_omega / TURN for loop in loops]
    at = [1.0 / float(free_margins(loop, np.array([15e3]))[0, 0]) for loop in loops]
    longer = [1.0 / uniform(flight_loop(delay)).modulus for delay in OTHER_DELAYS]
    return Finding(
        {},
        peaks[0],
        f"largest |1 / (1 + L)| without dead time, at {where[0]:.1f} Hz",
        f"With mean round trips of 33.4 s and 33.6 s it is {longer[0]:.2f} and "
        f"{longer[1]:.2f}. The dead time decides what happens at 15 kHz: the amplification is "
        f"{at[0]:.2f} without one, {at[1]:.2f} with 12.3 µs, and {at[2]:.2f} with that of "
        "pre-stabilisation. The certified peaks of the last "
        f"two are {peaks[1]:.2f} at {where[1] / 1e3:.1f} kHz and {peaks[2]:.2f} at "
        f"{where[2] / 1e3:.1f} kHz.",
        missing="E(s) and the dead time",
    )


@claim(
    "W5",
    place="White paper, Sec. 3",
    says="The loop is stable for every smaller mismatch of the arms.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def smaller_mismatch() -> Finding:
    """Count at thirty mismatches down to 0.2 us, and with the other sign of H₋."""
    counts = [int(unstable_roots(flight_loop(MEAN_DELAY, h), 1, 1)) for h in MISMATCHES]
    turned = Loop(LOOP.controller, modified_dual(MEAN_DELAY, -0.255), LOOP.tau1, LOOP.tau2)
    others = int(unstable_roots(turned, 1, 1))
    small = 1e-5
    edge = critical_perturbation(flight_loop(MEAN_DELAY, small), (1, -1))
    moving = 2.0 * small * max(LEVELS.beat_notes) / LASER_FREQUENCY / edge
    return Finding(
        {"": not any(counts)},
        float(sum(n != 0 for n in counts)),
        f"of {len(counts)} mismatches 2 Δτ from {2 * MISMATCHES[0]:.2f} s to "
        f"{2 * MISMATCHES[-1]:.0e} s at which the loop is not stable",
        "Each count is certified, and the mismatches between two of them are not. The sensor "
        "follows the mismatch, and Doppler factors that differ from one by 5·10⁻⁸ make the "
        f"loop unstable below 2 Δτ = {moving:.1e} s. With the other sign of H₋ {others} roots "
        "are unstable at the largest mismatch.",
    )


@claim(
    "W6",
    place="White paper, Sec. 3",
    says="With a free-running laser the noise is a factor of 5 below the TDI capability at 3 "
    "mHz, and below it over the whole science band.",
    pinned=(Verdict.REPRODUCED, 5.3102, 1e-3),
)
def below_the_capability() -> Finding:
    """Compute the noise budget from 0.1 mHz to 1 Hz, and the laser's own lines up to 2 Hz."""
    at = noise_budget(LOOP, [3e-3])
    share = float(at.sources["laser"][0] / at.sources["clock"][0])
    slow, fast = np.geomspace(1e-4, 0.03, 500), np.geomspace(0.03, 2.0, 4001)
    science = fast[fast <= 1.0]

    def factor(half: float) -> Callable[[FloatArray], FloatArray]:
        loop = flight_loop(MEAN_DELAY, half)
        return lambda f: tdi_capability(f) / most_laser(loop, f)

    def least_of_all(f: FloatArray) -> FloatArray:
        return noise_budget(LOOP, np.atleast_1d(f)).factor.reshape(np.shape(f))

    found = factor(0.255)
    least = min(smallest(found, science).value, smallest(least_of_all, slow).value)
    worst, first = smallest(found, fast), int(np.argmax(found(fast) < 1.0))
    begins = brentq(lambda f: float(found(f)) - 1.0, fast[first - 1], fast[first])
    enough = brentq(
        lambda half: smallest(factor(half), science).value - 1.0, 0.1, 0.255, xtol=1e-4
    )
    return Finding(
        {"": {"at 3 mHz": bool(5.0 <= at.factor[0] < 6.0), "over the band": least > 1.0}},
        float(at.factor[0]),
        "capability over noise at 3 mHz",
        f"From 0.1 mHz to 1 Hz the noise is below the capability by a factor of at least "
        f"{least:.2f}. Above {begins:.2f} Hz narrow lines of the laser near the nulls of the "
        f"mean arm exceed it, {1.0 / worst.value:.0f} times at {worst.at:.2f} Hz. At 3 mHz the "
        f"laser leaves {share:.0f} times the noise of the clocks, and with 2 Δτ below "
        f"{2.0 * enough:.2f} s lines exceed the capability within the band.",
    )


@claim(
    "W7",
    place="White paper, Sec. 3",
    says="A single arm is pulled by $ν c / (2 L)$ a second: an error of 100 kHz makes 1 GHz in "
    "four days.",
    pinned=(Verdict.REPRODUCED, 1.0359e9, 2e6),
)
def single_arm() -> Finding:
    """Pull a single arm of the source's length by 100 kHz for four days."""
    error = (1e5, 0.0, 0.0)
    pulled = abs(float(pulling(LONG_ARM, 4.0 * DAY, common=error, differential=error)))
    return Finding(
        {"": abs(pulled / 1e9 - 1.0) < 0.05},
        pulled,
        "pulling in Hz after four days",
        f"The rate is 100 kHz / {MEAN_DELAY:.3f} s = {1e5 / MEAN_DELAY:.0f} Hz/s at any gain.",
    )


@claim(
    "W8",
    place="White paper, Sec. 3",
    says="In steady state the laser is pulled by less than 8 MHz, peak to peak.",
    pinned=(Verdict.OPEN, 6.0400e6, 1e3),
)
def steady_state() -> Finding:
    """Take the response to the Doppler shifts themselves, which are never updated."""
    gains = [abs(complex(transfer(LOOP, "common", 1j * k * YEARLY))) for k in (1, 2, 3)]
    once, thrice = orbit_shifts()
    return Finding(
        {},
        float(2.0 * (gains[0] * once + gains[2] * thrice)),
        "pulling in Hz, peak to peak at most, on Keplerian orbits",
        "On Keplerian orbits, inclined by √3 times their eccentricity, the sum of the arms' "
        f"shifts varies by {once / 1e6:.1f} MHz once and {thrice / 1e6:.1f} MHz three times a "
        "year, and the pulling stays below 8 MHz. Each MHz of a variation twice a year, which "
        f"other orbits have, would add {2.0 * gains[1]:.2f} MHz.",
        missing="the orbits",
    )


@claim(
    "W9",
    place="White paper, Sec. 3",
    says="At acquisition the laser is pulled by 460, 90 and 4 MHz: free-running, Mach-Zehnder, "
    "Fabry-Perot.",
    pinned=(Verdict.OPEN, 1.5529, 1e-3),
)
def acquisition() -> Finding:
    """Compare with what Doppler estimates of 200 s would leave."""
    printed = dict(zip(LASERS, (460e6, 90e6, 4e6), strict=True))
    found = {laser: acquisition_pulling(laser) for laser in LASERS}
    ratios = [found[laser] / printed[laser] for laser in LASERS]
    worst = float(np.exp(np.abs(np.log(ratios)).max()))
    longer = acquisition_pulling("free-running", 400.0)
    listed = ", ".join(f"{value / 1e6:.3g}" for value in found.values())
    return Finding(
        {},
        worst,
        "largest factor between the pulling found and the one printed",
        "We take one standard deviation of a straight line through 200 s, or the orbit's rate "
        "and curvature for a shift of 15 MHz where these are smaller. The three are then "
        f"{listed} MHz. With 400 s the first is {longer / 1e6:.0f} MHz.",
        missing="the errors of the Doppler estimates",
    )


@claim(
    "W10",
    place="White paper, Sec. 3",
    says="The TDI capability is missed for about half an hour, twice a year, when the arms are "
    "equal and the central spacecraft cannot be switched.",
    pinned=(Verdict.OPEN, 15.5325, 1e-3),
)
def equal_arms() -> Finding:
    """Find the mismatch at which the sensor's noise at 3 mHz reaches the capability."""

    def excess(logarithm: float) -> float:
        half = float(np.exp(logarithm))
        found = noise_budget(flight_loop(MEAN_DELAY, half), [3e-3])
        others = [asd**2 for name, asd in found.sources.items() if name != "laser"]
        return float(np.log(np.sqrt(sum(others)) / found.requirement)[0])

    half = float(np.exp(brentq(excess, np.log(1e-7), np.log(1e-2))))
    rate = (LEVELS.beat_notes[0] - LEVELS.beat_notes[1]) / LASER_FREQUENCY
    minutes = 4.0 * half / rate / 60.0
    return Finding(
        {"the largest rate": minutes > 30.0, "half that rate": 2.0 * minutes > 30.0},
        minutes,
        "minutes for which clocks, motion and shot noise exceed the capability at 3 mHz, if "
        "the arms pass each other at the largest rate",
        f"The capability is exceeded below 2 Δτ = {2e6 * half:.0f} µs. The largest difference "
        f"of the Doppler shifts is {rate:.1e} s/s, and at half that rate it takes "
        f"{2.0 * minutes:.0f} minutes. Near 1 Hz the lines of the laser exceed the capability "
        "at far larger mismatches (claim W6).",
        missing="the rate at which the arms pass each other",
    )
