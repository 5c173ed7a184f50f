"""Pulling by an inverse Laplace transform, held against closed forms and against residues."""

import numpy as np
import pytest

from armlock import Controller, Loop, SingleArm, paper_loop, pulling
from armlock.performance.pulling import largest_pulling, pulled_series
from armlock.sensors import dual


def test_before_the_light_comes_back_the_loop_has_no_delay():
    """Then Y of a single arm is -g / (s + g), and half of that for the sum."""
    time, frequency = pulled_series(SingleArm(0.5, 20.0), "common", 40.0)
    early = (time > 0.1) & (time < 19.0)
    expected = -0.5 * (1.0 - np.exp(-0.5 * time[early]))
    assert np.abs(frequency[early] - expected).max() < 1e-4


def test_the_largest_pulling_is_certified_where_the_sum_over_roots_is():
    simple = Loop(Controller([-0.1], [0, 0], 3.0), dual(2.5, 0.065), 16.68, 16.615)
    peaks = {}
    for loop, source in ((simple, "common"), (paper_loop(), "differential")):
        peak = peaks[source] = largest_pulling(loop, source)
        # It is not lower than what another span has at other times.
        time, frequency = pulled_series(loop, source, 3.0 * peak.time)
        assert np.abs(frequency[time > 1.0]).max() < peak.size * (1 + 1e-4)
        at_peak = np.interp(peak.time, time, frequency)
        assert abs(at_peak) == pytest.approx(peak.size, rel=1e-4)
    assert peaks["common"].certified
    assert abs(float(pulling(simple, peaks["common"].time))) == peaks["common"].size
    assert not peaks["differential"].certified


def test_a_peak_next_to_an_echo_is_not_rounded_off():
    """Undelayed, the paper's loop answers at once and jumps with each echo."""
    loop = paper_loop(tau1=16.68, tau2=16.62)
    peak = largest_pulling(loop, "common")
    time, frequency = pulled_series(loop, "common", 70.0)
    assert abs(np.abs(frequency[time > 1.0]).max() / peak.size - 1) < 5e-3
