"""The ledger of claims on the pages, written from `book/claims.toml`.

Directives write the claims of a chapter, the ledger of a source, its errata, the tally of
verdicts and the assumptions as MyST. Names of claims in a text become links to the ledger, and
the cell of a chapter that decides a claim becomes the target `claim-NAME`.
"""

import html
import re
from itertools import groupby

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from book.companion.ledger import Ledger, Verdict, Weight

PAGE = "notebooks/17_ledger"
LOGGER = logging.getLogger(__name__)
#: A text that names claims: "claim K5", "claims C7, C8 and C11".
NAMING = re.compile(r"\b[Cc]laims?\s+[A-Z]\d+(?:(?:,\s+and|,|\s+and|\s+to)\s+[A-Z]\d+)*")
#: One of the names in it.
NAME = re.compile(r"[A-Z]\d+")
#: What a cell writes that decides a claim.
DECIDES = re.compile(r'^claims\["([A-Z]\d+)"\] = ', re.MULTILINE)


def badge(verdict, text=""):
    """Return a text in the colour of a verdict; by default the verdict itself."""
    return f'<span class="verdict verdict-{verdict.name.lower()}">{text or verdict}</span>'


def link(name):
    """Return a link to a claim's row in the ledger, from a page in the same folder."""
    return f'<a href="17_ledger.html#ledger-{name}">{name}</a>'


def sentence(text):
    """Return a text with a capital at its beginning, which may be a formula."""
    return text[:1].upper() + text[1:]


def details(claim):
    """Return what a row unfolds to."""
    source = f"Printed ({claim.places}): {claim.printed}."
    decided = f'<a href="{claim.chapter}.html#claim-{claim.name}">the cell that decides</a>'
    parts = [
        source if claim.printed else f"{claim.places}, in our words.",
        f"{badge(claim.verdict)} {claim.verdict.clause}.",
        "\n".join(f"- {line}" for line in claim.tried),
        f"What decides: {claim.text('criterion')}." if claim.criterion else "",
        f"{sentence(claim.text('quantity'))}: **{claim.number}** ({decided}).",
        claim.text("note"),
        f"Major: {claim.changes}." if claim.changes else "",
    ]
    return "\n\n".join(part for part in parts if part)


def table(ledger, claims, *, target=False):
    """Return claims as a table, one line a claim; as the target of links, if need be."""
    rows = []
    for claim in claims:
        name, others = claim.name, "".join(f" {other}" for other in claim.also)
        row = "<tr>"
        if target:
            # Links that name one of the other places lead to this row, too.
            others = "".join(f' <span id="ledger-{o}">{o}</span>' for o in claim.also)
            row = (
                f'<tr id="ledger-{name}" data-verdict="{claim.verdict.name.lower()}" '
                f'data-weight="{claim.weight}" data-major="{bool(claim.changes):d}" '
                f'data-section="{html.escape(ledger.section(claim))}">'
            )
        rows.append(
            f"{row}<td>\n\n{link(name)}{others}\n\n</td><td>\n\n{badge(claim.verdict)}\n\n</td>"
            f"<td>{claim.weight}{', major' if claim.changes else ''}</td>"
            f"<td><details><summary>\n\n{claim.says}\n\n</summary>\n\n"
            f"{details(claim)}\n\n</details></td></tr>\n\n"
        )
    heads = ("Claim", "Verdict", "About", "What the source says")
    return (
        '<table class="claims"><thead><tr>'
        + "".join(f'<th scope="col">{head}</th>' for head in heads)
        + f"</tr></thead><tbody>\n\n{''.join(rows)}</tbody></table>\n\n"
    )


def controls(ledger, claims):
    """Return the form above the table, hidden until the script runs."""

    def boxes(name, values, shown):
        counts = [(v, sum(getattr(claim, name) is v for claim in claims)) for v in values]
        return "".join(
            f'<label><input type="checkbox" name="{name}" value="{v.name.lower()}" checked> '
            f"{shown(v, f'{v} ({count})')}</label>"
            for v, count in counts
            if count
        )

    sections = dict.fromkeys(ledger.section(claim) for claim in claims)
    options = "".join(f"<option>{html.escape(name)}</option>" for name in sections)
    return (
        '<form class="ledger-filter" hidden><fieldset><legend>Verdict</legend>'
        f"{boxes('verdict', Verdict, badge)}</fieldset><fieldset><legend>About</legend>"
        f"{boxes('weight', Weight, lambda _, text: text)}</fieldset>"
        '<label>Section <select name="section"><option value="">all</option>'
        f"{options}</select></label>"
        f'<label><input type="checkbox" name="major" value="1"> major only '
        f"({sum(bool(claim.changes) for claim in claims)})</label>"
        '<label>Search <input type="search" name="words" autocomplete="off"></label>'
        '<button type="reset">Show all</button>'
        f'<p><output role="status">{len(claims)} of {len(claims)} claims</output></p></form>'
        "\n\n"
    )


def block(head, parts, attributes=""):
    """Return a heading and a list of terms; four columns would not fit a phone."""
    items = "".join(
        f"<dt>{term}</dt><dd>\n\n{text}\n\n</dd>" for term, text in parts.items() if text
    )
    return f'<section class="erratum"{attributes}>\n\n{head}\n\n<dl>{items}</dl></section>\n\n'


class LedgerDirective(SphinxDirective):
    """Text that a subclass writes from the ledger, as MyST."""

    def run(self):
        """Return it parsed."""
        return self.parse_text_to_nodes(self.write(Ledger()))


class Claims(LedgerDirective):
    """The claims of the chapter that holds the directive."""

    def run(self):
        """Return them as one part of the page, which takes no time to read."""
        return [nodes.container("", *super().run(), classes=["claims-decided"])]

    def write(self, ledger):
        """Return their names and a table."""
        chapter = self.env.docname.rpartition("/")[2]
        claims = [claim for claim in ledger if claim.chapter == chapter]
        names = ", ".join(link(claim.name) for claim in claims)
        return f"Claims decided here: {names}.\n\n{table(ledger, claims)}"


class Major(LedgerDirective):
    """The claims whose verdict changes what the paper says of itself."""

    def write(self, ledger):
        """Return a line a claim."""
        return "".join(
            f"- {link(claim.name)} {badge(claim.verdict)} {sentence(claim.changes)}.\n"
            for claim in ledger
            if claim.changes
        )


class Whole(LedgerDirective):
    """All claims of the paper, or of the white paper."""

    required_arguments = 1
    final_argument_whitespace = True

    def write(self, ledger):
        """Return them as a table, that of the paper with a form that filters it."""
        white = directives.choice(self.arguments[0], ("paper", "white paper")) != "paper"
        claims = [claim for claim in ledger if claim.white is white]
        shown = table(ledger, claims, target=True)
        if white:
            return shown
        data = " · ".join(
            f'<a href="../figures/claims.{ending}" download>claims.{ending}</a>'
            for ending in ("csv", "json")
        )
        return (
            f'<div class="ledger">{controls(ledger, claims)}{shown}'
            f'<p class="figure-downloads">The ledger as data: {data}</p></div>\n\n'
            '<script src="../_static/ledger.js"></script>\n'
        )


class Tally(LedgerDirective):
    """How many claims met each verdict."""

    def write(self, ledger):
        """Return a line a kind of claims."""
        lines = [
            f"{met.total()} claims {of}: "
            + " ".join(badge(v, f"{met[v]} {v}") for v in Verdict if met[v])
            for of, met in ledger.tally().items()
        ]
        return f'<p class="verdict-counts">{"<br>".join(lines)}</p>\n'


class Errata(LedgerDirective):
    """Printed text that does not hold: the text, what follows, and what depends on it."""

    required_arguments = 1
    final_argument_whitespace = True
    option_spec = {"weight": directives.unchanged}  # noqa: RUF012, as docutils has it

    def write(self, ledger):
        """Return a block a claim of one verdict, and of some weights."""
        verdict = Verdict(self.arguments[0])
        weights = self.options.get("weight", "physics derivation wording").split()
        blocks = []
        for claim in ledger:
            if claim.white or claim.verdict is not verdict or claim.weight not in weights:
                continue
            affected = (one for one in ledger if set(one.names) & set(claim.affects))
            parts = {
                "Printed" if claim.printed else "In our words": claim.printed or claim.says,
                "What decides": claim.text("criterion"),
                "What follows": f"{sentence(claim.text('quantity'))}: **{claim.number}**. "
                f"{claim.text('note')}",
                "What depends on it": ", ".join(
                    f"{link(one.name)} ({one.verdict})" for one in affected
                ),
            }
            head = f"**{link(claim.name)}, {claim.places}** {badge(claim.verdict)}"
            blocks.append(block(head, parts, f' id="erratum-{claim.name}"'))
        return "".join(blocks)


class Assumptions(LedgerDirective):
    """What the paper leaves open, the choice of this book, and what depends on it."""

    def write(self, ledger):
        """Return a block an assumption."""
        return "".join(
            block(
                f"**{one.title}**",
                {
                    "Taken": one.text("taken"),
                    "Why": one.text("why"),
                    "What depends on it": one.text("sensitivity"),
                },
            )
            for one in ledger.assumptions.values()
        )


def anchor(app, doctree):
    """Make the cell that decides a claim the target of links."""
    for cell in doctree.findall(nodes.container):
        if cell.get("nb_element") == "cell_code":
            code = "\n".join(block.astext() for block in cell.findall(nodes.literal_block))
            cell["ids"] += [f"claim-{name}" for name in DECIDES.findall(code)]


def join_lines(element):
    """Make one text of the lines of a paragraph: a name may stand on two of them."""
    runs = groupby(element.children, key=lambda child: isinstance(child, nodes.Text))
    children: list[nodes.Node] = []
    for is_text, run in runs:
        children += [nodes.Text("".join(run))] if is_text else run
    element.clear()
    element.extend(children)


def name_claims(app, doctree, docname):
    """Link the names of claims on a page; a name that no claim has is a warning."""
    for element in list(doctree.findall(nodes.TextElement)):
        join_lines(element)
    known = [name for claim in Ledger() for name in claim.names]
    page = app.builder.get_relative_uri(docname, PAGE)
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
    app.add_directive("claims", Claims)
    app.add_directive("ledger", Whole)
    app.add_directive("major", Major)
    app.add_directive("tally", Tally)
    app.add_directive("errata", Errata)
    app.add_directive("assumptions", Assumptions)
    # After `downloads`, which names the cells of figures.
    app.connect("doctree-read", anchor, priority=600)
    app.connect("doctree-resolved", name_claims)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
