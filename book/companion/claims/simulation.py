"""Claims of Sec. IV.C, the simulation: M1 to M8.

All of them look at one run of the paper's size, `full_run`, which is done once a process.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from armlock.checks import ComplexArray, FloatArray
from armlock.loops import paper_loop
from armlock.margins import critical_perturbation
from armlock.noise import LaserNoise, PerturbationNoise, band_rms, sample_count
from armlock.paper import DURATION, LASER_NOISE, PERTURBATION, SAMPLE_RATE
from armlock.roots import rightmost_root
from armlock.simulation import LIMIT, DivergenceError, Simulation, sampled_open_loop
from armlock.spectra import Spectrum, SpectrumEstimator
from armlock.stability import unstable_roots
from book.companion.claims.ledger import Finding, Verdict, claim

CHAPTER = "07_simulation"

#: Band in Hz over which the paper states the suppression.
BAND = (1e-4, 1.0)
#: System 2, and the point that the other caption gives it.
STRONG = (1.0, 1.0 - PERTURBATION)
IDEAL = (1.0, 1.0)
#: Lowest frequency of the simulated band in Hz, where the perturbations' spectrum ends.
LOWEST = 1.0 / DURATION
#: Factors before the spectrum of the perturbations at which System 1 is tried, as r.m.s.
#: over the simulated band in units of the largest perturbation that the paper considers.
SIZES = (1.0, 3.0, 10.0, 30.0, 100.0, 1000.0)
#: Cut-offs in Hz at which the spectrum of the perturbations is tried at face value as well.
CUTOFFS = (1e-4, 1e-3)
#: Where the spectra after a start are taken, in s from it.
SETTLED = (2_000.0, 22_000.0)
#: A free-running laser of the kind used has about this density at 1 Hz, in Hz/sqrt(Hz).
FREE_RUNNING = 30_000.0

# Series are kept once a second.
_EVERY = int(SAMPLE_RATE)
_BLOCK = 1 << 18
#: Seeds of c1 and c2.
PERTURBATION_SEEDS = (2, 3)
_LASER_SEED = 1
#: Seeds of the random draws of c1 and c2, their number, and their sample rate in Hz. What is
#: faster passes long before the loop follows.
_DRAW_SEEDS = (100, 101)
DRAWS = 4000
_DRAW_RATE = 0.01


class Trace(NamedTuple):
    """A system's run: its series once a second, its spectrum, and when it diverged."""

    series: FloatArray
    spectrum: Spectrum | None
    diverged: float | None


@dataclass(frozen=True, eq=False)
class Run:
    """The run of the paper's size.

    Attributes
    ----------
    time : float array, shape (n,)
        In s, once a second.
    noise : Trace
        The free-running laser, in Hz.
    perturbations : float array, shape (2, n)
        c1 - 1 and c2 - 1 of the spectrum at face value.
    traces : dict of str to Trace
        The locked laser, in Hz: "ideal", "system 2", "system 1" with the perturbations
        scaled to the size that the paper considers, "size ..." for other sizes, "face value",
        "face value from ..." for higher cut-offs in Hz, and "face value, c1 = c2".
    """

    time: FloatArray
    noise: Trace
    perturbations: FloatArray
    traces: dict[str, Trace]


def face_value_rms() -> float:
    """R.m.s. of the printed spectrum over the simulated band.

    Series drawn from it have more, because their spectrum does not end at the cut-off; see
    `drawn_sizes` for those of the run.
    """
    return band_rms(LOWEST, 0.5 * SAMPLE_RATE)


def size_name(size: float) -> str:
    """Name of the run with perturbations of a given size."""
    return "system 1" if size == 1.0 else f"size {size:g}"


def cutoff_name(cutoff: float) -> str:
    """Name of the run at face value with the spectrum cut at a frequency in Hz."""
    return f"face value from {cutoff:g} Hz"


#: Name of the run at face value with the same perturbation in both arms.
ALIKE = "face value, c1 = c2"


Arms = tuple[PerturbationNoise, PerturbationNoise]


def _arms(cutoff: float) -> Arms:
    """Return the sources of c1 - 1 and c2 - 1, with their spectrum cut at a frequency."""
    first, second = PERTURBATION_SEEDS
    return (
        PerturbationNoise(first, SAMPLE_RATE, cutoff=cutoff),
        PerturbationNoise(second, SAMPLE_RATE, cutoff=cutoff),
    )


def _pair(arms: Arms, count: int) -> tuple[FloatArray, FloatArray]:
    return arms[0].draw(count), arms[1].draw(count)


class _System:
    """One locked laser of the run, with what is kept of it."""

    def __init__(
        self, first: tuple[float, float], second: tuple[float, float], spectrum: bool = False
    ) -> None:
        self.parts = first, second
        self.run = Simulation(paper_loop(), SAMPLE_RATE)
        self.estimator = SpectrumEstimator(SAMPLE_RATE) if spectrum else None
        self.kept: list[FloatArray] = []
        self.diverged: float | None = None

    def advance(self, noise: FloatArray, eta: tuple[FloatArray, FloatArray]) -> None:
        """Take the next block, unless the system has diverged."""
        if self.diverged is not None:
            return
        c1, c2 = (
            start + weight * change if weight else start
            for (start, weight), change in zip(self.parts, eta, strict=True)
        )
        try:
            output = self.run.advance(noise, c1, c2)
        except DivergenceError as error:
            self.diverged = error.time
            output = error.output
        if self.estimator is not None:
            self.estimator.add(output)
        self.kept.append(output[::_EVERY].copy())

    def advance_with(self, noise: FloatArray, arms: Arms) -> None:
        """Take the next block with perturbations of its own, as long as they are needed."""
        if self.diverged is None:
            self.advance(noise, _pair(arms, noise.size))

    def trace(self) -> Trace:
        """Return what was kept."""
        spectrum = None if self.estimator is None else self.estimator.spectrum()
        return Trace(np.concatenate(self.kept), spectrum, self.diverged)


@cache
def full_run() -> Run:
    """Run all systems over the paper's 200 000 s, on the same input.

    The laser's noise starts at zero, and so do the loop and what is in its arms: nothing is
    switched on abruptly. The perturbations are in the middle of their course.
    """
    samples = sample_count(DURATION, SAMPLE_RATE)
    laser = LaserNoise(_LASER_SEED, SAMPLE_RATE, at_rest=True)
    arms = {cutoff: _arms(cutoff) for cutoff in (LOWEST, *CUTOFFS)}
    unit = PERTURBATION / face_value_rms()
    systems = {
        "ideal": _System((IDEAL[0], 0.0), (IDEAL[1], 0.0), spectrum=True),
        "system 2": _System((STRONG[0], 0.0), (STRONG[1], 0.0), spectrum=True),
        "face value": _System((1.0, 1.0), (1.0, 1.0)),
        ALIKE: _System((1.0, 1.0), (1.0, 1.0)),
    }
    for size in SIZES:
        weight = size * unit
        systems[size_name(size)] = _System((1.0, weight), (1.0, weight), size == 1.0)
    others = {cutoff: _System((1.0, 1.0), (1.0, 1.0)) for cutoff in CUTOFFS}
    estimator = SpectrumEstimator(SAMPLE_RATE)
    kept: list[FloatArray] = []
    kept_eta: list[FloatArray] = []
    done = 0
    with ThreadPoolExecutor() as threads:
        while done < samples:
            count = min(_BLOCK // _EVERY * _EVERY, samples - done)
            noise = laser.draw(count)
            eta = _pair(arms[LOWEST], count)
            jobs = [
                threads.submit(system.advance, noise, (eta[0], eta[0 if name == ALIKE else 1]))
                for name, system in systems.items()
            ]
            jobs += [
                threads.submit(system.advance_with, noise, arms[cutoff])
                for cutoff, system in others.items()
            ]
            jobs.append(threads.submit(estimator.add, noise))
            for job in jobs:
                job.result()
            kept.append(noise[::_EVERY].copy())
            kept_eta.append(np.stack([series[::_EVERY] for series in eta]))
            done += count
    series = np.concatenate(kept)
    systems |= {cutoff_name(cutoff): system for cutoff, system in others.items()}
    return Run(
        np.arange(series.size) * _EVERY / SAMPLE_RATE,
        Trace(series, estimator.spectrum(), None),
        np.concatenate(kept_eta, axis=1),
        {name: system.trace() for name, system in systems.items()},
    )


def envelope(trace: Trace, length: int = 500) -> tuple[FloatArray, FloatArray]:
    """Return the largest magnitude in stretches of a series, for a figure.

    Parameters
    ----------
    trace : Trace
        With a value every second.
    length : int, optional
        Of a stretch, in s.

    Returns
    -------
    time, size : float arrays
        Middle of each stretch in s, and the largest magnitude in it.
    """
    number = trace.series.size // length
    parts = np.abs(trace.series[: number * length]).reshape(number, length)
    middle = length * (np.arange(number, dtype=np.float64) + 0.5)
    return np.asarray(middle), np.asarray(parts.max(axis=1))


class Suppression(NamedTuple):
    """Suppression of the laser's noise, measured and expected, with a confidence band.

    The expectation is for constant c1, c2, and as the estimator sees it.
    """

    frequency: FloatArray
    measured: FloatArray
    expected: FloatArray
    lower: FloatArray
    upper: FloatArray


def closed_loop(frequency: FloatArray, c1: float, c2: float) -> FloatArray:
    """Return 1/|1 + L| of the simulated loop, at frequencies in Hz."""
    return np.asarray(np.abs(_sensitivity(frequency, c1, c2)))


def _sensitivity(frequency: FloatArray, c1: float, c2: float) -> ComplexArray:
    """Return 1/(1 + L) of the simulated loop, at frequencies in Hz."""
    # Next to zero, where the sensor has a pole and the loop none.
    omega = 2.0 * np.pi * np.clip(frequency, 1e-9, 0.4999 * SAMPLE_RATE)
    loop = sampled_open_loop(paper_loop(), omega, c1, c2, SAMPLE_RATE)
    return np.asarray(1.0 / (1.0 + loop))


class Parting(NamedTuple):
    """How the closed loop at System 2's point differs most from that at the ideal point.

    Attributes
    ----------
    ratio, at : float
        Largest ratio of 1/|1 + L|, and its frequency in Hz.
    phase, phase_at : float
        Largest difference of its phase in rad, and its frequency in Hz.
    """

    ratio: float
    at: float
    phase: float
    phase_at: float


def parting() -> Parting:
    """Return where, and by how much, the constant perturbation changes the closed loop."""
    frequency = np.geomspace(1e-8, 1e-3, 4000)
    ratio = _sensitivity(frequency, *STRONG) / _sensitivity(frequency, *IDEAL)
    size, phase = np.abs(ratio), np.abs(np.angle(ratio))
    first, second = int(size.argmax()), int(phase.argmax())
    return Parting(
        float(size[first]),
        float(frequency[first]),
        float(phase[second]),
        float(frequency[second]),
    )


def laser_density(frequency: FloatArray) -> FloatArray:
    """Density of the free-running laser in the run, in Hz/sqrt(Hz)."""
    return LaserNoise(_LASER_SEED, SAMPLE_RATE).asd(frequency)


def expected_density(spectrum: Spectrum, point: tuple[float, float]) -> FloatArray:
    """Density of the locked laser in Hz/sqrt(Hz) at a constant (c1, c2), as estimated."""
    return spectrum.expected(lambda f: laser_density(f) * closed_loop(f, *point))


def suppression(
    name: str, point: tuple[float, float], band: tuple[float, float] = BAND
) -> Suppression:
    """Compare a system of the run with theory at a constant point, over a band in Hz."""
    run = full_run()
    found = run.traces[name].spectrum
    if found is None:
        raise ValueError(f"name must be a system with a spectrum, got {name!r}")
    below, above = found.within(*band), run.noise.spectrum.within(*band)  # type: ignore[union-attr]
    measured = above.asd / below.asd
    expected = above.expected(laser_density) / expected_density(below, point)
    return Suppression(
        below.frequency,
        measured,
        expected,
        measured * below.asd / below.upper,
        measured * below.asd / below.lower,
    )


def growth_rate(difference: FloatArray) -> FloatArray:
    """Rate in 1/s at which the loop at (1, 1 - difference) grows, 0 where it is stable.

    Interpolated between rightmost roots; the loop depends on c1 - c2 far more than on the
    sum.
    """
    rates = _growth_table()
    return np.asarray(
        np.where(
            difference > rates[0, 0],
            np.interp(np.log(np.maximum(difference, rates[0, 0])), np.log(rates[0]), rates[1]),
            0.0,
        )
    )


@cache
def _growth_table() -> FloatArray:
    loop = paper_loop()
    edge = critical_perturbation(loop, (0.0, -1.0))
    steps = edge * np.geomspace(1.0, 1e4, 25)
    roots = [0.0]
    roots += [complex(np.asarray(rightmost_root(loop, 1.0, 1.0 - d))).real for d in steps[1:]]
    return np.array([steps, roots])


def difference(size: float) -> FloatArray:
    """Return c1 - c2 of the run once a second, with perturbations of a given size."""
    eta = full_run().perturbations
    return np.asarray((eta[0] - eta[1]) * (size * PERTURBATION / face_value_rms()))


def exponent(size: float) -> float:
    """Growth rate of the frozen loop, integrated over the run."""
    return float(growth_rate(difference(size)).sum() * _EVERY / SAMPLE_RATE)


class Sizes(NamedTuple):
    """R.m.s. about zero and largest magnitude of c1 - 1 and of c2 - 1, each shape (2,)."""

    rms: FloatArray
    peak: FloatArray


def drawn_sizes(size: float = 1.0) -> Sizes:
    """Return how large the perturbations are that the run has drawn.

    Parameters
    ----------
    size : float, optional
        Factor before those of System 1.
    """
    eta = full_run().perturbations * (size * PERTURBATION / face_value_rms())
    return Sizes(np.sqrt(np.mean(eta**2, axis=1)), np.abs(eta).max(axis=1))


@cache
def drawn_differences() -> FloatArray:
    """Return `DRAWS` random courses of c1 - c2, of the run's length and System 1's size.

    Returns
    -------
    float array, shape (DRAWS, n)
        One value every 100 s. Stretches of one long series, as far from each other as they
        are long: many times the time over which the series forgets.
    """
    length = sample_count(DURATION, _DRAW_RATE)
    first, second = (
        PerturbationNoise(seed, _DRAW_RATE, cutoff=LOWEST)
        .draw(2 * DRAWS * length)
        .reshape(DRAWS, 2, length)[:, 0]
        for seed in _DRAW_SEEDS
    )
    return np.asarray((first - second) * (PERTURBATION / face_value_rms()))


def leaving_probability(size: float = 1.0) -> float:
    """Probability that (c1, c2) leaves the stable region for a time, over random draws.

    Parameters
    ----------
    size : float, optional
        Factor before the perturbations of System 1.

    Returns
    -------
    float
        Share of the draws of `drawn_differences`, known to about 0.01.

    Examples
    --------
    >>> from book.companion.claims.simulation import leaving_probability
    >>> print(f"{leaving_probability():.1f}")
    0.4
    """
    return float((size * drawn_differences().max(axis=1) > stable_up_to()).mean())


def growing_probability(size: float = 1.0, growth: float = 1.0) -> float:
    """Probability that the unstable root of the frozen loop grows by more than e^growth.

    Parameters
    ----------
    size : float, optional
        Factor before the perturbations of System 1.
    growth : float, optional
        Rate of the unstable root, integrated over the run.

    Returns
    -------
    float
        Share of the draws of `drawn_differences`.
    """
    grown = growth_rate(size * drawn_differences()).sum(axis=1) / _DRAW_RATE
    return float((grown > growth).mean())


def reduction_quantile(share: float) -> float:
    """Factor by which the printed spectrum must be reduced to stay in the stable region.

    Parameters
    ----------
    share : float
        Of the random draws for which the factor is enough.
    """
    widest = float(np.quantile(drawn_differences().max(axis=1), share))
    return face_value_rms() / PERTURBATION * widest / stable_up_to()


def stable_up_to() -> float:
    """Largest c1 - c2 at which the loop with constant c1 = 1 and c2 is stable."""
    return float(_growth_table()[0, 0])


def chain_exponent(until: float) -> float:
    """Growth of the chain of roots at high frequency, with c1 = c2 at face value.

    At high frequency the loop with c1 = c2 = c multiplies its content by
    c / (1 + 1/(2 g)) each round trip.

    Parameters
    ----------
    until : float
        In s from the start.

    Returns
    -------
    float
        The largest rise of the exponent up to then.
    """
    run = full_run()
    gain = abs(float(paper_loop().controller.gain))
    delay = 0.5 * (paper_loop().tau1 + paper_loop().tau2)
    c = 1.0 + run.perturbations[0, run.time < until]
    course = np.cumsum(np.log(c / (1.0 + 0.5 / gain))) * (_EVERY / SAMPLE_RATE / delay)
    return float((course - np.minimum.accumulate(course)).max())


class Start(NamedTuple):
    """A way to switch the loop on, and the locked laser's spectrum after it."""

    name: str
    spectrum: Spectrum


@cache
def starts() -> tuple[Start, ...]:
    """Spectra of the ideal loop after three ways to switch it on, once it has settled.

    They are taken over the seconds `SETTLED` from t = 0. The laser's noise starts at zero,
    with nothing in the arms; or it is there at once, in the middle of its course, with nothing
    in the arms; or it has filled them before.
    """
    settling, until = (sample_count(t, SAMPLE_RATE) for t in SETTLED)
    reach = Simulation(paper_loop(), SAMPLE_RATE).history_samples
    found = []
    for name, rest, filled in (
        ("noise starts at zero", True, False),
        ("noise is there, arms empty", False, False),
        ("noise is there, arms filled", False, True),
    ):
        laser = LaserNoise(_LASER_SEED, SAMPLE_RATE, at_rest=rest)
        history: FloatArray | float = laser.draw(reach) if filled else 0.0
        run = Simulation(paper_loop(), SAMPLE_RATE, history=history)
        estimator = SpectrumEstimator(SAMPLE_RATE)
        run.advance(laser.draw(settling))
        for noise in laser.blocks(until - settling, _BLOCK):
            estimator.add(run.advance(noise))
        found.append(Start(name, estimator.spectrum()))
    return tuple(found)


def chain_decay() -> float:
    """Time constant in s of the slowest of the neutral loop's roots at high frequency."""
    gain = 2.0 * abs(float(paper_loop().controller.gain))
    delay = 0.5 * (paper_loop().tau1 + paper_loop().tau2)
    return delay / float(np.log1p(1.0 / gain))


def filled_from(factor: float = 2.0) -> float:
    """Frequency in Hz from which filled arms leave more noise than empty ones, by a factor."""
    quiet, _, filled = (start.spectrum for start in starts())
    return float(quiet.frequency[filled.asd > factor * quiet.asd].min())


def orders(ratio: float) -> float:
    """Return a ratio as orders of magnitude."""
    return float(np.log10(ratio))


def bode_difference(tolerance: float = 0.1) -> float:
    """Frequency in Hz below which 1/|1 + L| at the two constant points differs."""
    frequency = np.geomspace(1e-8, 1e-3, 4000)
    ratio = closed_loop(frequency, *STRONG) / closed_loop(frequency, *IDEAL)
    return float(frequency[np.abs(ratio - 1.0) > tolerance].max())


def alike_from(tolerance: float = 0.1) -> float:
    """Frequency in Hz from which the spectra of both systems agree, over the band."""
    first, second = (_spectrum(name).within(*BAND) for name in ("system 1", "system 2"))
    apart = np.abs(first.asd / second.asd - 1.0) > tolerance
    return float(first.frequency[apart].max()) if apart.any() else BAND[0]


def _spectrum(name: str) -> Spectrum:
    found = full_run().traces[name].spectrum
    if found is None:
        raise ValueError(f"name must be a system with a spectrum, got {name!r}")
    return found


@claim(
    "M1",
    place="Sec. IV.C, Fig. 10a",
    says="With the controller, the loop is stable at the constant perturbation (c₁, c₂) = "
    "(1, 1 - 10⁻⁶).",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 0.0),
)
def constant_perturbation() -> Finding:
    """Count, and look at the run."""
    count = int(unstable_roots(paper_loop(), *STRONG))
    root = complex(np.asarray(rightmost_root(paper_loop(), *STRONG)))
    trace, noise = full_run().traces["system 2"], full_run().noise
    largest = float(np.abs(trace.series).max() / np.abs(noise.series).max())
    return Finding(
        Verdict.REPRODUCED if count == 0 and trace.diverged is None else Verdict.DIFFERS,
        count,
        "unstable roots",
        f"Over {DURATION:.0f} s the output stays within {largest:.2f} times the largest input. "
        f"The run alone would not settle it: the slowest root, at {root.real:.2e} 1/s, takes "
        f"{-1.0 / root.real:.0f} s to decay by a factor e. The count does.",
    )


@claim(
    "M2",
    place="Sec. IV.C, Fig. 10a",
    says="The loop stays stable with time-varying c₁, c₂ of the appendix's spectrum.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 9031.8, 1.0),
)
def varying_perturbation() -> Finding:
    """Run the spectrum at face value and at other sizes; compare with frozen loops."""
    run = full_run()
    edge = stable_up_to()
    widest = float(difference(1.0).max())
    reduced = face_value_rms() * widest / (edge * PERTURBATION)
    face, small = run.traces["face value"], run.traces["system 1"]
    alike = run.traces[ALIKE]
    higher = [run.traces[cutoff_name(cutoff)] for cutoff in CUTOFFS]
    explained = (
        all((exponent(size) > 10.0) == (_grown(size) > 1e3) for size in SIZES)
        and exponent(1.0) == 0.0
    )
    if face.diverged is None:
        verdict = Verdict.REPRODUCED
    else:
        verdict = Verdict.IN_PART if small.diverged is None and explained else Verdict.DIFFERS
    rms = drawn_sizes().rms
    return Finding(
        verdict,
        reduced,
        "factor by which the printed spectrum must be reduced so that, in this run, (c₁, c₂) "
        "stays in the region in which the loop with constant c₁, c₂ is stable",
        f"At face value (r.m.s. {face_value_rms():.2g} from {LOWEST:g} Hz on) the output "
        f"exceeds all input from {face.diverged:.0f} s on, until it is {LIMIT:g} times larger. "
        f"With the spectrum reduced to {PERTURBATION:g} in that band it stays bounded; the "
        f"series of this run then have an r.m.s. of {rms[0]:.2g} and {rms[1]:.2g}, c₁ - c₂ "
        f"reaches {widest:.2g}, and with constant c₁, c₂ the loop is stable up to {edge:.3g}. "
        f"Other draws go further: in {100 * leaving_probability():.0f} percent of {DRAWS} "
        "random ones c₁ - c₂ exceeds that limit for a time, so that a root is unstable, though "
        f"in only {100 * growing_probability():.1f} percent for long enough that this root "
        "alone grows by a factor e. Half of the draws need a reduction by more than "
        f"{reduction_quantile(0.5):.0f}, one in ten by more than {reduction_quantile(0.9):.0f}."
        " The lowest frequencies decide, and the paper does not say where its spectrum ends: "
        f"at face value, but flat below {1e3 * CUTOFFS[1]:g} mHz, the output "
        f"{_outcome(higher[1])}; flat below {1e3 * CUTOFFS[0]:g} mHz, it "
        f"{_outcome(higher[0])}. With the same perturbation in both arms at face value it "
        f"{_outcome(alike)}, because the roots at high frequency need c₁ + c₂ < 2 + 1/g.",
    )


def _outcome(trace: Trace) -> str:
    """Say in a few words what became of a run."""
    if trace.diverged is None:
        return "stays bounded"
    return f"is lost from {trace.diverged:.0f} s on"


def _grown(size: float) -> float:
    """Largest output of a run relative to that of the ideal loop."""
    traces = full_run().traces
    largest = np.abs(traces[size_name(size)].series).max()
    return float(largest / np.abs(traces["ideal"].series).max())


@claim(
    "M3",
    place="Sec. IV.C, Figs. 10b and 10c",
    says="The loop reduces the laser's noise by about three to four orders from 0.1 mHz to "
    "1 Hz, under time-varying perturbations (System 1) and constant ones (System 2).",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 2.98832, 1e-5),
)
def suppression_reached() -> Finding:
    """Compute |1 + L| over the band, and measure the suppression of both systems."""
    second, first = suppression("system 2", STRONG), suppression("system 1", IDEAL)
    frequency = np.geomspace(*BAND, 20_000)
    theory = 1.0 / closed_loop(frequency, *STRONG)
    low, high = orders(float(theory[0])), orders(float(theory.max()))
    varying = orders(float(first.measured.min()))
    constant_holds = low > 2.9 and high < 4.5 and theory.argmin() == 0
    measured = abs(orders(float(second.measured[0] / second.expected[0]))) < 0.1
    if not (constant_holds and measured):
        verdict = Verdict.DIFFERS
    else:
        verdict = Verdict.IN_PART if varying < 2.9 else Verdict.REPRODUCED
    return Finding(
        verdict,
        low,
        "orders of magnitude, |1 + L| of System 2, with the open loop L, at "
        f"{1e3 * BAND[0]:g} mHz, where it is smallest in the band",
        f"For System 2 it holds: |1 + L| lies between {low:.2f} and {high:.2f} orders, and "
        f"the run has {orders(float(second.measured[0])):.2f} in its lowest band, at "
        f"{1e3 * second.frequency[0]:.2g} mHz. System 1 comes down to {varying:.2f} orders "
        f"below {1e3 * alike_from():.1g} mHz: there the varying c₁, c₂ multiply the slow noise "
        "that no loop of this kind removes, and the sensor's integral brings the product up.",
    )


@claim(
    "M4",
    place="Sec. IV.C, Figs. 9, 10b and 10c",
    says="The spectra of System 1 (time-varying c₁, c₂) and System 2 (constant ones) are "
    "nearly alike, because the Bode plots differ below 1 µHz only.",
    chapter=CHAPTER,
    pinned=(Verdict.IN_PART, 5.0068e-4, 1e-6),
)
def spectra_alike() -> Finding:
    """From which frequency on the spectra agree, and the Bode plots."""
    first, second = (_spectrum(name).within(*BAND) for name in ("system 1", "system 2"))
    ratio = first.asd / second.asd
    start = alike_from()
    return Finding(
        Verdict.IN_PART if start > 1.5 * BAND[0] else Verdict.REPRODUCED,
        start,
        "Hz, frequency from which the two spectra agree within 10 percent",
        f"Above it they do; at {first.frequency[0]:.1e} Hz System 1 is {ratio[0]:.1f} times "
        "noisier. The closed loops at the constant points (1, 1) and (1, 1 - 10⁻⁶) differ by "
        f"more than 10 percent below {bode_difference():.1e} Hz only, but that does not settle "
        "it: c₁ and c₂ of System 1 vary within the band, and the Bode plot of a loop with "
        "constant c₁, c₂ leaves out what they mix.",
    )


@claim(
    "M5",
    place="Sec. IV.C, Fig. 10a",
    says="Over long times the outputs of System 1 (time-varying c₁, c₂) and System 2 (constant "
    "ones) differ noticeably.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.2192, 1e-3),
)
def long_times() -> Finding:
    """R.m.s. of the difference of the outputs, relative to the output, over the run."""
    traces = full_run().traces
    first, second = traces["system 1"].series, traces["system 2"].series
    share = float(np.std(first - second) / np.std(second))
    early = slice(0, first.size // 20)
    start = float(np.std((first - second)[early]) / np.std(second))
    most = parting()
    return Finding(
        Verdict.REPRODUCED if share > 0.05 > start else Verdict.DIFFERS,
        share,
        "r.m.s. of the difference of the outputs, relative to the output of System 2",
        f"In the first twentieth of the run it is {start:.1e}. The reason is the loop below "
        f"{1e6 * bode_difference():.0f} µHz, where the open loop's gain |L| is about one or "
        "less, the laser's noise passes, and by how much depends on c₁ - c₂: from (1, 1) to "
        f"(1, 1 - 10⁻⁶) the closed loop's 1/|1 + L| grows up to {most.ratio:.2f}-fold (at "
        f"{1e6 * most.at:.1f} µHz) and its phase moves by up to {np.degrees(most.phase):.0f} "
        f"degrees (at {1e6 * most.phase_at:.1f} µHz). A period there lasts for days, so the "
        "outputs part slowly. The paper names small phase shifts that accumulate; but the "
        "gain changes more than the phase, and in a stable loop nothing accumulates.",
    )


@claim(
    "M6",
    place="Sec. IV.C, Fig. 10c",
    says="The simulated spectrum of System 2 (constant c₁, c₂) agrees with the theory.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.05787, 1e-4),
)
def agreement_with_theory() -> Finding:
    """Compare measured suppression with |1 + L|, band by band."""
    found = suppression("system 2", STRONG)
    inside = float(((found.lower < found.expected) & (found.upper > found.expected)).mean())
    deviation = np.abs(found.measured / found.expected - 1.0)
    worst = int(deviation.argmax())
    above = float(deviation[found.frequency > 1e-3].max())
    agrees = deviation[worst] < 0.1 and above < 0.02 and inside >= 0.95
    return Finding(
        Verdict.REPRODUCED if agrees else Verdict.DIFFERS,
        float(deviation[worst]),
        "largest relative deviation of the measured suppression from |1 + L|, with the open "
        "loop L, over all bands",
        f"{found.frequency.size} bands from {1e3 * BAND[0]:g} mHz to {BAND[1]:g} Hz. The "
        f"largest is at {1e3 * found.frequency[worst]:.2g} mHz, where few averages enter; "
        f"from 1 mHz on none exceeds {100.0 * above:.1f} percent. {100.0 * inside:.0f} percent "
        "of the 95 percent confidence intervals hold the theory, and most hold it near their "
        "middle, because the scatter of the input and of the output is mostly the same.",
    )


@claim(
    "M7",
    place="Captions of Figs. 10(a) and 10(c)",
    says="System 2 stands at (1, 1 - 10⁻⁶) by the caption of Fig. 10(a), at (1, 1) by that of "
    "Fig. 10(c).",
    chapter=CHAPTER,
    pinned=(Verdict.NOT_AS_WRITTEN, 3.879e-4, 5e-6),
    affects=("M1", "M4"),
)
def which_point() -> Finding:
    """Whether the figure's spectrum could tell the two points apart."""
    strong, ideal = (_spectrum(name).within(*BAND) for name in ("system 2", "ideal"))
    apart = float(np.abs(strong.asd / ideal.asd - 1.0).max())
    traces = full_run().traces
    late = float(
        np.abs(traces["system 2"].series - traces["ideal"].series).max()
        / np.abs(traces["ideal"].series).max()
    )
    return Finding(
        Verdict.NOT_AS_WRITTEN if apart < 0.01 else Verdict.DIFFERS,
        apart,
        f"largest relative difference of the spectra at the two points, {1e3 * BAND[0]:g} mHz "
        f"to {BAND[1]:g} Hz",
        "One of the captions is misprinted. The text speaks of a constant perturbation of "
        "System 2, so it is that of panel (c), and we simulate System 2 at (1, 1 - 10⁻⁶). "
        "Panel (c) itself cannot tell: on the same input the spectra at the two points agree "
        f"to less than a line's width, although the series differ by up to {100 * late:.0f} "
        "percent of the largest output.",
    )


@claim(
    "M8",
    place="Sec. IV.C",
    says="The input is laser frequency noise of 30/f Hz/√Hz.",
    chapter=CHAPTER,
    pinned=(Verdict.REPRODUCED, 0.0, 0.03),
)
def laser_input() -> Finding:
    """Compare the spectrum of the run's input with the formula."""
    found = full_run().noise.spectrum
    if found is None:
        raise AssertionError("the input has a spectrum")
    formula = found.expected(lambda f: LASER_NOISE / np.hypot(f, LOWEST))
    sharp = (found.degrees > 1e4) & (found.frequency < 90.0)
    worst = float(np.abs(found.asd / formula - 1.0)[sharp].max())
    return Finding(
        Verdict.REPRODUCED if worst < 0.03 else Verdict.DIFFERS,
        worst,
        "largest relative deviation of the input's spectrum from 30/f, where known to 1 %",
        "The density must end somewhere at low frequency, which the paper does not say; here "
        f"the series starts at zero and is {DURATION:.0f} s long. The level is that of a laser "
        f"already stabilised: free-running ones are usually taken as {FREE_RUNNING:.0f}/f "
        "Hz/√Hz (McKenzie, Spero and Shaddock 2009), "
        f"{FREE_RUNNING / LASER_NOISE:.0f} times as much. The loop is linear, and its "
        "suppression the same.",
    )
