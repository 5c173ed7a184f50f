"""What the claims on Table I stand on."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import paper, sensors, unstable_roots
from book.companion.claims import Verdict, table1


def test_identities_by_hand():
    """The rows of Table I, from Euler's formula at one frequency."""
    omega, tau1, tau2 = 0.7, paper.TAU1, paper.TAU2
    e1, e2 = np.exp(-1j * omega * tau1), np.exp(-1j * omega * tau2)
    half, mean = table1.HALF_DIFFERENCE, table1.MEAN_DELAY
    assert table1.printed_common(omega, half, mean) == pytest.approx(2 - e1 - e2, abs=1e-14)
    assert table1.printed_difference(omega, half, mean) == pytest.approx(e1 - e2, abs=1e-14)
    p = 2.5
    by_hand = 2 - e1 - e2 - p / (1j * omega + p) / (1j * omega * half) * (e1 - e2)
    assert table1.dual_response(omega, p, half) == pytest.approx(by_hand)
    mapping = sensors.dual(p, half).response(1j * omega, tau1, tau2)
    assert mapping == pytest.approx(by_hand)


@pytest.mark.parametrize("name", ["single", "common", "dual"])
def test_growth_rate_is_perturbation_over_delay(name):
    delay = {
        "single": paper.TAU1,
        "common": paper.TAU1 + paper.TAU2,
        "dual": paper.TAU1 - paper.TAU2,
    }[name]
    size = 1e-7
    assert float(table1.growth_beside_ideal(name, size)) == pytest.approx(
        size / delay, rel=0.06
    )
    counts = unstable_roots(table1.LOOPS[name], *table1.perturbed(name, [-1e-4, 1e-4]))
    assert (counts > 0).tolist() == [False, True]


@pytest.mark.parametrize(
    ("check", "name", "value", "verdict"),
    [
        ("common_row", "FULL_DIFFERENCE", table1.HALF_DIFFERENCE, Verdict.REPRODUCED),
        ("common_row", "HALF_DIFFERENCE", table1.FULL_DIFFERENCE, Verdict.DIFFERS),
        ("difference_row", "FULL_DIFFERENCE", table1.HALF_DIFFERENCE, Verdict.REPRODUCED),
        ("difference_row", "HALF_DIFFERENCE", -table1.HALF_DIFFERENCE, Verdict.DIFFERS),
        ("dual_row", "HALF_DIFFERENCE", table1.FULL_DIFFERENCE, Verdict.DIFFERS),
        ("round_trips", "TAIJI_ARM_LENGTH", 2.5e9, Verdict.DIFFERS),
        ("ideal_point_on_boundary", "PERTURBATION", -1e-6, Verdict.DIFFERS),
    ],
)
def test_checks_can_fail(monkeypatch, check, name, value, verdict):
    """A different ingredient leads to a different verdict."""
    monkeypatch.setattr(table1, name, value)
    assert getattr(table1, check).__wrapped__().verdict is verdict
