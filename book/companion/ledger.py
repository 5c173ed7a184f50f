"""The ledger of claims: its file, the rule of verdicts, and what a chapter asserts.

`book/claims.toml` holds the text of every claim, and what the chapters found: readings, verdict
and numbers. All pages are written from this file alone. A chapter decides its claims in plain
dictionaries; its last cell calls `confirm`, which asserts that file and chapter agree. `make
pins` runs the notebooks and writes what they find into the file.
"""

from __future__ import annotations

import csv
import json
import math
import os
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

#: The file that all pages are written from.
FILE = Path(__file__).parents[1] / "claims.toml"
#: How well the numbers of a note have to agree, relative to their size.
AGREEMENT = 1e-5


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
    Verdict.NOT_AS_WRITTEN: "the text has an error whose correction is evident, and it is "
    "found with every correction that the text allows",
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

    Raises
    ------
    ValueError
        If no reading was tried, although the source prints all.

    Examples
    --------
    >>> from book.companion.ledger import verdict
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
    if not readings:
        raise ValueError("readings must not be empty unless a value is missing, got {}")
    if all(whole):
        return Verdict.REPRODUCED
    if any(whole):
        # An error is evident only if every correction that the text allows is found.
        wrong = [name for name, found in zip(readings, whole, strict=True) if not found]
        return Verdict.NOT_AS_WRITTEN if wrong == [PRINTED] else Verdict.ONE_READING
    return Verdict.IN_PART if any(map(any, parts)) else Verdict.DIFFERS


# Texts --------------------------------------------------------------------------------------

_PLACE = re.compile(r"\{(\w+):([^{}]*)\}")
_POWER = re.compile(r"(?<=\d)e([-+]\d+)$")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def shown(number: float, form: str = ".4g") -> str:
    """Return a number as text, its power of ten as a reader writes it.

    Examples
    --------
    >>> from book.companion.ledger import shown
    >>> shown(1.4643205e-6)
    '1.464 × 10⁻⁶'
    """
    power = _POWER.search(text := format(number, form))
    if power is None:
        return text
    return f"{text[: power.start()]} × 10{str(int(power[1])).translate(_RAISED)}"


def fill(text: str, numbers: Mapping[str, float]) -> str:
    """Return a text with its numbers, each of which stands there as {name:format}.

    Examples
    --------
    >>> from book.companion.ledger import fill
    >>> fill("half of it allows {half:.3g}, not $10^{-6}$", {"half": 6.3262e-7})
    'half of it allows 6.33 × 10⁻⁷, not $10^{-6}$'
    """
    return _PLACE.sub(lambda place: shown(numbers[place[1]], place[2]), text)


# Entries ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Numbers:
    """Numbers that a chapter computes and other pages quote.

    Attributes
    ----------
    name : str
        What `confirm` calls them.
    chapter : str
        Stem of the notebook that computes them.
    numbers : mapping of str to float
        By name.
    unit : str
        Their unit.
    """

    name: str
    chapter: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    unit: str = ""


@dataclass(frozen=True)
class Assumption(Numbers):
    """Something that the paper leaves open.

    Attributes
    ----------
    title, taken, why, sensitivity : str
        What is open, the choice of this book, its reason, and what another choice changes;
        templates for `fill`.
    """

    title: str = ""
    taken: str = ""
    why: str = ""
    sensitivity: str = ""

    def text(self, name: str) -> str:
        """Return one of these texts with its numbers."""
        return fill(getattr(self, name), self.numbers)


@dataclass(frozen=True, kw_only=True)
class Claim(Numbers):
    """One claim of the paper or of the white paper.

    Attributes
    ----------
    place, says, printed : str
        Where the source makes the claim, what it says in our words, and the formula or the few
        words as printed.
    weight : Weight
        What the claim is about.
    quantity, value, tolerance : str, float, float
        The number that decides, what it is, and how far it may be off.
    readings : mapping
        What was found in each reading, as `verdict` takes it.
    verdict : Verdict
        What follows from them.
    criterion : str
        What decides whether a reading holds, where a word of the source needs a number.
    excluded : mapping of str to str
        Readings that the text excludes, and where it does.
    missing : str
        What the source does not print.
    note : str
        What else is worth knowing. Quantity, criterion and note are templates for `fill`.
    also : mapping of str to str
        Further places of the same claim, by the identifier of each.
    affects : sequence of str
        Claims whose verdict or number uses what this one corrects.
    changes : str
        Of a major claim, the sentence of abstract, contributions or conclusion that its verdict
        changes, and how.
    """

    place: str
    says: str
    weight: Weight
    quantity: str
    value: float = math.nan
    tolerance: float = 0.0
    readings: Mapping[str, Holds] = field(default_factory=dict)
    verdict: Verdict
    printed: str = ""
    criterion: str = ""
    excluded: Mapping[str, str] = field(default_factory=dict)
    missing: str = ""
    note: str = ""
    also: Mapping[str, str] = field(default_factory=dict)
    affects: tuple[str, ...] = ()
    changes: str = ""

    def __post_init__(self) -> None:
        """Make sure that the verdict follows from the readings.

        Raises
        ------
        ValueError
            If another verdict follows.
        """
        follows = verdict(self.readings, self.missing)
        if self.verdict != follows:
            raise ValueError(
                f"verdict of {self.name} must follow from its readings, {follows.value!r}; "
                f"got {str(self.verdict)!r}"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Its identifier, and those of the other places."""
        return self.name, *self.also

    @property
    def places(self) -> str:
        """All places at which the source makes it."""
        return "; ".join((self.place, *self.also.values()))

    @property
    def white(self) -> bool:
        """Whether it is a claim of the white paper."""
        return self.name.startswith("W")

    @property
    def number(self) -> str:
        """The number that decides, as a reader sees it."""
        if 0.0 < abs(self.value) < 1e-11:
            return "0 to rounding"
        # A number of some ten thousand is not given as a power of ten.
        text = shown(self.value, ".0f" if 1e4 <= abs(self.value) < 1e6 else ".4g")
        return f"{text} {self.unit}".strip()

    @property
    def tried(self) -> list[str]:
        """Each reading or part in words, with what was found."""
        lines = []
        for name, holds in self.readings.items():
            parts = holds if isinstance(holds, Mapping) else {"": holds}
            for part, found in parts.items():
                label = ", ".join(filter(None, (name, part)))
                lines += [f"{label}: {'' if found else 'not '}found"] if label else []
        lines += [f"{name}: excluded, {why}" for name, why in self.excluded.items()]
        if self.missing:
            lines.append(f"not printed: {self.missing}")
            lines += [] if self.readings else ["no reading was tried: no check decides"]
        return lines

    def text(self, name: str) -> str:
        """Return quantity, criterion or note with its numbers."""
        return fill(getattr(self, name), {**self.numbers, "value": self.value})


class Ledger:
    """All claims, assumptions and quoted numbers of the file.

    Parameters
    ----------
    file : Path, optional
        The file to read, that of the book by default.

    Examples
    --------
    >>> from book.companion.ledger import Ledger
    >>> Ledger()["K12"].name
    'K5'
    """

    def __init__(self, file: Path | None = None) -> None:
        data = tomllib.loads((file or FILE).read_text("utf-8"))
        #: Parts of the sources, by the letter of their claims.
        self.sections: dict[str, str] = data["sections"]
        self.claims = {
            name: Claim(
                name=name,
                **entry | {k: kind(entry[k]) for k, kind in _KINDS.items() if k in entry},
            )
            for name, entry in data["claims"].items()
        }
        self.assumptions = {k: Assumption(k, **v) for k, v in data["assumptions"].items()}
        self.numbers = {k: Numbers(k, **v) for k, v in data["numbers"].items()}
        places = [(name, claim) for claim in self.claims.values() for name in claim.names]
        if twice := [name for name, n in Counter(k for k, _ in places).items() if n > 1]:
            raise ValueError(f"identifiers must be different, got {', '.join(twice)} twice")
        self._entries: dict[str, Any] = dict(places) | self.assumptions | self.numbers

    def __getitem__(self, name: str) -> Any:
        """Return a claim by any of its identifiers, an assumption or quoted numbers."""
        return self._entries[name]

    def __iter__(self) -> Iterator[Claim]:
        """Iterate over the claims, in the order of the file."""
        return iter(self.claims.values())

    def of(self, chapter: str) -> dict[str, Any]:
        """Return what a chapter computes, by name."""
        entries = {**self.claims, **self.assumptions, **self.numbers}
        return {k: entry for k, entry in entries.items() if entry.chapter == chapter}

    def section(self, claim: Claim) -> str:
        """Return the part of the source that a claim is from."""
        return self.sections[claim.name[0]]

    def tally(self) -> dict[str, Counter[Verdict]]:
        """Return how many claims met each verdict: by weight, and of the white paper."""
        kinds = {f"of {weight}": Counter[Verdict]() for weight in Weight}
        kinds["of the white paper"] = Counter()
        for claim in self:
            kinds["of the white paper" if claim.white else f"of {claim.weight}"][
                claim.verdict
            ] += 1
        return kinds

    def write(self, folder: Path) -> None:
        """Write claims.csv and claims.json into a folder."""
        records = [
            {
                "claim": " ".join(claim.names),
                "place": claim.places,
                "says": claim.says,
                "printed": claim.printed,
                "chapter": claim.chapter,
                "weight": str(claim.weight),
                "changes": claim.changes,
                "verdict": str(claim.verdict),
                "clause": claim.verdict.clause,
                "readings": "; ".join(claim.tried),
                "criterion": claim.text("criterion"),
                "value": claim.value,
                "unit": claim.unit,
                "quantity": claim.text("quantity"),
                "note": claim.text("note"),
            }
            for claim in self
        ]
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / "claims.csv").open("w", newline="", encoding="utf-8") as stream:
            writer = csv.DictWriter(stream, fieldnames=list(records[0]))
            writer.writeheader()
            writer.writerows(records)
        text = json.dumps(records, indent=1, ensure_ascii=False)
        (folder / "claims.json").write_text(text + "\n", "utf-8")


_KINDS = {"weight": Weight, "verdict": Verdict, "affects": tuple}


# What a chapter found -----------------------------------------------------------------------


def _plain(value: Any) -> Any:
    """Return a mapping, a number or a truth value without NumPy's types."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    return np.asarray(value).item()


def _found(claims: Mapping[str, Any], numbers: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what a chapter found, in the terms of the file."""
    found = {}
    for name, (readings, value, *more) in claims.items():
        tried = readings if isinstance(readings, Mapping) else {"": readings}
        found[name] = _plain(
            {"readings": tried, "value": value, "numbers": more[0] if more else {}}
        )
    return found | {name: {"numbers": _plain(one)} for name, one in numbers.items()}


def _differences(entry: Any, found: Mapping[str, Any]) -> Iterable[str]:
    """Yield how a chapter differs from an entry of the file."""
    if isinstance(entry, Claim):
        if entry.readings != found["readings"]:
            yield f"readings {dict(entry.readings)}, found {found['readings']}"
        if not (
            abs(entry.value - found["value"]) <= entry.tolerance
            or entry.value == found["value"]
        ):
            yield f"value {entry.value!r}, found {found['value']!r}"
    if missing := entry.numbers.keys() ^ found["numbers"].keys():
        yield f"numbers in one of both only: {', '.join(sorted(missing))}"
    for name in entry.numbers.keys() & found["numbers"].keys():
        pinned, value = entry.numbers[name], found["numbers"][name]
        if not math.isclose(pinned, value, rel_tol=AGREEMENT, abs_tol=1e-12):
            yield f"{name} {pinned!r}, found {value!r}"


def confirm(
    chapter: str,
    claims: Mapping[str, tuple[Any, ...]] | None = None,
    numbers: Mapping[str, Mapping[str, float]] | None = None,
) -> None:
    """Assert that what a chapter found is in the file.

    Parameters
    ----------
    chapter : str
        Stem of its notebook.
    claims : mapping of str to tuple, optional
        For each claim the readings, as `verdict` takes them, or a truth value if there is only
        one; the number that decides; and, as a third item, the numbers of its texts by name.
    numbers : mapping of str to mapping, optional
        The numbers of assumptions, and those that other pages quote.

    Raises
    ------
    AssertionError
        If they differ, with what differs.
    """
    found = _found(claims or {}, numbers or {})
    if folder := os.environ.get("ARMLOCK_FOUND"):  # `make pins` asks what was found
        Path(folder, f"{chapter}.json").write_text(json.dumps(found), "utf-8")
        return
    entries = Ledger().of(chapter)
    wrong = [f"{name}: in the file only" for name in entries if name not in found]
    wrong += [f"{name}: in the chapter only" for name in found if name not in entries]
    wrong += [
        f"{name}: the file has {text}"
        for name in entries.keys() & found.keys()
        for text in _differences(entries[name], found[name])
    ]
    if wrong:
        raise AssertionError("book/claims.toml and chapter differ\n" + "\n".join(sorted(wrong)))


# The file -----------------------------------------------------------------------------------


def _key(text: str) -> str:
    """Return a text as a key or a string of TOML."""
    if re.fullmatch(r"[\w-]+", text, re.ASCII):
        return text
    return _string(text)


def _string(text: str) -> str:
    """Return a text as a string of TOML, without escapes where that is possible."""
    return json.dumps(text, ensure_ascii=False) if "'" in text else f"'{text}'"


def _toml(value: Any) -> str:
    """Return a value as TOML, numbers with ten digits."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    return repr(float(f"{value:.10g}"))


def updated(text: str, found: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the text of the file with what chapters found, all else as it is.

    Parameters
    ----------
    text : str
        The file.
    found : mapping
        By the name of the entry: readings, value and numbers.

    Raises
    ------
    ValueError
        If the file has no entry of a name.
    """
    data = tomllib.loads(text)
    kinds = {k: kind for kind in ("claims", "assumptions", "numbers") for k in data[kind]}
    if unknown := sorted(found.keys() - kinds.keys()):
        raise ValueError(f"the file must have an entry for {', '.join(unknown)}")
    blocks = [block for block in re.split(r"(?m)^(?=\[)", text) if block]
    for name, one in found.items():
        table = f"{kinds[name]}.{_key(name)}"
        missing = data[kinds[name]][name].get("missing", "")
        at = next(i for i, block in enumerate(blocks) if block.startswith(f"[{table}]"))
        if "value" in one:
            follows = verdict(one["readings"], missing)
            for key, line in (("verdict", f'"{follows}"'), ("value", _toml(one["value"]))):
                lines = f"{key} = {line}"
                new, changed = re.subn(
                    rf"(?m)^{key} = .*$", lambda _, lines=lines: lines, blocks[at]
                )
                blocks[at] = new if changed else f"{blocks[at].rstrip()}\n{lines}\n\n"
        for part in ("readings", "numbers"):
            head = f"[{table}.{part}]\n"
            blocks = [block for block in blocks if not block.startswith(head)]
            if one.get(part):
                lines = "".join(f"{_key(k)} = {_toml(v)}\n" for k, v in one[part].items())
                blocks[at] = blocks[at].rstrip() + "\n\n"
                at += 1
                blocks.insert(at, f"{head}{lines}\n")
    return "".join(blocks).rstrip() + "\n"


def update(folder: Path, file: Path = FILE) -> list[str]:
    """Write what `confirm` left in a folder into the file; return the lines that changed."""
    old = file.read_text("utf-8")
    found = [json.loads(one.read_text("utf-8")) for one in sorted(folder.glob("*.json"))]
    new = updated(old, {name: one for chapter in found for name, one in chapter.items()})
    file.write_text(new, "utf-8")
    before, after = (tomllib.loads(text) for text in (old, new))
    return [
        f"{name}: {key} was {before[kind][name].get(key)}, is {after[kind][name].get(key)}"
        for kind in ("claims", "assumptions", "numbers")
        for name in after[kind]
        for key in ("verdict", "readings", "value", "numbers")
        if before[kind][name].get(key) != after[kind][name].get(key)
    ]


if __name__ == "__main__":
    command, given = sys.argv[1], Path(sys.argv[2])
    if command == "update":
        print(*update(given) or ["nothing has changed"], sep="\n")
    else:
        Ledger().write(given)
