"""Write the table from which the page about orbits draws a year: `_static/live/orbits.js`.

For Kepler's orbits and the first year of ESA's it holds the round trips between spacecraft
1 and 2, 2 and 3, and 3 and 1, every five days from day -5 on, in whole microseconds past
16.5 s. The page interpolates them to 10 us. Which of its two ends a round trip begins at
matters less.
"""

from pathlib import Path

import numpy as np

from armlock.orbits import esa, kepler

DAY, STEP, FIRST = 86400.0, 5.0, 16.5
# Two steps past the year, for the interpolation at its end.
DAYS = STEP * np.arange(0, 76)


def table():
    """Return the text of the script: a name, and under each orbit's name its numbers."""
    rows = []
    orbits = {"Kepler": kepler(), "trailing": esa("trailing"), "leading": esa("leading")}
    for name, orbit in orbits.items():
        t = max(orbit.span[0], 0.0) + DAY * DAYS
        numbers = []
        for master in (1, 2, 3):
            arm = 1e6 * (orbit.round_trips(t, master)[0] - FIRST)
            # ESA's tables begin with the year: a cubic goes on before it.
            before = arm[:4] @ [4.0, -6.0, 4.0, -1.0]
            numbers.append(np.rint([before, *arm]).astype(int).tolist())
        rows.append(f'"{name}":{numbers}'.replace(" ", ""))
    return f"const armlockOrbits={{{','.join(rows)}}};\n"


def write(app, exception):
    """Put the table beside the other scripts."""
    if exception is None and app.builder.format == "html":
        file = Path(app.outdir) / "_static" / "live" / "orbits.js"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(table(), encoding="utf-8")


def setup(app):
    """Register with Sphinx."""
    app.connect("build-finished", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
