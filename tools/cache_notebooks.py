"""Put executed notebooks where the book's build looks for them, so that it runs none again.

Usage: python tools/cache_notebooks.py CACHE NOTEBOOK ...

The build takes a notebook's outputs from the cache if code and metadata of its cells are the
same. The times that nbmake notes in the metadata are left out for this. Their sum is kept: the
page on the book's status shows it.
"""

import sys
from datetime import datetime
from typing import Any

import nbformat
from jupyter_cache import get_cache
from jupyter_cache.base import CacheBundleIn


def seconds(cells: list[Any]) -> float:
    """Return how long the cells ran, and take the times out of their metadata."""
    total = 0.0
    for cell in cells:
        times = cell.metadata.pop("execution", {})
        if "iopub.status.idle" in times:
            ends = (times[f"iopub.status.{state}"] for state in ("busy", "idle"))
            start, end = (datetime.fromisoformat(time) for time in ends)
            total += (end - start).total_seconds()
    return total


def main() -> None:
    """Fill the cache named on the command line with the notebooks named after it."""
    folder, *paths = sys.argv[1:]
    cache = get_cache(folder)
    for path in paths:
        notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
        data = {"execution_seconds": seconds(notebook.cells)}
        cache.cache_notebook_bundle(CacheBundleIn(notebook, path, data=data))


if __name__ == "__main__":
    main()
