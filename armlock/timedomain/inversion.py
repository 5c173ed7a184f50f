r"""The inverse Laplace transform on a line to the right of all poles.

For a real y(t) whose transform Y(s) falls faster than 1 / |s|

.. math::

    y(t) = \frac{e^{\sigma t}}{\pi} \mathrm{Re} \int_0^\infty
    Y(\sigma + \mathrm{j}\omega)\, e^{\mathrm{j}\omega t}\, \mathrm{d}\omega .

The frequencies are cut into panels, on which Y is interpolated by Legendre polynomials. Their
products with the oscillation are integrated exactly (Filon's method), with the spherical Bessel
functions j_l:

.. math::

    \int_{-1}^1 P_l(x)\, e^{\mathrm{j} x z}\, \mathrm{d}x = 2\, \mathrm{j}^l j_l(z) .

So a panel is as wide as Y is smooth, whatever t is, and corners over ten decades need some
hundred panels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from armlock.checks import BoolArray, ComplexArray, FloatArray
from armlock.engine.tolerances import EPSILON

# Points of a panel, and the most panels: a minute for a thousand times.
_POINTS, _MOST = 20, 1 << 16
# A panel is halved until its polynomial misses the values in its halves by less than this share
# of the integral, or by rounding. The halves are used, which miss less than a share of this.
_MISSED, _ROUNDING, _HALVES_MISS = 1e-13, 1e-14, 1e-3
# The last octave's share of the integral, after which no more is taken.
_LEFT_OUT = 1e-15
# Panels computed together: few enough that an interrupt is heard.
_TOGETHER = 1 << 11
# Octaves are looked at in so many places before they are cut.
_PLACES = 3

_NODES, _WEIGHTS = legendre.leggauss(_POINTS)
_DEGREES = np.arange(_POINTS)
# From values at the nodes to coefficients, and to values at the nodes of both halves.
_TO_LEGENDRE = (_DEGREES + 0.5) * (legendre.legvander(_NODES, _POINTS - 1).T * _WEIGHTS).T
_TO_HALVES = _TO_LEGENDRE @ (
    legendre.legvander(0.5 * np.append(_NODES - 1.0, _NODES + 1.0), _POINTS - 1).T
)

#: A function of s in rad/s, and a bound on its rounding errors.
Transform = Callable[[ComplexArray], tuple[ComplexArray, FloatArray]]


class Panels(NamedTuple):
    """A transform on its line.

    Attributes
    ----------
    begin, half : float arrays, shape (n,)
        Where panels begin, and half their widths, in rad/s.
    values : complex array, shape (n, points)
        The transform at the nodes of the panels.
    error : float
        Integral of its rounding errors, of what the polynomials miss and of what is left out.
    """

    begin: FloatArray
    half: FloatArray
    values: ComplexArray
    error: float


class TooLongError(ValueError):
    """A response cannot be computed up to a time."""


class Line:
    """A line right of all poles, and a transform on it, octave by octave at first.

    Parameters
    ----------
    transform : callable
        A function of s in rad/s, and a bound on its rounding errors.
    sigma : float
        Real part in rad/s of the line.
    corner : float
        The transform falls faster than 1 / |s| above this frequency in rad/s.
    least : float
        An integral of the transform that is not smaller than this is computed to all digits.

    Attributes
    ----------
    error : float
        Integral of the rounding errors, from the octaves.
    """

    def __init__(self, transform: Transform, sigma: float, corner: float, least: float) -> None:
        self.transform, self.sigma, self.least = transform, sigma, least
        octaves = int(np.ceil(np.log2(4.0 * corner / sigma)))
        begin = sigma * np.append(0.0, 2.0 ** np.arange(max(octaves, 1)))
        half = 0.5 * np.append(begin[1], begin[1:])
        values, errors = self._sampled(begin, half)
        self.whole = least + float(half @ (np.abs(values) @ _WEIGHTS))
        self.left_out, last = np.inf, 0.0
        while self.left_out > max(_LEFT_OUT * self.whole, last):
            octave = 2.0 * begin[-1:], 2.0 * half[-1:]
            more = self._sampled(*octave)
            if not np.isfinite(more[0]).all():
                # Powers of s overflow, far above all corners.
                break
            begin, half, values, errors = (
                np.concatenate(pair)
                for pair in zip((begin, half, values, errors), (*octave, *more), strict=True)
            )
            self.left_out, last = (float(half[-1] * (np.abs(p[0]) @ _WEIGHTS)) for p in more)
            self.whole += self.left_out
        self.begin, self.half, self.values = begin, half, values
        self.error = self.left_out + float(half @ (errors @ _WEIGHTS))

    def _sampled(self, begin: FloatArray, half: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Return the transform at the nodes of some panels, not too many at once."""
        s = np.asarray(
            self.sigma + 1j * (begin[:, None] + half[:, None] * (1.0 + _NODES)),
            dtype=np.complex128,
        )
        blocks = range(0, len(s), _TOGETHER)
        parts = [self.transform(s[at : at + _TOGETHER]) for at in blocks]
        values, errors = map(np.concatenate, zip(*parts, strict=True))
        return values, errors

    def _halved(
        self, begin: FloatArray, half: FloatArray, values: ComplexArray
    ) -> tuple[BoolArray, list[npt.NDArray[Any]]]:
        """Tell which panels are known; return the halves of all, their values and errors."""
        begins, halves = (
            np.stack((begin, begin + half), axis=1),
            np.stack((half, half), axis=1) / 2.0,
        )
        inner, errors = (
            part.reshape(begin.size, -1)
            for part in self._sampled(begins.ravel(), halves.ravel())
        )
        missed = np.abs(inner - values @ _TO_HALVES).max(axis=1)
        rounding = errors.max(axis=1) + _ROUNDING * np.abs(inner).max(axis=1)
        known = (2.0 * half * missed <= _MISSED * self.whole) | (missed <= rounding)
        return known, [begins, halves, inner, errors + _HALVES_MISS * missed[:, None]]

    def check(self) -> None:
        """Raise if some places of each octave ask for more than the most panels."""
        left, count, parts = np.arange(self.begin.size), 0, 1
        while left.size:
            half = np.repeat(self.half[left] / parts, _PLACES)
            place = np.tile(np.linspace(0.0, 1.0, _PLACES), left.size)
            begin = np.repeat(self.begin[left], _PLACES) + 2.0 * (parts - 1) * half * place
            known, _ = self._halved(begin, half, self._sampled(begin, half)[0])
            most = 2 * known.reshape(-1, _PLACES).sum(axis=1) > _PLACES
            count += 2 * parts * int(most.sum())
            left, parts = left[~most], 2 * parts
            if count + 2 * parts * left.size > _MOST:
                raise TooLongError(f"more than {_MOST} panels")

    def panels(self) -> Panels:
        """Cut the octaves into panels on which the transform is interpolated.

        Raises
        ------
        TooLongError
            If there are more than are computed.
        """
        self.check()
        begin, half, values = self.begin, self.half, self.values
        found: list[list[npt.NDArray[Any]]] = []
        count = 0
        while begin.size:
            known, parts = self._halved(begin, half, values)
            found.append([part[known].ravel() for part in parts])
            begin, half, values = (part[~known].ravel() for part in parts[:3])
            values, count = values.reshape(-1, _POINTS), count + 2 * int(known.sum())
            if count + begin.size > _MOST:
                raise TooLongError(f"more than {_MOST} panels")
        begins, halves, *both = map(np.concatenate, zip(*found, strict=True))
        points, errors = (part.reshape(-1, _POINTS) for part in both)
        error = self.left_out + float(halves @ (errors @ _WEIGHTS))
        return Panels(begins, halves, points, error)


def inverted(of: Panels, sigma: float, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the inverse transform at times of shape (n,) in s, and the size of its errors."""
    # Importing scipy.special takes as long as a count.
    from scipy.special import spherical_jn

    total, turned = np.zeros(time.size), np.zeros(time.size)
    for half in np.unique(of.half):
        same = of.half == half
        middle, coefficients = of.begin[same] + half, of.values[same] @ _TO_LEGENDRE
        shares = np.zeros((time.size, _POINTS), dtype=np.complex128)
        for at in range(0, middle.size, _TOGETHER):
            some = slice(at, at + _TOGETHER)
            shares += np.exp(1j * np.multiply.outer(time, middle[some])) @ coefficients[some]
        bessel = spherical_jn(_DEGREES, half * time[:, None])
        total += 2.0 * half * (shares * 1j**_DEGREES * bessel).sum(axis=1).real
        # The products of frequencies and times are rounded.
        turned += 2.0 * half * np.abs(bessel) @ (middle @ np.abs(coefficients))
    growth = np.exp(sigma * time) / np.pi
    return total * growth, (of.error + EPSILON * time * turned) * growth
