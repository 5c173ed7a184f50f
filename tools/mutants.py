"""Change armlock at random, a sign, a comparison or a constant at a time, and run its tests.

    python tools/mutants.py MODULE [--number 20] [--seed 1] [--tests FILE ...]

Each mutant is one small change in armlock/MODULE.py, made in a copy of the repository. Of the
tests, those run that call the changed function, the fastest first. What none of them notices is
printed, with the change. Kept tools do not serve here: mutmut leaves out decorated functions,
and so all compiled ones; cosmic-ray makes a thousand mutants of a short module, most of them no
Python for floats, draws no sample, and does not know that compiled code is kept.

tests/mutants.md holds what such runs found.
"""

from __future__ import annotations

import argparse
import ast
import copy
import importlib
import json
import os
import random
import resource
import shutil
import sys
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numba
import pytest

ROOT = Path(__file__).resolve().parent.parent
PLACE = ROOT / "build" / "mutants"
TREE, WARM, CACHE, KNOWN = (PLACE / name for name in ("tree", "warm", "cache", "known.json"))
# Loaded once, for the processes of all mutants.
LOADED = "numba mpmath matplotlib.pyplot scipy.signal scipy.stats control"
# In the copy, compiled code is kept until its function, or one that it calls, changes: a change
# of any module makes all of it anew in the package.
STAMP = """

def _text(function, seen):
    import inspect

    seen.add(function)
    text = inspect.getsource(function)
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if hasattr(value, "py_func"):
            text += _text(value.py_func, seen) if value.py_func not in seen else ""
        elif isinstance(value, int | float | complex | tuple | np.ndarray):
            text += repr(value)
    return text


def _begin_files(cache, function):
    super(_Cache, cache).__init__(function)
    files = _Files(cache.cache_path, cache._impl.filename_base, None)
    files.function = function
    cache._cache_file = files


_Cache.__init__ = _begin_files
_Files._source_stamp = property(lambda self: _text(self.function, set()), lambda self, _: None)
"""
SWAPS: dict[type[ast.AST], tuple[type[ast.AST], ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.Pow: (ast.Mult,),
    ast.FloorDiv: (ast.Mult,),
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}


def code(node: ast.AST) -> Iterator[ast.AST]:
    """Walk over what is computed: no annotations, decorators, messages or text."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "exc"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not isinstance(child, ast.JoinedStr):
                yield child
                yield from code(child)


def changed(node: ast.AST) -> list[ast.AST]:
    """Return the node with one small change, in every way there is."""
    found: list[ast.AST] = []

    def add(**fields: object) -> None:
        other = copy.deepcopy(node)
        for name, value in fields.items():
            setattr(other, name, value)
        found.append(other)

    if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign):
        for swap in SWAPS.get(type(node.op), ()):
            add(op=swap())
    elif isinstance(node, ast.Compare):
        for swap in SWAPS.get(type(node.ops[0]), ()):
            add(ops=[swap(), *node.ops[1:]])
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        found.append(node.operand)
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        add(value=not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int):
        add(value=node.value + 1)
    elif isinstance(node, ast.Constant) and isinstance(node.value, float):
        for value in (2.0 * node.value or 1.0, 300.0 * node.value or -1.0):
            add(value=value)
    return found


def mutants(source: str) -> list[tuple[int, str, str]]:
    """Return line, change and changed source, for every small change."""
    lines = source.encode().splitlines(keepends=True)
    starts = [sum(map(len, lines[:k])) for k in range(len(lines))]
    text = source.encode()
    found = []
    for node in code(ast.parse(source)):
        for other in changed(node):
            first = starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]
            last = starts[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]
            new = ast.unparse(other)
            new = new if isinstance(node, ast.AugAssign) else f"({new})"
            change = f"{text[first:last].decode()}  ->  {new}"
            whole = (text[:first] + new.encode() + text[last:]).decode()
            found.append((node.lineno, change, whole))  # type: ignore[attr-defined]
    return found


def functions(source: str) -> list[range]:
    """Return the lines of each function that is in no other."""
    found: list[range] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and not any(node.lineno in f for f in found):
            first = min([node.lineno, *(one.lineno for one in node.decorator_list)])
            found.append(range(first, (node.end_lineno or first) + 1))
    return found


class Tests:
    """A plugin for pytest: learn what tests call and how long they take, or choose by it."""

    def __init__(self, module: Path, function: range | None, *, learn: bool) -> None:
        self.module, self.function, self.learn = str(module), function, learn
        self.known = {} if learn else json.loads(KNOWN.read_text())

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Keep the tests that call the function, and sort them by time."""
        if self.learn:
            return
        if self.function is not None:
            lines = {*self.function}
            calling = [item for item in items if lines & {*self.known[item.nodeid][1]}]
            items[:] = calling or items  # what no test calls may run on import
        items.sort(key=lambda item: float(self.known[item.nodeid][0]))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Generator[None, object, object]:
        """Note which functions of the module a test calls, and its time."""
        called, start = set(), time.process_time()

        def note(frame: FrameType, event: str, _: object) -> None:
            if event == "call" and frame.f_code.co_filename == self.module:
                called.add(frame.f_code.co_firstlineno)

        sys.setprofile(note if self.learn else None)
        result = yield
        sys.setprofile(None)
        self.known[item.nodeid] = time.process_time() - start, sorted(called)
        return result

    def pytest_sessionfinish(self) -> None:
        """Keep what was learned."""
        if self.learn:
            KNOWN.write_text(json.dumps(self.known))


def passes(tests: list[str], plugin: Tests, cache: Path, limit: int) -> bool:
    """Whether the tests pass; one that takes too long has noticed something."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1] == 0
    code = 1
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        nowhere = os.open(os.devnull, os.O_RDWR)
        for k in range(3):
            os.dup2(nowhere, k)
        os.chdir(TREE)
        sys.path[0] = os.environ["PYTHONPATH"] = str(TREE)
        sys.dont_write_bytecode = True
        numba.config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"] = str(cache)
        code = pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests], plugins=[plugin])
    finally:
        os._exit(int(code))


def main() -> int:
    """Make the mutants that the command line asks for, and print those that live."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("module")
    parser.add_argument("--number", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tests", nargs="*", help="tests/test_MODULE.py if not given")
    parser.add_argument("--limit", type=int, default=600, help="processor seconds a run")
    given = parser.parse_args()
    tests = given.tests or [f"tests/test_{given.module}.py"]
    source = (ROOT / "armlock" / f"{given.module}.py").read_text()
    drawn = mutants(source)
    drawn = random.Random(given.seed).sample(drawn, min(given.number, len(drawn)))
    for name in LOADED.split():
        importlib.import_module(name)
    shutil.rmtree(TREE, ignore_errors=True)
    for name in ("armlock", "book", "tests", "benchmarks"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, TREE / name, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", TREE)
    with (TREE / "armlock" / "compiled.py").open("a") as file:
        file.write(STAMP)
    changing = TREE / "armlock" / f"{given.module}.py"
    if not passes(tests, Tests(changing, None, learn=True), WARM, given.limit):
        print("the tests fail without any change")
        return 1
    alive = 0
    for number, (line, change, whole) in enumerate(drawn, 1):
        changing.write_text(whole)
        shutil.rmtree(CACHE, ignore_errors=True)
        shutil.copytree(WARM, CACHE)
        # Calls of compiled functions are not seen.
        inside = (
            None
            if "njit" in source
            else next((one for one in functions(source) if line in one), None)
        )
        lives = passes(tests, Tests(changing, inside, learn=False), CACHE, given.limit)
        alive += lives
        if lives:
            print(f"{given.module}.py:{line}: {change}", flush=True)
        print(f"{number} of {len(drawn)}: {alive} unnoticed", file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
