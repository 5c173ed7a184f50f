"""What claims, notebooks and tests compute in one run of pytest, they share in one folder."""

import os
import tempfile

import pytest


def pytest_configure(config: pytest.Config) -> None:
    """Name the folder, unless `make` has; the workers of pytest-xdist are told of it."""
    if "ARMLOCK_SHARED" not in os.environ:
        folder = tempfile.TemporaryDirectory(prefix="armlock-")
        os.environ["ARMLOCK_SHARED"] = folder.name
        config.add_cleanup(folder.cleanup)
