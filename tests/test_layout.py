"""Imports within the package go one way."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "armlock"
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")
#: Modules and folders of the package. Each imports only from those before it.
LAYERS = [
    "checks",
    "paper",
    "compiled",
    "tables",
    "engine",
    "typeset",
    "systems",
    "controllers",
    "matrices",
    "sensors",
    "loops",
    "stability",
    "robustness",
    "timedomain",
    "performance",
    "plotting",
    "orbits",
]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_one_way(path):
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
            assert place == here or inside or LAYERS.index(place) < LAYERS.index(here)
