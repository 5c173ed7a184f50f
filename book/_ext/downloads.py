"""Links to the files of a figure, `figures/NAME.svg` and `figures/NAME.csv`, below the figure.

`tools/collect_figures.py` writes the files. NAME is the name of the figure without `fig-`.
"""

from pathlib import Path

from docutils import nodes


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
                text = f'<p class="figure-downloads">Download this figure: {links}</p>'
                figure.parent.insert(
                    figure.parent.index(figure) + 1, nodes.raw("", text, format="html")
                )


def setup(app):
    """Register with Sphinx."""
    app.connect("doctree-read", link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
