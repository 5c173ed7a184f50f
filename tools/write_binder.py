"""Write binder/requirements.txt: what the notebooks need, as environment.txt pins it.

Usage: python tools/write_binder.py [--check]

Binder has a JupyterLab of its own, whose packages are best left alone. So it gets only what the
chapters import, in the locked versions; what those need in turn, pip finds. With --check
nothing is written, and a file that is out of date is an error.
"""

import re
import sys
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

# Beside the package's own dependencies: the chapters glue numbers, draw and write figures.
ALSO = ["ipykernel", "myst-nb", "pillow", "schemdraw"]
FILE = Path("binder/requirements.txt")
HEAD = "# Written by `make lock` from pyproject.toml and environment.txt.\n"


def binder(project: str, lock: str) -> str:
    """Return the file's text."""
    pins = dict(re.findall(r"^(\S+?)==(\S+)", lock, re.MULTILINE))
    direct = [Requirement(d).name for d in tomllib.loads(project)["project"]["dependencies"]]
    names = sorted(canonicalize_name(name) for name in direct + ALSO)
    return HEAD + "".join(f"{name}=={pins[name]}\n" for name in names)


def main() -> int:
    """Write or check the file in the current folder."""
    text = binder(
        Path("pyproject.toml").read_text(encoding="utf-8"),
        Path("environment.txt").read_text(encoding="utf-8"),
    )
    if "--check" not in sys.argv:
        FILE.write_text(text, encoding="utf-8")
    elif FILE.read_text(encoding="utf-8") != text:
        print(f"{FILE} is not what environment.txt pins: make lock writes it")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
