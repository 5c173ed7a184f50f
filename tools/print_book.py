"""Print the book as one PDF, with numbered figures and references that lead somewhere.

Usage: python -m tools.print_book SINGLEHTML BOOK

SINGLEHTML is what Sphinx's builder of this name has made, BOOK the folder of the built HTML,
which gets the file armlock.pdf, a link to it at the foot of each page, and sheet.pdf, the page
to pin to the wall. Chromium prints.
"""

import os
import sys
from pathlib import Path

from tools.check_browser import TYPESET, browser, find_chromium

NAME = "armlock.pdf"
SHEET = "notebooks/16_summary.html"
FOOT = "Code: MIT License.</p>"
NUMBER = (
    '<div style="width: 100%; font-size: 8px; text-align: center"><span class="pageNumber">'
    "</span></div>"
)
# What has no meaning on paper, and what a page on the screen keeps folded.
STYLE = """
.bd-header, .bd-header-article, .bd-sidebar, .bd-sidebar-secondary, .bd-footer, .headerlink,
.prev-next-footer, .search-button, .live, .copybtn, .skip-link, .pst-async-banner-revealer,
.bd-header-announcement, #pst-back-to-top, .figure-downloads, .ledger-filter, footer, noscript,
script, details.hide > summary, details details, .toggle-button, #contents > h2,
#try-the-readings, p:has(+ .live)
  { display: none !important; }
.bd-page-width, .bd-main, .bd-content, .bd-article-container, .bd-container, .bd-article
  { max-width: none !important; display: block !important; width: auto !important;
    padding: 0 !important; margin: 0 !important; }
[id^="document-"] + section { break-before: page; }
summary { list-style: none; }
figure, .cell_output table tr, .cell_input, pre { break-inside: avoid; }
dt { break-after: avoid; }
pre { white-space: pre-wrap !important; overflow-wrap: anywhere; }
.math, mjx-container, .cell_output, table { overflow: visible !important; }
table { font-size: 80%; }
"""
# Each link leads into this page or out of the book, or it is text. Names such as id2 stand on
# several of the pages that are one here: those of the bibliography get names of their own.
LINKS = """FRONT => {
  document.querySelector("article").id = "document-" + FRONT;
  for (const entry of document.querySelectorAll("div.citation[id]"))
    entry.id = "cite-" + entry.id;
  for (const folded of document.querySelectorAll("details")) folded.open = true;
  const broken = [];
  for (const link of document.querySelectorAll("a[href]")) {
    const href = link.getAttribute("href");
    if (/^[a-z]+:/.test(href)) continue;
    const name = decodeURIComponent(href.split("#")[1] || "");
    const found = ["cite-" + name, name].find(n => n && document.getElementById(n));
    if (found) link.setAttribute("href", "#" + found);
    else {
      link.removeAttribute("href");
      // What is live is not printed.
      if (name && link.closest("article") && !link.closest(".live")) broken.push(href);
    }
  }
  return broken;
}"""


def print_pdf(page_file: Path, front: str, pdf: Path) -> list[str]:
    """Print one page of HTML; return the references in it that lead nowhere."""
    with browser() as chromium:
        page = chromium.new_context(offline=True, color_scheme="light").new_page()
        page.set_default_timeout(300_000)
        page.goto(page_file.as_uri(), wait_until="load")
        page.evaluate(TYPESET)
        page.add_style_tag(content=STYLE)
        broken: list[str] = page.evaluate(LINKS, f"notebooks/{front}")
        page.pdf(
            path=pdf,
            format="A4",
            scale=0.75,
            outline=True,
            tagged=True,
            print_background=True,
            display_header_footer=True,
            header_template="<span></span>",
            footer_template=NUMBER,
            margin={"top": "16mm", "bottom": "18mm", "left": "16mm", "right": "16mm"},
        )
    return broken


def main() -> int:
    """Print the book, and link its pages to the result."""
    single, book = (Path(name).resolve() for name in sys.argv[1:])
    if find_chromium() is None:
        print("no Chromium found to print with: install it, or name it with CHROMIUM")
        return 1
    # The one page stands in the folder of the front page; what it loads is named from above.
    source = next(single.glob("notebooks/*.html"))
    page_file = single / "book.html"
    page_file.write_text(source.read_text().replace("../_static/", "_static/"))
    broken = print_pdf(page_file, source.stem, book / NAME)
    if (book / SHEET).exists():
        print_pdf(book / SHEET, source.stem, book / "sheet.pdf")
    for href in sorted(set(broken)):
        print(f"{NAME}: a reference leads nowhere: {href}")
    for page in book.rglob("*.html"):
        up = os.path.relpath(book, page.parent)
        text = page.read_text()
        if FOOT in text and NAME not in text:
            link = f'{FOOT[:-4]} <a href="{up}/{NAME}">One PDF to print</a>.</p>'
            page.write_text(text.replace(FOOT, link))
    print(f"{book / NAME}: {(book / NAME).stat().st_size / 1e6:.1f} MB")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
