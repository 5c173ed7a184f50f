"""Noise of a prescribed amplitude spectral density, drawn from a seed.

White Gaussian samples go through a filter whose response has the prescribed magnitude. Series
of any length are drawn block by block. All spectral densities are one-sided.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from armlock import paper
from armlock.checks import (
    FloatArray,
    check_memory,
    positive_number,
    real_array,
    true_or_false,
    whole_number,
)
from armlock.compiled import njit
from armlock.systems import Controller
from armlock.tables import Shown, Table, number
from armlock.timedomain.discretize import (
    Rows,
    readout,
    sampled_filter,
    stationary_root,
    through,
    warped,
)

# Samples of a block.
_BLOCK = 1 << 20
# Zeros and pole in rad per sample that raise the sampled 1/f density to the prescribed one.
_LASER_ZEROS, _LASER_POLE = (2.37, 7.87), 6.03


class ShapedNoise(Shown):
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
    sample_rate : float
        In Hz.

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

    see `armlock.timedomain.discretize.warped`. One long draw and many short ones give the same
    series, bit by bit.

    Examples
    --------
    One draw and several give the same series:

    >>> from armlock import ShapedNoise
    >>> whole = ShapedNoise(zeros=[], poles=[-1.0], gain=1.0, seed=1, sample_rate=10.0).draw(6)
    >>> parts = ShapedNoise(zeros=[], poles=[-1.0], gain=1.0, seed=1, sample_rate=10.0)
    >>> [*parts.draw(2), *parts.draw(4)] == list(whole)
    True
    """

    _at_rest = False

    def __init__(
        self,
        zeros: Sequence[complex],
        poles: Sequence[complex],
        gain: float,
        *,
        seed: int,
        sample_rate: float,
    ) -> None:
        self.sample_rate = positive_number("sample_rate", sample_rate)
        self._filter = Controller(zeros, poles, gain)
        for pole in map(complex, poles):
            if pole.real >= 0.0:
                raise ValueError(f"poles must lie in the left half-plane, got {pole} rad/s")
        self._random = np.random.default_rng(whole_number("seed", seed, 0))
        self._sampled = sampled_filter(zeros, poles, gain, self.sample_rate)
        # White samples of variance one have the one-sided density 2 / sample_rate.
        self._scale = math.sqrt(0.5 * self.sample_rate)
        self._state = np.zeros(2 * len(self._sampled.sections))
        self._root = stationary_root(self._sampled)
        if not np.isfinite(self._root).all():
            raise ValueError(
                f"noise must have a finite r.m.s., got poles {tuple(map(complex, poles))} in "
                f"rad/s at a sample_rate of {self.sample_rate} Hz"
            )
        if not self._at_rest:
            order = self._sampled.order
            start = self._root @ self._random.standard_normal(order)
            self._state[:order] = self._scale * start

    def _table(self) -> Table:
        """Show rate, standard deviation and density."""
        hertz = 0.1 * self.sample_rate
        rows = [
            ("sample rate", number(self.sample_rate, "Hz")),
            ("r.m.s.", number(self.rms)),
            (f"density at {number(hertz, 'Hz')}", f"{self.asd(hertz):.4g} per sqrt(Hz)"),
        ]
        return Table(type(self).__name__, rows)

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

    @property
    def rms(self) -> float:
        r"""Standard deviation of the samples of the stationary series, in its unit.

        It is exact, and includes all frequencies up to half the sample rate:

        .. math::

            \text{rms}^2 = \int_0^{f_s/2} \text{asd}_T^2(f)\, \mathrm{d}f .
        """
        states = self._root.T @ readout(self._sampled)
        return abs(self._sampled.gain) * self._scale * math.hypot(1.0, *states)

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
        series = np.empty(count)
        for at in range(0, count, _BLOCK):
            # An interrupt is heard between two blocks.
            part = series[at : at + _BLOCK]
            self._random.standard_normal(out=part)
            part *= self._scale
            _shape(part, self._sampled.gain, self._sampled.sections, self._state)
        return series

    def blocks(self, samples: int, size: int = _BLOCK) -> Iterator[FloatArray]:
        """Yield the next samples in blocks.

        Parameters
        ----------
        samples : int
            How many in all.
        size : int, optional
            Largest size of a block, one or more.

        Returns
        -------
        iterator of float arrays
            Each block is drawn when its turn comes.

        Raises
        ------
        ValueError
            If `samples` is not a whole number or negative, or `size` is not a positive one.
        """
        samples, size = whole_number("samples", samples, 0), whole_number("size", size, 1)
        return (self.draw(min(size, samples - at)) for at in range(0, samples, size))


@njit()
def _shape(series: FloatArray, gain: float, sections: Rows, state: FloatArray) -> None:
    """Replace a series by its filtered self."""
    for i in range(series.size):
        series[i] = gain * through(sections, state, series[i])


class LaserNoise(ShapedNoise):
    r"""Frequency noise of a free-running laser, of density level / f.

    .. math::

        \text{asd}(f) = \frac{\text{level}}{\sqrt{f^2 + f_c^2}} , \quad
        f_c = 10^{-6}\,\text{Hz}

    Parameters
    ----------
    seed : int
        Of the random numbers.
    sample_rate : float
        In Hz.
    level : float, optional
        Density at 1 Hz, in Hz/sqrt(Hz); the paper's 30 by default.
    at_rest : bool, optional
        Whether the filter starts at rest, so that the series starts near zero, as when a
        simulation is switched on. By default the series is stationary from the start.

    Notes
    -----
    At half the sample rate the trapezoidal rule alone would give a density of zero. Zeros at
    2.37 and 7.87 and a pole at 6.03 times the sample rate, in rad/s, correct this. The
    remaining error is 0.02 percent at a tenth of the sample rate (20 Hz at 200 Hz), 0.7
    percent at a quarter, and 1.6 percent at most. These numbers are for sample rates far above
    the cutoff; `sampled_asd` is exact for all.

    Examples
    --------
    >>> from armlock import LaserNoise
    >>> noise = LaserNoise(seed=1, sample_rate=10.0)
    >>> noise.draw(10).shape
    (10,)
    """

    #: Frequency in Hz below which the density is flat.
    cutoff = 1e-6

    def __init__(
        self,
        seed: int,
        sample_rate: float,
        *,
        level: float = paper.LASER_NOISE,
        at_rest: bool = False,
    ) -> None:
        self.level = positive_number("level", level)
        self._at_rest = true_or_false("at_rest", at_rest)
        rate = positive_number("sample_rate", sample_rate)
        zeros = [-rate * zero for zero in _LASER_ZEROS]
        pole = -rate * _LASER_POLE
        # One at s = 0, as the prescribed density is where it is flat.
        unity = pole / math.prod(zeros)
        super().__init__(
            zeros, (-2.0 * math.pi * self.cutoff, pole), -2.0 * math.pi * self.level * unity,
            seed=seed, sample_rate=rate,
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
        \text{asd}(f) &= \text{level}\,
        \frac{\sqrt{f^4 + f_0^4}}{f^2 + \text{cutoff}^2} ,

    with the level and the corner :math:`f_0` of `armlock.paper`.

    Parameters
    ----------
    seed : int
        Of the random numbers.
    sample_rate : float
        In Hz.
    cutoff : float, optional
        Frequency in Hz below which the density is flat. It decides the r.m.s., which grows as
        cutoff^(-3/2).

    Notes
    -----
    The filter is, with :math:`\omega_0 = 2\pi f_0` and :math:`\omega_c = 2\pi\,\text{cutoff}`

    .. math::

        H(s) = \text{level}\,
        \frac{s^2 + \sqrt{2}\, \omega_0 s + \omega_0^2}{(s + \omega_c)^2} ,

    because at s = j omega

    .. math::

        \left| s^2 + \sqrt{2}\, \omega_0 s + \omega_0^2 \right|^2 = \omega^4 + \omega_0^4 .

    The r.m.s. of what is drawn includes the flat part below the cutoff:

    .. math::

        \text{rms}^2 = \text{level}^2 \left( \frac{f_s}{2}
        + \frac{\pi f_0^4}{4\,\text{cutoff}^3} \right) .

    An integral of the printed density that begins at the cutoff has :math:`4 / (3\pi)` of the
    second term, and an r.m.s. that is smaller by a factor of up to 1.53.

    Examples
    --------
    >>> from armlock import PerturbationNoise
    >>> print(f"{PerturbationNoise(seed=1, sample_rate=200.0).rms:.4f}")
    0.0224
    >>> c1 = 1.0 + PerturbationNoise(seed=1, sample_rate=10.0).draw(100)
    >>> c1.shape
    (100,)
    """

    def __init__(
        self,
        seed: int,
        sample_rate: float,
        *,
        cutoff: float = 5e-6,
    ) -> None:
        self.cutoff = positive_number("cutoff", cutoff)
        corner = 2.0 * math.pi * self.cutoff
        root = 2.0 * math.pi * paper.PHASE_NOISE_CORNER * math.sqrt(0.5)
        super().__init__(
            (complex(-root, root), complex(-root, -root)), (-corner, -corner),
            paper.PHASE_NOISE_LEVEL, seed=seed, sample_rate=sample_rate,
        )  # fmt: skip
