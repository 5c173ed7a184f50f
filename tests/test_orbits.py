"""Round trips of Kepler's orbits, of a table and of ESA's files, against other ways to them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from armlock.orbits import from_table, kepler, read_oem

DAY = 86400.0
YEAR = 365.25 * DAY
KEPLER = kepler()
# Round trips from spacecraft 1, from an independent calculation: day, tau1, tau2, half, rates.
KNOWN = """
10,16.669558636078,16.658559847233,5.499394422348e-03,6.3869069e-09,-6.2226665e-09
100,16.675856900420,16.611372223321,3.224233854951e-02,-5.9189755e-09,-4.1467694e-09
"""


def half(t, master=1, orbits=KEPLER):
    tau1, tau2 = orbits.round_trips(t, master)
    return 0.5 * (tau1 - tau2)


def sampled(t, orbits=KEPLER):
    """Return positions at times of shape (n,), as (n, 3, 3)."""
    return np.stack([path(np.asarray(t), 0) for path in orbits._paths], axis=1)


@pytest.mark.parametrize("row", KNOWN.split())
def test_kepler_against_an_independent_calculation(row):
    day, *expected = map(float, row.split(","))
    found = [*KEPLER.round_trips(day * DAY), half(day * DAY), *KEPLER.rates(day * DAY)]
    off = np.abs(np.subtract(found, expected))
    assert (off < [5e-11, 5e-11, 5e-11, 5e-15, 5e-15]).all()


def test_a_year_of_kepler_has_the_known_extremes_and_zeros():
    t = np.linspace(0.0, YEAR, 4001)
    tau1 = KEPLER.round_trips(t)[0]
    for at, extreme in ((np.argmin(tau1), 16.60729006), (np.argmax(tau1), 16.68745637)):
        rate = lambda x: float(KEPLER.rates(x)[0])  # noqa: E731
        where = brentq(rate, t[at - 1], t[at + 1])
        assert abs(KEPLER.round_trips(where)[0] - extreme) < 1e-8
    assert abs(brentq(half, -100.0, 100.0) - 8.332) < 1e-3
    assert abs(brentq(half, 182 * DAY, 183 * DAY, xtol=1e-6) / DAY - 182.6285454) < 1e-7


def test_light_times_against_lisaorbits():
    lisaorbits = pytest.importorskip("lisaorbits")
    peer = lisaorbits.KeplerianOrbits(kepler_order=4)
    peer.tt_method, peer.tt_order, peer.tt_niter = "iterative", 2, 8
    rng = np.random.default_rng(29)
    t = rng.uniform(0.0, YEAR, 40)
    for master, (one, two) in {1: (2, 3), 2: (3, 1), 3: (1, 2)}.items():
        for arm, far in enumerate((one, two)):
            back = peer.compute_ltt(t, [10 * master + far])[:, 0]
            out = peer.compute_ltt(t - back, [10 * far + master])[:, 0]
            assert np.abs(KEPLER.round_trips(t, master)[arm] - back - out).max() < 5e-11
            rates = [
                peer.compute_ltt_derivative(when, [link])[:, 0]
                for when, link in ((t, 10 * master + far), (t - back, 10 * far + master))
            ]
            rate = 1.0 - (1.0 - rates[0]) * (1.0 - rates[1])
            assert np.abs(KEPLER.rates(t, master)[arm] - rate).max() < 5e-15


@pytest.mark.parametrize("master", [1, 2, 3])
def test_the_rate_is_the_derivative_of_the_round_trip(master):
    t, step = np.random.default_rng(1).uniform(-YEAR, YEAR, 20), 2000.0
    for orbits, when in ((KEPLER, t), (from_table(*weeks()), np.abs(t) % (200 * DAY) + DAY)):
        near = [np.array(orbits.round_trips(when + k * step, master)) for k in (-2, -1, 1, 2)]
        slope = (8 * (near[2] - near[1]) - (near[3] - near[0])) / (12 * step)
        assert np.abs(slope - orbits.rates(when, master)).max() < 2e-15


def test_shapes_are_kept_and_masters_are_three():
    t = np.zeros((2, 3)) + 1e6
    assert KEPLER.round_trips(t)[0].shape == KEPLER.rates(t, 3)[1].shape == (2, 3)
    assert KEPLER.round_trips(1e6)[0].shape == ()
    wrong: list[Any] = [0, 4, 1.5, True, "1"]
    for master in wrong:
        with pytest.raises(ValueError, match="master must be 1, 2 or 3"):
            KEPLER.round_trips(0.0, master)
    # Around the triangle the three differences add up to nothing but the Sagnac effect.
    assert abs(sum(half(5e6, master) for master in (1, 2, 3))) < 1e-7


def weeks(days=1.0, span=210.0, first=1e9):
    """Return a table of Kepler's orbits, and its own time."""
    t = np.arange(0.0, span * DAY, days * DAY)
    return first + t, sampled(t)


def test_a_table_gives_the_round_trips_it_was_sampled_from():
    table = from_table(*weeks(), epoch="an evening", scale="TDB")
    assert (table.epoch, table.scale) == ("an evening", "TDB")
    t = np.linspace(*table.span, 300)
    for master in (1, 2, 3):
        off = np.subtract(table.round_trips(t, master), KEPLER.round_trips(t, master))
        assert np.abs(off).max() < 1e-11
    assert table.error < 1e-11
    assert from_table(*weeks()).epoch == "1000000000.0 s"


def test_the_span_begins_when_the_first_light_is_back():
    table = from_table(*weeks())
    first, last = table.span
    longest = max(max(table.round_trips(first, master)) for master in (1, 2, 3))
    assert abs(first - longest) < 1e-9
    assert last == 209 * DAY
    for t in (first - 1e-3, last + 1.0, [1e6, 1e9]):
        with pytest.raises(ValueError, match=r"t must lie within the span 16\.\d+ to 18057600"):
            table.round_trips(t)
    with pytest.raises(ValueError, match="t must be finite"):
        table.rates(np.nan)


def changed(**wrong):
    time, positions = weeks(span=40.0)
    return {"time": time, "positions": positions, **wrong}


TIME, PLACES = weeks(span=40.0)
BAD_TABLES = {
    "at least 16 states, got 12": changed(time=TIME[:12], positions=PLACES[:12]),
    r"ascend, got 0\.0 s after 86400": changed(time=np.r_[TIME[:2], TIME[0], TIME[3:]]),
    r"of shape \(40, 3, 3\)": changed(positions=PLACES[:, :2]),
    r"in m from the Sun, got one 1\.4": changed(positions=PLACES / 1e3),
    "slower than light": changed(time=np.linspace(0.0, 300.0, 40)),
    "longer than a round trip": changed(
        time=np.linspace(0, 16, 40), positions=sampled(np.linspace(0, 16, 40))
    ),
    "close enough": changed(time=30 * TIME, positions=sampled(30 * TIME)),
    "scale must be one of TCB, TDB, got 'UTC'": changed(scale="UTC"),
    "positions must be finite": changed(positions=np.where(PLACES > 1e11, np.nan, PLACES)),
}


@pytest.mark.parametrize("message", BAD_TABLES)
def test_a_table_that_is_none_is_refused(message):
    with pytest.raises(ValueError, match=message):
        from_table(**BAD_TABLES[message])


def test_an_arm_length_is_positive_and_below_a_tenth_of_the_way_to_the_sun():
    with pytest.raises(ValueError, match="arm_length must be positive"):
        kepler(-2.5e9)
    with pytest.raises(ValueError, match="arm_length must be at most"):
        kepler(2.5e10)
    assert abs(kepler(5e9).round_trips(0.0)[0] / KEPLER.round_trips(0.0)[0] - 2.0) < 0.02


HEADER = """CCSDS_OEM_VERS = 2.0
META_START
CENTER_NAME = {centre}
REF_FRAME = {frame}
TIME_SYSTEM = {scale}
META_STOP
"""


def oem(path, spacecraft, t, *, border=None, centre="SUN", frame="EME2000", scale="TCB"):
    """Write an OEM of Kepler's orbits, with a border of segments after state `border`."""
    head = HEADER.format(centre=centre, frame=frame, scale=scale)
    orbit = KEPLER._paths[spacecraft - 1]
    place, velocity = orbit(t, 0), orbit(t, 1)
    pull = -1.32712440017987e20 * place / np.linalg.norm(place, axis=1)[:, None] ** 3
    epochs = np.datetime64("2035-01-01T00:00:29") + (t * 1e9).astype("timedelta64[ns]")
    lines = [
        f"{epoch} " + " ".join(f"{value / 1e3:.17g}" for value in state)
        for epoch, state in zip(epochs, np.hstack((place, velocity, pull)), strict=True)
    ]
    if border is not None:
        lines[border:border] = [lines[border], *head.splitlines()[1:]]
    path.write_text(head + "\n".join(lines) + "\n", "utf-8")
    return path


def test_files_in_segments_give_what_they_were_written_from(tmp_path):
    t = np.arange(0.0, 60 * DAY, DAY)
    files = [oem(tmp_path / f"{k}.oem", k, t, border=k * 10) for k in (1, 2, 3)]
    orbits = read_oem(files)
    assert (orbits.scale, orbits.epoch[:19]) == ("TCB", "2035-01-01T00:00:29")
    when = np.linspace(*orbits.span, 200)
    off = np.subtract(orbits.round_trips(when, 2), KEPLER.round_trips(when, 2))
    assert np.abs(off).max() < 5e-11


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"centre": "EARTH"}, "CENTER_NAME of .* must be one of SUN, got EARTH"),
        ({"frame": "ITRF-97"}, "REF_FRAME of .* must be one of EME2000, ICRF, GCRF"),
        ({"scale": "UTC"}, "TIME_SYSTEM of .* must be one of TCB, TDB, got UTC"),
        ({"scale": "TDB"}, "of one frame and time scale"),
        ({"frame": "ICRF"}, "of one frame and time scale"),
    ],
)
def test_a_file_of_another_frame_is_refused(tmp_path, wrong, message):
    t = np.arange(0.0, 30 * DAY, DAY)
    files = [oem(tmp_path / f"{k}.oem", k, t) for k in (1, 2)]
    files.append(oem(tmp_path / "3.oem", 3, t, **wrong))
    with pytest.raises(ValueError, match=message):
        read_oem(files)
    with pytest.raises(ValueError, match="three files"):
        read_oem(files[:2])
    with pytest.raises(FileNotFoundError):
        read_oem([*files[:2], tmp_path / "none.oem"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("CCSDS_OEM_VERS", "OPM"), "must be a CCSDS OEM"),
        (lambda text: text.replace("TIME_SYSTEM", "SYSTEM"), "TIME_SYSTEM of .*, got none"),
        (lambda text: text[: text.rindex(" ")], "position, velocity and acceleration"),
        (lambda text: text.split("META_STOP")[0], "acceleration, got none"),
        (lambda text: text.replace("2035-01-05", "2034-01-05"), "same epochs"),
    ],
)
def test_a_file_that_is_damaged_is_refused(tmp_path, change, message):
    t = np.arange(0.0, 30 * DAY, DAY)
    files = [oem(tmp_path / f"{k}.oem", k, t) for k in (1, 2, 3)]
    files[1].write_text(change(files[1].read_text("utf-8")), "utf-8")
    with pytest.raises(ValueError, match=message):
        read_oem(files)


def test_states_that_disagree_at_a_border_are_refused(tmp_path):
    t = np.arange(0.0, 30 * DAY, DAY)
    files = [oem(tmp_path / f"{k}.oem", k, t, border=9) for k in (1, 2, 3)]
    lines = files[0].read_text("utf-8").splitlines()
    at = 6 + 9
    first, place, *rest = lines[at].split()
    lines[at] = " ".join((first, str(float(place) + 0.1), *rest))
    files[0].write_text("\n".join(lines), "utf-8")
    with pytest.raises(
        ValueError, match="agree where an epoch stands twice, got positions 100"
    ):
        read_oem(files)
