"""What noise is left on the locked laser, source by source.

Levels are those of the LISA Frequency Control White Paper (2009), Sec. 3, or the caller's. Each
source reaches the laser through the closed-form responses of `armlock.performance.transfer`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.checks import (
    FloatArray,
    axis,
    one_of,
    positive_array,
    real_array,
    real_number,
)
from armlock.controllers import Controller
from armlock.loops import Loop, checked_loop
from armlock.performance.transfer import responses
from armlock.timedomain.noise import LaserNoise, ShapedNoise

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Levels(NamedTuple):
    """Levels of the white paper, as they are: another level is a source of one's own.

    Attributes
    ----------
    shot : float
        Shot noise of one link in cycles/sqrt(Hz); a round trip has two, independent.
    clock : float
        Fractional frequency noise of a clock at 1 Hz in 1/sqrt(Hz); it falls as 1/sqrt(f).
    beat_notes : tuple of two float
        Doppler shifts of the two arms' beat notes in Hz, which the clock noise comes with.
    motion : float
        Motion of a spacecraft along one arm in cycles/sqrt(Hz), at low frequency.
    motion_corner : float
        Corner in Hz of the roll-off 1/sqrt(1 + (f / corner)^4) of that motion.
    free_running : float
        Noise of a free-running laser at 1 Hz in Hz/sqrt(Hz); it falls as 1/f. The paper's is
        `armlock.paper.LASER_NOISE`.
    """

    shot: float = 10e-6
    clock: float = 2.4e-12
    beat_notes: tuple[float, float] = (15e6, -14e6)
    motion: float = 2.5e-3
    motion_corner: float = 0.3
    free_running: float = 3e4


#: The white paper's levels, which cannot be changed.
LEVELS: Final = Levels()
#: What disturbs the locked laser, if nothing else is said.
SOURCES: Final = ("laser", "shot", "clock", "motion")

# Rational functions of s whose magnitudes are the densities of an arm's noises, in Hz/sqrt(Hz);
# of the clocks' for a beat note of 1 Hz. The zero of the others turns cycles into Hz.
_SHOT = Controller((0.0,), (), np.sqrt(2.0) * LEVELS.shot)
_CORNER = 2.0 * np.pi * LEVELS.motion_corner * np.exp(0.75j * np.pi)
_MOTION = Controller((0.0,), (_CORNER, _CORNER.conjugate()), LEVELS.motion * abs(_CORNER) ** 2)
# Two poles a decade from 1 uHz on, each with a zero midway to the next, fall as 1/sqrt(f).
_POLES = -2.0 * np.pi * 10.0 ** (0.5 * np.arange(20) - 6.0)
_ZEROS = 10.0**0.25 * _POLES
# Not a controller's value: to import the package must compile nothing.
_AT_1_HZ = np.prod((2j * np.pi - _ZEROS) / (2j * np.pi - _POLES))
_CLOCK = Controller(_ZEROS.tolist(), _POLES.tolist(), LEVELS.clock / abs(_AT_1_HZ))


def free_running(frequency: FloatArray) -> FloatArray:
    """Return the noise of a free-running laser in Hz/sqrt(Hz): 30 kHz at 1 Hz, as 1/f."""
    return LEVELS.free_running / frequency


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
        What each source leaves on the locked laser: "laser", "shot", "clock", "motion", and
        those of one's own.
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

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the sources, the total and the requirement over frequency.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        **style
            Of the sources, as `matplotlib.axes.Axes.loglog` takes it.

        Returns
        -------
        matplotlib Axes
        """
        import matplotlib.pyplot as plt

        ax = plt.gca() if ax is None else ax
        for line, (name, asd) in zip(cycle(("-", "--", "-.", ":")), self.sources.items()):
            shown = {"linestyle": line, "linewidth": 0.9, "label": name, **style}
            ax.loglog(self.frequency, asd, **shown)
        ax.loglog(self.frequency, self.total, color="black", linewidth=1.4, label="total")
        ax.loglog(
            self.frequency, self.requirement, color="0.5", dashes=(6, 2), label="required"
        )
        ax.set(xlabel="frequency [Hz]", ylabel=r"frequency noise [Hz/$\sqrt{\mathrm{Hz}}$]")
        return ax


def _densities(
    name: str, value: npt.ArrayLike, frequency: FloatArray, arms: int = 0
) -> FloatArray:
    """Return densities at the frequencies, or a row of them for each arm, or raise."""
    asd = real_array(name, value)
    if (asd < 0.0).any():
        raise ValueError(f"{name} must not be negative, got {asd.min()} among its values")
    rows = (arms, frequency.size)
    if asd.shape not in ((), frequency.shape, rows):
        each = f", or {arms} rows of them" if arms else ""
        raise ValueError(
            f"{name} must be one number or hold one a frequency, {frequency.size} of them"
            f"{each}; got shape {asd.shape}"
        )
    return np.asarray(np.broadcast_to(asd, rows if arms else frequency.shape))


def noise_budget(
    loop: Loop,
    frequency: npt.ArrayLike,
    laser: str | npt.ArrayLike = "free-running",
    requirement: npt.ArrayLike | None = None,
    *,
    c1: float = 1.0,
    c2: float = 1.0,
    sources: Mapping[str, npt.ArrayLike] | None = None,
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
        The loop.
    frequency : array_like of float, one-dimensional
        In Hz, positive.
    laser : {"free-running", "Mach-Zehnder", "cavity"} or array_like of float, optional
        Noise of the laser before it is locked, in Hz/sqrt(Hz): by name, or a value a frequency.
    requirement : array_like of float, optional
        What the total is held against, a value a frequency in Hz/sqrt(Hz); by default the
        capability of time-delay interferometry, 300 (1 + (3 mHz / f)^2).
    c1, c2 : float, optional
        Multiplicative perturbations.
    sources : mapping of str to array_like of float, optional
        Sources of one's own: densities in Hz/sqrt(Hz) of what adds to the signal of each arm,
        independent in the two. One number, a value a frequency, or two rows of them, for arm 1
        and arm 2. One called "shot", "clock" or "motion" takes the place of that source.

    Returns
    -------
    NoiseBudget

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop`, the frequencies are not positive and one-dimensional, there is
        no laser of that name, densities are negative or not of the frequencies' shape, c1 or c2
        is no finite real number, or `sources` has one called "laser".

    References
    ----------
    LISA Frequency Control White Paper (2009), Sec. 3.

    Examples
    --------
    >>> from armlock import flight_loop, noise_budget
    >>> found = noise_budget(flight_loop(), [3e-3])
    >>> print(f"{found.total[0]:.0f} Hz/sqrt(Hz), {found.factor[0]:.1f} times below")
    113 Hz/sqrt(Hz), 5.3 times below

    With ten times the shot noise, and a noise of one's own in arm 1 alone:

    >>> import numpy as np
    >>> f = np.array([3e-3, 0.1])
    >>> shot = 2e-4 * np.pi * f * np.sqrt(2.0)
    >>> mine = [0.01 * f, 0.0 * f]
    >>> found = noise_budget(flight_loop(), f, sources={"shot": shot, "mine": mine})
    >>> list(found.sources)
    ['laser', 'shot', 'clock', 'motion', 'mine']

    As a table: ``pandas.DataFrame(found.sources, index=found.frequency)``.
    """
    f = axis("frequency", positive_array("frequency", frequency))
    if isinstance(laser, str):
        laser = LASERS[one_of("laser", laser, LASERS)](f)
    s = 2j * np.pi * f
    found = responses(loop, s, real_number("c1", c1), real_number("c2", c2))
    arms = np.array([found["arm 1"], found["arm 2"]])
    beats, tau = np.array(LEVELS.beat_notes)[:, None], np.array([[loop.tau1], [loop.tau2]])

    def through(shared: npt.ArrayLike, separate: npt.ArrayLike) -> FloatArray:
        """Return the response to one noise in both arms and one in each, by their weights."""
        together = np.abs(np.sum(shared * arms, axis=0))
        return np.asarray(np.hypot(together, np.linalg.norm(separate * arms, axis=0)))

    locked = {
        "laser": np.abs(found["laser"]) * _densities("laser", laser, f),
        "shot": np.abs(_SHOT(s)) * through(0.0, 1.0),
        "clock": LEVELS.clock / np.sqrt(f) * through(beats, beats),
        "motion": np.abs(_MOTION(s)) * through(1.0 + np.exp(-s * tau), 2.0),
    }
    for name, given in (sources or {}).items():
        if name == "laser":
            raise ValueError("sources must not hold 'laser': its noise is given as laser=...")
        locked[name] = through(0.0, _densities(f"sources[{name!r}]", given, f, arms=2))
    required = tdi_capability(f) if requirement is None else requirement
    return NoiseBudget(f, locked, _densities("requirement", required, f))


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
    one_of("source", source, SOURCES)
    streams = np.random.SeedSequence([seed, SOURCES.index(source)]).generate_state(3).tolist()
    if source == "laser":
        laser = LaserNoise(streams[0], sample_rate, level=LEVELS.free_running, at_rest=True)
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
    for b, tau, beat, stream in zip(arms, delays, LEVELS.beat_notes, streams[1:], strict=True):
        gain = -float(b.coefficients[-1] / rest.coefficients[-1])
        if not gain:
            continue
        arm = Controller(b.roots.tolist(), rest.roots.tolist(), gain)
        if source == "shot":
            total += drawn(_SHOT * arm, stream)
        elif source == "clock":
            total += beat * (drawn(_CLOCK * arm, streams[0]) + drawn(_CLOCK * arm, stream))
        else:
            here = drawn(_MOTION * arm, streams[0])
            total += here + 2.0 * drawn(_MOTION * arm, stream)
            delayed = total[round(tau * sample_rate) :]
            delayed += here[: delayed.size]
    return total
