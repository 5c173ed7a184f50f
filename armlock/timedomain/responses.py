"""Step and impulse responses of systems with delays, by the inverse Laplace transform.

With sigma to the right of all poles, the response is a Fourier integral,

    y(t) = exp(sigma t) / (2 pi) int Y(sigma + j omega) exp(j omega t) d omega .

Jumps and kinks would make it converge slowly. They follow from the expansion of G in powers of
1 / (s + corner), whose coefficients are sums of delays, and are taken out and put back exactly.
"""

from __future__ import annotations

import warnings
from fractions import Fraction
from heapq import heapify, heappop, heappush
from math import factorial
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from flint import fmpq_poly
from scipy.interpolate import CubicSpline

from armlock.affine import Affine
from armlock.checks import ComplexArray, FloatArray, finite_series, positive_number
from armlock.engine.chain import NOW, Delay, Lag
from armlock.engine.decide import count
from armlock.engine.functions import Function
from armlock.systems import Sum, System, fraction, polynomial
from armlock.systems import s as laplace

if TYPE_CHECKING:
    import control

# Powers of 1 / (s + corner) that are taken out.
_ORDERS = 3
# By how many powers of e what comes after the period is damped, to 3e-10. As half of them
# multiply rounding errors, there are no more.
_DAMPED = 22.0
# Frequencies of the transform, at first and at most.
_FIRST, _MOST = 2**13, 2**21
# Largest difference that doubling the frequencies may make, relative to the largest value.
_TOLERANCE = 1e-7
# Jumps and kinks that are followed.
_MOST_JUMPS = 20_000

#: A sum of exponentials exp(-s theta): delays and coefficients.
_Jumps = dict[Fraction, float]
#: A sum of polynomials of s, by the lengths of their delays.
_Terms = dict[Fraction, fmpq_poly]


def step_response(system: System, timepts: npt.ArrayLike) -> control.TimeResponseData:
    """Return the response to a unit step at t = 0.

    Parameters
    ----------
    system : System
        Stable or not, for instance ``loop.feedback()``: the response is that of the system
        itself. Its parameters are nominal.
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
        impulses, its neutral chain is not confined, or the times end too late for its
        fastest root.

    Warns
    -----
    UserWarning
        If the response contains impulses. They are no part of the outputs.

    Notes
    -----
    The error is at most 1e-6 of the largest value up to the last time, at jumps too. There
    the value is the one after the jump. This is checked, not proved, by a transform with twice
    as many frequencies. An oscillation that is faster than all of them is not seen.

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
    if np.ndim(timepts) == 0:
        timepts = np.linspace(0.0, positive_number("timepts", timepts), 1001)
    time = finite_series("timepts", timepts)
    if time.size == 0 or time[0] < 0.0 or (np.diff(time) <= 0.0).any() or time[-1] == 0.0:
        raise ValueError(f"timepts must ascend from 0 s on, got {time}")
    inputs = np.full(time.size, float(what == "Step"))
    # Each term is delayed by this at least. Only what comes after is left to the inversion, in
    # which it would be small beside a growing response.
    n, m = system.numerator.by_length(), system.denominator.by_length()
    dead = min(n, default=Fraction(0))
    ahead = {theta - dead: p for theta, p in n.items()}
    begin = int(np.searchsorted(time, float(dead) * (1.0 - 1e-12)))
    outputs = np.zeros(time.size)
    if begin < time.size:
        outputs[begin:] = _inverted(system, ahead, m, time[begin:], dead)
    return control.TimeResponseData(
        time, outputs, inputs=inputs, issiso=True, title=f"{what} response",
        input_labels=["u[0]"], output_labels=["y[0]"], plot_inputs=False,
    )  # fmt: skip


def _inverted(
    system: System, n: _Terms, m: _Terms, time: FloatArray, dead: Fraction
) -> FloatArray:
    """Invert N(s) / M(s) at some times after a dead time."""
    below = Affine(System(system.denominator, Sum({}))).n[0]
    ahead = System(_sum(n), _sum(m))
    time = np.maximum(time - float(dead), 0.0)
    last, degree = float(time[-1]) or float(dead), _degree(n, m)
    corner = float(below.space.corners[-1])
    above, under = (_powers(part, degree, corner) for part in (n, m))
    impulses, *jumps = _expansion(above, under, last * (1.0 + 1e-9))
    if impulses:
        at = ", ".join(f"{float(theta + dead):g}" for theta in sorted(impulses)[:5])
        warnings.warn(f"impulses at t = {at} s are not in the outputs", stacklevel=4)
    known = np.sum(
        [_after(time, part, k, corner, last) for k, part in enumerate(jumps)], axis=0
    )
    period = 2.0 * last
    sigma = _right_of_poles(below, last) + _DAMPED / period
    # Where nothing is left without the impulses, rounding is.
    least = float(np.abs(ahead(sigma))) / last
    before, points = None, _FIRST
    while points <= _MOST:
        s = np.asarray(sigma + 2j * np.pi / period * np.arange(points))
        found: FloatArray = known + _smooth(ahead, above, under, s, corner, period, time)
        size = max(float(np.abs(found).max()), least)
        if before is not None and np.abs(found - before).max() <= _TOLERANCE * size:
            return found
        before, points = found, 2 * points
    raise ValueError(
        f"timepts must end earlier for a system with a root at {corner:.3g} rad/s, got "
        f"{last + float(dead)} s"
    )


def _sum(part: _Terms) -> Sum:
    """Return a sum whose delays are objects of their own."""
    lags = {theta: Lag([(Delay(theta, ""), 1)]) if theta else NOW for theta in part}
    return Sum({(lags[theta], ()): p for theta, p in part.items()})


def _degree(n: _Terms, m: _Terms) -> int:
    """Highest power of s in the denominator, which nothing delayed may exceed."""
    whole = m.get(Fraction(0), fmpq_poly([0])).degree()
    top = max(p.degree() for p in (*n.values(), *m.values()))
    if whole < top:
        raise ValueError(
            "system must have no more zeros than poles, and the highest power of s in its "
            f"denominator must have no delay, got s^{top} over s^{max(whole, 0)}"
        )
    return whole


def _powers(part: _Terms, degree: int, corner: float) -> list[_Jumps]:
    """Coefficients of the highest powers of s + corner, from `degree` on: sums of delays."""
    moved = polynomial([-Fraction(corner), 1])
    of = [(theta, p(moved)) for theta, p in part.items()]
    return [
        {theta: float(fraction(p[i])) for theta, p in of if i >= 0 and p[i]}
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
    zero = Fraction(0)
    while queue:
        theta = heappop(queue)
        value = left.pop(theta, 0.0) / by[zero]
        if theta > last or abs(value) <= smallest:
            continue
        found[theta] = value
        if len(found) > _MOST_JUMPS:
            raise ValueError(
                f"timepts must end earlier: there are more than {_MOST_JUMPS} jumps until "
                f"{float(theta):.3g} s of {last:.3g} s"
            )
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
            raise ValueError(f"timepts must end earlier: the response overflows at {last} s")
    while high - low > 2.0 / last:
        middle = 0.5 * (low + high)
        stable = count(below, right_of=middle) == 0
        low, high = (low, middle) if stable else (middle, high)
    return high


def _smooth(
    system: System,
    n: list[_Jumps],
    m: list[_Jumps],
    s: ComplexArray,
    corner: float,
    period: float,
    time: FloatArray,
) -> FloatArray:
    """Invert what remains without jumps and kinks, from values at s."""
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
    left = system(s) - sum(part / (s + corner) ** k for k, part in enumerate(g))
    size = 2 * s.size
    wave = np.fft.irfft(left, size)[: s.size + 1] * (size / period)
    even = np.arange(s.size + 1) * (period / size)
    return np.asarray(CubicSpline(even, wave)(time) * np.exp(s[0].real * time))
