import csv
import json
from html.parser import HTMLParser

import pytest

from armlock import CommonArm
from book.companion.claims import Verdict, Weight, check
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
    return check("T1", "D10", "C12")


def test_the_page_has_a_row_a_claim_with_its_chapter_and_source(ledger):
    text = LedgerPage(ledger)._repr_html_()
    page = Ids(text)
    assert page.open == []
    assert page.ids == ["ledger-T1", "ledger-D10", "ledger-C6", "ledger-C12"]
    assert 'href="01_opening.html#claim-T1"' in text
    assert "def convention_of_difference()" in text
    assert 'data-verdict="not_as_written"' in text
    assert "τ the round trip: not found" in text
    assert Verdict.ONE_READING.clause in text
    assert 'data-weight="derivation"' in text
    assert 'data-section="Sec. I and Table I"' in text


def test_the_ledger_is_written_as_data(ledger, tmp_path):
    table, tree = ledger.write(tmp_path)
    assert f'href="../figures/{table.name}"' in LedgerPage(ledger)._repr_html_()
    with table.open() as stream:
        assert [row["claim"] for row in csv.DictReader(stream)] == ["T1", "D10", "C6 C12"]
    assert len(json.loads(tree.read_text())) == 3


def test_counts_are_of_physics_and_of_the_white_paper_by_itself():
    counts = VerdictCounts(check("S4", "W7"))
    assert "1 claim of physics: 1 reproduced" in repr(counts)
    assert "1 claim of the white paper: 1 reproduced" in repr(counts)
    assert "differs" not in counts._repr_html_()


def test_errata_are_what_is_not_as_printed(ledger):
    found = Errata(ledger, Verdict.NOT_AS_WRITTEN)
    assert [claim.identifier for claim, _ in found.entries] == ["D10"]
    assert Ids(found._repr_html_()).ids == ["erratum-D10"]
    assert "<dt>Printed</dt>" in found._repr_html_()
    assert len(Errata(ledger, Verdict.NOT_AS_WRITTEN, Weight.PHYSICS)) == 0


def test_a_loop_that_is_unstable_has_no_first_break():
    assert break_along(CommonArm(), (1.0, 0.0)) == 0.0
