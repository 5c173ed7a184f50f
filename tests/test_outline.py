from typing import Any

import numpy as np
import pytest

from armlock import CommonArm, HayesEquation, stability_chart
from book.companion import outline as boundary

WRONG: dict[str, Any] = {"half": 2.5, "integer": np.int64(12)}
DIAGONAL = np.full((2, 1), np.sqrt(0.5))


def test_along_the_diagonal_the_line_of_zero_frequency_is_met():
    assert boundary.boundary_radius(CommonArm(), DIAGONAL) == pytest.approx(
        np.sqrt(2.0), rel=1e-8
    )


def test_rays_are_unit_vectors_all_the_way_around():
    directions = boundary.rays(40)
    np.testing.assert_allclose(np.hypot(*directions), 1.0, rtol=1e-14)
    np.testing.assert_allclose(directions.sum(axis=1), 0.0, atol=1e-13)


def test_area_and_perimeter_of_a_circle():
    angle = np.linspace(0.0, 2.0 * np.pi, 721)[:-1]
    closed = boundary.outline(np.full(720, 3.0), np.stack((np.cos(angle), np.sin(angle))))
    assert boundary.enclosed_area(closed) == pytest.approx(9.0 * np.pi, rel=1e-4)
    assert boundary.perimeter(closed) == pytest.approx(6.0 * np.pi, rel=1e-4)


def test_the_area_agrees_with_the_stable_share_of_a_chart():
    system, directions = CommonArm(), boundary.rays(720)
    closed = boundary.outline(boundary.boundary_radius(system, directions), directions)
    axis = np.linspace(-7.0, 7.0, 1001)
    share = stability_chart(system, axis, axis).stable.mean() * 14.0**2
    assert boundary.enclosed_area(closed) == pytest.approx(share, rel=5e-3)


def test_an_unstable_origin_and_a_short_reach_are_named():
    with pytest.raises(ValueError, match=r"^system must be stable at the origin"):
        boundary.boundary_radius(HayesEquation(), DIAGONAL)
    with pytest.raises(
        ValueError, match=r"^reach must lie outside the stable region, got 1\.0"
    ):
        boundary.boundary_radius(CommonArm(), DIAGONAL, reach=1.0)


@pytest.mark.parametrize(
    ("function", "error", "message"),
    [
        (
            lambda: boundary.rays(WRONG["half"]),
            ValueError,
            r"^number must be an integer from 1 on, got 2\.5",
        ),
        (lambda: boundary.rays(40, 0.0), ValueError, "^elongation must be positive"),
        (
            lambda: boundary.boundary_radius(CommonArm(), [1.0, 2.0]),
            ValueError,
            r"^directions must be of shape \(2, n\), got \(2,\)",
        ),
        (
            lambda: boundary.boundary_radius(CommonArm(), [[np.nan], [1.0]]),
            ValueError,
            "^directions must be finite, got nan",
        ),
        (
            lambda: boundary.outline([1.0, 2.0], DIAGONAL),
            ValueError,
            r"^radius must hold one number for each of the 1 directions, got shape \(2,\)",
        ),
        (
            lambda: boundary.enclosed_area(np.zeros((3, 4))),
            ValueError,
            r"^closed must be of shape \(2, n\), got \(3, 4\)",
        ),
        (lambda: boundary.perimeter("x"), TypeError, "^closed must hold real numbers"),
    ],
)
def test_what_makes_no_outline_is_named(function, error, message):
    with pytest.raises(error, match=message):
        function()


def test_a_numpy_integer_is_a_number_of_rays():
    assert boundary.rays(WRONG["integer"]).shape == (2, 12)
