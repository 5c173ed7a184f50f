"""Step and impulse responses against their exact expansion in delays.

    N / M = N / m_0 sum_k (-(M - m_0) / m_0)^k ,   M = m_0(s) + what is delayed

Each term is a rational function after a delay, whose inverse transform is a sum of residues.
They are computed with 2000 bits here, from fractions, without the package.
"""

from __future__ import annotations

import time
import warnings
from collections import defaultdict
from fractions import Fraction

import flint
import numpy as np
import pytest
from flint import acb, acb_poly, acb_series, arb, fmpq, fmpq_poly

from armlock import delay, impulse_response, s, step_response
from tests import draws

_S = fmpq_poly([0, 1])
_BITS = 2000


class Expansion:
    """A quotient of sums of polynomials after delays, {delay: polynomial} twice."""

    def __init__(self, n, m):
        self.n, self.m = n, m

    @classmethod
    def of(cls, given):
        return (
            given if isinstance(given, Expansion) else cls({0: _exact(given)}, {0: _exact(1)})
        )

    def __add__(self, other):
        other = Expansion.of(other)
        return Expansion(
            _sum(_product(self.n, other.m), _product(other.n, self.m)),
            _product(self.m, other.m),
        )

    def __mul__(self, other):
        other = Expansion.of(other)
        return Expansion(_product(self.n, other.n), _product(self.m, other.m))

    def __truediv__(self, other):
        other = Expansion.of(other)
        return Expansion(_product(self.n, other.m), _product(self.m, other.n))

    def __rtruediv__(self, other):
        return Expansion.of(other) / self

    def __sub__(self, other):
        return self + Expansion.of(other) * -1

    def __rsub__(self, other):
        return Expansion.of(other) - self

    __radd__, __rmul__ = __add__, __mul__

    def __pow__(self, power):
        found = self
        for _ in range(power - 1):
            found = found * self
        return found

    def feedback(self):
        return self / (1 + self)

    def responses(self, times, step):
        """Return the response at some times after zero, without its impulses."""
        last, undelayed = times[-1], self.m[0]
        late = {theta: -p for theta, p in self.m.items() if theta}
        # What stands over powers of the undelayed polynomial.
        power, terms = dict(self.n), []
        while power:
            terms.append(power)
            power = {t: p for t, p in _product(power, late).items() if t <= last}
        found = [acb(0)] * len(times)
        with flint.ctx.workprec(_BITS):
            for k, some in enumerate(terms, 1):
                below = undelayed**k * (_S if step else 1)
                for theta, p in some.items():
                    common = p.gcd(below)
                    above, under = p / common, below / common
                    after = [i for i, t in enumerate(times) if t >= theta]
                    values = _inverted(above % under, under, [times[i] - theta for i in after])
                    for i, value in zip(after, values, strict=True):
                        found[i] += value
            return np.array([float(value.real) for value in found])


def _exact(number):
    return fmpq_poly([fmpq(*Fraction(number).as_integer_ratio())])


def _sum(first, second):
    found = defaultdict(fmpq_poly, first)
    for theta, p in second.items():
        found[theta] += p
    return {theta: p for theta, p in found.items() if p}


def _product(first, second):
    found: dict[Fraction, fmpq_poly] = defaultdict(fmpq_poly)
    for theta, p in first.items():
        for other, q in second.items():
            found[theta + other] += p * q
    return {theta: p for theta, p in found.items() if p}


def _inverted(above, below, times):
    """Sum the residues of above / below exp(s t) at the roots of `below`."""
    found = [acb(0)] * len(times)
    for root, number in below.complex_roots() if below.degree() > 0 else []:
        flint.ctx.cap = number
        moved = [acb_poly(p)(acb_poly([root, 1])).coeffs() for p in (above, below)]
        quotient = acb_series(moved[0] or [0]) / acb_series(moved[1][number:])
        for i, t in enumerate(times):
            turned = (acb_series([0, 1]) * acb(arb(fmpq(t.numerator, t.denominator)))).exp()
            at = acb(arb(fmpq(t.numerator, t.denominator)))
            found[i] += (quotient * turned)[number - 1] * (root * at).exp()
    return found


def both(theta):
    """Return a delay of the package, and of the expansion."""
    exact = Fraction(theta)
    return delay(exact), Expansion({exact: _exact(1)}, {0: _exact(1)})


LAPLACE = s, Expansion({0: _S}, {0: _exact(1)})


def drawn(rng):
    """Draw a function of s and two delays, which makes a system, the delays, the last time."""
    scale = 10.0 ** rng.uniform(-5, 5)
    a, b, c, d = (float(x) for x in 10.0 ** rng.uniform(-2, 2, 4) / scale)
    g, power = float(rng.uniform(0.1, 3.0)), int(rng.integers(1, 4))
    damping = float(10.0 ** rng.uniform(-8, -1))

    def loop(s, y, z):
        return (g * (s + a) * y / (s * (s / b + 1))).feedback() + z / (s / c + 1)

    def hidden(s, y, z):
        shared = (g * b * y / (s + c)).feedback() + z
        return (s - a) / (s - a) * shared + b / (s - d) - b / (s - d)

    def cancelled(s, y, z):
        angle = s * thetas[0]
        return ((1 - (1 - y) / angle) / angle) ** power * c / (s + c)

    def averages(s, y, z):
        return (1 - y) * (1 - z) / (s**2 * thetas[0] * thetas[1]) * b / (s + b)

    def resonance(s, y, z):
        shape = b**2 / (s**2 + 2 * damping * b * s + b**2)
        return (g * y / (s / a + 1) + z / 2) * shape

    def predictor(s, y, z):
        # The plant is unstable, and its pole is hidden in the predictor.
        plant = a / (s - a)
        return g / (1 + g * (plant - plant * y)) * plant * y * z / (1 + s / c)

    kinds = loop, hidden, cancelled, averages, resonance, predictor
    make = kinds[rng.integers(len(kinds))]
    thetas = [Fraction(float(x)) for x in (scale, scale * 10.0 ** rng.uniform(-1.0, 0.3))]
    last = float(scale * 10.0 ** rng.uniform(-1.0, 0.7))
    return make, thetas, last


@pytest.mark.parametrize("seed", range(draws(15, 150)))
def test_responses_are_their_expansions_in_delays(seed):
    rng = np.random.default_rng([65, seed])
    make, thetas, last = drawn(rng)
    systems, expansions = zip(*map(both, thetas), strict=True)
    step = bool(rng.integers(2))
    respond = step_response if step else impulse_response
    times = np.linspace(0.0, last, 21)[1:]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "impulses at")
        found = respond(make(LAPLACE[0], *systems), times).outputs
    exact = make(LAPLACE[1], *expansions).responses([Fraction(float(t)) for t in times], step)
    assert np.abs(found - exact).max() <= 1e-9 * np.abs(exact).max()


def test_hidden_modes_and_terms_that_cancel_are_no_part_of_a_response():
    assert step_response((s - 1) / (s - 1) / (s + 1), [40.0]).outputs == pytest.approx([1.0])
    plant = delay(1.0) / (s - 0.5 + delay(2.0))
    assert step_response(plant - plant + 1 / (s + 1), [400.0]).outputs == pytest.approx([1.0])
    average = (1 - delay(1.0)) / s
    for system, limit in (((1 - average) / s, 0.5), (((1 - average) / s) ** 2, 0.25)):
        late = step_response(system, [1e3, 1e4, 1e5, 1e6]).outputs
        assert late == pytest.approx(np.full(4, limit), rel=1e-9)
    assert step_response(average**8, [4.0, 100.0]).outputs == pytest.approx([0.5, 1.0])
    # What rounding leaves of a system is no reason to refuse it.
    biproper = delay(6.88) - (2 * s + 1) / (s + 3)
    expected = [5.0 / 3.0 * (1.0 - np.exp(-24.9)) - 1.0]
    assert step_response(biproper, [8.3]).outputs == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("size", [1e-40, 1e-14, 1e14, 1e40])
def test_a_response_does_not_depend_on_the_size_of_the_denominator(size):
    system = delay(1.0) / (size * (s + 1))
    found = impulse_response(system, [1.0, 1.5, 3.0]).outputs
    assert found == pytest.approx(np.exp([-0.0, -0.5, -2.0]) / size, rel=1e-9)


@pytest.mark.parametrize(
    ("system", "last", "why"),
    [
        # A mode that is nearly hidden grows from 5e-13 on, and rounding errors with it.
        ((s - 1 - 1e-12) / (s - 1) / (s + 1), 20.0, "rounding errors"),
        ((1 - 2.718281828459045 * delay(1.0)) / (s - 1), 25.0, "rounding errors"),
        ((1e5 / s * delay(1e-6) * (1 - 0.9 * delay(1.0))).feedback(), 1e3, "panels"),
        (1 / (s - 3), 1e4, "1e308"),
    ],
)
def test_a_refused_response_says_at_once_up_to_when_it_can_be_computed(system, last, why):
    begin = time.process_time()
    with pytest.raises(ValueError, match=f"timepts must end by .* s, .*{why}") as error:
        step_response(system, [last])
    assert time.process_time() - begin < 2.0
    until = float(str(error.value).split()[4])
    assert 1e-4 * last < until < last
    assert np.isfinite(step_response(system, until).outputs).all()
