"""Contact that is found: iterations and times of both methods against the number of cells.

    python benchmarks/unilateral.py                    the whole table, some minutes
    python benchmarks/unilateral.py --sizes 600 1200   other numbers of dual cells

A flat disc under forces at 0.35 a, 0.5 a and 0.7 a from its centre, and a sphere whose contact
fills 70 % of the disc. Assembly of the matrix and the pressures in full contact, with which a flat
punch begins, come once and beside the times of the methods: the active set solves equations
between the cells in contact, the conjugate gradients multiply by the matrix. The difference is
that of the pressures, over the largest. Beyond 4000 cells a fast summation takes the place of the
matrix, and there is nothing to be factorised.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from quiet import warn_beside_other_work

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.contact.load import Load
from skfem_dual.contact.shapes import Paraboloid
from skfem_dual.contact.system import DENSE
from skfem_dual.grids.generate import disc

SOIL = HalfSpace(1.0, 0.0)
SIZES = (600, 1200, 2400, 4000, 8000)
CASES = {"e = 0.35 a": 0.35, "e = 0.5 a": 0.5, "e = 0.7 a": 0.7, "Hertz": None}
METHODS = ("active-set", "cg")
#: radius of the sphere with a contact of radius 0.84 under a unit force, 4 E* a^3 / (3 P)
SPHERE = 4 * 0.84**3 / 3


@dataclass(frozen=True)
class Row:
    """Solutions by method, and the seconds of what comes once."""

    assembly: float
    full: float
    solutions: dict[str, PunchSolution]

    @property
    def difference(self) -> float:
        """Of the pressures by both methods, over the largest; NaN of one alone."""
        first, *others = (s.pressure for s in self.solutions.values())
        return max((np.abs(p - first).max() / first.max() for p in others), default=np.nan)

    def __str__(self) -> str:
        last = self.solutions["cg"]
        text = f"{len(last.pressure):>6}{len(last.contact):>12}    "
        text += f"{self.assembly:<10.2f}{self.full:<9.2f}"
        for method in METHODS:
            s = self.solutions.get(method)
            text += f"{s.iterations:<5}{s.timings['solution']:<10.3f}" if s else f"{'-':<15}"
        residual = max(s.complementarity_residual for s in self.solutions.values())
        difference = "-" if np.isnan(self.difference) else f"{self.difference:.0e}"
        return text + f"{difference:<12}{residual:.0e}"


def measure(punch: RigidPunch, eccentricity: float | None) -> Row:
    """Solve with both methods; what comes once has come before."""
    at = (eccentricity or 0.0, 0.0)
    system = punch.system  # with the matrix
    if punch.gap is None:
        system.bilateral(Load(force=1.0).constraints(np.zeros(2)))
    methods = METHODS if len(punch.partition) <= DENSE else METHODS[1:]
    return Row(
        assembly=punch.timings["assembly"],
        full=sum(punch.timings.values()) - punch.timings["assembly"],
        solutions={method: punch.solve(1.0, at, method=method) for method in methods},
    )


def main(sizes=SIZES) -> dict[tuple[int, str], Row]:
    """Print the table; return its rows by size and case."""
    print(f"{'':<34}{'seconds, once':<19}{'active set':<15}conj. gradients")
    print(
        f"{'case':<12}{'cells':>6}{'in contact':>12}    {'assembly':<10}{'full':<9}"
        + f"{'its':<5}{'seconds':<10}" * 2
        + f"{'difference':<12}residual"
    )
    found = {}
    for n in sizes:
        basis = DualMesh.from_mesh(disc(n=n)).basis()
        for gap, cases in ((None, list(CASES)[:3]), (Paraboloid(SPHERE), list(CASES)[3:])):
            punch = RigidPunch(SOIL, basis, gap=gap)
            for case in cases:
                found[n, case] = measure(punch, CASES[case])
                print(f"{case:<12}{found[n, case]}", flush=True)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="N")
    sizes = parser.parse_args().sizes
    warn_beside_other_work()
    main(sizes)
