"""Amplitude spectral densities over many decades of frequency, of series too long to hold.

The series is filtered down a ladder of sample rates, each a quarter of the one before. At each
rate short overlapping segments are averaged under a Kaiser window, whose side lobes lie 150 dB
below its peak, because a spectrum that falls by ten orders of magnitude leaks through the usual
windows. All densities are one-sided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from armlock.checks import (
    FloatArray,
    IntArray,
    finite_series,
    positive_number,
    real_array,
    real_number,
)
from armlock.tables import Shown, Table, spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Samples in a segment, and from one segment to the next.
SEGMENT = 1024
HOP = SEGMENT // 4
#: Ratio of one rate to the next.
FACTOR = 4
#: Bands per decade.
BANDS = 12
#: Bins next to zero and to half the sample rate that the window's main lobe spoils.
SPOILED = 8

# Bins below this one are taken from the next rate, whose filter changes them by 2e-6 at most.
_FIRST_BIN = 92
# Until the next rate has so many segments, they are taken from this one.
_ENOUGH_SEGMENTS = 8
# Length of the filter before a lower rate; its side lobes lie 120 dB below the pass band.
_TAPS = 113
# Segments transformed together, and samples taken in together: few enough for the cache.
_TOGETHER = 64
_BLOCK = 1 << 20

_WINDOW = np.kaiser(SEGMENT + 1, 20.0)[:-1]
# A windowed sinc with the cut-off at the next rate; Kaiser's rule gives the window.
_FILTER = np.kaiser(_TAPS, 0.1102 * (120.0 - 8.7)) * np.sinc(
    np.arange(-(_TAPS // 2), _TAPS // 2 + 1) / FACTOR
)
_FILTER /= _FILTER.sum()
# Points per bin at which `Spectrum.expected` samples a density.
_FINE = 8


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum(Shown):
    r"""An estimate of a one-sided amplitude spectral density.

    Its square integrates to the variance,

    .. math::

        \mathrm{var}(x) = \int_0^{f_s / 2} \text{asd}^2(f)\, \mathrm{d}f .

    Attributes
    ----------
    frequency : float array, shape (n,)
        Centres of the bands in Hz.
    asd : float array, shape (n,)
        Estimate, in the series' unit per sqrt(Hz).
    averages : float array, shape (n,)
        Number m of independent averages of Gaussian noise that is flat within the band. Its
        estimate has a relative standard deviation of 1 / (2 sqrt(m)). Noise with lines or nulls
        within a band scatters more.
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
    >>> deviation = spectrum.asd / np.sqrt(2) - 1
    >>> bool((np.abs(deviation) < 2 / np.sqrt(spectrum.averages)).all())
    True
    """

    frequency: FloatArray
    asd: FloatArray
    averages: FloatArray
    resolution: FloatArray
    bins: IntArray

    def _table(self) -> Table:
        """Show the bands, and how exact the estimates are."""
        error = 0.5 / np.sqrt(self.averages)
        rows = [
            ("bands", spread(self.frequency, "Hz")),
            ("density", spread(self.asd, "of the series' unit per sqrt(Hz)")),
            ("relative standard deviation", spread(error)),
        ]
        return Table("Amplitude spectral density", rows)

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the density over frequency, with logarithmic axes.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        **style
            As for `matplotlib.axes.Axes.loglog`, for instance `label`.

        Returns
        -------
        matplotlib Axes
        """
        import matplotlib.pyplot as plt

        ax = plt.gca() if ax is None else ax
        ax.loglog(self.frequency, self.asd, **style)
        ax.set(xlabel="frequency [Hz]", ylabel=r"density [$1/\sqrt{\mathrm{Hz}}$]")
        return ax

    def expected(self, asd: Callable[[FloatArray], npt.ArrayLike]) -> FloatArray:
        r"""Return what the estimator gives on average for a known density.

        It differs from the density where that varies within a band or within the window's
        response W, of sum one. For a band of m bins k, of width :math:`\Delta f`, it is the
        square root of

        .. math::

            \frac{1}{m} \sum_k \sum_\delta W(\delta)\, \text{asd}^2(|k + \delta|\, \Delta f) .

        Parameters
        ----------
        asd : callable
            The density as a function of the frequency in Hz, from zero to half the sample rate.

        Returns
        -------
        float array, shape (n,)

        Raises
        ------
        TypeError, ValueError
            If `asd` does not return finite real numbers.
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
        """Return the bands whose centres lie between two frequencies in Hz.

        Parameters
        ----------
        low, high : float
            In Hz, `high` not below `low`.

        Returns
        -------
        Spectrum

        Raises
        ------
        TypeError, ValueError
            If a frequency is not finite and real, or `high` lies below `low`.
        """
        low, high = real_number("low", low), real_number("high", high)
        if high < low:
            raise ValueError(f"high must not lie below low = {low}, got {high}")
        keep = (self.frequency >= low) & (self.frequency <= high)
        return Spectrum(*(getattr(self, field.name)[keep] for field in fields(self)))


@cache
def _response() -> tuple[FloatArray, FloatArray]:
    """Return offsets in bins, and the window's normalized power response there."""
    offsets = np.arange(-SPOILED * _FINE, SPOILED * _FINE + 1) / _FINE
    phases = np.exp(-2j * np.pi * np.outer(offsets, np.arange(SEGMENT)) / SEGMENT)
    power = np.abs(phases @ _WINDOW) ** 2
    return offsets, power / power.sum()


@cache
def _overlaps() -> FloatArray:
    """Squared correlation of two bins: rows the hops between segments, columns the bins."""
    shifts = range(0, SEGMENT, HOP)
    rows = [np.fft.fft(_WINDOW[k:] * _WINDOW[: SEGMENT - k], SEGMENT) for k in shifts]
    return np.asarray(np.abs(rows)[:, : 2 * SPOILED] ** 2 / np.sum(_WINDOW**2) ** 2)


def _averages(segments: int, bins: int) -> float:
    """Count the independent averages among overlapping segments and neighbouring bins."""
    overlaps = _overlaps()
    hops = np.arange(min(segments, overlaps.shape[0]))
    steps = np.arange(min(bins, overlaps.shape[1]))
    weight1 = np.where(hops > 0, 2.0, 1.0) * (1.0 - hops / segments)
    weight2 = np.where(steps > 0, 2.0, 1.0) * (1.0 - steps / bins)
    correlated = weight1 @ overlaps[: hops.size, : steps.size] @ weight2
    return float(segments * bins / correlated)


class _Rate:
    """One rate of the ladder."""

    def __init__(self, sample_rate: float, depth: int) -> None:
        self.width = sample_rate / FACTOR**depth / SEGMENT
        self.power = np.zeros(SEGMENT // 2 + 1)
        self.segments = 0
        self.waiting = np.empty(0)
        self.unfiltered = np.empty(0)

    @np.errstate(under="ignore")
    def add(self, samples: FloatArray) -> FloatArray:
        """Take in samples; return those of the next rate."""
        series = np.concatenate((self.waiting, samples))
        if series.size >= SEGMENT:
            windows = sliding_window_view(series, SEGMENT)[::HOP]
            # A segment is four hops, and its mean that of theirs.
            hops = series[: series.size // HOP * HOP].reshape(-1, HOP).mean(axis=1)
            means = sliding_window_view(hops, SEGMENT // HOP).mean(axis=1, keepdims=True)
            for first in range(0, len(windows), _TOGETHER):
                some = slice(first, first + _TOGETHER)
                batch = windows[some] - means[some]
                batch *= _WINDOW
                parts = np.fft.rfft(batch).view(np.float64)
                squares = np.einsum("ij,ij->j", parts, parts)
                self.power += squares[::2] + squares[1::2]
            self.segments += len(windows)
            series = series[len(windows) * HOP :]
        self.waiting = series.copy()
        series = np.concatenate((self.unfiltered, samples))
        count = max((series.size - _TAPS) // FACTOR + 1, 0)
        self.unfiltered = series[count * FACTOR :].copy()
        if count == 0:
            return np.empty(0)
        # Only the samples that are kept are computed; the filter is symmetric.
        return np.asarray(np.vecdot(sliding_window_view(series, _TAPS)[::FACTOR], _FILTER))

    def bands(self, numbers: IntArray) -> list[tuple[float, ...]]:
        """Average bins in bands; rows (frequency, power, averages, width, number of bins)."""
        scale = 0.5 * self.segments * self.width * SEGMENT * np.sum(_WINDOW**2)
        index = np.floor(BANDS * np.log10(numbers * self.width))
        return [
            (
                float(chosen.mean() * self.width),
                float(self.power[chosen].mean() / scale),
                _averages(self.segments, chosen.size),
                self.width,
                float(chosen.size),
            )
            for chosen in (numbers[index == band] for band in np.unique(index))
        ]


class SpectrumEstimator:
    r"""Estimates a density from samples as they come in.

    Memory grows with the logarithm of the duration only, and the estimate does not depend on
    how the series is cut into blocks, up to rounding.

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

    with a Kaiser window w. Samples are squared, so that 1e-170 counts as zero. Segments
    overlap by three quarters, which the number of averages takes into account. Filters before
    lower rates pass 1e-6 of higher frequencies, which is the least ratio of two densities that
    the estimate tells.

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
        series : array_like of float, shape (n,)

        Raises
        ------
        TypeError, ValueError
            If they are not finite and real; none of them is taken in.
        """
        whole = np.asarray(finite_series("series", series))
        for at in range(0, whole.size, _BLOCK):
            part, depth = whole[at : at + _BLOCK], 0
            while part.size:
                if depth == len(self._rates):
                    self._rates.append(_Rate(self.sample_rate, depth))
                part = self._rates[depth].add(part)
                depth += 1

    def spectrum(self) -> Spectrum:
        """Return the estimate from what has come in so far.

        Returns
        -------
        Spectrum
            From eight bins of the longest segments up to just below half the sample rate.

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
        # From each rate come the bins from `first` up to `end`, where the rate above begins.
        end = SEGMENT // 2 - SPOILED + 1
        for rate, slower in zip(usable, [*usable[1:], None], strict=True):
            settled = slower is not None and slower.segments >= _ENOUGH_SEGMENTS
            first = _FIRST_BIN if settled else SPOILED
            rows += rate.bands(np.arange(first, end))
            end = FACTOR * first
        frequency, power, averages, resolution, bins = np.array(sorted(rows)).T
        number: IntArray = bins.astype(np.int64)
        return Spectrum(frequency, np.sqrt(power), averages, resolution, number)


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
        If the series is too short, not one-dimensional or not finite, or was drawn at another
        sample rate.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import amplitude_spectrum
    >>> white = np.random.default_rng(1).standard_normal(100_000)
    >>> print(f"{np.median(amplitude_spectrum(white, sample_rate=2.0).asd):.1f}")
    1.0
    """
    estimator = SpectrumEstimator(sample_rate)
    estimator.add(series)
    return estimator.spectrum()
