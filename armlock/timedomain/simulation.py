"""The loop in the time domain, sample by sample.

With phi the frequency noise of the locked laser, every loop of `armlock.loops` reads

    phi(t) = noise(t) - K [m1 u1 + m2 u2](t),
    u_k(t) = phi(t) - c_k(t) phi(t - tau_k).

Controller and sensor are sampled by the trapezoidal rule (`armlock.timedomain.discretize`). The
present phi stands on both sides with a weight of thousands, and each sample solves for it: a
rule that took the previous phi instead would be unstable. `sampled_open_loop` is the exact open
loop of the simulation.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from armlock.checks import (
    ComplexArray,
    FloatArray,
    check_memory,
    finite_series,
    positive_array,
    positive_number,
    real_number,
)
from armlock.compiled import njit
from armlock.loops import Loop, checked_loop
from armlock.timedomain.delays import (
    AnyDelay,
    Delay,
    GivenDelay,
    arm_delay,
    delayed,
    lagrange_delay,
    longest,
    reach,
)
from armlock.timedomain.discretize import SampledFilter, SampledSensor, sampled_loop, warped

#: The output counts as diverged when it exceeds the largest input so far by this factor.
LIMIT = 1e6
# Samples kept behind the longest delay, for arms that have grown during a gap of the run.
_SPARE = 64
# The numbers that a run keeps: what the controller would send with the next sample if no input
# came, the largest input so far, and the number of the last output that was not larger. The
# states of sensor and controller follow.
_PREDICTED, _LARGEST, _BOUNDED, _STATES = range(4)


class DivergenceError(ArithmeticError):
    """The output of a simulated loop has exceeded its limit.

    Attributes
    ----------
    time : float
        When it began in s: the last time at which the output was no larger than the largest
        input so far, noise or history.
    detected : float
        When the output exceeded that input by the factor `limit`, in s.
    output : float array
        The samples of this call before that time; all are finite.

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
        """Return what makes the same error again in another process, as joblib does."""
        return type(self), (self.time, self.detected, self.output)


@njit(nogil=True)
def _compute(
    phi: FloatArray,
    inputs: tuple[FloatArray, ...],
    arms: tuple[AnyDelay, AnyDelay],
    sensor: SampledSensor,
    controller: SampledFilter,
    work: FloatArray,
    limit: float,
    done: int,
) -> int:
    """Compute the last samples of phi from those before, one for each sample of the noise.

    `inputs` are noise, c1 and c2; c1 and c2 may have one sample for all. `work` is described at
    `_STATES`, and `done` counts the samples of the run before this call. Returns the index of
    the sample that exceeds `limit` times the largest input, or the number of samples.
    """
    noise, c1, c2 = inputs
    rows, sections, gain = sensor.states, controller.sections, controller.gain
    m, n = len(rows), len(sections)
    direct1, direct2 = sensor.direct
    # What the signals of the arms add to the next sample at once, and to this one.
    _, next1, next2 = rows[m - 1]
    for j in range(n):
        next1 += direct1 * sections[j][3]
        next2 += direct2 * sections[j][3]
    now1, now2, next1, next2 = gain * direct1, gain * direct2, gain * next1, gain * next2
    inverse = 1.0 / (1.0 + now1 + now2)
    predicted, most, bounded = work[_PREDICTED], work[_LARGEST], work[_BOUNDED]
    end = len(noise)
    for i in range(len(noise)):
        now = len(phi) - len(noise) + i
        a1 = c1[np.uintp(i * (len(c1) > 1))] * delayed(phi, now, arms[0], i)
        a2 = c2[np.uintp(i * (len(c2) > 1))] * delayed(phi, now, arms[1], i)
        given = noise[np.uintp(i)]
        # x = given - predicted - now1 (x - a1) - now2 (x - a2), solved for x.
        x = (given + (now1 * a1 + now2 * a2) - predicted) * inverse
        u1, u2 = x - a1, x - a2
        top, below, ready = work[_STATES + m - 1], 0.0, 0.0
        for j in range(m):
            q, b1, b2 = rows[j]
            old = work[_STATES + j]
            ready = old + (below - q * top)
            work[_STATES + j] = ready + (b1 * u1 + b2 * u2)
            below = old
        # What is sent next is prepared before the inputs of this sample enter.
        v, direct = top, direct1 * u1 + direct2 * u2
        for j in range(n):
            r1, r2, k, t1, t2 = sections[j]
            state = np.uintp(_STATES + m + 2 * j)
            w1, w2 = work[state], work[state + np.uintp(1)]
            new1 = w1 + (r1 * w1 - k * w2 + v)
            new2 = w2 + (r2 * w2 + w1)
            ready += t1 * new1 + t2 * new2
            v += t1 * w1 + t2 * w2
            work[state], work[state + np.uintp(1)] = new1 + direct, new2
        predicted = gain * ready + (next1 * u1 + next2 * u2)
        most = max(most, abs(given))
        if abs(x) <= most:
            bounded = float(done + i)
        elif not abs(x) <= limit * most:
            end = i
            break
        phi[np.uintp(now)] = x
    work[_PREDICTED], work[_LARGEST], work[_BOUNDED] = predicted, most, bounded
    return end


def _without_dead_time(loop: Loop, sample_rate: float) -> Loop:
    """Return the loop, or raise if it has a dead time."""
    if checked_loop(loop).delay:
        phase = np.pi * sample_rate * loop.delay
        raise ValueError(
            f"loop must have no dead time to be simulated, got delay = {loop.delay} s; "
            f"loop.replace(delay=0.0) neglects it, which changes the phase of L by "
            f"{phase:.3g} rad at {0.5 * sample_rate:g} Hz, the highest frequency simulated, "
            f"and by less below"
        )
    return loop


def _delays(loop: Loop, sample_rate: float) -> list[Delay]:
    """Return the loop's own delays in samples."""
    return [lagrange_delay(n, getattr(loop, n), sample_rate) for n in ("tau1", "tau2")]


def sampled_open_loop(
    loop: Loop,
    omega: npt.ArrayLike,
    *,
    c1: float = 1.0,
    c2: float = 1.0,
    sample_rate: float = 200.0,
) -> ComplexArray:
    r"""Open loop of a simulation, in closed form.

    With the sampling step T, and the weights :math:`\ell_{k,i}` that interpolate the delay of
    arm k from the samples :math:`f_k + i` back, it is

    .. math::

        L_T(\omega) &= K(\mathrm{j}\Omega) \sum_{k=1}^{2} m_k(\mathrm{j}\Omega)
        \left( 1 - c_k H_k(\omega) \right) , \\
        \Omega &= \frac{2}{T} \tan \frac{\omega T}{2} , \\
        H_k(\omega) &= \sum_i \ell_{k,i}\, e^{-\mathrm{j}\omega (f_k + i) T} .

    A delay of whole samples has :math:`H_k(\omega) = e^{-\mathrm{j}\omega\tau_k}`.

    Parameters
    ----------
    loop : Loop
        The loop, without dead time.
    omega : array_like of float
        In rad/s, positive.
    c1, c2 : float, optional
        Constant perturbations.
    sample_rate : float, optional
        In Hz.

    Returns
    -------
    complex array, shaped like `omega`

    Raises
    ------
    TypeError, ValueError
        If a frequency is not finite, real and positive, or as for `Simulation`.

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
    loop = _without_dead_time(loop, rate)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    omega = positive_array("omega", omega)
    back1, back2 = (
        np.exp(-1j * omega[..., None] * (first + np.arange(len(weights))) / rate) @ weights
        for first, weights in _delays(loop, rate)
    )
    s = 1j * warped(omega, rate)
    m1, m2 = loop.mapping.weights(s)
    return np.asarray(loop.controller(s) * (m1 * (1.0 - c1 * back1) + m2 * (1.0 - c2 * back2)))


class Simulation:
    r"""A loop that is run block by block, and remembers where it is.

    Parameters
    ----------
    loop : Loop
        The loop, without dead time.
    sample_rate : float, optional
        In Hz.
    history : float or array_like, optional
        Noise of the locked laser before the first sample, the latest value last: a constant, or
        a series that is as long as the longest delay. Controller and sensor start at rest.
    limit : float, optional
        The run has diverged when the output exceeds the largest input so far, noise or history,
        by this factor.

    Attributes
    ----------
    samples : int
        Number of samples computed so far.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no loop or has a dead time, the sample rate is too low for its delays, or
        the history is too short or not finite.

    Notes
    -----
    With :math:`\varphi_0` the noise of the free-running laser, and with r the part of the
    controller's output that earlier samples determine, a sample is

    .. math::

        a_k[n] &= c_k[n] \sum_i \ell_{k,i}\, \varphi[n - f_k - i] , \\
        \varphi[n] &= \frac{\varphi_0[n] - r[n] + g \left( d_1 a_1[n] + d_2 a_2[n] \right)}
        {1 + g \left( d_1 + d_2 \right)} .

    Here g is the gain of the sampled controller, and d_k are the direct shares of the arms in
    the sensor's output. The weights :math:`\ell_{k,i}` are those of `sampled_open_loop`.

    One call and many give the same samples, bit by bit. ``copy.deepcopy(run)`` and
    ``pickle.dumps(run)`` keep the state. After a gap in the input a run continues as if there
    were none.

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
    ) -> None:
        self.sample_rate = positive_number("sample_rate", sample_rate)
        self.loop = _without_dead_time(loop, self.sample_rate)
        self.limit = positive_number("limit", limit)
        self.samples = 0
        self._stopped: tuple[float, float] | None = None
        self._sensor, self._controller = sampled_loop(
            loop.controller, loop.mapping, self.sample_rate
        )
        states = len(self._sensor.states) + 2 * len(self._controller.sections)
        self._work = np.zeros(_STATES + states)
        needed = max(map(reach, _delays(loop, self.sample_rate)))
        check_memory("sample_rate", (needed,), 8)
        before = finite_series("history", history, 0, 1)
        if before.ndim and before.size < needed:
            raise ValueError(
                f"history must hold at least {needed} samples, as far as the longest delay "
                f"reaches, got {before.size}"
            )
        self._past = before.copy() if before.ndim else np.full(needed, before)
        # A constant history has no beginning.
        self._endless = not before.ndim

    def advance(
        self,
        noise: npt.ArrayLike,
        *,
        c1: npt.ArrayLike = 1.0,
        c2: npt.ArrayLike = 1.0,
        tau1: GivenDelay | None = None,
        tau2: GivenDelay | None = None,
    ) -> FloatArray:
        """Compute the next block.

        Parameters
        ----------
        noise : array_like, shape (n,)
            Noise of the free-running laser; the output has its unit.
        c1, c2 : float or array_like, shape (n,), optional
            Multiplicative perturbations.
        tau1, tau2 : float, array_like, shape (n,), or callable, optional
            Round-trip delays of the arms in s, in place of the loop's own. A callable takes an
            array of times in s since the first sample of the run.

        Returns
        -------
        float array, shape (n,)
            Noise of the locked laser.

        Raises
        ------
        TypeError, ValueError
            If an argument is not finite and real, has another shape, or was drawn at another
            sample rate. If a delay is shorter than four samples though not constant, reaches
            back past the history, or changes faster than light allows. Nothing is computed.
        DivergenceError
            If the output exceeds its limit. The run cannot be continued.
        """
        given = self._series("noise", noise)
        inputs = given, self._series("c1", c1, given), self._series("c2", c2, given)
        time = np.arange(self.samples, self.samples + given.size) / self.sample_rate
        arms = self._arms(tau1, tau2, time)
        if self._stopped is not None:
            raise DivergenceError(*self._stopped, np.empty(0))
        if not given.size:
            return np.empty(0)
        known = self._past.size
        phi, work = np.empty(known + given.size), self._work.copy()
        phi[:known] = self._past
        if not self.samples:
            work[_LARGEST] = np.abs(self._past).max()
        sampled = self._sensor, self._controller
        end = _compute(phi, inputs, arms, *sampled, work, self.limit, self.samples)
        self.samples, self._work = self.samples + end, work
        if end < given.size:
            self._stopped = work[_BOUNDED] / self.sample_rate, self.samples / self.sample_rate
            raise DivergenceError(*self._stopped, phi[known : known + end].copy())
        keep = max(known, max(map(longest, arms)) + _SPARE)
        self._past, self._endless = phi[-keep:].copy(), False
        return phi[known:]

    def _series(
        self, name: str, value: npt.ArrayLike, like: FloatArray | None = None
    ) -> FloatArray:
        """Return a finite series, or a number or a series that has the shape of another."""
        rate = getattr(value, "sample_rate", None)
        if rate not in (None, self.sample_rate):
            raise ValueError(
                f"{name} must have the sample rate of the simulation, {self.sample_rate:g} Hz; "
                f"it was drawn at {rate:g} Hz"
            )
        array = np.asarray(finite_series(name, value, *([1] if like is None else [0, 1])))
        if like is not None and array.shape not in ((), like.shape):
            raise ValueError(
                f"{name} must be a number or have the shape of noise, {like.shape}; got "
                f"{array.shape}"
            )
        return np.require(np.atleast_1d(array), requirements=["C", "W"])

    def _arms(
        self, tau1: GivenDelay | None, tau2: GivenDelay | None, time: FloatArray
    ) -> tuple[AnyDelay, AnyDelay]:
        """Return the delays of both arms during a block that the past covers."""
        found: list[AnyDelay] = []
        for name, tau in (("tau1", tau1), ("tau2", tau2)):
            given = getattr(self.loop, name) if tau is None else tau
            delay = arm_delay(name, given, time, self.sample_rate)
            short = (reach(delay) if time.size else 0) - self._past.size
            if short > 0 and not self._endless:
                begins = (self.samples - self._past.size) / self.sample_rate
                raise ValueError(
                    f"{name} must not reach back past the history, which begins at t = "
                    f"{begins:.9g} s, at t = {self.samples / self.sample_rate:.9g} s"
                )
            if short > 0:
                check_memory(name, (self._past.size + short,), 8)
                self._past = np.append(np.full(short, self._past[0]), self._past)
            found.append(delay)
        return found[0], found[1]


def simulate(
    loop: Loop,
    noise: npt.ArrayLike,
    *,
    c1: npt.ArrayLike = 1.0,
    c2: npt.ArrayLike = 1.0,
    sample_rate: float = 200.0,
    tau1: GivenDelay | None = None,
    tau2: GivenDelay | None = None,
    history: npt.ArrayLike = 0.0,
    limit: float = LIMIT,
) -> FloatArray:
    r"""Run a loop, and return the frequency noise of the locked laser.

    From the noise :math:`\varphi_0` of the free-running laser it computes the solution of

    .. math::

        \varphi(t) &= \varphi_0(t) - K \left[ m_1 u_1 + m_2 u_2 \right](t) , \\
        u_k(t) &= \varphi(t) - c_k(t)\, \varphi(t - \tau_k(t)) .

    Parameters
    ----------
    loop : Loop
        For instance `paper_loop()`; without dead time.
    noise : array_like, shape (n,)
        Frequency noise of the free-running laser, for instance in Hz.
    c1, c2 : float or array_like, shape (n,), optional
        Multiplicative perturbations of the two arms.
    sample_rate : float, optional
        In Hz.
    tau1, tau2 : float, array_like, shape (n,), or callable, optional
        Round-trip delays of the arms in s, in place of the loop's own; see
        `Simulation.advance`.
    history, limit
        As for `Simulation`.

    Returns
    -------
    float array, shape (n,)
        In the unit of `noise`.

    Raises
    ------
    TypeError, ValueError
        As for `Simulation` and `Simulation.advance`.
    DivergenceError
        If the output exceeds its limit. An unstable loop that has not grown so far by the end
        of the run returns its output: count roots to decide stability.

    Notes
    -----
    An arm returns c(t) times the signal as it was tau(t) ago. For a phase this is all that a
    moving arm does. For a frequency the arm returns :math:`(1 - \dot\tau)\, \nu(t - \tau)`, and
    c has to hold the factor :math:`1 - \dot\tau`.

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
    run = Simulation(loop, sample_rate, history=history, limit=limit)
    return run.advance(noise, c1=c1, c2=c2, tau1=tau1, tau2=tau2)
