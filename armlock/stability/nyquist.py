"""The open loop on the imaginary axis: Nyquist curve, encirclements, crossings.

The contour goes up the imaginary axis, indented to the right around the pole of L at s = 0,
and back at infinity. The encirclements N = Z - P follow from the certified count Z of unstable
roots and the number P of unstable poles of L. The samples of the curve are for pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from armlock.checks import (
    ComplexArray,
    FloatArray,
    positive_number,
)
from armlock.loops import Loop, LoopAt
from armlock.stability.bounds import last_frequency, last_larger
from armlock.stability.counts import UNCONFINED, CountError, loop_count
from armlock.stability.zeros import axis_zeros

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Where |L| is below it no crossing of the negative real axis is of interest.
_SMALL = 1e-3


@dataclass(frozen=True, eq=False)
class NyquistCurve:
    """The open loop along the indented Nyquist contour, for omega >= 0.

    Attributes
    ----------
    omega : float array, shape (n,)
        Ascending frequencies in rad/s, from the indentation up, close enough for a picture.
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
        N = Z - P, clockwise turns around -1 of the whole contour, both signs of omega.
    open_loop_poles : int
        P, poles of L in the open right half-plane.
    closed_loop_roots : int
        Z = N + P, the loop's own roots in the right half-plane.
    point : LoopAt
        The loop, c1 and c2.

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
    point: LoopAt

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


def _drawing_grid(loop: Loop, start: float, end: float) -> FloatArray:
    """Frequencies close enough to draw the curve; finer at first, where L changes most.

    Past a thousand turns of the delays no picture shows one turn beside the next.
    """
    per_turn = loop.omega_per_turn
    first = np.arange(0.0, min(4.0 * per_turn, end), per_turn / 2000.0)
    resolved = min(1000.0 * per_turn, end)
    whole = np.arange(0.0, resolved, per_turn / 400.0)
    far = np.geomspace(resolved, end, 100_000) if end > resolved else whole[:0]
    every = np.concatenate((np.geomspace(start, end, 4000), first, whole, far, [end]))
    return np.unique(every[(every >= start) & (every <= end)])


def nyquist(
    loop: Loop, c1: float = 1.0, c2: float = 1.0, *, omega_max: float | None = None
) -> NyquistCurve:
    r"""Return the Nyquist curve for a picture, and its certified encirclements of -1.

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
        Sample at least up to this frequency in rad/s.

    Returns
    -------
    NyquistCurve

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, an argument is not finite and real, `omega_max` is not
        positive, or L has poles on the imaginary axis elsewhere than at s = 0.
    CountError
        If the curve passes through -1, the loop's high-frequency chain is not confined, or the
        roots cannot be counted.

    Notes
    -----
    Z counts the loop's own roots: one at s = 0 that D has because a pole of L cancels there is
    none of them, see `armlock.stability.counts.loop_count`.

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
    count = loop_count(loop, c1, c2)
    if count < 0:
        chain = "its high-frequency chain of roots is not confined"
        why = chain if count == UNCONFINED else "the curve passes through -1"
        where = f"(c1, c2) = ({c1}, {c2})"
        raise CountError(f"no Nyquist count at {where}: {why}", np.array([[c1, c2]]))
    radius, last = point.leading_radius(), float(last_frequency(loop, c1, c2))
    end = max(1.05 * last, 10.0 / loop.longest_delay, 10.0 * radius)
    if omega_max is not None:
        end = max(end, positive_number("omega_max", omega_max))
    omega = _drawing_grid(loop, radius, end)
    arc = radius * np.exp(0.5j * np.pi * np.linspace(0.0, 1.0, 64))[slice(64 if order else 0)]
    return NyquistCurve(
        omega=omega,
        response=loop(1j * omega, c1, c2),
        indentation=arc,
        indentation_response=loop(arc, c1, c2),
        pole_order=order,
        encirclements=count - poles,
        open_loop_poles=poles,
        closed_loop_roots=count,
        point=point,
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
        If there are too many crossings to be found, or rounding hides some.

    Notes
    -----
    Zeros of Im L at omega > 0, found with certified steps: none is missed, however close to
    another. Where rounding may hide one they are refused, but next to a null of L, and where
    |L| is below 1e-3. Where L(0) is finite the whole curve also meets the axis there.

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
        factors = np.array([1.0 + abs(c1), 1.0 + abs(c2)]) / _SMALL
        rest, *arms = (p.coefficients for p in loop.polynomials())
        omega_max = last_larger(rest, (arms[0], arms[1]), factors)
        if not np.isfinite(omega_max):
            raise ValueError(
                "omega_max must be given for a loop whose |L| does not fall to zero at high "
                "frequency"
            )
    else:
        omega_max = positive_number("omega_max", omega_max)
    below = loop.rest_on_boundary()
    crossing, measure = point.numerator().times_conjugate(below), below.times_conjugate(below)
    zeros = axis_zeros(crossing, [(0.0, omega_max)], measure)
    inside = zeros.omega > 0.0
    # A stretch that L = 0 may lie in is taken for a null, next to which L is small.
    hidden = inside & zeros.hidden & ~(zeros.position + zeros.spread > -_SMALL)
    if hidden.any():
        raise CountError(
            f"no crossings at (c1, c2) = ({c1}, {c2}): rounding hides some around "
            f"{zeros.omega[hidden][0]} rad/s",
            np.array([[c1, c2]]),
        )
    omega = zeros.omega[inside & ~zeros.hidden]
    value = point.response(omega).real
    return AxisCrossings(omega[value < 0.0], value[value < 0.0])
