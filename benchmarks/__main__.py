"""Print one report of all topics: `python -m benchmarks`."""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

import benchmarks
from benchmarks import report

DEFAULT_FOLDER = Path(__file__).resolve().parents[1] / "build" / "benchmarks"


def topic_names() -> list[str]:
    """Return the modules of this package that have a function `run`."""
    names = [info.name for info in pkgutil.iter_modules(benchmarks.__path__)]
    return [
        name
        for name in names
        if name != "__main__" and hasattr(importlib.import_module(f"benchmarks.{name}"), "run")
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and write the report; return 1 if results are wrong, otherwise 0."""
    names = topic_names()
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--only", choices=names, action="append", help="one topic (repeat)")
    parser.add_argument("--quick", action="store_true", help="tiny sizes: does it all run?")
    parser.add_argument("--output", type=Path, default=DEFAULT_FOLDER, help="folder to write")
    options = parser.parse_args(arguments)
    folder: Path = options.output
    folder.mkdir(parents=True, exist_ok=True)
    about = report.machine()
    topics: dict[str, report.Topic] = {}
    for name in options.only or names:
        print(f"measuring: {name} ...", file=sys.stderr, flush=True)
        start = time.perf_counter()
        module = importlib.import_module(f"benchmarks.{name}")
        try:
            topics[name] = module.run(quick=options.quick, folder=folder)
        except Exception:  # the other topics are measured all the same
            traceback.print_exc()
            topics[name] = report.failed(name)
        topics[name].data["seconds"] = time.perf_counter() - start
        about["load"].append(report.load())
        report.write(folder, about, topics)
        print(report.topic_as_markdown(topics[name]), flush=True)
    print(report.machine_line(about))
    print(report.closing_line(topics))
    print(f"Written: report.md, report.json and figures in {folder}")
    return 0 if report.agree(topics) else 1


if __name__ == "__main__":
    sys.exit(main())
