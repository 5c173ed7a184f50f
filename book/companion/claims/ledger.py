"""How a claim of the paper is written down, decided, checked and shown.

A claim is a function without arguments that computes a `Finding`: which readings of the claim
hold, and the number that shows it. The verdict follows from the readings by `verdict`, the rule
of this book, and no check chooses its verdict. The decorator `claim` enters the rest:

    @claim("C2", place="Eq. (5b)", says="...", pinned=(Verdict.REPRODUCED, 0.0, 1e-12))
    def straight_line() -> Finding:
        ...

The letter of a claim names its chapter, which shows `chapter_claims("04_common_arm")`.

Texts are plain, with formulas between dollar signs. What a terminal shows as it is, such as
c₁ or 10⁻⁶, becomes TeX on a page (`typeset`); TeX may be written as well.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from book.companion import ledger
from book.companion.shared import shared

#: Notebook of a claim by its letter, and the part of the paper that the claim is from.
CHAPTERS = {
    "Z": ("01_opening", "Sec. I and Table I"),
    "T": ("01_opening", "Sec. I and Table I"),
    "S": ("02_single_arm", "Sec. II, single arm"),
    "C": ("04_common_arm", "Sec. III.A, common arm"),
    "D": ("05_dual_arm", "Sec. III.B, dual arm"),
    "N": ("06_nyquist", "Sec. IV.A, frequency domain"),
    "K": ("08_controller", "Sec. IV.B, controller"),
    "M": ("09_simulation", "Sec. IV.C, simulation"),
    "A": ("07_perturbations", "Appendix"),
    "W": ("11_flight", "White paper"),
}


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    ONE_READING = "reproduced in one reading"
    IN_PART = "in part"
    DIFFERS = "differs"
    NOT_AS_WRITTEN = "not as written"
    OPEN = "cannot be settled"

    @property
    def clause(self) -> str:
        """The clause of the rule that leads to this verdict."""
        return _CLAUSES[self]


_CLAUSES = {
    Verdict.REPRODUCED: "found under every reading that the text allows",
    Verdict.ONE_READING: "found under one reading and not under another; the verdict names it",
    Verdict.IN_PART: "one stated part of the claim is found, another is not",
    Verdict.DIFFERS: "found under no reading that the text allows",
    Verdict.NOT_AS_WRITTEN: "the text has an error whose correction is evident, and the "
    "corrected text is found",
    Verdict.OPEN: "the source does not print what decides it",
}


class Weight(StrEnum):
    """What a claim is about: what loops do, how the paper gets there, or a slip in print."""

    PHYSICS = "physics"
    DERIVATION = "derivation"
    WORDING = "wording"


#: Whether a claim holds in one reading; of a claim in several parts, whether each part holds.
Holds = bool | np.bool_ | Mapping[str, bool | np.bool_]
#: Name of the literal reading of a text with an error; the others are then the corrected text.
PRINTED = "as printed"


def verdict(readings: Mapping[str, Holds], missing: str = "") -> Verdict:
    """Return the verdict that follows from the readings of a claim: the rule of this book.

    Parameters
    ----------
    readings : mapping of str to bool, or to a mapping of str to bool
        For each reading that the text allows, whether the claim holds, or which of its parts
        do. If the source does not print a value, a reading for each value that was tried.
    missing : str, optional
        What the source does not print.

    Returns
    -------
    Verdict

    Examples
    --------
    >>> verdict({"near (1, 1)": True, "everywhere": False})
    <Verdict.ONE_READING: 'reproduced in one reading'>
    >>> verdict({"": {"stable": True, "flat": False}})
    <Verdict.IN_PART: 'in part'>
    >>> verdict({"as printed": False, "with the sign changed": True})
    <Verdict.NOT_AS_WRITTEN: 'not as written'>
    """
    parts = [list(h.values()) if isinstance(h, Mapping) else [h] for h in readings.values()]
    whole = [all(part) for part in parts]
    if missing and len(set(whole)) != 1:
        return Verdict.OPEN
    if all(whole):
        return Verdict.REPRODUCED
    if any(whole):
        literal = dict(zip(readings, whole, strict=True)).get(PRINTED, True)
        return Verdict.ONE_READING if literal else Verdict.NOT_AS_WRITTEN
    return Verdict.IN_PART if any(map(any, parts)) else Verdict.DIFFERS


@dataclass(frozen=True)
class Finding:
    """What the check of a claim found.

    Attributes
    ----------
    readings : mapping
        Which readings of the claim hold, as `verdict` takes them; a single one is called "".
    value : float
        The number that decides it.
    quantity : str
        What that number is, unit included.
    note : str
        What else is worth knowing, in three sentences at most; numbers in it are computed.
    missing : str
        What the source does not print.
    """

    readings: Mapping[str, Holds]
    value: float
    quantity: str
    note: str
    missing: str = ""
    verdict: Verdict = field(init=False)

    def __post_init__(self) -> None:
        """Derive the verdict, the only way to one."""
        object.__setattr__(self, "verdict", verdict(self.readings, self.missing))

    @property
    def shown(self) -> str:
        """The number as a reader sees it; "0 to rounding" where only rounding is left."""
        if 0.0 < abs(self.value) < 1e-11:
            return "0 to rounding"
        # Four digits decide; a number of some ten thousand is not given as a power of ten.
        return f"{self.value:.0f}" if 1e4 <= abs(self.value) < 1e6 else f"{self.value:.4g}"

    @property
    def tried(self) -> list[str]:
        """Each reading or part in words, with what was found."""
        lines = []
        for name, holds in self.readings.items():
            parts = holds if isinstance(holds, Mapping) else {"": holds}
            for part, found in parts.items():
                label = ", ".join(filter(None, (name, part)))
                lines.append(f"{label}: {'' if found else 'not '}found" if label else "")
        lines.append(f"not printed: {self.missing}" if self.missing else "")
        return [line for line in lines if line]


@dataclass(frozen=True)
class Claim:
    """One claim of the paper; the attributes are the arguments of `claim`."""

    identifier: str
    place: str
    says: str
    pinned: tuple[Verdict, float, float]
    also: Mapping[str, str]
    affects: tuple[str, ...]
    weight: Weight
    printed: str
    check: shared[Finding]

    @property
    def names(self) -> tuple[str, ...]:
        """Its identifier, and those of the other places at which the paper makes it."""
        return self.identifier, *self.also

    @property
    def places(self) -> str:
        """All places at which the paper makes it."""
        return "; ".join((self.place, *self.also.values()))

    @property
    def section(self) -> str:
        """The part of the paper that it is from."""
        return CHAPTERS[self.identifier[0]][1]


def chapter_of(identifier: str) -> str:
    """Return the stem of the notebook that shows a claim."""
    return CHAPTERS[identifier[0]][0]


_REGISTER: dict[str, Claim] = {}


def claim(
    identifier: str,
    *,
    place: str,
    says: str,
    pinned: tuple[Verdict, float, float],
    also: Mapping[str, str] | None = None,
    affects: tuple[str, ...] = (),
    weight: Weight = Weight.PHYSICS,
    printed: str = "",
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
    pinned : (Verdict, float, float)
        The verdict that was found, the number that decides it, and its absolute tolerance.
    also : mapping of str to str, optional
        Further places at which the paper makes the same claim, by the identifier of each.
    affects : tuple of str, optional
        Claims whose verdict or number uses what this one corrects, for the errata.
    weight : Weight, optional
        What the claim is about.
    printed : str, optional
        The formula, or the few words, as the paper prints them.

    Raises
    ------
    ValueError
        If an identifier is taken.
    """

    def enter(check: Callable[[], Finding]) -> shared[Finding]:
        names = identifier, *(also or {})
        for name in names:
            if name in _REGISTER:
                raise ValueError(f"identifier must be new, got {name!r} a second time")
        remembered = shared(check)
        entry = Claim(
            identifier, place, says, pinned, also or {}, affects, weight, printed, remembered,
        )  # fmt: skip
        _REGISTER.update(dict.fromkeys(names, entry))
        return remembered

    return enter


def all_claims() -> list[Claim]:
    """Return every registered claim once, in the order of the paper's sections."""
    return list({entry.identifier: entry for entry in _REGISTER.values()}.values())


def all_names() -> list[str]:
    """Return the identifiers of all claims and of all their places."""
    return list(_REGISTER)


class Ledger:
    """Claims with their findings, shown under their verdicts.

    Parameters
    ----------
    entries : iterable of (Claim, Finding)
        In the order of the table.
    """

    def __init__(self, entries: Iterable[tuple[Claim, Finding]]) -> None:
        self.entries = list(entries)

    def __getitem__(self, identifier: str) -> Finding:
        """Return the finding of one claim, by any of its identifiers."""
        return {name: finding for entry, finding in self.entries for name in entry.names}[
            identifier
        ]

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
        pinned, wrong = ledger.Ledger(), []
        for entry, finding in self.entries:
            one = pinned[entry.identifier]
            if str(one.verdict) != str(finding.verdict) or not (
                abs(finding.value - one.value) <= one.tolerance + 1e-9 * abs(one.value)
            ):
                wrong.append(f"{entry.identifier}: {one.verdict}, {one.value!r} in the file")
        if wrong:
            raise AssertionError("\n".join(wrong))

    def __repr__(self) -> str:
        """Return the table as text."""
        return "\n".join(
            f"{c.identifier:4s} {f.verdict}: {f.shown} ({f.quantity}). "
            + "".join(f"{tried}. " for tried in f.tried)
            + f.note
            for c, f in self.entries
        ).replace("$", "")

    def _repr_html_(self) -> str:
        """Return links to the claims, under their verdicts, as HTML for a chapter."""
        found: dict[Verdict, list[str]] = {}
        for c, f in self.entries:
            says = html.escape(c.says.replace("$", ""))
            link = ledger_link(c.identifier, f'id="claim-{c.identifier}" title="{says}" ')
            found.setdefault(f.verdict, []).append(link)
        lines = (f"{badge(v, v)} {', '.join(found[v])}" for v in Verdict if v in found)
        return f'<p class="verdict-counts">{"<br>".join(lines)}</p>'


# HTML ----------------------------------------------------------------------------------------


def ledger_link(identifier: str, attributes: str = "") -> str:
    """Return a link from a chapter to a claim's row in the ledger."""
    return f'<a {attributes}href="16_ledger.html#ledger-{identifier}">{identifier}</a>'


def badge(verdict: Verdict, text: str = "") -> str:
    """Return a text as HTML in the colour of a verdict; by default the verdict itself."""
    return f'<span class="verdict verdict-{verdict.name.lower()}">{text or verdict}</span>'


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
    chosen = {_REGISTER[name].identifier: _REGISTER[name] for name in identifiers}
    return Ledger((entry, entry.check()) for entry in chosen.values())


def chapter_claims(chapter: str) -> Ledger:
    """Check every claim that a chapter has to show.

    Parameters
    ----------
    chapter : str
        Stem of its notebook, for instance "04_common_arm".

    Returns
    -------
    Ledger

    Raises
    ------
    ValueError
        If no claim names this chapter.
    """
    names = [name for name in _REGISTER if chapter_of(name) == chapter]
    if not names:
        known = ", ".join(dict.fromkeys(map(chapter_of, _REGISTER)))
        raise ValueError(f"chapter must be one of {known}; got {chapter!r}")
    return check(*names)
