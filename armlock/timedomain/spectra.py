"""Amplitude spectral densities over many decades, of series too long to hold.

One resolution does not serve seven decades, and a spectrum that falls by ten orders over
them leaks through the side lobes of the usual windows. So the series runs down a ladder of
rates, each a quarter of the one before; at each the same short segments are transformed
under a Kaiser window whose side lobes lie 150 dB below its peak; and their bins are averaged
in bands of equal width on a logarithmic axis. Everything happens as the samples come in.
All densities are one-sided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import chdtri

from armlock.checks import (
    FloatArray,
    IntArray,
    finite_series,
    positive_number,
    real_array,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Samples in a segment, and from one segment to the next.
SEGMENT = 1024
HOP = SEGMENT // 4
#: Ratio of one rate to the next.
FACTOR = 4
#: Probability that a band's confidence interval holds the true density.
CONFIDENCE = 0.95
#: Bands a decade.
BANDS = 12
#: Bins next to zero that the window's main lobe spoils.
SPOILED = 8

# A rate gives its bins from this one on and leaves those below to the next rate, whose filter
# changes them by 2e-6 at most; from `SPOILED` on while the next rate has fewer segments.
_FIRST_BIN = 92
_ENOUGH_SEGMENTS = 8
# The filter before a lower rate: side lobes in dB below its pass band, and its length.
_STOPBAND = 120.0
_TAPS = 113
# The segments' window has side lobes 150 dB below its peak.
_BETA = 20.0
# Segments that are transformed together: few enough to stay in the processor's cache.
_TRANSFORMS_AT_ONCE = 64

_WINDOW = np.kaiser(SEGMENT + 1, _BETA)[:-1]
# Points a bin at which a given density is sampled for `Spectrum.expected`.
_FINE = 8


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum:
    r"""An estimate of a one-sided amplitude spectral density.

    The square of the density integrates to the variance,

    .. math::

        \mathrm{var}(x) = \int_0^{f_s / 2} \text{asd}^2(f)\, \mathrm{d}f ,

    and a confidence interval that holds it with probability :math:`1 - \alpha` is

    .. math::

        \text{lower} &= \text{asd} \sqrt{\frac{\nu}{\chi^2_{\nu}(1 - \alpha / 2)}} , \\
        \text{upper} &= \text{asd} \sqrt{\frac{\nu}{\chi^2_{\nu}(\alpha / 2)}} ,

    with the quantiles of the chi-squared distribution of :math:`\nu` degrees of freedom.

    Attributes
    ----------
    frequency : float array, shape (n,)
        Centres of the bands in Hz.
    asd : float array, shape (n,)
        Estimate, in the series' unit per sqrt(Hz).
    lower, upper : float arrays, shape (n,)
        Confidence band of `CONFIDENCE`: chi-squared, for Gaussian noise.
    degrees : float array, shape (n,)
        Degrees of freedom: twice the number of independent averages.
    resolution : float array, shape (n,)
        Width in Hz of a bin; the window is about three of them wide.
    bins : int array, shape (n,)
        Number of bins in a band.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import amplitude_spectrum
    >>> white = np.random.default_rng(1).standard_normal(4096)
    >>> spectrum = amplitude_spectrum(white, sample_rate=1.0)
    >>> bool((spectrum.lower < spectrum.asd).all() and (spectrum.asd < spectrum.upper).all())
    True
    """

    frequency: FloatArray
    asd: FloatArray
    lower: FloatArray
    upper: FloatArray
    degrees: FloatArray
    resolution: FloatArray
    bins: IntArray

    def __repr__(self) -> str:
        """Say how many bands there are."""
        return f"Spectrum({self.frequency.size} bands)"

    def expected(self, asd: Callable[[FloatArray], npt.ArrayLike]) -> FloatArray:
        r"""Return what the estimator gives on average for a known density.

        For a band of m bins k, of width :math:`\Delta f`, it is the square root of

        .. math::

            \frac{1}{m} \sum_k \sum_\delta W(\delta)\, \text{asd}^2(|k + \delta|\, \Delta f)

        with the window's power response W at offsets :math:`\delta` in bins, of sum one.

        Parameters
        ----------
        asd : callable
            The density as a function of the frequency in Hz.

        Returns
        -------
        float array, shape (n,)
            The density averaged over the band with the window's response, as the estimate is:
            it differs from the density itself where that bends within the resolution.

        Raises
        ------
        TypeError, ValueError
            If `asd` does not return finite real numbers for frequencies from zero to half the
            sample rate.
        """
        spread, weights = _response()
        result = np.empty(self.frequency.size)
        for i, centre in enumerate(self.frequency):
            half = 0.5 * (self.bins[i] - 1)
            bins = centre / self.resolution[i] + np.arange(-half, half + 1.0)
            points = np.abs(bins[:, None] + spread) * self.resolution[i]
            density = real_array("asd(frequency)", asd(points))
            power = np.broadcast_to(density, points.shape) ** 2
            result[i] = np.sqrt((power @ weights).mean())
        return result

    def within(self, low: float, high: float) -> Spectrum:
        """Return the part between two frequencies in Hz, ends included.

        Parameters
        ----------
        low, high : float
            In Hz; infinite for no bound.

        Returns
        -------
        Spectrum
            It may be empty.
        """
        keep = (self.frequency >= low) & (self.frequency <= high)
        return Spectrum(*(getattr(self, field.name)[keep] for field in fields(self)))

    def plot(self, ax: Axes | None = None, *, unit: str = "Hz", **style: Any) -> Axes:
        """Draw the density with its confidence band, on logarithmic axes.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        unit : str, optional
            Of the series, for the label.
        **style
            For the line, as `matplotlib.axes.Axes.plot` takes it: a label, a colour.

        Returns
        -------
        matplotlib Axes

        Examples
        --------
        >>> from armlock import LaserNoise, amplitude_spectrum
        >>> spectrum = amplitude_spectrum(LaserNoise(1, 10.0).draw(20_000), 10.0)
        >>> spectrum.plot(label="laser").get_ylabel()
        'amplitude spectral density [Hz/√Hz]'
        """
        import matplotlib.pyplot as plt

        ax = plt.gca() if ax is None else ax
        (line,) = ax.loglog(self.frequency, self.asd, **style)
        ax.fill_between(
            self.frequency, self.lower, self.upper, color=line.get_color(), alpha=0.3, lw=0
        )
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel(f"amplitude spectral density [{unit}/√Hz]")
        return ax


def _response() -> tuple[FloatArray, FloatArray]:
    """Return offsets in bins, and the window's normalized power response there."""
    offsets = np.arange(-SPOILED * _FINE, SPOILED * _FINE + 1) / _FINE
    phases = np.exp(-2j * np.pi * np.outer(offsets, np.arange(SEGMENT)) / SEGMENT)
    power = np.abs(phases @ _WINDOW) ** 2
    return offsets, power / power.sum()


def _overlaps() -> FloatArray:
    """Squared correlation of two bins: rows the hops between segments, columns the bins."""
    shifts = range(0, SEGMENT, HOP)
    rows = [np.fft.fft(_WINDOW[k:] * _WINDOW[: SEGMENT - k], SEGMENT) for k in shifts]
    return np.asarray(np.abs(rows)[:, : 2 * SPOILED] ** 2 / np.sum(_WINDOW**2) ** 2)


_OVERLAPS = _overlaps()


def _degrees(segments: int, bins: int) -> float:
    """Degrees of freedom of a mean over overlapping segments and neighbouring bins."""
    hops = np.arange(min(segments, _OVERLAPS.shape[0]))
    steps = np.arange(min(bins, _OVERLAPS.shape[1]))
    weight1 = np.where(hops > 0, 2.0, 1.0) * (1.0 - hops / segments)
    weight2 = np.where(steps > 0, 2.0, 1.0) * (1.0 - steps / bins)
    variance = weight1 @ _OVERLAPS[: hops.size, : steps.size] @ weight2 / (segments * bins)
    return float(2.0 / variance)


@cache
def _filter() -> FloatArray:
    # To import scipy.signal takes as long as the whole package; not every user needs it.
    from scipy.signal import firwin, kaiser_beta

    window = "kaiser", kaiser_beta(_STOPBAND)
    return np.asarray(firwin(_TAPS, 1.0 / FACTOR, window=window))


class _Rate:
    """One rate of the ladder, so many filters below the first."""

    def __init__(self, sample_rate: float, depth: int) -> None:
        self.width = sample_rate / FACTOR**depth / SEGMENT
        self.power = np.zeros(SEGMENT // 2 + 1)
        self.segments = 0
        self.waiting = np.empty(0)
        self.unfiltered = np.empty(0)

    def add(self, samples: FloatArray) -> FloatArray:
        """Take in samples; return those of the next rate."""
        series = np.concatenate((self.waiting, samples))
        if series.size >= SEGMENT:
            windows = sliding_window_view(series, SEGMENT)[::HOP]
            for first in range(0, len(windows), _TRANSFORMS_AT_ONCE):
                batch = windows[first : first + _TRANSFORMS_AT_ONCE]
                centred = (batch - batch.mean(axis=1, keepdims=True)) * _WINDOW
                spectra = np.fft.rfft(centred)
                self.power += (spectra.real**2 + spectra.imag**2).sum(axis=0)
            self.segments += len(windows)
            series = series[len(windows) * HOP :]
        self.waiting = series.copy()
        series = np.concatenate((self.unfiltered, samples))
        count = max((series.size - _TAPS) // FACTOR + 1, 0)
        self.unfiltered = series[count * FACTOR :].copy()
        if count == 0:
            return np.empty(0)
        # Only what is kept is computed. The filter reads the same in both directions.
        return np.asarray(np.vecdot(sliding_window_view(series, _TAPS)[::FACTOR], _filter()))

    def density(self) -> FloatArray:
        """Return the squared density at each bin, one-sided."""
        scale = 0.5 * self.segments * self.width * SEGMENT * np.sum(_WINDOW**2)
        return np.asarray(self.power / scale)


class SpectrumEstimator:
    r"""Estimates a density from samples as they come in.

    Parameters
    ----------
    sample_rate : float
        In Hz.

    Notes
    -----
    At a rate :math:`f_s`, from n segments of N samples x each, the estimate in a band of m bins
    is

    .. math::

        \text{asd}^2 &= \frac{2}{f_s \sum_i w_i^2}\, \frac{1}{n\, m}
        \sum_{\text{segments}} \sum_{k} |X_k|^2 , \\
        X_k &= \sum_{i=0}^{N-1} w_i\, (x_i - \bar x)\, e^{-2\pi\mathrm{j}\, i k / N} ,

    with a Kaiser window w. The filters before the lower rates change it by at most 2e-6.

    Segments overlap by three quarters, H = N / 4 being the way from one to the next. The
    degrees of freedom of a band take the overlap, and the correlation of its bins, into
    account:

    .. math::

        \frac{2}{\nu} &= \frac{1}{n\, m} \sum_{|i| < n} \sum_{|k| < m}
        \left( 1 - \frac{|i|}{n} \right) \left( 1 - \frac{|k|}{m} \right) \rho_{ik} , \\
        \rho_{ik} &= \left| \sum_l w_l\, w_{l + |i| H}\, e^{-2\pi\mathrm{j}\, l k / N} \right|^2
        \left( \sum_l w_l^2 \right)^{-2} .

    Memory grows with the logarithm of the duration only. Estimates do not depend on how the
    series is cut into blocks, up to rounding.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import SpectrumEstimator
    >>> estimator, rng = SpectrumEstimator(sample_rate=1.0), np.random.default_rng(1)
    >>> for _ in range(4):
    ...     estimator.add(rng.standard_normal(10_000))
    >>> white = np.median(estimator.spectrum().asd)
    >>> print(f"{white:.1f}, and sqrt(2) is expected")
    1.4, and sqrt(2) is expected
    """

    def __init__(self, sample_rate: float) -> None:
        self.sample_rate = positive_number("sample_rate", sample_rate)
        self._rates = [_Rate(self.sample_rate, 0)]

    def add(self, series: npt.ArrayLike) -> None:
        """Take in the next samples.

        Parameters
        ----------
        series : array_like of float, one-dimensional
            Finite.

        Raises
        ------
        TypeError, ValueError
            If they are not; none of them is taken in.
        """
        given = finite_series("series", series)
        depth = 0
        while given.size:
            if depth == len(self._rates):
                self._rates.append(_Rate(self.sample_rate, depth))
            given = self._rates[depth].add(given)
            depth += 1

    def spectrum(self) -> Spectrum:
        """Return the estimate from what has come in so far.

        Returns
        -------
        Spectrum
            From eight bins of the longest segments up to just below half the sample rate. A
            constant series has the density zero, but for rounding.

        Raises
        ------
        ValueError
            If fewer samples than one segment have come in.
        """
        usable = [rate for rate in self._rates if rate.segments]
        if not usable:
            raise ValueError(
                f"series must hold at least {SEGMENT} samples, got "
                f"{self._rates[0].waiting.size}"
            )
        rows: list[tuple[float, ...]] = []
        # Of each rate the bins from `first` on and below `end`, the next rate's `end` being
        # this one's `first`.
        end = SEGMENT // 2 - SPOILED + 1
        for rate, slower in zip(usable, [*usable[1:], None], strict=True):
            settled = slower is not None and slower.segments >= _ENOUGH_SEGMENTS
            first = _FIRST_BIN if settled else SPOILED
            rows += _banded(rate, np.arange(first, end))
            end = FACTOR * first
        frequency, power, degrees, resolution, bins = np.array(sorted(rows)).T
        tail = 0.5 * (1.0 - CONFIDENCE)
        return Spectrum(
            frequency=frequency,
            asd=np.sqrt(power),
            lower=np.sqrt(power * degrees / chdtri(degrees, tail)),
            upper=np.sqrt(power * degrees / chdtri(degrees, 1.0 - tail)),
            degrees=degrees,
            resolution=resolution,
            bins=bins.astype(np.int64),
        )


def _banded(rate: _Rate, numbers: IntArray) -> list[tuple[float, ...]]:
    """Average some bins of a rate in bands: frequency, power, degrees, width, how many."""
    density = rate.density()
    index = np.floor(BANDS * np.log10(numbers * rate.width))
    return [
        (
            float(chosen.mean() * rate.width),
            float(density[chosen].mean()),
            _degrees(rate.segments, chosen.size),
            rate.width,
            float(chosen.size),
        )
        for chosen in (numbers[index == band] for band in np.unique(index))
    ]


def amplitude_spectrum(series: npt.ArrayLike, sample_rate: float) -> Spectrum:
    """Estimate the amplitude spectral density of a series.

    Parameters
    ----------
    series : array_like, shape (n,)
        At least 1024 samples.
    sample_rate : float
        In Hz.

    Returns
    -------
    Spectrum

    Raises
    ------
    TypeError, ValueError
        If the series is too short, not one-dimensional or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import amplitude_spectrum
    >>> white = np.random.default_rng(1).standard_normal(100_000)
    >>> estimate = amplitude_spectrum(white, sample_rate=2.0)
    >>> bool(np.mean((estimate.lower < 1.0) & (estimate.upper > 1.0)) > 0.8)
    True
    """
    estimator = SpectrumEstimator(sample_rate)
    estimator.add(series)
    return estimator.spectrum()
