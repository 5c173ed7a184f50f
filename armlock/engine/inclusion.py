"""Functions on an interval of the imaginary axis, enclosed by Taylor polynomials; compiled.

A space holds polynomials p_j and delays theta_k, and a function of the space is

    F(s) = sum_j p_j(s) [S_j + sum_k W_jk (exp(-s theta_k) - 1)] .

On the interval s = j (m + r t) with -1 <= t <= 1, F is enclosed by F_0 + F_1 t + F_2 t^2 +
F_3 t^3, terms C_k(t) of any phase, and a remainder. The lemmas are those of the book's appendix
"The lemmas behind a count". All polynomials are divided by one positive number for each
interval, so that arguments and signs remain.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from armlock.checks import BoolArray, ComplexArray, FloatArray, IntArray
from armlock.compiled import njit

EPSILON = 2.0**-52
#: Number of Taylor coefficients that are kept.
ORDER = 4
# An exponential that turns by more than this, in rad, over half an interval is not resolved.
_FAST = 1.5
# Two of them that turn by no more than this beside each other share a free phase.
_TOGETHER = 0.3
# An interval over which an exponential turns by more than twice this, in rad, is a long one.
_FAR = 30.0
# Most undecided intervals of a row, on average over the rows of a call.
_MOST_UNDECIDED = 4096
# Polynomials are rescaled before they leave these bounds.
_HUGE = 1e150
# A piece of the axis is this share of the distance to the roots, together; it serves intervals
# down to one of so many of its length.
_PIECE, _SUBINTERVALS = 0.02, 4096.0
# The goals of a search, see `_aim`.
DISTANCE, PHASE, DELAY, REAL = range(4)


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
    f: ComplexArray  # (functions, ORDER)
    c: ComplexArray  # (functions, K, ORDER): terms of any phase, by the delay that leads
    rest: FloatArray  # (functions,): remainder and rounding
    g: ComplexArray  # (ORDER,), and (ORDER + 1,) bounds
    b: FloatArray


@njit(nogil=True, error_model="numpy")
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
        np.zeros((functions, ORDER), np.complex128),
        np.zeros((functions, k, ORDER), np.complex128),
        np.zeros(functions),
        np.zeros(ORDER, np.complex128),
        np.zeros(ORDER + 1),
    )


@njit(nogil=True, error_model="numpy")
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
                p *= by
                bound *= by
        work.error[j] = 8.0 * (n + 1) * EPSILON + missed
        work.shift[j] = shift
        top = shift if j == 0 else max(top, shift)
    for j in range(space.lead.size):
        if work.shift[j] != top:
            by = _HUGE ** float(max(work.shift[j] - top, -2))
            work.piece_p[j] *= by
            work.piece_bound[j] *= by


# Two pi in three parts, of which the first two have 27 digits: their products with a number of
# turns below 2^26 are exact.
_TURN = 6.283185303211212, 3.968374295837407e-09, 2.2884754904439327e-17
_MOST_TURNS = 2.0**26


@njit(nogil=True, error_model="numpy")
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


@njit(nogil=True, error_model="numpy")
def expand(space: Arrays, m: float, r: float, work: Workspace) -> None:
    """Expand polynomials and exponentials about j m (Lemmas 1 to 3).

    The polynomials come from an expansion on a longer piece of the axis where one serves.
    """
    inside, own = abs(m - work.piece[0]) + r <= work.piece[1], False
    if not inside or r < work.piece[1] / _SUBINTERVALS:
        nearest = 0.0
        for j in range(space.lead.size):
            total = 0.0
            for k in range(space.scale.size):
                if space.present[j, k]:
                    z = space.roots[j, k]
                    total += 1.0 / np.sqrt(z.real * z.real + (m - z.imag) * (m - z.imag))
            nearest = max(nearest, total)
        length = min(_PIECE / nearest, 0.5 * _SUBINTERVALS * r) if nearest > 0.0 else 2.0 * r
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
    if own:
        # An expansion on a piece this long is too coarse for the parts of the interval.
        work.piece[1] = -1.0


@njit(nogil=True, error_model="numpy")
def combine(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    uncertain: FloatArray,
    work: Workspace,
    index: int,
) -> None:
    """Enclose function `index` with weights S and W on the expanded interval (Lemmas 4, 7).

    `uncertain` holds the errors of S.
    """
    delays = space.delays.size
    sums, rest = (16.0 + 2.0 * (steady.size + delays)) * EPSILON, 0.0
    few = (2.0 + delays) * EPSILON
    for i in range(ORDER):
        work.f[index, i] = 0.0
        for k in range(delays):
            work.c[index, k, i] = 0.0
    for j in range(steady.size):
        # First what no free phase turns, then in turn what follows each free phase.
        k, lead, used = 0, -1, steady[j] != 0.0 or uncertain[j] != 0.0
        first, wrong = steady[j], uncertain[j] + abs(steady[j]) * few
        for fast in range(delays):
            if work.lead[fast] >= 0 and delayed[j, fast] != 0.0:
                first -= delayed[j, fast]
                wrong += abs(delayed[j, fast]) * few
                used = True
        while True:
            for i in range(ORDER):
                work.g[i] = 0.0
            work.g[0], work.b[ORDER] = first, 0.0
            while k < delays and work.lead[k] == lead:
                weight, size, x = delayed[j, k], abs(delayed[j, k]), work.angle[k]
                if weight != 0.0:
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
                k += 1
            if used:
                for i in range(ORDER - 1, -1, -1):
                    work.b[i] = abs(work.g[i]) + (i + 1) * work.b[i + 1]
                rest += work.bound[j, ORDER] * work.b[0]
                rest += work.bound[j, 0] * ((work.error[j] + sums) * work.b[0] + wrong)
                for i in range(ORDER):
                    total = 0j
                    for low in range(i + 1):
                        total += work.p[j, low] * work.g[i - low]
                    rest += work.bound[j, i] * work.b[ORDER - i]
                    if lead < 0:
                        work.f[index, i] += total
                    else:
                        work.c[index, lead, i] += total
            if k == delays:
                break
            lead, first, wrong, used = work.lead[k], 0.0, 0.0, False
    # The bounds round too.
    work.rest[index] = rest * (1.0 + 1e-12)


@njit(nogil=True, error_model="numpy")
def _acts(terms: ComplexArray, n: int, k: int) -> bool:
    """Whether term k of a function or member is not zero."""
    size = 0.0
    for i in range(ORDER):
        size += abs(terms[n, k, i])
    return size > 0.0


@njit(nogil=True, error_model="numpy")
def values(
    space: Arrays, steady: FloatArray, delayed: FloatArray, omega: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Return functions at frequencies, times positive numbers, and bounds of rounding."""
    functions = steady.shape[0]
    found = np.empty((functions, omega.size), np.complex128)
    errors = np.empty((functions, omega.size))
    work = workspace(space, functions)
    exact = np.zeros(space.lead.size)
    for n in range(omega.size):
        expand(space, omega[n], 0.0, work)
        for i in range(functions):
            combine(space, steady[i], delayed[i], exact, work, i)
            found[i, n], errors[i, n] = work.f[i, 0], work.rest[i]
    return found, errors


@njit(nogil=True, error_model="numpy")
def _divide(c: ComplexArray, by: ComplexArray, quotient: ComplexArray) -> float:
    """Divide Taylor polynomials; return a bound of what is left of higher powers (Lemma 9)."""
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


@njit(nogil=True, error_model="numpy")
def _least(
    c: ComplexArray, along: ComplexArray, gamma: float, vertex: bool, q: ComplexArray
) -> tuple[float, float]:
    """Least real part of a vertex, or minus the most of a term, for both ends of the interval.

    Along the direction along[0] where gamma is 0, else as shares of the polynomial `along`,
    whose least size is gamma. Both bounds are concave in t, so that the ends suffice.
    """
    if gamma == 0.0:
        off, turned = 0.0, along[0].conjugate()
        for i in range(ORDER):
            q[i] = c[i] * turned
    else:
        # The quotient rounds by less than 64 EPSILON.
        off = (_divide(c, along, q) + 64.0 * EPSILON * np.abs(c).sum()) / gamma
    if vertex:
        for i in range(2, ORDER):
            off += abs(q[i].real)
        return (q[0] - q[1]).real - off, (q[0] + q[1]).real - off
    for i in range(2, ORDER):
        off += abs(q[i])
    return -abs(q[0] - q[1]) - off, -abs(q[0] + q[1]) - off


class Members(NamedTuple):
    """Members of a test: vertices (kind 1) and terms of any phase (kind 2), see `mix`."""

    kind: IntArray  # (members,)
    v: ComplexArray  # (members, ORDER)
    c: ComplexArray  # (members, K, ORDER)
    rest: FloatArray  # (members,)
    used: BoolArray  # (members,): whether a member has terms of its own
    along: ComplexArray  # (ORDER,), of the last test that held: direction or polynomial
    slow: ComplexArray  # (ORDER,)
    q: ComplexArray  # (ORDER,)


@njit(nogil=True, error_model="numpy")
def members(size: int, delays: int) -> Members:
    """Return room for so many members."""
    return Members(
        np.zeros(size, np.int64),
        np.zeros((size, ORDER), np.complex128),
        np.zeros((size, delays, ORDER), np.complex128),
        np.zeros(size),
        np.zeros(size, np.bool_),
        np.zeros(ORDER, np.complex128),
        np.zeros(ORDER, np.complex128),
        np.zeros(ORDER, np.complex128),
    )


@njit(nogil=True, error_model="numpy")
def mix(weights: ComplexArray, work: Workspace, room: Members, n: int) -> None:
    """Make member n, a linear combination of the functions."""
    room.v[n] = 0.0
    room.c[n] = 0.0
    room.rest[n] = 0.0
    room.used[n] = False
    for f in range(weights.size):
        a = weights[f]
        if a != 0.0:
            for i in range(ORDER):
                room.v[n, i] += a * work.f[f, i]
            for k in range(work.c.shape[1]):
                if _acts(work.c, f, k):
                    room.used[n] = True
                    for i in range(ORDER):
                        room.c[n, k, i] += a * work.c[f, k, i]
            room.rest[n] += abs(a) * (work.rest[f] + 4.0 * EPSILON * abs(work.f[f, 0]))


@njit(nogil=True, error_model="numpy")
def _holds(room: Members, gamma: float) -> bool:
    """Whether every vertex exceeds all terms of any phase, along a direction or in shares."""
    unit = gamma if gamma > 0.0 else 1.0
    low, high = 0.0, 0.0
    for kind in (2, 1):
        for n in range(room.kind.size):
            if room.kind[n] != kind:
                continue
            a, b = _least(room.v[n], room.along, gamma, kind == 1, room.q)
            a, b = a - room.rest[n] / unit, b - room.rest[n] / unit
            if room.used[n]:
                for k in range(room.c.shape[1]):
                    if _acts(room.c, n, k):
                        e, f = _least(room.c[n, k], room.along, gamma, False, room.q)
                        a, b = a + e, b + f
            if kind == 2:
                low, high = low + a, high + b
            elif not min(low + a, high + b) > 0.0:
                return False
    return True


@njit(nogil=True, error_model="numpy")
def excludes_zero(room: Members) -> int:
    """Whether zero is in no member of the hull of the vertices, after any terms (Lemmas 8, 9).

    0 if that is not shown; 1 along a direction, which is along[0] then; 2 by shares of the
    polynomial `along`.
    """
    common, vertices, slow = 0.0, 0, room.slow
    slow[:] = 0.0
    for n in range(room.kind.size):
        if room.kind[n] == 2:
            common += abs(room.v[n, 0])
            for k in range(room.c.shape[1]):
                common += abs(room.c[n, k, 0])
    turned, low, high, last = 1.0 + 0j, 10.0, -10.0, 0
    for n in range(room.kind.size):
        if room.kind[n] != 1:
            continue
        size = abs(room.v[n, 0])
        own = common
        if room.used[n]:
            for k in range(room.c.shape[1]):
                own += abs(room.c[n, k, 0])
        if not own < size < np.inf:
            return 0
        if vertices == 0:
            turned = room.v[n, 0] / size
        vertices, last = vertices + 1, n
        for i in range(ORDER):
            slow[i] += room.v[n, i] / size
        half = np.arcsin(own / size) if own > 0.0 else 0.0
        for sign in (-1.0, 1.0):
            end = (room.v[n, 0] + sign * room.v[n, 1]) * turned.conjugate()
            angle = np.arctan2(end.imag, end.real)
            low, high = min(low, angle - half), max(high, angle + half)
    if vertices == 1 and common == 0.0 and not room.used[last]:
        # Of a single line the direction of its point nearest to zero.
        v0, v1 = room.v[last, 0], room.v[last, 1]
        length = v1.real * v1.real + v1.imag * v1.imag
        t = -(v0.real * v1.real + v0.imag * v1.imag) / length if length > 0.0 else 0.0
        direction = v0 + min(max(t, -1.0), 1.0) * v1
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
    if gamma > 0.0 and (common > 0.0 or vertices > 1 or room.used[last]):
        room.along[:] = slow
        if _holds(room, gamma):
            return 2
    return 0


class Question(NamedTuple):
    """Tests of which one has to hold on each interval; affine in a level.

    Attributes
    ----------
    kind : int array, shape (tests, members)
        1 for a vertex, 2 for a term of any phase, 0 for none.
    weights, slopes : complex arrays, shape (tests, members, functions)
        A member is the combination of the functions with weights + level slopes.
    arc : float array, shape (0, 4) or (2, 4)
        One more test: f_0 + exp(j psi) f_1, or f_0 + (cos psi - 1) f_1 + j sin psi f_2 of three
        functions, with psi from a + b omega to c + d omega. The rows are (a, b, c, d), and
        their slopes in the level.
    loose : int
        So many functions, the last ones, are terms of any phase in that test, and in what a
        search looks for.
    """

    kind: IntArray
    weights: ComplexArray
    slopes: ComplexArray
    arc: FloatArray
    loose: int


@njit(nogil=True, error_model="numpy")
def _at(c: ComplexArray, t: float) -> Any:
    """Evaluate a Taylor polynomial."""
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]))


@njit(nogil=True, error_model="numpy")
def _aim(goal: int, f: complex, g: complex, radius: float, omega: float) -> tuple[float, float]:
    """Return what a search looks for: a function that is zero there, and the value.

    L = f / g is known up to a disc of radius `radius` / abs(g). If that is not zero, or for a
    distance, the value itself is to be small, and there is no function.
    """
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


@njit(nogil=True, error_model="numpy")
def aims(
    goal: int, f: ComplexArray, g: ComplexArray, radius: FloatArray, omega: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """`_aim` at many frequencies."""
    crossing, value = np.empty(omega.size), np.empty(omega.size)
    for i in range(omega.size):
        crossing[i], value[i] = _aim(goal, f[i], g[i], radius[i], omega[i])
    return crossing, value


@njit(nogil=True, error_model="numpy")
def _measure(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    goal: int,
    omega: float,
    spare: Workspace,
) -> Any:
    """`_aim` at a frequency."""
    exact = np.zeros(steady.shape[1])
    expand(space, omega, 0.0, spare)
    radius = 0.0
    for f in range(spare.f.shape[0]):
        combine(space, steady[f], delayed[f], exact, spare, f)
        if f >= 2:
            radius += abs(spare.f[f, 0])
    return _aim(goal, spare.f[0, 0], spare.f[1, 0], radius, omega)


@njit(nogil=True, error_model="numpy")
def _candidate(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    goal: int,
    m: float,
    r: float,
    best: float,
    start: float,
    work: Workspace,
    spare: Workspace,
) -> tuple[float, float]:
    """Return a value better than `best` in an interval, and where, or `best` and nan.

    The Taylor polynomials say where it may be; the functions themselves say what it is.
    """
    found, where = best, np.nan
    h, v, loose = np.empty(9), np.empty(9), spare.f.shape[0] > 2
    for i in range(9):
        t, radius = 0.25 * i - 1.0, 0.0
        for f in range(2, spare.f.shape[0]):
            radius += abs(_at(work.f[f], t))
        h[i], v[i] = _aim(goal, _at(work.f[0], t), _at(work.f[1], t), radius, m + r * t)
    if goal == DISTANCE or loose:
        i = int(np.argmin(v))
        t = 0.25 * i - 1.0
        if 0 < i < 8 and np.isfinite(v[i - 1] + v[i + 1]):
            bent = v[i - 1] - 2.0 * v[i] + v[i + 1]
            if bent > 0.0:
                t += 0.125 * (v[i - 1] - v[i + 1]) / bent
        omega = max(m + r * t, 0.0)
        _, value = _measure(space, steady, delayed, goal, omega, spare)
        if (start < value or (loose and start == value)) and value < found:
            found, where = value, omega
        return found, where
    for i in range(8):
        if (h[i] < 0.0) == (h[i + 1] < 0.0):
            continue
        if not min(v[i], v[i + 1]) < found + abs(v[i] - v[i + 1]):
            continue
        a, b = m + r * (0.25 * i - 1.0), m + r * (0.25 * i - 0.75)
        ha, _ = _measure(space, steady, delayed, goal, a, spare)
        hb, _ = _measure(space, steady, delayed, goal, b, spare)
        if (ha < 0.0) == (hb < 0.0):
            continue
        # The rule of false position, with the weight of an end halved that stays (Illinois).
        side, value, omega, last = 0, np.nan, a, 0.0
        for _ in range(60):
            last, omega = omega, (a * hb - b * ha) / (hb - ha)
            hc, value = _measure(space, steady, delayed, goal, omega, spare)
            if hc == 0.0 or abs(omega - last) <= 2.0 * EPSILON * omega:
                break
            if (hc < 0.0) == (hb < 0.0):
                b, hb = omega, hc
                ha = 0.5 * ha if side == 1 else ha
                side = 1
            else:
                a, ha = omega, hc
                hb = 0.5 * hb if side == -1 else hb
                side = -1
        if start < value < found:
            found, where = value, omega
    return found, where


@njit(nogil=True, error_model="numpy")
def walk(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    question: Question,
    pending: FloatArray,
    goal: int,
    best: float,
    where: float,
    start: float,
    tolerance: float,
    narrowest: float,
    most: int,
    most_left: int,
) -> tuple[FloatArray, FloatArray, float, float, int]:
    """Halve intervals until a test holds on each, at the level of the best value so far.

    The level is start + (best - start) (1 - tolerance). An interval on which no test holds may
    hold a better value, which is looked for there.

    Returns the intervals that are left after so many steps, those narrower than `narrowest` of
    their frequency on which no test holds, the best value, where it is, and the steps.
    """
    functions, tests = steady.shape[0], question.kind.shape[0]
    loose = question.loose
    # What is looked for are the first two functions and the loose ones.
    work, spare = workspace(space, functions), workspace(space, 2 + loose)
    size = max(question.kind.shape[1], 3 + loose)
    room, corner = members(size, space.delays.size), np.zeros(size, np.int64)
    corner[:3], corner[3 : 3 + loose] = 1, 2
    exact, weights = np.zeros(steady.shape[1]), np.zeros(functions, np.complex128)
    stack, top = np.empty((pending.shape[0] + 300, 2)), pending.shape[0]
    stack[:top] = pending
    undecided, left, steps = np.empty((most_left, 2)), 0, 0
    while top > 0 and steps < most and left < most_left:
        top -= 1
        low, high = stack[top, 0], stack[top, 1]
        m, r = 0.5 * (low + high), 0.5 * (high - low) + 2.0 * EPSILON * high
        steps += 1
        level = start + (best - start) * (1.0 - tolerance)
        expand(space, m, r, work)
        for f in range(functions):
            combine(space, steady[f], delayed[f], exact, work, f)
        held = 0
        for i in range(tests):
            room.kind[:] = 0
            for n in range(question.kind.shape[1]):
                room.kind[n] = question.kind[i, n]
                if room.kind[n]:
                    weights[:] = question.weights[i, n]
                    for f in range(functions):
                        if question.slopes[i, n, f] != 0.0:
                            weights[f] += level * question.slopes[i, n, f]
                    mix(weights, work, room, n)
            held = excludes_zero(room)
            if held:
                break
        if not held and question.arc.size:
            arc = question.arc[0].copy()
            for n in range(4):
                if question.arc[1, n] != 0.0:
                    arc[n] += level * question.arc[1, n]
            begin = arc[0] + min(arc[1] * low, arc[1] * high)
            span = arc[2] + max(arc[3] * low, arc[3] * high) - begin
            span = min(span, 2.0 * np.pi)
            parts = int(span / 0.35) + 1
            # Neighbours overlap by more than angles are rounded by.
            half = 0.5 * span / parts + 4.0 * EPSILON * (abs(begin) + span)
            room.kind[:] = corner
            for n in range(loose):
                weights[:] = 0.0
                weights[functions - loose + n] = 1.0
                mix(weights, work, room, 3 + n)
            for i in range(parts):
                # A triangle that holds this part of the arc (Lemma 16).
                turn = begin + (2 * i + 1) * half
                for n in range(3):
                    weights[:] = 0.0
                    weights[0] = 1.0
                    angle = turn + (n - 1) * half
                    # Of the corner exp(j angle), or of the one in the middle, over cos(half).
                    less, sine = -2.0 * np.sin(0.5 * angle) ** 2, np.sin(angle)
                    if n == 1:
                        least = -2.0 * np.sin(0.5 * half) ** 2
                        less, sine = (less - least) / (1.0 + least), sine / (1.0 + least)
                    weights[1] = complex(1.0 + less, sine)
                    if functions - loose > 2:
                        weights[1], weights[2] = less, complex(0.0, sine)
                    mix(weights, work, room, n)
                held = excludes_zero(room)
                if not held:
                    break
        if held:
            continue
        middle = m
        if high > 4.0 * low:
            middle = np.sqrt(low * high) if low > 0.0 else high / 64.0
        resolved = work.lead.size == 0 or work.lead[-1] < 0
        if resolved and best > start:
            better, at = _candidate(
                space, steady, delayed, goal, m, r, best, start, work, spare
            )
            if better < best:
                best, where = better, at
                if best <= start:
                    return stack[:0].copy(), undecided[:0].copy(), best, where, steps
        if high - low <= narrowest * high or middle <= low or middle >= high:
            undecided[left, 0], undecided[left, 1] = low, high
            left += 1
            continue
        # Which half comes first changes from step to step: in a random order the best value so
        # far improves a few times, in ascending order it may do so at each turn of a delay.
        first = top + (steps & 1)
        stack[first, 0], stack[first, 1] = middle, high
        second = top + 1 - (steps & 1)
        stack[second, 0], stack[second, 1] = low, middle
        top += 2
    return stack[:top].copy(), undecided[:left].copy(), best, where, steps


@njit(nogil=True, error_model="numpy")
def wind(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    uncertain: FloatArray,
    begin: float,
    end: float,
    most: int,
) -> tuple[float, complex, complex, float, int]:
    """Follow the argument of a function along the axis (Lemma 10).

    Returns the argument gathered from `begin` to `end`, the values at both, the frequency
    where zero is not excluded (nan if there is none), and the steps.
    """
    work, room = workspace(space, 1), members(1, space.delays.size)
    one = np.ones(1, np.complex128)
    room.kind[0] = 1
    kept = room.along.copy()
    stack, top, steps = np.empty((300, 2)), 1, 0
    stack[0, 0], stack[0, 1] = begin, end
    total, first, value = 0.0, 0j, 0j
    while top > 0:
        top -= 1
        low, high = stack[top, 0], stack[top, 1]
        m, r = 0.5 * (low + high), 0.5 * (high - low) + 2.0 * EPSILON * high
        steps += 1
        expand(space, m, r, work)
        combine(space, steady, delayed, uncertain, work, 0)
        mix(one, work, room, 0)
        held = excludes_zero(room)
        if held:
            kept[:] = room.along
            if held == 1:
                kept[1:] = 0.0
            # An end takes part in two intervals with one value. What that is off by is below
            # a quarter turn, and cancels.
            if low == begin:
                first = value = _at(work.f[0], (low - m) / r)
            for sign, edge in ((-1.0, low), (1.0, high)):
                t = (edge - m) / r
                if sign > 0.0:
                    value = _at(work.f[0], t)
                g = _at(kept, t)
                a, b = value * g.conjugate(), g * kept[0].conjugate()
                turn = np.arctan2(a.imag, a.real) + np.arctan2(b.imag, b.real)
                total += sign * turn
            continue
        middle = m
        if high > 4.0 * low:
            middle = np.sqrt(low * high) if low > 0.0 else high / 64.0
        narrow = high - low <= 4.0 * EPSILON * high or high < 1e-290
        if narrow or middle <= low or middle >= high or steps >= most:
            return total, first, value, m, steps
        stack[top, 0], stack[top, 1] = middle, high
        stack[top + 1, 0], stack[top + 1, 1] = low, middle
        top += 2
    return total, first, value, np.nan, steps


@njit(nogil=True, error_model="numpy")
def wind_many(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    uncertain: FloatArray,
    begin: FloatArray,
    end: FloatArray,
    most: int,
) -> tuple[FloatArray, ComplexArray, ComplexArray, FloatArray, IntArray]:
    """`wind` for many functions of a space, until one takes too many steps."""
    n = begin.size
    total, undecided, steps = np.empty(n), np.empty(n), np.empty(n, np.int64)
    first, last = np.empty(n, np.complex128), np.empty(n, np.complex128)
    for i in range(n):
        total[i], first[i], last[i], undecided[i], steps[i] = wind(
            space, steady[i], delayed[i], uncertain[i], begin[i], end[i], most
        )
        if steps[i] >= most:
            steps[i:] = steps[i]
            break
    return total, first, last, undecided, steps


@njit(nogil=True, error_model="numpy")
def resolved(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    begin: float,
    end: float,
    most: int,
) -> tuple[FloatArray, ComplexArray]:
    """Frequencies so close that a Taylor polynomial represents a function between them.

    With the step of Newton's method at each, F over its derivative by s.
    """
    work, exact = workspace(space, 1), np.zeros(steady.size)
    stack, top, n = np.empty((300, 2)), 1, 0
    found, moves = np.empty(most), np.empty(most, np.complex128)
    stack[0, 0], stack[0, 1] = begin, end
    while top > 0 and n < most:
        top -= 1
        low, high = stack[top, 0], stack[top, 1]
        m, r = 0.5 * (low + high), 0.5 * (high - low)
        expand(space, m, r, work)
        combine(space, steady, delayed, exact, work, 0)
        f = work.f[0]
        bent = abs(f[2]) + abs(f[3]) + np.abs(work.c[0]).sum()
        turns = 0.0
        for k in range(space.delays.size):
            if np.abs(delayed[:, k]).sum() > 0.0:
                turns = max(turns, space.delays[k] * r)
        size, rest, short = abs(f[0]) + abs(f[1]), work.rest[0], r <= 0.02 * m
        close = 8.0 * bent <= size and (8.0 * rest <= size or short)
        # Where rounding hides the function, shorter steps do not help.
        close = close or (short and size <= 2.0 * rest)
        if (close and turns <= 0.3) or top > 290 or r <= 4.0 * EPSILON * m:
            found[n] = m
            moves[n] = complex(0.0, r) * f[0] / f[1]
            n += 1
            continue
        middle = np.sqrt(low * high) if high > 4.0 * low else m
        stack[top, 0], stack[top, 1] = middle, high
        stack[top + 1, 0], stack[top + 1, 1] = low, middle
        top += 2
    return found[:n].copy(), moves[:n].copy()


class Crossed(NamedTuple):
    """Where members of rows N - x M have zeros on the axis, see `cross`."""

    row: IntArray  # (n,)
    x: FloatArray  # (n,): where the zero is, and how far from it at most
    spread: FloatArray
    omega: FloatArray  # (n,): its frequency in rad/s, and how far from it at most
    width: FloatArray
    jump: IntArray  # (n,): by how many the zeros on the right increase with x


@njit(nogil=True, error_model="numpy")
def _appended(table: FloatArray, n: int) -> FloatArray:
    """Return a table with room for entry n."""
    if n < table.shape[0]:
        return table
    longer = np.empty((2 * n, table.shape[1]))
    longer[:n] = table
    return longer


@njit(nogil=True, error_model="numpy")
def _times_conjugate(f: ComplexArray, g: ComplexArray, product: ComplexArray) -> None:
    """Multiply one Taylor polynomial by the conjugate of another."""
    product[:] = 0.0
    for i in range(ORDER):
        for k in range(ORDER):
            product[i + k] += f[i] * g[k].conjugate()


@njit(nogil=True, error_model="numpy")
def _row_excludes_zero(
    low: float, high: float, first: float, last: float, work: Workspace, room: Members
) -> bool:
    """Whether zero is in no f_0 - y f_1 - x f_2, x from `low` to `high`, y from first to last.

    Of one row two corners suffice.
    """
    weights = np.ones(3, np.complex128)
    room.kind[:] = 0
    for n in range(4 if first < last else 2):
        room.kind[n] = 1
        weights[1], weights[2] = -(first if n < 2 else last), -(low if n % 2 == 0 else high)
        mix(weights, work, room, n)
    return bool(excludes_zero(room) > 0)


@njit(nogil=True, error_model="numpy")
def _evaluate(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    exact: FloatArray,
    omega: float,
    y: float,
    w: Workspace,
) -> tuple[complex, complex, float, float]:
    """Return N = f_0 - y f_1 and M = f_2 at a frequency, and their errors."""
    expand(space, omega, 0.0, w)
    for f in range(3):
        combine(space, steady[f], delayed[f], exact, w, f)
    size = abs(w.f[0, 0]) + abs(y * w.f[1, 0])
    return (
        w.f[0, 0] - y * w.f[1, 0],
        w.f[2, 0],
        w.rest[0] + abs(y) * w.rest[1] + 2.0 * EPSILON * size,
        w.rest[2],
    )


@njit(nogil=True, error_model="numpy")
def cross(
    space: Arrays,
    steady: FloatArray,
    delayed: FloatArray,
    y: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    begin: float,
    end: float,
    is_map: bool,
    fine: float,
    most: int,
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Find the zeros on the axis of each row f_0 - y f_1 - x f_2, `lower` <= x <= `upper`.

    With N = f_0 - y f_1 and M = f_2 they are where h = Im(N conj M) is zero, at x = Re(N / M)
    (Lemma 18). All rows share the expansion of an interval. Between infinite bounds all zeros
    of h are found, those of M included. `begin` is 0 for the axis from s = 0, and a map's ends
    at `end`: there N / M is real, and a root crosses alone.

    Returns a table of crossings with the columns of `Crossed`, exact to `fine` in x where
    rounding allows; a table of intervals that are not decided (row, least and largest x there,
    the two frequencies); and the rows for which so many steps, in all, did not suffice.
    """
    rows, work, spare = y.size, workspace(space, 3), workspace(space, 3)
    room, exact = members(4, space.delays.size), np.zeros(steady.shape[1])
    everywhere, steps = upper[0] == np.inf, 0
    found, n, undecided, left = np.empty((64, 6)), 0, np.empty((16, 5)), 0
    size = 2 * ORDER - 1
    products = np.empty((4, size), np.complex128)
    a, b, square, z = products[0], products[1], products[2], products[3]
    ends, unfinished = np.empty((2, 2)), np.zeros(rows, np.bool_)
    pool, number = np.empty((300, rows), np.int64), np.zeros(300, np.int64)
    pool[0], number[0] = np.arange(rows), rows
    stack, depth, top = np.empty((300, 2)), np.zeros(300, np.int64), 1
    low_cut = begin if begin > 0.0 else 1e-3 * end
    high_cut = end if not is_map else end - 1e-3 * end
    stack[0, 0], stack[0, 1] = low_cut, high_cut
    if begin == 0.0:
        # An interval around the end of the axis, where h is odd.
        stack[top, 0], stack[top, 1] = -low_cut, low_cut
        top += 1
    if is_map:
        stack[top, 0], stack[top, 1] = high_cut, 2.0 * end - high_cut
        top += 1
    while top > 0:
        top -= 1
        low, high, d = stack[top, 0], stack[top, 1], depth[top]
        around = low < 0.0 or (is_map and high > end)
        m, r = 0.5 * (low + high), 0.5 * (high - low) + 2.0 * EPSILON * high
        if around:
            m = 0.0 if low < 0.0 else end
        steps += 1
        if steps > most:
            for i in range(number[d]):
                unfinished[pool[d, i]] = True
            continue
        expand(space, m, r, work)
        for f in range(3):
            combine(space, steady[f], delayed[f], exact, work, f)
        fast, settled, far = False, True, False
        for k in range(work.angle.size):
            fast |= work.lead[k] >= 0
            far |= space.delays[k] * r > _FAR
            settled &= space.delays[k] * r < 3e-4
        for j in range(work.p.shape[0]):
            settled &= work.bound[j, ORDER] <= EPSILON * work.bound[j, 0]
        narrow = r <= 1e-13 * m or r < 1e-280
        if not everywhere and number[d] > 1:
            first, last, lowest, highest = np.inf, -np.inf, np.inf, -np.inf
            for i in range(number[d]):
                row = pool[d, i]
                first, last = min(first, y[row]), max(last, y[row])
                lowest, highest = min(lowest, lower[row]), max(highest, upper[row])
            if _row_excludes_zero(lowest, highest, first, last, work, room):
                continue
        _times_conjugate(work.f[0], work.f[2], a)
        _times_conjugate(work.f[1], work.f[2], b)
        _times_conjugate(work.f[2], work.f[2], square)
        size_a, size_b, size_m = 0.0, 0.0, 0.0
        for i in range(ORDER):
            size_a += abs(work.f[0, i])
            size_b += abs(work.f[1, i])
            size_m += abs(work.f[2, i])
        least = 2.0 * abs(work.f[2, 0]) - size_m - work.rest[2]
        known, kept = False, 0
        for i in range(number[d]):
            row = pool[d, i]
            v = y[row]
            # Rows are tested one by one where a long interval may be spared, or a short one.
            alone = narrow or number[d] == 1 or far or (not fast and least <= 0.0)
            if (
                not everywhere
                and alone
                and _row_excludes_zero(lower[row], upper[row], v, v, work, room)
            ):
                continue
            if fast:
                if narrow:
                    undecided = _appended(undecided, left)
                    undecided[left, 0] = row
                    undecided[left, 1], undecided[left, 2] = -np.inf, np.inf
                    undecided[left, 3], undecided[left, 4] = max(low, 0.0), min(high, end)
                    left += 1
                else:
                    pool[d + 1, kept] = row
                    kept += 1
                continue
            rest = work.rest[0] + abs(v) * work.rest[1]
            size_n = size_a + abs(v) * size_b
            off = (rest + 32.0 * EPSILON * size_n) * size_m + work.rest[2] * (size_n + rest)
            varied, bent = 0.0, 0.0
            for k in range(size):
                z[k] = a[k] - v * b[k]
                if k > 0:
                    varied += abs(z[k].imag)
                if k > 1:
                    bent += k * abs(z[k].imag)
            if abs(z[0].imag) > varied + off:
                continue
            if not everywhere:
                above, below, more = z[0].real, z[0].real, off
                above -= upper[row] * square[0].real
                below -= lower[row] * square[0].real
                more += (
                    3.0
                    * max(abs(lower[row]), abs(upper[row]))
                    * size_m
                    * (work.rest[2] + 32.0 * EPSILON * size_m)
                )
                for k in range(1, size):
                    above -= abs(z[k].real - upper[row] * square[k].real)
                    below += abs(z[k].real - lower[row] * square[k].real)
                if above > more or below < -more:
                    continue
            # Errors of the coefficients, and that of the remainder's slope (Lemma 18).
            slope = abs(z[1].imag) - bent - 10.0 * off
            if slope > 0.0 and (least > 0.0 or everywhere):
                if not known and not around:
                    known = True
                    for e in range(2):
                        at = low if e == 0 else high
                        _evaluate(space, steady, delayed, exact, at, 0.0, spare)
                        m_end = spare.f[2, 0].conjugate()
                        ends[e, 0] = (spare.f[0, 0] * m_end).imag
                        ends[e, 1] = (spare.f[1, 0] * m_end).imag
                if not around and (ends[0, 0] - v * ends[0, 1] < 0.0) == (
                    ends[1, 0] - v * ends[1, 1] < 0.0
                ):
                    continue
                t, inclined = 0.0, z[1].imag
                if not around:
                    for _ in range(4):
                        p, inclined = 0.0, 0.0
                        for k in range(size - 1, -1, -1):
                            inclined = inclined * t + p
                            p = p * t + z[k].imag
                        t = min(max(t - p / inclined, -1.0), 1.0)
                # The functions themselves have another common factor than their polynomials,
                # from which h over |N|^2 + |M|^2 is free.
                f, g = _at(work.f[0], t) - v * _at(work.f[1], t), _at(work.f[2], t)
                slide = 3.0 * size_n * (1.0 + size_m / least) / least if least > 0.0 else np.inf
                off_t = rough = min(2.0 * off / slope, 2.0)
                x = (f * g.conjugate()).real / (g * g.conjugate()).real
                spread = slide * off_t + 2.0 * (rest + abs(x) * work.rest[2]) / abs(g)
                outside = x + spread < lower[row] or x - spread > upper[row]
                if not around and outside:
                    continue
                total = (f * f.conjugate()).real + (g * g.conjugate()).real
                inclined = inclined / total if total > 0.0 else 0.0
                largest = (size_n + rest) ** 2 + (size_m + work.rest[2]) ** 2
                before, at = 0.0, 0.0
                for step in range(8):
                    f, g, error_f, error_g = _evaluate(
                        space, steady, delayed, exact, m + r * t, v, spare
                    )
                    total = (f * f.conjugate()).real + (g * g.conjugate()).real
                    if not (total > 0.0 and inclined != 0.0):
                        # N and M have a common zero here.
                        break
                    value = (f * g.conjugate()).imag / total
                    wrong = 2.0 * (error_f * abs(g) + error_g * abs(f)) / total
                    # Of the two around s = 0 and a map's end the place is known.
                    off_t = 0.0 if around else min((abs(value) + wrong) * largest / slope, 2.0)
                    x = (f * g.conjugate()).real / (g * g.conjugate()).real
                    near = abs(_at(work.f[2], t)) - work.rest[2] - ORDER * off_t * size_m
                    if near > least > 0.0:
                        slide = 3.0 * size_n * (1.0 + size_m / near) / near
                    spread = slide * off_t + 2.0 * (error_f + abs(x) * error_g) / abs(g)
                    outside = x + spread < lower[row] or x - spread > upper[row]
                    if around or outside or spread <= fine or abs(value) <= wrong:
                        break
                    if step > 0 and t != at and value != before:
                        inclined = (value - before) / (t - at)
                    before, at = value, t
                    t = min(max(t - value / inclined, -1.0), 1.0)
                if outside:
                    continue
                off_t = off_t if off_t <= 2.0 else rough
                found = _appended(found, n)
                sign = 1.0 if z[1].imag > 0.0 else -1.0
                found[n, 0], found[n, 1], found[n, 2] = row, x, spread
                found[n, 3], found[n, 4] = m + r * t, r * off_t
                found[n, 5] = sign if around else 2.0 * sign
                n += 1
                continue
            if narrow or (settled and abs(z[0].imag) + varied <= 2.0 * off):
                # In shorter intervals rounding hides h as well. If it hides h on much of the
                # axis, as where N is nearly a multiple of M, no row is followed further.
                if left == _MOST_UNDECIDED * rows:
                    unfinished[:] = True
                    return found[:n].copy(), undecided[:left].copy(), unfinished
                undecided = _appended(undecided, left)
                middle, reach = 0.0, np.inf
                if least > 0.0:
                    middle = z[0].real / square[0].real
                    reach = off + 3.0 * abs(middle) * size_m * work.rest[2]
                    for k in range(1, size):
                        reach += abs(z[k].real - middle * square[k].real)
                    reach = 1.01 * reach / (least * least)
                undecided[left, 0] = row
                undecided[left, 1], undecided[left, 2] = middle - reach, middle + reach
                undecided[left, 3], undecided[left, 4] = max(low, 0.0), min(high, end)
                left += 1
                continue
            pool[d + 1, kept] = row
            kept += 1
        if kept:
            number[d + 1] = kept
            middle = m if high <= 4.0 * low else np.sqrt(low) * np.sqrt(high)
            parts = (low, middle), (middle, high)
            if around:
                q = r / 16.0
                parts = ((q, high), (-q, q)) if low < 0.0 else ((low, m - q), (m - q, m + q))
            for part in parts:
                stack[top, 0], stack[top, 1] = part
                depth[top] = d + 1
                top += 1
    return found[:n].copy(), undecided[:left].copy(), unfinished
