"""Check the files of the built book: what they name is there, and they are not too large.

Usage: python tools/check_html.py FOLDER

Every script, style sheet, font, image, frame and other part that a page loads by itself must
be a file in the folder, and must exist. Links that a reader may follow can lead anywhere,
but those that stay within the book must lead to a page and an anchor that exist, and files that
are offered must open. A chapter offers its source.

A figure's SVG stays below 2 MB: dense curves are rasterised in it.
"""

import csv
import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What a link says of its target when it is not loaded: it is somewhere to go.
NOT_LOADED = {"alternate", "author", "canonical", "help", "license", "next", "prev", "search"}
OPENED = {".csv", ".png", ".svg", ".ipynb", ".json"}
LARGEST_FIGURE = 2e6  # bytes
CSS_URL = re.compile(r"""@import\s+["']([^"']+)|url\(\s*["']?([^"')]+)""")


class Page(HTMLParser):
    """What a page loads, what it links to within the book, and its anchors."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []
        self.anchors: set[str] = set()
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Read the attributes of one element."""
        values = {name: value for name, value in attrs if value}
        goes = tag == "a" or NOT_LOADED & set(values.get("rel", "").lower().split())
        names = ("href", "xlink:href", "src", "srcset", "poster", "data")
        named = [values[name] for name in names if name in values]
        if not goes:
            self.loaded += named
        else:
            self.linked += [a for a in named if not urlsplit(a).scheme and a[:2] != "//"]
        self.loaded += css_urls(values.get("style", ""))
        self.anchors |= {values[name] for name in ("id", "name") if name in values}

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
    """Return all problems of the pages, style sheets and offered files in a folder."""
    folder = folder.resolve()
    read = {file: Page(file) for file in pages(folder)}
    named = {file: [*page.loaded, *page.linked] for file, page in read.items()}
    named |= {file: css_urls(file.read_text("utf-8")) for file in sorted(folder.rglob("*.css"))}
    found = [
        (file, problem(file, address))
        for file, addresses in named.items()
        for address in dict.fromkeys(addresses)
    ]
    offered = set()
    for file, page in read.items():
        for link in dict.fromkeys(page.linked):
            parts = urlsplit(link)
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            anchor = unquote(parts.fragment)
            if anchor and target in read and anchor not in read[target].anchors:
                found.append((file, f"has a broken anchor, {link}"))
            if target.suffix in OPENED and target.is_file():
                offered.add(target)
        if file.parent.name == "notebooks" and not any(
            a.endswith((".ipynb", ".md")) for a in page.linked
        ):
            found.append((file, "has no link to download its source"))
    found += [(file, unread(file)) for file in sorted(offered)]
    return [f"{file.relative_to(folder)} {what}" for file, what in found if what]


def unread(file: Path) -> str | None:
    """Say why a file that the book offers does not open, if it does not."""
    try:
        read_download(file)
    except (ValueError, SyntaxError, OSError, KeyError) as error:
        return f"does not open: {error}"
    return None


def read_download(file: Path) -> None:
    """Open a file that the book offers, or raise."""
    if file.suffix == ".csv":
        with file.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        if len(rows) < 2 or any(len(row) != len(rows[0]) for row in rows):
            raise ValueError("not a table with a header")
    elif file.suffix == ".svg":
        ElementTree.parse(file)
    elif file.suffix == ".png":
        if not file.read_bytes().startswith(b"\x89PNG\r\n\x1a\n"):
            raise ValueError("not a PNG")
    else:
        content = json.loads(file.read_text(encoding="utf-8"))
        if file.suffix == ".ipynb" and not content["cells"]:
            raise ValueError("a notebook without cells")


def sizes(folder: Path) -> list[str]:
    """Return the figures in a folder that are too large."""
    files = {file: file.stat().st_size for file in folder.rglob("*.svg")}
    return [
        f"{file} has {size / 1e6:.1f} MB, more than {LARGEST_FIGURE / 1e6:.0f}"
        for file, size in files.items()
        if size > LARGEST_FIGURE
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
