"""The tests; with FULL=1, as in `make attack`, all random cases, in all windows."""

import os

FULL = "FULL" in os.environ


def draws(few: int, full: int) -> int:
    """How many random cases to draw: a few, which show a rule that is broken, or all."""
    return full if FULL else few
