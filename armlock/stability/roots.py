"""Characteristic roots: all right of a line, and the rightmost one, found and certified.

Candidates come from Newton's method in double precision, from points of lines Re s = sigma.
Each is enclosed in a disc that holds a known number of roots (Lemma 25). The count for
D(s + sigma) says how many roots there are right of a line, so that none is missing.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import flint
import numpy as np
import numpy.typing as npt
from flint import acb, arb, fmpq_poly

from armlock.checks import ComplexArray, FloatArray, real_number, whole_steps
from armlock.engine import chain, decide, inclusion
from armlock.engine.functions import Function, Space, common_zeros
from armlock.engine.polynomials import enclosed_roots
from armlock.engine.tolerances import BOUNDARY, UNCONFINED, UndecidedError
from armlock.engine.values import ROUNDING, newton
from armlock.stability.counts import CountError, at_points, count_exactly, decided, place
from armlock.systems import System
from armlock.tables import Shown, Table
from armlock.tables import number as shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# How far right of the root that is returned no other one lies: the first share of abs(s), or of
# one over the longest delay, if so fine a count is decided in so few steps. Otherwise it is the
# second share of abs(Re s), or of one over the longest delay. Real parts that differ by less
# than half of the first count as equal.
_FINEST, _FINE = 1e-11, 1e-6
_FEW_STEPS, _MANY_STEPS = 200_000, 2_000_000
# A search ends once it has cost so many steps, some five seconds, or so many lines of a list.
_ALL_STEPS, _LINES = 4e6, 24
# Most points of one line, and from how many of them Newton's method starts.
_MOST_POINTS, _MOST_STARTS = 500_000, 1000
# A line is followed up to where roots can lie right of it, and so many turns of the longest
# delay further, but at first no longer than 1000 times that; with each line twice as far.
_TURNS_FURTHER, _MOST_TURNS_FURTHER = 4.0, 3e4
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
# Most roots that are listed, and the degree up to which those of a map are roots of one
# polynomial.
_MOST_ROOTS, _LARGEST_MAP = 10_000, 2000
# Two candidates that differ by this share are one.
_SAME = 1e-10


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
    def roots(self) -> list[complex]:
        """The centre as often as there are roots in the disc, and its conjugate."""
        pair = [self.root, self.root.conjugate()] if self.has_conjugate else [self.root]
        return pair * self.number

    def meets(self, other: _Disc) -> bool:
        """Whether two discs may overlap."""
        return not abs(self.centre - other.centre) > self.radius + other.radius


class _Balls:
    """F(s) / s^common in balls."""

    def __init__(self, function: Function, common: int) -> None:
        self.function, self.common = function, common
        self.unit = 1.0 / function.space.longest

    def series(self, s: acb, number: int) -> list[acb]:
        """Return so many Taylor coefficients at s; at a ball around s = 0 those of F s^-common.

        Those of a ball bound what is left of the series, times a power of the radius.
        """
        at_zero = self.common if s.contains(0) else 0
        found = self.function.taylor(s, number + at_zero)[at_zero:]
        for _ in range(self.common - at_zero):
            # Over s + x, one coefficient after the other.
            for k in range(number):
                found[k] = (found[k] - (found[k - 1] if k else 0)) / s
        return found

    def enclosed(self, start: complex) -> _Disc | None:
        """Follow Newton's method to a disc with as few roots as possible, or None."""
        polished: dict[int, acb | None] = {}
        for number, bits in itertools.product(range(1, 1 + _MOST_IN_A_DISC), _BITS):
            with flint.ctx.workprec(bits):
                if bits not in polished:
                    polished[bits] = self._polished(acb(start))
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
        found = self._holds(acb(s.real, abs(s.imag)), number)
        return found if found and found.centre.imag > found.radius else None

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


class _Search:
    """A search for roots of F / s^common, and how many steps it has taken."""

    def __init__(self, function: Function, common: int) -> None:
        self.function, self.steps = function, 0.0
        #: How many roots at s = 0 there are; these are known exactly.
        self.at_zero = (function.lowest or (common,))[0] - common
        self.common = common + self.at_zero
        self.balls, self.newton = _Balls(function, self.common), newton(function)
        self.unit, self.further = self.balls.unit, _TURNS_FURTHER
        own = function.space.arrays
        self.poles = np.unique(own.roots[own.present])

    def limit(self) -> float:
        """Return what real parts of a neutral chain tend to, or -inf without a chain."""
        still, *late = self.function.limits
        if self.function.space.step or not any(late):
            return -np.inf
        if not still:
            raise RootError(
                "no root is the rightmost one: what is undelayed at the highest power of s is "
                "zero",
                complex(np.nan, np.nan),
            )
        sizes = np.array([float(abs(c / still)) for c in late])
        return chain.real_part_limit(self.function.space.lags, 1.0, sizes)

    def count(self, sigma: float, most: int = _MANY_STEPS) -> int:
        """Count the roots right of a line; below zero where that is not decided."""
        try:
            return decide.count(self.function, self.common, right_of=sigma, most=most)
        except UndecidedError:
            self.steps += most
            return BOUNDARY

    def candidates(self, sigma: float, most: int = _MOST_STARTS) -> ComplexArray:
        """Return where Newton's method leads from a line, the rightmost first."""
        space, functions = self.function.shifted(sigma)
        # Far to the right the longer delays no longer act.
        acting = space.arrays.delays[functions.delayed[0].any(axis=0)].max(initial=0.0)
        turn = 2.0 * np.pi / (float(acting) or space.longest)
        end = np.pi / space.step if space.step else _last_met(space, functions)
        if not space.step:
            end = min(end, 1e3 * self.further * turn) + self.further * turn
        begin = 1e-3 * _SLOWEST * turn
        grid, move = inclusion.resolved(functions, begin, end, _MOST_POINTS)
        self.steps += grid.size
        s = sigma + 1j * grid
        move = move / (1.0 - self.common * move / s)
        length = np.nan_to_num(np.abs(move), nan=np.inf)
        # From where a step of Newton's method is locally shortest: no root close to the line
        # lies between two of its points.
        wider = np.pad(length, 1, constant_values=np.inf)
        here = (length <= wider[:-2]) & (length < wider[2:])
        s = (s - move)[here]
        s = s[np.argsort(-s.real, kind="stable")][:most]
        # Next to lightly damped poles rounding may hide D; its roots there lie next to them.
        return self.led(np.append(s, self.poles + 1j * begin), turn)

    def led(self, s: ComplexArray, turn: float, known: Iterable[complex] = ()) -> ComplexArray:
        """Return where Newton's method comes close to a root, the rightmost first.

        Known roots are divided out.
        """
        self.steps += _STEPS * s.size
        divided = np.array([*known, *[0.0] * self.common], np.complex128)
        length = np.full(s.shape, np.inf)
        for _ in range(_STEPS):
            step, off = self.newton.roughly(s, (1.0,))
            away = (1.0 / np.subtract.outer(s, divided)).sum(axis=1)
            move = np.where(step == 0.0, 0.0, 1.0 / (1.0 / step - away))
            # Where F is rounding errors, so is the step.
            rounding = np.where(step == 0.0, 0.0, ROUNDING * off * np.abs(step))
            s, length = s - move, np.abs(move) + rounding
        # Slow roots are far smaller than a turn.
        found = s[length <= np.minimum(1e-5 * turn, 1e-3 * np.abs(s) + _SLOWEST * turn)]
        return found[np.argsort(-found.real, kind="stable")]

    def near(self, sigma: float) -> complex | None:
        """Return the rightmost root near a line, of equal ones that of lowest frequency."""
        found = self.candidates(sigma)
        for top in found[:_MOST_TRIED]:
            least = top.real - 0.5 * _FINEST * max(abs(top), self.unit)
            equal = found[found.real >= least]
            lowest = complex(equal[np.argmin(np.abs(equal.imag))])
            if disc := self.balls.enclosed(lowest):
                return disc.root
        return None

    def is_rightmost(self, root: complex) -> bool:
        """Whether a count just right of a root is zero."""
        finest = _FINEST * max(abs(root), self.unit)
        number = self.count(root.real + finest if root else 0.0, _FEW_STEPS)
        if number < 0:
            fine = max(finest, self.fine(root.real))
            # The side of the axis is that of the count.
            number = self.count(0.0 if -fine < root.real < 0.0 else root.real + fine)
        return number == 0

    def fine(self, real: float) -> float:
        """How far right of a root of a real part no other one lies, at most."""
        return _FINE * max(abs(real), self.unit)

    @np.errstate(all="ignore")
    def rightmost(self) -> complex:
        """Return the rightmost root, or raise a `RootError`.

        Line after line is tried. The counts on the lines enclose the root, so that the interval
        between two lines is halved until it is found.
        """
        limit, best = self.limit(), complex(np.nan, np.nan)
        # Left of this line, just right of the limit, no count is decided.
        first = limit + 0.25 * self.fine(limit) if np.isfinite(limit) else limit
        if self.at_zero and self.is_rightmost(0j):
            return 0j
        # There are roots right of `low`, as far as is decided, and none right of `high`.
        low, high, sigma, width = -np.inf, np.inf, max(0.0, first), self.unit
        small = _SLOWEST * self.unit
        while self.steps < _ALL_STEPS and -_LARGEST_EXPONENT * self.unit < sigma:
            root = self.near(sigma)
            if self.at_zero and (root is None or root.real < 0.0):
                root = 0j
            # Next to the limit of a chain no count tells that roots lie right of `low`.
            if root is not None and root.real + self.fine(root.real) > low:
                best = root
                if self.is_rightmost(root):
                    return root
                low = max(low, root.real)
            if low < sigma < high:
                number = self.count(sigma)
                if number == UNCONFINED:
                    break
                low, high = (low, sigma) if number == 0 else (sigma, high)
            if self.further == _MOST_TURNS_FURTHER:
                break
            self.further = min(2.0 * self.further, _MOST_TURNS_FURTHER)
            if low > -np.inf and high < np.inf:
                # Roots next to the axis may be slower than the delays by many decades.
                sinhs = np.arcsinh(np.array([low, high]) / small)
                sigma = float(small * np.sinh(0.5 * sinhs.sum()))
            else:
                sigma = low + width if low > -np.inf else high - width
                width *= 4.0
            # No root is known between the limit of a chain and `high`.
            if -np.inf < low < first or sigma < first:
                sigma = first
            elif sigma in (low, high):
                break
        why = ""
        if limit > -np.inf:
            why = (
                f": {'no' if high == first else 'perhaps a'} root lies right of Re s = "
                f"{limit:.6g}, the limit that neutral root chains may tend to"
            )
        raise RootError(
            f"no rightmost root could be certified{why}; the best candidate is {best}", best
        )

    @np.errstate(all="ignore")
    def right_of(self, sigma: float, number: int) -> list[_Disc]:
        """Return discs of all roots right of a line, of which there are so many, or of some."""
        found, places, radii = list[_Disc](), np.zeros(0, np.complex128), np.zeros(0)
        if self.at_zero and sigma < 0.0:
            number -= self.at_zero
        missing = number

        def keep(starts: ComplexArray) -> bool:
            """Enclose what is new, and tell whether something was."""
            nonlocal places, radii, missing
            before = missing
            for start in starts.tolist():
                there = complex(start.real, abs(start.imag))
                if missing <= 0 or (np.abs(places - there) <= _SAME * abs(there)).any():
                    continue
                disc = self.balls.enclosed(there)
                if disc is None or not disc.centre.real - disc.radius > sigma:
                    continue
                # A root is its disc's centre but for a radius in either part, and for rounding.
                reach, radius = 1e-9 * abs(disc.root), 3.0 * float(disc.radius)
                close = np.abs(places - disc.root) <= reach + radius + radii
                if not any(disc.meets(found[k]) for k in np.flatnonzero(close)):
                    found.append(disc)
                    places, radii = np.append(places, disc.root), np.append(radii, radius)
                    missing -= len(disc.roots)
            return missing < before

        turns, line = np.exp(2j * np.pi * (np.arange(6) + 0.3) / 6.0), sigma
        for k in range(_LINES):
            new = keep(self.candidates(line, max(2 * number, _MOST_STARTS))) or not k
            while missing > 0 and new:
                # Newton's method for F over the factors of what is known leads elsewhere.
                known = np.array([s for disc in found for s in disc.roots], np.complex128)
                starts = np.concatenate((self.poles, known, [line]))
                starts = starts[np.argsort(np.abs(starts - line))][: _MOST_STARTS // 6]
                around = np.abs(starts) + 1e-9 * self.unit
                starts = (starts[:, None] + around[:, None] * turns).ravel()
                new = keep(self.led(starts, 2.0 * np.pi * self.unit, known))
            if missing <= 0 or self.steps > _ALL_STEPS:
                break
            self.further = min(2.0 * self.further, _MOST_TURNS_FURTHER)
            line = sigma + 0.25 * self.unit * (2.0**k)
        if self.at_zero and sigma < 0.0:
            found.append(_Disc(acb(0), arb(0), self.at_zero, has_conjugate=False))
        return found


def _last_met(space: Space, functions: inclusion.Functions) -> float:
    """Frequency up to which delayed terms are as large as all else, from samples.

    What a search finds depends on it, but no count.
    """
    a, steady, delayed = space.arrays, functions.steady[0], functions.delayed[0]
    omega = np.geomspace(1e-3 * space.corners[0], 1e6 * space.corners[-1], 500)
    over = 1.0 / (omega + a.scale[:, None])
    factors = np.where(a.present[..., None], (1j * omega - a.roots[..., None]) * over, over)
    p = a.lead[:, None] * factors.prod(axis=1)
    late = np.abs(delayed.T @ p).sum(axis=0)
    met = np.flatnonzero(np.abs((steady - delayed.sum(axis=1)) @ p) <= late)
    return float(omega[min(met[-1] + 1, 499)]) if met.size else 0.0


def _of_polynomial(function: Function, common: int) -> list[_Disc] | None:
    """Return all roots of a function without delays, or of a map of low degree; else None.

    Those of a map are logarithms of the roots of one polynomial of exp(s step). It tells slow
    poles apart, which rounding hides from a count.
    """
    step, p = function.space.step, fmpq_poly([0])
    if not step and any(theta for theta, _ in function.by_delay):
        return None
    for theta, part in function.by_delay:
        back = whole_steps("delay", float(theta), step) if step else 0
        if back > _LARGEST_MAP:
            return None
        # Of a map this is a polynomial of 1 / z.
        p += part * fmpq_poly([0, 1]) ** back
    p //= fmpq_poly([-1 if step else 0, 1]) ** common
    found = []
    with flint.ctx.workprec(_BITS[0]):
        for root, number in enclosed_roots(p) if p.degree() > 0 else ():
            if root.imag < 0:
                continue
            s, own = root, root.imag.contains(0)
            if step:
                # Next to the negative real axis the angle of a root jumps.
                s = -(-root if own and root.real < 0 else root).log() / arb(step)
                s = acb(s.real, arb.pi() / arb(step) if own and root.real < 0 else -s.imag)
            radius = abs(acb(s.real.rad(), s.imag.rad())).upper()
            found.append(_Disc(s.mid(), arb(radius), number, not own))
    return sorted(found, key=lambda disc: (-disc.root.real, disc.root.imag))


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
        title = f"{len(self)} roots right of Re s = {self.right_of:g} rad/s"
        return Table(title, rows if len(self) else [])

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
      real part           frequency       damping     time constant
      -0.000589639 rad/s  0.306552 rad/s  0.00192345  1695.95 s
      -0.00228944 rad/s   0.613422 rad/s  0.00373222  436.788 s
    """
    sigma = real_number("right_of", right_of)
    system, points, shape = at_points(system, values, numbers)
    if shape:
        raise ValueError(f"parameters must be numbers, got arrays of the shape {shape}")
    n, m = system.functions(points[0].tolist())
    with decided("no roots", points[0]):
        number = count_exactly(n, m, sigma)
    if number == UNCONFINED:
        raise ValueError(
            f"right_of must lie right of the limit of the neutral chain, got {sigma:g}: "
            "infinitely many roots may lie right of it"
        )
    if number == BOUNDARY:
        raise CountError(
            f"no roots{place(points[0])}: one lies on the line Re s = {sigma:g}, or nearer to "
            "it than rounding can tell; choose another right_of",
            points,
        )
    if number > _MOST_ROOTS:
        raise ValueError(
            f"right_of must leave at most {_MOST_ROOTS} roots, got {sigma:g} with {number}"
        )
    discs = _of_polynomial(n + m, common_zeros(n, m))
    if discs is not None:
        discs = [disc for disc in discs if disc.centre.real > sigma]
    elif n.space.step:
        raise ValueError(f"system must have at most {_LARGEST_MAP} steps in its longest delay")
    else:
        discs = _Search(n + m, common_zeros(n, m)).right_of(sigma, number)
    found = [(s, float(disc.radius)) for disc in discs for s in disc.roots]
    found.sort(key=lambda pair: (-pair[0].real, abs(pair[0].imag), -pair[0].imag))
    roots = np.array([s for s, _ in found], np.complex128)
    if roots.size != number:
        raise RootError(
            f"{roots.size} of {number} roots right of {sigma:g} are found; choose another "
            "right_of",
            roots,
        )
    return CharacteristicRoots(roots, np.array([r for _, r in found], np.float64), sigma)


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
    of |Re s| or of one over the longest delay, and a root less than m left of the imaginary
    axis is certified by a count right of the axis. Roots whose real parts differ by less than
    half of the first m count as equal, and the one of lowest frequency that was found is
    returned.

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
        found.append(_rightmost(n + m, common_zeros(n, m)))
    return np.array(found, np.complex128).reshape(shape) if shape else found[0]


def _rightmost(function: Function, common: int) -> complex:
    """Return the root of F / s^common with the largest real part."""
    discs = None if function.delayed.any() else _of_polynomial(function, common)
    if discs is None:
        try:
            return _Search(function, common).rightmost()
        except RootError:
            discs = _of_polynomial(function, common)
            if discs is None:
                raise
    if not discs:
        raise ValueError("the parameters must leave a loop with roots: D is constant")
    return discs[0].root
