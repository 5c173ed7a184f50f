"""The lines of the page "Many machines", also with a worker and the program killed."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from armlock import CommonArm, critical_perturbation

ROOT = Path(__file__).parents[1]
#: The scripts of the page: for the cores of one machine, and for Dask.
SCRIPTS = re.findall(r"```python\n(.*?)```", (ROOT / "book/cluster.md").read_text(), re.DOTALL)
GAINS = np.geomspace(0.01, 10.0, 8)
#: Put into the function: each call is logged, one kills its worker, all take a while.
WATCHED = """def reach(gain):
    import os, signal, time
    with open("log", "a") as log:
        log.write(f"{gain!r}\\n")
    if os.path.exists("kill") and gain > 0.03:
        os.remove("kill")
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.3)
"""


def start(folder, script):
    """Run a script of the page, which saves what it finds."""
    lines = script.replace("10.0, 200)", f"10.0, {GAINS.size})").replace(
        "n_jobs=-1", "n_jobs=2"
    )
    lines = lines.replace("n_workers=2", "n_workers=2, dashboard_address=None")
    lines = lines.replace("def reach(gain):\n", WATCHED)
    (folder / "page.py").write_text(f'{lines}    np.save("found.npy", found)\n')
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "default"}
    return subprocess.Popen(
        [sys.executable, "page.py"], cwd=folder, env=environment, stderr=subprocess.DEVNULL
    )


def calls(folder):
    log = folder / "log"
    return log.read_text().split() if log.exists() else []


def kept(folder):
    return len(list((folder / "kept").rglob("output.pkl")))


def check(folder):
    """Compare what a script has saved with calls one after the other."""
    expected = [critical_perturbation(CommonArm(gain), (-1.0, -1.0)) for gain in GAINS]
    np.testing.assert_array_equal(np.load(folder / "found.npy"), expected)


def test_joblib_finds_what_single_calls_find(tmp_path):
    pytest.importorskip("joblib")
    assert start(tmp_path, SCRIPTS[0]).wait(timeout=120) == 0
    check(tmp_path)


def test_a_run_whose_worker_and_program_are_killed_goes_on_and_finds_the_same(tmp_path):
    pytest.importorskip("distributed")
    (tmp_path / "kill").touch()
    first = start(tmp_path, SCRIPTS[1])
    end = time.monotonic() + 120
    while kept(tmp_path) < 2 and first.poll() is None and time.monotonic() < end:
        time.sleep(0.05)
    first.send_signal(signal.SIGKILL)
    first.wait()
    time.sleep(2.0)  # its workers end
    before = len(calls(tmp_path))
    found = kept(tmp_path)
    assert 2 <= found < GAINS.size
    assert not (tmp_path / "found.npy").exists()
    assert start(tmp_path, SCRIPTS[1]).wait(timeout=120) == 0
    # What was kept is not computed again.
    assert len(calls(tmp_path)) - before == GAINS.size - found
    check(tmp_path)
    assert not (tmp_path / "kill").exists()
