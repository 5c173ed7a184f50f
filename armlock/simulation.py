"""The loop in the time domain, sample by sample, its delays exact and its loop closed exactly.

With phi the frequency noise of the locked laser, every loop of `armlock.loops` reads

    phi(t) = noise(t) - K [m1 u1 + m2 u2](t - delay),
    u_k(t) = phi(t) - c_k(t) phi(t - tau_k).

Sensor and controller are sampled by the trapezoidal rule, see `armlock.discretize`. Without a
dead time the present phi is on both sides, with a weight of thousands; each sample solves for
it. A rule that took the previous phi instead would be unstable by itself as soon as gain
times step exceeds about one, and is not offered.

Because s = j omega becomes (2 j / T) tan(omega T / 2) while the delays stay what they are,
what is simulated has an open loop in closed form, `sampled_open_loop`.
"""

from __future__ import annotations

import math
import os
import secrets
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from armlock.checks import (
    ComplexArray,
    FloatArray,
    check_memory,
    finite_series,
    positive_number,
    real_number,
    whole_number,
)
from armlock.compiled import njit
from armlock.discretize import (
    SampledFilter,
    SampledSensor,
    checked_frequency,
    sampled_loop,
    warped,
)
from armlock.loops import Loop

#: Order of the Lagrange interpolation for delays that are not whole samples.
INTERPOLATION_ORDER = 7
#: Samples that are computed at a time, of all runs; results do not depend on it.
BLOCK = 1 << 16
#: Runs of an ensemble that go side by side. Fewer than half as many go one by one.
LANES = 32
#: The output counts as diverged when it exceeds the largest input so far by this factor.
LIMIT = 1e6

#: A delay in samples, phi(t - tau) = sum_k weights[k] phi[n - first - k]: (first, weights).
Delay = tuple[int, tuple[float, ...]]

# Delays closer to whole samples than this, in samples, are whole.
_WHOLE = 1e-6


class DivergenceError(ArithmeticError):
    """The locked laser's noise has left all bounds.

    Attributes
    ----------
    time : float
        When it began, in s: the last time at which the output was no larger than the largest
        input so far.
    detected : float
        When the output exceeded that input by the limit, in s.
    output : float array
        What was computed up to then, the sample that exceeds the limit left out; every sample
        of it is finite. Empty where a run that has stopped is asked to go on.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import DivergenceError, SingleArm, simulate
    >>> try:
    ...     locked = simulate(SingleArm(), np.ones(20_000), c1=3.0, limit=10.0)
    ... except DivergenceError as error:
    ...     print(error.time < error.detected, bool(np.isfinite(error.output).all()))
    True True
    """

    def __init__(self, time: float, detected: float, output: FloatArray) -> None:
        super().__init__(
            f"the loop diverges: its output has exceeded all input since t = {time:.6g} s, "
            f"and exceeds it beyond the limit at t = {detected:.6g} s"
        )
        self.time = time
        self.detected = detected
        self.output = output

    def __reduce__(self) -> tuple[type[DivergenceError], tuple[float, float, FloatArray]]:
        """Return what makes the same error again, in another process too."""
        return type(self), (self.time, self.detected, self.output)


def lagrange_delay(name: str, tau: float, sample_rate: float, order: int) -> Delay:
    r"""Return the weights of a delay, a single one where it is whole samples.

    Otherwise they are those of Lagrange's polynomial of order m,

    .. math::

        \ell_i = \prod_{j \ne i} \frac{x - j}{i - j} , \qquad i, j = 0, \ldots, m ,

    with x the delay in samples, less `first`.

    Parameters
    ----------
    name : str
        What messages call it.
    tau : float
        Delay in s, zero included.
    sample_rate : float
        In Hz.
    order : int
        Odd order of the polynomial through the nearest samples.

    Returns
    -------
    first : int
        The smallest delay in samples that has a weight.
    weights : tuple of float
        Of this delay, and of those that follow sample by sample.

    Raises
    ------
    ValueError
        If the delay is too short for the sample rate.

    Notes
    -----
    With an odd order and the delay between the two middle samples, no frequency is amplified,
    so that interpolation adds no instability of its own.
    """
    samples = tau * sample_rate
    whole = round(samples)
    half = (order + 1) // 2
    first = math.floor(samples) - half + 1
    if tau == 0.0 or (whole > 0 and abs(samples - whole) <= _WHOLE):
        return whole, (1.0,)
    if first < 1:
        raise ValueError(
            f"sample_rate must be at least {half / tau} Hz to interpolate {name} = {tau} s to "
            f"order {order}, or a multiple of {1.0 / tau} Hz, got {sample_rate}"
        )
    x = samples - first
    nodes = range(order + 1)
    weights = [math.prod((x - j) / (k - j) for j in nodes if j != k) for k in nodes]
    return first, tuple(weights)


@njit(cache=True)
def _late(signal: FloatArray, at: int, lanes: int, delay: Delay) -> float:
    """Return a signal as it was a delay before the sample at this place."""
    first, weights = delay
    value = 0.0
    for k in range(len(weights)):
        value += weights[k] * signal[np.uintp(at - (first + k) * lanes)]
    return value


@njit(cache=True, nogil=True)
def _advance(
    lanes: tuple[int, ...],
    phi: FloatArray,
    sent: FloatArray,
    start: int,
    noise: FloatArray,
    c1: FloatArray,
    c2: FloatArray,
    strides: tuple[int, int, int],
    count: int,
    delays: tuple[Delay, Delay, Delay],
    sensor: SampledSensor,
    controller: SampledFilter,
    work: FloatArray,
    limit: float,
    done: int,
) -> int:
    """Compute `count` samples of phi, and of what the controller sends, behind `start` others.

    Runs go side by side in lanes, so that one instruction works on several of them; the length
    of `lanes` is their number, for the compiler to know. phi and sent hold all lanes of one
    sample, then those of the next; in noise, c1 and c2 the next sample is `strides` further on.

    `delays` are those of both arms and the dead time. `work` holds, each for all lanes: the
    states of sensor and controller; what they send with the next sample if no input comes; for
    one sample the light of both arms, the input, and the output; the largest input so far, and
    the number of the last output not above it. Returns the index of the sample at which an
    output exceeds `limit` times the largest input, or -1.
    """
    arm1, arm2, dead = delays
    rows, sections, gain = sensor.states, controller.sections, controller.gain
    m, n, size = len(rows), len(sections), len(lanes)
    # Unsigned, because a negative index would count from the end, which takes time to check.
    rest = np.uintp((m + 2 * n) * size)
    row = np.uintp(size)
    light1 = rest + row
    light2 = light1 + row
    free = light2 + row
    output = free + row
    most = output + row
    calm = most + row
    # What an input adds to the present output, and by way of the states to the next.
    direct1, direct2 = sensor.direct
    _, next1, next2 = rows[m - 1]
    for j in range(n):
        next1 += direct1 * sections[j][3]
        next2 += direct2 * sections[j][3]
    now1, now2, next1, next2 = gain * direct1, gain * direct2, gain * next1, gain * next2
    implicit = dead[0] == 0
    inverse = 1.0 / (1.0 + now1 + now2)
    for i in range(count):
        now = start + i
        at0, at1, at2 = i * strides[0], i * strides[1], i * strides[2]
        for w in range(size):
            late = _late(phi, now * size + w, size, arm1)
            work[light1 + np.uintp(w)] = c1[np.uintp(at1 + w)] * late
        for w in range(size):
            late = _late(phi, now * size + w, size, arm2)
            work[light2 + np.uintp(w)] = c2[np.uintp(at2 + w)] * late
        for w in range(size):
            work[free + np.uintp(w)] = noise[np.uintp(at0 + w)]
        if not implicit:
            for w in range(size):
                work[output + np.uintp(w)] = _late(sent, now * size + w, size, dead)
        place = np.uintp(now * size)
        if not implicit:
            for w in range(size):
                lane = np.uintp(w)
                x = work[free + lane] - work[output + lane]
                u1, u2 = x - work[light1 + lane], x - work[light2 + lane]
                sent[place + lane] = work[rest + lane] + (now1 * u1 + now2 * u2)
        for w in range(size):
            lane = np.uintp(w)
            a1, a2 = work[light1 + lane], work[light2 + lane]
            if implicit:
                # phi = noise - rest - now1 (phi - a1) - now2 (phi - a2), solved for phi.
                x = (work[free + lane] + (now1 * a1 + now2 * a2) - work[rest + lane]) * inverse
            else:
                x = work[free + lane] - work[output + lane]
            work[output + lane] = x
            u1, u2 = x - a1, x - a2
            # The states move on; what they send next does not wait for what u1 and u2 do.
            top, below, ready = work[np.uintp((m - 1) * size) + lane], 0.0, 0.0
            for j in range(m):
                q, b1, b2 = rows[j]
                state = np.uintp(j * size) + lane
                old = work[state]
                ready = old + (below - q * top)
                work[state] = ready + (b1 * u1 + b2 * u2)
                below = old
            v, direct = top, direct1 * u1 + direct2 * u2
            for j in range(n):
                r1, r2, k, t1, t2 = sections[j]
                state = np.uintp((m + 2 * j) * size) + lane
                w1, w2 = work[state], work[state + row]
                new1 = w1 + (r1 * w1 - k * w2 + v)
                new2 = w2 + (r2 * w2 + w1)
                ready += t1 * new1 + t2 * new2
                v += t1 * w1 + t2 * w2
                work[state], work[state + row] = new1 + direct, new2
            work[rest + lane] = gain * ready + (next1 * u1 + next2 * u2)
        for w in range(size):
            phi[place + np.uintp(w)] = work[output + np.uintp(w)]
        number, exceeded = float(done + i), 0
        for w in range(size):
            lane = np.uintp(w)
            amount, given = abs(work[output + lane]), abs(work[free + lane])
            largest = work[most + lane]
            largest = given if given > largest else largest
            work[most + lane] = largest
            work[calm + lane] = number if amount <= largest else work[calm + lane]
            exceeded += 0 if amount <= limit * largest else 1
        if exceeded:
            return i
    return -1


def _checked(
    loop: Loop, sample_rate: float, interpolation: int
) -> tuple[float, tuple[Delay, Delay, Delay]]:
    """Return sample rate and delays of a loop that can be simulated, or raise."""
    if not isinstance(loop, Loop):
        raise TypeError(f"loop must be an armlock.Loop, got {type(loop).__name__}")
    rate = positive_number("sample_rate", sample_rate)
    order = whole_number("interpolation", interpolation, 1)
    if order % 2 == 0:
        raise ValueError(f"interpolation must be an odd integer, got {order}")
    roots = (
        *loop.controller.zeros,
        *loop.controller.poles,
        *np.roots(loop.mapping.denominator[::-1]),
    )
    # Beyond twice the sample rate the trapezoidal rule moves them across infinity.
    fastest = max((root.real for root in roots if root.imag == 0.0), default=0.0)
    if rate <= fastest / 2.0:
        raise ValueError(
            f"sample_rate must exceed {fastest / 2.0} Hz, half of the loop's fastest real pole "
            f"or zero in the right half-plane, in rad/s, got {rate}"
        )
    tau1, tau2, dead = (
        lagrange_delay(name, getattr(loop, name), rate, order)
        for name in ("tau1", "tau2", "delay")
    )
    return rate, (tau1, tau2, dead)


def _series(name: str, value: npt.ArrayLike, like: FloatArray) -> FloatArray:
    """Return c1 or c2, a finite number or a series, with the shape of the noise."""
    if not isinstance(value, Sequence) and np.ndim(value) == 0:
        return np.broadcast_to(real_number(name, value), like.shape)
    array = finite_series(name, value, like.ndim)
    if array.shape != like.shape:
        raise ValueError(
            f"{name} must be a number or have the shape of noise, {like.shape}; got "
            f"{array.shape}"
        )
    return array


def sampled_open_loop(
    loop: Loop,
    omega: npt.ArrayLike,
    c1: float = 1.0,
    c2: float = 1.0,
    sample_rate: float = 200.0,
    *,
    interpolation: int = INTERPOLATION_ORDER,
) -> ComplexArray:
    r"""Open loop of what is simulated, in closed form.

    With the sampling step T, and the weights :math:`\ell_{k,i}` that interpolate delay k from
    the samples :math:`f_k + i` back, it is

    .. math::

        L_T(\omega) &= H_0(\omega)\, K(\mathrm{j}\Omega)
        \sum_{k=1}^{2} m_k(\mathrm{j}\Omega)
        \left( 1 - c_k H_k(\omega) \right) , \\
        \Omega &= \frac{2}{T} \tan \frac{\omega T}{2} , \\
        H_k(\omega) &= \sum_i \ell_{k,i}\, e^{-\mathrm{j}\omega (f_k + i) T} ,

    where k = 0 is the dead time. A delay of whole samples has

    .. math::

        H_k(\omega) = e^{-\mathrm{j}\omega\tau_k} .

    Parameters
    ----------
    loop : Loop
        The loop.
    omega : array_like of float
        In rad/s, positive and at most pi times the sample rate.
    c1, c2 : float, optional
        Constant perturbations.
    sample_rate : float, optional
        In Hz.
    interpolation : int, optional
        As for `Simulation`.

    Returns
    -------
    complex array, shaped like `omega`
        Controller and sensor at the warped frequency, delays at the true one.

    Raises
    ------
    TypeError, ValueError
        If a frequency is not finite and real, not positive, or above half the sample rate,
        or `Simulation` would refuse the sample rate for the loop's delays, poles and zeros.

    Examples
    --------
    Far below the sample rate it is the open loop itself.

    >>> import numpy as np
    >>> from armlock import paper_loop, sampled_open_loop
    >>> loop, omega = paper_loop(), np.array([0.01])
    >>> bool(np.allclose(sampled_open_loop(loop, omega), loop.open_loop(1j * omega), rtol=1e-5))
    True
    """
    rate, delays = _checked(loop, sample_rate, interpolation)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    omega = checked_frequency("omega", omega, math.pi * rate, "rad/s")
    if not omega.all():
        raise ValueError(
            "omega must be positive, got 0.0: controller or sensor has a pole there"
        )
    late1, late2, dead = (
        np.exp(-1j * omega[..., None] * (first + np.arange(len(weights))) / rate) @ weights
        for first, weights in delays
    )
    s = 1j * warped(omega, rate)
    m1, m2 = loop.mapping.weights(s)
    sensor = m1 * (1.0 - c1 * late1) + m2 * (1.0 - c2 * late2)
    return np.asarray(dead * loop.controller(s) * sensor)


class Simulation:
    r"""A loop that is run block by block, and remembers where it is.

    Parameters
    ----------
    loop : Loop
        Any loop of `armlock.loops`.
    sample_rate : float, optional
        In Hz.
    history : float or array_like, optional
        The locked laser's noise before the first sample, the latest value last: a constant,
        or at least `history_samples` values. Controller and sensor start at rest.
    interpolation : int, optional
        Odd order of the polynomial by which delays that are not whole samples are
        interpolated. Whole ones are exact.
    limit : float, optional
        The run counts as diverged when the output exceeds the largest input so far by this
        factor, one at least.
    draws : int, optional
        Runs an ensemble of so many, side by side: noise, c1 and c2 have a row for each.

    Attributes
    ----------
    samples : int
        How many samples were computed.
    history_samples : int
        How many samples the longest delay reaches back.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no loop, the sample rate is too low for its delays (the dead time
        included), its poles and zeros, or its feedback at high frequency, or the history is
        too short, not finite, or longer than memory holds.

    Notes
    -----
    With :math:`\varphi_0` the noise of the free-running laser, a sample is

    .. math::

        a_k[n] &= c_k[n] \sum_i \ell_{k,i}\, \varphi[n - f_k - i] , \\
        y[n] &= r[n] + g \sum_{k=1}^{2} d_k \left( \varphi[n] - a_k[n] \right) , \\
        \varphi[n] &= \varphi_0[n] - \sum_i \ell_{0,i}\, y[n - f_0 - i] .

    Here y is what the controller sends, of gain g behind the sensor's direct shares d_k, and r
    what their states make of earlier samples (`armlock.discretize`). The late light a_k and
    the dead time, k = 0, are interpolated as for `sampled_open_loop`. Without a dead time
    y[n] enters its own sample, and the loop is closed within it:

    .. math::

        \varphi[n] = \frac{\varphi_0[n] - r[n] + g \left( d_1 a_1[n] + d_2 a_2[n] \right)}
        {1 + g \left( d_1 + d_2 \right)} .

    One call and many give the same samples, bit by bit, and so do an ensemble and its runs one
    by one. An ensemble takes `LANES` runs at a time, whose samples the processor's vector units
    compute together. Of arrays in Fortran order, where the same sample of all runs stands side
    by side, nothing has to be copied.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import CommonArm, Simulation
    >>> run = Simulation(CommonArm(gain=1.0), sample_rate=20.0)
    >>> first, second = run.advance(np.ones(400)), run.advance(np.ones(400))
    >>> run.time
    40.0
    """

    def __init__(
        self,
        loop: Loop,
        sample_rate: float = 200.0,
        *,
        history: npt.ArrayLike = 0.0,
        interpolation: int = INTERPOLATION_ORDER,
        limit: float = LIMIT,
        draws: int | None = None,
    ) -> None:
        self.sample_rate, self._delays = _checked(loop, sample_rate, interpolation)
        self.loop, self.interpolation = loop, interpolation
        self.limit = positive_number("limit", limit)
        if self.limit < 1.0:
            raise ValueError(f"limit must be at least 1, got {self.limit}")
        self._sensor, self._controller = sampled_loop(
            loop.controller, loop.mapping, self.sample_rate
        )
        self._check_closure()
        self.history_samples = max(first + len(weights) - 1 for first, weights in self._delays)
        self.draws = None if draws is None else whole_number("draws", draws, 1)
        runs = self.draws or 1
        check_memory("history", (self.history_samples, runs), 16)
        before = self._checked_history(history)
        self._runs: list[_Lanes] = []
        for first in range(0, runs, LANES):
            # The last ones may be few, and are then faster one by one.
            left = min(runs - first, LANES)
            lanes, step = (1, 1) if 2 * left < LANES else (LANES, left)
            for at in range(first, first + left, step):
                self._runs.append(_Lanes(slice(at, at + step), lanes, self, before))
        self._stopped: tuple[float, float] | None = None
        self.samples = 0

    def __repr__(self) -> str:
        """Name the arguments, and how far the run has come."""
        return (
            f"Simulation({self.loop!r}, sample_rate={self.sample_rate}, "
            f"interpolation={self.interpolation}, limit={self.limit}; {self.samples} samples)"
        )

    @property
    def time(self) -> float:
        """How far the run has come, in s."""
        return self.samples / self.sample_rate

    def _check_closure(self) -> None:
        """Refuse a loop whose feedback changes sign between the sample rate and infinity."""
        if self.loop.delay > 0.0:
            return
        controller, mapping = self.loop.controller, self.loop.mapping
        excess = len(controller.poles) + len(mapping.denominator) - len(controller.zeros)
        highest = [n[-1] for n in (mapping.numerator1, mapping.numerator2) if len(n) == excess]
        at_infinity = 1.0 + controller.gain * sum(highest) / mapping.denominator[-1]
        if (1.0 + self._controller.gain * sum(self._sensor.direct)) * at_infinity <= 0.0:
            raise ValueError(
                f"sample_rate must be higher for this loop, got {self.sample_rate}: 1 + L "
                f"without delays changes sign beyond it, a root that samples cannot show"
            )

    def _checked_history(self, history: npt.ArrayLike) -> float | FloatArray:
        if not isinstance(history, Sequence) and np.ndim(history) == 0:
            return real_number("history", history)
        array = finite_series("history", history)
        if array.size < self.history_samples:
            raise ValueError(
                f"history must hold at least {self.history_samples} samples, as far as the "
                f"longest delay reaches, got {array.size}"
            )
        return array[array.size - self.history_samples :]

    def advance(
        self, noise: npt.ArrayLike, c1: npt.ArrayLike = 1.0, c2: npt.ArrayLike = 1.0
    ) -> FloatArray:
        """Compute the next block.

        Parameters
        ----------
        noise : array_like, shape (n,), or (draws, n) for an ensemble
            Free-running noise of the laser; the output has its unit.
        c1, c2 : float or array_like of the same shape, optional
            Multiplicative perturbations.

        Returns
        -------
        float array, of the same shape
            Noise of the locked laser.

        Raises
        ------
        TypeError, ValueError
            If an argument is not finite and real, or of another shape; nothing is computed.
        DivergenceError
            If the output leaves all bounds. The run cannot be continued.
        """
        given = finite_series("noise", noise, 1 if self.draws is None else 2)
        if self.draws not in (None, len(given)):
            raise ValueError(f"noise must have {self.draws} rows, got shape {given.shape}")
        return self._advance(given, c1, c2)

    def _advance(self, given: FloatArray, c1: npt.ArrayLike, c2: npt.ArrayLike) -> FloatArray:
        """Compute the next block, of noise that is checked."""
        inputs = given, _series("c1", c1, given), _series("c2", c2, given)
        if self._stopped is not None:
            raise DivergenceError(*self._stopped, np.empty((*given.shape[:-1], 0)))
        rows = [np.atleast_2d(series) for series in inputs]
        output = np.empty_like(rows[0])
        stops = [
            run.advance(self, *(r[run.rows] for r in (*rows, output))) for run in self._runs
        ]
        stop, calm = min(stops)
        shaped = output.reshape(given.shape)
        if stop < given.shape[-1]:
            self.samples += stop
            self._stopped = calm / self.sample_rate, self.time
            # A copy, so that the error does not hold all the memory of the run.
            raise DivergenceError(*self._stopped, shaped[..., :stop].copy())
        self.samples += given.shape[-1]
        return shaped


class _Lanes:
    """Some runs of a simulation, side by side, and where they are."""

    def __init__(
        self, rows: slice, lanes: int, run: Simulation, history: float | FloatArray
    ) -> None:
        self.rows, self.lanes = rows, lanes
        self.past = run.history_samples
        # Some times as long as the past, which each block moves.
        self.block = max(BLOCK // lanes, 4 * self.past)
        # The output, and what the controller sends: each with its past in front.
        self.phi = np.zeros((self.past + self.block, lanes))
        self.sent = np.zeros_like(self.phi)
        self.phi[: self.past] = np.reshape(history, (-1, 1))
        numbers = len(run._sensor.states) + 2 * len(run._controller.sections)
        # See `_advance`: behind the states, five rows, the largest input, the last calm sample.
        self.work = np.zeros((numbers + 7, lanes))
        self.work[-2] = np.abs(self.phi[: self.past]).max()

    def advance(
        self,
        run: Simulation,
        noise: FloatArray,
        c1: FloatArray,
        c2: FloatArray,
        output: FloatArray,
    ) -> tuple[int, float]:
        """Fill a part of the output; return where it stops, and the last calm sample before."""
        done = run.samples
        for at in range(0, noise.shape[1], self.block):
            count = min(self.block, noise.shape[1] - at)
            parts = (series[:, at : at + count] for series in (noise, c1, c2))
            block, strides = zip(*map(self._interleaved, parts), strict=True)
            stop = _advance(
                (0,) * self.lanes,
                self.phi.ravel(),
                self.sent.ravel(),
                self.past,
                *block,
                strides,
                count,
                run._delays,
                run._sensor,
                run._controller,
                self.work.ravel(),
                run.limit,
                done + at,
            )
            count = count if stop < 0 else stop
            new = self.phi[self.past : self.past + count, : len(output)]
            output[:, at : at + count] = new.T
            if stop >= 0:
                size = np.abs(self.phi[self.past + stop])
                left = np.argmin(size <= run.limit * self.work[-2])
                return at + stop, float(self.work[-1, left])
            # Without a dead time nothing is read of what was sent before.
            for signal in (self.phi, self.sent)[: 2 if run.loop.delay else 1]:
                signal[: self.past] = signal[count : count + self.past]
        return noise.shape[1], math.inf

    def _interleaved(self, series: FloatArray) -> tuple[FloatArray, int]:
        """Return an array with the lanes of a sample side by side, and the way to the next one.

        Nothing is copied of an array in Fortran order, and of a single run. A lane without a
        run of its own repeats the last one.
        """
        step, way = (stride // series.itemsize for stride in series.strides)
        beside = len(series) == self.lanes and (step == 1 or self.lanes == 1)
        if beside and way > 0 and series.flags.writeable:
            length = (series.shape[1] - 1) * way + self.lanes
            flat = np.lib.stride_tricks.as_strided(series, (length,), (series.itemsize,))
            return flat, way
        if way == 0:
            series = series[:, :1]
        rows = np.minimum(np.arange(self.lanes), len(series) - 1)
        return np.ascontiguousarray(series[rows].T).ravel(), self.lanes if way else 0


def simulate(
    loop: Loop,
    noise: npt.ArrayLike,
    c1: npt.ArrayLike = 1.0,
    c2: npt.ArrayLike = 1.0,
    sample_rate: float = 200.0,
    *,
    history: npt.ArrayLike = 0.0,
    interpolation: int = INTERPOLATION_ORDER,
    limit: float = LIMIT,
) -> FloatArray:
    r"""Run a loop, and return the frequency noise of the locked laser.

    From the noise :math:`\varphi_0` of the free-running laser it computes the solution of

    .. math::

        \varphi(t) &= \varphi_0(t) - K \left[ m_1 u_1 + m_2 u_2 \right](t) , \\
        u_k(t) &= \varphi(t) - c_k(t)\, \varphi(t - \tau_k) ,

    sampled as `Simulation` describes it.

    Parameters
    ----------
    loop : Loop
        For instance `paper_loop()`.
    noise : array_like, shape (n,), or (draws, n) for an ensemble
        Frequency noise of the free-running laser, for instance in Hz.
    c1, c2 : float or array_like of the same shape, optional
        Multiplicative perturbations of the two arms, constant or sample by sample.
    sample_rate : float, optional
        In Hz.
    history : float or array_like, optional
        Output before the first sample, zero by default; see `Simulation`.
    interpolation : int, optional
        Order of interpolation for delays that are not whole samples; see `Simulation`.
    limit : float, optional
        Size of the output, in units of the largest input, that counts as diverged.

    Returns
    -------
    float array, of the same shape
        In the unit of `noise`. Each row of an ensemble equals a run of its own, bit by bit.

    Raises
    ------
    TypeError, ValueError
        If an argument is unsuitable; before anything is computed.
    DivergenceError
        If the output leaves all bounds, in an ensemble that of the first run to do so. It
        carries the time at which that began and the part computed so far. An unstable loop
        that has not grown so far by the end of the run returns its output.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import paper_loop, simulate
    >>> step = simulate(paper_loop(), np.ones(2000))
    >>> print(f"{step[0]:.4e}")
    9.9991e-05
    """
    given = finite_series("noise", noise, 1, 2)
    run = Simulation(
        loop,
        sample_rate,
        history=history,
        interpolation=interpolation,
        limit=limit,
        draws=len(given) if given.ndim == 2 else None,
    )
    return run._advance(given, c1, c2)


def simulate_blocks(
    loop: Loop,
    blocks: Iterable[npt.ArrayLike | Sequence[npt.ArrayLike]],
    sample_rate: float = 200.0,
    *,
    history: npt.ArrayLike = 0.0,
    interpolation: int = INTERPOLATION_ORDER,
    limit: float = LIMIT,
) -> Iterator[FloatArray]:
    """Run a loop over a stream of blocks; memory does not grow with the duration.

    Parameters
    ----------
    loop : Loop
        The loop.
    blocks : iterable
        Of arrays of noise, or of tuples (noise, c1, c2). Their lengths may differ, zero
        included.
    sample_rate : float, optional
        In Hz.
    history, interpolation, limit
        As for `simulate`.

    Yields
    ------
    float array, shaped like the block's noise
        The same samples as `simulate` gives for the whole.

    Raises
    ------
    TypeError, ValueError, DivergenceError
        As `simulate` does.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import paper_loop, simulate_blocks
    >>> blocks = (np.ones(500) for _ in range(4))
    >>> sum(locked.size for locked in simulate_blocks(paper_loop(), blocks))
    2000
    """
    run = Simulation(
        loop, sample_rate, history=history, interpolation=interpolation, limit=limit
    )
    if not isinstance(blocks, Iterable):
        raise TypeError(f"blocks must be an iterable of arrays, got {blocks!r}")
    parts = (block if isinstance(block, tuple) else (block,) for block in blocks)
    return (run.advance(*part) for part in parts)


def save_series(path: str | os.PathLike[str], blocks: Iterable[FloatArray]) -> int:
    """Write a stream of blocks as one NumPy file that exists only when it is complete.

    Parameters
    ----------
    path : path_like
        Name of the file, for instance one that ends in .npy.
    blocks : iterable of float arrays
        Each one-dimensional and finite, for instance from `simulate_blocks`.

    Returns
    -------
    int
        Number of samples written.

    Raises
    ------
    TypeError, ValueError
        If a block is not a one-dimensional series of finite real numbers.
    OSError
        If the file cannot be written.

    Notes
    -----
    The blocks go to a file of another name in the same folder, which takes this one when the
    last block is in. If anything stops the run, that file is removed, and what was at `path`
    before stays. A process that is killed leaves the file, whose name ends in .part.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from armlock import paper_loop, save_series, simulate_blocks
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "locked.npy"
    ...     blocks = simulate_blocks(paper_loop(), [np.ones(50), np.ones(50)])
    ...     written = save_series(path, blocks)
    ...     print(written, np.load(path).shape)
    100 (100,)
    """
    path = Path(path)
    if not isinstance(blocks, Iterable):
        raise TypeError(f"blocks must be an iterable of arrays, got {blocks!r}")
    temporary = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
    count = 0
    try:
        with temporary.open("xb") as file:
            # The header has room for any length: it is written again below.
            _write_header(file, 0)
            for number, block in enumerate(blocks):
                values = finite_series(f"blocks[{number}]", block)
                file.write(np.ascontiguousarray(values, dtype="<f8").tobytes())
                count += values.size
            file.seek(0)
            _write_header(file, count)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return count


def _write_header(file: BinaryIO, count: int) -> None:
    description = {"descr": "<f8", "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(file, description)
