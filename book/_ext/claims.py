"""The ledger of claims as a page, and links to it from all claims that a text names."""

from docutils import nodes
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from book.companion.claims.ledger import NAME, NAMING, all_names
from book.companion.claims.page import LedgerPage, VerdictCounts, whole_ledger

LEDGER = "notebooks/16_ledger"
LOGGER = logging.getLogger(__name__)


class Ledger(SphinxDirective):
    """Show the counts of verdicts and the table of all claims."""

    def run(self):
        """Return them as HTML, in which MathJax sets the formulas."""
        ledger = whole_ledger()
        shown = "".join(
            part._repr_html_() for part in (VerdictCounts(ledger), LedgerPage(ledger))
        )
        return [nodes.raw("", f'<div class="tex2jax_process">{shown}</div>', format="html")]


def link(app, doctree, docname):
    """Link the names of claims on a page; a name that no claim has is a warning."""
    known = all_names()
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
    app.add_directive("ledger", Ledger)
    app.connect("doctree-resolved", link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
