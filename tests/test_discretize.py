"""The sampled state space: exact composition, repeated and complex poles, the bilinear map."""

import numpy as np
import pytest

from armlock import paper, paper_loop
from armlock.discretize import real_system, sample, warped

RATE = 200.0
OMEGA = np.geomspace(1e-3, 0.9 * np.pi * RATE, 25)


def direct(s, zeros, poles, gain, numerators, denominator):
    value = gain * np.ones_like(s)
    for zero in zeros:
        value = value * (s - zero)
    for pole in poles:
        value = value / (s - pole)
    below = np.polynomial.polynomial.polyval(s, denominator)
    return [value * np.polynomial.polynomial.polyval(s, p) / below for p in numerators]


CASES = {
    "repeated": ((-1.0, -1.0), (-0.3, -0.3, -0.3), 2.0, ((1.0,), (1.0, 2.0)), (1.0, 2.0, 1.0)),
    "complex": ((-1 + 2j, -1 - 2j, -3), (-0.1, -0.2 + 1j, -0.2 - 1j), 3.0,
                ((1.0, 2.0, 1.5), (1.0, 0.0, -1.0)), (2.0, 1.4, 1.0)),
    "pair of zeros over real poles": ((-1 + 2j, -1 - 2j), (-0.5, -0.6, -4.0), 1.0,
                                      ((1.0, 1.0),), (1.0, 0.1, 1.0)),
    "improper controller": ((-1.0, -2.0), (-3.0,), 0.7, ((1.0,), (2.0, 1.0)), (1.0, 1.0, 1.0)),
    "no states": ((), (), 5.0, ((1.0,), (2.0,)), (4.0,)),
    "unequal degrees": ((), (0.0,), 2.0, ((1.0,), (0.0,)), (1.0,)),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_response_is_that_of_the_factors(name):
    system = real_system(*CASES[name])
    A, B, C, D = system.as_floats()
    discrete = sample(system, RATE)
    unit = np.eye(len(A))
    for omega in OMEGA:
        there = np.array([1j * omega])
        expected = [h[0] for h in direct(there, *CASES[name])]
        found = C @ np.linalg.solve(there * unit - A, B) + D
        assert found == pytest.approx(expected, rel=1e-10, abs=1e-13)
        bent = 1j * warped([omega], RATE)
        expected = [h[0] for h in direct(bent, *CASES[name])]
        shift = np.expm1(1j * omega / RATE) * unit - discrete.change
        found = discrete.output @ np.linalg.solve(shift, discrete.drive) + discrete.direct
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_poles_are_kept_as_what_they_differ_from_one():
    loop = paper_loop()
    system = real_system(
        loop.controller.zeros,
        loop.controller.poles,
        loop.controller.gain,
        (loop.mapping.numerator1, loop.mapping.numerator2),
        loop.mapping.denominator,
    )
    change = np.diag(sample(system, RATE).change)
    p = np.array([paper.TABLE_2_STAGE_1_POLE] * 2 + [*paper.TABLE_2_POLES])
    p = np.append(p, paper.DUAL_SENSOR_CORNER)
    expected = -p / RATE / (1.0 + 0.5 * p / RATE)
    assert np.sort(change) == pytest.approx(np.sort(expected), rel=1e-15)
    assert np.abs(change).min() < 4e-8


def test_common_factors_at_zero_drop_out():
    # s in the controller against the sensor's integrator, and in all numerators.
    assert len(real_system((0.0,), (-1.0,), 1.0, ((1.0,),), (0.0, 1.0)).A) == 1
    assert len(real_system((), (0.0,), 1.0, ((0.0, 1.0), (0.0, 2.0)), (1.0,)).A) == 0
    assert len(real_system((), (0.0,), 1.0, ((0.0, 1.0), (2.0,)), (1.0,)).A) == 1


def test_improper_systems_are_refused():
    with pytest.raises(ValueError, match="more zeros than poles"):
        real_system((-1.0, -2.0), (-3.0,), 1.0)


@pytest.mark.parametrize(
    ("omega", "rate", "error", "message"),
    [
        (-1.0, 2.0, ValueError, r"omega must not be negative and at most 6\.28.* got -1\.0$"),
        (
            [1.0, 6.3],
            2.0,
            ValueError,
            r"at most 6\.28\d+ rad/s, half the sample rate, got 6\.3$",
        ),
        (np.nan, 2.0, ValueError, "omega must be finite, got nan"),
        (1j, 2.0, TypeError, "omega must be real"),
        (1.0, 0.0, ValueError, r"sample_rate must be positive, got 0\.0"),
        (1.0, np.nan, ValueError, "sample_rate must be finite, got nan"),
        (1.0, True, TypeError, "sample_rate must be a real number, got True"),
    ],
)
def test_frequencies_beyond_half_the_rate_have_no_counterpart(omega, rate, error, message):
    with pytest.raises(error, match=message):
        warped(omega, rate)


def test_half_the_rate_stands_for_infinity():
    for rate in (0.3, 7.0, 200.0, 1e5 / 3):
        assert warped([0.0, np.pi * rate], rate)[0] == 0.0
        assert warped(np.nextafter(np.pi * rate, np.inf), rate) > 1e15 * rate
