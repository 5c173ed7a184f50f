import ast
import doctest
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
TABLE = re.findall(r"^\| `(\w+)` \|", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)


def test_the_example_in_the_readme_prints_what_it_says():
    results = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert results.attempted > 5
    assert results.failed == 0


def test_every_module_stands_beside_the_question_it_answers():
    folders = (ROOT / "armlock", ROOT / "book" / "companion")
    assert {file.stem for folder in folders for file in folder.glob("[!_]*.py")} == set(TABLE)


def test_a_module_uses_only_those_above_it_in_the_table():
    for name in TABLE[: TABLE.index("plotting") + 1]:
        for node in ast.parse((ROOT / "armlock" / f"{name}.py").read_text()).body:
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("armlock"):
                module = str(node.module).removeprefix("armlock").lstrip(".")
                used = [module] if module else [alias.name for alias in node.names]
                assert {*used} <= {*TABLE[: TABLE.index(name)]}, (name, used)
