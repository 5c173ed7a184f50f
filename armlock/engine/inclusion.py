"""Functions on intervals of the imaginary axis, enclosed by Taylor polynomials; compiled.

A space holds polynomials p_j and delays theta_k, and a function of the space is

    F(s) = sum_j p_j(s) [S_j + sum_k W_jk (exp(-s theta_k) - 1)] .

*The enclosure* (`enclose`). On the interval s = j (m + r t) with -1 <= t <= 1, F is enclosed by
F_0 + F_1 t + F_2 t^2 + F_3 t^3, by terms C_k(t) of any phase for exponentials that turn too
fast there, and by a remainder. All polynomials are divided by one positive number for each
interval, so that arguments and signs remain.

*Whether zero is excluded* (`excludes_zero`). A test has vertices and terms, combinations of
enclosed functions. Zero is excluded if all vertices lie on one side of a line through zero,
farther from it than all terms together reach. The line may turn along the interval.

*The walks.* `wind` adds up the angles by which a function turns, from which a count follows.
`walk` looks for the least level at which a family has a zero, and `cross` for all zeros of the
rows of a chart. `resolved` only samples a function. Each of them halves intervals until each is
decided. An interval that double precision does not halve any more is undecided (`_halve`, and
`armlock.engine.tolerances`).

The lemmas are those of the book's appendix "The lemmas behind a count". All compiled code of
the engine is in this module, because numba compiles a function again when its own file or a
number that it imports changes, but not when the file of a function it calls does. Pass no
literal number to a function: numba would compile the function again for this number.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from armlock.checks import BoolArray, ComplexArray, FloatArray, IntArray
from armlock.compiled import njit
from armlock.engine.tolerances import (
    EPSILON,
    FEW_UNDECIDED,
    LOWEST,
    MANY_UNDECIDED,
    NARROWEST,
)

#: Number of Taylor coefficients that are kept.
ORDER = 4
# An exponential that turns by more than this, in rad, over half an interval is not resolved.
_FAST = 1.5
# Two of them that turn by no more than this beside each other share a free phase.
_TOGETHER = 0.3
# An interval over which an exponential turns by more than twice this, in rad, is a long one.
_LONG = 30.0
# Polynomials are rescaled before they leave these bounds.
_HUGE = 1e150
# A piece of the axis has this half width over the sum of 1 / distance to a root. It serves
# intervals down to its length over `_SUBINTERVALS`.
_PIECE, _SUBINTERVALS = 0.02, 4096.0
# Most steps to a crossing: three for each halving that double precision allows.
_MOST_LOCATED = 160
# Room for halves of halves: geometric ones to a few rad/s apart, and 52 more.
_DEEPEST = 300
#: Kinds of members of a test: a vertex, and a term of any phase.
VERTEX, TERM = 1, 2
# The goals of a search, see `_aim`.
DISTANCE, PHASE, DELAY, REAL = range(4)

# Entries are called from Python. Of what they call, `_maker` makes or returns arrays, `_inner`
# does not, and `_inlined` is a step of one or two others.
_entry = njit()
_maker = njit(inner=True)
_inner = njit(inner=True, allocates=False)
_inlined = njit(inner=True, allocates=False, inlined=True)


# ------------------------------------------------------------------------------ the enclosure


class Arrays(NamedTuple):
    """A space as compiled functions take it: J polynomials of degree n or less, K delays.

    Attributes
    ----------
    roots : complex array, shape (J, n)
        Column by column roots of similar size.
    present : bool array, shape (J, n)
        Whether polynomial j has a root in this column.
    computed : bool array, shape (J, n)
        Whether a root was computed, so that `missed` is a share of its factor too.
    scale : float array, shape (n,)
        The polynomials are divided by abs(s + scale) of each column.
    lead, missed : float arrays, shape (J,)
        Highest coefficients, and what roots that were computed miss, see `Polynomial`.
    delays, tails : float arrays, shape (K,)
        The delays in s, ascending, and what they are rounded by.
    """

    roots: ComplexArray
    present: BoolArray
    computed: BoolArray
    scale: FloatArray
    lead: FloatArray
    missed: FloatArray
    delays: FloatArray
    tails: FloatArray


class Functions(NamedTuple):
    """Functions of one space, as compiled functions take them.

    Attributes
    ----------
    space : Arrays
        Of all functions.
    steady, delayed : float arrays, shapes (n, J) and (n, J, K)
        The weights S and W.
    uncertain : float array, shape (n, J)
        The error of S.
    """

    space: Arrays
    steady: FloatArray
    delayed: FloatArray
    uncertain: FloatArray


class Workspace(NamedTuple):
    """Arrays that an inclusion of some functions fills, see `include`."""

    piece: FloatArray  # (2,): middle and half width of the piece of the axis expanded last
    piece_p: ComplexArray  # (J, ORDER), and (J, ORDER + 1): the polynomials on that piece
    piece_bound: FloatArray
    factor: FloatArray  # (n,)
    shift: IntArray  # (J,)
    p: ComplexArray  # (J, ORDER): Taylor coefficients of the polynomials
    bound: FloatArray  # (J, ORDER + 1): bounds of them on the interval
    error: FloatArray  # (J,): rounding error of p over its bound, but for `missed`
    lead: IntArray  # (K,): the delay that each delay is taken relative to; -1 for none
    turn: ComplexArray  # (K, ORDER): Taylor coefficients of these exponentials, less one
    angle: FloatArray  # (K,): by how much they turn, in rad, over half the interval
    slip: FloatArray  # (K,): error of their phases at the middle
    # (functions, 1 + K, ORDER): the part without a free phase, then the part with each of them.
    f: ComplexArray
    rest: FloatArray  # (functions,): remainder and rounding
    rounding: FloatArray  # (functions,): the rounding alone
    g: ComplexArray  # (ORDER,), and (ORDER + 1,) bounds
    b: FloatArray


@_maker
def workspace(space: Arrays, functions: int) -> Workspace:
    """Return a workspace for so many functions."""
    j, k = space.lead.size, space.delays.size
    return Workspace(
        np.full(2, -1.0),
        np.zeros((j, ORDER), np.complex128),
        np.zeros((j, ORDER + 1)),
        np.zeros(space.scale.size),
        np.zeros(j, np.int64),
        np.zeros((j, ORDER), np.complex128),
        np.zeros((j, ORDER + 1)),
        np.zeros(j),
        np.zeros(k, np.int64),
        np.zeros((k, ORDER), np.complex128),
        np.zeros(k),
        np.zeros(k),
        np.zeros((functions, 1 + k, ORDER), np.complex128),
        np.zeros(functions),
        np.zeros(functions),
        np.zeros(ORDER, np.complex128),
        np.zeros(ORDER + 1),
    )


@_inlined
def _copy(source: Any, target: Any) -> None:
    """Copy a row; between slices numba copies it twice."""
    for i in range(source.size):
        target[i] = source[i]


@_inlined
def _scale(row: Any, by: float) -> None:
    """Multiply a row by a number."""
    for i in range(row.size):
        row[i] *= by


@_inlined
def _expand_piece(space: Arrays, m: float, r: float, work: Workspace) -> None:
    """Expand all polynomials on a piece of the axis, factor by factor (Lemma 1)."""
    n, top = space.scale.size, 0
    work.piece[0], work.piece[1] = m, r
    for k in range(n):
        work.factor[k] = 1.0 / np.sqrt(space.scale[k] * space.scale[k] + m * m)
    for j in range(space.lead.size):
        p, bound = work.piece_p[j], work.piece_bound[j]
        p[:] = 0.0
        bound[:] = 0.0
        p[0], bound[0] = space.lead[j], abs(space.lead[j])
        missed, shift = space.missed[j], 0
        for k in range(n):
            f = work.factor[k]
            if space.present[j, k]:
                z = space.roots[j, k]
                w, d = complex(-z.real * f, (m - z.imag) * f), r * f
                size = np.sqrt(w.real * w.real + w.imag * w.imag) + d
                for i in range(ORDER, 0, -1):
                    bound[i] = bound[i] * size + bound[i - 1] * d
                bound[0] *= size
                for i in range(ORDER - 1, 0, -1):
                    q = p[i - 1]
                    p[i] = p[i] * w + complex(-d * q.imag, d * q.real)
                p[0] *= w
                if space.computed[j, k]:
                    # What is missed is a share of the product of abs(s) + abs(root).
                    missed *= (m + r + abs(z)) * f / size
            else:
                for i in range(ORDER):
                    p[i] *= f
                    bound[i] *= f
                bound[ORDER] *= f
            if bound[0] > _HUGE or 0.0 < bound[0] < 1.0 / _HUGE:
                by = 1.0 / _HUGE if bound[0] > 1.0 else _HUGE
                shift += 1 if bound[0] > 1.0 else -1
                _scale(p, by)
                _scale(bound, by)
        work.error[j] = 8.0 * (n + 1) * EPSILON + missed
        work.shift[j] = shift
        top = shift if j == 0 else max(top, shift)
    for j in range(space.lead.size):
        if work.shift[j] != top:
            by = _HUGE ** float(max(work.shift[j] - top, -2))
            _scale(work.piece_p[j], by)
            _scale(work.piece_bound[j], by)


# Two pi in three parts, of which the first two have 27 digits: their products with a number of
# turns below 2^26 are exact.
_TURN = 6.283185303211212, 3.968374295837407e-09, 2.2884754904439327e-17
_MOST_TURNS = 2.0**26


@_inlined
def _phase(theta: float, tail: float, m: float) -> tuple[float, float]:
    """Return (theta + tail) m less whole turns, and a bound of its error in rad (Lemma 6)."""
    product, off = theta * m, tail * m
    # The tail of a difference of two delays may exceed what its float rounds by.
    wrong = 3.0 * EPSILON * abs(off)
    turns = np.round(product / 6.283185307179586)
    if turns > _MOST_TURNS:
        return product % 6.283185307179586 + off, 4.0 * EPSILON * product + wrong
    # What the product rounds by, after Dekker: both factors are split in halves.
    a, b = theta * 134217729.0, m * 134217729.0
    a, b = a - (a - theta), b - (b - m)
    c, d = theta - a, m - b
    low = ((a * b - product) + a * d + c * b) + c * d
    phase = ((product - turns * _TURN[0]) - turns * _TURN[1]) - turns * _TURN[2]
    return phase + (low + off), EPSILON * min(2.0 * product, 16.0) + wrong


@_inlined
def _expand_polynomials(space: Arrays, m: float, r: float, work: Workspace) -> None:
    """Expand all polynomials about j m, from a longer piece of the axis where one serves."""
    own = False
    inside = abs(m - work.piece[0]) + r <= work.piece[1]
    if not inside or r < work.piece[1] / _SUBINTERVALS:
        nearest = 0.0
        for j in range(space.lead.size):
            total = 0.0
            for k in range(space.scale.size):
                if space.present[j, k]:
                    z = space.roots[j, k]
                    total += 1.0 / np.sqrt(z.real * z.real + (m - z.imag) * (m - z.imag))
            nearest = max(nearest, total)
        length = min(_PIECE / nearest, 0.5 * _SUBINTERVALS * r) if nearest > 0.0 else 0.0
        own = length <= 4.0 * r
        _expand_piece(space, m, r if own else length, work)
    ratio = r / work.piece[1] if work.piece[1] > 0.0 else 1.0
    u = (m - work.piece[0]) / work.piece[1] if work.piece[1] > 0.0 else 0.0
    for j in range(space.lead.size):
        c, bound = work.piece_p[j], work.piece_bound[j]
        work.p[j, 0] = c[0] + u * (c[1] + u * (c[2] + u * c[3]))
        work.p[j, 1] = ratio * (c[1] + u * (2.0 * c[2] + 3.0 * u * c[3]))
        work.p[j, 2] = ratio * ratio * (c[2] + 3.0 * u * c[3])
        work.p[j, 3] = ratio * ratio * ratio * c[3]
        # The remainder stays that of the piece; derivatives shrink with the interval.
        power = 1.0
        for i in range(ORDER):
            work.bound[j, i] = power * bound[i]
            power *= ratio
        work.bound[j, ORDER] = bound[ORDER]
    if own:
        # An expansion on a piece this long is too coarse for the parts of the interval.
        work.piece[1] = -1.0


@_inlined
def _expand_exponentials(space: Arrays, m: float, r: float, work: Workspace) -> None:
    """Expand all exponentials about j m, those that turn fast relative to a free phase."""
    lead = -1
    for k in range(space.delays.size):
        # Delays whose exponentials turn fast share one free phase with those next to them.
        since = space.delays[k] - (space.delays[lead] if lead >= 0 else 0.0)
        tail = space.tails[k]
        if since * r > (_FAST if lead < 0 else _TOGETHER):
            lead, since, tail = k, 0.0, 0.0
        elif lead >= 0:
            # What the difference rounds by.
            back = since - space.delays[k]
            tail += space.delays[k] - (since - back) - (space.delays[lead] + back)
            tail -= space.tails[lead]
        work.lead[k], work.angle[k] = lead, (since + tail) * r
        phase, work.slip[k] = _phase(since, tail, m)
        sine, cosine = np.sin(0.5 * phase), np.cos(0.5 * phase)
        # exp(-j a) - 1 = -2 sin^2(a/2) - 2 j sin(a/2) cos(a/2) keeps its digits.
        work.turn[k, 0] = complex(-2.0 * sine * sine, -2.0 * sine * cosine)
        q = 1.0 + work.turn[k, 0]
        for i in range(1, ORDER):
            q = complex(q.imag, -q.real) * (work.angle[k] / i)
            work.turn[k, i] = q


@_inlined
def _bracket(
    steady: float, row: FloatArray, uncertain: float, lead: int, work: Workspace
) -> tuple[bool, float]:
    """Expand S + sum_k W_k (exp(-s theta_k) - 1), as far as it follows one free phase.

    With `lead` -1 it is what no free phase turns, and otherwise what the free phase of that
    delay does. Fills `g` and its bounds `b`; returns whether a weight acts, and the error of g.
    """
    few, wrong, used = (2.0 + row.size) * EPSILON, 0.0, False
    work.g[:] = 0.0
    work.b[ORDER] = 0.0
    if lead < 0:
        used = steady != 0.0 or uncertain != 0.0
        wrong = uncertain + abs(steady) * few
        for k in range(row.size):
            if work.lead[k] >= 0 and row[k] != 0.0:
                steady -= row[k]
                wrong += abs(row[k]) * few
                used = True
        work.g[0] = steady
    for k in range(row.size):
        weight, size, x = row[k], abs(row[k]), work.angle[k]
        if work.lead[k] != lead or weight == 0.0:
            continue
        used, power, grown = True, size, x + x * x
        if lead >= 0:
            work.g[0] += weight
            wrong += size * few
        for i in range(ORDER):
            work.g[i] += weight * work.turn[k, i]
            power *= x / (i + 1)
        work.b[ORDER] += power
        wrong += size * few * (abs(work.turn[k, 0]) + 6.0 * grown)
        wrong += size * work.slip[k] * (1.0 + grown)
    for i in range(ORDER - 1, -1, -1):
        work.b[i] = abs(work.g[i]) + (i + 1) * work.b[i + 1]
    return used, wrong


@_inlined
def combine(functions: Functions, n: int, work: Workspace) -> None:
    """Enclose function n on the expanded interval (Lemmas 4, 7)."""
    steady, delayed, uncertain = (
        functions.steady[n],
        functions.delayed[n],
        functions.uncertain[n],
    )
    delays = functions.space.delays.size
    sums, rest, rounding = (16.0 + 2.0 * (steady.size + delays)) * EPSILON, 0.0, 0.0
    work.f[n] = 0.0
    for j in range(steady.size):
        for lead in range(-1, delays):
            if lead >= 0 and work.lead[lead] != lead:
                continue
            used, wrong = _bracket(steady[j], delayed[j], uncertain[j], lead, work)
            if not used:
                continue
            rest += work.bound[j, ORDER] * work.b[0]
            rounding += work.bound[j, 0] * ((work.error[j] + sums) * work.b[0] + wrong)
            for i in range(ORDER):
                total = 0j
                for low in range(i + 1):
                    total += work.p[j, low] * work.g[i - low]
                rest += work.bound[j, i] * work.b[ORDER - i]
                work.f[n, 1 + lead, i] += total
    # The bounds round too.
    work.rest[n] = (rest + rounding) * (1.0 + 1e-12)
    work.rounding[n] = rounding


@_inner
def enclose(functions: Functions, m: float, r: float, work: Workspace) -> None:
    """Enclose functions on an interval, as many as the workspace has room for."""
    _expand_polynomials(functions.space, m, r, work)
    _expand_exponentials(functions.space, m, r, work)
    for n in range(work.f.shape[0]):
        combine(functions, n, work)


@_entry
def values(functions: Functions, omega: FloatArray) -> ComplexArray:
    """Functions at frequencies, times positive numbers, shape (functions, frequencies)."""
    n = functions.steady.shape[0]
    found, work = np.empty((n, omega.size), np.complex128), workspace(functions.space, n)
    for i in range(omega.size):
        enclose(functions, omega[i], 0.0, work)
        _copy(work.f[:, 0, 0], found[:, i])
    return found


@_inner
def _at(c: ComplexArray, t: float) -> Any:
    """Evaluate a Taylor polynomial."""
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]))


# -------------------------------------------------------------------- whether zero is excluded


@_inner
def _acts(parts: ComplexArray, k: int) -> bool:
    """Whether part k of a function or member counts: the first, or a term that is not zero."""
    acts = k == 0
    for i in range(ORDER):
        acts |= parts[k, i] != 0.0
    return acts


@_inner
def _divide(c: ComplexArray, by: ComplexArray, quotient: ComplexArray) -> float:
    """Divide Taylor polynomials; return the size of the remainder's coefficients (Lemma 9)."""
    left = 0.0
    for n in range(2 * ORDER - 1):
        v = c[n] if n < ORDER else 0j
        for i in range(max(0, n - ORDER + 1), min(n, ORDER)):
            v -= quotient[i] * by[n - i]
        if n < ORDER:
            quotient[n] = v / by[0]
        else:
            left += abs(v)
    return left


@_inner
def _least(
    c: ComplexArray, along: ComplexArray, gamma: float, vertex: bool, q: ComplexArray
) -> tuple[float, float]:
    """Bound the real part of a vertex from below at both ends, or minus the size of a term.

    Along the direction along[0] where gamma is 0, else as shares of the polynomial `along`,
    whose least size is gamma. Both bounds are concave in t, so that the ends suffice.
    """
    if gamma == 0.0:
        off, turned = 0.0, along[0].conjugate()
        for i in range(ORDER):
            q[i] = c[i] * turned
    else:
        # The quotient rounds by less than 64 EPSILON.
        off = _divide(c, along, q)
        for i in range(ORDER):
            off += 64.0 * EPSILON * abs(c[i])
        off /= gamma
    if vertex:
        for i in range(2, ORDER):
            off += abs(q[i].real)
        return (q[0] - q[1]).real - off, (q[0] + q[1]).real - off
    if gamma > 0.0:
        # The square of the magnitude, which turning alone leaves as it is.
        square, size = 0.0, 0.0
        for i in range(ORDER):
            size += abs(q[i])
        by = 1.0 / size if size > 0.0 else 0.0
        for n in range(2 * ORDER - 1):
            power = 0.0
            for i in range(max(0, n - ORDER + 1), min(n + 1, ORDER)):
                power += (q[i] * by * (q[n - i] * by).conjugate()).real
            square += abs(power)
        off += size * np.sqrt(square + 16.0 * EPSILON)
        return -off, -off
    for i in range(2, ORDER):
        off += abs(q[i])
    return -abs(q[0] - q[1]) - off, -abs(q[0] + q[1]) - off


class Members(NamedTuple):
    """Members of a test, which `mix` makes: vertices and terms of any phase."""

    kind: IntArray  # (members,)
    v: ComplexArray  # (members, 1 + K, ORDER), as `f` of a workspace
    rest: FloatArray  # (members,)
    along: ComplexArray  # (ORDER,), of the last test that held: direction or polynomial
    slow: ComplexArray  # (ORDER,)
    q: ComplexArray  # (ORDER,)
    weights: ComplexArray  # (functions,), of the member that is made next


@_maker
def members(kind: IntArray, functions: Functions) -> Members:
    """Return room for members of these kinds, combinations of these functions."""
    size, delays = kind.size, functions.space.delays.size
    return Members(
        kind,
        np.zeros((size, 1 + delays, ORDER), np.complex128),
        np.zeros(size),
        np.zeros(ORDER, np.complex128),
        np.zeros(ORDER, np.complex128),
        np.zeros(ORDER, np.complex128),
        np.zeros(functions.steady.shape[0], np.complex128),
    )


@_inner
def mix(work: Workspace, room: Members, n: int) -> None:
    """Make member n, the combination of the functions with the weights."""
    room.v[n] = 0.0
    room.rest[n] = 0.0
    for f in range(room.weights.size):
        a = room.weights[f]
        if a != 0.0:
            for k in range(work.f.shape[1]):
                if _acts(work.f[f], k):
                    for i in range(ORDER):
                        room.v[n, k, i] += a * work.f[f, k, i]
            room.rest[n] += abs(a) * (work.rest[f] + 4.0 * EPSILON * abs(work.f[f, 0, 0]))


@_inner
def _holds(room: Members, gamma: float) -> bool:
    """Whether every vertex exceeds all terms of any phase, along a direction or in shares."""
    unit = gamma if gamma > 0.0 else 1.0
    low, high = 0.0, 0.0
    for kind in (TERM, VERTEX):
        for n in range(room.kind.size):
            if room.kind[n] != kind:
                continue
            a, b = -room.rest[n] / unit, -room.rest[n] / unit
            for k in range(room.v.shape[1]):
                if _acts(room.v[n], k):
                    vertex = kind == VERTEX and k == 0
                    e, f = _least(room.v[n, k], room.along, gamma, vertex, room.q)
                    a, b = a + e, b + f
            if kind == TERM:
                low, high = low + a, high + b
            elif not min(low + a, high + b) > 0.0:
                return False
    return True


@_inner
def excludes_zero(room: Members) -> int:
    """Tell how zero is excluded from the hull of the vertices plus any terms (Lemmas 8, 9).

    0 if that is not shown; 1 along a direction, which is along[0] then; 2 by shares of the
    polynomial `along`.
    """
    common, vertices, slow = 0.0, 0, room.slow
    slow[:] = 0.0
    for n in range(room.kind.size):
        if room.kind[n] == TERM:
            for k in range(room.v.shape[1]):
                common += abs(room.v[n, k, 0])
    turned, low, high, last, own = 1.0 + 0j, 10.0, -10.0, 0, 0.0
    for n in range(room.kind.size):
        if room.kind[n] != VERTEX:
            continue
        size, own = abs(room.v[n, 0, 0]), common
        for k in range(1, room.v.shape[1]):
            own += abs(room.v[n, k, 0])
        if not own < size < np.inf:
            return 0
        if vertices == 0:
            turned = room.v[n, 0, 0] / size
        vertices, last = vertices + 1, n
        for i in range(ORDER):
            slow[i] += room.v[n, 0, i] / size
        half = np.arcsin(own / size) if own > 0.0 else 0.0
        for sign in (-1.0, 1.0):
            end = (room.v[n, 0, 0] + sign * room.v[n, 0, 1]) * turned.conjugate()
            angle = np.arctan2(end.imag, end.real)
            low, high = min(low, angle - half), max(high, angle + half)
    if vertices == 1 and own == 0.0:
        # Of a single line the direction of its point nearest to zero.
        slope = room.v[last, 0, 1] / abs(room.v[last, 0, 0])
        length = slope.real * slope.real + slope.imag * slope.imag
        t = -(turned * slope.conjugate()).real / length if length > 0.0 else 0.0
        direction = turned + min(max(t, -1.0), 1.0) * slope
    elif high - low < np.pi:
        middle = 0.5 * (low + high)
        direction = turned * complex(np.cos(middle), np.sin(middle))
    else:
        direction = 0j
    size = abs(direction)
    if size > 0.0:
        room.along[0] = direction / size
        if _holds(room, 0.0):
            return 1
    gamma = (1.0 - 16.0 * EPSILON) * abs(slow[0])
    for i in range(1, ORDER):
        gamma -= abs(slow[i])
    if gamma > 0.0 and (vertices > 1 or own > 0.0):
        _copy(slow, room.along)
        if _holds(room, gamma):
            return 2
    return 0


@_inner
def _turn_together(room: Members) -> bool:
    """Mix the one vertex and the one term, so that one of them loses what delays turn in both.

    Zero is in vertex plus term, for some phase of the term, if it is after that (Lemma 20).
    Returns whether there is such a pair.
    """
    vertex, term, number = -1, -1, 0
    for n in range(room.kind.size):
        vertex = n if room.kind[n] == VERTEX else vertex
        term = n if room.kind[n] == TERM else term
        number += room.kind[n] != 0
    if number != 2 or vertex < 0 or term < 0:
        return False
    most, share = 0.0, 0j
    for k in range(1, room.v.shape[1]):
        v, a = room.v[vertex, k, 0], room.v[term, k, 0]
        if min(abs(v), abs(a)) > most:
            most = min(abs(v), abs(a))
            share = (a / v).conjugate() if abs(a) < abs(v) else v / a
    if not 0.0 < abs(share) < 1.0 - 1e-9:
        return False
    wrong = 0.0
    for k in range(room.v.shape[1]):
        for i in range(ORDER):
            v, a = room.v[vertex, k, i], room.v[term, k, i]
            room.v[vertex, k, i] = v - share * a
            room.v[term, k, i] = share.conjugate() * v - a
            wrong += 4.0 * EPSILON * (abs(v) + abs(a))
    rest_v, rest_a = room.rest[vertex], room.rest[term]
    room.rest[vertex] = rest_v + abs(share) * rest_a + wrong
    room.rest[term] = abs(share) * rest_v + rest_a + wrong
    return True


class Question(NamedTuple):
    """A family (`armlock.engine.decide.Family`) as compiled functions take it, and a goal.

    Attributes
    ----------
    kind : int array, shape (tests, members)
        VERTEX, TERM, or 0 for no member.
    weights, slopes : complex arrays, shape (tests, members, functions)
        A member is the combination of the functions with weights + level slopes.
    arc : float array, shape (0, 4) or (2, 4)
        Of the family: (a, b, c, d), and their slopes in the level.
    loose : int
        Of the family. A search takes these functions as terms of any phase too.
    goal : int
        What a search looks for, see `_aim`.
    start, tolerance : float
        The tests have to hold at the level start + (best - start) (1 - tolerance), where `best`
        is the best value so far.
    """

    kind: IntArray
    weights: ComplexArray
    slopes: ComplexArray
    arc: FloatArray
    loose: int
    goal: int
    start: float
    tolerance: float


@_inner
def _test_holds(question: Question, level: float, work: Workspace, room: Members) -> bool:
    """Whether a test excludes zero at a level."""
    weights = room.weights
    for i in range(question.kind.shape[0]):
        room.kind[:] = 0
        for n in range(question.kind.shape[1]):
            room.kind[n] = question.kind[i, n]
            if room.kind[n]:
                for f in range(weights.size):
                    weights[f] = question.weights[i, n, f] + level * question.slopes[i, n, f]
                mix(work, room, n)
        if excludes_zero(room) or (_turn_together(room) and excludes_zero(room)):
            return True
    return False


@_maker
def _arc_holds(
    question: Question,
    level: float,
    low: float,
    high: float,
    work: Workspace,
    room: Members,
) -> bool:
    """Whether zero is excluded for all psi of the arc, triangle by triangle (Lemma 16)."""
    if not question.arc.size:
        return False
    weights, loose, functions = room.weights, question.loose, room.weights.size
    arc = question.arc[0] + level * question.arc[1]
    begin = arc[0] + min(arc[1] * low, arc[1] * high)
    span = min(arc[2] + max(arc[3] * low, arc[3] * high) - begin, 2.0 * np.pi)
    parts = int(span / 0.35) + 1
    # Neighbours overlap by more than angles are rounded by.
    half = 0.5 * span / parts + 4.0 * EPSILON * (abs(begin) + span)
    room.kind[:] = 0
    room.kind[:3] = VERTEX
    for n in range(loose):
        weights[:] = 0.0
        weights[functions - loose + n] = 1.0
        room.kind[3 + n] = TERM
        mix(work, room, 3 + n)
    for i in range(parts):
        turn = begin + (2 * i + 1) * half
        for n in range(3):
            # Of the corner exp(j angle), or of the one in the middle, over cos(half).
            angle = turn + (n - 1) * half
            less, sine = -2.0 * np.sin(0.5 * angle) ** 2, np.sin(angle)
            if n == 1:
                least = -2.0 * np.sin(0.5 * half) ** 2
                less, sine = (less - least) / (1.0 + least), sine / (1.0 + least)
            weights[:] = 0.0
            weights[0], weights[1] = 1.0, complex(1.0 + less, sine)
            if functions - loose > 2:
                weights[1], weights[2] = less, complex(0.0, sine)
            mix(work, room, n)
        if not excludes_zero(room):
            return False
    return True


# ------------------------------------------------------------------------ walks along the axis


@_inner
def _halve(stack: FloatArray, top: int, low: float, high: float) -> bool:
    """Put the halves of an interval on a stack, unless double precision tells none apart.

    This is the rule for what double precision cannot decide: such an interval is undecided. For
    intervals around s = 0 and a map's end `_cut_around` applies it.
    """
    middle = 0.5 * (low + high)
    if high > 4.0 * low:
        middle = np.sqrt(low) * np.sqrt(high) if low > 0.0 else high / 64.0
    narrow = high - low <= NARROWEST * high or high < LOWEST
    if narrow or not low < middle < high or top + 2 > stack.shape[0]:
        return False
    stack[top, 0], stack[top, 1] = middle, high
    stack[top + 1, 0], stack[top + 1, 1] = low, middle
    return True


@_entry
def wind(
    functions: Functions, begin: FloatArray, end: FloatArray, most: int
) -> tuple[FloatArray, ComplexArray, ComplexArray, FloatArray, IntArray]:
    """Follow the arguments of functions along the axis, until one takes too many steps.

    Returns of each the argument gathered from `begin` to `end` (Lemma 10), the values at both,
    the frequency where zero is not excluded (nan if there is none), and the steps.
    """
    number, space = begin.size, functions.space
    total, undecided, steps = np.zeros(number), np.zeros(number), np.zeros(number, np.int64)
    first, last = np.zeros(number, np.complex128), np.zeros(number, np.complex128)
    stack = np.empty((_DEEPEST, 2))
    room = members(np.ones(1, np.int64), functions)
    work, along = workspace(space, room.kind.size), np.zeros(ORDER, np.complex128)
    for n in range(number):
        # What is found of a function does not depend on those before it.
        work.piece[:] = -1.0
        undecided[n] = np.nan
        steady, delayed = functions.steady[n : n + 1], functions.delayed[n : n + 1]
        one = Functions(space, steady, delayed, functions.uncertain[n : n + 1])
        stack[0, 0], stack[0, 1], top = begin[n], end[n], 1
        while top > 0:
            top -= 1
            low, high = stack[top, 0], stack[top, 1]
            m, r = 0.5 * (low + high), 0.5 * (high - low) + 2.0 * EPSILON * high
            steps[n] += 1
            enclose(one, m, r, work)
            for k in range(1 + space.delays.size):
                _copy(work.f[0, k], room.v[0, k])
            room.rest[0] = work.rest[0]
            held = excludes_zero(room)
            if not held:
                if steps[n] >= most or not _halve(stack, top, low, high):
                    undecided[n] = m
                    break
                top += 2
                continue
            _copy(room.along, along)
            if held == 1:
                along[1:] = 0.0
            # An end takes part in two intervals with one value. What that is off by is below a
            # quarter turn, and cancels.
            if low == begin[n]:
                first[n] = last[n] = _at(work.f[0, 0], (low - m) / r)
            for sign, edge in ((-1.0, low), (1.0, high)):
                t = (edge - m) / r
                if sign > 0.0:
                    last[n] = _at(work.f[0, 0], t)
                g = _at(along, t)
                a, b = last[n] * g.conjugate(), g * along[0].conjugate()
                total[n] += sign * (np.arctan2(a.imag, a.real) + np.arctan2(b.imag, b.real))
        if steps[n] >= most:
            break
    return total, first, last, undecided, steps


@_entry
def resolved(
    functions: Functions, begin: float, end: float, most: int
) -> tuple[FloatArray, ComplexArray]:
    """Frequencies so close that a Taylor polynomial represents a function between them.

    With the step of Newton's method at each, F over its derivative by s.
    """
    space, work = functions.space, workspace(functions.space, functions.steady.shape[0])
    stack, top, n = np.empty((_DEEPEST, 2)), 1, 0
    found, moves = np.empty(most), np.empty(most, np.complex128)
    longest = 0.0
    for k in range(space.delays.size):
        if np.abs(functions.delayed[0, :, k]).sum() > 0.0:
            longest = space.delays[k]
    stack[0, 0], stack[0, 1] = begin, end
    while top > 0 and n < most:
        top -= 1
        low, high = stack[top, 0], stack[top, 1]
        m, r = 0.5 * (low + high), 0.5 * (high - low)
        enclose(functions, m, r, work)
        f = work.f[0, 0]
        bent = abs(f[2]) + abs(f[3]) + np.abs(work.f[0, 1:]).sum()
        size, rest, short = abs(f[0]) + abs(f[1]), work.rest[0], r <= 0.02 * m
        close = 8.0 * bent <= size and (8.0 * rest <= size or short)
        # Where rounding hides the function, shorter steps do not help.
        close = close or (short and size <= 2.0 * rest)
        if (close and longest * r <= 0.3) or not _halve(stack, top, low, high):
            found[n] = m
            moves[n] = complex(0.0, r) * f[0] / f[1] if f[1] != 0.0 else np.inf
            n += 1
        else:
            top += 2
    return found[:n].copy(), moves[:n].copy()


# ------------------------------------------------------------------------------------ a search


@_inner
def _aim(goal: int, f: complex, g: complex, radius: float, omega: float) -> tuple[float, float]:
    """Return what a search looks for: a function that is zero there, and the value.

    L = f / g is known up to a disc of radius `radius` / abs(g). If that is not zero, or for a
    distance, the value itself is to be small, and there is no function.
    """
    size = abs(f) + abs(g)
    if size > 0.0:
        # Of tiny functions no product underflows then.
        f, g, radius = f / size, g / size, radius / size
    if goal == DISTANCE:
        return 0.0, max(abs(f) - radius, 0.0) / abs(g)
    if goal == REAL:
        # Where g vanishes, no t makes f + t g zero.
        return (f * g.conjugate()).imag, -(f / g).real if g != 0.0 else np.inf
    # The angle of L = f / g from -1.
    level = (f * f.conjugate()).real - (g * g.conjugate()).real
    ratio = -f * g.conjugate()
    angle, half = np.arctan2(ratio.imag, ratio.real), 0.0
    if radius > 0.0:
        # Half the angle under which the disc covers the unit circle.
        size, radius, level = abs(f / g), radius / abs(g), 0.0
        if radius <= abs(size - 1.0):
            return 0.0, np.inf if radius < 1.0 + size else 0.0
        cosine = (1.0 + size * size - radius * radius) / (2.0 * size)
        half = np.arccos(min(max(cosine, -1.0), 1.0))
    if goal == PHASE:
        return level, max(abs(angle) - half, 0.0)
    if abs(angle) < half:
        return level, 0.0
    return level, ((angle if angle >= 0.0 else angle + 2.0 * np.pi) - half) / omega


@_inlined
def _evaluate(functions: Functions, omega: float, work: Workspace) -> None:
    """Write functions at j omega into `work.f`, all times one positive number."""
    space, top = functions.space, 0
    for k in range(space.delays.size):
        phase, _ = _phase(space.delays[k], space.tails[k], omega)
        half = np.sin(0.5 * phase)
        work.turn[k, 0] = -2.0 * half * complex(half, np.cos(0.5 * phase))
    for k in range(space.scale.size):
        work.factor[k] = 1.0 / np.sqrt(space.scale[k] * space.scale[k] + omega * omega)
    for j in range(space.lead.size):
        p, shift = complex(space.lead[j], 0.0), 0
        for k in range(space.scale.size):
            by = work.factor[k]
            if space.present[j, k]:
                root = space.roots[j, k]
                p *= complex(-root.real * by, (omega - root.imag) * by)
            else:
                p *= by
            size = abs(p.real) + abs(p.imag)
            if size > _HUGE or 0.0 < size < 1.0 / _HUGE:
                p *= 1.0 / _HUGE if size > 1.0 else _HUGE
                shift += 1 if size > 1.0 else -1
        work.p[j, 0], work.shift[j] = p, shift
        top = shift if j == 0 else max(top, shift)
    for f in range(work.f.shape[0]):
        total = 0.0j
        for j in range(space.lead.size):
            g = complex(functions.steady[f, j], 0.0)
            for k in range(space.delays.size):
                g += functions.delayed[f, j, k] * work.turn[k, 0]
            p = work.p[j, 0]
            if work.shift[j] != top:
                p *= _HUGE ** float(max(work.shift[j] - top, -2))
            total += p * g
        work.f[f, 0, 0] = total


@_inner
def _measure(functions: Functions, goal: int, omega: float, spare: Workspace) -> Any:
    """`_aim` at a frequency."""
    _evaluate(functions, omega, spare)
    radius = 0.0
    for f in range(2, spare.f.shape[0]):
        radius += abs(spare.f[f, 0, 0])
    return _aim(goal, spare.f[0, 0, 0], spare.f[1, 0, 0], radius, omega)


@_entry
def sample(
    functions: Functions, question: Question, omega: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """`_aim` at many frequencies."""
    spare = workspace(functions.space, 2 + question.loose)
    crossing, value = np.empty(omega.size), np.empty(omega.size)
    for i in range(omega.size):
        crossing[i], value[i] = _measure(functions, question.goal, omega[i], spare)
    return crossing, value


@_inner
def _crossing(
    functions: Functions, question: Question, a: float, b: float, spare: Workspace
) -> tuple[float, float]:
    """Return the value where a function of `_aim` is zero between two frequencies, and where.

    By the rule of false position, with each third step a halving. The function's value at an
    end that stays is halved (Illinois). The result is inf where the function has one sign at
    both frequencies, or where neighbours in double precision do not tell the value.
    """
    goal = question.goal
    at_a, _ = _measure(functions, goal, a, spare)
    at_b, _ = _measure(functions, goal, b, spare)
    if (at_a < 0.0) == (at_b < 0.0):
        return np.inf, a
    side, here, value, omega = 0, at_a, np.inf, a
    for step in range(_MOST_LOCATED):
        last = omega
        omega = (a * at_b - b * at_a) / (at_b - at_a) if step % 3 < 2 else 0.5 * (a + b)
        here, value = _measure(functions, goal, omega, spare)
        if here == 0.0 or abs(omega - last) <= 2.0 * EPSILON * omega:
            break
        if (here < 0.0) == (at_b < 0.0):
            b, at_b = omega, here
            at_a = 0.5 * at_a if side == 1 else at_a
            side = 1
        else:
            a, at_a = omega, here
            at_b = 0.5 * at_b if side == -1 else at_b
            side = -1
    else:
        return np.inf, omega
    # Between two floats the value may change by more than the tolerance: it is interpolated.
    at_a, below = _measure(functions, goal, omega * (1.0 - 4.0 * EPSILON), spare)
    at_b, above = _measure(functions, goal, omega * (1.0 + 4.0 * EPSILON), spare)
    change, bend = above - below, abs(above + below - 2.0 * value)
    off = abs(change) + bend
    if (at_a < 0.0) != (at_b < 0.0):
        share = here / (at_b - at_a)
        value, off = value - share * change, 2.0 * bend * share * share
    return value if off <= question.tolerance * (value - question.start) else np.inf, omega


@_maker
def _candidate(
    functions: Functions,
    question: Question,
    m: float,
    r: float,
    best: float,
    work: Workspace,
    spare: Workspace,
) -> tuple[float, float]:
    """Return a value better than `best` in an interval, and its frequency; else `best`, nan.

    The Taylor polynomials say where it may be; the functions themselves say what it is.
    """
    goal, start, loose = question.goal, question.start, question.loose > 0
    found, where = best, np.nan
    h, v = np.empty(9), np.empty(9)
    for i in range(9):
        t, radius = 0.25 * i - 1.0, 0.0
        for f in range(2, spare.f.shape[0]):
            radius += abs(_at(work.f[f, 0], t))
        h[i], v[i] = _aim(goal, _at(work.f[0, 0], t), _at(work.f[1, 0], t), radius, m + r * t)
    if goal == DISTANCE or loose:
        i = int(np.argmin(v))
        t = 0.25 * i - 1.0
        if 0 < i < 8 and np.isfinite(v[i - 1] + v[i + 1]):
            # The lowest point of a parabola through three.
            bent = v[i - 1] - 2.0 * v[i] + v[i + 1]
            if bent > 0.0:
                t += 0.125 * (v[i - 1] - v[i + 1]) / bent
        omega = max(m + r * t, 0.0)
        _, value = _measure(functions, goal, omega, spare)
        if (start < value or (loose and start == value)) and value < found:
            found, where = value, omega
        return found, where
    for i in range(8):
        changes = (h[i] < 0.0) != (h[i + 1] < 0.0)
        if changes and min(v[i], v[i + 1]) < found + abs(v[i] - v[i + 1]):
            a, b = m + r * (0.25 * i - 1.0), m + r * (0.25 * i - 0.75)
            value, omega = _crossing(functions, question, a, b, spare)
            if start < value < found:
                found, where = value, omega
    return found, where


@_entry
def walk(
    functions: Functions,
    question: Question,
    pending: FloatArray,
    best: float,
    where: float,
    most: int,
) -> tuple[FloatArray, FloatArray, float, float, int]:
    """Halve intervals until a test holds on each, at the level of the best value so far.

    An interval on which no test holds may hold a better value, which is looked for there. The
    search ends once the best value reaches the start: then no interval is left.

    Returns the intervals that are left after so many steps, those that are undecided, the best
    value, where it is, and the steps.
    """
    number, start, space = functions.steady.shape[0], question.start, functions.space
    # What is looked for are the first two functions and the loose ones.
    work, spare = workspace(space, number), workspace(space, 2 + question.loose)
    size = max(question.kind.shape[1], 3 + question.loose)
    room = members(np.zeros(size, np.int64), functions)
    top = pending.shape[0]
    stack = np.empty((top + _DEEPEST, 2))
    for i in range(top):
        _copy(pending[i], stack[i])
    undecided, left, steps = np.empty((FEW_UNDECIDED, 2)), 0, 0
    while top > 0 and steps < most and left < FEW_UNDECIDED:
        top -= 1
        low, high = stack[top, 0], stack[top, 1]
        m, r = 0.5 * (low + high), 0.5 * (high - low) + 2.0 * EPSILON * high
        steps += 1
        level = min(start + (best - start) * (1.0 - question.tolerance), 1e300)
        enclose(functions, m, r, work)
        if _test_holds(question, level, work, room):
            continue
        if _arc_holds(question, level, low, high, work, room):
            continue
        fast = work.lead.size > 0 and work.lead[-1] >= 0
        if not fast and best > start:
            better, at = _candidate(functions, question, m, r, best, work, spare)
            if better < best:
                best, where = better, at
                if best <= start:
                    return stack[:0].copy(), undecided[:0].copy(), best, where, steps
        if not _halve(stack, top, low, high):
            undecided[left, 0], undecided[left, 1] = low, high
            left += 1
            continue
        # Which half comes first changes from step to step: in a random order the best value so
        # far improves a few times, in ascending order it may do so at each turn of a delay.
        if steps % 2 == 1:
            for k in range(2):
                stack[top, k], stack[top + 1, k] = stack[top + 1, k], stack[top, k]
        top += 2
    return stack[:top].copy(), undecided[:left].copy(), best, where, steps


# ------------------------------------------------------------------------- crossings of rows


class Rows(NamedTuple):
    """Rows f_0 - y f_1 - x f_2 of three functions, and between which x zeros count."""

    y: FloatArray
    lower: FloatArray
    upper: FloatArray


class Shared(NamedTuple):
    """What all rows share on an interval."""

    low: float
    high: float
    m: float
    r: float
    around: bool  # whether the middle is s = 0, or the end of a map's axis
    fast: bool  # whether an exponential is not resolved
    long: bool  # whether the interval is long
    products: ComplexArray  # (3, 2 ORDER - 1): the functions times the conjugate of M = f_2
    sizes: FloatArray  # (3,): most of the functions, but for their remainders
    least: float  # least of M; negative where this is not known
    z: ComplexArray  # (2 ORDER - 1): N conj M of the row that is looked at
    ends: FloatArray  # (2, 2): Im(f_0 conj M) and Im(f_1 conj M) at both ends; nan before


class Row(NamedTuple):
    """One row on an interval, with N = f_0 - y f_1."""

    y: float
    lower: float
    upper: float
    size: float  # most of N, but for its remainder
    rest: float
    off: float  # error of N conj M, which is z of what is shared


# What is known of a row on an interval: no zero; one at most; not enough; rounding hides it.
_NONE, _ONE, _OPEN, _HIDDEN = range(4)


@_maker
def _share(
    space: Arrays, interval: tuple[float, float, float, float], around: bool, work: Workspace
) -> Shared:
    """Multiply the enclosed functions by the conjugate of M."""
    products, sizes = np.zeros((3, 2 * ORDER - 1), np.complex128), np.zeros(3)
    for f in range(3):
        for i in range(ORDER):
            sizes[f] += abs(work.f[f, 0, i])
            for k in range(ORDER):
                products[f, i + k] += work.f[f, 0, i] * work.f[2, 0, k].conjugate()
    low, high, m, r = interval
    fast, long = False, False
    for k in range(space.delays.size):
        fast |= work.lead[k] >= 0
        long |= space.delays[k] * r > _LONG
    least = -1.0 if fast else 2.0 * abs(work.f[2, 0, 0]) - sizes[2] - work.rest[2]
    z, ends = np.zeros(2 * ORDER - 1, np.complex128), np.full((2, 2), np.nan)
    return Shared(low, high, m, r, around, fast, long, products, sizes, least, z, ends)


@_inner
def _rows_exclude_zero(rows: Rows, here: IntArray, work: Workspace, room: Members) -> bool:
    """Whether zero is in none of some rows, for any x that counts."""
    y0, y1, x0, x1 = np.inf, -np.inf, np.inf, -np.inf
    for row in here:
        y0, y1 = min(y0, rows.y[row]), max(y1, rows.y[row])
        x0, x1 = min(x0, rows.lower[row]), max(x1, rows.upper[row])
    if x1 == np.inf:
        return False
    room.weights[0] = 1.0
    room.kind[:] = 0
    # Of one row two corners suffice.
    for n in range(4 if y0 < y1 else 2):
        room.kind[n] = VERTEX
        room.weights[1] = -(y0 if n < 2 else y1)
        room.weights[2] = -(x0 if n % 2 == 0 else x1)
        mix(work, room, n)
    return bool(excludes_zero(room) > 0)


@_inlined
def _row(rows: Rows, row: int, shared: Shared, work: Workspace) -> Row:
    """Return a row on an interval."""
    y, z, size_m, rest_m = rows.y[row], shared.z, shared.sizes[2], work.rest[2]
    for k in range(z.size):
        z[k] = shared.products[0, k] - y * shared.products[1, k]
    size = shared.sizes[0] + abs(y) * shared.sizes[1]
    rest = work.rest[0] + abs(y) * work.rest[1]
    off = (rest + 32.0 * EPSILON * size) * size_m + rest_m * (size + rest)
    return Row(y, rows.lower[row], rows.upper[row], size, rest, off)


@_inlined
def _is_outside(row: Row, shared: Shared, work: Workspace) -> bool:
    """Whether Re(N / M) is below `lower` or above `upper` on the whole interval."""
    z, square, size_m = shared.z, shared.products[2], shared.sizes[2]
    above = (z[0] - row.upper * square[0]).real
    below = (z[0] - row.lower * square[0]).real
    for k in range(1, z.size):
        above -= abs((z[k] - row.upper * square[k]).real)
        below += abs((z[k] - row.lower * square[k]).real)
    off_square = size_m * (work.rest[2] + 32.0 * EPSILON * size_m)
    off = row.off + 3.0 * max(abs(row.lower), abs(row.upper)) * off_square
    return bool(above > off or below < -off)


@_inlined
def _decide(row: Row, shared: Shared, work: Workspace) -> tuple[int, float]:
    """Tell what is known of h = Im(N conj M), and its least slope if it is monotonic."""
    varied, bent, everywhere = 0.0, 0.0, row.upper == np.inf
    for k in range(1, shared.z.size):
        varied += abs(shared.z[k].imag)
        bent += k * abs(shared.z[k].imag) if k > 1 else 0.0
    middle = abs(shared.z[0].imag)
    if middle > varied + row.off or (not everywhere and _is_outside(row, shared, work)):
        return _NONE, 0.0
    # Errors of the coefficients, and that of the remainder's slope (Lemma 18).
    slope = abs(shared.z[1].imag) - bent - 10.0 * row.off
    if slope > 0.0 and (shared.least > 0.0 or everywhere):
        return _ONE, slope
    settled = middle + varied <= 2.0 * row.off
    for f in range(3):
        settled &= work.rest[f] <= 2.0 * work.rounding[f]
    # In shorter intervals rounding hides h as well.
    return (_HIDDEN if settled else _OPEN), 0.0


@_inlined
def _sign_changes(functions: Functions, row: Row, shared: Shared, spare: Workspace) -> bool:
    """Whether h has two signs at the ends of an interval, of which all rows share the values.

    Neighbours share them too: each zero is found in one of them.
    """
    ends = shared.ends
    if np.isnan(ends[0, 0]):
        for e in range(2):
            enclose(functions, shared.low if e == 0 else shared.high, 0.0, spare)
            for f in range(2):
                ends[e, f] = (spare.f[f, 0, 0] * spare.f[2, 0, 0].conjugate()).imag
    a, b = ends[0, 0] - row.y * ends[0, 1], ends[1, 0] - row.y * ends[1, 1]
    return bool((a < 0.0) != (b < 0.0))


@_inlined
def _zero_of_polynomial(z: ComplexArray) -> tuple[float, float]:
    """Return where the imaginary part of a monotonic polynomial is zero, and its slope."""
    t, slope = 0.0, z[1].imag
    for _ in range(4):
        value, slope = 0.0, 0.0
        for k in range(z.size - 1, -1, -1):
            slope = slope * t + value
            value = value * t + z[k].imag
        t = min(max(t - value / slope, -1.0), 1.0)
    return t, slope


@_inlined
def _locate(
    functions: Functions,
    row: Row,
    shared: Shared,
    least_slope: float,
    fine: float,
    work: Workspace,
    spare: Workspace,
) -> tuple[float, float, float, float]:
    """Return x at the zero of h and how far it is off, and the same of its place t.

    Newton's method finds it for the Taylor polynomials, then for the functions themselves,
    between points where h is of either sign. The functions have another common factor, from
    which h over |N|^2 + |M|^2 is free (Lemma 18).
    """
    size_m, rest_m = shared.sizes[2], work.rest[2]
    t, slope = (0.0, shared.z[1].imag) if shared.around else _zero_of_polynomial(shared.z)
    f, g = _at(work.f[0, 0], t) - row.y * _at(work.f[1, 0], t), _at(work.f[2, 0], t)
    rough = min(2.0 * row.off / least_slope, 2.0)
    off_t = rough
    slope /= abs(f) ** 2 + abs(g) ** 2
    least_slope /= (row.size + row.rest) ** 2 + (size_m + rest_m) ** 2
    x, spread, before, at = 0.0, np.inf, 0.0, 0.0
    low, high, rising = -1.0, 1.0, shared.z[1].imag > 0.0
    for step in range(_MOST_LOCATED):
        enclose(functions, shared.m + shared.r * t, 0.0, spare)
        f, g, turned = spare.f[0, 0, 0], spare.f[2, 0, 0], row.y * spare.f[1, 0, 0]
        off_f = spare.rest[0] + abs(row.y) * spare.rest[1]
        off_f += 2.0 * EPSILON * (abs(f) + abs(turned))
        f, off_g = f - turned, spare.rest[2]
        total = abs(f) ** 2 + abs(g) ** 2
        if not (total > 0.0 and np.isfinite(slope) and slope != 0.0):
            # N and M have a common zero here.
            break
        value = (f * g.conjugate()).imag / total
        off = 2.0 * (off_f * abs(g) + off_g * abs(f)) / total
        # Around s = 0 and a map's end the zero is in the middle.
        off_t = 0.0 if shared.around else min((abs(value) + off) / least_slope, 2.0)
        x = (f * g.conjugate()).real / abs(g) ** 2
        near = abs(_at(work.f[2, 0], t)) - rest_m - ORDER * off_t * size_m
        near = max(near, shared.least)
        slide = 3.0 * row.size * (1.0 + size_m / near) / near if near > 0.0 else np.inf
        spread = slide * off_t + 2.0 * (off_f + abs(x) * off_g) / abs(g)
        outside = x + spread < row.lower or x - spread > row.upper
        if shared.around or outside or spread <= fine or abs(value) <= off:
            break
        if step > 0 and t != at and value != before:
            slope = (value - before) / (t - at)
        before, at = value, t
        low, high = (t, high) if (value < 0.0) == rising else (low, t)
        t -= value / slope
        if not low < t < high:
            t = 0.5 * (low + high)
    # At a root that was computed the error of one value is nan.
    return x, spread, t, off_t if off_t <= 2.0 else rough


@_inlined
def _note(
    entry: FloatArray,
    row: int,
    x: tuple[float, float],
    omega: tuple[float, float],
    jump: float,
) -> None:
    """Write an entry of the table of `cross`: x and the frequency with how far they are off."""
    entry[0], entry[5] = row, jump
    entry[1], entry[2] = x
    entry[3], entry[4] = omega


@_inner
def _note_hidden(
    rows: Rows, row: int, shared: Shared, work: Workspace, entry: FloatArray
) -> None:
    """Write an undecided interval of a row, and around which x zeros may lie on it."""
    off, x, spread = _row(rows, row, shared, work).off, 0.0, np.inf
    if shared.least > 0.0:
        x = shared.z[0].real / shared.products[2, 0].real
        reach = off + 3.0 * abs(x) * shared.sizes[2] * work.rest[2]
        for i in range(1, shared.z.size):
            reach += abs(shared.z[i].real - x * shared.products[2, i].real)
        spread = 1.01 * reach / (shared.least * shared.least)
    _note(entry, row, (x, spread), (shared.m, shared.r), 0.0)


@_maker
def _append(table: FloatArray, n: int, entries: FloatArray) -> FloatArray:
    """Return a table of n entries with more, for which room is made."""
    if n + len(entries) > len(table):
        longer = np.empty((2 * (n + len(entries)), table.shape[1]))
        for i in range(n):
            _copy(table[i], longer[i])
        table = longer
    for i in range(len(entries)):
        _copy(entries[i], table[n + i])
    return table


@_inner
def _first_intervals(stack: FloatArray, begin: float, end: float, is_map: bool) -> int:
    """Put the axis on a stack, with intervals around s = 0 and a map's end, where h is odd."""
    low, high, top = begin if begin > 0.0 else 1e-3 * end, end, 1
    if is_map:
        high = end - 1e-3 * end
        stack[top, 0], stack[top, 1] = high, 2.0 * end - high
        top += 1
    if begin == 0.0:
        stack[top, 0], stack[top, 1] = -low, low
        top += 1
    stack[0, 0], stack[0, 1] = low, high
    return top


@_inner
def _cut_around(stack: FloatArray, top: int, low: float, m: float, r: float) -> bool:
    """Cut an interval around s = 0 or a map's end: a shorter one, and what lies beside it."""
    q = r / 16.0
    if q <= NARROWEST * m or q < LOWEST:
        return False
    stack[top, 0], stack[top, 1] = (q, r) if low < 0.0 else (low, m - q)
    stack[top + 1, 0], stack[top + 1, 1] = m - q, m + q
    return True


@_inner
def _follow(
    functions: Functions,
    rows: Rows,
    here: IntArray,
    still_open: IntArray,
    shared: Shared,
    fine: float,
    work: Workspace,
    spare: Workspace,
    room: Members,
    entries: FloatArray,
) -> tuple[int, int]:
    """Decide on an interval what can be decided of some rows.

    Returns the number of entries, one at most of each row, and how many rows are still open.
    """
    # Rows are tested one by one where that spares a long interval, or M may vanish.
    alone = here.size == 1 or shared.long or not (shared.fast or shared.least > 0.0)
    n, kept = 0, 0
    for i in range(here.size):
        row, state, slope = _row(rows, here[i], shared, work), _OPEN, 0.0
        if not shared.fast:
            state, slope = _decide(row, shared, work)
        if alone and state >= _OPEN and _rows_exclude_zero(rows, here[i : i + 1], work, room):
            continue
        if state == _ONE:
            if not (shared.around or _sign_changes(functions, row, shared, spare)):
                continue
            x, spread, t, off_t = _locate(functions, row, shared, slope, fine, work, spare)
            # Where M vanishes x is no number, and the zero counts.
            if not (x + spread < row.lower or x - spread > row.upper):
                jump = (1.0 if shared.around else 2.0) * np.sign(shared.z[1].imag)
                omega = shared.m + shared.r * t, shared.r * off_t
                _note(entries[n], here[i], (x, spread), omega, jump)
                n += 1
        elif state == _HIDDEN:
            _note_hidden(rows, here[i], shared, work, entries[n])
            n += 1
        elif state == _OPEN:
            still_open[kept] = here[i]
            kept += 1
    return n, kept


@_entry
def cross(
    functions: Functions,
    rows: Rows,
    begin: float,
    end: float,
    is_map: bool,
    fine: float,
    most: int,
) -> tuple[FloatArray, BoolArray, int]:
    """Find the zeros on the axis of rows f_0 - y f_1 - x f_2.

    With N = f_0 - y f_1 and M = f_2 they are where h = Im(N conj M) is zero, at x = Re(N / M)
    (Lemma 18). All rows share the expansion of an interval. Between infinite bounds all zeros
    of h are found, those of M included. `begin` is 0 for the axis from s = 0, and a map's ends
    at `end`: there N / M is real, and a root crosses alone.

    Returns a table of crossings: row; x, exact to `fine` where rounding allows, and how far
    from it at most; frequency, and how far from it; by how many the zeros on the right increase
    with x, or 0 for an interval that is undecided, which may hold any number. And the rows for
    which `most` steps, in all, did not suffice, and how many steps there were.
    """
    number, space = rows.y.size, functions.space
    three = functions.steady.shape[0]
    work, spare = workspace(space, three), workspace(space, three)
    room = members(np.zeros(4, np.int64), functions)
    found, entries, n = np.empty((64, 6)), np.empty((number, 6)), np.int64(0)
    unfinished = np.zeros(number, np.bool_)
    # Which rows are open, after so many halvings.
    pool, size = np.empty((_DEEPEST + 1, number), np.int64), np.zeros(_DEEPEST + 1, np.int64)
    size[0] = number
    for row in range(number):
        pool[0, row] = row
    stack, depth = np.empty((_DEEPEST + 3, 2)), np.zeros(_DEEPEST + 3, np.int64)
    top, steps, undecided = _first_intervals(stack, begin, end, is_map), 0, 0
    while top > 0:
        top -= 1
        low, high, d = stack[top, 0], stack[top, 1], depth[top]
        here, steps = pool[d, : size[d]], steps + 1
        if steps > most or undecided >= MANY_UNDECIDED * number:
            for row in here:
                unfinished[row] = True
            continue
        around = low < 0.0 or (is_map and high > end)
        m, r = 0.5 * (low + high), 0.5 * (high - low) + 2.0 * EPSILON * high
        if around:
            m = 0.0 if low < 0.0 else end
        enclose(functions, m, r, work)
        if size[d] > 1 and _rows_exclude_zero(rows, here, work, room):
            continue
        shared = _share(space, (low, high, m, r), around, work)
        new, kept = _follow(
            functions, rows, here, pool[d + 1], shared, fine, work, spare, room, entries
        )
        halved = kept > 0 and d + 1 < _DEEPEST
        if halved and around:
            halved = _cut_around(stack, top, low, m, r)
        elif halved:
            halved = _halve(stack, top, low, high)
        if halved:
            depth[top], depth[top + 1], size[d + 1] = d + 1, d + 1, kept
            top += 2
        else:
            for row in pool[d + 1, :kept]:
                _note_hidden(rows, row, shared, work, entries[new])
                new += 1
        found, n = _append(found, n, entries[:new]), n + new
        for i in range(new):
            undecided += entries[i, 5] == 0.0
    return found[:n].copy(), unfinished, steps
