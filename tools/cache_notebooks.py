"""Put executed notebooks where the book's build looks for them, so that it runs none again.

Usage: python tools/cache_notebooks.py CACHE NOTEBOOK ...

The build takes a notebook's outputs from the cache if code and metadata of its cells are the
same. The times that nbmake notes in the metadata are left out for this.
"""

import sys

import nbformat
from jupyter_cache import get_cache
from jupyter_cache.base import CacheBundleIn


def main() -> None:
    """Fill the cache named on the command line with the notebooks named after it."""
    folder, *paths = sys.argv[1:]
    cache = get_cache(folder)
    for path in paths:
        notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)
        cache.cache_notebook_bundle(CacheBundleIn(notebook, path))


if __name__ == "__main__":
    main()
