"""Characteristic roots: all right of a line, and the rightmost one, found and certified.

Candidates come from Newton's method in double precision, from points of lines Re s = sigma.
Each is enclosed in a disc that holds a known number of roots (Lemma 25). The count for
D(s + sigma) says how many roots there are right of a line, so that none is missing.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import flint
import numpy as np
import numpy.typing as npt
from flint import acb, acb_poly, arb, fmpq_poly

from armlock.checks import ComplexArray, FloatArray, real_number, whole_steps
from armlock.engine import chain, decide, inclusion
from armlock.engine.functions import Function, Space, common_zeros
from armlock.engine.polynomials import enclosed_roots, order
from armlock.engine.tolerances import BOUNDARY, UNCONFINED, UndecidedError
from armlock.stability.counts import CountError, at_points, count_exactly, decided, place
from armlock.systems import System
from armlock.tables import Shown, Table
from armlock.tables import number as shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# How far right of the root that is returned no other one lies: the first share of abs(s), or of
# one over the longest delay, if so fine a count is decided in so few steps. Otherwise it is the
# second share of abs(Re s), or of one over the longest delay. Real parts that differ by less
# than the first count as equal.
_FINEST, _FINE = 1e-11, 1e-6
_FEW_STEPS, _MANY_STEPS = 200_000, 2_000_000
# The search for one root ends once it has cost so many steps, some five seconds.
_ALL_STEPS = 4e6
# Most points of one line, and from how many of them Newton's method starts.
_MOST_POINTS, _MOST_STARTS = 500_000, 1000
# The line next to the limit of a neutral chain has been searched with so many points.
_ENOUGH_POINTS = 200_000
# A line is followed up to where roots can lie right of it, and so many turns of the longest
# delay further, but at first no longer than 1000 times that; with each line twice as far.
_TURNS_FURTHER, _MOST_TURNS_FURTHER = 4.0, 3e4
# So often the way from the limit of a chain to a line right of it is doubled.
_MOST_DOUBLED = 64
# Steps of Newton's method in double precision, and most in balls.
_STEPS, _BALL_STEPS = 12, 60
# Most roots near a line that are tried when the rightmost one is looked for.
_MOST_TRIED = 8
# Roots down to so many times one over the longest delay are looked for in steps of their size.
_SLOWEST = 1e-9
# So many times one over the longest delay left of the axis an exponential is no float.
_LARGEST_EXPONENT = 600.0
# Bits of balls, one after the other, and most roots in one disc, of at most this radius over
# the size of the root.
_BITS, _MOST_IN_A_DISC, _WIDEST = (192, 640, 2560), 12, 1e-3
# Most roots that are listed, lines on which they are looked for, and the degree up to which
# those of a map are roots of one polynomial.
_MOST_ROOTS, _LINES, _LARGEST_MAP = 10_000, 24, 2000
# Rounds of Newton's method for what is not yet known, and when two candidates are one.
_ROUNDS, _SAME = 8, 1e-10


class RootError(RuntimeError):
    """Roots could not be certified; `estimate` is the best candidate, or those that were found.

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

    def __init__(self, message: str, estimate: Any) -> None:
        super().__init__(message)
        self.estimate = estimate

    def __reduce__(self) -> tuple[type[RootError], tuple[str, Any]]:
        """Pickle the estimate along, so that the error passes from process to process."""
        return type(self), (str(self), self.estimate)


class _Disc(NamedTuple):
    """A disc that holds so many roots, and perhaps one of as many conjugates."""

    centre: acb
    radius: arb
    number: int
    has_conjugate: bool

    @property
    def root(self) -> complex:
        """The centre, rounded; what the radius leaves of a part is none."""
        parts = self.centre.real, self.centre.imag
        return complex(*(float(v) if abs(v) > self.radius else 0.0 for v in parts))

    @property
    def size(self) -> int:
        """How many roots there are in it and its conjugate."""
        return self.number * (2 if self.has_conjugate else 1)

    @property
    def roots(self) -> list[complex]:
        """The centre as often as there are roots in the disc, and its conjugate."""
        pair = [self.root, self.root.conjugate()] if self.has_conjugate else [self.root]
        return pair * self.number

    def meets(self, other: _Disc) -> bool:
        """Whether two discs may overlap."""
        return not abs(self.centre - other.centre) > self.radius + other.radius


class _Balls:
    """F(s) / s^common in balls, as polynomials times exponentials."""

    def __init__(self, function: Function, common: int) -> None:
        self.common, self.unit = common, 1.0 / (function.space.longest or 1.0)
        self.parts = [(theta, _taylor(p)) for theta, p in function.by_delay]
        self.rounded: dict[int, list[tuple[arb, list[acb_poly]]]] = {}

    def series(self, s: acb, number: int) -> list[acb]:
        """Return so many Taylor coefficients at s; at a ball around s = 0 those of F s^-common.

        Those of a ball bound what is left of the series, times a power of the radius.
        """
        at_zero = self.common if s.contains(0) else 0
        size = number + at_zero
        found = [acb(0)] * size
        if flint.ctx.prec not in self.rounded:
            self.rounded[flint.ctx.prec] = [
                (-arb(theta), [acb_poly(p) for p in derivatives])
                for theta, derivatives in self.parts
            ]
        for late, derivatives in self.rounded[flint.ctx.prec]:
            values = [p(s) for p in derivatives[:size]]
            turns = [acb(1)]
            if late != 0:
                turns = [(s * late).exp()]
                for k in range(1, size):
                    turns.append(turns[-1] * late / k)
            for k, turn in enumerate(turns):
                for i, value in enumerate(values[: size - k]):
                    found[i + k] += value * turn
        found = found[at_zero:]
        for _ in range(self.common - at_zero):
            # Over s + x, one coefficient after the other.
            for k in range(number):
                found[k] = (found[k] - (found[k - 1] if k else 0)) / s
        return found

    def enclosed(self, start: complex, numbers: Iterable[int]) -> _Disc | None:
        """Follow Newton's method to a disc with one of some numbers of roots, or None."""
        polished: dict[int, acb | None] = {}
        for number, bits in itertools.product(numbers, _BITS):
            with flint.ctx.workprec(bits):
                if bits not in polished:
                    polished[bits] = self._polished(acb(start.real, abs(start.imag)))
                s = polished[bits]
                if s is not None and (found := self._disc(s, number)):
                    return found
        return None

    def _polished(self, s: acb) -> acb | None:
        """Follow Newton's method for F / F', of which all roots are simple."""
        small = arb(2) ** (-flint.ctx.prec // 2)
        for _ in range(_BALL_STEPS):
            f, slope, bend = self.series(s, 3)
            below = slope * slope - 2 * f * bend
            if f.contains(0) or below.contains(0):
                return s
            move = (f * slope / below).mid()
            if not move.is_finite():
                return None
            s = (s - move).mid()
            if abs(s) < small * small * self.unit:
                return acb(0)
            if abs(move) <= small * abs(s):
                return s
        return None

    def _disc(self, s: acb, number: int) -> _Disc | None:
        """Return a disc with so many roots around the real part of s, or around s, or None."""
        next_to_real = s == 0 or abs(s.imag) < _WIDEST * abs(s)
        if next_to_real and (found := self._holds(acb(s.real), number)):
            return found
        s = acb(s.real, abs(s.imag))
        found = self._holds(s, number)
        return found if found and s.imag > found.radius else None

    def _holds(self, centre: acb, number: int) -> _Disc | None:
        """Return a disc around a centre with exactly so many roots, or None (Lemma 25)."""
        *lower, top = self.series(centre, number + 1)
        least = top.abs_lower()
        if not least > 0:
            return None
        smallest = arb(2) ** -flint.ctx.prec * (abs(centre) + arb(2) ** -flint.ctx.prec)
        radius = smallest
        for k, c in enumerate(lower):
            part = 2 * (c.abs_upper() / least).root(number - k) if c.abs_upper() > 0 else arb(0)
            radius = arb(part.upper()) if part > radius else radius
        if not (radius == smallest or radius < _WIDEST * abs(centre)):
            return None
        around = centre + acb(arb(0, radius), arb(0, radius))
        rest = self.series(around, number + 2)[-1].abs_upper() * radius ** (number + 1)
        for k, c in enumerate(lower):
            rest += c.abs_upper() * radius**k
        if not least * radius**number > rest:
            return None
        return _Disc(centre, radius, number, centre.imag != 0)


def _taylor(p: fmpq_poly) -> list[fmpq_poly]:
    """Return a polynomial and its derivatives, each over the factorial of its order."""
    found = [p]
    while found[-1].degree() > 0:
        found.append(found[-1].derivative() / len(found))
    return found


class _Line(NamedTuple):
    """The function s -> F(s + sigma), as `Function.shifted` returns it, and its extent."""

    space: Space
    functions: inclusion.Functions
    #: Up to about where roots can lie right of the line, in rad/s; inf past a chain's limit.
    end: float
    #: One turn of the longest delay that acts, in rad/s.
    turn: float


class _Search:
    """A search for roots of F / s^common, and how many steps it has taken."""

    def __init__(self, function: Function, common: int) -> None:
        self.function, self.common, self.steps = function, common, 0.0
        self.balls = _Balls(function, common)
        self.unit = 1.0 / function.space.longest
        self.further, self.points = _TURNS_FURTHER, 0
        own = function.space.arrays
        self.poles = np.unique(own.roots[own.present])

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
        """How far right of a root no other one lies, at most."""
        return _FINE * max(abs(root.real), self.unit)

    def first_line(self) -> float:
        """Return a line just right of the limit of a neutral chain, or -inf without a chain.

        Left of the limit no count is decided.
        """
        space, limits = self.function.space, self.function.limits
        if space.step:
            return -np.inf
        if not limits[0]:
            return np.inf
        late = np.array([float(abs(c / limits[0])) for c in limits[1:]])
        limit = chain.real_part_limit(space.lags, 1.0, late)
        if not -_LARGEST_EXPONENT * self.unit <= limit < np.inf:
            return limit if limit > 0.0 else -np.inf
        step = 0.25 * self.fine(limit)
        for _ in range(_MOST_DOUBLED):
            if np.isfinite(self._line(limit + step).end):
                return limit + step
            step *= 2.0
        return np.inf

    def count(self, sigma: float, most: int) -> int:
        """Count the roots right of a line; below zero where that is not decided."""
        line = self._line(sigma)
        if not np.isfinite(line.end):
            return UNCONFINED
        try:
            found = decide.count(self.function, self.common, right_of=sigma, most=most)
        except UndecidedError:
            found = BOUNDARY
        self.steps += min(line.end / line.turn, most) if found >= 0 else most
        return found

    def _moved(self, s: ComplexArray, known: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Return where Newton's method leads for F over factors of known roots, and how far."""
        with np.errstate(all="ignore"):
            value, slope = self.function.value_and_slope(s)
            away = (1.0 / np.subtract.outer(s, known)).sum(axis=1)
            away = away + self.common / s if self.common else away
            move = 1.0 / (slope / value - away)
            move = np.where(value == 0.0, 0.0, move)
            length = np.abs(move)
        return s - move, np.where(np.isnan(length), np.inf, length)

    def candidates(self, sigma: float, most: int = _MOST_STARTS) -> ComplexArray:
        """Return where Newton's method leads from a line, the rightmost first."""
        line = self._line(sigma)
        end = line.end
        if not line.space.step:
            end = min(end, 1e3 * self.further * line.turn)
            end += self.further * line.turn
        begin = 1e-3 * _SLOWEST * line.turn
        grid, move = inclusion.resolved(line.functions, begin, end, _MOST_POINTS)
        self.points = grid.size
        self.steps += self.points
        s = sigma + 1j * grid
        with np.errstate(all="ignore"):
            move = move / (1.0 - self.common * move / s)
            length = np.nan_to_num(np.abs(move), nan=np.inf)
        # From where a step of Newton's method is locally shortest: no root close to the line
        # lies between two of its points.
        wider = np.pad(length, 1, constant_values=np.inf)
        here = (length <= wider[:-2]) & (length < wider[2:])
        s = (s - move)[here]
        s = s[np.argsort(-s.real, kind="stable")][:most]
        # Next to lightly damped poles rounding may hide D; its roots there lie next to them.
        s = np.append(s, self.poles + 1e-3j * _SLOWEST * line.turn)
        return self._led(s, line.turn)

    def _led(
        self, s: ComplexArray, turn: float, known: ComplexArray | tuple[()] = ()
    ) -> ComplexArray:
        """Return where Newton's method comes close to a root, the rightmost first."""
        self.steps += _STEPS * s.size
        length = np.full(s.shape, np.inf)
        for _ in range(_STEPS):
            s, length = self._moved(s, np.array(known, np.complex128))
        # Slow roots are far smaller than a turn.
        close = np.minimum(1e-5 * turn, 1e-3 * np.abs(s) + _SLOWEST * turn)
        found = s[length <= close]
        return found[np.argsort(-found.real, kind="stable")]

    def near(self, sigma: float) -> tuple[complex, float] | None:
        """Return the rightmost root found near a line, and the real part of those equal to it.

        Of these it is the one of lowest frequency.
        """
        found = self.candidates(sigma)
        for top in found[:_MOST_TRIED]:
            equal = found[found.real >= top.real - _FINEST * max(abs(top), self.unit)]
            lowest = equal[np.argmin(np.abs(equal.imag))]
            disc = self.balls.enclosed(complex(lowest), range(1, 1 + _MOST_IN_A_DISC))
            if disc is not None:
                return disc.root, disc.root.real + float(top.real - lowest.real)
        return None

    def certified(self, root: complex, equal: float) -> complex | None:
        """Return the root, or one between it and a line without roots on its right, or None."""
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

    def right_of(self, sigma: float, number: int) -> list[_Disc]:
        """Return discs of all roots right of a line, of which there are so many, or of some."""
        found, places, missing = list[_Disc](), np.zeros(0, np.complex128), number

        def keep(starts: ComplexArray, numbers: Iterable[int]) -> bool:
            """Enclose what is new, and tell whether something was."""
            nonlocal places, missing
            before, numbers = missing, list(numbers)
            for start in starts.tolist():
                there = complex(start.real, abs(start.imag))
                if not missing or (np.abs(places - there) <= _SAME * abs(there)).any():
                    continue
                disc = self.balls.enclosed(there, numbers)
                if disc is None or not disc.centre.real - disc.radius > sigma:
                    continue
                # Discs are far smaller than this.
                close = np.flatnonzero(np.abs(places - disc.root) <= 0.1 * abs(disc.root))
                if not any(disc.meets(found[k]) for k in close):
                    found.append(disc)
                    places, missing = np.append(places, disc.root), missing - disc.size
            return missing < before

        turns, line = np.exp(2j * np.pi * (np.arange(6) + 0.3) / 6.0), sigma
        for k in range(_LINES):
            candidates = self.candidates(line, max(2 * number, _MOST_STARTS))
            keep(candidates, [1])
            for _ in range(_ROUNDS):
                # Newton's method for F over the factors of what is known leads elsewhere.
                known = np.array([s for disc in found for s in disc.roots], np.complex128)
                starts = np.concatenate((self.poles, known, [line]))
                starts = starts[np.argsort(np.abs(starts - line))][: _MOST_STARTS // 6]
                around = 0.3 * np.abs(starts) + 1e-9 * self.unit
                starts = (starts[:, None] + around[:, None] * turns).ravel()
                if missing <= 0 or not keep(self._led(starts, self.unit, known), [1]):
                    break
            if missing > 0:
                keep(candidates, range(2, 1 + min(missing, _MOST_IN_A_DISC)))
            if missing <= 0 or self.steps > _ALL_STEPS:
                break
            self.further = min(2.0 * self.further, _MOST_TURNS_FURTHER)
            line = sigma + 0.25 * self.unit * (2.0**k)
        return found


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


def _of_polynomial(function: Function, common: int) -> list[_Disc] | None:
    """Return all roots of a function without delays, or of a map of low degree; else None.

    Those of a map are logarithms of the roots of one polynomial of exp(s step).
    """
    step, parts = function.space.step, function.by_delay
    if not step and any(theta for theta, _ in parts):
        return None
    backs = [whole_steps("delay", float(theta), step) if step else 0 for theta, _ in parts]
    most = max(backs, default=0)
    if most > _LARGEST_MAP:
        return None
    p = fmpq_poly([0])
    for back, (_, part) in zip(backs, parts, strict=True):
        p += part * fmpq_poly([0, 1]) ** (most - back)
    p //= fmpq_poly([-1 if step else 0, 1]) ** common
    if step and p:
        p //= fmpq_poly([0, 1]) ** order(p.coeffs())
    if p.degree() < 1:
        return []
    found = []
    with flint.ctx.workprec(_BITS[0]):
        for z, number in enclosed_roots(p):
            if z.imag < 0:
                continue
            ball = z
            if step:
                flips = z.real < 0 and z.imag.contains(0)
                ball = (-z if flips else z).log() / arb(step)
                ball = acb(ball.real, arb.pi() / arb(step)) if flips else ball
            radius = abs(acb(ball.real.rad(), ball.imag.rad())).upper()
            has_conjugate = not z.imag.contains(0)
            found.append(_Disc(ball.mid(), arb(radius), number, has_conjugate))
    return sorted(found, key=lambda disc: (-disc.root.real, disc.root.imag))


def rightmost_zero(function: Function, common: int = 0) -> complex:
    """Return the root of F / s^common with the largest real part.

    Line after line is tried. The rightmost root near a line is the one if a count just right of
    it is zero. The counts on the lines enclose it, so that the interval between two lines is
    halved until it is found.

    Raises
    ------
    ValueError
        If the function has no roots because it is constant.
    RootError
        If no root is certified.
    """
    if not function.delayed.any():
        return _first(_of_polynomial(function, common))
    if function.lowest and function.lowest[0] > common:
        # One at s = 0 is exact, however many coincide there.
        with suppress(UndecidedError):
            if decide.count(function, function.lowest[0]) == 0:
                return 0j
    try:
        return _searched(function, common)
    except RootError:
        # Rounding may hide what the exact polynomial of a map tells.
        all_of_map = _of_polynomial(function, common)
        if all_of_map is None:
            raise
    return _first(all_of_map)


def _first(discs: list[_Disc] | None) -> complex:
    """Return the rightmost root of a polynomial."""
    if not discs:
        raise ValueError("the parameters must leave a loop with roots: D is constant")
    return discs[0].root


def _searched(function: Function, common: int) -> complex:
    """Do what `rightmost_zero` does, by lines."""
    search, best = _Search(function, common), complex(np.nan, np.nan)
    # There are roots right of `low`, as far as is decided, and none right of `high`.
    first = search.first_line()
    low, high, sigma, width = -np.inf, np.inf, max(0.0, first), search.unit
    small, why = _SLOWEST * search.unit, ""
    if first == np.inf:
        why = ": what is undelayed at the highest power of s is zero, or as rounding has it"
    while search.steps < _ALL_STEPS and -_LARGEST_EXPONENT * search.unit < sigma < np.inf:
        found = search.near(sigma)
        # Next to the limit of a chain no count tells that roots lie right of `low`.
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
            # Roots next to the axis may be slower than the delays by many decades.
            sigma = float(small * np.sinh(0.5 * sum(np.arcsinh(np.array([low, high]) / small))))
        else:
            sigma = low + width if low > -np.inf else high - width
            width *= 4.0
        # No root is known between the limit of a chain and `high`.
        if -np.inf < low < first or sigma < first:
            sigma = first
        elif sigma in (low, high):
            break
    raise RootError(
        f"no rightmost root could be certified{why}; the best candidate is {best}", best
    )


@dataclass(frozen=True, eq=False, repr=False)
class CharacteristicRoots(Shown):
    """All characteristic roots right of a line.

    Attributes
    ----------
    values : complex array, shape (n,)
        In rad/s, by falling real part, with conjugates. A root of multiplicity m stands there m
        times, and so does the centre of a cluster of m roots that are not told apart.
    radius : float array, shape (n,)
        The disc of this radius around a value, but for rounding of the value, holds as many
        roots as the value stands there. In rad/s; far below rounding except for clusters.
    right_of : float
        The line Re s, in rad/s.

    Examples
    --------
    >>> from armlock import HayesEquation, characteristic_roots
    >>> roots = characteristic_roots(HayesEquation(tau=1.0), 0.0, -1.2, right_of=-2.0)
    >>> print(roots.values.round(4))
    [-0.1905+1.4392j -0.1905-1.4392j -1.8769+7.6122j -1.8769-7.6122j]
    >>> print(roots.damping[0].round(4), roots.time_constant[0].round(4))
    0.1312 5.2504
    """

    values: ComplexArray
    radius: FloatArray
    right_of: float

    def __len__(self) -> int:
        """Return the number of roots."""
        return self.values.size

    @property
    def damping(self) -> FloatArray:
        """Damping ratios, -Re s / |s|; nan at s = 0."""
        with np.errstate(invalid="ignore"):
            return np.asarray(-self.values.real / np.abs(self.values))

    @property
    def time_constant(self) -> FloatArray:
        """Time constants -1 / Re s in s, negative of roots that grow."""
        with np.errstate(divide="ignore"):
            return np.asarray(-1.0 / self.values.real)

    def _table(self) -> Table:
        """Show real part, frequency, damping ratio and time constant, pairs once."""
        rows = [("real part", "frequency", "damping", "time constant")]
        for s, damping, time in zip(self.values, self.damping, self.time_constant, strict=True):
            if s.imag >= 0.0:
                real, omega = shown(s.real, "rad/s"), shown(s.imag, "rad/s")
                rows.append((real, omega, shown(damping), shown(time, "s")))
        return Table(f"{len(self)} roots right of Re s = {self.right_of:g} rad/s", rows)

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the roots, the line, and the region right of it, in which there are no others.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        **style
            As `matplotlib.axes.Axes.plot` takes it.

        Returns
        -------
        matplotlib Axes
        """
        from armlock.plotting import plot_roots

        return plot_roots(self, ax, **style)


def characteristic_roots(
    system: System, *values: npt.ArrayLike, right_of: float, **numbers: npt.ArrayLike
) -> CharacteristicRoots:
    """Return all characteristic roots right of a line, certified: none is missing.

    Parameters
    ----------
    system : System
        The open loop L, an equation, or a map, as `rightmost_root` takes it.
    *values, **numbers : float, optional
        The parameters, in the order of their first use or by name; nominal ones by default.
    right_of : float
        The line Re s in rad/s.

    Returns
    -------
    CharacteristicRoots
        By falling real part, multiplicity included. Of a map those with abs(Im s) of at most
        pi over the step; roots of the map at z = 0 have no s.

    Raises
    ------
    TypeError, ValueError
        As `unstable_roots`, if there are more than 10 000 roots, or if the line does not lie
        right of the limit of a neutral chain.
    CountError
        If a root lies on the line, or nearer to it than rounding can tell.
    RootError
        If not all of them are found; its `estimate` are those that are.

    See Also
    --------
    armlock.rightmost_root : the first of them, without a line.

    Notes
    -----
    How many there are is the certified count, see `unstable_roots`. Candidates from Newton's
    method are enclosed in discs that hold a known number of roots, until the sum of these
    numbers is the count (Lemma 25).

    Examples
    --------
    >>> from armlock import CommonArm, characteristic_roots
    >>> print(characteristic_roots(CommonArm(), right_of=-0.004))
    4 roots right of Re s = -0.004 rad/s
      real part    frequency  damping  time constant
          rad/s        rad/s                       s
    -5.8964e-04   3.0655e-01   0.0019     1.6960e+03
    -2.2894e-03   6.1342e-01   0.0037     4.3679e+02
    """
    sigma = real_number("right_of", right_of)
    system, points, shape = at_points(system, values, numbers)
    if shape:
        raise ValueError(f"parameters must be numbers, got arrays of the shape {shape}")
    n, m = system.functions(points[0].tolist())
    discs = _all_right_of(n, m, sigma, points[0])
    found = [(s, float(disc.radius)) for disc in discs for s in disc.roots]
    found.sort(key=lambda pair: (-pair[0].real, abs(pair[0].imag), -pair[0].imag))
    return CharacteristicRoots(
        np.array([s for s, _ in found], np.complex128),
        np.array([r for _, r in found], np.float64),
        sigma,
    )


def _all_right_of(n: Function, m: Function, sigma: float, point: FloatArray) -> list[_Disc]:
    """Return discs of all roots of a loop right of a line, or raise."""
    function, common = n + m, common_zeros(n, m)
    discs = _of_polynomial(function, common)
    if discs is not None:
        on_line = any(abs(disc.centre.real - sigma) <= disc.radius for disc in discs)
        number = sum(disc.size for disc in discs if disc.centre.real > sigma)
        number = BOUNDARY if on_line else number
    else:
        with decided("no roots", point):
            number = count_exactly(n, m, sigma)
    if number == UNCONFINED:
        raise ValueError(
            f"right_of must lie right of the limit of the neutral chain, got {sigma:g}: "
            "infinitely many roots may lie right of it"
        )
    if number == BOUNDARY:
        raise CountError(
            f"no roots{place(point)}: one lies on the line Re s = {sigma:g}, or nearer to it "
            "than rounding can tell",
            point[None],
        )
    if discs is None and function.space.step:
        raise ValueError(f"system must have at most {_LARGEST_MAP} steps in its longest delay")
    if number > _MOST_ROOTS:
        raise ValueError(
            f"right_of must leave at most {_MOST_ROOTS} roots, got {sigma:g} with {number}"
        )
    if discs is not None:
        return [disc for disc in discs if disc.centre.real > sigma]
    found = _Search(function, common).right_of(sigma, number) if number else []
    if (size := sum(disc.size for disc in found)) != number:
        estimate = np.array([s for disc in found for s in disc.roots])
        raise RootError(f"{size} of {number} roots right of {sigma:g} are found", estimate)
    return found


def rightmost_root(system: System, *values: npt.ArrayLike, **numbers: npt.ArrayLike) -> Any:
    r"""Return the characteristic root with the largest real part.

    Of an open loop it is a root of the closed loop, as `unstable_roots` counts these: a root
    s = 0 of D that numerator and denominator of L cancel is none. ``equation(1 + loop)`` keeps
    that root.

    Parameters
    ----------
    system : System
        The open loop L, for instance `CommonArm()`, an equation, or a map.
    *values, **numbers : array_like of float, optional
        The parameters, as `unstable_roots` takes them.

    Returns
    -------
    complex, or complex array of the broadcast shape
        In rad/s, rounded from extended precision; of a conjugate pair the one with Im >= 0.

    Raises
    ------
    TypeError, ValueError
        As `unstable_roots`, or if D has no root at all there because it is constant.
    RootError
        If no root can be certified within a few seconds; its `estimate` is the best candidate,
        nan if there is none.

    Notes
    -----
    Certified means that a small disc around s holds a root (Lemma 25), and that no root is
    counted right of Re s + m. Here m is 1e-11 of |s| or of one
    over the longest delay, whichever is larger. Where so fine a count is not decided, m is 1e-6
    of |Re s| or of one over the longest delay. Roots whose real parts differ by less than the
    first m count as equal, and the one of lowest frequency that was found is returned.

    The sign of a real part smaller than the second m is one that `unstable_roots` confirms.
    Where that count is not decided, the root is refused unless its real part is smaller than
    the first m.

    The real parts on a neutral root chain may tend to a limit that none of them reaches. Where
    no root lies right of it, a root up to m left of the limit is returned. If none is found
    there, the error names the limit. Without a delay the roots are those of a polynomial, and
    nothing is counted.

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
    system, points, shape = at_points(system, values, numbers)
    found = []
    for point in points.tolist():
        n, m = system.functions(point)
        found.append(rightmost_zero(n + m, common_zeros(n, m)))
    return np.array(found, np.complex128).reshape(shape) if shape else found[0]
