"""What noise is left on the locked laser, source by source.

Levels are those of the LISA Frequency Control White Paper (2009), Sec. 3. Each source reaches
the laser through the closed-form responses of `armlock.performance.transfer`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from armlock.checks import (
    FloatArray,
    axis,
    positive_array,
    real_array,
)
from armlock.controllers import Controller
from armlock.loops import Loop, checked_loop
from armlock.performance.transfer import responses
from armlock.timedomain.noise import LaserNoise, ShapedNoise

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Shot noise of one link in cycles/sqrt(Hz); a round trip has two, independent.
SHOT_NOISE = 10e-6
#: Fractional frequency noise of a clock at 1 Hz in 1/sqrt(Hz); it falls as 1/sqrt(f).
CLOCK_NOISE = 2.4e-12
#: Doppler shifts of the two arms' beat notes in Hz, which the clock noise comes with.
BEAT_NOTES = (15e6, -14e6)
#: Motion of a spacecraft along one arm in cycles/sqrt(Hz), at low frequency.
SPACECRAFT_MOTION = 2.5e-3
#: Corner in Hz of the roll-off 1/sqrt(1 + (f / corner)^4) of that motion.
MOTION_CORNER = 0.3
#: Noise of a free-running laser at 1 Hz in Hz/sqrt(Hz); it falls as 1/f. The paper's is
#: `armlock.paper.LASER_NOISE`.
FREE_RUNNING = 3e4
#: What disturbs the locked laser.
SOURCES = ("laser", "shot", "clock", "motion")

# Rational functions of s whose magnitudes are the densities of an arm's noises, in Hz/sqrt(Hz);
# of the clocks' for a beat note of 1 Hz. The zero of the others turns cycles into Hz.
_SHOT = Controller((0.0,), (), np.sqrt(2.0) * SHOT_NOISE)
_CORNER = 2.0 * np.pi * MOTION_CORNER * np.exp(0.75j * np.pi)
_MOTION = Controller(
    (0.0,), (_CORNER, _CORNER.conjugate()), SPACECRAFT_MOTION * abs(_CORNER) ** 2
)
# Two poles a decade from 1 uHz on, each with a zero midway to the next, fall as 1/sqrt(f).
_POLES = -2.0 * np.pi * 10.0 ** (0.5 * np.arange(20) - 6.0)
_ZEROS = 10.0**0.25 * _POLES
# Not a controller's value: to import the package must compile nothing.
_AT_1_HZ = np.prod((2j * np.pi - _ZEROS) / (2j * np.pi - _POLES))
_CLOCK = Controller(_ZEROS.tolist(), _POLES.tolist(), CLOCK_NOISE / abs(_AT_1_HZ))


def free_running(frequency: FloatArray) -> FloatArray:
    """Return the noise of a free-running laser in Hz/sqrt(Hz): 30 kHz at 1 Hz, as 1/f."""
    return FREE_RUNNING / frequency


def cavity(frequency: FloatArray) -> FloatArray:
    """Return the noise of a cavity-stabilised laser in Hz/sqrt(Hz)."""
    return 30.0 * np.sqrt(1.0 + (3e-3 / frequency) ** 4)


def mach_zehnder(frequency: FloatArray) -> FloatArray:
    """Return the noise of a laser stabilised to a Mach-Zehnder interferometer in Hz/sqrt(Hz).

    Two readouts of 1 pm/sqrt(Hz), over a path difference of 0.5 m; as the source has it in
    Sec. 2.5 but for its loop, of 20 Hz, which gives the free-running laser back above.
    """
    return 800.0 * np.sqrt(1.0 + (2.8e-3 / frequency) ** 4)


def tdi_capability(frequency: FloatArray) -> FloatArray:
    """Return the laser noise in Hz/sqrt(Hz) that time-delay interferometry can remove."""
    return 300.0 * (1.0 + (3e-3 / frequency) ** 2)


#: Laser noises by name, as functions of the frequency in Hz.
LASERS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "free-running": free_running,
    "Mach-Zehnder": mach_zehnder,
    "cavity": cavity,
}


@dataclass(frozen=True, eq=False)
class NoiseBudget:
    """Amplitude spectral densities at the locked laser, one-sided, in Hz/sqrt(Hz).

    Attributes
    ----------
    frequency : float array, shape (n,)
        In Hz.
    sources : dict of str to float array, shape (n,)
        What each source leaves on the locked laser: "laser", "shot", "clock", "motion".
    requirement : float array, shape (n,)
        What the total is held against.

    Examples
    --------
    >>> from armlock import NoiseBudget, flight_loop, noise_budget
    >>> isinstance(noise_budget(flight_loop(), [1e-3, 1e-2]), NoiseBudget)
    True
    """

    frequency: FloatArray
    sources: dict[str, FloatArray]
    requirement: FloatArray

    @property
    def total(self) -> FloatArray:
        """All sources together: they are independent."""
        return np.asarray(np.sqrt(sum(asd**2 for asd in self.sources.values())))

    @property
    def factor(self) -> FloatArray:
        """How many times the total lies below the requirement."""
        return self.requirement / self.total

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the sources, the total and the requirement over frequency.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.

        Returns
        -------
        matplotlib Axes
        """
        import matplotlib.pyplot as plt

        ax = plt.gca() if ax is None else ax
        for line, (name, asd) in zip(("-", "--", "-.", ":"), self.sources.items(), strict=True):
            ax.loglog(self.frequency, asd, line, linewidth=0.9, label=name)
        ax.loglog(self.frequency, self.total, color="black", linewidth=1.4, label="total")
        ax.loglog(
            self.frequency, self.requirement, color="0.5", dashes=(6, 2), label="required"
        )
        ax.set(xlabel="frequency [Hz]", ylabel=r"frequency noise [Hz/$\sqrt{\mathrm{Hz}}$]")
        return ax


def _densities(name: str, value: npt.ArrayLike, frequency: FloatArray) -> FloatArray:
    """Return densities at the frequencies, or raise."""
    asd = real_array(name, value)
    if (asd < 0.0).any():
        raise ValueError(f"{name} must not be negative, got {asd.min()} among its values")
    if asd.shape not in ((), frequency.shape):
        raise ValueError(
            f"{name} must be one number or hold one a frequency, {frequency.size} of them; got "
            f"shape {asd.shape}"
        )
    return np.asarray(np.broadcast_to(asd, frequency.shape))


def noise_budget(
    loop: Loop,
    frequency: npt.ArrayLike,
    laser: str | npt.ArrayLike = "free-running",
    requirement: npt.ArrayLike | None = None,
) -> NoiseBudget:
    r"""Compute what noise is left on the locked laser.

    .. math::

        \phi = S\, \phi_L + Y_1 N_1 + Y_2 N_2 , \qquad
        N_k = N_{S,k} + N_{C,k} + N_{X,k}

    with S and Y of `transfer`, and, in cycles,

    .. math::

        N_{S,k} &= \text{two links of } 10^{-5} / \sqrt{\mathrm{Hz}} , \\
        N_{C,k} &= \Delta_k \frac{y_0 + y_k}{2\pi f} , \quad
        y = 2.4 \cdot 10^{-12} f^{-1/2} / \sqrt{\mathrm{Hz}} , \\
        N_{X,k} &= X_0 \left( 1 + e^{-s\tau_k} \right) + 2 X_k .

    The clock and the motion of the spacecraft with the laser, index 0, act on both arms.

    Parameters
    ----------
    loop : Loop
        The loop, at c1 = c2 = 1.
    frequency : array_like of float, one-dimensional
        In Hz, positive.
    laser : {"free-running", "Mach-Zehnder", "cavity"} or array_like of float, optional
        Noise of the laser before it is locked, in Hz/sqrt(Hz): by name, or a value a frequency.
    requirement : array_like of float, optional
        What the total is held against, a value a frequency in Hz/sqrt(Hz); by default the
        capability of time-delay interferometry, 300 (1 + (3 mHz / f)^2).

    Returns
    -------
    NoiseBudget

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, the frequencies are not positive and one-dimensional, there is
        no laser of that name, or densities are negative or not of the frequencies' shape.

    References
    ----------
    LISA Frequency Control White Paper (2009), Sec. 3.

    Examples
    --------
    >>> from armlock import flight_loop, noise_budget
    >>> found = noise_budget(flight_loop(), [3e-3])
    >>> print(f"{found.total[0]:.0f} Hz/sqrt(Hz), {found.factor[0]:.1f} times below")
    113 Hz/sqrt(Hz), 5.3 times below
    """
    f = axis("frequency", positive_array("frequency", frequency))
    if isinstance(laser, str):
        if laser not in LASERS:
            raise ValueError(f"laser must be one of {', '.join(LASERS)}; got {laser!r}")
        laser = LASERS[laser](f)
    s = 2j * np.pi * f
    found = responses(loop, s)
    arms = np.array([found["arm 1"], found["arm 2"]])
    beats, tau = np.array(BEAT_NOTES)[:, None], np.array([[loop.tau1], [loop.tau2]])

    def through(shared: npt.ArrayLike, own: npt.ArrayLike) -> FloatArray:
        """Return the response to one noise in both arms and one in each, by their weights."""
        together = np.abs(np.sum(shared * arms, axis=0))
        return np.asarray(np.hypot(together, np.linalg.norm(own * arms, axis=0)))

    sources = {
        "laser": np.abs(found["laser"]) * _densities("laser", laser, f),
        "shot": np.abs(_SHOT(s)) * through(0.0, 1.0),
        "clock": CLOCK_NOISE / np.sqrt(f) * through(beats, beats),
        "motion": np.abs(_MOTION(s)) * through(1.0 + np.exp(-s * tau), 2.0),
    }
    required = tdi_capability(f) if requirement is None else requirement
    return NoiseBudget(f, sources, _densities("requirement", required, f))


def noise_series(
    loop: Loop, source: str, samples: int, seed: int, sample_rate: float = 200.0
) -> FloatArray:
    r"""Draw one source of the budget, as a noise of the laser that drives a simulation.

    With N_1 and N_2 as in `noise_budget`, what adds to the arms acts as a laser's noise that
    has gone through the controller and the sensor's weights,

    .. math::

        \phi_L = -K m_1 N_1 - K m_2 N_2 .

    Parameters
    ----------
    loop : Loop
        The loop; its dead time is left out of K.
    source : {"laser", "shot", "clock", "motion"}
        The source; the laser is the free-running one.
    samples : int
        How many.
    seed : int
        Of the random numbers; sources with the same seed are independent.
    sample_rate : float, optional
        In Hz.

    Returns
    -------
    float array, shape (samples,)
        In Hz, for `armlock.simulate`, from rest at time zero.

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, there is no such source, or a number is out of range. All but
        the laser's noise, which asks nothing of the loop, need open-loop poles left of s = 0,
        or it grows without end, and shot noise an open loop that rolls off.

    Notes
    -----
    All filters are rational but for the clocks' 1/sqrt(f), which twenty pairs of poles and
    zeros from 1 uHz on follow to 4e-4 between 0.1 mHz and 10 Hz.

    Examples
    --------
    >>> from armlock import flight_loop, simulate
    >>> from armlock.performance.budget import noise_series
    >>> loop = flight_loop()
    >>> locked = simulate(loop, noise_series(loop, "clock", 10_000, seed=1))
    """
    checked_loop(loop)
    if source not in SOURCES:
        raise ValueError(f"source must be one of {', '.join(SOURCES)}; got {source!r}")
    streams = np.random.SeedSequence([seed, SOURCES.index(source)]).generate_state(3).tolist()
    if source == "laser":
        laser = LaserNoise(streams[0], sample_rate, level=FREE_RUNNING, at_rest=True)
        return laser.draw(samples)

    def drawn(shape: Controller, stream: int) -> FloatArray:
        noise = ShapedNoise(
            shape.zeros, shape.poles, shape.gain,
            seed=stream, sample_rate=sample_rate, at_rest=True,
        )  # fmt: skip
        return noise.draw(samples)

    total = np.zeros(samples)
    rest, *arms = loop.polynomials()
    delays = loop.tau1, loop.tau2
    for b, tau, beat, own in zip(arms, delays, BEAT_NOTES, streams[1:], strict=True):
        gain = -float(b.coefficients[-1] / rest.coefficients[-1])
        if not gain:
            continue
        arm = Controller(b.roots.tolist(), rest.roots.tolist(), gain)
        if source == "shot":
            total += drawn(_SHOT * arm, own)
        elif source == "clock":
            total += beat * (drawn(_CLOCK * arm, streams[0]) + drawn(_CLOCK * arm, own))
        else:
            here = drawn(_MOTION * arm, streams[0])
            total += here + 2.0 * drawn(_MOTION * arm, own)
            late = total[round(tau * sample_rate) :]
            late += here[: late.size]
    return total
