import pytest

from book.companion.claims import Finding, Ledger, Verdict, all_claims, check, claim
from book.companion.claims import ledger as module


@pytest.fixture
def register(monkeypatch):
    monkeypatch.setattr(module, "_REGISTER", {})


@pytest.fixture
def calls(register):
    made = []

    @claim("X1", place="Eq. (1)", says="one < two", chapter="00")
    def first():
        made.append("X1")
        return Finding(Verdict.REPRODUCED, 1.5, "s", "it is so")

    @claim("X2", place="Eq. (2)", says="b", chapter="00")
    def second():
        return Finding(Verdict.DIFFERS, -2.0, "rad/s", "it is not")

    return made


def test_checks_run_once_and_only_when_asked_for(calls):
    assert calls == []
    check("X1")
    check("X1", "X2")
    assert calls == ["X1"]


def test_findings_are_looked_up_by_identifier(calls):
    ledger = check("X2", "X1")
    assert ledger["X1"].verdict is Verdict.REPRODUCED
    assert ledger["X2"].value == -2.0
    assert [entry.identifier for entry, _ in ledger] == ["X2", "X1"]
    assert len(ledger) == 2
    with pytest.raises(KeyError):
        ledger["X3"]


def test_verdicts_are_counted(calls):
    assert Ledger(all_claims()).counts() == {Verdict.REPRODUCED: 1, Verdict.DIFFERS: 1}


def test_tables_hold_verdict_number_and_note(calls):
    ledger = check("X1")
    assert "reproduced: 1.5 (s). it is so" in repr(ledger)
    html = ledger._repr_html_()
    assert 'id="claim-X1"' in html
    assert "one &lt; two" in html
    assert "verdict-reproduced" in html


def test_an_identifier_is_taken_once(calls):
    with pytest.raises(ValueError, match=r"^identifier must be new, got 'X1'"):
        claim("X1", place="", says="", chapter="")(calls)


def test_an_unknown_identifier_is_named(calls):
    with pytest.raises(ValueError, match=r"^identifier must be one of X1, X2; got 'X9'"):
        check("X9")
