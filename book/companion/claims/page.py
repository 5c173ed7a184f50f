"""The whole ledger as one page: a table that can be searched, and the errata.

What this writes is plain HTML with one short script each, needs no network, and shows
everything where no script runs.
"""

from __future__ import annotations

import html
import inspect
import os
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
    check,
    check_in_parallel,
    ledger_link,
    row,
    table,
    typeset,
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
    "08a_flight": "White paper, the loop",
    "08b_noise_and_pulling": "White paper, noise and pulling",
}
#: Those of them that are about the paper; the others are about the white paper.
OF_THE_PAPER = [name for name, part in SECTIONS.items() if not part.startswith("White")]
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
    """How many findings of physics met each verdict, and how many others there are.

    Claims with the same finding count once, those of the white paper by themselves.

    Examples
    --------
    >>> from book.companion.claims import check
    >>> from book.companion.claims.page import VerdictCounts
    >>> VerdictCounts(check("T2", "T6"))
    1 finding of physics: 1 reproduced
    Besides, 1 of derivation and 0 of wording
    """

    def __init__(self, ledger: Ledger) -> None:
        entries: dict[bool, list[tuple[Claim, Finding]]] = {True: [], False: []}
        for claim, finding in ledger:
            entries[claim.chapter in OF_THE_PAPER].append((claim, finding))
        paper = Ledger(entries[True])
        physics, white = paper.counts(Weight.PHYSICS), Ledger(entries[False]).counts()
        number = physics.total()
        others = " and ".join(f"{paper.counts(w).total()} of {w}" for w in list(Weight)[1:])
        #: What is counted, and how many met each verdict.
        self.lines = [(f"{number} finding{'s' * (number != 1)} of physics", physics)]
        if white:
            self.lines.append((f"{white.total()} of the white paper", white))
        #: What is said below that.
        self.others = f"Besides, {others}"

    def _met(self, shown: Callable[[Verdict, str], str]) -> list[tuple[str, list[str]]]:
        return [
            (head, [shown(v, f"{met[v]} {v}") for v in Verdict if met[v]])
            for head, met in self.lines
        ]

    def __repr__(self) -> str:
        """Return the lines as text."""
        lines = self._met(lambda verdict, text: text)
        found = [f"{head}: {', '.join(verdicts)}" for head, verdicts in lines]
        return "\n".join([*found, self.others])

    def _repr_html_(self) -> str:
        """Return the lines as HTML."""
        found = [f"{head}: {' '.join(badges)}" for head, badges in self._met(badge)]
        return f'<p class="verdict-counts">{"<br>".join([*found, self.others])}</p>'


class LedgerPage:
    """A ledger as a table that a reader can sort, and filter by verdict, weight and words.

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
            f'<div class="ledger">{_controls(self.ledger)}{table(rows)}'
            f"{downloads if links else ''}</div><script>{SCRIPT.read_text('utf-8')}</script>"
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
    sections = dict.fromkeys(SECTIONS[claim.chapter] for claim, _ in ledger)
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
        f'data-weight="{claim.weight}" data-section="{html.escape(SECTIONS[claim.chapter])}"'
    )
    code = (
        f'<p>Shown in its <a href="{claim.chapter}.html#claim-{name}">chapter</a>.</p>'
        f"<details><summary>Source of {name}</summary><p>{where}</p>"
        f'<pre tabindex="0">{html.escape(text)}</pre></details>'
    )
    return row(claim, finding, attributes, ledger_link(name), code)


class Errata:
    """What is printed and does not follow: printed, what follows, and what depends on it.

    Parameters
    ----------
    ledger : Ledger
        The claims and their findings.
    *weights : Weight
        Which ones to take; by default all.
    """

    def __init__(self, ledger: Ledger, *weights: Weight) -> None:
        self.entries = [
            (claim, finding)
            for claim, finding in ledger
            if finding.verdict in (Verdict.NOT_AS_WRITTEN, Verdict.DIFFERS)
            and claim.weight in (weights or Weight)
            and not claim.same_as
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
        affected = ((c, f) for c, f in self.ledger if c.identifier in claim.affects)
        same = (ledger_link(c.identifier) for c, _ in self.ledger if c.same_as == name)
        parts = {
            "Printed" if claim.printed else "In our words": typeset(
                claim.printed or claim.says
            ),
            "What follows": f"<strong>{typeset(finding.shown)}</strong>: "
            f"{typeset(finding.quantity)}. {typeset(finding.note)}",
            "What depends on it": ", ".join(
                f"{ledger_link(c.identifier)} ({f.verdict})" for c, f in affected
            ),
            "The same finding": ", ".join(same),
        }
        items = "".join(
            f"<dt>{term}</dt><dd>{text}</dd>" for term, text in parts.items() if text
        )
        return (
            f'<section class="erratum" id="erratum-{name}"><p><strong>{ledger_link(name)}, '
            f"{typeset(claim.place)}</strong> {badge(finding.verdict, finding.verdict)}</p>"
            f"<dl>{items}</dl></section>"
        )
