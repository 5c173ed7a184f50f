"""The open loop on the imaginary axis: Nyquist curve, encirclements, crossings.

The contour goes up the imaginary axis, indented to the right around the pole of L at s = 0,
and back at infinity. The encirclements N = Z - P follow from the certified count Z of unstable
roots and the number P of unstable poles of L. The samples of the curve are for pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from armlock.checks import BoolArray, ComplexArray, FloatArray, positive_number
from armlock.engine import decide
from armlock.engine.functions import (
    Function,
    Space,
    at,
    common_zeros,
    keeps_sign_up_to,
    stacked,
)
from armlock.engine.polynomials import rounded
from armlock.engine.tolerances import EPSILON, STEPS_OF_A_COUNT
from armlock.stability.counts import BOUNDARY, UNCONFINED, CountError, decided, place
from armlock.stability.crossings import crossings, takes_more
from armlock.systems import System
from armlock.tables import Shown, Table, number, spread
from armlock.tables import at as where

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Where |L| is below it no crossing of the negative real axis is of interest, and above the
# other one a pole is on the axis.
_SMALL, _LARGE = 1e-3, 1e12
# To this share L has to agree at both ends of the interval that holds a crossing.
_AGREED = 1e-3
# Crossings that a table shows.
_SHOWN = 10
# The share of a leading term that all others are at most, where a picture begins.
_NEGLIGIBLE = 5e-4


@dataclass(frozen=True, eq=False, repr=False)
class NyquistCurve(Shown):
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

    Examples
    --------
    >>> from armlock import SingleArm, nyquist
    >>> curve = nyquist(SingleArm(), c1=0.999)
    >>> curve.pole_order, curve.closed_loop_roots
    (1, 0)
    """

    pole_order: int
    encirclements: int
    open_loop_poles: int
    closed_loop_roots: int
    # The loop with its parameters, one turn of its delays, and between which frequencies it is
    # drawn.
    _loop: System
    _space: Space
    _per_turn: float
    _start: float
    _end: float

    @cached_property
    def omega(self) -> FloatArray:
        """Frequencies, which are found when they are read; finer at first and at resonances.

        Past a thousand turns of the delays no picture shows one turn beside the next.
        """
        per_turn, start, end = self._per_turn, self._start, self._end
        first = np.arange(0.0, min(4.0 * per_turn, end), per_turn / 2000.0)
        resolved = min(1000.0 * per_turn, end)
        whole = np.arange(0.0, resolved, per_turn / 400.0)
        far = np.geomspace(resolved, end, 100_000) if end > resolved else whole[:0]
        around = self._space.around_roots()
        grids = np.geomspace(start, end, 4000), first, whole, far, around, [end]
        every = np.concatenate(grids)
        return np.unique(every[(every >= start) & (every <= end)])

    @cached_property
    def response(self) -> ComplexArray:
        """L on the axis, which is computed when it is read."""
        return self._loop(1j * self.omega)

    @cached_property
    def indentation(self) -> ComplexArray:
        """The quarter circle around s = 0."""
        angle = 0.5 * np.pi * np.linspace(0.0, 1.0, 64 if self.pole_order else 0)
        return np.asarray(self._start * np.exp(1j * angle))

    @cached_property
    def indentation_response(self) -> ComplexArray:
        """L on the quarter circle."""
        return self._loop(self.indentation)

    def _table(self) -> Table:
        """Show the numbers of the theorem first."""
        rows = [
            ("unstable roots of the closed loop", str(self.closed_loop_roots)),
            ("clockwise turns around -1", str(self.encirclements)),
            ("unstable poles of L", str(self.open_loop_poles)),
            ("order of the pole of L at s = 0", str(self.pole_order)),
            ("frequencies", spread(self.omega, "rad/s")),
        ]
        return Table("Nyquist curve", rows)

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


@dataclass(frozen=True, eq=False, repr=False)
class AxisCrossings(Shown):
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

    def _table(self) -> Table:
        """Show the first crossings, and how many there are."""
        both = list(zip(self.omega.tolist(), self.value.tolist(), strict=True))
        rows = [(f"L = {number(value)}", where(omega)) for omega, value in both[:_SHOWN]]
        return Table(f"{len(both)} crossings of the negative real axis", rows)


def open_loop_poles(m: Function) -> int:
    """Count the poles of L = N / M in the open right half-plane.

    Raises
    ------
    ValueError
        If L has poles on the imaginary axis elsewhere than at s = 0: the contour is indented
        there only. Or if infinitely many poles do not stay left of the axis.
    """
    lead = m.leading()
    count = decide.count(m, lead.order if lead else 0)
    if count == BOUNDARY:
        raise ValueError(
            "the open loop must have no pole on the imaginary axis except at s = 0, got one; "
            "unstable_roots counts such a loop all the same"
        )
    if count == UNCONFINED:
        raise ValueError(
            "the open loop must have finitely many poles on the right, got a chain of them "
            "that is not confined to the left"
        )
    return count


def _leading_radius(n: Function, m: Function) -> tuple[int, float]:
    """Order of the pole of N / M at s = 0, and up to which abs(s) L is as simple as it gets.

    With a pole, L is its leading term to a part in 1000, and |L| is above 1000. Without one L
    is constant to a part in 1000, and so is 1 + L.
    """
    leads = [f.leading(_NEGLIGIBLE) for f in (n, m, n + m)]
    above, below, _ = leads
    radius = min(lead.radius for lead in leads if lead)
    if above is None or below is None or below.order <= above.order:
        return 0, radius
    order = below.order - above.order
    size = abs(float(rounded([above.coefficient / below.coefficient])[0]))
    return order, min(radius, (_SMALL * size) ** (1.0 / order))


def nyquist(
    loop: System,
    *values: float,
    omega_max: float | None = None,
    **numbers: float,
) -> NyquistCurve:
    r"""Return the Nyquist curve for a picture, and its certified encirclements of -1.

    .. math::

        Z = N + P , \quad N = -\frac{1}{2\pi} \oint \mathrm{d} \arg(1 + L) ,

    with Z zeros and P poles of 1 + L inside the contour, which is passed clockwise.

    Parameters
    ----------
    loop : System
        The open loop, for instance `CommonArm()`.
    *values, **numbers : float, optional
        The parameters, in the order of their first use or by name; nominal ones by default.
    omega_max : float, optional
        Sample at least up to this frequency in rad/s.

    Returns
    -------
    NyquistCurve

    Raises
    ------
    TypeError, ValueError
        If `loop` is no open loop, an argument is not finite and real, `omega_max` is not
        positive, or L has poles on the imaginary axis elsewhere than at s = 0.
    CountError
        If the curve passes through -1, the loop's high-frequency chain is not confined, or the
        roots cannot be counted.

    Notes
    -----
    Z does not include a root of D at s = 0 that is there because a pole of L cancels, see
    `armlock.unstable_roots`.

    Examples
    --------
    >>> from armlock import SingleArm
    >>> from armlock.stability.nyquist import nyquist
    >>> curve = nyquist(SingleArm(), c1=1.001)
    >>> curve.encirclements, curve.open_loop_poles, curve.closed_loop_roots
    (1, 0, 1)
    """
    n, m, point = System.of(loop, "loop").open_functions(values, numbers)
    poles = open_loop_poles(m)
    order, radius = _leading_radius(n, m)
    with decided("no Nyquist count", point):
        count = decide.count(n + m, common_zeros(n, m))
    if count < 0:
        chain = "its high-frequency chain of roots is not confined"
        why = chain if count == UNCONFINED else "the curve passes through -1"
        raise CountError(f"no Nyquist count{place(point)}: {why}", point[None])
    last = float(n.space.confined_from(*stacked([n + m]))[0])
    longest = n.space.longest or 1.0 / last
    end = max(1.05 * last, 10.0 / longest, 10.0 * radius)
    if omega_max is not None:
        end = max(end, positive_number("omega_max", omega_max))
    given = System.of(loop)
    return NyquistCurve(
        pole_order=order,
        encirclements=count - poles,
        open_loop_poles=poles,
        closed_loop_roots=count,
        _loop=given.at(**dict(zip(given.parameters, point.tolist(), strict=True))),
        _space=n.space,
        _per_turn=2.0 * np.pi / longest,
        _start=radius,
        _end=end,
    )


def _response(n: Function, m: Function, omega: FloatArray) -> ComplexArray:
    """Evaluate L = N / M on the axis."""
    above, below = at([n, m], omega)
    return np.asarray(above / below)


def axis_crossings(
    loop: System,
    *values: float,
    omega_max: float | None = None,
    **numbers: float,
) -> AxisCrossings:
    r"""Find every crossing of the negative real axis by the Nyquist curve.

    .. math::

        \mathrm{Im}\, L(\mathrm{j}\omega) = 0 , \qquad \mathrm{Re}\, L(\mathrm{j}\omega) < 0

    Parameters
    ----------
    loop : System
        The open loop, for instance `CommonArm()`.
    *values, **numbers : float, optional
        The parameters, in the order of their first use or by name; nominal ones by default.
    omega_max : float, optional
        Highest frequency in rad/s. By default all crossings with |L| above 1e-3 are found; a
        loop whose |L| does not fall below it needs the frequency.

    Returns
    -------
    AxisCrossings

    Raises
    ------
    TypeError, ValueError
        If `loop` is no open loop, an argument is not finite and real, or `omega_max` is not
        positive, or not given where |L| does not fall below 1e-3.
    CountError
        If there are too many crossings to be found, or rounding hides some.

    Notes
    -----
    These are zeros of Im L at omega > 0. Certified steps find them, so none is missed, however
    close to another. A pole on the axis, or a value beyond 1e12, is not a crossing. Where |L|
    is above 1e-3 and rounding may hide a crossing, or its value, `CountError` is raised. Where
    |L| is below it, as where the curve passes through 0, such a crossing is left out.

    Examples
    --------
    >>> from armlock import axis_crossings, paper_loop
    >>> for omega, value in zip(*vars(axis_crossings(paper_loop(), omega_max=0.2)).values()):
    ...     print(f"{omega:.2e} rad/s: {value:.2f}")
    4.91e-06 rad/s: -0.15
    5.63e-05 rad/s: -5.13
    1.96e-04 rad/s: -113.07
    """
    n, m, point = System.of(loop, "loop").open_functions(values, numbers)
    least = 0.0
    if omega_max is None:
        least = _SMALL
        omega_max = float(n.space.confined_from(*stacked([m]), n.sizes / _SMALL)[0])
        if not np.isfinite(omega_max):
            raise ValueError(
                "omega_max must be given for a loop whose |L| does not fall to zero at high "
                "frequency"
            )
    else:
        omega_max = positive_number("omega_max", omega_max)
    begin = keeps_sign_up_to(n, m, odd=True)
    if not begin > 0.0:
        raise CountError(f"no crossings{place(point)}: L is real near s = 0", point[None])
    if begin >= omega_max:
        return AxisCrossings(np.empty(0), np.empty(0))
    too_many = CountError(
        f"no crossings{place(point)}: they take too many steps up to {omega_max:.3g} rad/s, "
        "give a lower omega_max", point[None],
    )  # fmt: skip
    functions = n, n * 0, m
    if takes_more(functions, -_LARGE, -least, begin, omega_max, STEPS_OF_A_COUNT):
        raise too_many
    found = crossings(
        functions, np.zeros(1), np.array([-_LARGE]), np.array([-least]),
        np.array([omega_max]), begin=begin, most=STEPS_OF_A_COUNT,
    )  # fmt: skip
    if found.unfinished.any():
        raise too_many
    told = found.jump != 0
    hidden = ~told & (found.x - found.spread < -_SMALL) & (found.x + found.spread > -_LARGE)
    value = _response(n, m, found.omega).real
    agreed = told & _agree(n, m, found.omega, value)
    hidden |= told & ~agreed & (value < -_SMALL) & (value > -_LARGE)
    if hidden.any():
        why = f"rounding hides some around {found.omega[hidden][0]} rad/s"
        raise CountError(f"no crossings{place(point)}: {why}", point[None])
    kept = agreed & (value < -least) & (value > -_LARGE)
    order = np.argsort(found.omega[kept])
    return AxisCrossings(found.omega[kept][order], value[kept][order])


def _agree(n: Function, m: Function, omega: FloatArray, value: FloatArray) -> BoolArray:
    """Tell whether L is this real value at crossings, where Im L changes its sign next to them.

    The interval in which it does grows from the next floats to a millionth of the frequency.
    """
    found, open_ = np.zeros(omega.size, np.bool_), np.arange(omega.size)
    for width in EPSILON * 8.0 ** np.arange(1, 12):
        below, above = (_response(n, m, omega[open_] * (1.0 + k * width)) for k in (-1, 1))
        between = (below.imag < 0.0) != (above.imag < 0.0)
        near = np.abs(above.real - below.real) <= _AGREED * np.abs(value[open_])
        found[open_] = between & near
        open_ = open_[~between]
    return found
