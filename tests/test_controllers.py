"""Controllers: forms of one thing, and what they refuse."""

from __future__ import annotations

import contextlib
from fractions import Fraction
from functools import partial

import control
import numpy as np
import pytest
from flint import fmpq

from armlock import (
    Controller,
    Loop,
    System,
    delay,
    determinant,
    margins,
    nyquist,
    return_difference,
    rightmost_root,
    s,
    state_space,
    unstable_roots,
)
from armlock.controllers import table_two
from armlock.paper import TABLE_2_POLES, TABLE_2_STAGE_1_POLE, TABLE_2_ZEROS
from armlock.sensors import COMMON

S = np.array([1e-9j, 1e-5j, 0.3 + 0.2j, -0.1 + 2j, 1.5])


@pytest.mark.parametrize(
    ("zeros", "poles", "gain"),
    [
        ((), (0.0,), 0.4),
        ((-0.02,), (0.0, -0.1), 1.0),
        ((0.0, -3.0), (-1.0 + 2j, -1.0 - 2j), 2.5),
        ((-0.5 + 1j, -0.5 - 1j), (0.0, 0.3, -4.0), -0.7),
        ((), (), 5.0),
    ],
)
def test_all_forms_give_one_loop(zeros, poles, gain):
    above = gain * np.atleast_1d(np.poly(zeros)).real
    below = np.atleast_1d(np.poly(poles)).real
    forms = [
        (zeros, poles, gain),
        Controller(zeros, poles, gain),
        control.tf(above, below),
        control.zpk(zeros, poles, gain),
        control.tf2ss(control.tf(above, below)),
    ]
    loops = [Loop(form, COMMON, 2.1, 1.9) for form in forms]
    x, y = np.meshgrid([0.5, 0.9, 1.2], [0.3, 0.95, 1.1])
    expected = loops[0](S[2:], 0.9, 1.1)
    for loop in loops:
        np.testing.assert_allclose(loop(S[2:], 0.9, 1.1), expected, rtol=1e-12)
        np.testing.assert_array_equal(
            unstable_roots(loop, x, y), unstable_roots(loops[0], x, y)
        )


def test_table_two_is_the_product_of_its_factors():
    s = S
    value = 5000.0 * s**2 / (s + TABLE_2_STAGE_1_POLE) ** 2
    for zero, pole in zip(TABLE_2_ZEROS, TABLE_2_POLES, strict=True):
        value = value * (s + zero) / (s + pole)
    np.testing.assert_allclose(table_two()(s), value, rtol=1e-13)


@pytest.mark.parametrize(
    ("combine", "expected"),
    [
        (lambda k, tf: 2 * k, lambda k, tf: 2 * k),
        (lambda k, tf: np.float64(2.0) * k, lambda k, tf: 2 * k),
        (lambda k, tf: k / 2, lambda k, tf: k / 2),
        (lambda k, tf: 1 / k**2, lambda k, tf: k**-2),
        (lambda k, tf: -k, lambda k, tf: -k),
        (lambda k, tf: 1 - k, lambda k, tf: 1 - k),
        (lambda k, tf: k + 1, lambda k, tf: k + 1),
        (lambda k, tf: k * tf, lambda k, tf: k * tf),
        (lambda k, tf: tf * k, lambda k, tf: k * tf),
        (lambda k, tf: tf - k, lambda k, tf: tf - k),
        (lambda k, tf: k.feedback(tf), lambda k, tf: k / (1 + k * tf)),
    ],
)
def test_controllers_are_combined_as_systems_are(combine, expected):
    k, tf = Controller((-2.0,), (-1.0, -3.0), 3.0), control.tf([1.0], [2.0, 1.0])
    found = combine(k, tf)
    values = k(S), 1.0 / (2.0 * S + 1.0)
    np.testing.assert_allclose(found(S), expected(*values), rtol=1e-12)
    np.testing.assert_allclose(combine(k, System.of(tf))(S), found(S), rtol=1e-12)
    assert Loop(System.of(k), "common", 3.0, 2.0).controller == k
    assert control.evalfr(k, 1j) == pytest.approx(complex(k(1j)))


def test_what_has_a_delay_or_is_zero_is_no_controller():
    k = Controller((-2.0,), (-1.0,), 3.0)
    with pytest.raises(ValueError, match=r"^controller must hold no delay"):
        Loop(k * delay(1.0), "common", 3.0, 2.0)
    with pytest.raises(ValueError, match=r"^controller must not be zero"):
        Loop(k - k, "common", 3.0, 2.0)
    assert (k - k)(1.0) == (k - System.of(k))(1.0) == 0.0
    with pytest.raises(TypeError, match=r"^system must be a System, a number"):
        k * "x"


def exact_quotient(a, b, c):
    """Numerator and denominator of C (s - A)^-1 B in fractions, ascending, by Leverrier."""
    a, b, c = (np.vectorize(Fraction, otypes=[object])(np.array(m)) for m in (a, b, c))
    n, below, above = len(a), [Fraction(1)], []
    power = np.array([[Fraction(int(i == k)) for i in range(n)] for k in range(n)])
    for k in range(1, n + 1):
        above.append((c @ power @ b).item())
        power = a @ power
        below.append(-np.trace(power) / k)
        power = power + below[-1] * np.array(
            [[Fraction(int(i == j)) for i in range(n)] for j in range(n)]
        )
    return above[::-1], below[::-1]


def test_a_state_space_arrives_exactly():
    rng = np.random.default_rng(0)
    turn, _ = np.linalg.qr(rng.normal(size=(8, 8)))
    far = turn @ (np.triu(np.full((8, 8), 1e4), 1) - np.eye(8)) @ turn.T
    tanks = np.array([[-3, 1, 2], [1, -2, 1], [2, 1, -3]])
    for matrix in (far, tanks, rng.normal(size=(4, 4))):
        n = len(matrix)
        b, c = rng.normal(size=(n, 1)), rng.normal(size=(1, n))
        # Whether the first has a pole at s = 0 is asked for: it is far from normal.
        stated = 0 if matrix is far else None
        found = System.of(control.ss(matrix, b, c, 0), integrators=stated, zeros=stated)
        above, below = exact_quotient(matrix, b, c)
        for p, expected in ((found.numerator, above), (found.denominator, below)):
            assert [Fraction(str(c)) for c in p.whole().coeffs()] == expected
    through = System.of(control.ss([[-2.0]], [[1.0]], [[3.0]], [[0.5]]))
    assert through.numerator.whole().coeffs() == [4, fmpq(1, 2)]
    with pytest.raises(ValueError, match=r"^controller must not be zero"):
        Loop(control.ss([[-1.0]], [[0.0]], [[1.0]], [[0.0]]), "single", 2.0)
    with pytest.raises(ValueError, match=r"^system must be continuous in time"):
        System.of(control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1))


def test_a_pole_that_is_exactly_zero_cancels_with_the_sensor():
    # Three tanks, exactly (2 s + 5) / (s^3 + 8 s^2 + 15 s).
    a, b, c = [[-3, 1, 2], [1, -2, 1], [2, 1, -3]], [[1], [0], [0]], [[0, 0, 1]]
    loop = Loop(control.ss(a, b, c, 0), "common", tau1=3.0, tau2=2.0)
    assert unstable_roots(loop) == 0
    assert rightmost_root(loop) == pytest.approx(-0.462922787 + 1.735157345j, rel=1e-9)
    found = margins(loop)
    assert (found.gain_upper, found.phase, found.delay, found.modulus) == pytest.approx(
        (8.3171951, 1.4479440, 1.1925036, 0.7569841), rel=1e-6
    )
    # A rigid body with a flexible mode, exactly (2 s + 7) / (s^4 + 4 s^3 + 14 s^2).
    a = [[0, 1, 0, 0], [-7, -2, 7, 2], [0, 0, 0, 1], [7, 2, -7, -2]]
    body = System.of(control.ss(a, [[0], [1], [0], [0]], [[0, 0, 1, 0]], 0))
    found = margins(control.tf([0.3, 0.05], [0.05, 1]) * body * delay(0.2))
    assert (found.gain_upper, found.phase, found.delay, found.modulus) == pytest.approx(
        (16.7498748, 0.8192338, 4.1583202, 0.7906824), rel=1e-6
    )


# A PI controller in other coordinates: rounding leaves 4e-18 of its determinant.
TURNED = control.ss(
    [[0.2639750240018368, 0.15341104878230838], [-0.6262933241092226, -0.36397502400183684]],
    [[-2.384531185626904], [0.9415187178512434]],
    [[-0.5360263721298273, -0.295449888980301]],
    0,
)


def test_a_pole_that_may_be_zero_is_asked_for_at_every_door():
    tanks = control.tf([-5e-15, 2.0, 5.0], [1.0, 8.0, 15.0, -1.3e-14])
    for system in (TURNED, tanks):
        for ask in (
            lambda k: System.of(k),
            lambda k: delay(1.0) * k,
            lambda k: Controller([], [-1.0], 1.0).feedback(k),
            lambda k: Loop(k, "common", tau1=3.0, tau2=2.0),
            lambda k: unstable_roots(k),
            lambda k: return_difference([[k]], [1.0]),
            lambda k: return_difference([[1.0]], [k]),
            lambda k: determinant([[k]]),
        ):
            with pytest.raises(
                ValueError, match=r"more than 0 poles .*\(system, integrators=0"
            ):
                ask(system)
    matrices = TURNED.A, TURNED.B.ravel(), TURNED.C.ravel()
    with pytest.raises(ValueError, match=r"state_space\(..., integrators=0"):
        state_space(*matrices)
    for plant in (TURNED, (TURNED.A, TURNED.B, TURNED.C)):
        with pytest.raises(ValueError, match=r"at_zero=0 of equation, .* return_difference"):
            return_difference(plant, [1 - delay(1.0)])
        assert unstable_roots(return_difference(plant, [1 - delay(1.0)], at_zero=1)) == 0
    meant = Loop(System.of(TURNED, integrators=1), "common", tau1=3.0, tau2=2.0)
    assert unstable_roots(meant) == 0
    assert nyquist(meant).encirclements == 0
    assert unstable_roots(meant.replace(controller=System.of(TURNED, integrators=0))) in (0, 1)
    for k in (System.of(TURNED, integrators=1), state_space(*matrices, integrators=1)):
        assert unstable_roots(return_difference([[k]], [1 - delay(1.0)])) == -1
    for number in (2, 3):
        with pytest.raises(ValueError, match=f"^integrators must be .*, got {number}"):
            System.of(TURNED, integrators=number)
    for ask in (partial(System.of, integrators=1), partial(System.of, zeros=1)):
        with pytest.raises(TypeError, match=r"^integrators and zeros are for a state space"):
            ask(((), (0.0,), 1.0))


@pytest.mark.parametrize("integrators", [1, 2])
def test_controllers_in_general_coordinates_are_as_designed_or_asked_for(integrators):
    rng = np.random.default_rng(integrators)
    for _ in range(10):
        n = int(rng.integers(max(2, integrators), 6))
        design = np.zeros((n, n))
        design[:integrators, :integrators] = np.eye(integrators, k=1)
        design[integrators:, integrators:] = np.diag(
            -(10.0 ** rng.uniform(-1, 1, n - integrators))
        )
        b, c, turn = rng.normal(size=(n, 1)), rng.normal(size=(1, n)), rng.normal(size=(n, n))
        given = control.ss(
            np.linalg.inv(turn) @ design @ turn, np.linalg.inv(turn) @ b, c @ turn, 0
        )
        # The design itself has exact zeros.
        expected = unstable_roots(Loop(control.ss(design, b, c, 0), "common", 2.1, 1.9))
        stated = Loop(System.of(given, integrators=integrators), "common", 2.1, 1.9)
        assert unstable_roots(stated) == expected
        with contextlib.suppress(ValueError):
            assert unstable_roots(stated.replace(controller=given)) == expected


@pytest.mark.parametrize("seed", range(5))
def test_an_integrator_that_is_hidden_is_a_zero_too_in_other_coordinates(seed):
    rng = np.random.default_rng(seed)
    design = np.diag([0.0, -0.3, -2.0])
    b, c, turn = rng.normal(size=(3, 1)), np.array([[0.0, 1.0, 0.5]]), rng.normal(size=(3, 3))
    b, c = (b, c) if seed % 2 else (c.T, b.T)
    given = control.ss(
        np.linalg.inv(turn) @ design @ turn, np.linalg.inv(turn) @ b, c @ turn, 0.0
    )
    expected = unstable_roots(System.of(control.ss(design, b, c, 0)) * delay(0.3))
    with pytest.raises(ValueError, match="more than 0 zeros"):
        System.of(given, integrators=1)
    stated = System.of(given, integrators=1, zeros=1)
    assert stated.numerator.order() == stated.denominator.order() == 0
    assert unstable_roots(System.of(stated) * delay(0.3)) == expected
    whole = {0.0: given.A}, given.B.ravel(), given.C.ravel()
    with pytest.raises(ValueError, match="more than 0 zeros"):
        state_space(*whole, integrators=1)
    meant = state_space(*whole, integrators=1, zeros=1)
    assert unstable_roots(meant * delay(0.3)) == expected


def test_a_zero_next_to_an_integrator_is_not_taken_for_it():
    # The zero is at +1e-9: it is no integrator that the input does not reach.
    turn, design = np.array([[1.0, 2.0], [3.0, 5.0]]), np.diag([0.0, -1e5])
    b, c = np.array([[1.0], [1.0]]), np.array([[-1e-9, 1e5 + 1e-9]])
    inverse = np.array([[-5.0, 2.0], [3.0, -1.0]])
    given = control.ss(turn @ design @ inverse, turn @ b, c @ inverse, 0.0)
    assert unstable_roots(System.of(control.ss(design, b, c, 0.0)) * delay(1.0)) == 1
    with pytest.raises(ValueError, match="more than 0 zeros"):
        System.of(given, integrators=1)
    meant = System.of(given, integrators=1, zeros=0)
    assert unstable_roots(System.of(meant) * delay(1.0)) == 1


@pytest.mark.parametrize("number", range(5))
def test_any_number_of_poles_that_are_zero_may_be_stated(number):
    given = control.tf([1.0], [1.0, *[0.0] * number])
    assert System.of(given, integrators=number).denominator.order() == number
    with pytest.raises(ValueError, match="integrators must be the number of poles"):
        System.of(given, integrators=number + 1)


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("seed", range(5))
def test_a_zero_at_s_0_is_asked_for(number, seed):
    # A high-pass filter in other coordinates: the zeros of its numerator leave s = 0.
    rng = np.random.default_rng(seed)
    n = int(rng.integers(number, 6))
    poles = -(10.0 ** rng.uniform(-1, 1, n))
    design = Controller([0.0] * number, poles.tolist(), rng.normal())
    given = control.tf2ss(control.tf(design.gain * np.poly([0.0] * number), np.poly(poles)))
    turn = rng.normal(size=(n, n))
    given = control.ss(
        np.linalg.inv(turn) @ given.A @ turn, np.linalg.inv(turn) @ given.B, given.C @ turn,
        given.D,
    )  # fmt: skip

    def loop(k):
        return System.of(k) * Controller([-0.2] * number, [0.0] * number, 1.0) * delay(0.5)

    stated = System.of(given, zeros=number)
    assert stated.numerator.order() == number
    assert unstable_roots(loop(stated)) == unstable_roots(loop(design))
    with contextlib.suppress(ValueError):
        assert unstable_roots(loop(given)) == unstable_roots(loop(design))
    with pytest.raises(ValueError, match=r"^zeros must be the number of zeros at s = 0"):
        System.of(given, zeros=number + 1)


def test_a_hidden_unstable_mode_is_counted():
    for b, c in (([[0.0], [1.0]], [[1.0, 1.0]]), ([[1.0], [1.0]], [[0.0, 1.0]])):
        hidden = control.ss([[1.0, 0.0], [0.0, -1.0]], b, c, 0)
        assert unstable_roots(System.of(hidden) * delay(1.0)) == 1
        assert unstable_roots(Loop(hidden, "single", 3.0)) == 1


def test_denominators_that_are_equal_up_to_a_factor_are_one_system():
    def mode(gain, scale, *more):
        return control.tf([gain * scale], scale * np.poly([1.0, *more]))

    for scale in (1.0, 2.0, -3.0):
        total = System.of(mode(1.0, 1.0)) + mode(2.0, scale)
        assert unstable_roots(total) == 0
        assert System.of(mode(1.0, 1.0)) + System.of(mode(2.0, scale)) == Controller(
            (), (1.0,), 3.0
        )
    # Others are multiplied: one of the two unstable modes is hidden in their sum.
    first, second = mode(1.0, 1.0), mode(1.0, 1.0, -2.0)
    both = System.of(first) + System.of(second)
    assert sorted(pole.real for pole in both.poles()) == [-2.0, 1.0, 1.0]
    assert unstable_roots(System.of(first) + second) == unstable_roots(System.of(both))


def test_a_transfer_function_that_was_rounded_is_asked_for():
    tanks = control.tf([-5e-15, 2.0, 5.0], [1.0, 8.0, 15.0, -1.3e-14])
    meant = Loop(System.of(tanks, integrators=1, zeros=0), "common", tau1=3.0, tau2=2.0)
    assert unstable_roots(meant) == 0
    # A high-pass filter, of which the numerator is a difference.
    high_pass = 1 - control.tf([0.07], [1, 0.1]) * control.tf([1], [1, 0.7])
    with pytest.raises(ValueError, match="more than 0 zeros"):
        System.of(high_pass)
    stated = System.of(high_pass, zeros=1)
    assert stated.numerator.order() == 1
    assert unstable_roots(stated * delay(1.0) / s) == 0
    # Slow poles that somebody writes down are not in doubt, unless others are much faster.
    System.of(control.tf([1.0], np.poly([-1e-6, -1e-6, -3e4])))
    wide = control.tf([1], [1, 1e5, 1e-4])
    with pytest.raises(ValueError, match=r"\(system, integrators=0\)"):
        System.of(wide)
    assert unstable_roots(System.of(wide, integrators=0)) == 0


@pytest.mark.parametrize("lead", [1e-14, 9e-16, -3e-13])
def test_a_leading_coefficient_that_is_rounding_asks_nothing(lead):
    for above, below in (
        ([lead, 0.1, 0.0652, 2.485, 1.24], [1, 1, 1, 1, 1, 0]),
        ([1, 1, 1, 1, 1, 0], [lead, 0.1, 0.0652, 2.485, 1.24]),
    ):
        k = System.of(control.tf(above, below))
        assert k.numerator.order() + k.denominator.order() == 1
        assert System.of(control.tf(above, below), integrators=k.denominator.order()) == k


def test_the_way_out_of_each_refusal_is_taken():
    """A message names only what is hidden, so that what it names is accepted."""
    hidden = {
        "integrators": control.tf([1, 2], [1, 1, 1e-17]),
        "zeros": control.tf([1, 2, 1e-17], [1, 3, 0]),
    }
    for name, given in hidden.items():
        with pytest.raises(ValueError, match=rf"System\.of\(system, {name}=0\)"):
            System.of(given)
    poles = [System.of(hidden["integrators"], integrators=k).denominator for k in (0, 1)]
    assert [p.order() for p in poles] == [0, 1]
    # With the pole that is exact there, a zero at s = 0 is left out.
    degrees = [System.of(hidden["zeros"], zeros=k).numerator.degree for k in (0, 1)]
    assert degrees == [2, 1]


def test_fast_zeros_give_the_scale_of_a_slow_pole():
    with pytest.raises(ValueError, match="more than 0 poles"):
        System.of(control.tf([1, 0.2], [1, 1e-17]))


def test_an_identified_integrator_is_asked_for_at_both_doors():
    """A pole at 6e-14 rad/s beside 1 rad/s, as a fit by ERA leaves it."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    a = turn @ np.diag([6e-14, -0.4, -1.0]) @ turn.T
    given = control.ss(a, turn @ np.ones((3, 1)), np.ones((1, 3)) @ turn.T, 0)
    for system in (given, control.tf(given)):
        with pytest.raises(ValueError, match="more than 0 poles"):
            System.of(system)
        assert System.of(system, integrators=1).denominator.order() == 1


@pytest.mark.parametrize("pole", [1e-9, 1e-7])
def test_what_stands_behind_a_stated_integrator_is_asked_too(pole):
    rng = np.random.default_rng(0)
    a, b, c = [[0, 0, 0], [1, -pole, 0], [0, 1, -1]], [[1], [0], [0]], [[0, 0, 1]]
    for _ in range(20):
        u, v = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
        turn = u @ np.diag([1.0, 1e-3, 1e-6]) @ v
        back = np.linalg.inv(turn)
        given = control.ss(back @ a @ turn, back @ b, c @ turn, 0)
        with contextlib.suppress(ValueError):
            k = System.of(given, integrators=1)
            assert unstable_roots(k * (1e-3 * pole)) == 0


def test_repeated_poles_stay_together_as_the_docstring_says():
    poles = [-1e-3] * 5
    assert set(Controller([], poles, 1.0).poles()) == {-1e-3}
    found = Loop(([], poles, 1.0), "single", 20.0).affine.space.polynomials
    assert {root for p in found for root in p.roots} == {-1e-3}
    scattered = System.of(control.zpk([], poles, 1.0)).poles()
    assert len(set(scattered)) == 5
