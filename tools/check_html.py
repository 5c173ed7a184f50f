"""Check that the built book asks nothing of the network, and is not too large.

Usage: python tools/check_html.py FOLDER

Every script, style sheet, font, image, frame and other part that a page loads by itself must
be a file in the folder, and must exist. Links that a reader may follow can lead anywhere,
but those that stay within the book must lead to a page that exists.

The book, of twenty-one chapters, is to stay below 30 MB, and a figure's SVG below 2 MB: dense
curves are rasterised in it. What each page weighs is checked in a browser.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What a link says of its target when it is not loaded: it is somewhere to go.
NOT_LOADED = {"alternate", "author", "canonical", "help", "license", "next", "prev", "search"}
LARGEST_BOOK, LARGEST_FIGURE = 30e6, 2e6  # bytes
CSS_URL = re.compile(r"""@import\s+["']([^"']+)|url\(\s*["']?([^"')]+)""")


class Page(HTMLParser):
    """Collect what a page loads, and the pages that it links to."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Read the attributes of one element."""
        values = {name: value for name, value in attrs if value}
        goes = tag == "a" or NOT_LOADED & set(values.get("rel", "").lower().split())
        for name in ("href", "xlink:href", "src", "srcset", "poster", "data"):
            if name in values:
                (self.linked if goes else self.loaded).append(values[name])
        self.loaded += css_urls(values.get("style", ""))

    def handle_data(self, data: str) -> None:
        """Read style sheets within the page."""
        if self.cdata_elem == "style":
            self.loaded += css_urls(data)


def css_urls(text: str) -> list[str]:
    """Return the addresses that a style sheet loads."""
    return [a or b for a, b in CSS_URL.findall(text)]


def problem(file: Path, address: str) -> str | None:
    """Say what is wrong with an address that a file names, if anything is."""
    parts = urlsplit(address.strip())
    if parts.scheme in {"data", "about", "javascript"}:
        return None
    if parts.scheme or parts.netloc:
        return f"loads {address} from the network"
    if parts.path.startswith("/"):
        return f"names {address}, which is not relative"
    if parts.path and not (file.parent / unquote(parts.path)).exists():
        return f"names {address}, which does not exist"
    return None


def pages(folder: Path) -> list[Path]:
    """Return the pages of the book; among the static files lie templates of the theme."""
    return sorted(
        f for f in folder.rglob("*.html") if f.relative_to(folder).parts[0] != "_static"
    )


def check(folder: Path) -> list[str]:
    """Return all problems of the pages and style sheets in a folder."""
    problems = []
    for file in [*pages(folder), *sorted(folder.rglob("*.css"))]:
        text = file.read_text(encoding="utf-8")
        if file.suffix == ".css":
            loaded, linked = css_urls(text), []
        else:
            page = Page()
            page.feed(text)
            loaded = page.loaded
            linked = [a for a in page.linked if not urlsplit(a).scheme and a[:2] != "//"]
        for address in dict.fromkeys([*loaded, *linked]):
            if found := problem(file, address):
                problems.append(f"{file.relative_to(folder)} {found}")
    return problems


def sizes(folder: Path) -> list[str]:
    """Return what is too large in a folder."""
    files = {f: f.stat().st_size for f in folder.rglob("*") if f.is_file()}
    found = [(folder, sum(files.values()), LARGEST_BOOK)]
    found += [(f, size, LARGEST_FIGURE) for f, size in files.items() if f.suffix == ".svg"]
    return [
        f"{name} has {size / 1e6:.1f} MB, more than {largest / 1e6:.0f}"
        for name, size, largest in found
        if size > largest
    ]


def main() -> int:
    """Check the folder named on the command line."""
    folder = Path(sys.argv[1])
    problems = check(folder) + sizes(folder)
    print(*problems, sep="\n", end="\n" if problems else "")
    verdict = f"have {len(problems)} problems" if problems else "need no network"
    print(f"{len(pages(folder))} pages in {folder} {verdict}")
    return 1 if problems or not (folder / "index.html").is_file() else 0


if __name__ == "__main__":
    sys.exit(main())
