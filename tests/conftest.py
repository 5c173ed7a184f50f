import csv
import os
from pathlib import Path

import pytest
from hypothesis import Phase, settings

from tests import FULL, draws

# The matrices here are small, and several workers share the machine.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")

# The same examples in every run and on every worker, but with FULL=1; times of a shared machine
# say nothing. Explaining a failure traces every line, which does not go with loading compiled
# code.
settings.register_profile(
    "armlock",
    derandomize=not FULL,
    database=None,
    deadline=None,
    max_examples=draws(30, 500),
    phases=[Phase.explicit, Phase.generate, Phase.shrink],
    print_blob=FULL,
)
settings.load_profile("armlock")

DATA = Path(__file__).with_name("data")


@pytest.fixture
def table():
    """Read a table of tests/data as a list of dictionaries, comment lines left out."""

    def read(name):
        lines = (DATA / name).read_text().splitlines()
        return list(csv.DictReader(line for line in lines if not line.startswith("#")))

    return read
