"""Amplitude spectral densities over many decades, of series too long to hold.

One resolution does not serve seven decades, and a spectrum that falls by ten orders over
them leaks through the side lobes of the usual windows. So the series runs down a ladder of
rates, each a quarter of the one before; at each the same short segments are transformed
under a Kaiser window whose side lobes lie 150 dB below its peak; and their bins are averaged
in bands of equal width on a logarithmic axis. Everything happens as the samples come in.
All densities are one-sided.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.signal import firwin, kaiser_beta, upfirdn
from scipy.special import chdtri

from armlock.checks import (
    FloatArray,
    IntArray,
    finite_series,
    positive_number,
    real_array,
    real_number,
    whole_number,
)

#: Samples in a segment, and from one segment to the next.
SEGMENT = 1024
HOP = SEGMENT // 4
#: Ratio of one rate to the next.
FACTOR = 4
#: Bins next to zero that the window's main lobe spoils.
SPOILED = 8
#: Largest number of bands a decade; there are no more than 512 bins between two of them.
MOST_BANDS = 1000
#: Bounds between which the squares of samples neither overflow nor vanish.
SMALLEST, LARGEST = 1e-120, 1e120

# Highest bin of a decimated series that its filter leaves alone.
_HIGHEST = 368
_STOPBAND = 120.0
_TAPS = 113
_BETA = 20.0
# Segments below which a lower bin of a faster level is preferred to a higher one of this.
_ENOUGH = 8
_TRANSFORMS_AT_ONCE = 512

_WINDOW = np.kaiser(SEGMENT + 1, _BETA)[:-1]
_FILTER = firwin(_TAPS, 1.0 / FACTOR, window=("kaiser", kaiser_beta(_STOPBAND)))
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
        Confidence band: chi-squared, for Gaussian noise.
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
        """Say how many bands there are, and where."""
        if not self.frequency.size:
            return "Spectrum(0 bands)"
        return (
            f"Spectrum({self.frequency.size} bands, {self.frequency[0]:.6g} to "
            f"{self.frequency[-1]:.6g} Hz)"
        )

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
            If `asd` is not callable, or does not return finite real numbers, one for each
            frequency from zero to half the sample rate.
        """
        if not callable(asd):
            raise TypeError(f"asd must be a function of the frequency, got {asd!r}")
        spread, weights = _response()
        result = np.empty(self.frequency.size)
        for i, centre in enumerate(self.frequency):
            half = 0.5 * (self.bins[i] - 1)
            bins = centre / self.resolution[i] + np.arange(-half, half + 1.0)
            points = np.abs(bins[:, None] + spread) * self.resolution[i]
            density = real_array("asd(frequency)", asd(points))
            if density.shape not in (points.shape, ()):
                raise ValueError(
                    f"asd must return one value for each frequency, got shape {density.shape} "
                    f"for {points.shape}"
                )
            power = np.broadcast_to(density, points.shape) ** 2
            result[i] = np.sqrt((power @ weights).mean())
        return result

    def within(self, low: float, high: float) -> Spectrum:
        """Return the part between two frequencies in Hz, ends included.

        Parameters
        ----------
        low, high : float
            In Hz, the second one not below the first; infinite for no bound.

        Returns
        -------
        Spectrum
            It may be empty.

        Raises
        ------
        TypeError, ValueError
            If the two are not real numbers in this order.
        """
        low, high = _edge("low", low), _edge("high", high)
        if high < low:
            raise ValueError(f"high must not lie below low = {low}, got {high}")
        keep = (self.frequency >= low) & (self.frequency <= high)
        return Spectrum(
            self.frequency[keep],
            self.asd[keep],
            self.lower[keep],
            self.upper[keep],
            self.degrees[keep],
            self.resolution[keep],
            self.bins[keep],
        )


def _edge(name: str, value: float) -> float:
    """Return the end of a range: a real number, or an infinite one."""
    if isinstance(value, float) and math.isinf(value):
        return value
    return real_number(name, value)


def _response() -> tuple[FloatArray, FloatArray]:
    """Return offsets in bins, and the window's normalized power response there."""
    offsets = np.arange(-SPOILED * _FINE, SPOILED * _FINE + 1) / _FINE
    phases = np.exp(-2j * np.pi * np.outer(offsets, np.arange(SEGMENT)) / SEGMENT)
    power = np.abs(phases @ _WINDOW) ** 2
    return offsets, power / power.sum()


def _overlaps() -> FloatArray:
    """Squared correlation of two bins: rows the hops between segments, columns the bins."""
    reach = SEGMENT // HOP
    rows = []
    for hops in range(reach):
        shifted = np.zeros(SEGMENT)
        shifted[: SEGMENT - hops * HOP] = _WINDOW[hops * HOP :]
        rows.append(np.abs(np.fft.fft(_WINDOW * shifted))[: 2 * SPOILED] ** 2)
    return np.array(rows) / float(np.sum(_WINDOW**2)) ** 2


_OVERLAPS = _overlaps()


def _degrees(segments: int, bins: int) -> float:
    """Degrees of freedom of a mean over overlapping segments and neighbouring bins."""
    hops = np.arange(min(segments, _OVERLAPS.shape[0]))
    steps = np.arange(min(bins, _OVERLAPS.shape[1]))
    weight1 = np.where(hops > 0, 2.0, 1.0) * (1.0 - hops / segments)
    weight2 = np.where(steps > 0, 2.0, 1.0) * (1.0 - steps / bins)
    variance = weight1 @ _OVERLAPS[: hops.size, : steps.size] @ weight2 / (segments * bins)
    return float(2.0 / variance)


class _Level:
    """One rate of the ladder."""

    def __init__(self, rate: float) -> None:
        self.rate = rate
        self.power = np.zeros(SEGMENT // 2 + 1)
        self.segments = 0
        self.waiting = np.empty(0)
        self.unfiltered = np.empty(0)

    def add(self, samples: FloatArray) -> FloatArray:
        """Take in samples; return those of the next level."""
        series = np.concatenate((self.waiting, samples))
        if series.size >= SEGMENT:
            windows = np.lib.stride_tricks.sliding_window_view(series, SEGMENT)[::HOP]
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
        if count:
            skipped = (_TAPS - 1) // FACTOR
            filtered = upfirdn(_FILTER, series, down=FACTOR)[skipped : skipped + count]
        else:
            filtered = np.empty(0)
        self.unfiltered = series[count * FACTOR :].copy()
        return np.asarray(filtered)

    @cached_property
    def scale(self) -> float:
        """Factor from a squared transform to a one-sided density."""
        return 2.0 / (self.rate * float(np.sum(_WINDOW**2)))


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

    with a Kaiser window w; at the lower rates it is corrected for the filters before them.

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
        self._levels = [_Level(self.sample_rate)]
        self._largest = 0.0
        self.samples = 0

    def __repr__(self) -> str:
        """Name the argument, and how many samples have come in."""
        return f"SpectrumEstimator(sample_rate={self.sample_rate}; {self.samples} samples)"

    def add(self, samples: npt.ArrayLike) -> None:
        """Take in the next samples.

        Parameters
        ----------
        samples : array_like of float, one-dimensional
            Finite, and of a magnitude whose square can be held: below 1e120.

        Raises
        ------
        TypeError, ValueError
            If they are not; none of them is taken in.
        """
        self._take("samples", samples)

    def _take(self, name: str, samples: npt.ArrayLike) -> None:
        """Take in samples that messages call by `name`."""
        given = finite_series(name, samples)
        if not given.size:
            return
        largest = max(float(given.max()), -float(given.min()))
        if largest > LARGEST:
            raise ValueError(f"{name} must not exceed {LARGEST} in magnitude, got {largest}")
        self._largest = max(self._largest, largest)
        self.samples += given.size
        depth = 0
        while given.size:
            if depth == len(self._levels):
                self._levels.append(_Level(self.sample_rate / FACTOR**depth))
            given = self._levels[depth].add(given)
            depth += 1

    def spectrum(self, *, bands: int = 12, confidence: float = 0.95) -> Spectrum:
        """Return the estimate from what has come in so far.

        Parameters
        ----------
        bands : int, optional
            Bands a decade, from 1 to 1000.
        confidence : float, optional
            Probability that a band's confidence interval holds the true density.

        Returns
        -------
        Spectrum
            From eight bins of the longest segments up to just below half the sample rate. A
            constant series has the density zero, but for rounding.

        Raises
        ------
        ValueError
            If fewer samples than one segment have come in, all of them are smaller than
            1e-120, where squares vanish, or an argument is out of range.
        """
        bands = whole_number("bands", bands, 1, MOST_BANDS)
        confidence = real_number("confidence", confidence)
        if not 0.0 < confidence < 1.0:
            raise ValueError(f"confidence must lie between 0 and 1, got {confidence}")
        usable = [level for level in self._levels if level.segments]
        if not usable:
            raise ValueError(
                f"series must hold at least {SEGMENT} samples, got "
                f"{self._levels[0].waiting.size}"
            )
        if 0.0 < self._largest < SMALLEST:
            raise ValueError(
                f"series must reach {SMALLEST} in magnitude unless it is zero, got "
                f"{self._largest}"
            )
        rows = []
        # A level's bins from `first` to `last`; the next level has those below, in its own.
        last = SEGMENT // 2 - SPOILED
        for depth, level in enumerate(usable):
            first, after = SPOILED, 0
            if depth + 1 < len(usable):
                if usable[depth + 1].segments >= _ENOUGH:
                    first = max(first, _HIGHEST // FACTOR)
                after = min(_HIGHEST, FACTOR * first - 1)
            rows += self._bands(level, np.arange(first, last + 1), bands)
            last = after
        rows.sort()
        table = np.array(rows)
        frequency, power, degrees, resolution, count = table.T
        tail = 0.5 * (1.0 - confidence)
        return Spectrum(
            frequency,
            np.sqrt(power),
            np.sqrt(power * degrees / chdtri(degrees, tail)),
            np.sqrt(power * degrees / chdtri(degrees, 1.0 - tail)),
            degrees,
            resolution,
            count.astype(np.int64),
        )

    def _bands(
        self, level: _Level, numbers: IntArray, bands: int
    ) -> list[tuple[float, float, float, float, float]]:
        """Average bins of one level in bands."""
        width = level.rate / SEGMENT
        index = np.floor(bands * np.log10(numbers * width)).astype(int)
        power = level.power * level.scale / level.segments
        if level is not self._levels[0]:
            power = power / self._passed(level)
        rows = []
        for band in np.unique(index):
            chosen = numbers[index == band]
            rows.append(
                (
                    float(chosen.mean() * width),
                    float(power[chosen].mean()),
                    _degrees(level.segments, chosen.size),
                    width,
                    float(chosen.size),
                )
            )
        return rows

    def _passed(self, level: _Level) -> FloatArray:
        """Power response of all filters above a level, at its bins."""
        frequency = np.arange(SEGMENT // 2 + 1) * level.rate / SEGMENT
        response = np.ones(frequency.size)
        rate = self.sample_rate
        while rate > 1.5 * level.rate:
            turns = np.exp(-2j * np.pi * np.outer(frequency / rate, np.arange(_TAPS)))
            response *= np.abs(turns @ _FILTER) ** 2
            rate /= FACTOR
        return response


def amplitude_spectrum(
    series: npt.ArrayLike,
    sample_rate: float,
    *,
    bands: int = 12,
    confidence: float = 0.95,
) -> Spectrum:
    """Estimate the amplitude spectral density of a series.

    Parameters
    ----------
    series : array_like, shape (n,)
        At least 1024 samples.
    sample_rate : float
        In Hz.
    bands, confidence
        As for `SpectrumEstimator.spectrum`.

    Returns
    -------
    Spectrum

    Raises
    ------
    TypeError, ValueError
        If the series is too short, not one-dimensional, not finite, or of a magnitude beyond
        1e-120 to 1e120, whose squares overflow or vanish.

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
    estimator._take("series", series)
    return estimator.spectrum(bands=bands, confidence=confidence)
