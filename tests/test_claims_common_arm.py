"""What the claims on the common arm stand on."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from armlock import CommonArm, unstable_roots
from armlock.stability.dcurve import d_curve
from book.companion.claims import Verdict
from book.companion.claims import common_arm as chapter


def test_a_wrong_sign_in_the_curve_is_noticed(monkeypatch):
    right = chapter.printed_d_curve
    monkeypatch.setattr(chapter, "printed_d_curve", lambda *arms: (right(*arms)[0],) * 2)
    assert inspect.unwrap(chapter.parametric_curve)().verdict is Verdict.DIFFERS


def test_cusp_conditions_are_where_they_say():
    one, other = chapter.cusp_conditions(5.0)
    arm = chapter.ARM
    for omega, tau, second in ((one, arm.tau1, arm.tau2), (other, arm.tau2, arm.tau1)):
        left = (1.0 + 2.0 * arm.gain * second + 1j * omega * second) * np.exp(1j * omega * tau)
        assert np.abs(left.imag / left.real).max() < 1e-10
        # They grow by about pi / tau from one to the next, and none is left out.
        assert np.diff(omega).max() < 1.1 * np.pi / tau


def test_sharpest_turn_by_three_points_of_the_curve():
    radius, omega = chapter.sharpest_turn()
    x, y = d_curve(chapter.ARM, omega + np.array([-1e-4, 0.0, 1e-4]))
    a, b, c = (np.hypot(x[i] - x[j], y[i] - y[j]) for i, j in ((0, 1), (1, 2), (0, 2)))
    area = 0.5 * abs((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]))
    assert a * b * c / (4.0 * area) == pytest.approx(radius, rel=1e-3)
    assert max(abs(x[1]), abs(y[1])) < 20.0


def test_the_straight_edge_ends_where_the_stable_region_does():
    for c1, inwards in zip(chapter.straight_edge(), (1e-6, -1e-6), strict=True):
        below = CommonArm(), np.array([c1 + inwards, c1 - inwards])
        counts = unstable_roots(*below, 2.0 - below[1] - 1e-9)
        assert (counts > 0).tolist() == [False, True]
