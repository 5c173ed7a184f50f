"""Claims that the text names, as in "claims K5 and K6", link to their rows in the ledger."""

from docutils import nodes
from sphinx.util import logging

from book.companion.claims import all_claims
from book.companion.claims.ledger import NAME, NAMING

LEDGER = "notebooks/09_ledger"
LOGGER = logging.getLogger(__name__)


def link(app, doctree, docname):
    """Link the names of claims on a page; a name that no claim has is a warning."""
    known = {claim.identifier for claim in all_claims()}
    page = app.builder.get_relative_uri(docname, LEDGER)
    for text in list(doctree.findall(nodes.Text)):
        if isinstance(text.parent, nodes.reference | nodes.literal | nodes.literal_block):
            continue
        pieces, end = [], 0
        for naming in NAMING.finditer(text):
            for name in NAME.finditer(text, *naming.span()):
                if name[0] not in known:
                    LOGGER.warning("no claim is called %s", name[0], location=text.parent)
                    continue
                target = f"{page}#ledger-{name[0]}"
                pieces += [
                    nodes.Text(text[end : name.start()]),
                    nodes.reference("", name[0], internal=True, refuri=target),
                ]
                end = name.end()
        if pieces:
            text.parent.replace(text, [*pieces, nodes.Text(text[end:])])


def setup(app):
    """Register with Sphinx."""
    app.connect("doctree-resolved", link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
