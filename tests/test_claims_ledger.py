import inspect
import itertools
import re
from pathlib import Path

import nbformat
import pytest

from book.companion.claims import Verdict, Weight, all_claims, chapter_claims, check
from book.companion.claims import ledger as module
from book.companion.claims.ledger import Finding, Ledger, claim, decide, typeset
from book.companion.claims.page import SECTIONS, whole_ledger

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"


@pytest.fixture
def calls(monkeypatch):
    monkeypatch.setattr(module, "_REGISTER", {})
    monkeypatch.delenv("ARMLOCK_SHARED", raising=False)
    made = []

    @claim(
        "X1",
        place="Eq. (1)",
        says="one < two",
        chapter="00",
        pinned=(Verdict.REPRODUCED, 1.5, 0.1),
    )
    def first():
        made.append("X1")
        return Finding(Verdict.REPRODUCED, 1.52, "s", "it is so")

    @claim("X2", place="Eq. (2)", says="b", chapter="00", pinned=(Verdict.DIFFERS, -2.0, 0.0))
    def second():
        return Finding(Verdict.DIFFERS, -2.0, "rad/s", "it is not")

    return made


def test_checks_run_once_and_only_when_asked_for(calls):
    assert calls == []
    check("X1")
    ledger = check("X2", "X1")
    assert calls == ["X1"]
    assert [entry.identifier for entry, _ in ledger] == ["X2", "X1"]
    assert ledger["X1"].verdict is Verdict.REPRODUCED
    with pytest.raises(KeyError):
        ledger["X3"]


def test_a_chapter_has_all_its_claims(calls):
    ledger = chapter_claims("00")
    assert [entry.identifier for entry, _ in ledger] == ["X1", "X2"]
    assert ledger.counts() == {Verdict.REPRODUCED: 1, Verdict.DIFFERS: 1}
    with pytest.raises(ValueError, match=r"^chapter must be one of 00; got '01'"):
        chapter_claims("01")


def test_claims_with_one_finding_count_once(calls):
    claim("X3", place="", says="", chapter="00", pinned=(Verdict.OPEN, 0.0, 0.0), same_as="X1")(
        lambda: Finding(Verdict.OPEN, 0.0, "", "")
    )
    ledger = check("X1", "X2", "X3")
    assert ledger.counts(Weight.PHYSICS).total() == 2
    assert ledger.counts(Weight.WORDING).total() == 0


def test_formulas_are_typeset_and_claims_linked():
    text = typeset("$c₁ < 10⁻⁶$ at 2.5e-07, see claims K5 and C7; $exp(-s τ₂)$")
    assert r"\(c_{1} &lt; 10^{-6}\) at \(2.5 \times 10^{-7}\)" in text
    assert r"\(\exp (-s τ_{2})\)" in text
    for name in ("K5", "C7"):
        assert f'<a href="09_ledger.html#ledger-{name}">{name}</a>' in text


def test_tables_hold_verdict_number_and_note(calls):
    ledger = check("X1")
    assert "reproduced: 1.52 (s). it is so" in repr(ledger)
    html = ledger._repr_html_()
    assert 'id="claim-X1"' in html
    assert "one &lt; two" in html
    assert "verdict-reproduced" in html


@pytest.mark.parametrize(
    "found",
    [
        Finding(Verdict.IN_PART, 1.5, "s", ""),
        Finding(Verdict.REPRODUCED, 1.7, "s", ""),
        Finding(Verdict.REPRODUCED, float("nan"), "s", ""),
    ],
)
def test_what_is_not_as_pinned_is_named(calls, found):
    ledger = check("X1", "X2")
    ledger.confirm()
    ledger.entries[0] = (ledger.entries[0][0], found)
    with pytest.raises(AssertionError, match=r"^X1 is pinned as reproduced, 1.5 within 0.1"):
        ledger.confirm()


def test_an_identifier_is_taken_once_and_known(calls):
    again = claim("X1", place="", says="", chapter="", pinned=(Verdict.OPEN, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^identifier must be new, got 'X1'"):
        again(calls)
    with pytest.raises(ValueError, match=r"^identifier must be one of X1, X2; got 'X9'"):
        check("X9")


def test_a_verdict_follows_from_the_parts_that_hold():
    for parts in itertools.product((False, True), repeat=2):
        expected = (Verdict.DIFFERS, Verdict.IN_PART, Verdict.REPRODUCED)[sum(parts)]
        assert decide(*parts) is expected
        mended = decide(*parts, corrected=True)
        assert mended is (Verdict.REPRODUCED if all(parts) else Verdict.NOT_AS_WRITTEN)
        assert decide(*parts, settled=False) is Verdict.OPEN
        limited = decide(*parts, beyond=False)
        assert limited is (Verdict.WHERE_USED if all(parts) else expected)


# The claims of the book ----------------------------------------------------------------


@pytest.fixture(scope="module")
def everything():
    return whole_ledger()


@pytest.mark.parametrize("identifier", [entry.identifier for entry in all_claims()])
def test_a_claim_is_as_pinned(identifier, everything):
    (pair,) = [pair for pair in everything if pair[0].identifier == identifier]
    Ledger([pair]).confirm()
    assert pair[1].quantity
    assert pair[1].note


@pytest.mark.parametrize("chapter", dict.fromkeys(entry.chapter for entry in all_claims()))
def test_a_chapter_shows_its_claims_and_confirms_them(chapter):
    notebook = nbformat.read(NOTEBOOKS / f"{chapter}.ipynb", 4)
    cells = [
        cell.source.splitlines()
        for cell in notebook.cells
        if cell.cell_type == "code"
        and not {"remove-cell", "remove-output"} & set(cell.metadata.get("tags", ()))
    ]
    lines = [line for cell in cells for line in cell]
    assert f'ledger = chapter_claims("{chapter}")' in lines
    assert "ledger.confirm()" in lines
    assert chapter in SECTIONS
    # The last line of a cell is what the page shows.
    assert any(cell and cell[-1] == "ledger" for cell in cells)


def test_a_claim_names_other_claims():
    known = {entry.identifier for entry in all_claims()}
    for entry in all_claims():
        assert {*entry.affects, entry.same_as} <= {*known, ""} - {entry.identifier}


def test_an_erratum_quotes_the_paper_and_a_note_is_short(everything):
    for entry, finding in everything:
        if finding.verdict in (Verdict.NOT_AS_WRITTEN, Verdict.DIFFERS):
            assert entry.printed, entry.identifier
        sentences = re.split(r"(?<!Sec)(?<!Fig)[.?!] (?=[A-Z$])", finding.note)
        assert len(sentences) <= 3, (entry.identifier, finding.note)


def test_every_module_with_claims_is_imported():
    there = {file.stem for file in Path(module.__file__).parent.glob("*.py")}
    known = {
        inspect.unwrap(entry.check).__module__.rpartition(".")[2] for entry in all_claims()
    }
    assert there - known == {"__init__", "__main__", "assumptions", "ledger", "page"}
