"""Figure 5: dual grids of several plans, both grids shown together.

Near-uniform, non-regular triangulations made from outlines: similar size, close to equilateral,
every inner node the mean of its neighbours (conditions a, b, c of Section 4.2 of the paper).
"""

from dataclasses import dataclass

import numpy as np
from gallery import fill_cells, legend_below, panels, run, sheet, without_axes

from skfem_dual import DualMesh
from skfem_dual.grids.generate import annulus, polygon
from skfem_dual.grids.quality import MeshQuality

EXCISED = (
    [-1, -0.5, -0.5, 0.5, 0.5, 1, 1, 0.5, 0.5, -0.5, -0.5, -1],
    [-0.5, -0.5, -1, -1, -0.5, -0.5, 0.5, 0.5, 1, 1, 0.5, 0.5],
)
ANGLE = ([-1, 1, 1, 0, 0, -1], [-1, -1, 0, 0, 1, 1])
WINDOW = ([-0.4, 0.1, 0.1, -0.4], [-0.5, -0.5, 0.0, 0.0])
TRIANGLE = (
    np.cos(np.pi / 2 + np.arange(3) * 2 * np.pi / 3).tolist(),
    np.sin(np.pi / 2 + np.arange(3) * 2 * np.pi / 3).tolist(),
)


@dataclass(frozen=True)
class Result:
    """Dual grids by the names of their plans."""

    duals: dict[str, DualMesh]

    def __str__(self) -> str:
        return "\n".join(
            f"{name}: {dual.mesh.nelements} triangles, {len(dual)} dual cells, "
            f"K_TV = {dual.K_TV:.2f}, smallest angle "
            f"{MeshQuality(dual.mesh).smallest_angles.min():.1f} degrees"
            for name, dual in self.duals.items()
        )


def main(n=200) -> Result:
    """Mesh the plans with about n nodes each."""
    meshes = {
        "square with excised corners": polygon(EXCISED, n=n),
        "eccentric annulus": annulus(0.3, n=n, hole=(0.3, 0.0)),
        "angle": polygon(ANGLE, n=n),
        "frame with a window": polygon(([-1, 1, 1, -1], [-1, -1, 1, 1]), [WINDOW], n=n),
        "triangle": polygon(TRIANGLE, n=n),
    }
    return Result({name: DualMesh.from_mesh(mesh) for name, mesh in meshes.items()})


def visualize(result: Result):
    """The frame with its cells; the other couples."""
    from skfem_dual.visuals.matplotlib import draw

    duals = dict(result.duals)
    frame, first = duals.pop("frame with a window"), sheet(3.9)
    draw(frame, ax=first, legend=False)
    fill_cells(first, frame.polygons)
    first.set_axis_off()
    legend_below(first, 3)
    axes = panels(2, 2, 5.2)
    for ax, (name, dual) in zip(axes, duals.items(), strict=True):
        draw(dual, ax=ax, legend=False)
        without_axes(ax, name)
    return {"dual_grid": first, "other_plans": axes[0]}


if __name__ == "__main__":
    run(main, visualize)
