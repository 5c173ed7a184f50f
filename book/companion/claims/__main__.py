"""Check every claim, print the ledger and write it: python -m book.companion.claims FOLDER."""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

from book.companion.claims.ledger import check_in_parallel


def main(folder: Path) -> None:
    """Print the ledger, write claims.csv and claims.json into a folder, and hold the pins."""
    ledger = check_in_parallel()
    for entry, finding in ledger:
        print(f"{entry.identifier:4s} {finding.verdict.upper()}   ({entry.place})")
        for line in (entry.says, f"{finding.value:.6g}: {finding.quantity}", finding.note):
            print(textwrap.indent(textwrap.fill(line, 92), "     "))
        print()
    counts = ledger.counts()
    print(f"{len(ledger)} claims: " + ", ".join(f"{n} {v}" for v, n in counts.items()))
    for path in ledger.write(folder):
        print(f"written: {path}")
    ledger.confirm()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "build/claims"))
