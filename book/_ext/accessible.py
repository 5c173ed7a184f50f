"""Mend, in the finished pages, what a screen reader or a link would stumble over.

The theme's switches that unfold a part of the contents have no name; docutils calls the
bibliography a list without list items; the table of run times has a mark that many systems have
no font for; and the links from a source file back to the reference name the package where the
reference names the module.
"""

import re
from pathlib import Path

MENDED = {
    '<summary><span class="toctree-toggle"': (
        '<summary aria-label="Unfold the pages of this part"><span class="toctree-toggle"'
    ),
    '<div role="list" class="citation-list">': '<div class="citation-list">',
    "✅": "ran",
}
BACK = re.compile(r'(class="viewcode-back" href="[^"#]+#)([^"]+)"')


def mend(app, exception):
    """Rewrite the pages that need it."""
    if exception is not None or app.builder.format != "html":
        return
    objects = app.env.get_domain("py").objects
    for file in Path(app.outdir).rglob("*.html"):
        before = text = file.read_text(encoding="utf-8")
        for old, new in MENDED.items():
            text = text.replace(old, new)
        parts = file.relative_to(app.outdir).with_suffix("").parts
        if parts[0] == "_modules":
            module = ".".join(parts[1:])

            def full(match, module=module):
                name = f"{module}.{match[2].removeprefix('armlock.')}"
                known = objects.get(name)
                moved = match[2] not in objects and known is not None and not known.aliased
                return f'{match[1]}{name if moved else match[2]}"'

            text = BACK.sub(full, text)
        if text != before:
            file.write_text(text, encoding="utf-8")


def setup(app):
    """Register with Sphinx."""
    app.connect("build-finished", mend)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
