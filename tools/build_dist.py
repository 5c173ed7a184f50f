"""Build the source archive and the wheel.

Usage: python tools/build_dist.py FOLDER

A package index shows README.md apart from the files that it links to. So the links of the copy
that is packed lead to the repository, at the tag of this version, once `[project.urls]` of
pyproject.toml has its address. Until then they are plain text, and there is no picture.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from flit_core import buildapi

ROOT = Path(__file__).resolve().parents[1]
PICTURE = re.compile(r"!\[[^\]]*\]\(([^)]+)\)\n*")
LINK = re.compile(r"\[([^\]]+)\]\((?!\w+:|#)([^)]+)\)")


def for_an_index(readme: str, project: dict[str, Any]) -> str:
    """Return the README with links that hold anywhere."""
    address = project.get("urls", {}).get("repository")
    if address is None:
        return LINK.sub(r"\1", PICTURE.sub("", readme))
    at = f"v{project['version']}"
    pictures = PICTURE.sub(lambda p: p[0].replace(p[1], f"{address}/raw/{at}/{p[1]}"), readme)
    return LINK.sub(rf"[\1]({address}/blob/{at}/\2)", pictures)


def main() -> int:
    """Build both into the folder, from a copy of the tree."""
    target = Path(sys.argv[1]).resolve()
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    packed = ["armlock", "pyproject.toml", "README.md", "LICENSE"]
    packed += settings["tool"]["flit"]["sdist"]["include"]
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        for name in packed:
            if (ROOT / name).is_dir():
                leave = shutil.ignore_patterns("__pycache__", ".*")
                shutil.copytree(ROOT / name, tree / name, ignore=leave)
            else:
                shutil.copyfile(ROOT / name, tree / name)
        readme = tree / "README.md"
        text = for_an_index(readme.read_text(encoding="utf-8"), settings["project"])
        readme.write_text(text, encoding="utf-8")
        # Archives of one commit are equal, byte for byte.
        commit = ["git", "-C", str(ROOT), "log", "-1", "--format=%ct"]
        made = subprocess.run(commit, capture_output=True, text=True).stdout.strip()
        if made:
            os.environ.setdefault("SOURCE_DATE_EPOCH", made)
        os.chdir(tree)
        for build in (buildapi.build_sdist, buildapi.build_wheel):
            archive = target / build(str(target))
            archive.chmod(0o644)
            print(archive.name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
