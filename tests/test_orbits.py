"""Round trips of Kepler's orbits, of a table and of ESA's files, against other ways to them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from armlock.orbits import (
    ASTRONOMICAL_UNIT,
    SUN,
    esa,
    from_table,
    kepler,
)

DAY = 86400.0
YEAR = 365.25 * DAY
KEPLER = kepler()
# Round trips from spacecraft 1, from an independent calculation: day, tau1, tau2, half, rates.
KNOWN = """
10,16.669558636078,16.658559847233,5.499394422348e-03,6.3869069e-09,-6.2226665e-09
100,16.675856900420,16.611372223321,3.224233854951e-02,-5.9189755e-09,-4.1467694e-09
200,16.621618884312,16.641018450237,-9.699782962603e-03,-6.3548351e-09,6.1681212e-09
300,16.628953210588,16.687288651981,-2.916772069645e-02,6.6050206e-09,8.8452625e-10
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


def test_round_trips_differ_least_at_five_eighths():
    """The tilt of Nayak et al., Class. Quantum Grav. 23, 1763 (2006)."""
    t = np.linspace(0.0, YEAR, 2001)
    tilts = (0.0, 0.5, 0.625, 0.75)
    most = [np.abs(np.subtract(*kepler(2.5e9, k).round_trips(t))).max() for k in tilts]
    assert min(most) == most[2]
    assert most[0] > 2.5 * most[2]
    with pytest.raises(ValueError, match=r"^delta"):
        kepler(2.5e9, np.nan)


def test_a_century_later_the_arms_are_the_same():
    period = 2.0 * np.pi * np.sqrt(ASTRONOMICAL_UNIT**3 / SUN)
    t = np.linspace(0.0, period, 300)
    for periods in (-94, 94):
        off = np.subtract(KEPLER.round_trips(t + periods * period), KEPLER.round_trips(t))
        assert np.abs(off).max() < 5e-11


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
    wrong: list[Any] = [0, 4, 1.0, 1.5, True, "1", [1], b"1", np.datetime64("2035-01-01")]
    for number in wrong:
        for call in (KEPLER.round_trips, KEPLER.rates):
            with pytest.raises(ValueError, match=r"^master must be (1, 2 or 3|an integer)"):
                call(0.0, number)
        with pytest.raises(ValueError, match=r"^receiver must be (1, 2 or 3|an integer)"):
            KEPLER.light_time(0.0, number, 2)
        with pytest.raises(ValueError, match=r"^emitter must be (1, 2 or 3|an integer)"):
            KEPLER.light_time(0.0, 2, number)
    # Around the triangle the three differences add up to nothing but the Sagnac effect.
    assert abs(sum(half(5e6, master) for master in (1, 2, 3))) < 1e-7


def weeks(days=1.0, span=210.0, first=1e9):
    """Return a table of Kepler's orbits, and its own time."""
    t = np.arange(0.0, span * DAY, days * DAY)
    return first + t, sampled(t)


def test_a_table_gives_the_round_trips_it_was_sampled_from():
    table = from_table(*weeks(), epoch="an evening, TDB")
    assert table.epoch == "an evening, TDB"
    t = np.linspace(*table.span, 300)
    for master in (1, 2, 3):
        off = np.subtract(table.round_trips(t, master), KEPLER.round_trips(t, master))
        assert np.abs(off).max() < 1e-11
    assert table.error < 1e-10
    assert from_table(*weeks()).epoch == "1000000000.0 s"


@pytest.mark.parametrize("number", [209, 210])
def test_a_wrong_state_shows_in_the_error_wherever_it_is(number):
    """At the ends too, and for even and odd numbers of states."""
    time, positions = weeks()
    for k in (0, 1, 100, 101, number - 2, number - 1):
        moved = positions[:number].copy()
        moved[k, 0] += 1.2e-9 * (moved[k, 1] - moved[k, 0])  # 3 m
        assert from_table(time[:number], moved).error > 1e-9


def test_the_span_begins_when_the_first_light_is_back():
    table = from_table(*weeks())
    first, last = table.span
    longest = max(max(table.round_trips(first, master)) for master in (1, 2, 3))
    assert 0.0 < first - longest < 0.1
    assert last == 209 * DAY
    for t in (0.0, last + 1.0, [1e6, 1e9]):
        with pytest.raises(ValueError, match=r"t must lie within the span 16\.\d+ to 18057600"):
            table.round_trips(t)
    with pytest.raises(ValueError, match="t must be finite"):
        table.rates(np.nan)


def test_orbits_around_the_earth_follow_the_sun_too():
    """As TianQin's: 1e8 m from the Earth, once around it in 3.65 days."""
    t = 7200.0 * np.arange(400)
    year = np.sqrt(SUN / ASTRONOMICAL_UNIT**3) * t
    earth = ASTRONOMICAL_UNIT * np.stack([np.cos(year), np.sin(year), 0.0 * year], axis=1)
    turns = 2 * np.pi * (t[:, None] / (3.65 * DAY) + np.arange(3) / 3.0)
    around = 1e8 * np.stack([np.cos(turns), 0.0 * turns, np.sin(turns)], axis=2)
    tau1, _ = from_table(t, earth[:, None] + around).round_trips(5 * DAY)
    assert abs(float(tau1) / 1.1556 - 1.0) < 1e-3


def changed(**wrong):
    time, positions = weeks(span=40.0)
    return {"time": time, "positions": positions, **wrong}


def rotating(t, positions):
    """Return positions in axes that follow the constellation around the Sun."""
    angle = 2 * np.pi * t / YEAR
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    flat = np.einsum("ijn,nkj->nki", turn, positions[:, :, :2])
    return np.concatenate((flat, positions[:, :, 2:]), axis=2)


TIME, PLACES = weeks(span=40.0)
GAP = np.r_[0:20, 25:40]
BAD_TABLES = {
    "at least 16 states, got 12": changed(time=TIME[:12], positions=PLACES[:12]),
    r"ascend, got 1000000000\.0 s after 10000": changed(
        time=np.r_[TIME[:2], TIME[0], TIME[3:]]
    ),
    r"shape \(40, 3, 3\): by time, spacecraft": changed(positions=PLACES[:, :2]),
    "gap of 518400 s after t = 1641600 s": changed(time=TIME[GAP], positions=PLACES[GAP]),
    r"move at some 9\.\d+e\+05 m/s, .* got 29\.\d m/s": changed(positions=PLACES / 1e3),
    r"got 2[89]\.\d m/s": changed(time=1e3 * (TIME - TIME[0])),
    "do not rotate": changed(positions=rotating(TIME, PLACES)),
    "in m from the Sun": changed(positions=PLACES.transpose(0, 2, 1)),
    "times in s": changed(time=TIME / DAY),
    "every second state must give the others": changed(
        time=12 * (TIME - TIME[0]), positions=sampled(12 * (TIME - TIME[0]))
    ),
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


def test_the_packages_tables_are_esas_orbits():
    for name, most in (("trailing", 0.1457), ("leading", 0.16)):
        table = esa(name)
        assert table.epoch.startswith(("2036-12-09T00:00:29.327664", "2037-06-11T00:00:29.574"))
        assert table.epoch.endswith(" TCB")
        assert table.error < 2e-7
        t = np.linspace(*table.span, 20_000)
        assert abs(np.abs(half(t, orbits=table)).max() - most) < 1e-4
        assert max(np.abs(rate).max() for rate in table.rates(t)) < 6.8e-8
    with pytest.raises(ValueError, match="name must be one of 'trailing', 'leading'"):
        esa("Kepler")


def test_links_add_up_to_round_trips():
    t = np.linspace(0.0, YEAR, 7)
    back = KEPLER.light_time(t, 1, 2)
    trip = back + KEPLER.light_time(t - back, 2, 1)
    assert np.abs(trip - KEPLER.round_trips(t)[0]).max() == 0.0
    with pytest.raises(ValueError, match="t must lie within the span"):
        KEPLER.light_time([1e10], 1, 2)
