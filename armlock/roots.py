"""Characteristic roots: the rightmost one, found, polished and certified.

Candidates are eigenvalues of a Chebyshev discretization of the solution operator's
generator (Breda, Maset and Vermiglio). Each is polished by Newton's method on the exact
characteristic function; the rightmost is then certified by counting that no root lies to
the right of it.
"""

from __future__ import annotations

from typing import overload

import mpmath
import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly
from scipy.interpolate import BarycentricInterpolator

from armlock.characteristic import CharacteristicFunction, checked_system
from armlock.checks import (
    ComplexArray,
    FloatArray,
    broadcast_pair,
    complex_array,
    real_number,
    whole_number,
)
from armlock.stability import CountError, last_frequency, unstable_roots
from armlock.statespace import realize

_EPSILON = float(np.finfo(float).eps)
# Degrees of the Chebyshev polynomial that are tried, one after the other.
_DEGREES = (60, 120, 240, 480, 960)
# Most points of a line from which Newton's method starts.
_POINTS_ALONG = 200_000
# Digits that extended precision keeps besides those that are asked for.
_GUARD_DIGITS = 40


class RootError(RuntimeError):
    """No root could be certified as the rightmost one; `estimate` is the best candidate.

    Examples
    --------
    >>> from armlock import CommonArm, RootError, rightmost_root
    >>> try:
    ...     root = rightmost_root(CommonArm(), 1.01, 1.0)
    ... except RootError as error:
    ...     root = error.estimate
    >>> print(f"{root.real:.2e}")
    2.43e-04
    """

    def __init__(self, message: str, estimate: complex) -> None:
        super().__init__(message)
        self.estimate = estimate

    def __reduce__(self) -> tuple[type[RootError], tuple[str, complex]]:
        """Pickle the estimate along, so that the error passes from process to process."""
        return type(self), (str(self), self.estimate)


def _chebyshev(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return the Chebyshev points on [-1, 1], from 1 down, and the differentiation matrix."""
    points = np.cos(np.pi * np.arange(degree + 1) / degree)
    weights = np.ones(degree + 1)
    weights[[0, -1]] = 2.0
    weights *= (-1.0) ** np.arange(degree + 1)
    difference = points[:, None] - points[None, :] + np.eye(degree + 1)
    matrix = np.outer(weights, 1.0 / weights) / difference
    matrix -= np.diag(matrix.sum(axis=1))
    return points, matrix


def pseudospectral_roots(
    system: CharacteristicFunction, x: float, y: float, degree: int
) -> ComplexArray:
    """Approximate the characteristic roots of smallest magnitude, rightmost first.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, in continuous time.
    x, y : float
        The free parameters.
    degree : int
        Degree of the Chebyshev polynomial on the interval of the longest delay. Roots of
        magnitude up to about degree / delay are resolved.

    Returns
    -------
    complex array, shape (degree + order of the equation,)
        Eigenvalues in descending order of real part: approximations, some of them spurious.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, or `degree` is no integer from 2 on.
    """
    degree = whole_number("degree", degree, 2)
    name1, name2 = checked_system(system).parameters
    form = realize(system, real_number(name1, x), real_number(name2, y))
    states = form.state.shape[0]
    # A term without effect would only add spurious eigenvalues.
    delayed = [term for term in form.delayed if term.column.any() or term.direct != 0.0]
    longest = max((term.delay for term in delayed), default=0.0)
    if longest == 0.0:
        eigenvalues = np.linalg.eigvals(form.state).astype(np.complex128)
        return eigenvalues[np.argsort(-eigenvalues.real)]
    points, difference = _chebyshev(degree)
    history = 0.5 * longest * (points - 1.0)
    difference = difference * (2.0 / longest)
    interpolate = BarycentricInterpolator(history, np.eye(degree + 1))
    rows = [interpolate(-term.delay) for term in delayed]
    # xi(0) in terms of the states and the history behind it.
    direct = sum((t.direct * row for t, row in zip(delayed, rows, strict=True)))
    present = np.zeros(states + degree)
    present[:1] = 1.0 if states else 0.0
    present[states:] += np.asarray(direct)[1:]
    present /= 1.0 - np.asarray(direct)[0]
    matrix = np.zeros((states + degree, states + degree))
    matrix[:states, :states] = form.state
    for term, row in zip(delayed, rows, strict=True):
        signal = row[0] * present
        signal[states:] += row[1:]
        matrix[:states] += np.outer(term.column, signal)
    matrix[states:] = np.outer(difference[1:, 0], present)
    matrix[states:, states:] += difference[1:, 1:]
    eigenvalues = np.linalg.eigvals(matrix).astype(np.complex128)
    return eigenvalues[np.argsort(-eigenvalues.real)]


def polish_root(
    system: CharacteristicFunction, x: float, y: float, start: complex
) -> tuple[complex, float]:
    r"""Follow Newton's method on the exact characteristic function.

    .. math::

        s_{i+1} = s_i - \frac{D(s_i; x, y)}{D'(s_i; x, y)}

    Parameters
    ----------
    system : CharacteristicFunction
        The loop.
    x, y : float
        The free parameters.
    start : complex
        Where to start, in rad/s.

    Returns
    -------
    root : complex
        The root.
    error : float
        Length of the last Newton step, an estimate of its error; inf if the residual
        |D(root)| is not down to rounding.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, or `start` not finite.
    """
    name1, name2 = checked_system(system).parameters
    x, y = real_number(name1, x), real_number(name2, y)
    s = complex(complex_array("start", start)[()])
    # Towards a root at s = 0 the steps would only end where the numbers do.
    zero = 0.0
    if system._value(np.zeros((), dtype=np.complex128), x, y) == 0.0:
        zero = _EPSILON**2 * _per_delay(system)
    move = np.inf
    for _ in range(60):
        # A step far to the left overflows; such a start is given up below.
        with np.errstate(over="ignore", invalid="ignore"):
            value = complex(system._value(np.asarray(s), x, y))
            slope = complex(system._slope(np.asarray(s), x, y))
        if value == 0.0:
            return s, 0.0
        if slope == 0.0 or not np.isfinite(value):
            return s, np.inf
        before, move = move, abs(value / slope)
        # Close to a multiple root the steps stop shrinking at the root of the rounding.
        if move >= before and move < 1e-6 * abs(s):
            break
        s -= value / slope
        if abs(s) <= zero:
            return 0j, 0.0
        if move <= _EPSILON * abs(s):
            break
    with np.errstate(over="ignore", invalid="ignore"):
        parts = [
            abs(poly.polyval(abs(s), np.abs(p))) * np.exp(-s.real * delay)
            for p, delay in (
                (system.a, 0.0),
                (x * system.b1, system.delay1),
                (y * system.b2, system.delay2),
            )
        ]
        rounding = 64.0 * _EPSILON * (1.0 + abs(s) * system.longest_delay) * sum(parts)
        residual = abs(complex(system._value(np.asarray(s), x, y)))
    return s, float(move) if residual <= rounding else np.inf


def extended_root(
    system: CharacteristicFunction, x: float, y: float, start: complex, *, digits: int = 40
) -> mpmath.mpc:
    """Follow Newton's method in extended precision.

    Two roots can agree to most digits of a double; their difference is then all rounding, and
    not even the same in every run.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, or a map; its coefficients are taken as exact.
    x, y : float
        The free parameters.
    start : complex
        The root in double precision, in rad/s, for instance from `rightmost_root`.
    digits : int, optional
        Decimal digits to compute with.

    Returns
    -------
    mpmath.mpc
        The root, to about `digits` digits.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, `start` not finite, or `digits` no positive integer.
    RootError
        If `start` is not close enough to a root for Newton's method to settle.

    Examples
    --------
    >>> from mpmath import nstr
    >>> from armlock import HayesEquation
    >>> from armlock.roots import extended_root
    >>> print(nstr(extended_root(HayesEquation(), 0.0, -0.2, -0.26, digits=40).real, 30))
    -0.259171101819073764476637135967
    """
    name1, name2 = checked_system(system).parameters
    x, y = real_number(name1, x), real_number(name2, y)
    digits = whole_number("digits", digits, 1)
    # Next to s = 0 the terms of D cancel, and take as many digits with them.
    with mpmath.workdps(digits + _GUARD_DIGITS):
        s = mpmath.mpc(complex(complex_array("start", start)[()]))
        for _ in range(60):
            z, dz = s, mpmath.mpf(1)
            if system.step:
                z = mpmath.exp(s * system.step)
                dz = system.step * z
            # Both values at once: of the polynomial and of its derivative.
            value, slope = mpmath.polyval(system.rest.tolist(), z, derivative=True, asc=True)
            slope *= dz
            terms = (
                (system.b1, system.delay1, system.reference[0], x),
                (system.b2, system.delay2, system.reference[1], y),
            )
            for b, delay, origin, here in terms:
                p, change = mpmath.polyval(b.tolist(), z, derivative=True, asc=True)
                late = here * mpmath.exp(-s * delay)
                value += p * (origin - late)
                slope += change * dz * (origin - late) + p * delay * late
            if slope == 0:
                break
            move = value / slope
            s -= move
            if abs(move) <= mpmath.mpf(10) ** -digits * abs(s):
                with mpmath.workdps(digits):
                    return +s
    raise RootError(
        f"start={start} is not close enough to a root of {system!r}", complex(start)
    )


def _per_delay(system: CharacteristicFunction) -> float:
    """One over the longest delay, in rad/s; a large number where there is none."""
    return 1.0 / max(system.longest_delay, _EPSILON)


def _resolution(system: CharacteristicFunction, root: complex) -> float:
    """Shift to the right of a root by which a count can tell it from others, in rad/s."""
    return 1e-11 * max(abs(root), _per_delay(system))


def _certified(
    system: CharacteristicFunction, x: float, y: float, root: complex, error: float
) -> bool:
    """Whether no root lies right of `root`, by more than its error."""
    # So far to the right of the axis a delayed term is nothing, and its factor no float.
    x, y = (
        0.0 if root.real * delay > 600.0 and abs(value) < 1e100 else value
        for value, delay in ((x, system.delay1), (y, system.delay2))
    )
    system = _effective(system, x, y)
    resolution = _resolution(system, root)
    margin = max(resolution, 10.0 * error)
    # Farther left than this the shifted function overflows.
    if -root.real * system.longest_delay > 600.0:
        return False
    while margin <= 1e5 * resolution:
        try:
            count = int(unstable_roots(system.shifted(root.real + margin), x, y))
        except (CountError, ValueError):
            # Shifted so far, the coefficients may leave the range of floats.
            return False
        if count >= 0:
            return count == 0
        margin *= 10.0
    return False


def _effective(system: CharacteristicFunction, x: float, y: float) -> CharacteristicFunction:
    """Return the system without the terms whose parameter is zero.

    Far to the left their exponentials overflow, and zero times infinity is no number.
    """
    if system.step or (x != 0.0 and y != 0.0):
        return system
    x0, y0 = system.reference
    rest, none = system.rest, np.zeros(1)
    if x == 0.0:
        rest = np.asarray(poly.polyadd(rest, x0 * system.b1))
    if y == 0.0:
        rest = np.asarray(poly.polyadd(rest, y0 * system.b2))
    return CharacteristicFunction(
        rest,
        system.b1 if x else none,
        system.b2 if y else none,
        system.delay1 if x else 0.0,
        system.delay2 if y else 0.0,
        parameters=system.parameters,
        reference=(x0 if x else 0.0, y0 if y else 0.0),
    )


def _starts_along(
    system: CharacteristicFunction, x: float, y: float, sigma: float
) -> ComplexArray:
    """Roots near the line Re s = sigma, by Newton's method from its points.

    The rightmost come first, and of those that a count cannot tell apart the slowest.

    Roots far up a loop's high-frequency chain lie close to a line, and beyond what a polynomial
    of affordable degree resolves.
    """
    spacing = 0.5 * _per_delay(system)
    try:
        last = float(last_frequency(system.shifted(sigma), x, y))
    except ValueError:
        # So far out the shifted coefficients leave the range of floats.
        return np.empty(0, dtype=np.complex128)
    end = float(np.fmin(last, _POINTS_ALONG * spacing))
    along = np.arange(0.0, end + 2.0 * spacing, spacing)
    s = np.asarray(sigma + 1j * along, dtype=np.complex128)
    with np.errstate(all="ignore"):
        for _ in range(12):
            move = system._value(s, x, y) / system._slope(s, x, y)
            s = s - move
        led = s[(np.abs(move) <= 1e-6 * spacing) & (s.imag >= 0.0)]
    # A real root is approached from the side.
    led = np.where(led.imag <= 1e-12 * np.abs(led.real), led.real, led)
    led = led[np.argsort(led.imag)]
    # Many points lead to the same root.
    led = led[np.abs(np.diff(led, prepend=np.inf)) > 1e-3 * spacing]
    top = led.real.max(initial=-np.inf)
    behind = np.where(led.real >= top - 1e-11 * np.abs(led), 0.0, top - led.real)
    return np.asarray(led[np.argsort(behind, kind="stable")], dtype=np.complex128)


def _rightmost(system: CharacteristicFunction, x: float, y: float) -> complex:
    """Find the rightmost root at one point, or raise `RootError`."""
    system = _effective(system, x, y)
    best = complex(np.nan, np.nan)
    # Where counts overflow no further degree leads to a certificate.
    hopeless = np.isnan(last_frequency(system, x, y))
    for degree in _DEGREES[:1] if hopeless else _DEGREES:
        eigenvalues = pseudospectral_roots(system, x, y, degree)
        starts = eigenvalues[eigenvalues.imag >= 0.0][:12]
        # Another round starts from the line through the best root so far.
        for _ in range(4):
            polished = [polish_root(system, x, y, start) for start in starts]
            found = [(root, error) for root, error in polished if np.isfinite(error)]
            if not found:
                break
            top = max(root.real for root, _ in found)
            # The roots of a neutral chain differ by less than a count can tell: the slowest.
            level = [(r, e) for r, e in found if r.real >= top - _resolution(system, r)]
            root, error = min(level, key=lambda pair: abs(pair[0].imag))
            if not root.real <= best.real:
                best = root
            if _certified(system, x, y, root, error):
                turns = abs(root.imag) > _EPSILON * abs(root.real)
                return complex(root.real, abs(root.imag) if turns else 0.0)
            starts = _starts_along(system, x, y, best.real)[:24]
    name1, name2 = system.parameters
    raise RootError(
        f"no rightmost root could be certified at ({name1}, {name2}) = ({x}, {y}); the best "
        f"candidate is {best}",
        best,
    )


@overload
def rightmost_root(system: CharacteristicFunction, x: float, y: float) -> complex: ...


@overload
def rightmost_root(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> ComplexArray: ...


def rightmost_root(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> complex | ComplexArray:
    r"""Return the characteristic root with the largest real part.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`.
    x, y : array_like of float
        The free parameters; they broadcast.

    Returns
    -------
    complex, or complex array of the broadcast shape
        In rad/s; of a conjugate pair the one with Im >= 0.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, or the two do not broadcast.
    RootError
        If no root passes both checks; its `estimate` carries the best candidate.

    Notes
    -----
    Two checks: the residual |D(s)| is down to rounding, and the count of roots to the right
    of Re s is zero, so that the result agrees with `unstable_roots`. Roots whose real parts
    differ by less than 1e-11 |s|, which a count does not tell apart, as on the chain of a
    neutral loop, count as equal; of them the one of lowest frequency is returned.

    For the Hayes equation it is, with the principal branch of Lambert's function,

    .. math::

        s = a + \frac{1}{\tau} W_0 \left( b\, \tau\, e^{-a\tau} \right) .

    Examples
    --------
    >>> from armlock import HayesEquation, rightmost_root
    >>> root = rightmost_root(HayesEquation(tau=1.0), 0.0, -1.0)
    >>> print(f"{root:.10f}")
    -0.3181315052+1.3372357014j
    """
    name1, name2 = checked_system(system).parameters
    xs, ys = broadcast_pair(name1, x, name2, y)
    if xs.ndim == 0:
        return _rightmost(system, real_number(name1, xs[()]), real_number(name2, ys[()]))
    flat = [
        _rightmost(system, float(p), float(q)) for p, q in zip(xs.flat, ys.flat, strict=True)
    ]
    return np.array(flat, dtype=np.complex128).reshape(xs.shape)
