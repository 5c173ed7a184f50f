"""D-subdivision: the curves in the parameter plane on which a root lies on the axis.

D(j omega; x, y) = 0 is, for each omega, a real linear 2 x 2 system for (x, y). Its solution
traces the D-curve; at omega = 0, where D is real, it is a straight line instead. Between
these curves the number of unstable roots of a retarded system is constant.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import fmpq, fmpq_poly

from armlock.checks import FloatArray, check_memory, positive_number, real_array
from armlock.engine.affine import Affine, functions
from armlock.engine.functions import at
from armlock.engine.polynomials import collected, polynomial, rounded
from armlock.engine.tolerances import EPSILON
from armlock.engine.values import newton
from armlock.stability.counts import CountError
from armlock.stability.crossings import crossings
from armlock.systems import Lag, Sum, System
from armlock.tables import Table, as_html, as_text, spread

_S = fmpq_poly([0, 1])
#: Polynomials by the length of their delay, which may be negative.
_Sum = dict[fmpq, fmpq_poly]


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

    def _table(self) -> Table:
        """Show how long the branch is."""
        names = ("omega", "rad/s"), ("x", ""), ("y", "")
        rows = [(name, spread(getattr(self, name), unit)) for name, unit in names]
        return Table("Branch of a D-curve", rows)

    __repr__, _repr_html_ = as_text, as_html  # type: ignore[misc]


def _two(system: Any, numbers: dict[str, Any]) -> tuple[System, str, str]:
    """Return the system with numbers for all parameters but two, and the names of these."""
    system = System.of(system)
    system = system.at(**numbers)
    if len(system.parameters) != 2:
        raise TypeError(
            f"two parameters must be left without a number, got {system.parameters} of "
            f"{system!r}"
        )
    return system, *system.parameters


def _crossed(b: _Sum, c: _Sum) -> _Sum:
    """Return b conj(c) - conj(b) c, which on the axis is twice j Im(b conj(c)), exactly."""
    found = collected(
        term
        for t, p in b.items()
        for u, q in c.items()
        for term in ((t - u, p * q(-_S)), (u - t, -p(-_S) * q))
    )
    return {time: p for time, p in found.items() if p}


class _Curve:
    """D = d + x b + y c on the axis, by Cramer's rule; the determinant is exact."""

    def __init__(self, system: System, x: str, y: str) -> None:
        self.affine = affine = system.affine_in((x, y))
        d = system.numerator + system.denominator
        b, c = d.by_length(x), d.by_length(y)
        for name, part in ((x, b), (y, c)):
            if not part:
                raise ValueError(
                    f"system must depend on both free parameters, but {system!r} does not "
                    f"depend on {name}: there is no D-curve"
                )
        # Such as the zeros of a controller.
        shared = fmpq_poly([0])
        for p in (*b.values(), *c.values()):
            shared = shared.gcd(p)
        b, c = ({time: p // shared for time, p in part.items()} for part in (b, c))
        determinant = _crossed(b, c)
        if not determinant:
            raise ValueError(
                f"{x} and {y} must act differently, but only one combination of them enters "
                f"{system!r}: the D-curve degenerates to lines"
            )
        values = dict(zip((x, y), affine.origin, strict=True))
        known = d.put({name: Sum.of(polynomial([v])) for name, v in values.items()})
        early, one = min(determinant), fmpq_poly([1])
        parts = (
            known.by_length(), {fmpq(0): shared}, b, c, {fmpq(0): one},
            {time - early: p for time, p in determinant.items()}, {-early: one},
        )  # fmt: skip
        groups = [[{Lag.after(time): p for time, p in part.items()}] for part in parts]
        self.functions = functions(groups, system.step)
        self.newton = newton(self.functions[5])

    def at(self, omega: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points of the curve; nan where rounding hides the determinant."""
        shape, omega = np.shape(omega), np.abs(np.ravel(omega))
        with np.errstate(all="ignore"):
            known, shared, b, c, one, above, turned = at(self.functions, omega)
            known, determinant = known / shared, (above / turned).imag / 2.0
            # What the frequency is rounded by hides the determinant next to its zeros.
            near = np.abs(determinant) < 1e-6 * np.abs(b * c / one**2)
            step, _ = self.newton.roughly(1j * omega[near], (1.0,))
            hidden = omega == 0.0
            hidden[near] |= np.abs(step) <= 4.0 * EPSILON * omega[near]
            determinant = np.where(hidden, np.nan, determinant)
            x = self.affine.origin[0] - (known * np.conj(c / one)).imag / determinant
            y = self.affine.origin[1] + (known * np.conj(b / one)).imag / determinant
        return x.reshape(shape), y.reshape(shape)


def d_curve(
    system: System, omega: npt.ArrayLike, **numbers: float
) -> tuple[FloatArray, FloatArray]:
    r"""Parameters at which s = j omega is a characteristic root.

    Parameters
    ----------
    system : System
        The open loop, for instance `CommonArm()`, or an equation.
    omega : array_like of float
        Angular frequencies in rad/s, any shape and sign.
    **numbers : real numbers
        Values of all parameters but two, which are x and y in the order of their first use.

    Returns
    -------
    x, y : float arrays, shaped like `omega`
        The point of the curve, nan where the curve has a pole. At omega = 0 every point of
        the line `d_curve_line(system)` has a root, and nan is returned too.

    Raises
    ------
    TypeError, ValueError
        If omega is not finite and real, there are not two parameters, the system is not affine
        in both, or does not determine both (equal delays, or a parameter without effect).

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

    with D = V at nominal parameters (or zero), from which x and y are counted, and
    :math:`-\beta_k` what stands before them, at s = j omega. It is solved by Cramer's rule:

    .. math::

        x = \frac{\mathrm{Im}(V \bar\beta_2)}{\mathrm{Im}(\beta_1 \bar\beta_2)} , \qquad
        y = -\frac{\mathrm{Im}(V \bar\beta_1)}{\mathrm{Im}(\beta_1 \bar\beta_2)} .

    The determinant is multiplied out exactly, and common factors of both are taken out.

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
    omega = real_array("omega", omega)
    return _Curve(*_two(system, numbers)).at(omega)


def d_curve_line(system: System, **numbers: float) -> Line:
    r"""Straight line on which s = 0 is a characteristic root, in closed form.

    .. math::

        D(0; x, y) = 0

    Parameters
    ----------
    system : System
        The open loop, or an equation.
    **numbers : real numbers
        Values of all parameters but two.

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
    system, x, y = _two(system, numbers)
    # Of the roots at s = 0 that are left out the next coefficient decides.
    order = system.cancelled() if system.at_zero is None else system.at_zero
    terms = system.affine_in((x, y)).terms
    value, first, second = (f.series(order + 1)[order] for f in terms)
    scale = max(first, second, key=abs)
    if not scale:
        raise ValueError(
            f"system must depend on a free parameter at s = 0, but {system!r} does not"
        )
    return Line(*rounded([first / scale, second / scale, -value / scale]).tolist())


def _poles(affine: Affine, omega_max: float) -> list[tuple[float, float]]:
    """Return the intervals, ascending, in which the curve has a pole, or may have one."""
    _, first, second = affine.terms
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
    system: System, omega_max: float, *, points_per_turn: int = 48, **numbers: float
) -> list[Branch]:
    r"""Sample the D-curve for 0 < omega < omega_max, cut at its poles.

    Parameters
    ----------
    system : System
        The open loop, or an equation.
    omega_max : float
        Highest frequency in rad/s.
    points_per_turn : int, optional
        Samples per turn of the longest delay, 2 pi / delay.
    **numbers : real numbers
        Values of all parameters but two.

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

        \mathrm{Im} \left( \beta_1 \bar\beta_2 \right) = 0 ,

    found with certified steps (`armlock.engine.inclusion.cross`).

    Examples
    --------
    The curve of the Hayes equation has a pole wherever omega is a multiple of pi / tau.

    >>> from armlock import HayesEquation, d_curve_branches
    >>> branches = d_curve_branches(HayesEquation(tau=1.0), omega_max=9.0)
    >>> [f"{branch.omega[0]:.2f} to {branch.omega[-1]:.2f}" for branch in branches]
    ['0.00 to 3.14', '3.14 to 6.28', '6.28 to 9.00']
    """
    system, x, y = _two(system, numbers)
    omega_max = positive_number("omega_max", omega_max)
    if system.step:
        omega_max = min(omega_max, np.pi / system.step)
    density = positive_number("points_per_turn", points_per_turn)
    curve = _Curve(system, x, y)
    space = curve.affine.space
    # Samples in an interval of 1 rad/s.
    density *= space.longest / (2.0 * np.pi)
    check_memory("omega_max", (int(min(density * omega_max, 1e18)),), 256)
    poles, around = _poles(curve.affine, omega_max), space.around_roots()
    branches = []
    for (_, start), (stop, _) in pairwise([(0.0, 0.0), *poles, (omega_max, omega_max)]):
        if stop <= start:
            continue
        count = int(np.ceil(max(density * (stop - start), 4.0 * points_per_turn)))
        # Closer towards both ends, where the curve runs off to its poles.
        share = 0.5 * (1.0 - np.cos(np.pi * (np.arange(count) + 0.5) / count))
        near = around[(around > start) & (around < stop)]
        omega = np.union1d(start + (stop - start) * share, near)
        first, second = curve.at(omega)
        kept = np.isfinite(first) & np.isfinite(second)
        branches.append(Branch(omega[kept], first[kept], second[kept]))
    return branches
