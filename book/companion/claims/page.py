"""The whole ledger as one page: a table that can be searched, and the errata.

What this writes is plain HTML with one short script each, needs no network, and shows
everything where no script runs.
"""

from __future__ import annotations

import html
import inspect
import os
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from book.companion.claims.ledger import (
    Claim,
    Finding,
    Ledger,
    Verdict,
    all_claims,
    badge,
    check,
    check_in_parallel,
    explanation,
    findings_of_the_build,
    table_of_claims,
)

#: Section of the paper that a chapter with claims is about.
SECTIONS = {
    "01_opening": "Sec. I and Table I",
    "02_hayes": "Sec. II, single arm",
    "03_common_arm": "Sec. III.A, common arm",
    "04_dual_arm": "Sec. III.B, dual arm",
    "05_nyquist": "Sec. IV.A, frequency domain",
    "06_controller": "Sec. IV.B, controller",
    "07_simulation": "Sec. IV.C, simulation",
    "08_perturbations": "Appendix",
}
#: What makes the table's filter work.
SCRIPT = Path(__file__).with_name("ledger.js")


def whole_ledger() -> Ledger:
    """Check every registered claim, once a build.

    Returns
    -------
    Ledger
        All claims. A build of the book has checked them before its first page; elsewhere
        each call checks them, which takes most of a minute.
    """
    names = [claim.identifier for claim in all_claims()]
    if findings_of_the_build().keys() >= set(names):
        return check(*names)
    ledger = check_in_parallel()
    if folder := os.environ.get("ARMLOCK_FIGURES"):
        ledger.write(Path(folder))
    return ledger


class Source(NamedTuple):
    """Where the check of a claim is written down.

    Attributes
    ----------
    file : str
        Relative to the project's root.
    line : int
        Where the function starts, its decorator included.
    purpose : str
        First line of its docstring: how the claim was examined.
    text : str
        The function.
    """

    file: str
    line: int
    purpose: str
    text: str


def source(claim: Claim) -> Source:
    """Find the function that checks a claim.

    Examples
    --------
    >>> from book.companion.claims import check
    >>> from book.companion.claims.page import source
    >>> [source(claim).file for claim, _ in check("T1")]
    ['book/companion/claims/table1.py']
    """
    function = inspect.unwrap(claim.check)
    lines, first = inspect.getsourcelines(function)
    root = Path(__file__).resolve().parents[3]
    file = Path(inspect.getsourcefile(function) or "")
    shown = file.relative_to(root).as_posix() if file.is_relative_to(root) else file.name
    purpose = (inspect.getdoc(function) or "").partition("\n")[0]
    return Source(shown, first, purpose, "".join(lines))


def project_url() -> str | None:
    """Return where the sources are published, if the package's metadata say so."""
    try:
        entries = metadata.metadata("armlock").get_all("Project-URL") or []
    except metadata.PackageNotFoundError:
        return None
    addresses = {k.lower(): v for k, _, v in (entry.partition(", ") for entry in entries)}
    found = [addresses[k] for k in ("source", "repository", "homepage") if k in addresses]
    return found[0].rstrip("/") if found else None


def link_to_chapter(claim: Claim) -> str:
    """Return a link from another chapter to a claim in its own chapter's table."""
    name = html.escape(claim.identifier)
    return f'<a href="{claim.chapter}.html#claim-{name}">{name}</a>'


class VerdictCounts:
    """How many claims of a ledger met each verdict, as one line.

    Examples
    --------
    >>> from book.companion.claims import check
    >>> from book.companion.claims.page import VerdictCounts
    >>> VerdictCounts(check("T1", "T2"))
    1 reproduced, 1 not as written
    """

    def __init__(self, ledger: Ledger) -> None:
        self.counts = ledger.counts()

    def __repr__(self) -> str:
        """Return the line as text."""
        return ", ".join(f"{self.counts[v]} {v}" for v in Verdict if self.counts[v])

    def _repr_html_(self) -> str:
        """Return the line as HTML."""
        parts = "".join(
            badge(v, f"{self.counts[v]} {v}") + " " for v in Verdict if self.counts[v]
        )
        total = sum(self.counts.values())
        return f'<p class="verdict-counts">{total} claims: {parts}</p>'


class LedgerPage:
    """A ledger as a table that a reader can filter by verdict, section and words.

    Parameters
    ----------
    ledger : Ledger
        The claims and their findings.

    Notes
    -----
    The folder that the environment variable ARMLOCK_FIGURES names, if there is one, gets the
    ledger as claims.csv and claims.json, which the page then links to.
    """

    def __init__(self, ledger: Ledger) -> None:
        self.ledger = ledger
        folder = os.environ.get("ARMLOCK_FIGURES")
        self.files = [path.name for path in ledger.write(Path(folder))] if folder else []

    def __repr__(self) -> str:
        """Return the table as text."""
        return repr(self.ledger)

    def _repr_html_(self) -> str:
        """Return controls, table and script."""
        rows = "".join(_row(claim, finding) for claim, finding in self.ledger)
        links = " · ".join(
            f'<a href="../figures/{name}" download>{name}</a>' for name in self.files
        )
        downloads = f'<p class="figure-downloads">The ledger as data: {links}</p>'
        return (
            f'<div class="ledger">{_controls(self.ledger)}'
            f"{table_of_claims(rows)}{downloads if links else ''}</div>"
            f"<script>{SCRIPT.read_text('utf-8')}</script>"
        )


def _controls(ledger: Ledger) -> str:
    """Return the form above the table, hidden until the script is there to serve it."""
    counts = ledger.counts()
    boxes = "".join(
        f'<label><input type="checkbox" name="verdict" value="{v.name.lower()}" checked> '
        f"{badge(v, f'{v} ({counts[v]})')}</label>"
        for v in Verdict
        if counts[v]
    )
    sections = dict.fromkeys(SECTIONS[claim.chapter] for claim, _ in ledger)
    options = "".join(f"<option>{html.escape(name)}</option>" for name in sections)
    return (
        '<form class="ledger-filter" hidden><fieldset><legend>Verdicts</legend>'
        f"{boxes}</fieldset>"
        '<label>Section <select name="section"><option value="">all</option>'
        f"{options}</select></label>"
        '<label>Search <input type="search" name="words" autocomplete="off"></label>'
        '<button type="reset">Show all</button>'
        f'<p><output role="status">{len(ledger)} of {len(ledger)} claims</output></p></form>'
    )


def _row(claim: Claim, finding: Finding) -> str:
    """Return one row of the table."""
    escape, name = html.escape, html.escape(claim.identifier)
    place, url = source(claim), project_url()
    where = f"{place.file}, line {place.line}"
    if url:
        where = f'<a href="{escape(url)}/blob/main/{place.file}#L{place.line}">{where}</a>'
    return (
        f'<tr id="ledger-{name}" data-verdict="{finding.verdict.name.lower()}" '
        f'data-section="{escape(SECTIONS[claim.chapter])}">'
        f"<td>{link_to_chapter(claim)}<br>{badge(finding.verdict, finding.verdict)}"
        f"<br><small>{escape(claim.place)}</small></td><td>{explanation(claim, finding)}"
        f"<details><summary>Source of {name}</summary><p>{where}</p>"
        f'<pre tabindex="0">{escape(place.text)}</pre></details></td></tr>'
    )


class Errata:
    """What was not simply reproduced: printed, derived, how it was found, what it affects.

    Parameters
    ----------
    ledger : Ledger
        The claims and their findings.
    *verdicts : Verdict
        Which ones to take; by default "not as written" and "differs".
    """

    def __init__(self, ledger: Ledger, *verdicts: Verdict) -> None:
        chosen = verdicts or (Verdict.NOT_AS_WRITTEN, Verdict.DIFFERS)
        self.entries = [entry for entry in ledger if entry[1].verdict in chosen]
        self.known = {claim.identifier: (claim, finding) for claim, finding in ledger}

    def __len__(self) -> int:
        """Return how many errata there are."""
        return len(self.entries)

    def __repr__(self) -> str:
        """Return the table as text."""
        return "\n".join(
            f"{c.identifier:4s} {c.place}: {f.value:.6g} ({f.quantity})"
            for c, f in self.entries
        )

    def _repr_html_(self) -> str:
        """Return one block an erratum; a table of four columns would not fit a phone."""
        return "".join(self._block(*entry) for entry in self.entries)

    def _block(self, claim: Claim, finding: Finding) -> str:
        known = [self.known[name] for name in claim.affects if name in self.known]
        affects = ", ".join(f"{link_to_chapter(c)} ({f.verdict})" for c, f in known)
        parts = {
            "Printed": html.escape(claim.says),
            "Deciding number": f"<strong>{finding.value:.6g}</strong>: "
            f"{html.escape(finding.quantity)}.",
            "What follows": html.escape(finding.note),
            "How it was found": html.escape(source(claim).purpose),
            "What depends on it": affects,
        }
        items = "".join(
            f"<dt>{name}</dt><dd>{text}</dd>" for name, text in parts.items() if text
        )
        return (
            f'<section class="erratum" id="erratum-{claim.identifier}">'
            f"<p><strong>{link_to_chapter(claim)}, {html.escape(claim.place)}</strong> "
            f"{badge(finding.verdict, finding.verdict)}</p><dl>{items}</dl></section>"
        )
