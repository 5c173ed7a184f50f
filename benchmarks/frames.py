"""The live page: frames a second while the pointer moves and a slider is dragged."""

from __future__ import annotations

import json
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from armlock.checks import FloatArray
from benchmarks.report import Row, Topic
from tools import check_browser

LIVE = Path(__file__).resolve().parents[1] / "book" / "_static" / "live"
STYLE = (
    "canvas { display: block; width: 600px } input { width: 300px } section { width: 600px }"
)
#: Loops of the page by name: one of one pole, and the paper's of seven.
LOOPS = ("Common arm", "The paper's controlled loop")
CATEGORIES = ["devtools.timeline", "disabled-by-default-devtools.timeline.frame"]
#: What a person takes for smooth, in frames a second.
SMOOTH = 60.0
STEP = 1.0 / 120.0


def drive(page: Any, box: dict[str, float], seconds: float, *, held: bool) -> None:
    """Move the pointer: over the chart in a loop, or held, along a slider."""
    begun = time.perf_counter()
    while (passed := time.perf_counter() - begun) < seconds:
        share = 0.5 + 0.3 * math.sin(2.0 * passed)
        up = 0.5 if held else 0.5 + 0.3 * math.cos(2.3 * passed)
        page.mouse.move(box["x"] + share * box["width"], box["y"] + up * box["height"])
        time.sleep(STEP)


def frames(trace: bytes) -> FloatArray:
    """Return when the timeline has drawn a frame, in s."""
    events = json.loads(trace)["traceEvents"]
    return np.sort([1e-6 * event["ts"] for event in events if event["name"] == "DrawFrame"])


def measure(browser: Any, page: Any, selector: str, seconds: float, what: str) -> Row:
    """Return the row of one way to move."""
    part = page.locator(selector).first
    part.scroll_into_view_if_needed()
    box, held = part.bounding_box(), "range" in selector
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    if held:
        page.mouse.down()
    worked = check_browser.clock(page)
    before = worked()
    browser.start_tracing(page=page, categories=CATEGORIES)
    drive(page, box, seconds, held=held)
    drawn, work = frames(browser.stop_tracing()), worked() - before
    page.mouse.up()
    apart = np.diff(drawn)
    rate = 1.0 / apart.mean()
    slow = 1e3 * float(np.quantile(apart, 0.95))
    said = f"{rate:.0f} frames a second, 19 of 20 within {slow:.0f} ms; at least {SMOOTH:.0f}"
    # The screen gives no more than 60. The time is the processor's, for one frame.
    return Row(what, work / len(drawn), requirement=said, met=rate > 0.98 * SMOOTH)


def run(*, quick: bool) -> Topic:
    """Measure in Chromium's own timeline, without a graphics processor.

    Other work on the machine takes frames away; the processor's time for one stays.
    """
    if check_browser.find_chromium() is None:
        return Topic("Frames of the live page", [], ["No Chromium was found."])
    seconds, rows = 0.5 if quick else 5.0, []
    with tempfile.TemporaryDirectory() as name, check_browser.browser() as browser:
        file = Path(name) / "page.html"
        script = f'<script src="{(LIVE / "page.js").as_uri()}"></script>'
        file.write_text(
            f"<!DOCTYPE html><style>{STYLE}</style><main>"
            f'<div data-live="loop"></div>{script}</main>'
        )
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(file.as_uri())
        for loop in LOOPS:
            page.locator("select").first.select_option(loop)
            page.wait_for_timeout(3000)
            for selector, what in (
                (".live-chart canvas", "pointer on the chart"),
                ("input[type=range]", "gain dragged"),
            ):
                rows.append(measure(browser, page, selector, seconds, f"{loop}: {what}"))
                page.wait_for_timeout(1000)
    return Topic("Frames of the live page", rows)
