"""Numbers in alternative texts come from the run, as those of the prose do.

An alternative text may hold `{name:format}`, where `name` was glued in the same notebook; it
is replaced by the number in that format. An unknown name is a warning, which fails the build.
"""

import re

from docutils import nodes
from myst_nb.ext.glue.crossref import read_glue_cache
from sphinx.util import logging

PLACE = re.compile(r"\{(\w+):([^{}]*)\}")
LOGGER = logging.getLogger(__name__)


def fill(app, doctree):
    """Put the numbers into the alternative texts of a page that was just read."""
    for image in doctree.findall(nodes.image):
        if not PLACE.search(image.get("alt", "")):
            continue
        glued = read_glue_cache(app.env.mystnb_config.output_folder, app.env.docname)

        def number(place, image=image, glued=glued):
            name, form = place.groups()
            if name not in glued:
                LOGGER.warning("nothing is glued as %r", name, location=image)
                return place[0]
            return format(float(glued[name]["data"]["text/plain"]), form)

        image["alt"] = PLACE.sub(number, image["alt"])


def setup(app):
    """Register with Sphinx."""
    app.connect("doctree-read", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
