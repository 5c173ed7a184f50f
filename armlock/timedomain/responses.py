"""Step and impulse responses of systems with delays, by the inverse Laplace transform.

Jumps and kinks would make the integral of `armlock.timedomain.inversion` converge slowly. They
follow from the expansion of G in powers of 1 / (s + corner), whose coefficients are sums of
delays, and are taken out and put back exactly.
"""

from __future__ import annotations

import math
import warnings
from functools import partial
from heapq import heapify, heappop, heappush
from math import factorial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import fmpq, fmpq_poly

from armlock.affine import Affine
from armlock.checks import ComplexArray, FloatArray, finite_series, positive_number
from armlock.engine.chain import Lag
from armlock.engine.decide import count
from armlock.engine.functions import Function
from armlock.engine.polynomials import enclosed_roots, exact, polynomial
from armlock.systems import Sum, System
from armlock.systems import s as laplace
from armlock.timedomain.inversion import Panels, TooLongError, inverted, panels

if TYPE_CHECKING:
    import control

# Powers of 1 / (s + corner) that are taken out.
_ORDERS = 3
# How far right of all poles the transform is taken, times the last time. Poles are as far from
# its panels, and rounding errors grow by so many powers of e.
_AWAY = 3.0
# Jumps and kinks that are followed.
_MOST_JUMPS = 20_000

#: A sum of exponentials exp(-s theta): delays and coefficients.
_Jumps = dict[fmpq, float]
#: A sum of polynomials of s, by the lengths of their delays.
_Terms = dict[fmpq, fmpq_poly]


class _Transformed(NamedTuple):
    """A response up to a time, by what is known of its transform."""

    # One sum of delays for each power of 1 / (s + corner), beginning with the impulses.
    jumps: list[_Jumps]
    corner: float
    # The real part of the line, and the rest on its panels.
    sigma: float
    rest: Panels


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
        As from ``control.step_response``: ``response.time``, ``response.outputs``.

    Raises
    ------
    TypeError, ValueError
        If `timepts` is not finite and ascending from 0 on, the response has derivatives of
        impulses, its neutral chain is not confined, or the times end too late: the message
        has a time up to which the response can be computed.

    Warns
    -----
    UserWarning
        If the response contains impulses. They are no part of the outputs.

    Notes
    -----
    As with ``control.step_response``, an unstable system is no error: its response grows. A
    slow growth may not show by the last time. `armlock.unstable_roots` decides stability.

    The error is at most 1e-9 of the largest value up to the last time, at jumps too. There
    the value is the one after the jump. This is checked, not proved: the transform is
    interpolated over frequencies until the values in between agree.

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
    # Each term is delayed by this at least. Only what comes after is left to the inversion, in
    # which it would be small beside a growing response.
    n, m = system.numerator.by_length(), system.denominator.by_length()
    dead = min(n, default=fmpq(0))
    ahead = {theta - dead: p for theta, p in n.items()}
    begin = int(np.searchsorted(time, float(dead) * (1.0 - 1e-12)))
    outputs = np.zeros(time.size)
    if begin < time.size:
        # What decays may underflow.
        with np.errstate(all="ignore"):
            outputs[begin:] = _inverted(ahead, m, time[begin:], dead)
    return control.TimeResponseData(
        time, outputs, inputs=inputs, issiso=True, title=f"{what} response",
        input_labels=["u[0]"], output_labels=["y[0]"], plot_inputs=False,
    )  # fmt: skip


def _inverted(n: _Terms, m: _Terms, time: FloatArray, dead: fmpq) -> FloatArray:
    """Invert N(s) / M(s) at some times after a dead time."""
    time = np.maximum(time - float(dead), 0.0)
    last = float(time[-1]) or float(dead)
    try:
        (impulses, *jumps), corner, sigma, rest = _transformed(n, m, last)
    except TooLongError as error:
        until = _longest(n, m, last) + float(dead)
        raise ValueError(
            f"timepts must end by {until:.2g} s, until when this response can be computed, got "
            f"{last + float(dead):g} s, with {error}"
        ) from None
    if impulses:
        at = ", ".join(f"{float(theta + dead):g}" for theta in sorted(impulses)[:5])
        warnings.warn(f"impulses at t = {at} s are not in the outputs", stacklevel=4)
    known = [_after(time, part, k, corner, last) for k, part in enumerate(jumps)]
    return np.asarray(sum(known, inverted(rest, sigma, time)))


def _transformed(n: _Terms, m: _Terms, last: float) -> _Transformed:
    """Transform the response to an impulse, as it is up to a time."""
    # What comes later has no effect until then.
    end = exact(last)
    n, m = ({theta: p for theta, p in part.items() if theta <= end} for part in (n, m))
    system, degree = System(_sum(n), _sum(m)), _degree(n, m)
    below = Affine(System(_sum(m), Sum({}))).n[0]
    # The largest of the roots of the denominator's polynomials.
    roots = [root for p in m.values() for root, _ in enclosed_roots(p)]
    corner = max([1.0 / last, *(abs(complex(root)) for root in roots)])
    above, under = (_powers(part, degree, corner) for part in (n, m))
    jumps = _expansion(above, under, last * (1.0 + 1e-9))
    sigma = _right_of_poles(below, last) + _AWAY / last
    # Where nothing is left without the impulses, rounding is.
    least = sigma * float(np.abs(system(sigma * np.array([1.0, 1.0 + 1.0j]))).max())
    rest = panels(partial(_smooth, system, above, under, corner), sigma, corner, least)
    return _Transformed(jumps, corner, sigma, rest)


def _longest(n: _Terms, m: _Terms, last: float) -> float:
    """Return a time until which a response can be computed; a little later it cannot."""
    short, long = 1e-12 * last, last
    while long > 1.2 * short:
        middle = math.sqrt(short * long)
        try:
            _transformed(n, m, middle)
            short = middle
        except TooLongError:
            long = middle
    # The message has two digits.
    return 0.95 * short


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
    smallest = 1e-14 * max(map(abs, left.values()), default=0.0)
    heapify(queue)
    zero, end = fmpq(0), exact(last)
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


def _after(time: FloatArray, part: _Jumps, k: int, corner: float, last: float) -> FloatArray:
    """Sum t^k / k! exp(-corner t) after each delay; a time just before counts as at it."""
    found = np.zeros(time.size)
    for theta, value in part.items():
        begin = np.searchsorted(time, float(theta) - 1e-12 * last)
        t = np.maximum(time[begin:] - float(theta), 0.0)
        found[begin:] += value / factorial(k) * t**k * np.exp(-corner * t)
    return found


def _right_of_poles(below: Function, last: float) -> float:
    """Real part right of all poles, and not farther than a few over the last time."""
    low, high = 0.0, 1.0 / last
    while count(below, right_of=high) != 0:
        low, high = high, 2.0 * high
        if high * last > 600.0:
            raise TooLongError("values above 1e308")
    while high - low > 2.0 / last:
        middle = 0.5 * (low + high)
        stable = count(below, right_of=middle) == 0
        low, high = (low, middle) if stable else (middle, high)
    return high


def _smooth(
    system: System, n: list[_Jumps], m: list[_Jumps], corner: float, s: ComplexArray
) -> ComplexArray:
    """Evaluate what remains of G(s) without jumps and kinks."""
    turns = {theta: np.exp(-s * float(theta)) for theta in set().union(*n, *m)}

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
    return np.asarray(system(s) - sum(part / (s + corner) ** k for k, part in enumerate(g)))
