import csv
import json
from html.parser import HTMLParser

import pytest

from armlock import CommonArm
from book.companion.claims import Weight, check
from book.companion.claims.assumptions import break_along
from book.companion.claims.page import (
    Errata,
    LedgerPage,
    VerdictCounts,
)


class Ids(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.ids, self.open = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.ids += [value for name, value in attrs if name == "id"]
        if tag not in ("br", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture
def ledger():
    return check("T1", "T2", "C2")


def test_the_page_has_a_row_a_claim_with_its_chapter_and_source(ledger, monkeypatch):
    monkeypatch.delenv("ARMLOCK_FIGURES", raising=False)
    text = LedgerPage(ledger)._repr_html_()
    page = Ids(text)
    assert page.open == []
    assert page.ids == ["ledger-T1", "ledger-T2", "ledger-C2"]
    assert 'href="01_opening.html#claim-T1"' in text
    assert "def common_row()" in text
    assert "claims.csv" not in text
    assert 'data-verdict="not_as_written"' in text
    assert 'data-weight="derivation"' in text
    assert 'data-section="Sec. I and Table I"' in text


def test_the_page_offers_the_ledger_as_data(ledger, monkeypatch, tmp_path):
    monkeypatch.setenv("ARMLOCK_FIGURES", str(tmp_path))
    text = LedgerPage(ledger)._repr_html_()
    assert 'href="../figures/claims.csv"' in text
    with (tmp_path / "claims.csv").open() as stream:
        assert [row["claim"] for row in csv.DictReader(stream)] == ["T1", "T2", "C2"]
    assert len(json.loads((tmp_path / "claims.json").read_text())) == 3


def test_counts_are_of_physics_and_of_the_white_paper_by_itself():
    counts = VerdictCounts(check("T6", "W7"))
    assert "1 finding of physics: 1 reproduced" in repr(counts)
    assert "1 of the white paper: 1 reproduced" in repr(counts)
    assert "differs" not in counts._repr_html_()


def test_errata_are_what_is_not_as_printed(ledger):
    found = Errata(ledger)
    assert [claim.identifier for claim, _ in found.entries] == ["T2"]
    assert Ids(found._repr_html_()).ids == ["erratum-T2"]
    assert "<dt>Printed</dt>" in found._repr_html_()
    assert len(Errata(ledger, Weight.PHYSICS)) == 0
    # Claims with one finding share one.
    shared = Errata(check("T2", "T3"))
    assert [claim.identifier for claim, _ in shared.entries] == ["T2"]
    assert '<dt>The same finding</dt><dd><a href="09_ledger.html#ledger-T3">' in (
        shared._repr_html_()
    )


def test_a_loop_that_is_unstable_has_no_first_break():
    assert break_along(CommonArm(), (1.0, 0.0)) == 0.0
