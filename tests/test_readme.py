import doctest
import re
from pathlib import Path

import control

import armlock

ROOT = Path(__file__).parents[1]


def test_the_example_in_the_readme_prints_what_it_says():
    results = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert results.attempted > 5
    assert results.failed == 0


def test_the_new_calls_of_the_changelog_return_what_it_says():
    text = (ROOT / "CHANGELOG.md").read_text("utf-8").partition("### Roots at s = 0")[2]
    rows = re.findall(r"^\| .* \| `([^`]*)` \| `([^`]*)` \|$", text.partition("\n###")[0], re.M)
    assert len(rows) >= 9
    run, names = doctest.DocTestRunner(), {"control": control, **vars(armlock)}
    for call, returned in rows:
        test = doctest.DocTestParser().get_doctest(
            f">>> {call}\n{returned}\n", dict(names), call, "CHANGELOG.md", 0
        )
        assert run.run(test).failed == 0
