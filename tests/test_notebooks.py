"""The chapters as a reader meets them: what is shown runs when it is copied in order."""

import ast
import builtins
import json
import re
import symtable
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def all_cells(notebook):
    """Return the cells of a notebook."""
    return json.loads(notebook.read_text(encoding="utf-8"))["cells"]


def code_cells(notebook):
    """Return the code cells as (source, whether the page shows it)."""
    cells = all_cells(notebook)
    removed = {"remove-cell", "remove-input"}
    return [
        ("".join(cell["source"]), not removed & set(cell["metadata"].get("tags", [])))
        for cell in cells
        if cell["cell_type"] == "code"
    ]


def names(table):
    """Return the global names that a cell defines, and those that it uses."""
    defined, used = set(), set()
    for symbol in table.get_symbols():
        if table.get_type() == "module":
            if symbol.is_assigned() or symbol.is_imported():
                defined.add(symbol.get_name())
            elif symbol.is_referenced():
                used.add(symbol.get_name())
        elif symbol.is_global() and symbol.is_referenced():
            used.add(symbol.get_name())
    for child in table.get_children():
        inner = names(child)
        used |= inner[1]
    return defined, used


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_is_shown_needs_nothing_that_is_not(notebook):
    known = set(dir(builtins))
    for source, shown in code_cells(notebook):
        if shown:
            defined, used = names(symtable.symtable(source, notebook.name, "exec"))
            assert not used - known - defined, source
            known |= defined


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_bookkeeping_is_one_statement_a_cell(notebook):
    for source, shown in code_cells(notebook):
        if not shown:
            assert len(ast.parse(source).body) == 1, source


#: What a cell that the page leaves out may call: it passes numbers on, and computes none.
BOOKKEEPING = {"figures", "diagrams", "plt", "np", "Ledger", "ledger"} | set(dir(builtins))
METHODS = {"min", "max", "values", "items", "subplots"}


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_bookkeeping_computes_nothing(notebook):
    for source, shown in code_cells(notebook):
        for call in ast.walk(ast.parse(source)):
            if not shown and isinstance(call, ast.Call):
                name = next(n.id for n in ast.walk(call.func) if isinstance(n, ast.Name))
                method = getattr(call.func, "attr", "")
                assert name in BOOKKEEPING or method in METHODS, ast.unparse(call)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_folded_cells_say_what_they_hold(notebook):
    for cell in all_cells(notebook):
        if {"hide-input", "hide-cell"} & set(cell["metadata"].get("tags", [])):
            label = cell["metadata"].get("mystnb", {}).get("code_prompt_show")
            assert label, cell["id"]
            source = "".join(cell["source"])
            decided = re.findall(r'^claims\["(\w+)"\] = ', source, re.MULTILINE)
            named = re.findall(r"[A-Z]\d+", label) if label.startswith("Claim") else []
            assert named == decided, label
