"""Check that the built book asks nothing of the network, and is not too large.

Usage: python tools/check_html.py FOLDER

Every script, style sheet, font, image, frame and other part that a page loads by itself must
be a file in the folder, and must exist. Links that a reader may follow can lead anywhere,
but those that stay within the book must lead to a page that exists.

The book is to stay below 25 MB, and a figure's SVG below 2 MB: dense curves are rasterised in
it. What each page weighs is checked in a browser.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes that a browser fetches without being asked. (A link's rel decides: see below.)
LOADED = {"src", "srcset", "poster"}
DRAWN = {"image", "use"}  # of SVG: they load what their href names
LINKS_NOT_LOADED = {"alternate", "author", "canonical", "help", "index", "license"}
LINKS_NOT_LOADED |= {"next", "prev", "search"}
LARGEST_BOOK, LARGEST_FIGURE = 25e6, 2e6  # bytes
CSS_URL = re.compile(r"""@import\s+["']([^"']+)|url\(\s*["']?([^"')]+)""")


class Page(HTMLParser):
    """Collect what a page loads, and the pages that it links to."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []
        self.in_style = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Read the attributes of one element."""
        values = {name: value for name, value in attrs if value}
        self.in_style = tag == "style"
        if tag == "a" and "href" in values:
            self.linked.append(values["href"])
        if tag == "link" and "href" in values:
            rel = set(values.get("rel", "").lower().split())
            if not rel & LINKS_NOT_LOADED:
                self.loaded.append(values["href"])
        if tag == "object" and "data" in values:
            self.loaded.append(values["data"])
        if tag in DRAWN:
            self.loaded += [values[k] for k in ("href", "xlink:href") if k in values]
        for name in LOADED & values.keys():
            parts = values[name].split(",") if name == "srcset" else [values[name]]
            self.loaded += [part.split()[0] for part in parts if part.strip()]
        if "style" in values:
            self.loaded += css_urls(values["style"])

    def handle_endtag(self, tag: str) -> None:
        """Note the end of a style element."""
        if tag == "style":
            self.in_style = False

    def handle_data(self, data: str) -> None:
        """Read style sheets within the page."""
        if self.in_style:
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
    problems = []
    files = [file for file in folder.rglob("*") if file.is_file()]
    found = [("the book", sum(f.stat().st_size for f in files), LARGEST_BOOK)]
    found += [
        (str(f.relative_to(folder)), f.stat().st_size, LARGEST_FIGURE)
        for f in files
        if f.suffix == ".svg"
    ]
    for name, size, largest in found:
        if size > largest:
            problems.append(f"{name} has {size / 1e6:.1f} MB, more than {largest / 1e6:.0f}")
    return problems


def main() -> int:
    """Check the folder named on the command line."""
    folder = Path(sys.argv[1])
    if not (folder / "index.html").is_file():
        print(f"{folder} holds no index.html")
        return 1
    problems = check(folder) + sizes(folder)
    print(*problems, sep="\n", end="\n" if problems else "")
    total = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) / 1e6
    fine = f"need no network, {total:.1f} MB in all"
    verdict = f"have {len(problems)} problems" if problems else fine
    print(f"{len(pages(folder))} pages in {folder} {verdict}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
