"""Several loops at once, state spaces with delays, and distributed delays."""

import math
import re
from typing import Any

import control
import mpmath
import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    CountError,
    System,
    delay,
    determinant,
    distributed_delay,
    equation,
    margins,
    nyquist,
    parameter,
    return_difference,
    rightmost_root,
    s,
    state_space,
    unstable_roots,
)
from armlock.stability.semidiscretization import semi_discretization
from armlock.systems import exponential
from tests import independent

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
    assert unstable_roots(determinant(product)) == count
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
    return independent.winding(d, top, 5.0)


@pytest.mark.parametrize("seed", range(10))
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


@pytest.mark.parametrize("seed", range(20))
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
    assert unstable_roots(loops) == independent.winding(d, 300.0, 6.0)
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
    poles = state_space({0.0: a - np.diag([0.1, 0.2]), 1.0: np.diag([0.1, 0.2])})
    assert len(poles.others) == 3
    assert not state_space(VERHEYDEN).others
    assert unstable_roots(state_space({0: [[-1.0]], 1: [[1.0]]})) == BOUNDARY
    # Two tanks, the flow from one to the other late: nothing leaves them.
    still, late = np.diag([-0.1, -0.3 - 0.2]), [[0.0, 0.3 + 0.2], [0.1, 0.0]]
    tanks = {0.0: turn @ still @ turn.T, 2.0: turn @ late @ turn.T}
    b, c = turn @ [1.0, 0.0], turn @ [0.0, 1.0]
    gain = 0.05
    with pytest.raises(CountError, match=r"state_space\(\.\.\., integrators=1\)"):
        unstable_roots(gain * state_space(tanks, b, c) * (1 - delay(3.0)))
    meant = state_space(tanks, b, c, integrators=1)
    assert not meant.others
    assert unstable_roots(gain * meant * (1 - delay(3.0))) == 0
    with pytest.raises(ValueError, match="integrators must be 0, got 1"):
        state_space(VERHEYDEN, integrators=1)


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
        (lambda: distributed_delay(0.0), ValueError, "horizon must be positive"),
        (lambda: distributed_delay(s), TypeError, "horizon must be what delay"),
        (
            lambda: semi_discretization(distributed_delay(1.0) / s, 0.1),
            ValueError,
            "got a distributed delay",
        ),
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
def test_a_system_in_place_of_matrices_is_refused_with_what_to_write(make):
    with pytest.raises(TypeError, match=r"^[ab] must hold numbers, got a .*System\.of\(p\)"):
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
        with pytest.raises(TypeError, match=rf"^{name} must be .* rows, .* write \[\[p\[i, k"):
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


# distributed delays ------------------------------------------------


def kernel(at, h, a):
    """The integral of exp(a t - s t) from 0 to h."""
    x = (np.asarray(at, complex) - a) * h
    small = np.where(x == 0.0, 1.0, x)
    return np.where(np.abs(x) < 1e-5, h * (1 - x / 2 + x**2 / 6), -np.expm1(-small) / small * h)


def test_finite_spectrum_assignment_has_one_root():
    z, gain = delay(1.0), 3.0
    loop = gain * math.e / (1 + gain * distributed_delay(z, 1.0)) * z / (s - 1)
    for system in (loop, equation(1 + loop)):
        assert unstable_roots(system) == 0
        assert rightmost_root(system) == pytest.approx(-2.0, abs=1e-12)
    inside = independent.winding(lambda at: 1 + gain * kernel(at, 1.0, 1.0), 100.0, 1.0)
    assert inside == 2
    # Those of the controller, and the pole of the plant.
    assert nyquist(loop).open_loop_poles == 3
    assert margins(loop).gain_lower < 1.0 < margins(loop).gain_upper


def test_the_uniform_kernel_is_stable_below_a_known_gain():
    k, limit = parameter("k", 2.0), math.pi**2 / 4.0
    loop = k / s * distributed_delay(2.0) / 2.0
    for system in (loop, equation(1 + loop)):
        gains = np.array([0.1, 0.999 * limit, 1.001 * limit])
        assert unstable_roots(system, gains).tolist() == [0, 0, 2]
        assert [unstable_roots(system, g) for g in gains] == [0, 0, 2]
        assert abs(rightmost_root(system, limit).real) < 1e-10
    assert margins(loop, 1.0).gain_upper == pytest.approx(limit, rel=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_loops_with_distributed_delays_are_counted_without_their_known_zeros(seed):
    """L = k exp(-s d) Q_1 (1 + g Q_2) / (s + p), with two distributed delays Q."""
    rng = np.random.default_rng(seed)
    (h, h2), a, d = rng.uniform(0.2, 2.0, 2), float(rng.uniform(-1.0, 2.0)), 0.3
    a2 = a if seed % 3 else float(rng.uniform(-1.0, 1.0))
    k, g, p = rng.normal(size=3) * (3.0, 1.0, 1.0)
    first, second = distributed_delay(h, a), distributed_delay(h2, a2)
    loop = k * delay(d) * first * (1 + g * second) / (s + p)

    def closed(at):
        whole = at + p + k * np.exp(-at * d) * kernel(at, h, a) * (1 + g * kernel(at, h2, a2))
        return whole / (1 + abs(at))

    count = independent.winding(closed, 300.0, 5.0)
    assert unstable_roots(loop) == unstable_roots(equation(1 + loop)) == count
    root = rightmost_root(loop)
    assert abs(closed(root)) < 1e-9
    assert (root.real > 0) == (count > 0)
    if root.imag:
        at = root.real - 1e-3
        assert unstable_roots(loop, right_of=at) >= 2
    assert unstable_roots(loop, right_of=root.real + 1e-6) == 0
    # Next to a known zero the value is that of the integral.
    near = a + np.array([0.0, 1e-9, 1e-3, 0.03j])
    assert first(near) == pytest.approx(kernel(near, h, a), rel=1e-9)
    assert loop(near) == pytest.approx(
        k
        * np.exp(-near * d)
        * kernel(near, h, a)
        * (1 + g * kernel(near, h2, a2))
        / (near + p),
        rel=1e-8,
    )


def test_a_pole_at_a_known_zero_counts():
    """Of (Q + 1/(s - 1)) the pole is a pole; of Q times 1/(s - 1) too."""
    q, p = distributed_delay(1.0, 1.0), 1 / (s - 1)
    assert (q + p).known == {}
    assert unstable_roots(equation(1 / (q + p))) == 1
    assert unstable_roots(equation(1 / (q * p))) == 1
    assert unstable_roots(equation(1 / q)) == 0
    assert (q * p)(1.0) == complex(np.inf)


def test_exponentials_are_exact_until_they_are_rounded():
    q, z = distributed_delay(1.0, 0.3), delay(2.0)
    assert (q - q).numerator.terms == {}
    assert equation(z + q * q).known == {next(iter(q.known)): 2}
    with mpmath.workprec(600):
        x = next(iter(q.numerator.lags - {()})).time * 0 + next(iter(q.known))
        value, exact = exponential(x), mpmath.exp(mpmath.mpf(int(x.p)) / int(x.q))
        assert abs(mpmath.mpf(int(value.p)) / int(value.q) / exact - 1) < mpmath.mpf(2) ** -511
