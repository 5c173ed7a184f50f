"""The book's build fails when it should.

A copy of the book with one small notebook is built, with the configuration of the book.
"""

import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import requires, version
from pathlib import Path

import nbformat
from nbclient import NotebookClient

from tools import check_html

ROOT = Path(__file__).parents[1]
TEXT = (
    "# A chapter\n\n{numref}`fig-small`: {glue:text}`points:.1e` points, down to "
    "{glue:text}`least:.1f` s, or 20 s. {doc}`/book/intro`"
)
DRAW = """
import numpy as np
from matplotlib import pyplot as plt
from book.companion import figures

omega = np.linspace(0.1, 3.0, 200)
fig, ax = plt.subplots()
ax.plot(np.sin(omega), np.cos(omega), label="Curve")
ax.set(xlabel="a [1/s]", ylabel="b [1/s]");
"""
GLUE = "figures.glue(points=omega.size, least=-np.pi)"
PAGES = ("bibliography.md", "status.md")
OFFERED = ("LICENSE", "LICENSE-docs", "CITATION.cff", "CHANGELOG.md", "environment.txt")
ADDRESS = "https://github.com/someone/something"
LINKS = {
    "book/bibliography.html": f'href="{ADDRESS}"',
    "notebooks/small.html": "https://mybinder.org/v2/gh/someone/something/main?urlpath=lab",
    "book/status.html": f"git clone {ADDRESS}",
}
ALT = "A curve of {points:.0f} points."


def notebook(*cells):
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    return nbformat.v4.new_notebook(cells=list(cells), metadata=kernel)


def small(*more, text=TEXT, alt=ALT):
    """Return a notebook with a figure and its data."""
    caption = {"caption": "A curve.", "name": "fig-small"}
    figure = {"mystnb": {"figure": caption, "image": {"alt": alt}}}
    return notebook(
        nbformat.v4.new_markdown_cell(text),
        nbformat.v4.new_code_cell(DRAW, metadata=figure),
        nbformat.v4.new_code_cell(GLUE, metadata={"tags": ["remove-input"]}),
        *more,
    )


def build(folder, notebooks, address=None, run_before=False):
    """Build a copy of the book with other notebooks; return exit code, output and pages."""
    (folder / "notebooks").mkdir(parents=True)
    (folder / "book").mkdir()
    for name in ("_config.yml", "_ext", "_static", "references.bib", *PAGES):
        source, target = ROOT / "book" / name, folder / "book" / name
        (shutil.copytree if source.is_dir() else shutil.copyfile)(source, target)
    # There is no ledger for the claims that it names, and of the pages only these.
    works = folder / "book" / "bibliography.md"
    text = works.read_text().replace("claim", "statement")
    works.write_text(re.sub(r"{doc}`(beside|in_orbit)`", r"\1", text))
    for name in OFFERED:
        shutil.copyfile(ROOT / name, folder / name)
    (folder / "book" / "intro.md").write_text(
        "(assumptions)=\n# A book\n\n{cite:t}`shao_robustness`\n"
    )
    chapters = [f"notebooks/{name}" for name in notebooks] + [f"book/{name}" for name in PAGES]
    (folder / "book" / "_toc.yml").write_text(
        "format: jb-book\nroot: book/intro\nchapters:\n"
        + "".join(f"  - file: {chapter.removesuffix('.md')}\n" for chapter in chapters)
    )
    for name, notebook in notebooks.items():
        nbformat.write(notebook, folder / "notebooks" / f"{name}.ipynb")
    environment = dict(os.environ)
    environment.pop("MPLBACKEND", None)  # the kernel chooses its own, which shows figures
    pages = folder / "build" / "_build" / "html"
    if run_before:
        executed = folder / "build" / "executed"
        executed.mkdir(parents=True)
        for name, notebook in notebooks.items():
            NotebookClient(notebook).execute(env=environment)
            nbformat.write(notebook, executed / f"{name}.ipynb")
        cache = pages.parent / ".jupyter_cache"
        command = [sys.executable, str(ROOT / "tools" / "collect_figures.py")]
        command += map(str, (executed, pages / "figures", cache))
        subprocess.run(command, check=True)
    command = [str(Path(sys.executable).with_name("jupyter-book")), "build", ".", "--all"]
    command += ["--config", "book/_config.yml", "--toc", "book/_toc.yml"]
    command += ["--path-output", "build", "-W", "-n", "--keep-going"]
    if address is not None:
        # The metadata of the package as they are with an address in pyproject.toml.
        metadata = folder / "first" / f"armlock-{version('armlock')}.dist-info" / "METADATA"
        metadata.parent.mkdir(parents=True)
        metadata.write_text(
            f"Metadata-Version: 2.1\nName: armlock\nVersion: {version('armlock')}\n"
            f"Project-URL: repository, {address}\n"
            + "".join(f"Requires-Dist: {line}\n" for line in requires("armlock") or [])
        )
        paths = [metadata.parents[1], os.environ.get("PYTHONPATH", "")]
        environment["PYTHONPATH"] = os.pathsep.join(map(str, filter(None, paths)))
    result = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    logs = [log.read_text() for log in pages.rglob("*.err.log")]  # of cells that failed
    return result.returncode, "\n".join([result.stdout, result.stderr, *logs]), pages


def test_a_book_has_its_data_numbers_and_links_and_needs_no_network(tmp_path):
    code, output, pages = build(tmp_path, {"small": small()}, ADDRESS, run_before=True)
    assert code == 0, output[-3000:]
    table = (pages / "figures" / "small.csv").read_bytes()
    assert table.startswith(b'"Curve, a [1/s]","Curve, b [1/s]"\n')
    page = (pages / "notebooks/small.html").read_text()
    for name in ("small.csv", "small.svg"):
        assert (pages / "figures" / name).is_file()
        assert f'href="../figures/{name}" download' in page
    assert 'href="#cell-1"' in page  # a figure names the cell that made it
    assert 'id="cell-1"' in page
    assert 'alt="A curve of 200 points."' in page
    assert "Reading time: 1 min" in page
    assert r"\(2.0 \times 10^{2}\)" in page
    joined = page.replace("&#160;", "\N{NO-BREAK SPACE}")
    assert "(-3.1\\)</span>\N{NO-BREAK SPACE}s, or 20\N{NO-BREAK SPACE}s." in joined
    for page, link in LINKS.items():
        assert link in (pages / page).read_text()
    status = (pages / "book/status.html").read_text()
    for name in (*OFFERED, "references.bib"):
        (target,) = re.findall(rf'href="\.\./(_downloads/\w+/{name})"', status)
        assert (pages / target).is_file()
    assert version("armlock") in status[status.index("@software") :]
    check = [sys.executable, str(ROOT / "tools" / "check_html.py"), str(pages)]
    assert subprocess.run(check, capture_output=True, timeout=60).returncode == 0


def test_a_build_fails_on_each_fault(tmp_path):
    """Each fault is a warning about its notebook, and every warning fails the build."""
    missing = TEXT + " {numref}`fig-missing` {doc}`/book/missing`"
    silent = nbformat.v4.new_code_cell(DRAW)
    raises = nbformat.v4.new_code_cell("assert 1 > 2, 'a check of the notebook'")
    faulty = small(silent, raises, text=missing, alt="At {nowhere:.1f} Hz")
    code, output, pages = build(tmp_path, {"faulty": faulty})
    assert code != 0
    warnings = "\n".join(line for line in output.splitlines() if "WARNING: " in line)
    for sign in (
        "Executing notebook failed",
        "nothing is glued as 'nowhere'",
        "a picture has no alternative text",
        "fig-missing",
        "/book/missing",
    ):
        assert re.search(rf"notebooks/faulty\.ipynb.*{sign}", warnings), (sign, output)
    assert ": a check of the notebook" in output
    # Nothing links to a repository whose address is not known.
    for page in pages.rglob("*.html"):
        assert not re.search("github.com|mybinder|colab", page.read_text()), page


#: What may stand on a page of the book, and what is then said of it.
FAULTS = {
    '<a href="missing.html">There</a>': "names missing.html, which does not exist",
    '<a href="#missing">There</a>': "has a broken anchor, #missing",
    '<img src="gone.png" alt="Gone">': "names gone.png, which does not exist",
    '<script src="http://192.0.2.1/x.js"></script>': "loads http://192.0.2.1/x.js from",
    '<link rel="stylesheet" href="/a.css">': "names /a.css, which is not relative",
    '<p style="background: url(//cdn/a.png)">': "loads //cdn/a.png from the network",
    "<style>@import 'http://there/a.css'</style>": "loads http://there/a.css from the network",
}
GOOD = """<h1 id="top">Up</h1><a href="page.html#top">up</a> <a href="https://example.org">out</a>
<img src="data:,"><a href="figures/a.csv">data</a><a href="page.ipynb">this</a>
<script>const text = "url(http://in-a-script)";</script>"""


def test_the_files_of_a_book_name_only_what_is_there(tmp_path):
    folder = tmp_path / "notebooks"
    (folder / "figures").mkdir(parents=True)
    (folder / "figures" / "a.csv").write_text("omega [rad/s]\n1\n")
    (folder / "page.ipynb").write_text('{"cells": [1]}')
    (folder / "page.html").write_text(GOOD)
    assert check_html.check(tmp_path) == []
    (folder / "page.html").write_text("\n".join(FAULTS))
    page = [f"notebooks/page.html {sign}" for sign in FAULTS.values()]
    page += ["notebooks/page.html has no link to download its source"]
    found = check_html.check(tmp_path)
    assert len(found) == len(page)
    assert all(any(one.startswith(sign) for one in found) for sign in page), found
