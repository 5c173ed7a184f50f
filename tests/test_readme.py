import doctest
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_example_in_the_readme_prints_what_it_says():
    results = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert results.attempted > 5
    assert results.failed == 0
