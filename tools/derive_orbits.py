"""Derive the book's tables of ESA's orbits from the files that ESA has published.

    python -m tools.derive_orbits FOLDER

FOLDER holds `trailing_lisa1.oem` ... `leading_lisa3.oem`. Positions are taken every five days
from the curves of `armlock.orbits.read_oem`, and rounded to centimetres. Round trips from these
tables are within 3e-7 s of those from the files.
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

import numpy as np

from armlock.orbits import read_oem

DATA = Path(__file__).parents[1] / "book" / "data"
STEP = 5 * 86400.0
ORIGINAL = {
    "trailing": "mida-20deg/trajectory_out_mida-20deg_cw_sg-2nmss_may_launch_lisa{1,2,3}.oem",
    "leading": "mida+20deg/trajectory_out_mida+20deg_cw_sg-2nmss_nov_launch_lisa{1,2,3}.oem",
}
HEADER = """\
# Orbits of LISA, {name} the Earth: positions of spacecraft 1, 2 and 3 from the Sun, EME2000.
# Author of the data: Waldemar Martens, ESA/ESOC. Licence: CC BY 4.0.
# Source: repository esa/lisa-orbit-files, commit bf87d559f67c5ac65a32418471a9a9d41012a166,
#   crema_2p0/tcb_time_scale/{original}
# Changed: interpolated to every five days from the first epoch on, rounded to centimetres,
#   written into one file; velocities and accelerations left out. By tools/derive_orbits.py.
# epoch: {epoch}
# scale: {scale}
# Columns: time since that epoch in s; x, y, z of 1, of 2, of 3 in m.
"""


def main() -> None:
    """Write both tables."""
    folder = Path(sys.argv[1])
    DATA.mkdir(exist_ok=True)
    for name, original in ORIGINAL.items():
        orbits = read_oem([folder / f"{name}_lisa{k}.oem" for k in (1, 2, 3)])
        t = np.arange(0.0, orbits.span[1], STEP)
        places = orbits.positions(t).reshape(t.size, 9)
        lines = [
            ",".join([f"{time:.0f}", *(f"{value:.2f}" for value in row)])
            for time, row in zip(t, places, strict=True)
        ]
        text = HEADER.format(
            name=name, original=original, epoch=orbits.epoch, scale=orbits.scale
        )
        text += "\n".join(lines) + "\n"
        # Without a date, so that the same files give the same bytes.
        file = DATA / f"esa_{name}.csv.gz"
        file.write_bytes(gzip.compress(text.encode(), 9, mtime=0))
        print(f"{file.name}: {t.size} rows, {file.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
