"""What the claims on Table I stand on."""

from __future__ import annotations

import pytest

from book.companion.claims import Verdict, table1


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
