"""Claims of the appendix, on the phase measurement; its A3 is a place of claim N1."""

from __future__ import annotations

from functools import cache
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
from book.companion.claims.ledger import Finding, Verdict, Weight, claim
from book.companion.claims.simulation import (
    LOWEST,
)
from book.companion.shared import shared

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
    pinned=(Verdict.ONE_READING, 0.39334, 1e-4),
    weight=Weight.DERIVATION,
)
def gain_mismatch() -> Finding:
    """Compare the exact arctangent with the linear model, at small phases and at all."""
    small = 1e-4
    # The slope of the arctangent's argument at zero is eta / (1 + epsilon_I).
    off = abs(1.0 / (1.0 + MISMATCH[0]) - 1.0)
    # The next term of the series is -2/3 phase^2.
    series = (1.0 - off) * (1.0 - 2.0 * small**2 / 3.0)
    agrees = abs(float(phase_error(small)) / (ETA * small) - series) < 1e-12
    reach = linear_up_to(0.1)
    return Finding(
        {
            "φ a small phase, such as the residual of a phase-locked loop": agrees
            and off < 1e-5,
            "φ a phase of many turns, such as that of the laser": reach > 2.0 * np.pi,
        },
        reach,
        "phase in rad up to which the error is $ηφ$ within 10 %",
        f"For $ε_I = {MISMATCH[0]:g}$ and $ε_Q = {MISMATCH[1]:g}$ the slope at zero phase is "
        "$η/(1 + ε_I)$.",
    )


@claim(
    "A2",
    place="Appendix, Eq. (A4) and the text around it",
    says="By $(1 + η)φ$, unequal I and Q channels make $c₁$ and $c₂$ differ from 1.",
    pinned=(Verdict.DIFFERS, 0.5, 1e-6),
    printed="where $φ_m$ denotes the laser phase measured ..., η represents the parameter "
    "perturbation associated with $c_1$ and $c_2$",
)
def any_phase() -> Finding:
    """Take the error's largest value, and its mean over a turn."""
    # tan of the error is largest where tan of the phase is the root of the ratio of the gains.
    largest = float(np.abs(np.arcsin(ETA / (2.0 + sum(MISMATCH))) / ETA))
    proportional = abs(mean_over_turn()) > 1e-12 * abs(ETA) or largest > 1.0
    return Finding(
        {"": proportional},
        largest,
        "largest error in rad of a measured phase, in units of η, for any phase",
        "The factors $c₁$ and $c₂$ multiply the whole phase that returns, which for the laser "
        f"of the simulation has an r.m.s. of {laser_phase_rms():.1e} rad. Unequal channels err "
        "by $(η/2) sin 2φ$, no more than η/2 rad and zero on average over a turn. They cannot "
        "make $c$ differ from 1 for the phase of the laser.",
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
    close = float(deviation[found.measured.averages > 1000.0].max())
    factor = laser_phase_rms()
    # By this factor eta must lie below the additive noise: one or several orders, it says.
    return Finding(
        {"": {"a convolution": close < 0.05, "one or several orders below": factor < 1e3}},
        close,
        "largest relative difference between the product's spectrum and the convolution, in "
        "bands with at least 1000 averages",
        "The convolution is right for independent stationary signals. The error is η times the "
        f"phase, whose r.m.s. is {factor:.1e} rad for the laser of the simulation, so that η "
        f"must be about {np.log10(factor):.0f} orders below δφ. The paper takes η as large as "
        "δφ, which is conservative.",
    )


@claim(
    "A6",
    place="Appendix, after Eq. (A4)",
    says="Imperfect quadrature of the channels makes a multiplicative phase error as well.",
    pinned=(Verdict.ONE_READING, 1.5e-12, 1e-14),
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
        {
            "a phase near zero": at_zero > 0.5 * error,
            "a phase that stays near 45 degrees": most > 0.5 * error,
        },
        at_zero,
        "relative error of a small phase about zero, from channels that are "
        f"{error:g} rad off a quarter turn",
        "A phase near zero, of which the appendix speaks, has an offset and an error of "
        f"second order only. Around 45 degrees the factor deviates by {most:.1e}, which is of "
        "first order.",
    )


@claim(
    "A7",
    place="Appendix, first paragraph",
    says="A nonlinear phase-locked loop, clock noise, intensity noise, pointing and residual "
    "phase noise make $c₁$ and $c₂$ differ from 1.",
    pinned=(Verdict.OPEN, 0.0, 1e-15),
    printed="The PLL loop itself is nonlinear, and the coupling between clock noise and the "
    "phase demodulation process can lead to parameter perturbations. In addition, ... (RIN), "
    "... (TTL), and residual laser phase noise in the PLL may cause the noise parameters $c_1$ "
    "and $c_2$ to deviate",
)
def other_causes() -> Finding:
    """Change the amplitude in the paper's own model of the phase measurement."""
    phase, relative = np.linspace(0.1, 1.4, 14), 0.01
    in_phase, quadrature = (1.0 + relative) * np.cos(phase), (1.0 + relative) * np.sin(phase)
    changed = float(np.abs(np.arctan2(quadrature, in_phase) - phase).max())
    return Finding(
        {},
        changed,
        f"change in rad of the measured phase by an intensity that is {100 * relative:g} % "
        "off, the only cause that the paper's own model can compute",
        "In that model the amplitude cancels in the ratio of the two channels. A tilt adds to "
        "the path, a clock to the phase of the beat note. That any of the five multiplies the "
        "phase is possible and not shown.",
        missing="the mechanism and the size of each cause",
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
        {},
        1e12 * cycles * wavelength,
        "pm/√Hz at 1064 nm, the level of Eq. (A5) as a path length",
        f"The level is {1e6 * cycles:.1f} µcycle/√Hz. The white paper has "
        f"{1e6 * LEVELS.shot:g} µcycle/√Hz for the shot noise of one link. No other claim "
        "depends on this one.",
        missing="the document that states the requirement",
    )


@claim(
    "A9",
    place="Appendix, after Eq. (A4)",
    says="Schwarze et al. (2019) model multiplicative noise in a similar way.",
    pinned=(Verdict.OPEN, 0.0, 0.0),
    weight=Weight.DERIVATION,
    printed="Similar multiplicative noise modeling can also be found in",
)
def precedent() -> Finding:
    """Nothing can be computed: the work is not part of the text that we have."""
    return Finding(
        {},
        0.0,
        "passages of that work that the paper quotes",
        "The paper names the work and no equation or page of it. Its subject is the linearity "
        "of a phase measurement, which is an additive error that depends on the phase.",
        missing="the passage that is meant",
    )
