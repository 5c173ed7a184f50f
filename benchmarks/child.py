"""Measurements in a process of their own, where memory and threads are theirs alone."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]

# What limits the threads of the linear algebra behind numpy, for all its builds.
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)

_PROGRAM = """
import importlib, json, sys
module, function, arguments = sys.argv[1:]
print(json.dumps(getattr(importlib.import_module(module), function)(**json.loads(arguments))))
"""


def call(module: str, function: str, environment: dict[str, str], **arguments: Any) -> Any:
    """Call a function of a module in a new process; all values must fit into JSON.

    The last line the process prints is the result.
    """
    inherited = {k: v for k, v in os.environ.items() if k not in ONE_THREAD}
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, module, function, json.dumps(arguments)],
        cwd=ROOT,
        env=inherited | environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


def peak_memory() -> int:
    """Return the most resident memory this process has had, in bytes."""
    status = Path("/proc/self/status")
    if status.exists():
        # On Linux getrusage counts in what the parent had when it started this process.
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return _largest(resource.RUSAGE_SELF)


def peak_memory_of_children() -> int:
    """Return the most resident memory of any process that this one has waited for, in bytes.

    Those that its children have waited for count as well.
    """
    return _largest(resource.RUSAGE_CHILDREN)


def _largest(who: int) -> int:
    peak = resource.getrusage(who).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
