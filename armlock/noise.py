"""Noise of a prescribed amplitude spectral density, from a seed, in blocks.

White Gaussian samples go through a filter whose response has the prescribed magnitude, so
that a series of any length can be drawn without ever being held as a whole. All spectral
densities are one-sided.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
from numba import njit
from numba.cpython.unsafe.tuple import tuple_setitem
from scipy.linalg import solve_continuous_lyapunov

from armlock import paper
from armlock.checks import FloatArray, positive_number, real_number, true_or_false, whole_number
from armlock.controllers import Controller
from armlock.discretize import Row, checked_frequency, floats, real_system, sample, warped

#: Half the number of samples over which the laser's noise is smoothed, see `LaserNoise`.
_REACH = 12
#: The band, as a share of half the sample rate, in which that smoothing is fitted.
_FITTED = 0.96
#: Largest cutoff of the laser's noise, as a share of the sample rate; see `LaserNoise`.
_LARGEST_CUTOFF = 0.01


class ShapedNoise:
    r"""White noise through a rational filter: the sampled form of one in continuous time.

    With zeros :math:`z_i`, poles :math:`p_i` and gain :math:`g` the prescribed density is

    .. math::

        \text{asd}(f) &= |H(2\pi\mathrm{j} f)| , \\
        H(s) &= g\, \frac{\prod_i (s - z_i)}{\prod_i (s - p_i)} .

    Parameters
    ----------
    zeros, poles : sequence of complex
        Of the filter, in rad/s; all poles in the left half-plane.
    gain : float
        Its gain, not zero; its magnitude at s = j omega is the amplitude spectral density.
    seed : int
        Of the random numbers.
    sample_rate : float, optional
        In Hz.
    at_rest : bool, optional
        Whether the filter starts at rest, and the series at about zero, as a simulation that
        is switched on would have it. By default it starts in the middle of its stationary
        course.

    Raises
    ------
    TypeError, ValueError
        If an argument is not finite, complex factors do not come in conjugate pairs, there are
        more zeros than poles, or a pole lies on the imaginary axis or right of it, so that the
        noise has no density.

    Notes
    -----
    With the sampling step T, the trapezoidal rule gives the samples the density

    .. math::

        \text{asd}_T(f) = \text{asd} \left( \frac{\tan \pi f T}{\pi T} \right) ,

    see `armlock.discretize.warped`. One draw and many give the same series, bit by bit.

    Examples
    --------
    One draw and several give the same series:

    >>> from armlock import ShapedNoise
    >>> whole = ShapedNoise(zeros=[], poles=[-1.0], gain=1.0, seed=1, sample_rate=10.0).draw(6)
    >>> parts = ShapedNoise(zeros=[], poles=[-1.0], gain=1.0, seed=1, sample_rate=10.0)
    >>> [*parts.draw(2), *parts.draw(4)] == list(whole)
    True
    """

    def __init__(
        self,
        zeros: Sequence[complex],
        poles: Sequence[complex],
        gain: float,
        *,
        seed: int,
        sample_rate: float = 200.0,
        at_rest: bool = False,
    ) -> None:
        self.sample_rate = positive_number("sample_rate", sample_rate)
        if real_number("gain", gain) == 0.0:
            raise ValueError(f"gain must not be zero, got {gain}")
        self._filter = Controller(zeros, poles, gain)
        for pole in self._filter.poles:
            if pole.real >= 0.0:
                raise ValueError(f"poles must lie in the left half-plane, got {pole} rad/s")
        self.seed = whole_number("seed", seed, 0)
        self.at_rest = true_or_false("at_rest", at_rest)
        self._random = np.random.default_rng(self.seed)
        continuous = real_system(self._filter.zeros, self._filter.poles, self._filter.gain)
        self._sampled = sample(continuous, self.sample_rate)
        # White samples of variance one have the one-sided density 2 / sample_rate.
        self._scale = math.sqrt(0.5 * self.sample_rate)
        A, B, _, _ = continuous.as_floats()
        self._state: Row = (0.0,) * len(A)
        if not self.at_rest and len(A):
            # The trapezoidal rule keeps the covariance.
            start = _root_of_covariance(A, B)
            self._state = floats(start @ self._random.standard_normal(len(A)))

    def __repr__(self) -> str:
        """Name the class and its arguments."""
        return (
            f"{type(self).__name__}(zeros={self._filter.zeros}, poles={self._filter.poles}, "
            f"gain={self._filter.gain}, {self._common()})"
        )

    def _common(self) -> str:
        """Return the arguments that all noises share, for their names."""
        return f"seed={self.seed}, sample_rate={self.sample_rate}, at_rest={self.at_rest}"

    def asd(self, frequency: npt.ArrayLike) -> FloatArray:
        """Prescribed density at a frequency in Hz, in the series' unit per sqrt(Hz).

        Parameters
        ----------
        frequency : array_like of float
            In Hz, not negative.

        Returns
        -------
        float array, shaped like `frequency`

        Raises
        ------
        TypeError, ValueError
            If a frequency is negative, or not finite and real.
        """
        frequency = checked_frequency("frequency", frequency, math.inf, "Hz")
        return self._density(2.0 * np.pi * frequency)

    def sampled_asd(self, frequency: npt.ArrayLike) -> FloatArray:
        """Density of the samples in closed form.

        Parameters
        ----------
        frequency : array_like of float
            In Hz, not negative and at most half the sample rate.

        Returns
        -------
        float array, shaped like `frequency`

        Raises
        ------
        TypeError, ValueError
            If a frequency is negative, above half the sample rate, or not finite and real.
        """
        frequency = self._below_half_rate(frequency)
        return self._density(warped(2.0 * np.pi * frequency, self.sample_rate))

    def _below_half_rate(self, frequency: npt.ArrayLike) -> FloatArray:
        return checked_frequency("frequency", frequency, 0.5 * self.sample_rate, "Hz")

    def _density(self, omega: FloatArray) -> FloatArray:
        return np.asarray(np.abs(self._filter(1j * omega)))

    def draw(self, samples: int) -> FloatArray:
        """Return the next samples of the series.

        Parameters
        ----------
        samples : int
            How many, zero or more.

        Returns
        -------
        float array, shape (samples,)
        """
        white = self._random.standard_normal(whole_number("samples", samples, 0))
        white *= self._scale
        sampled = self._sampled
        if not self._state:
            return white * float(sampled.direct[0])
        self._state = _filter(
            white, self._state, floats(sampled.change), floats(sampled.drive),
            floats(sampled.output), float(sampled.direct[0]),
        )  # fmt: skip
        return white

    def blocks(self, samples: int, size: int = 1 << 20) -> Iterator[FloatArray]:
        """Yield the next samples in blocks.

        Parameters
        ----------
        samples : int
            How many in all.
        size : int, optional
            Largest size of a block, one or more.

        Yields
        ------
        float array
        """
        left, most = whole_number("samples", samples, 0), whole_number("size", size, 1)

        def parts() -> Iterator[FloatArray]:
            for first in range(0, left, most):
                yield self.draw(min(most, left - first))

        return parts()


def _root_of_covariance(A: FloatArray, B: FloatArray) -> FloatArray:
    """Return R with R R^T the covariance of the stationary state, or say that it has none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            covariance = solve_continuous_lyapunov(A, -0.5 * B @ B.T)
        root = np.linalg.cholesky(0.5 * (covariance + covariance.T))
    except (RuntimeWarning, np.linalg.LinAlgError):
        raise ValueError(
            "poles and gain must leave a variance that floats can hold: the poles lie too "
            "close to the imaginary axis, or the gain is too large or too small; a series "
            "that starts at rest does without it, at_rest=True"
        ) from None
    return np.asarray(root)


@njit(cache=True)
def _filter(
    series: FloatArray, state: Row, change: Row, drive: Row, output: Row, direct: float
) -> Row:
    """Replace a series by its filtered self, and return the new state.

    `change` is a square matrix by rows. Flat tuples stay in registers.
    """
    n = len(state)
    w = state
    for i in range(series.size):
        u = series[i]
        y = direct * u
        new = w
        for j in range(n):
            y += output[j] * w[j]
            step = 0.0
            for k in range(n):
                step += change[n * j + k] * w[k]
            new = tuple_setitem(new, j, w[j] + (step + drive[j] * u))
        w = new
        series[i] = y
    return w


def sample_count(duration: float, sample_rate: float = 200.0) -> int:
    """Return the number of samples of a run.

    Parameters
    ----------
    duration : float
        In s, positive.
    sample_rate : float, optional
        In Hz, positive.

    Returns
    -------
    int
        The nearest whole number, at least one.

    Raises
    ------
    TypeError, ValueError
        If one of the two is not positive and finite, or the run is shorter than a sample.
    """
    count = positive_number("duration", duration) * positive_number("sample_rate", sample_rate)
    if not math.isfinite(count):
        raise ValueError(f"duration must be a finite number of samples, got {duration} s")
    if round(count) < 1:
        raise ValueError(f"duration must be at least one sample, got {duration} s")
    return round(count)


def band_rms(low: float, high: float) -> float:
    r"""R.m.s. of the perturbations' spectrum, as printed, between two frequencies.

    With level and corner :math:`f_0` of the paper's appendix

    .. math::

        \left[ \int_{\text{low}}^{\text{high}} \text{level}^2
        \left( 1 + \left( \frac{f_0}{f} \right)^4 \right) \mathrm{d}f \right]^{1/2} .

    Parameters
    ----------
    low, high : float
        In Hz, positive, the second one larger.

    Returns
    -------
    float
        In closed form.
    """
    low, high = positive_number("low", low), positive_number("high", high)
    if high <= low:
        raise ValueError(f"high must exceed low = {low}, got {high}")
    if low < 1e-100:
        raise ValueError(
            f"low must be at least 1e-100 Hz, where its cube can be held, got {low}"
        )
    red = paper.PHASE_NOISE_CORNER**4 * (low**-3 - high**-3) / 3.0
    return paper.PHASE_NOISE_LEVEL * math.sqrt(high - low + red)


class LaserNoise(ShapedNoise):
    r"""Frequency noise of a free-running laser, of density level / sqrt(f^2 + cutoff^2).

    .. math::

        \text{asd}(f) = \frac{\text{level}}{\sqrt{f^2 + \text{cutoff}^2}}

    Parameters
    ----------
    seed : int
        Of the random numbers.
    sample_rate : float, optional
        In Hz.
    level : float, optional
        Density at 1 Hz, in Hz/sqrt(Hz); the paper's 30 by default.
    cutoff : float, optional
        Frequency in Hz below which the density is flat, at most a hundredth of the sample
        rate. The variance grows as 1 / cutoff.
    at_rest : bool, optional
        Whether the series starts at zero; see `ShapedNoise`.

    Notes
    -----
    A 1/f density falls until half the sample rate, where the trapezoidal rule would give
    none at all. So white noise is summed up with a leak, which gives a density too high by
    x / sin x with x = pi f T, and smoothed over some samples by a filter fitted to
    sin x / x. The density follows the formula within 0.13 percent up to 0.95 of half the
    sample rate.

    Examples
    --------
    >>> from armlock import LaserNoise
    >>> noise = LaserNoise(seed=1, sample_rate=10.0)
    >>> noise.draw(10).shape
    (10,)
    """

    def __init__(
        self,
        seed: int,
        sample_rate: float = 200.0,
        *,
        level: float = paper.LASER_NOISE,
        cutoff: float = 1e-6,
        at_rest: bool = False,
    ) -> None:
        self.level = positive_number("level", level)
        self.cutoff = positive_number("cutoff", cutoff)
        highest = _LARGEST_CUTOFF * positive_number("sample_rate", sample_rate)
        if self.cutoff > highest:
            raise ValueError(
                f"cutoff must be at most {highest} Hz, a hundredth of the sample rate, got "
                f"{self.cutoff}"
            )
        corner = 2.0 * math.pi * self.cutoff
        super().__init__(
            (), (-corner,), 2.0 * math.pi * self.level,
            seed=seed, sample_rate=sample_rate, at_rest=at_rest,
        )  # fmt: skip
        # Read before the input enters, the sum has no zero at half the sample rate.
        gain = float(self._sampled.output[0]) * (1.0 + 0.5 * corner / self.sample_rate)
        self._sampled = self._sampled._replace(output=np.array([gain]), direct=np.zeros(1))
        self._smoothing = _smoothing()
        # Of white samples before the first one; at rest there were none.
        past = np.zeros(2 * _REACH)
        if not at_rest:
            past = self._random.standard_normal(past.size)
        self._past = past

    def __repr__(self) -> str:
        """Name the class and its arguments."""
        return f"LaserNoise({self._common()}, level={self.level}, cutoff={self.cutoff})"

    def sampled_asd(self, frequency: npt.ArrayLike) -> FloatArray:
        """Density of the samples in closed form; see `ShapedNoise.sampled_asd`."""
        frequency = self._below_half_rate(frequency)
        x = np.pi * frequency / self.sample_rate
        smooth = np.cos(2.0 * x[..., None] * np.arange(-_REACH, _REACH + 1)) @ self._smoothing
        change, gain = float(self._sampled.change[0, 0]), float(self._sampled.output[0])
        gain *= float(self._sampled.drive[0, 0])
        below = np.sqrt(change**2 + (1.0 + change) * (2.0 * np.sin(x)) ** 2)
        return np.asarray(gain * np.abs(smooth) / below)

    def draw(self, samples: int) -> FloatArray:
        """Return the next samples of the series; see `ShapedNoise.draw`."""
        count = whole_number("samples", samples, 0)
        white = np.concatenate((self._past, self._random.standard_normal(count)))
        self._past = white[count:].copy()
        sampled = self._sampled
        series = np.empty(count)
        last = _smoothed_sum(
            white, self._smoothing * self._scale, self._state[0],
            float(sampled.change[0, 0]), float(sampled.drive[0, 0]),
            float(sampled.output[0]), series,
        )  # fmt: skip
        self._state = (last,)
        return series


@njit(cache=True)
def _smoothed_sum(
    white: FloatArray,
    weights: FloatArray,
    state: float,
    change: float,
    drive: float,
    output: float,
    series: FloatArray,
) -> float:
    """Smooth white noise, sum it up with a leak, and return the last sum."""
    reach = weights.size // 2
    w = state
    for i in range(series.size):
        centre = i + reach
        u = weights[reach] * white[centre]
        for k in range(1, reach + 1):
            u += weights[reach + k] * (white[centre - k] + white[centre + k])
        w += change * w + drive * u
        series[i] = output * w
    return w


def _smoothing() -> FloatArray:
    """Return symmetric weights whose response is close to sin x / x, 2 x in rad a sample."""
    x = 0.5 * np.pi * _FITTED * (np.arange(2000) + 0.5) / 2000
    cosines = np.cos(2.0 * x[:, None] * np.arange(_REACH + 1))
    # At rest the response is one: the weight in the middle follows from the others.
    basis = cosines[:, 1:] - 1.0
    sides = np.linalg.lstsq(basis, np.sinc(x / np.pi) - 1.0, rcond=None)[0]
    return np.concatenate((0.5 * sides[::-1], [1.0 - sides.sum()], 0.5 * sides))


class PerturbationNoise(ShapedNoise):
    r"""Perturbation of c1 or c2 with the spectrum of the paper's appendix.

    The density as printed, and the one that is drawn, are

    .. math::

        \text{printed}(f) &= \text{level} \sqrt{1 + \left( \frac{f_0}{f} \right)^4} , \\
        \text{asd}(f) &= \text{scale} \cdot \text{level}\,
        \frac{\sqrt{f^4 + f_0^4}}{f^2 + \text{cutoff}^2} ,

    with the level and the corner :math:`f_0` of `armlock.paper`.

    Parameters
    ----------
    seed : int
        Of the random numbers.
    sample_rate : float, optional
        In Hz.
    scale : float, optional
        Factor before the spectrum as printed.
    cutoff : float, optional
        Frequency in Hz below which the density is flat. The standard deviation grows as
        cutoff^(-3/2), so that this number decides it.
    at_rest : bool, optional
        Whether the series starts without what it would have built up before; see
        `ShapedNoise`.

    Notes
    -----
    The filter is, with :math:`\omega_0 = 2\pi f_0` and :math:`\omega_c = 2\pi\,\text{cutoff}`

    .. math::

        H(s) = \text{scale} \cdot \text{level}\,
        \frac{s^2 + \sqrt{2}\, \omega_0 s + \omega_0^2}{(s + \omega_c)^2} ,

    because at s = j omega

    .. math::

        \left| s^2 + \sqrt{2}\, \omega_0 s + \omega_0^2 \right|^2 = \omega^4 + \omega_0^4 .

    Examples
    --------
    >>> from armlock import PerturbationNoise
    >>> c1 = 1.0 + PerturbationNoise(seed=1, sample_rate=10.0, at_rest=True).draw(100)
    >>> c1.shape
    (100,)
    """

    def __init__(
        self,
        seed: int,
        sample_rate: float = 200.0,
        *,
        scale: float = 1.0,
        cutoff: float = 5e-6,
        at_rest: bool = False,
    ) -> None:
        self.scale = positive_number("scale", scale)
        self.cutoff = positive_number("cutoff", cutoff)
        corner = 2.0 * math.pi * self.cutoff
        root = 2.0 * math.pi * paper.PHASE_NOISE_CORNER * math.sqrt(0.5)
        super().__init__(
            (complex(-root, root), complex(-root, -root)), (-corner, -corner),
            self.scale * paper.PHASE_NOISE_LEVEL,
            seed=seed, sample_rate=sample_rate, at_rest=at_rest,
        )  # fmt: skip

    def __repr__(self) -> str:
        """Name the class and its arguments."""
        return f"PerturbationNoise({self._common()}, scale={self.scale}, cutoff={self.cutoff})"
