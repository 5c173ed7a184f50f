import numpy as np
import pytest

from armlock import (
    BOUNDARY,
    CommonArm,
    DualArm,
    HayesEquation,
    delay,
    equation,
    first_crossing,
    paper_loop,
    parameter,
    rightmost_root,
    s,
    semi_discretization,
    spectral_radius,
    transition_matrix,
    unstable_roots,
)
from tests.systems import RETARDED

NAMES = "oscillator", "third order, unstable A", "zero of B1 on the axis"
SYSTEMS = [RETARDED[name] for name in NAMES]


def test_published_spectral_radius_of_the_hayes_equation(table):
    (row,) = [r for r in table("semidiscretization.csv") if r["system"].startswith("hayes")]
    radius = spectral_radius(
        HayesEquation(), -1.0, -1.0, step=float(row["h"]), order=int(row["order"])
    )
    # In 40 digits it is 0.94118937416656415; the published digits are that to 1.2e-15.
    assert float(radius) == pytest.approx(0.94118937416656415, abs=2e-15)
    assert float(radius) == pytest.approx(float(row["value"]), abs=3e-15)


@pytest.mark.parametrize("a", [-1.0, -30.0, -50.0])
def test_a_small_spectral_radius_keeps_its_digits(a):
    assert spectral_radius(HayesEquation(1.0), a, 0.0, step=1.0) == pytest.approx(np.exp(a))


def test_spectral_radii_of_the_common_arm(table):
    rows = [r for r in table("semidiscretization.csv") if r["system"].startswith("common")]
    assert len(rows) == 2
    for row in rows:
        radius = spectral_radius(
            CommonArm(),
            float(row["c1"]),
            float(row["c2"]),
            step=float(row["h"]),
            order=int(row["order"]),
        )
        given_digits = len(row["value"].split("e")[0].strip("-").replace(".", ""))
        excess = f"{float(radius) - 1.0:.{given_digits - 1}e}"
        assert float(excess) == float(row["value"])


@pytest.mark.parametrize("system", [*SYSTEMS, CommonArm(tau1=2.5, tau2=1.0)])
@pytest.mark.parametrize(("order", "observed"), [(0, 1.0), (1, 2.0)])
def test_convergence_of_the_dominant_eigenvalue(system, order, observed):
    exact = np.exp(rightmost_root(system, -0.4, 0.3).real)
    steps = np.array([0.1, 0.05, 0.025])
    errors = [
        abs(float(spectral_radius(system, -0.4, 0.3, step=h, order=order)) ** (1.0 / h) - exact)
        for h in steps
    ]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(observed, abs=0.2)


def test_delays_off_the_grid_by_rounding_alone_are_accepted():
    # The quotient 19.9 / 0.05 lies below 398 in floating point.
    assert transition_matrix(CommonArm(), 1.0, 1.0, step=0.05).shape == (403, 403)
    row = transition_matrix(CommonArm(), 1.0, 2.0, step=0.05)[0]
    assert np.flatnonzero(row).tolist() == [0, 398, 402]
    assert row[398] == pytest.approx(2.0 * row[402])


def test_a_step_too_fine_for_a_matrix_still_counts():
    sampled = semi_discretization(CommonArm(), 1e-3)
    assert unstable_roots(sampled, [0.9, 1.2], 1.05).tolist() == [0, 7]
    assert unstable_roots(CommonArm(), [0.9, 1.2], 1.05).tolist() == [0, 7]


@pytest.mark.parametrize("order", [0, 1])
def test_a_dead_time_is_a_further_delay_of_the_map(order):
    loop = DualArm(0.3, 3.0, 2.0).replace(delay=0.5)
    held = semi_discretization(loop, 0.25, order)
    for x, y in [(1.0, 0.0), (0.9, 1.05), (-1.2, 0.4)]:
        eigenvalues = np.linalg.eigvals(transition_matrix(loop, x, y, step=0.25, order=order))
        assert unstable_roots(held, x, y) == np.count_nonzero(np.abs(eigenvalues) > 1.0)
        largest = np.abs(eigenvalues).max()
        assert np.exp(0.25 * rightmost_root(held, x, y).real) == pytest.approx(largest)
    fine = float(spectral_radius(loop, 0.9, 1.05, step=0.025, order=order)) ** 40.0
    exact = np.exp(rightmost_root(loop, 0.9, 1.05).real)
    assert fine == pytest.approx(exact, rel=1e-2 if order == 0 else 1e-5)
    with pytest.raises(ValueError, match=r"^step must divide every delay, .* for delay=0.5"):
        semi_discretization(loop, 0.2)


def test_a_parameter_without_a_delay_makes_no_affine_map():
    with pytest.raises(ValueError, match=r"^the parameter x of .* undelayed signal"):
        semi_discretization(RETARDED["undelayed first parameter"], 0.25)


@pytest.mark.parametrize("order", [0, 1])
def test_a_frequency_at_which_the_direction_has_no_effect_is_no_crossing(order):
    """Along (1, -1) the delayed terms cancel at z = -1, where D is real."""
    system = semi_discretization(CommonArm(gain=1.0), 0.1, order)
    edge = first_crossing(system, (0.0, 0.0), (1.0, -1.0), stop=10.0).position
    around = edge * np.array([1.0 - 1e-9, 1.0 + 1e-9])
    assert unstable_roots(system, around, -around).tolist() == [0, 2]


@pytest.mark.parametrize("point", [(0.5, 0.5), (1.0, 1.0)])
def test_slow_poles_that_rounding_scatters_have_a_spectral_radius(point):
    # Dense eigenvalues give 1.00002.
    loop = paper_loop(actuator=True)
    eigenvalues = np.linalg.eigvals(transition_matrix(loop, point[0], point[1], step=0.1))
    assert np.abs(eigenvalues).max() > 1.0 + 1e-5
    radius = float(spectral_radius(loop, point[0], point[1], step=0.1))
    rate = rightmost_root(loop, *point).real
    assert radius - 1.0 == pytest.approx(0.1 * rate, rel=1e-4)


def test_five_slow_poles_are_not_scattered_by_the_coefficients_of_the_map():
    """Each is at z = 0.999; rounding to floats would move them by 6e-4."""
    z = delay(1.0)
    loop = equation((s + 0.01) ** 5 - 5e-11 * z)
    assert unstable_roots(loop) == 0
    assert unstable_roots(semi_discretization(loop, 0.1)) in (0, BOUNDARY)
    # The map holds z over a step, which moves its roots by far less than this.
    expected = np.exp(0.1 * rightmost_root(loop).real)
    assert spectral_radius(loop, step=0.1) - 1.0 == pytest.approx(expected - 1.0, rel=1e-2)


def test_radii_without_delays_and_of_one():
    k = parameter("k")
    plain = equation((s + 0.3) * (s + k) + 0 * delay(1.0))
    radii = spectral_radius(plain, [0.1, 0.0, 0.5], step=0.1)
    assert radii == pytest.approx(np.exp([-0.01, 0.0, -0.03]), rel=1e-15)
    assert spectral_radius(CommonArm(), 1.0, 1.0, step=0.1) == 1.0
