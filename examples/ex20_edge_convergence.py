"""Settlement error against unknowns: node, centroid and edge-weighted cells on three meshes.

A rigid circle on a half-space settles by W = P (1 - nu^2) / (2 E a). Constant pressures on dual
cells bracket it, from below with nodes and from above with centroids as collocation points, and
converge like h on uniform meshes, like h^2 on meshes graded to the edge. Edge-weighted cells
follow the singular pressure and gain one to two orders of magnitude on any mesh.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, RigidPunch, check_mesh
from skfem_dual.contact.exact import circle_settlement
from skfem_dual.grids.generate import disc

SCHEMES = {
    "constant, node": {"edge": "constant", "collocation": "node"},
    "constant, centroid": {"edge": "constant"},
    "edge-weighted": {},
}
MESHES = ("uniform", "graded", "random")


@dataclass(frozen=True)
class Result:
    """Relative errors of the settlement, ``errors[mesh, scheme]`` = (cells, errors)."""

    errors: dict[tuple[str, str], tuple[np.ndarray, np.ndarray]]

    def __str__(self) -> str:
        rows = [f"{'mesh':<10}{'scheme':<22}relative error of the settlement (cells)"]
        for (mesh, scheme), (n, e) in self.errors.items():
            values = "  ".join(f"{ei:+.1e} ({ni})" for ni, ei in zip(n, e, strict=True))
            rows.append(f"{mesh:<10}{scheme:<22}{values}")
        return "\n".join(rows)


def make(kind: str, n: int) -> MeshTri:
    """Disc of about n nodes with the true area of the circle."""
    mesh = disc(n=n, graded="sine" if kind == "graded" else None)
    if kind != "random":
        return mesh
    inner = mesh.interior_nodes()
    rng = np.random.default_rng(0)
    for size in 0.4 * 0.8 ** np.arange(10) / np.sqrt(n):
        p = mesh.p.copy()
        p[:, inner] += rng.uniform(-size, size, (2, len(inner)))
        moved = MeshTri(p, mesh.t)
        if check_mesh(moved).ok:
            return moved
    raise RuntimeError("no perturbed mesh has a dual grid")


def main(sizes=(60, 150, 350, 800, 1800)) -> Result:
    """Solve all cases."""
    soil = HalfSpace(young=1.0, poisson=0.25)
    exact = circle_settlement(1.0, 1.0, 1.0, 0.25)
    errors = {}
    for kind in MESHES:
        duals = [DualMesh.from_mesh(make(kind, n)) for n in sizes]
        cells = np.array([len(dual) for dual in duals])
        for scheme, options in SCHEMES.items():
            found = [RigidPunch(soil, d.basis(), **options).solve(1.0).settlement for d in duals]
            errors[kind, scheme] = cells, np.array(found) / exact - 1
    return Result(errors)


def visualize(result: Result):
    """One picture for each kind of mesh."""
    from matplotlib.ticker import NullFormatter

    from skfem_dual.visuals.curves import LINES

    pictures, markers = {}, ("v", "^", "o")
    for kind in MESHES:
        ax = pictures[kind] = chart(3.5)
        for (color, style), marker, scheme in zip(LINES, markers, SCHEMES, strict=False):
            n, e = result.errors[kind, scheme]
            ax.loglog(n, np.abs(e), style, color=color, marker=marker, ms=7, label=scheme)
        n = n[[0, -1]]
        slope = 0.5 if kind != "graded" else 1.0
        e = np.abs(result.errors[kind, "constant, node"][1][0]) * 2 * (n[0] / n) ** slope
        ax.loglog(n, e, color="#9a9a9a", lw=1.2)
        power = "$h$" if slope == 0.5 else "$h^2$"
        ax.annotate(power, (n[1], e[1]), (4, -3), textcoords="offset points")
        ax.set_title(f"{kind} mesh")
        ax.set_xlabel("dual cells")
        ax.set_ylabel("error of the settlement")
        ax.xaxis.set_minor_formatter(NullFormatter())
        legend_below(ax, handlelength=1.6, columnspacing=1)
    return pictures


if __name__ == "__main__":
    run(main, visualize)
