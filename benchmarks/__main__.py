"""Print one report of all topics, each when it is done: `python -m benchmarks`."""

from __future__ import annotations

import argparse
import platform
import sys
import traceback
from collections.abc import Sequence

import numba
import numpy as np

import armlock
from benchmarks import calls, charts, measure, peers, simulation
from benchmarks.report import Row, Topic, agree, closing_line, markdown

TOPICS = {
    "charts": charts,
    "calls": calls,
    "simulation": simulation,
    "peers": peers,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; return 1 if results are wrong, otherwise 0."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--only", choices=TOPICS, action="append", help="one topic (repeat)")
    parser.add_argument("--quick", action="store_true", help="tiny sizes: does it all run?")
    options = parser.parse_args(arguments)
    print(
        f"# Benchmark report\n\n{measure.cores()} cores, {platform.system()} "
        f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}, "
        f"numba {numba.__version__}, armlock {armlock.__version__}; load average "
        f"{measure.load()} at the start.\n",
        flush=True,
    )
    done: list[Topic] = []
    for name in options.only or TOPICS:
        print(f"measuring: {name} ...", file=sys.stderr, flush=True)
        try:
            topic: Topic = TOPICS[name].run(quick=options.quick)
        except Exception:  # the other topics are measured all the same
            traceback.print_exc()
            topic = Topic(name, [Row(f"{name} ended in an error", met=False, correctness=True)])
        done.append(topic)
        print(markdown(topic), flush=True)
    print(f"{closing_line(done)} Load average {measure.load()} at the end.")
    return 0 if agree(done) else 1


if __name__ == "__main__":
    sys.exit(main())
