"""Say at the head of each chapter how long it takes to read."""

from docutils import nodes

#: What is read in a minute: words of text, lines of open code, and figures.
WORDS, LINES, FIGURES = 200, 20, 2


def minutes(doctree):
    """Return the minutes for a page; what is folded takes none."""
    aside = [
        node
        for node in doctree.findall(nodes.Element)
        if {"claims-decided", "dropdown"} & set(node["classes"])
    ]
    later = {id(text) for node in aside for text in node.findall(nodes.paragraph)}
    words = sum(
        len(text.astext().split())
        for text in doctree.findall(nodes.paragraph)
        if id(text) not in later
    )
    lines = sum(
        len(block.astext().split("\n"))
        for cell in doctree.findall(nodes.container)
        if "cell_input" in cell["classes"] and not folded(cell.parent)
        for block in cell.findall(nodes.literal_block)
    )
    figures = sum(1 for _ in doctree.findall(nodes.figure))
    return words / WORDS + lines / LINES + figures / FIGURES


def folded(cell):
    """Tell whether the page shows the code of a cell only on request."""
    return any(name.startswith("tag_hide") for name in cell["classes"])


def note(app, doctree):
    """Put the time under the title of a chapter."""
    name = app.env.docname
    if not name.startswith("notebooks/") or name == app.config.root_doc:
        return
    for title in list(doctree.findall(nodes.title))[:1]:
        time = nodes.paragraph("", f"Reading time: {round(minutes(doctree)) or 1} min")
        title.parent.insert(title.parent.index(title) + 1, time)


def setup(app):
    """Register with Sphinx."""
    app.connect("doctree-read", note)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
