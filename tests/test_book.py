"""The built book holds what it should, and its build fails when it should.

`make test` builds the book before. What has to fail is a copy with one small notebook.
"""

import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import requires, version
from pathlib import Path

import nbformat
import pytest
from docutils import nodes
from docutils.utils import new_document

from book._ext import alternative
from tools import check_html

ROOT = Path(__file__).parents[1]
BOOK = ROOT / "build" / "html"
TEXT = "# A chapter\n\n{numref}`fig-small`, {numref}`fig-missing`, {doc}`/book/missing`"
DRAW = """
from matplotlib import pyplot as plt

fig, ax = plt.subplots()
"""
PAGES = ("bibliography.md", "status.md")
OFFERED = ("LICENSE", "LICENSE-docs", "CITATION.cff", "CHANGELOG.md", "environment.txt")
ADDRESS = "https://github.com/someone/something"
LINKS = {
    "book/bibliography.html": f'href="{ADDRESS}"',
    "notebooks/faulty.html": "https://mybinder.org/v2/gh/someone/something/main?urlpath=lab",
    "book/status.html": f"git clone {ADDRESS}",
}


def cell(source, **metadata):
    return nbformat.v4.new_code_cell(source, metadata=metadata)


def build(folder, notebook):
    """Build a copy of the book with another notebook; return exit code, output and pages."""
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
    chapters = ["notebooks/faulty", *(f"book/{Path(name).stem}" for name in PAGES)]
    (folder / "book" / "_toc.yml").write_text(
        "format: jb-book\nroot: book/intro\nchapters:\n"
        + "".join(f"  - file: {chapter}\n" for chapter in chapters)
    )
    nbformat.write(notebook, folder / "notebooks" / "faulty.ipynb")
    command = [str(Path(sys.executable).with_name("jupyter-book")), "build", ".", "--all"]
    command += ["--config", "book/_config.yml", "--toc", "book/_toc.yml"]
    command += ["--path-output", "build", "-W", "-n", "--keep-going"]
    # The metadata of the package as they are with an address in pyproject.toml.
    metadata = folder / "first" / f"armlock-{version('armlock')}.dist-info" / "METADATA"
    metadata.parent.mkdir(parents=True)
    metadata.write_text(
        f"Metadata-Version: 2.1\nName: armlock\nVersion: {version('armlock')}\n"
        f"Project-URL: repository, {ADDRESS}\n"
        + "".join(f"Requires-Dist: {line}\n" for line in requires("armlock") or [])
    )
    paths = [metadata.parents[1], os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, filter(None, paths)))}
    environment.pop("MPLBACKEND", None)  # the kernel chooses its own, which shows figures
    result = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    pages = folder / "build" / "_build" / "html"
    logs = [log.read_text() for log in pages.rglob("*.err.log")]  # of cells that failed
    return result.returncode, "\n".join([result.stdout, result.stderr, *logs]), pages


@pytest.mark.skipif(not BOOK.exists(), reason="no book: `make book` builds it")
def test_the_book_has_its_data_numbers_and_links():
    why, common = (
        (BOOK / f"notebooks/{name}.html").read_text().replace("&#160;", "\N{NO-BREAK SPACE}")
        for name in ("00_why", "04_common_arm")
    )
    for ending in ("csv", "svg"):
        assert (BOOK / f"figures/common-map.{ending}").is_file()
        assert f'href="../figures/common-map.{ending}" download' in common
    links = common[common.index("figures/common-map.svg") :]
    made = re.search(r'made by <a href="#(cell-\d+)">', links)
    assert made is not None
    assert f'id="{made[1]}"' in common
    assert re.search(r"Reading time: \d+ min", common)
    assert re.search(r'alt="[^"{]* times 10 to the -?\d', common)
    assert re.search(r"\\times 10\^\{-?\d+\}\\\)</span>\N{NO-BREAK SPACE}pm", why)
    status = (BOOK / "book/status.html").read_text()
    for name in (*OFFERED, "references.bib"):
        assert re.search(rf'href="\.\./_downloads/\w+/{name}"', status)
    assert version("armlock") in status[status.index("@software") :]
    # Nothing links to a repository whose address is not known.
    for page in BOOK.rglob("*.html"):
        assert not re.search("github.com|mybinder|colab", page.read_text()), page


def test_numbers_of_the_run_are_typeset_and_stand_beside_their_units():
    line = nodes.paragraph()
    for number, text in (("2.0e+02", " points, down to "), ("-3.1", " s, or 20 s.")):
        line += [nodes.inline(number, number, classes=["pasted-text"]), nodes.Text(text)]
    page = new_document("page")
    page += line
    alternative.typeset(None, page)
    alternative.join(None, page)
    found = [formula.astext() for formula in page.findall(nodes.math)]
    assert found == [r"2.0 \times 10^{2}", "-3.1"]
    assert page.astext().endswith("-3.1\N{NO-BREAK SPACE}s, or 20\N{NO-BREAK SPACE}s.")


def test_a_build_fails_on_each_fault(tmp_path):
    """Each fault is a warning about its notebook, and every warning fails the build."""
    figure = {
        "figure": {"caption": "A curve.", "name": "fig-small"},
        "image": {"alt": "At {nowhere:.1f} Hz"},
    }
    cells = [cell(DRAW, mystnb=figure), cell(DRAW), cell("assert 1 > 2, 'a check'")]
    faulty = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_markdown_cell(TEXT), *cells],
        metadata={"kernelspec": {"name": "python3", "display_name": "Python 3"}},
    )
    code, output, pages = build(tmp_path, faulty)
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
    assert ": a check" in output
    # The address of the repository, once it is known, stands on these pages.
    for name, link in LINKS.items():
        assert link in (pages / name).read_text()


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
