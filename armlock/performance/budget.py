"""Noise of the locked laser, source by source.

Levels are those of the LISA Frequency Control White Paper (2009), Sec. 3. Each source reaches
the laser through the closed-form responses of `armlock.performance.transfer`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, axis, finite_series, not_negative, positive_array
from armlock.loops import Loop
from armlock.performance.transfer import require_stable_loop, transfer
from armlock.tables import Shown, Table, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Levels(NamedTuple):
    """Noise levels of the white paper.

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
    """

    shot: float = 10e-6
    clock: float = 2.4e-12
    beat_notes: tuple[float, float] = (15e6, -14e6)
    motion: float = 2.5e-3
    motion_corner: float = 0.3


#: The white paper's levels, which cannot be changed.
LEVELS: Final = Levels()


def free_running(frequency: FloatArray) -> FloatArray:
    """Return the noise of a free-running laser in Hz/sqrt(Hz): 30 kHz at 1 Hz, as 1/f."""
    return 3e4 / frequency


def tdi_capability(frequency: FloatArray) -> FloatArray:
    """Return the laser noise in Hz/sqrt(Hz) that time-delay interferometry can remove."""
    return 300.0 * (1.0 + (3e-3 / frequency) ** 2)


#: Laser noises by name, as functions of the frequency in Hz.
LASERS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "free-running": free_running,
    # Two readouts of 1 pm/sqrt(Hz), over a path difference of 0.5 m (Sec. 2.5 of the source).
    # The source's loop has a bandwidth of 20 Hz, which is left out here.
    "Mach-Zehnder": lambda f: 800.0 * np.sqrt(1.0 + (2.8e-3 / f) ** 4),
    "cavity": lambda f: 30.0 * np.sqrt(1.0 + (3e-3 / f) ** 4),
}


@dataclass(frozen=True, eq=False, repr=False)
class NoiseBudget(Shown):
    """Amplitude spectral densities at the locked laser, one-sided, in Hz/sqrt(Hz).

    Attributes
    ----------
    frequency : float array, shape (n,)
        In Hz.
    sources : dict of str to float array, shape (n,)
        What each source leaves on the locked laser: "laser", "shot", "clock" and "motion".
    requirement : float array, shape (n,)
        Requirement on the total.
    free : float array, shape (n,)
        The laser without the lock.

    Examples
    --------
    >>> from armlock import NoiseBudget, flight_loop, noise_budget
    >>> isinstance(noise_budget(flight_loop(), [1e-3, 1e-2]), NoiseBudget)
    True
    """

    frequency: FloatArray
    sources: dict[str, FloatArray]
    requirement: FloatArray
    free: FloatArray

    def _table(self) -> Table:
        """Show all sources at the first, the middle and the last frequency."""
        chosen = sorted({0, self.frequency.size // 2, self.frequency.size - 1})
        series = {"free laser": self.free} | self.sources
        series |= {"total": self.total, "required": self.requirement}
        rows = [("frequency", *(number(self.frequency[k], "Hz") for k in chosen))]
        rows += [(name, *(f"{v[k]:.4g}" for k in chosen)) for name, v in series.items()]
        return Table("Noise of the locked laser in Hz/sqrt(Hz)", rows)

    @property
    def total(self) -> FloatArray:
        """All sources together, which are independent."""
        return np.asarray(np.sqrt(sum(asd**2 for asd in self.sources.values())))

    @property
    def factor(self) -> FloatArray:
        """The requirement divided by the total."""
        return self.requirement / self.total

    def plot(self, ax: Axes | None = None, *, legend: bool = True, **style: Any) -> Axes:
        """Draw the sources, the total and the requirement over frequency.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current ones by default.
        legend : bool, optional
            Name the lines.
        **style
            Style of the sources, as for `matplotlib.axes.Axes.loglog`.

        Returns
        -------
        matplotlib Axes
        """
        import matplotlib.pyplot as plt

        ax = plt.gca() if ax is None else ax
        # Below the sources: the largest of them is seen on the total.
        wide = {"color": "0.75", "linestyle": "-", "linewidth": 4.0, "label": "total"}
        ax.loglog(self.frequency, self.total, **wide)
        for line, (name, asd) in zip(cycle(("-", "--", "-.", ":")), self.sources.items()):
            shown = {"linestyle": line, "linewidth": 0.9, "label": name, **style}
            ax.loglog(self.frequency, asd, **shown)
        ax.loglog(
            self.frequency, self.requirement, color="black", dashes=(6, 2), label="required"
        )
        if legend:
            ax.legend(fontsize=8)
        ax.set(xlabel="frequency [Hz]", ylabel=r"frequency noise [Hz/$\sqrt{\mathrm{Hz}}$]")
        return ax


def noise_budget(
    loop: Loop,
    frequency: npt.ArrayLike,
    *,
    laser: Callable[[FloatArray], FloatArray] = free_running,
    shot: float = LEVELS.shot,
    clock: float = LEVELS.clock,
) -> NoiseBudget:
    r"""Compute what noise is left on the locked laser, at c1 = c2 = 1.

    If nothing else is given, the free laser has 30 kHz/sqrt(Hz) at 1 Hz and falls as 1/f. That
    is the free-running laser of the source, a thousand times the default of `LaserNoise`.

    .. math::

        \phi = S\, \phi_L + Y_1 N_1 + Y_2 N_2 , \qquad
        N_k = N_{S,k} + N_{C,k} + N_{X,k}

    with S and Y of `transfer`, and, in cycles,

    .. math::

        N_{S,k} &= \text{two links of the shot noise} , \\
        N_{C,k} &= \Delta_k \frac{y_0 + y_k}{2\pi f} , \quad
        y = y_C f^{-1/2} , \\
        N_{X,k} &= X_0 \left( 1 + e^{-s\tau_k} \right) + 2 X_k .

    The clock and the motion of the spacecraft with the laser, index 0, act on both arms.

    Parameters
    ----------
    loop : Loop
        The loop.
    frequency : array_like of float, one-dimensional
        In Hz, positive.
    laser : callable, optional
        Noise of the free laser in Hz/sqrt(Hz) as a function of the frequency in Hz, for
        instance the method ``asd`` of a `LaserNoise`. By default 30 kHz/sqrt(Hz) at 1 Hz,
        falling as 1/f. A measured table makes such a function:
        ``lambda f: numpy.interp(f, frequencies, densities)``.
    shot : float, optional
        Shot noise of one link in cycles/sqrt(Hz), 1e-5 by default.
    clock : float, optional
        Fractional frequency noise of a clock at 1 Hz in 1/sqrt(Hz), 2.4e-12 by default. It
        falls as 1/sqrt(f).

    Returns
    -------
    NoiseBudget
        With the capability of time-delay interferometry as the requirement,
        300 (1 + (3 mHz / f)^2).

    Raises
    ------
    TypeError, ValueError
        If `loop` is no `Loop` or not stable, the frequencies are not positive and
        one-dimensional, `laser` does not return a density for each frequency, or another
        level is negative.

    References
    ----------
    LISA Frequency Control White Paper (2009), Sec. 3.

    Examples
    --------
    >>> from armlock import flight_loop, noise_budget
    >>> found = noise_budget(flight_loop(), [3e-3])
    >>> print(f"{found.total[0]:.0f} Hz/sqrt(Hz), {found.factor[0]:.1f} times below")
    113 Hz/sqrt(Hz), 5.3 times below

    With the paper's laser, of 30 Hz/sqrt(Hz) at 1 Hz:

    >>> from armlock import LaserNoise
    >>> paper = LaserNoise(seed=1, sample_rate=200.0)
    >>> left = noise_budget(flight_loop(), [3e-3], laser=paper.asd).sources["laser"]
    >>> print(f"{left[0]:.2f} Hz/sqrt(Hz)")
    0.11 Hz/sqrt(Hz)

    As a table: ``pandas.DataFrame(found.sources, index=found.frequency)``.
    """
    f = axis("frequency", positive_array("frequency", frequency))
    if not callable(laser):
        raise TypeError(
            "laser must be a function of the frequency in Hz, such as the method asd of a "
            f"LaserNoise, got {laser!r:.200}"
        )
    free = finite_series("laser(frequency)", laser(f))
    if free.shape != f.shape or (free < 0.0).any():
        raise ValueError(
            "laser(frequency) must hold no negative number and have the shape of frequency, "
            f"{f.shape}, got shape {free.shape} and {free.min(initial=0.0)} as the least"
        )
    shot, clock = not_negative("shot", shot), not_negative("clock", clock)
    require_stable_loop(loop)
    s = 2j * np.pi * f
    laser_locked = transfer(loop, "laser", s)
    # As `transfer` does, but for a sign, which no power has.
    arms = np.array([laser_locked * path for path in loop.arm_responses(s)])
    beats, tau = np.array(LEVELS.beat_notes)[:, None], np.array([[loop.tau1], [loop.tau2]])
    # An arm's noise in cycles is turned into a frequency by 2 pi f.
    motion = LEVELS.motion * np.abs(s) / np.sqrt(1.0 + (f / LEVELS.motion_corner) ** 4)

    def through(shared: npt.ArrayLike, separate: npt.ArrayLike) -> FloatArray:
        """Return the response to one noise in both arms and one in each, by their weights."""
        together = np.abs(np.sum(shared * arms, axis=0))
        return np.asarray(np.hypot(together, np.linalg.norm(separate * arms, axis=0)))

    locked = {
        "laser": np.abs(laser_locked) * free,
        "shot": np.sqrt(2.0) * shot * np.abs(s) * through(0.0, 1.0),
        "clock": clock / np.sqrt(f) * through(beats, beats),
        "motion": motion * through(1.0 + np.exp(-s * tau), 2.0),
    }
    return NoiseBudget(f, locked, tdi_capability(f), free)
