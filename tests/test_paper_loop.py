"""The controlled loop of Sec. IV: counts near and far, by methods that share no step.

The claims on the controller hold its other readings against each other.
"""

from __future__ import annotations

import numpy as np
import pytest

from armlock import (
    critical_perturbation,
    d_curve_line,
    nyquist,
    paper_loop,
    stability_chart,
    unstable_roots,
)
from tests import attack_judge as judge
from tests.systems import sketch_of

LOOP = paper_loop()
E = 1e-6
BOX = [(1.0 + x * E, 1.0 + y * E) for x in (-1, 0, 1) for y in (-1, 0, 1)]
FAR = [(0.9, 0.95), (0.95, 0.9), (0.5, 1.2), (0.3, 0.4), (1.2, 0.5), (-0.4, 0.9), (1.3, -0.6)]


@pytest.mark.parametrize(("c1", "c2"), BOX + FAR)
def test_counts_agree_with_encirclements_and_branch_and_bound(c1, c2):
    count = int(unstable_roots(LOOP, c1, c2))
    assert nyquist(LOOP, c1, c2).closed_loop_roots == count
    assert judge.count(sketch_of(LOOP), c1, c2) == count
    assert count == 0 or (c1, c2) in FAR


def test_no_root_at_zero_at_the_ideal_point():
    """The sensor's pole at s = 0 meets zeros of the controller, and they cancel."""
    with pytest.raises(ValueError, match="depend on a free parameter at s = 0"):
        d_curve_line(LOOP)
    assert abs(LOOP(0.0, 1.0, 1.0)) > 0.0
    assert nyquist(LOOP).pole_order == 0


def test_large_chart_is_consistent():
    """400 x 400, with the edge where the critical perturbation has it."""
    x = 1.0 + np.linspace(-5e-6, 5e-6, 400)
    chart = stability_chart(LOOP, x, x)
    assert set(np.unique(chart.counts)) == {0, 2}
    ahead = x[None, :] - x[:, None]
    edge = 2.0 * critical_perturbation(LOOP, (1, -1))
    np.testing.assert_array_equal(chart.stable, ahead < edge)


def test_first_perturbation_along_the_diagonal_is_the_chain():
    assert critical_perturbation(LOOP, (1, 1)) == pytest.approx(1e-4, rel=1e-9)
