"""The outline of a stable region that surrounds the origin, and its size."""

from __future__ import annotations

import numpy as np

from armlock.characteristic import CharacteristicFunction
from armlock.checks import FloatArray
from armlock.robustness import first_crossing

# Length over width of the ellipse along x = -y on which the rays are evenly spread.
_ELONGATION = 5.0


def rays(number: int = 180) -> FloatArray:
    r"""Directions from the origin, denser along x = -y.

    With angles :math:`\alpha_i = 2\pi i / n` and the elongation e = 5, before normalization

    .. math::

        (\sin\alpha_i + e \cos\alpha_i ,\; \sin\alpha_i - e \cos\alpha_i) .

    Parameters
    ----------
    number : int, optional
        How many, all the way around.

    Returns
    -------
    float array, shape (2, number)
        Unit vectors.
    """
    angle = 2.0 * np.pi * np.arange(number) / number
    along, across = _ELONGATION * np.cos(angle), np.sin(angle)
    vectors = np.stack((across + along, across - along))
    return np.asarray(vectors / np.hypot(*vectors))


def boundary_radius(
    system: CharacteristicFunction, directions: FloatArray, reach: float = 11.0
) -> FloatArray:
    """Distance from the origin to the boundary of the stable region.

    Parameters
    ----------
    system : CharacteristicFunction
        A loop or a map, stable at the origin.
    directions : float array, shape (2, n)
        Unit vectors in the plane of the free parameters.
    reach : float, optional
        Distance from the origin up to which the boundary is looked for.

    Returns
    -------
    float array, shape (n,)
    """
    return np.array(
        [
            first_crossing(system, (0.0, 0.0), (x, y), stop=reach).position
            for x, y in directions.T
        ]
    )


def outline(radius: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the corners radius * directions as a closed polygon, shape (2, n + 1)."""
    corners = radius * directions
    return np.concatenate((corners, corners[:, :1]), axis=1)


def enclosed_area(closed: FloatArray) -> float:
    r"""Area inside a closed polygon of shape (2, n + 1), by the shoelace formula.

    .. math::

        \frac{1}{2} \left| \sum_{i=0}^{n-1} (x_i\, y_{i+1} - x_{i+1}\, y_i) \right|
    """
    x, y = closed
    return float(0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))


def perimeter(closed: FloatArray) -> float:
    r"""Length of a closed polygon of shape (2, n + 1).

    .. math::

        \sum_{i=0}^{n-1} \sqrt{(x_{i+1} - x_i)^2 + (y_{i+1} - y_i)^2}
    """
    return float(np.hypot(*np.diff(closed, axis=1)).sum())
