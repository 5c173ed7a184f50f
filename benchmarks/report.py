"""What a topic has measured, and how it is printed, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.ticker import EngFormatter

DURATION = EngFormatter("s", places=2)
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
            "" if self.seconds is None else DURATION(self.seconds),
            "" if self.ratio is None else f"{self.ratio:.3g}",
            self.requirement,
            "" if self.met is None else ("yes" if self.met else "NO"),
        )


@dataclass(frozen=True)
class Topic:
    """The result of one module: a table, and remarks below it."""

    title: str
    rows: Sequence[Row]
    notes: Sequence[str] = ()


def at_most(what: str, seconds: float, limit: float) -> Row:
    """Return the row of a time that must not exceed a limit in s."""
    return Row(what, seconds, requirement=f"at most {limit:g} s", met=seconds <= limit)


def at_least(what: str, seconds: float, ratio: float, limit: float) -> Row:
    """Return the row of a ratio that must reach a limit."""
    return Row(what, seconds, ratio, f"at least {limit:,g}", ratio >= limit)


def memory_row(what: str, memory: int, limit: int) -> Row:
    """Return the row of a memory that must not exceed a limit, both in bytes."""
    requirement = f"{memory / 2**20:.0f} MiB <= {limit / 2**20:.0f} MiB"
    return Row(f"{what}: peak memory", requirement=requirement, met=memory <= limit)


def comparison(what: str, differ: int, points: int, seconds: float | None = None) -> Row:
    """Return the row of a comparison of results at some points."""
    requirement = f"{differ} of {points} differ, none may"
    return Row(what, seconds, None, requirement, differ == 0, correctness=True)


def markdown(topic: Topic) -> str:
    """Return the table and the remarks of a topic."""
    rows = [COLUMNS, *(row.cells() for row in topic.rows)]
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    head, *body = ([c.ljust(w) for c, w in zip(r, widths, strict=True)] for r in rows)
    rule = ["-" * width for width in widths]
    table = [f"| {' | '.join(row)} |" for row in (head, rule, *body)]
    return "\n".join(
        [f"## {topic.title}", "", *table, "", *(f"- {n}" for n in topic.notes), ""]
    )


def closing_line(topics: Sequence[Topic]) -> str:
    """Say in one line what was met and what was not."""
    rows = [row for topic in topics for row in topic.rows if row.met is not None]
    missed = [row for row in rows if not row.met]
    wrong = [row.what for row in missed if row.correctness]
    if wrong:
        return f"WRONG RESULTS in {len(wrong)} comparison(s): {'; '.join(wrong)}."
    if missed:
        named = "; ".join(row.what for row in missed)
        return f"{len(missed)} of {len(rows)} requirements NOT met: {named}. All results agree."
    return f"All {len(rows)} requirements met."


def agree(topics: Sequence[Topic]) -> bool:
    """Whether every comparison of results came out right."""
    return all(row.met for topic in topics for row in topic.rows if row.correctness)
