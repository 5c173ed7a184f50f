"""How a claim of the paper is written down, decided, checked and shown.

A claim is a function without arguments that computes a `Finding`. The decorator holds all the
rest, and enters it in the register. A module names its chapter once:

    claim = partial(ledger.claim, chapter="03_common_arm")

    @claim("C2", place="Eq. (5b)", says="...", pinned=(Verdict.REPRODUCED, 0.0, 1e-12))
    def straight_line() -> Finding:
        ...

The chapter shows `chapter_claims("03_common_arm")`, and calls its `confirm`.

Texts are plain, with formulas between dollar signs. What a terminal shows as it is, such as
c₁ or 10⁻⁶, becomes TeX on a page (`typeset`); TeX may be written as well.
"""

from __future__ import annotations

import csv
import html
import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from book.companion.shared import shared


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    WHERE_USED = "holds where the paper uses it"
    IN_PART = "reproduced in part"
    DIFFERS = "differs"
    NOT_AS_WRITTEN = "not as written"
    OPEN = "cannot be settled from the paper"


class Weight(StrEnum):
    """What a claim is about: what loops do, how the paper gets there, or a slip in print."""

    PHYSICS = "physics"
    DERIVATION = "derivation"
    WORDING = "wording"


def decide(
    *holds: bool | np.bool_,
    beyond: bool | np.bool_ = True,
    corrected: bool | np.bool_ = False,
    settled: bool | np.bool_ = True,
) -> Verdict:
    """Return the verdict that follows from which parts of a claim hold.

    Parameters
    ----------
    *holds : bool
        For each part of the claim, whether it holds in the range in which the paper uses it,
        in the reading most favourable to the paper.
    beyond : bool, optional
        Whether it holds outside that range as well.
    corrected : bool, optional
        Whether the claim holds with a slip in the paper mended.
    settled : bool, optional
        False if the answer depends on something that the paper does not say.

    Returns
    -------
    Verdict
        All parts hold: reproduced, or where the paper uses it. Otherwise, if the mended claim
        holds: not as written. Otherwise some parts hold: reproduced in part; none: differs.

    Examples
    --------
    >>> decide(True, False)
    <Verdict.IN_PART: 'reproduced in part'>
    >>> decide(True, beyond=False)
    <Verdict.WHERE_USED: 'holds where the paper uses it'>
    >>> decide(False, corrected=True)
    <Verdict.NOT_AS_WRITTEN: 'not as written'>
    """
    if not settled:
        return Verdict.OPEN
    if all(holds):
        return Verdict.REPRODUCED if beyond else Verdict.WHERE_USED
    if corrected:
        return Verdict.NOT_AS_WRITTEN
    return Verdict.IN_PART if any(holds) else Verdict.DIFFERS


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
        Why the verdict follows, and under which reading, in three sentences at most; numbers
        in it are computed.
    """

    verdict: Verdict
    value: float
    quantity: str
    note: str

    @property
    def shown(self) -> str:
        """The number as a reader sees it; "0 to rounding" where only rounding is left."""
        return "0 to rounding" if 0.0 < abs(self.value) < 1e-11 else f"{self.value:.6g}"


@dataclass(frozen=True)
class Claim:
    """One claim of the paper; the attributes are the arguments of `claim`."""

    identifier: str
    place: str
    says: str
    chapter: str
    pinned: tuple[Verdict, float, float]
    affects: tuple[str, ...]
    weight: Weight
    printed: str
    same_as: str
    check: shared[Finding]


_REGISTER: dict[str, Claim] = {}


def claim(
    identifier: str,
    *,
    place: str,
    says: str,
    chapter: str,
    pinned: tuple[Verdict, float, float],
    affects: tuple[str, ...] = (),
    weight: Weight = Weight.PHYSICS,
    printed: str = "",
    same_as: str = "",
) -> Callable[[Callable[[], Finding]], shared[Finding]]:
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
    pinned : (Verdict, float, float)
        The verdict, the number that decides it, and the absolute tolerance of that number.
    affects : tuple of str, optional
        Claims whose verdict or number uses what this one corrects, for the errata.
    weight : Weight, optional
        What the claim is about.
    printed : str, optional
        The formula, or the few words, as the paper prints them.
    same_as : str, optional
        The claim with the same finding, which then counts once.

    Raises
    ------
    ValueError
        If the identifier is taken.
    """

    def enter(check: Callable[[], Finding]) -> shared[Finding]:
        if identifier in _REGISTER:
            raise ValueError(f"identifier must be new, got {identifier!r} a second time")
        remembered = shared(check)
        _REGISTER[identifier] = Claim(
            identifier, place, says, chapter, pinned, affects, weight, printed, same_as,
            remembered,
        )  # fmt: skip
        return remembered

    return enter


def all_claims() -> list[Claim]:
    """Return every registered claim, in the order of the paper's sections."""
    return list(_REGISTER.values())


class Ledger:
    """Claims with their findings, shown as a table.

    Parameters
    ----------
    entries : iterable of (Claim, Finding)
        In the order of the table.
    """

    def __init__(self, entries: Iterable[tuple[Claim, Finding]]) -> None:
        self.entries = list(entries)

    def __getitem__(self, identifier: str) -> Finding:
        """Return the finding of one claim."""
        return {entry.identifier: finding for entry, finding in self.entries}[identifier]

    def __iter__(self) -> Iterator[tuple[Claim, Finding]]:
        """Iterate over (claim, finding)."""
        return iter(self.entries)

    def __len__(self) -> int:
        """Return how many claims there are."""
        return len(self.entries)

    def confirm(self) -> None:
        """Make sure that every finding is as its claim pins it.

        Raises
        ------
        AssertionError
            If one is not: which, what was found and what is pinned.
        """
        wrong = []
        for entry, finding in self.entries:
            verdict, value, tolerance = entry.pinned
            if finding.verdict is not verdict or not abs(finding.value - value) <= tolerance:
                wrong.append(
                    f"{entry.identifier} is pinned as {verdict}, {value!r} within "
                    f"{tolerance:g}; found {finding.verdict}, {finding.value!r}"
                )
        if wrong:
            raise AssertionError("\n".join(wrong))

    def counts(self, *weights: Weight) -> Counter[Verdict]:
        """Return how many findings met each verdict; of some weights, or of all."""
        return Counter(
            finding.verdict
            for entry, finding in self.entries
            if not entry.same_as and entry.weight in (weights or Weight)
        )

    def records(self) -> list[dict[str, str | float]]:
        """Return the ledger as one flat record a claim."""
        return [
            {
                "claim": entry.identifier,
                "place": entry.place,
                "says": entry.says,
                "printed": entry.printed,
                "chapter": entry.chapter,
                "weight": str(entry.weight),
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
        # Other processes read this one: it is there as a whole, or not at all.
        part = tree.with_suffix(".part")
        part.write_text(json.dumps(records, indent=1, ensure_ascii=False) + "\n", "utf-8")
        part.replace(tree)
        return [table, tree]

    def __repr__(self) -> str:
        """Return the table as text."""
        return "\n".join(
            f"{c.identifier:4s} {f.verdict}: {f.shown} ({f.quantity}). {f.note}"
            for c, f in self.entries
        ).replace("$", "")

    def _repr_html_(self) -> str:
        """Return the table as HTML, for a chapter; what is behind a row is in the ledger."""
        rows = "".join(
            f'<tr id="claim-{c.identifier}"><td>{ledger_link(c.identifier)}</td>'
            f"<td>{badge(f.verdict)}</td><td>{c.weight}</td><td>{typeset(c.says)}"
            f"<br><strong>{typeset(f.shown)}</strong>: {typeset(f.quantity)}.</td></tr>"
            for c, f in self.entries
        )
        return table(rows)


# HTML ----------------------------------------------------------------------------------------

#: A text that names claims: "claim K5", "claims C7, C8 and C11".
NAMING = re.compile(r"\b[Cc]laims?\s+[A-Z]\d+(?:(?:,\s+and|,|\s+and|\s+to)\s+[A-Z]\d+)*")
#: One of the names in it.
NAME = re.compile(r"[A-Z]\d+")
_POWER = re.compile(r"(?<![\w.])([-+]?\d+(?:\.\d+)?)e([-+]\d+)")
_RAISED = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻]+")
_LOWERED = re.compile("[₀₁₂₃₄₅₆₇₈₉₊₋]+")
_FUNCTION = re.compile(r"(?<!\\)\b(exp|sin|cos|cot|ln|min|max)\b")
_LEVEL = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻₀₁₂₃₄₅₆₇₈₉₊₋", "0123456789+-" * 2)


def typeset(text: str) -> str:
    r"""Return a text of the ledger as HTML, with formulas and links to the claims it names.

    Examples
    --------
    >>> from book.companion.claims.ledger import typeset
    >>> print(typeset("$c₁$ is 1.5e-06 here: $c₁ ≥ 10⁻⁶$"))
    \(c_{1}\) is \(1.5 \times 10^{-6}\) here: \(c_{1} ≥ 10^{-6}\)
    """

    def power(found: re.Match[str]) -> str:
        return rf"{found[1]} \times 10^{{{int(found[2])}}}"

    def level(mark: str) -> Callable[[re.Match[str]], str]:
        return lambda found: f"{mark}{{{found[0].translate(_LEVEL)}}}"

    parts = html.escape(text).split("$")
    for k, part in enumerate(parts):
        if k % 2:
            formula = _FUNCTION.sub(r"\\\1 ", _POWER.sub(power, part))
            formula = _LOWERED.sub(level("_"), _RAISED.sub(level("^"), formula))
            parts[k] = rf"\({formula}\)"
        else:
            part = _POWER.sub(lambda found: rf"\({power(found)}\)", part)
            parts[k] = NAMING.sub(
                lambda found: NAME.sub(lambda name: ledger_link(name[0]), found[0]), part
            )
    return "".join(parts)


def ledger_link(identifier: str) -> str:
    """Return a link from a chapter to a claim's row in the ledger."""
    return f'<a href="09_ledger.html#ledger-{identifier}">{identifier}</a>'


def badge(verdict: Verdict, text: str = "") -> str:
    """Return a text as HTML in the colour of a verdict; by default the verdict in short."""
    name = verdict.name.lower()
    return f'<span class="verdict verdict-{name}">{text or name.replace("_", " ")}</span>'


def row(claim: Claim, finding: Finding, attributes: str, link: str, more: str) -> str:
    """Return a claim as a row of the ledger: one line, and what unfolds below it."""
    printed = f"<p>Printed ({typeset(claim.place)}): {typeset(claim.printed)}.</p>"
    place = f"<p>{typeset(claim.place)}, in our words.</p>"
    return (
        f"<tr {attributes}><td>{link}</td><td>{badge(finding.verdict)}</td>"
        f"<td>{claim.weight}</td><td><details><summary>{typeset(claim.says)}</summary>"
        f"{printed if claim.printed else place}<p>{badge(finding.verdict, finding.verdict)} "
        f"<strong>{typeset(finding.shown)}</strong>: {typeset(finding.quantity)}.</p>"
        f"<p>{typeset(finding.note)}</p>{more}</details></td></tr>"
    )


def table(rows: str) -> str:
    """Return rows of claims as an HTML table with a heading."""
    heads = "".join(f'<th scope="col">{name}</th>' for name in ("Claim", "Verdict", "About"))
    return (
        f'<table class="claims"><thead><tr>{heads}<th scope="col">What the paper says</th>'
        f"</tr></thead><tbody>{rows}</tbody></table>"
    )


def check(*identifiers: str) -> Ledger:
    """Check claims by identifier, those that this build has not checked already.

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
    chosen = [_REGISTER[identifier] for identifier in identifiers]
    return Ledger((entry, entry.check()) for entry in chosen)


def chapter_claims(chapter: str) -> Ledger:
    """Check every claim that a chapter has to show.

    Parameters
    ----------
    chapter : str
        Stem of its notebook, for instance "03_common_arm".

    Returns
    -------
    Ledger

    Raises
    ------
    ValueError
        If no claim names this chapter.
    """
    names = [entry.identifier for entry in all_claims() if entry.chapter == chapter]
    if not names:
        known = ", ".join(dict.fromkeys(entry.chapter for entry in all_claims()))
        raise ValueError(f"chapter must be one of {known}; got {chapter!r}")
    return check(*names)


def _check_chapter(chapter: str) -> dict[str, Finding]:
    """Check the claims of a chapter in a process of its own."""
    import book.companion.claims  # noqa: F401, a new process has an empty register

    return {entry.identifier: finding for entry, finding in chapter_claims(chapter)}


def check_in_parallel() -> Ledger:
    """Check every claim, chapter by chapter, on all cores.

    Returns
    -------
    Ledger
        All claims. Those of a chapter share what they need, such as one simulation, and so
        stay together.
    """
    # The longest first. It needs few of the compiled functions: the other process has compiled
    # the rest before this one comes to need them.
    longest, others = "08_perturbations", (entry.chapter for entry in reversed(all_claims()))
    chapters = dict.fromkeys([longest, *others])
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        parts = pool.map(_check_chapter, chapters)
        found = {name: finding for part in parts for name, finding in part.items()}
    return Ledger((entry, found[entry.identifier]) for entry in all_claims())
