"""Several loops at once, state spaces with delays, and roots at s = 0 that are stated."""

import math
import pickle
import re
from fractions import Fraction
from typing import Any

import control
import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    System,
    box_count,
    critical_perturbation,
    d_curve_line,
    delay,
    determinant,
    equation,
    first_crossing,
    margins,
    nyquist,
    parameter,
    peak_gain,
    return_difference,
    rightmost_root,
    s,
    stability_chart,
    state_space,
    unstable_roots,
)
from armlock.stability.semidiscretization import semi_discretization
from tests import dense, draws

# published systems ------------------------------------------------

VERHEYDEN = {
    0.0: [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -10, -4], [0, 0, 4, -10]],
    1.0: [[3, 3, 3, 3], [0, -1.5, 0, 0], [0, 0, 3, -5], [0, 5, 5, 5]],
}
WU_MICHIELS = {
    0.0: [[-9.6713, -9.7546, -9.4913], [1.8381, 1.7961, 9.5716], [1.3647, -2.7957, -7.3561]],
    0.1: [[1.0115, -9.3006, 5.3222], [7.2688, -1.1960, 9.9968], [3.6508, -1.2035, -4.8507]],
    0.15: [[7.7163, 4.5911, -5.5072], [-9.0056, -0.0260, -7.5404], [-3.3669, 0.9332, -0.2958]],
    0.25: [[7.4808, -7.2571, 9.4377], [2.8285, -7.1768, -1.4221], [-1.0353, 9.6519, 5.1208]],
}


LATE: Any = parameter("theta")


def lag(gain, time, dead):
    return control.tf([gain], [time, 1]) * delay(dead)


def pi(gain, time):
    return control.tf([gain * time, gain], [time, 0])


COLUMN = [
    [lag(12.8, 16.7, 1), lag(-18.9, 21, 3)],
    [lag(6.6, 10.9, 7), lag(-19.4, 14.4, 3)],
]


def test_the_poles_of_published_state_spaces():
    poles = state_space(VERHEYDEN)
    assert unstable_roots(poles) == 3
    assert rightmost_root(poles) == pytest.approx(0.6176424667760776, rel=1e-14)
    poles = state_space(WU_MICHIELS)
    assert unstable_roots(poles) == 0
    assert rightmost_root(poles) == pytest.approx(-0.286290980 + 3.171111576j, abs=1e-9)


@pytest.mark.parametrize(
    ("gains", "times", "count", "first"),
    [
        ((0.375, -0.075), (8.29, 23.6), 0, 5.186),
        ((0.96, -0.19), (3.25, 9.2), 0, 1.854),
        ((1.44, -0.285), (3.25, 9.2), 2, None),
        ((1.92, -0.38), (3.25, 9.2), 4, None),
    ],
)
def test_the_column_of_wood_and_berry(gains, times, count, first):
    k1 = parameter("k1", 1.0)
    one, other = (pi(*pair) for pair in zip(gains, times, strict=True))
    loops = return_difference(COLUMN, [k1 * one, other])
    assert unstable_roots(loops) == count
    product = np.array([[System.of(g) for g in row] for row in COLUMN], object)
    product = np.eye(2) + product @ np.array([[one, 0], [0, other]], object)
    # Each entry of the product has an integrator of its own, two more than there are loops.
    assert unstable_roots(determinant(product)) == BOUNDARY
    assert unstable_roots(determinant(product, at_zero=2)) == count
    if first:
        assert margins(loops.opened("k1")).gain_upper == pytest.approx(first, abs=5e-4)


# drawn systems ------------------------------------------------


def winding(parts, right_of=0.0):
    """Poles of x' = sum A_k x(t - h_k) on the right of a line."""
    unit = np.eye(len(parts[0.0]))

    def d(at):
        at = at[:, None, None] + right_of
        return np.linalg.det(at * unit - sum(a * np.exp(-at * h) for h, a in parts.items()))

    # No pole is larger than the sum of the matrices.
    top = abs(right_of) + sum(
        np.linalg.norm(a) * np.exp(-min(right_of, 0.0) * h) for h, a in parts.items()
    )
    return dense.winding(d, top, 5.0)


@pytest.mark.parametrize("seed", range(draws(4, 40)))
def test_drawn_state_spaces_have_the_poles_of_their_matrices(seed):
    rng = np.random.default_rng(seed)
    n, number = int(rng.integers(2, 7)), int(rng.integers(1, 4))
    parts = {0.0: rng.normal(size=(n, n)) - np.eye(n)}
    parts |= {h: rng.normal(size=(n, n)) for h in rng.uniform(0.1, 2.0, number)}
    poles = state_space(parts)
    assert unstable_roots(poles) == winding(parts)
    root = rightmost_root(poles)
    assert winding(parts, root.real + 1e-7) == 0
    assert winding(parts, root.real - 1e-7) == (2 if root.imag else 1)


def test_the_transfer_function_of_a_state_space_is_that_of_its_matrices():
    rng = np.random.default_rng(3)
    parts = {h: rng.normal(size=(4, 4)) for h in (0.0, 0.3, 1.1)}
    b, c, d = rng.normal(size=4), rng.normal(size=4), 0.7
    system = state_space(parts, b, c, d)
    for at in (0.3j, 2.0 - 1.0j, 5.0):
        a = sum(part * np.exp(-at * h) for h, part in parts.items())
        assert system(at) == pytest.approx(c @ np.linalg.solve(at * np.eye(4) - a, b) + d)


@pytest.mark.parametrize("seed", range(draws(7, 60)))
def test_drawn_matrices_have_the_winding_number_of_their_determinant(seed):
    rng = np.random.default_rng(seed)
    gain, dead = rng.normal(size=(2, 2)), rng.uniform(0.1, 3.0, (2, 2))
    rate = rng.choice([-0.3, 1.0, 1.0, 3.0], (2, 2)) * rng.uniform(0.5, 2.0, (2, 2))
    kp, corner = rng.uniform(0.2, 2.0, 2), rng.uniform(0.1, 1.0, 2)
    plant = [
        [control.tf([gain[i, k]], [1, rate[i, k]]) * delay(dead[i, k]) for k in (0, 1)]
        for i in (0, 1)
    ]
    controllers = [
        control.tf([k, k * c], [1, 2.0 * c]) for k, c in zip(kp, corner, strict=True)
    ]

    def d(at):
        """det(1 + P C) times all denominators."""
        p = [[gain[i, k] * np.exp(-at * dead[i, k]) / (at + rate[i, k]) for k in (0, 1)]
             for i in (0, 1)]  # fmt: skip
        c = [k * (at + w) / (at + 2.0 * w) for k, w in zip(kp, corner, strict=True)]
        found = (1 + p[0][0] * c[0]) * (1 + p[1][1] * c[1]) - p[0][1] * c[1] * p[1][0] * c[0]
        for pole in (*rate.ravel(), *(2.0 * corner)):
            found = found * (at + pole)
        return found / (1 + abs(at)) ** 6

    loops = return_difference(plant, controllers)
    assert loops.numerator.degree == 6
    assert unstable_roots(loops) == dense.winding(d, 300.0, 6.0)
    root = rightmost_root(loops)
    assert abs(d(root)) < 1e-9


# what a determinant keeps ------------------------------------------------


def test_hidden_unstable_modes_of_entries_count():
    unstable, stable = control.tf([1], [1, -1]), control.tf([1], [1, 2])
    # The other loop does not see it.
    one_way = [[stable, unstable], [0, stable]]
    assert unstable_roots(return_difference(one_way, [1.0, 1.0])) == 1
    # Entries of a row that differ are two systems, with a mode each; of which one is hidden.
    both = [[unstable, control.tf([1], [1, 1, -2])], [stable, stable]]
    alone = return_difference(both, [0.0, 0.0])
    assert unstable_roots(alone) == 2
    # One transfer function, up to a number, is one system.
    same = [[unstable, 2 * unstable], [stable, stable]]
    assert unstable_roots(return_difference(same, [0.0, 0.0])) == 1
    # A pole that a zero covers stays.
    covered = control.tf([1, -1], [1, -1])
    assert unstable_roots(return_difference([[covered * stable]], [3.0])) == 1
    # As one state space the two outputs share the mode.
    a, b, c = [[1.0, 0.0], [0.0, -2.0]], [[1.0], [1.0]], [[1.0, 0.0], [1.0, 1.0]]
    assert unstable_roots(return_difference((a, b, c), [[0.0, 0.0]])) == 1
    assert unstable_roots(return_difference((a, b, c), [[3.0, 0.0]])) == 0


def test_a_state_space_closes_as_its_transfer_functions_do():
    rng = np.random.default_rng(5)
    parts = {h: rng.normal(size=(3, 3)) for h in (0.0, 0.4)}
    b, c = rng.normal(size=(3, 2)), rng.normal(size=(2, 3))
    k1 = parameter("k1", 0.8)
    whole = return_difference((parts, b, c), [k1, control.tf([1], [1, 3])])
    assert whole.numerator.degree == 4
    for k in (0.0, 0.8, 4.0):
        closed = {h: part.copy() for h, part in parts.items()}
        closed[0.0] = np.block(
            [[closed[0.0] - k * np.outer(b[:, 0], c[0]), -b[:, 1:]], [c[1:], -3.0 * np.eye(1)]]
        )
        closed[0.4] = np.block([[closed[0.4], np.zeros((3, 1))], [np.zeros((1, 4))]])
        assert unstable_roots(whole, k) == winding(closed)
    ss = control.ss([[-1.0, 2.0], [0.5, -3.0]], np.eye(2), np.eye(2), np.zeros((2, 2)))
    found = return_difference(ss, [2.0, -1.0])
    assert rightmost_root(found).real == pytest.approx(
        np.linalg.eigvals(ss.A - np.diag([2.0, -1.0])).real.max()
    )


def test_a_loop_is_opened_at_a_parameter():
    k = parameter("k", 2.0)
    loop = k * control.tf([1], [1, 1]) * delay(0.5)
    for whole in (loop, equation(1 + loop)):
        assert whole.opened("k")(0.7j) == pytest.approx(loop(0.7j))
        assert margins(whole.opened("k")) == margins(loop)
    several = loop * parameter("k2")
    for system, known in ((loop, "(k)"), (several, "(k, k2)"), (1 / s, "(it has none)")):
        words = f"name must be one of the parameters of the system {known}, got 'kp'"
        with pytest.raises(TypeError, match=f"^{re.escape(words)}$"):
            system.opened("kp")
    with pytest.raises(ValueError, match=r"in which D is affine, .* got 'k'$"):
        (loop * k).opened("k")


def test_rounding_that_may_hide_an_integrator_is_told():
    turn = np.array([[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]])
    a = turn @ np.diag([0.0, -0.3]) @ turn.T
    parts = {0.0: a - np.diag([0.1, 0.2]), 1.0: np.diag([0.1, 0.2])}
    with pytest.raises(ValueError, match="rounding hides whether more than 0 roots"):
        state_space(parts)
    assert unstable_roots(state_space(parts, at_zero=1)) == 0
    assert unstable_roots(state_space({0: [[-1.0]], 1: [[1.0]]})) == BOUNDARY
    # Two tanks, the flow from one to the other late: nothing leaves them.
    still, late = np.diag([-0.1, -0.3 - 0.2]), [[0.0, 0.3 + 0.2], [0.1, 0.0]]
    tanks = {0.0: turn @ still @ turn.T, 2.0: turn @ late @ turn.T}
    b, c = turn @ [1.0, 0.0], turn @ [0.0, 1.0]
    gain = 0.05
    with pytest.raises(ValueError, match=r"state_space\(\.\.\., integrators=0"):
        state_space(tanks, b, c)
    meant = state_space(tanks, b, c, integrators=1)
    assert unstable_roots(gain * meant * (1 - delay(3.0))) == 0
    with pytest.raises(ValueError, match=r"at_zero must be the number of roots .* got 1"):
        state_space(VERHEYDEN, at_zero=1)
    with pytest.raises(TypeError, match="integrators and zeros are for b and c"):
        state_space(VERHEYDEN, integrators=0)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: determinant([[1, 2]]), ValueError, "matrix must be square, got 1 x 2"),
        (lambda: determinant([[1, 2], [3]]), ValueError, "matrix must have rows of one length"),
        (lambda: determinant([[s, s], [s, s]]), ValueError, "must not be zero everywhere"),
        (lambda: determinant([["a"]]), TypeError, "matrix must be a System"),
        (lambda: state_space({0: [[np.nan]]}), ValueError, "a must be finite"),
        (lambda: state_space({1 / (s + 1): [[-3.0]]}), TypeError, "a key of a must be"),
        (lambda: state_space({2 * delay(1): [[-3.0]]}), TypeError, "a key of a must be"),
        (lambda: state_space({parameter("tau"): [[1.0]]}), TypeError, "a key of a must be"),
        (lambda: state_space({-1.0: [[1.0]]}), ValueError, "theta must not be negative"),
        (lambda: delay(LATE), TypeError, "no system is affine in a delay"),
        (lambda: state_space([[1.0, 2.0]]), ValueError, "a must hold square matrices"),
        (lambda: state_space([[1.0]], [1.0]), TypeError, "b and c must be given both"),
        (lambda: state_space([[1.0]], [1, 2], [1]), ValueError, "b and c must have 1 numbers"),
        (lambda: state_space([[1]], [1], [1], [0, 1]), ValueError, "and d one, got 1, 1 and 2"),
        (lambda: return_difference([[1 / s]], [1, 1]), ValueError, "controllers must be 1 x 1"),
        (lambda: return_difference([[s]], [1]), ValueError, "must not have more zeros than"),
        (lambda: return_difference([[-1]], [1]), ValueError, "must be well posed"),
        (lambda: equation(s, at_zero=2), ValueError, "at_zero must be .* got 2: there are 1"),
        (lambda: equation(s, at_zero=-1), ValueError, "at_zero must be"),
        (lambda: equation(s, at_zero=True), ValueError, "at_zero must be an integer"),
        (lambda: state_space([[0]], [1], [1], at_zero=1), TypeError, "with b and c, got 1"),
    ],
)
def test_what_is_refused(make, error, words):
    with pytest.raises(error, match=words):
        make()


PLANT = control.ss([[-1.0, 2.0], [0.0, -3.0]], [[1.0], [1.0]], [[1.0, 0.0]], 0.5)
PAIR = control.tf([[[1], [2]], [[0], [3]]], [[[1, 1], [1, 4]], [[1], [1, 3]]])


@pytest.mark.parametrize(
    "make",
    [
        lambda: state_space(PLANT),
        lambda: state_space({0: PLANT, 1.0: PLANT}),
        lambda: state_space(control.tf([1], [1, 1])),
        lambda: state_space(PLANT.A, PLANT, PLANT.C),
        lambda: return_difference((PLANT, PLANT.B, PLANT.C), [1]),
    ],
)
def test_a_system_in_place_of_matrices_is_refused(make):
    with pytest.raises(TypeError, match=r"^[ab] must hold real numbers, got a"):
        make()


def test_what_to_write_for_systems_of_python_control_is_right():
    written = state_space(PLANT.A, PLANT.B, PLANT.C, PLANT.D)
    assert written(0.3j) == pytest.approx(PLANT(0.3j))
    assert System.of(PLANT)(0.3j) == pytest.approx(PLANT(0.3j))
    for name, make in {
        "matrix": determinant,
        "plant": lambda p: return_difference(p, [1, 1]),
        "controllers": lambda p: return_difference([[1, 0], [0, 1]], p),
    }.items():
        with pytest.raises(TypeError, match=rf"^{name} must be a list of rows of systems"):
            make(PAIR)
    entries = [[PAIR[i, k] for k in range(PAIR.ninputs)] for i in range(PAIR.noutputs)]
    # (s + 2)(s + 6), and the mode of the entry that closes no loop.
    loops = return_difference(entries, [1, 1])
    for root in (-2.0, -4.0, -6.0):
        assert loops(root) == pytest.approx(0.0, abs=1e-12)
    assert loops.numerator.degree == 3


def test_a_plant_in_discrete_time_is_refused():
    sampled = control.ss([[0.5]], [[1.0]], [[1.0]], 0, dt=0.1)
    with pytest.raises(ValueError, match=r"^plant must be continuous in time, got .* 0\.1"):
        return_difference(sampled, [1.0])


def test_too_many_states_are_refused(monkeypatch):
    monkeypatch.setattr("armlock.matrices._MOST_PRODUCTS", 10_000)
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="takes less than a minute, got one of 20 rows"):
        state_space({float(h): rng.normal(size=(20, 20)) for h in range(4)})


# roots at s = 0 ------------------------------------------------


def kernel(at, h):
    """The integral of exp(-s t) from 0 to h."""
    x = np.asarray(at, complex) * h
    small = np.where(x == 0.0, 1.0, x)
    return np.where(np.abs(x) < 1e-5, h * (1 - x / 2 + x**2 / 6), -np.expm1(-small) / small * h)


def averaging(h):
    return (1 - delay(h)) / s


def test_the_uniform_kernel_is_stable_below_a_known_gain():
    k, limit = parameter("k", 2.0), math.pi**2 / 4.0
    loop = k / s * averaging(2.0) / 2.0
    for system in (loop, equation(1 + loop, at_zero=1)):
        gains = np.array([0.1, 0.999 * limit, 1.001 * limit])
        assert unstable_roots(system, gains).tolist() == [0, 0, 2]
        assert [unstable_roots(system, g) for g in gains] == [0, 0, 2]
        assert abs(rightmost_root(system, limit).real) < 1e-10
    assert unstable_roots(equation(1 + loop), 1.0) == BOUNDARY
    assert margins(loop, 1.0).gain_upper == pytest.approx(limit, rel=1e-6)


@pytest.mark.parametrize("seed", range(draws(7, 60)))
def test_loops_with_moving_averages_are_counted_without_their_zeros(seed):
    """L = k exp(-s d) Q_1 (1 + g Q_2) / (s + p), with two moving averages Q."""
    rng = np.random.default_rng(seed)
    (h, h2), d = rng.uniform(0.2, 2.0, 2), 0.3
    k, g, p = rng.normal(size=3) * (3.0, 1.0, 1.0)
    first, second = averaging(h), averaging(h2)
    loop = k * delay(d) * first * (1 + g * second) / (s + p)

    def closed(at):
        whole = at + p + k * np.exp(-at * d) * kernel(at, h) * (1 + g * kernel(at, h2))
        return whole / (1 + abs(at))

    count = dense.winding(closed, 300.0, 5.0)
    several = return_difference([[loop]], [1], at_zero=2)
    for system in (loop, equation(1 + loop, at_zero=2), several):
        assert unstable_roots(system) == count
        root = rightmost_root(system)
        assert abs(closed(root)) < 1e-9
        assert (root.real > 0) == (count > 0)
        if root.imag:
            assert unstable_roots(system, right_of=root.real - 1e-3) >= 2
        assert unstable_roots(system, right_of=root.real + 1e-6) == 0
    for fewer in (0, 1):
        assert unstable_roots(equation(1 + loop, at_zero=fewer)) == BOUNDARY
    with pytest.raises(ValueError, match=r"got 3: there are 2 .* denominators makes 2"):
        equation(1 + loop, at_zero=3)
    # Next to s = 0 the value is that of the integral.
    near = np.array([0.0, 1e-9, 1e-3, 0.03j])
    assert first(near) == pytest.approx(kernel(near, h), rel=1e-12)
    assert loop(near) == pytest.approx(
        k * np.exp(-near * d) * kernel(near, h) * (1 + g * kernel(near, h2)) / (near + p),
        rel=1e-10,
    )


def test_a_root_at_zero_is_counted_until_it_is_stated():
    late = s * averaging(1.0)
    made = equation(late / (s + 2) + s / (s + 1))
    assert unstable_roots(made) == BOUNDARY
    assert rightmost_root(made) == 0.0
    rest = equation(late / (s + 2) + s / (s + 1), at_zero=1)
    assert unstable_roots(rest) == 0
    assert rightmost_root(rest) == pytest.approx(-1.3242798054, abs=1e-9)
    same = [equation(1 + late / (s + 2)), equation(s + 3 - delay(1.0))]
    assert rightmost_root(same[0]) == rightmost_root(same[1])
    d = averaging(0.2)
    for number, count in ((None, BOUNDARY), (2, BOUNDARY), (3, 0)):
        pair = determinant([[s - 0.2 + d, 0], [d, s + 1]], at_zero=number)
        assert unstable_roots(pair) == count


def test_moving_averages_in_a_matrix_are_stated():
    a = averaging(2.0) / 2.0
    plant = [[a / (s + 1), a / (s + 2)], [a / 2 / (s + 3), a / (s + 0.5)]]
    found = return_difference(plant, [1, 2], at_zero=2)
    assert unstable_roots(found) == 0
    assert rightmost_root(found) == pytest.approx(-0.28596183 + 1.66245312j, abs=1e-8)

    def d(at):
        p = [[kernel(at, 2.0) / 2 / (at + 1), kernel(at, 2.0) / 2 / (at + 2)],
             [kernel(at, 2.0) / 4 / (at + 3), kernel(at, 2.0) / 2 / (at + 0.5)]]  # fmt: skip
        return (1 + p[0][0]) * (1 + 2 * p[1][1]) - 2 * p[0][1] * p[1][0]

    assert abs(d(rightmost_root(found))) < 1e-12
    # The poles at -1, -2, -3 and -0.5 lie left of neither line.
    for line in (-0.2, -0.4):
        count = dense.winding(lambda at, line=line: d(at + line), 300.0, 5.0)
        assert unstable_roots(found, right_of=line) == count
    for fewer in (None, 1):
        assert rightmost_root(return_difference(plant, [1, 2], at_zero=fewer)) == 0.0
    with pytest.raises(ValueError, match=r"got 3: there are 2 .* clearing .* makes 2"):
        return_difference(plant, [1, 2], at_zero=3)


def test_a_hidden_integrator_counts():
    def loops(pole, first=1, **stated):
        plant = [[first / (s + 1), 0], [0, 1 / (s - pole)]]
        return return_difference(plant, [[1, 0], [0, 0]], **stated)

    assert [unstable_roots(loops(pole)) for pole in (-1, 0, 1)] == [0, BOUNDARY, 1]
    assert unstable_roots(loops(0, at_zero=1)) == 0
    # Clearing the average makes one of two.
    average = averaging(1.0)
    counts = [unstable_roots(loops(0, average, at_zero=k)) for k in range(3)]
    assert counts == [BOUNDARY, BOUNDARY, 0]
    with pytest.raises(ValueError, match=r"got 3: there are 2 .* clearing .* makes 1"):
        loops(0, average, at_zero=3)
    # Two entries of a row are two systems, with an integrator each.
    row = [[1 / s, 1 / (s * (s + 1))], [0, 0]]
    assert unstable_roots(return_difference(row, [[1, 0], [1, 0]])) == BOUNDARY


def ring(weight=1, **stated):
    neighbours = np.roll(np.eye(4), 1, 0) + np.roll(np.eye(4), -1, 0)
    return lambda tau: state_space({tau: weight * (neighbours - 2 * np.eye(4))}, **stated)


@pytest.mark.parametrize("weight", [1.0, 0.1, 0.3, 2.7])
def test_consensus_on_a_ring_of_four(weight):
    # The eigenvalue 4 of the Laplacian reaches the axis first.
    limit = math.pi / 8.0 / weight
    counts = [unstable_roots(ring(weight, at_zero=1)(x * limit)) for x in (0.999, 1.001)]
    assert counts == [0, 2]
    assert unstable_roots(ring(weight)(0.5 * limit)) == BOUNDARY


def test_weights_in_decimals_leave_the_agreement_to_be_stated():
    late = [[-0.3, 0.1, 0.2], [0.3, -0.4, 0.1], [0.6, 0.1, -0.7]]
    z = delay(0.3)
    rows = [[s * int(i == k) - late[i][k] * z for k in range(3)] for i in range(3)]
    for make in (
        lambda **stated: determinant(rows, **stated),
        lambda **stated: state_space({0.3: late}, **stated),
        lambda **stated: equation(s + 0.3 * z - 0.1 * z - 0.2 * z, **stated),
        lambda **stated: equation(s + 0.1 * z + 0.2 * z - 0.3 * z, **stated),
        lambda **stated: equation(s + Fraction(0.3) * z - (0.1 + Fraction(0.2)) * z, **stated),
    ):
        with pytest.raises(ValueError, match=r"rounding hides .* at_zero=0 of equation, "):
            make()
        meant = make(at_zero=1)
        assert meant.numerator.order() == 1
        if len(meant.numerator.terms) > 1:
            assert unstable_roots(meant) == 0
        # Zero says that the numbers hold as they are.
        assert unstable_roots(make(at_zero=0)) in (0, 1)
        with pytest.raises(ValueError, match="got 2: there are 0 exactly and 1 within"):
            make(at_zero=2)
    # Two groups: with one of two stated the sign of D'(0) is rounding still.
    two = np.kron(np.eye(2), late)
    with pytest.raises(ValueError, match="more than 1 roots"):
        state_space({0.3: two}, at_zero=1)
    assert unstable_roots(state_space({0.3: two}, at_zero=2)) == 0


def test_what_is_stated_holds_for_all_parameters_and_stays():
    k, q = parameter("k", 1.0), parameter("q", 1.0)
    loop = k * averaging(1.0) / (s + q)
    made = equation(1 + loop, at_zero=1)
    assert made.at_zero == made.at(k=2.0).at_zero == 1
    assert repr(made).endswith("= 0, parameters k, q, without 1 roots at s = 0>")
    assert d_curve_line(made) == d_curve_line(loop) == (1.0, 1.0, 0.0)
    assert pickle.loads(pickle.dumps(made)) == made != equation(1 + loop)
    gains = np.linspace(-4.0, 30.0, 9)
    assert unstable_roots(made, k=gains).tolist() == unstable_roots(loop, k=gains).tolist()
    poles = [-0.5, 0.25, 1.0]
    charts = [stability_chart(x, k=gains, q=poles).counts for x in (made, loop)]
    assert charts[0].tolist() == charts[1].tolist()
    assert box_count(made, 0.2) == box_count(loop, 0.2) == 0
    assert critical_perturbation(made, {"k": 1}) == critical_perturbation(loop, {"k": 1})
    crossings = [first_crossing(x, {}, {"k": -1}) for x in (made, loop)]
    assert crossings[0] == crossings[1]
    assert repr(margins(made.opened("k"))) == repr(margins(loop))
    assert peak_gain(1 / (1 + made.opened("k"))) == peak_gain(1 / (1 + loop))
    assert nyquist(made.opened("k")).encirclements == 0
    difference = equation(s + k * delay(1.0) - k * delay(2.0), at_zero=1)
    found = semi_discretization(difference, 0.05)
    assert found.at_zero == 1
    gains = np.array([-1.5, -0.5, 0.5, 4.0])
    assert unstable_roots(found, gains).tolist() == unstable_roots(difference, gains).tolist()
    assert unstable_roots(difference, gains).tolist() == [1, 0, 0, 2]
    with pytest.raises(ValueError, match="at_zero must be 0 or 1: a map keeps one root"):
        semi_discretization(equation(s**2 * (s + delay(1.0)), at_zero=2), 0.1)
    # A root that is not stated stays in the open loop, and is named.
    with pytest.raises(ValueError, match="has 1 roots at s = 0 for all values of k, got at_z"):
        equation(1 + loop).opened("k")
    hidden = determinant([[s + k, 0], [0, s + q]], at_zero=0)
    assert unstable_roots(hidden.opened("k"), q=0.0) == BOUNDARY
