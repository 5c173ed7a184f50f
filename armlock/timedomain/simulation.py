"""The loop in the time domain, sample by sample, closed exactly in each.

With phi the frequency noise of the locked laser, every loop of `armlock.loops` reads

    phi(t) = noise(t) - K [m1 u1 + m2 u2](t - delay),
    u_k(t) = phi(t) - c_k(t) phi(t - tau_k).

Sensor and controller are sampled by the trapezoidal rule, see `armlock.timedomain.discretize`.
Without a dead time the present phi is on both sides, with a weight of thousands; each sample
solves for it. A rule that took the previous phi instead would be unstable by itself as soon as
gain times step exceeds about one, and is not offered. Delays between samples are interpolated,
see `armlock.timedomain.delays`.

Because s = j omega becomes (2 j / T) tan(omega T / 2) while the delays stay what they are,
what is simulated has an open loop in closed form, `sampled_open_loop`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from armlock.axis.compiled import njit
from armlock.checks import (
    ComplexArray,
    FloatArray,
    check_memory,
    finite_series,
    positive_array,
    positive_number,
    real_number,
    whole_number,
)
from armlock.loops import Loop, checked_loop
from armlock.progress import progress
from armlock.timedomain.delays import (
    Arm,
    Delay,
    GivenDelay,
    MovingDelay,
    between,
    delayed,
    reach,
    sampled_delays,
)
from armlock.timedomain.discretize import SampledFilter, SampledSensor, sampled_loop, warped

#: Samples that are computed at a time, of all runs together. Where delays reach far back there
#: are more, because each block moves the past. Results do not depend on their number.
BLOCK = 1 << 16
#: Runs of an ensemble that go side by side. Fewer than half as many go one by one.
LANES = 32
#: The output counts as diverged when it exceeds the largest input so far by this factor. What
#: the arms hold at the start, the history, is input too.
LIMIT = 1e6

#: A loop in samples: delays of both arms and the dead time, sensor, controller.
SampledLoop = tuple[tuple[Delay | MovingDelay, ...], SampledSensor, SampledFilter]
#: Shares of the signals of both arms in the sensor's output, in what the controller sends, and
#: in what it sends with the next sample.
Shares = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]

#: One entry for each run that goes side by side with others. The compiler knows their number,
#: and hands nothing on, because the entries are empty.
Lanes = tuple[tuple[()], ...]

# Samples kept behind the longest delay, for arms that have grown during a gap of the run.
_SPARE = 64

# Rows of the working memory of a run, of lanes side by side: what the controller sends with the
# next sample if no input comes; what both arms return, the input and the output of this sample;
# the largest input so far, and the number of the last output not above it. The states of sensor
# and controller follow.
_PREDICTED, _DELAYED1, _DELAYED2, _INPUT, _OUTPUT, _LARGEST, _BOUNDED, _STATES = range(8)


class DivergenceError(ArithmeticError):
    """The locked laser's noise has left all bounds.

    Attributes
    ----------
    time : float
        When it began, in s: the last time at which the output was no larger than the largest
        input so far, noise or history.
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


@njit()
def _place(row: int, lanes: Lanes, w: int) -> np.uintp:
    """Return where in `work` the entry of lane w in a row stands.

    Unsigned, because a negative index would count from the end, which takes time to check.
    """
    return np.uintp(row * len(lanes) + w)


@njit()
def _receive(
    lanes: Lanes,
    first: int,
    phi: FloatArray,
    now: int,
    c: FloatArray,
    delay: Delay | MovingDelay,
    i: int,
    work: FloatArray,
    target: int,
) -> None:
    """Put what an arm returns, c(t) phi(t - tau(t)), into the row `target` of `work`.

    `now` is the present row of phi, and `i` that of c, unless it has only one, and of a delay
    that moves. See `_compute` for the rest.
    """
    at = np.uintp(i * (len(c) > 1))
    if isinstance(delay, tuple):  # known when it is compiled
        for w in range(len(lanes)):
            column = np.uintp(first + w)
            work[_place(target, lanes, w)] = c[at, column] * delayed(phi, now, column, delay)
    elif delay.shape[1] == 1:
        whole = np.floor(delay[i, 0])
        middle = now - int(whole)
        for w in range(len(lanes)):
            column = np.uintp(first + w)
            # Outside of this loop it would halve the speed of a single run.
            u = delay[i, 0] - whole - 0.5
            work[_place(target, lanes, w)] = c[at, column] * between(phi, middle, column, u)
    else:
        for w in range(len(lanes)):
            column = np.uintp(first + w)
            whole = np.floor(delay[i, column])
            u = delay[i, column] - whole - 0.5
            middle = now - int(whole)
            work[_place(target, lanes, w)] = c[at, column] * between(phi, middle, column, u)


@njit()
def _shares(sensor: SampledSensor, controller: SampledFilter) -> Shares:
    """Return what the signals of the arms add at once: see `Shares`."""
    sections, gain = controller.sections, controller.gain
    direct1, direct2 = sensor.direct
    _, next1, next2 = sensor.states[len(sensor.states) - 1]
    for j in range(len(sections)):
        next1 += direct1 * sections[j][3]
        next2 += direct2 * sections[j][3]
    now1, now2, next1, next2 = gain * direct1, gain * direct2, gain * next1, gain * next2
    return (direct1, direct2), (now1, now2), (next1, next2)


@njit()
def _close(
    lanes: Lanes,
    first: int,
    sent: FloatArray,
    now: int,
    dead: Delay,
    shares: Shares,
    work: FloatArray,
) -> None:
    """Compute this sample's output, and with a dead time what the controller sends."""
    now1, now2 = shares[1]
    inverse = 1.0 / (1.0 + now1 + now2)
    for w in range(len(lanes)):
        column = np.uintp(first + w)
        a1, a2 = work[_place(_DELAYED1, lanes, w)], work[_place(_DELAYED2, lanes, w)]
        x, predicted = work[_place(_INPUT, lanes, w)], work[_place(_PREDICTED, lanes, w)]
        if dead[0] == 0:
            # phi = noise - predicted - now1 (phi - a1) - now2 (phi - a2), solved for phi.
            x = (x + (now1 * a1 + now2 * a2) - predicted) * inverse
        else:
            x -= delayed(sent, now, column, dead)
            sending = now1 * (x - a1) + now2 * (x - a2)
            sent[np.uintp(now), column] = predicted + sending
        work[_place(_OUTPUT, lanes, w)] = x


@njit()
def _move_on(
    lanes: Lanes,
    sensor: SampledSensor,
    controller: SampledFilter,
    shares: Shares,
    work: FloatArray,
) -> None:
    """Take the states of sensor and controller to the next sample.

    What they send next does not wait for what the signals of the arms do to them.
    """
    (direct1, direct2), _, (next1, next2) = shares
    rows, sections = sensor.states, controller.sections
    m, n = len(rows), len(sections)
    for w in range(len(lanes)):
        x = work[_place(_OUTPUT, lanes, w)]
        u1, u2 = x - work[_place(_DELAYED1, lanes, w)], x - work[_place(_DELAYED2, lanes, w)]
        top, below, ready = work[_place(_STATES + m - 1, lanes, w)], 0.0, 0.0
        for j in range(m):
            q, b1, b2 = rows[j]
            state = _place(_STATES + j, lanes, w)
            old = work[state]
            ready = old + (below - q * top)
            work[state] = ready + (b1 * u1 + b2 * u2)
            below = old
        v, direct = top, direct1 * u1 + direct2 * u2
        for j in range(n):
            r1, r2, k, t1, t2 = sections[j]
            state1 = _place(_STATES + m + 2 * j, lanes, w)
            state2 = _place(_STATES + m + 2 * j + 1, lanes, w)
            w1, w2 = work[state1], work[state2]
            new1 = w1 + (r1 * w1 - k * w2 + v)
            new2 = w2 + (r2 * w2 + w1)
            ready += t1 * new1 + t2 * new2
            v += t1 * w1 + t2 * w2
            work[state1], work[state2] = new1 + direct, new2
        predicted = controller.gain * ready + (next1 * u1 + next2 * u2)
        work[_place(_PREDICTED, lanes, w)] = predicted


@njit()
def _exceeding(lanes: Lanes, work: FloatArray, number: float, limit: float) -> int:
    """Return how many outputs exceed the limit; note the largest inputs, and when not above."""
    exceeding = 0
    for w in range(len(lanes)):
        size = abs(work[_place(_OUTPUT, lanes, w)])
        given = abs(work[_place(_INPUT, lanes, w)])
        most, bounded = work[_place(_LARGEST, lanes, w)], _place(_BOUNDED, lanes, w)
        most = given if given > most else most
        work[_place(_LARGEST, lanes, w)] = most
        work[bounded] = number if size <= most else work[bounded]
        exceeding += 0 if size <= limit * most else 1
    return exceeding


@njit(nogil=True)
def _compute(
    lanes: Lanes,
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
    column, as delays that move do; of c1 and c2 a single row is for all samples. The runs from
    column `first` on go side by side in lanes, so that one instruction works on several of
    them. `work` holds their rows one behind the other: see `_STATES`. It is one array, because
    the compiler would have to check that several do not overlap.

    Returns the index of the sample at which an output exceeds `limit` times the largest input,
    or how many there are.
    """
    noise, c1, c2 = inputs
    (arm1, arm2, dead), sensor, controller = sampled
    shares = _shares(sensor, controller)
    for i in range(len(noise)):
        now = len(phi) - len(noise) + i
        _receive(lanes, first, phi, now, c1, arm1, i, work, _DELAYED1)
        _receive(lanes, first, phi, now, c2, arm2, i, work, _DELAYED2)
        for w in range(len(lanes)):
            work[_place(_INPUT, lanes, w)] = noise[np.uintp(i), np.uintp(first + w)]
        _close(lanes, first, sent, now, dead, shares, work)
        _move_on(lanes, sensor, controller, shares, work)
        exceeding = _exceeding(lanes, work, float(done + i), limit)
        for w in range(len(lanes)):
            phi[np.uintp(now), np.uintp(first + w)] = work[_place(_OUTPUT, lanes, w)]
        if exceeding:
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


def _in_lanes(delay: Delay | MovingDelay, number: int) -> Delay | MovingDelay:
    """Return a delay with a column for each lane, if the runs have their own."""
    if isinstance(delay, tuple) or delay.shape[1] == 1:
        return delay
    return _in_columns(delay, number)


def _in_columns(series: FloatArray, number: int) -> FloatArray:
    """Return samples in rows, as compiled code takes them, the last run repeated at the end."""
    if series.shape[1] == 1 < number:
        series = np.broadcast_to(series, (len(series), number))
    elif series.shape[1] < number:
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
    >>> bool(np.allclose(sampled_open_loop(loop, omega), loop(1j * omega), rtol=1e-5))
    True
    """
    rate = positive_number("sample_rate", sample_rate)
    delays = sampled_delays(checked_loop(loop), rate)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    omega = positive_array("omega", omega)
    delayed1, delayed2, dead = (
        np.exp(-1j * omega[..., None] * (first + np.arange(len(weights))) / rate) @ weights
        for first, weights in delays
    )
    s = 1j * warped(omega, rate)
    m1, m2 = loop.mapping.weights(s)
    sensor = m1 * (1.0 - c1 * delayed1) + m2 * (1.0 - c2 * delayed2)
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
        or at least `history_samples` values, and as many as delays that move reach back at
        the start. Controller and sensor start at rest.
    limit : float, optional
        The run counts as diverged when the output exceeds the largest input so far, noise or
        history, by this factor.
    draws : int, optional
        Runs an ensemble of so many, side by side: noise, c1 and c2 have a row for each.

    Attributes
    ----------
    samples : int
        How many samples were computed.
    history_samples : int
        How many samples the loop's own longest delay reaches back.

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
    what their states make of earlier samples (`armlock.timedomain.discretize`). The returns
    a_k and the dead time, k = 0, are interpolated as for `sampled_open_loop`. Without a dead
    time y[n] enters its own sample, and the loop is closed within it:

    .. math::

        \varphi[n] = \frac{\varphi_0[n] - r[n] + g \left( d_1 a_1[n] + d_2 a_2[n] \right)}
        {1 + g \left( d_1 + d_2 \right)} .

    A delay that moves is interpolated in every sample, with the weights that the same formula
    gives for :math:`\tau_k[n]`: where it is whole samples, that sample. In a second it changes
    by more than -3 and less than 1 s, as round trips do whose ends move at less than the speed
    of light: with speeds :math:`v_1`, :math:`v_2` of the ends apart,

    .. math::

        \dot\tau = 1 - \left( 1 - \frac{v_1}{c} \right) \left( 1 - \frac{v_2}{c} \right) .

    One call and many give the same samples, bit by bit, and so do an ensemble and its runs one
    by one. A run goes on after a gap as if there were none: its arms hold what they held. Its
    state is the output as far back as delays reach, with a dead time what the controller has
    sent as well, and some numbers more: 35 kB for the paper's loop at 200 Hz.
    ``copy.deepcopy(run)`` and ``pickle.dumps(run)`` keep it.

    An ensemble takes `LANES` runs at a time, whose samples the processor's vector units
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

    The state goes into a file, and another process goes on from there:

    >>> import pickle
    >>> saved = pickle.dumps(run)
    >>> later = pickle.loads(saved)
    >>> bool(np.array_equal(later.advance(np.ones(400)), run.advance(np.ones(400))))
    True
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
        delays = sampled_delays(loop, self.sample_rate)
        sensor, controller = sampled_loop(loop.controller, loop.mapping, self.sample_rate)
        self._filters = sensor, controller
        self._dead = delays[2]
        self.history_samples = max(map(reach, delays))
        before = finite_series("history", history, 0, 1)
        if before.ndim and before.size < self.history_samples:
            raise ValueError(
                f"history must hold at least {self.history_samples} samples, as far as the "
                f"longest delay reaches, got {before.size}"
            )
        self._history = before.copy()
        # Kinds of samples: the output, and with a dead time what the controller has sent. Of
        # each a block stands behind those before that are known. They come with the first one.
        kinds = 1 if self._dead[0] == 0 else 2
        columns = self.draws or 1
        past = self.history_samples
        self._block = max(BLOCK // columns, 4 * past)
        for name, number in (("sample_rate", 1), ("draws", columns)):
            check_memory(name, (kinds, past + self._block, number), 8)
        full, rest = divmod(columns, LANES)
        # The last runs may be few, and are then faster one by one.
        groups = [LANES] * full + ([1] * rest if 2 * rest < LANES else [LANES])
        rows = _STATES + len(sensor.states) + 2 * len(controller.sections)
        self._groups = [np.zeros((rows, lanes)) for lanes in groups]
        self._signals = np.zeros((kinds, 0, sum(groups)))
        self._known = before.size if before.ndim else sys.maxsize
        self._stopped: tuple[float, float] | None = None
        self._in_block = False
        self.samples = 0

    def __getstate__(self) -> dict[str, object]:
        """Leave out the room for the next block."""
        return self.__dict__ | {"_signals": self._signals[:, : self._known].copy()}

    def advance(
        self,
        noise: npt.ArrayLike,
        c1: npt.ArrayLike = 1.0,
        c2: npt.ArrayLike = 1.0,
        *,
        tau1: GivenDelay | None = None,
        tau2: GivenDelay | None = None,
    ) -> FloatArray:
        """Compute the next block.

        Parameters
        ----------
        noise : array_like, shape (n,), or (draws, n) for an ensemble
            Free-running noise of the laser; the output has its unit.
        c1, c2 : float or array_like of the same shape, optional
            Multiplicative perturbations.
        tau1, tau2 : float, array_like of the same shape, or callable, optional
            Delays of the arms in s, in place of the loop's own. A callable takes an array of
            times in s from the first sample of the run on, and returns a number, an array of
            the same shape, or for an ensemble one of shape (draws, n). It is called for some
            ten thousand samples at a time.

        Returns
        -------
        float array, of the same shape
            Noise of the locked laser.

        Raises
        ------
        TypeError, ValueError
            If an argument is not finite and real, or of another shape; nothing is computed.
            If a delay is shorter than four samples, though not constant, reaches back past the
            history, or changes faster than light allows; the message names the time, and
            `samples` says how far the run has come.
        DivergenceError
            If the output leaves all bounds. The run cannot be continued.
        """
        given = finite_series("noise", noise, 1 if self.draws is None else 2)
        if self.draws not in (None, len(given)):
            raise ValueError(f"noise must have {self.draws} rows, got shape {given.shape}")
        return self._advance(given, c1, c2, tau1, tau2)

    def _advance(
        self,
        given: FloatArray,
        c1: npt.ArrayLike,
        c2: npt.ArrayLike,
        tau1: GivenDelay | None,
        tau2: GivenDelay | None,
    ) -> FloatArray:
        """Compute the next block, from noise that has been checked."""
        inputs = [np.atleast_2d(given).T, _series("c1", c1, given), _series("c2", c2, given)]
        arms = self._arm("tau1", tau1, given), self._arm("tau2", tau2, given)
        if self._in_block:
            raise RuntimeError(
                "this run was interrupted in the middle of a block, and cannot go on: begin "
                "again, or with a copy made before"
            )
        output, begin = np.empty(inputs[0].shape), self.samples
        shaped = output.T.reshape(given.shape)
        with progress("simulation", len(output)) as say:
            for at in range(0, len(output), self._block):
                part = slice(at, at + self._block)
                if self._stopped is None:
                    block = [s[part] if len(s) > 1 else s for s in inputs]
                    self._fill(output[part], block, arms)
                if self._stopped is not None:
                    # A copy, so that the error does not hold all the memory of the run.
                    until = shaped[..., : self.samples - begin].copy()
                    raise DivergenceError(*self._stopped, until)
                say(at + self._block)
        return shaped

    def _arm(self, name: str, tau: GivenDelay | None, like: FloatArray) -> Arm:
        """Return the delay of an arm during a call, the loop's own for None."""
        given: Any = getattr(self.loop, name) if tau is None else tau
        if not callable(given):
            series = _series(name, given, like)
            given = series if np.ndim(given) > 0 else positive_number(name, given)
        return Arm(name, given, self.sample_rate, self.samples)

    def _fill(
        self,
        output: FloatArray,
        inputs: Sequence[FloatArray],
        arms: Sequence[Arm],
    ) -> None:
        """Compute the next samples, each in a row, unless the run stops before."""
        stop, first, columns = len(output), 0, self._signals.shape[2]
        delays = [arm.during(inputs[0], self.samples, self._known) for arm in arms]
        keep = self._make_room(max(map(reach, (*delays, self._dead))))
        known = self._known
        # Without a dead time the last kind is the output, too, and nothing is sent.
        phi, sent = (self._signals[k, : known + stop] for k in (0, -1))
        series = tuple(_in_columns(given, columns) for given in inputs)
        sampled = (*(_in_lanes(delay, columns) for delay in delays), self._dead), *self._filters
        self._in_block = True
        for work in self._groups:
            lanes = work.shape[1]
            run = first, phi, sent, series, sampled, work.ravel(), self.limit
            end = _compute(((),) * lanes, *run, self.samples)
            if end < stop:
                size = np.abs(phi[known + end, first : first + lanes])
                began = work[_BOUNDED, np.argmin(size <= self.limit * work[_LARGEST])]
                self._stopped = (
                    began / self.sample_rate,
                    (self.samples + end) / self.sample_rate,
                )
                stop = end
            first += lanes
        output[:stop] = phi[known : known + stop, : output.shape[1]]
        self._known, end = min(known + stop, keep), known + stop
        self._signals[:, : self._known] = self._signals[:, end - self._known : end]
        self.samples += stop
        self._in_block = False

    def _make_room(self, longest: int) -> int:
        """Make room for a block whose delays reach so far back; return what to keep after it.

        That is some samples more, for the arms of the next block.
        """
        keep = max(self.history_samples, longest) + _SPARE
        if self.samples == 0:
            self._known = min(self._known, keep)
        shape = len(self._signals), max(keep, self._known) + self._block, self._signals.shape[2]
        if self._signals.shape[1] < shape[1]:
            check_memory("tau1 and tau2", shape, 8)
            signals, before = np.zeros(shape), self._signals[:, : self._known]
            signals[:, : before.shape[1]] = before
            self._signals = signals
        if self.samples == 0:
            history = self._history[-keep:, None] if self._history.ndim else self._history
            self._signals[0, : self._known] = history
            for work in self._groups:
                work[_LARGEST] = np.abs(self._signals[0, : self._known][-longest:]).max()
        return keep


def simulate(
    loop: Loop,
    noise: npt.ArrayLike,
    c1: npt.ArrayLike = 1.0,
    c2: npt.ArrayLike = 1.0,
    sample_rate: float = 200.0,
    *,
    tau1: GivenDelay | None = None,
    tau2: GivenDelay | None = None,
    history: npt.ArrayLike = 0.0,
    limit: float = LIMIT,
) -> FloatArray:
    r"""Run a loop, and return the frequency noise of the locked laser.

    From the noise :math:`\varphi_0` of the free-running laser it computes the solution of

    .. math::

        \varphi(t) &= \varphi_0(t) - K \left[ m_1 u_1 + m_2 u_2 \right](t) , \\
        u_k(t) &= \varphi(t) - c_k(t)\, \varphi(t - \tau_k(t)) ,

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
    tau1, tau2 : float, array_like of the same shape, or callable, optional
        Delays of the arms in s, in place of the loop's own; see `Simulation.advance`.
    history : float or array_like, optional
        Output before the first sample, zero by default; see `Simulation`.
    limit : float, optional
        Size of the output that counts as diverged, in units of the largest input so far, noise
        or history.

    Returns
    -------
    float array, of the same shape
        In the unit of `noise`. Each row of an ensemble equals a run of its own, bit by bit.

    Raises
    ------
    TypeError, ValueError
        If an argument is unsuitable; before anything is computed, but for delays that move.
    DivergenceError
        If the output leaves all bounds, in an ensemble that of the first run to do so. It
        carries the time at which that began and the part computed so far. An unstable loop
        that has not grown so far by the end of the run returns its output.

    Notes
    -----
    An arm returns c(t) times the signal as it was tau(t) ago, and no more. Where the signal is
    a phase, that is all that a moving arm does to it. Where it is a frequency, the arm returns
    :math:`(1 - \dot\tau)\, \nu(t - \tau)`: then c holds the factor :math:`1 - \dot\tau`.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import paper_loop, simulate
    >>> step = simulate(paper_loop(), np.ones(2000))
    >>> print(f"{step[0]:.4e}")
    9.9991e-05

    An arm that grows by 10 m a second:

    >>> drift = 2 * 10.0 / 299_792_458.0
    >>> step = simulate(paper_loop(), np.ones(2000), tau1=lambda t: 20.1 + drift * t)
    """
    given = finite_series("noise", noise, 1, 2)
    draws = len(given) if given.ndim == 2 else None
    run = Simulation(loop, sample_rate, history=history, limit=limit, draws=draws)
    return run._advance(given, c1, c2, tau1, tau2)
