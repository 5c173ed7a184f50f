"""D-subdivision: the curves in the parameter plane on which a root lies on the axis.

D(j omega; x, y) = 0 is, for each omega, a real linear 2 x 2 system for (x, y). Its solution
traces the D-curve; at omega = 0, where D is real, it is a straight line instead. Between
these curves the number of unstable roots of a retarded system is constant.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import FloatArray, check_memory, positive_number, real_array
from armlock.engine.inclusion import EPSILON
from armlock.stability.counts import CountError
from armlock.stability.crossings import crossings


class Line(NamedTuple):
    """The straight line weight_x x + weight_y y = value in the parameter plane."""

    weight_x: float
    weight_y: float
    value: float


class Branch(NamedTuple):
    """One connected piece of the D-curve, between two of its poles.

    Attributes
    ----------
    omega : float array, shape (n,)
        Ascending frequencies in rad/s, away from the poles.
    x, y : float arrays, shape (n,)
        The points of the curve.
    """

    omega: FloatArray
    x: FloatArray
    y: FloatArray


def _require_two_parameters(system: CharacteristicFunction) -> None:
    """Raise if D(j omega) = 0 does not determine both free parameters."""
    b1, b2 = system.b1.coefficients, system.b2.coefficients
    for name, b in zip(system.parameters, (b1, b2), strict=True):
        if not b.any():
            raise ValueError(
                f"system must depend on both free parameters, but {system!r} does not "
                f"depend on {name}: there is no D-curve"
            )
    if system.tau1 == system.tau2:
        ratio = b1[-1] / b2[-1]
        if b1.size == b2.size and np.allclose(b1, ratio * b2, rtol=4 * EPSILON, atol=0.0):
            raise ValueError(
                f"tau1 and tau2 must differ, got {system.tau1} for both: only one "
                f"combination of {' and '.join(system.parameters)} enters, and the D-curve "
                f"degenerates to lines"
            )


def d_curve(
    system: CharacteristicFunction, omega: npt.ArrayLike
) -> tuple[FloatArray, FloatArray]:
    r"""Parameters at which s = j omega is a characteristic root.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    omega : array_like of float
        Angular frequencies in rad/s, any shape and sign.

    Returns
    -------
    x, y : float arrays, shaped like `omega`
        The point of the curve, nan where the curve has a pole. At omega = 0 every point of
        the line `d_curve_line(system)` has a root, and nan is returned too.

    Raises
    ------
    TypeError, ValueError
        If omega is not finite and real, or the system does not determine both parameters (equal
        delays, or a free parameter without effect).

    See Also
    --------
    d_curve_line : the straight line at omega = 0.
    d_curve_branches : the curve sampled and cut at its poles, ready to be drawn.

    Notes
    -----
    D = 0 is a real linear system of two equations at each frequency,

    .. math::

        \begin{pmatrix} \mathrm{Re}\, \beta_1 & \mathrm{Re}\, \beta_2 \\
        \mathrm{Im}\, \beta_1 & \mathrm{Im}\, \beta_2 \end{pmatrix}
        \begin{pmatrix} x \\ y \end{pmatrix} =
        \begin{pmatrix} \mathrm{Re}\, V \\ \mathrm{Im}\, V \end{pmatrix}

    with :math:`V = R\, e^{s\delta} + x_0 B_1 + y_0 B_2` and
    :math:`\beta_k = B_k e^{-s\theta_k}` taken at s = j omega. It is solved by Cramer's rule:

    .. math::

        x = \frac{\mathrm{Im}(V \bar\beta_2)}{\mathrm{Im}(\beta_1 \bar\beta_2)} , \qquad
        y = -\frac{\mathrm{Im}(V \bar\beta_1)}{\mathrm{Im}(\beta_1 \bar\beta_2)} .

    For the Hayes equation this is

    .. math::

        a = \omega \cot \omega\tau , \qquad b = -\frac{\omega}{\sin \omega\tau} ,

    and for the common arm Eq. (5a) of the paper,

    .. math::

        c_1 &= \frac{2 \sin \omega\tau_2 + (\omega / g) \cos \omega\tau_2}
        {\sin \omega (\tau_2 - \tau_1)} , \\
        c_2 &= -\frac{2 \sin \omega\tau_1 + (\omega / g) \cos \omega\tau_1}
        {\sin \omega (\tau_2 - \tau_1)} .

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import HayesEquation, d_curve
    >>> a, b = d_curve(HayesEquation(tau=1.0), np.pi / 2)
    >>> bool(abs(a) < 1e-12), round(float(b), 12)
    (True, -1.570796326795)
    """
    checked_system(system)
    omega = real_array("omega", omega)
    _require_two_parameters(system)
    (x0, y0), s = system.reference, 1j * omega
    rest, b1, b2 = system.polynomials()
    change1, change2 = np.expm1(-s * system.tau1), np.expm1(-s * system.tau2)
    with np.errstate(invalid="ignore"):
        # All divided by B1, as factors: so the controller's part of it cancels.
        z = np.asarray(np.exp(s * system.step) if system.step else s, dtype=np.complex128)
        other = b2.over(b1, z)
        # D at the reference, where nothing cancels; from there both parameters are solved for.
        known = (
            rest.over(b1, z) * np.exp(s * system.delay) - x0 * change1 - y0 * other * change2
        )
        # Only the difference of the delays enters here, which keeps low frequencies exact.
        between = system.tau1 - system.tau2
        across = np.conj(other)
        determinant = np.imag(across) + np.imag(across * np.expm1(-s * between))
        rounding = 4.0 * EPSILON * np.abs(omega * between * across)
        determinant = np.where(np.abs(determinant) <= rounding, np.nan, determinant)
        x = x0 + np.imag(known * np.conj(other * (1.0 + change2))) / determinant
        y = y0 - np.imag(known * np.conj(1.0 + change1)) / determinant
    return x, y


def d_curve_line(system: CharacteristicFunction) -> Line:
    r"""Straight line on which s = 0 is a characteristic root, in closed form.

    .. math::

        x\, B_1(0) + y\, B_2(0) = A(0) + C(0)

    Parameters
    ----------
    system : CharacteristicFunction
        The loop.

    Returns
    -------
    Line
        weight_x x + weight_y y = value, from D(0) = 0; scaled so that the larger weight
        has magnitude one.

    Raises
    ------
    TypeError, ValueError
        If `system` is of another type, or D(0) depends on neither parameter: there is no line.

    Examples
    --------
    >>> from armlock import CommonArm
    >>> from armlock.stability.dcurve import d_curve_line
    >>> d_curve_line(CommonArm())
    Line(weight_x=1.0, weight_y=1.0, value=2.0)
    """
    checked_system(system)
    # From coefficients, which are exact there.
    at = 1.0 if system.step else 0.0
    rest, b1, b2 = (float(poly.polyval(at, p.coefficients)) for p in system.polynomials())
    a = rest + system.reference[0] * b1 + system.reference[1] * b2
    scale = max(b1, b2, key=abs)
    if scale == 0.0:
        raise ValueError(
            f"system must depend on a free parameter at s = 0, but {system!r} does not"
        )
    return Line(b1 / scale, b2 / scale, a / scale)


def _poles(system: CharacteristicFunction, omega_max: float) -> list[tuple[float, float]]:
    """Return the intervals, ascending, in which the curve has a pole, or may have one."""
    _, _, first, second = system.terms
    bound = np.array([np.inf])
    found = crossings(
        (first, first * 0, second), np.zeros(1), -bound, bound, np.array([omega_max])
    )
    if found.unfinished.any():
        raise CountError(
            f"no branches up to omega_max = {omega_max}: there are too many poles",
            np.empty((0, 2)),
        )
    off = found.width + 4.0 * EPSILON * found.omega
    # A pole at s = 0 is on no branch.
    low, high = np.maximum(found.omega - off, 0.0), found.omega + off
    inside = np.flatnonzero((found.omega > 0.0) | (found.jump == 0))
    order = inside[np.argsort(low[inside])]
    return list(zip(low[order].tolist(), high[order].tolist(), strict=True))


def d_curve_branches(
    system: CharacteristicFunction, omega_max: float, *, points_per_turn: int = 48
) -> list[Branch]:
    r"""Sample the D-curve for 0 < omega < omega_max, cut at its poles.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop.
    omega_max : float
        Highest frequency in rad/s.
    points_per_turn : int, optional
        Samples per turn of the longest delay, 2 pi / delay.

    Returns
    -------
    list of Branch
        In ascending frequency. No two points of a branch lie on different sides of a pole.

    Raises
    ------
    TypeError, ValueError
        As `d_curve`, or if an argument is not positive, or the samples do not fit into the
        memory.
    CountError
        If there are too many poles to be found.

    Notes
    -----
    The poles are the zeros of the determinant of the 2 x 2 system of `d_curve`,

    .. math::

        \mathrm{Im} \left[ B_1(\mathrm{j}\omega)\, \overline{B_2(\mathrm{j}\omega)}\,
        e^{-\mathrm{j}\omega (\theta_1 - \theta_2)} \right] = 0 ,

    found with certified steps (`armlock.engine.inclusion.cross`).

    Examples
    --------
    The curve of the Hayes equation has a pole wherever omega is a multiple of pi / tau.

    >>> from armlock import HayesEquation, d_curve_branches
    >>> branches = d_curve_branches(HayesEquation(tau=1.0), omega_max=9.0)
    >>> [f"{branch.omega[0]:.2f} to {branch.omega[-1]:.2f}" for branch in branches]
    ['0.00 to 3.14', '3.14 to 6.28', '6.28 to 9.00']
    """
    checked_system(system)
    omega_max = positive_number("omega_max", omega_max)
    if system.step:
        omega_max = min(omega_max, np.pi / system.step)
    density = positive_number("points_per_turn", points_per_turn)
    _require_two_parameters(system)
    # Samples in an interval of 1 rad/s.
    density *= system.longest_delay / (2.0 * np.pi)
    check_memory("omega_max", (int(min(density * omega_max, 1e18)),), 256)
    poles, around = _poles(system, omega_max), system.terms.rest.space.around_roots()
    branches = []
    for (_, start), (stop, _) in pairwise([(0.0, 0.0), *poles, (omega_max, omega_max)]):
        if stop <= start:
            continue
        count = int(np.ceil(max(density * (stop - start), 4.0 * points_per_turn)))
        # Closer towards both ends, where the curve runs off to its poles.
        share = 0.5 * (1.0 - np.cos(np.pi * (np.arange(count) + 0.5) / count))
        near = around[(around > start) & (around < stop)]
        omega = np.union1d(start + (stop - start) * share, near)
        x, y = d_curve(system, omega)
        kept = np.isfinite(x) & np.isfinite(y)
        branches.append(Branch(omega[kept], x[kept], y[kept]))
    return branches
