"""Round trips between three spacecraft, on Kepler's orbits or from a table of positions.

`kepler`, `esa` and `from_table` return a `Constellation`. Its methods give the round-trip
delays, their rates and the light times of single links. A link received at time t has the light
time l that solves

    l = d / c + (4 G M / c^3) artanh(d / (r_receiver + r_emitter)) ,
    d = |x_receiver(t) - x_emitter(t - l)| .

The second term is the Sun's Shapiro delay. The round trip that is back at time t takes
tau(t) = l_back(t) + l_out(t - l_back(t)).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from armlock.checks import (
    FloatArray,
    axis,
    finite_series,
    one_of,
    positive_number,
    real_array,
    real_number,
    whole_number,
)
from armlock.tables import Shown, Table, number

#: Speed of light in m/s.
SPEED_OF_LIGHT = 299_792_458.0
#: Astronomical unit in m.
ASTRONOMICAL_UNIT = 149_597_870_700.0
#: G M of the Sun in m^3/s^2, compatible with TCB.
SUN = 1.32712440017987e20

_SHAPIRO = 4.0 * SUN / SPEED_OF_LIGHT**3
# Each iteration of a light time gains four digits, and of Kepler's equation doubles them.
_ITERATIONS = 6
# Positions, or with 1 velocities, shape (n, 3), at times of shape (n,).
_Path = Callable[[FloatArray, int], FloatArray]
# Kepler's orbits are good to 5e-11 s within so many s of their epoch.
_KEPLER_SPAN = 3e9
# Arm 1 leads from the master to the first of these spacecraft, arm 2 to the second.
_FAR = {1: (2, 3), 2: (3, 1), 3: (1, 2)}

# Degree of the splines through a table, and the fewest states: half of them make a spline.
_DEGREE = 7
_FEWEST = 2 * (_DEGREE + 1)
# The largest step between states over the typical one: the estimate of the error comes from
# splines through every second state, whose steps are twice as long.
_LARGEST_GAP = 2.0
# The largest error of interpolation, in s of light.
_LARGEST_ERROR = 1e-5
# How far the mean speed of the spacecraft may be from that of a circle around the Sun, relative
# to it. The orbit of the Earth is within 2 %.
_SPEED = 0.05

# The first epochs of ESA's tables.
_ESA = {
    "trailing": "2036-12-09T00:00:29.327664000 TCB",
    "leading": "2037-06-11T00:00:29.574159000 TCB",
}


@dataclass(frozen=True, eq=False, repr=False)
class Constellation(Shown):
    """Three spacecraft, 1 to 3, in orbit around the Sun.

    Attributes
    ----------
    epoch : str
        The date and time scale of t = 0.
    span : tuple of two floats
        The first and last t in s at which all round trips exist.
    error : float
        How far interpolation may put a light time off, in s: the largest difference between
        the states and splines through every second state. The splines through all states are
        better, by a factor of ten for ESA's orbits. It is 0 for Kepler's orbits.
    """

    epoch: str
    span: tuple[float, float]
    error: float
    _paths: tuple[_Path, ...]

    def _table(self) -> Table:
        """Show the epoch, the span and the error."""
        first, last = (number(t / 86400.0) for t in self.span)
        rows = [
            ("t = 0", self.epoch),
            ("round trips", f"from day {first} to day {last}"),
            ("error of a light time", f"at most {number(self.error, 's')}"),
        ]
        return Table("Constellation of three spacecraft", rows)

    def round_trips(self, t: npt.ArrayLike, master: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return the delays of the two round trips that start and end at the master.

        Parameters
        ----------
        t : array_like of float
            The time at which the light is back, in s since `epoch`, of any shape.
        master : {1, 2, 3}, optional
            The spacecraft with the locked laser.

        Returns
        -------
        tau1, tau2 : float arrays, shaped like `t`
            In s. Arm 1 leads from master 1 to spacecraft 2, from 2 to 3, from 3 to 1. Arm 2
            leads to the remaining spacecraft.

        Raises
        ------
        TypeError, ValueError
            If t is not finite and real or lies outside `span`, or there is no such master.

        Examples
        --------
        >>> from armlock.orbits import kepler
        >>> tau1, tau2 = kepler().round_trips(100 * 86400.0)
        >>> print(f"{tau1:.9f} {tau2:.9f}")
        16.675856900 16.611372223
        """
        (tau1, _), (tau2, _) = self._arms(t, master)
        return tau1, tau2

    def rates(self, t: npt.ArrayLike, master: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return dtau1/dt and dtau2/dt in s/s; arguments and errors as for `round_trips`.

        An arm returns the frequency of the laser multiplied by 1 - rate, and its phase delayed.
        """
        (_, rate1), (_, rate2) = self._arms(t, master)
        return rate1, rate2

    def light_time(self, t: npt.ArrayLike, receiver: int, emitter: int) -> FloatArray:
        """Return the light time in s of what a spacecraft receives from another at t.

        Arguments and errors as for `round_trips`; `receiver` and `emitter` are two of 1, 2, 3.
        """
        receiver, emitter = _spacecraft("receiver", receiver), _spacecraft("emitter", emitter)
        t = self._within(t)
        here, there = self._paths[receiver - 1], self._paths[emitter - 1]
        return _link(here, there, t.ravel())[0].reshape(t.shape)

    def _arms(self, t: npt.ArrayLike, master: int) -> list[tuple[FloatArray, FloatArray]]:
        """Return the delay and the rate of both arms."""
        t = self._within(t)
        master = _spacecraft("master", master)
        found, here = [], self._paths[master - 1]
        for far in _FAR[master]:
            there = self._paths[far - 1]
            back, back_rate = _link(here, there, t.ravel())
            out, out_rate = _link(there, here, t.ravel() - back)
            rate = back_rate + out_rate - back_rate * out_rate
            found.append(((back + out).reshape(t.shape), rate.reshape(t.shape)))
        return found

    def _within(self, t: npt.ArrayLike) -> FloatArray:
        """Return times as an array, or raise if one lies outside the span."""
        times, (first, last) = real_array("t", t), self.span
        outside = times[(times < first) | (times > last)]
        if outside.size:
            raise ValueError(
                f"t must lie within the span {first} to {last} s, got {outside.flat[0]}"
            )
        return times


def _spacecraft(name: str, value: object) -> int:
    """Return the number of a spacecraft, or raise."""
    number = whole_number(name, value, 1)
    if number not in _FAR:
        raise ValueError(f"{name} must be 1, 2 or 3, got {value!r}")
    return number


def _link(receiver: _Path, emitter: _Path, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the light time received at times of shape (n,), and its derivative."""
    place, velocity = receiver(t, 0), receiver(t, 1)
    r = np.linalg.norm(place, axis=1)
    light = np.zeros(t.shape)
    for _ in range(_ITERATIONS):
        source = emitter(t - light, 0)
        d = np.linalg.norm(place - source, axis=1)
        both = r + np.linalg.norm(source, axis=1)
        light = d / SPEED_OF_LIGHT + _SHAPIRO * np.arctanh(d / both)
    sent = emitter(t - light, 1)
    receding, leaving = (np.vecdot(place - source, v) / d for v in (velocity - sent, sent))
    # The source moves for 1 - d'/c of each second at the receiver.
    d_rate = receding / (1.0 - leaving / SPEED_OF_LIGHT)
    both_rate = np.vecdot(place, velocity) / r + np.vecdot(source, sent) / (both - r)
    bend = (d_rate * both - d * both_rate) / (both**2 - d**2)
    return light, d_rate / SPEED_OF_LIGHT + _SHAPIRO * bend


def kepler(arm_length: float = 2.5e9, delta: float = 0.625) -> Constellation:
    """Return two-body orbits with the elements of Dhurandhar et al. (2005).

    Parameters
    ----------
    arm_length : float, optional
        Mean distance of the spacecraft in m, at most a tenth of the astronomical unit.
    delta : float, optional
        The plane of the triangle is tilted by pi/3 + delta * alpha, where alpha is half of the
        arm length in astronomical units. The arms change least at 5/8; a tilt of 60 degrees
        has delta = 0.

    Returns
    -------
    Constellation
        With t = 0 at the epoch of the elements, and a span of a century around it.

    Raises
    ------
    TypeError, ValueError
        If the arm length is not positive or too long for these elements, or delta is not
        finite.

    References
    ----------
    S. V. Dhurandhar, K. Rajesh Nayak, S. Koshti and J.-Y. Vinet, Class. Quantum Grav. 22,
    481 (2005); the elements are those that lisaorbits documents.
    """
    length = positive_number("arm_length", arm_length)
    if length > 0.1 * ASTRONOMICAL_UNIT:
        raise ValueError(
            f"arm_length must be at most {0.1 * ASTRONOMICAL_UNIT:.4g} m, a tenth of the "
            f"astronomical unit, got {length}"
        )
    alpha = length / (2.0 * ASTRONOMICAL_UNIT)
    nu = np.pi / 3.0 + real_number("delta", delta) * alpha
    paths = tuple(partial(_ellipse, alpha, nu, k * 2.0 * np.pi / 3.0) for k in range(3))
    span = (-_KEPLER_SPAN, _KEPLER_SPAN)
    return Constellation("that of the elements, TCB", span, 0.0, paths)


def _ellipse(
    alpha: float, nu: float, theta: float, t: FloatArray, derivative: int
) -> FloatArray:
    """Return the position or the velocity of the spacecraft with phase theta."""
    e = np.sqrt(1 + 4 * alpha * np.cos(nu) / np.sqrt(3) + 4 * alpha**2 / 3) - 1
    tilt = np.arctan2(alpha * np.sin(nu), np.sqrt(3) / 2 + alpha * np.cos(nu))
    a, n = ASTRONOMICAL_UNIT, np.sqrt(SUN / ASTRONOMICAL_UNIT**3)
    # The remainder keeps the digits of the phase over a century.
    mean = n * np.remainder(t, 2.0 * np.pi / n) - theta
    u = mean + e * np.sin(mean)
    for _ in range(_ITERATIONS):
        u = u - (u - e * np.sin(u) - mean) / (1.0 - e * np.cos(u))
    width = a * np.sqrt(1.0 - e**2)
    x, y = a * (np.cos(u) - e), width * np.sin(u)
    if derivative:
        du = n / (1.0 - e * np.cos(u))
        x, y = -a * np.sin(u) * du, width * np.cos(u) * du
    cosine, sine = np.cos(theta), np.sin(theta)
    flat, up = x * np.cos(tilt), -x * np.sin(tilt)
    return np.column_stack((cosine * flat - sine * y, sine * flat + cosine * y, up))


def from_table(
    time: npt.ArrayLike, positions: npt.ArrayLike, *, epoch: str = ""
) -> Constellation:
    """Return a constellation from a table of positions, by splines of degree 7.

    Parameters
    ----------
    time : array_like of float, shape (n,)
        Ascending times in s, at least 16, with no gap above twice the typical step.
    positions : array_like of float, shape (n, 3, 3)
        Positions in m from the Sun, by time, spacecraft and coordinate, in axes that do not
        rotate.
    epoch : str, optional
        The date and time scale of the first time.

    Returns
    -------
    Constellation
        With t = 0 at the first time.

    Raises
    ------
    TypeError, ValueError
        If the shape, the order or the number of the states is wrong; if there is a gap; if
        the mean of the three positions does not circle the Sun at its speed within 5 %, as in
        other units or rotating axes; or if the states are too far apart to be interpolated to
        1e-5 s of light.
    """
    time, places = axis("time", time), finite_series("positions", positions, 3)
    if places.shape != (time.size, 3, 3):
        raise ValueError(
            f"positions must have shape ({time.size}, 3, 3): by time, spacecraft and "
            f"coordinate, got {places.shape}"
        )
    if time.size < _FEWEST:
        raise ValueError(f"a table must hold at least {_FEWEST} states, got {time.size}")
    t = time - time[0]
    steps = np.diff(t)
    at = int(np.argmin(steps))
    if steps[at] <= 0.0:
        raise ValueError(f"times must ascend, got {time[at + 1]} s after {time[at]} s")
    at, typical = int(np.argmax(steps)), float(np.median(steps))
    if steps[at] > _LARGEST_GAP * typical:
        raise ValueError(
            f"steps between states must be at most {_LARGEST_GAP:g} times the typical one of "
            f"{typical:.10g} s, got a gap of {steps[at]:.10g} s after t = {t[at]:.10g} s"
        )
    _check_speed(t, places)
    arms = np.linalg.norm(places - np.roll(places, 1, axis=1), axis=2) / SPEED_OF_LIGHT
    error = 0.0
    for first in (0, 1):
        every_second = make_interp_spline(t[first::2], places[first::2], k=_DEGREE)
        inside = slice(first, t[first::2].size * 2 - 1 + first)
        again = every_second(t[inside])
        off = np.linalg.norm(again - np.roll(again, 1, axis=1), axis=2) / SPEED_OF_LIGHT
        error = max(error, float(np.abs(off - arms[inside]).max()))
    if not error <= _LARGEST_ERROR:
        raise ValueError(
            f"every second state must give the others to {_LARGEST_ERROR} s of light, got an "
            f"error of {error:.2g} s: a state is wrong, or the steps are too long"
        )
    paths = tuple(make_interp_spline(t, places[:, k], k=_DEGREE) for k in range(3))
    # A round trip that ends here begins after the first state.
    begin = 2.001 * float(arms.max())
    return Constellation(epoch or f"{time[0]} s", (begin, float(t[-1])), error, paths)


def _check_speed(t: FloatArray, places: FloatArray) -> None:
    """Raise if the mean of the three positions does not circle the Sun at its speed there."""
    mean = make_interp_spline(t, places.mean(axis=1), k=_DEGREE)
    distance, speed = (np.linalg.norm(mean(t, k), axis=1) for k in (0, 1))
    circular = np.sqrt(SUN / np.maximum(distance, 1.0))
    worst = int(np.argmax(np.abs(speed / circular - 1.0)))
    if not abs(speed[worst] / circular[worst] - 1.0) <= _SPEED:
        raise ValueError(
            "positions must be in m from the Sun at times in s, in axes that do not rotate; at "
            f"t = {t[worst]:.4g} s their mean has to move at some {circular[worst]:.3g} m/s, "
            f"as on a circle around the Sun, got {speed[worst]:.3g} m/s"
        )


def esa(name: str) -> Constellation:
    """Return LISA's orbits as ESA has published them, over 10.7 years.

    Parameters
    ----------
    name : {"trailing", "leading"}
        Whether the spacecraft are 20 degrees behind the Earth or ahead of it.

    Returns
    -------
    Constellation

    Raises
    ------
    ValueError
        If there are no orbits of this name.

    References
    ----------
    W. Martens and E. Joffre, J. Astronaut. Sci. 68, 402 (2021). Data by W. Martens, ESA/ESOC,
    CC BY 4.0; ``armlock/data/README.md`` says what was changed.
    """
    epoch = _ESA[one_of("name", name, _ESA)]
    rows = np.loadtxt(Path(__file__).parent / "data" / f"esa_{name}.csv.gz", delimiter=",")
    return from_table(rows[:, 0], rows[:, 1:].reshape(-1, 3, 3), epoch=epoch)
