"""Say at the head of each chapter how long it takes to read."""

from docutils import nodes

SPEED = 200  # words a minute


def note(app, doctree):
    """Count the words of a notebook's text, and put the time under its title."""
    name = app.env.docname
    if not name.startswith("notebooks/") or name == app.config.root_doc:
        return
    words = sum(len(text.astext().split()) for text in doctree.findall(nodes.paragraph))
    for title in list(doctree.findall(nodes.title))[:1]:
        time = nodes.paragraph("", f"Reading time: {-(-words // SPEED)} min")
        title.parent.insert(title.parent.index(title) + 1, time)


def setup(app):
    """Register with Sphinx."""
    app.connect("doctree-read", note)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
