import numpy as np
import pytest

from armlock import CommonArm
from book.companion import outline as boundary

DIAGONAL = np.full((2, 1), np.sqrt(0.5))


def test_along_the_diagonal_the_line_of_zero_frequency_is_met():
    assert boundary.boundary_radius(CommonArm(), DIAGONAL) == pytest.approx(
        np.sqrt(2.0), rel=1e-8
    )


def test_area_and_perimeter_of_a_circle():
    angle = np.linspace(0.0, 2.0 * np.pi, 721)[:-1]
    closed = boundary.outline(np.full(720, 3.0), np.stack((np.cos(angle), np.sin(angle))))
    assert boundary.enclosed_area(closed) == pytest.approx(9.0 * np.pi, rel=1e-4)
    assert boundary.perimeter(closed) == pytest.approx(6.0 * np.pi, rel=1e-4)
