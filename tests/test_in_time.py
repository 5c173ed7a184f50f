"""Each question about a loop is answered, or refused, before somebody gives up waiting."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from functools import partial

import numpy as np
import pytest

from armlock import (
    CommonArm,
    CountError,
    RootError,
    axis_crossings,
    box_count,
    critical_perturbation,
    d_curve,
    first_crossing,
    margins,
    modulus_margin,
    nyquist,
    paper_loop,
    peak_gain,
    rightmost_root,
    spectral_radius,
    stability_chart,
    unstable_roots,
    varying_radius,
)
from armlock.performance.pulling import pulling
from tests import attack, draws
from tests.attack_judge import Sketch, UndecidedError, View

# Nobody waits longer. The slowest call, of the first case near zero, finds 30 000 crossings in
# 10 s: what is meant is a call that does not end, not how fast a machine is.
LATEST = 60.0


def draw_wild(rng):
    """A loop of up to 30 poles over many decades, of any gain; nobody asks what is right."""
    tau1, tau2 = attack.draw_delays(rng)
    count = int(rng.integers(1, 31))
    highest = attack.between(rng, 1e-1, 1e6) / tau1
    lowest = highest / attack.between(rng, 3.0, 1e8)
    unstable = 0.1 if rng.random() < 0.2 else 0.0
    poles = attack.roots(rng, count, lowest, highest, unstable)
    if poles[0].imag == 0.0 and rng.random() < 0.4:
        poles[0] = 0j
    neutral = rng.random() < 0.3
    zeros = attack.roots(
        rng, count if neutral else int(rng.integers(0, count)), lowest, highest, 0.1
    )
    sensor = str(rng.choice(["single", "common", "difference", "dual"]))
    delay = attack.between(rng, 1e-6, 1.0) if rng.random() < 0.3 else 0.0
    corner = attack.between(rng, 0.05, 20.0)
    difference = tau1 - tau2 or tau1
    sketch = Sketch(
        tuple(zeros), tuple(poles), 1.0, sensor, tau1, tau2, delay, corner, difference
    )
    at = attack.between(rng, lowest, highest)
    size = abs(View(sketch, 0.3, -0.2).at(np.array([at]))[0])
    if not 1e-250 < size < 1e250:
        raise UndecidedError("no float")
    gain = attack.between(rng, 0.03, 1.0) if neutral else attack.between(rng, 1e-2, 1e4)
    return sketch.scaled(gain / size), attack.draw_point(rng)


KINDS = {
    "wild": draw_wild,
    "mixed": attack.draw,
    "clusters": attack.draw_cluster,
    "zero": attack.draw_near_zero,
}


def asked(rng, loop, point):
    """Every public question about a loop at a point, as calls without arguments."""
    above = attack.between(rng, 1e-2, 1e3) / loop.tau1
    way = rng.normal(size=2)
    omega = np.geomspace(1e-3, 1e3, 50) / loop.tau1
    step = loop.tau1 / int(rng.integers(2, 20))
    return {
        "unstable_roots": partial(unstable_roots, loop, *point),
        "margins": partial(margins, loop, *point),
        "margins, free": lambda: margins(loop, *point, free_above=above),
        "modulus_margin": partial(modulus_margin, loop, *point),
        "varying_radius": partial(varying_radius, loop, *point),
        "peak_gain": lambda: peak_gain(loop.at(c1=point[0], c2=point[1]).feedback()),
        "critical_perturbation": partial(critical_perturbation, loop, way),
        "first_crossing": partial(first_crossing, loop, point, way),
        "rightmost_root": partial(rightmost_root, loop, *point),
        "nyquist": partial(nyquist, loop, *point),
        "axis_crossings": partial(axis_crossings, loop, *point),
        "axis_crossings, up to": partial(axis_crossings, loop, *point, omega_max=100 * above),
        "box_count": partial(box_count, loop, attack.between(rng, 1e-9, 1e-2)),
        "pulling": partial(pulling, loop, [0.1, 10.0, 1e3, 1e5][:: draws(3, 1)]),
        "spectral_radius": lambda: spectral_radius(loop, point[0], point[1], step=step),
        "d_curve": partial(d_curve, loop, omega),
    }


REFUSED = CountError, RootError, ValueError, ArithmeticError


def late(kind, numbers, latest=LATEST):
    """Calls that take longer than this, with how long in s; a loop's number makes it again."""
    found = []

    def give_up(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, give_up)
    try:
        for number in numbers:
            rng = np.random.default_rng([27, number])
            try:
                sketch, point = KINDS[kind](rng)
                loop = attack.to_loop(sketch)
            except (UndecidedError, ValueError):
                continue
            for name, ask in asked(rng, loop, point).items():
                signal.setitimer(signal.ITIMER_PROF, latest)
                try:
                    ask()
                except REFUSED:
                    pass
                except TimeoutError:
                    found.append((kind, number, name))
                finally:
                    signal.setitimer(signal.ITIMER_PROF, 0.0)
    finally:
        signal.signal(signal.SIGPROF, before)
    return found


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Compile first: that takes longer, once."""
    for ask in asked(np.random.default_rng(0), paper_loop(), (1.0, 1.0)).values():
        with contextlib.suppress(*REFUSED):
            ask()


@pytest.mark.parametrize("kind", list(KINDS))
def test_every_question_is_answered_or_refused_in_time(kind):
    assert late(kind, range(draws(1, 0), draws(3, 60))) == []


# Each takes some seconds: the delayed terms exceed the others up to 1e6 rad/s.
FAST = CommonArm(3e5)
LONG = {
    "count": lambda: unstable_roots(FAST, 1.7, 0.9),
    "chart": lambda: stability_chart(FAST, np.linspace(1.7, 1.8, 9), [0.9, 1.0]),
    "modulus": lambda: modulus_margin(FAST, 1.7, 0.9),
    "crossings": lambda: axis_crossings(FAST, 1.7, 0.9, omega_max=2e4),
}


def ends_when_interrupted(call):
    """Call it, interrupt it, and return how long it takes to hear that, in s."""
    sent = []

    def interrupt():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.3, interrupt)
    # A shell has its background jobs ignore interrupts.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call()
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)
    return time.monotonic() - sent[0]


@pytest.mark.parametrize("name", LONG)
def test_an_interrupt_ends_a_call_within_a_second(name):
    assert ends_when_interrupted(LONG[name]) < 1.0
