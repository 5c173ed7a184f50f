"""Check that environment.txt is a complete lock: pinned, hashed, and nothing but that.

Usage: python tools/check_lock.py

It reads pyproject.toml and environment.txt in the current folder. Every direct dependency
must be pinned within its range, every pin must carry hashes, and no line may name the server
that a package comes from: the reader's own settings decide that.
"""

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def requirements(project: dict[str, Any]) -> list[Requirement]:
    """Return the direct dependencies, those of the groups and of the build included."""
    lines = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    extras = project["project"].get("optional-dependencies", {})
    for group in (*extras.values(), *project["dependency-groups"].values()):
        lines += group
    return [Requirement(line) for line in lines]


def check(project: dict[str, Any], lock: str) -> list[str]:
    """Return what is wrong with the lock."""
    problems = []
    lines = lock.replace("\\\n", " ").splitlines()
    pins = {}
    for line in (line for line in lines if line and not line.lstrip().startswith("#")):
        match = re.fullmatch(
            r"(\S+?)==(\S+)( ; .+?)?((?:\s+--hash=sha256:[0-9a-f]{64})+)\s*", line
        )
        if match is None:
            problems.append(f"not a pin with hashes: {line[:80]}")
        else:
            pins[canonicalize_name(match[1])] = match[2]
    if "://" in lock:
        problems.append("an address: environment.txt must not say where packages come from")
    for requirement in requirements(project):
        version = pins.get(canonicalize_name(requirement.name))
        if version is None:
            problems.append(f"not pinned: {requirement}")
        elif not requirement.specifier.contains(version, prereleases=True):
            problems.append(f"pinned to {version}, outside its range: {requirement}")
    return problems


def main() -> int:
    """Check the files in the current folder."""
    project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))
    problems = check(project, Path("environment.txt").read_text(encoding="utf-8"))
    for line in problems:
        print(f"environment.txt: {line}")
    print(f"environment.txt is {'not ' if problems else ''}a complete lock")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
