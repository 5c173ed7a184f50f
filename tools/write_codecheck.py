"""Write codecheck.yml, the CODECHECK manifest: what the book computes, file by file.

Usage: python tools/write_codecheck.py [--check [FOLDER]]

Every picture that a notebook names is listed with the first sentence of its caption. So is
the ledger of claims. With --check nothing is written, and a manifest that is out of date is an
error. FOLDER is a built book: it must hold what is listed, and no other figures.
"""

import json
import re
import sys
from pathlib import Path

MANIFEST = Path("codecheck.yml")
HEAD = """\
# CODECHECK manifest, written by tools/write_codecheck.py: `make book` computes these files from
# nothing.
---
version: https://codecheck.org.uk/spec/config/1.0/
paper:
  title: >-
    Robustness Analysis and Controller Design of Arm-locking System in Space-based
    Gravitational Wave Detectors
  authors:
    - name: Yongbin Shao
    - name: Xinyi Zhao
    - name: Long Ma
    - name: Ming Xin
manifest:
"""
BOOK = "build/html"
CLAIMS = {
    "claims.csv": "Every claim with its verdict and the number that decides it",
    "claims.json": "The same as JSON",
}


def published(notebook: Path) -> dict[str, str]:
    """Return the figures of a notebook, each with the first sentence of its caption."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    shown = [cell["metadata"].get("mystnb", {}) for cell in cells]
    figures = [one["figure"] for one in shown if "image" in one and "figure" in one]
    return {
        f"{figure['name'].removeprefix('fig-')}.svg": first_sentence(figure.get("caption", ""))
        for figure in figures
        if "name" in figure
    }


def first_sentence(text: str) -> str:
    """Return the first sentence of a caption, on one line."""
    return re.split(
        r"(?<!Fig)(?<!Figs)(?<!Eq)(?<!Eqs)(?<!Sec)(?<!Secs)\.\s",
        " ".join(text.split()) + " ",
        maxsplit=1,
    )[0]


def listed() -> dict[str, str]:
    """Return the files in the folder of figures, each with what it holds."""
    notebooks = sorted(Path("notebooks").glob("*.ipynb"))
    return CLAIMS | {k: text for path in notebooks for k, text in published(path).items()}


def manifest(files: dict[str, str]) -> str:
    """Return the text of the manifest."""
    entries = [
        f"  - file: {BOOK}/figures/{file}\n"
        f"    comment: {json.dumps(comment, ensure_ascii=False)}\n"
        for file, comment in files.items()
    ]
    return HEAD + "".join(entries)


def differences(files: dict[str, str], book: Path) -> list[str]:
    """Return how the list differs from what is in a built book."""
    there = {file.name for file in (book / "figures").iterdir()}
    figures = {name for name in there if name.endswith(".svg")}
    missing = [f"{name} is listed, and nothing writes it" for name in files.keys() - there]
    return sorted(missing) + [
        f"{name} is not listed" for name in sorted(figures - files.keys())
    ]


def main() -> int:
    """Write or check the manifest in the current folder."""
    files = listed()
    text = manifest(files)
    if "--check" not in sys.argv:
        MANIFEST.write_text(text, encoding="utf-8")
        return 0
    problems = [differences(files, Path(folder)) for folder in sys.argv[2:]]
    lines = [f"{MANIFEST}: {line}" for problem in problems for line in problem]
    if not MANIFEST.exists() or MANIFEST.read_text(encoding="utf-8") != text:
        lines.append(f"{MANIFEST} does not list what the notebooks publish: make format does")
    print(*lines, sep="\n", end="\n" if lines else "")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
