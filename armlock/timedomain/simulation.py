"""The loop in the time domain, sample by sample.

With phi the frequency noise of the locked laser, every loop of `armlock.loops` reads

    phi(t) = noise(t) - K [m1 u1 + m2 u2](t),
    u_k(t) = phi(t) - c_k(t) phi(t - tau_k) + n_k(t).

Controller and sensor are sampled by the trapezoidal rule (`armlock.timedomain.discretize`). The
present phi stands on both sides with a weight of thousands, and each sample solves for it: a
rule that took the previous phi instead would be unstable. `sampled_open_loop` is the exact open
loop of the simulation.
"""

from __future__ import annotations

from collections.abc import Callable

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
from armlock.tables import Shown, Table, number
from armlock.timedomain.discretize import SampledFilter, SampledSensor, sampled_loop, warped
from armlock.timedomain.interpolation import Weights, lagrange_weights, reach

#: A round trip that changes: its delay in s at times in s, an array of shape (n,).
Moving = Callable[[FloatArray], npt.ArrayLike]
#: The output counts as diverged when it exceeds the largest input so far by this factor.
LIMIT = 1e6
# Samples computed together: the weights of arms that move are made for as many.
_TOGETHER = 1 << 16
# The numbers that a run keeps: what the controller would send with the next sample if no input
# came, the largest input so far, and the number of the last output that was not larger. The
# states of sensor and controller follow.
_PREDICTED, _LARGEST, _BOUNDED, _STATES = range(4)


class DivergenceError(ArithmeticError):
    """The output of a simulated loop has exceeded its limit.

    Attributes
    ----------
    time : float
        Begin of the divergence in s: the last time at which the output was no larger than the
        largest input so far.
    output : float array
        The samples of this call before the output exceeded the limit; all are finite.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock import DivergenceError, SingleArm, simulate
    >>> run = {"sample_rate": 200.0, "c1": 3.0, "limit": 10.0}
    >>> try:
    ...     locked = simulate(SingleArm(), np.ones(20_000), **run)
    ... except DivergenceError as error:
    ...     print(0.0 <= error.time < error.output.size / 200.0)
    True
    """

    time: float
    output: FloatArray


@njit()
def _of(series: FloatArray, i: int) -> float:
    """Return a sample of a series, or the number that stands for all samples."""
    return float(series[np.uintp(i * (len(series) > 1))])


@njit()
def _delayed(phi: FloatArray, now: int, weights: Weights, i: int) -> float:
    """Return phi as it was one delay before row `now`; i is the sample of the delay."""
    first, shares = weights
    row = np.uintp(i * (len(first) > 1))
    newest = now - first[row]
    value = shares[row, np.uintp(0)] * phi[np.uintp(newest)]
    for k in range(1, shares.shape[1]):
        value += shares[row, np.uintp(k)] * phi[np.uintp(newest - k)]
    return float(value)


@njit()
def _compute(
    phi: FloatArray,
    inputs: tuple[FloatArray, ...],
    arms: tuple[Weights, Weights],
    sensor: SampledSensor,
    controller: SampledFilter,
    work: FloatArray,
    limit: float,
    done: int,
) -> int:
    """Compute the last samples of phi from those before, one for each sample of the noise.

    `inputs` are noise, c1, c2, and what is added to the signals of both arms. `work` is
    described at `_STATES`, and `done` counts the samples of the run before this call. Returns
    the index of the sample that exceeds `limit` times the largest input, or the number of
    samples.
    """
    noise, c1, c2, added1, added2 = inputs
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
        n1, n2, given = _of(added1, i), _of(added2, i), noise[np.uintp(i)]
        a1 = _of(c1, i) * _delayed(phi, now, arms[0], i) - n1
        a2 = _of(c2, i) * _delayed(phi, now, arms[1], i) - n2
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
        most = max(most, abs(given), abs(n1), abs(n2))
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


def _constant(loop: Loop, sample_rate: float) -> list[Weights]:
    """Return the weights of the loop's own delays."""
    return [
        lagrange_weights(name, np.array(getattr(loop, name)), sample_rate)
        for name in ("tau1", "tau2")
    ]


@np.errstate(under="ignore")
def sampled_open_loop(
    loop: Loop,
    omega: npt.ArrayLike,
    *,
    sample_rate: float,
    c1: float = 1.0,
    c2: float = 1.0,
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
    sample_rate : float
        In Hz.
    c1, c2 : float, optional
        Constant perturbations.

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
    >>> bool(np.allclose(sampled_open_loop(loop, omega, sample_rate=200.0), loop(1j * omega)))
    True
    """
    rate = positive_number("sample_rate", sample_rate)
    loop = _without_dead_time(loop, rate)
    c1, c2 = real_number("c1", c1), real_number("c2", c2)
    omega = positive_array("omega", omega)
    back1, back2 = (
        np.exp(-1j * omega[..., None] * (first + np.arange(shares.size)) / rate) @ shares[0]
        for first, shares in _constant(loop, rate)
    )
    s = 1j * warped(omega, rate)
    m1, m2 = loop.mapping.weights(s)
    return np.asarray(loop.controller(s) * (m1 * (1.0 - c1 * back1) + m2 * (1.0 - c2 * back2)))


class Simulation(Shown):
    r"""A simulation of a loop, block by block, that keeps its state between blocks.

    Controller, sensor and arms start at rest.

    Parameters
    ----------
    loop : Loop
        The loop, without dead time.
    sample_rate : float
        In Hz, of all series that the run takes.
    tau1, tau2 : callable, optional
        Round-trip delays of arms that move, in place of the loop's own: functions that take an
        array of times in s since the first sample, and return the delays in s. A table of
        delays makes such a function: ``scipy.interpolate.CubicSpline(times, delays)``.
    limit : float, optional
        The run has diverged when the output exceeds the largest input so far by this factor.

    Attributes
    ----------
    samples : int
        Number of samples computed so far.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no loop or has a dead time, the sample rate is too low for its delays, or
        `tau1` or `tau2` is no function.

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

    The controller is sampled by Tustin's rule, which lowers a frequency omega of it by about
    omega^3 T^2 / 12, with the step T. So close to the stability boundary a simulation may be
    stable where the loop is not, or the reverse; half the step tells.

    One long call and many short ones give the same samples, bit by bit.
    ``copy.deepcopy(run)`` keeps the state.

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
        sample_rate: float,
        *,
        tau1: Moving | None = None,
        tau2: Moving | None = None,
        limit: float = LIMIT,
    ) -> None:
        self.sample_rate = positive_number("sample_rate", sample_rate)
        self.loop = _without_dead_time(loop, self.sample_rate)
        self.limit = positive_number("limit", limit)
        self.samples = 0
        self._moving = {"tau1": tau1, "tau2": tau2}
        for name, move in self._moving.items():
            if move is not None and not callable(move):
                raise TypeError(
                    f"{name} must be a function of the time in s, got {move!r}; "
                    f"loop.replace({name}=...) gives the loop another constant delay"
                )
        self._weights = _constant(loop, self.sample_rate)
        self._latest: dict[str, float] = {}
        self._diverged = False
        self._sensor, self._controller = sampled_loop(
            loop.controller, loop.mapping, self.sample_rate
        )
        states = len(self._sensor.states) + 2 * len(self._controller.sections)
        self._work = np.zeros(_STATES + states)
        self._past = np.empty(0)

    def _table(self) -> Table:
        """Show the rate, and how far the run is."""
        rate = number(self.sample_rate, "Hz")
        end = number(self.samples / self.sample_rate, "s")
        rows = [("sample rate", rate), ("computed", f"{self.samples} samples, {end}")]
        return Table("Simulation", rows)

    def advance(
        self,
        noise: npt.ArrayLike,
        *,
        c1: npt.ArrayLike = 1.0,
        c2: npt.ArrayLike = 1.0,
        arm1: npt.ArrayLike = 0.0,
        arm2: npt.ArrayLike = 0.0,
    ) -> FloatArray:
        """Compute the next block.

        Parameters
        ----------
        noise : array_like, shape (n,)
            Noise of the free-running laser; the output has its unit.
        c1, c2 : float or array_like, shape (n,), optional
            Multiplicative perturbations.
        arm1, arm2 : float or array_like, shape (n,), optional
            Noise that is added to the signals of the arms, in the unit of `noise`.

        Returns
        -------
        float array, shape (n,)
            Noise of the locked laser.

        Raises
        ------
        TypeError, ValueError
            If an argument is not finite and real, or has another shape: nothing is computed. If
            a delay that moves is shorter than four samples, or grows by a second a second or
            more.
        DivergenceError
            If the output exceeds its limit. The run cannot be continued.
        """
        given = self._series("noise", noise, None)
        others = {"c1": c1, "c2": c2, "arm1": arm1, "arm2": arm2}
        inputs = given, *(self._series(name, one, given) for name, one in others.items())
        output, done = np.empty(given.size), 0
        while done < given.size and not self._diverged:
            part = tuple(
                np.require(
                    series[done : done + _TOGETHER] if series.size > 1 else series,
                    requirements=["C", "W"],
                )
                for series in inputs
            )
            computed = self._advance(part)
            output[done : done + computed.size] = computed
            done += computed.size
        if self._diverged:
            began = float(self._work[_BOUNDED]) / self.sample_rate
            now = self.samples / self.sample_rate
            error = DivergenceError(
                f"the loop diverges: its output has exceeded all input since t = {began:.6g} "
                f"s, and exceeds it beyond the limit at t = {now:.6g} s"
            )
            error.time, error.output = began, output[:done].copy()
            raise error
        return output

    def _advance(self, inputs: tuple[FloatArray, ...]) -> FloatArray:
        """Compute samples that fit into memory with their delays."""
        size = inputs[0].size
        arms = self._arms(size)
        needed = max(map(reach, arms))
        check_memory("sample_rate", (needed,), 8)
        known = max(needed, self._past.size)
        phi = np.empty(known + size)
        # Before the first sample the arms are at rest.
        phi[: known - self._past.size] = 0.0
        phi[known - self._past.size : known] = self._past
        sampled = self._sensor, self._controller
        end = _compute(phi, inputs, arms, *sampled, self._work, self.limit, self.samples)
        self.samples, self._diverged = self.samples + end, end < size
        # A delay grows by less than a sample, so the next sample needs none that is older than
        # those of the last one; the 1 is for rounding.
        oldest = 1 + max(int(first[-1]) + shares.shape[1] for first, shares in arms)
        self._past = phi[-oldest:].copy()
        return phi[known : known + end]

    def _series(self, name: str, value: npt.ArrayLike, like: FloatArray | None) -> FloatArray:
        """Return a finite series in the shape of another one, or of one number for all."""
        array = np.asarray(finite_series(name, value, *([1] if like is None else [0, 1])))
        if like is None:
            return array
        if array.shape not in ((), like.shape):
            raise ValueError(
                f"{name} must be a number or have the shape of noise, {like.shape}; got "
                f"{array.shape}"
            )
        return np.atleast_1d(array)

    def _arms(self, size: int) -> tuple[Weights, Weights]:
        """Return the delays of both arms during the next samples."""
        found, latest = list(self._weights), {}
        for k, (name, move) in enumerate(self._moving.items()):
            if move is None:
                continue
            time = np.arange(self.samples, self.samples + size) / self.sample_rate
            tau = finite_series(f"{name}(t)", move(time), 1)
            if tau.shape != time.shape:
                raise ValueError(
                    f"{name}(t) must have the shape of t, {time.shape}, got {tau.shape}"
                )
            growth = np.diff(tau, prepend=self._latest.get(name, tau[0])) * self.sample_rate
            if growth.max() >= 1.0:
                at = int(growth.argmax())
                raise ValueError(
                    f"{name}(t) must grow by less than 1 s a second, got {tau[at]} s at t = "
                    f"{time[at]:.9g} s"
                )
            found[k] = lagrange_weights(f"{name}(t)", tau, self.sample_rate)
            latest[name] = float(tau[-1])
        # Both arms are as they must be.
        self._latest = latest
        return found[0], found[1]


def simulate(
    loop: Loop,
    noise: npt.ArrayLike,
    *,
    sample_rate: float,
    c1: npt.ArrayLike = 1.0,
    c2: npt.ArrayLike = 1.0,
    arm1: npt.ArrayLike = 0.0,
    arm2: npt.ArrayLike = 0.0,
    tau1: Moving | None = None,
    tau2: Moving | None = None,
    limit: float = LIMIT,
) -> FloatArray:
    r"""Run a loop, and return the frequency noise of the locked laser.

    From the noise :math:`\varphi_0` of the free-running laser it computes the solution of

    .. math::

        \varphi(t) &= \varphi_0(t) - K \left[ m_1 u_1 + m_2 u_2 \right](t) , \\
        u_k(t) &= \varphi(t) - c_k(t)\, \varphi(t - \tau_k(t)) + n_k(t) .

    Parameters
    ----------
    loop : Loop
        For instance `paper_loop()`; without dead time.
    noise : array_like, shape (n,)
        Frequency noise of the free-running laser, for instance in Hz.
    sample_rate : float
        Of the noise, of c1 and of c2, in Hz.
    c1, c2 : float or array_like, shape (n,), optional
        Multiplicative perturbations of the two arms.
    arm1, arm2 : float or array_like, shape (n,), optional
        Noise :math:`n_k` that is added to the signals of the arms, such as shot noise, in the
        unit of `noise`. `noise_budget` has its densities.
    tau1, tau2, limit
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
    >>> step = simulate(paper_loop(), np.ones(2000), sample_rate=200.0)
    >>> print(f"{step[0]:.4e}")
    9.9991e-05

    An arm that grows by 10 m a second:

    >>> drift = 2 * 10.0 / 299_792_458.0
    >>> arm = lambda t: 20.1 + drift * t
    >>> step = simulate(paper_loop(), np.ones(2000), sample_rate=200.0, tau1=arm)
    """
    run = Simulation(loop, sample_rate, tau1=tau1, tau2=tau2, limit=limit)
    return run.advance(noise, c1=c1, c2=c2, arm1=arm1, arm2=arm2)
