import os
import subprocess
import sys

import mpmath
import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval

from armlock import CommonArm, paper_loop, unstable_roots
from armlock.axis import contour, counting, exponentials
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import _point_model
from tests.attack import roots
from tests.systems import NEUTRAL, RETARDED


def walk(coefficients, phases, omega_end):
    """Wind a sum of polynomials in omega, one a row, times exponentials."""
    whole = np.array(coefficients, dtype=complex)
    nothing = np.zeros(0, complex), np.zeros(1, int), np.zeros(0), np.zeros(0, int)
    polynomials = exponentials.CompiledPolynomials(whole, *nothing)
    weights, sums, phases = (
        np.eye(len(whole)),
        np.ones(len(whole)),
        np.array(phases, dtype=float),
    )
    summed = exponentials.CompiledSum(polynomials, weights, sums, phases)
    return contour.winding(summed, np.zeros(len(whole)), 0.0, omega_end)


def test_a_single_exponential_winds_at_its_rate():
    argument, value, clear = walk([[1.0]], [-3.0], 100.0)
    assert clear
    assert argument == pytest.approx(-300.0, rel=1e-12)
    assert value == pytest.approx(np.exp(-300j))


@pytest.mark.parametrize("weight", [0.3, 0.99, 0.999999, 1.000001, 1.01, 3.0])
def test_the_larger_of_two_exponentials_decides(weight):
    # 1 + w exp(j omega) over whole turns: none for w < 1, all of them for w > 1.
    argument, _, clear = walk([[1.0], [weight]], [0.0, 1.0], 40.0 * np.pi)
    assert clear
    assert argument == pytest.approx(0.0 if weight < 1.0 else 40.0 * np.pi, abs=1e-9)


def test_where_slow_terms_prevail_the_others_are_not_followed():
    # 1 + 0.7 exp(-j omega / 1000) stays larger than 0.2, over 2e9 turns of the last term.
    end = 1e7
    argument, value, clear = walk([[1.0], [0.7], [0.2]], [0.0, -1e-3, -2e3], end)
    exact = 1.0 + 0.7 * np.exp(-1e-3j * end) + 0.2 * np.exp(-2e3j * end)
    assert clear
    assert value == pytest.approx(exact, abs=1e-5)
    assert argument == pytest.approx(np.angle(exact), abs=1e-5)
    # Where they do not prevail, the last term decides: 0.2 + 0.7 < 1.
    argument, _, clear = walk([[0.2], [0.7], [1.0]], [0.0, -1e-3, -20.0], 1e3 * np.pi)
    assert clear
    assert argument == pytest.approx(-2e4 * np.pi, abs=np.pi)


def test_a_zero_on_the_way_is_reported():
    assert not walk([[1.0], [1.0]], [0.0, 1.0], 40.0)[2]
    assert not walk([[-2.0, 1.0]], [0.0], 5.0)[2]


def test_a_polynomial_gathers_the_angles_of_its_roots():
    # (1 + j omega)^3, from 0 to 50.
    argument, _, _ = walk([[1.0, 3j, -3.0, -1j]], [0.0], 50.0)
    assert argument == pytest.approx(3.0 * np.arctan(50.0), rel=1e-12)


def test_an_argument_that_does_not_add_up_is_doubted():
    # D ends next to A. A polynomial of two more roots points the other way there.
    system, point = CommonArm(gain=3.0), (1.5, 1.5)
    model, end = _point_model(system), float(last_frequency(system, *point))
    assert counting.count_point(model, *point, end) == unstable_roots(system, *point)
    other = model._replace(roots=np.zeros(3, dtype=complex))
    assert counting.count_point(other, *point, end) == counting.DOUBTFUL


@pytest.mark.parametrize("system", [*RETARDED.values(), *NEUTRAL.values()], ids=repr)
def test_past_the_last_crossing_the_undelayed_term_prevails(system):
    for x, y in [(0.4, -0.4), (0.1, 0.05), (-0.3, 0.5)]:
        end = float(last_frequency(system, x, y))
        omega = end * np.linspace(1.0 + 1e-9, 50.0, 4000) + 1e-9
        a, b1, b2 = (np.abs(part) for part in system.parts(1j * omega))
        assert (a >= abs(x) * b1 + abs(y) * b2 - 1e-9 * a).all()


def test_the_last_crossing_of_the_common_arm_is_known():
    # omega^2 + 4 g^2 = g^2 (|c1| + |c2|)^2
    ends = last_frequency(CommonArm(gain=3.0), [1.0, 1.5, -2.0, 3.0], [0.5, 1.5, 2.0, -3.0])
    exact = 3.0 * np.sqrt([0.0, 5.0, 12.0, 32.0])
    assert ends[0] == 0.0
    assert (ends >= exact).all()
    np.testing.assert_allclose(ends, exact, rtol=0.05)


@pytest.mark.parametrize("number", [2, 12, 40])
def test_a_piece_reaches_as_far_as_equal_roots_allow(number):
    # Of n roots at distance d, n reach / (reach + d) counts: 1.5 at reach = 1.5 d / (n - 1.5).
    # Another polynomial's roots do not count.
    roots, starts = np.full(2 * number, -3.0 + 0j), np.array([0, number, 2 * number])
    expected = 1.5 * 5.0 / (number - 1.5)
    found = exponentials._reach(roots, starts, 4.0)
    assert found == pytest.approx(expected, rel=1e-2)


def test_a_piece_goes_on_next_to_a_root_of_high_order():
    found = np.repeat([0.7j, -0.7j, -1.0], [5, 5, 13])
    high = exponentials.Polynomial(np.poly(found).real[::-1].astype(np.float64), found)
    whole = exponentials.ExponentialSum((high,), np.ones((1, 1)), np.zeros(1), np.ones(1))
    omega = np.nextafter(0.7, 0.0)
    assert exponentials.expand(whole.compiled(), omega).end > omega


def random_sum(degree, rng):
    """A sum of two polynomials, times exponentials, and the same in forty digits."""
    parts = []
    for number in (degree, degree // 2):
        found = roots(rng, number, 1e-2, 1e3, 0.5)
        coefficients = np.poly(found).real[::-1].astype(np.float64)
        parts.append(exponentials.Polynomial(coefficients, np.array(found, complex)))
    phases, weights = rng.uniform(-3.0, 3.0, 2), rng.normal(size=(2, 2))
    whole = exponentials.ExponentialSum(tuple(parts), weights, phases, weights.sum(axis=0))

    def value(p, s):
        if degree <= exponentials.LOW_DEGREE:
            return mpmath.polyval(p.coefficients.tolist(), s, asc=True)
        return p.coefficients[-1] * mpmath.fprod(s - mpmath.mpc(root) for root in p.roots)

    def exact(omega):
        s, late = mpmath.mpc(0, omega), [mpmath.expj(omega * mpmath.mpf(t)) for t in phases]
        return sum(
            value(p, s) * mpmath.fdot(weights[:, k].tolist(), late) for k, p in enumerate(parts)
        )

    return whole, exact


@pytest.mark.parametrize("degree", [2, 12, 30, 60])
@pytest.mark.parametrize("omega", [0.0, 0.03, 2.0, 3e4])
def test_a_piece_holds_a_sum_and_bounds_what_it_leaves_out(degree, omega):
    whole, exact = random_sum(degree, np.random.default_rng(degree))
    piece = exponentials.expand(whole.compiled(), omega)
    rounding = exponentials.rounding_bound(piece, 8.0)
    bends = [exponentials.curvature_bound(piece)]
    if omega == 0.0:
        bends.append(exponentials.curvature_from_zero(piece))
    length = min(piece.end - omega, 0.5)
    with mpmath.workdps(40):
        # A piece is divided by a power of two.
        at = omega + length
        found = exponentials.evaluate(piece, at)[0]
        unit = 2.0 ** round(float(mpmath.log(abs(exact(at) / found), 2)))
        for share in (0.01, 0.4, 1.0):
            at = omega + share * length
            value, slope = exponentials.evaluate(piece, at)
            error = exponentials.bound_at(rounding, piece, at)
            assert abs(value - exact(at) / unit) <= error
            changes = [mpmath.diff(exact, at, n) / unit for n in (1, 2)]
            assert abs(slope - changes[0]) <= 1e3 * error * piece.per_reach + 1e-9 * abs(slope)
            sizes = abs(changes[1]), abs(changes[1].imag)
            for size, bend in zip(sizes, bends, strict=False):
                assert size <= exponentials.bound_at(bend, piece, at) * (1.0 + 1e-6)


def test_the_last_frequency_is_close_to_where_one_term_outgrows_the_others():
    loop = paper_loop(actuator=True, delay=2e-5)
    omega = np.geomspace(1.0, 1e6, 200_001)
    sizes = [abs(polyval(1j * omega, p)) for p in (loop.a, loop.c, loop.b1, loop.b2)]
    below = omega[sizes[0] <= sizes[1] + sizes[2] + sizes[3]].max()
    assert below <= last_frequency(loop, 1.0, 1.0) <= 1.1 * below


# Im f = omega^5 (cos omega - 2) beside Re f = omega^2: next to zero only the former counts.
HIGH_ORDER = """
import numpy as np
from armlock.axis import contour, counting, exponentials

whole = np.zeros((2, 6), dtype=complex)
whole[0, 2], whole[1, 5] = 1.0, 1.0j
nothing = np.zeros(0, complex), np.zeros(1, int), np.zeros(0), np.zeros(0, int)
polynomials = exponentials.CompiledPolynomials(whole, *nothing)
weights, phases = np.array([[0.0, 0.5], [0.0, 0.5]]), np.array([1.0, -1.0])
function = exponentials.CompiledSum(polynomials, weights, np.array([1.0, -1.0]), phases)
steps = []
contour.evaluate = lambda *at: steps.append(at) or exponentials.evaluate(*at)
zeros, complete = contour.imaginary_zeros(
    function, None, 0.0, 50.0, False, exponentials.ROUNDING
)
print(complete, zeros[:, contour.OMEGA].tolist(), len(steps))
"""


def test_a_walk_leaves_a_zero_of_high_order_at_once():
    # Uncompiled, so that the steps can be counted.
    plain = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-c", HIGH_ORDER]
    run = subprocess.run(command, env=plain, capture_output=True, text=True, check=True)
    complete, zeros, steps = run.stdout.split()
    assert (complete, zeros) == ("True", "[0.0]")
    assert int(steps) < 500
