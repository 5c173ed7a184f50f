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
GOOD = """<p><a href="#top">Up</a>, and <code>$\\frac$</code> in code.</p>
<img src="data:," alt="A curve"><figure>
<output id="shown">1</output><label>Gain <input type="range" id="gain"
oninput="document.getElementById('shown').textContent = this.value"></label></figure>
<p data-check="hover" onmousemove="this.textContent = 'here'">Move over this.</p>"""
#: All on one page, each with what is to be said of it.
FAULTS = {
    r"<p>The root \(s = 0\).</p>": r"raw TeX: The root \(s",
    "<p>The root $s_1$.</p>": "raw TeX: The root $s_1$",
    "<p>See {numref}`fig`.</p>": "raw TeX: See {numref}",
    '<img src="data:,">': "axe, light: Images must have alternative text",
    "<script>missing()</script>": "script error: missing is not defined",
    "<script>console.error('no')</script>": "console: no",
    '<script src="http://192.0.2.1/x.js"></script>': "asks the network for http://192",
    '<style>[data-theme="dark"] i { background: #fff; color: #ccc }</style><i>pale</i>': (
        "axe, dark: Elements must meet minimum color contrast"
    ),
    '<p style="color: #ddd; background: #fff">pale</p>': (
        "axe, light: Elements must meet minimum color contrast"
    ),
    '<div style="width: 900px">wide</div>': "scrolls sideways at 390",
    f'<pre style="overflow: auto">{200 * "code"}</pre>': "cut without a hint at 390 px: code",
    f'<div style="overflow: hidden"><table><td>{200 * "cell"}</table></div>': (
        "cut without a hint at 390 px: cell"
    ),
    '<p><mjx-container class="wide" data-more style="display: inline-block; width: 2em; '
    'overflow: auto">formula</mjx-container></p>': "cut in a line with room at 390 px: formula",
    '<figure><input type="range" aria-label="x" id="dead"></figure>': (
        "a slider changes nothing: dead"
    ),
    '<p data-check="hover">still</p>': "to the pointer does not",
}


@needs_chromium
def test_it_finds_each_fault_and_none_on_a_good_page(tmp_path, monkeypatch):
    monkeypatch.setattr(check_browser, "POKES", 5)
    monkeypatch.setattr(check_browser, "PATIENCE", 0.5)
    (tmp_path / "good.html").write_text(PAGE.format(GOOD))
    (tmp_path / "bad.html").write_text(PAGE.format("\n".join(FAULTS)))
    found = check_browser.check(tmp_path, check_browser.pages(tmp_path), search=False)
    assert [problem for problem in found if problem.startswith("good")] == []
    for fault, sign in FAULTS.items():
        assert any(sign in problem for problem in found), (fault, sign, found)
