"""Figures 9 and 10: a rigid circle on a triangulation close to uniform, beside the exact solution.

The circle of Table 1, P = E a^2, nu = 1/4, on 944 triangles with 513 nodes, 80 of them on the
boundary: not regular, not concentrated to the edge. Every one of its 513 dual cells has one
constant pressure, as in the paper; the pressure at a node is that of its cell, linear in between.
The exact one is p(r) = P / (2 pi a sqrt(a^2 - r^2)). Sigma is that of Table 1; what the paper
means by it, and its mesh, are not printed.

Constant pressures cannot follow it to the edge, and their neighbours pay for that. With
edge-weighted cells, one more curve, the unknowns are still the mean pressures of the same cells.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, draw_dual, panels, run, without_axes
from skfem import CellBasis, ElementTriP1

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.contact.exact import circle_pressure, circle_settlement
from skfem_dual.grids.generate import disc

SOIL = HalfSpace(young=1.0, poisson=0.25)
#: of p over its mean P / (pi a^2), for which the exact isobars are circles
LEVELS = np.array([0.52, 0.55, 0.6, 0.7, 0.8, 1.0, 1.25, 1.5, 2.0])


@dataclass(frozen=True)
class Result:
    """Couple of grids and solutions by their schemes."""

    dual: DualMesh
    solutions: dict[str, PunchSolution]

    @property
    def condition(self) -> float:
        """Of the matrix d_ij of constant cells with every row divided by its sum, cond_2."""
        matrix = self.solutions["constant, centroids"].punch.matrix
        return float(np.linalg.cond(matrix / matrix.sum(axis=1, keepdims=True)))

    def __str__(self) -> str:
        dual, constant = self.dual, self.solutions["constant, centroids"]
        rows = [f"{'':<28}{'paper':<10}ours"]
        for name, paper, ours in (
            ("triangles N_T", "944", f"{dual.mesh.nelements}"),
            ("dual cells N_V", "513", f"{len(dual)}"),
            ("K_TV", "1.84", f"{dual.K_TV:.2f}"),
            ("W / a", "0.47216", f"{constant.settlement:.5f}"),
            ("sigma", "115.3", f"{self.condition:.1f}"),
        ):
            rows.append(f"{name:<28}{paper:<10}{ours}")
        exact = circle_settlement(1.0, 1.0, 1.0, 0.25)
        rows += ["", f"{'':<28}{'W / a':<10}{'error':<11}rms error of p, r < 0.9 a"]
        for name, s in self.solutions.items():
            w = s.settlement
            rows.append(f"{name:<28}{w:<10.5f}{w / exact - 1:<+11.1e}{pressure_error(s):.1e}")
        rows.append(f"{'exact, circle':<28}{exact:.5f}")
        # sides are at r = a cos(x) / cos(theta): a mean of a (1 - x^2 / 3), to first order
        excess = (np.pi / dual.nboundary) ** 2 / 3
        rows.append(f"{'exact, its polygon':<28}{exact * (1 + excess):<10.5f}{excess:+.1e}")
        return "\n".join(rows)


def pressure_error(solution: PunchSolution) -> float:
    """Relative, in the collocation points away from the edge."""
    x = solution.punch.collocation_points
    x = x[:, np.hypot(*x) < 0.9]
    error = solution.pressure_at(x) / circle_pressure(x, 1.0, 1.0) - 1
    return float(np.sqrt(np.mean(error**2)))


def main(n=513, nboundary=80) -> Result:
    """Solve on the dual grid and on the triangles."""
    dual = DualMesh.from_mesh(disc(n=n, nboundary=nboundary, true_area=False))
    cells, triangles = dual.basis(), dual.primal_basis()
    schemes = {
        "constant, centroids": (cells, {"edge": "constant"}),
        "constant, nodes": (cells, {"edge": "constant", "collocation": "node"}),
        "constant, triangles": (triangles, {"edge": "constant"}),
        "edge-weighted": (cells, {}),
        "edge-weighted, triangles": (triangles, {}),
    }
    return Result(
        dual,
        {
            name: RigidPunch(SOIL, basis, **options).solve(1.0)
            for name, (basis, options) in schemes.items()
        },
    )


def visualize(result: Result):
    """Pressures of cells as columns; Figure 9 with its last tenth; Figure 10."""
    first = {"columns": draw_columns(result), "near_the_edge": draw_radius(result, 0.9, 3.2)}
    return first | {"along_the_radius": draw_radius(result, 0, 0.9), "grids": draw_grids(result)}


def draw_columns(result: Result):
    """The half of the cells behind y = 0."""
    from scenes import add, columns, shown, stage

    s = result.solutions["constant, centroids"]
    partition, p = s.punch.partition, np.pi * s.pressure
    points, t, cell = columns(partition.polygons, 0.25 * p)
    t, cell = (x[..., partition.centroids[1, cell] > -0.02] for x in (t, cell))
    plotter = stage()
    add(plotter, points, t, scalars=p[cell], clim=(0.4, 2.0), cmap="viridis")
    label = r"mean pressure of cells, $p\,\pi a^2 / P$"
    return shown(plotter, label, limits=(0.4, 2.0), eye=(-0.5, -2, 1.4), bar={"extend": "max"})


def draw_grids(result: Result):
    """Both grids, isobars of constant cells and of the exact pressure."""
    from skfem_dual.visuals.matplotlib import draw, isobars

    a, b, c, d = panels(2, 2, 5.4)
    mesh = result.dual.mesh
    draw(mesh, ax=a, legend=False)
    without_axes(a, f"{mesh.nelements} triangles")
    draw_dual(result.dual, b)
    without_axes(b, f"{len(result.dual)} dual cells")
    basis, p = result.solutions["constant, centroids"].pressure_field()
    isobars(basis, p * np.pi, LEVELS, title="", labels=False, ax=c)
    fine = CellBasis(mesh.refined(3), ElementTriP1())
    x = fine.doflocs * np.minimum(1.0, 0.9999 / np.maximum(np.hypot(*fine.doflocs), 0.5))
    isobars(fine, circle_pressure(x, np.pi, 1.0), LEVELS, title="", labels=False, ax=d)
    without_axes(c, "constant cells")
    without_axes(d, "exact")
    return a


def draw_radius(result: Result, start: float, top: float):
    """Pressures from a part of the radius on, up to ``top``."""
    from skfem_dual.visuals.curves import LINES

    ax = chart()
    r = np.linspace(start, 1, 600, endpoint=False)
    # along the radius through the middles of boundary facets, where the polygon ends first
    turn = np.pi / len(result.dual.mesh.boundary_nodes())
    x = r * np.array([[np.cos(turn)], [np.sin(turn)]])
    for (label, p), (color, style) in zip(
        (
            ("exact", circle_pressure(x, 1.0, 1.0)),
            ("constant cells", result.solutions["constant, centroids"].pressure_at(x)),
            ("edge-weighted cells", result.solutions["edge-weighted"].pressure_at(x)),
        ),
        LINES,
        strict=False,
    ):
        ax.plot(r, np.where(p > 0, p, np.nan), style, color=color, label=label)
    ax.set_xlim(start, 1)
    ax.set_ylim(0, top)
    ax.set_xlabel("r / a")
    ax.set_ylabel(r"$p\,a^2 / P$")
    ax.legend(loc="upper left")
    return ax


if __name__ == "__main__":
    run(main, visualize)
