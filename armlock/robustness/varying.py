"""How far the factors of the arms may vary in time, and how far they may differ.

D changes by - sum_k eta_k B_k exp(-s theta_k). The loop stays stable for all eta_k(t) within a
radius if the small-gain theorem holds with constant scalings (Lemma 22). One polynomial f with
|f|^2 >= sum |B_k|^2 on the axis, a spectral factor, reduces this to the peak gain of f / D.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import flint
import numpy as np
import numpy.typing as npt
from flint import fmpq, fmpq_poly

from armlock.checks import FloatArray, real_number
from armlock.engine import chain, decide
from armlock.engine.decide import Family
from armlock.engine.functions import Function, Space, at, common_zeros, stacked
from armlock.engine.inclusion import VERTEX
from armlock.engine.polynomials import (
    Polynomial,
    enclosed_roots,
    exact,
    of_roots,
    on_axis,
    polynomial,
)
from armlock.engine.tolerances import UndecidedError
from armlock.loops import checked_loop
from armlock.robustness.many import many
from armlock.robustness.margins import first_zero, least_ratio
from armlock.stability.counts import decided, require_stable
from armlock.tables import Table, as_html, as_text, number
from armlock.tables import at as where

# The radius is certified to this share, and the scalings are optimal to it.
_TOLERANCE = 1e-7
# Most scalings that are tried.
_MOST_SCALINGS = 40
# Larger constant perturbations are not looked at.
_FARTHEST = 1e9
# By how much a spectral factor is made larger, until it is one in exact arithmetic.
_ENLARGED = (1e-13, 1e-11, 1e-9, 1e-8)


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
            ("factors that vary", number(self.radius), where(self.omega)),
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


@many
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
    affine, point = loop.affine, [real_number(k, v) for k, v in given.items()]
    n, m = affine.quotient(*point)
    d, changes = n + m, affine.terms[1:]
    with decided("no radius", np.array(point)):
        require_stable(d, common_zeros(n, m))
        radius, omega, scalings = varying_radius_of(d, changes)
        constant = constant_radius_of(d, changes, radius) if radius else 0.0
    return VaryingRadius(
        radius, constant, omega, tuple(scaling / scalings[0] for scaling in scalings)
    )


def _exact_polynomial(function: Function) -> fmpq_poly:
    """Return B of a function B exp(-s theta), exactly."""
    found = fmpq_poly()
    for weight, p in zip(function.steady, function.space.polynomials, strict=True):
        if weight:
            found += weight * p.exact
    return found


def _fraction(value: flint.arb) -> fmpq:
    """Return the middle of a ball, exactly."""
    mantissa, exponent = value.mid().man_exp()
    return mantissa * fmpq(2) ** int(exponent)


def _is_positive(p: fmpq_poly) -> bool:
    """Tell whether a polynomial is positive for all arguments from zero on."""
    if p(0) <= 0 or p.leading_coefficient() < 0:
        return False
    # Real roots have an imaginary part of exactly zero.
    return not any(root.imag == 0 and not root.real < 0 for root, _ in enclosed_roots(p))


def spectral_factor(parts: Sequence[fmpq_poly], weights: Sequence[fmpq]) -> Polynomial:
    """Return f with |f|^2 >= sum_k weights_k |B_k|^2 on the axis, and next to no more.

    Parameters
    ----------
    parts : sequence of fmpq_poly
        The B_k, not zero.
    weights : sequence of fmpq
        Positive.

    Raises
    ------
    UndecidedError
        If roots in double precision give none: the B_k nearly have a common zero on the axis.
    """
    common = parts[0]
    for p in parts[1:]:
        common = common.gcd(p)
    whole = fmpq_poly()
    for p, weight in zip(parts, weights, strict=True):
        whole += weight * on_axis(p / common, p / common)
    # Without a common factor the sum is positive on the whole axis.
    roots = []
    for x, order in enclosed_roots(whole):
        if x.imag < 0:
            continue
        s = -complex((-x).sqrt())
        roots += ([complex(s.real)] if x.imag == 0 else [s, s.conjugate()]) * order
    lead = _fraction(flint.arb(whole.leading_coefficient()).sqrt())
    for more in _ENLARGED:
        f = of_roots(roots) * (lead * (1 + exact(more)))
        if _is_positive(on_axis(f, f) - whole):
            return Polynomial.of(f * polynomial(common))
    raise UndecidedError("rounding does not decide the sum of the squares of what varies")


def _beside(d: Function, f: Polynomial) -> tuple[Function, Function]:
    """Return D and a polynomial as functions of one space."""
    space = Space([*d.space.polynomials, f], d.space.lags, d.space.step)
    none = np.zeros((1, d.delayed.shape[1]), object)
    zero, steady = np.array([fmpq(0)], object), np.zeros(len(space.polynomials), object)
    steady[-1] = fmpq(1)
    delayed = np.concatenate((d.delayed, none))
    return (
        Function(space, np.append(d.steady, zero), delayed),
        Function(space, steady, np.zeros_like(delayed)),
    )


def _best_scalings(squares: FloatArray) -> tuple[FloatArray, float]:
    """Minimise sum d_k^2 times the largest row of sum_k squares_k / d_k^2; d and the minimum.

    With x_k = log d_k^2 this is a convex problem: minimise log sum exp x_k plus the largest
    log sum_k squares_k exp(-x_k).
    """
    number = squares.shape[1]

    def rows(x: FloatArray) -> FloatArray:
        found: FloatArray = np.log(squares @ np.exp(-x))
        return found

    # Importing scipy.optimize takes as long as importing this package.
    from scipy import optimize

    def whole(z: FloatArray) -> float:
        return float(np.log(np.exp(z[:-1]).sum()) + z[-1])

    start = np.append(np.zeros(number), rows(np.zeros(number)).max())
    limits = [(0.0, 0.0), *[(-40.0, 40.0)] * (number - 1), (None, None)]
    below = {"type": "ineq", "fun": lambda z: z[-1] - rows(z[:-1])}
    z = optimize.minimize(
        whole, start, bounds=limits, constraints=below, options={"ftol": 1e-15}
    ).x
    x = z[:-1]
    return np.exp(0.5 * x), math.exp(np.log(np.exp(x).sum()) + rows(x).max())


def varying_radius_of(
    d: Function, changes: Sequence[Function]
) -> tuple[float, float, tuple[float, ...]]:
    """Find a radius of varying perturbations that is certified, scalings optimised (Lemma 22).

    Parameters
    ----------
    d : Function
        D at the constant point, whose zeros all have a negative real part, but for those at
        s = 0 that are no roots of the loop.
    changes : sequence of Function
        The B_k exp(-s theta_k) by which D changes.

    Raises
    ------
    UndecidedError
        If double precision, or the steps allowed, do not decide it.
    """
    acting = [k for k, change in enumerate(changes) if not change.is_zero]
    if not acting:
        return math.inf, math.nan, (1.0,) * len(changes)
    at_zero = [lead.order for k in acting if (lead := changes[k].leading())]
    lead = d.leading()
    if lead is None or lead.order > min(at_zero, default=0):
        # A root at s = 0 that is hidden at the constant point moves with any perturbation.
        return 0.0, 0.0, (1.0,) * len(changes)
    parts = [_exact_polynomial(changes[k]) for k in acting]
    best: tuple[float, float, tuple[float, ...]] = 0.0, math.nan, ()
    scalings = np.ones(len(acting))
    squares = np.zeros((0, len(acting)))
    for _ in range(_MOST_SCALINGS):
        sizes = [exact(size) ** 2 for size in scalings.tolist()]
        f = spectral_factor(parts, [sum(sizes) / size for size in sizes])
        _, radius, omega = least_ratio(*_beside(d, f), tolerance=_TOLERANCE)
        if radius > best[0]:
            spread = np.ones(len(changes))
            spread[acting] = scalings
            best = radius, omega, tuple(spread.tolist())
        if not 0.0 < omega < math.inf:
            # There all magnitudes are those of leading or of highest coefficients.
            values = _limits(d, [changes[k] for k in acting], lead.order, omega)
        else:
            values = np.abs(at([d, *(changes[k] for k in acting)], omega))
        squares = np.vstack((squares, (values[1:] / values[0]) ** 2))
        scalings, least = _best_scalings(squares)
        # No other scalings do better at these frequencies than one over the root of this.
        if best[0] * math.sqrt(least) >= 1.0 - 5.0 * _TOLERANCE:
            break
    return best


def _limits(d: Function, changes: Sequence[Function], order: int, omega: float) -> FloatArray:
    """Magnitudes of D, the least one, and of changes, at s = 0 or at high frequency."""
    if omega == 0.0:
        values = [f.series(order + 1)[order] for f in (d, *changes)]
        return np.array([abs(float(value / values[0])) for value in values])
    whole, turned = d.space.limits(*stacked([d, *changes]))
    sizes: FloatArray = np.abs(whole) + np.abs(turned).sum(axis=1)
    sizes[:1] = chain.reserve(whole[:1], turned[:1])
    return sizes


def constant_radius_of(d: Function, changes: Sequence[Function], below: float) -> float:
    """Find the largest size of constant perturbations up to which no root reaches the axis.

    Parameters
    ----------
    d, changes : Function, sequence of Function
        As `varying_radius_of` takes them.
    below : float
        A size up to which no root does: a radius of varying perturbations.

    Returns
    -------
    float
        All |eta_k| below it, by more than a part in a million, leave the loop stable. At this
        size one does not, or double precision does not decide it. Infinite if none up to 1e9
        does.

    Raises
    ------
    UndecidedError
        If a search takes too many steps.
    """
    signs = list(itertools.product((1.0, -1.0), repeat=len(changes)))
    rays = [
        sum((f * sign for f, sign in zip(changes, way, strict=True)), d * 0) for way in signs
    ]
    above = min(first_zero(d, g, _FARTHEST, 0.0)[0] for g in rays)

    def excludes(size: float) -> bool:
        hull = [
            (VERTEX, (1.0, *(sign * size for sign in way)), (0.0,) * (1 + len(changes)))
            for way in signs
        ]
        return decide.excludes(Family([d, *changes], [hull]))

    if below >= _FARTHEST or excludes(above * (1.0 - 1e-6)):
        return math.inf if max(below, above) >= _FARTHEST else above
    while above > below * (1.0 + 1e-6):
        middle = math.sqrt(below * above)
        below, above = (middle, above) if excludes(middle) else (below, middle)
    return above
