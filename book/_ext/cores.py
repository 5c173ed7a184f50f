"""Write the book's pages on all cores, for which Jupyter Book has no option.

They are read one after the other: not all of its extensions say that they could do otherwise.
"""

import os


def write_on_all_cores(app, env):
    """Allow several processes, once all pages are read."""
    app.parallel = os.cpu_count() or 1


def setup(app):
    """Register with Sphinx."""
    app.connect("env-updated", write_on_all_cores)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
