"""What the claims of Sec. II stand on."""

from __future__ import annotations

import pytest

from book.companion.claims import Verdict, single_arm


@pytest.mark.parametrize(
    ("check", "name", "value"),
    [
        ("below_one", "lowest_stable_k2", lambda gain, tau: -1.2),
        ("gain_matters", "highest_stable_gain", lambda k2, tau: 1.0),
        ("ideal_line", "PERTURBATION", -1e-6),
        ("hayes_correspondence", "parameters", lambda k1, k2: (-k1, -k1 * k2)),
        ("differentiated_equation", "parameters", lambda k1, k2: (k1, k1 * k2)),
        ("closed_form_region", "lowest_stable_b", lambda a, tau: -2.0),
    ],
)
def test_checks_can_fail(monkeypatch, check, name, value):
    monkeypatch.setattr(single_arm, name, value)
    assert getattr(single_arm, check).__wrapped__().verdict is Verdict.DIFFERS
