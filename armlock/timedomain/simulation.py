"""The loop in the time domain, sample by sample, closed exactly in each.

With phi the frequency noise of the locked laser, every loop of `armlock.loops` reads

    phi(t) = noise(t) - K [m1 u1 + m2 u2](t - delay),
    u_k(t) = phi(t) - c_k(t) phi(t - tau_k).

Sensor and controller are sampled by the trapezoidal rule, see `armlock.timedomain.discretize`.
Without a dead time the present phi is on both sides, with a weight of thousands; each sample
solves for it. A rule that took the previous phi instead would be unstable by itself as soon as
gain times step exceeds about one, and is not offered. A delay that is no whole number of
samples is interpolated, with the weights of `lagrange_delay`.

Because s = j omega becomes (2 j / T) tan(omega T / 2) while the delays stay what they are,
what is simulated has an open loop in closed form, `sampled_open_loop`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from armlock.axis.compiled import njit
from armlock.checks import (
    ComplexArray,
    FloatArray,
    finite_series,
    positive_array,
    positive_number,
    real_number,
    whole_number,
)
from armlock.loops import Loop, checked_loop
from armlock.timedomain.discretize import SampledFilter, SampledSensor, sampled_loop, warped

#: Order of the Lagrange interpolation for delays that are not whole samples: odd.
INTERPOLATION_ORDER = 7
#: Samples that are computed at a time, of all runs; results do not depend on it.
BLOCK = 1 << 16
#: Runs of an ensemble that go side by side. Fewer than half as many go one by one.
LANES = 32
#: The output counts as diverged when it exceeds the largest input so far by this factor.
LIMIT = 1e6

#: A delay in samples, phi(t - tau) = sum_k weights[k] phi[n - first - k]: (first, weights).
Delay = tuple[int, tuple[float, ...]]
#: A loop in samples: delays of both arms and the dead time, sensor, controller.
SampledLoop = tuple[tuple[Delay, ...], SampledSensor, SampledFilter]

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


def lagrange_delay(name: str, tau: float, sample_rate: float) -> Delay:
    r"""Return the weights of a delay, a single one where it is whole samples.

    Otherwise they are those of Lagrange's polynomial of order m, `INTERPOLATION_ORDER`,

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
    half = (INTERPOLATION_ORDER + 1) // 2
    first = math.floor(samples) - half + 1
    if tau == 0.0 or (whole > 0 and abs(samples - whole) <= _WHOLE):
        return whole, (1.0,)
    if first < 1:
        raise ValueError(
            f"sample_rate must be at least {half / tau} Hz to interpolate {name} = {tau} s, "
            f"or a multiple of {1.0 / tau} Hz, got {sample_rate}"
        )
    x = samples - first
    nodes = range(INTERPOLATION_ORDER + 1)
    weights = [math.prod((x - j) / (k - j) for j in nodes if j != k) for k in nodes]
    return first, tuple(weights)


def _sampled_delays(loop: Loop, sample_rate: float) -> tuple[Delay, ...]:
    """Return the delays of both arms and the dead time, or say why they have no samples."""
    return tuple(
        lagrange_delay(name, getattr(loop, name), sample_rate)
        for name in ("tau1", "tau2", "delay")
    )


@njit(cache=True)
def _late(signal: FloatArray, row: int, column: int, delay: Delay) -> float:
    """Return a column of a signal as it was a delay before a row."""
    first, weights = delay
    value = 0.0
    for k in range(len(weights)):
        value += weights[k] * signal[np.uintp(row - first - k), column]
    return value


@njit(cache=True, nogil=True)
def _compute(
    lanes: tuple[int, ...],
    first: int,
    phi: FloatArray,
    sent: FloatArray,
    inputs: tuple[FloatArray, ...],
    sampled: SampledLoop,
    work: FloatArray,
    limit: float,
    done: int,
) -> int:
    """Compute the last rows of phi, and of what the controller sends, from those before.

    These and `inputs`, which are noise, c1 and c2, hold a sample in each row and a run in each
    column; of c1 and c2 a single row is for all samples. The runs from column `first` on go
    side by side in lanes, so that one instruction works on several of them; the length of
    `lanes` is their number, for the compiler to know.

    `work` holds, each for all lanes: the states of sensor and controller; what they send with
    the next sample if no input comes; for one sample the light of both arms, the input, and
    the output; the largest input so far, and the number of the last output not above it.
    Returns the index of the sample at which an output exceeds `limit` times the largest input,
    or how many there are.
    """
    noise, c1, c2 = inputs
    (arm1, arm2, dead), sensor, controller = sampled
    rows, sections, gain = sensor.states, controller.sections, controller.gain
    m, n, size = len(rows), len(sections), len(lanes)
    # Unsigned, because a negative index would count from the end, which takes time to check.
    # One array, because the compiler would have to check that several do not overlap.
    row = np.uintp(size)
    coming = np.uintp((m + 2 * n) * size)
    light1 = coming + row
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
    varies1, varies2 = len(c1) > 1, len(c2) > 1
    for i in range(len(noise)):
        now = len(phi) - len(noise) + i
        at, at1, at2 = np.uintp(i), np.uintp(i * varies1), np.uintp(i * varies2)
        for w in range(size):
            column = np.uintp(first + w)
            work[light1 + np.uintp(w)] = c1[at1, column] * _late(phi, now, column, arm1)
        for w in range(size):
            column = np.uintp(first + w)
            work[light2 + np.uintp(w)] = c2[at2, column] * _late(phi, now, column, arm2)
        for w in range(size):
            work[free + np.uintp(w)] = noise[at, np.uintp(first + w)]
        for w in range(size):
            lane, column = np.uintp(w), np.uintp(first + w)
            a1, a2, x = work[light1 + lane], work[light2 + lane], work[free + lane]
            if implicit:
                # phi = noise - coming - now1 (phi - a1) - now2 (phi - a2), solved for phi.
                x = (x + (now1 * a1 + now2 * a2) - work[coming + lane]) * inverse
            else:
                x -= _late(sent, now, column, dead)
                sending = now1 * (x - a1) + now2 * (x - a2)
                sent[np.uintp(now), column] = work[coming + lane] + sending
            work[output + lane] = x
        for w in range(size):
            lane = np.uintp(w)
            x = work[output + lane]
            u1, u2 = x - work[light1 + lane], x - work[light2 + lane]
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
            work[coming + lane] = gain * ready + (next1 * u1 + next2 * u2)
        number, exceeded = float(done + i), 0
        for w in range(size):
            lane = np.uintp(w)
            amount, given = abs(work[output + lane]), abs(work[free + lane])
            largest = work[most + lane]
            largest = given if given > largest else largest
            work[most + lane] = largest
            work[calm + lane] = number if amount <= largest else work[calm + lane]
            exceeded += 0 if amount <= limit * largest else 1
        for w in range(size):
            phi[np.uintp(now), np.uintp(first + w)] = work[output + np.uintp(w)]
        if exceeded:
            return i
    return len(noise)


def _series(name: str, value: npt.ArrayLike, like: FloatArray) -> FloatArray:
    """Return c1 or c2, a number or shaped like the noise, with a sample in each row."""
    array = finite_series(name, value, 0, like.ndim)
    if array.shape not in ((), like.shape):
        raise ValueError(
            f"{name} must be a number or have the shape of noise, {like.shape}; got "
            f"{array.shape}"
        )
    return np.atleast_2d(array).T


def _in_columns(series: FloatArray, number: int) -> FloatArray:
    """Return samples in rows, as compiled code takes them, the last run repeated at the end."""
    if series.shape[1] < number:
        series = series[:, np.minimum(np.arange(number), series.shape[1] - 1)]
    return np.require(series, requirements=["C", "W"])


def sampled_open_loop(
    loop: Loop,
    omega: npt.ArrayLike,
    c1: float = 1.0,
    c2: float = 1.0,
    sample_rate: float = 200.0,
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
        In rad/s, positive.
    c1, c2 : float, optional
        Constant perturbations.
    sample_rate : float, optional
        In Hz.

    Returns
    -------
    complex array, shaped like `omega`
        Controller and sensor at the warped frequency, delays at the true one.

    Raises
    ------
    TypeError, ValueError
        If a frequency is not finite, real and positive, or the sample rate is too low for a
        delay, as for `Simulation`.

    Examples
    --------
    Far below the sample rate it is the open loop itself.

    >>> import numpy as np
    >>> from armlock import paper_loop, sampled_open_loop
    >>> loop, omega = paper_loop(), np.array([0.01])
    >>> bool(np.allclose(sampled_open_loop(loop, omega), loop.open_loop(1j * omega), rtol=1e-5))
    True
    """
    rate = positive_number("sample_rate", sample_rate)
    delays = _sampled_delays(checked_loop(loop), rate)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    omega = positive_array("omega", omega)
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
    limit : float, optional
        The run counts as diverged when the output exceeds the largest input so far by this
        factor.
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
        included), or the history is too short or not finite.

    Notes
    -----
    With :math:`\varphi_0` the noise of the free-running laser, a sample is

    .. math::

        a_k[n] &= c_k[n] \sum_i \ell_{k,i}\, \varphi[n - f_k - i] , \\
        y[n] &= r[n] + g \sum_{k=1}^{2} d_k \left( \varphi[n] - a_k[n] \right) , \\
        \varphi[n] &= \varphi_0[n] - \sum_i \ell_{0,i}\, y[n - f_0 - i] .

    Here y is what the controller sends, of gain g behind the sensor's direct shares d_k, and r
    what their states make of earlier samples (`armlock.timedomain.discretize`). The late light
    a_k and the dead time, k = 0, are interpolated as for `sampled_open_loop`. Without a dead
    time y[n] enters its own sample, and the loop is closed within it:

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
    >>> run.samples
    800
    """

    def __init__(
        self,
        loop: Loop,
        sample_rate: float = 200.0,
        *,
        history: npt.ArrayLike = 0.0,
        limit: float = LIMIT,
        draws: int | None = None,
    ) -> None:
        self.loop = checked_loop(loop)
        self.sample_rate = positive_number("sample_rate", sample_rate)
        self.limit = positive_number("limit", limit)
        self.draws = None if draws is None else whole_number("draws", draws, 1)
        delays = _sampled_delays(loop, self.sample_rate)
        sensor, controller = sampled_loop(loop.controller, loop.mapping, self.sample_rate)
        self._sampled: SampledLoop = delays, sensor, controller
        self.history_samples = max(first + len(weights) - 1 for first, weights in delays)
        before = finite_series("history", history, 0, 1)
        if before.ndim and before.size < self.history_samples:
            raise ValueError(
                f"history must hold at least {self.history_samples} samples, as far as the "
                f"longest delay reaches, got {before.size}"
            )
        full, left = divmod(self.draws or 1, LANES)
        # The last runs may be few, and are then faster one by one.
        groups = [LANES] * full + ([1] * left if 2 * left < LANES else [LANES])
        # See `_compute`: behind the states, five rows, the largest input, the last calm sample.
        rows = len(sensor.states) + 2 * len(controller.sections) + 7
        self._groups = [np.zeros((rows, lanes)) for lanes in groups]
        # Of the output and of what the controller has sent a block, behind as many samples as
        # delays reach back.
        past = self.history_samples
        self._block = max(BLOCK // sum(groups), 4 * past)
        self._signals = np.zeros((2, past + self._block, sum(groups)))
        self._signals[0, :past] = before[-past:, None] if before.ndim else before
        for work in self._groups:
            work[-2] = np.abs(self._signals[0, :past]).max()
        self._stopped: tuple[float, float] | None = None
        self.samples = 0

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
        """Compute the next block of noise that is already checked."""
        inputs = [np.atleast_2d(given).T, _series("c1", c1, given), _series("c2", c2, given)]
        output, begin = np.empty(inputs[0].shape), self.samples
        shaped = output.T.reshape(given.shape)
        for at in range(0, len(output), self._block):
            part = slice(at, at + self._block)
            if self._stopped is None:
                self._fill(output[part], *(s[part] if len(s) > 1 else s for s in inputs))
            if self._stopped is not None:
                # A copy, so that the error does not hold all the memory of the run.
                until = shaped[..., : self.samples - begin].copy()
                raise DivergenceError(*self._stopped, until)
        return shaped

    def _fill(
        self, output: FloatArray, noise: FloatArray, c1: FloatArray, c2: FloatArray
    ) -> None:
        """Compute the next samples, each in a row, unless the run stops before."""
        past, stop, first = self.history_samples, len(output), 0
        columns = self._signals.shape[2]
        phi, sent = self._signals[:, : past + stop]
        inputs = tuple(_in_columns(series, columns) for series in (noise, c1, c2))
        for work in self._groups:
            lanes = work.shape[1]
            run = first, phi, sent, inputs, self._sampled, work.ravel(), self.limit
            end = _compute((0,) * lanes, *run, self.samples)
            if end < stop:
                size = np.abs(phi[past + end, first : first + lanes])
                calm = work[-1, np.argmin(size <= self.limit * work[-2])]
                self._stopped = calm / self.sample_rate, (self.samples + end) / self.sample_rate
                stop = end
            first += lanes
        output[:stop] = phi[past : past + stop, : output.shape[1]]
        for signal in self._signals:
            signal[:past] = signal[len(output) : len(output) + past]
        self.samples += stop


def simulate(
    loop: Loop,
    noise: npt.ArrayLike,
    c1: npt.ArrayLike = 1.0,
    c2: npt.ArrayLike = 1.0,
    sample_rate: float = 200.0,
    *,
    history: npt.ArrayLike = 0.0,
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
    draws = len(given) if given.ndim == 2 else None
    run = Simulation(loop, sample_rate, history=history, limit=limit, draws=draws)
    return run._advance(given, c1, c2)


def simulate_blocks(
    loop: Loop,
    blocks: Iterable[npt.ArrayLike | Sequence[npt.ArrayLike]],
    sample_rate: float = 200.0,
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
    run = Simulation(loop, sample_rate)
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
    The blocks go to a file whose name ends in .part, in the same folder, which takes the name
    `path` when the last block is in. If anything stops the run, that file stays, and so does
    what was at `path` before.

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
    temporary = path.with_name(f"{path.name}.part")
    count = 0
    with temporary.open("wb") as file:
        # The header has room for any length: it is written again below.
        _write_header(file, 0)
        for number, block in enumerate(blocks):
            values = finite_series(f"blocks[{number}]", block)
            file.write(np.ascontiguousarray(values, dtype="<f8").tobytes())
            count += values.size
        file.seek(0)
        _write_header(file, count)
    temporary.replace(path)
    return count


def _write_header(file: BinaryIO, count: int) -> None:
    description = {"descr": "<f8", "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(file, description)
