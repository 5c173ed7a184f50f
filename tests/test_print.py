"""Lines of text and formulas, the printed book, and two makes in one folder."""

import subprocess
import sys
from pathlib import Path

from tests.test_browser import needs_chromium
from tools.check_browser import browser
from tools.print_book import LINKS, STYLE, main

ROOT = Path(__file__).parents[1]
PAGE = """<html><head><link rel="stylesheet" href="../_static/a.css"></head><body><article>
<p id="id2">first</p> <a href="notebooks/00_front.html#fig">Fig. 1</a> <a href="#id2">[A]</a>
<a href="../figures/a.csv">CSV</a> <a href="https://example.org">out</a>
<a href="notebooks/00_front.html#nowhere">Fig. 2</a>
<a href="#document-notebooks/00_front">front</a>
<div class="live"><a href="live.html#s=dual">open</a></div>
<figure id="fig"></figure><div class="citation" id="id2">A</div></article></body></html>"""
FOOT = "<p>Code: MIT License.</p>"
LINE = """<article class="bd-content bd-article"><p style="width: 100px">At ({}), and {}.</p>
</article>"""
FORMULA = '<span class="math"><mjx-container style="display: inline-block"><i style="{}">x</i>'
FORMULA += "</mjx-container></span>"


@needs_chromium
def test_a_formula_stays_with_its_comma_and_scrolls_where_it_is_wide():
    wide = "display: inline-block; width: 300px"
    style, script = ((ROOT / f"book/_static/armlock.{s}").read_text() for s in ("css", "js"))
    with browser() as chromium:
        page = chromium.new_page()
        line = LINE.format(FORMULA.format(""), FORMULA.format(wide))
        page.set_content(f"{line}<style>{style}</style><script>{script}</script>")
        page.wait_for_selector("mjx-container.wide[data-more]")
        assert page.locator(".unbroken").all_inner_texts() == ["(x),", "x."]
        assert page.evaluate("document.querySelector('p').scrollWidth") == 100
        page.evaluate("document.querySelector('.wide').scrollLeft = 300")
        page.wait_for_selector("mjx-container.wide:not([data-more])")


@needs_chromium
def test_references_of_the_printed_book_lead_somewhere(tmp_path, monkeypatch, capsys):
    single, book = tmp_path / "single", tmp_path / "book"
    (single / "notebooks").mkdir(parents=True)
    (book / "notebooks").mkdir(parents=True)
    (single / "notebooks" / "00_front.html").write_text(PAGE)
    (book / "notebooks" / "01.html").write_text(FOOT)
    monkeypatch.setattr(sys, "argv", ["print_book", str(single), str(book)])
    assert main() == 1
    broken, _ = capsys.readouterr().out.splitlines()
    assert broken == "armlock.pdf: a reference leads nowhere: notebooks/00_front.html#nowhere"
    assert (book / "armlock.pdf").read_bytes().startswith(b"%PDF")
    assert '<a href="../armlock.pdf">' in (book / "notebooks" / "01.html").read_text()


@needs_chromium
def test_what_a_page_keeps_folded_is_printed():
    with browser() as chromium:
        page = chromium.new_page()
        page.set_content(
            "<article><details><summary>claim</summary>verdict</details>"
            "<details class='hide'><summary>Show code</summary>code</details>"
            "<p>Point at this chart:</p><div class='live'>chart</div></article>"
        )
        page.add_style_tag(content=STYLE)
        page.evaluate(LINKS, "front")
        assert page.inner_text("article").split() == ["claim", "verdict", "code"]


def test_a_second_make_waits_for_the_first(tmp_path):
    command = [sys.executable, str(ROOT / "tools" / "alone.py"), str(tmp_path / "lock")]
    slow = [*command, "sh", "-c", "echo started; sleep 1"]
    with subprocess.Popen(slow, stdout=subprocess.PIPE) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == b"started\n"
        second = subprocess.run([*command, "echo", "done"], capture_output=True, text=True)
        assert first.poll() == 0
    assert second.stdout == "Another make is building here: waiting for it ...\ndone\n"
