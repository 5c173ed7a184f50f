"""The claims on the common arm: each verdict, and the number that decides it."""

from __future__ import annotations

import numpy as np
import pytest

from armlock import CommonArm, semi_discretization, spectral_radius, unstable_roots
from armlock.boundary import boundary_radius, enclosed_area, outline, perimeter, rays
from armlock.dcurve import d_curve, d_curve_line
from book.companion.claims import Verdict, check
from book.companion.claims import common_arm as chapter
from book.companion.schemes import map_eigenvalues, pade_poles, standard_schemes

DECIDED = {
    "C1": (Verdict.REPRODUCED, 0.0, 1e-11),
    "C2": (Verdict.REPRODUCED, 0.0, 0.0),
    "C3": (Verdict.IN_PART, 0.0, 0.0),
    "C4": (Verdict.NOT_AS_WRITTEN, 0.10536, 1e-4),
    "C5": (Verdict.NOT_AS_WRITTEN, 1.82965e-4, 1e-8),
    "C6": (Verdict.REPRODUCED, 0.0, 0.0),
    "C7": (Verdict.REPRODUCED, 0.02800, 5e-5),
    "C8": (Verdict.IN_PART, 0.0026588, 1e-6),
    "C9": (Verdict.REPRODUCED, 0.0171888, 1e-6),
    "C10": (Verdict.REPRODUCED, 0.0, 0.0),
    "C11": (Verdict.IN_PART, 1642.8, 2.0),
    "C12": (Verdict.IN_PART, 4.416e-6, 1e-8),
    "C13": (Verdict.IN_PART, 0.0761516, 1e-6),
    "C14": (Verdict.IN_PART, 0.40351, 1e-4),
}


@pytest.mark.parametrize("identifier", DECIDED)
def test_verdict_and_deciding_number(identifier):
    verdict, value, tolerance = DECIDED[identifier]
    finding = check(identifier)[identifier]
    assert finding.verdict == verdict
    assert abs(finding.value - value) <= tolerance


def test_a_wrong_sign_in_the_curve_is_noticed():
    omega = np.linspace(0.1, 20.0, 200)
    c1, c2 = chapter.printed_d_curve(omega)
    assert chapter.relative_residual(chapter.ARM, omega, c1, c2).max() < 1e-12
    assert np.median(chapter.relative_residual(chapter.ARM, omega, c1, -c2)) > 0.1


def test_cusp_conditions_are_where_they_say():
    one, other = chapter.cusp_conditions(5.0)
    arm = chapter.ARM
    for omega, tau, second in ((one, arm.tau1, arm.tau2), (other, arm.tau2, arm.tau1)):
        left = (1.0 + 2.0 * arm.gain * second + 1j * omega * second) * np.exp(1j * omega * tau)
        assert np.abs(left.imag / left.real).max() < 1e-10
    # Both grow by about pi / tau from one to the next, and none is left out.
    assert np.diff(one).max() < 1.1 * np.pi / arm.tau1
    assert np.diff(other).max() < 1.1 * np.pi / arm.tau2


def test_drawing_converges_but_not_beyond_its_range():
    last = np.sqrt(4.0 * 7.0**2 - 4.0)
    coarse, fine, short = (
        np.abs(chapter.drawn_radius(n, end) - chapter.exact_radius()).max()
        for n, end in ((2000, last), (4000, last), (40_000, 5.0))
    )
    # Straight pieces miss a curve by the square of their length.
    assert coarse / fine == pytest.approx(4.0, rel=0.15)
    assert short > 0.05


def test_sharpest_turn_by_three_points_of_the_curve():
    radius, omega = chapter.sharpest_turn()
    x, y = d_curve(chapter.ARM, omega + np.array([-1e-4, 0.0, 1e-4]))
    a, b, c = (np.hypot(x[i] - x[j], y[i] - y[j]) for i, j in ((0, 1), (1, 2), (0, 2)))
    area = 0.5 * abs((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]))
    assert a * b * c / (4.0 * area) == pytest.approx(radius, rel=1e-3)
    assert max(abs(x[1]), abs(y[1])) < 20.0


def test_derived_recurrence_is_the_package_map():
    derived = chapter.printed_maps()["derived"]
    for point in ((0.9, 1.05), (0.5, 1.6)):
        own = np.abs(map_eigenvalues(derived, *point)).max()
        assert abs(own - float(spectral_radius(chapter.ARM, *point, 0.05))) < 1e-11


def test_printed_recurrence_by_dense_eigenvalues():
    printed = chapter.printed_maps()["both as printed"]
    radius = np.abs(map_eigenvalues(printed, 1.0, 1.0)).max()
    assert abs(radius - 1.0 - check("C5")["C5"].value) < 1e-10
    assert unstable_roots(printed, 1.0, 1.0) >= 1


def test_spectral_radius_of_a_map_is_that_of_its_largest_eigenvalue():
    derived = chapter.printed_maps()["derived"]
    radius = np.abs(map_eigenvalues(derived, -3.0, -2.9)).max()
    assert chapter.excess(derived, -3.0, -2.9) == pytest.approx(radius - 1.0, rel=1e-9)


@pytest.mark.parametrize("name", list(standard_schemes(CommonArm(), 0.1)))
def test_every_scheme_keeps_the_straight_line(name):
    line = d_curve_line(standard_schemes(CommonArm(), 0.1)[name])
    assert np.allclose(line, (1.0, 1.0, 2.0), rtol=0.0, atol=1e-12)


def test_every_scheme_converges_to_the_loop():
    coarse, fine = (chapter.scheme_errors(step) for step in (0.1, 0.05))
    for name, errors in coarse.items():
        assert abs(fine[name].boundary) < 0.6 * abs(errors.boundary)


def test_pade_approximants_have_the_slow_root():
    poles = pade_poles(CommonArm(), 0.9, 1.05, 5)
    assert poles.size == 11
    assert abs(poles.real.max() + 0.0012354689331) < 1e-11


def test_outline_of_a_known_region():
    circle = outline(np.ones(400), rays(400, elongation=1.0))
    assert abs(enclosed_area(circle) - np.pi) < 1e-3
    assert abs(perimeter(circle) - 2.0 * np.pi) < 1e-3


def test_boundary_radius_finds_the_straight_line():
    up = np.full((2, 1), np.sqrt(0.5))
    assert abs(boundary_radius(chapter.ARM, up)[0] - np.sqrt(2.0)) < 1e-8
    held = semi_discretization(chapter.ARM, 0.1)
    assert abs(boundary_radius(held, up)[0] - np.sqrt(2.0)) < 1e-8


def test_boundary_radius_needs_a_bracket():
    up = np.full((2, 1), np.sqrt(0.5))
    with pytest.raises(ValueError, match="reach must lie outside"):
        boundary_radius(chapter.ARM, up, reach=0.5)
    with pytest.raises(ValueError, match="reach must be positive"):
        boundary_radius(chapter.ARM, up, reach=-1.0)
