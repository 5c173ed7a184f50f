"""Compiled functions run where no folder can be written, too."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
CODE = "from armlock import LaserNoise; print(LaserNoise(1).draw(3).size)"


def test_where_nothing_can_be_written_each_process_compiles(tmp_path):
    package = tmp_path / "armlock"
    shutil.copytree(ROOT / "armlock", package, ignore=shutil.ignore_patterns("__pycache__"))
    for source in package.rglob("*.py"):
        (source.parent / "__pycache__").touch()
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null", "PYTHONPATH": str(tmp_path)}
    environment = {**os.environ, **nowhere}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, "-B", "-c", CODE]
    done = subprocess.run(
        command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert (done.stdout, done.stderr) == ("3\n", "")
