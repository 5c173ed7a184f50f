import numpy as np
import pytest
from scipy.signal import lfilter

from armlock import CommonArm, DualArm, rightmost_root, spectral_radius, unstable_roots
from book.companion.schemes import map_eigenvalues, pade_poles, sampled_loop, standard_schemes

LOOP = CommonArm(1.0, 2.2, 1.8)
STEP = 0.1
POINTS = [(0.9, 1.05), (1.2, 0.9), (-0.5, -0.8), (2.0, 1.5)]
NAMES = list(standard_schemes(LOOP, STEP))


def recurrence(name, point, samples):
    """Step one scheme by hand, from its textbook form, after a unit impulse."""
    (c1, c2), (r1, r2) = point, (22, 18)
    g, h = LOOP.gain, STEP
    phi = np.zeros(samples + 30)
    phi[29] = 1.0

    def late(i):
        return g * (c1 * phi[i - r1] + c2 * phi[i - r2])

    for i in range(29, phi.size - 1):
        now = phi[i]
        if name == "explicit Euler":
            phi[i + 1] = now + h * (late(i) - 2 * g * now)
        elif name == "implicit Euler":
            phi[i + 1] = (now + h * late(i + 1)) / (1 + 2 * g * h)
        elif name == "trapezoidal rule":
            known = now + h / 2 * (late(i) - 2 * g * now + late(i + 1))
            phi[i + 1] = known / (1 + g * h)
        elif name == "Runge-Kutta 4, delays held":
            k1 = late(i) - 2 * g * now
            k2 = late(i) - 2 * g * (now + h / 2 * k1)
            k3 = late(i) - 2 * g * (now + h / 2 * k2)
            k4 = late(i) - 2 * g * (now + h * k3)
            phi[i + 1] = now + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        else:
            # Exact over the step for a delayed signal that is a polynomial of degree order.
            decay = np.exp(-2 * g * h)
            flat = (1 - decay) / (2 * g)
            ramp = (h - flat) / (2 * g * h) if name.endswith("1") else 0.0
            phi[i + 1] = decay * now + (flat - ramp) * late(i) + ramp * late(i + 1)
    return phi[29:]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("point", POINTS)
def test_the_map_is_the_textbook_scheme(name, point):
    system = standard_schemes(LOOP, STEP)[name]
    steps = 60
    # The impulse response of 1 / D(z), in powers of 1/z.
    longest = 22
    powers = np.zeros(longest + system.a.size)
    powers[: system.a.size] = system.a[::-1]
    for value, b, back in zip(point, (system.b1, system.b2), (22, 18), strict=True):
        first = system.a.size - b.size + back
        powers[first : first + b.size] -= value * b[::-1]
    impulse = np.zeros(steps)
    impulse[0] = powers[0]
    expected = recurrence(name, point, steps)[:steps]
    response = lfilter([1.0], powers, impulse)
    np.testing.assert_allclose(response, expected, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("point", POINTS)
def test_count_and_eigenvalues_of_a_map_agree(name, point):
    system = standard_schemes(LOOP, STEP)[name]
    outside = int((np.abs(map_eigenvalues(system, *point)) > 1.0).sum())
    assert unstable_roots(system, *point) == outside


def test_eigenvalues_of_the_map_are_those_of_the_transition_matrix():
    for order in (0, 1):
        system = standard_schemes(LOOP, STEP)[f"semi-discretization, order {order}"]
        for point in POINTS:
            radius = np.abs(map_eigenvalues(system, *point)).max()
            assert radius == pytest.approx(
                float(spectral_radius(LOOP, *point, STEP, order)), rel=1e-12
            )


def test_pade_poles_approach_the_slow_roots_and_miss_the_fast_ones():
    near = [
        np.abs(pade_poles(LOOP, 0.9, 1.05, n) - rightmost_root(LOOP, 0.9, 1.05)).min()
        for n in (2, 6)
    ]
    assert near[1] < near[0] / 100
    unstable = int((pade_poles(CommonArm(), 3.0, 3.0, 10).real > 1e-9).sum())
    assert unstable < unstable_roots(CommonArm(), 3.0, 3.0)


def test_the_step_of_a_scheme_divides_both_delays():
    for build in (standard_schemes, lambda loop, step: sampled_loop(loop, step, 0.5, (0, 0))):
        with pytest.raises(ValueError, match=r"^step must divide every delay, got step=0\.15"):
            build(LOOP, 0.15)
        for step in (0.0, -0.1):
            with pytest.raises(ValueError, match=rf"^step must be positive, got {step}$"):
                build(LOOP, step)
        with pytest.raises(TypeError, match=r"^loop must be a CommonArm, got DualArm\("):
            build(DualArm(), 0.1)  # type: ignore[arg-type]


def test_weights_of_a_scheme_are_named():
    with pytest.raises(ValueError, match=r"^held\[1\] must be finite, got nan$"):
        sampled_loop(LOOP, STEP, 1.0, (0.0, np.nan))
    with pytest.raises(TypeError, match=r"^present must be a real number, got 'a'$"):
        sampled_loop(LOOP, STEP, "a", (0.0, 0.0))  # type: ignore[arg-type]


def test_eigenvalues_are_those_of_a_map():
    with pytest.raises(ValueError, match=r"^system must be a map, got CommonArm\(.*continuous"):
        map_eigenvalues(LOOP, 1.0, 1.0)
    with pytest.raises(TypeError, match=r"^system must be a CharacteristicFunction"):
        map_eigenvalues(3, 1.0, 1.0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^c2 must be finite, got nan$"):
        map_eigenvalues(standard_schemes(LOOP, STEP)[NAMES[0]], 1.0, np.nan)


@pytest.mark.parametrize("order", [0, 61, 2.0, True, "4"])
def test_orders_of_pade_approximants_are_bounded(order):
    with pytest.raises(ValueError, match=r"^order must be an integer from 1 to 60, got "):
        pade_poles(LOOP, 1.0, 1.0, order)


def test_pade_poles_of_the_highest_order_are_still_right():
    found = pade_poles(LOOP, 0.9, 1.05, np.int64(60))  # type: ignore[arg-type]
    assert found.size == 121
    assert np.abs(found - rightmost_root(LOOP, 0.9, 1.05)).min() < 1e-10
    assert found.real.max() < 0.0
