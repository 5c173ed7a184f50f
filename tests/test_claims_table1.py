"""Verdicts and deciding numbers of the claims on Table I, and what they stand on."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import DualArm, paper, sensors, unstable_roots
from book.companion import claims
from book.companion.claims import Verdict, table1

EXPECTED = {
    "Z1": (Verdict.IN_PART, 2.0),
    "T1": (Verdict.REPRODUCED, 0.0),
    "T2": (Verdict.NOT_AS_WRITTEN, 1.0),
    "T3": (Verdict.NOT_AS_WRITTEN, 2.0),
    "T4": (Verdict.NOT_AS_WRITTEN, 0.7210738),
    "T5": (Verdict.OPEN, 2011.602),
    "T6": (Verdict.REPRODUCED, 0.0691807),
}


@pytest.mark.parametrize("identifier", EXPECTED)
def test_verdict_and_number(identifier):
    finding = claims.check(identifier)[identifier]
    verdict, value = EXPECTED[identifier]
    assert finding.verdict is verdict
    assert finding.value == pytest.approx(value, rel=1e-6, abs=1e-12)
    assert finding.note
    assert finding.quantity


def test_identities_by_hand():
    """The rows of Table I, from Euler's formula at one frequency."""
    omega, tau1, tau2 = 0.7, paper.TAU1, paper.TAU2
    e1, e2 = np.exp(-1j * omega * tau1), np.exp(-1j * omega * tau2)
    half, mean = table1.HALF_DIFFERENCE, table1.MEAN_DELAY
    assert table1.printed_common(omega, half, mean) == pytest.approx(2 - e1 - e2, abs=1e-14)
    assert table1.printed_difference(omega, half, mean) == pytest.approx(e1 - e2, abs=1e-14)
    assert sensors.DIFFERENCE.response(1j * omega, tau1, tau2) == pytest.approx(e1 - e2)


@pytest.mark.parametrize("name", ["single", "common", "dual"])
def test_growth_rate_is_perturbation_over_delay(name):
    delay = {
        "single": paper.TAU1,
        "common": paper.TAU1 + paper.TAU2,
        "dual": paper.TAU1 - paper.TAU2,
    }[name]
    size = 1e-7
    assert float(table1.growth_rate(name, size)) == pytest.approx(size / delay, rel=0.06)
    assert float(table1.growth_rate(name, -size)) < 0.0


def test_perturbed_leads_out_of_the_stable_region():
    for name, loop in table1.ideal_loops().items():
        counts = [int(unstable_roots(loop, *table1.perturbed(name, s))) for s in (-1e-4, 1e-4)]
        assert counts[0] == 0, name
        assert counts[1] > 0, name


def test_ideal_dual_loop_is_the_packages_own():
    own, here = DualArm(), table1.ideal_loops()["dual"]
    s = 0.3 + 0.2j
    assert own(s, 0.9, 1.1) == pytest.approx(complex(here(s, 0.9, 1.1)))


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
    function = getattr(table1, check)
    assert function().verdict is not verdict
    monkeypatch.setattr(table1, name, value)
    assert function.__wrapped__().verdict is verdict
