import numpy as np
import pytest
from scipy.signal import lfilter

from armlock import CommonArm
from book.companion.schemes import standard_schemes
from tests import independent

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
    powers = independent.map_polynomial(system, *point)[::-1]
    impulse = np.zeros(steps)
    impulse[0] = powers[0]
    expected = recurrence(name, point, steps)[:steps]
    response = lfilter([1.0], powers, impulse)
    np.testing.assert_allclose(response, expected, rtol=1e-11, atol=1e-13)
