"""Figure 3: how the dual grid of a triangulation is constructed, and where it fails.

The cell of an inner node joins the barycentres around it directly. The cell of a boundary node
runs from the node over the middle of a boundary facet and the barycentres to the middle of the
other. Where two barycentres see each other past the end of their common facet, the construction
fails, though a^2 + b^2 < 5 c^2 for the sides a > b > c of every triangle suffices to exclude it.
"""

from dataclasses import dataclass

import numpy as np
from gallery import run, sheet, without_axes
from skfem import MeshTri

from skfem_dual import DualMesh, MeshError, check_mesh
from skfem_dual.grids.checks import MeshReport


@dataclass(frozen=True)
class Result:
    """The couple of panels a and b, the improper triangulation, and what is wrong with it."""

    dual: DualMesh
    improper: MeshTri
    report: MeshReport
    error: MeshError

    def __str__(self) -> str:
        return f"{self.dual!r}\n{self.report!r}"


def star(shift=(0.08, -0.05), spokes=6) -> MeshTri:
    """An inner node among unequal neighbours."""
    angle = 2 * np.pi * (np.arange(spokes) + 0.25 * np.sin(3 * np.arange(spokes))) / spokes
    radius = 1 + 0.15 * np.cos(2 * np.arange(spokes))
    p = np.hstack([np.array(shift)[:, None], radius * np.array([np.cos(angle), np.sin(angle)])])
    t = np.array([[0, 1 + k, 1 + (k + 1) % spokes] for k in range(spokes)])
    return MeshTri(p, np.ascontiguousarray(t.T, dtype=np.int32))


def main() -> Result:
    """Construct the dual grid, and fail to."""
    p = np.array([[0.0, 1.0, 3.9, 4.0], [0.0, 0.1, 1.5, -1.2]])
    improper = MeshTri(p, np.array([[0, 0], [1, 1], [2, 3]], dtype=np.int32))
    try:
        DualMesh.from_mesh(improper)
    except MeshError as error:
        return Result(DualMesh.from_mesh(star()), improper, check_mesh(improper), error)
    raise RuntimeError("the improper triangulation was accepted")


def visualize(result: Result):
    """An inner cell, a boundary cell, and the facet that its rib misses."""
    from matplotlib.patches import Polygon

    from skfem_dual.visuals.matplotlib import draw
    from skfem_dual.visuals.style import DUAL, OUTLINE

    axes = [sheet() for _ in range(3)]
    dual = result.dual
    for ax, node, title in ((axes[0], 0, "inner node"), (axes[1], 1, "boundary node")):
        draw(dual.mesh, ax=ax, legend=False)
        ax.add_patch(Polygon(dual.polygons[node].T, fc=DUAL, alpha=0.2, ec="none"))
        ax.add_patch(Polygon(dual.polygons[node].T, fill=False, ec=DUAL, lw=1.8))
        inner = dual.polygons.indices[dual.polygons.offsets[node] :][: dual.polygons.sizes[node]]
        m, nb = dual.mesh.nelements, dual.nboundary
        middle = dual.polygons[node].mean(axis=1)
        for k, vertex in enumerate(inner):
            name = "C" if vertex < m else "D" if vertex < m + nb else None
            if name:
                number = 1 + sum(1 for v in inner[:k] if (v < m) == (vertex < m) and v < m + nb)
                label(ax, dual.p[:, vertex], f"${name}_{{{number}}}$", DUAL, middle)
        label(ax, dual.mesh.p[:, node], "$P_i$", OUTLINE, middle + np.array([0.0, 1.0]))
        without_axes(ax, title)
    ax = axes[2]
    draw(result.improper, ax=ax, legend=False)
    centres = result.improper.p[:, result.improper.t].mean(axis=1)
    ax.plot(*centres, "o-", color=DUAL, lw=1.8, ms=4)
    for k, centre in enumerate(centres.T):
        label(ax, centre, f"$C_{k + 1}$", DUAL, centre + np.array([0.3, 2.0 * k - 1]), distance=24)
    for k, point in enumerate(result.improper.p.T):
        side = -1.0 if k == 0 else 1.0  # where there is room
        label(ax, point, f"$P_{k + 1}$", OUTLINE, point - [side, 0.0])
    without_axes(ax, "the rib misses its facet $P_1P_2$")
    return dict(zip(("inner_node", "boundary_node", "missed_facet"), axes, strict=True))


def label(ax, place, text, color, away_from, distance=11):
    """A name beside a point, on the side away from another; the point too."""
    ax.plot(*place, "o", color=color, ms=4)
    direction = place - away_from
    direction = direction / max(np.hypot(*direction), 1e-12)
    ax.annotate(
        text,
        place,
        distance * direction,
        textcoords="offset points",
        ha="center",
        va="center",
        color=color,
        bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7},
    )


if __name__ == "__main__":
    run(main, visualize)
