"""What is installed is the small package, and all of it."""

import tarfile
import zipfile
from pathlib import Path

from flit_core import buildapi

ROOT = Path(__file__).parents[1]


def test_the_wheel_and_the_source_archive_hold_the_package_only(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    there = {f"armlock/{file.name}" for file in (ROOT / "armlock").glob("*.*")}
    wheel = zipfile.ZipFile(tmp_path / buildapi.build_wheel(str(tmp_path)))
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert held == there
    with tarfile.open(tmp_path / buildapi.build_sdist(str(tmp_path))) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    assert held - {"pyproject.toml", "PKG-INFO", "README.md", "LICENSE"} == there
