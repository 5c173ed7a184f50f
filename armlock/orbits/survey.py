"""A loop along an orbit: everything that its half difference decides, in one result."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from armlock.checks import FloatArray, real_number
from armlock.orbits.constellation import SPEED_OF_LIGHT, Constellation
from armlock.orbits.passages import (
    DAY,
    YEAR,
    Course,
    Hold,
    LoopInOrbit,
    days,
    half_difference,
    held_range,
    largest_half,
    lost,
    policies,
    switches,
)
from armlock.orbits.tdi import flexing, ranging_residual
from armlock.performance.budget import free_running
from armlock.performance.pulling import Peak, largest_pulling
from armlock.performance.transfer import transfer

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# X2 is told at this frequency, in Hz, for a ranging error of so many metres.
_FREQUENCY, _RANGING_ERROR = 3e-3, 1.0
# The edges are found with this share of the largest half difference held.
_SHARE = 0.25
# A master is kept while its half difference is above this share of what some master always has.
_FLOOR = 0.9


@dataclass(frozen=True, eq=False)
class Survey:
    """What a loop meets along an orbit, from `survey`.

    Attributes
    ----------
    loop : callable
        The loop, of tau1, tau2 and held.
    orbits : Constellation
        The orbits.
    master : int
        The spacecraft with the locked laser.
    halves : dict of int to Course
        Half differences by master.
    edges : tuple of two floats
        Between which true over held half differences the loop is stable: certified on the arms
        with the largest one, with a quarter of it held, and taken for all other arms and held
        values.
    lost : dict of str to list of Hold
        Stretches without a stable loop, by policy.
    floor, floor_time : float
        The size in s above which the half difference of some master always is, and when it
        is no larger.
    switches : list of (float, int)
        From when on which master is taken, for nine tenths of that size.
    common, differential : Peak
        The largest pulling by 1 Hz in the sum of the arms' Doppler errors, and in their
        difference at the largest half difference. The latter grows as one over it.
    largest : float
        The largest half difference in s, in magnitude.
    """

    loop: LoopInOrbit
    orbits: Constellation
    master: int
    halves: dict[int, Course]
    edges: tuple[float, float]
    lost: dict[str, list[Hold]]
    floor: float
    floor_time: float
    switches: list[tuple[float, int]]
    common: Peak
    differential: Peak
    largest: float

    @property
    def half(self) -> Course:
        """The half difference of the chosen master."""
        return self.halves[self.master]

    @property
    def years(self) -> float:
        """How many years are surveyed."""
        return (self.half.stop - self.half.start) / YEAR

    def _times(self, number: int) -> FloatArray:
        """Return times in s at which X2 can be had: an hour within the orbits' span."""
        return np.linspace(self.half.start + 3700.0, self.half.stop - 3700.0, number)

    def pulled(self, t: FloatArray) -> FloatArray:
        """Return the largest pulling in Hz by 1 Hz in the difference, at times in s."""
        return self.differential.size * self.largest / np.abs(self.half(t))

    def x2(self, t: FloatArray) -> FloatArray:
        """Return X2 of the locked free-running laser at 3 mHz, in Hz/sqrt(Hz), at times in s.

        For an error of 1 m in the range of arm 1, and for the moving arms with exact ranging,
        which add up at worst.
        """
        omega, noise = 2.0 * np.pi * _FREQUENCY, float(free_running(np.array(_FREQUENCY)))
        tau1, tau2 = self.orbits.round_trips(t, self.master)
        ranging = ranging_residual(omega, tau1, tau2, _RANGING_ERROR / SPEED_OF_LIGHT)[1]
        moving = omega * np.abs(flexing(self.orbits, t, 2, self.master))
        locked = [
            abs(transfer(self.loop(one, two, 0.5 * (one - two)), "laser", 1j * omega))
            for one, two in zip(tau1.tolist(), tau2.tolist(), strict=True)
        ]
        return (ranging + moving) * np.array(locked) * noise

    def __str__(self) -> str:
        """Say all of it, a line each."""
        low, high = self.edges
        standing = {True: "", False: " (not certified)"}
        lines = [
            f"epoch: {self.orbits.epoch} ({self.orbits.scale})",
            f"master {self.master}, {self.years:.2f} years, half difference up to "
            f"{1e3 * self.largest:.2f} ms, {self.half.times().size} zeros",
            f"stable for true/held from {low:.5g} to {high:.5g} (certified)",
            f"with {1e3 * _SHARE * self.largest:.2f} ms held, where the arms differ most; "
            f"taken for all others",
            "",
            f"{'held value':15s} {'stable days a year':>18s} {'outages':>8s} {'longest':>10s}",
        ]
        for name, stretches in self.lost.items():
            joined = outages(stretches)
            longest = max((stop - start for start, stop in joined), default=0.0) / DAY
            share = 365.25 - days(stretches) / self.years
            lines.append(f"{name:15s} {share:18.3f} {len(joined):8d} {longest:8.2f} d")
        plan = ", ".join(f"{t / DAY:.1f}: {master}" for t, master in self.switches)
        t = self._times(400)
        x2 = self.x2(t)
        lines += [
            "",
            f"switching the master keeps the half difference above {1e3 * self.floor:.3f} ms "
            f"(least on day {self.floor_time / DAY:.1f});",
            f"for {100 * _FLOOR:.0f} % of it {len(self.switches) - 1} switches, day: master",
            *wrap(plan, 78),
            "",
            f"pulling by 1 Hz in the sum: {self.common.size:.4g} Hz after "
            f"{self.common.time:.4g} s{standing[self.common.certified]}",
            f"pulling by 1 Hz in the difference: {self.differential.size:.4g} Hz after "
            f"{self.differential.time:.4g} s{standing[self.differential.certified]}, "
            f"at {1e3 * self.largest:.2f} ms; as 1/half else",
            "both are the largest of samples between 1 s and 20 d: that none is larger is not "
            "certified",
            f"X2 at 3 mHz, free-running laser, 1 m: {x2.min():.3g} to {x2.max():.3g} "
            f"Hz/sqrt(Hz) at {t.size} times",
        ]
        return "\n".join(lines)

    def plot(self) -> Figure:
        """Draw half differences, outages, pulling and X2 along the orbit.

        Returns
        -------
        Figure
        """
        import matplotlib.pyplot as plt

        t = self._times(3000)
        years = t / YEAR
        fig, (top, outage, pull, x2) = plt.subplots(4, 1, figsize=(6.4, 9.0), sharex=True)
        for (master, half), style in zip(self.halves.items(), ("-", "--", ":"), strict=True):
            top.plot(years, 1e3 * half(t), style, label=f"master {master}")
        top.set(ylabel="half difference [ms]")
        top.legend(ncols=3)
        for row, (name, stretches) in enumerate(self.lost.items()):
            spans = [
                (start / YEAR, (stop - start) / YEAR) for start, stop in outages(stretches)
            ]
            outage.broken_barh(spans, (row - 0.35, 0.7), color="C1", label=name)
        outage.set_yticks(range(len(self.lost)), list(self.lost))
        outage.set(ylim=(len(self.lost) - 0.5, -0.5))
        pull.semilogy(years, self.pulled(t))
        pull.set(ylabel="pulling by 1 Hz [Hz]")
        some = t[::6]
        x2.plot(some / YEAR, self.x2(some))
        x2.set(xlabel="time [years]", ylabel="X2 at 3 mHz [Hz/√Hz]")
        return fig


def outages(stretches: list[Hold]) -> list[tuple[float, float]]:
    """Return lost stretches as (start, stop), those that touch as one."""
    found: list[tuple[float, float]] = []
    for start, stop, _ in stretches:
        if found and start - found[-1][1] < 1e-3:
            found[-1] = found[-1][0], stop
        else:
            found.append((start, stop))
    return found


def survey(
    loop: LoopInOrbit,
    orbits: Constellation,
    start: float | None = None,
    stop: float | None = None,
    master: int = 1,
) -> Survey:
    """Follow a loop along an orbit.

    Parameters
    ----------
    loop : callable
        From tau1, tau2 and the held half difference, all in s, to a `Loop`.
    orbits : Constellation
        The orbits.
    start, stop : float, optional
        In s since their epoch. By default all that a table holds, and a year of Kepler's.
    master : {1, 2, 3}, optional
        The spacecraft with the locked laser.

    Returns
    -------
    Survey

    Raises
    ------
    TypeError, ValueError
        If the times are outside of the orbits' span or not in order, or the loop is no
        callable or not stable with the true half difference held.
    """
    if not callable(loop):
        raise TypeError(f"loop must be a function of tau1, tau2 and held, got {loop!r}")
    first, last = orbits.span
    start = max(first, 0.0) if start is None else real_number("start", start)
    if stop is None:
        stop = start + YEAR if first < 0.0 else last
    if not first <= start < real_number("stop", stop) <= last:
        raise ValueError(
            f"start and stop must ascend within the span {first} to {last} s, got {start} and "
            f"{stop}"
        )
    half = half_difference(orbits, master, start, stop)
    halves = {k: half_difference(orbits, k, start, stop) for k in (1, 2, 3)}
    _, at = half.largest()
    tau1, tau2 = map(float, orbits.round_trips(at, master))
    held = 0.5 * (tau1 - tau2)
    # Upper edges matter where the held value is small: then at half differences that occur.
    edges = held_range(loop, _SHARE * held, 0.5 * (tau1 + tau2), precision=1e-5)
    gone = {name: lost(half, holds, edges) for name, holds in policies(half).items()}
    floor, floor_time = largest_half(halves)
    plan = switches(halves, _FLOOR * floor)
    there = loop(tau1, tau2, held)
    common, differential = (largest_pulling(there, s) for s in ("common", "differential"))
    return Survey(
        loop,
        orbits,
        master,
        halves,
        edges,
        gone,
        floor,
        floor_time,
        plan,
        common,
        differential,
        abs(held),
    )
