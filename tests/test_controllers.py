"""Controllers: forms of one thing, and what they refuse."""

from __future__ import annotations

import control
import numpy as np
import pytest

from armlock import Controller, Loop, unstable_roots
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


def test_a_state_space_is_taken_or_refused_by_its_response():
    """The eigenvalues of a matrix that is far from normal are not those that it was made of."""
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(8, 8)))
    matrix = turn @ (np.triu(np.full((8, 8), 1e4), 1) - np.eye(8)) @ turn.T
    far = control.ss(matrix, turn @ np.ones((8, 1)), np.ones((1, 8)) @ turn.T, 0)
    with pytest.raises(ValueError, match=r"^controller must be a state space whose zeros and"):
        Controller.of(far)
    with pytest.raises(ValueError, match=r"^controller must not be zero"):
        Controller.of(control.ss([[-1.0]], [[0.0]], [[1.0]], [[0.0]]))
    with pytest.raises(ValueError, match=r"^controller must be continuous in time"):
        Controller.of(control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1))


def test_repeated_poles_stay_together_as_the_docstring_says():
    poles = [-1e-3] * 5
    assert set(Controller([], poles, 1.0).poles) == {-1e-3}
    assert set(Loop(([], poles, 1.0), "single", 20.0).polynomials()[0].roots) == {-1e-3}
    scattered = Controller.of(control.zpk([], poles, 1.0)).poles
    assert len(set(scattered)) == 5
