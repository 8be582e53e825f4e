"""Structures on the ground: seconds beside other ways to the same answer.

    python benchmarks/structures.py            all rows, some minutes
    python benchmarks/structures.py --quick    small ones of each kind

A raft is a circular plate (Morley) under a central patch, off which its edge lifts; a block of
tetrahedra carries a load on a part of its top. Times are those of the structure's
factors, of the ground's matrix and of the contact. Beside them stands what one would write without
it: a dense compliance T K^-1 L by one solution for each cell, which is what example 29 does too,
and the same active set on the dense sum with the ground's matrix. The plate on the largest number
of cells takes products only, no matrix.
"""

import argparse
from dataclasses import dataclass
from resource import RUSAGE_SELF, getrusage
from time import perf_counter, process_time

import numpy as np
from quiet import warn_beside_other_work
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementTetP1,
    ElementTriMorley,
    ElementVector,
    LinearForm,
    MeshTet,
)
from skfem.helpers import dd, ddot, eye
from skfem.helpers import trace as sum_of_diagonal
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import DualMesh, ElasticPunch, ElasticSolution, HalfSpace, trace
from skfem_dual.grids.generate import disc

SOIL = HalfSpace(1.0, 0.0)
#: cells under rafts of the relative stiffness 0.1, nodes along the edges of blocks
RAFTS, BLOCKS, LARGEST = (600, 2000), (10, 20), 100_000


@BilinearForm
def bending(u, v, _):
    return ddot(0.8 * dd(u) + 0.2 * eye(sum_of_diagonal(dd(u)), 2), dd(v))


@LinearForm
def patch(v, w):
    return (np.hypot(*w.x) < 0.2) * v


def raft(n: int, refined: bool = True) -> tuple[dict, np.ndarray]:
    """Arguments of an `ElasticPunch` and its load; the plate is refined to the cells or not."""
    dual = DualMesh.from_mesh(disc(n=n))
    plate = CellBasis(dual.refinement if refined else dual.mesh, ElementTriMorley())
    K = 0.1 / 12 / 0.96 * bending.assemble(plate)
    return {"basis": dual.basis(), "structure": plate, "stiffness": K}, patch.assemble(plate)


def block(n: int) -> tuple[dict, np.ndarray]:
    """The same of a cube that is loaded beside its middle."""
    mesh = MeshTet.init_tensor(*[np.linspace(0, 1, n)] * 3)
    mesh = mesh.with_boundaries({"base": lambda x: x[2] == 0})
    basis = Basis(mesh, ElementVector(ElementTetP1()))
    K = linear_elasticity(*lame_parameters(10.0, 0.3)).assemble(basis)
    loaded = (mesh.p[2] == 1) & (mesh.p[0] < 0.4)
    f = np.zeros(basis.N)
    f[basis.nodal_dofs[2, loaded]] = -1 / loaded.sum()
    cells = DualMesh.from_mesh(trace(mesh, "base")).basis()
    return {"basis": cells, "structure": basis, "stiffness": K, "boundary": "base"}, f


@dataclass(frozen=True)
class Row:
    """A solution, and CPU and wall seconds."""

    solution: ElasticSolution
    cpu: float
    wall: float
    dense: float
    difference: float

    def __str__(self) -> str:
        s = self.solution
        memory = getrusage(RUSAGE_SELF).ru_maxrss / 2**10
        return (
            f"{len(s.pressure):>8}{len(s.f):>9}{len(s.contact):>10}{s.iterations:>5}    "
            f"{self.cpu:<9.2f}{self.wall:<9.2f}{s.timings['structure']:<11.2f}"
            f"{s.timings['assembly']:<10.2f}{s.timings['solution']:<10.2f}{self.dense:<9.2f}"
            f"{self.difference:<12.0e}{s.equilibrium_residual:<9.0e}{memory:.0f}"
        )


def measure(arguments: dict, f: np.ndarray, dense: bool = True) -> Row:
    """Solve, and with a dense matrix of the whole."""
    wall, cpu = perf_counter(), process_time()
    punch = ElasticPunch(SOIL, **arguments)
    solution = punch.solve(f)
    wall, cpu = perf_counter() - wall, process_time() - cpu
    if not dense:
        return Row(solution, cpu, wall, np.nan, np.nan)
    begin = process_time()
    other = punch.solve(f, method="active-set")
    seconds = process_time() - begin
    difference = np.abs(other.pressure - solution.pressure).max() / solution.pressure.max()
    return Row(solution, cpu, wall, seconds, float(difference))


def main(rafts=RAFTS, blocks=BLOCKS, largest=LARGEST) -> dict[tuple[str, int], Row]:
    """Print the table; return its rows."""
    print(
        f"{'':<8}{'cells':>8}{'DOFs':>9}{'contact':>10}{'its':>5}    {'CPU s':<9}{'wall s':<9}"
        f"{'structure':<11}{'ground':<10}{'contact':<10}{'dense':<9}{'difference':<12}"
        f"{'balance':<9}MiB"
    )
    found = {}
    for name, make, sizes in (("raft", raft, rafts), ("block", block, blocks)):
        for n in sizes:
            found[name, n] = measure(*make(n))
            print(f"{name:<8}{found[name, n]}", flush=True)
    if largest:
        found["raft", largest] = measure(*raft(largest, refined=False), dense=False)
        print(f"{'raft':<8}{found['raft', largest]}", flush=True)
    return found


if __name__ == "__main__":
    warn_beside_other_work()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    main((150,), (6,), 0) if quick else main()
