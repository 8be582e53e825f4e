"""Accuracy of constant and of edge-weighted cells: eight plans, five kinds of meshes.

    python benchmarks/edge.py            the whole table, some minutes
    python benchmarks/edge.py --small    the smallest meshes only

Relative errors of the settlement, of the tilt (the larger of both directions) and of the pressure
(rms at the centroids farther than 0.1 from the edge; disc and ellipse, whose pressure is exact).
Each row tells the worst of the plans, for the settlement also the root mean square over them.
"""

import argparse

import numpy as np
from eight_plans import KINDS, PLANS, make

from skfem_dual import DualMesh, HalfSpace, RigidPunch
from skfem_dual.contact.exact import ellipse_pressure
from skfem_dual.grids.outline import distance_to_segments

SOIL = HalfSpace(1.0, 0.0)
SIZES = (150, 600, 2400)


def errors(name: str, kind: str, n: int, grid: str, edge: str) -> np.ndarray:
    """Errors of settlement, tilt and pressure; NaN where no exact pressure is known."""
    dual = DualMesh.from_mesh(make(name, kind, n))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    punch = RigidPunch(SOIL, basis, edge=edge)
    central, *eccentric = (
        punch.solve(1.0, at, unilateral=False) for at in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    )
    tilts = [found.tilt[i] - central.tilt[i] for i, found in enumerate(eccentric)]
    position = np.array([central.settlement, *tilts])
    settlement, *tilts = position * PLANS[name].stiffness - 1
    return np.array([settlement, np.abs(tilts).max(), pressure_error(name, central)])


def pressure_error(name, solution):
    semiaxes = {"disc": (1.0, 1.0), "ellipse": (1.0, 0.5)}.get(name)
    if semiaxes is None:
        return np.nan
    partition = solution.punch.partition
    a, b = partition.polygons.p[:, partition.facets[:, partition.f2c[1] == -1]].swapaxes(0, 1)
    far = distance_to_segments(partition.centroids, a, b) > 0.1
    x, area = partition.centroids[:, far], partition.areas[far]
    ratio = solution.pressure_at(x) / ellipse_pressure(x, 1.0, semiaxes)
    return np.sqrt(np.average((ratio - 1) ** 2, weights=area))


def main(sizes=SIZES, plans=tuple(PLANS), kinds=KINDS):
    """Print the table; return {(grid, kind, n, edge): errors of shape (plans, 3)}."""
    print(f"Plans: {', '.join(plans)}")
    print("Relative errors, worst of the plans (rms); n: nodes = dual cells, about")
    head = f"{'grid':<10}{'mesh':<11}{'n':>5}  "
    print(head + "   ".join(f"{edge:<45}" for edge in ("constant, centroid", "edge-weighted")))
    columns = f"{'settlement':<21}{'tilt':<12}{'pressure':<12}"
    print(" " * len(head) + "   ".join([columns] * 2))
    found = {}
    for grid in ("dual", "triangles"):
        for kind in kinds:
            for n in sizes:
                cells = []
                for edge in ("constant", "singular"):
                    e = np.array([errors(name, kind, n, grid, edge) for name in plans])
                    found[grid, kind, n, edge] = e
                    rms = np.sqrt(np.mean(e[:, 0] ** 2))
                    worst = np.nanmax(np.abs(e), axis=0)
                    cells.append(
                        f"{worst[0]:.1e} ({rms:.1e})".ljust(21)
                        + "".join(f"{w:.1e}".ljust(12) for w in worst[1:])
                    )
                print(f"{grid:<10}{kind:<11}{n:>5}  " + "   ".join(cells), flush=True)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    main(SIZES[:1] if parser.parse_args().small else SIZES)
