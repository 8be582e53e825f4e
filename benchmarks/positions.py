"""Settlement and tilt on every kind of mesh: eight plans, dual cells and triangles.

    python benchmarks/positions.py [--cells 600]

Worst relative errors of the plans in full contact: of the position of solutions, and of that by
collocation. Triangles are as many as dual cells.
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


def main(n: int = 600) -> dict:
    """Print the table; return {(kind, grid): (worst errors of the plans, (2, 2))}."""
    print(f"{'about ' + str(n) + ' cells':<24}{'settlement':<24}{'tilt':<24}")
    print(f"{'':<24}" + f"{'position':<12}{'collocated':<12}" * 2)
    worst = {}
    for kind in KINDS:
        for grid in ("dual", "triangles"):
            found = np.array([errors(name, kind, n, grid) for name in PLANS])
            worst[kind, grid] = found.max(axis=0)
            row = "".join(f"{e:<12.1e}" for e in worst[kind, grid].T.ravel())
            print(f"{kind:<11}{grid:<13}{row}", flush=True)
    return worst


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, default=600)
    main(parser.parse_args().cells)
