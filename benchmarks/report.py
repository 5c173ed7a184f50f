"""What a topic measures, and how it is printed: as Markdown and as JSON."""

from __future__ import annotations

import json
import math
import os
import platform
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numba
import numpy as np

import armlock

COLUMNS = ("what", "time", "ratio", "requirement", "met")


@dataclass(frozen=True)
class Row:
    """One line of a topic's table.

    `requirement` is empty, and `met` is None, where a row only informs. `correctness` marks
    comparisons of results: if one is not met, the run fails.
    """

    what: str
    seconds: float | None = None
    ratio: float | None = None
    requirement: str = ""
    met: bool | None = None
    correctness: bool = False

    def cells(self) -> tuple[str, ...]:
        return (
            self.what,
            "" if self.seconds is None else duration(self.seconds),
            "" if self.ratio is None else f"{self.ratio:.3g}",
            self.requirement,
            "" if self.met is None else ("yes" if self.met else "NO"),
        )


def timed(
    function: Callable[..., Any],
    *arguments: Any,
    clock: Callable[[], float] = time.perf_counter,
    **options: Any,
) -> tuple[float, Any]:
    """Return how long a call took, and what it returned."""
    start = clock()
    result = function(*arguments, **options)
    return clock() - start, result


def at_most(what: str, seconds: float, limit: float) -> Row:
    """Return the row of a time that must not exceed a limit in s."""
    return Row(what, seconds, requirement=f"at most {limit:g} s", met=seconds <= limit)


def memory_row(what: str, memory: int, limit: int) -> Row:
    """Return the row of a memory that must not exceed a limit, both in bytes."""
    requirement = f"{memory / 2**20:.0f} MiB <= {limit / 2**20:.0f} MiB"
    return Row(f"{what}: peak memory", requirement=requirement, met=memory <= limit)


def comparison(what: str, differ: int, points: int, seconds: float | None = None) -> Row:
    """Return the row of a comparison of results at some points."""
    requirement = f"{differ} of {points} differ, none may"
    return Row(what, seconds, None, requirement, differ == 0, correctness=True)


@dataclass(frozen=True)
class Series:
    """How a time grows with one variable: best times in s, and fitted exponents.

    `exponent` is fitted to all values, `exponent_end` to the three largest.
    """

    what: str
    variable: str
    values: list[float]
    seconds: list[float]
    exponent: float
    exponent_end: float

    def cells(self) -> tuple[str, ...]:
        times = [duration(value) for value in self.seconds]
        return (self.what, *times, f"{self.exponent:.2f}", f"{self.exponent_end:.2f}")


@dataclass
class Topic:
    """The result of one module: a table, growth tables, figures and remarks.

    `data` goes to the JSON file alone.
    """

    title: str
    rows: list[Row] = field(default_factory=list)
    series: list[Series] = field(default_factory=list)
    figures: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    data: dict[str, Any] = field(default_factory=dict)


def fit_series(
    what: str, variable: str, values: Sequence[float], seconds: Sequence[float]
) -> Series:
    """Fit time = constant * value^exponent by least squares of the logarithms."""

    def slope(first: int) -> float:
        x, y = np.log(values[first:]), np.log(seconds[first:])
        return float(np.polyfit(x, y, 1)[0])

    last = max(0, len(values) - 3)
    return Series(what, variable, list(values), list(seconds), slope(0), slope(last))


def duration(seconds: float) -> str:
    """Write a time with three digits and a readable unit."""
    if seconds >= 1e4:
        power = math.floor(math.log10(seconds))
        return f"{seconds / 10**power:.2f}e{power} s"
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}" if seconds < 1e3 else f"{seconds:.0f} s"
    return f"{seconds:.1e} s"


def machine() -> dict[str, Any]:
    """Return what the times depend on, and nothing that names the machine."""
    return {
        "cores": cores(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "armlock": armlock.__version__,
        "load": [load()],
    }


def load() -> float:
    """Return how many processes have wanted a core, on average over the last minute."""
    return round(os.getloadavg()[0], 2)


def cores() -> int:
    """Return the number of cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine_line(about: dict[str, Any]) -> str:
    return (
        f"{about['cores']} cores, {about['system']}, Python {about['python']}, "
        f"numpy {about['numpy']}, numba {about['numba']}, armlock {about['armlock']}; "
        f"load average {about['load'][0]} at the start, {about['load'][-1]} at the end"
    )


def tables(topic: Topic) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """Yield each table of a topic: a heading, then its rows, the first one the header."""
    yield topic.title, [COLUMNS, *(row.cells() for row in topic.rows)]
    for variable in dict.fromkeys(series.variable for series in topic.series):
        group = [series for series in topic.series if series.variable == variable]
        header = ("best time of a chart", *(f"{value:g}" for value in group[0].values))
        yield (
            f"{topic.title}: growth with {variable}",
            [(*header, "exponent", "of last 3"), *(series.cells() for series in group)],
        )


def closing_line(topics: dict[str, Topic]) -> str:
    """Say in one line what was met and what was not."""
    rows = [row for topic in topics.values() for row in topic.rows if row.met is not None]
    wrong = [row.what for row in rows if row.correctness and not row.met]
    missed = [row.what for row in rows if not row.correctness and not row.met]
    if wrong:
        return f"WRONG RESULTS in {len(wrong)} comparison(s): {'; '.join(wrong)}."
    if missed:
        return (
            f"{len(missed)} of {len(rows)} requirements NOT met: {'; '.join(missed)}. All "
            f"comparisons of results agree. Times suffer from other work on the machine: run "
            f"again on a quiet one before drawing conclusions."
        )
    return f"All {len(rows)} requirements met."


def agree(topics: dict[str, Topic]) -> bool:
    """Whether every comparison of results came out right."""
    return all(row.met for topic in topics.values() for row in topic.rows if row.correctness)


def failed(name: str) -> Topic:
    """Return the topic of a module that ended in an error."""
    return Topic(name, [Row("it ended in an error", met=False, correctness=True)])


def topic_as_markdown(topic: Topic) -> str:
    """Return the tables, figures and remarks of a topic."""
    lines = []
    for heading, rows in tables(topic):
        lines += [f"## {heading}", ""]
        widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
        head, *body = ([c.ljust(w) for c, w in zip(r, widths, strict=True)] for r in rows)
        rule = ["-" * width for width in widths]
        lines += [*(f"| {' | '.join(row)} |" for row in (head, rule, *body)), ""]
    lines += [*(f"![{topic.title}]({name})" for name in topic.figures), ""]
    lines += [*(f"- {note}" for note in topic.notes), ""] if topic.notes else []
    return "\n".join(lines)


def as_markdown(about: dict[str, Any], topics: dict[str, Topic]) -> str:
    """Return the whole report."""
    parts = [
        "# Benchmark report",
        machine_line(about),
        *map(topic_as_markdown, topics.values()),
    ]
    return "\n\n".join([*parts, closing_line(topics), ""])


def write(folder: Path, about: dict[str, Any], topics: dict[str, Topic]) -> None:
    """Write report.md and report.json into `folder`."""
    (folder / "report.md").write_text(as_markdown(about, topics))
    everything = {
        "machine": about,
        "topics": {name: asdict(topic) for name, topic in topics.items()},
        "closing": closing_line(topics),
    }
    (folder / "report.json").write_text(json.dumps(everything, indent=1) + "\n")
