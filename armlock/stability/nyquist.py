"""The open loop on the imaginary axis: Nyquist curve, encirclements, crossings.

The contour goes up the imaginary axis, indented to the right around the pole of L at s = 0,
and back at infinity. It is sampled so finely that the argument of 1 + L is known without doubt,
up to past the last root on the axis; what 1 + L gathers from there on follows from the roots of
its numerator and denominator without delays. The encirclements are then held against the count
of unstable roots: Z = N + P.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from armlock.axis.contour import MOST_SAMPLES, argument_at, resolved_grid
from armlock.checks import (
    ComplexArray,
    FloatArray,
    check_memory,
    positive_number,
)
from armlock.loops import Loop, LoopAt
from armlock.stability.bounds import last_frequency, last_larger
from armlock.stability.counts import (
    CountError,
    loop_count,
    sign_changes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# How far numerator and denominator of 1 + L may be from straight lines between two samples,
# relative to their distance from zero. Neither turns by more than 0.31 rad then.
_STRAIGHT = 0.1
# Most that 1 + L turns between two samples, in rad, unless it passes through zero.
_MOST_TURN = 1.0


@dataclass(frozen=True, eq=False)
class NyquistCurve:
    """The open loop along the indented Nyquist contour, for omega >= 0.

    Attributes
    ----------
    omega : float array, shape (n,)
        Ascending frequencies in rad/s, from the indentation up.
    response : complex array, shape (n,)
        L(j omega).
    indentation : complex array, shape (k,)
        Points s from the positive real axis to the imaginary axis, on the quarter circle
        around s = 0 that leaves the pole there outside. Empty where L has no pole there.
    indentation_response : complex array, shape (k,)
        L on the indentation: the infinite branch.
    pole_order : int
        Order of the pole of L at s = 0, after cancellation.
    encirclements : int
        N, clockwise turns around -1 of the whole contour, both signs of omega.
    open_loop_poles : int
        P, poles of L in the open right half-plane.
    closed_loop_roots : int
        Z = N + P, zeros of 1 + L in the right half-plane.

    Examples
    --------
    >>> from armlock import SingleArm, nyquist
    >>> curve = nyquist(SingleArm(), c1=0.999)
    >>> curve.pole_order, curve.closed_loop_roots
    (1, 0)
    """

    omega: FloatArray
    response: ComplexArray
    indentation: ComplexArray
    indentation_response: ComplexArray
    pole_order: int
    encirclements: int
    open_loop_poles: int
    closed_loop_roots: int

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the curve, both signs of omega, with -1 and the infinite branch.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        **options
            As `armlock.plotting.plot_nyquist` takes them.

        Returns
        -------
        matplotlib Axes
        """
        from armlock.plotting import plot_nyquist

        return plot_nyquist(self, ax, **options)


@dataclass(frozen=True, eq=False)
class AxisCrossings:
    """Where the Nyquist curve meets the negative real axis.

    Attributes
    ----------
    omega : float array, shape (n,)
        Ascending frequencies in rad/s.
    value : float array, shape (n,)
        L there, negative.

    Examples
    --------
    >>> from armlock import axis_crossings, paper_loop
    >>> crossings = axis_crossings(paper_loop(), omega_max=0.2)
    >>> bool((crossings.value < 0).all())
    True
    """

    omega: FloatArray
    value: FloatArray


def open_loop_poles(loop: Loop) -> int:
    """Count the poles of L in the open right half-plane.

    Parameters
    ----------
    loop : Loop
        The loop.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        If L has poles on the imaginary axis elsewhere than at s = 0: the contour is indented
        there only.
    """
    poles = loop.polynomials()[0].roots
    on_axis = (np.abs(poles.real) <= 1e-12 * np.abs(poles)) & (poles != 0.0)
    if on_axis.any():
        raise ValueError(
            "the open loop must have no pole on the imaginary axis except at s = 0, got one "
            f"at {poles[on_axis][0]}; unstable_roots counts such a loop all the same"
        )
    return int((poles.real > 0.0).sum())


def _resolving_grid(loop: Loop, c1: float, c2: float, end: float) -> FloatArray:
    """Frequencies from 0 to `end` between which neither D nor R turns by much."""
    grids = []
    for part in (loop.sum_at(c1, c2), loop.rest_on_boundary()):
        grids.append(resolved_grid(part.compiled(), end, _STRAIGHT, MOST_SAMPLES))
    if any(grid[-1] < end for grid in grids):
        raise CountError(
            f"no samples up to omega = {end} rad/s: more than {MOST_SAMPLES:.0e}, "
            f"because gain times delay is too large",
            np.empty((0, 2)),
        )
    return np.unique(np.concatenate(grids))


def _drawing_grid(loop: Loop, start: float, end: float) -> FloatArray:
    """Frequencies close enough to draw the curve; finer at first, where L changes most."""
    per_turn = loop.omega_per_turn
    check_memory("omega_max", (int(min(400.0 * end / per_turn, 1e18)),), 64)
    first = np.arange(0.0, min(4.0 * per_turn, end), per_turn / 2000.0)
    whole = np.arange(0.0, end, per_turn / 400.0)
    return np.concatenate((np.geomspace(start, end, 1000), first, whole))


def _turn_beyond(loop: Loop, last: complex, end: float) -> float:
    """Argument that 1 + L gathers from j `end`, where it is `last`, to infinity and back.

    1 + L is D / A times A / R. From `end` on |D / A - 1| < 1, up the axis and along the arc at
    infinity, on which D / A tends to one: its argument at `end` is taken back. Those of A and R
    are known from their roots. The two are of one degree, and turn alike along the arc.
    """
    gathered = argument_at(loop.polynomials()[0].roots, end) - argument_at(loop.roots_of_a, end)
    ratio = loop.a[-1] / loop.rest[-1] * np.exp(-1j * gathered)
    return float(gathered - np.angle(last / ratio))


def nyquist(
    loop: Loop, c1: float = 1.0, c2: float = 1.0, *, omega_max: float | None = None
) -> NyquistCurve:
    r"""Trace the Nyquist curve and count its encirclements of -1.

    .. math::

        Z = N + P , \quad N = -\frac{1}{2\pi} \oint \mathrm{d} \arg(1 + L) ,

    with Z zeros and P poles of 1 + L inside the contour, which is passed clockwise.

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float, optional
        Multiplicative perturbations.
    omega_max : float, optional
        Trace at least up to this frequency in rad/s, with samples close enough to draw. The
        count needs neither.

    Returns
    -------
    NyquistCurve

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, an argument is not finite and real, `omega_max` is not
        positive, or L has poles on the imaginary axis elsewhere than at s = 0.
    CountError
        If the curve passes through -1, the loop's high-frequency chain is not confined, the
        curve takes too many samples, or the encirclements and the independent count of roots
        disagree.

    Notes
    -----
    Z counts the zeros of 1 + L. A root at s = 0 that D has because a pole of L cancels there
    is none of them, see `armlock.stability.counts.loop_count`.

    Examples
    --------
    >>> from armlock import SingleArm
    >>> from armlock.stability.nyquist import nyquist
    >>> curve = nyquist(SingleArm(), c1=1.001)
    >>> curve.encirclements, curve.open_loop_poles, curve.closed_loop_roots
    (1, 0, 1)
    """
    loop, c1, c2 = point = LoopAt.of(loop, c1, c2)
    poles = open_loop_poles(loop)
    order = point.poles_at_zero()
    end = float(last_frequency(loop, c1, c2))

    def refused(why: str) -> CountError:
        where = f"(c1, c2) = ({c1}, {c2})"
        return CountError(f"no Nyquist count at {where}: {why}", np.array([[c1, c2]]))

    if not np.isfinite(end):
        raise refused("the loop's high-frequency chain of roots is not confined")
    radius = point.leading_radius()
    end = max(1.05 * end, 10.0 / loop.longest_delay, 10.0 * radius)
    if omega_max is not None:
        end = max(end, positive_number("omega_max", omega_max))
    grid = _resolving_grid(loop, c1, c2, end)
    if omega_max is not None:
        grid = np.union1d(grid, _drawing_grid(loop, radius, end))
    omega = np.concatenate(([radius], grid[(grid > radius) & (grid < end)], [end]))
    arc = radius * np.exp(0.5j * np.pi * np.linspace(0.0, 1.0, 64))
    contour = loop.open_loop(np.concatenate((arc[:-1], 1j * omega)), c1, c2)
    turned = np.angle((1.0 + contour[1:]) / (1.0 + contour[:-1]))
    if np.abs(turned).max() > _MOST_TURN:
        raise refused("the curve passes through -1")
    # Half of the contour, for omega >= 0, in the direction of ascending omega.
    turns = (float(turned.sum()) + _turn_beyond(loop, 1.0 + contour[-1], end)) / np.pi
    encirclements = -round(turns)
    count = encirclements + poles
    expected = loop_count(loop, c1, c2)
    if expected != count:
        raise refused(
            f"{encirclements} encirclements and {poles} open-loop poles against {expected} "
            "roots"
        )
    indented = slice(arc.size if order else 0)
    return NyquistCurve(
        omega=omega,
        response=contour[arc.size - 1 :],
        indentation=arc[indented],
        indentation_response=contour[indented],
        pole_order=order,
        encirclements=encirclements,
        open_loop_poles=poles,
        closed_loop_roots=count,
    )


def axis_crossings(
    loop: Loop, c1: float = 1.0, c2: float = 1.0, *, omega_max: float | None = None
) -> AxisCrossings:
    r"""Find every crossing of the negative real axis by the Nyquist curve.

    .. math::

        \mathrm{Im}\, L(\mathrm{j}\omega) = 0 , \qquad \mathrm{Re}\, L(\mathrm{j}\omega) < 0

    Parameters
    ----------
    loop : Loop
        The loop.
    c1, c2 : float, optional
        Multiplicative perturbations.
    omega_max : float, optional
        Highest frequency in rad/s. By default where |L| has fallen below 1e-3 for good; a
        loop whose |L| does not fall needs it.

    Returns
    -------
    AxisCrossings

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, an argument is not finite and real, `omega_max` is not positive,
        or not given where |L| does not fall below 1e-3, or L has poles on the imaginary axis
        elsewhere than at s = 0.
    CountError
        If there are too many crossings to be found.

    Notes
    -----
    Zeros of Im L at omega > 0, found with certified steps: none is missed, however close to
    another. Where L(0) is finite the whole curve also meets the axis there.

    Examples
    --------
    >>> from armlock import axis_crossings, paper_loop
    >>> for omega, value in zip(*vars(axis_crossings(paper_loop(), omega_max=0.2)).values()):
    ...     print(f"{omega:.2e} rad/s: {value:.2f}")
    4.91e-06 rad/s: -0.15
    5.63e-05 rad/s: -5.13
    1.96e-04 rad/s: -113.07
    """
    loop, c1, c2 = point = LoopAt.of(loop, c1, c2)
    open_loop_poles(loop)
    if omega_max is None:
        factors = np.array([1.0 + abs(c1), 1.0 + abs(c2)]) / 1e-3
        omega_max = last_larger(loop.rest, (loop.b1, loop.b2), factors)
        if not np.isfinite(omega_max):
            raise ValueError(
                "omega_max must be given for a loop whose |L| does not fall to zero at high "
                "frequency"
            )
    else:
        omega_max = positive_number("omega_max", omega_max)
    crossing = point.numerator().times_conjugate(loop.rest_on_boundary())
    omega, jump, _ = sign_changes(crossing, [(0.0, omega_max)])
    omega = omega[(omega > 0.0) & (jump != 0)]
    value = point.response(omega).real
    return AxisCrossings(omega[value < 0.0], value[value < 0.0])
