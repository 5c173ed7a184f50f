"""The outline of a stable region that surrounds the origin, and its size."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from armlock.characteristic import CharacteristicFunction
from armlock.checks import FloatArray, positive_number, real_array, whole_number
from armlock.stability import unstable_roots

# Halvings of the bracket: from a reach of some units to about 1e-9.
_HALVINGS = 33


def rays(number: int = 180, elongation: float = 5.0) -> FloatArray:
    r"""Directions from the origin, denser along x = -y.

    With angles :math:`\alpha_i = 2\pi i / n` and the elongation e, before normalization

    .. math::

        (\sin\alpha_i + e \cos\alpha_i ,\; \sin\alpha_i - e \cos\alpha_i) .

    Parameters
    ----------
    number : int, optional
        How many, all the way around.
    elongation : float, optional
        Length over width of an ellipse along x = -y on which they are evenly spread.

    Returns
    -------
    float array, shape (2, number)
        Unit vectors.

    Raises
    ------
    TypeError, ValueError
        If `number` is no integer from 1 on, or `elongation` not positive and finite.
    """
    number = whole_number("number", number, 1)
    elongation = positive_number("elongation", elongation)
    angle = 2.0 * np.pi * np.arange(number) / number
    along, across = elongation * np.cos(angle), np.sin(angle)
    vectors = np.stack((across + along, across - along))
    return np.asarray(vectors / np.hypot(*vectors))


def _vectors(name: str, value: npt.ArrayLike) -> FloatArray:
    """Return a finite float array of shape (2, n), or raise."""
    array = real_array(name, value)
    if array.ndim != 2 or array.shape[0] != 2 or array.shape[1] == 0:
        raise ValueError(f"{name} must be of shape (2, n), got {array.shape}")
    return array


def boundary_radius(
    system: CharacteristicFunction, directions: npt.ArrayLike, reach: float = 11.0
) -> FloatArray:
    """Distance from the origin to the boundary of the stable region.

    Parameters
    ----------
    system : CharacteristicFunction
        A loop or a map, stable at the origin and unstable at distance `reach`.
    directions : float array, shape (2, n)
        Unit vectors in the plane of the free parameters.
    reach : float, optional
        Where the bisection starts from outside.

    Returns
    -------
    float array, shape (n,)
        By bisection on the number of unstable roots. Where a ray meets the boundary more
        than once, one of the crossings.

    Raises
    ------
    TypeError, ValueError
        If `directions` is no pair of rows of finite numbers, the origin is not stable, or a
        point at distance `reach` is.
    """
    reach = positive_number("reach", reach)
    directions = _vectors("directions", directions)
    inside = np.zeros(directions.shape[1])
    outside = np.full(directions.shape[1], reach)
    if unstable_roots(system, 0.0, 0.0) != 0:
        raise ValueError(f"system must be stable at the origin, and {system!r} is not")
    if (unstable_roots(system, *(outside * directions)) == 0).any():
        raise ValueError(f"reach must lie outside the stable region, got {reach}")
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        stable = unstable_roots(system, *(middle * directions)) == 0
        inside = np.where(stable, middle, inside)
        outside = np.where(stable, outside, middle)
    return np.asarray(0.5 * (inside + outside))


def outline(radius: npt.ArrayLike, directions: npt.ArrayLike) -> FloatArray:
    """Return the corners radius * directions as a closed polygon, shape (2, n + 1).

    Raises
    ------
    TypeError, ValueError
        If an argument does not hold finite numbers, or the two do not match in length.
    """
    vectors, lengths = _vectors("directions", directions), real_array("radius", radius)
    if lengths.shape not in ((), vectors.shape[1:]):
        raise ValueError(
            f"radius must hold one number for each of the {vectors.shape[1]} directions, got "
            f"shape {lengths.shape}"
        )
    corners = lengths * vectors
    return np.concatenate((corners, corners[:, :1]), axis=1)


def enclosed_area(closed: npt.ArrayLike) -> float:
    r"""Area inside a closed polygon of shape (2, n + 1), by the shoelace formula.

    .. math::

        \frac{1}{2} \left| \sum_{i=0}^{n-1} (x_i\, y_{i+1} - x_{i+1}\, y_i) \right|
    """
    x, y = _vectors("closed", closed)
    return float(0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))


def perimeter(closed: npt.ArrayLike) -> float:
    r"""Length of a closed polygon of shape (2, n + 1).

    .. math::

        \sum_{i=0}^{n-1} \sqrt{(x_{i+1} - x_i)^2 + (y_{i+1} - y_i)^2}
    """
    return float(np.hypot(*np.diff(_vectors("closed", closed), axis=1)).sum())
