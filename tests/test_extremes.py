import numpy as np
import pytest

from book.companion.extremes import largest, smallest


def test_a_peak_between_points_is_found_among_lower_ones():
    def curve(x):
        return np.cos(x) + 0.1 * np.cos(3.0 * x + 0.2) + 0.01 * x

    fine = np.linspace(0.0, 40.0, 4_000_001)
    coarse = np.linspace(0.0, 40.0, 300)
    for found, best in ((largest, np.argmax), (smallest, np.argmin)):
        k = best(curve(fine))
        at, value = found(curve, coarse)
        assert value == pytest.approx(curve(fine)[k], abs=1e-9)
        assert at == pytest.approx(fine[k], abs=1e-4)


def test_an_end_may_be_the_highest_point():
    assert largest(lambda x: -np.asarray(x), np.linspace(2.0, 3.0, 5)) == (2.0, -2.0)
    assert largest(np.exp, np.linspace(0.0, 1.0, 5)) == (1.0, np.e)
