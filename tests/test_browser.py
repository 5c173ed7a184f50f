"""The check in a browser finds what it is there to find; the built book passes it."""

from pathlib import Path

import pytest

from tools import check_browser

ROOT = Path(__file__).parents[1]

needs_chromium = pytest.mark.skipif(
    check_browser.find_chromium() is None,
    reason="no Chromium found: the book is not looked at in a browser",
)

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>A page</title>
<meta name="viewport" content="width=device-width"></head>
<body><main><h1 id="top">A page</h1>{}</main></body></html>"""
GOOD = """<p><a href="#top">Up</a>, <a href="table.csv" download>data</a>, and
<code>$\\frac$</code> in code.</p><img src="data:," alt="A curve">
<figure><output id="shown">1</output><label>Gain <input type="range" id="gain"
oninput="document.getElementById('shown').textContent = this.value"></label></figure>
<p data-check="hover" onmousemove="this.textContent = 'here'">Move over this.</p>"""
FAULTS = {
    "raw TeX": (r"<p>The root \(s = 0\).</p>", "raw TeX"),
    "dollars": ("<p>The root $s_1$.</p>", "raw TeX"),
    "an unread role": ("<p>See {numref}`fig`.</p>", "raw TeX"),
    "no alternative text": ('<img src="data:,">', "no alternative text"),
    "a broken link": ('<a href="missing.html">There</a>', "broken link"),
    "a broken anchor": ('<a href="#missing">There</a>', "broken anchor"),
    "a broken download": ('<a href="ragged.csv">data</a>', "does not open"),
    "an error of a script": ("<script>missing()</script>", "script error"),
    "an error on the console": ("<script>console.error('no')</script>", "console: no"),
    "the network": ('<script src="http://192.0.2.1/x.js"></script>', "asks the network"),
    "a wide page": ('<div style="width: 900px">wide</div>', "scrolls sideways"),
    "pale text": ('<p style="color: #ddd; background: #fff">pale</p>', "contrast"),
    "a dead slider": ('<figure><input type="range" aria-label="x"></figure>', "a slider"),
    "nothing under the pointer": ('<p data-check="hover">still</p>', "to the pointer"),
    "nothing under a finger": (
        '<p data-check="hover" onpointermove="if (event.pointerType === \'mouse\') '
        "this.textContent = 'here'\">Move over this.</p>",
        "to a finger",
    ),
}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Problems of a folder with one good page and one for each fault, by page."""
    folder = tmp_path_factory.mktemp("pages")
    (folder / "table.csv").write_text("omega [rad/s]\n1\n")
    (folder / "ragged.csv").write_text("omega [rad/s]\n1,2\n")
    (folder / "good.html").write_text(PAGE.format(GOOD))
    for number, (body, _) in enumerate(FAULTS.values()):
        (folder / f"fault{number}.html").write_text(PAGE.format(body))
    return check_browser.check(folder).problems


@needs_chromium
def test_a_good_page_passes(found):
    assert [problem for problem in found if problem.startswith(("good", "table"))] == []


@needs_chromium
@pytest.mark.parametrize("fault", FAULTS)
def test_it_finds(fault, found):
    name = f"fault{list(FAULTS).index(fault)}.html"
    own = [p for p in found if p.startswith((name, "ragged.csv"))]
    assert any(FAULTS[fault][1] in problem for problem in own), own


def newer_sources(index):
    """Return sources of the book that have changed since it was built."""
    folders = [ROOT / name for name in ("armlock", "book", "notebooks")]
    files = [f for folder in folders for f in folder.rglob("*.*") if f.is_file()]
    kept = [f for f in files if f.suffix in {".py", ".md", ".ipynb", ".yml", ".css", ".js"}]
    since = index.stat().st_mtime
    return [f for f in kept if f.stat().st_mtime > since and ".ipynb_" not in str(f)]


@needs_chromium
def test_the_built_book_passes():
    index = ROOT / "build" / "html" / "index.html"
    if not index.exists():
        pytest.skip("build/html is not there yet: make book, then make browser looks at it")
    if newer := newer_sources(index):
        pytest.skip(f"build/html is older than {newer[0].name}; make browser builds it anew")
    assert check_browser.check(index.parent).problems == []
