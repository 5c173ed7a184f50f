"""Let the book be read without any network, from a folder as well as from a server.

Formulas: the package sphinx-mathjax-offline carries MathJax. Of its 24 MB, the pages need one
script, the fonts, and the TeX extensions that the script loads when a formula asks for them;
those are copied. The package's own Sphinx extension stays unused: it copies everything.

The source maps of the theme's scripts, 3.5 MB, serve only those who develop it. They go, and so
do the theme's fonts in the old format TrueType, 0.7 MB: the same ones are there as woff2, which
every browser reads that runs the pages' scripts.

The licences of all that the pages ship stand in `_static/licenses`.

Thebe, which Jupyter Book always adds, would run cells on a server elsewhere. It goes.
"""

import re
import shutil
from importlib.metadata import files
from importlib.util import find_spec
from pathlib import Path

from sphinx_thebe import init_thebe_core, update_thebe_context

SCRIPT = "mathjax/tex-mml-chtml.js"
NEEDED = ["tex-mml-chtml.js", "output/chtml/fonts", "input/tex/extensions"]
TRUETYPE = re.compile(r',url\([^)]*\.ttf\) format\("truetype"\)')
# Packages that put files of their own into the pages. That of MathJax has no licence text:
# book/_static/licenses holds it.
SHIPPED = [
    "myst-nb",
    "pydata-sphinx-theme",
    "sphinx",
    "sphinx-book-theme",
    "sphinx-copybutton",
    "sphinx-design",
    "sphinx-togglebutton",
]


def mathjax_folder():
    """Return the folder of the installed MathJax."""
    spec = find_spec("sphinx-mathjax-offline")
    if spec is None or not spec.submodule_search_locations:
        raise RuntimeError("sphinx-mathjax-offline is not installed; run `make env`")
    return Path(spec.submodule_search_locations[0]) / "static" / "mathjax"


def copy_mathjax(app, exception):
    """Copy what is needed of MathJax into the built book."""
    if exception is not None or app.builder.format != "html":
        return
    for name in NEEDED:
        source = mathjax_folder() / name
        target = Path(app.outdir) / "_static" / "mathjax" / name
        if source.is_dir():
            ignore = shutil.ignore_patterns("all-packages.js")
            shutil.copytree(source, target, dirs_exist_ok=True, ignore=ignore)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)


def copy_licenses(app, exception):
    """Copy the licences of the packages whose files the pages load."""
    if exception is not None or app.builder.format != "html":
        return
    target = Path(app.outdir) / "_static" / "licenses"
    target.mkdir(parents=True, exist_ok=True)
    for name in SHIPPED:
        text = next(file for file in files(name) or [] if "LICEN" in file.name.upper())
        shutil.copyfile(text.locate(), target / f"{name}.txt")


def drop_unread(app, exception):
    """Take out what no reader's browser asks for."""
    if exception is not None or app.builder.format != "html":
        return
    static = Path(app.outdir) / "_static"
    for file in [*static.rglob("*.map"), *static.rglob("*.ttf")]:
        file.unlink()
    for file in static.rglob("*.css"):
        text = file.read_text(encoding="utf-8")
        file.write_text(TRUETYPE.sub("", text), encoding="utf-8")


def drop_thebe(app, config):
    """Take out the two steps that put Thebe into the pages."""
    steps = [init_thebe_core, update_thebe_context]
    for event, listeners in app.events.listeners.items():
        app.events.listeners[event] = [
            listener for listener in listeners if listener.handler not in steps
        ]


def setup(app):
    """Register with Sphinx."""
    # A page may have formulas in the outputs of its cells only, which Sphinx does not see.
    app.set_html_assets_policy("always")
    app.config.mathjax_path = SCRIPT
    app.connect("config-inited", drop_thebe)
    app.connect("build-finished", copy_mathjax)
    app.connect("build-finished", copy_licenses)
    app.connect("build-finished", drop_unread)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
