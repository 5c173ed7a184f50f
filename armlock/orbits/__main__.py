"""Your loop in orbit: `python -m armlock.orbits LOOP ORBIT...`."""

from __future__ import annotations

import argparse
import runpy
import sys
from pathlib import Path

from armlock.checks import positive_number
from armlock.orbits.constellation import Constellation, kepler
from armlock.orbits.passages import DAY, YEAR, LoopInOrbit, loops
from armlock.orbits.survey import survey
from armlock.orbits.tables import read_oem, read_table


def chosen_loop(name: str) -> LoopInOrbit:
    """Return one of the book's loops, or the function `loop` of a file."""
    known = loops()
    if name in known:
        return known[name]
    if not Path(name).is_file():
        raise ValueError(
            f"LOOP must be a Python file or one of {', '.join(known)}; got {name!r}"
        )
    found = runpy.run_path(name).get("loop")
    if not callable(found):
        raise ValueError(f"{name} must define a function loop(tau1, tau2, held), got {found!r}")
    loop: LoopInOrbit = found
    return loop


def chosen_orbits(names: list[str]) -> Constellation:
    """Return Kepler's orbits, those of a table, or those of three OEM files."""
    if names == ["kepler"]:
        return kepler()
    if len(names) == 1:
        return read_table(names[0])
    if len(names) == 3:
        return read_oem(names)
    raise ValueError(
        f"ORBIT must be kepler, a table, or three OEM files, one a spacecraft; got {len(names)}"
    )


def main(arguments: list[str] | None = None) -> None:
    """Print what a loop meets along an orbit, and draw it if asked to."""
    parser = argparse.ArgumentParser(
        prog="python -m armlock.orbits",
        description="Stable days, outages, switches of the master, pulling and X2 of a loop.",
    )
    parser.add_argument(
        "loop",
        metavar="LOOP",
        help="flight, paper, robust, buildable, or a Python file with loop(tau1, tau2, held)",
    )
    parser.add_argument(
        "orbit",
        metavar="ORBIT",
        nargs="+",
        help="kepler, a table (CSV, see read_table), or three OEM files of spacecraft 1, 2, 3",
    )
    parser.add_argument("--master", type=int, default=1, choices=(1, 2, 3))
    parser.add_argument("--start", type=float, help="days since the orbits' epoch")
    parser.add_argument("--years", type=float, help="how many; default: all that a table holds")
    parser.add_argument("--plot", metavar="FILE", help="write a figure (PNG, SVG, PDF)")
    given = parser.parse_args(arguments)
    try:
        orbits = chosen_orbits(given.orbit)
        start = max(orbits.span[0], 0.0) if given.start is None else given.start * DAY
        years = given.years and positive_number("years", given.years)
        stop = None if years is None else start + years * YEAR
        found = survey(chosen_loop(given.loop), orbits, start, stop, given.master)
    except (OSError, TypeError, ValueError) as error:
        parser.error(str(error))
    print(found)
    if given.plot:
        from armlock.plotting import use_style

        use_style()
        found.plot().savefig(given.plot)
        print(f"figure: {given.plot}", file=sys.stderr)


if __name__ == "__main__":
    main()
