"""The radius of perturbations that vary in time, and beside it that of constant ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armlock.affine import Affine
from armlock.checks import real_number
from armlock.engine.margins import require_stable
from armlock.engine.varying import constant_radius_of, varying_radius_of
from armlock.loops import Loop, checked_loop
from armlock.stability.counts import decided


class VaryingRadius(NamedTuple):
    """How far the factors of the arms may vary in time, and how far they may differ.

    Attributes
    ----------
    radius : float
        All c_k(t) within this distance of their constant values leave the loop stable, however
        fast they vary. 0 where constant perturbations of any size break the loop.
    constant : float
        The smallest size of a constant perturbation (eta_1, eta_2), the larger of the two
        magnitudes, that breaks the loop.
    omega : float
        Frequency in rad/s at which the radius is taken; inf for the limit at high frequency.
    scaling : float
        The number d of the theorem; 1 for a loop with one arm.
    """

    radius: float
    constant: float
    omega: float
    scaling: float


def varying_radius(loop: Loop, c1: float = 1.0, c2: float = 1.0) -> VaryingRadius:
    r"""Find how far c1(t) and c2(t) may vary, in any way, without making a loop unstable.

    With the sensitivity S at the constant point and :math:`G_k = S K m_k`, the loop is stable
    for all :math:`|c_k(t) - c_k| \le r` if, for one number d,

    .. math::

        r^2 \left( 1 + d^2 \right) \left( |G_1|^2 + |G_2|^2 / d^2 \right) < 1
        \quad \text{at every frequency.}

    Parameters
    ----------
    loop : Loop
        The loop, with constant delays.
    c1, c2 : float, optional
        The constant point.

    Returns
    -------
    VaryingRadius
        The radius is certified from below. No other d makes it larger by more than a part in a
        million, as far as the frequencies tell that were looked at.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no Loop, c1 or c2 is not finite and real, or the loop is not stable there:
        the message has the count. A loop whose neutral root chain is not confined is not.
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

    A loop with a root at s = 0 that cancels at the constant point, as an integrator and a
    common-arm sensor have, has the radius zero.

    Examples
    --------
    >>> from armlock import paper_loop, varying_radius
    >>> found = varying_radius(paper_loop())
    >>> print(f"varying: {found.radius:.3e}, constant: {found.constant:.3e}")
    varying: 1.321e-06, constant: 1.464e-06
    """
    affine = Affine.of(checked_loop(loop))
    point = np.array([real_number("c1", c1), real_number("c2", c2)])
    d, arms = affine.function(*point.tolist()), [f * -1 for f in affine.terms[1:]]
    with decided("no radius", point):
        require_stable(d, affine.cancelled(*point.tolist()))
        radius, omega, scalings = varying_radius_of(d, arms)
        constant = constant_radius_of(d, arms, radius) if radius else 0.0
    return VaryingRadius(radius, constant, omega, scalings[1] / scalings[0])
