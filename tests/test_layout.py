"""The places listed in CONTRIBUTING.md: what they name is there, imports follow their order."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "armlock"
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def listed():
    """Folders of the list with their modules, in its order; "" is the package itself."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    found, folder = [], None
    for line in text.splitlines():
        if heading := re.match(r"### `armlock/(\w*)/?`", line):
            folder = heading[1]
        elif line and not line.startswith("|"):
            folder = None
        elif folder is not None and (row := re.match(r"\| `(\w+)` \|", line)):
            found.append((folder, row[1]))
    return found


# A folder uses only those before it. A module of the package itself counts as a folder.
ORDER = list(dict.fromkeys(folder or module for folder, module in listed()))


def test_the_list_names_every_module_in_its_folder():
    there = [path.relative_to(PACKAGE) for path in MODULES if path.stem != "__init__"]
    assert {Path(folder, f"{module}.py") for folder, module in listed()} == set(there)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_between_places_go_one_way(path):
    here = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not node.module:
            continue
        package, *inner = node.module.split(".")
        if package != "armlock":
            continue
        places = inner[:1] or [name.name for name in node.names]
        # A result is drawn by a method, which imports `plotting` when it is called.
        inside = node.col_offset > 0 and "plotting" in (here, *places)
        for place in places:
            assert place == here or inside or ORDER.index(place) < ORDER.index(here)
            if place != here:
                assert not any(name.name.startswith("_") for name in node.names)
