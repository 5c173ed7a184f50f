"""The paper's claims as executable checks, one module a section of the paper."""

from book.companion.claims.ledger import Verdict, Weight, all_claims, chapter_claims, check

# In the order of the paper, which is the order of the register.
from book.companion.claims import table1  # isort: skip
from book.companion.claims import simulation  # isort: skip
from book.companion.claims import appendix  # isort: skip

__all__ = [
    "Verdict",
    "Weight",
    "all_claims",
    "appendix",
    "chapter_claims",
    "check",
    "simulation",
    "table1",
]
