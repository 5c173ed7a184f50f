"""How far errors of the Doppler estimates pull the locked laser, over days.

An error in the estimated Doppler shift of an arm is a frequency that the loop takes for the
laser's own. Suppression at zero frequency is finite, and so the laser follows, slowly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
import numpy.typing as npt
from scipy.interpolate import AAA

from armlock.checks import ComplexArray, FloatArray, axis, positive_array
from armlock.loops import Loop, checked_loop
from armlock.transfer import transfer

# Multiples of 1 / tau up to which the roots are taken.
_LINES = 40
# Points on the circle around s = 0 from which the Laurent coefficients there are taken.
_CIRCLE = 64
# Highest order of a pole at s = 0.
_ORDER = 8


def pulling(
    loop: Loop,
    time: npt.ArrayLike,
    common: Sequence[float] = (1.0, 0.0, 0.0),
    differential: Sequence[float] = (0.0, 0.0, 0.0),
    method: str = "roots",
) -> FloatArray:
    r"""Compute how a stable loop's laser follows Doppler errors that begin at time zero.

    .. math::

        \nu(t) &= y_+ * \nu_+ + y_- * \nu_- , \\
        \nu_\pm(t) &= \nu_0 + \gamma t + \tfrac12 \alpha t^2 \quad (t \ge 0)

    with the responses :math:`Y_\pm` of `armlock.transfer` to the sum :math:`\nu_+` and the
    difference :math:`\nu_-` of the two arms' errors.

    Parameters
    ----------
    loop : Loop
        The loop, stable at c1 = c2 = 1, or with roots at s = 0 only besides stable ones.
    time : array_like of float
        In s, positive, any shape.
    common, differential : sequence of three floats, optional
        nu0 in Hz, gamma in Hz/s and alpha in Hz/s^2 of the sum and of the difference of the two
        arms' errors. An error of arm 1 alone is the same in both.
    method : {"roots", "laplace"}, optional
        Whether to add up the residues at the loop's own roots, or to invert the Laplace
        transform with `mpmath.invertlaplace` by Talbot's method.

    Returns
    -------
    float array, shaped like `time`
        Frequency of the locked laser in Hz, without what it would do unlocked.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, a time is not positive, an error does not hold three finite
        numbers, or there is no such method.

    Notes
    -----
    Neither method is certified; they share nothing but the transfer function. Both leave out
    what the arms' echoes add at high frequency, lines near multiples of 1/tau: the roots
    beyond 40/tau, Talbot's method beyond some 8/t. In a sensor with nulls there the lines
    decay slowly, and are of the size of nu0.

    Examples
    --------
    >>> from armlock import flight_loop, pulling
    >>> day = 86400.0
    >>> print(f"{pulling(flight_loop(), 4 * day, common=(1e3, 0.0, 0.0)) / 1e6:.3f} MHz")
    0.074 MHz
    """
    checked_loop(loop)
    t = positive_array("time", time)
    if method not in ("roots", "laplace"):
        raise ValueError(f"method must be 'roots' or 'laplace', got {method!r}")
    errors = [_error("common", common), _error("differential", differential)]
    if method == "laplace":
        return _inverted(loop, t, errors)
    roots = slow_roots(loop)
    total = np.zeros(t.shape)
    for source, error in zip(("common", "differential"), errors, strict=True):
        if error.any():
            total += _residues(loop, roots, t, source, error)
    return total


def _error(name: str, values: Sequence[float]) -> FloatArray:
    """Return nu0, gamma and alpha, or raise."""
    error = axis(name, values)
    if error.size != 3:
        raise ValueError(f"{name} must hold nu0, gamma and alpha, got {error.size} numbers")
    return error


def slow_roots(loop: Loop) -> ComplexArray:
    """Find the loop's roots below `_LINES` / tau, of pairs those with Im s > 0.

    A rational function fitted to the response on the imaginary axis has poles near the slow
    roots; the others lie near multiples of 1 / tau. Newton's method polishes both.

    Parameters
    ----------
    loop : Loop
        The loop, at c1 = c2 = 1.

    Returns
    -------
    complex array, shape (n,)
        In rad/s, ascending in magnitude; those at s = 0 are left out.
    """
    tau = max(loop.tau1, loop.tau2)
    omega = np.geomspace(1e-6 / tau, 4.0 / tau, 1200)
    s = np.concatenate((1j * omega, -1j * omega))
    fitted = AAA(s, transfer(loop, "laser", s), rtol=1e-11, max_terms=60).poles()
    slow = fitted[(np.abs(fitted) < 5.0 / tau) & (np.abs(fitted) > 1e-7 / tau)]
    lines = 2j * np.pi / tau * np.arange(0.75, _LINES, 0.25)
    found, last_step = _newton(loop, np.concatenate((slow, lines)))
    found = found[(last_step < 1e-9) & (found.real < 0.0) & (np.abs(found) > 1e-7 / tau)]
    found = np.where(np.abs(found.imag) < 1e-9 * np.abs(found), found.real, found)
    found = found.real + 1j * np.abs(found.imag)
    kept: list[complex] = []
    for root in found[np.argsort(np.abs(found))]:
        if all(abs(root - other) > 1e-7 * abs(root) for other in kept):
            kept.append(complex(root))
    return np.array(kept, dtype=np.complex128)


def _slope(loop: Loop, s: ComplexArray) -> ComplexArray:
    """Return dL/ds as a central difference."""
    near = 1e-5 * np.minimum(np.abs(s), 1.0 / max(loop.tau1, loop.tau2))
    return (_open_loop(loop, s + near) - _open_loop(loop, s - near)) / (2.0 * near)


def _newton(loop: Loop, s: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Follow 1 + L to zeros; return them, and the last steps' relative lengths."""
    tau = max(loop.tau1, loop.tau2)
    with np.errstate(all="ignore"):
        for _ in range(50):
            step = (1.0 + _open_loop(loop, s)) / _slope(loop, s)
            longest = 0.05 * np.minimum(np.abs(s), 1.0 / tau)
            s = s - step * np.minimum(1.0, longest / np.abs(step))
    return s, np.abs(step / s)


def _open_loop(loop: Loop, s: ComplexArray) -> ComplexArray:
    """Evaluate L; nan where Newton's method has gone astray."""
    good = np.isfinite(s)
    value = np.full(s.shape, complex(np.nan, np.nan))
    value[good] = loop.open_loop(s[good])
    return value


def _input(error: FloatArray, s: Any) -> Any:
    """Return the Laplace transform of nu0 + gamma t + alpha t^2 / 2."""
    return error[0] / s + error[1] / s**2 + error[2] / s**3


def _residues(
    loop: Loop, roots: ComplexArray, t: FloatArray, source: str, error: FloatArray
) -> FloatArray:
    """Add up the residues of Y(s) nu(s) exp(s t) at s = 0 and at the loop's own roots."""
    first, second = loop.arm_responses(roots)
    over = 0.5 * (first + second if source == "common" else first - second)
    residue = -over / _slope(loop, roots) * _input(error, roots)
    # Laurent coefficients at s = 0, inside of the smallest root.
    radius = 0.3 * float(np.abs(roots).min(initial=1e-3 / max(loop.tau1, loop.tau2)))
    circle = radius * np.exp(2j * np.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE)
    around = transfer(loop, source, circle) * _input(error, circle)
    laurent = np.array([(around * circle**k).mean().real for k in range(1, _ORDER + 1)])
    size = np.abs(around).max() * radius ** np.arange(1, _ORDER + 1)
    laurent[np.abs(laurent) < 1e-10 * size] = 0.0
    total = sum(c * t**k / math.factorial(k) for k, c in enumerate(laurent))
    pairs = np.where(roots.imag > 0.0, 2.0, 1.0) * residue
    decays = np.exp(t[..., None] * roots)
    return np.asarray(total + (decays @ pairs).real)


def _inverted(loop: Loop, t: FloatArray, errors: list[FloatArray]) -> FloatArray:
    """Invert the Laplace transform at each time, in 30 digits."""
    with mpmath.workdps(30):
        rest, b1, b2 = ([*map(mpmath.mpc, p.roots)] for p in loop.polynomials())
        leads = [mpmath.mpf(float(p.coefficients[-1])) for p in loop.polynomials()]
        tau1, tau2, delay = map(mpmath.mpf, (loop.tau1, loop.tau2, loop.delay))

        def value(lead: Any, roots: list[Any], s: Any) -> Any:
            return mpmath.fprod([lead, *(s - root for root in roots)])

        def transform(s: Any) -> Any:
            dead = mpmath.exp(-s * delay)
            first, second = (
                value(lead, roots, s) * dead
                for lead, roots in zip(leads[1:], (b1, b2), strict=True)
            )
            below = value(leads[0], rest, s)
            below -= first * mpmath.expm1(-s * tau1) + second * mpmath.expm1(-s * tau2)
            plus, minus = (_input(error, s) for error in errors)
            return -((first + second) * plus + (first - second) * minus) / (2 * below)

        values = [
            float(mpmath.invertlaplace(transform, mpmath.mpf(x), method="talbot", degree=40))
            for x in t.ravel()
        ]
    return np.reshape(values, t.shape)
