"""Links below each figure: to its files, `figures/NAME.svg` and `.csv`, and to its cell.

`tools/collect_figures.py` writes the files. NAME is the name of the figure without `fig-`.
"""

from pathlib import Path

from docutils import nodes


def made_by(figure):
    """Return a link to the cell that made a figure, by its number after a run."""
    cell = figure.parent
    while cell.get("nb_element") != "cell_code":
        cell = cell.parent
    number = cell["exec_count"]
    cell["ids"] = [f"cell-{number}"]
    return f'made by <a href="#cell-{number}">cell [{number}]</a> of the notebook'


def link(app, doctree):
    """Add the links to each figure of a notebook that has files."""
    up = "../" * app.env.docname.count("/")
    for figure in doctree.findall(nodes.figure):
        for name in figure["names"]:
            stem = name.removeprefix("fig-")
            files = sorted(Path(app.outdir, "figures").glob(f"{stem}.*"))
            if files:
                links = " · ".join(
                    f'<a href="{up}figures/{file.name}" download>{file.suffix[1:].upper()}</a>'
                    for file in files
                )
                text = f"{links}, {made_by(figure)}"
                text = f'<p class="figure-downloads">This figure: {text}</p>'
                figure.parent.insert(
                    figure.parent.index(figure) + 1, nodes.raw("", text, format="html")
                )


def setup(app):
    """Register with Sphinx."""
    app.connect("doctree-read", link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
