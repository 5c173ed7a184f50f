"""Run the code of each chapter as the built book shows it, copied from the page, in order.

Usage: python tools/check_cells.py FOLDER [PAGE ...]

Each chapter runs twice, in processes of their own, as it would in a terminal: the open cells
after *Imports*, and all cells, those that a reader can unfold included. FOLDER is the built
book.
"""

import html
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

#: A cell: what stands between its begin and its code, which names it if it is folded; its code.
CELL = re.compile(
    r'<div class="cell\b((?:(?!<div).)*)<div class="cell_input [^>]*>.*?<pre>(.*?)</pre>',
    re.DOTALL,
)


def shown(page: Path, folded: bool = True) -> list[str]:
    """Return the code of a page, cell by cell; of the folded cells, if need be, the imports."""
    cells = CELL.findall(page.read_text(encoding="utf-8"))
    return [
        html.unescape(re.sub(r"<[^>]+>", "", code))
        for head, code in cells
        if folded or "<details" not in head or "Imports" in head
    ]


def run(page: Path, folded: bool) -> str:
    """Run the code of a page; return what went wrong, or nothing."""
    with tempfile.TemporaryDirectory() as folder:
        figures = Path(folder) / "figures"
        figures.mkdir()
        code = Path(folder) / f"{page.stem}.py"
        code.write_text("\n\n".join(shown(page, folded)), encoding="utf-8")
        environment = os.environ | {"MPLBACKEND": "Agg", "ARMLOCK_FIGURES": str(figures)}
        command = [sys.executable, "-W", "error", str(code)]
        result = subprocess.run(command, env=environment, capture_output=True, text=True)
    return result.stderr if result.returncode else ""


def main() -> int:
    """Run the chapters of the folder named on the command line, two at a time."""
    folder = Path(sys.argv[1])
    named = [folder / name for name in sys.argv[2:]]
    found = named or sorted((folder / "notebooks").glob("*.html"))
    pages = [page for page in found if shown(page)]
    runs = [(page, folded) for page in pages for folded in (False, True)]
    with ThreadPoolExecutor(2) as pool:
        errors = list(pool.map(run, *zip(*runs, strict=True)))
    failed = [one for one in zip(runs, errors, strict=True) if one[1]]
    for (page, folded), error in failed:
        cells = "all its cells" if folded else "its open cells"
        print(f"{page.name}, {cells} run in order:\n{error}")
    print(
        f"The code of {len(pages)} pages ran in order; {len(failed)} of {len(runs)} runs failed"
    )
    return 1 if failed or not pages else 0


if __name__ == "__main__":
    sys.exit(main())
