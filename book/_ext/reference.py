"""Docstrings for the reference: a magnitude such as |1 + L| is shown as code.

Docstrings are written to be read in a terminal. reStructuredText takes bars for markup.
"""

import re

MAGNITUDE = re.compile(r"(?<![`|\w])\|[^|`]+\|(?![`|])")


def prepare(app, what, name, thing, options, lines):
    """Mark the magnitudes in a docstring, except in its formulas and examples."""
    formula = None
    for number, line in enumerate(lines):
        indent = len(line) - len(line.lstrip())
        if formula is not None and (not line.strip() or indent > formula):
            continue
        formula = indent if ".. math::" in line else None
        if formula is None and not line.lstrip().startswith((">>>", "...")):
            lines[number] = MAGNITUDE.sub(r"``\g<0>``", line)


def setup(app):
    """Register with Sphinx."""
    # Before Napoleon, which has priority 500.
    app.connect("autodoc-process-docstring", prepare, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
