"""The code of the pages runs, and prints what the pages show."""

import os
import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest
from matplotlib import pyplot as plt

from tests import FULL

BOOK = Path(__file__).parents[1] / "book"
#: A recipe with packages that the environment does not hold.
APART = "## From the locked laser to TDI"


def blocks(text):
    """Return the code of a page, and what the page says that it prints."""
    code, shown = (
        re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL) for kind in ("python", "text")
    )
    assert max(map(len, "\n".join(code).splitlines())) <= 77  # what a page has room for
    return "\n\n".join(code), "".join(shown)


@pytest.mark.parametrize("name", ["any_loop", "recipes", "beside"])
@pytest.mark.filterwarnings("error")
def test_a_page_prints_what_it_shows(tmp_path, monkeypatch, capsys, name):
    """The code has a namespace of its own, in the process of the tests: imports take long."""
    code, shown = blocks((BOOK / f"{name}.md").read_text("utf-8").partition(APART)[0])
    monkeypatch.chdir(tmp_path)
    with plt.rc_context():
        exec(compile(code, f"{name}.md", "exec"), {"__name__": "__main__"})
    plt.close("all")
    assert capsys.readouterr().out == shown


def missing(package, pinned):
    try:
        return version(package) != pinned
    except PackageNotFoundError:
        return True


@pytest.mark.skipif(not FULL, reason="takes half a minute, and five packages: make attack")
def test_the_locked_laser_goes_through_tdi_as_chapter_14_says(tmp_path):
    """What the environment does not hold is fetched without its requirements.

    lisainstrument asks for an older dask than the environment's, and runs with this one.
    """
    text = (BOOK / "recipes.md").read_text("utf-8").partition(APART)[2]
    pins = re.findall(r"(\w+)==([\d.]+)", text)
    assert len(pins) == 5
    wanted = [f"{package}=={pinned}" for package, pinned in pins if missing(package, pinned)]
    packages = tmp_path / "packages"
    if wanted:
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
        command += ["--retries", "0", "--target", str(packages), *wanted]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        if done.returncode:
            pytest.skip(f"not installed: {wanted}: {done.stderr.strip().splitlines()[-1]}")
    code, shown = blocks(text)
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONPATH": str(packages)}
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == shown
    rows = shown.splitlines()[1:]
    assert len(rows) == 4
    for row in rows:
        found, formula, ratio, _, error = row.split()[3:]
        assert abs(float(ratio) - 1.0) < 3.0 * float(error)
        assert abs(float(found) / float(formula) - float(ratio)) < 0.01
