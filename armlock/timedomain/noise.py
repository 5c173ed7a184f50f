"""Noise of a prescribed amplitude spectral density, from a seed, in blocks.

White Gaussian samples go through a filter whose response has the prescribed magnitude, so
that a series of any length can be drawn without ever being held as a whole. All spectral
densities are one-sided.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from armlock import paper
from armlock.axis.compiled import njit
from armlock.checks import (
    FloatArray,
    as_written,
    check_memory,
    positive_number,
    real_array,
    whole_number,
)
from armlock.controllers import Controller
from armlock.timedomain.discretize import (
    Rows,
    sampled_filter,
    stationary_root,
    through,
    warped,
)

#: Zeros and pole, in rad per sample, that raise the sampled 1/f density to the prescribed one.
_LASER_ZEROS, _LASER_POLE = (2.37, 7.87), 6.03


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

    see `armlock.timedomain.discretize.warped`. One draw and many give the same series, bit by
    bit.

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
        self._filter = Controller(zeros, poles, gain)
        self.zeros, self.poles = self._filter.zeros, self._filter.poles
        self.gain = self._filter.gain
        for pole in self.poles:
            if pole.real >= 0.0:
                raise ValueError(f"poles must lie in the left half-plane, got {pole} rad/s")
        self.seed = whole_number("seed", seed, 0)
        self.at_rest = at_rest
        self._random = np.random.default_rng(self.seed)
        self._sampled = sampled_filter(self._filter, self.sample_rate)
        # White samples of variance one have the one-sided density 2 / sample_rate.
        self._scale = math.sqrt(0.5 * self.sample_rate)
        self._state = np.zeros(2 * len(self._sampled.sections))
        if not self.at_rest:
            order = self._sampled.order
            start = stationary_root(self._sampled) @ self._random.standard_normal(order)
            self._state[:order] = self._scale * start

    def __repr__(self) -> str:
        """Name the class and its arguments, as they are written to make it again."""
        return as_written(self)

    def asd(self, frequency: npt.ArrayLike) -> FloatArray:
        """Prescribed density at a frequency in Hz, in the series' unit per sqrt(Hz).

        Parameters
        ----------
        frequency : array_like of float
            In Hz.

        Returns
        -------
        float array, shaped like `frequency`

        Raises
        ------
        TypeError, ValueError
            If a frequency is not finite and real.
        """
        omega = 2.0 * np.pi * real_array("frequency", frequency)
        return np.asarray(np.abs(self._filter(1j * omega)))

    def sampled_asd(self, frequency: npt.ArrayLike) -> FloatArray:
        """Density of the samples in closed form; see `asd`."""
        omega = 2.0 * np.pi * real_array("frequency", frequency)
        return np.asarray(np.abs(self._filter(1j * warped(omega, self.sample_rate))))

    def draw(self, samples: int) -> FloatArray:
        """Return the next samples of the series.

        Parameters
        ----------
        samples : int
            How many, zero or more.

        Returns
        -------
        float array, shape (samples,)

        Raises
        ------
        ValueError
            If `samples` is not a whole number, negative, or more than memory holds.
        """
        count = whole_number("samples", samples, 0)
        check_memory("samples", (count,), 8)
        series = self._scale * self._random.standard_normal(count)
        _shape(series, self._sampled.gain, self._sampled.sections, self._state)
        return series

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
        for first in range(0, samples, size):
            yield self.draw(min(size, samples - first))


@njit(cache=True, nogil=True)
def _shape(series: FloatArray, gain: float, sections: Rows, state: FloatArray) -> None:
    """Replace a series by its filtered self."""
    for i in range(series.size):
        series[i] = gain * through(sections, state, series[i])


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
        Frequency in Hz below which the density is flat. The variance grows as 1 / cutoff.
    at_rest : bool, optional
        Whether the series starts at zero; see `ShapedNoise`.

    Notes
    -----
    A 1/f density falls until half the sample rate, where the trapezoidal rule alone would
    give none at all. Zeros at 2.37 and 7.87 and a pole at 6.03 times the sample rate, in
    rad/s, make up for that, but for 0.02 percent at a tenth of the sample rate (20 Hz at
    200 Hz), 0.7 percent at a quarter and 1.6 percent at most up to half of it.
    That holds for cutoffs far below the sample rate; `sampled_asd` is exact for all.

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
        rate = positive_number("sample_rate", sample_rate)
        zeros = [-rate * zero for zero in _LASER_ZEROS]
        pole = -rate * _LASER_POLE
        # One at s = 0, as the prescribed density is where it is flat.
        unity = pole / math.prod(zeros)
        super().__init__(
            zeros, (-2.0 * math.pi * self.cutoff, pole), -2.0 * math.pi * self.level * unity,
            seed=seed, sample_rate=rate, at_rest=at_rest,
        )  # fmt: skip

    def asd(self, frequency: npt.ArrayLike) -> FloatArray:
        """Prescribed density; see `ShapedNoise.asd`."""
        return np.asarray(
            self.level / np.hypot(real_array("frequency", frequency), self.cutoff)
        )


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
