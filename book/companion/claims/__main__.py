"""Check every claim, print the ledger and write it: python -m book.companion.claims FOLDER."""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

from book.companion.claims.ledger import check_in_parallel
from book.companion.claims.page import VerdictCounts


def main(folder: Path) -> None:
    """Print the ledger, write claims.csv and claims.json into a folder, and hold the pins."""
    ledger = check_in_parallel()
    for entry, finding in ledger:
        about = f"{entry.weight}; {entry.place}"
        print(f"{entry.identifier:4s} {finding.verdict.upper()}   ({about})")
        for line in (entry.says, f"{finding.shown}: {finding.quantity}", finding.note):
            print(textwrap.indent(textwrap.fill(line.replace("$", ""), 92), "     "))
        print()
    print(VerdictCounts(ledger))
    for path in ledger.write(folder):
        print(f"written: {path}")
    ledger.confirm()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "build/claims"))
