"""What the claims of Sec. II stand on."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import HayesEquation, unstable_roots
from armlock.paper import TAU1
from book.companion.claims import Verdict, single_arm


@pytest.mark.parametrize("gain", [0.02, 1.0, 400.0])
@pytest.mark.parametrize("tau", [0.5, TAU1])
def test_lowest_stable_k2_is_where_the_count_changes(gain, tau):
    limit = single_arm.lowest_stable_k2(gain, tau)
    assert limit < -1.0
    k2 = limit * np.array([1.0 - 1e-8, 1.0 + 1e-8])
    counts = unstable_roots(HayesEquation(tau), *single_arm.parameters(gain, k2))
    assert counts.tolist() == [0, 2]


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
