"""The locked laser through pytdi: a sine wave, and a simulated run."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, firwin, oaconvolve, sosfiltfilt

from armlock import amplitude_spectrum, simulate
from armlock.checks import FloatArray
from armlock.orbits.constellation import SPEED_OF_LIGHT, Constellation
from armlock.orbits.passages import DAY, Course, flight
from armlock.performance.budget import noise_series
from book.companion.orbits import constellations
from book.companion.shared import shared

#: Sample rate of the data in Hz, and what is cut off at either end, in samples.
RATE, CUT = 4.0, 600
#: Below this frequency in Hz the simulated phase is filtered away; so many samples forget it.
SLOW, ENDS = 5e-4, 8000
#: When the runs begin, in s since the orbits' epoch.
START = 100 * DAY

Links = dict[str, Any]


def links(orbits: Constellation, since: FloatArray, *, moving: bool = True) -> Links:
    """Return light times at times since `START`, and both round trips that belong to them.

    They are polynomials of `since`: rounding of t itself would make the delays jitter.
    """
    ends = float(since[0]) - 20.0, float(since[-1]) + 20.0
    found: Links = {}
    for arm, far in enumerate((2, 3)):

        def link(t: FloatArray, receiver: int, emitter: int) -> FloatArray:
            return orbits.light_time(START + t, receiver, emitter)

        back = Course(partial(link, receiver=1, emitter=far), *ends)
        out = Course(partial(link, receiver=far, emitter=1), *ends)
        at = since if moving else since[:1]
        first = back(at)
        found |= {f"d_1{far}": first, f"d_{far}1": out(at)}
        # A link that does not move is what it was, when the light is back as well.
        found[f"tau{arm + 1}"] = first + out(at - first if moving else at)
    return found if moving else {name: float(delay[0]) for name, delay in found.items()}


def combined(generation: int, eta: Links, delays: Links, error: float) -> FloatArray:
    """Return X1 or X2 of two phase series by pytdi, the range of link 12 off by `error` in m.

    The far spacecraft follow the master: their own series are zero.
    """
    from pytdi.michelson import X1_ETA, X2_ETA

    ranges = {name: delay for name, delay in delays.items() if name.startswith("d_")}
    ranges["d_12"] = ranges["d_12"] + error / SPEED_OF_LIGHT
    zero = np.zeros_like(eta["eta_12"])
    others = {f"eta_{link}": zero for link in ("21", "31", "23", "32")}
    build = X1_ETA if generation == 1 else X2_ETA
    found = build.build(ranges, RATE)(eta | others, unit="phase")
    return np.asarray(found[CUT:-CUT], dtype=np.float64)


def sine(
    orbit: str, frequency: float, error: float = 0.0, *, moving: bool = False
) -> tuple[float, float]:
    """Return |X1 / p| and |X2 / p| of a master's phase that is a sine wave, by pytdi."""
    t, omega = np.arange(20_000) / RATE, 2.0 * np.pi * frequency
    delays = links(constellations()[orbit], t, moving=moving)
    shape = np.exp(-1j * omega * t)[CUT:-CUT]
    sizes = []
    for generation in (1, 2):
        parts = []
        for wave in (np.cos, np.sin):
            taus = 0.0, delays["tau1"], delays["tau2"]
            here, back1, back2 = (wave(omega * (t - tau)) for tau in taus)
            eta = {"eta_12": back1 - here, "eta_13": back2 - here}
            parts.append(combined(generation, eta, delays, error))
        sizes.append(float(abs(((parts[0] + 1j * parts[1]) * shape).mean())))
    return sizes[0], sizes[1]


class Run(NamedTuple):
    """Spectra of a simulated run.

    Attributes
    ----------
    frequency : float array, shape (n,)
        In Hz.
    laser, x1, x2 : float arrays, shape (n,)
        Of the locked laser's phase, and of X1 and X2, in cycles/sqrt(Hz).
    tau1, tau2 : float
        Round trips in the middle of the run, in s.
    middle : float
        When that is, in s since the orbits' epoch.
    """

    frequency: FloatArray
    laser: FloatArray
    x1: FloatArray
    x2: FloatArray
    tau1: float
    tau2: float
    middle: float


def decimated(series: FloatArray, factor: int) -> FloatArray:
    """Return every so manyth value after a symmetric low-pass filter of 40 values a side each.

    The filter passes what is below a quarter of the new rate; the ends are cut off.
    """
    half = 40 * factor
    taps = firwin(2 * half + 1, 0.5 / factor, window=("kaiser", 14.0))
    return np.asarray(oaconvolve(series, taps, mode="valid")[::factor])


@shared
def run(orbit: str, duration: float = 40_000.0, error: float = 1.0) -> Run:
    """Simulate the flight loop with moving arms, in phase, and send it through pytdi.

    The free-running laser of the white paper drives it, at 40 Hz. The output is decimated to
    4 Hz. The arms return it by splines of degree eleven, which are exact to rounding at the
    frequencies that are shown.
    """
    orbits, fast = constellations()[orbit], 10
    rate = RATE * fast
    samples = int(duration * rate)

    def arm(number: int) -> Course:
        def tau(t: FloatArray) -> FloatArray:
            return orbits.round_trips(START + t)[number]

        return Course(tau, -1.0, duration + 1.0)

    arms = [arm(0), arm(1)]
    loop = flight(
        float(arms[0](0.0)), float(arms[1](0.0)), 0.5 * float(arms[0](0.0) - arms[1](0.0))
    )
    drive = np.cumsum(noise_series(loop, "laser", samples, seed=1, sample_rate=rate)) / rate
    locked = simulate(loop, drive, sample_rate=rate, tau1=arms[0], tau2=arms[1])
    # The loop settles for a quarter of the run.
    phase = decimated(locked[samples // 4 :], fast)
    # The filter is symmetric: 40 values are missing on either side.
    since = (samples // 4) / rate + 40 / RATE + np.arange(phase.size) / RATE
    # What is slow takes digits from what is left. Without it the phase is as good as before.
    phase = sosfiltfilt(butter(4, SLOW, "highpass", fs=RATE, output="sos"), phase)
    spline, inner = make_interp_spline(since, phase, k=11), slice(ENDS, -ENDS)
    since, here = since[inner], phase[inner]
    delays = links(orbits, since)
    back = [spline(since - delays[name]) for name in ("tau1", "tau2")]
    eta = {"eta_12": back[0] - here, "eta_13": back[1] - here}
    x1, x2 = (combined(generation, eta, delays, error) for generation in (1, 2))
    laser, *both = (amplitude_spectrum(series, RATE) for series in (here[CUT:-CUT], x1, x2))
    middle = START + float(since[since.size // 2])
    tau1, tau2 = map(float, orbits.round_trips(middle))
    return Run(laser.frequency, laser.asd, both[0].asd, both[1].asd, tau1, tau2, middle)
