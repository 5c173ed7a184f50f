"""Run the code of each chapter as the built book shows it, copied from the page, in order.

Usage: python tools/check_cells.py FOLDER [PAGE ...]

Cells that a reader can unfold count as shown. A chapter runs in a process of its own, as it
would in a terminal. FOLDER is the built book.
"""

import html
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

CELL = re.compile(r'<div class="cell_input [^>]*>.*?<pre>(.*?)</pre>', re.DOTALL)


def shown(page: Path) -> list[str]:
    """Return the code of a page, cell by cell."""
    cells = CELL.findall(page.read_text(encoding="utf-8"))
    return [html.unescape(re.sub(r"<[^>]+>", "", cell)) for cell in cells]


def run(page: Path) -> str:
    """Run the code of a page; return what went wrong, or nothing."""
    with tempfile.TemporaryDirectory() as folder:
        figures = Path(folder) / "figures"
        figures.mkdir()
        code = Path(folder) / f"{page.stem}.py"
        code.write_text("\n\n".join(shown(page)), encoding="utf-8")
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
    with ThreadPoolExecutor(2) as pool:
        errors = list(pool.map(run, pages))
    failed = {page.name: error for page, error in zip(pages, errors, strict=True) if error}
    for name, error in failed.items():
        print(f"{name}, its code run in order:\n{error}")
    print(f"The code of {len(pages)} pages runs in order, but for {len(failed)}")
    return 1 if failed or not pages else 0


if __name__ == "__main__":
    sys.exit(main())
