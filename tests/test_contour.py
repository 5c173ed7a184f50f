import mpmath
import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval

from armlock import CommonArm, paper_loop, unstable_roots
from armlock.axis import contour, counting, exponentials, polynomials, rounding, threads
from armlock.stability import bounds
from armlock.stability.bounds import last_frequency
from armlock.stability.counts import _point_model
from tests.attack import roots
from tests.systems import NEUTRAL, RETARDED


def compiled_sum(coefficients, weights, sums, phases):
    """Weighted exponentials of polynomials in omega, one a row, without roots."""
    empty = np.zeros(0)
    rest = np.zeros((0, 2)), empty.astype(complex), np.zeros(1, int), empty
    whole = exponentials.CompiledPolynomials(
        np.array(coefficients, complex), *rest, empty.astype(int), empty
    )
    weights, sums, phases = (np.array(given, float) for given in (weights, sums, phases))
    return exponentials.CompiledSum(whole, weights, sums, phases, np.zeros_like(sums))


def compiled_polynomial(found):
    """The monic real polynomial with these roots, evaluated from them."""
    coefficients = np.poly(found).real[::-1].astype(np.float64)
    one = polynomials.Polynomial(coefficients, found)
    whole = exponentials.ExponentialSum((one,), np.ones((1, 1)), np.zeros(1), np.ones(1))
    return whole.compiled()


def walk(constants, phases, omega_end):
    """Wind a sum of exponentials times constants."""
    number = len(constants)
    summed = compiled_sum(
        np.reshape(constants, (-1, 1)), np.eye(number), np.ones(number), phases
    )
    argument, value, clear, _, told = threads.interruptible(
        contour.winding, summed, 0.0, omega_end
    )
    assert clear
    assert told
    return argument, value


def test_where_slow_terms_prevail_the_others_are_not_followed():
    # 1 + 0.7 exp(-j omega / 1000) stays larger than 0.2, over 2e9 turns of the last term.
    end = 1e7
    argument, value = walk([1.0, 0.7, 0.2], [0.0, -1e-3, -2e3], end)
    exact = 1.0 + 0.7 * np.exp(-1e-3j * end) + 0.2 * np.exp(-2e3j * end)
    assert value == pytest.approx(exact, abs=1e-5)
    assert argument == pytest.approx(np.angle(exact), abs=1e-5)
    # Where they do not prevail, the last term decides: 0.2 + 0.7 < 1.
    argument, _ = walk([0.2, 0.7, 1.0], [0.0, -1e-3, -20.0], 1e3 * np.pi)
    assert argument == pytest.approx(-2e4 * np.pi, abs=np.pi)


def test_an_argument_that_does_not_add_up_is_doubted():
    # D ends next to A. A polynomial of two more roots points the other way there.
    system, point = CommonArm(gain=3.0), (1.5, 1.5)
    model, end = _point_model(system), float(last_frequency(system, *point))
    go = np.zeros(1, dtype=bool)
    assert counting.count_point(model, *point, end, go) == unstable_roots(system, *point)
    other = model._replace(roots=np.zeros(3, dtype=complex))
    assert counting.count_point(other, *point, end, go) == counting.CONTRADICTORY
    assert counting.count_point(model, *point, end, ~go) == counting.TOO_LONG


@pytest.mark.parametrize("system", [*RETARDED.values(), *NEUTRAL.values()], ids=repr)
def test_past_the_last_crossing_the_undelayed_term_prevails(system):
    for x, y in [(0.4, -0.4), (0.1, 0.05), (-0.3, 0.5)]:
        end = float(last_frequency(system, x, y))
        omega = end * np.linspace(1.0 + 1e-9, 50.0, 4000) + 1e-9
        a, b1, b2 = (np.abs(part) for part in system.parts(1j * omega))
        assert (a >= abs(x) * b1 + abs(y) * b2 - 1e-9 * a).all()


def test_a_piece_goes_on_next_to_a_root_of_high_order():
    whole = compiled_polynomial(np.repeat([0.7j, -0.7j, -1.0], [5, 5, 13]))
    omega = np.nextafter(0.7, 0.0)
    assert exponentials.expand(whole, omega).end > omega


def random_sum(degree, rng):
    """A sum of two polynomials, times exponentials, and the same in forty digits."""
    parts = []
    for number in (degree, degree // 2):
        found = roots(rng, number, 1e-2, 1e3, 0.5)
        coefficients = np.poly(found).real[::-1].astype(np.float64)
        parts.append(polynomials.Polynomial(coefficients, np.array(found, complex)))
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
    rounded = exponentials.rounding_bound(piece, 8.0)
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
            error = exponentials.bound_at(rounded, piece, at)
            assert abs(value - exact(at) / unit) <= error
            changes = [mpmath.diff(exact, at, n) / unit for n in (1, 2)]
            assert abs(slope - changes[0]) <= 1e3 * error * piece.per_reach + 1e-9 * abs(slope)
            sizes = abs(changes[1]), abs(changes[1].imag)
            for size, bend in zip(sizes, bends, strict=False):
                assert size <= exponentials.bound_at(bend, piece, at) * (1.0 + 1e-6)


def random_piece(rng, *, direct=False):
    """A piece of random coefficients and phases, of any sizes."""
    groups, powers = int(rng.integers(1, 4)), int(rng.integers(1, 8))
    sizes = 10.0 ** rng.uniform(-3.0, 3.0, (groups + 1, powers))
    local = sizes * np.exp(2j * np.pi * rng.random((groups + 1, powers)))
    start, length = 0.0, 10.0 ** rng.uniform(-3.0, 3.0)
    if direct:
        # In powers of omega: real, imaginary, real, ...
        local = sizes * rng.choice([-1.0, 1.0], sizes.shape) * 1j ** np.arange(powers)
    else:
        start = rng.choice([0.0, 10.0 ** rng.uniform(-3.0, 3.0)])
    phases = rng.choice([-1.0, 1.0], groups) * 10.0 ** rng.uniform(-3.0, 2.0, groups)
    magnitudes = np.column_stack((np.abs(local), np.zeros(groups + 1)))
    return exponentials.Piece(
        start, start + length, 1.0 / length, local, magnitudes, phases, False
    )


def second_derivative(piece, omega):
    """That of a piece, power by power: (p e)'' = p'' e + 2 p' e' + p e''."""
    u, rate = (omega - piece.start) * piece.per_reach, piece.per_reach
    whole = polyval(u, np.polynomial.polynomial.polyder(piece.local[0], 2)) * rate**2
    for p, phase in zip(piece.local[1:], piece.phases, strict=True):
        value, slope, bend = (
            polyval(u, np.polynomial.polynomial.polyder(p, n)) * rate**n for n in range(3)
        )
        late = np.exp(1j * omega * phase)
        whole = whole + bend * (late - 1.0) + (2j * phase * slope - phase**2 * value) * late
    return whole


@pytest.mark.parametrize("direct", [False, True])
def test_bounds_on_the_curvature_of_random_pieces_hold_everywhere(direct):
    rng = np.random.default_rng(26)
    for _ in range(2000):
        piece = random_piece(rng, direct=direct)
        omega = piece.start + (piece.end - piece.start) * rng.random(20)
        bends = second_derivative(piece, omega)
        pairs = [(np.abs(bends), exponentials.curvature_bound(piece))]
        if direct:
            pairs.append((np.abs(bends.imag), exponentials.curvature_from_zero(piece)))
        for sizes, bound in pairs:
            for size, at in zip(sizes, omega, strict=True):
                assert size <= exponentials.bound_at(bound, piece, at) * (1.0 + 1e-9)


def test_a_monotonic_stretch_is_one():
    rng, told = np.random.default_rng(27), 0
    for _ in range(2000):
        piece = random_piece(rng)
        bound = exponentials.curvature_bound(piece)
        error = exponentials.rounding_bound(piece, rounding.ROUNDING)
        width = 0.5 * (piece.end - piece.start) * 10.0 ** rng.uniform(-6.0, 0.0)
        omega = piece.start + width + (piece.end - piece.start - 2.0 * width) * rng.random()
        if contour._is_monotonic(piece, bound, error, omega, width):
            told += 1
            along = omega + width * np.linspace(-1.0, 1.0, 30)
            slopes = [exponentials.evaluate(piece, at)[1].imag for at in along]
            assert min(slopes) > 0.0 or max(slopes) < 0.0
    assert told > 300


def test_a_position_stays_within_its_spread():
    rng, told = np.random.default_rng(28), 0
    for _ in range(2000):
        piece, square = random_piece(rng), random_piece(rng)
        square = piece._replace(local=square.local[:1] + 0j, sizes=square.sizes[:1])
        square = square._replace(phases=np.zeros(0))
        width = 0.5 * (piece.end - piece.start) * 10.0 ** rng.uniform(-9.0, -1.0)
        omega = piece.start + width + (piece.end - piece.start - 2.0 * width) * rng.random()
        value, slope = exponentials.evaluate(piece, omega)
        zeros = np.array([[omega, 2.0, width, 1.0, value.real, abs(slope)]])
        contour._place(zeros, piece, square, piece.start)
        position, spread = zeros[0, contour.POSITION], zeros[0, contour.SPREAD]
        if np.isfinite(spread) and not np.isnan(position):
            told += 1
            for at in omega + width * np.linspace(-1.0, 1.0, 20):
                over, under = (exponentials.evaluate(p, at)[0].real for p in (piece, square))
                assert abs(over / under - position) <= spread * (1.0 + 1e-9)
    assert told > 300


def test_slow_terms_bound_what_the_fast_ones_add_up_to():
    rng = np.random.default_rng(29)
    for _ in range(500):
        piece = random_piece(rng)
        slow, fast = contour._slow_terms(piece)
        for at in piece.start + (piece.end - piece.start) * rng.random(10):
            left = abs(exponentials.evaluate(piece, at)[0] - exponentials.evaluate(slow, at)[0])
            error = exponentials.rounding_bound(slow, rounding.ROUNDING)
            most = exponentials.bound_at(fast, piece, at)
            assert left <= most + exponentials.bound_at(error, piece, at)


def test_past_the_last_root_a_polynomial_stays_positive():
    rng = np.random.default_rng(30)
    for _ in range(1000):
        found = roots(rng, int(rng.integers(1, 8)), 1e-3, 1e3, 0.6)
        q = np.poly(found).real[::-1].astype(np.float64) * 10.0 ** rng.uniform(-9.0, 9.0)
        bound = bounds.last_root_bound(q)
        real = [root.real for root in found if complex(root).imag == 0.0]
        assert bound >= max([*real, 0.0]) * (1.0 - 1e-9)
        assert (polyval(bound * (1.0 + np.geomspace(1e-6, 1e6, 50)), q) >= 0.0).all()


def cluster(number, spacing, quality):
    """Roots of modes around 1 rad/s."""
    sizes = 1.0 + spacing * (np.arange(number) - 0.5 * (number - 1))
    upper = sizes * (-0.5 / quality + 1j)
    return np.column_stack((upper, upper.conj())).ravel()


@pytest.mark.parametrize("shape", [(7, 1e-2, 500.0), (4, 3e-3, 5e3), (3, 1e-3, 500.0)])
def test_next_to_a_cluster_a_polynomial_keeps_its_digits(shape):
    found = cluster(*shape)
    whole = compiled_polynomial(found)
    scales = []
    for omega in found[::2].imag:
        piece = exponentials.expand(whole, omega)
        value, _ = exponentials.evaluate(piece, omega)
        error = exponentials.bound_at(exponentials.rounding_bound(piece, 8.0), piece, omega)
        exact = np.prod(1j * omega - found)
        # A piece is divided by a power of two.
        scales.append(np.log2(abs(value / exact)))
        assert error < 1e-9 * abs(value)
        assert np.angle(value / exact) == pytest.approx(0.0, abs=1e-9)
    assert np.array(scales) == pytest.approx(np.round(scales), abs=1e-9)


def test_a_stretch_that_may_hold_three_zeros_is_not_taken_for_one():
    # Im f = (omega - 1) ((omega - 1)^2 - 1e-14): the three zeros lie within rounding.
    imaginary = np.poly([1.0, 1.0 - 1e-7, 1.0 + 1e-7])[::-1]
    whole = 1j * imaginary[None, :] + np.array([[1.0, 0.0, 0.0, 0.0]])
    summed = compiled_sum(whole, [[1.0]], [1.0], [0.0])
    zeros, complete = threads.interruptible(
        contour.imaginary_zeros, summed, None, 0.5, 2.0, False, rounding.ROUNDING
    )
    assert complete
    assert zeros[:, [contour.JUMP, contour.HIDDEN]].tolist() == [[2.0, 1.0]]
    assert zeros[0, contour.WIDTH] > 1e-7
    assert abs(zeros[0, contour.OMEGA] - 1.0) < zeros[0, contour.WIDTH]


def test_the_last_frequency_is_close_to_where_one_term_outgrows_the_others():
    loop = paper_loop(actuator=True, delay=2e-5)
    omega = np.geomspace(1.0, 1e6, 200_001)
    polynomials = loop.a, loop.c, loop.b1.coefficients, loop.b2.coefficients
    sizes = [abs(polyval(1j * omega, p)) for p in polynomials]
    below = omega[sizes[0] <= sizes[1] + sizes[2] + sizes[3]].max()
    assert below <= last_frequency(loop, 1.0, 1.0) <= 1.1 * below


def test_a_walk_leaves_a_zero_of_high_order_at_once():
    # Im f = omega^5 (cos omega - 2) beside Re f = omega^2: next to zero only the former counts.
    whole = np.zeros((2, 6), dtype=complex)
    whole[0, 2], whole[1, 5] = 1.0, 1.0j
    summed = compiled_sum(whole, [[0.0, 0.5], [0.0, 0.5]], [1.0, -1.0], [1.0, -1.0])
    zeros, complete = threads.interruptible(
        contour.imaginary_zeros, summed, None, 0.0, 50.0, False, rounding.ROUNDING, most=500
    )
    assert complete
    assert zeros[:, contour.OMEGA].tolist() == [0.0]
