"""The rule of verdicts, the file of claims, and how a chapter is held against it."""

import csv
import json
import re
import tomllib
from pathlib import Path

import pytest

from book.companion import ledger as module
from book.companion.ledger import (
    PRINTED,
    Ledger,
    Verdict,
    confirm,
    fill,
    update,
    updated,
    verdict,
)

PARTLY = {"this": True, "that": False}


@pytest.mark.parametrize(
    ("readings", "missing", "expected"),
    [
        ({"": True}, "", Verdict.REPRODUCED),
        ({"one": True, "two": {"this": True, "that": True}}, "", Verdict.REPRODUCED),
        ({"one": True, "two": False}, "", Verdict.ONE_READING),
        ({"one": PARTLY, "two": True}, "", Verdict.ONE_READING),
        ({"": PARTLY}, "", Verdict.IN_PART),
        ({"one": PARTLY, "two": False}, "", Verdict.IN_PART),
        ({"": False}, "", Verdict.DIFFERS),
        ({"one": False, "two": {"this": False}}, "", Verdict.DIFFERS),
        ({PRINTED: False, "corrected": True}, "", Verdict.NOT_AS_WRITTEN),
        ({PRINTED: PARTLY, "corrected": True}, "", Verdict.NOT_AS_WRITTEN),
        ({PRINTED: True, "corrected": True}, "", Verdict.REPRODUCED),
        ({PRINTED: True, "corrected": False}, "", Verdict.ONE_READING),
        ({PRINTED: False, "corrected": True, "otherwise": False}, "", Verdict.ONE_READING),
        ({PRINTED: False, "corrected": PARTLY}, "", Verdict.IN_PART),
        ({PRINTED: False, "corrected": False}, "", Verdict.DIFFERS),
        ({}, "the scale", Verdict.OPEN),
        ({"large": False, "small": True}, "the scale", Verdict.OPEN),
        ({"large": True, "small": True}, "the scale", Verdict.REPRODUCED),
        ({"large": False, "small": False}, "the scale", Verdict.DIFFERS),
    ],
)
def test_a_verdict_follows_from_the_readings(readings, missing, expected):
    assert verdict(readings, missing) is expected


def test_no_reading_is_no_verdict():
    with pytest.raises(ValueError, match=r"^readings must not be empty"):
        verdict({})


def test_numbers_of_a_text_are_written_for_a_reader():
    numbers = {"half": 6.3262e-7, "count": 3}
    assert fill(r"{count:d} of $\frac{a}{b}$: {half:.2g}", numbers) == (
        r"3 of $\frac{a}{b}$: 6.3 × 10⁻⁷"
    )
    with pytest.raises(KeyError):
        fill("{other:.2g}", numbers)


# The file of the book -----------------------------------------------------------------------

BOOK = Ledger()


@pytest.mark.parametrize("claim", BOOK.claims.values(), ids=lambda claim: claim.name)
def test_a_claim_has_what_a_reader_needs(claim):
    names = {name for one in BOOK for name in one.names}
    assert set(claim.affects) <= names - {claim.name}
    assert claim.name[0] in BOOK.sections
    if claim.verdict in (Verdict.NOT_AS_WRITTEN, Verdict.DIFFERS):
        assert claim.printed
    texts = claim.quantity, claim.criterion, claim.note
    assert len(re.split(r"(?<!Sec)(?<!Fig)[.?!] (?=[A-Z$])", claim.note)) <= 3
    # Each number of the file stands in a text, and each text has its numbers.
    used = {place for text in texts for place in re.findall(r"\{(\w+):[^{}]*\}", text)}
    assert used - {"value"} == set(claim.numbers)


def test_the_ledger_is_written_as_data(tmp_path):
    BOOK.write(tmp_path)
    with (tmp_path / "claims.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert (
        len(rows) == len(json.loads((tmp_path / "claims.json").read_text())) == len(BOOK.claims)
    )
    assert rows[0]["claim"].split() == list(next(iter(BOOK)).names)
    assert sum(met.total() for met in BOOK.tally().values()) == len(rows)


NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
CHAPTERS = sorted(NOTEBOOKS.glob("*.ipynb"))


@pytest.mark.parametrize("notebook", CHAPTERS, ids=lambda path: path.stem)
def test_a_chapter_decides_its_claims_in_sight_and_is_held_against_the_file(notebook):
    cells = json.loads(notebook.read_text("utf-8"))["cells"]
    cells = [(cell["metadata"].get("tags", []), "".join(cell["source"])) for cell in cells]
    shown = [text for tags, text in cells if not {"remove-cell", "remove-input"} & set(tags)]
    decided = re.findall(r'(?m)^claims\["(\w+)"\] = ', "\n".join(shown))
    numbers = re.findall(r'(?m)^numbers\["(\w+)"\] = ', "\n".join(shown))
    assert sorted(decided + numbers) == sorted(BOOK.of(notebook.stem))
    if decided:
        assert any("```{claims}\n```" in text for text in shown)
    if decided or numbers:
        assert any(f'ledger.confirm("{notebook.stem}"' in text for _, text in cells)


# A chapter and a file -----------------------------------------------------------------------

FILE = """# A comment that stays.
[sections]
K = 'Sec. IV.B'

[claims.K5]
chapter = "08_controller"
place = 'Sec. IV.B'
also = { K12 = 'Abstract' }
says = 'It is stable.'
weight = "physics"
quantity = 'half-width'
note = 'Half of it allows {half:.3g}.'
verdict = "reproduced"
value = 1.5
tolerance = 0.1

[claims.K5.readings]
whole = true

[claims.K5.numbers]
half = 0.6

[claims.K11]
chapter = "08_controller"
place = 'Sec. IV.B'
says = 'The gain suffices.'
weight = "physics"
quantity = 'suppression'
missing = 'the requirement'
verdict = "cannot be settled"
value = 973.0
tolerance = 1.0

[assumptions.scale]
chapter = "09_simulation"
title = 'The scale'

[numbers.tdi]
chapter = "08_controller"
unit = 'pm'

[numbers.tdi.numbers]
left = 6.6
"""
CLAIMS = {"K5": ({"whole": True}, 1.52, {"half": 0.6}), "K11": ({}, 973.0)}
NUMBERS = {"tdi": {"left": 6.6}}


@pytest.fixture
def file(tmp_path, monkeypatch):
    path = tmp_path / "claims.toml"
    path.write_text(FILE)
    monkeypatch.setattr(module, "FILE", path)
    monkeypatch.delenv("ARMLOCK_FOUND", raising=False)
    return path


def test_a_chapter_that_agrees_is_confirmed(file):
    confirm("08_controller", CLAIMS, NUMBERS)
    assert Ledger()["K12"].name == "K5"
    assert Ledger()["K11"].tried == [
        "not printed: the requirement",
        "no reading was tried: no check decides",
    ]


@pytest.mark.parametrize(
    ("claims", "numbers", "message"),
    [
        ({"K5": ({"whole": False}, 1.5, {"half": 0.6})}, {}, "K5: the file has readings"),
        ({"K5": (True, 1.5, {"half": 0.6})}, {}, "K5: the file has readings"),
        ({"K5": ({"whole": True}, 1.7, {"half": 0.6})}, {}, "K5: the file has value 1.5"),
        ({"K5": ({"whole": True}, float("nan"), {"half": 0.6})}, {}, "K5: the file has value"),
        ({"K5": ({"whole": True}, 1.5, {"half": 0.7})}, {}, "K5: the file has half 0.6"),
        ({"K5": ({"whole": True}, 1.5)}, {}, "K5: the file has numbers in one of both only"),
        ({"K6": (True, 1.0)}, {}, "K6: in the chapter only"),
        ({}, {"tdi": {"left": 6.7}}, "tdi: the file has left 6.6, found 6.7"),
    ],
)
def test_what_differs_is_named(file, claims, numbers, message):
    with pytest.raises(AssertionError, match=re.escape(message)):
        confirm("08_controller", CLAIMS | claims, NUMBERS | numbers)


def test_what_a_chapter_leaves_out_is_named(file):
    with pytest.raises(AssertionError, match="K11: in the file only"):
        confirm("08_controller", {"K5": CLAIMS["K5"]}, NUMBERS)


def test_a_verdict_of_the_file_follows_from_its_readings(file):
    file.write_text(FILE.replace("whole = true", "whole = false"))
    with pytest.raises(ValueError, match=r"^verdict of K5 must follow from its readings"):
        Ledger()


def test_an_identifier_is_taken_once(file):
    file.write_text(FILE.replace("K12 =", "K11 ="))
    with pytest.raises(ValueError, match=r"^identifiers must be different, got K11 twice"):
        Ledger()


def test_the_file_is_updated_and_what_changes_is_told(file, tmp_path, monkeypatch):
    found = tmp_path / "found"
    found.mkdir()
    monkeypatch.setenv("ARMLOCK_FOUND", str(found))
    new = {"whole": True, "half of it": {"stable": False}}
    confirm(
        "08_controller", {"K5": (new, 1.6), "K11": (True, 9e2, {"n": 3})}, {"tdi": {"a": 1}}
    )
    monkeypatch.delenv("ARMLOCK_FOUND")
    lines = update(found, file)
    assert "K5: verdict was reproduced, is reproduced in one reading" in lines
    text = file.read_text()
    assert text.startswith("# A comment that stays.\n")
    data = tomllib.loads(text)
    assert data["claims"]["K5"]["readings"] == new
    assert "numbers" not in data["claims"]["K5"]
    assert data["claims"]["K11"]["numbers"] == {"n": 3}
    assert data["numbers"]["tdi"]["numbers"] == {"a": 1}
    assert data["assumptions"] == tomllib.loads(FILE)["assumptions"]
    assert update(found, file) == []
    with pytest.raises(ValueError, match=r"^the file must have an entry for K7"):
        updated(text, {"K7": {"numbers": {}}})
