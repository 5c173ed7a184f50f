"""The loops of six lasers: their equation from the tree of locks, counts by winding numbers.

The determinant is that of the six equations, written here with numpy alone, and counts are the
winding numbers of its formula.
"""

import control
import numpy as np
import pytest

from armlock import Controller, Loop, delay, paper, paper_loop, unstable_roots
from armlock.controllers import table_two, white_paper
from armlock.sensors import dual, modified_dual
from tests import dense

RING = ("12", "13", "31", "32", "23", "21")
# The trees of lisainstrument 2.3 with primary laser 12: the connection that is not used.
OPEN = {
    "N1": "32 23",
    "N2": "31 32",
    "N3": "13 31",
    "N4": "23 21",
    "N5": "21 12",
    "N6": "12 13",
}
KINDS = {
    "N1": "13 adjacent 31 distant 32 adjacent 21 distant 23 adjacent",
    "N2": "13 adjacent 31 distant 21 distant 23 adjacent 32 distant",
    "N3": "13 adjacent 21 distant 23 adjacent 32 distant 31 adjacent",
    "N4": "13 adjacent 31 distant 32 adjacent 23 distant 21 distant",
    "N5": "13 adjacent 31 distant 32 adjacent 23 distant 21 adjacent",
    "N6": "21 distant 23 adjacent 32 distant 31 adjacent 13 distant",
}
PI = Controller([-100.0], [0.0], 1e4)
LOW = 2.0 * np.pi * 8e-3


def references(tree):
    """Return the laser that each laser follows, from the ring with one connection open."""
    at = RING.index(OPEN[tree].split()[0])
    up = {RING[k]: RING[k - 1] for k in range(1, at + 1)}
    return up | {RING[k]: RING[(k + 1) % 6] for k in range(at + 1, 6)}


@pytest.mark.parametrize("tree", OPEN)
def test_the_ring_with_one_connection_open_is_the_tree_of_the_simulator(tree):
    names = KINDS[tree].split()
    found = {}
    for laser, reference in references(tree).items():
        found[laser] = "adjacent" if laser[0] == reference[0] else "distant"
    assert found == dict(zip(names[::2], names[1::2], strict=True))


@pytest.mark.parametrize("tree", OPEN)
def test_the_determinant_of_all_lasers_is_the_loop_times_the_locks(tree):
    rng = np.random.default_rng(3)
    locks = ("13", "31", "32", "23", "21")
    g = dict(zip(locks, rng.normal(size=5) + 1j * rng.normal(size=5), strict=True))
    t = {k: v / (1 + v) for k, v in g.items()}
    m1, m2, k = rng.normal(size=3) + 1j * rng.normal(size=3)
    s = 0.3 + 0.7j
    one_way = {frozenset("12"): 8.3, frozenset("13"): 8.4, frozenset("23"): 8.5}

    def seen(laser, other):  # the light of another laser where this one is
        return 1.0 if laser[0] == other[0] else np.exp(-s * one_way[frozenset(laser)])

    matrix = np.eye(6, dtype=complex)
    row = {name: i for i, name in enumerate(RING)}
    for laser, reference in references(tree).items():
        matrix[row[laser], row[laser]] += g[laser]
        matrix[row[laser], row[reference]] -= g[laser] * seen(laser, reference)
    beats = [("12", "21", m1), ("13", "31", m2)]
    if tree == "N6":
        beats[1] = ("12", "13", m2)
    for here, there, weight in beats:
        matrix[0, row[here]] += k * weight
        matrix[0, row[there]] -= k * weight * seen(here, there)
    trip1, trip2, around = (np.exp(-s * tau) for tau in (16.6, 16.8, 8.3 + 8.4 + 8.5))
    inner = t["21"] * t["23"] * t["32"] * t["31"]
    first = 1 - t["21"] * trip1
    second = t["13"] * (1 - t["31"] * trip2)
    if tree == "N3":
        second = t["13"] - inner * around
    if tree == "N5":
        first = 1 - t["13"] * inner * around
    if tree == "N6":
        second = 1 - inner * t["13"] * around
    expected = (1 + k * (m1 * first + m2 * second)) * np.prod([1 + v for v in g.values()])
    assert np.linalg.det(matrix) == pytest.approx(expected, rel=1e-12)


def rational(controller, s):
    """Evaluate a controller, factor by factor."""
    value = np.full(s.shape, controller.gain, dtype=complex)
    for zero in controller.zeros():
        value *= s - zero
    for pole in controller.poles():
        value /= s - pole
    return value


def dual_weights(s, difference, corner=paper.DUAL_SENSOR_CORNER):
    e = corner / ((s + corner) * s * difference)
    return 1 + e, 1 - e


def flight_weights(s, mean, half):
    """The sensor of the white paper, from its formula."""
    w, turn = paper.DUAL_SENSOR_CORNER, 2 * np.pi
    zb, pb, pe = turn * 5 / 13 / mean, turn * 2.5 / mean, turn / 90 / mean
    common = pb / zb / mean * (s + zb) / (s * (s + pb))
    band = s**4 / ((s + 1.4 / mean) * (s + 0.55 / mean) * (s + pe) ** 2)
    difference = w / (s + w) * band / (s * half)
    return common + band + difference, common + band - difference


def two_trips(tau1, tau2, c1=1.0, c2=1.0, controller=None, difference=None):
    """Table II or another controller on a dual arm, as 1 + L and as a loop."""
    k = table_two() if controller is None else controller
    scale = tau1 - tau2 if difference is None else difference

    def f(s):
        m1, m2 = dual_weights(s, scale)
        arms = m1 * (1 - c1 * np.exp(-s * tau1)) + m2 * (1 - c2 * np.exp(-s * tau2))
        return 1 + rational(k, s) * arms

    loop = Loop(k, dual(paper.DUAL_SENSOR_CORNER, scale), tau1, tau2)
    return f, loop.at(c1=c1, c2=c2), (100.0, tau1, 30.0, 1e-9)


def weights(sensor):
    below = sensor.denominator[::-1]
    above = sensor.numerator1[::-1], sensor.numerator2[::-1]
    return [control.tf(one, below) for one in above]


def n3(tau, sigma, corner=LOW, **errors):
    """Table II with N3, each lock wrong by a number at all frequencies."""
    t = {k: 1 - errors.get(f"e{k}", 0.0) for k in ("21", "13", "23", "32", "31")}
    inner = t["21"] * t["23"] * t["32"] * t["31"]

    def f(s):
        m1, m2 = dual_weights(s, tau - sigma, corner)
        first, second = 1 - t["21"] * np.exp(-s * tau), t["13"] - inner * np.exp(-s * sigma)
        return 1 + rational(table_two(), s) * (m1 * first + m2 * second)

    m1, m2 = weights(dual(corner, tau - sigma))
    sensor = m1 * (1 - t["21"] * delay(tau)) + m2 * (t["13"] - inner * delay(sigma))
    return f, table_two() * sensor, (100.0, sigma, 30.0, 1e-9)


def flight(lock, response, mean=33.6, half=0.255, top=3e4):
    """The white paper's loop with a lock on both returns and 7 us in the loop."""
    tau1, tau2, k = mean + half, mean - half, white_paper(20.0)

    def f(s):
        m1, m2 = flight_weights(s, mean, half)
        arms = m1 * (1 - response(s) * np.exp(-s * tau1))
        arms += m2 * (1 - response(s) * np.exp(-s * tau2))
        return 1 + rational(k, s) * np.exp(-7e-6 * s) * arms

    m1, m2 = weights(modified_dual(mean, half))
    sensor = m1 * (1 - lock * delay(tau1)) + m2 * (1 - lock * delay(tau2))
    return f, k * delay(7e-6) * sensor, (top, tau1, 1e4, 1e-9)


def triangle_of_the_white_paper():
    mean, half = 0.5 * (24.98 + 16.65), 0.5 * (24.98 - 16.65)
    return flight(1.0, lambda s: 1.0, mean, half, top=3e3)


W = 2 * np.pi * 300.0
SECOND = control.tf([1.4 * W, W**2], [1, 1.4 * W, W**2])
SIGNS = {"e13": 1.0, "e23": -1.0, "e32": -1.0, "e31": -1.0}


def worst(share):
    """Errors of the four locks with the worst signs, as a share of what is tolerated."""
    return {name: share * 6.1016e-5 / 2 * sign for name, sign in SIGNS.items()}


SYSTEMS = {
    "locks of gain 1e9 and 3.5e5": (two_trips(20.1, 19.9, 1 - 1e-9, 1 - 1 / 350_001), 0),
    "locks of gain 1e9 and 3.3e5": (two_trips(20.1, 19.9, 1 - 1e-9, 1 - 1 / 330_001), 2),
    "harmless side, inside": (two_trips(20.1, 19.9, 1 - 8.6e-3, 1 + 8.6e-3), 0),
    "harmless side, outside": (two_trips(20.1, 19.9, 1 - 8.8e-3, 1 + 8.8e-3), 2),
    "PI, half": (two_trips(33.855, 33.345, controller=PI, difference=0.255), 2),
    "PI, whole": (two_trips(33.855, 33.345, controller=PI), 0),
    "triangle": (n3(16.65, 24.98), 0),
    "triangle, shorter": (n3(16.7, 24.98), 0),
    "triangle, the paper's corner": (n3(16.65, 24.98, paper.DUAL_SENSOR_CORNER), 0),
    "its corner, shorter": (n3(16.7, 24.98, paper.DUAL_SENSOR_CORNER), 4),
    "worst signs, inside": (n3(16.65, 24.98, **worst(0.99)), 0),
    "worst signs, outside": (n3(16.65, 24.98, **worst(1.01)), 2),
    "equal locks of gain 500": (
        n3(16.65, 24.98, **dict.fromkeys(("e21", *SIGNS), 1 / 501)), 0
    ),
    "second order, 300 Hz": (
        flight(SECOND, lambda s: (1.4 * W * s + W**2) / (s**2 + 1.4 * W * s + W**2)), 6230
    ),
    "white paper on the triangle": (triangle_of_the_white_paper(), 6),
}  # fmt: skip


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_count_is_the_winding_number(name):
    (f, loop, box), expected = SYSTEMS[name]
    assert unstable_roots(loop) == expected
    assert dense.winding(f, *box) == expected


def test_a_count_that_is_wrong_is_caught():
    # The same contour with the other sign of the arms' difference.
    f, _, box = two_trips(20.1, 19.9, difference=-0.2)
    assert dense.winding(f, *box) == unstable_roots(paper_loop(difference=-0.2)) != 0
