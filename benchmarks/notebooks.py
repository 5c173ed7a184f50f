"""Time and memory of each notebook, from the start of its kernel to its last cell."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

from benchmarks import child
from benchmarks.report import Row, Topic

LIMIT = 60.0
MEMORY = 2 * 2**30
CORES = 2


def execute(path: str) -> dict[str, Any]:
    """Run one notebook on two cores; to be called in a process of its own."""
    import nbclient
    import nbformat

    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    where = {"metadata": {"path": str(Path(path).parent)}}
    client = nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources=where
    )
    error = ""
    start = time.perf_counter()
    try:
        client.execute()
    except nbclient.exceptions.CellExecutionError as failure:
        error = f"{failure.ename}: {failure.evalue}"
    seconds = time.perf_counter() - start
    return {"seconds": seconds, "memory": child.peak_memory_of_children(), "error": error}


def run(*, quick: bool, folder: Path, notebooks: Path = child.ROOT / "notebooks") -> Topic:
    """Run each notebook once; only the first one when `quick`."""
    topic = Topic("Notebooks, run one by one")
    paths = sorted(notebooks.glob("*.ipynb"))
    if not paths:
        topic.notes.append("There are no notebooks.")
    for path in paths[: 1 if quick else None]:
        environment = {"JUPYTER_PREFER_ENV_PATH": "1"}
        result = child.call("benchmarks.notebooks", "execute", environment, path=str(path))
        requirement = (
            f"< {LIMIT:.0f} s on {CORES} cores; {result['memory'] / 2**20:.0f} MiB "
            f"< {MEMORY / 2**20:.0f} MiB"
        )
        if result["error"]:
            requirement += ", but it FAILED"
            topic.notes.append(f"{path.name} failed: {result['error']}")
        topic.rows.append(
            Row(
                path.name,
                result["seconds"],
                requirement=requirement,
                met=not result["error"]
                and result["seconds"] < LIMIT
                and result["memory"] < MEMORY,
            )
        )
    topic.notes.append(
        "Each runs in a new kernel, whose start counts; compiled loops come from the cache. "
        "The memory is the peak of the largest process."
    )
    return topic
