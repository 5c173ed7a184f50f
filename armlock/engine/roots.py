"""The zero of a function with the largest real part, found, polished and certified.

How many zeros lie right of a line Re s = sigma is the count for F(s + sigma). So the rightmost
zero is enclosed between a line with zeros right of it and one without. Newton's method finds it
from the points of such a line that are nearest to a zero, and goes on in extended precision; a
last count says that no zero lies further right.
"""

from __future__ import annotations

from typing import NamedTuple

import mpmath
import numpy as np
from flint import fmpq_poly

from armlock.checks import ComplexArray, FloatArray
from armlock.engine import chain, decide, inclusion
from armlock.engine.chain import UndecidedError
from armlock.engine.decide import BOUNDARY, UNCONFINED
from armlock.engine.functions import Function, Space
from armlock.engine.polynomials import Polynomial

# How far right of the zero that is returned no other one lies: the first share of abs(s), or of
# one over the longest delay, if so fine a count is decided in so few steps. Otherwise it is the
# second share of abs(Re s), or of one over the longest delay. Real parts that differ by less
# than the first count as equal.
_FINEST, _FINE = 1e-11, 1e-6
_FEW_STEPS, _MANY_STEPS = 200_000, 2_000_000
# The search for one zero ends once it has cost so many steps, some five seconds.
_ALL_STEPS = 4e6
# Most points of one line, and from how many of them Newton's method starts.
_MOST_POINTS, _MOST_STARTS = 500_000, 1000
# The line next to the limit of a neutral chain has been searched with so many points.
_ENOUGH_POINTS = 200_000
# A line is followed up to where zeros can lie right of it, and so many turns of the longest
# delay further, but at first no longer than 1000 times that; with each line twice as far.
_TURNS_FURTHER, _MOST_TURNS_FURTHER = 4.0, 3e4
# Steps of Newton's method: in double precision, and most in extended precision, up to so many
# of which may be those for a multiple zero.
_STEPS, _EXTENDED_STEPS, _MULTIPLE_STEPS = 12, 100, 50
# Most zeros near a line that are tried in extended precision.
_MOST_TRIED = 8
# Zeros down to so many times one over the longest delay are looked for in steps of their size.
_SLOWEST = 1e-9
# So many times one over the longest delay left of the axis an exponential is no float.
_LARGEST_EXPONENT = 600.0
# Digits of a zero, and those that cancelling terms and multiple zeros take besides.
_DIGITS, _GUARD_DIGITS = 20, 80


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


def _polished(function: Function, common: int, start: complex) -> complex | None:
    """Follow Newton's method for F / s^common in extended precision to a zero.

    Of a pair it is the upper one. None if the method does not settle.
    """
    with mpmath.workdps(_DIGITS + _GUARD_DIGITS):
        # From a start on the real axis the method would never lead to a pair next to it.
        s, last = mpmath.mpc(start) * (1 + 1e-9j), mpmath.inf
        digits = mpmath.mpf(10) ** -_DIGITS
        for step in range(_EXTENDED_STEPS):
            value, slope = function.exact_value_and_slope(s)
            if common and s == 0:
                return None
            if value == 0:
                break
            slope = slope / value - (common / s if common else 0)
            if slope == 0:
                return None
            move = 1 / slope
            # Next to a zero of order m each step goes 1 / m of the way that is left. Of a
            # cluster of m zeros longer steps would miss all, so that the last steps are short.
            share, last = abs(move) / last, abs(move)
            multiple = 0.4 < share < 0.9 and step < _MULTIPLE_STEPS
            s -= move * (mpmath.nint(1 / (1 - share)) if multiple else 1)
            # To a zero at s = 0, of which the digits never settle, the method goes straight.
            if abs(s) < mpmath.eps**2:
                s = mpmath.mpc(0)
            if last <= digits * abs(s):
                break
        else:
            return None
        least = 100 * digits * abs(s)
        real, imag = (v if abs(v) > least else 0.0 for v in (s.real, abs(s.imag)))
        return complex(real, imag)


class _Line(NamedTuple):
    """The function s -> F(s + sigma), as `Function.shifted` returns it, and its extent."""

    space: Space
    functions: inclusion.Functions
    #: Up to about where zeros can lie right of the line, in rad/s; inf past a chain's limit.
    end: float
    #: One turn of the longest delay that acts, in rad/s.
    turn: float


class _Search:
    """A search for the rightmost zero of F / s^common, and how many steps it has taken."""

    def __init__(self, function: Function, common: int) -> None:
        self.function, self.common, self.steps = function, common, 0.0
        self.unit = 1.0 / function.space.longest
        self.further, self.points = _TURNS_FURTHER, 0

    # Where an exponential overflows nothing is found.
    @np.errstate(over="ignore", invalid="ignore")
    def _line(self, sigma: float) -> _Line:
        """Return the function on the line Re s = sigma."""
        space, functions = self.function.shifted(sigma)
        _, steady, delayed, uncertain = functions
        end = float(space.confined_from(steady, delayed, uncertain)[0])
        if np.isfinite(end) and not space.step:
            end = _last_crossing(space, steady[0], delayed[0])
        # Far to the right the longer delays no longer act.
        acting = float(space.arrays.delays[delayed[0].any(axis=0)].max(initial=0.0))
        turn = 2.0 * np.pi / (acting or space.longest)
        return _Line(space, functions, end, turn)

    def fine(self, root: complex) -> float:
        """How far right of a zero no other one lies, at most."""
        return _FINE * max(abs(root.real), self.unit)

    def first_line(self) -> float:
        """Return a line just right of the limit of a neutral chain, or -inf without a chain.

        Left of the limit no count is decided.
        """
        space = self.function.space
        if space.step:
            return -np.inf
        limit = chain.real_part_limit(space.lags, *space.limits(*self.function.weights))
        if not -_LARGEST_EXPONENT * self.unit <= limit < np.inf:
            return limit if limit > 0.0 else -np.inf
        step = 0.25 * self.fine(limit)
        while not np.isfinite(self._line(limit + step).end):
            step *= 2.0
        return limit + step

    def count(self, sigma: float, most: int) -> int:
        """Count the zeros right of a line; below zero where that is not decided."""
        line = self._line(sigma)
        if not np.isfinite(line.end):
            return UNCONFINED
        try:
            found = decide.count(self.function, self.common, right_of=sigma, most=most)
        except UndecidedError:
            found = BOUNDARY
        self.steps += min(line.end / line.turn, most) if found >= 0 else most
        return found

    def _moved(self, s: ComplexArray, move: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Return where Newton's method for F / s^common leads, and how far.

        `move` is F over its derivative at s.
        """
        with np.errstate(all="ignore"):
            move = move / (1.0 - self.common * move / s) if self.common else move
            length = np.abs(move)
        return s - move, np.where(np.isnan(length), np.inf, length)

    def near(self, sigma: float) -> tuple[complex, float] | None:
        """Return the rightmost zero found near a line, and the real part of those equal to it.

        Of these it is the one of lowest frequency.
        """
        line = self._line(sigma)
        end = line.end
        if not line.space.step:
            end = min(end, 1e3 * self.further * line.turn)
            end += self.further * line.turn
        begin = 1e-3 * _SLOWEST * line.turn
        grid, move = inclusion.resolved(line.functions, begin, end, _MOST_POINTS)
        self.points = grid.size
        self.steps += self.points
        s, length = self._moved(sigma + 1j * grid, move)
        # From where a step of Newton's method is locally shortest: no zero close to the line
        # lies between two of its points.
        wider = np.pad(length, 1, constant_values=np.inf)
        s = s[(length <= wider[:-2]) & (length < wider[2:])]
        s = s[np.argsort(-s.real, kind="stable")][:_MOST_STARTS]
        # Next to lightly damped poles rounding may hide D; its zeros there lie next to them.
        own = self.function.space.arrays
        s = np.append(s, np.unique(own.roots[own.present]) + 1e-3j * _SLOWEST * line.turn)
        self.steps += _STEPS * s.size
        for _ in range(_STEPS):
            with np.errstate(all="ignore"):
                value, slope = self.function.value_and_slope(s)
                move = np.where(value == 0.0, 0.0, value / slope)
            s, length = self._moved(s, move)
        # Slow zeros are far smaller than a turn.
        found = s[
            length <= np.minimum(1e-5 * line.turn, 1e-3 * np.abs(s) + _SLOWEST * line.turn)
        ]
        for top in found[np.argsort(-found.real, kind="stable")][:_MOST_TRIED]:
            equal = found[found.real >= top.real - _FINEST * max(abs(top), self.unit)]
            lowest = equal[np.argmin(np.abs(equal.imag))]
            root = _polished(self.function, self.common, complex(lowest))
            if root is not None:
                return root, root.real + float(top.real - lowest.real)
        return None

    def certified(self, root: complex, equal: float) -> complex | None:
        """Return the root, or one between it and a line without zeros on its right, or None."""
        finest = _FINEST * max(abs(root), self.unit)
        fine = max(finest, self.fine(root))
        count = self.count(equal + finest, _FEW_STEPS)
        if count < 0:
            count = self.count(equal + fine, _MANY_STEPS)
            between = self.near(equal + fine) if count == 0 else None
            if between is not None and between[0].real > root.real + finest:
                root = between[0]
        if count == 0 and 0.0 < abs(root.real) <= fine:
            # The side of the axis is that of the count.
            count = self.count(0.0, _MANY_STEPS)
            if count < 0:
                return root if abs(root.real) <= finest else None
            return root if (count > 0) == (root.real > 0.0) else None
        return root if count == 0 else None


def _last_crossing(space: Space, steady: FloatArray, delayed: FloatArray) -> float:
    """Frequency up to which delayed terms are as large as all else, from samples.

    What a search finds depends on it, but no count.
    """
    omega = np.geomspace(1e-3 * space.corners[0], 1e6 * space.corners[-1], 500)
    weights = np.vstack((steady - delayed.sum(1), delayed.T))
    still = np.zeros((*weights.shape, delayed.shape[1]))
    functions = inclusion.Functions(space.arrays, weights, still, np.zeros_like(weights))
    sizes = np.abs(inclusion.values(functions, omega))
    met = np.flatnonzero(sizes[0] <= sizes[1:].sum(0))
    return float(omega[min(met[-1] + 1, 499)]) if met.size else 2.0 * np.pi / space.longest


def _without_delay(function: Function, common: int) -> complex:
    """Return the rightmost zero of a function that no delay acts on."""
    parts = zip(function.space.polynomials, function.steady, strict=True)
    whole = sum((weight * p.exact for p, weight in parts), fmpq_poly([0]))
    whole //= fmpq_poly([0, 1]) ** common
    starts = Polynomial.of(whole).roots if whole else ()
    roots = [_polished(function, common, s) for s in starts]
    if not roots:
        raise ValueError("the parameters must leave a loop with roots: D is constant")
    if None in roots:
        k = roots.index(None)
        raise RootError(f"no root could be found from {starts[k]}", starts[k])
    return max((s for s in roots if s is not None), key=lambda s: (s.real, -s.imag))


def rightmost_zero(function: Function, common: int = 0) -> complex:
    """Return the zero of a function with the largest real part.

    Line after line is tried. The rightmost zero near a line is the one if a count just right of
    it is zero. The counts on the lines enclose it, so that the interval between two lines is
    halved until it is found.

    Parameters
    ----------
    function : Function
        Not zero.
    common : int, optional
        Order of a zero at s = 0 that is left out.

    Raises
    ------
    ValueError
        If the function has no zeros because it is constant.
    RootError
        If no zero is certified.
    """
    if not function.delayed.any():
        return _without_delay(function, common)
    search, best = _Search(function, common), complex(np.nan, np.nan)
    # There are zeros right of `low`, as far as is decided, and none right of `high`.
    first = search.first_line()
    low, high, sigma, width = -np.inf, np.inf, max(0.0, first), search.unit
    small, why = _SLOWEST * search.unit, ""
    while search.steps < _ALL_STEPS and -_LARGEST_EXPONENT * search.unit < sigma < np.inf:
        found = search.near(sigma)
        # Next to the limit of a chain no count tells that zeros lie right of `low`.
        if found and found[0].real + search.fine(found[0]) > low:
            best = found[0]
            root = search.certified(*found)
            if root is not None:
                return root
            low = max(low, best.real)
        if low < sigma < high:
            if search.count(sigma, _MANY_STEPS) == 0:
                high = sigma
            else:
                low = sigma
        if high == first and search.points > _ENOUGH_POINTS:
            why = (
                f": no root lies right of Re s = {first:.6g}, the limit that neutral root "
                "chains may tend to"
            )
            break
        search.further = min(2.0 * search.further, _MOST_TURNS_FURTHER)
        if low > -np.inf and high < np.inf:
            # Zeros next to the axis may be slower than the delays by many decades.
            sigma = float(small * np.sinh(0.5 * sum(np.arcsinh(np.array([low, high]) / small))))
        else:
            sigma = low + width if low > -np.inf else high - width
            width *= 4.0
        # No zero is known between the limit of a chain and `high`.
        if -np.inf < low < first or sigma < first:
            sigma = first
        elif sigma in (low, high):
            break
    raise RootError(
        f"no rightmost root could be certified{why}; the best candidate is {best}", best
    )
