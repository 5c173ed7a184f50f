"""The zero of a function with the largest real part, found, polished and certified.

How many zeros lie right of a line Re s = sigma is the count for F(s + sigma). So the rightmost
zero is enclosed between a line with zeros right of it and one without. Newton's method finds it
from the points of such a line that are nearest to a zero, and goes on in extended precision; a
last count says that no zero lies further right.
"""

from __future__ import annotations

import mpmath
import numpy as np
from numpy.polynomial import polynomial as poly

from armlock.checks import ComplexArray, FloatArray
from armlock.engine import decide, inclusion
from armlock.engine.decide import BOUNDARY, UndecidedError
from armlock.engine.functions import Function, Space
from armlock.engine.inclusion import EPSILON

# Real parts that differ by less count as equal; relative to |s| or one over the longest delay.
_EQUAL = 1e-11
# How far right of its root the last count may stand, relative to |Re s| or the same.
_COUNT_WITHIN = 1e-6
# Longest way along a line, in turns of the longest delay: to count, and to look for roots.
_LONGEST_COUNT, _LONGEST_SEARCH = 1e6, 1e5
# The search for one root ends once it has cost so much, some five seconds. The unit is a turn
# that is counted, or a point that Newton's method takes a step from.
_ALL_STEPS = 3e6
# What an undecided count costs; and extended precision where Newton's method does not settle at
# a root, and where it does.
_UNDECIDED_COUNT = 5e5
_LOST_ROOT, _POLISHED_ROOT = 1e5, 5e3
# Most points of one line.
_MOST_POINTS = np.int64(1_000_000)
# Roots left of a line may lie further up than those right of it. They are looked for so many
# turns further: few at first, at most so many.
_FIRST_TURNS_FURTHER, _MOST_TURNS_FURTHER = 4.0, 3e4
# Most roots are of low frequency: first looked for within this many times those turns.
_MOST_OF_THEM = 1e3
# Most points of a line from which Newton's method starts, and most of its steps in extended
# precision: at a multiple root they only shrink by a share.
_MOST_STARTS, _NEWTON_STEPS, _EXTENDED_STEPS = 4096, 12, 100
# Most roots near a line that are tried in extended precision.
_MOST_TRIED = 8
# Roots down to so many times one over the longest delay are looked for in steps of their size.
_SLOWEST = 1e-9
# Past this an exponential is no float.
_LARGEST_EXPONENT = 600.0
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


def _followed(function: Function, common: int, start: complex, digits: int) -> mpmath.mpc:
    """Follow Newton's method for F(s) / s^common in extended precision, or raise."""
    # Next to s = 0 the terms of D cancel, and take as many digits with them.
    with mpmath.workdps(digits + _GUARD_DIGITS):
        s = mpmath.mpc(start)
        for _ in range(_EXTENDED_STEPS):
            value, slope = function.exact_value_and_slope(s)
            if value == 0 and not (common and s == 0):
                return +s
            if value == 0:
                break
            slope = slope / value - (common / s if common else 0)
            if slope == 0:
                break
            move = 1 / slope
            s -= move
            # To a root at zero, of which the digits never settle, the method goes straight.
            if abs(s) < mpmath.eps**2:
                s = mpmath.mpc(0)
            elif abs(move) <= mpmath.mpf(10) ** -digits * abs(s):
                with mpmath.workdps(digits):
                    return +s
    raise RootError(f"start={start} is not close enough to a root", complex(start))


class _Line:
    """The line Re s = sigma: how many roots lie right of it, and which lie near it.

    Attributes
    ----------
    turns : float
        How far up roots can lie right of the line, in turns of the longest delay's
        exponential; inf past the limit of a neutral root chain, or where a number overflows.
    steps : float
        What its searches have cost so far, in the unit of `_ALL_STEPS`.
    """

    def __init__(self, function: Function, common: int, sigma: float) -> None:
        self.function, self.common, self.sigma = function, common, sigma
        self.turns, self.steps = np.inf, 0.0
        self.per_turn = 2.0 * np.pi / function.space.longest
        if -sigma * function.space.longest <= _LARGEST_EXPONENT:
            self.shifted = function.shifted(sigma)
            space, steady, delayed, _ = self.shifted
            # Far to the right the longer delays no longer act.
            acting = space.arrays.delays[delayed.any(axis=0)]
            if acting.size:
                self.per_turn = 2.0 * np.pi / float(acting.max())
            confined = np.isfinite(space.confined_from(steady[None], delayed[None]))[0]
            end = _last_crossing(space, steady, delayed)
            self.turns = end / self.per_turn if confined else np.inf
        self.known = self.turns <= _LONGEST_COUNT

    def count(self) -> int:
        """Count the roots right of the line; below zero where that is not decided."""
        if not self.known:
            return BOUNDARY
        try:
            if self.sigma == 0.0:
                found = decide.count(self.function, self.common)
            else:
                space, *weights = self.shifted
                arrays = (value[None] for value in weights)
                found = int(decide.counts(space, *arrays)[0])
                if found >= 0 and self.sigma < 0.0:
                    found -= self.common
        except UndecidedError:
            found = BOUNDARY
        self.steps += self.turns if found >= 0 else _UNDECIDED_COUNT
        return found

    def _newton(self, s: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Return where a step of Newton's method leads from each s, and its length."""
        with np.errstate(all="ignore"):
            value, slope = self.function.value_and_slope(s)
            slope = slope - value * (self.common / s) if self.common else slope
            move = np.where(value == 0.0, 0.0, value / slope)
        length = np.abs(move)
        return s - move, np.where(np.isnan(length), np.inf, length)

    def search(self, further: float) -> float:
        """Return up to how many turns roots near the line are looked for."""
        if not self.known:
            return 0.0
        return min(self.turns, _MOST_OF_THEM * further, _LONGEST_SEARCH) + further

    def near(self, turns: float, most: int) -> tuple[ComplexArray, FloatArray]:
        """Follow Newton's method to roots near the line; return them and the last steps.

        Up to so many turns, from those `most` starts whose first step leads furthest right.
        """
        space, steady, delayed, _ = self.shifted
        grid = inclusion.resolved(
            space.arrays, steady, delayed, 1e-3 * _SLOWEST * self.per_turn,
            turns * self.per_turn, _MOST_POINTS,
        )  # fmt: skip
        s = self.sigma + 1j * grid
        # A point costs a step of the walk, and one of Newton's method.
        self.steps += 2 * s.size
        # Part by part, because arrays of millions would spend their time on memory.
        parts = np.array_split(s, 1 + s.size // 2**13)
        s, length = map(np.concatenate, zip(*map(self._newton, parts), strict=True))
        # From where a step of Newton's method is locally shortest: no root close to the line
        # lies between two of its points.
        wider = np.pad(length, 1, constant_values=np.inf)
        s = s[(length <= wider[:-2]) & (length < wider[2:])]
        s = s[np.argsort(-s.real, kind="stable")][:most]
        self.steps += _NEWTON_STEPS * s.size
        for _ in range(_NEWTON_STEPS):
            s, length = self._newton(s)
        return s.real + 1j * np.abs(s.imag), length

    def rightmost(self, further: float) -> tuple[complex, float] | None:
        """Return the rightmost root near the line, and how far right an equal one may lie.

        Of roots that count as equal it is the one of lowest frequency.
        """
        turns = self.search(further)
        if not turns:
            return None
        found, length = self.near(turns, _MOST_STARTS)
        found = found[length <= 1e-5 * self.per_turn]
        unit = self.per_turn / (2.0 * np.pi)
        for top in sorted(found, key=lambda s: -s.real)[:_MOST_TRIED]:
            equal = found[found.real >= top.real - _EQUAL * max(abs(top), unit)]
            lowest = equal[np.argmin(equal.imag)]
            try:
                root = _polished(self.function, self.common, lowest)
            except RootError:
                self.steps += _LOST_ROOT
                continue
            self.steps += _POLISHED_ROOT
            return root, float(top.real - lowest.real)
        return None


def _last_crossing(space: Space, steady: FloatArray, delayed: FloatArray) -> float:
    """Frequency up to which delayed terms are as large as all else, from samples.

    The time of a search depends on it, but no count.
    """
    omega = np.geomspace(1e-3 * space.corners[0], 1e6 * space.corners[-1], 2000)
    weights = np.vstack((steady - delayed.sum(1), delayed.T))
    still = np.zeros((*weights.shape, delayed.shape[1]))
    sizes = np.abs(inclusion.values(space.arrays, weights, still, omega)[0])
    met = np.flatnonzero(sizes[0] <= sizes[1:].sum(0))
    return max(float(omega[met[-1]]) if met.size else 0.0, 2.0 * np.pi / space.longest)


def _polished(function: Function, common: int, start: complex) -> complex:
    """Return a root to the last bit, the same for every start; of a pair the upper one."""
    # From a start on the real axis the method would never lead to a pair next to it.
    root = complex(_followed(function, common, start * (1.0 + 1e-9j), 20))
    turns = abs(root.imag) > EPSILON * abs(root.real)
    return complex(root.real, abs(root.imag) if turns else 0.0)


def _without_delay(function: Function, common: int) -> complex:
    """Return the rightmost root of a function that no delay acts on."""
    polynomials = zip(function.space.polynomials, function.weights[0], strict=True)
    coefficients: FloatArray = np.zeros(1)
    for p, weight in polynomials:
        coefficients = np.asarray(poly.polyadd(coefficients, weight * p.coefficients))
    coefficients = np.asarray(poly.polytrim(coefficients, tol=0.0)[common:])
    if coefficients.size <= 1:
        raise ValueError(f"the parameters must leave a loop with roots: D is {coefficients}")
    roots = poly.polyroots(coefficients)
    return _polished(function, common, roots[np.argmax(roots.real)])


def rightmost_zero(function: Function, common: int = 0) -> complex:
    """Return the zero of a function with the largest real part, or raise `RootError`.

    Line after line is tried. Roots near a line are candidates, and a count just right of the
    rightmost of them tells whether it is the one. The counts on the lines enclose it, so that
    the interval between two lines is halved until it is found. `common` zeros at s = 0 are
    left out.
    """
    if not function.delayed.any():
        return _without_delay(function, common)
    unit = 1.0 / function.space.longest
    small = _SLOWEST * unit
    best = complex(np.nan, np.nan)
    # There are roots right of `low`, as far as is decided, and none right of `high`.
    low, high, sigma, width, walked = -np.inf, np.inf, 0.0, unit, 0.0
    further = _FIRST_TURNS_FURTHER
    while walked < _ALL_STEPS and sigma not in (low, high):
        line = _Line(function, common, sigma)
        root, ahead = line.rightmost(further) or (complex(np.nan, np.nan), 0.0)
        further = min(2.0 * further, _MOST_TURNS_FURTHER)
        farthest = _COUNT_WITHIN * max(abs(root.real), unit)
        # Next to the limit of the chain no count tells that roots lie right of `low`.
        if root.real + farthest > low:
            best = root
            nearest = _EQUAL * max(abs(best), unit)
            for margin in np.geomspace(nearest, max(nearest, farthest), 6):
                right_of_it = _Line(function, common, best.real + ahead + margin)
                count = right_of_it.count()
                walked += right_of_it.steps
                if count == 0:
                    # Another one may lie between the root and the line.
                    between = right_of_it.rightmost(further) if margin > nearest else None
                    if between is not None and between[0].real > best.real + nearest:
                        return between[0]
                    if 0.0 < abs(best.real) <= farthest:
                        # D may vanish so slowly there that rounding decides the sign. Of a pair
                        # on the axis no count tells it, and it need not.
                        on_axis = _Line(function, common, 0.0).count()
                        decided = on_axis >= 0 or (best.imag and abs(best.real) <= nearest)
                        if not decided or (on_axis >= 0 and (on_axis > 0) != (best.real > 0)):
                            break
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
    raise RootError(f"no rightmost root could be certified; the best candidate is {best}", best)
