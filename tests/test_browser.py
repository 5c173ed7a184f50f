"""The check in a browser finds what it is there to find; `make browser` runs it on the book."""

import pytest

from tools import check_browser

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
    "text that is pale in the dark": (
        '<style>[data-theme="dark"] p { background: #fff; color: #ccc }</style><p>pale</p>',
        "axe, dark",
    ),
    "a wide page": ('<div style="width: 900px">wide</div>', "scrolls sideways"),
    "cut code": (
        '<pre style="overflow: auto">' + 200 * "wide" + "</pre>",
        "cut without a hint",
    ),
    "a cut table": (
        '<div style="overflow: hidden"><table><td>' + 200 * "wide" + "</table></div>",
        "cut without a hint",
    ),
    "pale text": ('<p style="color: #ddd; background: #fff">pale</p>', "contrast"),
    "a dead slider": ('<figure><input type="range" aria-label="x"></figure>', "a slider"),
    "nothing under the pointer": ('<p data-check="hover">still</p>', "to the pointer"),
    "nothing under a finger": (
        '<p data-check="hover" onpointermove="if (event.pointerType === \'mouse\') '
        "this.textContent = 'here'\">Move over this.</p>",
        "to a finger",
    ),
}


@needs_chromium
def test_it_finds_each_fault_and_none_on_a_good_page(tmp_path):
    (tmp_path / "table.csv").write_text("omega [rad/s]\n1\n")
    (tmp_path / "ragged.csv").write_text("omega [rad/s]\n1,2\n")
    (tmp_path / "good.html").write_text(PAGE.format(GOOD))
    for number, (body, _) in enumerate(FAULTS.values()):
        (tmp_path / f"fault{number}.html").write_text(PAGE.format(body))
    found = check_browser.check(tmp_path).problems
    assert [problem for problem in found if problem.startswith(("good", "table"))] == []
    for number, (fault, (_, sign)) in enumerate(FAULTS.items()):
        own = [p for p in found if p.startswith((f"fault{number}.html", "ragged.csv"))]
        assert any(sign in problem for problem in own), (fault, own)
