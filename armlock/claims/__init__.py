"""The paper's claims as executable checks, one module a section of the paper."""

from armlock.claims.ledger import Claim, Finding, Ledger, Verdict, all_claims, check, claim

__all__ = ["Claim", "Finding", "Ledger", "Verdict", "all_claims", "check", "claim"]
