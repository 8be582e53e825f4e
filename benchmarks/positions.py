"""Settlement and tilt on every kind of mesh: eight plans, dual cells and triangles.

    python benchmarks/positions.py [--cells 600 2400]

Relative errors of the position in full contact, median and worst of the plans, and those of the
position by collocation. Triangles are as many as dual cells.
"""

import argparse

import numpy as np
from eight_plans import KINDS, PLANS, make

from skfem_dual import DualMesh, HalfSpace, RigidPunch

SOIL = HalfSpace(1.0, 0.0)


def errors(name: str, kind: str, n: int, grid: str) -> np.ndarray:
    """Relative errors of settlement and of the worse tilt, shape (2, 2).

    The first row is that of the position of solutions, the second of that by collocation.
    """
    dual = DualMesh.from_mesh(make(name, kind, n if grid == "dual" else n // 2 + 20))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    punch, stiffness = RigidPunch(SOIL, basis), PLANS[name].stiffness
    central, *beside = (
        punch.solve(1.0, at, unilateral=False).positions[[0, 2]]
        for at in ((0.0, 0.0), (0.1, 0.0), (0.0, 0.1))
    )
    settlement = np.abs(central[:, 0] * stiffness[0] - 1)
    tilts = [
        np.abs((found - central)[:, i] / 0.1 * stiffness[i] - 1)
        for i, found in enumerate(beside, 1)
    ]
    return np.column_stack([settlement, np.max(tilts, axis=0)])


def table(n: int) -> dict:
    """Print the table; return {(kind, grid): errors of the plans, (8, 2, 2)}."""
    print(f"{'about ' + str(n) + ' cells':<24}{'settlement':<44}{'tilt':<44}")
    print(f"{'':<24}" + f"{'position':<22}{'collocated':<22}" * 2)
    print(f"{'':<24}" + f"{'median':<10}{'worst':<12}" * 4)
    every = {}
    for kind in KINDS:
        for grid in ("dual", "triangles"):
            found = np.array([errors(name, kind, n, grid) for name in PLANS])
            every[kind, grid] = found
            cells = np.stack([np.median(found, axis=0), found.max(axis=0)], axis=-1)
            row = "".join(f"{m:<10.1e}{w:<12.1e}" for m, w in cells.swapaxes(0, 1).reshape(4, 2))
            print(f"{kind:<11}{grid:<13}{row}", flush=True)
    whole = np.concatenate(list(every.values()))[:, 0]
    for name, of in zip(("settlement", "tilt"), whole.T, strict=True):
        print(f"all {name}s: median {np.median(of):.1e}, worst {of.max():.1e}")
    print()
    return every


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[600, 2400])
    for cells in parser.parse_args().cells:
        table(cells)
