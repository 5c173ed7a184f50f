"""The whole ledger as one page: a table that can be searched, and the errata.

What this writes is plain HTML with one short script each, needs no network, and shows
everything where no script runs.
"""

from __future__ import annotations

import html
import inspect
from collections import Counter
from collections.abc import Callable, Iterable
from importlib import metadata
from pathlib import Path

from book.companion.claims.ledger import (
    Claim,
    Finding,
    Ledger,
    Verdict,
    Weight,
    all_claims,
    badge,
    chapter_of,
    check,
    check_in_parallel,
    ledger_link,
    row,
    table,
    typeset,
)

#: What filters and sorts the table.
SCRIPT = Path(__file__).with_name("ledger.js")


def whole_ledger() -> Ledger:
    """Check every registered claim, once a build or test run.

    Returns
    -------
    Ledger
        All claims. A build of the book has checked them before its first page. Elsewhere each
        process checks them, which takes most of a minute.
    """
    claims = all_claims()
    if all(claim.check.is_stored() for claim in claims):
        return check(*(claim.identifier for claim in claims))
    return check_in_parallel()


def source(claim: Claim) -> tuple[str, int, str]:
    """Return the file of the function that checks a claim, its first line, and its text.

    Examples
    --------
    >>> from book.companion.claims import check
    >>> from book.companion.claims.page import source
    >>> [source(claim)[0] for claim, _ in check("T1")]
    ['book/companion/claims/table1.py']
    """
    function = inspect.unwrap(claim.check)
    lines, first = inspect.getsourcelines(function)
    root = Path(__file__).resolve().parents[3]
    file = Path(inspect.getfile(function)).relative_to(root)
    return file.as_posix(), first, "".join(lines)


def project_url() -> str | None:
    """Return where the sources are published, if the package's metadata say so."""
    try:
        entries = metadata.metadata("armlock").get_all("Project-URL") or []
    except metadata.PackageNotFoundError:
        return None
    addresses = {k.lower(): v for k, _, v in (entry.partition(", ") for entry in entries)}
    found = [addresses[k] for k in ("source", "repository", "homepage") if k in addresses]
    return found[0].rstrip("/") if found else None


class VerdictCounts:
    """How many claims met each verdict: of the paper by weight, and of the white paper.

    Examples
    --------
    >>> from book.companion.claims import check
    >>> from book.companion.claims.page import VerdictCounts
    >>> VerdictCounts(check("S2", "S4"))
    1 claim of physics: 1 reproduced
    1 claim of derivation: 1 reproduced
    """

    def __init__(self, ledger: Ledger) -> None:
        entries: dict[bool, list[tuple[Claim, Finding]]] = {True: [], False: []}
        for claim, finding in ledger:
            entries[not claim.section.startswith("White")].append((claim, finding))
        paper, white = (Ledger(entries[of]) for of in (True, False))
        met = {f"of {weight}": paper.counts(weight) for weight in Weight}
        met["of the white paper"] = white.counts()
        #: What is counted, and how many met each verdict.
        self.lines = [
            (f"{counts.total()} claim{'s' * (counts.total() != 1)} {of}", counts)
            for of, counts in met.items()
            if counts
        ]

    def _met(self, shown: Callable[[Verdict, str], str]) -> list[tuple[str, list[str]]]:
        return [
            (head, [shown(v, f"{met[v]} {v}") for v in Verdict if met[v]])
            for head, met in self.lines
        ]

    def __repr__(self) -> str:
        """Return the lines as text."""
        lines = self._met(lambda verdict, text: text)
        return "\n".join(f"{head}: {', '.join(verdicts)}" for head, verdicts in lines)

    def _repr_html_(self) -> str:
        """Return the lines as HTML."""
        found = [f"{head}: {' '.join(badges)}" for head, badges in self._met(badge)]
        return f'<p class="verdict-counts">{"<br>".join(found)}</p>'


class LedgerPage:
    """A ledger as a table that a reader can sort, and filter by verdict, weight and words.

    Parameters
    ----------
    ledger : Ledger
        The claims and their findings. The page links to claims.csv and claims.json, which
        `make claims` and a build of the book write.
    """

    def __init__(self, ledger: Ledger) -> None:
        self.ledger = ledger

    def _repr_html_(self) -> str:
        """Return controls, table and script."""
        rows = "".join(_row(claim, finding) for claim, finding in self.ledger)
        links = " · ".join(
            f'<a href="../figures/claims.{ending}" download>claims.{ending}</a>'
            for ending in ("csv", "json")
        )
        return (
            f'<div class="ledger">{_controls(self.ledger)}{table(rows)}'
            f'<p class="figure-downloads">The ledger as data: {links}</p></div>'
            f"<script>{SCRIPT.read_text('utf-8')}</script>"
        )


def _controls(ledger: Ledger) -> str:
    """Return the form above the table, hidden until the script is there to serve it."""
    verdicts = Counter(finding.verdict for _, finding in ledger)
    weights = Counter(claim.weight for claim, _ in ledger)

    def boxes(name: str, values: Iterable[tuple[str, str]]) -> str:
        return "".join(
            f'<label><input type="checkbox" name="{name}" value="{value}" checked> {text}'
            "</label>"
            for value, text in values
        )

    shown = [(v.name.lower(), badge(v, f"{v} ({verdicts[v]})")) for v in Verdict if verdicts[v]]
    kinds = [(w.name.lower(), f"{w} ({weights[w]})") for w in Weight if weights[w]]
    sections = dict.fromkeys(claim.section for claim, _ in ledger)
    options = "".join(f"<option>{html.escape(name)}</option>" for name in sections)
    return (
        '<form class="ledger-filter" hidden><fieldset><legend>Verdict</legend>'
        f"{boxes('verdict', shown)}</fieldset><fieldset><legend>About</legend>"
        f"{boxes('weight', kinds)}</fieldset>"
        '<label>Section <select name="section"><option value="">all</option>'
        f"{options}</select></label>"
        '<label>Search <input type="search" name="words" autocomplete="off"></label>'
        '<button type="reset">Show all</button>'
        f'<p><output role="status">{len(ledger)} of {len(ledger)} claims</output></p></form>'
    )


def _row(claim: Claim, finding: Finding) -> str:
    """Return one row of the table, with the source of the check."""
    name, url, (file, line, text) = claim.identifier, project_url(), source(claim)
    where = f"{file}, line {line}"
    if url:
        where = f'<a href="{html.escape(url)}/blob/main/{file}#L{line}">{where}</a>'
    attributes = (
        f'id="ledger-{name}" data-verdict="{finding.verdict.name.lower()}" '
        f'data-weight="{claim.weight}" data-section="{html.escape(claim.section)}"'
    )
    code = (
        f'<p>Shown in its <a href="{chapter_of(name)}.html#claim-{name}">chapter</a>.</p>'
        f"<details><summary>Source of {name}</summary><p>{where}</p>"
        f'<pre tabindex="0">{html.escape(text)}</pre></details>'
    )
    # Links that name one of the other places lead to this row, too.
    others = "".join(f'<span id="ledger-{other}"> {other}</span>' for other in claim.also)
    return row(claim, finding, attributes, ledger_link(name) + others, code)


class Errata:
    """What is printed and does not follow: printed, what follows, and what depends on it.

    Parameters
    ----------
    ledger : Ledger
        The claims and their findings.
    verdict : Verdict
        Which claims to take.
    *weights : Weight
        Of which weight; by default all.
    """

    def __init__(self, ledger: Ledger, verdict: Verdict, *weights: Weight) -> None:
        self.entries = [
            (claim, finding)
            for claim, finding in ledger
            if finding.verdict is verdict and claim.weight in (weights or Weight)
        ]
        self.ledger = ledger

    def __len__(self) -> int:
        """Return how many errata there are."""
        return len(self.entries)

    def __repr__(self) -> str:
        """Return the table as text."""
        return "\n".join(
            f"{c.identifier:4s} {c.place}: {f.shown} ({f.quantity})" for c, f in self.entries
        ).replace("$", "")

    def _repr_html_(self) -> str:
        """Return one block an erratum; a table of four columns would not fit a phone."""
        return "".join(self._block(*entry) for entry in self.entries)

    def _block(self, claim: Claim, finding: Finding) -> str:
        name = claim.identifier
        affected = ((c, f) for c, f in self.ledger if set(c.names) & set(claim.affects))
        parts = {
            "Printed" if claim.printed else "In our words": typeset(
                claim.printed or claim.says
            ),
            "What follows": f"{typeset(finding.quantity)}: "
            f"<strong>{typeset(finding.shown)}</strong>. {typeset(finding.note)}",
            "What depends on it": ", ".join(
                f"{ledger_link(c.identifier)} ({f.verdict})" for c, f in affected
            ),
        }
        items = "".join(
            f"<dt>{term}</dt><dd>{text}</dd>" for term, text in parts.items() if text
        )
        return (
            f'<section class="erratum" id="erratum-{name}"><p><strong>{ledger_link(name)}, '
            f"{typeset(claim.places)}</strong> {badge(finding.verdict)}</p>"
            f"<dl>{items}</dl></section>"
        )
