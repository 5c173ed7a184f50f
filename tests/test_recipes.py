"""The code of the pages runs, and prints what the pages show."""

import os
import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

BOOK = Path(__file__).parents[1] / "book"
#: A recipe with packages that the environment does not hold.
APART = "## From the locked laser to TDI"


def run(folder, text, packages=()):
    """Run the code of a page in one process, and compare what it prints with the page."""
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert max(map(len, "\n".join(blocks).splitlines())) <= 77  # what a page has room for
    shown = "".join(re.findall(r"```text\n(.*?)```", text, re.DOTALL))
    (folder / "page.py").write_text("\n\n".join(blocks))
    command = [sys.executable, "-W", "error", "page.py"]
    environment = {**os.environ, "MPLBACKEND": "agg"}
    environment["PYTHONPATH"] = os.pathsep.join(map(str, packages))
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == shown
    return done.stdout


@pytest.mark.parametrize("name", ["any_loop", "recipes", "beside"])
def test_a_page_prints_what_it_shows(tmp_path, name):
    run(tmp_path, (BOOK / f"{name}.md").read_text("utf-8").partition(APART)[0])


def missing(package, pinned):
    try:
        return version(package) != pinned
    except PackageNotFoundError:
        return True


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
    rows = run(tmp_path, text, [packages]).splitlines()[1:]
    assert len(rows) == 4
    for row in rows:
        found, formula, ratio, _, error = row.split()[3:]
        assert abs(float(ratio) - 1.0) < 3.0 * float(error)
        assert abs(float(found) / float(formula) - float(ratio)) < 0.01
