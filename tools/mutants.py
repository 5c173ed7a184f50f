"""Change armlock at random, a sign, a comparison or a constant at a time, and run its tests.

    python tools/mutants.py MODULE [--number 20] [--seed 1] [--tests FILE ...] [--also FILE ...]

Each mutant is one small change in armlock/MODULE.py, made in a copy of the repository. The
tests of MODULE are run on it and then, if they pass, those that --also names. What no test
notices is printed, with the change. Kept tools do not serve here: mutmut leaves out decorated
functions, and so all compiled ones; cosmic-ray makes a thousand mutants of a short module, most
of them no Python for floats, draws no sample, and does not know that compiled code is kept.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
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


def passes(tree: Path, tests: list[str], cache: Path, limit: float) -> bool:
    """Whether the tests pass; one that takes too long has noticed something."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    kept = {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(cache)}
    with subprocess.Popen(
        command,
        cwd=tree,
        env=os.environ | kept | {"PYTHONDONTWRITEBYTECODE": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as run:
        try:
            return run.wait(limit) == 0
        except subprocess.TimeoutExpired:
            run.kill()
            return False


def main() -> int:
    """Make the mutants that the command line asks for, and print those that live."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("module")
    parser.add_argument("--number", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tests", nargs="*", help="tests/test_MODULE.py if not given")
    parser.add_argument("--also", nargs="*", default=[], help="tests for what survives these")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds for each run")
    given = parser.parse_args()
    source = (ROOT / "armlock" / f"{given.module}.py").read_text()
    drawn = mutants(source)
    drawn = random.Random(given.seed).sample(drawn, min(given.number, len(drawn)))
    stages = [given.tests or [f"tests/test_{given.module}.py"], given.also]
    alive = 0
    with tempfile.TemporaryDirectory() as place:
        tree, warm = Path(place, "tree"), Path(place, "warm")
        for name in ("armlock", "book", "tests", "benchmarks"):
            shutil.copytree(
                ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__")
            )
        shutil.copy(ROOT / "pyproject.toml", tree)
        if not all(passes(tree, tests, warm, given.limit) for tests in stages if tests):
            print("the tests fail without any change")
            return 1
        for number, (line, change, whole) in enumerate(drawn, 1):
            (tree / "armlock" / f"{given.module}.py").write_text(whole)
            # Compiled code is kept by file: callers in other files keep what they have inlined.
            cold = "njit" in source
            with tempfile.TemporaryDirectory() as new:
                cache = Path(new) if cold else warm
                if all(passes(tree, tests, cache, given.limit) for tests in stages if tests):
                    alive += 1
                    print(f"{given.module}.py:{line}: {change}", flush=True)
            print(f"{number} of {len(drawn)}: {alive} unnoticed", file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
