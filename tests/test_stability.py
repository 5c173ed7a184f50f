import json
import pickle
import time

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from armlock import (
    BOUNDARY,
    UNCONFINED,
    UNDECIDED,
    CommonArm,
    Controller,
    CountError,
    DualArm,
    HayesEquation,
    Loop,
    SingleArm,
    d_curve,
    equation,
    margins,
    stability_chart,
    unstable_roots,
)
from armlock.robustness.margins import chain_limit
from armlock.sensors import DIFFERENCE
from armlock.stability import crossings
from armlock.stability.counts import count_points
from tests import draws, independent
from tests.systems import NEUTRAL, RETARDED, two_delays, with_roots
from tests.test_in_time import ends_when_interrupted

RETARDED_AND_NEUTRAL = {**RETARDED, **{f"neutral {n}": s for n, s in NEUTRAL.items()}}

reals = st.floats(-3.0, 3.0)
gains = st.floats(0.01, 3.0)
delays = st.floats(0.2, 5.0)


def pointwise(system, x, y):
    """A chart, held against the count at each of its points."""
    chart = stability_chart(system, x, y)
    expected = unstable_roots(system, x, np.array(y)[:, None])
    np.testing.assert_array_equal(chart.counts, expected)
    np.testing.assert_array_equal(chart.x, x)
    np.testing.assert_array_equal(chart.y, y)
    return chart


class TestHayes:
    @given(
        st.floats(-8.0, 8.0),
        st.floats(-12.0, 12.0).filter(lambda b: abs(b) > 1e-9),
        st.floats(0.05, 20.0),
    )
    def test_count_is_the_number_of_lambert_roots_on_the_right(self, a, b, tau):
        system = HayesEquation(tau)
        count = unstable_roots(system, a / tau, b / tau)
        assume(count != BOUNDARY)
        assert count == independent.hayes_count(a / tau, b / tau, tau)

    def test_points_of_the_curve_and_of_the_line_are_boundary_points(self):
        a, b = d_curve(HayesEquation(), np.linspace(0.05, 3.1, 400))
        np.testing.assert_array_equal(unstable_roots(HayesEquation(), a, b), BOUNDARY)
        a = np.linspace(-4.0, 4.0, 33)
        np.testing.assert_array_equal(unstable_roots(HayesEquation(), a, -a), BOUNDARY)
        b = -np.pi / 2.0 * np.array([1.0, -3.0, 5.0])
        np.testing.assert_array_equal(unstable_roots(HayesEquation(), 0.0, b), BOUNDARY)


class TestCommonArm:
    def test_acceptance_counts(self, table):
        for row in table("common_arm_roots.csv"):
            c1, c2, count = float(row["c1"]), float(row["c2"]), int(row["unstable_roots"])
            assert unstable_roots(CommonArm(), c1, c2) == count
            assert independent.count(CommonArm(), c1, c2) == count

    @given(gains, delays, delays, reals, reals)
    def test_count_is_the_winding_number(self, gain, tau1, tau2, c1, c2):
        system = CommonArm(gain, tau1, tau2)
        count = unstable_roots(system, c1, c2)
        assume(count != BOUNDARY)
        # Where D(0) = 0 the pole of L cancels.
        assert count == independent.count(system, c1, c2, at_zero=int(c1 + c2 == 2.0))

    def test_the_ideal_point_and_its_line_are_boundary_points_at_any_gain(self):
        c1 = np.linspace(-3.0, 3.0, draws(13, 49))
        for gain in (1e-3, 1.0, 10.0, 1000.0):
            np.testing.assert_array_equal(
                unstable_roots(equation(1 + CommonArm(gain=gain)), c1, 2.0 - c1), BOUNDARY
            )
            # The loop has no root at s = 0 there: what cancels is no root of 1 + L.
            assert (unstable_roots(CommonArm(gain=gain), c1, 2.0 - c1) >= 0).all()

    @pytest.mark.parametrize("gain", [0.01, 1.0, 10.0, 1000.0])
    @pytest.mark.parametrize("distance", [1e-4, 1e-7, 1e-10, 1e-12])
    def test_sides_of_the_ideal_point_are_told_apart(self, gain, distance):
        system = CommonArm(gain=gain)
        for c1, c2 in [(1.0, 1.0), (0.6, 1.4)]:
            assert unstable_roots(system, c1 - distance, c2) == 0
            assert unstable_roots(system, c1 + distance, c2) == 1

    def test_within_rounding_of_the_boundary_nothing_is_guessed(self):
        # The sign of c1 + c2 - 2 is exact here: c2 = 1 + k eps, and c1 = 1.
        k = np.arange(-400, 401)
        counts = unstable_roots(equation(1 + CommonArm()), 1.0, 1.0 + k * np.finfo(float).eps)
        truth = np.where(k > 0, 1, 0)
        assert ((counts == truth) | (counts == BOUNDARY)).all()
        assert (counts[abs(k) > 300] != BOUNDARY).all()
        assert counts[400] == BOUNDARY

    @pytest.mark.parametrize("size", [1e-9, 1e-3])
    def test_next_to_zero_nearly_equal_parameters_are_told_apart(self, size):
        y = size * (1.0 + np.array([-1e-12, 1e-12]))
        assert pointwise(DualArm(0.3), [size], y).counts.ravel().tolist() == [1, 0]

    def test_near_the_curve_high_precision_decides(self):
        system = CommonArm(gain=10.0)
        omega = 4.5
        c1, c2 = (float(c) for c in d_curve(system, omega))
        for shift in (-1e-9, -1e-11, -1e-12, 1e-12, 1e-11, 1e-9):
            with mpmath.workdps(40):
                root = mpmath.findroot(
                    lambda s, x=c1 + shift: independent.exact(system, s, x, c2),
                    mpmath.mpc(0, omega),
                )
            assert abs(root.imag - omega) < 1e-6
            here = unstable_roots(system, c1 + shift, c2)
            far = unstable_roots(system, c1 + np.copysign(1e-5, shift), c2)
            assert here == far or BOUNDARY in (here, far)
            both = unstable_roots(system, c1 + np.array([-1e-5, 1e-5]), c2)
            assert (root.real > 0) == (far == both.max())
            if abs(shift) >= 1e-9:
                assert here != BOUNDARY


class TestOtherLoops:
    @pytest.mark.parametrize("name", RETARDED_AND_NEUTRAL)
    def test_count_is_the_winding_number(self, name):
        system, size = RETARDED_AND_NEUTRAL[name], 0.55 if "neutral" in name else 2.5
        for x, y in np.random.default_rng(2).uniform(-size, size, (8, 2)):
            assert unstable_roots(system, x, y) == independent.count(system, x, y)

    @pytest.mark.parametrize("name", NEUTRAL)
    def test_a_neutral_chain_that_is_not_confined_has_no_count(self, name):
        system = NEUTRAL[name]
        d, first, second = (independent.terms(system, *c) for c in ((0, 0), (1, 0), (0, 1)))
        a = d.pop(0)
        n = len(a) - 1
        leads = [
            sum(abs(float((p + [0] * (n + 1))[n]) - float((d.get(t, []) + [0] * (n + 1))[n]))
                for t, p in part.items() if t)
            for part in (first, second)
        ]  # fmt: skip
        room = abs(a[n]) - sum(abs(float(p[n])) for p in d.values() if len(p) > n)
        x, y = np.random.default_rng(2).uniform(-3.0, 3.0, (2, 200))
        counts = unstable_roots(system, x, y)
        chain = abs(x) * leads[0] + abs(y) * leads[1]
        np.testing.assert_array_equal(counts == UNCONFINED, chain >= room)
        limit = room / max(leads)
        on_it = (limit, 0.0) if leads[0] else (0.0, limit)
        assert unstable_roots(system, *on_it) == UNCONFINED

    @given(st.sampled_from(list(NEUTRAL)), *[reals] * 2, *[st.integers(-900, 900)] * 2)
    def test_a_ray_leaves_a_neutral_chain_where_its_reserve_ends(self, name, x, y, dx, dy):
        system = NEUTRAL[name]
        assume(dx or dy)
        start, way = 0.1 * np.array([x, y]), 0.01 * np.array([dx, dy])
        _, first, second = system.affine.terms
        change = first * way[0] + second * way[1]
        limit = min(chain_limit(system.affine.function(*start), change, 0.0), 1e12)
        near = [start + limit * share * way for share in (1.0 - 1e-9, 1.0 + 1e-9)]
        inside, outside = (system.affine.function(*point).confined for point in near)
        assert inside or limit == 0.0
        assert not outside or limit == 1e12

    @pytest.mark.parametrize(
        ("roots", "count"),
        [
            ((-1.0, -2.0, -3.0), 0),
            ((0.5,), 1),
            ((0.5, 0.5, 0.5), 3),
            ((1e-6 + 1j, 1e-6 - 1j, -1.0), 2),
            ((1j, -1j, 1.0), BOUNDARY),
            ((0.0, -1.0), BOUNDARY),
            ((0.0, 0.0, 0.0, 0.0, 0.0), BOUNDARY),
            ((2j, -2j, 2j, -2j), BOUNDARY),
        ],
    )
    def test_without_parameters_the_roots_of_a_count(self, roots, count):
        b1, b2 = [1.0], [0.5]
        system = two_delays(with_roots(*roots), b1, b2, 1.0, 2.0)
        assert unstable_roots(system, 0.0, 0.0) == count

    def test_without_delays_the_roots_of_a_polynomial_count(self):
        system = two_delays([2.0, 1.0, 3.0, 1.0], [1.0, 1.0], [0.0, 0.0, 1.0], 0, 0)
        x, y = np.random.default_rng(3).uniform(-5.0, 5.0, (2, 50))
        for p, q in zip(x, y, strict=True):
            roots = np.roots([1.0, 3.0 - q, 1.0 - p, 2.0 - p])
            assert unstable_roots(system, p, q) == np.count_nonzero(roots.real > 0.0)

    def test_scalars_and_arrays_keep_their_shapes(self):
        assert type(unstable_roots(CommonArm(), 0.5, 0.5)) is int
        assert unstable_roots(CommonArm(), [0.5], 0.5).shape == (1,)
        assert unstable_roots(CommonArm(), [], 0.5).shape == (0,)
        assert unstable_roots(CommonArm(), np.zeros((2, 1)), np.zeros(3)).shape == (2, 3)
        assert unstable_roots(CommonArm(), [0.5], 0.5).dtype == np.int64


class TestChart:
    @pytest.mark.parametrize("name", RETARDED_AND_NEUTRAL)
    def test_every_point_is_the_count_at_that_point(self, name):
        rng = np.random.default_rng(11)
        x, y = rng.uniform(-2.5, 2.5, 41), rng.uniform(-2.5, 2.5, 23)
        pointwise(RETARDED_AND_NEUTRAL[name], x, y)

    @given(
        st.lists(reals, min_size=1, max_size=6),
        st.lists(reals, min_size=1, max_size=6),
        gains,
        delays,
        delays,
    )
    def test_any_axes_give_the_pointwise_count(self, x, y, gain, tau1, tau2):
        pointwise(CommonArm(gain, tau1, tau2), x, y)

    @pytest.mark.parametrize("width", [1e-9, 1e-12])
    @pytest.mark.parametrize("centre", [(1.0, 1.0), (0.7, 1.3), (2.0, 0.0)])
    def test_a_tiny_window_shows_the_line_through_it(self, centre, width):
        steps = np.arange(-4, 5)
        chart = pointwise(CommonArm(gain=10.0), *(c + width * steps for c in centre))
        side = np.add.outer(steps, steps)
        assert (chart.counts[side < 0] == 0).all()
        assert (chart.counts[side > 0] == 1).all()

    @pytest.mark.parametrize(
        ("system", "omega", "way"),
        [
            (CommonArm(gain=10.0), 3.819, -1.0),
            (CommonArm(gain=10.0), 3.975, 1.0),
            (CommonArm(gain=1.0, tau1=2.0, tau2=0.7), 3.348, 1.0),
            (RETARDED["third order, unstable A"], 3.011, -1.0),
        ],
    )
    def test_rows_that_touch_the_curve_are_counted_as_points_are(self, system, omega, way):
        """There, at an extremum of y, two crossings merge and vanish."""
        omega = minimize_scalar(
            lambda w: way * float(d_curve(system, w)[1]),
            bounds=(omega - 0.05, omega + 0.05),
            method="bounded",
            options={"xatol": 1e-13},
        ).x
        x, y = d_curve(system, omega)
        offsets = np.array([0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3])
        x = np.concatenate(([-2.9], x - offsets[::-1], x + offsets, [2.9]))
        y = y + np.array([-1e-9, -1e-12, 0.0, 1e-12, 1e-9])
        counts = pointwise(system, x, y).counts
        # Away from the touching point, all five rows lie in the same regions.
        clear = counts[:, [1, -2]]
        assert (clear >= 0).all()
        assert (clear == clear[0]).all()


class TestLimits:
    """What changes nothing, and what is refused."""

    @pytest.mark.parametrize("scale", [1e-170, 1e-20, 1e20])
    def test_a_common_factor_changes_no_count(self, scale):
        x, y = np.array([1.0, 20.0, 5.0, -20.0, -35.0]), np.array([1.0, -3.0])
        plain = two_delays([1.0, 1.0], [0.1], [0.1], 1.0, 2.0)
        system = two_delays([scale, scale], [0.1 * scale], [0.1 * scale], 1.0, 2.0)
        expected = unstable_roots(plain, x, y[:, None])
        assert set(expected.ravel()) == {0, 1, 2}
        np.testing.assert_array_equal(pointwise(system, x, y).counts, expected)

    def test_a_delayed_term_of_order_zero_has_no_sign(self):
        system = two_delays([1.0], [1.0], [1.0], 1.0, 2.0)
        counts = unstable_roots(system, [0.4, -0.4, -5.0, 0.5], [0.4, 0.5, 2.0, 0.5])
        np.testing.assert_array_equal(counts, [0, 0, UNCONFINED, UNCONFINED])

    @pytest.mark.parametrize(
        ("system", "point"),
        [
            (HayesEquation(), (0.3, -1e9)),
            (CommonArm(1e10), (1.2, 1.05)),
        ],
    )
    def test_what_takes_too_long_is_refused_at_once(self, system, point):
        stability_chart(HayesEquation(), [0.0], [0.5])
        started = time.process_time()
        with pytest.raises(CountError, match="takes more than") as caught:
            unstable_roots(system, *point)
        np.testing.assert_array_equal(caught.value.points, [point])
        # Among others it is marked, and the others are counted.
        chart = stability_chart(system, [point[0]], [point[1], 0.0]).counts[:, 0]
        for marked, counted in (chart, unstable_roots(system, point[0], [point[1], 0.0])):
            assert (marked, counted >= BOUNDARY) == (UNDECIDED, True)
        assert time.process_time() - started < 10.0
        # A large undelayed term is no reason to refuse.
        assert unstable_roots(CommonArm(1e12), 0.9, 1.05) == 0

    def test_the_error_passes_from_process_to_process(self):
        again = pickle.loads(pickle.dumps(CountError("why", np.array([[1.0, 2.0]]))))
        assert str(again) == "why"
        np.testing.assert_array_equal(again.points, [[1.0, 2.0]])


def test_equal_roots_are_counted_where_a_shift_takes_them():
    # Ten roots at -0.002 after the shift, of which doubles alone would scatter some.
    equal = two_delays(np.poly([-1.0] * 10)[::-1].tolist(), [1.0], [1.0], 1.0, 2.0)
    assert unstable_roots(equal, 0.0, 0.0, right_of=-0.998) == 0
    assert unstable_roots(equal, 0.0, 0.0, right_of=-1.002) == 10


def test_a_row_that_starts_hidden_doubts_the_points_around_its_crossing():
    # Im D of this row is 0.2 omega^5 next to zero, and hidden up to some 1e-3 rad/s.
    system, y = two_delays([-11.0 / 6.0, 1.0], [1.0], [1.0], 2.0, 1.0), -8.0 / 3.0
    x = 5.0 / 6.0 + np.array([-1.0, -1e-8, 1e-8, 1e-6, 1.0])
    counts = stability_chart(system, x, [y]).counts[0]
    np.testing.assert_array_equal(counts, unstable_roots(system, x, y))


def test_right_of_a_line_the_closed_loop_is_counted():
    loop = CommonArm()
    # A root at s = 0 that cancels is none of the loop, on whichever side of the line.
    for right_of in (-1e-3, 1e-3):
        plain = unstable_roots(equation(1 + loop), 1.0, 1.0, right_of=right_of)
        assert unstable_roots(loop, right_of=right_of) == plain - (right_of < 0.0)
    with pytest.raises(ValueError, match=r"^right_of must be at most 700 over the longest"):
        unstable_roots(loop, right_of=-1e3)


def test_more_points_than_memory_holds_are_refused():
    with pytest.raises(ValueError, match=r"^c1 and c2 must be of a size that memory holds"):
        unstable_roots(CommonArm(), np.zeros((300_000, 1)), np.zeros(400_000))


def test_where_rounding_hides_all_crossings_few_intervals_are_kept():
    # N is c2 times M, but for a part in 1e16: each step leaves an interval undecided.
    loop = Loop(Controller([], [-1.0], 1e16), DIFFERENCE, 20.0, 20.0)
    constant, first, second = loop.affine.terms
    functions = constant, second * -1, first * -1
    y, one = np.array([0.5, 0.6]), np.ones(2)
    found = crossings.crossings(functions, y, -one, one, 1e4 * one, most=20_000)
    assert found.unfinished.all()
    assert 0 < (found.jump == 0).sum() <= 4096 * y.size


def test_all_points_real_are_boundary_points_up_to_the_end():
    # D = s^2 + 1 - x: real on all of the axis, zero where omega^2 = 1 - x.
    real = two_delays([1.0, 0.0, 1.0], [1.0], [0.0], 0.0, 0.0)
    counts = stability_chart(real, [-3.0, 0.5, 2.0], [0.0]).counts
    np.testing.assert_array_equal(counts, [[BOUNDARY, BOUNDARY, 1]])


def test_counts_and_margins_of_one_point_are_numbers_for_json():
    found = {"count": unstable_roots(CommonArm(), 0.9, 0.9)} | vars(
        margins(CommonArm(), 0.9, 0.9)
    )
    assert str(json.loads(json.dumps(found))) == str(found)
    assert type(found["count"]) is int


def test_an_interrupt_is_heard_while_points_are_counted():
    # They take half a minute.
    x, y = np.random.default_rng(0).uniform(-1.2, 1.2, (2, 4000))
    unstable_roots(CommonArm(3e3), 0.0, 0.0)
    assert ends_when_interrupted(lambda: unstable_roots(CommonArm(3e3), x, y)) < 1.0


@pytest.mark.parametrize(
    "system", [CommonArm(), DualArm(), equation(1 + CommonArm()), SingleArm(2.0)], ids=repr
)
def test_charts_place_crossings_at_zero_exactly(system, monkeypatch):
    # On this grid D(0) vanishes at some points of a diagonal, and nearly at others.
    x, counted = np.linspace(-0.6, 2.6, 41), []

    def noted(affine, points):
        counted.append(len(points))
        return count_points(affine, points)

    monkeypatch.setattr("armlock.stability.charts.count_points", noted)
    found = stability_chart(system, x, x).counts
    assert sum(counted) < x.size
    assert (found == unstable_roots(system, *np.meshgrid(x, x))).all()


def test_a_chart_counts_its_doubtful_points_again():
    """On whole numbers D(0) vanishes exactly, on tenths often nearly: each point by itself."""
    whole = np.arange(-20.0, 21.0)
    for x in (whole, whole / 10.0):
        found = stability_chart(HayesEquation(), x, x).counts
        assert (found == unstable_roots(HayesEquation(), *np.meshgrid(x, x))).all()
