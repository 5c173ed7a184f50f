"""What do real arms do to a loop? First: how long are they, and how fast do they move."""

from armlock.orbits.constellation import Constellation, from_table, kepler, read_oem

__all__ = ["Constellation", "from_table", "kepler", "read_oem"]
