import ast
import doctest
import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import armlock
from book import companion

ROOT = Path(__file__).parents[1]
MODULES = [
    module.name
    for package in (armlock, companion)
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    if not module.name.endswith("__main__")
]


@pytest.mark.parametrize("name", MODULES)
def test_every_example_of_a_docstring_gives_what_it_shows(name):
    # An example draws in the current axes, which must not be those of another.
    plt.close("all")
    failures, _ = doctest.testmod(importlib.import_module(name))
    assert failures == 0


PUBLIC = [name for name in armlock.__all__ if callable(getattr(armlock, name))]


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_has_an_example(name):
    thing = getattr(armlock, name)
    section = inspect.cleandoc(thing.__doc__).partition("\nExamples\n")[2]
    assert ">>>" in section
    if inspect.isfunction(thing):
        assert name in section


# The page of the reference that shows them.
SHOWN = re.findall(r"automodule:: (armlock\.\w+)", (ROOT / "book/api/modules.md").read_text())


@pytest.mark.parametrize("name", SHOWN)
def test_a_constant_of_the_reference_has_a_comment_of_its_own(name):
    """Without `#:` in the line above, a sensor would be left out of the page."""
    source = inspect.getsource(importlib.import_module(name))
    lines = source.splitlines()
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            public = re.match(r"[A-Za-z]", lines[node.lineno - 1])
            assert not public or lines[node.lineno - 2].startswith("#:"), lines[node.lineno - 1]
