"""Verdicts and deciding numbers of the claims of the appendix, and what they stand on."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import claims
from armlock.claims import Verdict, appendix

EXPECTED = {
    "A1": (Verdict.REPRODUCED, 2.00666e-6, 1e-9),
    "A2": (Verdict.DIFFERS, 0.39334, 1e-4),
    "A3": (Verdict.DIFFERS, 14579.3, 0.1),
    "A4": (Verdict.IN_PART, 0.0, 0.05),
    "A5": (Verdict.REPRODUCED, 0.0, 0.03),
}


@pytest.mark.parametrize("identifier", EXPECTED)
def test_verdict_and_number(identifier):
    finding = claims.check(identifier)[identifier]
    verdict, value, tolerance = EXPECTED[identifier]
    assert finding.verdict is verdict
    assert abs(finding.value - value) <= tolerance
    assert finding.note
    assert finding.quantity


def test_phase_error_is_that_of_the_arctangent():
    mismatch = (0.02, -0.05)
    phase = np.linspace(-1.5, 1.5, 101)
    ratio = (1.0 + mismatch[1]) * np.sin(phase) / ((1.0 + mismatch[0]) * np.cos(phase))
    assert appendix.measured_phase(phase, mismatch) == pytest.approx(
        np.arctan(ratio), abs=1e-15
    )
    wide = np.linspace(-20.0, 20.0, 999)
    turned = appendix.measured_phase(wide, mismatch)
    assert np.tan(turned) == pytest.approx(
        (1.0 + mismatch[1]) / (1.0 + mismatch[0]) * np.tan(wide), rel=1e-9
    )
    assert np.abs(turned - wide).max() < 0.5 * np.pi


def test_error_to_first_order():
    phase = np.linspace(0.0, 10.0, 500)
    eta = appendix.MISMATCH[1] - appendix.MISMATCH[0]
    first = 0.5 * eta * np.sin(2.0 * phase)
    assert appendix.phase_error(phase) == pytest.approx(first, abs=10.0 * eta**2)
