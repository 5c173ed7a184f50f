"""The chapters as a reader meets them: what is open runs when it is copied in order.

A chapter is a course, and behind it a file. Its open cells need only its imports. The cells
that decide claims stand folded at its end, and bind names of their own.
"""

import ast
import builtins
import json
import re
import symtable
from collections import Counter
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
#: Lines of an open cell, at most.
LONGEST = 25


class Cell:
    """A code cell: its source, its label, and how the page shows it."""

    def __init__(self, cell):
        tags = set(cell["metadata"].get("tags", []))
        self.id = cell["id"]
        self.source = "".join(cell["source"])
        self.label = cell["metadata"].get("mystnb", {}).get("code_prompt_show", "")
        self.shown = not tags & {"remove-cell", "remove-input"}
        self.folded = bool(tags & {"hide-input", "hide-cell"})
        self.imports = self.label == "Imports"
        self.open = self.imports or (self.shown and not self.folded)
        #: Whether it belongs to the file: claims, what they need, numbers for other pages.
        self.filed = re.match(r"Claims? |Numbers for ", self.label) is not None
        self.decides = re.search(r'(?m)^(claims|numbers)\["', self.source) is not None
        self.glues = self.source.startswith("figures.glue(")


def all_cells(notebook):
    """Return the cells of a notebook."""
    return json.loads(notebook.read_text(encoding="utf-8"))["cells"]


def code_cells(notebook):
    """Return the code cells of a notebook."""
    return [Cell(cell) for cell in all_cells(notebook) if cell["cell_type"] == "code"]


def names(table):
    """Return the global names that a piece of code binds, and those that it uses only."""
    bound, used = set(), set()
    for symbol in table.get_symbols():
        if table.get_type() == "module":
            if symbol.is_assigned() or symbol.is_imported():
                bound.add(symbol.get_name())
            elif symbol.is_referenced():
                used.add(symbol.get_name())
        elif symbol.is_global() and symbol.is_referenced():
            used.add(symbol.get_name())
    for child in table.get_children():
        used |= names(child)[1]
    return bound, used


def names_of(*nodes):
    """Return the same for a part of a syntax tree."""
    text = "\n".join(map(ast.unparse, nodes))
    return names(symtable.symtable(text, "cell", "exec"))


def taken(source):
    """Return the names that a cell takes from others, and those that it binds.

    A statement uses what the statements before it have bound, so `a = a + 1` takes `a`. A
    function may use what the whole cell binds.
    """
    needs: set[str] = set()
    bound: set[str] = set()
    later: set[str] = set()

    def use(*nodes):
        needs.update(names_of(*nodes)[1] - bound)

    def run(statements):
        for one in statements:
            match one:
                case ast.FunctionDef() | ast.ClassDef():
                    later.update(names_of(one)[1])
                case ast.For():
                    use(one.iter)
                    bound.update(names_of(ast.parse(f"{ast.unparse(one.target)} = 0"))[0])
                    run(one.body + one.orelse)
                    continue
                case ast.If() | ast.While():
                    use(one.test)
                    bound.update(names_of(ast.Expr(one.test))[0])
                    run(one.body + one.orelse)
                    continue
                case ast.AugAssign():
                    use(ast.parse(ast.unparse(one.target)), one.value)
                case ast.Assign() | ast.AnnAssign() if one.value is not None:
                    use(one.value)
                    use(one)
                case _:
                    use(one)
            bound.update(names_of(one)[0])

    run(ast.parse(source).body)
    return (needs | later - bound) - set(dir(builtins)), bound


def missing(cells):
    """Return the names that cells take, in order, but none of those before binds."""
    known: set[str] = set()
    lost: set[str] = set()
    for cell in cells:
        needs, bound = taken(cell.source)
        lost |= needs - known
        known |= bound
    return lost


def twice(cells):
    """Return the names that are glued, or bound in the file, and that two cells bind."""
    binders = Counter(name for cell in cells for name in taken(cell.source)[1])
    kept = [taken(cell.source)[not cell.glues] for cell in cells if cell.glues or cell.filed]
    return {name for names in kept for name in names if binders[name] > 1} - {"_"}


def code(source, label="", *tags):
    """Return a cell as a notebook has it."""
    metadata = {"tags": list(tags), "mystnb": {"code_prompt_show": label}}
    return Cell({"id": "", "source": [source], "metadata": metadata})


def test_what_a_cell_takes_from_others():
    assert taken("a = a + 1\nb = a") == ({"a"}, {"a", "b"})
    assert taken("n += k\nfor i in n:\n    i = i + j") == ({"n", "k", "j"}, {"n", "i"})
    assert taken("def f(x):\n    return x + y\nz = [f(v) for v in w]")[0] == {"y", "w"}
    assert taken('claims["A1"] = one\nprint(f"{two}")') == ({"claims", "one", "two"}, set())
    assert taken("if (m := top()) > 1:\n    top = m") == ({"top"}, {"m", "top"})
    assert missing([code("one = 1"), code("two = one + three"), code("three = 3")]) == {"three"}


def test_what_two_cells_bind_is_found():
    glue = code("figures.glue(a=modulus, b=other)")
    cells = [code("modulus = 1"), code("other = 2"), code("for modulus in (3, 4):\n    pass")]
    assert twice([*cells, glue]) == {"modulus"}
    claim = code('ratio = 2\nclaims["K5"] = True, ratio', "Claim K5", "hide-input")
    assert twice([code("ratio = 1"), claim]) == {"ratio"}
    assert not twice([code("ratio = 1"), code("ratio = 2")])


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_is_open_needs_the_imports_only(notebook):
    assert not missing([cell for cell in code_cells(notebook) if cell.open])


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_is_shown_needs_nothing_that_is_not(notebook):
    assert not missing([cell for cell in code_cells(notebook) if cell.shown])


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_is_glued_or_filed_is_bound_by_one_cell(notebook):
    assert not twice(code_cells(notebook))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_file_stands_behind_the_course(notebook):
    cells = code_cells(notebook)
    assert all(cell.filed for cell in cells if cell.decides)
    first = next((k for k, cell in enumerate(cells) if cell.filed), len(cells))
    for cell in cells[first:]:
        check = cell.label == "Check" and cell.folded
        assert (cell.filed and cell.folded) or check or not cell.shown, cell.label


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_open_cells_are_short(notebook):
    for cell in code_cells(notebook):
        lines = len(cell.source.splitlines())
        assert not cell.open or cell.imports or lines <= LONGEST, cell.source


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_imports_hold_imports_the_style_and_empty_dictionaries(notebook):
    for cell in code_cells(notebook):
        for one in ast.parse(cell.source).body if cell.imports else []:
            line = ast.unparse(one)
            bare = line == "plotting.use_style()" or line.endswith(("= {}", "({}, {})"))
            assert bare or isinstance(one, ast.Import | ast.ImportFrom), line


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_bookkeeping_is_one_statement_a_cell(notebook):
    for cell in code_cells(notebook):
        assert cell.shown or len(ast.parse(cell.source).body) == 1, cell.source


#: What a cell that the page leaves out may call: it passes numbers on, and computes none.
BOOKKEEPING = {"figures", "diagrams", "plt", "np", "Ledger", "ledger"} | set(dir(builtins))
METHODS = {"min", "max", "values", "items", "subplots"}


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_bookkeeping_computes_nothing(notebook):
    for cell in code_cells(notebook):
        for call in ast.walk(ast.parse(cell.source)):
            if not cell.shown and isinstance(call, ast.Call):
                name = next(n.id for n in ast.walk(call.func) if isinstance(n, ast.Name))
                method = getattr(call.func, "attr", "")
                assert name in BOOKKEEPING or method in METHODS, ast.unparse(call)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_folded_cells_say_what_they_hold(notebook):
    for cell in code_cells(notebook):
        if cell.folded:
            assert cell.label, cell.id
            decided = re.findall(r'^claims\["(\w+)"\] = ', cell.source, re.MULTILINE)
            claims = cell.label.startswith("Claim")
            assert decided == (re.findall(r"[A-Z]\d+", cell.label) if claims else [])
