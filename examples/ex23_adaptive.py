"""Adaptive refinement by the couple of solutions: error against unknowns.

Punches of square and L-shaped plan on a half-space under a central force. Pressures are constant
in the cells. In each step the difference of the solutions on dual cells and on triangles marks
the triangles to refine; where the dual grid becomes invalid the mesh is repaired. The couple
brackets the settlement, and a fixed mixture of its ends is nearer than both.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run, sheet, without_axes
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, RigidPunch, repair
from skfem_dual.post.estimate import CoupleEstimate, estimate_error, marked

#: force over settlement for E* = 1 and half-side 1, the L of three unit squares about its corner;
#: the square from elsewhere, the L extrapolated to 5e-6 (benchmarks/eight_plans.py)
STIFFNESS = {"square": np.pi * 0.733576, "L-shape": 1.925276}


@dataclass(frozen=True)
class Result:
    """Steps ``steps[plan, kind]``, each a mesh and its estimate; kind uniform or adaptive."""

    steps: dict[tuple[str, str], list[tuple[MeshTri, CoupleEstimate]]]

    def errors(self, plan: str, kind: str):
        """Unknowns (triangles); relative errors below, above, mixed; indicator, an energy."""
        steps = self.steps[plan, kind]
        exact = 1 / STIFFNESS[plan]
        found = np.array([[*e.settlement, e.mixed_settlement] for _, e in steps])
        indicator = np.array([e.total**2 for _, e in steps]) / exact
        return np.array([m.nelements for m, _ in steps]), (found / exact - 1).T, indicator

    def __str__(self) -> str:
        rows = [f"{'plan':<10}{'mesh':<10}{'triangles':<11}{'below':<11}{'above':<11}mixed"]
        for plan, kind in self.steps:
            n, errors, _ = self.errors(plan, kind)
            for ni, e in zip(n, errors.T, strict=True):
                rows.append(f"{plan:<10}{kind:<10}{ni:<11}" + "".join(f"{x:<+11.1e}" for x in e))
        return "\n".join(rows)


def coarse(plan: str) -> MeshTri:
    """A uniform mesh to begin with."""
    lines = np.linspace(-1, 1, 7)
    mesh = MeshTri.init_tensor(lines, lines)
    if plan == "square":
        return mesh
    x, y = mesh.p[:, mesh.t].mean(axis=1)
    return mesh.remove_elements(np.nonzero((x > 0) & (y > 0))[0])


def estimate(mesh: MeshTri) -> CoupleEstimate:
    """Solve on both grids."""
    dual, soil = DualMesh.from_mesh(mesh), HalfSpace(1.0, 0.0)
    below = RigidPunch(soil, dual.basis(), edge="constant", collocation="node")
    above = RigidPunch(soil, dual.primal_basis(), edge="constant")
    return estimate_error(below.solve(1.0), above.solve(1.0))


def main(most: int = 2400, fraction: float = 0.6) -> Result:
    """Refine uniformly and adaptively up to about ``most`` triangles."""
    steps = {}
    for plan in STIFFNESS:
        for kind in ("uniform", "adaptive"):
            mesh, found = coarse(plan), []
            while mesh.nelements <= most:
                found.append((mesh, estimate(mesh)))
                chosen = marked(found[-1][1].on_triangles, fraction)
                mesh = mesh.refined() if kind == "uniform" else repair(mesh.refined(chosen))[0]
            steps[plan, kind] = found
    return Result(steps)


def visualize(result: Result):
    """An adaptive mesh; the errors of both plans."""
    from matplotlib.ticker import NullFormatter

    from skfem_dual.visuals.matplotlib import draw
    from skfem_dual.visuals.style import CONTACT, PRIMAL

    ax = sheet(3.7)
    mesh = result.steps["L-shape", "adaptive"][-1][0]
    draw(mesh, legend=False, ax=ax)
    without_axes(ax)
    pictures = {"adaptive_mesh": ax}
    colors = {"uniform": PRIMAL, "adaptive": CONTACT}
    for plan in STIFFNESS:
        ax = pictures[plan] = chart(3.9)
        for kind, color in colors.items():
            n, (_, above, mixed), _ = result.errors(plan, kind)
            ax.loglog(n, above, "o-", color=color, label=f"{kind}, triangles")
            ax.loglog(n, abs(mixed), "s--", color=color, mfc="white", label=f"{kind}, mixed")
        n, (_, above, _), _ = result.errors(plan, "adaptive")
        for slope, name, factor in ((0.5, "$n^{-1/2}$", 1.5), (1.0, "$n^{-1}$", 0.7)):
            line = above[0] * factor * (n[0] / n[[0, -1]]) ** slope
            ax.loglog(n[[0, -1]], line, color=PRIMAL, lw=1, zorder=0)
            ax.annotate(name, (n[-1], line[-1]), (4, -3), textcoords="offset points")
        ax.set_title(plan)
        ax.set_xlabel("triangles")
        ax.set_ylabel("error of the settlement")
        ax.xaxis.set_minor_formatter(NullFormatter())
        legend_below(ax, columnspacing=1, handlelength=1.6)
    return pictures


if __name__ == "__main__":
    run(main, visualize)
