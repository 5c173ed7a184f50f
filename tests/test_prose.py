"""No number in the prose is typed: it is computed in the run, or quoted from a named source.

`quoted_numbers.csv` lists, for each page, the numbers that are written out and where they come
from: a place in the paper or in a cited source, or "set here" for what the page's code sets,
such as the end of a sweep, "set in FILE" for another file; such a number must be there. Not
looked at are formulas set apart, code, the numbers of equations, figures, sections and claims,
and whole numbers up to twelve that have no unit.
"""

import csv
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LIST = Path(__file__).with_name("data") / "quoted_numbers.csv"
# The page on clusters tells times that were measured on one machine.
PAGES = sorted({*ROOT.glob("notebooks/*.ipynb"), *ROOT.glob("book/*.md")})
PAGES.remove(ROOT / "book" / "cluster.md")

# A block, and those that hold prose; what else holds no number of it, in the order in which it
# is taken out.
BLOCK = re.compile(
    r"^(`{3,}|:{3,})(\{[\w:-]+\})?[^\n]*\n(.*?)^\1\s*$", re.DOTALL | re.MULTILINE
)
WITH_PROSE = {"{admonition}", "{glue:figure}", "{note}"}
NO_PROSE = [
    r"(?<=\n\n) {4,}\S.*?$",
    r"^:(?!alt)\w+:.*?$",
    r"\{[\w:]+\}`[^`]*`",
    r"`[^`]*`",
    r"\{\w+:[^{}]*\}",
    r"\]\([^)]*\)",
    r"https?://\S+",
    r"\b[Cc]laims?\s+[A-Z]\d+(?:(?:,\s+and|,|\s+and|\s+to)\s+[A-Z]\d+)*",
    r"\b(?:Eqs?|Figs?|Secs?|Tables?|Stages?|Chapters?|Parts?|[Ee]xercises?|Theorem|Area|Region)"
    r"\.?\s+\(?[\dIVX]+[a-z]?\)?(?:\.[A-Z\d]\b)?(?:(?:,|\s+and|\s+to)\s+\(?\d+[a-z]?\)?)*",
    r"\(\d+\)|\*\*\d+\.\*\*|^\d+\. ",
    r"(?:_|(?<!10)\^)(?:\{[^{}]*\}|\\mathrm\{\w+\}|\w)",
]
NUMBER = re.compile(
    r"10\^\{?-?\d+\}?|10[⁻¹²³⁴⁵⁶⁷⁸⁹]+"
    r"|(?<![\w.\\])(?:\d+(?: \d{3}\b)+|\d+(?:\.\d+)?)(?:e[-+]?\d+)?"
)
UNIT = re.compile(
    r"\s*(?:\$|\\[,;]|~)*\s*(?:%|per ?cent|(?:[kMGmµn]?(?:Hz|m|s|W)|rad|days?|hours?|minutes?|"
    r"seconds?|degrees?|thousand|million)(?:\b|/|\$))"
)


def prose(page):
    """Return the text of a page, its captions and alternative texts included."""
    if page.suffix == ".md":
        return page.read_text(encoding="utf-8")
    texts = []
    for cell in json.loads(page.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "markdown":
            texts.append("".join(cell["source"]))
        shown = cell["metadata"].get("mystnb", {})
        texts.append(shown.get("figure", {}).get("caption", ""))
        texts.append(shown.get("image", {}).get("alt", ""))
    return "\n\n".join(texts)


def written(text):
    """Return the numbers that a text writes out."""
    text = BLOCK.sub(lambda block: block[3] if block[2] in WITH_PROSE else " ", text)
    for pattern in NO_PROSE:
        text = re.sub(pattern, " ", text, flags=re.DOTALL | re.MULTILINE)
    found = []
    for number in NUMBER.finditer(text):
        small = number[0].isascii() and number[0].isdigit() and int(number[0]) <= 12
        if not small or UNIT.match(text, number.end()):
            found.append((number[0], text[max(0, number.start() - 50) : number.end() + 25]))
    return found


def digits(number):
    """Return the digits of a number without its power of ten: 0.1 mHz may be set as 1e-4."""
    plain = re.sub(r"10\^\{?(-?\d+)\}?", r"1e\1", re.sub("[ _]", "", number))
    plain = re.sub("10([⁻¹²³⁴⁵⁶⁷⁸⁹]+)", "1", plain)
    return f"{abs(float(plain)):e}".split("e")[0]


def code(page, source):
    """Return the code that sets a number."""
    if source != "set here":
        return (ROOT / source.removeprefix("set in ")).read_text(encoding="utf-8")
    cells = json.loads(page.read_text(encoding="utf-8"))["cells"]
    return "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")


def listed(page):
    """Return the numbers that the list has for a page, and their sources."""
    with LIST.open(encoding="utf-8") as stream:
        rows = csv.DictReader(stream)
        return {row["number"]: row["source"] for row in rows if row["page"] == page.stem}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_each_number_is_computed_or_quoted(page):
    found, known = written(prose(page)), listed(page)
    unknown = [f"{number}: ...{around}..." for number, around in found if number not in known]
    assert not unknown, "\n".join(unknown)
    stale = known.keys() - {number for number, _ in found}
    assert not stale, f"listed, and not on the page: {stale}"
    for number, source in known.items():
        assert source, number
        if source.startswith("set "):
            there = re.findall(r"\d+(?:_\d+)*(?:\.\d+)?", code(page, source))
            assert digits(number) in map(digits, there), f"{number} is not {source}"
