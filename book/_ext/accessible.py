"""Mend, in the finished pages, what a screen reader or a link would stumble over.

The theme's switches that unfold a part of the contents have no name, and its sidebar is no
region of the page; docutils calls the bibliography a list without list items, and its entries
by a role that is no more; a table's empty corner is no heading; the table of run times has a
mark that many systems have no font for; images do not say how large they are; and the links
from a source file back to the reference name the package where the reference names the module.
"""

import re
import struct
from pathlib import Path
from urllib.parse import unquote

MENDED = {
    '<summary><span class="toctree-toggle"': (
        '<summary aria-label="Unfold the pages of this part"><span class="toctree-toggle"'
    ),
    '<div id="pst-primary-sidebar" class=': (
        '<div id="pst-primary-sidebar" role="complementary" aria-label="The book" class='
    ),
    '<div role="list" class="citation-list">': '<div class="citation-list">',
    ' role="doc-biblioentry">': ">",
    '<th class="head"><p></p></th>': "<td></td>",
    "✅": "ran",
}
IMAGE = re.compile(r'<img (?=[^>]*src="([^"#?:]+\.png)")(?![^>]*(?:width|loading)=)')
BACK = re.compile(r'(class="viewcode-back" href="[^"#]+#)([^"]+)"')


def sized(file, text):
    """Give images their size, so that nothing jumps, and load them when they come into view."""

    def tag(match):
        image = file.parent / unquote(match[1])
        if not image.is_file():
            return match[0]
        wide, high = struct.unpack(">2I", image.read_bytes()[16:24])
        return f'<img width="{wide}" height="{high}" loading="lazy" '

    return IMAGE.sub(tag, text)


def mend(app, exception):
    """Rewrite the pages that need it."""
    if exception is not None or app.builder.format != "html":
        return
    objects = app.env.get_domain("py").objects
    for file in Path(app.outdir).rglob("*.html"):
        before = text = file.read_text(encoding="utf-8")
        for old, new in MENDED.items():
            text = text.replace(old, new)
        # What is printed must be there at once.
        if app.builder.name == "html":
            text = sized(file, text)
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
