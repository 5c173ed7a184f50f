"""What is installed is the small package; its source archive brings the tests."""

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from tools.build_dist import for_an_index

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, str(ROOT / "tools" / "build_dist.py"), str(folder)]
    subprocess.run(command, check=True, capture_output=True)
    return folder


def test_the_wheel_holds_the_package_only(built):
    files = (ROOT / "armlock").rglob("*.*")
    there = {str(file.relative_to(ROOT)) for file in files if "__pycache__" not in str(file)}
    wheel = zipfile.ZipFile(next(built.glob("*.whl")))
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert held == there
    name = next(name for name in wheel.namelist() if name.endswith("/METADATA"))
    metadata = wheel.read(name).decode()
    assert re.findall(r"^Provides-Extra: (.*)", metadata, re.MULTILINE) == ["book", "cluster"]
    assert not re.search(r"\]\((?!https?:)", metadata)


def test_the_source_archive_holds_the_tests_and_what_they_need(built):
    with tarfile.open(next(built.glob("*.tar.gz"))) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    for folder in ("armlock", "tests", "tests/data", "notebooks", "tools", "book/companion"):
        there = {f"{folder}/{file.name}" for file in (ROOT / folder).glob("[!._]*.*")}
        assert there
        assert there <= held
    assert {"Makefile", "environment.txt", "README.md", "book/_static/armlock.css"} <= held
    assert not [name for name in held if "__pycache__" in name or name.startswith(".")]


def test_links_of_the_readme_hold_where_a_package_index_shows_it():
    readme = "![Chart\nof it](a/b.png)\n\nSee [this](C.md), <http://x>, [that](https://y).\n"
    project = {"version": "1.2"}
    assert for_an_index(readme, project) == "See this, <http://x>, [that](https://y).\n"
    there = "https://z/o/n"
    assert for_an_index(readme, {**project, "urls": {"repository": there}}) == (
        f"![Chart\nof it]({there}/raw/v1.2/a/b.png)\n\nSee [this]({there}/blob/v1.2/C.md), "
        "<http://x>, [that](https://y).\n"
    )
