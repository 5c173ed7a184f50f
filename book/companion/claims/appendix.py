"""Claims of the appendix, the perturbation of phase measurements: A1 to A8."""

from __future__ import annotations

from functools import cache, partial
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
from armlock.performance.budget import LEVELS
from armlock.timedomain.noise import PerturbationNoise, ShapedNoise
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

claim = partial(ledger.claim, chapter="07_perturbations")

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


@cache
def _convolved() -> tuple[FloatArray, FloatArray]:
    """Return frequencies in Hz and the density of the product of phase and perturbation there.

    By convolution, in rad^2/Hz on both sides of zero. The grid is fine enough for the narrowest
    of their features: that of a periodic function without a kink, the sum then is the integral
    but for rounding.
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
    return grid[half], whole[half]


def convolved_density(frequency: FloatArray) -> FloatArray:
    """Density of the product of phase and perturbation, by convolution, in rad/sqrt(Hz)."""
    return np.sqrt(2.0 * np.interp(frequency, *_convolved()))


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
        "$η/(1 + ε_I)$. The Taylor series is one for small φ; claim A2 has larger ones.",
    )


@claim(
    "A2",
    place="Appendix, Eq. (A4)",
    says="The measured phase is $(1 + η)φ$, for the phase φ of the laser.",
    pinned=(Verdict.IN_PART, 0.39334, 1e-4),
    printed=r"$φ_m = (1 + η)φ$, where ... φ denotes the true phase value",
)
def any_phase() -> Finding:
    """Phase up to which the linear model holds, and the error's mean and largest value."""
    # tan of the error is largest where tan of the phase is the root of the ratio of the gains.
    largest = float(np.abs(np.arcsin(ETA / (2.0 + sum(MISMATCH))) / ETA))
    of_any_phase = abs(mean_over_turn()) > 1e-12 * abs(ETA) or largest > 1.0
    reach = linear_up_to(0.1)
    return Finding(
        decide(reach > 0.1, of_any_phase),
        reach,
        "phase in rad up to which the error is $ηφ$ within 10 percent",
        "True of a small phase, such as the residual of a phase-locked loop, if φ is read as "
        f"that. The loop needs it of the whole phase, of {laser_phase_rms():.1e} rad r.m.s. "
        "over the simulated band: there the error is $(η/2) sin 2φ$, no larger than "
        f"{largest:.3f} η, with a mean of zero over whole turns. Another cause than unequal "
        "channels may give a gain error of the whole phase.",
    )


@claim(
    "A3",
    place="Appendix, Eq. (A5), and Sec. IV.A",
    says="The spectrum taken for η stands for perturbations of at most $10⁻⁶$.",
    pinned=(Verdict.OPEN, 22375.1, 0.1),
    printed="the amplitude spectral density (ASD) of the additive noise is used as an estimate "
    "for the ASD of η",
)
def size_of_spectrum() -> Finding:
    """Integrate the spectrum over the simulated band."""
    rms = face_value_rms()
    # The flat part apart, the variance is level^2 pi corner^4 / (4 cutoff^3).
    level = PHASE_NOISE_LEVEL / PERTURBATION
    lowest = np.cbrt(0.25 * np.pi * level**2 * PHASE_NOISE_CORNER**4)
    return Finding(
        decide(settled=rms <= 2.0 * PERTURBATION),
        rms / PERTURBATION,
        "r.m.s. of what is drawn from the spectrum, in units of $10⁻⁶$",
        "The same numbers as in claim N1, from the side of the appendix: it takes this "
        "spectrum as an estimate, says that η needs to be some orders below it, and names no "
        "factor. Unreduced, the part that rises towards low frequency has an r.m.s. of $10⁻⁶$ "
        f"only if it is flat below {1e3 * lowest:.1f} mHz.",
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
        "paper takes it as large as δφ, and calls that conservative.",
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
    fast = np.geomspace(1e-4, 0.4999 * SAMPLE_RATE, 10_000)
    above = np.trapezoid(source.sampled_asd(fast) ** 2 * fast, np.log(fast))
    slow = 1.0 - float(above) / source.rms**2
    return Finding(
        decide(worst < 0.03 and inside > 0.85),
        worst,
        "largest relative deviation of the series' spectrum from the formula, where it is "
        "known to 1 %",
        f"{100 * slow:.1f} percent of the variance lies below 0.1 mHz. "
        "It grows as the inverse cube of the frequency at which the spectrum is cut, which the "
        f"paper does not give; here that is {LOWEST:g} Hz, one over the duration.",
    )


@claim(
    "A6",
    place="Appendix, after Eq. (A4)",
    says="Imperfect quadrature of the channels makes a multiplicative phase error as well.",
    pinned=(Verdict.IN_PART, 1.5e-12, 1e-14),
    weight=Weight.DERIVATION,
    printed="when there is a gain mismatch or imperfect quadrature between I and Q channels "
    "..., a multiplicative DC phase error will occur",
)
def quadrature_error() -> Finding:
    """Differentiate the arctangent of channels that are not a quarter turn apart."""
    error = PERTURBATION

    def slope_less_one(phase: float) -> float:
        # Of arctan(sin(phase + error) / cos(phase)); 1 - cos as twice the square of a sine.
        below = np.cos(phase) ** 2 + np.sin(phase + error) ** 2
        turned = np.sin(phase) ** 2 - np.sin(phase + error) ** 2
        return float((turned - 2.0 * np.sin(0.5 * error) ** 2) / below)

    at_zero, most = abs(slope_less_one(0.0)), abs(slope_less_one(0.25 * np.pi))
    return Finding(
        decide(most > 0.5 * error, at_zero > 0.5 * error),
        at_zero,
        "relative error of a small phase about zero, from channels that are "
        f"{error:g} rad off a quarter turn",
        "Small phases, of which the appendix speaks, get an offset and an error of second "
        "order only. About a phase that is held elsewhere, at 45 degrees, the factor is "
        f"{most:.1e} off, of first order.",
    )


@claim(
    "A7",
    place="Appendix, first paragraph",
    says="Intensity noise, tilt-to-length coupling and residual phase noise move $c₁$, $c₂$.",
    pinned=(Verdict.OPEN, 0.0, 1e-15),
    printed="laser relative intensity noise (RIN), laser pointing noise (TTL), and residual "
    "laser phase noise in the PLL may cause the noise parameters $c_1$ and $c_2$ to deviate",
)
def other_causes() -> Finding:
    """Change the amplitude in the paper's own model of the phase measurement."""
    phase, relative = np.linspace(0.1, 1.4, 14), 0.01
    in_phase, quadrature = (1.0 + relative) * np.cos(phase), (1.0 + relative) * np.sin(phase)
    changed = float(np.abs(np.arctan2(quadrature, in_phase) - phase).max())
    return Finding(
        decide(settled=False),
        changed,
        f"change in rad of the measured phase by an intensity that is {100 * relative:g} % "
        "off, the one of the three that is computed",
        "The paper gives neither size nor mechanism. In its own model the amplitude cancels in "
        "the ratio of the two channels, and a tilt adds to the path, so to the phase: it is "
        "additive. That any of the three multiplies the phase is possible, and not shown.",
    )


@claim(
    "A8",
    place="Appendix, Eq. (A5)",
    says="Eq. (A5) is LISA's requirement on the phase noise.",
    pinned=(Verdict.OPEN, 6.0963, 1e-3),
    printed="For LISA, the phase noise requirement typically modeled as additive, is expressed "
    "as",
)
def requirement_of_lisa() -> Finding:
    """Turn the printed level into cycles and into a length."""
    cycles = PHASE_NOISE_LEVEL / (2.0 * np.pi)
    wavelength = 1064e-9
    return Finding(
        decide(settled=False),
        1e12 * cycles * wavelength,
        "pm/√Hz at 1064 nm, the level of Eq. (A5) as a path length",
        f"No document is cited for it. It is {1e6 * cycles:.1f} µcycle/√Hz; the white paper "
        f"has {1e6 * LEVELS.shot:g} µcycle/√Hz for the shot noise of one link. Whether it is a "
        "requirement on LISA decides nothing here: it is the scale of η that does (claim N1).",
    )
