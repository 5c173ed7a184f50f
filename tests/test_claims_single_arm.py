"""Verdicts and deciding numbers of the claims of Sec. II, and what they stand on."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import HayesEquation, SingleArm, rightmost_root, unstable_roots
from armlock.paper import TAU1
from book.companion import claims
from book.companion.claims import Verdict, single_arm

# The first two are errors of rounding and of quadrature, zero within the tolerance.
EXPECTED = {
    "S1": (Verdict.REPRODUCED, 0.0, 1e-8),
    "S2": (Verdict.REPRODUCED, 0.0, 1e-10),
    "S3": (Verdict.REPRODUCED, 0.0, 0.0),
    "S4": (Verdict.REPRODUCED, 1.0, 0.0),
    "S5": (Verdict.IN_PART, -1.011031041661212, 1e-12),
    "S6": (Verdict.REPRODUCED, np.degrees(np.pi / 4 - np.arctan(0.5)), 1e-9),
    "S7": (Verdict.IN_PART, 1.0 + TAU1, 1e-6),
    "S8": (Verdict.NOT_AS_WRITTEN, 0.434699287, 1e-8),
    "S9": (Verdict.IN_PART, 2.0 * np.pi / 3.0 / np.sqrt(3.0), 1e-12),
    "S10": (Verdict.REPRODUCED, -0.0020258541171, 1e-12),
    "S11": (Verdict.IN_PART, 1.0, 1e-6),
    "S12": (Verdict.REPRODUCED, 0.0, 0.0),
}


@pytest.mark.parametrize("identifier", EXPECTED)
def test_verdict_and_number(identifier):
    finding = claims.check(identifier)[identifier]
    verdict, value, tolerance = EXPECTED[identifier]
    assert finding.verdict is verdict
    assert abs(finding.value - value) <= tolerance
    assert finding.note
    assert finding.quantity


@pytest.mark.parametrize("gain", [0.02, 0.3, 1.0, 20.1, 400.0])
@pytest.mark.parametrize("tau", [0.5, 1.0, TAU1])
def test_lowest_stable_k2_is_where_the_count_changes(gain, tau):
    limit = single_arm.lowest_stable_k2(gain, tau)
    assert limit < -1.0
    k2 = limit * np.array([1.0 - 1e-8, 1.0 + 1e-8])
    counts = unstable_roots(HayesEquation(tau), *single_arm.parameters(gain, k2))
    assert counts.tolist() == [0, 2]


@pytest.mark.parametrize("k2", [-1.01, -1.5, -2.0, -30.0])
def test_the_two_limits_are_inverse_to_each_other(k2):
    gain = single_arm.highest_stable_gain(k2, TAU1)
    assert single_arm.lowest_stable_k2(gain, TAU1) == pytest.approx(k2, rel=1e-12)


def test_limits_at_their_ends():
    assert single_arm.highest_stable_gain(-1.0, 1.0) == np.inf
    assert single_arm.highest_stable_gain(0.999, 1.0) == np.inf
    assert single_arm.highest_stable_gain(1.0, 1.0) == 0.0
    # The corner of the region, and the crossing of the axis a = 0 at b = -pi / 2.
    assert single_arm.lower_edge(1.0 - 1e-9, 1.0) == pytest.approx(-1.0, abs=1e-8)
    assert single_arm.lower_edge(0.0, 1.0) == pytest.approx(-np.pi / 2)
    assert single_arm.lower_edge(0.0, TAU1) == pytest.approx(-np.pi / 2 / TAU1)


def test_lambert_root_is_the_rightmost_root():
    rng = np.random.default_rng(5)
    a, b = rng.uniform(-3.0, 2.0, 25), rng.uniform(-4.0, 4.0, 25)
    closed = single_arm.lambert_root(a, b, 1.0)
    found = np.asarray(rightmost_root(HayesEquation(1.0), a, b))
    assert np.allclose(closed.real, found.real, rtol=1e-10, atol=1e-12)
    assert np.allclose(np.abs(closed.imag), found.imag, rtol=1e-10, atol=1e-12)


def test_loop_has_no_root_at_zero_when_ideal():
    """At k2 = 1 the differentiated equation has one root more than 1 + L."""
    loop = SingleArm(1.0, TAU1)
    assert complex(loop(0.0, 1.0, 0.0)) == 0.0
    assert complex(1.0 + loop.open_loop(1e-10)) == pytest.approx(1.0 + TAU1, rel=1e-6)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: single_arm.lower_edge(1.0, 1.0), "a"),
        (lambda: single_arm.lower_edge(float("nan"), 1.0), "a"),
        (lambda: single_arm.lower_edge(-1.0, 0.0), "tau"),
        (lambda: single_arm.lowest_stable_k2(-1.0, 1.0), "gain"),
        (lambda: single_arm.highest_stable_gain(-2.0, -1.0), "tau"),
        (lambda: single_arm.lambert_root(0.0, 1.0, 0.0), "tau"),
    ],
)
def test_bad_input_is_named(call, name):
    with pytest.raises(ValueError, match=f"^{name} must be"):
        call()


@pytest.mark.parametrize(
    ("check", "name", "value"),
    [
        ("below_one", "lowest_stable_k2", lambda gain, tau: -1.2),
        ("gain_matters", "highest_stable_gain", lambda k2, tau: 1.0),
        ("ideal_line", "PERTURBATION", -1e-6),
        ("hayes_correspondence", "parameters", lambda k1, k2: (-k1, -k1 * k2)),
        ("differentiated_equation", "parameters", lambda k1, k2: (k1, k1 * k2)),
        ("closed_form_region", "lower_edge", lambda a, tau: -2.0),
        ("ideal_loop_is_stable", "NOMINAL_GAIN", 2.0),
    ],
)
def test_checks_can_fail(monkeypatch, check, name, value):
    """A wrong ingredient changes the verdict, or at least the number."""
    function = getattr(single_arm, check)
    before = function()
    monkeypatch.setattr(single_arm, name, value)
    after = function.__wrapped__()
    if check == "ideal_loop_is_stable":
        assert after.value != before.value
    else:
        assert after.verdict is Verdict.DIFFERS
