"""Characteristic roots: the rightmost one, found, polished and certified.

How many roots lie right of a line Re s = sigma is the count of `unstable_roots` for
D(s + sigma). So the rightmost root is enclosed between a line with roots right of it and one
without. Newton's method finds it from the points of such a line that are nearest to a root,
and goes on in extended precision; a last count says that no root lies further right.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import overload

import mpmath
import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock.axis.contour import resolved_grid
from armlock.axis.exponentials import EPSILON
from armlock.characteristic import CharacteristicFunction, broadcast_parameters, checked_system
from armlock.checks import (
    ComplexArray,
    FloatArray,
    complex_array,
    real_number,
    whole_number,
)
from armlock.loops import power_series
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import BOUNDARY, CountError, unstable_roots

# Real parts that differ by less count as equal; relative to |s| or one over the longest delay.
_EQUAL = 1e-11
# How far right of its root the last count may stand, relative to |Re s| or the same.
_FARTHEST = 1e-6
# Longest walk along a line to count, and to look for roots, in turns of the longest delay's
# exponential: a second each.
_LONGEST_COUNT = 1e6
_LONGEST_SEARCH = 1e5
# The search for one root ends once its walks have cost so many steps, some five seconds. A line
# costs its points, and a count that cannot be told the second number.
_ALL_STEPS = 3e6
_DOUBTFUL_COUNT = 5e5
# Most points of one line: where rounding hides D, there would be no end of them.
_MOST_POINTS = 1_000_000
# Roots left of a line may lie further up than those right of it. They are looked for so many
# turns further: few at first, at most so many.
_FURTHER = 4.0
_FURTHEST = 3e4
# Most roots are slow: first looked for within this many times those turns.
_SLOW_ONES = 1e3
# Most points of a line from which Newton's method starts, and most of its steps in extended
# precision: at a multiple root they only shrink by a share.
_MOST_STARTS = 4096
_NEWTON_STEPS = 12
_MOST_STEPS = 100
# Most roots near a line that are tried in extended precision.
_MOST_TRIED = 8
# Most roots that are looked for right of a line.
_MOST_ROOTS = 20_000
# Directions from s = 0 in which slow ones are looked for.
_ANGLES = np.linspace(1.6, np.pi, 8)
# Roots down to so many times one over the longest delay are looked for in steps of their size.
_SLOWEST = 1e-9
# Past this a delayed term is nothing right of a line, and its factor no float.
_VANISHED = 600.0
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


def extended_root(
    system: CharacteristicFunction, x: float, y: float, start: complex, *, digits: int = 40
) -> mpmath.mpc:
    """Follow Newton's method in extended precision.

    Two roots can agree to most digits of a double; their difference is then all rounding.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, or a map; its coefficients are taken as exact.
    x, y : float
        The free parameters.
    start : complex
        Where to start, in rad/s.
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
    >>> from armlock.stability.roots import extended_root
    >>> print(nstr(extended_root(HayesEquation(), 0.0, -0.2, -0.26, digits=40).real, 30))
    -0.259171101819073764476637135967
    """
    name1, name2 = checked_system(system).parameters
    x, y = real_number(name1, x), real_number(name2, y)
    digits = whole_number("digits", digits, 1)
    # Next to s = 0 the terms of D cancel, and take as many digits with them.
    with mpmath.workdps(digits + _GUARD_DIGITS):
        s = mpmath.mpc(complex(complex_array("start", start)[()]))
        point = mpmath.mpf(x), mpmath.mpf(y)
        for _ in range(_MOST_STEPS):
            value, slope = system.with_slope(s, *point, mpmath)
            if value == 0:
                return +s
            if slope == 0:
                break
            move = value / slope
            s -= move
            # To a root at zero, of which the digits never settle, the method goes straight.
            if abs(s) < mpmath.eps**2:
                s = mpmath.mpc(0)
            elif abs(move) <= mpmath.mpf(10) ** -digits * abs(s):
                with mpmath.workdps(digits):
                    return +s
    raise RootError(
        f"start={start} is not close enough to a root of {system!r}", complex(start)
    )


def _acting(
    system: CharacteristicFunction, x: float, y: float, sigma: float
) -> tuple[CharacteristicFunction, float, float]:
    """Return system and parameters without the delays that do not matter right of a line.

    Their exponentials may be no floats, and zero times infinity is no number.
    """
    values, delays = [x, y], [system.tau1, system.tau2]
    if delays[0] == delays[1] and not poly.polyadd(x * system.b1, y * system.b2).any():
        values = [0.0, 0.0]
    for k, b in enumerate((system.b1, system.b2)):
        if not b.any() or sigma * delays[k] > _VANISHED:
            values[k] = 0.0
    acting = [delay for delay, value in zip(delays, values, strict=True) if value]
    if not any(acting) and not system.delay:
        left = poly.polysub(system.a, values[0] * system.b1)
        left = poly.polysub(left, values[1] * system.b2)
        nothing, values = [0.0], [0.0, 0.0]
        none = {"b1": nothing, "b2": nothing, "tau1": 0.0, "tau2": 0.0}
        system = system.plain().replace(rest=left, **none)
    elif set(acting) != {system.tau1, system.tau2}:
        # Before a parameter of zero any delay will do.
        delay = acting[0] if acting else 0.0
        system = system.plain().replace(tau1=delay, tau2=delay)
    return system, values[0], values[1]


class _Line:
    """The line Re s = sigma: how many roots lie right of it, and which lie near it.

    Attributes
    ----------
    turns : float
        How far up roots can lie right of the line, in turns of the longest delay's
        exponential; inf past the limit of a neutral root chain, or where a number overflows.
    steps : float
        What its walks have cost so far.
    """

    def __init__(
        self, system: CharacteristicFunction, x: float, y: float, sigma: float
    ) -> None:
        self.system, self.x, self.y = _acting(system, x, y, sigma)
        self.sigma = sigma
        delayed = self.system if self.system.longest_delay else system
        self.per_turn = delayed.omega_per_turn
        try:
            self.shifted = self.system.shifted(sigma)
            self.turns = float(last_frequency(self.shifted, self.x, self.y)) / self.per_turn
        except ValueError:
            self.turns = np.inf
        self.known, self.steps = self.turns <= _LONGEST_COUNT, 0.0

    def count(self) -> int:
        """Count the roots right of the line; below zero where that cannot be told."""
        if not self.known:
            return BOUNDARY
        try:
            found = int(unstable_roots(self.shifted, self.x, self.y))
        except CountError:
            found = BOUNDARY
        self.steps += self.turns if found >= 0 else _DOUBTFUL_COUNT
        return found

    def _step(self, s: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Return where a step of Newton's method leads from each s, and its length."""
        with np.errstate(all="ignore"):
            value, slope = self.system.with_slope(s, self.x, self.y)
            move = np.where(value == 0.0, 0.0, value / slope)
        length = np.abs(move)
        return s - move, np.where(np.isnan(length), np.inf, length)

    def search(self, further: float) -> float:
        """Return up to how many turns roots near the line are looked for."""
        if not self.known:
            return 0.0
        if self.system.step:
            return self.turns
        return min(self.turns, _SLOW_ONES * further, _LONGEST_SEARCH) + further

    def near(self, turns: float, most: int) -> tuple[ComplexArray, FloatArray]:
        """Follow Newton's method to roots near the line; return them and the last steps.

        Up to so many turns, from those `most` starts whose first step leads furthest right.
        """
        whole = self.shifted.sum_at(self.x, self.y).compiled()
        s = self.sigma + 1j * resolved_grid(whole, turns * self.per_turn, 1.0, _MOST_POINTS)
        self.steps += s.size
        # From where a step of Newton's method is locally shortest: no root close to the line
        # lies between two of its points.
        # Part by part, because arrays of millions would spend their time on memory.
        parts = np.array_split(s, 1 + s.size // 2**15)
        s, length = map(np.concatenate, zip(*map(self._step, parts), strict=True))
        wider = np.pad(length, 1, constant_values=np.inf)
        s = s[(length <= wider[:-2]) & (length < wider[2:])]
        return self.followed(s[np.argsort(-s.real, kind="stable")][:most], _NEWTON_STEPS)

    def followed(self, s: ComplexArray, steps: int) -> tuple[ComplexArray, FloatArray]:
        """Follow Newton's method; return where it leads, in the upper half, and the last steps."""
        length = np.empty(s.size)
        for _ in range(steps):
            s, length = self._step(s)
        return s.real + 1j * np.abs(s.imag), length

    def rightmost(self, further: float) -> tuple[complex, float] | None:
        """Return the rightmost root near the line, and how far a faster one is ahead of it.

        Of roots that count as equal it is the slowest.
        """
        turns = self.search(further)
        if not turns:
            return None
        found, length = self.near(turns, _MOST_STARTS)
        found = found[length <= 1e-5 * self.per_turn]
        unit = self.per_turn / (2.0 * np.pi)
        for top in sorted(found, key=lambda s: -s.real)[:_MOST_TRIED]:
            equal = found[found.real >= top.real - _EQUAL * max(abs(top), unit)]
            slowest = equal[np.argmin(equal.imag)]
            try:
                root = _polished(self.system, self.x, self.y, slowest)
            except RootError:
                continue
            return root, float(top.real - slowest.real)
        return None


def roots_right_of(
    system: CharacteristicFunction, x: float, y: float, sigma: float
) -> ComplexArray:
    """Find all characteristic roots right of a line Re s = sigma, but for those at s = 0.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, with polynomials in s.
    x, y : float
        The free parameters.
    sigma : float
        Where the line is, in rad/s; negative.

    Returns
    -------
    complex array, shape (n,)
        In rad/s, ascending in magnitude; of pairs those with Im s > 0. With their conjugates,
        and the roots that D has exactly at s = 0, they are as many as a certified count says.

    Raises
    ------
    RootError
        If there is no such count, if there are too many roots, or not all are found.

    Examples
    --------
    >>> from armlock import HayesEquation
    >>> from armlock.stability.roots import roots_right_of
    >>> len(roots_right_of(HayesEquation(tau=1.0), 0.0, -1.0, -3.0))
    4
    """
    line = _Line(system, x, y, sigma)
    wanted = line.count()
    if wanted < 0 or wanted > _MOST_ROOTS:
        why = "their number cannot be told" if wanted < 0 else f"there are {wanted}"
        raise RootError(f"the roots right of {sigma} rad/s are not found: {why}", complex(sigma))
    wanted -= _order_at_zero(system, x, y)
    unit, found, number = line.per_turn / (2.0 * np.pi), np.empty(0, dtype=np.complex128), 0
    for s, length in _all_near(line, unit):
        kept = (length <= 1e-10 * np.abs(s)) & (np.abs(s) > 1e-13 * unit) & (s.real > sigma)
        found = _distinct(np.concatenate((found, s[kept])))
        number = found.size + np.count_nonzero(found.imag)
        if number == wanted:
            return found[np.argsort(np.abs(found))]
    raise RootError(
        f"of {wanted} roots right of {sigma} rad/s only {number} are found", complex(sigma)
    )


def _all_near(line: _Line, unit: float) -> Iterator[tuple[ComplexArray, FloatArray]]:
    """Yield where Newton's method leads, and its last steps, until all walks are too long."""
    # Slow roots lie close to each other, anywhere around zero.
    sizes = unit * np.geomspace(_SLOWEST, 4.0, 200)
    yield line.followed(np.outer(sizes, np.exp(1j * _ANGLES)).ravel(), 40)
    # Others along the line, ever further up, or closer to the axis.
    turns, steps = 0.0, 0.0
    while turns < line.turns:
        turns = min(8.0 * max(turns, _FURTHER), line.turns)
        for share in (1.0, 0.3, 0.1, 0.0):
            one = _Line(line.system, line.x, line.y, share * line.sigma)
            yield one.near(turns, 2 * _MOST_ROOTS)
            steps += one.steps
            if steps > _ALL_STEPS:
                return


def _order_at_zero(system: CharacteristicFunction, x: float, y: float) -> int:
    """How many roots D has exactly at s = 0."""
    whole = zip(*power_series(system, x, y, system.degree + 1), strict=True)
    return next((k for k, pair in enumerate(whole) if sum(pair)), 0)


def _distinct(s: ComplexArray) -> ComplexArray:
    """Return the upper one of each pair, and each root once."""
    s = np.where(np.abs(s.imag) <= 1e-9 * np.abs(s), s.real, s)
    s = s[np.lexsort((s.real, np.abs(s.imag)))]
    kept = np.ones(s.size, dtype=bool)
    # Those that differ by rounding alone are neighbours, or next to one.
    for apart in range(1, 4):
        same = np.abs(s[apart:] - s[:-apart]) <= 1e-7 * np.abs(s[apart:])
        kept[apart:] &= ~same
    return s[kept]


def _polished(system: CharacteristicFunction, x: float, y: float, start: complex) -> complex:
    """Return a root to the last bit, the same for every start; of a pair the upper one."""
    # From a start on the real axis the method would never lead to a pair next to it.
    root = complex(extended_root(system, x, y, start * (1.0 + 1e-9j), digits=20))
    turns = abs(root.imag) > EPSILON * abs(root.real)
    return complex(root.real, abs(root.imag) if turns else 0.0)


def _without_delay(system: CharacteristicFunction, point: tuple[float, float]) -> complex:
    """Return the rightmost root of a system without a delay and without parameters."""
    roots = system.roots_of_a
    if system.step:
        roots = np.log(roots[roots != 0.0]) / system.step
    if roots.size == 0:
        raise ValueError(
            f"{' and '.join(system.parameters)} must leave a loop with roots, got {point}: "
            f"D is {system.a} there"
        )
    return _polished(system, 0.0, 0.0, roots[np.argmax(roots.real)])


def _rightmost(system: CharacteristicFunction, x: float, y: float) -> complex:
    """Find the rightmost root at one point, or raise `RootError`.

    Line after line is tried. Roots near a line are candidates, and a count just right of the
    rightmost of them tells whether it is the one. The counts on the lines enclose it, so that
    the interval between two lines is halved until it is found.
    """
    acting, p, q = _acting(system, x, y, 0.0)
    if acting.longest_delay == 0.0:
        return _without_delay(acting, (x, y))
    unit = 1.0 / acting.longest_delay
    small = _SLOWEST * unit
    best = complex(np.nan, np.nan)
    # There are roots right of `low`, as far as can be told, and none right of `high`.
    low, high, sigma, width, walked = -np.inf, np.inf, 0.0, unit, 0.0
    further = _FURTHER
    while walked < _ALL_STEPS and sigma not in (low, high):
        line = _Line(acting, p, q, sigma)
        root, ahead = line.rightmost(further) or (complex(np.nan, np.nan), 0.0)
        further = min(2.0 * further, _FURTHEST)
        farthest = _FARTHEST * max(abs(root.real), unit)
        # Next to the limit of the chain no count tells that roots lie right of `low`.
        if root.real + farthest > low:
            best = root
            nearest = _EQUAL * max(abs(best), unit)
            for margin in np.geomspace(nearest, max(nearest, farthest), 6):
                right_of_it = _Line(acting, p, q, best.real + ahead + margin)
                count = right_of_it.count()
                walked += right_of_it.steps
                if count == 0:
                    # Another one may lie between the root and the line.
                    between = right_of_it.rightmost(further) if margin > nearest else None
                    if between is not None and between[0].real > best.real + nearest:
                        return between[0]
                    return best
                if count > 0:
                    break
            low = max(low, best.real)
        if sigma > low:
            if line.count() == 0:
                high = sigma
            else:
                low = sigma
        walked += line.steps
        if low > -np.inf and high < np.inf:
            # Roots next to the axis may be slower than the delays by many decades.
            sigma = float(small * np.sinh(0.5 * sum(np.arcsinh(np.array([low, high]) / small))))
        else:
            sigma = low + width if low > -np.inf else high - width
            width *= 4.0
    name1, name2 = system.parameters
    raise RootError(
        f"no rightmost root could be certified at ({name1}, {name2}) = ({x}, {y}); the best "
        f"candidate is {best}",
        best,
    )


@overload
def rightmost_root(
    system: CharacteristicFunction, x: float | None = None, y: float | None = None
) -> complex: ...


@overload
def rightmost_root(
    system: CharacteristicFunction, x: npt.ArrayLike, y: npt.ArrayLike
) -> ComplexArray: ...


def rightmost_root(
    system: CharacteristicFunction,
    x: npt.ArrayLike | None = None,
    y: npt.ArrayLike | None = None,
) -> complex | ComplexArray:
    r"""Return the characteristic root with the largest real part.

    Parameters
    ----------
    system : CharacteristicFunction
        The loop, for instance `CommonArm()`, or a map.
    x, y : array_like of float, optional
        The free parameters; they broadcast. Those of a loop, c1 and c2, are one if they are not
        given; others have to be.

    Returns
    -------
    complex, or complex array of the broadcast shape
        In rad/s, rounded from extended precision; of a conjugate pair the one with Im >= 0.

    Raises
    ------
    TypeError, ValueError
        If x or y is not finite and real, the two do not broadcast, or D has no root at all
        there because it is constant.
    RootError
        If no root can be certified within a few seconds; its `estimate` is the best candidate,
        nan if there is none.

    Notes
    -----
    Certified means that `unstable_roots` counts no root right of Re s + m, with m from 1e-11
    up to 1e-6 times |Re s| or one over the longest delay, whichever is larger; the smallest
    for which there is a count. Roots whose real parts differ by less than 1e-11 of |s| or one
    over the longest delay count as equal, and the one of lowest frequency is returned.

    The real parts on a neutral root chain may tend to a limit that none of them reaches. Where
    no root lies right of it, a root up to m left of the limit is returned.

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
    xs, ys = broadcast_parameters(system, x, y)
    if xs.ndim == 0:
        return _rightmost(system, float(xs), float(ys))
    flat = [
        _rightmost(system, float(p), float(q)) for p, q in zip(xs.flat, ys.flat, strict=True)
    ]
    return np.array(flat, dtype=np.complex128).reshape(xs.shape)
