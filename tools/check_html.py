"""Check that the built book asks nothing of the network.

Usage: python tools/check_html.py FOLDER

Every script, style sheet, font, image, frame and other part that a page loads by itself must
be a file in the folder, and must exist. Links that a reader may follow can lead anywhere,
but those that stay within the book must lead to a page that exists.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes that a browser fetches without being asked. (A link's rel decides: see below.)
LOADED = {
    "audio": ["src"],
    "embed": ["src"],
    "iframe": ["src"],
    "image": ["href", "xlink:href"],
    "img": ["src", "srcset"],
    "input": ["src"],
    "object": ["data"],
    "script": ["src"],
    "source": ["src", "srcset"],
    "track": ["src"],
    "use": ["href", "xlink:href"],
    "video": ["src", "poster"],
}
LINKS_NOT_LOADED = {"alternate", "author", "canonical", "help", "index", "license"}
LINKS_NOT_LOADED |= {"next", "prev", "search"}
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
        for name in LOADED.get(tag, []):
            if name in values:
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


def main() -> int:
    """Check the folder named on the command line."""
    folder = Path(sys.argv[1])
    if not (folder / "index.html").is_file():
        print(f"{folder} holds no index.html")
        return 1
    problems = check(folder)
    print(*problems, sep="\n", end="\n" if problems else "")
    verdict = "need no network" if not problems else f"have {len(problems)} problems"
    print(f"{len(pages(folder))} pages in {folder} {verdict}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
