"""Step and impulse responses of systems with delays, by the inverse Laplace transform.

Jumps and kinks would make the integral of `armlock.timedomain.inversion` converge slowly. They
follow from the expansion of G in powers of 1 / (s + corner), whose coefficients are sums of
delays, and are taken out and put back exactly. Factors that N and M share are divided out
first, because rounding errors would grow with hidden modes.
"""

from __future__ import annotations

import math
import warnings
from functools import partial
from heapq import heapify, heappop, heappush
from math import factorial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx, fmpq_poly

from armlock.checks import ComplexArray, FloatArray, finite_series, positive_number
from armlock.engine.decide import count
from armlock.engine.functions import common_zeros
from armlock.engine.polynomials import collected, enclosed_roots, exact, polynomial
from armlock.engine.tolerances import EPSILON
from armlock.engine.values import times
from armlock.stability.counts import decided, require_stable
from armlock.systems import Delay, Lag, Sum, System
from armlock.systems import s as laplace
from armlock.timedomain.inversion import Line, TooLongError, inverted

if TYPE_CHECKING:
    import control

# Powers of 1 / (s + corner) that are taken out.
_ORDERS = 3
# How far right of all poles the transform is taken, times the last time. Poles are as far from
# its panels, and rounding errors grow by so many powers of e.
_AWAY = 3.0
# Kinks are taken out with a corner at which none is so many times larger than the response.
_MOST_ABOVE = 1e3
# Values above exp of this are no floats.
_MOST_GROWTH = 600.0
# The errors, over the largest value.
_CLAIMED = 1e-9
# Jumps and kinks that are followed.
_MOST_JUMPS = 20_000

_S = fmpq_poly([0, 1])

#: A sum of exponentials exp(-s theta): delays and coefficients.
_Jumps = dict[fmpq, float]
#: A sum of polynomials of s, by the lengths of their delays.
_Terms = dict[fmpq, fmpq_poly]


def step_response(system: System, timepts: npt.ArrayLike) -> control.TimeResponseData:
    """Return the response to a unit step at t = 0.

    Parameters
    ----------
    system : System
        For instance ``loop.feedback()``: the response is that of the system itself. Its
        parameters are nominal.
    timepts : array_like of float, or float
        Ascending times in s from 0 on, evenly spaced or not; or the last of 1001 even times.

    Returns
    -------
    control.TimeResponseData
        As from ``control.step_response``: ``response.time``, ``response.outputs``. `step_info`
        has overshoot and settling time.

    Raises
    ------
    TypeError, ValueError
        If `timepts` is not finite and ascending from 0 on, the response has derivatives of
        impulses, or the times end too late: the message has a time up to which the response
        can be computed.

    Warns
    -----
    UserWarning
        If the response contains impulses. They are no part of the outputs.

    Notes
    -----
    As with ``control.step_response``, an unstable system is no error: its response grows. A
    slow growth may not show by the last time. `armlock.unstable_roots` decides stability.

    The error is at most 1e-9 of the largest value up to the last time, at jumps too. There
    the value is the one after the jump. An impulse counts by its area over the last time. This
    is checked, not proved: the transform is interpolated over frequencies until the values in
    between agree, and what rounding errors make of the response is summed. Where that is more
    than 1e-9, the response is refused.

    Factors of numerator and denominator that are equal are divided out, with delays too: a
    hidden mode is no part of a response, unstable or not.

    The transform turns once in 2 pi over the delays up to the highest crossover. A loop that is
    fast beside its delays takes so many frequencies that 65 536 panels end soon after the first
    echo: after 31 s for `flight_loop`, whose round trips take 33 s. Shorter times need none of
    that, because what comes later than the last time is left out.

    Examples
    --------
    >>> import control
    >>> from armlock import delay, step_response
    >>> loop = control.tf([1], [1, 0]) * delay(1.0)
    >>> print(step_response(loop.feedback(), [0.5, 1.5, 2.5]).outputs.round(6))
    [0.    0.5   1.375]
    """
    return _response(System.of(system) / laplace, timepts, "Step")


def impulse_response(system: System, timepts: npt.ArrayLike) -> control.TimeResponseData:
    """Return the response to a unit impulse at t = 0.

    Parameters
    ----------
    system : System
        As that of `step_response`.
    timepts : array_like of float, or float
        Ascending times in s from 0 on; or the last of 1001 even times.

    Returns
    -------
    control.TimeResponseData
        As from ``control.impulse_response``.

    Raises
    ------
    TypeError, ValueError
        As those of `step_response`.

    Warns
    -----
    UserWarning
        As that of `step_response`.

    Notes
    -----
    The error is that of `step_response`.

    Examples
    --------
    >>> import control
    >>> from armlock import delay, impulse_response
    >>> found = impulse_response(control.tf([1], [1, 1]) * delay(1.0), [0.5, 1.0, 2.0])
    >>> print(found.outputs.round(6))
    [0.       1.       0.367879]
    """
    return _response(System.of(system), timepts, "Impulse")


def step_info(system: System, timepts: npt.ArrayLike, **options: Any) -> dict[str, float]:
    """Return rise time, settling time, overshoot and others of a step response.

    Parameters
    ----------
    system : System
        As that of `step_response`; stable.
    timepts : array_like of float, or float
        As that of `step_response`. Times are found among these, and peaks at them.
    **options
        ``SettlingTimeThreshold`` and ``RiseTimeLimits`` of ``control.step_info``.

    Returns
    -------
    dict of str to float
        As from ``control.step_info``, with times in s and overshoot in percent. The final value
        is that of the system at s = 0, and not the last sample. What has not settled by the
        last time has a settling time of nan.

    Raises
    ------
    TypeError, ValueError
        As those of `step_response`; if the system is not stable; or if its final value is zero,
        to which nothing is relative.

    Examples
    --------
    >>> import control
    >>> from armlock import delay, step_info
    >>> loop = control.tf([0.5], [1, 0]) * delay(1.0)
    >>> info = step_info(loop.feedback(), 30.0)
    >>> print(f"{info['Overshoot']:.2f} %, settled after {info['SettlingTime']:.2f} s")
    4.05 %, settled after 6.06 s
    """
    import control

    system = System.of(system)
    n, d, point = system.open_functions((), {}, "system")
    with decided("no final value", point):
        require_stable(d, common_zeros(n, d), "system", "pole")
    final = float(np.real(system(0.0)))
    if not final:
        raise ValueError(
            f"system must have a final value that is not zero, got {system!r:.200}"
        )
    found = step_response(system, timepts)
    info: dict[str, float] = control.step_info(
        found.outputs, T=found.time, yfinal=final, **options
    )
    return info


def _response(system: System, timepts: npt.ArrayLike, what: str) -> control.TimeResponseData:
    """Return the response to an impulse."""
    import control

    if system.is_equation:
        raise TypeError(f"system must have an output, got {system!r}")
    system = system.at(**system.given((), {}))
    time = finite_series("timepts", timepts, 0, 1)
    if time.ndim == 0:
        time = np.linspace(0.0, positive_number("timepts", timepts), 1001)
    if time.size == 0 or time[0] < 0.0 or (np.diff(time) <= 0.0).any() or time[-1] == 0.0:
        raise ValueError(f"timepts must ascend from 0 s on, got {time}")
    inputs = np.full(time.size, float(what == "Step"))
    outputs = _inverted(*coprime(system.numerator, system.denominator), time)
    return control.TimeResponseData(
        time, outputs, inputs=inputs, issiso=True, title=f"{what} response",
        input_labels=["u[0]"], output_labels=["y[0]"], plot_inputs=False,
    )  # fmt: skip


# What decays may underflow.
@np.errstate(all="ignore")
def _inverted(n: Sum, m: Sum, time: FloatArray) -> FloatArray:
    """Invert N(s) / M(s) at some times."""
    # Each term is delayed by this at least. Only what comes after is left to the inversion, in
    # which it would be small beside a growing response.
    dead = min((lag.time for lag in n.lags), default=fmpq(0))
    begin = int(np.searchsorted(time, float(dead) * (1.0 - 1e-12)))
    outputs, late = np.zeros(time.size), np.maximum(time[begin:] - float(dead), 0.0)
    if not late.size:
        return outputs
    last = float(late[-1]) or float(dead)
    try:
        found = _up_to(n, m, dead, last)
        outputs[begin:] = found.at(late)
    except TooLongError as error:
        until = _longest(n, m, dead, last) + float(dead)
        raise ValueError(
            f"timepts must end by {until:.2g} s, until when this response can be computed, got "
            f"{last + float(dead):g} s, with {error}"
        ) from None
    if impulses := found.jumps[0]:
        at = ", ".join(f"{float(theta + dead):g}" for theta in sorted(impulses)[:5])
        warnings.warn(f"impulses at t = {at} s are not in the outputs", stacklevel=5)
    return outputs


def _longest(n: Sum, m: Sum, dead: fmpq, last: float) -> float:
    """Return a time until which a response can be computed; at twice this time it cannot."""
    short, long = 1e-12 * last, last
    while long > 1.2 * short:
        middle = math.sqrt(short * long)
        try:
            _up_to(n, m, dead, middle).check()
        except TooLongError:
            long = middle
        else:
            short = middle
    # The check is an estimate.
    return 0.7 * short


class _UpTo(NamedTuple):
    """A response up to a time, by what is known of its transform."""

    last: float
    # One sum of delays for each power of 1 / (s + corner), beginning with the impulses.
    jumps: list[_Jumps]
    corner: float
    # The rest on a line right of all poles.
    line: Line

    def check(self) -> None:
        """Raise if it takes too many panels, or if its errors would be too large."""
        self.line.check()
        error = self.line.error * np.exp(self.line.sigma * self.last) / np.pi
        if not error <= 0.1 * _CLAIMED * self.line.least:
            self.at(np.array([self.last]))

    def at(self, time: FloatArray) -> FloatArray:
        """Return the response at some times, or raise if its errors may be too large."""
        outputs, error = inverted(self.line.panels(), self.line.sigma, time)
        for k, part in enumerate(self.jumps[1:]):
            known, size = _after(time, part, k, self.corner, self.last)
            outputs, error = outputs + known, error + 8.0 * EPSILON * size
        # An impulse counts by its area over the last time.
        area = sum(map(abs, self.jumps[0].values()))
        largest = max(np.abs(outputs).max(), area / self.last, self.line.least)
        if not error.max() <= _CLAIMED * largest:
            raise TooLongError("rounding errors above 1e-9 of the largest value")
        return outputs


def _up_to(n: Sum, m: Sum, dead: fmpq, last: float) -> _UpTo:
    """Transform the response to an impulse, as it is up to a time."""
    # What comes later has no effect until then.
    end = exact(last)
    over = {theta - dead: p for theta, p in n.by_length().items() if theta <= dead + end}
    below = {theta: p for theta, p in m.by_length().items() if theta <= end}
    degree = _degree(over, below)
    system = System(_sum(over), _sum(below))
    sigma = _right_of_poles(system, last) + _AWAY / last
    # The largest of the roots of the denominator's polynomials.
    roots = [root for p in below.values() for root, _ in enclosed_roots(p)]
    fastest = max((abs(complex(root)) for root in roots), default=0.0)
    # One over the shortest delay.
    delays = [float(theta) for part in (over, below) for theta in part if theta]
    soonest = 1.0 / min(delays, default=np.inf)
    corner = max(1.0 / last, fastest)
    while True:
        above, under = (_powers(part, degree, corner) for part in (over, below))
        jumps = _expansion(above, under, last * (1.0 + 1e-9))
        # Without impulses the response is as large as s times its transform at any real s.
        s = np.geomspace(sigma, 100.0 * max(corner, soonest), 50).astype(complex)
        impulses = _parts(above, under, corner, s)[0]
        size = float(np.abs(s * (system(s) - impulses)).max())
        # Parts that are far larger than the response would cancel against the rest.
        heights = [abs(a) / corner ** (k - 1) for k in (2, 3) for a in jumps[k].values()]
        if corner >= soonest or max(heights, default=0.0) <= _MOST_ABOVE * size:
            rest = partial(_smooth, system, above, under, corner)
            return _UpTo(last, jumps, corner, Line(rest, sigma, corner, size))
        corner *= 8.0


def _right_of_poles(system: System, last: float) -> float:
    """Real part right of all poles, and not farther than two over the last time."""
    poles = System(system.denominator, Sum({})).affine.n[0]
    step, low, high = 1.0 / last, 0.0, 1.0 / last
    while count(poles, right_of=high) != 0:
        low, high = high, 2.0 * high
        if low > _MOST_GROWTH / last:
            raise TooLongError("values above 1e308")
    while high - low > step:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if count(poles, right_of=middle) == 0 else (middle, high)
    return high


def _sum(part: _Terms) -> Sum:
    """Return a sum whose delays are objects of their own."""
    return Sum({(Lag.after(theta), ()): p for theta, p in part.items()})


def _degree(n: _Terms, m: _Terms) -> int:
    """Highest power of s in the denominator, which nothing delayed may exceed."""
    whole = m.get(fmpq(0), fmpq_poly([0])).degree()
    top = max(p.degree() for p in (*n.values(), *m.values()))
    if whole < top:
        raise ValueError(
            "system must have no more zeros than poles, and the highest power of s in its "
            f"denominator must have no delay, got s^{top} over s^{max(whole, 0)}"
        )
    return whole


def _powers(part: _Terms, degree: int, corner: float) -> list[_Jumps]:
    """Coefficients of the highest powers of s + corner, from `degree` on: sums of delays."""
    moved = polynomial([-corner, 1])
    of = [(theta, p(moved)) for theta, p in part.items()]
    return [
        {theta: float(p[i]) for theta, p in of if i >= 0 and p[i]}
        for i in range(degree, degree - _ORDERS - 1, -1)
    ]


def _expansion(n: list[_Jumps], m: list[_Jumps], last: float) -> list[_Jumps]:
    """Coefficients of N / M in powers of 1 / (s + corner), up to the last time."""
    found: list[_Jumps] = []
    for order, above in enumerate(n):
        left = dict(above)
        for k in range(1, order + 1):
            for theta, a in m[k].items():
                for tau, b in found[order - k].items():
                    left[theta + tau] = left.get(theta + tau, 0.0) - a * b
        found.append(_quotient(left, m[0], last))
    return found


def _quotient(left: _Jumps, by: _Jumps, last: float) -> _Jumps:
    """Divide one sum of delays by another, whose shortest delay is zero, up to a time."""
    queue, found = list(left), {}
    zero, end = fmpq(0), exact(last)
    smallest = 1e-14 * max(map(abs, left.values()), default=0.0) / abs(by[zero])
    heapify(queue)
    while queue:
        theta = heappop(queue)
        value = left.pop(theta, 0.0) / by[zero]
        if theta > end or abs(value) <= smallest:
            continue
        found[theta] = value
        if len(found) > _MOST_JUMPS:
            raise TooLongError(f"more than {_MOST_JUMPS} jumps")
        for other, a in by.items():
            if other:
                if theta + other not in left:
                    heappush(queue, theta + other)
                left[theta + other] = left.get(theta + other, 0.0) - a * value
    return found


def _after(
    time: FloatArray, part: _Jumps, k: int, corner: float, last: float
) -> tuple[FloatArray, FloatArray]:
    """Sum t^k / k! exp(-corner t) after each delay; a time just before counts as at it.

    The second result is the sum of the sizes of the terms.
    """
    found, size = np.zeros(time.size), np.zeros(time.size)
    for theta, value in part.items():
        begin = np.searchsorted(time, float(theta) - 1e-12 * last)
        t = np.maximum(time[begin:] - float(theta), 0.0)
        term = value / factorial(k) * t**k * np.exp(-corner * t)
        found[begin:] += term
        size[begin:] += np.abs(term)
    return found, size


def _parts(
    n: list[_Jumps], m: list[_Jumps], corner: float, s: ComplexArray
) -> list[ComplexArray]:
    """Evaluate impulses, jumps and kinks: the powers of 1 / (s + corner) of N / M."""
    turns = {}
    for theta in set().union(*n, *m):
        product, rest = times(s, float(theta), float(theta - exact(float(theta))))
        turns[theta] = np.exp(-product) * (1.0 - rest)

    def at(part: _Jumps) -> ComplexArray:
        total = np.zeros_like(s)
        for theta, a in part.items():
            total += a * turns[theta]
        return total

    g: list[ComplexArray] = []
    above, below = [at(part) for part in n], [at(part) for part in m]
    for order in range(_ORDERS + 1):
        left = above[order] - sum(below[k] * g[order - k] for k in range(1, order + 1))
        g.append(left / below[0])
    return [part / (s + corner) ** k for k, part in enumerate(g)]


def _smooth(
    system: System, n: list[_Jumps], m: list[_Jumps], corner: float, s: ComplexArray
) -> tuple[ComplexArray, FloatArray]:
    """Evaluate what remains of G(s) without these parts, and bound its rounding errors."""
    parts, (value, error) = _parts(n, m, corner, s), system.values(s, ())
    rest = value - sum(parts)
    # Delays turn alike in G and in its parts.
    error = error + 8.0 * EPSILON * sum(map(np.abs, parts))
    return rest, np.asarray(error)


def coprime(n: Sum, m: Sum) -> tuple[Sum, Sum]:
    """Divide out what two sums share, as polynomials of s and of delays of one length.

    What is left shares zeros at s = 0 alone, if all delays are powers of one: elsewhere
    exp(-s theta) is transcendental where s is algebraic.
    """
    lags = n.lags | m.lags
    lengths = sorted({one.theta for lag in lags for one, _ in lag})
    delays = [Delay(theta, str(theta)) for theta in lengths]
    names = ["s", *(f"z{k}" for k in range(len(lengths)))]
    ring = fmpq_mpoly_ctx.get(names, Ordering.lex)

    def polynomial_of(part: Sum) -> fmpq_mpoly:
        terms = collected(
            ((k, *powers(lag)), c)
            for (lag, _), p in part.terms.items()
            for k, c in enumerate(p.coeffs())
        )
        return ring.from_dict(terms)

    def powers(lag: Lag) -> list[int]:
        number = collected((one.theta, times) for one, times in lag)
        return [number.get(theta, 0) for theta in lengths]

    def sum_of(p: fmpq_mpoly) -> Sum:
        found = collected(
            (Lag.of(dict(zip(delays, map(int, powers), strict=True))), c * _S ** int(k))
            for (k, *powers), c in p.to_dict().items()
        )
        return Sum({(lag, ()): p for lag, p in found.items()})

    above, below = map(polynomial_of, (n, m))
    common = above.gcd(below)
    return sum_of(above / common), sum_of(below / common)
