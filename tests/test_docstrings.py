import doctest
import importlib
import pkgutil

import pytest

import armlock

MODULES = [
    "armlock",
    *sorted(m.name for m in pkgutil.walk_packages(armlock.__path__, "armlock.")),
]


@pytest.mark.parametrize("name", MODULES)
def test_every_example_of_a_docstring_gives_what_it_shows(name):
    failures, _ = doctest.testmod(importlib.import_module(name))
    assert failures == 0


def test_the_examples_are_found():
    finder = doctest.DocTestFinder()
    examples = [
        example
        for name in MODULES
        for test in finder.find(importlib.import_module(name))
        for example in test.examples
    ]
    assert len(examples) >= 15
