"""Look at every page of the built book in a real browser, without network.

Usage: python tools/check_browser.py FOLDER [PAGE ...]

Each page is opened from disk in headless Chromium, in light and dark mode and at the widths of
a screen, a tablet and two telephones. A page must ask nothing of the network, report no error,
show no raw TeX, not scroll sideways, and have no finding of axe. Code, tables and formulas that
are wider than their column must scroll, and say so. Search must find something, and what reacts
to the pointer must react:

- `data-check="hover"` on an element: its text must change while the pointer crosses it;
- a slider (`input type=range`): the figure around it, or the element that its `aria-controls`
  names, must change when an arrow key is pressed.

Chromium is the one of the system, or the one that the variable CHROMIUM names.
"""

import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

BROWSERS = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"]
MAC = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"
OPTIONS = ["--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"]
OPTIONS += ["--disable-background-networking", "--disable-component-update"]

WIDE = {"width": 1280, "height": 900}
MIDDLE = {"width": 768, "height": 1024}
NARROW = {"width": 390, "height": 844}
NARROWEST = {"width": 320, "height": 640}
# A word that the search of any book here must find.
WORD = "delay"
# From disk, axe may read no style sheet.
AXE = {"resultTypes": ["violations"], "preload": False}
# An element that should react is poked at so many places, at most.
POKES = 39
# So many seconds a page has to typeset formulas and to compute, on a machine that is busy.
PATIENCE = 10.0

# What a reader sees outside code and typeset formulas, and what TeX or MyST left in it.
RAW = r"""() => {
  const skip = 'script, style, noscript, pre, code, mjx-container, .math-raw-allowed, svg';
  const marks = [/\\[()\[\]]/, /\\(begin|frac|mathrm|omega|tau|left|right|cdot|sqrt|text)\b/,
                 /\$[^$\n]*[\\^_][^$\n]*\$/, /\{[a-z:]+\}`/];
  const found = [...document.querySelectorAll('mjx-merror')].map(
    e => 'formula: ' + e.getAttribute('data-mjx-error'));
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent;
    if (marks.some(mark => mark.test(text)) && !walker.currentNode.parentElement.closest(skip))
      found.push('raw TeX: ' + text.trim().slice(0, 80));
  }
  return found;
}"""

SIDEWAYS = r"""() => {
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth <= width) return [];
  const wide = [...document.querySelectorAll('body *')].filter(element => {
    if (element.getBoundingClientRect().right <= width + 1) return false;
    for (let up = element.parentElement; up; up = up.parentElement)
      if (up !== document.body && getComputedStyle(up).overflowX !== 'visible') return false;
    return true;
  });
  return ['scrolls sideways at ' + width + ' px: ' + wide.slice(-3).map(
    e => e.tagName.toLowerCase() + '.' + e.className).join(', ')];
}"""

# Code, tables and formulas that are cut, and do not say (armlock.js) that there is more; and
# formulas in a line that are cut although the line has room for them.
CUT = r"""async () => {
  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
  const found = [];
  for (const part of document.querySelectorAll('main :is(pre, table, div.math)')) {
    let box = part;
    while (box && getComputedStyle(box).overflowX === 'visible') box = box.parentElement;
    const scrolls = box && /auto|scroll/.test(getComputedStyle(box).overflowX);
    if (!box || !part.checkVisibility() || box.scrollWidth <= box.clientWidth + 1) continue;
    if (!scrolls || !('more' in box.dataset))
      found.push(`cut without a hint at ${innerWidth} px: ${part.textContent.slice(0, 40)}`);
  }
  for (const part of document.querySelectorAll('main mjx-container.wide[data-more]')) {
    let line = part.parentElement;
    while (line.clientWidth === 0) line = line.parentElement;
    const room = part.checkVisibility() && part.scrollWidth <= line.clientWidth;
    const text = line.textContent.slice(0, 40);
    if (room) found.push(`cut in a line with room at ${innerWidth} px: ${text}`);
  }
  return found;
}"""

# What a slider shows: as much of the page around it as changes, itself left out.
CONTROLLED = r"""slider => {
  const named = document.getElementById(slider.getAttribute('aria-controls') || ' ');
  const shown = (named || slider.closest('figure'))?.cloneNode(true);
  shown?.querySelectorAll('input').forEach(input => input.remove());
  return shown?.innerHTML ?? null;
}"""

TYPESET = "() => window.MathJax?.startup?.promise?.then(() => true) ?? true"


def find_chromium() -> str | None:
    """Return the path of Chromium, or None where there is none."""
    found = [shutil.which(name) for name in [os.environ.get("CHROMIUM", ""), *BROWSERS] if name]
    return next((path for path in found if path), MAC if Path(MAC).exists() else None)


@contextmanager
def browser() -> Iterator[Any]:
    """Run headless Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=find_chromium(), args=OPTIONS, chromium_sandbox=False
        )
        try:
            yield chromium
        finally:
            chromium.close()


class Book:
    """The pages of a built book, and what was found on them."""

    def __init__(self, folder: Path, chromium: Any) -> None:
        from axe_playwright_python.sync_playwright import Axe

        self.folder = folder.resolve()
        self.axe = Axe()
        self.problems: list[str] = []
        self.file = self.folder
        self.requests: set[str] = set()
        context = chromium.new_context(viewport=WIDE, offline=True, reduced_motion="reduce")
        self.page = context.new_page()
        self.page.on("request", lambda request: self.requests.add(request.url))
        self.page.on("pageerror", lambda error: self.report(f"script error: {error}"))
        self.page.on("console", self.read_console)

    def report(self, problem: str) -> None:
        """Note a problem of the page that is open."""
        line = f"{self.file.relative_to(self.folder)}: {problem}"
        if line not in self.problems:
            self.problems.append(line)

    def read_console(self, message: Any) -> None:
        """Note an error on the console."""
        if message.type == "error":
            self.report(f"console: {message.text}")

    def open(self, file: Path, query: str = "") -> None:
        """Open a page, and wait for its formulas."""
        self.file, self.requests = file, set()
        self.page.goto(file.as_uri() + query, wait_until="load")
        self.page.evaluate(TYPESET)

    def check(self, file: Path) -> None:
        """Do all checks of one page."""
        self.open(file)
        self.report_lasting(lambda: self.page.evaluate(RAW))
        self.check_interaction()
        self.report_lasting(lambda: self.by_axe("light"))
        self.page.evaluate("() => { document.documentElement.dataset.theme = 'dark' }")
        self.report_lasting(lambda: self.by_axe("dark"))
        for size in (WIDE, MIDDLE, NARROW, NARROWEST):
            self.page.set_viewport_size(size)
            self.report_lasting(
                lambda: [*self.page.evaluate(SIDEWAYS), *self.page.evaluate(CUT)]
            )
        self.page.set_viewport_size(WIDE)
        self.check_requests()

    def report_lasting(self, find: Callable[[], list[str]]) -> None:
        """Note what is still found when the page has had its time."""
        end = time.monotonic() + PATIENCE
        while (found := find()) and time.monotonic() < end:
            self.page.wait_for_timeout(100)
        for problem in found:
            self.report(problem)

    def check_requests(self) -> None:
        """See that everything came from disk."""
        for url in self.requests:
            if urlsplit(url).scheme not in {"file", "data", "blob", "about"}:
                self.report(f"asks the network for {url}")

    def by_axe(self, mode: str) -> list[str]:
        """Return what axe finds."""
        self.page.wait_for_timeout(50)  # until the colours are those of the mode
        found = []
        for finding in self.axe.run(self.page, options=AXE).response["violations"]:
            targets = [str(node["target"][0]) for node in finding["nodes"]]
            where = ", ".join(targets[:3]) + (" ..." if len(targets) > 3 else "")
            found.append(f"axe, {mode}: {finding['help']} ({len(targets)}: {where})")
        return found

    def check_interaction(self) -> None:
        """Move the pointer over what reacts to it, and sliders."""
        page = self.page
        for element in page.locator("[data-check=hover]").all():
            if not self.reacts(element):
                self.report("an element that should react to the pointer does not")
        for slider in page.locator("main input[type=range]").all():
            self.check_slider(slider)

    def check_slider(self, slider: Any) -> None:
        """Press an arrow key, and wait for what it changes."""
        slider.scroll_into_view_if_needed()
        slider.focus()
        before = slider.evaluate(CONTROLLED)
        up = slider.evaluate("s => Number(s.value) < Number(s.max)")
        slider.press("ArrowRight" if up else "ArrowLeft")
        problem = [f"a slider changes nothing: {slider.get_attribute('id')}"]
        self.report_lasting(
            lambda: problem if slider.evaluate(CONTROLLED) in (None, before) else []
        )

    def reacts(self, element: Any) -> bool:
        """Point at places all over an element until its text changes."""
        element.scroll_into_view_if_needed()
        before, box = element.inner_text(), element.bounding_box()
        for i in range(1, POKES + 1):
            x = box["x"] + box["width"] * ((0.37 * i) % 0.96 + 0.02)
            y = box["y"] + box["height"] * ((0.61 * i) % 0.96 + 0.02)
            self.page.mouse.move(x, y)
            self.page.wait_for_timeout(60)
            if element.inner_text() != before:
                return True
        return False

    def check_search(self) -> None:
        """Search, from disk, for a word that is in the book."""
        page = self.folder / "search.html"
        if not page.exists():
            return
        self.open(page, f"?q={WORD}")
        try:
            self.page.wait_for_selector("#search-results li a", timeout=10_000)
        except Exception:  # of any kind: the driver's own are not ours to name
            self.report(f"the search does not find {WORD!r}")


def pages(folder: Path) -> list[Path]:
    """Return the pages of the book, without redirects and the theme's templates.

    Of the listings of the package's sources, which differ in their text only, there is one.
    """
    found, listed = [], False
    for file in sorted(folder.rglob("*.html")):
        within = file.relative_to(folder).parts[0]
        listing = within == "_modules" and file.name != "index.html"
        redirect = 'http-equiv="refresh"' in file.read_text(encoding="utf-8")[:500].lower()
        if not (within == "_static" or redirect or (listing and listed)):
            found.append(file)
            listed |= listing
    return found


def check(folder: Path, files: list[Path], search: bool) -> list[str]:
    """Return the problems of some pages, and of the search."""
    with browser() as chromium:
        book = Book(folder, chromium)
        for file in files:
            book.check(file)
        if search:
            book.check_search()
    return book.problems


def main() -> int:
    """Check the folder named on the command line."""
    folder = Path(sys.argv[1]).resolve()
    if find_chromium() is None:
        print("No Chromium was found; on Debian and Ubuntu: apt-get install chromium")
        return 1
    started = time.monotonic()
    named = [folder / name for name in sys.argv[2:]]
    files = sorted(named or pages(folder), key=lambda file: file.stat().st_size)
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        parts = pool.map(check, [folder] * 2, [files[::2], files[1::2]], [not named, False])
    problems = [problem for part in parts for problem in part]
    print(*problems, sep="\n", end="\n" if problems else "")
    print(
        f"{len(files)} pages in Chromium, {time.monotonic() - started:.0f} s: the book has "
        f"{len(problems) or 'no'} problems in a browser"
    )
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
