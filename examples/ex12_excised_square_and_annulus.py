"""Figures 12 and 13: a square punch with excised corners, and an eccentric annular one.

Both under a force P = E a^2 through the origin, nu = 1/4; a is half the side of the square and
the outer radius of the annulus. The triangulations have the paper's numbers of triangles and
nodes. Its sizes of the excisions and of the hole are not printed: here squares of side a / 2 and a
circle of radius 0.3 a about (0.3 a, 0). The hole lies beside the force, so the annulus tilts.

With constant pressures, nodes and centroids as points of collocation bracket the settlement; the
couple of solutions on dual cells and on triangles tells how far apart they are and mixes them.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gallery import draw_dual, panels, run, sheet, without_axes

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch, estimate_error
from skfem_dual.io import read_mesh
from skfem_dual.post.estimate import CoupleEstimate

SOIL = HalfSpace(young=1.0, poisson=0.25)
DATA = Path(__file__).parents[1] / "tests" / "data"
#: mesh, and printed numbers of triangles and dual cells
PUNCHES = {
    "excised square": (DATA / "excised_square.msh", 1118, 608),
    "eccentric annulus": (DATA / "eccentric_annulus.msh", 929, 539),
}
LEVELS = {
    "excised square": np.array([0.5, 0.55, 0.6, 0.7, 0.8, 1.0, 1.25, 1.5, 2.0]),
    "eccentric annulus": np.array([0.52, 0.55, 0.6, 0.65, 0.7, 0.8, 1.0, 1.25, 1.5, 2.0]),
}


@dataclass(frozen=True)
class Punch:
    """A couple of grids, solutions by their schemes and what the couple tells of the error."""

    dual: DualMesh
    solutions: dict[str, PunchSolution]
    estimate: CoupleEstimate


@dataclass(frozen=True)
class Result:
    """Punches by their names."""

    punches: dict[str, Punch]

    def __str__(self) -> str:
        lines = []
        for name, punch in self.punches.items():
            _, triangles, cells = PUNCHES[name]
            dual, e = punch.dual, punch.estimate
            lines += [
                f"{name}, paper: N_T = {triangles}, N_V = {cells}, K_TV = {triangles / cells:.2f}",
                f"{'ours: N_T = ':>{len(name) + 14}}{dual.mesh.nelements}, N_V = {len(dual)}, "
                f"K_TV = {dual.K_TV:.2f}",
                f"  {'':<26}{'W0 / a':<10}{'tilt (Lx, Ly)':<24}p / mean p of cells",
            ]
            for scheme, s in punch.solutions.items():
                tilt = "({:+.5f}, {:+.5f})".format(*(round(t, 5) + 0.0 for t in s.tilt))
                low, high = s.pressure.min() / s.mean_pressure, s.pressure.max() / s.mean_pressure
                lines.append(
                    f"  {scheme:<26}{s.settlement:<10.5f}{tilt:<24}{low:.3f} to {high:.2f}"
                )
            low, high = e.settlement
            lines.append(
                f"  couple of constants: W0 / a from {low:.5f} to {high:.5f}, "
                f"mixed {e.mixed_settlement:.5f}"
            )
        return "\n".join(lines)


def solve(mesh) -> Punch:
    """On both grids with constant pressures and edge-weighted; all cells stay in contact."""
    dual = DualMesh.from_mesh(mesh)
    cells, triangles = dual.basis(), dual.primal_basis()
    schemes = {
        "constant, centroids": (cells, {"edge": "constant"}),
        "constant, nodes": (cells, {"edge": "constant", "collocation": "node"}),
        "constant, triangles": (triangles, {"edge": "constant"}),
        "edge-weighted": (cells, {}),
        "edge-weighted, triangles": (triangles, {}),
    }
    solutions = {
        name: RigidPunch(SOIL, basis, **options).solve(1.0, unilateral=False)
        for name, (basis, options) in schemes.items()
    }
    estimate = estimate_error(solutions["constant, nodes"], solutions["constant, triangles"])
    return Punch(dual, solutions, estimate)


def main() -> Result:
    """Solve for both punches."""
    return Result({name: solve(read_mesh(path)) for name, (path, *_) in PUNCHES.items()})


def visualize(result: Result):
    """Isobars of edge-weighted cells; the other panels of each figure."""
    pictures = {
        name.replace(" ", "_"): draw_isobars(name, p) for name, p in result.punches.items()
    }
    for name, punch in result.punches.items():
        pictures[f"grids_of_{name.replace(' ', '_')}"] = draw_grids(punch)
    return pictures


def draw_isobars(name: str, punch: Punch):
    """With the force at the cross."""
    from skfem_dual.visuals.matplotlib import isobars
    from skfem_dual.visuals.style import OUTLINE

    ax = sheet(3.6)
    ax.plot(0, 0, "+", color=OUTLINE, ms=13, mew=2.5)
    isobars(punch.solutions["edge-weighted"], levels=LEVELS[name], ax=ax)
    ax.set_axis_off()
    return ax


def draw_grids(punch: Punch):
    from skfem_dual.visuals.matplotlib import draw

    left, right = panels(1, 2, 2.8)
    draw(punch.dual.mesh, ax=left, legend=False)
    without_axes(left, f"{punch.dual.mesh.nelements} triangles")
    draw_dual(punch.dual, right)
    without_axes(right, f"{len(punch.dual)} dual cells")
    return left


if __name__ == "__main__":
    run(main, visualize)
