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

import numpy as np
from numpy.polynomial import legendre

from armlock.checks import ComplexArray, FloatArray

# Points of a panel, and the most panels: a minute for a thousand times.
_POINTS, _MOST = 20, 1 << 16
# A panel is halved until its polynomial misses the values in its halves by less than this share
# of the integral, or by rounding. The halves are used, which miss less.
_MISSED, _ROUNDING = 1e-13, 1e-14
# The last octave's share of the integral, after which no more is taken.
_LEFT_OUT = 1e-13
# Panels computed together: few enough that an interrupt is heard.
_TOGETHER = 1 << 11

_NODES, _WEIGHTS = legendre.leggauss(_POINTS)
_DEGREES = np.arange(_POINTS)
# From values at the nodes to coefficients, and to values at the nodes of both halves.
_TO_LEGENDRE = (_DEGREES + 0.5) * (legendre.legvander(_NODES, _POINTS - 1).T * _WEIGHTS).T
_TO_HALVES = _TO_LEGENDRE @ (
    legendre.legvander(0.5 * np.append(_NODES - 1.0, _NODES + 1.0), _POINTS - 1).T
)

#: Where panels begin, half their widths, and values at their nodes: (n,), (n,), (n, points).
Panels = tuple[FloatArray, FloatArray, ComplexArray]


class TooLongError(ValueError):
    """A response cannot be computed up to a time."""


def panels(
    transform: Callable[[ComplexArray], ComplexArray],
    sigma: float,
    corner: float,
    least: float,
) -> Panels:
    """Cut the frequencies into panels on which a transform is interpolated.

    Parameters
    ----------
    transform : callable
        A function of s in rad/s.
    sigma : float
        Real part in rad/s of the line, right of all poles.
    corner : float
        The transform falls faster than 1 / |s| above this frequency in rad/s.
    least : float
        An integral of the transform that is not smaller than this is computed to all digits.

    Returns
    -------
    Panels

    Raises
    ------
    TooLongError
        If there were more panels than are computed.
    """

    def sampled(begin: FloatArray, half: FloatArray) -> ComplexArray:
        """Return the transform at the nodes of some panels, not too many at once."""
        s = np.asarray(
            sigma + 1j * (begin[:, None] + half[:, None] * (1.0 + _NODES)), dtype=np.complex128
        )
        parts = [transform(s[at : at + _TOGETHER]) for at in range(0, len(s), _TOGETHER)]
        return np.asarray(np.concatenate(parts))

    # An octave is a panel, at first.
    octaves = int(np.ceil(np.log2(4.0 * corner / sigma)))
    begin = sigma * np.append(0.0, 2.0 ** np.arange(max(octaves, 1)))
    half = 0.5 * np.append(begin[1], begin[1:])
    values = sampled(begin, half)
    whole = least + float(half @ (np.abs(values) @ _WEIGHTS))
    last = np.inf
    while last > _LEFT_OUT * whole:
        begin, half = np.append(begin, 2.0 * begin[-1]), np.append(half, 2.0 * half[-1])
        values = np.vstack((values, sampled(begin[-1:], half[-1:])))
        last = float(half[-1] * (np.abs(values[-1]) @ _WEIGHTS))
        whole += last
    found: list[Panels] = []
    count = 0
    while begin.size:
        halves = np.stack((begin, begin + half), axis=1), np.stack((half, half), axis=1) / 2.0
        inner = sampled(halves[0].ravel(), halves[1].ravel()).reshape(begin.size, -1)
        missed = np.abs(inner - values @ _TO_HALVES).max(axis=1)
        known = 2.0 * half * missed <= _MISSED * whole
        known |= missed <= _ROUNDING * np.abs(inner).max(axis=1)
        kept, *edges = (part[known] for part in (inner, *halves))
        found.append((edges[0].ravel(), edges[1].ravel(), kept.reshape(-1, _POINTS)))
        values = inner[~known].reshape(-1, _POINTS)
        begin, half = (part[~known].ravel() for part in halves)
        count += 2 * int(known.sum())
        if count + begin.size > _MOST:
            raise TooLongError(f"more than {_MOST} panels")
    begins, widths, points = zip(*found, strict=True)
    return np.concatenate(begins), np.concatenate(widths), np.concatenate(points)


def inverted(of: Panels, sigma: float, time: FloatArray) -> FloatArray:
    """Return the inverse transform at times of shape (n,) in s."""
    # Importing scipy.special takes as long as a count.
    from scipy.special import spherical_jn

    total = np.zeros(time.size)
    begins, halves, values = of
    for half in np.unique(halves):
        same = halves == half
        middle, coefficients = begins[same] + half, values[same] @ _TO_LEGENDRE
        shares = np.zeros((time.size, _POINTS), dtype=np.complex128)
        for at in range(0, middle.size, _TOGETHER):
            some = slice(at, at + _TOGETHER)
            shares += np.exp(1j * np.multiply.outer(time, middle[some])) @ coefficients[some]
        bessel = spherical_jn(_DEGREES, half * time[:, None])
        total += 2.0 * half * (shares * 1j**_DEGREES * bessel).sum(axis=1).real
    return np.asarray(total * np.exp(sigma * time) / np.pi)
