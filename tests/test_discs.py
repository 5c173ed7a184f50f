"""A step of a walk is not called clear if what it looks for is met on it."""

from __future__ import annotations

from collections import Counter

import numpy as np

from armlock import Loop
from armlock.loops import LoopAt
from armlock.robustness import discs, distances
from armlock.robustness.free_phases import arms_of
from armlock.sensors import COMMON, DIFFERENCE, dual
from tests.attack import between, roots


def discs_ahead(number):
    """A random disc, a step from there, and centre and radius on the way or at the end."""
    rng = np.random.default_rng(4)
    for _ in range(number):
        few, many = sorted(rng.integers(0, 4, 2))
        zeros, poles = roots(rng, few, 0.1, 10.0, 0.3), roots(rng, many, 0.1, 10.0, 0.3)
        mapping = (COMMON, DIFFERENCE, dual(3.0, 0.5))[rng.integers(3)]
        delay = between(rng, 1e-3, 1.0) * rng.integers(2)
        gain = rng.choice([1.0, between(rng, 0.1, 10.0)])
        loop = Loop((zeros, poles, gain), mapping, 2.0, 1.5, delay)
        c1, c2 = rng.uniform(-2.0, 2.0, 2)
        arms = arms_of(LoopAt(loop, c1, c2))
        for omega in 10.0 ** rng.uniform(-1.5, 1.5, 10):
            disc = discs._disc(arms, omega)
            step = min(0.5 * disc.nearest, between(rng, 1e-3, 10.0) * omega)
            at = omega + step * rng.choice([1.0, rng.random()])
            first, second = (complex(arm[0]) for arm in loop.arm_responses(np.array([1j * at])))
            # Next to zero the phase between the two arms is known.
            apart = np.exp(0.5j * at) if 0.5 * omega < 1.0 else None
            held, swung = c1 * first, c2 * second
            spread = abs(held) + abs(swung) if apart is None else abs(held + swung * apart)
            yield rng, disc, omega, step, at, first + second, spread


def test_what_a_step_meets_is_not_called_clear():
    # What is met by a hair, and what lies ten times as far.
    met: Counter[str] = Counter()
    far: Counter[str] = Counter()
    for rng, disc, omega, step, at, centre, spread in discs_ahead(500):
        ahead = discs._ahead(disc, step)
        radius, way = between(rng, 1e-3, 10.0), np.exp(2j * np.pi * rng.random())
        for tally, share in ((met, 1.0 - 1e-9), (far, 10.0)):
            point = centre + share * (spread + radius) * way
            tally["disc"] += discs._clear(disc, ahead, step, point, radius)
        own_centre = discs._centre_and_radius(disc)[0]
        met["disc"] += discs._clear(disc, ahead, step, own_centre, radius)
        tally = met if abs(centre.imag) <= spread else far
        tally["axis"] += discs._on_one_side(disc, ahead, step)
        half = np.sqrt(max(spread**2 - centre.imag**2, 0.0))
        right, left = centre.real + half, centre.real - half
        for tally, one, other in (
            (met, right * (1.0 + 1e-9), 0.5 * right),
            (met, left * (1.0 - 1e-9), 2.0 * left),
            (far, 10.0 * left, 20.0 * left),
        ):
            if half > 0.0 and other < 0.0:
                near, end = max(one, other), min(one, other)
                tally["segment"] += discs._misses_segment(disc, step, near, end)
        margins = discs.free_margins_at(centre, spread, at)
        for m in np.flatnonzero((margins > 0.0) & (margins < (np.inf, 1.0, np.inf, np.inf))):
            for tally, share in ((met, 1.0 + 1e-9), (far, 0.1)):
                levels = share * np.where(np.arange(4) == m, margins, 0.0)
                tally[f"margin {m}"] += discs._nothing_smaller(disc, omega, step, levels)
    assert +met == {}
    assert len(far) == 7
    assert min(far.values()) > 50


def test_a_bound_along_tangents_is_one():
    rng = np.random.default_rng(5)
    share = np.linspace(0.0, 1.0, 30)
    for _ in range(500):
        over, over_slope, under, under_slope = (
            between(rng, 1e-2, 1e2) * np.exp(2j * np.pi * rng.random()) for _ in range(4)
        )
        level, step = between(rng, 1e-2, 1.0), between(rng, 1e-3, 1.0)
        along = over + share * step * over_slope, under + share * step * under_slope
        least = (abs(along[0]) - level * abs(along[1])).min()
        found = distances._stays_above(over, over_slope, under, under_slope, level, step)
        assert found <= least + 1e-12 * (abs(over) + abs(under))
