"""Look at every page of the built book in a real browser, without network.

Usage: python tools/check_browser.py FOLDER [PAGE ...]

Each page is opened from disk in headless Chromium, in light and dark mode and at the widths of
a screen, a tablet and a telephone. A page must ask nothing of the network, report no error,
show no raw TeX, have no broken link or anchor, describe every image, not scroll sideways, have
no serious finding of axe, and be readable in time; what it loads must not weigh too much. Code,
tables and formulas that are wider than their column must scroll, and say so. Of the listings of
the package's sources, which differ in their text only, one is opened. Search must find
something, downloads must open, and what reacts to the pointer must react:

- `data-check="hover"` on an element: its text must change while the pointer crosses it, and
  where a finger taps it;
- a slider (`input type=range`): the figure around it, or the element that its `aria-controls`
  names, must change when an arrow key is pressed.

Chromium is the one of the system, or the one that the variable CHROMIUM names.
"""

import csv
import html
import json
import os
import re
import shutil
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

BROWSERS = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"]
MAC = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"
OPTIONS = ["--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"]
OPTIONS += ["--disable-background-networking", "--disable-component-update"]

WIDE = {"width": 1280, "height": 900}
MIDDLE = {"width": 768, "height": 1024}
NARROW = {"width": 390, "height": 844}
LONGEST = 3.0  # seconds of processor time until a page is readable
HEAVIEST = 6e6  # bytes that a page loads
OPENED = {".csv", ".png", ".svg", ".ipynb", ".json"}
# A word that the search of any book here must find.
WORD = "delay"

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

IMAGES = r"""() => [...document.querySelectorAll('img, svg[role=img]')].filter(image => {
  if (image.closest('[aria-hidden=true]') || image.getAttribute('role') === 'presentation')
    return false;
  const text = image.getAttribute('alt') || image.getAttribute('aria-label')
    || image.getAttribute('aria-labelledby') || image.querySelector?.('title')?.textContent;
  return !text || !text.trim() || /\.(png|svg|jpe?g)$/.test(text);
}).map(image => 'no alternative text: ' + (image.getAttribute('src') || image.outerHTML)
  .slice(0, 80))"""

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

# Code, tables and formulas that are cut, and do not say (armlock.js) that there is more.
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
  return found;
}"""

LINKS = r"""() => ({
  links: [...document.querySelectorAll('a[href]')].map(a => a.getAttribute('href')),
  anchors: [...document.querySelectorAll('[id], a[name]')].map(e => e.id || e.name),
})"""

# Marks where a combination of colours is new: of a text, of what lies behind it, and whether it
# is large, which decides how strong the contrast has to be.
COLOURS = r"""seen => {
  document.querySelectorAll('[data-colours]').forEach(e => delete e.dataset.colours);
  const known = new Set(seen), behind = new Map([[null, '']]);
  const ground = element => {
    if (!behind.has(element)) {
      const style = getComputedStyle(element);
      const own = [style.backgroundColor, style.opacity, style.backgroundImage].join();
      const opaque = /^rgb\(.*,1,none$/.test(own), clear = own === 'rgba(0, 0, 0, 0),1,none';
      const around = opaque ? '' : ground(element.parentElement);
      behind.set(element, clear ? around : own + '|' + around);
    }
    return behind.get(element);
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.textContent.trim() || !element.checkVisibility()) continue;
    const style = getComputedStyle(element), size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
    const key = [style.color, large, ground(element)].join();
    element.dataset.colours ||= known.has(key) ? 'known' : 'new';
    known.add(key);
  }
  return [...known].slice(seen.length);
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
        self.colours: list[str] = []
        self.problems: list[str] = []
        self.links: dict[Path, list[str]] = {}
        self.anchors: dict[Path, set[str]] = {}
        self.slowest = (0.0, "")
        self.heaviest = (0, "")
        self.file = self.folder
        self.requests: set[str] = set()
        context = chromium.new_context(viewport=WIDE, offline=True, reduced_motion="reduce")
        self.page = context.new_page()
        telephone = chromium.new_context(viewport=NARROW, offline=True, has_touch=True)
        self.telephone = telephone.new_page()
        # Time of the processor, since other programs may have it meanwhile.
        self.session = context.new_cdp_session(self.page)
        self.session.send("Performance.enable", {"timeDomain": "threadTicks"})
        self.page.on("request", lambda request: self.requests.add(request.url))
        self.page.on("pageerror", lambda error: self.report(f"script error: {error}"))
        self.page.on("console", self.read_console)

    def __getstate__(self) -> dict[str, Any]:
        """Return what was found: the browser stays in its process."""
        kept = ("folder", "file", "problems", "links", "anchors", "slowest", "heaviest")
        return {name: vars(self)[name] for name in kept}

    def join(self, other: "Book") -> None:
        """Add what was found on other pages."""
        self.problems += other.problems
        self.links |= other.links
        self.anchors |= other.anchors
        self.slowest = max(self.slowest, other.slowest)
        self.heaviest = max(self.heaviest, other.heaviest)

    def report(self, problem: str) -> None:
        """Note a problem of the page that is open."""
        line = f"{self.file.relative_to(self.folder)}: {problem}"
        if line not in self.problems:
            self.problems.append(line)

    def read_console(self, message: Any) -> None:
        """Note an error on the console."""
        if message.type == "error":
            self.report(f"console: {message.text}")

    def busy(self) -> float:
        """Return for how long the page has worked since it was opened, in s."""
        metrics = self.session.send("Performance.getMetrics")["metrics"]
        return float(next(m["value"] for m in metrics if m["name"] == "TaskDuration"))

    def open(self, file: Path, query: str = "") -> float:
        """Open a page, wait for its formulas, and return what work that was, in s."""
        self.file, self.requests = file, set()
        self.page.goto(file.as_uri() + query, wait_until="load")
        self.page.evaluate(TYPESET)
        return self.busy()

    def check(self, file: Path) -> None:
        """Do all checks of one page."""
        seconds = self.open(file)
        name = str(file.relative_to(self.folder))
        self.slowest = max(self.slowest, (seconds, name))
        if seconds > LONGEST:
            self.report(f"takes {seconds:.1f} s to load, more than {LONGEST:.0f}")
        found = self.page.evaluate(LINKS)
        self.links[file], self.anchors[file] = found["links"], set(found["anchors"])
        for script in (RAW, IMAGES):
            for problem in self.page.evaluate(script):
                self.report(problem)
        self.check_interaction()
        if self.page.locator("[data-check=hover]").count():
            self.check_touch(file)
        self.check_axe("light", None, {"rules": {"color-contrast": {"enabled": False}}})
        self.check_contrast("light")
        self.page.evaluate("() => { document.documentElement.dataset.theme = 'dark' }")
        self.page.wait_for_timeout(50)
        self.check_contrast("dark")
        for size in (WIDE, MIDDLE, NARROW):
            self.page.set_viewport_size(size)
            self.page.wait_for_timeout(50)
            for problem in [*self.page.evaluate(SIDEWAYS), *self.page.evaluate(CUT)]:
                self.report(problem)
        self.page.set_viewport_size(WIDE)
        self.check_requests(name)

    def read(self, file: Path) -> None:
        """Take the links and anchors of a page that is not opened."""
        text = file.read_text(encoding="utf-8")
        self.links[file] = [
            html.unescape(a) for a in re.findall(r'<a [^>]*href="([^"]*)"', text)
        ]
        self.anchors[file] = set(re.findall(r' id="([^"]*)"', text))

    def check_requests(self, name: str) -> None:
        """See that everything came from disk, and how much it was."""
        size = 0
        for url in self.requests:
            parts = urlsplit(url)
            if parts.scheme == "file":
                path = Path(unquote(parts.path))
                size += path.stat().st_size if path.is_file() else 0
            elif parts.scheme not in {"data", "blob", "about"}:
                self.report(f"asks the network for {url}")
        self.heaviest = max(self.heaviest, (size, name))
        if size > HEAVIEST:
            self.report(f"loads {size / 1e6:.1f} MB, more than {HEAVIEST / 1e6:.0f}")

    def check_contrast(self, mode: str) -> None:
        """Check the combinations of colours that no page had before: axe is slow at it."""
        found = self.page.evaluate(COLOURS, self.colours)
        self.colours += found
        if found:
            parts = {"include": [["[data-colours=new]"]], "exclude": [["[data-colours=known]"]]}
            rule = {"runOnly": {"type": "rule", "values": ["color-contrast"]}}
            self.check_axe(mode, parts, rule)

    def check_axe(self, mode: str, parts: dict[str, Any] | None, which: dict[str, Any]) -> None:
        """Run axe, and note what it finds serious or critical."""
        options = {"resultTypes": ["violations"], "preload": False, **which}
        found = self.axe.run(self.page, context=parts, options=options).response
        for finding in found["violations"]:
            if finding["impact"] in {"serious", "critical"}:
                targets = [str(node["target"][0]) for node in finding["nodes"]]
                where = ", ".join(targets[:3]) + (" ..." if len(targets) > 3 else "")
                self.report(f"axe, {mode}: {finding['help']} ({len(targets)}: {where})")

    def check_interaction(self) -> None:
        """Move the pointer over what reacts to it, and sliders."""
        page = self.page
        for element in page.locator("[data-check=hover]").all():
            if not self.sweep(element):
                self.report("an element that should react to the pointer does not")
        for slider in page.locator("main input[type=range]").all():
            slider.scroll_into_view_if_needed()
            slider.focus()
            before = slider.evaluate(CONTROLLED)
            key = (
                "ArrowRight"
                if slider.evaluate("s => Number(s.value) < Number(s.max)")
                else "ArrowLeft"
            )
            slider.press(key)
            page.wait_for_timeout(100)
            if before is None or slider.evaluate(CONTROLLED) == before:
                self.report(f"a slider changes nothing: {slider.get_attribute('id')}")

    def check_touch(self, file: Path) -> None:
        """Tap on what reacts to the pointer."""
        self.telephone.goto(file.as_uri(), wait_until="load")
        for element in self.telephone.locator("[data-check=hover]").all():
            element.scroll_into_view_if_needed()
            before, box = element.inner_text(), element.bounding_box()
            for share in (0.3, 0.5, 0.7):
                self.telephone.touchscreen.tap(
                    box["x"] + share * box["width"], box["y"] + 0.4 * box["height"]
                )
            self.telephone.wait_for_timeout(60)
            if element.inner_text() == before:
                self.report("an element that should react to a finger does not")

    def sweep(self, element: Any) -> bool:
        """Move the pointer across an element until its text changes."""
        element.scroll_into_view_if_needed()
        before, box = element.inner_text(), element.bounding_box()
        for i in range(1, 40):
            x = box["x"] + box["width"] * ((0.37 * i) % 0.96 + 0.02)
            y = box["y"] + box["height"] * ((0.61 * i) % 0.96 + 0.02)
            self.page.mouse.move(x, y)
            self.page.wait_for_timeout(60)
            if element.inner_text() != before:
                return True
        return False

    def check_links(self) -> None:
        """Follow all links within the book, once all pages are known."""
        downloads = set()
        for file, links in self.links.items():
            self.file = file
            for link in dict.fromkeys(links):
                parts = urlsplit(link)
                if parts.scheme or parts.netloc:
                    continue
                target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
                if not target.is_file():
                    self.report(f"broken link: {link}")
                elif target in self.anchors:
                    anchor = unquote(parts.fragment)
                    if anchor and anchor not in self.anchors[target]:
                        self.report(f"broken anchor: {link}")
                elif target.suffix in OPENED:
                    downloads.add(target)
            if file.parent.name == "notebooks" and not any(a.endswith(".ipynb") for a in links):
                self.report("no link to download the notebook")
        for target in sorted(downloads):
            self.file = target
            try:
                read_download(target)
            except (ValueError, SyntaxError, OSError, KeyError) as error:
                self.report(f"does not open: {error}")

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


def is_number(text: str) -> bool:
    """Return whether a field of a table is a number, or empty."""
    try:
        return not text or isinstance(float(text), float)
    except ValueError:
        return False


def read_download(file: Path) -> None:
    """Open a file that the book offers, or raise."""
    if file.suffix == ".csv":
        with file.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        if len(rows) < 2 or any(len(row) != len(rows[0]) for row in rows):
            raise ValueError("not a table with a header")
        bare = [
            name
            for name, *values in zip(*rows, strict=True)
            if "[" not in name and all(is_number(value) for value in values)
        ]
        if file.parent.name == "figures" and bare:
            raise ValueError(f"columns without a unit: {', '.join(bare)}")
    elif file.suffix == ".svg":
        ElementTree.parse(file)
    elif file.suffix == ".png":
        if not file.read_bytes().startswith(b"\x89PNG\r\n\x1a\n"):
            raise ValueError("not a PNG")
    else:
        content = json.loads(file.read_text(encoding="utf-8"))
        if file.suffix == ".ipynb" and not content["cells"]:
            raise ValueError("a notebook without cells")


def pages(folder: Path) -> list[Path]:
    """Return the pages of the book, without redirects and the theme's templates."""
    found = []
    for file in sorted(folder.resolve().rglob("*.html")):
        if file.relative_to(folder.resolve()).parts[0] == "_static":
            continue
        if 'http-equiv="refresh"' not in file.read_text(encoding="utf-8")[:500].lower():
            found.append(file)
    return found


def listing(folder: Path, file: Path) -> bool:
    """Return whether a page lists a source file."""
    return file.relative_to(folder).parts[0] == "_modules" and file.name != "index.html"


def check_some(folder: Path, files: list[Path], search: bool) -> Book:
    """Check some pages, and the search."""
    with browser() as chromium:
        book = Book(folder, chromium)
        for file in files:
            book.check(file)
        if search:
            book.check_search()
    return book


def check(folder: Path, names: list[str] | None = None) -> Book:
    """Check all pages of a folder, or those that are named, two at a time."""
    folder = folder.resolve()
    files = [folder / name for name in names] if names else pages(folder)
    listings = [] if names else [file for file in files if listing(folder, file)]
    opened = [file for file in files if file not in listings[1:]]
    opened.sort(key=lambda file: file.stat().st_size)
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        parts = [opened[::2], opened[1::2]]
        book, other = pool.map(check_some, [folder] * 2, parts, [not names, False])
    book.join(other)
    if not names:
        for file in listings[1:]:
            book.read(file)
        book.check_links()
    return book


def main() -> int:
    """Check the folder named on the command line."""
    folder = Path(sys.argv[1])
    if find_chromium() is None:
        print("No Chromium was found; on Debian and Ubuntu: apt-get install chromium")
        return 1
    started = time.monotonic()
    book = check(folder, sys.argv[2:])
    print(*book.problems, sep="\n", end="\n" if book.problems else "")
    print(
        f"{len(book.links)} pages in Chromium, {time.monotonic() - started:.0f} s; slowest: "
        f"{book.slowest[1]}, {book.slowest[0]:.2f} s; heaviest: {book.heaviest[1]}, "
        f"{book.heaviest[0] / 1e6:.1f} MB"
    )
    print(f"The book has {len(book.problems) or 'no'} problems in a browser")
    return 1 if book.problems else 0


if __name__ == "__main__":
    sys.exit(main())
