import doctest
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_example_in_the_readme_prints_what_it_says():
    results = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert results.attempted > 5
    assert results.failed == 0


def test_every_module_stands_beside_the_question_it_answers():
    rows = re.findall(r"^\| `(\w+)` \|", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    folders = (ROOT / "armlock", ROOT / "book" / "companion")
    modules = {file.stem for folder in folders for file in folder.glob("[!_]*.py")}
    assert modules == set(rows)
