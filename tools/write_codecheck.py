"""Write codecheck.yml, the CODECHECK manifest: what the book computes, file by file.

Usage: python tools/write_codecheck.py [--check]

Every figure that a notebook publishes is listed with the first sentence of its caption. So is
the ledger of claims. With --check nothing is written, and a manifest that is out of date is an
error.
"""

import ast
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


def published(notebook: Path) -> list[tuple[str, str]]:
    """Return the files that a notebook publishes, each with the caption of its figure."""
    found, caption = [], ""
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] != "code":
            continue
        figure = cell["metadata"].get("mystnb", {}).get("figure", {})
        caption = figure.get("caption", caption)
        for node in ast.walk(ast.parse("".join(cell["source"]))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "figures.publish":
                name = ast.literal_eval(node.args[1])
                found.append((f"{name}.svg", first_sentence(caption)))
    return found


def first_sentence(text: str) -> str:
    """Return the first sentence of a caption, on one line."""
    return re.split(
        r"(?<!Fig)(?<!Figs)(?<!Eq)(?<!Eqs)(?<!Sec)(?<!Secs)\.\s",
        " ".join(text.split()) + " ",
        maxsplit=1,
    )[0]


def manifest() -> str:
    """Return the text of the manifest."""
    files = list(CLAIMS.items())
    for notebook in sorted(Path("notebooks").glob("*.ipynb")):
        files += published(notebook)
    entries = [
        f"  - file: {BOOK}/figures/{file}\n"
        f"    comment: {json.dumps(comment, ensure_ascii=False)}\n"
        for file, comment in files
    ]
    return HEAD + "".join(entries)


def main() -> int:
    """Write or check the manifest in the current folder."""
    text = manifest()
    if "--check" not in sys.argv:
        MANIFEST.write_text(text, encoding="utf-8")
    elif MANIFEST.read_text(encoding="utf-8") != text:
        print(f"{MANIFEST} does not list what the notebooks publish: make format does")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
