"""Numbers of the run: in alternative texts as well, and typeset; numbers beside their units.

What the prose takes from the run as 1.5e-06 or as -1.5 is shown as a formula; an alternative
text, which is spoken, has 1.5 times 10 to the -6 instead.

An alternative text may hold `{name:format}`, where `name` was glued in the same notebook; it
is replaced by the number in that format. An unknown name is a warning, which fails the build.
So is a picture without an alternative text.
"""

import re

from docutils import nodes
from myst_nb.ext.glue.crossref import read_glue_cache
from sphinx.util import logging

POWER = re.compile(r"([-+]?[\d.]+)e([-+]\d+)")
NEGATIVE = re.compile(r"-[\d.]+")
#: The space between a number, or what has just been put in, and its unit.
UNIT = re.compile(
    r"(?:(?<=\d)|^) (?=%|× 10|(?:[mµkM]?(?:s|Hz|W)|rad|nm|km|pm|dB)\b)|(?<=×) (?=10)"
)
PLACE = re.compile(r"\{(\w+):([^{}]*)\}")
LOGGER = logging.getLogger(__name__)


def typeset(app, doctree):
    """Typeset powers of ten and negative numbers that the prose of a page has from the run."""
    for node in list(doctree.findall(nodes.inline)):
        text = node.astext()
        power = POWER.fullmatch(text)
        formula = rf"{power[1]} \times 10^{{{int(power[2])}}}" if power else text
        if "pasted-text" in node["classes"] and (power or NEGATIVE.fullmatch(text)):
            node.replace_self(nodes.math(formula, formula))


def join(app, doctree):
    """Keep numbers in the same line as their units."""
    for text in list(doctree.findall(nodes.Text)):
        if isinstance(text.parent, (nodes.paragraph, nodes.caption, nodes.entry)):
            text.parent.replace(text, nodes.Text(UNIT.sub("\N{NO-BREAK SPACE}", text)))


def fill(app, doctree):
    """Put the numbers into the alternative texts of a page that was just read."""
    for image in doctree.findall(nodes.image):
        if not image.get("alt", "").strip():
            LOGGER.warning("a picture has no alternative text", location=image)
        if not PLACE.search(image.get("alt", "")):
            continue
        glued = read_glue_cache(app.env.mystnb_config.output_folder, app.env.docname)

        def number(place, image=image, glued=glued):
            name, form = place.groups()
            if name not in glued:
                LOGGER.warning("nothing is glued as %r", name, location=image)
                return place[0]
            text = format(float(glued[name]["data"]["text/plain"]), form)
            return POWER.sub(lambda power: f"{power[1]} times 10 to the {int(power[2])}", text)

        image["alt"] = PLACE.sub(number, image["alt"])


def setup(app):
    """Register with Sphinx."""
    # A page may have formulas in the outputs of its cells only, which Sphinx does not see.
    app.set_html_assets_policy("always")
    app.connect("doctree-read", typeset)
    app.connect("doctree-read", join)
    app.connect("doctree-read", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
