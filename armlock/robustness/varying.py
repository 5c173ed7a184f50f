"""The radius of perturbations that vary in time, and beside it that of constant ones."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.affine import Affine
from armlock.checks import real_number
from armlock.engine.functions import common_zeros
from armlock.engine.margins import require_stable
from armlock.engine.varying import constant_radius_of, varying_radius_of
from armlock.loops import checked_loop
from armlock.robustness.many import many
from armlock.stability.counts import decided
from armlock.tables import Table, as_html, as_text, at, number


class VaryingRadius(NamedTuple):
    """How far the factors of the arms may vary in time, and how far they may differ.

    Attributes
    ----------
    radius : float
        All c_k(t) within this distance of their constant values leave the loop stable, however
        fast they vary. 0 where constant perturbations of any size break the loop.
    constant : float
        The smallest size of constant perturbations, the largest of their magnitudes, that
        breaks the loop, or for which double precision does not decide it. Infinite if none up
        to 1e9 does.
    omega : float
        Frequency in rad/s at which the radius is taken; inf for the limit at high frequency.
    scalings : tuple of float
        The numbers d_k of the theorem, of which the first is one.
    """

    radius: float
    constant: float
    omega: float
    scalings: tuple[float, ...]

    def _table(self) -> Table:
        """Show both radii, and where the first is taken."""
        rows = [
            ("factors that vary", number(self.radius), at(self.omega)),
            ("constant factors", number(self.constant)),
        ]
        return Table("How far the factors of the arms may be from their values", rows)

    __repr__, _repr_html_ = as_text, as_html  # type: ignore[misc]


_PLACE = (
    "there each factor acts on the delayed signal, before every filter. An expression does not "
    "say where a factor acts, and one that varies in time does not commute with a filter. "
    "Write another gain or filter as loop.replace(controller=...). One factor that multiplies "
    "one signal has the radius 1 / peak_gain(G), with the response G from what the factor adds "
    "to what it multiplies"
)


@many()
def varying_radius(
    loop: Any, *values: npt.ArrayLike, **numbers: npt.ArrayLike
) -> VaryingRadius:
    r"""Find how far factors c_k(t) may vary, in any way, without making a loop unstable.

    Each factor acts on the delayed signal of its arm, before every filter: the arm returns
    :math:`c_k(t)\, x(t - \tau_k)`.

    With the sensitivity S at the constant point and :math:`G_k = S K m_k`, the loop is stable
    for all :math:`|c_k(t) - c_k| \le r` if, for some numbers :math:`d_k`,

    .. math::

        r^2 \sum_k d_k^2 \, \sum_k |G_k|^2 / d_k^2 < 1 \quad \text{at every frequency.}

    Parameters
    ----------
    loop : Loop
        The loop, whose delays are constant, or a list of loops.
    *values, **numbers : float or array_like, optional
        The constant point: the parameters, in the order of their first use or by name; nominal
        ones by default. Lists of loops and arrays broadcast.

    Returns
    -------
    VaryingRadius, or `Many` of lists and arrays
        The radius is certified from below. No other d makes it larger by more than a part in a
        million, as far as a search tells, or than rounding at high frequency hides, at most a
        thousandth.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, a parameter is not finite and real, or the loop is not stable
        there: the message has the count, or says that the neutral root chain is not confined.
    CountError
        If double precision, or the steps allowed, do not decide it.

    See Also
    --------
    armlock.critical_perturbation : the smallest constant perturbation in one direction.

    Notes
    -----
    This is the small-gain theorem: a delay does not change the L2 norm, and a factor of at most
    r in magnitude changes it by at most r (Lemma 22 of the book has the proof, and what
    "stable" means). It says nothing about delays that vary. Below the radius the gain from the
    free to the locked laser is at most that of the constant loop over 1 - r / radius.

    The place of the factors matters. The loop 0.5 (c1 F + c2 F) exp(-s theta), with
    F = 100 / (s + 1) and theta = 1e-6 s, has the radius 1.01 if both factors act before F. With
    c1 behind F and c2 before it, factors that switch by 0.25 together, with a period of 1 ms,
    make it grow.

    A loop with a root at s = 0 that cancels at the constant point, as an integrator and a
    common-arm sensor have, has the radius zero.

    Examples
    --------
    >>> from armlock import paper_loop, varying_radius
    >>> found = varying_radius(paper_loop())
    >>> print(f"varying: {found.radius:.3e}, constant: {found.constant:.3e}")
    varying: 1.321e-06, constant: 1.464e-06
    """
    given = checked_loop(loop, _PLACE).given(values, numbers)
    affine, point = Affine.of(loop), [real_number(k, v) for k, v in given.items()]
    n, m = affine.quotient(*point)
    d, changes = n + m, affine.terms[1:]
    with decided("no radius", np.array(point)):
        require_stable(d, common_zeros(n, m))
        radius, omega, scalings = varying_radius_of(d, changes)
        constant = constant_radius_of(d, changes, radius) if radius else 0.0
    return VaryingRadius(
        radius, constant, omega, tuple(scaling / scalings[0] for scaling in scalings)
    )
