"""Write the package's tables of ESA's orbits from the files that ESA has published.

    python -m tools.derive_orbits FOLDER

FOLDER holds `trailing_lisa1.oem` ... `leading_lisa3.oem`. The tables hold the published
positions, rounded to metres.
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

import numpy as np
from oem import OrbitEphemerisMessage

from armlock import orbits
from armlock.checks import FloatArray

DATA = Path(orbits.__file__).parent / "data"
ORIGINAL = {
    "trailing": "mida-20deg/trajectory_out_mida-20deg_cw_sg-2nmss_may_launch_lisa{1,2,3}.oem",
    "leading": "mida+20deg/trajectory_out_mida+20deg_cw_sg-2nmss_nov_launch_lisa{1,2,3}.oem",
}
HEADER = """\
# Orbits of LISA, {name} the Earth: positions of spacecraft 1, 2 and 3 from the Sun, EME2000.
# Author of the data: Waldemar Martens, ESA/ESOC. Licence: CC BY 4.0.
# Source: repository esa/lisa-orbit-files, commit bf87d559f67c5ac65a32418471a9a9d41012a166,
#   crema_2p0/tcb_time_scale/{original}
# Changed: rounded to metres, written into one file; velocities and accelerations left out. By
#   tools/derive_orbits.py.
# epoch: {epoch}
# Columns: time since that epoch in s; x, y, z of 1, of 2, of 3 in m.
"""


def read(file: Path) -> tuple[FloatArray, FloatArray]:
    """Return the times of states in s, and the positions in m."""
    states = OrbitEphemerisMessage.open(file).states
    seconds = [(state.epoch - states[0].epoch).to_value("s") for state in states]
    # Where a segment ends and the next begins, the epoch stands twice.
    times, kept = np.unique(seconds, return_index=True)
    return times, 1e3 * np.array([state.position for state in states])[kept]


def main() -> None:
    """Write both tables."""
    for name, original in ORIGINAL.items():
        files = [Path(sys.argv[1]) / f"{name}_lisa{k}.oem" for k in (1, 2, 3)]
        (times, one), (_, two), (_, three) = (read(file) for file in files)
        places = np.hstack((one, two, three))
        lines = [
            ",".join([f"{time:.6f}", *(f"{value:.0f}" for value in row)])
            for time, row in zip(times, places, strict=True)
        ]
        text = HEADER.format(name=name, original=original, epoch=orbits._ESA[name])
        text += "\n".join(lines) + "\n"
        # Without a date, so that the same files give the same bytes.
        file = DATA / f"esa_{name}.csv.gz"
        file.write_bytes(gzip.compress(text.encode(), 9, mtime=0))
        print(f"{file.name}: {times.size} rows, {file.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
