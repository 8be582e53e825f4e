"""Figure 4: the Preprocessor. Relocation, dual grid and general triangulation.

The inner nodes of a triangulation move to the means of their neighbours (upper row), or to the
barycentres of their cells in the dual grid (lower row). The general triangulation has the nodes of
both grids.
"""

from dataclasses import dataclass

import numpy as np
from gallery import draw_dual, panels, run, without_axes
from skfem import MeshTri

from skfem_dual import DualMesh
from skfem_dual.grids.general import general_triangulation
from skfem_dual.grids.generate import disc
from skfem_dual.grids.preprocess import PreprocessReport, relocate
from skfem_dual.grids.quality import MeshQuality


@dataclass(frozen=True)
class Result:
    """For each kind of relocation the couple, the general triangulation and the report."""

    before: MeshTri
    rows: dict[str, tuple[DualMesh, MeshTri, PreprocessReport]]

    def __str__(self) -> str:
        lines = []
        for name, (_, general, report) in self.rows.items():
            angle = MeshQuality(general).smallest_angles
            lines.append(
                f"to {name}: {report!r}\n  General triangulation: {general.nelements} triangles, "
                f"smallest angle {angle.min():.1f}, on average {angle.mean():.1f} degrees"
            )
        return "\n".join(lines)


def main(n=145, nboundary=40) -> Result:
    """Shake the nodes of a disc, and let the Preprocessor put them right."""
    mesh = disc(n=n, nboundary=nboundary)
    p, inner = mesh.p.copy(), mesh.interior_nodes()
    size = 0.45 / np.sqrt(n)
    p[:, inner] += np.random.default_rng(3).uniform(-size, size, (2, len(inner)))
    before = MeshTri(p, mesh.t)
    rows = {}
    for to in ("neighbours", "cells"):
        moved, report = relocate(before, to)
        rows[to] = DualMesh.from_mesh(moved), general_triangulation(moved), report
    return Result(before, rows)


def visualize(result: Result):
    """Before and after; the dual grids and general triangulations of both relocations."""
    from skfem_dual.visuals.matplotlib import draw
    from skfem_dual.visuals.style import DUAL

    names = {"neighbours": "means\nof neighbours", "cells": "barycentres\nof cells"}
    first = panels(1, 2, 2.8)
    after = result.rows["neighbours"][0].mesh
    for ax, mesh, title in zip(first, (result.before, after), ("before", "after"), strict=True):
        draw(mesh, ax=ax, legend=False)
        without_axes(ax, title)
    pictures = {"relocation": first[0]}
    for to, (dual, general, _) in result.rows.items():
        left, right = panels(1, 2, 2.8)
        draw_dual(dual, left)
        without_axes(left, f"nodes at {names[to]}")
        draw(general, ax=right, legend=False)
        n = len(dual)
        right.plot(*general.p[:, n : n + dual.mesh.nelements], "o", color=DUAL, ms=2)
        without_axes(right, "general triangulation")
        pictures[f"to_{to}"] = left
    return pictures


if __name__ == "__main__":
    run(main, visualize)
