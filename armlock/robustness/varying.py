"""The radius of perturbations that vary in time, and beside it that of constant ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armlock.affine import Affine, common
from armlock.checks import real_number
from armlock.engine.margins import require_stable
from armlock.engine.varying import constant_radius_of, varying_radius_of
from armlock.stability.counts import decided, require_certain
from armlock.systems import System


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


def varying_radius(loop: System, *values: float, **numbers: float) -> VaryingRadius:
    r"""Find how far factors c_k(t) may vary, in any way, without making a loop unstable.

    With the sensitivity S at the constant point and :math:`G_k = S K m_k`, the loop is stable
    for all :math:`|c_k(t) - c_k| \le r` if, for some numbers :math:`d_k`,

    .. math::

        r^2 \sum_k d_k^2 \, \sum_k |G_k|^2 / d_k^2 < 1 \quad \text{at every frequency.}

    Parameters
    ----------
    loop : System
        The open loop, a `Loop` or another one whose parameters are factors of delayed copies of
        the loop's signal. Its delays are constant.
    *values, **numbers : float, optional
        The constant point: the parameters, in the order of their first use or by name; nominal
        ones by default.

    Returns
    -------
    VaryingRadius
        The radius is certified from below. No other d makes it larger by more than a part in a
        million, as far as a search tells, or than rounding at high frequency hides, at most a
        thousandth.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no system, has no parameter or is not affine in them, a parameter is not
        finite and real or multiplies more than one delayed polynomial, or the loop is not
        stable there: the message has the count, or says that the neutral root chain is not
        confined.
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
    system = System.of(loop, "loop")
    given = {k: real_number(k, v) for k, v in system.given(values, numbers).items()}
    if not given:
        raise ValueError(f"loop must have a parameter that varies, got {system!r}")
    affine, point = Affine.of(system), list(given.values())
    require_certain(system, point)
    n, m = affine.quotient(*point)
    d, changes = n + m, affine.terms[1:]
    with decided("no radius", np.array(point)):
        require_stable(d, common(n, m))
        radius, omega, scalings = varying_radius_of(d, changes)
        constant = constant_radius_of(d, changes, radius) if radius else 0.0
    return VaryingRadius(
        radius, constant, omega, tuple(scaling / scalings[0] for scaling in scalings)
    )
