"""Take figures and run times out of executed notebooks, and fill the cache of the book's build.

Usage: python tools/collect_figures.py EXECUTED FIGURES CACHE

Each figure carries its data and an SVG: `book.companion.figures` extends IPython. They
become the files NAME.csv and NAME.svg in the folder FIGURES; `fig-NAME` is the name in the
metadata of the cell. The book's build takes a notebook from CACHE if code and metadata of its
cells are the same. So the times that nbmake notes in the metadata are left out; the page on the
book's status shows their sum. Beside CACHE the names of the notebooks are written to
`longest_first.txt`, by these sums: in this order the next build runs them.
"""

import shutil
import sys
from datetime import datetime
from pathlib import Path
from typing import Any

import nbformat
from jupyter_cache import get_cache
from jupyter_cache.base import CacheBundleIn

ENDINGS = {"image/svg+xml": "svg", "text/csv": "csv"}
GLUED = "application/papermill.record/"  # before the type of what a notebook glues


def take_figures(cell: Any, folder: Path) -> None:
    """Write the files of the figure that a cell shows; leave the cell its PNG."""
    name = cell.metadata.get("mystnb", {}).get("figure", {}).get("name", "")
    for output in cell.get("outputs", []):
        data = output.get("data", {})
        for mime in list(data):
            if ending := ENDINGS.get(mime.removeprefix(GLUED)):
                text = data.pop(mime)
                if name and not mime.startswith(GLUED):
                    file = folder / f"{name.removeprefix('fig-')}.{ending}"
                    file.write_text(text, encoding="utf-8")


def join_streams(cell: Any) -> None:
    """Join what a cell prints, which MyST-NB would do with a new line between the parts."""
    joined: list[Any] = []
    for output in cell.get("outputs", []):
        last = joined[-1] if joined else {}
        if "text" in output and output.get("name") == last.get("name"):
            last["text"] += output["text"]
        else:
            joined.append(output)
    if "outputs" in cell:
        cell["outputs"] = joined


def seconds(cell: Any) -> float:
    """Return how long a cell ran, and take the times out of its metadata."""
    times = cell.metadata.pop("execution", {})
    if "iopub.status.idle" not in times:
        return 0.0
    start, end = (
        datetime.fromisoformat(times[f"iopub.status.{state}"]) for state in ("busy", "idle")
    )
    return (end - start).total_seconds()


def main() -> None:
    """Collect what the notebooks of one folder have made."""
    executed, figures, cached = map(Path, sys.argv[1:])
    figures.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(cached, ignore_errors=True)
    cache, times = get_cache(cached), {}
    for path in sorted(executed.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
        for cell in notebook.cells:
            take_figures(cell, figures)
            join_streams(cell)
        times[path.name] = sum(map(seconds, notebook.cells))
        data = {"execution_seconds": times[path.name]}
        cache.cache_notebook_bundle(CacheBundleIn(notebook, str(path), data=data))
    order = sorted(times, key=lambda name: -times[name])
    (cached.parent / "longest_first.txt").write_text("\n".join(order) + "\n", "utf-8")


if __name__ == "__main__":
    main()
