"""The book's live pages in Chromium: their numbers against the package's, and their use.

Each test of a page runs in one of six windows (width, theme, and mouse, keyboard or touch).
With FULL=1, as in `make browser` and `make attack`, each of them runs in all six.
"""

from __future__ import annotations

import itertools
import re
import secrets
from typing import Any, NamedTuple

import control
import numpy as np
import pytest
from matplotlib.pyplot import imread
from scipy import signal

from armlock import (
    CommonArm,
    DualArm,
    critical_perturbation,
    first_crossing,
    flight_loop,
    margins,
    paper_loop,
    stability_chart,
)
from armlock.orbits import esa
from book._ext import year
from tests import FULL, draws
from tests.attack import to_loop
from tests.attack_judge import Sketch
from tests.live_numbers import (
    BOUNDARY,
    LIVE,
    UNDECIDED,
    compare,
    described,
    draw,
    open_engine,
)
from tests.pasted import CERTAIN, DOUBTFUL, REFUSED, UNDERSTOOD
from tests.systems import sketch_of
from tests.test_browser import needs_chromium
from tools import check_browser

pytestmark = needs_chromium


@pytest.fixture(scope="module")
def chromium():
    with check_browser.browser() as chromium:
        yield chromium


@pytest.fixture(scope="module")
def page(chromium):
    return open_engine(chromium)


PAPER, COMMON, DUAL = (
    described(sketch_of(loop)) for loop in (paper_loop(), CommonArm(), DualArm())
)
HIGH = sketch_of(paper_loop()).scaled(50.0)
EQUAL = {**DUAL, "tau1": 3.39, "tau2": 3.39, "difference": 0.2}


def test_no_number_of_loops_drawn_anew_differs(page):
    """Those of `python -m tests.live_numbers --seed ...`, which draws more, and slow ones."""
    seed = secrets.randbits(32)
    print("seed", seed)
    rng = np.random.default_rng(seed)
    cases = (draw(rng) for _ in range(draws(10, 200)))
    # The paper's loop with its actuator takes 5 s in the page.
    found = compare(page, (c for c in cases if 0.0 not in c[0].poles or len(c[0].poles) < 6))
    assert found.wrong == []
    # Few refusals, some 2 % of each number, and something to compare.
    assert all(found.unsure[name] < 3 + 0.1 * asked for name, asked in found.asked.items())
    assert min(found.asked["phase"], found.asked["root"]) >= 1


@pytest.mark.parametrize(
    ("spec", "loop", "low", "high", "size"),
    [
        (COMMON, CommonArm(), -3.0, 3.0, 60),
        # One line was off by two from end to end: a crossing passed its begin.
        (COMMON, CommonArm(), -7.0, 7.0, 400),
        (DUAL, DualArm(), 0.7, 1.3, 60),
        # Sampled frequencies were wrong here at 3 412 of 160 000 pixels.
        (EQUAL, DualArm(tau1=3.39, tau2=3.39, difference=0.2), -3.0, 3.0, 60),
        (PAPER, paper_loop(), 1.0 - 3e-6, 1.0 + 3e-6, 60),
        (PAPER, paper_loop(), -1.2, 1.2, 60),
        # The limit of its chain cuts the window: 94 % were left undecided.
        (described(HIGH), to_loop(HIGH), 1.0 - 3e-6, 1.0 + 3e-6, 60),
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
    sure = inner != UNDECIDED
    assert sure.mean() > 0.97
    within = (np.min(near, axis=0) <= inner) & (inner <= np.max(near, axis=0))
    assert within[sure].all()
    clear = sure & (expected[1:-1, 1:-1] != BOUNDARY)
    assert (found == expected)[1:-1, 1:-1][clear].mean() > 0.97


def test_what_the_chart_cannot_decide_is_marked(page):
    """With few samples of the axis, all that is drawn is certain still."""
    call = (
        "([spec, n, most]) => [...live.chart(live.make(spec), -3, 3, n, -3, 3, n, most).counts]"
    )
    found = np.array(page.evaluate(call, [COMMON, 20, 500])).reshape(20, 20)
    axis = np.linspace(-3.0, 3.0, 20)
    expected = stability_chart(CommonArm(), axis, axis).counts
    assert 0.5 < (found == UNDECIDED).mean() < 0.95
    assert (found == expected)[found != UNDECIDED].all()


def test_what_rounding_left_undecided_is_decided(page):
    """Equal arms, the limit of a chain, and arms that differ by 16 us."""
    same = 0.27953757213211283
    # The rightmost root is the sensor's own pole at -2.5 rad/s, which L does not have.
    hidden = Sketch((), (0j,), 0.6725841770477973, "dual", same, same, 0.0, 2.5, same)
    equal = Sketch((), (0j,), 0.7, "dual", 6.6, 6.6, 0.35, 2.5, 6.6)
    delays = (0.24891151690719762, 0.24891151690719762, 0.0040138159908349605)
    neutral = Sketch(
        (-0.1954994891251281,), (-6.234360686368717,), 0.2623950404316682, "single", *delays
    )
    close = Sketch(
        (), (0j,), 1.27e-5, "dual", 0.2550248682751144, 0.2550085565712512, 0.0, 2.5,
        1.6311703863181037e-05,
    )  # fmt: skip
    points = [(1.0, 1.0), (1.0, 1.0), (0.9720616685027581, 1.0), (0.87, 0.94)]
    found = compare(page, zip((hidden, equal, neutral, close), points, strict=True))
    assert found.wrong == []
    assert found.unsure.total() == 0
    assert found.asked["root"] >= 3
    assert found.asked["break (1, 1)"] == 4


def test_a_loop_whose_open_loop_is_zero_has_the_numbers_of_the_package(page):
    """The difference of equal arms: two integrators made all of them undecided."""
    same = ("difference", 5.0, 5.0, 0.0, 2.5, 5.0)
    sketches = [
        Sketch(zeros, poles, 1.0, *same)
        for zeros, poles in (
            ((), (0j,)),
            ((), (0j, 0j)),
            ((0j,), (0j, 0j, -3.0)),
            ((-2.0,), (0j, -1.0)),
            ((), (1.0,)),
        )
    ]
    found = compare(page, zip(sketches, [(1.0, 1.0)] * 5, strict=True))
    assert found.wrong == []
    assert found.unsure.total() == 0
    assert found.asked["count"] == 5
    assert found.asked["break (1, -1)"] == found.asked["delay"] == 4


def test_none_up_to_two_is_true_where_the_package_looks_farther(page):
    """Where c1 + c2 = 2, exactly, nearly equal arms change L by next to nothing.

    `critical_perturbation` looks up to 1e9, and may refuse what it finds there.
    """
    late, arms = 1.23e-05, (10.540193934941918, 10.540193918503295)
    sketch = Sketch((), (-0.0235,), 0.2, "common", *arms, late, 2.5, 1.0)
    loop = to_loop(sketch)
    # |K (E1 - E2)| is at most the gain times the difference of the delays.
    assert 2.0 * sketch.gain * (arms[0] - arms[1]) < 1e-6 * margins(loop).modulus
    call = "spec => String(live.firstBreak(live.make(spec), 1, -1).size)"
    assert page.evaluate(call, described(sketch)) == "Infinity"
    assert first_crossing(loop, {}, (1, -1), stop=2.0).position == np.inf


def test_a_loop_on_the_boundary_has_undecided_margins(page):
    """The table said that there are none, as of an unstable loop."""
    spec = {**COMMON, "sensor": "single", "poles": [[1, 0]], "gain": 1.0}
    call = "spec => [live.count(live.make(spec), 0, 1), live.margins(spec, 0, 1)?.phase]"
    assert page.evaluate(call, spec)[0] == BOUNDARY
    assert np.isnan(page.evaluate(call, spec)[1])


#: How far each margin that is not in the limit lies from the curve that is drawn: the distance
#: of L there from the line between two samples, relative to their distance and |L|.
FAR = """([spec, c1, c2]) => {
    const loop = live.make(spec), found = live.margins(spec, c1, c2);
    if (!found) return [];
    const marks = ["lower", "upper", "delay", "phase", "modulus"]
        .map(name => found[`${name}At`])
        .filter(w => w > 0 && w < Infinity);
    const { omega, re, im, gap, at } = live.response(loop, c1, c2, 9000, marks);
    return marks.map(w => {
        const k = omega.findIndex(v => v >= w), [x, y] = at(w);
        if (k < 1 || gap(k) && omega[k] > w) return Infinity;
        if (omega[k] === w) return 0;
        const chord = Math.hypot(re[k] - re[k - 1], im[k] - im[k - 1]);
        const apart = [k - 1, k].map(i => Math.hypot(x - re[i], y - im[i]));
        return (apart[0] + apart[1] - chord) / Math.max(chord, Math.hypot(x, y));
    }); }"""


@pytest.mark.parametrize("number", [12])
def test_margins_lie_on_a_drawn_curve(page, number):
    rng = np.random.default_rng(secrets.randbits(32))
    asked = 0
    while asked < number:
        sketch, point = draw(rng)
        if len(sketch.poles) > 5:
            continue
        far = page.evaluate(FAR, [described(sketch), *map(float, point)])
        assert all(distance < 0.1 for distance in far), (sketch, point, far)
        asked += bool(far)


@pytest.fixture(scope="module")
def text(chromium):
    page = chromium.new_page()
    page.add_script_tag(path=LIVE / "read.js")
    return page


#: Places in the s-plane at which two controllers are compared.
PLACES = np.array([0.3 + 0.4j, 1.1 - 2j, -0.7 + 0.2j, 0.01 + 0.05j, 4 + 3j])


def transfer_of(found):
    """Return the function of s that the page has read."""

    def transfer(s):
        value = found["gain"] * np.exp(-s * found["delay"])
        for kind, power in (("zeros", 1), ("poles", -1)):
            for root in found[kind]:
                value = value * (s - complex(*root)) ** power
        return value

    return transfer


READ = """([reader, typed]) => {
    const typing = reader === "readController" ? [typed] : ["zeros", typed, "Zeros"];
    try { return armlockRead[reader](...typing); }
    catch (error) { return error.field + " " + error.message; } }"""


@pytest.mark.parametrize(
    ("typed", "roots"),
    [
        ("-0.1, -0.5±2j", [-0.1, -0.5 + 2j, -0.5 - 2j]),
        ("-0.1000 + 2.0000i\n  -0.1000 - 2.0000i", [-0.1 + 2j, -0.1 - 2j]),
        ("[-0.1+2.j -0.1-2.j]", [-0.1 + 2j, -0.1 - 2j]),
        ("array([(-0.1+2j), (-0.1-2j), 0j])", [0, -0.1 + 2j, -0.1 - 2j]),
        ("1.0e+03 *\n\n  -0.5000\n  -1.0000", [-500, -1000]),
        ("2j, -2j", [2j, -2j]),
        ("-2*pi*0.1; 0", [-0.2 * np.pi, 0]),
        # Rounded apart.
        ("-0.1000+2.0001i -0.1000-2.0000i", [-0.1 + 2.00005j, -0.1 - 2.00005j]),
        ("", []),
    ],
)
def test_what_programs_print_is_read(text, typed, roots):
    found = [complex(*pair) for pair in text.evaluate(READ, ["readRoots", typed])]
    one, other = (np.sort_complex(np.array(v, dtype=complex)) for v in (found, roots))
    np.testing.assert_allclose(one, other, rtol=1e-15)


@pytest.mark.parametrize(("typed", "transfer"), UNDERSTOOD, ids=itertools.count())
def test_a_pasted_text_is_understood_exactly(text, typed, transfer):
    found = text.evaluate(READ, ["readController", typed])
    assert isinstance(found, dict), found
    assert transfer_of(found)(PLACES) == pytest.approx(transfer(PLACES), rel=1e-12)


@pytest.mark.parametrize(("typed", "why"), REFUSED, ids=itertools.count())
def test_a_pasted_text_is_refused_for_a_reason(text, typed, why):
    found = text.evaluate(READ, ["readController", typed])
    assert isinstance(found, str), found
    assert found.startswith("pasted This text is not understood: ")
    assert why in found


@pytest.mark.parametrize("typed", [*DOUBTFUL, *CERTAIN], ids=itertools.count())
def test_what_rounded_digits_leave_open_is_said(text, typed):
    found = text.evaluate(READ, ["readController", typed])
    assert ("half a unit" in found["doubt"]) == (typed in DOUBTFUL)


def test_no_print_of_an_integrator_asks_for_more_digits(text):
    """Controllers over many decades, whose zeros numpy writes in exponent form."""
    rng = np.random.default_rng(3)
    for _ in range(10):
        poles = [0.0, *-(10.0 ** rng.uniform(-6.0, 2.0, 3))]
        zeros = -(10.0 ** rng.uniform(-6.0, 2.0, 2))
        plain = control.tf(control.zpk(zeros, poles, 10.0 ** rng.uniform(-2.0, 4.0)))
        states, lists = control.ss(plain), (plain.num[0][0], plain.den[0][0])
        for printed in (plain, lists, states, signal.TransferFunction(*lists)):
            for typed in (str(printed), repr(printed)):
                if "object at" not in typed:
                    found = text.evaluate(READ, ["readController", typed])
                    assert found["doubt"] == "", typed


def test_no_text_blocks_the_page(text):
    """Heavy ones are refused, or read in a moment: a polynomial of degree 41 took seconds."""
    rng = np.random.default_rng(41)
    lists = [" ".join(map(repr, rng.uniform(0.0, 10.0, n).tolist())) for n in (41, 42)]
    timed = (
        "typed => { const from = performance.now(); READ; return performance.now() - from; }"
    )
    timed = timed.replace("READ", "try { armlockRead.readController(typed) } catch (error) {}")
    quick = text.evaluate(timed, "1/s")
    for typed in (f"tf([{lists[0]}], [{lists[1]}])", *(typed for typed, _ in REFUSED)):
        assert text.evaluate(timed, typed) < 4000 + 100 * quick
    high = text.evaluate(READ, ["readController", f"tf([{lists[0]}], [{lists[1]}])"])
    poles = np.array([complex(*pole) for pole in high["poles"]])
    expected = np.roots([float(part) for part in lists[1].split()])
    assert np.sort_complex(poles) == pytest.approx(np.sort_complex(expected), rel=1e-6)


def test_what_python_prints_is_understood(text):
    """Loops drawn anew, printed by python-control and scipy in all their ways."""
    rng = np.random.default_rng(12)
    for _ in range(25):
        n = int(rng.integers(1, 5))
        poles = -rng.uniform(0.1, 5.0, n).round(2)
        zeros = -rng.uniform(0.1, 5.0, int(rng.integers(0, n + 1))).round(2)
        gain = round(float(rng.uniform(1.0, 9.0)), 1)
        own = control.zpk(zeros, poles, gain, display_format="zpk")
        plain = control.tf(own, display_format="poly")
        states = control.ss(own)
        lists = own.num[0][0], own.den[0][0]
        printed = {
            str(own): 5e-3, str(plain): 2e-2, repr(plain): 1e-5, str(states): 1e-3,
            repr(states): 1e-3, repr(signal.TransferFunction(*lists)): 1e-5,
            repr(signal.ZerosPolesGain(zeros, poles, gain)): 1e-12,
            repr(signal.StateSpace(states.A, states.B, states.C, states.D)): 1e-3,
            repr((zeros, poles, gain)): 1e-12, repr(lists): 1e-5,
        }  # fmt: skip
        for typed, near in printed.items():
            found = text.evaluate(READ, ["readController", typed])
            assert isinstance(found, dict), (typed, found)
            got, asked = transfer_of(found)(PLACES), own(PLACES)
            assert got == pytest.approx(asked, rel=near * 50), typed


@pytest.mark.parametrize(
    ("reader", "typed", "why"),
    [
        ("readRoots", "-0,1", "decimals with a point"),
        ("readRoots", "-1,5±2j", "decimals with a point"),
        ("readRoots", "much", "“much” is none"),
        ("readRoots", "-0.1+2j", "come in pairs"),
        ("readRoots", "1/0", "is none"),
        ("readRoots", "s + 1", "is none"),
    ],
)
def test_what_is_no_number_is_refused_at_its_field(text, reader, typed, why):
    found = text.evaluate(READ, [reader, typed])
    assert found.startswith("zeros ")
    assert why in found


class Window(NamedTuple):
    """A window of a browser, and what its reader has at hand."""

    width: int
    theme: str
    by: str

    def __str__(self):
        return "-".join(map(str, self))


WINDOWS = [
    Window(1280, "light", "mouse"),
    Window(390, "dark", "touch"),
    Window(1920, "dark", "keyboard"),
    Window(1920, "light", "mouse"),
    Window(390, "light", "touch"),
    Window(1280, "dark", "keyboard"),
]
PHONES = [window for window in WINDOWS if window.by == "touch"]
TURNS = itertools.cycle(WINDOWS)


def pytest_generate_tests(metafunc):
    """Give each test of a page one window in turn, or all of them with FULL=1."""
    given = metafunc.definition.get_closest_marker("parametrize")
    if "window" in metafunc.fixturenames and not given:
        windows = WINDOWS if FULL else [next(TURNS)]
        metafunc.parametrize("window", windows, ids=str)


@pytest.fixture(scope="module")
def tabs(chromium):
    """Lend a tab, and take it back: a new one costs as much as all that a page does in it."""
    free: dict[bool, list[Any]] = {True: [], False: []}

    def lend(window, motion):
        touch = window.by == "touch"
        if not free[touch]:
            context = chromium.new_context(
                permissions=["clipboard-read", "clipboard-write"],
                has_touch=touch,
                is_mobile=touch,
            )
            tab = context.new_page()
            tab.set_default_timeout(25_000)
            tab.add_init_script(RECORD)
            tab.session = context.new_cdp_session(tab)
            free[touch].append(tab)
        tab = free[touch].pop()
        tab.set_viewport_size({"width": window.width, "height": 844 if touch else 900})
        tab.emulate_media(reduced_motion=motion)
        tab.by = window.by
        return tab

    def take_back(tab):
        # The next page finds no pointer over it, and no steps to go back.
        tab.mouse.move(0, 0)
        tab.goto("about:blank")
        tab.session.send("Page.resetNavigationHistory")
        free[tab.by == "touch"].append(tab)

    return lend, take_back


@pytest.fixture
def show(tabs, tmp_path, window):
    """Open a live part from disk in a window, with what follows its address."""
    lend, take_back = tabs
    lent, errors = [], []
    style = (LIVE.parent / "live.css").read_text()

    def listen(error):
        errors.append(str(error))

    def open_page(part, fragment="", live=LIVE, motion="no-preference"):
        file, script = tmp_path / "page.html", (live / "page.js").as_uri()
        head = "<meta name=viewport content='width=device-width'>"
        file.write_text(
            f"<!DOCTYPE html><html data-theme='{window.theme}'>{head}"
            f"<style>* {{ box-sizing: border-box }} {style}"
            # As the book's theme has it.
            ".visually-hidden { clip-path: inset(50%); position: absolute; width: 1px }</style>"
            "<main class='bd-content' style='max-width: 81rem'>"
            f"<div class='live' data-live='{part}'></div>"
            f"<script src='{script}'></script></main>"
        )
        tab = lend(window, motion)
        lent.append(tab)
        tab.on("pageerror", listen)
        tab.goto(file.as_uri() + fragment)
        return tab

    yield open_page
    for tab in lent:
        take_back(tab)
        tab.remove_listener("pageerror", listen)
    assert errors == []


#: Keeps what is written on canvases, newest last.
RECORD = """window.drawn = [];
    const fillText = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, ...more) {
        drawn.push(text);
        fillText.call(this, text, ...more);
    };"""
#: All numbers of the table are there.
DONE = """() => document.querySelector('.live-chart [role=status].visually-hidden')
    .textContent.includes('all numbers')"""


@pytest.fixture
def opened(show):
    """Open a page with one's own loop."""

    def open_page(*fragment):
        tab = show("loop", *fragment)
        tab.wait_for_selector("textarea", state="attached")
        return tab

    return open_page


CHART, PLANE = ".live-chart canvas", ".live-plane canvas"
#: Addresses of no loop, from which one starts at once, and of loops whose numbers are cheap.
NOTHING = "#s=none"
SINGLE = "#s=single&t1=20.1&t2=19.9&g=1&z=&q=0&at=0,0,3"
DUAL_ARM = "#s=dual&t1=20.1&t2=19.9&g=10&p=2.5&dt=0.2&z=0,-0.5&q=0,-0.1&at=1,1,0.3&u=Hz"


def place(page, across, down, selector=CHART):
    """Return a place on a canvas, from shares of its width and height."""
    canvas = page.locator(selector)
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    return box["x"] + across * box["width"], box["y"] + down * box["height"]


def press(page, name):
    """Press a button."""
    button = page.get_by_role("button", name=name)
    if page.by == "mouse":
        button.click()
    elif page.by == "touch":
        button.tap()
    else:
        button.press("Enter")


def hold(page, across, down):
    """Hold a point of the chart; arrow keys move it from the middle by a twentieth each."""
    if page.by == "mouse":
        page.mouse.click(*place(page, across, down))
    elif page.by == "touch":
        page.touchscreen.tap(*place(page, across, down))
    else:
        for key, share in (("ArrowRight", across), ("ArrowUp", 1.0 - down)):
            other = {"ArrowRight": "ArrowLeft", "ArrowUp": "ArrowDown"}[key]
            steps = round(20.0 * (share - 0.5))
            for _ in range(abs(steps)):
                page.locator(CHART).press(f"Shift+{key if steps > 0 else other}")


def release(page, across, down):
    """Release the held point. A telephone has no Escape: a tap on the point releases it."""
    if page.by == "touch":
        hold(page, across, down)
    else:
        page.keyboard.press("Escape")


def slide(page, label, share):
    """Move a slider to a share of its length."""
    slider = page.get_by_role("slider", name=label)
    box = slider.bounding_box()
    at = {"x": share * (box["width"] - 1), "y": 0.5 * box["height"]}
    if page.by == "mouse":
        slider.click(position=at)
    elif page.by == "touch":
        slider.tap(position=at)
    else:
        for key in ["End"] if share == 1 else ["Home", *["ArrowRight"] * round(200 * share)]:
            slider.press(key)
    return slider


def drag(page, start, stop):
    """Drag from places to others, with as many fingers, or with the mouse."""
    if page.by == "touch":
        session = page.context.new_cdp_session(page)
        for share in (0.0, 0.1, 0.3, 0.6, 1.0):
            points = [
                {"x": a + share * (u - a), "y": b + share * (v - b), "id": k}
                for k, ((a, b), (u, v)) in enumerate(zip(start, stop, strict=True))
            ]
            kind = "touchMove" if share else "touchStart"
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    else:
        page.mouse.move(*start[0])
        page.mouse.down()
        page.mouse.move(*stop[0], steps=5)
        page.mouse.up()


def said(page):
    """What the chart says of its point, once the worker has answered."""
    page.wait_for_function(
        "() => !/counting/.test(document.querySelector('.live-chart output').textContent)"
    )
    return page.locator(".live-chart output").inner_text()


def type_in(page, label, text):
    field = page.get_by_label(label, exact=True)
    field.fill(text)
    field.blur()
    return field


def paste(page, text):
    """Paste a controller, and stay in its field."""
    field = page.get_by_label(PASTE)
    field.focus()
    page.evaluate("text => navigator.clipboard.writeText(text)", text)
    page.keyboard.press("Control+A")
    page.keyboard.press("Control+V")
    page.wait_for_function(f"() => !({BUSY})()")
    return field


#: A field holds a text that is not taken yet.
BUSY = "() => document.querySelector('.live').hasAttribute('aria-busy')"


def start(page, name):
    page.get_by_label("Start from").select_option(name)


def table(page):
    page.wait_for_function(DONE)
    rows = page.locator(".live-numbers tbody tr").all_inner_texts()
    return {row[0]: row[1:] for row in (row.split("\t") for row in rows)}


WHITE_PAPER = "The white paper's loop"
#: The directions of the table.
WAYS = [(1, -1), (-1, 1), (1, 1), (-1, -1)]


def test_a_point_is_held_until_it_is_released(opened):
    page = opened()
    at_first = said(page)
    if page.by == "mouse":
        page.mouse.move(*place(page, 0.9, 0.7))
        assert "2 unstable roots" in said(page)
        page.mouse.move(5, 5)
        # What follows a semicolon may come later.
        assert said(page).startswith(at_first.split(";")[0].rstrip("."))
    hold(page, 0.9, 0.7)
    held = said(page)
    assert "2 unstable roots" in held
    assert "Held" in held
    # On the way to a slider.
    page.mouse.move(*place(page, 0.4, 0.3))
    slide(page, "Dead time:", 0.0)
    assert said(page).startswith(held.split(". Held")[0].split(";")[0])
    page.wait_for_function("() => location.hash.includes('pt=')")
    point = page.locator("pre").text_content().split("unstable_roots(loop, ")[1]
    assert not point.startswith("1, 1")
    release(page, 0.9, 0.7)
    page.mouse.move(5, 5)
    assert said(page).startswith("(1, 1): stable")


@pytest.mark.parametrize("window", WINDOWS[:3], ids=str)
def test_numbers_and_sliders_stay_in_sight(opened, window):
    page = opened()
    table(page)
    canvases = page.locator(".live-main canvas")
    chart, plane, nyquist, bode = (canvases.nth(k).bounding_box() for k in range(4))
    if window.width > 1000:
        assert chart["y"] == nyquist["y"] < 200
        assert nyquist["x"] >= chart["x"] + chart["width"]
        assert plane["y"] == bode["y"] > chart["y"] + chart["height"]
    else:
        assert chart["y"] + chart["height"] < plane["y"] < nyquist["y"] < bode["y"]
    assert page.evaluate("document.documentElement.scrollWidth") <= window.width
    panel = page.locator(".live-panel")
    for down in (0, 300, 800):
        page.evaluate("down => scrollTo(0, down)", down)
        box = panel.bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= page.viewport_size["height"]
        # Nothing stands over it.
        seen = panel.evaluate(
            "e => { const b = e.getBoundingClientRect();"
            " return e.contains(document.elementFromPoint(b.x + 9, b.y + b.height / 2)); }"
        )
        assert seen
    shown = dict(
        zip(
            *(
                panel.locator(f".live-summary {part}").all_inner_texts()
                for part in ("span", "strong")
            ),
            strict=True,
        )
    )
    assert shown["Unstable roots"] == "0"
    assert shown["Delay margin"] == "0 s, in the limit"
    assert shown["Phase margin"] == "36°"
    page.evaluate("scrollTo(0, 0)")
    # Pictures follow the theme.
    before = canvases.nth(1).evaluate("c => c.toDataURL()")
    page.evaluate(
        "to => { document.documentElement.dataset.theme = to }",
        {"light": "dark", "dark": "light"}[window.theme],
    )
    page.wait_for_function(
        "before => document.querySelectorAll('.live-main canvas')[1].toDataURL() !== before",
        arg=before,
    )


@pytest.mark.parametrize("window", WINDOWS[:1], ids=str)
def test_no_number_that_the_keyboard_reaches_lies_under_the_panel(opened):
    page = opened(NOTHING)
    start(page, "Dual arm")
    table(page)
    page.evaluate("scrollTo(0, document.body.scrollHeight)")
    for key in ("Shift+Tab", "Tab"):
        for _ in range(25):
            page.keyboard.press(key)
            hidden = page.evaluate(
                """() => { const e = document.activeElement, b = e.getBoundingClientRect();
                const over = document.elementFromPoint(b.x + b.width / 2, b.y + b.height / 2);
                return e.matches('input') && !e.closest('.live-panel') && over
                    && over.closest('.live-panel') && e.id; }"""
            )
            assert not hidden
    # Pictures are drawn anew where their place is another.
    for width in (1000, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_function(
            "() => [...document.querySelectorAll('canvas')]"
            ".every(c => c.width === c.clientWidth)"
        )


PRINTED = """<TransferFunction>: sys[1]
Inputs (1): ['u[0]']

    s + 0.02
  -----------
  s^2 + 0.1 s"""


DELAYED = next(text for text, _ in UNDERSTOOD if "delay(3.0)" in text)
PASTE = "Paste a controller from MATLAB, Python or Julia"


def test_a_printed_controller_is_understood_or_refused(opened):
    page = opened(DUAL_ARM)
    paste(page, PRINTED)
    assert page.get_by_label("Start from").input_value() == ""
    code = page.locator("pre").text_content()
    assert "zeros=[-0.02]" in code
    assert "poles=[0, -0.1]" in code or "poles=[-0.1, 0]" in code
    assert page.get_by_label("Unit of roots").input_value() == "1"
    assert "0.4 * hertz" not in code
    assert "gain=1," in code
    assert page.get_by_label(PASTE).input_value() == PRINTED
    echo = page.locator(".live-formula")
    assert echo.inner_text() == "K(s) = (s + 0.02) / [s (s + 0.1)]"
    slide(page, "Gain factor:", 1)
    page.wait_for_function("() => /gain=100,/.test(document.querySelector('pre').textContent)")
    paste(page, "s^2\n---\ns\n---\n1")
    assert "more than one line of dashes" in page.locator("[role=alert]").text_content()
    assert page.get_by_label(PASTE).get_attribute("aria-invalid") == "true"
    press(page, "Undo")
    assert page.locator("[role=alert]").text_content() == ""
    assert "gain=100," in page.locator("pre").text_content()
    assert "changed after the text above" in echo.inner_text()
    assert page.get_by_label(PASTE).input_value() == PRINTED
    # Another page that is opened with the link has text, controller and dead time.
    paste(page, DELAYED)
    page.wait_for_function("() => location.hash.includes('k=')")
    again = opened(page.evaluate("location.hash"))
    for tab in (page, again):
        assert tab.get_by_label(PASTE).input_value() == DELAYED
        assert tab.locator(".live-formula").inner_text() == (
            "K(s) = 0.2 exp(−3 s) (s + 0.1) / [s (s + 0.1)]"
        )
        assert tab.get_by_label("Dead time in s").input_value() == "3"
    paste(page, DOUBTFUL[0])
    assert "half a unit" in page.locator(".live-paste").inner_text()
    paste(page, "(s^3 + 1)/(s^2 + 0.1 s)")
    assert "3 zeros and 2 poles" in page.locator("[role=alert]").text_content()


def test_numbers_are_those_of_the_text_in_its_field(opened):
    """Nothing but the clipboard and keys: the field is never left."""
    page = opened()
    table(page)
    formula, alert = page.locator(".live-formula"), page.locator("[role=alert]")
    field = paste(page, PRINTED)
    assert formula.inner_text() == "K(s) = (s + 0.02) / [s (s + 0.1)]"
    assert "36" not in table(page)["Phase margin in degrees"][0].split()[0]
    paste(page, "tf([1 2], [1 0")
    assert "not closed" in alert.inner_text()
    assert formula.inner_text() == page.locator(".live-numbers").inner_text() == ""
    entries = page.evaluate("history.length")
    page.keyboard.press("Control+A")
    for key in "5/(s+1)*(s+2)":
        field.press_sequentially(key)
        # What stands below is of another loop, and grey, and an unfinished text is not wrong.
        assert page.evaluate(BUSY)
        # One that is whole is taken, as the same step of the history.
        if field.input_value() in ("5", "5/(s+1)"):
            page.wait_for_function(f"() => !({BUSY})()")
        elif key in "/+":
            page.wait_for_timeout(700)
            assert page.evaluate(BUSY)
            shown = page.locator(".live-main").evaluate("e => getComputedStyle(e).opacity")
            assert float(shown) < 0.5
            assert "not understood" not in alert.inner_text()
    page.wait_for_function(f"() => !({BUSY})()")
    assert formula.inner_text() == "K(s) = 5 (s + 2) / (s + 1)"
    assert alert.inner_text() == ""
    assert page.evaluate("history.length") == entries + 1
    field.press_sequentially("/")
    page.wait_for_timeout(700)
    assert alert.inner_text() == ""
    field.press("Tab")
    assert "here should be" in alert.inner_text()
    press(page, "Undo")
    assert formula.inner_text() == "K(s) = 5 (s + 2) / (s + 1)"


#: The chart of a loop is there, if not yet as fine as it will be.
CHARTED = "() => /Refining|certain/.test(document.querySelector('.live-main').textContent)"


def test_a_loop_that_is_left_keeps_no_other_waiting(opened):
    page = opened(NOTHING)
    page.evaluate("""() => {
        const end = Worker.prototype.terminate;
        window.ended = 0;
        Worker.prototype.terminate = function () { window.ended += 1; end.call(this); };
    }""")
    start(page, WHITE_PAPER)
    # Some 130 000 unstable roots: its chart takes several seconds.
    type_in(page, "Dead time in s", "0.035")
    page.wait_for_timeout(1000)
    before = page.evaluate("window.ended")
    start(page, "The robust loop")
    # Its worker is ended, and does not go on to compute what nobody sees.
    page.wait_for_function(f"() => window.ended > {before}")
    page.wait_for_function(CHARTED)


def test_what_takes_too_many_steps_is_refused_at_once(opened):
    page = opened(NOTHING)
    start(page, WHITE_PAPER)
    type_in(page, "Gain", "496000")
    type_in(page, "Dead time in s", "0.035")
    found = table(page)
    assert found["Unstable roots"] == ["undecided: too many roots to count"]
    assert found["along (1, −1)"] == ["undecided"]


def test_a_bad_link_is_said_and_left_as_it_is(opened):
    page = opened(NOTHING)
    file = page.url.removesuffix(NOTHING)
    for fragment, why in (
        ("#s=dual&t1=20&t2=19", "no “g=”"),
        ("#t1=20", "no “s=”"),
        ("#s=single&t1=20&t2=x&g=1&z=&q=0", "“t2” must be a number"),
        ("#s=single&t1=20&t2=19&g=1&z=&q=0&pt=1", "“pt=1” is not 2 numbers"),
        ("#s=triple&t1=20&t2=19&g=1&z=&q=0", "unknown sensor triple"),
        ("#s=single&t1=20&t2=19&g=1&z=-1,-2&q=0", "2 zeros and 1 poles"),
    ):
        # Opened anew: the page would stay where only the fragment is another.
        page.goto("about:blank")
        page.goto(file + fragment)
        page.wait_for_selector("textarea", state="attached")
        assert why in page.locator("[role=alert]").text_content()
        page.wait_for_timeout(500)
        assert page.evaluate("location.hash") == fragment
        assert page.locator(".live-numbers").inner_text() == ""
        start(page, "Single arm")
        assert "stable" in said(page)
        assert page.locator("[role=alert]").text_content() == ""


def test_the_pictures_show_the_margins_of_the_table(opened):
    page = opened(NOTHING)
    start(page, WHITE_PAPER)
    found = table(page)
    assert found["Phase margin in degrees"] == ["28.6 at 1.95\xa0Hz"]
    # As `rightmost_root` of the package has it.
    assert found["Rightmost root in rad/s"] == ["−3.57\xa0×\xa010⁻⁶ ± 1.11\xa0×\xa010⁻⁶j"]
    page.wait_for_timeout(200)
    written = page.evaluate("drawn.slice(-400)")
    assert "28.6° at 1.95 Hz" in written
    assert "28.6°" in written
    assert {"gain × 0.241", "gain × 4.27"} <= set(written)


def test_the_root_that_crosses_is_named_and_drawn(opened):
    page = opened()
    for name, loop, way, times in (
        # How often a root is there: z^2 and three poles, or z^4 and five zeros at 36.6 uHz.
        (None, paper_loop(), (1, -1), "23"),
        (WHITE_PAPER, flight_loop(), (1, 1), "45"),
    ):
        if name:
            start(page, name)
        found = table(page)
        page.wait_for_timeout(300)
        sizes = {w: critical_perturbation(loop, w) for w in WAYS}
        assert min(WAYS, key=sizes.__getitem__) == way
        cells = {w: found[f"along {w}".replace("-", "−")][0] for w in WAYS}
        assert [w for w, cell in cells.items() if "(smallest)" in cell] == [way]
        hertz = first_crossing(loop, {}, way).omega / (2 * np.pi)
        digits, power = f"{hertz:.2e}".split("e")
        number = f"{float(digits):g}\xa0×\xa010⁻{'⁰¹²³⁴⁵⁶⁷⁸⁹'[-int(power)]}"
        assert f" at {number}\xa0Hz " in cells[way]
        written = page.evaluate("drawn")
        assert f"crosses at {number} Hz" in written
        assert set(times) <= set(written)
        assert number in said(page)


#: Of the Nyquist curve, drawn anew: places where two long lines turn back, as at a spike.
SPIKES = """async () => {
    const canvas = document.querySelectorAll('.live-main canvas')[2];
    const pen = canvas.getContext('2d'), places = [];
    for (const [name, placed] of [['lineTo', 1], ['moveTo', NaN]]) {
        const draw = pen[name];
        pen[name] = (x, y) => { places.push([placed * x, placed * y]); draw.call(pen, x, y); };
    }
    canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' }));
    await new Promise(done => setTimeout(done, 1000));
    const line = k => [0, 1].map(m => places[k][m] - places[k - 1][m]);
    return [places.length, places.slice(2).filter((_, k) => {
        const [a, b] = [line(k + 1), line(k + 2)], sizes = [a, b].map(v => Math.hypot(...v));
        return Math.min(...sizes) > 15
            && a[0] * b[0] + a[1] * b[1] < -0.8 * sizes[0] * sizes[1];
    }).length]; }"""


def test_the_nyquist_curve_has_no_spikes(opened):
    page = opened(NOTHING)
    start(page, WHITE_PAPER)
    table(page)
    places, spikes = page.evaluate(SPIKES)
    assert places > 1000
    assert spikes == 0


def test_an_unstable_chart_is_not_called_undecided(opened):
    page = opened()
    slide(page, "Dead time:", 0.1)
    assert "unstable at arbitrarily high frequency" in said(page)
    page.wait_for_function(
        "() => [...document.querySelectorAll('.live-note')].some(e => /in the whole chart."
        " This is certain/.test(e.textContent))"
    )


def test_no_preset_has_an_undecided_number_and_all_are_closed_loops(opened):
    page = opened(NOTHING)
    assert page.get_by_role("button", name="Watch").count() == 0
    names = page.get_by_label("Start from").locator("option").all_inner_texts()
    assert len(names) == 9
    for name in names[1:]:
        start(page, name)
        page.wait_for_function(DONE, timeout=120_000)
        found = table(page)
        assert found["Unstable roots"] == ["0"], name
        assert float(found["Rightmost root in rad/s"][0].replace("−", "-").split()[0]) < 0
        assert "undecided" not in str(found), name
        assert page.get_by_label("Start from").input_value() == name


#: Moves the slider of the gain from a value on, in each of some frames.
PUSH = """([from, frames]) => new Promise(done => {
    const slider = document.querySelector('input[type=range]');
    const next = k => {
        slider.value = from + 1e-3 * (k % 100);
        slider.dispatchEvent(new Event('input', { bubbles: true }));
        if (k < frames) requestAnimationFrame(() => next(k + 1)); else done();
    };
    next(0); })"""


#: A fixed piece of work, which takes about as long as a frame.
SINES = """() => {
    let sum = 0;
    for (let k = 0; k < 1e6; k++) sum += Math.sin(k) * Math.sqrt(k);
    return sum; }"""


def test_a_frame_is_drawn_fast_enough_while_a_slider_moves(opened):
    """Beside a fixed piece of work, in processor time: machines differ, and are shared."""
    page = opened(NOTHING)
    start(page, WHITE_PAPER)
    table(page)
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def busy():
        found = session.send("Performance.getMetrics")["metrics"]
        return next(one["value"] for one in found if one["name"] == "TaskDuration")

    times = [busy()]
    for call in (PUSH, [0, 60]), *[(SINES,)] * 30:
        page.evaluate(*call)
        times.append(busy())
    # Thirty frames a second where the work takes 17 ms.
    assert (times[1] - times[0]) / 60 < 2.0 * (times[-1] - times[1]) / 30


def test_numbers_in_the_fields_are_short(opened, capsys):
    page = opened()
    assert page.get_by_label("Corner p in Hz").input_value() == "0.4"
    assert (
        page.get_by_label("Zeros", exact=True).input_value()
        == "0, 0, -1e-8, -5e-6, -5e-6, -5e-6"
    )
    code = page.locator("pre")
    scopes: list[dict[str, object]] = []
    for unit in ("hz", "1"):
        page.get_by_label("Unit of roots").select_option(unit)
        scopes.append({})
        exec(code.text_content(), scopes[-1])
        assert scopes[-1]["controller"] == paper_loop().controller
        printed = capsys.readouterr().out
        assert re.search(r"unstable roots: 0\nrightmost root: -3\.57\S* rad/s\n", printed)
        assert f"phase margin: {np.degrees(margins(paper_loop()).phase):.4g} degrees" in printed
        assert "delay margin: 0 s\n" in printed
        assert "critical perturbation along (1, -1): 1.46" in printed


def test_errors_stand_at_the_field_that_was_edited(opened):
    page = opened(DUAL_ARM)
    for label, typed, message in (
        ("Gain", "much", "The gain must be a number, got “much”."),
        ("Poles", "-0,1", "Write decimals with a point"),
        ("Poles", "-0.1", "2 zeros and 1 poles"),
        ("Zeros", "1, 2, 3", "3 zeros and 2 poles"),
        ("Delay τ₁ in s", "0", "τ₁ must be a positive number, got 0"),
        ("Dead time in s", "-1", "dead time must be zero or positive, got -1"),
        ("Gain", "0", "gain must be a number other than zero, got 0"),
        ("Δτ in s", "0", "must be a number other than zero, got 0"),
        ("Bound on |S|, dB", "low", "The bound must be a number, got “low”."),
    ):
        before = page.get_by_label(label, exact=True).input_value()
        field = type_in(page, label, typed)
        assert (
            message in page.locator(f"#{field.get_attribute('aria-describedby')}").inner_text()
        )
        assert field.get_attribute("aria-invalid") == "true"
        assert "no loop" in page.locator(".live-chart output").inner_text()
        assert page.locator(".live-numbers").inner_text() == ""
        assert page.locator("pre").text_content() == ""
        type_in(page, label, before)
        assert field.get_attribute("aria-invalid") is None


def test_sliders_follow_what_is_typed(opened):
    page = opened(DUAL_ARM)
    dead, panel = page.get_by_label("Dead time:"), page.locator(".live-panel")
    field = type_in(page, "Dead time in s", "12.3 us")
    assert "delay=0.0000123," in page.locator("pre").text_content()
    assert "Dead time: 12.3 µs" in panel.inner_text()
    assert float(dead.input_value()) == pytest.approx(np.log10(12.3e-6), abs=0.02)
    type_in(page, "Dead time in s", "-3 ms")
    assert "got -3 ms" in page.locator("[role=alert]").inner_text()
    type_in(page, "Dead time in s", "0.25")
    assert "Dead time: 250 ms" in panel.inner_text()
    assert page.get_by_label("Start from").input_value() == ""
    start(page, "The paper's controlled loop")
    assert field.input_value() == "0"
    # No error in the page, though this count takes long.
    type_in(page, "Delay τ₁ in s", "1e9")
    page.wait_for_timeout(500)


def test_undo_goes_back_through_the_address(opened):
    page = opened(DUAL_ARM)
    undo = page.get_by_role("button", name="Undo")
    assert undo.is_disabled()
    type_in(page, "Gain", "4000")
    hold(page, 0.9, 0.7)
    press(page, "Zoom out")
    paste(page, PRINTED)
    for gain, held in (("4000", True), ("4000", False), ("10", False)):
        press(page, "Undo")
        page.wait_for_function(
            """([gain, held]) => {
                const text = name => document.querySelector(name).textContent;
                return text('pre').includes(`gain=${gain},`)
                    && text('.live-chart output').includes('Held') === held; }""",
            arg=[gain, held],
        )
    assert page.get_by_label("Zeros", exact=True).is_visible()


def test_a_slider_that_goes_on_moving_is_one_step_of_undo(opened):
    page = opened(SINGLE)
    before = page.get_by_label("Gain", exact=True).input_value()
    for _ in range(3):
        page.get_by_role("slider", name="Gain factor").press("ArrowRight")
    assert page.get_by_label("Gain", exact=True).input_value() != before
    press(page, "Undo")
    page.wait_for_function(
        f"() => document.querySelector('pre').textContent.includes('gain={before},')"
    )
    assert page.get_by_role("button", name="Undo").is_disabled()


#: Where the s-plane stands in the document, in each frame from now on.
STANDS = """selector => {
    window.stands = [];
    const canvas = document.querySelector(selector), look = () => {
        stands.push(canvas.getBoundingClientRect().top + scrollY);
        requestAnimationFrame(look);
    };
    look(); }"""


def test_a_pole_follows_the_hand(opened):
    """And the picture stays where it is: nothing above it changes its height."""
    page = opened(NOTHING)
    start(page, "Common arm with lead filter")
    poles, zeros = (page.get_by_label(name, exact=True) for name in ("Poles", "Zeros"))
    before = table(page)["Rightmost root in rad/s"]
    assert poles.input_value() == "0, -0.1"
    if page.by == "keyboard":
        # The picture's roots are those of the fields, which a keyboard reaches.
        type_in(page, "Poles", "0, -0.2")
    else:
        found = (place(page, across / 100, 0.5, PLANE) for across in range(5, 50))
        for at in found:
            page.mouse.move(*at)
            if page.locator(PLANE).evaluate("c => c.style.cursor") == "grab":
                break
        page.evaluate(STANDS, PLANE)
        drag(page, [at], [place(page, 0.12, 0.6, PLANE)])
        stands = page.evaluate("stands")
        assert max(stands) - min(stands) < 1
    moved = (poles.input_value() + zeros.input_value()).replace("0, ", "")
    assert moved != "-0.1-0.02"
    assert "j" not in moved
    assert table(page)["Rightmost root in rad/s"] != before


def test_the_address_holds_all(opened):
    page = opened(NOTHING)
    start(page, "Dual arm")
    type_in(page, "Zeros", "-0.5±2j")
    type_in(page, "Poles", "0, -0.1, -3±1j")
    press(page, "Zoom in")
    type_in(page, "Bound on |S|, dB", "3")
    hold(page, 0.6, 0.4)
    # The address follows the point a little later.
    point = page.locator("pre").text_content().split("unstable_roots(loop, ")[1].split(")")[0]
    page.wait_for_function(
        "point => location.hash.includes(`pt=${point.replace(', ', '%2C')}`)", arg=point
    )
    assert "0.15" in page.evaluate("location.hash")
    read = """() => [...document.querySelectorAll('input:not([type=range]), textarea, select')]
        .slice(1).map(e => e.value)"""
    before, point = page.evaluate(read), said(page)
    again = opened(page.evaluate("location.hash"))
    assert again.evaluate(read) == before
    assert {"-0.5±2j", "0, -0.1, -3±1j"} <= set(before)
    assert said(again).split(":")[0] == point.split(":")[0]


def test_the_regions_are_drawn_while_a_slider_is_held(opened):
    # A chart dropped at each move would leave the one before until the slider rests.
    page = opened(NOTHING)
    start(page, "Common arm")
    said(page)
    # How orange a corner is: full of roots, which at ten times the gain a coarse chart cannot
    # tell.
    read = """() => { const c = document.querySelector('.live-chart canvas'), n = c.width;
        const { data } = c.getContext('2d').getImageData(0.85 * n, 0.1 * n, 0.08 * n, 0.08 * n);
        let sum = 0;
        for (let i = 0; i < data.length; i += 4) sum += data[i] - data[i + 2];
        return 4 * sum / data.length; }"""
    page.wait_for_function(f"() => ({read})() > 20")
    before = page.evaluate(read)
    page.evaluate(f"() => {{ ({PUSH})([1, Infinity]); }}")
    page.wait_for_function(f"before => ({read})() < 0.25 * before", arg=before)


def test_a_frequency_lights_up_in_all_plots(opened):
    page = opened(NOTHING)
    start(page, "Common arm")
    table(page)
    bode, nyquist = (f".live-main canvas >> nth={k}" for k in (3, 2))
    before = page.locator(nyquist).evaluate("c => c.toDataURL()")
    if page.by == "mouse":
        page.mouse.move(*place(page, 0.6, 0.3, bode))
    elif page.by == "touch":
        page.touchscreen.tap(*place(page, 0.6, 0.3, bode))
    else:
        page.locator(bode).press("ArrowRight")
    page.wait_for_function(
        "() => [...document.querySelectorAll('.live-note')]"
        ".some(e => /Hz: \\|L\\| = .*\\|S\\| =/.test(e.textContent))"
    )
    assert page.locator(nyquist).evaluate("c => c.toDataURL()") != before


def test_two_designs_stand_side_by_side(opened):
    page = opened(NOTHING)
    start(page, "Common arm")
    alone = table(page)
    press(page, "Pin this loop")
    type_in(page, "Gain", "0.5")
    beside = table(page)
    assert [row[-1:] for row in beside.values()] == [row[-1:] for row in alone.values()]
    assert sum(row[:1] != row[1:] for row in beside.values() if row) >= 3
    # Another page that is opened with the link has both.
    page.wait_for_function("() => location.hash.includes('pin=')")
    again = opened(page.evaluate("location.hash"))
    assert table(again) == beside
    press(again, "Pin this loop")
    assert table(again).keys() == beside.keys()
    assert table(again)["Unstable roots"] == ["0"]


def test_a_loop_that_is_pinned_at_once_gets_its_numbers(opened):
    page = opened(NOTHING)
    start(page, "Dual arm")
    alone = table(page)
    start(page, "Single arm")
    start(page, "Dual arm")
    press(page, "Pin this loop")
    start(page, "Common arm")
    beside = table(page)
    assert [row[-1:] for row in beside.values()] == [row[-1:] for row in alone.values()]
    assert "…" not in str(beside)


def test_files_and_prints_show_all_pictures_with_their_legend(opened, tmp_path):
    page = opened()
    table(page)
    page.evaluate("drawn.length = 0")
    with page.expect_download() as download:
        press(page, "PNG")
    file = tmp_path / "loop.png"
    download.value.save_as(file)
    picture = imread(file)
    assert picture.shape[1] == 1600
    assert picture.shape[2] == 3 or (picture[..., 3] == 1.0).all()
    # From the chart, the s-plane, the Nyquist and the Bode plot, and a caption.
    shown = {"stable", "undecided", "in Hz", "10¹", "phase in °", "frequency in Hz"}
    written = page.evaluate("drawn")
    assert {*shown, "Nyquist curve of L, compressed beyond 1"} <= set(written)
    # What they are of.
    assert any("K(s) = 5000 s²" in line for line in written)
    assert {"Phase margin in degrees", "36 at 3.48\xa0×\xa010⁻⁶\xa0Hz"} <= set(written)
    page.evaluate(
        """() => { drawn.length = 0; addEventListener('beforeprint', () => {
            window.printed = [...document.querySelectorAll('.live-main canvas')]
                .map(c => [c.width / c.clientWidth,
                    [...c.getContext('2d').getImageData(0, 0, 1, 1).data]]); }); }"""
    )
    page.pdf()
    sharp, corners = zip(*page.evaluate("printed"), strict=True)
    assert min(sharp) > 3.9
    assert corners == 4 * ([255, 255, 255, 255],)
    assert shown <= set(page.evaluate("drawn"))


def test_a_bound_on_the_sensitivity_is_drawn_and_held_against_the_loop(opened):
    page = opened()
    smallest = page.locator(".live-summary strong").last
    assert table(page)["Smallest |1 + L|"][0].startswith("0.616")
    assert smallest.inner_text() == "0.616"
    assert "bound" in page.evaluate("drawn.slice(-200)")
    type_in(page, "Bound on |S|, dB", "4")
    table(page)
    assert smallest.inner_text() == "0.616 (> 4 dB)"
    assert page.get_by_label("Start from").input_value() == "The paper's controlled loop"
    press(page, "Undo")
    page.wait_for_function("() => !location.hash.includes('b=')")
    assert page.get_by_label("Bound on |S|, dB").input_value() == "6"


@pytest.mark.parametrize("window", PHONES, ids=str)
def test_fingers_scroll_past_drag_and_zoom(opened):
    page = opened(SINGLE)
    said(page)

    def view():
        page.wait_for_timeout(400)
        return tuple(
            float(v)
            for v in page.evaluate("location.hash").split("at=")[1].split("&")[0].split("%2C")
        )

    press(page, "Zoom out")
    x, y = place(page, 0.5, 0.4)
    before = view()
    drag(page, [(x, y)], [(x + 60, y)])
    moved = view()
    assert moved[0] < before[0]
    assert moved[2] == pytest.approx(before[2])
    drag(page, [(x - 20, y), (x + 20, y)], [(x - 60, y), (x + 60, y)])
    assert view()[2] == pytest.approx(before[2] / 3, rel=0.2)
    # A vertical swipe is the page's.
    page.evaluate("window.scrollTo(0, 0)")
    x, y = place(page, 0.3, 0.7)
    at = page.evaluate("scrollY")
    drag(page, [(x, y)], [(x, y - 200)])
    before = view()
    page.wait_for_function("at => scrollY > at + 50", arg=at)
    x, y = place(page, 0.3, 0.7)
    drag(page, [(x, y)], [(x + 30, y - 200)])
    assert view() == before
    # No key that a telephone lacks, and one word for what an unstable loop has none of.
    hold(page, 0.4, 0.4)
    assert "Held: a tap on it releases it." in said(page)
    type_in(page, "Gain", "-1")
    table(page)
    panel = page.locator(".live-summary strong").all_inner_texts()
    assert panel.count("–") == 5
    # What is pasted stands above the chart, near the numbers.
    texts = page.get_by_label(PASTE).bounding_box()
    assert texts["y"] < page.locator(CHART).bounding_box()["y"]


@pytest.fixture
def year_page(show, tmp_path):
    """Open the page of a year."""
    live = tmp_path / "live"
    live.mkdir()
    for file in LIVE.glob("*.js"):
        (live / file.name).write_text(file.read_text())
    (live / "orbits.js").write_text(year.table())
    return lambda *fragment: show("year", *fragment, live=live, motion="reduce")


def test_the_year_takes_the_loop_of_the_page(opened, year_page):
    page = opened(NOTHING)
    start(page, "Dual arm")
    type_in(page, "Gain", "7")
    link = page.get_by_role("link", name="Open this loop in orbit").get_attribute("href")
    assert link.startswith("in_orbit.html#s=dual")
    tab = year_page(link.removeprefix("in_orbit.html"))
    back = tab.get_by_role("link", name="Open the loop of this day")
    assert "g=7&" in back.get_attribute("href")
    assert tab.locator("select").first.input_value().startswith("yours")
    assert "Dashed: the half difference" in tab.locator("figcaption").first.inner_text()


#: Whether a picture of a year is shaded at some days, of which only day 100 was counted.
SHADED = """() => {
    const canvas = document.createElement('canvas'), pen = canvas.getContext('2d');
    [canvas.width, canvas.height] = [796, 400];
    const values = Array.from({ length: 366 }, (_, t) => [1e-3 * Math.sin(t), 1e-3]);
    const days = Array(366);
    days[100] = null;
    const colours = { mark: '#f00', text: '#000', line: '#00f', grid: '#ccc' };
    armlockDraw.drawYear({ values, days, day: 300 }, pen, 796, 400, colours);
    return [95, 98, 100, 102, 105].map(t =>
        pen.getImageData(Math.round(56 + 732 * t / 365), 6, 1, 1).data[3] > 0); }"""


def test_only_counted_days_are_shaded(year_page):
    assert year_page().evaluate(SHADED) == [False, False, True, False, False]


def test_the_year_marks_the_days_on_which_the_package_finds_no_stable_loop(year_page):
    tab = year_page()
    # The loop that the page's first sentence names.
    assert tab.locator("select").first.input_value() == "the paper's"
    words = tab.locator("p", has_text="counted once a day")
    words.wait_for()
    assert words.inner_text().startswith("Stable on 160 of 366 days: 12 to 171.")
    for k, name in enumerate(("the paper's", "trailing", "2", "a month's start")):
        tab.locator("select").nth(k).select_option(name)
    tab.locator("p", has_text="Counting the days").wait_for()
    words.wait_for()
    told = re.findall(r"(\d+)(?: to (\d+))?", words.inner_text().split(".")[0].split(":")[1])
    shown = {day for low, high in told for day in range(int(low), int(high or low) + 1)}
    orbit, days = esa("trailing"), np.arange(366.0)
    month = 365.25 / 12
    starts = month * np.floor(days / month)
    first = orbit.span[0]
    now, assumed = (orbit.round_trips(first + 86400.0 * t, 2) for t in (days, starts))
    ratio = (now[0] - now[1]) / (assumed[0] - assumed[1])
    # The edges of chapter 13.
    low, high = 0.20038, 3.9974
    clear = np.abs(np.log(np.abs(ratio)[:, None] / [low, high])).min(axis=1) > 1e-3
    expected = (ratio < low) | (ratio > high)
    assert expected[clear].any()
    assert [d for d in np.flatnonzero(clear) if (d in shown) == expected[d]] == []
    day = int(slide(tab, "Day", 0.3).input_value())
    assert day != 20
    one, two = (tau[day] for tau in now)
    assert f"{one:.4f} s and {two:.4f} s" in tab.locator("main").inner_text()
