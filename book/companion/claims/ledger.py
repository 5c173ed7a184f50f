"""How a claim of the paper is written down, checked and shown.

A claim is a function without arguments that computes a `Finding`. The decorator `claim`
says where it stands and what it says, in our words, and enters it in the register:

    @claim("C2", place="Eq. (5b)", says="...", chapter="03_common_arm")
    def straight_line() -> Finding:
        ...
"""

from __future__ import annotations

import csv
import html
import json
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from multiprocessing import get_context
from pathlib import Path


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    IN_PART = "reproduced in part"
    DIFFERS = "differs"
    NOT_AS_WRITTEN = "not as written"
    OPEN = "cannot be settled from the paper"


@dataclass(frozen=True)
class Finding:
    """What the check of a claim found.

    Attributes
    ----------
    verdict : Verdict
        What became of the claim.
    value : float
        The number that decides it.
    quantity : str
        What that number is, unit included.
    note : str
        Why the verdict follows, and under which reading; numbers in it are computed.
    """

    verdict: Verdict
    value: float
    quantity: str
    note: str


@dataclass(frozen=True)
class Claim:
    """One claim of the paper: identifier, place, our wording, chapter and check."""

    identifier: str
    place: str
    says: str
    chapter: str
    check: Callable[[], Finding]


_REGISTER: dict[str, Claim] = {}


def claim(
    identifier: str, *, place: str, says: str, chapter: str
) -> Callable[[Callable[[], Finding]], Callable[[], Finding]]:
    """Enter the decorated check in the register of claims.

    Parameters
    ----------
    identifier : str
        Letter and number, for instance "C7".
    place : str
        Where the paper makes the claim.
    says : str
        What it says, in our words.
    chapter : str
        Stem of the notebook that shows it.

    Raises
    ------
    ValueError
        If the identifier is taken.
    """

    def enter(check: Callable[[], Finding]) -> Callable[[], Finding]:
        if identifier in _REGISTER:
            raise ValueError(f"identifier must be new, got {identifier!r} a second time")
        remembered = cache(check)
        _REGISTER[identifier] = Claim(identifier, place, says, chapter, remembered)
        return remembered

    return enter


def all_claims() -> list[Claim]:
    """Return every registered claim, in the order of the paper's sections."""
    return list(_REGISTER.values())


class Ledger:
    """Claims with their findings, shown as a table.

    Parameters
    ----------
    claims : list of Claim
        They are checked here, in this order.
    """

    def __init__(self, claims: list[Claim]) -> None:
        self.entries = [(entry, entry.check()) for entry in claims]

    def __getitem__(self, identifier: str) -> Finding:
        """Return the finding of one claim."""
        for entry, finding in self.entries:
            if entry.identifier == identifier:
                return finding
        raise KeyError(identifier)

    def __iter__(self) -> Iterator[tuple[Claim, Finding]]:
        """Iterate over (claim, finding)."""
        return iter(self.entries)

    def __len__(self) -> int:
        """Return how many claims there are."""
        return len(self.entries)

    def counts(self) -> Counter[Verdict]:
        """Return how many claims met each verdict."""
        return Counter(finding.verdict for _, finding in self.entries)

    def records(self) -> list[dict[str, str | float]]:
        """Return the ledger as one flat record a claim."""
        return [
            {
                "claim": entry.identifier,
                "place": entry.place,
                "says": entry.says,
                "chapter": entry.chapter,
                "verdict": str(finding.verdict),
                "value": finding.value,
                "quantity": finding.quantity,
                "note": finding.note,
            }
            for entry, finding in self.entries
        ]

    def write(self, folder: Path) -> list[Path]:
        """Write claims.csv and claims.json into a folder, and return their paths."""
        folder.mkdir(parents=True, exist_ok=True)
        records = self.records()
        table, tree = folder / "claims.csv", folder / "claims.json"
        with table.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.DictWriter(stream, fieldnames=list(records[0]))
            # Each number has a unit of its own, in the column beside it.
            names = {name: name for name in records[0]} | {"value": "value [as quantity says]"}
            writer.writerow(names)
            # As many digits as in the figures' tables: more would differ between machines.
            writer.writerows(record | {"value": f"{record['value']:.7g}"} for record in records)
        tree.write_text(json.dumps(records, indent=1, ensure_ascii=False) + "\n", "utf-8")
        return [table, tree]

    def __repr__(self) -> str:
        """Return the table as text."""
        return "\n".join(
            f"{c.identifier:4s} {f.verdict}: {f.value:.6g} ({f.quantity}). {f.note}"
            for c, f in self.entries
        )

    def _repr_html_(self) -> str:
        """Return the table as HTML, for notebooks."""
        # Two columns, so that the table also fits a narrow screen.
        rows = "".join(
            f'<tr id="claim-{html.escape(c.identifier)}" '
            'style="vertical-align: top; text-align: left">'
            '<td style="padding-right: 1em">'
            f"<strong>{html.escape(c.identifier)}</strong><br>"
            f'<span class="verdict verdict-{f.verdict.name.lower()}">{f.verdict}</span>'
            f"<br><small>{html.escape(c.place)}</small></td>"
            f"<td><p>{html.escape(c.says)}</p>"
            f"<p><strong>{f.value:.6g}</strong>: {html.escape(f.quantity)}.</p>"
            f"<p>{html.escape(f.note)}</p></td></tr>"
            for c, f in self.entries
        )
        return (
            '<table class="claims"><thead><tr style="text-align: left"><th>Claim, verdict</th>'
            "<th>What the paper says, the number that decides it, and why</th></tr></thead>"
            f"<tbody>{rows}</tbody></table>"
        )


def check(*identifiers: str) -> Ledger:
    """Check claims by identifier.

    Parameters
    ----------
    *identifiers : str
        For instance "C1", "C2".

    Returns
    -------
    Ledger

    Raises
    ------
    ValueError
        If an identifier is not registered.
    """
    for identifier in identifiers:
        if identifier not in _REGISTER:
            raise ValueError(
                f"identifier must be one of {', '.join(_REGISTER)}; got {identifier!r}"
            )
    return Ledger([_REGISTER[identifier] for identifier in identifiers])


def _check_together(identifiers: list[str]) -> dict[str, Finding]:
    """Check some claims in a process of its own."""
    import book.companion.claims  # noqa: F401, a new process has an empty register

    return {identifier: _REGISTER[identifier].check() for identifier in identifiers}


def check_in_parallel(claims: list[Claim]) -> Ledger:
    """Check claims chapter by chapter, on all cores.

    Parameters
    ----------
    claims : list of Claim
        Of this package; a process of its own knows no others.

    Returns
    -------
    Ledger
        The same as `Ledger(claims)`, sooner. The claims of a chapter share what they need,
        such as one simulation, and so stay together.
    """
    chapters: dict[str, list[str]] = {}
    # The longest first: simulation and appendix stand at the end of the paper.
    for entry in reversed(claims):
        chapters.setdefault(entry.chapter, []).append(entry.identifier)
    findings: dict[str, Finding] = {}
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        for found in pool.map(_check_together, chapters.values()):
            findings |= found
    ledger = Ledger([])
    ledger.entries = [(entry, findings[entry.identifier]) for entry in claims]
    return ledger
