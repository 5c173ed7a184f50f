"""Answers by an inverse Laplace transform, held against closed forms and against residues."""

import numpy as np

from armlock import SingleArm, flight_loop, pulling
from book.companion.transients import answer


def test_before_the_light_comes_back_the_loop_has_no_delay():
    """Then Y of a single arm is -g / (s + g), and half of that for the sum."""
    found = answer(SingleArm(0.5, 20.0), "common", 40.0)
    early = (found.time > 0.1) & (found.time < 19.0)
    expected = -0.5 * (1.0 - np.exp(-0.5 * found.time[early]))
    assert np.abs(found.frequency[early] - expected).max() < 1e-4


def test_late_answers_are_the_sum_of_residues():
    loop, error = flight_loop(), (1.0, 1e-5, 0.0)
    found = answer(loop, "common", 20_000.0, error)
    at = np.array([2000.0, 5000.0, 18_000.0])
    expected = pulling(loop, at, error)
    assert np.allclose(np.interp(at, *found), expected, rtol=1e-4)


def test_the_largest_answer_is_looked_for_from_a_time_on():
    found = answer(SingleArm(0.5, 20.0), "common", 40.0)
    at, most = found.largest(1.0)
    assert at > 35.0
    assert most > 0.5
