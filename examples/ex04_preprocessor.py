"""Figure 4: the Preprocessor. Relocation, dual grid and general triangulation.

The inner nodes of a triangulation move to the means of their neighbours (upper row), or to the
barycentres of their cells in the dual grid (lower row). The general triangulation has the nodes of
both grids.
"""

from dataclasses import dataclass

import numpy as np
from gallery import run, without_axes
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
    """A row of panels for each kind of relocation."""
    import matplotlib.pyplot as plt

    from skfem_dual.visuals.matplotlib import draw
    from skfem_dual.visuals.style import DUAL

    _, axes = plt.subplots(2, 4, figsize=(12.5, 6.6), layout="compressed")
    titles = {"neighbours": "means of neighbours", "cells": "barycentres of cells"}
    for row, (to, (dual, general, _)) in zip(axes, result.rows.items(), strict=True):
        draw(result.before, ax=row[0], legend=False)
        without_axes(row[0], "before")
        draw(dual.mesh, ax=row[1], legend=False)
        without_axes(row[1], f"nodes at the {titles[to]}")
        draw(dual, ax=row[2], legend=False)
        without_axes(row[2], "dual grid")
        draw(general, ax=row[3], legend=False)
        n = len(dual)
        row[3].plot(*general.p[:, n : n + dual.mesh.nelements], "o", color=DUAL, ms=2)
        without_axes(row[3], "general triangulation")
    axes[0, 0].show = plt.show
    return {"preprocessor": axes[0, 0]}


if __name__ == "__main__":
    run(main, visualize)
