import ast
import inspect
import re
import textwrap
from pathlib import Path

import nbformat
import pytest

from book.companion.claims import (
    Verdict,
    all_claims,
    chapter_claims,
    check,
    controller,
    single_arm,
    table1,
)
from book.companion.claims import ledger as module
from book.companion.claims.ledger import (
    PRINTED,
    Finding,
    all_names,
    chapter_of,
    claim,
    typeset,
    verdict,
)

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"


@pytest.fixture
def calls(monkeypatch):
    monkeypatch.setattr(module, "_REGISTER", {})
    monkeypatch.delenv("ARMLOCK_SHARED", raising=False)
    made = []

    @claim(
        "T1",
        place="Eq. (1)",
        also={"T3": "Eq. (3)", "S3": "Sec. II"},
        says="one < two",
        pinned=(Verdict.REPRODUCED, 1.5, 0.1),
    )
    def first():
        made.append("T1")
        return Finding({"": True}, 1.52, "s", "it is so")

    @claim("T2", place="Eq. (2)", says="b", pinned=(Verdict.DIFFERS, -2.0, 0.0))
    def second():
        return Finding({"": False}, -2.0, "rad/s", "it is not")

    return made


def test_checks_run_once_and_only_when_asked_for(calls):
    assert calls == []
    check("T1")
    ledger = check("T2", "T1")
    assert calls == ["T1"]
    assert [entry.identifier for entry, _ in ledger] == ["T2", "T1"]
    assert ledger["T1"].verdict is Verdict.REPRODUCED
    with pytest.raises(KeyError):
        ledger["T4"]


def test_a_chapter_has_all_its_claims(calls):
    ledger = chapter_claims("01_opening")
    assert [entry.identifier for entry, _ in ledger] == ["T1", "T2"]
    assert ledger.counts() == {Verdict.REPRODUCED: 1, Verdict.DIFFERS: 1}
    with pytest.raises(ValueError, match=r"^chapter must be one of 01_opening, .*; got '01'"):
        chapter_claims("01")


def test_a_claim_made_at_three_places_is_one(calls):
    assert [entry.identifier for entry in module.all_claims()] == ["T1", "T2"]
    assert all_names() == ["T1", "T3", "S3", "T2"]
    ledger = check("S3", "T3")
    assert len(ledger) == 1
    assert ledger["T3"] is ledger["S3"] is ledger["T1"]
    assert [entry.identifier for entry, _ in chapter_claims("02_single_arm")] == ["T1"]
    assert ledger.records()[0]["place"] == "Eq. (1); Eq. (3); Sec. II"


def test_formulas_are_typeset_and_claims_linked():
    text = typeset("$c₁ < 10⁻⁶$ at 2.5e-07, see claims K5 and C7; $exp(-s τ₂)$")
    assert r"\(c_{1} &lt; 10^{-6}\) at \(2.5 \times 10^{-7}\)" in text
    assert r"\(\exp (-s τ_{2})\)" in text
    for name in ("K5", "C7"):
        assert f'<a href="16_ledger.html#ledger-{name}">{name}</a>' in text


def test_a_terminal_shows_all_and_a_chapter_the_verdict(calls):
    ledger = check("T1")
    assert "reproduced: 1.52 (s). it is so" in repr(ledger)
    html = ledger._repr_html_()
    assert 'id="claim-T1"' in html
    assert "one &lt; two" in html
    assert "verdict-reproduced" in html


@pytest.mark.parametrize(
    "found",
    [
        Finding({"": {"one": True, "two": False}}, 1.5, "s", ""),
        Finding({"": True}, 1.7, "s", ""),
        Finding({"": True}, float("nan"), "s", ""),
    ],
)
def test_what_is_not_as_pinned_is_named(calls, found):
    ledger = check("T1", "T2")
    ledger.confirm()
    ledger.entries[0] = (ledger.entries[0][0], found)
    with pytest.raises(AssertionError, match=r"^T1 is pinned as reproduced, 1.5 within 0.1"):
        ledger.confirm()


def test_an_identifier_is_taken_once_and_known(calls):
    again = claim("S3", place="", says="", pinned=(Verdict.OPEN, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^identifier must be new, got 'S3'"):
        again(calls)
    with pytest.raises(ValueError, match=r"^identifier must be one of T1, .*; got 'T9'"):
        check("T9")


# The rule ------------------------------------------------------------------------------

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
    found = Finding(readings, 0.0, "", "", missing)
    assert found.verdict is expected
    with pytest.raises(TypeError):
        Finding(readings, 0.0, "", "", missing, verdict=expected)  # type: ignore[call-arg]


def test_readings_are_named_with_what_was_found():
    found = Finding({"one": True, "two": PARTLY}, 0.0, "", "", "the scale")
    assert found.tried == [
        "one: found",
        "two, this: found",
        "two, that: not found",
        "not printed: the scale",
    ]
    assert Finding({"": True}, 0.0, "", "").tried == []


@pytest.mark.parametrize(
    ("chapter", "check", "name", "value", "expected"),
    [
        (table1, "common_row", "HALF_DIFFERENCE", table1.FULL_DIFFERENCE, Verdict.DIFFERS),
        (single_arm, "below_one", "lowest_stable_k2", lambda *_: -1.2, Verdict.DIFFERS),
        (single_arm, "closed_form_region", "lowest_stable_b", lambda *_: -2.0, Verdict.DIFFERS),
        (
            controller,
            "stable_over_the_box",
            "WORST_CORNER",
            (1 + 2e-6, 1 - 2e-6),
            Verdict.DIFFERS,
        ),
    ],
)
def test_a_check_can_fail(monkeypatch, chapter, check, name, value, expected):
    """A different ingredient leads to a different verdict."""
    monkeypatch.setattr(chapter, name, value)
    assert getattr(chapter, check).__wrapped__().verdict is expected


# The claims of the book ----------------------------------------------------------------


@pytest.mark.parametrize("chapter", dict.fromkeys(map(chapter_of, all_names())))
def test_a_chapter_shows_its_claims_and_confirms_them(chapter):
    notebook = nbformat.read(NOTEBOOKS / f"{chapter}.ipynb", 4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    lines = [line for cell in cells for line in cell.source.splitlines()]
    assert f'ledger = chapter_claims("{chapter}")' in lines
    assert "ledger.confirm()" in lines
    # The page shows the last line of a cell.
    hidden = {"remove-cell", "remove-output"}
    shown = [c.source for c in cells if not hidden & set(c.metadata.get("tags", ()))]
    assert any(source.splitlines()[-1:] == ["ledger"] for source in shown)


def test_a_claim_names_other_claims():
    for entry in all_claims():
        assert set(entry.affects) <= set(all_names()) - {entry.identifier}


def test_an_erratum_quotes_the_paper_and_a_note_is_short():
    """From the source, because to check all claims takes a minute."""
    for entry in all_claims():
        if entry.pinned[0] in (Verdict.NOT_AS_WRITTEN, Verdict.DIFFERS):
            assert entry.printed, entry.identifier
        source = textwrap.dedent(inspect.getsource(inspect.unwrap(entry.check)))
        calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
        for call in (call for call in calls if ast.unparse(call.func) == "Finding"):
            quantity, note = (ast.unparse(argument) for argument in call.args[2:4])
            assert len(quantity) > 2, entry.identifier
            sentences = re.split(r"(?<!Sec)(?<!Fig)[.?!] (?=[A-Z$])", note)
            assert len(note) > 2, entry.identifier
            assert len(sentences) <= 3, (entry.identifier, note)


def test_every_module_with_claims_is_imported():
    there = {file.stem for file in Path(module.__file__).parent.glob("*.py")}
    known = {
        inspect.unwrap(entry.check).__module__.rpartition(".")[2] for entry in all_claims()
    }
    assert there - known == {"__init__", "__main__", "assumptions", "ledger", "page"}
