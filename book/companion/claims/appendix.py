"""Claims of the appendix, the perturbation of phase measurements: A1 to A5."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad
from scipy.optimize import brentq

from armlock.checks import FloatArray
from armlock.paper import (
    LASER_NOISE,
    PERTURBATION,
    PHASE_NOISE_CORNER,
    PHASE_NOISE_LEVEL,
    SAMPLE_RATE,
)
from armlock.timedomain.noise import PerturbationNoise, ShapedNoise, band_rms
from armlock.timedomain.spectra import Spectrum, SpectrumEstimator
from book.companion.claims import ledger
from book.companion.claims.ledger import Finding, Verdict, Weight, decide
from book.companion.claims.simulation import (
    LOWEST,
    PERTURBATION_SEEDS,
    face_value_rms,
    full_run,
)
from book.companion.shared import shared

claim = partial(ledger.claim, chapter="08_perturbations")

#: Gain errors of the two channels at which the model is tried, and their difference.
MISMATCH = (2e-6, -1e-6)
ETA = MISMATCH[1] - MISMATCH[0]
#: Sample rate in Hz at which the error's spectrum is held against the convolution.
RATE = 4.0


def phase_error(phase: npt.ArrayLike, mismatch: tuple[float, float] = MISMATCH) -> FloatArray:
    """Measured minus true phase in rad, for unequal I and Q channels.

    Parameters
    ----------
    phase : array_like of float
        True phase in rad.
    mismatch : pair of float, optional
        Relative gain errors of I and Q.

    Returns
    -------
    float array, shaped like `phase`
        Of the arctangent of the ratio of the channels, on the branch next to the true phase.
    """
    # tan of a difference: no two nearly equal angles are subtracted.
    sine, cosine = np.sin(phase), np.cos(phase)
    above = (mismatch[1] - mismatch[0]) * sine * cosine
    below = (1.0 + mismatch[0]) * cosine**2 + (1.0 + mismatch[1]) * sine**2
    return np.asarray(np.arctan2(above, below))


def mean_over_turn(mismatch: tuple[float, float] = MISMATCH) -> float:
    """Mean of the error over half a turn, its period, by adaptive integration, in rad.

    Over its first quarter turn the error has one sign, over the next one the other.
    """
    quarter = 0.5 * np.pi
    parts = [
        quad(lambda x: float(phase_error(x, mismatch)), a, a + quarter, epsabs=0.0)[0]
        for a in (0.0, quarter)
    ]
    return float(sum(parts) / np.pi)


def linear_up_to(tolerance: float) -> float:
    """Phase in rad up to which the error is eta phi within a relative tolerance."""

    def excess(phase: float) -> float:
        return 1.0 - float(phase_error(phase)) / (ETA * phase) - tolerance

    return float(brentq(excess, 1e-3, 0.5 * np.pi))


class Convolution(NamedTuple):
    """Error of a phase measurement in the time domain, and as a convolution of spectra."""

    measured: Spectrum
    expected: FloatArray
    phase: Spectrum
    eta: Spectrum
    phase_rms: float


def sources() -> tuple[ShapedNoise, ShapedNoise]:
    """Return a stationary phase in rad, a line above a red part, and a perturbation."""
    turn = 2.0 * np.pi
    pair = complex(-0.004 * turn, 0.3 * turn)
    phase = ShapedNoise(
        (-0.2 * turn,), (-0.02 * turn, pair, pair.conjugate()), 3.0, seed=11, sample_rate=RATE
    )
    return phase, PerturbationNoise(12, RATE, cutoff=2e-4)


def convolved_density(frequency: FloatArray) -> FloatArray:
    """Density of the product of phase and perturbation, by convolution, in rad/sqrt(Hz).

    On a grid fine enough for the narrowest of their features: that of a periodic function
    without a kink, the sum then is the integral but for rounding.
    """
    points = 1 << 18
    grid = np.fft.fftshift(np.fft.fftfreq(points, 1.0 / RATE))
    magnitude = np.minimum(np.abs(grid), 0.4999 * RATE)
    both = [
        np.fft.fft(np.fft.ifftshift(0.5 * source.sampled_asd(magnitude) ** 2))
        for source in sources()
    ]
    # Of sampled series, the convolution goes around the sampling band.
    whole = np.fft.fftshift(np.fft.ifft(both[0] * both[1]).real) * (RATE / points)
    half = grid >= 0.0
    return np.sqrt(2.0 * np.interp(frequency, grid[half], whole[half]))


@shared
def convolution() -> Convolution:
    """Multiply a phase by an independent perturbation, and compare spectra.

    Both are stationary Gaussian series of known density. The density of the product is
    estimated from the samples, and computed from the two densities by convolution.
    """
    samples, power = 16_000_000, 0.0
    estimators = [SpectrumEstimator(RATE) for _ in range(3)]
    for phase, eta in zip(*(source.blocks(samples) for source in sources()), strict=True):
        for estimator, series in zip(estimators, (phase * eta, phase, eta), strict=True):
            estimator.add(series)
        power += float(np.sum(phase**2))
    product, phase_spectrum, eta_spectrum = (estimator.spectrum() for estimator in estimators)
    expected = product.expected(convolved_density)
    rms = float(np.sqrt(power / samples))
    return Convolution(product, expected, phase_spectrum, eta_spectrum, rms)


def printed_density(frequency: npt.ArrayLike) -> FloatArray:
    """Density that the appendix takes for the perturbations, as printed, in 1/sqrt(Hz)."""
    frequency = np.asarray(frequency, dtype=float)
    return np.asarray(PHASE_NOISE_LEVEL * np.sqrt(1.0 + (PHASE_NOISE_CORNER / frequency) ** 4))


def laser_phase_rms() -> float:
    r"""R.m.s. in rad of the phase of a laser with noise 30/f over the simulated band.

    Phase is the integral of 2 pi times frequency, so that its density in rad/sqrt(Hz) is

    .. math::

        \frac{2\pi}{2\pi f} \cdot \frac{30\ \text{Hz}^2}{f} = \frac{30\ \text{Hz}^2}{f^2} .
    """
    return float(LASER_NOISE * np.sqrt((LOWEST**-3 - (0.5 * SAMPLE_RATE) ** -3) / 3.0))


@claim(
    "A1",
    place="Appendix, Eqs. (A2) to (A4)",
    says="Unequal gains of the I and Q channels give the measured phase $(1 + η)φ$.",
    pinned=(Verdict.REPRODUCED, 1.999996e-6, 1e-12),
    weight=Weight.DERIVATION,
)
def gain_mismatch() -> Finding:
    """Slope of the exact arctangent at zero phase against the linear model."""
    small = 1e-4
    # The slope of the arctangent's argument at zero is eta / (1 + epsilon_I).
    off = abs(1.0 / (1.0 + MISMATCH[0]) - 1.0)
    # The next term of the series is -2/3 phase^2.
    series = (1.0 - off) * (1.0 - 2.0 * small**2 / 3.0)
    agrees = abs(float(phase_error(small)) / (ETA * small) - series) < 1e-12
    return Finding(
        decide(agrees and off < 1e-5),
        off,
        "relative difference of the exact error and $ηφ$, as φ goes to zero",
        f"For $ε_I = {MISMATCH[0]:g}$ and $ε_Q = {MISMATCH[1]:g}$ the slope is "
        "$η/(1 + ε_I)$. The Taylor series is one for small φ; claim A2 has the others.",
    )


@claim(
    "A2",
    place="Appendix, Eq. (A4)",
    says="The measured phase is $(1 + η)φ$, for the phase φ of the laser.",
    pinned=(Verdict.DIFFERS, 0.39334, 1e-4),
    affects=("A4",),
    printed=r"$φ_m = (1 + η)φ$, where ... φ denotes the true phase value",
)
def any_phase() -> Finding:
    """Phase up to which the linear model holds, and the error's mean and largest value."""
    largest = float(np.abs(phase_error(np.linspace(0.0, np.pi, 100_001)) / ETA).max())
    stays_small = abs(mean_over_turn()) < 1e-12 * abs(ETA) and largest < 1.0
    return Finding(
        decide(not stays_small),
        linear_up_to(0.1),
        "rad, phase up to which the error is $ηφ$ within 10 percent",
        f"The error is $(η/2) sin 2φ$: at no phase is it larger than {largest:.3f} η, and over "
        "whole turns its mean is zero. A phase that runs through many turns, as a laser's does "
        f"({laser_phase_rms():.1e} rad r.m.s. over the simulated band), is measured without "
        "any gain error. Another cause than unequal channels may give one.",
    )


@claim(
    "A3",
    place="Appendix, Eq. (A5), and Sec. IV.A",
    says="The spectrum taken for η stands for perturbations of at most $10⁻⁶$.",
    pinned=(Verdict.DIFFERS, 14579.3, 0.1),
    printed="the amplitude spectral density (ASD) of the additive noise is used as an estimate "
    "for the ASD of η",
    same_as="N1",
)
def size_of_spectrum() -> Finding:
    """Integrate the spectrum over the simulated band."""
    rms = face_value_rms()
    lowest = np.cbrt((PHASE_NOISE_LEVEL / PERTURBATION) ** 2 * PHASE_NOISE_CORNER**4 / 3.0)
    return Finding(
        decide(rms <= 2.0 * PERTURBATION),
        rms / PERTURBATION,
        "r.m.s. of the spectrum over the simulated band, in units of $10⁻⁶$",
        f"The band is from {LOWEST:g} Hz, one over the duration, to {0.5 * SAMPLE_RATE:g} Hz. "
        "The part that rises towards low frequency stays within $10⁻⁶$ only if it ends at "
        f'{1e3 * lowest:.1f} mHz. The paper\'s "one or several orders of magnitude smaller" '
        f"(claim A4) would fit with {np.log10(rms / PERTURBATION):.1f} orders, but it is the "
        "unreduced spectrum that is taken.",
    )


@claim(
    "A4",
    place="Appendix, after Eq. (A5)",
    says="The error's spectrum is a convolution, so that η must be some orders below δφ.",
    pinned=(Verdict.IN_PART, 0.0, 0.05),
    weight=Weight.DERIVATION,
    printed=r"$S_η$ typically needs to be one or several orders of magnitude smaller than $δφ$",
)
def convolution_of_spectra() -> Finding:
    """Multiply series and convolve spectra; find the factor for the paper's laser."""
    found = convolution()
    deviation = np.abs(found.measured.asd / found.expected - 1.0)
    close = float(deviation[found.measured.degrees > 2000.0].max())
    factor = laser_phase_rms()
    # By this factor eta must lie below the additive noise: one or several orders, it says.
    return Finding(
        decide(close < 0.05, factor < 1e3),
        close,
        "largest relative difference between the product's spectrum and the convolution, in "
        "bands with at least 1000 averages",
        "The convolution is right, for independent stationary signals. But a perturbation of a "
        f"slow phase is amplified by the phase's r.m.s., {factor:.1e} rad for the laser of the "
        f"simulation, so that η must be about {np.log10(factor):.0f} orders below δφ. The "
        "paper takes it as large as δφ, for caution.",
    )


@claim(
    "A5",
    place="Appendix, Fig. 11",
    says="$c₁(t)$ and $c₂(t)$ are generated from the spectrum.",
    pinned=(Verdict.REPRODUCED, 0.0, 0.03),
    weight=Weight.DERIVATION,
)
def generated_series() -> Finding:
    """Compare the spectrum of the series with the formula, and see what makes its size."""
    found = full_run().perturbation
    source = PerturbationNoise(PERTURBATION_SEEDS[0], SAMPLE_RATE, cutoff=LOWEST)
    expected = found.expected(source.asd)
    inside = float(((found.lower < expected) & (found.upper > expected)).mean())
    sharp = found.degrees > 1e4
    worst = float(np.abs(found.asd / expected - 1.0)[sharp].max())
    slow = 1.0 - (band_rms(1e-4, 0.5 * SAMPLE_RATE) / face_value_rms()) ** 2
    return Finding(
        decide(worst < 0.03 and inside > 0.85),
        worst,
        "largest relative deviation of the series' spectrum from the formula, where it is "
        "known to 1 %",
        f"{100 * slow:.1f} percent of the variance over the simulated band lies below 0.1 mHz. "
        "It grows as the inverse cube of the frequency at which the spectrum is cut, which the "
        f"paper does not give; here that is {LOWEST:g} Hz, one over the duration.",
    )
