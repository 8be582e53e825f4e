"""What edge-weighted cells cost, and how soon they are accurate.

    python benchmarks/edge_time.py           both tables
    python benchmarks/edge_time.py --small   small sizes only

1. Set-up of the correction beside the exact dense matrix (up to 2400 cells), and alone up to 1e5
   cells. 2. Milliseconds from nothing to a settlement within 0.1 % and 0.01 % of the exact one,
   mesh included, on the smallest mesh of a ladder that gets and stays there.
"""

import argparse
from time import perf_counter

import numpy as np
from eight_plans import PLANS, make
from quiet import warn_beside_other_work
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, RigidPunch
from skfem_dual.elements.edge_correction import EdgeCorrection
from skfem_dual.elements.edge_weights import EdgeWeights
from skfem_dual.elements.influence import influence_matrix
from skfem_dual.grids.outline import edge_ribs

SOIL = HalfSpace(1.0, 0.0)
LADDER = (20, 30, 45, 65, 100, 150, 220, 330, 500, 750, 1100, 1700, 2500)


def best(work, repeat=5):
    """Least of some times, in seconds."""
    times = []
    for _ in range(repeat):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)


def set_up(sizes=(600, 2400, 10_000, 100_000)):
    """Print the times of set-up; return {n: (dense, correction)} in seconds."""
    print(f"{'cells':>8}{'dense ms':>10}{'correction ms':>15}{'ratio':>8}{'us/cell':>9}")
    found = {}
    for n in sizes:
        basis = DualMesh.from_mesh(make("disc", "uniform", n)).basis()
        partition = basis.partition
        x = partition.centroids

        def correction(basis=basis, partition=partition, x=x):
            weights = EdgeWeights.from_basis(basis, partition, edge_ribs(partition))
            return EdgeCorrection.from_weights(weights, SOIL.singular_coefficient, x)

        correction()
        sparse = best(correction)
        dense = np.nan
        if n <= 2400:
            matrix = influence_matrix(SOIL, partition, x)
            dense = best(lambda: influence_matrix(SOIL, partition, x))  # noqa: B023
            sparse += best(lambda: correction().add_to(matrix)) - sparse  # noqa: B023
        found[n] = dense, sparse
        print(
            f"{len(partition):>8}{dense * 1e3:>10.1f}{sparse * 1e3:>15.1f}"
            f"{sparse / dense:>8.2f}{sparse / len(partition) * 1e6:>9.1f}"
        )
    return found


def to_accuracy(plans=("disc", "square"), ladder=LADDER):
    """Print milliseconds to 0.1 % and 0.01 %; return {(plan, edge): errors and seconds}."""
    print(f"\n{'plan':<10}{'edge':<12}" + "".join(f"{g:>26}" for g in ("0.1 %", "0.01 %")))
    found = {}
    for name in plans:
        for edge in ("constant", "singular"):
            rows = []
            for n in ladder:

                def run(n=n, name=name, edge=edge):
                    # the mesh that suits the plan: uniform, triangles as cells
                    dual = DualMesh.from_mesh(_mesh(name, n))
                    punch = RigidPunch(SOIL, dual.primal_basis(), edge=edge)
                    return punch.solve(1.0).settlement * PLANS[name].stiffness[0] - 1

                rows.append((n, abs(run()), best(run, 3)))
            found[name, edge] = rows
            cells = []
            for goal in (1e-3, 1e-4):
                reached = next(
                    (i for i in range(len(rows)) if all(e < goal for _, e, _ in rows[i:])), None
                )
                cells.append(
                    "not reached"
                    if reached is None
                    else f"{rows[reached][2] * 1e3:.1f} ms, {rows[reached][0]} nodes"
                )
            print(f"{name:<10}{edge:<12}" + "".join(f"{c:>26}" for c in cells), flush=True)
    return found


def _mesh(name: str, n: int) -> MeshTri:
    return make(name, "uniform", n)


if __name__ == "__main__":
    warn_beside_other_work()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    small = parser.parse_args().small
    set_up((600,) if small else (600, 2400, 10_000, 100_000))
    to_accuracy(ladder=LADDER[:6] if small else LADDER)
