"""Compare the data of the figures of two runs, byte for byte.

Usage: python tools/check_same.py FOLDER FOLDER

`make same` runs all notebooks a second time; each run writes the CSV files of its figures. Both
must have written the same.
"""

import sys
from pathlib import Path


def check(first: Path, second: Path) -> list[str]:
    """Return the files that differ, or that one run only has written."""
    problems = []
    for name in sorted(
        {file.name for folder in (first, second) for file in folder.glob("*.csv")}
    ):
        one, other = first / name, second / name
        if not (one.exists() and other.exists()):
            problems.append(f"{name} is in {first if one.exists() else second} only")
        elif one.read_bytes() != other.read_bytes():
            problems.append(f"{name} differs")
    return problems


def main() -> int:
    """Compare the folders named on the command line."""
    first, second = Path(sys.argv[1]), Path(sys.argv[2])
    problems = check(first, second)
    number = len(list(second.glob("*.csv")))
    print(*problems, sep="\n", end="\n" if problems else "")
    print(f"{number} tables of figures, {len(problems) or 'no'} differences between two runs")
    return 1 if problems or not number else 0


if __name__ == "__main__":
    sys.exit(main())
