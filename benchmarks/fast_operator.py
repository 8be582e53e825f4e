"""Fast summation from a thousand to a million cells: set-up, product, memory, error; solutions.

python benchmarks/fast_operator.py                 up to 1e5 cells
python benchmarks/fast_operator.py --million       1e6 as well
python benchmarks/fast_operator.py --small         1e3 only

Discs of uniform cells, and of cells graded 100 : 1 to the edge. Times of set-up are without mesh
and edge weights, which are given apart; "three" is the time of products of three vectors together
over that of one.
"""

import argparse
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from edge_time import best
from quiet import warn_beside_other_work
from skfem import MeshTri

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, RigidPunch
from skfem_dual.elements.edge_weights import EdgeWeights
from skfem_dual.grids.generate import disc
from skfem_dual.grids.outline import edge_ribs
from skfem_dual.operators.dense import moment_matrix
from skfem_dual.operators.influence_operator import InfluenceOperator
from skfem_dual.operators.iterative import solve_many
from skfem_dual.operators.preconditioner import Preconditioner

SOIL = HalfSpace(1.0, 0.0)
GROUND = GradedHalfSpace.init_linear(1.0, 0.25, 0.5)


@dataclass(frozen=True)
class Row:
    """Seconds, bytes and errors of one operator; three products at a time over one."""

    n: int
    weights: float
    setup: float
    product: float
    three: float
    memory: int
    error: float
    row_error: float


def rings(n: int) -> MeshTri:
    """Unit disc of about ``n`` nodes on concentric rings of 6, 12, 18, ..."""
    last = round((np.sqrt(12 * n - 3) - 3) / 6)
    ring = np.repeat(np.arange(last + 1), np.maximum(6 * np.arange(last + 1), 1))
    first = np.concatenate([[0], 1 + 3 * np.arange(last + 1) * np.arange(1, last + 2)])
    angle = 2 * np.pi * (np.arange(len(ring)) - first[ring]) / np.maximum(6 * ring, 1)
    p = ring / last * np.array([np.cos(angle), np.sin(angle)])
    sector, j = (k.ravel() for k in np.meshgrid(np.arange(6), np.arange(1, last + 1)))

    def node(ring, sector, k):
        return first[ring] + (sector * ring + k) % np.maximum(6 * ring, 1)

    triangles = []
    for k in range(last):
        on = j > k
        s, outer = sector[on], j[on]
        triangles.append([node(outer, s, k), node(outer, s, k + 1), node(outer - 1, s, k)])
        on = j > k + 1
        s, outer = sector[on], j[on]
        triangles.append([node(outer - 1, s, k), node(outer, s, k + 1), node(outer - 1, s, k + 1)])
    return MeshTri(p, np.hstack([np.array(t) for t in triangles]))


def graded(n: int) -> MeshTri:
    """Disc graded 100 : 1 to the edge; above some thousand nodes a smaller one is refined."""
    refinements = max(0, int(np.ceil(np.log(n / 8000) / np.log(4))))
    mesh = disc(n=n // 4**refinements, graded=0.01)
    return mesh.refined(refinements) if refinements else mesh


def operator_row(mesh: MeshTri, substrate=SOIL, rtol=1e-6) -> tuple[Row, InfluenceOperator]:
    """Set up a fast operator and time it."""
    basis = DualMesh.from_mesh(mesh).basis()
    partition = basis.partition
    start = perf_counter()
    weights = EdgeWeights.from_basis(basis, partition, edge_ribs(partition))
    weights.moment  # noqa: B018
    between = perf_counter()
    arguments = substrate, partition, partition.centroids, weights, rtol
    operator = InfluenceOperator.from_partition(*arguments, "fast")
    setup = perf_counter() - between
    q = np.ones((len(partition), 3))
    product = best(lambda: operator @ q[:, 0], 3)
    three = best(lambda: operator @ q, 3) / product
    row = Row(
        len(partition), between - start, setup, product, three, operator.memory, operator.error,
        operator.row_error,
    )  # fmt: skip
    return row, operator


def main(sizes=(1000, 10_000, 100_000), solutions=True) -> dict:
    """Print the tables; return {(kind, n): Row}."""
    _print_head()
    found = {}
    for kind, mesh in (("uniform", rings), ("graded", graded)):
        operator_row(mesh(1000))  # compiles
        for n in sizes:
            row, operator = operator_row(mesh(n))
            found[kind, n] = row
            _print_row(kind, row)
            if solutions:
                _solve(operator, row.setup + row.weights)
    return found


def _print_head() -> None:
    print(
        f"{'mesh':<9}{'cells':>9}{'weights s':>11}{'set-up s':>10}{'us/cell':>9}{'product s':>11}"
        f"{'us/cell':>9}{'three':>7}{'MB':>8}{'error':>9}{'rows':>9}"
    )


def _print_row(kind: str, row: Row) -> None:
    print(
        f"{kind:<9}{row.n:>9}{row.weights:>11.2f}{row.setup:>10.2f}"
        f"{row.setup / row.n * 1e6:>9.2f}{row.product:>11.4f}"
        f"{row.product / row.n * 1e6:>9.2f}{row.three:>7.2f}{row.memory / 1e6:>8.0f}"
        f"{row.error:>9.1e}{row.row_error:>9.1e}",
        flush=True,
    )


def _solve(operator: InfluenceOperator, setup: float, exact: float = 0.5) -> None:
    """Three right-hand sides of the rigid disc."""
    x = operator.x
    start = perf_counter()
    inverse = Preconditioner.from_operator(operator)
    ready = perf_counter() - start
    rhs = np.vstack([np.ones(x.shape[1]), x]).T
    found = solve_many(operator, rhs, 1e-6, preconditioner=inverse)
    end = perf_counter() - start
    force = float(operator.partition.areas @ found.solution[:, 0])
    print(
        f"{'':<9}solution: preconditioner {ready:.2f} s, with it {end:.2f} s, in all "
        f"{setup + end:.2f} s; iterations {list(found.iterations)}; settlement of the "
        f"circle {1 / (exact * force) - 1:+.1e}",
        flush=True,
    )


def dense(sizes=(1000, 4000, 10_000)) -> None:
    """Print nanoseconds per entry of dense matrices."""
    print(f"\n{'dense':<9}{'cells':>9}{'rtol':>9}{'ns/entry':>10}{'rows':>9}")
    for n in sizes:
        basis = DualMesh.from_mesh(rings(n)).basis()
        partition = basis.partition
        weights = EdgeWeights.from_basis(basis, partition, edge_ribs(partition))
        x = partition.centroids
        for rtol in (3e-6, 1e-6):
            seconds = best(lambda: moment_matrix(SOIL, partition, x, weights, rtol), 5)  # noqa: B023
            operator = InfluenceOperator.from_partition(SOIL, partition, x, weights, rtol, "dense")
            entry = seconds / len(partition) ** 2 * 1e9
            print(
                f"{'':<9}{len(partition):>9}{rtol:>9.0e}{entry:>10.2f}{operator.row_error:>9.1e}"
            )


def ground(n=100_000) -> None:
    """Print the same for a graded half-space."""
    print("\nGraded half-space")
    _print_head()
    operator_row(rings(1000), GROUND)
    row, operator = operator_row(rings(n), GROUND)
    _print_row("uniform", row)
    _solve(operator, row.setup + row.weights, 0.2794736165)  # trusted digits


def punches(sizes=(10_000, 100_000)) -> dict:
    """Print seconds from a mesh to the answers: full contact, then lifting off; return them."""
    print("\nRigid disc, mesh given, e = a / 2: settlement W0 E* a / P = 0.4821 (trusted digits)")
    print(f"{'mesh':<9}{'cells':>9}{'full contact s':>16}{'lift-off s':>12}{'steps':>7}{'W0':>9}")
    found = {}
    for kind, mesh in (("uniform", rings), ("graded", graded)):
        for n in sizes:
            triangulation = mesh(n)
            start = perf_counter()
            basis = DualMesh.from_mesh(triangulation).basis()
            punch = RigidPunch(SOIL, basis, rtol=1e-6)
            punch.solve(1.0)
            between = perf_counter()
            print(f"{kind:<9}{len(basis.partition):>9}{between - start:>16.2f}", end="")
            lifted = punch.solve(1.0, (0.5, 0.0))
            end = perf_counter()
            found[kind, n] = between - start, lifted
            print(
                f"{end - between:>12.2f}{lifted.iterations:>7}{lifted.settlement:>9.5f}",
                flush=True,
            )
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--million", action="store_true")
    arguments = parser.parse_args()
    warn_beside_other_work()
    if arguments.small:
        main((1000,))
        punches((1000,))
    else:
        main((1000, 10_000, 100_000) + (1_000_000,) * arguments.million)
        dense()
        ground()
        punches()  # growth.py goes on to a million
