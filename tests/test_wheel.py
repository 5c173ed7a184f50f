"""What is installed is the small package; its source archive brings the tests."""

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "uv", "build", "--offline", "--no-build-isolation"]
    command += ["--python", sys.executable, "--out-dir", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return folder


def test_the_wheel_holds_the_package_only(built):
    files = (ROOT / "armlock").rglob("*.*")
    there = {str(file.relative_to(ROOT)) for file in files if "__pycache__" not in str(file)}
    wheel = zipfile.ZipFile(next(built.glob("*.whl")))
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert held == there
    name = next(name for name in wheel.namelist() if name.endswith("/METADATA"))
    metadata = wheel.read(name).decode()
    assert re.findall(r"^Provides-Extra: (.*)", metadata, re.MULTILINE) == [
        "book",
        "cluster",
        "tdi",
    ]


def test_the_source_archive_holds_the_tests_and_what_they_need(built):
    with tarfile.open(next(built.glob("*.tar.gz"))) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    for folder in ("armlock", "tests", "tests/data", "notebooks", "tools", "book/companion"):
        there = {f"{folder}/{file.name}" for file in (ROOT / folder).glob("[!._]*.*")}
        assert there
        assert there <= held
    assert {"Makefile", "environment.txt", "README.md", "book/_static/armlock.css"} <= held
    assert not [name for name in held if "__pycache__" in name or name.startswith(".")]
