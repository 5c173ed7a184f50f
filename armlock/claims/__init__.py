"""The paper's claims as executable checks, one module a section of the paper."""

from armlock.claims.ledger import Claim, Finding, Ledger, Verdict, all_claims, check, claim

# In the order of the paper, which is the order of the register.
from armlock.claims import table1  # isort: skip
from armlock.claims import single_arm  # isort: skip
from armlock.claims import common_arm  # isort: skip
from armlock.claims import dual_arm  # isort: skip
from armlock.claims import nyquist_cases  # isort: skip
from armlock.claims import controller  # isort: skip
from armlock.claims import simulation  # isort: skip
from armlock.claims import appendix  # isort: skip

__all__ = [
    "Claim",
    "Finding",
    "Ledger",
    "Verdict",
    "all_claims",
    "appendix",
    "check",
    "claim",
    "common_arm",
    "controller",
    "dual_arm",
    "nyquist_cases",
    "simulation",
    "single_arm",
    "table1",
]
