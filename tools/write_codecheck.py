"""Write codecheck.yml, the CODECHECK manifest: what the book computes, file by file.

Usage: python tools/write_codecheck.py [--check]

The data of every figure that a notebook publishes is listed with the first sentence of its
caption, and so is the ledger of claims. With --check nothing is written, and a manifest that
is out of date is an error.
"""

import ast
import json
import re
import sys
from pathlib import Path

MANIFEST = Path("codecheck.yml")
HEAD = """\
# CODECHECK manifest, written by tools/write_codecheck.py: `make book` and `make claims` compute
# these files from nothing.
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
CLAIMS = {
    "build/claims/claims.csv": "Every claim with its verdict and the number that decides it",
    "build/claims/claims.json": "The same as JSON",
}


def published(notebook: Path) -> list[tuple[str, str]]:
    """Return name and caption of the figures that a notebook publishes."""
    found, caption = [], ""
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] != "code":
            continue
        figure = cell["metadata"].get("mystnb", {}).get("figure", {})
        caption = figure.get("caption", caption)
        for node in ast.walk(ast.parse("".join(cell["source"]))):
            if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("publish"):
                found += [
                    (argument.value, first_sentence(caption))
                    for argument in node.args
                    if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
                ]
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
    files = {
        f"build/html/figures/{name}.csv": comment
        for notebook in sorted(Path("notebooks").glob("*.ipynb"))
        for name, comment in published(notebook)
    }
    entries = [
        f"  - file: {file}\n    comment: {json.dumps(comment, ensure_ascii=False)}\n"
        for file, comment in (CLAIMS | files).items()
    ]
    return HEAD + "".join(entries)


def main() -> int:
    """Write or check the manifest in the current folder."""
    text = manifest()
    if "--check" not in sys.argv:
        MANIFEST.write_text(text, encoding="utf-8")
    elif not MANIFEST.exists() or MANIFEST.read_text(encoding="utf-8") != text:
        print(f"{MANIFEST} does not list what the notebooks publish: make format writes it")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
