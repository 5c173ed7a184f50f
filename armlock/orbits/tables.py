"""Constellations from tables of positions, and from files that hold them.

Between the states of a table run splines. How good they are is found with every second state
left out.
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from armlock.checks import FloatArray, axis, finite_series, one_of
from armlock.orbits.constellation import SPEED_OF_LIGHT, Constellation

# Time scales that a table may have.
_SCALES = ("TCB", "TDB")

# No spacecraft is within the Sun, radius in m: positions in km, or not from the Sun, would be.
_SUN_RADIUS = 6.957e8
# Degree of the splines through positions, and the fewest states: half of them make a spline.
_DEGREE = 7
_FEWEST = 2 * (_DEGREE + 1)
# Twice as many states put interpolation off by less, by this factor at least. On a smooth curve
# it would be 256; of ESA's states, which do not lie on one, it is ten.
_GAINED = 8.0
# Interpolation may put an arm off by so much, in s of light, as it is estimated.
_LARGEST_ERROR = 1e-6
# The last state of a segment and the first of the next, at one epoch, differ by less, in m.
_SAME_STATE = 1.0
# The first t is found in so many rounds, each of which gives four digits.
_ROUNDS = 6


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
        be interpolated to 1e-6 s of light, or faster than light.
    """
    time, places = axis("time", time), finite_series("positions", positions, 3)
    one_of("scale", scale, _SCALES)
    if places.shape != (time.size, 3, 3):
        raise ValueError(
            f"positions must be of shape ({time.size}, 3, 3), as many as times, for three "
            f"spacecraft and three coordinates; got {places.shape}"
        )
    if time.size < _FEWEST:
        raise ValueError(f"a table must hold at least {_FEWEST} states, got {time.size}")
    t = time - time[0]
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        raise ValueError(f"times must ascend, got {t[back[0] + 1]} s after {t[back[0]]} s")
    nearest = np.linalg.norm(places, axis=2).min()
    if nearest < _SUN_RADIUS:
        raise ValueError(
            f"positions must be in m from the Sun, got one {nearest:.4g} m from its centre"
        )
    one, two, three = (make_interp_spline(t, places[:, k], k=_DEGREE) for k in range(3))
    every_second = make_interp_spline(t[::2], places[::2], k=_DEGREE)
    arms, roughly = (
        np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2) / SPEED_OF_LIGHT
        for x in (places, every_second(t))
    )
    # After the last of every second state the curve is extrapolated.
    error = float(np.abs(arms - roughly)[t <= t[::2][-1]].max()) / _GAINED
    if arms.min() == 0.0:
        raise ValueError("positions must be of three spacecraft, got two in one place")
    if error > _LARGEST_ERROR:
        raise ValueError(
            f"states must be close enough to be interpolated to {_LARGEST_ERROR} s of light, "
            f"got an estimated error of {error:.2g} s"
        )
    # The light that is back at the first t was sent at the first state: t = tau(t).
    begun = epoch or f"{time[0]} s"
    orbits = Constellation(begun, scale, (-np.inf, np.inf), error, (one, two, three))
    first = 2.0 * float(arms.max())
    for _ in range(_ROUNDS):
        first = max(float(tau) for m in (1, 2, 3) for tau in orbits.round_trips(first, m))
    if first >= t[-1]:
        raise ValueError(
            f"a table must be longer than a round trip of {first:.4g} s, got {t[-1]} s"
        )
    return replace(orbits, span=(first, float(t[-1])))


def read_table(path: str | Path) -> Constellation:
    """Read a table of positions from a text file, as `from_table` takes it.

    Parameters
    ----------
    path : str or Path
        Ten numbers a row, separated by commas: time in s, and x, y, z of spacecraft 1, 2 and 3
        in m from the Sun. Lines with ``#`` are comments; two of them have to say
        ``# epoch: ...`` and ``# scale: TCB`` or ``TDB``. Names ending in .gz are unpacked.

    Returns
    -------
    Constellation

    Raises
    ------
    OSError
        If the file cannot be read.
    TypeError, ValueError
        If a row does not hold ten numbers, epoch or scale is missing, or as for `from_table`.
    """
    path = Path(path)
    with (gzip.open if path.suffix == ".gz" else open)(path, "rt", encoding="utf-8") as file:
        lines = file.readlines()
    said = dict(re.findall(r"^# *(\w+): *(.*?) *$", "".join(lines), re.MULTILINE))
    missing = [key for key in ("epoch", "scale") if key not in said]
    if missing:
        raise ValueError(f"{path} must say its {' and '.join(missing)}, as '# scale: TCB'")
    rows = np.loadtxt(lines, delimiter=",", ndmin=2)
    if rows.shape[1] != 10:
        raise ValueError(f"{path} must hold ten numbers a row, got {rows.shape[1]}")
    places = rows[:, 1:].reshape(-1, 3, 3)
    return from_table(rows[:, 0], places, epoch=said["epoch"], scale=said["scale"])


def read_oem(paths: Sequence[str | Path]) -> Constellation:
    """Read the orbits of three spacecraft from Orbit Ephemeris Messages (CCSDS OEM, text).

    Parameters
    ----------
    paths : sequence of three paths
        One file a spacecraft, 1 to 3: states around the Sun, in TCB or TDB, in one frame that
        does not turn, as ESA publishes them.

    Returns
    -------
    Constellation
        From the positions, as `from_table` makes it; t = 0 is the first epoch. Velocities are
        not used: ESA's have fewer digits than the splines' derivatives.

    Raises
    ------
    OSError
        If a file cannot be read.
    TypeError, ValueError
        If there are not three files, one of them is no OEM, is of another centre, frame or time
        scale, or of different ones or other epochs than the others; states differ at a border
        of segments; or as for `from_table`.
    """
    if isinstance(paths, str | Path) or len(paths) != 3:
        raise ValueError(f"paths must hold three files, one a spacecraft, got {paths!r}")
    headers, epochs, places = zip(*(_read(Path(path)) for path in paths), strict=True)
    if len(set(headers)) > 1:
        raise ValueError(f"paths must be of one frame and time scale, got {headers}")
    if not all(np.array_equal(epochs[0], other) for other in epochs[1:]):
        raise ValueError(f"paths must have the same epochs, got {[e.size for e in epochs]}")
    t = (epochs[0] - epochs[0][0]) / np.timedelta64(1, "ns") * 1e-9
    first, scale = str(epochs[0][0]), headers[0][1]
    return from_table(t, np.stack(places, axis=1), epoch=first, scale=scale)


# What a file may say of itself; the axes of these frames do not turn.
_ALLOWED = {
    "CENTER_NAME": ("SUN",),
    "REF_FRAME": ("EME2000", "ICRF", "GCRF"),
    "TIME_SYSTEM": _SCALES,
}


def _read(path: Path) -> tuple[tuple[str, str], npt.NDArray[np.datetime64], FloatArray]:
    """Return frame and scale, epochs of shape (n,) and positions of shape (n, 3), in m."""
    text = path.read_text("utf-8", errors="replace")
    if "CCSDS_OEM_VERS" not in text:
        raise ValueError(f"{path} must be a CCSDS OEM in text form, with CCSDS_OEM_VERS")
    header = []
    for key, allowed in _ALLOWED.items():
        said = set(re.findall(rf"^\s*{key}\s*=\s*(.*?)\s*$", text.upper(), re.MULTILINE))
        if len(said) != 1 or not said <= set(allowed):
            raise ValueError(
                f"{key} of {path} must be one of {', '.join(allowed)}, got "
                f"{', '.join(sorted(said)) or 'none'}"
            )
        header.append(said.pop())
    # States begin with an epoch; accelerations may be left out.
    rows = [line.split() for line in re.findall(r"^\s*\d+-\S*T.*", text, re.MULTILINE)]
    wrong = [" ".join(row) for row in rows if len(row) not in (7, 10)] or ["none"] * (not rows)
    if wrong:
        raise ValueError(
            f"states of {path} must have an epoch, position and velocity, and may have an "
            f"acceleration, got {wrong[0]}"
        )
    try:
        epochs = np.array([row[0].removesuffix("Z") for row in rows], dtype="datetime64[ns]")
        values = [[float(number) for number in row[1:4]] for row in rows]
    except ValueError as error:
        raise ValueError(f"states of {path} must hold dates and numbers: {error}") from None
    places = 1e3 * finite_series(f"positions of {path}", values, 2)
    again = np.append(False, np.diff(epochs) == np.timedelta64(0))
    apart = np.abs(places - np.roll(places, 1, axis=0)).max(axis=1) * again
    if apart.max() > _SAME_STATE:
        raise ValueError(
            f"states of {path} must agree where an epoch stands twice, got positions "
            f"{apart.max():.3g} m apart at {epochs[apart.argmax()]}"
        )
    return (header[1], header[2]), epochs[~again], places[~again]
