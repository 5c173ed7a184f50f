"""Windows of one delay, against counts at many lengths and against published numbers."""

from itertools import pairwise

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from armlock import (
    BOUNDARY,
    UNCONFINED,
    delay,
    determinant,
    equation,
    parameter,
    s,
    semi_discretization,
    stable_delays,
    state_space,
    unstable_roots,
)
from tests import draws

HAAG = (
    [[-1, 13.5, -1], [-3, -1, -2], [-2, -1, -4]],
    [[-5.9, 7.1, -70.3], [2, -1, 5], [2, 0, 6]],
)
RING = 2 * np.eye(4) - np.roll(np.eye(4), 1, 0) - np.roll(np.eye(4), -1, 0)


def edges(windows):
    """The lengths at which the windows meet."""
    assert [w.high for w in windows[:-1]] == [w.low for w in windows[1:]]
    return [w.low for w in windows[1:]]


def test_windows_that_others_have_printed():
    z = delay(1.0)
    gu = stable_delays(state_space({0: [[0, 1], [-2, 0.1]], z: [[0, 0], [1, 0]]}), z, longest=4)
    assert edges(gu) == pytest.approx([0.1001683, 1.7178582], abs=5e-8)
    assert [w.unstable for w in gu] == [2, 0, 2]
    haag = stable_delays(state_space({0: HAAG[0], z: HAAG[1]}), z, longest=0.5)
    assert edges(haag) == pytest.approx([0.1623456, 0.1859057, 0.2219847], abs=5e-8)
    assert [w.unstable for w in haag] == [0, 2, 0, 2]
    (stable, *_) = stable_delays(equation(s + z), z, longest=10)
    assert (stable.low, stable.unstable) == (0.0, 0)
    assert stable.high == pytest.approx(np.pi / 2, rel=1e-15)
    # The steady state of y' = -y + 20 / (1 + y(t - tau)^2).
    y = brentq(lambda y: y**3 + y - 20.0, 2.0, 3.0)
    (stable, *_) = stable_delays(equation(s + 1 + 40 * y / (1 + y**2) ** 2 * z), z, longest=3)
    assert stable.high == pytest.approx(1.5317814, abs=5e-8)


def test_the_agreement_of_a_ring_is_left_out():
    z = delay(1.0)
    rows = [[s * float(i == k) + float(RING[i, k]) * z for k in range(4)] for i in range(4)]
    windows = stable_delays(determinant(rows, at_zero=1), z, longest=2.0)
    # Eigenvalues 2, 2 and 4: each crosses at pi / (2 eigenvalue), twice where it is double.
    assert edges(windows) == pytest.approx(np.array([1, 2, 5]) * np.pi / 8, rel=1e-14)
    assert [w.unstable for w in windows] == [0, 2, 6, 8]


def drawn(rng):
    """A system with one delay object, and the object."""
    z, degree = delay(1.0), int(rng.integers(1, 4))
    p = sum(float(c) * s**k for k, c in enumerate(rng.normal(size=degree))) + s**degree
    late = sum(
        float(c) * s**k * z ** int(rng.integers(1, 4))
        for k, c in enumerate(rng.normal(size=degree) * 1.5)
    )
    kind = rng.integers(3)
    if kind == 0:
        return equation(p + late), z
    if kind == 1:
        return equation(p + late + float(rng.uniform(-0.8, 0.8)) * s**degree * z), z
    return late * float(rng.uniform(0.2, 2.0)) / p, z


@pytest.mark.parametrize("seed", range(draws(8, 60)))
def test_counts_between_the_edges_are_those_at_any_length(seed):
    rng = np.random.default_rng([69, seed])
    system, z = drawn(rng)
    windows = stable_delays(system, z, longest=12.0)
    assert windows[0].low == 0.0
    assert windows[-1].high == 12.0
    changes = [a.unstable != b.unstable for a, b in pairwise(windows)]
    # Of the edges of such draws none is a mere touch.
    assert all(changes)
    for theta in rng.uniform(0.0, 12.0, 12):
        (here,) = [w for w in windows if w.low <= theta < w.high]
        if min(theta - here.low, here.high - theta) > 1e-6:
            assert unstable_roots(at_length(system, z, theta)) == here.unstable


def at_length(system, z, theta):
    """The system with another length of z, by python-control's rule: from its terms."""
    ((lag, _),) = z.numerator.terms
    ((own, _),) = lag
    one, parts = delay(float(theta)), []
    for part in (system.numerator, system.denominator):
        total = 0
        for (product, _), p in part.terms.items():
            late = one ** dict(product).get(own, 0)
            total = total + sum(float(c) * s**k for k, c in enumerate(p.coeffs())) * late
        parts.append(total)
    n, m = parts
    return equation(n) if system.is_equation else n / m


def test_what_has_no_windows_is_refused_or_has_one():
    z, other = delay(1.0), delay(2.0)
    assert stable_delays(equation(s + 1 + 0.5 * z), z, longest=9.0) == ((0.0, 9.0, 0),)
    # Of the second one, a root is on the axis at each frequency for some length.
    for neutral in (s * (1 + 1.5 * z) + 1, s + 1 + (s - 1) * z):
        (lost,) = stable_delays(equation(neutral), z, longest=9.0)
        assert lost.unstable == UNCONFINED
    # And of this one for every length.
    (marginal,) = stable_delays(equation((s**2 + 1) * (s + 1 + 0.5 * z)), z, longest=9.0)
    assert marginal.unstable == BOUNDARY
    # An integrator that cancels, and a root that passes s = 0 at 0.5 s.
    loop = 2 * (1 - z) / s * (s - 1) / (s + 1)
    assert stable_delays(loop, z, longest=3.0) == ((0.0, 0.5, 0), (0.5, 3.0, 1))
    refused = {
        "another delay object": equation(s + z + other),
        "must be in continuous time": semi_discretization(control.tf([1], [1, 1]) * z, 0.5),
    }
    for message, system in refused.items():
        with pytest.raises(ValueError, match=message):
            stable_delays(system, z, longest=3.0)
    with pytest.raises(TypeError, match="z must be what delay"):
        stable_delays(equation(s + z), equation(s), longest=3.0)
    with pytest.raises(ValueError, match="at most 10000 windows"):
        stable_delays(equation(s + z), z, longest=1e6)
    gain = parameter("gain", 2.0)
    first, second = (stable_delays(gain * z / (s + 1), z, longest=3.0, gain=g) for g in (2, 3))
    assert first[0].high > second[0].high
