import mpmath
import numpy as np
import pytest

from armlock import (
    CommonArm,
    DualArm,
    d_curve,
    d_curve_branches,
    d_curve_line,
    paper_loop,
    semi_discretization,
)
from tests import draws, independent
from tests.systems import NEUTRAL, RETARDED, two_delays

MAP = semi_discretization(CommonArm(tau1=2.0, tau2=1.5), 0.25, order=1)
LOOPS = {
    "delays far apart": CommonArm(1.0, 20.1, 0.3),
    "dual arm, high gain": DualArm(),
    "controlled": paper_loop(),
    "map": MAP,
    "map, fine": semi_discretization(CommonArm(), 0.1),
}
CURVED = {
    name: system
    for name, system in {**RETARDED, **NEUTRAL, **LOOPS}.items()
    if all(system.numerator.before(name) for name in system.parameters)
}


@pytest.mark.parametrize("name", sorted(CURVED.keys() - {"controlled"}))
def test_the_line_has_a_root_at_zero(name):
    system = CURVED[name]
    wx, wy, value = d_curve_line(system)
    x = value * wx / (wx * wx + wy * wy) + wy
    y = value * wy / (wx * wx + wy * wy) - wx
    assert abs(independent.value(system, 0.0, x, y)) < 1e-12
    assert max(abs(wx), abs(wy)) == 1.0


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_the_units_of_the_parameters_move_no_pole(factor):
    """Both parameters in other units: the same curve, with the same poles, at another scale."""
    plain = two_delays([1.0, 0.5, 1.0], [1.0], [0.0, 2.0], 2.0, 1.0)
    scaled = two_delays([1.0, 0.5, 1.0], [factor], [0.0, 2.0 * factor], 2.0, 1.0)
    # The determinant is -2 omega cos(omega): poles at odd multiples of pi / 2.
    omega = np.linspace(0.0, 6.0 * np.pi, 25)
    expected = np.array(d_curve(plain, omega))
    assert np.flatnonzero(np.isnan(expected[0])).tolist() == [0, 2, 6, 10, 14, 18, 22]
    np.testing.assert_allclose(factor * np.array(d_curve(scaled, omega)), expected, rtol=1e-9)


def test_branches_of_the_common_arm_end_at_the_poles():
    tau1, tau2 = 20.1, 19.9
    branches = d_curve_branches(CommonArm(1.0, tau1, tau2), 60.0)
    poles = np.pi / (tau1 - tau2) * np.arange(1, 4)
    assert len(branches) == 4
    edges = np.concatenate(([0.0], poles, [60.0]))
    for branch, low, high in zip(branches, edges[:-1], edges[1:], strict=True):
        assert low < branch.omega[0] < branch.omega[-1] < high
        assert branch.omega[0] - low < 0.01
        assert high - branch.omega[-1] < 0.01


@pytest.mark.parametrize("name", CURVED)
def test_no_branch_has_a_pole_inside(name):
    system = CURVED[name]
    for branch in d_curve_branches(system, 8.0):
        assert (np.diff(branch.omega) > 0.0).all()
        assert np.isfinite(branch.x).all()
        assert np.isfinite(branch.y).all()
        s = 1j * branch.omega
        d, one, two = (independent.value(system, s, *c) for c in ((0, 0), (1, 0), (0, 1)))
        b1, b2 = one - d, two - d
        determinant = np.imag(b1 * np.conj(b2))
        assert (np.sign(determinant) == np.sign(determinant[0])).all()


def test_a_branch_of_a_map_ends_at_the_nyquist_frequency():
    nyquist_frequency = np.pi / MAP.step
    for asked in (nyquist_frequency, 1e6):
        last = d_curve_branches(MAP, asked)[-1].omega[-1]
        assert 0.99 * nyquist_frequency < last <= nyquist_frequency
    assert 0.99 * 5.0 < d_curve_branches(MAP, 5.0)[-1].omega[-1] <= 5.0


def exact_curve(system, omega):
    """The point of the curve at a double taken as exact, with as many digits as it takes."""
    with mpmath.workdps(40 + 2 * int(abs(np.log10(abs(omega))))):
        s = mpmath.mpc(0, float(omega))
        # Without both signals, and by how much each of them lowers that.
        a, one, other = (independent.exact(system, s, *c) for c in ((0, 0), (1, 0), (0, 1)))
        late1, late2 = a - one, a - other
        determinant = mpmath.im(late1 * mpmath.conj(late2))
        x = mpmath.im(a * mpmath.conj(late2)) / determinant
        y = -mpmath.im(a * mpmath.conj(late1)) / determinant
        return float(x), float(y), float(abs(determinant) / abs(late1 * late2))


@pytest.mark.parametrize("name", CURVED)
def test_the_curve_is_right_at_every_frequency(name):
    system, rng = CURVED[name], np.random.default_rng(5)
    number = draws(25, 400)
    for omega in rng.choice([-1.0, 1.0], number) * 10.0 ** rng.uniform(-9.0, 7.0, number):
        x, y = d_curve(system, omega)
        exact_x, exact_y, sine = exact_curve(system, omega)
        # The coefficients' own rounding is magnified next to a pole, beyond low frequencies.
        size = abs(omega)
        turns = 1.0 + size * system.longest_delay
        allowed = 1e-11 + 1e-15 / size if size < 1e-2 else 1e-12 * turns / sine
        assert x == pytest.approx(exact_x, rel=allowed, abs=allowed)
        assert y == pytest.approx(exact_y, rel=allowed, abs=allowed)


def test_where_a_parameter_has_no_effect_the_curve_has_a_pole():
    system = two_delays([1.0, 1.0, 1.0], [4.0, 0.0, 1.0], [1.0], 1.0, 2.5)
    x, y = d_curve(system, [1.9, 2.0, 2.1])
    # A root of B1 is known to rounding: the curve is far away there, or nan.
    assert not abs(x[1]) < 1e12
    assert (np.abs([x[0], x[2], y[0], y[2]]) < 1e4).all()


def test_terms_in_proportion_have_no_curve_at_equal_delays():
    with pytest.raises(ValueError, match=r"^c1 and c2 must act differently"):
        d_curve(CommonArm(2.0, 20.0, 20.0), 1.0)
