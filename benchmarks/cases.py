"""Tables of load cases on one thread: processor time to solve a thousand, and for their table.

    python benchmarks/cases.py
    python benchmarks/cases.py --cells 300 --cases 200      fewer

A disc and a square of 600 dual cells under forces all around: all of them within a quarter of the
half width, with contact everywhere, or every second one from 0.36 to 0.8 of it, where the punch
lifts off. Seconds for a thousand cases. What serves any number of them, the matrix with its
factors and the rows of the sectors, has come before.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Callable
from time import process_time
from typing import NamedTuple

import numpy as np
from quiet import warn_beside_other_work
from skfem import MeshTri
from small import THREADS

from skfem_dual import CasesSolution, DualMesh, HalfSpace, Load, RigidPunch
from skfem_dual.grids.generate import disc, rectangle

PLANS: dict[str, Callable[..., MeshTri]] = {"disc": disc, "square": rectangle}
#: parts of the half width: of loads with contact everywhere, and of those that lift off
NEAR, FAR = (0.0, 0.25), (0.36, 0.8)


class Row(NamedTuple):
    """Seconds for a thousand cases, and what was found."""

    solution: float
    table: float
    cases: CasesSolution


def loads(count: int, lifting: bool) -> list[Load]:
    """Unit forces all around, every second one far out if cases are to lift off."""
    rng = np.random.default_rng(1)
    angle = rng.uniform(0, 2 * np.pi, count)
    radius = rng.uniform(*NEAR, count)
    if lifting:
        radius[1::2] = rng.uniform(*FAR, count)[1::2]
    at = (radius * np.array([np.cos(angle), np.sin(angle)])).T
    return [Load(force=1.0, at=(x, y)) for x, y in at.tolist()]


def measure(punch: RigidPunch, given: list[Load]) -> Row:
    """Solve and tabulate; both once before with two loads, which compiles."""
    punch.solve_many([Load(force=1.0, at=(0.5, 0.1)), Load(force=1.0)]).table()
    begin = process_time()
    cases = punch.solve_many(given)
    solved = process_time()
    cases.table()
    end = process_time()
    per = 1000 / len(given)
    return Row(per * (solved - begin), per * (end - solved), cases)


def main(cells: int = 600, count: int = 1000) -> dict[tuple[str, bool], Row]:
    """Print the table; return its rows by plan and whether cases lift off."""
    print(f"{'plan':<10}{'cells':>6}{'lifted':>8}{'solution':>12}{'table':>8}{'both':>8}")
    found = {}
    for name, plan in PLANS.items():
        punch = RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(plan(n=cells)).basis())
        for lifting in (False, True):
            row = found[name, lifting] = measure(punch, loads(count, lifting))
            lifted = np.mean(row.cases.contact_share < 1)
            figures = f"{row.solution:>12.2f}{row.table:>8.2f}{row.solution + row.table:>8.2f}"
            print(f"{name:<10}{len(punch.partition):>6}{lifted:>8.0%}{figures}", flush=True)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, default=600, metavar="N")
    parser.add_argument("--cases", type=int, default=1000, metavar="N")
    given = parser.parse_args()
    one = dict.fromkeys(THREADS, "1")
    if one.items() <= os.environ.items():
        main(given.cells, given.cases)
    else:  # libraries count threads when they are loaded
        warn_beside_other_work()
        sys.exit(subprocess.run([sys.executable, *sys.argv], env=os.environ | one).returncode)
