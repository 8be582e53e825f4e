"""A million cells: a rigid footing through the fast operator.

A matrix of a million rows and columns would take 8 terabytes. The fast operator takes time and
memory in proportion to the number of cells, and is as accurate as it is told to be. A rigid circle
under a force at a / 4 from its centre has the exact settlement P / (2 a E*) and tilt
3 M / (4 a^3 E*). Its mesh, graded to the edge, is refined again and again, and its boundary put
back on the circle.

By default it goes up to some thousand cells, with ``--n 1000000`` to a million.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from gallery import run
from numpy import ndarray
from skfem import CellBasis, ElementTriP1, MeshTri

from skfem_dual import DualMesh, HalfSpace, InfluenceOperator, RigidPunch
from skfem_dual.contact.exact import circle_settlement, circle_tilt
from skfem_dual.grids.generate import disc
from skfem_dual.operators.iterative import solve_many

SOIL = HalfSpace(young=1.0, poisson=0.25)
ECCENTRICITY = 0.25
#: nodes of the first mesh, and of the finest that is drawn
FIRST, DRAWN = 290, 20_000


@dataclass(frozen=True)
class Row:
    """What one mesh took: seconds, bytes, errors."""

    cells: int
    mesh: float
    setup: float
    product: float
    solution: float
    histories: tuple[tuple[float, ...], ...]
    memory: int
    operator: float
    settlement: float
    tilt: float

    def __str__(self) -> str:
        iterations = "/".join(str(len(h) - 1) for h in self.histories)
        return (
            f"{self.cells:<9}{self.mesh:<8.2f}{self.setup:<10.2f}{self.product:<11.4f}"
            f"{iterations:<12}{self.solution:<12.2f}{self.memory / 2**20:<8.1f}"
            f"{self.operator:<12.1e}{self.settlement:<+12.1e}{self.tilt:+.1e}"
        )


@dataclass(frozen=True)
class Result:
    """Rows from coarse to fine, their meshes, and the pressures on the last."""

    rows: list[Row]
    meshes: list[MeshTri]
    pressure: ndarray

    def __str__(self) -> str:
        head = (
            f"{'cells':<9}{'mesh s':<8}{'set-up s':<10}{'product s':<11}{'iterations':<12}"
            f"{'solution s':<12}{'MiB':<8}{'operator':<12}{'settlement':<12}tilt"
        )
        return "\n".join([f"{'':<70}relative errors of", head, *map(str, self.rows)])


def refined(mesh: MeshTri) -> MeshTri:
    """Twice as fine, with the boundary nodes on one circle of the area of the unit circle."""
    mesh = mesh.refined()
    p, edge = mesh.p.copy(), mesh.boundary_nodes()
    p[:, edge] /= np.hypot(*p[:, edge])
    area = abs(np.linalg.det((p[:, mesh.t[1:]] - p[:, None, mesh.t[0]]).T)).sum() / 2
    return MeshTri(p * np.sqrt(np.pi / area), mesh.t)


def meshes(n: int) -> Iterator[MeshTri]:
    """From coarse to fine, up to about n nodes."""
    mesh = disc(n=FIRST, graded=0.2)
    while True:
        yield mesh
        if 4 * mesh.nvertices > 1.3 * n:
            return
        mesh = refined(mesh)


def measured(mesh: MeshTri, rtol: float, start: float) -> tuple[Row, ndarray]:
    """Solve on a mesh that was begun at the time ``start``; what it took, and the pressures.

    `RigidPunch` does the same beyond 4000 cells; here with the fast operator in any case.
    """
    dual = DualMesh.from_mesh(mesh)
    meshed = perf_counter()
    punch = RigidPunch(SOIL, dual.basis())
    cells = punch.partition, punch.collocation_points, punch.footprint.slopes
    operator = InfluenceOperator.from_partition(SOIL, *cells, rtol, method="fast")
    ready = perf_counter()
    operator @ np.ones(len(dual))
    multiplied = perf_counter()
    iterated = solve_many(operator, punch.planes(operator.x).T, rtol)
    unit = iterated.solution
    # settlement and tilts by which the pressures balance the force
    position = np.linalg.solve(punch.resultants @ unit, [1.0, ECCENTRICITY, 0.0])
    end = perf_counter()
    moduli = SOIL.young, SOIL.poisson
    row = Row(
        cells=len(dual),
        mesh=meshed - start,
        setup=ready - meshed,
        product=multiplied - ready,
        solution=end - multiplied,
        histories=iterated.residuals,
        memory=operator.memory,
        operator=operator.error,
        settlement=position[0] / circle_settlement(1.0, 1.0, *moduli) - 1,
        tilt=position[1] / circle_tilt(ECCENTRICITY, 1.0, *moduli) - 1,
    )
    return row, unit @ position


def main(n=5000, rtol=1e-6) -> Result:
    """Solve on meshes of up to about n nodes."""
    measured(next(meshes(FIRST)), rtol, 0.0)  # compiles
    rows, used, start = [], [], perf_counter()
    for mesh in meshes(n):
        row, pressure = measured(mesh, rtol, start)
        rows.append(row)
        used.append(mesh)
        start = perf_counter()
    return Result(rows, used, pressure)


def visualize(result: Result):
    """Isobars, drawn on one of the meshes; errors; seconds."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import NullLocator

    from skfem_dual.visuals.curves import LINES
    from skfem_dual.visuals.matplotlib import isobars

    _, (plan, error, time) = plt.subplots(1, 3, figsize=(14, 4.2), layout="constrained")
    # refinement keeps the numbers of the nodes, and a node has the number of its cell
    drawn = max((m for m in result.meshes if m.nvertices <= DRAWN), key=lambda m: m.nvertices)
    some = drawn.nvertices
    mesh = MeshTri(np.ascontiguousarray(result.meshes[-1].p[:, :some]), drawn.t)
    levels = [0.4, 0.5, 0.6, 0.75, 1.0, 1.5, 2.0, 3.0]
    p = np.pi * result.pressure[:some]
    isobars(CellBasis(mesh, ElementTriP1()), p, levels, title="p / mean p", ax=plan)
    plan.plot(ECCENTRICITY, 0, "+", color="#1a1a1a", ms=9, mew=2)
    plan.set_title(f"{result.rows[-1].cells} cells", fontsize=10)

    n = np.array([row.cells for row in result.rows])
    for ax, names in (
        (error, ("settlement", "tilt", "operator")),
        (time, ("setup", "solution", "product")),
    ):
        for (color, style), name in zip(LINES, names, strict=False):
            values = np.abs([getattr(row, name) for row in result.rows])
            label = {"setup": "set-up", "operator": "operator, on sampled rows"}.get(name, name)
            ax.loglog(n, values, style, color=color, marker="o", ms=4, mfc="white", label=label)
        ax.set_xticks(n, labels=n, fontsize=8)
        ax.xaxis.set_minor_locator(NullLocator())
        ax.set_xlabel("dual cells")
        ax.legend(frameon=False, fontsize=9)
        ax.spines[["top", "right"]].set_visible(False)
    error.set_ylabel("relative error")
    time.set_ylabel("seconds")
    plan.show = plt.show
    return {"million_cells": plan}


if __name__ == "__main__":
    run(main, visualize)
