"""Where three spacecraft are, and how long light takes between them and back.

The light time of a link at time t, received there and then, solves

    l = |r_rec(t) - r_em(t - l)| / c + (4 G M / c^3) artanh(d / (r_rec + r_em)),

d being the distance in the first term; the second is the Sun's Shapiro delay. A round trip goes
out and back at its own times, tau(t) = l_back(t) + l_out(t - l_back(t)), and so
tau' = 1 - (1 - l_back'(t)) (1 - l_out'(t - l_back)).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from armlock.checks import FloatArray, axis, positive_number, real_array

#: Speed of light in m/s.
SPEED_OF_LIGHT = 299_792_458.0
#: Astronomical unit in m.
ASTRONOMICAL_UNIT = 149_597_870_700.0
#: G M of the Sun in m^3/s^2, compatible with TCB.
SUN = 1.32712440017987e20

_SHAPIRO = 4.0 * SUN / SPEED_OF_LIGHT**3

# Of a spacecraft: its place, or with 1 its velocity, at times of shape (n,); shape (n, 3).
_Path = Callable[[FloatArray, int], FloatArray]
# Light moves ten thousand times as fast as a spacecraft: each round of the iteration gives four
# digits. A round trip that has not settled after so many rounds is refused.
_ROUNDS = 6
_SETTLED = 1e-12
# Within so many s of their epoch Kepler's orbits are good to 5e-11 s in spite of rounding.
_KEPLER_SPAN = 3e9
_LINKS = {1: (2, 3), 2: (3, 1), 3: (1, 2)}


@dataclass(frozen=True, eq=False)
class Constellation:
    """Three spacecraft, 1 to 3, in orbit around the Sun.

    Attributes
    ----------
    epoch : str
        Where t = 0 is.
    scale : str
        The time scale that t is in, "TCB" or "TDB"; light times are in its seconds.
    span : tuple of two floats
        First and last t in s at which all round trips exist.
    error : float
        Estimate of how far interpolation puts an arm off, in s of light: what is found with
        every second state left out, divided by eight. 0 where nothing is interpolated. Of ESA's
        files it is 1e-8 to 2e-8 s: their states do not lie on one smooth curve to better.
    """

    epoch: str
    scale: str
    span: tuple[float, float]
    error: float
    _paths: tuple[_Path, _Path, _Path]

    def round_trips(self, t: npt.ArrayLike, master: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return the round-trip delays from the master and back.

        Parameters
        ----------
        t : array_like of float
            When the light is back, in s since `epoch`; any shape.
        master : {1, 2, 3}, optional
            The spacecraft with the locked laser.

        Returns
        -------
        tau1, tau2 : float arrays, shaped like `t`
            In s, with the Sun's Shapiro delay. Arm 1 leads from master 1 to spacecraft 2, from
            2 to 3, and from 3 to 1; arm 2 to the remaining one.

        Raises
        ------
        TypeError, ValueError
            If t is not finite and real, or outside of `span`, or there is no such master.

        Examples
        --------
        >>> from armlock.orbits import kepler
        >>> tau1, tau2 = kepler().round_trips(100 * 86400.0)
        >>> print(f"{tau1:.9f} {tau2:.9f}")
        16.675856900 16.611372223
        """
        tau1, tau2 = (delay for delay, _ in self._arms(t, master))
        return tau1, tau2

    def rates(self, t: npt.ArrayLike, master: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return dtau1/dt and dtau2/dt.

        Parameters
        ----------
        t, master
            As for `round_trips`.

        Returns
        -------
        rate1, rate2 : float arrays, shaped like `t`
            In s/s. Of a laser's frequency an arm returns the factor 1 - rate; its phase is only
            delayed.

        Raises
        ------
        TypeError, ValueError
            As `round_trips`.
        """
        rate1, rate2 = (rate for _, rate in self._arms(t, master))
        return rate1, rate2

    def light_time(self, t: npt.ArrayLike, receiver: int, emitter: int) -> FloatArray:
        """Return the light time in s of what is received at t.

        Parameters
        ----------
        t : array_like of float
            In s since `epoch`; any shape.
        receiver, emitter : {1, 2, 3}
            Two spacecraft.

        Returns
        -------
        float array, shaped like `t`

        Raises
        ------
        TypeError, ValueError
            If t is not finite and real, or outside of `span`, or these are not two spacecraft.
        """
        if receiver not in _LINKS or emitter not in _LINKS[receiver]:
            raise ValueError(
                f"receiver and emitter must be two of 1, 2, 3, got {receiver!r} and {emitter!r}"
            )
        t = self._within(real_array("t", t), self.span[0])
        here, there = (self._paths[k - 1] for k in (receiver, emitter))
        return _link(here, there, t.ravel())[0].reshape(t.shape)

    def positions(self, t: npt.ArrayLike) -> FloatArray:
        """Return where the spacecraft are, in m, by time, spacecraft and coordinate.

        Parameters
        ----------
        t : array_like of float, shape (n,)
            In s since `epoch`, from the first state of a table to its last.

        Returns
        -------
        float array, shape (n, 3, 3)

        Raises
        ------
        TypeError, ValueError
            If t is not one-dimensional, finite and real, or outside of the table.
        """
        t = self._within(axis("t", t), min(0.0, self.span[0]))
        return np.stack([path(t, 0) for path in self._paths], axis=1)

    def _arms(self, t: npt.ArrayLike, master: int) -> list[tuple[FloatArray, FloatArray]]:
        """Return delay and rate of both arms, after a look at the arguments."""
        t = self._within(real_array("t", t), self.span[0])
        if master not in (1, 2, 3) or isinstance(master, bool):
            raise ValueError(f"master must be 1, 2 or 3, got {master!r}")
        arms = [self._round_trip(master, far, t.ravel()) for far in _LINKS[master]]
        return [(delay.reshape(t.shape), rate.reshape(t.shape)) for delay, rate in arms]

    def _round_trip(
        self, master: int, far: int, t: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return delay and rate of one arm at times of shape (n,)."""
        here, there = self._paths[master - 1], self._paths[far - 1]
        back, back_rate = _link(here, there, t)
        out, out_rate = _link(there, here, t - back)
        return back + out, back_rate + out_rate - back_rate * out_rate

    def _within(self, t: FloatArray, first: float) -> FloatArray:
        """Return times, or raise if one is before the first or after the span."""
        last = self.span[1]
        outside = t[(t < first) | (t > last)]
        if outside.size:
            raise ValueError(
                f"t must lie within the span {first} to {last} s, got {outside.flat[0]}"
            )
        return t


def _link(receiver: _Path, emitter: _Path, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return light time and its derivative for what is received at times of shape (n,)."""
    place, velocity = receiver(t, 0), receiver(t, 1)
    far = np.linalg.norm(place, axis=1)
    light = before = np.zeros(t.shape)
    for _ in range(_ROUNDS):
        before, source = light, emitter(t - light, 0)
        between = place - source
        d = np.linalg.norm(between, axis=1)
        both = far + np.linalg.norm(source, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            light = d / SPEED_OF_LIGHT + _SHAPIRO * np.arctanh(d / both)
    moved = np.abs(light - before)
    if not (moved <= _SETTLED * np.maximum(light, 1.0)).all():
        raise ValueError(
            f"positions must move slower than light, got a light time that does not settle at "
            f"t = {t[np.argmax(moved)]} s"
        )
    emitted = emitter(t - light, 1)
    receding, leaving = (np.vecdot(between, v) / d for v in (velocity - emitted, emitted))
    # The source has moved for 1 - d'/c of each second at the receiver.
    d_rate = receding / (1.0 - leaving / SPEED_OF_LIGHT)
    both_rate = np.vecdot(place, velocity) / far + np.vecdot(source, emitted) / (both - far)
    bend = (d_rate * both - d * both_rate) / (both**2 - d**2)
    return light, d_rate / SPEED_OF_LIGHT + _SHAPIRO * bend


def _ellipse(alpha: float, theta: float, t: FloatArray, derivative: int) -> FloatArray:
    """Return a spacecraft's place around the Sun, or with 1 its velocity, at times (n,)."""
    nu = np.pi / 3.0 + 0.625 * alpha
    e = np.sqrt(1 + 4 * alpha * np.cos(nu) / np.sqrt(3) + 4 * alpha**2 / 3) - 1
    tilt = np.arctan2(alpha * np.sin(nu), np.sqrt(3) / 2 + alpha * np.cos(nu))
    a, n = ASTRONOMICAL_UNIT, np.sqrt(SUN / ASTRONOMICAL_UNIT**3)
    # In this order the product does not round as a century does.
    mean = n * np.remainder(t, 2.0 * np.pi / n) - theta
    u = mean + e * np.sin(mean)
    for _ in range(_ROUNDS):
        u = u - (u - e * np.sin(u) - mean) / (1.0 - e * np.cos(u))
    width = a * np.sqrt(1.0 - e**2)
    x, y = a * (np.cos(u) - e), width * np.sin(u)
    if derivative:
        du = n / (1.0 - e * np.cos(u))
        x, y = -a * np.sin(u) * du, width * np.cos(u) * du
    cosine, sine = np.cos(theta), np.sin(theta)
    flat, up = x * np.cos(tilt), -x * np.sin(tilt)
    return np.column_stack((cosine * flat - sine * y, sine * flat + cosine * y, up))


def kepler(arm_length: float = 2.5e9) -> Constellation:
    """Return two-body orbits with the elements of Dhurandhar et al. (2005), delta = 5/8.

    Parameters
    ----------
    arm_length : float, optional
        Mean distance of the spacecraft in m, below a tenth of the astronomical unit.

    Returns
    -------
    Constellation
        With t = 0 at the epoch of the elements. It spans a century around it, over which
        rounding leaves 5e-11 s.

    Raises
    ------
    TypeError, ValueError
        If the arm length is not positive, or too long for these elements.

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
    one, two, three = (partial(_ellipse, alpha, k * 2.0 * np.pi / 3.0) for k in range(3))
    span = (-_KEPLER_SPAN, _KEPLER_SPAN)
    return Constellation("that of the elements", "TCB", span, 0.0, (one, two, three))
