"""Where three spacecraft are, and how long light takes between them and back.

The light time of a link at time t, received there and then, solves

    l = |r_rec(t) - r_em(t - l)| / c + (4 G M / c^3) artanh(d / (r_rec + r_em)),

d being the distance in the first term; the second is the Sun's Shapiro delay. A round trip goes
out and back at its own times, tau(t) = l_back(t) + l_out(t - l_back(t)), and so
tau' = 1 - (1 - l_back'(t)) (1 - l_out'(t - l_back)).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BPoly, BSpline, PPoly, make_interp_spline

from armlock.checks import FloatArray, axis, finite_series, positive_number, real_array

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
# digits. A round trip that has not settled after so many is none.
_ROUNDS = 6
_SETTLED = 1e-12
# No spacecraft is within the Sun, radius in m: positions in km, or not from the Sun, would be.
_SUN_RADIUS = 6.957e8
# Degree of the splines through positions, and the fewest states: half of them make a spline.
_DEGREE = 7
_FEWEST = 2 * (_DEGREE + 1)
# By so much twice as many states are better, at least: both kinds of curves have order six.
_GAINED = 2.0**6
# Interpolated arms may be off by so much, in s of light; the states left out tell.
_LARGEST_ERROR = 1e-7
# The last state of a segment and the first of the next, at one epoch, differ by less, in m.
_SAME_STATE = 1.0
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
        every second state left out, divided by 64. 0 where nothing is interpolated.
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

    def _arms(self, t: npt.ArrayLike, master: int) -> list[tuple[FloatArray, FloatArray]]:
        """Return delay and rate of both arms, after a look at the arguments."""
        t = real_array("t", t)
        if isinstance(master, bool) or master not in _LINKS:
            raise ValueError(f"master must be 1, 2 or 3, got {master!r}")
        first, last = self.span
        outside = t[(t < first) | (t > last)]
        if outside.size:
            raise ValueError(
                f"t must lie within the span {first} to {last} s, got {outside.flat[0]}"
            )
        arms = [_round_trip(self._paths, master, far, t.ravel()) for far in _LINKS[master]]
        return [(delay.reshape(t.shape), rate.reshape(t.shape)) for delay, rate in arms]


def _round_trip(
    paths: Sequence[_Path], master: int, far: int, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return delay and rate of one arm at times of shape (n,)."""
    here, there = paths[master - 1], paths[far - 1]
    back, back_rate = _link(here, there, t)
    out, out_rate = _link(there, here, t - back)
    return back + out, back_rate + out_rate - back_rate * out_rate


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
    receding, leaving = (_dot(between, v) / d for v in (velocity - emitted, emitted))
    # The source has moved for 1 - d'/c of each second at the receiver.
    d_rate = receding / (1.0 - leaving / SPEED_OF_LIGHT)
    both_rate = _dot(place, velocity) / far + _dot(source, emitted) / (both - far)
    bend = (d_rate * both - d * both_rate) / (both**2 - d**2)
    return light, d_rate / SPEED_OF_LIGHT + _SHAPIRO * bend


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return scalar products along the last axis."""
    return np.asarray((first * second).sum(axis=-1))


class _Ellipse(NamedTuple):
    """The path of one spacecraft around the Sun: ellipse, inclination, and angle around z."""

    alpha: float
    theta: float

    def path(self, t: FloatArray, derivative: int) -> FloatArray:
        """Return the place, or with 1 the velocity, at times of shape (n,)."""
        nu = np.pi / 3.0 + 0.625 * self.alpha
        e = np.sqrt(1 + 4 * self.alpha * np.cos(nu) / np.sqrt(3) + 4 * self.alpha**2 / 3) - 1
        tilt = np.arctan2(self.alpha * np.sin(nu), np.sqrt(3) / 2 + self.alpha * np.cos(nu))
        a, n = ASTRONOMICAL_UNIT, np.sqrt(SUN / ASTRONOMICAL_UNIT**3)
        mean = np.remainder(n * t, 2.0 * np.pi) - self.theta
        u = mean + e * np.sin(mean)
        for _ in range(_ROUNDS):
            u = u - (u - e * np.sin(u) - mean) / (1.0 - e * np.cos(u))
        width = a * np.sqrt(1.0 - e**2)
        x, y = a * (np.cos(u) - e), width * np.sin(u)
        if derivative:
            du = n / (1.0 - e * np.cos(u))
            x, y = -a * np.sin(u) * du, width * np.cos(u) * du
        cosine, sine = np.cos(self.theta), np.sin(self.theta)
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
    one, two, three = (_Ellipse(alpha, k * 2.0 * np.pi / 3.0).path for k in range(3))
    span = (-_KEPLER_SPAN, _KEPLER_SPAN)
    return Constellation("that of the elements", "TCB", span, 0.0, (one, two, three))


def from_table(
    time: npt.ArrayLike, positions: npt.ArrayLike, *, epoch: str = "", scale: str = "TCB"
) -> Constellation:
    """Return a constellation from a table of positions, by splines of degree 7.

    Parameters
    ----------
    time : array_like of float, shape (n,)
        Ascending, in s, of the three spacecraft alike; 16 states at least.
    positions : array_like of float, shape (n, 3, 3)
        In m from the Sun, by time, spacecraft and coordinate, in axes that do not turn.
    epoch : str, optional
        What the first time stands for; by default its number.
    scale : {"TCB", "TDB"}, optional
        The time scale of the table, positions included.

    Returns
    -------
    Constellation
        With t = 0 at the first time of the table.

    Raises
    ------
    TypeError, ValueError
        If the table is too short, unordered, not of that shape, within the Sun, too coarse to
        be interpolated to 1e-7 s of light, or faster than light.
    """
    time = axis("time", time)
    places = finite_series("positions", positions, 3)
    if places.shape != (time.size, 3, 3):
        raise ValueError(
            f"positions must be of shape ({time.size}, 3, 3), as many as times, for three "
            f"spacecraft and three coordinates; got {places.shape}"
        )
    return _interpolated(epoch or f"{time[0]} s", scale, time - time[0], places, _spline)


def read_oem(paths: Sequence[str | Path]) -> Constellation:
    """Read the orbits of three spacecraft from Orbit Ephemeris Messages (CCSDS OEM, text).

    Parameters
    ----------
    paths : sequence of three paths
        One file a spacecraft, 1 to 3: states around the Sun with accelerations, in TCB or TDB,
        in one frame that does not turn, as ESA publishes them.

    Returns
    -------
    Constellation
        Interpolated by the polynomials of degree five through position, velocity and
        acceleration at neighbouring states; t = 0 is the earliest epoch that all three have.

    Raises
    ------
    OSError
        If a file cannot be read.
    TypeError, ValueError
        If there are not three files, one of them is no OEM with accelerations, is of another
        centre, frame or time scale, or of different ones; states are unordered, too few, or
        differ at a border of segments; or as for `from_table`.
    """
    if isinstance(paths, str | Path) or len(paths) != 3:
        raise ValueError(f"paths must hold three files, one a spacecraft, got {paths!r}")
    headers, epochs, states = zip(*(_read(Path(path)) for path in paths), strict=True)
    if len(set(headers)) > 1:
        raise ValueError(f"paths must be of one frame and time scale, got {headers}")
    if not all(np.array_equal(epochs[0], other) for other in epochs[1:]):
        raise ValueError(f"paths must have the same epochs, got {[e.size for e in epochs]}")
    t = (epochs[0] - epochs[0][0]) / np.timedelta64(1, "ns") * 1e-9
    return _interpolated(str(epochs[0][0]), headers[0][1], t, np.stack(states, 1), _hermite)


def _spline(t: FloatArray, states: FloatArray) -> BSpline:
    """Return the spline through positions."""
    return make_interp_spline(t, states, k=_DEGREE)


def _hermite(t: FloatArray, states: FloatArray) -> PPoly:
    """Return the curve of degree five through states by time, derivative and coordinate."""
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(t, states))


# What a file may say of itself; the axes of these frames do not turn.
_ALLOWED = {
    "CENTER_NAME": ("SUN",),
    "REF_FRAME": ("EME2000", "ICRF", "GCRF"),
    "TIME_SYSTEM": ("TCB", "TDB"),
}


def _read(path: Path) -> tuple[tuple[str, str], npt.NDArray[np.datetime64], FloatArray]:
    """Return frame and scale, epochs of shape (n,) and states of shape (n, 3, 3), in m."""
    text = path.read_text("utf-8", errors="replace")
    if "CCSDS_OEM_VERS" not in text:
        raise ValueError(f"{path} must be a CCSDS OEM in text form, with CCSDS_OEM_VERS")
    found: dict[str, set[str]] = {
        "CENTER_NAME": set(),
        "REF_FRAME": set(),
        "TIME_SYSTEM": set(),
    }
    rows, inside = [], False
    for line in text.splitlines():
        key, equals, value = (part.strip() for part in line.partition("="))
        if key in found and equals:
            found[key].add(value.upper())
        elif key.startswith("COVARIANCE"):
            inside = key == "COVARIANCE_START"
        elif key[:1].isdigit() and not equals and not inside:
            rows.append(key.split())
    for key, allowed in _ALLOWED.items():
        if len(found[key]) != 1 or not found[key] <= set(allowed):
            raise ValueError(
                f"{key} of {path} must be one of {', '.join(allowed)}, got "
                f"{', '.join(sorted(found[key])) or 'none'}"
            )
    wrong = [" ".join(row) for row in rows if len(row) != 10] or ["none"] * (not rows)
    if wrong:
        raise ValueError(
            f"states of {path} must have an epoch, position, velocity and acceleration, got "
            f"{wrong[0]}"
        )
    epochs = np.array([row[0].removesuffix("Z") for row in rows], dtype="datetime64[ns]")
    values = [[float(number) for number in row[1:]] for row in rows]
    states = 1e3 * finite_series(f"states of {path}", values, 2).reshape(-1, 3, 3)
    twice = np.flatnonzero(np.diff(epochs) == np.timedelta64(0))
    apart = np.abs(states[twice + 1, 0] - states[twice, 0]).max(axis=1, initial=0.0)
    if (apart > _SAME_STATE).any():
        raise ValueError(
            f"states of {path} must agree where an epoch stands twice, got positions "
            f"{apart.max():.3g} m apart at {epochs[twice[np.argmax(apart)]]}"
        )
    header = found["REF_FRAME"].pop(), found["TIME_SYSTEM"].pop()
    return header, np.delete(epochs, twice + 1), np.delete(states, twice + 1, axis=0)


def _interpolated(
    epoch: str,
    scale: str,
    t: FloatArray,
    states: FloatArray,
    curve: Callable[[FloatArray, FloatArray], Any],
) -> Constellation:
    """Lay curves through states by time and spacecraft; find when round trips exist."""
    scales = _ALLOWED["TIME_SYSTEM"]
    if scale not in scales:
        raise ValueError(f"scale must be one of {', '.join(scales)}, got {scale!r}")
    if t.size < _FEWEST:
        raise ValueError(f"a table must hold at least {_FEWEST} states, got {t.size}")
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        raise ValueError(f"times must ascend, got {t[back[0] + 1]} s after {t[back[0]]} s")
    paths, halves = ([curve(t[::step], states[::step, k]) for k in range(3)] for step in (1, 2))
    # What lies after the last state of a half would be extrapolated.
    places, others = (
        np.stack([path(t[: t.size // 2 * 2 - 1]) for path in each]) for each in (paths, halves)
    )
    nearest = np.linalg.norm(places, axis=2).min()
    if nearest < _SUN_RADIUS:
        raise ValueError(
            f"positions must be in m from the Sun, got one {nearest:.4g} m from its centre"
        )
    arms, roughly = (
        np.linalg.norm(x - np.roll(x, 1, axis=0), axis=2) for x in (places, others)
    )
    error = float(np.abs(arms - roughly).max()) / SPEED_OF_LIGHT / _GAINED
    if error > _LARGEST_ERROR:
        raise ValueError(
            f"states must be close enough to be interpolated to {_LARGEST_ERROR} s of light, "
            f"got an estimated error of {error:.2g} s"
        )
    # The light that is back at the first t was sent at the first state: t = tau(t).
    first = np.array([2.0 * arms.max() / SPEED_OF_LIGHT])
    if first[0] >= t[-1]:
        raise ValueError(
            f"a table must be longer than a round trip of {first[0]:.4g} s, got {t[-1]} s"
        )
    for _ in range(_ROUNDS):
        trips = [_round_trip(paths, m, far, first)[0] for m in _LINKS for far in _LINKS[m]]
        first = np.max(trips, axis=0)
    span = (float(first[0]), float(t[-1]))
    return Constellation(epoch, scale, span, error, (paths[0], paths[1], paths[2]))
