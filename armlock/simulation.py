"""The loop in the time domain, sample by sample, its delays exact and its loop closed exactly.

With phi the frequency noise of the locked laser, every loop of `armlock.loops` reads

    phi(t) = noise(t) - K [m1 u1 + m2 u2](t),    u_k(t) = phi(t) - c_k(t) phi(t - tau_k).

Controller and sensor become one sampled state space with the inputs u1 and u2, see
`armlock.discretize`: the trapezoidal rule, in first-order sections that keep what poles differ
from one. The present phi is on both sides, with a weight of thousands; each sample solves
for it. A rule that took the previous phi instead would be unstable by itself as soon as gain
times step exceeds about one, and is not offered.

Because s = j omega becomes (2 j / T) tan(omega T / 2) while the delays stay what they are,
what is simulated has an open loop in closed form, `sampled_open_loop`.
"""

from __future__ import annotations

import math
import os
import secrets
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
import numpy.typing as npt
from numba import njit
from numba.cpython.unsafe.tuple import tuple_setitem

from armlock.checks import (
    ComplexArray,
    FloatArray,
    finite_series,
    positive_number,
    real_number,
    true_or_false,
    whole_number,
)
from armlock.discretize import (
    Row,
    SampledSystem,
    checked_frequency,
    floats,
    real_system,
    sample,
    warped,
)
from armlock.loops import Loop

#: Order of the Lagrange interpolation for delays that are not whole samples.
INTERPOLATION_ORDER = 7
#: Samples that are computed at a time; results do not depend on it.
BLOCK = 1 << 16
#: Runs from this many samples on show their progress on a terminal.
LONG_RUN = 5_000_000
#: The output counts as diverged when it exceeds the largest input so far by this factor.
LIMIT = 1e6
#: Longest delay in samples: half a gigabyte of history.
LONGEST = 1 << 26
#: Highest order of interpolation.
HIGHEST_ORDER = 99

Matrices = tuple[Row, Row, Row, Row, Row]

# Delays closer to whole samples than this, relatively, and never further than this share of a
# sample, are whole.
_WHOLE, _SHARE = 1e-9, 1e-6
_LARGEST_FLOAT = sys.float_info.max


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


class Delay(NamedTuple):
    """A delay in samples: phi(t - tau) = sum_k weights[k] phi[n - first - k]."""

    first: int
    weights: FloatArray


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
        Delay in s.
    sample_rate : float
        In Hz.
    order : int
        Odd order of the polynomial through the nearest samples.

    Returns
    -------
    Delay

    Raises
    ------
    ValueError
        If the delay is too short for the sample rate, or longer than `LONGEST` samples.

    Notes
    -----
    With an odd order and the delay between the two middle samples, no frequency is amplified,
    so that interpolation adds no instability of its own.
    """
    samples = tau * sample_rate
    if samples > LONGEST:
        raise ValueError(
            f"sample_rate must be at most {LONGEST / tau:.4g} Hz for {name} = {tau} s, got "
            f"{sample_rate}: the history would be {samples:.4g} samples, "
            f"{8e-9 * samples:.3g} GB"
        )
    whole = round(samples)
    if abs(samples - whole) <= min(_WHOLE * samples, _SHARE):
        if whole < 1:
            raise ValueError(
                f"sample_rate must be at least 1 / {name} = {1.0 / tau} Hz, got {sample_rate}"
            )
        return Delay(whole, np.ones(1))
    half = (order + 1) // 2
    first = math.floor(samples) - half + 1
    if first < 1:
        raise ValueError(
            f"sample_rate must be at least {half / tau} Hz to interpolate {name} = {tau} s to "
            f"order {order}, got {sample_rate}"
        )
    x = samples - first
    nodes = range(order + 1)
    weights = [math.prod((x - j) / (k - j) for j in nodes if j != k) for k in nodes]
    return Delay(first, np.array(weights))


@njit(cache=True, nogil=True)
def _advance(
    phi: FloatArray,
    start: int,
    noise: FloatArray,
    c1: FloatArray,
    c2: FloatArray,
    first1: int,
    weights1: Row,
    first2: int,
    weights2: Row,
    matrices: Matrices,
    direct: Row,
    entering: Row,
    state: Row,
    rest: float,
    watch: FloatArray,
    limit: float,
    done: int,
) -> tuple[Row, float, int]:
    """Compute a block of phi behind its `start` samples of history.

    `matrices` holds, all as flat tuples, which the compiler keeps in registers: the change of
    the state, its lower triangle by rows and the entries right of the diagonal; how u1 and u2
    drive it; and how it carries on into the next output. `state` is w, `rest` its share in
    the present output, and `watch` the largest input so far and the number of the last sample
    not above it. Returns the new state and share, and the index at which the output exceeds
    `limit` times the largest input, or -1.
    """
    change, above, drive1, drive2, carried = matrices
    n = len(drive1)
    w = state
    inverse = 1.0 / (1.0 + direct[0] + direct[1])
    largest, calm = watch[0], watch[1]
    stop = -1
    for i in range(noise.size):
        now = start + i
        a1 = 0.0
        for k in range(len(weights1)):
            a1 += weights1[k] * phi[now - first1 - k]
        a2 = 0.0
        for k in range(len(weights2)):
            a2 += weights2[k] * phi[now - first2 - k]
        a1 *= c1[i]
        a2 *= c2[i]
        # phi = noise - rest - direct1 (phi - a1) - direct2 (phi - a2), solved for phi.
        x = (noise[i] + (direct[0] * a1 + direct[1] * a2) - rest) * inverse
        phi[now] = x
        u1, u2 = x - a1, x - a2
        # The next `rest` needs this sample's state only, and so does not wait for the new one.
        rest = 0.0
        for k in range(n):
            rest += carried[k] * w[k]
        rest += entering[0] * u1 + entering[1] * u2
        new = w
        m = 0
        for j in range(n):
            step = above[j] * w[(j + 1) % n]
            for k in range(j + 1):
                step += change[m] * w[k]
                m += 1
            new = tuple_setitem(new, j, w[j] + (step + (drive1[j] * u1 + drive2[j] * u2)))
        w = new
        size = abs(x)
        largest = max(largest, abs(noise[i]))
        if size <= largest:
            calm = done + i
        elif not (size <= limit * largest and size <= _LARGEST_FLOAT):
            stop = i
            break
    watch[0], watch[1] = largest, calm
    return w, rest, stop


def _as_rows(sampled: SampledSystem) -> Matrices:
    """Return change, drives and carried shares as `_advance` takes them."""
    change, drive, output = sampled.change, sampled.drive, sampled.output
    if not output.size:
        change, drive, output = np.zeros((1, 1)), np.zeros((1, 2)), np.zeros(1)
    n = output.size
    if np.triu(change, 2).any():
        raise AssertionError("sections are chained in order, two states at most coupled")
    rows = tuple(float(change[j, k]) for j in range(n) for k in range(j + 1))
    above = np.append(np.diagonal(change, 1), 0.0)
    carried = output + output @ change
    drive1, drive2 = floats(drive[:, 0]), floats(drive[:, 1])
    return rows, floats(above), drive1, drive2, floats(carried)


def _checked_loop(loop: object) -> Loop:
    if not isinstance(loop, Loop):
        raise TypeError(f"loop must be an armlock.Loop, got {type(loop).__name__}")
    return loop


def _order(value: object) -> int:
    message = f"interpolation must be an odd integer from 1 to {HIGHEST_ORDER}, got {value!r}"
    try:
        order = whole_number("interpolation", value, 1, HIGHEST_ORDER)
    except ValueError:
        raise ValueError(message) from None
    if order % 2 == 0:
        raise ValueError(message)
    return order


def _check_rate(loop: Loop, sample_rate: float) -> None:
    """Refuse a rate at which a pole or zero would change its nature."""
    mapping = np.roots(loop.mapping.denominator[::-1])
    roots = (*loop.controller.zeros, *loop.controller.poles, *mapping)
    fastest = max((abs(root) for root in roots), default=0.0)
    if sample_rate <= fastest / 2.0:
        raise ValueError(
            f"sample_rate must exceed {fastest / 2.0} Hz, half of the loop's fastest pole "
            f"or zero in rad/s, got {sample_rate}"
        )


def _single(value: object) -> bool:
    """Whether a value is one thing, and not a sequence of them."""
    try:
        return np.ndim(value) == 0  # type: ignore[arg-type]
    except ValueError:
        return False


def _parameter(name: str, value: object, like: FloatArray) -> float | FloatArray:
    """Return c1 or c2 as a finite number, or as an array of the shape of the noise."""
    if _single(value):
        return real_number(name, value)
    array = finite_series(name, value)
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

        L_T(\omega) &= K(\mathrm{j}\Omega) \sum_{k=1}^{2} m_k(\mathrm{j}\Omega)
        \left( 1 - c_k H_k(\omega) \right) , \\
        \Omega &= \frac{2}{T} \tan \frac{\omega T}{2} , \\
        H_k(\omega) &= \sum_i \ell_{k,i}\, e^{-\mathrm{j}\omega (f_k + i) T} ,

    where a delay of whole samples has

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
    loop, order = _checked_loop(loop), _order(interpolation)
    rate = positive_number("sample_rate", sample_rate)
    _check_rate(loop, rate)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    omega = checked_frequency("omega", omega, math.pi * rate, "rad/s")
    if not omega.all():
        raise ValueError(
            "omega must be positive, got 0.0: controller or sensor has a pole there"
        )
    s = 1j * warped(omega, rate)
    m1, m2 = loop.mapping.weights(s)
    result = np.zeros(omega.shape, dtype=np.complex128)
    for m, c, name in ((m1, c1, "tau1"), (m2, c2, "tau2")):
        delay = lagrange_delay(name, getattr(loop, name), rate, order)
        lags = delay.first + np.arange(delay.weights.size)
        late = np.exp(-1j * omega[..., None] * lags / rate) @ delay.weights
        result += m * (1.0 - c * late)
    return np.asarray(loop.controller(s) * result)


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
        Odd order, up to 99, of the polynomial by which delays that are not whole samples are
        interpolated. Whole ones are exact.
    limit : float, optional
        The run counts as diverged when the output exceeds the largest input so far by this
        factor, one at least.

    Attributes
    ----------
    samples : int
        How many samples were computed.
    history_samples : int
        How many samples the longest delay reaches back.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no loop, the sample rate is too low for its delays, its poles and zeros,
        or its feedback at high frequency, or so high that its delays are more than `LONGEST`
        samples, or the history is too short or not finite.

    Notes
    -----
    With :math:`\varphi_0` the noise of the free-running laser, a sample is

    .. math::

        a_k[n] &= c_k[n] \sum_i \ell_{k,i}\, \varphi[n - f_k - i] , \\
        \varphi[n] &= \frac{\varphi_0[n] - C w[n] + d_1 a_1[n] + d_2 a_2[n]}
        {1 + d_1 + d_2} , \\
        w[n+1] &= w[n] + E w[n] + \sum_{k=1}^{2} F_k (\varphi[n] - a_k[n]) .

    The late light a_k is interpolated as for `sampled_open_loop`; w is the state of controller
    and sensor, sampled by the trapezoidal rule, with change E, drives F_k, output C and direct
    shares d_k (`armlock.discretize`). So the loop is closed within the sample.

    One call and many give the same samples, bit by bit.

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
    ) -> None:
        self.loop = _checked_loop(loop)
        self.sample_rate = positive_number("sample_rate", sample_rate)
        self.limit = positive_number("limit", limit)
        if self.limit < 1.0:
            raise ValueError(f"limit must be at least 1, got {self.limit}")
        _check_rate(self.loop, self.sample_rate)
        self.interpolation = _order(interpolation)
        self._delays = [
            lagrange_delay(name, getattr(loop, name), self.sample_rate, self.interpolation)
            for name in ("tau1", "tau2")
        ]
        self.history_samples = max(d.first + d.weights.size - 1 for d in self._delays)
        self._sampled = sample(
            real_system(
                loop.controller.zeros,
                loop.controller.poles,
                loop.controller.gain,
                (loop.mapping.numerator1, loop.mapping.numerator2),
                loop.mapping.denominator,
            ),
            self.sample_rate,
        )
        self._check_closure()
        self._matrices = _as_rows(self._sampled)
        self._direct = floats(self._sampled.direct)
        self._entering = floats(self._sampled.output @ self._sampled.drive)
        self._state: Row = (0.0,) * len(self._matrices[1])
        self._rest = 0.0
        self._phi = np.zeros(self.history_samples + BLOCK)
        self._phi[: self.history_samples] = self._checked_history(history)
        before = self._phi[: self.history_samples]
        start = max(float(before.max()), -float(before.min()))
        self._watch = np.array([start, 0.0])
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
        closed = 1.0 + float(self._sampled.direct.sum())
        loop = self.loop
        sizes = [p[loop.degree] if p.size > loop.degree else 0.0 for p in (loop.a, loop.rest)]
        if not closed * sizes[0] * sizes[1] > 0.0:
            raise ValueError(
                f"sample_rate must be higher for this loop, got {self.sample_rate}: 1 + L "
                f"without delays changes sign beyond it, a root that samples cannot show"
            )

    def _checked_history(self, history: npt.ArrayLike) -> float | FloatArray:
        if _single(history):
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
        noise : array_like, shape (n,)
            Free-running noise of the laser; the output has its unit.
        c1, c2 : float or array_like of shape (n,), optional
            Multiplicative perturbations.

        Returns
        -------
        float array, shape (n,)
            Noise of the locked laser.

        Raises
        ------
        TypeError, ValueError
            If an argument is not finite and real, or of another shape; nothing is computed.
        DivergenceError
            If the output leaves all bounds. The run cannot be continued.
        """
        given = finite_series("noise", noise)
        first, second = _parameter("c1", c1, given), _parameter("c2", c2, given)
        output = np.empty_like(given)
        self._fill(output, given, first, second, None)
        return output

    def _fill(
        self,
        output: FloatArray,
        noise: FloatArray,
        c1: float | FloatArray,
        c2: float | FloatArray,
        bar: _Bar | None,
    ) -> None:
        """Compute `output` from checked arguments, in blocks of a fixed size."""
        if self._stopped is not None:
            raise DivergenceError(*self._stopped, np.empty(0))
        start = self.history_samples
        delay1, delay2 = self._delays
        for at in range(0, noise.size, BLOCK):
            piece = slice(at, min(at + BLOCK, noise.size))
            part = _piece(noise, piece)
            self._state, self._rest, stop = _advance(
                self._phi,
                start,
                part,
                _piece(c1, piece),
                _piece(c2, piece),
                delay1.first,
                floats(delay1.weights),
                delay2.first,
                floats(delay2.weights),
                self._matrices,
                self._direct,
                self._entering,
                self._state,
                self._rest,
                self._watch,
                self.limit,
                self.samples,
            )
            if stop >= 0:
                output[at : at + stop] = self._phi[start : start + stop]
                self.samples += stop
                self._stopped = float(self._watch[1]) / self.sample_rate, self.time
                # A copy, so that the error does not hold all the memory of the run.
                raise DivergenceError(*self._stopped, output[: at + stop].copy())
            output[piece] = self._phi[start : start + part.size]
            self._phi[:start] = self._phi[part.size : part.size + start].copy()
            self.samples += part.size
            if bar is not None:
                bar.show(self.samples)


def _piece(values: float | FloatArray, piece: slice) -> FloatArray:
    if isinstance(values, float):
        return np.full(piece.stop - piece.start, values)
    part = np.ascontiguousarray(values[piece])
    # Read-only arrays are another type to the compiler.
    return part if part.flags.writeable else part.copy()


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
    progress: bool | None = None,
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
    noise : array_like, shape (n,)
        Frequency noise of the free-running laser, for instance in Hz.
    c1, c2 : float or array_like of shape (n,), optional
        Multiplicative perturbations of the two arms, constant or sample by sample.
    sample_rate : float, optional
        In Hz.
    history : float or array_like, optional
        Output before the first sample, zero by default; see `Simulation`.
    interpolation : int, optional
        Order of interpolation for delays that are not whole samples; see `Simulation`.
    limit : float, optional
        Size of the output, in units of the largest input, that counts as diverged.
    progress : bool, optional
        Whether to show a bar on standard error. By default, on long runs on a terminal.

    Returns
    -------
    float array, shape (n,)
        In the unit of `noise`.

    Raises
    ------
    TypeError, ValueError
        If an argument is unsuitable; before anything is computed.
    DivergenceError
        If the output leaves all bounds. It carries the time at which that began and the part
        computed so far. An unstable loop that has not grown so far by the end of the run
        returns its output.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import paper_loop, simulate
    >>> step = simulate(paper_loop(), np.ones(2000))
    >>> print(f"{step[0]:.4e}")
    9.9991e-05
    """
    run = Simulation(
        loop, sample_rate, history=history, interpolation=interpolation, limit=limit
    )
    given = finite_series("noise", noise)
    first, second = _parameter("c1", c1, given), _parameter("c2", c2, given)
    with _Bar(given.size, run.sample_rate, progress) as bar:
        output = np.empty_like(given)
        run._fill(output, given, first, second, bar)
    return output


def simulate_blocks(
    loop: Loop,
    blocks: Iterable[npt.ArrayLike | Sequence[npt.ArrayLike]],
    sample_rate: float = 200.0,
    *,
    samples: int = 0,
    history: npt.ArrayLike = 0.0,
    interpolation: int = INTERPOLATION_ORDER,
    limit: float = LIMIT,
    progress: bool | None = None,
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
    samples : int, optional
        How many there will be, for the progress bar.
    history, interpolation, limit, progress
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

    bar = _Bar(whole_number("samples", samples, 0), run.sample_rate, progress)
    if not isinstance(blocks, Iterable):
        raise TypeError(f"blocks must be an iterable of arrays, got {blocks!r}")

    def outputs() -> Iterator[FloatArray]:
        with bar:
            for block in blocks:
                parts = block if isinstance(block, tuple) else (block,)
                if not 1 <= len(parts) <= 3:
                    raise ValueError(
                        f"blocks must hold arrays or tuples (noise, c1, c2), got a tuple of "
                        f"{len(parts)}"
                    )
                yield run.advance(*parts)
                bar.show(run.samples)

    return outputs()


def save_series(path: str | os.PathLike[str], blocks: Iterable[FloatArray]) -> int:
    """Write a stream of blocks as one NumPy file that exists only when it is complete.

    Parameters
    ----------
    path : path_like
        Name of the file, which ends in .npy.
    blocks : iterable of float arrays
        Each one-dimensional and finite, for instance from `simulate_blocks`.

    Returns
    -------
    int
        Number of samples written.

    Raises
    ------
    TypeError, ValueError
        If the name does not end in .npy, or a block is not a one-dimensional series of finite
        real numbers.
    OSError
        If `path` is a folder, or its folder does not exist.

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
    if path.suffix != ".npy":
        raise ValueError(f"path must end in .npy, got {str(path)!r}")
    if path.is_dir():
        raise IsADirectoryError(f"path must be a file, got the folder {str(path)!r}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"path must lie in a folder that exists, got {str(path)!r}")
    if not isinstance(blocks, Iterable):
        raise TypeError(f"blocks must be an iterable of arrays, got {blocks!r}")
    temporary = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
    count = 0
    try:
        with temporary.open("xb") as file:
            # The header's room for the length suffices for any: it is written again below.
            _write_header(file, 0)
            for number, block in enumerate(blocks):
                values = finite_series(f"blocks[{number}]", block)
                file.write(np.ascontiguousarray(values, dtype="<f8").tobytes())
                count += values.size
            file.seek(0)
            _write_header(file, count)
            file.flush()
            # On the disk before the name is.
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return count


def _write_header(file: object, count: int) -> None:
    description = {"descr": "<f8", "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(file, description)  # type: ignore[arg-type]


class _Bar:
    """A progress bar on one line of standard error."""

    def __init__(self, samples: int, sample_rate: float, progress: bool | None) -> None:
        self.samples = samples
        self.rate = sample_rate
        self.stream: TextIO = sys.stderr
        self.shown = -1
        if progress is None:
            wanted = samples >= LONG_RUN and self.stream.isatty()
        else:
            wanted = true_or_false("progress", progress)
        self.wanted = wanted and samples > 0

    def __enter__(self) -> _Bar:
        return self

    def show(self, done: int) -> None:
        """Draw the bar, at most a hundred times."""
        share = 100 * done // max(self.samples, 1)
        if self.wanted and share > self.shown:
            self.shown = share
            filled = "#" * (share * 40 // 100)
            text = f"\r[{filled:40s}] {share:3d} %  {done / self.rate:.0f} s simulated"
            self.stream.write(text)
            self.stream.flush()

    def __exit__(self, *stopped: object) -> None:
        if self.wanted and self.shown >= 0:
            self.stream.write("\n")
