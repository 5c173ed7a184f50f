import doctest
from pathlib import Path


def test_the_example_in_the_readme_prints_what_it_says():
    readme = Path(__file__).parents[1] / "README.md"
    results = doctest.testfile(str(readme), module_relative=False)
    assert results.attempted > 5
    assert results.failed == 0
