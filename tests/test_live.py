"""The book's live pages count as the package does: loop.js in Chromium against armlock."""

from __future__ import annotations

import itertools
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from armlock import (
    CommonArm,
    CountError,
    DualArm,
    critical_perturbation,
    margins,
    paper_loop,
    rightmost_root,
    stability_chart,
    unstable_roots,
)
from tests.attack import between, draw_arm, draw_delays, draw_paper, draw_point, roots, to_loop
from tests.attack_judge import Sketch, View
from tests.systems import sketch_of
from tests.test_browser import needs_chromium
from tools import check_browser

LIVE = Path(__file__).parents[1] / "book" / "_static" / "live"
#: What a count in a browser is where it is no number of roots, as `loop.js` has it.
BOUNDARY, UNCONFINED, UNSURE = -1, -2, -3

pytestmark = needs_chromium


@pytest.fixture(scope="module")
def chromium():
    with check_browser.browser() as chromium:
        yield chromium


@pytest.fixture(scope="module")
def page(chromium):
    page = chromium.new_page()
    page.add_script_tag(path=LIVE / "loop.js")
    page.evaluate("() => { window.live = armlockLoop(); }")
    return page


def described(sketch):
    """The description of a loop that `loop.js` takes."""
    found = asdict(sketch)
    for name in ("zeros", "poles"):
        found[name] = [[complex(root).real, complex(root).imag] for root in found[name]]
    return found


PAPER, COMMON, DUAL = (
    described(sketch_of(loop)) for loop in (paper_loop(), CommonArm(), DualArm())
)


def draw_any(rng):
    """A loop of any sensor and up to eight poles, and a point."""
    tau1, tau2 = draw_delays(rng)
    longest = max(tau1, tau2)
    low, high = 1e-4 / longest, 30.0 / longest
    count, neutral = int(rng.integers(1, 9)), rng.random() < 0.4
    poles = roots(rng, count, low, high, 0.15 if rng.random() < 0.3 else 0.0)
    zeros = roots(rng, count if neutral else int(rng.integers(0, count)), low, high, 0.15)
    for found in (zeros, poles):
        if found and found[0].imag == 0.0 and rng.random() < 0.3:
            found[0] = 0j
    sketch = Sketch(
        tuple(zeros), tuple(poles), 1.0,
        str(rng.choice(["single", "common", "difference", "dual"])), tau1, tau2,
        between(rng, 1e-3, 1.0) if rng.random() < 0.3 else 0.0,
        between(rng, 0.05, 20.0), tau1 - tau2 or longest,
    )  # fmt: skip
    size = 1.0
    if not neutral:
        at = between(rng, 0.1, 30.0) / longest
        size = abs(View(sketch, 0.3, -0.2).at(np.array([at]))[0])
    sign = -1.0 if rng.random() < 0.15 else 1.0
    return sketch.scaled(sign * between(rng, 0.01, 3.0) / size), draw_point(rng)


#: Loops and points of each kind. A browser takes 70 ms for the paper's loop with its actuator.
PAIRS = {draw_any: 2000, draw_paper: 300, draw_arm: 2700}


def test_no_count_of_5000_differs_off_the_boundary(page):
    """The walks share no code: other polynomials, other bounds, another end of the axis."""
    rng = np.random.default_rng(20260)
    cases, counts = [], []
    for make, number in PAIRS.items():
        for _ in range(number):
            sketch, point = make(rng)
            if make is draw_paper and 0.0 in sketch.poles:
                # With a dead time these have tens of thousands of unstable roots.
                sketch = replace(sketch, delay=0.0)
            try:
                counts.append(int(unstable_roots(to_loop(sketch), *point)))
            except CountError:
                continue
            cases.append([described(sketch), *map(float, point)])
    found = []
    for first in range(0, len(cases), 500):
        found += page.evaluate(
            "cases => cases.map(([spec, c1, c2]) => live.count(live.make(spec), c1, c2))",
            cases[first : first + 500],
        )
    hers, ours = np.array(found), np.array(counts)
    undecided = (hers == UNSURE) | (hers == BOUNDARY) | (ours == BOUNDARY)
    differs = np.flatnonzero((hers != ours) & ~undecided)
    assert [(cases[k], hers[k], ours[k]) for k in differs] == []
    # Where one of the two says that it cannot tell, the other may be able to.
    assert ((hers == UNSURE) | ((hers == BOUNDARY) & (ours != BOUNDARY))).mean() < 0.01
    assert len(cases) >= 4990
    # All kinds are among them.
    assert min((ours == 0).sum(), (ours > 0).sum(), (ours == UNCONFINED).sum()) > 100


@pytest.mark.parametrize(
    ("spec", "loop", "low", "high", "size"),
    [
        (COMMON, CommonArm(), -3.0, 3.0, 60),
        # One line was off by two from end to end: a crossing passed its begin.
        (COMMON, CommonArm(), -7.0, 7.0, 400),
        (DUAL, DualArm(), 0.7, 1.3, 60),
        (PAPER, paper_loop(), 1.0 - 3e-6, 1.0 + 3e-6, 60),
        (PAPER, paper_loop(), -1.2, 1.2, 60),
    ],
)
def test_a_chart_is_that_of_the_package_to_a_pixel(page, spec, loop, low, high, size):
    axis = low + (high - low) * np.arange(size) / (size - 1)
    expected = stability_chart(loop, axis, axis).counts
    call = "([spec, a, b, n]) => [...live.chart(live.make(spec), a, b, n, a, b, n).counts]"
    found = np.array(page.evaluate(call, [spec, low, high, size])).reshape(size, size)
    # A crossing between two pixels may be placed on the other side of one.
    near = [
        np.roll(expected, shift, axis=(0, 1))[1:-1, 1:-1]
        for shift in itertools.product((-1, 0, 1), repeat=2)
    ]
    inner = found[1:-1, 1:-1]
    sure = inner != UNSURE
    assert sure.mean() > 0.95
    within = (np.min(near, axis=0) <= inner) & (inner <= np.max(near, axis=0))
    assert within[sure].all()
    clear = sure & (expected[1:-1, 1:-1] != BOUNDARY)
    assert (found == expected)[1:-1, 1:-1][clear].mean() > 0.97


def test_break_and_margins_are_those_of_the_package(page):
    call = "spec => live.firstBreak(live.make(spec), 1, -1)"
    for difference in (PAPER["difference"], 0.1):
        edge = critical_perturbation(paper_loop(difference=difference), (1, -1))
        found = page.evaluate(call, {**PAPER, "difference": difference})
        assert found == pytest.approx(edge, rel=1e-7)
    found = page.evaluate("spec => live.margins(spec, 1, 1)", PAPER)
    expected = margins(paper_loop())
    assert found["lower"] == pytest.approx(expected.gain_lower, rel=1e-6)
    assert found["upper"] == pytest.approx(expected.gain_upper, rel=1e-6)
    assert found["phase"] == pytest.approx(expected.phase, rel=1e-6)
    assert found["modulus"] == pytest.approx(expected.modulus, rel=1e-3)


@pytest.mark.parametrize(
    ("spec", "loop", "centre", "half", "number"),
    [
        (COMMON, CommonArm(), 0.0, 7.0, 1000),
        ({**COMMON, "delay": 0.1}, CommonArm(delay=0.1), 0.5, 1.2, 20),
        (DUAL, DualArm(), 1.0, 0.1, 960),
        (PAPER, paper_loop(), 1.0, 3e-6, 40),
    ],
)
def test_root_and_count_at_2000_places_of_the_chapters_do_not_contradict(
    page, spec, loop, centre, half, number
):
    points = centre + half * np.random.default_rng(10).uniform(-1.0, 1.0, (number, 2))
    call = """([spec, points]) => points.map(
        ([x, y]) => [live.count(live.make(spec), x, y), live.rightmost(spec, x, y)])"""
    told = page.evaluate(call, [spec, points.tolist()])
    counts = unstable_roots(loop, *points.T)
    assert [count for count, _ in told] == counts.tolist()
    shown = np.array([root is not None for _, root in told])
    assert shown.mean() > 0.7
    hers = np.array([complex(*root) if root else np.nan for _, root in told])
    assert ((hers.real > 0) == (counts > 0))[shown].all()
    some = np.flatnonzero(shown)[:20]
    ours = rightmost_root(loop, *points[some].T)
    np.testing.assert_allclose(hers.real[some], ours.real, rtol=1e-6)
    np.testing.assert_allclose(abs(hers.imag[some]), abs(ours.imag), rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tau1": 0}, "tau1 must be a positive number, got 0"),
        ({"delay": -1}, "dead time must be zero or positive"),
        ({"gain": 0}, "gain must be a number other than zero"),
        ({"zeros": [[-1, 0]] * 9}, "9 zeros and 6 poles"),
        ({"poles": [[-1, 2], [-2, 0]]}, "in conjugate pairs"),
        ({"difference": 0}, "dtau must be a number other than zero"),
    ],
)
def test_a_loop_that_is_none_is_refused_in_words(page, change, message):
    call = "spec => { try { live.make(spec); } catch (error) { return error.message; } }"
    assert message in page.evaluate(call, {**PAPER, **change})


@pytest.fixture
def opened(chromium, tmp_path):
    """Open a page with one's own loop from disk, with what follows its address."""
    page = tmp_path / "page.html"
    scripts = "".join(
        f'<script src="{(LIVE / name).as_uri()}"></script>' for name in ("loop.js", "page.js")
    )
    page.write_text(f'<!DOCTYPE html><main><div data-live="loop"></div>{scripts}</main>')
    tab, errors = chromium.new_page(), []
    tab.on("pageerror", lambda error: errors.append(str(error)))

    def open_page(fragment=""):
        tab.goto("about:blank")
        tab.goto(page.as_uri() + fragment)
        return tab

    yield open_page
    assert errors == []
    tab.close()


def said(page):
    """What the chart says at a point in its middle, once the worker has answered."""
    canvas = page.locator(".live-chart canvas")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    page.mouse.move(0, 0)
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.3 * box["height"])
    page.wait_for_function(
        "() => /stable|root|boundary|sure/"
        ".test(document.querySelector('.live-chart output').textContent)"
    )
    return page.locator(".live-chart output").inner_text()


def test_the_python_lines_make_the_loop_of_the_page(opened):
    page = opened()
    presets = page.locator("select").first
    names = presets.locator("option").all_inner_texts()
    assert len(names) == 5
    counts = set()
    for name in names:
        presets.select_option(name)
        found = said(page)
        # The lines name the point once the pointer rests.
        page.wait_for_function(
            "() => !document.querySelector('pre').textContent.includes('loop, 1, 1)')"
        )
        scope: dict[str, object] = {}
        lines = page.locator("pre").inner_text().replace("print(", "count = (")
        exec(lines, scope)
        count = int(scope["count"])  # type: ignore[call-overload]
        word = "stable" if count == 0 else f"{count} unstable root"
        assert word in found, (name, found, count)
        counts.add(count)
    assert len(counts) > 1


def test_the_address_holds_loop_and_view(opened):
    page = opened()
    page.locator("select").first.select_option("Dual arm")
    page.locator("textarea").first.fill("-0.5±2j")
    page.locator("textarea").last.fill("0, -0.1, -3±1j")
    page.locator("textarea").last.blur()
    page.get_by_role("button", name="Zoom in").click()
    page.wait_for_function("() => location.hash.includes('0.15')")
    fragment = page.evaluate("location.hash")
    read = "() => [...document.querySelectorAll('input, textarea')].map(e => e.value)"
    before = page.evaluate(read)
    again = opened(fragment)
    again.wait_for_function("() => location.hash.includes('0.15')")
    assert again.evaluate(read) == before
    assert "-0.5±2j" in before
    assert "0, -0.1, -3±1j" in before


def test_a_wrong_number_is_named_and_changes_nothing(opened):
    page = opened()
    gain = page.get_by_label("Gain", exact=True)
    gain.fill("much")
    gain.blur()
    assert "gain must be a number, got much" in page.locator(".live-wrong").inner_text()
    assert "gain=5000," in page.locator("pre").inner_text()
